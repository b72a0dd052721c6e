//! `cargo xtask demo`: the page with its data, from nothing.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::thread;

use anyhow::{Context, Result, anyhow, bail};

use crate::serve::Server;
use crate::volumes::{self, BEFORE_PAGE, DATA, Volume, Volumes};
use crate::{browser, package, shell};

/// The memory that the large volume takes to build, in KiB: some 130 bytes a tetrahedron, and its data.
const LARGE_MEMORY: u64 = 3 << 20;

/// Builds what the page needs first, and serves until interrupted. The rest of the package and of the volumes is made meanwhile.
pub fn run(args: &[String]) -> Result<()> {
    let (mut port, mut serve, mut small) = (8080, true, false);
    let mut args = args.iter();
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--no-serve" => serve = false,
            "--small" => small = true,
            "--port" => {
                let value = args.next().context("--port needs a number")?;
                port = value.parse().with_context(|| format!("--port {value}"))?;
            }
            other => bail!("`demo` knows --port N, --small and --no-serve, not `{other}`"),
        }
    }
    // Both take minutes: side by side, no core is idle.
    let viewer = thread::spawn(package::build_viewer);
    let tetralod = shell::demo_command()?;
    let volumes = Volumes::read()?;
    let (first, rest) = volumes.small.split_at(BEFORE_PAGE);
    make_volumes(&tetralod, if serve { first } else { &volumes.small }, 1)?;
    viewer.join().map_err(|_| anyhow!("a thread that builds the viewer panicked"))??;
    if !serve {
        draw_all(&volumes)?;
        return package::build_released();
    }
    let mut rest = rest.to_vec();
    rest.extend((!small && has_memory()).then(|| volumes.large.clone()));
    volumes.write_list(&tetralod, &rest)?;
    let made = tetralod.clone();
    thread::spawn(move || make_rest(&made, &volumes, &rest));
    serve_page(&tetralod, port)
}

/// Makes the volumes that the page does without at first with what the machine has left, and thumbnails. An error does not end the
/// page.
fn make_rest(tetralod: &Path, volumes: &Volumes, rest: &[Volume]) {
    let prefix: &[&str] = if shell::find("nice").is_some() { &["nice", "-n", "19"] } else { &[] };
    for (i, volume) in rest.iter().enumerate() {
        let made = volumes::make(tetralod, volume, prefix);
        // What is there is listed before the next is made, and before there are thumbnails, and also where they fail.
        let listed = volumes.write_list(tetralod, &rest[i + 1..]);
        for error in [made, listed].into_iter().filter_map(Result::err) {
            eprintln!("a volume was not made: {error:#}");
        }
    }
    if let Err(error) = draw_all(volumes) {
        eprintln!("{error:#}");
    }
}

/// Draws the thumbnails of all volumes that are there.
fn draw_all(volumes: &Volumes) -> Result<()> {
    let tetralod = shell::tested_command()?;
    volumes.draw(&tetralod);
    volumes.write_list(&tetralod, &[])
}

/// Whether there is memory for the large volume. Where the system does not say, there is.
fn has_memory() -> bool {
    let available = fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        let line = text.lines().find(|line| line.starts_with("MemAvailable:"))?;
        line.split_whitespace().nth(1)?.parse::<u64>().ok()
    });
    let is_enough = available.is_none_or(|kilobytes| kilobytes >= LARGE_MEMORY);
    if !is_enough {
        println!("the large volume is left out: it needs {} GiB of free memory", LARGE_MEMORY >> 20);
    }
    is_enough
}

/// The largest of the demo's small volumes, made if necessary: also what the benchmark measures.
pub fn bench_volume() -> Result<PathBuf> {
    make_data(&shell::tested_command()?)?;
    Ok(Path::new(DATA).join("bucky.mt"))
}

/// Makes the small volumes that are missing or older than the command that builds them, with thumbnails, and the list of all.
pub fn make_data(tetralod: &Path) -> Result<()> {
    // Most of a build takes one core.
    let volumes = Volumes::read()?;
    make_volumes(tetralod, &volumes.small, 2)?;
    volumes.draw(tetralod);
    volumes.write_list(tetralod, &[])
}

/// Makes volumes, so many at a time.
fn make_volumes(tetralod: &Path, volumes: &[Volume], at_a_time: usize) -> Result<()> {
    fs::create_dir_all(DATA)?;
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some(volume) = volumes.get(next.fetch_add(1, Relaxed)) {
            volumes::make(tetralod, volume, &[])?;
        }
        Ok(())
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..at_a_time).map(|_| scope.spawn(work)).collect();
        let panicked = |_| anyhow!("a thread that makes volumes panicked");
        workers.into_iter().try_for_each(|worker| worker.join().map_err(panicked)?)
    })
}

/// Makes the volumes of the demo, and the large one.
pub fn make_all(tetralod: &Path) -> Result<()> {
    fs::create_dir_all(DATA)?;
    volumes::make(tetralod, &Volumes::read()?.large, &[])?;
    make_data(tetralod)
}

/// Serves the page as a web site would: the package at `pkg/`, everything else from `www/`.
pub fn start_server(tetralod: &Path, port: u16) -> Result<Server> {
    Server::start(tetralod, "www", &[("/pkg", package::PKG)], port)
}

/// A script of Node that drives the page in Chromium, and what serves the page as long as it is there.
pub fn page_script(tetralod: &Path, words: &[&str]) -> Result<(Server, Command)> {
    let server = start_server(tetralod, 0)?;
    let mut command = shell::command("node", words);
    command.env("TETRALOD_PAGE", &server.address).env("CHROMIUM", browser::require()?.chromium);
    Ok((server, command))
}

fn serve_page(tetralod: &Path, port: u16) -> Result<()> {
    // Somebody else on the port is no reason to fail: any other will do.
    let server = start_server(tetralod, port).or_else(|_| start_server(tetralod, 0))?;
    let address = format!("\nThe demo is at {}   (Ctrl-C ends it)", server.address);
    println!("{address}");
    // What the page does not load by itself: above all the module that builds files dropped on it.
    thread::spawn(move || match package::build_released() {
        Ok(()) => println!("{address}"),
        Err(error) => eprintln!("the page cannot build meshes: {error:#}"),
    });
    server.wait()
}
