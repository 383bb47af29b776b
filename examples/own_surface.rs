//! A surface of your own: a torus of one patch with waves on it, diced where the rays are.
//!
//! `cargo run --release --example own_surface` writes `own_surface.npy`: the depth of every pixel, +∞ where there is no torus.

#![expect(clippy::print_stdout, reason = "an example tells what it found")]

use std::f32::consts::PI;
use std::f64::consts::TAU;
use std::path::Path;

use umbel::engine::{Aabb, Detail, Dicing, Domain, OnDemand, closest_hit_on_demand};
use umbel::files::{Array, write_npy};
use umbel::glam::DVec3;
use umbel::{Camera, Error, Lens, Options};

struct Torus;

impl OnDemand for Torus {
    type Object = ();

    fn roots(&self) -> Vec<()> {
        vec![()]
    }

    /// The angle is at most half a part's width from that of its middle, and the point moves by less than 5 per radian.
    fn bounds(&self, (): &(), Domain { u, v }: Domain, detail: &Detail) -> Aabb {
        let mut middle = Vec::new();
        self.evaluate(&(), &[[(u[0] + u[1]) / 2.0, (v[0] + v[1]) / 2.0]], detail, &mut middle);
        let reach = ((u[1] - u[0]) + (v[1] - v[0])) as f32 * 5.0 * PI + 1e-5;
        Aabb { lo: middle[0].map(|x| x - reach), hi: middle[0].map(|x| x + reach) }
    }

    fn expand(&self, (): &(), _spacing: f64, _: &Detail, _parts: &mut Vec<()>) -> bool {
        false
    }

    fn evaluate(&self, (): &(), parameters: &[[f64; 2]], _: &Detail, points: &mut Vec<[f32; 3]>) {
        points.extend(parameters.iter().map(|[u, v]| {
            // Parameter 1 is parameter 0: the borders meet to the bit.
            let ((sin, cos), (y, x)) = (libm::sincos(u % 1.0 * TAU), libm::sincos(v % 1.0 * TAU));
            let radius = 0.8 + 0.04 * libm::sin(u % 1.0 * TAU * 24.0);
            [(2.0 + radius * x) * cos, radius * y, (2.0 + radius * x) * sin].map(|c| c as f32)
        }));
    }

    fn id(&self, (): &()) -> u32 {
        0
    }
}

fn main() -> Result<(), Error> {
    let lens = Lens::Pinhole { fov: 40.0 };
    let (eye, target) = (DVec3::new(3.0, 4.0, 6.0), DVec3::ZERO);
    let shot = Camera { eye, target, up: DVec3::Y, lens, width: 640, height: 360 }.shot()?;
    let (hits, stats) = closest_hit_on_demand(&Torus, &shot.pencil, &Dicing::default(), &Options::default())?;
    println!("{} micropolygons, {} at a time", stats.micropolygons, stats.micropolygons_in_flight);
    write_npy(Path::new("own_surface.npy"), &[360, 640], Array::F32(hits.ts()))
}
