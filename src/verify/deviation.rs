//! How far is an extracted mesh from the input, at every reference vertex and all over the boundary?

use super::mesh_checks::PlainMesh;
use super::mesh_checks::PlainReference;
use super::parts::Ask;
use super::parts::change;
use super::parts::is_aside;
use super::triangles::Triangles;
use crate::geom::weights_at;
use crate::mesh::FACES;
use crate::mesh::NONE;
use crate::mesh::TetMesh;
use crate::mt::MtInfo;
use crate::refine::Need;
use crate::refine::Part;
use glam::DVec3;
use std::ops::RangeInclusive;

/// The input, prepared for being compared with.
pub struct Deviation<'a> {
    info: &'a MtInfo,
    input: &'a TetMesh,
    positions: Vec<[i32; 3]>,
    /// The input's own positions, in steps of the lattice.
    places: Vec<DVec3>,
    levels: Vec<i32>,
    /// The input's values as fractions of each field's range: `values[vertex * fields + f]`.
    values: Vec<f64>,
    cells: Cells,
    boundary: Triangles,
    boundary_vertices: Vec<u32>,
    /// Every so many vertices are looked at.
    stride: usize,
    /// Rounding errors of distances.
    slack: f64,
}

/// What was found.
pub struct Measured {
    /// The largest error as a fraction of what is allowed.
    pub worst_ratio: f64,
    pub failures: Vec<String>,
}

/// Failures of one kind that are described for each query.
const DESCRIBED: usize = 3;

impl<'a> Deviation<'a> {
    /// Prepares to compare with `input`, which has to be what `info` says.
    /// About `vertices` of the reference vertices are looked at.
    pub fn new(info: &'a MtInfo, input: &'a TetMesh, vertices: usize) -> Result<Self, String> {
        let (points, tets) = (input.positions.len(), input.tets.len());
        if (points, tets) != (info.vertices as usize, info.tetrahedra as usize) {
            return Err(format!(
                "the MT was built from {} vertices and {} tetrahedra, the input has {points} and {tets}: give the \
                 mesh that it was built from",
                info.vertices, info.tetrahedra
            ));
        }
        let mut fields = Vec::new();
        for field in &info.fields {
            let found = input.fields.iter().find(|f| field.is_of(f) && f.values.len() == points);
            fields.push(&found.ok_or(format!("the input has no field '{}'", field.name))?.values);
        }
        let positions: Vec<[i32; 3]> = input.positions.iter().map(|p| info.lattice.nearest(*p)).collect();
        let each = || (0..points).flat_map(|v| fields.iter().zip(&info.fields).map(move |(f, i)| (f[v], i)));
        let (origin, step) = (DVec3::from(info.lattice.origin), DVec3::from(info.lattice.step));
        let places = input.positions.iter().map(|p| (DVec3::from(*p) - origin) / step).collect();
        let levels = each().map(|(value, field)| field.nearest(value)).collect();
        let values = each().map(|(value, field)| value / field.range()).collect();
        let neighbors = crate::mesh::neighbors(&input.tets).map_err(|error| format!("the input: {error}"))?;
        let at = |v: u32| DVec3::from(info.lattice.point(positions[v as usize]));
        let mut faces = Vec::new();
        for (tet, around) in input.tets.iter().zip(&neighbors) {
            faces.extend((0..4).filter(|&i| around[i] == NONE).map(|i| FACES[i].map(|j| tet[j])));
        }
        let boundary = Triangles::new(faces.iter().map(|face| face.map(at)).collect());
        let mut boundary_vertices: Vec<u32> = faces.into_iter().flatten().collect();
        boundary_vertices.sort_unstable();
        boundary_vertices.dedup();
        let stride = points.div_ceil(vertices.max(1)).max(1);
        boundary_vertices.retain(|&v| (v as usize).is_multiple_of(stride));
        let slack = 1e-9 * crate::geom::Bounds::of(&input.positions).diagonal();
        let cells = Cells::new(&positions);
        Ok(Self {
            info,
            input,
            positions,
            places,
            levels,
            values,
            cells,
            boundary,
            boundary_vertices,
            stride,
            slack,
        })
    }

