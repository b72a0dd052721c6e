//! Where steps put what they have no memory for.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;

/// Where [`Piecewise`](super::Piecewise) and [`assemble_blocks`](super::assemble_blocks) put what they do not keep in memory, by names of letters, digits and dashes.
pub trait Scratch {
    /// Keeps bytes under a name, in the place of those that were there.
    ///
    /// # Errors
    /// If they cannot be kept.
    fn write(&self, name: &str, bytes: &[u8]) -> io::Result<()>;

    /// Keeps bytes behind those of a name, if there are any.
    ///
    /// # Errors
    /// If they cannot be kept.
    fn append(&self, name: &str, bytes: &[u8]) -> io::Result<()>;

    /// The bytes of a name.
    ///
    /// # Errors
    /// If they cannot be read.
    fn read(&self, name: &str) -> io::Result<Vec<u8>>;

    /// So many bytes of a name, from a place on.
    ///
    /// # Errors
    /// If they cannot be read, as if there are fewer.
    fn read_at(&self, name: &str, at: u64, len: usize) -> io::Result<Vec<u8>>;

    /// Forgets a name.
    ///
    /// # Errors
    /// If that fails.
    fn remove(&self, name: &str) -> io::Result<()>;
}

/// A scratch in memory.
#[derive(Debug, Default)]
#[doc(hidden)]
pub struct InMemory(RefCell<BTreeMap<String, Vec<u8>>>);

impl InMemory {
    /// The names under which something is kept.
    pub fn names(&self) -> Vec<String> {
        self.0.borrow().keys().cloned().collect()
    }
}

fn missing() -> io::Error {
    io::ErrorKind::NotFound.into()
}

impl Scratch for InMemory {
    fn write(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.0.borrow_mut().insert(name.to_owned(), bytes.to_vec());
        Ok(())
    }

    fn append(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.0.borrow_mut().entry(name.to_owned()).or_default().extend_from_slice(bytes);
        Ok(())
    }

    fn read(&self, name: &str) -> io::Result<Vec<u8>> {
        self.0.borrow().get(name).cloned().ok_or_else(missing)
    }

    fn read_at(&self, name: &str, at: u64, len: usize) -> io::Result<Vec<u8>> {
        let all = self.0.borrow();
        let from = usize::try_from(at).ok().and_then(|at| all.get(name)?.get(at..)?.get(..len));
        from.map(<[u8]>::to_vec).ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
    }

    fn remove(&self, name: &str) -> io::Result<()> {
        self.0.borrow_mut().remove(name).map(drop).ok_or_else(missing)
    }
}
