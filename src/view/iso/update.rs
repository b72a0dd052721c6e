//! Surfaces that follow a changing mesh.
//!
//! The data for updates is built step by step, so that a single extraction costs nothing extra: the first extraction is
//! a plain one; the second one also makes a copy of the mesh, if that has changed by little; from then on only changed
//! tetrahedra are cut again.

use super::gradients::unit;
use super::{
    BlockRanges, Followed, IsoSurface, NO_NORMAL, NormalKind, State, UP, distinct, fraction, polygon,
};
use crate::mesh::BitSet;
use crate::view::MeshView;
use crate::view::marching::{Crossing, Vertices};
use crate::view::mesh_snapshot::{Dirty, MeshSnapshot};
use glam::DVec3;
use std::ops::Range;

/// A mesh of a size that differs by more than this part is another mesh.
const SIMILAR: usize = 4;
/// When more than this part of the tetrahedra has changed, a new extraction costs less.
const LITTLE: usize = 8;

impl IsoSurface {
    /// Changes this surface into those of `mesh` at `values`, when the mesh differs from that of the last extraction
    /// or update only in these ranges of points and tetrahedra, and in what lies beyond the ends of shorter or longer
    /// arrays.
    ///
    /// The cost grows with the changes: the ranges, which are compared with a copy, and the stars of points that
    /// differ. For other isovalues or another kind of normals, or when more than an eighth has changed, the surface is
    /// extracted again.
    ///
    /// # Panics
    /// If the mesh names a point that it does not have.
    pub fn update(
        &mut self,
        mesh: &MeshView<'_>,
        values: &[f64],
        changed_vertices: &[Range<u32>],
        changed_tets: &[Range<u32>],
    ) {
        let isovalues = distinct(values);
        let was = self.state;
        let now = State::Of(mesh.positions.len(), mesh.tets.len());
        let same = self.isovalues == isovalues && was != State::Stale;
        if same && was == now && changed_vertices.is_empty() && changed_tets.is_empty() {
            return;
        }
        let new_tets = mesh.tets.len();
        let is_similar = self.pieces.tets().abs_diff(new_tets) <= new_tets / SIMILAR;
        let Some(mut followed) = self.followed.take().filter(|_| is_similar) else {
            self.rebuild(mesh, isovalues);
            let follow =
                || Box::new(Followed { snapshot: MeshSnapshot::new(mesh), ranges: BlockRanges::new(mesh) });
            self.followed = (was != State::New && is_similar).then(follow);
            return;
        };
        let mut dirty = followed.snapshot.catch_up(mesh, changed_vertices, changed_tets);
        dirty.tets.sort_unstable();
        followed.ranges.update(mesh, &dirty.tets);
        self.followed = Some(followed);
        if same && dirty.tets.len() <= new_tets / LITTLE {
            self.state = now;
            self.splice(mesh, &dirty);
        } else {
            dirty.points(mesh).iter().for_each(|point| self.gradients.forget(*point));
            self.gradients.forget_shared();
            self.gradients.resize(mesh.positions.len());
            self.rebuild(mesh, isovalues);
        }
    }

    /// Cuts the dirty tetrahedra again.
    fn splice(&mut self, mesh: &MeshView<'_>, dirty: &Dirty) {
        let Self { pieces, indices, isovalues, .. } = self;
        let piece = |t, which| polygon(mesh, t, isovalues[which as usize]);
        let edited = pieces.recut(indices, mesh.tets.len(), &dirty.tets, isovalues.len() as u32, piece);
        self.place_again(mesh, &edited);
        self.renew_normals(mesh, dirty, &edited);
        let Self { pieces, indices, positions, normals, values, .. } = self;
        pieces.drop_unused(indices, edited.list, |v| {
            positions.swap_remove(v);
            normals.swap_remove(v);
            values.swap_remove(v);
        });
    }

