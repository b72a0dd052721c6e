//! Parts as bytes: frames of a length, a checksum and what `postcard` makes of a value.

use super::PartsError;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::{self, Read, Seek, SeekFrom, Write};

/// How each file begins; the last byte is the version.
const MAGIC: [u8; 8] = *b"mtparts\x05";

/// Bytes in front of a frame.
const HEAD: usize = 12;

pub fn write_magic(out: &mut dyn Write) -> io::Result<()> {
    out.write_all(&MAGIC)
}

pub fn read_magic(input: &mut dyn Read) -> Result<(), PartsError> {
    let mut found = [0; MAGIC.len()];
    match input.read_exact(&mut found) {
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Err(PartsError::Format),
        Err(error) => Err(error.into()),
        Ok(()) if found == MAGIC => Ok(()),
        Ok(()) => Err(PartsError::Format),
    }
}

pub fn write_frame<T: Serialize>(out: &mut dyn Write, value: &T) -> Result<(), PartsError> {
    let payload =
        postcard::to_stdvec(value).map_err(|_| PartsError::Damaged { what: "it cannot be written" })?;
    out.write_all(&(payload.len() as u64).to_le_bytes())?;
    out.write_all(&crc32fast::hash(&payload).to_le_bytes())?;
    Ok(out.write_all(&payload)?)
}

/// The length and the checksum of the next frame.
fn read_head(input: &mut dyn Read) -> Result<(u64, u32), PartsError> {
    let mut head = [0; HEAD];
    input.read_exact(&mut head).map_err(cut_off)?;
    let (len, crc) = head.split_at(8);
    let len = len.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte));
    let crc = crc.iter().rev().fold(0, |number, &byte| number << 8 | u32::from(byte));
    Ok((len, crc))
}

pub fn read_frame<T: DeserializeOwned>(input: &mut dyn Read) -> Result<T, PartsError> {
    let (len, crc) = read_head(input)?;
    let mut payload = Vec::new();
    input.take(len).read_to_end(&mut payload)?;
    if payload.len() as u64 != len {
        return Err(PartsError::Damaged { what: "it is cut off" });
    }
    if crc32fast::hash(&payload) != crc {
        return Err(PartsError::Damaged { what: "its checksum is another one" });
    }
    postcard::from_bytes(&payload).map_err(|_| PartsError::Damaged { what: "its content is another one" })
}

/// Skips a frame.
pub fn skip_frame<R: Read + Seek>(input: &mut R) -> Result<(), PartsError> {
    let (len, _) = read_head(input)?;
    let len = i64::try_from(len).map_err(|_| PartsError::Damaged { what: "it is cut off" })?;
    input.seek(SeekFrom::Current(len))?;
    Ok(())
}

fn cut_off(error: io::Error) -> PartsError {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => PartsError::Damaged { what: "it is cut off" },
        _ => error.into(),
    }
}
