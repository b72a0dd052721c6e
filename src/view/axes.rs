//! Axes of a box on the screen: which of its edges carry ticks, where the labels go, and a scale bar.

use crate::geom::{Bounds, Camera, Projection};
use crate::view::ticks::{Tick, end_ticks, linear_ticks, nice_below};
use glam::{DVec2, DVec3, DVec4};

/// An edge is left for another one only if that lies better by so much, in halves of the screen's height.
const BETTER: f64 = 0.1;

/// An axis has at most so many ticks.
const MOST_TICKS: f64 = 50.0;

/// The largest part of the screen's width that a scale bar takes.
const WIDEST_BAR: f64 = 0.25;

/// An edge of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoxEdge {
    /// The axis that it is parallel to: 0 to 2.
    pub axis: usize,
    /// Whether it is at the larger coordinate of the next axis, and of the one after that (after z comes x).
    pub upper: [bool; 2],
}

impl BoxEdge {
    /// The four edges parallel to an axis.
    ///
    /// # Panics
    /// If the axis is larger than 2.
    pub fn parallel_to(axis: usize) -> [Self; 4] {
        assert!(axis < 3, "the axes are 0 to 2");
        [[false, false], [true, false], [false, true], [true, true]].map(|upper| Self { axis, upper })
    }

    /// The axes that it is perpendicular to, in the order of `upper`.
    fn others(self) -> [usize; 2] {
        [(self.axis + 1) % 3, (self.axis + 2) % 3]
    }

    /// The ends of the axis in model units: at the smaller and the larger coordinate.
    pub fn ends(self, bounds: &Bounds) -> [DVec3; 2] {
        let [mut from, mut to] = [bounds.min, bounds.max].map(DVec3::from);
        for (axis, is_upper) in self.others().into_iter().zip(self.upper) {
            let place = if is_upper { bounds.max } else { bounds.min }[axis];
            (from[axis], to[axis]) = (place, place);
        }
        [from, to]
    }

    /// Whether it is on the silhouette of the box: the camera sees one of its two faces from outside, the
    /// other one not.
    pub fn is_on_silhouette(self, bounds: &Bounds, camera: &Camera) -> bool {
        let [first, second] = [0, 1].map(|i| sees_face(bounds, camera, self.others()[i], self.upper[i]));
        first != second
    }
}

/// A tick of an axis on the screen.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisTick {
    /// The coordinate, in model units, and its text.
    pub tick: Tick,
    /// The point of the edge, in model units.
    pub position: DVec3,
    /// Where it is seen, in normalised screen coordinates.
    pub screen: DVec2,
}

/// The edge of a box with the ticks of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct BoxAxis {
    /// The edge; to be given to the next [`tick_edges`].
    pub edge: BoxEdge,
    /// The ends of the part of it that is on the screen, in normalised screen coordinates: that with the
    /// smaller coordinate first.
    pub ends: [DVec2; 2],
    /// Where labels go: away from the box, at a right angle to the edge as seen. Its length is 1, its unit
    /// the same in both directions: a label that is so many pixels away from its tick is at the tick plus
    /// this direction times the pixels (y upwards).
    pub outward: DVec2,
    /// The ticks on the screen, ascending: round numbers, and the ends of the edge.
    pub ticks: Vec<AxisTick>,
}

/// A bar that says how large things are.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleBar {
    /// The length of the bar in model units: a round number.
    pub length: f64,
    /// The length as text.
    pub label: String,
    /// How wide it is on the screen, as a fraction of the screen's width: more than 0.1, at most 0.25.
    pub width: f64,
}

/// For x, y and z, the edge of a box that is best for ticks: on the silhouette, so that labels stand outside
/// of the box; for x and y rather at the bottom, for z rather on the left.
///
/// `None` for an axis that is seen end-on, whose edges all cross the picture of the box, or if the camera is
/// in the box, or if no edge on the silhouette is on the screen. `previous` are the edges that were chosen
/// last, or `[None; 3]`: they stay until they leave the silhouette or another edge is clearly better, so that
/// labels do not jump to and fro. `aspect` is the width of the screen divided by its height.
pub fn tick_edges(
    bounds: &Bounds,
    camera: &Camera,
    aspect: f64,
    previous: [Option<BoxEdge>; 3],
) -> [Option<BoxEdge>; 3] {
    let mut chosen = [None; 3];
    for (axis, best) in chosen.iter_mut().enumerate() {
        let mut most = f64::NEG_INFINITY;
        for edge in BoxEdge::parallel_to(axis) {
            if !edge.is_on_silhouette(bounds, camera) {
                continue;
            }
            let Some(merit) = merit(edge, bounds, camera, aspect) else { continue };
            let merit = if previous[axis] == Some(edge) { merit + BETTER } else { merit };
            if merit >= most {
                (most, *best) = (merit, Some(edge));
            }
        }
    }
    chosen
}

