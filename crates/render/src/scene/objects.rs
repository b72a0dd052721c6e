//! What is computed from a mesh for a scene: surfaces, sections, tubes.

use super::error::Result;
use super::input::Input;
use super::labels;
use super::moves::Moves;
use super::state::{ArrowState, BoundaryState, Colour, ColourBy, IsosurfaceState, StreamlineState};
use super::styles::{cell_style, clips, isosurface_style, medium, other_clips, range, scale};
use super::{Legend, SliceState};
use crate::draw::{Colouring, EdgeLook, Edit, Lighting, Style};
use std::borrow::Cow;
use std::cmp::Ordering;
use tetralod::geom::{Bounds, SingleValues};
use tetralod::mesh::NONE;
use tetralod::mt::MeshChanges;
use tetralod::session::TetQuantity;
use tetralod::view::{
    ArrowLength, ArrowOptions, BoundarySurface, ClipPlane, FieldView, IsoSurface, LabelParts, MeshView,
    Slice, Slope, Solids, SurfaceChanges, TraceOptions, Tracer, Triangles, TubeOptions, region_color,
    region_scale,
};

/// Numbers of surfaces: those of lists begin at these.
const ISOSURFACES: u32 = 0;
const SLICES: u32 = 1 << 16;
const CAPS: u32 = 2 << 16;
const BOUNDARY: u32 = 3 << 16;
const TUBES: u32 = BOUNDARY + 1;
const ARROWS: u32 = BOUNDARY + 2;
const UNDEFORMED: u32 = BOUNDARY + 3;
/// The boundary where regions look different: one for each look.
const REGIONS: u32 = 4 << 16;

/// What the model without displacement looks like.
const GHOST: [f32; 3] = [0.62, 0.68, 0.76];
const GHOST_OPACITY: f32 = 0.25;

type Edits<'a> = Vec<Edit<'a>>;

/// What is shown of a mesh, with the memory to compute it again.
#[derive(Debug, Default)]
pub(super) struct Objects {
    pub(super) isosurfaces: Vec<Isosurface>,
    pub(super) slices: Vec<Section>,
    /// What closes the boundary where planes cut it open.
    pub(super) caps: Vec<Section>,
    pub(super) boundary: Displaced<BoundarySurface>,
    /// The boundary by what regions look like, if not all look the same.
    pub(super) groups: Vec<Group>,
    /// The boundary as it is without displacement.
    undeformed: BoundarySurface,
    pub(super) tubes: Displaced<Solids>,
    pub(super) arrows: Displaced<Solids>,
    /// Where the points of the mesh go.
    pub(super) moves: Vec<[f64; 3]>,
    /// The values of the colours of tetrahedra by the labels at their corners.
    cell_labels: Vec<f64>,
    legend: Option<Legend>,
    /// How the values of the mesh are stored where it is drawn.
    single: SingleValues,
}

/// A surface, and where its vertices go if the scene is displaced.
#[derive(Debug, Default)]
pub(super) struct Displaced<S> {
    pub(super) surface: S,
    pub(super) moves: Vec<[f64; 3]>,
    /// What is drawn of it where a label colours it.
    parts: LabelParts,
}

/// The boundary of all regions that look the same.
#[derive(Debug, Default)]
pub(super) struct Group {
    pub(super) opacity: f64,
    pub(super) boundary: Displaced<BoundarySurface>,
}

#[derive(Debug, Default)]
pub(super) struct Isosurface {
    pub(super) surface: IsoSurface,
    /// Where its vertices go if the scene is displaced, and how that changes around them.
    pub(super) moves: Vec<[f64; 3]>,
    pub(super) slopes: Vec<Slope>,
    /// What the last update has changed.
    changes: SurfaceChanges,
    /// The values of the field that colours it, if one does.
    values: Vec<f64>,
    /// What is drawn of it where that is a label.
    parts: LabelParts,
    /// Whether all of it is drawn, so that changes are enough.
    is_whole: bool,
}

#[derive(Debug, Default)]
pub(super) struct Section {
    pub(super) slice: Slice,
    /// Where its vertices go if the scene is displaced.
    pub(super) moves: Vec<[f64; 3]>,
    /// The values of another field than the one that is shown, if that colours it.
    values: Vec<f64>,
    inner_sides: Vec<u8>,
    /// What is drawn of it where a label colours it.
    parts: LabelParts,
}

