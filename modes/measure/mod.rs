//! What a setting costs and gains: differences, estimates of errors, fronts.

pub(crate) mod differences;
pub(crate) mod estimate;
pub(crate) mod pareto;