/// The ticks of an edge that [`tick_edges`] chose. `spacing` is the smallest mean distance between ticks on
/// the screen, in halves of its height (0.15, for example).
///
/// `None` if no part of the edge is on the screen, or if it is seen as a point.
///
/// ```
/// use tetralod::geom::{Bounds, Camera};
/// use tetralod::view::{box_axis, tick_edges};
///
/// let bounds = Bounds { min: [0.0; 3], max: [10.0, 4.0, 4.0] };
/// let camera = Camera::home(&bounds, 1.5);
/// let edges = tick_edges(&bounds, &camera, 1.5, [None; 3]);
/// let x = edges[0].expect("x is not seen end-on");
/// let axis = box_axis(x, &bounds, &camera, 1.5, 0.2).expect("it is on the screen");
/// assert_eq!(axis.ticks[0].tick.label, "0");
/// assert!(axis.outward.y < 0.0);
/// ```
pub fn box_axis(
    edge: BoxEdge,
    bounds: &Bounds,
    camera: &Camera,
    aspect: f64,
    spacing: f64,
) -> Option<BoxAxis> {
    let [from, to] = edge.ends(bounds);
    let [start, end] = visible_part([from, to], camera, aspect)?;
    let at = |t: f64| from.lerp(to, t);
    let ends = [camera.project(at(start), aspect)?, camera.project(at(end), aspect)?];
    let square = DVec2::new(aspect, 1.0);
    let along = (ends[1] - ends[0]) * square;
    let length = along.length();
    // Less than a pixel.
    if !(length.is_finite() && length > 1e-3) {
        return None;
    }
    let most = if spacing > 0.0 { (length / spacing).min(MOST_TICKS) } else { MOST_TICKS };
    let place = |tick: Tick| {
        let mut position = from;
        position[edge.axis] = tick.value;
        Some(AxisTick { screen: camera.project(position, aspect)?, position, tick })
    };
    let limits = end_ticks([from[edge.axis], to[edge.axis]], false).filter(|_| most >= 1.0);
    let seen = [start == 0.0, end == 1.0];
    let [low, high] = match limits {
        Some([low, high]) => {
            [seen[0].then_some(low), seen[1].then_some(high)].map(|tick| tick.and_then(place))
        }
        None => [None, None],
    };
    let left = (most as usize + 1).saturating_sub(low.iter().chain(&high).count());
    let round = linear_ticks([at(start)[edge.axis], at(end)[edge.axis]], left);
    // Where an end is, there is no room for a round number.
    let is_free = |tick: &AxisTick| {
        let near = |end: &AxisTick| ((end.screen - tick.screen) * square).length() < 0.6 * spacing;
        !low.iter().chain(&high).any(near)
    };
    let inner: Vec<_> = round.into_iter().filter_map(place).filter(is_free).collect();
    let ticks = low.into_iter().chain(inner).chain(high).collect();
    let outward = side(bounds, camera, aspect, ends[0] * square, along.perp() / length);
    Some(BoxAxis { edge, ends, outward, ticks })
}

/// A bar of round length (1, 2, 2.5 or 5 times a power of ten, in model units) that takes 0.1 to 0.25 of the
/// screen's width at the distance of the target; in orthographic projection, at any distance. `aspect` is
/// width divided by height.
pub fn scale_bar(camera: &Camera, aspect: f64) -> ScaleBar {
    let whole = 2.0 * camera.half_size(aspect)[0];
    let Tick { value: length, label } = nice_below(whole * WIDEST_BAR);
    ScaleBar { length, label, width: length / whole }
}

/// Whether the camera sees a face of the box from outside.
fn sees_face(bounds: &Bounds, camera: &Camera, axis: usize, is_upper: bool) -> bool {
    let sign = if is_upper { 1.0 } else { -1.0 };
    let place = if is_upper { bounds.max } else { bounds.min }[axis];
    match camera.projection() {
        Projection::Perspective => (camera.eye()[axis] - place) * sign > 0.0,
        // Faces seen edge-on are not seen, whatever rounding says.
        Projection::Orthographic => -camera.forward()[axis] * sign > 1e-9,
    }
}

