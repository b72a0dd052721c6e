//! VTK XML poly data.

use std::io;
use std::io::Write;

use crate::io::surface::PolyData;
use crate::io::write::{Appended, array, escaped, write_file};

/// Writes VTK XML poly data (`.vtp`): triangles, lines or, where there are neither, the points as vertices.
///
/// # Errors
/// With [`io::ErrorKind::InvalidInput`] if the arrays do not fit together, and if `out` fails.
pub fn write_vtp(data: &PolyData, out: &mut impl Write) -> io::Result<()> {
    data.check()?;
    let mut appended = Appended::default();
    let point_data = point_data(data, &mut appended)?;
    let points = appended.append(data.positions.as_flattened(), f32::to_le_bytes)?;
    let points = array("Float32", "Points", 3, points);
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
    if let Some((name, _)) = data.fields.first() {
        attributes.push_str(&format!(" Scalars=\"{}\"", escaped(name)));
    }
    for (name, values) in &data.fields {
        let offset = appended.append(values, f32::to_le_bytes)?;
        arrays.push_str(&array("Float32", name, 1, offset));
    }
    if !data.normals.is_empty() {
        attributes.push_str(" Normals=\"Normals\"");
        let offset = appended.append(data.normals.as_flattened(), f32::to_le_bytes)?;
        arrays.push_str(&array("Float32", "Normals", 3, offset));
    }
    Ok(format!("      <PointData{attributes}>\n{arrays}      </PointData>\n"))
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
