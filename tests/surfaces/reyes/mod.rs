//! Reyes: what rays see of surfaces on demand is what they see of all micropolygons, made beforehand.

#![expect(clippy::print_stdout, reason = "with --nocapture the counts are the result")]

mod shadows;
mod surfaces;

use surfaces::{Bezier, Field, Plane, Sphere, Surfaces};
use umbel::engine::{Dicing, Film, GridFilm, Isa, SurfaceHits, closest_hit_on_demand, dice_all};
use umbel::glam::DVec3;
use umbel::{Options, Origin, Path, Pencil, Stats, Triangles, closest_hit};

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
    Dicing { shading_rate, ..Dicing::default() }
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
    // The last one holds the eye.
    for (height, bumps, size) in [(0.0, 1.0, 110), (0.3, 5.0, 110), (0.02, 40.0, 110), (20.0, 3.0, 40)] {
        let scene = of_spheres(&[sphere(height, bumps)]);
        let pencil = camera([3.0, 2.0, 4.0], [-3.0, -2.0, -4.0], 2.0, [size + 40, size]);
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
    let control = |f: &dyn Fn(usize) -> [f64; 3]| std::array::from_fn(f);
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

#[test]
fn grazing_planes_and_near_ones() {
    // A plane that passes just below the eye, from behind it to far away, and one that holds the eye.
    for height in [-0.01, 0.0] {
        let plane =
            Plane { corner: [-50.0, height, 50.0], sides: [[100.0, 0.0, 0.0], [0.0, 0.0, -100.0]], id: 4 };
        let scene = Surfaces { planes: vec![plane], ..Surfaces::default() };
        for forward in [[0.0, -0.2, -1.0], [0.3, -1.0, 0.0]] {
            let pencil = camera([0.0; 3], forward, 1.0, [90, 70]);
            let (seen, _) = checked(&scene, &pencil, &rated(1.0), &format!("plane at {height} {forward:?}"));
            let found = seen.ids().contains(&4);
            assert_eq!(found, height < 0.0);
        }
    }
}

#[test]
fn parallel_rays_and_cube_maps() {
    let mut scene = of_spheres(&[sphere(0.2, 6.0)]);
    scene.planes.push(Plane { corner: [-3.0, -1.0, 3.0], sides: [[6.0, 0.0, 0.0], [0.0, 0.5, -6.0]], id: 2 });
    checked(&scene, &sun([0.0, 5.0, 0.0], 4.0, 140), &rated(0.7), "sun");
    // Rays that start within the sphere.
    checked(&scene, &sun([0.0; 3], 4.0, 90), &rated(0.7), "sun inside");
    checked(&scene, &cube_map([0.3, 0.4, -0.2], 60), &rated(0.8), "cube map inside");
    checked(&scene, &cube_map([0.0, 3.0, 0.0], 60), &rated(0.8), "cube map outside");
    // On the surface, at a corner of the cube.
    let on_it = 3.0_f64.sqrt().recip() as f32;
    let eye = [f64::from(on_it); 3];
    checked(&of_spheres(&[sphere(0.0, 1.0)]), &cube_map(eye, 40), &rated(1.0), "cube map on the surface");
}

#[test]
fn a_field_of_a_million_groups() {
    let field = Field { corner: [-50.0, 0.0, -100.0], size: 100.0, levels: 10, id: 9 };
    let scene = Surfaces { fields: vec![field], ..Surfaces::default() };
    let pencil = camera([0.0, 0.4, 0.0], [0.1, -0.3, -1.0], 1.0, [160, 100]);
    let (seen, stats) = see(&scene, &pencil, &Dicing::default());
    println!("{stats:?}");
    // The squares cover a quarter of the ground.
    let found = seen.ids().iter().filter(|&&id| id == 9).count();
    let ground = (0..pencil.len()).filter(|&ray| pencil.ray(ray).direction.y < -0.02).count();
    assert!((0.15..0.35).contains(&(found as f64 / ground as f64)), "{found} of {ground}");
    assert!(stats.surfaces_expanded < 100_000, "{}", stats.surfaces_expanded);
    let small = Surfaces { fields: vec![Field { levels: 6, ..field }], ..Surfaces::default() };
    checked(&small, &pencil, &Dicing::default(), "field");
}

/// Hits in the memory of others are those of new ones: nothing of the old remains, on either path.
#[test]
fn memory_of_hits_is_used_again() {
    let near = camera([0.0, 0.0, 2.0], [0.0, 0.0, -1.0], 1.0, [70, 50]);
    let far = camera([0.0, 0.0, 9.0], [0.1, 0.0, -1.0], 1.0, [70, 50]);
    let small = camera([0.0, 0.0, 4.0], [0.0, 0.0, -1.0], 1.0, [33, 21]);
    let scene = of_spheres(&[sphere(0.2, 5.0)]);
    let mut hits = SurfaceHits::default();
    for path in [Path::Pencil, Path::General] {
        let options = Options { path, ..Options::default() };
        for (pencil, keep_corners) in
            [(&near, true), (&far, true), (&near, true), (&far, false), (&small, false), (&small, true)]
        {
            let dicing = Dicing { shading_rate: 2.0, keep_corners };
            hits.find(&scene, pencil, &dicing, &options).expect("an answer");
            let (new, _) = closest_hit_on_demand(&scene, pencil, &dicing, &options).expect("an answer");
            assert_same(&hits, &new, "used again");
            assert_eq!(hits.corners(), new.corners());
            assert_eq!((hits.tiles().len(), hits.pairs()), (new.tiles().len(), new.pairs()));
        }
    }
}

/// A closed surface lets no ray through, from inside or outside, and its rates differ.
#[test]
fn closed_surfaces_are_watertight() {
    for (height, bumps, rate) in [(0.0, 1.0, 0.5), (0.4, 7.0, 0.5), (0.4, 7.0, 3.0), (0.1, 30.0, 20.0)] {
        let scene = of_spheres(&[sphere(height, bumps)]);
        for eye in [[0.0, 0.0, 0.0], [0.3, -0.6, 0.2], [0.9, 0.1, 0.05]] {
            let (seen, _) = see(&scene, &cube_map(eye, 96), &rated(rate));
            let missed = seen.ids().iter().filter(|&&id| id != 7).count();
            assert_eq!(missed, 0, "from {eye:?}, height {height}, rate {rate}");
        }
        // The surface is seen from its outer side only, up to rounding of the normal.
        let pencil = camera([1.9, 0.8, 1.1], [-1.9, -0.8, -1.1], 1.0, [300, 300]);
        let (seen, _) = see(&scene, &pencil, &rated(rate));
        for (ray, normal) in seen.normals().iter().enumerate().filter(|(_, normal)| !normal[0].is_nan()) {
            let cosine = pencil.ray(ray).direction.normalize().dot(DVec3::from(normal.map(f64::from)));
            assert!(cosine < 1e-6, "ray {ray}: {cosine}");
        }
    }
}

/// Edges that neighbours dice at rates of their own are one line of points: rows of grids snap to it.
#[test]
fn rates_differ_between_neighbours() {
    let scene = of_spheres(&[sphere(0.4, 7.0)]);
    let pencil = camera([1.9, 0.8, 1.1], [-1.9, -0.8, -1.1], 1.0, [200, 200]);
    let diced = dice_all(&scene, &pencil, &Dicing::default()).expect("triangles");
    let mut lengths: Vec<f64> = Vec::new();
    let mut edges: std::collections::HashMap<[[u32; 3]; 2], i32> = std::collections::HashMap::new();
    for corners in diced.indices() {
        let at = corners.map(|v| diced.positions()[v as usize].map(|x| (x + 0.0).to_bits()));
        let uv = corners.map(|v| diced.parameters()[v as usize]);
        lengths.push((uv[1][0] - uv[0][0]).abs().max((uv[1][1] - uv[0][1]).abs()));
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            // An edge and its opposite cancel.
            let (ends, sign) =
                if at[from] < at[to] { ([at[from], at[to]], 1) } else { ([at[to], at[from]], -1) };
            *edges.entry(ends).or_default() += sign;
        }
    }
    let open = edges.values().filter(|&&sum| sum != 0).count();
    assert_eq!(open, 0, "of {} edges", edges.len());
    lengths.sort_by(f64::total_cmp);
    let (least, most) = (lengths[lengths.len() / 100], lengths[lengths.len() - 1]);
    assert!(most > 3.0 * least, "{least} to {most}");
}

