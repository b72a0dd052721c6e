//! A section that is ready to be written.

use super::coder::{Models, Writer};
use super::header::{HEAD_BYTES, Kind, SectionHead};
use super::{EncodeError, write};

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

    /// Bytes with the head.
    pub fn len(&self) -> u64 {
        (HEAD_BYTES + self.payload.len()) as u64
    }
}
