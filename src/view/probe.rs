//! Where points and lines are in a mesh, and what the field is there.
//!
//! A point is found by walking through neighbours towards it. Where the walk ends at the boundary, which in a domain
//! that is not convex need not mean that the point is outside, all tetrahedra are searched or, when that happens more
//! often, a grid of boxes over the mesh. All decisions are exact (Shewchuk 1997) for the coordinates given.
//!
//! What holds: a point of the domain, its boundary included, is found; of several tetrahedra that meet at a point the one whose corners come
//! first by their coordinates is taken: numbers would depend on what a mesh has been before. Points that are computed to be on a face of the boundary are beside it by what rounding does: one that is outside by no more
//! than [`ROUNDING`] is found in the nearest tetrahedron, at its border. What is further outside is not found.

use crate::geom::{Bounds, Groups};
use crate::mesh::{FACES, NONE};
use crate::view::{FieldView, MeshView};
use glam::DVec3;
use robust::Coord3D;
use std::cmp::Ordering;

/// Pieces of a line that are shorter than this fraction of it are left out, and gaps are closed: rounding makes them
/// where a line passes through points and edges of the mesh.
const SHORTEST: f64 = 1e-12;

/// How far outside a point may be to be found all the same, as a fraction of the largest coordinate of the mesh and the point.
const ROUNDING: f64 = 1e-13;

/// The most steps of a walk: it ends in most meshes, but can run in a circle in some.
const MOST_STEPS: u32 = 10_000;

/// Steps from the place before, after which a grid is the shorter way.
const NEAR_STEPS: u32 = 12;

/// Points located by searching all tetrahedra before a grid is made.
const MOST_SCANS: u32 = 8;

/// Tetrahedra tried as the start of a walk.
const STARTS: usize = 16;

/// A place in a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The tetrahedron.
    pub tet: u32,
    /// Barycentric coordinates: not negative, 1 in sum.
    pub weights: [f64; 4],
}

impl Place {
    /// The value of the mesh's own field; of a label that of the corner with the largest coordinate.
    ///
    /// # Panics
    /// If the mesh has no such tetrahedron.
    pub fn value(&self, mesh: &MeshView<'_>) -> f64 {
        self.interpolate(mesh, mesh.own_field())
    }

    /// Where in the model it is.
    ///
    /// # Panics
    /// If the mesh has no such tetrahedron.
    pub fn position(&self, mesh: &MeshView<'_>) -> [f64; 3] {
        let corners = mesh.tets[self.tet as usize].map(|p| mesh.positions[p as usize]);
        [0, 1, 2].map(|axis| (0..4).map(|i| self.weights[i] * corners[i][axis]).sum())
    }

    /// The value of any field, given by one number a point; it is linear between the corners.
    ///
    /// # Panics
    /// If the mesh has no such tetrahedron, or the field too few numbers.
    pub fn interpolate<'f>(&self, mesh: &MeshView<'_>, field: impl Into<FieldView<'f>>) -> f64 {
        let FieldView { values, is_label } = field.into();
        let values = mesh.tets[self.tet as usize].map(|p| values[p as usize]);
        if is_label { self.nearest(values) } else { self.linear(values) }
    }

    /// What is linear between values at the corners.
    pub(crate) fn linear(&self, values: [f64; 4]) -> f64 {
        (0..4).map(|i| self.weights[i] * values[i]).sum()
    }

    /// Of labels at the corners that of the nearest one, by barycentric coordinates; the least of several.
    pub(crate) fn nearest(&self, labels: [f64; 4]) -> f64 {
        let largest = self.weights.iter().fold(0.0, |most: f64, weight| most.max(*weight));
        let nearest = (0..4).filter(|&i| self.weights[i] >= largest).map(|i| labels[i]);
        nearest.fold(f64::INFINITY, f64::min)
    }
}

/// The part of a line in one tetrahedron. Fields are linear in between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Where the line enters, as a fraction of its length.
    pub from: f64,
    /// Where it leaves.
    pub to: f64,
    /// The place where it enters.
    pub entry: Place,
    /// The place where it leaves, in the same tetrahedron.
    pub exit: Place,
}

/// Finds places in a mesh.
#[derive(Clone, Debug)]
pub struct Probe<'a> {
    mesh: MeshView<'a>,
    /// Where the last point was.
    last: u32,
    grid: Option<Grid>,
    /// Points that the walk has not found.
    scans: u32,
}

