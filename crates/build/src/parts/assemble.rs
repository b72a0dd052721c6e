//! One MT of the updates of all parts.
//!
//! Each node has ordered its own updates into blocks. They are numbered from the last node down to the parts, which extends the partial order, and
//! appended in this order, as for a whole. The mesh to which they are applied is never there as a whole: what is left of a node is all that its
//! own updates remove, a patch. Nor is the MT, unless it is asked for: whole blocks are taken as they come, and which updates there are beside which
//! vertex is kept in the scratch, and so are the number of each vertex and exact values. In memory is one node, and what upper levels have of errors.
//!
//! ```text
//!     updates of all nodes ──▶ what each inserts, beside which vertex ──▶ by vertices, in the scratch
//!                                                                                 │ of the vertices of a patch
//!     node: what is left ──▶ patch ─────────────────────────┐                     ▼
//!           its updates ────────────────────────────▶ HalfEdgeBuilder ──▶ blocks, taken
//! ```

use super::PartsError;
use super::children::{ChildSorter, Children};
use super::exact_values::ExactInScratch;
use super::piece::{Made, Part, PartUpdates, Piece, Remover, RemoverCode, Sided, UpdateRows};
use super::plan::{Node, Plan};
use crate::decimate::append;
use crate::lattice::sides::Sides;
use crate::order::base::number_base;
use crate::scratch::{InMemory, Scratch};
use crate::{BuildError, BuildProgress, BuildResult, BuildSummary, OnProgress};
use std::collections::BTreeMap;
use std::ops::Range;
use tetralod::mesh::NONE;
use tetralod::mt::{
    BaseMark, BaseMesh, ErrorCode, FieldInfo, Forest, ForestChild, HalfEdgeBuilder, MtInfo, NextUpdate,
    Patch, VertexId, by_corner, further_regions,
};

/// Gives what has been made of a node.
type Of<'a, T> = &'a dyn Fn(Node) -> Result<T, PartsError>;

/// Is called when more updates have come, and may take whole blocks out of the builder.
type OnBlocks<'a> = &'a mut dyn FnMut(&mut HalfEdgeBuilder) -> Result<(), PartsError>;

/// What [`assemble_blocks`] has made.
pub struct Assembled<'a> {
    /// With all updates, of which blocks may have been taken.
    #[doc(hidden)]
    pub builder: HalfEdgeBuilder,
    /// What is known of the MT.
    pub summary: BuildSummary,
    /// The exact values of lossless fields.
    #[doc(hidden)]
    pub exact: ExactInScratch<'a>,
}

/// Makes the MT: `left` gives what is left of every node of the plan ([`Plan::nodes`]), that of the last one several times, and `updates` those of
/// every node, each twice. Updates are numbered coarse to fine: those of the last node first, those of the parts last, part after part.
///
/// # Errors
/// If what is given is not of the plan; the errors of `left` and `updates`; if `progress` stops the work.
pub fn assemble(
    plan: &Plan,
    left: Of<'_, Part<'_>>,
    updates: Of<'_, PartUpdates>,
    progress: OnProgress<'_>,
) -> Result<BuildResult, PartsError> {
    let scratch = InMemory::default();
    let (made, numbers) = assembled(plan, (left, updates), &scratch, &mut |_| Ok(()), progress)?;
    let Assembled { builder, summary, exact } = made;
    let mt = builder.finish().map_err(BuildError::from)?;
    let vertices: Vec<VertexId> = numbers.all()?.into_iter().map(VertexId).collect();
    let exact = exact.tables(u32::MAX).collect::<Result<_, _>>()?;
    Ok(BuildResult { mt: mt.into(), summary, vertices, exact })
}

/// [`assemble`], whose blocks `take` may take when they are whole; `scratch` has what is not kept in memory. Of parts it needs no more than
/// [`Part::read_mesh`] reads.
///
/// # Errors
/// As [`assemble`], and those of `take`.
pub fn assemble_blocks<'a>(
    plan: &'a Plan,
    (left, updates): (Of<'_, Part<'_>>, Of<'_, PartUpdates>),
    scratch: &'a dyn Scratch,
    take: OnBlocks<'_>,
    progress: OnProgress<'_>,
) -> Result<Assembled<'a>, PartsError> {
    let (made, numbers) = assembled(plan, (left, updates), scratch, take, progress)?;
    numbers.remove()?;
    Ok(made)
}

