//! How far is an extracted mesh from the input, at every reference vertex and all over the boundary?

use super::expected::{hash_of_tet, hashes_of_vertices};
use super::mesh_checks::{PlainMesh, PlainReference};
use super::parts::{Ask, change, is_aside};
use super::report::{Failures, Measured};
use super::split::{Split, split};
use super::surfaces::{Comparison, Distances, Surface};
use foldhash::HashMap;
use glam::DVec3;
use std::borrow::Cow;
use std::mem::take;
use std::ops::Range;
use tetralod::geom::{ON_LATTICE, PointGrid, TetPlaces, weights_on_triangle};
use tetralod::mesh::{BitSet, TetMesh, boundary_faces};
use tetralod::mt::{ApplyUpdates, CurrentMesh, ErrorCode, FieldInfo, MtInfo, Regions, UpdateId};
use tetralod::refine::{Need, Part};

/// The input, prepared for being compared with.
pub struct Deviation<'a> {
    info: &'a MtInfo,
    /// With a point for each region where fields jump.
    input: Cow<'a, TetMesh>,
    /// The tetrahedra without these.
    joined: Cow<'a, [[u32; 4]]>,
    /// The region of each point where fields jump; else empty.
    regions: Vec<u16>,
    /// Whether interfaces may have moved: then a point may be in another region.
    may_move: bool,
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
    /// What was found out with earlier meshes: most of the next one is like them.
    inside: Inside,
    distances: Distances,
}

/// What is shown at the reference vertices inside of each tetrahedron that has been in a mesh.
#[derive(Default)]
struct Inside {
    /// Where a tetrahedron's vertices are, by its hash.
    of_tet: HashMap<u64, Range<usize>>,
    points: Vec<u32>,
    /// Reference vertices that have been in another region than theirs.
    elsewhere: BitSet,
    /// The interpolated values, as fractions of each field's range: `shown[i * fields + f]`.
    shown: Vec<f64>,
}

/// Refuses an input of another size than that of the MT.
pub fn check_counts(info: &MtInfo, input: &TetMesh) -> Result<(), String> {
    let [points, tets] = input.counts();
    let wanted = [u64::from(info.vertices), info.tetrahedra];
    if [points, tets] == wanted {
        return Ok(());
    }
    let [vertices, tetrahedra] = wanted;
    Err(format!(
        "the MT was built from {vertices} vertices and {tetrahedra} tetrahedra, the input has {points} and {tets}: give the mesh that \
         it was built from"
    ))
}

impl<'a> Deviation<'a> {
    /// Prepares to compare with `input`, which has to be what `info` says. About `vertices` of the reference vertices
    /// are measured.
    pub fn new(
        info: &'a MtInfo,
        regions: Option<&Regions>,
        input: &'a TetMesh,
        vertices: usize,
    ) -> Result<Self, String> {
        check_counts(info, input)?;
        let neighbors =
            tetralod::mesh::neighbors(&input.tets).map_err(|error| format!("the input: {error}"))?;
        let faces = boundary_faces(&input.tets, &neighbors).map(|(_, face)| face).collect();
        drop(neighbors);
        Self::of(info, split(input, regions)?, faces, vertices)
    }

    /// Prepares to compare with what the input has in some place, given the faces of its boundary there.
    pub fn of(
        info: &'a MtInfo,
        input: Split<'a>,
        faces: Vec<[u32; 3]>,
        vertices: usize,
    ) -> Result<Self, String> {
        let Split { mesh: input, joined, regions, may_move } = input;
        let points = input.positions.len();
        let mut fields = Vec::new();
        for field in &info.fields {
            let found = input.fields.iter().find(|f| field.is_of(f) && f.values.len() == points);
            fields.push(&found.ok_or_else(|| format!("the input has no field '{}'", field.name))?.values);
        }
        let positions: Vec<[i32; 3]> = input.positions.iter().map(|p| info.lattice.nearest(*p)).collect();
        let each = || (0..points).flat_map(|v| fields.iter().zip(&info.fields).map(move |(f, i)| (f[v], i)));
        let (origin, step) = (DVec3::from(info.lattice.origin), DVec3::from(info.lattice.step));
        let mut places: Vec<DVec3> =
            input.positions.iter().map(|p| (DVec3::from(*p) - origin) / step).collect();
        // Beside where the lattice has put a vertex of an interface there may be another region.
        for ((place, position), _) in
            places.iter_mut().zip(&positions).zip(&regions).filter(|(_, (_, several))| *several)
        {
            *place = DVec3::from_array(position.map(f64::from));
        }
        let levels = each().map(|(value, field)| field.nearest(value)).collect();
        let values = each().map(|(value, field)| value / field.range()).collect();
        let boundary = Surface::new(info, faces.iter().map(|face| face.map(|v| positions[v as usize])));
        let stride = points.div_ceil(vertices.max(1)).max(1);
        let slack = 1e-9 * tetralod::geom::Bounds::of(&input.positions).diagonal();
        Ok(Self {
            info,
            joined,
            regions: regions.into_iter().map(|(region, _)| region).collect(),
            may_move,
            input,
            points: PointGrid::new(positions),
            places,
            levels,
            values,
            boundary,
            stride,
            slack,
            inside: Inside::default(),
            distances: Distances::default(),
        })
    }

