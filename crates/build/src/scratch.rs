//! Where steps put what they have no memory for.

use std::collections::BTreeMap;
use std::io;
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

/// Bytes that steps keep in memory unless the scratch says otherwise.
const USUALLY_KEPT: usize = 16 << 20;

/// Where steps of building in parts put what they do not keep in memory, by names of letters, digits and dashes. What has been written is
/// read by several threads at a time.
pub trait Scratch: Sync {
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

    /// Keeps bytes at a place of a name, in the place of those that were there. What is in front of them, and was never written, may be
    /// anything.
    ///
    /// # Errors
    /// If they cannot be kept.
    fn write_at(&self, name: &str, at: u64, bytes: &[u8]) -> io::Result<()>;

    /// The bytes of a name.
    ///
    /// # Errors
    /// If they cannot be read.
    fn read(&self, name: &str) -> io::Result<Vec<u8>>;

    /// Reads bytes of a name, from a place on.
    ///
    /// # Errors
    /// If they cannot be read, as if there are fewer.
    fn read_at(&self, name: &str, at: u64, bytes: &mut [u8]) -> io::Result<()>;

    /// Forgets a name.
    ///
    /// # Errors
    /// If that fails.
    fn remove(&self, name: &str) -> io::Result<()>;

    /// How many bytes a step keeps in memory before it writes any here: what is used again soon is not written then.
    fn kept_in_memory(&self) -> usize {
        USUALLY_KEPT
    }
}

/// A scratch in memory.
#[derive(Debug, Default)]
#[doc(hidden)]
pub struct InMemory {
    names: RwLock<BTreeMap<String, Vec<u8>>>,
    is_used_at_once: bool,
}

impl InMemory {
    /// One that steps use for all that they can, as if there were far more.
    pub fn at_once() -> Self {
        Self { is_used_at_once: true, ..Self::default() }
    }

    /// The names under which something is kept.
    pub fn names(&self) -> Vec<String> {
        self.of_names().keys().cloned().collect()
    }

    fn of_names(&self) -> RwLockReadGuard<'_, BTreeMap<String, Vec<u8>>> {
        self.names.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self) -> RwLockWriteGuard<'_, BTreeMap<String, Vec<u8>>> {
        self.names.write().unwrap_or_else(PoisonError::into_inner)
    }
}

fn missing() -> io::Error {
    io::ErrorKind::NotFound.into()
}

impl Scratch for InMemory {
    fn write(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.change().insert(name.to_owned(), bytes.to_vec());
        Ok(())
    }

    fn append(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.change().entry(name.to_owned()).or_default().extend_from_slice(bytes);
        Ok(())
    }

    fn write_at(&self, name: &str, at: u64, bytes: &[u8]) -> io::Result<()> {
        let mut change = self.change();
        let own = change.entry(name.to_owned()).or_default();
        let from = usize::try_from(at).map_err(|_| io::ErrorKind::FileTooLarge)?;
        own.resize(own.len().max(from + bytes.len()), 0);
        own[from..from + bytes.len()].copy_from_slice(bytes);
        Ok(())
    }

    fn read(&self, name: &str) -> io::Result<Vec<u8>> {
        self.of_names().get(name).cloned().ok_or_else(missing)
    }

    fn read_at(&self, name: &str, at: u64, bytes: &mut [u8]) -> io::Result<()> {
        let all = self.of_names();
        let from = usize::try_from(at).ok().and_then(|at| all.get(name)?.get(at..)?.get(..bytes.len()));
        bytes.copy_from_slice(from.ok_or(io::ErrorKind::UnexpectedEof)?);
        Ok(())
    }

    fn remove(&self, name: &str) -> io::Result<()> {
        self.change().remove(name).map(drop).ok_or_else(missing)
    }

    fn kept_in_memory(&self) -> usize {
        if self.is_used_at_once { 0 } else { USUALLY_KEPT }
    }
}
