//! Each rule on meshes made by hand.

use super::*;
use crate::mesh::{Field, check, kuhn_tets};

fn mesh(positions: &[[f64; 3]], tets: &[[u32; 4]]) -> TetMesh {
    let values = (0..positions.len()).map(|i| i as f64).collect();
    let fields = vec![Field::new("f", values)];
    TetMesh { positions: positions.to_vec(), tets: tets.to_vec(), fields, ..TetMesh::default() }
}

fn repaired(positions: &[[f64; 3]], tets: &[[u32; 4]]) -> (TetMesh, RepairReport) {
    let (mesh, report) = repair(mesh(positions, tets)).unwrap();
    check(&mesh).unwrap();
    (mesh, report)
}

/// A unit square at z = 0 (points 0..4), apexes below (4) and above (5).
const SQUARE: [[f64; 3]; 6] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.4, 0.5, -1.0], [0.4, 0.5, 1.0]];
/// The flat tetrahedron on the square.
const SLIVER: [u32; 4] = [0, 1, 2, 3];
/// Two below the square, cut along 0-2; positive.
const BELOW: [[u32; 4]; 2] = [[0, 2, 1, 4], [0, 3, 2, 4]];
/// Two above the square, cut along 1-3; positive.
const ABOVE: [[u32; 4]; 2] = [[0, 1, 3, 5], [1, 2, 3, 5]];

#[test]
fn a_good_mesh_is_left_alone() {
    let (out, report) = repaired(&SQUARE[..5], &BELOW);
    assert_eq!((out, report.to_string()), (mesh(&SQUARE[..5], &BELOW), String::new()));
    assert!(report.is_empty());
}

#[test]
fn unused_points_go_and_fields_follow() {
    let (out, report) = repaired(&SQUARE, &BELOW);
    assert_eq!(report, RepairReport { unused_points: 1, ..RepairReport::default() });
    assert_eq!(report.to_string(), "repaired: dropped 1 unused point");
    assert_eq!(out.fields[0].values, [0.0, 1.0, 2.0, 3.0, 4.0]);
}

#[test]
fn inverted_tetrahedra_are_turned() {
    let (out, report) = repaired(&SQUARE[..5], &[BELOW[0], [3, 0, 2, 4]]);
    assert_eq!(report, RepairReport { turned_tets: 1, ..RepairReport::default() });
    assert_eq!(out.tets, [BELOW[0], [3, 0, 4, 2]]);
    assert_eq!(report.to_string(), "repaired: turned 1 inverted tetrahedron");
}

#[test]
fn folds_are_refused() {
    // The second tetrahedron's apex was pulled through the shared face.
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.1, 0.1, 1.0], [0.2, 0.2, 0.5]];
    let error = repair(mesh(&points, &[[0, 1, 2, 3], [0, 2, 1, 4]])).unwrap_err();
    assert_eq!(error, MeshError::Folded { tets: [0.into(), 1.into()] });
}

#[test]
fn boundary_slivers_go() {
    let (out, report) = repaired(&SQUARE[..5], &[SLIVER, BELOW[0], BELOW[1]]);
    assert_eq!(report, RepairReport { flat_tets: 1, ..RepairReport::default() });
    assert_eq!(out.tets, BELOW);
}

#[test]
fn fields_at_cells_follow_their_cells() {
    let mut input = mesh(&SQUARE[..5], &[BELOW[0], SLIVER, BELOW[1], BELOW[0]]);
    input.cell_fields = vec![Field::new("m", vec![1.0, 2.0, 3.0, 4.0]), Field::new("named", Vec::new())];
    let (out, _) = repair(input).unwrap();
    assert_eq!(out.cell_fields[0].values, [1.0, 3.0]);
    assert!(out.cell_fields[1].values.is_empty());
}

