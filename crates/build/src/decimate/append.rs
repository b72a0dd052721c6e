//! Appends the inverses of half-edge collapses, coarse to fine, to a half-edge MT.

use crate::BuildError;
use crate::lattice::sides::Sides;
use crate::order::base::Numbered;
use tetralod::mesh::NONE;
use tetralod::mt::{
    BaseMark, BaseMesh, BaseSides, ErrorCode, Forest, HalfEdgeBuilder, HalfEdgeMt, MtInfo, NextUpdate,
    Regions, VertexId, by_corner, further_regions,
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
    sides: &'a Sides,
    /// The MT's vertex for each reference point.
    number: Vec<u32>,
}

/// Reference points: their positions, their levels, field by field, and those of their sides behind them.
type Points<'a> = (&'a [[i32; 3]], &'a [i32], &'a Sides);

/// The builder of an MT with this base mesh and these updates, none of which have been appended, and the MT's vertex for each reference point. The
/// base tetrahedra of `regions` are in the order of the builder's places.
pub(crate) fn begin(
    (info, regions): (MtInfo, Option<Regions>),
    numbered: Numbered,
    updates: &Ordered<'_>,
    (positions, levels, sides): Points<'_>,
    block_bits: u32,
) -> Result<(HalfEdgeBuilder, Vec<u32>), BuildError> {
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
    let regions = regions.map(|mut regions| {
        if !sides.is_empty() {
            regions.sides = base_sides(&mesh, &regions.of_base, &points, (levels, sides));
        }
        regions
    });
    let near = updates.near.iter().map(|&near| number[near as usize]).collect();
    let offset = |u: u32| {
        let [from, to] = [updates.near, updates.vertices].map(|all| positions[all[u as usize] as usize]);
        [0, 1, 2].map(|k| to[k] - from[k])
    };
    let forest = Forest::new(points.len(), near, offset);
    Ok((HalfEdgeBuilder::new(info, mesh, marks, (forest, points), regions, block_bits)?, number))
}

impl<'a> Appender<'a> {
    /// [Begins](begin) with the base mesh.
    pub fn new(
        described: (MtInfo, Option<Regions>),
        numbered: Numbered,
        updates: &Ordered<'_>,
        points: Points<'a>,
        block_bits: u32,
    ) -> Result<Self, BuildError> {
        let (builder, number) = begin(described, numbered, updates, points, block_bits)?;
        Ok(Self { builder, levels: points.1, sides: points.2, number })
    }

    /// Appends the next update. `star` has for each tetrahedron that it inserts, in the order of their faces opposite the new vertex,
    /// what [`Ordered::base_marks`] has for one of the base mesh.
    pub fn push(
        &mut self,
        vertex: u32,
        errors: &[ErrorCode],
        star: impl Iterator<Item = (u32, u8)>,
    ) -> Result<(), BuildError> {
        let levels_of = |point: u32| &self.levels[point as usize * errors.len()..][..errors.len()];
        let sides: Vec<(u16, &[i32])> =
            self.sides.further(vertex).map(|(point, region)| (region as u16, levels_of(point))).collect();
        let next = NextUpdate { levels: levels_of(vertex), sides: &sides, errors, faces: &[] };
        Ok(self.builder.push(&next, star)?)
    }

    /// The MT, and its vertex for each reference point.
    pub fn finish(self) -> Result<(HalfEdgeMt, Vec<VertexId>), BuildError> {
        Ok((self.builder.finish()?, self.number.into_iter().map(VertexId).collect()))
    }
}

/// The levels of the base vertices, which are these reference points, in each of their regions but the first.
fn base_sides(
    mesh: &BaseMesh,
    of_base: &[u16],
    points: &[u32],
    (levels, sides): (&[i32], &Sides),
) -> BaseSides {
    let fields = sides.jumps.len();
    let further = further_regions(mesh.positions.len(), &mesh.tets, of_base).into_iter();
    let point = |(v, region): (u32, u16)| sides.point(points[v as usize], u32::from(region)) as usize;
    let rows = further.flat_map(|side| &levels[point(side) * fields..][..fields]);
    BaseSides { jumps: sides.jumps.clone(), levels: rows.copied().collect() }
}
