//! A session over a file that is elsewhere, for native programs: fetches what a request needs, and nothing else.
//!
//! [`Session::in_parts`] says what it wants, a [`Source`] brings it; [`Client`] is the loop between the two. Pages have theirs
//! in JavaScript.

use crate::format::DecodeOptions;
use crate::format::FormatError;
use crate::format::Limits;
use crate::refine::RefineStats;
use crate::refine::Request;
use crate::session::GoOn;
use crate::session::Session;
use crate::session::SessionError;
use crate::stream::Arrived;
use crate::stream::Source;
use crate::stream::StreamError;
use crate::stream::Wanted;
use std::fmt;
use std::ops::Range;
use std::time::Duration;

/// How a client works.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClientOptions {
    /// The fields that are wanted, by name; all if none is named.
    pub fields: Vec<String>,
    /// Bytes that blocks of updates may take in memory. What a request needs beyond that is left out.
    pub room: u64,
    /// What the file may take besides.
    pub limits: Limits,
}

impl Default for ClientOptions {
    /// All fields, and all of the file if need be.
    fn default() -> Self {
        Self { fields: Vec::new(), room: u64::MAX, limits: Limits::default() }
    }
}

/// Why a client cannot do what it was asked for. The current mesh is valid all the same.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ClientError {
    /// The bytes do not come.
    Stream(StreamError),
    /// The bytes are not those of a sound MT file.
    Format(FormatError),
    /// The request makes no sense for this MT, or the MT is damaged.
    Session(SessionError),
}

impl fmt::Display for ClientError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stream(error) => write!(f, "{error}"),
            Self::Format(error) => write!(f, "{error}"),
            Self::Session(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for ClientError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        // Each is printed as it is, so what stands behind it comes next.
        match self {
            Self::Stream(error) => error.source(),
            Self::Format(error) => error.source(),
            Self::Session(error) => error.source(),
        }
    }
}

/// How far a [step](Client::step) has come.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// What became of the mesh; with all that has arrived, it is done.
    pub stats: RefineStats,
    /// Nothing more is to come: the mesh is as the request wants it, as far as there is room.
    pub complete: bool,
}

/// How long is waited for bytes at a time where nobody waits for a mesh.
const PATIENCE: Duration = Duration::from_secs(1);

/// About how many bytes a step takes in.
const STEP_BYTES: u64 = 1 << 18;

/// A session and the source of its bytes.
#[derive(Debug)]
pub struct Client<S> {
    source: S,
    session: Session,
    /// What the source has been told and has not brought.
    asked: Vec<Range<u64>>,
    fetched: u64,
}

impl<S: Source> Client<S> {
    /// Opens the file of `source`: returns when the base mesh is there.
    ///
    /// # Errors
    /// If the bytes do not come, or are not those of an MT file.
    pub fn open(source: S, options: ClientOptions) -> Result<Self, ClientError> {
        let ClientOptions { fields, room, limits } = options;
        let decode = DecodeOptions { limits, fields, ..DecodeOptions::default() };
        let session = Session::in_parts(decode, room);
        let mut client = Self { source, session, asked: Vec::new(), fetched: 0 };
        while client.session.mesh().is_none() && !client.fetch(PATIENCE)? {}
        if client.session.mesh().is_none() {
            client.session.finish().map_err(ClientError::Format)?;
        }
        Ok(client)
    }

    /// Fetches all that a request needs and makes its mesh. What there is no room for is left out: see
    /// [`Session::block_progress`].
    ///
    /// # Errors
    /// If the request makes no sense for this MT, or bytes that it needs do not come or are damaged.
    pub fn refine(&mut self, request: &Request) -> Result<RefineStats, ClientError> {
        self.aim(request)?;
        loop {
            while !self.fetch(PATIENCE)? {}
            let step = self.step(Duration::ZERO, &mut |_| true)?;
            if step.complete {
                return Ok(step.stats);
            }
        }
    }

