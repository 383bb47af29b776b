//! What times depend on: the machine, its system, the threads and the version of this program.

use std::sync::LazyLock;

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

/// What `--version` tells: the version, the commit where the build was told one (UMBEL_COMMIT), and what was built in.
pub(crate) fn long_version() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let features = [
            ("obj", cfg!(feature = "obj")),
            ("gltf", cfg!(feature = "gltf")),
            ("ply", cfg!(feature = "ply")),
            ("stl", cfg!(feature = "stl")),
            ("off", cfg!(feature = "off")),
            ("gz", cfg!(feature = "gz")),
            ("zst", cfg!(feature = "zst")),
        ];
        let built: Vec<&str> =
            features.into_iter().filter(|&(_, is_built)| is_built).map(|(name, _)| name).collect();
        let commit = option_env!("UMBEL_COMMIT").map(|commit| format!(" ({commit})")).unwrap_or_default();
        let Machine { isa, system, version, .. } = Machine::here();
        format!("{version}{commit}\nsystem: {system}, instructions: {isa}\nformats: {}", built.join(" "))
    });
    &TEXT
}