    /// The input on the lattice.
    pub fn reference(&self) -> PlainReference<'_> {
        PlainReference { positions: &self.positions, levels: &self.levels, tets: &self.input.tets }
    }

    /// What each of the needs asks of the reference vertices; `bounds` are what is guaranteed.
    pub fn asks<'n>(&self, needs: &'n [Need], bounds: &[f64]) -> Vec<Ask<'n>> {
        let ask = |(need, &bound): (&'n Need, &f64)| {
            let mut ask = Ask::new(self.info, self.input, need, bound);
            let unseen = ask.allowed.iter_mut().enumerate().filter(|(point, _)| point % self.stride != 0);
            unseen.for_each(|(_, allowed)| *allowed = f64::INFINITY);
            ask
        };
        needs.iter().zip(bounds).map(ask).collect()
    }

    /// Measures `mesh` where it is asked for. `errors` are those of its tetrahedra.
    pub fn measure(&self, mesh: &PlainMesh<'_>, errors: &TetErrors, asks: &[Ask<'_>]) -> Measured {
        let border = Border::of(mesh, self.info);
        let largest = errors.of.iter().copied().fold(0.0, f64::max);
        let look = Look { of: self, mesh, border, errors, largest, asks };
        let mut found = Measured { worst_ratio: 0.0, failures: Vec::new() };
        look.at_vertices(&mut found);
        // Elsewhere the boundary may be anywhere.
        if asks.iter().any(|ask| matches!(ask.need.part, Part::Everywhere | Part::Region(_))) {
            look.at_extracted_boundary(&mut found);
            look.at_reference_boundary(&mut found);
        }
        found
    }
}

/// The errors of the tetrahedra of a mesh.
pub struct TetErrors {
    /// Numbers for each of them.
    pub stride: usize,
    /// For each the largest one of all fields, and that of each field.
    pub of: Vec<f64>,
}

impl TetErrors {
    /// The error of a tetrahedron in one field, or the largest one of all.
    fn of(&self, tet: u32, field: Option<usize>) -> f64 {
        self.of[tet as usize * self.stride + field.map_or(0, |field| field + 1)]
    }
}

/// The comparison with one mesh.
struct Look<'a> {
    of: &'a Deviation<'a>,
    mesh: &'a PlainMesh<'a>,
    border: Border,
    errors: &'a TetErrors,
    /// Of the errors.
    largest: f64,
    asks: &'a [Ask<'a>],
}

/// A place in the mesh that may stand for a reference vertex.
struct Place {
    tet: u32,
    weights: [f64; 4],
    /// Its distance from the vertex, as the error that it counts as.
    displaced: f64,
}

