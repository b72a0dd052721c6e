//! A mesh that was kept, to be shown beside later ones.

use super::input::{Input, quantity_into};
use super::objects::Objects;
use super::styles::quantity;
use super::{SceneError, SceneState};
use crate::draw::Edit;
use tetralod::geom::Bounds;
use tetralod::mt::{MeshChanges, MtInfo, Regions};
use tetralod::session::{Session, SessionError, TetQuantity};
use tetralod::view::MeshView;

/// A mesh that was kept, and what is shown of it.
#[derive(Debug)]
pub(super) struct Kept {
    pub mesh: KeptMesh,
    pub objects: Objects,
}

/// A copy of a mesh with all of its fields.
#[derive(Debug)]
pub(super) struct KeptMesh {
    positions: Vec<[f64; 3]>,
    tets: Vec<[u32; 4]>,
    neighbors: Vec<[u32; 4]>,
    fields: Vec<Vec<f64>>,
    /// The region of each tetrahedron, and the colour of each region.
    regions: Vec<u16>,
    colors: Vec<u8>,
    /// The values of each of [`TetQuantity::ALL`].
    quantities: Vec<Vec<f64>>,
    /// All points: another field may be shown than before.
    changes: MeshChanges,
}

impl KeptMesh {
    pub fn of(session: &mut Session) -> Result<Self, SceneError> {
        let count = session.info().ok_or(SessionError::NotReady)?.fields.len();
        let mut quantities = vec![Vec::new(); TetQuantity::ALL.len()];
        for (quantity, values) in TetQuantity::ALL.into_iter().zip(&mut quantities) {
            quantity_into(session, quantity, values)?;
        }
        let fields = (0..count).map(|field| session.values(field)).collect();
        let regions = session.shown_regions().into_owned();
        let colors = session.regions().map_or_else(Vec::new, Regions::colors);
        let MeshView { positions, tets, neighbors, .. } = session.view();
        let (positions, tets, neighbors) = (positions.to_vec(), tets.to_vec(), neighbors.to_vec());
        let changes = MeshChanges::of_all_vertices(positions.len());
        Ok(Self { positions, tets, neighbors, fields, regions, colors, quantities, changes })
    }

    /// The mesh with one of its fields.
    pub fn view(&self, field: usize) -> MeshView<'_> {
        let Self { positions, tets, neighbors, .. } = self;
        MeshView { positions, field: self.values(field), tets, neighbors }
    }

    fn values(&self, field: usize) -> &[f64] {
        self.fields.get(field).map_or(&[], Vec::as_slice)
    }
}

impl Kept {
    /// Lists what is shown of it.
    pub fn list<'a>(
        &'a mut self,
        info: &'a MtInfo,
        (shown, isovalue): (usize, Option<f64>),
        (state, opacities): (&'a SceneState, Vec<f64>),
        bounds: Bounds,
        edits: &mut Vec<Edit<'a>>,
    ) -> Result<(), SceneError> {
        let kept = &self.mesh;
        let quantity = state.cells.as_ref().map_or(Ok(None), quantity)?;
        let place = TetQuantity::ALL.iter().position(|one| Some(*one) == quantity);
        let mesh = kept.view(shown);
        let input = Input {
            mesh,
            field: mesh.field,
            largest_difference: None,
            fields: Box::new(move |field| kept.values(field).into()),
            tet_values: place.and_then(|i| kept.quantities.get(i)).map_or(&[], Vec::as_slice),
            regions: (&kept.regions).into(),
            colors: kept.colors.clone(),
            opacities,
            info,
            shown,
            isovalue,
            state,
            bounds,
            changes: &kept.changes,
        };
        self.objects.list(&input, true, edits)
    }
}
