//! Promise: pictures of a model far from its origin, and of a field in a narrow range, are those of the same model near it.

use crate::far::{FAR, Frame, NEAR, opened};
use crate::support::meshes::{cube, hilly};
use crate::twin;
use tetralod::geom::{Bounds, Camera};
use tetralod::mesh::Field;
use tetralod_render::SceneRenderer;
use tetralod_render::gpu::wait;
use tetralod_render::scene::{
    ArrowState, BoundaryState, CellState, ColourState, IsosurfaceState, PlaneState, SceneState, SliceState,
    StreamlineState, VolumeState,
};

const SIZE: [u32; 2] = [120, 100];

/// One state for each thing that can be shown, in a frame.
fn states(frame: &Frame) -> Vec<(&'static str, SceneState)> {
    let through = |p: [f64; 3], normal: [f64; 3]| {
        let point = frame.point(p);
        PlaneState { normal, offset: (0..3).map(|i| normal[i] * point[i]).sum() }
    };
    let box_of = |low: f64, high: f64| {
        let ([x0, y0, z0], [x1, y1, z1]) = (frame.point([low; 3]), frame.point([high; 3]));
        Some([x0, y0, z0, x1, y1, z1])
    };
    let clips = vec![through([0.6, 0.5, 0.5], [1.0, 0.3, 0.2])];
    let sliced = through([0.5, 0.45, 0.5], [0.1, 1.0, 0.3]);
    let slice = SliceState {
        normal: sliced.normal,
        offset: sliced.offset,
        opacity: 1.0,
        edges: true,
        field: None,
        clipped: true,
    };
    let surface =
        |opacity: f64| IsosurfaceState { value: Some(frame.value(0.35)), opacity, ..Default::default() };
    let range = Some([frame.value(0.1), frame.value(0.8)]);
    let colours = ColourState { range, ..ColourState::default() };
    let names = ["u", "v", "w"].map(str::to_owned);
    let plain = SceneState { shade: 0.0, colours, ..SceneState::default() };
    vec![
        ("isosurface", SceneState { isosurfaces: vec![surface(1.0)], clips: clips.clone(), ..plain.clone() }),
        ("seen through", SceneState { isosurfaces: vec![surface(0.5)], ..plain.clone() }),
        ("slice", SceneState { slices: vec![slice], ..plain.clone() }),
        (
            "boundary",
            SceneState {
                boundary: Some(BoundaryState { clipped: true, ..BoundaryState::default() }),
                clips,
                region: box_of(0.2, 0.7),
                ..plain.clone()
            },
        ),
        ("volume", SceneState { volume: Some(VolumeState::default()), ..plain.clone() }),
        (
            "clipped volume",
            SceneState {
                volume: Some(VolumeState { clipped: true, ..VolumeState::default() }),
                clip_box: box_of(0.1, 0.8),
                ..plain.clone()
            },
        ),
        (
            "cells",
            SceneState {
                cells: Some(CellState {
                    // Through the centre of no cell.
                    cut: Some(through([0.53; 3], [1.0, 0.0, 0.0])),
                    shrink: 0.2,
                    ..CellState::default()
                }),
                ..plain.clone()
            },
        ),
        (
            "arrows",
            SceneState {
                arrows: Some(ArrowState { fields: names.clone(), ..Default::default() }),
                ..plain.clone()
            },
        ),
        (
            "streamlines",
            SceneState {
                streamlines: Some(StreamlineState {
                    fields: names,
                    seeds: vec![frame.point([0.5, 0.4, 0.6]), frame.point([0.3, 0.7, 0.5])],
                    ..Default::default()
                }),
                ..plain
            },
        ),
    ]
}

/// A picture, with the name of what it shows.
type Picture = (&'static str, Vec<[f64; 3]>);

/// The picture of each state.
fn pictures(frame: &Frame) -> Vec<Picture> {
    let mut mesh = frame.of(&cube(5, &[hilly]));
    // As a grid the model near the origin would be built in another order, and of faces that meet at an edge the one that is drawn
    // first is seen there.
    mesh.grid = None;
    let flow: [fn([f64; 3]) -> f64; 3] = [|p| 0.5 - p[1], |p| p[0] - 0.5, |_| 0.1];
    let unit = cube(5, &[hilly]);
    for (name, component) in ["u", "v", "w"].into_iter().zip(flow) {
        mesh.fields.push(Field::new(name.to_owned(), unit.positions.iter().map(|p| component(*p)).collect()));
    }
    let mut session = opened(&mesh);
    let mut scene = SceneRenderer::new(twin::renderer(SIZE));
    let bounds = Bounds { min: frame.point([0.0; 3]), max: frame.point([1.0; 3]) };
    let camera = Camera::home(&bounds, twin::aspect(SIZE));
    let mut all = Vec::new();
    for (name, state) in states(frame) {
        scene.set_state(state).expect("a good state");
        scene.update(&mut session).expect("it fits");
        let bytes = wait(scene.picture(&mut session, &camera, 1, |_| {})).expect("it is drawn");
        all.push((name, twin::colours(&bytes)));
    }
    all
}

#[test]
fn what_is_drawn_does_not_depend_on_where_it_is() {
    let wanted = pictures(&NEAR);
    for frame in FAR {
        let found = pictures(&frame);
        for ((name, wanted), (_, found)) in wanted.iter().zip(&found) {
            let differs = |(a, b): &(&[f64; 3], &[f64; 3])| (0..3).any(|k| (a[k] - b[k]).abs() > 0.03);
            let different = wanted.iter().zip(found).filter(differs).count();
            let shown = wanted.iter().filter(|colour| **colour != wanted[0]).count();
            if different > 60 {
                twin::save("wanted", SIZE, wanted);
                twin::save("found", SIZE, found);
            }
            assert!(shown > 500, "{name} shows something: {shown}");
            // Single pixels at edges and silhouettes may fall to the other side.
            assert!(different <= 60, "{name}: {different} pixels of {} differ in {frame:?}", wanted.len());
        }
    }
}
