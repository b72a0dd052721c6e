//! What a surface knows of the mesh it was extracted from, so that it can follow the changes.
//!
//! A mesh tells its changes by blocks. A copy of points and tetrahedra tells which entries of these blocks really
//! changed. Stars are walked through faces; the number of tetrahedra at each point tells when the domain is
//! pinched there, so that a walk does not reach them all.

use super::cut::BLOCK;
use crate::mesh::NONE;
use crate::view::MeshView;
use std::ops::Range;

/// Per 64 tetrahedra the smallest and the largest value; per tetrahedron and per point a copy; per point a
/// tetrahedron and how many there are. 16.3 bytes a tetrahedron and 24 bytes a point.
#[derive(Clone, Debug, Default)]
pub(super) struct MeshSnapshot {
    tets: Vec<[u32; 4]>,
    /// Position and value, as bits.
    points: Vec<[u32; 4]>,
    stars: Vec<Star>,
    ranges: Vec<[f32; 2]>,
    /// Of tetrahedra; empty between two calls.
    seen: Bits,
}

#[derive(Clone, Copy, Debug)]
struct Star {
    /// One of the tetrahedra, unless the point has lost it and got no other.
    tet: u32,
    count: u32,
}

/// Of so many points one is many.
const MANY: usize = 32;

/// What has really changed.
#[derive(Clone, Debug, Default)]
pub(super) struct Dirty {
    /// Tetrahedra that have other points, or a point with another position or value, ascending.
    pub tets: Vec<u32>,
    /// Points of these tetrahedra, and of those that were there before; some may be gone.
    pub points: Vec<u32>,
}

/// A set of small numbers.
#[derive(Clone, Debug, Default)]
pub(super) struct Bits(Vec<u64>);

impl Bits {
    /// Puts `i` in; false if it was there.
    #[inline]
    pub fn insert(&mut self, i: u32) -> bool {
        let word = i as usize / 64;
        if word >= self.0.len() {
            self.0.resize(word + 1, 0);
        }
        let (word, bit) = (&mut self.0[word], 1 << (i % 64));
        let new = *word & bit == 0;
        *word |= bit;
        new
    }

    #[inline]
    pub fn has(&self, i: u32) -> bool {
        self.0.get(i as usize / 64).is_some_and(|word| word >> (i % 64) & 1 == 1)
    }

    /// Takes out all of `list`, which must hold at least what is in.
    pub fn clear(&mut self, list: &[u32]) {
        list.iter().for_each(|i| self.0[*i as usize / 64] = 0);
    }
}

impl MeshSnapshot {
    pub fn new(mesh: &MeshView<'_>) -> Self {
        let mut snapshot = Self {
            tets: mesh.tets.to_vec(),
            points: (0..mesh.positions.len()).map(|p| bits(mesh, p)).collect(),
            stars: vec![Star { tet: NONE, count: 0 }; mesh.positions.len()],
            ranges: mesh.tets.chunks(BLOCK).map(|block| range(block, mesh.field)).collect(),
            seen: Bits::default(),
        };
        for (t, tet) in (0..).zip(mesh.tets) {
            snapshot.add(t, *tet);
        }
        snapshot
    }

    fn add(&mut self, t: u32, tet: [u32; 4]) {
        for point in tet {
            let star = &mut self.stars[point as usize];
            star.tet = t;
            star.count += 1;
        }
    }

    /// The blocks in which a tetrahedron can have points on both sides of `value`.
    pub fn blocks_at(&self, value: f32) -> impl Iterator<Item = usize> {
        let spans = move |range: &[f32; 2]| range[0] < value && range[1] >= value;
        self.ranges.iter().enumerate().filter(move |(_, range)| spans(range)).map(|(block, _)| block)
    }

    /// Whether so many blocks are passed by `value` that looking for them is not worth while.
    pub fn is_passed_widely(&self, value: f32) -> bool {
        2 * self.blocks_at(value).count() > self.ranges.len()
    }

    /// Follows the mesh, of which only entries in these ranges and at the ends of the arrays may have changed.
    pub fn catch_up(
        &mut self,
        mesh: &MeshView<'_>,
        changed_vertices: &[Range<u32>],
        changed_tets: &[Range<u32>],
    ) -> Dirty {
        let mut dirty = Dirty::default();
        let points = mesh.positions.len();
        self.stars.resize(points.max(self.points.len()), Star { tet: NONE, count: 0 });
        self.compare_tets(mesh, changed_tets, &mut dirty);
        self.compare_points(mesh, changed_vertices, &mut dirty);
        self.stars.truncate(points);
        dirty.tets.sort_unstable();
        for t in &dirty.tets {
            dirty.points.extend(mesh.tets[*t as usize]);
        }
        let mut seen = Bits::default();
        dirty.points.retain(|point| seen.insert(*point));
        self.find_ranges(mesh, &dirty.tets);
        dirty
    }

