//! `bbox`: the box around the reference mesh.

use crate::format::read::Reader;
use crate::format::{FormatError, write};

/// Writes the least corner, and how far the largest one is from it, axis by axis.
pub fn write(out: &mut Vec<u8>, [low, high]: [[i32; 3]; 2]) {
    for (low, high) in low.into_iter().zip(high) {
        write::varint(out, low as u64);
        write::varint(out, (high - low) as u64);
    }
}

/// Reads a box on a lattice with so many bits, 1 to 30.
pub fn read(mut reader: Reader<'_>, bits: u32) -> Result<[[i32; 3]; 2], FormatError> {
    let bounds = read_corners(&mut reader, bits)?;
    reader.end()?;
    Ok(bounds)
}

/// Reads a box among other things.
pub fn read_corners(reader: &mut Reader<'_>, bits: u32) -> Result<[[i32; 3]; 2], FormatError> {
    let [mut least, mut largest] = [[0; 3]; 2];
    for (least, largest) in least.iter_mut().zip(&mut largest) {
        let [low, more] = [reader.varint()?, reader.varint()?];
        match low.checked_add(more) {
            Some(high) if high <= 1 << bits => (*least, *largest) = (low as i32, high as i32),
            _ => {
                return Err(
                    reader.corrupt("a box around the reference mesh, or a part of it, is not on the lattice")
                );
            }
        }
    }
    Ok([least, largest])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_comes_back_and_one_beyond_the_lattice_is_refused() {
        let coded = |numbers: [u64; 6]| {
            let mut bytes = Vec::new();
            numbers.into_iter().for_each(|number| write::varint(&mut bytes, number));
            read(Reader::new(&bytes, 0), 10)
        };
        let mut bytes = Vec::new();
        let whole = [[0, 5, 1024], [1024, 5, 1024]];
        write(&mut bytes, whole);
        assert_eq!(read(Reader::new(&bytes, 0), 10), Ok(whole));
        assert_eq!(coded([0, 1024, 5, 0, 1024, 0]), Ok(whole));
        for axis in 0..3 {
            // As 32-bit numbers some of these would be on the lattice again, or wrap around.
            for (low, more) in
                [(0, 1025), (1024, 1), (1 << 31, 0), (u32::MAX.into(), 1), (1, u32::MAX.into())]
            {
                let mut numbers = [0; 6];
                (numbers[2 * axis], numbers[2 * axis + 1]) = (low, more);
                assert!(matches!(coded(numbers), Err(FormatError::Corrupt { .. })), "{axis}: {low} + {more}");
            }
        }
    }
}
