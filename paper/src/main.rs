//! The experiments of Danovaro, De Floriani, Magillo, Puppo, *Data Structures for 3D Multi-Tessellations: an
//! Overview* (2003), section 6, done again: `cargo xtask paper` writes `docs/paper.md` with everything in it.
//!
//! The page is a function of the code and the data: the same on every run.
#![forbid(unsafe_code)]

mod chart;
mod figure8;
mod figures;
mod findings;
mod markdown;
mod model;
mod node_code;
mod node_table;
mod own;
mod pictures;
mod published;
mod query;
mod report;
mod table1;

use anyhow::{Context, Result, bail};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use tetralod::mesh::TetMesh;

use crate::findings::{Findings, Scan};
use crate::model::{DataSet, Recipe};
use crate::table1::Row;

/// Points along an edge of the generated bucky ball, as many as Smallbucky has.
const SIZE: u32 = 33;

/// A data set so small that a test makes its rows again and compares them with the page in the repository.
const SMALL: (&str, u32) = ("bucky, 9³ points", 9);

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<()> {
    // The first argument is the program itself.
    let mut args = std::env::args_os().skip(1);
    let (Some(folder), None) = (args.next(), args.next()) else { bail!("usage: paper FOLDER") };
    let data = std::env::var_os("TETRALOD_DATA").map(PathBuf::from);
    let mesh = tetralod_io::generate::bucky(SIZE)?;
    let findings = findings("bucky, generated", &mesh, data.as_deref())?;
    write(&findings, Path::new(&folder))
}

/// Does all experiments on a grid, and those of Table 1 on the data sets in a folder, too.
fn findings(name: &str, mesh: &TetMesh, data: Option<&Path>) -> Result<Findings> {
    let bucky = DataSet::by_insertion(
        name,
        mesh,
        &[Recipe::InsertOwn, Recipe::Edge, Recipe::Delaunay, Recipe::HalfEdge],
    )?;
    let mut rows = table1::rows(&bucky)?;
    let figure_6 =
        figures::around_isovalue(&bucky.model(Recipe::Insert).mt, 0.001, published::FIGURE_6.uniform_facets)?;
    let figure_7 = figures::in_an_octant(&bucky.model(Recipe::Edge).mt, figure_6.isovalue)?;
    let boxes = figures::boxes(&bucky)?;
    let uniform = figure8::curves(&bucky, None)?;
    let variable = figure8::curves(&bucky, Some(figure_6.isovalue))?;
    let own = own::own(&bucky)?;
    let at_zero = figures::at_zero(&bucky)?;
    drop(bucky);
    rows.extend(table1::rows(&small()?)?);
    let (missing, scan) = others(data, &mut rows)?;
    let findings =
        Findings { rows, missing, figure_6, figure_7, uniform, variable, own, boxes, at_zero, scan };
    Ok(findings)
}

fn small() -> Result<DataSet> {
    let (name, size) = SMALL;
    let others = [Recipe::InsertOwn, Recipe::Edge, Recipe::Delaunay, Recipe::HalfEdge];
    DataSet::by_insertion(name, &tetralod_io::generate::bucky(size)?, &others)
}

/// Adds the rows of the data sets that have to be there already, one in memory at a time; gives those that are not, and the
/// figures of the one that is on a grid.
fn others(folder: Option<&Path>, rows: &mut Vec<Row>) -> Result<(Vec<&'static str>, Option<Scan>)> {
    let (mut missing, mut scan) = (Vec::new(), None);
    for name in ["bucky.vti", "bluntfin_clean.vtu", "combustor.vtu"] {
        let Some(path) = folder.map(|folder| folder.join(name)).filter(|path| path.is_file()) else {
            missing.push(name);
            continue;
        };
        let mesh = model::load(&path)?;
        let data = if mesh.grid.is_some() {
            DataSet::by_insertion(name, &mesh, &[Recipe::InsertOwn, Recipe::Edge, Recipe::HalfEdge])?
        } else {
            DataSet::of_mesh(name, mesh, &[Recipe::Edge, Recipe::HalfEdge])?
        };
        rows.extend(table1::rows(&data)?);
        if data.reference.grid.is_some() {
            scan = Some(Scan::of(name, &data)?);
        }
    }
    Ok((missing, scan))
}

/// Writes the page, its plots and, where it can be done, its pictures.
fn write(findings: &Findings, folder: &Path) -> Result<()> {
    let figures = folder.join("paper");
    fs::create_dir_all(&figures).with_context(|| figures.display().to_string())?;
    let save = |path: PathBuf, text: String| {
        fs::write(&path, text).with_context(|| format!("{} could not be written", path.display()))
    };
    save(figures.join("figure-8-uniform.svg"), findings.uniform.chart())?;
    save(figures.join("figure-8-variable.svg"), findings.variable.chart())?;
    save(folder.join("paper.md"), report::page(findings))?;
    pictures(findings, &figures)
}

fn pictures(findings: &Findings, folder: &Path) -> Result<()> {
    let Some(mut painter) = pictures::Painter::new()? else {
        eprintln!(
            "no Vulkan adapter, not even Mesa's lavapipe (package mesa-vulkan-drivers): the pictures stay as they are"
        );
        return Ok(());
    };
    eprintln!("pictures on {}", painter.description());
    painter.draw(&findings.figure_6, 6, folder)?;
    painter.draw(&findings.figure_7, 7, folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_volume_gives_a_page() {
        let mesh = tetralod_io::generate::bucky(9).unwrap();
        let all = findings("small", &mesh, None).unwrap();
        assert_eq!(all.rows.len(), 2 * Recipe::ALL.len());
        for curves in [&all.uniform, &all.variable] {
            // At error 0 a uniform mesh is the reference mesh, and a larger error never needs more.
            let whole = |sizes: &Vec<u64>| curves.variable || sizes[0] == curves.reference;
            assert!(curves.curves.iter().all(|(_, sizes)| whole(sizes) && sizes.is_sorted_by(|a, b| a >= b)));
            assert!(curves.chart().ends_with("</svg>\n"));
        }
        for pair in [&all.figure_6, &all.figure_7] {
            assert!(pair.variable.tetrahedra() <= pair.uniform.tetrahedra());
        }
        let page = report::page(&all);
        assert_eq!(page.matches(table1::NOT_HERE).count(), 2 * 3, "three data sets in two tables");
        assert_eq!(page, report::page(&findings("small", &mesh, None).unwrap()), "the same on every run");
    }

    /// So the page is not older than the builders and structures that it is of.
    #[test]
    fn the_page_in_the_repository_has_the_rows_of_this_code() {
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/paper.md");
        let page = fs::read_to_string(page).unwrap();
        let rows = table1::rows(&small().unwrap()).unwrap();
        let tables = [table1::storage(&rows, &[]), table1::structure(&rows, &[]), node_table::table(&rows)];
        let lines = tables.iter().flat_map(|table| table.lines()).filter(|line| line.contains(SMALL.0));
        let missing: Vec<&str> = lines.clone().filter(|line| !page.contains(line)).collect();
        assert_eq!(missing, [""; 0], "docs/paper.md is out of date: run `cargo xtask paper`");
        assert_eq!(lines.count(), 2 * (Recipe::ALL.len() + 3) + 3, "three vertex-based MTs in both codes");
    }
}
