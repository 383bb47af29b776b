//! Planar mirrors: the rays that a plane sends back form a pencil again, through the mirrored origin.
//!
//! With the unit normal n of a plane through a, the point p is mirrored to p' = p − 2((p − a)·n)n and the direction d to
//! d' = d − 2(d·n)n. Rays through o that hit the plane leave it as if they came from o', so that a camera's film, mirrored, is
//! the film of what the mirror shows: one pencil, with a frustum, a grid and hierarchical z, instead of rays that share nothing. The
//! rectangle of the film around the mirror is traced.
//!
//! What a mirrored ray is: it starts at o' (of parallel rays at the mirrored start), it goes along d' of the mirrored film, and it
//! counts from where it meets the plane, t_min = ((a − o')·n)/(d'·n). It meets only triangles with a corner strictly in front of the
//! plane. The pencil knows no t_min: where its hit is not certain to lie beyond, which only happens to triangles that reach
//! through the plane, the ray is traced again by itself. So every ray has one answer.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011 (rays from one point; reflections); Paul Heckbert and Pat Hanrahan, "Beam Tracing Polygonal Objects", 1984 (the mirrored eye).

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use umbel_core::{
    Film, GridFilm, Hit, Options, Origin, Pencil, Ray, Side, Stats, TriangleId, Triangles, closest_hit,
};

use crate::error::Error;
use crate::render::bounce::spawn::representable;
use crate::scene::Scene;
use crate::scene::camera::on_origin_grid;
use crate::scene::optics::mirrored;

/// A plane that mirrors to one side.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlanarMirror {
    /// One of its triangles; its plane is exact.
    triangle: TriangleId,
    side: Side,
    /// A corner.
    point: DVec3,
    /// Of unit length, to that side.
    normal: DVec3,
}

impl PlanarMirror {
    /// The mirror that a triangle is part of, seen from where rays come from. `None` where they lie in its plane.
    pub(crate) fn new(geometry: &Triangles<'_>, triangle: TriangleId, origin: Origin) -> Option<Self> {
        let side = match origin {
            Origin::Point(eye) => geometry.side_of(triangle, eye),
            Origin::Infinity(direction) => geometry.side_toward(triangle, -direction),
        }?;
        let normal = geometry.normal(triangle);
        let normal = if side == Side::Front { normal } else { -normal };
        let point = widened(geometry.corners(triangle)[0]);
        Some(Self { triangle, side, point, normal })
    }

    /// Whether a triangle lies in the plane, exactly.
    pub(crate) fn holds(&self, geometry: &Triangles<'_>, triangle: TriangleId) -> bool {
        geometry.corners(triangle).into_iter().all(|p| geometry.side_of(self.triangle, widened(p)).is_none())
    }

    /// The unit normal to the side that mirrors.
    pub(crate) fn normal(&self) -> DVec3 {
        self.normal
    }

    /// A corner of one of its triangles.
    pub(crate) fn point(&self) -> DVec3 {
        self.point
    }

    /// The mirrored origin.
    fn origin(&self, origin: Origin) -> Origin {
        match origin {
            Origin::Point(eye) => Origin::Point(self.start(eye)),
            Origin::Infinity(direction) => Origin::Infinity(self.direction(direction)),
        }
    }

    /// A mirrored point.
    fn start(&self, point: DVec3) -> DVec3 {
        on_origin_grid(point - self.normal * (2.0 * (point - self.point).dot(self.normal)))
    }

    /// A mirrored direction.
    fn direction(&self, direction: DVec3) -> DVec3 {
        representable(mirrored(direction, self.normal))
    }

