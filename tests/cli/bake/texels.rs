//! Textures: where texels lie, margins, coverage, bits, pieces; and what is baked where nothing is named.

use common::command::Place;
use common::place;
use umbel::files::{Samples, read_exr};

use super::{CUBE, FLOOR, in_pieces};

/// A floor from (0, 0, −1) to (1, 0, 1) over the left half of the texture: u rises with x, v with −z. A wall of height 1
/// at x = 0, and a lower one at z = −1 behind the floor; neither has texels.
const ROOM: &str = "\
v 0 0 1
v 1 0 1
v 1 0 -1
v 0 0 -1
v 0 0 -999
v 0 0 999
v 0 1 999
v 0 1 -999
v 999 0 -1
v 999 0.25 -1
v 0 0.25 -1
vt 0 0
vt 0.5 0
vt 0.5 1
vt 0 1
f 1/1 2/2 3/3 4/4
f 5 6 7 8
f 4 9 10 11
";

fn place() -> Place {
    let place = place!();
    place.put("room.obj", ROOM);
    place.put("cube.obj", CUBE);
    place.put("floor.obj", FLOOR);
    place
}

/// What an infinite wall of height h at the distance x leaves open.
fn beside_wall(x: f64, h: f64) -> f64 {
    0.5 + 0.5 * x / x.hypot(h)
}

#[test]
fn texels_lie_where_the_file_says() {
    let place = place();
    place.quiet_run("bake room.obj --texels 32 --rays 1024 -q -o a.npy --coverage c.npy --bent b.npy");
    let (image, covered) = (place.npy("a.npy"), place.npy("c.npy").f32());
    assert_eq!(image.shape, [32, 32]);
    let values = image.f32();
    for (k, value) in values.iter().enumerate() {
        let (row, column) = (k / 32, k % 32);
        // Column 16 touches the floor's edge, and is covered too.
        assert_eq!(column <= 16, covered[k] == 1.0, "{row} {column}");
        assert_eq!(value.is_nan(), covered[k] == 0.0, "{row} {column}");
        if (20..32).contains(&row) && (1..16).contains(&column) {
            // Row 0 is v = 1, at z = −1; far from the low wall there is the high one only.
            let x = (column as f64 + 0.5) / 16.0;
            // What the low wall hides at most, as if it had no ends.
            let low = 1.0 - beside_wall((row as f64 + 0.5) / 16.0, 0.25);
            let expected = beside_wall(x, 1.0);
            let value = f64::from(*value);
            assert!(
                value < expected + 0.01 && value > expected - low - 0.01,
                "{row} {column}: {value} {expected}"
            );
        }
    }
    let mean =
        |rows: std::ops::Range<usize>| -> f32 { rows.map(|row| values[32 * row + 12]).sum::<f32>() / 4.0 };
    assert!(mean(0..4) < mean(28..32) - 0.1, "row 0 lies at the low wall");
    let bent = place.npy("b.npy");
    assert_eq!(bent.shape, [32, 32, 3]);
    for (k, v) in bent.f32().as_chunks::<3>().0.iter().enumerate() {
        let length = v.iter().map(|x| x * x).sum::<f32>().sqrt();
        assert!(if covered[k] == 1.0 { (length - 1.0).abs() < 1e-5 && v[1] > 0.5 } else { length.is_nan() });
    }
}

/// PNG and EXR hold the same values, extended by the margin; beyond it nothing.
#[test]
fn images_have_a_margin() {
    let place = place();
    let line = "bake room.obj --texels 32 -q";
    for output in
        ["a.npy", "a.exr --margin 3", "a8.png --margin 3", "a16.png --margin 3 --bits 16", "wide.exr"]
    {
        place.quiet_run(&format!("{line} -o {output}"));
    }
    let values = place.npy("a.npy").f32();
    let channel = |name: &str| {
        let (width, height, channels) = read_exr(&place.path(name)).expect("an image");
        assert_eq!((width, height, channels[0].name.as_str()), (32, 32, "openness"));
        let Samples::F32(values) = channels[0].samples.clone() else { panic!("floating point") };
        values
    };
    let (narrow, wide) = (channel("a.exr"), channel("wide.exr"));
    assert!(wide.iter().all(|value| !value.is_nan()), "16 texels reach the border");
    for (k, value) in narrow.iter().enumerate() {
        let (row, column) = (k / 32, k % 32);
        let source = match column {
            0..=16 => k,
            17..=19 => row * 32 + 16,
            _ => {
                assert!(value.is_nan(), "{row} {column}");
                continue;
            }
        };
        assert_eq!(*value, values[source], "{row} {column}");
    }
    for (name, greatest) in [("a8.png", 255.0), ("a16.png", 65_535.0_f32)] {
        let image = image::load_from_memory(&place.bytes(name)).expect("a picture");
        let levels = if name == "a8.png" {
            image.into_luma8().into_raw().into_iter().map(u16::from).collect()
        } else {
            image.into_luma16().into_raw()
        };
        let expected =
            narrow.iter().map(|&value| (if value.is_nan() { 1.0 } else { value } * greatest).round() as u16);
        assert!(levels.into_iter().eq(expected), "{name}");
    }
}

