//! Surfaces on demand: bound, split, dice, sample, forget.
//!
//! [`closest`] is what rays see, [`shadow`] what a light does not see, [`occlusion`] which rays of receivers are open,
//! and [`reference`](mod@reference) makes all triangles first, for tests and other engines. All of them go through
//! surfaces by the same [`walk`]. [`dice`] is how surfaces are split and diced, [`sample`] how rays meet a grid,
//! [`tile`] both for a tile of rays; in [`grid_triangles`] micropolygons wait to be tested as triangles.

pub(crate) mod closest;
pub(crate) mod dice;
pub(crate) mod grid_triangles;
pub(crate) mod occlusion;
pub(crate) mod reference;
pub(crate) mod sample;
pub(crate) mod shadow;
pub(crate) mod tile;
pub(crate) mod walk;