/// [`assemble_blocks`], and the MT's vertex for each reference vertex.
fn assembled<'a>(
    plan: &'a Plan,
    (left, updates): (Of<'_, Part<'_>>, Of<'_, PartUpdates>),
    scratch: &'a dyn Scratch,
    take: OnBlocks<'_>,
    progress: OnProgress<'_>,
) -> Result<(Assembled<'a>, VertexNumbers<'a>), PartsError> {
    let listed = Listed::read(plan, updates, scratch)?;
    let (assembly, summary) = Assembly::begin(plan, piece_of(plan, plan.nodes()[0], left)?, listed)?;
    let Assembly { builder, vertices, exact, .. } = assembly.append_all((left, updates), take, progress)?;
    let summary = BuildSummary { depth: builder.depth(), ..summary };
    Ok((Assembled { builder, summary, exact }, vertices))
}

/// What is left of a node, without what only joins need.
fn piece_of(plan: &Plan, node: Node, left: Of<'_, Part<'_>>) -> Result<Piece, PartsError> {
    let Part { head, mut piece, .. } = left(node)?;
    if head.plan != *plan || head.node != node || !head.built {
        return Err(PartsError::OtherPlan);
    }
    let tets = piece.tets.len();
    if [piece.makers.len(), piece.inner.len()] != [tets; 2] {
        return Err(PartsError::Damaged { what: "its tetrahedra lack marks" });
    }
    piece.keep_mesh(plan.fields.len());
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

/// The updates of all nodes: what each inserts is in the scratch.
struct Listed<'a> {
    numbers: Numbers,
    nodes: Vec<(Node, u32)>,
    scratch: &'a dyn Scratch,
}

/// Bytes of what the scratch has of an update: the reference vertex that it inserts, the one near to it, and how far that is.
const LISTED: usize = 20;

/// So many updates are read at a time.
const AT_A_TIME: u32 = 1 << 16;

/// The name under which they are kept.
const UPDATES: &str = "updates";

impl<'a> Listed<'a> {
    fn read(plan: &Plan, updates: Of<'_, PartUpdates>, scratch: &'a dyn Scratch) -> Result<Self, PartsError> {
        let mut nodes = Vec::new();
        scratch.write(UPDATES, &[])?;
        for node in plan.nodes() {
            let PartUpdates { head, rows: UpdateRows { vertices, near, offsets, .. } } = updates(node)?;
            if head.plan != *plan || head.node != node {
                return Err(PartsError::OtherPlan);
            }
            let mut bytes = Vec::with_capacity(LISTED * vertices.len());
            for ((vertex, near), [x, y, z]) in vertices.iter().zip(near).zip(offsets) {
                let numbers = [*vertex, near, x as u32, y as u32, z as u32];
                numbers.iter().for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
            }
            scratch.append(UPDATES, &bytes)?;
            nodes.push((node, vertices.len() as u32));
        }
        // Each inserts a point of its own: so their numbers have 32 bits.
        let all: u64 = nodes.iter().map(|(_, count)| u64::from(*count)).sum();
        if all > plan.counts.0.into() {
            return Err(PartsError::Damaged { what: OTHER_POINTS });
        }
        Ok(Self { numbers: Numbers::new(&nodes, plan.block_bits), nodes, scratch })
    }

    /// How many updates there are.
    fn len(&self) -> u32 {
        self.nodes.iter().map(|(_, count)| count).sum()
    }

    /// Passes on each update: its number, the two reference vertices, and how far one is from the other.
    fn each(
        &self,
        mut pass: impl FnMut(u32, [u32; 2], [i32; 3]) -> Result<(), PartsError>,
    ) -> Result<(), PartsError> {
        let mut at = 0;
        for &(node, count) in &self.nodes {
            let span = self.numbers.span(node)?;
            for first in (0..count).step_by(AT_A_TIME as usize) {
                let some = AT_A_TIME.min(count - first);
                let mut bytes = vec![0; LISTED * some as usize];
                self.scratch.read_at(UPDATES, at, &mut bytes)?;
                at += bytes.len() as u64;
                let (words, _) = bytes.as_chunks::<4>();
                let (rows, _) = words.as_chunks::<{ LISTED / 4 }>();
                for (update, row) in (first..).zip(rows) {
                    let [vertex, near, x, y, z] = row.map(u32::from_le_bytes);
                    pass(span.of(update), [vertex, near], [x, y, z].map(|d| d as i32))?;
                }
            }
        }
        Ok(())
    }

