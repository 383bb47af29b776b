//! Shadows from outside: cubes and masks against formulas, against exact integers, and as files.
//!
//! The scenes of the formulas are a box around the light (its distances are known), and a triangle between a light and a
//! floor (the polygon of its shadow is known). Exact masks are those of the oracle's integers, receiver by receiver, for
//! lights anywhere and exactly on vertices, edges and planes.
//!
//! Based on: sections 5 (Shadows), 6 (cube faces) and 7 (`shadow`) of the design.

mod cubes;
mod exact;
mod files;
mod lookup;
mod masks;
mod refusals;
mod surfaces;

/// A floor of 20 x 20 at y = 0, and above it, at y = 2, a triangle. Both face up.
const FLOOR: &str = "\
o floor
v -10 0 10
v 10 0 10
v 10 0 -10
v -10 0 -10
f 1 2 3 4
o triangle
v -1 2 1
v 2 2 0
v -1 2 -1
f 5 6 7
";

/// The box from (−1, −2, −3) to (4, 5, 6).
const BOX: &str = "\
v -1 -2 -3
v 4 -2 -3
v -1 5 -3
v 4 5 -3
v -1 -2 6
v 4 -2 6
v -1 5 6
v 4 5 6
f 1 2 4 3
f 5 6 8 7
f 1 2 6 5
f 3 4 8 7
f 1 3 7 5
f 2 4 8 6
";
