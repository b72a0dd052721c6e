//! What a surface keeps of the mesh that it was cut out of, so that it can follow the changes.
//!
//! A mesh reports its changes by blocks. Comparing with a copy of points and tetrahedra finds the entries that really
//! changed. Stars are walked through faces; the number of tetrahedra at each point tells when the domain is pinched
//! there, so that a walk does not reach them all.

use super::MeshView;
use crate::mesh::{BitSet, NONE};
use std::ops::Range;

/// A copy of every tetrahedron and every point; per point a tetrahedron and how many there are. 16.3 bytes a tetrahedron and 40
/// bytes a point.
#[derive(Clone, Debug, Default)]
pub(super) struct MeshSnapshot {
    tets: Vec<[u32; 4]>,
    /// Position and value, as bits.
    points: Vec<[u64; 4]>,
    stars: Vec<Star>,
    /// Scratch: tetrahedra of a star, and dirty ones; empty between two calls.
    seen: BitSet,
    in_dirty: BitSet,
}

#[derive(Clone, Copy, Debug)]
struct Star {
    /// One of the tetrahedra, unless the point has lost it and got no other.
    tet: u32,
    count: u32,
}

/// More than one in so many points are many.
const MANY: usize = 32;

/// What has really changed.
#[derive(Debug, Default)]
pub(super) struct Dirty {
    /// Tetrahedra that have other points, or a point with another position or value; each once.
    pub tets: Vec<u32>,
    /// Points that have changed or lost a tetrahedron; some may be gone, and some are listed several times.
    points: Vec<u32>,
}

impl Dirty {
    /// Points of the tetrahedra, and of those that were there before, each once; some may be gone.
    pub fn points(&self, mesh: &MeshView<'_>) -> Vec<u32> {
        let mut seen = BitSet::default();
        let now = self.tets.iter().flat_map(|t| mesh.tets[*t as usize]);
        self.points.iter().copied().chain(now).filter(|point| *point != NONE && seen.insert(*point)).collect()
    }
}

impl MeshSnapshot {
    pub fn new(mesh: &MeshView<'_>) -> Self {
        let mut snapshot = Self {
            tets: mesh.tets.to_vec(),
            points: (0..mesh.positions.len()).map(|p| bits(mesh, p)).collect(),
            stars: vec![Star { tet: NONE, count: 0 }; mesh.positions.len()],
            seen: BitSet::default(),
            in_dirty: BitSet::default(),
        };
        for (t, tet) in (0..).zip(mesh.tets) {
            snapshot.add(t, *tet);
        }
        snapshot
    }

    fn add(&mut self, t: u32, tet: [u32; 4]) {
        // A free slot has no points.
        for point in tet.into_iter().filter(|point| *point != NONE) {
            let star = &mut self.stars[point as usize];
            star.tet = t;
            star.count += 1;
        }
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
        for t in &dirty.tets {
            self.in_dirty.insert(*t);
        }
        let mut star = Vec::new();
        let mut lost = BitSet::default();
        let mut any_lost = false;
        for p in &moved {
            if !many && self.star(mesh, *p, &mut star) {
                dirty.tets.extend(star.iter().filter(|t| self.in_dirty.insert(**t)));
            } else {
                any_lost = true;
                lost.insert(*p);
            }
        }
        if any_lost {
            for (t, tet) in (0..).zip(mesh.tets) {
                if tet.iter().any(|p| lost.has(*p)) && self.in_dirty.insert(t) {
                    dirty.tets.push(t);
                }
            }
        }
        self.in_dirty.clear_listed(&dirty.tets);
        dirty.points.extend(moved);
    }

    /// Finds the tetrahedra around a point; false if they are not connected through faces, so that some are missing, or there is another point of
    /// the same value at its place, behind such a face.
    pub fn star(&mut self, mesh: &MeshView<'_>, point: u32, found: &mut Vec<u32>) -> bool {
        found.clear();
        let Star { tet, count } = self.stars[point as usize];
        let has = |t: u32| mesh.tets.get(t as usize).is_some_and(|tet| tet.contains(&point));
        if has(tet) {
            found.push(tet);
            self.seen.insert(tet);
        }
        let (mut next, mut is_alone) = (0, true);
        while let Some(t) = found.get(next).map(|t| *t as usize) {
            next += 1;
            for (corner, n) in mesh.tets[t].into_iter().zip(mesh.neighbors[t]) {
                // Most have been visited; only the others are examined.
                if corner == point || n == NONE || self.seen.has(n) {
                    continue;
                }
                if has(n) {
                    self.seen.insert(n);
                    found.push(n);
                } else {
                    is_alone &= twin(mesh, point, mesh.tets[n as usize]).is_none();
                }
            }
        }
        self.seen.clear_listed(found);
        is_alone && found.len() == count as usize
    }
}

/// The entries in ranges, and those that are new at the end.
pub(super) fn entries(ranges: &[Range<u32>], old: usize, new: usize) -> impl Iterator<Item = u32> {
    let common = old.min(new) as u32;
    let ranges = ranges.iter().flat_map(move |range| range.start.min(common)..range.end.min(common));
    ranges.chain(common..new as u32)
}

/// The corner of a tetrahedron behind a face with a point that is at its place and has its value, if that is another point.
pub(super) fn twin(mesh: &MeshView<'_>, point: u32, other: [u32; 4]) -> Option<u32> {
    let own = || bits(mesh, point as usize);
    if other.contains(&point) { None } else { other.into_iter().find(|&q| bits(mesh, q as usize) == own()) }
}

fn bits(mesh: &MeshView<'_>, point: usize) -> [u64; 4] {
    let [x, y, z] = mesh.positions[point].map(f64::to_bits);
    [x, y, z, mesh.field[point].to_bits()]
}
