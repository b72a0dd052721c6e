//! Surfaces that follow a changing mesh.
//!
//! A surface learns what it must know for that step by step, so that who asks only once does not pay: the first
//! extraction is a plain one; when the mesh then changes a little, or not at all, a copy of the mesh is made beside
//! the second one; from then on tetrahedra that have changed are cut anew, and nothing else is.

use super::IsoSurface;
use super::NO_NORMAL;
use super::NormalKind;
use super::State;
use super::UP;
use super::cut;
use super::distinct;
use super::gradients::unit;
use super::links::Links;
use super::mesh_snapshot::Bits;
use super::mesh_snapshot::Dirty;
use super::mesh_snapshot::MeshSnapshot;
use crate::mesh::NONE;
use crate::view::MeshView;
use std::ops::Range;

/// A mesh of a size that differs by more than this part is another mesh.
const SIMILAR: usize = 4;
/// When more than this part of the tetrahedra has changed, a new extraction costs less.
const LITTLE: usize = 8;

/// What happens to a surface in one update.
#[derive(Debug, Default)]
struct Edit {
    /// Triangles that are gone.
    holes: Vec<u32>,
    /// Triangles that are new, and their owners.
    new: Vec<([u32; 3], u32)>,
    /// Vertices that were found at a cut tetrahedron or have lost a triangle.
    vertices: Vec<u32>,
    in_vertices: Bits,
}

impl Edit {
    fn add_vertices(&mut self, triangle: [u32; 3]) {
        for v in triangle {
            if self.in_vertices.insert(v) {
                self.vertices.push(v);
            }
        }
    }
}

