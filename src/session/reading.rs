//! What a probe shows at a point.

use super::quantity::size;
use super::{Session, SessionError};
use crate::mt::MultiTessellation;
use crate::view::{MeshView, Probe};

/// What is known of the current mesh at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The point, in model units.
    pub position: [f64; 3],
    /// The value of each field there, in its own units.
    pub values: Vec<f64>,
    /// The tetrahedron that holds the point: an index into `tets` of [`Session::view`], if none are cut there; else into those of
    /// [`Session::mesh`].
    pub tet: u32,
    /// The number of its region, in [`Session::regions`]; none without regions.
    pub region: Option<u16>,
    /// The size of the tetrahedron, as [`TetQuantity::Size`](super::TetQuantity::Size).
    pub size: f64,
    /// The error of the tetrahedron, as [`TetQuantity::Error`](super::TetQuantity::Error): a fraction of the field's range.
    pub error: f64,
}

impl Session {
    /// What is known of the current mesh at a point, in model units; none outside, and where it is not
    /// finite. Fields are linear in the tetrahedron; of a label it is that of the nearest corner.
    ///
    /// # Errors
    /// If nothing has arrived yet.
    pub fn reading(&mut self, point: [f64; 3]) -> Result<Option<Reading>, SessionError> {
        let Some(place) = Probe::new(self.view()).locate(point) else {
            return if self.front.is_some() { Ok(None) } else { Err(SessionError::NotReady) };
        };
        let (Some(front), Some(mt)) = (&self.front, self.decoder.mt()) else {
            return Err(SessionError::NotReady);
        };
        let (mesh, info) = (front.mesh(), mt.info());
        // A piece is read in the tetrahedron that it is cut out of.
        let whole = MeshView { tets: mesh.tets(), neighbors: mesh.neighbors(), ..self.last_view() };
        let cut = self.shown.cut.is_some().then(|| Probe::new(whole).locate(point));
        let Some(place) = cut.unwrap_or(Some(place)) else { return Ok(None) };
        let Some(tet) = mesh.tet(place.tet) else { return Ok(None) };
        let value = |field: usize| {
            let corners = tet.map(|slot| info.fields[field].value(mesh.levels(slot)[field]));
            if info.fields[field].is_label { place.nearest(corners) } else { place.linear(corners) }
        };
        Ok(Some(Reading {
            position: point,
            values: (0..info.fields.len()).map(value).collect(),
            tet: place.tet,
            region: mesh.regions().get(place.tet as usize).copied(),
            size: size(&info.lattice, mesh, tet),
            error: front.tet_error(mt, place.tet).error(),
        }))
    }
}
