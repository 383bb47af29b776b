//! What a setting costs and gains: differences, estimates of errors, fronts.

pub mod differences;
pub mod estimate;
pub mod pareto;

pub use differences::Differences;
pub use estimate::{ErrorEstimate, PowerLaw, sample_key};
pub use pareto::pareto_front;
