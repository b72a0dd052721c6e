//! `cargo xtask demo`: the page with its data, from nothing.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::serve::Server;
use crate::{flow, package, shell};

/// Where the page looks for its volumes.
const DATA: &str = "www/data";

/// A volume of the demo: the name of its MT file, and how its data is generated and built.
struct Volume {
    name: &'static str,
    data: &'static str,
    extension: &'static str,
    size: &'static str,
    kind: &'static str,
}

/// One of each kind of MT: the page opens all alike.
const VOLUMES: [Volume; 5] = [
    Volume { name: "bucky", data: "bucky", extension: "vti", size: "65", kind: "half-edge" },
    Volume { name: "sphere-flow", data: "sphere-flow", extension: "vtu", size: "24", kind: "half-edge" },
    Volume { name: "sphere-flow-edge", data: "sphere-flow", extension: "vtu", size: "24", kind: "edge" },
    Volume { name: "sphere-flow-vertex", data: "sphere-flow", extension: "vtu", size: "24", kind: "vertex" },
    Volume { name: "bucky-explicit", data: "bucky", extension: "vti", size: "17", kind: "explicit" },
];

/// Builds all, and serves until interrupted.
pub fn run(args: &[String]) -> Result<()> {
    let (mut port, mut serve) = (8080, true);
    let mut args = args.iter();
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--no-serve" => serve = false,
            "--port" => {
                let value = args.next().context("--port needs a number")?;
                port = value.parse().with_context(|| format!("--port {value}"))?;
            }
            other => bail!("`demo` knows --port N and --no-serve, not `{other}`"),
        }
    }
    package::build(&[])?;
    let tetralod = shell::released_command()?;
    make_data(&tetralod)?;
    if serve { serve_page(&tetralod, port) } else { Ok(()) }
}

/// The largest of the demo's volumes, made if necessary: also what the benchmark measures.
pub fn bench_volume() -> Result<PathBuf> {
    make_data(&shell::released_command()?)?;
    Ok(Path::new(DATA).join("bucky.mt"))
}

/// Makes the MT files that are missing or older than the command that builds them.
pub fn make_data(tetralod: &Path) -> Result<()> {
    fs::create_dir_all(DATA)?;
    for Volume { name, data, extension, size, kind } in VOLUMES {
        let mt = Path::new(DATA).join(format!("{name}.mt"));
        if is_newer(&mt, tetralod) {
            continue;
        }
        println!("making {}", mt.display());
        let input = Path::new("target").join(format!("{name}.{extension}"));
        shell::run(shell::command(tetralod, ["generate", data, "--size", size, "-o"]).arg(&input))?;
        // Built beside and moved, so that an interrupted build is not taken for a finished one.
        let part = Path::new("target").join(format!("{name}.mt"));
        shell::run(shell::command(tetralod, ["build", "--kind", kind]).arg(&input).arg("-o").arg(&part))?;
        fs::rename(&part, &mt)?;
    }
    make_flow(tetralod)
}

/// Makes the volume with vectors and time steps.
fn make_flow(tetralod: &Path) -> Result<()> {
    let mt = Path::new(DATA).join("abc-flow.mt");
    if is_newer(&mt, tetralod) {
        return Ok(());
    }
    println!("making {}", mt.display());
    let inputs: Vec<PathBuf> =
        (0..flow::STEPS).map(|step| Path::new("target").join(format!("abc-flow-{step}.vti"))).collect();
    for (input, step) in inputs.iter().zip(0..) {
        flow::write(input, step)?;
    }
    let part = Path::new("target/abc-flow.mt");
    let fields = ["--field", "pressure", "--field", "velocity", "--unit", "velocity=m/s", "-o"];
    shell::run(shell::command(tetralod, ["build"]).args(&inputs).args(fields).arg(part))?;
    fs::rename(part, &mt).context("moving the flow")
}

fn is_newer(file: &Path, than: &Path) -> bool {
    let modified = |path: &Path| path.metadata().and_then(|data| data.modified()).ok();
    matches!((modified(file), modified(than)), (Some(file), Some(than)) if file >= than)
}

/// Serves the page as a web site would: the package at `pkg/`, everything else from `www/`.
pub fn start_server(tetralod: &Path, port: u16) -> Result<Server> {
    Server::start(tetralod, "www", &[("/pkg", package::PKG)], port)
}

fn serve_page(tetralod: &Path, port: u16) -> Result<()> {
    // Somebody else on the port is no reason to fail: any other will do.
    let server = start_server(tetralod, port).or_else(|_| start_server(tetralod, 0))?;
    println!("\nThe demo is at {}   (Ctrl-C ends it)", server.address);
    server.wait()
}
