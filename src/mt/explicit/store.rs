//! The explicit Multi-Tessellation [§3]: every tetrahedron, every update and the whole DAG is stored.
//!
//! It is independent of what kind of update the MT is made of, needs no geometry to find parents and children, and
//! takes 24n + 28m bytes for n reference vertices and m tetrahedra by the paper's estimate. Here it is the baseline
//! that compact structures are measured against, and the oracle that they must agree with.
//!
//! Tetrahedra are numbered: first those of the base mesh, then those that update 0 inserts, then those of update 1
//! and so on. They are positive, in numbers of MT vertices, ascending but for the last two.

use crate::geom::orient3d;
use crate::mesh::NONE;
use crate::mt::pages::Rows;
use crate::mt::replay::{ReplayError, canonical, replay};
use crate::mt::update_errors::Errors;
use crate::mt::{
    ApplyUpdates, BaseMesh, ErrorCode, MAX_QUARTERINGS, MtInfo, MultiTessellation, UpdateError, UpdateId,
    VertexId,
};
use std::collections::HashMap;
use std::ops::Range;

/// An update of an [`ExplicitMt`]: all that it removes and inserts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExplicitUpdate<'a> {
    /// Positions of the vertices that appear with `u+`; they are numbered as they come, after the base vertices.
    pub positions: &'a [[i32; 3]],
    /// Their field levels, vertex by vertex.
    pub levels: &'a [i32],
    /// The numbers of the tetrahedra that `u+` removes, in any order.
    pub removed: &'a [u32],
    /// The tetrahedra that `u+` inserts, positive, in numbers of vertices.
    pub inserted: &'a [[u32; 4]],
    /// Field by field, what bounds the error of every tetrahedron that `u+` removes, and of all updates that depend on this
    /// one.
    pub errors: &'a [ErrorCode],
}

/// An explicit MT. [`MtInfo::kind`] is that of the compact MT with the same updates, as far as there is one.
///
/// It grows by [`push`](ExplicitMt::push), coarse to fine; every prefix of an MT is an MT.
#[derive(Clone, Debug, PartialEq)]
pub struct ExplicitMt {
    pub(in crate::mt) info: MtInfo,
    base: BaseMesh,
    positions: Vec<[i32; 3]>,
    levels: Vec<i32>,
    tets: Vec<[u32; 4]>,
    /// First vertex that appears with each update, and the end of all.
    created: Vec<u32>,
    /// First inserted tetrahedron of each update, and the end of all.
    inserted: Vec<u32>,
    removed: Rows<u32>,
    parents: Rows<u32>,
    /// The update that removes each tetrahedron; [`NONE`] if there is none so far. Children follow from it.
    remover: Vec<u32>,
    errors: Errors,
    /// The [quarterings](crate::mt::ApplyUpdates::quarterings) of each tetrahedron, if they have errors of their own.
    quarterings: Option<Vec<u8>>,
    /// The [fall](crate::mt::MultiTessellation::own_fall) of each update, then.
    own_falls: Vec<u8>,
    pub(super) to_come: ErrorCode,
    /// Whether every update so far inserts more tetrahedra than it removes.
    pub(in crate::mt) always_grows: bool,
}

/// What an explicit MT consists of, in numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::mt) struct Counts {
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

/// Most tetrahedra, and most vertices, that an explicit MT can number.
pub(in crate::mt) const MAX_TETS: usize = 1 << 31;

impl ExplicitMt {
    /// An MT without updates. `base` must fit `info`: see [`BaseMesh::check`].
    pub fn new(info: MtInfo, base: BaseMesh) -> Self {
        let base_tets = base.tets.len();
        let errors = Errors::new(info.fields.len());
        Self {
            info,
            positions: base.positions.clone(),
            levels: base.values.clone(),
            tets: base.tets.iter().map(|&tet| canonical(tet)).collect(),
            created: vec![base.positions.len() as u32],
            inserted: vec![base_tets as u32],
            removed: Rows::new(),
            parents: Rows::new(),
            remover: vec![NONE; base_tets],
            errors,
            quarterings: None,
            own_falls: Vec::new(),
            to_come: ErrorCode::MAX,
            always_grows: true,
            base,
        }
    }

