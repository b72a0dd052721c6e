//! All updates of an MT, coarse to fine, each with the tetrahedra that it removes and inserts.

use super::{Applied, ApplyUpdates, BaseMeshError, CurrentMesh, UpdateError, UpdateId};
use thiserror::Error;

/// Why the updates of an MT cannot all be applied. Only a damaged or hostile MT leads here.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ReplayError {
    /// The base mesh is not usable.
    #[error(transparent)]
    Base(#[from] BaseMeshError),
    /// An update does not fit the mesh that the updates before it make.
    #[error(transparent)]
    Update(#[from] UpdateError),
}

/// One update that has just been applied. Tetrahedra are in numbers of MT vertices, positive, and written the same
/// way whenever they occur: ascending but for the last two.
pub(super) struct Step<'a> {
    pub update: UpdateId,
    /// The mesh with the update.
    pub mesh: &'a CurrentMesh,
    /// The updates that created what this one removes, ascending.
    pub parents: &'a [UpdateId],
    pub removed: &'a [[u32; 4]],
    /// The quarterings of each of them.
    pub quarterings: &'a [u8],
    pub inserted: &'a [[u32; 4]],
}

/// Applies all updates in their order and shows each to `see`. Returns the reference mesh.
pub(super) fn replay(
    mt: &impl ApplyUpdates,
    mut see: impl FnMut(&Step<'_>),
) -> Result<CurrentMesh, ReplayError> {
    let mut mesh = mt.start()?;
    mt.updates_arrived(&mut mesh, 0);
    for update in (0..mt.updates()).map(UpdateId) {
        let found = mt.find_removed(&mut mesh, update)?;
        let removed: Vec<[u32; 4]> = found.iter().map(|&t| named(&mesh, t)).collect();
        let quarterings: Vec<u8> = found.iter().map(|&t| mt.quarterings(&mesh, t)).collect();
        let mut parents: Vec<UpdateId> = found.iter().filter_map(|&t| mt.creator(&mesh, t)).collect();
        parents.sort_unstable();
        parents.dedup();
        apply_next(mt, &mut mesh, update)?;
        let found = mt.find_inserted(&mut mesh, update)?;
        let inserted: Vec<[u32; 4]> = found.iter().map(|&t| named(&mesh, t)).collect();
        see(&Step {
            update,
            mesh: &mesh,
            parents: &parents,
            removed: &removed,
            quarterings: &quarterings,
            inserted: &inserted,
        });
    }
    Ok(mesh)
}

/// Applies an update to a mesh that has all with smaller numbers on which it depends.
///
/// # Errors
/// If it cannot be applied.
pub(crate) fn apply_next(
    mt: &impl ApplyUpdates,
    mesh: &mut CurrentMesh,
    update: UpdateId,
) -> Result<(), UpdateError> {
    if let Applied::Blocked(_) = mt.refine(mesh, update)? {
        // Only updates with smaller numbers can be in the way.
        return Err(UpdateError::Error { update: update.0 });
    }
    mesh.clear_touched();
    Ok(())
}

/// The vertex numbers of tetrahedron `t`, ascending but for the last two, which are swapped if that is what it takes
/// to be positive.
pub(super) fn named(mesh: &CurrentMesh, t: u32) -> [u32; 4] {
    canonical(mesh.tets[t as usize].map(|slot| mesh.labels[slot as usize].vertex))
}

/// The even permutation of `tet` that is ascending but, maybe, for the last two.
#[doc(hidden)]
pub fn canonical(mut tet: [u32; 4]) -> [u32; 4] {
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
