//! What a picture shows: the options that say so, and the scene that they make.

use crate::deform::Deform;
use crate::needs::read_json;
use crate::output;
use crate::parse::{one_of, parse_bounds, parse_list, parse_number, parse_plane, parse_range, parse_share};
use crate::query::Query;
use crate::usage::refuse_usage;
use anyhow::Result;
use clap::ValueEnum;
use clap::builder::PossibleValuesParser;
use std::path::PathBuf;
use tetralod::geom::Bounds;
use tetralod::mt::FieldInfo;
use tetralod::session::{Deformation, Session, TetQuantity};
use tetralod::view::Plane;
use tetralod_render::scene::{
    Background, CellKind, ColourBy, DeformState, IsosurfaceState, MapName, PlaneState, RegionName,
    SceneState, SliceState, ThresholdState,
};

const SHOWN: &str = "What is shown";
const COLOURS: &str = "Colours";

/// The options that say what is shown.
#[derive(clap::Args)]
#[command(next_help_heading = SHOWN)]
pub struct Shown {
    /// What is shown; several between commas. Without it, what the options below are for, or else the
    /// boundary; an isosurface of a volume that fills its box, unless the field is linear.
    #[arg(long = "mode", value_name = "MODE,…", value_delimiter = ',')]
    modes: Vec<Mode>,
    /// Isosurface at this value, in units of the field (repeatable) [default: the values of --iso, or that
    /// which parts the volume best into two groups of values].
    #[arg(long = "isovalue", value_name = "V", value_parser = parse_number, allow_hyphen_values = true)]
    surfaces: Vec<f64>,
    /// Section with this plane: x=D, y=D or z=D, or the points p with n · p = D; in model units (repeatable)
    /// [default: through the middle, across y].
    #[arg(long = "slice", value_name = "nx,ny,nz,D", value_parser = parse_plane, allow_hyphen_values = true)]
    slices: Vec<Plane>,
    /// Opacity of isosurfaces, sections and boundary, 0 to 1 or with % [default: 1].
    #[arg(long, value_name = "O|O%", value_parser = parse_opacity, allow_hyphen_values = true)]
    opacity: Option<f64>,
    /// Opacity of the boundary of one region of the file, by its name or else its label: what it hides is seen through it (repeatable).
    #[arg(long = "region-opacity", value_name = "NAME=O|O%", value_parser = parse_region_opacity, allow_hyphen_values = true)]
    region_opacities: Vec<(String, f64)>,
    /// Opacities of the volume: ascending values of the field, each with the opacity (0 to 1) of a tenth of
    /// the model's diagonal [default: that of --transfer with its colours, or from 0 to 0.5 over the range of
    /// the colours].
    #[arg(long, value_name = "v,o,v,o,…", value_parser = parse_opacities, allow_hyphen_values = true)]
    opacities: Option<Opacities>,
    /// What colours tetrahedra: the field, or a property of each; with `region`, the boundary, too, by the regions that the file keeps.
    #[arg(long, value_name = "WHAT", value_parser = quantities())]
    colour_by: Option<String>,
    /// Shrink each tetrahedron by this part of its size, 0 to 0.95 or with %.
    #[arg(long, value_name = "S|S%", value_parser = parse_shrink, allow_hyphen_values = true)]
    shrink: Option<f64>,
    /// Leave out whole tetrahedra with their centroid where n · p > D.
    #[arg(long, value_name = "nx,ny,nz,D", value_parser = parse_plane, allow_hyphen_values = true)]
    cut: Option<Plane>,
    /// Cut away where n · p > D (repeatable); the boundary is closed there.
    #[arg(long = "clip", value_name = "nx,ny,nz,D", value_parser = parse_plane, allow_hyphen_values = true)]
    clips: Vec<Plane>,
    /// Cut away all outside of this box.
    #[arg(long, value_name = "x0,y0,z0,x1,y1,z1", value_parser = parse_bounds, allow_hyphen_values = true)]
    clip_box: Option<Bounds>,
    /// Show alone what is within this range, in units of the field: whole tetrahedra, those whose four values are; the boundary is theirs.
    #[arg(long, value_name = "a,b", value_parser = parse_range, allow_hyphen_values = true)]
    threshold: Option<[f64; 2]>,
    /// The field of --threshold [default: that of --field].
    #[arg(long, value_name = "NAME", requires = "threshold")]
    threshold_field: Option<String>,
    /// Cut tetrahedra where the field crosses the ends of --threshold, so that the boundary is smooth there.
    #[arg(long, requires = "threshold")]
    threshold_cut: bool,
    #[command(flatten)]
    deform: Deform,
    /// With --deform, draw the boundary as it is without displacement, too, so that one sees through it.
    #[arg(long, requires = "deform", help_heading = "Deformed shape")]
    undeformed: bool,
    /// Draw the edges of triangles and of the tetrahedra that are cut; those of tetrahedra are drawn anyway.
    #[arg(long)]
    edges: bool,
    /// Leave out the box around the model.
    #[arg(long)]
    no_outline: bool,
    /// A scene to begin with, as --print-scene prints it; the options beside it come on top.
    #[arg(long, value_name = "FILE.json")]
    scene: Option<PathBuf>,
    /// The field that colours isosurfaces and sections; without it, isosurfaces have one colour, and sections those of the field.
    #[arg(long, value_name = "NAME", help_heading = COLOURS)]
    colour_field: Option<String>,
    /// The colour map: viridis, magma, turbo, coolwarm, ... (a wrong name lists all) [default: viridis].
    #[arg(long, value_name = "NAME", value_parser = |text: &str| MapName::try_from(text.to_owned()), help_heading = COLOURS)]
    map: Option<MapName>,
    /// The values with the first and the last colour [default: the range of the field].
    #[arg(
        long,
        value_name = "a,b",
        value_parser = parse_range,
        help_heading = COLOURS,
        allow_hyphen_values = true
    )]
    colour_range: Option<[f64; 2]>,
    /// Colours follow the logarithm of values; their range must be positive.
    #[arg(long, help_heading = COLOURS)]
    log: bool,
    /// Colours run backwards.
    #[arg(long, help_heading = COLOURS)]
    reversed: bool,
    /// So many colours, 2 to 64, each for an equal part of the range [default: colours run into one another].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(2..=64), help_heading = COLOURS)]
    bands: Option<u8>,
    /// What is behind everything [default: dark].
    #[arg(long, value_name = "WHAT", value_parser = one_of(GROUNDS), help_heading = COLOURS)]
    background: Option<Background>,
}

