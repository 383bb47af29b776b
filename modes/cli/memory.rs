//! How many bytes a run takes: told before it, compared with the limit, and held against what it took.
//!
//! A forecast is that of the whole process, as the system counts it (the peak of its resident size): what is there when the
//! scene has been read, and the most that is added at a time. The first part is not computed but asked for where the system
//! tells (Linux); elsewhere it is the program's own and the numbers of the scene. The second part follows from the numbers of
//! pixels, receivers and triangles; its constants are those of the types, and were compared with peaks measured
//! (`tests/cli/memory.rs` holds every verb to 15 %).

use umbel::files::available_memory;
use umbel::{Error, Scene};

use crate::common::Common;
use crate::process::{peak_bytes, resident_bytes};

/// Bytes that surfaces on demand take: those of a round of micropolygons.
pub(crate) const ROUND_BYTES: u64 = 100 << 20;

/// Bytes that the program takes itself: what is loaded of it, and what its threads start with.
const PROCESS_BYTES: u64 = 7 << 20;

/// Bytes that every run adds to what is there when the scene has been read: code that has not run yet, stacks, the writer of a file.
const RUN_BYTES: u64 = 5 << 19;

/// What the process has, before a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Room {
    now: u64,
}

impl Room {
    /// What it has now, with a scene.
    pub(crate) fn beside(scene: &Scene) -> Self {
        Self { now: resident_bytes().unwrap_or_else(|| PROCESS_BYTES + scene_bytes(scene)) }
    }

    /// The bytes of the whole process at its peak, when a run adds so many.
    pub(crate) fn with(self, bytes: u64) -> u64 {
        peak_bytes().unwrap_or(0).max(self.now.saturating_add(bytes).saturating_add(RUN_BYTES))
    }

    /// What a limit leaves for a run; `None` without `--max-memory`.
    pub(crate) fn left(self, common: &Common) -> Option<u64> {
        common.max_memory.map(|limit| limit.saturating_sub(self.now.saturating_add(RUN_BYTES)))
    }

    /// Stops when a run that adds so many bytes takes more than there may be. Gives the bytes of the whole process.
    pub(crate) fn limit(self, bytes: u64, remedy: &str, common: &Common) -> Result<u64, Error> {
        let (added, forecast) = (bytes.saturating_add(RUN_BYTES), self.with(bytes));
        if common.verbose {
            anstream::eprintln!("about {forecast} bytes of memory, {added} of them beside what is there");
        }
        let (needed, limit, name) = match common.max_memory {
            Some(limit) => (forecast, limit, "--max-memory"),
            None => (added, available_memory().unwrap_or(u64::MAX), "the memory that is left,"),
        };
        if needed > limit {
            return Err(Error::Limit(format!(
                "about {needed} bytes are needed, more than {name} {limit}; use a smaller {remedy}"
            )));
        }
        Ok(forecast)
    }
}

/// Bytes of the numbers of a scene.
fn scene_bytes(scene: &Scene) -> u64 {
    let triples = scene.positions.len() + scene.triangles.len() + scene.normals.len();
    let indices = scene.normal_indices.len() + scene.uv_indices.len();
    (12 * (triples + indices) + 8 * scene.uvs.len() + 4 * scene.face_corners.len()) as u64
}
