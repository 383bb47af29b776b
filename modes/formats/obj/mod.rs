//! Reads Wavefront OBJ and its material libraries (MTL) through `tobj`.
//!
//! The file goes statement by statement through `source.rs`, which tells why, into one mesh of `tobj`; this becomes a
//! [`Scene`], with the objects that `Source` noted and the colours of the material libraries.
//!
//! Based on: Wavefront Technologies, "Advanced Visualizer Manual", appendix B1 "Object Files", 1992.

pub(crate) mod clip_ring;
pub(crate) mod corner_tree;
pub(crate) mod ear_clip;
pub(crate) mod left_out;
pub(crate) mod mtl;
pub(crate) mod source;
pub(crate) mod tags;
pub(crate) mod text;

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

use tobj::{LoadError, LoadOptions, Mesh};
use umbel_core::glam::DVec3;

use crate::error::{Error, Problem};
use crate::files::budget::Budget;
use crate::formats::neighbours::{Neighbours, Resolver};
use crate::formats::obj::ear_clip::triangulate;
use crate::formats::obj::mtl::{Look, read_libraries};
use crate::formats::obj::source::{KEYWORDS, KINDS, Part, Source, measure};
use crate::formats::obj::text::{Statements, keyword, text_of, words};
use crate::formats::offset;
use crate::formats::scene_file::{SceneFormat, read_scene_file, stem};
use crate::scene::{Material, NO_INDEX, Object, Scene};

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
    read_scene_file(path, &budget, SceneFormat::Obj)
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

