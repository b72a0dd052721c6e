//! Writes grids that are made layer by layer as VTK XML image data, in the encoding of [`super::write`]. Of the values no more than a
//! layer is held, and 8 bytes for each block of them.

use std::io;
use std::io::{Seek, SeekFrom, Write};

use crate::write::{BLOCK, TAIL, array, compressed, image_attributes, write_head};
use tetralod::mesh::{GridArray, LayeredGrid};

/// Writes `grid` as VTK XML image data (`.vti`), layer by layer. What is in front of the data is written again when the data is there.
///
/// # Errors
/// If `out` fails.
pub fn write_vti_layers(grid: &LayeredGrid, out: &mut (impl Write + Seek)) -> io::Result<()> {
    let start = out.stream_position()?;
    let mut offsets = vec![0; grid.arrays().len()];
    write_grid_head(grid, &offsets, out)?;
    let data = out.stream_position()?;
    for (number, offset) in offsets.iter_mut().enumerate() {
        *offset = out.stream_position()? - data;
        write_array(grid, number, out)?;
    }
    out.write_all(TAIL)?;
    again_at(start, out, |out| write_grid_head(grid, &offsets, out))
}

/// Writes what is already there at `place` again, and goes on at the end.
fn again_at<W: Write + Seek>(
    place: u64,
    out: &mut W,
    write: impl FnOnce(&mut W) -> io::Result<()>,
) -> io::Result<()> {
    let end = out.stream_position()?;
    out.seek(SeekFrom::Start(place))?;
    write(out)?;
    out.seek(SeekFrom::Start(end))?;
    Ok(())
}

/// As long with any offsets.
fn write_grid_head(grid: &LayeredGrid, offsets: &[u64], out: &mut impl Write) -> io::Result<()> {
    let mut arrays = String::new();
    for (GridArray { name, components, is_single }, offset) in grid.arrays().iter().zip(offsets) {
        let kind = if *is_single { "Float32" } else { "Float64" };
        let element = array(kind, name, *components, offset);
        let longest = array(kind, name, *components, u64::MAX).len();
        arrays.push_str(&" ".repeat(longest - element.len()));
        arrays.push_str(&element);
    }
    let scalars = grid.arrays().iter().find(|array| array.components == 1);
    let scalars = scalars.map(|array| format!(" Scalars=\"{}\"", array.name)).unwrap_or_default();
    let (extent, attributes) = image_attributes(&grid.grid());
    let body = format!(
        "    <Piece Extent=\"{extent}\">\n      <PointData{scalars}>\n{arrays}      </PointData>\n    </Piece>\n"
    );
    write_head("ImageData", &attributes, &body, out)
}

/// Writes an array in compressed blocks, with their lengths in front of them.
fn write_array(grid: &LayeredGrid, number: usize, out: &mut (impl Write + Seek)) -> io::Result<()> {
    let GridArray { components, is_single, .. } = grid.arrays()[number];
    let bytes = grid.points() * components as u64 * if is_single { 4 } else { 8 };
    let blocks = bytes.div_ceil(BLOCK as u64);
    let mut header = vec![blocks, BLOCK as u64, bytes % BLOCK as u64];
    let start = out.stream_position()?;
    write_numbers(&header, out)?;
    (0..blocks).try_for_each(|_| write_numbers(&[0], out))?;
    let (mut values, mut plain) = (Vec::new(), Vec::with_capacity(BLOCK));
    for z in 0..grid.grid().dims[2] {
        grid.layer(number, z, &mut values);
        for value in &values {
            if is_single {
                plain.extend((*value as f32).to_le_bytes());
            } else {
                plain.extend(value.to_le_bytes());
            }
            if plain.len() == BLOCK {
                header.push(write_block(&mut plain, out)?);
            }
        }
    }
    if !plain.is_empty() {
        header.push(write_block(&mut plain, out)?);
    }
    again_at(start, out, |out| write_numbers(&header, out))
}

/// Writes a block and empties it; returns its compressed length.
fn write_block(plain: &mut Vec<u8>, out: &mut impl Write) -> io::Result<u64> {
    let block = compressed(plain)?;
    plain.clear();
    out.write_all(&block)?;
    Ok(block.len() as u64)
}

fn write_numbers(numbers: &[u64], out: &mut impl Write) -> io::Result<()> {
    numbers.iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;
    use crate::{read_bytes, write_vti};
    use tetralod::mesh::Grid;

    fn layered(dims: [u32; 3]) -> LayeredGrid {
        let grid = Grid { dims, origin: [0.5, -1.0, 0.0], spacing: [0.25, 1.0, 3.0] };
        let array = |name, components, is_single| GridArray { name, components, is_single };
        let arrays = vec![array("a", 1, false), array("v", 3, true), array("b", 1, true)];
        LayeredGrid::new(grid, arrays, |array, z, values| {
            let number = |i: usize| (i * (array + 1)) as f64 + 0.1 * f64::from(z);
            values.iter_mut().enumerate().for_each(|(i, value)| *value += number(i));
        })
    }

    #[test]
    fn what_is_read_is_what_was_made() {
        for dims in [[2, 2, 2], [3, 2, 5], [33, 31, 9]] {
            let grid = layered(dims);
            // What stands in front is kept.
            let mut out = Cursor::new(Vec::from(*b"before"));
            out.set_position(6);
            write_vti_layers(&grid, &mut out).unwrap();
            let bytes = out.into_inner();
            assert!(bytes.starts_with(b"before<?xml") && bytes.ends_with(TAIL));
            let mut read = read_bytes("layers.vti", &bytes[6..]).unwrap();
            // Readers add the lengths of vectors.
            read.fields.retain(|field| field.name != "v_magnitude");
            assert_eq!(read, grid.to_mesh());
        }
    }

    #[test]
    fn its_data_is_that_of_the_whole_mesh() {
        let grid = Grid { dims: [20, 30, 17], origin: [0.0; 3], spacing: [1.0; 3] };
        let arrays = vec![GridArray { name: "a", components: 1, is_single: false }];
        let layers = LayeredGrid::new(grid, arrays, |_, z, values| {
            values.iter_mut().enumerate().for_each(|(i, value)| *value = (i as f64 + f64::from(z)).sqrt());
        });
        let (mut in_layers, mut whole) = (Cursor::new(Vec::new()), Vec::new());
        write_vti_layers(&layers, &mut in_layers).unwrap();
        write_vti(&layers.to_mesh(), &mut whole).unwrap();
        let data = |bytes: &[u8]| {
            let start = bytes.windows(5).position(|w| w == b"\n   _").unwrap();
            bytes[start..].to_vec()
        };
        assert_eq!(data(in_layers.get_ref()), data(&whole));
    }
}
