//! What the numbers depend on: the machine, the threads, the versions and how this program was compiled.

use serde_json::{Value, json};

/// The versions of all packages that were compiled in.
const LOCK: &str = include_str!("Cargo.lock");

/// The processor's name as the system tells it.
fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let field = |name: &str| {
        let line = info.lines().find(|line| line.split(':').next().is_some_and(|key| key.trim() == name))?;
        line.split_once(':').map(|(_, value)| value.trim().to_owned())
    };
    let Some(name) = field("model name") else {
        return std::env::consts::ARCH.to_owned();
    };
    match (field("cpu family"), field("model")) {
        (Some(family), Some(model)) => format!("{name} (family {family}, model {model})"),
        _ => name,
    }
}

/// The widest vector instructions of the machine.
fn instructions() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    return match (is_x86_feature_detected!("avx512f"), is_x86_feature_detected!("avx2")) {
        (true, _) => "avx512",
        (_, true) => "avx2",
        _ => "sse",
    };
    #[cfg(not(target_arch = "x86_64"))]
    std::env::consts::ARCH
}

/// The instructions that the compiler was allowed to use everywhere.
fn compiled_for() -> &'static str {
    match (cfg!(target_feature = "avx512f"), cfg!(target_feature = "avx2")) {
        (true, _) => "avx512",
        (_, true) => "avx2",
        _ => "the baseline",
    }
}

/// The version of a package in the lock file.
fn locked(package: &str) -> Option<&'static str> {
    let entry = LOCK.split("[[package]]").find(|entry| entry.contains(&format!("name = \"{package}\"\n")))?;
    entry.split_once("version = \"")?.1.split_once('"').map(|(version, _)| version)
}

/// The machine and the build, as JSON.
pub(crate) fn machine() -> Value {
    json!({
        "cpu": processor(),
        "instructions": instructions(),
        "compiled_for": compiled_for(),
        "processors": std::thread::available_parallelism().map_or(0, std::num::NonZero::get),
        "threads": rayon::current_num_threads(),
    })
}

/// The versions of the engines, as JSON: umbel's, those of the libraries that are loaded, those that were compiled in.
pub(crate) fn versions(loaded: Vec<(&str, String)>) -> Value {
    let mut versions = serde_json::Map::new();
    versions.insert("umbel".into(), json!(locked("umbel")));
    versions.extend(loaded.into_iter().map(|(name, version)| (name.to_owned(), json!(version))));
    for (package, compiled) in [("obvhs", cfg!(feature = "obvhs")), ("parry3d", cfg!(feature = "parry"))] {
        if compiled {
            versions.insert(package.into(), json!(locked(package)));
        }
    }
    Value::Object(versions)
}