impl<'a> Probe<'a> {
    /// A probe for this mesh.
    pub fn new(mesh: MeshView<'a>) -> Self {
        Self { mesh, last: 0, grid: None, scans: 0 }
    }

    /// The mesh that is probed.
    pub fn mesh(&self) -> &MeshView<'a> {
        &self.mesh
    }

    /// Makes the grid now: from then on scattered points are found in less time. Costs a few passes over the mesh, as
    /// much as some ten thousand points.
    pub fn make_grid(&mut self) {
        if self.grid.is_none() {
            self.grid = Some(Grid::new(&self.mesh));
        }
    }

    /// The place of a point; none outside, but for what rounding does. Points near to the one before are found soonest.
    ///
    /// # Panics
    /// If the mesh names a point or a neighbour that it does not have.
    pub fn locate(&mut self, p: [f64; 3]) -> Option<Place> {
        if !p.iter().all(|x| x.is_finite()) || self.mesh.tets.is_empty() {
            return None;
        }
        let tet = self.find(p).or_else(|| self.find_beside(p))?;
        self.last = tet;
        self.place_in(tet, p)
    }

    /// The place of a point as one of a tetrahedron, in which it need not be.
    pub(super) fn place_in(&self, tet: u32, p: [f64; 3]) -> Option<Place> {
        Some(Place { tet, weights: weights(self.sides(tet, p)?) })
    }

    /// The locations of many points, with a grid if there are enough.
    ///
    /// # Panics
    /// As [`Probe::locate`].
    pub fn locate_all(&mut self, points: &[[f64; 3]]) -> Vec<Option<Place>> {
        if points.len() > self.mesh.tets.len() / 64 {
            self.make_grid();
        }
        points.iter().map(|p| self.locate(*p)).collect()
    }

    fn find(&mut self, p: [f64; 3]) -> Option<u32> {
        if let Some(tet) = self.walk(self.last, p, NEAR_STEPS) {
            return Some(self.first_at(tet, p));
        }
        if let Some(grid) = &self.grid {
            return self.first_of(grid.at(p), p).map(|tet| self.first_at(tet, p));
        }
        if let Some(tet) = self.start(p).and_then(|start| self.walk(start, p, MOST_STEPS)) {
            return Some(self.first_at(tet, p));
        }
        self.scans += 1;
        if self.scans > MOST_SCANS {
            self.make_grid();
        }
        let near = NearLine::new(&self.mesh, p, p);
        let mut candidates = (0..self.mesh.tets.len() as u32).filter(|&t| near.meets(&self.mesh, t));
        candidates.find(|&t| self.holds(t, p)).map(|tet| self.first_at(tet, p))
    }

    /// The nearest tetrahedron to a point that is outside by what rounding does; of several the first by its corners.
    fn find_beside(&self, p: [f64; 3]) -> Option<u32> {
        let largest =
            |bounds: &Bounds| bounds.min.into_iter().chain(bounds.max).fold(0.0, |m: f64, x| m.max(x.abs()));
        let bounds = self
            .grid
            .as_ref()
            .map_or_else(|| self.mesh.bounds(), |grid| Bounds { min: grid.min, max: grid.max });
        let reach = ROUNDING * largest(&bounds.with(p));
        let [low, high] = [-reach, reach].map(|reach| p.map(|x| x + reach));
        if !(0..3).all(|i| bounds.min[i] <= high[i] && low[i] <= bounds.max[i]) {
            return None;
        }
        let mut best: Option<(f64, u32)> = None;
        let mut see = |t: u32| {
            let beside = self.beside(t, p, [low, high]).filter(|beside| *beside <= reach);
            let is_nearer = |beside: f64| match best {
                None => true,
                Some((least, of)) => beside.total_cmp(&least).then_with(|| self.by_corners(t, of)).is_lt(),
            };
            if let Some(beside) = beside.filter(|beside| is_nearer(*beside)) {
                best = Some((beside, t));
            }
        };
        match &self.grid {
            Some(grid) => grid.within(low, high).into_iter().for_each(&mut see),
            None => (0..self.mesh.tets.len() as u32).for_each(&mut see),
        }
        best.map(|(_, t)| t)
    }

    /// How far a point is beyond the faces of a tetrahedron, of those whose box meets another one.
    fn beside(&self, t: u32, p: [f64; 3], [low, high]: [[f64; 3]; 2]) -> Option<f64> {
        let corners = self.proper(t)?.map(|v| self.mesh.positions[v as usize]);
        let meets =
            |i: usize| corners.iter().any(|c| c[i] <= high[i]) && corners.iter().any(|c| c[i] >= low[i]);
        if !(meets(0) && meets(1) && meets(2)) {
            return None;
        }
        let beyond = |face: [usize; 3]| {
            let [a, b, c] = face.map(|k| DVec3::from(corners[k]));
            let area = (b - a).cross(c - a).length();
            orient(a.into(), b.into(), c.into(), p) / area
        };
        Some(FACES.map(beyond).into_iter().fold(0.0, f64::max))
    }

    fn first_of(&self, candidates: &[u32], p: [f64; 3]) -> Option<u32> {
        candidates.iter().copied().find(|&t| self.holds(t, p))
    }

    fn holds(&self, t: u32, p: [f64; 3]) -> bool {
        let Some(tet) = self.proper(t) else { return false };
        (0..4).all(|i| self.side(FACES[i].map(|k| tet[k]), p) <= 0.0)
    }

    /// The parts of the segment between two points, in order from the first; between them, and at the ends, there are
    /// gaps where the segment is outside. A part that lies in a face or an edge is given for one of its tetrahedra.
    ///
    /// # Panics
    /// If the mesh names a point that it does not have.
    pub fn line(&self, from: [f64; 3], to: [f64; 3]) -> Vec<Span> {
        if from == to || !from.iter().chain(&to).all(|x| x.is_finite()) {
            return Vec::new();
        }
        let mut parts: Vec<(f64, f64, u32)> = Vec::new();
        let mut clip = |t: u32| {
            if let Some((enter, leave)) = self.ends(t, from, to).and_then(|ends| clipped(&ends)) {
                parts.push((enter, leave, t));
            }
        };
        match &self.grid {
            Some(grid) => grid.along(from, to).into_iter().for_each(clip),
            None => {
                let near = NearLine::new(&self.mesh, from, to);
                (0..self.mesh.tets.len() as u32).filter(|&t| near.meets(&self.mesh, t)).for_each(&mut clip);
            }
        }
        parts.sort_unstable_by(|a, b| {
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then_with(|| self.by_corners(a.2, b.2))
        });
        let mut spans: Vec<Span> = Vec::new();
        for (enter, leave, t) in parts {
            let done = spans.last().map_or(f64::NEG_INFINITY, |span| span.to);
            let enter = if enter - done <= SHORTEST { done } else { enter };
            if leave - enter > SHORTEST {
                spans.extend(self.span(t, from, to, [enter, leave]));
            }
        }
        spans
    }

    fn span(&self, tet: u32, from: [f64; 3], to: [f64; 3], [enter, leave]: [f64; 2]) -> Option<Span> {
        let ends = self.ends(tet, from, to)?;
        let place = |s: f64| Place { tet, weights: weights(ends.map(|[a, b]| a + s * (b - a))) };
        Some(Span { from: enter, to: leave, entry: place(enter), exit: place(leave) })
    }

    /// The best of a few tetrahedra to start a walk from (Mücke, Saias, Zhu 1996).
    fn start(&self, p: [f64; 3]) -> Option<u32> {
        let count = self.mesh.tets.len();
        let distance = |t: u32| {
            let corner =
                self.mesh.tets.get(t as usize).and_then(|tet| self.mesh.positions.get(tet[0] as usize));
            let corner = corner?;
            Some((0..3).map(|i| (p[i] - corner[i]) * (p[i] - corner[i])).sum::<f64>())
        };
        let others = (0..STARTS).map(|i| (i * count / STARTS) as u32);
        let mut best: Option<(f64, u32)> = None;
        for t in std::iter::once(self.last).chain(others) {
            if let Some(d) = distance(t).filter(|d| best.is_none_or(|(least, _)| *d < least)) {
                best = Some((d, t));
            }
        }
        best.map(|(_, t)| t)
    }

    /// Walks towards a point; none if the walk ends at the boundary or takes too many steps.
    fn walk(&self, start: u32, p: [f64; 3], most_steps: u32) -> Option<u32> {
        let (mut t, mut from) = (start, NONE);
        for step in 0..most_steps {
            let tet = self.mesh.tets.get(t as usize).filter(|tet| tet[0] != NONE)?;
            let around = self.mesh.neighbors[t as usize];
            // Which of several ways is taken changes from step to step, against circles.
            let turn = (step.wrapping_mul(0x9e37_79b9) >> 30) as usize;
            let (mut next, mut is_outside) = (NONE, false);
            for i in (0..4).map(|k| (k + turn) % 4).filter(|&i| around[i] != from || from == NONE) {
                if self.side(FACES[i].map(|k| tet[k]), p) > 0.0 {
                    is_outside = true;
                    next = around[i];
                    if next != NONE {
                        break;
                    }
                }
            }
            if !is_outside {
                // Not so behind a tetrahedron that is inside out.
                return self.holds(t, p).then_some(t);
            }
            if next == NONE {
                return None;
            }
            (from, t) = (t, next);
        }
        None
    }

    /// Of the tetrahedra that contain the point and are connected there the first by their corners.
    fn first_at(&self, tet: u32, p: [f64; 3]) -> u32 {
        let mut found = vec![tet];
        let mut next = 0;
        while let Some(&t) = found.get(next) {
            next += 1;
            let Some(sides) = self.sides(t, p) else { continue };
            let around = self.mesh.neighbors[t as usize];
            for n in (0..4).filter(|&i| sides[i] == 0.0 && around[i] != NONE).map(|i| around[i]) {
                if !found.contains(&n) && self.holds(n, p) {
                    found.push(n);
                }
            }
        }
        found.into_iter().min_by(|a, b| self.by_corners(*a, *b)).unwrap_or(tet)
    }

    /// The order of two tetrahedra by the coordinates of their corners, the lowest corners first.
    fn by_corners(&self, a: u32, b: u32) -> Ordering {
        let [a, b] = [a, b].map(|t| {
            let mut corners = self.mesh.tets[t as usize].map(|v| self.mesh.positions[v as usize]);
            corners.sort_unstable_by(by_coordinates);
            corners
        });
        let differs = a.iter().zip(&b).map(|(p, q)| by_coordinates(p, q));
        differs.fold(Ordering::Equal, Ordering::then)
    }

    /// On which side of each face a point is: positive outside, with the exact sign; none for a tetrahedron that
    /// rounding has made flat or turned inside out: the others cover its place.
    fn sides(&self, t: u32, p: [f64; 3]) -> Option<[f64; 4]> {
        let tet = self.proper(t)?;
        Some([0, 1, 2, 3].map(|i| self.side(FACES[i].map(|k| tet[k]), p)))
    }

    /// On which side of each face the two ends of a segment are, as [`Self::sides`] has it.
    fn ends(&self, t: u32, from: [f64; 3], to: [f64; 3]) -> Option<[[f64; 2]; 4]> {
        let tet = self.proper(t)?;
        Some([0, 1, 2, 3].map(|i| [from, to].map(|p| self.side(FACES[i].map(|k| tet[k]), p))))
    }

    fn proper(&self, t: u32) -> Option<[u32; 4]> {
        let tet = *self.mesh.tets.get(t as usize)?;
        if tet[0] == NONE {
            return None;
        }
        let [a, b, c, d] = tet.map(|v| self.mesh.positions[v as usize]);
        (orient(a, b, c, d) > 0.0).then_some(tet)
    }

    /// On which side of a face a point is. Seen from the neighbour, the same number with the other sign: the corners
    /// are taken in ascending order.
    fn side(&self, face: [u32; 3], p: [f64; 3]) -> f64 {
        let mut sorted = face;
        sorted.sort_unstable();
        let [a, b, c] = sorted.map(|v| self.mesh.positions[v as usize]);
        let is_even = [[0, 1, 2], [1, 2, 0], [2, 0, 1]].iter().any(|turn| turn.map(|k| face[k]) == sorted);
        let side = orient(a, b, c, p);
        if is_even { side } else { -side }
    }
}

