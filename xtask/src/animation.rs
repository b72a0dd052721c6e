//! `cargo xtask animation`: records the picture that README.md begins with, in the demo's page.

use anyhow::{Result, bail};

use crate::{browser, demo, package, shell};

/// What README.md shows.
const FILE: &str = "docs/flow-past-sphere.gif";

pub fn run(args: &[String]) -> Result<()> {
    if let Some(argument) = args.first() {
        bail!("`animation` takes no argument, got `{argument}`");
    }
    package::ensure_built(package::Profile::Released)?;
    let tetralod = shell::tested_command()?;
    demo::make_data(&tetralod)?;
    let server = demo::start_server(&tetralod, 0)?;
    let mut command = shell::command("node", ["xtask/js/animation.mjs", FILE]);
    shell::run(command.env("TETRALOD_PAGE", &server.address).env("CHROMIUM", browser::require()?.chromium))
}
