//! Reads Wavefront OBJ and its material libraries (MTL) through `tobj`.
//!
//! Plain text, which nearly all files are, is read in parallel (`plain.rs`). Whatever is odd goes statement by statement
//! through `source.rs`, which tells why, into one mesh of `tobj`; so it is `tobj` that says what a text means. Of the mesh that either
//! makes (`mesh.rs`) the faces are cut into triangles (`formats/polygons`), and it becomes a [`Scene`] with the colours of the
//! material libraries.
//!
//! Based on: Wavefront Technologies, "Advanced Visualizer Manual", appendix B1 "Object Files", 1992.

pub(crate) mod decimal;
pub(crate) mod left_out;
pub(crate) mod mesh;
pub(crate) mod mtl;
pub(crate) mod odd;
pub(crate) mod plain;
pub(crate) mod source;
pub(crate) mod tags;
pub(crate) mod text;

use std::borrow::Cow;
use std::collections::HashMap;
use std::mem::take;
use std::path::Path;

use umbel_core::glam::DVec3;

use crate::error::{Error, Problem};
use crate::files::budget::Budget;
use crate::formats::neighbours::{Neighbours, Resolver};
use crate::formats::obj::mesh::{ObjMesh, Part};
use crate::formats::obj::mtl::{Look, read_libraries};
use crate::formats::obj::odd::read_odd;
use crate::formats::obj::plain::read_plain;
use crate::formats::obj::source::{KEYWORDS, KINDS};
use crate::formats::obj::text::{Statements, keyword, text_of, words};
use crate::formats::polygons::PolygonSource;
use crate::formats::scene_file::{read_scene_file, stem};
use crate::scene::{Material, Object, Scene};

/// How to read an OBJ file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ObjOptions {
    /// Leave out faces with a NaN or infinite position and warn, instead of refusing the file. The position itself
    /// becomes the origin, so that indices stay those of the file.
    pub drop_non_finite: bool,
    /// Open the material libraries that the file names in other folders, too. Without this a name that leads out of the
    /// file's folder is left out with a warning.
    pub allow_outside: bool,
    /// The most bytes that reading may take; without it half of what [`available_memory`](crate::files::available_memory) tells.
    pub max_memory: Option<u64>,
}

/// Reads an OBJ file and the material libraries that it names.
///
/// Positions, normals and texture coordinates are those of the file, all of them, in its order. Faces with more than three
/// corners are triangulated by ear clipping, so that n corners give n − 2 triangles. `o`, `g` and `usemtl` start a new
/// object. What can be mended is mended and noted in [`Scene::warnings`].
///
/// A fourth number of a position is the weight of a point of curves and surfaces, which are not read: it is left out.
///
/// # Errors
/// [`Error::Input`], with the line, for a file that is no OBJ text, a number or index that cannot be read, an index out
/// of range, and positions that are not finite unless [`ObjOptions::drop_non_finite`] is set. [`Error::Limit`] when it
/// would take more than [`ObjOptions::max_memory`].
pub fn read_obj(path: &Path, options: &ObjOptions) -> Result<Scene, Error> {
    let budget = Budget::new(options.max_memory);
    let mut neighbours = Neighbours::of(path, options.allow_outside, &budget);
    read_scene_file(path, &budget)
        .and_then(|bytes| read(&bytes, options, &mut neighbours, &budget))
        .map(|scene| Scene { name: stem(path), ..scene })
        .map_err(|problem| budget.error(problem, path))
}

/// The same for the text of an OBJ file in memory. `name` stands for its path in messages and gives the scene its name;
/// `resolver` gives the material libraries that it names: what it does not give is a warning.
///
/// # Errors
/// As [`read_obj`].
pub fn read_obj_bytes(
    name: &str,
    bytes: &[u8],
    options: &ObjOptions,
    resolver: &mut Resolver<'_>,
) -> Result<Scene, Error> {
    let budget = Budget::new(options.max_memory);
    let (path, mut neighbours) = (Path::new(name), Neighbours::given(resolver, &budget));
    read(bytes, options, &mut neighbours, &budget)
        .map(|scene| Scene { name: stem(path), ..scene })
        .map_err(|problem| budget.error(problem, path))
}

