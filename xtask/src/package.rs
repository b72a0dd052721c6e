//! `cargo xtask build`: the three wasm modules, and the scripts and declarations that TypeScript makes of `pkg-template/`, merged into
//! `pkg/`, with `inline.js` and `inline-viewer.js`, which `xtask/js/inline.mjs` makes of them; `xtask/js/sizes.mjs` has the limit of each
//! entry.
//!
//! The core (decoder, refinement, and the tools for meshes), the viewer (the same with the renderer) and the builder are separate
//! modules, so that a page which draws by its own means does not download a renderer, and one that shows files no builder.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, ensure};
use flate2::Compression;
use flate2::write::GzEncoder;
use wasm_bindgen_cli_support::Bindgen;

use crate::{licences, shell};

/// Where the package is put together.
pub const PKG: &str = "pkg";

pub struct Module {
    /// Of the module and its script.
    name: &'static str,
    /// The crate that it is made of.
    pub package: &'static str,
}

pub const VIEWER: Module = Module { name: "tetralod_viewer", package: "tetralod-web-viewer" };

pub const MODULES: [Module; 3] = [
    Module { name: "tetralod_core", package: "tetralod-web-core" },
    VIEWER,
    Module { name: "tetralod_build", package: "tetralod-web-build" },
];

const BENCH: Module = Module { name: "tetralod_bench", package: "tetralod-web-bench" };

/// What is published on crates.io.
pub const PUBLISHED: [&str; 6] =
    ["tetralod", "tetralod-io", "tetralod-build", "tetralod-render", "tetralod-bench", "tetralod-cli"];

/// All crates that are for browsers alone.
pub const CRATES: [&str; 6] = [
    "tetralod-web",
    "tetralod-web-options",
    MODULES[0].package,
    MODULES[1].package,
    MODULES[2].package,
    BENCH.package,
];

/// What `wasm-opt` may use: what rustc and wasm-bindgen use already, and nothing beyond.
const WASM_FEATURES: [&str; 6] = [
    "--enable-bulk-memory",
    "--enable-multivalue",
    "--enable-mutable-globals",
    "--enable-nontrapping-float-to-int",
    "--enable-reference-types",
    "--enable-sign-ext",
];

/// How modules are compiled.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// As they are published.
    Released,
    /// In a third of the time, with every assertion: as the native tests are.
    Tested,
}

impl Profile {
    /// The name of cargo's profile, and of the folder with what it makes.
    fn cargo(self) -> [&'static str; 2] {
        match self {
            Profile::Released => ["wasm", "wasm"],
            Profile::Tested => ["dev", "debug"],
        }
    }
}

/// Where it is put together before that. `pkg-template/tsconfig.json` finds the types of the modules there.
const STAGING: &str = "target/pkg-staging";

/// Names the profile of `pkg/`. It is not in there, since all that is there is published.
const MADE: &str = "target/pkg-profile";

/// Builds `pkg/` from nothing as it is published, and checks its sizes; with names, only these modules of it, as [`build_some`] does.
pub fn build(names: &[String]) -> Result<()> {
    let named = |name: &String| {
        let found = MODULES.iter().find(|module| module.name.strip_prefix("tetralod_") == Some(name));
        found.with_context(|| {
            format!("`build` takes names of modules such as `core` or `viewer`, got `{name}`")
        })
    };
    if !names.is_empty() {
        return build_some(&names.iter().map(named).collect::<Result<Vec<_>>>()?);
    }
    build_released()?;
    report(Path::new(PKG))?;
    shell::run(&mut shell::command("node", ["xtask/js/sizes.mjs", PKG]))
}

/// Builds `pkg/` from nothing as it is published, whatever its sizes.
pub fn build_released() -> Result<()> {
    build_all(Profile::Released)
}

/// Builds `pkg/` from nothing for tests.
pub fn build_for_tests() -> Result<()> {
    build_all(Profile::Tested)
}

fn build_all(profile: Profile) -> Result<()> {
    prepare()?;
    let staging = Path::new(STAGING);
    remake(staging)?;
    compile_all(MODULES.iter(), profile, staging)?;
    assemble(staging)?;
    fs::write(MADE, profile.cargo()[0]).context(MADE)
}

/// Puts into `pkg/` what the demo's page needs to draw. [`build`] makes the rest.
pub fn build_viewer() -> Result<()> {
    build_some(&[&VIEWER])
}

