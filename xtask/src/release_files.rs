//! `cargo xtask archive` and a part of `cargo xtask release`: files for people without Rust. The command in an archive, with manual pages and
//! completions; and what other systems make packages of, from `packaging/`.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use flate2::{Compression, write::GzEncoder};
use sha2::{Digest, Sha256};

use crate::{browser, licences, package, shell, venv};

/// Where all is written.
const FOLDER: &str = "target/release-files";
/// Each has the checksum of a file and its name in a line, as `sha256sum --check` reads them.
const SUMS: &str = "SHA256SUMS";
/// What packages are made of: `{version}`, `{address}` and `{sha256}` of the archive of the sources are filled in.
const RECIPES: [&str; 2] = ["packaging/conda/recipe.yaml", "packaging/homebrew/tetralod.rb"];
const CONTAINER: &str = "packaging/Containerfile";

/// Makes the archive of the command for this machine.
pub fn archive() -> Result<()> {
    let program = shell::command_with_page()?;
    let name = format!("tetralod-{}-{}", package::version()?, host()?);
    let folder = Path::new(FOLDER).join(&name);
    if Path::new(FOLDER).exists() {
        fs::remove_dir_all(FOLDER)?;
    }
    let (pages, completions) = (folder.join("man"), folder.join("completions"));
    [&pages, &completions].into_iter().try_for_each(fs::create_dir_all)?;
    fs::copy(&program, folder.join(program.file_name().context("the command has no name")?))?;
    for file in ["LICENSE-APACHE", "LICENSE-MIT"] {
        fs::copy(file, folder.join(file))?;
    }
    // The page inside has the modules of the package.
    let modules = package::MODULES.iter().map(|module| (module.package, Some(shell::WASM)));
    licences::write(&folder, modules.chain([("tetralod-cli", None)]))?;
    shell::run(shell::command(&program, ["completions", "--man"]).arg(&pages))?;
    for (shell, file) in [
        ("bash", "tetralod.bash"),
        ("fish", "tetralod.fish"),
        ("powershell", "tetralod.ps1"),
        ("zsh", "_tetralod"),
    ] {
        let script = shell::output(&mut shell::command(&program, ["completions", shell]))?;
        fs::write(completions.join(file), script)?;
    }
    let packed = format!("{name}.tar.gz");
    pack(&folder, &name, &Path::new(FOLDER).join(&packed))?;
    fs::remove_dir_all(&folder)?;
    check_archive(&packed, &name)?;
    write_sums()
}

/// Makes the archive of the sources, and all recipes for it; checks them and what builds a container.
pub fn recipes() -> Result<()> {
    fs::create_dir_all(FOLDER)?;
    let version = package::version()?;
    let sources = format!("tetralod-{version}.tar.gz");
    let mut git = shell::command("git", ["archive", "--format=tar.gz", "HEAD"]);
    git.arg(format!("--prefix=tetralod-{version}/")).arg("--output").arg(Path::new(FOLDER).join(&sources));
    shell::run(&mut git)?;
    let sum = sum(&Path::new(FOLDER).join(sources))?;
    // Where the workflow of a release runs, this is the address of the repository.
    let at = |name: &str| std::env::var(name).ok();
    let address = at("GITHUB_SERVER_URL").zip(at("GITHUB_REPOSITORY"));
    let address = address
        .map_or("https://example.org/tetralod".to_owned(), |(server, name)| format!("{server}/{name}"));
    for recipe in RECIPES {
        let mut text = fs::read_to_string(recipe).with_context(|| recipe.to_owned())?;
        for (name, value) in [("{version}", &version), ("{address}", &address), ("{sha256}", &sum)] {
            ensure!(text.contains(name), "{recipe} has no {name}");
            text = text.replace(name, value);
        }
        let name = Path::new(recipe).file_name().context("a recipe has no name")?;
        fs::write(Path::new(FOLDER).join(name), text)?;
    }
    check_recipes()?;
    write_sums()
}

