//! Promise: a mesh that was kept is shown on the left as it was shown alone, the current one on the right as it is shown alone,
//! and the difference of their fields has symmetric colours.

use crate::support::meshes::{built, cube, hilly, linear};
use crate::twin::{self, UNIT};
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::Camera;
use tetralod::mt::Mt;
use tetralod::refine::Request;
use tetralod::session::Session;
use tetralod::view::Difference;
use tetralod_render::SceneRenderer;
use tetralod_render::gpu::{Renderer, wait};
use tetralod_render::scene::{CellState, CompareState, IsosurfaceState, SceneState, SliceState, VolumeState};

const SIZE: [u32; 2] = [96, 64];

fn opened() -> Session {
    let mt = Mt::from(built(&cube(8, &[hilly, linear])).mt);
    let mut session = Session::new();
    session.feed(&encode(&mt, &EncodeOptions::default()).expect("a complete MT")).expect("a good file");
    session
}

fn refined(session: &mut Session, error: f64) {
    session.refine(&Request::within(error)).expect("a good request");
}

fn camera() -> Camera {
    Camera::home(&UNIT, twin::aspect(SIZE))
}

/// Rows of pixels.
fn picture(scene: &mut SceneRenderer, session: &mut Session) -> Vec<Vec<[u8; 4]>> {
    scene.update(session).expect("it fits");
    let bytes = wait(scene.picture(session, &camera(), 1, |_| {})).expect("a picture");
    bytes.as_chunks().0.chunks(SIZE[0] as usize).map(<[_]>::to_vec).collect()
}

fn half(picture: &[Vec<[u8; 4]>], left: bool) -> Vec<&[[u8; 4]]> {
    let middle = SIZE[0] as usize / 2;
    picture.iter().map(|row| if left { &row[..middle] } else { &row[middle..] }).collect()
}

fn scene(renderer: Renderer, state: &SceneState) -> SceneRenderer {
    let mut scene = SceneRenderer::new(renderer);
    scene.set_state(state.clone()).expect("a good state");
    scene
}

#[test]
fn each_half_is_as_it_is_alone() {
    let volume = SceneState {
        isosurfaces: vec![IsosurfaceState { opacity: 0.5, ..IsosurfaceState::default() }],
        volume: Some(VolumeState::default()),
        ..SceneState::default()
    };
    let cells = CellState { colour_by: "size".to_owned(), shrink: 0.2, ..CellState::default() };
    let cells = SceneState { cells: Some(cells), ..SceneState::default() };
    for state in [volume, cells] {
        let renderer = twin::renderer(SIZE);
        let (mut scene, mut session) = (scene(renderer, &state), opened());
        refined(&mut session, 0.3);
        let coarse = picture(&mut scene, &mut session);
        scene.keep(&mut session).expect("it is there");
        assert_eq!(picture(&mut scene, &mut session), coarse, "to keep changes nothing");
        refined(&mut session, 0.0);
        let fine = picture(&mut scene, &mut session);
        assert_ne!(half(&coarse, true), half(&fine, true));
        let compare = Some(CompareState::default());
        scene.set_state(SceneState { compare, ..state.clone() }).expect("a good state");
        let both = picture(&mut scene, &mut session);
        assert!(half(&both, true) == half(&coarse, true), "left: the mesh that was kept");
        assert!(half(&both, false) == half(&fine, false), "right: the current mesh");
        scene.set_state(state.clone()).expect("a good state");
        assert!(picture(&mut scene, &mut session) == fine, "the current mesh alone");
    }
}

#[test]
fn the_difference_has_symmetric_colours() {
    let renderer = twin::renderer(SIZE);
    let slice: SliceState = SliceState {
        normal: [0.0, 0.0, 1.0],
        offset: 0.5,
        opacity: 1.0,
        edges: false,
        field: None,
        clipped: true,
    };
    let state = SceneState {
        slices: vec![slice],
        compare: Some(CompareState { at: 0.0, difference: true }),
        ..SceneState::default()
    };
    let (mut scene, mut session) = (scene(renderer, &state), opened());
    refined(&mut session, 0.3);
    scene.keep(&mut session).expect("it is there");
    let same = picture(&mut scene, &mut session);
    let legend = scene.legend().expect("colours").clone();
    assert_eq!((legend.label.as_str(), legend.scale.range), ("difference of f0", [-1.0, 1.0]));
    let middle = legend.scale.colour(0.0).map(|c| (c * 255.0).round() as u8);
    let seen = same.iter().flatten().filter(|p| (0..3).all(|k| p[k].abs_diff(middle[k]) <= 1)).count();
    assert!(seen > 200, "{seen} pixels have the colour of 0");

    let (mut kept, before) = (Vec::new(), session.view());
    kept.extend_from_slice(before.field);
    let (positions, tets, neighbors) =
        (before.positions.to_vec(), before.tets.to_vec(), before.neighbors.to_vec());
    refined(&mut session, 0.0);
    assert!(picture(&mut scene, &mut session) != same);
    let other = tetralod::view::MeshView {
        positions: &positions,
        field: &kept,
        is_label: false,
        tets: &tets,
        neighbors: &neighbors,
    };
    let expected = Difference::of(&session.view(), other).expect("a mesh").largest;
    let range = scene.legend().expect("colours").scale.range;
    assert!(expected > 0.0 && range == [-expected, expected], "{range:?} for {expected}");
}
