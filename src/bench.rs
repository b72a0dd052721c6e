//! How fast are decoding, refinement, coarsening and surfaces? The same measurement natively and in the browser.
//!
//! Every figure is the best of several repetitions, each on fresh state: what disturbs a run only makes it slower.
//! The clock is the caller's, so that nothing here depends on where it runs.

use crate::format::FormatError;
use crate::refine::Request;
use crate::session::Session;
use crate::session::SessionError;
use std::fmt;

/// Decoding.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DecodeRates {
    /// Updates decoded per second, the base mesh counted in.
    pub updates_per_second: f64,
}

/// Refinement from the base mesh to the reference mesh, of updates never applied before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RefineRates {
    /// Updates applied per second.
    pub updates_per_second: f64,
    /// Tetrahedra by which the mesh grows per second.
    pub tets_per_second: f64,
}

/// Coarsening from the reference mesh to the base mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CoarsenRates {
    /// Updates undone per second.
    pub updates_per_second: f64,
}

/// Isosurfaces of the reference mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IsosurfaceRates {
    /// Tetrahedra looked at per second.
    pub tets_per_second: f64,
}

/// All figures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BenchReport {
    /// Decoding.
    pub decode: DecodeRates,
    /// Refinement.
    pub refine: RefineRates,
    /// Coarsening.
    pub coarsen: CoarsenRates,
    /// Isosurfaces.
    pub isosurface: IsosurfaceRates,
}

/// Why nothing was measured.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BenchError {
    /// The bytes are not a whole MT file.
    Format(FormatError),
    /// Refinement failed.
    Session(SessionError),
}

impl fmt::Display for BenchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Format(error) => error.fmt(f),
            Self::Session(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for BenchError {}

impl From<FormatError> for BenchError {
    fn from(error: FormatError) -> Self {
        Self::Format(error)
    }
}

impl From<SessionError> for BenchError {
    fn from(error: SessionError) -> Self {
        Self::Session(error)
    }
}

/// Fewest and most repetitions, and the seconds after which no more are begun.
const REPETITIONS: std::ops::Range<u32> = 3..20;
const SECONDS: f64 = 2.0;

/// The shortest times seen, in seconds.
struct Shortest {
    decode: f64,
    refine: f64,
    coarsen: f64,
    isosurface: f64,
}

/// Measures with the bytes of an MT file. `clock` tells seconds from any start.
///
/// # Errors
/// If the file is not whole or the MT is damaged.
pub fn run(bytes: &[u8], clock: &mut dyn FnMut() -> f64) -> Result<BenchReport, BenchError> {
    let infinite = f64::INFINITY;
    let mut shortest =
        Shortest { decode: infinite, refine: infinite, coarsen: infinite, isosurface: infinite };
    let start = clock();
    let mut counts = Counts::default();
    for repetition in 0..REPETITIONS.end {
        if repetition >= REPETITIONS.start && clock() - start > SECONDS {
            break;
        }
        counts = measure(bytes, clock, &mut shortest)?;
    }
    Ok(report(&counts, &shortest))
}

/// How much was done in one repetition.
#[derive(Default)]
struct Counts {
    updates: u64,
    /// Tetrahedra of the base and of the reference mesh.
    tets: [u64; 2],
}

fn measure(
    bytes: &[u8],
    clock: &mut dyn FnMut() -> f64,
    shortest: &mut Shortest,
) -> Result<Counts, BenchError> {
    let (session, seconds) = timed(clock, || {
        let mut session = Session::new();
        session.feed(bytes)?;
        session.finish()?;
        Ok::<_, BenchError>(session)
    });
    let mut session = session?;
    shortest.decode = shortest.decode.min(seconds);
    let middle = session.info().map(|info| 0.5 * (info.fields[0].min + info.fields[0].max));
    let base_tets = session.view().tets.len() as u64;
    let (fine, seconds) = timed(clock, || session.refine(&Request::default()));
    let fine = fine?;
    shortest.refine = shortest.refine.min(seconds);
    // Bringing the arrays of the view up to date is not part of any figure.
    session.view();
    let (surface, seconds) = timed(clock, || session.isosurface(middle.unwrap_or(0.0)).map(drop));
    surface?;
    shortest.isosurface = shortest.isosurface.min(seconds);
    let coarsest = Request { error: f64::INFINITY, ..Request::default() };
    let (coarse, seconds) = timed(clock, || session.refine(&coarsest));
    coarse?;
    shortest.coarsen = shortest.coarsen.min(seconds);
    Ok(Counts { updates: fine.refined, tets: [base_tets, u64::from(fine.tetrahedra)] })
}

fn timed<T>(clock: &mut dyn FnMut() -> f64, work: impl FnOnce() -> T) -> (T, f64) {
    let start = clock();
    let done = work();
    (done, clock() - start)
}

fn report(counts: &Counts, shortest: &Shortest) -> BenchReport {
    // What was too short for the clock is counted as its resolution would be, so that rates stay finite.
    let rate = |count: u64, seconds: f64| count as f64 / seconds.max(1e-6);
    let Counts { updates, tets: [base, reference] } = *counts;
    BenchReport {
        decode: DecodeRates { updates_per_second: rate(updates, shortest.decode) },
        refine: RefineRates {
            updates_per_second: rate(updates, shortest.refine),
            tets_per_second: rate(reference.saturating_sub(base), shortest.refine),
        },
        coarsen: CoarsenRates { updates_per_second: rate(updates, shortest.coarsen) },
        isosurface: IsosurfaceRates { tets_per_second: rate(reference, shortest.isosurface) },
    }
}