impl IsoSurface {
    /// Changes this surface into those of `mesh` at `values`, when the mesh differs from that of the last extraction
    /// or update only in these ranges of points and tetrahedra, and in what lies beyond the ends of shorter or longer
    /// arrays.
    ///
    /// What it costs goes with what has changed: the ranges, which are compared with a copy, and the stars of points
    /// that differ. Another isovalue, or another kind of normals, is extracted anew, where the field passes it; so is
    /// everything when more than an eighth has changed.
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
        let old_tets = self.tets;
        let new_tets = mesh.tets.len();
        let is_similar = old_tets.abs_diff(new_tets) <= new_tets / SIMILAR;
        let Some(mut snapshot) = self.snapshot.take().filter(|_| is_similar) else {
            self.rebuild(mesh, isovalues);
            self.snapshot = (was != State::New && is_similar).then(|| Box::new(MeshSnapshot::new(mesh)));
            return;
        };
        let dirty = snapshot.catch_up(mesh, changed_vertices, changed_tets);
        self.snapshot = Some(snapshot);
        if same && dirty.tets.len() <= new_tets / LITTLE {
            self.state = now;
            self.tets = new_tets;
            self.splice(mesh, old_tets, &dirty);
        } else {
            dirty.points.iter().for_each(|point| self.gradients.forget(*point));
            self.gradients.resize(mesh.positions.len());
            self.rebuild(mesh, isovalues);
        }
    }

    /// Cuts the dirty tetrahedra anew.
    fn splice(&mut self, mesh: &MeshView<'_>, old_tets: usize, dirty: &Dirty) {
        let mut links = self.links.take().unwrap_or_else(|| {
            Box::new(Links::new(old_tets, self.positions.len(), &self.indices, &self.owners))
        });
        let mut edit = Edit::default();
        self.recut(mesh, dirty, &mut links, &mut edit);
        self.set_triangles(&mut links, &mut edit);
        self.place_again(mesh, &links, &edit);
        self.renew_normals(mesh, dirty, &links, &edit);
        self.drop_unused(&mut links, edit);
        self.links = Some(links);
    }

    /// Finds out which triangles go and which come.
    fn recut(&mut self, mesh: &MeshView<'_>, dirty: &Dirty, links: &mut Links, edit: &mut Edit) {
        let mut old = Vec::new();
        for t in mesh.tets.len()..links.tet_count() {
            links.take(t as u32, &mut old);
            self.take_out(&old, links, edit);
        }
        links.resize(mesh.tets.len());
        for &t in &dirty.tets {
            links.take(t, &mut old);
            for at in (0..).zip(self.isovalues.iter().copied()) {
                let triangles = cut::triangles(&mut self.crossings, mesh.tets[t as usize], mesh.field, at);
                for (rank, triangle) in (0..).zip(triangles).filter(|(_, triangle)| triangle[0] != NONE) {
                    let owner = t << 1 | rank;
                    edit.add_vertices(triangle);
                    let same = |old: &u32| {
                        (self.indices[*old as usize], self.owners[*old as usize]) == (triangle, owner)
                    };
                    match old.iter().position(same) {
                        Some(at) => links.put_back(old.swap_remove(at) as usize, owner),
                        None => edit.new.push((triangle, owner)),
                    }
                }
            }
            self.take_out(&old, links, edit);
        }
    }

    /// Takes triangles from their vertices.
    fn take_out(&self, triangles: &[u32], links: &mut Links, edit: &mut Edit) {
        for &triangle in triangles {
            let vertices = self.indices[triangle as usize];
            links.unlink(triangle, vertices);
            edit.add_vertices(vertices);
            edit.holes.push(triangle);
        }
    }

    /// Writes the new triangles into the holes first, and fills what holes are left with the last triangles.
    fn set_triangles(&mut self, links: &mut Links, edit: &mut Edit) {
        links.make_room(self.crossings.list.len());
        edit.holes.sort_unstable();
        let filled = edit.holes.len().min(edit.new.len());
        for (i, (triangle, owner)) in edit.new.drain(..).enumerate() {
            let slot = edit.holes.get(i).map_or(self.indices.len(), |hole| *hole as usize);
            if slot == self.indices.len() {
                self.indices.push(triangle);
                self.owners.push(owner);
            } else {
                (self.indices[slot], self.owners[slot]) = (triangle, owner);
            }
            links.put(slot, &self.indices, owner);
            self.changed_triangles.mark(slot as u32);
        }
        for hole in edit.holes.drain(filled..).rev() {
            let last = self.indices.len() - 1;
            links.swap_remove(hole, self.indices[last], self.owners[last]);
            self.indices.swap_remove(hole as usize);
            self.owners.swap_remove(hole as usize);
            self.changed_triangles.mark(hole);
        }
    }

    /// Sets the positions of vertices that are new or whose ends may have moved.
    fn place_again(&mut self, mesh: &MeshView<'_>, links: &Links, edit: &Edit) {
        let old = self.positions.len();
        let new = &self.crossings.list[old..];
        self.values.extend(new.iter().map(|crossing| self.isovalues[crossing.which as usize]));
        self.positions.resize(self.crossings.list.len(), [0.0; 3]);
        self.normals.resize(self.crossings.list.len(), [0.0; 3]);
        for &v in edit.vertices.iter().filter(|v| links.is_used(**v)) {
            let crossing = &self.crossings.list[v as usize];
            let t = crossing.fraction(mesh.field, self.values[v as usize]);
            let place = crossing.place(mesh.positions, t);
            let before = std::mem::replace(&mut self.positions[v as usize], place);
            if v as usize >= old || before.map(f32::to_bits) != place.map(f32::to_bits) {
                self.changed_vertices.mark(v);
            }
        }
    }

    /// Sets the normals where a gradient or a triangle has changed.
    fn renew_normals(&mut self, mesh: &MeshView<'_>, dirty: &Dirty, links: &Links, edit: &Edit) {
        let mut renew = Edit::default();
        for v in edit.vertices.iter().filter(|v| links.is_used(**v)) {
            links.fan(*v).for_each(|triangle| renew.add_vertices(self.indices[triangle as usize]));
        }
        if self.kind == NormalKind::Gradient {
            self.renew_gradients(mesh, dirty, links, &mut renew);
            let list = &self.crossings.list;
            let ends = renew.vertices.iter().flat_map(|v| list[*v as usize].ends);
            self.gradients.sum(mesh, ends, self.snapshot.as_deref_mut(), &mut self.sides);
        }
        for &v in &renew.vertices {
            let mut normal = NO_NORMAL;
            if self.kind == NormalKind::Gradient {
                let crossing = &self.crossings.list[v as usize];
                let t = crossing.fraction(mesh.field, self.values[v as usize]);
                normal = self.gradients.normal(crossing, t);
            }
            if normal == NO_NORMAL {
                normal = self.fan_normal(links, v);
            }
            let before = std::mem::replace(&mut self.normals[v as usize], normal);
            if before.map(f32::to_bits) != normal.map(f32::to_bits) {
                self.changed_vertices.mark(v);
            }
        }
    }

    /// Sets gradients anew that are not what they were, and adds the vertices that use them.
    fn renew_gradients(&mut self, mesh: &MeshView<'_>, dirty: &Dirty, links: &Links, renew: &mut Edit) {
        self.gradients.resize(mesh.positions.len());
        let Some(snapshot) = &mut self.snapshot else { return };
        let list = &self.crossings.list;
        let mut star = Vec::new();
        let mut lost = Bits::default();
        let mut any_lost = false;
        for &point in &dirty.points {
            if !self.gradients.has(point) {
                continue;
            }
            if !snapshot.star(mesh, point, &mut star) {
                self.gradients.forget(point);
                lost.insert(point);
                any_lost = true;
                continue;
            }
            let mut is_used = false;
            for v in star.iter().flat_map(|t| links.triangles(*t)).flat_map(|t| self.indices[t as usize]) {
                if list[v as usize].ends.contains(&point) {
                    is_used = true;
                    renew.add_vertices([v; 3]);
                }
            }
            if is_used {
                self.gradients.set(mesh, point, &mut star);
            } else {
                self.gradients.forget(point);
            }
        }
        if any_lost {
            for (v, crossing) in (0..).zip(list) {
                if links.is_used(v) && crossing.ends.iter().any(|end| lost.has(*end)) {
                    renew.add_vertices([v; 3]);
                }
            }
        }
    }

    /// The mean direction of the triangles at a vertex, summed in the order of an extraction.
    fn fan_normal(&self, links: &Links, v: u32) -> [f32; 3] {
        let mut fan: Vec<_> =
            links.fan(v).map(|triangle| (self.owners[triangle as usize], triangle)).collect();
        fan.sort_unstable();
        let mut sum = [0.0; 3];
        for (_, triangle) in fan {
            let area = self.area(self.indices[triangle as usize]);
            (0..3).for_each(|i| sum[i] += area[i]);
        }
        unit(sum).unwrap_or(UP)
    }

    /// Takes out the vertices that no triangle uses any more.
    fn drop_unused(&mut self, links: &mut Links, mut edit: Edit) {
        edit.vertices.retain(|v| !links.is_used(*v));
        edit.vertices.sort_unstable();
        for v in edit.vertices.into_iter().rev() {
            self.crossings.swap_remove(v);
            self.positions.swap_remove(v as usize);
            self.normals.swap_remove(v as usize);
            self.values.swap_remove(v as usize);
            links.rename_last(v, &mut self.indices, |triangle| self.changed_triangles.mark(triangle));
            self.changed_vertices.mark(v);
        }
    }
}
