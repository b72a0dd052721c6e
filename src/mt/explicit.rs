//! The explicit Multi-Tessellation [§3]: every tetrahedron, every update and the whole DAG spelled out.
//!
//! It is independent of what kind of update the MT is made of, needs no geometry to find parents and children, and
//! takes 24n + 28m bytes for n reference vertices and m tetrahedra by the paper's estimate. Here it is the baseline
//! that compact structures are measured against, and the oracle that they must agree with.
//!
//! Tetrahedra are numbered: first those of the base mesh, then those that update 0 inserts, then those of update 1
//! and so on. They are positive, in numbers of MT vertices, ascending but for the last two.

use super::EdgeMt;
use super::ErrorCode;
use super::UpdateId;
use super::VertexId;
use super::replay::ReplayError;
use super::replay::Step;
use super::replay::canonical;
use super::replay::replay;
use crate::mesh::NONE;
use std::collections::HashMap;
use std::ops::Range;

/// Lists of numbers, one after the other in one array.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Rows {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Rows {
    fn new() -> Self {
        Self { starts: vec![0], items: Vec::new() }
    }

    fn push(&mut self, row: impl IntoIterator<Item = u32>) {
        self.items.extend(row);
        self.starts.push(self.items.len() as u32);
    }

    fn row(&self, i: usize) -> &[u32] {
        &self.items[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}

/// An MT with everything spelled out.
#[derive(Clone, Debug, PartialEq)]
pub struct ExplicitMt {
    fields: usize,
    positions: Vec<[i32; 3]>,
    levels: Vec<i32>,
    tets: Vec<[u32; 4]>,
    base_tets: u32,
    /// First inserted tetrahedron of each update, and the end of all.
    inserted: Vec<u32>,
    removed: Rows,
    parents: Rows,
    children: Rows,
    errors: Vec<ErrorCode>,
}

/// What an explicit MT consists of, in numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Counts {
    pub fields: u64,
    pub vertices: u64,
    pub tets: u64,
    pub updates: u64,
    pub removed: u64,
    pub arcs: u64,
}

impl Counts {
    /// Storage by the paper's way of counting: 4 bytes for a coordinate, a field value or an index, 1 for a counter.
    /// Of each update: how many parents, children and removed tetrahedra there are and which; how many inserted
    /// tetrahedra, and the first.
    pub fn bytes(&self) -> u64 {
        let vertices = self.vertices * 4 * (3 + self.fields);
        let nodes = self.updates * (4 + 4) + 4 * self.removed + 2 * 4 * self.arcs;
        vertices + 16 * self.tets + nodes
    }
}

impl ExplicitMt {
    /// Spells out an edge-based MT by applying all its updates.
    ///
    /// # Errors
    /// If one of them cannot be applied.
    pub fn from_edge(mt: &EdgeMt) -> Result<Self, ReplayError> {
        let base = mt.base();
        let mut explicit = Self {
            fields: mt.info().fields.len(),
            positions: base.positions.clone(),
            levels: base.values.clone(),
            tets: base.tets.iter().map(|&tet| canonical(tet)).collect(),
            base_tets: base.tets.len() as u32,
            inserted: vec![base.tets.len() as u32],
            removed: Rows::new(),
            parents: Rows::new(),
            children: Rows::new(),
            errors: Vec::new(),
        };
        // The tetrahedra of the current mesh, by their vertices.
        let mut live: HashMap<[u32; 4], u32> = explicit.tets.iter().copied().zip(0..).collect();
        replay(mt, |step| {
            explicit.add_vertices(mt, step);
            explicit.add_update(step, &mut live);
            explicit.errors.push(mt.error_of(step.update));
        })?;
        explicit.find_children();
        Ok(explicit)
    }

    fn add_vertices(&mut self, mt: &EdgeMt, step: &Step<'_>) {
        for slot in mt.created(step.update).into_iter().filter_map(|v| step.mesh.slot(v)) {
            self.positions.push(step.mesh.positions()[slot as usize]);
            self.levels.extend_from_slice(step.mesh.levels(slot));
        }
    }

    fn add_update(&mut self, step: &Step<'_>, live: &mut HashMap<[u32; 4], u32>) {
        let mut removed: Vec<u32> = step.removed.iter().filter_map(|tet| live.remove(tet)).collect();
        removed.sort_unstable();
        let mut parents: Vec<u32> = removed.iter().filter_map(|&t| self.creator(t)).map(|u| u.0).collect();
        parents.dedup();
        self.parents.push(parents);
        self.removed.push(removed);
        let first = self.tets.len();
        self.tets.extend_from_slice(step.inserted);
        self.tets[first..].sort_unstable();
        live.extend((first..self.tets.len()).map(|t| (self.tets[t], t as u32)));
        self.inserted.push(self.tets.len() as u32);
    }

    fn find_children(&mut self) {
        let mut children: Vec<Vec<u32>> = vec![Vec::new(); self.updates() as usize];
        for u in 0..self.updates() {
            self.parents.row(u as usize).iter().for_each(|&p| children[p as usize].push(u));
        }
        children.into_iter().for_each(|row| self.children.push(row));
    }