    /// Enters the MT's vertex for each reference vertex, given those of so many base vertices, and sorts the updates by their near vertices. Each
    /// point must be in the base mesh or be inserted, by one update and next to a vertex that is there.
    fn number(&self, number: &mut [u32], base: u32) -> Result<Children<'a>, PartsError> {
        if u64::from(base) + u64::from(self.len()) > number.len() as u64 {
            return Err(PartsError::Damaged { what: OTHER_POINTS });
        }
        self.each(|update, [vertex, _], _| match number.get_mut(vertex as usize) {
            Some(number) if *number == NONE => {
                *number = base + update;
                Ok(())
            }
            _ => Err(PartsError::Damaged { what: OTHER_POINTS }),
        })?;
        if number.contains(&NONE) {
            return Err(PartsError::Damaged { what: "updates are missing" });
        }
        let mut sorter = ChildSorter::new(self.scratch, base + self.len());
        self.each(|update, [_, near], offset| match number.get(near as usize) {
            Some(&near) if near < base + update => Ok(sorter.put(near, ForestChild { update, offset })?),
            _ => Err(PartsError::Damaged { what: OTHER_POINTS }),
        })?;
        self.scratch.remove(UPDATES)?;
        Ok(sorter.finish()?)
    }
}

/// What is wrong where updates do not go with the points.
const OTHER_POINTS: &str = "its updates are those of other points";

/// The MT's vertex for each reference vertex: in the scratch, for there are as many as points.
struct VertexNumbers<'a> {
    scratch: &'a dyn Scratch,
    count: u32,
}

/// Under this name.
const VERTICES: &str = "vertices";

impl<'a> VertexNumbers<'a> {
    fn keep(scratch: &'a dyn Scratch, numbers: Vec<u32>) -> Result<Self, PartsError> {
        scratch.write(VERTICES, &[])?;
        for some in numbers.chunks(AT_A_TIME as usize) {
            let bytes: Vec<u8> = some.iter().flat_map(|number| number.to_le_bytes()).collect();
            scratch.append(VERTICES, &bytes)?;
        }
        Ok(Self { scratch, count: numbers.len() as u32 })
    }

    /// Those of some reference vertices, each of which may come several times.
    fn of<'p>(&self, points: impl Iterator<Item = &'p u32>) -> Result<KnownNumbers, PartsError> {
        let mut points: Vec<u32> = points.copied().collect();
        points.sort_unstable();
        points.dedup();
        if points.last().is_some_and(|&last| last >= self.count) {
            return Err(PartsError::Damaged { what: OTHER_POINTS });
        }
        let mut numbers = Vec::with_capacity(points.len());
        let mut rest = &points[..];
        while let Some(&first) = rest.first() {
            let (some, others) = rest.split_at(rest.partition_point(|&point| point - first < AT_A_TIME));
            let last = some.last().copied().unwrap_or(first);
            let read = self.read(first..last + 1)?;
            numbers.extend(some.iter().map(|&point| read[(point - first) as usize]));
            rest = others;
        }
        Ok(KnownNumbers { points, numbers })
    }

    fn all(self) -> Result<Vec<u32>, PartsError> {
        let numbers = self.read(0..self.count)?;
        self.remove()?;
        Ok(numbers)
    }

    fn read(&self, points: Range<u32>) -> Result<Vec<u32>, PartsError> {
        let mut bytes = vec![0; 4 * points.len()];
        self.scratch.read_at(VERTICES, 4 * u64::from(points.start), &mut bytes)?;
        Ok(bytes.as_chunks::<4>().0.iter().map(|number| u32::from_le_bytes(*number)).collect())
    }

    fn remove(self) -> Result<(), PartsError> {
        Ok(self.scratch.remove(VERTICES)?)
    }
}

/// Some of them.
struct KnownNumbers {
    /// Ascending.
    points: Vec<u32>,
    numbers: Vec<u32>,
}

