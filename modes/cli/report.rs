//! The report of a run: one JSON file with counts, times and a hash of the outputs.

use std::path::Path;
use std::time::Instant;

use serde_json::{Map, Value, json};
use umbel::engine::Accuracy;
use umbel::files::write_atomically;
use umbel::render::{Followed, Preview};
use umbel::{Error, Options, Scene, Stats};

use crate::process::peak_bytes;

/// The version of the report's layout. It is only ever extended.
const SCHEMA: u32 = 1;

/// Milliseconds of the stages of a run. What belongs to none is found where it is reported.
#[derive(Debug)]
pub(crate) struct Times {
    /// When the command started.
    pub(crate) start: Instant,
    pub(crate) load: f64,
    /// One per repeat.
    pub(crate) engine: Vec<f64>,
    /// The camera's own rays, where those of the light are the engine's.
    pub(crate) camera: f64,
    /// From the camera's hits to the points that ask for light.
    pub(crate) receivers: f64,
    /// Looking through texture coordinates.
    pub(crate) check: f64,
    pub(crate) shade: f64,
    pub(crate) write: f64,
}

impl Default for Times {
    /// Starts now.
    fn default() -> Self {
        let (load, camera, receivers, check, shade, write) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        Self { start: Instant::now(), load, engine: Vec::new(), camera, receivers, check, shade, write }
    }
}

impl Times {
    /// Books a preview, whose time is that of shading so far: the engine's queries belong to its last run.
    pub(crate) fn take_preview(&mut self, seen: Preview) -> (Vec<f32>, Followed) {
        let engine = seen.engine.as_secs_f64() * 1000.0;
        self.shade -= engine;
        if let Some(last) = self.engine.last_mut() {
            *last += engine;
        }
        (seen.linear, seen.followed)
    }

    /// All stages, the whole, and what belongs to no stage.
    fn json(&self) -> Value {
        let total = self.start.elapsed().as_secs_f64() * 1000.0;
        let stages = [self.load, self.camera, self.receivers, self.check, self.shade, self.write];
        let booked = stages.iter().sum::<f64>() + self.engine.iter().sum::<f64>();
        json!({
            "load": self.load,
            "engine": self.engine,
            "camera": self.camera,
            "receivers": self.receivers,
            "check": self.check,
            "shade": self.shade,
            "write": self.write,
            "other": (total - booked).max(0.0),
            "total": total,
        })
    }
}

/// Runs something and adds the milliseconds it took.
pub(crate) fn timed<T>(milliseconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *milliseconds += start.elapsed().as_secs_f64() * 1000.0;
    result
}

/// A run, as it is reported.
pub(crate) struct Report<'a> {
    pub(crate) command: &'a str,
    pub(crate) scene: &'a Scene,
    pub(crate) rays: usize,
    pub(crate) options: Options,
    pub(crate) times: &'a Times,
    pub(crate) stats: Stats,
    /// The bytes of the process that were foreseen.
    pub(crate) forecast: u64,
    /// BLAKE3 of the output arrays, little-endian, in the order in which they are written.
    pub(crate) hash: blake3::Hash,
}

impl Report<'_> {
    /// Writes the report.
    pub(crate) fn write(&self, path: &Path) -> Result<(), Error> {
        self.write_with(path, Map::new())
    }

    /// Writes the report with what only this verb has to tell.
    pub(crate) fn write_with(&self, path: &Path, mut more: Map<String, Value>) -> Result<(), Error> {
        let mut report = self.json();
        if let Some(fields) = report.as_object_mut() {
            fields.append(&mut more);
        }
        let text = format!("{report:#}\n");
        write_atomically(path, |file| file.write_all(text.as_bytes()))
    }

    fn json(&self) -> Value {
        let accuracy = if self.options.accuracy == Accuracy::Exact { "exact" } else { "fast" };
        let stats: Map<String, Value> =
            self.stats.counters().iter().map(|&(name, count)| (name.to_owned(), json!(count))).collect();
        json!({
            "schema": SCHEMA,
            "command": self.command,
            "scene": {
                "name": self.scene.name,
                "triangles": self.scene.triangles.len(),
                "vertices": self.scene.positions.len(),
                "offset": self.scene.offset.to_array(),
            },
            "rays": self.rays,
            "threads": rayon::current_num_threads(),
            "isa": self.options.isa.resolve().map_or("none", umbel::engine::Isa::name),
            "accuracy": accuracy,
            "ms": self.times.json(),
            "engine_bytes": self.stats.engine_bytes,
            "forecast_bytes": self.forecast,
            "peak_rss_bytes": peak_bytes(),
            "stats": stats,
            "hash": self.hash.to_hex().as_str(),
        })
    }
}
