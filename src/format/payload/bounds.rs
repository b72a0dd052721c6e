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
    let [mut least, mut largest] = [[0; 3]; 2];
    for (least, largest) in least.iter_mut().zip(&mut largest) {
        let [low, more] = [reader.varint()?, reader.varint()?];
        match low.checked_add(more) {
            Some(high) if high <= 1 << bits => (*least, *largest) = (low as i32, high as i32),
            _ => return Err(reader.corrupt("the box of the reference mesh is not on the lattice")),
        }
    }
    reader.end()?;
    Ok([least, largest])
}
