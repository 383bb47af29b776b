//! The files of `shadow`: NPY, EXR, KTX2 and PNG hold the same numbers; several lights; the report; the table.

use common::command::Place;
use common::place;
use common::scenes::cube_direction;
use ktx2::{ColorModel, Format, Reader, TransferFunction};
use umbel::files::{Samples, read_exr, read_png_rgb8, write_ktx2_cube};

use super::{BOX, FLOOR};

const LIGHT: &str = "--light 0.5,1.25,-1";
const CAMERA: &str = "--size 20x10 --eye 2,6,9 --target 0,1,0";

fn place() -> Place {
    let place = place!();
    place.put("floor.obj", FLOOR);
    place.put("box.obj", BOX);
    place
}

/// Little-endian numbers.
fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

#[test]
fn formats_hold_the_same_numbers() {
    let place = place();
    for format in ["npy", "exr", "ktx2"] {
        place.quiet_run(&format!("shadow floor.obj {LIGHT} --cube-size 6 -o a.{format}"));
    }
    let expected = place.npy("a.npy").f32();
    assert!(expected.contains(&f32::INFINITY) && expected.iter().any(|t| t.is_finite()));
    let (width, height, channels) = read_exr(&place.path("a.exr")).expect("an image");
    assert_eq!((width, height, channels.len()), (6, 36, 1));
    assert_eq!(channels[0].name, "distance");
    assert_eq!(channels[0].samples, Samples::F32(expected.clone()));
    let bytes = place.bytes("a.ktx2");
    let reader = Reader::new(&bytes).expect("a KTX2 file");
    assert_eq!(floats(reader.levels().next().expect("a level").data), expected);
}

#[test]
fn a_ktx2_file_says_what_it_is() {
    let place = place!();
    for size in [1_u32, 3, 16] {
        let values: Vec<f32> = (0..6 * size * size).map(|k| 1.0 / k as f32).collect();
        write_ktx2_cube(&place.path("a.ktx2"), size, &values).expect("written");
        let bytes = place.bytes("a.ktx2");
        let reader = Reader::new(&bytes).expect("a KTX2 file");
        let header = reader.header();
        assert_eq!(header.format, Some(Format::R32_SFLOAT));
        assert_eq!((header.type_size, header.face_count, header.level_count), (4, 6, 1));
        assert_eq!((header.pixel_width, header.pixel_height), (size, size));
        assert_eq!((header.pixel_depth, header.layer_count), (0, 0));
        assert!(header.supercompression_scheme.is_none());
        assert_eq!(reader.color_model(), Some(ColorModel::RGBSDA));
        assert_eq!(reader.transfer_function(), Some(TransferFunction::Linear));
        assert_eq!(reader.is_alpha_premultiplied(), Some(false));
        // The descriptor is the one that the format's own rules make.
        let basic = reader.basic_dfd().expect("a descriptor");
        let (expected, type_size) = ktx2::dfd::Basic::from_format(Format::R32_SFLOAT).expect("a format");
        assert_eq!((basic, header.type_size), (&expected, type_size));
        let keys: Vec<(&str, &[u8])> = reader.key_value_data().collect();
        let writer = format!("umbel {}\0", env!("CARGO_PKG_VERSION"));
        assert_eq!(keys, [("KTXorientation", &b"rd\0"[..]), ("KTXwriter", writer.as_bytes())]);
        let levels: Vec<_> = reader.levels().collect();
        assert_eq!((levels.len(), floats(levels[0].data)), (1, values));
        // The texels are the rest of the file, at a multiple of 4.
        let start = bytes.len() - levels[0].data.len();
        assert!(start.is_multiple_of(4) && bytes[start..] == *levels[0].data);
    }
    for (size, count) in [(0, 0), (2, 23), (2, 25)] {
        let error = write_ktx2_cube(&place.path("b.ktx2"), size, &vec![0.0; count]).expect_err("refused");
        assert!(error.to_string().contains(&count.to_string()), "{error}");
    }
    assert_eq!(place.names(), ["a.ktx2"]);
}