    /// The input on the lattice.
    pub fn reference(&self) -> PlainReference<'_> {
        PlainReference { positions: self.points.points(), levels: &self.levels, tets: &self.input.tets }
    }

    /// The input on the lattice with one vertex for all regions that meet there.
    pub fn joined(&self) -> PlainReference<'_> {
        let positions = &self.points.points()[..self.info.vertices as usize];
        PlainReference { positions, levels: &self.levels, tets: &self.joined }
    }

    /// Whether a tetrahedron is of the region of a point.
    fn is_beside(&self, point: u32, mesh: &PlainMesh<'_>, t: u32) -> bool {
        let own = self.regions.get(point as usize);
        own.is_none_or(|own| mesh.mesh.regions().get(t as usize) == Some(own))
    }

    /// The errors that each need allows at the reference vertices; `bounds` are the guaranteed ones.
    pub fn asks<'n>(&self, needs: &'n [Need], bounds: &[f64]) -> Vec<Ask<'n>> {
        let ask = |(need, &bound): (&'n Need, &f64)| {
            let mut ask = Ask::new(self.info, &self.input, need, bound);
            let unseen = ask.allowed.iter_mut().enumerate().filter(|(point, _)| point % self.stride != 0);
            unseen.for_each(|(_, allowed)| *allowed = f64::INFINITY);
            ask
        };
        needs.iter().zip(bounds).map(ask).collect()
    }

    /// Measures `mesh` where needs apply. `errors` are those of its tetrahedra.
    pub fn measure(&mut self, mesh: &PlainMesh<'_>, errors: &TetErrors, asks: &[Ask<'_>]) -> Measured {
        let (mut inside, mut distances) = (take(&mut self.inside), take(&mut self.distances));
        let border = Border::of(mesh, self.info);
        let largest = errors.codes.iter().copied().max().unwrap_or_default().error();
        let look = Look { of: self, mesh, border, errors, largest, asks };
        let mut found = Measured { worst_ratio: 0.0, failures: Vec::new() };
        look.at_vertices(&mut inside, &mut found);
        // Elsewhere the boundary may be anywhere.
        if asks.iter().any(|ask| matches!(ask.need.part, Part::Everywhere | Part::Region(_))) {
            let (stride, slack) = (look.of.stride, look.of.slack);
            let comparison = Comparison { info: look.of.info, asks, stride, slack };
            comparison.both_ways(&look.border.surface, &look.of.boundary, &mut distances, &mut found);
        }
        (self.inside, self.distances) = (inside, distances);
        found
    }

    /// Whether the lattice has a reference vertex exactly where it is, with these levels.
    fn is_exactly(&self, point: u32, levels: &[i32]) -> bool {
        let point = point as usize;
        let position = DVec3::from_array(self.points.points()[point].map(f64::from));
        self.places[point].distance(position) < ON_LATTICE
            && self.levels[point * levels.len()..][..levels.len()] == *levels
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
struct Place<'a> {
    tet: u32,
    /// The values there, as fractions of each field's range.
    shown: &'a [f64],
    /// The distance of the place from the vertex, as the error that it counts as.
    displaced: f64,
}

