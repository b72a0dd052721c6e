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
//! 4. *Open seams*, at level [`RepairLevel::Weld`] alone: where two faces of which neither has a neighbour lie on each
//!    other, seen from opposite sides, their points become one; the first stays where it is. Tetrahedra that lie on
//!    each other become duplicates, of which the first stays. A mesh of which a tetrahedron would become flat or
//!    inverted is refused.
//! 5. The two tetrahedra of a shared face must then lie on opposite sides of it; a mesh that is folded is refused.
//! 6. *Flat tetrahedra* are dropped at the boundary, where those faces that are boundary look to one side and
//!    those that are shared to the other: the domain stays the same and the shared faces become its boundary.
//!    Any other flat tetrahedron is refused.
//! 7. *Unused points* are dropped.
//!
//! Whether a tetrahedron is flat or inverted is decided exactly. At level [`RepairLevel::None`] a mesh is refused to
//! which any rule applies.

mod findings;
mod level;
mod weld;

pub use findings::{MeshFindings, findings};
pub use level::RepairLevel;

use std::fmt;

use serde::Serialize;

use crate::mesh::adjacency::{DisjointSets, FaceTable, HalfFace, crowded, match_faces};
use crate::mesh::check::{Sides, check_arrays};
use crate::mesh::{FACES, InputCell, MeshError, NONE, TetMesh};

/// What [`repair_at`] did; displays as one line, empty when there was nothing to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RepairReport {
    /// Points merged into a coincident one.
    pub merged_points: usize,
    /// Points merged into another one so that an open seam closed.
    pub welded_points: usize,
    /// Merged and welded points of which a field value differed from that of the point that stayed.
    pub differing_values: usize,
    /// Tetrahedra dropped because two of their vertices are one.
    #[serde(rename = "collapsed_tetrahedra")]
    pub collapsed_tets: usize,
    /// Tetrahedra dropped because an earlier one has the same vertices.
    #[serde(rename = "duplicate_tetrahedra")]
    pub duplicate_tets: usize,
    /// Inverted tetrahedra that were turned round.
    #[serde(rename = "turned_tetrahedra")]
    pub turned_tets: usize,
    /// Flat tetrahedra dropped from the boundary.
    #[serde(rename = "flat_tetrahedra")]
    pub flat_tets: usize,
    /// Points dropped because no tetrahedron uses them.
    pub unused_points: usize,
}

impl RepairReport {
    /// Whether nothing was done.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// What was done, in words.
    fn actions(&self) -> String {
        let mut done = Vec::new();
        let mut say = |count: usize, before: &str, one: &str, many: &str| {
            if count > 0 {
                done.push(format!("{before} {count} {}", if count == 1 { one } else { many }));
            }
        };
        say(self.merged_points, "merged", "coincident point", "coincident points");
        say(self.welded_points, "welded", "point of an open seam", "points of open seams");
        say(self.differing_values, "of which", "had another field value", "had other field values");
        say(self.collapsed_tets, "dropped", "collapsed tetrahedron", "collapsed tetrahedra");
        say(self.duplicate_tets, "dropped", "duplicate tetrahedron", "duplicate tetrahedra");
        say(self.turned_tets, "turned", "inverted tetrahedron", "inverted tetrahedra");
        say(self.flat_tets, "dropped", "flat boundary tetrahedron", "flat boundary tetrahedra");
        say(self.unused_points, "dropped", "unused point", "unused points");
        done.join(", ")
    }
}

impl fmt::Display for RepairReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() { Ok(()) } else { write!(f, "repaired: {}", self.actions()) }
    }
}

/// Mends `mesh` at the level [`RepairLevel::Safe`]; the result passes `crate::mesh::check`.
///
/// # Errors
/// If something cannot be mended; cells and points are numbered as in `mesh`.
pub fn repair(mesh: TetMesh) -> Result<(TetMesh, RepairReport), MeshError> {
    repair_at(mesh, RepairLevel::Safe)
}

