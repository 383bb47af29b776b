//! Reads STL, binary and text. Corners at the same place become one vertex.
//!
//! A file is binary where its length is what the count of triangles says, even if it begins with `solid`, as some programs write;
//! else it is text where it begins so. Of several solids in a text each is an object. The normals of the file are not read: they are
//! those of its triangles.
//!
//! The crate for this, stl_io 0.11, takes binary files that begin with `solid` for text, ends at the first solid, refuses normals that
//! are NaN (programs write them for triangles without area) and names no line.
//!
//! Based on: 3D Systems, "StereoLithography Interface Specification", 1988.

use std::collections::HashMap;

use umbel_core::glam::DVec3;

use crate::error::{CORRECT_LINE, Problem};
use crate::files::budget::Budget;
use crate::formats::polygons::PolygonSource;
use crate::formats::polygons::faces::Faces;
use crate::formats::scene_file::is_binary_stl;
use crate::scene::{Object, Scene};

/// Bytes for each triangle: its corners and vertices while they are found, and in the scene. In a file it takes 50 bytes at least.
const TRIANGLE_BYTES: u64 = 3 * (24 + 12) + 12 + 12;
const LEAST_BYTES: u64 = 50;

/// The scene of a file's bytes.
pub(crate) fn read_stl(bytes: &[u8], drop_non_finite: bool, budget: &Budget) -> Result<Scene, Problem> {
    let most = bytes.len() as u64 / LEAST_BYTES;
    budget.check(most * TRIANGLE_BYTES, &format!("up to {most} triangles"))?;
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let begins_as_text =
        text.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    let mut mesh = Welded::default();
    if is_binary_stl(bytes) || !begins_as_text {
        mesh.binary(bytes)?;
    } else {
        mesh.text(&String::from_utf8_lossy(text))?;
    }
    let Welded { positions, corners, solids, .. } = mesh;
    let mut scene = Scene { positions, ..Scene::default() };
    let wide: Vec<DVec3> = scene.positions.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
    let faces =
        Faces { count: corners.len() / 3, corners: [corners, Vec::new(), Vec::new()], ..Faces::default() };
    let source = PolygonSource { faces: &[faces], wide: &|| wide.clone(), line_of: &|_| None };
    let starts: Vec<usize> = solids.iter().map(|&(_, first)| first).collect();
    let firsts = source.cut_into(&mut scene, &starts, drop_non_finite)?;
    let solids = solids.into_iter().zip(firsts.windows(2)).filter(|(_, range)| range[0] < range[1]);
    let object = |((name, _), range): ((String, usize), &[u32])| Object {
        name,
        triangles: range[0]..range[1],
        material: None,
    };
    scene.objects = solids.map(object).collect();
    Ok(scene)
}

/// Triangles with common vertices.
#[derive(Default)]
struct Welded {
    positions: Vec<[f32; 3]>,
    corners: Vec<u32>,
    /// Names, and the triangles before each.
    solids: Vec<(String, usize)>,
    indices: HashMap<[u32; 3], u32>,
}

impl Welded {
    fn push(&mut self, corner: [f32; 3]) {
        // −0 is the same place as 0.
        let key = corner.map(|x| (x + 0.0).to_bits());
        // In range: a triangle takes 50 bytes, so that 2³² corners are not in memory.
        let next = self.positions.len() as u32;
        let index = *self.indices.entry(key).or_insert(next);
        if index == next {
            self.positions.push(corner);
        }
        self.corners.push(index);
    }

    fn binary(&mut self, bytes: &[u8]) -> Result<(), Problem> {
        let count = bytes.get(80..84).and_then(|count| count.try_into().ok()).map(u32::from_le_bytes);
        let records = bytes.get(84..).unwrap_or_default().as_chunks::<50>().0;
        let Some(records) = count.and_then(|count| records.get(..count as usize)) else {
            return Err(Problem {
                line: None,
                what:
                    "this is no STL text, and for binary STL it is shorter than its count of triangles says"
                        .to_owned(),
                remedy: "Check that the file is whole, or export it again.",
            });
        };
        self.solids.push((String::new(), 0));
        for record in records {
            let [_, corners @ ..] = record[..48].as_chunks::<12>().0 else { continue };
            for corner in corners {
                let numbers = corner.as_chunks().0.iter().map(|&number| f32::from_le_bytes(number));
                let mut position = [0.0; 3];
                position.iter_mut().zip(numbers).for_each(|(x, number)| *x = number);
                self.push(position);
            }
        }
        Ok(())
    }

    /// Words in any case and with any blanks between them, a statement in each line.
    fn text(&mut self, text: &str) -> Result<(), Problem> {
        let mut is_within = false;
        let mut of_face = 0;
        for (number, line) in (1..).zip(text.lines()) {
            let mut words = line.split_whitespace();
            let Some(keyword) = words.next() else { continue };
            let problem = |what: String| Problem { line: Some(number), what, remedy: CORRECT_LINE };
            match keyword.to_ascii_lowercase().as_str() {
                "solid" if !is_within => {
                    is_within = true;
                    self.solids
                        .push((line.trim()[keyword.len()..].trim().to_owned(), self.corners.len() / 3));
                }
                "endsolid" if is_within && of_face == 0 => is_within = false,
                "vertex" if is_within && of_face < 3 => {
                    let numbers: Option<Vec<f32>> = words.map(|word| word.parse().ok()).collect();
                    let position = numbers.and_then(|numbers| numbers.try_into().ok());
                    self.push(position.ok_or_else(|| problem("a vertex needs three numbers".to_owned()))?);
                    of_face += 1;
                }
                "endfacet" if of_face == 3 => of_face = 0,
                "facet" | "outer" if is_within && of_face == 0 => {}
                "endloop" if of_face == 3 => {}
                _ => return Err(problem(format!("`{}` cannot stand here", line.trim()))),
            }
        }
        if is_within {
            return Err(Problem {
                line: None,
                what: "the text ends before its last solid does".to_owned(),
                remedy: "Check that the file is whole, or export it again.",
            });
        }
        Ok(())
    }
}
