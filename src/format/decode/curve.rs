//! How many bytes of a file a mesh of some error takes, as the index shows.

use super::Decoder;
use crate::mt::{ErrorCode, FieldInfo};
use std::ops::Range;

/// A mesh of which error can be had for how many bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBytes {
    /// The error of the whole mesh, as a fraction of the field's range; infinite if it may be any.
    pub error: f64,
    /// Bytes of the file, from its head on.
    pub bytes: u64,
}

impl ErrorBytes {
    /// The error in units of the field: a request for it is one for [`ErrorBytes::error`], never for less.
    pub fn error_in_units(&self, field: &FieldInfo) -> f64 {
        let error = self.error * field.range();
        if error / field.range() < self.error { error.next_up() } else { error }
    }
}

impl Decoder {
    /// How many bytes have to come for a mesh whose error in a wanted field, by its place among these, is nowhere above some
    /// value. Errors fall, bytes grow; the last error is 0. For an error in between, the next entry holds. Empty before that is known.
    ///
    /// `fetched` bytes from the start of the file come whatever is asked for, if what stands in front of the blocks is not longer.
    ///
    /// Files of half-edge MTs come by blocks: these are the bytes of exactly the blocks that
    /// [`Session::wanted`](crate::session::Session::wanted) names for such a request of a new session, with the wanted fields. Where
    /// the index is in pages, pages that such a request needs count, too, and of a page that is not here all blocks count as long as the page's largest
    /// error is above that of the mesh: it is no less than what comes. Files of other kinds come
    /// from front to back and do not say before what is where: the only entry is the whole file.
    pub fn bytes_by_error(&self, place: usize, fetched: u64) -> Vec<ErrorBytes> {
        let (Some(info), Some(&field)) = (&self.head.info, self.head.wanted.get(place)) else {
            return Vec::new();
        };
        if !info.kind.is_paged() {
            return self.total.map(|bytes| ErrorBytes { error: 0.0, bytes }).into_iter().collect();
        }
        let (Some(index), Some(head)) = (&self.head.index, self.head_end()) else { return Vec::new() };
        let limit = self.total.unwrap_or(u64::MAX);
        let fetched = fetched.max(head).min(limit);
        let mut is_wanted = vec![false; info.fields.len()];
        self.head.wanted.iter().for_each(|&wanted| is_wanted[wanted] = true);
        // Codes in the index are multiples of 256, or all ones.
        let mut bytes_of = [0_u64; 256];
        let mut come = |code: ErrorCode, range: Range<u64>| {
            let missing = range.end.saturating_sub(range.start.max(fetched));
            let bytes = &mut bytes_of[usize::from(code.0 >> 8)];
            *bytes = bytes.saturating_add(missing);
        };
        let mut at = index.first_block().saturating_add(head);
        for (number, page) in (0..).zip(index.pages()) {
            if let Some(Range { start, end }) = index.page_range(number) {
                come(page.all.errors[field], head.saturating_add(start)..head.saturating_add(end));
            }
            if !page.is_here() {
                let end = at.saturating_add(page.block_bytes);
                come(page.all.errors[field], at..end);
                at = end;
            }
            for (_, block) in index.known_of(number) {
                for (part, &length) in block.lengths.iter().enumerate() {
                    let end = at.saturating_add(u64::from(length));
                    if part == 0 || is_wanted[part - 1] {
                        come(block.errors[field], at..end);
                    }
                    at = end;
                }
            }
        }
        let mut curve = Vec::new();
        let mut bytes = fetched;
        for code in (1..=u8::MAX).rev().filter(|&code| bytes_of[usize::from(code)] > 0) {
            curve.push(ErrorBytes { error: error_of(code), bytes });
            bytes = bytes.saturating_add(bytes_of[usize::from(code)]).min(limit);
        }
        curve.push(ErrorBytes { error: 0.0, bytes });
        curve
    }
}

/// The error that a byte of the index stands for.
fn error_of(code: u8) -> f64 {
    if code == u8::MAX { f64::INFINITY } else { ErrorCode(u16::from(code) << 8).error() }
}
