//! umbel-bench: umbel and other engines on the same triangles and rays, in one process and in turns.

#![cfg_attr(
    not(all(feature = "embree", feature = "llvmpipe", feature = "obvhs", feature = "parry")),
    allow(dead_code, reason = "some parts serve some engines only")
)]

mod ambient;
mod ambient_rays;
mod answer;
mod bounce;
mod bounce_rays;
mod cli;
mod cliff_subjects;
mod cliffs;
mod comparison;
mod crossover;
mod cube;
mod curves;
mod directions;
mod engine;
mod engines;
mod error;
mod error_curves;
mod estimates;
mod icosphere;
mod leaks;
mod machine;
mod morton;
mod partitions;
mod picture;
mod plot;
mod primary;
mod reference;
mod report;
mod reyes;
mod reyes_growth;
mod rounds;
mod shadow;
mod shadow_rays;
mod sheets;
mod subject;
mod surface_points;
mod table;
mod umbel_engine;
mod view_rays;
mod views;

#[cfg(feature = "embree")]
mod embree;
#[cfg(feature = "embree")]
mod embree_ambient;
#[cfg(feature = "embree")]
mod embree_api;
#[cfg(feature = "embree")]
mod embree_bounce;
#[cfg(feature = "embree")]
mod embree_engine;
#[cfg(feature = "llvmpipe")]
mod gl_api;
#[cfg(feature = "llvmpipe")]
mod gl_context;
#[cfg(feature = "llvmpipe")]
mod gl_raster;
#[cfg(feature = "llvmpipe")]
mod llvmpipe_engine;
#[cfg(feature = "obvhs")]
mod obvhs_engine;
#[cfg(feature = "parry")]
mod parry_engine;

use std::process::ExitCode;

use clap::Parser;

/// What can go wrong here is told, not handled.
pub(crate) type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn main() -> ExitCode {
    match run(&cli::Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("umbel-bench: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Sets up the threads that all engines trace with, then runs the command.
fn run(cli: &cli::Cli) -> Result<()> {
    rayon::ThreadPoolBuilder::new().num_threads(cli.common.threads).build_global()?;
    match &cli.command {
        cli::Command::Primary(args) => primary::run(args, &cli.common),
        cli::Command::Cube(args) => cube::run(args, &cli.common),
        cli::Command::Shadow(args) => shadow::run(args, &cli.common),
        cli::Command::Ambient(args) => ambient::run(args, &cli.common),
        cli::Command::Bounce(args) => bounce::run(args, &cli.common),
        cli::Command::Partitions(args) => partitions::run(args, &cli.common),
        cli::Command::Error(args) => error::run(args, &cli.common),
        cli::Command::Reyes(args) => reyes::run(args, &cli.common),
        cli::Command::ReyesGrowth(args) => reyes_growth::run(args),
        cli::Command::Leaks(args) => leaks::run(args, &cli.common),
        cli::Command::Cliffs(args) => cliffs::run(args),
    }
}