    /// The mirrored rays of a rectangle of a grid film: columns and rows.
    fn grid(&self, origin: Origin, film: &GridFilm, rect: &Rect) -> Result<Pencil, Error> {
        let [forward, right, up] = film.span();
        let [columns, rows] = rect;
        // Columns are two apart for each subpixel of a pixel: the sums are even, and so the middle is exact.
        let x = 0.5 * (film.x(columns.start) + film.x(columns.end - 1));
        let y = 0.5 * (film.y(rows.start) + film.y(rows.end - 1));
        let centre = forward + right * x + up * y;
        let centre = match origin {
            Origin::Point(_) => mirrored(centre, self.normal),
            Origin::Infinity(_) => self.start(centre),
        };
        // Half a pixel is as many subpixels as lie in it.
        let half = if film.width() > 1 { 0.5 * (film.x(1) - film.x(0)) } else { 1.0 };
        let [right, up] = [right, up].map(|axis| mirrored(axis, self.normal) * half);
        let film = GridFilm::new(columns.len() as u32, rows.len() as u32, centre, right, up)?;
        Ok(Pencil::new(self.origin(origin), vec![Film::Grid(film)])?)
    }

    /// Whether the mirrored rays of a camera are in the range of rays.
    pub(crate) fn takes(&self, pencil: &Pencil) -> bool {
        let origin = pencil.origin();
        let fits = |film: &GridFilm| self.grid(origin, film, &[0..film.width(), 0..film.height()]).is_ok();
        grids(pencil).iter().all(fits)
    }

    /// A ray of the mirrored pencil from where it meets the plane on; `None` where it does not leave it.
    fn beyond(&self, ray: Ray) -> Option<Ray> {
        let t_min = (self.point - ray.origin).dot(self.normal) / ray.direction.dot(self.normal);
        // Within the range of rays.
        (1e-48..1e38).contains(&t_min).then_some(Ray { t_min, ..ray })
    }
}

/// The triangles that lie in front of a mirror, or reach there.
#[derive(Debug)]
pub(crate) struct Front<'a> {
    mirror: PlanarMirror,
    scene: &'a Scene,
    triangles: Vec<[u32; 3]>,
    /// Those of the scene.
    ids: Vec<u32>,
}

impl<'a> Front<'a> {
    /// Those of a mirror. O(n).
    pub(crate) fn before(mirror: PlanarMirror, scene: &'a Scene, geometry: &Triangles<'_>) -> Self {
        let is_before = |p: &[f32; 3]| geometry.side_of(mirror.triangle, widened(*p)) == Some(mirror.side);
        let before: Vec<bool> = scene.positions.par_iter().map(is_before).collect();
        let reaches = |corners: &[u32; 3]| corners.iter().any(|&corner| before[corner as usize]);
        // In range: ids are.
        let ids: Vec<u32> = (0..scene.triangles.len() as u32)
            .into_par_iter()
            .filter(|&id| reaches(&scene.triangles[id as usize]))
            .collect();
        let triangles = ids.par_iter().map(|&id| scene.triangles[id as usize]).collect();
        Self { mirror, scene, triangles, ids }
    }

    /// What the mirror shows to some rays of a camera's film: their indices in the film.
    pub(crate) fn reflect(
        &self,
        (origin, film): (Origin, &GridFilm),
        wanted: &[u32],
        options: &Options,
    ) -> Result<(Reflection, Stats), Error> {
        let pixel = |k: u32| [k % film.width(), k / film.width()];
        let mut rect = NOTHING;
        wanted.iter().for_each(|&k| include(&mut rect, pixel(k)));
        let pencil = self.mirror.grid(origin, film, &rect)?;
        let [columns, rows] = rect;
        let place = |[x, y]: [u32; 2]| (y - rows.start) * (columns.end - columns.start) + x - columns.start;
        let places = wanted.iter().map(|&k| place(pixel(k))).collect();
        let triangles = self.scene.geometry_of(&self.triangles, &self.ids)?;
        let (hits, stats) = closest_hit(&triangles, &pencil, options)?;
        let mut reflection = Reflection { mirror: self.mirror, pencil, places, found: Vec::new() };
        let found = reflection.places.par_iter().map(|&place| hits.get(place as usize));
        reflection.found = found.collect();
        let stats = stats.then(self.trace_again(&triangles, &mut reflection, options)?);
        for hit in reflection.found.iter_mut().flatten() {
            hit.id = TriangleId(self.ids[hit.id.0 as usize]);
        }
        Ok((reflection, stats))
    }

