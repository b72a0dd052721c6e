//! Writes VTK XML files: version 1.0, little-endian, appended raw data, zlib blocks, 64-bit headers.

use std::fmt::{Display, Write as _};
use std::io;
use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;

use crate::fields;
use tetralod::mesh::{Field, Grid, TetMesh};
use tetralod::threads;

/// Bytes of a block before compression, as VTK has it.
pub(super) const BLOCK: usize = 32768;
/// Largest integer up to which `f64` holds all.
const MAX_EXACT_INTEGER: f64 = 9_007_199_254_740_992.0;
/// What follows the appended data.
pub(super) const TAIL: &[u8] = b"\n  </AppendedData>\n</VTKFile>\n";
/// VTK's number for a tetrahedron.
const TETRAHEDRON: u8 = 10;

/// Writes `mesh` as a VTK XML unstructured grid (`.vtu`), with double precision points and fields.
///
/// # Errors
/// If `out` fails.
pub fn write_vtu(mesh: &TetMesh, out: &mut impl Write) -> io::Result<()> {
    let mut data = Appended::default();
    let arrays = point_data(mesh, &mut data)?;
    let points = data.append(mesh.positions.as_flattened(), f64::to_le_bytes)?;
    let connectivity = data.append(mesh.tets.as_flattened(), |v| i64::from(v).to_le_bytes())?;
    let ends: Vec<i64> = (1..=mesh.tets.len() as i64).map(|i| 4 * i).collect();
    let offsets = data.append(&ends, i64::to_le_bytes)?;
    let types = data.append(&vec![TETRAHEDRON; mesh.tets.len()], |v| [v])?;
    let of_cells = cell_data(mesh, &mut data)?;
    let body = format!(
        "{}    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n{arrays}\
         {of_cells}      <Points>\n{}      </Points>\n      <Cells>\n{}{}{}      </Cells>\n    </Piece>\n",
        field_data(mesh),
        mesh.positions.len(),
        mesh.tets.len(),
        array("Float64", "Points", 3, points),
        array("Int64", "connectivity", 1, connectivity),
        array("Int64", "offsets", 1, offsets),
        array("UInt8", "types", 1, types),
    );
    write_file("UnstructuredGrid", "", &body, &data.bytes, out)
}

/// Writes a mesh that was split from a regular grid as VTK XML image data (`.vti`).
///
/// # Errors
/// With [`io::ErrorKind::InvalidInput`] if `mesh` has no grid, and if `out` fails.
pub fn write_vti(mesh: &TetMesh, out: &mut impl Write) -> io::Result<()> {
    let Some(grid) = mesh.grid else {
        let problem = "the mesh is not a regular grid: write it as .vtu";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    };
    let mut data = Appended::default();
    let arrays = point_data(mesh, &mut data)?;
    let (extent, attributes) = image_attributes(&grid);
    let body = format!("{}    <Piece Extent=\"{extent}\">\n{arrays}    </Piece>\n", field_data(mesh));
    write_file("ImageData", &attributes, &body, &data.bytes, out)
}

/// The extent of a grid, and the attributes of its element `<ImageData>`.
pub(super) fn image_attributes(grid: &Grid) -> (String, String) {
    let last = grid.dims.map(|d| d.saturating_sub(1));
    let extent = format!("0 {} 0 {} 0 {}", last[0], last[1], last[2]);
    let three = |v: [f64; 3]| format!("{:?} {:?} {:?}", v[0], v[1], v[2]);
    let attributes = format!(
        " WholeExtent=\"{extent}\" Origin=\"{}\" Spacing=\"{}\"",
        three(grid.origin),
        three(grid.spacing)
    );
    (extent, attributes)
}

pub(super) fn write_file(
    kind: &str,
    attributes: &str,
    body: &str,
    data: &[u8],
    out: &mut impl Write,
) -> io::Result<()> {
    write_head(kind, attributes, body, out)?;
    out.write_all(data)?;
    out.write_all(TAIL)
}

/// All in front of the appended data.
pub(super) fn write_head(kind: &str, attributes: &str, body: &str, out: &mut impl Write) -> io::Result<()> {
    write!(
        out,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n  <{kind}{attributes}>\n{body}  </{kind}>\n\
         \x20 <AppendedData encoding=\"raw\">\n   _"
    )
}

