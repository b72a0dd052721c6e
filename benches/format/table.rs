//! Bytes of MT files, beside those of other forms of the same mesh, and how fast they are decoded.

use super::Result;
use super::mt_file::mt_file;
use super::sets::Set;
use std::io::{Read, Write};
use std::process::{Command, Stdio};
use std::time::Instant;
use tetralod::format::{Decoder, breakdown};
use tetralod::mesh::TetMesh;
use tetralod::mt::{MtKind, MultiTessellation};
use tetralod_build::Purpose;

/// Most points of a set of which a vertex-based MT is built, too.
const LARGE: usize = 100_000;

/// What was found of a set.
struct Found {
    name: String,
    vertices: usize,
    tets: usize,
    bits: u32,
    raw: usize,
    given: Option<u64>,
    xz: Option<usize>,
    shuffled: Option<usize>,
    edge: usize,
    /// Not measured where it would take long.
    vertex: Option<usize>,
    half_edge: usize,
    /// Million updates decoded per second.
    speed: f64,
    parts: Vec<(&'static str, f64)>,
}

pub fn run(sets: &[Set]) -> Result<()> {
    let found = sets.iter().map(measure).collect::<Result<Vec<_>>>()?;
    println!(
        "| set | vertices | tets | bits | raw | as given | xz | xz, shuffled | MT, edge | MT, vertex | MT, half-edge | decode |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    for one in &found {
        let per = |bytes: usize| format!("{:.2}", bytes as f64 / one.vertices as f64);
        let maybe = |bytes: Option<usize>| bytes.map_or("–".to_owned(), per);
        println!(
            "| {} | {} | {} | {} | {} | {} | {} | {} | **{}** | {} | {} | {:.2} |",
            one.name,
            one.vertices,
            one.tets,
            one.bits,
            per(one.raw),
            maybe(one.given.map(|bytes| bytes as usize)),
            maybe(one.xz),
            maybe(one.shuffled),
            per(one.edge),
            maybe(one.vertex),
            per(one.half_edge),
            one.speed
        );
    }
    println!("\nWhat the bytes of the edge-based files tell, in bits per vertex of the reference mesh:\n");
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in found.iter().flat_map(|one| &one.parts) {
        if !names.contains(name) {
            names.push(name);
        }
    }
    println!("| set | {} |", names.join(" | "));
    println!("|---{}|", "|--:".repeat(names.len()));
    for one in &found {
        let bits = |name: &&str| {
            let bytes: f64 = one.parts.iter().filter(|(own, _)| own == name).map(|(_, bytes)| bytes).sum();
            format!("{:.2}", 8.0 * bytes / one.vertices as f64)
        };
        println!("| {} | {} |", one.name, names.iter().map(bits).collect::<Vec<_>>().join(" | "));
    }
    Ok(())
}

fn measure(set: &Set) -> Result<Found> {
    eprintln!("{}", set.name);
    let mesh = &set.mesh;
    let raw = raw(mesh);
    let edge = mt_file(mesh, MtKind::Edge, Purpose::default())?;
    let is_small = mesh.positions.len() <= LARGE;
    let vertex = is_small.then(|| mt_file(mesh, MtKind::Vertex, Purpose::default())).transpose()?;
    let half_edge = mt_file(mesh, MtKind::HalfEdge, Purpose::default())?;
    let (decoder, speed) = decode(&edge)?;
    let mt = decoder.mt().ok_or("no MT")?;
    let mut parts = breakdown(mt).unwrap_or_default();
    let known: f64 = parts.iter().map(|(_, bytes)| bytes).sum();
    parts.push(("heads", edge.len() as f64 - known));
    parts.retain(|(_, bytes)| *bytes > 0.0);
    Ok(Found {
        name: set.name.clone(),
        vertices: mesh.positions.len(),
        tets: mesh.tets.len(),
        bits: mt.info().lattice.bits,
        raw: raw.concat().len(),
        given: set.bytes,
        xz: xz(&raw.concat()),
        shuffled: xz(&shuffled(mesh)),
        edge: edge.len(),
        vertex: vertex.map(|file| file.len()),
        half_edge: half_edge.len(),
        speed,
        parts,
    })
}

/// Positions and values as 32-bit floats, tetrahedra as 32-bit numbers.
fn raw(mesh: &TetMesh) -> [Vec<u8>; 3] {
    let floats = |values: &mut dyn Iterator<Item = f64>| {
        values.flat_map(|value| (value as f32).to_le_bytes()).collect::<Vec<u8>>()
    };
    [
        floats(&mut mesh.positions.iter().flatten().copied()),
        mesh.tets.iter().flatten().flat_map(|v| v.to_le_bytes()).collect(),
        floats(&mut mesh.fields.iter().flat_map(|field| &field.values).copied()),
    ]
}

/// The same, each column as differences from one row to the next, and of these first all lowest bytes, then the next ones.
fn shuffled(mesh: &TetMesh) -> Vec<u8> {
    let bits = |value: f64| (value as f32).to_bits();
    let mut columns: Vec<Vec<u32>> =
        (0..3).map(|axis| mesh.positions.iter().map(|p| bits(p[axis])).collect()).collect();
    columns.extend((0..4).map(|corner| mesh.tets.iter().map(|tet| tet[corner]).collect()));
    columns.extend(mesh.fields.iter().map(|field| field.values.iter().map(|&value| bits(value)).collect()));
    let mut out = Vec::new();
    for column in columns {
        let mut before = 0;
        let differences: Vec<u32> = column
            .iter()
            .map(|&value| {
                let difference = value.wrapping_sub(before) as i32;
                before = value;
                // Small ones of both signs become small numbers.
                (difference << 1 ^ difference >> 31) as u32
            })
            .collect();
        (0..4).for_each(|byte| out.extend(differences.iter().map(|value| value.to_le_bytes()[byte])));
    }
    out
}

/// How many bytes `xz -9` makes of these; none without that program.
fn xz(bytes: &[u8]) -> Option<usize> {
    let mut child = Command::new("xz")
        .args(["-9", "-T1", "-c"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .ok()?;
    let mut stdin = child.stdin.take()?;
    let mut stdout = child.stdout.take()?;
    let reader = std::thread::spawn(move || {
        let mut packed = Vec::new();
        stdout.read_to_end(&mut packed).map(|_| packed.len()).ok()
    });
    stdin.write_all(bytes).ok()?;
    drop(stdin);
    let packed = reader.join().ok()??;
    child.wait().ok()?.success().then_some(packed)
}

/// Decodes a file, the fastest of five times.
fn decode(bytes: &[u8]) -> Result<(Decoder, f64)> {
    let mut best = 0.0_f64;
    let mut last = None;
    for _ in 0..5 {
        let start = Instant::now();
        let mut decoder = Decoder::default();
        decoder.feed(bytes)?;
        decoder.finish()?;
        let updates = decoder.mt().map_or(0, MultiTessellation::updates);
        best = best.max(f64::from(updates) / start.elapsed().as_secs_f64() / 1e6);
        last = Some(decoder);
    }
    Ok((last.ok_or("never decoded")?, best))
}

/// A part of a file, in percent.
pub fn percent_of(part: u64, file: &[u8]) -> f64 {
    100.0 * part as f64 / file.len() as f64
}