/// The name that rustc has for this machine.
fn host() -> Result<String> {
    let told = shell::output(&mut shell::command("rustc", ["-vV"]))?;
    let line = told.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(line.context("rustc names no host")?.to_owned())
}

/// Packs a folder, with the same bytes for the same files.
fn pack(folder: &Path, name: &str, packed: &Path) -> Result<()> {
    let file = File::create(packed).with_context(|| packed.display().to_string())?;
    let mut archive = tar::Builder::new(GzEncoder::new(file, Compression::best()));
    archive.mode(tar::HeaderMode::Deterministic);
    for file in files(folder)? {
        let inside = Path::new(name).join(file.strip_prefix(folder)?);
        archive.append_path_with_name(&file, inside)?;
    }
    archive.into_inner()?.finish()?;
    Ok(())
}

/// All files in a folder and those in it, in the order of their names.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.is_dir() { found.extend(files(&path)?) } else { found.push(path) }
    }
    found.sort_unstable();
    Ok(found)
}

/// Unpacks an archive as its users do, and asks the command in it for its version.
fn check_archive(packed: &str, name: &str) -> Result<()> {
    shell::run(shell::command("tar", ["-xzf", packed]).current_dir(FOLDER))?;
    let folder = Path::new(FOLDER).join(name);
    let told = shell::output(&mut shell::command(folder.join("tetralod"), ["--version"]))?;
    ensure!(told.trim() == format!("tetralod {}", package::version()?), "{packed}: the command says {told}");
    let empty = files(&folder)?.into_iter().find(|file| fs::metadata(file).is_ok_and(|data| data.len() == 0));
    ensure!(empty.is_none(), "{packed}: {} is empty", empty.unwrap_or_default().display());
    Ok(fs::remove_dir_all(folder)?)
}

/// Lints what builds a container, and reads the recipes as the programs do that they are for.
fn check_recipes() -> Result<()> {
    let tools = venv::environment(Path::new("target/packaging"), Path::new("packaging/requirements.txt"))?;
    shell::run(&mut shell::command(venv::program(&tools, "hadolint"), [CONTAINER]))?;
    let recipe = "import pathlib, sys, rattler_build as r; r.Stage0Recipe.from_yaml(pathlib.Path(sys.argv[1]).read_text()).render()";
    let mut python = shell::command(venv::program(&tools, "python"), ["-c", recipe]);
    shell::run(python.arg(Path::new(FOLDER).join("recipe.yaml")))?;
    if shell::find("rubocop").is_none() {
        browser::install_packages(
            "rubocop",
            &["rubocop"],
            "rubocop is needed: install it (Debian: the package `rubocop`)",
        )?;
    }
    // Homebrew has its own style of names and comments; `brew audit` needs Homebrew.
    let mut rubocop = shell::command(
        "rubocop",
        ["--only", "Lint,Layout,Security", "--except", "Layout/LineLength,Layout/SpaceAroundOperators"],
    );
    shell::run(rubocop.arg(Path::new(FOLDER).join("tetralod.rb")))
}

fn sum(file: &Path) -> Result<String> {
    let bytes = fs::read(file).with_context(|| file.display().to_string())?;
    let mut hex = String::new();
    Sha256::digest(bytes).iter().try_for_each(|byte| write!(hex, "{byte:02x}"))?;
    Ok(hex)
}

/// Writes the checksums of all files that are there, and says what they are.
fn write_sums() -> Result<()> {
    let mut lines = String::new();
    for file in files(Path::new(FOLDER))? {
        let name = file.strip_prefix(FOLDER)?.display().to_string();
        if name != SUMS {
            println!("{}: {} bytes", file.display(), fs::metadata(&file)?.len());
            writeln!(lines, "{}  {name}", sum(&file)?)?;
        }
    }
    Ok(fs::write(Path::new(FOLDER).join(SUMS), lines)?)
}
