//! How far a mesh is from the one that it stands for, measured at every reference vertex.
//!
//! A reference vertex is compared, where the input has it, with the linear interpolant of the tetrahedron that contains it
//! (decided exactly if the lattice has not moved it) or, where the boundary has moved, with that of the nearest boundary triangle.
//!
//! An MT promises that each reference vertex has *some* place in the mesh, no farther than the boundary may have
//! moved, where the field is as near as promised. Where the boundary has moved this need not be the nearest place,
//! nor one in a tetrahedron that happens to contain the vertex. So when [`Part::promise`] is given, places on the
//! boundary within its distance count as well, and the one that fits best is taken.

use crate::geom::Bounds;
use crate::geom::nearest_on_triangle;
use crate::geom::weights_at;
use crate::mesh::FACES;
use crate::mesh::NONE;
use crate::mt::CurrentMesh;
use crate::mt::FieldInfo;
use crate::mt::MtInfo;
use glam::DVec3;
use std::ops::RangeInclusive;

/// The vertices and one field of the mesh that an MT was built from.
#[derive(Clone, Copy, Debug)]
pub struct Reference<'a> {
    /// Points in model units.
    pub positions: &'a [[f64; 3]],
    /// One value per point, in field units.
    pub values: &'a [f64],
    /// Which field of the MT these values are.
    pub field: usize,
}

/// Where to measure.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// Only at vertices in this box.
    pub roi: Option<Bounds>,
    /// Only in tetrahedra in which the field has a value of one of these ranges; everywhere if empty.
    pub ranges: Vec<[f64; 2]>,
    /// What has been promised, if anything.
    pub promise: Option<Promise>,
}

/// What an MT promises of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
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
pub struct Deviation {
    /// Largest difference of the field, in field units.
    pub field: f64,
    /// Largest distance of a reference vertex from the mesh, in model units.
    pub distance: f64,
    /// Reference vertices that were compared.
    pub vertices: u64,
}

/// Measures how far `mesh` is from `reference` in the part that is asked for.
pub fn deviation(info: &MtInfo, mesh: &CurrentMesh, reference: &Reference<'_>, part: &Part) -> Deviation {
    let measure = Measure { info, field: &info.fields[reference.field], mesh, reference, part };
    let wanted = |p: &[f64; 3]| part.roi.is_none_or(|roi| roi.contains(*p));
    let points: Vec<Point> = reference
        .positions
        .iter()
        .zip(reference.values)
        .filter(|(p, _)| wanted(p))
        .map(|(p, value)| Point {
            at: info.lattice.nearest(*p),
            place: DVec3::from(*p),
            value: *value,
            inside: false,
            excused: false,
            least: None,
        })
        .collect();
    let mut raster = Raster::new(points, info.lattice.step);
    for tet in mesh.tets() {
        measure.look_inside(*tet, &mut raster);
    }
    measure.look_beside(&mut raster);
    let mut largest = Deviation::default();
    let counts = |point: &&Point| !point.excused || measure.is_kept(point);
    for (field, distance) in raster.points.iter().filter(counts).filter_map(|point| point.least) {
        largest.field = largest.field.max(field);
        largest.distance = largest.distance.max(distance);
        largest.vertices += 1;
    }
    largest
}

/// A reference vertex on the lattice.
struct Point {
    at: [i32; 3],
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

struct Measure<'a> {
    info: &'a MtInfo,
    field: &'a FieldInfo,
    mesh: &'a CurrentMesh,
    reference: &'a Reference<'a>,
    part: &'a Part,
}

/// A boundary triangle: its corners in model units and their values.
struct Triangle {
    corners: [DVec3; 3],
    values: [f64; 3],
    low: DVec3,
    high: DVec3,
    /// Whether the field has a wanted value in its tetrahedron.
    spans: bool,
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

