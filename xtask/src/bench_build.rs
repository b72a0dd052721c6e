//! `cargo xtask bench --build`: what it takes to build volumes, as a whole and in parts, on one thread and on all, beside VTK's
//! decimation, and what requests find in them; writes its part of `docs/benchmarks.md`.

use std::fmt::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::benchmarks_page::{self, Part};
use crate::{bench_against_vtk, shell};

const FOLDER: &str = "target/bench";

/// Points along an edge of the grids.
const SIZES: [u32; 5] = [33, 65, 97, 129, LARGE];

/// 99.5 million tetrahedra: built only within a limit of memory, and verified by samples.
const LARGE: u32 = 256;
const SAMPLES: &str = "16";

/// Up to this size grids are built several times, and VTK decimates them, too.
const SMALL: u32 = 65;
const ROUNDS: usize = 3;

/// How each is built: a name, options, and the sizes.
const WAYS: [(&str, &[&str], Range<u32>); 6] = [
    ("whole, one thread", &["--threads", "1"], 0..LARGE),
    ("whole, all threads", &[], 0..LARGE),
    ("8 parts, one thread", &["--threads", "1", "--parts", "8"], 65..LARGE),
    ("8 parts, all threads", &["--parts", "8"], 65..LARGE),
    ("64 parts, all threads", &["--parts", "64"], 97..LARGE),
    ("--memory 8G, all threads", &["--memory", "8G"], LARGE..u32::MAX),
];

/// What VTK is asked to keep of the tetrahedra.
const KEPT: &str = "0.02";

/// A box of a 64th of the volume, in its middle.
const BOX: &str = "0.375,0.375,0.375,0.625,0.625,0.625";

const HEAD: &str = "
Written by `cargo xtask bench --build`. Half-edge MTs of generated volumes (`bucky`), built with no options but those named, from the
`.vti` file to the MT file. *tets a second*: those that are removed, by the time of the whole command. *ns/(n log2 n)*: that time for n
tetrahedra; it would stay the same if time grew like n log n. *bytes a tet*: the largest memory of the process. VTK's
`vtkUnstructuredGridQuadricDecimation` keeps 2 % of the tetrahedra, on one thread: without reading and writing, without a hierarchy, and
without a bound of the error.

";

const FOUND: &str = "
What requests find in these files: tetrahedra of meshes within 5, 1 and 0.2 % of the field's range, of one within 1 % in a box of a 64th
of the volume and coarse outside of it, and what of the file is read for two of them. The file does not depend on the number of threads.

";

/// A way to build, for each round.
struct Way {
    name: String,
    seconds: Vec<f64>,
    /// The most of all rounds.
    bytes: f64,
    removed: f64,
    file: Option<PathBuf>,
}

/// Measures grids of these sizes; only all of them together are written to the page.
pub fn run(sizes: &[String]) -> Result<()> {
    let only = parsed("--build", 9, sizes)?;
    let tetralod = shell::released_command()?;
    std::fs::create_dir_all(FOLDER)?;
    let mut times =
        "| grid | tetrahedra | | seconds | tets a second | ns/(n log2 n) | bytes a tet | file kB |\n"
            .to_owned();
    times += "|--:|--:|---|--:|--:|--:|--:|--:|\n";
    let mut found =
        "| grid | | at 5 % | at 1 % | at 0.2 % | box at 1 % | kB for 1 % | kB for the box |\n".to_owned();
    found += "|--:|---|--:|--:|--:|--:|--:|--:|\n";
    let mut verified = String::new();
    for &size in if only.is_empty() { &SIZES[..] } else { &only } {
        let tetrahedra = tetrahedra(size);
        for way in measure(&tetralod, size)? {
            eprintln!("{size}³, {}: {:.2?} s", way.name, way.seconds);
            let seconds = median(way.seconds);
            let unit = 1e9 * seconds / (tetrahedra * tetrahedra.log2());
            let (rate, bytes) = (way.removed / seconds, way.bytes / tetrahedra);
            write!(
                times,
                "| {size}³ | {tetrahedra} | {} | {seconds:.1} | {rate:.0} | {unit:.0} | {bytes:.0} |",
                way.name
            )?;
            let Some(file) = way.file else {
                times += " – |\n";
                continue;
            };
            writeln!(times, " {:.0} |", file.metadata()?.len() as f64 / 1e3)?;
            if !way.name.ends_with("one thread") {
                writeln!(
                    found,
                    "| {size}³ | {} {}|",
                    way.name.replace(", all threads", ""),
                    requests(&tetralod, &file)?
                )?;
            }
            if size >= LARGE {
                verified += &verify(&tetralod, size, &file)?;
            }
        }
    }
    let table = [&times, FOUND, &found, &verified].concat();
    println!("{table}");
    if only.is_empty() { benchmarks_page::write(Part::Builds, &[HEAD, &table].concat()) } else { Ok(()) }
}

/// The points along an edge of the grids that an option is given, which takes no fewer than `least`.
pub fn parsed(option: &str, least: u32, sizes: &[String]) -> Result<Vec<u32>> {
    let size = |text: &String| text.parse().ok().filter(|size| (least..=1024).contains(size));
    let all: Option<Vec<u32>> = sizes.iter().map(size).collect();
    all.with_context(|| {
        format!("`bench {option}` takes points along an edge of the grids, {least} to 1024, or nothing")
    })
}

/// Of a grid of `size`³ points, each of whose cells has six.
pub fn tetrahedra(size: u32) -> f64 {
    6.0 * f64::from(size - 1).powi(3)
}

fn volume(size: u32) -> PathBuf {
    Path::new(FOLDER).join(format!("bucky{size}.vti"))
}

