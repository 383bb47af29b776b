//! One row of the table: a scene, its rays, and what the engine says of them on every path and instruction set.

use common::generators::{self, Kind, Mesh};
use common::oracle::{self, OracleRay, Ties};
use common::random::Random;
use rayon::prelude::*;
use umbel::engine::{Film, GridFilm, Isa, Rays};
use umbel::glam::DVec3;
use umbel::{Hits, NO_TRIANGLE, Options, Origin, Path, Pencil, Ray, any_hit, closest_hit};

/// The instruction sets that this machine has.
pub(crate) fn isas() -> Vec<Isa> {
    let all = [Isa::Sse2, Isa::Sse42, Isa::Avx2, Isa::Avx512, Isa::Neon];
    all.into_iter().filter(|isa| isa.resolve().is_ok()).collect()
}

/// How many times as much as usual.
pub(crate) fn times() -> usize {
    std::env::var("UMBEL_EXTREMES_TIMES").map_or(1, |n| n.parse().expect("a number"))
}

/// What a row has compared.
pub(crate) struct Row {
    name: &'static str,
    pub(crate) random: Random,
    rays: usize,
    compared: usize,
    hits: usize,
    mismatches: usize,
    first: Option<String>,
}

impl Row {
    pub(crate) fn new(name: &'static str) -> Self {
        let seed = name.bytes().fold(0, |s, b| s * 31 + u64::from(b));
        Self { name, random: Random(seed), rays: 0, compared: 0, hits: 0, mismatches: 0, first: None }
    }

    /// All answers for the rays must be the same; of about `subset` rays they must be the oracle's. Returns the answers.
    pub(crate) fn compare(&mut self, mesh: &Mesh, rays: Rays<'_>, subset: usize) -> Hits {
        let geometry = mesh.geometry();
        let mut first: Option<Hits> = None;
        for (path, isa) in ways() {
            let options = Options { path, isa, ..Options::default() };
            let (hits, _) = closest_hit(&geometry, rays, &options).expect("rays in range");
            let (any, _) = any_hit(&geometry, rays, &options).expect("rays in range");
            let first = first.get_or_insert_with(|| hits.clone());
            for (ray, any) in any.into_iter().enumerate() {
                let same = |hits: &Hits| (hits.ids()[ray], hits.ts()[ray].to_bits());
                if same(&hits) != same(first) || any != hits.get(ray).is_some() {
                    let found = (hits.get(ray), any);
                    self.mismatch(|| format!("{path:?} {isa:?} ray {ray}: {found:?}, {:?}", first.get(ray)));
                }
            }
        }
        self.rays += rays.len();
        let hits = first.expect("there is a way");
        let all = rays.len() <= subset;
        let pick = |k| if all { k } else { self.random.below(rays.len()) };
        let picked: Vec<usize> = (0..rays.len().min(subset)).map(pick).collect();
        let answers: Vec<_> = picked.par_iter().map(|&ray| (ray, closest(mesh, rays, ray))).collect();
        for (ray, expected) in answers {
            self.compared += 1;
            self.hits += usize::from(expected.is_some());
            let (id, t) = expected.unwrap_or((NO_TRIANGLE, f32::INFINITY));
            if (hits.ids()[ray], hits.ts()[ray].to_bits()) != (id, t.to_bits()) {
                let found = hits.get(ray);
                self.mismatch(|| format!("ray {ray}: {found:?}, the oracle has {expected:?}"));
            }
        }
        hits
    }

    /// Compares a pencil of films at a point.
    pub(crate) fn pencil(&mut self, mesh: &Mesh, eye: DVec3, films: Vec<Film>, subset: usize) {
        let pencil = Pencil::new(Origin::Point(eye), films).expect("rays in range");
        self.compare(mesh, Rays::Pencil(&pencil), subset);
    }

    /// Rays of all kinds through the features of a scene: general ones, and films of a point and of a direction.
    pub(crate) fn all_kinds(&mut self, mesh: &Mesh, kind: Kind, subset: usize) {
        let random = &mut self.random;
        let eye = generators::eye(random, kind, mesh);
        let direction = generators::direction(random, kind, mesh, eye);
        let scattered: Vec<DVec3> = (0..40).map(|_| generators::direction(random, kind, mesh, eye)).collect();
        let starts = (0..40).map(|_| generators::on_grid(generators::feature(random, mesh) - direction));
        let starts = Film::Scattered(starts.collect());
        let rays: Vec<Ray> = (0..40)
            .map(|_| {
                let eye = generators::eye(random, kind, mesh);
                Ray::new(eye, generators::direction(random, kind, mesh, eye))
            })
            .collect();
        let films = [
            generators::film(random, kind, mesh, eye).map(Film::Grid),
            generators::starts(random, kind, mesh, direction).map(Film::Grid),
        ];
        self.compare(mesh, Rays::General(&rays), subset);
        let [grid, parallel] = films;
        let point = [Some(Film::Scattered(scattered)), grid].map(|film| (Origin::Point(eye), film));
        let infinity = [Some(starts), parallel].map(|film| (Origin::Infinity(direction), film));
        for (origin, film) in point.into_iter().chain(infinity) {
            // Vectors of all magnitudes may span nothing that the engine takes.
            let pencil = film.and_then(|film| Pencil::new(origin, vec![film]).ok());
            if let Some(pencil) = pencil {
                self.compare(mesh, Rays::Pencil(&pencil), subset);
            }
        }
    }

    /// Counts a wrong answer; the first is told.
    pub(crate) fn mismatch(&mut self, text: impl FnOnce() -> String) {
        self.mismatches += 1;
        self.first.get_or_insert_with(text);
    }

    /// Prints the row. No mismatch, and enough rays and hits to mean something.
    pub(crate) fn finish(self) {
        let Self { name, rays, compared, hits, mismatches, first, .. } = self;
        println!("| {name} | {rays} | {compared} | {hits} | {mismatches} |");
        assert!(mismatches == 0, "{name}: {mismatches} mismatches, {first:?}");
        assert!(compared >= 100 && hits * 50 > compared, "{name}: {compared} rays, {hits} hits");
    }
}

/// The general path, which has no instruction set; and, in pencils or bundles, each of those of the machine.
fn ways() -> Vec<(Path, Isa)> {
    let fast = isas().into_iter().map(|isa| (Path::Pencil, isa));
    std::iter::once((Path::General, Isa::Auto)).chain(fast).collect()
}

/// The oracle's answer.
fn closest(mesh: &Mesh, rays: Rays<'_>, index: usize) -> Option<(u32, f32)> {
    let (ray, ties) = match rays {
        Rays::General(rays) => (rays[index], Ties::Direction),
        Rays::Pencil(pencil) => {
            let infinite = matches!(pencil.origin(), Origin::Infinity(_));
            (pencil.ray(index), if infinite { Ties::Origin } else { Ties::Direction })
        }
    };
    let ray = OracleRay {
        origin: ray.origin.to_array(),
        direction: ray.direction.to_array(),
        t_min: ray.t_min,
        t_max: ray.t_max,
        ties,
    };
    oracle::closest(&mesh.positions, &mesh.triangles, &ray)
}

/// A grid film.
pub(crate) fn grid(width: u32, height: u32, span: [DVec3; 3]) -> Film {
    Film::Grid(GridFilm::new(width, height, span[0], span[1], span[2]).expect("a valid film"))
}
