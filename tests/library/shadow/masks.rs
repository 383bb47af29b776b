//! Masks through the command: polygons of shadows by formula, samples, misses, what turns away, pictures with lights.

use common::command::Place;
use common::place;
use umbel::files::read_png_rgb8;
use umbel::glam::DVec3;
use umbel::shadow::{point_light, shadow_masks, sun_light};
use umbel::{Camera, Lens, LoadOptions, Options, load};

use super::{BOX, FLOOR};

/// Looks down on the floor: at the right is +X, on top −Z, 32 x 16 world units, a pixel a quarter.
const ABOVE: &str = "--camera ortho --height 16 --eye 0,9,0 --target 0,0,0 --up 0,0,-1 --size 128x64";
/// The triangle of the floor's scene as (x, z).
const TRIANGLE: [[f64; 2]; 3] = [[-1.0, 1.0], [2.0, 0.0], [-1.0, -1.0]];

fn place() -> Place {
    let place = place!();
    place.put("floor.obj", FLOOR);
    place.put("box.obj", BOX);
    place
}

/// How far a point lies inside a triangle: the least of the edge functions, negative outside. Counter-clockwise or not.
fn inside(corners: [[f64; 2]; 3], [x, z]: [f64; 2]) -> f64 {
    let edge = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) * (z - a[1]) - (b[1] - a[1]) * (x - a[0]);
    let [a, b, c] = corners;
    let turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    [edge(a, b), edge(b, c), edge(c, a)].map(|e| e * turn.signum()).into_iter().fold(f64::INFINITY, f64::min)
}

/// The mask of the picture from above, with the polygon of the shadow on the floor. Pixels on its outline are left out.
fn expected(shadow: [[f64; 2]; 3]) -> Vec<Option<f32>> {
    let pixel = |k: usize| {
        let at = [(k % 128) as f64 * 0.25 - 15.875, (k / 128) as f64 * 0.25 - 7.875];
        let (on_triangle, in_shadow) = (inside(TRIANGLE, at), inside(shadow, at));
        if on_triangle.abs() < 1e-3 || in_shadow.abs() < 1e-3 {
            None
        } else if at[0].abs() > 10.0 {
            Some(f32::NAN)
        } else {
            Some(if on_triangle > 0.0 || in_shadow < 0.0 { 1.0 } else { 0.0 })
        }
    };
    (0..128 * 64).map(pixel).collect()
}

/// Compares a mask with the formula; the shadowed pixels.
fn compare(got: &[f32], expected: &[Option<f32>]) -> usize {
    assert_eq!(got.len(), expected.len());
    let mut dark = 0;
    for (k, (got, expected)) in got.iter().zip(expected).enumerate() {
        let Some(expected) = expected else { continue };
        assert!(got == expected || got.is_nan() && expected.is_nan(), "{k}: {got} for {expected}");
        dark += usize::from(*got == 0.0);
    }
    let known = expected.iter().filter(|value| value.is_some()).count();
    assert!(known * 20 > expected.len() * 19, "{known}");
    dark
}

#[test]
fn a_triangle_between_light_and_floor() {
    let place = place();
    for [x, y, z] in [[0.5, 4.0, 0.25], [-6.0, 3.0, 2.0], [0.0, 1e6, 0.0]] {
        place.quiet_run(&format!("shadow floor.obj --light {x},{y},{z} {ABOVE} --mask a.npy"));
        let mask = place.npy("a.npy");
        assert_eq!(mask.shape, [64, 128]);
        // From the light through a corner at y = 2 down to y = 0.
        let down = y / (y - 2.0);
        let shadow = TRIANGLE.map(|[a, b]| [x + (a - x) * down, z + (b - z) * down]);
        let dark = compare(&mask.f32(), &expected(shadow));
        assert!(dark > 1 || y > 1e5, "{dark}");
    }
    // Below the triangle the light reaches the whole floor, and the triangle's top is dark.
    place.quiet_run(&format!("shadow floor.obj --light 0,1,0 {ABOVE} --mask a.npy"));
    let mask = place.npy("a.npy").f32();
    let top =
        |k: usize| inside(TRIANGLE, [(k % 128) as f64 * 0.25 - 15.875, (k / 128) as f64 * 0.25 - 7.875]);
    for (k, value) in mask.iter().enumerate().filter(|&(k, value)| !value.is_nan() && top(k).abs() > 1e-3) {
        assert_eq!(*value, if top(k) > 0.0 { 0.0 } else { 1.0 }, "{k}");
    }
}

