//! Grids of VTK in ASCII (`.vti`), for data that the demo makes by itself.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

/// A regular grid: points along each axis, and the distance from one to the next.
pub struct Grid {
    pub points: [usize; 3],
    pub spacing: f64,
}

impl Grid {
    pub const fn len(&self) -> usize {
        self.points[0] * self.points[1] * self.points[2]
    }

    /// Where a point of the grid is; x runs fastest.
    pub fn place(&self, i: usize) -> [f64; 3] {
        let [nx, ny, _] = self.points;
        [i % nx, i / nx % ny, i / (nx * ny)].map(|k| k as f64 * self.spacing)
    }
}

/// Values at the points of a grid, so many for each.
pub struct Array<'a> {
    pub name: &'a str,
    pub components: usize,
    pub values: Vec<f64>,
}

/// Writes a grid with its arrays.
pub fn write(path: &Path, grid: &Grid, arrays: &[Array]) -> Result<()> {
    let mut data = String::new();
    for Array { name, components, values } in arrays {
        writeln!(
            data,
            r#"<DataArray type="Float32" Name="{name}" NumberOfComponents="{components}" format="ascii">"#
        )?;
        for value in values {
            writeln!(data, "{value:.5}")?;
        }
        data.push_str("</DataArray>\n");
    }
    let [x, y, z] = grid.points.map(|points| points - 1);
    let (extent, spacing) = (format!("0 {x} 0 {y} 0 {z}"), grid.spacing);
    let text = format!(
        r#"<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian">
<ImageData WholeExtent="{extent}" Origin="0 0 0" Spacing="{spacing} {spacing} {spacing}"><Piece Extent="{extent}"><PointData>
{data}</PointData></Piece></ImageData></VTKFile>
"#
    );
    fs::write(path, text).with_context(|| path.display().to_string())
}
