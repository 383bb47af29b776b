//! Bézier patches: the teapot, files, degenerate patches.

use common::place;
use umbel::Error;
use umbel::engine::{Detail, Domain, OnDemand};
use umbel::formats::{SurfaceOptions, load_surfaces, read_bpt};
use umbel::glam::DVec3;
use umbel::surfaces::{BezierPatches, Surfaces};

use super::{patches, points};

pub(crate) fn teapot() -> BezierPatches {
    match load_surfaces("builtin:teapot", SurfaceOptions::default()).expect("a teapot").surfaces {
        Surfaces::Patches(teapot) => teapot,
        other => panic!("{other:?}"),
    }
}

/// de Casteljau's construction, which the patches do not use.
fn de_casteljau(control: &[[f32; 3]; 16], [u, v]: [f64; 2]) -> [f64; 3] {
    let cubic = |mut p: [f64; 4], t: f64| {
        for end in (1..4).rev() {
            (0..end).for_each(|k| p[k] += (p[k + 1] - p[k]) * t);
        }
        p[0]
    };
    [0, 1, 2].map(|axis| {
        let row = |j: usize| cubic([0, 1, 2, 3].map(|i| f64::from(control[4 * j + i][axis])), u);
        cubic([row(0), row(1), row(2), row(3)], v)
    })
}

#[test]
fn the_teapot_has_newells_patches() {
    let teapot = teapot();
    assert_eq!(teapot.patches().len(), 32);
    let all = Surfaces::Patches(teapot.clone()).all_bounds();
    // Handle, spout, and the knob of the lid at a height of 3.15.
    assert!(
        (all.lo[0], all.hi[0]) >= (-3.01, 3.5) && all.lo[1].abs() < 1e-6 && (all.hi[1] - 3.15).abs() < 1e-5,
        "{all:?}"
    );
    for patch in patches(&teapot) {
        let control = &teapot.patches()[teapot.id(&patch) as usize];
        for k in 0..=64 {
            let place = [f64::from(k % 8) / 7.0, f64::from(k / 8) / 8.0];
            let (got, expected) = (points(&teapot, &patch, &[place])[0], de_casteljau(control, place));
            assert!(
                (0..3).all(|axis| (f64::from(got[axis]) - expected[axis]).abs() < 1e-6),
                "{got:?} {expected:?}"
            );
        }
    }
}

/// The volume below the triangles of a grid over each patch is positive for all parts of the pot: normals face outwards.
#[test]
fn the_teapot_faces_outwards() {
    let teapot = teapot();
    let mut volume = 0.0;
    for patch in patches(&teapot) {
        let n = 8;
        let at = |i: i32, j: i32| {
            let place = [f64::from(i) / f64::from(n), f64::from(j) / f64::from(n)];
            DVec3::from_array(points(&teapot, &patch, &[place])[0].map(f64::from))
        };
        for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            volume += (a.dot(b.cross(c)) + a.dot(c.cross(d))) / 6.0;
        }
    }
    // Pot, handle and spout overlap a little; the pot alone holds about 28 cubic units.
    assert!((25.0..40.0).contains(&volume), "{volume}");
}

#[test]
fn collapsed_patches_are_points_within_their_bounds() {
    let flat = BezierPatches::new(vec![[[1.0, 2.0, 3.0]; 16]]);
    let patch = patches(&flat)[0];
    let bounds = flat.bounds(&patch, Domain { u: [0.25, 0.5], v: [0.0, 0.125] }, &Detail::all());
    assert!((0..3).all(|k| bounds.hi[k] - bounds.lo[k] < 1e-5));
    assert_eq!(points(&flat, &patch, &[[0.3, 0.1], [1.0, 1.0]]), [[1.0, 2.0, 3.0]; 2]);
}

/// One flat patch as text.
fn text(count: &str, degrees: &str, lines: usize) -> String {
    let point = |k: usize| format!("{} {} 0\n", k % 4, k / 4);
    format!("{count}\n{degrees}\n") + &(0..lines).map(point).collect::<String>()
}

#[test]
fn files_are_read() {
    let place = place!();
    let two = text("2 # patches", "3 3", 16) + "\n3 3\n" + &text("", "", 16);
    place.put("two.bpt", two);
    assert_eq!(read_bpt(&place.path("two.bpt")).expect("patches").patches().len(), 2);
    place.put("none.bpt", "0\n");
    assert!(read_bpt(&place.path("none.bpt")).expect("none").patches().is_empty());
}

#[test]
fn bad_files_are_refused_with_their_line() {
    let place = place!();
    for (name, content, line, word) in [
        ("empty", String::new(), 1, "number of patches"),
        ("count", text("many", "3 3", 16), 1, "`many`"),
        ("half", text("1.5", "3 3", 16), 1, "1.5"),
        ("quadratic", text("1", "2 3", 16), 2, "bicubic"),
        ("short", text("1", "3 3", 15), 17, "the file ends"),
        ("long", text("1", "3 3", 17), 19, "more after"),
        ("nan", text("1", "3 3", 15) + "0 nan 0\n", 18, "nan"),
        ("two", text("1", "3 3", 15) + "0 1\n", 18, "three coordinates"),
    ] {
        place.put(name, content);
        match read_bpt(&place.path(name)).map(|_| ()) {
            Err(Error::Input { line: Some(at), problem, remedy, .. }) => {
                assert!(
                    at == line && problem.contains(word) && !remedy.is_empty(),
                    "{name}: {at}: {problem}"
                );
            }
            other => panic!("{name}: {other:?}"),
        }
    }
    assert!(matches!(read_bpt(&place.path("absent")), Err(Error::Input { line: None, .. })));
}
