//! `cargo xtask test`: every check there is. Steps that need nothing of each other run side by side, each as a program of its own, whose
//! output is shown when it ends; the first that fails ends the run once those that run have ended. Nothing is left out because something is
//! missing on the machine, but for the tests of real data where `TETRALOD_DATA` names none: cargo counts these as ignored.
//!
//! Natively everything is compiled with one set of features ([`shell::ALL`]) and in the profile of the tests, for browsers likewise.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Child, Command};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

use crate::{browser, demo, docs, fixture, package, public_api, python, shell, workflows};

struct Step {
    name: &'static str,
    what: &'static str,
    /// The steps that must have passed before, where they are asked for at all: what they make is made by this step, too, if it is not there.
    after: &'static [&'static str],
    run: fn() -> Result<()>,
}

const fn step(
    name: &'static str,
    what: &'static str,
    after: &'static [&'static str],
    run: fn() -> Result<()>,
) -> Step {
    Step { name, what, after, run }
}

/// Those that take long, or that others wait for, come first.
const STEPS: [Step; 16] = [
    step("fmt", "formatting", &[], fmt),
    step(
        "compile",
        "the native tests and the command, and small MTs that it makes for other steps",
        &[],
        compile,
    ),
    step("package", "the npm package, compiled as the tests are", &[], npm_package),
    step("native", "unit, integration and documentation tests", &["compile"], native),
    step("e2e", "the package and the demo page in headless browsers", &["compile", "package"], e2e),
    step("clippy", "lints of everything native", &["compile"], clippy),
    step("lint-wasm", "lints of everything for browsers", &["package"], lint_wasm),
    step("wasm", "the core and a WebGPU adapter in headless Chromium", &["compile"], wasm),
    step(
        "js",
        "formatting, lints and types of all JavaScript, and the package in Node",
        &["compile", "package"],
        js,
    ),
    step(
        "python",
        "the Python package: its types, a wheel in environments of its own, and its widget in headless Chromium",
        &["compile", "package"],
        python::test,
    ),
    step("workflows", "building in parts, with a process killed", &["compile"], workflows::test),
    step("doc", "documentation without broken links, and the public names of the crates", &["compile"], doc),
    step("consumer", "installing and type-checking the packed package", &["compile", "package"], consumer),
    step("site", "the documentation's site: its links, and that it needs no network", &["package"], site),
    step("pages", "the examples of README.md and docs/ in Node and Chromium", &["compile", "package"], pages),
    step("examples", "building the example projects, and their pictures", &["compile", "package"], examples),
];

/// What `--quick` runs.
const QUICK: [Step; 3] = [
    step("fmt", "formatting", &[], fmt),
    step("clippy", "lints of everything native", &[], clippy),
    step("quick", "unit and integration tests, without the longest ones and without real data", &[], quick),
];

/// So many steps run at a time: each uses more than one core now and then, and none all the time.
const AT_A_TIME: usize = 2;

/// What the steps wrote.
const OUTPUT: &str = "target/test-output";

/// Runs the steps named in `args`, or all, or with `--quick` those few that find most mistakes.
pub fn run(args: &[String]) -> Result<()> {
    if args == ["--list"] {
        STEPS.iter().for_each(|step| println!("{:<10} {}", step.name, step.what));
        return Ok(());
    }
    if args == ["--quick"] {
        return QUICK.iter().try_for_each(run_here);
    }
    if let Some(unknown) = args.iter().find(|name| STEPS.iter().all(|step| step.name != name.as_str())) {
        bail!("there is no step `{unknown}`; `cargo xtask test --list` names them");
    }
    let chosen: Vec<&Step> =
        STEPS.iter().filter(|step| args.is_empty() || args.iter().any(|name| name == step.name)).collect();
    if args.is_empty() {
        install_programs()?;
    }
    match chosen[..] {
        [step] => run_here(step),
        _ => run_side_by_side(chosen),
    }
}

/// Installs what steps need of the system and is not there, one after the other: the system's installer lets in one at a time.
fn install_programs() -> Result<()> {
    browser::vulkan_driver()?;
    browser::require()?;
    browser::firefox()?;
    browser::display()?;
    browser::nginx()?;
    shell::add_wasm_target()?;
    shell::install_node_tools()
}