    /// Number of updates.
    pub fn updates(&self) -> u32 {
        self.inserted.len() as u32 - 1
    }

    /// Number of vertices that appear in any mesh of the MT.
    pub fn vertices(&self) -> u32 {
        self.positions.len() as u32
    }

    /// Number of fields.
    pub fn fields(&self) -> usize {
        self.fields
    }

    /// The position of a vertex on the lattice.
    pub fn position(&self, v: VertexId) -> [i32; 3] {
        self.positions[v.0 as usize]
    }

    /// The levels of all fields at a vertex.
    pub fn levels(&self, v: VertexId) -> &[i32] {
        &self.levels[v.0 as usize * self.fields..][..self.fields]
    }

    /// All tetrahedra of the MT, in numbers of its vertices.
    pub fn tets(&self) -> &[[u32; 4]] {
        &self.tets
    }

    /// Which tetrahedra make up the base mesh.
    pub fn base(&self) -> Range<u32> {
        0..self.base_tets
    }

    /// Which tetrahedra `u+` inserts.
    pub fn inserted(&self, u: UpdateId) -> Range<u32> {
        self.inserted[u.0 as usize]..self.inserted[u.0 as usize + 1]
    }

    /// Which tetrahedra `u+` removes, ascending.
    pub fn removed(&self, u: UpdateId) -> &[u32] {
        self.removed.row(u.0 as usize)
    }

    /// The updates that inserted what `u+` removes, ascending.
    pub fn parents(&self, u: UpdateId) -> &[u32] {
        self.parents.row(u.0 as usize)
    }

    /// The updates that remove what `u+` inserts, ascending.
    pub fn children(&self, u: UpdateId) -> &[u32] {
        self.children.row(u.0 as usize)
    }

    /// The error of an update.
    pub fn error(&self, u: UpdateId) -> ErrorCode {
        self.errors[u.0 as usize]
    }

    /// The update that inserts tetrahedron `t`; none if it belongs to the base mesh.
    pub fn creator(&self, t: u32) -> Option<UpdateId> {
        let after = self.inserted.partition_point(|&first| first <= t) as u32;
        after.checked_sub(1).map(UpdateId)
    }

    /// Whether the set (`set[u]`: is update `u` in it) holds every parent of its members.
    pub fn is_consistent(&self, set: &[bool]) -> bool {
        let is_in = |&u: &u32| set.get(u as usize) == Some(&true);
        (0..self.updates()).filter(is_in).all(|u| self.parents(UpdateId(u)).iter().all(is_in))
    }

    /// Whether a consistent set stays consistent when `u` is added to it (if it is not in it), or taken from it (if
    /// it is).
    pub fn is_feasible(&self, set: &[bool], u: UpdateId) -> bool {
        let is_in = |&u: &u32| set.get(u as usize) == Some(&true);
        if is_in(&u.0) { !self.children(u).iter().any(is_in) } else { self.parents(u).iter().all(is_in) }
    }

    /// Σ_S of a consistent set: its tetrahedra, ascending. None if the set is not consistent.
    pub fn extract(&self, set: &[bool]) -> Option<Vec<u32>> {
        if !self.is_consistent(set) {
            return None;
        }
        let mut live = vec![false; self.tets.len()];
        live[..self.base_tets as usize].fill(true);
        for u in (0..self.updates()).map(UpdateId).filter(|u| set.get(u.0 as usize) == Some(&true)) {
            self.inserted(u).for_each(|t| live[t as usize] = true);
            self.removed(u).iter().for_each(|&t| live[t as usize] = false);
        }
        Some((0..NONE).zip(&live).filter(|(_, live)| **live).map(|(t, _)| t).collect())
    }

    pub(super) fn counts(&self) -> Counts {
        Counts {
            fields: self.fields as u64,
            vertices: self.positions.len() as u64,
            tets: self.tets.len() as u64,
            updates: u64::from(self.updates()),
            removed: self.removed.items.len() as u64,
            arcs: self.parents.items.len() as u64,
        }
    }