impl Objects {
    pub(super) fn legend(&self) -> Option<&Legend> {
        self.legend.as_ref()
    }

    /// Some of what was listed is not drawn: it comes whole again.
    pub(super) fn lose_surfaces(&mut self) {
        self.isosurfaces.iter_mut().for_each(|own| own.is_whole = false);
    }

    /// Computes what has changed, and lists it.
    pub(super) fn list<'a>(
        &'a mut self,
        input: &Input<'a>,
        is_stale: bool,
        edits: &mut Edits<'a>,
    ) -> Result<()> {
        let Self {
            isosurfaces,
            slices,
            caps,
            boundary,
            groups,
            undeformed,
            tubes,
            arrows,
            moves,
            cell_labels,
            legend,
            single,
        } = self;
        labels::check(input)?;
        let by = &Moves::of(input)?;
        *moves = by.as_ref().map_or_else(Vec::new, Moves::at_points);
        let stored = input.single(input.shown);
        let is_stored_anew = std::mem::replace(single, stored) != stored;
        edits.push(Edit::Values(stored));
        list_cells(input, cell_labels, legend, edits)?;
        // The colours of a difference are those of its range, which changes with the mesh.
        if is_stale || is_stored_anew || input.largest_difference.is_some() {
            edits.push(volume(input)?);
        }
        let MeshChanges { vertices, tets } = input.changes;
        edits.push(Edit::Mesh(input.mesh, [vertices, tets]));
        edits.push(Edit::Moves(moves));
        list_each(isosurfaces, ISOSURFACES, &input.state.isosurfaces, edits, |own, key, state| {
            own.update(input, by, key, state)
        })?;
        list_each(slices, SLICES, &input.state.slices, edits, |own, key, state| {
            own.update(input, &input.mesh, by, key, state)
        })?;
        list_boundary((boundary, groups), caps, input, by, edits)?;
        list_undeformed(undeformed, input, edits);
        update_legend(legend, input)?;
        edits.push(streamlines(tubes, input, by, legend)?);
        edits.push(arrow_list(arrows, input, by, legend)?);
        Ok(())
    }
}

fn list_cells<'a>(
    input: &Input<'a>,
    cell_labels: &'a mut Vec<f64>,
    legend: &mut Option<Legend>,
    edits: &mut Edits<'a>,
) -> Result<()> {
    let Some(cells) = &input.state.cells else {
        edits.push(Edit::Cells(None));
        return Ok(());
    };
    let quantity = input.quantity()?;
    let has_labels = quantity.is_none() && input.is_label(input.shown);
    *cell_labels = if has_labels { labels::of_tets(input, input.shown) } else { Vec::new() };
    if quantity.is_some() || has_labels {
        edits.push(Edit::CellValues(if has_labels { cell_labels.as_slice() } else { input.tet_values }));
    }
    let scale = match quantity {
        Some(TetQuantity::Region) => region_scale(),
        Some(_) => scale(&input.state.colours, None, range(input.tet_values))?,
        None => input.scale(input.shown)?,
    };
    // Colours of regions mean no values.
    let named = quantity.filter(|quantity| *quantity != TetQuantity::Region);
    *legend = named.map(|quantity| Legend {
        label: quantity.name().to_owned(),
        scale,
        labels: Vec::new(),
        apart: 0,
    });
    edits.push(Edit::Cells(Some(cell_style(cells, scale, quantity.is_some() || has_labels))));
    Ok(())
}

fn volume<'a>(input: &Input<'a>) -> Result<Edit<'a>> {
    let Some(volume) = &input.state.volume else { return Ok(Edit::Volume(None)) };
    let medium = medium(volume, &input.scale(input.shown)?, input.diagonal());
    Ok(Edit::Volume(Some((medium, if volume.clipped { u32::MAX } else { 0 }))))
}

/// Makes a list so long; the surfaces that are gone, of those that begin at number `first`, are not drawn any more.
fn resize<T: Default>(own: &mut Vec<T>, count: usize, first: u32, edits: &mut Edits<'_>) {
    edits.extend((count..own.len()).map(|gone| Edit::Remove(first + gone as u32)));
    own.resize_with(count, T::default);
}