    fn look_inside(&self, tet: [u32; 4], raster: &mut Raster) {
        let corners = tet.map(|slot| self.mesh.positions()[slot as usize]);
        let values = self.values(tet);
        let spans = self.spans(values);
        let low = [0, 1, 2].map(|i| corners.iter().map(|q| q[i]).fold(i32::MAX, i32::min));
        let high = [0, 1, 2].map(|i| corners.iter().map(|q| q[i]).fold(i32::MIN, i32::max));
        // A point may be half a step beside its place on the lattice.
        let (low, high) = (low.map(|x| x.saturating_sub(1)), high.map(|x| x.saturating_add(1)));
        raster.for_each_between(low, high, |point| {
            let place =
                (point.place - DVec3::from(self.info.lattice.origin)) / DVec3::from(self.info.lattice.step);
            let Some(weights) = weights_at(corners, point.at, place) else { return };
            point.inside = true;
            if spans {
                let value: f64 = weights.iter().zip(values).map(|(w, v)| w * v).sum();
                let deviation = (value - point.value).abs();
                if point.least.is_none_or(|(least, _)| deviation < least) {
                    point.least = Some((deviation, 0.0));
                }
            }
        });
    }

    /// Whether what is promised has been found at a point.
    fn is_kept(&self, point: &Point) -> bool {
        self.part.promise.is_some_and(|promise| point.least.is_some_and(|(field, _)| field <= promise.field))
    }

    /// Compares points with places on the boundary: those that no tetrahedron contains, and those for which the
    /// promise has not been found to be kept.
    fn look_beside(&self, raster: &mut Raster) {
        let open = |point: &Point| match self.part.promise {
            None => !point.inside,
            Some(_) => (!point.inside || point.least.is_some()) && !self.is_kept(point),
        };
        if !raster.points.iter().any(open) {
            return;
        }
        let triangles = self.boundary();
        if let Some(promise) = self.part.promise {
            triangles.iter().for_each(|triangle| self.look_around(triangle, promise.distance, raster, open));
        }
        for point in raster.points.iter_mut().filter(|point| !point.inside && point.least.is_none()) {
            self.look_nearest(point, &triangles);
        }
    }

    /// Compares a triangle with the points that are no farther from it than `reach`.
    fn look_around(
        &self,
        triangle: &Triangle,
        reach: f64,
        raster: &mut Raster,
        open: impl Fn(&Point) -> bool,
    ) {
        let corner = |corner: DVec3| self.info.lattice.nearest(corner.to_array());
        // One step more for the rounding to the lattice.
        let low = corner(triangle.low - reach).map(|x| x - 1);
        let high = corner(triangle.high + reach).map(|x| x + 1);
        raster.for_each_between(low, high, |point| {
            if !open(point) {
                return;
            }
            let p = point.place;
            let q = nearest_on_triangle(p, triangle.corners);
            if p.distance(q) <= reach {
                self.compare(point, triangle, p, q);
            }
        });
    }

    /// Compares a point with the nearest place on the boundary.
    fn look_nearest(&self, point: &mut Point, triangles: &[Triangle]) {
        let p = point.place;
        let mut nearest: Option<(f64, DVec3, &Triangle)> = None;
        for triangle in triangles {
            let bound = p.distance_squared(p.clamp(triangle.low, triangle.high));
            if nearest.is_some_and(|(distance, ..)| bound >= distance) {
                continue;
            }
            let q = nearest_on_triangle(p, triangle.corners);
            let distance = p.distance_squared(q);
            if nearest.is_none_or(|(least, ..)| distance < least) {
                nearest = Some((distance, q, triangle));
            }
        }
        if let Some((_, q, triangle)) = nearest {
            self.compare(point, triangle, p, q);
        }
    }

    /// Compares the point at `p` with the place `q` of a triangle.
    fn compare(&self, point: &mut Point, triangle: &Triangle, p: DVec3, q: DVec3) {
        if !triangle.spans {
            point.excused = true;
            return;
        }
        let deviation = (triangle.value(q) - point.value).abs();
        if point.least.is_none_or(|(least, _)| deviation < least) {
            point.least = Some((deviation, p.distance(q)));
        }
    }