#[test]
fn a_triangle_between_sun_and_floor() {
    let place = place();
    for [x, y, z] in [[1.0, 1.0, 0.5], [-3.0, 1.0, 0.0], [0.0, 2.0, -1e-3], [0.0, 1e-12, 0.0]] {
        place.quiet_run(&format!("shadow floor.obj --sun {x},{y},{z} {ABOVE} --mask a.npy"));
        let shadow = TRIANGLE.map(|[a, b]| [a - 2.0 * x / y, b - 2.0 * z / y]);
        let dark = compare(&place.npy("a.npy").f32(), &expected(shadow));
        assert!(dark > 20 || x == 0.0, "{dark}");
    }
}

#[test]
fn what_turns_away_is_dark() {
    let place = place();
    let below = "--camera ortho --height 16 --eye 0,-9,0 --target 0,0,0 --up 0,0,-1 --size 16x8";
    for light in ["--light 0,5,0", "--sun 0,1,0", "--sun 1,1e-9,0", "--sun 1,0,0", "--light 3,0,0"] {
        place.quiet_run(&format!("shadow floor.obj {light} {below} --mask a.npy"));
        let mask = place.npy("a.npy").f32();
        assert!(mask.iter().all(|value| value.is_nan() || *value == 0.0), "{light}");
        assert_eq!(mask.iter().filter(|value| value.is_nan()).count(), 6 * 8 - 8 + 8, "{light}");
    }
}

/// Inside a box nothing is dark; outside everything is. The light may stand on a wall, in an edge, in a corner.
#[test]
fn lights_in_and_on_a_box() {
    let place = place();
    let camera = "--camera cube --cube-size 16 --eye 0.5,1.25,-1";
    for (light, lit) in [
        ("1,2,3", 1.0),
        ("-0.999,-1.999,-2.999", 1.0),
        ("9,2,3", 0.0),
        ("1e9,1e9,1e9", 0.0),
        ("4.0000005,2,3", 0.0),
    ] {
        place.quiet_run(&format!("shadow box.obj --light {light} {camera} --mask a.npy"));
        let mask = place.npy("a.npy");
        assert_eq!(mask.shape, [6, 16, 16]);
        assert!(mask.f32().iter().all(|&value| value == lit), "{light}");
    }
    // On a wall: that wall turns away, all others see the light. The order of the faces is +X −X +Y −Y +Z −Z.
    for (light, dark) in
        [("4,1,1", [true, false, false]), ("4,5,1", [true, true, false]), ("4,5,6", [true; 3])]
    {
        place.quiet_run(&format!("shadow box.obj --light {light} {camera} --mask a.npy"));
        place.quiet_run(&format!("render box.obj {camera} --aov id=id.npy"));
        for (value, id) in place.npy("a.npy").f32().into_iter().zip(place.npy("id.npy").u32()) {
            // Quads 0 to 5 are z = −3, z = 6, y = −2, y = 5, x = −1, x = 4.
            let on = match id / 2 {
                5 => dark[0],
                3 => dark[1],
                1 => dark[2],
                _ => false,
            };
            assert_eq!(value, if on { 0.0 } else { 1.0 }, "{light} {id}");
        }
    }
}

#[test]
fn samples_are_averaged_where_there_is_a_surface() {
    let place = place();
    let line = format!("shadow floor.obj --light 0.5,4,0.25 {ABOVE}");
    place.quiet_run(&format!("{line} --mask one.npy"));
    place.quiet_run(&format!("{line} --mask many.npy --samples 16"));
    let (one, many) = (place.npy("one.npy").f32(), place.npy("many.npy").f32());
    let between = many.iter().filter(|&&value| value > 0.0 && value < 1.0).count();
    assert!(between > 10, "{between} pixels on the outline");
    for (k, (one, many)) in one.iter().zip(&many).enumerate() {
        assert_eq!(one.is_nan(), many.is_nan(), "{k}: the floor's edge runs between pixels");
        assert!(many.is_nan() || (0.0..=1.0).contains(many) && (one - many).abs() < 1.0, "{k}: {one} {many}");
        assert!(many.is_nan() || (many * 16.0).fract() == 0.0);
    }
    let sums = [&one, &many].map(|mask| mask.iter().filter(|value| !value.is_nan()).sum::<f32>());
    assert!((sums[0] - sums[1]).abs() < 8.0, "{sums:?}");
}

