//! An orbit camera: it looks at a target from a distance, and turns around it with z up. It can fly, too.

use crate::geom::{Bounds, SinglePoints};
use glam::dcamera::rh::proj::directx::{orthographic, perspective};
use glam::dcamera::rh::view::look_at_mat4;
use glam::{DMat4, DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use thiserror::Error;

/// The camera stops this far (in radians) from looking straight up or down, where "right" loses its meaning.
const POLE_GAP: f64 = 0.01;

/// The smallest and the largest distance from the target, in radii of the model.
const DISTANCES: [f64; 2] = [0.02, 40.0];

/// How far panning, flying and anything else may bring the target, the eye, or the target from the middle of
/// the model, in radii of the model, so that the model cannot get lost.
const PAN_LIMIT: f64 = 2.0;
const FLY_LIMIT: f64 = 4.0;
const LIMIT: f64 = 100.0;

/// What fits the picture takes this part of it, so that a small margin is left.
const FILLED: f64 = 0.94;

/// The angles of the home view: from the front, a little to the right and from above.
const HOME: [f64; 2] = [-1.05, 0.42];

/// How points become a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub enum Projection {
    /// What is farther away looks smaller.
    #[default]
    Perspective,
    /// Parallel lines stay parallel, and sizes do not depend on distance. What is at the target has the size
    /// that it has in perspective.
    Orthographic,
}

/// Directions to look in, with z up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewPreset {
    /// As [`Camera::home`].
    Home,
    /// Along x: towards larger x, with y to the left.
    AlongX,
    /// Towards smaller x, with y to the right.
    AgainstX,
    /// Along y: towards larger y, with x to the right.
    AlongY,
    /// Towards smaller y, with x to the left.
    AgainstY,
    /// Along z, from below: almost exactly, since "right" has no meaning there; x is to the right, y down.
    AlongZ,
    /// From above, almost exactly; x is to the right, y up.
    AgainstZ,
}

/// Where a camera is, as plain numbers: to be kept, sent and set again.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct CameraState {
    /// What it looks at, in model units.
    pub target: [f64; 3],
    /// From the eye to the target, in model units.
    pub distance: f64,
    /// The direction from the target to the eye, as an angle around z from x towards y, in radians.
    pub yaw: f64,
    /// The angle of that direction above the plane of x and y, in radians.
    pub pitch: f64,
    /// How points become a picture.
    pub projection: Projection,
}

/// Why a camera cannot be set to a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CameraError {
    /// A number of the state is infinite or NaN.
    #[error("the {0} of a camera must be finite; give a state that a camera had")]
    NotFinite(&'static str),
}

/// All rays of sight of a picture. The ray through the normalised screen point (x, y) starts at
/// `origin[0] + x origin[1] + y origin[2]` and goes along `direction[0] + x direction[1] + y direction[2]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rays {
    /// Where rays start. In perspective all start at the eye, and the last two are zero; in orthographic
    /// projection they start on a plane in front of everything.
    pub origin: [DVec3; 3],
    /// Where rays go; not normalised, but all have length 1 along the direction of view. In orthographic
    /// projection the last two are zero.
    pub direction: [DVec3; 3],
}

impl Rays {
    /// The ray through a normalised screen point.
    pub fn at(&self, screen: DVec2) -> Ray {
        let sum = |[middle, right, up]: [DVec3; 3]| middle + right * screen.x + up * screen.y;
        Ray { origin: sum(self.origin), direction: sum(self.direction).normalize() }
    }
}

/// A half-line in model space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Where it goes; length 1.
    pub direction: DVec3,
}

impl Ray {
    /// The point at this distance from the origin, in model units.
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }
}

/// A camera that orbits a target. All verbs keep it finite and outside of singular positions.
///
/// Screen points are given in *normalised* coordinates: x from −1 (left) to 1 (right), y from −1 (bottom) to
/// 1 (top). `aspect` is width divided by height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    target: DVec3,
    distance: f64,
    yaw: f64,
    pitch: f64,
    /// Full vertical angle of view; in orthographic projection, how high the picture is at the target.
    fov: f64,
    projection: Projection,
    /// The sphere around what there is to see: sets the clipping planes and the limits of zooming.
    centre: DVec3,
    radius: f64,
}

