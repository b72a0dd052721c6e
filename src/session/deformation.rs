//! Which vector displaces a mesh, how many times, and how far that reaches.

use crate::geom::Bounds;
use crate::mt::MtInfo;
use glam::DVec2;
use std::f64::consts::FRAC_PI_2;
use thiserror::Error;

/// A mesh that is displaced: each point goes by so many times the vector there.
///
/// A vector is linear in each tetrahedron, as fields are. So what is cut out of a mesh and then displaced is what would be cut out of the
/// displaced mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deformation {
    /// How many times the vector, apart from the phase.
    pub factor: f64,
    /// How much of it there is now, −1 to 1.
    pub part: f64,
    /// The numbers of the fields along x, y and z.
    pub fields: [usize; 3],
    /// The largest length that the ranges of the components allow at any time; 1 if they are all 0.
    pub largest: f64,
}

/// A volume lacks the vector that is to displace it.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("there is no vector {name:?} of three components; this volume has: {}", list(.vectors))]
pub struct UnknownVector {
    /// Which one.
    pub name: String,
    /// Those that it has.
    pub vectors: Vec<String>,
}

fn list(vectors: &[String]) -> String {
    if vectors.is_empty() { "none".to_owned() } else { vectors.join(", ") }
}

impl Deformation {
    /// The largest displacement without a factor, as a part of the diagonal of the domain's box.
    pub const AUTOMATIC: f64 = 0.1;

    /// By the vector of a name in a volume in this box; its components are the fields that the file says so of, those of this name with `_x`,
    /// `_y` and `_z`, or three that the name lists with commas between them. Of several time steps that of field `shown` counts, if the vector
    /// has it.
    ///
    /// Without a factor nothing goes farther than [`Deformation::AUTOMATIC`] of the diagonal: by the ranges of the components, so that the factor
    /// is the same in all meshes and at all times. With a phase, a part of a period, the displacement is that times its sine.
    ///
    /// # Errors
    /// If there is no such vector.
    ///
    /// # Panics
    /// If there is no field `shown`.
    pub fn new(
        (info, shown, bounds): (&MtInfo, usize, &Bounds),
        name: &str,
        factor: Option<f64>,
        phase: Option<f64>,
    ) -> Result<Self, UnknownVector> {
        let fields = components(info, shown, name)?;
        let longest = |field: usize| {
            info.range_at_all_times(field).into_iter().fold(0.0, |m: f64, end| m.max(end.abs()))
        };
        let largest = fields.map(longest).into_iter().fold(0.0, f64::hypot);
        let largest = if largest > 0.0 && largest.is_finite() { largest } else { 1.0 };
        let automatic = Self::AUTOMATIC * bounds.diagonal() / largest;
        let automatic = if automatic.is_finite() { automatic } else { 1.0 };
        Ok(Self { factor: factor.unwrap_or(automatic), part: part(phase), fields, largest })
    }

    /// How far, in model units, a point goes whose vector is as long as [`Deformation::largest`].
    pub fn reach(&self) -> f64 {
        self.factor * self.part * self.largest
    }

    /// Points of a mesh or a surface where they are displaced to, given the vector's components at each of them.
    pub fn moved(&self, positions: &[[f64; 3]], [x, y, z]: [&[f64]; 3]) -> Vec<[f64; 3]> {
        let times = self.factor * self.part;
        let all = positions.iter().zip(x).zip(y).zip(z);
        all.map(|(((p, x), y), z)| [p[0] + times * x, p[1] + times * y, p[2] + times * z]).collect()
    }

    /// The box around all of a model in a box, displaced by this factor at any time: all of the displacement, or any part of it if it
    /// `swings`.
    pub fn bounds(&self, info: &MtInfo, swings: bool, bounds: &Bounds) -> Bounds {
        let (mut min, mut max) = (bounds.min, bounds.max);
        for (axis, field) in self.fields.into_iter().enumerate() {
            let [a, b] = info.range_at_all_times(field).map(|end| self.factor * end);
            let most = a.abs().max(b.abs());
            min[axis] += if swings { -most } else { a.min(b) };
            max[axis] += if swings { most } else { a.max(b) };
        }
        let is_finite = min.iter().chain(&max).all(|x| x.is_finite());
        if is_finite { Bounds { min, max } } else { *bounds }
    }