fn by_coordinates(p: &[f64; 3], q: &[f64; 3]) -> Ordering {
    p.iter().zip(q).map(|(x, y)| x.total_cmp(y)).fold(Ordering::Equal, Ordering::then)
}

/// Six times the volume of a tetrahedron, with the exact sign.
fn orient(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let coord = |[x, y, z]: [f64; 3]| Coord3D { x, y, z };
    -robust::orient3d(coord(a), coord(b), coord(c), coord(d))
}

/// Barycentric coordinates from the sides of the faces opposite each corner.
fn weights(sides: [f64; 4]) -> [f64; 4] {
    let parts = sides.map(|side| (-side).max(0.0));
    let sum: f64 = parts.iter().sum();
    if sum > 0.0 { parts.map(|part| part / sum) } else { [0.25; 4] }
}

/// The part of a segment that is inside, given the sides of its ends; none if it is not longer than a point.
fn clipped(ends: &[[f64; 2]; 4]) -> Option<(f64, f64)> {
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for &[a, b] in ends {
        if a > 0.0 && b > 0.0 {
            return None;
        }
        if a > 0.0 {
            enter = enter.max(a / (a - b));
        } else if b > 0.0 {
            leave = leave.min(a / (a - b));
        }
    }
    (enter < leave).then_some((enter, leave))
}

