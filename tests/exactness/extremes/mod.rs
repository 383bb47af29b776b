//! The extremes, row by row: the engine against the oracle where numbers are hardest. With --nocapture the rows print as
//!
//! | what | rays | compared with the oracle | hits of these | mismatches |
//!
//! Every ray is cast by the general path and, in pencils or bundles, by every instruction set of the machine, the closest hit
//! and any hit; all must agree to the last bit of t. Of large sets a random part is compared with the oracle, of small ones all.
//! The longer run takes that many times as many scenes:
//!
//! ```text
//! UMBEL_EXTREMES_TIMES=50 cargo test --release -p umbel --test exactness -- extremes:: --nocapture
//! ```
//!
//! Based on: section 5 of the design.

#![expect(clippy::print_stdout, reason = "with --nocapture the rows are the result")]

mod reyes;
mod table;

use common::generators;
use common::generators::meshes::{cube, sphere};
use common::generators::{Kind, Mesh};
use common::random::Random;
use table::{Row, grid, isas, times};
use umbel::builtin::builtin_view;
use umbel::engine::{Film, Rays};
use umbel::glam::DVec3;
use umbel::{Camera, Lens, Options, Path, Ray, builtin, closest_hit, visibility};

/// Random scenes of one kind, multiplied by a factor.
fn scenes(name: &'static str, kind: Kind, scale: f64, count: usize) {
    let mut row = Row::new(name);
    for _ in 0..count * times() {
        let mut mesh = generators::scene(&mut row.random, kind, 40);
        let scaled = |x: f32| (f64::from(x) * scale) as f32;
        mesh.positions.iter_mut().for_each(|p| *p = p.map(scaled));
        row.all_kinds(&mesh, kind, 40);
    }
    row.finish();
}

#[test]
fn magnitudes() {
    scenes("coordinates at 1e-30", Kind::Floats, 1e-30, 30);
    scenes("coordinates at 1e-10", Kind::Floats, 1e-10, 30);
    scenes("coordinates at 1", Kind::Floats, 1.0, 60);
    scenes("coordinates at 1e10", Kind::Floats, 1e10, 30);
    scenes("coordinates at 1e30", Kind::Floats, 1e30, 30);
    scenes("1e-30 to 1e30 in one scene", Kind::Mixed, 1.0, 20);
    scenes("subnormal coordinates", Kind::Subnormal, 1.0, 60);
}

#[test]
fn shifted() {
    scenes("features of 0.1 at 1e6", Kind::Shifted, 1.0, 60);
}

#[test]
fn slivers() {
    scenes("slivers of aspect 1e6", Kind::Slivers, 1.0, 60);
}

#[test]
fn without_area() {
    let mut row = Row::new("zero area, collinear, repeated vertices");
    for _ in 0..60 * times() {
        let mut mesh = generators::scene(&mut row.random, Kind::Lattice, 10);
        for _ in 0..20 {
            let random = &mut row.random;
            let (a, d) = (random.lattice(3), random.lattice(2));
            let corners = [a, a + d * random.around(2), a + d * random.around(2)];
            mesh.triangle(random.pick(&[corners, [a, a, a + d], [a, a + d, a], [a; 3]]));
        }
        row.all_kinds(&mesh, Kind::Lattice, 40);
    }
    row.finish();
}

/// Triangles with the eye as a corner, on an edge, inside, in their plane beside them, before them.
fn around_eye(random: &mut Random, eye: DVec3, x: DVec3, y: DVec3) -> [DVec3; 3] {
    let corners = match random.below(5) {
        0 => [eye, eye + x, eye + y],
        1 => [eye - x, eye + x, eye + y],
        2 => [eye - x, eye + x - y, eye + y * 2.0],
        3 => [eye + x, eye + x * 2.0 + y, eye + x * 3.0],
        _ => [eye + x, eye + y, eye + x.cross(y)],
    };
    let turn = random.below(3);
    [corners[turn], corners[(turn + 1) % 3], corners[(turn + 2) % 3]]
}

