//! Reyes: what rays see of surfaces on demand is what they see of all micropolygons, made beforehand.

#![expect(clippy::print_stdout, reason = "with --nocapture the counts are the result")]

#[path = "reyes/surfaces.rs"]
mod surfaces;

use surfaces::{Bezier, Field, Plane, Sphere, Surfaces};
use umbel::glam::DVec3;
use umbel::{
    Dicing, Film, GridFilm, Isa, Options, Origin, Path, Pencil, Stats, SurfaceHits, Triangles, closest_hit,
    closest_hit_on_demand, dice_all,
};

/// A camera at `eye` that looks along `forward`; `zoom` is the focal length over half the width.
fn camera(eye: [f64; 3], forward: [f64; 3], zoom: f64, [width, height]: [u32; 2]) -> Pencil {
    let film = film(forward, zoom, [width, height]);
    Pencil::new(Origin::Point(DVec3::from_array(eye)), vec![film]).expect("rays in range")
}

fn film(forward: [f64; 3], zoom: f64, [width, height]: [u32; 2]) -> Film {
    let forward = DVec3::from_array(forward).normalize();
    let side = if forward.y.abs() < 0.9 { DVec3::Y } else { DVec3::X };
    let right = forward.cross(side).normalize();
    let up = right.cross(forward);
    let half = 1.0 / (zoom * f64::from(width));
    Film::Grid(GridFilm::new(width, height, forward, right * half, up * half).expect("a film"))
}

/// Six films around a point.
fn cube_map(eye: [f64; 3], side: u32) -> Pencil {
    let axes = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
    let films = axes.map(|axis| film(axis.map(f64::from), 1.0, [side; 2]));
    Pencil::new(Origin::Point(DVec3::from_array(eye)), films.to_vec()).expect("rays in range")
}

/// Parallel rays downwards, a little askew.
fn sun(centre: [f64; 3], extent: f64, side: u32) -> Pencil {
    let half = extent / (2.0 * f64::from(side));
    let (right, up) = (DVec3::new(half, 0.0, 0.0), DVec3::new(0.0, 0.1 * half, half));
    let film = GridFilm::new(side, side, DVec3::from_array(centre), right, up).expect("a film");
    Pencil::new(Origin::Infinity(DVec3::new(0.1, -1.0, 0.3)), vec![Film::Grid(film)]).expect("rays in range")
}

fn sphere(height: f64, bumps: f64) -> Sphere {
    Sphere { centre: [0.0; 3], radius: 1.0, height, bumps, id: 7 }
}

fn of_spheres(spheres: &[Sphere]) -> Surfaces {
    Surfaces { spheres: spheres.to_vec(), ..Surfaces::default() }
}

fn rated(shading_rate: f64) -> Dicing {
    Dicing { shading_rate }
}

fn see(surfaces: &Surfaces, pencil: &Pencil, dicing: &Dicing) -> (SurfaceHits, Stats) {
    closest_hit_on_demand(surfaces, pencil, dicing, &Options::default()).expect("an answer")
}

/// Whether two answers are the same bytes.
fn assert_same(one: &SurfaceHits, other: &SurfaceHits, what: &str) {
    for ray in 0..one.len() {
        let bits = |hits: &SurfaceHits| {
            let uv = hits.uvs()[ray].map(f32::to_bits);
            (hits.ids()[ray], hits.ts()[ray].to_bits(), uv, hits.normals()[ray].map(f32::to_bits))
        };
        assert_eq!(bits(one), bits(other), "{what}: ray {ray}");
    }
    assert_eq!(one.len(), other.len());
}

