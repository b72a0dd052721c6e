//! The mesh that is edited, and the changes that builders make to it: holes and what fills them, collapses and whether they are valid.

pub(crate) mod collapse_check;
pub(crate) mod gift_wrap;
pub(crate) mod half_edge;
pub(crate) mod hole;
pub(crate) mod sides;
pub(crate) mod work_mesh;