    /// Sets the positions of vertices that are new or whose ends may have moved.
    fn place_again(&mut self, mesh: &MeshView<'_>, edited: &Vertices) {
        let Self { pieces, positions, normals, values, isovalues, .. } = self;
        let old = positions.len();
        let list = &pieces.crossings.list;
        values.extend(list[old..].iter().map(|crossing| isovalues[crossing.which as usize]));
        positions.resize(list.len(), [0.0; 3]);
        normals.resize(list.len(), [0.0; 3]);
        pieces.place_again(&edited.list, old, |v, crossing| {
            let place = crossing.place(mesh.positions, fraction(crossing, mesh, values[v]));
            let before = std::mem::replace(&mut positions[v], place);
            before.map(f64::to_bits) != place.map(f64::to_bits)
        });
    }

    /// Sets the normals where a gradient or a triangle has changed.
    fn renew_normals(&mut self, mesh: &MeshView<'_>, dirty: &Dirty, edited: &Vertices) {
        let mut renew = Vertices::default();
        for triangle in edited.list.iter().flat_map(|v| self.pieces.fan(*v)) {
            renew.add(self.indices[triangle as usize]);
        }
        if self.kind == NormalKind::Gradient {
            self.renew_gradients(mesh, dirty, &mut renew);
            let list = &self.pieces.crossings.list;
            let ends = renew.list.iter().flat_map(|v| list[*v as usize].ends);
            let snapshot = self.followed.as_mut().map(|followed| &mut followed.snapshot);
            self.gradients.sum(mesh, ends, snapshot, &mut self.sides);
        }
        for &v in &renew.list {
            let mut normal = NO_NORMAL;
            if self.kind == NormalKind::Gradient {
                let crossing = &self.pieces.crossings.list[v as usize];
                normal = self.gradients.normal(crossing, fraction(crossing, mesh, self.values[v as usize]));
            }
            if normal == NO_NORMAL {
                normal = self.fan_normal(v);
            }
            let before = std::mem::replace(&mut self.normals[v as usize], normal);
            if before.map(f32::to_bits) != normal.map(f32::to_bits) {
                self.pieces.mark_vertex(v);
            }
        }
    }

    /// Recomputes changed gradients, and adds the vertices that use them.
    fn renew_gradients(&mut self, mesh: &MeshView<'_>, dirty: &Dirty, renew: &mut Vertices) {
        self.gradients.resize(mesh.positions.len());
        let Some(followed) = &mut self.followed else { return };
        let list = &self.pieces.crossings.list;
        let mut star = Vec::new();
        let mut lost = BitSet::default();
        let shared = self.gradients.forget_shared();
        let mut any_lost = !shared.is_empty();
        shared.into_iter().for_each(|point| _ = lost.insert(point));
        for point in dirty.points(mesh) {
            if !self.gradients.has(point) {
                continue;
            }
            if !followed.snapshot.star(mesh, point, &mut star) {
                self.gradients.forget(point);
                any_lost = true;
                lost.insert(point);
                continue;
            }
            let corners = star.iter().flat_map(|t| self.pieces.triangles_in(*t));
            let corners = corners.flat_map(|triangle| self.indices[triangle as usize]);
            let mut users = corners.filter(|v| list[*v as usize].ends.contains(&point)).peekable();
            let is_used = users.peek().is_some();
            renew.add(users);
            if is_used {
                self.gradients.set(mesh, point, &mut star);
            } else {
                self.gradients.forget(point);
            }
        }
        if any_lost {
            let crossings = (0..).zip(list);
            let lost = |crossing: &Crossing| crossing.ends.iter().any(|end| lost.has(*end));
            let users = crossings.filter(|(v, crossing)| lost(crossing) && self.pieces.is_used(*v));
            renew.add(users.map(|(v, _)| v));
        }
    }

    /// The mean direction of the triangles at a vertex, summed in the order of an extraction.
    fn fan_normal(&self, v: u32) -> [f32; 3] {
        let fan = self.pieces.ordered_fan(v).into_iter();
        let sum = fan.fold(DVec3::ZERO, |sum, triangle| sum + self.area(self.indices[triangle as usize]));
        unit(sum).unwrap_or(UP)
    }
}
