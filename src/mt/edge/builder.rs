//! Makes an edge-based MT from plain vertex splits.

use super::predict::Link;
use super::star::Ring;
use crate::mt::mesh::stars::Gather;
use crate::mt::mesh::stars::Star;
use crate::mt::{
    ApplyUpdates, BaseMesh, BaseMeshError, CurrentMesh, EdgeMt, EdgeUpdate, MAX_LINK, MtInfo,
    MultiTessellation, UpdateError, UpdateId, UpdatePages, VertexSplit,
};
use crate::mt::{MAX_STAR, VertexId, apply_next};
use std::borrow::Cow;

/// Makes an [`EdgeMt`] from vertex splits, coarse to fine: applies each to the mesh of all before it and stores what it does as
/// residuals against the prediction from that mesh.
#[derive(Debug)]
pub struct EdgeMtBuilder {
    mt: EdgeMt,
    mesh: CurrentMesh,
    residuals: Vec<i32>,
}

impl EdgeMtBuilder {
    /// No updates yet.
    ///
    /// # Errors
    /// If the base mesh does not fit its description or is not a valid mesh.
    pub fn new(info: MtInfo, base: BaseMesh) -> Result<Self, BaseMeshError> {
        let mt = EdgeMt::new(info, base);
        Ok(Self { mesh: mt.start()?, mt, residuals: Vec::new() })
    }

    /// The MT of the splits so far.
    pub fn mt(&self) -> &EdgeMt {
        &self.mt
    }

    /// The MT of all splits.
    pub fn finish(self) -> EdgeMt {
        self.mt
    }

    /// Adds the next split. That errors do not grow along the partial order is the caller's to see to.
    ///
    /// # Errors
    /// If the split does not fit the mesh or the lattices, or lacks errors. The builder is of no use then.
    pub fn push(&mut self, split: &VertexSplit<'_>) -> Result<UpdateId, UpdateError> {
        self.push_seen(split, |_, _, _| Ok(()))
    }

    /// [`Self::push`] that shows the MT with the update, and the mesh just before it is applied.
    #[doc(hidden)]
    pub fn push_seen(
        &mut self,
        split: &VertexSplit<'_>,
        see: impl FnOnce(&EdgeMt, &mut CurrentMesh, UpdateId) -> Result<(), UpdateError>,
    ) -> Result<UpdateId, UpdateError> {
        let Self { mt, mesh, residuals } = self;
        let stored = to_residuals(mt, mesh, split, residuals)?;
        let u = mt.push(&stored)?;
        mt.updates_arrived(mesh, u.0);
        see(mt, mesh, u)?;
        apply_next(mt, mesh, u)?;
        Ok(u)
    }

    #[doc(hidden)]
    pub fn mesh(&mut self) -> &mut CurrentMesh {
        &mut self.mesh
    }
}

/// The next update of `mt` as residuals against the prediction from its star. `residuals` gets those of the levels.
fn to_residuals<'a>(
    mt: &EdgeMt,
    mesh: &mut CurrentMesh,
    split: &VertexSplit<'a>,
    residuals: &'a mut Vec<i32>,
) -> Result<EdgeUpdate<'a>, UpdateError> {
    let (update, info) = (mt.updates(), mt.info());
    residuals.clear();
    if split.field_offsets.len() != info.fields.len() {
        return Err(UpdateError::OffLattice { update });
    }
    let p = mesh.slot(split.vertex).ok_or(UpdateError::Vertex { update, vertex: split.vertex.0 })?;
    let stored = mesh.with_kind_state(|mesh, ring: &mut Ring| {
        match mesh.gather_ring(p, update, ring) {
            Ok(()) if ring.link_len > MAX_LINK || mesh.is_pinched(p) => {
                return Err(UpdateError::Star { update });
            }
            Ok(()) if !ring.find_sides(split.mask) => return Err(UpdateError::Mask { update }),
            Ok(()) => {}
            Err(Gather::TooLarge) => return Err(UpdateError::Star { update }),
            Err(Gather::Stopped(_)) => return Err(UpdateError::Error { update }),
        }
        let mut link = Link::new(ring, mesh, mesh.positions[p as usize]);
        let (offset_residual, edge) = link.residual_offset(ring, split.offset, info.lattice.bits);
        link.set_offset(ring, split.offset);
        link.guess_levels(ring, mesh, p, split.offset, &info.fields, |field, guess| {
            residuals.push(split.field_offsets[field].saturating_sub(guess));
        });
        let wrong_sides = link.wrong(ring, ring.sides);
        let VertexSplit { vertex, errors, .. } = *split;
        let level_residuals = Cow::Borrowed(&[][..]);
        Ok(EdgeUpdate { vertex, offset_residual, edge, level_residuals, wrong_sides, errors })
    });
    Ok(EdgeUpdate { level_residuals: Cow::Borrowed(residuals), ..stored? })
}

impl CurrentMesh {
    /// Brings the mask of a split from the order of other vertex numbers, which `other` gives, to that of the MT's.
    /// The two sides change places if they `turn`. None if the vertex is not in the mesh or its star is too large.
    #[doc(hidden)]
    pub fn reorder_mask(
        &mut self,
        vertex: VertexId,
        mask: u64,
        turn: bool,
        other: impl Fn(VertexId) -> u32,
    ) -> Option<u64> {
        let mut star = Star::default();
        let slot = self.slot(vertex)?;
        self.gather_star(slot, &mut star, |_, _| None::<()>).ok()?;
        if star.len > MAX_STAR {
            return None;
        }
        let face = |i: usize, number: &dyn Fn(VertexId) -> u32| {
            let tet = self.tets[star.tets[i] as usize];
            let rest = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]][star.corner[i] as usize];
            let mut face = rest.map(|k: usize| number(self.vertex(tet[k])));
            face.sort_unstable();
            face
        };
        let order = |number: &dyn Fn(VertexId) -> u32| {
            let mut order: Vec<([u32; 3], usize)> = (0..star.len).map(|i| (face(i, number), i)).collect();
            order.sort_unstable();
            order
        };
        let theirs = order(&other);
        let turn = u64::from(turn);
        let side = |rank: usize| (mask >> rank & 1) ^ turn;
        let sides = theirs.iter().enumerate().fold(0_u64, |s, (rank, &(_, i))| s | side(rank) << i);
        let ours = order(&|v: VertexId| v.0);
        Some(ours.iter().enumerate().fold(0_u64, |m, (rank, &(_, i))| m | (sides >> i & 1) << rank))
    }
}