/// A quick test whether a tetrahedron may intersect a segment. Each point of the mesh has a bit for every plane around
/// the segment that it lies beyond; a tetrahedron whose corners have one in common is apart.
struct NearLine {
    beyond: Vec<u16>,
}

impl NearLine {
    fn new(mesh: &MeshView<'_>, from: [f64; 3], to: [f64; 3]) -> Self {
        let d = [0, 1, 2].map(|i| to[i] - from[i]);
        // Two planes through the segment, along the axes in which it is shortest.
        let long = (0..3).fold(0, |long, i| if d[i].abs() > d[long].abs() { i } else { long });
        let slanted = |p: [f64; 3], short: usize| {
            let [a, b] = [d[long] * (p[short] - from[short]), d[short] * (p[long] - from[long])];
            // What rounding may have done.
            (a - b, 1e-15 * (a.abs() + b.abs()))
        };
        let beyond = |p: &[f64; 3]| {
            let p = *p;
            let mut bits = 0;
            let mut bit = |is_beyond: bool| bits = bits << 1 | u16::from(is_beyond);
            for i in 0..3 {
                bit(p[i] < from[i].min(to[i]));
                bit(p[i] > from[i].max(to[i]));
            }
            for short in [(long + 1) % 3, (long + 2) % 3] {
                let (height, slack) = slanted(p, short);
                bit(height < -slack);
                bit(height > slack);
            }
            bits
        };
        Self { beyond: mesh.positions.iter().map(beyond).collect() }
    }