    /// Adds the next update.
    ///
    /// # Errors
    /// What it removes must be there, once and in no other update; what it inserts must be positive on the lattice, with
    /// vertices that are new or of what it removes. Whether it fits the mesh shows when it is applied; that errors do not grow
    /// along the partial order is checked by [`ExplicitMt::check`].
    pub fn push(&mut self, new: &ExplicitUpdate<'_>) -> Result<UpdateId, UpdateError> {
        let update = self.updates();
        let fields = self.info.fields.len();
        let holds = new.levels.len() == new.positions.len() * fields
            && new.positions.iter().zip(new.levels.chunks(fields)).all(|(&p, q)| self.info.holds(p, q));
        if !holds {
            return Err(UpdateError::OffLattice { update });
        }
        let old = self.positions.len();
        let position = |v: u32| match (v as usize).checked_sub(old) {
            None => self.positions.get(v as usize).copied(),
            Some(i) => new.positions.get(i).copied(),
        };
        for tet in new.inserted {
            let [Some(a), Some(b), Some(c), Some(d)] = tet.map(position) else {
                return Err(UpdateError::Cavity { update });
            };
            if orient3d(a, b, c, d) <= 0 {
                return Err(UpdateError::Inverted { update });
            }
        }
        let mut removed = new.removed.to_vec();
        removed.sort_unstable();
        let there = removed.iter().all(|&t| self.remover.get(t as usize) == Some(&NONE));
        let few = self.tets.len() + new.inserted.len() <= MAX_TETS && old + new.positions.len() <= MAX_TETS;
        let twice = removed.windows(2).any(|pair| pair[0] == pair[1]);
        if !there || !few || twice || removed.is_empty() || new.inserted.is_empty() {
            return Err(UpdateError::Cavity { update });
        }
        let mut corners: Vec<u32> = removed.iter().flat_map(|&t| self.tets[t as usize]).collect();
        corners.sort_unstable();
        let at_hand = |v: &u32| *v as usize >= old || corners.binary_search(v).is_ok();
        if !new.inserted.iter().flatten().all(at_hand) {
            return Err(UpdateError::Cavity { update });
        }
        if !self.errors.push(new.errors) {
            return Err(UpdateError::Error { update });
        }
        let mut parents: Vec<u32> =
            removed.iter().filter_map(|&t| self.inserted_by(t)).map(|u| u.0).collect();
        parents.dedup();
        removed.iter().for_each(|&t| self.remover[t as usize] = update);
        self.parents.push(&parents);
        self.removed.push(&removed);
        self.positions.extend_from_slice(new.positions);
        self.created.push(self.positions.len() as u32);
        self.levels.extend_from_slice(new.levels);
        let first = self.tets.len();
        self.tets.extend(new.inserted.iter().map(|&tet| canonical(tet)));
        self.tets[first..].sort_unstable();
        self.remover.resize(self.tets.len(), NONE);
        if let Some(quarterings) = &mut self.quarterings {
            quarterings.resize(self.tets.len(), 0);
            self.own_falls.push(0);
        }
        self.inserted.push(self.tets.len() as u32);
        self.always_grows &= new.inserted.len() > new.removed.len();
        Ok(UpdateId(update))
    }

    /// Gives each update a [fall](crate::mt::MultiTessellation::own_fall), and each tetrahedron
    /// [quarterings](crate::mt::ApplyUpdates::quarterings). Those of what is pushed later are 0.
    ///
    /// # Errors
    /// If there is not a number for each update, and one of at most [`MAX_QUARTERINGS`] for each tetrahedron.
    pub fn set_tet_errors(&mut self, falls: Vec<u8>, quarterings: Vec<u8>) -> Result<(), UpdateError> {
        let sound = quarterings.len() == self.tets.len() && falls.len() == self.updates() as usize;
        if !sound || !quarterings.iter().all(|&own| own <= MAX_QUARTERINGS) {
            return Err(UpdateError::Error { update: 0 });
        }
        (self.quarterings, self.own_falls) = (Some(quarterings), falls);
        Ok(())
    }

