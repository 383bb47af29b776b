//! Random scenes and rays for the tests, from seeds: each generator provokes one kind of trouble.
//!
//! Lattices make coincidences: shared vertices, duplicates, coplanar faces, triangles without area, origins on vertices,
//! edges and planes, rays exactly through all of them. The others make rounding hard: all magnitudes at once, a far offset,
//! slivers.
//!
//! Based on: Guy Steele, Doug Lea, Christine Flood, "Fast Splittable Pseudorandom Number Generators", 2014 (SplitMix64).

use umbel::Triangles;
use umbel::engine::GridFilm;
use umbel::glam::DVec3;

use crate::random::Random;

pub mod meshes;

/// What is hard about a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Small integers: coincidences.
    Lattice,
    /// Any f32 in [-1, 1].
    Floats,
    /// 1e-30 to 1e30 in one scene.
    Mixed,
    /// Subnormal coordinates.
    Subnormal,
    /// Features of 0.1 at an offset of 1e6.
    Shifted,
    /// Slivers of aspect 1e6.
    Slivers,
    /// Layers that are nearly coplanar.
    Layers,
}

/// Every kind of trouble.
pub const KINDS: [Kind; 7] =
    [Kind::Lattice, Kind::Floats, Kind::Mixed, Kind::Subnormal, Kind::Shifted, Kind::Slivers, Kind::Layers];

/// Positions and triangles.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// Finite corners.
    pub positions: Vec<[f32; 3]>,
    /// Three indices into the positions each.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The mesh as the engine takes it.
    pub fn geometry(&self) -> Triangles<'_> {
        Triangles::new(&self.positions, &self.triangles).expect("a valid mesh")
    }

    /// The corners of a triangle.
    pub fn corners(&self, id: usize) -> [DVec3; 3] {
        self.triangles[id].map(|v| widen(self.positions[v as usize]))
    }

    /// A new vertex.
    pub fn vertex(&mut self, p: DVec3) -> u32 {
        self.positions.push(p.to_array().map(|x| x as f32));
        self.positions.len() as u32 - 1
    }

    /// A new triangle with vertices of its own.
    pub fn triangle(&mut self, corners: [DVec3; 3]) {
        let corners = corners.map(|p| self.vertex(p));
        self.triangles.push(corners);
    }

    /// A mesh of triangles given by their corners.
    pub fn of(triangles: impl IntoIterator<Item = [DVec3; 3]>) -> Self {
        let mut mesh = Self::default();
        triangles.into_iter().for_each(|t| mesh.triangle(t));
        mesh
    }
}