/// Lists a surface for each of `states`, from number `first` on.
fn list_each<'a, T: Default, S>(
    own: &'a mut Vec<T>,
    first: u32,
    states: &[S],
    edits: &mut Edits<'a>,
    update: impl Fn(&'a mut T, u32, &S) -> Result<Edit<'a>>,
) -> Result<()> {
    resize(own, states.len(), first, edits);
    for (key, (own, state)) in (first..).zip(own.iter_mut().zip(states)) {
        edits.push(update(own, key, state)?);
    }
    Ok(())
}

impl Isosurface {
    fn update<'a>(
        &'a mut self,
        input: &Input<'a>,
        by: &Option<Moves<'_>>,
        key: u32,
        state: &IsosurfaceState,
    ) -> Result<Edit<'a>> {
        let was_whole = std::mem::replace(&mut self.is_whole, false);
        let mesh = MeshView { field: input.field, ..input.mesh };
        let middle = || {
            let [low, high] = input.info.range_at_all_times(input.shown);
            f64::midpoint(low, high)
        };
        let value = state.value.or(input.isovalue).unwrap_or_else(middle);
        self.surface.set_regions(!input.regions.is_empty());
        self.surface.update(&mesh, &[value], &input.changes.vertices, &input.changes.tets);
        self.changes = self.surface.take_changes();
        let is_coloured = state.field.is_some() || input.largest_difference.is_some();
        let coloured = is_coloured.then(|| input.field("isosurfaces", state.field.as_ref())).transpose()?;
        let label = coloured.filter(|field| input.is_label(*field));
        let values = coloured.filter(|_| label.is_none());
        let values = values.map(|field| self.surface.interpolate(&mesh, &*input.values(field)));
        self.values = values.unwrap_or_default();
        let scale = coloured.map(|field| input.scale(field)).transpose()?;
        (self.moves, self.slopes) = by.as_ref().map_or_else(Default::default, |by| {
            let slopes = self.surface.slopes(&mesh, by.components()).into_iter();
            let moves = by.at(|component| self.surface.interpolate(&mesh, component));
            (moves, slopes.map(|slope| by.scaled(slope)).collect())
        });
        self.is_whole = coloured.is_none() && by.is_none();
        let parts = label
            .map(|field| labels::parts(&self.triangles(), &self.surface.edge_places(&mesh), input, field));
        self.parts = parts.unwrap_or_default();
        let own: &'a Self = self;
        let single = coloured.map_or(SingleValues::PLAIN, |field| input.single(field));
        let triangles = match label {
            Some(_) => own.parts.triangles(),
            None => Triangles { values: &own.values, single, ..own.triangles() },
        };
        Ok(Edit::Surface {
            key,
            triangles,
            changes: (was_whole && own.is_whole).then_some(&own.changes),
            style: isosurface_style(state, scale),
        })
    }

    pub(super) fn triangles(&self) -> Triangles<'_> {
        Triangles { moves: &self.moves, slopes: &self.slopes, ..Triangles::from(&self.surface) }
    }
}

impl<S> Displaced<S>
where
    for<'a> Triangles<'a>: From<&'a S>,
{
    /// Moves its vertices, of which `at` interpolates fields.
    fn follow(&mut self, by: &Option<Moves<'_>>, at: impl Fn(&S, &[f64]) -> Vec<f64>) {
        self.moves = by.as_ref().map_or_else(Vec::new, |by| by.at(|field| at(&self.surface, field)));
    }

    pub(super) fn triangles(&self) -> Triangles<'_> {
        Triangles { moves: &self.moves, ..Triangles::from(&self.surface) }
    }
}

impl Displaced<BoundarySurface> {
    /// What is drawn of it by the field that is shown: in parts if that is a label.
    fn coloured<'a>(&'a mut self, input: &Input<'_>, is_by_field: bool) -> Triangles<'a> {
        let is_label = is_by_field && input.is_label(input.shown);
        self.parts = match is_label {
            true => labels::parts(&self.triangles(), &self.surface.edge_places(), input, input.shown),
            false => LabelParts::default(),
        };
        let own: &'a Self = self;
        match is_label {
            true => own.parts.triangles(),
            false => Triangles { single: input.single(input.shown), ..own.triangles() },
        }
    }
}

