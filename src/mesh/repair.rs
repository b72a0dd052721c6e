//! Mends what can be mended without guessing, says what was done, and refuses the rest.
//!
//! The rules, in the order in which they are applied:
//!
//! 1. *Collapsed tetrahedra*: points at one place that are joined by an edge (which makes every tetrahedron at
//!    that edge flat) become one point, the one with the lowest index. Points at one place without such an edge
//!    stay apart: they are the two sides of a slit, or parts that touch. A tetrahedron that then has a vertex
//!    twice is dropped: its other two faces coincide, so its neighbours meet.
//! 2. *Duplicates*: of several tetrahedra with the same four vertices the first stays.
//! 3. *Inverted tetrahedra* are turned round.
//! 4. The two tetrahedra of a shared face must then lie on opposite sides of it; a mesh that is folded is refused.
//! 5. *Flat tetrahedra* are dropped at the boundary, where those faces that are boundary look to one side and
//!    those that are shared to the other: the domain stays the same and the shared faces become its boundary.
//!    Any other flat tetrahedron is refused.
//! 6. *Unused points* are dropped.
//!
//! Whether a tetrahedron is flat or inverted is decided exactly.

use std::fmt;

use crate::mesh::adjacency::{FaceTable, HalfFace, crowded, match_faces};
use crate::mesh::check::{Sides, check_arrays};
use crate::mesh::{FACES, MeshError, NONE, TetMesh};

/// What [`repair`] did; displays as one line, empty when there was nothing to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RepairReport {
    /// Points merged into a coincident one.
    pub merged_points: usize,
    /// Merged points of which a field value differed from that of the point that stayed.
    pub differing_values: usize,
    /// Tetrahedra dropped because two of their vertices are one.
    pub collapsed_tets: usize,
    /// Tetrahedra dropped because an earlier one has the same vertices.
    pub duplicate_tets: usize,
    /// Inverted tetrahedra that were turned round.
    pub turned_tets: usize,
    /// Flat tetrahedra dropped from the boundary.
    pub flat_tets: usize,
    /// Points dropped because no tetrahedron uses them.
    pub unused_points: usize,
}

impl RepairReport {
    /// Whether nothing was done.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl fmt::Display for RepairReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut done = Vec::new();
        let mut say = |count: usize, before: &str, one: &str, many: &str| {
            if count > 0 {
                done.push(format!("{before} {count} {}", if count == 1 { one } else { many }));
            }
        };
        say(self.merged_points, "merged", "coincident point", "coincident points");
        say(self.differing_values, "of which", "had another field value", "had other field values");
        say(self.collapsed_tets, "dropped", "collapsed tetrahedron", "collapsed tetrahedra");
        say(self.duplicate_tets, "dropped", "duplicate tetrahedron", "duplicate tetrahedra");
        say(self.turned_tets, "turned", "inverted tetrahedron", "inverted tetrahedra");
        say(self.flat_tets, "dropped", "flat boundary tetrahedron", "flat boundary tetrahedra");
        say(self.unused_points, "dropped", "unused point", "unused points");
        if done.is_empty() { Ok(()) } else { write!(f, "repaired: {}", done.join(", ")) }
    }
}

/// Mends `mesh` by the rules of this module; the result passes [`crate::mesh::check`].
///
/// # Errors
/// If something cannot be mended; cells and points are numbered as in `mesh`.
pub fn repair(mesh: TetMesh) -> Result<(TetMesh, RepairReport), MeshError> {
    check_arrays(&mesh)?;
    let mut work = Work::new(mesh);
    work.merge_collapsed_edges();
    work.drop_collapsed();
    work.drop_duplicates()?;
    let flat = work.turn_inverted();
    let faces = work.conforming_faces(&flat)?;
    work.drop_flat(flat, &faces)?;
    work.drop_unused_points();
    if work.mesh.tets.is_empty() {
        return Err(MeshError::Empty);
    }
    debug_assert_eq!(crate::mesh::check(&work.mesh), Ok(()), "repair must give a valid mesh");
    Ok((work.mesh, work.report))
}

struct Work {
    mesh: TetMesh,
    /// The input's number of each tetrahedron that is left.
    cells: Vec<u32>,
    report: RepairReport,
}