/// Bytes depend on neither threads nor the number of rows at once, whatever the directions are.
#[test]
fn rows_at_once_change_nothing() {
    let place = place();
    for set in ["shared", "interleaved", "independent"] {
        let line = format!("bake room.obj --texels 100 --texel-samples 4 --rays 8 --set {set} -q");
        place.quiet_run(&format!("{line} -o a.npy --bent ab.npy --threads 1"));
        in_pieces(&place, &format!("{line} -o b.npy --bent bb.npy --threads 3"));
        assert_eq!(place.bytes("a.npy"), place.bytes("b.npy"), "{set}");
        assert_eq!(place.bytes("ab.npy"), place.bytes("bb.npy"), "{set}");
        let bake = &place.json("r.json")["bake"];
        assert_eq!((&bake["of"], &bake["values"]), (&"texels".into(), &10_000.into()));
    }
}

/// More receivers per texel: texels on the border of two surfaces become means.
#[test]
fn samples_of_texels_are_averaged() {
    let place = place();
    let line = "bake room.obj --texels 8 --rays 512 -q -o a.npy";
    place.quiet_run(&format!("{line} --texel-samples 16"));
    let many = place.npy("a.npy").f32();
    // The texels at the high wall: the mean of the formula over their width, 1/4.
    let mean = (0..1000).map(|k| beside_wall((f64::from(k) + 0.5) / 4000.0, 1.0)).sum::<f64>() / 1000.0;
    let value = f64::from(many[8 * 6]);
    assert!(value < mean + 0.01 && value > mean - 0.05, "{value} {mean}");
}

#[test]
fn what_is_baked_by_default() {
    let place = place();
    place.quiet_run("bake cube.obj -o a.ply");
    assert!(String::from_utf8_lossy(&place.bytes("a.ply")).contains("element vertex 8"));
    place.quiet_run("bake room.obj -q --rays 2 -o a.png");
    assert_eq!(
        umbel::files::read_png_rgb8(&place.path("a.png")).map(|(w, h, _)| (w, h)).ok(),
        Some((1024, 1024))
    );
    let run = place.run("bake room.obj --texels 8 -o a.png");
    assert!(run.code == Some(0) && run.stderr.contains("warning: triangles without texture coordinates"));
}

/// A strip of squares, each with texture coordinates of its own.
fn squares(uvs: &[[[f32; 2]; 4]]) -> String {
    let mut text = String::new();
    for (k, uv) in uvs.iter().enumerate() {
        for ([x, z], [u, v]) in [[0, 0], [1, 0], [1, 1], [0, 1]].into_iter().zip(uv) {
            text += &format!("v {} 0 -{z}\nvt {u} {v}\n", 2 * k + x);
        }
        let first = 4 * k + 1;
        let corners: Vec<String> = (first..first + 4).map(|corner| format!("{corner}/{corner}")).collect();
        text += &format!("f {}\n", corners.join(" "));
    }
    text
}

/// The unit square, moved and scaled.
fn moved([u, v]: [f32; 2], scale: [f32; 2]) -> [[f32; 2]; 4] {
    [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| [u + scale[0] * x, v + scale[1] * y])
}

/// A texture in which most surfaces have no texels of their own is of no use, and is made on demand only.
#[test]
fn useless_textures_are_refused() {
    let place = place();
    let unit = moved([0.0; 2], [1.0; 2]);
    let refused = [
        ("tiled.obj", vec![moved([0.0; 2], [9.0; 2])]),
        ("stacked.obj", vec![unit; 3]),
        // More than half of it lies outside; no texel is shared.
        ("outside.obj", vec![moved([0.0; 2], [0.5, 0.25]), moved([2.0, 0.0], [0.5, 0.5])]),
    ];
    for (name, uvs) in refused {
        place.put(name, squares(&uvs));
        for quiet in ["", "-q"] {
            let run = place.run(&format!("bake {name} --texels 16 --rays 1 -o a.png {quiet}"));
            assert_eq!(run.code, Some(3), "{name}: {}", run.stderr);
            for part in [name, "--vertices", "--allow-overlap"] {
                assert!(run.stderr.contains(part), "{name}: {}", run.stderr);
            }
            assert!(!place.path("a.png").exists(), "{name}");
        }
        place.quiet_run(&format!("bake {name} --texels 16 --rays 1 -o b.npy -q --allow-overlap"));
    }
    let kept = [
        // Two halves mirrored onto each other, and a third that has its own.
        (
            "mirrored.obj",
            vec![moved([0.0; 2], [0.5, 1.0]), moved([0.5, 0.0], [-0.5, 1.0]), moved([0.5, 0.0], [0.5, 1.0])],
        ),
        ("halves.obj", vec![moved([0.0; 2], [0.5, 1.0]), moved([0.5, 0.0], [-0.5, 1.0])]),
    ];
    for (name, uvs) in kept {
        place.put(name, squares(&uvs));
        let run = place.run(&format!("bake {name} --texels 16 --rays 1 -o c.png"));
        assert!(
            run.code == Some(0) && run.stderr.contains("mirrored surfaces share"),
            "{name}: {}",
            run.stderr
        );
    }
    let run = place.run("bake room.obj --vertices --rays 1 -o v.npy --allow-overlap");
    assert!(run.code == Some(2) && run.stderr.contains("--allow-overlap"), "{}", run.stderr);
}
