//! The star that an insertion makes: its tetrahedra, by indices into their list and that of the vertices of the link.

use crate::mt::mesh::stars::GATHERED;

/// Most tetrahedra of a star, and most vertices of its link.
pub(in crate::mt) const MOST: usize = GATHERED;

/// Stands for the new vertex among the corners of a [`NewTet`].
pub(in crate::mt) const NEW: u8 = 0xFF;

/// Entries by corner of a [`NewTet`]: those of the link, and that of the new vertex at [`NEW`]; or by tetrahedron of the star, with one for
/// [`NO_ENTRY`]. None is out of range.
pub(super) type ByCorner<T> = [T; NEW as usize + 1];

/// No tetrahedron of the new star.
pub(in crate::mt) const NO_ENTRY: u8 = 0xFF;

/// A tetrahedron of the star that an insertion makes.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::mt) struct NewTet {
    /// The corners by index into the link, [`NEW`] for the new vertex; positive.
    pub corners: [u8; 4],
    /// Across each face that has the new vertex, the tetrahedron of the star, [`NO_ENTRY`] at the boundary.
    pub across: [u8; 4],
    /// Which corner is the new vertex.
    pub own: u8,
    /// What lies across the face opposite the new vertex.
    pub beyond: u32,
    /// The slot of T_u that it takes, or along whose face it fills the gap.
    pub source: u32,
    /// The update that removes it.
    pub remover: u32,
    /// Which faces go with it.
    pub inner: u8,
}
