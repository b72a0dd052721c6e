//! One MT of the updates of all parts.
//!
//! Each node has ordered its own updates into blocks. They are numbered from the last node down to the parts, which extends the partial order, and
//! appended in this order, as for a whole. The mesh to which they are applied is never there as a whole: what is left of a node is all that its
//! own updates remove, a patch.

use super::PartsError;
use super::piece::{Made, Part, PartUpdates, Piece, Remover, RemoverCode, Sided, UpdateRows};
use super::plan::{Node, Plan};
use crate::decimate::append::{self, Ordered};
use crate::lattice::sides::Sides;
use crate::order::base::{Numbered, number_base};
use crate::{BuildError, BuildProgress, BuildResult, BuildSummary, OnProgress};
use std::collections::BTreeMap;
use std::ops::Range;
use tetralod::geom::lattice_box;
use tetralod::mesh::NONE;
use tetralod::mt::{
    BaseMark, BaseMesh, ErrorCode, Exact, FieldInfo, HalfEdgeBuilder, HalfEdgeMt, MtInfo, NextUpdate, Patch,
    VertexId, by_corner, further_regions,
};

/// Gives what has been made of a node.
type Of<'a, T> = &'a dyn Fn(Node) -> Result<T, PartsError>;

/// Makes the MT: `left` gives what is left of every node of the plan ([`Plan::nodes`]), that of the last one twice, and `updates` those of every
/// node, each twice. Updates are numbered coarse to fine: those of the last node first, those of the parts last, part after part.
///
/// # Errors
/// If what is given is not of the plan; the errors of `left` and `updates`; if `progress` stops the work.
pub fn assemble(
    plan: &Plan,
    left: Of<'_, Part>,
    updates: Of<'_, PartUpdates>,
    progress: OnProgress<'_>,
) -> Result<BuildResult, PartsError> {
    let whole = plan.nodes()[0];
    let piece = piece_of(plan, whole, left)?;
    if piece.points.len() != plan.counts[0] as usize {
        return Err(PartsError::Damaged { what: "it lacks points" });
    }
    let (assembly, values, summary) = Assembly::begin(plan, piece, updates)?;
    let (mt, number, depth) = assembly.append_all((left, updates), progress)?;
    let vertices: Vec<VertexId> = number.into_iter().map(VertexId).collect();
    let exact = exact(plan, &values, &vertices);
    let summary = BuildSummary { depth, ..summary };
    Ok(BuildResult { mt: mt.into(), summary, vertices, exact })
}

/// What is left of a node.
fn piece_of(plan: &Plan, node: Node, left: Of<'_, Part>) -> Result<Piece, PartsError> {
    let Part { head, piece } = left(node)?;
    if head.plan != *plan || head.node != node || !head.built {
        return Err(PartsError::OtherPlan);
    }
    let tets = piece.tets.len();
    if [piece.makers.len(), piece.inner.len()] != [tets; 2] {
        return Err(PartsError::Damaged { what: "its tetrahedra lack marks" });
    }
    Ok(piece)
}

/// What is wrong where tetrahedra have regions that the plan does not have.
const OTHER_REGIONS: &str = "its tetrahedra are of other regions";

/// The numbers of updates in the MT: level by level, and of each level first the whole blocks of its nodes, node after node, then what
/// is left over of each. So the blocks of the file are those into which each node has ordered its updates, but for the first node of
/// a level, which completes the last block of the level above.
struct Numbers {
    of_node: BTreeMap<Node, Span>,
}

/// The numbers of the updates of a node: so many from the first on, the rest from another one on.
#[derive(Clone, Copy)]
struct Span {
    count: u32,
    first: u32,
    in_blocks: u32,
    rest: u32,
}

impl Numbers {
    fn new(counts: &[(Node, u32)], block_bits: u32) -> Self {
        let block = 1 << block_bits;
        let mut of_node = BTreeMap::new();
        let mut next = 0;
        for level in counts.chunk_by(|a, b| a.0.level == b.0.level) {
            for &(node, count) in level {
                let lead = count.min((block - next % block) % block);
                let in_blocks = lead + (count - lead) / block * block;
                of_node.insert(node, Span { count, first: next, in_blocks, rest: 0 });
                next += in_blocks;
            }
            for (node, _) in level {
                if let Some(span) = of_node.get_mut(node) {
                    span.rest = next;
                    next += span.count - span.in_blocks;
                }
            }
        }
        Self { of_node }
    }