#[test]
fn extremes() {
    let pencil = camera([3.0, 2.0, 4.0], [-3.0, -2.0, -4.0], 2.0, [20, 16]);
    for rate in [1.0 / 16.0, 64.0, 4096.0] {
        checked(&of_spheres(&[sphere(0.3, 5.0)]), &pencil, &rated(rate), &format!("rate {rate}"));
    }
    for scale in [1e-12, 1e12] {
        let scene = of_spheres(&[Sphere { radius: scale, ..sphere(0.1 * scale, 3.0) }]);
        let pencil = camera([3.0, 2.0, 4.0].map(|x| x * scale), [-3.0, -2.0, -4.0], 2.0, [40, 30]);
        let pencil = match pencil.origin() {
            Origin::Point(eye) => {
                let eye = DVec3::from(eye.to_array().map(|x| f64::from(x as f32)));
                Pencil::new(Origin::Point(eye), pencil.films().to_vec()).expect("in range")
            }
            Origin::Infinity(_) => pencil,
        };
        checked(&scene, &pencil, &Dicing::default(), &format!("scale {scale}"));
    }
    let flat = Surfaces::default();
    let (seen, _) = see(&flat, &pencil, &Dicing::default());
    assert!(seen.ids().iter().all(|&id| id == u32::MAX) && seen.ts().iter().all(|t| *t == f32::INFINITY));
}

