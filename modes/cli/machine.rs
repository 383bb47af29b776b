//! What times depend on: the machine, its system, the threads and the version of this program.

use umbel::engine::Isa;

/// The machine as far as it tells.
pub(crate) struct Machine {
    /// The processor's name.
    pub(crate) processor: String,
    /// The system and the kind of processor.
    pub(crate) system: String,
    pub(crate) processors: usize,
    pub(crate) threads: usize,
    /// The instructions that `--isa auto` takes.
    pub(crate) isa: &'static str,
    pub(crate) version: &'static str,
}

impl Machine {
    pub(crate) fn here() -> Self {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let line = info.lines().find_map(|line| line.strip_prefix("model name"));
        let name = line.and_then(|line| line.split_once(':')).map(|(_, name)| name.trim().to_owned());
        let [system, kind] = [std::env::consts::OS, std::env::consts::ARCH];
        Self {
            processor: name.unwrap_or_else(|| kind.to_owned()),
            system: format!("{system} {kind}"),
            processors: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
            threads: rayon::current_num_threads(),
            isa: Isa::Auto.resolve().map_or("none", Isa::name),
            version: env!("CARGO_PKG_VERSION"),
        }
    }
}
