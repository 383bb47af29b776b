//! Files of the command: NPY, PLY, the report; gray images.

use common::command::Place;
use common::place;
use umbel::files::{GrayBits, write_png_gray};

use super::{CUBE, FLOOR};

fn place() -> Place {
    let place = place!();
    place.put("floor.obj", FLOOR);
    place.put("cube.obj", CUBE);
    place
}

#[test]
fn arrays_have_their_types_and_shapes() {
    let place = place();
    place.quiet_run("bake cube.obj --vertices -o a.npy --bent b.npy --dump-rays d.npy --rays 16");
    for (name, shape) in [("a.npy", vec![8]), ("b.npy", vec![8, 3])] {
        let array = place.npy(name);
        assert_eq!((array.dtype.as_str(), array.shape), ("<f4", shape), "{name}");
    }
    let rays = place.npy("d.npy");
    assert!(rays.dtype == "<f4" && rays.shape[1] == 8 && rays.shape[0] > 100, "{:?}", rays.shape);
    assert_eq!(place.names(), ["a.npy", "b.npy", "cube.obj", "d.npy", "floor.obj"]);
    place.quiet_run("bake cube.obj --vertices --bent only.npy");
    assert!(place.names().contains(&"only.npy".to_owned()));
}

#[test]
fn a_mesh_with_values() {
    let place = place();
    place.put("loose.obj", format!("{FLOOR}v 7 7 7\n"));
    place.quiet_run("bake loose.obj --vertices --occluders cube.obj -o a.ply");
    place.quiet_run("bake loose.obj --vertices --occluders cube.obj -o a.npy");
    let (bytes, values) = (place.bytes("a.ply"), place.npy("a.npy").f32());
    let end = b"end_header\n";
    let at = bytes.windows(end.len()).position(|window| window == end).expect("a header") + end.len();
    let header = std::str::from_utf8(&bytes[..at]).expect("a text");
    for line in ["element vertex 6", "property float openness", "property uchar red", "element face 4"] {
        assert!(header.contains(&format!("\n{line}\n")), "{line}\n{header}");
    }
    let body = &bytes[at..];
    assert_eq!(body.len(), 6 * 19 + 4 * 13);
    assert!(values[4] < 0.99, "the cube stands on the floor");
    for (vertex, value) in body.chunks(19).zip(&values) {
        let stored = f32::from_le_bytes([vertex[12], vertex[13], vertex[14], vertex[15]]);
        assert_eq!(stored.to_bits(), value.to_bits());
        let gray = if value.is_nan() { 255 } else { (value * 255.0).round() as u8 };
        assert_eq!(vertex[16..], [gray; 3]);
    }
    assert_eq!(body[6 * 19..][..13], [3, 0, 0, 0, 0, 1, 0, 0, 0, 4, 0, 0, 0]);
    place.quiet_run("bake loose.obj --vertices -o b.ply --polarity occlusion");
    assert!(String::from_utf8_lossy(&place.bytes("b.ply")).contains("property float occlusion\n"));
}

#[test]
fn a_report_has_its_fields() {
    let place = place();
    let line =
        "bake builtin:cornell --vertices --max-distance 10% -o a.npy --bent b.npy --repeat 3 --report r.json";
    place.quiet_run(line);
    let report = place.json("r.json");
    assert_eq!(report["command"], "bake");
    assert_eq!(report["ms"]["engine"].as_array().expect("a list").len(), 3);
    assert!(report["ms"]["receivers"].as_f64().expect("milliseconds") > 0.0);
    let bake = &report["bake"];
    assert_eq!((&bake["of"], &bake["set"]), (&"vertices".into(), &"shared".into()));
    assert_eq!((&bake["values"], &bake["receivers"]), (&40.into(), &40.into()));
    let diagonal = 556.0_f64.hypot(548.8).hypot(559.2);
    let distance = bake["max_distance"].as_f64().expect("a number");
    assert!((distance - diagonal / 10.0).abs() < 1e-3, "{distance}");
    let rays = report["rays"].as_u64().expect("a number");
    assert!((40 * 60..40 * 68).contains(&rays), "{rays}");
    let mut hash = blake3::Hasher::new();
    hash.update(&place.npy("a.npy").data);
    hash.update(&place.npy("b.npy").data);
    assert_eq!(report["hash"], hash.finalize().to_hex().as_str());
    let run = place.run("bake builtin:cornell --vertices -o a.npy -v");
    assert!(run.stderr.contains("about ") && run.stderr.contains("40 receivers"), "{}", run.stderr);
    let run = place.run("info builtin:cornell --json");
    let info: serde_json::Value = serde_json::from_str(&run.stdout).expect("JSON");
    assert!(info["memory"]["bake_vertices"].as_u64().expect("bytes") > 1000);
}

#[test]
fn gray_images_are_linear() {
    let place = place();
    let values = [0.0, 0.5, 1.0, f32::NAN, -3.0, 9.0];
    for (bits, expected) in [
        (GrayBits::Eight, [0_u16, 128, 255, 255, 0, 255]),
        (GrayBits::Sixteen, [0, 32_768, 65_535, 65_535, 0, 65_535]),
    ] {
        write_png_gray(&place.path("a.png"), 3, 2, &values, bits).expect("written");
        let bytes = place.bytes("a.png");
        // Bits per sample and the type, gray, stand behind the extents.
        assert_eq!(bytes[24..26], [if bits == GrayBits::Eight { 8 } else { 16 }, 0]);
        let image = image::load_from_memory(&bytes).expect("a picture").into_luma16();
        let wide = |level: u16| if bits == GrayBits::Eight { level * 257 } else { level };
        assert!(image.into_raw().into_iter().eq(expected.map(wide)), "{bits:?}");
    }
    let error = write_png_gray(&place.path("b.png"), 4, 2, &values, GrayBits::Eight).expect_err("too few");
    assert!(matches!(error, umbel::Error::Write { .. }));
}
