//! Repair on random soups of tetrahedra: what it accepts is valid and fills what it filled before.

use crate::support::strategies::config;
use proptest::prelude::*;
use tetralod::mesh::{
    Field, Grid, MeshError, MeshFindings, RepairLevel, TetMesh, check, findings, repair, repair_at, topology,
};

/// Six times the volume; exact for the small integer coordinates used here.
fn six_volume(mesh: &TetMesh, tet: [u32; 4]) -> f64 {
    let p = tet.map(|v| mesh.positions[v as usize]);
    let [u, v, w] = [1, 2, 3].map(|k| [0, 1, 2].map(|i| p[k][i] - p[0][i]));
    (u[1] * v[2] - u[2] * v[1]) * w[0]
        + (u[2] * v[0] - u[0] * v[2]) * w[1]
        + (u[0] * v[1] - u[1] * v[0]) * w[2]
}

/// Six times the volume of all different tetrahedra.
fn filled(mesh: &TetMesh) -> f64 {
    let mut tets: Vec<[u32; 4]> = mesh.tets.clone();
    tets.iter_mut().for_each(|t| t.sort_unstable());
    tets.sort_unstable();
    tets.dedup();
    tets.iter().map(|t| six_volume(mesh, *t).abs()).sum()
}

fn has_coincident_points(mesh: &TetMesh) -> bool {
    mesh.positions.iter().enumerate().any(|(i, p)| mesh.positions[..i].contains(p))
}

fn soup() -> impl Strategy<Value = TetMesh> {
    let point = [0..3_i32, 0..3_i32, 0..2_i32].prop_map(|p| p.map(f64::from));
    (prop::collection::vec(point, 4..10), prop::collection::vec([0..10_u32, 0..10, 0..10, 0..10], 1..7))
        .prop_map(|(positions, tets)| {
            let values = (0..positions.len()).map(|i| i as f64).collect();
            let points = positions.len() as u32;
            let tets = tets.into_iter().map(|t| t.map(|v| v % points)).collect();
            TetMesh { positions, fields: vec![Field::new("f", values)], tets, ..TetMesh::default() }
        })
}

/// A grid, which of its tetrahedra are turned, and boundary squares that get a sliver.
fn dirty_grid() -> impl Strategy<Value = (TetMesh, usize, usize)> {
    (prop::collection::vec(any::<bool>(), 48), prop::collection::vec(any::<bool>(), 4)).prop_map(
        |(turned, slivers)| {
            let grid = Grid { dims: [3; 3], origin: [0.0; 3], spacing: [1.0; 3] };
            let mut mesh = TetMesh::from_grid(grid, Vec::new());
            for (tet, _) in mesh.tets.iter_mut().zip(&turned).filter(|(_, turned)| **turned) {
                tet.swap(1, 2);
            }
            // The four squares at z = 0.
            for (i, _) in slivers.iter().enumerate().filter(|(_, sliver)| **sliver) {
                let first = [0, 1, 3, 4][i];
                mesh.tets.insert(7 * i, [first, first + 1, first + 4, first + 3]);
            }
            let count = |flags: &[bool]| flags.iter().filter(|f| **f).count();
            (mesh, count(&turned), count(&slivers))
        },
    )
}

/// Blocks of a grid, each with points of its own, which are off by at most `shift` in each coordinate; and how many
/// points are too many. Cells come and points are numbered in any order.
fn blocks(shift: f64) -> impl Strategy<Value = (TetMesh, usize)> {
    let block_of_cube = prop::collection::vec(0..3_u32, 12);
    let offsets = prop::collection::vec([-1.0..1.0, -1.0..1.0, -1.0..1.0], 180);
    (block_of_cube, offsets, any::<u64>()).prop_map(move |(block_of_cube, offsets, order)| {
        let grid = Grid { dims: [4, 3, 3], origin: [0.0; 3], spacing: [1.0; 3] };
        let whole = TetMesh::from_grid(grid, Vec::new());
        let mut points: Vec<(u32, u32)> = Vec::new();
        let mut tets = Vec::new();
        for (tet, block) in whole.tets.iter().zip(block_of_cube.iter().flat_map(|block| [block; 6])) {
            tets.push(tet.map(|v| {
                let point = (*block, v);
                points.iter().position(|p| *p == point).unwrap_or_else(|| {
                    points.push(point);
                    points.len() - 1
                }) as u32
            }));
        }
        let count = points.len();
        // Another number for each: the prime is larger than the count.
        let number = |v: u32| (v as usize * 1009 + (order % 1000) as usize) % count;
        let mut positions = vec![[0.0; 3]; count];
        for (v, (_, of_whole)) in (0..).zip(&points) {
            let at = whole.positions[*of_whole as usize];
            positions[number(v)] = [0, 1, 2].map(|i| at[i] + shift * offsets[v as usize][i]);
        }
        tets.iter_mut().flatten().for_each(|v| *v = number(*v) as u32);
        tets.rotate_left((order % 71) as usize);
        let values = (0..count).map(|i| i as f64).collect();
        let mesh = TetMesh { positions, tets, fields: vec![Field::new("f", values)], ..TetMesh::default() };
        (mesh, count - whole.positions.len())
    })
}

