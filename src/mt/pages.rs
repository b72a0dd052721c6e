//! Updates that come and go in pages, and rows of different lengths to keep them in.
//!
//! A page is a block of a half-edge file in memory: it is inserted and evicted as a whole, and an update whose page is not here counts as absent.
//! A page is used without the pages on which it depends, and what is applied does not depend on the order in which pages arrive.

use super::update_errors::Errors;
use super::{ErrorCode, PageError, UpdateId};
use std::ops::Range;

/// A page has at most 2 to this power of updates.
const MAX_PAGE_BITS: u32 = 16;

/// The updates of a page of `2^bits` of an MT of so many; none if there is no such page.
pub(crate) fn updates_of_page(bits: u32, page: u32, updates: u32) -> Range<u32> {
    let (first, end) = (u64::from(page) << bits, u64::from(updates));
    first.min(end) as u32..(first + (1 << bits)).min(end) as u32
}

/// Consecutive updates, as their kind stores them.
pub(super) trait Page {
    fn errors(&self) -> &Errors;

    /// Bytes that it takes.
    fn bytes(&self) -> usize;

    fn updates(&self) -> u32 {
        self.errors().updates()
    }
}

/// The pages of an MT that are present.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pages<P> {
    /// The last one is present.
    /// Their places are there for all up to the last one: they are small.
    pages: Vec<Option<Box<P>>>,
    /// log2 of the updates of a page.
    bits: u32,
    /// Updates of the complete MT.
    total: u32,
    /// The end of the last page that is present.
    updates: u32,
    present: u32,
    bytes: u64,
    /// By field; empty as long as nothing is known, and when all are present.
    to_come: Vec<ErrorCode>,
}

impl<P: Page> Pages<P> {
    /// None yet, of an MT of `total` updates.
    pub fn new(total: u32, bits: u32) -> Self {
        let bits = bits.min(MAX_PAGE_BITS);
        Self { pages: Vec::new(), bits, total, updates: 0, present: 0, bytes: 0, to_come: Vec::new() }
    }

    pub fn bits(&self) -> u32 {
        self.bits
    }

    /// The end of the last page that is present.
    #[inline]
    pub fn updates(&self) -> u32 {
        self.updates
    }

    /// How many updates are present.
    pub fn present(&self) -> u32 {
        self.present
    }

    /// Bytes of the pages that are present.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Bytes of everything, the list of pages included.
    pub fn all_bytes(&self) -> u64 {
        self.bytes + size_of_val(&self.pages[..]) as u64
    }

    /// The updates of page `page`; none if there is no such page.
    pub fn updates_of(&self, page: u32) -> Range<u32> {
        updates_of_page(self.bits, page, self.total)
    }

    /// The page of update `u`, present or not.
    #[inline]
    pub fn page_of(&self, u: u32) -> u32 {
        u >> self.bits
    }

    pub fn get(&self, page: u32) -> Option<&P> {
        self.pages.get(page as usize)?.as_deref()
    }

    /// The page of an update, and the update's place in it.
    #[inline]
    pub fn find(&self, u: u32) -> Option<(&P, usize)> {
        Some((self.pages.get((u >> self.bits) as usize)?.as_deref()?, self.place(u)))
    }

    #[inline]
    fn place(&self, u: u32) -> usize {
        (u & ((1 << self.bits) - 1)) as usize
    }

    #[inline]
    pub fn has(&self, u: UpdateId) -> bool {
        u.0 < self.updates && self.find(u.0).is_some()
    }

    /// The largest error of an update; zero if it is not present.
    #[inline]
    pub fn error(&self, u: UpdateId) -> ErrorCode {
        self.find(u.0).map_or(ErrorCode::ZERO, |(page, place)| page.errors().largest(place))
    }

    /// The error of an update in each field; nothing if it is not present.
    #[inline]
    pub fn errors(&self, u: UpdateId) -> &[ErrorCode] {
        self.find(u.0).map_or(&[], |(page, place)| page.errors().of(place))
    }

