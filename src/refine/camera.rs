//! Views: the view frustum of a camera, and the size of errors in pixels.

use super::criterion::{ANY, TetData, Verdict, component_of};
use super::frame::Frame;
use super::request::View;
use super::shape::Plane;
use super::tet_minimax::Rows;
use glam::{DMat4, DVec2, DVec3, DVec4};

/// A camera in model units, seen from the middle of the domain.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Camera {
    /// The sides of the view frustum, normals outwards.
    sides: [Plane; 4],
    depth: Depth,
}

/// How sizes on the screen depend on depth.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Depth {
    /// Sizes are divided by the distance from this plane.
    Perspective {
        plane: Plane,
        /// The pixels of a length of 1 at depth 1.
        pixels: f64,
    },
    /// Sizes do not depend on depth. The pixels of a length of 1.
    Parallel { pixels: f64 },
}

/// The ratio of successive depths in [`Camera::nearest_depth`]: 2^(-1/16).
const STEP: f64 = 0.957_603_280_698_573_6;
/// The number of these depths: down to 2^-24 of the largest one.
const STEPS: usize = 24 * 16;

impl Camera {
    pub fn new(view: &View, frame: &Frame) -> Self {
        let [x, y, _, w] = rows(&DMat4::from_cols_array(&view.matrix));
        let outwards = |row: DVec4| Plane::new(-row.truncate(), row.w, frame.middle);
        let sides = [w + x, w - x, w + y, w - y].map(outwards);
        let half = DVec2::from(view.viewport) / 2.0;
        let (right, up, along) = (x.truncate(), y.truncate(), w.truncate());
        // What a coordinate on the screen, x / w, changes by along a way: (x - (x / w) w) / w, where |x / w| <= 1.
        let steepest = |axis: DVec3| (axis - along).length().max((axis + along).length());
        let pixels = (half.x * steepest(right)).max(half.y * steepest(up));
        let depth = if along.length() > 0.0 {
            let plane = Plane::new(along, -w.w, frame.middle);
            Depth::Perspective { plane, pixels: pixels / along.length() }
        } else {
            Depth::Parallel { pixels: pixels / w.w.abs() }
        };
        Self { sides, depth }
    }

    /// Whether `tet` is in the picture and its error looks larger than `pixels`: whether some of its points lie in the
    /// view frustum up to the depth at which the error has that size.
    pub fn judge(
        &self,
        frame: &Frame,
        tet: &TetData<'_>,
        corners: &[DVec3; 4],
        pixels: f64,
        ranked: bool,
    ) -> Verdict {
        let length = tet.error.error() * frame.displacement;
        let is_small =
            matches!(self.depth, Depth::Parallel { pixels: scale } if length * scale / pixels <= 1.0);
        if length <= 0.0 || is_small {
            // The verdict can only change with the scale, and cameras of different scales are infinitely far apart.
            return Verdict::NEVER;
        }
        let margin = frame.margin(tet);
        let (outside, side) = self.outside(corners, margin, self.depth_limit(frame, length, pixels));
        let slack = (outside - margin).abs() / away(corners, frame);
        let (excess, component) = match &self.depth {
            Depth::Parallel { pixels: scale } if outside <= margin => {
                (length * scale / pixels, component_of(side))
            }
            Depth::Parallel { .. } => (0.0, component_of(side)),
            Depth::Perspective { .. } if outside > margin => (0.0, component_of(side)),
            Depth::Perspective { .. } if !ranked => (2.0, ANY),
            Depth::Perspective { plane, pixels: scale } => {
                let depth = self.nearest_depth(corners, margin, plane, frame);
                let excess = length * scale / (pixels.max(f64::MIN_POSITIVE) * depth) / STEP;
                (excess.clamp(1.0 + f64::EPSILON, f64::MAX), ANY)
            }
        };
        Verdict { excess, slack, component }
    }

    /// The depth up to which an error of this length looks larger than `pixels`, and the plane that depths are measured from.
    fn depth_limit(&self, frame: &Frame, length: f64, pixels: f64) -> Option<(&Plane, f64)> {
        match &self.depth {
            Depth::Parallel { .. } => None,
            Depth::Perspective { plane, pixels: scale } => {
                Some((plane, (length * scale / pixels).min(2.0 * self.deepest(frame))))
            }
        }
    }

    /// How far a tetrahedron is outside of the picture, or beyond a depth, as far as that decides whether it is by more than
    /// `threshold`; and if one function alone decides that it is, which.
    fn outside(
        &self,
        corners: &[DVec3; 4],
        threshold: f64,
        limit: Option<(&Plane, f64)>,
    ) -> (f64, Option<usize>) {
        let mut rows = Rows::new();
        self.sides.iter().for_each(|plane| rows.push(plane.distances(corners)));
        if let Some((plane, limit)) = limit {
            rows.push(plane.distances(corners).map(|depth| depth - limit));
        }
        rows.least_by(threshold)
    }

