//! Surfaces and measurements of a mesh, computed on the CPU from slices, without an MT; colours of values,
//! ticks and axes. Isosurfaces and sections are cut by one engine, `marching`, which follows the changes of a mesh by a copy of it
//! (`mesh_snapshot`).

mod axes;
mod boundary;
mod clip;
mod colormap;
mod colour_scale;
mod difference;
#[doc(hidden)]
pub mod gizmo;
mod glyphs;
mod iso;
mod label_parts;
mod marching;
mod mesh_snapshot;
mod moves;
mod pick;
mod probe;
mod region_palette;
mod slice;
mod solids;
mod stats;
mod stream;
mod ticks;
mod triangles;
mod tubes;
mod volume;
mod within;

#[doc(hidden)]
pub use crate::mesh::Histogram;
#[doc(hidden)]
pub use axes::{AxisTick, BoxAxis, BoxEdge, ScaleBar, box_axis, scale_bar, tick_edges};
pub use boundary::BoundarySurface;
#[doc(hidden)]
pub use boundary::{area, is_closed};
pub use clip::ClipPlane;
pub use colormap::Colormap;
#[doc(hidden)]
pub use colormap::{
    BALANCE, BATLOW, CIVIDIS, COOLWARM, GREY, HALINE, ICE, INFERNO, LAJOLLA, LAPAZ, MAGMA, OSLO, PLASMA,
    ROMA, THERMAL, TURBO, VIK, VIRIDIS,
};
pub use colour_scale::ColourScale;
#[doc(hidden)]
pub use colour_scale::ScaleError;
#[doc(hidden)]
pub use difference::Difference;
#[doc(hidden)]
pub use glyphs::ArrowLength;
pub use glyphs::ArrowOptions;
pub use iso::{IsoSurface, NormalKind};
#[doc(hidden)]
pub use label_parts::LabelParts;
#[doc(hidden)]
pub use moves::Slope;
#[doc(hidden)]
pub use pick::{MediumHit, SurfaceHit, first_hit, first_hit_in, first_hit_in_displaced, first_kept_hit};
pub use probe::Probe;
#[doc(hidden)]
pub use probe::{Place, Span};
#[doc(hidden)]
pub use region_palette::{label_value, region_color, region_scale};
pub use slice::{Plane, Slice};
#[doc(hidden)]
pub use solids::Solids;
pub use stats::FieldStats;
#[doc(hidden)]
pub use stream::{StreamEnd, StreamPoint, Tracer};
pub use stream::{Streamline, TraceOptions};
#[doc(hidden)]
pub use ticks::{Tick, end_ticks, linear_ticks, log_ticks};
pub use triangles::Triangles;
#[doc(hidden)]
pub use tubes::TubeEnd;
pub use tubes::TubeOptions;
#[doc(hidden)]
pub use volume::{Light, Medium};
#[doc(hidden)]
pub use within::MeshWithin;

use crate::geom::Bounds;
use std::ops::Range;

/// The changes of a surface since the last call: ranges in ascending order. Beyond the ends of the arrays
/// everything is gone.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SurfaceChanges {
    /// Changed ranges of vertices.
    pub vertices: Vec<Range<u32>>,
    /// Changed ranges of triangles.
    pub triangles: Vec<Range<u32>>,
}

/// A tetrahedral mesh as slices: what the renderer and everything of this module take. All numbers are absolute, in double precision:
/// points are those of the lattice of positions, values those of the levels of the field.
#[derive(Clone, Copy, Debug)]
pub struct MeshView<'a> {
    /// Points in model units.
    pub positions: &'a [[f64; 3]],
    /// One field value per point, in the field's own units.
    pub field: &'a [f64],
    /// Whether the field is a [label](crate::mesh::Field::is_label).
    pub is_label: bool,
    /// Positive tetrahedra as indices into `positions`.
    pub tets: &'a [[u32; 4]],
    /// `neighbors[t][i]` is the tetrahedron across face `i` (opposite vertex `i`) of `t`, or
    /// [`crate::mesh::NONE`] on the boundary.
    pub neighbors: &'a [[u32; 4]],
}

/// A field as slices: one number a point, and what it is between the points.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct FieldView<'a> {
    /// One value per point.
    pub values: &'a [f64],
    /// Whether it is a [label](crate::mesh::Field::is_label): each place has that of the nearest point. Other fields are linear.
    pub is_label: bool,
}

impl<'a> From<&'a [f64]> for FieldView<'a> {
    /// A field that is no label.
    fn from(values: &'a [f64]) -> Self {
        Self { values, is_label: false }
    }
}

impl<'a> From<&'a Vec<f64>> for FieldView<'a> {
    /// A field that is no label.
    fn from(values: &'a Vec<f64>) -> Self {
        Self { values, is_label: false }
    }
}

impl<'a> MeshView<'a> {
    /// The mesh's own field.
    pub fn own_field(&self) -> FieldView<'a> {
        FieldView { values: self.field, is_label: self.is_label }
    }

    /// The box around all points.
    pub fn bounds(&self) -> Bounds {
        self.positions.iter().fold(Bounds::EMPTY, |bounds, p| bounds.with(*p))
    }
}