impl Work {
    fn new(mesh: TetMesh) -> Self {
        let cells = (0..mesh.tets.len() as u32).collect();
        Self { mesh, cells, report: RepairReport::default() }
    }

    /// Keeps the tetrahedra for which `keep` holds; returns how many were dropped.
    fn retain(&mut self, keep: impl Fn(usize, [u32; 4]) -> bool) -> usize {
        let before = self.cells.len();
        let mut kept = 0;
        for t in 0..before {
            if keep(t, self.mesh.tets[t]) {
                self.mesh.tets[kept] = self.mesh.tets[t];
                self.cells[kept] = self.cells[t];
                for field in self.mesh.cell_fields.iter_mut().filter(|f| !f.values.is_empty()) {
                    field.values[kept] = field.values[t];
                }
                kept += 1;
            }
        }
        self.mesh.tets.truncate(kept);
        self.mesh.cell_fields.iter_mut().for_each(|field| field.values.truncate(kept));
        self.cells.truncate(kept);
        before - kept
    }

    /// Rule 1, the points.
    fn merge_collapsed_edges(&mut self) {
        let positions = &self.mesh.positions;
        let mut pairs = Vec::new();
        for tet in &self.mesh.tets {
            for [i, j] in crate::mesh::EDGES {
                let (a, b) = (tet[i].min(tet[j]), tet[i].max(tet[j]));
                if a != b && positions[a as usize] == positions[b as usize] {
                    pairs.push((a, b));
                }
            }
        }
        if pairs.is_empty() {
            return;
        }
        let mut target: Vec<u32> = (0..positions.len() as u32).collect();
        let root = |target: &[u32], mut v: u32| {
            while target[v as usize] != v {
                v = target[v as usize];
            }
            v
        };
        for (a, b) in pairs {
            let (a, b) = (root(&target, a), root(&target, b));
            target[a.max(b) as usize] = a.min(b);
        }
        // Targets are smaller than their sources, so one pass upwards resolves chains.
        for v in 0..target.len() {
            target[v] = target[target[v] as usize];
            if target[v] as usize != v {
                self.report.merged_points += 1;
                let differs = |f: &crate::mesh::Field| f.values[v] != f.values[target[v] as usize];
                self.report.differing_values += usize::from(self.mesh.fields.iter().any(differs));
            }
        }
        self.mesh.tets.iter_mut().flatten().for_each(|v| *v = target[*v as usize]);
    }

    /// Rule 1, the tetrahedra.
    fn drop_collapsed(&mut self) {
        self.report.collapsed_tets =
            self.retain(|_, [a, b, c, d]| a != b && a != c && a != d && b != c && b != d && c != d);
    }

    /// Rule 2.
    fn drop_duplicates(&mut self) -> Result<(), MeshError> {
        let mut repeats = vec![false; self.mesh.tets.len()];
        let apex = |f: &HalfFace| self.mesh.tets[f.tet() as usize][f.face()];
        FaceTable::new(&self.mesh.tets)?.each_group(|group| {
            // The first of a group repeats nothing: each is compared with those before it.
            for (i, face) in group.iter().enumerate().skip(1) {
                // Groups are short except in broken meshes, where looking at the first few is enough to refuse.
                let earlier = &group[..i.min(16)];
                repeats[face.tet() as usize] |= earlier.iter().any(|e| apex(e) == apex(face));
            }
            Ok::<(), MeshError>(())
        })?;
        self.report.duplicate_tets = self.retain(|t, _| !repeats[t]);
        Ok(())
    }

    /// Rule 3; returns which tetrahedra are flat.
    fn turn_inverted(&mut self) -> Vec<bool> {
        let sides = Sides::new(&self.mesh.positions);
        let mut flat = vec![false; self.mesh.tets.len()];
        for (tet, flat) in self.mesh.tets.iter_mut().zip(&mut flat) {
            match sides.of(*tet) {
                0 => *flat = true,
                side if side < 0 => {
                    tet.swap(2, 3);
                    self.report.turned_tets += 1;
                }
                _ => {}
            }
        }
        flat
    }

