//! An MT to bytes: the same MT and options give the same bytes everywhere.

use super::BLOCK_UPDATES;
use super::header::HEADER_BYTES;
use super::header::Head;
use super::header::Kind;
use super::header::header;
use super::payload;
use super::payload::Totals;
use crate::mt::BaseMeshError;
use crate::mt::MtRef;
use std::collections::BTreeMap;
use std::fmt;
use std::io;

/// What goes into a file besides the MT.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EncodeOptions {
    /// Free keys and values, kept as they are. What is here makes the bytes: leave out dates and paths.
    pub metadata: BTreeMap<String, String>,
}

/// Why an MT cannot be written.
#[derive(Debug)]
#[non_exhaustive]
pub enum EncodeError {
    /// Not all updates of the MT are there.
    Incomplete {
        /// Updates that are there.
        updates: u32,
        /// Updates that the description tells.
        expected: u32,
    },
    /// Something is longer than the file can say.
    TooLong {
        /// What it is.
        what: &'static str,
    },
    /// The description or the base mesh could not be read back.
    Base(BaseMeshError),
    /// The writer failed.
    Write(io::Error),
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Incomplete { updates, expected } => write!(
                f,
                "the MT has {updates} of the {expected} updates that its description tells; write it when it is complete"
            ),
            Self::TooLong { what } => write!(f, "{what} is too long for an MT file; shorten it"),
            Self::Base(_) => f.write_str("the MT cannot be written"),
            Self::Write(_) => f.write_str("the MT file could not be written"),
        }
    }
}

impl std::error::Error for EncodeError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Base(error) => Some(error),
            Self::Write(error) => Some(error),
            _ => None,
        }
    }
}

/// The bytes of an MT file.
///
/// # Errors
/// If the MT is not complete, or could not be read back.
pub fn encode<'a>(mt: impl Into<MtRef<'a>>, options: &EncodeOptions) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Vec::new();
    encode_to(mt, options, &mut bytes)?;
    Ok(bytes)
}

/// Writes an MT file, section by section: it is never in memory as a whole. Returns its size in bytes.
///
/// # Errors
/// As [`encode`], and when `writer` fails.
pub fn encode_to<'a>(
    mt: impl Into<MtRef<'a>>,
    options: &EncodeOptions,
    writer: &mut dyn io::Write,
) -> Result<u64, EncodeError> {
    let mt = mt.into();
    check(mt)?;
    // The header tells the size of all, so everything is encoded twice: that is cheaper than keeping it.
    let mut total = HEADER_BYTES as u64;
    sections(mt, options, &mut |head, payload| {
        total += head.len() as u64 + payload.len() as u64;
        Ok(())
    })?;
    writer.write_all(&header(total)).map_err(EncodeError::Write)?;
    sections(mt, options, &mut |head, payload| {
        writer.write_all(head).and_then(|()| writer.write_all(payload))
    })?;
    writer.flush().map_err(EncodeError::Write)?;
    Ok(total)
}

/// What a decoder would refuse must not be written.
fn check(mt: MtRef<'_>) -> Result<(), EncodeError> {
    let info = mt.info();
    if mt.updates() != info.updates {
        return Err(EncodeError::Incomplete { updates: mt.updates(), expected: info.updates });
    }
    mt.base().check(info).map_err(EncodeError::Base)?;
    payload::check_counts(info, mt.base().positions.len() as u64)
        .and_then(|()| payload::check_reference(mt))
        .map_err(EncodeError::Base)
}

/// Takes the head and the payload of a section.
type Sink<'a> = &'a mut dyn FnMut(&[u8], &[u8]) -> io::Result<()>;

/// Gives all sections to `sink`, in order.
fn sections(mt: MtRef<'_>, options: &EncodeOptions, sink: Sink<'_>) -> Result<(), EncodeError> {
    let mut totals = Totals { updates: mt.updates(), sections: 0, crc: 0 };
    let mut chain = crc32fast::Hasher::new();
    let mut put = |kind, payload: &mut Vec<u8>| {
        if u32::try_from(payload.len()).is_err() {
            return Err(EncodeError::TooLong { what: "a section of more than 4 GiB" });
        }
        let head = Head::new(kind, payload);
        if kind != Kind::ENDF {
            chain.update(&head.crc.to_le_bytes());
            totals.sections += 1;
        }
        sink(&head.to_bytes(), payload).map_err(EncodeError::Write)?;
        payload.clear();
        totals.crc = chain.clone().finalize();
        Ok(totals)
    };
    let mut payload = Vec::new();
    payload::write_info(&mut payload, mt.info(), &options.metadata)?;
    put(Kind::INFO, &mut payload)?;
    payload::write_base(&mut payload, mt);
    let mut totals = put(Kind::BASE, &mut payload)?;
    let mut first = 0;
    while first < mt.updates() {
        let end = mt.updates().min(first + BLOCK_UPDATES);
        payload::write_updates(&mut payload, mt, first, end);
        totals = put(payload::section_of(mt.info().kind), &mut payload)?;
        first = end;
    }
    payload::write_end(&mut payload, totals);
    put(Kind::ENDF, &mut payload)?;
    Ok(())
}