/// An f32 point in f64.
pub fn widen(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// The size of a scene's features and the place around which they lie.
fn scale(random: &mut Random, kind: Kind) -> (f64, DVec3) {
    match kind {
        Kind::Mixed => (10_f64.powi(random.around(30) as i32), DVec3::ZERO),
        Kind::Subnormal => (1e-42, DVec3::ZERO),
        Kind::Shifted => (0.1, DVec3::new(1e6, -2e6, 1e6)),
        _ => (1.0, DVec3::ZERO),
    }
}

/// A point of the scene.
fn point(random: &mut Random, kind: Kind) -> DVec3 {
    let (size, centre) = scale(random, kind);
    match kind {
        Kind::Lattice => random.lattice(3),
        _ => centre + random.cube() * size,
    }
}

/// 1 to `most` triangles.
pub fn scene(random: &mut Random, kind: Kind, most: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let layer = [random.cube(), random.cube(), random.cube()];
    for _ in 0..=random.below(most) {
        let corners = [(); 3].map(|()| point(random, kind));
        match kind {
            Kind::Slivers => {
                let [a, b, _] = corners;
                mesh.triangle([a, b, a + (b - a) * 0.5 + random.cube() * 1e-6]);
            }
            Kind::Layers => mesh.triangle(layer.map(|p| p + random.cube() * 1e-7)),
            _ => mesh.triangle(corners),
        }
        connect(random, &mut mesh);
    }
    mesh
}

/// Shares vertices of the last triangle with others, copies or flattens it, now and then.
fn connect(random: &mut Random, mesh: &mut Mesh) {
    let last = mesh.triangles.len() - 1;
    let other = mesh.triangles[random.below(last + 1)];
    let [a, b, c] = mesh.triangles[last];
    mesh.triangles[last] = match random.below(10) {
        0 => [other[1], other[0], c],
        1 => [other[2], b, c],
        2 => [other[0], other[2], other[1]],
        3 => other,
        4 if random.once_in(2) => [a, b, a],
        _ => return,
    };
}

/// A vertex, the middle of an edge, the centroid, or a point of the plane of a triangle of the scene.
pub fn feature(random: &mut Random, mesh: &Mesh) -> DVec3 {
    let [a, b, c] = mesh.corners(random.below(mesh.triangles.len()));
    match random.below(6) {
        0 | 1 => a,
        2 => b,
        3 => (b + c) * 0.5,
        4 => (a + b + c) / 3.0,
        _ => a + (b - a) * random.around(2) + (c - a) * random.around(2),
    }
}

/// Where rays start: anywhere, or exactly on a feature.
pub fn eye(random: &mut Random, kind: Kind, mesh: &Mesh) -> DVec3 {
    let p = match random.below(4) {
        0 => feature(random, mesh),
        1 if kind == Kind::Lattice => random.lattice(6) * 0.5,
        1 => widen(point(random, kind).to_array().map(|x| x as f32)),
        _ => point(random, kind) * 2.0,
    };
    on_grid(p)
}

/// Where a ray from the eye goes: towards features, along axes, anywhere. Never zero.
pub fn direction(random: &mut Random, kind: Kind, mesh: &Mesh, eye: DVec3) -> DVec3 {
    let d = match random.below(8) {
        0..=3 => feature(random, mesh) - eye,
        4 => random.pick(&DVec3::AXES) * random.pick(&[1.0, -1.0, 0.5]),
        5 => random.lattice(2),
        6 => point(random, kind) - eye,
        _ => random.cube(),
    };
    if d == DVec3::ZERO { DVec3::Y } else { in_range(d) }
}

/// The nearest point that an origin may have: multiples of 2^-149.
pub fn on_grid(p: DVec3) -> DVec3 {
    let grid = f64::from(f32::from_bits(1));
    let round = |x: f64| {
        if x.abs() < 1e-28 { (x / grid).round_ties_even() * grid } else { x }
    };
    DVec3::from_array(p.to_array().map(round))
}

/// The direction without components that are too small to be taken.
fn in_range(d: DVec3) -> DVec3 {
    let least = 2_f64.powi(-240);
    DVec3::from_array(d.to_array().map(|x| if x.abs() < least { 0.0 } else { x }))
}

/// Odd and even, thin and wide.
const SIZES: [[u32; 2]; 9] = [[1, 1], [2, 2], [7, 5], [8, 8], [64, 2], [1, 13], [9, 1], [19, 11], [67, 3]];

/// A film of directions from `eye`: `None` where the vectors do not fit the engine.
pub fn film(random: &mut Random, kind: Kind, mesh: &Mesh, eye: DVec3) -> Option<GridFilm> {
    let [w, h] = random.pick(&SIZES);
    if kind == Kind::Lattice && random.once_in(2) {
        let [f, r, u] = [(); 3].map(|()| random.lattice(3));
        return GridFilm::new(w, h, f, r, u).ok();
    }
    let f = direction(random, kind, mesh, eye);
    let fov: f64 = random.pick(&[0.001, 1.0, 45.0, 90.0, 160.0, 179.9]);
    let slope = (fov.to_radians() * 0.5).tan() / f64::from(h) * f.length();
    let [r, u] = across(random, f);
    GridFilm::new(w, h, f, r * slope, u * slope).ok()
}

/// A film of start points for rays of direction `d`, around what they may hit.
pub fn starts(random: &mut Random, kind: Kind, mesh: &Mesh, d: DVec3) -> Option<GridFilm> {
    let [w, h] = random.pick(&SIZES);
    let f = eye(random, kind, mesh);
    if kind == Kind::Lattice && random.once_in(2) {
        let [r, u] = [(); 2].map(|()| random.lattice(2) * 0.5);
        return GridFilm::new(w, h, f, r, u).ok();
    }
    let size = (feature(random, mesh) - f).length() / f64::from(w.max(h));
    let size = random.pick(&[size, size * 2.0, 1e-3 * size]);
    let [r, u] = across(random, d);
    GridFilm::new(w, h, f, r * size, u * size).ok()
}

/// Two unit vectors across f, turned at random.
fn across(random: &mut Random, f: DVec3) -> [DVec3; 2] {
    let f = f / f.abs().max_element();
    let r = f.cross(random.cube()).normalize();
    [r, r.cross(f).normalize()]
}
