//! What a scene's state says of colours, shapes and media, as it is to be drawn.

use super::SceneError;
use super::state::{
    CellKind, CellState, ColourState, IsosurfaceState, PlaneState, SceneState, VolumeState, bounds,
};
use crate::draw::{CellShape, CellStyle, Colouring, EdgeLook, Lighting, SIDES, Style};
use tetralod::session::TetQuantity;
use tetralod::view::{ClipPlane, ColourScale, Medium};

/// A logarithmic scale over a range that is not positive begins at this part of its upper end.
const LOG_START: f64 = 1e-3;

/// The scale of a state: over `range` if there is one, else over what is there, of which a logarithmic scale has the positive part.
/// Where there is none it is linear.
pub(super) fn scale(
    colours: &ColourState,
    range: Option<[f64; 2]>,
    [low, high]: [f64; 2],
) -> Result<ColourScale, SceneError> {
    let ColourState { map, reversed, log, bands, .. } = *colours;
    let is_log = log && (range.is_some() || high > 0.0);
    let own = if is_log && low <= 0.0 { [LOG_START * high, high] } else { [low, high] };
    let bands = bands.unwrap_or(0);
    let scale = ColourScale { map: map.0, range: range.unwrap_or(own), is_reversed: reversed, is_log, bands };
    Ok(scale.validate()?)
}

/// The smallest and the largest number; 0 and 1 if there is none.
pub(super) fn range(values: &[f64]) -> [f64; 2] {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let range = [finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)];
    if range[0] <= range[1] { range } else { [0.0, 1.0] }
}

/// The quantity that colours tetrahedra; none for the field.
pub(super) fn quantity(cells: &CellState) -> Result<Option<TetQuantity>, SceneError> {
    if cells.colour_by == "field" {
        return Ok(None);
    }
    let found = TetQuantity::named(&cells.colour_by);
    found.map(Some).ok_or_else(|| {
        let names = TetQuantity::ALL.map(TetQuantity::name).join(", ");
        let problem = format!("must be one of field, {names}; given: {}", cells.colour_by);
        SceneError::state("cells.colourBy", problem)
    })
}

pub(super) fn cell_style(cells: &CellState, scale: ColourScale, own_values: bool) -> CellStyle {
    let edges = EdgeLook { width: cells.width as f32, ..EdgeLook::default() };
    let has_edges = cells.edges || cells.shape == CellKind::Wire;
    let style = Style {
        colouring: Colouring::Scale(scale),
        lighting: Lighting::Flat,
        edges: has_edges.then_some(edges),
        ..Style::default()
    };
    let shape = match cells.shape {
        CellKind::Solid => CellShape::Solid(cells.shrink as f32),
        CellKind::Wire => CellShape::Wire,
        CellKind::Points => CellShape::Points(cells.width.max(1.0) as f32 * 4.0),
    };
    let cut = cells.cut.map_or(ClipPlane::NOTHING, |cut| cut.clip());
    CellStyle { style, shape, cut, own_values }
}

pub(super) fn isosurface_style(state: &IsosurfaceState, scale: Option<ColourScale>) -> Style {
    let sides = Colouring::Sides(state.colour.map_or(SIDES, |colour| [colour.rgb(); 2]));
    Style {
        colouring: scale.map_or(sides, Colouring::Scale),
        opacity: state.opacity as f32,
        edges: state.edges.then(EdgeLook::default),
        ..Style::default()
    }
}

/// A bit for each clip plane but those that are the same plane as `own`, whichever side they cut away.
pub(super) fn other_clips(clips: &[ClipPlane], own: &ClipPlane) -> u32 {
    let is_same = |clip: &ClipPlane, sign: f64| {
        clip.normal == own.normal.map(|x| sign * x) && clip.offset == sign * own.offset
    };
    let others = clips.iter().enumerate().filter(|(_, clip)| !is_same(clip, 1.0) && !is_same(clip, -1.0));
    others.fold(0, |mask, (i, _)| mask | 1 << i)
}

/// The medium of a state, with the colours of a scale where it has none of its own.
pub(super) fn medium(volume: &VolumeState, scale: &ColourScale, diagonal: f64) -> Medium {
    let unit_length = volume.unit_length.unwrap_or(diagonal / 10.0);
    if !volume.points.is_empty() {
        let points = volume.points.iter().map(|&[value, r, g, b, a]| (value, [r, g, b, a]));
        return Medium::new(&points.collect::<Vec<_>>(), unit_length);
    }
    let ramp = [[scale.range[0], 0.0], [scale.range[1], 0.5]];
    let opacities = if volume.opacities.is_empty() { &ramp } else { volume.opacities.as_slice() };
    Medium::new(&coloured(opacities, scale), unit_length)
}

