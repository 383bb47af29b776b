//! The rays that hits send on, and the pictures that they make.

use umbel::engine::Isa;
use umbel::glam::DVec3;
use umbel::render::{Bounces, Look, preview_with};
use umbel::scene::Optics;
use umbel::shadow::{point_light, sun_light};
use umbel::{Hit, Options, Path, Ray, Scene, TriangleId, Triangles, builtin, closest_hit, visibility};

use super::{BOTH, add, add_box, camera};

/// A small flower over a large mirror at y = 0.
fn over_a_mirror(optics: Optics) -> Scene {
    let mut scene = builtin("umbel:2000").expect("a scene");
    scene.positions.iter_mut().for_each(|position| position[1] += 0.25);
    scene.normal_indices.clear();
    let corners = [[-9.0, 0.0, 9.0], [9.0, 0.0, 9.0], [9.0, 0.0, -9.0], [-9.0, 0.0, -9.0]];
    add(&mut scene, "mirror", optics, &corners, &[[0, 1, 2], [0, 2, 3]]);
    scene
}

/// What a ray hits first.
fn hit(triangles: &Triangles<'_>, ray: &Ray) -> Hit {
    let (hits, _) = closest_hit(triangles, std::slice::from_ref(ray), &Options::default()).expect("a query");
    hits.get(0).expect("a hit")
}

/// The colours of a picture and the rays of each bounce.
fn picture(scene: &Scene, bounces: Bounces, options: &Options) -> (Vec<f32>, Vec<u64>) {
    let camera = camera(DVec3::new(3.0, 2.5, 3.0), DVec3::new(0.0, 0.8, 0.0), [96, 72]);
    let (buffer, _) = visibility(scene, &camera, options).expect("a picture");
    let lights = vec![point_light(DVec3::new(1.0, 6.0, 2.0)), sun_light(DVec3::new(1.0, 2.0, 0.5))];
    let look = Look { samples: 1, lights, bounces };
    let seen = preview_with(scene, &camera, &buffer, &look, options, |_| {}).expect("a picture");
    (seen.linear, seen.followed.rays)
}

#[test]
fn a_mirror_shows_the_mirrored_scene() {
    let scene = over_a_mirror(Optics::MIRROR);
    let mut mirrored = scene.clone();
    let without = mirrored.triangles.len() - 2;
    mirrored.triangles.truncate(without);
    mirrored.positions.iter_mut().for_each(|position| position[1] = -position[1]);
    let (triangles, images) = (scene.geometry().expect("triangles"), mirrored.geometry().expect("triangles"));
    let camera = camera(DVec3::new(2.5, 2.0, 2.5), DVec3::new(0.0, -0.6, 0.0), [160, 120]);
    let (buffer, _) = visibility(&scene, &camera, &Options::default()).expect("a picture");

    let (mut straight, mut reflected, mut before) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..buffer.hits.len() {
        let (ray, hit) = (buffer.shot.pencil.ray(k), buffer.hits.get(k));
        let Some(hit) = hit.filter(|hit| hit.id.0 as usize >= without) else { continue };
        let spawned = BOTH.spawn(&scene, &triangles, &ray, &hit);
        assert!(spawned.refracted.is_none());
        reflected.push(spawned.reflected.expect("a mirror mirrors").0);
        before.push(f64::from(hit.t) * ray.direction.length());
        straight.push(Ray::new(ray.origin, ray.direction.normalize()));
    }
    let (found, _) = closest_hit(&triangles, &reflected[..], &Options::default()).expect("a query");
    let (expected, _) = closest_hit(&images, &straight[..], &Options::default()).expect("a query");
    let mut hits = 0;
    for (k, before) in before.iter().enumerate() {
        let (found, expected) = (found.get(k), expected.get(k));
        assert_eq!(found.map(|hit| hit.id), expected.map(|hit| hit.id), "ray {k}");
        if let (Some(found), Some(expected)) = (found, expected) {
            hits += 1;
            // Starts are f32 points, and so are distances.
            assert!((before + f64::from(found.t) - f64::from(expected.t)).abs() < 4e-6, "ray {k}");
        }
    }
    assert!(hits > 500 && hits < before.len(), "{hits} of {}", before.len());
}