proptest! {
    #![proptest_config(config(256, 47))]

    #[test]
    fn blocks_that_touch_are_welded_into_the_whole(exact in blocks(0.0), near in blocks(0.01)) {
        for ((mesh, doubled), distance) in [(exact, 0.0), (near, 0.04)] {
            let (mended, report) = repair_at(mesh.clone(), RepairLevel::Weld { distance }).unwrap();
            prop_assert_eq!(check(&mended), Ok(()));
            prop_assert_eq!((mended.positions.len(), report.welded_points), (36, doubled));
            let one = MeshFindings { components: 1, ..MeshFindings::default() };
            prop_assert_eq!(findings(&mended, distance), Ok(one));
            prop_assert_eq!(topology(36, &mended.tets).unwrap().boundary_faces, 2 * 2 * (3 * 2 + 3 * 2 + 2 * 2));
            let before = findings(&mesh, distance).unwrap();
            prop_assert_eq!(before.open_seam_faces, before.weldable_faces);
            // Points that stay are where they were, with their values.
            for (p, value) in mended.positions.iter().zip(&mended.fields[0].values) {
                prop_assert_eq!(mesh.positions[*value as usize], *p);
            }
        }
    }
}

proptest! {
    #![proptest_config(config(20_000, 41))]

    #[test]
    fn what_is_welded_is_valid(mesh in soup(), distance in prop::sample::select(vec![0.0, 0.5, 1.0])) {
        let level = RepairLevel::Weld { distance };
        if let Ok((mended, report)) = repair_at(mesh.clone(), level) {
            prop_assert_eq!(check(&mended), Ok(()));
            prop_assert_eq!(report.is_empty(), mended == mesh, "{}", report);
            if let Ok((safe, done)) = repair(mesh.clone()) && report.welded_points == 0 {
                prop_assert_eq!((&safe, done), (&mended, report));
            }
            findings(&mended, distance).unwrap();
        }
    }

    #[test]
    fn without_repair_valid_meshes_alone_are_taken(mesh in soup()) {
        match (repair_at(mesh.clone(), RepairLevel::None), repair(mesh.clone())) {
            (Ok((kept, _)), Ok((mended, report))) => {
                prop_assert!(report.is_empty());
                prop_assert_eq!((&kept, &mended), (&mesh, &mesh));
            }
            (Err(MeshError::NeedsRepair { repairs }), Ok((_, report))) => {
                prop_assert_eq!(format!("repaired: {repairs}"), report.to_string());
            }
            (Err(error), Err(same)) => prop_assert_eq!(error, same),
            (result, _) => prop_assert!(false, "{:?}", result),
        }
    }

    #[test]
    fn what_is_accepted_is_valid_and_as_full_as_before(mesh in soup()) {
        if let Ok((mended, report)) = repair(mesh.clone()) {
            prop_assert_eq!(check(&mended), Ok(()));
            prop_assert_eq!(report.is_empty(), mended == mesh, "{}", report);
            prop_assert_eq!(report.is_empty(), report.to_string().is_empty());
            prop_assert_eq!(repair(mended.clone()).map(|(again, _)| again), Ok(mended.clone()));
            // Duplicates that appear when coincident points are merged are counted twice in the soup.
            if !has_coincident_points(&mesh) {
                prop_assert_eq!(filled(&mended), filled(&mesh));
            }
            // Values stay with their points.
            for (p, value) in mended.positions.iter().zip(&mended.fields[0].values) {
                prop_assert_eq!(mesh.positions[*value as usize], *p);
            }
        }
    }
}

proptest! {
    #![proptest_config(config(256, 43))]

    #[test]
    fn a_dirty_grid_is_mended((mesh, turned, slivers) in dirty_grid()) {
        let (mended, report) = repair(mesh).unwrap();
        prop_assert_eq!(check(&mended), Ok(()));
        prop_assert_eq!((report.turned_tets, report.flat_tets), (turned, slivers));
        prop_assert_eq!(filled(&mended), 48.0);
        let topology = topology(27, &mended.tets).unwrap();
        prop_assert_eq!((topology.components, topology.boundary_faces), (1, 48));
        prop_assert_eq!(topology.non_manifold_count(), 0);
    }
}
