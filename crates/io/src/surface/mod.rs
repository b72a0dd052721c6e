//! Surfaces, lines and points, written for other programs.

mod csv;
mod obj;
mod ply;
mod stl;
mod vtp;

pub use csv::write_csv;
pub use obj::write_obj;
pub use ply::write_ply;
pub use stl::write_stl;
pub use vtp::write_vtp;

use std::io;
use tetralod::geom::keeps_in_single;

/// Triangles, lines or points alone, with normals and values at the points. All numbers are absolute.
///
/// Files hold positions and values in single precision where that moves them by half a step at most, else in double precision.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PolyData {
    /// Points in model units.
    pub positions: Vec<[f64; 3]>,
    /// The smallest difference of positions that counts, in model units, as the step of a lattice; 0 if all digits count.
    pub step: f64,
    /// One unit normal per point, or none at all.
    pub normals: Vec<[f32; 3]>,
    /// Numbers at the points.
    pub fields: Vec<PointValues>,
    /// Triangles as indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Lines through two or more points each.
    pub lines: Vec<Vec<u32>>,
}

/// One number per point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointValues {
    /// What they are.
    pub name: String,
    /// One for each point.
    pub values: Vec<f64>,
    /// The smallest difference that counts, as the step of the levels of a field; 0 if all digits count.
    pub step: f64,
}

impl PointValues {
    /// Whether files hold them in single precision.
    pub fn is_single(&self) -> bool {
        is_single(&self.values, self.step)
    }
}

fn is_single(numbers: &[f64], step: f64) -> bool {
    let finite = numbers.iter().map(|number| number.abs()).filter(|number| number.is_finite());
    keeps_in_single(finite.fold(0.0, f64::max), step)
}

impl PolyData {
    /// Whether files hold positions in single precision.
    pub fn is_single(&self) -> bool {
        is_single(self.positions.as_flattened(), self.step)
    }

    /// Whether there is nothing but points.
    fn is_points(&self) -> bool {
        self.triangles.is_empty() && self.lines.is_empty()
    }

    /// That every array is as long as it must be, and every index is one of a point.
    fn check(&self) -> io::Result<()> {
        let points = self.positions.len();
        if !self.normals.is_empty() && self.normals.len() != points {
            return Err(unfit(format!("{} normals for {points} points", self.normals.len())));
        }
        if let Some(PointValues { name, values, .. }) =
            self.fields.iter().find(|field| field.values.len() != points)
        {
            return Err(unfit(format!("field \"{name}\" has {} values for {points} points", values.len())));
        }
        let mut named = self.triangles.iter().flatten().chain(self.lines.iter().flatten());
        match named.find(|v| **v as usize >= points) {
            Some(v) => Err(unfit(format!("a cell refers to point {v}, but there are {points} points"))),
            None => Ok(()),
        }
    }
}

fn unfit(problem: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, problem)
}
