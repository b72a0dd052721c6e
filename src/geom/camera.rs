//! An orbit camera: it looks at a target from a distance, and turns around it with z up.

use crate::geom::Bounds;
use glam::dcamera::rh::proj::directx::perspective;
use glam::dcamera::rh::view::look_at_mat4;
use glam::{DMat4, DVec2, DVec3, Mat4};
use std::f64::consts::{FRAC_PI_2, TAU};

/// The camera stops this far (in radians) from looking straight up or down, where "right" loses its meaning.
const POLE_GAP: f64 = 0.01;

/// A half-line in model space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Where it goes; length 1.
    pub direction: DVec3,
}

/// A perspective camera that orbits a target. All verbs keep it finite and outside of singular positions.
///
/// Screen points are given in *normalised* coordinates: x from −1 (left) to 1 (right), y from −1 (bottom) to
/// 1 (top). `aspect` is width divided by height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    target: DVec3,
    distance: f64,
    yaw: f64,
    pitch: f64,
    /// Full vertical angle of view.
    fov: f64,
    /// The sphere around what there is to see: sets the clipping planes and the limits of zooming.
    centre: DVec3,
    radius: f64,
}

impl Camera {
    /// A camera that sees all of `bounds` from the front, a little to the right and from above.
    ///
    /// Empty or unbounded boxes are taken for the unit cube.
    pub fn home(bounds: &Bounds, aspect: f64) -> Self {
        let unit = Bounds { min: [0.0; 3], max: [1.0; 3] };
        let bounds = if bounds.diagonal().is_finite() && bounds.diagonal() > 0.0 { bounds } else { &unit };
        let centre = (DVec3::from(bounds.min) + DVec3::from(bounds.max)) / 2.0;
        let radius = bounds.diagonal() / 2.0;
        let mut camera =
            Self { target: centre, distance: radius, yaw: -1.05, pitch: 0.42, fov: 0.6, centre, radius };
        camera.distance = camera.fitting_distance(bounds, aspect);
        camera
    }

    /// The smallest distance at which all corners of `bounds` are in view, and a little more.
    fn fitting_distance(&self, bounds: &Bounds, aspect: f64) -> f64 {
        let high = (self.fov / 2.0).tan();
        let wide = high * positive(aspect);
        let needed = (0..8).map(|corner: usize| {
            let place = |axis: usize| if corner >> axis & 1 == 0 { bounds.min } else { bounds.max }[axis];
            let p = DVec3::new(place(0), place(1), place(2)) - self.target;
            let across = (p.dot(self.right()).abs() / wide).max(p.dot(self.up()).abs() / high);
            across - p.dot(self.forward())
        });
        needed.fold(self.radius, f64::max) * 1.08
    }

    /// Where the camera is.
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
        let limit = FRAC_PI_2 - POLE_GAP;
        self.pitch = (self.pitch + finite(pitch)).clamp(-limit, limit);
    }

    /// Multiplies the distance; factors below 1 come nearer. Stops close to the target and far outside.
    pub fn zoom(&mut self, factor: f64) {
        let factor = if factor.is_finite() && factor > 0.0 { factor } else { 1.0 };
        self.distance = (self.distance * factor).clamp(self.radius * 0.02, self.radius * 40.0);
    }

    /// Moves the target so that what is seen moves by this fraction of the screen's height to the right and up.
    pub fn pan(&mut self, right: f64, up: f64) {
        let height = 2.0 * self.distance * (self.fov / 2.0).tan();
        let moved = self.target - (self.right() * finite(right) + self.up() * finite(up)) * height;
        // The target stays near the model, so that it cannot get lost.
        self.target = self.centre + (moved - self.centre).clamp_length_max(self.radius * 2.0);
    }

    /// Near and far clipping distance: as tight around the model as the precision of the depth buffer wants.
    fn clip(&self) -> [f64; 2] {
        let centre = (self.centre - self.eye()).dot(self.forward());
        let far = (centre + self.radius * 1.1).max(self.radius * 0.1);
        [(centre - self.radius * 1.1).max(far * 0.002), far]
    }

    fn matrix(&self, aspect: f64) -> DMat4 {
        let [near, far] = self.clip();
        perspective(self.fov, positive(aspect), near, far) * look_at_mat4(self.eye(), self.target, DVec3::Z)
    }

    /// From model space to clip space (depth 0 to 1).
    pub fn view_projection(&self, aspect: f64) -> Mat4 {
        self.matrix(aspect).as_mat4()
    }

    /// The normalised screen point of `p`; `None` if it lies behind the camera.
    pub fn project(&self, p: DVec3, aspect: f64) -> Option<DVec2> {
        let clip = self.matrix(aspect) * p.extend(1.0);
        (clip.w > 0.0).then(|| DVec2::new(clip.x, clip.y) / clip.w)
    }

    /// From the eye at distance 1 along the direction of view: half the width of the picture, half its height, and its middle.
    pub fn frustum(&self, aspect: f64) -> [DVec3; 3] {
        let half = (self.fov / 2.0).tan();
        [self.right() * (half * positive(aspect)), self.up() * half, self.forward()]
    }

    /// The ray of sight through a normalised screen point.
    pub fn ray(&self, screen: DVec2, aspect: f64) -> Ray {
        let [right, up, forward] = self.frustum(aspect);
        let direction = (forward + right * screen.x + up * screen.y).normalize();
        Ray { origin: self.eye(), direction }
    }
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

    fn corners(b: &Bounds) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            DVec3::from([0, 1, 2].map(|axis| if i >> axis & 1 == 0 { b.min[axis] } else { b.max[axis] }))
        })
    }

    #[test]
    fn home_sees_the_whole_box_on_wide_and_on_narrow_screens() {
        for aspect in [0.3, 0.46, 1.0, 1.8, 4.0] {
            let camera = Camera::home(&BOX, aspect);
            for corner in corners(&BOX) {
                let clip = camera.matrix(aspect) * corner.extend(1.0);
                let p = clip.truncate() / clip.w;
                assert!(
                    p.x.abs() <= 1.0 && p.y.abs() <= 1.0 && (0.0..=1.0).contains(&p.z),
                    "{corner} at {p}"
                );
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

    #[test]
    fn nothing_makes_it_leave_the_finite_world() {
        let mut camera = Camera::home(&Bounds::EMPTY, f64::NAN);
        for x in [f64::NAN, f64::INFINITY, -1e300, 0.0, 1e300] {
            camera.orbit(x, x);
            camera.zoom(x);
            camera.pan(x, -x);
            assert!(camera.view_projection(x).is_finite(), "after {x}");
            assert!(camera.distance() > 0.0);
        }
    }
}