    fn meets(&self, mesh: &MeshView<'_>, t: u32) -> bool {
        let tet = mesh.tets[t as usize];
        tet[0] != NONE && tet.iter().fold(u16::MAX, |common, v| common & self.beyond[*v as usize]) == 0
    }
}

/// Boxes of equal size over a mesh, with the tetrahedra whose own boxes meet each.
#[derive(Clone, Debug)]
struct Grid {
    min: [f64; 3],
    max: [f64; 3],
    /// Boxes per model unit.
    scale: [f64; 3],
    dims: [usize; 3],
    tets: Groups,
}

impl Grid {
    /// Tetrahedra for each box, roughly.
    const PER_BOX: usize = 4;
    /// Boxes that a tetrahedron may be in, on average.
    const MOST_BOXES: u64 = 24;

    fn new(mesh: &MeshView<'_>) -> Self {
        let mut grid = Self::empty(mesh);
        let wanted = (mesh.tets.len() / Self::PER_BOX).max(1) as f64;
        let mut boxes = wanted;
        loop {
            grid.set_dims(boxes);
            let entries: u64 = mesh.tets.iter().map(|tet| grid.count(mesh, tet)).sum();
            if entries <= Self::MOST_BOXES * mesh.tets.len() as u64 || boxes <= 1.0 {
                break;
            }
            // A few large tetrahedra are in too many small boxes.
            boxes = (boxes / 4.0).floor();
        }
        grid.fill(mesh);
        grid
    }

    fn empty(mesh: &MeshView<'_>) -> Self {
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for &v in mesh.tets.iter().filter(|tet| tet[0] != NONE).flatten() {
            let p = mesh.positions[v as usize];
            (0..3).for_each(|i| {
                min[i] = min[i].min(p[i]);
                max[i] = max[i].max(p[i]);
            });
        }
        Self { min, max, scale: [0.0; 3], dims: [1; 3], tets: Groups::default() }
    }

    /// About so many boxes, nearly cubes. Found by doubling the number along the axis where boxes are longest.
    fn set_dims(&mut self, boxes: f64) {
        let extent = [0, 1, 2].map(|i| self.max[i] - self.min[i]);
        let mut dims = [1_usize; 3];
        while (dims.iter().product::<usize>() as f64) < boxes {
            let size = [0, 1, 2].map(|i| extent[i] / dims[i] as f64);
            let long = (0..3).fold(0, |long, i| if size[i] > size[long] { i } else { long });
            dims[long] *= 2;
        }
        self.dims = dims;
        self.scale = [0, 1, 2].map(|i| if extent[i] > 0.0 { dims[i] as f64 / extent[i] } else { 0.0 });
    }

