//! The planar mirrors that a camera sees, and which of them are worth a pencil of their own.
//!
//! Triangles that mirror, have no smooth normals and lie exactly in one plane are one mirror. Planes that could be the same are found in
//! cells of (normal, offset). Rays in bundles take about 350 ns each, a pencil 40 ns for each triangle and 45 ns for each pixel of the
//! rectangle around the mirror (sponza's walls, two threads); mirrors that are too small or too scattered for that stay with the
//! bundles.
//!
//! Based on: Paul Heckbert and Pat Hanrahan, "Beam Tracing Polygonal Objects", 1984.

use std::collections::HashMap;

use umbel_core::{Film, Hits, NO_TRIANGLE, Origin, Pencil, TriangleId, Triangles};

use crate::render::bounce::planar_mirror::{NOTHING, PlanarMirror, Rect, grids, include};
use crate::render::bounce::spawn::Bounces;
use crate::scene::Scene;
use crate::scene::optics::Optics;

/// The fewest rays of a mirror for which a pencil is made.
const LEAST_RAYS: u32 = 1 << 10;
/// As many triangles may be sorted for each ray.
const TRIANGLES_PER_RAY: u32 = 8;
/// One of so many rays of the rectangle around a mirror meets it at least.
const SPARSE: u64 = 4;
/// Corners' normals whose sine to the triangle's own is at most this are flat: files have four digits.
const FLAT: f64 = 1e-4;
/// Steps of a unit normal's components, and of offsets as parts of the scene's size, within which planes are looked for.
const CELLS: f64 = 1024.0;
/// Planes in one cell that are told apart.
const PLANES_PER_CELL: usize = 4;

/// The number that stands for "no mirror".
const NONE: u32 = u32::MAX;

/// The planar mirrors that a camera sees so much of that pencils pay.
#[derive(Debug, Default)]
pub(crate) struct PlanarMirrors {
    mirrors: Vec<PlanarMirror>,
    /// The mirror of each triangle, or [`NONE`]; empty where there are no mirrors.
    of_triangle: Vec<u32>,
}

impl PlanarMirrors {
    /// Finds the mirrors among what the rays of a camera hit.
    pub(crate) fn seen(
        scene: &Scene,
        geometry: &Triangles<'_>,
        (pencil, hits): (&Pencil, &Hits),
        bounces: Bounces,
    ) -> Self {
        let reflects = |optics: &Optics| bounces.reflect && optics.reflects();
        let any = scene.materials.iter().any(|material| reflects(&material.optics));
        if !any || pencil.films().iter().any(|film| matches!(film, Film::Scattered(_))) {
            return Self::default();
        }
        let mut rays = vec![0_u32; geometry.len()];
        for &id in hits.ids().iter().filter(|&&id| id != NO_TRIANGLE) {
            rays[id as usize] += 1;
        }
        let mut planes = Planes::over(scene);
        let mut of_triangle = vec![NONE; geometry.len()];
        // In range: ids are.
        for id in (0..geometry.len() as u32).filter(|&id| rays[id as usize] > 0) {
            let is_mirror = scene.material_of(id).is_some_and(|material| reflects(&material.optics));
            if is_mirror && is_flat(scene, geometry, TriangleId(id)) {
                let plane = planes.of(geometry, TriangleId(id), pencil.origin());
                of_triangle[id as usize] = plane.map_or(NONE, |plane| planes.add(plane, rays[id as usize]));
            }
        }
        planes.worthwhile(pencil, hits, of_triangle)
    }

    /// A mirror by number.
    pub(crate) fn get(&self, mirror: usize) -> PlanarMirror {
        self.mirrors[mirror]
    }

    /// The number of mirrors.
    pub(crate) fn len(&self) -> usize {
        self.mirrors.len()
    }

    /// The mirror that a triangle is part of.
    pub(crate) fn of(&self, triangle: TriangleId) -> Option<usize> {
        let mirror = *self.of_triangle.get(triangle.0 as usize)?;
        (mirror != NONE).then_some(mirror as usize)
    }
}

