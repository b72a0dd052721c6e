//! The error that a need allows at a reference vertex, by the formulas of the request alone.

use super::mesh_checks::PlainMesh;
use glam::{DVec2, DVec3, DVec4};
use tetralod::mesh::TetMesh;
use tetralod::mt::{FieldInfo, MtInfo};
use tetralod::refine::{Need, Part, Transfer, Values, View};

/// A need, what is guaranteed, and what that means at each reference vertex.
pub struct Ask<'a> {
    pub need: &'a Need,
    /// In the need's unit.
    pub bound: f64,
    /// The error that each reference vertex may have, in the unit of `need` where that is one of colour, else as a
    /// fraction of the field's range; infinite outside of the need's part.
    pub allowed: Vec<f64>,
}

/// Rounding errors of interpolated values, as fractions of the range.
const VALUE_SLACK: f64 = 1e-9;

/// Rounding errors of colours, which are kept with 24 bits.
const COLOUR_SLACK: f64 = 1e-6;

impl<'a> Ask<'a> {
    pub fn new(info: &MtInfo, input: &TetMesh, need: &'a Need, bound: f64) -> Self {
        let floor = |f: usize| info.floor(f).max(0.5 * info.fields[f].step / info.fields[f].range());
        let floor = (0..info.fields.len()).map(floor).fold(0.0, f64::max);
        let of_field = |error: f64| error.max(floor) + VALUE_SLACK;
        let allowed = |p: &[f64; 3]| match &need.part {
            Part::Everywhere | Part::Values(_) => of_field(bound),
            Part::Region(region) | Part::Both(region, _) if region.contains(*p) => of_field(bound),
            Part::Region(_) | Part::Both(..) => f64::INFINITY,
            Part::View(view) => match pixels(view, *p) * info.displacement_per_error {
                size if size > 0.0 => of_field(bound / size),
                _ => f64::INFINITY,
            },
            Part::Transfer(_) => bound + COLOUR_SLACK,
        };
        Self { need, bound, allowed: input.positions.iter().map(allowed).collect() }
    }

    /// Whether errors are changes of colour, not of the field.
    pub fn is_of_colour(&self) -> bool {
        matches!(self.need.part, Part::Transfer(_))
    }

    /// The values that a need is limited to, if it is.
    pub fn values(&self) -> Option<&'a Values> {
        match &self.need.part {
            Part::Values(values) | Part::Both(_, values) => Some(values),
            _ => None,
        }
    }

    /// Whether the boundary has to be near where the need counts.
    pub fn binds_boundary_at(&self, p: [f64; 3]) -> bool {
        match &self.need.part {
            Part::Everywhere => true,
            Part::Region(region) => region.contains(p),
            _ => false,
        }
    }
}

/// Whether a tetrahedron, widened by its error, and a reference vertex with value `value` are on one side of all ranges.
pub fn is_aside(
    info: &FieldInfo,
    values: &Values,
    mesh: &PlainMesh<'_>,
    tet: [u32; 4],
    error: f64,
    value: f64,
) -> bool {
    let corners = tet.map(|v| info.value(mesh.mesh.levels(v)[values.field]));
    let margin = error * info.range();
    let low = corners.into_iter().fold(f64::INFINITY, f64::min) - margin;
    let high = corners.into_iter().fold(f64::NEG_INFINITY, f64::max) + margin;
    values.ranges.iter().all(|&[from, to]| (to < low && to < value) || (from > high && from > value))
}

/// How many pixels a displacement of length 1 at `p` can make along a side of the picture; 0 where `p` is not seen.
fn pixels(view: &View, p: [f64; 3]) -> f64 {
    let row = |i: usize| {
        let m = &view.matrix;
        DVec4::new(m[i], m[4 + i], m[8 + i], m[12 + i])
    };
    let at = DVec3::from(p).extend(1.0);
    let [x, y, w] = [row(0), row(1), row(3)];
    let (across, up, depth) = (x.dot(at), y.dot(at), w.dot(at));
    let parallel = w.truncate() == DVec3::ZERO;
    let depth = if parallel { depth.abs() } else { depth };
    if depth <= 0.0 || across.abs() > depth || up.abs() > depth {
        return 0.0;
    }
    let half = DVec2::from(view.viewport) / 2.0;
    // The gradient of what is seen, x / w, is (x' - (x / w) w') / w.
    let steep = |axis: DVec4, seen: f64| (axis - w * (seen / depth)).truncate().length() / depth;
    (half.x * steep(x, across)).max(half.y * steep(y, up))
}

/// By how much the picture changes along a ray through the whole model if a value is shown instead of another one: the channel
/// that changes most, colours weighted by opacity. What the lattices round off is none.
pub fn change(info: &FieldInfo, transfer: &Transfer, wanted: f64, shown: f64) -> f64 {
    let rounding = info.quantization.max(0.5 * info.step);
    let shown = shown + (wanted - shown).clamp(-rounding, rounding);
    let [a, b] = [colour(transfer, wanted), colour(transfer, shown)];
    let largest = (0..4).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max);
    largest / transfer.unit_length
}

/// Colours weighted by opacity, and the opacity; after a step at the value, if there is one.
fn colour(transfer: &Transfer, value: f64) -> [f64; 4] {
    let weighted = |[r, g, b, a]: [f64; 4]| [r * a, g * a, b * a, a];
    let points = &transfer.points;
    let next = points.partition_point(|point| point.0 <= value);
    let (before, after) = (points[..next].last(), points.get(next));
    match (before, after) {
        (Some(&(v, a)), Some(&(w, b))) => {
            let (a, b, t) = (weighted(a), weighted(b), (value - v) / (w - v));
            [0, 1, 2, 3].map(|c| a[c] + t * (b[c] - a[c]))
        }
        (Some(&(_, only)), None) | (None, Some(&(_, only))) => weighted(only),
        (None, None) => [0.0; 4],
    }
}
