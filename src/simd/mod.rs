//! Lanes of numbers and the instruction sets they run on.

pub(crate) mod isa;
pub(crate) mod lanes;
