//! One step: the mesh of a part, or of several that are joined, is simplified as far as its place in the whole allows.
//!
//! A part is decimated like a whole, but for its open vertices, and until an eighth of its tetrahedra is left.

use super::PartsError;
use super::numbering;
use super::piece::{Carried, Head, Made, Part, PartUpdates, Piece, Remover, RemoverCode, Sided, UpdateRows};
use super::plan::{Node, Plan};
use super::points_frame::PointsInBuckets;
use crate::change::work_mesh::{ELSEWHERE, WorkMesh};
use crate::decimate::Decimator;
use crate::decimate::candidate_queue::Levels;
use crate::decimate::collapses::{Collapse, Collapses};
use crate::decimate::removal::{History, State};
use crate::error::boundary_distance::BoundaryDistance;
use crate::error::buckets::Buckets;
use crate::error::fill_cost::Removals;
use crate::error::outside_points::Known;
use crate::error::points::as_vec;
use crate::error::reference::Reference;
use crate::error::stored_points::{StoredPoint, StoredPoints};
use crate::lattice::places::Places;
use crate::lattice::quantize::Quantized;
use crate::lattice::sides::Sides;
use crate::order::reach::{self, Reach};
use crate::restrict::restrictions::Restrictions;
use crate::scratch::Scratch;
use crate::{BuildError, BuildProgress, OnProgress};
use glam::DVec3;
use std::collections::BTreeMap;
use std::mem::take;
use std::ops::ControlFlow;
use std::sync::Arc;
use tetralod::mesh::{NONE, Topology, boundary_faces, growth_order, topology};
use tetralod::mt::{ErrorCode, MtInfo};

/// A step ends when about so much of its tetrahedra is left: as many of these are joined.
const LEFT: usize = 8;

/// Or when so many are left for each triangle that it shares with other parts. These triangles stay, and so do the tetrahedra at them: to
/// get below, all other vertices would be removed, whatever the error is. On 97³ in 64 parts, meshes within 1 % have 527 816 tetrahedra
/// without this, 327 843 with 4 for each, 276 579 with 8; as a whole they have 281 157. Of two nodes more are left: these lie on one plane alone, and
/// joining them takes no more memory than joining four did. Those meshes have 298 530 with 8 for each of these, 279 435 with 12.
pub(crate) fn left_at_interface(nodes: u32) -> usize {
    if nodes > 2 { 8 } else { 12 }
}

/// Builds a part on its own: returns what is left, and the updates.
///
/// # Errors
/// If the part has been built already, or its mesh is not valid; if `progress` stops the work.
pub fn build_part<'s>(
    part: Part<'_>,
    scratch: &'s dyn Scratch,
    progress: OnProgress<'_>,
) -> Result<(Part<'s>, PartUpdates), PartsError> {
    let Part { head, piece, .. } = part;
    if head.built || head.node.level > 0 {
        return Err(PartsError::Damaged { what: "it has been built already" });
    }
    let vertices = piece.points.len();
    let stored = stored_points(&head, piece.tets.len(), scratch);
    run(head, (piece, vertices), (stored, Vec::new()), progress)
}

/// Joins what is left of the parts of a node, in their order, and simplifies what was between them: returns what is left, and the
/// updates.
///
/// # Errors
/// If the parts are not the children of the node ([`Plan::children`]), of one plan and built; if `progress` stops the work, or a
/// scratch fails.
pub fn join<'s>(
    node: Node,
    parts: Vec<Part<'s>>,
    scratch: &'s dyn Scratch,
    progress: OnProgress<'_>,
) -> Result<(Part<'s>, PartUpdates), PartsError> {
    let Some(first) = parts.first() else {
        return Err(PartsError::NoNode { level: node.level, index: node.index });
    };
    let plan = first.head.plan.clone();
    if parts.iter().any(|part| part.head.plan != plan) {
        return Err(PartsError::OtherPlan);
    }
    let children = plan.children(node)?;
    let given = parts.iter().map(|part| part.head.node);
    if !given.eq(children.iter().copied()) || parts.iter().any(|part| part.in_buckets.is_none()) {
        let ends = [children.first(), children.last()].map(|child| child.map_or(0, |child| child.index));
        return Err(PartsError::Children { level: node.level, index: node.index, children: ends });
    }
    let head = Head { plan: plan.clone(), node, built: true };
    let (mut stored, mut outside) = (stored_points(&head, 0, scratch), Vec::new());
    let mut pieces = Vec::new();
    for Part { piece, in_buckets, .. } in parts {
        pieces.push(piece);
        if let Some((points, of_part)) = in_buckets {
            stored.append(points);
            outside.extend(of_part);
        }
    }
    run(head, numbering::joined(&plan, node, pieces), (stored, outside), progress)
}

