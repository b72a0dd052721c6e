//! Promise: a displaced picture is the picture of the displaced mesh, of all that can be shown; another part of the displacement costs
//! nothing but a picture; and what is under the pointer is a point of the model as it is.

use crate::scenes::Scene;
use crate::support::meshes::{built, cube};
use crate::twin::{self, UNIT, picture, renderer};
use glam::{DMat3, DVec3};
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::{Camera, Ray};
use tetralod::mt::Mt;
use tetralod::refine::Request;
use tetralod::session::Session;
use tetralod::view::{
    BoundarySurface, ClipPlane, ColourScale, IsoSurface, MeshView, Plane, Probe, Slice, Slope, Solids,
    TraceOptions, Tracer, Triangles, TubeOptions, VIRIDIS,
};
use tetralod_render::SceneRenderer;
use tetralod_render::draw::{CellShape, CellStyle, Colouring, Edit, Lighting, Look, Style};
use tetralod_render::gpu::Renderer;
use tetralod_render::scene::{
    ArrowState, BoundaryState, CellKind, CellState, DeformState, IsosurfaceState, PlaneState, Scene as Shown,
    SceneError, SceneState, SliceState, StreamlineState, VolumeState,
};

const SIZE: [u32; 2] = [160, 120];
const TIMES: f64 = 0.8;

/// An affine displacement: it maps planes to planes, so that what planes cut can be compared.
const MAP: [[f64; 3]; 3] = [[0.2, -0.1, 0.05], [0.15, 0.1, -0.2], [-0.1, 0.25, 0.15]];
const SHIFT: [f64; 3] = [0.05, -0.1, 0.02];

fn affine(p: [f64; 3]) -> [f64; 3] {
    (DMat3::from_cols_array_2d(&MAP) * DVec3::from(p) + DVec3::from(SHIFT)).into()
}

fn image(p: [f64; 3]) -> [f64; 3] {
    let by = affine(p);
    [0, 1, 2].map(|i| p[i] + TIMES * by[i])
}

/// The image of a plane.
fn image_of_plane(plane: &ClipPlane) -> ClipPlane {
    let map = DMat3::IDENTITY + TIMES * DMat3::from_cols_array_2d(&MAP);
    let normal = map.inverse().transpose() * DVec3::from(plane.normal);
    ClipPlane { normal: normal.into(), offset: plane.offset + TIMES * normal.dot(SHIFT.into()) }
}

/// A displacement that is not even.
fn curved([x, y, z]: [f64; 3]) -> [f64; 3] {
    [0.15 * (3.0 * y).sin(), 0.1 * (4.0 * z + x).cos(), 0.2 * x * y - 0.1 * z * z]
}

/// The vectors at the points of a mesh, component by component, and the mesh displaced by so many times these.
fn displaced(scene: &Scene, by: impl Fn([f64; 3]) -> [f64; 3], times: f64) -> ([Vec<f64>; 3], Scene) {
    let vectors: Vec<[f64; 3]> = scene.positions.iter().map(|p| by(*p)).collect();
    let components = [0, 1, 2].map(|i| vectors.iter().map(|v| v[i]).collect());
    let moved = scene.positions.iter().zip(&vectors).map(|(p, v)| [0, 1, 2].map(|i| p[i] + times * v[i]));
    (components, Scene { positions: moved.collect(), ..scene.clone() })
}

fn zipped([x, y, z]: [Vec<f64>; 3]) -> Vec<[f64; 3]> {
    x.into_iter().zip(y).zip(z).map(|((x, y), z)| [x, y, z]).collect()
}

fn slices(components: &[Vec<f64>; 3]) -> [&[f64]; 3] {
    [0, 1, 2].map(|i| components[i].as_slice())
}

fn farthest(one: &[[f64; 3]], other: &[[f64; 3]]) -> f64 {
    assert!(one.len() == other.len() && !one.is_empty());
    let distance = |(p, q): (&[f64; 3], &[f64; 3])| DVec3::from(*p).distance((*q).into());
    one.iter().zip(other).map(distance).fold(0.0, f64::max)
}

