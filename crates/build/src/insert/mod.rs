//! Greedy insertion, coarse to fine: always the reference point with the largest error.
//!
//! This is how the paper builds its vertex-based MTs (§5), after Garland and Heckbert's greedy insertion (1995) and
//! Hamann and Chen's for volumes (1994). Every reference point that is not yet a vertex is in the bucket of a
//! tetrahedron that contains it. A heap holds the tetrahedra by the largest error in their buckets; an insertion moves
//! the points of the tetrahedra that it removes to those that it creates.
//!
//! An MT of these insertions extracts more tetrahedra than the plain greedy mesh of the same error: an insertion has to
//! have an error of at least those of all that depend on it, and some make worse tetrahedra than those that they
//! remove, which later ones reduce. So a selective request keeps its error, at the cost of more updates.

pub(crate) mod sequence;

use crate::geometry::delaunay::{MT_LIMITS, Triangulation, extreme_points};
use crate::insert::sequence::{Insertion, Sequence};
use crate::lattice::quantize::Quantized;
use crate::{BuildError, BuildProgress, OnProgress};
use std::collections::BinaryHeap;
use tetralod::geom::{NARROW_BITS, orient3d};
use tetralod::mesh::NONE;

/// Errors below this count as equal: tetrahedra are then taken by size, the largest first, at the point next to their
/// middle, so that the partial order stays shallow.
const FINEST: f64 = 2e-4;

/// How often progress is reported, in insertions.
const PROGRESS_STEPS: usize = 1024;

/// Inserts all points of `quantized` into a triangulation of the corners of their hull. `tets` is the reference mesh,
/// or nothing where there are only points. With `tet_errors` the errors of every tetrahedron by itself are recorded, too.
///
/// # Errors
/// If the points span no volume or two are equal, if the reference mesh does not fill its convex hull, if more
/// tetrahedra would have to meet at a point than an MT can describe, or if `progress` stops the work.
pub(crate) fn insert(
    quantized: &Quantized,
    tets: &[[u32; 4]],
    tet_errors: bool,
    progress: OnProgress<'_>,
) -> Result<Sequence, BuildError> {
    refuse_duplicates(&quantized.positions)?;
    let corners = extreme_points(&quantized.positions)?;
    let mesh = Triangulation::of(&quantized.positions, &corners)?;
    let base = mesh.finite_tets();
    if !tets.is_empty() {
        // Rounding to the lattice moves the boundary by up to half the diagonal of a step, in or out of the hull.
        let slack = 6.0 * 3_f64.sqrt() * mesh.hull_area(&quantized.positions);
        let missing = volume(&base, quantized) - volume(tets, quantized);
        if missing as f64 > slack {
            return Err(BuildError::NotConvex);
        }
    }
    let mut greedy = Greedy::new(mesh, base, quantized);
    greedy.closed = tet_errors.then(|| Closed::new(quantized));
    greedy.distribute(&corners);
    greedy.insert_all(quantized.positions.len() - corners.len(), progress)?;
    Ok(greedy.sequence)
}

fn refuse_duplicates(positions: &[[i32; 3]]) -> Result<(), BuildError> {
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by_key(|&v| (positions[v as usize], v));
    match order.windows(2).find(|w| positions[w[0] as usize] == positions[w[1] as usize]) {
        Some(w) => Err(BuildError::SamePlace { points: [w[0], w[1]] }),
        None => Ok(()),
    }
}

fn volume(tets: &[[u32; 4]], quantized: &Quantized) -> i128 {
    let six_volume = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| quantized.positions[v as usize]);
        orient3d(a, b, c, d)
    };
    tets.iter().map(six_volume).sum()
}

/// The tetrahedron in a slot.
#[derive(Clone, Copy)]
struct Bucket {
    /// The first of its points; the others follow in [`Greedy::next`].
    first: u32,
    /// The largest error of its points.
    error: f64,
    /// The point to insert.
    chosen: u32,
    /// Counts the tetrahedra that have been in the slot.
    stamp: u32,
}

const NO_BUCKET: Bucket = Bucket { first: NONE, error: 0.0, chosen: NONE, stamp: 0 };

/// A tetrahedron in the heap. Those that are gone are known by their stamps.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    key: u64,
    slot: u32,
    stamp: u32,
}

/// A tetrahedron of the new star; a ghost has no sides.
#[derive(Clone, Copy)]
struct Cell {
    /// The new vertex comes last.
    tet: [u32; 4],
    /// Outer normals of its faces at the new vertex, and the cells behind them.
    sides: [([i64; 3], u32); 3],
    first: u32,
    error: f64,
    worst: u32,
}

