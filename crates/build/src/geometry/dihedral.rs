//! A bound for the dihedral angles of the cells that a build makes.

use crate::lattice::quantize::Quantized;
use crate::{BuildConfig, BuildError};
use glam::DVec3;
use tetralod::geom::sharpness;

/// The largest bound that can be asked for, in degrees. No tetrahedron has larger angles only than a regular one: 70.5.
const MOST: f64 = 70.0;

/// Cells must not become sharper than this, or than the sharpest cell that they replace.
pub(crate) struct LeastAngle {
    sharpness: f64,
    /// The steps of the lattice along the axes, in the largest of them.
    steps: DVec3,
}

impl LeastAngle {
    /// The bound of a configuration; none if it has none.
    pub fn of(config: &BuildConfig, quantized: &Quantized) -> Result<Option<Self>, BuildError> {
        let Some(degrees) = config.min_dihedral else { return Ok(None) };
        if !(0.0..=MOST).contains(&degrees) {
            return Err(BuildError::Option { name: "min-dihedral", expected: "0 to 70 degrees" });
        }
        let steps = DVec3::from(quantized.lattice.step);
        Ok(Some(Self { sharpness: sharpness_of(degrees), steps: steps / steps.max_element() }))
    }

    /// Whether tetrahedra may take the place of others.
    pub fn allows(
        &self,
        old: impl Iterator<Item = [[i32; 3]; 4]>,
        new: impl Iterator<Item = [[i32; 3]; 4]>,
    ) -> bool {
        let new = self.sharpest(new);
        new <= self.sharpness || new <= self.sharpest(old)
    }

    fn sharpest(&self, tets: impl Iterator<Item = [[i32; 3]; 4]>) -> f64 {
        let of = |tet: [[i32; 3]; 4]| sharpness(tet.map(|q| DVec3::from(q.map(f64::from)) * self.steps));
        tets.map(of).fold(-1.0, f64::max)
    }
}

/// The [`sharpness`] of an angle in degrees. The cosine is that of libm, which is the same on every platform.
pub(crate) fn sharpness_of(degrees: f64) -> f64 {
    let cosine = libm::cos(degrees.to_radians());
    cosine * cosine.abs()
}
