//! What is decided: the oracle against itself, and the engine against the oracle, where numbers are hardest.

mod conservative;
mod departure;
mod exact;
mod extremes;
mod oracle_self;
mod relations;
mod segments;
mod watertight;
