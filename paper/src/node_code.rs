//! Section 5's code of T_u beside ours: both as structures in memory, measured.

use anyhow::Result;
use std::collections::BTreeSet;
use tetralod::mt::{
    ExplicitMt, MostNeighbors, Mt, MtKind, MultiTessellation, TreeExceptions, UpdateId, VertexTreeMt,
};

/// The nodes of a vertex-based MT in both codes.
pub struct NodeCodes {
    /// Updates whose vertex has more than 32 neighbours when it is inserted.
    pub many_neighbors: u64,
    pub most_neighbors: u32,
    /// Bits of all nodes that say which child removes each tetrahedron of a star: in both structures, and not in the paper's.
    pub remover_bits: u64,
    /// The paper's code for 32 neighbours, then for 64.
    pub trees: [Trees; 2],
}

/// A structure with the paper's code.
pub struct Trees {
    /// Bits of all nodes for f_u and the stream.
    pub code_bits: u64,
    pub exceptions: TreeExceptions,
    pub exception_bytes: u64,
    /// Bytes of everything.
    pub bytes: u64,
}

impl Trees {
    fn of(mt: &ExplicitMt, limit: MostNeighbors) -> Result<(Self, u64)> {
        let mt = VertexTreeMt::from_explicit(mt, limit)?;
        let trees = Self {
            code_bits: mt.code_bits(),
            exceptions: mt.exceptions(),
            exception_bytes: mt.exception_bytes(),
            bytes: mt.bytes(),
        };
        Ok((trees, mt.remover_bits()))
    }
}

impl NodeCodes {
    /// None for MTs of other kinds, and where tetrahedra have errors of their own.
    pub fn of(mt: &Mt) -> Result<Option<Self>> {
        if mt.info().kind != MtKind::Vertex || mt.has_tet_errors() {
            return Ok(None);
        }
        let mt = ExplicitMt::of(mt)?;
        let (narrow, remover_bits) = Trees::of(&mt, MostNeighbors::ThirtyTwo)?;
        let (wide, _) = Trees::of(&mt, MostNeighbors::SixtyFour)?;
        let neighbors: Vec<u32> = (0..mt.updates()).map(|u| neighbors(&mt, UpdateId(u))).collect();
        Ok(Some(Self {
            many_neighbors: neighbors.iter().filter(|&&n| n > MostNeighbors::ThirtyTwo.neighbors()).count()
                as u64,
            most_neighbors: neighbors.iter().copied().max().unwrap_or(0),
            remover_bits,
            trees: [narrow, wide],
        }))
    }

    /// With 12 bits for f_u.
    pub fn of_the_paper(&self) -> &Trees {
        &self.trees[0]
    }
}

/// How many neighbours the vertex that an update inserts has then.
fn neighbors(mt: &ExplicitMt, u: UpdateId) -> u32 {
    let star = mt.inserted(u).flat_map(|t| mt.tets()[t as usize]);
    star.collect::<BTreeSet<u32>>().len() as u32 - 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{DataSet, Recipe};
    use std::collections::BTreeMap;

    /// Faces that only one of the tetrahedra has which an update removes.
    fn boundary_faces(mt: &ExplicitMt, u: UpdateId) -> u64 {
        let mut uses: BTreeMap<[u32; 3], u32> = BTreeMap::new();
        for tet in mt.removed(u).iter().map(|&t| mt.tets()[t as usize]) {
            for corner in 0..4 {
                let mut face = [1, 2, 3].map(|k| tet[(corner + k) % 4]);
                face.sort_unstable();
                *uses.entry(face).or_default() += 1;
            }
        }
        uses.into_values().filter(|&count| count == 1).count() as u64
    }

    #[test]
    fn measured_bits_are_those_of_the_papers_formula() {
        let points = tetralod_io::generate::bucky(9).unwrap();
        let data = DataSet::by_insertion("small", &points, &[Recipe::Delaunay, Recipe::HalfEdge]).unwrap();
        for model in &data.models {
            let codes = NodeCodes::of(&model.mt).unwrap().expect("a vertex-based MT");
            let mt = ExplicitMt::of(&model.mt).unwrap();
            let updates = || (0..mt.updates()).map(UpdateId);
            let p: u64 = updates().map(|u| mt.removed(u).len() as u64).sum();
            let q: u64 = updates().map(|u| boundary_faces(&mt, u)).sum();
            let u = u64::from(mt.updates());
            for (trees, face_bits) in codes.trees.iter().zip([12, 14]) {
                assert_eq!(trees.code_bits, face_bits * u + 6 * p - q + u, "{:?}", model.recipe);
            }
        }
    }
}
