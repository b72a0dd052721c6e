//! Wrong usage that the definition of the command line does not show: options that do not go together.

use clap::Command;
use clap::error::ErrorKind;
use std::sync::OnceLock;

/// The definition of the command line, which `main` sets: messages are those of its subcommands, and these use this file.
static DEFINITION: OnceLock<fn() -> Command> = OnceLock::new();

/// Says how the command line is defined, once.
pub fn define(command: fn() -> Command) {
    DEFINITION.get_or_init(|| command);
}

/// Ends the program as wrong usage, with a word about what to do instead.
pub fn refuse_usage(what: &str) -> ! {
    let mut command = DEFINITION.get().map_or_else(|| Command::new("tetralod"), |define| define());
    command.build();
    let name = std::env::args().nth(1).unwrap_or_default();
    match command.find_subcommand_mut(&name) {
        Some(subcommand) => subcommand.error(ErrorKind::ArgumentConflict, what).exit(),
        None => command.error(ErrorKind::ArgumentConflict, what).exit(),
    }
}
