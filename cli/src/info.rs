//! `tetralod info`: what is in an MT file.

use super::files::{Opened, PATIENCE};
use super::{extremes, files, output};
use anyhow::{Context, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use tetralod::format;
use tetralod::format::{ErrorBytes, ExactStatus};
use tetralod::mesh::{Averaged, Extreme, Extremes, VectorPart};
use tetralod::mt::{self, FieldInfo, MtInfo, MtKind, MultiTessellation, RegionInfo, stats};
use tetralod::refine::Request;

/// Describes the content of an MT file. Of large files only what stands in front of the updates is read.
#[derive(clap::Args)]
pub struct Arguments {
    /// The MT file, or its http(s) address.
    file: PathBuf,
    /// Read a file of more than 4 MiB to its end, too: check its bytes, and tell what its structure costs, for which all updates are
    /// applied once (about 60 bytes of memory for each tetrahedron).
    #[arg(long)]
    full: bool,
    /// Read no more than what stands in front of the updates of a smaller file, too.
    #[arg(long, conflicts_with = "full")]
    head: bool,
    /// Print a JSON object.
    #[arg(long)]
    json: bool,
}

/// The description as programs get it.
#[derive(Serialize)]
struct Report {
    kind: &'static str,
    /// The kind, for people.
    #[serde(skip)]
    updates_are: &'static str,
    vertices: u32,
    tetrahedra: u64,
    base_vertices: u32,
    base_tetrahedra: u32,
    updates: u32,
    /// Whether tetrahedra have errors of their own.
    tet_errors: bool,
    file_bytes: u64,
    bytes_per_vertex: f64,
    /// Of kind half-edge.
    #[serde(skip_serializing_if = "Option::is_none")]
    blocks: Option<Blocks>,
    fields: Vec<Field>,
    #[serde(skip_serializing_if = "Option::is_none")]
    regions: Option<Regions>,
    /// Of the reference mesh: x0, y0, z0, x1, y1, z1. Where the file was not read to its end, of all its meshes, or a little more.
    bounds: [f64; 6],
    /// Of the model, for people.
    #[serde(skip)]
    size: f64,
    position_bits: u32,
    /// How far the lattice moves a vertex at most, in model units.
    position_quantization: f64,
    /// The displacement of the boundary, in model units, that counts as an error of 1; of less in small cells.
    displacement_per_error: f64,
    /// Whether the file was read to its end.
    full: bool,
    #[serde(flatten)]
    structure: Option<Structure>,
    /// Whether the file keeps exact values: `none`, `here`, or `missing` where it is cut off.
    exact_values: &'static str,
    metadata: BTreeMap<String, String>,
}

/// What only all updates tell.
#[derive(Serialize)]
struct Structure {
    depth: u32,
    arcs_per_node: f64,
    tets_per_update: f64,
    memory: Memory,
    /// How many bytes of the file code what; symbols coded together are counted by what they describe.
    breakdown: Vec<FilePart>,
}

#[derive(Serialize)]
struct Field {
    name: String,
    #[serde(skip_serializing_if = "String::is_empty")]
    unit: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    vector: Option<VectorPart>,
    #[serde(skip_serializing_if = "Option::is_none")]
    time: Option<f64>,
    /// Whether it is a label.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    is_label: bool,
    min: f64,
    max: f64,
    bits: u32,
    /// How far the lattice rounds a value at most, in field units.
    quantization: f64,
    /// The error that is left at full resolution, as a fraction of the range.
    floor: f64,
    /// The share of the volume in each of equal bins of the range, if the file says.
    #[serde(skip_serializing_if = "Option::is_none")]
    histogram: Option<Vec<f64>>,
    /// Where the input has its smallest and largest value, if the file says.
    #[serde(skip_serializing_if = "Option::is_none")]
    extremes: Option<Extremes>,
    /// What averaging has done to it, if the input has it at cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    averaged: Option<Averaged>,
    /// What a mesh of the whole domain takes: errors fall, bytes grow.
    curve: Vec<CurvePoint>,
}

/// The parts of the volume that all meshes keep apart.
#[derive(Serialize)]
struct Regions {
    /// The arrays of the input that tell them apart.
    arrays: Vec<String>,
    /// How far interfaces between them are from those of the input in any mesh, in model units.
    deviation: f64,
    all: Vec<Region>,
}

#[derive(Serialize)]
struct Region {
    name: String,
    /// Its value in each of the arrays.
    labels: Vec<i64>,
    /// In the reference mesh, as are the next ones.
    tetrahedra: u64,
    volume: f64,
    bounds: [f64; 6],
    /// Its place in the palette of regions.
    color: u8,
}

#[derive(Clone, Serialize)]
struct CurvePoint {
    /// As a fraction of the range; null where the error may be any.
    error: Option<f64>,
    /// Of the file, from its beginning on.
    bytes: u64,
}

/// What can be fetched of the file by itself.
#[derive(Serialize)]
struct Blocks {
    count: usize,
    updates_per_block: u32,
    /// From the start of the file to the end of the index.
    index_bytes: u64,
    /// From the start of the file to its first block, or the first page of the index.
    head_bytes: u64,
    /// Pages of the index, which stand in front of the first block.
    #[serde(skip_serializing_if = "Option::is_none")]
    index_pages: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    index_page_bytes: Option<u64>,
    /// Of those that are known.
    largest_bytes: u64,
}

/// Some of the bytes of the file.
#[derive(Serialize)]
struct FilePart {
    name: &'static str,
    bytes: f64,
    bytes_per_vertex: f64,
}

#[derive(Serialize)]
struct Memory {
    /// The compact structure of this MT.
    compact_bytes: u64,
    /// The explicit structure of the same MT.
    explicit_bytes: u64,
    /// The reference mesh alone, without and with adjacency.
    indexed_bytes: u64,
    adjacency_bytes: u64,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let Arguments { file, full, head, json } = arguments;
    let what = || file.display().to_string();
    let most = if *head { 0 } else { LARGE };
    let large = if *full { None } else { open_head(file, most).with_context(what)? };
    let is_read = large.is_none();
    let opened = match large {
        Some(opened) => opened,
        None => files::open_mt(file)?,
    };
    let report = report(&opened, is_read).with_context(what)?;
    output::result(*json, &report, &rows(&report))
}

/// Files of more bytes are not read to their end unless that is asked for.
const LARGE: u64 = 4 << 20;

/// Opens a file of more than so many bytes of which the head says what is in it; none if it is another one.
fn open_head(path: &Path, most: u64) -> Result<Option<Opened>> {
    let is_small =
        files::scheme(path).is_none() && std::fs::metadata(path).is_ok_and(|found| found.len() <= most);
    // A pipe can be read only once.
    if is_small || std::fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        return Ok(None);
    }
    let mut client = files::open_parts(path)?;
    let is_large = client.total().is_some_and(|bytes| bytes > most);
    if !is_large || client.session().info().is_none_or(|info| !info.kind.is_paged()) {
        return Ok(None);
    }
    client.request(&Request::within(f64::INFINITY))?;
    while !client.fetch(PATIENCE)? {}
    Ok(Some(Opened::of(client)))
}

