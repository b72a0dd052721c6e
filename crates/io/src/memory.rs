//! How much memory reading may take.

use std::borrow::Cow;
use std::ops::Deref;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use crate::error::ReadReason;

/// The most memory, in bytes, that is taken by what is read and by reading it; no limit by default. What is read with clones counts
/// together, such as the time steps of a mesh.
///
/// A few bytes of a file can stand for many: packed ones, or arrays that share their place. All that a file claims is compared
/// with the limit before it is decoded; what is small beside that is not counted.
#[derive(Clone, Debug, Default)]
pub struct MemoryLimit(Option<Arc<Counted>>);

#[derive(Debug)]
struct Counted {
    most: u64,
    taken: AtomicU64,
}

impl MemoryLimit {
    /// So many bytes at most.
    pub fn of(bytes: u64) -> Self {
        Self(Some(Arc::new(Counted { most: bytes, taken: AtomicU64::new(0) })))
    }

    /// The limit with nothing taken yet.
    pub(super) fn afresh(&self) -> Self {
        self.0.as_ref().map_or_else(Self::default, |counted| Self::of(counted.most))
    }

    /// The most bytes, whatever is taken.
    #[cfg(feature = "hdf5")]
    pub(super) fn most(&self) -> u64 {
        self.0.as_ref().map_or(u64::MAX, |counted| counted.most)
    }

    /// Counts bytes that stay with what is read.
    pub(super) fn take(&self, bytes: u64) -> Result<(), ReadReason> {
        self.expect(bytes)?;
        if let Some(counted) = &self.0 {
            counted.taken.fetch_add(bytes, Relaxed);
        }
        Ok(())
    }

    /// Checks that there is room for bytes that are given back soon.
    pub(super) fn expect(&self, bytes: u64) -> Result<(), ReadReason> {
        match &self.0 {
            Some(counted) if bytes > counted.most.saturating_sub(counted.taken.load(Relaxed)) => {
                Err(ReadReason::Memory { limit: counted.most })
            }
            _ => Ok(()),
        }
    }

    /// Counts bytes until what is returned is dropped.
    pub(super) fn hold(&self, bytes: u64) -> Result<Held, ReadReason> {
        self.take(bytes)?;
        Ok(Held { limit: self.clone(), bytes })
    }
}

/// Limits are equal if they allow the same, whatever is taken of it.
impl PartialEq for MemoryLimit {
    fn eq(&self, other: &Self) -> bool {
        let most = |limit: &Self| limit.0.as_ref().map(|counted| counted.most);
        most(self) == most(other)
    }
}

impl Eq for MemoryLimit {}

/// Bytes that count as taken as long as this lives.
#[derive(Debug, Default)]
pub(super) struct Held {
    limit: MemoryLimit,
    bytes: u64,
}

impl Held {
    /// Counts more bytes.
    pub fn grow(&mut self, bytes: u64) -> Result<(), ReadReason> {
        self.limit.take(bytes)?;
        self.bytes += bytes;
        Ok(())
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        if let Some(counted) = &self.limit.0 {
            counted.taken.fetch_sub(self.bytes, Relaxed);
        }
    }
}

/// The bytes of a file, which count as long as this lives.
#[derive(Debug)]
pub(super) struct FileBytes<'a> {
    bytes: Cow<'a, [u8]>,
    _held: Held,
}

impl<'a> FileBytes<'a> {
    pub fn new(bytes: impl Into<Cow<'a, [u8]>>, held: Held) -> Self {
        Self { bytes: bytes.into(), _held: held }
    }
}

/// Bytes that do not count.
#[cfg(test)]
impl From<Vec<u8>> for FileBytes<'static> {
    fn from(bytes: Vec<u8>) -> Self {
        Self::new(bytes, Held::default())
    }
}

impl Deref for FileBytes<'_> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_counts_until_it_is_dropped() {
        let limit = MemoryLimit::of(10);
        let refused = Err(ReadReason::Memory { limit: 10 });
        limit.take(4).unwrap();
        let mut held = limit.clone().hold(3).unwrap();
        assert_eq!((limit.expect(3), limit.expect(4)), (Ok(()), refused.clone()));
        held.grow(3).unwrap();
        assert_eq!(held.grow(1), refused);
        drop(held);
        assert_eq!((limit.take(7), limit.take(6), limit.take(1)), (refused.clone(), Ok(()), refused));
        MemoryLimit::default().take(u64::MAX).unwrap();
    }
}
