//! A walk through a model ten times as large as the memory for it.

use super::Result;
use std::cell::Cell;
use std::fs;
use std::fs::File;
use std::path::Path;
use std::rc::Rc;
use std::time::{Duration, Instant};
use tetralod::format::{DecodeOptions, Decoder};
use tetralod::geom::Bounds;
use tetralod::mt::{MultiTessellation, UpdatePages};
use tetralod::refine::{Need, Request, View};
use tetralod::session::{Client, Session};
use tetralod::stream::{Arrived, FileSource, RangeSource, StreamError, WantedRange};

/// Requests of a walk.
const STOPS: u32 = 60;

/// How many times as large as the memory the MT is.
const TIMES: u64 = 10;

/// Counts what a file is asked for.
struct Counted {
    file: FileSource<File>,
    ranges: Rc<Cell<u64>>,
}

impl RangeSource for Counted {
    fn want(&mut self, wanted: &[WantedRange]) {
        self.file.want(wanted);
    }

    fn next(&mut self, patience: Duration) -> std::result::Result<Option<Arrived>, StreamError> {
        let arrived = self.file.next(patience)?;
        self.ranges.set(self.ranges.get() + u64::from(arrived.is_some()));
        Ok(arrived)
    }

    fn total(&self) -> Option<u64> {
        self.file.total()
    }
}

pub fn run(path: &Path) -> Result<()> {
    let file_bytes = fs::metadata(path)?.len();
    let ranges = Rc::new(Cell::new(0));
    let open = |memory: u64| -> Result<Client<Counted>> {
        let source = Counted { file: FileSource::new(File::open(path)?)?, ranges: Rc::clone(&ranges) };
        Ok(Client::open(source, DecodeOptions::default(), memory)?)
    };
    let mut decoder = Decoder::default();
    decoder.feed(&fs::read(path)?)?;
    decoder.finish()?;
    let mt = decoder.into_mt().ok_or("no MT")?;
    let (info, all) = (mt.info().clone(), mt.page_bytes());
    drop(mt);
    let memory = all / TIMES;
    let start = Instant::now();
    let mut client = open(memory)?;
    let (mut most, mut most_beside, mut left_out, mut satisfied, mut largest) = (0, 0, 0, 0, 0);
    for stop in 0..STOPS {
        client.request(&request(client.session(), stop)?)?;
        let stats = loop {
            let stats = client.step(Duration::ZERO, &mut |_| true)?;
            let progress = client.session().block_progress();
            most = most.max(progress.bytes);
            if client.is_complete(&stats) {
                break stats;
            }
        };
        client.session().mesh().ok_or("no mesh")?.check()?;
        let progress = client.session().block_progress();
        left_out += u32::from(progress.left_out > 0);
        satisfied += u32::from(stats.satisfied);
        largest = largest.max(stats.tetrahedra);
        most_beside = most_beside.max(client.session().mesh_bytes());
    }
    let mega = |bytes: u64| format!("{:.1} MB", bytes as f64 / 1e6);
    println!("| | |\n|---|--:|");
    println!("| vertices of the reference mesh | {} |", info.vertices);
    println!("| tetrahedra of the reference mesh | {} |", info.tetrahedra);
    println!("| file | {} |", mega(file_bytes));
    println!("| all updates in memory | {} |", mega(all));
    println!("| memory | {} |", mega(memory));
    println!("| most that blocks took | {} |", mega(most));
    println!("| most that the current mesh took beside them | {} |", mega(most_beside));
    println!("| tetrahedra of the largest mesh | {largest} |");
    println!("| largest memory of the process | {} |", peak().map_or("not known".to_owned(), mega));
    println!("| requests of the walk | {STOPS} |");
    println!("| … met in full | {satisfied} |");
    println!("| … of which blocks were left out for lack of memory | {left_out} |");
    println!("| ranges read | {} |", ranges.get());
    println!(
        "| bytes read | {} ({:.1} times the file) |",
        mega(client.session().fetched()),
        client.session().fetched() as f64 / file_bytes as f64
    );
    println!("| time, with the checks of all meshes | {:.0} s |", start.elapsed().as_secs_f64());
    Ok(())
}

/// Boxes, isovalues and views in turn, each a little farther on.
fn request(session: &Session, stop: u32) -> Result<Request> {
    let info = session.info().ok_or("no MT")?;
    let size = f64::from(1_u32 << info.lattice.bits);
    let lattice = &info.lattice;
    let at = |p: [f64; 3]| [0, 1, 2].map(|i| lattice.origin[i] + lattice.step[i] * size * p[i]);
    let turn = f64::from(stop) / f64::from(STOPS);
    Ok(match stop % 3 {
        0 => {
            let min = [0.8 * turn, 0.8 * (1.0 - turn), 0.4];
            let region = Bounds { min: at(min), max: at(min.map(|x| x + 0.12)) };
            Need::within(0.01).inside(region).into()
        }
        1 => {
            let field = &info.fields[0];
            Need::within(0.06).around(0, &[field.min + (0.2 + 0.6 * turn) * field.range()]).into()
        }
        _ => {
            let angle = std::f64::consts::TAU * turn;
            let eye = at([0.5 + 0.8 * angle.cos(), 0.5 + 0.8 * angle.sin(), 0.5]);
            Need::seen(towards(eye, at([0.5; 3])), 10.0).into()
        }
    })
}

/// A camera that looks from one place to another, both at the same height.
fn towards(eye: [f64; 3], aim: [f64; 3]) -> View {
    let viewport = [1280.0, 720.0];
    let way = [aim[0] - eye[0], aim[1] - eye[1]];
    let length = way[0].hypot(way[1]);
    let [x, y] = way.map(|d| d / length);
    let row = |axis: [f64; 3], scale: f64| {
        let along: f64 = (0..3).map(|i| axis[i] * eye[i]).sum();
        [axis[0] * scale, axis[1] * scale, axis[2] * scale, -along * scale]
    };
    let wide = 1.7 * viewport[1] / viewport[0];
    let rows =
        [row([y, -x, 0.0], wide), row([0.0, 0.0, 1.0], 1.7), row([x, y, 0.0], 1.0), row([x, y, 0.0], 1.0)];
    View { matrix: std::array::from_fn(|i| rows[i % 4][i / 4]), viewport }
}

/// The most memory that the process ever had, where the system tells.
fn peak() -> Option<u64> {
    let text = fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().trim_end_matches("kB").trim().parse::<u64>().ok().map(|kilo| 1024 * kilo)
}