impl Camera {
    /// A perspective camera that sees all of `bounds` from the front, a little to the right and from above, as
    /// [`Camera::fit`] places it.
    ///
    /// Empty or unbounded boxes are taken for the unit cube.
    pub fn home(bounds: &Bounds, aspect: f64) -> Self {
        let unit = Bounds { min: [0.0; 3], max: [1.0; 3] };
        let bounds = if has_size(bounds) { bounds } else { &unit };
        let centre = middle(bounds);
        let radius = bounds.diagonal() / 2.0;
        let [yaw, pitch] = HOME;
        let projection = Projection::Perspective;
        let mut camera =
            Self { target: centre, distance: radius, yaw, pitch, fov: 0.6, projection, centre, radius };
        camera.fit(bounds, aspect);
        camera
    }

    /// What there is to see is all in `bounds` from now on; nothing moves. Empty or unbounded boxes change nothing.
    pub fn set_model(&mut self, bounds: &Bounds) {
        if has_size(bounds) {
            (self.centre, self.radius) = (middle(bounds), bounds.diagonal() / 2.0);
        }
    }

    /// The camera that sees the same of a model whose points are stored in single precision.
    pub fn relative_to(&self, single: &SinglePoints) -> Self {
        let place = |p: DVec3| DVec3::from(single.relative(p.into()));
        Self {
            target: place(self.target),
            distance: self.distance / single.unit,
            centre: place(self.centre),
            radius: self.radius / single.unit,
            ..*self
        }
    }

    /// Moves so that all of `bounds` is in view, as large as a small margin and the limits of [`Camera::zoom`] allow, without turning. What
    /// is seen of it is in the middle of the picture; the target is as far ahead as the middle of `bounds`. Empty or unbounded boxes
    /// change nothing.
    pub fn fit(&mut self, bounds: &Bounds, aspect: f64) {
        if has_size(bounds) {
            let spans = self.spans(bounds, aspect);
            self.place_before(bounds, &spans, Span::distance);
            let [right, up] = self.scaled_axes(aspect);
            let [x, y] = spans.map(|span| span.centre(self.distance));
            self.set_target(middle(bounds) + right * x + up * y);
        }
    }

    /// As [`Camera::fit`], with the middle of `bounds` in the middle of the picture: there it stays when the camera turns around it.
    pub fn fit_around(&mut self, bounds: &Bounds, aspect: f64) {
        if has_size(bounds) {
            self.place_before(bounds, &self.spans(bounds, aspect), Span::distance_around);
        }
    }

    /// Looks at the middle of `bounds` from the distance that its spans need, with all of it in front of the eye.
    fn place_before(&mut self, bounds: &Bounds, spans: &[Span; 2], needed: fn(&Span) -> f64) {
        let nearest = spans[0].0.iter().fold(0.0_f64, |nearest, [_, ahead]| nearest.min(*ahead));
        let before = bounds.diagonal() / 2.0 * DISTANCES[0] - nearest;
        self.set_target(middle(bounds));
        self.set_distance(spans.iter().map(needed).fold(before, f64::max));
    }

    /// How the corners of `bounds` span the picture from left to right and from bottom to top.
    fn spans(&self, bounds: &Bounds, aspect: f64) -> [Span; 2] {
        let axes = [self.right(), self.up()];
        let ahead = if self.projection == Projection::Perspective { self.forward() } else { DVec3::ZERO };
        let half = self.half(aspect);
        let corners = corners(bounds).map(|corner| corner - middle(bounds));
        [0, 1].map(|k| Span(corners.map(|p| [p.dot(axes[k]) / half[k], p.dot(ahead)])))
    }

    /// Right and up on the screen, as long as half of what is seen at distance 1.
    fn scaled_axes(&self, aspect: f64) -> [DVec3; 2] {
        let [wide, high] = self.half(aspect);
        [self.right() * wide, self.up() * high]
    }

    /// Half the width and half the height of what is seen at distance 1.
    fn half(&self, aspect: f64) -> [f64; 2] {
        let high = (self.fov / 2.0).tan();
        [high * positive(aspect), high]
    }

    /// Half the width and half the height of what is seen at the distance of the target, in model units.
    pub fn half_size(&self, aspect: f64) -> [f64; 2] {
        self.half(aspect).map(|half| half * self.distance)
    }

    /// How points become a picture.
    pub fn projection(&self) -> Projection {
        self.projection
    }

    /// Sets how points become a picture; what is at the target keeps its size.
    pub fn set_projection(&mut self, projection: Projection) {
        self.projection = projection;
    }

