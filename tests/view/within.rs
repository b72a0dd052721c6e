//! Promise: what a mesh is cut down to is the part of it in which a field is within a range, and conforms.

use crate::scenes::Scene;
use crate::support::data::real_data;
use crate::support::meshes::hilly;
use glam::DVec3;
use tetralod::mesh::{FACES, NONE, neighbors};
use tetralod::view::{BoundarySurface, FieldStats, IsoSurface, MeshView, MeshWithin};
use tetralod_io::read;

fn volume(mesh: &MeshView<'_>) -> f64 {
    FieldStats::of(mesh).volume()
}

fn boundary(mesh: &MeshView<'_>) -> BoundarySurface {
    let mut surface = BoundarySurface::new();
    surface.extract(mesh);
    surface
}

fn within(scene: &Scene, range: [f64; 2]) -> MeshWithin {
    MeshWithin::of(&scene.view(), &scene.field, range)
}

/// The area of the isosurface at a value.
fn iso_area(scene: &Scene, value: f64) -> f64 {
    let mut surface = IsoSurface::new();
    surface.extract(&scene.view(), value);
    tetralod::view::area(&surface.positions, &surface.indices)
}

/// It is a mesh of tetrahedra that are not inverted, each the neighbour of its neighbours and of no others, with a closed boundary; what it
/// keeps of `whole` has its number.
fn assert_sound(whole: &Scene, cut: &MeshWithin, [low, high]: [f64; 2]) {
    let mesh = cut.view(cut.values());
    assert_eq!(&mesh.positions[..whole.positions.len()], &whole.positions[..]);
    assert_eq!(&mesh.field[..whole.field.len()], &whole.field[..]);
    let is_within = |v: u32| (low..=high).contains(&mesh.field[v as usize]);
    for (t, tet) in mesh.tets.iter().enumerate() {
        assert!(tet[0] == NONE || tet.iter().all(|&v| is_within(v)), "tetrahedron {t}");
        if let Some(own) = whole.tets.get(t).filter(|own| own.iter().all(|&v| is_within(v))) {
            assert_eq!(tet, own);
        }
        let [a, b, c, d] =
            if tet[0] == NONE { continue } else { tet.map(|v| DVec3::from(mesh.positions[v as usize])) };
        assert!((b - a).cross(c - a).dot(d - a) > -1e-15, "tetrahedron {t} is inverted");
        for (i, &n) in mesh.neighbors[t].iter().enumerate().filter(|(_, n)| **n != NONE) {
            let mut own = FACES[i].map(|k| tet[k]);
            let back =
                mesh.neighbors[n as usize].iter().position(|back| *back == t as u32).expect("a neighbour");
            let mut other = FACES[back].map(|k| mesh.tets[n as usize][k]);
            own.sort_unstable();
            other.sort_unstable();
            assert_eq!(own, other);
        }
    }
    assert!(boundary(&mesh).is_closed());
}

/// The volume of the part of the unit cube in which `n · p` is at most `c`: that of a simplex, less those beyond the corners.
fn below(n: [f64; 3], c: f64) -> f64 {
    let corners = (0..8_u32).map(|corner| {
        let at: f64 = (0..3).filter(|i| corner >> i & 1 == 1).map(|i| n[i]).sum();
        (c - at).max(0.0).powi(3) * if corner.count_ones() % 2 == 0 { 1.0 } else { -1.0 }
    });
    corners.sum::<f64>() / (6.0 * n.iter().product::<f64>())
}

#[test]
fn of_a_cube_with_a_linear_field_a_slab_is_left() {
    for cells in [1, 2, 3] {
        let scene = Scene::cube(cells, |p| p[0]);
        // Ends inside of cells, at points, and beyond the values.
        for [low, high] in
            [[0.2, 0.7], [0.0, 0.5], [1.0 / 3.0, 2.0 / 3.0], [0.5, 3.0], [-1.0, 1.0 / 3.0], [-1.0, 2.0]]
        {
            let cut = within(&scene, [low, high]);
            assert_sound(&scene, &cut, [low, high]);
            let (mesh, thick) = (cut.view(cut.values()), high.min(1.0) - low.max(0.0));
            let found = (volume(&mesh), boundary(&mesh).area());
            assert!(
                (found.0 - thick).abs() < 1e-12 && (found.1 - 2.0 - 4.0 * thick).abs() < 1e-12,
                "{low} {high}: {found:?}"
            );
        }
        let n = [1.0, 2.0, 3.0];
        let scene = Scene::cube(cells, |p| n[0] * p[0] + n[1] * p[1] + n[2] * p[2]);
        for [low, high] in [[0.5, 5.5], [1.0, 2.0], [2.9, 3.1], [0.0, 0.1], [5.0, 6.0], [1.7, 9.0]] {
            let cut = within(&scene, [low, high]);
            assert_sound(&scene, &cut, [low, high]);
            let expected = below(n, high) - below(n, low);
            let found = volume(&cut.view(cut.values()));
            assert!((found - expected).abs() < 1e-12, "{low} to {high}: {found} instead of {expected}");
        }
    }
}

