//! Errors against formulas.
//!
//! *An open plane* is all open: each value is 1 for any number of rays, and the error is 0. *Below a ceiling* that reaches
//! everywhere nothing is open, and the error is 0 as well.
//!
//! *A sphere on a plane.* A sphere of radius 1 touches the plane at the distance x from a receiver. Its middle is d = √(x² + 1)
//! away; it has the angular radius γ with sin γ = 1/d, and its middle the angle δ from the normal with cos δ = 1/d. So it stands
//! just above the horizon and covers sin²γ·cos δ of the sky, weighted with the cosine: openness is 1 − 1/d³.
//!
//! Based on: John Howell, "A Catalog of Radiation Configuration Factors", 1982.

use common::place;
use umbel::measure::Differences;

use super::FLOOR;

#[test]
fn differences_of_a_few_numbers_are_known() {
    let nan = f32::NAN;
    let found = Differences::between(&[0.0, 0.5, nan, nan], &[0.0, 0.0, nan, 1.0], 1);
    assert_eq!((found.items, found.differing, found.greatest), (3, 2, 1.0));
    assert!((found.rmse - (1.25_f64 / 3.0).sqrt()).abs() < 1e-15);
    assert!((found.share() - 2.0 / 3.0).abs() < 1e-15);
    // One pixel of three channels.
    let found = Differences::between(&[0.0, 0.0, 0.3], &[0.0, 0.0, 0.0], 3);
    assert_eq!((found.items, found.differing), (1, 1));
    assert!((found.rmse - f64::from(0.3_f32) / 3.0_f64.sqrt()).abs() < 1e-9);
    assert_eq!(Differences::between(&[], &[], 3), Differences::default());
}

#[test]
fn an_open_plane_has_no_error() {
    let place = place!();
    place.put("floor.obj", FLOOR);
    place.quiet_run("trade floor.obj --mode bake --rounds 1 --reference 64 --json t.json -q");
    for point in place.json("t.json")["points"].as_array().expect("points") {
        assert_eq!(point["rmse"], 0.0, "{point}");
        assert_eq!(point["differing"], 0, "{point}");
    }
}

/// Triangles of a sphere of radius 1 around (0, 1, 0), and a floor below it.
fn sphere_on_floor() -> String {
    let (rings, sectors) = (48_u32, 96_u32);
    let mut text = String::from("v -50 0 50\nv 50 0 50\nv 50 0 -50\nv -50 0 -50\nf 1 2 3 4\n");
    for i in 0..=rings {
        for j in 0..sectors {
            let (theta, phi) = (
                std::f64::consts::PI * f64::from(i) / f64::from(rings),
                std::f64::consts::TAU * f64::from(j) / f64::from(sectors),
            );
            let (x, y, z) = (theta.sin() * phi.cos(), 1.0 + theta.cos(), theta.sin() * phi.sin());
            text += &format!("v {x:.7} {y:.7} {z:.7}\n");
        }
    }
    let at = |i: u32, j: u32| 5 + i * sectors + j % sectors;
    for i in 0..rings {
        for j in 0..sectors {
            text += &format!("f {} {} {} {}\n", at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
        }
    }
    text
}

/// The errors that trade reports are those of the formula, up to that of its reference.
#[test]
fn errors_below_a_sphere_are_those_of_the_formula() {
    let place = place!();
    place.put("sphere.obj", sphere_on_floor());
    let distances: Vec<f64> = (0..120).map(|k| 0.4 + 0.02 * f64::from(k)).collect();
    let rows: Vec<f32> = (0..)
        .zip(&distances)
        .flat_map(|(k, &x)| {
            let (sin, cos) = (2.4 * f64::from(k)).sin_cos();
            [(x * cos) as f32, 0.0, (x * sin) as f32, 0.0, 1.0, 0.0]
        })
        .collect();
    umbel::files::write_npy(
        &place.path("points.npy"),
        &[distances.len(), 6],
        umbel::files::Array::F32(&rows),
    )
    .expect("written");
    let ids = vec![0_u32; distances.len()];
    umbel::files::write_npy(&place.path("ids.npy"), &[ids.len()], umbel::files::Array::U32(&ids))
        .expect("written");
    let points = "--points points.npy --point-ids ids.npy";
    place.quiet_run(&format!(
        "trade sphere.obj --mode bake --rounds 1 --reference 4096 --json t.json -q -- {points}"
    ));
    let report = place.json("t.json");
    for rays in [16, 64] {
        place.quiet_run(&format!("bake sphere.obj {points} -o open.npy --rays {rays} -q"));
        let found = place.npy("open.npy").f32();
        let formula = |x: f64| 1.0 - (1.0 / (x * x + 1.0)).powf(1.5);
        let squares =
            found.iter().zip(&distances).map(|(&value, &x)| (f64::from(value) - formula(x)).powi(2));
        let expected = (squares.sum::<f64>() / distances.len() as f64).sqrt();
        let all = report["points"].as_array().expect("points");
        let label = rays.to_string();
        let point = all.iter().find(|point| point["series"] == "shared" && point["label"] == label.as_str());
        let rmse = point.expect("the point")["rmse"].as_f64().expect("a number");
        // The reference has an error of about 0.001, the sphere is a polyhedron.
        assert!((rmse - expected).abs() < 0.004, "{rays} rays: {rmse} reported, {expected} by the formula");
    }
}
