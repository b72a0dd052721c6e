//! The Python package of `python/`: `cargo xtask wheel` makes a wheel of it as it is published; its tests have one that is compiled as all
//! tests are.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::{browser, licences, package, shell, venv};

const SOURCES: &str = "python";

/// The page's side of the widget, in one file.
const WIDGET: &str = "python/tetralod/static/widget.js";

/// Where the environments and the wheels are.
const FOLDER: &str = "target/python";

/// Makes the wheel for this machine, as it is published, in `target/python/released`, and tests it. What follows goes to maturin.
pub fn wheel(args: &[String]) -> Result<()> {
    if let Some(arg) = args.first().filter(|arg| !arg.starts_with("--")) {
        bail!("`wheel` takes options of maturin alone, got `{arg}`");
    }
    let tools = tools()?;
    // The page of `tetralod view` has the package.
    package::ensure_built(package::Profile::Released)?;
    let options: Vec<String> =
        ["--features", "page"].map(str::to_owned).into_iter().chain(args.iter().cloned()).collect();
    let wheel = build(&tools, "release", "released", &options)?;
    println!("{}: {} bytes", wheel.display(), fs::metadata(&wheel)?.len());
    // Machines that make wheels have neither a browser nor a driver for Vulkan.
    check(&tools, &wheel, |pytest| pytest.args(["-m", "not graphics"]))
}

/// Tests the package: its types, and a wheel.
pub fn test() -> Result<()> {
    let tools = tools()?;
    package::ensure_built(package::Profile::Tested)?;
    browser::vulkan_driver()?;
    let chromium = browser::require()?.chromium;
    shell::run(&mut shell::command(
        venv::program(&tools, "mypy"),
        ["--config-file", "python/pyproject.toml"],
    ))?;
    let wheel = build(&tools, "dev", "tested", &[])?;
    check(&tools, &wheel, |pytest| pytest.env("CHROMIUM", &chromium))
}

/// Tests a wheel in an environment with what it can work with; and that it works with what it asks for alone.
fn check(tools: &Path, wheel: &Path, prepare: impl FnOnce(&mut Command) -> &mut Command) -> Result<()> {
    let install = |environment: &Path| shell::command(venv::program(environment, "pip"), venv::INSTALL);
    shell::run(install(tools).args(["--force-reinstall", "--no-deps"]).arg(wheel))?;
    let mut pytest =
        shell::command(venv::program(tools, "python"), ["-m", "pytest", "--quiet", "python/tests"]);
    pytest.args(["--durations", "5", "--config-file", "python/pyproject.toml"]);
    shell::run(prepare(&mut pytest))?;
    let fresh = shell::root().join(FOLDER).join("fresh");
    venv::make(&fresh)?;
    shell::run(install(&fresh).arg(wheel))?;
    shell::run(&mut shell::command(venv::program(&fresh, "python"), ["-c", ALONE]))
}

/// What works without PyVista, meshio and anywidget.
const ALONE: &str = "\
import tetralod
points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
mesh = tetralod.build(points, [[0, 1, 2, 3]], {'p': [0, 1, 2, 3]}).refine()
assert mesh.tets.shape == (1, 4)
try:
    mesh.to_pyvista()
except ImportError as error:
    assert 'pip install pyvista' in str(error)
else:
    raise AssertionError('PyVista is there')
try:
    tetralod.show(b'')
except ImportError as error:
    assert 'pip install tetralod[notebook]' in str(error)
else:
    raise AssertionError('anywidget is there')
";

/// The environment with what builds wheels and tests them.
fn tools() -> Result<PathBuf> {
    venv::environment(&Path::new(FOLDER).join("venv"), &Path::new(SOURCES).join("requirements.txt"))
}

/// The wheel, built in a profile of cargo, in a folder for it alone.
fn build(tools: &Path, profile: &str, folder: &str, options: &[String]) -> Result<PathBuf> {
    let folder = shell::root().join(FOLDER).join(folder);
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    let sources = Path::new(SOURCES);
    licences::write(sources, [("tetralod-python", None), (package::VIEWER.package, Some(shell::WASM))])?;
    shell::run(&mut shell::command("node", ["xtask/js/widget.mjs", package::PKG, WIDGET]))?;
    for licence in ["LICENSE-APACHE", "LICENSE-MIT"] {
        fs::copy(licence, sources.join(licence)).with_context(|| licence.to_owned())?;
    }
    let mut maturin = shell::command(venv::program(tools, "maturin"), ["build", "--quiet", "--locked"]);
    maturin.args(["--manifest-path", "python/Cargo.toml", "--profile", profile, "--out"]).arg(&folder);
    shell::run(maturin.args(options))?;
    let made = fs::read_dir(&folder)?.map(|entry| Ok(entry?.path())).collect::<Result<Vec<PathBuf>>>()?;
    let [wheel] = &made[..] else { bail!("maturin made {} files in {}", made.len(), folder.display()) };
    ensure!(wheel.extension().is_some_and(|ending| ending == "whl"), "{} is no wheel", wheel.display());
    Ok(wheel.clone())
}