    pub fn set_to_come(&mut self, bounds: &[ErrorCode]) {
        self.to_come.clear();
        if self.present < self.total {
            self.to_come.extend_from_slice(bounds);
        }
    }

    pub fn to_come(&self) -> ErrorCode {
        self.unless_present(self.to_come.iter().copied().max())
    }

    pub fn to_come_in(&self, field: usize) -> ErrorCode {
        self.unless_present(self.to_come.get(field).copied())
    }

    fn unless_present(&self, bound: Option<ErrorCode>) -> ErrorCode {
        if self.present >= self.total { ErrorCode::ZERO } else { bound.unwrap_or(ErrorCode::MAX) }
    }

    /// Adds an update behind all that are present: `push` puts it into its page, which `new` makes if it is the first of it.
    pub fn push(&mut self, new: impl FnOnce(Range<u32>) -> P, push: impl FnOnce(&mut P)) {
        let page = self.page_of(self.updates);
        if page as usize == self.pages.len() {
            let empty = new(self.updates_of(page));
            self.bytes += empty.bytes() as u64;
            self.pages.push(Some(Box::new(empty)));
        }
        self.change_last(push);
        self.updates += 1;
        self.present += 1;
    }

    /// Changes the last page.
    fn change_last(&mut self, change: impl FnOnce(&mut P)) {
        // The last page is present.
        let Some(Some(page)) = self.pages.last_mut() else { return };
        self.bytes -= page.bytes() as u64;
        change(page);
        self.bytes += page.bytes() as u64;
    }

    /// The updates of a page that may be inserted if it has so many.
    pub fn check_new(&self, page: u32, updates: usize) -> Result<Range<u32>, PageError> {
        let range = self.updates_of(page);
        if range.is_empty() {
            Err(PageError::Beyond { page })
        } else if self.get(page).is_some() {
            Err(PageError::Present { page })
        } else if updates != range.len() {
            Err(PageError::Length { page, expected: range.len() as u32 })
        } else {
            Ok(range)
        }
    }

    /// Inserts a whole page that [`Pages::check_new`] has allowed.
    pub fn insert(&mut self, page: u32, new: P) {
        if page as usize >= self.pages.len() {
            self.pages.resize_with(page as usize + 1, || None);
        }
        self.bytes += new.bytes() as u64;
        self.present += new.updates();
        self.pages[page as usize] = Some(Box::new(new));
        self.updates = self.updates.max(self.updates_of(page).end);
    }

    /// Takes a page away; none if it is not present.
    pub fn remove(&mut self, page: u32) -> Option<Box<P>> {
        let gone = self.pages.get_mut(page as usize)?.take()?;
        self.bytes -= gone.bytes() as u64;
        self.present -= gone.updates();
        while self.pages.last().is_some_and(Option::is_none) {
            self.pages.pop();
        }
        let last = self.pages.last().and_then(Option::as_deref);
        let before = self.pages.len().saturating_sub(1) << self.bits;
        self.updates = last.map_or(0, |last| before as u32 + last.updates());
        Some(gone)
    }
}

/// Lists of different lengths, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rows<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy> Default for Rows<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Copy> Rows<T> {
    pub fn new() -> Self {
        Self { starts: vec![0], items: Vec::new() }
    }

    pub fn push(&mut self, row: &[T]) {
        self.items.extend_from_slice(row);
        self.starts.push(self.items.len() as u32);
    }

    /// Takes the last row away.
    #[cfg(test)]
    pub fn pop(&mut self) {
        self.starts.pop();
        self.items.truncate(self.starts.last().map_or(0, |&end| end as usize));
    }

    /// The items of all rows.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    #[inline]
    pub fn row(&self, i: usize) -> &[T] {
        &self.items[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.starts[..]) + size_of_val(&self.items[..])
    }
}
