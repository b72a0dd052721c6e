//! From an explicit MT to the compact half-edge one, where every update inserts a vertex that collapses onto a neighbour.

use super::builder::{HalfEdgeBuilder, NextUpdate, Remover, damaged, refused};
use super::store::{BaseMark, ForestChild, HalfEdgeMt};
use crate::mesh::NONE;
use crate::mt::replay::canonical;
use crate::mt::{ConvertError, ExplicitMt, MtInfo, MtKind, MultiTessellation, UpdateId, VertexId};

impl HalfEdgeMt {
    /// The compact form of an explicit MT whose updates are inverse half-edge collapses, its updates in the same order, in
    /// pages of `2^page_bits`.
    ///
    /// # Errors
    /// If an update is none.
    pub fn from_explicit(explicit: &ExplicitMt, page_bits: u32) -> Result<Self, ConvertError> {
        let updates = explicit.updates();
        let base = explicit.base().positions.len() as u32;
        let near: Vec<u32> =
            (0..updates).map(|u| near_vertex(explicit, UpdateId(u))).collect::<Result<_, _>>()?;
        let mut children: Vec<Vec<ForestChild>> = vec![Vec::new(); explicit.vertices() as usize];
        for (u, &v) in (0..).zip(&near) {
            let [from, to] = [VertexId(v), VertexId(base + u)].map(|v| explicit.position(v));
            children[v as usize].push(ForestChild { update: u, offset: [0, 1, 2].map(|k| to[k] - from[k]) });
        }
        let inner = inner_faces(explicit, &near);
        let mark = |t: u32| BaseMark { remover: explicit.removed_by(t).map_or(NONE, |u| u.0), inner: 0 };
        let mut marks: Vec<BaseMark> = explicit.base_tets().map(mark).collect();
        for (t, mark) in explicit.base_tets().zip(&mut marks) {
            mark.inner = inner.of(t, explicit.base().tets[t as usize]);
        }
        let info = MtInfo { kind: MtKind::HalfEdge, updates, ..explicit.info().clone() };
        let (of_base, of_updates) = children.split_at(base as usize);
        let mt = Self::new(info, explicit.base().clone(), marks, of_base, page_bits).map_err(damaged)?;
        let mut builder = HalfEdgeBuilder::new(mt)?;
        for (u, children) in (0..).zip(of_updates) {
            let id = UpdateId(u);
            let levels = explicit.levels(VertexId(base + u));
            let next = NextUpdate { children, levels, errors: explicit.errors(id) };
            builder.push(&next, |star, removers| removers_of(explicit, &inner, id, star, removers))?;
        }
        Ok(builder.finish())
    }
}

/// What removes the tetrahedra that an update inserts. None if they are others.
fn removers_of(
    explicit: &ExplicitMt,
    inner: &InnerFaces,
    u: UpdateId,
    star: &[[u32; 4]],
    removers: &mut Vec<Remover>,
) -> Option<()> {
    let range = explicit.inserted(u);
    let inserted = &explicit.tets()[range.start as usize..range.end as usize];
    for &tet in star {
        let t = range.start + inserted.binary_search(&canonical(tet)).ok()? as u32;
        removers.push((explicit.removed_by(t).map_or(NONE, |c| c.0), inner.of(t, tet)));
    }
    (inserted.len() == star.len()).then_some(())
}

/// The vertex that all tetrahedra have which an update removes. It stays in the mesh.
fn near_vertex(explicit: &ExplicitMt, u: UpdateId) -> Result<u32, ConvertError> {
    let tets = |t: &u32| explicit.tets()[*t as usize];
    let removed = explicit.removed(u);
    let created = explicit.created(u);
    if created.len() != 1 {
        return Err(refused(u.0));
    }
    let first = removed.first().map(tets).ok_or(refused(u.0))?;
    let range = explicit.inserted(u);
    let inserted = &explicit.tets()[range.start as usize..range.end as usize];
    let mut stays: Vec<[u32; 3]> = inserted.iter().map(|tet| without(*tet, created.start)).collect();
    stays.sort_unstable();
    // The face opposite the near vertex gets the new vertex instead.
    let moves = |tet: [u32; 4], v: u32| tet.contains(&v) && stays.binary_search(&without(tet, v)).is_ok();
    let shared = |v: &u32| removed.iter().map(tets).all(|tet| moves(tet, *v));
    // With several, any will do: the one with the most tetrahedra around it keeps them.
    let around = |v: &u32| inserted.iter().filter(|tet| tet.contains(v)).count();
    let near = first.into_iter().filter(shared).max_by_key(|v| (around(v), *v));
    near.filter(|v| around(v) > 0).ok_or(refused(u.0))
}

/// For each tetrahedron of an explicit MT the faces that go with it.
struct InnerFaces {
    /// Bit `i` is that of the face opposite the `i`-th corner in ascending order.
    bits: Vec<u8>,
}

impl InnerFaces {
    /// The faces of tetrahedron `t` that go with it, by corner of `tet`, which are its vertices.
    fn of(&self, t: u32, tet: [u32; 4]) -> u8 {
        let rank = |v: u32| tet.iter().filter(|&&other| other < v).count();
        (0..4).fold(0, |bits, corner| bits | (self.bits[t as usize] >> rank(tet[corner]) & 1) << corner)
    }
}

fn inner_faces(explicit: &ExplicitMt, near: &[u32]) -> InnerFaces {
    let mut bits = vec![0_u8; explicit.tets().len()];
    let mut stays: Vec<[u32; 3]> = Vec::new();
    for (u, &near) in (0..).zip(near) {
        let id = UpdateId(u);
        let range = explicit.inserted(id);
        let vertex = explicit.created(id).start;
        // Faces of Π_u are those opposite the new vertex.
        stays.clear();
        stays.extend(
            explicit.tets()[range.start as usize..range.end as usize].iter().map(|tet| without(*tet, vertex)),
        );
        stays.sort_unstable();
        for &t in explicit.removed(id) {
            let mut tet = explicit.tets()[t as usize];
            tet.sort_unstable();
            for (corner, &v) in tet.iter().enumerate() {
                if v != near && stays.binary_search(&without(tet, v)).is_err() {
                    bits[t as usize] |= 1 << corner;
                }
            }
        }
    }
    InnerFaces { bits }
}

/// The vertices of a tetrahedron but for one, ascending.
fn without(mut tet: [u32; 4], v: u32) -> [u32; 3] {
    tet.sort_unstable();
    let at = tet.iter().position(|&other| other == v).unwrap_or(3);
    let mut rest = [0; 3];
    rest.iter_mut().zip((0..4).filter(|&k| k != at)).for_each(|(rest, k)| *rest = tet[k]);
    rest
}
