//! What a file contains, without its values: for questions before it is read, and for the memory that reading needs.

use crate::io::error::{At, ReadError, ReadReason};
use crate::io::{image, in_file, legacy, raw, structured, vtu, xml};
use crate::mesh::{Field, Grid};

/// What a file says that it contains. The data may be damaged even so.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// The format: `"vtu"`, `"vti"`, `"vtr"`, `"vts"`, `"vtk"` or `"raw"`.
    pub format: &'static str,
    /// Its points.
    pub points: u64,
    /// The tetrahedra, at most, that its cells are or are split into.
    pub cells: u64,
    /// The grid, if it is one.
    pub grid: Option<Grid>,
    /// The fields at points, without values.
    pub fields: Vec<Field>,
    /// The fields at cells, without values.
    pub cell_fields: Vec<Field>,
}

impl Survey {
    /// A grid; six tetrahedra a cube.
    pub(super) fn of_grid(format: &'static str, grid: Grid, [fields, cell_fields]: [Vec<Field>; 2]) -> Self {
        let product =
            |less: u64| grid.dims.iter().map(|&d| u64::from(d).saturating_sub(less)).product::<u64>();
        Self { format, points: product(0), cells: 6 * product(1), grid: Some(grid), fields, cell_fields }
    }
}

/// Says what is in the bytes of a file; `name` is used in errors alone. No array is decoded, so this takes little memory
/// beside the bytes.
///
/// # Errors
/// As [`read_bytes`](super::read_bytes), as far as that follows from the structure of the file.
pub fn survey(name: &str, bytes: &[u8]) -> Result<Survey, ReadError> {
    let start = super::without_mark(bytes);
    let result = if bytes.starts_with(legacy::MAGIC) {
        legacy::survey(bytes)
    } else if start.starts_with(b"<") {
        survey_xml(start)
    } else {
        Err(ReadReason::UnknownFormat).at(String::new)
    };
    result.map_err(|e| in_file(e, name))
}

/// Says what the JSON sidecar of raw samples describes.
///
/// # Errors
/// If the sidecar does not say what is needed.
pub fn survey_raw(name: &str, sidecar: &[u8]) -> Result<Survey, ReadError> {
    let sidecar = raw::Sidecar::parse(sidecar).at(String::new).map_err(|e| in_file(e, name))?;
    Ok(sidecar.survey())
}

fn survey_xml(bytes: &[u8]) -> Result<Survey, ReadError> {
    let document = xml::Document::parse(bytes)?;
    match document.kind.as_str() {
        "UnstructuredGrid" => vtu::survey(&document),
        "ImageData" => image::survey(&document),
        structured::RECTILINEAR | structured::CURVILINEAR => structured::survey(&document),
        other => Err(super::not_read(other)).at(String::new),
    }
}
