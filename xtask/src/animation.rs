//! `cargo xtask animation`: records the picture that README.md begins with, in the demo's page.

use anyhow::{Result, bail};

use crate::{demo, package, shell};

/// What README.md shows.
const FILE: &str = "docs/flow-past-sphere.gif";

pub fn run(args: &[String]) -> Result<()> {
    if let Some(argument) = args.first() {
        bail!("`animation` takes no argument, got `{argument}`");
    }
    package::ensure_built(package::Profile::Released)?;
    let tetralod = shell::tested_command()?;
    demo::make_data(&tetralod)?;
    let (_server, mut script) = demo::page_script(&tetralod, &["xtask/js/animation.mjs", FILE])?;
    shell::run(&mut script)
}
