//! The command `tetralod`: builds MT files, looks into them, takes meshes and pictures out of them, checks
//! and times them. As a library it is [`run`] alone: the Python package has the command, too.
//!
//! One file a subcommand, each with its arguments and a `run`. Exit codes: 0 done, 1 failed (or a check failed),
//! 2 wrong usage, 130 interrupted. Results go to stdout, everything else to stderr.

mod bench;
mod build;
mod completions;
mod convert;
mod deform;
mod extract;
mod extremes;
mod files;
mod generate;
mod html;
mod info;
mod input;
mod isosurface;
mod join;
mod machine;
mod needs;
mod npz;
mod output;
mod parse;
mod part;
mod parts;
mod poly;
mod probe;
mod progress;
mod query;
mod remedies;
mod render;
mod repair;
mod restrictions;
mod scratch;
mod serve;
mod shards;
mod slice;
mod stats;
mod status;
mod steps;
mod streamlines;
mod surface;
mod usage;
mod verify;
mod view;
mod work;

use clap::{CommandFactory, Parser, Subcommand};
use std::ffi::OsString;
use usage::refuse_usage;

/// Results of simulations and scans with millions of tetrahedra in a web page: `tetralod view FILE` shows one. Builds, inspects, draws and checks MT files.
#[derive(Parser)]
#[command(name = "tetralod", version, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    View(view::Arguments),
    Generate(generate::Arguments),
    Build(Box<build::Arguments>),
    Part(Box<part::Arguments>),
    Join(join::Arguments),
    Work(work::Arguments),
    Status(status::Arguments),
    Convert(convert::Arguments),
    Info(info::Arguments),
    Extract(Box<extract::Arguments>),
    Isosurface(Box<isosurface::Arguments>),
    Slice(Box<slice::Arguments>),
    Surface(Box<surface::Arguments>),
    Probe(Box<probe::Arguments>),
    Streamlines(Box<streamlines::Arguments>),
    Stats(Box<stats::Arguments>),
    Render(Box<render::Arguments>),
    Html(Box<html::Arguments>),
    Verify(verify::Arguments),
    Bench(bench::Arguments),
    Serve(serve::Arguments),
    Completions(completions::Arguments),
}

/// Runs the command with these arguments, of which the first is its name, and gives its exit code. `again` is the program that runs it in
/// another process, with the arguments that this takes first.
///
/// It ends the process itself where the usage is wrong or help is asked for, and at Ctrl-C.
pub fn run(arguments: impl IntoIterator<Item = OsString>, again: &[OsString]) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let subcommand = arguments.get(1).map(|word| word.to_string_lossy().into_owned());
    usage::define(Arguments::command, subcommand.unwrap_or_default());
    match run_command(
        Arguments::parse_from(&arguments).command,
        arguments.get(2..).unwrap_or_default(),
        again,
    ) {
        Ok(code) => code,
        Err(error) => {
            output::note_error(&error);
            output::FAILED
        }
    }
}

/// Runs a subcommand, whose arguments `words` were.
fn run_command(command: Command, words: &[OsString], again: &[OsString]) -> anyhow::Result<u8> {
    // Serving has a handler of its own for Ctrl-C; there can be only one.
    if !matches!(command, Command::Serve(_) | Command::View(_)) {
        files::remove_partial_output_on_interrupt()?;
    }
    match command {
        Command::Generate(arguments) => generate::run(&arguments)?,
        Command::Build(arguments) => build::run(&arguments)?,
        Command::Part(arguments) => part::run(&arguments, words)?,
        Command::Join(arguments) => join::run(&arguments)?,
        Command::Work(arguments) => work::run(&arguments, again)?,
        Command::Status(arguments) => status::run(&arguments)?,
        Command::Convert(arguments) => convert::run(&arguments)?,
        Command::Info(arguments) => info::run(&arguments)?,
        Command::Verify(arguments) => return verify::run(&arguments),
        Command::Bench(arguments) => bench::run(&arguments)?,
        Command::Extract(arguments) => extract::run(&arguments)?,
        Command::Isosurface(arguments) => isosurface::run(&arguments)?,
        Command::Slice(arguments) => slice::run(&arguments)?,
        Command::Surface(arguments) => surface::run(&arguments)?,
        Command::Probe(arguments) => probe::run(&arguments)?,
        Command::Streamlines(arguments) => streamlines::run(&arguments)?,
        Command::Stats(arguments) => stats::run(&arguments)?,
        Command::Render(arguments) => render::run(&arguments)?,
        Command::Html(arguments) => html::run(&arguments)?,
        Command::Serve(arguments) => serve::run(&arguments)?,
        Command::View(arguments) => view::run(&arguments, again)?,
        Command::Completions(arguments) => completions::run(&arguments)?,
    }
    Ok(0)
}