fn run_here(step: &Step) -> Result<()> {
    println!("\n=== {}: {}", step.name, step.what);
    (step.run)().with_context(|| format!("step `{}` failed", step.name))
}

/// A step that runs.
struct Running {
    step: &'static Step,
    child: Child,
    start: Instant,
}

fn run_side_by_side(mut waiting: Vec<&'static Step>) -> Result<()> {
    fs::create_dir_all(OUTPUT)?;
    let start = Instant::now();
    let (mut running, mut times, mut failed) = (Vec::new(), Vec::new(), None);
    while !running.is_empty() || failed.is_none() && !waiting.is_empty() {
        while failed.is_none() && running.len() < AT_A_TIME {
            let is_ahead = |name: &&str| {
                waiting.iter().any(|step| step.name == *name)
                    || running.iter().any(|one: &Running| one.step.name == *name)
            };
            let Some(next) = waiting.iter().position(|step| !step.after.iter().any(is_ahead)) else { break };
            running.push(started(waiting.remove(next))?);
        }
        thread::sleep(Duration::from_millis(200));
        let mut going_on = Vec::new();
        for mut one in running {
            match one.child.try_wait()? {
                None => going_on.push(one),
                Some(status) => {
                    times.push((one.step.name, one.start.elapsed()));
                    show(&one)?;
                    if !status.success() {
                        failed.get_or_insert(one.step.name);
                    }
                }
            }
        }
        running = going_on;
    }
    if let Some(name) = failed {
        bail!("step `{name}` failed: see above, or {OUTPUT}/{name}.txt");
    }
    summarise(&times, start.elapsed());
    Ok(())
}

fn started(step: &'static Step) -> Result<Running> {
    println!("... {}: {}", step.name, step.what);
    let output = File::create(format!("{OUTPUT}/{}.txt", step.name))?;
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["test", step.name]).stdout(output.try_clone()?).stderr(output);
    Ok(Running { step, child: command.spawn()?, start: Instant::now() })
}

/// Prints what a step wrote that has ended.
fn show(one: &Running) -> Result<()> {
    let written = fs::read(format!("{OUTPUT}/{}.txt", one.step.name))?;
    println!("{}", String::from_utf8_lossy(&written).trim_end());
    println!("--- {}: {:.1} s", one.step.name, one.start.elapsed().as_secs_f64());
    Ok(())
}

fn summarise(times: &[(&str, Duration)], total: Duration) {
    println!("\nall {} steps passed", times.len());
    for (name, time) in times {
        println!("{name:<10} {:>7.1} s", time.as_secs_f64());
    }
    println!("{:<10} {:>7.1} s, {AT_A_TIME} steps at a time", "total", total.as_secs_f64());
}

fn fmt() -> Result<()> {
    shell::run(&mut shell::cargo(["fmt", "--all", "--", "--check"]))
}

fn clippy() -> Result<()> {
    let mut command = shell::cargo(["clippy", "--all-targets"]);
    shell::run(command.args(shell::ALL).args(["--", "-D", "warnings"]))?;
    let own = ["clippy", "--package", "xtask", "--package", "wasm-test-runner", "--all-targets"];
    shell::run(shell::cargo(own).args(["--", "-D", "warnings"]))
}

fn lint_wasm() -> Result<()> {
    shell::add_wasm_target()?;
    with_fixture(|| {
        let mut command = shell::cargo(["clippy", "--all-targets", "--target", shell::WASM]);
        shell::for_browsers(&mut command).args(package::CRATES.iter().flat_map(|name| ["--package", name]));
        shell::run(fixture_env(command.args(["--", "-D", "warnings"])))
    })
}

fn doc() -> Result<()> {
    let mut command = shell::cargo(["doc", "--lib", "--no-deps"]);
    shell::run(command.args(shell::ALL).env("RUSTDOCFLAGS", "-D warnings"))?;
    public_api::check()
}