    /// Where the camera is and how it looks, as plain numbers.
    pub fn state(&self) -> CameraState {
        CameraState {
            target: self.target.into(),
            distance: self.distance,
            yaw: self.yaw,
            pitch: self.pitch,
            projection: self.projection,
        }
    }

    /// Brings the camera where the state says, with each number held in the limits of the model. A state of
    /// this camera, or of another one of the same model, is set as it is.
    ///
    /// # Errors
    /// If a number is infinite or NaN; the camera stays as it was.
    pub fn set_state(&mut self, state: &CameraState) -> Result<(), CameraError> {
        let CameraState { target, distance, yaw, pitch, projection } = *state;
        let numbers = [("distance", distance), ("yaw", yaw), ("pitch", pitch)];
        let target_numbers = target.map(|x| ("target", x));
        if let Some((name, _)) = target_numbers.into_iter().chain(numbers).find(|(_, x)| !x.is_finite()) {
            return Err(CameraError::NotFinite(name));
        }
        self.set_target(target.into());
        self.set_distance(distance);
        self.set_angles(yaw, pitch);
        self.projection = projection;
        Ok(())
    }

    /// The camera at `t` (0 to 1, held; NaN is 0) on a smooth way from one camera to another: straight for
    /// the target, with an even factor for the distance, and around z the shorter way. The projection and the
    /// limits are those of `to`, except at the start.
    pub fn between(from: &Self, to: &Self, t: f64) -> Self {
        let t = if t > 0.0 { t.min(1.0) } else { return *from };
        if t == 1.0 {
            return *to;
        }
        let turn = (to.yaw - from.yaw + PI).rem_euclid(TAU) - PI;
        let mut camera = *to;
        camera.target = from.target.lerp(to.target, t);
        camera.distance = from.distance * (to.distance / from.distance).powf(t);
        camera.set_angles(from.yaw + turn * t, from.pitch + (to.pitch - from.pitch) * t);
        camera
    }

    fn set_target(&mut self, target: DVec3) {
        self.target = self.near_model(target, LIMIT);
    }

    fn set_distance(&mut self, distance: f64) {
        let [nearest, farthest] = DISTANCES;
        self.distance = distance.clamp(self.radius * nearest, self.radius * farthest);
    }

    fn set_angles(&mut self, yaw: f64, pitch: f64) {
        // Angles of less than a turn stay exactly as they are.
        self.yaw = if yaw.abs() <= TAU { yaw } else { yaw.rem_euclid(TAU) };
        let limit = FRAC_PI_2 - POLE_GAP;
        self.pitch = pitch.clamp(-limit, limit);
    }

    /// The point on the way from the middle of the model to `p` that is at most so many radii away from it.
    fn near_model(&self, p: DVec3, radii: f64) -> DVec3 {
        let p = if p.is_finite() { p } else { self.target };
        self.centre + (p - self.centre).clamp_length_max(self.radius * radii)
    }

    /// Where the camera is. In orthographic projection this is where the eye would be in perspective; what
    /// lies behind it is seen as well.
    pub fn eye(&self) -> DVec3 {
        self.target - self.forward() * self.distance
    }

    /// What it looks at.
    pub fn target(&self) -> DVec3 {
        self.target
    }

    /// Distance from the eye to the target.
    pub fn distance(&self) -> f64 {
        self.distance
    }

    /// The direction of view; length 1.
    pub fn forward(&self) -> DVec3 {
        let (sin, cos) = self.pitch.sin_cos();
        -DVec3::new(cos * self.yaw.cos(), cos * self.yaw.sin(), sin)
    }

    /// Right on the screen; length 1.
    pub fn right(&self) -> DVec3 {
        DVec3::new(-self.yaw.sin(), self.yaw.cos(), 0.0)
    }

    /// Up on the screen; length 1.
    pub fn up(&self) -> DVec3 {
        self.right().cross(self.forward())
    }

    /// Turns around the target: `yaw` to the right, `pitch` upwards, in radians. Stops before the poles.
    pub fn orbit(&mut self, yaw: f64, pitch: f64) {
        self.yaw = (self.yaw + finite(yaw)).rem_euclid(TAU);
        self.set_angles(self.yaw, self.pitch + finite(pitch));
    }

    /// Turns the view from where the eye is: `yaw` to the right, `pitch` upwards, in radians. Stops before
    /// the poles.
    pub fn look(&mut self, yaw: f64, pitch: f64) {
        let eye = self.eye();
        self.orbit(-finite(yaw), -finite(pitch));
        self.set_target(eye + self.forward() * self.distance);
    }