    /// Storage by the paper's way of counting: 4 bytes for a coordinate, a field value or an index, 1 for a counter.
    ///
    /// The paper estimates it as 24n + 28m, with n the vertices of the reference mesh and m all tetrahedra of the MT:
    /// that takes one arc for each tetrahedron, where there are fewer, and does not count the vertices outside the
    /// reference mesh, which edge-based MTs have.
    pub fn bytes(&self) -> u64 {
        self.counts().bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::super::BaseMesh;
    use super::super::FieldInfo;
    use super::super::MtFault;
    use super::super::MtInfo;
    use super::super::MtKind;
    use super::super::VertexSplit;
    use super::*;
    use crate::geom::Lattice;

    /// An octahedron around a vertex that is split along z and whose upper half is split along x.
    fn twice_split() -> ExplicitMt {
        let field =
            FieldInfo { name: "f".into(), min: 0.0, max: 1.0, origin: 0.0, step: 1.0 / 255.0, bits: 8 };
        let info = MtInfo {
            kind: MtKind::Edge,
            lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits: 8 },
            fields: vec![field],
            vertices: 9,
            tetrahedra: 16,
            updates: 2,
            displacement_per_error: 1.0,
        };
        let axes = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
        let mut positions = vec![[64; 3]];
        positions.extend(axes.map(|a: [i32; 3]| a.map(|x| 64 + 32 * x)));
        let ring = [[1, 2], [2, 3], [3, 4], [4, 1]];
        let mut tets: Vec<[u32; 4]> = ring.map(|[a, b]| [0, a, b, 5]).to_vec();
        tets.extend(ring.map(|[a, b]| [0, b, a, 6]));
        let values = (3..10).collect();
        let mut mt = EdgeMt::new(info, BaseMesh { positions, values, tets });
        // In order, the faces are 1 2 5, 1 2 6, 1 4 5, 1 4 6, 2 3 5, 2 3 6, 3 4 5, 3 4 6.
        let along_z = VertexSplit {
            vertex: VertexId(0),
            offset: [0, 0, 16],
            field_offsets: &[3],
            mask: 0b1010_1010,
            error: ErrorCode(9),
        };
        mt.push(&along_z).expect("a valid split");
        // The upper half is 7, the lower 8: 1 2 5, 1 2 8, 1 4 5, 1 4 8 go to the side of 1, the rest to that of 3.
        let along_x = VertexSplit {
            vertex: VertexId(7),
            offset: [16, 0, 0],
            field_offsets: &[-3],
            mask: 0b1111_0000,
            error: ErrorCode(5),
        };
        mt.push(&along_x).expect("a valid split");
        ExplicitMt::from_edge(&mt).expect("a valid MT")
    }

    #[test]
    fn a_small_mt_is_as_worked_out_by_hand() {
        let mt = twice_split();
        assert_eq!(mt.check(), Ok(()));
        let (first, second) = (UpdateId(0), UpdateId(1));
        assert_eq!((mt.base(), mt.inserted(first), mt.inserted(second)), (0..8, 8..20, 20..32));
        assert_eq!(mt.removed(first), [0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(mt.removed(second).len(), 8);
        assert_eq!((mt.parents(second), mt.children(first)), (&[0][..], &[1][..]));
        assert!(mt.parents(first).is_empty() && mt.children(second).is_empty());
        assert_eq!(
            [7, 8, 9, 10].map(|v| mt.position(VertexId(v))),
            [[64, 64, 72], [64, 64, 56], [72, 64, 72], [56, 64, 72]]
        );
        assert_eq!([7, 8, 9, 10].map(|v| mt.levels(VertexId(v))[0]), [5, 2, 4, 7]);
        assert_eq!(mt.extract(&[false, true]), None);
        assert_eq!(mt.extract(&[true, true]).map(|t| t.len()), Some(16));
        assert!(mt.is_feasible(&[false, false], first) && !mt.is_feasible(&[false, false], second));
        assert!(!mt.is_feasible(&[true, true], first) && mt.is_feasible(&[true, true], second));
        // 11 vertices, 32 tetrahedra, 2 updates with 16 removed tetrahedra and one arc.
        assert_eq!(mt.bytes(), 11 * 16 + 32 * 16 + 2 * 8 + 16 * 4 + 8);
    }

    #[test]
    fn the_check_finds_every_kind_of_fault() {
        let (first, second) = (UpdateId(0), UpdateId(1));
        let fault = |spoil: &dyn Fn(&mut ExplicitMt)| {
            let mut mt = twice_split();
            spoil(&mut mt);
            mt.check()
        };
        assert_eq!(fault(&|mt| mt.errors.swap(0, 1)), Err(MtFault::Error { update: second }));
        assert_eq!(fault(&|mt| mt.children = Rows { starts: vec![0; 3], items: vec![] }), {
            Err(MtFault::Order { update: second })
        });
        let no_parents = Rows { starts: vec![0; 3], items: vec![] };
        assert_eq!(
            fault(&|mt| (mt.parents, mt.children) = (no_parents.clone(), no_parents.clone())),
            Err(MtFault::Order { update: second })
        );
        assert_eq!(fault(&|mt| mt.tets[3].swap(0, 1)), Err(MtFault::Tetrahedron { update: None }));
        assert_eq!(fault(&|mt| mt.tets[9].swap(0, 1)), Err(MtFault::Tetrahedron { update: Some(first) }));
        assert_eq!(fault(&|mt| mt.tets[21][0] = 11), Err(MtFault::Tetrahedron { update: Some(second) }));
        assert_eq!(fault(&|mt| mt.tets[1] = mt.tets[0]), Err(MtFault::Face { update: None }));
        // A tetrahedron that stays where new ones go.
        let stays = |mt: &mut ExplicitMt| {
            let last = mt.removed.items.pop();
            mt.removed.starts[2] -= 1;
            assert!(last.is_some());
        };
        assert_eq!(fault(&stays), Err(MtFault::Face { update: Some(second) }));
        // A new tetrahedron left out: a hole in the middle.
        let leaves_out = |mt: &mut ExplicitMt| {
            mt.tets.pop();
            mt.inserted[2] -= 1;
        };
        assert_eq!(fault(&leaves_out), Err(MtFault::Torn { update: second }));
    }
}
