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
    /// See [`begin`].
    pub base_marks: &'a [(u32, u8)],
}

/// A half-edge MT that grows.
pub(crate) struct Appender<'a> {
    builder: HalfEdgeBuilder,
    near: &'a [u32],
    /// The levels point by point and field by field.
    points: Points<'a>,
    len: usize,
    /// The MT's vertex for each reference point.
    number: Vec<u32>,
}

/// Reference points: their positions, their levels, field by field, and those of their sides behind them.
type Points<'a> = (&'a [[i32; 3]], &'a [i32], &'a Sides);

/// The builder of an MT with this base mesh, without updates yet. `marks` has for each tetrahedron of the base mesh, by the builder's places, the
/// update that removes it, [`NONE`] if none does, and which of its faces go with it: bit `i` is that of the face opposite the `i`-th vertex in
/// ascending order. The base tetrahedra of `regions` are in the order of the builder's places. For the base vertices there are
/// their points, to which `levels` and `sides` belong, and their names.
pub(crate) fn begin(
    (info, regions): (MtInfo, Option<Regions>),
    (base, [points, names]): (&Numbered, [&[u32]; 2]),
    marks: &[(u32, u8)],
    (levels, sides): (&[i32], &Sides),
    forest: Forest,
    block_bits: u32,
) -> Result<HalfEdgeBuilder, BuildError> {
    let Numbered { mesh, places, .. } = base;
    let mark = |(tet, &place): (&[u32; 4], &u32)| {
        let (remover, inner) = marks[place as usize];
        BaseMark { remover, inner: by_corner(inner, tet.map(|v| names[v as usize])) }
    };
    let marks = mesh.tets.iter().zip(places).map(mark).collect();
    let regions = regions.map(|regions| {
        let of_base: Vec<u16> = places.iter().map(|&place| regions.of_base[place as usize]).collect();
        let sides = match sides.is_empty() {
            true => regions.sides,
            false => base_sides(mesh, &of_base, points, (levels, sides)),
        };
        Regions { of_base, sides, ..regions }
    });
    Ok(HalfEdgeBuilder::new(info, mesh.clone(), marks, forest, regions, block_bits)?)
}

/// The point of each vertex of a base mesh.
pub(crate) fn points_of(base: &Numbered) -> Vec<u32> {
    let mut names = vec![NONE; base.mesh.positions.len()];
    let known = (0..).zip(&base.number).filter(|(_, v)| **v != NONE);
    known.for_each(|(point, &v): (u32, _)| names[v as usize] = point);
    names
}

/// How far one reference point is from another.
fn offset(positions: &[[i32; 3]], from: u32, to: u32) -> [i32; 3] {
    let [from, to] = [from, to].map(|point| positions[point as usize]);
    [0, 1, 2].map(|k| to[k] - from[k])
}

impl<'a> Appender<'a> {
    /// [Begins](begin) with the base mesh.
    pub fn new(
        described: (MtInfo, Option<Regions>),
        mut base: Numbered,
        updates: &Ordered<'a>,
        points: Points<'a>,
        block_bits: u32,
    ) -> Result<Self, BuildError> {
        let (positions, levels, sides) = points;
        let mut names = points_of(&base);
        names.extend(updates.vertices);
        for (v, &point) in (0..).zip(&names) {
            base.number[point as usize] = v;
        }
        let near: Vec<u32> = updates.near.iter().map(|&near| base.number[near as usize]).collect();
        let offset = |u: u32| offset(positions, updates.near[u as usize], updates.vertices[u as usize]);
        let forest = Forest::new(names.clone(), &near, offset);
        let mut builder =
            begin(described, (&base, [&names; 2]), updates.base_marks, (levels, sides), forest, block_bits)?;
        builder.make_room();
        Ok(Self { builder, near: updates.near, points, len: 0, number: base.number })
    }

    /// Appends the next update. `star` has for each tetrahedron that it inserts, in the order of their faces opposite the new vertex,
    /// what [`Ordered::base_marks`] has for one of the base mesh.
    pub fn push(
        &mut self,
        vertex: u32,
        errors: &[ErrorCode],
        star: impl Iterator<Item = (u32, u8)>,
    ) -> Result<(), BuildError> {
        let (positions, levels, sides) = self.points;
        let levels_of = |point: u32| &levels[point as usize * errors.len()..][..errors.len()];
        let sides: Vec<(u16, &[i32])> =
            sides.further(vertex).map(|(point, region)| (region as u16, levels_of(point))).collect();
        let near = self.near[self.len];
        self.len += 1;
        let (near, offset) = (self.number[near as usize], offset(positions, near, vertex));
        let next = NextUpdate { near, offset, levels: levels_of(vertex), sides: &sides, errors, faces: &[] };
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