/// As far beside a fraction, the colour is that of the next band.
const BESIDE: f64 = 1e-9;

/// Colours between two values of the scale, even in its own terms.
const COLOURS: usize = 64;

/// The values of `opacities` and of the colours of the scale, with both.
fn coloured(opacities: &[[f64; 2]], scale: &ColourScale) -> Vec<(f64, [f64; 4])> {
    // Bands are steps, of two colours at a value.
    let bands = usize::from(scale.bands);
    let count = if bands > 1 { bands } else { COLOURS };
    let own = (0..=count).map(|i| scale.value(i as f64 / count as f64));
    let mut values: Vec<f64> = opacities.iter().map(|point| point[0]).chain(own).collect();
    values.sort_unstable_by(f64::total_cmp);
    values.dedup();
    let mut points = Vec::new();
    for value in values {
        // Several opacities at one value are a step, and so is where bands meet.
        let same: Vec<f64> = opacities.iter().filter(|p| p[0] == value).map(|p| p[1]).collect();
        let own = || opacity_at(opacities, value);
        let ends = [same.first(), same.last()].map(|end| end.copied().unwrap_or_else(own));
        let away = if bands > 1 { BESIDE } else { 0.0 };
        let colours = [-away, away].map(|away| scale.colour_at(scale.fraction(value) + away).map(f64::from));
        let [below, above] = [0, 1].map(|side| {
            let [r, g, b] = colours[side];
            (value, [r, g, b, ends[side]])
        });
        points.push(below);
        points.extend((above != below).then_some(above));
    }
    points
}

/// Linear between the points, constant beyond.
fn opacity_at(opacities: &[[f64; 2]], value: f64) -> f64 {
    let after = opacities.partition_point(|point| point[0] <= value);
    match (after.checked_sub(1).map(|i| opacities[i]), opacities.get(after)) {
        (Some([low, from]), Some([high, to])) => from + (to - from) * (value - low) / (high - low),
        (Some(end), None) => end[1],
        (None, Some(end)) => end[1],
        (None, None) => 0.0,
    }
}

/// All clip planes: those of the state, then the faces of its box.
pub(super) fn clips(state: &SceneState) -> Vec<ClipPlane> {
    let mut clips: Vec<ClipPlane> = state.clips.iter().map(PlaneState::clip).collect();
    if let Some(bounds) = state.clip_box.as_ref().and_then(bounds) {
        for axis in 0..3 {
            let normal = |sign: f64| [0, 1, 2].map(|i| if i == axis { sign } else { 0.0 });
            clips.push(ClipPlane { normal: normal(1.0), offset: bounds.max[axis] });
            clips.push(ClipPlane { normal: normal(-1.0), offset: -bounds.min[axis] });
        }
    }
    clips
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetralod::view::VIRIDIS;

    #[test]
    fn opacities_keep_their_steps_and_get_colours() {
        let scale = ColourScale::new(VIRIDIS, [0.0, 1.0]).expect("a range");
        let points = coloured(&[[0.2, 0.0], [0.5, 0.4], [0.5, 0.9], [0.8, 0.0]], &scale);
        assert!(points.is_sorted_by(|a, b| a.0 <= b.0) && points.len() > 60);
        let at = |value: f64| points.iter().filter(|p| p.0 == value).map(|p| p.1[3]).collect::<Vec<_>>();
        assert_eq!(at(0.5), [0.4, 0.9]);
        assert_eq!((at(0.0), at(1.0)), (vec![0.0], vec![0.0]));
        assert!((opacity_at(&[[0.0, 0.0], [1.0, 0.5]], 0.5) - 0.25).abs() < 1e-12);
    }

    #[test]
    fn logarithms_are_of_the_positive_part_of_what_is_there() {
        let colours = ColourState { log: true, ..ColourState::default() };
        let of = |own| scale(&colours, None, own).map(|scale| (scale.range, scale.is_log)).expect("a scale");
        assert_eq!(of([0.0, 4.0]), ([0.004, 4.0], true));
        assert_eq!(of([1.0, 4.0]), ([1.0, 4.0], true));
        assert_eq!(of([-2.0, -1.0]), ([-2.0, -1.0], false));
        assert!(scale(&colours, Some([0.0, 1.0]), [1.0, 4.0]).is_err(), "a range that was asked for");
    }

    #[test]
    fn a_plane_is_not_cut_by_itself() {
        let x = ClipPlane { normal: [1.0, 0.0, 0.0], offset: 0.5 };
        let back = ClipPlane { normal: [-1.0, 0.0, 0.0], offset: -0.5 };
        let y = ClipPlane { normal: [0.0, 1.0, 0.0], offset: 0.5 };
        assert_eq!(other_clips(&[x, y, back], &x), 0b010);
    }
}