#[test]
fn the_eye_and_triangles() {
    let mut row = Row::new("triangles through the eye, edge-on, behind, containing it");
    for round in 0..60 * times() {
        let kind = [Kind::Lattice, Kind::Floats][round % 2];
        let mut mesh = generators::scene(&mut row.random, kind, 10);
        let random = &mut row.random;
        // Multiples of 1/8 keep sums exact.
        let eye = random.lattice(8) * 0.125;
        for _ in 0..12 {
            let [x, y] = [(); 2].map(|()| random.lattice(8) * 0.125);
            let corners = around_eye(random, eye, x, y);
            mesh.triangle(corners);
        }
        let mut directions: Vec<DVec3> =
            (0..60).map(|_| generators::direction(random, kind, &mesh, eye)).collect();
        // Also away from the features.
        directions.extend((0..20).map(|_| -generators::direction(random, kind, &mesh, eye)));
        let span = [random.lattice(3), DVec3::new(0.25, 0.125, 0.0), DVec3::new(0.0, 0.125, 0.25)];
        let flat = span[0].dot(span[1].cross(span[2])) == 0.0;
        let span = if flat { [DVec3::X, DVec3::Y * 0.25, DVec3::Z * 0.25] } else { span };
        row.pencil(&mesh, eye, vec![Film::Scattered(directions), grid(9, 9, span)], 200);
    }
    row.finish();
}

/// A pinhole film: vertical field of view in degrees.
fn pinhole(size: [u32; 2], forward: DVec3, fov: f64) -> Film {
    let f = forward.normalize();
    let r = f.cross(DVec3::new(0.1, 1.0, 0.2)).normalize();
    let slope = (fov.to_radians() * 0.5).tan() / f64::from(size[1]);
    grid(size[0], size[1], [f, r * slope, r.cross(f) * slope])
}

#[test]
fn fields_of_view() {
    for (name, fov) in [("field of view 0.001 degrees", 0.001), ("field of view 179.9 degrees", 179.9)] {
        let mut row = Row::new(name);
        for round in 0..40 * times() {
            let kind = [Kind::Floats, Kind::Lattice, Kind::Slivers][round % 3];
            let mesh = generators::scene(&mut row.random, kind, 60);
            let eye = generators::eye(&mut row.random, kind, &mesh);
            let target = generators::feature(&mut row.random, &mesh);
            if target != eye {
                row.pencil(&mesh, eye, vec![pinhole([64, 48], target - eye, fov)], 60);
            }
        }
        row.finish();
    }
}

#[test]
fn image_sizes() {
    let mut row = Row::new("images of 1x1");
    for _ in 0..800 * times() {
        let mesh = generators::scene(&mut row.random, Kind::Lattice, 20);
        let eye = row.random.lattice(6) * 0.5;
        let target = generators::feature(&mut row.random, &mesh);
        if target != eye {
            row.pencil(&mesh, eye, vec![pinhole([1, 1], target - eye, 50.0)], 1);
        }
    }
    row.finish();
    let mut row = Row::new("images of 32768x2");
    for round in 0..4 * times() {
        let mesh = if round % 2 == 0 { sphere(4, |_| 1.0) } else { cube(6) };
        let eye = DVec3::new(0.5, 0.25, 3.0) * if round < 2 { 1.0 } else { 0.25 };
        let film = pinhole([32768, 2], -eye, 0.005);
        row.pencil(&mesh, eye, vec![film], 400);
    }
    row.finish();
}

/// Triangles whose corners are multiples of the film's rays: their corners and edges lie exactly on pixel centres.
#[test]
fn pixel_centres_on_vertices_and_edges() {
    let mut row = Row::new("pixel centres exactly on vertices and edges");
    for _ in 0..60 * times() {
        let random = &mut row.random;
        let eye = random.lattice(3);
        let corner = |random: &mut Random, depth: f64| {
            // X and Y of a film of 17x13 are even.
            eye + DVec3::new(2.0 * random.around(8), 2.0 * random.around(6), 32.0) * depth
        };
        let triangle = |random: &mut Random| {
            let depths = random.pick(&[[1.0; 3], [1.0, 2.0, 4.0], [0.5, 1.0, 1.0]]);
            depths.map(|depth| corner(random, depth))
        };
        let mesh = Mesh::of((0..16).map(|_| triangle(random)));
        let span = [DVec3::Z * 32.0, DVec3::X, DVec3::Y];
        row.pencil(&mesh, eye, vec![grid(17, 13, span)], 221);
    }
    row.finish();
}