    fn span(&self, node: Node) -> Result<Span, PartsError> {
        self.of_node.get(&node).copied().ok_or(PartsError::OtherPlan)
    }

    /// The number of the update that removes what a maker of a piece has made; [`NONE`] for what is of the reference mesh.
    fn of_maker(&self, maker: u32, piece: &Piece) -> Result<u32, PartsError> {
        if maker == NONE { Ok(NONE) } else { self.of(piece.earlier[maker as usize]) }
    }

    /// The number of an update.
    fn of(&self, made: Made) -> Result<u32, PartsError> {
        let span = self.span(made.node)?;
        if made.update < span.count {
            Ok(span.of(made.update))
        } else {
            Err(PartsError::Damaged { what: "its updates refer to others" })
        }
    }
}

impl Span {
    fn of(self, update: u32) -> u32 {
        match update.checked_sub(self.in_blocks) {
            None => self.first + update,
            Some(over) => self.rest + over,
        }
    }
}

/// The vertices of all updates.
struct Listed {
    numbers: Numbers,
    vertices: Vec<u32>,
    near: Vec<u32>,
}

impl Listed {
    fn read(
        plan: &Plan,
        updates: &dyn Fn(Node) -> Result<PartUpdates, PartsError>,
    ) -> Result<Self, PartsError> {
        let mut of_nodes = Vec::new();
        for node in plan.nodes() {
            let PartUpdates { head, rows: UpdateRows { vertices, near, .. } } = updates(node)?;
            if head.plan != *plan || head.node != node {
                return Err(PartsError::OtherPlan);
            }
            of_nodes.push((node, vertices, near));
        }
        let counts: Vec<(Node, u32)> =
            of_nodes.iter().map(|(node, vertices, _)| (*node, vertices.len() as u32)).collect();
        let numbers = Numbers::new(&counts, plan.block_bits);
        let all = counts.iter().map(|(_, count)| *count as usize).sum();
        let (mut vertices, mut near) = (vec![NONE; all], vec![NONE; all]);
        for (node, own_vertices, own_near) in of_nodes {
            let span = numbers.span(node)?;
            for (u, (vertex, near_vertex)) in (0..).zip(own_vertices.into_iter().zip(own_near)) {
                let u = span.of(u) as usize;
                (vertices[u], near[u]) = (vertex, near_vertex);
            }
        }
        Ok(Self { numbers, vertices, near })
    }

    /// Checks that each point is in the base mesh or is inserted, by one update and next to a vertex that is there.
    fn check(&self, base: &Numbered) -> Result<(), PartsError> {
        let mut when: Vec<u32> = base.number.iter().map(|&v| if v == NONE { NONE } else { 0 }).collect();
        for (u, (&vertex, &near)) in (1..).zip(self.vertices.iter().zip(&self.near)) {
            let is_there = when.get(near as usize).is_some_and(|&when| when < u);
            match when.get_mut(vertex as usize) {
                Some(when) if *when == NONE && is_there => *when = u,
                _ => return Err(PartsError::Damaged { what: "its updates are those of other points" }),
            }
        }
        if when.contains(&NONE) {
            return Err(PartsError::Damaged { what: "updates are missing" });
        }
        Ok(())
    }
}

/// Reference vertices with their levels: vertex by vertex and field by field, and behind these those of their sides.
struct Vertices {
    levels: Vec<i32>,
    sides: Sides,
}

impl Vertices {
    /// Those of a piece, whose values it gives.
    fn of(plan: &Plan, info: &MtInfo, piece: &mut Piece) -> Self {
        let Sided { first, further, values: of_sides } = std::mem::take(&mut piece.sided);
        let level = |(&value, field): (&f64, &FieldInfo)| field.nearest(value);
        let all = piece.values.iter().chain(&of_sides);
        Self {
            levels: all.zip(info.fields.iter().cycle()).map(level).collect(),
            sides: Sides::new(plan.jumps(), first, further),
        }
    }