#[test]
fn slivers_go_in_layers() {
    // Two flat ones on top of the sliver, of which the second has to go before the first can.
    let mut points = SQUARE[..5].to_vec();
    points.push([0.5, 0.4, 0.0]);
    let tets = [BELOW[0], BELOW[1], SLIVER, [0, 1, 3, 5], [1, 2, 3, 5]];
    let (out, report) = repaired(&points, &tets);
    assert_eq!(out.tets, BELOW);
    assert_eq!((report.flat_tets, report.unused_points), (3, 1));
}

#[test]
fn isolated_flat_tetrahedra_go() {
    let (out, report) = repaired(&SQUARE, &[[0, 1, 2, 3], [0, 1, 4, 5]]);
    assert_eq!((out.tets.len(), report.flat_tets), (1, 1));
}

#[test]
fn inner_slivers_are_refused() {
    let tets = [BELOW[0], BELOW[1], SLIVER, ABOVE[0], ABOVE[1]];
    let error = repair(mesh(&SQUARE, &tets)).unwrap_err();
    assert_eq!(error, MeshError::InnerFlat { tet: 2.into(), shared: 4 });
    assert!(error.to_string().contains("cell 2"));
}

#[test]
fn slivers_half_covered_are_refused() {
    for tets in
        [vec![BELOW[0], SLIVER, ABOVE[0]], vec![BELOW[0], SLIVER], vec![BELOW[0], BELOW[1], SLIVER, ABOVE[1]]]
    {
        let sliver = tets.iter().position(|t| *t == SLIVER).unwrap();
        let error = repair(mesh(&SQUARE, &tets)).unwrap_err();
        assert_eq!(
            error,
            MeshError::InnerFlat { tet: (sliver as u32).into(), shared: tets.len() as u32 - 1 }
        );
    }
}

#[test]
fn collapsed_edges_are_merged_and_their_neighbours_meet() {
    // A prism split in three whose top edge 3-4 has length zero.
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]];
    let (out, report) = repaired(&points, &[[0, 1, 2, 3], [1, 2, 3, 4]]);
    assert_eq!(out.tets, [[0, 1, 2, 3]]);
    assert_eq!((report.merged_points, report.collapsed_tets, report.unused_points), (1, 1, 0));
    assert_eq!(report.differing_values, 1);
    assert_eq!(out.positions.len(), 4);
}

#[test]
fn coincident_points_without_an_edge_stay_apart() {
    // Two tetrahedra that touch in a face but share no point.
    let points = [SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[4], SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[5]];
    let (out, report) = repaired(&points, &[[0, 2, 1, 3], [4, 5, 6, 7]]);
    assert!(report.is_empty());
    assert_eq!(out.positions.len(), 8);
}

#[test]
fn duplicates_go_and_crowds_are_refused_with_the_numbers_of_the_input() {
    let (out, report) = repaired(&SQUARE[..5], &[BELOW[0], BELOW[1], [4, 2, 0, 1], BELOW[0]]);
    assert_eq!((out.tets.as_slice(), report.duplicate_tets), (&BELOW[..], 2));
    let points = [SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[4], SQUARE[5], [0.3, 0.3, 2.0]];
    let tets = [[0, 1, 2, 3], [0, 1, 1, 3], [0, 1, 2, 4], [0, 1, 2, 5]];
    let error = repair(mesh(&points, &tets)).unwrap_err();
    assert_eq!(error, MeshError::CrowdedFace { face: [0, 1, 2], tets: [0, 2, 3].map(Into::into).to_vec() });
}

#[test]
fn nothing_left_is_an_error() {
    assert_eq!(repair(mesh(&SQUARE, &[SLIVER])).unwrap_err(), MeshError::Empty);
    assert_eq!(repair(mesh(&SQUARE, &[])).unwrap_err(), MeshError::Empty);
}