/// All that needs no browser. The tests that compare the renderer with its twin on the CPU show their output: how far they are apart.
fn native() -> Result<()> {
    browser::vulkan_driver()?;
    // Tests of real data are ignored otherwise.
    let with_data = std::env::var_os("TETRALOD_DATA").map(|_| "--include-ignored");
    let is_missing = with_data.is_none() && std::env::var_os("TETRALOD_NOTHING_MISSING").is_some();
    ensure!(
        !is_missing,
        "TETRALOD_DATA names no folder with the data sets, and TETRALOD_NOTHING_MISSING is set"
    );
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

/// All that later steps run or read.
fn compile() -> Result<()> {
    with_fixture(|| Ok(()))
}

fn npm_package() -> Result<()> {
    package::build_for_tests()
}

fn wasm() -> Result<()> {
    let browser = browser::require()?;
    shell::add_wasm_target()?;
    with_fixture(|| {
        let tests = ["--package", "tetralod-web-core", "--package", "tetralod-web-viewer", "--tests"];
        shell::run(fixture_env(&mut browser::wasm_tests(&browser, &tests)?))
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
    shell::run(&mut node_tool("@biomejs/biome/bin/biome", &["format"]))?;
    shell::run(&mut node_tool("@biomejs/biome/bin/biome", &["lint", "--error-on-warnings"]))?;
    shell::run(&mut node_tool("typescript/bin/tsc", &["--project", "tests/js"]))?;
    shell::run(&mut node_tool("typescript/bin/tsc", &["--project", "tests/js/tsconfig.page.json"]))?;
    shell::run(&mut node_test("actions.test.js"))?;
    shell::run(&mut node_test("layers.test.js"))?;
    shell::run(&mut node_test("store.test.js"))?;
    shell::run(&mut node_test("pack.test.js"))?;
    shell::run(&mut node_test("latest.test.js"))?;
    shell::run(&mut node_test("pace.test.js"))?;
    shell::run(&mut node_test("fit.test.js"))?;
    shell::run(&mut node_test("linked.test.js"))?;
    shell::run(&mut node_test("stored.test.js"))?;
    shell::run(&mut node_test("ranges.test.js"))?;
    shell::run(&mut node_test("writers.test.js"))?;
    shell::run(&mut node_test("tools.test.js"))?;
    shell::run(&mut node_test("bins.test.js"))?;
    shell::run(&mut node_test("geometry.test.js"))?;
    shell::run(&mut node_test("policy.test.js"))?;
    let tetralod = shell::tested_command()?;
    with_fixture(|| {
        for name in [
            "package.test.js",
            "build.test.js",
            "parts.test.js",
            "steps.test.js",
            "places.test.js",
            "views.test.js",
            "regions.test.js",
            "vscode.test.js",
        ] {
            shell::run(fixture_env(node_test(name).env("TETRALOD", &tetralod)))?;
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
    node_test_by(&[], file)
}

/// The same by a program that runs another one: its name and options.
fn node_test_by(runner: &[&str], file: &str) -> Command {
    let file = format!("tests/js/{file}");
    let own = ["node", "--test", "--test-reporter=spec", "--test-timeout=2700000", &file];
    let words = [runner, &own].concat();
    let mut command = shell::command(words[0], &words[1..]);
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
    let untyped =
        ["--profile", "esm-only", "--exclude-entrypoints", "core.wasm", "viewer.wasm", "build.wasm"];
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
        let test = |runner: &[&str], name: &str, variable: &str, path: &Path| {
            let mut command = node_test_by(runner, &format!("{name}-browser.test.js"));
            shell::run(fixture_env(command.env("TETRALOD", &tetralod).env(variable, path)))
        };
        for name in [
            "core", "ranges", "streams", "parts", "viewer", "webgl", "places", "element", "html", "vscode",
            "build",
        ] {
            test(&[], name, "CHROMIUM", &browser.chromium)?;
        }
        let firefox = browser::firefox()?;
        println!("what needs no WebGPU, in Firefox");
        let display = browser::display()?;
        ["core", "ranges", "webgl"].into_iter().try_for_each(|name| test(display, name, "FIREFOX", &firefox))
    })?;
    for name in ["state.test.js", "e2e.test.js", "page.test.js", "drop.test.js"] {
        let mut command = node_test(name);
        shell::run(command.env("TETRALOD_PAGE", &server.address).env("CHROMIUM", &browser.chromium))?;
    }
    Ok(())
}
