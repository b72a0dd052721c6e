//! A section that is ready to be written, and one that has been found among bytes.

use super::coder::{Models, Writer};
use super::header::{HEAD_BYTES, Kind, SectionHead};
use super::read::Reader;
use super::{EncodeError, FormatError, write};

/// Takes bytes of a file.
pub type PutBytes<'a> = &'a mut dyn FnMut(&[u8]) -> Result<(), EncodeError>;

/// The head of a section and what follows it.
pub struct Section {
    pub head: SectionHead,
    pub payload: Vec<u8>,
}

impl Section {
    pub fn new(kind: Kind, payload: Vec<u8>) -> Result<Self, EncodeError> {
        if u32::try_from(payload.len() + HEAD_BYTES).is_err() {
            return Err(EncodeError::TooLong { what: "a section of more than 4 GiB" });
        }
        Ok(Self { head: SectionHead::new(kind, &payload), payload })
    }

    /// A section of what `write` writes.
    pub fn written(kind: Kind, write: impl FnOnce(&mut Vec<u8>)) -> Result<Self, EncodeError> {
        let mut payload = Vec::new();
        write(&mut payload);
        Self::new(kind, payload)
    }

    /// A section that begins with some bytes, the rest of which is coded.
    pub fn coded(
        kind: Kind,
        head: &[u32],
        models: &Models,
        put: impl FnOnce(&mut Writer<'_>),
    ) -> Result<Self, EncodeError> {
        Self::written(kind, |payload| {
            head.iter().for_each(|&number| write::varint(payload, u64::from(number)));
            let mut writer = Writer::new(models);
            put(&mut writer);
            writer.finish(payload);
        })
    }

    /// Puts the head and the payload.
    pub fn put(&self, put: PutBytes<'_>) -> Result<(), EncodeError> {
        put(&self.head.to_bytes())?;
        put(&self.payload)
    }

    /// The bytes with the head, and the checksum.
    pub fn sum(&self) -> (u64, u32) {
        (self.len(), self.head.crc)
    }

    /// Bytes with the head.
    pub fn len(&self) -> u64 {
        (HEAD_BYTES + self.payload.len()) as u64
    }
}

/// A whole section, its checksum verified, and the bytes behind it.
pub struct FoundSection<'a> {
    pub kind: Kind,
    pub content: Reader<'a>,
    pub behind: &'a [u8],
}

/// The section at the start of `bytes`, which are at `offset` in the file; `short` is the error if there are too few of them.
pub fn find_section(
    bytes: &[u8],
    offset: u64,
    short: impl Fn() -> FormatError,
) -> Result<FoundSection<'_>, FormatError> {
    let (head, behind) = bytes.split_first_chunk::<HEAD_BYTES>().ok_or_else(&short)?;
    let head = SectionHead::parse(head);
    let (payload, behind) = behind.split_at_checked(head.length as usize).ok_or_else(&short)?;
    if SectionHead::new(head.kind, payload).crc != head.crc {
        return Err(FormatError::Corrupt { offset, what: "the checksum of a section does not match" });
    }
    Ok(FoundSection { kind: head.kind, content: Reader::new(payload, offset + HEAD_BYTES as u64), behind })
}