#[test]
fn a_grid_with_every_other_tetrahedron_inverted_comes_back() {
    let grid = crate::mesh::Grid { dims: [4, 3, 3], origin: [0.0; 3], spacing: [0.1, 0.2, 0.3] };
    let mut mesh = TetMesh::from_grid(grid, Vec::new());
    mesh.tets.iter_mut().step_by(2).for_each(|t| t.swap(0, 1));
    let (out, report) = repair(mesh).unwrap();
    check(&out).unwrap();
    assert_eq!(report.turned_tets, kuhn_tets([4, 3, 3]).len() / 2);
    assert_eq!(out.grid, Some(grid));
}

/// At level weld.
fn welded(
    positions: &[[f64; 3]],
    tets: &[[u32; 4]],
    distance: f64,
) -> Result<(TetMesh, RepairReport), MeshError> {
    let (out, report) = repair_at(mesh(positions, tets), RepairLevel::Weld { distance })?;
    check(&out).unwrap();
    Ok((out, report))
}

fn found(mesh: &TetMesh) -> MeshFindings {
    findings(mesh, 0.0).unwrap()
}

/// The square with the pyramid below it, and again with the one above it, on its own points, which are moved to x = 1 by `shift`.
fn two_pyramids(above: [[u32; 4]; 2], shift: f64) -> (Vec<[f64; 3]>, Vec<[u32; 4]>) {
    let square = SQUARE[..4].iter().map(|&[x, y, z]| [x + shift * x, y, z]);
    let points = SQUARE[..5].iter().copied().chain(square).chain([SQUARE[5]]).collect();
    let above = above.map(|tet| tet.map(|v| if v == 5 { 9 } else { v + 5 }));
    (points, [BELOW, above].concat())
}

/// Two above the square, cut along 0-2 as those below; positive.
const ABOVE_ALIKE: [[u32; 4]; 2] = [[0, 1, 2, 5], [0, 2, 3, 5]];

#[test]
fn seams_that_are_cut_alike_close() {
    let (points, tets) = two_pyramids(ABOVE_ALIKE, 0.0);
    let open = mesh(&points, &tets);
    let expected =
        MeshFindings { components: 2, open_seam_faces: 4, weldable_faces: 4, ..MeshFindings::default() };
    assert_eq!(found(&open), expected);
    let kept = "kept: 2 parts that share no face; 4 faces on open seams (repair level \"weld\" closes them)";
    assert_eq!(expected.to_string(), kept);
    assert!(repair(open).unwrap().1.is_empty());

    let (out, report) = welded(&points, &tets, 0.0).unwrap();
    let done = RepairReport { welded_points: 4, differing_values: 4, ..RepairReport::default() };
    assert_eq!(report, done);
    assert_eq!(
        report.to_string(),
        "repaired: welded 4 points of open seams, of which 4 had other field values"
    );
    assert_eq!(out.fields[0].values, [0.0, 1.0, 2.0, 3.0, 4.0, 9.0]);
    assert_eq!(found(&out), MeshFindings { components: 1, ..MeshFindings::default() });
    assert_eq!(found(&out).to_string(), "");
    let level = RepairLevel::Weld { distance: 0.0 };
    assert_eq!(repair_at(out.clone(), level).unwrap(), (out, RepairReport::default()));
}

#[test]
fn seams_that_are_cut_along_the_other_diagonal_stay_open() {
    let (points, tets) = two_pyramids(ABOVE, 0.0);
    let (out, report) = welded(&points, &tets, 0.0).unwrap();
    assert!(report.is_empty());
    assert_eq!(out, mesh(&points, &tets));
    let found = found(&out);
    assert_eq!((found.components, found.open_seam_faces, found.weldable_faces), (2, 4, 0));
    assert!(found.to_string().ends_with(
        "4 faces on open seams (their two sides are cut differently: welding points does not close them)"
    ));
}