    /// Turns around the target, to look in a direction.
    pub fn turn_to(&mut self, preset: ViewPreset) {
        let [yaw, pitch] = match preset {
            ViewPreset::Home => HOME,
            ViewPreset::AlongX => [PI, 0.0],
            ViewPreset::AgainstX => [0.0, 0.0],
            ViewPreset::AlongY => [-FRAC_PI_2, 0.0],
            ViewPreset::AgainstY => [FRAC_PI_2, 0.0],
            ViewPreset::AlongZ => [-FRAC_PI_2, -FRAC_PI_2],
            ViewPreset::AgainstZ => [-FRAC_PI_2, FRAC_PI_2],
        };
        self.set_angles(yaw, pitch);
    }

    /// Moves the eye and the target to the right, upwards and forward, by multiples of the distance between
    /// them. The eye stays near the model, or does not go farther away if it is not near.
    pub fn fly(&mut self, right: f64, up: f64, forward: f64) {
        let by = self.right() * finite(right) + self.up() * finite(up) + self.forward() * finite(forward);
        let eye = self.eye();
        let limit = FLY_LIMIT.max(eye.distance(self.centre) / self.radius);
        let eye = self.near_model(eye + by * self.distance, limit);
        self.set_target(eye + self.forward() * self.distance);
    }

    /// Multiplies the distance; factors below 1 come nearer. Stops close to the target and far outside.
    pub fn zoom(&mut self, factor: f64) {
        let factor = if factor.is_finite() && factor > 0.0 { factor } else { 1.0 };
        self.set_distance(self.distance * factor);
    }

    /// Zooms towards a normalised screen point: the point of the model that is there at the distance of the
    /// target stays there, unless that would bring the target too far away from the model.
    pub fn zoom_at(&mut self, factor: f64, screen: DVec2, aspect: f64) {
        let before = self.distance;
        self.zoom(factor);
        let [wide, high] = self.half(aspect);
        let aside = self.right() * (wide * finite(screen.x)) + self.up() * (high * finite(screen.y));
        self.pan_to(self.target + aside * (before - self.distance));
    }

    /// Moves the target so that what is seen moves by this fraction of the screen's height to the right and
    /// up.
    pub fn pan(&mut self, right: f64, up: f64) {
        let height = 2.0 * self.half_size(1.0)[1];
        self.pan_to(self.target - (self.right() * finite(right) + self.up() * finite(up)) * height);
    }

    /// Moves the target, which stays near the model, or does not go farther away if it is not near.
    fn pan_to(&mut self, target: DVec3) {
        let limit = PAN_LIMIT.max(self.target.distance(self.centre) / self.radius);
        self.target = self.near_model(target, limit);
    }

    /// The distances of the near and the far clipping plane from the eye along the direction of view, in
    /// model units: as tight around the model as the precision of the depth buffer wants. In orthographic
    /// projection the near one is in front of everything, and may be negative.
    pub fn clip(&self) -> [f64; 2] {
        let centre = self.depth(self.centre);
        let [near, far] = [centre - self.radius * 1.1, centre + self.radius * 1.1];
        match self.projection {
            Projection::Perspective => {
                let far = far.max(self.radius * 0.1);
                [near.max(far * 0.002), far]
            }
            Projection::Orthographic => [near, far],
        }
    }

    /// How far `p` is from the eye along the direction of view, in model units; negative behind it.
    pub fn depth(&self, p: DVec3) -> f64 {
        (p - self.eye()).dot(self.forward())
    }

    /// How far `p` is from where its ray of sight starts, or in orthographic projection its
    /// [`Camera::depth`]: what is nearer hides what is farther.
    pub fn distance_to(&self, p: DVec3) -> f64 {
        match self.projection {
            Projection::Perspective => p.distance(self.eye()),
            Projection::Orthographic => self.depth(p),
        }
    }

    /// The direction from which `p` is seen: towards the eye; length 1 unless `p` is the eye.
    pub fn towards_eye(&self, p: DVec3) -> DVec3 {
        match self.projection {
            Projection::Perspective => (self.eye() - p).normalize_or_zero(),
            Projection::Orthographic => -self.forward(),
        }
    }

