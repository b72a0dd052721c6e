//! Parts as bytes: frames of a length, a checksum and what `postcard` makes of a value.

use super::PartsError;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};

/// How each file begins; the last byte is the version.
const MAGIC: [u8; 8] = *b"mtparts\x08";

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

/// Passes bytes on, counts them, and takes their checksum.
pub struct Summed<T> {
    inner: T,
    len: u64,
    hasher: crc32fast::Hasher,
}

impl<T> Summed<T> {
    fn new(inner: T) -> Self {
        Self { inner, len: 0, hasher: crc32fast::Hasher::new() }
    }

    fn note(&mut self, bytes: &[u8]) {
        self.len += bytes.len() as u64;
        self.hasher.update(bytes);
    }

    fn sums(self) -> (u64, u32) {
        (self.len, self.hasher.finalize())
    }
}

impl<T: Write> Write for Summed<T> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let len = self.inner.write(bytes)?;
        self.note(&bytes[..len]);
        Ok(len)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

impl<T: Read> Read for Summed<T> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let len = self.inner.read(bytes)?;
        self.note(&bytes[..len]);
        Ok(len)
    }
}

/// Writes a frame of a value.
pub fn write_frame<T: Serialize>(out: &mut dyn Write, value: &T) -> Result<(), PartsError> {
    write_by(out, |out| {
        let mut out = Kept { out, failed: None };
        let written = postcard::to_io(value, &mut out).map(drop);
        match out.failed {
            Some(error) => Err(error.into()),
            None => written.map_err(|_| PartsError::Damaged { what: "it cannot be written" }),
        }
    })
}

/// Writes a frame by `write`, which is called twice, at first for the length and the checksum alone: its bytes are never there as a whole.
pub fn write_by(
    out: &mut dyn Write,
    write: impl Fn(&mut dyn Write) -> Result<(), PartsError>,
) -> Result<(), PartsError> {
    let mut counted = BufWriter::new(Summed::new(io::sink()));
    write(&mut counted)?;
    let (len, crc) = counted.into_inner().map_err(|error| error.into_error())?.sums();
    out.write_all(&len.to_le_bytes())?;
    out.write_all(&crc.to_le_bytes())?;
    let mut out = BufWriter::new(out);
    write(&mut out)?;
    Ok(out.flush()?)
}

/// Keeps why it failed: `postcard` does not tell.
struct Kept<W> {
    out: W,
    failed: Option<io::Error>,
}

impl<W: Write> Write for Kept<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes).map_err(|error| {
            let kind = error.kind();
            self.failed = Some(error);
            kind.into()
        })
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
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

/// Reads a value that may hold text.
pub fn read_frame<T: DeserializeOwned>(input: &mut dyn Read) -> Result<T, PartsError> {
    read_by(input, |frame| {
        let mut payload = Vec::new();
        frame.read_to_end(&mut payload)?;
        Ok(postcard::from_bytes(&payload).ok())
    })
}

/// Reads a value of numbers alone: its bytes are never there as a whole.
pub fn read_numbers<T: DeserializeOwned>(input: &mut dyn Read) -> Result<T, PartsError> {
    read_by(input, |frame| {
        // For one number at a time.
        let mut room = [0; 8];
        let value = postcard::from_io((&mut *frame, &mut room)).ok().map(|(value, _)| value);
        io::copy(frame, &mut io::sink())?;
        Ok(value)
    })
}

/// A frame that is read.
pub type Frame<'a> = BufReader<Summed<io::Take<&'a mut dyn Read>>>;

/// Reads a value by `read`, which reads its frame to the end; none if the content is no such value.
pub fn read_by<'a, T>(
    input: &'a mut dyn Read,
    read: impl FnOnce(&mut Frame<'a>) -> io::Result<Option<T>>,
) -> Result<T, PartsError> {
    let (len, crc) = read_head(input)?;
    let mut frame = BufReader::new(Summed::new(input.take(len)));
    let value = read(&mut frame)?;
    let (found_len, found_crc) = frame.into_inner().sums();
    if found_len != len {
        return Err(PartsError::Damaged { what: "it is cut off" });
    }
    if found_crc != crc {
        return Err(PartsError::Damaged { what: "its checksum is another one" });
    }
    value.ok_or(PartsError::Damaged { what: "its content is another one" })
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
