//! A session over a file that is elsewhere, for native programs: fetches what a request needs, and nothing else.
//!
//! [`Session`] says what it wants, a [`RangeSource`] brings it; [`Client`] is the loop between the two. Pages have theirs in
//! JavaScript.

use super::{Session, SessionError};
use crate::format::{DecodeOptions, FormatError};
use crate::refine::{GoOn, RefineStats, Request};
use crate::stream::{RangeSource, StreamError, Traffic, WantedRange};
use std::ops::Range;
use std::time::Duration;
use thiserror::Error;

/// Why a client cannot do what it was asked for. The current mesh is valid all the same.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ClientError {
    /// The bytes do not come.
    #[error(transparent)]
    Stream(#[from] StreamError),
    /// The bytes are not those of a sound MT file.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The request makes no sense for this MT, or the MT is damaged.
    #[error(transparent)]
    Session(#[from] SessionError),
}

/// How long to wait for bytes at a time if no caller waits for a mesh.
const PATIENCE: Duration = Duration::from_secs(1);

/// About how many bytes a step takes in.
const STEP_BYTES: u64 = 1 << 18;

/// A session and the source of its bytes.
#[derive(Debug)]
pub struct Client<S> {
    source: S,
    session: Session,
    /// What has been asked for and has not come.
    asked: Vec<Range<u64>>,
}

impl<S: RangeSource> Client<S> {
    /// Opens the file of `source`, whose blocks may take so many bytes in memory: returns when the base mesh is there. What a
    /// request needs beyond that is left out.
    ///
    /// # Errors
    /// If the bytes do not come, or are not those of an MT file.
    pub fn open(source: S, options: DecodeOptions, memory: u64) -> Result<Self, ClientError> {
        let mut session = Session::in_parts(options, memory);
        if let Some(held) = source.held() {
            session.hold(held.to_vec());
        }
        let mut client = Self { source, session, asked: Vec::new() };
        while client.session.mesh().is_none() && !client.fetch(PATIENCE)? {}
        if client.session.mesh().is_none() {
            client.session.finish()?;
        }
        Ok(client)
    }

    /// Fetches all that a request needs and makes its mesh. What there is no memory for is left out: see
    /// [`Session::block_progress`].
    ///
    /// # Errors
    /// If the request makes no sense for this MT, or bytes that it needs do not come or are damaged.
    pub fn refine(&mut self, request: &Request) -> Result<RefineStats, ClientError> {
        self.request(request)?;
        let mut before = RefineStats::default();
        loop {
            while !self.fetch(PATIENCE)? {}
            let mut stats = self.step(Duration::ZERO, &mut |_| true)?;
            stats.add_work(&before);
            if self.is_complete(&stats) {
                return Ok(stats);
            }
            before = stats;
        }
    }

    /// Sets the request, for [`Client::step`] to make its mesh.
    ///
    /// # Errors
    /// If the request makes no sense for this MT; the request before it then remains.
    pub fn request(&mut self, request: &Request) -> Result<(), ClientError> {
        self.session.request(request)?;
        // What is on its way may not be wanted any more.
        self.ask();
        Ok(())
    }

    /// Takes in some of what is to come, for which it waits up to `patience`, and goes on towards the mesh until `go_on` says
    /// no: for those who want meshes on the way.
    ///
    /// # Errors
    /// As [`Client::refine`].
    pub fn step(&mut self, patience: Duration, go_on: GoOn<'_>) -> Result<RefineStats, ClientError> {
        let end = self.session.fetched().saturating_add(STEP_BYTES);
        let mut all_here = self.fetch(patience)?;
        while !all_here && self.session.fetched() < end {
            let before = self.session.fetched();
            all_here = self.fetch(Duration::ZERO)?;
            if self.session.fetched() == before {
                break;
            }
        }
        Ok(self.session.step(go_on)?)
    }

    /// Whether nothing more is to come after a step: the mesh is as the request wants it, as far as there is memory.
    pub fn is_complete(&self, stats: &RefineStats) -> bool {
        stats.done && !self.session.is_waiting()
    }

    /// Waits up to `patience` for more of what is wanted, and takes it in; returns whether all of it is here.
    ///
    /// # Errors
    /// If the bytes do not come or are damaged.
    pub fn fetch(&mut self, patience: Duration) -> Result<bool, ClientError> {
        if self.asked.is_empty() && !self.ask() {
            return Ok(true);
        }
        let Some((range, bytes)) = self.source.next(patience)? else {
            return Ok(false);
        };
        self.take(&range, &bytes)?;
        Ok(self.asked.is_empty() && !self.ask())
    }

    /// Fetches the exact values that the file keeps, if it does and they are not here: see [`Session::exact_values`]. They take as
    /// many bytes whatever the mesh is.
    ///
    /// # Errors
    /// If the bytes do not come or are damaged.
    pub fn fetch_exact(&mut self) -> Result<(), ClientError> {
        let Some(range) = self.session.exact_range() else { return Ok(()) };
        self.source.want(&[WantedRange { range: range.clone(), priority: 0.0 }]);
        let bytes = loop {
            match self.source.next(PATIENCE)? {
                Some((arrived, bytes)) if arrived == range => break bytes,
                // Something that was wanted before.
                Some((other, bytes)) => self.take(&other, &bytes)?,
                None => {}
            }
        };
        let taken = self.session.take_exact(&bytes);
        self.ask();
        Ok(taken?)
    }

    /// Gives the source the ranges that are wanted now; whether there are any.
    fn ask(&mut self) -> bool {
        let wanted = self.session.wanted();
        self.asked = wanted.iter().map(|wanted| wanted.range.clone()).collect();
        self.source.want(&wanted);
        !wanted.is_empty()
    }

    fn take(&mut self, range: &Range<u64>, bytes: &[u8]) -> Result<(), FormatError> {
        self.asked.retain(|asked| asked != range);
        self.session.take(range, bytes)
    }

    /// The session: its mesh, surfaces, fields.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The session alone, without anything to bring more bytes.
    pub fn into_session(self) -> Session {
        self.session
    }

    /// What has been asked and has come over a network, if the file is there.
    pub fn traffic(&self) -> Option<Traffic> {
        self.source.traffic()
    }

    /// The size of the file, once it is known.
    pub fn total(&self) -> Option<u64> {
        self.source.total()
    }
}