#[test]
fn surfaces_of_a_displaced_mesh_are_displaced_surfaces() {
    let scene = Scene::ball(7);
    let (components, moved) = displaced(&scene, curved, TIMES);
    let (mesh, vectors) = (scene.view(), slices(&components));
    let mut iso = [IsoSurface::new(), IsoSurface::new()];
    iso[0].extract(&mesh, 0.3);
    iso[1].extract(&moved.view(), 0.3);
    let moves = zipped(vectors.map(|along| iso[0].interpolate(&mesh, along)));
    let own = Triangles { moves: &moves, ..Triangles::from(&iso[0]) }.moved_positions(TIMES);
    assert_eq!(iso[0].indices, iso[1].indices);
    assert!(farthest(&own, &iso[1].positions) < 1e-14);

    let mut boundary = [BoundarySurface::new(), BoundarySurface::new()];
    boundary[0].extract(&mesh);
    boundary[1].extract(&moved.view());
    let moves = zipped(vectors.map(|along| boundary[0].interpolate(along)));
    let own = Triangles { moves: &moves, ..Triangles::from(&boundary[0]) }.moved_positions(TIMES);
    assert_eq!(own, boundary[1].positions);
}

#[test]
fn an_affine_displacement_is_an_affine_map_of_every_surface() {
    let scene = Scene::ball(7);
    let (components, moved) = displaced(&scene, affine, TIMES);
    let (mesh, vectors) = (scene.view(), slices(&components));
    let check = |what: &str, surface: Triangles<'_>, moves: Vec<[f64; 3]>| {
        let found = Triangles { moves: &moves, ..surface }.moved_positions(TIMES);
        let known: Vec<[f64; 3]> = surface.positions.iter().map(|p| image(*p)).collect();
        assert!(farthest(&found, &known) < 1e-13, "{what}");
    };
    let mut iso = IsoSurface::new();
    iso.extract(&mesh, 0.3);
    check("isosurface", (&iso).into(), zipped(vectors.map(|along| iso.interpolate(&mesh, along))));
    let mut slice = Slice::new();
    slice.extract(&mesh, &Plane::through([0.52, 0.4, 0.5], [0.9, 0.4, 0.3]));
    check("section", (&slice).into(), zipped(vectors.map(|along| slice.interpolate(&mesh, along))));
    // Slopes are the map itself, and normals turn as those of the displaced mesh.
    let slopes = iso.slopes(&mesh, vectors);
    let off = |slope: &Slope| {
        slope.iter().flatten().zip(MAP.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    assert!(slopes.iter().map(off).fold(0.0, f64::max) < 1e-12);
    let normals = Triangles { slopes: &slopes, ..Triangles::from(&iso) }.turned_normals(TIMES);
    let mut known = IsoSurface::new();
    known.extract(&moved.view(), 0.3);
    let vec = |n: &[f32; 3]| DVec3::from(n.map(f64::from));
    let least = normals.iter().zip(&known.normals).map(|(a, b)| vec(a).dot(vec(b))).fold(1.0, f64::min);
    assert!(least > 0.999, "{least}");
}

#[test]
fn tubes_and_arrows_go_where_their_lines_and_middles_go() {
    let scene = Scene::ball(6);
    let (components, _) = displaced(&scene, affine, TIMES);
    let (mesh, vectors) = (scene.view(), slices(&components));
    let flow = vec![1.0; scene.positions.len()];
    let nothing = vec![0.0; scene.positions.len()];
    let line =
        Tracer::new(mesh, [&flow, &nothing, &nothing]).trace([0.1, 0.4, 0.6], &TraceOptions::default());
    let mut tube = Solids::new();
    tube.set_tubes(&Vec::from_iter(line), &TubeOptions { radius: 0.02, ..TubeOptions::default() });
    let moves = zipped(vectors.map(|along| tube.interpolate(&mesh, along)));
    assert!(tube.positions.len() > 50);
    // The line is straight, along x: what is beside it goes where it goes.
    for (p, way) in tube.positions.iter().zip(&moves) {
        assert!(DVec3::from(affine([p[0], 0.4, 0.6])).distance((*way).into()) < 1e-12, "{p:?}");
    }
}

/// A picture of things that are displaced and one of things that are where they go to.
struct Pair {
    renderers: [Renderer; 2],
    looks: [Look; 2],
    cameras: Vec<Camera>,
}

impl Pair {
    fn new(clips: &[ClipPlane]) -> Self {
        let own = Look { clips: clips.to_vec(), moved: TIMES, ..twin::plain() };
        let there = Look { clips: clips.iter().map(image_of_plane).collect(), moved: 0.0, ..own.clone() };
        let bounds = UNIT.with(image([0.0; 3])).with(image([1.0; 3]));
        let outside = Camera::home(&bounds, twin::aspect(SIZE));
        let mut behind = outside;
        behind.orbit(2.2, 0.5);
        Self {
            renderers: [renderer(SIZE), renderer(SIZE)],
            looks: [own, there],
            cameras: vec![outside, behind],
        }
    }

    /// Asserts that the pictures are the same but for a few pixels at the edges of triangles.
    fn check(&mut self, name: &str) {
        for (i, camera) in self.cameras.iter().enumerate() {
            let [own, there] = [0, 1].map(|k| picture(&mut self.renderers[k], camera, &self.looks[k]));
            twin::save(&format!("deform-{name}-{i}"), SIZE, &own);
            twin::save(&format!("deform-{name}-{i}-there"), SIZE, &there);
            let off =
                |(a, b): (&[f64; 3], &[f64; 3])| (DVec3::from(*a) - DVec3::from(*b)).abs().max_element();
            let shown = there.iter().filter(|p| off((p, &there[0])) > 8.0 / 255.0).count();
            let others = own.iter().zip(&there).map(off).filter(|off| *off > 4.0 / 255.0).count();
            println!("{name} {i}: {others} of {shown} pixels");
            assert!(shown > 1000, "{name}: there is something to see");
            assert!(100 * others <= shown, "{name} {i}: {others} of {shown} pixels");
        }
    }
}

fn planes() -> [ClipPlane; 2] {
    [
        // No point of a mesh is in them.
        ClipPlane { normal: [1.0, 0.2, 0.0], offset: 0.77 },
        ClipPlane { normal: [0.0, -1.0, 0.6], offset: 0.053 },
    ]
}

#[test]
fn pictures_of_displaced_surfaces_are_those_of_the_displaced_mesh() {
    let scene = Scene::ball(8);
    let (components, moved) = displaced(&scene, affine, TIMES);
    let (mesh, vectors) = (scene.view(), slices(&components));
    let colouring = Colouring::Scale(ColourScale::new(VIRIDIS, [-0.8, 1.0]).expect("a range"));
    let flat = Style { colouring, lighting: Lighting::Flat, ..Style::default() };
    for clips in [&[][..], &planes()] {
        let name = |what: &str| format!("{what}{}", if clips.is_empty() { "" } else { "-cut" });
        let mut pair = Pair::new(clips);
        let mut show = |what: &str, own: Triangles<'_>, there: Triangles<'_>, style: Style| {
            for (renderer, triangles) in pair.renderers.iter_mut().zip([own, there]) {
                renderer.set_surface(0, &triangles, None).expect("it fits");
                renderer.set_style(0, &style);
            }
            pair.check(&name(what));
        };
        let mut iso = [IsoSurface::new(), IsoSurface::new()];
        iso[0].extract(&mesh, 0.1);
        iso[1].extract(&moved.view(), 0.1);
        let moves = zipped(vectors.map(|along| iso[0].interpolate(&mesh, along)));
        let slopes = iso[0].slopes(&mesh, vectors);
        // Normals of the surface as it was, turned.
        let normals = Triangles { slopes: &slopes, ..Triangles::from(&iso[0]) }.turned_normals(TIMES);
        let own = Triangles { moves: &moves, slopes: &slopes, ..Triangles::from(&iso[0]) };
        let there = Triangles { normals: &normals, ..Triangles::from(&iso[1]) };
        show("isosurface", own, there, Style::default());
        show("sheer", own, there, Style { opacity: 0.5, ..Style::default() });

        let mut boundary = [BoundarySurface::new(), BoundarySurface::new()];
        boundary[0].extract(&mesh);
        boundary[1].extract(&moved.view());
        let moves = zipped(vectors.map(|along| boundary[0].interpolate(along)));
        let own = Triangles { moves: &moves, ..Triangles::from(&boundary[0]) };
        show("boundary", own, Triangles::from(&boundary[1]), flat);
    }
}

#[test]
fn pictures_of_displaced_tetrahedra_and_volumes_are_those_of_the_displaced_mesh() {
    let scene = Scene::ball(4);
    let (components, moved) = displaced(&scene, affine, TIMES);
    let moves = zipped(components);
    let colouring = Colouring::Scale(ColourScale::new(VIRIDIS, [-0.8, 1.0]).expect("a range"));
    let style = Style { colouring, lighting: Lighting::Flat, ..Style::default() };
    let cut = ClipPlane { normal: [0.4, 1.0, 0.0], offset: 0.71 };
    let shapes = [CellShape::Solid(0.0), CellShape::Solid(0.3), CellShape::Wire, CellShape::Points(8.0)];
    for clips in [&[][..], &planes()] {
        let mut pair = Pair::new(clips);
        for shape in shapes {
            let cells = CellStyle { style, shape, cut, own_values: false };
            let there = CellStyle { cut: image_of_plane(&cut), ..cells };
            pair.renderers[0].set_cells(Some(&cells));
            pair.renderers[1].set_cells(Some(&there));
            pair.renderers[0].update_mesh(&scene.view(), None).expect("it fits");
            pair.renderers[0].set_moves(&moves).expect("it fits");
            pair.renderers[1].update_mesh(&moved.view(), None).expect("it fits");
            pair.check(&format!("{shape:?}-{}", clips.len()));
        }
        pair.renderers.iter_mut().for_each(|renderer| renderer.set_cells(None));
        let [(_, fog), _] = twin::media();
        // From inside, too.
        let flown = |k: u8| {
            let mut camera = pair.cameras[0];
            camera.fly(0.02, 0.01, 0.02 * f64::from(k));
            camera
        };
        let mut probe = Probe::new(moved.view());
        let inside = (0..60).map(flown).find(|camera| probe.locate(camera.eye().into()).is_some());
        pair.cameras.push(inside.expect("the eye gets there"));
        for renderer in &mut pair.renderers {
            renderer.set_volume(Some((&fog, u32::MAX))).expect("it fits");
        }
        pair.renderers[0].update_mesh(&scene.view(), None).expect("it fits");
        pair.renderers[0].set_moves(&moves).expect("it fits");
        pair.renderers[1].update_mesh(&moved.view(), None).expect("it fits");
        for camera in std::mem::take(&mut pair.cameras) {
            let place = Probe::new(moved.view()).locate(camera.eye().into());
            pair.renderers[0].set_eye(&scene.view(), place.as_ref());
            pair.renderers[1].set_eye(&moved.view(), place.as_ref());
            pair.cameras = vec![camera];
            pair.check(&format!("volume-{}-{}", clips.len(), place.is_some()));
        }
    }
}

/// An MT of a cube with a field and the vectors of `curved`, u_x, u_y, u_z.
fn opened() -> Session {
    let x: fn([f64; 3]) -> f64 = |p| curved(p)[0];
    let mut mesh = cube(6, &[|[x, y, z]| x + 0.3 * y * z, x, |p| curved(p)[1], |p| curved(p)[2]]);
    for (field, name) in mesh.fields.iter_mut().zip(["heat", "u_x", "u_y", "u_z"]) {
        field.name = name.to_owned();
    }
    let mut session = Session::new();
    let mt = Mt::from(built(&mesh).mt);
    session.feed(&encode(&mt, &EncodeOptions::default()).expect("a complete MT")).expect("a good file");
    session.refine(&Request::within(0.0)).expect("a good request");
    session
}

fn deform(factor: Option<f64>, phase: Option<f64>) -> Option<DeformState> {
    Some(DeformState { field: "u".to_owned(), factor, phase, undeformed: false })
}

/// Everything that can be shown, with a plane that cuts.
fn everything() -> SceneState {
    let fields = ["u_x", "u_y", "u_z"].map(str::to_owned);
    SceneState {
        isosurfaces: vec![IsosurfaceState { value: Some(0.6), ..IsosurfaceState::default() }],
        volume: Some(VolumeState::default()),
        slices: vec![SliceState {
            normal: [0.0, 0.0, 1.0],
            offset: 0.4,
            opacity: 0.5,
            edges: false,
            field: None,
            clipped: true,
        }],
        boundary: Some(BoundaryState { opacity: 0.5, ..BoundaryState::default() }),
        cells: Some(CellState { shape: CellKind::Wire, ..CellState::default() }),
        streamlines: Some(StreamlineState {
            fields: fields.clone(),
            seeds: vec![[0.5; 3]],
            ..StreamlineState::default()
        }),
        arrows: Some(ArrowState { fields, spacing: Some(0.3), ..ArrowState::default() }),
        clips: vec![PlaneState { normal: [1.0, 0.3, 0.0], offset: 0.8 }],
        ..SceneState::default()
    }
}

#[test]
fn a_phase_without_displacement_is_the_picture_without_displacement() {
    let (mut session, mut scene) = (opened(), SceneRenderer::new(renderer(SIZE)));
    let camera = Camera::home(&UNIT, twin::aspect(SIZE));
    let mut bytes = |deform: Option<DeformState>| {
        scene.set_state(SceneState { deform, ..everything() }).expect("a good state");
        scene.update(&mut session).expect("it has it");
        tetralod_render::gpu::wait(scene.picture(&mut session, &camera, 1, |_| {})).expect("a picture")
    };
    let rest = bytes(None);
    assert!(bytes(deform(None, Some(0.0))) == rest, "nothing is displaced");
    assert!(bytes(deform(Some(0.0), None)) == rest, "nothing is displaced");
    assert!(bytes(deform(None, None)) != rest, "all is displaced");
    assert!(
        bytes(deform(None, Some(0.25))) == bytes(deform(None, None)),
        "a quarter of a period is all of it"
    );
    assert!(bytes(None) == rest, "it comes back");
}

#[test]
fn another_factor_or_phase_lists_nothing() {
    let (mut session, mut scene) = (opened(), Shown::default());
    let state = SceneState { deform: deform(None, None), ..everything() };
    scene.set_state(state.clone()).expect("a good state");
    assert!(!scene.update(&mut session).edits.is_empty());
    let automatic = scene.look().moved;
    // The longest vector that the ranges allow goes a tenth of the diagonal.
    assert!((automatic - 0.1 * 3.0_f64.sqrt()).abs() < 1e-9, "{automatic}");
    for (factor, phase, part) in
        [(None, Some(0.5), 0.0), (Some(3.0), None, 1.0), (Some(-1.0), Some(0.75), -1.0)]
    {
        let other = SceneState { deform: deform(factor, phase), ..state.clone() };
        scene.set_state(other).expect("a good state");
        let update = scene.update(&mut session);
        assert!(
            update.edits.is_empty() && update.changed.expect("it has it"),
            "only the look is another one"
        );
        let deformation = *scene.deformation().expect("it is displaced");
        assert_eq!(deformation.part, part);
        assert_eq!(scene.look().moved, deformation.factor * part * deformation.largest);
    }
    let undeformed = deform(None, None).map(|deform| DeformState { undeformed: true, ..deform });
    scene.set_state(SceneState { deform: undeformed, ..state.clone() }).expect("a good state");
    assert!(!scene.update(&mut session).edits.is_empty(), "the boundary comes");
    let other = deform(None, None).map(|deform| DeformState { field: "v".to_owned(), ..deform });
    scene.set_state(SceneState { deform: other, ..state }).expect("a good state whatever the volume is");
    let problem = scene.update(&mut session).changed.expect_err("there is no such vector");
    assert!(matches!(&problem, SceneError::State { what, .. } if what == "deform.field"), "{problem}");
}

#[test]
fn all_surfaces_of_a_scene_have_moves() {
    let (mut session, mut scene) = (opened(), Shown::default());
    let undeformed = deform(Some(0.5), None).map(|deform| DeformState { undeformed: true, ..deform });
    scene.set_state(SceneState { deform: undeformed, ..everything() }).expect("a good state");
    let mesh = session.view().positions.to_vec();
    let edits = scene.update(&mut session).edits;
    let mut still = Vec::new();
    let (mut count, mut has_mesh) = (0, false);
    for edit in &edits {
        match edit {
            Edit::Moves(moves) => has_mesh = moves.len() == mesh.len(),
            Edit::Surface { key, triangles, .. } if triangles.moves.is_empty() => still.push(*key),
            Edit::Surface { triangles, .. } => {
                assert_eq!(triangles.moves.len(), triangles.positions.len());
                assert!(triangles.slopes.is_empty() || triangles.slopes.len() == triangles.positions.len());
                count += 1;
            }
            _ => {}
        }
    }
    assert!(has_mesh);
    assert_eq!(count, 6, "an isosurface, a section, the boundary, its cap, tubes and arrows");
    assert_eq!(still.len(), 1, "the boundary without displacement");
}

#[test]
fn points_under_the_pointer_are_those_of_the_model() {
    let (mut session, mut scene) = (opened(), SceneRenderer::new(renderer([8, 8])));
    let whole = everything();
    let nothing =
        SceneState { deform: deform(Some(0.6), None), clips: whole.clips.clone(), ..SceneState::default() };
    let states = [
        SceneState { isosurfaces: whole.isosurfaces.clone(), ..nothing.clone() },
        SceneState { slices: whole.slices.clone(), ..nothing.clone() },
        SceneState { boundary: whole.boundary.clone(), ..nothing.clone() },
        SceneState { cells: Some(CellState::default()), ..nothing.clone() },
        SceneState { arrows: whole.arrows.clone(), ..nothing.clone() },
        SceneState {
            volume: Some(VolumeState { opacities: vec![[0.0, 0.9], [1.3, 0.9]], ..VolumeState::default() }),
            ..nothing
        },
    ];
    for (i, state) in states.into_iter().enumerate() {
        scene.set_state(state).expect("a good state");
        scene.update(&mut session).expect("it has it");
        let mut found = 0;
        for k in 0..100 {
            let [x, y] = [f64::from(k % 10), f64::from(k / 10)].map(|k| (k + 0.5) / 10.0);
            let ray = Ray { origin: [x, y, -2.0].into(), direction: DVec3::Z };
            let Some(point) = scene.pick(&mut session, &ray) else { continue };
            assert!(point[0] + 0.3 * point[1] <= 0.8 + 1e-6 || i == 4, "{i}: it is not cut away");
            // An arrow goes as its middle does: what is beside that has no place of its own.
            if i == 4 {
                found += 1;
                continue;
            }
            let shown = scene.shown(&mut session, point).expect("it is in the mesh");
            assert!(
                (shown[0] - x).abs() < 2e-6 && (shown[1] - y).abs() < 2e-6,
                "{i}: {shown:?} is on the ray"
            );
            let u = curved(point);
            let near = DVec3::from(shown).distance(DVec3::from(point) + 0.6 * DVec3::from(u));
            assert!(near < 0.02, "{i}: it is displaced by the vector there, within the mesh's error: {near}");
            found += 1;
        }
        assert!(found > if i == 4 { 0 } else { 10 }, "{i}: {found} points");
    }
}

#[test]
fn what_is_displaced_stays_in_the_box_that_is_shown() {
    let (mut session, mut scene) = (opened(), Shown::default());
    for (factor, phase) in [(None, None), (Some(-2.0), None), (Some(2.0), Some(0.75)), (Some(2.0), Some(0.0))]
    {
        scene.set_state(SceneState { deform: deform(factor, phase), ..everything() }).expect("a good state");
        assert!(scene.update(&mut session).changed.is_ok());
        let bounds = scene.shown_bounds(&session).expect("it is there");
        let points: Vec<[f64; 3]> = session.view().positions.to_vec();
        for point in points.iter().step_by(7) {
            let shown = scene.shown(&mut session, *point).expect("it is in the mesh");
            let grown = [0, 1, 2].map(|i| shown[i].clamp(bounds.min[i] - 1e-9, bounds.max[i] + 1e-9));
            assert_eq!(shown, grown, "{factor:?} {phase:?}");
        }
    }
    let rest = MeshView { ..session.view() }.bounds();
    scene.set_state(everything()).expect("a good state");
    assert_eq!(scene.shown_bounds(&session), Some(rest));
}
