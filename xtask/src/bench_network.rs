//! `cargo xtask bench --network`: what requests cost over a network, in virtual time; writes its part of `docs/benchmarks.md`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::bench_format::{absolute, bench};
use crate::benchmarks_page::{self, Part};
use crate::shell;

const FOLDER: &str = "target/bench";

/// Generated volumes, by points along a side, and one that is built within a limit of memory.
const SIZES: [u32; 4] = [33, 65, 97, 129];
const LARGE: u32 = 256;

/// Files of data sets that may be volumes, by how their names end.
const ENDINGS: [&str; 5] = ["vtu", "vti", "vtk", "msh", "mesh"];

const HEAD: &str = "
Written by `cargo xtask bench --network`, the same on every machine. Over a link with 40 ms from asking to the first byte and 20 Mbit/s on
each of six connections, in the time of that link, without the time that the engine takes. Boxes of a quarter of each side, a 64th of the
box around the model, with error 0, and in the middle with 1 and 0.1 % of the range; one of a twentieth of each side in the lowest corner, in
generated volumes a place where nothing varies; isosurfaces at the middle value. The share of the updates that are applied is what the
partial order makes necessary: no way to cut the file into blocks can do with less. *rounds*: how often something is asked for while
nothing is on its way, opening the file included, which takes one or two. *missed*: blocks that the mesh needed though the index says
that it cannot. *HTTP/2*: 24 requests at a time share one such connection. *whole file*: how long it takes on one connection. Data sets
are left out that are no volume, have no field or fewer than 1000 points.

";

/// Measures these sets, or all that the page has; only all of them together are written there.
pub fn run(sets: &[String]) -> Result<()> {
    if !sets.is_empty() {
        println!("{}", bench("requests", &sets.iter().map(named).collect::<Result<Vec<_>>>()?)?);
        return Ok(());
    }
    let mut inputs: Vec<String> = SIZES.iter().map(|size| format!("bucky:{size}")).collect();
    if let Some(data) = std::env::var_os("TETRALOD_DATA").map(PathBuf::from) {
        for folder in [data.clone(), data.join("native"), data.join("field")] {
            inputs.extend(files(&folder)?);
        }
    }
    inputs.push(absolute(&large()?)?);
    benchmarks_page::write(Part::Network, &[HEAD, &bench("requests", &inputs)?].concat())
}

/// A set as the benchmark finds it: it runs in another folder.
fn named(set: &String) -> Result<String> {
    if set.starts_with("bucky:") { Ok(set.clone()) } else { absolute(Path::new(set)) }
}

fn files(folder: &Path) -> Result<Vec<String>> {
    let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    paths.retain(|path| ENDINGS.iter().any(|&ending| path.extension().is_some_and(|found| found == ending)));
    paths.sort();
    paths.iter().map(|path| absolute(path)).collect()
}

/// A file of 99.5 million tetrahedra. It takes an hour: one that is there stays.
fn large() -> Result<PathBuf> {
    let tetralod = shell::released_command()?;
    std::fs::create_dir_all(FOLDER)?;
    let [volume, file] = ["vti", "mt"]
        .map(|ending| Path::new(FOLDER).join(format!("bucky {LARGE}³, generated, half-edge.{ending}")));
    if file.exists() {
        return Ok(file);
    }
    let size = LARGE.to_string();
    shell::run(shell::command(&tetralod, ["generate", "bucky", "--size", &size, "-o"]).arg(&volume))?;
    shell::run(
        shell::command(&tetralod, ["build", "--memory", "8G", "--quiet"]).arg(&volume).arg("-o").arg(&file),
    )?;
    Ok(file)
}
