//! Promise: where a surface shows labels, each place has that of the nearest corner of its tetrahedron, in the colour that stands for it, and
//! what has no values between is refused.

use crate::scenes::Scene as Plain;
use crate::support::meshes::{bent, cube, hilly, linear};
use crate::support::random::Random;
use std::collections::BTreeMap;
use tetralod::Coded;
use tetralod::format::{EncodeOptions, encode};
use tetralod::mesh::Field;
use tetralod::refine::Request;
use tetralod::session::{Session, SessionError};
use tetralod::view::{
    BoundarySurface, IsoSurface, LabelParts, MeshView, Plane, Probe, Slice, Triangles, area, region_color,
};
use tetralod_build::{BuildConfig, build};
use tetralod_render::draw::{Colouring, Edit};
use tetralod_render::scene::{
    ArrowState, BoundaryState, CellState, ColourState, CompareState, IsosurfaceState, Scene, SceneError,
    SceneState, SliceState, StreamlineState, ThresholdState, Update, VolumeState,
};

/// Places of a triangle that are looked at to measure areas.
const SAMPLES: usize = 60;

/// Labels without an order in space.
fn mixed(points: usize) -> Vec<f64> {
    (0..points).map(|v| [4.0, -1.0, 9.0, 4.0, 23.0][v * v % 11 % 5]).collect()
}

/// Each place of the parts has the label that a search of all tetrahedra finds there, and they have the area of the surface.
fn check(view: &MeshView<'_>, surface: &Triangles<'_>, places: &[([u32; 2], f64)], random: &mut Random) {
    let parts = LabelParts::of(surface, places, view.field);
    let whole = area(surface.positions, surface.indices);
    let found = area(&parts.positions, &parts.indices);
    assert!((found - whole).abs() < 1e-9 * whole, "{found} for {whole}");
    let mut probe = Probe::new(*view);
    probe.make_grid();
    let mut areas: BTreeMap<i64, f64> = BTreeMap::new();
    let mut compared = 0;
    for triangle in &parts.indices {
        let labels = triangle.map(|v| parts.labels[v as usize]);
        assert!(labels.iter().all(|label| *label == labels[0]));
        *areas.entry(labels[0] as i64).or_default() += area(&parts.positions, &[*triangle]);
        let corners = triangle.map(|v| parts.positions[v as usize]);
        for _ in 0..2 {
            let mut shares = [0; 3].map(|_| 0.02 + random.fraction());
            let sum: f64 = shares.iter().sum();
            shares = shares.map(|share| share / sum);
            let p = [0, 1, 2].map(|axis| (0..3).map(|k| shares[k] * corners[k][axis]).sum::<f64>());
            let Some(place) = probe.locate(p) else { continue };
            let mut weights = place.weights;
            weights.sort_by(f64::total_cmp);
            // Beside a border between two corners rounding decides, and so it does in a part that is one.
            if weights[3] - weights[2] > 1e-9 {
                assert_eq!(place.value(view), labels[0], "{p:?}");
                compared += 1;
            }
        }
    }
    assert!(compared > parts.indices.len(), "{compared} of {}", parts.indices.len());
    // The same areas by places of the surface as it was.
    let mut sampled: BTreeMap<i64, f64> = BTreeMap::new();
    for triangle in surface.indices {
        let corners = triangle.map(|v| surface.positions[v as usize]);
        let share = area(surface.positions, &[*triangle]) / SAMPLES as f64;
        for _ in 0..SAMPLES {
            let (mut s, mut t) = (random.fraction(), random.fraction());
            if s + t > 1.0 {
                (s, t) = (1.0 - s, 1.0 - t);
            }
            let p = [0, 1, 2].map(|i| {
                corners[0][i] + s * (corners[1][i] - corners[0][i]) + t * (corners[2][i] - corners[0][i])
            });
            if let Some(place) = probe.locate(p) {
                *sampled.entry(place.value(view) as i64).or_default() += share;
            }
        }
    }
    assert!(areas.keys().eq(sampled.keys()), "{areas:?}, {sampled:?}");
    for (label, area) in &areas {
        assert!((area - sampled[label]).abs() < 0.02 * whole, "{label}: {area}, {}", sampled[label]);
    }
}

