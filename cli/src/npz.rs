//! Arrays for NumPy: a `.npz`, which `numpy.load` reads, as `numpy.savez` writes it: an uncompressed zip archive with a `.npy` for each
//! array.

use super::files;
use anyhow::Result;
use std::io::{BufWriter, Seek, Write};
use std::path::Path;
use tetralod::mesh::TetMesh;
use tetralod_io::{PolyData, cell_arrays, point_arrays};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Writes `positions` (n × 3), `tets` (m × 4) and each array of values by its name, those at cells with `cell_` in front; vectors have a column for
/// each component.
pub fn write_mesh(mesh: &TetMesh, path: &Path) -> Result<()> {
    files::write_seekable(path, |out| {
        let mut archive = Archive::new(out);
        archive.add("positions", Some(3), mesh.positions.as_flattened().iter().copied())?;
        archive.add("tets", Some(4), mesh.tets.as_flattened().iter().copied())?;
        for array in point_arrays(mesh)? {
            let columns = Some(array.components.len()).filter(|columns| *columns > 1);
            let values: Vec<f64> = array.values().collect();
            archive.add(&array.name, columns, values.into_iter())?;
        }
        for array in cell_arrays(mesh)? {
            let columns = Some(array.components.len()).filter(|columns| *columns > 1);
            let values: Vec<f64> = array.values().collect();
            archive.add(&format!("cell_{}", array.name), columns, values.into_iter())?;
        }
        archive.finish()
    })
}

/// Writes `positions` (n × 3) and, where there are any, `normals` (n × 3), `triangles` (m × 3) and `lines`: the points of all lines, one
/// behind the other, with where each ends in `line_ends`. Then each field by its name.
pub fn write_surface(data: &PolyData, path: &Path) -> Result<()> {
    files::write_seekable(path, |out| {
        let mut archive = Archive::new(out);
        archive.add_numbers("positions", Some(3), data.positions.as_flattened(), data.is_single())?;
        if !data.normals.is_empty() {
            archive.add("normals", Some(3), data.normals.as_flattened().iter().copied())?;
        }
        if !data.triangles.is_empty() || data.lines.is_empty() {
            archive.add("triangles", Some(3), data.triangles.as_flattened().iter().copied())?;
        }
        if !data.lines.is_empty() {
            let points: Vec<u32> = data.lines.concat();
            let ends = data.lines.iter().scan(0, |end, line| {
                *end += line.len() as u32;
                Some(*end)
            });
            archive.add("lines", None, points.into_iter())?;
            archive.add("line_ends", None, ends.collect::<Vec<u32>>().into_iter())?;
        }
        for field in &data.fields {
            archive.add_numbers(&field.name, None, &field.values, field.is_single())?;
        }
        archive.finish()
    })
}

/// A number that arrays are made of.
trait Number: Copy {
    /// NumPy's word for it.
    const TYPE: &str;
    const BYTES: u64;

    fn put(self, out: &mut impl Write) -> std::io::Result<()>;
}

macro_rules! number {
    ($type:ty, $word:literal) => {
        impl Number for $type {
            const TYPE: &str = $word;
            const BYTES: u64 = size_of::<Self>() as u64;

            fn put(self, out: &mut impl Write) -> std::io::Result<()> {
                out.write_all(&self.to_le_bytes())
            }
        }
    };
}

number!(u32, "<u4");
number!(f32, "<f4");
number!(f64, "<f8");

/// A file that is being written.
struct Archive<W: Write + Seek> {
    zip: ZipWriter<W>,
    names: Vec<String>,
}

impl<W: Write + Seek> Archive<W> {
    fn new(out: W) -> Self {
        Self { zip: ZipWriter::new(out), names: Vec::new() }
    }

    /// Adds an array in single or double precision.
    fn add_numbers(
        &mut self,
        name: &str,
        columns: Option<usize>,
        numbers: &[f64],
        is_single: bool,
    ) -> Result<()> {
        if is_single {
            self.add(name, columns, numbers.iter().map(|x| *x as f32))
        } else {
            self.add(name, columns, numbers.iter().copied())
        }
    }

    /// Adds an array; with a number of columns, it has rows of them.
    fn add<T: Number>(
        &mut self,
        name: &str,
        columns: Option<usize>,
        values: impl ExactSizeIterator<Item = T>,
    ) -> Result<()> {
        let name = self.free_name(name);
        let shape = match columns {
            Some(columns) => format!("({}, {columns})", values.len() / columns),
            None => format!("({},)", values.len()),
        };
        let bytes = values.len() as u64 * T::BYTES;
        let is_large = bytes > u64::from(u32::MAX) / 2;
        // Without a compression, which numbers with many digits hardly gain from; and without a time of its own.
        let options = SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Stored)
            .large_file(is_large);
        self.zip.start_file(format!("{name}.npy"), options)?;
        let mut out = BufWriter::new(&mut self.zip);
        out.write_all(&head(T::TYPE, &shape))?;
        for value in values {
            value.put(&mut out)?;
        }
        out.flush()?;
        self.names.push(name);
        Ok(())
    }

    /// A name that no array has yet, and that is a file's. Fields can be called as anything.
    fn free_name(&self, name: &str) -> String {
        let mut name = name.replace(['/', '\\'], "_");
        while self.names.contains(&name) {
            name.push('_');
        }
        name
    }

    fn finish(self) -> Result<()> {
        self.zip.finish()?;
        Ok(())
    }
}

/// What stands in front of an array, version 1.0: a Python dictionary, filled up so that the array begins at a multiple of 64 bytes.
fn head(number: &str, shape: &str) -> Vec<u8> {
    const START: &[u8] = b"\x93NUMPY\x01\x00";
    let text = format!("{{'descr': '{number}', 'fortran_order': False, 'shape': {shape}, }}");
    // The length of what follows, and a line feed at the end.
    let length = (START.len() + 2 + text.len() + 1).next_multiple_of(64) - START.len() - 2;
    let length_bytes = (length as u16).to_le_bytes();
    let line = format!("{text:<width$}\n", width = length - 1);
    [START, &length_bytes, line.as_bytes()].concat()
}
