//! What is known of a file, and what a refinement did, as JSON: Python makes objects of it.

use serde::Serialize;
use std::collections::BTreeMap;
use tetralod::format::ExactStatus;
use tetralod::geom::Bounds;
use tetralod::mesh::{Averaged, Extremes, VectorPart};
use tetralod::mt::{FieldInfo, MtInfo, MultiTessellation, Regions};
use tetralod::refine::RefineStats;
use tetralod::session::{Client, Session};
use tetralod::stream::{RangeSource, Traffic};
use tetralod::view::region_color;

#[derive(Serialize)]
struct InfoObject<'a> {
    kind: &'static str,
    vertices: u32,
    tetrahedra: u64,
    base_vertices: usize,
    base_tetrahedra: usize,
    updates: u32,
    bounds: [f64; 6],
    fields: Vec<FieldObject<'a>>,
    first_field: usize,
    regions: Option<RegionsObject<'a>>,
    surface_first: Option<bool>,
    exact_values: &'static str,
    metadata: BTreeMap<&'a str, &'a str>,
    file_bytes: Option<u64>,
}

#[derive(Serialize)]
struct FieldObject<'a> {
    index: usize,
    name: &'a str,
    unit: &'a str,
    time: Option<f64>,
    vector: Option<&'a VectorPart>,
    is_label: bool,
    min: f64,
    max: f64,
    bits: u32,
    /// In units of the field.
    floor: f64,
    histogram: Option<Vec<f64>>,
    extremes: Option<&'a Extremes>,
    averaged: Option<&'a Averaged>,
    isovalue: Option<f64>,
    curve: Curve,
}

/// What a mesh of the whole domain takes: errors in units of the field, none where any is allowed.
#[derive(Serialize)]
struct Curve {
    errors: Vec<Option<f64>>,
    bytes: Vec<u64>,
}

#[derive(Serialize)]
struct RegionsObject<'a> {
    arrays: &'a [String],
    deviation: f64,
    all: Vec<RegionObject<'a>>,
}

#[derive(Serialize)]
struct RegionObject<'a> {
    name: &'a str,
    labels: &'a [i64],
    tetrahedra: u64,
    volume: f64,
    bounds: [f64; 6],
    color: String,
}

/// What the file of a client contains; none before the base mesh is there.
pub fn info<S: RangeSource>(client: &Client<S>) -> Option<String> {
    let session = client.session();
    let (mt, info) = (session.mt()?, session.info()?);
    let Bounds { min: [x0, y0, z0], max: [x1, y1, z1] } = session.bounds()?;
    let object = InfoObject {
        kind: info.kind.name(),
        vertices: info.vertices,
        tetrahedra: info.tetrahedra,
        base_vertices: mt.base().positions.len(),
        base_tetrahedra: mt.base().tets.len(),
        updates: info.updates,
        bounds: [x0, y0, z0, x1, y1, z1],
        fields: (0..info.fields.len()).map(|index| field(session, info, index)).collect(),
        first_field: info.first_field(),
        regions: session.regions().map(|all| regions(all, info)),
        surface_first: session.surface_first(info.first_field()),
        exact_values: exact_status(session, client.total()).name(),
        metadata: session.metadata().iter().map(|(key, value)| (&**key, &**value)).collect(),
        file_bytes: client.total(),
    };
    serde_json::to_string(&object).ok()
}

/// Whether the exact values of a file are in it, also where they have not been read.
fn exact_status(session: &Session, total: Option<u64>) -> ExactStatus {
    let decoder = session.decoder();
    match (decoder.exact_status(), decoder.exact_range(), total) {
        (ExactStatus::Missing, Some(range), Some(total)) if range.end <= total => ExactStatus::Here,
        (status, ..) => status,
    }
}

fn field<'a>(session: &Session, info: &'a MtInfo, index: usize) -> FieldObject<'a> {
    let field = &info.fields[index];
    let FieldInfo { name, unit, time, vector, is_label, min, max, bits, extremes, averaged, .. } = field;
    let curve = session.bytes_by_error(index);
    let errors =
        curve.iter().map(|point| Some(point.error_in_units(field)).filter(|error| error.is_finite()));
    FieldObject {
        index,
        name,
        unit,
        time: *time,
        vector: vector.as_ref(),
        is_label: *is_label,
        min: *min,
        max: *max,
        bits: *bits,
        floor: info.floor(index) * field.range(),
        histogram: session.decoder().histogram(index),
        extremes: extremes.as_ref(),
        averaged: averaged.as_ref(),
        isovalue: session.first_isovalue(index),
        curve: Curve { errors: errors.collect(), bytes: curve.iter().map(|point| point.bytes).collect() },
    }
}

fn regions<'a>(regions: &'a Regions, info: &MtInfo) -> RegionsObject<'a> {
    let all = regions.all.iter().map(|region| {
        let [[x0, y0, z0], [x1, y1, z1]] = region.bounds.map(|corner| info.lattice.point(corner));
        let [r, g, b] = region_color(region.color);
        RegionObject {
            name: &region.name,
            labels: &region.labels,
            tetrahedra: region.tetrahedra,
            volume: region.volume,
            bounds: [x0, y0, z0, x1, y1, z1],
            color: format!("#{r:02x}{g:02x}{b:02x}"),
        }
    });
    RegionsObject { arrays: &regions.arrays, deviation: regions.deviation, all: all.collect() }
}

#[derive(Serialize)]
struct StatsObject<'a> {
    vertices: u32,
    tetrahedra: u32,
    applied: u32,
    refined: u64,
    coarsened: u64,
    forced: u64,
    judged: u64,
    error_bound: f64,
    relative_error_bound: f64,
    field_bound: f64,
    boundary_bound: f64,
    /// Relative, in pixels, or of colour: Python has the units.
    bounds: &'a [f64],
    excess: f64,
    satisfied: bool,
    limited_by: &'static str,
    hash: String,
    bytes_read: u64,
    file_bytes: Option<u64>,
    requests: u64,
    rounds: u64,
}

/// What a refinement did, and how good the mesh is now, for the field that was asked for.
pub fn stats<S: RangeSource>(client: &Client<S>, stats: &RefineStats, field: usize) -> Option<String> {
    let session = client.session();
    let info = session.info()?;
    let Traffic { received, requests, rounds, .. } = client.traffic().unwrap_or_default();
    let limited_by = match () {
        () if stats.satisfied => "error",
        () if session.block_progress().left_out > 0 => "memory",
        () => "budget",
    };
    let object = StatsObject {
        vertices: stats.vertices,
        tetrahedra: stats.tetrahedra,
        applied: stats.applied,
        refined: stats.refined,
        coarsened: stats.coarsened,
        forced: stats.forced,
        judged: stats.judged,
        error_bound: stats.error_bound * info.fields.get(field)?.range(),
        relative_error_bound: stats.error_bound,
        field_bound: info.field_bound(field, stats.error_bound),
        boundary_bound: info.boundary_bound(stats.error_bound),
        bounds: &stats.bounds,
        excess: stats.excess,
        satisfied: stats.satisfied,
        limited_by,
        hash: format!("{:016x}", session.hash()),
        bytes_read: if requests > 0 { received } else { session.arrived() },
        file_bytes: client.total(),
        requests,
        rounds,
    };
    serde_json::to_string(&object).ok()
}
