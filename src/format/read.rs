//! Bytes to numbers, every step checked; the counterpart of [`write`](super::write).

use super::FormatError;
use super::error::Result;

/// Most bytes in a string.
pub const MAX_STRING: u32 = 65_535;

/// A cursor over verified bytes that knows where in the file they lie.
pub struct Reader<'a> {
    bytes: &'a [u8],
    /// File offset of the first of the remaining bytes.
    offset: u64,
}

impl<'a> Reader<'a> {
    pub fn new(bytes: &'a [u8], offset: u64) -> Self {
        Self { bytes, offset }
    }

    /// An error at the current place.
    pub fn corrupt(&self, what: &'static str) -> FormatError {
        FormatError::Corrupt { offset: self.offset, what }
    }

    /// A section that cannot stand here.
    pub fn out_of_place(&self) -> FormatError {
        self.corrupt("a section is out of place")
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let Some((head, tail)) = self.bytes.split_at_checked(count) else {
            return Err(self.corrupt("the section is shorter than its content"));
        };
        self.bytes = tail;
        self.offset += count as u64;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub fn u8(&mut self) -> Result<u8> {
        Ok(self.array::<1>()?[0])
    }

    pub fn u32(&mut self) -> Result<u32> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub fn f64(&mut self) -> Result<f64> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    pub fn f64x3(&mut self) -> Result<[f64; 3]> {
        Ok([self.f64()?, self.f64()?, self.f64()?])
    }

    /// The shortest LEB128 form of a number of at most 64 bits.
    pub fn varint64(&mut self) -> Result<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.u8()?;
            let part = u64::from(byte & 0x7F);
            if shift == 63 && byte > 1 {
                return Err(self.corrupt("a number has more than 64 bits"));
            }
            value |= part << shift;
            if byte < 0x80 {
                return if byte == 0 && shift > 0 {
                    Err(self.corrupt("a number is longer than needed"))
                } else {
                    Ok(value)
                };
            }
        }
        Err(self.corrupt("a number has more than 64 bits"))
    }

    pub fn varint(&mut self) -> Result<u32> {
        let value = self.varint64()?;
        u32::try_from(value).map_err(|_| self.corrupt("a number has more than 32 bits"))
    }

    pub fn zigzag(&mut self) -> Result<i32> {
        let value = self.varint()?;
        Ok((value >> 1) as i32 ^ -((value & 1) as i32))
    }

    pub fn string(&mut self) -> Result<&'a str> {
        let length = self.varint()?;
        if length > MAX_STRING {
            return Err(self.corrupt("a text is longer than 65535 bytes"));
        }
        let bytes = self.take(length as usize)?;
        std::str::from_utf8(bytes).map_err(|_| self.corrupt("a text is not UTF-8"))
    }

    /// The next `count` pieces of `size` bytes.
    pub fn bytes(&mut self, count: usize, size: usize) -> Result<&'a [u8]> {
        match count.checked_mul(size) {
            Some(bytes) => self.take(bytes),
            None => Err(self.corrupt("the section is shorter than its content")),
        }
    }

    /// All bytes that are left.
    pub fn rest(&mut self) -> &'a [u8] {
        let rest = std::mem::take(&mut self.bytes);
        self.offset += rest.len() as u64;
        rest
    }

    /// Bytes that are left.
    pub fn len(&self) -> usize {
        self.bytes.len()
    }

    /// Whether all bytes are read.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// A cursor over the next column.
    pub fn column(&mut self) -> Result<Reader<'a>> {
        let length = self.varint()?;
        let offset = self.offset;
        Ok(Reader::new(self.take(length as usize)?, offset))
    }

    /// Everything must have been read.
    pub fn end(self) -> Result<()> {
        if self.bytes.is_empty() { Ok(()) } else { Err(self.corrupt("bytes are left over")) }
    }
}