const NO_CELL: Cell =
    Cell { tet: [NONE; 4], sides: [([0; 3], NONE); 3], first: NONE, error: -1.0, worst: NONE };

impl Cell {
    fn is_ghost(&self) -> bool {
        self.tet[3] == NONE
    }
}

/// The points in every tetrahedron, those on its boundary included, and its errors there: its own error, in whatever
/// mesh it is. Buckets do not do for that: a point on a face is in that of one side.
struct Closed {
    fields: usize,
    /// By slot.
    points: Vec<Vec<u32>>,
    errors: Vec<f64>,
    /// The last insertion that has moved each point.
    seen: Vec<u32>,
    insertions: u32,
    /// The points that have to move.
    taken: Vec<u32>,
    /// Where they go.
    moves: Vec<(u32, u32)>,
}

impl Closed {
    fn new(quantized: &Quantized) -> Self {
        Self {
            fields: quantized.fields.len(),
            points: Vec::new(),
            errors: Vec::new(),
            seen: vec![0; quantized.positions.len()],
            insertions: 0,
            taken: Vec::new(),
            moves: Vec::new(),
        }
    }

    fn add(&mut self, slot: u32, p: u32) {
        if slot as usize >= self.points.len() {
            self.points.resize(slot as usize + 1, Vec::new());
        }
        self.points[slot as usize].push(p);
    }

    fn points(&self, slot: u32) -> &[u32] {
        self.points.get(slot as usize).map_or(&[], Vec::as_slice)
    }

    /// Takes the points of these slots, each once, but for `v`.
    fn take_points(&mut self, slots: impl Iterator<Item = u32>, v: u32) {
        self.insertions += 1;
        self.seen[v as usize] = self.insertions;
        self.taken.clear();
        for slot in slots {
            let Some(points) = self.points.get_mut(slot as usize) else { continue };
            for p in std::mem::take(points) {
                if std::mem::replace(&mut self.seen[p as usize], self.insertions) != self.insertions {
                    self.taken.push(p);
                }
            }
        }
    }

    /// The errors of the tetrahedron in a slot, field by field.
    fn errors(&self, slot: u32) -> impl Iterator<Item = f64> + Clone + '_ {
        let at = slot as usize * self.fields;
        (at..at + self.fields).map(|at| self.errors.get(at).copied().unwrap_or(0.0))
    }

    fn set_errors(&mut self, slot: u32, errors: &[f64]) {
        let at = slot as usize * self.fields;
        if self.errors.len() < at + self.fields {
            self.errors.resize(at + self.fields, 0.0);
        }
        self.errors[at..at + self.fields].copy_from_slice(errors);
    }
}

struct Greedy<'a> {
    mesh: Triangulation,
    quantized: &'a Quantized,
    /// Of each field: the part of its range that a level is.
    weights: Vec<f64>,
    /// Whether `i64` does for tests of sides.
    narrow: bool,
    buckets: Vec<Bucket>,
    /// The largest error of each field at the points of each tetrahedron; without entries where there is one field alone.
    field_errors: Vec<f64>,
    next: Vec<u32>,
    heap: BinaryHeap<Candidate>,
    live: usize,
    /// The star that is planned, in the order of the link's faces.
    cells: Vec<Cell>,
    /// The points of the zone, and the cells they go to.
    moves: Vec<(u32, u32)>,
    /// The fields' slopes, in levels a step: of each cell all fields.
    slopes: Vec<[f64; 3]>,
    /// Data for own errors of tetrahedra, if they are configured.
    closed: Option<Closed>,
    sequence: Sequence,
}

impl<'a> Greedy<'a> {
    fn new(mesh: Triangulation, base: Vec<[u32; 4]>, quantized: &'a Quantized) -> Self {
        let points = quantized.positions.len();
        let largest = (0..points as u32).flat_map(|v| mesh.position(v)).max().unwrap_or(0);
        Self {
            quantized,
            weights: quantized.fields.iter().map(|field| field.step / field.range()).collect(),
            narrow: largest <= 1 << NARROW_BITS,
            buckets: vec![NO_BUCKET; mesh.slots()],
            field_errors: Vec::new(),
            next: vec![NONE; points],
            heap: BinaryHeap::new(),
            live: 0,
            cells: Vec::new(),
            moves: Vec::new(),
            slopes: Vec::new(),
            closed: None,
            sequence: Sequence { base, ..Sequence::default() },
            mesh,
        }
    }

