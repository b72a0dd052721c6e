//! How VTK marks cells and points that belong to another piece or are hidden.

/// Arrays at cells and points by which VTK marks what belongs to another piece, or is hidden: flags of each, and how far it is
/// from the piece in old files.
pub(super) const GHOST_TYPE: &str = "vtkGhostType";
pub(super) const GHOST_LEVELS: &str = "vtkGhostLevels";
/// The flags of cells that another piece has, and of those that are hidden or that finer ones take the place of.
pub(super) const GHOST_CELL: i64 = 1;
pub(super) const HIDDEN_CELL: i64 = 32 | 8;
/// The flag of points that are hidden; so are the cells there.
pub(super) const HIDDEN_POINT: i64 = 2;
