//! Is this tetrahedron fine enough? Pure functions of a tetrahedron and an error.

use super::Request;
use crate::geom::LatticeBox;
use crate::geom::tet_meets_box;
use crate::mt::ErrorCode;
use crate::mt::MtInfo;

/// Says where a mesh is wanted at what error. See [`crate::refine`] for what monotone means.
pub trait Criterion {
    /// The largest error that is good enough in the selected part.
    fn tolerance(&self) -> ErrorCode;

    /// Whether a tetrahedron whose removal has this error belongs to the selected part. `levels` are those of
    /// [`Criterion::field`].
    fn selects(&self, corners: &[[i32; 3]; 4], levels: &[i32; 4], error: ErrorCode) -> bool;

    /// Whether everything is selected, so that [`Criterion::selects`] need not be asked.
    fn is_uniform(&self) -> bool {
        false
    }

    /// Whether the criterion is monotone. One that is not is answered from the base mesh each time.
    fn is_monotone(&self) -> bool {
        true
    }

    /// The field whose levels [`Criterion::selects`] wants to see.
    fn field(&self) -> usize {
        0
    }
}

/// The criterion of a [`Request`]: an error bound, in a box and around isovalues.
#[derive(Clone, Debug)]
pub struct LodCriterion {
    tolerance: ErrorCode,
    /// The region of interest in lattice units.
    roi: Option<[[f64; 2]; 3]>,
    /// Lattice units per unit of error, by which the region is widened: the boundary may be off by that much.
    roi_margin: [f64; 3],
    /// Isovalues in levels.
    isolevels: Vec<f64>,
    /// Levels per unit of error.
    level_margin: f64,
    field: usize,
}

impl LodCriterion {
    /// The criterion of `request` for an MT. A field that is not there is the caller's to refuse.
    pub fn new(info: &MtInfo, request: &Request) -> Self {
        let lattice = &info.lattice;
        let field = &info.fields[request.field.min(info.fields.len() - 1)];
        let to_lattice = |x: f64, axis: usize| (x - lattice.origin[axis]) / lattice.step[axis];
        Self {
            tolerance: ErrorCode::at_most(request.error),
            roi: request.roi.map(|roi| {
                [0, 1, 2].map(|i| [to_lattice(roi.min[i], i).floor(), to_lattice(roi.max[i], i).ceil()])
            }),
            roi_margin: lattice.step.map(|step| info.displacement_per_error / step),
            isolevels: request.isovalues.iter().map(|v| (v - field.origin) / field.step).collect(),
            level_margin: field.range() / field.step,
            field: request.field,
        }
    }

    fn roi_meets(&self, roi: [[f64; 2]; 3], corners: &[[i32; 3]; 4], error: f64) -> bool {
        // Casts saturate; i32 coordinates are far inside, so a saturated side is as good as an infinite one.
        let widened = |axis: usize, side: f64| {
            let margin = (error * self.roi_margin[axis]).ceil();
            (roi[axis][usize::from(side > 0.0)] + side * margin) as i32
        };
        let lattice_box =
            LatticeBox { min: [0, 1, 2].map(|i| widened(i, -1.0)), max: [0, 1, 2].map(|i| widened(i, 1.0)) };
        tet_meets_box(corners, &lattice_box)
    }

    fn iso_passes(&self, levels: &[i32; 4], error: f64) -> bool {
        // Half a level: the reference values themselves were rounded to levels.
        let margin = error * self.level_margin + 0.5;
        let low = f64::from(levels.iter().copied().fold(i32::MAX, i32::min)) - margin;
        let high = f64::from(levels.iter().copied().fold(i32::MIN, i32::max)) + margin;
        self.isolevels.iter().any(|&iso| low <= iso && iso <= high)
    }
}

impl Criterion for LodCriterion {
    fn tolerance(&self) -> ErrorCode {
        self.tolerance
    }

    fn selects(&self, corners: &[[i32; 3]; 4], levels: &[i32; 4], error: ErrorCode) -> bool {
        let error = error.error();
        (self.isolevels.is_empty() || self.iso_passes(levels, error))
            && self.roi.is_none_or(|roi| self.roi_meets(roi, corners, error))
    }

    fn is_uniform(&self) -> bool {
        self.roi.is_none() && self.isolevels.is_empty()
    }

    /// One of the tetrahedra from which another was made meets the box and one passes an isovalue, but it need not
    /// be the same one.
    fn is_monotone(&self) -> bool {
        self.roi.is_none() || self.isolevels.is_empty()
    }

    fn field(&self) -> usize {
        self.field
    }
}
