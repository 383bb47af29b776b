//! Masks against exact integers: is the light on the seen side of the plane, and does anything block the way?

use common::generators::{self, KINDS, Kind, Mesh, widen};
use common::oracle::{self, OracleRay, Ties};
use common::random::Random;
use common::sides;
use umbel::engine::{Film, shadowed};
use umbel::glam::DVec3;
use umbel::shadow::{Receivers, receivers};
use umbel::{Hits, NO_TRIANGLE, Options, Origin, Path, Pencil, closest_hit};

/// Whether the light is strictly on the side of a triangle that a ray sees.
fn turns(mesh: &Mesh, light: Origin, id: u32, seen_along: DVec3) -> bool {
    let own = mesh.corners(id as usize);
    let seen = sides::facing(own, -seen_along);
    match light {
        Origin::Point(l) => sides::side(own, l) == seen,
        Origin::Infinity(d) => sides::facing(own, -d) == seen,
    }
}

/// Whether anything stands between the light and a point, the receiver's own triangle too.
fn blocked(mesh: &Mesh, light: Origin, point: [f32; 3]) -> bool {
    let point = widen(point);
    match light {
        Origin::Point(l) => {
            let all = (0..mesh.triangles.len()).map(|id| mesh.corners(id));
            sides::segment_blocked(all, None, [l, point])
        }
        Origin::Infinity(d) => {
            let ray = OracleRay {
                origin: point.to_array(),
                direction: (-d).to_array(),
                t_min: 0.0,
                t_max: f64::INFINITY,
                ties: Ties::Origin,
            };
            oracle::any(&mesh.positions, &mesh.triangles, &ray)
        }
    }
}

/// What a camera somewhere sees of a scene: scattered rays, some of which aim at vertices and edges.
fn seen(random: &mut Random, kind: Kind, mesh: &Mesh) -> (Pencil, Hits) {
    let eye = generators::eye(random, kind, mesh);
    let directions = (0..40).map(|_| generators::direction(random, kind, mesh, eye)).collect();
    let pencil = Pencil::new(Origin::Point(eye), vec![Film::Scattered(directions)]).expect("rays");
    let (hits, _) = closest_hit(&mesh.geometry(), &pencil, &Options::default()).expect("hits");
    (pencil, hits)
}

/// The receivers of one light, checked: they are the hits that turn to it, on the eye's side of their triangles.
fn receivers_of(mesh: &Mesh, light: Origin, (pencil, hits): &(Pencil, Hits)) -> Receivers {
    let found = receivers(&mesh.geometry(), pencil, hits, &[light]).expect("receivers").remove(0);
    let turning = (0..hits.len() as u32).filter(|&ray| {
        let id = hits.ids()[ray as usize];
        id != NO_TRIANGLE && turns(mesh, light, id, pencil.ray(ray as usize).direction)
    });
    assert!(turning.eq(found.rays.iter().copied()), "{light:?}\n{mesh:?}");
    for (receiver, &ray) in found.points.iter().zip(&found.rays) {
        let (id, ray) = (hits.ids()[ray as usize], pencil.ray(ray as usize));
        assert_eq!(receiver.triangle.0, id);
        let corners = mesh.corners(id as usize);
        let side = sides::facing(corners, -ray.direction);
        assert_eq!(sides::side(corners, ray.origin), side, "the eye's side");
        assert_ne!(sides::side(corners, widen(receiver.point)), -side, "on the plane or on that side");
    }
    found
}

/// Compares with the oracle; shadowed and lit ones of all that is seen.
fn compare(mesh: &Mesh, light: Origin, seen: &(Pencil, Hits)) -> [usize; 2] {
    let receivers = receivers_of(mesh, light, seen);
    let surfaces = seen.1.ids().iter().filter(|&&id| id != NO_TRIANGLE).count();
    let mut counts = [0; 2];
    for path in [Path::Pencil, Path::General] {
        let options = Options { path, ..Options::default() };
        let (answers, _) = shadowed(&mesh.geometry(), light, &receivers.points, &options).expect("answers");
        assert_eq!(answers.len(), receivers.points.len());
        for (receiver, &answer) in receivers.points.iter().zip(&answers) {
            assert_eq!(answer, blocked(mesh, light, receiver.point), "{light:?} {receiver:?}\n{mesh:?}");
        }
        let lit = answers.iter().filter(|&&shadowed| !shadowed).count();
        counts = [counts[0] + surfaces - lit, counts[1] + lit];
    }
    counts
}

