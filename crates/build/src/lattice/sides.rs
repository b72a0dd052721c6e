//! Where fields jump at interfaces: the reference vertices at which several regions meet have a value for each.
//!
//! Such a vertex is a *point* of its first region, and there are further points, behind all vertices, one for each further region: its
//! sides. Errors are measured at all of them, each in the tetrahedra of its region.

use crate::{BuildConfig, BuildError};
use std::sync::Arc;
use tetralod::mesh::{Field, TetMesh};
use tetralod::mt::MtKind;

/// The sides of reference vertices; none where no field jumps.
#[derive(Clone, Default)]
pub(crate) struct Sides {
    /// For each field whether it jumps.
    pub jumps: Vec<bool>,
    /// The first region of each vertex.
    first: Vec<u32>,
    /// The vertex of each side and its region, ascending.
    further: Arc<[(u32, u32)]>,
    /// Where those of each vertex begin, and at last where they end.
    starts: Vec<u32>,
}

impl Sides {
    /// Those that these fields have, given the region of each tetrahedron.
    pub fn of(mesh: &TetMesh, chosen: &[&Field], regions: &[u32]) -> Self {
        let jumps: Vec<bool> = chosen.iter().map(|field| jumps(field)).collect();
        if !jumps.contains(&true) {
            return Self::default();
        }
        let mut first = vec![u32::MAX; mesh.positions.len()];
        for (tet, &region) in mesh.tets.iter().zip(regions) {
            tet.iter().for_each(|&v| first[v as usize] = region.min(first[v as usize]));
        }
        let further = mesh.sides.iter().map(|side| (side.point, regions[side.tet as usize]));
        Self::new(jumps, first, further.collect())
    }

    /// Those of vertices with these first regions, given the vertex and the region of each, ascending; none if no field jumps.
    pub fn new(jumps: Vec<bool>, first: Vec<u32>, further: Vec<(u32, u32)>) -> Self {
        if jumps.is_empty() {
            return Self::default();
        }
        let points = first.len();
        let mut starts = vec![0; points + 1];
        further.iter().for_each(|(v, _)| starts[*v as usize + 1] += 1);
        (0..points).for_each(|v| starts[v + 1] += starts[v]);
        Self { jumps, first, further: further.into(), starts }
    }

    /// The first region of each vertex, and the vertex and the region of each side.
    pub fn into_parts(self) -> (Vec<u32>, Vec<(u32, u32)>) {
        (self.first, self.further.to_vec())
    }

    /// Whether no field jumps.
    pub fn is_empty(&self) -> bool {
        self.starts.is_empty()
    }

    /// How many points there are besides the vertices.
    pub fn len(&self) -> usize {
        self.further.len()
    }

    /// The vertex of each of these points.
    pub fn vertices(&self) -> impl Iterator<Item = u32> + Clone {
        self.further.iter().map(|(v, _)| *v)
    }

    /// The point of vertex `v` in a region.
    #[inline]
    pub fn point(&self, v: u32, region: u32) -> u32 {
        if self.is_empty() {
            return v;
        }
        let found = self.of_vertex(v).find(|&side| self.further[side as usize].1 == region);
        found.map_or(v, |side| self.first.len() as u32 + side)
    }

    /// The region of a point.
    pub fn region(&self, point: u32) -> u32 {
        match (point as usize).checked_sub(self.first.len()) {
            Some(side) => self.further[side].1,
            None => self.first[point as usize],
        }
    }

    /// The points of a vertex behind the first, with their regions.
    pub fn further(&self, v: u32) -> impl Iterator<Item = (u32, u32)> {
        self.of_vertex(v).map(|side| (self.first.len() as u32 + side, self.further[side as usize].1))
    }

    /// Whether a vertex is in several regions.
    pub fn has_several(&self, v: u32) -> bool {
        !self.of_vertex(v).is_empty()
    }

    fn of_vertex(&self, v: u32) -> std::ops::Range<u32> {
        let v = v as usize;
        if self.is_empty() { 0..0 } else { self.starts[v]..self.starts[v + 1] }
    }
}

/// The value of a field at a point of the input, or of its sides behind these.
pub(crate) fn value(mesh: &TetMesh, field: &Field, point: usize) -> f64 {
    match point.checked_sub(mesh.positions.len()) {
        None => field.values[point],
        Some(side) if jumps(field) => field.sides[side],
        Some(side) => field.values[mesh.sides[side].point as usize],
    }
}

/// Whether a field has a value for each region.
pub(crate) fn jumps(field: &Field) -> bool {
    !field.sides.is_empty()
}

/// Refuses values for each region where nothing can keep them.
pub(crate) fn check(fields: &[&Field], config: &BuildConfig) -> Result<(), BuildError> {
    let Some(field) = fields.iter().find(|field| jumps(field)) else { return Ok(()) };
    let refused = |other: String| {
        Err(BuildError::Combination {
            which: [format!("values of field '{}' for each region", field.name), other],
            instead: "average fields across regions (mean_across_regions)",
        })
    };
    let exact = |field: &&&Field| {
        jumps(field) && (config.all_lossless || config.lossless.iter().any(|name| field.answers_to(name)))
    };
    let kind = config.construction.kind();
    if kind != MtKind::HalfEdge {
        return refused(format!("an MT of kind {}", kind.name()));
    }
    if config.preserve.is_empty() {
        return refused("regions that are not kept".to_owned());
    }
    match fields.iter().find(exact) {
        Some(_) => refused("exact values".to_owned()),
        None => Ok(()),
    }
}
