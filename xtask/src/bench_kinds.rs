//! `cargo xtask bench --kinds`: how building by insertion grows, and the kinds of MT side by side.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::Value;

use crate::shell;

const FOLDER: &str = "target/bench";

/// Rounds in which all are run, one after the other, so that what else the machine does meets all alike.
const ROUNDS: usize = 5;

/// The kinds of MT that are compared: a name and how they are built.
const KINDS: [(&str, &[&str]); 4] = [
    ("edge", &["--kind", "edge"]),
    ("half-edge", &["--kind", "half-edge"]),
    ("vertex", &["--kind", "vertex"]),
    ("delaunay", &["--kind", "vertex", "--criterion", "delaunay"]),
];

/// Measures all; `large` adds a grid of 97³ points.
pub fn run(large: bool) -> Result<()> {
    let tetralod = shell::released_command()?;
    std::fs::create_dir_all(FOLDER)?;
    triangulation(&tetralod)?;
    insertion(&tetralod, if large { &[33, 65, 97] } else { &[33, 65] })?;
    for size in [33, 65] {
        kinds(&tetralod, size)?;
    }
    Ok(())
}

fn report(tetralod: &Path, args: &[&str]) -> Result<Value> {
    let json = shell::output(&mut shell::command(tetralod, args))?;
    serde_json::from_str(&json).with_context(|| format!("not a report: {json}"))
}

fn number(report: &Value, path: &str) -> Result<f64> {
    report.pointer(path).and_then(Value::as_f64).with_context(|| format!("no number {path} in {report}"))
}

fn triangulation(tetralod: &Path) -> Result<()> {
    let rates = report(tetralod, &["bench", "--delaunay", "--json"])?;
    println!("Delaunay triangulation, million tetrahedra per second");
    for (name, path) in [("grid of 33³", "/grid"), ("100,000 random points", "/random")] {
        println!("{name:<36} {:>14.2}", number(&rates, &format!("{path}/tets_per_second"))? / 1e6);
    }
    Ok(())
}

/// The grid of `size`³ points, made if it is not there.
fn bucky(tetralod: &Path, size: u32) -> Result<PathBuf> {
    let path = Path::new(FOLDER).join(format!("bucky{size}.vti"));
    if !path.exists() {
        let size = size.to_string();
        shell::run(shell::command(tetralod, ["generate", "bucky", "--size", &size, "-o"]).arg(&path))?;
    }
    Ok(path)
}

fn build(tetralod: &Path, input: &Path, mt: &Path, options: &[&str]) -> Result<f64> {
    let mut command = shell::command(tetralod, ["build", "--json"]);
    let json = shell::output(command.arg(input).arg("-o").arg(mt).args(options))?;
    number(&serde_json::from_str(&json)?, "/seconds")
}

/// Seconds to build by greedy insertion, and what they are of n log n.
fn insertion(tetralod: &Path, sizes: &[u32]) -> Result<()> {
    println!("greedy insertion, from the file to the MT file");
    println!("{:<12} {:>12} {:>12} {:>24}", "grid", "points", "seconds", "ns / (n log2 n)");
    for &size in sizes {
        let (input, mt) = (bucky(tetralod, size)?, Path::new(FOLDER).join("inserted.mt"));
        let seconds = build(tetralod, &input, &mt, &["--kind", "vertex", "--method", "insert"])?;
        let points = f64::from(size).powi(3);
        let unit = 1e9 * seconds / (points * points.log2());
        println!("{:<12} {points:>12} {seconds:>12.2} {unit:>24.0}", format!("{size}³"));
    }
    Ok(())
}

/// Rates of refinement, coarsening and decoding of each kind: medians of interleaved runs.
fn kinds(tetralod: &Path, size: u32) -> Result<()> {
    let input = bucky(tetralod, size)?;
    let mut files = Vec::new();
    for (name, options) in KINDS {
        let mt = Path::new(FOLDER).join(format!("bucky{size}-{name}.mt"));
        build(tetralod, &input, &mt, options)?;
        files.push(mt.display().to_string());
    }
    let rates = ["decode", "refine", "coarsen"].map(|part| format!("/{part}/updates_per_second"));
    let mut found = vec![[const { Vec::new() }; 3]; KINDS.len()];
    for _ in 0..ROUNDS {
        for (file, found) in files.iter().zip(&mut found) {
            let report = report(tetralod, &["bench", file, "--json"])?;
            for (path, list) in rates.iter().zip(found) {
                list.push(number(&report, path)?);
            }
        }
    }
    println!("bucky {size}³, thousand updates per second: medians of {ROUNDS} interleaved runs");
    println!("{:<12} {:>12} {:>12} {:>12}", "", "decode", "refine", "coarsen");
    for ((name, _), found) in KINDS.iter().zip(found) {
        let [decode, refine, coarsen] = found.map(|list| median(list) / 1e3);
        println!("{name:<12} {decode:>12.0} {refine:>12.0} {coarsen:>12.0}");
    }
    Ok(())
}

fn median(mut list: Vec<f64>) -> f64 {
    list.sort_by(f64::total_cmp);
    list.get(list.len() / 2).copied().unwrap_or(f64::NAN)
}
