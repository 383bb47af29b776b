//! What stands around the flowers of `builtin:umbel`: soil, leaves and bracts; and how finely everything is cut.
//!
//! The triangle count comes first: with u = N/100,000 and g = u^0.3, lengths are cut into ∝ g pieces and there are
//! ∝ u^0.2 (below one, u^0.4) primary rays. What is here is a few per cent of the triangles.
//!
//! Based on: Przemysław Prusinkiewicz and Aristid Lindenmayer, "The Algorithmic Beauty of Plants", 1990 (pinnate leaves);
//! Guy Steele, Doug Lea, Christine Flood, "Fast Splittable Pseudorandom Number Generators", 2014 (SplitMix64).

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};

use crate::builtin::sweep::{Builder, Patch, bezier};

/// Radius of the disc of soil.
const GROUND_RADIUS: f64 = 1.42;

/// How finely everything is cut, from the number of triangles asked for.
pub(crate) struct Detail {
    /// g: cells per unit of length, relative to 100,000 triangles.
    pub(crate) fineness: f64,
    /// How many of the flower heads there are.
    pub(crate) heads: usize,
    /// Primary rays of all heads together.
    pub(crate) primary_rays: usize,
    /// Leaves.
    pub(crate) fronds: u32,
    /// Bracts of a head, each with three prongs.
    pub(crate) bracts: u32,
}

impl Detail {
    /// The detail for about `triangles`.
    pub(crate) fn new(triangles: u32) -> Self {
        let n = f64::from(triangles);
        let u = n / 1e5;
        let rays = 96.0 * libm::pow(u, if u < 1.0 { 0.4 } else { 0.2 });
        Self {
            fineness: libm::pow(u, 0.3),
            heads: match triangles {
                0..1000 => 1,
                1000..2000 => 2,
                2000..4000 => 3,
                4000..6000 => 4,
                _ => 5,
            },
            // Below 1000 triangles the soil and a few rays with a flower each are all there is room for.
            primary_rays: rays.min((n - 32.0) / 32.0).max(1.0) as usize,
            fronds: (n / 1000.0).min(9.0) as u32,
            bracts: if triangles < 4000 { 0 } else { (n / 800.0).min(9.0) as u32 },
        }
    }

    /// `cells` at 100,000 triangles, more or fewer here: ∝ g, for what has to look smooth close up.
    pub(crate) fn cells(&self, cells: f64, least: u32) -> u32 {
        (libm::round(cells * self.fineness) as u32).max(least)
    }

    /// The same for the ground, which scenes with few triangles can least afford.
    fn ground_cells(&self, cells: f64, least: u32) -> u32 {
        (libm::round(cells * libm::pow(self.fineness, 1.3)) as u32).max(least)
    }

    /// Sides and segments of a tube. Roundness grows slower than length: thin stalks stay cheap.
    pub(crate) fn tube(&self, sides: f64, segments: f64) -> [u32; 2] {
        let sides = libm::round(sides * libm::pow(self.fineness, 0.7)) as u32;
        [sides.max(3), self.cells(segments, 1)]
    }
}

/// The disc of soil: a softly undulating top, a rounded rim and a flat bottom, closed.
pub(crate) fn ground(builder: &mut Builder, detail: &Detail) {
    const RIM: f64 = 0.07;
    let flat = GROUND_RADIUS - RIM;
    let rings = detail.ground_cells(20.0, 1);
    let mut profile: Vec<_> = (0..=rings).map(|i| [flat * f64::from(i) / f64::from(rings), 0.0]).collect();
    let steps = detail.ground_cells(4.0, 1);
    for i in 1..=steps {
        let (sin, cos) = libm::sincos(PI * f64::from(i) / f64::from(steps));
        profile.push([flat + RIM * sin, RIM * (cos - 1.0)]);
    }
    profile.push([0.0, -2.0 * RIM]);
    let soil = Patch::revolved(&profile, detail.ground_cells(96.0, 6), |x, z| {
        let inside = 1.0 - (x * x + z * z) / (flat * flat);
        let waves =
            0.05 * libm::sin(2.3 * x + 0.4) * libm::cos(1.9 * z - 0.3) + 0.02 * libm::sin(4.7 * x + 2.9 * z);
        (waves + 0.05) * inside.max(0.0)
    });
    builder.stamp(&soil, DVec3::ZERO, DMat3::IDENTITY, 1.0);
}

