//! Masks against exact integers: is the light on the seen side of the plane, and does anything block the way?

use umbel::glam::DVec3;
use umbel::{Film, Frame, Options, Origin, Path, Pencil, SeenReceiver, Side, closest_hit, lit, receivers};

use crate::generators::{self, KINDS, Kind, Mesh, Random, widen};
use crate::oracle::{self, OracleRay, Ties};
use crate::sides;

/// What the design says of a receiver.
fn expected(mesh: &Mesh, light: Origin, receiver: &SeenReceiver) -> bool {
    let corners = |id: usize| mesh.corners(id);
    let own = corners(receiver.id.0 as usize);
    let seen = if receiver.side == Side::Front { 1 } else { -1 };
    let point = widen(receiver.point);
    match light {
        Origin::Point(l) => {
            let all = (0..mesh.triangles.len()).map(corners);
            sides::side(own, l) == seen && !sides::segment_blocked(all, None, [l, point])
        }
        Origin::Infinity(d) => {
            let ray = OracleRay {
                origin: point.to_array(),
                direction: (-d).to_array(),
                t_min: 0.0,
                t_max: f64::INFINITY,
                ties: Ties::Origin,
            };
            sides::facing(own, -d) == seen && !oracle::any(&mesh.positions, &mesh.triangles, &ray)
        }
    }
}

/// What a camera somewhere sees of a scene: scattered rays, some of which aim at vertices and edges.
fn seen(random: &mut Random, kind: Kind, mesh: &Mesh) -> Vec<SeenReceiver> {
    let eye = generators::eye(random, kind, mesh);
    let directions = (0..40).map(|_| generators::direction(random, kind, mesh, eye)).collect();
    let pencil = Pencil::new(Origin::Point(eye), vec![Film::Scattered(directions)]).expect("rays");
    let (hits, _) = closest_hit(&mesh.geometry(), &pencil, &Options::default()).expect("hits");
    let seen = receivers(&mesh.geometry(), &pencil, &hits);
    assert_eq!(seen.len(), hits.ids().iter().filter(|&&id| id != umbel::NO_TRIANGLE).count());
    for receiver in &seen {
        let corners = mesh.corners(receiver.id.0 as usize);
        let side = if receiver.side == Side::Front { 1 } else { -1 };
        assert_eq!(sides::side(corners, eye), side, "the eye's side");
        assert_ne!(sides::side(corners, widen(receiver.point)), -side, "on the plane or on that side");
    }
    seen
}

/// Compares with the oracle; lit and shadowed ones.
fn compare(mesh: &Mesh, light: Origin, seen: &[SeenReceiver]) -> [usize; 2] {
    let mut counts = [0; 2];
    for path in [Path::Pencil, Path::General] {
        let options = Options { path, ..Options::default() };
        let (answers, _) = lit(&mesh.geometry(), light, seen, &mut Frame::new(), &options).expect("answers");
        assert_eq!(answers.len(), seen.len());
        for (receiver, answer) in seen.iter().zip(answers) {
            assert_eq!(answer, expected(mesh, light, receiver), "{light:?} {receiver:?}\n{mesh:?}");
            counts[usize::from(answer)] += 1;
        }
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
        let seen = receivers(&mesh.geometry(), &pencil, &hits);
        let answer = lit(&mesh.geometry(), Origin::Point(eye), &seen, &mut Frame::new(), &Options::default());
        total += seen.len();
        dark += answer.expect("answers").0.iter().filter(|&&lit| !lit).count();
    }
    assert!(total > 5000 && dark * 1000 < total, "{dark} of {total}");
}

#[test]
fn lights_out_of_range_are_refused() {
    let mesh = Mesh::of([[DVec3::ZERO, DVec3::X, DVec3::Y]]);
    let ask =
        |light: Origin| lit(&mesh.geometry(), light, &[], &mut Frame::new(), &Options::default()).is_ok();
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        assert!(!ask(Origin::Point(DVec3::new(0.0, bad, 0.0))));
        assert!(!ask(Origin::Infinity(DVec3::new(0.0, bad, 0.0))));
    }
    assert!(!ask(Origin::Infinity(DVec3::ZERO)) && !ask(Origin::Point(DVec3::splat(1e-300))));
    assert!(ask(umbel::point_light(DVec3::splat(1e-300))) && ask(umbel::sun_light(DVec3::Y)));
}
