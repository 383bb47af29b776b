//! Reads PLY, text and both binaries: positions, normals and texture coordinates of vertices, polygons, and texture coordinates of
//! their corners.
//!
//! `ply-rs-bw` reads the header and the elements of binary files. Those of a text are taken word by word here: its grammar has no
//! numbers such as `.5`, `5.` and `nan`, which programs write.
//!
//! | element | properties that are read |
//! |---|---|
//! | `vertex` | `x y z`; `nx ny nz`; `u v`, `s t`, `texture_u texture_v` or `texture_s texture_t` |
//! | `face` | `vertex_indices` or `vertex_index`; `texcoord`, two numbers for each corner |
//!
//! Colours are not read. Other elements are passed over; strips and edges are told of.
//!
//! Based on: Greg Turk, "The PLY Polygon File Format", 1994.

pub(crate) mod elements;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, ElementDef, Header};
use umbel_core::glam::DVec3;

use crate::error::Problem;
use crate::files::budget::Budget;
use crate::formats::ply::elements::{Elements, Face, Skipped, Vertex};
use crate::formats::polygons::PolygonSource;
use crate::formats::polygons::faces::Faces;
use crate::scene::{NO_INDEX, Object, Scene};

/// Bytes for each vertex and for each face, while they are read and in the scene.
const VERTEX_BYTES: u64 = 24 + 12 + 12 + 8;
const FACE_BYTES: u64 = 4 + 3 * 12 + 3 * 12;

/// What to do about a file that is cut off or damaged.
const REMEDY: &str = "Check that the file is whole, or export it again.";

/// The scene of a file's bytes.
pub(crate) fn read_ply(bytes: &[u8], drop_non_finite: bool, budget: &Budget) -> Result<Scene, Problem> {
    let mut reader = Reader::new(bytes);
    let header = Parser::<DefaultElement>::new().read_header(&mut reader).map_err(|error| Problem {
        line: error.line().map(|line| line as u64),
        what: format!("the header of PLY cannot be read: {}", first_line(&error.to_string())),
        remedy: REMEDY,
    })?;
    let line = reader.line() as u64;
    check(&header, bytes.len() as u64, budget)?;
    let mut elements = Elements::new(reader.into_inner(), header.encoding, line);
    let mut mesh = Mesh::default();
    for element in header.elements.values() {
        match element.name.as_str() {
            "vertex" => mesh.vertices(element, &mut elements)?,
            "face" => mesh.faces(element, &mut elements)?,
            other => {
                for _ in 0..element.count {
                    elements.next::<Skipped>(element)?;
                }
                if matches!(other, "tristrips" | "edge") && element.count > 0 {
                    mesh.warnings
                        .push(format!("elements `{other}` are not read and left out: {}", element.count));
                }
            }
        }
    }
    mesh.into_scene(drop_non_finite)
}

/// Checks that the file can hold what the header says, and that there is room for it.
fn check(header: &Header, length: u64, budget: &Budget) -> Result<(), Problem> {
    let count = |name: &str| header.elements.get(name).map_or(0, |element| element.count as u64);
    for element in header.elements.values() {
        // Each property takes a byte at least, and an element of text without any a line.
        if element.count as u64 > length {
            let what = format!(
                "the header says that there are {} of `{}`; the file is too short",
                element.count, element.name
            );
            return Err(Problem { line: None, what, remedy: REMEDY });
        }
    }
    let (vertices, faces) = (count("vertex"), count("face"));
    // An index takes a byte at least, and 4 in memory, in three lists.
    let bytes = vertices * VERTEX_BYTES + faces * FACE_BYTES + if faces > 0 { 3 * length } else { 0 };
    budget.check(bytes, &format!("{faces} faces and {vertices} vertices"))
}

/// The first line of a message.
fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or_default()
}

/// What has been read.
#[derive(Default)]
struct Mesh {
    positions: Vec<[f32; 3]>,
    /// In f64, where the file may say more than f32 holds.
    wide: Vec<DVec3>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    /// Texture coordinates of corners, in their order; NaN where a face has none.
    corner_uvs: Vec<[f32; 2]>,
    polygons: Faces,
    thin: usize,
    warnings: Vec<String>,
}