impl KnownNumbers {
    /// The MT's vertex for a reference vertex, which is among them; [`NONE`] if it is not.
    fn of(&self, point: u32) -> u32 {
        self.points.binary_search(&point).map_or(NONE, |at| self.numbers[at])
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
    vertices: VertexNumbers<'a>,
    numbers: Numbers,
    children: Children<'a>,
    exact: ExactInScratch<'a>,
    done: usize,
}

impl<'a> Assembly<'a> {
    /// With the base mesh, which is what is left of the whole. Returns what is known of the MT, too.
    fn begin(
        plan: &'a Plan,
        mut piece: Piece,
        listed: Listed<'a>,
    ) -> Result<(Self, BuildSummary), PartsError> {
        let mut info = plan.info();
        info.updates = listed.len();
        info.bounds = Some([[0; 3], plan.sides]);
        let vertices = Vertices::of(plan, &info, &mut piece);
        let numbered = number_base(&piece.positions, &vertices.levels, info.fields.len(), &piece.tets);
        let summary = BuildSummary::of(&info, &numbered.mesh, 0);
        let base = numbered.mesh.positions.len() as u32;
        let mut number = vec![NONE; plan.counts.0 as usize];
        for (&point, &v) in piece.points.iter().zip(&numbered.number) {
            number[point as usize] = v;
        }
        let children = listed.number(&mut number, base)?;
        let mut base_marks = Vec::with_capacity(piece.tets.len());
        for (&maker, &inner) in piece.makers.iter().zip(&piece.inner) {
            base_marks.push((listed.numbers.of_maker(maker, &piece)?, inner));
        }
        let labels: Vec<u32> = (0..base).collect();
        let (starts, of_base) = children.of(&labels)?;
        let places = append::points_of(&numbered);
        let names: Vec<u32> = places.iter().map(|&at| piece.points[at as usize]).collect();
        let lossless = (0..info.fields.len()).filter(|&f| plan.fields[f].lossless).collect();
        let mut exact = ExactInScratch::new(listed.scratch, lossless, plan.counts.0);
        exact.put(0, rows_of(&piece.values, info.fields.len(), &places))?;
        let forest = Forest::of(&labels, names.clone(), starts, of_base);
        let unknown = PartsError::Damaged { what: OTHER_REGIONS };
        let regions = plan.regions.as_ref().map(|regions| regions.of_base(&piece.regions).ok_or(unknown));
        let described = (info.clone(), regions.transpose()?);
        let points = (&vertices.levels[..], &vertices.sides);
        let base = (&numbered, [&places[..], &names]);
        let builder = append::begin(described, base, &base_marks, points, forest, plan.block_bits)?;
        let vertices = VertexNumbers::keep(listed.scratch, number)?;
        let numbers = listed.numbers;
        Ok((Self { plan, info, builder, vertices, numbers, children, exact, done: 0 }, summary))
    }

