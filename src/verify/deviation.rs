//! How far is an extracted mesh from the input, at every reference vertex and all over the boundary?

use super::mesh_checks::{PlainMesh, PlainReference};
use super::parts::{Ask, change, is_aside};
use crate::geom::{PointGrid, TetPlaces, TriangleGrid, weights_on_triangle};
use crate::mesh::{TetMesh, boundary_faces};
use crate::mt::{ApplyUpdates, CurrentMesh, ErrorCode, MtInfo, UpdateId};
use crate::refine::{Need, Part};
use glam::DVec3;
use std::collections::HashSet;

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
    boundary: Surface,
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
        let boundary = Surface::new(info, faces.iter().map(|face| face.map(|v| positions[v as usize])));
        let stride = points.div_ceil(vertices.max(1)).max(1);
        let slack = 1e-9 * crate::geom::Bounds::of(&input.positions).diagonal();
        Ok(Self {
            info,
            input,
            points: PointGrid::new(positions),
            places,
            levels,
            values,
            boundary,
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
        let largest = errors.codes.iter().copied().max().unwrap_or_default().error();
        let look = Look { of: self, mesh, border, errors, largest, asks };
        let mut found = Measured { worst_ratio: 0.0, failures: Vec::new() };
        look.at_vertices(&mut found);
        // Elsewhere the boundary may be anywhere.
        if asks.iter().any(|ask| matches!(ask.need.part, Part::Everywhere | Part::Region(_))) {
            let (ours, theirs) = (&look.border.surface, &self.boundary);
            look.compare_surfaces(ours, theirs, "the extracted boundary", &mut found);
            look.compare_surfaces(theirs, ours, "the input's boundary", &mut found);
        }
        found
    }
}

/// What removes the tetrahedra of a mesh, and their errors: those of the updates that remove them, or their own where these are known.
pub struct TetErrors {
    fields: usize,
    removers: Vec<Option<UpdateId>>,
    /// `codes[tet * fields + f]`; zeros for tetrahedra that nothing removes.
    codes: Vec<ErrorCode>,
}

impl TetErrors {
    pub fn of(mt: &impl ApplyUpdates, mesh: &CurrentMesh) -> Self {
        let fields = mt.info().fields.len();
        let removers: Vec<Option<UpdateId>> =
            (0..mesh.tets().len() as u32).map(|t| mt.remover(mesh, t)).collect();
        let mut codes = Vec::with_capacity(fields * removers.len());
        for (t, &remover) in (0..).zip(&removers) {
            let Some(u) = remover else {
                codes.resize(codes.len() + fields, ErrorCode::ZERO);
                continue;
            };
            let own = mt.quarterings(mesh, t);
            codes.extend((0..fields).map(|field| mt.own_error(u, field, own)));
        }
        Self { fields, removers, codes }
    }

    pub fn remover(&self, tet: u32) -> Option<UpdateId> {
        self.removers[tet as usize]
    }

    /// The errors of a tetrahedron, field by field.
    pub fn of_tet(&self, tet: u32) -> &[ErrorCode] {
        &self.codes[tet as usize * self.fields..][..self.fields]
    }