impl Look<'_> {
    /// The error at every reference vertex that is wanted.
    fn at_vertices(&self, found: &mut Measured) {
        let points = self.of.positions.len();
        // For each need and vertex, the least part of what is allowed.
        let mut least = vec![f64::INFINITY; points * self.asks.len()];
        for (t, tet) in (0..).zip(self.mesh.tets) {
            let corners = tet.map(|v| self.mesh.positions[v as usize]);
            self.of.cells.between(&corners, |point| {
                let least = &mut least[point as usize * self.asks.len()..][..self.asks.len()];
                let asked = |ask: &Ask<'_>| ask.allowed[point as usize] < f64::INFINITY;
                if !self.asks.iter().any(asked) {
                    return;
                }
                let (position, place) = (self.of.positions[point as usize], self.of.places[point as usize]);
                let Some(weights) = weights_at(corners, position, place) else { return };
                let place = Place { tet: t, weights, displaced: 0.0 };
                for (ask, least) in self.asks.iter().zip(least).filter(|(ask, _)| asked(ask)) {
                    *least = least.min(self.ratio(ask, point, &place));
                }
            });
        }
        for (k, ask) in self.asks.iter().enumerate() {
            let mut failures = Failures::default();
            for point in (0..points).filter(|&point| ask.allowed[point] < f64::INFINITY) {
                let inside = least[point * self.asks.len() + k];
                // Inside there is one place that stands for it; only what the boundary has left outside has a choice.
                let ratio = if inside.is_finite() { inside } else { self.ratio_at_border(ask, point as u32) };
                found.worst_ratio = found.worst_ratio.max(ratio);
                if ratio > 1.0 {
                    failures.add(|| self.describe(ask, point, inside, ratio));
                }
            }
            failures.end("reference vertices", found);
        }
    }

    fn describe(&self, ask: &Ask<'_>, point: usize, inside: f64, ratio: f64) -> String {
        let place = if inside.is_finite() { "inside" } else { "outside" };
        let unit = if ask.is_of_colour() { "change of colour" } else { "error" };
        let allowed = ask.allowed[point];
        format!(
            "reference vertex {point} at {:?}, {place}: {unit} {}, more than {allowed}",
            self.of.input.positions[point],
            ratio * allowed
        )
    }

    /// The error with which a place stands for a reference vertex, as a part of what is allowed; 0 if the need does not reach
    /// it because it is clearly on one side of all values.
    fn ratio(&self, ask: &Ask<'_>, point: u32, place: &Place) -> f64 {
        let fields = &self.of.info.fields;
        let tet = self.mesh.tets[place.tet as usize];
        let known = &self.of.values[point as usize * fields.len()..][..fields.len()];
        let named = ask.values().map(|values| values.field).or(ask.need.measured_field());
        let error = self.errors.of(place.tet, named);
        let near = place.displaced <= error;
        if let Some(values) = ask.values() {
            let (info, value) = (&fields[values.field], known[values.field] * fields[values.field].range());
            if near && is_aside(info, values, self.mesh, tet, error, value) {
                return 0.0;
            }
        }
        let shown = |f: usize| {
            let value = |v: u32| fields[f].value(self.mesh.mesh.levels(v)[f]) / fields[f].range();
            tet.iter().zip(place.weights).map(|(&v, w)| value(v) * w).sum::<f64>()
        };
        let found = if let Part::Transfer(transfer) = &ask.need.part {
            let (f, info) = (transfer.field, &fields[transfer.field]);
            let range = info.range();
            if near { change(info, transfer, known[f] * range, shown(f) * range) } else { f64::INFINITY }
        } else {
            let measured = ask.need.measured_field().map_or(0..fields.len(), |field| field..field + 1);
            measured.map(|f| (shown(f) - known[f]).abs()).fold(place.displaced, f64::max)
        };
        found / ask.allowed[point as usize]
    }

    /// The least part of what is allowed with which some place of the boundary stands for a reference vertex.
    fn ratio_at_border(&self, ask: &Ask<'_>, point: u32) -> f64 {
        let p = DVec3::from(self.of.input.positions[point as usize]);
        let per_error = self.of.info.displacement_per_error;
        let allowed = ask.allowed[point as usize];
        // Tetrahedra that values pass by, or whose colour does not matter, may have any error.
        let reach = match &ask.need.part {
            Part::Transfer(_) => self.largest,
            Part::Values(_) | Part::Both(..) => allowed.max(self.largest),
            Part::View(_) => allowed.min(self.largest),
            Part::Everywhere | Part::Region(_) => allowed,
        };
        let mut least = f64::INFINITY;
        // What the lattice has moved the vertex by is no displacement.
        let moved = p.distance(DVec3::from(self.of.info.lattice.point(self.of.positions[point as usize])));
        let slack = moved + self.of.slack;
        self.border.triangles.within(p, reach * per_error + slack, |i, q, distance| {
            let (t, face) = self.border.faces[i as usize];
            let tet = self.mesh.tets[t as usize];
            let away = (distance - slack).max(0.0);
            let displaced = if away > 0.0 { away / per_error } else { 0.0 };
            let own = weights_on(q, self.border.triangles.corners[i as usize]);
            let weights = tet.map(|v| face.iter().zip(own).find(|(w, _)| **w == v).map_or(0.0, |(_, x)| x));
            least = least.min(self.ratio(ask, point, &Place { tet: t, weights, displaced }));
        });
        least
    }

    /// Whether the extracted boundary stays near that of the input, at its vertices.
    fn at_extracted_boundary(&self, found: &mut Measured) {
        let mut vertices: Vec<u32> = self.border.faces.iter().flat_map(|(_, face)| *face).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let mut failures = Failures::default();
        for v in vertices.into_iter().step_by(self.of.stride) {
            let p = self.of.info.lattice.point(self.mesh.positions[v as usize]);
            self.compare_distance(p, &self.of.boundary, "of the extracted boundary", &mut failures, found);
        }
        failures.end("vertices of the extracted boundary", found);
    }

    /// Whether the boundary of the input stays near the extracted one, at its vertices.
    fn at_reference_boundary(&self, found: &mut Measured) {
        let mut failures = Failures::default();
        for &v in &self.of.boundary_vertices {
            let p = self.of.info.lattice.point(self.of.positions[v as usize]);
            self.compare_distance(p, &self.border.triangles, "of the input's boundary", &mut failures, found);
        }
        failures.end("vertices of the input's boundary", found);
    }

    fn compare_distance(
        &self,
        p: [f64; 3],
        other: &Triangles,
        what: &str,
        failures: &mut Failures,
        found: &mut Measured,
    ) {
        let binding = self.asks.iter().filter(|ask| ask.binds_boundary_at(p));
        let bound = binding.map(|ask| ask.bound).fold(f64::INFINITY, f64::min);
        if bound == f64::INFINITY {
            return;
        }
        let allowed = bound * self.of.info.displacement_per_error + self.of.slack;
        let distance = other.distance(DVec3::from(p));
        if bound > 0.0 {
            found.worst_ratio = found.worst_ratio.max(distance / allowed);
        }
        if distance > allowed {
            failures
                .add(|| format!("vertex {what} at {p:?} is {distance} from the other, more than {allowed}"));
        }
    }
}

/// Failures of one kind: some in full, of the others their number.
#[derive(Default)]
struct Failures {
    described: Vec<String>,
    count: usize,
}