    /// Puts all points but the corners into the buckets of the base mesh.
    fn distribute(&mut self, corners: &[u32]) {
        let Some(mut at) = self.mesh.finite_slots().next() else { return };
        for v in (0..self.next.len() as u32).filter(|v| corners.binary_search(v).is_err()) {
            at = self.mesh.locate(v, at);
            if let Some(closed) = &mut self.closed {
                self.mesh.all_around(v, at).into_iter().for_each(|t| closed.add(t, v));
            }
            self.next[v as usize] = std::mem::replace(&mut self.buckets[at as usize].first, v);
        }
        let slots: Vec<u32> = self.mesh.finite_slots().collect();
        for slot in slots {
            let of_its_own = self.closed.as_ref().is_some_and(|closed| !closed.points(slot).is_empty());
            if self.buckets[slot as usize].first == NONE && !of_its_own {
                continue;
            }
            let tet = self.mesh.tet(slot);
            self.cells.clear();
            self.slopes.clear();
            self.add_cell(tet, [NONE; 3]);
            self.weigh_closed(0, slot, tet[3]);
            let first = self.buckets[slot as usize].first;
            if first == NONE {
                continue;
            }
            self.cells[0].first = first;
            let mut p = first;
            while p != NONE {
                self.weigh(p, 0, tet[3]);
                p = self.next[p as usize];
            }
            self.move_points(0, slot);
        }
    }

    fn insert_all(&mut self, count: usize, progress: OnProgress<'_>) -> Result<(), BuildError> {
        for done in 0..count {
            if done % PROGRESS_STEPS == 0 {
                let (done, total, tetrahedra) = (done as u64, count as u64, Some(self.live as u32));
                BuildProgress { stage: "insert", done, total, tetrahedra }.tell(progress)?;
            }
            let slot = self.pop();
            self.insert_worst(slot)?;
        }
        Ok(())
    }

    /// The slot of the tetrahedron with the largest error.
    fn pop(&mut self) -> u32 {
        loop {
            let top = self.heap.pop();
            assert!(
                top.is_some(),
                "every point that is not a vertex is in a bucket, and its tetrahedron in the heap"
            );
            let Some(Candidate { slot, stamp, .. }) = top else { continue };
            if self.buckets[slot as usize].stamp == stamp {
                return slot;
            }
        }
    }

    fn insert_worst(&mut self, slot: u32) -> Result<(), BuildError> {
        let v = self.buckets[slot as usize].chosen;
        self.prepare(v, slot)?;
        self.mesh.carry_out(v);
        if self.mesh.slots() > self.buckets.len() {
            self.buckets.resize(self.mesh.slots(), NO_BUCKET);
        }
        self.record(v);
        self.move_closed(v);
        for i in 0..self.mesh.removed().len() {
            self.empty(self.mesh.removed()[i].1);
        }
        for i in 0..self.moves.len() {
            let (p, cell) = self.moves[i];
            let first = &mut self.cells[cell as usize].first;
            self.next[p as usize] = std::mem::replace(first, p);
        }
        for i in 0..self.cells.len() {
            if self.cells[i].first != NONE {
                self.move_points(i, self.mesh.star()[i]);
            }
        }
        if self.heap.len() > 4 * self.live + 1024 {
            self.heap.retain(|c| self.buckets[c.slot as usize].stamp == c.stamp);
        }
        Ok(())
    }

    /// Plans the insertion of `v` and finds where the points go, and the errors there. Returns the largest.
    fn prepare(&mut self, v: u32, slot: u32) -> Result<f64, BuildError> {
        self.mesh.collapse(v, slot, &MT_LIMITS)?;
        self.lay_out_star(v);
        self.moves.clear();
        let mut cell = self.cells.iter().position(|cell| !cell.is_ghost()).unwrap_or(0);
        let mut largest = 0.0_f64;
        for i in 0..self.mesh.zone().len() {
            let mut p = self.buckets[self.mesh.zone()[i] as usize].first;
            while p != NONE {
                if p != v {
                    cell = self.find_cell(p, v, cell);
                    self.moves.push((p, cell as u32));
                    largest = largest.max(self.weigh(p, cell, v));
                }
                p = self.next[p as usize];
            }
        }
        Ok(largest)
    }

