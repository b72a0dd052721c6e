//! Promise: what is shown when nothing is asked for is there.

use crate::support::meshes::{blocks, cube, hilly, linear};
use tetralod::format::{EncodeOptions, encode};
use tetralod::mesh::TetMesh;
use tetralod::refine::Request;
use tetralod::session::Session;
use tetralod_build::{BuildConfig, build};

fn opened(mesh: &TetMesh, histograms: bool) -> Session {
    let config = BuildConfig { all_fields: true, ..BuildConfig::default() };
    let built = build(mesh, &config).expect("a valid mesh");
    let options = EncodeOptions { histograms, ..EncodeOptions::default() };
    let file = encode(&built.mt, &options).expect("a sound MT");
    let mut session = Session::new();
    session.feed(&file).expect("a good file");
    session.finish().expect("a whole file");
    session.refine(&Request::within(0.0)).expect("a good request");
    session
}

/// Steps of one field, each with all its values above those of the one before.
fn apart(field: fn([f64; 3]) -> f64) -> TetMesh {
    let mut mesh = cube(4, &[field; 3]);
    for (step, field) in mesh.fields.iter_mut().enumerate() {
        (field.name, field.time) = ("T".to_owned(), Some(step as f64));
        field.values.iter_mut().for_each(|value| *value += 100.0 * step as f64);
    }
    mesh
}

#[test]
fn the_first_isovalue_has_a_surface_at_the_first_time() {
    for field in [hilly, linear] {
        for histograms in [true, false] {
            let mut session = opened(&apart(field), histograms);
            let values = session.view().field.to_vec();
            let value = session.first_isovalue(0).expect("there is a field");
            let range = [
                values.iter().copied().fold(f64::INFINITY, f64::min),
                values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            ];
            assert!(range[0] < value && value < range[1], "{value} is between {range:?}");
            assert_eq!(session.first_isovalue(2), Some(value), "it is that of all times");
        }
    }
}

#[test]
fn an_isosurface_comes_first_where_it_is_no_plane_in_a_box() {
    let first = |field: fn([f64; 3]) -> f64, cut: bool| {
        let mesh = blocks([4; 3], &[field], |cell| !cut || cell.iter().any(|&i| i > 1));
        opened(&mesh, true).surface_first(0)
    };
    let bump: fn([f64; 3]) -> f64 = |p| (-8.0 * p.map(|x| (x - 0.5) * (x - 0.5)).iter().sum::<f64>()).exp();
    assert_eq!(first(bump, false), Some(true));
    assert_eq!(first(bump, true), Some(false));
    assert_eq!(first(linear, false), Some(false));
    assert_eq!(first(|_| 3.0, false), Some(false), "there is no surface");
    // The corners are those of a linear function, what is between them is not.
    assert_eq!(first(|p| p[0] + 3.0 * p[1] * (1.0 - p[1]), false), Some(true));
}