    /// From model space to clip space (depth 0 to 1).
    pub fn view_projection(&self, aspect: f64) -> DMat4 {
        let [near, far] = self.clip();
        let projection = match self.projection {
            Projection::Perspective => perspective(self.fov, positive(aspect), near, far),
            Projection::Orthographic => {
                let [wide, high] = self.half_size(aspect);
                orthographic(-wide, wide, -high, high, near, far)
            }
        };
        projection * look_at_mat4(self.eye(), self.target, DVec3::Z)
    }

    /// The normalised screen point of `p`; `None` if it lies behind a perspective camera.
    pub fn project(&self, p: DVec3, aspect: f64) -> Option<DVec2> {
        let clip = self.view_projection(aspect) * p.extend(1.0);
        (clip.w > 0.0).then(|| DVec2::new(clip.x, clip.y) / clip.w)
    }

    /// All rays of sight.
    pub fn rays(&self, aspect: f64) -> Rays {
        let [right, up] = self.scaled_axes(aspect);
        match self.projection {
            Projection::Perspective => Rays {
                origin: [self.eye(), DVec3::ZERO, DVec3::ZERO],
                direction: [self.forward(), right, up],
            },
            Projection::Orthographic => {
                let [right, up] = [right, up].map(|axis| axis * self.distance);
                let middle = self.eye() + self.forward() * self.clip()[0];
                Rays { origin: [middle, right, up], direction: [self.forward(), DVec3::ZERO, DVec3::ZERO] }
            }
        }
    }

    /// The ray of sight through a normalised screen point.
    pub fn ray(&self, screen: DVec2, aspect: f64) -> Ray {
        self.rays(aspect).at(screen)
    }
}

/// Points along one direction of the picture: how far each is aside of a target, in halves of what is seen at distance 1, and how far
/// ahead of it.
struct Span([[f64; 2]; 8]);

impl Span {
    /// The smallest distance of the target at which they fit the picture, wherever it is aside.
    fn distance(&self) -> f64 {
        (self.most(1.0) + self.most(-1.0)) / 2.0
    }

    /// The smallest distance at which they do so if it is not aside.
    fn distance_around(&self) -> f64 {
        self.most(1.0).max(self.most(-1.0))
    }

    /// The distance at which none is beyond the margin on one side.
    fn most(&self, side: f64) -> f64 {
        self.0
            .map(|[aside, ahead]| side * aside / FILLED - ahead)
            .into_iter()
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// How far aside the target is when what they span is in the middle of the picture: between the two that are farthest apart in it.
    fn centre(&self, distance: f64) -> f64 {
        let far = self.0.map(|[aside, ahead]| (aside, distance + ahead));
        let pairs = far.iter().flat_map(|a| far.iter().map(move |b| (*a, *b)));
        let apart = |((x, far), (y, other)): ((f64, f64), (f64, f64))| {
            ((x - y) / (far + other), (x * other + y * far) / (far + other))
        };
        pairs.map(apart).fold((0.0, 0.0), |most, pair| if pair.0 > most.0 { pair } else { most }).1
    }
}

/// Whether a box is neither empty, nor a point, nor unbounded.
fn has_size(bounds: &Bounds) -> bool {
    bounds.diagonal().is_finite() && bounds.diagonal() > 0.0
}

fn middle(bounds: &Bounds) -> DVec3 {
    (DVec3::from(bounds.min) + DVec3::from(bounds.max)) / 2.0
}

fn corners(bounds: &Bounds) -> [DVec3; 8] {
    let place = |i: usize, axis: usize| if i >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
    std::array::from_fn(|i| DVec3::from([0, 1, 2].map(|axis| place(i, axis))))
}

/// The aspect of a window that is being closed or not yet laid out may be anything.
fn positive(aspect: f64) -> f64 {
    if aspect.is_finite() && aspect > 0.0 { aspect } else { 1.0 }
}

fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Bounds = Bounds { min: [1.0, -2.0, 3.0], max: [4.0, 5.0, 6.0] };

    const SIDES: [ViewPreset; 7] = {
        use ViewPreset::*;
        [Home, AlongX, AgainstX, AlongY, AgainstY, AlongZ, AgainstZ]
    };

    /// Where the corners of a box are seen, from the smallest to the largest x and y.
    fn seen(camera: &Camera, bounds: &Bounds, aspect: f64) -> [DVec2; 2] {
        let seen = corners(bounds).map(|corner| {
            let clip = camera.view_projection(aspect) * corner.extend(1.0);
            assert!(clip.w > 0.0 && (0.0..=1.0).contains(&(clip.z / clip.w)), "{corner} at {clip}");
            DVec2::new(clip.x, clip.y) / clip.w
        });
        [
            seen.into_iter().fold(DVec2::INFINITY, DVec2::min),
            seen.into_iter().fold(DVec2::NEG_INFINITY, DVec2::max),
        ]
    }

