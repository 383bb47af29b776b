//! What several tests need: the command in a directory of its own, and arrays read back from files.

#![allow(dead_code, reason = "each test binary uses a part of this")]

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use tempfile::TempDir;
use umbel::glam::DVec3;

/// A finished run of the command.
pub(crate) struct Run {
    /// `None` where a signal ended it.
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("the command writes UTF-8");
        Self { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }
}

/// A directory of its own in which the command runs.
pub(crate) struct Place(TempDir);

impl Place {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary directory"))
    }

    /// Runs `umbel` with the words of `line`. The streams are pipes, so there is no terminal.
    pub(crate) fn run(&self, line: &str) -> Run {
        let words = line.split_whitespace();
        let mut command = Command::new(env!("CARGO_BIN_EXE_umbel"));
        command.args(words).current_dir(self.0.path());
        let output = command.env_remove("UMBEL_THREADS").output();
        output.expect("the command starts").into()
    }

    /// Runs `umbel`, which must succeed and say nothing.
    pub(crate) fn quiet_run(&self, line: &str) {
        let run = self.run(line);
        let said = (run.code, run.stdout.as_str(), run.stderr.as_str());
        assert_eq!(said, (Some(0), "", ""), "umbel {line}");
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn put(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::write(self.path(name), bytes).expect("written");
    }

    pub(crate) fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The names in the directory, sorted.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).expect("a directory");
        let name = |entry: std::io::Result<fs::DirEntry>| entry.expect("an entry").file_name();
        let mut names: Vec<String> = entries.map(|entry| name(entry).into_string().expect("UTF-8")).collect();
        names.sort();
        names
    }

    pub(crate) fn npy(&self, name: &str) -> Npy {
        Npy::parse(&self.bytes(name))
    }

    pub(crate) fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&self.bytes(name)).expect("JSON")
    }
}

/// An NPY file, read by hand: nothing of the writer is trusted.
pub(crate) struct Npy {
    pub(crate) dtype: String,
    pub(crate) shape: Vec<usize>,
    pub(crate) data: Vec<u8>,
}

impl Npy {
    fn parse(bytes: &[u8]) -> Self {
        assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
        let start = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let header = std::str::from_utf8(&bytes[10..start]).expect("an ASCII header");
        assert!(header.contains("'fortran_order': False"), "{header}");
        let between = |from: &str, to: &str| {
            let rest = header.split_once(from).expect("a field").1;
            rest.split_once(to).expect("its end").0.to_owned()
        };
        let extents = between("'shape': (", ")");
        let extents = extents.split(',').map(str::trim).filter(|n| !n.is_empty());
        let npy = Self {
            dtype: between("'descr': '", "'"),
            shape: extents.map(|n| n.parse().expect("an extent")).collect(),
            data: bytes[start..].to_vec(),
        };
        assert_eq!(npy.data.len(), 4 * npy.shape.iter().product::<usize>());
        npy
    }

    fn words(&self) -> impl Iterator<Item = [u8; 4]> {
        self.data.chunks_exact(4).map(|w| [w[0], w[1], w[2], w[3]])
    }

    pub(crate) fn u32(&self) -> Vec<u32> {
        assert_eq!(self.dtype, "<u4");
        self.words().map(u32::from_le_bytes).collect()
    }

    pub(crate) fn f32(&self) -> Vec<f32> {
        assert_eq!(self.dtype, "<f4");
        self.words().map(f32::from_le_bytes).collect()
    }
}

/// SplitMix64 (G. Steele et al., "Fast splittable pseudorandom number generators", 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// The option that sets the size of a picture: a cube has its own.
pub(crate) fn size_option(lens: &str, size: &str, cube_size: u32) -> String {
    if lens == "cube" { format!("--cube-size {cube_size}") } else { format!("--size {size}") }
}

/// The direction of a pixel of a cube camera: the table of OpenGL, Direct3D, Vulkan and KTX, in world axes.
pub(crate) fn cube_direction(size: usize, pixel: usize) -> DVec3 {
    let (face, i, j) = (pixel / (size * size), pixel % size, pixel / size % size);
    let at = |k: usize| 2.0 * (k as f64 + 0.5) / size as f64 - 1.0;
    let (s, t) = (at(i), at(j));
    DVec3::from_array(match face {
        0 => [1.0, -t, -s],
        1 => [-1.0, -t, s],
        2 => [s, 1.0, t],
        3 => [s, -1.0, -t],
        4 => [s, -t, 1.0],
        _ => [-s, -t, -1.0],
    })
}

/// The teapot as an OBJ file: its micropolygons, with edges of about 1/60 of a unit.
pub(crate) fn teapot_obj() -> String {
    use umbel::engine::{Dicing, dice_all};
    use umbel::formats::{SurfaceOptions, load_surfaces};
    use umbel::{Camera, Lens};
    let lens = Lens::Ortho { height: 6.0 };
    let (eye, target) = (DVec3::new(4.0, 5.0, 6.0), DVec3::new(0.0, 1.5, 0.0));
    let camera = Camera { eye, target, up: DVec3::Y, lens, width: 360, height: 360 };
    let pencil = camera.shot().expect("a camera").pencil;
    let scene = load_surfaces("builtin:teapot", SurfaceOptions::default()).expect("the teapot");
    let dicing = Dicing { shading_rate: 1.0, ..Dicing::default() };
    let diced = dice_all(&scene.surfaces, &pencil, &dicing).expect("triangles");
    let mut obj = String::new();
    for [x, y, z] in diced.positions() {
        obj += &format!("v {x} {y} {z}\n");
    }
    for [a, b, c] in diced.indices() {
        obj += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    obj
}
