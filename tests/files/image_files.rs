//! Image files from outside: nothing lost, the same bytes each time, nothing accepted that is not an image.

use std::fs;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage, f16,
};
use tempfile::TempDir;
use umbel::Error;
use umbel::files::{
    Channel, Samples, read_exr, read_png_rgb8, srgb_encode, write_exr, write_png_rgb8, write_png_rgba8,
};

/// A directory of its own for each test.
fn directory() -> TempDir {
    tempfile::tempdir().expect("a temporary directory")
}

/// Whether nothing is in the directory.
fn is_empty(home: &TempDir) -> bool {
    let mut entries = fs::read_dir(home.path()).expect("a directory");
    entries.next().is_none()
}

/// What [`Error::Write`] says.
fn problem(outcome: Result<(), Error>) -> String {
    match outcome {
        Err(Error::Write { problem, .. }) => problem,
        other => panic!("expected a write error, got {other:?}"),
    }
}

fn channel(name: &str, samples: Samples) -> Channel {
    let name = name.to_owned();
    Channel { name, samples }
}

/// Depth, ids and a normal of an image, with the values that are easily lost.
fn channels(width: usize, height: usize) -> Vec<Channel> {
    let mut depth: Vec<f32> = (0..width * height).map(|i| 1.0 / (i as f32 + 1.0)).collect();
    let mut ids: Vec<u32> = (0..).take(width * height).collect();
    depth[0] = f32::INFINITY;
    ids[0] = u32::MAX;
    ids[1] = (1 << 24) + 1;
    let nan = vec![f32::from_bits(0x7fc0_1234); width * height];
    vec![
        channel("id", Samples::U32(ids)),
        channel("Z", Samples::F32(depth)),
        channel("N.X", Samples::F32(nan)),
    ]
}

/// The samples as bits, so that NaN equals itself.
fn bits(samples: &Samples) -> Vec<u32> {
    match samples {
        Samples::F32(values) => values.iter().map(|v| v.to_bits()).collect(),
        Samples::U32(values) => values.clone(),
    }
}

#[test]
fn exr_keeps_every_bit_and_sorts_by_name() {
    let home = directory();
    let path = home.path().join("a.exr");
    for (width, height) in [(2, 1), (1, 37), (70, 33)] {
        let written = channels(width, height);
        write_exr(&path, width, height, written.clone()).expect("written");
        let (read_width, read_height, read) = read_exr(&path).expect("read");
        assert_eq!((read_width, read_height), (width, height));
        let read_names: Vec<&str> = read.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(read_names, ["N.X", "Z", "id"]);
        for (read, written) in read.iter().zip([&written[2], &written[1], &written[0]]) {
            let same_type = matches!(
                (&read.samples, &written.samples),
                (Samples::F32(_), Samples::F32(_)) | (Samples::U32(_), Samples::U32(_))
            );
            assert!(same_type, "{}", read.name);
            assert_eq!(bits(&read.samples), bits(&written.samples), "{}", read.name);
        }
    }
}

#[test]
fn exr_bytes_do_not_depend_on_the_order_of_channels() {
    let home = directory();
    let (first, second) = (home.path().join("1.exr"), home.path().join("2.exr"));
    let forward = channels(50, 40);
    let backward = forward.iter().rev().cloned().collect();
    write_exr(&first, 50, 40, forward).expect("written");
    write_exr(&second, 50, 40, backward).expect("written");
    assert_eq!(fs::read(&first).unwrap(), fs::read(&second).unwrap());
}

#[test]
fn exr_of_half_floats_is_read() {
    let home = directory();
    let path = home.path().join("a.exr");
    let halves = [0.5, -2.0, f32::INFINITY].map(f16::from_f32).to_vec();
    let luminance = AnyChannel::new("Y", FlatSamples::F16(halves));
    let channels = AnyChannels::sort([luminance].into_iter().collect());
    let encoding = Encoding::FAST_LOSSLESS;
    let layer = Layer::new((3, 1), LayerAttributes::default(), encoding, channels);
    let image = Image::from_layer(layer);
    image.write().to_file(&path).expect("written");
    let expected = channel("Y", Samples::F32(vec![0.5, -2.0, f32::INFINITY]));
    assert_eq!(read_exr(&path).expect("read"), (3, 1, vec![expected]));
}

#[test]
fn exr_that_announces_too_much_is_refused() {
    let home = directory();
    let path = home.path().join("a.exr");
    write_exr(&path, 70, 33, channels(70, 33)).expect("written");
    let mut bytes = fs::read(&path).expect("the file");
    // Both windows end at (69, 32), inclusive.
    let end: Vec<u8> = [69_i32, 32].iter().flat_map(|v| v.to_le_bytes()).collect();
    for at in 0..400 {
        if bytes[at..at + 8] == end[..] {
            bytes[at..at + 8].copy_from_slice(&[0xff, 0xff, 0xff, 0x1f, 0xff, 0xff, 0xff, 0x1f]);
        }
    }
    fs::write(&path, bytes).expect("made");
    assert!(matches!(read_exr(&path), Err(Error::Input { .. })));
}

