//! umbel-bench: umbel and other engines on the same triangles and rays, in one process and in turns.

#![cfg_attr(
    not(all(feature = "embree", feature = "llvmpipe", feature = "obvhs", feature = "parry")),
    allow(dead_code, reason = "some parts serve some engines only")
)]

mod commands;
mod engines;
mod machine;
mod report;
mod subjects;

use std::process::ExitCode;

use clap::Parser;

use commands::{
    ambient, bounce, cli, cliffs, coincident, cube, error, leaks, partitions, primary, reyes, reyes_growth,
    shadow,
};

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
        cli::Command::Coincident(args) => coincident::run(args),
    }
}