    /// Rule 4; returns the neighbours.
    fn conforming_faces(&self, flat: &[bool]) -> Result<Vec<[u32; 4]>, MeshError> {
        let fits = |group: &[HalfFace], folded: bool| match group {
            [a, b] if folded && !flat[a.tet() as usize] && !flat[b.tet() as usize] => {
                Err(MeshError::Folded { tets: [a, b].map(|face| self.cells[face.tet() as usize]) })
            }
            [_, _] => Ok(()),
            _ => Err(self.with_cells(crowded(group))),
        };
        match_faces(&FaceTable::new(&self.mesh.tets)?, fits)
    }

    /// `error` with the input's numbers.
    fn with_cells(&self, error: MeshError) -> MeshError {
        match error {
            MeshError::CrowdedFace { face, tets } => {
                MeshError::CrowdedFace { face, tets: tets.iter().map(|&t| self.cells[t as usize]).collect() }
            }
            other => other,
        }
    }

    /// Rule 5: peels flat tetrahedra off the boundary until none can go.
    fn drop_flat(&mut self, mut flat: Vec<bool>, neighbors: &[[u32; 4]]) -> Result<(), MeshError> {
        let tets = &self.mesh.tets;
        let sides = Sides::new(&self.mesh.positions);
        let mut gone = vec![false; tets.len()];
        let mut queue: std::collections::VecDeque<u32> =
            (0..tets.len() as u32).filter(|&t| flat[t as usize]).collect();
        while let Some(t) = queue.pop_front() {
            let n = neighbors[t as usize];
            let shared = n.map(|n| n != NONE && !gone[n as usize]);
            if gone[t as usize] || !may_go(sides.flat_faces(tets[t as usize]), shared) {
                continue;
            }
            gone[t as usize] = true;
            flat[t as usize] = false;
            // A flat neighbour now has one more boundary face.
            queue.extend((0..FACES.len()).filter(|&i| shared[i] && flat[n[i] as usize]).map(|i| n[i]));
        }
        if let Some(t) = flat.iter().position(|&left| left) {
            let shared = neighbors[t].iter().filter(|&&n| n != NONE && !gone[n as usize]).count();
            return Err(MeshError::InnerFlat { tet: self.cells[t], shared: shared as u32 });
        }
        self.report.flat_tets = self.retain(|t, _| !gone[t]);
        Ok(())
    }

    /// Rule 6.
    fn drop_unused_points(&mut self) {
        let mut used = vec![false; self.mesh.positions.len()];
        self.mesh.tets.iter().flatten().for_each(|&v| used[v as usize] = true);
        let kept = used.iter().filter(|&&u| u).count();
        let dropped = used.len() - kept;
        if dropped == 0 {
            return;
        }
        // Merged points are counted as merged, not as unused.
        self.report.unused_points = dropped - self.report.merged_points.min(dropped);
        let mut next = 0;
        let index: Vec<u32> = used.iter().map(|&u| if u { (next, next += 1).0 } else { NONE }).collect();
        self.mesh.tets.iter_mut().flatten().for_each(|v| *v = index[*v as usize]);
        retain_used(&mut self.mesh.positions, &used);
        self.mesh.fields.iter_mut().for_each(|f| retain_used(&mut f.values, &used));
        self.mesh.grid = None;
    }
}

fn retain_used<T>(values: &mut Vec<T>, used: &[bool]) {
    let mut flags = used.iter();
    values.retain(|_| flags.next().copied().unwrap_or(false));
}

