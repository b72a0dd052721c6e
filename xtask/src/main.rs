//! The project's own commands, behind `cargo xtask`: everything that a fresh machine with Rust, Node, Python and git needs to
//! build the package, show the demo, run every check and measure.
#![forbid(unsafe_code)]

mod animation;
mod bench;
mod bench_against_vtk;
mod bench_beside_vtk;
mod bench_build;
mod bench_first_visit;
mod bench_format;
mod bench_kinds;
mod bench_network;
mod bench_parts;
mod bench_pictures;
mod benchmarks_page;
mod browser;
mod demo;
mod docs;
mod fixture;
mod fixture_builds;
mod licences;
mod package;
mod pages;
mod paper;
mod planted;
mod public_api;
mod python;
mod random;
mod release;
mod release_files;
mod serve;
mod shell;
mod suite;
mod venv;
mod volumes;
mod workflows;

use std::process::ExitCode;

use anyhow::{Result, bail};

const USAGE: &str = "\
usage: cargo xtask COMMAND

  build                          build the npm package into pkg/
  build MODULE...                only some of its wasm modules: core, viewer, build
  demo [--port N] [--no-serve] [--small]   build everything, make the demo's data, serve the page on localhost; a large
                                 volume is made in the background, unless with --small
  wheel [--OPTION...]            build the wheel of the Python package into target/python/released; options are maturin's
  vscode                         pack the extension for VS Code as target/release-files/tetralod.vsix
  docs                           make the documentation's site in target/docs
  pages [--small]                make the demo and the documentation's site as one folder of static files, target/pages;
                                 with --small without the large volume
  animation                      record the picture that README.md begins with, docs/flow-past-sphere.gif, in the demo's page
  test [STEP...]                 every check, or the named steps; `test --list` names them
  test --quick                   formatting, lints and native tests; not: documentation, the longest tests, real data,
                                 JavaScript, wasm, browsers
  archive                        pack the command for this machine, with its page, manual pages and completions, in target/release-files
  release [vX.Y.Z]               check that everything can be published, as this version, and make target/release-files: archives
                                 with checksums, recipes for conda and Homebrew; publishes nothing
  random [MINUTES]               the tests with random inputs for 30 minutes, each time with another TETRALOD_SEED
  planted [WORD...]              plant faults in a copy of the library, all or those with a word in their names or files: a
                                 test has to find each
  bench [FILE.mt] [--browser]    measure decoding, refinement and isosurfaces; natively, or also in the browser
  bench --kinds [--large]        measure triangulation, insertion and the kinds of MT side by side
  bench --all                    measure all of the following: writes docs/benchmarks.md and docs/beside-vtk.md. Takes hours
  bench --format                 measure MT files and what first pictures need of them
  bench --network [SET...]       measure what requests cost over a network; a SET is a file or bucky:N
  bench --build [SIZE...]        measure builds of grids with SIZE³ points, whole and in parts, beside VTK's decimation
  bench --parts [SIZE...]        measure how the steps of builds in parts grow, and what more workers bring
  bench --against-vtk [SET...]   measure meshes of equal size by VTK's decimation of tetrahedra, which comes from PyPI
  bench --first-visit [FILE.mt]  measure how soon the demo's page shows what; of a file, what its requests take over a network
  bench --pictures [OPTION...]   measure the renderer in each mode, on the GPU or in software. Options: --size WxH
                                 --tets N,N,... --grid N --file FILE.mt --pictures N --modes A,B,...
  bench --beside-vtk             measure the same volumes in a browser with VTK's programs
  paper                          do the paper's experiments again and write docs/paper.md with plots and pictures";

fn main() -> ExitCode {
    let done = public_api::as_rustdoc().unwrap_or_else(|| run().map(|()| ExitCode::SUCCESS));
    match done {
        Ok(code) => code,
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
    std::env::set_current_dir(shell::root())?;
    match command.as_str() {
        "build" => package::build(rest),
        "demo" => demo::run(rest),
        "wheel" => python::wheel(rest),
        "vscode" => package::pack_extension(),
        "docs" => docs::run(rest),
        "pages" => pages::run(rest),
        "animation" => animation::run(rest),
        "test" => suite::run(rest),
        "bench" => bench::run(rest),
        "paper" => paper::run(rest),
        "planted" => planted::run(rest),
        "random" => random::run(rest),
        "release" => release::run(rest),
        "archive" => {
            package::ensure_built(package::Profile::Released)?;
            release_files::archive()
        }
        other => bail!("there is no command `{other}`\n{USAGE}"),
    }
}