    /// Traces those rays by themselves whose hits may lie before the mirror.
    fn trace_again(
        &self,
        triangles: &Triangles<'_>,
        reflection: &mut Reflection,
        options: &Options,
    ) -> Result<Stats, Error> {
        let doubtful = |k: &usize| {
            let (Some(hit), Some(ray)) = (reflection.found[*k], reflection.ray(*k)) else { return false };
            // t is rounded to nearest: more than what comes before it.
            f64::from(hit.t.next_down()) < ray.t_min
        };
        let again: Vec<usize> = (0..reflection.found.len()).into_par_iter().filter(doubtful).collect();
        let rays: Vec<Ray> = again.iter().filter_map(|&k| reflection.ray(k)).collect();
        if rays.is_empty() {
            return Ok(Stats::default());
        }
        let (hits, stats) = closest_hit(triangles, &rays[..], options)?;
        for (ray, k) in again.into_iter().enumerate() {
            reflection.found[k] = hits.get(ray);
        }
        Ok(stats)
    }
}

/// What a mirror shows to some rays of a camera.
#[derive(Debug)]
pub(crate) struct Reflection {
    mirror: PlanarMirror,
    pencil: Pencil,
    /// Of the rays in the pencil.
    places: Vec<u32>,
    found: Vec<Option<Hit>>,
}

impl Reflection {
    /// A mirrored ray; `None` where rounding keeps it from leaving the mirror.
    pub(crate) fn ray(&self, ray: usize) -> Option<Ray> {
        self.mirror.beyond(self.pencil.ray(self.places[ray] as usize))
    }

    /// What a mirrored ray hits.
    pub(crate) fn hit(&self, ray: usize) -> Option<Hit> {
        self.found[ray]
    }
}

/// Columns and rows of a film.
pub(crate) type Rect = [Range<u32>; 2];

/// A rectangle around no pixel.
pub(crate) const NOTHING: Rect = [const { Range { start: u32::MAX, end: 0 } }; 2];

/// Widens a rectangle to a pixel.
pub(crate) fn include(rect: &mut Rect, pixel: [u32; 2]) {
    for (range, at) in rect.iter_mut().zip(pixel) {
        *range = range.start.min(at)..range.end.max(at + 1);
    }
}

/// The grids of a pencil that has no other films, in the order of their rays.
pub(crate) fn grids(pencil: &Pencil) -> Vec<GridFilm> {
    let grid = |film: &Film| match film {
        Film::Grid(grid) => Some(*grid),
        Film::Scattered(_) => None,
    };
    pencil.films().iter().filter_map(grid).collect()
}