/// The scene of a file's bytes, without its name.
pub(crate) fn read(
    bytes: &[u8],
    options: &ObjOptions,
    neighbours: &mut Neighbours<'_>,
    budget: &Budget,
) -> Result<Scene, Problem> {
    let text = text_of(bytes)?;
    let mut mesh = match read_plain(text, budget)? {
        Some(mesh) => mesh,
        None => read_odd(text, budget)?,
    };
    let mut scene = Scene::default();
    take_vertices(&mut scene, &mut mesh);
    let is_position = |(_, statement): &(u64, Cow<'_, str>)| keyword(statement).0 == KEYWORDS[0];
    let line_of = |vertex| Statements::new(text).filter(is_position).nth(vertex).map(|(line, _)| line);
    let faces = PolygonSource { faces: &mesh.faces, wide: &|| wide_positions(text), line_of: &line_of };
    let part_starts: Vec<usize> = mesh.parts.iter().map(|part| part.first_face).collect();
    let firsts = faces.cut_into(&mut scene, &part_starts, options.drop_non_finite)?;
    let ObjMesh { creases, libraries, parts, .. } = mesh;
    scene.creases = creases;
    let looks = read_libraries(neighbours, &libraries, &mut scene.warnings)?;
    take_objects(&mut scene, &parts, &firsts, &looks);
    if scene.triangles.is_empty() {
        let what = format!("the file has no triangles ({} vertices)", scene.positions.len());
        scene.warnings.push(if text.is_empty() { "the file is empty".to_owned() } else { what });
    }
    Ok(scene)
}

/// The positions of the file in f64; NaN where one is no number. Only scenes far away need them.
fn wide_positions(text: &[u8]) -> Vec<DVec3> {
    let positions = Statements::new(text).filter_map(|(_, statement)| {
        let (keyword, rest) = keyword(&statement);
        let mut numbers = words(rest).map(|word| word.parse().unwrap_or(f64::NAN));
        let mut next = || numbers.next().unwrap_or(f64::NAN);
        (keyword == KEYWORDS[0]).then(|| DVec3::new(next(), next(), next()))
    });
    positions.collect()
}

/// Takes positions, normals and texture coordinates, and warns of what is odd.
fn take_vertices(scene: &mut Scene, mesh: &mut ObjMesh) {
    scene.positions = take(&mut mesh.positions);
    scene.normals = take(&mut mesh.normals);
    scene.uvs = take(&mut mesh.uvs);
    let warnings = &mut scene.warnings;
    warnings.extend(mesh.left_out.warnings());
    for (kind, what) in KINDS.iter().enumerate().filter(|&(kind, _)| mesh.dangling[kind]) {
        warnings.push(format!("faces name a {what}, but the file has no `{}`", KEYWORDS[kind]));
    }
}

/// Makes objects of the parts that have triangles; neighbours of one name and material become one.
fn take_objects(scene: &mut Scene, parts: &[Part], firsts: &[u32], looks: &HashMap<String, Look>) {
    let mut indices: HashMap<&str, Option<u32>> = HashMap::from([("", None)]);
    let mut unknown = Vec::new();
    for (part, range) in parts.iter().zip(firsts.windows(2)) {
        if range[0] == range[1] {
            continue;
        }
        let material = *indices.entry(&part.material).or_insert_with(|| {
            let Some(&(diffuse, optics)) = looks.get(&part.material) else {
                unknown.push(&part.material);
                return None;
            };
            let index = u32::try_from(scene.materials.len()).ok();
            scene.materials.push(Material { name: part.material.clone(), diffuse, optics });
            index
        });
        match scene.objects.last_mut() {
            Some(last) if last.name == part.name && last.material == material => {
                last.triangles.end = range[1];
            }
            _ => scene.objects.push(Object {
                name: part.name.clone(),
                triangles: range[0]..range[1],
                material,
            }),
        }
    }
    if let Some(first) = unknown.first() {
        let count = unknown.len();
        scene
            .warnings
            .push(format!("materials that are in no library that was read: {count}, the first is `{first}`"));
    }
}
