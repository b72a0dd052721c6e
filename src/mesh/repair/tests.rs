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
    assert_eq!(error, MeshError::Folded { tets: [0, 1] });
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
    assert_eq!(error, MeshError::InnerFlat { tet: 2, shared: 4 });
    assert!(error.to_string().contains("cell 2"));
}

#[test]
fn slivers_half_covered_are_refused() {
    for tets in
        [vec![BELOW[0], SLIVER, ABOVE[0]], vec![BELOW[0], SLIVER], vec![BELOW[0], BELOW[1], SLIVER, ABOVE[1]]]
    {
        let sliver = tets.iter().position(|t| *t == SLIVER).unwrap();
        let error = repair(mesh(&SQUARE, &tets)).unwrap_err();
        assert_eq!(error, MeshError::InnerFlat { tet: sliver as u32, shared: tets.len() as u32 - 1 });
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
    assert_eq!(error, MeshError::CrowdedFace { face: [0, 1, 2], tets: vec![0, 2, 3] });
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