/// How well an edge lies for ticks; `None` if it is not on the screen.
fn merit(edge: BoxEdge, bounds: &Bounds, camera: &Camera, aspect: f64) -> Option<f64> {
    let [from, to] = edge.ends(bounds);
    let [start, end] = visible_part([from, to], camera, aspect)?;
    let middle = camera.project(from.lerp(to, f64::midpoint(start, end)), aspect)?;
    // The other direction decides where both edges are equally high, as seen from above.
    let wanted = if edge.axis == 2 { DVec2::new(-1.0, -0.3) } else { DVec2::new(-0.3, -1.0) };
    Some((middle * DVec2::new(aspect, 1.0)).dot(wanted))
}

/// Which part of a line, as fractions of it, is on the screen and between the clipping planes (Liang and
/// Barsky 1984, with homogeneous coordinates).
fn visible_part(ends: [DVec3; 2], camera: &Camera, aspect: f64) -> Option<[f64; 2]> {
    let matrix = camera.view_projection(aspect);
    // How far a point is inside of the sides of the screen, and behind the near plane.
    let inside = |p: DVec4| [p.w - p.x, p.w + p.x, p.w - p.y, p.w + p.y, p.z];
    let [from, to] = ends.map(|p| inside(matrix * p.extend(1.0)));
    let mut part = [0.0_f64, 1.0];
    for (a, b) in from.into_iter().zip(to) {
        if a < 0.0 && b < 0.0 {
            return None;
        }
        // Where the line goes through the plane.
        let crossing = a / (a - b);
        if a < 0.0 {
            part[0] = part[0].max(crossing);
        } else if b < 0.0 {
            part[1] = part[1].min(crossing);
        }
    }
    (part[0] < part[1]).then_some(part)
}

