//! Programs of the system that tests need, Chromium with WebGPU above all: finding them, installing them where that is allowed, and
//! running wasm tests in Chromium.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::shell;

const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// A browser and the driver that steers it.
#[derive(Clone, Debug)]
pub struct Browser {
    /// The program to start.
    pub chromium: PathBuf,
    /// The WebDriver server of the browser.
    pub driver: PathBuf,
}

/// The browser of this machine: the variables CHROMIUM and CHROMEDRIVER, what PATH has, or a fresh installation.
pub fn require() -> Result<Browser> {
    found_or_installed(find, "Chromium", &["chromium", "chromium-driver"], BY_HAND)
}

/// What `find` finds, if need be after an installation.
fn found_or_installed<T>(
    find: impl Fn() -> Option<T>,
    what: &str,
    packages: &[&str],
    by_hand: &'static str,
) -> Result<T> {
    if let Some(found) = find() {
        return Ok(found);
    }
    install_packages(what, packages, by_hand)?;
    find().with_context(|| format!("{what} was installed, but is not found"))
}

fn find() -> Option<Browser> {
    let given = |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_file());
    let chromium = given("CHROMIUM").or_else(|| BROWSERS.iter().find_map(|name| shell::find(name)))?;
    let driver = given("CHROMEDRIVER").or_else(|| shell::find("chromedriver"))?;
    Some(Browser { chromium, driver })
}

const FIREFOXES: [&str; 2] = ["firefox-esr", "firefox"];

/// Firefox, for tests that need no WebGPU: the variable FIREFOX, what PATH has, or a fresh installation.
pub fn firefox() -> Result<PathBuf> {
    let find = || {
        let given = std::env::var_os("FIREFOX").map(PathBuf::from).filter(|path| path.is_file());
        given.or_else(|| FIREFOXES.iter().find_map(|name| shell::find(name)))
    };
    let by_hand = "Firefox is needed: install it, or set FIREFOX to its path";
    found_or_installed(find, "Firefox", &["firefox-esr"], by_hand)
}

/// What runs a program with a display, without which Firefox has no WebGL: nothing where there is one, else a display in memory.
pub fn display() -> Result<&'static [&'static str]> {
    if !cfg!(target_os = "linux") || std::env::var_os("DISPLAY").is_some() {
        return Ok(&[]);
    }
    let find = || ["xvfb-run", "xauth"].iter().all(|name| shell::find(name).is_some()).then_some(());
    let by_hand = "Firefox needs a display: run this on a desktop, or install Xvfb with xvfb-run (Debian: `xvfb`, `xauth` and `libgl1-mesa-dri`)";
    found_or_installed(find, "Xvfb", &["xvfb", "xauth", "libgl1-mesa-dri"], by_hand)?;
    Ok(&["xvfb-run", "-a"])
}

/// nginx, for which the documentation has a configuration: where Debian, other systems and Homebrew put it, or a fresh installation.
pub fn nginx() -> Result<PathBuf> {
    let find = || {
        let places =
            ["/usr/sbin/nginx", "/usr/local/bin/nginx", "/opt/homebrew/bin/nginx"].map(PathBuf::from);
        shell::find("nginx").or_else(|| places.into_iter().find(|path| path.is_file()))
    };
    let by_hand =
        "nginx is needed, to test the configuration of docs/hosting.md: install it (Debian: `nginx-light`)";
    found_or_installed(find, "nginx", &["nginx-light"], by_hand)
}

/// Has a Vulkan driver for the renderer's tests: what is there, or on Debian Mesa's in software.
pub fn vulkan_driver() -> Result<()> {
    let is_named =
        ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].iter().any(|name| std::env::var_os(name).is_some());
    let folders = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"];
    let has_driver = |folder: &&str| std::fs::read_dir(folder).is_ok_and(|mut files| files.next().is_some());
    if is_named || !cfg!(target_os = "linux") || folders.iter().any(has_driver) {
        return Ok(());
    }
    let by_hand = "the tests of the renderer need a Vulkan driver: install one, such as Mesa's in software (`mesa-vulkan-drivers`)";
    install_packages("a Vulkan driver", &["mesa-vulkan-drivers"], by_hand)
}

const BY_HAND: &str = "Chromium and chromedriver are needed: install the packages `chromium` and `chromium-driver` \
                       (Debian; elsewhere any Chromium 113 or later), or set CHROMIUM and CHROMEDRIVER to their paths";

/// Installs packages of Debian; `by_hand` says what to do where that cannot be done.
pub fn install_packages(what: &str, packages: &[&str], by_hand: &'static str) -> Result<()> {
    let Some(apt) = shell::find("apt-get") else { bail!(by_hand) };
    let rights: &[&str] = match () {
        () if shell::output(&mut shell::command("id", ["-u"]))?.trim() == "0" => &[],
        () if shell::succeeds(&mut shell::command("sudo", ["-n", "true"])) => &["sudo", "-n"],
        () => bail!(by_hand),
    };
    println!("installing {what} with apt");
    let apt = apt.to_string_lossy();
    let with_rights = |args: &[&str]| -> Command {
        let words: Vec<&str> =
            rights.iter().copied().chain([apt.as_ref()]).chain(args.iter().copied()).collect();
        let mut command = shell::command(words[0], &words[1..]);
        command.env("DEBIAN_FRONTEND", "noninteractive");
        command
    };
    shell::run(&mut with_rights(&["update", "-qq"])).context(by_hand)?;
    let install = ["install", "-y", "-qq", "--no-install-recommends"];
    shell::run(&mut with_rights(&[&install, packages].concat())).context(by_hand)
}

/// `cargo test` for wasm, with `wasm-test-runner` and `browser` as the place to run; not started yet.
pub fn wasm_tests(browser: &Browser, cargo_args: &[&str]) -> Result<Command> {
    let runner = serde_json::json!([shell::wasm_test_runner()?.to_string_lossy()]);
    let config = format!("target.{}.runner={runner}", shell::WASM);
    let mut command = shell::cargo(["test", "--config", &config, "--target", shell::WASM]);
    shell::for_browsers(&mut command).args(cargo_args).env("CHROMEDRIVER", &browser.driver);
    command.env("WASM_BINDGEN_TEST_WEBDRIVER_JSON", capabilities(browser)?);
    command.envs([("WASM_BINDGEN_TEST_TIMEOUT", "300"), ("WASM_BINDGEN_TEST_DRIVER_TIMEOUT", "60")]);
    Ok(command)
}

/// `webdriver.json` with the browser that was found, so that all tests run in the same one.
fn capabilities(browser: &Browser) -> Result<PathBuf> {
    let text = std::fs::read_to_string("webdriver.json").context("webdriver.json")?;
    let mut json: serde_json::Value = serde_json::from_str(&text).context("webdriver.json")?;
    json["goog:chromeOptions"]["binary"] = browser.chromium.to_string_lossy().into();
    let file = shell::root().join("target/webdriver.json");
    std::fs::write(&file, json.to_string()).with_context(|| file.display().to_string())?;
    Ok(file)
}