/// What the structure of the MT costs, and the box around the reference mesh on the lattice.
fn structure(opened: &Opened) -> Result<(Structure, [[i32; 3]; 2])> {
    let stats = stats(opened.mt()?)?;
    let structure = Structure {
        depth: stats.depth,
        arcs_per_node: stats.arcs_per_update(),
        tets_per_update: stats.inserted_per_update(),
        memory: Memory {
            compact_bytes: stats.compact_bytes,
            explicit_bytes: stats.explicit_bytes,
            indexed_bytes: stats.indexed_bytes,
            adjacency_bytes: stats.adjacency_bytes,
        },
        breakdown: breakdown(opened)?,
    };
    Ok((structure, stats.bounds))
}

fn report(opened: &Opened, is_read: bool) -> Result<Report> {
    let (mt, info) = (opened.mt()?, opened.info()?);
    let base_tetrahedra = mt.base().tets.len();
    let structure = if is_read { Some(structure(opened)?) } else { None };
    // Files need not state it.
    let found = structure.as_ref().map(|(_, bounds)| bounds.map(|corner| info.lattice.point(corner)));
    let stated = || opened.session.bounds().map(|bounds| [bounds.min, bounds.max]);
    let [[x0, y0, z0], [x1, y1, z1]] = found.or_else(stated).context("the file has no base mesh")?;
    let structure = structure.map(|(structure, _)| structure);
    let field = |(number, field): (usize, &FieldInfo)| {
        let FieldInfo { name, unit, vector, is_label, time, min, max, bits, quantization, .. } =
            field.clone();
        let (extremes, averaged) = (field.extremes.clone(), field.averaged.clone());
        let floor = info.floor(number);
        let (histogram, curve) = (opened.session.decoder().histogram(number), curve(opened, number));
        Field {
            name,
            unit,
            vector,
            time,
            is_label,
            min,
            max,
            bits,
            quantization,
            floor,
            histogram,
            extremes,
            averaged,
            curve,
        }
    };
    Ok(Report {
        kind: info.kind.name(),
        updates_are: words(info.kind),
        vertices: info.vertices,
        tetrahedra: info.tetrahedra,
        base_vertices: mt.base().positions.len() as u32,
        base_tetrahedra: base_tetrahedra as u32,
        updates: info.updates,
        tet_errors: mt.has_tet_errors(),
        file_bytes: opened.bytes,
        bytes_per_vertex: opened.bytes as f64 / f64::from(info.vertices.max(1)),
        blocks: blocks(opened),
        fields: info.fields.iter().enumerate().map(field).collect(),
        regions: mt.regions().map(|regions| described(regions, info)),
        bounds: [x0, y0, z0, x1, y1, z1],
        size: extremes::size(info),
        position_bits: info.lattice.bits,
        position_quantization: info.quantization,
        displacement_per_error: info.displacement_per_error,
        full: is_read,
        structure,
        exact_values: exact_status(opened).name(),
        metadata: opened.session.metadata().iter().cloned().collect(),
    })
}

