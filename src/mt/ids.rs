//! Numbers of updates and vertices, and the result of applying an update.

/// Index of an update (a node of the MT) in coarse-to-fine order: parents come before their children.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct UpdateId(pub u32);

/// A vertex of the MT: one that appears in at least one of its meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VertexId(pub u32);

/// The result of applying or undoing an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Applied {
    /// The update is applied.
    Done,
    /// Nothing changed: this other update has to be applied (`u+`), or undone (`u−`), first.
    Blocked(UpdateId),
}