    #[test]
    fn boxes_of_all_shapes_fill_pictures_of_all_shapes_from_all_sides() {
        let sizes = [
            [1.0; 3],
            [3.0, 7.0, 3.0],
            [100.0, 100.0, 1.0],
            [1.0, 1.0, 50.0],
            [40.0, 1.0, 2.0],
            [1.0, 1.0, 0.0],
        ];
        let boxes = sizes.map(|size| Bounds {
            min: [5.0, -2.0, 3.0],
            max: [0, 1, 2].map(|i| [5.0, -2.0, 3.0][i] + size[i]),
        });
        for (bounds, aspect) in
            boxes.iter().flat_map(|b| [0.3, 0.46, 1.0, 1.6, 4.0].map(|aspect| (b, aspect)))
        {
            for (side, projection) in
                SIDES.into_iter().flat_map(|side| BOTH.map(|projection| (side, projection)))
            {
                let mut camera = Camera::home(bounds, aspect);
                camera.set_projection(projection);
                camera.turn_to(side);
                let mut around = camera;
                camera.fit(bounds, aspect);
                let [low, high] = seen(&camera, bounds, aspect);
                let what = format!("{bounds:?} {aspect} {side:?} {projection:?}: {low} {high}");
                let filled = ((high - low) / 2.0).max_element();
                assert!((filled - FILLED).abs() < 1e-9, "{what}");
                assert!((low + high).abs().max_element() < 1e-9, "in the middle: {what}");
                // As near as that, no other place of the eye shows all of it.
                let nearer = (0..400).all(|i| {
                    let mut other = camera;
                    other.zoom(0.999);
                    let aside = DVec2::new(f64::from(i % 20), f64::from(i / 20)) / 19.0 - 0.5;
                    other.set_target(camera.target + camera.right() * aside.x + camera.up() * aside.y);
                    let far = corners(bounds)
                        .map(|p| other.project(p, aspect).map_or(9.0, |p| p.abs().max_element()));
                    far.into_iter().fold(0.0, f64::max) > FILLED
                });
                assert!(nearer, "{what}");
                around.fit_around(bounds, aspect);
                let [low, high] = seen(&around, bounds, aspect);
                let most = high.max(-low).max_element();
                assert!(
                    (most - FILLED).abs() < 1e-9 && around.distance >= camera.distance - 1e-9,
                    "{what}: {most}"
                );
                assert!(around.project(middle(bounds), aspect).unwrap().length() < 1e-9, "{what}");
            }
        }
    }

    #[test]
    fn rays_go_through_what_is_projected() {
        let mut camera = Camera::home(&BOX, 1.5);
        camera.orbit(2.0, -0.9);
        camera.zoom(0.4);
        camera.pan(0.2, -0.1);
        for corner in corners(&BOX) {
            let Some(screen) = camera.project(corner, 1.5) else { continue };
            let ray = camera.ray(screen, 1.5);
            let along = (corner - ray.origin).dot(ray.direction);
            assert!((ray.origin + ray.direction * along).distance(corner) < 1e-9);
            assert!(along > 0.0);
        }
    }

    #[test]
    fn axes_are_orthonormal_and_match_the_matrix() {
        let mut camera = Camera::home(&BOX, 1.0);
        for step in 0..50 {
            camera.orbit(0.37, if step < 25 { 0.2 } else { -0.3 });
            let [r, u, f] = [camera.right(), camera.up(), camera.forward()];
            for (a, b) in [(r, u), (u, f), (f, r)] {
                assert!(a.dot(b).abs() < 1e-12 && (a.length() - 1.0).abs() < 1e-12);
            }
            assert!(u.z > 0.0, "up is up");
            let right = camera.project(camera.target() + r * 0.1, 1.0).unwrap();
            let up = camera.project(camera.target() + u * 0.1, 1.0).unwrap();
            assert!(right.x > 0.0 && right.y.abs() < 1e-9 && up.y > 0.0 && up.x.abs() < 1e-9);
        }
    }

