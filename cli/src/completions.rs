//! `tetralod completions`: scripts by which shells complete commands and options; and manual pages.

use anyhow::{Context, Result};
use clap::CommandFactory;
use clap_complete::Shell;
use std::io::Write;
use std::path::PathBuf;

/// Prints the script by which a shell completes the options of this command, or writes its manual pages.
#[derive(clap::Args)]
pub struct Arguments {
    /// The shell.
    #[arg(required_unless_present = "man", conflicts_with = "man")]
    shell: Option<Shell>,
    /// Write the manual pages into this folder, which must be there, a page for each subcommand: tetralod.1, tetralod-build.1, ...
    #[arg(long, value_name = "DIR")]
    man: Option<PathBuf>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let mut command = crate::Arguments::command();
    if let Some(shell) = arguments.shell {
        let mut script = Vec::new();
        clap_complete::generate(shell, &mut command, "tetralod", &mut script);
        return Ok(std::io::stdout().write_all(&script)?);
    }
    let folder = arguments.man.as_ref().context("--man DIR is missing")?;
    clap_mangen::generate_to(command, folder).with_context(|| folder.display().to_string())
}
