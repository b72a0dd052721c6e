//! Promise: what a scene finds under the pointer is what its picture shows there, cut by the planes that cut it.

use crate::support::meshes::{built, cube};
use crate::twin;
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::Ray;
use tetralod::mt::Mt;
use tetralod::refine::Request;
use tetralod::session::Session;
use tetralod_render::SceneRenderer;
use tetralod_render::scene::{
    ArrowState, BoundaryState, PlaneState, SceneState, SliceState, StreamlineState,
};

const ONE: fn([f64; 3]) -> f64 = |_| 1.0;
const NOTHING: fn([f64; 3]) -> f64 = |_| 0.0;

/// A cube with the field, then the components of a flow along x.
fn opened() -> (Session, [String; 3]) {
    let mesh = cube(4, &[|[x, _, _]| x, ONE, NOTHING, NOTHING]);
    let names = [1, 2, 3].map(|i: usize| mesh.fields[i].name.clone());
    let mt = Mt::from(built(&mesh).mt);
    let mut session = Session::new();
    session.feed(&encode(&mt, &EncodeOptions::default()).expect("a complete MT")).expect("a good file");
    session.refine(&Request::within(0.0)).expect("a good request");
    (session, names)
}

/// Where a ray from below, upwards through (x, y), meets what is shown.
fn height(
    scene: &mut SceneRenderer,
    session: &mut Session,
    state: &SceneState,
    [x, y]: [f64; 2],
) -> Option<f64> {
    scene.set_state(state.clone()).expect("a good state");
    scene.update(session).expect("it fits");
    let ray = Ray { origin: [x, y, -2.0].into(), direction: [0.0, 0.0, 1.0].into() };
    scene.pick(session, &ray).map(|[px, py, pz]| {
        assert!((px - x).abs() < 1e-9 && (py - y).abs() < 1e-9, "on the ray");
        pz
    })
}

#[test]
fn tubes_and_arrows_are_found() {
    let renderer = twin::renderer([8, 8]);
    let (mut session, fields) = opened();
    let mut scene = SceneRenderer::new(renderer);
    let tubes = StreamlineState {
        fields: fields.clone(),
        seeds: vec![[0.5; 3]],
        radius: Some(0.1),
        ..StreamlineState::default()
    };
    let state = SceneState { streamlines: Some(tubes), ..SceneState::default() };
    let found = height(&mut scene, &mut session, &state, [0.3, 0.5]).expect("the tube is there");
    // A tube of eight sides is at least cos(π/8) of its radius thick.
    assert!((0.4 - 1e-12..=0.4 + 0.1 * (1.0 - 0.92)).contains(&found), "{found}");
    assert_eq!(height(&mut scene, &mut session, &state, [0.3, 0.65]), None, "beside it");
    let cut = SceneState { clips: vec![PlaneState { normal: [1.0, 0.0, 0.0], offset: 0.25 }], ..state };
    assert_eq!(height(&mut scene, &mut session, &cut, [0.3, 0.5]), None, "cut away");

    let arrows = ArrowState { fields, spacing: Some(0.25), ..ArrowState::default() };
    let state = SceneState { arrows: Some(arrows), ..SceneState::default() };
    let ways = (0..20).flat_map(|i| (0..20).map(move |j| [i, j].map(|k| (f64::from(k) + 0.5) / 20.0)));
    let found = ways.filter_map(|way| height(&mut scene, &mut session, &state, way));
    assert!(found.count() > 5, "some rays meet arrows");
    assert_eq!(height(&mut scene, &mut session, &SceneState::default(), [0.3, 0.5]), None, "both are gone");
}

#[test]
fn planes_cut_what_they_cut_in_the_picture() {
    let renderer = twin::renderer([8, 8]);
    let (mut session, _) = opened();
    let mut scene = SceneRenderer::new(renderer);
    let low = PlaneState { normal: [0.0, 0.0, -1.0], offset: -0.3 };
    let mut height = |state: &SceneState| height(&mut scene, &mut session, state, [0.41, 0.37]);
    for (clipped, expected) in [(true, 0.3), (false, 0.0)] {
        let boundary = Some(BoundaryState { clipped, ..BoundaryState::default() });
        let state = SceneState { boundary, clips: vec![low], ..SceneState::default() };
        let found = height(&state).expect("the cube is there");
        assert!((found - expected).abs() < 1e-6, "{clipped}: {found}");
    }
    for (offset, clipped, expected) in
        [(0.1, true, None), (0.1, false, Some(0.1)), (0.3, true, Some(0.3)), (0.6, true, Some(0.6))]
    {
        let slice =
            SliceState { normal: [0.0, 0.0, 1.0], offset, clipped, opacity: 1.0, edges: false, field: None };
        let state = SceneState { slices: vec![slice], clips: vec![low], ..SceneState::default() };
        let found = height(&state);
        assert_eq!(found.is_some(), expected.is_some(), "{offset} {clipped}: {found:?}");
        assert!(found.zip(expected).is_none_or(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");
    }
}
