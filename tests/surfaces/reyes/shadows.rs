//! Shadows of surfaces on demand: those of all micropolygons, made beforehand.

use umbel::engine::{
    Dicing, Isa, Receiver, Side, SurfaceHits, closest_hit_on_demand, dice_all, shadowed, shadowed_on_demand,
};
use umbel::glam::DVec3;
use umbel::{NO_TRIANGLE, Options, Origin, Path, Pencil, TriangleId, Triangles};

use super::surfaces::{Field, Plane, Surfaces};
use super::{camera, of_spheres, sphere, sun};

const DICING: Dicing = Dicing { shading_rate: 0.8, keep_corners: true };

/// The points that are seen, as they are left towards the eye, and whether their triangles turn to a light.
fn receivers(pencil: &Pencil, seen: &SurfaceHits, light: Origin) -> Vec<(Receiver, bool)> {
    let indices: Vec<[u32; 3]> = (0..seen.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let triangles = Triangles::new(seen.corners().as_flattened(), &indices).expect("triangles");
    let hit = (0..seen.len()).filter(|&ray| seen.ids()[ray] != NO_TRIANGLE);
    hit.map(|k| {
        let (id, ray) = (TriangleId(k as u32), pencil.ray(k));
        let side: Side = triangles.side_toward(id, -ray.direction).expect("a side");
        let lit = match light {
            Origin::Point(point) => triangles.side_of(id, point),
            Origin::Infinity(direction) => triangles.side_toward(id, -direction),
        };
        let point = triangles.leave(id, triangles.barycentrics(id, &ray), side);
        (Receiver { point, triangle: TriangleId(NO_TRIANGLE) }, lit == Some(side))
    })
    .collect()
}

/// The answer for all points that turn to the light, checked against all micropolygons, instruction sets and threads.
fn checked(surfaces: &Surfaces, view: &Pencil, light: Origin, what: &str) -> (usize, Vec<bool>) {
    checked_at(0.8, surfaces, view, light, what)
}

fn checked_at(
    shading_rate: f64,
    surfaces: &Surfaces,
    view: &Pencil,
    light: Origin,
    what: &str,
) -> (usize, Vec<bool>) {
    let dicing = Dicing { shading_rate, ..DICING };
    let (seen, _) = closest_hit_on_demand(surfaces, view, &dicing, &Options::default()).expect("an answer");
    let turned = receivers(view, &seen, light);
    let points: Vec<Receiver> =
        turned.iter().filter(|(_, lit)| *lit).map(|(receiver, _)| *receiver).collect();
    let ask = |options: &Options| shadowed_on_demand(surfaces, (view, &dicing), light, &points, options);
    let (found, stats) = ask(&Options::default()).expect("an answer");
    println!("{what}: {} of {} in shadow, {stats:?}", found.iter().filter(|&&s| s).count(), found.len());
    let diced = dice_all(surfaces, view, &dicing).expect("triangles");
    let triangles = Triangles::new(diced.positions(), diced.indices()).expect("triangles");
    let (expected, _) = shadowed(&triangles, light, &points, &Options::default()).expect("an answer");
    assert!(found == expected, "{what}: not that of all triangles");
    assert!(
        ask(&Options { path: Path::General, ..Options::default() }).expect("an answer").0 == found,
        "{what}"
    );
    for isa in [Isa::Sse2, Isa::Sse42, Isa::Avx2, Isa::Avx512, Isa::Neon] {
        if let Ok((got, _)) = ask(&Options { isa, ..Options::default() }) {
            assert!(got == found, "{what}: {isa:?}");
        }
    }
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let (got, stats) = pool.install(|| ask(&Options::default())).expect("an answer");
        assert!(got == found, "{what}: {threads} threads");
        assert!(stats.engine_bytes < (threads as u64) * (4 << 20), "{what}: {} bytes", stats.engine_bytes);
    }
    (turned.len(), found)
}

fn lights() -> [Origin; 5] {
    [
        Origin::Point(DVec3::new(0.5, 4.0, 1.0)),
        // Among the surfaces, and within one.
        Origin::Point(DVec3::new(1.25, 0.75, 1.5)),
        Origin::Point(DVec3::new(0.125, 0.25, -0.125)),
        Origin::Infinity(DVec3::new(0.2, -1.0, -0.5)),
        Origin::Infinity(DVec3::new(-1.0, -0.0625, 0.0)),
    ]
}