#[test]
fn a_cross_of_faces_for_looking() {
    let place = place();
    place.quiet_run(&format!("shadow box.obj {LIGHT} --cube-size 5 -o a.png"));
    place.quiet_run(&format!("shadow box.obj {LIGHT} --cube-size 5 -o a.npy"));
    let (width, height, pixels) = read_png_rgb8(&place.path("a.png")).expect("a picture");
    assert_eq!((width, height), (20, 15));
    let distances = place.npy("a.npy").f32();
    let greatest = distances.iter().copied().fold(0.0, f32::max);
    // Columns and lines of the faces +X −X +Y −Y +Z −Z.
    let cells = [(2, 1), (0, 1), (1, 0), (1, 2), (1, 1), (3, 1)];
    for (k, distance) in distances.iter().enumerate() {
        let (face, i, j) = (k / 25, k % 5, k / 5 % 5);
        let (x, y) = (cells[face].0 * 5 + i, cells[face].1 * 5 + j);
        let code = (distance / greatest * 255.0).round() as u8;
        assert_eq!(pixels[3 * (y * 20 + x)..][..3], [code; 3], "{k}");
    }
    // Neighbours on the cross are neighbours in space, across the edges of faces too.
    let mut cross = [[None; 20]; 15];
    for k in 0..150 {
        let (face, i, j) = (k / 25, k % 5, k / 5 % 5);
        cross[cells[face].1 * 5 + j][cells[face].0 * 5 + i] = Some(cube_direction(5, k).normalize());
    }
    let (mut pairs, across) = (0, [(0, 1), (1, 0)]);
    for (y, x, (down, right)) in (0..14).flat_map(|y| (0..19).flat_map(move |x| across.map(|a| (y, x, a)))) {
        if let (Some(one), Some(other)) = (cross[y][x], cross[y + down][x + right]) {
            assert!(one.distance(other) < 0.45, "{x} {y}: {one} {other}");
            pairs += 1;
        }
    }
    // 6 · 2 · 20 within faces, 5 on each of the 5 inner edges; the last line and the last column are left out.
    assert_eq!(pairs, 240 + 25 - 4 - 4);
}

#[test]
fn a_mask_for_looking() {
    let place = place();
    let line = format!("shadow floor.obj --light 0,4,0 {CAMERA} --samples 4 --mask");
    place.quiet_run(&format!("{line} a.png"));
    place.quiet_run(&format!("{line} a.npy"));
    let (width, height, pixels) = read_png_rgb8(&place.path("a.png")).expect("a picture");
    assert_eq!((width, height), (20, 10));
    for (pixel, value) in pixels.chunks(3).zip(place.npy("a.npy").f32()) {
        let code = if value.is_nan() { 255 } else { (value * 255.0).round() as u8 };
        assert_eq!(pixel, [code; 3]);
    }
}

#[test]
fn several_lights() {
    let place = place();
    let lights = "--light 0.5,1.25,-1 --light 3,4,5 --light=-9,1,1";
    let files = "--cube-size 4 -o c.npy --mask m.npy";
    place.quiet_run(&format!("shadow box.obj {lights} {CAMERA} {files}"));
    let each = "--cube-size 4 -o c{light}.npy --mask m{light}.npy";
    place.quiet_run(&format!("shadow box.obj {lights} {CAMERA} {each}"));
    for (name, shape) in [("c", vec![6, 4, 4]), ("m", vec![10, 20])] {
        let all = place.npy(&format!("{name}.npy"));
        assert_eq!(all.shape, [vec![3], shape.clone()].concat());
        let parts: Vec<u8> = (0..3).flat_map(|k| place.npy(&format!("{name}{k}.npy")).data).collect();
        assert_eq!(all.data, parts);
        assert_eq!(place.npy(&format!("{name}1.npy")).shape, shape);
    }
    place.quiet_run("shadow box.obj --light 3,4,5 --cube-size 4 -o alone.npy");
    assert_eq!(place.bytes("alone.npy"), place.bytes("c1.npy"));
    for format in ["exr", "ktx2", "png"] {
        place.quiet_run(&format!("shadow box.obj {lights} --cube-size 4 -o x-{{light}}.{format}"));
        assert!((0..3).all(|k| !place.bytes(&format!("x-{k}.{format}")).is_empty()));
    }
}

#[test]
fn the_map_of_a_sun_and_its_film() {
    let place = place();
    for (sun, up) in [("1,2,0.5", [0.0, 1.0, 0.0]), ("0,3,0", [0.0, 0.0, 1.0]), ("0,0,-1", [0.0, 1.0, 0.0])] {
        place.quiet_run(&format!("shadow floor.obj --sun {sun} --map-size 33 -o a.npy --report r.json"));
        let (map, film) = (place.npy("a.npy"), place.json("r.json")["map"]["films"][0].clone());
        assert_eq!(map.shape, [33, 33]);
        let vector = |name: &str| [0, 1, 2].map(|k| film[name][k].as_f64().expect("a number"));
        let [d, f, r, u] = ["direction", "forward", "right", "up"].map(vector);
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        assert!((dot(d, d) - 1.0).abs() < 1e-12 && dot(r, d).abs() < 1e-12 && dot(u, r).abs() < 1e-12);
        assert!(dot(u, up) > 0.0, "{sun}");
        let mut hit = 0;
        for (k, t) in map.f32().into_iter().enumerate().filter(|(_, t)| t.is_finite()) {
            let (x, y) = (2.0 * (k % 33) as f64 - 32.0, 32.0 - 2.0 * (k / 33) as f64);
            let p = [0, 1, 2].map(|k| f[k] + x * r[k] + y * u[k] + f64::from(t) * d[k]);
            assert!(p[1].abs() < 1e-5 || (p[1] - 2.0).abs() < 1e-5, "{sun}: {p:?}");
            hit += 1;
        }
        assert!(hit > 100 || sun == "0,0,-1", "{sun}: {hit}");
        for format in ["exr", "png"] {
            place.quiet_run(&format!("shadow floor.obj --sun {sun} --map-size 9 -o a.{format}"));
        }
    }
}