/// An array of values at the points or the cells of a mesh, as files have it: a field, or the components of a vector.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshArray<'a> {
    /// The name of the array, with the time where there are several steps of it.
    pub name: String,
    /// The field, or one for each component.
    pub components: &'a [Field],
}

impl MeshArray<'_> {
    /// The values, those of a point or cell one behind the other.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        let points = self.components.first().map_or(0, |field| field.values.len());
        (0..points).flat_map(|i| self.components.iter().map(move |field| field.values[i]))
    }
}

/// The fields of a mesh at its points as arrays. Components that follow one another become a vector again, and its length, which follows from
/// them, is left out.
///
/// # Errors
/// With [`io::ErrorKind::InvalidInput`] if a field is not as long as there are points.
pub fn point_arrays(mesh: &TetMesh) -> io::Result<Vec<MeshArray<'_>>> {
    arrays(&mesh.fields, (mesh.positions.len(), "points"))
}

/// [`point_arrays`] of its fields at cells, but for those that are known by their names alone.
///
/// # Errors
/// With [`io::ErrorKind::InvalidInput`] if a field is not as long as there are cells.
pub fn cell_arrays(mesh: &TetMesh) -> io::Result<Vec<MeshArray<'_>>> {
    let of_one_kind = mesh.cell_fields.chunk_by(|a, b| a.values.is_empty() == b.values.is_empty());
    let with_values = of_one_kind.filter(|fields| !fields[0].values.is_empty());
    let lists = with_values.map(|fields| arrays(fields, (mesh.tets.len(), "cells")));
    Ok(lists.collect::<io::Result<Vec<_>>>()?.concat())
}

/// Fields as arrays, which are so long.
fn arrays<'a>(fields: &'a [Field], (count, of): (usize, &str)) -> io::Result<Vec<MeshArray<'a>>> {
    if let Some(Field { name, values, .. }) = fields.iter().find(|f| f.values.len() != count) {
        let problem = format!("field \"{name}\" has {} values for {count} {of}", values.len());
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    }
    let mut arrays = Vec::new();
    let mut vectors: Vec<(&str, Option<f64>)> = Vec::new();
    let mut rest = fields;
    while let Some(first) = rest.first() {
        let (components, behind) = rest.split_at(components(rest));
        rest = behind;
        let vector = first.vector.as_ref().map(|vector| vector.name.as_str());
        let name = match vector {
            Some(vector) if components.len() > 1 => {
                vectors.push((vector, first.time));
                vector
            }
            Some(vector) if is_length(first) && vectors.contains(&(vector, first.time)) => continue,
            _ => &first.name,
        };
        arrays.push(MeshArray { name: name_at_time(fields, first, name), components });
    }
    Ok(arrays)
}

/// The element `<PointData>`, its arrays appended to `data`.
fn point_data(mesh: &TetMesh, data: &mut Appended) -> io::Result<String> {
    let arrays = point_arrays(mesh)?;
    let scalars = arrays.iter().find(|array| array.components.len() == 1);
    let scalars = scalars.map(|array| format!(" Scalars=\"{}\"", escaped(&array.name))).unwrap_or_default();
    let elements = arrays.iter().map(|array| element(array, data)).collect::<io::Result<String>>()?;
    Ok(format!("      <PointData{scalars}>\n{elements}      </PointData>\n"))
}

/// The element `<CellData>`; nothing if there are no arrays.
fn cell_data(mesh: &TetMesh, data: &mut Appended) -> io::Result<String> {
    let arrays = cell_arrays(mesh)?;
    if arrays.is_empty() {
        return Ok(String::new());
    }
    let elements = arrays.iter().map(|array| element(array, data)).collect::<io::Result<String>>()?;
    Ok(format!("      <CellData>\n{elements}      </CellData>\n"))
}

fn is_length(field: &Field) -> bool {
    field.vector.as_ref().is_some_and(|vector| vector.component.is_none())
}

/// How many of the first fields are the components of one vector, named as a reader would name them; else 1.
fn components(fields: &[Field]) -> usize {
    let Some((first, Some(vector))) = fields.first().map(|f| (f, &f.vector)) else { return 1 };
    let follows = |(c, field): (usize, &Field)| {
        let part = field.vector.as_ref().filter(|part| part.name == vector.name && field.time == first.time);
        part.and_then(|part| part.component).is_some_and(|component| usize::from(component) == c)
    };
    let count = fields.iter().enumerate().take_while(|&each| follows(each)).count();
    let named = |(c, field): (usize, &Field)| {
        field.name == format!("{}_{}", vector.name, fields::component_name(count, c))
    };
    if count > 1 && fields.iter().take(count).enumerate().all(named) { count } else { 1 }
}