/// Two squares side by side with a pyramid on both sides of each; the left ones fit, the right ones do not.
#[test]
fn what_fits_of_a_seam_closes_and_the_rest_is_told() {
    let (mut points, mut tets) = two_pyramids(ABOVE_ALIKE, 0.0);
    // 10 to 12: the right square and its apex below; 13 to 15: the same above.
    for apex in [-1.0, 1.0] {
        points.extend([[2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [1.4, 0.5, apex]]);
    }
    tets.extend([[1, 11, 10, 12], [1, 2, 11, 12], [6, 13, 7, 15], [13, 14, 7, 15]]);
    let (out, report) = welded(&points, &tets, 0.0).unwrap();
    assert_eq!(report.welded_points, 4);
    assert_eq!((found(&out).open_seam_faces, found(&out).weldable_faces), (4, 0));
    let expected = MeshFindings { open_seam_faces: 8, weldable_faces: 4, ..found(&mesh(&points, &tets)) };
    assert_eq!(found(&mesh(&points, &tets)), expected);
    assert!(
        expected
            .to_string()
            .ends_with("(repair level \"weld\" closes 4 of them, the others are cut differently)")
    );
}

#[test]
fn a_tetrahedron_alone_and_a_hole_between_cells_of_one_side_have_no_seam() {
    let one = mesh(&SQUARE[1..5], &[[0, 1, 2, 3]]);
    let one = repair(one).unwrap().0;
    assert_eq!(found(&one), MeshFindings { components: 1, ..MeshFindings::default() });
    let grid = crate::mesh::Grid { dims: [4, 3, 3], origin: [0.0; 3], spacing: [0.1, 0.2, 0.3] };
    let grid = TetMesh::from_grid(grid, Vec::new());
    assert_eq!(found(&grid), MeshFindings { components: 1, ..MeshFindings::default() });
}

#[test]
fn a_flat_gap_between_shared_points_is_a_seam_and_the_gap_of_a_missing_cell_is_not() {
    // Both pyramids have the points of the square, but not its diagonal.
    let tets = [BELOW, ABOVE].concat();
    assert_eq!(found(&mesh(&SQUARE, &tets)).open_seam_faces, 4);
    let mut points = SQUARE;
    points[2][2] = 0.3;
    let found = found(&mesh(&points, &tets));
    assert_eq!((found.open_seam_faces, found.components), (0, 2));
}

#[test]
fn points_within_the_weld_distance_become_one() {
    let (points, tets) = two_pyramids(ABOVE_ALIKE, 0.01);
    assert!(welded(&points, &tets, 0.0).unwrap().1.is_empty());
    assert!(welded(&points, &tets, 0.0099).unwrap().1.is_empty(), "half a face does not close");
    let (out, report) = welded(&points, &tets, 0.0101).unwrap();
    assert_eq!(report.welded_points, 4);
    // The first points stay where they are.
    assert_eq!(out.positions, SQUARE);
    assert_eq!(found(&out).components, 1);
}

#[test]
fn cells_that_do_not_survive_the_weld_distance_are_refused() {
    let (points, tets) = two_pyramids(ABOVE_ALIKE, 0.01);
    assert_eq!(welded(&points, &tets, 1.0).unwrap_err(), MeshError::WeldTooFar { tet: 0.into() });
    for distance in [f64::NAN, f64::INFINITY, -1.0] {
        assert_eq!(welded(&points, &tets, distance).unwrap_err(), MeshError::WeldDistance);
    }
    // Two tetrahedra on nearly the same face, of which the second is thinner than the gap.
    let gap = 0.2;
    let mut points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    points.extend([[0.0, 0.0, -gap], [1.0, 0.0, -gap], [0.0, 1.0, -gap], [0.3, 0.3, -gap - 0.3]]);
    assert_eq!(welded(&points, &[[0, 1, 2, 3], [4, 6, 5, 7]], 0.21).unwrap().1.welded_points, 3);
    // The second one reaches into the first, with its face beyond its apex.
    points[4..7].iter_mut().for_each(|p| p[2] = gap);
    points[7] = [0.3, 0.3, 0.1];
    let error = welded(&points, &[[0, 1, 2, 3], [4, 6, 5, 7]], 0.21).unwrap_err();
    assert_eq!(error, MeshError::WeldTooFar { tet: 1.into() });
    assert!(error.to_string().contains("cell 1"));
}

#[test]
fn cells_that_two_blocks_have_become_one() {
    // The pyramid below, and above it the other block with one cell of the first.
    let (points, mut tets) = two_pyramids(ABOVE_ALIKE, 0.0);
    let mut all = points.clone();
    all.push(SQUARE[4]);
    tets.push([5, 7, 6, 10]);
    let (out, report) = welded(&all, &tets, 0.0).unwrap();
    assert_eq!((report.welded_points, report.duplicate_tets), (5, 1));
    assert_eq!((out.tets.len(), found(&out).components), (4, 1));
}

#[test]
fn overlapping_blocks_are_not_welded() {
    // Three tetrahedra on one face, each with points of its own: the second and the third overlap.
    let corners = [SQUARE[0], SQUARE[1], SQUARE[2]];
    let apexes = [SQUARE[4], SQUARE[5], [0.3, 0.3, 2.0]];
    let points: Vec<[f64; 3]> = apexes.iter().flat_map(|&apex| corners.into_iter().chain([apex])).collect();
    let tets = [[0, 2, 1, 3], [4, 5, 6, 7], [8, 9, 10, 11]];
    assert!(welded(&points, &tets, 0.0).unwrap().1.is_empty());
    assert!(welded(&points[4..], &[[0, 1, 2, 3], [4, 5, 6, 7]], 0.0).unwrap().1.is_empty());
}

#[test]
fn without_repair_only_valid_meshes_are_taken() {
    let good = mesh(&SQUARE[..5], &BELOW);
    assert_eq!(repair_at(good.clone(), RepairLevel::None), Ok((good, RepairReport::default())));
    let refused = |positions: &[[f64; 3]], tets: &[[u32; 4]]| {
        repair_at(mesh(positions, tets), RepairLevel::None).unwrap_err()
    };
    let repairs = "turned 1 inverted tetrahedron, dropped 1 unused point".to_owned();
    let error = refused(&SQUARE, &[BELOW[0], [3, 0, 2, 4]]);
    assert_eq!(error, MeshError::NeedsRepair { repairs });
    assert!(error.to_string().contains("level \"safe\" repairs it: turned 1"), "{error}");
    // What no level mends is refused for its own reason.
    let tets = [BELOW[0], BELOW[1], SLIVER, ABOVE[0], ABOVE[1]];
    assert_eq!(refused(&SQUARE, &tets), MeshError::InnerFlat { tet: 2.into(), shared: 4 });
    assert_eq!(refused(&SQUARE, &[SLIVER]), MeshError::Empty);
}

#[test]
fn a_boundary_that_touches_itself_is_told() {
    let points: Vec<[f64; 3]> =
        (0..7_u8).map(|i| [f64::from(i), f64::from(i).powi(2), f64::from(i).powi(3)]).collect();
    let at = |tets: &[[u32; 4]]| found(&repair(mesh(&points, tets)).unwrap().0);
    let edge = at(&[[0, 1, 2, 3], [0, 1, 4, 5]]);
    assert_eq!((edge.components, edge.non_manifold_edges, edge.non_manifold_vertices), (2, 1, 2));
    let text = "kept: 2 parts that share no face; a boundary that touches itself at 1 edge and 2 points";
    assert_eq!(edge.to_string(), text);
    let point = at(&[[0, 1, 2, 3], [0, 4, 5, 6]]);
    assert_eq!((point.components, point.non_manifold_edges, point.non_manifold_vertices), (2, 0, 1));
    let text = "kept: 2 parts that share no face; a boundary that touches itself at 1 point";
    assert_eq!(point.to_string(), text);
}