/// The answer, which must be that of all micropolygons on every path, with every instruction set and number of threads.
fn checked(surfaces: &Surfaces, pencil: &Pencil, dicing: &Dicing, what: &str) -> (SurfaceHits, Stats) {
    let (seen, stats) = see(surfaces, pencil, dicing);
    let diced = dice_all(surfaces, pencil, dicing).expect("triangles");
    let triangles = Triangles::new(diced.positions(), diced.indices()).expect("triangles");
    let (hits, _) = closest_hit(&triangles, pencil, &Options::default()).expect("an answer");
    let found = hits.ids().iter().filter(|&&id| id != u32::MAX).count();
    println!("{what}: {found} of {} rays, {} triangles, {stats:?}", hits.len(), triangles.len());
    for ray in 0..pencil.len() {
        let expected = hits.get(ray).map(|hit| (diced.surfaces()[hit.id.0 as usize], hit.t));
        let got = (seen.ids()[ray] != u32::MAX).then(|| (seen.ids()[ray], seen.ts()[ray]));
        assert_eq!(got, expected, "{what}: ray {ray}");
    }
    let general = Options { path: Path::General, ..Options::default() };
    let (expected, _) = closest_hit_on_demand(surfaces, pencil, dicing, &general).expect("an answer");
    assert_same(&seen, &expected, what);
    for isa in [Isa::Sse2, Isa::Sse42, Isa::Avx2, Isa::Avx512, Isa::Neon] {
        let options = Options { isa, ..Options::default() };
        if let Ok((got, _)) = closest_hit_on_demand(surfaces, pencil, dicing, &options) {
            assert_same(&got, &seen, what);
        }
    }
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let (got, _) = pool.install(|| see(surfaces, pencil, dicing));
        assert_same(&got, &seen, what);
    }
    (seen, stats)
}

#[test]
fn displaced_spheres() {
    for (height, bumps) in [(0.0, 1.0), (0.3, 5.0), (0.02, 40.0), (20.0, 3.0)] {
        let scene = of_spheres(&[sphere(height, bumps)]);
        let pencil = camera([3.0, 2.0, 4.0], [-3.0, -2.0, -4.0], 2.0, [150, 110]);
        checked(&scene, &pencil, &Dicing::default(), &format!("height {height}"));
    }
}

#[test]
fn nested_and_equal_spheres() {
    let mut spheres = vec![sphere(0.3, 5.0), Sphere { id: 3, ..sphere(0.3, 5.0) }];
    spheres.push(Sphere { centre: [0.5, 0.0, 0.0], id: 1, ..sphere(0.1, 9.0) });
    let pencil = camera([3.0, 2.0, 4.0], [-3.0, -2.0, -4.0], 2.0, [130, 110]);
    let (seen, _) = checked(&of_spheres(&spheres), &pencil, &rated(0.8), "nested");
    assert!(!seen.ids().contains(&7), "of equal spheres the smaller id is seen");
}

#[test]
fn bezier_patches() {
    let bumpy = |place: usize| {
        let (x, z) = ((place % 4) as f64, (place / 4) as f64);
        [x - 1.5, ((place * 7) % 5) as f64 * 0.5 - 1.0, z - 1.5]
    };
    // One edge of the second patch is a point, one of the third is folded back on itself.
    let collapsed = |place: usize| if place < 4 { [0.0, 1.0, -2.0] } else { bumpy(place) };
    let folded = |place: usize| if place >= 12 { bumpy(15 - (place % 2)) } else { bumpy(place) };
    let all: [fn(&dyn Fn(usize) -> [f64; 3], usize) -> [f64; 3]; 1] = [|f, place| f(place)];
    let control = |f: &dyn Fn(usize) -> [f64; 3]| std::array::from_fn(|place| all[0](f, place));
    let beziers = vec![
        Bezier { points: control(&bumpy), id: 0 },
        Bezier { points: control(&collapsed), id: 1 },
        Bezier { points: control(&folded), id: 2 },
        Bezier { points: [[0.0, 2.0, 0.0]; 16], id: 3 },
    ];
    let scene = Surfaces { beziers, ..Surfaces::default() };
    let pencil = camera([1.0, 4.0, 3.0], [-1.0, -4.0, -3.0], 1.5, [140, 140]);
    for rate in [0.3, 0.5, 2.0, 30.0, 4096.0] {
        checked(&scene, &pencil, &rated(rate), &format!("Bézier at {rate}"));
    }
}
