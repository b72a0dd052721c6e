//! How far is an extracted mesh from the input, at every reference vertex and all over the boundary?

use super::mesh_checks::{PlainMesh, PlainReference};
use super::parts::{Ask, change, is_aside};
use crate::geom::{PointGrid, TriangleGrid, weights_at, weights_on_triangle};
use crate::mesh::{TetMesh, boundary_faces};
use crate::mt::MtInfo;
use crate::refine::{Need, Part};
use glam::DVec3;

/// The input, prepared for being compared with.
pub struct Deviation<'a> {
    info: &'a MtInfo,
    input: &'a TetMesh,
    points: PointGrid,
    /// The input's own positions, in steps of the lattice.
    places: Vec<DVec3>,
    levels: Vec<i32>,
    /// The input's values as fractions of each field's range: `values[vertex * fields + f]`.
    values: Vec<f64>,
    boundary: TriangleGrid,
    boundary_vertices: Vec<u32>,
    /// One in so many vertices is measured.
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
    /// Prepares to compare with `input`, which has to be what `info` says. About `vertices` of the reference vertices
    /// are measured.
    pub fn new(info: &'a MtInfo, input: &'a TetMesh, vertices: usize) -> Result<Self, String> {
        let (points, tets) = (input.positions.len(), input.tets.len());
        if (points, tets) != (info.vertices as usize, info.tetrahedra as usize) {
            return Err(format!(
                "the MT was built from {} vertices and {} tetrahedra, the input has {points} and {tets}: give the \
                 mesh that it was built from",
                info.vertices, info.tetrahedra
            ));
        }
        let neighbors = crate::mesh::neighbors(&input.tets).map_err(|error| format!("the input: {error}"))?;
        let faces = boundary_faces(&input.tets, &neighbors).map(|(_, face)| face).collect();
        drop(neighbors);
        Self::of(info, input, faces, vertices)
    }

    /// The same of what the input has in some place, and the faces of its boundary there.
    pub fn of(
        info: &'a MtInfo,
        input: &'a TetMesh,
        faces: Vec<[u32; 3]>,
        vertices: usize,
    ) -> Result<Self, String> {
        let points = input.positions.len();
        let mut fields = Vec::new();
        for field in &info.fields {
            let found = input.fields.iter().find(|f| field.is_of(f) && f.values.len() == points);
            fields.push(&found.ok_or_else(|| format!("the input has no field '{}'", field.name))?.values);
        }
        let positions: Vec<[i32; 3]> = input.positions.iter().map(|p| info.lattice.nearest(*p)).collect();
        let each = || (0..points).flat_map(|v| fields.iter().zip(&info.fields).map(move |(f, i)| (f[v], i)));
        let (origin, step) = (DVec3::from(info.lattice.origin), DVec3::from(info.lattice.step));
        let places = input.positions.iter().map(|p| (DVec3::from(*p) - origin) / step).collect();
        let levels = each().map(|(value, field)| field.nearest(value)).collect();
        let values = each().map(|(value, field)| value / field.range()).collect();
        let at = |v: u32| DVec3::from(info.lattice.point(positions[v as usize]));
        let boundary = TriangleGrid::new(faces.iter().map(|face| face.map(at)).collect());
        let mut boundary_vertices: Vec<u32> = faces.into_iter().flatten().collect();
        boundary_vertices.sort_unstable();
        boundary_vertices.dedup();
        let stride = points.div_ceil(vertices.max(1)).max(1);
        boundary_vertices.retain(|&v| (v as usize).is_multiple_of(stride));
        let slack = 1e-9 * crate::geom::Bounds::of(&input.positions).diagonal();
        Ok(Self {
            info,
            input,
            points: PointGrid::new(positions),
            places,
            levels,
            values,
            boundary,
            boundary_vertices,
            stride,
            slack,
        })
    }

    /// The input on the lattice.
    pub fn reference(&self) -> PlainReference<'_> {
        PlainReference { positions: self.points.points(), levels: &self.levels, tets: &self.input.tets }
    }

    /// The errors that each need allows at the reference vertices; `bounds` are the guaranteed ones.
    pub fn asks<'n>(&self, needs: &'n [Need], bounds: &[f64]) -> Vec<Ask<'n>> {
        let ask = |(need, &bound): (&'n Need, &f64)| {
            let mut ask = Ask::new(self.info, self.input, need, bound);
            let unseen = ask.allowed.iter_mut().enumerate().filter(|(point, _)| point % self.stride != 0);
            unseen.for_each(|(_, allowed)| *allowed = f64::INFINITY);
            ask
        };
        needs.iter().zip(bounds).map(ask).collect()
    }

    /// Measures `mesh` where needs apply. `errors` are those of its tetrahedra.
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

