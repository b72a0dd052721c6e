//! `cargo xtask test`: every check there is, in order of cost; but the npm package is built beside the native tests. Each step
//! prints a header and its time; the first that fails ends the run. Nothing is left out because something is missing on the machine, but for the tests of
//! real data where `TETRALOD_DATA` names none: cargo counts these as ignored.
//!
//! A feature set of its own compiles the crate and what it needs again. So lints, documentation, tests and the command that
//! makes the tests' data share one ([`shell::ALL`]); further ones are only linted, and only where a mistake would not show in it.

use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow, ensure};

use crate::{browser, demo, docs, fixture, package, shell, workflows};

struct Step {
    name: &'static str,
    what: &'static str,
    run: fn() -> Result<()>,
}

const STEPS: [Step; 14] = [
    Step { name: "fmt", what: "formatting", run: fmt },
    Step { name: "clippy", what: "lints of everything native", run: clippy },
    Step { name: "features", what: "lints of the feature sets that are shipped", run: features },
    Step { name: "doc", what: "documentation without broken links", run: doc },
    Step { name: "native", what: "unit, integration and documentation tests", run: native },
    Step { name: "workflows", what: "building in parts, with a process killed", run: workflows::test },
    Step { name: "package", what: "the npm package, compiled as the tests are", run: npm_package },
    Step { name: "wasm", what: "the core and a WebGPU adapter in headless Chromium", run: wasm },
    Step { name: "js", what: "lints and types of all JavaScript, and the package in Node", run: js },
    Step { name: "consumer", what: "installing and type-checking the packed package", run: consumer },
    Step {
        name: "site",
        what: "the documentation's site: its links, and that it needs no network",
        run: site,
    },
    Step { name: "pages", what: "the examples of README.md and docs/ in Node and Chromium", run: pages },
    Step { name: "examples", what: "building the example projects, and their pictures", run: examples },
    Step { name: "e2e", what: "the package and the demo page in headless browsers", run: e2e },
];

/// What `--quick` runs.
const QUICK: [Step; 3] = [
    Step { name: "fmt", what: "formatting", run: fmt },
    Step { name: "clippy", what: "lints of everything native", run: clippy },
    Step {
        name: "quick",
        what: "unit and integration tests, without the longest ones and without real data",
        run: quick,
    },
];

/// Runs the steps named in `args`, or all, or with `--quick` those few that find most mistakes.
pub fn run(args: &[String]) -> Result<()> {
    if args == ["--list"] {
        STEPS.iter().for_each(|step| println!("{:<10} {}", step.name, step.what));
        return Ok(());
    }
    if args == ["--quick"] {
        return run_all(QUICK.iter());
    }
    if let Some(unknown) = args.iter().find(|name| STEPS.iter().all(|step| step.name != name.as_str())) {
        anyhow::bail!("there is no step `{unknown}`; `cargo xtask test --list` names them");
    }
    run_all(STEPS.iter().filter(|step| args.is_empty() || args.iter().any(|name| name == step.name)))
}

fn run_all<'a>(steps: impl Iterator<Item = &'a Step>) -> Result<()> {
    let steps: Vec<_> = steps.collect();
    let mut times = Vec::new();
    let mut package = None;
    for step in &steps {
        println!("\n=== {}: {}", step.name, step.what);
        let start = Instant::now();
        if step.name == "native" && steps.iter().any(|later| later.name == "package") {
            // Its modules are linked on one core each, and so end the last of the tests.
            println!("(the npm package is built meanwhile)");
            package = Some(thread::spawn(npm_package));
        }
        let built = if step.name == "package" { package.take() } else { None };
        let done = match built {
            Some(built) => built.join().map_err(|_| anyhow!("its thread panicked")).flatten(),
            None => (step.run)(),
        };
        if let Err(error) = done {
            // Nothing is left running.
            let _ = package.map(thread::JoinHandle::join);
            return Err(error.context(format!("step `{}` failed", step.name)));
        }
        println!("--- {}: {:.1} s", step.name, start.elapsed().as_secs_f64());
        times.push((step.name, start.elapsed()));
    }
    summarise(&times);
    Ok(())
}

fn summarise(times: &[(&str, Duration)]) {
    println!("\nall {} steps passed", times.len());
    for (name, time) in times {
        println!("{name:<10} {:>7.1} s", time.as_secs_f64());
    }
    println!("{:<10} {:>7.1} s", "total", times.iter().map(|(_, time)| time.as_secs_f64()).sum::<f64>());
}

fn fmt() -> Result<()> {
    shell::run(&mut shell::cargo(["fmt", "--all", "--", "--check"]))
}

fn clippy() -> Result<()> {
    let mut command = shell::cargo(["clippy", "--all-targets"]);
    shell::run(command.args(shell::ALL).args(["--", "-D", "warnings"]))?;
    let mut command = shell::cargo(["clippy", "--package", "xtask", "--all-features", "--all-targets"]);
    shell::run(command.args(["--", "-D", "warnings"]))
}

