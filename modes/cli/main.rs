//! The command `umbel`.

mod args;
mod bake;
mod common;
mod documents;
mod file_names;
mod forecast;
mod info;
mod interrupt;
mod machine;
mod memory;
mod options;
mod picture;
mod probe;
mod process;
mod refusal;
mod render;
mod report;
mod reyes;
mod run;
mod shadow;
mod trade;
mod visible;

use std::process::ExitCode;

use clap::Parser;
use umbel::Error;

use crate::args::{Cli, Command};

fn main() -> ExitCode {
    let cli = Cli::parse_from(args::with_verb(std::env::args_os()));
    cli.common.color.write_global();
    interrupt::exit_on_interrupt();
    match run(&cli) {
        Ok(()) => {
            if let (true, Some(peak)) = (cli.common.verbose, process::peak_bytes()) {
                anstream::eprintln!("{peak} bytes of memory at most");
            }
            ExitCode::SUCCESS
        }
        Err(error) => {
            anstream::eprintln!("error: {}", refusal::message(&error));
            ExitCode::from(refusal::exit_code(&error))
        }
    }
}

/// Runs the verb on a pool of the wanted size.
fn run(cli: &Cli) -> Result<(), Error> {
    cli.command.files().writing(&cli.common.report).refuse_collisions()?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(cli.common.useful_threads()).build();
    let pool = pool.map_err(|error| Error::Usage(format!("--threads {}: {error}", cli.common.threads)))?;
    pool.install(|| match &cli.command {
        Command::Render(args) => render::render(args, &cli.common),
        Command::Probe(args) => probe::probe(args, &cli.common),
        Command::Visible(args) => visible::visible_triangles(args, &cli.common),
        Command::Shadow(args) => shadow::shadow(args, &cli.common),
        Command::Bake(args) => bake::bake(args, &cli.common),
        Command::Reyes(args) => reyes::reyes(args, &cli.common),
        Command::Trade(args) => trade::trade(args, &cli.common),
        Command::Verify(args) => render::verify_scene(args, &cli.common),
        Command::Info(args) => info::info_scene(args, &cli.common),
        Command::Completions { shell } => documents::print_completions(*shell),
        Command::Man { folder } => documents::write_man_pages(folder),
    })
}
