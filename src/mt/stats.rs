//! Sizes and depths of an MT, for `info` and for comparison with the paper's Table 1.

use super::CurrentMesh;
use super::EdgeMt;
use super::MtInfo;
use super::MultiTessellation;
use super::UpdateError;
use super::UpdateId;

/// The shape of an MT's partial order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MtStats {
    /// Length of the longest chain of updates that depend on each other.
    pub depth: u32,
    /// Pairs of an update and one that depends on it directly.
    pub arcs: u64,
    /// Tetrahedra that appear in at least one mesh of the MT: the paper's `m`.
    pub tetrahedra: u64,
    /// Updates.
    pub updates: u32,
}

impl MtStats {
    /// Plays an MT from base to reference mesh. `mesh` is its base mesh; see [`CurrentMesh::new`].
    ///
    /// # Errors
    /// If the MT turns out to be damaged.
    pub fn of(mt: &impl MultiTessellation, mut mesh: CurrentMesh) -> Result<Self, UpdateError> {
        let mut depths = vec![1_u32; mt.updates() as usize];
        let mut stats =
            Self { updates: mt.updates(), tetrahedra: mesh.tet_count() as u64, ..Self::default() };
        let (mut created, mut children) = (Vec::new(), Vec::new());
        mt.announce(&mut mesh, 0);
        mesh.clear_touched();
        for u in (0..mt.updates()).map(UpdateId) {
            // Parents come first, so nothing blocks.
            mt.refine(&mut mesh, u)?;
            created.clear();
            created.extend_from_slice(mesh.touched());
            mesh.clear_touched();
            created.sort_unstable();
            created.dedup();
            children.clear();
            for tet in created.iter().filter_map(|&t| mesh.tet(t)) {
                if mt.creator(&mesh, &tet) == Some(u) {
                    stats.tetrahedra += 1;
                    children.extend(mt.remover(&mesh, &tet));
                }
            }
            children.sort_unstable();
            children.dedup();
            stats.arcs += children.len() as u64;
            for child in &children {
                let depth = depths[u.0 as usize] + 1;
                let deepest = &mut depths[child.0 as usize];
                *deepest = depth.max(*deepest);
            }
        }
        stats.depth = depths.into_iter().max().unwrap_or(0);
        Ok(stats)
    }

    /// Direct dependencies per update.
    pub fn arcs_per_node(&self) -> f64 {
        self.arcs as f64 / f64::from(self.updates.max(1))
    }

    /// Tetrahedra that an update creates in refinement, on average; `base` is the size of the base mesh.
    pub fn tets_per_update(&self, base: usize) -> f64 {
        (self.tetrahedra - base as u64) as f64 / f64::from(self.updates.max(1))
    }

    /// Bytes of the explicit structure [§3], with four bytes a number: 24 a vertex with one field, 28 a tetrahedron.
    pub fn explicit_bytes(&self, info: &MtInfo) -> u64 {
        (20 + 4 * info.fields.len() as u64) * u64::from(info.vertices) + 28 * self.tetrahedra
    }
}

impl MtInfo {
    /// Bytes of the reference mesh as an indexed structure [§3]: coordinates, fields, four indices a tetrahedron.
    pub fn indexed_bytes(&self) -> u64 {
        (12 + 4 * self.fields.len() as u64) * u64::from(self.vertices) + 16 * u64::from(self.tetrahedra)
    }

    /// Bytes of the reference mesh as an indexed structure with adjacencies [§3].
    pub fn adjacency_bytes(&self) -> u64 {
        self.indexed_bytes() + 16 * u64::from(self.tetrahedra)
    }
}

impl EdgeMt {
    /// Bytes of this structure: 36 and 2 for the error per update with one field, and the base mesh.
    pub fn compact_bytes(&self) -> u64 {
        let (fields, base) = (self.info().fields.len() as u64, self.base());
        u64::from(self.updates()) * (34 + 4 * fields)
            + base.positions.len() as u64 * (16 + 4 * fields)
            + base.tets.len() as u64 * 16
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Lattice;
    use crate::mt::BaseMesh;
    use crate::mt::ErrorCode;
    use crate::mt::FieldInfo;
    use crate::mt::MtKind;
    use crate::mt::VertexId;
    use crate::mt::VertexSplit;

    /// Two tetrahedra at a triangle; the first update splits a corner of it, the second another one.
    fn chain() -> EdgeMt {
        let field = FieldInfo { name: "f".into(), min: 0.0, max: 9.0, origin: 0.0, step: 1.0, bits: 4 };
        let info = MtInfo {
            kind: MtKind::Edge,
            lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits: 6 },
            fields: vec![field],
            vertices: 7,
            tetrahedra: 4,
            updates: 2,
            displacement_per_error: 1.0,
        };
        let base = BaseMesh {
            positions: vec![[8, 8, 8], [16, 8, 8], [8, 16, 8], [8, 8, 16], [8, 8, 0]],
            values: vec![0; 5],
            tets: vec![[0, 1, 2, 3], [0, 2, 1, 4]],
        };
        let mut mt = EdgeMt::new(info, base);
        for vertex in [0, 1] {
            let (vertex, error) = (VertexId(vertex), ErrorCode(9));
            mt.push(&VertexSplit { vertex, offset: [0, 0, 2], field_offsets: &[0], mask: 0b10, error })
                .expect("the updates fit");
        }
        mt
    }

    #[test]
    fn a_chain_of_two_is_counted_right() {
        let mt = chain();
        let mesh = CurrentMesh::new(mt.info(), mt.base()).expect("a valid base mesh");
        let stats = MtStats::of(&mt, mesh).expect("a valid MT");
        // 2 in the base mesh; the first update makes 3, all around the vertex that the second splits into 4.
        assert_eq!(stats, MtStats { depth: 2, arcs: 1, tetrahedra: 9, updates: 2 });
        assert_eq!(stats.tets_per_update(2), 3.5);
        assert_eq!(stats.arcs_per_node(), 0.5);
        assert_eq!(stats.explicit_bytes(mt.info()), 24 * 7 + 28 * 9);
        assert_eq!(mt.info().indexed_bytes(), 16 * 7 + 16 * 4);
        assert_eq!(mt.info().adjacency_bytes(), 16 * 7 + 32 * 4);
        assert_eq!(mt.compact_bytes(), 38 * 2 + 20 * 5 + 16 * 2);
    }

    #[test]
    fn the_reference_mesh_of_the_paper_has_the_bytes_of_the_paper() {
        // Smallbucky: 33 points along each side of a grid, its cubes in tetrahedra.
        let info = MtInfo { vertices: 35_937, tetrahedra: 194_620, ..chain().info().clone() };
        assert_eq!((info.indexed_bytes(), info.adjacency_bytes()), (3_688_912, 6_802_832));
    }
}