    /// How far the place of a reference vertex in a displaced mesh is from that in the displaced input, at most, given the errors of the components
    /// in the mesh, as [`Session::error_in`](super::Session::error_in) has them: what these amount to, and how far the boundary may be moved.
    pub fn bound(&self, info: &MtInfo, errors: [f64; 3]) -> f64 {
        let components =
            self.fields.into_iter().zip(errors).map(|(field, error)| info.field_bound(field, error));
        let moved = info.boundary_bound(errors.into_iter().fold(f64::INFINITY, f64::min));
        // What moves the boundary is an error of each field.
        (self.factor * self.part).abs() * components.fold(0.0, f64::hypot) + moved
    }
}

/// The sine of a phase: all without one.
fn part(phase: Option<f64>) -> f64 {
    // Exact at quarters of a period.
    let quarters = 4.0 * phase.unwrap_or(0.25);
    let rest = quarters - quarters.round();
    let DVec2 { x: cos, y: sin } = DVec2::from_angle(rest * FRAC_PI_2);
    [sin, cos, -sin, -cos][quarters.round().rem_euclid(4.0) as usize & 3]
}

/// The components along x, y and z.
fn components(info: &MtInfo, shown: usize, name: &str) -> Result<[usize; 3], UnknownVector> {
    let fields = &info.fields;
    let find = |is: &dyn Fn(usize) -> bool| {
        let all = || (0..fields.len()).filter(|field| is(*field));
        all().find(|field| fields[*field].time == fields[shown].time).or_else(|| all().next())
    };
    let is_part = |field: usize, component: u8| {
        fields[field].vector.as_ref().is_some_and(|v| v.name == name && v.component == Some(component))
    };
    let part = |component: u8| find(&|field| is_part(field, component));
    let named = |axis: &str| info.step_of(&format!("{name}{axis}"), shown);
    let told = [part(0), part(1), part(2)];
    let mut listed = name.split(',').map(|name| info.step_of(name, shown));
    let listed = [listed.next(), listed.next(), listed.next(), listed.next()];
    let listed = if let [Some(x), Some(y), Some(z), None] = listed { [x, y, z] } else { [None; 3] };
    // What has a fourth component is no vector in space.
    let told = if part(3).is_none() { told } else { [None; 3] };
    for found in [told, ["_x", "_y", "_z"].map(named), listed] {
        if let [Some(x), Some(y), Some(z)] = found {
            return Ok([x, y, z]);
        }
    }
    let mut vectors: Vec<String> = Vec::new();
    let parts = fields.iter().filter_map(|field| field.vector.as_ref());
    let has = |vector: &str, component: u8| {
        fields
            .iter()
            .any(|f| f.vector.as_ref().is_some_and(|v| v.name == vector && v.component == Some(component)))
    };
    for vector in parts.map(|part| &part.name) {
        if has(vector, 2) && !has(vector, 3) && !vectors.contains(vector) {
            vectors.push(vector.clone());
        }
    }
    Err(UnknownVector { name: name.to_owned(), vectors })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn a_displacement_swings_through_its_period() {
        assert_eq!([None, Some(0.25), Some(1.25)].map(part), [1.0; 3]);
        assert_eq!([0.0, 0.5, 1.0, -3.0].map(|phase| part(Some(phase))), [0.0; 4]);
        assert_eq!(part(Some(0.75)), -1.0);
        for i in -20..20 {
            let phase = f64::from(i) / 13.0;
            assert!((part(Some(phase)) - (TAU * phase).sin()).abs() < 1e-14, "{phase}");
        }
    }
}
