//! What an MT is like and what it costs to store, in the paper's terms [§6, Table 1].

use super::{ApplyUpdates, CurrentMesh};
use crate::geom::lattice_box;
use crate::mt::explicit::store::Counts;
use crate::mt::replay::{ReplayError, replay};

/// Numbers about an MT. The storage of the alternatives is by the paper's way of counting: 4 bytes for a
/// coordinate, a field value or an index, 1 for a counter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MtStats {
    /// Vertices of the reference mesh (the paper's n).
    pub vertices: u32,
    /// Tetrahedra of the reference mesh.
    pub tetrahedra: u32,
    /// Vertices that appear in any mesh of the MT.
    pub mt_vertices: u32,
    /// Tetrahedra that appear in any mesh of the MT (the paper's m).
    pub mt_tetrahedra: u64,
    /// Nodes of the DAG.
    pub updates: u32,
    /// Arcs of the DAG: pairs of an update and a parent of it.
    pub arcs: u64,
    /// Updates on the longest path of the DAG.
    pub depth: u32,
    /// Most parents of an update.
    pub max_parents: u32,
    /// Tetrahedra that all updates remove, together.
    pub removed: u64,
    /// Tetrahedra that all updates insert, together.
    pub inserted: u64,
    /// Most tetrahedra that an update removes.
    pub max_removed: u32,
    /// Most tetrahedra that an update inserts.
    pub max_inserted: u32,
    /// What the compact MT really holds.
    pub compact_bytes: u64,
    /// The explicit structure [§3] of the same MT: see [`ExplicitMt::paper_bytes`](super::ExplicitMt::paper_bytes).
    pub explicit_bytes: u64,
    /// The reference mesh alone: positions, fields and four vertex indices for each tetrahedron.
    pub indexed_bytes: u64,
    /// The reference mesh alone, with four neighbours for each tetrahedron as well.
    pub adjacency_bytes: u64,
    /// The box around the reference mesh, on the lattice: its lowest and its highest corner.
    pub bounds: [[i32; 3]; 2],
}

impl MtStats {
    /// Mean number of parents of an update.
    pub fn arcs_per_update(&self) -> f64 {
        self.per_update(self.arcs)
    }

    /// Mean number of tetrahedra that an update inserts (the paper: 27 in edge-based MTs, 16 in vertex-based ones).
    pub fn inserted_per_update(&self) -> f64 {
        self.per_update(self.inserted)
    }

    /// Mean number of tetrahedra that an update removes.
    pub fn removed_per_update(&self) -> f64 {
        self.per_update(self.removed)
    }

    fn per_update(&self, total: u64) -> f64 {
        if self.updates == 0 { 0.0 } else { total as f64 / f64::from(self.updates) }
    }
}

/// Measures an MT by applying all its updates once; holds no more than the mesh and a word per update.
///
/// # Errors
/// If an update cannot be applied.
pub fn stats(mt: &impl ApplyUpdates) -> Result<MtStats, ReplayError> {
    let (base, fields) = (mt.base(), mt.info().fields.len() as u64);
    let mut counts = Counts {
        fields,
        vertices: base.positions.len() as u64,
        tets: base.tets.len() as u64,
        updates: u64::from(mt.updates()),
        removed: 0,
        arcs: 0,
    };
    let mut depths = Vec::<u32>::new();
    let (mut max_parents, mut max_removed, mut max_inserted) = (0, 0, 0);
    let mesh = replay(mt, |step| {
        let above = step.parents.iter().map(|p| depths[p.0 as usize]).max();
        depths.push(above.unwrap_or(0) + 1);
        counts.tets += step.inserted.len() as u64;
        counts.removed += step.removed.len() as u64;
        counts.arcs += step.parents.len() as u64;
        // Vertices are numbered as they come.
        let newest = step.inserted.iter().flatten().copied().fold(0, u32::max);
        counts.vertices = counts.vertices.max(u64::from(newest) + 1);
        max_parents = max_parents.max(step.parents.len() as u32);
        max_removed = max_removed.max(step.removed.len() as u32);
        max_inserted = max_inserted.max(step.inserted.len() as u32);
    })?;
    let (vertices, tetrahedra) = (mesh.vertex_count() as u64, mesh.tet_count() as u64);
    let indexed_bytes = 16 * tetrahedra + 4 * (3 + fields) * vertices;
    Ok(MtStats {
        vertices: vertices as u32,
        tetrahedra: tetrahedra as u32,
        mt_vertices: counts.vertices as u32,
        mt_tetrahedra: counts.tets,
        updates: mt.updates(),
        arcs: counts.arcs,
        depth: depths.iter().copied().max().unwrap_or(0),
        max_parents,
        removed: counts.removed,
        inserted: counts.tets - base.tets.len() as u64,
        max_removed,
        max_inserted,
        compact_bytes: mt.bytes(),
        explicit_bytes: counts.bytes(),
        indexed_bytes,
        adjacency_bytes: indexed_bytes + 16 * tetrahedra,
        bounds: bounds(&mesh),
    })
}

/// The box around a mesh; around nothing, a point.
pub(super) fn bounds(mesh: &CurrentMesh) -> [[i32; 3]; 2] {
    let used = (0..mesh.tet_slots() as u32).filter_map(|t| mesh.tet(t)).flatten();
    lattice_box(used.map(|slot| mesh.positions()[slot as usize])).unwrap_or_default()
}
