//! A scene: what is shown of a session's mesh, kept up to date with it, as a list of what is to be [drawn](crate::draw).
//!
//! [`SceneState`] says what is shown, as plain data. [`Scene::update`] computes what is out of date, and lists what has changed;
//! nothing is computed that is not shown. Nothing here knows what draws: [`SceneRenderer`](crate::SceneRenderer) hands the lists to
//! the [renderer](crate::gpu).

mod error;
mod input;
mod kept;
mod labels;
mod legend;
mod moves;
mod objects;
mod pick;
mod state;
mod styles;

pub use error::SceneError;
#[doc(hidden)]
pub use kept::OtherMesh;
pub use legend::Legend;
#[doc(hidden)]
pub use state::RegionName;
pub use state::{
    ArrowState, Background, BoundaryState, CellKind, CellState, Colour, ColourBy, ColourState, CompareState,
    DeformState, IsosurfaceState, MapName, PlaneState, SceneState, SliceState, StreamlineState,
    ThresholdState, VolumeState,
};

use crate::draw::{BoxLines, Edit, Look, MOST_CLIPS};
use glam::DVec3;
use input::Current;
use kept::{Kept, KeptMesh};
use moves::deformation;
use objects::Objects;
use styles::clips;
use styles::{quantity, scale};
use tetralod::geom::{Bounds, Camera, Ray};
use tetralod::mt::numbers_of;
use tetralod::session::{Deformation, Session, SessionError, Within};
use tetralod::view::{MeshView, Place, Probe};

/// The outline of the domain, on a dark and on a light background.
const OUTLINE: [[f32; 4]; 2] = [[0.85, 0.9, 1.0, 0.35], [0.25, 0.28, 0.33, 0.6]];
const REGION: [f32; 4] = [0.36, 0.86, 1.0, 1.0];

/// What is shown of a session's mesh.
#[derive(Debug)]
pub struct Scene {
    state: SceneState,
    current: Current,
    objects: Objects,
    kept: Option<Kept>,
    /// The box around the reference mesh, once it is known.
    bounds: Option<Bounds>,
    look: Look,
    /// How the volume is displaced, as of the last update.
    deformation: Option<Deformation>,
    /// Whether the state has changed since the last update.
    is_stale: bool,
    /// Whether nothing of it has changed but how far things are displaced.
    is_moved: bool,
}

/// What [`Scene::update`] has found.
#[derive(Debug)]
#[must_use = "the scene takes it as drawn"]
#[doc(hidden)]
pub struct Update<'a> {
    /// What is to be drawn otherwise, in this order.
    pub edits: Vec<Edit<'a>>,
    /// Whether a new picture is due. If the state names what the volume does not have, the error says so, and the edits are those
    /// of what comes before it.
    pub changed: Result<bool, SceneError>,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            state: SceneState::default(),
            current: Current::default(),
            objects: Objects::default(),
            kept: None,
            bounds: None,
            look: Look::default(),
            deformation: None,
            is_stale: true,
            is_moved: false,
        }
    }
}

impl Scene {
    /// What draws has nothing any more, as when its device is lost: the next update computes and lists everything.
    pub fn start_over(&mut self) {
        self.objects = Objects::default();
        if let Some(kept) = &mut self.kept {
            kept.objects = Objects::default();
        }
        self.is_stale = true;
    }

    /// Some of the last edits could not be drawn: surfaces are listed whole the next time that they are.
    pub fn lose_surfaces(&mut self) {
        self.objects.lose_surfaces();
        if let Some(kept) = &mut self.kept {
            kept.objects.lose_surfaces();
        }
    }

