//! The command from outside: every test runs the binary in a directory of its own.

#[cfg(feature = "obj")]
mod bake;
#[cfg(feature = "obj")]
mod command;
mod golden;
#[cfg(all(feature = "obj", feature = "gltf"))]
mod hostile;
#[cfg(all(feature = "obj", target_os = "linux"))]
mod memory;
#[cfg(feature = "obj")]
mod probe;
#[cfg(feature = "obj")]
mod trade;
#[cfg(feature = "obj")]
mod visible;