/// The core alone, which must not need any feature; with the builders, as `paper` has it; the command as the demo makes it; and of the
/// package the builder, and all else with the tests in the browser. That each of its modules has no code which it does not need is for the
/// package's own build, which takes no warnings.
fn features() -> Result<()> {
    lint_library("", &[])?;
    lint_library("build", &[])?;
    let command = ["clippy", "--package", "tetralod-cli", "--no-default-features", "--", "-D", "warnings"];
    shell::run(&mut shell::cargo(command))?;
    shell::add_wasm_target()?;
    lint_library("web-build", &["--target", shell::WASM])?;
    with_fixture(|| {
        let args = ["clippy", "--package", "tetralod", "--lib", "--test", "web", "--target", shell::WASM];
        shell::run(fixture_env(shell::cargo(args).args(WEB_FEATURES).args(["--", "-D", "warnings"])))
    })
}

fn lint_library(features: &str, target: &[&str]) -> Result<()> {
    let mut command = shell::cargo(["clippy", "--package", "tetralod", "--lib", "--no-default-features"]);
    shell::run(command.args(["--features", features]).args(target).args(["--", "-D", "warnings"]))
}

fn doc() -> Result<()> {
    let mut command = shell::cargo(["doc", "--lib", "--no-deps"]);
    shell::run(command.args(shell::ALL).env("RUSTDOCFLAGS", "-D warnings"))
}

/// All that needs no browser. The tests that compare the renderer with its twin on the CPU show their output: how far they are apart.
fn native() -> Result<()> {
    browser::vulkan_driver()?;
    // Tests of real data are ignored otherwise.
    let with_data = std::env::var_os("TETRALOD_DATA").map(|_| "--include-ignored");
    let mut command = shell::cargo(["test"]);
    shell::run(command.args(shell::ALL).args(["--", "--skip", "gpu_matches_cpu"]).args(with_data))?;
    let mut command = shell::cargo(["test", "--test", "view"]);
    shell::run(command.args(shell::ALL).args(["gpu_", "--", "--nocapture"]).args(with_data))?;
    shell::run(&mut shell::cargo(["test", "--package", "xtask"]))
}

/// Words in the names of the longest tests, of five to seventeen seconds each: `--quick` leaves them out.
const LONG: [&str; 6] = [
    "reference_kinds::built_mts_are_read_alike",
    "behind_good_checksums_is_refused_or_read_faithfully",
    "header_and_index_are_small",
    "every_flipped_bit_is_detected",
    "vertices_inside_are_within_the_bound",
    "tet_errors::",
];

fn quick() -> Result<()> {
    let mut command = shell::cargo(["test", "--lib", "--bins", "--tests"]);
    command.args(shell::ALL).env_remove("TETRALOD_DATA").arg("--");
    shell::run(command.args(LONG.iter().flat_map(|name| ["--skip", name])))
}

fn npm_package() -> Result<()> {
    package::build_for_tests()
}

const WEB_FEATURES: [&str; 3] = ["--no-default-features", "--features", "web-bench,gpu,all-kinds"];

fn wasm() -> Result<()> {
    let browser = browser::require()?;
    shell::add_wasm_target()?;
    with_fixture(|| {
        let mut command = browser::wasm_tests(&browser, &["--package", "tetralod", "--test", "web"])?;
        shell::run(fixture_env(command.args(WEB_FEATURES)))
    })
}

fn with_fixture(then: impl FnOnce() -> Result<()>) -> Result<()> {
    fixture::make(&shell::tested_command()?).context("making the small MT that the tests use")?;
    then()
}

/// The tests find the fixture through this variable.
fn fixture_env(command: &mut Command) -> &mut Command {
    command.env("TETRALOD_FIXTURE", shell::root().join(fixture::FOLDER))
}

fn js() -> Result<()> {
    package::ensure_built(package::Profile::Tested)?;
    shell::run(&mut node_tool("@biomejs/biome/bin/biome", &["lint", "--error-on-warnings"]))?;
    shell::run(&mut node_tool("typescript/bin/tsc", &["--project", "tests/js"]))?;
    shell::run(&mut node_test("actions.test.js"))?;
    shell::run(&mut node_test("pack.test.js"))?;
    shell::run(&mut node_test("latest.test.js"))?;
    shell::run(&mut node_test("fit.test.js"))?;
    shell::run(&mut node_test("stored.test.js"))?;
    shell::run(&mut node_test("ranges.test.js"))?;
    shell::run(&mut node_test("writers.test.js"))?;
    shell::run(&mut node_test("tools.test.js"))?;
    shell::run(&mut node_test("bins.test.js"))?;
    shell::run(&mut node_test("policy.test.js"))?;
    with_fixture(|| {
        for name in [
            "package.test.js",
            "build.test.js",
            "parts.test.js",
            "steps.test.js",
            "places.test.js",
            "views.test.js",
        ] {
            shell::run(fixture_env(&mut node_test(name)))?;
        }
        Ok(())
    })
}

