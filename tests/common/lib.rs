//! What the tests share: the oracle and its sides of planes, scenes and rays from seeds, and the command in a directory of its own.
//!
//! The oracle shares no idea and no code with the engine. A library of its own, so that it is compiled once.

pub mod command;
pub mod generators;
pub mod oracle;
pub mod random;
pub mod scenes;
pub mod sides;

/// A directory of its own in which the command runs, see [`command::Place`].
///
/// A macro, because only the tests of the package `umbel` are told where its binary is.
#[macro_export]
macro_rules! place {
    () => {
        $crate::command::Place::new(env!("CARGO_BIN_EXE_umbel"))
    };
}
