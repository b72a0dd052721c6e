//! One MT of the updates of all parts.
//!
//! Each node has ordered its own updates into blocks. They are numbered from the last node down to the parts, which extends the partial order, and
//! appended one by one, as for a whole.

use super::PartsError;
use super::piece::{Made, Part, PartUpdates, Remover, RemoverCode, Sided, UpdateRows};
use super::plan::{Node, Plan};
use crate::decimate::append::{Appender, Ordered};
use crate::lattice::sides::Sides;
use crate::order::base::{Numbered, number_base};
use crate::{BuildProgress, BuildResult, BuildSummary, OnProgress};
use std::collections::BTreeMap;
use std::ops::Range;
use tetralod::geom::lattice_box;
use tetralod::mesh::NONE;
use tetralod::mt::{ErrorCode, Exact, FieldInfo, VertexId};

/// Makes the MT: `whole` is what is left of the last node, and `updates` gives those of every node ([`Plan::nodes`]), each twice. They
/// are numbered coarse to fine: those of the last node first, those of the parts last, part after part.
///
/// # Errors
/// If `whole` is of another node, or the updates are not those of its plan; those of `updates`; if `progress` stops the work.
pub fn assemble(
    whole: Part,
    updates: &dyn Fn(Node) -> Result<PartUpdates, PartsError>,
    progress: OnProgress<'_>,
) -> Result<BuildResult, PartsError> {
    let Part { head, piece } = whole;
    let plan = head.plan;
    if !head.built || !plan.is_whole(head.node) {
        return Err(PartsError::Damaged { what: "it is not the last one to be joined" });
    }
    let points = plan.counts[0] as usize;
    if piece.points.len() != points {
        return Err(PartsError::Damaged { what: "it lacks points" });
    }
    let listed = Listed::read(&plan, updates)?;
    let mut info = plan.info();
    info.updates = listed.vertices.len() as u32;
    info.bounds = lattice_box(piece.positions.iter().copied());
    let level = |(&value, field): (&f64, &FieldInfo)| field.nearest(value);
    let Sided { first, further, values: of_sides } = piece.sided;
    let all = piece.values.iter().chain(&of_sides);
    let levels: Vec<i32> = all.zip(info.fields.iter().cycle()).map(level).collect();
    let numbered = number_base(&piece.positions, &levels, info.fields.len(), &piece.tets);
    let summary = BuildSummary::of(&info, &numbered.mesh, 0);
    listed.check(&numbered)?;
    let mut base_marks = Vec::with_capacity(piece.tets.len());
    for (&maker, &inner) in piece.makers.iter().zip(&piece.inner) {
        let remover = if maker == NONE { NONE } else { listed.numbers.of(piece.earlier[maker as usize])? };
        base_marks.push((remover, inner));
    }
    let ordered = Ordered { vertices: &listed.vertices, near: &listed.near, base_marks: &base_marks };
    let sides = Sides::new(plan.jumps(), first, further);
    let reference = (&piece.positions[..], &levels[..], &sides);
    let unknown = PartsError::Damaged { what: "its tetrahedra are of other regions" };
    let regions = plan.regions.as_ref().map(|regions| regions.of_base(&piece.regions).ok_or(unknown));
    let described = (info.clone(), regions.transpose()?);
    let appender = Appender::new(described, numbered, &ordered, reference, plan.block_bits)?;
    let Listed { numbers, vertices, .. } = listed;
    let depths = vec![1; vertices.len()];
    drop(vertices);
    // Of the piece only the exact values may still be needed.
    let values = piece.values;
    let values = if plan.fields.iter().any(|field| field.lossless) { values } else { Vec::new() };
    let mut assembly = Assembly { appender, numbers, depths, fields: info.fields.len(), done: 0 };
    assembly.append_all(&plan, updates, progress)?;
    let depth = assembly.depths.into_iter().max().unwrap_or(0);
    let (mt, vertices) = assembly.appender.finish()?;
    let exact = exact(&plan, &values, &vertices);
    let summary = BuildSummary { depth, ..summary };
    Ok(BuildResult { mt: mt.into(), summary, vertices, exact })
}

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

/// An MT to which updates are appended.
struct Assembly<'a> {
    appender: Appender<'a>,
    numbers: Numbers,
    /// For each update the longest chain of updates that leads to it.
    depths: Vec<u32>,
    fields: usize,
    done: usize,
}

impl Assembly<'_> {
    fn append_all(
        &mut self,
        plan: &Plan,
        updates: &dyn Fn(Node) -> Result<PartUpdates, PartsError>,
        progress: OnProgress<'_>,
    ) -> Result<(), PartsError> {
        for level in plan.nodes().chunk_by(|a, b| a.level == b.level) {
            let mut left_over = Vec::new();
            for &node in level {
                let rows = updates(node)?.rows;
                let Span { count, in_blocks, .. } = self.numbers.span(node)?;
                if rows.vertices.len() != count as usize {
                    return Err(PartsError::OtherPlan);
                }
                let (in_blocks, rest) = rows.split(in_blocks as usize, self.fields);
                self.append(node, &in_blocks, progress)?;
                left_over.push((node, rest));
            }
            for (node, rows) in left_over {
                self.append(node, &rows, progress)?;
            }
        }
        Ok(())
    }

    /// Appends updates of a node, which come next.
    fn append(&mut self, node: Node, rows: &UpdateRows, progress: OnProgress<'_>) -> Result<(), PartsError> {
        let Self { appender, numbers, depths, fields, done } = self;
        let earlier = rows.earlier.iter().map(|&made| numbers.of(made)).collect::<Result<Vec<u32>, _>>()?;
        let own = numbers.span(node)?;
        let mut star = 0;
        for (i, errors) in rows.errors.chunks(*fields).enumerate() {
            BuildProgress::tell_ordered(*done, depths.len(), progress)?;
            let inserted: Range<usize> = star..star + usize::from(rows.stars[i]);
            let removers = rows.removers[inserted.clone()].iter().map(|&code| remover(code, own, &earlier));
            for below in removers.clone().filter(|&remover| remover != NONE) {
                let depth = depths[*done] + 1;
                match depths.get_mut(below as usize) {
                    Some(of_child) if below as usize > *done => *of_child = (*of_child).max(depth),
                    _ => return Err(PartsError::Damaged { what: "its updates are out of order" }),
                }
            }
            let errors: Vec<ErrorCode> = errors.iter().copied().map(ErrorCode).collect();
            let inner = rows.inner[inserted.clone()].iter().copied();
            appender.push(rows.vertices[i], &errors, removers.zip(inner))?;
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
