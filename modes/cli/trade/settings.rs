//! The settings that `umbel trade` measures, each as the words that the user would type.
//!
//! A setting either changes the answer, and is then a point of error against time; or it may change the time only, and is then
//! a check: each byte must be that of the default.

use umbel::engine::Isa;

use crate::trade::args::ModeArg;
use crate::trade::subject::Answer;

/// Samples per pixel.
const SAMPLES: [u32; 6] = [1, 2, 4, 8, 16, 32];
/// Texels along a side of a cube map's face.
const CUBE_SIZES: [u32; 6] = [64, 128, 256, 512, 1024, 2048];
/// Rays per receiver.
const RAYS: [u32; 6] = [8, 16, 32, 64, 128, 256];
/// Texels along the longer side of depth maps.
const DEPTH_MAPS: [u32; 4] = [128, 256, 512, 1024];
/// Sample sets.
const SETS: [&str; 3] = ["shared", "interleaved", "independent"];

/// Edges of micropolygons in pixels, the default second to last, and samples per pixel with each.
const SHADING_RATES: [(&str, &str); 4] = [
    ("2", "shading rate 2, samples"),
    ("1", "shading rate 1, samples"),
    ("0.5", "shading rate 0.5, samples"),
    ("0.25", "shading rate 0.25, samples"),
];
const REYES_SAMPLES: [u32; 4] = [1, 2, 4, 8];
/// The shading rate of the reference.
pub(crate) const REFERENCE_RATE: &str = "0.25";

/// What a setting may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Changes {
    Answer,
    TimeOnly,
}

impl Changes {
    /// Whether a setting may give this answer where the default gives that one.
    pub(crate) fn allows(self, answer: &Answer, default: &Answer) -> bool {
        self == Self::Answer || answer.hash() == default.hash()
    }
}

/// A setting.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Setting {
    /// What it belongs to, in a plot.
    pub(crate) series: &'static str,
    /// What it is called beside its point.
    pub(crate) label: String,
    /// Its options, without scene and outputs.
    pub(crate) words: Vec<String>,
    pub(crate) changes: Changes,
    /// Whether this is what the verb does where nothing is asked for.
    pub(crate) is_default: bool,
    /// Whether decisions are rounded: then it is compared with the default as well.
    pub(crate) is_fast: bool,
}

impl Setting {
    fn new(series: &'static str, label: impl Into<String>, words: &str, changes: Changes) -> Self {
        let words = words.split_whitespace().map(str::to_owned).collect();
        Self { series, label: label.into(), words, changes, is_default: false, is_fast: false }
    }

    fn default_if(self, is_default: bool) -> Self {
        Self { is_default, ..self }
    }

    /// The words that make its output, for a verb.
    fn of(self, output: &str) -> Self {
        let words = [self.words, output.split_whitespace().map(str::to_owned).collect()].concat();
        Self { words, ..self }
    }
}

/// All settings of a mode. With suns there are no cube maps, and with a greatest distance no depth maps; `set` is what a bake takes where
/// no set is named.
pub(crate) fn settings(mode: ModeArg, (has_maps, set): (bool, &str), output: &str) -> Vec<Setting> {
    let answer = |series, label: String, words: String| Setting::new(series, label, &words, Changes::Answer);
    let mut all: Vec<Setting> = match mode {
        ModeArg::Render => SAMPLES
            .iter()
            .map(|n| answer("samples per pixel", n.to_string(), format!("--samples {n}")).default_if(*n == 1))
            .collect(),
        ModeArg::Shadow => {
            let exact = answer("exact mask", "exact mask".into(), String::new()).default_if(true).of(output);
            let cube = |n: &u32| {
                let words = format!("--cube-size {n} -o cube.npy --compare={n}");
                answer("cube map, texels per side", n.to_string(), words)
            };
            let cubes = CUBE_SIZES.iter().filter(|_| has_maps).map(cube);
            [exact].into_iter().chain(cubes).collect()
        }
        ModeArg::Bake => {
            let of_set = |&of: &&'static str| {
                // The others are slower: fewer points of them say as much.
                let rays = if of == "shared" { &RAYS[..] } else { &RAYS[..4] };
                rays.iter().map(move |&n| {
                    let words =
                        if of == set { format!("--rays {n}") } else { format!("--rays {n} --set {of}") };
                    answer(of, n.to_string(), words).default_if(of == set && n == 64)
                })
            };
            let with_maps = |n: &u32| {
                let words = format!("--rays 64 --depth-maps {n}");
                answer("64 rays, depth maps of", n.to_string(), words)
            };
            let maps = DEPTH_MAPS.iter().filter(|_| has_maps).map(with_maps);
            SETS.iter().flat_map(of_set).chain(maps).collect()
        }
        ModeArg::Reyes => {
            let of_rate = |&(rate, series): &(&'static str, &'static str)| {
                REYES_SAMPLES.iter().map(move |&n| {
                    let words = format!("--shading-rate {rate} --samples {n}");
                    answer(series, n.to_string(), words).default_if(rate == "0.5" && n == 1)
                })
            };
            SHADING_RATES.iter().flat_map(of_rate).collect()
        }
    };
    // Surfaces on demand are decided exactly, whatever is asked.
    if mode != ModeArg::Reyes {
        all.push(fast(if mode == ModeArg::Shadow { output } else { "" }));
    }
    all.extend(time_only(mode).map(|setting| setting.of(if mode == ModeArg::Shadow { output } else { "" })));
    if mode != ModeArg::Shadow {
        all = all.into_iter().map(|setting| setting.of(output)).collect();
    }
    all
}

/// Rounded decisions.
fn fast(output: &str) -> Setting {
    let fast = Setting::new("--accuracy fast", "--accuracy fast", "--accuracy fast", Changes::Answer);
    Setting { is_fast: true, ..fast.of(output) }
}

/// The settings that may change the time only, on this machine.
fn time_only(mode: ModeArg) -> impl Iterator<Item = Setting> {
    let time = |words: String| {
        let label = words.trim_start_matches("--").replace(" --", ", ");
        Setting::new("time only", label, &words, Changes::TimeOnly)
    };
    let processors = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let threads = std::iter::successors(Some(1), |n| Some(n * 2)).take_while(move |&n| n < processors);
    let all = [Isa::Sse2, Isa::Sse42, Isa::Avx2, Isa::Avx512, Isa::Neon];
    let isas = all.into_iter().filter(|isa| isa.resolve().is_ok());
    // The general path divides objects in several ways; receivers of ambient occlusion would take minutes in each.
    let has_partitions = matches!(mode, ModeArg::Render | ModeArg::Shadow);
    let partitions: &[&str] = if has_partitions { &["given", "spatial", "sampled"] } else { &[] };
    let groups: &[&str] = if mode == ModeArg::Bake { &["origin", "direction"] } else { &[] };
    threads
        .chain([processors])
        .map(move |n| time(format!("--threads {n}")))
        .chain(isas.map(move |isa| time(format!("--isa {}", isa.name()))))
        // Surfaces on demand would all be made beforehand: there may be no end of them.
        .chain((mode != ModeArg::Reyes).then(|| time("--path general".into())))
        .chain(partitions.iter().map(move |how| time(format!("--path general --partition {how}"))))
        .chain(groups.iter().map(move |group| time(format!("--group {group}"))))
}
