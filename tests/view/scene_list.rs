//! Promise: without any GPU a scene lists what is to be drawn, and who makes the edits of one list after the other has what a list
//! from nothing makes.

use crate::support::meshes::{built, cube, hilly, linear, parted};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::LazyLock;
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::Ray;
use tetralod::mesh::NONE;
use tetralod::mt::Mt;
use tetralod::refine::Request;
use tetralod::session::Session;
use tetralod::view::{Triangles, area, is_closed, region_color};
use tetralod_build::{BuildConfig, build};
use tetralod_render::draw::{BoxLines, CellStyle, Colouring, Edit, Style};
use tetralod_render::scene::{
    BoundaryState, CellState, ColourBy, ColourState, CompareState, IsosurfaceState, OtherMesh, PlaneState,
    RegionName, Scene, SceneError, SceneState, SliceState, ThresholdState, Update, VolumeState,
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
                Edit::Points(_) | Edit::Values(_) | Edit::CellValues(_) | Edit::Mesh(..) | Edit::Moves(_) => {
                }
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

fn states() -> [SceneState; 5] {
    let surface = |opacity: f64| IsosurfaceState { opacity, ..IsosurfaceState::default() };
    let coloured = || IsosurfaceState { field: Some("f1".to_owned()), ..IsosurfaceState::default() };
    [
        SceneState {
            isosurfaces: vec![surface(1.0), surface(0.5), coloured()],
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
        SceneState {
            threshold: Some(ThresholdState { field: Some("f1".to_owned()), range: [0.1, 0.6], cut: false }),
            isosurfaces: vec![surface(1.0)],
            boundary: Some(BoundaryState::default()),
            colours: ColourState { bands: Some(5), ..ColourState::default() },
            ..SceneState::default()
        },
        SceneState {
            threshold: Some(ThresholdState { field: Some("f1".to_owned()), range: [0.1, 0.6], cut: true }),
            isosurfaces: vec![surface(1.0), coloured()],
            boundary: Some(BoundaryState::default()),
            slices: vec![slice(None), slice(Some("f1"))],
            cells: Some(CellState { colour_by: "size".to_owned(), ..CellState::default() }),
            volume: Some(VolumeState::default()),
            ..SceneState::default()
        },
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
    let [_, state, ..] = states();
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
fn the_difference_to_another_file_is_shown_where_both_are() {
    let [_, state, ..] = states();
    let (mut scene, mut session, mut drawn) = (scene(&state), opened(), Drawn::default());
    session.refine(&Request::within(0.0)).expect("a good request");
    // The lower half of the domain, where the other field is less by 2.
    let half = cube(4, &[hilly]);
    let positions: Vec<[f64; 3]> = half.positions.iter().map(|[x, y, z]| [x / 2.0, *y, *z]).collect();
    let values = positions.iter().map(|p| linear(*p) - 2.0).collect();
    let other = OtherMesh { positions, tets: half.tets.clone(), fields: vec![(1, values)], reach: 0.01 };
    drawn.apply(&[scene.keep_other(&session, other.clone()).expect("a mesh")]);
    let compare = Some(CompareState { at: 0.5, difference: true });
    scene.set_state(SceneState { compare, ..state.clone() }).expect("a good state");
    assert!(follow(&mut scene, &mut session, &mut drawn));
    drawn.assert_same(&anew(&state, 0.0));
    assert!(drawn.beside.is_none(), "nothing is drawn of the other mesh");
    assert_eq!(scene.legend().expect("colours").label, "f0", "the other file has no such field");

    session.set_field(1).expect("there is one");
    scene.set_state(SceneState { compare, outline: false, ..state.clone() }).expect("a good state");
    assert!(follow(&mut scene, &mut session, &mut drawn));
    let legend = scene.legend().expect("colours").clone();
    assert_eq!(legend.label, "difference of f1");
    assert!((legend.scale.range[1] - 2.0).abs() < 1e-3, "{legend:?}");
    let (points, outside) = {
        let mesh = session.view();
        let used: BTreeSet<u32> =
            mesh.tets.as_flattened().iter().copied().filter(|point| *point != NONE).collect();
        let outside = used.iter().filter(|point| mesh.positions[**point as usize][0] > 0.51).count();
        (used.len(), outside)
    };
    assert!(outside > 0 && legend.apart == outside && outside < points, "{legend:?}: {outside} of {points}");
    for surface in drawn.surfaces.values() {
        let places = surface.triangles.as_flattened().iter().map(|v| surface.positions[*v as usize]);
        assert!(places.into_iter().all(|[x, ..]| x <= 0.51));
    }

    scene.set_state(SceneState { outline: true, ..state.clone() }).expect("a good state");
    assert!(follow(&mut scene, &mut session, &mut drawn));
    assert_eq!(scene.legend().expect("colours").apart, 0);
    let (mut again, mut whole) = (self::scene(&state), Drawn::default());
    assert!(follow(&mut again, &mut session, &mut whole));
    drawn.assert_same(&whole);
    for bad in [
        OtherMesh { tets: vec![[0, 1, 2, u32::MAX]], ..other.clone() },
        OtherMesh { fields: vec![(1, vec![0.0])], ..other.clone() },
        OtherMesh { fields: vec![(7, Vec::new())], ..OtherMesh::default() },
        OtherMesh { reach: f64::NAN, ..other.clone() },
        OtherMesh { tets: vec![[0, 1, 2, 3]; 3], ..other },
    ] {
        let refused = scene.keep_other(&session, bad).expect_err("no mesh");
        assert!(matches!(refused, SceneError::State { ref what, .. } if what == "mesh"), "{refused}");
    }
}

#[test]
fn what_comes_before_an_error_is_listed() {
    let [_, state, ..] = states();
    let slices = vec![slice(None), slice(Some("no such"))];
    let (mut scene, mut session) = (scene(&SceneState { slices, ..state }), opened());
    let Update { edits, changed } = scene.update(&mut session);
    assert!(matches!(changed, Err(SceneError::State { what, .. }) if what == "slices"));
    let mut drawn = Drawn::default();
    drawn.apply(&edits);
    assert_eq!(drawn.surfaces.len(), 2, "the isosurface and the first slice");
}

/// Two halves and a core that reaches into both, each a region.
fn in_regions() -> Session {
    let config = BuildConfig { preserve: vec!["part".into()], all_fields: true, ..BuildConfig::default() };
    let mt = build(&parted(6), &config).expect("a valid mesh").mt;
    let mut session = Session::new();
    session.feed(&encode(&mt, &EncodeOptions::default()).expect("a complete MT")).expect("a good file");
    session
}

#[test]
fn regions_that_are_not_shown_are_not_drawn() {
    let all = SceneState {
        boundary: Some(BoundaryState::default()),
        isosurfaces: vec![IsosurfaceState { value: Some(0.4), ..IsosurfaceState::default() }],
        slices: vec![SliceState {
            normal: [0.0, 1.0, 0.0],
            offset: 0.45,
            opacity: 1.0,
            edges: false,
            field: None,
            clipped: true,
        }],
        ..SceneState::default()
    };
    let mut session = in_regions();
    session.refine(&Request::within(0.0)).expect("a valid MT");
    let (mut list, mut drawn) = (scene(&all), Drawn::default());
    follow(&mut list, &mut session, &mut drawn);
    let whole = drawn.clone();
    for (names, inside) in [
        (vec![RegionName::Label(0)], [0.0, 0.5]),
        (vec![RegionName::Name("1".into())], [0.5, 1.0]),
        (vec![RegionName::Label(5)], [1.0 / 3.0, 2.0 / 3.0]),
    ] {
        list.set_state(SceneState { regions: Some(names.clone()), ..all.clone() }).expect("a good state");
        follow(&mut list, &mut session, &mut drawn);
        let points = || drawn.surfaces.values().flat_map(|surface| &surface.positions);
        assert!(points().count() > 0, "{names:?}");
        let off = points().find(|p| !(inside[0] - 1e-6..=inside[1] + 1e-6).contains(&p[0]));
        assert_eq!(off, None, "{names:?}");
        // As it is from nothing.
        let (mut other, mut again) = (in_regions(), Drawn::default());
        other.refine(&Request::within(0.0)).expect("a valid MT");
        follow(&mut scene(list.state()), &mut other, &mut again);
        drawn.assert_same(&again);
    }
    list.set_state(all).expect("a good state");
    follow(&mut list, &mut session, &mut drawn);
    drawn.assert_same(&whole);
    let unknown =
        SceneState { regions: Some(vec![RegionName::Name("rotor".into())]), ..list.state().clone() };
    list.set_state(unknown).expect("whether it is there depends on the volume");
    let problem = list.update(&mut session).changed.expect_err("there is no rotor").to_string();
    assert!(problem.contains("regions[0]") && problem.contains("0, 1, 5"), "{problem}");
}

/// What is drawn of a boundary with these opacities of regions: for each surface its opacity, its area and whether it is closed.
fn sheer(session: &mut Session, opacities: &[(&str, f64)], more: SceneState) -> Vec<(f32, f64, bool)> {
    let region_opacities = opacities.iter().map(|(name, opacity)| ((*name).to_owned(), *opacity)).collect();
    let boundary = Some(BoundaryState { region_opacities, ..BoundaryState::default() });
    let mut drawn = Drawn::default();
    follow(&mut scene(&SceneState { boundary, ..more }), session, &mut drawn);
    let one = |Surface { positions, triangles, style }: &Surface| {
        (style.opacity, area(positions, triangles), is_closed(triangles))
    };
    drawn.surfaces.values().map(one).collect()
}

#[test]
fn what_a_translucent_region_hides_is_drawn_as_a_whole() {
    let mut session = in_regions();
    session.refine(&Request::within(0.02)).expect("a valid MT");
    let near = |found: &[(f32, f64, bool)], wanted: &[(f32, f64, bool)]| {
        let is_same =
            |a: &(f32, f64, bool), b: &(f32, f64, bool)| (a.0, a.2) == (b.0, b.2) && (a.1 - b.1).abs() < 1e-3;
        assert!(
            found.len() == wanted.len() && found.iter().zip(wanted).all(|(a, b)| is_same(a, b)),
            "{found:?}"
        );
    };
    let (half, whole) = (3.0, 6.0);
    // The interface of half 0 with half 1 is the middle without the core, and with this its sides and its end in half 0.
    let (between, of_core) = (1.0 - 1.0 / 9.0, 4.0 / 18.0 + 1.0 / 9.0);
    let plain = SceneState::default;
    near(&sheer(&mut session, &[], plain()), &[(1.0, whole, true)]);
    near(&sheer(&mut session, &[("0", 1.0)], plain()), &[(1.0, whole, true)]);
    let opaque = (1.0, half + between + of_core, true);
    near(&sheer(&mut session, &[("0", 0.25)], plain()), &[(0.25, half, false), opaque]);
    // Of two that are translucent, the interface is that of the more opaque one. The core is seen through both.
    let core = (1.0, 6.0 / 9.0, true);
    let denser = (0.5, half + between, false);
    near(&sheer(&mut session, &[("1", 0.5), ("0", 0.25)], plain()), &[(0.25, half, false), denser, core]);
    // What is cut open is closed by a section for each.
    let clips = vec![PlaneState { normal: [0.0, 1.0, 0.0], offset: 0.5 }];
    let cut = sheer(&mut session, &[("0", 0.25)], SceneState { clips, ..plain() });
    let caps: Vec<_> = cut.iter().map(|(opacity, area, _)| (*opacity, *area, false)).take(2).collect();
    near(&caps, &[(0.25, 0.5 - 1.0 / 18.0, false), (1.0, 0.5 + 1.0 / 18.0, false)]);
    // Hidden ones hide nothing.
    let regions = Some(vec![RegionName::Label(0), RegionName::Label(5)]);
    let some = sheer(&mut session, &[("0", 0.25)], SceneState { regions, ..plain() });
    near(&some, &[(0.25, half + between, false), core]);
    let boundary =
        BoundaryState { region_opacities: [("rotor".to_owned(), 0.5)].into(), ..BoundaryState::default() };
    let unknown = SceneState { boundary: Some(boundary), ..plain() };
    let problem = scene(&unknown).update(&mut session).changed.expect_err("there is no rotor").to_string();
    assert!(problem.contains("boundary.regionOpacities") && problem.contains("0, 1, 5"), "{problem}");
    let problem = scene(&unknown).update(&mut opened()).changed.expect_err("there are none").to_string();
    assert!(problem.contains("not parted"), "{problem}");
}

#[test]
fn what_is_transparent_is_not_under_the_pointer() {
    let mut session = in_regions();
    session.refine(&Request::within(0.0)).expect("a valid MT");
    let ray = Ray { origin: [-2.0, 0.45, 0.52].into(), direction: [1.0, 0.0, 0.0].into() };
    for (opacity, x) in [(1.0, 0.0), (0.25, 0.0), (0.0, 1.0 / 3.0)] {
        let boundary = BoundaryState {
            region_opacities: [("0".to_owned(), opacity)].into(),
            ..BoundaryState::default()
        };
        let mut list = scene(&SceneState { boundary: Some(boundary), ..SceneState::default() });
        follow(&mut list, &mut session, &mut Drawn::default());
        let found = list.pick(&mut session, &ray).expect("something is there");
        assert!((found[0] - x).abs() < 1e-4, "{opacity}: {found:?}");
    }
}

#[test]
fn each_region_has_a_colour_of_its_own() {
    let boundary = BoundaryState { colour_by: ColourBy::Region, ..BoundaryState::default() };
    let state = SceneState { boundary: Some(boundary.clone()), ..SceneState::default() };
    let mut session = in_regions();
    session.refine(&Request::within(0.01)).expect("a valid MT");
    let drawn_of = |state: &SceneState, session: &mut Session| {
        let mut drawn = Drawn::default();
        follow(&mut scene(state), session, &mut drawn);
        drawn.surfaces.retain(|_, surface| !surface.triangles.is_empty());
        drawn
    };
    let by_region = drawn_of(&state, &mut session);
    // The core is inside.
    assert_eq!(by_region.surfaces.len(), 2);
    for surface in by_region.surfaces.values() {
        let low = surface.positions.iter().all(|p| p[0] <= 0.5);
        assert!(low || surface.positions.iter().all(|p| p[0] >= 0.5), "a colour is of one half");
    }
    let by_field = BoundaryState { colour_by: ColourBy::Field, ..boundary };
    let plain = drawn_of(&SceneState { boundary: Some(by_field), ..SceneState::default() }, &mut session);
    let triangles =
        |drawn: &Drawn| drawn.surfaces.values().map(|surface| surface.triangles.len()).sum::<usize>();
    assert_eq!(triangles(&by_region), triangles(&plain));
    // Of tetrahedra, each has the colour of its region, too.
    let cells = CellState { colour_by: "region".to_owned(), ..CellState::default() };
    let by_cell = SceneState { cells: Some(cells), ..SceneState::default() };
    let (regions, colors) = {
        let all = session.regions().expect("it has regions").colors();
        (session.mesh().expect("it is open").regions().to_vec(), all)
    };
    let mut list = scene(&by_cell);
    let edits = list.update(&mut session).edits;
    let values =
        edits.iter().find_map(|edit| if let Edit::CellValues(values) = edit { Some(*values) } else { None });
    let values = values.expect("a value for each tetrahedron").to_vec();
    let style = edits.iter().find_map(|edit| if let Edit::Cells(style) = edit { *style } else { None });
    let Some(Colouring::Scale(scale)) = style.map(|style| style.style.colouring) else { panic!("a scale") };
    assert_eq!(values.len(), regions.len());
    for (value, region) in values.iter().zip(&regions) {
        let bytes = scale.colour(*value).map(|c| (c * 255.0).round() as u8);
        assert_eq!(bytes, region_color(colors[usize::from(*region)]));
    }
    drop(edits);
    assert!(list.legend().is_none(), "the colours mean no values");
    // Without regions it is the field.
    let mut list = scene(&by_cell);
    follow(&mut list, &mut opened(), &mut Drawn::default());
    assert_eq!(list.legend().map(|legend| legend.label.as_str()), Some("f0"));
    let (mut list, mut session) = (scene(&state), opened());
    let mut drawn = Drawn::default();
    follow(&mut list, &mut session, &mut drawn);
    assert_eq!((drawn.surfaces.len(), list.legend().is_some()), (1, true));
}
