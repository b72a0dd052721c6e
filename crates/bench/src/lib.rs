//! A benchmark of [`tetralod`]: how fast this machine decodes, refines, coarsens and cuts an MT, on one thread. The clock comes from outside,
//! so that the same code runs natively and in a browser.

/// The code of README.md, as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod clock;
mod coherent;

pub use coherent::{Coherent, Walks};

use clock::timed;
use tetralod::format::{Decoder, FormatError};
use tetralod::mt::{Mt, MultiTessellation};
use tetralod::refine::Request;
use tetralod::session::{Session, SessionError};

/// What a benchmark found. Rates are those of the fastest of several runs: the others show what else the
/// machine was doing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BenchReport {
    /// Updates that were decoded.
    pub updates: u32,
    /// Updates that were applied and undone: all but those without any error.
    pub applied: u32,
    /// Tetrahedra of the finest mesh.
    pub tetrahedra: u32,
    /// Runs that were timed.
    pub runs: u32,
    /// Updates decoded per second, from bytes in memory.
    pub decode_updates: f64,
    /// Updates applied per second, from the base mesh to the finest mesh, in a mesh that never had them.
    pub refine_updates: f64,
    /// Tetrahedra of the finest mesh per second, on the same way.
    pub refine_tets: f64,
    /// Updates undone per second, from the finest mesh to the base mesh.
    pub coarsen_updates: f64,
    /// Tetrahedra of the finest mesh searched per second for an isosurface in the middle of the field's range.
    pub isosurface_tets: f64,
    /// Requests that change a little from frame to frame; medians, not the fastest.
    pub coherent: Walks,
}

/// Times the MT file `bytes`. `clock` gives seconds since any fixed moment; at least three runs are made, and more
/// until `seconds` have passed.
///
/// # Errors
/// If the file is not a whole and sound MT file.
pub fn run(bytes: &[u8], clock: &mut dyn FnMut() -> f64, seconds: f64) -> Result<BenchReport, SessionError> {
    let mut best = Times::default();
    let mut report = BenchReport::default();
    let end = clock() + seconds;
    while report.runs < MIN_RUNS || clock() < end {
        let times = once(bytes, clock, &mut report)?;
        best = if report.runs == 0 { times } else { best.least(times) };
        report.runs += 1;
    }
    let mut session = Session::new();
    session.feed(bytes)?;
    report.coherent = coherent::walks(&mut session, clock)?;
    let rate = |count: u32, time: f64| f64::from(count) / time.max(SHORTEST);
    report.decode_updates = rate(report.updates, best.decode);
    report.refine_updates = rate(report.applied, best.refine);
    report.refine_tets = rate(report.tetrahedra, best.refine);
    report.coarsen_updates = rate(report.applied, best.coarsen);
    report.isosurface_tets = rate(report.tetrahedra, best.isosurface);
    Ok(report)
}

/// Fewest runs: the first one warms caches.
const MIN_RUNS: u32 = 3;

/// Clocks of browsers tick in steps; nothing is taken to be faster than that.
const SHORTEST: f64 = 1e-6;

/// Seconds that each part took.
#[derive(Clone, Copy, Debug, Default)]
struct Times {
    decode: f64,
    refine: f64,
    coarsen: f64,
    isosurface: f64,
}

impl Times {
    fn least(self, other: Self) -> Self {
        Self {
            decode: self.decode.min(other.decode),
            refine: self.refine.min(other.refine),
            coarsen: self.coarsen.min(other.coarsen),
            isosurface: self.isosurface.min(other.isosurface),
        }
    }
}

/// One run: its times; the counts go into `report`.
fn once(
    bytes: &[u8],
    clock: &mut dyn FnMut() -> f64,
    report: &mut BenchReport,
) -> Result<Times, SessionError> {
    let mut times = Times::default();
    let decoded = timed(clock, &mut times.decode, || decode(bytes))?;
    report.updates = decoded.map_or(0, |mt| mt.updates());
    let mut session = Session::new();
    session.feed(bytes)?;
    let middle = session.info().map_or(0.0, |info| 0.5 * (info.fields[0].min + info.fields[0].max));
    let finest = timed(clock, &mut times.refine, || session.refine(&Request::within(0.0)))?;
    // The view follows the mesh at its own cost, which is not that of the surface.
    session.view();
    timed(clock, &mut times.isosurface, || session.isosurface(middle).map(drop))?;
    let coarsest = Request::within(f64::INFINITY);
    timed(clock, &mut times.coarsen, || session.refine(&coarsest))?;
    (report.applied, report.tetrahedra) = (finest.applied, finest.tetrahedra);
    Ok(times)
}

fn decode(bytes: &[u8]) -> Result<Option<Mt>, FormatError> {
    let mut decoder = Decoder::default();
    decoder.feed(bytes)?;
    decoder.finish()?;
    Ok(decoder.into_mt())
}
