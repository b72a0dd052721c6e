//! What is computed from the mesh for a scene: surfaces, sections, tubes, values of tetrahedra.

use super::state::{ArrowState, ColourState, StreamlineState};
use super::styles::{cell_style, clips, isosurface_style, medium, other_clips, quantity, range, scale};
use super::{Legend, SceneError, SceneState, SliceState};
use crate::gpu::{Colouring, EdgeLook, Lighting, Renderer, Style};
use std::borrow::Cow;
use tetralod::geom::{Bounds, SingleValues};
use tetralod::mt::{MeshChanges, MtInfo};
use tetralod::session::{Session, TetQuantity};
use tetralod::view::{
    ArrowLength, ArrowOptions, BoundarySurface, ClipPlane, ColourScale, Difference, IsoSurface, MeshView,
    Slice, Solids, TraceOptions, Tracer, Triangles, TubeOptions,
};

/// Numbers of surfaces in the renderer: those of lists begin at these.
const ISOSURFACES: u32 = 0;
const SLICES: u32 = 1 << 16;
const CAPS: u32 = 2 << 16;
const BOUNDARY: u32 = 3 << 16;
const TUBES: u32 = BOUNDARY + 1;
const ARROWS: u32 = BOUNDARY + 2;

/// The objects of a scene, with the memory to compute them again.
#[derive(Debug, Default)]
pub(super) struct Objects {
    pub(super) isosurfaces: Vec<Isosurface>,
    slice: Slice,
    pub(super) boundary: BoundarySurface,
    pub(super) tubes: Solids,
    pub(super) arrows: Solids,
    /// A number for each tetrahedron.
    pub values: Vec<f64>,
    /// How many surfaces of each list the renderer has.
    slices: u32,
    caps: u32,
    legend: Option<Legend>,
    /// Whether the mesh of the renderer has the difference to another mesh in place of its field.
    shows_difference: bool,
}

#[derive(Debug, Default)]
pub(super) struct Isosurface {
    pub(super) surface: IsoSurface,
    /// Whether the renderer has all of it, so that changes are enough.
    is_whole: bool,
}

/// What is to be shown of a session's mesh.
pub(super) struct Shown<'a> {
    pub state: &'a SceneState,
    pub bounds: &'a Bounds,
    /// The mesh whose field is taken from that of the session's.
    pub other: Option<MeshView<'a>>,
}

impl Shown<'_> {
    /// What colours tetrahedra; none for the field.
    fn quantity(&self) -> Result<Option<TetQuantity>, SceneError> {
        self.state.cells.as_ref().map_or(Ok(None), quantity)
    }
}

/// What an update reads.
pub(super) struct Input<'a> {
    /// The mesh whose field colours things: a field of its own, or the difference to another mesh.
    pub mesh: MeshView<'a>,
    /// The field of the mesh, which isosurfaces follow.
    pub field: &'a [f64],
    /// The largest absolute value of the difference, if that is shown.
    pub largest_difference: Option<f64>,
    pub fields: &'a dyn Fn(usize) -> Vec<f64>,
    pub info: &'a MtInfo,
    /// The number of the field.
    pub shown: usize,
    pub state: &'a SceneState,
    pub bounds: &'a Bounds,
    pub changes: &'a MeshChanges,
}

