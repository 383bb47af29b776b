//! What the command says of itself: completions for shells and manual pages, made from the definition of its options.

use std::fs;
use std::io;
use std::path::Path;

use clap::CommandFactory as _;
use clap_complete::Shell;
use umbel::Error;
use umbel::files::write_atomically;

use crate::args::Cli;
use crate::run::print;

/// Prints the script for a shell.
pub(crate) fn print_completions(shell: Shell) -> Result<(), Error> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "umbel", &mut script);
    print(&String::from_utf8_lossy(&script))
}

/// Writes a page for the command and one for each verb: umbel.1, umbel-render.1 and so on.
pub(crate) fn write_man_pages(folder: &Path) -> Result<(), Error> {
    let refused = |error: io::Error| Error::Write { path: folder.to_owned(), problem: error.to_string() };
    fs::create_dir_all(folder).map_err(refused)?;
    let mut command = Cli::command();
    command.build();
    let verbs: Vec<_> = command.get_subcommands().filter(|verb| verb.get_name() != "help").cloned().collect();
    for command in std::iter::once(command).chain(verbs) {
        let name = command.get_display_name().unwrap_or(command.get_name()).to_owned();
        let page = clap_mangen::Man::new(command);
        write_atomically(&folder.join(format!("{name}.1")), |out| page.render(out))?;
    }
    Ok(())
}
