//! Updates of an explicit MT on the current mesh [§3]: tetrahedra are looked up, and the faces of old and new ones
//! matched. Slow next to the compact structures, but it works for updates of every kind, of any size: an update of n
//! tetrahedra takes n log n.
//!
//! In the current mesh, the tag of a tetrahedron is its number in the MT.

use super::face_occupancy::{FaceOccupancy, faces};
use crate::mesh::NONE;
use crate::mt::error::Result;
use crate::mt::mesh::current::{KindWord, Labels};
use crate::mt::{
    Applied, ApplyUpdates, BaseMeshError, CurrentMesh, ErrorCode, ExplicitMt, LookAtTet, MultiTessellation,
    UpdateError, UpdateId, UpdatePages, VertexId,
};
use std::ops::Range;

impl ExplicitMt {
    /// The slots of these tetrahedra, which must all be in the mesh.
    fn slots(mesh: &CurrentMesh, update: u32, tets: impl Iterator<Item = u32>) -> Result<Vec<u32>> {
        tets.map(|t| mesh.tagged(t).ok_or(UpdateError::Cavity { update })).collect()
    }
}

/// Replaces the tetrahedra in the slots `old` by those of `mt` that are numbered `new`. The mesh stays a mesh, or as
/// it is: no face is taken twice from one side, and only what was next to the old ones gets other neighbours.
fn replace(mt: &ExplicitMt, mesh: &mut CurrentMesh, update: u32, old: &[u32], new: &[u32]) -> Result<()> {
    let torn = UpdateError::Cavity { update };
    let before: Vec<[u32; 4]> =
        old.iter().map(|&t| mesh.tets[t as usize].map(|slot| mesh.vertex(slot).0)).collect();
    let after: Vec<[u32; 4]> = new.iter().map(|&t| mt.tets()[t as usize]).collect();
    let (from, to) = (vertices_of(&before), vertices_of(&after));
    let gone: Vec<u32> = from.iter().copied().filter(|v| to.binary_search(v).is_err()).collect();
    let added: Vec<u32> = to.iter().copied().filter(|v| from.binary_search(v).is_err()).collect();
    // A vertex that comes must not be there already: the mesh would touch itself there.
    if added.iter().any(|&v| mesh.slot(VertexId(v)).is_some()) {
        return Err(torn);
    }
    let beyond = beyond(mesh, old, &before).ok_or(torn.clone())?;
    let Some(mut occupancy) = mesh.take_kind_state::<FaceOccupancy>() else { return Err(torn) };
    let mut meets = None;
    if occupancy.exchange(&before, &after) {
        // A vertex that goes must not be one of what stays.
        let torn_off = gone.iter().any(|&v| occupancy.has_vertex(v));
        meets = meet(&after, &beyond, &occupancy).filter(|_| !torn_off);
        if meets.is_none() {
            occupancy.undo(&before, &after);
        }
    }
    mesh.put_back_kind_state(occupancy);
    perform(mt, mesh, old, new, &meets.ok_or(torn)?, [&gone, &added]);
    Ok(())
}