#[test]
fn a_report_of_lights_and_faces() {
    let place = place();
    let line = format!("shadow box.obj {LIGHT} --light 3,4,5 {CAMERA} --report r.json --repeat 3");
    place.quiet_run(&format!("{line} --cube-size 4 -o c.npy --mask m.npy --samples 2"));
    let report = place.json("r.json");
    assert_eq!((&report["schema"], &report["command"]), (&1.into(), &"shadow".into()));
    assert_eq!(report["lights"][1]["point"], serde_json::json!([3.0, 4.0, 5.0]));
    assert_eq!(report["map"]["size"], 4);
    let faces = report["map"]["faces"].as_array().expect("faces");
    let names: Vec<&str> = faces.iter().filter_map(|face| face["name"].as_str()).collect();
    assert_eq!(names, ["+X", "-X", "+Y", "-Y", "+Z", "-Z"]);
    // d = m + x s + y t: the rows of +X are [0, 0, 1], [0, −1, 0], [−1, 0, 0].
    let matrix = serde_json::json!([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]]);
    assert_eq!(faces[0]["matrix"].to_string().replace("-0.0", "0.0"), matrix.to_string());
    assert_eq!(report["ms"]["engine"].as_array().map(Vec::len), Some(3));
    for stage in ["camera", "receivers"] {
        assert!(report["ms"][stage].as_f64().expect("milliseconds") > 0.0, "{stage}");
    }
    // Each light: the texels of its cube, and what two passes of the camera see: the box from outside, nothing of which turns to a
    // light within.
    let seen = report["rays"].as_u64().expect("a count") - 2 * 96;
    assert!(seen > 0 && seen <= 2 * 2 * 200, "{seen}");
    assert_eq!(report["asked"], 0);
    let mut hasher = blake3::Hasher::new();
    hasher.update(&place.npy("c.npy").data);
    hasher.update(&place.npy("m.npy").data);
    assert_eq!(report["hash"], hasher.finalize().to_hex().as_str());
    place.quiet_run(&format!("shadow box.obj --light 20,30,40 {CAMERA} --report r.json --mask m.npy"));
    let report = place.json("r.json");
    assert!(report["asked"].as_u64() > Some(0) && report["asked"].as_u64() <= report["rays"].as_u64());
}

#[test]
fn a_table_of_errors() {
    let place = place();
    let line = format!("shadow floor.obj --light 0.5,4,0.25 {CAMERA} --report r.json");
    let run = place.run(&format!("{line} --compare=4,64"));
    assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""));
    let lines: Vec<&str> = run.stdout.lines().collect();
    assert!(lines[0].starts_with("light 0 at [0.5, 4, 0.25]: "), "{}", lines[0]);
    assert!(lines[1].contains("acne") && lines[1].contains("leaks"));
    let report = place.json("r.json");
    let rows = report["compare"].as_array().expect("rows");
    assert_eq!((lines.len(), rows.len()), (4, 2));
    for (line, row) in lines[2..].iter().zip(rows) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let numbers = ["cube_size", "acne", "leaks"].map(|name| row[name].to_string());
        assert_eq!([words[0], words[1], words[4]], numbers.each_ref().map(String::as_str), "{line}");
    }
    let run = place.run("shadow builtin:cornell --size 16x16 --compare");
    assert_eq!((run.code, run.stdout.lines().count()), (Some(0), 6));
    assert!(run.stdout.contains("2048"));
}

#[test]
fn built_in_scenes_have_a_light() {
    let place = place!();
    place.quiet_run("shadow --cube-size 4 -o a.npy --report r.json");
    assert_eq!(place.json("r.json")["scene"]["name"], "builtin:umbel");
    assert_eq!(place.json("r.json")["lights"][0]["point"], serde_json::json!([-1.5, 7.0, 3.5]));
}
