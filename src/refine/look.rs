//! Tetrahedra of the mesh as criteria see them.

use super::{TetData, Verdict};
use crate::mt::{ApplyUpdates, CurrentMesh, ErrorCode, UpdateId};
use std::borrow::Cow;

/// A tetrahedron to evaluate, with its data.
pub(super) struct Open<'a> {
    pub t: u32,
    pub tet: [u32; 4],
    pub update: UpdateId,
    pub errors: TetErrors<'a>,
    pub corners: [[i32; 3]; 4],
    pub region: u16,
}

impl Open<'_> {
    pub fn look<'a>(&'a self, levels: &'a dyn Fn(usize) -> [i32; 4]) -> TetData<'a> {
        let Self { corners, errors, update, region, .. } = self;
        let (error, errors) = (errors.largest, &errors.by_field);
        TetData { corners, levels, error, errors, update: *update, region: *region }
    }
}

/// The errors of a tetrahedron.
pub(super) struct TetErrors<'a> {
    pub largest: ErrorCode,
    pub by_field: Cow<'a, [ErrorCode]>,
}

impl<'a> TetErrors<'a> {
    /// The errors of a tetrahedron that update `u` removes, given its quarterings.
    #[inline]
    pub fn new(mt: &'a impl ApplyUpdates, u: UpdateId, quarterings: u8) -> Self {
        let (largest, errors, fall) = (mt.error(u), mt.errors(u), mt.own_fall(u));
        if quarterings == 0 && fall == 0 {
            return Self { largest, by_field: Cow::Borrowed(errors) };
        }
        let own: Vec<ErrorCode> = (0..errors.len()).map(|f| mt.own_error(u, f, quarterings)).collect();
        Self { largest: own.iter().copied().fold(ErrorCode::ZERO, ErrorCode::max), by_field: Cow::Owned(own) }
    }

    /// The errors of tetrahedron `t` of the mesh, which update `u` removes.
    #[inline]
    pub fn of(mt: &'a impl ApplyUpdates, mesh: &CurrentMesh, t: u32, u: UpdateId) -> Self {
        Self::new(mt, u, mt.quarterings(mesh, t))
    }

    /// Bounds of the errors of a tetrahedron.
    pub fn bounded_by(errors: &'a [ErrorCode]) -> Self {
        let largest = errors.iter().copied().fold(ErrorCode::ZERO, ErrorCode::max);
        Self { largest, by_field: Cow::Borrowed(errors) }
    }
}

/// Calls `judge` with a tetrahedron of the mesh, by its slot and its vertices.
#[inline]
pub(super) fn see(
    mesh: &CurrentMesh,
    (t, tet): (u32, &[u32; 4]),
    errors: &TetErrors<'_>,
    update: UpdateId,
    judge: impl FnOnce(&TetData<'_>) -> Verdict,
) -> Verdict {
    let corners = tet.map(|v| mesh.positions[v as usize]);
    let levels = |field: usize| tet.map(|v| mesh.levels(mesh.side(v, mesh.region(t)))[field]);
    let TetErrors { largest: error, ref by_field } = *errors;
    let (corners, levels, region) = (&corners, &levels, mesh.region(t));
    judge(&TetData { corners, levels, error, errors: by_field, update, region })
}
