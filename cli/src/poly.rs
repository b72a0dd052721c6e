//! Where surfaces, lines and points go: a file whose ending says of what format it is.

use super::{files, npz, output};
use anyhow::Result;
use clap::ValueEnum;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use tetralod::view::area;
use tetralod_io::{PolyData, write_csv, write_obj, write_ply, write_stl, write_vtp};

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

    /// Whether it is a table.
    pub fn is_table(&self) -> bool {
        self.format == Format::Csv
    }

    /// Writes a surface; a table gets its points. Returns what positions in the file are relative to.
    pub fn write(&self, data: &PolyData) -> Result<Origin> {
        match self.format {
            Format::Csv => self.write_table(&points_table(data))?,
            Format::Npz => npz::write_surface(data, &self.path)?,
            Format::Stl => {
                let mut origin = [0.0; 3];
                files::write_file(&self.path, |out| {
                    origin = write_stl(data, out)?;
                    Ok(())
                })?;
                return Ok((origin != [0.0; 3]).then_some(origin));
            }
            _ => files::write_file(&self.path, |out| {
                match self.format {
                    Format::Vtp => write_vtp(data, out)?,
                    Format::Ply => write_ply(data, out)?,
                    _ => write_obj(data, out)?,
                }
                Ok(())
            })?,
        }
        Ok(None)
    }

    /// Writes `data`, or `table` if the file is one.
    pub fn write_either(&self, data: &PolyData, table: &[(String, Vec<f64>)]) -> Result<()> {
        if self.is_table() { self.write_table(table) } else { self.write(data).map(|_| ()) }
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
    /// What positions in the file are relative to, where its format has no place for the whole numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    origin: Origin,
}

/// What positions in a file are relative to, in model units; none if they are absolute.
pub type Origin = Option<[f64; 3]>;

impl Amount {
    pub fn of(data: &PolyData, origin: Origin) -> Self {
        Self {
            points: data.positions.len(),
            triangles: data.triangles.len(),
            area: area(&data.positions, &data.triangles),
            origin,
        }
    }

    /// The amounts for people: a line for each.
    pub fn rows(&self, target: &Target) -> Vec<(&'static str, String)> {
        let mut rows = vec![
            ("file", target.path.display().to_string()),
            ("points", output::count(self.points as u64)),
            ("triangles", output::count(self.triangles as u64)),
            ("area", output::number(self.area)),
        ];
        if let Some([x, y, z]) = self.origin {
            let reason = "STL has no place for all of their digits";
            rows.push((
                "origin",
                format!("{x},{y},{z}: positions in the file are relative to it, since {reason}"),
            ));
        }
        rows
    }
}

/// Writes a table as comma-separated values.
pub fn write_table(path: &Path, table: &[(String, Vec<f64>)]) -> Result<()> {
    files::write_file(path, |out| Ok(write_csv(table, out)?))
}

/// The columns of a table with these places.
pub fn coordinates(places: impl Iterator<Item = [f64; 3]> + Clone) -> [(String, Vec<f64>); 3] {
    [(0, "x"), (1, "y"), (2, "z")].map(|(i, name)| (name.to_owned(), places.clone().map(|p| p[i]).collect()))
}

fn points_table(data: &PolyData) -> Vec<(String, Vec<f64>)> {
    let mut table = Vec::from(coordinates(data.positions.iter().copied()));
    for (i, name) in ["nx", "ny", "nz"].into_iter().enumerate().filter(|_| !data.normals.is_empty()) {
        table.push((name.to_owned(), data.normals.iter().map(|n| f64::from(n[i])).collect()));
    }
    table.extend(data.fields.iter().map(|field| (field.name.clone(), field.values.clone())));
    table
}