#[test]
fn of_a_bumpy_sphere_on_a_plane() {
    let mut scene = of_spheres(&[sphere(0.3, 5.0)]);
    scene.planes.push(Plane { corner: [-3.0, -1.0, 3.0], sides: [[6.0, 0.0, 0.0], [0.0, 0.5, -6.0]], id: 2 });
    let view = camera([3.0, 2.0, 4.0], [-3.0, -2.0, -4.0], 1.2, [150, 110]);
    let mut some = [false; 2];
    for light in lights() {
        let (_, found) = checked(&scene, &view, light, &format!("{light:?}"));
        some = [some[0] || found.contains(&false), some[1] || found.contains(&true)];
    }
    assert_eq!(some, [true; 2]);
    let view = sun([0.0, 5.0, 0.0], 4.0, 90);
    checked(&scene, &view, lights()[0], "seen by parallel rays");
}

/// Many batches of triangles, of all sizes.
#[test]
fn of_many_micropolygons() {
    let scene = of_spheres(&[sphere(0.3, 5.0), sphere(0.1, 9.0)]);
    let view = camera([3.0, 2.0, 4.0], [-3.0, -2.0, -4.0], 1.2, [90, 70]);
    for light in [lights()[0], lights()[3], lights()[4]] {
        let (_, found) = checked_at(0.15, &scene, &view, light, &format!("fine, {light:?}"));
        assert!(found.contains(&true));
    }
}

/// What turns to the light on a sphere is lit: there is no acne, however coarse the micropolygons.
#[test]
fn convex_surfaces_are_lit() {
    let view = camera([3.0, 2.0, 4.0], [-3.0, -2.0, -4.0], 2.0, [140, 110]);
    for light in [lights()[0], lights()[3]] {
        let (all, found) = checked(&of_spheres(&[sphere(0.0, 1.0)]), &view, light, "a sphere");
        assert!(all > 2000 && found.len() > all / 3, "{} of {all}", found.len());
        let dark = found.iter().filter(|&&shadowed| shadowed).count();
        assert_eq!(dark, 0, "of {}", found.len());
    }
}

#[test]
fn of_a_field() {
    let field = Field { corner: [-50.0, 0.0, -100.0], size: 100.0, levels: 6, id: 9 };
    let ground = Plane { corner: [-50.0, -1.0, 0.0], sides: [[100.0, 0.0, 0.0], [0.0, 0.0, -100.0]], id: 3 };
    let scene = Surfaces { fields: vec![field], planes: vec![ground], ..Surfaces::default() };
    let view = camera([0.0, 2.0, 0.0], [0.1, -0.3, -1.0], 1.0, [160, 100]);
    for light in [Origin::Infinity(DVec3::new(0.5, -1.0, 0.1)), Origin::Point(DVec3::new(0.0, 8.0, -20.0))] {
        let (_, found) = checked(&scene, &view, light, &format!("{light:?}"));
        assert!(found.contains(&true) && found.contains(&false));
    }
}

#[test]
fn nothing_and_refusals() {
    let scene = of_spheres(&[sphere(0.0, 1.0)]);
    let view = camera([3.0, 2.0, 4.0], [-3.0, -2.0, -4.0], 2.0, [20, 16]);
    let options = Options::default();
    let (found, _) =
        shadowed_on_demand(&scene, (&view, &DICING), lights()[0], &[], &options).expect("nothing");
    assert!(found.is_empty());
    let receiver = |x: f32| Receiver { point: [x, 0.0, 5.0], triangle: TriangleId(7) };
    let points: Vec<Receiver> = [0.0, 1.0].into_iter().map(receiver).collect();
    let empty = Surfaces::default();
    let (found, _) =
        shadowed_on_demand(&empty, (&view, &DICING), lights()[0], &points, &options).expect("lit");
    assert_eq!(found, [false; 2]);
    let ask = |light, points: &[Receiver], dicing| {
        shadowed_on_demand(&scene, (&view, &dicing), light, points, &options)
            .expect_err("refused")
            .to_string()
    };
    assert!(ask(lights()[0], &[receiver(f32::NAN)], DICING).contains("NaN"));
    assert!(ask(Origin::Infinity(DVec3::ZERO), &points, DICING).contains("direction"));
    assert!(ask(lights()[0], &points, Dicing { shading_rate: 0.0, ..DICING }).contains("shading rate"));
}
