//! Edge-based Multi-Tessellations [§2.1, §4]: updates are vertex splits, their inverses edge collapses.
//!
//! Updates are an array of records of equal length (`Record` in `store`), with the errors beside it. Masks and offsets are residuals against a
//! prediction from the star (`predict`), which is made when a split is applied: decoding a block needs no mesh. A collapse needs no offset, as
//! it goes to the midpoint.
//!
//! That has its price. In a trial on bucky 33³, meshes within 0.2 / 1 / 5 / 20 % have 98 604 / 70 214 / 26 344 / 7 123 tetrahedra with midpoints;
//! 91 595 / 59 028 / 18 868 / 4 885 if the value at the midpoint is the one of the least error; 86 709 / 52 329 / 14 908 / 3 007 if the vertex goes
//! to the midpoint or to either end, whichever is best, with such a value. Files would need a residual of each field for every update, and a choice
//! among three places: that takes another version of the format, and bytes have not been measured.

pub(super) mod apply;
pub(super) mod builder;
pub(super) mod predict;
pub(super) mod star;
pub(super) mod store;