#[test]
fn each_part_of_a_surface_has_the_label_of_the_nearest_corner() {
    let mesh = bent(5);
    let scene = Plain::new(mesh.positions.clone(), mixed(mesh.positions.len()), mesh.tets.clone());
    let view = MeshView { is_label: true, ..scene.view() };
    let mut random = Random::new(11);
    let mut boundary = BoundarySurface::new();
    boundary.extract(&view);
    check(&view, &(&boundary).into(), &boundary.edge_places(), &mut random);
    let bounds = view.bounds();
    for part in [0.3, 0.5, 0.71] {
        let at = [0, 1, 2].map(|i| bounds.min[i] + part * (bounds.max[i] - bounds.min[i]));
        let plane = Plane::through(at, [1.0 - part, 0.4, part]);
        let mut slice = Slice::new();
        slice.extract(&view, &plane);
        assert!(!slice.indices().is_empty());
        check(&view, &(&slice).into(), &slice.edge_places(&view), &mut random);
    }
    // An isosurface of another field, which is on the same points.
    let values: Vec<f64> = mesh.positions.iter().map(|p| hilly(*p)).collect();
    let other = MeshView { field: &values, is_label: false, ..view };
    let mut surface = IsoSurface::new();
    let middle = 0.5
        * (values.iter().fold(f64::INFINITY, |m, x| m.min(*x))
            + values.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x)));
    surface.extract(&other, middle);
    assert!(!surface.indices.is_empty());
    check(&view, &(&surface).into(), &surface.edge_places(&other), &mut random);
}

/// A session with a field and a label, all of it refined.
fn session() -> Session {
    let mut mesh = cube(4, &[hilly, linear]);
    let labels = mesh.positions.iter().map(|p| (3.9 * p[0]).floor() * 2.0 + 5.0).collect();
    mesh.fields.push(Field { integer: true, is_label: true, ..Field::new("cluster", labels) });
    for axis in 0..3 {
        let along = mesh.positions.iter().map(|p| p[axis] + 1.0).collect();
        mesh.fields.push(Field::new(["u", "v", "w"][axis], along));
    }
    let mt = build(&mesh, &BuildConfig { all_fields: true, ..BuildConfig::default() }).expect("a mesh").mt;
    let mut session = Session::new();
    session.feed(&encode(&mt, &EncodeOptions::default()).expect("a complete MT")).expect("a good file");
    session.set_field(2).expect("it is there");
    session.refine(&Request::within(0.0)).expect("a good request");
    session
}

fn slice(field: Option<&str>) -> SliceState {
    let (normal, field) = ([0.0, 0.0, 1.0], field.map(str::to_owned));
    SliceState { normal, offset: 0.51, opacity: 1.0, edges: true, field, clipped: true }
}

#[test]
fn labels_have_the_colours_of_the_palette_and_no_gradient() {
    let mut session = session();
    let state = SceneState {
        boundary: Some(BoundaryState::default()),
        slices: vec![slice(None), slice(Some("f1"))],
        cells: Some(CellState::default()),
        // None of that applies to labels.
        colours: ColourState { log: true, bands: Some(3), ..ColourState::default() },
        ..SceneState::default()
    };
    let mut scene = Scene::default();
    scene.set_state(state).expect("a good state");
    let (mut surfaces, mut tets) = (0, 0);
    let Update { edits, changed } = scene.update(&mut session);
    changed.expect("it can be shown");
    for edit in &edits {
        match edit {
            Edit::Surface { triangles, style, .. } => {
                let Colouring::Scale(scale) = style.colouring else { panic!("a scale") };
                let has_own = triangles.values.iter().all(|value| (value - 0.5) % 2.0 == 0.0);
                let is_flat = |t: &[u32; 3]| {
                    let [a, b, c] = t.map(|v| triangles.values[v as usize]);
                    a == b && b == c
                };
                if scale.map.name == "regions" {
                    // Labels 5, 7, 9 and 11 have places 0, 2, 4 and 6 of the palette.
                    assert!(has_own && triangles.indices.iter().all(is_flat));
                    assert!(triangles.values.iter().all(|value| *value < 8.0));
                    assert_eq!(triangles.inner_sides.len(), triangles.indices.len());
                    surfaces += 1;
                } else {
                    assert!(!has_own, "the other slice is of a field");
                }
            }
            Edit::CellValues(values) => {
                assert!(values.iter().all(|value| [0.5, 2.5, 4.5, 6.5].contains(value)));
                tets = values.len();
            }
            Edit::Cells(Some(style)) => assert!(style.own_values),
            _ => {}
        }
    }
    assert_eq!(surfaces, 2);
    drop(edits);
    assert_eq!(tets, session.view().tets.len());
    let legend = scene.legend().expect("colours");
    let expected: Vec<_> =
        [(5.0, 0), (7.0, 2), (9.0, 4), (11.0, 6)].map(|(label, place)| (label, region_color(place))).into();
    assert_eq!((legend.label.as_str(), &legend.labels), ("cluster", &expected));
}

