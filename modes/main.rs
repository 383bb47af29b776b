//! The command `umbel`.

mod bake_args;
mod bake_command;
mod bake_dial;
mod bake_files;
#[cfg_attr(not(feature = "gltf"), path = "bake_no_gltf.rs")]
mod bake_gltf;
mod bake_sample;
mod bake_sampling_args;
mod bake_source;
mod bounce_args;
mod camera_args;
mod cli;
mod commands;
mod dial_args;
mod interrupt;
mod knobs;
mod machine;
mod parse;
mod picture;
mod picture_args;
mod probe_args;
mod probe_command;
mod report;
mod reyes_args;
mod reyes_command;
mod shadow_args;
mod shadow_command;
mod shadow_dial;
mod shadow_files;
mod shadow_report;
mod shadow_scene;
mod trade_args;
mod trade_command;
mod trade_html;
mod trade_picture;
mod trade_plot;
mod trade_report;
mod trade_subject;
mod trade_words;
mod views;
mod visible_command;

use std::process::ExitCode;

use clap::Parser;
use umbel::Error;

use crate::cli::{Cli, Command};

fn main() -> ExitCode {
    let cli = Cli::parse();
    cli.common.color.write_global();
    interrupt::exit_on_interrupt();
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            anstream::eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

/// Runs the verb on a pool of the wanted size.
fn run(cli: &Cli) -> Result<(), Error> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(cli.common.threads).build();
    let pool = pool.map_err(|error| Error::Usage(format!("--threads {}: {error}", cli.common.threads)))?;
    pool.install(|| match &cli.command {
        Command::Render(args) => commands::render(args, &cli.common),
        Command::Probe(args) => probe_command::probe(args, &cli.common),
        Command::Visible(args) => visible_command::visible_triangles(args, &cli.common),
        Command::Shadow(args) => shadow_command::shadow(args, &cli.common),
        Command::Bake(args) => bake_command::bake(args, &cli.common),
        Command::Reyes(args) => reyes_command::reyes(args, &cli.common),
        Command::Trade(args) => trade_command::trade(args, &cli.common),
        Command::Verify(args) => commands::verify_scene(args, &cli.common),
        Command::Info(args) => commands::info_scene(args, &cli.common),
    })
}