#[test]
fn exr_that_the_format_does_not_allow_is_refused() {
    let home = directory();
    let path = home.path().join("a.exr");
    let one = |name: &str| channel(name, Samples::F32(vec![0.0]));
    let cases = [
        (1, vec![], "needs a channel"),
        (0, vec![one("Z")], "0x1 pixels"),
        (2, vec![one("Z")], "has 1 samples for 2x1"),
        (usize::MAX, vec![one("Z")], "cannot be an image"),
        (1, vec![one("")], "cannot be the name"),
        (1, vec![one("größe")], "cannot be the name"),
        (1, vec![one(&"x".repeat(256))], "cannot be the name"),
        (1, vec![one("Z"), one("id"), one("Z")], "two channels"),
    ];
    for (width, channels, expected) in cases {
        let said = problem(write_exr(&path, width, 1, channels));
        assert!(said.contains(expected), "{said}");
    }
    assert!(is_empty(&home));
    let long = vec![one(&"x".repeat(255))];
    write_exr(&path, 1, 1, long.clone()).expect("written");
    assert_eq!(read_exr(&path).expect("read").2, long);
}

#[test]
fn png_gives_back_what_it_got() {
    let home = directory();
    let path = home.path().join("a.png");
    let rgb: Vec<u8> = (0..3 * 31 * 17_u32).map(|i| (i * i % 251) as u8).collect();
    write_png_rgb8(&path, 31, 17, &rgb).expect("written");
    let first = fs::read(&path).expect("the file");
    assert_eq!(read_png_rgb8(&path).expect("read"), (31, 17, rgb.clone()));
    write_png_rgb8(&path, 31, 17, &rgb).expect("written");
    assert_eq!(fs::read(&path).expect("the file"), first);

    write_png_rgba8(&path, 2, 1, &[1, 2, 3, 0, 4, 5, 6, 255]).expect("written");
    let without_opacity = read_png_rgb8(&path).expect("read");
    assert_eq!(without_opacity, (2, 1, vec![1, 2, 3, 4, 5, 6]));
}

#[test]
fn png_of_a_wrong_size_is_refused() {
    let home = directory();
    let path = home.path().join("a.png");
    for (width, height) in [(0, 0), (0, 1), (1, 2), (u32::MAX, u32::MAX)] {
        let said = problem(write_png_rgb8(&path, width, height, &[0; 3]));
        assert!(said.contains("cannot be made of 3 bytes"), "{said}");
    }
    problem(write_png_rgba8(&path, 1, 1, &[0; 3]));
    assert!(is_empty(&home));
}

#[test]
fn images_that_are_none_are_input_errors() {
    let home = directory();
    let (exr, png) = (home.path().join("a.exr"), home.path().join("a.png"));
    let code = |error: Error| if matches!(error, Error::Input { .. }) { 3 } else { 1 };
    for content in [&b""[..], b"not an image at all", b"\x76\x2f\x31\x01\x02\x00\x00\x00"] {
        fs::write(&exr, content).expect("made");
        fs::write(&png, content).expect("made");
        assert_eq!(read_exr(&exr).map_err(code), Err(3));
        assert_eq!(read_png_rgb8(&png).map_err(code), Err(3));
    }
    assert_eq!(read_exr(&home.path().join("none")).map_err(code), Err(3));
    assert_eq!(read_png_rgb8(home.path()).map_err(code), Err(3));
}

#[test]
fn files_cut_short_are_input_errors() {
    let home = directory();
    let (exr, png) = (home.path().join("a.exr"), home.path().join("a.png"));
    write_exr(&exr, 70, 33, channels(70, 33)).expect("written");
    write_png_rgb8(&png, 64, 64, &[200; 3 * 64 * 64]).expect("written");
    let (whole_exr, whole_png) = (fs::read(&exr).unwrap(), fs::read(&png).unwrap());
    for cut in [1, 2, 3, 10] {
        fs::write(&exr, &whole_exr[..whole_exr.len() * cut / 11]).expect("made");
        fs::write(&png, &whole_png[..(whole_png.len() - 20) * cut / 11]).expect("made");
        assert!(matches!(read_exr(&exr), Err(Error::Input { .. })));
        assert!(matches!(read_png_rgb8(&png), Err(Error::Input { .. })));
    }
}

/// The sRGB transfer function as the standard has it.
fn srgb_reference(linear: f32) -> u8 {
    let x = f64::from(linear).clamp(0.0, 1.0);
    let s = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055 };
    (255.0 * s).round() as u8
}

#[test]
fn srgb_agrees_with_the_standard() {
    let one = 1_f32.to_bits();
    for x in (0..=one).step_by(997).map(f32::from_bits) {
        assert_eq!(srgb_encode(x), srgb_reference(x), "{x:e}");
    }
    // Around every change of the code: its place in f64, and the f32 on both sides.
    for code in 0..255 {
        let s = (f64::from(code) + 0.5) / 255.0;
        let x = if s <= 0.040_45 { s / 12.92 } else { libm::pow((s + 0.055) / 1.055, 2.4) };
        let middle = (x as f32).to_bits();
        for x in (middle - 200..middle + 200).map(f32::from_bits) {
            assert_eq!(srgb_encode(x), srgb_reference(x), "{x:e}");
        }
        assert_eq!(srgb_encode(f32::from_bits(middle - 200)), code);
        assert_eq!(srgb_encode(f32::from_bits(middle + 200)), code + 1);
    }
}

#[test]
fn srgb_clamps() {
    for dark in [f32::NAN, -f32::NAN, f32::NEG_INFINITY, -1.0, -0.0, 0.0, 1e-45] {
        assert_eq!(srgb_encode(dark), 0, "{dark}");
    }
    for bright in [1.0, 1.000_000_1, f32::MAX, f32::INFINITY] {
        assert_eq!(srgb_encode(bright), 255, "{bright}");
    }
    assert_eq!(srgb_encode(0.5), 188);
    assert_eq!(srgb_encode(0.214_041_14), 128);
}
