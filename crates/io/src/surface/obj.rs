//! Wavefront files.

use std::io;
use std::io::Write;

use crate::surface::PolyData;

/// Writes points, normals, triangles and lines as a Wavefront OBJ file; it has no place for fields.
///
/// # Errors
/// With [`io::ErrorKind::InvalidInput`] if the arrays do not fit together, and if `out` fails.
pub fn write_obj(data: &PolyData, out: &mut impl Write) -> io::Result<()> {
    data.check()?;
    let is_single = data.is_single();
    for &[x, y, z] in &data.positions {
        if is_single {
            writeln!(out, "v {} {} {}", x as f32, y as f32, z as f32)?;
        } else {
            writeln!(out, "v {x} {y} {z}")?;
        }
    }
    for [x, y, z] in &data.normals {
        writeln!(out, "vn {x} {y} {z}")?;
    }
    for triangle in &data.triangles {
        let [a, b, c] = triangle.map(|v| v + 1);
        if data.normals.is_empty() {
            writeln!(out, "f {a} {b} {c}")?;
        } else {
            writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")?;
        }
    }
    for line in &data.lines {
        write!(out, "l")?;
        line.iter().try_for_each(|v| write!(out, " {}", v + 1))?;
        writeln!(out)?;
    }
    if data.is_points() {
        (1..=data.positions.len()).try_for_each(|v| writeln!(out, "p {v}"))?;
    }
    Ok(())
}
