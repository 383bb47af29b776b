//! Cuts the faces of a file into triangles, in parallel.

use rayon::prelude::*;

use crate::error::Problem;
use crate::formats::polygons::ear_clip::triangulate;
use crate::formats::polygons::faces::Faces;
use crate::scene::{NO_INDEX, Scene};

/// What is to be told of the faces of a file, once they are cut.
pub(crate) struct Cut {
    /// The first triangle of each part, and behind them the number of triangles.
    pub(crate) firsts: Vec<u32>,
    /// Triangles that are left out for a position that is not finite, and how many such positions there are.
    pub(crate) dropped: usize,
    pub(crate) dropped_vertices: usize,
}

/// Cuts the faces into triangles, in place of any triangles that the scene has. `starts` are the faces before each part, ascending;
/// `spoilt` tells which positions are not finite, or is empty.
pub(crate) fn take_faces(
    scene: &mut Scene,
    faces: &[Faces],
    starts: &[usize],
    spoilt: &[bool],
) -> Result<Cut, Problem> {
    let mut rest = starts;
    let mut before = 0;
    let with_parts: Vec<_> = faces
        .iter()
        .map(|faces| {
            let (first, end) = (before, before + faces.count);
            before = end;
            let (own, others) = rest.split_at(rest.partition_point(|&start| start < end));
            rest = others;
            (faces, first, own)
        })
        .collect();
    let cut = |&(faces, first, parts): &(&Faces, usize, &[usize])| {
        Triangles::of(faces, first, parts, scene, spoilt)
    };
    let blocks: Vec<Triangles> = with_parts.par_iter().map(cut).collect();
    drop(with_parts);

    let count: usize = blocks.iter().map(|block| block.corners[0].len()).sum();
    let targets = [&mut scene.triangles, &mut scene.uv_indices, &mut scene.normal_indices];
    for (kind, target) in targets.into_iter().enumerate() {
        target.clear();
        if blocks.iter().any(|block| !block.corners[kind].is_empty()) {
            target.reserve_exact(count);
            for block in &blocks {
                target.extend_from_slice(&block.corners[kind]);
                // A block may have none of this kind.
                target
                    .resize(target.len() + block.corners[0].len() - block.corners[kind].len(), [NO_INDEX; 3]);
            }
        }
    }
    scene.face_corners.clear();
    if blocks.iter().any(|block| !block.arities.is_empty()) {
        for block in &blocks {
            let all_three = if block.arities.is_empty() { block.corners[0].len() } else { 0 };
            scene.face_corners.extend_from_slice(&block.arities);
            scene.face_corners.resize(scene.face_corners.len() + all_three, 3);
        }
    }
    let mut before = 0;
    let mut firsts = Vec::with_capacity(starts.len() + 1);
    for block in &blocks {
        firsts.extend(block.firsts.iter().map(|first| before + first));
        before += block.corners[0].len();
    }
    firsts.resize(starts.len() + 1, count);
    let firsts: Result<Vec<u32>, _> = firsts.into_iter().map(u32::try_from).collect();
    let firsts = firsts.map_err(|_| Problem {
        line: None,
        what: "the file has more triangles than 32-bit ids can name".to_owned(),
        remedy: "Split it into several files.",
    })?;
    let dropped_vertices = spoilt.iter().filter(|&&is_spoilt| is_spoilt).count();
    Ok(Cut { firsts, dropped: blocks.iter().map(|block| block.dropped).sum(), dropped_vertices })
}

/// Faces that are cut.
#[derive(Default)]
struct Triangles {
    /// Indices of positions, texture coordinates and normals. The latter are empty where the faces have none.
    corners: [Vec<[u32; 3]>; 3],
    /// Corners of each face that is kept; empty where all have three.
    arities: Vec<u32>,
    /// For each part that begins here, the triangles before it.
    firsts: Vec<usize>,
    /// Triangles that are left out.
    dropped: usize,
}

impl Triangles {
    /// Cuts faces, given how many stand before them and the parts that begin with one of them.
    fn of(faces: &Faces, first: usize, parts: &[usize], scene: &Scene, spoilt: &[bool]) -> Self {
        if faces.arities.is_empty() && spoilt.is_empty() {
            return Self {
                corners: faces.corners.each_ref().map(|list| list.as_chunks().0.to_vec()),
                firsts: parts.iter().map(|start| start - first).collect(),
                ..Self::default()
            };
        }
        let mut triangles = Self::default();
        let (mut polygon, mut end) = (Vec::new(), 0);
        for face in 0..faces.count {
            let begun = parts[triangles.firsts.len()..].iter().take_while(|&&start| start <= first + face);
            let before = triangles.corners[0].len();
            triangles.firsts.extend(begun.map(|_| before));
            let arity = faces.arities.get(face).map_or(3, |&arity| arity as usize);
            let range = end..end + arity;
            end = range.end;
            let corners = &faces.corners[0][range.clone()];
            if corners.iter().any(|&corner| spoilt.get(corner as usize) == Some(&true)) {
                triangles.dropped += arity - 2;
                continue;
            }
            polygon.clear();
            polygon.extend(corners.iter().map(|&corner| scene.positions[corner as usize]));
            let ears = triangulate(&polygon);
            for (list, target) in
                faces.corners.iter().zip(&mut triangles.corners).filter(|(list, _)| !list.is_empty())
            {
                let corners = &list[range.clone()];
                target.extend(ears.iter().map(|ear| ear.map(|k| corners[k as usize])));
            }
            // In range: the arity was 32 bits wide.
            triangles.arities.push(arity as u32);
        }
        if triangles.arities.iter().all(|&arity| arity == 3) {
            triangles.arities.clear();
        }
        triangles
    }
}