    fn record(&mut self, v: u32) {
        let start = self.sequence.tets.len();
        let fields = self.weights.len();
        let mut errors = vec![0.0_f64; fields];
        for &(tet, slot) in self.mesh.removed() {
            let own = match fields {
                1 => std::slice::from_ref(&self.buckets[slot as usize].error),
                _ => {
                    self.field_errors.get(slot as usize * fields..(slot as usize + 1) * fields).unwrap_or(&[])
                }
            };
            errors.iter_mut().zip(own).for_each(|(error, own)| *error = error.max(*own));
            self.sequence.tets.push(tet);
            if let Some(closed) = &self.closed {
                let own = closed.errors(slot);
                // Points on its faces may be in the buckets of others.
                errors.iter_mut().zip(own.clone()).for_each(|(error, own)| *error = error.max(own));
                self.sequence.own_errors.extend(own);
            }
        }
        let middle = self.sequence.tets.len();
        let inserted = self.cells.iter().filter(|cell| !cell.is_ghost());
        self.sequence.tets.extend(inserted.map(|cell| cell.tet));
        let end = self.sequence.tets.len();
        let (removed, inserted) = (start..middle, middle..end);
        self.sequence.steps.push(Insertion { vertex: v, removed, inserted, errors, step: 0.0 });
    }

    /// Moves the points in the closures of what was removed to those of the new star, which is carried out.
    fn move_closed(&mut self, v: u32) {
        let Some(mut closed) = self.closed.take() else { return };
        closed.take_points(self.mesh.removed().iter().map(|&(_, slot)| slot), v);
        let mut cell = self.cells.iter().position(|cell| !cell.is_ghost()).unwrap_or(0);
        let mut around = Vec::new();
        for &p in &closed.taken {
            cell = self.find_cell(p, v, cell);
            self.cells_around(p, v, cell, &mut around);
            closed.moves.extend(around.iter().map(|&cell| (p, cell as u32)));
        }
        for (p, cell) in std::mem::take(&mut closed.moves) {
            closed.add(self.mesh.star()[cell as usize], p);
        }
        self.closed = Some(closed);
        for cell in 0..self.cells.len() {
            if !self.cells[cell].is_ghost() {
                self.weigh_closed(cell, self.mesh.star()[cell], v);
            }
        }
    }

    /// The cells of the star of `v` in whose closure point `p` lies, given one of them. All of them hold the line from
    /// `v` to the point, so they are connected through the sides that do.
    fn cells_around(&self, p: u32, v: u32, cell: usize, found: &mut Vec<usize>) {
        let arm = difference(self.mesh.position(p), self.mesh.position(v));
        found.clear();
        found.push(cell);
        let mut next = 0;
        while let Some(&at) = found.get(next) {
            next += 1;
            for (normal, other) in self.cells[at].sides {
                let is_on = (0..3).map(|i| i128::from(normal[i]) * i128::from(arm[i])).sum::<i128>() == 0;
                let other = other as usize;
                let is_cell = self.cells.get(other).is_some_and(|cell| !cell.is_ghost());
                if is_on && is_cell && !found.contains(&other) {
                    found.push(other);
                }
            }
        }
    }

    /// Works out the errors of a cell by itself, whose tetrahedron is in a slot.
    fn weigh_closed(&mut self, cell: usize, slot: u32, apex: u32) {
        let Some(mut closed) = self.closed.take() else { return };
        let fields = self.weights.len();
        let mut errors = vec![0.0_f64; fields];
        for &p in closed.points(slot) {
            for (f, error) in errors.iter_mut().enumerate() {
                *error = error.max(self.field_error_at(p, cell, apex, f));
            }
        }
        closed.set_errors(slot, &errors);
        self.closed = Some(closed);
    }

    fn lay_out_star(&mut self, v: u32) {
        self.cells.clear();
        self.slopes.clear();
        for i in 0..self.mesh.link().len() {
            let face = self.mesh.link()[i];
            if self.mesh.is_beyond(&face) {
                self.cells.push(NO_CELL);
                self.slopes.resize(self.cells.len() * self.weights.len(), [0.0; 3]);
                continue;
            }
            let [x, y, z] = face.triangle;
            let [beyond_x, beyond_y, beyond_z] = face.around;
            self.add_cell([x, z, y, v], [beyond_x, beyond_z, beyond_y]);
        }
    }

    /// Adds a tetrahedron of the star of its last corner, and the cells across its sides.
    fn add_cell(&mut self, tet: [u32; 4], around: [u32; 3]) {
        let apex = tet[3];
        let origin = self.mesh.position(apex);
        let arms = [0, 1, 2].map(|k| difference(self.mesh.position(tet[k]), origin));
        let sides = [[1, 2], [2, 0], [0, 1]].map(|[i, j]| cross(arms[i], arms[j]));
        let fields = self.quantized.fields.len();
        let level = |v: u32, f: usize| f64::from(self.quantized.levels[v as usize * fields + f]);
        let determinant = float_dot(sides[0], arms[0]);
        for f in 0..fields {
            let rise = [0, 1, 2].map(|k| (level(tet[k], f) - level(apex, f)) / determinant);
            self.slopes.push([0, 1, 2].map(|i| (0..3).map(|k| rise[k] * sides[k][i] as f64).sum()));
        }
        let sides = [0, 1, 2].map(|k| (sides[k], around[k]));
        self.cells.push(Cell { tet, sides, ..NO_CELL });
    }

