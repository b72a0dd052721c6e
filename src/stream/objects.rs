//! What is known of a file on a server: which version of it is there, where it ends, and in which objects its bytes are.

use super::error::StreamError;
use super::response::{ResponseHead, UNKNOWN};
use super::shards::Shards;
use crate::format::{HEADER_BYTES, stated_bytes};
use std::collections::BTreeMap;
use std::ops::Range;

/// What distinguishes one version of an object from another.
#[derive(Debug, Default)]
struct Version {
    total: Option<u64>,
    etag: Option<String>,
    modified: Option<String>,
}

impl Version {
    /// Takes over what is in `head`; an error if that is of another version.
    fn learn(&mut self, head: &ResponseHead) -> Result<(), StreamError> {
        agree(&mut self.total, head.total())?;
        let tag = head.strong_etag();
        let same = tag.is_some() && tag == self.etag.as_deref();
        agree(&mut self.etag, tag.map(str::to_owned))?;
        // Servers behind one address may disagree in the date of the same bytes.
        if same { Ok(()) } else { agree(&mut self.modified, head.last_modified.map(str::to_owned)) }
    }
}

fn agree<T: PartialEq>(known: &mut Option<T>, found: Option<T>) -> Result<(), StreamError> {
    match (&known, found) {
        (_, None) => Ok(()),
        (Some(known), Some(found)) => (*known == found).then_some(()).ok_or(StreamError::Changed),
        (None, found) => {
            *known = found;
            Ok(())
        }
    }
}

/// The objects that a file is in: one, or one for each of its shards.
#[derive(Debug, Default)]
pub struct Objects {
    first: Version,
    /// The other shards that have been asked for.
    others: BTreeMap<u64, Version>,
    /// No byte from here on, as far as is known without the length of the first object.
    end: Option<u64>,
    /// The header of the file, as far as it has come.
    start: Vec<u8>,
    shards: Option<Shards>,
}

impl Objects {
    /// Where the file ends, as far as that is known.
    pub fn end(&self) -> u64 {
        self.total().or(self.end).unwrap_or(UNKNOWN)
    }

    /// The size of the whole file, once it is known.
    pub fn total(&self) -> Option<u64> {
        self.shards.map(Shards::total).or(self.first.total)
    }

    /// How many bytes the file has by its header, once that has come.
    pub fn stated(&self) -> Option<u64> {
        stated_bytes(&self.start)
    }

    /// `range` without what lies beyond the end.
    pub fn clip(&self, range: &Range<u64>) -> Range<u64> {
        let end = self.end();
        range.start.min(end)..range.end.min(end)
    }

    /// What names this version: its strong entity tag or, failing that, its date.
    pub fn version(&self) -> Option<&str> {
        self.first.etag.as_deref().or(self.first.modified.as_deref())
    }

    /// The strong entity tag of an object.
    pub fn etag(&self, object: u64) -> Option<&str> {
        let version = if object == 0 { Some(&self.first) } else { self.others.get(&object) };
        version?.etag.as_deref()
    }

    /// The shards, if the file is in several.
    pub fn shards(&self) -> Option<Shards> {
        self.shards
    }

    /// The object that has the byte at this place.
    pub fn object_at(&self, at: u64) -> u64 {
        self.shards.map_or(0, |shards| shards.number_at(at))
    }

    /// The bytes of the file that are in an object, as far as is known.
    pub fn range(&self, object: u64) -> Range<u64> {
        self.shards.map_or(0..self.end(), |shards| shards.range(object))
    }

    /// Takes over what the head of an answer says of an object; an error if that is of another version, or of another length than it must be.
    pub fn learn(&mut self, object: u64, head: &ResponseHead) -> Result<(), StreamError> {
        if object == 0 {
            return self.first.learn(head);
        }
        if let (Some(shards), Some(found)) = (self.shards, head.total()) {
            shards.check(object, found)?;
        }
        self.others.entry(object).or_default().learn(head)
    }

    /// The first object has so many bytes.
    pub fn learn_length(&mut self, length: u64) -> Result<(), StreamError> {
        agree(&mut self.first.total, Some(length))
    }

    /// There are no bytes from `end` on.
    pub fn end_at(&mut self, end: u64) {
        if self.total().is_none() {
            self.end = Some(end.min(self.end()));
        }
    }

    /// The bytes of the header that have not come, if there are that many.
    pub fn rest_of_header(&self) -> Range<u64> {
        let end = if self.end() < HEADER_BYTES as u64 { 0 } else { HEADER_BYTES as u64 };
        self.start.len() as u64..end
    }

    /// Takes what of a chunk is of the header.
    pub fn take_start(&mut self, at: u64, bytes: &[u8]) {
        let held = self.start.len();
        if held < HEADER_BYTES
            && let Some(new) =
                (held as u64).checked_sub(at).and_then(|skip| bytes.get(usize::try_from(skip).ok()?..))
        {
            self.start.extend_from_slice(&new[..new.len().min(HEADER_BYTES - held)]);
        }
    }

    /// Sees that the file is in shards, if what is known now says so and did not before.
    pub fn find_shards(&mut self) -> bool {
        if self.shards.is_none()
            && let (Some(size), Some(total)) = (self.first.total, self.stated())
        {
            self.shards = Shards::of(size, total);
            return self.shards.is_some();
        }
        false
    }
}
