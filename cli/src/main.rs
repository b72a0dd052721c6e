//! The command `tetralod`: builds MT files, looks into them, takes meshes and pictures out of them, checks
//! and times them.
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
mod serve;
mod slice;
mod stats;
mod steps;
mod streamlines;
mod surface;
mod usage;
mod verify;
mod view;

use clap::{CommandFactory, Parser, Subcommand};
use std::process::ExitCode;
use usage::refuse_usage;

/// Very large tetrahedral volumes for web pages: builds, inspects and checks MT files.
#[derive(Parser)]
#[command(name = "tetralod", version, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Generate(generate::Arguments),
    Build(Box<build::Arguments>),
    Part(Box<part::Arguments>),
    Join(join::Arguments),
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
    Verify(verify::Arguments),
    Bench(bench::Arguments),
    Serve(serve::Arguments),
    View(view::Arguments),
    Completions(completions::Arguments),
}

/// Lets glibc give freed memory back: by default it keeps some in an arena for each thread, and takes large arrays from the heap once one
/// has been freed. A build of 1.6 million tetrahedra takes a sixth to a third less memory with this, and no more time.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn keep_little_freed_memory() {
    const LARGE: libc::c_int = 1 << 20;
    let arenas = std::thread::available_parallelism().map_or(1, usize::from) / 4;
    let arenas = libc::c_int::try_from(arenas.max(2)).unwrap_or(2);
    // SAFETY: mallopt takes two numbers; no other thread runs yet. What it does not know it leaves as it was.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE);
        libc::mallopt(libc::M_ARENA_MAX, arenas);
    }
}

fn main() -> ExitCode {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    keep_little_freed_memory();
    usage::define(Arguments::command);
    match run(Arguments::parse().command) {
        Ok(code) => code,
        Err(error) => {
            output::note(&format!("error: {error:#}"));
            ExitCode::FAILURE
        }
    }
}

fn run(command: Command) -> anyhow::Result<ExitCode> {
    // Serving has a handler of its own for Ctrl-C; there can be only one.
    if !matches!(command, Command::Serve(_) | Command::View(_)) {
        files::remove_partial_output_on_interrupt()?;
    }
    match command {
        Command::Generate(arguments) => generate::run(&arguments)?,
        Command::Build(arguments) => build::run(&arguments)?,
        Command::Part(arguments) => part::run(&arguments)?,
        Command::Join(arguments) => join::run(&arguments)?,
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
        Command::Serve(arguments) => serve::run(&arguments)?,
        Command::View(arguments) => view::run(&arguments)?,
        Command::Completions(arguments) => completions::run(&arguments)?,
    }
    Ok(ExitCode::SUCCESS)
}
