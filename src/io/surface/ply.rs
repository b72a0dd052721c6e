//! Stanford polygon files, binary.

use std::io;
use std::io::Write;

use crate::io::surface::PolyData;

/// Writes points, triangles and the segments of lines as a binary little-endian PLY file, with normals and fields as
/// properties of the points.
///
/// # Errors
/// With [`io::ErrorKind::InvalidInput`] if the arrays do not fit together, and if `out` fails.
pub fn write_ply(data: &PolyData, out: &mut impl Write) -> io::Result<()> {
    data.check()?;
    write_header(data, out)?;
    for (v, position) in data.positions.iter().enumerate() {
        let normal = data.normals.get(v).into_iter().flatten();
        let values = data.fields.iter().map(|(_, values)| &values[v]);
        for number in position.iter().chain(normal).chain(values) {
            out.write_all(&number.to_le_bytes())?;
        }
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

fn write_header(data: &PolyData, out: &mut impl Write) -> io::Result<()> {
    write!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}\n", data.positions.len())?;
    let normals: &[&str] = if data.normals.is_empty() { &[] } else { &["nx", "ny", "nz"] };
    for name in ["x", "y", "z"].iter().chain(normals) {
        writeln!(out, "property float {name}")?;
    }
    let mut names: Vec<String> = Vec::new();
    for (name, _) in &data.fields {
        let name = property_name(name, &names);
        writeln!(out, "property float {name}")?;
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