    /// The levels of a vertex, or of one of its sides.
    fn levels(&self, point: u32, fields: usize) -> &[i32] {
        &self.levels[point as usize * fields..][..fields]
    }

    /// The levels of a vertex in its further regions.
    fn further(&self, v: u32, fields: usize) -> Vec<(u16, &[i32])> {
        self.sides.further(v).map(|(side, region)| (region as u16, self.levels(side, fields))).collect()
    }
}

/// An MT to which updates are appended.
struct Assembly<'a> {
    plan: &'a Plan,
    info: MtInfo,
    builder: HalfEdgeBuilder,
    /// The MT's vertex for each reference vertex.
    number: Vec<u32>,
    numbers: Numbers,
    /// For each update the longest chain of updates that leads to it.
    depths: Vec<u32>,
    done: usize,
}

impl<'a> Assembly<'a> {
    /// With the base mesh, which is what is left of the whole. Returns the exact values, if some are to be kept, and what is known of the MT.
    fn begin(
        plan: &'a Plan,
        mut piece: Piece,
        updates: Of<'_, PartUpdates>,
    ) -> Result<(Self, Vec<f64>, BuildSummary), PartsError> {
        let listed = Listed::read(plan, updates)?;
        let mut info = plan.info();
        info.updates = listed.vertices.len() as u32;
        info.bounds = lattice_box(piece.positions.iter().copied());
        let vertices = Vertices::of(plan, &info, &mut piece);
        let numbered = number_base(&piece.positions, &vertices.levels, info.fields.len(), &piece.tets);
        let summary = BuildSummary::of(&info, &numbered.mesh, 0);
        listed.check(&numbered)?;
        let mut base_marks = Vec::with_capacity(piece.tets.len());
        for (&maker, &inner) in piece.makers.iter().zip(&piece.inner) {
            base_marks.push((listed.numbers.of_maker(maker, &piece)?, inner));
        }
        let ordered = Ordered { vertices: &listed.vertices, near: &listed.near, base_marks: &base_marks };
        let points = (&piece.positions[..], &vertices.levels[..], &vertices.sides);
        let unknown = PartsError::Damaged { what: OTHER_REGIONS };
        let regions = plan.regions.as_ref().map(|regions| regions.of_base(&piece.regions).ok_or(unknown));
        let described = (info.clone(), regions.transpose()?);
        let (builder, number) = append::begin(described, numbered, &ordered, points, plan.block_bits)?;
        let depths = vec![1; listed.vertices.len()];
        let is_lossless = plan.fields.iter().any(|field| field.lossless);
        let values = if is_lossless { piece.values } else { Vec::new() };
        Ok((Self { plan, info, builder, number, numbers: listed.numbers, depths, done: 0 }, values, summary))
    }

    /// Returns the MT, its vertex for each reference vertex, and the length of the longest chain of updates.
    fn append_all(
        mut self,
        (left, updates): (Of<'_, Part>, Of<'_, PartUpdates>),
        progress: OnProgress<'_>,
    ) -> Result<(HalfEdgeMt, Vec<u32>, u32), PartsError> {
        for level in self.plan.nodes().chunk_by(|a, b| a.level == b.level) {
            for &node in level {
                let piece = piece_of(self.plan, node, left)?;
                self.append_node(node, piece, updates(node)?.rows, progress)?;
            }
            self.builder.append_waiting().map_err(BuildError::from)?;
        }
        let depth = self.depths.into_iter().max().unwrap_or(0);
        Ok((self.builder.finish().map_err(BuildError::from)?, self.number, depth))
    }