fn described(regions: &mt::Regions, info: &MtInfo) -> Regions {
    let region = |region: &RegionInfo| {
        let [[x0, y0, z0], [x1, y1, z1]] = region.bounds.map(|corner| info.lattice.point(corner));
        Region {
            name: region.name.clone(),
            labels: region.labels.clone(),
            tetrahedra: region.tetrahedra,
            volume: region.volume,
            bounds: [x0, y0, z0, x1, y1, z1],
            color: region.color,
        }
    };
    Regions {
        arrays: regions.arrays.clone(),
        deviation: regions.deviation,
        all: regions.all.iter().map(region).collect(),
    }
}

fn curve(opened: &Opened, field: usize) -> Vec<CurvePoint> {
    let points = opened.session.bytes_by_error(field).into_iter();
    points
        .map(|ErrorBytes { error, bytes }| CurvePoint { error: Some(error).filter(|e| e.is_finite()), bytes })
        .collect()
}

/// None where the file has no index.
fn blocks(opened: &Opened) -> Option<Blocks> {
    let decoder = opened.session.decoder();
    let index = decoder.index()?;
    let head_bytes = decoder.head_end().unwrap_or(0);
    Some(Blocks {
        count: index.count() as usize,
        updates_per_block: 1 << index.block_bits,
        index_bytes: head_bytes.saturating_sub(index.shared),
        head_bytes,
        index_pages: index.is_paged().then_some(index.pages().len()),
        index_page_bytes: index.is_paged().then_some(index.first_block()),
        largest_bytes: index.known().map(|(_, block)| block.len()).max().unwrap_or(0),
    })
}