impl Section {
    /// Cuts `mesh`: that of the input, or some of its tetrahedra.
    fn update<'a>(
        &'a mut self,
        input: &Input<'a>,
        mesh: &MeshView<'_>,
        by: &Option<Moves<'_>>,
        key: u32,
        state: &SliceState,
    ) -> Result<Edit<'a>> {
        let field = input.field("slices", state.field.as_ref())?;
        let plane = state.plane();
        self.slice.extract(mesh, &plane.plane());
        let is_label = input.is_label(field);
        let is_other = field != input.shown && !is_label;
        let values = is_other.then(|| self.slice.interpolate(mesh, &*(input.fields)(field)));
        self.values = values.unwrap_or_default();
        let moves = by.as_ref().map(|by| by.at(|component| self.slice.interpolate(mesh, component)));
        self.moves = moves.unwrap_or_default();
        self.inner_sides = self.slice.cell_sides().iter().map(|sides| !sides & 7).collect();
        let style = Style {
            colouring: Colouring::Scale(input.scale(field)?),
            opacity: state.opacity as f32,
            lighting: Lighting::None,
            edges: state.edges.then(EdgeLook::default),
            clips: if state.clipped { other_clips(&clips(input.state), &plane.clip()) } else { 0 },
        };
        let whole = Triangles { inner_sides: &self.inner_sides, ..self.triangles() };
        let parts = is_label.then(|| labels::parts(&whole, &self.slice.edge_places(mesh), input, field));
        self.parts = parts.unwrap_or_default();
        let own: &'a Self = self;
        let mut triangles = Triangles { inner_sides: &own.inner_sides, ..own.triangles() };
        triangles.single = input.single(field);
        if is_other {
            triangles.values = &own.values;
        }
        if is_label {
            triangles = own.parts.triangles();
        }
        Ok(Edit::Surface { key, triangles, changes: None, style })
    }

    pub(super) fn triangles(&self) -> Triangles<'_> {
        Triangles { moves: &self.moves, ..Triangles::from(&self.slice) }
    }
}

/// What regions look like: their colour, where they give it, and their opacity.
type RegionLook = (Option<u8>, f64);

/// What each region looks like; nothing where all look the same.
fn region_looks(input: &Input<'_>, boundary: &BoundaryState) -> Vec<RegionLook> {
    let is_by_region = boundary.colour.is_none() && boundary.colour_by == ColourBy::Region;
    let colors = if is_by_region { &input.colors[..] } else { &[] };
    let opacity = |region: usize| input.opacities.get(region).copied().unwrap_or(boundary.opacity);
    let count = colors.len().max(input.opacities.len());
    (0..count).map(|region| (colors.get(region).copied(), opacity(region))).collect()
}

/// Each of some once, in order.
fn distinct<T: Copy + PartialEq>(mut all: Vec<T>, order: impl Fn(&T, &T) -> Ordering) -> Vec<T> {
    all.sort_by(order);
    all.dedup();
    all
}