/// The library's masks are the command's, to the last bit: NaN too is the same on every machine.
#[test]
fn the_library_makes_the_same_masks() {
    let place = place();
    let scene = load(place.path("floor.obj").to_str().expect("UTF-8"), LoadOptions::default()).expect("it");
    let camera = Camera {
        eye: DVec3::Y * 9.0,
        target: DVec3::ZERO,
        up: DVec3::NEG_Z,
        lens: Lens::Ortho { height: 16.0 },
        width: 128,
        height: 64,
    };
    let (one, other) = (DVec3::new(0.5, 4.0, 0.25), DVec3::new(1.0, 1.0, 0.5));
    let lights = [point_light(one), sun_light(other)];
    let masks = shadow_masks(&scene, &camera, &lights, 4, &Options::default()).expect("masks");
    for (mask, light) in masks.iter().zip(["--light 0.5,4,0.25", "--sun 1,1,0.5"]) {
        place.quiet_run(&format!("shadow floor.obj {light} {ABOVE} --samples 4 --mask a.npy"));
        let bytes: Vec<u8> = mask.iter().flat_map(|value| value.to_le_bytes()).collect();
        assert_eq!(bytes, place.npy("a.npy").data, "{light}");
        assert!(mask.iter().filter(|value| value.is_nan()).all(|value| value.to_bits() == 0x7FC0_0000));
    }
}

#[test]
fn paths_and_threads_agree() {
    let place = place();
    let scene = "shadow builtin:umbel:2000 --size 64x36 --samples 2 --mask";
    for light in ["--light=-1.5,7,3.5", "--light 0,1.5,0", "--sun=-1,2,1.5", "--sun 0,1,0"] {
        place.quiet_run(&format!("{scene} a.npy {light} --threads 1"));
        let mask = place.npy("a.npy").f32();
        assert!([0.0, 1.0].iter().all(|value| mask.contains(value)), "{light}");
        for more in ["--path general", "--threads 3", "--repeat 2", "--repeat 2 --keep-order"] {
            place.quiet_run(&format!("{scene} b.npy {light} {more}"));
            assert!(place.bytes("a.npy") == place.bytes("b.npy"), "{light} {more}");
        }
    }
}

#[test]
fn every_lens_has_a_mask() {
    let place = place();
    for (lens, size) in [("ortho", "--size 20x10"), ("equirect", "--size 20x10"), ("fisheye", "--size 20x10")]
    {
        let camera = format!("--camera {lens} {size} --eye 1,6,1 --target 0,0,0");
        place.quiet_run(&format!("shadow floor.obj --light 0,4,0 {camera} --mask a.npy"));
        place.quiet_run(&format!("render floor.obj {camera} --aov id=id.npy"));
        let (mask, ids) = (place.npy("a.npy"), place.npy("id.npy").u32());
        assert_eq!(mask.shape, [10, 20]);
        assert!(mask.f32().iter().zip(ids).all(|(value, id)| value.is_nan() == (id == u32::MAX)), "{lens}");
    }
}

#[test]
fn an_empty_scene_has_no_shadow() {
    let place = place!();
    place.put("empty.obj", "v 0 0 0\n");
    for light in ["--light 1,2,3", "--sun 1,2,3"] {
        let line = format!("shadow empty.obj {light} --size 4x2 --mask a.npy -o b.npy -q");
        place.quiet_run(&line);
        assert!(place.npy("a.npy").f32().iter().all(|value| value.is_nan()));
        assert!(place.npy("b.npy").f32().iter().all(|&value| value == f32::INFINITY));
    }
}

/// A preview with lights is brighter where they reach, whatever runs it.
#[test]
fn previews_have_shadows() {
    let place = place();
    let line = format!("render floor.obj {ABOVE} -o a.npy");
    for light in ["--light 0.5,4,0.25", "--sun 1,1,0.5"] {
        place.quiet_run(&format!("shadow floor.obj {light} {ABOVE} --mask m.npy"));
        place.quiet_run(&format!("{line} {light} --threads 1"));
        let bytes = place.bytes("a.npy");
        let (picture, mask) = (place.npy("a.npy").f32(), place.npy("m.npy").f32());
        let red = |value: f32| {
            let of = |(pixel, m): (&[f32], &f32)| (*m == value).then_some(pixel[0]);
            picture.chunks(3).zip(&mask).filter_map(of).collect::<Vec<f32>>()
        };
        let darkest = red(1.0).into_iter().fold(f32::INFINITY, f32::min);
        assert!(red(0.0).iter().all(|&dark| dark < darkest), "{light}");
        for more in ["--threads 3", "--path general"] {
            place.quiet_run(&format!("{line} {light} {more}"));
            assert!(bytes == place.bytes("a.npy"), "{light} {more}");
        }
    }
    // Several lights share the light of one, and their shadows add up.
    place.quiet_run(&format!("{line} --light 0.5,4,0.25 --light=-3,4,1 --sun 1,1,0 --samples 2"));
    assert!(place.npy("a.npy").f32().iter().all(|x| (0.0..=1.1).contains(x)));
    place.quiet_run("render builtin:cornell --light 278,540,279.5 --size 24x24 -o a.png");
    read_png_rgb8(&place.path("a.png")).expect("a picture");
}