/// Planes that were met so far, with the rays that have met them.
struct Planes {
    all: Vec<(PlanarMirror, u32)>,
    /// The first planes of each cell, by number.
    cells: HashMap<[i64; 4], Vec<u32>>,
    /// The largest coordinate of the scene.
    size: f64,
}

impl Planes {
    fn over(scene: &Scene) -> Self {
        let bounds = scene.bounds();
        let size = bounds.lo.iter().chain(&bounds.hi).fold(f32::MIN_POSITIVE, |size, x| size.max(x.abs()));
        Self { all: Vec::new(), cells: HashMap::new(), size: f64::from(size) }
    }

    /// The number of a triangle's plane; one that is new if its cell has none that holds the triangle exactly.
    fn of(&mut self, geometry: &Triangles<'_>, triangle: TriangleId, origin: Origin) -> Option<u32> {
        let mirror = PlanarMirror::new(geometry, triangle, origin)?;
        let offset = mirror.normal().dot(mirror.point() / self.size);
        let [x, y, z] = mirror.normal().to_array();
        let cell = self.cells.entry([x, y, z, offset].map(|x| (x * CELLS).round() as i64)).or_default();
        let known = cell.iter().find(|&&plane| self.all[plane as usize].0.holds(geometry, triangle));
        if let Some(&plane) = known {
            return Some(plane);
        }
        // In range: there are fewer planes than triangles.
        let plane = self.all.len() as u32;
        if cell.len() < PLANES_PER_CELL {
            cell.push(plane);
        }
        self.all.push((mirror, 0));
        Some(plane)
    }

    /// The mirrors for which a pencil pays, with their triangles.
    fn worthwhile(&self, pencil: &Pencil, hits: &Hits, mut of_triangle: Vec<u32>) -> PlanarMirrors {
        // In range: ids are.
        let enough = (of_triangle.len() as u32 / TRIANGLES_PER_RAY).max(LEAST_RAYS);
        let areas = self.areas(pencil, hits, &of_triangle);
        let mut mirrors = Vec::new();
        let kept = self.all.iter().zip(areas).map(|(&(mirror, rays), area)| {
            if rays < enough || area > SPARSE * u64::from(rays) || !mirror.takes(pencil) {
                return NONE;
            }
            mirrors.push(mirror);
            mirrors.len() as u32 - 1
        });
        let kept: Vec<u32> = kept.collect();
        for mirror in of_triangle.iter_mut().filter(|mirror| **mirror != NONE) {
            *mirror = kept[*mirror as usize];
        }
        PlanarMirrors { mirrors, of_triangle }
    }

    /// Pixels of the rectangles around what films see of each plane.
    fn areas(&self, pencil: &Pencil, hits: &Hits, of_triangle: &[u32]) -> Vec<u64> {
        let mut areas = vec![0; self.all.len()];
        let mut ids = hits.ids();
        for film in grids(pencil) {
            let (of_film, rest) = ids.split_at(film.width() as usize * film.height() as usize);
            ids = rest;
            let mut rects = vec![NOTHING; self.all.len()];
            for (y, row) in (0..).zip(of_film.chunks(film.width() as usize)) {
                for (x, &id) in (0..).zip(row) {
                    let plane = of_triangle.get(id as usize).copied().unwrap_or(NONE);
                    if plane != NONE {
                        include(&mut rects[plane as usize], [x, y]);
                    }
                }
            }
            let area = |[columns, rows]: &Rect| columns.len() as u64 * rows.len() as u64;
            areas.iter_mut().zip(&rects).for_each(|(sum, rect)| *sum += area(rect));
        }
        areas
    }

    /// Counts rays that meet a plane.
    fn add(&mut self, plane: u32, rays: u32) -> u32 {
        self.all[plane as usize].1 += rays;
        plane
    }
}

/// Whether the shading normals of a triangle are its own.
fn is_flat(scene: &Scene, geometry: &Triangles<'_>, triangle: TriangleId) -> bool {
    let own = geometry.normal(triangle);
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().all(|corner| {
        let normal = scene.interpolated_normal(triangle, || corner);
        normal.is_none_or(|normal| normal.cross(own).length() <= FLAT)
    })
}
