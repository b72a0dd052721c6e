//! Appends the inverses of half-edge collapses, coarse to fine, to a half-edge MT.

use super::BuildError;
use super::base::Numbered;
use super::hole::sorted;
use crate::mesh::NONE;
use crate::mt::{
    BaseMark, ConvertError, ErrorCode, ForestChild, HalfEdgeBuilder, HalfEdgeMt, MtInfo, NextUpdate,
    ReplayError, UpdateError, VertexId,
};

/// Updates in their order. Vertices are numbers of reference points.
pub(super) struct Ordered<'a> {
    /// The vertex that each inserts.
    pub vertices: &'a [u32],
    /// Its near vertex.
    pub near: &'a [u32],
    /// For each tetrahedron of the base mesh, by the builder's places, the update that removes it, [`NONE`] if none does, and which of
    /// its faces go with it: bit `i` is that of the face opposite the `i`-th vertex in ascending order.
    pub base_marks: &'a [(u32, u8)],
}

/// A half-edge MT that grows.
pub(super) struct Appender<'a> {
    builder: HalfEdgeBuilder,
    /// Point by point and field by field.
    levels: &'a [i32],
    /// The MT's vertex for each reference point.
    number: Vec<u32>,
    /// The reference point of each of the MT's vertices.
    points: Vec<u32>,
    /// The updates by near vertex: where those of each vertex begin, and all.
    starts: Vec<u32>,
    children: Vec<ForestChild>,
    base: usize,
    /// How many updates there are.
    len: usize,
    faces: Vec<([u32; 3], usize)>,
}

impl<'a> Appender<'a> {
    /// Begins with the base mesh, given the positions and levels of the reference points on their lattices.
    pub fn new(
        info: MtInfo,
        numbered: Numbered,
        updates: &Ordered<'_>,
        (positions, levels): (&[[i32; 3]], &'a [i32]),
        block_bits: u32,
    ) -> Result<Self, BuildError> {
        let Numbered { mesh, mut number, places } = numbered;
        let base = mesh.positions.len();
        for (u, &v) in (0..).zip(updates.vertices) {
            number[v as usize] = base as u32 + u;
        }
        let mut points = vec![NONE; base + updates.vertices.len()];
        let known = (0..).zip(&number).filter(|(_, v)| **v != NONE);
        known.for_each(|(point, &v): (u32, _)| points[v as usize] = point);
        let mut marks = Vec::with_capacity(mesh.tets.len());
        for (tet, &place) in mesh.tets.iter().zip(&places) {
            let (remover, inner) = updates.base_marks[place as usize];
            marks.push(BaseMark { remover, inner: by_corner(inner, tet.map(|v| points[v as usize])) });
        }
        let (starts, children) = forest(updates, &number, positions);
        let of = |v: usize| children[starts[v] as usize..starts[v + 1] as usize].to_vec();
        let of_base: Vec<Vec<ForestChild>> = (0..base).map(of).collect();
        let sound = |error: UpdateError| ConvertError::from(ReplayError::Update(error));
        let mt = HalfEdgeMt::new(info, mesh, marks, &of_base, block_bits).map_err(sound)?;
        let builder = HalfEdgeBuilder::new(mt)?;
        Ok(Self { builder, levels, number, points, starts, children, base, len: 0, faces: Vec::new() })
    }

    /// Appends the next update. `star` has for each tetrahedron that it inserts, in the order of their faces opposite the new vertex,
    /// what [`Ordered::base_marks`] has for one of the base mesh.
    pub fn push(
        &mut self,
        vertex: u32,
        errors: &[ErrorCode],
        star: impl ExactSizeIterator<Item = (u32, u8)>,
    ) -> Result<(), BuildError> {
        let Self { builder, levels, points, starts, children, base, len, faces, .. } = self;
        let (fields, v) = (errors.len(), *base + *len);
        let next = NextUpdate {
            children: &children[starts[v] as usize..starts[v + 1] as usize],
            levels: &levels[vertex as usize * fields..][..fields],
            errors,
        };
        *len += 1;
        builder.push(&next, |tets, removers| {
            faces.clear();
            for (i, tet) in tets.iter().enumerate() {
                let corners = tet.map(|v| points[v as usize]);
                let at = corners.iter().position(|&v| v == vertex)?;
                faces.push((sorted(without(corners, at)), i));
            }
            faces.sort_unstable();
            removers.resize(tets.len(), (NONE, 0));
            let is_whole = tets.len() == star.len();
            for (&(_, i), (remover, inner)) in faces.iter().zip(star) {
                removers[i] = (remover, by_corner(inner, tets[i].map(|v| points[v as usize])));
            }
            is_whole.then_some(())
        })?;
        Ok(())
    }

    /// The MT, and its vertex for each reference point.
    pub fn finish(self) -> (HalfEdgeMt, Vec<VertexId>) {
        (self.builder.finish(), self.number.into_iter().map(VertexId).collect())
    }
}

/// The updates by near vertex, each with where it inserts its own: where those of each vertex begin, and all.
fn forest(updates: &Ordered<'_>, number: &[u32], positions: &[[i32; 3]]) -> (Vec<u32>, Vec<ForestChild>) {
    let mut starts = vec![0_u32; number.len() + 1];
    updates.near.iter().for_each(|&near| starts[number[near as usize] as usize + 1] += 1);
    (0..number.len()).for_each(|v| starts[v + 1] += starts[v]);
    let mut next = starts.clone();
    let mut children = vec![ForestChild::default(); updates.vertices.len()];
    for (update, (&near, &vertex)) in (0..).zip(updates.near.iter().zip(updates.vertices)) {
        let [from, to] = [near, vertex].map(|v| positions[v as usize]);
        let place = &mut next[number[near as usize] as usize];
        children[*place as usize] = ForestChild { update, offset: [0, 1, 2].map(|k| to[k] - from[k]) };
        *place += 1;
    }
    (starts, children)
}

/// Three of four vertices in increasing order: all but the `i`-th.
pub(super) fn without(tet: [u32; 4], i: usize) -> [u32; 3] {
    [0, 1, 2].map(|k| tet[if k < i { k } else { k + 1 }])
}

/// Bits of the vertices of a tetrahedron in ascending order, by its corners.
fn by_corner(bits: u8, tet: [u32; 4]) -> u8 {
    let rank = |v: u32| tet.iter().filter(|&&other| other < v).count();
    (0..4).fold(0, |all, corner| all | (bits >> rank(tet[corner]) & 1) << corner)
}
