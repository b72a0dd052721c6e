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

/// Triangles, lines or points alone, with normals and values at the points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PolyData {
    /// Points in model units.
    pub positions: Vec<[f32; 3]>,
    /// One unit normal per point, or none at all.
    pub normals: Vec<[f32; 3]>,
    /// Names, and one value per point.
    pub fields: Vec<(String, Vec<f32>)>,
    /// Triangles as indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Lines through two or more points each.
    pub lines: Vec<Vec<u32>>,
}

impl PolyData {
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
        if let Some((name, values)) = self.fields.iter().find(|(_, values)| values.len() != points) {
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
