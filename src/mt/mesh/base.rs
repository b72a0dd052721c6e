//! The base mesh, and what must hold of it before anything is applied to it.

use crate::geom::{WIDE_BITS, orient3d};
use crate::mesh::{Averaged, Extreme, Extremes};
use crate::mt::{FieldInfo, MtInfo, MtKind};
use thiserror::Error;

/// The coarsest mesh of an MT, on the lattices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BaseMesh {
    /// Integer positions; vertex `i` is [`VertexId`](crate::mt::VertexId)`(i)`.
    pub positions: Vec<[i32; 3]>,
    /// Field levels: `values[i * fields + f]` is field `f` at vertex `i`.
    pub values: Vec<i32>,
    /// Positive tetrahedra.
    pub tets: Vec<[u32; 4]>,
}

/// Why a base mesh, or the description that comes with it, cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum BaseMeshError {
    /// The description of the MT contradicts itself or leaves the limits of the lattices.
    #[error("the description of the MT is not usable: {0}")]
    Info(&'static str),
    /// The vertex is off its lattice.
    #[error("vertex {0} of the base mesh is off the lattice")]
    Vertex(u32),
    /// The tetrahedron names a vertex that is not there, or is flat or inside out.
    #[error("tetrahedron {0} of the base mesh is not positive")]
    Tetrahedron(u32),
    /// More than two tetrahedra share a face of this one, or two lie on the same side of it.
    #[error("a face of tetrahedron {0} of the base mesh is shared by too many")]
    Face(u32),
}

impl BaseMesh {
    pub(in crate::mt) fn bytes(&self) -> u64 {
        (size_of_val(&self.positions[..]) + size_of_val(&self.values[..]) + size_of_val(&self.tets[..]))
            as u64
    }

    /// Checks everything that refinement relies on: sizes, lattices, orientation. Adjacency is checked where it is
    /// built, by [`CurrentMesh::new`](crate::mt::CurrentMesh::new).
    ///
    /// # Errors
    /// The first thing that is wrong.
    pub fn check(&self, info: &MtInfo) -> Result<(), BaseMeshError> {
        info.check()?;
        if self.values.len() != self.positions.len() * info.fields.len() {
            return Err(BaseMeshError::Info("field levels and vertices differ in number"));
        }
        let is_outside = |p: &[i32; 3]| {
            info.bounds.is_some_and(|[low, high]| (0..3).any(|k| p[k] < low[k] || p[k] > high[k]))
        };
        if self.positions.iter().any(is_outside) {
            return Err(BaseMeshError::Info("the base mesh is not within the box of the reference mesh"));
        }
        for (i, (position, levels)) in
            self.positions.iter().zip(self.values.chunks(info.fields.len())).enumerate()
        {
            if !info.holds(*position, levels) {
                return Err(BaseMeshError::Vertex(i as u32));
            }
        }
        for (t, tet) in self.tets.iter().enumerate() {
            let corners = tet.map(|v| self.positions.get(v as usize).copied());
            let [Some(a), Some(b), Some(c), Some(d)] = corners else {
                return Err(BaseMeshError::Tetrahedron(t as u32));
            };
            if orient3d(a, b, c, d) <= 0 {
                return Err(BaseMeshError::Tetrahedron(t as u32));
            }
        }
        Ok(())
    }
}

impl MtInfo {
    /// Checks that lattices and fields are usable: finite, not too fine, and in numbers that a file can hold.
    ///
    /// # Errors
    /// The first thing that is not.
    pub fn check(&self) -> Result<(), BaseMeshError> {
        let lattice = &self.lattice;
        let finite = |x: &f64| x.is_finite();
        if lattice.bits == 0 || lattice.bits > WIDE_BITS {
            return Err(BaseMeshError::Info("position bits must be 1 to 30"));
        }
        if !lattice.origin.iter().all(finite) || !lattice.step.iter().all(|s| s.is_finite() && *s > 0.0) {
            return Err(BaseMeshError::Info("the lattice must be finite, its steps positive"));
        }
        if self.fields.is_empty() || self.fields.len() > usize::from(u8::MAX) {
            return Err(BaseMeshError::Info("an MT has 1 to 255 fields"));
        }
        for field in &self.fields {
            let numbers = [field.min, field.max, field.origin, field.step];
            if !numbers.iter().all(finite) || field.step <= 0.0 || field.min > field.max {
                return Err(BaseMeshError::Info("field ranges must be finite, their steps positive"));
            }
            if !field.quantization.is_finite()
                || field.quantization < 0.0
                || !field.time.is_none_or(f64::is_finite)
            {
                return Err(BaseMeshError::Info(
                    "times must be finite, and what lattices round off not negative",
                ));
            }
            if !has_sound_extremes(field) {
                return Err(BaseMeshError::Info(
                    "extremes must be finite and in order, differences not negative",
                ));
            }
            if field.bits == 0 || field.bits > MAX_FIELD_BITS {
                return Err(BaseMeshError::Info("field bits must be 1 to 24"));
            }
        }
        let largest = 1 << lattice.bits;
        let is_box = |[low, high]: [[i32; 3]; 2]| {
            (0..3).all(|k| 0 <= low[k] && low[k] <= high[k] && high[k] <= largest)
        };
        if !self.bounds.is_none_or(is_box) {
            return Err(BaseMeshError::Info("the box of the reference mesh must be on the lattice"));
        }
        if !self.quantization.is_finite() || self.quantization < 0.0 {
            return Err(BaseMeshError::Info("what the lattice rounds off must be finite and not negative"));
        }
        if !self.displacement_per_error.is_finite() || self.displacement_per_error < 0.0 {
            return Err(BaseMeshError::Info("the displacement per error must be finite and not negative"));
        }
        if self.kind != MtKind::HalfEdge && self.updates > MAX_UPDATES {
            return Err(BaseMeshError::Info("an MT of this kind has at most 2^30 updates"));
        }
        if self.vertices.max(self.updates) > MAX_VERTICES {
            return Err(BaseMeshError::Info("an MT has at most 2^32 - 2 vertices, and no more updates"));
        }
        Ok(())
    }

    /// Whether a vertex with this position and these field levels is on the lattices.
    #[inline]
    pub fn holds(&self, position: [i32; 3], levels: &[i32]) -> bool {
        position.iter().all(|&x| 0 <= x && x <= 1 << self.lattice.bits)
            && levels.iter().zip(&self.fields).all(|(&q, field)| 0 <= q && q < 1 << field.bits)
    }
}

/// Whether what is known of a field's extremes, and of its average from cells, can be.
fn has_sound_extremes(field: &FieldInfo) -> bool {
    let is_finite =
        |extreme: &Extreme| extreme.value.is_finite() && extreme.place.iter().all(|x| x.is_finite());
    let are_sound =
        |both: &Extremes| both.both().into_iter().all(is_finite) && both.min.value <= both.max.value;
    let is_size = |x: f64| (0.0..f64::INFINITY).contains(&x);
    field.extremes.as_ref().is_none_or(are_sound)
        && field.averaged.as_ref().is_none_or(|Averaged { input, difference }| {
            are_sound(input) && is_size(difference.rms) && is_size(difference.largest)
        })
}

/// Finest field lattice.
pub const MAX_FIELD_BITS: u32 = 24;

/// Most updates that an edge-based or vertex-based MT can have: the first has two vertices for each, the second tags beside the numbers.
pub const MAX_UPDATES: u32 = 1 << 30;

/// Most vertices of an MT, and most updates of a half-edge MT: numbers have 32 bits, and all ones mean none.
pub const MAX_VERTICES: u32 = u32::MAX - 1;