#[test]
fn a_slab_shifts_rays_and_keeps_their_direction() {
    let (index, height) = (1.5_f64, 0.5_f64);
    let mut scene = Scene::default();
    add_box(&mut scene, "slab", Optics::glass(index as f32), [-9.0, -9.0, -0.5], [9.0, 9.0, 0.0]);
    let triangles = scene.geometry().expect("triangles");
    for degrees in [0.0, 5.0, 30.0, 60.0, 85.0_f64] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let direction = DVec3::new(sine * 0.6, sine * 0.8, -cosine);
        let ray = Ray::new(DVec3::new(0.1, 0.2, 0.0) - direction, direction);
        let (inside, share_in) =
            BOTH.spawn(&scene, &triangles, &ray, &hit(&triangles, &ray)).refracted.expect("light enters");
        let expected = DVec3::new(direction.x / index, direction.y / index, 0.0);
        assert!((inside.direction - expected).truncate().length() < 1e-14, "{degrees}");
        let (after, share_out) = BOTH
            .spawn(&scene, &triangles, &inside, &hit(&triangles, &inside))
            .refracted
            .expect("light leaves");
        assert!((after.direction - direction).length() < 1e-12, "{degrees}");
        // Reflectance is the same on both sides.
        assert!((share_in[0] - share_out[0]).abs() < 1e-6, "{degrees}");
        let shift = (after.origin - ray.origin).cross(direction).length();
        let formula = height * sine * (1.0 - cosine / (index * index - sine * sine).sqrt());
        assert!((shift - formula).abs() < 1e-6, "{degrees}: {shift} {formula}");
    }
}

#[test]
fn a_prism_mirrors_totally() {
    let corners = [
        [0.0, 0.0, 1.0],
        [2.0, 0.0, 1.0],
        [0.0, 2.0, 1.0],
        [0.0, 0.0, -1.0],
        [2.0, 0.0, -1.0],
        [0.0, 2.0, -1.0],
    ];
    let faces = [[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [0, 2, 5], [0, 5, 3], [1, 4, 5], [1, 5, 2]];
    let mut scene = Scene::default();
    add(&mut scene, "prism", Optics::glass(1.5), &corners, &faces);
    let triangles = scene.geometry().expect("triangles");
    // In through the side at x = 0, to the slanted side, out through the bottom.
    let ray = Ray::new(DVec3::new(-1.0, 0.7, 0.1), DVec3::X);
    let entered = BOTH.spawn(&scene, &triangles, &ray, &hit(&triangles, &ray));
    assert!((entered.reflected.expect("some is mirrored").1[1] - 0.04).abs() < 1e-7);
    let inside = entered.refracted.expect("most enters").0;
    for bounces in [BOTH, Bounces { reflect: false, ..BOTH }] {
        let turned = bounces.spawn(&scene, &triangles, &inside, &hit(&triangles, &inside));
        assert!(turned.refracted.is_none());
        let (down, share) = turned.reflected.expect("all is mirrored");
        assert_eq!((share, turned.own), ([1.0; 3], [0.0; 3]));
        assert!((down.direction - DVec3::NEG_Y).length() < 1e-12);
        let out =
            bounces.spawn(&scene, &triangles, &down, &hit(&triangles, &down)).refracted.expect("a way out").0;
        assert!((out.direction - DVec3::NEG_Y).length() < 1e-12);
        assert!(out.origin.y <= 0.0 && (out.origin.x - 1.3).abs() < 1e-6);
    }
}

#[test]
fn shares_add_up() {
    let tinted = Optics { transmission: [0.9, 0.5, 0.0], ..Optics::glass(1.33) };
    let thin = Optics { mirror: [0.04; 3], transmission: [0.5; 3], ior: 1.0 };
    for optics in [Optics::OPAQUE, Optics::MIRROR, Optics::glass(1.5), tinted, thin] {
        let scene = over_a_mirror(optics);
        let triangles = scene.geometry().expect("triangles");
        for k in 1..60 {
            let ray = Ray::new(DVec3::new(0.0, 2.0, 6.0), DVec3::new(0.02, -f64::from(k) * 0.05, 0.03));
            let hit = hit(&triangles, &ray);
            for bounces in [BOTH, Bounces { reflect: false, ..BOTH }, Bounces { refract: false, ..BOTH }] {
                let spawned = bounces.spawn(&scene, &triangles, &ray, &hit);
                let share = |part: Option<(Ray, [f32; 3])>| part.map_or([0.0; 3], |(_, share)| share);
                for c in 0..3 {
                    let sum = spawned.own[c] + share(spawned.reflected)[c] + share(spawned.refracted)[c];
                    assert!((sum - 1.0).abs() < 1e-6, "{optics:?} {k}: {sum}");
                }
            }
        }
    }
}

#[test]
fn a_clear_pane_of_index_1_hides_nothing() {
    let clear = over_a_mirror(Optics { transmission: [1.0; 3], ..Optics::OPAQUE });
    let triangles = clear.geometry().expect("triangles");
    let ray = Ray::new(DVec3::new(0.3, -2.0, 0.2), DVec3::new(0.01, 1.0, 0.02));
    let pane = hit(&triangles, &ray);
    assert!(pane.id.0 as usize >= clear.triangles.len() - 2);
    let spawned = BOTH.spawn(&clear, &triangles, &ray, &pane);
    assert_eq!((spawned.own, spawned.reflected), ([0.0; 3], None));
    let (behind, share) = spawned.refracted.expect("all passes");
    assert_eq!((behind.direction, share), (ray.direction, [1.0; 3]));
    let without = Triangles::new(&clear.positions, &clear.triangles[..clear.triangles.len() - 2]);
    assert_eq!(hit(&triangles, &behind).id, hit(&without.expect("triangles"), &ray).id);
}

#[test]
fn without_bounces_a_picture_is_plain() {
    let options = Options::default();
    let plain = picture(&over_a_mirror(Optics::OPAQUE), Bounces::default(), &options);
    for (optics, bounces) in [
        (Optics::OPAQUE, BOTH),
        (Optics::MIRROR, Bounces { most: 0, ..BOTH }),
        (Optics::glass(1.5), Bounces { most: 0, ..BOTH }),
        (Optics::MIRROR, Bounces { reflect: false, ..BOTH }),
        (Optics { transmission: [0.5; 3], ..Optics::OPAQUE }, Bounces { refract: false, ..BOTH }),
    ] {
        let (colours, rays) = picture(&over_a_mirror(optics), bounces, &options);
        assert!(colours == plain.0 && rays.is_empty(), "{optics:?} {bounces:?}");
    }
    let (colours, rays) = picture(&over_a_mirror(Optics::MIRROR), BOTH, &options);
    assert!(colours != plain.0 && rays.len() == 1 && rays[0] > 100);
}

#[test]
fn threads_and_instructions_do_not_matter() {
    let mut scene = over_a_mirror(Optics::MIRROR);
    add_box(&mut scene, "glass", Optics::glass(1.5), [0.6, 0.1, 0.6], [1.4, 0.9, 1.4]);
    let run = |threads: usize, options: Options| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| picture(&scene, BOTH, &options))
    };
    let expected = run(1, Options::default());
    assert!(expected.1.len() == 4, "{:?}", expected.1);
    for (threads, options) in [
        (2, Options::default()),
        (3, Options { isa: Isa::Sse2, ..Options::default() }),
        (2, Options { path: Path::General, ..Options::default() }),
    ] {
        assert!(run(threads, options) == expected, "{threads} {options:?}");
    }
}