    fn empty(&mut self, slot: u32) {
        let bucket = &mut self.buckets[slot as usize];
        self.live -= usize::from(bucket.first != NONE);
        bucket.stamp = bucket.stamp.wrapping_add(1);
        (bucket.first, bucket.error, bucket.chosen) = (NONE, 0.0, NONE);
        let fields = self.weights.len();
        let errors = self.field_errors.get_mut(slot as usize * fields..(slot as usize + 1) * fields);
        errors.into_iter().flatten().for_each(|error| *error = 0.0);
    }

    /// The cell of the star of `v` that contains point `p`, walking from `from`.
    fn find_cell(&self, p: u32, v: u32, from: usize) -> usize {
        let arm = difference(self.mesh.position(p), self.mesh.position(v));
        let mut at = from;
        // Stars need not be Delaunay; where a walk goes astray, all cells are tried.
        for _ in 0..self.cells.len() {
            let beyond = self.cells[at].sides.iter().find(|(normal, _)| self.is_beyond(*normal, arm));
            match beyond {
                Some(&(_, next)) => at = next as usize,
                None => return at,
            }
        }
        let contains = |cell: &Cell| {
            !cell.is_ghost() && cell.sides.iter().all(|(normal, _)| !self.is_beyond(*normal, arm))
        };
        let found = self.cells.iter().position(contains);
        assert!(found.is_some(), "the star fills all that was removed");
        found.unwrap_or(0)
    }

    #[inline]
    fn is_beyond(&self, normal: [i64; 3], arm: [i64; 3]) -> bool {
        if self.narrow {
            normal[0] * arm[0] + normal[1] * arm[1] + normal[2] * arm[2] > 0
        } else {
            (0..3).map(|i| i128::from(normal[i]) * i128::from(arm[i])).sum::<i128>() > 0
        }
    }

    /// The error at point `p` of a cell with apex `v`, counted into the cell's.
    fn weigh(&mut self, p: u32, cell: usize, v: u32) -> f64 {
        let error = self.error_at(p, cell, v);
        let cell = &mut self.cells[cell];
        if error > cell.error {
            (cell.error, cell.worst) = (error, p);
        }
        error
    }

    /// How far the cell's fields are from those of the reference at `p`, as a fraction of their ranges.
    #[inline]
    fn error_at(&self, p: u32, cell: usize, v: u32) -> f64 {
        (0..self.weights.len()).fold(0.0, |largest, f| largest.max(self.field_error_at(p, cell, v, f)))
    }

    #[inline]
    fn field_error_at(&self, p: u32, cell: usize, v: u32, f: usize) -> f64 {
        let arm = difference(self.mesh.position(p), self.mesh.position(v)).map(|x| x as f64);
        let fields = self.weights.len();
        let slope = self.slopes[cell * fields + f];
        let value = f64::from(self.quantized.levels[v as usize * fields + f])
            + (slope[0] * arm[0] + slope[1] * arm[1] + slope[2] * arm[2]);
        let exact = self.quantized.exact[p as usize * fields + f];
        (value - exact).abs() * self.weights[f]
    }

    /// Hands a cell's points over to a slot, and the slot to the heap.
    fn move_points(&mut self, cell: usize, slot: u32) {
        let Cell { tet, first, error, worst, sides } = self.cells[cell];
        self.settle_fields(cell, slot);
        let bucket = &mut self.buckets[slot as usize];
        bucket.stamp = bucket.stamp.wrapping_add(1);
        bucket.first = first;
        self.live += 1;
        bucket.error = error;
        bucket.chosen = worst;
        let stamp = bucket.stamp;
        let mut key = 1 << 63 | error.to_bits();
        if error < FINEST {
            let arm = difference(self.mesh.position(tet[0]), self.mesh.position(tet[3]));
            key = float_dot(sides[0].0, arm).abs().to_bits();
            self.buckets[slot as usize].chosen = self.middle_point(slot);
        }
        self.heap.push(Candidate { key, slot, stamp });
    }

