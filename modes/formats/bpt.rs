//! Reads bicubic Bézier patches from `.bpt` files.
//!
//! The text begins with the number of patches. Each patch is a line with its two degrees, which must be `3 3`, and 16 lines with
//! the three coordinates of a control point. Empty lines, and what follows a `#`, are no part of it.
//!
//! Based on: Ryan Holmes, "Bezier Patches: the .bpt format", the form in which Newell's teaset is passed on.

use std::fs;
use std::path::Path;

use crate::error::Error;
use crate::error::{CORRECT_LINE, Problem};
use crate::surfaces::bezier::BezierPatches;

/// Reads a `.bpt` file.
///
/// # Errors
/// [`Error::Input`], with the line, for a file that cannot be read, numbers that are missing, not finite or too many, and patches
/// that are not bicubic.
pub fn read_bpt(path: &Path) -> Result<BezierPatches, Error> {
    let read = || {
        let bytes = fs::read(path).map_err(|error| Problem {
            line: None,
            what: format!("cannot be read: {error}"),
            remedy: "Give the path of a .bpt file that exists and that you may read.",
        })?;
        patches(&String::from_utf8_lossy(&bytes)).map(BezierPatches::new)
    };
    read().map_err(|problem: Problem| problem.at(path))
}

/// The lines that hold something, with their numbers.
struct Lines<'a, I: Iterator<Item = (u64, &'a str)>> {
    lines: I,
    last: u64,
}

impl<'a, I: Iterator<Item = (u64, &'a str)>> Lines<'a, I> {
    /// The numbers of the next line.
    fn numbers<const N: usize>(&mut self, what: &str) -> Result<[f32; N], Problem> {
        let Some((line, text)) = self.lines.next() else {
            return Err(Problem {
                line: Some(self.last),
                what: format!("the file ends where {what} should follow"),
                remedy: "The file is cut off, or its first line promises too many patches; export it again.",
            });
        };
        self.last = line;
        let wrong =
            || Problem { line: Some(line), what: format!("`{text}` should be {what}"), remedy: CORRECT_LINE };
        let numbers: Vec<f32> =
            text.split_whitespace().map(str::parse).collect::<Result<_, _>>().map_err(|_| wrong())?;
        let numbers = <[f32; N]>::try_from(numbers).map_err(|_| wrong())?;
        if numbers.iter().all(|x| x.is_finite()) { Ok(numbers) } else { Err(wrong()) }
    }
}

/// The control points of all patches of a text.
fn patches(text: &str) -> Result<Vec<[[f32; 3]; 16]>, Problem> {
    let content = text.lines().zip(1..).map(|(line, number)| {
        let line = line.split_once('#').map_or(line, |(line, _)| line);
        (number, line.trim())
    });
    let mut lines = Lines { lines: content.filter(|(_, line)| !line.is_empty()), last: 1 };
    let [count] = lines.numbers("the number of patches")?;
    let error = |line: u64, what: String| Problem { line: Some(line), what, remedy: CORRECT_LINE };
    if count.fract() != 0.0 || !(0.0..16_777_216.0).contains(&count) {
        return Err(error(lines.last, format!("{count} is no number of patches from 0 to 16777215")));
    }
    let mut patches = Vec::new();
    // In range: the number is whole and was checked.
    for patch in 1..=count as u32 {
        let degrees: [f32; 2] = lines.numbers("the two degrees of a patch, `3 3`")?;
        if degrees != [3.0; 2] {
            let [m, n] = degrees;
            return Err(error(
                lines.last,
                format!("patch {patch} has the degrees {m} and {n}; only bicubic patches, 3 and 3, are read"),
            ));
        }
        let mut points = [[0.0; 3]; 16];
        for point in &mut points {
            *point = lines.numbers("three coordinates of a control point")?;
        }
        patches.push(points);
    }
    match lines.lines.next() {
        Some((line, _)) => {
            Err(error(line, format!("there is more after the {count} patches of the first line")))
        }
        None => Ok(patches),
    }
}
