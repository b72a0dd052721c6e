//! A session over a file that is elsewhere, for native programs: fetches what a request needs, and nothing else.
//!
//! [`Remote`] says what it wants, a [`RangeSource`] brings it; [`Client`] is the loop between the two. Pages have theirs in
//! JavaScript.

use crate::format::{DecodeOptions, FormatError, Limits};
use crate::refine::{GoOn, RefineStats, Request};
use crate::remote::Remote;
use crate::session::{Session, SessionError};
use crate::stream::{RangeSource, StreamError, WantedRange};
use std::time::Duration;
use thiserror::Error;

#[doc(hidden)]
pub use crate::remote::Step;

/// How a client works.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClientOptions {
    /// The fields that are wanted, by name; all if none is named.
    pub fields: Vec<String>,
    /// Bytes that blocks of updates may take in memory. What a request needs beyond that is left out.
    pub memory: u64,
    /// What the file may take besides.
    pub limits: Limits,
}

impl Default for ClientOptions {
    /// All fields, and all of the file if need be.
    fn default() -> Self {
        Self { fields: Vec::new(), memory: u64::MAX, limits: Limits::default() }
    }
}

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
    remote: Remote,
}

impl<S: RangeSource> Client<S> {
    /// Opens the file of `source`: returns when the base mesh is there.
    ///
    /// # Errors
    /// If the bytes do not come, or are not those of an MT file.
    pub fn open(source: S, options: ClientOptions) -> Result<Self, ClientError> {
        let ClientOptions { fields, memory, limits } = options;
        let decode = DecodeOptions { limits, fields, ..DecodeOptions::default() };
        let mut client = Self { source, remote: Remote::in_parts(decode, memory) };
        while client.session().mesh().is_none() && !client.fetch(PATIENCE)? {}
        if client.session().mesh().is_none() {
            client.session_mut().finish()?;
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
            let Step { mut stats, complete } = self.step(Duration::ZERO, &mut |_| true)?;
            stats.add_work(&before);
            if complete {
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
        self.remote.request(request, &[])?;
        // What is on its way may not be wanted any more.
        self.ask();
        Ok(())
    }

    /// Takes in some of what is to come, for which it waits up to `patience`, and goes on towards the mesh until `go_on` says
    /// no: for those who want meshes on the way.
    ///
    /// # Errors
    /// As [`Client::refine`].
    pub fn step(&mut self, patience: Duration, go_on: GoOn<'_>) -> Result<Step, ClientError> {
        let end = self.fetched().saturating_add(STEP_BYTES);
        let mut all_here = self.fetch(patience)?;
        while !all_here && self.fetched() < end {
            let before = self.fetched();
            all_here = self.fetch(Duration::ZERO)?;
            if self.fetched() == before {
                break;
            }
        }
        Ok(self.remote.step(go_on)?)
    }

    /// Waits up to `patience` for more of what is wanted, and takes it in; returns whether all of it is here.
    ///
    /// # Errors
    /// If the bytes do not come or are damaged.
    pub fn fetch(&mut self, patience: Duration) -> Result<bool, ClientError> {
        if !self.remote.is_asking() && !self.ask() {
            return Ok(true);
        }
        let Some((range, bytes)) = self.source.next(patience)? else {
            return Ok(false);
        };
        self.remote.take(&range, &bytes)?;
        Ok(!self.remote.is_asking() && !self.ask())
    }

    /// Fetches the exact values that the file keeps, if it does and they are not here: see [`Session::exact_values`]. They take as
    /// many bytes whatever the mesh is.
    ///
    /// # Errors
    /// If the bytes do not come or are damaged.
    pub fn fetch_exact(&mut self) -> Result<(), ClientError> {
        let Some(range) = self.session().exact_range() else { return Ok(()) };
        self.source.want(&[WantedRange { range: range.clone(), priority: 0.0 }]);
        let bytes = loop {
            match self.source.next(PATIENCE)? {
                Some((arrived, bytes)) if arrived == range => break bytes,
                // Something that was wanted before.
                Some((other, bytes)) => self.remote.take(&other, &bytes)?,
                None => {}
            }
        };
        let taken = self.remote.take_exact(&bytes);
        self.ask();
        Ok(taken?)
    }

    /// Gives the source the ranges that are wanted now; whether there are any.
    fn ask(&mut self) -> bool {
        let wanted = self.remote.wanted();
        self.source.want(&wanted);
        !wanted.is_empty()
    }

    /// The session: its mesh, surfaces, fields.
    pub fn session(&self) -> &Session {
        self.remote.session()
    }

    /// The session. Blocks for a request [made here](Session::request) are not fetched before the next one.
    pub fn session_mut(&mut self) -> &mut Session {
        self.remote.session_mut()
    }

    /// The session alone, without anything to bring more bytes.
    pub fn into_session(self) -> Session {
        self.remote.into_session()
    }

    /// The source.
    pub fn source(&self) -> &S {
        &self.source
    }

    /// Bytes of the file that have come, those that came again counted again.
    pub fn fetched(&self) -> u64 {
        self.remote.fetched()
    }

    /// Bytes of the file that have come, each counted once: never more than it has.
    pub fn arrived(&self) -> u64 {
        self.remote.arrived()
    }

    /// The size of the file, once it is known.
    pub fn total(&self) -> Option<u64> {
        self.source.total()
    }
}