impl Input<'_> {
    /// The number of the field with a name, of the time step that is shown if it has that; that of the mesh without one.
    fn field(&self, what: &str, name: Option<&String>) -> Result<usize, SceneError> {
        let Some(name) = name else { return Ok(self.shown) };
        let time = self.info.fields[self.shown].time;
        let all = || self.info.fields.iter().enumerate().filter(|(_, field)| field.name == *name);
        let found = all().find(|(_, field)| field.time == time).or_else(|| all().next());
        found.map(|(number, _)| number).ok_or_else(|| {
            let names = self.info.fields.iter().map(|field| field.name.as_str()).collect::<Vec<_>>();
            let problem = format!("there is no field {name:?}; this volume has: {}", names.join(", "));
            SceneError::state(what, problem)
        })
    }

    /// The colours of a field; the range of the state is for the field that is shown.
    fn scale(&self, field: usize) -> Result<ColourScale, SceneError> {
        if let Some(largest) = self.largest_difference.filter(|_| field == self.shown) {
            let most = if largest > 0.0 { largest } else { 1.0 };
            return scale(&ColourState { log: false, ..self.state.colours.clone() }, None, [-most, most]);
        }
        let own = self.info.range_at_all_times(field);
        scale(&self.state.colours, if field == self.shown { self.state.colours.range } else { None }, own)
    }

    /// How the renderer stores the values of a field, or the difference.
    fn single(&self, field: usize) -> SingleValues {
        match self.largest_difference.filter(|_| field == self.shown) {
            Some(largest) => SingleValues::of([-largest, largest], 0.0),
            None => self.info.fields[field].single_values(),
        }
    }

    /// From 0 to the largest length that the components of a vector allow at any time: whatever is drawn of it has the same colours.
    fn lengths(&self, names: &[String; 3]) -> [f64; 2] {
        let largest = |name: &String| {
            let steps = self.info.fields.iter().filter(|step| step.name == *name);
            steps.fold(0.0_f64, |most, step| most.max(step.min.abs()).max(step.max.abs()))
        };
        [0.0, names.iter().map(largest).fold(0.0, f64::hypot)]
    }

    /// What colours by a field: its values, or the difference.
    fn values(&self, field: usize) -> Cow<'_, [f64]> {
        let is_difference = field == self.shown && self.largest_difference.is_some();
        if is_difference { self.mesh.field.into() } else { (self.fields)(field).into() }
    }

    fn vectors(&self, what: &str, names: &[String; 3]) -> Result<[Vec<f64>; 3], SceneError> {
        let mut found = [0; 3];
        for (place, name) in found.iter_mut().zip(names) {
            *place = self.field(what, Some(name))?;
        }
        Ok(found.map(|field| (self.fields)(field)))
    }

    fn diagonal(&self) -> f64 {
        self.bounds.diagonal()
    }
}

impl Objects {
    pub(super) fn legend(&self) -> Option<&Legend> {
        self.legend.as_ref()
    }

    pub(super) fn clear(&mut self, renderer: &mut Renderer) -> Result<(), SceneError> {
        let isosurfaces = ISOSURFACES..ISOSURFACES + self.isosurfaces.len() as u32;
        let lists = isosurfaces.chain(SLICES..SLICES + self.slices).chain(CAPS..CAPS + self.caps);
        lists.chain([BOUNDARY, TUBES, ARROWS]).for_each(|key| renderer.remove_surface(key));
        renderer.set_volume(None)?;
        renderer.set_cells(None);
        *self = Self::default();
        Ok(())
    }

    /// Computes what has changed; whether anything has.
    pub(super) fn update(
        &mut self,
        renderer: &mut Renderer,
        session: &mut Session,
        shown: &Shown<'_>,
        is_stale: bool,
    ) -> Result<bool, SceneError> {
        let mut changes = session.take_changes();
        let is_moved = !changes.vertices.is_empty() || !changes.tets.is_empty();
        if !is_moved && !is_stale {
            return Ok(false);
        }
        if let Some(quantity) = shown.quantity()? {
            session.tet_quantity_into(quantity, &mut self.values)?;
        }
        let field = session.field();
        let session = &*session;
        let (mesh, Some(info)) = (session.last_view(), session.info()) else { return Ok(false) };
        let difference = shown.other.as_ref().and_then(|other| Difference::of(&mesh, *other));
        if self.shows_difference || difference.is_some() {
            // Each point has another value.
            changes.vertices = MeshChanges::of_all_vertices(mesh.positions.len()).vertices;
        }
        self.shows_difference = difference.is_some();
        let fields = |field| session.values(field);
        let (values, largest) = difference.map(|of| (of.values, of.largest)).unzip();
        let coloured = MeshView { field: values.as_deref().unwrap_or(mesh.field), ..mesh };
        let input = Input {
            state: shown.state,
            bounds: shown.bounds,
            mesh: coloured,
            field: mesh.field,
            largest_difference: largest,
            fields: &fields,
            info,
            shown: field,
            changes: &changes,
        };
        self.update_from(renderer, &input, is_stale)?;
        Ok(true)
    }

