//! VTK XML poly data.

use std::io;
use std::io::Write;

use crate::surface::PolyData;
use crate::write::{Appended, array, escaped, write_file};

/// Writes VTK XML poly data (`.vtp`): triangles, lines or, where there are neither, the points as vertices.
///
/// # Errors
/// With [`io::ErrorKind::InvalidInput`] if the arrays do not fit together, and if `out` fails.
pub fn write_vtp(data: &PolyData, out: &mut impl Write) -> io::Result<()> {
    data.check()?;
    let mut appended = Appended::default();
    let point_data = point_data(data, &mut appended)?;
    let points = numbers("Points", 3, data.positions.as_flattened(), data.is_single(), &mut appended)?;
    let single: Vec<Vec<u32>> = if data.is_points() {
        (0..data.positions.len() as u32).map(|v| vec![v]).collect()
    } else {
        Vec::new()
    };
    let verts = cells("Verts", &mut single.iter().map(Vec::as_slice), &mut appended)?;
    let lines = cells("Lines", &mut data.lines.iter().map(Vec::as_slice), &mut appended)?;
    let polys = cells("Polys", &mut data.triangles.iter().map(|t| &t[..]), &mut appended)?;
    let body = format!(
        "    <Piece NumberOfPoints=\"{}\" NumberOfVerts=\"{}\" NumberOfLines=\"{}\" NumberOfStrips=\"0\" \
         NumberOfPolys=\"{}\">\n{point_data}      <Points>\n{points}      </Points>\n{verts}{lines}{polys}    \
         </Piece>\n",
        data.positions.len(),
        single.len(),
        data.lines.len(),
        data.triangles.len(),
    );
    write_file("PolyData", "", &body, &appended.bytes, out)
}

fn point_data(data: &PolyData, appended: &mut Appended) -> io::Result<String> {
    let mut arrays = String::new();
    let mut attributes = String::new();
    if let Some(field) = data.fields.first() {
        attributes.push_str(&format!(" Scalars=\"{}\"", escaped(&field.name)));
    }
    for field in &data.fields {
        arrays.push_str(&numbers(&field.name, 1, &field.values, field.is_single(), appended)?);
    }
    if !data.normals.is_empty() {
        attributes.push_str(" Normals=\"Normals\"");
        let offset = appended.append(data.normals.as_flattened(), f32::to_le_bytes)?;
        arrays.push_str(&array("Float32", "Normals", 3, offset));
    }
    Ok(format!("      <PointData{attributes}>\n{arrays}      </PointData>\n"))
}

/// The element of an array in single or double precision.
fn numbers(
    name: &str,
    components: usize,
    numbers: &[f64],
    is_single: bool,
    appended: &mut Appended,
) -> io::Result<String> {
    let (kind, offset) = if is_single {
        ("Float32", appended.append(numbers, |x| (x as f32).to_le_bytes())?)
    } else {
        ("Float64", appended.append(numbers, f64::to_le_bytes)?)
    };
    Ok(array(kind, name, components, offset))
}

/// The element `name` with cells of any number of points.
fn cells(name: &str, cells: &mut dyn Iterator<Item = &[u32]>, appended: &mut Appended) -> io::Result<String> {
    let (mut points, mut ends): (Vec<u32>, Vec<i64>) = (Vec::new(), Vec::new());
    for cell in cells {
        points.extend_from_slice(cell);
        ends.push(points.len() as i64);
    }
    let connectivity = appended.append(&points, |v| i64::from(v).to_le_bytes())?;
    let offsets = appended.append(&ends, i64::to_le_bytes)?;
    let arrays =
        [array("Int64", "connectivity", 1, connectivity), array("Int64", "offsets", 1, offsets)].concat();
    Ok(format!("      <{name}>\n{arrays}      </{name}>\n"))
}
