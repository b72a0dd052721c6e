//! What is known of an MT as a whole: its kind, its lattices, its fields.

use super::error::ErrorCode;
use crate::geom::{Bounds, Lattice, SinglePoints, SingleValues};
use crate::mesh::{Averaged, Difference, Extremes, Field, VectorPart, is_number_or_place};
use serde::Serialize;

/// Which kind of update an MT is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MtKind {
    /// Vertex splits whose inverse collapses an edge to its midpoint [§2.1, §4].
    Edge,
    /// Vertex insertions into star-shaped polyhedra; their inverse removes a vertex [§2.2, §5].
    Vertex,
    /// Vertex insertions whose inverse collapses a vertex onto a neighbour, stored so that any part can be read without
    /// the rest.
    HalfEdge,
}

impl MtKind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::HalfEdge, Self::Edge, Self::Vertex];

    /// Whether MTs of this kind can come in pages of updates: see `Mt::is_paged`.
    pub fn is_paged(self) -> bool {
        self == Self::HalfEdge
    }

    /// log2 of the updates that blocks of files have unless somebody says otherwise: fewer where each can be fetched by itself.
    pub fn usual_block_bits(self) -> u32 {
        if self == Self::HalfEdge { 8 } else { 11 }
    }

    /// The kind in one word: `half-edge`, `edge` or `vertex`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Edge => "edge",
            Self::Vertex => "vertex",
            Self::HalfEdge => "half-edge",
        }
    }
}

/// A scalar field of an MT: name, range, and the lattice that its values live on.
///
/// The value of lattice level `q` is `origin + step · q`. Time steps of one field are fields of one name with different
/// times; they have one range and one lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldInfo {
    /// The field's name.
    pub name: String,
    /// Smallest value over the reference vertices and all time steps, in field units.
    pub min: f64,
    /// Largest value over the reference vertices and all time steps, in field units.
    pub max: f64,
    /// Value of level 0.
    pub origin: f64,
    /// Distance between neighbouring levels; positive, also for a constant field.
    pub step: f64,
    /// Levels lie in `0 .. 2^bits`; 1 to 24.
    pub bits: u32,
    /// The unit of the values; empty if it is not known.
    pub unit: String,
    /// Which part of a vector or tensor the field is, if it is one.
    pub vector: Option<VectorPart>,
    /// Whether it is a label, whose values are whole numbers with nothing in between: a place has the label of the nearest corner.
    pub is_label: bool,
    /// The time that the values are of, if it is known.
    pub time: Option<f64>,
    /// The largest difference between the input's value at a reference vertex and that of the reference mesh where the input has the
    /// vertex, in field units, rounded up: what the lattice of the values rounds off and, where the lattice of the positions moves
    /// vertices, what the field changes on the way. 0 if all are exact.
    pub quantization: f64,
    /// The smallest and the largest value of the input at this time, and where the input has them; none if that is not known.
    pub extremes: Option<Extremes>,
    /// What averaging has done to it, if the input has its values at cells.
    pub averaged: Option<Averaged>,
}

/// A nameless field of one bit, for `..FieldInfo::default()`.
impl Default for FieldInfo {
    fn default() -> Self {
        Self {
            name: String::new(),
            min: 0.0,
            max: 1.0,
            origin: 0.0,
            step: 1.0,
            bits: 1,
            unit: String::new(),
            vector: None,
            is_label: false,
            time: None,
            quantization: 0.0,
            extremes: None,
            averaged: None,
        }
    }
}

impl FieldInfo {
    /// Whether this is, by name and time, a field of the mesh that the MT was built from.
    pub fn is_of(&self, field: &Field) -> bool {
        self.name == field.name && (self.time.is_none() || self.time == field.time)
    }

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

    /// How the values are stored in single precision, in all meshes.
    pub fn single_values(&self) -> SingleValues {
        SingleValues::of([self.min, self.max], self.step)
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
    pub tetrahedra: u64,
    /// Updates of the complete MT.
    pub updates: u32,
    /// The displacement of the boundary, in model units, that counts as an error of 1 (where cells are small, less may count as
    /// one). A mesh within error `e` comes
    /// within `e · displacement_per_error` of every reference vertex, and no vertex of its boundary is further than
    /// that from the boundary of the reference mesh.
    pub displacement_per_error: f64,
    /// The largest distance between a reference vertex on the lattice and in the input, in model units, rounded up; 0 if
    /// all are exact.
    pub quantization: f64,
    /// The box around the reference mesh on the lattice, its least and its largest corner: all meshes of the MT are in it, and it is
    /// as small as can be. None if that is not known, as of files that do not state it: see
    /// [`find_bounds`](crate::mt::Mt::find_bounds).
    pub bounds: Option<[[i32; 3]; 2]>,
}

/// A field that was averaged from cells: see [`MtInfo::averaged_fields`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AveragedField {
    /// Its name.
    pub name: String,
    /// Its unit; empty if it is not known.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// The time that its values are of, if it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// Whether it is a label.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_label: bool,
    /// The smallest and the largest value that the input has at cells.
    pub input: Extremes,
    /// The smallest and the largest value at points.
    pub points: Extremes,
    /// How far the field at points is from the values at cells; of labels, how much of cells has another one.
    pub difference: Difference,
}

