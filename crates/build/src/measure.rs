//! How far a mesh is from the one that it stands for, measured at every reference vertex.
//!
//! A reference vertex is compared, where the input has it, with the linear interpolant of the tetrahedron that contains it
//! (decided exactly if the lattice has not moved it) or, where the boundary has moved, with that of the nearest boundary triangle.
//!
//! An MT promises that each reference vertex has *some* place in the mesh, no farther than the boundary may have
//! moved, where the field is within its bound. Where the boundary has moved this need not be the nearest place,
//! nor one in a tetrahedron that happens to contain the vertex. So when [`Part::promise`] is given, places on the
//! boundary within its distance count as well, and the one that fits best is taken.

mod angles;

#[doc(hidden)]
pub use angles::{CellAngles, CellsBelow};

use glam::DVec3;
use tetralod::geom::{PointGrid, TetPlaces, TriangleGrid, weights_on_triangle};
use tetralod::mesh::boundary_faces;
use tetralod::mt::{CurrentMesh, FieldInfo, MtInfo};

/// The vertices and one field of the mesh that an MT was built from.
#[derive(Clone, Copy, Debug)]
#[doc(hidden)]
pub struct Reference<'a> {
    /// Points in model units.
    pub positions: &'a [[f64; 3]],
    /// One value per point, in field units.
    pub values: &'a [f64],
    /// Which field of the MT these values are.
    pub field: usize,
    /// Where the field jumps, the region of each point: no tetrahedron of another one tells anything of it. Else empty.
    pub regions: &'a [u16],
}

/// Where to measure.
#[derive(Clone, Debug, Default)]
#[doc(hidden)]
pub struct Part {
    /// Only in tetrahedra in which the field has a value of one of these ranges; everywhere if empty.
    pub ranges: Vec<[f64; 2]>,
    /// The bounds that are guaranteed, if any.
    pub promise: Option<Promise>,
}

/// What an MT promises of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
#[doc(hidden)]
pub struct Promise {
    /// Largest difference of the field, in field units.
    pub field: f64,
    /// Largest distance of a reference vertex from the mesh, in model units.
    pub distance: f64,
}

impl Promise {
    /// What a mesh with a relative error of `bound` promises. Half a step of the lattices is added: that is what the
    /// reference itself was rounded by; and no bound is below what is left at full resolution ([`MtInfo::floor`]).
    pub fn of(info: &MtInfo, field: usize, bound: f64) -> Self {
        let bound = bound.max(info.floor(field));
        let (field, step) = (&info.fields[field], DVec3::from(info.lattice.step));
        Self {
            field: bound * field.range() + 0.5 * field.step * ROUNDING,
            distance: bound * info.displacement_per_error + 0.5 * step.length() * ROUNDING,
        }
    }
}

/// Allowance for the rounding errors of the measurement itself.
const ROUNDING: f64 = 1.000_01;

/// What was measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[doc(hidden)]
pub struct Deviation {
    /// Largest difference of the field, in field units.
    pub field: f64,
    /// Largest distance of a reference vertex from the mesh, in model units.
    pub distance: f64,
    /// Reference vertices that were compared.
    pub vertices: u64,
}

/// Measures how far `mesh` is from `reference` in the part that is asked for.
#[doc(hidden)]
pub fn deviation(info: &MtInfo, mesh: &CurrentMesh, reference: &Reference<'_>, part: &Part) -> Deviation {
    let measure = Measure { info, field: &info.fields[reference.field], mesh, reference, part };
    let pairs = reference.positions.iter().zip(reference.values);
    let mut points: Vec<Point> = pairs.map(|(p, value)| Point::new(*p, *value)).collect();
    let grid = PointGrid::new(points.iter().map(|p| info.lattice.nearest(p.place.to_array())).collect());
    for t in 0..mesh.tets().len() {
        measure.look_inside(t, &grid, &mut points);
    }
    measure.look_beside(&mut points);
    let mut largest = Deviation::default();
    let counts = |point: &&Point| !point.excused || measure.is_kept(point);
    for (field, distance) in points.iter().filter(counts).filter_map(|point| point.least) {
        largest.field = largest.field.max(field);
        largest.distance = largest.distance.max(distance);
        largest.vertices += 1;
    }
    largest
}

/// A reference vertex.
struct Point {
    /// Where it is in the input, in model units.
    place: DVec3,
    value: f64,
    /// Whether some tetrahedron contains it.
    inside: bool,
    /// Whether the promise may be kept by a tetrahedron in a part that is not asked for.
    excused: bool,
    /// The least deviation found, and the distance at which it was found.
    least: Option<(f64, f64)>,
}

impl Point {
    fn new(place: [f64; 3], value: f64) -> Self {
        Self { place: DVec3::from(place), value, inside: false, excused: false, least: None }
    }

