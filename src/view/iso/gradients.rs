//! Gradients of the field at points: the mean over the tetrahedra around a point, each with its volume as weight.
//!
//! The terms are always added in the order of the tetrahedra, whichever way they are found, so that a gradient
//! depends on the mesh alone to the last bit.
//!
//! Where other fields jump between regions, a mesh has a point for each region at one place. Where this field does not jump there, its surface
//! passes, and these points have one gradient: that of the tetrahedra around all of them.

use crate::mesh::{FACES, NONE};
use crate::view::MeshView;
use crate::view::marching::{Crossing, select};
use crate::view::mesh_snapshot::{MeshSnapshot, twin};
use glam::DVec3;
use std::collections::BTreeMap;

/// In place of an undefined normal.
pub(super) const NO_NORMAL: [f32; 3] = [0.0; 3];

/// Gradients of some of the points.
#[derive(Clone, Debug, Default)]
pub(super) struct Gradients {
    /// Per point its place in the other two, or `NONE`.
    slots: Vec<u32>,
    points: Vec<u32>,
    /// The gradient; while it is summed, six times volume · gradient and six times the volume.
    means: Vec<[f64; 4]>,
    /// Whether regions may have points of their own at one place.
    pub has_regions: bool,
    /// Points that have one gradient with others at the same place.
    shared: Vec<u32>,
}

/// With fewer points than tetrahedra / this, their stars are looked up one by one.
const FEW: usize = 300;

impl Gradients {
    /// Forgets everything; there are `points` points from now on.
    pub fn clear(&mut self, points: usize) {
        self.means.clear();
        self.shared.clear();
        for point in self.points.drain(..) {
            self.slots[point as usize] = NONE;
        }
        self.slots.resize(points, NONE);
    }

    /// Forgets the gradients that several points have: whatever has changed around one has changed around all of them. Gives these points.
    pub fn forget_shared(&mut self) -> Vec<u32> {
        let shared = std::mem::take(&mut self.shared);
        shared.iter().for_each(|point| self.forget(*point));
        shared
    }

    /// Forgets the points that go.
    pub fn resize(&mut self, points: usize) {
        for point in points..self.slots.len() {
            self.forget(point as u32);
        }
        self.slots.resize(points, NONE);
    }

    /// Whether the gradient at a point is known.
    pub fn has(&self, point: u32) -> bool {
        self.slots.get(point as usize).is_some_and(|slot| *slot != NONE)
    }

    /// Forgets the gradient at a point.
    pub fn forget(&mut self, point: u32) {
        let Some(slot) = self.slots.get_mut(point as usize).filter(|slot| **slot != NONE) else { return };
        let hole = std::mem::replace(slot, NONE) as usize;
        self.points.swap_remove(hole);
        self.means.swap_remove(hole);
        if let Some(moved) = self.points.get(hole) {
            self.slots[*moved as usize] = hole as u32;
        }
    }

    /// The normal at a crossing, the fraction `t` along its edge: the gradients at its ends, which must have been
    /// [summed](Self::sum), interpolated; [`NO_NORMAL`] if they cancel.
    #[inline]
    pub fn normal(&self, crossing: &Crossing, t: f64) -> [f32; 3] {
        let [g, h] = crossing.ends.map(|end| self.means[self.slots[end as usize] as usize]);
        unit(DVec3::from([0, 1, 2].map(|i| -(g[i] + t * (h[i] - g[i]))))).unwrap_or(NO_NORMAL)
    }

    /// Makes the gradients at `points` known, as far as they are not. With a `snapshot` of the mesh, few points
    /// cost no pass over it. `wanted` is scratch space.
    pub fn sum(
        &mut self,
        mesh: &MeshView<'_>,
        points: impl Iterator<Item = u32>,
        snapshot: Option<&mut MeshSnapshot>,
        wanted: &mut Vec<u8>,
    ) {
        let start = self.points.len();
        points.for_each(|point| self.add(point));
        let new = self.points.len() - start;
        if new == 0 {
            return;
        }
        let mut found = Vec::new();
        match snapshot {
            Some(snapshot) if new < mesh.tets.len() / FEW => {
                let mut lost = Vec::new();
                for slot in start..self.points.len() {
                    let point = self.points[slot];
                    if snapshot.star(mesh, point, &mut found) {
                        self.means[slot] = sum_of(mesh, &mut found);
                    } else {
                        lost.push(point);
                    }
                }
                if !lost.is_empty() {
                    self.pass(mesh, &lost, wanted, &mut found);
                }
            }
            _ => {
                let points = self.points[start..].to_vec();
                self.pass(mesh, &points, wanted, &mut found);
            }
        }
        self.means[start..].iter_mut().for_each(divide);
    }

    /// Makes room for the gradient at a point.
    fn add(&mut self, point: u32) {
        let slot = &mut self.slots[point as usize];
        if *slot == NONE {
            *slot = self.points.len() as u32;
            self.points.push(point);
            self.means.push([0.0; 4]);
        }
    }