/// Kinds of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Mode {
    /// Isosurfaces.
    Isosurface,
    /// The volume as a cloud: emission and absorption.
    Volume,
    /// Sections.
    Slice,
    /// The surface of the domain.
    Boundary,
    /// Tetrahedra.
    Cells,
    /// The edges of tetrahedra.
    Wire,
    /// The points of the mesh.
    Points,
}

impl Mode {
    /// What tetrahedra look like in it.
    fn cells(self) -> Option<CellKind> {
        match self {
            Self::Cells => Some(CellKind::Solid),
            Self::Wire => Some(CellKind::Wire),
            Self::Points => Some(CellKind::Points),
            _ => None,
        }
    }
}

const GROUNDS: [(&str, Background); 3] =
    [("dark", Background::Dark), ("light", Background::Light), ("transparent", Background::Transparent)];

/// Values and opacities.
#[derive(Clone, Debug)]
struct Opacities(Vec<[f64; 2]>);

fn parse_opacities(text: &str) -> Result<Opacities, String> {
    let numbers = parse_list(text)?;
    let (points, rest) = numbers.as_chunks::<2>();
    if !rest.is_empty() {
        return Err("each value has an opacity: give v,o,v,o,…".to_owned());
    }
    if !points.is_sorted_by(|a, b| a[0] <= b[0]) {
        return Err("the values must ascend".to_owned());
    }
    match points.iter().find(|point| !(0.0..=1.0).contains(&point[1])) {
        Some(point) => Err(format!("the opacity {} is not one of 0 to 1", point[1])),
        None => Ok(Opacities(points.to_vec())),
    }
}

fn parse_opacity(text: &str) -> Result<f64, String> {
    let opacity = parse_share(text)?;
    if opacity <= 1.0 { Ok(opacity) } else { Err(format!("'{text}' is more than 1")) }
}