/// All ways, one after the other in each round, so that what else the machine does meets all alike.
fn measure(tetralod: &Path, size: u32) -> Result<Vec<Way>> {
    let input = volume(size);
    shell::run(
        shell::command(tetralod, ["generate", "bucky", "--size", &size.to_string(), "-o"]).arg(&input),
    )?;
    let rounds = if size <= SMALL { ROUNDS } else { 1 };
    let mut ways = Vec::new();
    for (i, (name, options, sizes)) in (0..).zip(WAYS) {
        let file = Path::new(FOLDER).join(format!("build-{size}-{i}.mt"));
        if sizes.contains(&size) {
            ways.push((
                Way {
                    name: name.to_owned(),
                    seconds: Vec::new(),
                    bytes: 0.0,
                    removed: 0.0,
                    file: Some(file),
                },
                options,
            ));
        }
    }
    let mut vtk = Way { name: "VTK".to_owned(), seconds: Vec::new(), bytes: 0.0, removed: 0.0, file: None };
    for _ in 0..rounds {
        for (way, options) in &mut ways {
            let Some(file) = &way.file else { continue };
            let mut build = shell::command(tetralod, ["build", "--json", "--repair", "none", "-o"]);
            let (seconds, bytes, report) = measured(build.arg(file).arg(&input).args(options.iter()))?;
            way.seconds.push(seconds);
            way.bytes = way.bytes.max(bytes);
            way.removed = number(&report, "tetrahedra")? - number(&report, "base_tetrahedra")?;
        }
        if size <= SMALL {
            let (seconds, bytes, left) = decimated(&input)?;
            vtk.seconds.push(seconds);
            (vtk.bytes, vtk.removed) = (vtk.bytes.max(bytes), tetrahedra(size) - left);
        }
    }
    let mut ways: Vec<Way> = ways.into_iter().map(|(way, _)| way).collect();
    ways.extend(Some(vtk).filter(|vtk| !vtk.seconds.is_empty()));
    Ok(ways)
}

/// Seconds and bytes that VTK takes, and how many tetrahedra it leaves.
fn decimated(input: &Path) -> Result<(f64, f64, f64)> {
    let (mesh, out) = (Path::new(FOLDER).join("vtk-input.vtu"), Path::new(FOLDER).join("vtk-output.vtu"));
    let quality = bench_against_vtk::compiled("quality")?;
    let field = shell::output(shell::command(quality, ["tetrahedra"]).arg(input).arg(&mesh))?;
    let mut command = shell::command(bench_against_vtk::python()?, ["benches/against_vtk/decimate.py"]);
    let report = shell::output(command.arg(&mesh).arg(field.trim()).arg(KEPT).arg(out))?;
    let report: Value = serde_json::from_str(&report)?;
    Ok((number(&report, "seconds")?, number(&report, "bytes")?, number(&report, "tets")?))
}

/// The columns of what requests find in a file.
fn requests(tetralod: &Path, file: &Path) -> Result<String> {
    let extract = |options: &[&str]| -> Result<Value> {
        let out = Path::new(FOLDER).join("extracted.npz");
        let mut command = shell::command(tetralod, ["extract", "--json", "-o"]);
        Ok(serde_json::from_str(&shell::output(command.arg(out).arg(file).args(options))?)?)
    };
    let whole = extract(&["--error", "1%"])?;
    let part = extract(&["--error", "1%", "--box", BOX])?;
    let mut row = String::new();
    for report in [&extract(&["--error", "5%"])?, &whole, &extract(&["--error", "0.2%"])?, &part] {
        write!(row, "| {} ", number(report, "tetrahedra")?)?;
    }
    for report in [&whole, &part] {
        write!(row, "| {:.0} ", number(report, "bytes_read")? / 1e3)?;
    }
    Ok(row)
}

/// What samples of a file say of it.
fn verify(tetralod: &Path, size: u32, file: &Path) -> Result<String> {
    let mut command = shell::command(tetralod, ["verify", "--json", "--samples", SAMPLES, "--against"]);
    let (seconds, bytes, report) = measured(command.arg(volume(size)).arg(file))?;
    Ok(format!(
        "\n`tetralod verify --samples {SAMPLES}` on {size}³: no broken promise, the worst error is {:.0} % of what is promised; {:.0} MB \
         of the file read, {seconds:.0} s, {:.1} GB of memory, most of it for the input.\n",
        100.0 * number(&report, "worst_error_ratio")?,
        number(&report, "bytes_read")? / 1e6,
        bytes / 1e9
    ))
}

/// Runs a command that prints JSON: its seconds, the most memory that it had in bytes, and what it prints.
pub fn measured(command: &mut Command) -> Result<(f64, f64, Value)> {
    let start = Instant::now();
    let mut child = command.stdout(Stdio::piped()).spawn()?;
    let status = format!("/proc/{}/status", child.id());
    let mut most = f64::NAN;
    loop {
        // The peak is kept by the system; it is read until the process is gone.
        if let Some(kilobytes) = std::fs::read_to_string(&status).ok().and_then(|text| peak(&text)) {
            most = kilobytes * 1024.0;
        }
        // What it prints is little and fits the pipe.
        if child.try_wait()?.is_some() {
            let seconds = start.elapsed().as_secs_f64();
            let output = child.wait_with_output()?;
            ensure!(output.status.success(), "{command:?} failed");
            return Ok((seconds, most, serde_json::from_slice(&output.stdout)?));
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn peak(status: &str) -> Option<f64> {
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

pub fn number(report: &Value, name: &str) -> Result<f64> {
    report.get(name).and_then(Value::as_f64).with_context(|| format!("no {name} in {report}"))
}

fn median(mut list: Vec<f64>) -> f64 {
    list.sort_by(f64::total_cmp);
    list.get(list.len() / 2).copied().unwrap_or(f64::NAN)
}