#[test]
fn all_patterns_of_values_are_cut() {
    // Below, at the lower end, between, at the upper end, or above, at each corner of a tetrahedron.
    for pattern in 0..625_u32 {
        let field = [1, 5, 25, 125].map(|place| f64::from(pattern / place % 5));
        let scene = Scene::tet(field);
        let parts = [[-9.0, 1.0], [1.0, 3.0], [3.0, 9.0]].map(|range| {
            let cut = within(&scene, range);
            assert_sound(&scene, &cut, range);
            volume(&cut.view(cut.values()))
        });
        let is_level = field.iter().all(|value| *value == field[0]) && [1.0, 3.0].contains(&field[0]);
        let all: f64 = parts.iter().sum();
        // What has just the value of an end everywhere is on both of its sides.
        let expected = if is_level { 2.0 } else { 1.0 } / 6.0;
        assert!((all - expected).abs() < 1e-12, "{field:?}: {parts:?}");
    }
}

#[test]
fn parts_add_up_and_meet_in_isosurfaces() {
    let scene = Scene::cube(7, hilly);
    let of = |range| {
        let cut = within(&scene, range);
        assert_sound(&scene, &cut, range);
        let mesh = cut.view(cut.values());
        (volume(&mesh), boundary(&mesh).area())
    };
    let ends = [0.2, 0.33, 0.5, 0.81];
    let whole = of([ends[0], ends[3]]);
    let parts = ends.windows(2).map(|pair| of([pair[0], pair[1]]));
    let sum = parts.fold((0.0, 0.0), |sum, part| (sum.0 + part.0, sum.1 + part.1));
    let between: f64 = ends[1..3].iter().map(|end| 2.0 * iso_area(&scene, *end)).sum();
    assert!((sum.0 - whole.0).abs() < 1e-12, "{sum:?} {whole:?}");
    assert!((sum.1 - between - whole.1).abs() < 1e-9, "{sum:?} {between} {whole:?}");
    assert!(between > 0.5);
    // All of one value, and the plateau alone.
    assert_eq!(
        volume(&within(&scene, [0.15, 0.15]).view(&scene.field)),
        volume(&within(&scene, [0.0, 0.15]).view(&scene.field))
    );
}

#[test]
fn other_fields_are_linear_where_it_is_cut() {
    let scene = Scene::cube(4, hilly);
    let cut = within(&scene, [0.3, 0.6]);
    let linear = |p: &[f64; 3]| p[0] - 2.0 * p[1] + 0.5 * p[2];
    let values = cut.interpolate(&scene.positions.iter().map(linear).collect::<Vec<_>>());
    let mesh = cut.view(&values);
    assert!(mesh.positions.len() > scene.positions.len());
    assert!(mesh.positions.iter().zip(&values).all(|(p, value)| (linear(p) - value).abs() < 1e-12));
    // Pieces have what their tetrahedron has.
    let middles = scene.tets.iter().map(|tet| tet.map(|v| DVec3::from(scene.positions[v as usize])));
    let middles: Vec<DVec3> = middles.map(|corners| corners.iter().sum::<DVec3>() / 4.0).collect();
    for (tet, middle) in mesh.tets.iter().zip(cut.of_tets(&middles)).filter(|(tet, _)| tet[0] != NONE) {
        assert!(tet.iter().all(|&v| middle.distance(mesh.positions[v as usize].into()) < 3_f64.sqrt() / 4.0));
    }
}

/// The areas and volumes that VTK 9.7 finds: `vtkTableBasedClipDataSet` at the lower end and then at the upper one, with points and values in
/// double precision.
const FOUND_BY_VTK: [(&str, [f64; 2], f64, f64); 4] = [
    ("piece.vtu", [0.3, 0.7], 14.407_686_483_221_99, 0.960_772_275_515_110_5),
    ("disk_out_ref.vtu", [400.0, 700.0], 469.769_964_352_381_3, 353.459_717_573_959_95),
    ("hand.vtu", [0.2, 0.6], 1.988_127_223_964_978, 0.112_614_853_825_708_89),
    ("cylinder_flow.vtu", [500.0, 3000.0], 0.004_479_225_693_542_605, 1.892_661_095_108_134e-5),
];

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn it_is_what_vtk_cuts_data_sets_down_to() {
    for (name, range, area, size) in FOUND_BY_VTK {
        let mesh = read(&real_data().join(name)).expect("a data set");
        let around = neighbors(&mesh.tets).expect("a mesh without crowded faces");
        let (positions, field) = (mesh.positions, mesh.fields[0].values.clone());
        let scene = Scene { positions, field, tets: mesh.tets, neighbors: around };
        let cut = within(&scene, range);
        let view = cut.view(cut.values());
        let (own_area, own_size) = (boundary(&view).area(), volume(&view));
        assert!((own_area / area - 1.0).abs() < 1e-6, "{name}: area {own_area} instead of {area}");
        assert!((own_size / size - 1.0).abs() < 1e-6, "{name}: volume {own_size} instead of {size}");
    }
}
