//! What requests cost over a network.

use super::Result;
use super::mt_file::mt_file;
use super::network::{Cost, Network, Protocol, Visitor};
use super::sets;
use super::table::percent_of;
use std::fs;
use std::path::Path;
use tetralod::geom::Bounds;
use tetralod::mt::{MtInfo, MtKind};
use tetralod::refine::{Need, Request};
use tetralod::stream::LoaderOptions;
use tetralod_build::Purpose;

/// What half-edge MTs, which come in blocks, are built for.
const WAYS: [(&str, Purpose); 2] =
    [("half-edge", Purpose::Uniform), ("half-edge for regions", Purpose::Regions)];

/// Boxes that meet the model: a name, where they begin and how long they are along each side, and the error inside.
const BOXES: [(&str, f64, f64, f64); 6] = [
    ("box, low", 0.1, 0.25, 0.0),
    ("box, middle", 0.375, 0.25, 0.0),
    ("box, high", 0.65, 0.25, 0.0),
    ("box, middle, 0.1 %", 0.375, 0.25, 0.001),
    ("box, middle, 1 %", 0.375, 0.25, 0.01),
    ("box, corner, 1 %", 0.0, 0.05, 0.01),
];

/// A link from afar: 20 Mbit/s on each connection.
const NETWORK: Network = Network { latency_ms: 40.0, bytes_per_ms: 2500.0, protocol: Protocol::Http1 };

/// What takes longest beside the rest of the file, once that is open.
struct Slowest {
    ratio: f64,
    case: String,
}

pub fn run(inputs: &[&str]) -> Result<()> {
    println!(
        "| set | request | updates applied % | blocks fetched % | file sent % | rounds | requests | sent twice % | missed | s | s, HTTP/2 | whole file s |"
    );
    println!("|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    let mut slowest = Slowest { ratio: 0.0, case: String::new() };
    for &input in inputs {
        if input.ends_with(".mt") {
            let name = Path::new(input).file_stem().ok_or("a file without a name")?;
            rows(&name.to_string_lossy(), &fs::read(input)?, &mut slowest)?;
            continue;
        }
        for set in sets::all(&[input])? {
            // Presets are compared on what is generated.
            let ways = if set.bytes.is_some() { &WAYS[..1] } else { &WAYS };
            for (way, purpose) in ways {
                let file = mt_file(&set.mesh, MtKind::HalfEdge, *purpose)?;
                rows(&format!("{}, {way}", set.name), &file, &mut slowest)?;
            }
        }
    }
    println!(
        "\nOnce the file is open, no request takes more than {:.2} times as long as the rest of the file on one connection; that is {}.",
        slowest.ratio, slowest.case
    );
    Ok(())
}

/// Prints what each request needs of a file, and costs over the network.
fn rows(set: &str, file: &[u8], slowest: &mut Slowest) -> Result<()> {
    eprintln!("{set}");
    let mut first = Visitor::new(file, NETWORK, LoaderOptions::default());
    first.open();
    let info = first.session.info().ok_or("no MT")?;
    let bounds = first.session.bounds().ok_or("no MT")?;
    let seconds = |bytes: u64| (NETWORK.latency_ms + bytes as f64 / NETWORK.bytes_per_ms) / 1000.0;
    for (name, request) in requests(&bounds, info) {
        let mut visitor = Visitor::new(file, NETWORK, LoaderOptions::default());
        let opened = visitor.open();
        let cost = visitor.refine(&request)?;
        let ratio = cost.seconds / seconds(file.len() as u64 - opened.bytes);
        if ratio > slowest.ratio {
            *slowest = Slowest { ratio, case: format!("{name} of {set}") };
        }
        let mut other =
            Visitor::new(file, Network { protocol: Protocol::Http2, ..NETWORK }, LoaderOptions::default());
        let both = |one: Cost, two: Cost| one.seconds + two.seconds;
        let by_streams = both(other.open(), other.refine(&request)?);
        let progress = visitor.session.block_progress();
        println!(
            "| {set} | {name} | {:.1} | {:.1} | {:.1} | {} | {} | {:.1} | {} | {:.2} | {by_streams:.2} | {:.2} |",
            100.0 * f64::from(visitor.stats.applied) / f64::from(info.updates.max(1)),
            100.0 * f64::from(progress.here) / f64::from(progress.blocks.max(1)),
            percent_of(opened.bytes + cost.bytes, file),
            opened.rounds + cost.rounds,
            opened.requests + cost.requests,
            percent_of(cost.repeated, file),
            progress.missed,
            both(opened, cost),
            seconds(file.len() as u64),
        );
    }
    Ok(())
}

fn requests(whole: &Bounds, info: &MtInfo) -> Vec<(&'static str, Request)> {
    let at = |part: f64| [0, 1, 2].map(|i| whole.min[i] + part * (whole.max[i] - whole.min[i]));
    let boxes = BOXES.map(|(name, part, side, error)| {
        let region = Bounds { min: at(part), max: at(part + side) };
        (name, Need::within(error).inside(region).into())
    });
    let field = &info.fields[0];
    let value = 0.5 * (field.min + field.max);
    let surface = |error| Need::within(error).around(0, &[value]).into();
    let others =
        [("isosurface, 1 %", surface(0.01)), ("isosurface", surface(0.0)), ("1 %", Request::within(0.01))];
    boxes.into_iter().chain(others).collect()
}
