//! How much a decoder may take.

use super::FormatError;

/// Caps on what a decoder keeps in memory, whatever a file claims.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest section, in bytes: it is kept until its checksum is verified.
    pub section_bytes: u64,
    /// Largest MT in memory, in bytes, without the section in flight.
    pub memory_bytes: u64,
}

impl Default for Limits {
    /// 256 MiB a section; 16 GiB in all, 2 GiB where pointers have 32 bits (WebAssembly).
    fn default() -> Self {
        let memory_bytes = if cfg!(target_pointer_width = "32") { 2 << 30 } else { 16 << 30 };
        Self { section_bytes: 256 << 20, memory_bytes }
    }
}

/// Whether an MT that takes so many bytes fits the limits.
pub fn check_bytes(needed: u64, limits: &Limits) -> Result<(), FormatError> {
    if needed > limits.memory_bytes {
        return Err(FormatError::Limit { what: "the MT in memory", needed, limit: limits.memory_bytes });
    }
    Ok(())
}
