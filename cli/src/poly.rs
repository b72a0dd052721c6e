//! Where surfaces, lines and points go: a file whose ending says of what format it is.

use super::{files, npz, output};
use anyhow::Result;
use clap::ValueEnum;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use tetralod::io::{PolyData, write_csv, write_obj, write_ply, write_stl, write_vtp};
use tetralod::view::area;

/// A file to write, of a format that is known.
#[derive(Clone, Debug)]
pub struct Target {
    pub path: PathBuf,
    format: Format,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Vtp,
    Stl,
    Ply,
    Obj,
    Csv,
    Npz,
}

impl FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let path = PathBuf::from(text);
        match Format::from_str(&files::ending(&path), true) {
            Ok(format) => Ok(Self { path, format }),
            Err(_) => Err("the file's name must end in .vtp, .stl, .ply, .obj, .csv or .npz".to_owned()),
        }
    }
}

impl Target {
    /// Refuses a target that is one of the inputs, or that has no place.
    pub fn check<'a>(&self, inputs: impl IntoIterator<Item = &'a PathBuf>) -> Result<()> {
        files::check_output(&self.path, inputs)
    }

    /// Writes a surface; a table gets its points.
    pub fn write(&self, data: &PolyData) -> Result<()> {
        match self.format {
            Format::Csv => self.write_table(&points_table(data)),
            Format::Npz => npz::write_surface(data, &self.path),
            _ => files::write_file(&self.path, |out| {
                match self.format {
                    Format::Vtp => write_vtp(data, out)?,
                    Format::Stl => write_stl(data, out)?,
                    Format::Ply => write_ply(data, out)?,
                    Format::Obj | Format::Csv | Format::Npz => write_obj(data, out)?,
                }
                Ok(())
            }),
        }
    }

    /// Writes `data`, or `table` if the file is one.
    pub fn write_either(&self, data: &PolyData, table: &[(String, Vec<f64>)]) -> Result<()> {
        if self.format == Format::Csv { self.write_table(table) } else { self.write(data) }
    }

    fn write_table(&self, table: &[(String, Vec<f64>)]) -> Result<()> {
        write_table(&self.path, table)
    }
}

/// How much of a surface there is, as programs get it; the area is in square model units.
#[derive(Serialize)]
pub struct Amount {
    points: usize,
    triangles: usize,
    area: f64,
}

impl Amount {
    pub fn of(data: &PolyData) -> Self {
        Self {
            points: data.positions.len(),
            triangles: data.triangles.len(),
            area: area(&data.positions, &data.triangles),
        }
    }

    /// The same for people.
    pub fn rows(&self, target: &Target) -> Vec<(&'static str, String)> {
        vec![
            ("file", target.path.display().to_string()),
            ("points", output::count(self.points as u64)),
            ("triangles", output::count(self.triangles as u64)),
            ("area", output::number(self.area)),
        ]
    }
}

/// Writes a table as comma-separated values.
pub fn write_table(path: &Path, table: &[(String, Vec<f64>)]) -> Result<()> {
    files::write_file(path, |out| Ok(write_csv(table, out)?))
}

fn points_table(data: &PolyData) -> Vec<(String, Vec<f64>)> {
    let column = |points: &[[f32; 3]], i: usize| points.iter().map(|p| f64::from(p[i])).collect();
    let mut table: Vec<_> =
        (0..3).map(|i| (["x", "y", "z"][i].to_owned(), column(&data.positions, i))).collect();
    if !data.normals.is_empty() {
        table.extend((0..3).map(|i| (["nx", "ny", "nz"][i].to_owned(), column(&data.normals, i))));
    }
    for (name, values) in &data.fields {
        table.push((name.clone(), values.iter().map(|v| f64::from(*v)).collect()));
    }
    table
}
