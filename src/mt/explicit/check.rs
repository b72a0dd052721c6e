//! Checks an explicit MT: is it what the theory of Multi-Tessellations asks for [§2]?

use super::face_occupancy::{Faces, faces};
use crate::geom::orient3d;
use crate::mt::margins::Margins;
use crate::mt::{ApplyUpdates, ExplicitMt, MultiTessellation, ReplayError, UpdateId, VertexId, apply_next};
use std::collections::BTreeSet;
use thiserror::Error;

/// Why an MT is not valid. `update` is the first one that is not; none means the base mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MtFault {
    /// An update comes before one that it depends on, or does not know its parents and children.
    #[error("update {} contradicts the order of the MT", .update.0)]
    Order {
        /// The update.
        update: UpdateId,
    },
    /// An update has a larger error than one that it depends on.
    #[error("update {} has a larger error than a parent", .update.0)]
    Error {
        /// The update.
        update: UpdateId,
    },
    /// An update has an error that is not as much below that of one it depends on as its values are beyond those which that one
    /// replaces: what a request for values gives would depend on what was asked for before.
    #[error("update {} has an error too near to that of a parent", .update.0)]
    Margin {
        /// The update.
        update: UpdateId,
    },
    /// A tetrahedron is flat, inside out, or names a vertex that is not there.
    #[error("{} has a tetrahedron that is not positive", place(.update))]
    Tetrahedron {
        /// The update that inserts it.
        update: Option<UpdateId>,
    },
    /// A face is shared by more than two tetrahedra, or by two on the same side of it.
    #[error("a face is shared by too many tetrahedra in {}", place(.update))]
    Face {
        /// The update that makes it so.
        update: Option<UpdateId>,
    },
    /// What an update inserts does not fill what it removes: it tears the mesh open.
    #[error("update {} tears the mesh open", .update.0)]
    Torn {
        /// The update.
        update: UpdateId,
    },
}

fn place(update: &Option<UpdateId>) -> String {
    update.map_or("the base mesh".to_owned(), |u| format!("update {}", u.0))
}

/// Checks that the errors of an MT fall along the partial order by as much as requests for values rely on, by applying all its
/// updates. Returns the first update with a larger error than a parent, or one too near to it, if there is one.
///
/// # Errors
/// If an update cannot be applied.
pub fn check_errors(mt: &impl ApplyUpdates) -> Result<Option<MtFault>, ReplayError> {
    let mut mesh = mt.start()?;
    mt.updates_arrived(&mut mesh, 0);
    let mut margins = Margins::new(mt.info());
    for update in (0..mt.updates()).map(UpdateId) {
        let tets = mt.find_removed(&mut mesh, update)?;
        if let Some(excess) = margins.check(mt, &mesh, update, &tets) {
            let fault = if excess.larger { MtFault::Error { update } } else { MtFault::Margin { update } };
            return Ok(Some(fault));
        }
        apply_next(mt, &mut mesh, update)?;
    }
    Ok(None)
}

impl ExplicitMt {
    /// Checks that parents come first and know their children, that errors do not grow along the DAG, and that every
    /// mesh on the way from the base to the reference mesh is conforming: positive tetrahedra, at most one on each
    /// side of every face. An update inside the domain fills what it empties; one at the boundary may move the
    /// boundary, but fills whatever lies behind a face that it shares with the rest.
    ///
    /// # Errors
    /// The first fault, coarse to fine.
    pub fn check(&self) -> Result<(), MtFault> {
        let mut mesh = Faces::default();
        self.add_all(self.base_tets(), None, &mut mesh)?;
        for u in (0..self.updates()).map(UpdateId) {
            self.check_place(u)?;
            let bare_before = self.bare_faces(self.removed(u).iter().copied(), &mesh);
            self.removed(u).iter().for_each(|&t| mesh.remove(&self.tets()[t as usize]));
            let hollow = self.hollow(u, &mesh);
            self.add_all(self.inserted(u), Some(u), &mut mesh)?;
            let open = hollow.iter().any(|(face, side)| !mesh.has(face, *side));
            let bare = self.bare_faces(self.inserted(u), &mesh);
            let moves_boundary = !bare_before.is_subset(&bare);
            if open || !moves_boundary && bare != bare_before {
                return Err(MtFault::Torn { update: u });
            }
        }
        Ok(())
    }

    fn check_place(&self, u: UpdateId) -> Result<(), MtFault> {
        let parents = || self.parents(u).iter().map(|&p| UpdateId(p));
        let in_order = parents().all(|p| p < u && self.children(p).contains(&u.0))
            && self.children(u).iter().all(|&c| c > u.0 && self.parents(UpdateId(c)).contains(&u.0))
            && self.removed(u).iter().all(|&t| {
                self.removed_by(t) == Some(u) && self.inserted_by(t).is_none_or(|p| parents().any(|q| q == p))
            });
        if !in_order {
            return Err(MtFault::Order { update: u });
        }
        let exceeds = |p: UpdateId| self.errors(u).iter().zip(self.errors(p)).any(|(own, above)| own > above);
        if parents().any(exceeds) {
            return Err(MtFault::Error { update: u });
        }
        Ok(())
    }

    fn add_all(
        &self,
        tets: std::ops::Range<u32>,
        update: Option<UpdateId>,
        mesh: &mut Faces,
    ) -> Result<(), MtFault> {
        for tet in &self.tets()[tets.start as usize..tets.end as usize] {
            if tet.iter().any(|&v| v >= self.vertices()) {
                return Err(MtFault::Tetrahedron { update });
            }
            let [a, b, c, d] = tet.map(|v| self.position(VertexId(v)));
            if orient3d(a, b, c, d) <= 0 {
                return Err(MtFault::Tetrahedron { update });
            }
            if !mesh.add(tet) {
                return Err(MtFault::Face { update });
            }
        }
        Ok(())
    }

    /// The faces of these tetrahedra that are on the boundary of the mesh, with their sides.
    fn bare_faces(&self, tets: impl Iterator<Item = u32>, mesh: &Faces) -> BTreeSet<([u32; 3], usize)> {
        let all = tets.flat_map(|t| faces(&self.tets()[t as usize]));
        all.filter(|(face, side)| !mesh.has(face, 1 - side)).collect()
    }

    /// The faces through which what `u+` removes touched what is left, with the side that is empty now.
    fn hollow(&self, u: UpdateId, rest: &Faces) -> Vec<([u32; 3], usize)> {
        let removed = self.removed(u).iter().flat_map(|&t| faces(&self.tets()[t as usize]));
        removed.filter(|(face, side)| rest.has(face, 1 - side)).collect()
    }
}