impl Mesh {
    fn vertices(&mut self, element: &ElementDef, elements: &mut Elements<'_>) -> Result<(), Problem> {
        let has = |names: &[&str]| names.iter().all(|&name| element.properties.contains_key(name));
        if !has(&["x", "y", "z"]) {
            let what = "its vertices have no `x`, `y` and `z`".to_owned();
            return Err(Problem { line: None, what, remedy: REMEDY });
        }
        let has_normals = has(&["nx", "ny", "nz"]);
        let has_uvs = elements::UV_NAMES.iter().any(|names| has(names));
        let is_wide = elements.is_text() || element.properties["x"].data_type != elements::FLOAT;
        for _ in 0..element.count {
            let vertex = elements.next::<Vertex>(element)?;
            self.positions.push(vertex.position);
            if is_wide {
                self.wide.push(vertex.wide);
            }
            if has_normals {
                self.normals.push(vertex.normal);
            }
            if has_uvs {
                self.uvs.push(vertex.uv);
            }
        }
        Ok(())
    }

    fn faces(&mut self, element: &ElementDef, elements: &mut Elements<'_>) -> Result<(), Problem> {
        let has_uvs = element.properties.contains_key("texcoord");
        for number in 0..element.count {
            let face = elements.next::<Face>(element)?;
            let corners = face.indices.len();
            if corners < 3 {
                self.thin += 1;
                continue;
            }
            for &index in &face.indices {
                let in_range = u32::try_from(index).ok().filter(|&index| index != NO_INDEX);
                // Faces may stand before vertices; how many there are is known at the end.
                let index = in_range
                    .ok_or_else(|| elements.problem(format!("face {number} names the vertex {index}")))?;
                self.polygons.corners[0].push(index);
            }
            if has_uvs {
                let uvs = face.uvs.as_chunks().0;
                let complete = if uvs.len() == corners { uvs } else { &[] };
                let none = [f32::NAN; 2];
                self.corner_uvs.extend((0..corners).map(|k| complete.get(k).copied().unwrap_or(none)));
            }
            // In range: a list is in memory.
            self.polygons.arities.push(corners as u32);
            self.polygons.count += 1;
        }
        Ok(())
    }

    fn into_scene(mut self, drop_non_finite: bool) -> Result<Scene, Problem> {
        let count = self.positions.len();
        if let Some(index) = self.polygons.corners[0].iter().find(|&&index| index as usize >= count) {
            let what = format!("a face names the vertex {index}; there are {count}, counted from 0");
            return Err(Problem { line: None, what, remedy: REMEDY });
        }
        if self.thin > 0 {
            self.warnings.push(format!("faces with fewer than three corners are left out: {}", self.thin));
        }
        let at_vertices = [self.corner_uvs.is_empty() && !self.uvs.is_empty(), !self.normals.is_empty()];
        let mut polygons = self.polygons.with_indices_of_positions(at_vertices);
        if !self.corner_uvs.is_empty() {
            // In range: as many as there are corners, which are in memory.
            let indices =
                (0_u32..).zip(&self.corner_uvs).map(|(k, uv)| if uv[0].is_nan() { NO_INDEX } else { k });
            polygons.corners[1] = indices.collect();
            self.uvs = self.corner_uvs;
        }
        let mut scene = Scene {
            positions: self.positions,
            normals: self.normals,
            uvs: self.uvs,
            warnings: self.warnings,
            ..Scene::default()
        };
        let narrow: Vec<DVec3> = match self.wide.is_empty() {
            true => scene.positions.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect(),
            false => self.wide,
        };
        let source = PolygonSource { faces: &[polygons], wide: &|| narrow.clone(), line_of: &|_| None };
        source.cut_into(&mut scene, &[0], drop_non_finite)?;
        scene.objects = Object::whole(&scene.triangles);
        if scene.triangles.is_empty() {
            scene.warnings.push(format!("the file has no triangles ({} vertices)", scene.positions.len()));
        }
        Ok(scene)
    }
}