    /// Appends all updates.
    fn append_all(
        mut self,
        (left, updates): (Of<'_, Part<'_>>, Of<'_, PartUpdates>),
        take: OnBlocks<'_>,
        progress: OnProgress<'_>,
    ) -> Result<Self, PartsError> {
        for level in self.plan.nodes().chunk_by(|a, b| a.level == b.level) {
            for &node in level {
                let piece = piece_of(self.plan, node, left)?;
                self.append_node(node, piece, updates(node)?.rows, progress)?;
                take(&mut self.builder)?;
            }
            self.builder.append_waiting().map_err(BuildError::from)?;
            take(&mut self.builder)?;
        }
        self.children.remove()?;
        Ok(self)
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
        let known = self.vertices.of(piece.points.iter().chain(&rows.vertices).chain(&rows.near))?;
        let patch = self.patch(&piece, &vertices, &rows, &known)?;
        self.builder.start_patch(patch).map_err(BuildError::from)?;
        let Piece { points, values, .. } = piece;
        let values = if self.exact.is_empty() { Vec::new() } else { values };
        let reference = (&points[..], &values[..], &vertices, &known);
        let (in_blocks, left_over) = rows.split(in_blocks as usize, self.info.fields.len());
        self.append(node, first, &in_blocks, reference, progress)?;
        if !left_over.vertices.is_empty() {
            self.builder.continue_later(rest).map_err(BuildError::from)?;
            self.append(node, rest, &left_over, reference, progress)?;
        }
        self.builder.end_patch(node.level == 0).map_err(BuildError::from)?;
        Ok(())
    }

    /// The forest of a patch: of its vertices and of those that are inserted into it, all of which are reference vertices.
    fn forest(
        &self,
        vertices: impl Iterator<Item = u32>,
        known: &KnownNumbers,
    ) -> Result<Forest, PartsError> {
        let mut named: Vec<(u32, u32)> = vertices.map(|point| (known.of(point), point)).collect();
        named.sort_unstable();
        named.dedup();
        let (labels, names): (Vec<u32>, Vec<u32>) = named.into_iter().unzip();
        let (starts, children) = self.children.of(&labels)?;
        Ok(Forest::of(&labels, names, starts, children))
    }

    /// What is left of a node, as the MT knows it; `rows` are the node's updates.
    fn patch(
        &self,
        piece: &Piece,
        vertices: &Vertices,
        rows: &UpdateRows,
        known: &KnownNumbers,
    ) -> Result<Patch, PartsError> {
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
        let of_patch = used.iter().map(|&v| piece.points[v as usize]).chain(rows.vertices.iter().copied());
        let forest = self.forest(of_patch, known)?;
        // What is left of the node is removed but for what is of the reference mesh.
        let stays = |code: &&RemoverCode| !matches!(Remover::from(**code), Remover::Own(_));
        let stay = marks.iter().filter(|mark| mark.remover == NONE).count();
        let room = [used.len() + rows.vertices.len(), stay + rows.removers.iter().filter(stays).count()];
        let positions = used.iter().map(|&v| piece.positions[v as usize]).collect();
        let vertices = used.iter().map(|&v| known.of(piece.points[v as usize])).collect();
        Ok(Patch {
            mesh: BaseMesh { positions, values, tets },
            vertices,
            forest,
            marks,
            regions,
            side_levels,
            room,
        })
    }

    /// Appends updates of a node, numbered from `first` on, given its reference vertices, which ascend, and their values if some are kept exactly.
    fn append(
        &mut self,
        node: Node,
        first: u32,
        rows: &UpdateRows,
        (points, values, vertices, known): (&[u32], &[f64], &Vertices, &KnownNumbers),
        progress: OnProgress<'_>,
    ) -> Result<(), PartsError> {
        let Self { builder, numbers, exact, done, info, .. } = self;
        let earlier = rows.earlier.iter().map(|&made| numbers.of(made)).collect::<Result<Vec<u32>, _>>()?;
        let (own, fields) = (numbers.span(node)?, info.fields.len());
        let place = |point: &u32| points.binary_search(point).map(|place| place as u32);
        let places = rows.vertices.iter().map(place).collect::<Result<Vec<u32>, _>>();
        let places = places.map_err(|_| PartsError::Damaged { what: OTHER_POINTS })?;
        let base = self.plan.counts.0 - info.updates;
        exact.put(base + first, rows_of(values, fields, &places))?;
        let mut star = 0;
        for (i, (number, errors)) in (first as usize..).zip(rows.errors.chunks(fields)).enumerate() {
            BuildProgress::tell_ordered(*done, info.updates as usize, progress)?;
            let inserted: Range<usize> = star..star + usize::from(rows.stars[i]);
            let removers = rows.removers[inserted.clone()].iter().map(|&code| remover(code, own, &earlier));
            if removers.clone().any(|remover| remover as usize <= number) {
                return Err(PartsError::Damaged { what: "its updates are out of order" });
            }
            let errors: Vec<ErrorCode> = errors.iter().copied().map(ErrorCode).collect();
            let inner = rows.inner[inserted.clone()].iter().copied();
            let vertex = places[i];
            let sides = vertices.further(vertex, fields);
            let levels = vertices.levels(vertex, fields);
            let (near, offset) = (known.of(rows.near[i]), rows.offsets[i]);
            let next = NextUpdate { near, offset, levels, sides: &sides, errors: &errors, faces: &[] };
            builder.push(&next, removers.zip(inner)).map_err(BuildError::from)?;
            star = inserted.end;
            *done += 1;
        }
        Ok(())
    }
}

/// The values of all fields at some points.
fn rows_of<'v>(
    values: &'v [f64],
    fields: usize,
    places: &'v [u32],
) -> impl Iterator<Item = &'v [f64]> + Clone {
    places.iter().map(move |&place| &values[place as usize * fields..][..fields])
}

/// The number in the MT of what removes a tetrahedron; [`NONE`] if nothing does.
fn remover(code: RemoverCode, own: Span, earlier: &[u32]) -> u32 {
    match code.into() {
        Remover::Nothing => NONE,
        Remover::Own(update) => own.of(update),
        Remover::Earlier(place) => earlier[place as usize],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let check = |vertices: [u32; 2], near: [u32; 2]| {
            let nodes = vec![(Node { level: 0, index: 0 }, 2)];
            let scratch = InMemory::default();
            let rows = [vertices[0], near[0], 0, 0, 0, vertices[1], near[1], 0, 0, 0];
            scratch.write(UPDATES, &rows.map(u32::to_le_bytes).concat()).expect("room");
            let listed = Listed { numbers: Numbers::new(&nodes, 4), nodes, scratch: &scratch };
            listed.number(&mut [0, 1, NONE, NONE], 2).map(drop)
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