fn breakdown(opened: &Opened) -> Result<Vec<FilePart>> {
    let mut parts = format::breakdown(opened.mt()?)?;
    let blocks = blocks(opened);
    let of_index = |blocks: &Blocks| blocks.index_bytes + blocks.index_page_bytes.unwrap_or(0);
    parts.extend(blocks.as_ref().map(|blocks| ("header, description and index", of_index(blocks) as f64)));
    let known: f64 = parts.iter().map(|(_, bytes)| bytes).sum();
    let rest = match blocks {
        Some(_) if opened.mt()?.regions().is_some() => {
            "histograms, extremes, regions, heads and ends of sections"
        }
        Some(_) => "histograms, extremes, heads and ends of sections",
        None => "header, description, histograms, extremes, heads and ends of sections",
    };
    parts.push((rest, opened.bytes as f64 - known));
    // Few files keep any.
    let rare = ["exact values", "errors of tetrahedra", "values for each region"];
    parts.retain(|(name, bytes)| *bytes != 0.0 || !rare.contains(name));
    let vertices = f64::from(opened.info()?.vertices.max(1));
    let part =
        |(name, bytes): (&'static str, f64)| FilePart { name, bytes, bytes_per_vertex: bytes / vertices };
    Ok(parts.into_iter().map(part).collect())
}

/// Whether the exact values of a file are in it, also where they were not read.
fn exact_status(opened: &Opened) -> ExactStatus {
    let decoder = opened.session.decoder();
    match (decoder.exact_status(), decoder.exact_range()) {
        (ExactStatus::Missing, Some(range)) if range.end <= opened.bytes => ExactStatus::Here,
        (status, _) => status,
    }
}

/// What the updates of an MT do.
fn words(kind: MtKind) -> &'static str {
    match kind {
        MtKind::Edge => "edge collapse",
        MtKind::Vertex => "vertex insertion",
        MtKind::HalfEdge => "half-edge insertion",
    }
}

fn rounded(by: f64) -> String {
    if by == 0.0 { "exact".to_owned() } else { format!("rounded by at most {}", output::number(by)) }
}

/// Regions that are listed one by one for people.
pub const LISTED: usize = 24;

fn region_rows(regions: &Regions) -> Vec<(&str, String)> {
    let interfaces = match regions.deviation {
        0.0 => "whose interfaces are those of the input".to_owned(),
        within => format!("with interfaces within {} of those of the input", output::number(within)),
    };
    let count = regions.all.len();
    let title = format!("{} by {}, {interfaces}", output::count(count as u32), regions.arrays.join(", "));
    let mut rows = vec![("regions", title)];
    for Region { name, labels, tetrahedra, volume, .. } in regions.all.iter().take(LISTED) {
        let (tets, volume) = (output::count(*tetrahedra), output::number(*volume));
        let label = match labels[..] {
            [label] if *name != label.to_string() => format!(" ({label})"),
            _ => String::new(),
        };
        rows.push(("  region", format!("{name}{label}: {tets} tetrahedra, volume {volume}")));
    }
    if count > LISTED {
        rows.push(("", format!("{} more: --json lists all", output::count((count - LISTED) as u32))));
    }
    rows
}

/// A field for people, all its time steps in one row.
fn field_row(steps: &[Field]) -> String {
    let Field { name, unit, vector, time, is_label, min, max, bits, .. } = &steps[0];
    let part = match vector {
        Some(VectorPart { name, component: Some(component) }) => {
            format!(" (component {component} of {name})")
        }
        Some(VectorPart { name, component: None }) => format!(" (of {name})"),
        None => String::new(),
    };
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    let [min, max] = output::ends([*min, *max]);
    let worst = rounded(steps.iter().map(|step| step.quantization).fold(0.0, f64::max));
    let last = steps.last().and_then(|step| step.time);
    let time = match (*time, last) {
        (Some(first), Some(last)) if steps.len() > 1 => {
            let [first, last] = [first, last].map(output::exact);
            format!("; {} times from {first} to {last}", steps.len())
        }
        (Some(time), _) => format!("; time {}", output::exact(time)),
        _ => String::new(),
    };
    let part = if *is_label { " (label)" } else { &part };
    format!("{name}{part}: {min} to {max}{unit}, {bits} bits, {worst}{time}")
}

