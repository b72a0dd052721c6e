//! Arrays that NumPy looks into without copying them.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::any::Any;
use std::sync::Arc;

/// A number that arrays are made of.
pub trait Number: Send + Sync + 'static {
    /// Its type and size in NumPy's words.
    const KIND: &str;
}

impl Number for f64 {
    const KIND: &str = "f8";
}

impl Number for f32 {
    const KIND: &str = "f4";
}

impl Number for u32 {
    const KIND: &str = "u4";
}

impl Number for i64 {
    const KIND: &str = "i8";
}

/// Numbers in memory of Rust, which `numpy.asarray` shows as an array that keeps them alive.
#[pyclass(frozen)]
pub struct Array {
    /// What must live as long as somebody looks at it.
    _memory: Arc<dyn Any + Send + Sync>,
    address: usize,
    shape: Vec<usize>,
    kind: &'static str,
    is_shared: bool,
}

impl Array {
    /// Rows of so many columns, which nobody else has: they may be written.
    pub fn rows<T: Number, const N: usize>(rows: Vec<[T; N]>) -> Self {
        let shape = vec![rows.len(), N];
        Self::own(rows.into_flattened(), shape)
    }

    /// Numbers in one row.
    pub fn list<T: Number>(numbers: Vec<T>) -> Self {
        let shape = vec![numbers.len()];
        Self::own(numbers, shape)
    }

    /// So many components: a row for each, with a number for each point.
    pub fn components(values: Vec<f64>, count: usize) -> Self {
        let shape = vec![count, values.len() / count.max(1)];
        Self::own(values, shape)
    }

    fn own<T: Number>(mut numbers: Vec<T>, shape: Vec<usize>) -> Self {
        let address = numbers.as_mut_ptr().addr();
        Self { address, shape, kind: T::KIND, is_shared: false, _memory: Arc::new(numbers) }
    }

    /// Rows that are read here, too: they may not be written.
    pub fn shared_rows<T: Number, const N: usize>(rows: &Arc<Vec<[T; N]>>) -> Self {
        let (address, shape) = (rows.as_ptr().addr(), vec![rows.len(), N]);
        Self { address, shape, kind: T::KIND, is_shared: true, _memory: Arc::clone(rows) as _ }
    }

    /// [`Array::components`] that are read here, too.
    pub fn shared_components(values: &Arc<Vec<f64>>, count: usize) -> Self {
        let shape = vec![count, values.len() / count.max(1)];
        let address = values.as_ptr().addr();
        Self { address, shape, kind: f64::KIND, is_shared: true, _memory: Arc::clone(values) as _ }
    }
}

#[pymethods]
impl Array {
    /// What NumPy asks for, version 3.
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let order = if cfg!(target_endian = "big") { '>' } else { '<' };
        let described = PyDict::new(py);
        described.set_item("version", 3)?;
        described.set_item("shape", PyTuple::new(py, &self.shape)?)?;
        described.set_item("typestr", format!("{order}{}", self.kind))?;
        described.set_item("data", (self.address, self.is_shared))?;
        Ok(described)
    }
}
