//! Reads Wavefront OBJ and its material libraries (MTL) through `tobj`.
//!
//! The file goes statement by statement through `source.rs`, which tells why, into one mesh of `tobj`; this becomes a
//! [`Scene`], with the objects that `Source` noted and the colours of the material libraries.
//!
//! Based on: Wavefront Technologies, "Advanced Visualizer Manual", appendix B1 "Object Files", 1992.

pub(crate) mod clip_ring;
pub(crate) mod ear_clip;
pub(crate) mod mtl;
pub(crate) mod source;
pub(crate) mod tags;
pub(crate) mod text;

use std::borrow::Cow;
use std::collections::HashMap;
use std::fs;
use std::ops::Range;
use std::path::Path;

use tobj::{LoadError, LoadOptions, Mesh};

use crate::error::Error;
use crate::error::Problem;
use crate::formats::obj::ear_clip::triangulate;
use crate::formats::obj::mtl::{Look, read_libraries};
use crate::formats::obj::source::{KEYWORDS, KINDS, Part, Source};
use crate::formats::obj::text::{Statements, keyword, text_of};
use crate::scene::{Material, NO_INDEX, Object, Scene};

/// How to read an OBJ file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ObjOptions {
    /// Leave out faces with a NaN or infinite position and warn, instead of refusing the file. The position itself
    /// becomes the origin, so that indices stay those of the file.
    pub drop_non_finite: bool,
}

/// Reads an OBJ file and the material libraries that it names.
///
/// Positions, normals and texture coordinates are those of the file, all of them, in its order. Faces with more than three
/// corners are triangulated by ear clipping, so that n corners give n − 2 triangles. `o`, `g` and `usemtl` start a new
/// object. What can be mended is mended and noted in [`Scene::warnings`].
///
/// # Errors
/// [`Error::Input`], with the line, for a file that is no OBJ text, a number or index that cannot be read, an index out
/// of range, and positions that are not finite unless [`ObjOptions::drop_non_finite`] is set.
pub fn read_obj(path: &Path, options: &ObjOptions) -> Result<Scene, Error> {
    read(path, options).map_err(|problem| problem.at(path))
}

fn read(path: &Path, options: &ObjOptions) -> Result<Scene, Problem> {
    let bytes = fs::read(path).map_err(|error| Problem {
        line: None,
        what: format!("cannot be read: {error}"),
        remedy: "Give the path of an OBJ file that exists and that you may read.",
    })?;
    let text = text_of(&bytes)?;
    let mut source = Source::new(text)?;
    let mesh = parse(&mut source)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut scene = Scene { name, ..Scene::default() };
    take_vertices(&mut scene, &mesh, &source);
    let spoilt = find_non_finite(&mut scene, text, options)?;
    let firsts = take_faces(&mut scene, &mesh, &source, &spoilt)?;
    for indices in [&mut scene.uv_indices, &mut scene.normal_indices] {
        if indices.iter().flatten().all(|&index| index == NO_INDEX) {
            indices.clear();
        }
    }
    scene.creases = std::mem::take(&mut source.creases);
    let folder = path.parent().unwrap_or(Path::new(""));
    let looks = read_libraries(folder, &source.libraries, &mut scene.warnings);
    take_objects(&mut scene, &source.parts, &firsts, &looks);
    if scene.triangles.is_empty() {
        let what = format!("the file has no triangles ({} vertices)", scene.positions.len());
        scene.warnings.push(if text.is_empty() { "the file is empty".to_owned() } else { what });
    }
    Ok(scene)
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
                LoadError::ScalingByZeroError => "the weight of this `v` is 0".to_owned(),
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
    if source.left_out > 0 {
        warnings.push(format!(
            "lines, points and faces with fewer than three corners are left out: {}",
            source.left_out
        ));
    }
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

/// Triangulates the faces. Returns the first triangle of each part, and behind them the number of triangles.
fn take_faces(
    scene: &mut Scene,
    mesh: &Mesh,
    source: &Source<'_>,
    spoilt: &[bool],
) -> Result<Vec<u32>, Problem> {
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
    let vertices = spoilt.iter().filter(|&&is_spoilt| is_spoilt).count();
    if vertices > 0 {
        let what =
            format!("vertices that are not finite: {vertices}; triangles left out with them: {dropped}");
        scene.warnings.push(what);
    }
    firsts.into_iter().map(u32::try_from).collect::<Result<_, _>>().map_err(|_| Problem {
        line: None,
        what: "the file has more triangles than 32-bit ids can name".to_owned(),
        remedy: "Split it into several files.",
    })
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