/// A place in the mesh that represents a reference vertex.
struct Place {
    tet: u32,
    weights: [f64; 4],
    /// Its distance from the vertex, as the error that it counts as.
    displaced: f64,
}

impl Look<'_> {
    /// The error at every reference vertex to which a need applies.
    fn at_vertices(&self, found: &mut Measured) {
        let points = self.of.points.points().len();
        // For each need and vertex, the least part of what is allowed.
        let mut least = vec![f64::INFINITY; points * self.asks.len()];
        for (t, tet) in (0..).zip(self.mesh.tets) {
            let corners = tet.map(|v| self.mesh.positions[v as usize]);
            self.of.points.near_tet(&corners, |point| {
                let least = &mut least[point as usize * self.asks.len()..][..self.asks.len()];
                let asked = |ask: &Ask<'_>| ask.allowed[point as usize] < f64::INFINITY;
                if !self.asks.iter().any(asked) {
                    return;
                }
                let (position, place) =
                    (self.of.points.points()[point as usize], self.of.places[point as usize]);
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
                // A vertex inside of the mesh has one place; only one outside of the moved boundary has a choice.
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

    /// The error of a place that represents a reference vertex, as a fraction of the allowed one; 0 if the vertex is on
    /// one side of all values of the need.
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

    /// The least error, as a fraction of the allowed one, of the places on the boundary that may represent a reference
    /// vertex.
    fn ratio_at_border(&self, ask: &Ask<'_>, point: u32) -> f64 {
        let p = DVec3::from(self.of.input.positions[point as usize]);
        let per_error = self.of.info.displacement_per_error;
        let allowed = ask.allowed[point as usize];
        // Tetrahedra without these values, or with no visible change of colour, may have any error.
        let reach = match &ask.need.part {
            Part::Transfer(_) => self.largest,
            Part::Values(_) | Part::Both(..) => allowed.max(self.largest),
            Part::View(_) => allowed.min(self.largest),
            Part::Everywhere | Part::Region(_) => allowed,
        };
        let mut least = f64::INFINITY;
        // The rounding of the vertex to the lattice is no displacement.
        let moved =
            p.distance(DVec3::from(self.of.info.lattice.point(self.of.points.points()[point as usize])));
        let slack = moved + self.of.slack;
        self.border.triangles.within(p, reach * per_error + slack, |i, q, distance| {
            let (t, face) = self.border.faces[i as usize];
            let tet = self.mesh.tets[t as usize];
            let away = (distance - slack).max(0.0);
            let displaced = if away > 0.0 { away / per_error } else { 0.0 };
            let own = weights_on_triangle(q, self.border.triangles.corners[i as usize]);
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
            let p = self.of.info.lattice.point(self.of.points.points()[v as usize]);
            self.compare_distance(p, &self.border.triangles, "of the input's boundary", &mut failures, found);
        }
        failures.end("vertices of the input's boundary", found);
    }

    fn compare_distance(
        &self,
        p: [f64; 3],
        other: &TriangleGrid,
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
        let p = DVec3::from(p);
        let distance = other.nearest(p).map_or(f64::INFINITY, |(_, q)| p.distance(q));
        if bound > 0.0 {
            found.worst_ratio = found.worst_ratio.max(distance / allowed);
        }
        if distance > allowed {
            failures.add(|| {
                format!(
                    "vertex {what} at {:?} is {distance} from the other, more than {allowed}",
                    p.to_array()
                )
            });
        }
    }
}

/// Failures of one kind: the first ones in full, and their number.
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
    triangles: TriangleGrid,
    /// The tetrahedron behind each triangle, and the triangle's vertices.
    faces: Vec<(u32, [u32; 3])>,
}

impl Border {
    fn of(mesh: &PlainMesh<'_>, info: &MtInfo) -> Self {
        let faces: Vec<(u32, [u32; 3])> = mesh.boundary().collect();
        let at = |v: u32| DVec3::from(info.lattice.point(mesh.positions[v as usize]));
        let triangles = TriangleGrid::new(faces.iter().map(|(_, face)| face.map(at)).collect());
        Self { triangles, faces }
    }
}