/// Mends `mesh` by the rules of this level; the result passes `crate::mesh::check`. [`findings`] says what is unusual
/// about it.
///
/// ```
/// use tetralod::mesh::{RepairLevel, TetMesh, findings, repair_at};
///
/// // Two tetrahedra on one face, of which each has its own points.
/// let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// let positions = [&corners[..], &[[0.0, 0.0, 1.0]], &corners, &[[0.0, 0.0, -1.0]]].concat();
/// let mesh = TetMesh { positions, tets: vec![[0, 1, 2, 3], [4, 6, 5, 7]], ..TetMesh::default() };
/// assert_eq!(findings(&mesh, 0.0)?.weldable_faces, 2);
///
/// let (mesh, report) = repair_at(mesh, RepairLevel::Weld { distance: 0.0 })?;
/// assert_eq!(report.to_string(), "repaired: welded 3 points of open seams");
/// assert_eq!(findings(&mesh, 0.0)?.components, 1);
/// # Ok::<(), tetralod::mesh::MeshError>(())
/// ```
///
/// # Errors
/// If something cannot be mended, or may not be at this level; cells and points are numbered as in `mesh`.
pub fn repair_at(mesh: TetMesh, level: RepairLevel) -> Result<(TetMesh, RepairReport), MeshError> {
    check_arrays(&mesh).map_err(|error| error.in_input(|tet| mesh.input.cells.cell_of(tet)))?;
    let mut work = Work::new(mesh);
    work.merge_collapsed_edges();
    work.drop_collapsed();
    work.drop_duplicates()?;
    let mut flat = work.turn_inverted();
    if let RepairLevel::Weld { distance } = level {
        work.weld(&flat, distance)?;
        flat = work.turn_inverted();
    }
    let faces = work.conforming_faces(&flat)?;
    work.drop_flat(flat, &faces)?;
    work.drop_unused_points();
    work.mesh.input.cells.keep(&work.cells);
    if work.mesh.tets.is_empty() {
        return Err(MeshError::Empty);
    }
    if level == RepairLevel::None && !work.report.is_empty() {
        return Err(MeshError::NeedsRepair { repairs: work.report.actions() });
    }
    debug_assert_eq!(crate::mesh::check(&work.mesh), Ok(()), "repair must give a valid mesh");
    Ok((work.mesh, work.report))
}

struct Work {
    mesh: TetMesh,
    /// The number that each tetrahedron that is left had at first.
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
        self.report.merged_points = self.merge(&pairs);
    }

    /// Makes one point of each pair; returns how many points that replaced.
    fn merge(&mut self, pairs: &[(u32, u32)]) -> usize {
        if pairs.is_empty() {
            return 0;
        }
        let mut sets = DisjointSets::of(self.mesh.positions.len());
        pairs.iter().for_each(|&(a, b)| sets.join(a as usize, b as usize));
        let target: Vec<usize> = (0..self.mesh.positions.len()).map(|v| sets.root(v)).collect();
        let mut merged = 0;
        for (v, &to) in target.iter().enumerate().filter(|&(v, &to)| v != to) {
            merged += 1;
            let differs = |f: &crate::mesh::Field| f.values[v] != f.values[to];
            self.report.differing_values += usize::from(self.mesh.fields.iter().any(differs));
        }
        self.mesh.tets.iter_mut().flatten().for_each(|v| *v = target[*v as usize] as u32);
        merged
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
        self.report.duplicate_tets += self.retain(|t, _| !repeats[t]);
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

    /// Rule 4.
    fn weld(&mut self, flat: &[bool], distance: f64) -> Result<(), MeshError> {
        if !(distance >= 0.0 && distance.is_finite()) {
            return Err(MeshError::WeldDistance);
        }
        let pairs = weld::seam_pairs(&self.mesh, flat, distance).map_err(|error| self.with_cells(error))?;
        self.report.welded_points = self.merge(&pairs);
        if distance > 0.0 {
            let sides = Sides::new(&self.mesh.positions);
            let changed = |(tet, flat): (&[u32; 4], &bool)| !flat && sides.of(*tet) != 1;
            if let Some(t) = self.mesh.tets.iter().zip(flat).position(changed) {
                return Err(MeshError::WeldTooFar { tet: self.cell(t as u32) });
            }
        }
        if pairs.is_empty() { Ok(()) } else { self.drop_duplicates() }
    }

    /// Rule 5; returns the neighbours.
    fn conforming_faces(&self, flat: &[bool]) -> Result<Vec<[u32; 4]>, MeshError> {
        let fits = |group: &[HalfFace], folded: bool| match group {
            [a, b] if folded && !flat[a.tet() as usize] && !flat[b.tet() as usize] => {
                Err(MeshError::Folded { tets: [a, b].map(|face| self.cell(face.tet())) })
            }
            [_, _] => Ok(()),
            _ => Err(self.with_cells(crowded(group))),
        };
        match_faces(&FaceTable::new(&self.mesh.tets)?, fits)
    }

    /// `error` with the input's numbers.
    fn with_cells(&self, error: MeshError) -> MeshError {
        error.in_input(|tet| self.cell(tet))
    }

    /// The input's cell that a tetrahedron is of.
    fn cell(&self, tet: u32) -> InputCell {
        self.mesh.input.cells.cell_of(self.cells[tet as usize])
    }

    /// Rule 6: peels flat tetrahedra off the boundary until none can go.
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
            return Err(MeshError::InnerFlat { tet: self.cell(t as u32), shared: shared as u32 });
        }
        self.report.flat_tets = self.retain(|t, _| !gone[t]);
        Ok(())
    }

    /// Rule 7.
    fn drop_unused_points(&mut self) {
        let mut used = vec![false; self.mesh.positions.len()];
        self.mesh.tets.iter().flatten().for_each(|&v| used[v as usize] = true);
        let kept = used.iter().filter(|&&u| u).count();
        let dropped = used.len() - kept;
        if dropped == 0 {
            return;
        }
        // Merged points are counted as merged, not as unused.
        let merged = self.report.merged_points + self.report.welded_points;
        self.report.unused_points = dropped - merged.min(dropped);
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
mod tests;