    fn boundary(&self) -> Vec<Triangle> {
        let mut triangles = Vec::new();
        for (tet, around) in self.mesh.tets().iter().zip(self.mesh.neighbors()) {
            for face in (0..4).filter(|&face| around[face] == NONE) {
                let slots = FACES[face].map(|i| tet[i]);
                let corners = slots
                    .map(|slot| DVec3::from(self.info.lattice.point(self.mesh.positions()[slot as usize])));
                triangles.push(Triangle {
                    corners,
                    values: self.values(slots),
                    low: corners[0].min(corners[1]).min(corners[2]),
                    high: corners[0].max(corners[1]).max(corners[2]),
                    spans: self.spans(self.values(*tet)),
                });
            }
        }
        triangles
    }
}

impl Triangle {
    /// The interpolated value at a point of the triangle.
    fn value(&self, q: DVec3) -> f64 {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a);
        let area = normal.length_squared();
        if area <= 0.0 {
            return self.values[0];
        }
        let v = (q - a).cross(c - a).dot(normal) / area;
        let w = (b - a).cross(q - a).dot(normal) / area;
        self.values[0] * (1.0 - v - w) + self.values[1] * v + self.values[2] * w
    }
}

/// Points sorted into the boxes of a regular raster.
struct Raster {
    points: Vec<Point>,
    /// Where the points of each box start.
    starts: Vec<u32>,
    low: [i32; 3],
    high: [i32; 3],
    boxes: [usize; 3],
}

/// Points in a box, on average, if they were spread evenly.
const CROWD: f64 = 2.0;
/// Most boxes along an axis.
const MAX_BOXES: f64 = 256.0;

impl Raster {
    fn new(mut points: Vec<Point>, step: [f64; 3]) -> Self {
        let low = [0, 1, 2].map(|i| points.iter().map(|p| p.at[i]).min().unwrap_or(0));
        let high = [0, 1, 2].map(|i| points.iter().map(|p| p.at[i]).max().unwrap_or(0));
        let extent = [0, 1, 2].map(|i| f64::from(high[i] - low[i] + 1) * step[i]);
        let side = (extent[0] * extent[1] * extent[2] * CROWD / points.len().max(1) as f64).cbrt();
        let boxes = extent.map(|e| (e / side).clamp(1.0, MAX_BOXES) as usize);
        let mut raster = Self { points: Vec::new(), starts: Vec::new(), low, high, boxes };
        points.sort_by_cached_key(|point| raster.index(point.at));
        raster.starts = vec![0; boxes.iter().product::<usize>() + 1];
        for point in &points {
            let index = raster.index(point.at);
            raster.starts[index + 1] += 1;
        }
        (1..raster.starts.len()).for_each(|i| raster.starts[i] += raster.starts[i - 1]);
        raster.points = points;
        raster
    }

    /// Which box a coordinate between `low` and `high` falls into along an axis.
    fn along(&self, axis: usize, x: i32) -> usize {
        let size = u64::from(self.high[axis].abs_diff(self.low[axis])) + 1;
        (u64::from(x.abs_diff(self.low[axis])) * self.boxes[axis] as u64 / size) as usize
    }

    fn index(&self, at: [i32; 3]) -> usize {
        let [x, y, z] = [0, 1, 2].map(|axis| self.along(axis, at[axis]));
        (z * self.boxes[1] + y) * self.boxes[0] + x
    }

    /// Calls `look` with the points between two corners.
    fn for_each_between(&mut self, low: [i32; 3], high: [i32; 3], mut look: impl FnMut(&mut Point)) {
        let (low, high) =
            ([0, 1, 2].map(|i| low[i].max(self.low[i])), [0, 1, 2].map(|i| high[i].min(self.high[i])));
        if self.points.is_empty() || (0..3).any(|i| low[i] > high[i]) {
            return;
        }
        let range = |axis: usize| -> RangeInclusive<usize> {
            self.along(axis, low[axis])..=self.along(axis, high[axis])
        };
        let [xs, ys, zs] = [range(0), range(1), range(2)];
        for z in zs {
            for y in ys.clone() {
                let row = (z * self.boxes[1] + y) * self.boxes[0];
                let first = self.starts[row + xs.start()] as usize;
                let end = self.starts[row + xs.end() + 1] as usize;
                for point in &mut self.points[first..end] {
                    if (0..3).all(|i| low[i] <= point.at[i] && point.at[i] <= high[i]) {
                        look(point);
                    }
                }
            }
        }
    }
}
