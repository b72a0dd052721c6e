//! Promise: without any GPU a scene lists what is to be drawn, and who makes the edits of one list after the other has what a list
//! from nothing makes.

use crate::support::meshes::{built, cube, hilly, linear};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::LazyLock;
use tetralod::format::{EncodeOptions, encode};
use tetralod::mt::Mt;
use tetralod::refine::Request;
use tetralod::session::Session;
use tetralod::view::Triangles;
use tetralod_render::draw::{BoxLines, CellStyle, Edit, Style};
use tetralod_render::scene::{
    BoundaryState, CellState, CompareState, IsosurfaceState, PlaneState, Scene, SceneError, SceneState,
    SliceState, Update, VolumeState,
};

/// A surface as it is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
struct Surface {
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    style: Style,
}

impl Surface {
    fn update(&mut self, of: &Triangles<'_>, changes: Option<[&[Range<u32>]; 2]>) {
        let [vertices, triangles] = changes.unwrap_or_else(|| {
            *self = Self::default();
            [&[], &[]]
        });
        update(&mut self.positions, of.positions, vertices);
        update(&mut self.triangles, of.indices, triangles);
        assert!(
            self.positions == of.positions && self.triangles == of.indices,
            "the changes are all of them"
        );
    }

    /// Its vertices in an order that does not depend on how it was made.
    fn sorted(&self) -> (Vec<[u64; 3]>, usize, Style) {
        let mut points: Vec<_> = self.positions.iter().map(|point| point.map(f64::to_bits)).collect();
        points.sort_unstable();
        (points, self.triangles.len(), self.style)
    }
}

/// Takes the changed ranges, and what lies beyond the end.
fn update<T: Copy>(own: &mut Vec<T>, all: &[T], changed: &[Range<u32>]) {
    own.truncate(all.len());
    for range in changed {
        let range = range.start as usize..(range.end as usize).min(own.len());
        own[range.clone()].copy_from_slice(&all[range]);
    }
    own.extend_from_slice(&all[own.len()..]);
}

/// What draws, but for drawing.
#[derive(Clone, Debug, Default)]
struct Drawn {
    surfaces: BTreeMap<u32, Surface>,
    boxes: Vec<BoxLines>,
    cells: Option<CellStyle>,
    has_volume: bool,
    beside: Option<Box<Drawn>>,
}

impl Drawn {
    fn apply(&mut self, edits: &[Edit<'_>]) {
        for edit in edits {
            match edit {
                Edit::Clear => *self = Self { boxes: std::mem::take(&mut self.boxes), ..Self::default() },
                Edit::Boxes(boxes) => self.boxes.clone_from(boxes),
                Edit::Cells(style) => self.cells = *style,
                Edit::Volume(medium) => self.has_volume = medium.is_some(),
                Edit::Surface { key, triangles, changes, style } => {
                    let surface = self.surfaces.entry(*key).or_default();
                    surface.update(triangles, changes.map(|of| [&of.vertices[..], &of.triangles]));
                    surface.style = *style;
                }
                Edit::Remove(key) => drop(self.surfaces.remove(key)),
                Edit::Beside { split, edits } if *split > 0.0 => {
                    self.beside.get_or_insert_default().apply(edits)
                }
                Edit::Beside { .. } => self.beside = None,
                Edit::Points(_) | Edit::Values(_) | Edit::CellValues(_) | Edit::Mesh(..) => {}
            }
        }
    }

    /// Asserts that all of it but the part beside is what another draws.
    fn assert_same(&self, other: &Self) {
        let sorted = |drawn: &Self| drawn.surfaces.values().map(Surface::sorted).collect::<Vec<_>>();
        assert!(self.surfaces.keys().eq(other.surfaces.keys()) && sorted(self) == sorted(other));
        assert_eq!((&self.boxes, self.cells), (&other.boxes, other.cells));
        assert_eq!(self.has_volume, other.has_volume);
    }
}

/// An MT of two fields.
static FILE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let mt = Mt::from(built(&cube(6, &[hilly, linear])).mt);
    encode(&mt, &EncodeOptions::default()).expect("a complete MT")
});

fn opened() -> Session {
    let mut session = Session::new();
    session.feed(&FILE).expect("a good file");
    session
}

fn scene(state: &SceneState) -> Scene {
    let mut scene = Scene::default();
    scene.set_state(state.clone()).expect("a good state");
    scene
}

/// Makes what is out of date; whether anything was.
fn follow(scene: &mut Scene, session: &mut Session, drawn: &mut Drawn) -> bool {
    let Update { edits, changed } = scene.update(session);
    drawn.apply(&edits);
    let changed = changed.expect("the volume has it");
    assert!(changed || edits.is_empty());
    changed
}

/// What a scene lists that begins with this mesh.
fn anew(state: &SceneState, error: f64) -> Drawn {
    let (mut session, mut drawn) = (opened(), Drawn::default());
    session.refine(&Request::within(error)).expect("a good request");
    assert!(follow(&mut scene(state), &mut session, &mut drawn));
    drawn
}

