//! Subjects that may break an engine's speed, at any number of triangles: what they have in common is the view.
//!
//! The eye is at the origin and looks along −z. Corners are placed on the film: (x, y, z) with x and y in half heights of
//! the film at distance 1 and z in front of the eye becomes (x·z·h, y·z·h, −z).

use umbel::engine::{Film, GridFilm};
use umbel::glam::{DVec2, DVec3};
use umbel::{Origin, Pencil};

use crate::Result;
use crate::subjects::mesh::Mesh;

/// Half the vertical angle of view, in degrees.
const HALF_FOV: f64 = 30.0;

/// What every subject is seen through.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Window {
    width: u32,
    height: u32,
    /// Half the height of the film at distance 1.
    half: f64,
}

/// One kind of subject.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cliff {
    pub(crate) name: &'static str,
    pub(crate) what: &'static str,
    /// So many triangles, a power of two.
    pub(crate) mesh: fn(u32, &Window) -> Mesh,
}

/// All kinds. The last two are the same mesh.
pub(crate) const CLIFFS: [Cliff; 8] = [
    Cliff { name: "fan", what: "one vertex in the film's middle is shared by all", mesh: fan },
    Cliff { name: "pixel", what: "all triangles lie within one pixel", mesh: pixel },
    Cliff { name: "slivers", what: "up to a pixel wide, across the whole film", mesh: slivers },
    Cliff { name: "huge", what: "each covers much of the film, at random depths", mesh: huge },
    Cliff { name: "huge-back-to-front", what: "the same, the farthest first", mesh: huge_back_to_front },
    Cliff { name: "behind", what: "half behind the eye, half across its plane", mesh: behind },
    Cliff { name: "grid", what: "a displaced grid over the film, row by row", mesh: grid },
    Cliff { name: "shuffled", what: "the same grid, its triangles in random order", mesh: shuffled },
];

impl Window {
    /// A film of so many pixels.
    pub(crate) fn new((width, height): (u32, u32)) -> Self {
        Self { width, height, half: HALF_FOV.to_radians().tan() }
    }

    /// The rays through all pixels.
    pub(crate) fn pencil(&self) -> Result<Pencil> {
        let step = self.half / f64::from(self.height);
        let film = GridFilm::new(self.width, self.height, DVec3::NEG_Z, DVec3::X * step, DVec3::Y * step)?;
        Ok(Pencil::new(Origin::Point(DVec3::ZERO), vec![Film::Grid(film)])?)
    }

    /// Half the width of the film, in half heights.
    fn aspect(&self) -> f64 {
        f64::from(self.width) / f64::from(self.height)
    }

    /// From the middle to a corner of the film, in half heights.
    fn reach(&self) -> f64 {
        self.aspect().hypot(1.0)
    }

    /// The position that is seen at a place of the film, at a depth.
    fn position(&self, place: DVec2, z: f64) -> [f32; 3] {
        (place * (z * self.half)).extend(-z).as_vec3().to_array()
    }
}

/// Random numbers, the same for all machines.
///
/// Based on: Guy Steele, Doug Lea and Christine Flood, "Fast Splittable Pseudorandom Number Generators", 2014.
#[derive(Debug)]
struct Random(u64);

impl Random {
    /// From `low` to `high`.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ bits >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        bits ^= bits >> 31;
        low + (high - low) * ((bits >> 11) as f64 * 2.0_f64.powi(-53))
    }

    /// An angle.
    fn angle(&mut self) -> f64 {
        self.between(0.0, std::f64::consts::TAU)
    }
}

/// A closed, wavy fan.
fn fan(count: u32, window: &Window) -> Mesh {
    let rim = |k: u32| {
        let turn = std::f64::consts::TAU * f64::from(k) / f64::from(count);
        let place = DVec2::from_angle(turn) * (0.8 + 0.1 * (5.0 * turn).sin());
        window.position(place, 4.0 + (3.0 * turn).sin())
    };
    let centre = window.position(DVec2::new(0.03, 0.02), 4.0);
    let positions = std::iter::once(centre).chain((0..count).map(rim)).collect();
    Mesh { positions, triangles: (0..count).map(|k| [0, 1 + k, 1 + (k + 1) % count]).collect() }
}

/// Corners at random places of the pixel right of and above the middle, at random depths.
fn pixel(count: u32, window: &Window) -> Mesh {
    let (mut random, mut mesh) = (Random(1), Mesh::default());
    let side = 2.0 / f64::from(window.height);
    // With an odd number of pixels the middle is that of a pixel.
    let [left, below] = [window.width, window.height].map(|n| if n % 2 == 0 { 0.0 } else { -0.5 });
    for _ in 0..count {
        mesh.push(std::array::from_fn(|_| {
            let [x, y] = [left, below].map(|edge| edge + random.between(0.05, 0.95));
            window.position(DVec2::new(x, y) * side, random.between(2.0, 8.0))
        }));
    }
    mesh
}