    /// Takes note of a deviation, at this distance, if it is the least one.
    fn compare(&mut self, value: f64, distance: f64) {
        let deviation = (value - self.value).abs();
        if self.least.is_none_or(|(least, _)| deviation < least) {
            self.least = Some((deviation, distance));
        }
    }
}

struct Measure<'a> {
    info: &'a MtInfo,
    field: &'a FieldInfo,
    mesh: &'a CurrentMesh,
    reference: &'a Reference<'a>,
    part: &'a Part,
}

/// The boundary of the mesh.
struct Boundary {
    triangles: TriangleGrid,
    /// Of each triangle, the values at its corners, and whether the field has a wanted value in its tetrahedron.
    values: Vec<([f64; 3], bool)>,
}

impl Measure<'_> {
    fn values<const N: usize>(&self, slots: [u32; N]) -> [f64; N] {
        slots.map(|slot| self.field.value(self.mesh.levels(slot)[self.reference.field]))
    }

    /// Whether the field has one of the wanted values in a tetrahedron.
    fn spans(&self, values: [f64; 4]) -> bool {
        let low = values.into_iter().fold(f64::INFINITY, f64::min);
        let high = values.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let ranges = &self.part.ranges;
        ranges.is_empty() || ranges.iter().any(|&[from, to]| low <= to && from <= high)
    }

    fn look_inside(&self, t: usize, grid: &PointGrid, points: &mut [Point]) {
        let (tet, region) = (self.mesh.tets()[t], self.mesh.regions().get(t));
        let corners = tet.map(|slot| self.mesh.positions()[slot as usize]);
        let values = self.values(tet);
        let spans = self.spans(values);
        let [origin, step] = [self.info.lattice.origin, self.info.lattice.step].map(DVec3::from);
        let tet = TetPlaces::new(corners);
        grid.near_tet(&corners, |i| {
            let point = &mut points[i as usize];
            let place = (point.place - origin) / step;
            let Some(weights) = tet.weights(grid.points()[i as usize], place) else { return };
            point.inside = true;
            let is_beside = self.reference.regions.get(i as usize).is_none_or(|own| Some(own) == region);
            if spans && is_beside {
                point.compare(weights.iter().zip(values).map(|(w, v)| w * v).sum(), 0.0);
            }
        });
    }

    /// Whether the field is within its bound at a point.
    fn is_kept(&self, point: &Point) -> bool {
        self.part.promise.is_some_and(|promise| point.least.is_some_and(|(field, _)| field <= promise.field))
    }

    /// Compares points with places on the boundary: those that no tetrahedron contains, and those for which the
    /// promise has not been found to be kept.
    fn look_beside(&self, points: &mut [Point]) {
        let open = |point: &Point| match self.part.promise {
            None => !point.inside,
            Some(_) => (!point.inside || point.least.is_some()) && !self.is_kept(point),
        };
        if !points.iter().any(open) {
            return;
        }
        let boundary = self.boundary();
        let mut near = Vec::new();
        for point in points {
            if let Some(promise) = self.part.promise.filter(|_| open(point)) {
                near.clear();
                boundary.triangles.within(point.place, promise.distance, |i, q, _| near.push((i, q)));
                // In the order of the triangles, each once.
                near.sort_unstable_by_key(|(i, _)| *i);
                near.dedup_by_key(|(i, _)| *i);
                for (i, q) in near.drain(..) {
                    if open(point) {
                        boundary.compare(point, i, q);
                    }
                }
            }
            if !point.inside && point.least.is_none() {
                let nearest = boundary.triangles.nearest(point.place);
                nearest.into_iter().for_each(|(i, q)| boundary.compare(point, i, q));
            }
        }
    }

    fn boundary(&self) -> Boundary {
        let at = |slot: u32| DVec3::from(self.info.lattice.point(self.mesh.positions()[slot as usize]));
        let tets = self.mesh.tets();
        let faces = boundary_faces(tets, self.mesh.neighbors());
        let triangle = |(t, face): (u32, [u32; 3])| {
            (face.map(at), (self.values(face), self.spans(self.values(tets[t as usize]))))
        };
        let (corners, values) = faces.map(triangle).unzip();
        Boundary { triangles: TriangleGrid::new(corners), values }
    }
}

impl Boundary {
    /// Compares a point with the place `q` of a triangle.
    fn compare(&self, point: &mut Point, triangle: u32, q: DVec3) {
        let (values, spans) = self.values[triangle as usize];
        if !spans {
            point.excused = true;
            return;
        }
        let weights = weights_on_triangle(q, self.triangles.corners[triangle as usize]);
        let [a, b, c] = [0, 1, 2].map(|i| values[i] * weights[i]);
        point.compare(a + b + c, point.place.distance(q));
    }
}