impl MtInfo {
    /// The fields that the input has at cells, and what averaging them to points has done.
    pub fn averaged_fields(&self) -> Vec<AveragedField> {
        let of = |field: &FieldInfo| {
            let Averaged { input, difference } = field.averaged.clone()?;
            let FieldInfo { name, unit, time, is_label, extremes, .. } = field.clone();
            Some(AveragedField { name, unit, time, is_label, input, points: extremes?, difference })
        };
        self.fields.iter().filter_map(of).collect()
    }

    /// How points are stored in single precision, in all meshes.
    pub fn single_points(&self) -> SinglePoints {
        SinglePoints::of(&self.lattice)
    }

    /// [`MtInfo::bounds`] in model units.
    pub fn model_bounds(&self) -> Option<Bounds> {
        self.bounds.map(|[min, max]| Bounds { min: self.lattice.point(min), max: self.lattice.point(max) })
    }

    /// The error of field `field` that is left when every update is applied, as a fraction of its range: what the
    /// lattices round off. Positions count as displacements of the boundary do, not at all where any displacement would
    /// be an infinite error. No error of an update is smaller.
    pub fn floor(&self, field: usize) -> f64 {
        let moved = if self.displacement_per_error > 0.0 {
            self.quantization / self.displacement_per_error
        } else {
            0.0
        };
        self.fields.get(field).map_or(moved, |f| moved.max(f.quantization / f.range()))
    }

    /// The smallest and the largest value of a field over all of its time steps, which are the fields of its name: what means the
    /// same at all times.
    ///
    /// # Panics
    /// If there is no such field.
    pub fn range_at_all_times(&self, field: usize) -> [f64; 2] {
        let name = &self.fields[field].name;
        let steps = self.fields.iter().filter(|step| step.name == *name);
        steps.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], step| {
            [low.min(step.min), high.max(step.max)]
        })
    }

    /// The field with a name at the time of the field that is shown, or else its first time step.
    pub fn step_of(&self, name: &str, shown: usize) -> Option<usize> {
        let time = self.fields.get(shown).and_then(|field| field.time);
        let steps = || (0..self.fields.len()).filter(|&step| self.fields[step].name == name);
        steps().find(|&step| self.fields[step].time == time).or_else(|| steps().next())
    }

    /// The field that is shown where none is asked for: the first that varies, is no label, no component of a vector, and neither numbers
    /// something nor says where it is, by its name; if all are that, the first that varies. 0 if none does.
    pub fn first_field(&self) -> usize {
        let varies = |field: &FieldInfo| field.max > field.min;
        let tells = |field: &FieldInfo| {
            let is_component = field.vector.as_ref().is_some_and(|part| part.component.is_some());
            varies(field) && !is_component && !field.is_label && !is_number_or_place(&field.name)
        };
        let first = |wanted: &dyn Fn(&FieldInfo) -> bool| self.fields.iter().position(wanted);
        first(&tells).or_else(|| first(&varies)).unwrap_or(0)
    }

    /// The largest error of a field, in its units, at the reference vertices inside a mesh within `error`, where the input has them.
    pub fn field_bound(&self, field: usize, error: f64) -> f64 {
        error.max(self.floor(field)) * self.fields[field].range()
    }

    /// How far the boundaries of a mesh within `error` and of the input are from each other at most, in model units, at the vertices of both
    /// and at the middles of their triangles and edges. Elsewhere on curved boundaries it may be a little more. Builders do not bound it at the
    /// middles of the input's triangles and edges: `docs/promises.md` has what was measured there.
    pub fn boundary_bound(&self, error: f64) -> f64 {
        error * self.displacement_per_error + self.quantization
    }

    /// The smallest error that a tetrahedron has by itself: what rounding alone can amount to, of the values
    /// at corners and of those that are compared with.
    pub fn least_own_error(&self, field: usize) -> ErrorCode {
        ErrorCode::at_least(2.0 * self.floor(field))
    }
}