    /// The error of a tetrahedron in one field, or the largest one of all.
    fn error(&self, tet: u32, field: Option<usize>) -> f64 {
        let all = self.of_tet(tet);
        field.map_or_else(|| all.iter().max(), |field| all.get(field)).copied().unwrap_or_default().error()
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
            let mut places = None;
            self.of.points.near_tet(&corners, |point| {
                let asked = |ask: &Ask<'_>| ask.allowed[point as usize] < f64::INFINITY;
                if !self.asks.iter().any(asked) {
                    return;
                }
                let (position, place) =
                    (self.of.points.points()[point as usize], self.of.places[point as usize]);
                let places = places.get_or_insert_with(|| TetPlaces::new(corners));
                let Some(weights) = places.weights(position, place) else { return };
                let least = &mut least[point as usize * self.asks.len()..][..self.asks.len()];
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
        let error = self.errors.error(place.tet, named);
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
        self.border.surface.triangles.within(p, reach * per_error + slack, |i, q, distance| {
            let (t, face) = self.border.faces[i as usize];
            let tet = self.mesh.tets[t as usize];
            let away = (distance - slack).max(0.0);
            let displaced = if away > 0.0 { away / per_error } else { 0.0 };
            let own = weights_on_triangle(q, self.border.surface.triangles.corners[i as usize]);
            let weights = tet.map(|v| face.iter().zip(own).find(|(w, _)| **w == v).map_or(0.0, |(_, x)| x));
            least = least.min(self.ratio(ask, point, &Place { tet: t, weights, displaced }));
        });
        least
    }

    /// Whether a boundary is near the other one, at the [`PLACES`] of its faces.
    fn compare_surfaces(&self, one: &Surface, other: &Surface, what: &str, found: &mut Measured) {
        let mut failures = Failures::default();
        // The next place is likely near the same triangle.
        let mut first = 0;
        let [origin, step] = [self.of.info.lattice.origin, self.of.info.lattice.step].map(DVec3::from);
        // Faces around an edge or a vertex have it in common.
        let mut seen = HashSet::new();
        for face in one.faces.iter().step_by(self.of.stride).filter(|face| !other.has.contains(*face)) {
            // The place that is furthest away.
            let mut worst = (0.0, String::new());
            for (sort, sixths) in places(face) {
                if !seen.insert(sixths) {
                    continue;
                }
                let p = origin + step * DVec3::from(sixths.map(|q| q as f64 / 6.0));
                let binding = self.asks.iter().filter(|ask| ask.binds_boundary_at(p.to_array()));
                let bound = binding.map(|ask| ask.bound).fold(f64::INFINITY, f64::min);
                if bound == f64::INFINITY {
                    continue;
                }
                let allowed = bound * self.of.info.displacement_per_error + self.of.slack;
                // Where that is no more than elsewhere, it need not be known how near the nearest triangle is.
                let enough = if bound > 0.0 { allowed * found.worst_ratio.min(1.0) } else { allowed };
                if let Some(near) = other.triangles.any_within(p, enough, first) {
                    first = near;
                    continue;
                }
                let distance = other.triangles.nearest(p).map_or(f64::INFINITY, |(_, q)| p.distance(q));
                if bound > 0.0 {
                    found.worst_ratio = found.worst_ratio.max(distance / allowed);
                }
                if distance > allowed && distance > worst.0 {
                    let at = p.to_array();
                    let failure = format!(
                        "{sort} of {what} at {at:?} is {distance} from the other, more than {allowed}"
                    );
                    worst = (distance, failure);
                }
            }
            if worst.0 > 0.0 {
                failures.add(|| worst.1);
            }
        }
        failures.end(&format!("faces of {what}"), found);
    }
}

/// Parts of the corners, in sixths, of each place where the face of a boundary is compared with another boundary.
const PLACES: [(&str, [i64; 3]); 7] = [
    ("vertex", [6, 0, 0]),
    ("vertex", [0, 6, 0]),
    ("vertex", [0, 0, 6]),
    ("middle", [3, 3, 0]),
    ("middle", [0, 3, 3]),
    ("middle", [3, 0, 3]),
    ("middle", [2, 2, 2]),
];

/// These places of a face, in sixths of a step of the lattice: exact, so that all faces around an edge agree about its middle.
fn places(face: &[[i32; 3]; 3]) -> [(&'static str, [i64; 3]); 7] {
    let mean = |parts: [i64; 3], i: usize| (0..3).map(|k| parts[k] * i64::from(face[k][i])).sum();
    PLACES.map(|(sort, parts)| (sort, [0, 1, 2].map(|i| mean(parts, i))))
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

/// A boundary.
struct Surface {
    /// Its faces, in model units.
    triangles: TriangleGrid,
    /// The same on the lattice, corners ascending, and as a set: faces that two boundaries share need not be compared.
    faces: Vec<[[i32; 3]; 3]>,
    has: HashSet<[[i32; 3]; 3]>,
}

impl Surface {
    fn new(info: &MtInfo, faces: impl Iterator<Item = [[i32; 3]; 3]>) -> Self {
        let mut faces: Vec<[[i32; 3]; 3]> = faces.collect();
        let at = |q: [i32; 3]| DVec3::from(info.lattice.point(q));
        let triangles = TriangleGrid::new(faces.iter().map(|face| face.map(at)).collect());
        faces.iter_mut().for_each(|face| face.sort_unstable());
        Self { triangles, has: faces.iter().copied().collect(), faces }
    }
}

/// The boundary of an extracted mesh.
struct Border {
    surface: Surface,
    /// The tetrahedron behind each face, and the face's vertices.
    faces: Vec<(u32, [u32; 3])>,
}

impl Border {
    fn of(mesh: &PlainMesh<'_>, info: &MtInfo) -> Self {
        let faces: Vec<(u32, [u32; 3])> = mesh.boundary().collect();
        let corners = faces.iter().map(|(_, face)| face.map(|v| mesh.positions[v as usize]));
        Self { surface: Surface::new(info, corners), faces }
    }
}
