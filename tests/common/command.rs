//! The command in a directory of its own, and arrays read back from files.

use std::ffi::OsStr;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use tempfile::TempDir;

/// A finished run of the command.
pub struct Run {
    /// `None` where a signal ended it.
    pub code: Option<i32>,
    /// All that it wrote to its standard output.
    pub stdout: String,
    /// All that it said on its standard error.
    pub stderr: String,
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("the command writes UTF-8");
        Self { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }
}

/// A directory of its own in which the command runs. It goes when it is dropped.
pub struct Place {
    binary: &'static str,
    directory: TempDir,
}

impl Place {
    /// A new directory for a binary; [`crate::place!`] knows it.
    pub fn new(binary: &'static str) -> Self {
        Self { binary, directory: tempfile::tempdir().expect("a temporary directory") }
    }

    /// Runs `umbel` with the words of `line`. The streams are pipes, so there is no terminal.
    pub fn run(&self, line: &str) -> Run {
        let words: Vec<&str> = line.split_whitespace().collect();
        self.run_words(&words)
    }

    /// The same with words that may hold blanks, or bytes that are no UTF-8.
    pub fn run_words(&self, words: &[impl AsRef<OsStr>]) -> Run {
        let mut command = Command::new(self.binary);
        command.args(words).current_dir(self.directory.path());
        let output = command.env_remove("UMBEL_THREADS").output();
        output.expect("the command starts").into()
    }

    /// Runs `umbel`, which must succeed and say nothing.
    pub fn quiet_run(&self, line: &str) {
        let run = self.run(line);
        let said = (run.code, run.stdout.as_str(), run.stderr.as_str());
        assert_eq!(said, (Some(0), "", ""), "umbel {line}");
    }

    /// The path of a file in the directory.
    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// Writes a file.
    pub fn put(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::write(self.path(name), bytes).expect("written");
    }

    /// Reads a file.
    pub fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The names in the directory, sorted.
    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.directory.path()).expect("a directory");
        let name = |entry: std::io::Result<fs::DirEntry>| entry.expect("an entry").file_name();
        let mut names: Vec<String> = entries.map(|entry| name(entry).into_string().expect("UTF-8")).collect();
        names.sort();
        names
    }

    /// Reads an array.
    pub fn npy(&self, name: &str) -> Npy {
        Npy::parse(&self.bytes(name))
    }

    /// Reads a JSON file.
    pub fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_slice(&self.bytes(name)).expect("JSON")
    }
}

/// An NPY file, read by hand: nothing of the writer is trusted.
pub struct Npy {
    /// The type of the numbers as NumPy writes it, such as `<f4`.
    pub dtype: String,
    /// The extents, the slowest first.
    pub shape: Vec<usize>,
    /// The numbers, four bytes each.
    pub data: Vec<u8>,
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

    /// The numbers of an array of `<u4`.
    pub fn u32(&self) -> Vec<u32> {
        assert_eq!(self.dtype, "<u4");
        self.words().map(u32::from_le_bytes).collect()
    }

    /// The numbers of an array of `<f4`.
    pub fn f32(&self) -> Vec<f32> {
        assert_eq!(self.dtype, "<f4");
        self.words().map(f32::from_le_bytes).collect()
    }
}

/// The option that sets the size of a picture: a cube has its own.
pub fn size_option(lens: &str, size: &str, cube_size: u32) -> String {
    if lens == "cube" { format!("--cube-size {cube_size}") } else { format!("--size {size}") }
}