fn list_boundary<'a>(
    (own, groups): (&'a mut Displaced<BoundarySurface>, &'a mut Vec<Group>),
    caps: &'a mut Vec<Section>,
    input: &Input<'a>,
    by: &Option<Moves<'_>>,
    edits: &mut Edits<'a>,
) -> Result<()> {
    let Some(boundary) = &input.state.boundary else {
        edits.push(Edit::Remove(BOUNDARY));
        resize(groups, 0, REGIONS, edits);
        resize(caps, 0, CAPS, edits);
        return Ok(());
    };
    let scale = Colouring::Scale(input.scale(input.shown)?);
    let style = Style {
        colouring: boundary.colour.map_or(scale, |colour| Colouring::Sides([colour.rgb(); 2])),
        opacity: boundary.opacity as f32,
        lighting: Lighting::Flat,
        edges: boundary.edges.then(EdgeLook::default),
        clips: if boundary.clipped { u32::MAX } else { 0 },
    };
    let of_region = region_looks(input, boundary);
    let by_look = |a: &RegionLook, b: &RegionLook| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1));
    let looks = distinct(of_region.clone(), by_look);
    resize(groups, looks.len(), REGIONS, edits);
    if looks.is_empty() {
        own.surface.extract(&input.mesh);
        own.follow(by, BoundarySurface::interpolate);
        let triangles = own.coloured(input, boundary.colour.is_none());
        edits.push(Edit::Surface { key: BOUNDARY, triangles, changes: None, style });
    } else {
        edits.push(Edit::Remove(BOUNDARY));
    }
    let look = |tet: u32| of_region[usize::from(input.regions[tet as usize])];
    for (key, (group, own)) in (REGIONS..).zip(groups.iter_mut().zip(&looks)) {
        let (color, opacity) = *own;
        group.opacity = opacity;
        // An interface is drawn once: as that of the region that hides more.
        let is_seen = |beside: u32| beside == NONE || look(beside).1 < opacity;
        let part = &mut group.boundary;
        part.surface.extract_of(&input.mesh, |tet, beside| look(tet) == *own && is_seen(beside));
        part.follow(by, BoundarySurface::interpolate);
        let colouring =
            color.map_or(style.colouring, |color| Colouring::Sides([Colour(region_color(color)).rgb(); 2]));
        let style = Style { colouring, opacity: opacity as f32, ..style };
        let triangles = part.coloured(input, boundary.colour.is_none() && color.is_none());
        edits.push(Edit::Surface { key, triangles, changes: None, style });
    }
    list_caps(caps, boundary, input, by, edits)
}

/// What clip planes cut open is closed: for each opacity of regions by sections of these.
fn list_caps<'a>(
    caps: &'a mut Vec<Section>,
    boundary: &BoundaryState,
    input: &Input<'a>,
    by: &Option<Moves<'_>>,
    edits: &mut Edits<'a>,
) -> Result<()> {
    let mut planes = if boundary.clipped { clips(input.state) } else { Vec::new() };
    if !planes.is_empty() {
        // A plane that cuts nothing away may lie in a face of the boundary: a cap there would be drawn into the same pixels.
        let bounds = input.mesh.bounds();
        planes.retain(|plane| cuts(plane, &bounds));
    }
    let opacities = distinct(input.opacities.clone(), f64::total_cmp);
    let part = |opacity: f64| {
        let has = |t: usize| input.opacities[usize::from(input.regions[t])] == opacity;
        let tets = input.mesh.tets.iter().enumerate();
        (opacity, tets.map(|(t, tet)| if has(t) { *tet } else { [NONE; 4] }).collect())
    };
    let parts: Vec<(f64, Cow<'_, [[u32; 4]]>)> = match opacities[..] {
        _ if planes.is_empty() => Vec::new(),
        [] => vec![(boundary.opacity, Cow::Borrowed(input.mesh.tets))],
        _ => opacities.iter().map(|opacity| part(*opacity)).collect(),
    };
    let cap = |opacity: f64, ClipPlane { normal, offset }: ClipPlane| SliceState {
        normal,
        offset,
        opacity,
        edges: boundary.edges,
        field: None,
        clipped: true,
    };
    let cutting: Vec<(SliceState, &[[u32; 4]])> = parts
        .iter()
        .flat_map(|(opacity, tets)| planes.iter().map(|plane| (cap(*opacity, *plane), &tets[..])))
        .collect();
    list_each(caps, CAPS, &cutting, edits, |own, key, (state, tets)| {
        own.update(input, &MeshView { tets, ..input.mesh }, by, key, state)
    })
}

/// Whether anything of a box is behind a plane by more than rounding.
fn cuts(plane: &ClipPlane, bounds: &Bounds) -> bool {
    let Bounds { min, max } = *bounds;
    let sum = |of: fn(f64, f64, f64) -> f64| (0..3).map(|i| of(plane.normal[i], min[i], max[i])).sum::<f64>();
    sum(|n, low, high| (n * low).max(n * high))
        > plane.offset + 1e-9 * sum(|n, low, high| n.abs() * (high - low))
}

fn list_undeformed<'a>(own: &'a mut BoundarySurface, input: &Input<'a>, edits: &mut Edits<'a>) {
    if !input.state.deform.as_ref().is_some_and(|deform| deform.undeformed) {
        edits.push(Edit::Remove(UNDEFORMED));
        return;
    }
    own.extract(&input.mesh);
    let style = Style {
        colouring: Colouring::Sides([GHOST; 2]),
        opacity: GHOST_OPACITY,
        lighting: Lighting::Flat,
        ..Style::default()
    };
    let triangles = Triangles { values: &[], ..Triangles::from(&*own) };
    edits.push(Edit::Surface { key: UNDEFORMED, triangles, changes: None, style });
}

