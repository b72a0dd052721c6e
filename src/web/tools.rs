//! What can be got out of the current mesh besides itself: surfaces, sections, values along lines, sums.

use super::error::WebError;
use super::options::field_index;
use super::results::{JsIsoSurface, doubles, floats, integers, iso_surface, object, set};
#[cfg(feature = "web-session")]
use super::session::CoreSession;
#[cfg(all(feature = "gpu", target_arch = "wasm32"))]
use super::viewer::Viewer;
use crate::view::{
    BoundarySurface, FieldStats, Histogram, MeshView, NormalKind, Plane, Probe, Streamline, TraceOptions,
    Tracer,
};
use js_sys::{Array, Object};
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = include_str!("tools.d.ts");

#[wasm_bindgen]
extern "C" {
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

/// The same calls for each class that holds a file.
macro_rules! mesh_tools {
    ($class:ident) => {
        #[wasm_bindgen]
        impl $class {
            /// The isosurfaces of the current mesh at some values, as one; with normals of the field's gradient or of the triangles.
            pub fn isosurfaces(&mut self, values: &[f64], smooth: bool) -> Result<JsIsoSurface, WebError> {
                let session = self.file.session_mut();
                session.set_normal_kind(if smooth { NormalKind::Smooth } else { NormalKind::Gradient });
                let surface = session.isosurfaces(values)?;
                let js = iso_surface(surface);
                set(js.as_ref(), "values", &floats(&surface.values));
                Ok(js)
            }

            /// The section of the current mesh with the plane `normal · p = offset`.
            pub fn slice(&mut self, normal: &[f64], offset: f64) -> Result<JsSlice, WebError> {
                let normal = point(normal, "normal")?;
                if normal == [0.0; 3] || !offset.is_finite() {
                    return Err(WebError::bad_option(
                        "plane",
                        "must have a normal of some length and a finite offset",
                    ));
                }
                let slice = self.file.session_mut().slice(&Plane { normal, offset })?;
                let js = surface(slice.positions(), slice.values(), slice.indices());
                let mut edges = Vec::new();
                slice.cell_edges(&mut edges);
                set(&js, "edges", &integers(edges.as_flattened()));
                Ok(js.unchecked_into())
            }

            /// The boundary of the current mesh.
            pub fn surface(&mut self) -> Result<JsSurface, WebError> {
                self.file.info()?;
                let mut boundary = BoundarySurface::new();
                boundary.extract(&self.file.session_mut().view());
                Ok(surface(&boundary.positions, &boundary.values, &boundary.indices).unchecked_into())
            }

            /// The field at some points, three coordinates each; NaN outside of the mesh.
            pub fn probe(&mut self, points: &[f64]) -> Result<Vec<f64>, WebError> {
                self.file.info()?;
                let points = all_points(points, "points")?;
                let mut probe = Probe::new(self.file.session_mut().view());
                let places = probe.locate_all(points);
                Ok(places.iter().map(|p| p.map_or(f64::NAN, |p| p.value(probe.mesh()))).collect())
            }

            /// The field along a line.
            pub fn line(&mut self, from: &[f64], to: &[f64]) -> Result<JsProfile, WebError> {
                self.file.info()?;
                let (from, to) = (point(from, "from")?, point(to, "to")?);
                let probe = Probe::new(self.file.session_mut().view());
                let spans = probe.line(from, to);
                let at: Vec<f64> = spans.iter().flat_map(|span| [span.from, span.to]).collect();
                let ends = spans.iter().flat_map(|span| [span.entry, span.exit]);
                let values: Vec<f64> = ends.map(|place| place.value(probe.mesh())).collect();
                let tets: Vec<u32> = spans.iter().map(|span| span.entry.tet).collect();
                Ok(object(&[("at", doubles(&at)), ("values", doubles(&values)), ("tets", integers(&tets))]))
            }

            /// The streamlines from some seeds, three coordinates each, through the vector field of three fields.
            pub fn streamlines(
                &mut self,
                names: Vec<String>,
                seeds: &[f64],
                backward: bool,
                max_length: f64,
                max_steps: f64,
            ) -> Result<JsStreamlines, WebError> {
                let info = self.file.info()?;
                let fields = names
                    .iter()
                    .map(|name| field_index(info, &name.as_str().into()))
                    .collect::<Result<Vec<_>, _>>()?;
                let fields: [usize; 3] = fields.try_into().map_err(|_| {
                    WebError::bad_option("fields", "a vector field is the names of three fields")
                })?;
                let seeds = all_points(seeds, "seeds")?;
                if max_length.is_nan() || max_steps.is_nan() {
                    return Err(WebError::bad_option("maxLength", "must be a number, and `maxSteps` too"));
                }
                // The cast saturates.
                let options = TraceOptions {
                    backward,
                    max_length,
                    max_steps: max_steps as u32,
                    ..TraceOptions::default()
                };
                let session = self.file.session_mut();
                let vectors = fields.map(|field| session.values(field));
                let mesh = session.view();
                let mut tracer = Tracer::new(mesh, vectors.each_ref().map(|v| &v[..]));
                let line = |seed: &[f64; 3]| {
                    let line = tracer.trace(*seed, &options);
                    line.map_or(JsValue::UNDEFINED, |line| streamline(&line, &mesh))
                };
                Ok(seeds.iter().map(line).collect::<Array>().unchecked_into())
            }

            /// Sums over the current mesh, a histogram by volume of so many bins from `low` to `high`, and the values below
            /// which these fractions of the volume lie.
            pub fn stats(
                &mut self,
                bins: u32,
                low: f64,
                high: f64,
                fractions: &[f64],
            ) -> Result<JsStats, WebError> {
                let field = self.file.session_mut().field();
                let info = &self.file.info()?.fields[field];
                let low = if low.is_nan() { info.min } else { low };
                let high = if high.is_nan() { info.min + info.range() } else { high };
                let sound = low < high && low.is_finite() && high.is_finite();
                if !sound || bins == 0 || bins > MOST_BINS {
                    return Err(WebError::bad_option(
                        "range",
                        "must be two finite numbers, the smaller first, in 1 to 2^20 bins",
                    ));
                }
                let mesh = self.file.session_mut().view();
                let stats = FieldStats::of(&mesh);
                let mut histogram = Histogram::new(low, high, bins as usize);
                histogram.add_mesh(&mesh);
                let [min, max] = stats.range();
                let [below, above] = histogram.outside();
                let numbers = [
                    ("volume", stats.volume()),
                    ("integral", stats.integral()),
                    ("mean", stats.mean()),
                    ("deviation", stats.deviation()),
                    ("min", min),
                    ("max", max),
                    ("below", below),
                    ("above", above),
                ];
                let edges: Vec<f64> = (0..=bins as usize).map(|b| histogram.edge(b)).collect();
                let percentiles: Vec<f64> =
                    fractions.iter().map(|part| histogram.percentile(*part)).collect();
                let arrays = [
                    ("histogram", doubles(&histogram.volumes())),
                    ("edges", doubles(&edges)),
                    ("percentiles", doubles(&percentiles)),
                ];
                let numbers = numbers.map(|(name, number)| (name, number.into()));
                Ok(object(&numbers.into_iter().chain(arrays).collect::<Vec<_>>()))
            }

            /// A hash of the current mesh, the same wherever the same request was made.
            pub fn hash(&self) -> String {
                self.file.hash()
            }
        }
    };
}

#[cfg(feature = "web-session")]
mesh_tools!(CoreSession);
#[cfg(all(feature = "gpu", target_arch = "wasm32"))]
mesh_tools!(Viewer);

fn surface(positions: &[[f32; 3]], values: &[f32], indices: &[[u32; 3]]) -> Object {
    object(&[
        ("positions", floats(positions.as_flattened())),
        ("values", floats(values)),
        ("indices", integers(indices.as_flattened())),
    ])
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