    /// Finds the tetrahedra that have other points than before.
    fn compare_tets(&mut self, mesh: &MeshView<'_>, changed: &[Range<u32>], dirty: &mut Dirty) {
        let (old, new) = (self.tets.len(), mesh.tets.len());
        for t in new..old {
            self.lose(self.tets[t], dirty);
        }
        self.tets.resize(new, [NONE; 4]);
        for t in entries(changed, old, new) {
            let (before, now) = (self.tets[t as usize], mesh.tets[t as usize]);
            if before != now {
                self.lose(before, dirty);
                self.tets[t as usize] = now;
                dirty.tets.push(t);
            }
        }
        // After all losses, so that what a point has left is what it got.
        for i in 0..dirty.tets.len() {
            let t = dirty.tets[i];
            self.add(t, self.tets[t as usize]);
        }
    }

    fn lose(&mut self, tet: [u32; 4], dirty: &mut Dirty) {
        if tet[0] != NONE {
            tet.iter().for_each(|point| self.stars[*point as usize].count -= 1);
            dirty.points.extend(tet);
        }
    }

    /// Finds the points that have another position or value, and adds the tetrahedra around them.
    fn compare_points(&mut self, mesh: &MeshView<'_>, changed: &[Range<u32>], dirty: &mut Dirty) {
        let (old, new) = (self.points.len(), mesh.positions.len());
        self.points.resize(new, [0; 4]);
        let mut moved = Vec::new();
        for p in entries(changed, old, new) {
            let now = bits(mesh, p as usize);
            if p as usize >= old || self.points[p as usize] != now {
                self.points[p as usize] = now;
                moved.push(p);
            }
        }
        // Then one pass costs less than all the walks.
        let many = moved.len() > new / MANY;
        let mut in_dirty = Bits::default();
        for t in &dirty.tets {
            in_dirty.insert(*t);
        }
        let mut star = Vec::new();
        let mut lost = Bits::default();
        let mut any_lost = false;
        for p in &moved {
            if !many && self.star(mesh, *p, &mut star) {
                dirty.tets.extend(star.iter().filter(|t| in_dirty.insert(**t)));
            } else {
                any_lost = true;
                lost.insert(*p);
            }
        }
        if any_lost {
            for (t, tet) in (0..).zip(mesh.tets) {
                if tet.iter().any(|p| lost.has(*p)) && in_dirty.insert(t) {
                    dirty.tets.push(t);
                }
            }
        }
        dirty.points.extend(moved);
    }

    /// Finds the values of the blocks of these tetrahedra, which are in ascending order.
    fn find_ranges(&mut self, mesh: &MeshView<'_>, tets: &[u32]) {
        self.ranges.resize(mesh.tets.len().div_ceil(BLOCK), [0.0; 2]);
        let mut last = usize::MAX;
        let short = mesh.tets.len() / BLOCK;
        for block in
            tets.iter().map(|t| *t as usize / BLOCK).chain((short < self.ranges.len()).then_some(short))
        {
            if block != last {
                last = block;
                let end = mesh.tets.len().min((block + 1) * BLOCK);
                self.ranges[block] = range(&mesh.tets[block * BLOCK..end], mesh.field);
            }
        }
    }

    /// Finds the tetrahedra around a point; false if they do not hang together through faces, so that some are
    /// missing.
    pub fn star(&mut self, mesh: &MeshView<'_>, point: u32, found: &mut Vec<u32>) -> bool {
        found.clear();
        let Star { tet, count } = self.stars[point as usize];
        let has = |t: u32| mesh.tets.get(t as usize).is_some_and(|tet| tet.contains(&point));
        if has(tet) {
            found.push(tet);
            self.seen.insert(tet);
        }
        let mut next = 0;
        while let Some(t) = found.get(next).map(|t| *t as usize) {
            next += 1;
            for (corner, n) in mesh.tets[t].into_iter().zip(mesh.neighbors[t]) {
                // Most have been seen; only the others are looked at.
                if corner != point && !self.seen.has(n) && has(n) {
                    self.seen.insert(n);
                    found.push(n);
                }
            }
        }
        self.seen.clear(found);
        found.len() == count as usize
    }
}

/// The entries in ranges, and those that are new at the end.
fn entries(ranges: &[Range<u32>], old: usize, new: usize) -> impl Iterator<Item = u32> {
    let common = old.min(new) as u32;
    let ranges = ranges.iter().flat_map(move |range| range.start.min(common)..range.end.min(common));
    ranges.chain(common..new as u32)
}

fn bits(mesh: &MeshView<'_>, point: usize) -> [u32; 4] {
    let [x, y, z] = mesh.positions[point].map(f32::to_bits);
    [x, y, z, mesh.field[point].to_bits()]
}

/// The smallest and the largest value at the points of some tetrahedra. What is not a number is not smaller than
/// any isovalue, as if it were large.
fn range(tets: &[[u32; 4]], field: &[f32]) -> [f32; 2] {
    let mut range = [f32::INFINITY, f32::NEG_INFINITY];
    for point in tets.iter().flatten() {
        let value = field[*point as usize];
        let [low, high] = &mut range;
        *low = if value < *low { value } else { *low };
        let value = if value.is_nan() { f32::INFINITY } else { value };
        *high = if value > *high { value } else { *high };
    }
    range
}
