//! Where the bytes of MT files come from: disks, servers, memory of Python.

use crate::errors::{Failure, stream};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;
use std::fs::File;
use std::io::Cursor;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tetralod::stream::{
    Arrived, CacheFolder, FileSource, HttpOptions, HttpSource, RangeSource, ShardedFile, StreamError,
    Traffic, WantedRange,
};

/// How long is waited at a time before Python is asked whether to go on.
const SHORT: Duration = Duration::from_millis(50);

/// How long is waited for a range at a time.
const PATIENCE: Duration = Duration::from_millis(200);

/// The error of Python's that has ended a wait.
pub type Interrupt = Arc<Mutex<Option<PyErr>>>;

/// What an MT file may be given as.
#[derive(FromPyObject)]
pub enum Given {
    Bytes(PyBackedBytes),
    Path(PathBuf),
}

/// Ranges of an MT file, for who reads the file by itself.
#[pyclass(frozen)]
pub struct Ranges {
    source: Mutex<Source>,
    interrupt: Interrupt,
    name: String,
}

#[pymethods]
impl Ranges {
    #[new]
    fn open(py: Python<'_>, given: Given, name: String, network: Network) -> PyResult<Self> {
        py.detach(|| {
            let interrupt = Interrupt::default();
            let source = Source::of(given, network, &interrupt).map_err(|error| error.of(&name))?;
            Ok(Self { source: Mutex::new(source), interrupt, name })
        })
    }

    /// The bytes from `start` to just before `end`, fewer where the file ends.
    fn read<'py>(&self, py: Python<'py>, start: u64, end: u64) -> PyResult<Bound<'py, PyBytes>> {
        let range = start..end;
        if range.is_empty() {
            return Ok(PyBytes::new(py, &[]));
        }
        let read = || {
            let mut source = self.source.lock().unwrap_or_else(PoisonError::into_inner);
            source.want(&[WantedRange { range: range.clone(), priority: 0.0 }]);
            loop {
                // What was asked for before an error may come, too.
                if let Some((arrived, bytes)) = source.next(PATIENCE)?
                    && arrived == range
                {
                    return Ok(bytes);
                }
            }
        };
        let bytes = py.detach(read).map_err(|error: StreamError| {
            interrupted(&self.interrupt).unwrap_or_else(|| stream(&error).of(&self.name).into())
        })?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// The size of the file, once anything of it has been read.
    fn size(&self) -> Option<u64> {
        self.source.lock().unwrap_or_else(PoisonError::into_inner).total()
    }
}

/// How a server is asked.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Network {
    headers: Vec<(String, String)>,
    cache: Option<PathBuf>,
    cache_bytes: u64,
}

/// Bytes of an MT file; waits for them end at Ctrl-C.
pub struct Source {
    inner: Box<dyn RangeSource + Send>,
    interrupt: Interrupt,
}

impl Source {
    /// Of a path, an address that begins with `http://` or `https://`, or bytes.
    pub fn of(given: Given, network: Network, interrupt: &Interrupt) -> Result<Self, Failure> {
        let unreadable = |error: std::io::Error| Failure::new("bad-source", error.to_string());
        let inner: Box<dyn RangeSource + Send> = match given {
            Given::Bytes(bytes) => Box::new(FileSource::new(Cursor::new(bytes))?),
            Given::Path(path) => match url(&path) {
                Some(url) => Box::new(HttpSource::new(url, network.options())),
                None => {
                    let first = File::open(&path).map_err(unreadable)?;
                    let open = move |suffix: &str| {
                        let mut name = path.clone().into_os_string();
                        name.push(suffix);
                        File::open(name)
                    };
                    Box::new(FileSource::new(ShardedFile::new(first, open).map_err(unreadable)?)?)
                }
            },
        };
        Ok(Self { inner, interrupt: Arc::clone(interrupt) })
    }
}

impl Network {
    fn options(self) -> HttpOptions {
        let Self { headers, cache, cache_bytes } = self;
        let cache = cache.map(|path| CacheFolder { path, max_bytes: cache_bytes });
        HttpOptions { headers, cache, ..HttpOptions::default() }
    }
}

/// The address, if a path is one.
fn url(path: &std::path::Path) -> Option<&str> {
    path.to_str().filter(|text| ["http://", "https://"].iter().any(|scheme| text.starts_with(scheme)))
}

/// The error of Python's, if there is one; it is told once.
pub fn interrupted(interrupt: &Interrupt) -> Option<PyErr> {
    interrupt.lock().unwrap_or_else(PoisonError::into_inner).take()
}

impl RangeSource for Source {
    fn want(&mut self, wanted: &[WantedRange]) {
        self.inner.want(wanted);
    }

    fn next(&mut self, patience: Duration) -> Result<Option<Arrived>, StreamError> {
        let mut left = patience;
        loop {
            let found = self.inner.next(left.min(SHORT))?;
            left = left.saturating_sub(SHORT);
            if found.is_some() || left.is_zero() {
                return Ok(found);
            }
            if let Err(error) = Python::attach(|py| py.check_signals()) {
                self.interrupt.lock().unwrap_or_else(PoisonError::into_inner).replace(error);
                return Err(StreamError::Unreadable("interrupted".to_owned()));
            }
        }
    }

    fn total(&self) -> Option<u64> {
        self.inner.total()
    }

    fn traffic(&self) -> Option<Traffic> {
        self.inner.traffic()
    }
}