    /// Appends the updates of a node to what is left of it: those that are left over from blocks come behind those of the other nodes of its level.
    fn append_node(
        &mut self,
        node: Node,
        mut piece: Piece,
        rows: UpdateRows,
        progress: OnProgress<'_>,
    ) -> Result<(), PartsError> {
        let Span { count, first, in_blocks, rest } = self.numbers.span(node)?;
        if rows.vertices.len() != count as usize {
            return Err(PartsError::OtherPlan);
        }
        let vertices = Vertices::of(self.plan, &self.info, &mut piece);
        let patch = self.patch(&piece, &vertices)?;
        self.builder.start_patch(&patch).map_err(BuildError::from)?;
        drop(patch);
        let reference = (&piece.points[..], &vertices);
        let (in_blocks, left_over) = rows.split(in_blocks as usize, self.info.fields.len());
        self.append(node, first, &in_blocks, reference, progress)?;
        if !left_over.vertices.is_empty() {
            self.builder.continue_later(rest).map_err(BuildError::from)?;
            self.append(node, rest, &left_over, reference, progress)?;
        }
        self.builder.end_patch(node.level == 0).map_err(BuildError::from)?;
        Ok(())
    }

    /// What is left of a node, as the MT knows it.
    fn patch(&self, piece: &Piece, vertices: &Vertices) -> Result<Patch, PartsError> {
        let fields = self.info.fields.len();
        let mut used: Vec<u32> = piece.tets.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let mut place = vec![NONE; piece.points.len()];
        (0..).zip(&used).for_each(|(at, &v)| place[v as usize] = at);
        let tets: Vec<[u32; 4]> = piece.tets.iter().map(|tet| tet.map(|v| place[v as usize])).collect();
        let mut marks = Vec::with_capacity(tets.len());
        for ((&maker, &inner), &tet) in piece.makers.iter().zip(&piece.inner).zip(&piece.tets) {
            let remover = self.numbers.of_maker(maker, piece)?;
            marks.push(BaseMark { remover, inner: by_corner(inner, tet) });
        }
        let number = |&region: &u32| u16::try_from(region).ok();
        let regions: Option<Vec<u16>> = piece.regions.iter().map(number).collect();
        let regions = regions.ok_or(PartsError::Damaged { what: OTHER_REGIONS })?;
        let mut values: Vec<i32> = used.iter().flat_map(|&v| vertices.levels(v, fields)).copied().collect();
        let mut side_levels = Vec::new();
        if !vertices.sides.is_empty() {
            let at =
                |v: u32, region: u16| vertices.levels(vertices.sides.point(v, u32::from(region)), fields);
            let mut first = vec![u16::MAX; used.len()];
            for (tet, &region) in tets.iter().zip(&regions) {
                tet.iter().for_each(|&v| first[v as usize] = region.min(first[v as usize]));
            }
            // What is the first region in the whole may have no tetrahedra here.
            values = used.iter().zip(first).flat_map(|(&v, region)| at(v, region)).copied().collect();
            let further = further_regions(used.len(), &tets, &regions).into_iter();
            side_levels = further.flat_map(|(v, region)| at(used[v as usize], region)).copied().collect();
        }
        let positions = used.iter().map(|&v| piece.positions[v as usize]).collect();
        let vertices = used.iter().map(|&v| self.number[piece.points[v as usize] as usize]).collect();
        Ok(Patch { mesh: BaseMesh { positions, values, tets }, vertices, marks, regions, side_levels })
    }