#[test]
fn point_lights() {
    let mut random = Random(21);
    for kind in KINDS {
        let mut counts = [0; 2];
        for _ in 0..if kind == Kind::Mixed { 30 } else { 80 } {
            let mesh = generators::scene(&mut random, kind, 20);
            let seen = seen(&mut random, kind, &mesh);
            let light = match random.below(3) {
                0 => generators::on_grid(generators::feature(&mut random, &mesh)),
                _ => generators::eye(&mut random, kind, &mesh),
            };
            let found = compare(&mesh, Origin::Point(light), &seen);
            counts = [counts[0] + found[0], counts[1] + found[1]];
        }
        assert!(counts[0] > 100 && counts[1] > 20, "{kind:?}: {counts:?}");
    }
}

#[test]
fn suns() {
    let mut random = Random(22);
    for kind in KINDS {
        let mut counts = [0; 2];
        for _ in 0..if kind == Kind::Mixed { 30 } else { 80 } {
            let mesh = generators::scene(&mut random, kind, 20);
            let seen = seen(&mut random, kind, &mesh);
            let direction = generators::direction(&mut random, kind, &mesh, DVec3::ZERO);
            let found = compare(&mesh, Origin::Infinity(direction), &seen);
            counts = [counts[0] + found[0], counts[1] + found[1]];
        }
        assert!(counts[0] > 100 && counts[1] > 20, "{kind:?}: {counts:?}");
    }
}

/// The light at the eye sees what the eye sees: all is lit, but for what lies beside a vertex within a few ulp.
#[test]
fn a_light_at_the_eye_lights_what_it_sees() {
    let mut random = Random(23);
    let (mut total, mut dark) = (0, 0);
    for _ in 0..60 {
        let mesh = generators::scene(&mut random, Kind::Floats, 60);
        let eye = generators::eye(&mut random, Kind::Floats, &mesh);
        let directions = (0..400).map(|_| random.cube()).collect();
        let pencil = Pencil::new(Origin::Point(eye), vec![Film::Scattered(directions)]).expect("rays");
        let (hits, _) = closest_hit(&mesh.geometry(), &pencil, &Options::default()).expect("hits");
        let light = Origin::Point(eye);
        let seen = receivers_of(&mesh, light, &(pencil, hits));
        let answer = shadowed(&mesh.geometry(), light, &seen.points, &Options::default()).expect("answers");
        total += seen.points.len();
        dark += answer.0.iter().filter(|&&shadowed| shadowed).count();
    }
    assert!(total > 5000 && dark * 1000 < total, "{dark} of {total}");
}

#[test]
fn lights_out_of_range_are_refused() {
    let mesh = Mesh::of([[DVec3::ZERO, DVec3::X, DVec3::Y]]);
    let eye = Pencil::new(Origin::Point(DVec3::ONE), vec![Film::Scattered(vec![DVec3::ONE])]).expect("a ray");
    let (hits, _) = closest_hit(&mesh.geometry(), &eye, &Options::default()).expect("no hit");
    let ask = |light: Origin| {
        let refused = receivers(&mesh.geometry(), &eye, &hits, &[light]).is_err();
        assert_eq!(refused, shadowed(&mesh.geometry(), light, &[], &Options::default()).is_err());
        !refused
    };
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        assert!(!ask(Origin::Point(DVec3::new(0.0, bad, 0.0))));
        assert!(!ask(Origin::Infinity(DVec3::new(0.0, bad, 0.0))));
    }
    assert!(!ask(Origin::Infinity(DVec3::ZERO)) && !ask(Origin::Point(DVec3::splat(1e-300))));
    assert!(ask(umbel::shadow::point_light(DVec3::splat(1e-300))) && ask(umbel::shadow::sun_light(DVec3::Y)));
}