    /// The quarterings of all tetrahedra; none if they have no errors of their own.
    pub fn quarterings(&self) -> Option<&[u8]> {
        self.quarterings.as_deref()
    }

    /// The quarterings of tetrahedron `t`.
    pub fn quarterings_of(&self, t: u32) -> u8 {
        self.quarterings.as_ref().and_then(|all| all.get(t as usize)).copied().unwrap_or(0)
    }

    /// Spells out an MT of any kind by applying all its updates.
    ///
    /// # Errors
    /// If one of them cannot be applied.
    pub fn of(mt: &impl ApplyUpdates) -> Result<Self, ReplayError> {
        let mut explicit = Self::new(mt.info().clone(), mt.base().clone());
        // The tetrahedra of the current mesh, by their vertices.
        let mut live: HashMap<[u32; 4], u32> = explicit.tets.iter().copied().zip(0..).collect();
        let mut quarterings = mt.has_tet_errors().then(|| vec![0; explicit.tets.len()]);
        let falls = |explicit: &Self| (0..explicit.updates()).map(|u| mt.own_fall(UpdateId(u))).collect();
        let mut failed = Ok(UpdateId(0));
        replay(mt, |step| {
            let old = explicit.positions.len() as u32;
            let newest = step.inserted.iter().flatten().copied().fold(0, u32::max);
            let (mut positions, mut levels) = (Vec::new(), Vec::new());
            for slot in (old..newest + 1).filter_map(|v| step.mesh.slot(VertexId(v))) {
                positions.push(step.mesh.positions()[slot as usize]);
                levels.extend_from_slice(step.mesh.levels(slot));
            }
            let removed: Vec<u32> = step.removed.iter().filter_map(|tet| live.remove(tet)).collect();
            if let Some(all) = &mut quarterings {
                all.resize(explicit.tets.len(), 0);
                removed.iter().zip(step.quarterings).for_each(|(&t, &own)| all[t as usize] = own);
            }
            let first = explicit.tets.len();
            let pushed = explicit.push(&ExplicitUpdate {
                positions: &positions,
                levels: &levels,
                removed: &removed,
                inserted: step.inserted,
                errors: mt.errors(step.update),
            });
            if failed.is_ok() {
                failed = pushed;
            }
            live.extend((first..explicit.tets.len()).map(|t| (explicit.tets[t], t as u32)));
        })?;
        failed?;
        if let Some(mut all) = quarterings {
            all.resize(explicit.tets.len(), 0);
            let falls = falls(&explicit);
            explicit.set_tet_errors(falls, all).map_err(ReplayError::Update)?;
        }
        Ok(explicit)
    }

    /// Number of vertices that appear in any mesh of the MT.
    pub fn vertices(&self) -> u32 {
        self.positions.len() as u32
    }

    /// Number of fields.
    pub fn fields(&self) -> usize {
        self.info.fields.len()
    }

    /// The position of a vertex on the lattice.
    pub fn position(&self, v: VertexId) -> [i32; 3] {
        self.positions[v.0 as usize]
    }

    /// The levels of all fields at a vertex.
    pub fn levels(&self, v: VertexId) -> &[i32] {
        &self.levels[v.0 as usize * self.fields()..][..self.fields()]
    }

    /// All tetrahedra of the MT, in numbers of its vertices.
    pub fn tets(&self) -> &[[u32; 4]] {
        &self.tets
    }

    /// Which tetrahedra make up the base mesh.
    pub fn base_tets(&self) -> Range<u32> {
        0..self.base.tets.len() as u32
    }