fn node_tool(path: &str, args: &[&str]) -> Command {
    let mut command = shell::command("node", [format!("tests/js/node_modules/{path}")]);
    command.args(args);
    command
}

fn node_test(file: &str) -> Command {
    let file = format!("tests/js/{file}");
    let mut command =
        shell::command("node", ["--test", "--test-reporter=spec", "--test-timeout=900000", &file]);
    // It would take the place of Chromium.
    command.env_remove("FIREFOX");
    command
}

/// Packs the package as npm would publish it, has its entries and types checked by publint and are-the-types-wrong, installs the
/// archive in a project of its own outside the repository's `node_modules`, and compiles and runs that project.
fn consumer() -> Result<()> {
    package::ensure_built(package::Profile::Tested)?;
    let (source, project) = (Path::new("tests/js/consumer"), shell::root().join("target/consumer"));
    if project.exists() {
        std::fs::remove_dir_all(&project)?;
    }
    std::fs::create_dir_all(&project)?;
    for entry in std::fs::read_dir(source)? {
        let entry = entry?;
        std::fs::copy(entry.path(), project.join(entry.file_name()))?;
    }
    let folder = project.to_string_lossy().into_owned();
    let packed = shell::output(
        shell::npm(["pack", "--silent", "--pack-destination", &folder]).current_dir(package::PKG),
    )?;
    let archive = project.join(packed.trim());
    ensure!(archive.is_file(), "npm pack said `{}` but wrote no such file", packed.trim());
    shell::run(&mut node_tool("publint/src/cli.js", &["--strict", package::PKG]))?;
    // The files that are no modules have no types; the scripts of workers export nothing.
    let untyped = [
        "--profile",
        "esm-only",
        "--exclude-entrypoints",
        "core.wasm",
        "all-kinds.wasm",
        "tools.wasm",
        "viewer.wasm",
        "build.wasm",
    ];
    shell::run(
        node_tool("@arethetypeswrong/cli/dist/index.js", &["--format", "table-flipped", "--no-emoji"])
            .args(["--no-color", "--quiet"])
            .arg(&archive)
            .args(untyped),
    )?;
    let install = ["install", "--no-save", "--offline", "--loglevel=error"];
    shell::run(shell::npm(install).arg(&archive).current_dir(&project))?;
    for settings in ["tsconfig.json", "tsconfig.es2020.json", "tsconfig.jsx.json", "tsconfig.jsx-global.json"]
    {
        shell::run(node_tool("typescript/bin/tsc", &["--project"]).arg(project.join(settings)))?;
    }
    with_fixture(|| shell::run(fixture_env(shell::command("node", ["dist/main.js"]).current_dir(&project))))
}

fn site() -> Result<()> {
    docs::build()?;
    shell::run(node_test("site.test.js").env("CHROMIUM", browser::require()?.chromium))
}

fn pages() -> Result<()> {
    package::ensure_built(package::Profile::Tested)?;
    shell::install_node_packages(Path::new(docs::SOURCES))?;
    let mut command = node_test("docs.test.js");
    command.env("TETRALOD", shell::tested_command()?).env("CHROMIUM", browser::require()?.chromium);
    shell::run(command.env("NGINX", browser::nginx()?))
}

/// The projects of `examples/js`, with the packed package, in headless Chromium and in Node.
fn examples() -> Result<()> {
    let browser = browser::require()?;
    package::ensure_built(package::Profile::Tested)?;
    with_fixture(|| shell::run(fixture_env(node_test("examples.test.js").env("CHROMIUM", &browser.chromium))))
}

fn e2e() -> Result<()> {
    let browser = browser::require()?;
    package::ensure_built(package::Profile::Tested)?;
    let tetralod = shell::tested_command()?;
    demo::make_data(&tetralod)?;
    let server = demo::start_server(&tetralod, 0)?;
    with_fixture(|| {
        let test = |name: &str, variable: &str, path: &Path| {
            shell::run(fixture_env(node_test(&format!("{name}-browser.test.js")).env(variable, path)))
        };
        for name in ["core", "ranges", "parts", "viewer", "places", "element", "build"] {
            test(name, "CHROMIUM", &browser.chromium)?;
        }
        let firefox = browser::firefox()?;
        println!("what needs no GPU, in Firefox");
        ["core", "ranges"].into_iter().try_for_each(|name| test(name, "FIREFOX", &firefox))
    })?;
    for name in ["e2e.test.js", "page.test.js", "drop.test.js"] {
        let mut command = node_test(name);
        shell::run(command.env("TETRALOD_PAGE", &server.address).env("CHROMIUM", &browser.chromium))?;
    }
    Ok(())
}