/// An f32 point in f64, exactly.
fn widened(point: [f32; 3]) -> DVec3 {
    DVec3::from_array(point.map(f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builtin;
    use crate::scene::Object;

    /// A flower that reaches through a mirror: its last two triangles. Both as a turn says.
    fn through_a_mirror(turn: impl Fn([f32; 3]) -> [f32; 3]) -> Scene {
        let mut scene = builtin("umbel:2000").expect("a scene");
        scene.normal_indices.clear();
        let first = scene.positions.len() as u32;
        scene.positions.iter_mut().for_each(|p| p[1] -= 0.25);
        scene.positions.extend([[-9.0, 0.0, 9.0], [9.0, 0.0, 9.0], [9.0, 0.0, -9.0], [-9.0, 0.0, -9.0]]);
        scene.positions.iter_mut().for_each(|p| *p = turn(*p));
        let start = scene.triangles.len() as u32;
        scene.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|corners| corners.map(|k| first + k)));
        scene.objects.push(Object { name: "mirror".into(), triangles: start..start + 2, material: None });
        scene
    }

    /// What a mirror shows of a scene through a rectangle of a film, and the rays of the film.
    fn reflected(
        scene: &Scene,
        (eye, film): &(Origin, GridFilm),
        options: &Options,
    ) -> (Reflection, Vec<Ray>) {
        let geometry = scene.geometry().expect("triangles");
        let mirror = TriangleId(scene.triangles.len() as u32 - 2);
        let mirror = PlanarMirror::new(&geometry, mirror, *eye).expect("a mirror");
        assert!(mirror.holds(&geometry, TriangleId(scene.triangles.len() as u32 - 1)));
        let front = Front::before(mirror, scene, &geometry);
        // Not all, nor in a rectangle that begins at the corner.
        let wanted: Vec<u32> = (0..film.width() * film.height())
            .filter(|k| k % film.width() > 10 && k / film.width() > 20 && k % 3 > 0)
            .collect();
        let (reflection, _) = front.reflect((*eye, film), &wanted, options).expect("hits");
        let hits = reflection.found.iter().flatten().count();
        assert!(hits > 300 && hits < wanted.len(), "{hits} of {}", wanted.len());
        let camera = Pencil::new(*eye, vec![Film::Grid(*film)]).expect("rays");
        (reflection, wanted.iter().map(|&k| camera.ray(k as usize)).collect())
    }

    const EYE: DVec3 = DVec3::new(2.5, 2.0, 2.5);

    /// An eye with a film, another with a part of a pixel, and parallel rays.
    fn cameras() -> [(Origin, GridFilm); 3] {
        let span = [DVec3::new(-2.5, -2.3, -2.5), DVec3::new(0.006, 0.0, -0.006), DVec3::Y / 100.0];
        let from_eye =
            |subpixels, offset| GridFilm::with_subpixel(97, 70, span, subpixels, offset).expect("a film");
        let starts = GridFilm::new(97, 70, EYE * 3.0, span[1] * 3.0, span[2] * 3.0).expect("a film");
        [
            (Origin::Point(EYE), from_eye(1, [0, 0])),
            (Origin::Point(EYE), from_eye(16, [5, -7])),
            (Origin::Infinity(span[0]), starts),
        ]
    }

    /// In a level plane through zero all numbers are mirrored exactly, and so are hits.
    #[test]
    fn a_mirror_shows_the_mirrored_scene_to_the_bit() {
        let scene = through_a_mirror(|p| p);
        let mut images = scene.clone();
        images.positions.iter_mut().for_each(|p| p[1] = -p[1]);
        images.triangles.truncate(scene.triangles.len() - 2);
        let images = images.geometry().expect("triangles");
        let (reflection, camera) = reflected(&scene, &cameras()[0], &Options::default());
        let t_min = |k: usize| reflection.ray(k).expect("a way").t_min;
        let straight: Vec<Ray> =
            camera.iter().enumerate().map(|(k, ray)| Ray { t_min: t_min(k), ..*ray }).collect();
        let (expected, _) = closest_hit(&images, &straight[..], &Options::default()).expect("hits");
        for k in 0..camera.len() {
            assert_eq!(reflection.hit(k), expected.get(k), "ray {k}");
        }
    }

    /// A tilted mirror: what it shows does not depend on the path, and each ray gets what it would get by itself.
    #[test]
    fn each_ray_has_one_answer() {
        let turn = |[x, y, z]: [f32; 3]| [x, 0.8 * y + 0.3 * x - 0.1 * z, z];
        let scene = through_a_mirror(turn);
        let geometry = scene.geometry().expect("triangles");
        let plane = scene.triangles.len() as u32 - 2;
        let general = Options { path: umbel_core::Path::General, ..Options::default() };
        for camera in &cameras() {
            let (reflection, camera_rays) = reflected(&scene, camera, &Options::default());
            assert_eq!(reflection.found, reflected(&scene, camera, &general).0.found);

            let rays: Vec<Ray> = (0..camera_rays.len()).map(|k| reflection.ray(k).expect("a way")).collect();
            let (expected, _) = closest_hit(&geometry, &rays[..], &Options::default()).expect("hits");
            for (k, (ray, of_camera)) in rays.iter().zip(&camera_rays).enumerate() {
                // Axes are rounded to the spacing of the film.
                let PlanarMirror { normal, point, .. } = reflection.mirror;
                let straight = mirrored(of_camera.direction, normal);
                assert!((straight - ray.direction).length() < 1e-12, "ray {k}");
                let start = point + mirrored(of_camera.origin - point, normal);
                assert!((start - ray.origin).length() < 1e-12, "ray {k}");
                // Only the plane itself may be hit again: t_min is rounded.
                let expected = expected.get(k);
                let in_plane = expected.is_some_and(|hit| hit.id.0 >= plane);
                assert!(in_plane || reflection.hit(k) == expected, "ray {k}");
            }
        }
    }
}
