//! What a build must keep: the options that say so, and what is reported of it.

use super::parse::number;
use super::{files, output};
use anyhow::{Context, Result, anyhow};
use serde::Serialize;
use std::path::{Path, PathBuf};
use tetralod::mesh::TetMesh;
use tetralod::mt::{Mt, MultiTessellation};
use tetralod_build::measure::{CellAngles, CellsBelow};

/// Heading in the help of these options.
const KEEP: &str = "What must stay";

/// What a build must keep.
#[derive(clap::Args)]
pub struct RestrictionOptions {
    /// Make no cell with a dihedral angle below so many degrees, 0 to 70, except in the place of one that has a smaller one already.
    #[arg(long, value_name = "DEG", value_parser = |text: &str| degrees(text, 0.0, 70.0), help_heading = KEEP)]
    pub min_dihedral: Option<f64>,
    /// Keep creases and corners where flat parts of the boundary meet at so many degrees or more, 1 to 90 [default: 60].
    #[arg(long, value_name = "DEG", value_parser = |text: &str| degrees(text, 1.0, 90.0), help_heading = KEEP)]
    pub feature_angle: Option<f64>,
    /// Keep the surfaces between cells of which this label differs, as those of materials (repeatable): integers at cells, or at points,
    /// of which a cell has the least one; or `components`, the parts that hang together by faces. Flat parts of these surfaces are still made
    /// coarser. With method decimate.
    #[arg(long = "preserve", value_name = "LABEL", help_heading = KEEP)]
    pub preserve: Vec<String>,
    /// Let curved parts of these surfaces move by so many model units at most, where they have two regions beside them and do not end.
    #[arg(long, value_name = "X", requires = "preserve", value_parser = length, help_heading = KEEP)]
    pub preserve_within: Option<f64>,
    /// Keep the points of the mesh at these places in all meshes: a file with three coordinates in each line.
    #[arg(long, value_name = "FILE", help_heading = KEEP)]
    keep_points: Option<PathBuf>,
}

impl RestrictionOptions {
    /// The places of the points that stay.
    pub fn points(&self) -> Result<Vec<[f64; 3]>> {
        let read = |path: &PathBuf| {
            files::note_inputs(std::slice::from_ref(path));
            let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
            places(path, &text)
        };
        self.keep_points.as_ref().map_or_else(|| Ok(Vec::new()), read)
    }
}

fn degrees(text: &str, least: f64, most: f64) -> Result<f64> {
    number(text, |x| (least..=most).contains(&x), &format!("{least} to {most} degrees"))
}

fn length(text: &str) -> Result<f64> {
    number(text, |x| (0.0..f64::INFINITY).contains(&x), "a length in model units, not negative")
}

/// A place in each line, its coordinates parted by blanks or commas. Lines may be empty, or begin with `#`.
fn places(path: &Path, text: &str) -> Result<Vec<[f64; 3]>> {
    let lines = text.lines().map(str::trim).enumerate();
    let place = |(i, line): (usize, &str)| {
        let numbers = line.split([',', ' ', '\t']).filter(|word| !word.is_empty());
        let numbers: Option<Vec<f64>> =
            numbers.map(|word| word.parse().ok().filter(|x: &f64| x.is_finite())).collect();
        numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok()).ok_or_else(|| {
            anyhow!(
                "{}, line {}: it must be three coordinates, parted by blanks or commas",
                path.display(),
                i + 1
            )
        })
    };
    lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#')).map(place).collect()
}

/// The smallest dihedral angles of the cells before and after.
#[derive(Serialize)]
pub struct Angles {
    reference: CellAngles,
    base: Option<CellAngles>,
}

impl Angles {
    /// Of the mesh that is built on.
    pub fn of_reference(mesh: &TetMesh) -> Self {
        let cells = mesh.tets.iter().map(|tet| tet.map(|v| mesh.positions[v as usize]));
        Self { reference: CellAngles::of(cells), base: None }
    }

    /// Adds those of the base mesh.
    pub fn add_base(&mut self, mt: &Mt) {
        let (base, lattice) = (mt.base(), mt.info().lattice);
        let at = |v: u32| lattice.point(base.positions[v as usize]);
        self.base = Some(CellAngles::of(base.tets.iter().map(|tet| tet.map(at))));
    }

    /// The angles for people: a line for each.
    pub fn rows(&self) -> impl Iterator<Item = (&'static str, String)> {
        let base = self.base.as_ref().map(|base| ("  base mesh", sentence(base)));
        [("smallest angles", sentence(&self.reference))].into_iter().chain(base)
    }
}

/// The angles of a mesh for people.
fn sentence(angles: &CellAngles) -> String {
    let part = |CellsBelow { degrees, cells }: &CellsBelow| {
        let share = output::percent(*cells as f64 / angles.cells.max(1) as f64);
        format!("{share} below {degrees}°")
    };
    let parts: Vec<String> = angles.below.iter().map(part).collect();
    let least = angles.least.map_or_else(|| "-".to_owned(), |least| format!("{least:.2}°"));
    format!("{least} at least; {}", parts.join(", "))
}

#[cfg(test)]
mod tests {
    use super::{degrees, places};
    use std::path::Path;

    #[test]
    fn places_are_lines_of_three_numbers() {
        let read = |text: &str| places(Path::new("keep.txt"), text);
        let text = "# corners\n0 0 0\n\n1.5, -2,3e1\r\n";
        assert_eq!(read(text).unwrap(), [[0.0; 3], [1.5, -2.0, 30.0]]);
        for wrong in ["1 2", "1 2 3 4", "x y z", "1 2 nan"] {
            let error = read(&format!("0 0 0\n{wrong}")).unwrap_err().to_string();
            assert!(error.starts_with("keep.txt, line 2: "), "{error}");
        }
        assert!(
            degrees("70", 0.0, 70.0).is_ok()
                && degrees("70.1", 0.0, 70.0).is_err()
                && degrees("", 0.0, 9.0).is_err()
        );
    }
}