#[test]
fn duplicated_meshes() {
    let mut row = Row::new("duplicated meshes");
    for round in 0..6 * times() {
        let mut mesh = if round % 2 == 0 { sphere(3, |_| 1.0) } else { cube(6) };
        let mut copy: Vec<[u32; 3]> = mesh.triangles.iter().map(|&[a, b, c]| [b, c, a]).collect();
        // In another order, and some wound the other way.
        for k in (1..copy.len()).rev() {
            copy.swap(k, row.random.below(k + 1));
            copy[k].swap(0, row.random.below(3));
        }
        mesh.triangles.extend(copy);
        row.all_kinds(&mesh, Kind::Lattice, 60);
        let eye = row.random.lattice(3);
        row.pencil(&mesh, eye, vec![pinhole([40, 30], DVec3::new(0.1, 0.2, 0.0) - eye, 60.0)], 100);
    }
    row.finish();
}

#[test]
fn many_triangles_at_one_vertex() {
    let mut row = Row::new("100,000 triangles sharing one vertex");
    let mut mesh = Mesh::default();
    let hub = mesh.vertex(DVec3::new(0.25, 0.5, 0.125));
    let count = 100_000;
    for k in 0..count {
        let angle = 2.0 * std::f64::consts::PI * f64::from(k) / f64::from(count);
        mesh.vertex(DVec3::new(angle.cos(), angle.sin(), 0.3 * (7.0 * angle).sin()));
    }
    mesh.triangles = (0..count).map(|k| [hub, 1 + k, 1 + (k + 1) % count]).collect();
    let eye = DVec3::new(0.125, 0.25, 3.0);
    let centre = generators::widen(mesh.positions[0]);
    let mut directions = vec![centre - eye; 4];
    for k in 0..150 * times() {
        let rim = generators::widen(mesh.positions[1 + row.random.below(count as usize)]);
        let step = row.random.pick(&[0.0, 1e-9, 1e-5, 0.5, 1.0]);
        let jitter = if k % 2 == 0 { DVec3::ZERO } else { row.random.cube() * 1e-6 };
        directions.push(centre + (rim - centre) * step + jitter - eye);
    }
    row.pencil(&mesh, eye, vec![Film::Scattered(directions)], 60);
    // A film whose middle pixel looks exactly at the hub, and one from far away.
    let span = [centre - eye, DVec3::X * 1e-5, DVec3::Y * 1e-5];
    row.pencil(&mesh, eye, vec![grid(13, 13, span)], 20);
    let far = [centre - eye, DVec3::X * 0.04, DVec3::Y * 0.04];
    row.pencil(&mesh, eye, vec![grid(33, 33, far)], 20);
    row.finish();
}

/// Directions on the edges and corners of the cube of faces, from the middle of lattices.
#[test]
fn cube_map_edges() {
    let mut row = Row::new("cube-map rays on face edges and corners");
    let mut directions = Vec::new();
    for k in -8..=8_i32 {
        let x = f64::from(k) / 8.0;
        for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            directions.extend([DVec3::new(x, s, t), DVec3::new(s, x, t), DVec3::new(s, t, x)]);
        }
    }
    for round in 0..20 * times() {
        let mesh = match round % 4 {
            0 => cube(4),
            1 => sphere(3, |_| 1.0),
            _ => generators::scene(&mut row.random, Kind::Lattice, 40),
        };
        let eye = row.random.pick(&[DVec3::ZERO, DVec3::new(0.5, 0.0, -0.25)]);
        // Six films whose outermost rays lie on the edges too.
        let face = |k: usize| {
            let [m, r, u] = [0, 1, 2].map(|i| DVec3::AXES[(k + i) % 3]);
            grid(9, 9, [if k < 3 { m } else { -m }, r / 8.0, u / 8.0])
        };
        let films = std::iter::once(Film::Scattered(directions.clone())).chain((0..6).map(face));
        row.pencil(&mesh, eye, films.collect(), 250);
    }
    row.finish();
}