impl Failures {
    fn add(&mut self, describe: impl FnOnce() -> String) {
        self.count += 1;
        if self.count <= DESCRIBED {
            self.described.push(describe());
        }
    }

    fn end(mut self, where_: &str, found: &mut Measured) {
        if self.count > DESCRIBED {
            self.described.push(format!("so at {} {where_}", self.count));
        }
        found.failures.append(&mut self.described);
    }
}

/// The boundary of an extracted mesh.
struct Border {
    triangles: Triangles,
    /// The tetrahedron behind each triangle, and the triangle's vertices.
    faces: Vec<(u32, [u32; 3])>,
}

impl Border {
    fn of(mesh: &PlainMesh<'_>, info: &MtInfo) -> Self {
        let faces: Vec<(u32, [u32; 3])> = mesh.boundary().collect();
        let at = |v: u32| DVec3::from(info.lattice.point(mesh.positions[v as usize]));
        let triangles = Triangles::new(faces.iter().map(|(_, face)| face.map(at)).collect());
        Self { triangles, faces }
    }
}

/// The barycentric coordinates of a point on a triangle.
fn weights_on(q: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let area = normal.length_squared();
    if area <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let v = (q - a).cross(c - a).dot(normal) / area;
    let w = (b - a).cross(q - a).dot(normal) / area;
    [1.0 - v - w, v, w]
}

/// Lattice points sorted into the cells of a regular grid.
struct Cells {
    points: Vec<(u32, [i32; 3])>,
    starts: Vec<u32>,
    low: [i32; 3],
    side: [i64; 3],
    cells: [usize; 3],
}

/// Points in a cell, on average, if they were spread evenly.
const CROWD: f64 = 3.0;
const MAX_CELLS: f64 = 128.0;

impl Cells {
    fn new(positions: &[[i32; 3]]) -> Self {
        let low = [0, 1, 2].map(|i| positions.iter().map(|p| p[i]).min().unwrap_or(0));
        let extent =
            [0, 1, 2].map(|i| positions.iter().map(|p| i64::from(p[i] - low[i])).max().unwrap_or(0) + 1);
        let volume: f64 = extent.iter().map(|&e| e as f64).product();
        let edge = (volume * CROWD / positions.len().max(1) as f64).cbrt();
        let side =
            extent.map(|e| ((e as f64 / (e as f64 / edge).clamp(1.0, MAX_CELLS)).ceil() as i64).max(1));
        let cells = [0, 1, 2].map(|i| (extent[i] / side[i]) as usize + 1);
        let mut sorted = Self { points: Vec::new(), starts: Vec::new(), low, side, cells };
        let mut places: Vec<(usize, u32)> =
            positions.iter().zip(0..).map(|(p, i)| (sorted.index(*p), i)).collect();
        places.sort_unstable();
        sorted.starts = vec![0; cells.iter().product::<usize>() + 1];
        places.iter().for_each(|&(cell, _)| sorted.starts[cell + 1] += 1);
        (1..sorted.starts.len()).for_each(|i| sorted.starts[i] += sorted.starts[i - 1]);
        sorted.points = places.into_iter().map(|(_, i)| (i, positions[i as usize])).collect();
        sorted
    }

    fn along(&self, axis: usize, x: i32) -> usize {
        let offset = i64::from(x) - i64::from(self.low[axis]);
        (offset.max(0) / self.side[axis]).min(self.cells[axis] as i64 - 1) as usize
    }

    fn index(&self, p: [i32; 3]) -> usize {
        let [x, y, z] = [0, 1, 2].map(|axis| self.along(axis, p[axis]));
        (z * self.cells[1] + y) * self.cells[0] + x
    }

    /// Calls `visit` with all points in the bounds of a tetrahedron.
    fn between(&self, corners: &[[i32; 3]; 4], mut visit: impl FnMut(u32)) {
        let low = [0, 1, 2].map(|i| corners.iter().map(|q| q[i]).fold(i32::MAX, i32::min));
        let high = [0, 1, 2].map(|i| corners.iter().map(|q| q[i]).fold(i32::MIN, i32::max));
        let range = |axis: usize| -> RangeInclusive<usize> {
            // Points may be half a step beside their place on the lattice.
            self.along(axis, low[axis].saturating_sub(1))..=self.along(axis, high[axis].saturating_add(1))
        };
        let [xs, ys, zs] = [range(0), range(1), range(2)];
        for z in zs {
            for y in ys.clone() {
                let row = (z * self.cells[1] + y) * self.cells[0];
                let cells = self.starts[row + xs.start()] as usize..self.starts[row + xs.end() + 1] as usize;
                for &(point, p) in &self.points[cells] {
                    if (0..3).all(|i| low[i] <= p[i].saturating_add(1) && p[i] <= high[i].saturating_add(1)) {
                        visit(point);
                    }
                }
            }
        }
    }
}
