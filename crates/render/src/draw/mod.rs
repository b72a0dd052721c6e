//! What is to be drawn, as plain data. A [`Scene`](crate::scene::Scene) lists it, a [`Renderer`](crate::gpu::Renderer) draws it, and
//! neither knows of the other.

mod style;

pub use style::{CellShape, CellStyle, Colouring, EdgeLook, Lighting, SIDES, Style};

use std::ops::Range;
use tetralod::geom::{Bounds, SinglePoints, SingleValues};
use tetralod::view::{ClipPlane, Medium, MeshView, SurfaceChanges, Triangles};

/// A change of what is drawn. Large arrays are borrowed from what computed them.
#[derive(Clone, Debug)]
#[must_use = "who made it takes it as drawn"]
pub enum Edit<'a> {
    /// Nothing is drawn any more but the boxes.
    Clear,
    /// How all points are stored in single precision. If that is another way than before, everything else comes again.
    Points(SinglePoints),
    /// How the values of the mesh are stored in single precision.
    Values(SingleValues),
    /// These boxes and no others.
    Boxes(Vec<BoxLines>),
    /// The tetrahedra of the mesh are drawn in this style; none hides them.
    Cells(Option<CellStyle>),
    /// A value for each tetrahedron, for styles that colour by it.
    CellValues(&'a [f64]),
    /// The mesh is drawn as a volume of this medium, cut by the clip planes whose bit is set; none hides it.
    Volume(Option<(Medium, u32)>),
    /// The mesh of volume and tetrahedra, of which these ranges of points and of tetrahedra have changed.
    Mesh(MeshView<'a>, [&'a [Range<u32>]; 2]),
    /// Where the points of that mesh go, times [`Look::moved`]; they stay if there are none.
    Moves(&'a [[f64; 3]]),
    /// Surface number `key`.
    Surface {
        /// Which one.
        key: u32,
        /// All of it.
        triangles: Triangles<'a>,
        /// What of it has changed, and what lies beyond the ends of the arrays before; all if there are none.
        changes: Option<&'a SurfaceChanges>,
        /// How it looks.
        style: Style,
    },
    /// There is no surface with this number.
    Remove(u32),
    /// The left part of pictures, `split` of their width, shows what these edits make of another picture; at 0 there is none, and
    /// what was in it is forgotten.
    Beside {
        /// A fraction of the width, 0 to 1.
        split: f64,
        /// What has changed in that picture.
        edits: Vec<Edit<'a>>,
    },
}

/// Most planes that cut what is drawn; the six faces of a box count.
pub const MOST_CLIPS: usize = 16;

/// The appearance of the picture; colours are sRGB from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// The background at the top, and its opacity.
    pub sky: [f32; 4],
    /// The background at the bottom, and its opacity.
    pub ground: [f32; 4],
    /// Pixels of the target per unit of the page's layout: widths of lines scale with it.
    pub pixel_ratio: f32,
    /// What is cut away, where the style of a thing does not say otherwise; the first [`MOST_CLIPS`] count.
    pub clips: Vec<ClipPlane>,
    /// How dark places get that hardly any light reaches, 0 to 1; and how far away what hides the light may
    /// be, in model units.
    pub shade: [f32; 2],
    /// How many times its move each thing is displaced. Planes cut what is not displaced yet.
    pub moved: f64,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            sky: [0.075, 0.09, 0.115, 1.0],
            ground: [0.27, 0.31, 0.365, 1.0],
            pixel_ratio: 1.0,
            clips: Vec::new(),
            shade: [0.0, 1.0],
            moved: 0.0,
        }
    }
}

impl Look {
    /// The look of a model whose points are stored in single precision.
    pub(crate) fn relative_to(&self, single: &SinglePoints) -> Self {
        let clips = self.clips.iter().map(|clip| clip.relative_to(single)).collect();
        let [strength, radius] = self.shade;
        let shade = [strength, (f64::from(radius) / single.unit) as f32];
        Self { clips, shade, moved: self.moved / single.unit, ..self.clone() }
    }
}

/// The edges of a box, drawn as lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxLines {
    /// The box.
    pub bounds: Bounds,
    /// sRGB and opacity.
    pub colour: [f32; 4],
    /// Width in units of the page's layout.
    pub width: f32,
    /// Whether each face shows a handle in its middle.
    pub handles: bool,
}
