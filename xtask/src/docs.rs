//! `cargo xtask docs`: the pages of `docs/` and a reference of the JavaScript API as a static site, by TypeDoc.

use std::path::Path;

use anyhow::{Result, bail};

use crate::{package, shell};

/// What makes the site: the configuration of TypeDoc, its theme, the list of pages, and its own dependencies. TypeDoc reads types
/// with an older version of TypeScript than `tests/js` has, so it has a `package.json` of its own.
pub const SOURCES: &str = "docs/site";

/// Where the site is.
pub const SITE: &str = "target/docs";

/// Makes the site and says where it is.
pub fn run(args: &[String]) -> Result<()> {
    if let Some(arg) = args.first() {
        bail!("`docs` takes no argument, got `{arg}`");
    }
    build()?;
    println!("the site is in {SITE}: open {SITE}/index.html, or copy the folder to a static file host");
    Ok(())
}

/// Makes the site; warnings, such as links to nowhere, are errors.
pub fn build() -> Result<()> {
    package::ensure_built(package::Profile::Tested)?;
    shell::install_node_packages(Path::new(SOURCES))?;
    let typedoc = format!("{SOURCES}/node_modules/typedoc/bin/typedoc");
    let options = format!("{SOURCES}/typedoc.config.mjs");
    shell::run(&mut shell::command("node", [typedoc.as_str(), "--options", &options, "--logLevel", "Warn"]))
}
