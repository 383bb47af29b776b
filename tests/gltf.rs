//! Reading glTF and GLB, and writing them back with ambient occlusion, from outside: files made by hand.

mod support;

#[path = "gltf/broken.rs"]
mod broken;
#[path = "gltf/hostile.rs"]
mod hostile;
#[path = "gltf/making.rs"]
mod making;
#[path = "gltf/occlusion.rs"]
mod occlusion;
#[path = "gltf/posing.rs"]
mod posing;
#[path = "gltf/reading.rs"]
mod reading;
#[path = "gltf/spoiling.rs"]
mod spoiling;
#[path = "gltf/tolerance.rs"]
mod tolerance;
#[path = "gltf/validator.rs"]
mod validator;
