//! The text of a VTK XML file without the values of its arrays, of which places in the file are kept instead.

use std::io::{self, BufRead};

use crate::error::{ReadReason, Stop};
use crate::payload::find;

/// Longer texts of arrays are left in the file.
const LONG_TEXT: usize = 1 << 12;
/// Most bytes of a tag or a comment, and of the whole text.
const MOST_OF_TAG: usize = 1 << 16;
const MOST_BYTES: usize = 1 << 26;

/// What stands for a text that is left in the file, before where it begins and ends. No number and no base64 begins like this.
const LEFT: char = '@';

/// The text of a file up to its appended data.
#[derive(Clone, Debug, Default)]
pub(super) struct Skeleton {
    pub text: Vec<u8>,
    /// Where the appended data begins.
    pub data: u64,
}

/// Where in its file the text of an array begins and ends, if it was left there.
pub(super) fn left_in_file(text: &str) -> Option<(u64, u64)> {
    let (start, end) = text.strip_prefix(LEFT)?.trim_ascii_end().split_once('-')?;
    Some((start.parse().ok()?, end.parse().ok()?))
}

impl Skeleton {
    /// Reads a file from its beginning, up to its appended data or else to its end.
    pub fn read(file: impl BufRead) -> Result<Self, Stop> {
        let mut bytes = Passed { file, at: 0 };
        let mut text = Vec::new();
        let mut is_array = false;
        loop {
            let (start, before) = (bytes.at, text.len());
            let most = if is_array { LONG_TEXT + 1 } else { MOST_OF_TAG };
            let has_tag = bytes.until(b'<', &mut text, most).map_err(io_error)?;
            let passed = bytes.at - start - u64::from(has_tag);
            if is_array && passed > LONG_TEXT as u64 {
                // White space in front is no part of it.
                let spaces = text[before..].iter().take_while(|byte| byte.is_ascii_whitespace()).count();
                if spaces > LONG_TEXT {
                    return Err(Stop::Whole("its arrays are not in one piece"));
                }
                text.truncate(before);
                let place = format!("{LEFT}{}-{}", start + spaces as u64, start + passed);
                text.extend(place.bytes());
            } else if passed > MOST_OF_TAG as u64 || text.len() > MOST_BYTES {
                return Err(Stop::Whole("its XML text is long"));
            }
            if !has_tag {
                return Ok(Self { text, data: 0 });
            }
            let tag = text.len();
            text.push(b'<');
            loop {
                let complete = bytes.until(b'>', &mut text, MOST_OF_TAG).map_err(io_error)?;
                if !complete {
                    // What is cut off is for the parser to say.
                    return Ok(Self { text, data: 0 });
                }
                text.push(b'>');
                if text.len() - tag > MOST_OF_TAG {
                    return Err(Stop::Whole("its XML text is long"));
                }
                if is_closed(&text[tag..]) {
                    break;
                }
            }
            let opened = &text[tag + 1..];
            is_array = opened.starts_with(b"DataArray") && !opened.ends_with(b"/>");
            if opened.starts_with(b"AppendedData") {
                return Self::appended(bytes, text);
            }
        }
    }

    /// The text is complete but for the underscore in front of the data.
    fn appended(mut bytes: Passed<impl BufRead>, mut text: Vec<u8>) -> Result<Self, Stop> {
        let mut space = Vec::new();
        let is_there = bytes.until(b'_', &mut space, MOST_OF_TAG).map_err(io_error)?;
        if !is_there || !space.trim_ascii().is_empty() {
            let missing = ReadReason::Missing("the underscore before the data".into());
            return Err(Stop::from(missing).at(|| "<AppendedData>".into()));
        }
        text.push(b'_');
        Ok(Self { text, data: bytes.at })
    }
}

fn io_error(error: io::Error) -> Stop {
    ReadReason::Io(error.to_string()).into()
}

/// Whether markup that ends in `>` ends there: in values of attributes, comments and the like this is a character as any other.
fn is_closed(markup: &[u8]) -> bool {
    for (start, end) in [(&b"<!--"[..], &b"-->"[..]), (b"<![CDATA[", b"]]>"), (b"<?", b"?>")] {
        if markup.starts_with(start) {
            return markup.len() >= start.len() + end.len() && markup.ends_with(end);
        }
    }
    let mut quote = None;
    for byte in markup {
        match quote {
            None if matches!(byte, b'"' | b'\'') => quote = Some(byte),
            Some(open) if open == byte => quote = None,
            _ => {}
        }
    }
    quote.is_none()
}

/// A file, and how far it was read.
struct Passed<R> {
    file: R,
    at: u64,
}

impl<R: BufRead> Passed<R> {
    /// Passes over all bytes up to and with the next `end`, and keeps those before it, at most so many; false if there is none.
    fn until(&mut self, end: u8, kept: &mut Vec<u8>, most: usize) -> io::Result<bool> {
        let before = kept.len();
        loop {
            let buffer = self.file.fill_buf()?;
            if buffer.is_empty() {
                return Ok(false);
            }
            let found = find(buffer, |byte| byte == end);
            let count = found.unwrap_or(buffer.len());
            let room = most.saturating_sub(kept.len() - before);
            kept.extend_from_slice(&buffer[..count.min(room)]);
            let passed = count + usize::from(found.is_some());
            self.file.consume(passed);
            self.at += passed as u64;
            if found.is_some() {
                return Ok(true);
            }
        }
    }
}
