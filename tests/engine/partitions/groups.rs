//! Groups of triangles: the given partition divides between them, and no hit depends on them.

use common::generators::Mesh;
use common::generators::meshes::sphere;
use umbel::engine::Partition;
use umbel::glam::DVec3;
use umbel::{NO_TRIANGLE, Ray, Scene, Stats, Triangles, builtin, closest_hit};

use super::{agree, bits, by, confetti, count, random_rays};

/// Groups of one size.
fn every(size: usize, triangles: usize) -> Vec<u32> {
    (1..=triangles.div_ceil(size)).map(|group| (group * size).min(triangles) as u32).collect()
}

/// Boxes and pairs, weighed as the general path weighs them.
fn tests(stats: &Stats) -> u64 {
    2 * stats.box_tests + 3 * stats.samples_tested
}

/// A row of balls, one group each, of 8 to 2048 triangles.
fn balls() -> (Mesh, Vec<u32>) {
    let (mut mesh, mut ends) = (Mesh::default(), Vec::new());
    for (place, levels) in [4, 0, 2, 1, 3, 0, 4, 1, 2, 0, 3, 1].into_iter().enumerate() {
        let (ball, first) = (sphere(levels, |_| 1.0), mesh.positions.len() as u32);
        mesh.positions.extend(ball.positions.iter().map(|[x, y, z]| [x + 3.0 * place as f32, *y, *z]));
        mesh.triangles.extend(ball.triangles.iter().map(|corners| corners.map(|k| first + k)));
        ends.push(mesh.triangles.len() as u32);
    }
    (mesh, ends)
}

#[test]
fn no_hit_depends_on_groups() {
    let (balls, of_balls) = balls();
    let random = confetti(22, 3000, DVec3::splat(0.1));
    let n = random.triangles.len();
    let lopsided: Vec<u32> = (0..10).map(|k| 1 << k).chain([n as u32 - 1, n as u32]).collect();
    let cases = [
        ("one group", &random, every(n, n)),
        ("a group for each triangle", &random, every(1, n)),
        ("pairs", &random, every(2, n)),
        ("groups of 100", &random, every(100, n)),
        ("groups of very different sizes", &random, lopsided),
        ("balls", &balls, of_balls),
    ];
    for (name, mesh, ends) in cases {
        let rays = random_rays(23, &mesh.positions, 4000);
        let (expected, _) = agree(name, &mesh.geometry(), &rays);
        let grouped = mesh.geometry().with_groups(&ends).expect("groups");
        let (found, _) = agree(name, &grouped, &rays);
        assert_eq!(bits(&found), bits(&expected), "{name}");
        assert!(count(&found) > 300, "{name}: {}", count(&found));
    }
}

#[test]
fn nothing_has_no_groups() {
    let empty = Mesh::default();
    let triangles = empty.geometry().with_groups(&[]).expect("no groups");
    let (hits, _) = agree("nothing", &triangles, &[Ray::new(DVec3::ZERO, DVec3::X)]);
    assert_eq!(hits.ids(), [NO_TRIANGLE]);
}

/// Where groups are the objects, the boxes that their halves have are smaller than those of halves of the order.
#[test]
fn groups_spare_tests() {
    let (mesh, ends) = balls();
    let rays = random_rays(24, &mesh.positions, 4000);
    let [grouped, ungrouped] = [mesh.geometry().with_groups(ends).expect("groups"), mesh.geometry()]
        .map(|triangles| closest_hit(&triangles, &rays[..], &by(Partition::Given)).expect("in range").1);
    println!("given: {} tests with groups, {} without", tests(&grouped), tests(&ungrouped));
    assert!(tests(&grouped) < tests(&ungrouped));
}

/// An order that nothing can be said of stays the middle partition's, whatever its groups are.
#[test]
fn groups_that_do_not_separate_are_not_followed() {
    let mesh = confetti(25, 4000, DVec3::splat(0.05));
    let rays = random_rays(26, &mesh.positions, 4000);
    let triangles = mesh.geometry().with_groups(every(500, 4000)).expect("groups");
    let [given, middle] = [Partition::Given, Partition::Middle]
        .map(|partition| closest_hit(&triangles, &rays[..], &by(partition)).expect("in range").1);
    // One step more, which is asked twice.
    assert!(given.nodes <= middle.nodes + 1, "{} of {}", given.nodes, middle.nodes);
}

#[test]
fn wrong_groups_are_refused() {
    let mesh = confetti(27, 5, DVec3::splat(0.1));
    let refused = |ends: &[u32]| {
        let error = mesh.geometry().with_groups(ends.to_vec()).map(|_| ()).expect_err("wrong groups");
        assert!(!error.is_about_rays());
        error.to_string()
    };
    for (ends, says) in [
        (&[][..], "the groups end at triangle 0, but there are 5 triangles"),
        (&[2, 4][..], "the groups end at triangle 4, but there are 5 triangles"),
        (&[2, 6][..], "the groups end at triangle 6, but there are 5 triangles"),
        (&[2, 2, 5][..], "group 1 ends at triangle 2, and the group before it at 2"),
        (&[4, 1, 5][..], "group 1 ends at triangle 1, and the group before it at 4"),
        (&[0, 5][..], "group 0 ends at triangle 0"),
    ] {
        assert!(refused(ends).contains(says), "{ends:?}: {}", refused(ends));
    }
    let none = Triangles::new(&[], &[]).expect("nothing");
    assert!(none.with_groups(&[1]).is_err());
}

/// What a scene gives the engine has its objects as groups, also where they do not cover it.
#[test]
fn scenes_tell_their_objects() {
    let work = |scene: &Scene| {
        let rays = random_rays(28, &scene.positions, 3000);
        let geometry = scene.geometry().expect("valid");
        let (hits, stats) = closest_hit(&geometry, &rays[..], &by(Partition::Given)).expect("in range");
        (bits(&hits), tests(&stats))
    };
    let mut scene = builtin("umbel:5000").expect("a scene");
    let (hits, with_objects) = work(&scene);
    assert!(scene.objects.len() > 10);
    let objects = std::mem::take(&mut scene.objects);
    let (same, without) = work(&scene);
    println!("{} objects: {with_objects} tests with them, {without} without", objects.len());
    assert_eq!(hits, same);
    assert_ne!(with_objects, without);
    // Some are missing, and others end behind the triangles that are left.
    scene.objects = objects.into_iter().step_by(3).collect();
    scene.triangles.truncate(3500);
    work(&scene);
}
