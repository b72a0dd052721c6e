//! The kinds of MT that a build may do without.

use super::MtKind;

/// In each MT of a kind that needs the feature `all-kinds`. Without the feature it has no value: then the compiler knows that
/// there is no such MT, and leaves out whatever works on one, without a condition in any of these places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::mt) struct OtherKind(BuiltIn);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum BuiltIn {
    #[cfg(feature = "all-kinds")]
    Yes,
}

impl OtherKind {
    /// For constructors.
    ///
    /// # Panics
    /// Without the feature. Readers of files ask [`MtKind::is_built_in`] before.
    pub fn new() -> Self {
        #[cfg(feature = "all-kinds")]
        return Self(BuiltIn::Yes);
        #[cfg(not(feature = "all-kinds"))]
        panic!("MTs of this kind need the feature `all-kinds` of the crate")
    }
}

impl MtKind {
    /// Whether this build has MTs of the kind: half-edge MTs always, the others with the feature `all-kinds`.
    pub const fn is_built_in(self) -> bool {
        cfg!(feature = "all-kinds") || matches!(self, Self::HalfEdge)
    }
}