    /// Appends updates of a node, numbered from `first` on, given its reference vertices, which ascend.
    fn append(
        &mut self,
        node: Node,
        first: u32,
        rows: &UpdateRows,
        (points, vertices): (&[u32], &Vertices),
        progress: OnProgress<'_>,
    ) -> Result<(), PartsError> {
        let Self { builder, numbers, depths, done, info, .. } = self;
        let earlier = rows.earlier.iter().map(|&made| numbers.of(made)).collect::<Result<Vec<u32>, _>>()?;
        let (own, fields) = (numbers.span(node)?, info.fields.len());
        let mut star = 0;
        for (i, (number, errors)) in (first as usize..).zip(rows.errors.chunks(fields)).enumerate() {
            BuildProgress::tell_ordered(*done, depths.len(), progress)?;
            let inserted: Range<usize> = star..star + usize::from(rows.stars[i]);
            let removers = rows.removers[inserted.clone()].iter().map(|&code| remover(code, own, &earlier));
            for below in removers.clone().filter(|&remover| remover != NONE) {
                let depth = depths[number] + 1;
                match depths.get_mut(below as usize) {
                    Some(of_child) if below as usize > number => *of_child = (*of_child).max(depth),
                    _ => return Err(PartsError::Damaged { what: "its updates are out of order" }),
                }
            }
            let errors: Vec<ErrorCode> = errors.iter().copied().map(ErrorCode).collect();
            let inner = rows.inner[inserted.clone()].iter().copied();
            let unknown = PartsError::Damaged { what: "its updates are those of other points" };
            let vertex = points.binary_search(&rows.vertices[i]).map_err(|_| unknown)? as u32;
            let sides = vertices.further(vertex, fields);
            let levels = vertices.levels(vertex, fields);
            let next = NextUpdate { levels, sides: &sides, errors: &errors, faces: &[] };
            builder.push(&next, removers.zip(inner)).map_err(BuildError::from)?;
            star = inserted.end;
            *done += 1;
        }
        Ok(())
    }
}

/// The number in the MT of what removes a tetrahedron; [`NONE`] if nothing does.
fn remover(code: RemoverCode, own: Span, earlier: &[u32]) -> u32 {
    match code.into() {
        Remover::Nothing => NONE,
        Remover::Own(update) => own.of(update),
        Remover::Earlier(place) => earlier[place as usize],
    }
}

/// The exact values of the lossless fields.
fn exact(plan: &Plan, values: &[f64], vertices: &[VertexId]) -> Vec<Exact> {
    let fields = plan.fields.len();
    let lossless = (0..fields).filter(|&f| plan.fields[f].lossless);
    let of = |f: usize| {
        let own = values.iter().skip(f).step_by(fields).copied();
        Exact::new(f, vertices.iter().copied().zip(own).collect())
    };
    lossless.map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetralod::mt::BaseMesh;

    #[test]
    fn every_update_has_one_number_and_nodes_begin_with_blocks() {
        let node = |level: u32, index: u32| Node { level, index };
        let counts = [(node(1, 0), 37), (node(0, 0), 50), (node(0, 1), 5), (node(0, 2), 0), (node(0, 3), 90)];
        let numbers = Numbers::new(&counts, 4);
        let mut seen = vec![false; counts.iter().map(|(_, count)| *count as usize).sum()];
        for (node, count) in counts {
            for update in 0..count {
                let number = numbers.of(Made { node, update }).expect("a number") as usize;
                assert!(!std::mem::replace(&mut seen[number], true), "{node:?} {update}");
            }
            assert!(numbers.of(Made { node, update: count }).is_err());
        }
        assert!(!seen.contains(&false));
        // The levels follow one another; what is left over comes last.
        let first = |level, index| numbers.of(Made { node: node(level, index), update: 0 }).ok();
        assert_eq!((first(1, 0), first(0, 0)), (Some(0), Some(37)));
        assert_eq!(first(0, 3).map(|first| first % 16), Some(0));
        assert!(numbers.of(Made { node: node(0, 4), update: 0 }).is_err());
    }

    #[test]
    fn points_are_inserted_once_each_and_next_to_one_that_is_there() {
        // Points 0 and 1 are in the base mesh.
        let base =
            || Numbered { mesh: BaseMesh::default(), number: vec![0, 1, NONE, NONE], places: Vec::new() };
        let check = |vertices: [u32; 2], near: [u32; 2]| {
            Listed { numbers: Numbers::new(&[], 4), vertices: vertices.to_vec(), near: near.to_vec() }
                .check(&base())
        };
        assert!(check([2, 3], [0, 2]).is_ok());
        assert!(check([3, 2], [1, 3]).is_ok());
        for (vertices, near) in
            [([2, 3], [3, 2]), ([2, 3], [2, 0]), ([2, 2], [0, 1]), ([2, 1], [0, 0]), ([2, 4], [0, 0])]
        {
            assert!(check(vertices, near).is_err(), "{vertices:?} next to {near:?}");
        }
    }
}
