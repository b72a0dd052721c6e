//! How the points of a node are numbered while it is simplified.
//!
//! Most of them are no vertices of its mesh any more, and only in buckets: they have no numbers ([`crate::error::stored_points`]). Those that
//! only the boundary of the reference mesh needs come last, so that what only vertices need is kept for vertices alone. Points of each kind
//! ascend by their numbers in the whole.
//!
//! ```text
//!     | vertices of the mesh | others on the boundary |
//!     +----------------------+------------------------+
//!       topology, reaches      distances
//! ```

use super::piece::{Piece, Sided};
use super::plan::{Node, Plan};
use std::mem::take;
use tetralod::mesh::{BitSet, NONE};

/// The pieces of a node as one, vertices of its mesh first, and how many these are.
pub(super) fn joined(plan: &Plan, node: Node, mut pieces: Vec<Piece>) -> (Piece, usize) {
    let needed: Vec<Vec<u32>> = pieces.iter().map(needed).collect();
    let mut all = Piece::over(needed.iter(), plan.fields.len());
    drop(needed);
    let mut numbers: Vec<Vec<u32>> = pieces.iter().map(|piece| places(&all.points, &piece.points)).collect();
    let vertices = number_vertices_first(&mut all.points, &pieces, &mut numbers);
    // What has been put is freed before the next is touched: never is all there twice.
    for (piece, numbers) in pieces.iter_mut().zip(&numbers) {
        drop(take(&mut piece.points));
        let (positions, values) = (take(&mut piece.positions), take(&mut piece.values));
        all.put(numbers, &positions, &values, &take(&mut piece.carried.shortest));
    }
    all.sided = Sided::joined(&pieces, all.points.len(), plan.fields.len(), &numbers);
    let own = plan.parts_of(node);
    let is_open = |&(_, first, last): &(u32, u32, u32)| !own.contains(&first) || !own.contains(&last);
    all.tets.reserve_exact(pieces.iter().map(|piece| piece.tets.len()).sum());
    for (piece, numbers) in pieces.into_iter().zip(numbers) {
        let number = |v: u32| numbers[v as usize];
        let has = |v: u32| number(v) != NONE;
        let (first_tet, first_made) = (all.tets.len() as u32, all.earlier.len() as u32);
        let in_bucket = |&(v, t): &(u32, u32)| (number(v), first_tet + t);
        let made = |&maker: &u32| if maker == NONE { NONE } else { first_made + maker };
        all.tets.extend(piece.tets.iter().map(|tet| tet.map(number)));
        all.makers.extend(piece.makers.iter().map(made));
        all.inner.extend_from_slice(&piece.inner);
        all.earlier.extend_from_slice(&piece.earlier);
        all.regions.extend_from_slice(&piece.regions);
        let (all, piece) = (&mut all.carried, piece.carried);
        let moved = piece.moved.iter().filter(|(v, _)| has(*v));
        all.moved.extend(moved.map(|&(v, place)| (number(v), place)));
        let shared = piece.shared.iter().filter(|shared| has(shared.0) && is_open(shared));
        all.shared.extend(shared.map(|&(v, first, last)| (number(v), first, last)));
        let interface = piece.interface.iter().filter(|(_, other)| !own.contains(other));
        all.interface.extend(interface.map(|&(face, other)| (face.map(number), other)));
        all.earlier_errors.extend_from_slice(&piece.earlier_errors);
        all.border.extend(piece.border.iter().map(in_bucket));
        all.foreign.extend(piece.foreign.iter().map(|&(point, t)| (point, first_tet + t)));
        all.boundary.extend(piece.boundary.iter().map(|face| face.map(number)));
        all.kept.extend(piece.kept.iter().filter(|v| has(**v)).map(|&v| number(v)));
        all.reaches.extend(piece.reaches.iter().map(|&(v, ends)| (number(v), ends)));
    }
    let carried = &mut all.carried;
    carried.kept.sort_unstable();
    carried.kept.dedup();
    carried.moved.sort_unstable_by_key(|(v, _)| *v);
    carried.moved.dedup_by_key(|(v, _)| *v);
    carried.shared.sort_unstable();
    carried.shared.dedup();
    (all, vertices)
}