/// The vertices of these tetrahedra, ascending.
fn vertices_of(tets: &[[u32; 4]]) -> Vec<u32> {
    let mut vertices = tets.as_flattened().to_vec();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// A face seen from a tetrahedron, as a number: its sorted vertices, and in the last bit the side that the tetrahedron
/// is on.
type Side = u128;

fn side_of(([a, b, c], side): ([u32; 3], usize)) -> Side {
    u128::from(a) << 65 | u128::from(b) << 33 | u128::from(c) << 1 | side as u128
}

/// The faces between the tetrahedra in the slots `old`, called `names`, and the rest of the mesh, as seen from the
/// rest: with the slot there, and which of its neighbours is the old one. Ascending.
fn beyond(mesh: &CurrentMesh, old: &[u32], names: &[[u32; 4]]) -> Option<Vec<(Side, u32, u32)>> {
    let mut leave = old.to_vec();
    leave.sort_unstable();
    let mut beyond = Vec::new();
    for (&t, name) in old.iter().zip(names) {
        for (face, n) in faces(name).zip(mesh.neighbors[t as usize]) {
            if n != NONE && leave.binary_search(&n).is_err() {
                let back = (0..).zip(mesh.neighbors[n as usize]).find(|(_, other)| *other == t)?.0;
                beyond.push((side_of(face) ^ 1, n, back));
            }
        }
    }
    beyond.sort_unstable();
    Some(beyond)
}

/// What every face of the new tetrahedra meets: another new one, one beyond, or nothing. None if they leave a face of
/// what is beyond bare, or touch what they did not border on. `occupancy` is that of the mesh with them in it.
fn meet(new: &[[u32; 4]], beyond: &[(Side, u32, u32)], occupancy: &FaceOccupancy) -> Option<Vec<[Meets; 4]>> {
    let mut sides: Vec<(Side, u32, u32)> = Vec::with_capacity(4 * new.len());
    for (t, tet) in (0..).zip(new) {
        sides.extend((0..).zip(faces(tet)).map(|(face, side)| (side_of(side), t, face)));
    }
    sides.sort_unstable();
    let mut meets = vec![[Meets::Nothing; 4]; new.len()];
    let (mut rest, mut outside) = (sides.as_slice(), beyond);
    while let [(side, t, face), tail @ ..] = rest {
        let across = side ^ 1;
        rest = tail;
        // No side is taken twice, so the two of a face follow each other.
        let (own, face) = (*t as usize, *face as usize);
        if let [(other, at, other_face), after @ ..] = tail
            && *other == across
        {
            meets[own][face] = Meets::New(*at);
            meets[*at as usize][*other_face as usize] = Meets::New(*t);
            rest = after;
            continue;
        }
        match outside {
            [(found, n, back), after @ ..] if *found == across => {
                meets[own][face] = Meets::Old(*n, *back);
                outside = after;
            }
            // Those beyond that are passed over stay bare.
            [(found, ..), ..] if *found < across => return None,
            _ => {
                let (face, side) = faces(&new[own]).nth(face)?;
                if occupancy.has_face(&face, 1 - side) {
                    return None;
                }
            }
        }
    }
    outside.is_empty().then_some(meets)
}

/// What lies across a face of a new tetrahedron.
#[derive(Clone, Copy, Debug)]
enum Meets {
    /// The boundary.
    Nothing,
    /// Another new tetrahedron.
    New(u32),
    /// A slot that stays, and which of its neighbours it is.
    Old(u32, u32),
}

fn perform(
    mt: &ExplicitMt,
    mesh: &mut CurrentMesh,
    old: &[u32],
    new: &[u32],
    meets: &[[Meets; 4]],
    [gone, added]: [&[u32]; 2],
) {
    mesh.touch(old);
    old.iter().for_each(|&t| mesh.free_tet(t));
    gone.iter()
        .filter_map(|&v| mesh.slot(VertexId(v)))
        .collect::<Vec<_>>()
        .into_iter()
        .for_each(|slot| mesh.remove_vertex(slot));
    for &v in added {
        let slot = mesh.new_vertex();
        mesh.put_vertex(slot, Labels { vertex: v, kind_word: KindWord::NONE }, mt.position(VertexId(v)));
        let fields = mesh.fields;
        mesh.levels[slot as usize * fields..][..fields].copy_from_slice(mt.levels(VertexId(v)));
    }
    let slots: Vec<u32> = new.iter().map(|_| mesh.new_tet()).collect();
    for ((&t, &number), meets) in slots.iter().zip(new).zip(meets) {
        let tet = mt.tets()[number as usize].map(|v| mesh.slot(VertexId(v)).unwrap_or(NONE));
        mesh.tets[t as usize] = tet;
        mesh.set_tag(t, number);
        for (f, meets) in meets.iter().enumerate() {
            mesh.neighbors[t as usize][f] = match *meets {
                Meets::Nothing => NONE,
                Meets::New(i) => slots[i as usize],
                Meets::Old(n, at) => {
                    mesh.neighbors[n as usize][at as usize] = t;
                    mesh.mark_tet(n);
                    n
                }
            };
        }
        tet.iter().for_each(|&v| mesh.incident[v as usize] = t);
    }
    mesh.touch(&slots);
}

impl UpdatePages for ExplicitMt {
    fn page_bits(&self) -> u32 {
        self.info().kind.usual_block_bits()
    }

    fn set_to_come(&mut self, bounds: &[ErrorCode]) {
        let bound = bounds.iter().copied().max().filter(|_| self.updates() < self.info().updates);
        self.to_come = bound.unwrap_or(ErrorCode::MAX);
    }

    fn page_inserted(&self, mesh: &mut CurrentMesh, updates: Range<u32>) {
        for t in updates.flat_map(|u| self.removed(UpdateId(u))) {
            if let Some(slot) = mesh.tagged(*t) {
                mesh.touch(&[slot]);
            }
        }
    }
}

impl ApplyUpdates for ExplicitMt {
    fn start(&self) -> Result<CurrentMesh, BaseMeshError> {
        let mut mesh = CurrentMesh::new(self.info(), self.base())?;
        mesh.tag_all(self.base_tets());
        mesh.put_back_kind_state(Box::new(FaceOccupancy::by(&self.base().tets)));
        Ok(mesh)
    }

    fn quarterings(&self, mesh: &CurrentMesh, t: u32) -> u8 {
        self.quarterings_of(mesh.tag(t))
    }

    fn remover(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        self.removed_by(mesh.tag(t))
    }

    fn creator(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        self.inserted_by(mesh.tag(t))
    }

    fn may_coarsen(&self, mesh: &CurrentMesh, u: UpdateId) -> bool {
        self.inserted(u).all(|t| mesh.tagged(t).is_some())
    }

    fn refine(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied> {
        let missing = self.removed(u).iter().find(|&&t| mesh.tagged(t).is_none());
        if let Some(&t) = missing {
            let damaged = UpdateError::Cavity { update: u.0 };
            return Ok(Applied::Blocked(self.inserted_by(t).ok_or(damaged)?));
        }
        let old = Self::slots(mesh, u.0, self.removed(u).iter().copied())?;
        let new: Vec<u32> = self.inserted(u).collect();
        replace(self, mesh, u.0, &old, &new)?;
        Ok(Applied::Done)
    }

    fn coarsen(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied> {
        if let Some(child) = self.child_in_the_way(mesh, u)? {
            return Ok(Applied::Blocked(child));
        }
        let old = Self::slots(mesh, u.0, self.inserted(u))?;
        replace(self, mesh, u.0, &old, self.removed(u))?;
        Ok(Applied::Done)
    }

    fn look_at_removed(&self, mesh: &mut CurrentMesh, u: UpdateId, look: LookAtTet<'_>) -> Result<Applied> {
        if let Some(child) = self.child_in_the_way(mesh, u)? {
            return Ok(Applied::Blocked(child));
        }
        for &t in self.removed(u) {
            let tet = self.tets()[t as usize].map(VertexId);
            let levels = |field: usize| tet.map(|v| self.levels(v)[field]);
            if look(&tet.map(|v| self.position(v)), &levels, self.quarterings_of(t), 0) {
                break;
            }
        }
        Ok(Applied::Done)
    }

    fn find_removed(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Vec<u32>> {
        Self::slots(mesh, u.0, self.removed(u).iter().copied())
    }

    fn find_inserted(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Vec<u32>> {
        Self::slots(mesh, u.0, self.inserted(u))
    }
}

impl ExplicitMt {
    /// What removed something that `u+` inserted, in a mesh that contains `u`.
    fn child_in_the_way(&self, mesh: &CurrentMesh, u: UpdateId) -> Result<Option<UpdateId>> {
        let missing = self.inserted(u).find(|&t| mesh.tagged(t).is_none());
        let Some(t) = missing else { return Ok(None) };
        // Without a child to remove it, it was never there.
        self.removed_by(t).map(Some).ok_or(UpdateError::Cavity { update: u.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_bare_is_noticed_wherever_its_number_is() {
        let new = [[3, 4, 5, 6]];
        let occupancy = FaceOccupancy::by(&new);
        let fits = |bare: &[[u32; 3]]| {
            let beyond: Vec<(Side, u32, u32)> = bare.iter().map(|&face| (side_of((face, 0)), 9, 1)).collect();
            meet(&new, &beyond, &occupancy).is_some()
        };
        assert!(fits(&[]));
        assert!(![[0, 1, 2], [3, 4, 7], [7, 8, 9]].iter().any(|&face| fits(&[face])));
    }
}
