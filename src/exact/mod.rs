//! Decisions that are those of exact arithmetic: numbers that know their error, integers of fixed size, and the predicates of design section 5.

#[cfg(test)]
mod checks;
pub(crate) mod distance;
pub(crate) mod expansion;
pub(crate) mod filter;
pub(crate) mod integer;
pub(crate) mod planes;
pub(crate) mod predicates;
mod wide;
