//! A network in virtual time: a server that gives ranges after a while, each connection at its own speed. Nothing waits, so what a file
//! costs comes out the same on every machine.

use std::ops::Range;
use std::sync::Arc;
use tetralod::refine::{Criterion, RefineStats, Request};
use tetralod::session::{Session, SessionError};
use tetralod::stream::{Action, Loader, LoaderOptions, ResponseHead, Traffic};

/// A link to a server.
#[derive(Clone, Copy, Debug)]
pub struct Network {
    /// From asking to the first byte, in milliseconds.
    pub latency_ms: f64,
    /// What a connection brings in a millisecond.
    pub bytes_per_ms: f64,
    /// What connections there are.
    pub protocol: Protocol,
}

/// How requests come by a connection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Protocol {
    /// HTTP/1.1: each request has one of its own.
    Http1,
    /// HTTP/2: all requests are streams of one, which brings of each what is due in turn.
    Http2,
}

/// Requests at a time by HTTP/2, as soon as an answer shows that it is that: as in pages.
const STREAMS: usize = 24;

/// What bytes come at a time: a frame of HTTP/2.
const CHUNK: u64 = 16 << 10;

/// What a request has cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Times at which something was asked for while nothing was on its way.
    pub rounds: u32,
    pub requests: u64,
    /// Bytes that came, and those of them that had come before.
    pub bytes: u64,
    pub repeated: u64,
    pub seconds: f64,
}

/// An answer under way.
struct Answer {
    id: u32,
    rest: Range<u64>,
    is_headed: bool,
    /// When the head or the next bytes are here.
    due: f64,
}

/// A page or program with a session on a file that is elsewhere.
pub struct Visitor<'a> {
    pub session: Session,
    /// Of the last request.
    pub stats: RefineStats,
    loader: Loader,
    network: Network,
    file: &'a [u8],
    answers: Vec<Answer>,
    now: f64,
    /// When the connection that all requests have in common has brought what it has begun.
    free_from: f64,
    rounds: u32,
}

impl<'a> Visitor<'a> {
    pub fn new(file: &'a [u8], network: Network, options: LoaderOptions) -> Self {
        let session = Session::in_parts(Default::default(), u64::MAX);
        let loader = Loader::new(options);
        Self {
            session,
            stats: RefineStats::default(),
            loader,
            network,
            file,
            answers: Vec::new(),
            now: 0.0,
            free_from: 0.0,
            rounds: 0,
        }
    }

    /// Fetches what the session wants until nothing is on its way.
    fn fetch(&mut self) {
        loop {
            self.session.supply(&mut self.loader).expect("a sound file");
            self.ask();
            let Some(next) =
                (0..self.answers.len()).min_by(|&a, &b| self.answers[a].due.total_cmp(&self.answers[b].due))
            else {
                return;
            };
            self.receive(next);
        }
    }

    /// Does what the loader says until it has to wait.
    fn ask(&mut self) {
        let was_idle = self.answers.is_empty();
        while let Some(action) = self.loader.next(self.now as u64) {
            match action {
                Action::Fetch { id, range, .. } => {
                    let end = range.end.min(self.file.len() as u64);
                    let due = self.now + self.network.latency_ms;
                    self.answers.push(Answer { id, rest: range.start..end, is_headed: false, due });
                }
                Action::Cancel { id } => self.answers.retain(|answer| answer.id != id),
                Action::Read { .. } => panic!("there is no cache"),
                Action::Wait { .. } => break,
            }
        }
        assert!(self.loader.error().is_none(), "{:?}", self.loader.error());
        self.rounds += u32::from(was_idle && !self.answers.is_empty());
    }

    /// Takes what comes next.
    fn receive(&mut self, next: usize) {
        let answer = &mut self.answers[next];
        self.now = self.now.max(answer.due);
        let (now, id, part) = (self.now as u64, answer.id, answer.rest.clone());
        let chunk = if answer.is_headed {
            part.start..part.end.min(part.start + CHUNK)
        } else {
            part.start..part.start
        };
        answer.rest.start = chunk.end;
        let was_headed = std::mem::replace(&mut answer.is_headed, true);
        if answer.rest.is_empty() {
            self.answers.swap_remove(next);
        } else {
            let shares = self.network.protocol == Protocol::Http2;
            let begins = if shares { self.now.max(self.free_from) } else { self.now };
            let bytes = (part.end - chunk.end).min(CHUNK);
            answer.due = begins + bytes as f64 / self.network.bytes_per_ms;
            self.free_from = answer.due;
        }
        if was_headed {
            self.loader.data(id, now, &self.file[chunk.start as usize..chunk.end as usize]);
            return;
        }
        let content_range = format!("bytes {}-{}/{}", part.start, part.end - 1, self.file.len());
        let content_length = Some(part.end - part.start);
        let content_range = Some(&content_range[..]);
        let head = ResponseHead { status: 206, content_range, content_length, ..ResponseHead::default() };
        self.loader.head(id, now, &head);
        if self.network.protocol == Protocol::Http2 {
            self.loader.set_max_requests(STREAMS);
        }
    }

    fn so_far(&self) -> Cost {
        let Traffic { requests, received, repeated, .. } = self.loader.traffic();
        Cost { rounds: self.rounds, requests, bytes: received, repeated, seconds: self.now / 1000.0 }
    }

    /// Fetches what stands in front of the blocks.
    pub fn open(&mut self) -> Cost {
        self.fetch();
        self.so_far()
    }

    /// Fetches what a request needs and makes its mesh; what that costs more.
    pub fn refine(&mut self, request: &Request) -> Result<Cost, SessionError> {
        self.refine_with(request, &[])
    }

    /// The same with criteria of the caller's own.
    pub fn refine_with(
        &mut self,
        request: &Request,
        custom: &[Arc<dyn Criterion>],
    ) -> Result<Cost, SessionError> {
        let before = self.so_far();
        self.session.request_with(request, custom)?;
        loop {
            self.fetch();
            self.stats = self.session.step(&mut |_| true)?;
            if self.stats.done && !self.session.is_waiting() {
                break;
            }
        }
        let after = self.so_far();
        Ok(Cost {
            rounds: after.rounds - before.rounds,
            requests: after.requests - before.requests,
            bytes: after.bytes - before.bytes,
            repeated: after.repeated - before.repeated,
            seconds: after.seconds - before.seconds,
        })
    }
}