impl Look<'_> {
    /// The error at every reference vertex to which a need applies.
    fn at_vertices(&self, inside: &mut Inside, found: &mut Measured) {
        let asks = self.asks.len();
        // For each vertex and need, the least part of what is allowed.
        let mut least = vec![f64::INFINITY; self.of.points.points().len() * asks];
        self.at_common_vertices(&mut least);
        let hashes = hashes_of_vertices(self.mesh.mesh);
        let fields = self.of.info.fields.len();
        for (t, tet) in (0..).zip(self.mesh.tets) {
            let key = hash_of_tet(tet.map(|v| hashes[v as usize]));
            let range = match inside.of_tet.get(&key) {
                Some(range) => range.clone(),
                None => self.locate((t, tet), key, inside),
            };
            for i in range {
                let point = inside.points[i];
                let place = Place { tet: t, shown: &inside.shown[i * fields..][..fields], displaced: 0.0 };
                let least = &mut least[point as usize * asks..][..asks];
                for (ask, least) in self.asks.iter().zip(least) {
                    if ask.allowed[point as usize] < f64::INFINITY {
                        *least = least.min(self.ratio(ask, point, &place));
                    }
                }
            }
        }
        let in_other = &inside.elsewhere;
        for (k, ask) in self.asks.iter().enumerate() {
            let mut failures = Failures::default();
            for (point, &allowed) in ask.allowed.iter().enumerate() {
                if allowed == f64::INFINITY {
                    continue;
                }
                let inside = least[point * asks + k];
                // A vertex inside of the mesh has one place; only one outside of the moved boundary has a choice.
                if self.of.may_move && !inside.is_finite() && in_other.has(point as u32) {
                    // The interface has moved over it.
                    continue;
                }
                let at_border = || self.ratio_at_border(ask, point as u32, found.worst_ratio.min(1.0));
                let ratio = if inside.is_finite() { inside } else { at_border() };
                found.worst_ratio = found.worst_ratio.max(ratio);
                if ratio > 1.0 {
                    failures.add(|| self.describe(ask, point, inside, ratio));
                }
            }
            failures.end("reference vertices", found);
        }
    }

    /// The error where a vertex of the mesh is one of the input: what the levels round off.
    fn at_common_vertices(&self, least: &mut [f64]) {
        let mut shown = Vec::new();
        for (slot, &position) in (0..).zip(self.mesh.positions) {
            let levels = self.mesh.mesh.levels(slot);
            for point in self.of.points.at(position).filter(|&point| self.of.is_exactly(point, levels)) {
                shown.clear();
                shown.extend(self.of.info.fields.iter().zip(levels).map(shown_at));
                let least = &mut least[point as usize * self.asks.len()..][..self.asks.len()];
                for (ask, least) in self.asks.iter().zip(least) {
                    *least = self.error(ask, point, &shown, 0.0) / ask.allowed[point as usize];
                }
            }
        }
    }

    /// Finds out which reference vertices are inside of a tetrahedron, but for common ones at its corners, and what is shown there.
    fn locate(&self, (t, tet): (u32, &[u32; 4]), key: u64, inside: &mut Inside) -> Range<usize> {
        let corners = tet.map(|v| self.mesh.positions[v as usize]);
        let is_corner = |point: u32, position: [i32; 3]| {
            let mut at = (0..4).filter(|&i| corners[i] == position);
            at.any(|i| self.of.is_exactly(point, self.mesh.mesh.levels(tet[i])))
        };
        let first = inside.points.len();
        let mut places = None;
        self.of.points.near_tet(&corners, |point| {
            let (position, place) = (self.of.points.points()[point as usize], self.of.places[point as usize]);
            if !(point as usize).is_multiple_of(self.of.stride) || is_corner(point, position) {
                return;
            }
            let places = places.get_or_insert_with(|| TetPlaces::new(corners));
            if let Some(weights) = places.weights(position, place) {
                if !self.of.is_beside(point, self.mesh, t) {
                    // On an interface it is in another region, too.
                    inside.elsewhere.insert(point);
                    return;
                }
                inside.points.push(point);
                self.interpolate(tet, weights, &mut inside.shown);
            }
        });
        let range = first..inside.points.len();
        inside.of_tet.insert(key, range.clone());
        range
    }

    /// Appends the values at a place in a tetrahedron, as fractions of each field's range.
    fn interpolate(&self, tet: &[u32; 4], weights: [f64; 4], shown: &mut Vec<f64>) {
        for (f, field) in self.of.info.fields.iter().enumerate() {
            let at = |(&v, w): (&u32, f64)| shown_at((field, &self.mesh.mesh.levels(v)[f])) * w;
            shown.push(tet.iter().zip(weights).map(at).sum());
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
    fn ratio(&self, ask: &Ask<'_>, point: u32, place: &Place<'_>) -> f64 {
        let named = ask.values().map(|values| values.field).or(ask.need.measured_field());
        let error = self.errors.error(place.tet, named);
        let near = place.displaced <= error;
        if let Some(values) = ask.values() {
            let info = &self.of.info.fields[values.field];
            let value = self.known(point)[values.field] * info.range();
            let tet = self.mesh.tets[place.tet as usize];
            if near && is_aside(info, values, self.mesh, tet, error, value) {
                return 0.0;
            }
        }
        let is_known = near || !ask.is_of_colour();
        let found =
            if is_known { self.error(ask, point, place.shown, place.displaced) } else { f64::INFINITY };
        found / ask.allowed[point as usize]
    }

    /// The error of showing these values so far from a reference vertex, in the unit of the need.
    fn error(&self, ask: &Ask<'_>, point: u32, shown: &[f64], displaced: f64) -> f64 {
        let known = self.known(point);
        if let Part::Transfer(transfer) = &ask.need.part {
            let info = &self.of.info.fields[transfer.field];
            let [wanted, shown] = [known, shown].map(|values| values[transfer.field] * info.range());
            return change(info, transfer, wanted, shown);
        }
        let measured = ask.need.measured_field().map_or(0..known.len(), |field| field..field + 1);
        measured.map(|f| (shown[f] - known[f]).abs()).fold(displaced, f64::max)
    }

    /// The values that the input has at a vertex, as fractions of each field's range.
    fn known(&self, point: u32) -> &[f64] {
        let fields = self.of.info.fields.len();
        &self.of.values[point as usize * fields..][..fields]
    }

    /// The least error, as a fraction of the allowed one, of the places on the boundary that may represent a reference
    /// vertex; if that is less than `enough`, anything from there to `enough`.
    fn ratio_at_border(&self, ask: &Ask<'_>, point: u32, enough: f64) -> f64 {
        let p = DVec3::from(self.of.input.positions[point as usize]);
        let per_error = self.of.info.displacement_per_error;
        let allowed = ask.allowed[point as usize];
        // Tetrahedra without these values, or with no visible change of colour, may have any error.
        let (reach, counts) = match &ask.need.part {
            Part::Transfer(_) => (self.largest, false),
            Part::Values(_) | Part::Both(..) => (allowed.max(self.largest), false),
            Part::View(_) => (allowed.min(self.largest), true),
            Part::Everywhere | Part::Region(_) => (allowed, true),
        };
        // The rounding of the vertex to the lattice is no displacement.
        let moved =
            p.distance(DVec3::from(self.of.info.lattice.point(self.of.points.points()[point as usize])));
        let slack = moved + self.of.slack;
        let displaced = |distance: f64| if distance > slack { (distance - slack) / per_error } else { 0.0 };
        let mut least = f64::INFINITY;
        let mut shown = Vec::new();
        self.border.surface.triangles.outwards(p, reach * per_error + slack, |i, q, distance| {
            let displaced = displaced(distance);
            // Those to come are further away.
            if least <= enough || counts && displaced >= least * allowed {
                return true;
            }
            let (t, face) = self.border.faces[i as usize];
            if !self.of.is_beside(point, self.mesh, t) {
                return false;
            }
            let tet = &self.mesh.tets[t as usize];
            let own = weights_on_triangle(q, self.border.surface.triangles.corners[i as usize]);
            let weights = tet.map(|v| face.iter().zip(own).find(|(w, _)| **w == v).map_or(0.0, |(_, x)| x));
            shown.clear();
            self.interpolate(tet, weights, &mut shown);
            least = least.min(self.ratio(ask, point, &Place { tet: t, shown: &shown, displaced }));
            false
        });
        least
    }
}

/// What a vertex with this level shows, as a fraction of the field's range.
fn shown_at((field, &level): (&FieldInfo, &i32)) -> f64 {
    field.value(level) / field.range()
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
