//! The Multi-Tessellation itself [§2]: what it is made of and what every kind of it can do.

mod base;
mod collapse;
mod current;
mod error;

pub use base::{BaseMesh, BaseMeshError, MAX_FIELD_BITS, MAX_UPDATES};
pub use collapse::{EdgeMt, MAX_LINK, MAX_STAR, VertexSplit};
pub use current::CurrentMesh;
pub use error::{ErrorCode, UpdateError};

use crate::geom::Lattice;

/// Index of an update (a node of the MT) in coarse-to-fine order: parents come before their children.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct UpdateId(pub u32);

/// A vertex of the MT: one that appears in at least one of its meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VertexId(pub u32);

/// Which kind of update an MT is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MtKind {
    /// Vertex splits whose inverse collapses an edge to its midpoint [§2.1, §4].
    Edge,
}

/// A scalar field of an MT: name, range, and the lattice that its values live on.
///
/// The value of lattice level `q` is `origin + step · q`.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldInfo {
    /// The field's name.
    pub name: String,
    /// Smallest value over the reference vertices, in field units.
    pub min: f64,
    /// Largest value over the reference vertices, in field units.
    pub max: f64,
    /// Value of level 0.
    pub origin: f64,
    /// Distance between neighbouring levels; positive, also for a constant field.
    pub step: f64,
    /// Levels need at most this many bits.
    pub bits: u32,
}

impl FieldInfo {
    /// The value of level `q`.
    #[inline]
    pub fn value(&self, q: i32) -> f64 {
        self.origin + self.step * f64::from(q)
    }

    /// The level nearest to `value`, held inside the lattice.
    pub fn nearest(&self, value: f64) -> i32 {
        let largest = f64::from((1_u32 << self.bits) - 1);
        ((value - self.origin) / self.step).round().clamp(0.0, largest) as i32
    }

    /// `max − min`, or 1 for a constant field: the unit in which errors are relative.
    pub fn range(&self) -> f64 {
        if self.max > self.min { self.max - self.min } else { 1.0 }
    }
}

/// What is known of an MT before its updates arrive.
#[derive(Clone, Debug, PartialEq)]
pub struct MtInfo {
    /// Which kind of update it is made of.
    pub kind: MtKind,
    /// The lattice of the positions.
    pub lattice: Lattice,
    /// The fields, at least one.
    pub fields: Vec<FieldInfo>,
    /// Vertices of the reference mesh.
    pub vertices: u32,
    /// Tetrahedra of the reference mesh.
    pub tetrahedra: u32,
    /// Updates of the complete MT.
    pub updates: u32,
    /// The displacement of the boundary, in model units, that counts as an error of 1. A mesh within error `e`
    /// has its boundary within `e · displacement_per_error` of every reference vertex.
    pub displacement_per_error: f64,
}
