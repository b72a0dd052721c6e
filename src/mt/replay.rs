//! All updates of an MT, coarse to fine, each with the tetrahedra that it removes and inserts.

use super::Applied;
use super::BaseMeshError;
use super::CurrentMesh;
use super::EdgeMt;
use super::MultiTessellation;
use super::UpdateError;
use super::UpdateId;
use super::VertexId;
use super::current::Star;
use std::fmt;

/// Why the updates of an MT cannot all be applied. Only a damaged or hostile MT leads here.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReplayError {
    /// The base mesh is not usable.
    Base(BaseMeshError),
    /// An update does not fit the mesh that the updates before it make.
    Update(UpdateError),
}

impl fmt::Display for ReplayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Base(error) => error.fmt(f),
            Self::Update(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ReplayError {}

impl From<BaseMeshError> for ReplayError {
    fn from(error: BaseMeshError) -> Self {
        Self::Base(error)
    }
}

impl From<UpdateError> for ReplayError {
    fn from(error: UpdateError) -> Self {
        Self::Update(error)
    }
}

/// One update that has just been applied. Tetrahedra are in numbers of MT vertices, positive, and written the same
/// way whenever they occur: ascending but for the last two.
pub(super) struct Step<'a> {
    pub update: UpdateId,
    /// The mesh with the update.
    pub mesh: &'a CurrentMesh,
    pub removed: &'a [[u32; 4]],
    pub inserted: &'a [[u32; 4]],
}

/// Applies all updates in their order and shows each to `see`. Returns the reference mesh.
pub(super) fn replay(mt: &EdgeMt, mut see: impl FnMut(&Step<'_>)) -> Result<CurrentMesh, ReplayError> {
    let mut mesh = CurrentMesh::new(mt.info(), mt.base())?;
    mt.announce(&mut mesh, 0);
    let (mut removed, mut inserted) = (Vec::new(), Vec::new());
    for update in (0..mt.updates()).map(UpdateId) {
        removed.clear();
        inserted.clear();
        let vertex = mt.split(update).vertex;
        collect_star(&mut mesh, update, vertex, &mut removed)?;
        if let Applied::Blocked(_) = mt.refine(&mut mesh, update)? {
            // All updates with smaller numbers are applied, and only those can be in the way.
            return Err(UpdateError::Vertex { update: update.0, vertex: vertex.0 }.into());
        }
        mesh.clear_touched();
        let [near, far] = mt.created(update);
        collect_star(&mut mesh, update, near, &mut inserted)?;
        let of_near = inserted.len();
        collect_star(&mut mesh, update, far, &mut inserted)?;
        let mut index = 0;
        inserted.retain(|tet: &[u32; 4]| {
            index += 1;
            index <= of_near || !tet.contains(&near.0)
        });
        see(&Step { update, mesh: &mesh, removed: &removed, inserted: &inserted });
    }
    Ok(mesh)
}

/// Appends the tetrahedra around a vertex of the MT.
fn collect_star(
    mesh: &mut CurrentMesh,
    update: UpdateId,
    vertex: VertexId,
    tets: &mut Vec<[u32; 4]>,
) -> Result<(), UpdateError> {
    let update = update.0;
    let slot = mesh.slot(vertex).ok_or(UpdateError::Vertex { update, vertex: vertex.0 })?;
    let mut star = Star::default();
    mesh.gather_star(slot, &mut star, |_, _| None::<()>).map_err(|_| UpdateError::Star { update })?;
    tets.extend(star.tets[..star.len].iter().map(|&t| named(mesh, t)));
    Ok(())
}

/// The vertex numbers of tetrahedron `t`, ascending but for the last two, which are swapped if that is what it takes
/// to be positive.
pub(super) fn named(mesh: &CurrentMesh, t: u32) -> [u32; 4] {
    canonical(mesh.tets[t as usize].map(|slot| mesh.labels[slot as usize].vertex))
}

/// The even permutation of `tet` that is ascending but, maybe, for the last two.
pub(super) fn canonical(mut tet: [u32; 4]) -> [u32; 4] {
    let mut odd = false;
    for (i, j) in [(0, 1), (1, 2), (2, 3), (0, 1), (1, 2), (0, 1)] {
        if tet[i] > tet[j] {
            tet.swap(i, j);
            odd = !odd;
        }
    }
    if odd {
        tet.swap(2, 3);
    }
    tet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn canonical_tetrahedra_keep_their_orientation() {
        let corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]];
        let side = |tet: [u32; 4]| {
            let [a, b, c, d] = tet.map(|v| corners[v as usize]);
            crate::geom::orient3d(a, b, c, d)
        };
        for code in 0..256_u32 {
            let tet = [0, 2, 4, 6].map(|shift| code >> shift & 3);
            if side(tet) == 0 {
                continue;
            }
            let same = canonical(tet);
            assert_eq!(side(same), side(tet));
            assert_eq!(same, if side(tet) > 0 { [0, 1, 2, 3] } else { [0, 1, 3, 2] });
        }
    }
}
