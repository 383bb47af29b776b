//! Queries of the engine and their rays.

use umbel::engine::{
    Above, Film, GridFilm, Grouping, Hemisphere, Occlusion, RaySample, RaySamples, Receiver, Segment, Side,
    blocked,
};
use umbel::glam::{DMat3, DVec3};
use umbel::{Frame, NO_TRIANGLE, Options, Origin, Path, Pencil, Ray, TriangleId, any_hit, closest_hit};

use crate::Result;
use crate::subjects::coincident::Query;
use crate::subjects::mesh::{Mesh, exact, rounded};

/// The nearest triangle of each ray of a pencil.
pub(crate) fn closest(mesh: Mesh, pencil: Pencil) -> Result<Query> {
    let mut frame = Frame::new();
    Ok(Box::new(move || Ok(frame.closest_hit(&mesh.geometry()?, &pencil, &Options::default())?)))
}

/// Whether rays of a pencil hit anything.
pub(crate) fn any(mesh: Mesh, pencil: Pencil) -> Result<Query> {
    Ok(Box::new(move || Ok(any_hit(&mesh.geometry()?, &pencil, &Options::default())?.1)))
}

/// The nearest triangle of each ray.
pub(crate) fn closest_of_rays(mesh: Mesh, rays: Vec<Ray>, path: Path) -> Result<Query> {
    let options = Options { path, ..Options::default() };
    Ok(Box::new(move || Ok(closest_hit(&mesh.geometry()?, &rays[..], &options)?.1)))
}

/// Whether rays hit anything.
pub(crate) fn any_of_rays(mesh: Mesh, rays: Vec<Ray>) -> Result<Query> {
    Ok(Box::new(move || Ok(any_hit(&mesh.geometry()?, &rays[..], &Options::default())?.1)))
}

/// Whether anything lies between two points.
pub(crate) fn between(mesh: Mesh, segments: Vec<Segment>) -> Result<Query> {
    Ok(Box::new(move || Ok(blocked(&mesh.geometry()?, &segments, &Options::default())?.1)))
}

/// Which receivers a light does not see.
pub(crate) fn shadowed(mesh: Mesh, light: Origin, receivers: Vec<Receiver>) -> Result<Query> {
    let mut frame = Frame::new();
    Ok(Box::new(move || Ok(frame.shadowed(&mesh.geometry()?, light, &receivers, &Options::default())?.1)))
}

/// Which rays of receivers are open.
pub(crate) fn open(
    mesh: Mesh,
    hemispheres: Vec<Hemisphere>,
    samples: Vec<RaySample>,
    grouping: Grouping,
) -> Result<Query> {
    let mut frame = Frame::new();
    Ok(Box::new(move || {
        let samples = RaySamples::Shared(&samples);
        let occlusion = Occlusion { hemispheres: &hemispheres, samples, back_faces: true, grouping };
        Ok(frame.open_rays(&mesh.geometry()?, &occlusion, &Options::default())?.1)
    }))
}

/// The same where each receiver has rays of its own: as many of all as it needs, from another place on.
pub(crate) fn open_alone(mesh: Mesh, hemispheres: Vec<Hemisphere>, samples: Vec<RaySample>) -> Result<Query> {
    let mut frame = Frame::new();
    Ok(Box::new(move || {
        let of = |receiver: usize, ray: usize| samples[(receiver * 7 + ray) % samples.len()];
        let samples = RaySamples::Own { count: samples.len(), of: &of };
        let grouping = Grouping::Auto;
        let occlusion = Occlusion { hemispheres: &hemispheres, samples, back_faces: true, grouping };
        Ok(frame.open_rays(&mesh.geometry()?, &occlusion, &Options::default())?.1)
    }))
}

/// A pinhole's view along −z, `half` half heights at distance 1, turned.
pub(crate) fn pinhole(turn: DMat3, eye: DVec3, half: f64, size: [u32; 2]) -> Result<Pencil> {
    view(turn, Origin::Point(turn * eye), turn * DVec3::NEG_Z, half, size)
}

/// A parallel view along −z onto a film around a point, `half` half heights, turned.
pub(crate) fn parallel(turn: DMat3, middle: DVec3, half: f64, size: [u32; 2]) -> Result<Pencil> {
    view(turn, Origin::Infinity(turn * DVec3::NEG_Z), turn * middle, half, size)
}

fn view(turn: DMat3, origin: Origin, middle: DVec3, half: f64, [width, height]: [u32; 2]) -> Result<Pencil> {
    let step = half / f64::from(height);
    let film = GridFilm::new(width, height, middle, turn * DVec3::X * step, turn * DVec3::Y * step)?;
    Ok(Pencil::new(origin, vec![Film::Grid(film)])?)
}

/// The six faces of a cube map of n x n pixels each.
pub(crate) fn cube(turn: DMat3, centre: DVec3, n: u32) -> Result<Pencil> {
    let half = 1.0 / f64::from(n);
    let film = |[middle, right, down]: [DVec3; 3]| {
        GridFilm::new(n, n, turn * middle, turn * right * half, turn * -down * half).map(Film::Grid)
    };
    let films = umbel::scene::CUBE_FACES.into_iter().map(film).collect::<std::result::Result<_, _>>()?;
    Ok(Pencil::new(Origin::Point(turn * centre), films)?)
}

/// Receivers at points, which lie on no triangle.
pub(crate) fn receivers_at(points: impl Iterator<Item = DVec3>) -> Vec<Receiver> {
    points.map(|p| Receiver { point: rounded(p), triangle: TriangleId(NO_TRIANGLE) }).collect()
}

/// Receivers at all positions of a mesh, or above them.
pub(crate) fn receivers_at_vertices(mesh: &Mesh, above: DVec3) -> Vec<Receiver> {
    receivers_at(mesh.positions.iter().map(|&p| exact(p) + above))
}

/// So many receivers on the front of each triangle, as rays leave it.
pub(crate) fn receivers_on(mesh: &Mesh, per_triangle: u32) -> Result<Vec<Receiver>> {
    let triangles = mesh.geometry()?;
    let weights = |k: u32| {
        // A plastic sequence, in a part of the triangle.
        let [b, c] = [0.754_877_666, 0.569_840_291].map(|x: f64| (f64::from(k) * x).fract() * 0.5);
        [1.0 - b - c, b, c]
    };
    // At most 2²⁴ triangles are made.
    let receiver = |k: u32| {
        let triangle = TriangleId(k / per_triangle);
        Receiver { point: triangles.leave(triangle, weights(k), Side::Front), triangle }
    };
    Ok((0..mesh.triangles.len() as u32 * per_triangle).map(receiver).collect())
}

/// The half spaces above receivers.
pub(crate) fn hemispheres(receivers: Vec<Receiver>, above: Above) -> Vec<Hemisphere> {
    receivers.into_iter().map(|receiver| Hemisphere { receiver, above }).collect()
}
