//! Promise: single requests are verified against the input near them, and what is wrong there is found.

use crate::support::meshes::{bent, blocks, hilly, linear};
use std::cell::Cell;
use std::ops::Range;
use tetralod::mesh::{Field, TetMesh};
use tetralod::mt::{Mt, MtKind, MultiTessellation};
use tetralod_build::verify;
use tetralod_build::verify::{GridValues, VerifyReport};
use tetralod_build::{BuildConfig, build};

fn made(mesh: &TetMesh, kind: MtKind) -> Mt {
    let config = BuildConfig { all_fields: true, ..BuildConfig::of(kind) };
    build(mesh, &config).expect("a mesh to build on").mt
}

fn reports(mt: &Mt, input: &TetMesh, count: usize) -> Vec<(String, VerifyReport)> {
    let samples = verify::samples(mt.info(), input, count, 0.05);
    assert_eq!(samples.len(), count);
    assert_eq!(samples, verify::samples(mt.info(), input, count, 0.05), "the same each time");
    samples
        .into_iter()
        .map(|sample| (sample.name.clone(), verify::run_request(mt, input, None, &sample)))
        .collect()
}

fn failures(reports: &[(String, VerifyReport)]) -> Vec<String> {
    reports.iter().flat_map(|(_, report)| report.failures.clone()).collect()
}

#[test]
fn sound_files_keep_their_promises_by_samples() {
    let notched = blocks([12, 8, 7], &[hilly, linear], |[x, y, z]| x < 6 || y < 3 || z > 4);
    let mut thin = bent(7);
    thin.positions.iter_mut().for_each(|p| p[2] *= 0.01);
    for mesh in [blocks([20; 3], &[hilly], |_| true), notched, bent(9), thin] {
        for kind in [MtKind::HalfEdge, MtKind::Edge] {
            let mt = made(&mesh, kind);
            let reports = reports(&mt, &mesh, 14);
            assert_eq!(failures(&reports), [""; 0], "{}", kind.name());
            assert!(reports.iter().all(|(_, report)| report.valid && report.queries == 1));
            assert!(reports.iter().any(|(_, report)| report.worst_error_ratio > 0.1), "errors were measured");
        }
    }
}

#[test]
fn grids_need_no_points() {
    let mesh = blocks([40, 30, 20], &[hilly], |_| true);
    let alone = TetMesh::of_grid_alone(mesh.grid.expect("a grid"), mesh.fields.clone());
    let mt = made(&mesh, MtKind::HalfEdge);
    let [with, without] = [&mesh, &alone].map(|input| reports(&mt, input, 9));
    assert_eq!(failures(&without), [""; 0]);
    for ((name, a), (other, b)) in with.iter().zip(&without) {
        assert_eq!((name, a.valid), (other, b.valid));
    }
}

#[test]
fn values_of_grids_may_be_elsewhere() {
    let dims = [40, 30, 20];
    let mesh = blocks(dims, &[hilly, linear], |_| true);
    let mt = made(&mesh, MtKind::HalfEdge);
    let grid = mesh.grid.expect("a grid");
    let alone = TetMesh::of_grid_alone(grid, mesh.fields.clone());
    let empty = TetMesh::of_grid_alone(grid, mesh.fields.iter().map(Field::without_values).collect());
    let [nx, ny, _] = grid.dims;
    let largest = Cell::new(0);
    let in_box = |field: usize, [xs, ys, zs]: [Range<u32>; 3]| -> Result<Vec<f64>, String> {
        let at = |x, y, z| mesh.fields[field].values[(x + nx * (y + ny * z)) as usize];
        let rows = zs.flat_map(|z| ys.clone().map(move |y| (y, z)));
        let read: Vec<f64> = rows.flat_map(|(y, z)| xs.clone().map(move |x| at(x, y, z))).collect();
        largest.set(largest.get().max(read.len()));
        Ok(read)
    };
    let wrong = |field: usize, points: [Range<u32>; 3]| {
        in_box(field, points).map(|values| values.iter().map(|value| 1.01 * value).collect())
    };
    let fails = |_: usize, _: [Range<u32>; 3]| Err("the file is gone".to_owned());
    let shorter = |field, points| in_box(field, points).map(|values| values[1..].to_vec());
    for layers in [1, 3, 100] {
        let mut found = [const { Vec::new() }; 3];
        for sample in verify::samples(mt.info(), &mesh, 9, 0.05) {
            let of = |read| verify::run_request(&mt, &empty, Some(&GridValues { layers, read }), &sample);
            let [there, here] = [of(&in_box), verify::run_request(&mt, &alone, None, &sample)];
            assert_eq!(there.failures, [""; 0]);
            assert_eq!(there.worst_error_ratio, here.worst_error_ratio);
            found[0].extend(of(&wrong).failures);
            found[1].extend(of(&fails).failures);
            found[2].extend(of(&shorter).failures);
        }
        for (found, words) in found.iter().zip(["are of the input", "the file is gone", "lacks values"]) {
            assert!(found.iter().any(|failure| failure.contains(words)), "{words}: {found:#?}");
        }
        if layers == 1 {
            assert!(largest.get() <= (nx * ny) as usize, "a layer at a time");
        }
    }
}

#[test]
fn what_is_wrong_is_found() {
    let mesh = blocks([40, 30, 20], &[hilly], |_| true);
    let mt = made(&mesh, MtKind::HalfEdge);
    let mut others = mesh.clone();
    others.fields[0].values.iter_mut().for_each(|x| *x *= 1.01);
    let found = failures(&reports(&mt, &others, 9));
    assert!(found.iter().any(|failure| failure.contains("are of the input")), "{found:#?}");
    assert!(found.iter().any(|failure| failure.contains("reference vertex")), "{found:#?}");
    let smaller = blocks([40, 30, 19], &[hilly], |_| true);
    assert!(failures(&reports(&mt, &smaller, 2))[0].contains("give the mesh that it was built from"));
    // Its cells are split along other diagonals.
    let mut split = mesh.clone();
    split.grid = None;
    let flip = |p: [f64; 3]| [p[0], p[1], 1.0 - p[2]];
    split.positions.iter_mut().for_each(|p| *p = flip(*p));
    split.tets.iter_mut().for_each(|tet| tet.swap(0, 1));
    let at = |v: usize| hilly(split.positions[v]);
    split.fields[0].values = (0..split.positions.len()).map(at).collect();
    let found = failures(&reports(&mt, &split, 9));
    assert!(found.iter().any(|failure| failure.contains("are of the input")), "{found:#?}");
}
