//! One step: the mesh of a part, or of several that are joined, is simplified as far as its place in the whole allows.
//!
//! A part is decimated like a whole, but for its open vertices, and until an eighth of its tetrahedra is left.

use super::PartsError;
use super::piece::{Carried, Head, Made, Part, PartUpdates, Piece, Remover, RemoverCode, Sided, UpdateRows};
use super::plan::{Node, Plan};
use crate::change::work_mesh::{ELSEWHERE, WorkMesh};
use crate::decimate::candidate_queue::Levels;
use crate::decimate::collapses::{Collapse, Collapses};
use crate::decimate::removal::{History, State};
use crate::decimate::{Decimator, Record};
use crate::error::boundary_distance::BoundaryDistance;
use crate::error::fill_cost::Removals;
use crate::error::points::as_vec;
use crate::error::reference::{Buckets, Reference};
use crate::lattice::places::Places;
use crate::lattice::quantize::Quantized;
use crate::lattice::sides::Sides;
use crate::order::reach::{self, Reach};
use crate::restrict::restrictions::Restrictions;
use crate::{BuildError, BuildProgress, OnProgress};
use glam::DVec3;
use std::collections::BTreeMap;
use std::mem::take;
use std::sync::Arc;
use tetralod::mesh::{NONE, Topology, boundary_faces, growth_order, topology};
use tetralod::mt::{ErrorCode, MtInfo};

/// A step ends when about so much of its tetrahedra is left: as many of these are joined.
const LEFT: usize = 8;

/// Or when so many are left for each triangle that it shares with other parts. These triangles stay, and so do the tetrahedra at them: to
/// get below, all other vertices would be removed, whatever the error is. On 97³ in 64 parts, meshes within 1 % have 527 816 tetrahedra
/// without this, 327 843 with 4 for each, 276 579 with 8; as a whole they have 281 157.
pub(crate) const LEFT_AT_INTERFACE: usize = 8;

/// Builds a part on its own: returns what is left, and the updates.
///
/// # Errors
/// If the part has been built already, or its mesh is not valid; if `progress` stops the work.
pub fn build_part(part: Part, progress: OnProgress<'_>) -> Result<(Part, PartUpdates), PartsError> {
    let Part { head, piece } = part;
    if head.built || head.node.level > 0 {
        return Err(PartsError::Damaged { what: "it has been built already" });
    }
    run(head, piece, progress)
}

/// Joins what is left of the parts of a node, in their order, and simplifies what was between them: returns what is left, and the
/// updates.
///
/// # Errors
/// If the parts are not the children of the node ([`Plan::children`]), of one plan and built; if `progress` stops the work.
pub fn join(
    node: Node,
    parts: Vec<Part>,
    progress: OnProgress<'_>,
) -> Result<(Part, PartUpdates), PartsError> {
    let Some(first) = parts.first() else {
        return Err(PartsError::NoNode { level: node.level, index: node.index });
    };
    let plan = first.head.plan.clone();
    if parts.iter().any(|part| part.head.plan != plan) {
        return Err(PartsError::OtherPlan);
    }
    let children = plan.children(node)?;
    let given = parts.iter().map(|part| part.head.node);
    if !given.eq(children.iter().copied()) || parts.iter().any(|part| !part.head.built) {
        let ends = [children.first(), children.last()].map(|child| child.map_or(0, |child| child.index));
        return Err(PartsError::Children { level: node.level, index: node.index, children: ends });
    }
    let piece = joined(&plan, node, parts.into_iter().map(|part| part.piece).collect());
    run(Head { plan, node, built: true }, piece, progress)
}

/// Simplifies a piece.
fn run(head: Head, mut piece: Piece, progress: OnProgress<'_>) -> Result<(Part, PartUpdates), PartsError> {
    let Head { plan, node, .. } = head;
    let info = plan.info();
    let before = piece.tets.len();
    let quantized = quantized(&plan, &info, &mut piece);
    let topology = topology(piece.points.len(), &piece.tets).map_err(BuildError::from)?;
    let earlier: Vec<ErrorCode> = piece.carried.earlier_errors.iter().copied().map(ErrorCode).collect();
    let inner = take(&mut piece.inner);
    let inner = if inner.is_empty() { vec![0; before] } else { inner };
    let state = state(&plan, node, (&mut piece, topology), &quantized)?;
    let of_piece = MtInfo { vertices: piece.points.len() as u32, ..info };
    let mut record = Collapses::resume(&of_piece, earlier, inner);
    let left = before.div_ceil(LEFT).max(LEFT_AT_INTERFACE * piece.carried.interface.len());
    let enough = if plan.is_whole(node) { 0 } else { left as u32 };
    let mut decimator = Decimator::new(state, None, &mut record);
    decimator.remove_until(enough, &mut |now| progress(of_step(now, before, enough)))?;
    let Decimator { mut state, record: finished, .. } = decimator;
    finished.finish(&state.mesh.tets, &state.removals.makers);
    let places = Left::of(&state.mesh.tets);
    let left = what_is_left(&mut state, &places);
    drop(state);
    piece.positions = quantized.positions.to_vec();
    drop(quantized);
    let head = Head { plan, node, built: true };
    Ok(sorted_out(head, (piece, left), record))
}

