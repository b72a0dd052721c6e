//! A mesh that was kept, to be shown beside later ones.

use super::input::{Input, quantity_into};
use super::objects::Objects;
use super::styles::quantity;
use super::{SceneError, SceneState};
use crate::draw::Edit;
use tetralod::geom::Bounds;
use tetralod::mesh::neighbors;
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
    /// Of each field, whether it is a label.
    labels: Vec<bool>,
    /// The region of each tetrahedron, and the colour of each region.
    regions: Vec<u16>,
    colors: Vec<u8>,
    /// The values of each of [`TetQuantity::ALL`].
    quantities: Vec<Vec<f64>>,
    /// All points: another field may be shown than before.
    changes: MeshChanges,
    /// Of a mesh of another file: points that are farther outside of it than so much have no difference.
    reach: Option<f64>,
}

/// A mesh of another file, to take its field from that of a session's mesh: see [`Scene::keep_other`](super::Scene::keep_other).
#[derive(Clone, Debug, Default)]
pub struct OtherMesh {
    /// Its points, in the units of the session's volume.
    pub positions: Vec<[f64; 3]>,
    /// Four points a tetrahedron.
    pub tets: Vec<[u32; 4]>,
    /// Its values of fields of the session's volume, by their numbers: one a point.
    pub fields: Vec<(usize, Vec<f64>)>,
    /// Points that are farther outside of it than so much have no difference; nearer ones are compared with its boundary.
    pub reach: f64,
}

impl KeptMesh {
    pub fn of_other(info: &MtInfo, other: OtherMesh) -> Result<Self, SceneError> {
        let OtherMesh { positions, tets, fields: given, reach } = other;
        let refused = |problem: String| SceneError::state("mesh", problem);
        if let Some(point) = tets.as_flattened().iter().find(|point| **point as usize >= positions.len()) {
            return Err(refused(format!("a tetrahedron names point {point} of {}", positions.len())));
        }
        let mut fields = vec![Vec::new(); info.fields.len()];
        for (number, values) in given {
            let (Some(place), true) = (fields.get_mut(number), values.len() == positions.len()) else {
                let counts = format!("{} values at {} points", values.len(), positions.len());
                return Err(refused(format!("field {number} has {counts}")));
            };
            *place = values;
        }
        if reach.is_nan() || reach < 0.0 {
            return Err(refused(format!("`reach` must be a number of at least 0, not {reach}")));
        }
        let neighbors = neighbors(&tets).map_err(|error| refused(error.to_string()))?;
        Ok(Self {
            changes: MeshChanges::of_all_vertices(positions.len()),
            positions,
            tets,
            neighbors,
            fields,
            labels: labels(Some(info)),
            regions: Vec::new(),
            colors: Vec::new(),
            quantities: Vec::new(),
            reach: Some(reach),
        })
    }

    /// The mesh with a field to compare with, and how far outside of it points may be; none if it does not have that field.
    pub fn compared(&self, field: usize) -> Option<(MeshView<'_>, f64)> {
        let view = self.view(field);
        (view.field.len() == view.positions.len()).then_some((view, self.reach.unwrap_or(f64::INFINITY)))
    }

    /// Whether it is of the session that it is compared with: only then can all be drawn of it that is drawn of that one.
    pub fn is_own(&self) -> bool {
        self.reach.is_none()
    }

    pub fn of(session: &mut Session) -> Result<Self, SceneError> {
        let count = session.info().ok_or(SessionError::NotReady)?.fields.len();
        let mut quantities = vec![Vec::new(); TetQuantity::ALL.len()];
        for (quantity, values) in TetQuantity::ALL.into_iter().zip(&mut quantities) {
            quantity_into(session, quantity, values)?;
        }
        let fields = (0..count).map(|field| session.values(field)).collect();
        let regions = session.shown_regions().into_owned();
        let colors = session.regions().map_or_else(Vec::new, Regions::colors);
        let labels = labels(session.info());
        let MeshView { positions, tets, neighbors, .. } = session.view();
        let (positions, tets, neighbors) = (positions.to_vec(), tets.to_vec(), neighbors.to_vec());
        let changes = MeshChanges::of_all_vertices(positions.len());
        Ok(Self {
            positions,
            tets,
            neighbors,
            fields,
            labels,
            regions,
            colors,
            quantities,
            changes,
            reach: None,
        })
    }

    /// The mesh with one of its fields.
    pub fn view(&self, field: usize) -> MeshView<'_> {
        let Self { positions, tets, neighbors, labels, .. } = self;
        let is_label = labels.get(field).copied().unwrap_or(false);
        MeshView { positions, field: self.values(field), is_label, tets, neighbors }
    }

    fn values(&self, field: usize) -> &[f64] {
        self.fields.get(field).map_or(&[], Vec::as_slice)
    }
}

/// Of each field, whether it is a label.
fn labels(info: Option<&MtInfo>) -> Vec<bool> {
    info.map_or_else(Vec::new, |info| info.fields.iter().map(|field| field.is_label).collect())
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
            apart: 0,
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