    #[test]
    fn orbiting_keeps_the_distance_and_panning_follows_the_pointer() {
        let mut camera = Camera::home(&BOX, 1.0);
        let (target, distance) = (camera.target(), camera.distance());
        camera.orbit(1.0, 9.0);
        assert_eq!((camera.target(), camera.distance()), (target, distance));
        assert!((camera.eye().distance(target) - distance).abs() < 1e-9);
        // Half a screen height to the right is half of 2 in normalised coordinates.
        camera.pan(0.25, -0.1);
        let seen = camera.project(target, 1.0).unwrap();
        assert!((seen - DVec2::new(0.5, -0.2)).length() < 1e-9, "{seen}");
    }

    const BOTH: [Projection; 2] = [Projection::Perspective, Projection::Orthographic];

    /// Somewhere odd.
    fn camera(projection: Projection) -> Camera {
        let mut camera = Camera::home(&BOX, 1.5);
        camera.set_projection(projection);
        camera.orbit(2.0, -0.9);
        camera.zoom(0.4);
        camera.pan(0.2, -0.1);
        camera
    }

    fn screens() -> impl Iterator<Item = DVec2> {
        (0..25).map(|i| DVec2::new(f64::from(i % 5), f64::from(i / 5)) / 2.0 - 1.0)
    }