/// The progress of a step by its tetrahedra, from so many to `enough`: it ends before the vertices do, and begins after others. A step
/// that has nothing to do is done.
fn of_step(now: BuildProgress, before: usize, enough: u32) -> BuildProgress {
    let left = now.tetrahedra.unwrap_or(enough);
    let [done, total] = [left, enough].map(|tets| (before as u64).saturating_sub(tets.into()));
    // The last removal may take away more than it has to.
    let [done, total] = if total > 0 { [done.min(total), total] } else { [1, 1] };
    BuildProgress { done, total, ..now }
}

/// The reference vertices of a piece, whose positions it takes, on the lattices of the whole.
fn quantized(plan: &Plan, info: &MtInfo, piece: &mut Piece) -> Quantized {
    let fields = &info.fields;
    let positions: Arc<[[i32; 3]]> = take(&mut piece.positions).into();
    let Sided { first, further, values } = &piece.sided;
    let per_value = || piece.values.iter().chain(values).zip(fields.iter().cycle());
    let place = |point: usize| match piece.carried.moved.binary_search_by_key(&(point as u32), |(v, _)| *v) {
        Ok(at) => DVec3::from_array(piece.carried.moved[at].1),
        Err(_) => as_vec(positions[point]),
    };
    Quantized {
        lattice: info.lattice,
        fields: fields.clone(),
        levels: per_value().map(|(&value, field)| field.nearest(value)).collect(),
        exact: per_value().map(|(&value, field)| (value - field.origin) / field.step).collect(),
        places: Places::new(positions.clone(), (0..positions.len()).map(place))
            .with_sides(further.iter().map(|(v, _)| *v)),
        positions,
        sides: Sides::new(plan.jumps(), first.clone(), further.clone()),
        locations: Vec::new(),
        quantization: info.quantization,
    }
}

/// The state of the builder in which a piece is, of which it takes what changes.
fn state<'a>(
    plan: &Plan,
    node: Node,
    (piece, topology): (&mut Piece, Topology),
    quantized: &'a Quantized,
) -> Result<State<'a>, PartsError> {
    let Topology { mut neighbors, non_manifold, .. } = topology;
    mark_interface(piece, &mut neighbors)?;
    let points = piece.points.len();
    let is_reference = node.level == 0;
    let boundary = match is_reference {
        true => boundary_faces(&piece.tets, &neighbors).map(|(_, face)| face).collect(),
        false => take(&mut piece.carried.boundary),
    };
    let boundary = BoundaryDistance::of(boundary, quantized);
    let of_errors = (plan.displacement_per_error, plan.displacement_edges);
    let reference = Reference::of(quantized, boundary, take(&mut piece.carried.shortest), of_errors);
    let mut open = vec![false; points];
    piece.carried.shared.iter().for_each(|&(v, ..)| open[v as usize] = true);
    let frozen = non_manifold.iter().zip(&open).map(|(a, b)| a | b).collect();
    let mut buckets = Buckets::new(piece.tets.len(), quantized);
    take(&mut piece.carried.inside).into_iter().for_each(|(v, t)| buckets.inside.put(t, v));
    take(&mut piece.carried.border).into_iter().for_each(|(v, t)| buckets.border.put(t, v));
    take(&mut piece.carried.outside).into_iter().for_each(|v| buckets.outside_points.set_outside(v, true));
    take(&mut piece.carried.foreign).into_iter().for_each(|(v, t)| buckets.outside_points.add_foreign(t, v));
    let mut removals = Removals::new(piece.tets.len());
    if !piece.makers.is_empty() {
        removals.makers = take(&mut piece.makers);
    }
    removals.errors = take(&mut piece.carried.earlier_errors).into_iter().map(ErrorCode).collect();
    let mut reaches = match is_reference {
        true => reach::of_stars(&piece.tets, &quantized.positions),
        false => vec![Reach::default(); points],
    };
    for (v, ends) in take(&mut piece.carried.reaches) {
        ends.iter().for_each(|&p| reaches[v as usize].add(p));
    }
    let mesh = WorkMesh::new(take(&mut piece.tets), neighbors, points);
    let history = History { buckets, removals, reaches };
    let state = State::resume(mesh, reference, frozen, Levels::of_purpose(plan.purpose()), history);
    let mut kept = vec![false; if piece.carried.kept.is_empty() { 0 } else { points }];
    piece.carried.kept.iter().for_each(|&v| kept[v as usize] = true);
    let restrictions = Restrictions::of_angles(&plan.restricting(), quantized)?;
    let restrictions = restrictions.with(take(&mut piece.regions), kept);
    Ok(State { open, restrictions, ..state })
}