/// A narrow leaf of length 1 along +x, bent down by `droop`, folded up along its middle.
fn blade(detail: &Detail, half_width: f64, droop: f64) -> Patch {
    let across = if detail.fineness < 1.5 { 1 } else { 2 };
    Patch::sheet(detail.cells(2.0, 1), across, |s, w| {
        let width = half_width * (0.25 + 0.75 * libm::sin(PI * (0.1 + 0.85 * s)));
        DVec3::new(s, width * 0.5 * w.abs() - droop * s * s, w * width)
    })
}

/// A rotation with +x towards `direction` and +y as near to `up` as can be.
fn pointing(direction: DVec3, up: DVec3) -> DMat3 {
    let x = direction.normalize();
    let z = x.cross(up).normalize();
    DMat3::from_cols(x, z.cross(x), z)
}

/// Twice pinnate leaves in a rosette on the ground.
pub(crate) fn leaves(builder: &mut Builder, detail: &Detail) {
    let (leaflet, spine) = (blade(detail, 0.15, 0.15), blade(detail, 0.03, 0.10));
    let spread = detail.fineness.min(1.0);
    let pairs = 5 + (4.0 * spread) as u32;
    let leaflets = 3 + (2.0 * spread) as u32;
    for frond in 0..detail.fronds {
        let chance = Chance(u64::from(frond) + 100);
        let angle = TAU * (f64::from(frond) + 0.6 * chance.at(0)) / f64::from(detail.fronds);
        let (sin, cos) = libm::sincos(angle);
        let out = DVec3::new(cos, 0.0, sin);
        let reach = 0.95 + 0.4 * chance.at(1);
        let rise = DVec3::Y * reach * (0.25 + 0.65 * chance.at(2));
        let tip = DVec3::Y * reach * (0.12 + 0.2 * chance.at(3));
        let bare = 0.2 + 0.2 * chance.at(4);
        let curve = [out * 0.06, out * reach * 0.4 + rise, out * reach + tip];
        builder.tube(curve, [0.016, 0.004], detail.tube(5.0, 10.0));
        for k in 0..2 * pairs {
            let s = bare + (1.0 - bare) * f64::from(k / 2) / f64::from(pairs);
            let side = if k % 2 == 0 { 1.0 } else { -1.0 };
            let (root, tangent) = bezier(curve, s);
            let along = tangent.normalize();
            let across = along.cross(DVec3::Y).normalize() * side;
            let up = across.cross(along) * side;
            let length = reach * (0.50 - 0.42 * s) * (0.85 + 0.3 * chance.at(10 + u64::from(k)));
            let pinna = pointing(across + along * 0.65 + up * 0.15, up);
            builder.stamp(&spine, root, pinna, length);
            for j in 0..2 * leaflets {
                let t = (f64::from(j / 2) + 0.6) / (f64::from(leaflets) + 0.2);
                let turn = if j % 2 == 0 { 1.0 } else { -1.0 };
                let place = root + pinna * DVec3::new(t, -0.10 * t * t, 0.0) * length;
                let towards = pinna * DVec3::new(0.8, 0.1, turn * (1.0 - 0.5 * t));
                let size = length * 0.42 * (1.1 - 0.7 * t);
                builder.stamp(&leaflet, place, pointing(towards, up), size);
            }
        }
    }
}

/// Three-forked bracts in a whorl below the rays of a head at `top` with the axes `whole`.
pub(crate) fn bracts(builder: &mut Builder, detail: &Detail, top: DVec3, whole: DMat3, radius: f64) {
    let narrow = blade(detail, 0.035, 0.45);
    for k in 0..detail.bracts * 3 {
        let fork = f64::from(k % 3) - 1.0;
        let angle = TAU * f64::from(k / 3) / f64::from(detail.bracts) + 0.22 * fork;
        let (sin, cos) = libm::sincos(angle);
        let towards = whole * DVec3::new(cos, 0.12 * fork * fork - 0.05, sin);
        let size = radius * (0.52 - 0.12 * fork * fork);
        builder.stamp(&narrow, top, pointing(towards, whole.y_axis), size);
    }
}

/// Random numbers by index: the same for the same seed, on every machine.
pub(crate) struct Chance(pub(crate) u64);

impl Chance {
    /// Number `index` of this seed, in 0..1.
    pub(crate) fn at(&self, index: u64) -> f64 {
        let mut x = (self.0 << 8 | index).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((x ^ x >> 31) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
