//! `umbel trade` and the dials, from outside: errors against formulas, the front, the page and its numbers, and settings
//! that are as good as was asked for.
//!
//! Times are never asserted: only what they must not change.

#[path = "trade/dials.rs"]
mod dials;
#[path = "trade/errors.rs"]
mod errors;
#[path = "trade/estimates.rs"]
mod estimates;
#[path = "trade/fronts.rs"]
mod fronts;
#[path = "trade/pages.rs"]
mod pages;
#[path = "trade/refusals.rs"]
mod refusals;
mod support;

/// A floor of 20 x 20 at y = 0 that faces up.
const FLOOR: &str = "\
v -10 0 10
v 10 0 10
v 10 0 -10
v -10 0 -10
f 1 2 3 4
";
