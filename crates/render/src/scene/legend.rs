//! What the colours of a picture mean.

use tetralod::view::ColourScale;

/// What the colours of a picture mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    /// The name of the field or the quantity.
    pub label: String,
    /// The colours of its values.
    pub scale: ColourScale,
    /// Of a [label](tetralod::mesh::Field::is_label), those that the mesh has, ascending, with their colours in sRGB: then the scale is that of the
    /// palette. Else none.
    pub labels: Vec<(f64, [u8; 3])>,
    /// Points of the mesh that have no value: of the difference to a mesh of another file, those outside of that one.
    pub apart: usize,
}