#[test]
fn a_room_of_mirrors_ends() {
    let mut scene = Scene::default();
    add_box(&mut scene, "room", Optics::MIRROR, [-5.0, -5.0, -5.0], [5.0, 5.0, 5.0]);
    for most in [1, 2, 7] {
        let (colours, rays) = picture(&scene, Bounces { most, ..BOTH }, &Options::default());
        assert_eq!(rays, vec![96 * 72; most as usize]);
        assert!(colours.iter().all(|x| x.is_finite() && (0.0..2.0).contains(x)));
    }
}

#[test]
fn every_start_is_on_the_side_that_its_ray_leaves_to() {
    let mut scene = builtin("umbel:1000").expect("a scene");
    for name in scene.objects.iter().map(|object| object.name.clone()).collect::<Vec<_>>() {
        assert!(scene.set_optics(&name, Optics::glass(1.4)) > 0);
    }
    let triangles = scene.geometry().expect("triangles");
    let camera = camera(DVec3::new(3.0, 2.0, 3.0), DVec3::new(0.0, 0.9, 0.0), [120, 90]);
    let (buffer, _) = visibility(&scene, &camera, &Options::default()).expect("a picture");
    let (mut rays, mut own) = (Vec::new(), Vec::new());
    for k in 0..buffer.hits.len() {
        let Some(hit) = buffer.hits.get(k) else { continue };
        let spawned = BOTH.spawn(&scene, &triangles, &buffer.shot.pencil.ray(k), &hit);
        for (ray, _) in [spawned.reflected, spawned.refracted].into_iter().flatten() {
            let side = triangles.side_of(hit.id, ray.origin);
            assert!(side.is_none() || side == triangles.side_toward(hit.id, ray.direction));
            rays.push(ray);
            own.push(hit.id);
        }
    }
    let (hits, _) = closest_hit(&triangles, &rays[..], &Options::default()).expect("a query");
    assert!(rays.len() > 1000 && own.iter().enumerate().all(|(k, id)| hits.ids()[k] != id.0));
}

#[test]
fn optics_are_given_to_objects_and_materials_by_name() {
    let mut scene = builtin("cornell").expect("a scene");
    let optics = |scene: &Scene, object: &str| {
        let object = scene.objects.iter().find(|found| found.name == object).expect("an object");
        scene.material_of(object.triangles.start).map(|material| (material.optics, material.diffuse))
    };
    let white = optics(&scene, "floor").expect("a material").1;
    assert_eq!(scene.set_optics("floor", Optics::MIRROR), 1);
    assert_eq!(optics(&scene, "floor"), Some((Optics::MIRROR, white)));
    assert_eq!(optics(&scene, "ceiling"), Some((Optics::OPAQUE, white)));
    assert_eq!(scene.set_optics("white", Optics::glass(1.5)), 5);
    assert_eq!(optics(&scene, "floor"), Some((Optics::glass(1.5), white)));
    assert_eq!(scene.set_optics("nothing", Optics::MIRROR), 0);
    assert_eq!(scene.material_of(TriangleId(9999).0), None);
}