/// Where the input has the smallest and the largest value of a field over all its time steps, and what averaging has done to it in the step
/// that it has changed most.
fn extreme_rows(steps: &[Field], size: f64) -> Vec<(&'static str, String)> {
    let range = steps[0].max - steps[0].min;
    let all = || steps.iter().filter_map(|step| Some((step, step.extremes.as_ref()?)));
    let of_time = |step: &Field| match step.time.filter(|_| steps.len() > 1) {
        Some(time) => format!(", time {}", output::exact(time)),
        None => String::new(),
    };
    let min =
        all().min_by(|a, b| a.1.min.value.total_cmp(&b.1.min.value)).map(|(step, both)| (step, &both.min));
    let max = all().reduce(|a, b| if b.1.max.value > a.1.max.value { b } else { a });
    let max = max.map(|(step, both)| (step, &both.max));
    let row = |name, found: Option<(&Field, &Extreme)>| {
        let (step, extreme) = found?;
        Some((name, format!("{}{}", extremes::value(extreme, range, size), of_time(step))))
    };
    let changed = steps.iter().filter_map(|step| Some((step, step.averaged.as_ref()?)));
    let most = changed.reduce(|a, b| if b.1.difference.largest > a.1.difference.largest { b } else { a });
    let averaged = most.into_iter().flat_map(|(step, Averaged { input, difference })| {
        let head = ("  averaged", format!("from cells by volume{}", of_time(step)));
        let rows = extremes::averaged_rows(step.is_label, input, difference, size);
        std::iter::once(head).chain(rows)
    });
    [row("  smallest", min), row("  largest", max)].into_iter().flatten().chain(averaged).collect()
}

/// Errors at which a row says what a mesh takes, as fractions of the range.
const SHOWN_ERRORS: [f64; 5] = [0.1, 0.03, 0.01, 0.003, 0.001];

/// The bytes of meshes of a field, for people.
fn curve_row(curve: &[CurvePoint]) -> String {
    let bytes_at = |error: f64| curve.iter().find(|point| point.error.is_some_and(|known| known <= error));
    let shown = SHOWN_ERRORS.into_iter().filter_map(|error| Some((error, bytes_at(error)?.bytes)));
    let part =
        |(error, bytes): (f64, u64)| format!("{} % {}", output::number(100.0 * error), output::count(bytes));
    let all = curve.last().map(|point| format!("all {}", output::count(point.bytes)));
    shown.map(part).chain(all).collect::<Vec<_>>().join(", ")
}

/// A histogram for people, a letter a bin; heights are square roots, so that what is rare is seen.
fn histogram_row(shares: &[f64]) -> String {
    const HEIGHTS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let most = shares.iter().copied().fold(0.0, f64::max).sqrt();
    let height = |share: &f64| match share.sqrt() / most {
        part if part > 0.0 => HEIGHTS[((part * 8.0).ceil() as usize).clamp(1, 8) - 1],
        _ => ' ',
    };
    shares.iter().map(height).collect::<String>().trim_end().to_owned()
}

fn part_row(part: &FilePart, file_bytes: u64) -> String {
    let share = output::percent(part.bytes / file_bytes.max(1) as f64);
    format!("{}: {:.2} per vertex ({share})", part.name, part.bytes_per_vertex)
}

