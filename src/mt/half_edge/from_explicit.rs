//! From an explicit MT to the compact half-edge one, where every update inserts a vertex that collapses onto a neighbour.

use super::builder::{HalfEdgeBuilder, NextUpdate};
use super::forest::Forest;
use super::refusal::refused;
use super::removers::by_corner;
use super::store::{BaseMark, HalfEdgeMt};
use crate::mesh::NONE;
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
        let inner = inner_faces(explicit, &near);
        let mark = |t: u32| BaseMark { remover: explicit.removed_by(t).map_or(NONE, |u| u.0), inner: 0 };
        let mut marks: Vec<BaseMark> = explicit.base_tets().map(mark).collect();
        for (t, mark) in explicit.base_tets().zip(&mut marks) {
            mark.inner = inner.of(t, explicit.base().tets[t as usize]);
        }
        let info = MtInfo { kind: MtKind::HalfEdge, updates, ..explicit.info().clone() };
        let offset = |u: u32| {
            let [from, to] = [near[u as usize], base + u].map(|v| explicit.position(VertexId(v)));
            [0, 1, 2].map(|k| to[k] - from[k])
        };
        let forest = Forest::new((0..explicit.vertices()).collect(), &near, offset);
        let mut builder =
            HalfEdgeBuilder::new(info, explicit.base().clone(), marks, forest, None, page_bits)?;
        builder.make_room();
        let mut star = Vec::new();
        for u in 0..updates {
            find_star(explicit, UpdateId(u), &mut star).ok_or(refused(u))?;
            let faces: Vec<[u32; 3]> = star.iter().map(|&(face, _)| face).collect();
            let levels = explicit.levels(VertexId(base + u));
            let (near, errors) = (near[u as usize], explicit.errors(UpdateId(u)));
            let next = NextUpdate { near, offset: offset(u), levels, sides: &[], errors, faces: &faces };
            let remover = |t: u32| (explicit.removed_by(t).map_or(NONE, |u| u.0), inner.bits[t as usize]);
            builder.push(&next, star.iter().map(|&(_, t)| remover(t)))?;
        }
        builder.finish()
    }
}

/// Finds the tetrahedra that an update inserts, each with its face opposite the new vertex, in the order of these. None if one does not have
/// the new vertex.
fn find_star(explicit: &ExplicitMt, u: UpdateId, star: &mut Vec<([u32; 3], u32)>) -> Option<()> {
    let vertex = explicit.created(u).start;
    star.clear();
    for t in explicit.inserted(u) {
        let tet = explicit.tets()[t as usize];
        tet.contains(&vertex).then(|| star.push((without(tet, vertex), t)))?;
    }
    star.sort_unstable();
    Some(())
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
        by_corner(self.bits[t as usize], tet)
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