fn read(
    bytes: &[u8],
    options: &ObjOptions,
    neighbours: &mut Neighbours<'_>,
    budget: &Budget,
) -> Result<Scene, Problem> {
    let text = text_of(bytes)?;
    let extent = measure(text)?;
    let what = format!("{} faces and {} vertices", extent.faces, extent.counts[0]);
    budget.check(extent.bytes(), &what)?;
    let mut source = Source::new(text, extent.counts);
    let mesh = parse(&mut source)?;
    let mut scene = Scene::default();
    take_vertices(&mut scene, &mesh, &source);
    let spoilt = find_non_finite(&mut scene, text, options)?;
    let mut faces = take_faces(&mut scene, &mesh, &source, &spoilt)?;
    if offset::is_in_doubt(&scene) {
        offset::settle(&mut scene, &wide_positions(text));
        // How polygons are cut depends on their shape, which is seen only now.
        if scene.offset != DVec3::ZERO {
            faces = take_faces(&mut scene, &mesh, &source, &spoilt)?;
        }
    }
    drop(mesh);
    if faces.dropped_vertices > 0 {
        scene.warnings.push(format!(
            "vertices that are not finite: {}; triangles left out with them: {}",
            faces.dropped_vertices, faces.dropped
        ));
    }
    for indices in [&mut scene.uv_indices, &mut scene.normal_indices] {
        if indices.iter().flatten().all(|&index| index == NO_INDEX) {
            indices.clear();
        }
    }
    scene.creases = std::mem::take(&mut source.creases);
    let looks = read_libraries(neighbours, &source.libraries, &mut scene.warnings)?;
    take_objects(&mut scene, &source.parts, &faces.firsts, &looks);
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

/// Has tobj parse the source, as one mesh.
fn parse(source: &mut Source<'_>) -> Result<Mesh, Problem> {
    let options = LoadOptions { triangulate: false, single_index: false, ..LoadOptions::default() };
    // tobj never sees `mtllib`, so it asks for no library.
    match tobj::load_obj_buf(source, &options, |_| Err(LoadError::GenericFailure)) {
        Ok((models, _)) => Ok(models.into_iter().next().map(|model| model.mesh).unwrap_or_default()),
        Err(error) => Err(source.problem.take().unwrap_or_else(|| {
            source.error(match error {
                LoadError::PositionParseError => "a `v` needs three numbers".to_owned(),
                LoadError::TexcoordParseError => "a `vt` needs one or two numbers".to_owned(),
                LoadError::NormalParseError => "a `vn` needs three numbers".to_owned(),
                other => other.to_string(),
            })
        })),
    }
}

/// Takes positions, normals and texture coordinates without the entry that stands for none, and warns of what is odd.
fn take_vertices(scene: &mut Scene, mesh: &Mesh, source: &Source<'_>) {
    scene.positions = mesh.positions.as_chunks().0.to_vec();
    scene.normals = mesh.normals.as_chunks().0.to_vec();
    scene.uvs = mesh.texcoords.as_chunks().0.to_vec();
    scene.normals.pop();
    scene.uvs.pop();
    let warnings = &mut scene.warnings;
    warnings.extend(source.left_out.warnings());
    for (kind, what) in KINDS.iter().enumerate().filter(|&(kind, _)| source.dangling[kind]) {
        warnings.push(format!("faces name a {what}, but the file has no `{}`", KEYWORDS[kind]));
    }
    let mended = [(mend(&mut scene.uvs), KINDS[1]), (mend(&mut scene.normals), KINDS[2])];
    for (count, what) in mended.into_iter().filter(|&(count, _)| count > 0) {
        warnings.push(format!("{what}s that are not finite become 0: {count}"));
    }
}

/// Sets vectors with a NaN or infinite component to 0 and counts them.
fn mend<const N: usize>(vectors: &mut [[f32; N]]) -> usize {
    let spoilt = vectors.iter_mut().filter(|vector| !vector.iter().all(|x| x.is_finite()));
    spoilt.map(|vector| *vector = [0.0; N]).count()
}

/// The positions that are not finite, one flag each, once they are replaced; empty where all are finite.
fn find_non_finite(scene: &mut Scene, text: &[u8], options: &ObjOptions) -> Result<Vec<bool>, Problem> {
    let is_spoilt = |position: &[f32; 3]| !position.iter().all(|x| x.is_finite());
    let Some(first) = scene.positions.iter().position(is_spoilt) else {
        return Ok(Vec::new());
    };
    if !options.drop_non_finite {
        let is_position = |(_, statement): &(u64, Cow<'_, str>)| keyword(statement).0 == KEYWORDS[0];
        return Err(Problem {
            line: Statements::new(text).filter(is_position).nth(first).map(|(line, _)| line),
            what: format!("vertex {} has a coordinate that is NaN or infinite", first + 1),
            remedy: "Correct the line, or leave out such faces: ObjOptions::drop_non_finite.",
        });
    }
    let spoilt = scene.positions.iter().map(is_spoilt).collect();
    mend(&mut scene.positions);
    Ok(spoilt)
}

/// The faces of a file, triangulated.
struct Faces {
    /// The first triangle of each part, and behind them the number of triangles.
    firsts: Vec<u32>,
    /// Triangles that are left out for a position that is not finite, and how many such positions there are.
    dropped: usize,
    dropped_vertices: usize,
}

/// Triangulates the faces, in place of any triangles that the scene has.
fn take_faces(
    scene: &mut Scene,
    mesh: &Mesh,
    source: &Source<'_>,
    spoilt: &[bool],
) -> Result<Faces, Problem> {
    for indices in [&mut scene.triangles, &mut scene.uv_indices, &mut scene.normal_indices] {
        indices.clear();
    }
    scene.face_corners.clear();
    // tobj leaves the arities out where all are 3.
    let arity = |face: usize| mesh.face_arities.get(face).map_or(3, |&arity| arity as usize);
    let mut end: usize = (0..source.preamble_faces).map(arity).sum();
    let mut firsts = Vec::with_capacity(source.parts.len() + 1);
    let mut dropped = 0;
    let mut polygon = Vec::new();
    for face in 0..source.faces {
        let begun = source.parts[firsts.len()..].iter().take_while(|part| part.first_face <= face);
        firsts.extend(begun.map(|_| scene.triangles.len()));
        let range = end..end + arity(source.preamble_faces + face);
        end = range.end;
        let corners = &mesh.indices[range.clone()];
        if corners.iter().any(|&corner| spoilt.get(corner as usize) == Some(&true)) {
            dropped += corners.len() - 2;
            continue;
        }
        polygon.clear();
        polygon.extend(corners.iter().map(|&corner| scene.positions[corner as usize]));
        // In range: indices of corners are 32 bits wide.
        scene.face_corners.push(corners.len() as u32);
        take_face(scene, mesh, range, &triangulate(&polygon));
    }
    if scene.face_corners.iter().all(|&corners| corners == 3) {
        scene.face_corners = Vec::new();
    }
    firsts.resize(source.parts.len() + 1, scene.triangles.len());
    let firsts: Result<Vec<u32>, _> = firsts.into_iter().map(u32::try_from).collect();
    let firsts = firsts.map_err(|_| Problem {
        line: None,
        what: "the file has more triangles than 32-bit ids can name".to_owned(),
        remedy: "Split it into several files.",
    })?;
    let dropped_vertices = spoilt.iter().filter(|&&is_spoilt| is_spoilt).count();
    Ok(Faces { firsts, dropped, dropped_vertices })
}

/// Adds one face, whose corners tobj keeps at `range`, as triangles of these corners.
fn take_face(scene: &mut Scene, mesh: &Mesh, range: Range<usize>, ears: &[[u32; 3]]) {
    let take = |indices: &[u32], count: usize, triangles: &mut Vec<[u32; 3]>| {
        if let Some(corners) = indices.get(range.clone()) {
            let pick = |k: u32| index_or_none(corners[k as usize], count);
            triangles.extend(ears.iter().map(|ear| ear.map(pick)));
        }
    };
    take(&mesh.indices, scene.positions.len(), &mut scene.triangles);
    take(&mesh.texcoord_indices, scene.uvs.len(), &mut scene.uv_indices);
    take(&mesh.normal_indices, scene.normals.len(), &mut scene.normal_indices);
}

/// tobj's index, or [`NO_INDEX`] for the entry past the file's own.
fn index_or_none(index: u32, count: usize) -> u32 {
    if (index as usize) < count { index } else { NO_INDEX }
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