/// The points of a piece that are vertices of its mesh, or on the boundary of the reference mesh.
fn needed(piece: &Piece) -> Vec<u32> {
    let mut is_needed = vec![false; piece.points.len()];
    piece.tets.iter().flatten().for_each(|&v| is_needed[v as usize] = true);
    piece.carried.boundary.iter().flatten().for_each(|&v| is_needed[v as usize] = true);
    piece.points.iter().zip(is_needed).filter(|(_, is_needed)| *is_needed).map(|(&point, _)| point).collect()
}

/// Where points are among those that ascend; [`NONE`] for those that are not there.
fn places(ascending: &[u32], points: &[u32]) -> Vec<u32> {
    let place = |point: &u32| ascending.binary_search(point).map_or(NONE, |place| place as u32);
    points.iter().map(place).collect()
}

/// Numbers points anew, given where those of each piece are, and says how many are vertices.
fn number_vertices_first(points: &mut Vec<u32>, pieces: &[Piece], numbers: &mut [Vec<u32>]) -> usize {
    let (mut vertices, mut border) = (BitSet::default(), BitSet::default());
    for (piece, numbers) in pieces.iter().zip(&*numbers) {
        piece.tets.iter().flatten().for_each(|&v| _ = vertices.insert(numbers[v as usize]));
        piece.carried.boundary.iter().flatten().for_each(|&v| _ = border.insert(numbers[v as usize]));
    }
    let kind = |at: u32| if vertices.has(at) { 0 } else { 2 - usize::from(border.has(at)) };
    let all = 0..points.len() as u32;
    let mut counts = [0; 3];
    all.clone().for_each(|at| counts[kind(at)] += 1);
    let mut next = [0, counts[0], counts[0] + counts[1]];
    let place = |at: u32| {
        let next = &mut next[kind(at)];
        *next += 1;
        *next - 1
    };
    let new: Vec<u32> = all.map(place).collect();
    let mut numbered = vec![0; points.len()];
    new.iter().zip(&*points).for_each(|(&v, &point)| numbered[v as usize] = point);
    *points = numbered;
    numbers.iter_mut().flatten().filter(|v| **v != NONE).for_each(|v| *v = new[*v as usize]);
    counts[0] as usize
}

#[cfg(test)]
mod tests {
    use super::super::{build_part, part};
    use super::*;
    use crate::BuildConfig;
    use crate::error::stored_points::StoredPoint;
    use crate::scratch::InMemory;
    use std::collections::BTreeMap;
    use std::ops::ControlFlow;
    use tetralod::mesh::{Field, Grid, TetMesh};

    #[test]
    fn vertices_come_first_and_points_keep_what_they_have() {
        let scratch = InMemory::default();
        let grid = Grid { dims: [13; 3], origin: [0.0; 3], spacing: [1.0; 3] };
        let values = (0..13_u32.pow(3)).map(f64::from).collect();
        let mesh = TetMesh::from_grid(grid, vec![Field::new("its number", values)]);
        let (mut pieces, mut names) = (Vec::new(), Vec::new());
        let put = &mut |of| {
            let (part, _) = build_part(of, &scratch, &mut |_| ControlFlow::Continue(()))?;
            let (stored, _) = part.in_buckets.expect("points in buckets");
            let mut records = Vec::new();
            (0..part.piece.tets.len() as u32).for_each(|t| stored.copy(t, 0..stored.count(t), &mut records));
            let of_records = records.chunks_exact(stored.layout.len());
            names.extend(of_records.map(|record| StoredPoint::new(record, stored.layout).name()));
            pieces.push(part.piece);
            Ok(())
        };
        let config = BuildConfig::default();
        let plan = part(&mesh, &config, 2, BTreeMap::new(), put).expect("a mesh that can be parted");
        let (piece, vertices) = joined(&plan, Node { level: 1, index: 0 }, pieces);
        assert!(piece.tets.iter().flatten().all(|&v| (v as usize) < vertices));
        assert!(piece.points[..vertices].is_sorted() && !piece.points.is_sorted());
        assert_eq!(piece.values, piece.points.iter().copied().map(f64::from).collect::<Vec<f64>>());
        // Each point is a vertex or in a bucket: those of the boundary alone are in buckets, too.
        let mut all = [&piece.points[..vertices], &names].concat();
        all.sort_unstable();
        assert_eq!(all, (0..13_u32.pow(3)).collect::<Vec<u32>>());
    }
}