    /// Computes what has changed of one mesh; the values of its tetrahedra are there if they are shown.
    pub(super) fn update_from(
        &mut self,
        renderer: &mut Renderer,
        input: &Input<'_>,
        is_stale: bool,
    ) -> Result<(), SceneError> {
        let is_stored_anew = renderer.set_values(input.single(input.shown));
        self.update_cells(renderer, input)?;
        self.update_volume(renderer, input, is_stale || is_stored_anew)?;
        let MeshChanges { vertices, tets } = input.changes;
        renderer.update_mesh(&input.mesh, Some([vertices, tets]))?;
        self.update_isosurfaces(renderer, input)?;
        self.update_slices(renderer, input)?;
        self.update_boundary(renderer, input)?;
        self.update_legend(input)?;
        self.update_streamlines(renderer, input)?;
        self.update_arrows(renderer, input)
    }

    fn update_volume(
        &mut self,
        renderer: &mut Renderer,
        input: &Input<'_>,
        is_stale: bool,
    ) -> Result<(), SceneError> {
        // The colours of a difference are those of its range, which changes with the mesh.
        if !is_stale && input.largest_difference.is_none() {
            return Ok(());
        }
        let Some(volume) = &input.state.volume else { return Ok(renderer.set_volume(None)?) };
        let medium = medium(volume, &input.scale(input.shown)?, input.diagonal());
        Ok(renderer.set_volume(Some((&medium, if volume.clipped { u32::MAX } else { 0 })))?)
    }

    fn update_isosurfaces(&mut self, renderer: &mut Renderer, input: &Input<'_>) -> Result<(), SceneError> {
        let MeshChanges { vertices, tets } = input.changes;
        let mesh = MeshView { field: input.field, ..input.mesh };
        let wanted = input.state.isosurfaces.len();
        for gone in wanted..self.isosurfaces.len() {
            renderer.remove_surface(ISOSURFACES + gone as u32);
        }
        self.isosurfaces.resize_with(wanted, Isosurface::default);
        let [low, high] = input.info.range_at_all_times(input.shown);
        for (key, (own, state)) in
            (ISOSURFACES..).zip(self.isosurfaces.iter_mut().zip(&input.state.isosurfaces))
        {
            let value = state.value.unwrap_or_else(|| f64::midpoint(low, high));
            own.surface.update(&mesh, &[value], vertices, tets);
            let changes = own.surface.take_changes();
            let is_coloured = state.field.is_some() || input.largest_difference.is_some();
            let coloured =
                is_coloured.then(|| input.field("isosurfaces", state.field.as_ref())).transpose()?;
            let values = coloured.map(|field| own.surface.interpolate(&mesh, &input.values(field)));
            let is_whole = std::mem::replace(&mut own.is_whole, false) && values.is_none();
            let mut triangles = Triangles::from(&own.surface);
            triangles.values = values.as_deref().unwrap_or_default();
            triangles.single = coloured.map_or(SingleValues::PLAIN, |field| input.single(field));
            renderer.set_surface(key, &triangles, is_whole.then_some(&changes))?;
            own.is_whole = values.is_none();
            let scale = coloured.map(|field| input.scale(field)).transpose()?;
            renderer.set_style(key, &isosurface_style(state, scale));
        }
        Ok(())
    }

    fn update_slices(&mut self, renderer: &mut Renderer, input: &Input<'_>) -> Result<(), SceneError> {
        for (key, slice) in (SLICES..).zip(&input.state.slices) {
            self.update_slice(renderer, input, key, slice)?;
        }
        let count = input.state.slices.len() as u32;
        (count..self.slices).for_each(|gone| renderer.remove_surface(SLICES + gone));
        self.slices = count;
        Ok(())
    }