/// Puts some modules into `pkg/`, and all scripts but those of one file. The scripts are not checked: types of other modules may be missing.
fn build_some(modules: &[&Module]) -> Result<()> {
    prepare()?;
    let staging = Path::new("target/pkg-part");
    remake(staging)?;
    compile_all(modules.iter().copied(), Profile::Released, staging)?;
    compile_scripts(staging, &["--noCheck"])?;
    // These are made of all the modules.
    for inline in ["inline.js", "inline-viewer.js"] {
        fs::remove_file(staging.join(inline)).context(inline)?;
    }
    move_files(staging, Path::new(PKG))
}

fn prepare() -> Result<()> {
    check_versions()?;
    shell::add_wasm_target()?;
    shell::install_node_tools()
}

/// Builds `pkg/` where there is no complete one yet, or only one for tests, and that would not do.
pub fn ensure_built(profile: Profile) -> Result<()> {
    let made = fs::read_to_string(MADE).unwrap_or_default();
    // The scripts are made last.
    let is_there = Path::new(PKG).join("inline-viewer.js").is_file();
    if is_there && [Profile::Released, profile].iter().any(|good| made == good.cargo()[0]) {
        return shell::install_node_tools();
    }
    build_all(profile)
}

/// Packs the extension for VS Code, with the package as it is published.
pub fn pack_extension() -> Result<()> {
    ensure_built(Profile::Released)?;
    let file = "target/release-files/tetralod.vsix";
    shell::run(&mut shell::command("node", ["xtask/js/vscode.mjs", PKG, file]))?;
    println!("{file}");
    Ok(())
}

/// Compiles the module with the benchmark, which the package does not have, into `folder`.
pub fn build_bench(folder: &Path) -> Result<()> {
    prepare()?;
    compile_all(std::iter::once(&BENCH), Profile::Released, folder)
}

/// wasm-bindgen's macro and its generator of scripts speak a private protocol: they must be the same version.
fn check_versions() -> Result<()> {
    let lock = fs::read_to_string("Cargo.lock").context("Cargo.lock")?;
    let (library, tool) = (locked(&lock, "wasm-bindgen")?, locked(&lock, "wasm-bindgen-cli-support")?);
    ensure!(
        library == tool,
        "Cargo.lock has wasm-bindgen {library} but xtask carries wasm-bindgen-cli-support {tool}: \
         set the versions in xtask/Cargo.toml to ={library}"
    );
    Ok(())
}

fn locked<'a>(lock: &'a str, package: &str) -> Result<&'a str> {
    let start = format!("name = \"{package}\"\nversion = \"");
    let at = lock.find(&start).with_context(|| format!("Cargo.lock has no {package}"))? + start.len();
    lock[at..].split('"').next().context("Cargo.lock ends inside a version")
}

/// Makes modules in `out`. One is optimised while the next one is compiled, for both take one core most of the time.
fn compile_all<'a>(modules: impl Iterator<Item = &'a Module>, profile: Profile, out: &Path) -> Result<()> {
    std::thread::scope(|scope| {
        let mut optimised = Vec::new();
        for module in modules {
            compile(module, profile, out)?;
            let wasm = out.join(format!("{}_bg.wasm", module.name));
            if profile == Profile::Released {
                optimised.push(scope.spawn(move || optimise(&wasm)));
            }
        }
        optimised.into_iter().try_for_each(|one| one.join().map_err(|_| anyhow!("optimising failed"))?)
    })
}

/// Compiles a module, which is not optimised then.
fn compile(module: &Module, profile: Profile, out: &Path) -> Result<()> {
    let Module { name, package } = module;
    println!("building {name}");
    let [profile, folder] = profile.cargo();
    let args = ["build", "--package", package, "--lib", "--profile", profile, "--target", shell::WASM];
    let mut command = shell::cargo(args);
    shell::run(shell::for_browsers(&mut command).args(["--config", &rust_flags()?]))?;
    let wasm = format!("{}/{}/{folder}/{}.wasm", shell::FOR_BROWSERS, shell::WASM, package.replace('-', "_"));
    // As wasm-bindgen's command line has it: the script knows where its module is.
    let mut bindgen = Bindgen::new();
    bindgen.web(true)?.input_path(&wasm).out_name(name).typescript(true);
    bindgen.omit_default_module_path(false).generate(out)
}