#[test]
fn axis_aligned_directions() {
    let mut row = Row::new("axis-aligned directions, zero components");
    for round in 0..60 * times() {
        let kind = [Kind::Lattice, Kind::Floats][round % 2];
        let mesh = generators::scene(&mut row.random, kind, 40);
        let random = &mut row.random;
        let eye = generators::eye(random, kind, &mesh);
        let direction = |random: &mut Random| {
            let mut d = random.pick(&DVec3::AXES) * random.pick(&[1.0, -1.0]);
            d[random.below(3)] += random.pick(&[0.0, -0.0, 1.0, -0.5]);
            if d == DVec3::ZERO { DVec3::NEG_Z } else { d }
        };
        let directions: Vec<DVec3> = (0..40).map(|_| direction(random)).collect();
        let through = |d: &DVec3| Ray::new(generators::on_grid(generators::feature(random, &mesh) - *d), *d);
        let rays: Vec<Ray> = directions.iter().map(through).collect();
        row.compare(&mesh, Rays::General(&rays), 40);
        row.pencil(&mesh, eye, vec![Film::Scattered(directions)], 40);
        row.pencil(&mesh, eye, vec![grid(7, 7, [DVec3::X, DVec3::Y * 0.25, DVec3::Z * 0.25])], 49);
    }
    row.finish();
}

#[test]
fn the_eye_on_surfaces() {
    let mut row = Row::new("the eye exactly on a surface, an edge, a vertex");
    for round in 0..60 * times() {
        let mesh = match round % 4 {
            0 => cube(2),
            1 => sphere(2, |_| 1.0),
            _ => generators::scene(&mut row.random, Kind::Lattice, 40),
        };
        let random = &mut row.random;
        let [a, b, c] = mesh.corners(random.below(mesh.triangles.len()));
        let eye = random.pick(&[a, (a + b) * 0.5, a * 0.5 + b * 0.25 + c * 0.25]);
        let directions = (0..60).map(|_| generators::direction(random, Kind::Lattice, &mesh, eye));
        let scattered = Film::Scattered(directions.collect());
        row.pencil(&mesh, eye, vec![scattered, pinhole([11, 9], random_forward(&mesh, eye), 120.0)], 160);
    }
    row.finish();
}

/// From the eye to the middle of the scene, or along x.
fn random_forward(mesh: &Mesh, eye: DVec3) -> DVec3 {
    let sum: DVec3 = mesh.positions.iter().map(|&p| generators::widen(p)).sum();
    let d = sum / mesh.positions.len() as f64 - eye;
    if d.length() > 1e-3 { d } else { DVec3::X }
}

/// The same ids and the same bits of t for every instruction set and 1, 2 and 7 threads.
#[test]
fn the_same_bytes() {
    let scene = builtin("umbel:20000").expect("a scene");
    let view = builtin_view("umbel:20000").expect("a view");
    let camera = Camera {
        eye: DVec3::from_array(view.eye),
        target: DVec3::from_array(view.target),
        up: DVec3::from_array(view.up),
        lens: Lens::Pinhole { fov: view.fov_degrees },
        width: 320,
        height: 240,
    };
    let lattice = Mesh::of((0..400).scan(Random(3), |random, _| Some([(); 3].map(|()| random.lattice(5)))));
    let film = vec![grid(200, 150, [DVec3::Z * -100.0, DVec3::X, DVec3::Y])];
    let pencil = umbel::Pencil::new(umbel::Origin::Point(DVec3::Z * 6.0), film).expect("in range");
    let (mut expected, mut runs) = (None, 0);
    for threads in [1, 2, 7] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let ways = isas().into_iter().map(|isa| Options { isa, ..Options::default() });
        for options in ways.chain([Options { path: Path::General, ..Options::default() }]) {
            let bytes = pool.install(|| {
                let (buffer, _) = visibility(&scene, &camera, &options).expect("a picture");
                let (hits, _) = closest_hit(&lattice.geometry(), &pencil, &options).expect("in range");
                let ids = [buffer.hits.ids(), hits.ids()].concat();
                let ts: Vec<u32> =
                    [buffer.hits.ts(), hits.ts()].concat().into_iter().map(f32::to_bits).collect();
                (ids, ts)
            });
            let expected = expected.get_or_insert_with(|| bytes.clone());
            assert!(bytes == *expected, "{options:?} with {threads} threads");
            runs += 1;
        }
    }
    let hits = expected.map_or(0, |(ids, _)| ids.iter().filter(|&&id| id != umbel::NO_TRIANGLE).count());
    println!("the same bytes: {runs} runs of {} rays, {hits} hits", 320 * 240 + 200 * 150);
    assert!(hits > 10_000);
}
