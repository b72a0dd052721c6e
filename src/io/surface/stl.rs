//! Stereolithography files, binary.

use std::io;
use std::io::Write;

use glam::DVec3;

use crate::io::surface::{PolyData, unfit};

/// The first bytes of a file, which say nothing; they must not be `solid`.
const HEADER: &[u8; 80] = &{
    let text = b"triangles written by tetralod";
    let mut header = [b' '; 80];
    let mut i = 0;
    while i < text.len() {
        header[i] = text[i];
        i += 1;
    }
    header
};

/// Writes the triangles as a binary STL file, each with the normal of its own plane (zero where it has no area).
///
/// # Errors
/// With [`io::ErrorKind::InvalidInput`] if the arrays do not fit together or there are lines or points alone, which
/// STL cannot hold; and if `out` fails.
pub fn write_stl(data: &PolyData, out: &mut impl Write) -> io::Result<()> {
    data.check()?;
    if !data.lines.is_empty() || (data.triangles.is_empty() && !data.positions.is_empty()) {
        return Err(unfit("STL holds triangles alone: write lines and points as .vtp".to_owned()));
    }
    out.write_all(HEADER)?;
    let count =
        u32::try_from(data.triangles.len()).map_err(|_| unfit("too many triangles for STL".to_owned()))?;
    out.write_all(&count.to_le_bytes())?;
    for triangle in &data.triangles {
        let corners = triangle.map(|v| data.positions[v as usize]);
        let normal = normal(corners);
        for number in normal.iter().chain(corners.as_flattened()) {
            out.write_all(&number.to_le_bytes())?;
        }
        out.write_all(&[0, 0])?;
    }
    Ok(())
}

fn normal(corners: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = corners.map(|p| DVec3::from(p.map(f64::from)));
    (b - a).cross(c - a).normalize_or_zero().as_vec3().to_array()
}
