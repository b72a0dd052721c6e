//! The native module of the Python package `tetralod`, which that alone imports: `python/tetralod` checks arguments and names things,
//! this has the work. No function holds the GIL while it works, and Ctrl-C ends each of them.

mod array;
mod build;
mod errors;
mod info;
mod mesh;
mod mt;
mod needs;
mod source;
mod watch;

use pyo3::prelude::*;
use std::ffi::OsString;

#[pymodule(name = "_native")]
mod native {
    #[pymodule_export]
    use super::array::Array;
    #[pymodule_export]
    use super::build::build;
    #[pymodule_export]
    use super::mesh::Mesh;
    #[pymodule_export]
    use super::mt::Mt;
    #[pymodule_export]
    use super::run;
    #[pymodule_export]
    use super::source::Ranges;
}

/// Runs the command `tetralod` and gives its exit code. `again` is what runs it in another process: a program, and its first arguments.
#[pyfunction]
fn run(py: Python<'_>, arguments: Vec<OsString>, again: Vec<OsString>) -> u8 {
    py.detach(|| tetralod_cli::run(arguments, &again))
}