/// The points in buckets of a node, which has none yet.
fn stored_points<'s>(head: &Head, tets: usize, scratch: &'s dyn Scratch) -> StoredPoints<'s> {
    let Node { level, index } = head.node;
    StoredPoints::new(head.plan.record_layout(), tets, scratch, format!("points-{level}-{index}"))
}

/// Simplifies a piece, of whose points so many are vertices of the mesh: the first ones.
fn run<'s>(
    head: Head,
    (mut piece, vertices): (Piece, usize),
    in_buckets: PointsInBuckets<'s>,
    progress: OnProgress<'_>,
) -> Result<(Part<'s>, PartUpdates), PartsError> {
    let Head { plan, node, .. } = head;
    let info = MtInfo { vertices: vertices as u32, ..plan.info() };
    let before = piece.tets.len();
    let quantized = quantized(&plan, &info, vertices, &mut piece);
    let topology = topology(vertices, &piece.tets).map_err(BuildError::from)?;
    let earlier: Vec<ErrorCode> = piece.carried.earlier_errors.iter().copied().map(ErrorCode).collect();
    let inner = take(&mut piece.inner);
    let inner = if inner.is_empty() { vec![0; before] } else { inner };
    let failure = in_buckets.0.failure.clone();
    let state = state(&plan, node, (&mut piece, topology), in_buckets, &quantized)?;
    let mut record = Collapses::resume(&info, earlier, inner);
    let left =
        before.div_ceil(LEFT).max(left_at_interface(plan.beside(node)) * piece.carried.interface.len());
    let enough = if plan.is_whole(node) { 0 } else { left as u32 };
    let mut decimator = Decimator::new(state, None, &mut record);
    let done = decimator.remove_until(enough, &mut |now| match failure.is_set() {
        true => ControlFlow::Break(()),
        false => progress(of_step(now, before, enough)),
    });
    failure.take()?;
    done?;
    let state = decimator.finish();
    let stored = take_what_is_left(state, &mut piece);
    take_points(quantized, &mut piece);
    let head = Head { plan, node, built: true };
    let (piece, updates) = sorted_out(&head, (piece, vertices), record);
    let in_buckets = stored.map(|stored| (stored, Vec::new()));
    Ok((Part { head: head.clone(), piece, in_buckets }, PartUpdates { head, rows: updates }))
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

/// The reference vertices of a piece, of which it takes what it has of them, on the lattices of the whole.
fn quantized(plan: &Plan, info: &MtInfo, vertices: usize, piece: &mut Piece) -> Quantized {
    let fields = &info.fields;
    let positions: Arc<[[i32; 3]]> = take(&mut piece.positions).into();
    let Sided { first, further, values } = take(&mut piece.sided);
    let moved = take(&mut piece.carried.moved);
    let place = |point: usize| match moved.binary_search_by_key(&(point as u32), |(v, _)| *v) {
        Ok(at) => DVec3::from_array(moved[at].1),
        Err(_) => as_vec(positions[point]),
    };
    let places = Places::new(positions.clone(), (0..positions.len()).map(place))
        .with_sides(further.iter().map(|(v, _)| *v));
    let mut exact = take(&mut piece.values);
    exact.extend(values);
    // Those of sides are behind those of all points.
    let with_levels = if further.is_empty() { vertices * fields.len() } else { exact.len() };
    let levels = exact[..with_levels].iter().zip(fields.iter().cycle());
    Quantized {
        lattice: info.lattice,
        fields: fields.clone(),
        levels: levels.map(|(&value, field)| field.nearest(value)).collect(),
        exact,
        is_plain: true,
        places,
        positions,
        sides: Sides::new(plan.jumps(), first, further),
        locations: Vec::new(),
        quantization: info.quantization,
    }
}

/// Gives a piece back what [`quantized`] has taken.
fn take_points(quantized: Quantized, piece: &mut Piece) {
    let Quantized { places, positions, sides, exact, .. } = quantized;
    let points = positions.len() as u32;
    let moved = (0..points).filter(|&v| places.is_moved(v)).map(|v| (v, places.at(v).to_array()));
    piece.carried.moved = moved.collect();
    drop(places);
    piece.positions = positions.to_vec();
    let (first, further) = sides.into_parts();
    piece.values = exact;
    let fields = piece.values.len() / (points as usize + further.len()).max(1);
    let values = piece.values.split_off(points as usize * fields);
    piece.sided = Sided { first, further, values };
}

/// The state of the builder in which a piece is, of which it takes what changes.
fn state<'a, 's>(
    plan: &Plan,
    node: Node,
    (piece, topology): (&mut Piece, Topology),
    (mut stored, outside): PointsInBuckets<'s>,
    quantized: &'a Quantized,
) -> Result<State<'a, 's>, PartsError> {
    let Topology { mut neighbors, non_manifold, .. } = topology;
    mark_interface(piece, &mut neighbors)?;
    let vertices = non_manifold.len();
    let is_reference = node.level == 0;
    let boundary = match is_reference {
        true => boundary_faces(&piece.tets, &neighbors).map(|(_, face)| face).collect(),
        false => take(&mut piece.carried.boundary),
    };
    let boundary = BoundaryDistance::of(boundary, vertices, quantized);
    let of_errors = (plan.displacement_per_error, plan.displacement_edges);
    let reference = Reference::of(quantized, boundary, take(&mut piece.carried.shortest), of_errors);
    // Others may be here that are vertices only elsewhere.
    let among_vertices = |of: &mut dyn Iterator<Item = u32>| {
        let mut among = vec![false; vertices];
        of.filter(|&v| (v as usize) < vertices).for_each(|v| among[v as usize] = true);
        among
    };
    let open = among_vertices(&mut piece.carried.shared.iter().map(|(v, ..)| *v));
    let frozen = non_manifold.iter().zip(&open).map(|(a, b)| a | b).collect();
    stored.names = take(&mut piece.points);
    let layout = stored.layout;
    let outside = [outside, store_first(&mut stored, &mut piece.carried, &reference)].concat();
    let mut buckets = Buckets::of_stored(stored, quantized);
    for record in outside.chunks_exact(layout.len()) {
        let point = StoredPoint::new(record, layout);
        let known = || Known::at(point.own_place()).with(record);
        buckets.outside_points.set_outside(point.id(), true, known);
    }
    take(&mut piece.carried.border).into_iter().for_each(|(v, t)| buckets.border.put(t, v));
    take(&mut piece.carried.foreign).into_iter().for_each(|(v, t)| buckets.outside_points.add_foreign(t, v));
    let mut removals = Removals::new(piece.tets.len());
    if !piece.makers.is_empty() {
        removals.makers = take(&mut piece.makers);
    }
    removals.errors = take(&mut piece.carried.earlier_errors).into_iter().map(ErrorCode).collect();
    let mut reaches = match is_reference {
        true => reach::of_stars(&piece.tets, &quantized.positions),
        false => vec![Reach::default(); vertices],
    };
    for (v, ends) in take(&mut piece.carried.reaches) {
        let reach = reaches.get_mut(v as usize);
        reach.into_iter().for_each(|reach| ends.iter().for_each(|&p| reach.add(p)));
    }
    let mesh = WorkMesh::new(take(&mut piece.tets), neighbors, vertices);
    let history = History { buckets, removals, reaches };
    let state = State::resume(mesh, reference, frozen, Levels::of_purpose(plan.purpose()), history);
    let kept = &piece.carried.kept;
    let kept = if kept.is_empty() { Vec::new() } else { among_vertices(&mut kept.iter().copied()) };
    let restrictions = Restrictions::of_angles(&plan.restricting(), quantized)?;
    let restrictions = restrictions.with(take(&mut piece.regions), kept);
    Ok(State { open, restrictions, ..state })
}

/// Stores the points that are in buckets before anything is removed. Returns the records of those that are outside.
fn store_first(stored: &mut StoredPoints<'_>, carried: &mut Carried, reference: &Reference<'_>) -> Vec<u8> {
    let (mut inside, outside) = (take(&mut carried.inside), take(&mut carried.outside));
    let mut of_outside = Vec::new();
    inside.sort_by_key(|(_, t)| *t);
    for of_tet in inside.chunk_by(|a, b| a.1 == b.1) {
        let (mut records, mut extents) = (Vec::new(), Vec::new());
        for (v, _) in of_tet {
            let (from, is_outside) = (records.len(), outside.binary_search(v).is_ok());
            stored.record(*v, reference, is_outside, &mut records);
            of_outside.extend_from_slice(if is_outside { &records[from..] } else { &[] });
        }
        stored.store(&records, &mut extents);
        stored.put(of_tet[0].1, extents);
    }
    of_outside
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

/// Gives a piece what is left of what the state has taken, but for what follows from the record. Returns the points in buckets.
fn take_what_is_left<'s>(state: State<'_, 's>, piece: &mut Piece) -> Option<StoredPoints<'s>> {
    let State { mesh, mut buckets, reference, reaches, restrictions, .. } = state;
    let live: Vec<u32> = (0..mesh.tets.len() as u32).filter(|&t| mesh.is_live(t)).collect();
    let regions = restrictions.regions();
    let with_regions = if regions.is_empty() { &[][..] } else { &live };
    piece.regions = with_regions.iter().map(|&t| regions[t as usize]).collect();
    let left = (0..mesh.incident.len() as u32).filter(|&v| mesh.has(v));
    let carried = &mut piece.carried;
    carried.reaches = left.map(|v| (v, reaches[v as usize].ends())).collect();
    drop((mesh, reaches));
    carried.shortest = reference.shortest;
    carried.boundary = reference.boundary.all().to_vec();
    carried.border = pairs(&live, |t| buckets.border.iter(t));
    carried.foreign = pairs(&live, |t| buckets.outside_points.foreign_to(t));
    let mut stored = buckets.stored.take()?;
    stored.renumber(&live);
    piece.points = take(&mut stored.names);
    Some(stored)
}

/// Pairs of a point of these lists and the new number of its tetrahedron, given those that are left.
fn pairs<P, I: Iterator<Item = P>>(live: &[u32], of: impl Fn(u32) -> I) -> Vec<(P, u32)> {
    let mut pairs = Vec::with_capacity(live.iter().map(|&t| of(t).count()).sum());
    (0..).zip(live).for_each(|(now, &t)| pairs.extend(of(t).map(|point| (point, now))));
    pairs
}

/// Orders the updates, and makes what is left refer to them.
fn sorted_out(
    head: &Head,
    (mut piece, vertices): (Piece, usize),
    mut record: Collapses,
) -> (Piece, UpdateRows) {
    let block_bits = head.plan.block_bits;
    let domain = Some(head.plan.sides);
    let order = match head.plan.is_whole(head.node) {
        // As the base mesh is going to be numbered.
        true => {
            let base = growth_order(&piece.positions[..vertices], record.tets_left());
            let number = |v: u32| base.number[v as usize];
            record.order((base.vertices.len() as u32, number), block_bits, domain).0
        }
        false => record.order((vertices as u32, |v| v), block_bits, domain).0,
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
        let near = record.near(c);
        rows.vertices.push(piece.points[vertex as usize]);
        rows.near.push(piece.points[near as usize]);
        let [from, to] = [near, vertex].map(|v| piece.positions[v as usize]);
        rows.offsets.push([0, 1, 2].map(|k| to[k] - from[k]));
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
    piece.tets = record.tets_left().to_vec();
    piece.makers = marks.iter().map(|(maker, _)| number(*maker)).collect();
    piece.inner = marks.iter().map(|(_, inner)| *inner).collect();
    piece.earlier = earlier;
    piece.carried.earlier_errors = earlier_errors;
    piece.vertices = vertices;
    (piece, rows)
}
