//! VTK XML files of which parts are read: what the file is on a disk, but for its XML text.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use crate::error::{ReadError, ReadReason, Stop};
use crate::file_kind::without_mark;
use crate::ghosts::{GHOST_LEVELS, GHOST_TYPE};
use crate::skeleton::{Skeleton, left_in_file};
use crate::stored::{Bytes, Stored};
use crate::vtu::PieceReader;
use crate::xml::{Array, Document, Place};
use crate::{format_of, packed};

/// Bytes that are read at a time where all are passed over.
const STEP: usize = 1 << 20;

/// A file whose text was read.
#[derive(Debug)]
pub(super) struct XmlFile {
    file: File,
    skeleton: Skeleton,
}

impl XmlFile {
    /// Opens a file of this format; none if it is another one.
    pub fn open(path: &Path, format: &str) -> Result<Option<Self>, Stop> {
        let io_error = |error: std::io::Error| ReadReason::Io(error.to_string());
        let file = File::open(path).map_err(io_error)?;
        // Pipes and the like are read once.
        if !file.metadata().map_err(io_error)?.is_file() {
            return Ok(None);
        }
        let mut reader = BufReader::with_capacity(STEP, &file);
        let head = std::io::BufRead::fill_buf(&mut reader).map_err(io_error)?;
        if packed::is_gzip(head) || format_of(head) != Some(format) {
            return Ok(None);
        }
        let skeleton = Skeleton::read(reader)?;
        Ok(Some(Self { file, skeleton }))
    }

    pub fn document(&self) -> Result<Document<'_>, ReadError> {
        Document::parse(without_mark(&self.skeleton.text))
    }

    /// The time of the data set, as [`Document::time`].
    pub fn time(&self, document: &Document<'_>) -> Option<f64> {
        let array = document.time_array()?;
        let time = match self.stored(document, array, 1) {
            Ok(stored) => stored.floats(0..1).ok()?.first().copied(),
            Err(_) => document.time(),
        };
        time.filter(|time| time.is_finite())
    }

    /// Opens an array of so many numbers.
    pub fn stored<'a>(
        &'a self,
        document: &'a Document<'_>,
        array: &'a Array<'_>,
        count: u64,
    ) -> Result<Stored<'a>, Stop> {
        let open = || {
            let Some(number) = array.number_type() else {
                return Err(Stop::Whole("an array that is needed has no numbers"));
            };
            let file = &self.file;
            let bytes = match document.place_of(array)? {
                Place::Numbers => return Err(Stop::Whole("its numbers are text")),
                Place::Inline(text) => match left_in_file(text) {
                    Some((start, end)) => (Bytes::File { file, start, end }, true, true),
                    None => (Bytes::Memory(text.trim_ascii().as_bytes()), true, true),
                },
                Place::Appended { offset, base64 } => {
                    let end = file.metadata().map_err(|error| ReadReason::Io(error.to_string()))?.len();
                    let start = self.skeleton.data.saturating_add(offset).min(end);
                    (Bytes::File { file, start, end }, base64, false)
                }
            };
            Stored::open(bytes, document.framing, number, count)
        };
        open().map_err(|stop| stop.at(|| array.place()))
    }
}

/// What is marked as ghosts takes the whole.
pub(super) fn expect_no_ghosts(reader: &PieceReader<'_, '_>) -> Result<(), Stop> {
    let mut marks = ["PointData", "CellData"].into_iter().flat_map(|section| reader.piece.section(section));
    if marks.any(|array| [GHOST_TYPE, GHOST_LEVELS].contains(&array.name())) {
        return Err(Stop::Whole("it marks cells or points as ghosts"));
    }
    Ok(())
}
