//! What can be got out of a mesh besides itself: surfaces, sections, values along lines, sums.

use crate::arrays::{doubles, floats, integers, object, objects, set};
use crate::stored::Stored;
use js_sys::{Array, Object};
use tetralod::session::{RegionStats, Session};
use tetralod::view::{
    BoundarySurface, FieldStats, FieldView, Histogram, IsoSurface, MeshView, Plane, Probe, Slice, Streamline,
    TraceOptions, Tracer,
};
use tetralod_web_options::error::WebError;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str =
    r#"import type { FieldStats, IsoSurface, LineProfile, Slice, Streamline, Surface } from "./results.js";"#;

#[wasm_bindgen]
extern "C" {
    /// Isosurfaces as typed arrays.
    #[wasm_bindgen(typescript_type = "IsoSurface")]
    pub type JsIsoSurface;
    /// A surface as typed arrays.
    #[wasm_bindgen(typescript_type = "Surface")]
    pub type JsSurface;
    /// A section as typed arrays.
    #[wasm_bindgen(typescript_type = "Slice")]
    pub type JsSlice;
    /// A field along a line.
    #[wasm_bindgen(typescript_type = "LineProfile")]
    pub type JsProfile;
    /// Streamlines, or `undefined` for seeds outside.
    #[wasm_bindgen(typescript_type = "(Streamline | undefined)[]")]
    pub type JsStreamlines;
    /// Sums over the mesh.
    #[wasm_bindgen(typescript_type = "FieldStats")]
    pub type JsStats;
}

/// The most bins of a histogram.
const MOST_BINS: u32 = 1 << 20;

/// A copy of `surface` outside wasm memory.
pub fn iso_surface(surface: &IsoSurface, stored: &Stored) -> JsIsoSurface {
    let js = triangles(&surface.positions, &surface.values, &surface.indices, stored);
    set(&js, "normals", &floats(surface.normals.as_flattened()));
    js.unchecked_into()
}

/// The plane `normal · p = offset`.
pub fn plane(normal: &[f64], offset: f64) -> Result<Plane, WebError> {
    let normal = point(normal, "normal")?;
    if normal == [0.0; 3] || !offset.is_finite() {
        return Err(WebError::bad_option("plane", "must have a normal of some length and a finite offset"));
    }
    Ok(Plane { normal, offset })
}

/// A copy of `slice` outside wasm memory.
pub fn section(slice: &Slice, stored: &Stored) -> JsSlice {
    let js = triangles(slice.positions(), slice.values(), slice.indices(), stored);
    let mut edges = Vec::new();
    slice.cell_edges(&mut edges);
    set(&js, "edges", &integers(edges.as_flattened()));
    js.unchecked_into()
}

/// The boundary of `mesh`, with the values of other fields, given at the points of the mesh.
pub fn boundary(mesh: &MeshView<'_>, fields: impl Iterator<Item = Vec<f64>>, stored: &Stored) -> JsSurface {
    let mut boundary = BoundarySurface::new();
    boundary.extract(mesh);
    let js = triangles(&boundary.positions, &boundary.values, &boundary.indices, stored);
    put_fields(&js, fields.map(|field| boundary.interpolate(&field)));
    js.unchecked_into()
}

/// A field of a session, whose values are these.
pub fn view<'a>(session: &Session, field: usize, values: &'a [f64]) -> FieldView<'a> {
    let is_label =
        session.info().is_some_and(|info| info.fields.get(field).is_some_and(|field| field.is_label));
    FieldView { values, is_label }
}

/// Puts the values of other fields at the vertices of a surface beside it, in double precision: the package stores them as each needs it.
pub fn put_fields(surface: &JsValue, fields: impl Iterator<Item = Vec<f64>>) {
    set(surface, "fields", &objects(fields.map(|values| doubles(&values))));
}

/// The field at some points, three coordinates each; NaN outside of the mesh.
pub fn probe(mesh: MeshView<'_>, points: &[f64]) -> Result<Vec<f64>, WebError> {
    let points = all_points(points, "points")?;
    let mut probe = Probe::new(mesh);
    let places = probe.locate_all(points);
    Ok(places.iter().map(|p| p.map_or(f64::NAN, |p| p.value(probe.mesh()))).collect())
}

/// The field along a line.
pub fn line(mesh: MeshView<'_>, from: &[f64], to: &[f64]) -> Result<JsProfile, WebError> {
    let (from, to) = (point(from, "from")?, point(to, "to")?);
    let probe = Probe::new(mesh);
    let spans = probe.line(from, to);
    let at: Vec<f64> = spans.iter().flat_map(|span| [span.from, span.to]).collect();
    let ends = spans.iter().flat_map(|span| [span.entry, span.exit]);
    let values: Vec<f64> = ends.map(|place| place.value(probe.mesh())).collect();
    let tets: Vec<u32> = spans.iter().map(|span| span.entry.tet).collect();
    Ok(object(&[("at", doubles(&at)), ("values", doubles(&values)), ("tets", integers(&tets))]))
}

