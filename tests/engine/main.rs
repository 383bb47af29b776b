//! The engine's answers: the same by every path, partition, order, instruction set and number of threads.

mod ambient;
mod frame;
mod layering;
mod partitions;
mod paths;
mod receivers;