    /// Which vertices appear with `u+`.
    pub fn created(&self, u: UpdateId) -> Range<u32> {
        self.created[u.0 as usize]..self.created[u.0 as usize + 1]
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
    pub fn children(&self, u: UpdateId) -> Vec<u32> {
        let mut children: Vec<u32> =
            self.inserted(u).filter_map(|t| self.removed_by(t)).map(|child| child.0).collect();
        children.sort_unstable();
        children.dedup();
        children
    }

    /// The update that removes tetrahedron `t`; none if it belongs to the reference mesh (as far as it is known).
    #[inline]
    pub fn removed_by(&self, t: u32) -> Option<UpdateId> {
        Some(self.remover[t as usize]).filter(|&u| u != NONE).map(UpdateId)
    }

    /// The update that inserts tetrahedron `t`; none if it belongs to the base mesh.
    pub fn inserted_by(&self, t: u32) -> Option<UpdateId> {
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
        live[..self.base.tets.len()].fill(true);
        for u in (0..self.updates()).map(UpdateId).filter(|u| set.get(u.0 as usize) == Some(&true)) {
            self.inserted(u).for_each(|t| live[t as usize] = true);
            self.removed(u).iter().for_each(|&t| live[t as usize] = false);
        }
        Some((0..NONE).zip(&live).filter(|(_, live)| **live).map(|(t, _)| t).collect())
    }

    pub(in crate::mt) fn counts(&self) -> Counts {
        Counts {
            fields: self.fields() as u64,
            vertices: self.positions.len() as u64,
            tets: self.tets.len() as u64,
            updates: u64::from(self.updates()),
            removed: self.removed.items().len() as u64,
            arcs: self.parents.items().len() as u64,
        }
    }

    /// Storage by the paper's way of counting: 4 bytes for a coordinate, a field value or an index, 1 for a counter.
    ///
    /// The paper estimates it as 24n + 28m, with n the vertices of the reference mesh and m all tetrahedra of the MT:
    /// that takes one arc for each tetrahedron, where there are fewer, and does not count the vertices outside the
    /// reference mesh, which edge-based MTs have.
    pub fn paper_bytes(&self) -> u64 {
        self.counts().bytes()
    }
}

impl MultiTessellation for ExplicitMt {
    fn info(&self) -> &MtInfo {
        &self.info
    }

    /// The base mesh: its tetrahedra are the first of [`ExplicitMt::tets`], in the same order.
    fn base(&self) -> &BaseMesh {
        &self.base
    }

    fn updates(&self) -> u32 {
        self.inserted.len() as u32 - 1
    }

    fn always_grows(&self) -> bool {
        self.always_grows
    }

    fn error(&self, u: UpdateId) -> ErrorCode {
        self.errors.largest(u.0 as usize)
    }

    fn errors(&self, u: UpdateId) -> &[ErrorCode] {
        self.errors.of(u.0 as usize)
    }

    fn has_tet_errors(&self) -> bool {
        self.quarterings.is_some()
    }

    fn own_fall(&self, u: UpdateId) -> u8 {
        self.own_falls.get(u.0 as usize).copied().unwrap_or(0)
    }

    fn to_come(&self) -> ErrorCode {
        if self.updates() >= self.info.updates { ErrorCode::ZERO } else { self.to_come }
    }

    fn bytes(&self) -> u64 {
        let vertices = size_of_val(&self.positions[..]) + size_of_val(&self.levels[..]);
        let tets = size_of_val(&self.tets[..]) + size_of_val(&self.remover[..]);
        let nodes = size_of_val(&self.created[..])
            + size_of_val(&self.inserted[..])
            + self.removed.bytes()
            + self.parents.bytes()
            + self.errors.bytes()
            + self.quarterings.as_ref().map_or(0, Vec::len)
            + self.own_falls.len();
        self.base.bytes() + (vertices + tets + nodes) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Lattice;
    use crate::mt::{EdgeMtBuilder, FieldInfo, MtFault, MtKind, VertexSplit};

    /// An octahedron around a vertex that is split along z and whose upper half is split along x.
    fn twice_split() -> ExplicitMt {
        let field = FieldInfo {
            name: "f".into(),
            min: 0.0,
            max: 1.0,
            origin: 0.0,
            step: 1.0 / 255.0,
            bits: 8,
            ..FieldInfo::default()
        };
        let info = MtInfo {
            kind: MtKind::Edge,
            lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits: 8 },
            fields: vec![field],
            vertices: 9,
            tetrahedra: 16,
            updates: 2,
            displacement_per_error: 1.0,
            quantization: 0.0,
            bounds: None,
        };
        let axes = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
        let mut positions = vec![[64; 3]];
        positions.extend(axes.map(|a: [i32; 3]| a.map(|x| 64 + 32 * x)));
        let ring = [[1, 2], [2, 3], [3, 4], [4, 1]];
        let mut tets: Vec<[u32; 4]> = ring.map(|[a, b]| [0, a, b, 5]).to_vec();
        tets.extend(ring.map(|[a, b]| [0, b, a, 6]));
        let values = (3..10).collect();
        let base = BaseMesh { positions, values, tets };
        let mut builder = EdgeMtBuilder::new(info, base).expect("a valid base mesh");
        // In order, the faces are 1 2 5, 1 2 6, 1 4 5, 1 4 6, 2 3 5, 2 3 6, 3 4 5, 3 4 6.
        let along_z = VertexSplit {
            vertex: VertexId(0),
            offset: [0, 0, 16],
            field_offsets: &[3],
            mask: 0b1010_1010,
            errors: &[ErrorCode(9)],
        };
        builder.push(&along_z).expect("a valid split");
        // The upper half is 7, the lower 8: 1 2 5, 1 2 8, 1 4 5, 1 4 8 go to the side of 1, the rest to that of 3.
        let along_x = VertexSplit {
            vertex: VertexId(7),
            offset: [16, 0, 0],
            field_offsets: &[-3],
            mask: 0b1111_0000,
            errors: &[ErrorCode(5)],
        };
        builder.push(&along_x).expect("a valid split");
        ExplicitMt::of(builder.mt()).expect("a valid MT")
    }

