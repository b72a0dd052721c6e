//! Appends the inverses of half-edge collapses, coarse to fine, to a half-edge MT.

use crate::BuildError;
use crate::order::base::Numbered;
use tetralod::mesh::NONE;
use tetralod::mt::{
    BaseMark, ErrorCode, Forest, HalfEdgeBuilder, HalfEdgeMt, MtInfo, NextUpdate, Regions, VertexId,
    by_corner,
};

/// Updates in their order. Vertices are numbers of reference points.
pub(crate) struct Ordered<'a> {
    /// The vertex that each inserts.
    pub vertices: &'a [u32],
    /// The near vertex of each update.
    pub near: &'a [u32],
    /// For each tetrahedron of the base mesh, by the builder's places, the update that removes it, [`NONE`] if none does, and which of
    /// its faces go with it: bit `i` is that of the face opposite the `i`-th vertex in ascending order.
    pub base_marks: &'a [(u32, u8)],
}

/// A half-edge MT that grows.
pub(crate) struct Appender<'a> {
    builder: HalfEdgeBuilder,
    /// Point by point and field by field.
    levels: &'a [i32],
    /// The MT's vertex for each reference point.
    number: Vec<u32>,
}

impl<'a> Appender<'a> {
    /// Begins with the base mesh, given the positions and levels of the reference points on their lattices. The base tetrahedra of `regions` are
    /// in the order of the builder's places.
    pub fn new(
        (info, regions): (MtInfo, Option<Regions>),
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
        let regions = regions.map(|regions| Regions {
            of_base: places.iter().map(|&place| regions.of_base[place as usize]).collect(),
            ..regions
        });
        let near = updates.near.iter().map(|&near| number[near as usize]).collect();
        let offset = |u: u32| {
            let [from, to] = [updates.near, updates.vertices].map(|all| positions[all[u as usize] as usize]);
            [0, 1, 2].map(|k| to[k] - from[k])
        };
        let forest = Forest::new(points.len(), near, offset);
        let builder = HalfEdgeBuilder::new(info, mesh, marks, (forest, points), regions, block_bits)?;
        Ok(Self { builder, levels, number })
    }

    /// Appends the next update. `star` has for each tetrahedron that it inserts, in the order of their faces opposite the new vertex,
    /// what [`Ordered::base_marks`] has for one of the base mesh.
    pub fn push(
        &mut self,
        vertex: u32,
        errors: &[ErrorCode],
        star: impl Iterator<Item = (u32, u8)>,
    ) -> Result<(), BuildError> {
        let levels = &self.levels[vertex as usize * errors.len()..][..errors.len()];
        Ok(self.builder.push(&NextUpdate { levels, errors, faces: &[] }, star)?)
    }

    /// The MT, and its vertex for each reference point.
    pub fn finish(self) -> Result<(HalfEdgeMt, Vec<VertexId>), BuildError> {
        Ok((self.builder.finish()?, self.number.into_iter().map(VertexId).collect()))
    }
}