#[test]
fn refusals() {
    let scene = of_spheres(&[sphere(0.0, 1.0)]);
    let pencil = camera([3.0, 2.0, 4.0], [-3.0, -2.0, -4.0], 2.0, [20, 16]);
    let told = |scene: &Surfaces, pencil: &Pencil, rate: f64| {
        let found = closest_hit_on_demand(scene, pencil, &rated(rate), &Options::default());
        found.expect_err("refused").to_string()
    };
    for rate in [0.0, -1.0, f64::NAN, 1e9] {
        assert!(told(&scene, &pencil, rate).contains("shading rate"), "{rate}");
    }
    let scattered = vec![Film::Scattered(vec![DVec3::X])];
    let scattered = Pencil::new(pencil.origin(), scattered).expect("in range");
    assert!(told(&scene, &scattered, 0.5).contains("scattered"));
    let mut broken = Surfaces::default();
    broken.beziers.push(Bezier { points: [[f64::NAN; 3]; 16], id: 5 });
    assert!(told(&broken, &pencil, 0.5).contains("surface 5 is not finite"));
    assert!(dice_all(&broken, &pencil, &Dicing::default()).is_err());
}

/// What hides behind a wall is never diced, and memory does not grow with the number of micropolygons.
#[test]
fn hidden_surfaces_cost_little() {
    let wall =
        |z: f64, id: u32| Plane { corner: [-9.0, -9.0, z], sides: [[18.0, 0.0, 0.0], [0.0, 18.0, 0.0]], id };
    let pencil = camera([0.0, 0.0, 4.0], [0.0, 0.0, -1.0], 1.0, [256, 256]);
    let alone = Surfaces { planes: vec![wall(0.0, 0)], ..Surfaces::default() };
    let (seen_alone, one) = see(&alone, &pencil, &Dicing::default());
    let mut many = alone.clone();
    many.planes.extend((1..40).map(|k| wall(-0.1 * f64::from(k), k)));
    let (seen, all) = see(&many, &pencil, &Dicing::default());
    assert_same(&seen, &seen_alone, "walls");
    println!("one wall {one:?}\nforty {all:?}");
    let more = all.micropolygons as f64 / one.micropolygons as f64;
    assert!(more < 1.2, "{more}");

    // One thread: of more, some may find nothing to do.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("threads");
    let bytes = |rate: f64| {
        let (_, stats) = pool.install(|| see(&of_spheres(&[sphere(0.3, 5.0)]), &pencil, &rated(rate)));
        println!("rate {rate}: {} micropolygons, {} bytes", stats.micropolygons, stats.engine_bytes);
        (stats.micropolygons, stats.engine_bytes)
    };
    let ((few, small), (many, large)) = (bytes(0.5), bytes(1.0 / 16.0));
    assert!(many > 30 * few, "{many} and {few}");
    assert!(large < 2 * small && large < 2 << 20, "{large} and {small}");
}