/// Panic messages name source files: the same bytes must come out on every machine, and no home folder in them. And what a module does
/// not use is an error.
fn rust_flags() -> Result<String> {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home =
        home.or_else(|| Some(std::env::home_dir()?.join(".cargo"))).context("there is no home folder")?;
    let flag = format!("--remap-path-prefix={}=cargo", home.display());
    Ok(format!("target.{}.rustflags={}", shell::WASM, serde_json::json!([flag, "-Dwarnings"])))
}

fn optimise(wasm: &Path) -> Result<()> {
    let tool = "tests/js/node_modules/binaryen/bin/wasm-opt";
    // Functions with one caller are inlined by rustc already, where that pays.
    let inlining = "--one-caller-inline-max-function-size=0";
    let mut command = shell::command("node", [tool, "-O3", inlining, "--strip-debug", "--strip-producers"]);
    shell::run(command.args(WASM_FEATURES).arg(wasm).arg("-o").arg(wasm))
}

/// The package is put together beside `pkg/` and moved there, so that a failed build leaves the last good one.
fn assemble(staging: &Path) -> Result<()> {
    compile_scripts(staging, &[])?;
    for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
        fs::copy(licence, staging.join(licence)).context(licence)?;
    }
    licences::write(staging, MODULES.iter().map(|module| (module.package, Some(shell::WASM))))?;
    version()?;
    shell::run(shell::command("node", ["xtask/js/inline.mjs"]).arg(staging))?;
    let files = files_of(staging)?;
    move_files(staging, Path::new(PKG))?;
    for old in files_of(Path::new(PKG))?.iter().filter(|old| !files.contains(old)) {
        fs::remove_file(Path::new(PKG).join(old)).with_context(|| format!("removing {old}"))?;
    }
    Ok(())
}

/// Puts the scripts, their declarations, and what goes with them into `folder`.
fn compile_scripts(folder: &Path, options: &[&str]) -> Result<()> {
    let template = Path::new("pkg-template");
    for file in ["README.md", "package.json"] {
        fs::copy(template.join(file), folder.join(file)).with_context(|| format!("copying {file}"))?;
    }
    // Not beside the types of the modules, which would be compiled together with what was made of them the last time.
    let made = Path::new("target/pkg-scripts");
    remake(made)?;
    let mut compiler = shell::command("node", ["tests/js/node_modules/typescript/bin/tsc", "--project"]);
    shell::run(compiler.arg(template).arg("--outDir").arg(made).args(options))?;
    move_files(made, folder)
}

/// One by one: a server may be reading the files that these replace.
fn move_files(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to).with_context(|| format!("making {}", to.display()))?;
    for file in files_of(from)? {
        fs::rename(from.join(&file), to.join(&file)).with_context(|| format!("moving {file}"))?;
    }
    Ok(())
}

/// The one version of the crates and the npm package.
pub fn version() -> Result<String> {
    let path = "pkg-template/package.json";
    let text = fs::read_to_string(path).context(path)?;
    let json: serde_json::Value = serde_json::from_str(&text).context(path)?;
    let npm = json["version"].as_str().unwrap_or_default();
    let lock = fs::read_to_string("Cargo.lock").context("Cargo.lock")?;
    for package in PUBLISHED {
        let cargo = locked(&lock, package)?;
        ensure!(npm == cargo, "{path} is version {npm}, the crate {package} is {cargo}");
    }
    Ok(npm.to_owned())
}

fn files_of(folder: &Path) -> Result<Vec<String>> {
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let names = entries.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()));
    names.collect()
}

fn remake(folder: &Path) -> Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder).with_context(|| format!("emptying {}", folder.display()))?;
    }
    fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))
}

fn report(pkg: &Path) -> Result<()> {
    println!("{:<28} {:>10} {:>10}", "pkg/", "bytes", "gzipped");
    for module in &MODULES {
        let file = format!("{}_bg.wasm", module.name);
        let bytes = fs::read(pkg.join(&file)).with_context(|| file.clone())?;
        let gzipped = gzipped(&bytes)?;
        println!("{file:<28} {:>10} {gzipped:>10}", bytes.len());
    }
    Ok(())
}

fn gzipped(bytes: &[u8]) -> Result<usize> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?.len())
}