fn streamlines<'a>(
    own: &'a mut Displaced<Solids>,
    input: &Input<'a>,
    by: &Option<Moves<'_>>,
    legend: &mut Option<Legend>,
) -> Result<Edit<'a>> {
    let Some(StreamlineState { fields, seeds, radius, field }) = &input.state.streamlines else {
        return Ok(Edit::Remove(TUBES));
    };
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
        None => own.surface.set_tubes(&lines, &options),
        Some(field) => {
            let numbers = (input.fields)(field);
            let mesh = MeshView { field: &numbers, is_label: false, ..input.mesh };
            own.surface.set_tubes_with(&lines, &options, |point| point.place.value(&mesh));
        }
    }
    own.follow(by, |tubes, component| tubes.interpolate(&input.mesh, component));
    solids(own, input, TUBES, values, ("speed", input.lengths(fields)), legend)
}

fn arrow_list<'a>(
    own: &'a mut Displaced<Solids>,
    input: &Input<'a>,
    by: &Option<Moves<'_>>,
    legend: &mut Option<Legend>,
) -> Result<Edit<'a>> {
    let Some(ArrowState { fields, spacing, field, constant }) = &input.state.arrows else {
        return Ok(Edit::Remove(ARROWS));
    };
    let vectors = input.vectors("arrows.fields", fields)?;
    let values = field.as_ref().map(|_| input.field("arrows.field", field.as_ref())).transpose()?;
    let numbers = values.map(|field| (input.fields)(field));
    let options = ArrowOptions {
        spacing: spacing.unwrap_or(input.diagonal() / 20.0),
        length: if *constant { ArrowLength::Constant } else { ArrowLength::Magnitude },
    };
    let components = [&*vectors[0], &vectors[1], &vectors[2]];
    own.surface.set_arrows(input.mesh, components, numbers.as_deref().map(FieldView::from), &options);
    own.follow(by, |arrows, component| arrows.interpolate(&input.mesh, component));
    solids(own, input, ARROWS, values, ("magnitude", input.lengths(fields)), legend)
}

/// Tubes or arrows, coloured by a field or by `own`, the name and the range of what they are made of.
fn solids<'a>(
    solids: &'a Displaced<Solids>,
    input: &Input<'a>,
    key: u32,
    field: Option<usize>,
    (own, lengths): (&str, [f64; 2]),
    legend: &mut Option<Legend>,
) -> Result<Edit<'a>> {
    let single =
        field.map_or_else(|| SingleValues::of_values(&solids.surface.values), |field| input.single(field));
    let triangles = Triangles { single, ..solids.triangles() };
    let scale = match field {
        Some(field) => input.scale(field)?,
        None => scale(&input.state.colours, None, lengths)?,
    };
    let label = field.map_or(own, |field| &input.info.fields[field].name).to_owned();
    // Where nothing else is coloured by values, the legend is theirs.
    legend.get_or_insert(Legend { label, scale, labels: Vec::new(), apart: 0 });
    let style = Style { colouring: Colouring::Scale(scale), ..Style::default() };
    Ok(Edit::Surface { key, triangles, changes: None, style })
}

/// The legend of the field, unless tetrahedra have one of their own.
fn update_legend(shown: &mut Option<Legend>, input: &Input<'_>) -> Result<()> {
    let state = input.state;
    if input.quantity()?.is_some() {
        return Ok(());
    }
    let is_mapped = state.volume.as_ref().is_some_and(|volume| volume.points.is_empty())
        || !state.slices.is_empty()
        || state.boundary.as_ref().is_some_and(|boundary| {
            boundary.colour.is_none() && (boundary.colour_by == ColourBy::Field || input.colors.is_empty())
        })
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
        let apart = if is_difference { input.apart } else { 0 };
        let labels = if input.is_label(field) { labels::present(input, field) } else { Vec::new() };
        input.scale(field).map(|scale| Legend { label, scale, labels, apart })
    };
    *shown = field.map(legend).transpose()?;
    Ok(())
}
