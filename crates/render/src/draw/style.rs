//! How a thing is drawn: colours, opacity, light, edges.

use tetralod::view::{ClipPlane, ColourScale};

/// What light does on a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lighting {
    /// Lit by the normals of its vertices.
    #[default]
    Smooth,
    /// Lit a little by the normal of each triangle, so that colours stay those of the legend.
    Flat,
    /// Colours as they are.
    None,
}

/// The colours of a surface: sRGB from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Colouring {
    /// One colour a side: the first is seen from lower values, or from outside.
    Sides([[f32; 3]; 2]),
    /// That of the value.
    Scale(ColourScale),
}

/// The edges of triangles or tetrahedra.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeLook {
    /// sRGB and strength, 0 to 1.
    pub colour: [f32; 4],
    /// In units of the page's layout.
    pub width: f32,
}

impl Default for EdgeLook {
    fn default() -> Self {
        Self { colour: [0.05, 0.06, 0.08, 0.8], width: 1.1 }
    }
}

/// How a surface is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// The colours of the surface.
    pub colouring: Colouring,
    /// From 0 to 1; below 1, what is behind is seen through it.
    pub opacity: f32,
    /// What light does.
    pub lighting: Lighting,
    /// The edges of its triangles; none are drawn without it.
    pub edges: Option<EdgeLook>,
    /// Which of the clip planes of the picture cut it, a bit each.
    pub clips: u32,
}

/// The colours of an isosurface that is coloured by its sides.
pub const SIDES: [[f32; 3]; 2] = [[0.93, 0.70, 0.36], [0.38, 0.56, 0.72]];

impl Default for Style {
    fn default() -> Self {
        Self {
            colouring: Colouring::Sides(SIDES),
            opacity: 1.0,
            lighting: Lighting::Smooth,
            edges: None,
            clips: u32::MAX,
        }
    }
}

/// How tetrahedra are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellStyle {
    /// Colours, edges and clip planes; tetrahedra are opaque and their light is flat.
    pub style: Style,
    /// What they look like.
    pub shape: CellShape,
    /// Tetrahedra with their centroid beyond this plane are left out as a whole.
    pub cut: ClipPlane,
    /// Whether each tetrahedron has the colour of its own value, not of those at its points.
    pub own_values: bool,
}

impl Default for CellStyle {
    fn default() -> Self {
        let style = Style { lighting: Lighting::Flat, edges: Some(EdgeLook::default()), ..Style::default() };
        Self { style, shape: CellShape::default(), cut: ClipPlane::NOTHING, own_values: false }
    }
}

/// What tetrahedra look like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CellShape {
    /// Solid, shrunk towards their centroids by this part of their size, 0 to 1.
    Solid(f32),
    /// Their edges alone.
    Wire,
    /// Their points, as balls of this diameter in units of the page's layout.
    Points(f32),
}

impl Default for CellShape {
    fn default() -> Self {
        Self::Solid(0.0)
    }
}