    /// The box that a coordinate is in, the nearest one outside; this never decreases as the coordinate grows.
    fn place(&self, x: f64, i: usize) -> usize {
        // The cast saturates.
        (((x - self.min[i]) * self.scale[i]) as usize).min(self.dims[i] - 1)
    }

    /// The boxes that a tetrahedron may be in.
    fn range(&self, mesh: &MeshView<'_>, tet: &[u32; 4]) -> [[usize; 2]; 3] {
        let corners = tet.map(|v| mesh.positions[v as usize]);
        [0, 1, 2].map(|i| {
            let low = corners.iter().fold(f64::INFINITY, |m, p| m.min(p[i]));
            let high = corners.iter().fold(f64::NEG_INFINITY, |m, p| m.max(p[i]));
            [self.place(low, i), self.place(high, i)]
        })
    }

    fn count(&self, mesh: &MeshView<'_>, tet: &[u32; 4]) -> u64 {
        if tet[0] == NONE {
            return 0;
        }
        self.range(mesh, tet).iter().map(|[low, high]| (high - low + 1) as u64).product()
    }

    fn fill(&mut self, mesh: &MeshView<'_>) {
        self.tets = Groups::new(self.dims.iter().product(), |add| {
            for (t, tet) in (0..).zip(mesh.tets).filter(|(_, tet)| tet[0] != NONE) {
                self.each_box(self.range(mesh, tet), |b| add(b, t));
            }
        });
    }

    fn each_box(&self, range: [[usize; 2]; 3], mut see: impl FnMut(usize)) {
        let [x, y, z] = range;
        for k in z[0]..=z[1] {
            for j in y[0]..=y[1] {
                (x[0]..=x[1]).for_each(|i| see((k * self.dims[1] + j) * self.dims[0] + i));
            }
        }
    }

    /// The tetrahedra that a point may be in, in ascending order.
    fn at(&self, p: [f64; 3]) -> &[u32] {
        if !(0..3).all(|i| self.min[i] <= p[i] && p[i] <= self.max[i]) {
            return &[];
        }
        let [i, j, k] = [0, 1, 2].map(|axis| self.place(p[axis], axis));
        self.tets.of((k * self.dims[1] + j) * self.dims[0] + i)
    }

    /// The tetrahedra that may be in a box, in ascending order.
    fn within(&self, low: [f64; 3], high: [f64; 3]) -> Vec<u32> {
        let mut found = Vec::new();
        let range = [0, 1, 2].map(|i| [self.place(low[i], i), self.place(high[i], i)]);
        self.each_box(range, |b| found.extend_from_slice(self.tets.of(b)));
        found.sort_unstable();
        found.dedup();
        found
    }

    /// The tetrahedra that a segment may meet, in ascending order.
    fn along(&self, from: [f64; 3], to: [f64; 3]) -> Vec<u32> {
        let mut found = Vec::new();
        let d = [0, 1, 2].map(|i| to[i] - from[i]);
        let long = (0..3).fold(0, |long, i| {
            if (d[i] * self.scale[i]).abs() > (d[long] * self.scale[long]).abs() { i } else { long }
        });
        let mut ends = [from[long], to[long]];
        ends.sort_unstable_by(f64::total_cmp);
        if ends[1] < self.min[long] || ends[0] > self.max[long] {
            return found;
        }
        for layer in self.place(ends[0], long)..=self.place(ends[1], long) {
            // The part of the segment in this layer of boxes, and a little more.
            let s = [layer as f64 - 1e-6, layer as f64 + 1.0 + 1e-6].map(|x| {
                let x =
                    if self.scale[long] > 0.0 { self.min[long] + x / self.scale[long] } else { from[long] };
                if d[long] == 0.0 { x } else { ((x - from[long]) / d[long]).clamp(0.0, 1.0) }
            });
            let s = if d[long] == 0.0 { [0.0, 1.0] } else { s };
            let range = [0, 1, 2].map(|i| {
                let mut x = s.map(|s| from[i] + s * d[i]);
                x.sort_unstable_by(f64::total_cmp);
                let slack = 1e-12 * (from[i].abs() + to[i].abs());
                if i == long {
                    [layer, layer]
                } else {
                    [self.place(x[0] - slack, i), self.place(x[1] + slack, i)]
                }
            });
            self.each_box(range, |b| found.extend_from_slice(self.tets.of(b)));
        }
        found.sort_unstable();
        found.dedup();
        found
    }
}
