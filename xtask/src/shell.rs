//! Running other programs: every failure names the whole command line.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

/// The target that browsers run.
pub const WASM: &str = "wasm32-unknown-unknown";

/// The folder of the workspace.
pub fn root() -> PathBuf {
    let xtask = Path::new(env!("CARGO_MANIFEST_DIR"));
    xtask.parent().map_or_else(|| xtask.to_path_buf(), Path::to_path_buf)
}

/// `program` with `args`, not started yet. It does not hear what cargo says of this program: build scripts that listen to that would run
/// again, and crates be compiled again, whenever cargo is started by hand in between.
pub fn command<A: AsRef<OsStr>>(program: impl AsRef<OsStr>, args: impl IntoIterator<Item = A>) -> Command {
    let mut command = Command::new(program);
    command.args(args);
    for (name, _) in std::env::vars_os() {
        let text = name.to_string_lossy();
        if text.starts_with("CARGO_MANIFEST_") || text.starts_with("CARGO_PKG_") {
            command.env_remove(&name);
        }
    }
    command
}

/// The cargo that started this program.
pub fn cargo<A: AsRef<OsStr>>(args: impl IntoIterator<Item = A>) -> Command {
    command(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()), args)
}

/// npm, without its remarks about funding and audits.
pub fn npm<A: AsRef<OsStr>>(args: impl IntoIterator<Item = A>) -> Command {
    let program = if cfg!(windows) { "npm.cmd" } else { "npm" };
    let mut command = command(program, args);
    command.envs([
        ("npm_config_fund", "false"),
        ("npm_config_audit", "false"),
        ("npm_config_update_notifier", "false"),
    ]);
    command
}

/// Runs `command` to a successful end.
pub fn run(command: &mut Command) -> Result<()> {
    let line = line(command);
    let status = command.status().with_context(|| format!("cannot start `{line}`"))?;
    ensure!(status.success(), "`{line}` failed: {status}");
    Ok(())
}

/// Runs `command` to a successful end and gives what it wrote to standard output.
pub fn output(command: &mut Command) -> Result<String> {
    let line = line(command);
    let output = command.output().with_context(|| format!("cannot start `{line}`"))?;
    if !output.status.success() {
        bail!("`{line}` failed: {}\n{}", output.status, String::from_utf8_lossy(&output.stderr).trim_end());
    }
    String::from_utf8(output.stdout).with_context(|| format!("`{line}` wrote something that is not UTF-8"))
}

/// Whether `command` runs and succeeds; says nothing.
pub fn succeeds(command: &mut Command) -> bool {
    command.output().is_ok_and(|output| output.status.success())
}

/// The path of `program` as the shell would find it.
pub fn find(program: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(program)).find(|file| file.is_file())
}

/// Everything native but this program and what it runs, whose dependencies it was compiled with already, with every feature.
pub const ALL: [&str; 9] = [
    "--workspace",
    "--exclude",
    "xtask",
    "--exclude",
    "wasm-test-runner",
    "--exclude",
    "tetralod-web-*",
    "--features",
    "tetralod/http,tetralod-io/hdf5",
];

/// The native command as it was compiled for the tests, optimised and with every assertion.
pub fn tested_command() -> Result<PathBuf> {
    // With its tests: they give some dependencies more features, and without them the crate would be compiled again by each of the two.
    run(cargo(["test", "--no-run", "--test", "command"]).args(ALL))?;
    Ok(built_in("debug"))
}

/// The native command in a folder of its own, so that files which it has made are older than the command only where it has changed.
pub fn demo_command() -> Result<PathBuf> {
    // What incremental compilation prepares for the next time takes longer the first time, and somebody waits for the page.
    let mut command = cargo(["build", "--package", "tetralod-cli"]);
    run(command.env("CARGO_INCREMENTAL", "0"))?;
    let (made, kept) = (built_in("debug"), built_in("demo"));
    let bytes = fs::read(&made).with_context(|| made.display().to_string())?;
    if fs::read(&kept).ok().as_ref() != Some(&bytes) {
        fs::create_dir_all(kept.with_file_name(""))?;
        fs::copy(&made, &kept).with_context(|| kept.display().to_string())?;
    }
    Ok(kept)
}

/// The native command as users get it who have no checkout: with the page of `tetralod view` inside.
pub fn command_with_page() -> Result<PathBuf> {
    run(&mut cargo(["build", "--release", "--package", "tetralod-cli", "--features", "page"]))?;
    Ok(built_in("release"))
}

/// The native command as users get it.
pub fn released_command() -> Result<PathBuf> {
    run(&mut cargo(["build", "--release", "--package", "tetralod-cli"]))?;
    Ok(built_in("release"))
}

/// What is compiled for browsers has a folder of its own: so it can be compiled beside what is native.
pub const FOR_BROWSERS: &str = "target/browsers";

/// Lets `command` compile for browsers.
pub fn for_browsers(command: &mut Command) -> &mut Command {
    command.env("CARGO_TARGET_DIR", root().join(FOR_BROWSERS))
}

/// The program that cargo calls for each file of wasm tests.
pub fn wasm_test_runner() -> Result<PathBuf> {
    let name = "wasm-test-runner";
    run(&mut cargo(["build", "--package", name]))?;
    Ok(program_in("debug", name))
}

fn built_in(profile: &str) -> PathBuf {
    program_in(profile, "tetralod")
}

fn program_in(profile: &str, name: &str) -> PathBuf {
    root().join("target").join(profile).join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

/// Adds the wasm target to the pinned toolchain where it is missing.
pub fn add_wasm_target() -> Result<()> {
    let sysroot = output(&mut command("rustc", ["--print", "sysroot"]))?;
    if Path::new(sysroot.trim()).join("lib/rustlib").join(WASM).is_dir() {
        return Ok(());
    }
    run(&mut command("rustup", ["target", "add", WASM]))
        .context("the Rust target for browsers is missing and only rustup can add it")
}

/// Installs the development tools of `tests/js` where they are missing or out of date.
pub fn install_node_tools() -> Result<()> {
    install_node_packages(Path::new("tests/js"))
}

/// Installs what `package-lock.json` in `folder` names where it is missing or out of date.
pub fn install_node_packages(folder: &Path) -> Result<()> {
    check_node()?;
    let (lock, done) = (folder.join("package-lock.json"), folder.join("node_modules/.package-lock.json"));
    let newer =
        |a: &Path, b: &Path| Some(a.metadata().ok()?.modified().ok()? > b.metadata().ok()?.modified().ok()?);
    if newer(&done, &lock) == Some(true) {
        return Ok(());
    }
    run(npm(["ci", "--no-audit", "--no-fund", "--loglevel=error"]).current_dir(folder))
}

fn check_node() -> Result<()> {
    let version = output(&mut command("node", ["--version"])).context("Node 20.16 or later is needed")?;
    let numbers: Vec<u32> = version.trim().trim_start_matches('v').split('.').flat_map(str::parse).collect();
    ensure!(numbers >= vec![20, 16], "Node 20.16 or later is needed, this is {}", version.trim());
    Ok(())
}

fn line(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ")
}