fn slice(field: Option<&str>) -> SliceState {
    SliceState {
        normal: [0.0, 0.0, 1.0],
        offset: 0.4,
        opacity: 1.0,
        edges: false,
        field: field.map(str::to_owned),
        clipped: true,
    }
}

fn states() -> [SceneState; 3] {
    let surface = |opacity: f64| IsosurfaceState { opacity, ..IsosurfaceState::default() };
    let coloured = IsosurfaceState { field: Some("f1".to_owned()), ..IsosurfaceState::default() };
    [
        SceneState {
            isosurfaces: vec![surface(1.0), surface(0.5), coloured],
            volume: Some(VolumeState::default()),
            ..SceneState::default()
        },
        SceneState {
            isosurfaces: vec![surface(1.0)],
            boundary: Some(BoundaryState { clipped: true, ..BoundaryState::default() }),
            clips: vec![PlaneState { normal: [1.0, 0.0, 0.0], offset: 0.6 }],
            slices: vec![slice(None), slice(Some("f1"))],
            ..SceneState::default()
        },
        SceneState { cells: Some(CellState::default()), outline: false, ..SceneState::default() },
    ]
}

#[test]
fn lists_one_after_the_other_make_what_one_from_nothing_makes() {
    let (mut session, mut drawn, mut scene) = (opened(), Drawn::default(), Scene::default());
    for state in states().iter().chain(states().iter().rev()) {
        scene.set_state(state.clone()).expect("a good state");
        for error in [0.3, 0.0, 0.1] {
            session.refine(&Request::within(error)).expect("a good request");
            assert!(follow(&mut scene, &mut session, &mut drawn));
            drawn.assert_same(&anew(state, error));
            assert!(!follow(&mut scene, &mut session, &mut drawn), "nothing has changed");
        }
    }
    drawn.apply(&[scene.forget()]);
    assert!(drawn.surfaces.is_empty() && drawn.cells.is_none() && !drawn.has_volume);
    assert!(follow(&mut scene, &mut Session::new(), &mut drawn), "the picture is empty now");
    drawn.apply(&scene.update(&mut session).edits);
    drawn.assert_same(&anew(&states()[0], 0.1));
}

#[test]
fn only_changes_come_while_the_state_stays() {
    let [state, ..] = states();
    let (mut scene, mut session) = (scene(&state), opened());
    session.refine(&Request::within(0.3)).expect("a good request");
    let ranges = |edits: &[Edit<'_>]| {
        let surfaces = edits.iter().filter_map(|edit| match edit {
            Edit::Surface { changes, .. } => Some(changes.is_some()),
            _ => None,
        });
        surfaces.collect::<Vec<_>>()
    };
    assert_eq!(ranges(&scene.update(&mut session).edits), [false; 3]);
    session.refine(&Request::within(0.2)).expect("a good request");
    let edits = scene.update(&mut session).edits;
    assert_eq!(ranges(&edits), [true, true, false], "the colours of the last one are of another field");
    assert!(!edits.iter().any(|edit| matches!(edit, Edit::Boxes(_) | Edit::Volume(_) | Edit::Points(_))));
    drop(edits);
    // A renderer had no room for them.
    scene.lose_surfaces();
    session.refine(&Request::within(0.1)).expect("a good request");
    assert_eq!(ranges(&scene.update(&mut session).edits), [false; 3]);
}

#[test]
fn a_mesh_that_was_kept_is_listed_beside() {
    let [_, state, _] = states();
    let (mut scene, mut session, mut drawn) = (scene(&state), opened(), Drawn::default());
    session.refine(&Request::within(0.3)).expect("a good request");
    drawn.apply(&[scene.keep(&mut session).expect("it is there")]);
    session.refine(&Request::within(0.0)).expect("a good request");
    let compare = Some(CompareState::default());
    scene.set_state(SceneState { compare, ..state.clone() }).expect("a good state");
    assert!(follow(&mut scene, &mut session, &mut drawn));
    drawn.assert_same(&anew(&state, 0.0));
    drawn.beside.as_ref().expect("the mesh that was kept").assert_same(&anew(&state, 0.3));
    scene.set_state(state).expect("a good state");
    assert!(follow(&mut scene, &mut session, &mut drawn));
    assert!(drawn.beside.is_none());
}

#[test]
fn what_comes_before_an_error_is_listed() {
    let [_, state, _] = states();
    let slices = vec![slice(None), slice(Some("no such"))];
    let (mut scene, mut session) = (scene(&SceneState { slices, ..state }), opened());
    let Update { edits, changed } = scene.update(&mut session);
    assert!(matches!(changed, Err(SceneError::State { what, .. }) if what == "slices"));
    let mut drawn = Drawn::default();
    drawn.apply(&edits);
    assert_eq!(drawn.surfaces.len(), 2, "the isosurface and the first slice");
}
