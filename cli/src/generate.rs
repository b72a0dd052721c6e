//! `tetralod generate`: data for trying things out, made by code.

use super::files;
use anyhow::{Result, bail};
use clap::builder::PossibleValuesParser;
use std::path::PathBuf;
use tetralod::{generate, io};

/// Makes a data set to try things out with.
#[derive(clap::Args)]
pub struct Arguments {
    /// What to make.
    #[arg(value_parser = PossibleValuesParser::new(generate::NAMES))]
    name: String,
    /// Points along an edge.
    #[arg(long, value_name = "N")]
    size: u32,
    /// The file to write: .vtu for tetrahedra, .vti for a regular grid.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let path = &arguments.output;
    let ending = files::ending(path);
    if !["vtu", "vti"].contains(&ending.as_str()) {
        bail!("{}: the name must end in .vtu or .vti", path.display());
    }
    files::check_output(path, [])?;
    let mesh = generate::by_name(&arguments.name, arguments.size)?;
    files::write_file(path, |out| match ending.as_str() {
        "vti" => Ok(io::write_vti(&mesh, out)?),
        _ => Ok(io::write_vtu(&mesh, out)?),
    })
}