/// Chords of a circle around the film. One end is a point, the other a pixel wide.
fn slivers(count: u32, window: &Window) -> Mesh {
    let (mut random, mut mesh) = (Random(2), Mesh::default());
    let pixel = 2.0 / f64::from(window.height);
    for _ in 0..count {
        let [from, to] = [0; 2].map(|_| DVec2::from_angle(random.angle()) * window.reach());
        let aside = (to - from).perp().normalize_or_zero() * pixel;
        let [near, far] = [0; 2].map(|_| random.between(2.0, 8.0));
        mesh.push([window.position(from, near), window.position(to, far), window.position(to + aside, far)]);
    }
    mesh
}

/// Regular triangles around the film's middle, parallel to the film, in random order and turned at random.
fn huge(count: u32, window: &Window) -> Mesh {
    let (mut random, mut mesh) = (Random(3), Mesh::default());
    for _ in 0..count {
        let (z, turn) = (random.between(1.0, 100.0), random.angle());
        let corner =
            |k: f64| DVec2::from_angle(turn + std::f64::consts::TAU * k / 3.0) * window.reach() * 1.2;
        mesh.push([0.0, 1.0, 2.0].map(|k| window.position(corner(k), z)));
    }
    mesh
}

/// The same, sorted.
fn huge_back_to_front(count: u32, window: &Window) -> Mesh {
    let mut mesh = huge(count, window);
    let z = |corners: &[u32; 3]| mesh.positions[corners[0] as usize][2];
    mesh.triangles.sort_by(|a, b| z(a).total_cmp(&z(b)));
    mesh
}

/// Long triangles along the line of sight, around and behind the eye. Few of those that cross its plane are seen.
fn behind(count: u32, _: &Window) -> Mesh {
    let (mut random, mut mesh) = (Random(4), Mesh::default());
    for k in 0..count {
        let [x, y] = [0; 2].map(|_| random.between(-5.0, 5.0));
        let z = if k % 2 == 0 { random.between(1.1, 5.0) } else { random.between(-0.9, 0.9) };
        let corner = |dx: f64, dy: f64, dz: f64| DVec3::new(x + dx, y + dy, z + dz).as_vec3().to_array();
        mesh.push([corner(0.0, 0.0, -1.0), corner(0.05, 0.0, 1.0), corner(0.0, 0.05, 1.0)]);
    }
    mesh
}

/// Somewhat larger than the film, with waves and roughness.
fn grid(count: u32, window: &Window) -> Mesh {
    let cells = count / 2;
    let columns = 1 << cells.ilog2().div_ceil(2);
    let rows = cells / columns;
    let mut random = Random(5);
    let mut positions = Vec::new();
    for j in 0..=rows {
        for i in 0..=columns {
            let [x, y] = [(i, columns), (j, rows)].map(|(k, of)| 2.2 * f64::from(k) / f64::from(of) - 1.1);
            let z =
                4.0 + 0.3 * (5.0 * x).sin() * (4.0 * y).cos() + random.between(-0.5, 0.5) / f64::from(rows);
            positions.push(window.position(DVec2::new(x * window.aspect(), y), z));
        }
    }
    let cell = |k: u32| {
        let a = k / columns * (columns + 1) + k % columns;
        let [b, c, d] = [a + 1, a + columns + 1, a + columns + 2];
        [[a, b, d], [a, d, c]]
    };
    Mesh { positions, triangles: (0..cells).flat_map(cell).collect() }
}

/// The same in random order.
fn shuffled(count: u32, window: &Window) -> Mesh {
    let (mut random, mut mesh) = (Random(6), grid(count, window));
    for last in (1..mesh.triangles.len()).rev() {
        mesh.triangles.swap(last, random.between(0.0, (last + 1) as f64) as usize);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_subject_has_as_many_triangles_as_asked_for() {
        let window = Window::new((192, 108));
        for cliff in CLIFFS {
            for count in [1024, 2048] {
                let mesh = (cliff.mesh)(count, &window);
                assert_eq!(mesh.triangles.len(), count as usize, "{}", cliff.name);
                assert!(umbel::Triangles::new(&mesh.positions, &mesh.triangles).is_ok(), "{}", cliff.name);
            }
        }
    }

    #[test]
    fn one_pixel_is_hit_by_the_triangles_in_one_pixel() {
        for size in [(192, 108), (191, 107)] {
            let window = Window::new(size);
            let mesh = pixel(1024, &window);
            let triangles = umbel::Triangles::new(&mesh.positions, &mesh.triangles).expect("finite");
            let pencil = window.pencil().expect("a pencil");
            let (hits, _) =
                umbel::closest_hit(&triangles, &pencil, &umbel::Options::default()).expect("hits");
            assert_eq!(hits.ids().iter().filter(|&&id| id != umbel::NO_TRIANGLE).count(), 1);
        }
    }
}