/// A name for one of several time steps.
fn name_at_time(fields: &[Field], field: &Field, name: &str) -> String {
    let several = fields.iter().any(|f| f.name == field.name && f.time != field.time);
    match field.time {
        Some(time) if several => format!("{name}@{time:?}"),
        _ => name.to_owned(),
    }
}

/// The element of an array, its values appended to `data`.
fn element(array: &MeshArray<'_>, data: &mut Appended) -> io::Result<String> {
    let fields = array.components;
    let values: Vec<f64> = array.values().collect();
    // Integers beyond this were rounded when they were read.
    let fits = |v: &f64| v.fract() == 0.0 && v.abs() <= MAX_EXACT_INTEGER;
    let (kind, offset) = if fields.iter().all(|field| field.integer) && values.iter().all(fits) {
        ("Int64", data.append(&values, |v| (v as i64).to_le_bytes())?)
    } else {
        ("Float64", data.append(&values, f64::to_le_bytes)?)
    };
    let element = self::array(kind, &array.name, fields.len(), offset);
    let unit = fields.first().map_or("", |field| field.unit.as_str());
    if unit.is_empty() {
        return Ok(element);
    }
    let open = element.trim_end().trim_end_matches("/>");
    let key = format!(
        "<InformationKey name=\"UNITS_LABEL\" location=\"vtkDataArray\">{}</InformationKey>",
        escaped(unit)
    );
    Ok(format!("{open}>{key}</DataArray>\n"))
}

/// The time of all fields, if it is the same, as an element `<FieldData>`.
fn field_data(mesh: &TetMesh) -> String {
    let time = mesh.fields.first().and_then(|field| field.time);
    match time.filter(|_| mesh.fields.iter().all(|field| field.time == time)) {
        Some(time) => format!(
            "    <FieldData>\n      <DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" \
             format=\"ascii\">{time:?}</DataArray>\n    </FieldData>\n"
        ),
        None => String::new(),
    }
}

pub(super) fn array(kind: &str, name: &str, components: usize, offset: impl Display) -> String {
    format!(
        "        <DataArray type=\"{kind}\" Name=\"{}\" NumberOfComponents=\"{components}\" format=\"appended\" \
         offset=\"{offset}\"/>\n",
        escaped(name)
    )
}

/// Text for an attribute; control characters, which XML cannot hold, become spaces.
pub(super) fn escaped(text: &str) -> String {
    let mut result = String::new();
    for c in text.chars() {
        match c {
            '<' | '>' | '&' | '"' | '\'' => {
                // Writing to a string cannot fail.
                _ = write!(result, "&#{};", c as u32);
            }
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => result.push(' '),
            c => result.push(c),
        }
    }
    result
}

/// A block by itself. Higher levels take several times as long and save a tenth.
pub(super) fn compressed(plain: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(plain)?;
    encoder.finish()
}

/// The data after the underscore.
#[derive(Default)]
pub(super) struct Appended {
    pub(super) bytes: Vec<u8>,
}

impl Appended {
    /// Appends an array of `values` in compressed blocks; returns its offset.
    pub(super) fn append<T: Copy + Sync, const N: usize>(
        &mut self,
        values: &[T],
        encode: impl Fn(T) -> [u8; N] + Sync + Send,
    ) -> io::Result<usize> {
        let offset = self.bytes.len();
        let per_block = BLOCK / N;
        let blocks = values.len().div_ceil(per_block);
        let partial = values.len() % per_block * N;
        let mut header: Vec<u64> = vec![blocks as u64, BLOCK as u64, partial as u64];
        let packed = threads::map(values.len(), per_block, |block| {
            compressed(&values[block].iter().copied().flat_map(&encode).collect::<Vec<u8>>())
        });
        let packed = packed.into_iter().collect::<io::Result<Vec<Vec<u8>>>>()?;
        header.extend(packed.iter().map(|block| block.len() as u64));
        self.bytes.extend(header.iter().flat_map(|n| n.to_le_bytes()));
        self.bytes.extend(packed.into_iter().flatten());
        Ok(offset)
    }
}