    /// Keeps a copy of the mesh as it is, with all of its fields, to be compared with later ones: see
    /// [`SceneState::compare`]. It takes the place of one that was kept before, which is not to be drawn any more.
    ///
    /// # Errors
    /// If nothing has arrived yet.
    pub fn keep(&mut self, session: &mut Session) -> Result<Edit<'static>, SceneError> {
        self.kept = Some(Kept { mesh: KeptMesh::of(session)?, objects: Objects::default() });
        self.is_stale = true;
        Ok(Edit::Beside { split: 0.0, edits: Vec::new() })
    }

    /// Keeps a mesh of another file in place of one that was kept: nothing but the difference to it can be shown, of fields that it has.
    ///
    /// # Errors
    /// If nothing has arrived yet, or if the mesh is none.
    #[doc(hidden)]
    pub fn keep_other(&mut self, session: &Session, other: OtherMesh) -> Result<Edit<'static>, SceneError> {
        let info = session.info().ok_or(SessionError::NotReady)?;
        self.kept = Some(Kept { mesh: KeptMesh::of_other(info, other)?, objects: Objects::default() });
        self.is_stale = true;
        Ok(Edit::Beside { split: 0.0, edits: Vec::new() })
    }

    /// What is shown.
    pub fn state(&self) -> &SceneState {
        &self.state
    }

    /// Changes what is shown, from the next [`Scene::update`] on.
    ///
    /// # Errors
    /// If a part of it makes no sense whatever the volume is; then nothing changes.
    pub fn set_state(&mut self, state: SceneState) -> Result<(), SceneError> {
        check(&state)?;
        let before = std::mem::replace(&mut self.state, state);
        // How far things are displaced is up to the renderer alone: nothing is computed again.
        if before != self.state && at_rest(&before) == at_rest(&self.state) {
            self.is_moved = true;
        } else {
            self.is_stale = true;
        }
        Ok(())
    }

    /// Pixels of the target per unit of the page's layout.
    pub fn set_pixel_ratio(&mut self, ratio: f32) {
        self.look.pixel_ratio = if ratio.is_finite() { ratio.clamp(0.25, 8.0) } else { 1.0 };
    }

    /// Another session comes: forgets the mesh of the last one, and what is drawn of it. The state stays.
    pub fn forget(&mut self) -> Edit<'static> {
        self.bounds = None;
        self.is_stale = true;
        self.kept = None;
        self.objects = Objects::default();
        Edit::Clear
    }

    /// The box around the reference mesh, which all meshes are in; none until the base mesh is there.
    pub fn bounds(&self) -> Option<&Bounds> {
        self.bounds.as_ref()
    }

    /// What the colours mean, if anything is coloured by values.
    pub fn legend(&self) -> Option<&Legend> {
        self.objects.legend()
    }

    /// The appearance of the picture, as of the last update.
    pub fn look(&self) -> &Look {
        &self.look
    }

    /// Looks up the box around the session's mesh if that is there for the first time; whether it is. [`Scene::update`] does so, too.
    pub fn meet(&mut self, session: &mut Session) -> bool {
        if self.bounds.is_some() || session.info().is_none() {
            return false;
        }
        self.bounds = session.bounds();
        self.is_stale = true;
        true
    }

    /// The regions of the session's volume that the state shows, as a request takes them; none if all are, or the base mesh is not there.
    ///
    /// # Errors
    /// If there is no such region.
    pub fn shown_regions(&self, session: &Session) -> Result<Option<Vec<u16>>, SceneError> {
        let (Some(names), Some(_)) = (&self.state.regions, session.info()) else { return Ok(None) };
        let names: Vec<String> = names.iter().map(RegionName::to_string).collect();
        let error = |(place, problem)| SceneError::state(format!("regions[{place}]"), problem);
        numbers_of(session.regions(), &names).map(Some).map_err(error)
    }

    /// What the threshold shows.
    fn within(&self, session: &Session) -> Result<Option<Within>, SceneError> {
        let (Some(threshold), Some(info)) = (&self.state.threshold, session.info()) else { return Ok(None) };
        let field = input::field_number(info, session.field(), "threshold.field", threshold.field.as_ref())?;
        let (name, is_label) = (&info.fields[field].name, info.fields[field].is_label);
        if threshold.cut && is_label {
            let problem =
                format!("'{name}' is a label: nothing can be cut between two labels; leave `cut` out");
            return Err(SceneError::state("threshold.cut", problem));
        }
        Ok(Some(Within { field, range: threshold.range, is_cut: threshold.cut }))
    }

    /// Brings what is shown up to date with the session's mesh, and lists what is to be drawn otherwise than before.
    pub fn update<'a>(&'a mut self, session: &'a mut Session) -> Update<'a> {
        let mut edits = Vec::new();
        let changed = self.list(session, &mut edits);
        Update { edits, changed }
    }

    fn list<'a>(
        &'a mut self,
        session: &'a mut Session,
        edits: &mut Vec<Edit<'a>>,
    ) -> Result<bool, SceneError> {
        self.meet(session);
        let (is_stale, is_moved) = (std::mem::take(&mut self.is_stale), std::mem::take(&mut self.is_moved));
        if session.info().is_none() {
            // The background is there before the volume.
            let Look { pixel_ratio, .. } = self.look;
            self.look = Look { pixel_ratio, ..look(&self.state, &Bounds::EMPTY) };
            return Ok(is_stale);
        }
        let shown = self.shown_regions(session)?;
        session.show_regions(shown.as_deref());
        session.show_within(self.within(session)?);
        let Some(info) = session.info() else { return Ok(is_stale) };
        let points = info.single_points();
        let bounds = self.bounds.unwrap_or(Bounds::EMPTY);
        let Self { state, current, objects, kept, look, .. } = self;
        let state = &*state;
        // Where there is no such vector, the objects say so.
        self.deformation = deformation(state, info, session.field(), &bounds).ok().flatten();
        look.moved = self.deformation.map_or(0.0, |deformation| deformation.reach());
        // Before anything is stored.
        let first = || [Edit::Points(points), Edit::Boxes(boxes(state, &bounds))];
        if is_stale {
            edits.extend(first());
            let Look { pixel_ratio, moved, .. } = *look;
            *look = Look { pixel_ratio, moved, ..self::look(state, &bounds) };
        }
        if !current.take(session, state, is_stale)? {
            return Ok(is_moved);
        }
        let session = &*session;
        let (Some(info), field) = (session.info(), session.field()) else { return Ok(is_stale) };
        let compare = state.compare.unwrap_or(CompareState { at: 0.0, difference: false });
        let other = kept.as_ref().filter(|_| compare.difference);
        current.compare(&session.last_view(), other.and_then(|kept| kept.mesh.compared(field)));
        let opacities = input::region_opacities(state, session.regions())?;
        let looks = || (state, opacities.clone());
        objects.list(&current.input(session, info, looks(), bounds), is_stale, edits)?;
        if is_stale {
            let kept = kept.as_mut().filter(|kept| compare.at > 0.0 && kept.mesh.is_own());
            let split = if kept.is_some() { compare.at } else { 0.0 };
            let mut left = Vec::new();
            let listed = kept.map_or(Ok(()), |kept| {
                left.extend(first());
                kept.list(info, (field, session.first_isovalue(field)), looks(), bounds, &mut left)
            });
            edits.push(Edit::Beside { split, edits: left });
            listed?;
        }
        Ok(true)
    }

    /// The nearest point that is shown along a ray: of an isosurface, a slice, the boundary, a tetrahedron, a streamline, an
    /// arrow, or of the volume where half of the light is lost; none if there is none. It is a point of the model as it is, also where that is
    /// displaced.
    pub fn pick(&self, session: &mut Session, ray: &Ray) -> Option<[f64; 3]> {
        self.objects.pick(session, &self.state, &self.look, ray, &self.shown_bounds(session)?)
    }

    /// Where a point of the model is shown: at another place if it is displaced. None outside of the session's mesh.
    pub fn shown(&self, session: &mut Session, point: [f64; 3]) -> Option<[f64; 3]> {
        let mesh = session.view();
        let Some(moved) = self.objects.moved_points(&mesh, self.look.moved) else { return Some(point) };
        let place = Probe::new(mesh).locate(point)?;
        Some(place.position(&MeshView { positions: &moved, ..mesh }))
    }

    /// The box that all is shown in: [`Scene::bounds`], or with what is displaced, at all phases. By the ranges of the vector's components,
    /// so it is the same for all meshes.
    pub fn shown_bounds(&self, session: &Session) -> Option<Bounds> {
        let (bounds, info) = (self.bounds?, session.info()?);
        let deformation = deformation(&self.state, info, session.field(), &bounds).ok().flatten();
        let swings = self.state.deform.as_ref().is_some_and(|deform| deform.phase.is_some());
        Some(deformation.map_or(bounds, |deformation| deformation.bounds(info, swings, &bounds)))
    }

    /// How things are displaced, as of the last update; none if they are not.
    pub fn deformation(&self) -> Option<&Deformation> {
        self.deformation.as_ref()
    }

    /// Where in the session's mesh the eye is, if a volume is shown: that mesh, and the place unless it is outside.
    pub fn eye<'a>(
        &self,
        session: &'a mut Session,
        camera: &Camera,
    ) -> Option<(MeshView<'a>, Option<Place>)> {
        let (Some(_), Some(bounds)) = (&self.state.volume, self.shown_bounds(session)) else { return None };
        let eye = camera.rays(1.0).origin[0];
        let mesh = session.view();
        let is_near = eye.cmpge(DVec3::from(bounds.min)).all() && eye.cmple(DVec3::from(bounds.max)).all();
        let place = is_near.then(|| {
            let moved = self.objects.moved_points(&mesh, self.look.moved);
            let positions = moved.as_deref().unwrap_or(mesh.positions);
            Probe::new(MeshView { positions, ..mesh }).locate(eye.into())
        });
        Some((mesh, place.flatten()))
    }
}

