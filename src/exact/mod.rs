//! Decisions that are those of exact arithmetic: numbers that know their error, expansions, and the predicates of design section 5.

pub(crate) mod expansion;
pub(crate) mod filter;
pub(crate) mod predicates;
