//! How the numbers of a Gmsh file are written.

use crate::number::NumberType;

/// Which of the layouts a file has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Version {
    Two,
    Four,
    FourOne,
}

/// How the numbers of a file are written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    pub version: Version,
    pub binary: bool,
    pub big: bool,
    /// Of version 4.1: the type of counts and tags.
    pub wide: NumberType,
}