/// What makes no sense whatever the volume is.
fn check(state: &SceneState) -> Result<(), SceneError> {
    let clips = state.clips.iter().enumerate().map(|(i, clip)| (format!("clips[{i}]"), *clip));
    let slices = state.slices.iter().enumerate().map(|(i, slice)| (format!("slices[{i}]"), slice.plane()));
    let cut = state.cells.as_ref().and_then(|cells| cells.cut).map(|cut| ("cells.cut".to_owned(), cut));
    if let Some((what, plane)) = clips.chain(slices).chain(cut).find(|(_, plane)| !plane.is_plane()) {
        let PlaneState { normal, offset } = plane;
        let problem = format!(
            "must have a `normal` of three numbers, not all 0, and an `offset`; given: {normal:?}, {offset}"
        );
        return Err(SceneError::state(what, problem));
    }
    for (what, corners) in [("clipBox", &state.clip_box), ("region", &state.region)] {
        if corners.as_ref().is_some_and(|corners| state::bounds(corners).is_none()) {
            let problem =
                "must be six numbers, x0, y0, z0, x1, y1, z1, each of the first at most that of the last";
            return Err(SceneError::state(what, problem));
        }
    }
    if state.compare.is_some_and(|compare| !(0.0..=1.0).contains(&compare.at)) {
        return Err(SceneError::state("compare.at", "must be a fraction of the width, 0 to 1"));
    }
    let planes = state.clips.len() + if state.clip_box.is_some() { 6 } else { 0 };
    if planes > MOST_CLIPS {
        let problem =
            format!("at most {MOST_CLIPS} planes can cut, of which a box takes six; given: {planes}");
        return Err(SceneError::state("clips", problem));
    }
    let ascends = |[low, high]: [f64; 2]| low <= high;
    if state.threshold.as_ref().is_some_and(|threshold| !ascends(threshold.range)) {
        return Err(SceneError::state("threshold.range", "must be two numbers that ascend, [low, high]"));
    }
    if state.isosurfaces.iter().any(|surface| surface.value.is_some_and(|value| !value.is_finite())) {
        return Err(SceneError::state("isosurfaces", "values must be finite numbers"));
    }
    if let Some(cells) = &state.cells {
        quantity(cells)?;
    }
    if state.colours.bands.is_some_and(|bands| !(2..=64).contains(&bands)) {
        return Err(SceneError::state("colours.bands", "must be a number of colours, 2 to 64"));
    }
    if let Some(range) = state.colours.range {
        scale(&state.colours, Some(range), range)?;
    }
    check_numbers(state)?;
    check_volume(state)
}

