//! A file elsewhere and the mesh that is made of it, as one state machine without I/O.
//!
//! ```text
//!            request ──▶ Remote ──▶ wanted: ranges of bytes, by importance
//!   mesh, stats ◀── step │ ▲
//!                        ▼ │ take: ranges that are complete
//!                      Session          Loader ◀── responses, pieces of bytes, failures ── fetch, sockets
//!                                          └─────▶ what to fetch, cancel, read from a cache, or wait for
//! ```
//!
//! [`Session`] owns the blocks of the file that are in memory and plans which others its request needs. [`Loader`] owns the
//! requests over a network: it joins ranges, tries again, notices other versions of the file. [`Remote`] owns what lies between:
//! which ranges have been asked for and have not come, whether the file was cut, and when the mesh is complete. Whoever has the
//! bytes only moves them: a [`Client`](crate::client::Client) from any source; a page, or Node, from `fetch`, whose pieces of
//! bytes go to a loader and from there to the session without another copy outside ([`Remote::supply`]).

use crate::format::{DecodeOptions, FormatError};
use crate::refine::{Criterion, GoOn, RefineStats, Request};
use crate::session::{Session, SessionError};
use crate::stream::{Loader, WantedRange};
use std::ops::Range;
use std::sync::Arc;

/// How far a [step](Remote::step) has come.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// What became of the mesh; with all that has arrived, it is done.
    pub stats: RefineStats,
    /// Nothing more is to come: the mesh is as the request wants it, as far as there is memory.
    pub complete: bool,
}

/// A session, and what it waits for.
#[derive(Debug, Default)]
pub struct Remote {
    session: Session,
    /// What has been asked for and has not come.
    asked: Vec<Range<u64>>,
    fetched: u64,
    /// What has come, in ascending order; no two of these meet.
    arrived: Vec<Range<u64>>,
}

impl Remote {
    /// A file of which only those blocks come that are needed, which may take so many bytes in memory.
    pub fn in_parts(options: DecodeOptions, memory: u64) -> Self {
        Self::of(Session::in_parts(options, memory))
    }

    /// A file that comes from front to back, by [`Session::feed`].
    pub fn of(session: Session) -> Self {
        Self { session, ..Self::default() }
    }

    /// The session: its mesh, surfaces, fields.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The session. What is [requested](Session::request) at here is wanted from the next call of [`Remote::wanted`] on.
    pub fn session_mut(&mut self) -> &mut Session {
        &mut self.session
    }

    /// The session alone.
    pub fn into_session(self) -> Session {
        self.session
    }

    /// Bytes of the file that have come, those that came again counted again.
    pub fn fetched(&self) -> u64 {
        self.fetched
    }

    /// Bytes of the file that have come, each counted once: never more than it has.
    pub fn arrived(&self) -> u64 {
        self.arrived.iter().map(|range| range.end - range.start).sum()
    }

    /// Notes that so many bytes have come from `start` on.
    fn arrive(&mut self, start: u64, bytes: usize) {
        if bytes == 0 {
            return;
        }
        self.fetched += bytes as u64;
        let new = start..start.saturating_add(bytes as u64);
        let first = self.arrived.partition_point(|range| range.end < new.start);
        let behind = self.arrived.partition_point(|range| range.start <= new.end);
        let meets = self.arrived[first..behind].iter();
        let whole = meets.fold(new, |whole, range| whole.start.min(range.start)..whole.end.max(range.end));
        self.arrived.splice(first..behind, [whole]);
    }

    /// Sets the request, for [`Remote::step`] to make its mesh: see [`Session::request_with`].
    ///
    /// # Errors
    /// If the request makes no sense for this MT; the request before it then remains.
    pub fn request(&mut self, request: &Request, custom: &[Arc<dyn Criterion>]) -> Result<(), SessionError> {
        self.session.request_with(request, custom)
    }

    /// Goes on towards that mesh with what is here, until it is there or `go_on` says no.
    ///
    /// # Errors
    /// As [`Session::step`].
    pub fn step(&mut self, go_on: GoOn<'_>) -> Result<Step, SessionError> {
        let stats = self.session.step(go_on)?;
        let complete = stats.done && !self.session.is_waiting();
        Ok(Step { stats, complete })
    }

    /// The ranges of bytes that are wanted now, all of them. Each is taken once; what was asked for before and is not among them
    /// is not wanted any more.
    pub fn wanted(&mut self) -> Vec<WantedRange> {
        let wanted = self.session.wanted();
        self.asked = wanted.iter().map(|wanted| wanted.range.clone()).collect();
        let ranges = wanted.into_iter();
        ranges.map(|one| WantedRange { range: one.range, priority: one.priority as f32 }).collect()
    }

    /// Whether something has been asked for that has not come.
    pub fn is_asking(&self) -> bool {
        !self.asked.is_empty()
    }

    /// Takes a range that was wanted, with its bytes: fewer where it reaches beyond the end of the file.
    ///
    /// # Errors
    /// If the bytes are damaged, or end where more is needed. What was there before stays usable.
    pub fn take(&mut self, range: &Range<u64>, bytes: &[u8]) -> Result<(), FormatError> {
        self.asked.retain(|asked| asked != range);
        self.arrive(range.start, bytes.len());
        self.session.take(range.start, bytes)?;
        let is_short = (bytes.len() as u64) < range.end - range.start;
        // At the end of a sound file nothing more is wanted.
        if is_short && self.session.wanted().iter().any(|wanted| wanted.range.start == range.start) {
            return Err(FormatError::Truncated { offset: range.start + bytes.len() as u64 });
        }
        Ok(())
    }

    /// Takes the bytes of [`Session::exact_range`].
    ///
    /// # Errors
    /// As [`Session::take_exact`].
    pub fn take_exact(&mut self, bytes: &[u8]) -> Result<(), FormatError> {
        if let Some(range) = self.session.exact_range() {
            self.arrive(range.start, bytes.len());
        }
        self.session.take_exact(bytes)
    }

    /// Takes all complete ranges of `loader`, and gives it those that are wanted then; whether there was any.
    ///
    /// # Errors
    /// As [`Remote::take`]; nothing is wanted then until the next call.
    pub fn supply(&mut self, loader: &mut Loader) -> Result<bool, FormatError> {
        let mut any = false;
        loop {
            while let Some((range, bytes)) = loader.take() {
                any = true;
                // What else has come may be as damaged.
                self.take(&range, &bytes).inspect_err(|_| loader.drop_all())?;
            }
            loader.want(&self.wanted());
            // What is held for other ranges may make new ones complete.
            if !loader.has_complete() {
                return Ok(any);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_come_again_are_counted_once() {
        let mut remote = Remote::default();
        for (start, bytes, arrived) in
            [(10, 5, 5), (0, 2, 7), (12, 8, 12), (2, 8, 20), (0, 20, 20), (30, 0, 20), (29, 3, 23)]
        {
            remote.arrive(start, bytes);
            assert_eq!(remote.arrived(), arrived, "{start} {bytes}");
        }
        assert_eq!(remote.fetched(), 46);
    }
}
