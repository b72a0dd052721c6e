//! How much memory building takes: known before it begins, from counts alone.

use super::{Construction, Method};
use crate::mt::MtKind;

/// Bytes that building takes for a tetrahedron of the reference mesh with one field. Arrays that grow by doubling make it differ by a
/// third from one size to the next, so this is the most that was measured.
fn bytes_a_tetrahedron(construction: Construction) -> u64 {
    match (construction.method(), construction.kind()) {
        (Method::Insert, _) => 680,
        (Method::Collapse, MtKind::Explicit) => 800,
        (Method::Collapse, _) => 340,
        (Method::Decimate, MtKind::HalfEdge) => 200,
        (Method::Decimate, _) => 620,
    }
}

/// Tetrahedra of a triangulation for each hundred of its points.
const TRIANGULATED: u64 = 680;

/// The memory in bytes that [`build`](super::build) and [`encode`](crate::format::encode) take at most for a mesh of so many points,
/// tetrahedra and fields (vectors count by their parts, time series by their steps), the mesh included. A forecast: measured for
/// meshes of many shapes, but no promise.
///
/// ```
/// use tetralod::builder::{BuildConfig, memory_needed};
///
/// // A grid of 256³ points: six tetrahedra a cell.
/// let construction = BuildConfig::default().construction;
/// let bytes = memory_needed(construction, 256_u64.pow(3), 6 * 255_u64.pow(3), 1);
/// assert!((15..25).contains(&(bytes >> 30)), "about 19 GiB");
/// ```
pub fn memory_needed(construction: Construction, points: u64, tetrahedra: u64, fields: u64) -> u64 {
    let tetrahedra = match construction.method() {
        Method::Insert => points.saturating_mul(TRIANGULATED) / 100,
        Method::Collapse | Method::Decimate => tetrahedra,
    };
    let of_a_field = match construction.method() {
        Method::Collapse => 400,
        Method::Insert | Method::Decimate => 120,
    };
    let more_fields = points.saturating_mul(fields.saturating_sub(1)).saturating_mul(of_a_field);
    tetrahedra.saturating_mul(bytes_a_tetrahedron(construction)).saturating_add(more_fields)
}
