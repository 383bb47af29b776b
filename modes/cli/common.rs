//! The options that every verb has.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use umbel::engine::{Accuracy, Isa, Partition};
use umbel::{LoadOptions, Options, Path};

use crate::options::parse::parse_bytes;
use crate::process::resident_bytes;

/// Options of every verb.
#[derive(Debug, Args)]
#[command(next_help_heading = "Common options")]
pub(crate) struct Common {
    /// Worker threads; 0 takes all processors. Never changes an output
    #[arg(long, global = true, default_value_t = 0, value_name = "N", env = "UMBEL_THREADS")]
    pub(crate) threads: usize,

    /// exact: every decision as in exact arithmetic. fast: rounded decisions
    #[arg(
        long,
        global = true,
        help_heading = "Engine",
        hide_short_help = true,
        value_enum,
        default_value = "exact"
    )]
    pub(crate) accuracy: AccuracyArg,

    /// pencil: one bound stands for many rays. general: every ray by itself. Both give the same output
    #[arg(
        long,
        global = true,
        help_heading = "Engine",
        hide_short_help = true,
        value_enum,
        default_value = "pencil"
    )]
    pub(crate) path: PathArg,

    /// How --path general divides triangles: at the middle of the longest side, as the file gives them, by space, or by cost
    /// from a sample of the rays. Never changes an output; only time, and the memory of spatial
    #[arg(
        long,
        global = true,
        help_heading = "Engine",
        hide_short_help = true,
        value_enum,
        default_value = "middle"
    )]
    pub(crate) partition: PartitionArg,

    /// Instructions of the kernels. Never changes an output; what the machine lacks is refused
    #[arg(
        long,
        global = true,
        help_heading = "Engine",
        hide_short_help = true,
        value_enum,
        default_value = "auto"
    )]
    pub(crate) isa: IsaArg,

    /// Write counts, times and a hash of the outputs as JSON; - for stdout
    #[arg(long, global = true, value_name = "FILE.json")]
    pub(crate) report: Option<PathBuf>,

    /// Run the engine N times on the loaded scene, for timing
    #[arg(long, global = true, help_heading = "Engine", hide_short_help = true, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) repeat: u32,

    /// With --repeat: start from the triangle order that the run before has found, and from nothing else
    #[arg(long, global = true, help_heading = "Engine", hide_short_help = true)]
    pub(crate) keep_order: bool,

    /// Stop before starting when more memory than this would be needed, such as 500M or 8G
    #[arg(long, global = true, value_name = "BYTES", value_parser = parse_bytes)]
    pub(crate) max_memory: Option<u64>,

    /// Leave out triangles with NaN or infinite positions, with a warning, instead of refusing the scene
    #[arg(long, global = true)]
    pub(crate) drop_non_finite: bool,

    /// Open what the scene's file names in other folders than its own, too: buffers and material libraries
    #[arg(long, global = true)]
    pub(crate) allow_outside: bool,

    /// Say nothing but errors
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,

    /// Print times and counters on stderr
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    pub(crate) verbose: bool,

    #[command(flatten)]
    pub(crate) color: colorchoice_clap::Color,
}

/// Threads for each processor beyond which more of them only cost memory and time to start. A few more than one may
/// help where the system gives processors to others as well.
const THREADS_PER_PROCESSOR: usize = 4;
/// Threads that are never refused: outputs can be compared over numbers of threads on a small machine, too.
const ALWAYS_GRANTED: usize = 16;

impl Common {
    /// The number of threads to start: what was asked for, up to a multiple of the processors. Says so where that is less.
    pub(crate) fn useful_threads(&self) -> usize {
        let processors = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let most = (THREADS_PER_PROCESSOR * processors).max(ALWAYS_GRANTED);
        if self.threads > most && !self.quiet {
            anstream::eprintln!(
                "warning: --threads {}: more than {most} are of no use on {processors} processors; {most} are started",
                self.threads
            );
        }
        self.threads.min(most)
    }

    /// Those options that a run of another verb on the same scene has to have as well.
    pub(crate) fn words(&self) -> Vec<String> {
        let threads = (self.threads > 0).then(|| ["--threads".to_owned(), self.threads.to_string()]);
        let dropped = self.drop_non_finite.then(|| "--drop-non-finite".to_owned());
        let outside = self.allow_outside.then(|| "--allow-outside".to_owned());
        threads.into_iter().flatten().chain(dropped).chain(outside).collect()
    }

    /// How scenes are read.
    pub(crate) fn load_options(&self) -> LoadOptions {
        LoadOptions {
            drop_non_finite: self.drop_non_finite,
            allow_outside: self.allow_outside,
            // The program itself is there already.
            max_memory: self.max_memory.map(|limit| limit.saturating_sub(resident_bytes().unwrap_or(0))),
        }
    }

    /// The engine's options.
    pub(crate) fn options(&self) -> Options {
        Options {
            path: match self.path {
                PathArg::Pencil => Path::Pencil,
                PathArg::General => Path::General,
            },
            partition: match self.partition {
                PartitionArg::Middle => Partition::Middle,
                PartitionArg::Given => Partition::Given,
                PartitionArg::Spatial => Partition::Spatial,
                PartitionArg::Sampled => Partition::Sampled,
            },
            accuracy: match self.accuracy {
                AccuracyArg::Exact => Accuracy::Exact,
                AccuracyArg::Fast => Accuracy::Fast,
            },
            isa: match self.isa {
                IsaArg::Auto => Isa::Auto,
                IsaArg::Sse2 => Isa::Sse2,
                IsaArg::Sse42 => Isa::Sse42,
                IsaArg::Avx2 => Isa::Avx2,
                IsaArg::Avx512 => Isa::Avx512,
                IsaArg::Neon => Isa::Neon,
            },
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum IsaArg {
    Auto,
    Sse2,
    #[value(name = "sse4.2")]
    Sse42,
    Avx2,
    Avx512,
    Neon,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum AccuracyArg {
    Exact,
    Fast,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PathArg {
    Pencil,
    General,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PartitionArg {
    Middle,
    Given,
    Spatial,
    Sampled,
}