    /// Recomputes the known gradient of a point from the tetrahedra around it.
    pub fn set(&mut self, mesh: &MeshView<'_>, point: u32, star: &mut [u32]) {
        let mean = &mut self.means[self.slots[point as usize] as usize];
        *mean = sum_of(mesh, star);
        divide(mean);
    }

    /// Sums the gradients at `points` in one pass over the mesh.
    fn pass(&mut self, mesh: &MeshView<'_>, points: &[u32], wanted: &mut Vec<u8>, found: &mut Vec<u32>) {
        wanted.clear();
        wanted.resize(mesh.positions.len(), 0);
        points.iter().for_each(|point| wanted[*point as usize] = 1);
        let mut one_of = BTreeMap::new();
        loop {
            found.clear();
            select(mesh.tets, 0, found, |tet| tet.iter().fold(0, |all, p| all | wanted[*p as usize]) != 0);
            let pairs = if self.has_regions { twins(mesh, found, wanted) } else { Vec::new() };
            let mut is_complete = true;
            for [p, q] in pairs {
                let (a, b) = (first_of(&one_of, p), first_of(&one_of, q));
                if a != b {
                    one_of.insert(a.max(b), a.min(b));
                }
                is_complete &= std::mem::replace(&mut wanted[q as usize], 1) != 0;
                self.add(q);
            }
            if is_complete {
                break;
            }
        }
        for t in found {
            let term = weighted(mesh, *t);
            for point in mesh.tets[*t as usize] {
                if wanted[point as usize] != 0 {
                    let sum = &mut self.means[self.slots[first_of(&one_of, point) as usize] as usize];
                    *sum = add(*sum, term);
                }
            }
        }
        for &point in one_of.keys() {
            let [own, first] = [point, first_of(&one_of, point)].map(|p| self.slots[p as usize] as usize);
            self.means[own] = self.means[first];
        }
        self.shared.extend(one_of.into_iter().flat_map(|(point, other)| [point, other]));
    }
}

/// Of points that have one gradient the one with which it is summed, given for each other one another of them.
#[inline]
fn first_of(one_of: &BTreeMap<u32, u32>, mut point: u32) -> u32 {
    if !one_of.is_empty() {
        while let Some(&other) = one_of.get(&point) {
            point = other;
        }
    }
    point
}

/// Pairs of a wanted point and one of another region at the same place, with the same value, seen at the faces of these tetrahedra.
fn twins(mesh: &MeshView<'_>, tets: &[u32], wanted: &[u8]) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    for &t in tets {
        let (tet, around) = (mesh.tets[t as usize], mesh.neighbors[t as usize]);
        for (face, n) in FACES.into_iter().zip(around).filter(|(_, n)| *n != NONE) {
            let other = mesh.tets[n as usize];
            for p in face.map(|k| tet[k]).into_iter().filter(|p| wanted[*p as usize] != 0) {
                pairs.extend(twin(mesh, p, other).map(|q| [p, q]));
            }
        }
    }
    pairs
}

/// The sum over a star, which gets sorted for it.
fn sum_of(mesh: &MeshView<'_>, star: &mut [u32]) -> [f64; 4] {
    star.sort_unstable();
    star.iter().fold([0.0; 4], |sum, t| add(sum, weighted(mesh, *t)))
}

/// Makes the mean of a sum.
fn divide(mean: &mut [f64; 4]) {
    let volume = mean[3];
    *mean = mean.map(|x| if volume > 0.0 { x / volume } else { 0.0 });
}

fn add(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]]
}

/// Six times volume · gradient, and six times the volume, of one tetrahedron.
fn weighted(mesh: &MeshView<'_>, t: u32) -> [f64; 4] {
    let tet = mesh.tets[t as usize];
    let [a, b, c, d] = tet.map(|p| DVec3::from(mesh.positions[p as usize]));
    let [fa, fb, fc, fd] = tet.map(|p| mesh.field[p as usize]);
    let (u, v, w) = (b - a, c - a, d - a);
    let (p, q, r) = (fb - fa, fc - fa, fd - fa);
    // p v x w + q w x u + r u x v, with two products instead of three.
    let uv = u.cross(v);
    let rest = (p * v - q * u).cross(w);
    (rest + r * uv).extend(w.dot(uv)).to_array()
}

/// `v` at length 1; `None` if it has no direction.
#[inline]
pub(super) fn unit(v: DVec3) -> Option<[f32; 3]> {
    let square = v.length_squared();
    if square > 1e-200 && square < 1e200 {
        return Some((v * (1.0 / square.sqrt())).as_vec3().to_array());
    }
    unit_of_extreme(v)
}

/// [`unit`] for a vector whose square may leave the range of `f64`: it is divided by its largest component first.
#[cold]
fn unit_of_extreme(v: DVec3) -> Option<[f32; 3]> {
    let v = v / v.to_array().iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let length = v.length();
    (length.is_finite() && length > 0.0).then(|| (v / length).as_vec3().to_array())
}
