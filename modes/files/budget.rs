//! How much memory reading a scene may take: checked before anything is allocated whose size a file decides.
//!
//! A few bytes of a file can stand for many: buffers that name one file, instances of one mesh, images of one colour. What is
//! going to be kept is added up and compared with the limit before it is made, and a refusal says what would have been
//! needed. Without a limit of the caller's it is half of what the system can give, so that the work after reading finds some
//! as well.

use std::cell::Cell;
use std::fs;
use std::path::Path;

use crate::error::{Error, Problem};

/// The share of the memory that is left which reading a scene may take.
const SHARE: f64 = 0.5;

/// What is allowed in any case: less than a program without a scene has at hand.
const LEAST: u64 = 1 << 16;

/// What to do about a scene that is too large.
const REMEDY: &str = "Split the file, or give it more: max_memory.";

/// The memory for one scene.
#[derive(Debug)]
pub(crate) struct Budget {
    limit: u64,
    used: Cell<u64>,
    was_refused: Cell<bool>,
}

impl Budget {
    /// So many bytes, or a share of what the system can give.
    pub(crate) fn new(limit: Option<u64>) -> Self {
        let share = || available_memory().map(|bytes| (bytes as f64 * SHARE) as u64);
        let limit = limit.or_else(share).unwrap_or(u64::MAX).max(LEAST);
        Self { limit, used: Cell::new(0), was_refused: Cell::new(false) }
    }

    /// Counts bytes that are going to be kept.
    pub(crate) fn take(&self, bytes: u64, what: &str) -> Result<(), Problem> {
        self.check(bytes, what)?;
        self.used.set(self.used.get() + bytes);
        Ok(())
    }

    /// Checks bytes that are needed for a while.
    pub(crate) fn check(&self, bytes: u64, what: &str) -> Result<(), Problem> {
        let needed = self.used.get().saturating_add(bytes);
        if needed <= self.limit {
            return Ok(());
        }
        self.was_refused.set(true);
        let (megabytes, limit) = (in_megabytes(needed), in_megabytes(self.limit));
        let what = format!(
            "reading it would need at least {megabytes:.1} MB of memory (for {what}), and may take {limit:.1} MB"
        );
        Err(Problem { line: None, what, remedy: REMEDY })
    }

    /// What is left to take.
    #[cfg(feature = "obj")]
    pub(crate) fn left(&self) -> u64 {
        self.limit.saturating_sub(self.used.get())
    }

    /// The error of a reader: a limit where this budget has refused something.
    pub(crate) fn error(&self, problem: Problem, path: &Path) -> Error {
        match self.was_refused.get() {
            true => Error::Limit(format!("{}: {}\n  {}", path.display(), problem.what, problem.remedy)),
            false => problem.at(path),
        }
    }
}

fn in_megabytes(bytes: u64) -> f64 {
    bytes as f64 / 1e6
}

/// The bytes that this process can still take without swapping or hitting a limit of the system: what is free, what its
/// control groups leave, and what its limits of address space leave. `None` where nothing tells (not Linux).
#[must_use]
pub fn available_memory() -> Option<u64> {
    let free = kibibytes("/proc/meminfo", "MemAvailable:");
    [free, of_control_groups(), of_limits()].into_iter().flatten().min()
}

/// A line such as `MemFree:   12 kB` in a file of the system, in bytes.
fn kibibytes(file: &str, name: &str) -> Option<u64> {
    let text = fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kibibytes| kibibytes * 1024)
}

/// What the limits of address space and of data leave (`ulimit -v`, `ulimit -d`).
fn of_limits() -> Option<u64> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let left = |name: &str, used: &str| {
        let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
        let limit: u64 = line.split_whitespace().next()?.parse().ok()?;
        Some(limit.saturating_sub(kibibytes("/proc/self/status", used)?))
    };
    let both = [left("Max address space", "VmSize:"), left("Max data size", "VmData:")];
    both.into_iter().flatten().min()
}

/// What the control groups of this process leave, the least of all above it. Files in the cache count as free.
fn of_control_groups() -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let found = groups.lines().filter_map(|line| {
        let mut parts = line.splitn(3, ':').skip(1);
        let (controllers, group) = (parts.next()?, parts.next()?);
        match controllers {
            "" => of_groups("/sys/fs/cgroup", group, ["memory.max", "memory.current", "inactive_file "]),
            _ if controllers.split(',').any(|name| name == "memory") => of_groups(
                "/sys/fs/cgroup/memory",
                group,
                ["memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file "],
            ),
            _ => None,
        }
    });
    found.min()
}

/// The least that a control group and those above it leave, given the names of their limit, use and idle cache. A process in
/// a container may see its own group as the root.
fn of_groups(root: &str, group: &str, [limit, used, idle]: [&str; 3]) -> Option<u64> {
    let root = Path::new(root);
    let number = |folder: &Path, name: &str| -> Option<u64> {
        fs::read_to_string(folder.join(name)).ok()?.trim().parse().ok()
    };
    let left = |folder: &Path| {
        let statistics = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
        let idle = statistics.lines().find_map(|line| line.strip_prefix(idle)?.trim().parse().ok());
        let used = number(folder, used)?.saturating_sub(idle.unwrap_or(0));
        Some(number(folder, limit)?.saturating_sub(used))
    };
    let own = root.join(group.trim_start_matches('/'));
    own.ancestors().take_while(|folder| folder.starts_with(root)).filter_map(left).min()
}