/// A state that shows the same, displaced otherwise.
fn at_rest(state: &SceneState) -> SceneState {
    SceneState { deform: state.deform.as_ref().map(DeformState::at_rest), ..state.clone() }
}

/// Numbers that are to be drawn with: finite, and lengths positive.
fn check_numbers(state: &SceneState) -> Result<(), SceneError> {
    let (tubes, arrows) = (state.streamlines.as_ref(), state.arrows.as_ref());
    let lengths = [
        ("streamlines.radius", tubes.and_then(|tubes| tubes.radius)),
        ("arrows.spacing", arrows.and_then(|arrows| arrows.spacing)),
        ("volume.unitLength", state.volume.as_ref().and_then(|volume| volume.unit_length)),
    ];
    let is_length = |length: f64| length.is_finite() && length > 0.0;
    if let Some((what, _)) =
        lengths.iter().find(|(_, length)| length.is_some_and(|length| !is_length(length)))
    {
        return Err(SceneError::state(*what, "must be a positive number"));
    }
    if tubes.is_some_and(|tubes| tubes.seeds.as_flattened().iter().any(|x| !x.is_finite())) {
        return Err(SceneError::state("streamlines.seeds", "must be points of three finite numbers"));
    }
    let cells =
        state.cells.as_ref().map(|cells| [("cells.shrink", cells.shrink), ("cells.width", cells.width)]);
    let opacities = state.isosurfaces.iter().map(|surface| ("isosurfaces", surface.opacity));
    let opacities = opacities.chain(state.slices.iter().map(|slice| ("slices", slice.opacity)));
    let opacities = opacities.chain(state.boundary.as_ref().map(|boundary| ("boundary", boundary.opacity)));
    let of_regions = state.boundary.iter().flat_map(|boundary| boundary.region_opacities.values());
    let opacities = opacities.chain(of_regions.map(|opacity| ("boundary.regionOpacities", *opacity)));
    let deform = state.deform.as_ref();
    let deform = [
        ("deform.factor", deform.and_then(|deform| deform.factor)),
        ("deform.phase", deform.and_then(|deform| deform.phase)),
    ];
    let deform = deform.into_iter().filter_map(|(what, number)| Some((what, number?)));
    let numbers = opacities.chain(cells.into_iter().flatten()).chain(deform);
    let mut numbers = numbers.chain([("shade", state.shade)]);
    match numbers.find(|(_, number)| !number.is_finite()) {
        Some((what, number)) => {
            Err(SceneError::state(what, format!("must be a finite number, not {number}")))
        }
        None => Ok(()),
    }
}