    /// The nearest depth at which a tetrahedron is seen, on a fixed scale: the same for all tetrahedra, so that a
    /// larger error at the same place never has a smaller excess.
    fn nearest_depth(&self, corners: &[DVec3; 4], margin: f64, plane: &Plane, frame: &Frame) -> f64 {
        let deepest = self.deepest(frame);
        let at = |step: usize| deepest * power(step);
        let (mut near, mut far) = (0, STEPS);
        while near + 1 < far {
            let middle = usize::midpoint(near, far);
            let is_seen = self.outside(corners, margin, Some((plane, at(middle)))).0 <= margin;
            *(if is_seen { &mut near } else { &mut far }) = middle;
        }
        at(near)
    }

    /// An upper bound of the depth of all points of the domain; the camera may be outside.
    fn deepest(&self, frame: &Frame) -> f64 {
        match &self.depth {
            Depth::Perspective { plane, .. } => (2.0 * frame.reach - plane.offset).max(frame.reach),
            Depth::Parallel { .. } => frame.reach,
        }
    }

    /// The distance between the same side of two view frustums, by its number, or with number 4 between the depths up
    /// to which errors look large; in the unit of [`Camera::distance`].
    pub fn component_distance(
        &self,
        pixels: f64,
        before: &Self,
        before_pixels: f64,
        frame: &Frame,
        side: usize,
    ) -> f64 {
        match (self.sides.get(side), before.sides.get(side)) {
            (Some(a), Some(b)) => a.turn(b, nearest(frame)),
            _ => self.depth_distance(pixels, before, before_pixels, frame),
        }
    }

    /// How far this camera is from another one: by what part of its distance from the middle of the domain, or of [`nearest`],
    /// a point can change its place in the picture or its depth. A camera that turns around the model moves points in its
    /// middle less than others.
    pub fn distance(&self, pixels: f64, other: &Self, other_pixels: f64, frame: &Frame) -> f64 {
        let sides = self.sides.iter().zip(&other.sides);
        let by_sides = sides.fold(0.0, |m: f64, (a, b)| m.max(a.turn(b, nearest(frame))));
        by_sides.max(self.depth_distance(pixels, other, other_pixels, frame))
    }

    /// How far the depths up to which errors look large are from each other, in the unit of [`Camera::distance`].
    fn depth_distance(&self, pixels: f64, other: &Self, other_pixels: f64, frame: &Frame) -> f64 {
        match (&self.depth, &other.depth) {
            (Depth::Perspective { plane: a, pixels: p }, Depth::Perspective { plane: b, pixels: q }) => {
                // A limit is the error's length times such a scale, or twice the largest depth where that is less.
                let (s, t) = (p / pixels, q / other_pixels);
                let scaled = if s == t {
                    0.0
                } else if s.max(t).is_finite() {
                    (s - t).abs() / s.max(t)
                } else {
                    f64::INFINITY
                };
                let deepest = self.deepest(frame).max(other.deepest(frame));
                let moved = (a.offset - b.offset).abs();
                a.turn(b, nearest(frame)) + (2.0 * moved + 2.0 * deepest * scaled) / nearest(frame)
            }
            (Depth::Parallel { pixels: p }, Depth::Parallel { pixels: q })
                if p / pixels == q / other_pixels =>
            {
                0.0
            }
            _ => f64::INFINITY,
        }
    }
}

/// The least distance from the middle of the domain that movements are relative to.
fn nearest(frame: &Frame) -> f64 {
    0.5 * frame.reach
}

/// How far a tetrahedron reaches from the middle of the domain, but at least [`nearest`].
fn away(corners: &[DVec3; 4], frame: &Frame) -> f64 {
    let furthest = corners.iter().fold(0.0, |m: f64, p| m.max(p.length_squared()));
    furthest.sqrt().max(nearest(frame))
}

/// The rows of a matrix.
fn rows(matrix: &DMat4) -> [DVec4; 4] {
    let transposed = matrix.transpose();
    [transposed.x_axis, transposed.y_axis, transposed.z_axis, transposed.w_axis]
}

/// [`STEP`] to a power, by squaring: multiplications round alike everywhere.
fn power(mut exponent: usize) -> f64 {
    let (mut result, mut base) = (1.0, STEP);
    while exponent > 0 {
        if exponent & 1 == 1 {
            result *= base;
        }
        base *= base;
        exponent >>= 1;
    }
    result
}