fn parse_region_opacity(text: &str) -> Result<(String, f64), String> {
    // Names may have such a sign, too.
    let (name, opacity) =
        text.rsplit_once('=').ok_or("give the region and its opacity: NAME=O, such as casing=20%")?;
    Ok((name.to_owned(), parse_opacity(opacity)?))
}

fn parse_shrink(text: &str) -> Result<f64, String> {
    let shrink = parse_share(text)?;
    if shrink <= 0.95 { Ok(shrink) } else { Err(format!("'{text}' is more than 0.95")) }
}

fn quantities() -> PossibleValuesParser {
    let names = TetQuantity::ALL.map(TetQuantity::name);
    PossibleValuesParser::new(["field"].into_iter().chain(names))
}

/// What a scene needs to know of the volume.
pub struct About<'a> {
    pub bounds: Bounds,
    /// Whether an isosurface shows more of it than its boundary.
    pub surface_first: bool,
    pub field: &'a FieldInfo,
}

impl Shown {
    /// The files that it reads.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.scene.iter()
    }

    /// Refuses options that contradict one another.
    pub fn check(&self) {
        if self.modes.iter().filter(|mode| mode.cells().is_some()).count() > 1 {
            refuse_usage("tetrahedra have one look: give one of the modes cells, wire and points");
        }
    }

    /// Refuses what displaces or colours if it has no step at the time that is asked for.
    pub fn check_steps(&self, query: &Query, session: &Session, by: Option<&Deformation>) -> Result<()> {
        let (Some(info), shown) = (session.info(), session.field()) else { return Ok(()) };
        let colours = self.colour_field.as_ref().and_then(|name| info.step_of(name, shown));
        let others = colours.into_iter().chain(by.map(|by| by.fields[0]));
        others.into_iter().try_for_each(|other| query.check_step(info, shown, other))
    }

    /// Whether regions give the boundary its colours.
    fn is_by_region(&self) -> bool {
        self.colour_by.as_deref() == Some("region")
    }

    /// What to add: the modes, or those that other options are for.
    fn wanted(&self, query: &Query, surface_first: bool) -> Vec<Mode> {
        if !self.modes.is_empty() {
            return self.modes.clone();
        }
        // Those of a scene stay as they are.
        let by_cell = self.colour_by.is_some() && !self.is_by_region();
        let has_cells = by_cell || self.shrink.is_some() || self.cut.is_some();
        let is_coloured = self.colour_field.is_some() && self.slices.is_empty();
        let is_new = self.scene.is_none() && (!query.isovalues().is_empty() || is_coloured);
        let has_surface = !self.surfaces.is_empty() || is_new;
        let implied = [
            (Mode::Isosurface, has_surface),
            (Mode::Slice, !self.slices.is_empty()),
            (Mode::Volume, self.opacities.is_some()),
            (Mode::Boundary, self.is_by_region() || !self.region_opacities.is_empty()),
            (Mode::Cells, has_cells && self.scene.is_none()),
        ];
        let wanted: Vec<Mode> = implied.into_iter().filter(|(_, is)| *is).map(|(mode, _)| mode).collect();
        let is_nothing = wanted.is_empty() && self.scene.is_none();
        if is_nothing { vec![if surface_first { Mode::Isosurface } else { Mode::Boundary }] } else { wanted }
    }

    /// The scene.
    pub fn state(&self, query: &Query, about: &About<'_>) -> Result<SceneState> {
        let mut state: SceneState = match &self.scene {
            Some(path) => read_json(path)?,
            None => SceneState::default(),
        };
        let wanted = self.wanted(query, about.surface_first);
        if !self.modes.is_empty() {
            hide_others(&mut state, &wanted);
        }
        for mode in wanted {
            self.add(mode, &mut state, query, about)?;
        }
        self.refuse_idle(&state);
        self.adjust(&mut state);
        let named = |names: Vec<String>| names.into_iter().map(RegionName::Name).collect();
        state.regions = query.shown_regions().map(named).or(state.regions);
        Ok(state)
    }

    fn add(&self, mode: Mode, state: &mut SceneState, query: &Query, about: &About<'_>) -> Result<()> {
        match mode {
            Mode::Isosurface => {
                let given = &self.surfaces;
                let values = if given.is_empty() { query.isovalues() } else { given };
                let like = state.isosurfaces.first().cloned().unwrap_or_default();
                if !values.is_empty() {
                    let one = |value: &f64| IsosurfaceState { value: Some(*value), ..like.clone() };
                    state.isosurfaces = values.iter().map(one).collect();
                } else if state.isosurfaces.is_empty() {
                    state.isosurfaces.push(like);
                }
            }
            Mode::Volume => {
                let volume = state.volume.get_or_insert_default();
                if let Some(opacities) = &self.opacities {
                    volume.opacities = opacities.0.clone();
                    volume.points.clear();
                } else if let Some((points, unit_length)) = query.transfer(&about.field.name)? {
                    volume.points = points;
                    volume.opacities.clear();
                    volume.unit_length = Some(unit_length * about.bounds.diagonal());
                }
            }
            Mode::Slice if !self.slices.is_empty() => {
                state.slices = self.slices.iter().map(section).collect();
            }
            Mode::Slice if state.slices.is_empty() => {
                let middle = f64::midpoint(about.bounds.min[1], about.bounds.max[1]);
                state.slices.push(section(&Plane { normal: [0.0, 1.0, 0.0], offset: middle }));
            }
            Mode::Slice => {}
            Mode::Boundary => {
                state.boundary.get_or_insert_default();
            }
            Mode::Cells | Mode::Wire | Mode::Points => {
                state.cells.get_or_insert_default().shape = mode.cells().unwrap_or_default();
            }
        }
        Ok(())
    }

    /// Refuses options for what is not shown.
    fn refuse_idle(&self, state: &SceneState) {
        let faces = !state.isosurfaces.is_empty() || !state.slices.is_empty() || state.boundary.is_some();
        let coloured = !state.isosurfaces.is_empty() || !state.slices.is_empty();
        let idle = [
            ("isovalue", !self.surfaces.is_empty() && state.isosurfaces.is_empty(), "isosurface"),
            ("slice", !self.slices.is_empty() && state.slices.is_empty(), "slice"),
            ("opacities", self.opacities.is_some() && state.volume.is_none(), "volume"),
            (
                "colour-by region",
                self.is_by_region() && state.boundary.is_none() && state.cells.is_none(),
                "boundary, cells, wire or points",
            ),
            (
                "colour-by",
                self.colour_by.is_some() && !self.is_by_region() && state.cells.is_none(),
                "cells, wire or points",
            ),
            ("shrink", self.shrink.is_some() && state.cells.is_none(), "cells"),
            ("cut", self.cut.is_some() && state.cells.is_none(), "cells, wire or points"),
            ("region-opacity", !self.region_opacities.is_empty() && state.boundary.is_none(), "boundary"),
            ("opacity", self.opacity.is_some() && !faces, "isosurface, slice or boundary"),
            ("colour-field", self.colour_field.is_some() && !coloured, "isosurface or slice"),
        ];
        if let Some((option, _, modes)) = idle.into_iter().find(|(_, is_idle, _)| *is_idle) {
            refuse_usage(&format!("--{option} is for what is not shown: add the mode {modes}"));
        }
    }

    /// Everything but what is shown at all.
    fn adjust(&self, state: &mut SceneState) {
        if let Some(opacity) = self.opacity {
            state.isosurfaces.iter_mut().for_each(|surface| surface.opacity = opacity);
            state.slices.iter_mut().for_each(|slice| slice.opacity = opacity);
            state.boundary.iter_mut().for_each(|boundary| boundary.opacity = opacity);
        }
        if self.colour_field.is_some() {
            state.isosurfaces.iter_mut().for_each(|surface| surface.field.clone_from(&self.colour_field));
            state.slices.iter_mut().for_each(|slice| slice.field.clone_from(&self.colour_field));
        }
        if self.edges {
            state.isosurfaces.iter_mut().for_each(|surface| surface.edges = true);
            state.slices.iter_mut().for_each(|slice| slice.edges = true);
            state.boundary.iter_mut().for_each(|boundary| boundary.edges = true);
        }
        if let Some(cells) = &mut state.cells {
            cells.edges |= self.edges;
            cells.shrink = self.shrink.unwrap_or(cells.shrink);
            cells.cut = self.cut.as_ref().map(plane).or(cells.cut);
            if let Some(what) = &self.colour_by {
                cells.colour_by.clone_from(what);
            }
        }
        if let (Some(boundary), true) = (&mut state.boundary, self.is_by_region()) {
            boundary.colour_by = ColourBy::Region;
        }
        if let Some(boundary) = &mut state.boundary {
            boundary.region_opacities.extend(self.region_opacities.iter().cloned());
        }
        if !self.clips.is_empty() {
            state.clips = self.clips.iter().map(plane).collect();
        }
        if let Some(Bounds { min: [x0, y0, z0], max: [x1, y1, z1] }) = self.clip_box {
            state.clip_box = Some([x0, y0, z0, x1, y1, z1]);
        }
        if let Some(range) = self.threshold {
            let (field, cut) = (self.threshold_field.clone(), self.threshold_cut);
            state.threshold = Some(ThresholdState { field, range, cut });
        }
        if let Some((field, factor, phase)) = self.deform.given() {
            state.deform =
                Some(DeformState { field: field.clone(), factor, phase, undeformed: self.undeformed });
        }
        state.outline &= !self.no_outline;
        let colours = &mut state.colours;
        colours.map = self.map.unwrap_or(colours.map);
        colours.range = self.colour_range.or(colours.range);
        colours.log |= self.log;
        colours.reversed |= self.reversed;
        colours.bands = self.bands.or(colours.bands);
        state.background = self.background.unwrap_or(state.background);
    }
}

