//! Updates of an explicit MT on the current mesh [§3]: tetrahedra are looked up, and the faces of old and new ones
//! matched. Slow next to the compact structures, but it works for updates of every kind.
//!
//! In the current mesh, the tag of a tetrahedron is its number in the MT.

use super::Applied;
use super::BaseMesh;
use super::BaseMeshError;
use super::CurrentMesh;
use super::ErrorCode;
use super::ExplicitMt;
use super::LookAtTet;
use super::MtInfo;
use super::MultiTessellation;
use super::UpdateError;
use super::UpdateId;
use super::VertexId;
use super::current::Labels;
use crate::mesh::FACES;
use crate::mesh::NONE;

impl ExplicitMt {
    /// The slots of these tetrahedra, which must all be in the mesh.
    fn slots(
        mesh: &CurrentMesh,
        update: u32,
        tets: impl Iterator<Item = u32>,
    ) -> Result<Vec<u32>, UpdateError> {
        tets.map(|t| mesh.tagged(t).ok_or(UpdateError::Cavity { update })).collect()
    }
}

/// Replaces the tetrahedra in the slots `old` by those of `mt` that are numbered `new`.
fn replace(
    mt: &ExplicitMt,
    mesh: &mut CurrentMesh,
    update: u32,
    old: &[u32],
    new: &[u32],
) -> Result<(), UpdateError> {
    let torn = UpdateError::Cavity { update };
    let corners: Vec<[u32; 4]> = new.iter().map(|&t| mt.tets()[t as usize]).collect();
    let sorted = |mut v: Vec<u32>| {
        v.sort_unstable();
        v.dedup();
        v
    };
    let old_vertices =
        sorted(old.iter().flat_map(|&t| mesh.tets[t as usize]).map(|s| mesh.vertex(s).0).collect());
    let new_vertices = sorted(corners.iter().flatten().copied().collect());
    let added: Vec<u32> =
        new_vertices.iter().copied().filter(|v| old_vertices.binary_search(v).is_err()).collect();
    // A vertex that comes must not be there already: the mesh would touch itself there.
    if added.iter().any(|&v| mesh.slot(VertexId(v)).is_some()) {
        return Err(torn);
    }
    let gone: Vec<u32> =
        old_vertices.iter().copied().filter(|v| new_vertices.binary_search(v).is_err()).collect();
    // Every face of the old tetrahedra that borders on the rest, with what lies beyond.
    let mut sides: Vec<([u32; 3], u32, usize)> = Vec::new();
    for (i, tet) in corners.iter().enumerate() {
        sides.extend((0..4).map(|f| (sorted_face(*tet, f), i as u32, f)));
    }
    sides.sort_unstable();
    let mut beyond: Vec<([u32; 3], u32, usize)> = Vec::new();
    for &t in old {
        let (tet, around) = (mesh.tets[t as usize].map(|s| mesh.vertex(s).0), mesh.neighbors[t as usize]);
        for f in (0..4).filter(|&f| around[f] != NONE && !old.contains(&around[f])) {
            let back = mesh.neighbors[around[f] as usize].iter().position(|&n| n == t);
            beyond.push((sorted_face(tet, f), around[f], back.ok_or(torn.clone())?));
        }
    }
    beyond.sort_unstable();
    // What each face of the new tetrahedra meets: another new one, or one beyond.
    let mut meets = vec![[Meets::Nothing; 4]; new.len()];
    let mut rest = sides.as_slice();
    let mut outside = 0;
    while let [(face, i, f), tail @ ..] = rest {
        let same = 1 + tail.iter().take_while(|(other, ..)| other == face).count();
        let twin = &rest[..same];
        rest = &rest[same..];
        let out = beyond.binary_search_by_key(face, |(other, ..)| *other).ok();
        match (twin, out) {
            ([_], None) => {}
            ([_], Some(at)) => {
                meets[*i as usize][*f] = Meets::Old(beyond[at].1, beyond[at].2);
                outside += 1;
            }
            ([_, (_, j, g)], None) if is_mirrored(&corners, (*i, *f), (*j, *g)) => {
                meets[*i as usize][*f] = Meets::New(*j);
                meets[*j as usize][*g] = Meets::New(*i);
            }
            _ => return Err(torn),
        }
    }
    // The rest of the mesh must find a neighbour wherever it had one, and a vertex that goes must not be its own.
    let kept = |v: &u32| beyond.iter().any(|(face, ..)| face.contains(v));
    if outside != beyond.len() || gone.iter().any(kept) {
        return Err(torn);
    }
    perform(mt, mesh, old, new, &meets, [&gone, &added]);
    Ok(())
}

