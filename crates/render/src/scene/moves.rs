//! What displaces a scene: the vectors at the points of a mesh.

use super::error::Result;
use super::input::Input;
use super::{SceneError, SceneState};
use std::borrow::Cow;
use tetralod::geom::Bounds;
use tetralod::mt::MtInfo;
use tetralod::session::Deformation;
use tetralod::view::Slope;

/// The vectors at the points of a mesh, in units in which the longest have length 1.
pub(super) struct Moves<'a> {
    components: [Cow<'a, [f64]>; 3],
    scale: f64,
}

impl<'a> Moves<'a> {
    /// Those of a scene; none if it is not displaced.
    pub fn of(input: &Input<'a>) -> Result<Option<Self>> {
        let deformation = deformation(input.state, input.info, input.shown, &input.bounds)?;
        Ok(deformation.map(|Deformation { fields, largest, .. }| {
            let components = fields.map(|field| (input.fields)(field));
            Self { components, scale: 1.0 / largest }
        }))
    }

    pub fn components(&self) -> [&[f64]; 3] {
        [0, 1, 2].map(|i| &*self.components[i])
    }

    /// At the points of the mesh.
    pub fn at_points(&self) -> Vec<[f64; 3]> {
        self.at(<[f64]>::to_vec)
    }

    /// Where `interpolate` finds the values of what has one at each point of the mesh.
    pub fn at(&self, interpolate: impl Fn(&[f64]) -> Vec<f64>) -> Vec<[f64; 3]> {
        let [x, y, z] = self.components().map(interpolate);
        let all = x.iter().zip(&y).zip(&z);
        all.map(|((x, y), z)| [*x, *y, *z].map(|x| self.scale * x)).collect()
    }

    /// The slope of these, given that of the vectors.
    pub fn scaled(&self, slope: Slope) -> Slope {
        slope.map(|along| along.map(|x| self.scale * x))
    }
}

/// How a scene displaces a volume in a box of which field number `shown` is shown; none if it does not.
pub(super) fn deformation(
    state: &SceneState,
    info: &MtInfo,
    shown: usize,
    bounds: &Bounds,
) -> Result<Option<Deformation>> {
    let Some(deform) = &state.deform else { return Ok(None) };
    let found = Deformation::new((info, shown, bounds), &deform.field, deform.factor, deform.phase);
    found.map(Some).map_err(|unknown| SceneError::state("deform.field", unknown.to_string()))
}