fn check_volume(state: &SceneState) -> Result<(), SceneError> {
    let Some(volume) = &state.volume else { return Ok(()) };
    let values: Vec<f64> =
        volume.opacities.iter().map(|p| p[0]).chain(volume.points.iter().map(|p| p[0])).collect();
    let of_points = volume.points.iter().flatten().chain(volume.opacities.iter().flatten());
    if !of_points.into_iter().all(|x| x.is_finite()) {
        return Err(SceneError::state("volume", "values and opacities must be finite numbers"));
    }
    if !values.is_sorted() || !volume.opacities.is_empty() && !volume.points.is_empty() {
        let problem = "give `opacities` or `points`, not both, with ascending values";
        return Err(SceneError::state("volume", problem));
    }
    Ok(())
}

fn look(state: &SceneState, bounds: &Bounds) -> Look {
    let (sky, ground) = match state.background {
        Background::Dark => (Look::default().sky, Look::default().ground),
        Background::Light => ([0.985, 0.985, 0.99, 1.0], [0.93, 0.935, 0.945, 1.0]),
        Background::Transparent => ([0.0; 4], [0.0; 4]),
    };
    let shade = [state.shade.clamp(0.0, 1.0) as f32, (0.05 * bounds.diagonal()) as f32];
    Look { sky, ground, clips: clips(state), shade, ..Look::default() }
}

fn boxes(state: &SceneState, bounds: &Bounds) -> Vec<BoxLines> {
    let colour = OUTLINE[usize::from(state.background != Background::Dark)];
    let outline = BoxLines { bounds: *bounds, colour, width: 1.0, handles: false };
    let region = state.region.as_ref().and_then(state::bounds);
    let region = region.map(|bounds| BoxLines { bounds, colour: REGION, width: 2.0, handles: true });
    state.outline.then_some(outline).into_iter().chain(region).collect()
}
