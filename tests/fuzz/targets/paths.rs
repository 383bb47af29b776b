//! Small scenes that provoke trouble: pencils = general path = the oracle, every id and every bit of t.
//!
//! Numbers are mostly small integers, so that rays meet vertices, edges and planes exactly; some are one ulp beside, some
//! are far smaller or larger, some are any f32.

#![no_main]

use arbitrary::{Arbitrary, Result, Unstructured};
use common::oracle::{self, OracleRay, Ties};
use libfuzzer_sys::fuzz_target;
use umbel::glam::DVec3;
use umbel::{NO_TRIANGLE, Options, Origin, Path, Pencil, Ray, Triangles, any_hit, closest_hit};
use umbel::engine::{Film, GridFilm, Isa, Rays};

#[derive(Debug)]
struct Case {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    isa: Isa,
    pencils: Vec<(Origin, Vec<Film>)>,
    rays: Vec<Ray>,
}

impl<'a> Arbitrary<'a> for Case {
    fn arbitrary(u: &mut Unstructured<'a>) -> Result<Self> {
        let positions = (0..u.int_in_range(3..=24)?).map(|_| point(u)).collect::<Result<Vec<_>>>()?;
        let last = positions.len() as u32 - 1;
        let mut corner = || u.int_in_range(0..=last);
        let mut triangles = vec![[corner()?, corner()?, corner()?]];
        while triangles.len() < 40 && u.ratio(15, 16)? {
            let mut corner = || u.int_in_range(0..=last);
            triangles.push([corner()?, corner()?, corner()?]);
        }
        let mut case = Self { positions, triangles, isa: Isa::Auto, pencils: Vec::new(), rays: Vec::new() };
        let isas = [Isa::Auto, Isa::Sse2, Isa::Sse42, Isa::Avx2, Isa::Avx512];
        case.isa = *u.choose(&isas)?;
        for _ in 0..u.int_in_range(0..=2)? {
            let pencil = case.pencil(u)?;
            case.pencils.push(pencil);
        }
        for _ in 0..u.int_in_range(0..=6)? {
            let origin = case.start(u)?;
            let mut ray = Ray::new(origin, case.toward(u, origin)?);
            let ends = [0.5, 1.0, 2.0, 1.0_f64.next_up(), 1.0_f64.next_down()];
            match u.int_in_range(0..=3)? {
                0 => ray.t_max = *u.choose(&ends)?,
                1 => ray.t_min = *u.choose(&ends)?,
                _ => {}
            }
            case.rays.push(ray);
        }
        Ok(case)
    }
}

impl Case {
    /// Up to two films of one origin.
    fn pencil(&self, u: &mut Unstructured<'_>) -> Result<(Origin, Vec<Film>)> {
        let start = self.start(u)?;
        let origin =
            if u.ratio(1, 2)? { Origin::Point(start) } else { Origin::Infinity(self.toward(u, start)?) };
        let mut films = Vec::new();
        for _ in 0..u.int_in_range(1..=2)? {
            let sample = |u: &mut Unstructured<'_>| match origin {
                Origin::Point(eye) => self.toward(u, eye),
                Origin::Infinity(d) => Ok(self.start(u)? - d * f64::from(u.int_in_range(-2..=2)?)),
            };
            if u.ratio(1, 2)? {
                let count = u.int_in_range(1..=20)?;
                films.push(Film::Scattered((0..count).map(|_| sample(u)).collect::<Result<_>>()?));
                continue;
            }
            let scale = 2_f64.powi(u.int_in_range(-8..=1)?);
            let (f, r, up) = (sample(u)?, widen(point(u)?) * scale, widen(point(u)?) * scale);
            let [w, h] = [u.int_in_range(1..=9)?, u.int_in_range(1..=9)?];
            let step = u.int_in_range(0..=2)?;
            let offset = [u.int_in_range(-1..=1)?, u.int_in_range(-1..=1)?];
            films.extend(GridFilm::with_subpixel(w, h, [f, r, up], 1 << step, offset).ok().map(Film::Grid));
        }
        Ok((origin, films))
    }

    /// A vertex, the middle of two or three vertices, or any point.
    fn start(&self, u: &mut Unstructured<'_>) -> Result<DVec3> {
        let vertex = |u: &mut Unstructured<'_>| Ok(widen(*u.choose(&self.positions)?));
        Ok(match u.int_in_range(0..=4)? {
            0 => vertex(u)?,
            1 => (vertex(u)? + vertex(u)?) * 0.5,
            2 => vertex(u)? * 0.25 + vertex(u)? * 0.25 + vertex(u)? * 0.5,
            _ => widen(point(u)?),
        })
    }

    /// A direction to such a point, or any.
    fn toward(&self, u: &mut Unstructured<'_>, from: DVec3) -> Result<DVec3> {
        let d = if u.ratio(3, 4)? { self.start(u)? - from } else { widen(point(u)?) };
        Ok(if d == DVec3::ZERO { DVec3::Z } else { d })
    }
}

