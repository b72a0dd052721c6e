//! An MT file that is open, and the meshes that are taken out of it.

use crate::errors::{Failure, client};
use crate::info;
use crate::mesh::Mesh;
use crate::needs::{Limits, NeedOptions, region_numbers, request};
use crate::source::{Given, Interrupt, Network, Source, interrupted};
use crate::watch::Watch;
use pyo3::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::{self, ThreadId};
use std::time::Duration;
use tetralod::format::DecodeOptions;
use tetralod::refine::{RefineStats, Request};
use tetralod::session::{Client, ClientError};

/// How long is waited for bytes at a time.
const PATIENCE: Duration = Duration::from_millis(200);

/// Updates between two looks at the clock: one takes about a microsecond.
const UPDATES_A_LOOK: u64 = 64;

/// An MT file that is open.
#[pyclass(frozen)]
pub struct Mt {
    client: Mutex<Client<Source>>,
    /// Which thread has the lock of the client.
    owner: Mutex<Option<ThreadId>>,
    interrupt: Interrupt,
    name: String,
}

#[pymethods]
impl Mt {
    /// Opens a file: reads what is in front of its updates.
    #[new]
    fn open(
        py: Python<'_>,
        given: Given,
        name: String,
        fields: Vec<String>,
        memory: Option<u64>,
        network: Network,
    ) -> PyResult<Self> {
        py.detach(|| {
            let interrupt = Interrupt::default();
            let source = Source::of(given, network, &interrupt).map_err(|error| error.of(&name))?;
            let options = DecodeOptions { fields, ..DecodeOptions::default() };
            match Client::open(source, options, memory.unwrap_or(u64::MAX)) {
                Ok(client) => {
                    Ok(Self { client: Mutex::new(client), owner: Mutex::default(), interrupt, name })
                }
                Err(error) => Err(failed(&error, &interrupt, &name)),
            }
        })
    }

    /// What is in the file, as JSON.
    fn info(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| info::info(&self.lock()?.client).ok_or_else(not_ready))
    }

    /// The mesh that a request needs, with the fields of each group as one array, in regions of these names alone; and what was done, as
    /// JSON. The error of `field` is told.
    #[expect(clippy::too_many_arguments, reason = "Python has names for them")]
    fn refine(
        &self,
        py: Python<'_>,
        needs: Vec<NeedOptions>,
        limits: Limits,
        field: usize,
        groups: Vec<Vec<usize>>,
        shown: Option<Vec<String>>,
        exact: bool,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(Mesh, String)> {
        let mut watch = Watch::new(progress);
        py.detach(|| {
            let mut held = self.lock()?;
            let open = &mut *held.client;
            let failed = |error: &ClientError| failed(error, &self.interrupt, &self.name);
            let mt = open.session().mt().ok_or_else(not_ready)?;
            let request = request(needs, limits, mt)?;
            let shown = shown.map(|names| region_numbers(mt, &names)).transpose()?;
            let stats = refined(open, &request, &mut watch).map_err(|error| failed(&error))?;
            watch.check()?;
            if exact {
                open.fetch_exact().map_err(|error| failed(&error))?;
            }
            let mesh = Mesh::of(open.session(), groups, shown.as_deref(), exact).ok_or_else(not_ready)?;
            Ok((mesh, info::stats(open, &stats, field).ok_or_else(not_ready)?))
        })
    }
}

/// The client, for one thread alone.
struct Held<'a> {
    client: MutexGuard<'a, Client<Source>>,
    owner: &'a Mutex<Option<ThreadId>>,
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        *self.owner.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

impl Mt {
    /// Waits for other threads; what is told of the progress runs in the one that has the lock, and would wait for itself.
    fn lock(&self) -> Result<Held<'_>, Failure> {
        let owner = || self.owner.lock().unwrap_or_else(PoisonError::into_inner);
        let this = Some(thread::current().id());
        if *owner() == this {
            let problem = "a function that is told the progress cannot ask the same file for another mesh";
            return Err(Failure::new("bad-option", problem));
        }
        // The mesh is valid after every update, whatever ended the work.
        let client = self.client.lock().unwrap_or_else(PoisonError::into_inner);
        *owner() = this;
        Ok(Held { client, owner: &self.owner })
    }
}

fn not_ready() -> PyErr {
    Failure::new("not-ready", "the base mesh is not there").into()
}

/// The error of Python's that ended a wait, or what was wrong with the file or the request.
fn failed(error: &ClientError, interrupt: &Interrupt, name: &str) -> PyErr {
    interrupted(interrupt).unwrap_or_else(|| {
        let failure = client(error);
        if failure.code == "bad-option" { failure.into() } else { failure.of(name).into() }
    })
}

/// Makes the mesh of a request, with all data for it; or a coarser one where `watch` has an error.
fn refined(
    client: &mut Client<Source>,
    request: &Request,
    watch: &mut Watch,
) -> Result<RefineStats, ClientError> {
    client.request(request)?;
    while !client.fetch(PATIENCE)? {
        if !tell(client, watch) {
            return Ok(RefineStats::default());
        }
    }
    let mut before = RefineStats::default();
    loop {
        let mut updates: u64 = 0;
        let mut stats = client.step(PATIENCE, &mut |done| {
            updates += 1;
            let changed = done.refined + done.coarsened;
            !updates.is_multiple_of(UPDATES_A_LOOK) || watch.goes_on("refine", changed, 0)
        })?;
        stats.add_work(&before);
        if client.is_complete(&stats) || !tell(client, watch) {
            return Ok(stats);
        }
        before = stats;
    }
}

/// Tells how much of what is needed is here; whether the work may go on.
fn tell(client: &Client<Source>, watch: &mut Watch) -> bool {
    let blocks = client.session().block_progress();
    if blocks.blocks > 0 {
        return watch.goes_on("fetch", u64::from(blocks.here.min(blocks.needed)), u64::from(blocks.needed));
    }
    watch.goes_on("fetch", client.session().arrived(), client.total().unwrap_or(0))
}
