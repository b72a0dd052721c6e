//! Meshes out of an MT, and what is counted on them.

use anyhow::{Context, Result, ensure};
use tetralod::mt::{Mt, MultiTessellation};
use tetralod::refine::{Front, LodCriterion, Request};
use tetralod::view::{IsoSurface, MeshView};

/// The coarsest mesh of `mt` that satisfies `request`.
pub fn front(mt: &Mt, request: &Request) -> Result<Front> {
    let mut front = Front::new(mt)?;
    let criterion = LodCriterion::new(mt.info(), request);
    let outcome = front.satisfy(mt, &criterion, request.budget)?;
    ensure!(outcome.satisfied || !request.budget.is_unlimited(), "a complete MT satisfies every request");
    Ok(front)
}

/// How many tetrahedra that mesh has.
pub fn tetrahedra(mt: &Mt, request: &Request) -> Result<u64> {
    Ok(front(mt, request)?.mesh().tet_count() as u64)
}

/// A mesh as the view takes it.
pub struct Shown {
    positions: Vec<[f64; 3]>,
    values: Vec<f64>,
    tets: Vec<[u32; 4]>,
    neighbors: Vec<[u32; 4]>,
}

impl Shown {
    pub fn of(mt: &Mt, request: &Request) -> Result<Self> {
        let front = front(mt, request)?;
        let (info, mesh) = (mt.info(), front.mesh());
        let field = info.fields.first().context("an MT has a field")?;
        let value = |slot: usize| field.value(mesh.levels(slot as u32)[0]);
        Ok(Self {
            positions: mesh.positions().iter().map(|&q| info.lattice.point(q)).collect(),
            values: (0..mesh.positions().len()).map(value).collect(),
            tets: mesh.tets().to_vec(),
            neighbors: mesh.neighbors().to_vec(),
        })
    }

    pub fn view(&self) -> MeshView<'_> {
        MeshView {
            positions: &self.positions,
            field: &self.values,
            is_label: false,
            tets: &self.tets,
            neighbors: &self.neighbors,
        }
    }

    pub fn tetrahedra(&self) -> u64 {
        self.tets.len() as u64
    }

    /// Triangles of the isosurface.
    pub fn facets(&self, isovalue: f64) -> u64 {
        let mut surface = IsoSurface::new();
        surface.extract(&self.view(), isovalue);
        surface.indices.len() as u64
    }
}
