//! The command line from outside: every test runs the binary in a directory of its own.
//!
//! stdout carries data only, stderr speaks only when there is something to say, and the exit code tells what happened.

mod manners;
mod names;
mod nasty;
mod outputs;
mod refusals;
mod reports;
mod verbs;

/// A square with the corners (±1, ±1) at z = 0, and behind it, at z = −1, a larger triangle.
const SQUARES: &str = "\
o front
v -1 -1 0
v 1 -1 0
v 1 1 0
v -1 1 0
f 1 2 3 4
o back
v -3 -1 -1
v 3 -1 -1
v 3 3 -1
f 5 6 7
";