/// What lies across a face of a new tetrahedron.
#[derive(Clone, Copy, Debug)]
enum Meets {
    /// The boundary.
    Nothing,
    /// Another new tetrahedron.
    New(u32),
    /// A slot that stays, and which of its neighbours it is.
    Old(u32, usize),
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
        mesh.put_vertex(slot, Labels { vertex: v, split: NONE }, mt.position(VertexId(v)));
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
                    mesh.neighbors[n as usize][at] = t;
                    mesh.mark_tet(n);
                    n
                }
            };
        }
        tet.iter().for_each(|&v| mesh.incident[v as usize] = t);
    }
    mesh.touch(&slots);
}

fn sorted_face(tet: [u32; 4], f: usize) -> [u32; 3] {
    let mut face = FACES[f].map(|k| tet[k]);
    face.sort_unstable();
    face
}

/// Whether two tetrahedra see the face that they share from its two sides.
fn is_mirrored(corners: &[[u32; 4]], (i, f): (u32, usize), (j, g): (u32, usize)) -> bool {
    let [a, b] = [(i, f), (j, g)].map(|(t, f)| FACES[f].map(|k| corners[t as usize][k]));
    // An odd permutation of three is a reversal of some rotation.
    (0..3).any(|r| [b[r], b[(r + 2) % 3], b[(r + 1) % 3]] == a)
}

impl MultiTessellation for ExplicitMt {
    fn info(&self) -> &MtInfo {
        self.info()
    }

    fn base(&self) -> &BaseMesh {
        self.base_mesh()
    }

    fn updates(&self) -> u32 {
        self.updates()
    }

    fn bytes(&self) -> u64 {
        self.held_bytes()
    }

    fn start(&self) -> Result<CurrentMesh, BaseMeshError> {
        let mut mesh = CurrentMesh::new(self.info(), self.base_mesh())?;
        mesh.tag_all(ExplicitMt::base(self));
        Ok(mesh)
    }

    fn error(&self, u: UpdateId) -> ErrorCode {
        ExplicitMt::error(self, u)
    }

    fn remover(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        ExplicitMt::remover(self, mesh.tag(t))
    }

    fn creator(&self, mesh: &CurrentMesh, t: u32) -> Option<UpdateId> {
        ExplicitMt::creator(self, mesh.tag(t))
    }

    fn may_coarsen(&self, mesh: &CurrentMesh, u: UpdateId) -> bool {
        self.inserted(u).all(|t| mesh.tagged(t).is_some())
    }

    fn refine(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied, UpdateError> {
        let missing = self.removed(u).iter().find(|&&t| mesh.tagged(t).is_none());
        if let Some(&t) = missing {
            let damaged = UpdateError::Cavity { update: u.0 };
            return Ok(Applied::Blocked(ExplicitMt::creator(self, t).ok_or(damaged)?));
        }
        let old = Self::slots(mesh, u.0, self.removed(u).iter().copied())?;
        let new: Vec<u32> = self.inserted(u).collect();
        replace(self, mesh, u.0, &old, &new)?;
        Ok(Applied::Done)
    }

    fn coarsen(&self, mesh: &mut CurrentMesh, u: UpdateId) -> Result<Applied, UpdateError> {
        if let Some(child) = self.child_in_the_way(mesh, u)? {
            return Ok(Applied::Blocked(child));
        }
        let old = Self::slots(mesh, u.0, self.inserted(u))?;
        replace(self, mesh, u.0, &old, self.removed(u))?;
        Ok(Applied::Done)
    }

    fn look_at_removed(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        field: usize,
        look: LookAtTet<'_>,
    ) -> Result<Applied, UpdateError> {
        if let Some(child) = self.child_in_the_way(mesh, u)? {
            return Ok(Applied::Blocked(child));
        }
        for &t in self.removed(u) {
            let tet = self.tets()[t as usize].map(VertexId);
            if look(&tet.map(|v| self.position(v)), &tet.map(|v| self.levels(v)[field])) {
                break;
            }
        }
        Ok(Applied::Done)
    }

    fn announce(&self, _: &mut CurrentMesh, _: u32) {}

    fn find_removed(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        found: &mut Vec<u32>,
    ) -> Result<(), UpdateError> {
        found.extend(Self::slots(mesh, u.0, self.removed(u).iter().copied())?);
        Ok(())
    }

    fn find_inserted(
        &self,
        mesh: &mut CurrentMesh,
        u: UpdateId,
        found: &mut Vec<u32>,
    ) -> Result<(), UpdateError> {
        found.extend(Self::slots(mesh, u.0, self.inserted(u))?);
        Ok(())
    }
}

impl ExplicitMt {
    /// What removed something that `u+` inserted, in a mesh that contains `u`.
    fn child_in_the_way(&self, mesh: &CurrentMesh, u: UpdateId) -> Result<Option<UpdateId>, UpdateError> {
        let missing = self.inserted(u).find(|&t| mesh.tagged(t).is_none());
        let Some(t) = missing else { return Ok(None) };
        // Without a child to remove it, it was never there.
        ExplicitMt::remover(self, t).map(Some).ok_or(UpdateError::Cavity { update: u.0 })
    }
}
