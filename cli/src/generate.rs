//! `tetralod generate`: data for trying things out, made by code.

use super::files;
use super::usage::refuse_usage;
use anyhow::{Result, bail};
use clap::builder::{PossibleValue, PossibleValuesParser};
use std::path::{Path, PathBuf};
use tetralod::mesh::LayeredGrid;
use tetralod_io as io;
use tetralod_io::generate::{Options, Orbital, VOLUMES, Volume, volume};

/// The volumes that have something to choose.
const HYDROGEN: &str = "hydrogen";
const SERIES: &str = "abc-flow";
/// Time steps, where no other number is given.
const STEPS: u32 = 8;

/// Makes a data set to try things out with, of any size. Grids are written layer by layer: a layer is all that takes memory.
#[derive(clap::Args)]
#[command(
    after_help = "Examples: tetralod generate hydrogen --orbital 3,1,0 --size 129 -o orbital.vti\n          \
                        tetralod generate abc-flow --size 33 --steps 4 -o flow.pvd"
)]
pub struct Arguments {
    /// What to make.
    #[arg(value_parser = PossibleValuesParser::new(VOLUMES.map(|(name, help)| PossibleValue::new(name).help(help))))]
    name: String,
    /// Points along an edge.
    #[arg(long, value_name = "N")]
    size: u32,
    /// The orbital of hydrogen, by its quantum numbers, l less than n and m from -l to l [default: 4,2,0].
    #[arg(long, value_name = "n,l,m", value_parser = orbital)]
    orbital: Option<Orbital>,
    /// Time steps of abc-flow, in a .pvd, through one period [default: 8].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    steps: Option<u32>,
    /// The file to write: .vti for a regular grid, .vtu for tetrahedra, .pvd for time steps, which are files beside it.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

fn orbital(text: &str) -> Result<Orbital> {
    let numbers: Option<Vec<i32>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    let Some([n, l, m]) = numbers.as_deref() else {
        bail!("it must be three whole numbers, as 4,2,0");
    };
    // Numbers below zero are refused as too large.
    Ok(Orbital::new(n.cast_unsigned(), l.cast_unsigned(), *m)?)
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { name, size, orbital, steps, output } = arguments;
    let ending = files::ending(output);
    if !["vtu", "vti", "pvd"].contains(&ending.as_str()) {
        bail!("{}: the name must end in .vti, .vtu or .pvd", output.display());
    }
    if orbital.is_some() && name != HYDROGEN {
        refuse_usage("--orbital goes with hydrogen");
    }
    if ending == "pvd" && name != SERIES {
        bail!(
            "{}: {name} has no time steps, as {SERIES} has; the name must end in .vti or .vtu",
            output.display()
        );
    }
    if steps.is_some() && ending != "pvd" {
        refuse_usage("--steps goes with abc-flow and a .pvd, which lists the files of the steps");
    }
    files::check_output(output, [])?;
    let options = Options { orbital: orbital.unwrap_or_default(), ..Options::default() };
    if ending == "pvd" {
        return write_series(output, *size, steps.unwrap_or(STEPS));
    }
    match volume(name, *size, &options)? {
        Volume::Grid(grid) if ending == "vti" => write_grid(&grid, output),
        Volume::Mesh(_) if ending == "vti" => {
            bail!("{}: {name} is not a regular grid: write it as .vtu", output.display())
        }
        volume => {
            let mesh = volume.into_mesh()?;
            files::write_file(output, |out| Ok(io::write_vtu(&mesh, out)?))
        }
    }
}

fn write_grid(grid: &LayeredGrid, path: &Path) -> Result<()> {
    files::write_seekable(path, |mut out| Ok(io::write_vti_layers(grid, &mut out)?))
}

/// Writes the time steps beside the list of them, which comes last: while it is there, they are.
fn write_series(list: &Path, size: u32, count: u32) -> Result<()> {
    let (Some(name), Some(stem)) = (list.file_name(), list.file_stem()) else {
        bail!("this is no name for a file; give one after -o");
    };
    let parent = list.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    files::fill_folder(parent, Path::new(name), |folder| {
        let mut steps = Vec::new();
        for step in 0..count {
            let options = Options { phase: f64::from(step) / f64::from(count), ..Options::default() };
            let name = PathBuf::from(format!("{}-{step}.vti", stem.to_string_lossy()));
            files::check_output(&parent.join(&name), [])?;
            if let Volume::Grid(grid) = volume(SERIES, size, &options)? {
                write_grid(&grid, &folder.join(&name))?;
            }
            steps.push(io::Step { path: name, time: Some(f64::from(step)), number: 0 });
        }
        files::write_file(&folder.join(name), |out| Ok(io::write_pvd(&steps, out)?))
    })
}