    /// Tells what mesh is wanted from now on, for [`Client::step`] to make it.
    ///
    /// # Errors
    /// If the request makes no sense for this MT; what was wanted before is then wanted still.
    pub fn aim(&mut self, request: &Request) -> Result<(), ClientError> {
        self.session.aim(request).map_err(ClientError::Session)?;
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
        let end = self.fetched.saturating_add(STEP_BYTES);
        let mut all_here = self.fetch(patience)?;
        while !all_here && self.fetched < end {
            let before = self.fetched;
            all_here = self.fetch(Duration::ZERO)?;
            if self.fetched == before {
                break;
            }
        }
        let before = self.session.block_progress();
        let stats = self.session.step(go_on).map_err(ClientError::Session)?;
        // Where the mesh has moved away from blocks there is room for others, which may have waited for it.
        let moved = self.session.block_progress() != before;
        let complete = all_here && stats.done && !moved && self.session.wanted().is_empty();
        Ok(Step { stats, complete })
    }

    /// Waits up to `patience` for more of what is wanted, and takes it in; tells whether all of it is here.
    ///
    /// # Errors
    /// If the bytes do not come or are damaged.
    pub fn fetch(&mut self, patience: Duration) -> Result<bool, ClientError> {
        if self.asked.is_empty() && !self.ask() {
            return Ok(true);
        }
        let Some((range, bytes)) = self.source.next(patience).map_err(ClientError::Stream)? else {
            return Ok(false);
        };
        self.take((range, bytes))?;
        Ok(self.asked.is_empty() && !self.ask())
    }

    /// Fetches the exact values that the file keeps, if it does and they are not here: see [`Session::exact_values`]. They take as
    /// many bytes whatever the mesh is.
    ///
    /// # Errors
    /// If the bytes do not come or are damaged.
    pub fn fetch_exact(&mut self) -> Result<(), ClientError> {
        let Some(range) = self.session.exact_range() else { return Ok(()) };
        self.source.want(&[Wanted { range: range.clone(), priority: 0.0 }]);
        let bytes = loop {
            match self.source.next(PATIENCE).map_err(ClientError::Stream)? {
                Some((arrived, bytes)) if arrived == range => break bytes,
                // Something that was wanted before.
                Some(other) => self.take(other)?,
                None => {}
            }
        };
        self.fetched += bytes.len() as u64;
        let taken = self.session.take_exact(&bytes).map_err(ClientError::Format);
        self.ask();
        taken
    }

    /// Tells the source what is wanted now; whether there is anything.
    fn ask(&mut self) -> bool {
        let wanted = self.session.wanted();
        self.asked = wanted.iter().map(|wanted| wanted.range.clone()).collect();
        let told = wanted.into_iter().map(|one| Wanted { range: one.range, priority: one.priority as f32 });
        self.source.want(&told.collect::<Vec<_>>());
        !self.asked.is_empty()
    }

    fn take(&mut self, (range, bytes): Arrived) -> Result<(), ClientError> {
        self.asked.retain(|asked| *asked != range);
        self.fetched += bytes.len() as u64;
        self.session.take(range.start, &bytes).map_err(ClientError::Format)?;
        let is_short = (bytes.len() as u64) < range.end - range.start;
        // At the end of a sound file nothing more is wanted.
        if is_short && self.session.wanted().iter().any(|wanted| wanted.range.start == range.start) {
            let offset = range.start + bytes.len() as u64;
            return Err(ClientError::Format(FormatError::Truncated { offset }));
        }
        Ok(())
    }

    /// The session: its mesh, surfaces, fields.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// The session. What is [aimed](Session::aim) at here, nobody fetches until the next request.
    pub fn session_mut(&mut self) -> &mut Session {
        &mut self.session
    }

    /// The session alone, without anything to bring more bytes.
    pub fn into_session(self) -> Session {
        self.session
    }

    /// The source.
    pub fn source(&self) -> &S {
        &self.source
    }

    /// Bytes of the file that have come, those that came again counted again.
    pub fn fetched(&self) -> u64 {
        self.fetched
    }

    /// The size of the file, once it is known.
    pub fn total(&self) -> Option<u64> {
        self.source.total()
    }
}