    /// Hands the errors of the fields at a cell over to a slot, where there are several fields.
    fn settle_fields(&mut self, cell: usize, slot: u32) {
        let (fields, at) = (self.weights.len(), slot as usize * self.weights.len());
        if fields == 1 {
            return;
        }
        if self.field_errors.len() < at + fields {
            self.field_errors.resize(at + fields, 0.0);
        }
        let v = self.cells[cell].tet[3];
        let mut p = self.cells[cell].first;
        let mut errors = vec![0.0_f64; fields];
        while p != NONE {
            for (f, error) in errors.iter_mut().enumerate() {
                *error = error.max(self.field_error_at(p, cell, v, f));
            }
            p = self.next[p as usize];
        }
        self.field_errors[at..at + fields].copy_from_slice(&errors);
    }

    /// The point of a bucket that is next to the tetrahedron's middle.
    fn middle_point(&self, slot: u32) -> u32 {
        let corners = self.mesh.tet(slot).map(|v| self.mesh.position(v));
        let sum = [0, 1, 2].map(|i| corners.iter().map(|p| i64::from(p[i])).sum::<i64>());
        let distance = |p: u32| {
            let q = self.mesh.position(p);
            (0..3).map(|i| i128::from(4 * i64::from(q[i]) - sum[i]).pow(2)).sum::<i128>()
        };
        let start = self.buckets[slot as usize].first;
        let points =
            std::iter::successors(Some(start), |&p| Some(self.next[p as usize]).filter(|&p| p != NONE));
        points.min_by_key(|&p| (distance(p), p)).unwrap_or(start)
    }
}

fn difference(p: [i32; 3], q: [i32; 3]) -> [i64; 3] {
    [0, 1, 2].map(|i| i64::from(p[i]) - i64::from(q[i]))
}

