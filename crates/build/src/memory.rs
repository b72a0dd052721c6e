//! How much memory building takes: known before it begins, from counts alone.

use super::parts::{left_at_interface, levels};
use super::{Construction, Method};
use tetralod::mt::MtKind;

/// Bytes that building takes for a tetrahedron of the reference mesh with one field. Arrays that grow by doubling make it differ by a
/// third from one size to the next, so this is the most that was measured.
fn bytes_a_tetrahedron(construction: Construction) -> u64 {
    match (construction.method(), construction.kind()) {
        (Method::Insert, _) => 680,
        (Method::Collapse, _) => 340,
        (Method::Decimate, MtKind::HalfEdge) => 180,
        (Method::Decimate, _) => 620,
    }
}

/// Tetrahedra of a triangulation for each hundred of its points.
const TRIANGULATED: u64 = 680;

/// The memory in bytes that building in `parts` takes at most at any time (see [`parts`](super::parts)), so many of them and so many joins side by
/// side, of a mesh of so many points, tetrahedra and fields. One process holds the mesh while it is parted. A forecast, as
/// [`memory_needed`].
pub fn memory_needed_in_parts(
    [points, tetrahedra, fields]: [u64; 3],
    parts: u32,
    at_a_time: [u32; 2],
) -> u64 {
    let parting = tetrahedra.saturating_mul(24).saturating_add(points.saturating_mul(100 + 24 * fields));
    parting.max(after_parting([points, tetrahedra, fields], parts, at_a_time))
}

/// [`memory_needed_in_parts`] of a mesh that is parted [piece by piece](crate::parts::Piecewise), of which so many points are in several
/// pieces, and the largest piece has so many tetrahedra: the whole mesh is never in memory, but what is near the places at which pieces meet.
pub fn memory_needed_in_pieces(
    counts: [u64; 3],
    [meeting, largest]: [u64; 2],
    parts: u32,
    at_a_time: [u32; 2],
) -> u64 {
    let [points, tetrahedra, fields] = counts;
    let each = 100 + 16 * fields;
    let piece = largest.saturating_mul(each);
    let part = (tetrahedra / u64::from(parts.max(1))).saturating_mul(each);
    // The tetrahedra around each such point, what they have at their corners, and which are beside each other, while points are located in them.
    let near = meeting.saturating_mul(1102 + 100 * fields).saturating_add(points.saturating_mul(8));
    let parting = piece.max(part).saturating_add(near);
    parting.max(after_parting(counts, parts, at_a_time))
}

/// The most that sorting takes that goes through files.
const SORTED: u64 = 16 << 20;

/// The most that a join has in memory of points in buckets.
const IN_BLOCKS: u64 = 16 << 20;

/// What the steps after parting take.
fn after_parting(
    [points, tetrahedra, fields]: [u64; 3],
    parts: u32,
    [parts_at_a_time, joins_at_a_time]: [u32; 2],
) -> u64 {
    let of_points = |bytes: u64| points.saturating_mul(bytes);
    let whole = tetrahedra.saturating_mul(150).saturating_add(of_points(120 * fields.saturating_sub(1)));
    let part = whole / u64::from(parts.max(1)) * u64::from(parts_at_a_time);
    // Each point has a record, in blocks of which half may be out of use.
    let in_blocks = of_points(2 * (25 + 8 * fields)).min(IN_BLOCKS);
    let (mut joining, mut largest) = (0, 0);
    let levels = levels(parts);
    for (below, pair) in (0..).zip(levels.windows(2)) {
        let &[children, nodes] = pair else { continue };
        let each = left(tetrahedra, below, children, points) / u64::from(nodes);
        largest = each.max(largest);
        let joined = each.saturating_mul(132 + 8 * fields).saturating_add(in_blocks);
        joining = joining.max(joined.saturating_mul(joins_at_a_time.min(nodes).into()));
    }
    // At first there is a number for each vertex, then one node at a time, and what upper levels have of errors.
    let assembling = largest.saturating_mul(130).saturating_add(of_points(2 * fields)).max(of_points(4));
    let assembling = assembling.saturating_add(of_points(20).min(SORTED));
    // Of what has been freed, allocators keep some for each thread.
    let kept = if parts_at_a_time > 1 { part / 2 } else { 0 };
    part.max(joining.max(assembling).saturating_add(kept))
}

/// Tetrahedra that are left of all nodes of a level of so many: an eighth of what is left of the level below. But more stay where nodes meet, at both
/// sides of planes across a grid, two triangles for each square.
fn left(tetrahedra: u64, level: u32, nodes: u32, points: u64) -> u64 {
    let halvings = nodes.max(1).ilog2();
    let planes: u32 = (0..3).map(|axis| (1 << ((halvings + axis) / 3)) - 1).sum();
    let side = libm::cbrt(points as f64);
    let at_planes = (4.0 * side * side) as u64 * u64::from(planes) * left_at_interface(nodes) as u64;
    at_planes.max(tetrahedra >> (3 * (level + 1)).min(63)).min(tetrahedra)
}

/// The memory in bytes that [`build`](super::build) and [`encode`](tetralod::format::encode) take at most for a mesh of so many points,
/// tetrahedra and fields (vectors count by their parts, time series by their steps), the mesh included. A forecast: measured for
/// meshes of many shapes, but no promise.
///
/// ```
/// use tetralod_build::{BuildConfig, memory_needed};
///
/// // A grid of 256³ points: six tetrahedra a cell.
/// let construction = BuildConfig::default().construction;
/// let bytes = memory_needed(construction, 256_u64.pow(3), 6 * 255_u64.pow(3), 1);
/// assert!((15..20).contains(&(bytes >> 30)), "about 17 GiB");
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

#[cfg(test)]
mod tests {
    use super::{memory_needed_in_parts, memory_needed_in_pieces};

    #[test]
    fn what_threads_have_taken_counts_after_them() {
        // What one process takes for a grid of 65³ points, two parts at a time, of which glibc keeps some of what is free.
        for (parts, measured) in [(2, 155_000_000), (4, 89_000_000), (8, 76_000_000), (16, 78_000_000)] {
            let needed = memory_needed_in_parts([274_625, 1_572_864, 1], parts, [2; 2]);
            assert!(needed > measured, "{parts} parts: {needed}");
        }
    }

    #[test]
    fn what_pieces_have_in_common_counts_while_they_are_parted() {
        // What parting a `sphere-flow` of these points and tetrahedra takes, by ranges of so many, which have so many points in common.
        for (counts, meeting, largest, measured) in [
            ([365_120, 2_135_484, 1], 16_116, 1_048_576, 116_200_000),
            ([365_120, 2_135_484, 1], 37_581, 458_752, 96_700_000),
            ([365_120, 2_135_484, 1], 93_756, 196_608, 152_200_000),
            ([1_524_224, 9_001_692, 1], 193_843, 1_048_576, 329_300_000),
        ] {
            let needed = memory_needed_in_pieces(counts, [meeting, largest], 64, [1; 2]);
            assert!(needed + needed / 10 > measured, "{counts:?}: {needed}");
        }
    }
}
