//! The handles of a box: which one is under the pointer, and where the box goes when it is dragged.

use crate::geom::{Bounds, Camera, Ray};
use glam::{DVec2, DVec3};

/// A face of a box: `axis` 0 to 2, at the upper or the lower end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoxFace {
    /// The axis that the face is perpendicular to.
    pub axis: usize,
    /// Whether it is the face at the larger coordinate.
    pub upper: bool,
}

impl BoxFace {
    /// All six: lower and upper for x, y and z.
    pub const ALL: [Self; 6] = [
        Self { axis: 0, upper: false },
        Self { axis: 0, upper: true },
        Self { axis: 1, upper: false },
        Self { axis: 1, upper: true },
        Self { axis: 2, upper: false },
        Self { axis: 2, upper: true },
    ];

    /// The handle of the face: its middle.
    pub fn handle(self, bounds: &Bounds) -> DVec3 {
        let mut middle = (DVec3::from(bounds.min) + DVec3::from(bounds.max)) / 2.0;
        middle[self.axis] = if self.upper { bounds.max[self.axis] } else { bounds.min[self.axis] };
        middle
    }
}

/// The face whose handle is within `reach` of the pointer; the one nearest to the camera if there are several.
///
/// `screen` is in normalised coordinates, `reach` a fraction of half the screen's height.
pub fn pick(bounds: &Bounds, camera: &Camera, screen: DVec2, aspect: f64, reach: f64) -> Option<BoxFace> {
    let near = |face: &BoxFace| {
        let at = camera.project(face.handle(bounds), aspect)?;
        let away = (at - screen) * DVec2::new(aspect, 1.0);
        (away.length() <= reach).then(|| camera.distance_to(face.handle(bounds)))
    };
    let found = BoxFace::ALL.iter().filter_map(|face| Some((near(face)?, *face)));
    found.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, face)| face)
}

/// `bounds` with `face` moved along its axis to where `ray` passes closest, held inside `limits` and a little away
/// from the opposite face. Unchanged if the ray runs along the axis.
pub fn drag(bounds: &Bounds, face: BoxFace, ray: &Ray, limits: &Bounds) -> Bounds {
    let axis = DVec3::AXES[face.axis];
    let along = ray.direction.dot(axis);
    let across = 1.0 - along * along;
    if across < 1e-4 {
        return *bounds;
    }
    // The point of the axis line through the handle that is closest to the ray.
    let from = ray.origin - face.handle(bounds);
    let moved = (from.dot(axis) - along * from.dot(ray.direction)) / across;
    let place = face.handle(bounds)[face.axis] + moved;
    let mut out = *bounds;
    let gap = (limits.max[face.axis] - limits.min[face.axis]).max(0.0) * 0.01;
    let (low, high) = (limits.min[face.axis], limits.max[face.axis]);
    if face.upper {
        out.max[face.axis] = place.min(high).max(bounds.min[face.axis] + gap);
    } else {
        out.min[face.axis] = place.max(low).min(bounds.max[face.axis] - gap);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Bounds = Bounds { min: [0.0; 3], max: [4.0; 3] };
    const ROI: Bounds = Bounds { min: [1.0; 3], max: [3.0, 2.0, 2.5] };

    #[test]
    fn the_handle_under_the_pointer_is_picked_and_follows_it() {
        let camera = Camera::home(&LIMITS, 1.6);
        for face in BoxFace::ALL {
            let handle = face.handle(&ROI);
            let screen = camera.project(handle, 1.6).unwrap();
            let picked = pick(&ROI, &camera, screen, 1.6, 0.03).unwrap();
            let closer = picked.handle(&ROI).distance(camera.eye()) < handle.distance(camera.eye());
            assert!(picked == face || closer, "{face:?} gave {picked:?}");
            // A pointer on the place 0.3 further along the axis brings the face there.
            let mut wanted = handle;
            wanted[face.axis] += 0.3;
            let ray = camera.ray(camera.project(wanted, 1.6).unwrap(), 1.6);
            let moved = drag(&ROI, face, &ray, &LIMITS);
            assert!(face.handle(&moved).distance(wanted) < 1e-9, "{face:?}: {moved:?}");
        }
        assert_eq!(pick(&ROI, &camera, DVec2::new(0.95, 0.95), 1.6, 0.03), None);
    }

    #[test]
    fn faces_stay_inside_the_limits_and_apart() {
        for face in BoxFace::ALL {
            for far in [-100.0, 100.0] {
                let mut origin = face.handle(&ROI);
                origin[face.axis] = far;
                let direction = DVec3::AXES[(face.axis + 1) % 3];
                let moved = drag(&ROI, face, &Ray { origin: origin - direction * 50.0, direction }, &LIMITS);
                for axis in 0..3 {
                    assert!(LIMITS.min[axis] <= moved.min[axis] && moved.max[axis] <= LIMITS.max[axis]);
                    assert!(moved.max[axis] - moved.min[axis] >= 0.04 - 1e-12, "{moved:?}");
                }
            }
        }
    }

    #[test]
    fn a_ray_along_the_axis_moves_nothing() {
        let ray = Ray { origin: DVec3::new(2.0, 1.5, -9.0), direction: DVec3::Z };
        assert_eq!(drag(&ROI, BoxFace { axis: 2, upper: true }, &ray, &LIMITS), ROI);
    }
}