/// Leaves nothing in a scene but what some modes show.
fn hide_others(state: &mut SceneState, shown: &[Mode]) {
    if !shown.contains(&Mode::Isosurface) {
        state.isosurfaces.clear();
    }
    if !shown.contains(&Mode::Slice) {
        state.slices.clear();
    }
    if !shown.contains(&Mode::Volume) {
        state.volume = None;
    }
    if !shown.contains(&Mode::Boundary) {
        state.boundary = None;
    }
    if !shown.iter().any(|mode| mode.cells().is_some()) {
        state.cells = None;
    }
    (state.streamlines, state.arrows) = (None, None);
}

fn plane(plane: &Plane) -> PlaneState {
    PlaneState { normal: plane.normal, offset: plane.offset }
}

fn section(plane: &Plane) -> SliceState {
    let &Plane { normal, offset } = plane;
    SliceState { normal, offset, opacity: 1.0, edges: false, field: None, clipped: true }
}

/// Words about what a scene names that is not there.
pub fn warnings(state: &SceneState, about: &About<'_>) -> Vec<String> {
    let field = about.field;
    let values = state.isosurfaces.iter().filter_map(|surface| surface.value);
    let missed = values.filter(|value| !(field.min..=field.max).contains(value)).map(|value| {
        let (value, [min, max]) = (output::exact(value), output::ends([field.min, field.max]));
        format!("isovalue {value}: {} has only values from {min} to {max}", field.name)
    });
    let sides = |slice: &SliceState| {
        let corner =
            |i: usize, k: usize| if i >> k & 1 == 0 { about.bounds.min } else { about.bounds.max }[k];
        let side = |i: usize| (0..3).map(|k| slice.normal[k] * corner(i, k)).sum::<f64>() - slice.offset;
        [0, 1, 2, 3, 4, 5, 6, 7].map(side)
    };
    let apart = state.slices.iter().filter(|slice| {
        let sides = sides(slice);
        sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0)
    });
    let apart = apart.map(|slice| {
        let axis = |i: usize| output::ends([about.bounds.min[i], about.bounds.max[i]]);
        let [min, max] = [0, 1].map(|end| [0, 1, 2].map(|i| axis(i)[end].clone()).join(","));
        let normal = slice.normal.map(output::exact).join(",");
        format!("section {normal},{}: the model lies inside the box {min},{max}", output::exact(slice.offset))
    });
    missed.chain(apart).collect()
}
