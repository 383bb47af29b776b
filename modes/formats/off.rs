//! Reads Object File Format (OFF): positions and polygons as plain text, with normals and texture coordinates if its first word
//! says so.
//!
//! `[ST][C][N]OFF`, then the numbers of vertices, faces and edges, then a line for each vertex (x y z, a normal, a colour, s t) and
//! for each face (n, then n indices from 0, then perhaps a colour). `#` begins a comment. Colours are not read. Four-dimensional (`4OFF`,
//! `nOFF`) and binary files are refused.
//!
//! The one crate that reads this, off-rs 2.0, refuses `NOFF` and counts in the line of the keyword, which are common.
//!
//! Based on: The Geometry Center, "Geomview Manual", 1.9, section "OFF", 2014.

use umbel_core::glam::DVec3;

use crate::error::{CORRECT_LINE, Problem};
use crate::files::budget::Budget;
use crate::formats::polygons::PolygonSource;
use crate::formats::polygons::faces::Faces;
use crate::scene::{NO_INDEX, Object, Scene};

/// Bytes for each vertex and for each face of the header, while they are read and in the scene.
const VERTEX_BYTES: u64 = 24 + 12 + 12 + 8;
const FACE_BYTES: u64 = 4 + 3 * 12 + 3 * 12;

/// The scene of a file's bytes.
pub(crate) fn read_off(bytes: &[u8], drop_non_finite: bool, budget: &Budget) -> Result<Scene, Problem> {
    let text = String::from_utf8_lossy(bytes);
    let mut lines = Lines { lines: text.lines().enumerate(), line: 0 };
    let (kind, counts) = header(&mut lines)?;
    let [vertices, faces] = counts;
    // A line is at least two bytes long.
    if vertices.saturating_add(faces) > bytes.len() as u64 / 2 + 1 {
        return Err(lines.problem(format!("there are no {vertices} vertices and {faces} faces in this file")));
    }
    let what = format!("{faces} faces and {vertices} vertices");
    budget.check(vertices * VERTEX_BYTES + faces * FACE_BYTES, &what)?;
    let mut scene = Scene::default();
    let mut wide = Vec::with_capacity(vertices as usize);
    let mut position_lines = Vec::with_capacity(vertices as usize);
    for _ in 0..vertices {
        let words = lines.next("a vertex")?;
        position_lines.push(lines.line);
        let [x, y, z] =
            numbers::<3, f32>(&words, 0).ok_or_else(|| lines.problem("a vertex needs three numbers"))?;
        scene.positions.push([x, y, z]);
        wide.push(DVec3::from_array(numbers(&words, 0).unwrap_or([f64::NAN; 3])));
        if kind.has_normals {
            let normal =
                numbers(&words, 3).ok_or_else(|| lines.problem("a vertex of NOFF needs a normal"))?;
            scene.normals.push(normal);
        }
        if kind.has_uvs {
            let uv = words
                .len()
                .checked_sub(2)
                .filter(|&first| first >= 3)
                .and_then(|first| numbers(&words, first));
            scene.uvs.push(uv.ok_or_else(|| lines.problem("a vertex of STOFF needs texture coordinates"))?);
        }
    }
    let polygons = polygons(&mut lines, faces, vertices, &mut scene.warnings)?;
    let polygons = polygons.with_indices_of_positions([kind.has_uvs, kind.has_normals]);
    let source = PolygonSource {
        faces: &[polygons],
        wide: &|| wide.clone(),
        line_of: &|vertex| position_lines.get(vertex).copied(),
    };
    source.cut_into(&mut scene, &[0], drop_non_finite)?;
    scene.objects = Object::whole(&scene.triangles);
    Ok(scene)
}

/// What vertices have besides positions.
struct Kind {
    has_normals: bool,
    has_uvs: bool,
}

/// The keyword, and the numbers of vertices and faces.
fn header(lines: &mut Lines<'_>) -> Result<(Kind, [u64; 2]), Problem> {
    let mut words = lines.next("the header")?;
    let keyword = words[0].strip_suffix("OFF");
    let kinds = keyword.unwrap_or("");
    let has_uvs = kinds.starts_with("ST");
    let rest = kinds.strip_prefix("ST").unwrap_or(kinds);
    let rest = rest.strip_prefix('C').unwrap_or(rest);
    let (has_normals, rest) = (rest.starts_with('N'), rest.strip_prefix('N').unwrap_or(rest));
    if !rest.is_empty() || words.get(1).is_some_and(|&word| word.eq_ignore_ascii_case("BINARY")) {
        return Err(Problem {
            line: Some(lines.line),
            what: format!("`{}` is not read: OFF is read as text, in three dimensions", words.join(" ")),
            remedy: "Convert it to OFF text, PLY or OBJ.",
        });
    }
    if keyword.is_some() {
        words.remove(0);
        if words.is_empty() {
            words = lines.next("the numbers of vertices and faces")?;
        }
    }
    let counts: Option<Vec<u64>> = words.iter().take(2).map(|word| word.parse().ok()).collect();
    match counts.as_deref() {
        Some(&[vertices, faces]) => Ok((Kind { has_normals, has_uvs }, [vertices, faces])),
        _ => Err(lines.problem("an OFF file begins with `OFF` and the numbers of vertices, faces and edges")),
    }
}

/// The faces with their positions; those with fewer than three corners are left out and told of.
fn polygons(
    lines: &mut Lines<'_>,
    faces: u64,
    vertices: u64,
    warnings: &mut Vec<String>,
) -> Result<Faces, Problem> {
    let (mut polygons, mut thin) = (Faces::default(), 0);
    for _ in 0..faces {
        let words = lines.next("a face")?;
        let count = words[0].parse::<usize>().ok().filter(|&count| count < words.len());
        let count =
            count.ok_or_else(|| lines.problem("a face needs its number of corners and as many indices"))?;
        if count < 3 {
            thin += 1;
            continue;
        }
        for word in &words[1..=count] {
            let index =
                word.parse::<u32>().ok().filter(|&index| u64::from(index) < vertices && index != NO_INDEX);
            polygons.corners[0].push(index.ok_or_else(|| {
                lines.problem(format!(
                    "`{word}` names no vertex: indices are 0 to {}",
                    vertices.saturating_sub(1)
                ))
            })?);
        }
        // In range: a line is in memory.
        polygons.arities.push(count as u32);
        polygons.count += 1;
    }
    if thin > 0 {
        warnings.push(format!("faces with fewer than three corners are left out: {thin}"));
    }
    Ok(polygons)
}

/// N numbers from a word on.
fn numbers<const N: usize, T: std::str::FromStr + Copy + Default>(
    words: &[&str],
    first: usize,
) -> Option<[T; N]> {
    let mut numbers = [T::default(); N];
    for (number, word) in numbers.iter_mut().zip(words.get(first..first + N)?) {
        *number = word.parse().ok()?;
    }
    Some(numbers)
}

/// Lines that say something, as words.
struct Lines<'a> {
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    /// The last one, counted from 1.
    line: u64,
}

impl<'a> Lines<'a> {
    fn next(&mut self, what: &str) -> Result<Vec<&'a str>, Problem> {
        for (number, line) in self.lines.by_ref() {
            self.line = number as u64 + 1;
            let words: Vec<&str> = line.split('#').next().unwrap_or("").split_whitespace().collect();
            if !words.is_empty() {
                return Ok(words);
            }
        }
        Err(self.problem(format!("the file ends where {what} should be")))
    }

    fn problem(&self, what: impl Into<String>) -> Problem {
        Problem { line: Some(self.line), what: what.into(), remedy: CORRECT_LINE }
    }
}
