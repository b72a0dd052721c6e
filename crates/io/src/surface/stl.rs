//! Stereolithography files, binary.

use std::io;
use std::io::Write;

use glam::DVec3;

use crate::surface::{PolyData, unfit};
use tetralod::geom::{Bounds, SinglePoints};

/// Writes the triangles as a binary STL file, each with the normal of its own plane (zero where it has no area). STL holds single precision:
/// where that loses a step of the positions, they are relative to an origin, which is returned and named in the file's header; it is 0
/// else.
///
/// # Errors
/// With [`io::ErrorKind::InvalidInput`] if the arrays do not fit together or there are lines or points alone, which
/// STL cannot hold, or a number that is too large; and if `out` fails.
pub fn write_stl(data: &PolyData, out: &mut impl Write) -> io::Result<[f64; 3]> {
    data.check()?;
    if !data.lines.is_empty() || (data.triangles.is_empty() && !data.positions.is_empty()) {
        return Err(unfit("STL holds triangles alone: write lines and points as .vtp".to_owned()));
    }
    let bounds = Bounds::of(&data.positions);
    let single =
        if data.is_single() { SinglePoints::PLAIN } else { SinglePoints::within(&bounds, [data.step; 3]) };
    let single = single.in_model_units();
    out.write_all(&header(single.origin))?;
    let count =
        u32::try_from(data.triangles.len()).map_err(|_| unfit("too many triangles for STL".to_owned()))?;
    out.write_all(&count.to_le_bytes())?;
    for triangle in &data.triangles {
        let corners = triangle.map(|v| data.positions[v as usize]);
        let normal = normal(corners);
        let corners = corners.map(|corner| single.store(corner));
        if !corners.as_flattened().iter().all(|x| x.is_finite()) {
            return Err(unfit(
                "a coordinate has no place in STL, which holds single precision: write .vtp".to_owned(),
            ));
        }
        for number in normal.iter().chain(corners.as_flattened()) {
            out.write_all(&number.to_le_bytes())?;
        }
        out.write_all(&[0, 0])?;
    }
    Ok(single.origin)
}

/// The first bytes of a file; they must not be `solid`.
fn header(origin: [f64; 3]) -> [u8; 80] {
    let [x, y, z] = origin;
    let text = if origin == [0.0; 3] {
        "triangles written by tetralod".to_owned()
    } else {
        format!("tetralod, relative to {x:e} {y:e} {z:e}")
    };
    let mut header = [b' '; 80];
    header.iter_mut().zip(text.bytes()).for_each(|(place, byte)| *place = byte);
    header
}

fn normal(corners: [[f64; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = corners.map(DVec3::from);
    (b - a).cross(c - a).normalize_or_zero().as_vec3().to_array()
}