/// The one of the two directions across an edge that points away from the box. `on_edge` is a point of the
/// edge; both are in halves of the screen's height.
fn side(bounds: &Bounds, camera: &Camera, aspect: f64, on_edge: DVec2, across: DVec2) -> DVec2 {
    let ends = [bounds.min, bounds.max];
    let mut farthest = 0.0_f64;
    for corner in 0..8_usize {
        let place = DVec3::from([0, 1, 2].map(|axis| ends[corner >> axis & 1][axis]));
        let Some(seen) = camera.project(place, aspect) else { continue };
        // All of them are on one side, but for rounding.
        let away = (seen * DVec2::new(aspect, 1.0) - on_edge).dot(across);
        if away.abs() > farthest.abs() {
            farthest = away;
        }
    }
    if farthest > 0.0 { -across } else { across }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::ViewPreset;

    const BOX: Bounds = Bounds { min: [-1.0, 2.0, 0.0], max: [9.0, 6.0, 3.0] };
    const ASPECT: f64 = 1.5;

    /// Cameras around the box, in both projections, some near and aside.
    fn cameras() -> impl Iterator<Item = Camera> {
        (0..400).map(|i| {
            let mut camera = Camera::home(&BOX, ASPECT);
            if i % 2 == 1 {
                camera.set_projection(Projection::Orthographic);
            }
            camera.orbit(f64::from(i) * 0.37, f64::from(i % 23) * 0.11 - 1.6);
            if i % 5 == 0 {
                camera.zoom(0.7);
                camera.pan(0.2, -0.1);
            }
            camera
        })
    }

    fn corners() -> impl Iterator<Item = DVec3> {
        BoxEdge::parallel_to(0).into_iter().flat_map(|edge| edge.ends(&BOX))
    }

    fn axes(camera: &Camera) -> impl Iterator<Item = BoxAxis> {
        let edges = tick_edges(&BOX, camera, ASPECT, [None; 3]);
        edges.into_iter().flatten().filter_map(move |edge| box_axis(edge, &BOX, camera, ASPECT, 0.15))
    }

    #[test]
    fn the_box_is_on_one_side_of_the_edges_and_labels_on_the_other() {
        let square = DVec2::new(ASPECT, 1.0);
        let mut seen = 0;
        for camera in cameras() {
            for axis in axes(&camera) {
                seen += 1;
                assert!((axis.outward.length() - 1.0).abs() < 1e-9);
                let line = (axis.ends[1] - axis.ends[0]) * square;
                assert!(line.dot(axis.outward).abs() < 1e-9);
                for corner in corners() {
                    let Some(p) = camera.project(corner, ASPECT) else { continue };
                    assert!(((p - axis.ends[0]) * square).dot(axis.outward) < 1e-9, "{axis:?}");
                }
            }
        }
        assert!(seen > 1000, "{seen}");
    }

    #[test]
    fn ticks_are_on_the_edge_and_on_the_screen() {
        for camera in cameras() {
            for axis in axes(&camera) {
                let [from, to] = axis.edge.ends(&BOX);
                for AxisTick { tick, position, screen } in &axis.ticks {
                    assert_eq!(position[axis.edge.axis], tick.value);
                    assert!(position.distance(from) + position.distance(to) - from.distance(to) < 1e-9);
                    assert!((camera.project(*position, ASPECT).unwrap() - *screen).length() < 1e-12);
                    assert!(screen.abs().max_element() < 1.0 + 1e-9);
                }
                let length = ((axis.ends[1] - axis.ends[0]) * DVec2::new(ASPECT, 1.0)).length();
                assert!(axis.ticks.len() as f64 <= length / 0.15 + 1.0);
            }
        }
    }

    #[test]
    fn ends_that_are_on_the_screen_have_ticks() {
        let (mut seen, mut apart) = (0, f64::INFINITY);
        for camera in cameras() {
            for axis in axes(&camera).filter(|axis| axis.ticks.len() > 2) {
                let ends = [BOX.min, BOX.max].map(|corner| corner[axis.edge.axis]);
                let has = |value: f64| axis.ticks.iter().any(|tick| tick.tick.value == value);
                for (end, place) in ends.into_iter().zip(axis.edge.ends(&BOX)) {
                    let is_seen = camera.project(place, ASPECT).is_some_and(|p| p.abs().max_element() < 1.0);
                    assert_eq!(has(end), is_seen, "{axis:?}");
                    seen += usize::from(is_seen);
                }
                let places: Vec<_> =
                    axis.ticks.iter().map(|tick| tick.screen * DVec2::new(ASPECT, 1.0)).collect();
                apart = places.windows(2).map(|pair| pair[0].distance(pair[1])).fold(apart, f64::min);
            }
        }
        assert!(seen > 1000 && apart > 0.01, "{seen} {apart}");
    }

    #[test]
    fn edges_do_not_jump_to_and_fro() {
        for camera in cameras() {
            let chosen = tick_edges(&BOX, &camera, ASPECT, [None; 3]);
            let mut near = camera;
            near.orbit(1e-4, 1e-4);
            let kept = tick_edges(&BOX, &near, ASPECT, chosen);
            for (before, after) in chosen.into_iter().zip(kept).filter(|(before, after)| before != after) {
                // An edge changes only if it had to.
                assert!(
                    before.is_none_or(|edge| !edge.is_on_silhouette(&BOX, &near)),
                    "{before:?} {after:?}"
                );
            }
        }
    }

    #[test]
    fn axes_seen_end_on_have_no_ticks() {
        for projection in [Projection::Perspective, Projection::Orthographic] {
            let mut camera = Camera::home(&BOX, ASPECT);
            camera.set_projection(projection);
            camera.turn_to(ViewPreset::AlongX);
            let edges = tick_edges(&BOX, &camera, ASPECT, [None; 3]);
            assert_eq!(edges.map(|edge| edge.is_some()), [false, true, true], "{projection:?}");
        }
        let mut inside = Camera::home(&BOX, ASPECT);
        inside.zoom(1e-9);
        assert_eq!(tick_edges(&BOX, &inside, ASPECT, [None; 3]), [None; 3]);
    }

    #[test]
    fn from_the_front_ticks_are_at_the_bottom_and_on_the_left() {
        let mut camera = Camera::home(&BOX, ASPECT);
        camera.turn_to(ViewPreset::AlongY);
        camera.fit(&BOX, ASPECT);
        let [x, _, z] = tick_edges(&BOX, &camera, ASPECT, [None; 3]);
        let axis = |edge: Option<BoxEdge>| box_axis(edge.unwrap(), &BOX, &camera, ASPECT, 0.15).unwrap();
        assert!(axis(x).outward.y < -0.99 && axis(z).outward.x < -0.99);
        assert!(axis(x).ends[0].x < axis(x).ends[1].x);
        let last = axis(x).ticks.pop().unwrap();
        assert!(last.tick.value > 7.9 && last.tick.value <= 9.0);
    }

    #[test]
    fn scale_bars_are_round_and_neither_short_nor_long() {
        for mut camera in cameras() {
            for aspect in [0.4, 1.0, 2.3] {
                camera.zoom(0.93);
                let bar = scale_bar(&camera, aspect);
                assert!(bar.width > 0.1 && bar.width <= 0.25 + 1e-12, "{bar:?}");
                let end = camera.target() + camera.right() * bar.length;
                let seen = camera.project(end, aspect).unwrap().x / 2.0;
                assert!((seen - bar.width).abs() < 1e-9);
                assert!((bar.label.parse::<f64>().unwrap() - bar.length).abs() < 1e-12 * bar.length);
                let digits = bar.label.replace(['.', '0'], "");
                assert!(["1", "2", "25", "5"].contains(&digits.as_str()), "{digits}");
            }
        }
    }
}
