//! Stanford polygon files, binary.

use std::io;
use std::io::Write;

use crate::surface::{PointValues, PolyData};

/// Writes points, triangles and the segments of lines as a binary little-endian PLY file, with normals and fields as
/// properties of the points.
///
/// # Errors
/// With [`io::ErrorKind::InvalidInput`] if the arrays do not fit together, and if `out` fails.
pub fn write_ply(data: &PolyData, out: &mut impl Write) -> io::Result<()> {
    data.check()?;
    write_header(data, out)?;
    let are_single: Vec<bool> = data.fields.iter().map(PointValues::is_single).collect();
    let is_single = data.is_single();
    for (v, position) in data.positions.iter().enumerate() {
        position.iter().try_for_each(|x| put(*x, is_single, out))?;
        let normal = data.normals.get(v).into_iter().flatten();
        normal.into_iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
        let mut values = data.fields.iter().map(|field| field.values[v]).zip(&are_single);
        values.try_for_each(|(value, is_single)| put(value, *is_single, out))?;
    }
    for triangle in &data.triangles {
        out.write_all(&[3])?;
        triangle.iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
    }
    for segment in data.lines.iter().flat_map(|line| line.windows(2)) {
        segment.iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
    }
    Ok(())
}

fn put(number: f64, is_single: bool, out: &mut impl Write) -> io::Result<()> {
    if is_single {
        out.write_all(&(number as f32).to_le_bytes())
    } else {
        out.write_all(&number.to_le_bytes())
    }
}

fn word(is_single: bool) -> &'static str {
    if is_single { "float" } else { "double" }
}

fn write_header(data: &PolyData, out: &mut impl Write) -> io::Result<()> {
    write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", data.positions.len())?;
    for name in ["x", "y", "z"] {
        writeln!(out, "property {} {name}", word(data.is_single()))?;
    }
    for name in ["nx", "ny", "nz"].iter().filter(|_| !data.normals.is_empty()) {
        writeln!(out, "property float {name}")?;
    }
    let mut names: Vec<String> = Vec::new();
    for field in &data.fields {
        let name = property_name(&field.name, &names);
        writeln!(out, "property {} {name}", word(field.is_single()))?;
        names.push(name);
    }
    if !data.triangles.is_empty() {
        write!(out, "element face {}\nproperty list uchar uint vertex_indices\n", data.triangles.len())?;
    }
    let segments: usize = data.lines.iter().map(|line| line.len().saturating_sub(1)).sum();
    if segments > 0 {
        write!(out, "element edge {segments}\nproperty uint vertex1\nproperty uint vertex2\n")?;
    }
    writeln!(out, "end_header")
}

/// A name without spaces and the like, that no other property has.
fn property_name(name: &str, taken: &[String]) -> String {
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let plain: String = name.chars().map(|c| if fits(c) { c } else { '_' }).collect();
    let is_taken = |name: &String| {
        ["", "x", "y", "z", "nx", "ny", "nz"].contains(&name.as_str()) || taken.contains(name)
    };
    let numbered = (1..).map(|i| format!("{plain}_{i}"));
    // One of the first `taken.len() + 1` numbers is free.
    std::iter::once(plain.clone()).chain(numbered).find(|name| !is_taken(name)).unwrap_or_default()
}
