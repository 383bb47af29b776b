//! From a rule to grids of points: what rays can tell apart, how finely a patch is diced, and its parts without cracks.
//!
//! A file uses those above it: [`dicing`] and [`detail`] say how fine, [`rule`] is what a surface has to answer,
//! [`density`] measures lines in pixels, [`patch`] keeps the rates of a part, [`dicer`] opens and dices, and [`grid`]
//! is what comes out.

pub(crate) mod density;
pub(crate) mod detail;
pub(crate) mod dicer;
pub(crate) mod dicing;
pub(crate) mod grid;
pub(crate) mod patch;
pub(crate) mod rule;
