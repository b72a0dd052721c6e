//! Planes that cut away what lies beyond them.

use glam::DVec3;

/// A plane `normal · p = offset`; the half-space in which the product is larger is cut away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipPlane {
    /// Points into the part that is cut away; any length but zero.
    pub normal: [f32; 3],
    /// `normal · p` of the points of the plane.
    pub offset: f32,
}

impl ClipPlane {
    /// The plane that cuts nothing away.
    pub const NOTHING: Self = Self { normal: [0.0, 0.0, 1.0], offset: f32::INFINITY };

    /// Whether a point is kept. What is computed to be on the plane is, whatever the rounding.
    pub fn keeps_point(&self, point: [f64; 3]) -> bool {
        let normal = DVec3::from(self.normal.map(f64::from));
        let offset = f64::from(self.offset);
        normal.dot(point.into()) <= offset + 1e-6 * (normal.length() + offset.abs())
    }

    /// Whether a tetrahedron with these corners is kept: its centroid is on the plane or behind it.
    pub fn keeps(&self, corners: [[f32; 3]; 4]) -> bool {
        let side = |p: [f32; 3]| (0..3).map(|i| f64::from(self.normal[i]) * f64::from(p[i])).sum::<f64>();
        corners.map(side).iter().sum::<f64>() <= 4.0 * f64::from(self.offset)
    }
}