fn point(u: &mut Unstructured<'_>) -> Result<[f32; 3]> {
    Ok([number(u)?, number(u)?, number(u)?])
}

/// Mostly a small integer.
fn number(u: &mut Unstructured<'_>) -> Result<f32> {
    let tag: u8 = u.arbitrary()?;
    let small = f32::from(tag % 7) - 3.0;
    Ok(match tag {
        0..210 => small,
        210..224 => small * 0.5,
        224..230 => small.next_up(),
        230..236 => small.next_down(),
        236..248 => small * 2_f32.powi(*u.choose(&[-149, -140, -126, -100, -24, -12, 12, 24, 60, 100, 126])?),
        _ => Some(u.arbitrary::<f32>()?).filter(|x| x.is_finite()).unwrap_or(1.0),
    })
}

fn widen(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

fuzz_target!(|case: Case| {
    let triangles = Triangles::new(&case.positions, &case.triangles).expect("finite, in range");
    for (origin, films) in &case.pencils {
        // Out of range now and then; the target `triangles` is about that.
        if let Ok(pencil) = Pencil::new(*origin, films.clone()) {
            compare(&case, &triangles, Rays::Pencil(&pencil));
        }
    }
    if closest_hit(&triangles, &case.rays[..], &Options::default()).is_ok() {
        compare(&case, &triangles, Rays::General(&case.rays));
    }
});

/// Compares both verbs on both paths with the oracle.
fn compare(case: &Case, triangles: &Triangles<'_>, rays: Rays<'_>) {
    let (ties, ray): (_, &dyn Fn(usize) -> Ray) = match rays {
        Rays::Pencil(pencil) => {
            let at_infinity = matches!(pencil.origin(), Origin::Infinity(_));
            (if at_infinity { Ties::Origin } else { Ties::Direction }, &|i| pencil.ray(i))
        }
        Rays::General(rays) => (Ties::Direction, &|i| rays[i]),
    };
    let answers = [Path::Pencil, Path::General].map(|path| {
        let options = Options { path, isa: case.isa, ..Options::default() };
        let options =
            if options.isa.resolve().is_ok() { options } else { Options { path, ..Options::default() } };
        let (hits, _) = closest_hit(triangles, rays, &options).expect("rays in range");
        let (any, _) = any_hit(triangles, rays, &options).expect("rays in range");
        assert_eq!((hits.len(), any.len()), (rays.len(), rays.len()));
        (path, hits, any)
    });
    for i in 0..rays.len() {
        let Ray { origin, direction, t_min, t_max } = ray(i);
        let (origin, direction) = (origin.to_array(), direction.to_array());
        let ray = OracleRay { origin, direction, t_min, t_max, ties };
        let expected = oracle::closest(&case.positions, &case.triangles, &ray);
        let (id, t) = expected.unwrap_or((NO_TRIANGLE, f32::INFINITY));
        for (path, hits, any) in &answers {
            let found = (hits.ids()[i], hits.ts()[i].to_bits(), any[i]);
            assert!(
                found == (id, t.to_bits(), expected.is_some()),
                "ray {i} {path:?}: found {} {} {}, expected {expected:?}\n{ray:?}",
                hits.ids()[i],
                hits.ts()[i],
                any[i]
            );
        }
    }
}
