//! What watches work from Python: Ctrl-C, and a function that is told how far it is.

use pyo3::prelude::*;
use std::time::{Duration, Instant};

/// How often Python is asked: a person does not notice the delay, nor the work the asking.
const OFTEN: Duration = Duration::from_millis(50);

/// Asks Python now and then whether to go on. The first error of Python's, an interrupt or one of the function's, ends the work.
pub struct Watch {
    progress: Option<Py<PyAny>>,
    last: Instant,
    stage: &'static str,
    error: Option<PyErr>,
}

impl Watch {
    /// `progress` gets the stage of the work, how much of it is done, and the whole.
    pub fn new(progress: Option<Py<PyAny>>) -> Self {
        Self { progress, last: Instant::now(), stage: "", error: None }
    }

    /// Whether the work may go on.
    pub fn goes_on(&mut self, stage: &'static str, done: u64, total: u64) -> bool {
        let is_new = stage != self.stage;
        if self.error.is_none() && (is_new || self.last.elapsed() >= OFTEN) {
            self.stage = stage;
            self.error = Python::attach(|py| self.ask(py, done, total)).err();
            self.last = Instant::now();
        }
        self.error.is_none()
    }

    /// The same before some work, or an error that ends it.
    pub fn begin(&mut self, stage: &'static str) -> PyResult<()> {
        self.goes_on(stage, 0, 1);
        self.check()
    }

    /// The error that has ended the work.
    pub fn check(&mut self) -> PyResult<()> {
        self.error.take().map_or(Ok(()), Err)
    }

    fn ask(&self, py: Python<'_>, done: u64, total: u64) -> PyResult<()> {
        py.check_signals()?;
        if let Some(progress) = &self.progress {
            progress.call1(py, (self.stage, done, total))?;
        }
        Ok(())
    }
}