    #[test]
    fn points_of_rays_are_seen_where_the_ray_starts_on_the_screen() {
        for camera in BOTH.map(camera) {
            for screen in screens() {
                let ray = camera.ray(screen, 1.5);
                assert!((ray.direction.length() - 1.0).abs() < 1e-12);
                for distance in [0.1, 1.0, 5.0, 30.0] {
                    let seen = camera.project(ray.at(distance), 1.5).unwrap();
                    assert!((seen - screen).length() < 1e-9, "{seen} instead of {screen}");
                }
                let rays = camera.rays(1.5);
                let along = rays.direction[0] + rays.direction[1] * screen.x + rays.direction[2] * screen.y;
                assert!((along.dot(camera.forward()) - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn orthographic_rays_start_in_front_of_everything() {
        let camera = camera(Projection::Orthographic);
        let origin = camera.rays(1.5).origin[0];
        for corner in corners(&BOX) {
            assert!((corner - origin).dot(camera.forward()) > 0.0);
            let clip = camera.view_projection(1.5) * corner.extend(1.0);
            assert!(clip.w == 1.0 && (0.0..=1.0).contains(&clip.z));
            assert_eq!(camera.distance_to(corner), camera.depth(corner));
            assert_eq!(camera.towards_eye(corner), -camera.forward());
        }
    }

    #[test]
    fn switching_the_projection_keeps_the_size_at_the_target() {
        let [perspective, orthographic] = BOTH.map(camera);
        for (x, y) in [(0.1, 0.0), (0.0, 0.2), (-0.2, 0.1)] {
            let p = perspective.target() + perspective.right() * x + perspective.up() * y;
            let [a, b] = [perspective, orthographic].map(|camera| camera.project(p, 1.5).unwrap());
            assert!((a - b).length() < 1e-12);
        }
    }

    #[test]
    fn zooming_towards_a_point_keeps_it() {
        for before in BOTH.map(camera) {
            for screen in screens() {
                let [wide, high] = before.half_size(1.5);
                let aside = before.right() * (wide * screen.x) + before.up() * (high * screen.y);
                let p = before.target() + aside;
                for factor in [0.5, 0.9, 1.3] {
                    let mut after = before;
                    after.zoom_at(factor, screen, 1.5);
                    assert!((after.distance() - before.distance() * factor).abs() < 1e-12);
                    assert!((after.project(p, 1.5).unwrap() - screen).length() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn flying_moves_the_eye_and_looking_around_does_not() {
        for before in BOTH.map(camera) {
            let mut after = before;
            after.fly(0.1, -0.2, 0.05);
            let by = before.right() * 0.1 - before.up() * 0.2 + before.forward() * 0.05;
            assert!((after.eye() - before.eye() - by * before.distance()).length() < 1e-12);
            assert!((after.forward() - before.forward()).length() < 1e-12);
            let (eye, right, up) = (after.eye(), after.right(), after.up());
            after.look(0.3, 0.0);
            assert!((after.eye() - eye).length() < 1e-12);
            assert!(after.forward().dot(right) > 0.1, "to the right");
            let mut after = before;
            after.look(0.0, 0.2);
            assert!(after.forward().dot(up) > 0.1, "upwards");
            assert!((after.eye() - before.eye()).length() < 1e-12);
        }
    }

    #[test]
    fn presets_look_along_the_axes() {
        use ViewPreset::*;
        let all = [
            (AlongX, 0, 1.0),
            (AgainstX, 0, -1.0),
            (AlongY, 1, 1.0),
            (AgainstY, 1, -1.0),
            (AlongZ, 2, 1.0),
            (AgainstZ, 2, -1.0),
        ];
        let home = Camera::home(&BOX, 1.0);
        for (preset, axis, sign) in all {
            let mut camera = home;
            camera.turn_to(preset);
            assert!((camera.forward()[axis] - sign).abs() <= 1.0 - POLE_GAP.cos() + 1e-12, "{preset:?}");
            assert_eq!((camera.target(), camera.distance()), (home.target(), home.distance()));
            if axis == 2 {
                assert!(camera.right().x > 0.99 && camera.up().y * -sign > 0.99);
            }
            camera.turn_to(Home);
            assert_eq!(camera, home);
        }
    }

    #[test]
    fn fitting_shows_a_box_without_turning() {
        let part = Bounds { min: [1.0, 0.0, 3.0], max: [2.0, 0.5, 5.0] };
        for before in BOTH.map(camera) {
            for (bounds, aspect) in [(BOX, 0.3), (BOX, 2.0), (part, 1.0), (part, 4.0)] {
                let mut after = before;
                after.fit(&bounds, aspect);
                assert_eq!(after.forward(), before.forward());
                let [low, high] = seen(&after, &bounds, aspect);
                assert!((high.max(-low).max_element() - FILLED).abs() < 1e-9, "{low} {high}");
            }
            let mut after = before;
            after.fit(&Bounds::EMPTY, 1.0);
            assert_eq!(after, before);
        }
    }

    #[test]
    fn states_go_round_and_are_held() {
        for before in BOTH.map(camera) {
            let mut after = Camera::home(&BOX, 1.0);
            after.set_state(&before.state()).unwrap();
            assert_eq!(after, before);
            let far =
                CameraState { target: [1e9; 3], distance: 0.0, yaw: 99.0, pitch: 7.0, ..before.state() };
            after.set_state(&far).unwrap();
            assert!(after.view_projection(1.0).is_finite() && after.distance() > 0.0);
            assert!((after.target() - after.centre).length() < after.radius * LIMIT * 1.001);
            assert!(after.state().pitch < FRAC_PI_2);
            let held = after;
            for broken in [
                CameraState { yaw: f64::NAN, ..far },
                CameraState { target: [0.0, f64::INFINITY, 0.0], ..far },
            ] {
                assert!(matches!(after.set_state(&broken), Err(CameraError::NotFinite(_))));
                assert_eq!(after, held);
            }
        }
    }

    #[test]
    fn ways_between_cameras_are_the_shorter_ones() {
        let [mut a, mut b] = [Camera::home(&BOX, 1.0); 2];
        a.set_angles(0.2, 0.1);
        b.set_angles(TAU - 0.4, 0.3);
        b.zoom(0.25);
        b.pan(0.1, 0.2);
        assert_eq!((Camera::between(&a, &b, 0.0), Camera::between(&a, &b, f64::NAN)), (a, a));
        assert_eq!(Camera::between(&a, &b, 2.0), b);
        let half = Camera::between(&a, &b, 0.5);
        assert!((half.distance() - a.distance() / 2.0).abs() < 1e-12);
        assert!((half.target() - (a.target() + b.target()) / 2.0).length() < 1e-12);
        assert!(((half.yaw + PI).rem_euclid(TAU) - PI + 0.1).abs() < 1e-12, "{}", half.yaw);
        assert!((half.pitch - 0.2).abs() < 1e-12);
    }

    #[test]
    fn nothing_makes_it_leave_the_finite_world() {
        let mut camera = Camera::home(&Bounds::EMPTY, f64::NAN);
        for x in [f64::NAN, f64::INFINITY, -1e300, 0.0, 1e300] {
            camera.orbit(x, x);
            camera.zoom(x);
            camera.pan(x, -x);
            camera.fly(x, -x, x);
            camera.look(x, x);
            camera.zoom_at(x, DVec2::new(x, -x), x);
            camera.set_projection(Projection::Orthographic);
            assert!(camera.view_projection(x).is_finite(), "after {x}");
            assert!(camera.distance() > 0.0);
        }
    }
}