    fn update_slice(
        &mut self,
        renderer: &mut Renderer,
        input: &Input<'_>,
        key: u32,
        slice: &SliceState,
    ) -> Result<(), SceneError> {
        let field = input.field("slices", slice.field.as_ref())?;
        let plane = slice.plane();
        self.slice.extract(&input.mesh, &plane.plane());
        let values =
            (field != input.shown).then(|| self.slice.interpolate(&input.mesh, &(input.fields)(field)));
        let inner: Vec<u8> = self.slice.cell_sides().iter().map(|sides| !sides & 7).collect();
        let mut triangles = Triangles { inner_sides: &inner, ..Triangles::from(&self.slice) };
        triangles.values = values.as_deref().unwrap_or(triangles.values);
        triangles.single = input.single(field);
        renderer.set_surface(key, &triangles, None)?;
        let style = Style {
            colouring: Colouring::Scale(input.scale(field)?),
            opacity: slice.opacity as f32,
            lighting: Lighting::None,
            edges: slice.edges.then(EdgeLook::default),
            clips: if slice.clipped { other_clips(&clips(input.state), &plane.clip()) } else { 0 },
        };
        renderer.set_style(key, &style);
        Ok(())
    }

    fn update_boundary(&mut self, renderer: &mut Renderer, input: &Input<'_>) -> Result<(), SceneError> {
        let (had, all) = (self.caps, clips(input.state));
        let Some(boundary) = &input.state.boundary else {
            renderer.remove_surface(BOUNDARY);
            (0..had).for_each(|gone| renderer.remove_surface(CAPS + gone));
            self.caps = 0;
            return Ok(());
        };
        self.boundary.extract(&input.mesh);
        let triangles = Triangles { single: input.single(input.shown), ..Triangles::from(&self.boundary) };
        renderer.set_surface(BOUNDARY, &triangles, None)?;
        let scale = Colouring::Scale(input.scale(input.shown)?);
        let style = Style {
            colouring: boundary.colour.map_or(scale, |colour| Colouring::Sides([colour.rgb(); 2])),
            opacity: boundary.opacity as f32,
            lighting: Lighting::Flat,
            edges: boundary.edges.then(EdgeLook::default),
            clips: if boundary.clipped { u32::MAX } else { 0 },
        };
        renderer.set_style(BOUNDARY, &style);
        // What the planes cut open is closed.
        let closed = if boundary.clipped { all.as_slice() } else { &[] };
        for (key, clip) in (CAPS..).zip(closed) {
            let ClipPlane { normal, offset } = *clip;
            let cap = SliceState {
                normal,
                offset,
                opacity: boundary.opacity,
                edges: boundary.edges,
                field: None,
                clipped: true,
            };
            self.update_slice(renderer, input, key, &cap)?;
        }
        self.caps = closed.len() as u32;
        (self.caps..had).for_each(|gone| renderer.remove_surface(CAPS + gone));
        Ok(())
    }

    fn update_cells(&mut self, renderer: &mut Renderer, input: &Input<'_>) -> Result<(), SceneError> {
        let Some(cells) = &input.state.cells else {
            renderer.set_cells(None);
            return Ok(());
        };
        let quantity = quantity(cells)?;
        let scale = match quantity {
            Some(_) => {
                renderer.set_cell_values(&self.values)?;
                scale(&input.state.colours, None, range(&self.values))?
            }
            None => input.scale(input.shown)?,
        };
        self.legend = quantity.map(|quantity| Legend { label: quantity.name().to_owned(), scale });
        renderer.set_cells(Some(&cell_style(cells, scale, quantity.is_some())));
        Ok(())
    }

    fn update_streamlines(&mut self, renderer: &mut Renderer, input: &Input<'_>) -> Result<(), SceneError> {
        let Some(state) = &input.state.streamlines else {
            renderer.remove_surface(TUBES);
            return Ok(());
        };
        let StreamlineState { fields, seeds, radius, field } = state;
        let vectors = input.vectors("streamlines.fields", fields)?;
        let mut tracer = Tracer::new(input.mesh, [&vectors[0], &vectors[1], &vectors[2]]);
        let length = 4.0 * input.diagonal();
        let mut lines = Vec::new();
        for seed in seeds {
            for backward in [false, true] {
                let options = TraceOptions { backward, max_length: length, ..TraceOptions::default() };
                lines.extend(tracer.trace(*seed, &options));
            }
        }
        let radius = radius.unwrap_or(input.diagonal() / 400.0);
        let options = TubeOptions { radius, ..TubeOptions::default() };
        let values = field.as_ref().map(|_| input.field("streamlines.field", field.as_ref())).transpose()?;
        match values {
            None => self.tubes.set_tubes(&lines, &options),
            Some(field) => {
                let numbers = (input.fields)(field);
                let mesh = MeshView { field: &numbers, ..input.mesh };
                self.tubes.set_tubes_with(&lines, &options, |point| point.place.value(&mesh));
            }
        }
        self.show_solids(renderer, input, TUBES, values, ("speed", input.lengths(fields)))
    }

