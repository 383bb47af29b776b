//! Frames that are used again: the same answer as from scratch, whatever survived from the frame before; and what a query
//! costs in memory.

use common::random::Random;
use umbel::engine::{Film, GridFilm, Partition, Rays};
use umbel::glam::DVec3;
use umbel::{Frame, NO_TRIANGLE, Options, Origin, Path, Pencil, Ray, Scene, Triangles, builtin, closest_hit};

/// A pinhole at some distance in front of a scene's box.
fn view(scene: &Scene, width: u32, height: u32) -> Pencil {
    let bounds = umbel::engine::Aabb::of_points(scene.positions.iter().copied());
    let (centre, extent) = (DVec3::from_array(bounds.centre()), DVec3::from_array(bounds.extent()));
    let eye = centre + DVec3::new(0.3, 0.2, 1.1) * extent.max_element();
    let forward = centre - eye;
    let right = forward.cross(DVec3::Y).normalize() * (forward.length() * 0.6 / f64::from(width));
    let up = right.cross(forward).normalize() * right.length();
    let film = GridFilm::new(width, height, forward, right, up).expect("a valid film");
    Pencil::new(Origin::Point(eye), vec![Film::Grid(film)]).expect("rays in range")
}

/// The triangles in another order, and where each of them was.
fn shuffled(triangles: &[[u32; 3]], seed: u64) -> (Vec<[u32; 3]>, Vec<u32>) {
    let mut random = Random(seed);
    let mut places: Vec<u32> = (0..triangles.len() as u32).collect();
    for last in (1..places.len()).rev() {
        places.swap(last, random.below(last + 1));
    }
    (places.iter().map(|&place| triangles[place as usize]).collect(), places)
}

#[test]
fn frames_of_a_moving_scene_are_those_from_scratch() {
    let mut scene = builtin("umbel:20000").expect("a scene");
    let (triangles, _) = shuffled(&scene.triangles, 7);
    let mut frames = [Frame::new(), Frame::keeping_order()];
    for step in 0..4 {
        for position in &mut scene.positions {
            position[0] += position[1] * 0.05;
        }
        // Fewer triangles at times, and films of other sizes: nothing of the frame before fits.
        let some = &triangles[..triangles.len() - 3000 * (step % 2)];
        let pencil = view(&scene, 301 + 20 * step as u32, 203);
        let geometry = Triangles::new(&scene.positions, some).expect("valid triangles");
        let (expected, _) = closest_hit(&geometry, &pencil, &Options::default()).expect("in range");
        assert!(expected.ids().iter().any(|&id| id != NO_TRIANGLE));
        for frame in &mut frames {
            frame.closest_hit(&geometry, &pencil, &Options::default()).expect("in range");
            assert_eq!(*frame.hits(), expected, "step {step}");
        }
    }
}

#[test]
fn shuffled_triangles_are_the_same_triangles() {
    let scene = builtin("umbel:30000").expect("a scene");
    let pencil = view(&scene, 400, 300);
    let geometry = Triangles::new(&scene.positions, &scene.triangles).expect("valid triangles");
    let (expected, _) = closest_hit(&geometry, &pencil, &Options::default()).expect("in range");
    let (other, places) = shuffled(&scene.triangles, 3);
    let geometry = Triangles::new(&scene.positions, &other).expect("valid triangles");
    let (hits, _) = closest_hit(&geometry, &pencil, &Options::default()).expect("in range");
    assert_eq!(hits.ts(), expected.ts());
    let mut moved = 0;
    for (&id, &before) in hits.ids().iter().zip(expected.ids()) {
        let was = places.get(id as usize).copied().unwrap_or(NO_TRIANGLE);
        // Where faces coincide the smaller id wins, and ids have changed.
        moved += usize::from(was != before);
    }
    assert!(moved * 1000 < hits.len(), "{moved}");
}

/// 6 bytes per triangle, 1 per ray, 256 KiB per thread.
#[test]
fn memory_keeps_its_contract() {
    for (triangles, (width, height)) in [(3000, (640, 480)), (100_000, (1920, 1080)), (400_000, (512, 512))] {
        let scene = builtin(&format!("umbel:{triangles}")).expect("a scene");
        let (other, _) = shuffled(&scene.triangles, 5);
        let pencil = view(&scene, width, height);
        for triangles in [&scene.triangles, &other] {
            let geometry = Triangles::new(&scene.positions, triangles).expect("valid triangles");
            let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
            let (_, stats) =
                pool.install(|| closest_hit(&geometry, &pencil, &Options::default())).expect("in range");
            let allowed = 6 * triangles.len() + pencil.len() + 2 * 256 * 1024;
            assert!(stats.engine_bytes as usize <= allowed, "{} of {allowed}", stats.engine_bytes);
        }
    }
}