fn cross(u: [i64; 3], v: [i64; 3]) -> [i64; 3] {
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

fn float_dot(u: [i64; 3], v: [i64; 3]) -> f64 {
    (0..3).map(|i| u[i] as f64 * v[i] as f64).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BuildConfig;
    use crate::geometry::delaunay::{Limits, delaunay};
    use crate::lattice::quantize::quantize;
    use std::collections::BTreeSet;
    use std::ops::ControlFlow;
    use tetralod::geom::{WIDE_BITS, in_conflict};
    use tetralod::mesh::{Field, Grid, TetMesh, kuhn_tets, neighbors};
    use tetralod::mt::MtKind;

    fn inserted(mesh: &TetMesh) -> Result<(Quantized, Sequence), BuildError> {
        inserted_on(mesh, None)
    }

    fn inserted_on(mesh: &TetMesh, bits: Option<u32>) -> Result<(Quantized, Sequence), BuildError> {
        let config =
            BuildConfig { fields: names(mesh), position_bits: bits, ..BuildConfig::of(MtKind::Edge) };
        let quantized = quantize(mesh, &config)?;
        let sequence = insert(&quantized, &mesh.tets, true, &mut |_| ControlFlow::Continue(()))?;
        Ok((quantized, sequence))
    }

    fn names(mesh: &TetMesh) -> Vec<String> {
        mesh.fields.iter().map(|field| field.name.clone()).collect()
    }

    /// A grid with a field that has a few narrow bumps.
    fn bumps(size: u32) -> TetMesh {
        let grid = Grid { dims: [size; 3], origin: [0.0; 3], spacing: [1.0; 3] };
        let mut mesh = TetMesh::from_grid(grid, Vec::new());
        let place = |p: &[f64; 3]| p.map(|x| x / f64::from(size - 1));
        let bump = |p: [f64; 3], c: [f64; 3]| {
            1.0 / (1.0 + 100.0 * (0..3).map(|i| (p[i] - c[i]).powi(2)).sum::<f64>())
        };
        let at = [[0.2, 0.3, 0.4], [0.7, 0.6, 0.1], [0.5, 0.9, 0.8]];
        let values = mesh.positions.iter().map(|p| at.iter().map(|&c| bump(place(p), c)).sum()).collect();
        mesh.fields.push(Field::new("bumps", values));
        mesh
    }

    /// Points that look random, some in one plane, with two fields.
    fn scattered(count: u32, size: u32) -> TetMesh {
        let mut state = 7_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % size
        };
        let mut places: BTreeSet<[u32; 3]> = (0..count).map(|_| [next(), next(), next()]).collect();
        places.extend((0..count / 4).map(|_| [next(), next(), size / 2]));
        let positions: Vec<[f64; 3]> = places.iter().map(|p| p.map(f64::from)).collect();
        let bumps = positions.iter().map(|p| p.iter().map(|x| (x * 0.2).sin()).sum()).collect();
        let slope = positions.iter().map(|p| p[0] - 0.5 * p[1]).collect();
        let fields = [("bumps", bumps), ("slope", slope)];
        let fields = fields.map(|(name, values)| Field::new(name, values)).to_vec();
        TetMesh { positions, fields, tets: Vec::new(), ..TetMesh::default() }
    }

    fn sorted(mut tet: [u32; 4]) -> [u32; 4] {
        tet.sort_unstable();
        tet
    }

    /// The largest error in a tetrahedron at the points that it contains, and that at its `inner` points alone.
    fn plain_errors(tet: [u32; 4], quantized: &Quantized) -> [f64; 2] {
        let at = |v: u32| quantized.positions[v as usize];
        let fields = quantized.fields.len();
        let [mut all, mut inner] = [0.0_f64; 2];
        for p in (0..quantized.positions.len() as u32).filter(|p| !tet.contains(p)) {
            let parts = [0, 1, 2, 3].map(|k| {
                let mut corners = tet;
                corners[k] = p;
                let [a, b, c, d] = corners.map(at);
                orient3d(a, b, c, d)
            });
            if parts.iter().any(|&part| part < 0) {
                continue;
            }
            let total = parts.iter().sum::<i128>() as f64;
            for (f, field) in quantized.fields.iter().enumerate() {
                let level = |v: u32| f64::from(quantized.levels[v as usize * fields + f]);
                let value: f64 = (0..4).map(|k| parts[k] as f64 / total * level(tet[k])).sum();
                let error =
                    (value - quantized.exact[p as usize * fields + f]).abs() * field.step / field.range();
                all = all.max(error);
                if parts.iter().all(|&part| part > 0) {
                    inner = inner.max(error);
                }
            }
        }
        [all, inner]
    }

    /// Carries out all insertions and checks the errors of each. Returns the final mesh.
    fn replayed(quantized: &Quantized, sequence: &Sequence) -> BTreeSet<[u32; 4]> {
        let mut mesh: BTreeSet<[u32; 4]> = sequence.base.iter().map(|&tet| sorted(tet)).collect();
        let mut vertices: BTreeSet<u32> = sequence.base.iter().flatten().copied().collect();
        for step in &sequence.steps {
            let removed = &sequence.tets[step.removed.clone()];
            let inserted = &sequence.tets[step.inserted.clone()];
            assert!(removed.len() <= MT_LIMITS.removed && inserted.len() <= MT_LIMITS.inserted);
            assert!(removed.iter().all(|&tet| mesh.remove(&sorted(tet))), "it removes what is there");
            assert!(vertices.insert(step.vertex), "it inserts a new vertex");
            for &tet in inserted {
                let [a, b, c, d] = tet.map(|v| quantized.positions[v as usize]);
                assert!(orient3d(a, b, c, d) > 0 && tet.contains(&step.vertex));
                assert!(mesh.insert(sorted(tet)));
            }
            assert_eq!(volume(removed, quantized), volume(inserted, quantized));
        }
        assert_eq!(vertices.len(), quantized.positions.len());
        mesh
    }

    #[test]
    fn a_grid_is_inserted_into_its_box_until_every_cell_is_there() {
        let mesh = bumps(9);
        let (quantized, sequence) = inserted(&mesh).unwrap();
        assert_eq!(sequence.base.len(), 6);
        let wanted: BTreeSet<[u32; 4]> = kuhn_tets([9; 3]).into_iter().map(sorted).collect();
        assert_eq!(replayed(&quantized, &sequence), wanted);
    }

    #[test]
    fn points_without_a_mesh_are_inserted_into_their_hull() {
        for bits in [None, Some(7), Some(WIDE_BITS)] {
            let (quantized, sequence) = inserted_on(&scattered(400, 40), bits).unwrap();
            let last = replayed(&quantized, &sequence);
            let wanted = delaunay(&quantized.positions).unwrap();
            assert_eq!(last, wanted.into_iter().map(sorted).collect());
            let all: Vec<[u32; 4]> = last.into_iter().collect();
            neighbors(&all).unwrap();
        }
    }

    #[test]
    fn a_mesh_that_is_convex_but_for_rounding_is_accepted() {
        let mut mesh = scattered(400, 40);
        let places: Vec<[i32; 3]> = mesh.positions.iter().map(|p| p.map(|x| x as i32)).collect();
        mesh.tets = delaunay(&places).unwrap();
        assert!(inserted_on(&mesh, Some(12)).is_ok());
        // Without the tetrahedra around a point it is not convex.
        mesh.tets.retain(|tet| !tet.contains(&200));
        assert_eq!(inserted_on(&mesh, Some(12)).err(), Some(BuildError::NotConvex));
    }

    #[test]
    fn errors_are_those_of_the_points_in_what_is_removed() {
        for mesh in [bumps(7), scattered(150, 20)] {
            let (quantized, sequence) = inserted(&mesh).unwrap();
            for step in &sequence.steps {
                let removed = &sequence.tets[step.removed.clone()];
                let errors = removed.iter().map(|&tet| plain_errors(tet, &quantized));
                let [all, inner] = errors.fold([0.0_f64; 2], |m, e| [m[0].max(e[0]), m[1].max(e[1])]);
                // A point on a face is in the bucket of one side; with exact fields both give the same error but for
                // rounding, as they agree on the face.
                assert!(
                    crate::error::cost::largest(&step.errors) <= all * (1.0 + 1e-9) + 1e-12
                        && crate::error::cost::largest(&step.errors) >= inner * (1.0 - 1e-9) - 1e-12
                );
            }
        }
    }

    #[test]
    fn narrow_limits_are_kept_by_leaving_delaunay() {
        let limits = Limits { removed: 24, inserted: 30, link: 17 };
        for mesh in [bumps(9), scattered(500, 30)] {
            let positions = quantize_points(&mesh);
            let corners = extreme_points(&positions).unwrap();
            let mut triangulation = Triangulation::of(&positions, &corners).unwrap();
            let wanted = six_volume(&triangulation, &positions);
            for v in (0..positions.len() as u32).filter(|v| corners.binary_search(v).is_err()) {
                let at = triangulation
                    .finite_slots()
                    .find(|&t| contains(&triangulation, t, v, &positions))
                    .unwrap();
                // Points at an edge with too many tetrahedra around it cannot be inserted; they are left out.
                if triangulation.collapse(v, at, &limits).is_ok() {
                    triangulation.carry_out(v);
                    assert!(triangulation.removed().len() <= limits.removed);
                }
            }
            assert_eq!(six_volume(&triangulation, &positions), wanted);
            let tets = triangulation.finite_tets();
            neighbors(&tets).unwrap();
            let mut conflicts = 0;
            for tet in &tets {
                let [a, b, c, d] = tet.map(|v| positions[v as usize]);
                assert!(orient3d(a, b, c, d) > 0);
                conflicts += positions
                    .iter()
                    .filter(|p| ![a, b, c, d].contains(p) && in_conflict(a, b, c, d, **p))
                    .count();
            }
            assert!(conflicts > 0, "the limits were too wide to test anything");
        }
    }

    fn quantize_points(mesh: &TetMesh) -> Vec<[i32; 3]> {
        mesh.positions.iter().map(|p| p.map(|x| (x * 8.0).round() as i32)).collect()
    }

    fn contains(mesh: &Triangulation, t: u32, v: u32, positions: &[[i32; 3]]) -> bool {
        (0..4).all(|k| {
            let mut corners = mesh.tet(t);
            corners[k] = v;
            let [a, b, c, d] = corners.map(|v| positions[v as usize]);
            orient3d(a, b, c, d) >= 0
        })
    }

    fn six_volume(mesh: &Triangulation, positions: &[[i32; 3]]) -> i128 {
        let volume = |tet: [u32; 4]| {
            let [a, b, c, d] = tet.map(|v| positions[v as usize]);
            orient3d(a, b, c, d)
        };
        mesh.finite_tets().into_iter().map(volume).sum()
    }

    #[test]
    fn what_cannot_be_inserted_is_refused() {
        let error = |mesh: &TetMesh| inserted(mesh).err();
        let mut hollow = bumps(5);
        hollow.tets.retain(|tet| !tet.contains(&62));
        assert_eq!(error(&hollow), Some(BuildError::NotConvex));
        let mut twice = bumps(4);
        twice.grid = None;
        twice.positions.push(twice.positions[21]);
        twice.fields[0].values.push(0.0);
        assert_eq!(error(&twice), Some(BuildError::SamePlace { points: [21, 64] }));
        let stopped = {
            let mesh = bumps(4);
            let quantized = quantize(&mesh, &BuildConfig::of(MtKind::Edge)).unwrap();
            insert(&quantized, &mesh.tets, false, &mut |_| ControlFlow::Break(()))
        };
        assert_eq!(stopped, Err(BuildError::Stopped));
    }
}