#[test]
fn what_has_no_values_between_is_refused() {
    let mut session = session();
    let cluster = || Some("cluster".to_owned());
    let fields = || ["u", "v", "w"].map(str::to_owned);
    let none = SceneState::default;
    let lines = StreamlineState { fields: fields(), seeds: vec![[0.5; 3]], radius: None, field: cluster() };
    let arrows = ArrowState { fields: fields(), spacing: None, field: cluster(), constant: false };
    let threshold = ThresholdState { field: cluster(), range: [5.0, 7.0], cut: true };
    let isosurface = |field| IsosurfaceState { field, ..IsosurfaceState::default() };
    for (what, state) in [
        ("isosurfaces", SceneState { isosurfaces: vec![isosurface(None)], ..none() }),
        ("volume", SceneState { volume: Some(VolumeState::default()), ..none() }),
        (
            "compare.difference",
            SceneState { compare: Some(CompareState { at: 0.0, difference: true }), ..none() },
        ),
        ("streamlines.field", SceneState { streamlines: Some(lines), ..none() }),
        ("arrows.field", SceneState { arrows: Some(arrows), ..none() }),
        ("threshold.cut", SceneState { threshold: Some(threshold.clone()), ..none() }),
    ] {
        let mut scene = Scene::default();
        scene.set_state(state).expect("of no field yet");
        let refused = scene.update(&mut session).changed.expect_err(what);
        assert_eq!(refused.code(), "bad-option");
        let SceneError::State { what: found, problem } = &refused else { panic!("{what}: {refused}") };
        assert!(found == what && problem.contains("'cluster' is a label"), "{found}: {problem}");
    }
    let refused = session.isosurface(7.0).map(|_| "made").expect_err("of a label");
    assert!(
        matches!(&refused, SessionError::Label { name } if name == "cluster")
            && refused.code() == "bad-option"
    );
    assert_eq!(session.surface_first(2), Some(false));
    // Whole tetrahedra of some labels are shown, and a label colours the isosurface of another field.
    let mut scene = Scene::default();
    let threshold = Some(ThresholdState { cut: false, ..threshold });
    let boundary = Some(BoundaryState::default());
    scene.set_state(SceneState { threshold, boundary, ..none() }).expect("a good state");
    scene.update(&mut session).changed.expect("whole ones");
    let view = session.view();
    let shown = view.tets.iter().filter(|tet| tet[0] != tetralod::mesh::NONE).flatten();
    assert!(
        shown.clone().count() > 0 && shown.clone().all(|&v| [5.0, 7.0].contains(&view.field[v as usize]))
    );
    session.set_field(0).expect("it is there");
    let mut scene = Scene::default();
    scene.set_state(SceneState { isosurfaces: vec![isosurface(cluster())], ..none() }).expect("a good state");
    let Update { edits, changed } = scene.update(&mut session);
    changed.expect("coloured by a label");
    let coloured = edits.iter().any(|edit| match edit {
        Edit::Surface { triangles, .. } => {
            triangles.normals.len() == triangles.positions.len()
                && triangles.values.iter().any(|value| *value != triangles.values[0])
        }
        _ => false,
    });
    assert!(coloured);
}