#[test]
fn tiles_tell_where_the_work_was() {
    let scene = builtin("umbel:5000").expect("a scene");
    let pencil = view(&scene, 200, 150);
    let geometry = Triangles::new(&scene.positions, &scene.triangles).expect("valid triangles");
    let mut frame = Frame::new();
    let stats = frame.closest_hit(&geometry, &pencil, &Options::default()).expect("in range");
    let tiles = frame.tiles();
    let rays: u32 =
        tiles.iter().map(|tile| (tile.columns[1] - tile.columns[0]) * (tile.rows[1] - tile.rows[0])).sum();
    assert_eq!(rays as usize, pencil.len());
    let samples: u64 = tiles.iter().map(|tile| tile.stats.samples_tested).sum();
    assert_eq!(samples, stats.samples_tested);
    assert!(tiles.iter().any(|tile| tile.samples_per_ray() > 1.0));
    let general = Options { path: Path::General, ..Options::default() };
    frame.closest_hit(&geometry, &pencil, &general).expect("in range");
    assert!(frame.tiles().is_empty());
}

/// All pairs of some rays.
fn sum(pairs: &[u32]) -> u64 {
    pairs.iter().map(|&pairs| u64::from(pairs)).sum()
}

/// A frame that counts, on some rays: the same hits as without, and as many pairs as the counters say.
fn counted(name: &str, triangles: &Triangles<'_>, rays: Rays<'_>, options: &Options) -> Vec<u32> {
    let (expected, plain) = closest_hit(triangles, rays, options).expect("in range");
    let mut frame = Frame::new().counting_pairs();
    // Used again: nothing is left of the query before.
    for _ in 0..2 {
        let stats = frame.closest_hit(triangles, rays, options).expect("in range");
        assert_eq!(*frame.hits(), expected, "{name}");
        assert_eq!(stats.samples_tested, plain.samples_tested, "{name}");
        let pairs = frame.pairs();
        assert!(pairs.is_empty() || sum(pairs) == stats.samples_tested, "{name}: {}", sum(pairs));
    }
    frame.pairs().to_vec()
}

#[test]
fn rays_tell_what_they_cost() {
    let scene = builtin("umbel:5000").expect("a scene");
    let geometry = scene.geometry().expect("valid");
    let pencil = view(&scene, 130, 100);
    let rays: Vec<Ray> = (0..pencil.len()).map(|ray| pencil.ray(ray)).collect();
    let directions: Vec<DVec3> = rays.iter().map(|ray| ray.direction).collect();
    let scattered = Pencil::new(pencil.origin(), vec![Film::Scattered(directions)]).expect("in range");
    let default = Options::default();
    // The first row sees nothing of the scene, the middle of the picture much.
    let plausible = |name: &str, pairs: &[u32]| {
        assert_eq!(pairs.len(), rays.len(), "{name}");
        let mean = |rays: &[u32]| sum(rays) as f64 / rays.len() as f64;
        let (empty, full) = (mean(&pairs[..130]), mean(&pairs[130 * 40..130 * 60]));
        assert!(full > 4.0 * empty && full > 2.0, "{name}: {empty} {full}");
    };
    for partition in Partition::ALL {
        let options = Options { path: Path::General, partition, ..default };
        let name = format!("{partition:?}");
        let of_pencil = counted(&name, &geometry, (&pencil).into(), &options);
        plausible(&name, &of_pencil);
        assert_eq!(of_pencil, counted(&name, &geometry, rays[..].into(), &options));
    }
    plausible("bundles", &counted("bundles", &geometry, rays[..].into(), &default));
    plausible("scattered", &counted("scattered", &geometry, (&scattered).into(), &default));
    assert!(counted("grid", &geometry, (&pencil).into(), &default).is_empty());
    assert!(counted("none", &geometry, Rays::from(&rays[..0]), &default).is_empty());

    let films = [pencil.films(), scattered.films()].concat();
    let both = Pencil::new(pencil.origin(), films).expect("in range");
    let mut frame = Frame::new().counting_pairs();
    frame.closest_hit(&geometry, &both, &default).expect("in range");
    let (of_grid, of_scattered) = frame.pairs().split_at(pencil.len());
    assert!(of_grid.iter().all(|&pairs| pairs == 0));
    plausible("beside a grid", of_scattered);
    let tiles = frame.tiles().iter().filter(|tile| tile.film == 1).map(|tile| tile.stats.samples_tested);
    assert_eq!(tiles.sum::<u64>(), sum(of_scattered));
}

/// Where bundles give up, the general path counts in their place.
#[test]
fn rays_of_huge_scenes_tell_what_they_cost() {
    let mut scene = builtin("cornell").expect("a scene");
    let scale = 2_f32.powi(100);
    scene.positions.iter_mut().flatten().for_each(|x| *x *= scale);
    let geometry = scene.geometry().expect("valid");
    let pencil = view(&scene, 40, 30);
    let rays: Vec<Ray> = (0..pencil.len()).map(|ray| pencil.ray(ray)).collect();
    let pairs = counted("huge", &geometry, rays[..].into(), &Options::default());
    assert!(pairs.len() == rays.len() && pairs.iter().any(|&pairs| pairs > 0));
}