/// Whether a flat tetrahedron whose faces look to `sides` can be dropped when its `shared` faces have another
/// tetrahedron behind them.
fn may_go(sides: [i32; 4], shared: [bool; 4]) -> bool {
    let looks = |side: i32, behind: bool| (0..4).any(|i| sides[i] == side && shared[i] == behind);
    let bare = |i: usize| sides[i] == 0 && shared[i];
    // A shared face without area borders on another flat tetrahedron: that one has to go first.
    if (0..4).any(bare) {
        return false;
    }
    match (looks(1, true), looks(-1, true)) {
        (false, false) => true,
        (true, true) => false,
        (up, _) => {
            let (inner, outer) = if up { (1, -1) } else { (-1, 1) };
            !looks(inner, false) && !looks(outer, true)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Field, check, kuhn_tets};

    fn mesh(positions: &[[f64; 3]], tets: &[[u32; 4]]) -> TetMesh {
        let values = (0..positions.len()).map(|i| i as f64).collect();
        let fields = vec![Field::new("f", values)];
        TetMesh { positions: positions.to_vec(), tets: tets.to_vec(), fields, ..TetMesh::default() }
    }

    fn repaired(positions: &[[f64; 3]], tets: &[[u32; 4]]) -> (TetMesh, RepairReport) {
        let (mesh, report) = repair(mesh(positions, tets)).unwrap();
        check(&mesh).unwrap();
        (mesh, report)
    }

    /// A unit square at z = 0 (points 0..4), apexes below (4) and above (5).
    const SQUARE: [[f64; 3]; 6] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.4, 0.5, -1.0],
        [0.4, 0.5, 1.0],
    ];
    /// The flat tetrahedron on the square.
    const SLIVER: [u32; 4] = [0, 1, 2, 3];
    /// Two below the square, cut along 0-2; positive.
    const BELOW: [[u32; 4]; 2] = [[0, 2, 1, 4], [0, 3, 2, 4]];
    /// Two above the square, cut along 1-3; positive.
    const ABOVE: [[u32; 4]; 2] = [[0, 1, 3, 5], [1, 2, 3, 5]];

    #[test]
    fn a_good_mesh_is_left_alone() {
        let (out, report) = repaired(&SQUARE[..5], &BELOW);
        assert_eq!((out, report.to_string()), (mesh(&SQUARE[..5], &BELOW), String::new()));
        assert!(report.is_empty());
    }

    #[test]
    fn unused_points_go_and_fields_follow() {
        let (out, report) = repaired(&SQUARE, &BELOW);
        assert_eq!(report, RepairReport { unused_points: 1, ..RepairReport::default() });
        assert_eq!(report.to_string(), "repaired: dropped 1 unused point");
        assert_eq!(out.fields[0].values, [0.0, 1.0, 2.0, 3.0, 4.0]);
    }

    #[test]
    fn inverted_tetrahedra_are_turned() {
        let (out, report) = repaired(&SQUARE[..5], &[BELOW[0], [3, 0, 2, 4]]);
        assert_eq!(report, RepairReport { turned_tets: 1, ..RepairReport::default() });
        assert_eq!(out.tets, [BELOW[0], [3, 0, 4, 2]]);
        assert_eq!(report.to_string(), "repaired: turned 1 inverted tetrahedron");
    }

    #[test]
    fn folds_are_refused() {
        // The second tetrahedron's apex was pulled through the shared face.
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.1, 0.1, 1.0], [0.2, 0.2, 0.5]];
        let error = repair(mesh(&points, &[[0, 1, 2, 3], [0, 2, 1, 4]])).unwrap_err();
        assert_eq!(error, MeshError::Folded { tets: [0, 1] });
    }

    #[test]
    fn boundary_slivers_go() {
        let (out, report) = repaired(&SQUARE[..5], &[SLIVER, BELOW[0], BELOW[1]]);
        assert_eq!(report, RepairReport { flat_tets: 1, ..RepairReport::default() });
        assert_eq!(out.tets, BELOW);
    }

    #[test]
    fn fields_at_cells_follow_their_cells() {
        let mut input = mesh(&SQUARE[..5], &[BELOW[0], SLIVER, BELOW[1], BELOW[0]]);
        input.cell_fields = vec![Field::new("m", vec![1.0, 2.0, 3.0, 4.0]), Field::new("named", Vec::new())];
        let (out, _) = repair(input).unwrap();
        assert_eq!(out.cell_fields[0].values, [1.0, 3.0]);
        assert!(out.cell_fields[1].values.is_empty());
    }

    #[test]
    fn slivers_go_in_layers() {
        // Two flat ones on top of the sliver, of which the second has to go before the first can.
        let mut points = SQUARE[..5].to_vec();
        points.push([0.5, 0.4, 0.0]);
        let tets = [BELOW[0], BELOW[1], SLIVER, [0, 1, 3, 5], [1, 2, 3, 5]];
        let (out, report) = repaired(&points, &tets);
        assert_eq!(out.tets, BELOW);
        assert_eq!((report.flat_tets, report.unused_points), (3, 1));
    }

    #[test]
    fn isolated_flat_tetrahedra_go() {
        let (out, report) = repaired(&SQUARE, &[[0, 1, 2, 3], [0, 1, 4, 5]]);
        assert_eq!((out.tets.len(), report.flat_tets), (1, 1));
    }

    #[test]
    fn inner_slivers_are_refused() {
        let tets = [BELOW[0], BELOW[1], SLIVER, ABOVE[0], ABOVE[1]];
        let error = repair(mesh(&SQUARE, &tets)).unwrap_err();
        assert_eq!(error, MeshError::InnerFlat { tet: 2, shared: 4 });
        assert!(error.to_string().contains("cell 2"));
    }

    #[test]
    fn slivers_half_covered_are_refused() {
        for tets in [
            vec![BELOW[0], SLIVER, ABOVE[0]],
            vec![BELOW[0], SLIVER],
            vec![BELOW[0], BELOW[1], SLIVER, ABOVE[1]],
        ] {
            let sliver = tets.iter().position(|t| *t == SLIVER).unwrap();
            let error = repair(mesh(&SQUARE, &tets)).unwrap_err();
            assert_eq!(error, MeshError::InnerFlat { tet: sliver as u32, shared: tets.len() as u32 - 1 });
        }
    }

    #[test]
    fn collapsed_edges_are_merged_and_their_neighbours_meet() {
        // A prism split in three whose top edge 3-4 has length zero.
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
        let (out, report) = repaired(&points, &[[0, 1, 2, 3], [1, 2, 3, 4]]);
        assert_eq!(out.tets, [[0, 1, 2, 3]]);
        assert_eq!((report.merged_points, report.collapsed_tets, report.unused_points), (1, 1, 0));
        assert_eq!(report.differing_values, 1);
        assert_eq!(out.positions.len(), 4);
    }

    #[test]
    fn coincident_points_without_an_edge_stay_apart() {
        // Two tetrahedra that touch in a face but share no point.
        let points = [SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[4], SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[5]];
        let (out, report) = repaired(&points, &[[0, 2, 1, 3], [4, 5, 6, 7]]);
        assert!(report.is_empty());
        assert_eq!(out.positions.len(), 8);
    }

    #[test]
    fn duplicates_go_and_crowds_are_refused_with_the_numbers_of_the_input() {
        let (out, report) = repaired(&SQUARE[..5], &[BELOW[0], BELOW[1], [4, 2, 0, 1], BELOW[0]]);
        assert_eq!((out.tets.as_slice(), report.duplicate_tets), (&BELOW[..], 2));
        let points = [SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[4], SQUARE[5], [0.3, 0.3, 2.0]];
        let tets = [[0, 1, 2, 3], [0, 1, 1, 3], [0, 1, 2, 4], [0, 1, 2, 5]];
        let error = repair(mesh(&points, &tets)).unwrap_err();
        assert_eq!(error, MeshError::CrowdedFace { face: [0, 1, 2], tets: vec![0, 2, 3] });
    }

    #[test]
    fn nothing_left_is_an_error() {
        assert_eq!(repair(mesh(&SQUARE, &[SLIVER])).unwrap_err(), MeshError::Empty);
        assert_eq!(repair(mesh(&SQUARE, &[])).unwrap_err(), MeshError::Empty);
    }

    #[test]
    fn a_grid_with_every_other_tetrahedron_inverted_comes_back() {
        let grid = crate::mesh::Grid { dims: [4, 3, 3], origin: [0.0; 3], spacing: [0.1, 0.2, 0.3] };
        let mut mesh = TetMesh::from_grid(grid, Vec::new());
        mesh.tets.iter_mut().step_by(2).for_each(|t| t.swap(0, 1));
        let (out, report) = repair(mesh).unwrap();
        check(&out).unwrap();
        assert_eq!(report.turned_tets, kuhn_tets([4, 3, 3]).len() / 2);
        assert_eq!(out.grid, Some(grid));
    }
}