/// How far streamlines go, and which way.
pub struct Way {
    pub backward: bool,
    pub max_length: f64,
    pub max_steps: f64,
}

/// The streamlines from some seeds, three coordinates each, through the vector field of three fields.
pub fn streamlines(
    mesh: MeshView<'_>,
    vectors: [&[f64]; 3],
    seeds: &[f64],
    way: &Way,
) -> Result<JsStreamlines, WebError> {
    let Way { backward, max_length, max_steps } = *way;
    let seeds = all_points(seeds, "seeds")?;
    if max_length.is_nan() || max_steps.is_nan() {
        return Err(WebError::bad_option("maxLength", "must be a number, and `maxSteps` too"));
    }
    // The cast saturates.
    let options =
        TraceOptions { backward, max_length, max_steps: max_steps as u32, ..TraceOptions::default() };
    let mut tracer = Tracer::new(mesh, vectors);
    let line = |seed: &[f64; 3]| {
        let line = tracer.trace(*seed, &options);
        line.map_or(JsValue::UNDEFINED, |line| streamline(&line, &mesh))
    };
    Ok(seeds.iter().map(line).collect::<Array>().unchecked_into())
}

/// Sums over what a session shows and over each region of it, a histogram by volume of so many bins from `low` to `high`, and the values
/// below which these fractions of the volume lie.
pub fn stats(
    session: &mut Session,
    bins: u32,
    [low, high]: [f64; 2],
    fractions: &[f64],
) -> Result<JsStats, WebError> {
    let sound = low < high && low.is_finite() && high.is_finite();
    if !sound || bins == 0 || bins > MOST_BINS {
        let problem = "must be two finite numbers, the smaller first, in 1 to 2^20 bins";
        return Err(WebError::bad_option("range", problem));
    }
    let found = session.region_stats();
    let regions = session.regions().map_or(&[][..], |regions| &regions.all);
    let range = session.info().map_or(0.0, |info| info.fields[session.field()].range());
    let of_region = |RegionStats { region, field, error }: &RegionStats| -> JsValue {
        let name = regions[usize::from(*region)].name.as_str().into();
        let own = [
            ("name", name),
            ("tetrahedra", field.tetrahedra().into()),
            ("errorBound", (error * range).into()),
        ];
        object(&[&own[..], &sums(field)].concat())
    };
    let regions = if regions.is_empty() { JsValue::UNDEFINED } else { objects(found.iter().map(of_region)) };
    let mesh = session.last_view();
    let mut histogram = Histogram::new(low, high, bins as usize);
    histogram.add_mesh(&mesh);
    let [below, above] = histogram.outside();
    let edges: Vec<f64> = (0..=bins as usize).map(|b| histogram.edge(b)).collect();
    let percentiles: Vec<f64> = fractions.iter().map(|part| histogram.percentile(*part)).collect();
    let own = [
        ("below", below.into()),
        ("above", above.into()),
        ("histogram", doubles(&histogram.volumes())),
        ("edges", doubles(&edges)),
        ("percentiles", doubles(&percentiles)),
        ("regions", regions),
    ];
    Ok(object(&[&sums(&FieldStats::of(&mesh))[..], &own].concat()))
}

fn sums(stats: &FieldStats) -> [(&'static str, JsValue); 6] {
    let [min, max] = stats.range();
    [
        ("volume", stats.volume().into()),
        ("integral", stats.integral().into()),
        ("mean", stats.mean().into()),
        ("deviation", stats.deviation().into()),
        ("min", min.into()),
        ("max", max.into()),
    ]
}

fn triangles(positions: &[[f64; 3]], values: &[f64], indices: &[[u32; 3]], stored: &Stored) -> Object {
    let js: Object = object(&[
        ("positions", stored.positions(positions.iter().copied())),
        ("values", stored.values(values.iter().copied())),
        ("indices", integers(indices.as_flattened())),
    ]);
    stored.put(&js);
    js
}

fn streamline(line: &Streamline, mesh: &MeshView<'_>) -> JsValue {
    let positions: Vec<f64> = line.points.iter().flat_map(|point| point.position).collect();
    let times: Vec<f64> = line.points.iter().map(|point| point.time).collect();
    let values: Vec<f64> = line.points.iter().map(|point| point.place.value(mesh)).collect();
    object(&[
        ("positions", doubles(&positions)),
        ("times", doubles(&times)),
        ("values", doubles(&values)),
        ("end", line.end.name().into()),
    ])
}

fn point(numbers: &[f64], name: &str) -> Result<[f64; 3], WebError> {
    match numbers {
        &[x, y, z] if [x, y, z].iter().all(|number| number.is_finite()) => Ok([x, y, z]),
        _ => Err(WebError::bad_option(name, "must be three finite numbers")),
    }
}

fn all_points<'a>(numbers: &'a [f64], name: &str) -> Result<&'a [[f64; 3]], WebError> {
    let (points, rest) = numbers.as_chunks::<3>();
    let sound = rest.is_empty() && numbers.iter().all(|number| number.is_finite());
    if sound { Ok(points) } else { Err(WebError::bad_option(name, "must be three finite numbers a point")) }
}
