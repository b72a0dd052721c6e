//! The domain in model units, as criteria compute in it.

use super::criterion::TetData;
use crate::geom::Lattice;
use crate::mt::MtInfo;
use glam::DVec3;

/// The domain: criteria compute in model units from its middle.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Frame {
    lattice: Lattice,
    pub middle: DVec3,
    /// From the lattice to there.
    shift: DVec3,
    step: DVec3,
    /// No point of a mesh is further from the middle.
    pub reach: f64,
    /// Nor along the axes than this.
    pub half: DVec3,
    /// The displacement that counts as an error of 1.
    pub displacement: f64,
    /// Updates of the MT.
    updates: f64,
    /// By how much regions are widened for the first update beyond its error. It falls to 0 for the last one, by more
    /// than the rounding error from each update to the next. Parents have smaller numbers than their children, so
    /// rounding cannot select a child without its parent.
    guard: f64,
}

/// Rounding of the functions of shapes is below this part of the domain's size.
const ROUNDING: f64 = 1.0 / (1_u64 << 44) as f64;

impl Frame {
    pub fn new(info: &MtInfo) -> Self {
        let lattice = info.lattice;
        let step = DVec3::from(lattice.step);
        let size = step * f64::from(1_u32 << lattice.bits);
        let middle = DVec3::from(lattice.origin) + 0.5 * size;
        let reach = 0.5 * size.length();
        let updates = f64::from(info.updates.max(1));
        Self {
            lattice,
            middle,
            shift: -0.5 * size,
            step,
            reach,
            half: 0.5 * size,
            displacement: info.displacement_per_error,
            updates,
            guard: 4.0 * ROUNDING * updates * reach,
        }
    }

    /// Corners in model units, from the middle.
    #[inline]
    pub fn place(&self, corners: &[[i32; 3]; 4]) -> [DVec3; 4] {
        corners.map(|q| {
            let q = DVec3::new(f64::from(q[0]), f64::from(q[1]), f64::from(q[2]));
            self.shift + self.step * q
        })
    }

    /// How far from a region a tetrahedron may be and still count: as far as its error may have displaced it.
    #[inline]
    pub fn margin(&self, tet: &TetData<'_>) -> f64 {
        tet.error.error() * self.displacement + self.guard * (1.0 - f64::from(tet.update.0) / self.updates)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mt::{ErrorCode, MtKind, UpdateId};

    #[test]
    fn margins_fall_by_more_than_rounding_from_each_update_to_the_next() {
        let updates = 1000;
        let info = MtInfo {
            kind: MtKind::HalfEdge,
            lattice: Lattice { origin: [5.8e6, 0.0, -1.0], step: [0.1; 3], bits: 6 },
            fields: Vec::new(),
            vertices: 0,
            tetrahedra: 0,
            updates,
            displacement_per_error: 1.0,
            quantization: 0.0,
            bounds: None,
        };
        let frame = Frame::new(&info);
        let margin = |update: u32| {
            let levels = |_: usize| [0; 4];
            let (corners, error, update) = (&[[0; 3]; 4], ErrorCode::ZERO, UpdateId(update));
            frame.margin(&TetData { corners, levels: &levels, error, errors: &[], update, region: 0 })
        };
        for update in 1..updates {
            assert!(margin(update - 1) - margin(update) > ROUNDING * frame.reach, "{update}");
        }
        assert!(margin(0) < 1e-6 * frame.reach);
    }
}
