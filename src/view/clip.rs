//! Planes that cut away what lies beyond them.

use crate::geom::SinglePoints;
use glam::DVec3;

/// A plane `normal · p = offset`; the half-space in which the product is larger is cut away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipPlane {
    /// Points into the part that is cut away; any length but zero.
    pub normal: [f64; 3],
    /// `normal · p` of the points of the plane.
    pub offset: f64,
}

impl ClipPlane {
    /// The plane that cuts nothing away.
    pub const NOTHING: Self = Self { normal: [0.0, 0.0, 1.0], offset: f64::INFINITY };

    /// The plane that cuts the same away from a model whose points are stored in single precision.
    #[must_use]
    pub fn relative_to(&self, single: &SinglePoints) -> Self {
        let origin = DVec3::from(self.normal).dot(single.origin.into());
        Self { offset: (self.offset - origin) / single.unit, ..*self }
    }

    /// Whether a point is kept. What is computed to be on the plane is, whatever the rounding.
    pub fn keeps_point(&self, point: [f64; 3]) -> bool {
        let (normal, point) = (DVec3::from(self.normal), DVec3::from(point));
        let rounding = 1e-12 * (normal.abs().dot(point.abs()) + self.offset.abs());
        normal.dot(point) <= self.offset + rounding
    }

    /// Whether a tetrahedron with these corners is kept: its centroid is on the plane or behind it.
    pub fn keeps(&self, corners: [[f64; 3]; 4]) -> bool {
        let side = |p: [f64; 3]| (0..3).map(|i| self.normal[i] * p[i]).sum::<f64>();
        corners.map(side).iter().sum::<f64>() <= 4.0 * self.offset
    }
}