    #[test]
    fn a_small_mt_is_as_worked_out_by_hand() {
        let mt = twice_split();
        assert_eq!(mt.check(), Ok(()));
        let (first, second) = (UpdateId(0), UpdateId(1));
        assert_eq!((mt.base_tets(), mt.inserted(first), mt.inserted(second)), (0..8, 8..20, 20..32));
        assert_eq!(mt.removed(first), [0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(mt.removed(second).len(), 8);
        assert_eq!((mt.parents(second), mt.children(first)), (&[0][..], vec![1]));
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
        assert_eq!(mt.paper_bytes(), 11 * 16 + 32 * 16 + 2 * 8 + 16 * 4 + 8);
    }

    #[test]
    fn the_check_finds_every_kind_of_fault() {
        let (first, second) = (UpdateId(0), UpdateId(1));
        let fault = |spoil: &dyn Fn(&mut ExplicitMt)| {
            let mut mt = twice_split();
            spoil(&mut mt);
            mt.check()
        };
        assert_eq!(fault(&|mt| mt.errors.swap()), Err(MtFault::Error { update: second }));
        let removes_nothing = |mt: &mut ExplicitMt| mt.remover.fill(NONE);
        assert_eq!(fault(&removes_nothing), Err(MtFault::Order { update: first }));
        let mut no_parents = Rows::new();
        (0..2).for_each(|_| no_parents.push(&[]));
        // Its child does not know it.
        assert_eq!(fault(&|mt| mt.parents = no_parents.clone()), Err(MtFault::Order { update: first }));
        assert_eq!(fault(&|mt| mt.tets[3].swap(0, 1)), Err(MtFault::Tetrahedron { update: None }));
        assert_eq!(fault(&|mt| mt.tets[9].swap(0, 1)), Err(MtFault::Tetrahedron { update: Some(first) }));
        assert_eq!(fault(&|mt| mt.tets[21][0] = 11), Err(MtFault::Tetrahedron { update: Some(second) }));
        assert_eq!(fault(&|mt| mt.tets[1] = mt.tets[0]), Err(MtFault::Face { update: None }));
        // A tetrahedron that stays where new ones go.
        let stays = |mt: &mut ExplicitMt| {
            let removed = mt.removed.row(1).to_vec();
            let (last, others) = removed.split_last().expect("a removed tetrahedron");
            mt.removed.pop();
            mt.removed.push(others);
            mt.remover[*last as usize] = NONE;
        };
        assert_eq!(fault(&stays), Err(MtFault::Face { update: Some(second) }));
        // A new tetrahedron left out: a hole in the middle.
        let leaves_out = |mt: &mut ExplicitMt| {
            mt.tets.pop();
            mt.remover.pop();
            mt.inserted[2] -= 1;
        };
        assert_eq!(fault(&leaves_out), Err(MtFault::Torn { update: second }));
    }
}
