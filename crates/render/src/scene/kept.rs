//! A mesh that was kept, to be shown beside later ones.

use super::objects::{Input, Objects};
use super::styles::quantity;
use super::{SceneError, SceneState};
use crate::gpu::Renderer;
use tetralod::geom::Bounds;
use tetralod::mt::{MeshChanges, MtInfo};
use tetralod::session::{Session, SessionError, TetQuantity};
use tetralod::view::MeshView;

/// A copy of a mesh with all of its fields, and what is shown of it.
#[derive(Debug)]
pub(super) struct Kept {
    positions: Vec<[f64; 3]>,
    tets: Vec<[u32; 4]>,
    neighbors: Vec<[u32; 4]>,
    fields: Vec<Vec<f64>>,
    /// The values of each of [`TetQuantity::ALL`].
    quantities: Vec<Vec<f64>>,
    pub objects: Objects,
}

impl Kept {
    pub fn of(session: &mut Session) -> Result<Self, SceneError> {
        let count = session.info().ok_or(SessionError::NotReady)?.fields.len();
        let quantities =
            TetQuantity::ALL.into_iter().map(|one| session.tet_quantity(one)).collect::<Result<_, _>>()?;
        let fields = (0..count).map(|field| session.values(field)).collect();
        let MeshView { positions, tets, neighbors, .. } = session.view();
        let (positions, tets, neighbors) = (positions.to_vec(), tets.to_vec(), neighbors.to_vec());
        Ok(Self { positions, tets, neighbors, fields, quantities, objects: Objects::default() })
    }

    /// The mesh with one of its fields.
    pub fn view(&self, field: usize) -> MeshView<'_> {
        let Self { positions, tets, neighbors, fields, .. } = self;
        MeshView { positions, field: fields.get(field).map_or(&[], Vec::as_slice), tets, neighbors }
    }

    /// Hands a renderer what is shown of it.
    pub fn update(
        &mut self,
        renderer: &mut Renderer,
        info: &MtInfo,
        shown: usize,
        state: &SceneState,
        bounds: &Bounds,
    ) -> Result<(), SceneError> {
        let mut objects = std::mem::take(&mut self.objects);
        let quantity = state.cells.as_ref().map_or(Ok(None), quantity)?;
        let place = TetQuantity::ALL.iter().position(|one| Some(*one) == quantity);
        objects.values = place.and_then(|i| self.quantities.get(i).cloned()).unwrap_or_default();
        let mesh = self.view(shown);
        // Another field may be shown than before.
        let changes = MeshChanges::of_all_vertices(mesh.positions.len());
        let fields = |field: usize| self.fields.get(field).cloned().unwrap_or_default();
        let input = Input {
            mesh,
            field: mesh.field,
            largest_difference: None,
            fields: &fields,
            info,
            shown,
            state,
            bounds,
            changes: &changes,
        };
        let updated = objects.update_from(renderer, &input, true);
        self.objects = objects;
        updated
    }
}