/// Enters which faces without a neighbour lead to other parts.
fn mark_interface(piece: &Piece, neighbors: &mut [[u32; 4]]) -> Result<(), PartsError> {
    let mut faces: Vec<[u32; 3]> = piece.carried.interface.iter().map(|(face, _)| *face).collect();
    faces.sort_unstable();
    let mut found = 0;
    let outer: Vec<(u32, [u32; 3])> = boundary_faces(&piece.tets, neighbors).collect();
    for (t, mut face) in outer {
        face.sort_unstable();
        if faces.binary_search(&face).is_ok() {
            found += 1;
            let tet = piece.tets[t as usize];
            let opposite = tet.iter().position(|v| !face.contains(v)).unwrap_or(0);
            neighbors[t as usize][opposite] = ELSEWHERE;
        }
    }
    if found == faces.len() {
        Ok(())
    } else {
        Err(PartsError::Damaged { what: "its faces to other parts are not there" })
    }
}

/// The tetrahedra that are left.
struct Left {
    /// The numbers that they had.
    live: Vec<u32>,
}

impl Left {
    fn of(tets: &[[u32; 4]]) -> Self {
        Self { live: (0..).zip(tets).filter(|(_, tet)| tet[0] != NONE).map(|(t, _)| t).collect() }
    }

    /// Pairs of a point of these lists and the new number of its tetrahedron.
    fn pairs<I: Iterator<Item = u32>>(&self, of: impl Fn(u32) -> I) -> Vec<(u32, u32)> {
        (0..).zip(&self.live).flat_map(|(now, &t)| of(t).map(move |point| (point, now))).collect()
    }
}

/// What is left of a piece of what the state has taken, but for what follows from the record.
fn what_is_left(state: &mut State<'_>, places: &Left) -> Piece {
    let shortest = take(&mut state.reference.shortest);
    let State { mesh, buckets, reference, reaches, .. } = &*state;
    let inside = places.pairs(|t| buckets.inside.iter(t));
    let is_outside = |v: &u32| buckets.outside_points.is_outside(*v);
    let mut outside: Vec<u32> = inside.iter().map(|(v, _)| *v).filter(is_outside).collect();
    outside.sort_unstable();
    let left = (0..reference.points).filter(|&v| mesh.has(v));
    let regions = state.restrictions.regions();
    let live = if regions.is_empty() { &[][..] } else { &places.live };
    let carried = Carried {
        border: places.pairs(|t| buckets.border.iter(t)),
        foreign: places.pairs(|t| buckets.outside_points.foreign_to(t)),
        boundary: reference.boundary.all().to_vec(),
        reaches: left.map(|v| (v, reaches[v as usize].ends())).collect(),
        inside,
        outside,
        shortest,
        ..Carried::default()
    };
    let regions = live.iter().map(|&t| regions[t as usize]).collect();
    Piece { regions, carried, ..Piece::default() }
}

