//! Promise: what is measured is the difference at the reference vertices, inside the mesh and beside it.

use tetralod::geom::Lattice;
use tetralod::mt::{BaseMesh, CurrentMesh, FieldInfo, MtInfo, MtKind};
use tetralod_build::measure::{Part, Promise, Reference, deviation};

/// Two tetrahedra above and below a triangle, with values 10 20 30 80 90.
fn mesh() -> (MtInfo, CurrentMesh) {
    let field = FieldInfo {
        name: "f".into(),
        min: 0.0,
        max: 100.0,
        origin: 0.0,
        step: 1.0,
        bits: 7,
        ..FieldInfo::default()
    };
    let info = MtInfo {
        kind: MtKind::Edge,
        lattice: Lattice { origin: [-4.0; 3], step: [0.5; 3], bits: 6 },
        fields: vec![field],
        vertices: 5,
        tetrahedra: 2,
        updates: 0,
        displacement_per_error: 1.0,
        quantization: 0.0,
        bounds: None,
    };
    let base = BaseMesh {
        positions: vec![[8, 8, 8], [16, 8, 8], [8, 16, 8], [8, 8, 16], [8, 8, 0]],
        values: vec![10, 20, 30, 80, 90],
        tets: vec![[0, 1, 2, 3], [0, 2, 1, 4]],
    };
    let mesh = CurrentMesh::new(&info, &base).expect("a valid mesh");
    (info, mesh)
}

/// Measures at reference vertices given by lattice position and value.
fn measure(points: &[([i32; 3], f64)], part: &Part) -> (f64, f64, u64) {
    let (info, mesh) = mesh();
    let positions: Vec<_> = points.iter().map(|(q, _)| info.lattice.point(*q)).collect();
    let values: Vec<_> = points.iter().map(|(_, value)| *value).collect();
    let reference = Reference { positions: &positions, values: &values, field: 0, regions: &[] };
    let found = deviation(&info, &mesh, &reference, part);
    (found.field, found.distance, found.vertices)
}

#[test]
fn inside_the_interpolant_counts() {
    let all = Part::default();
    assert_eq!(measure(&[([8, 8, 9], 13.0)], &all), (5.75, 0.0, 1));
    assert_eq!(measure(&[([8, 8, 9], 25.0)], &all), (6.25, 0.0, 1));
    assert_eq!(measure(&[([8, 8, 7], 7.0)], &all), (13.0, 0.0, 1));
    assert_eq!(measure(&[([8, 16, 8], 30.0), ([10, 10, 8], 17.5)], &all), (0.0, 0.0, 2));
    assert_eq!(measure(&[([8, 8, 9], 13.0), ([8, 8, 7], 7.0), ([8, 8, 8], 10.0)], &all), (13.0, 0.0, 3));
    assert_eq!(measure(&[], &all), (0.0, 0.0, 0));
}

#[test]
fn outside_the_nearest_place_on_the_boundary_counts() {
    // The nearest places lie on the edges that join vertex 1 to the two tips.
    let (field, distance, vertices) = measure(&[([16, 8, 9], 23.0)], &Part::default());
    assert!((field - 0.75).abs() < 1e-9, "{field}");
    assert!((distance - 0.5 * 0.5_f64.sqrt()).abs() < 1e-9, "{distance}");
    assert_eq!(vertices, 1);
    let (field, ..) = measure(&[([16, 8, 7], 17.0)], &Part::default());
    assert!((field - 7.375).abs() < 1e-9, "{field}");
}

#[test]
fn only_the_selected_part_counts() {
    let points =
        [([8, 8, 9], 13.0), ([8, 8, 7], 7.0), ([16, 8, 9], 23.0), ([16, 8, 7], 17.0), ([8, 16, 8], 30.0)];
    let iso = |value: f64| Part { ranges: vec![[value; 2]], ..Part::default() };
    assert_eq!(measure(&points, &iso(95.0)).2, 0);
    // Only the lower tetrahedron has the value 85: two points in it, and one beside it.
    assert_eq!(measure(&points, &iso(85.0)).2, 3);
    assert_eq!(measure(&points, &iso(15.0)).2, 5);
}

#[test]
fn every_point_is_found_however_many_there_are() {
    let points: Vec<_> = (0..17)
        .flat_map(|x| (0..17).flat_map(move |y| (0..17).map(move |z| [x, y, z])))
        .filter(|&[x, y, z]| x >= 8 && y >= 8 && (x - 8) + (y - 8) + (z - 8_i32).abs() <= 8)
        .map(|[x, y, z]| {
            let [u, v, w] = [x - 8, y - 8, z - 8].map(|t| f64::from(t) / 8.0);
            ([x, y, z], 10.0 + 10.0 * u + 20.0 * v + if w > 0.0 { 70.0 * w } else { -80.0 * w })
        })
        .collect();
    let (field, distance, vertices) = measure(&points, &Part::default());
    assert_eq!((distance, vertices), (0.0, points.len() as u64));
    assert!(field < 1e-9, "{field}");
}

#[test]
fn a_promise_may_be_kept_at_another_place_within_its_reach() {
    // Beside the tip of the lower tetrahedron's edge; the place with the value 24.375 is nearest.
    let point = [([16, 8, 7], 20.0)];
    let promise = |field, distance| Part { promise: Some(Promise { field, distance }), ..Part::default() };
    let nearest = measure(&point, &Part::default());
    assert!((nearest.0 - 4.375).abs() < 1e-9);
    let kept = measure(&point, &promise(1.0, 1.0));
    assert!(kept.0 < 1.0 && kept.1 > nearest.1 && kept.1 <= 1.0, "{kept:?}");
    // The tip itself is half a unit away, the places between deviate by more.
    let broken = measure(&point, &promise(1.0, 0.4));
    assert!(broken.0 > 1.0, "{broken:?}");
    assert_eq!(measure(&point, &promise(1.0, 0.1)), nearest, "nothing is so near: the nearest place counts");
    // Also for a vertex that some tetrahedron contains, here near the outer face.
    let inside = [([15, 8, 8], 23.0)];
    assert!((measure(&inside, &Part::default()).0 - 4.25).abs() < 1e-9);
    let kept = measure(&inside, &promise(1.0, 0.5));
    assert!(kept.0 < 0.1 && kept.1 > 0.0, "{kept:?}");
    assert_eq!(measure(&inside, &promise(5.0, 0.5)), (4.25, 0.0, 1), "it is kept where it is");
    // In the middle of the reach of a part that is not asked for, nothing is held against the mesh.
    let part = Part { ranges: vec![[85.0; 2]], ..promise(1.0, 1.0) };
    assert_eq!(measure(&[([16, 8, 7], 60.0)], &part).2, 0);
}
