//! The project's own commands, behind `cargo xtask`: everything that a fresh machine with Rust, Node and git needs to
//! build the package, show the demo, run every check and measure.
#![forbid(unsafe_code)]

mod bench;
mod bench_beside_vtk;
mod bench_build;
mod bench_format;
mod bench_pictures;
mod browser;
mod demo;
mod docs;
mod fixture;
mod fixture_builds;
mod licences;
mod package;
mod paper;
mod random;
mod release;
mod serve;
mod shell;
mod suite;
mod volumes;

use std::process::ExitCode;

use anyhow::{Result, bail};

const USAGE: &str = "\
usage: cargo xtask COMMAND

  build                          build the npm package into pkg/
  demo [--port N] [--no-serve] [--small]   build everything, make the demo's data, serve the page on localhost; a large
                                 volume is made in the background, unless with --small
  docs                           make the documentation's site in target/docs
  test [STEP...]                 every check, or the named steps; `test --list` names them
  test --quick                   formatting, lints and native tests; not: other feature sets, documentation, the longest
                                 tests, real data, JavaScript, wasm, browsers
  release [vX.Y.Z]               check that everything can be published, as this version; publishes nothing
  random [MINUTES]               the tests with random inputs for 30 minutes, each time with another TETRALOD_SEED
  bench [FILE.mt] [--browser]    measure decoding, refinement and isosurfaces; natively, or also in the browser
  bench --build [--large]        measure triangulation, insertion and the kinds of MT side by side
  bench --format                 measure MT files and what requests need of them; writes docs/benchmarks.md
  bench --pictures [OPTION...]   measure the renderer in each mode, on the GPU or in software; writes its part of
                                 docs/benchmarks.md. Options: --size WxH --tets N,N,... --grid N --file FILE.mt
                                 --pictures N --modes A,B,...
  bench --beside-vtk             measure the same volumes in a browser with VTK's programs; writes docs/beside-vtk.md
  paper                          do the paper's experiments again and write docs/paper.md with plots and pictures";

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<()> {
    // The first argument is the program itself.
    let args: Vec<String> = std::env::args().skip(1).collect();
    let Some((command, rest)) = args.split_first() else { bail!("{USAGE}") };
    // The test runner is called by cargo from the folder of the package under test, with paths relative to it.
    if command == browser::RUNNER {
        return browser::run_wasm_tests(rest);
    }
    std::env::set_current_dir(shell::root())?;
    match command.as_str() {
        "build" => package::build(rest),
        "demo" => demo::run(rest),
        "docs" => docs::run(rest),
        "test" => suite::run(rest),
        "bench" => bench::run(rest),
        "paper" => paper::run(rest),
        "random" => random::run(rest),
        "release" => release::run(rest),
        other => bail!("there is no command `{other}`\n{USAGE}"),
    }
}
