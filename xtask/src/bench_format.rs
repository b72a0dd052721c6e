//! `cargo xtask bench --format`: what MT files and first pictures cost, and a model larger than the memory for it; writes its part of
//! `docs/benchmarks.md`.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::benchmarks_page::{self, Part};
use crate::shell;

/// Generated volumes in the tables, by points along a side, that of which only the first picture is measured, and that of the walk.
const SIZES: [u32; 2] = [33, 65];
const LARGER: u32 = 97;
const WALKED: u32 = 97;

const HEAD: &str = "\
# Benchmarks

Written by `cargo xtask bench --all`, over the data sets in the folder that `TETRALOD_DATA` names and generated volumes; its parts
also by commands of their own: files, first pictures and the walk by `bench --format`, the others by those that they name. Bytes and tetrahedra are
the same on every machine; speeds are of the machine that it ran on.

## Bytes

Bytes per vertex of the reference mesh, with one field. *bits* are those of the position lattice: 16, or more where thin
cells need them; fields have 16. *raw* are positions and field as 32-bit floats and tetrahedra as four 32-bit numbers; *xz*
is what `xz -9` makes of these arrays, *shuffled* of their columns as differences, byte by byte, without loss: on grids in
their natural order these differences are nearly all the same. *as given* is the file of the data set, which may hold
more than this one field. All MT files hold the whole Multi-Tessellation, not the reference mesh alone. *decode* are
million updates of the edge-based file a second on one thread, the fastest of five runs. Only sets of up to 100 000 points were built as vertex-based MTs, by half-edge collapses.
";

const PICTURE: &str = "
## The first useful picture

The isosurface at the middle value within 1 % of the field's range, on sets above 150 000 tetrahedra. *guaranteed*: the share of
the file after which the mesh is that of the request, read in the order of the file or only the ranges that it needs.
*measured*: the share, of some steps, after which the error of the field (by how much it is on the wrong side of the value at the
ends of edges that the reference isosurface crosses, in percent of the range) and the Hausdorff distance (in percent of the
diagonal) are measured to be at most 1 %; both are told beside it. The goal is 5 %.

";

const WALK: &str = "
## A model ten times as large as the room

Boxes, isovalues and views in turn, through a client whose blocks may take a tenth of what all updates take in memory. Every
mesh was checked to be valid.

";

/// Measures, and writes the page. Takes the sets of `TETRALOD_DATA`, if that is there.
pub fn run() -> Result<()> {
    let data = std::env::var_os("TETRALOD_DATA").map(PathBuf::from);
    let mut inputs: Vec<String> = SIZES.iter().map(|size| format!("bucky:{size}")).collect();
    for folder in data.iter().flat_map(|data| [data.clone(), data.join("native")]) {
        inputs.push(folder.display().to_string());
    }
    let table = bench("table", &inputs)?;
    inputs.push(format!("bucky:{LARGER}"));
    let pictures = bench("first-picture", &inputs)?;
    fs::create_dir_all("target/bench")?;
    let file = Path::new("target/bench").join(format!("bucky{WALKED}-half-edge.mt"));
    bench("make", &[WALKED.to_string(), "half-edge".to_owned(), absolute(&file)?])?;
    // A process of its own, for its memory is measured.
    let walk = bench("walk", &[absolute(&file)?])?;
    let walk = format!("The generated volume of {WALKED}³ points, kind half-edge.\n\n{walk}\n");
    let page = [HEAD, "\n", &table, PICTURE, &pictures, WALK, &walk].concat();
    benchmarks_page::write(Part::Files, &page)
}

/// Cargo runs benchmarks in the folder of their package.
pub fn absolute(path: &Path) -> Result<String> {
    Ok(shell::root().join(path).to_str().context("the folder has a name that is not UTF-8")?.to_owned())
}

/// What a benchmark of files prints.
pub fn bench(what: &str, arguments: &[String]) -> Result<String> {
    let mut command = shell::cargo(["bench", "--package", "tetralod", "--bench", "format", "--", what]);
    shell::output(command.args(arguments))
}
