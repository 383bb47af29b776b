//! `umbel trade` and the dials, from outside: errors against formulas, the front, the page and its numbers, and settings
//! that are as good as was asked for.
//!
//! Times are never asserted: only what they must not change.

mod dials;
mod errors;
mod estimates;
mod fronts;
mod pages;
mod refusals;

/// A floor of 20 x 20 at y = 0 that faces up.
const FLOOR: &str = "\
v -10 0 10
v 10 0 10
v 10 0 -10
v -10 0 -10
f 1 2 3 4
";