    fn update_arrows(&mut self, renderer: &mut Renderer, input: &Input<'_>) -> Result<(), SceneError> {
        let Some(ArrowState { fields, spacing, field, constant }) = &input.state.arrows else {
            renderer.remove_surface(ARROWS);
            return Ok(());
        };
        let vectors = input.vectors("arrows.fields", fields)?;
        let values = field.as_ref().map(|_| input.field("arrows.field", field.as_ref())).transpose()?;
        let numbers = values.map(|field| (input.fields)(field));
        let options = ArrowOptions {
            spacing: spacing.unwrap_or(input.diagonal() / 20.0),
            length: if *constant { ArrowLength::Constant } else { ArrowLength::Magnitude },
        };
        let components = [vectors[0].as_slice(), &vectors[1], &vectors[2]];
        self.arrows.set_arrows(input.mesh, components, numbers.as_deref(), &options);
        self.show_solids(renderer, input, ARROWS, values, ("magnitude", input.lengths(fields)))
    }

    /// Draws the tubes or arrows, coloured by a field or by `own`, the name and the range of what they are made of.
    fn show_solids(
        &mut self,
        renderer: &mut Renderer,
        input: &Input<'_>,
        key: u32,
        field: Option<usize>,
        (own, lengths): (&str, [f64; 2]),
    ) -> Result<(), SceneError> {
        let solids = if key == TUBES { &self.tubes } else { &self.arrows };
        let single =
            field.map_or_else(|| SingleValues::of_values(&solids.values), |field| input.single(field));
        renderer.set_surface(key, &Triangles { single, ..Triangles::from(solids) }, None)?;
        let colours = match field {
            Some(field) => input.scale(field)?,
            None => scale(&input.state.colours, None, lengths)?,
        };
        renderer.set_style(key, &Style { colouring: Colouring::Scale(colours), ..Style::default() });
        let label = field.map_or(own, |field| &input.info.fields[field].name).to_owned();
        // Where nothing else is coloured by values, the legend is theirs.
        self.legend.get_or_insert(Legend { label, scale: colours });
        Ok(())
    }

    /// The legend of the field, unless tetrahedra have one of their own.
    fn update_legend(&mut self, input: &Input<'_>) -> Result<(), SceneError> {
        let state = input.state;
        if state.cells.as_ref().is_some_and(|cells| quantity(cells).is_ok_and(|found| found.is_some())) {
            return Ok(());
        }
        let is_mapped = state.volume.as_ref().is_some_and(|volume| volume.points.is_empty())
            || !state.slices.is_empty()
            || state.boundary.as_ref().is_some_and(|boundary| boundary.colour.is_none())
            || state.cells.is_some();
        let own = state.isosurfaces.iter().find_map(|surface| surface.field.as_ref());
        let is_mapped = is_mapped || input.largest_difference.is_some();
        let field = if is_mapped { Some(input.shown) } else { None };
        let field = match (field, own) {
            (None, Some(name)) => Some(input.field("isosurfaces", Some(name))?),
            (field, _) => field,
        };
        let legend = |field: usize| {
            let name = &input.info.fields[field].name;
            let is_difference = field == input.shown && input.largest_difference.is_some();
            let label = if is_difference { format!("difference of {name}") } else { name.clone() };
            input.scale(field).map(|scale| Legend { label, scale })
        };
        self.legend = field.map(legend).transpose()?;
        Ok(())
    }
}
