//! Wrong usage that the definition of the command line does not show: options that do not go together.

use clap::Command;
use clap::error::ErrorKind;
use std::sync::OnceLock;

/// The definition of the command line, which [`run`](crate::run) sets, and the subcommand that was given: messages are those of its
/// subcommands, and these use this file.
static DEFINITION: OnceLock<(fn() -> Command, String)> = OnceLock::new();

/// Says how the command line is defined, and which subcommand was given, once.
pub fn define(command: fn() -> Command, subcommand: String) {
    DEFINITION.get_or_init(|| (command, subcommand));
}

/// Ends the program as wrong usage, with a word about what to do instead.
pub fn refuse_usage(what: &str) -> ! {
    let (mut command, name) = match DEFINITION.get() {
        Some((define, subcommand)) => (define(), subcommand.as_str()),
        None => (Command::new("tetralod"), ""),
    };
    command.build();
    match command.find_subcommand_mut(name) {
        Some(subcommand) => subcommand.error(ErrorKind::ArgumentConflict, what).exit(),
        None => command.error(ErrorKind::ArgumentConflict, what).exit(),
    }
}
