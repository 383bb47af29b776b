//! The commands of umbel-bench, one file or folder each: what is measured, in which order, and where it is written.

pub(crate) mod ambient;
pub(crate) mod bounce;
pub(crate) mod cli;
pub(crate) mod cliffs;
pub(crate) mod coincident;
mod comparison;
mod crossover;
pub(crate) mod cube;
pub(crate) mod error;
pub(crate) mod leaks;
pub(crate) mod partitions;
pub(crate) mod primary;
pub(crate) mod reyes;
pub(crate) mod reyes_growth;
pub(crate) mod shadow;
