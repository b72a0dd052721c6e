//! `cargo xtask bench --parts`: how memory and time of each step of a build in parts grow with the mesh, and what more workers bring; writes its
//! part of `docs/benchmarks.md`.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::bench_build::{measured, number, parsed, tetrahedra};
use crate::benchmarks_page::{self, Part};
use crate::shell;

const FOLDER: &str = "target/bench/parts";

/// Points along an edge of the grids.
const SIZES: [u32; 4] = [65, 97, 129, 257];

/// In how many parts they are built.
const PARTS: &str = "64";

/// How many workers share one folder, each with one thread, and the grid that they build.
const WORKERS: [usize; 3] = [1, 2, 4];
const SHARED: u32 = 97;

const HEAD: &str = "
Written by `cargo xtask bench --parts`. Generated volumes (`bucky`) in 64 parts, each step a process of its own, by one worker with all threads
(`tetralod part`, `tetralod work`). *bytes*: the largest memory of a process of the step. What is left between parts grows with *n*² of a grid of
*n*³: so does the memory of joins, and that of the last step but for some bytes a vertex. *s*: seconds of all tasks of the step.

";

/// The largest step of all that end with one name: its tasks, seconds and bytes.
struct Step {
    name: String,
    tasks: f64,
    seconds: f64,
    bytes: f64,
}

/// Measures grids of these sizes; only all of them together, with the workers, are written to the page.
pub fn run(sizes: &[String]) -> Result<()> {
    let only = parsed("--parts", 17, sizes)?;
    let tetralod = shell::released_command()?;
    std::fs::create_dir_all(FOLDER)?;
    let mut table =
        "| grid | tetrahedra | step | tasks | s | MB | bytes a tetrahedron | bytes for each of *n*² |\n"
            .to_owned();
    table += "|--:|--:|---|--:|--:|--:|--:|--:|\n";
    let mut plot =
        "\nThe memory of the largest join (`=`) and of the last step (`#`), one sign for 10 MB:\n\n```text\n"
            .to_owned();
    for &size in if only.is_empty() { &SIZES[..] } else { &only } {
        let (steps, disk) = grown(&tetralod, size)?;
        for Step { name, tasks, seconds, bytes } in &steps {
            let (tets, plane) = (tetrahedra(size), f64::from(size * size));
            writeln!(
                table,
                "| {size}³ | {tets} | {name} | {tasks} | {seconds:.1} | {:.0} | {:.1} | {:.0} |",
                bytes / 1e6,
                bytes / tets,
                bytes / plane
            )?;
        }
        writeln!(
            table,
            "| {size}³ | {} | files of all steps | | | {:.0} | {:.1} | |",
            tetrahedra(size),
            disk / 1e6,
            disk / tetrahedra(size)
        )?;
        let most = |what: &str| {
            steps
                .iter()
                .filter(|step| step.name.contains(what))
                .map(|step| step.bytes / 1e7)
                .fold(0.0, f64::max)
        };
        for (what, sign) in [("join", "="), ("file", "#")] {
            writeln!(plot, "{size:>4}³ {}", sign.repeat(most(what).round() as usize))?;
        }
    }
    plot += "```\n";
    let workers = if only.is_empty() { workers(&tetralod)? } else { String::new() };
    let text = [&table, &plot, &workers].map(String::as_str).concat();
    println!("{text}");
    if only.is_empty() { benchmarks_page::write(Part::InParts, &[HEAD, &text].concat()) } else { Ok(()) }
}

/// Parts a grid anew; returns the folder, and the step.
fn parted(tetralod: &Path, size: u32) -> Result<(PathBuf, Step)> {
    let (input, folder) =
        (Path::new(FOLDER).join(format!("bucky{size}.vti")), Path::new(FOLDER).join(format!("{size}.parts")));
    shell::run(
        shell::command(tetralod, ["generate", "bucky", "--size", &size.to_string(), "-o"]).arg(&input),
    )?;
    remove(&folder)?;
    let mut part = shell::command(tetralod, ["part", "--json", "--parts", PARTS, "-o"]);
    let (seconds, bytes, _) = measured(part.arg(&folder).arg(&input))?;
    Ok((folder, Step { name: "`part`".to_owned(), tasks: 1.0, seconds, bytes }))
}

fn remove(folder: &Path) -> Result<()> {
    if folder.exists() {
        std::fs::remove_dir_all(folder).with_context(|| folder.display().to_string())
    } else {
        Ok(())
    }
}

/// The steps of a build, and the bytes of their files.
fn grown(tetralod: &Path, size: u32) -> Result<(Vec<Step>, f64)> {
    let (folder, part) = parted(tetralod, size)?;
    measured(shell::command(tetralod, ["work", "--json"]).arg(&folder))?;
    let status = shell::output(shell::command(tetralod, ["status", "--json"]).arg(&folder))?;
    let status: Value = serde_json::from_str(&status)?;
    let mut steps = vec![part];
    for level in status["levels"].as_array().context("no levels")? {
        let what = level["what"].as_str().context("no name of a level")?;
        let tasks = number(level, "tasks")?;
        eprintln!("{size}³, {what}: {level}");
        steps.push(Step {
            name: format!("`{what}`"),
            tasks,
            seconds: number(level, "seconds_each")? * tasks,
            bytes: number(level, "peak_memory")?,
        });
    }
    let mut disk = 0.0;
    for entry in std::fs::read_dir(&folder)? {
        disk += entry?.metadata()?.len() as f64;
    }
    remove(&folder)?;
    Ok((steps, disk))
}

/// What several workers take that build one grid, whose file must be that of one.
fn workers(tetralod: &Path) -> Result<String> {
    let mut text = format!(
        "\nWorkers with one thread each that share a folder, on {} cores ({SHARED}³, without `part`):\n\n| workers | s | file |\n|--:|--:|---|\n",
        std::thread::available_parallelism()?
    );
    let mut of_one = None;
    for count in WORKERS {
        let (folder, _) = parted(tetralod, SHARED)?;
        let start = Instant::now();
        let work = || shell::command(tetralod, ["work", "--quiet", "--threads", "1"]).arg(&folder).spawn();
        let workers = (0..count).map(|_| work()).collect::<Result<Vec<_>, _>>()?;
        for mut worker in workers {
            ensure!(worker.wait()?.success(), "a worker failed");
        }
        let seconds = start.elapsed().as_secs_f64();
        let file = std::fs::read(folder.join("built.mt"))?;
        let is_same = *of_one.get_or_insert_with(|| file.clone()) == file;
        ensure!(is_same, "the file of {count} workers is another one");
        writeln!(text, "| {count} | {seconds:.1} | the same |")?;
        remove(&folder)?;
    }
    Ok(text)
}
