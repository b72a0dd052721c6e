//! Makes half-edge MTs: updates are appended coarse to fine to the mesh that those before make.

use super::apply::Search;
use super::scratch::{NEW, Scratch};
use super::star_code::StarCode;
use super::store::{ForestChild, HalfEdgeMt, HalfEdgeUpdate};
use crate::mt::{
    ApplyUpdates, ConvertError, CurrentMesh, ErrorCode, MultiTessellation, ReplayError, UpdateError,
};

const NOT_HALF_EDGE: &str = "it is not the inverse of a half-edge collapse";

/// The update is no inverse half-edge collapse.
pub(super) fn refused(update: u32) -> ConvertError {
    ConvertError::Update { update, why: NOT_HALF_EDGE }
}

pub(super) fn damaged(error: UpdateError) -> ConvertError {
    ConvertError::Damaged(ReplayError::Update(error))
}

/// What removes a tetrahedron, [`NONE`](crate::mesh::NONE) if nothing does, and which of its faces go with it, by corner: see
/// [`BaseMark`](crate::mt::BaseMark).
pub(crate) type Remover = (u32, u8);

/// The next update, but for what removes its star.
pub(crate) struct NextUpdate<'a> {
    /// The updates whose near vertex is the new one.
    pub children: &'a [ForestChild],
    /// The levels of the new vertex.
    pub levels: &'a [i32],
    pub errors: &'a [ErrorCode],
}

/// A half-edge MT that grows, and the mesh with all of its updates.
pub(crate) struct HalfEdgeBuilder {
    mt: HalfEdgeMt,
    mesh: CurrentMesh,
    scratch: Box<Scratch>,
    code: StarCode,
    star: Vec<[u32; 4]>,
    removers: Vec<Remover>,
}

impl HalfEdgeBuilder {
    /// Of an MT without updates.
    ///
    /// # Errors
    /// If the base mesh is not usable.
    pub fn new(mt: HalfEdgeMt) -> Result<Self, ConvertError> {
        let mut mesh = mt.start().map_err(|error| ConvertError::Damaged(error.into()))?;
        mesh.make_room(mt.info());
        Ok(Self {
            mt,
            mesh,
            scratch: Box::default(),
            code: StarCode::default(),
            star: Vec::new(),
            removers: Vec::new(),
        })
    }

    /// Adds an update and applies it. `find_removers` gets the tetrahedra of its star, in numbers of MT vertices, and tells what
    /// removes each; none if they are not those that the update should insert.
    ///
    /// # Errors
    /// If it is no inverse half-edge collapse.
    pub fn push(
        &mut self,
        next: &NextUpdate<'_>,
        find_removers: impl FnOnce(&[[u32; 4]], &mut Vec<Remover>) -> Option<()>,
    ) -> Result<(), ConvertError> {
        let Self { mt, mesh, scratch, code, star, removers } = self;
        let &NextUpdate { children, levels, errors } = next;
        // What is predicted of the levels is known once the link is.
        let zeros = vec![0; levels.len()];
        let record = HalfEdgeUpdate { children, level_residuals: &zeros, star: &[], errors };
        let u = mt.push(&record).map_err(damaged)?;
        let prepared = mt.prepare(mesh, u, Search::Nearby, scratch).map_err(damaged)?;
        let position = prepared.map_err(|_| refused(u.0))?;
        let residuals: Vec<i32> = levels.iter().zip(&scratch.levels).map(|(a, b)| a - b).collect();
        let vertex = mt.vertex(u);
        let link = &scratch.link[..scratch.link_len];
        let number = |corner: u8| match corner {
            NEW => vertex.0,
            x => link.get(usize::from(x)).map_or(vertex.0, |&slot| mesh.vertex(slot).0),
        };
        star.clear();
        star.extend(scratch.star[..scratch.star_len].iter().map(|new| new.corners.map(number)));
        removers.clear();
        find_removers(star, removers).ok_or_else(|| refused(u.0))?;
        scratch.hash_star(mesh, vertex.0);
        let found = mt.code_star(mesh, u, position, (&mut **scratch, &mut *code), removers);
        mt.set_last_star(&found.ok_or_else(|| refused(u.0))?, &residuals);
        // Coding has put the removers into the star.
        scratch.levels.copy_from_slice(levels);
        mt.perform_insertion(mesh, u, position, scratch);
        mesh.clear_touched();
        Ok(())
    }

    /// The MT.
    pub fn finish(self) -> HalfEdgeMt {
        self.mt
    }
}