fn block_rows(blocks: &Blocks, file_bytes: u64) -> Vec<(&'static str, String)> {
    let pages = blocks.index_pages.zip(blocks.index_page_bytes);
    let pages = pages
        .map(|(count, bytes)| ("pages of the index", format!("{count}, in all {}", output::bytes(bytes))));
    let rows = [
        (
            "blocks",
            format!(
                "{} of {} updates, up to {} each",
                blocks.count,
                blocks.updates_per_block,
                output::bytes(blocks.largest_bytes)
            ),
        ),
        (
            "in front of them",
            format!(
                "{}; to the end of the index {} ({} of the file)",
                output::bytes(blocks.head_bytes),
                output::bytes(blocks.index_bytes),
                output::percent(blocks.index_bytes as f64 / file_bytes.max(1) as f64)
            ),
        ),
    ];
    rows.into_iter().chain(pages).collect()
}

fn rows(report: &Report) -> Vec<(&str, String)> {
    let axis = |i: usize| output::ends([report.bounds[i], report.bounds[i + 3]]);
    let [[x0, x1], [y0, y1], [z0, z1]] = [axis(0), axis(1), axis(2)];
    let structure = report.structure.as_ref();
    let depth = structure.map_or(String::new(), |all| format!(", at most {} deep", output::count(all.depth)));
    let mut rows = vec![
        ("kind", report.updates_are.to_owned()),
        ("reference mesh", output::mesh(report.vertices, report.tetrahedra)),
        ("base mesh", output::mesh(report.base_vertices, report.base_tetrahedra.into())),
        ("updates", format!("{}{depth}", output::count(report.updates))),
    ];
    rows.extend(structure.map(|all| {
        ("", format!("{:.2} tetrahedra, {:.2} arcs per update", all.tets_per_update, all.arcs_per_node))
    }));
    rows.extend([
        ("errors", if report.tet_errors { "of tetrahedra, 2 bits each" } else { "of updates" }.to_owned()),
        ("file size", output::bytes(report.file_bytes)),
        ("bytes per vertex", format!("{:.2}", report.bytes_per_vertex)),
    ]);
    rows.extend(report.blocks.iter().flat_map(|blocks| block_rows(blocks, report.file_bytes)));
    if let Some(Structure { memory, .. }) = structure {
        rows.extend([
            ("in memory", output::bytes(memory.compact_bytes)),
            ("  explicit", output::bytes(memory.explicit_bytes)),
            ("reference alone", output::bytes(memory.indexed_bytes)),
            ("  with adjacency", output::bytes(memory.adjacency_bytes)),
        ]);
    }
    rows.extend([
        ("bounds", format!("({x0}, {y0}, {z0}) to ({x1}, {y1}, {z1})")),
        ("position bits", format!("{}, {}", report.position_bits, rounded(report.position_quantization))),
    ]);
    let steps = |a: &Field, b: &Field| a.name == b.name;
    let size = report.size;
    for steps in report.fields.chunk_by(steps) {
        rows.push(("field", field_row(steps)));
        rows.extend(extreme_rows(steps, size));
        // Time steps are alike.
        rows.extend(steps[0].histogram.as_deref().map(|shares| ("  values", histogram_row(shares))));
        // Files without an index state their length alone.
        if report.blocks.is_some() {
            rows.push(("  bytes at error", curve_row(&steps[0].curve)));
        }
    }
    rows.extend(report.regions.iter().flat_map(region_rows));
    let parts = structure.iter().flat_map(|all| &all.breakdown);
    rows.extend(parts.map(|part| ("bytes of", part_row(part, report.file_bytes))));
    if report.exact_values != ExactStatus::None.name() {
        let is_cut = report.exact_values == ExactStatus::Missing.name();
        let text =
            if is_cut { "cut off: the file is shorter than it says" } else { "at the end of the file" };
        rows.push(("exact values", text.to_owned()));
    }
    for (key, value) in &report.metadata {
        rows.push((key, value.clone()));
    }
    if !report.full {
        rows.push((
            "",
            "the updates were not read: --full reads them, and tells what the structure costs".to_owned(),
        ));
    }
    rows
}