/// Orders the updates, and makes what is left refer to them.
fn sorted_out(head: Head, (piece, left): (Piece, Piece), mut record: Collapses) -> (Part, PartUpdates) {
    let block_bits = head.plan.block_bits;
    let domain = Some(head.plan.sides);
    let order = match head.plan.is_whole(head.node) {
        // As the base mesh is going to be numbered.
        true => {
            let base = growth_order(&piece.positions, record.tets_left());
            let number = |v: u32| base.number[v as usize];
            record.order((base.vertices.len() as u32, number), block_bits, domain).0
        }
        false => record.order((piece.points.len() as u32, |v| v), block_bits, domain).0,
    };
    let mut update_of = vec![0; order.len()];
    (0..).zip(&order).for_each(|(u, &c): (u32, _)| update_of[c as usize] = u);
    let known = piece.earlier.len() as u32;
    let mut rows = UpdateRows { earlier: piece.earlier.clone(), ..UpdateRows::default() };
    let remover = |maker: u32| match maker.checked_sub(known) {
        _ if maker == NONE => Remover::Nothing,
        None => Remover::Earlier(maker),
        Some(own) => Remover::Own(update_of[own as usize]),
    };
    for &c in &order {
        let Collapse { vertex, errors, star: (makers, inner) } = record.get(c);
        rows.vertices.push(piece.points[vertex as usize]);
        rows.near.push(piece.points[record.near(c) as usize]);
        rows.errors.extend(errors.iter().map(|error| error.0));
        rows.stars.push(makers.len() as u8);
        rows.removers.extend(makers.iter().map(|&maker| RemoverCode::from(remover(maker))));
        rows.inner.extend_from_slice(inner);
    }
    // What made the tetrahedra that are left, each once.
    let mut table: BTreeMap<u32, u32> = BTreeMap::new();
    for &(maker, _) in record.marks_left().iter().filter(|(maker, _)| *maker != NONE) {
        table.entry(maker).or_default();
    }
    let (mut earlier, mut earlier_errors) = (Vec::new(), Vec::new());
    for ((&maker, number), i) in table.iter_mut().zip(0..) {
        *number = i;
        earlier.push(match maker.checked_sub(known) {
            None => piece.earlier[maker as usize],
            Some(own) => Made { node: head.node, update: update_of[own as usize] },
        });
        earlier_errors.extend(record.errors_of_maker(maker).iter().map(|error| error.0));
    }
    let marks = record.marks_left();
    let number = |maker: u32| if maker == NONE { NONE } else { table[&maker] };
    let Carried { moved, shared, interface, kept, .. } = piece.carried;
    let carried = Carried { earlier_errors, moved, shared, interface, kept, ..left.carried };
    let piece = Piece {
        tets: record.tets_left().to_vec(),
        makers: marks.iter().map(|(maker, _)| number(*maker)).collect(),
        inner: marks.iter().map(|(_, inner)| *inner).collect(),
        earlier,
        points: piece.points,
        positions: piece.positions,
        values: piece.values,
        sided: piece.sided,
        regions: left.regions,
        carried,
    };
    (Part { head: head.clone(), piece }, PartUpdates { head, rows })
}

/// The pieces of a node as one.
fn joined(plan: &Plan, node: Node, mut pieces: Vec<Piece>) -> Piece {
    let mut all = Piece::over(pieces.iter().map(|piece| &piece.points), plan.fields.len());
    let own = plan.parts_of(node);
    let is_open = |&(_, first, last): &(u32, u32, u32)| !own.contains(&first) || !own.contains(&last);
    // What has been put is freed before the next is touched: never is all there twice.
    let put = |piece: &mut Piece| {
        let (positions, values, shortest) =
            (take(&mut piece.positions), take(&mut piece.values), take(&mut piece.carried.shortest));
        all.put(&piece.points, &positions, &values, &shortest)
    };
    let mut numbers: Vec<Vec<u32>> = pieces.iter_mut().map(put).collect();
    all.sided = Sided::joined(&pieces, all.points.len(), plan.fields.len(), &mut numbers);
    for (piece, numbers) in pieces.into_iter().zip(numbers) {
        let number = |v: u32| numbers[v as usize];
        let (first_tet, first_made) = (all.tets.len() as u32, all.earlier.len() as u32);
        let in_bucket = |&(v, t): &(u32, u32)| (number(v), first_tet + t);
        all.carried.moved.extend(piece.carried.moved.iter().map(|&(v, place)| (number(v), place)));
        let shared = piece.carried.shared.iter().filter(|shared| is_open(shared));
        all.carried.shared.extend(shared.map(|&(v, first, last)| (number(v), first, last)));
        all.tets.extend(piece.tets.iter().map(|tet| tet.map(number)));
        let interface = piece.carried.interface.iter().filter(|(_, other)| !own.contains(other));
        all.carried.interface.extend(interface.map(|&(face, other)| (face.map(number), other)));
        let made = |&maker: &u32| if maker == NONE { NONE } else { first_made + maker };
        all.makers.extend(piece.makers.iter().map(made));
        all.inner.extend_from_slice(&piece.inner);
        all.earlier.extend_from_slice(&piece.earlier);
        all.carried.earlier_errors.extend_from_slice(&piece.carried.earlier_errors);
        all.carried.inside.extend(piece.carried.inside.iter().map(in_bucket));
        all.carried.border.extend(piece.carried.border.iter().map(in_bucket));
        all.carried.foreign.extend(piece.carried.foreign.iter().map(in_bucket));
        all.carried.outside.extend(piece.carried.outside.iter().map(|&v| number(v)));
        all.carried.boundary.extend(piece.carried.boundary.iter().map(|face| face.map(number)));
        all.regions.extend_from_slice(&piece.regions);
        all.carried.kept.extend(piece.carried.kept.iter().map(|&v| number(v)));
        all.carried.reaches.extend(piece.carried.reaches.iter().map(|&(v, ends)| (number(v), ends)));
    }
    all.carried.kept.sort_unstable();
    all.carried.kept.dedup();
    all.carried.moved.sort_unstable_by_key(|(v, _)| *v);
    all.carried.moved.dedup_by_key(|(v, _)| *v);
    all.carried.shared.sort_unstable();
    all.carried.shared.dedup();
    all
}
