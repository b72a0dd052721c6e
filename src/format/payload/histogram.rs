//! `hist`: for each field, which share of the volume of the reference mesh has values in each of equal bins.

use crate::format::read::Reader;
use crate::format::{FormatError, write};
use crate::mt::VOLUME_BINS;

/// The most bins that are read.
const MAX_BINS: u32 = 1 << 10;
/// What a share of 1 is stored as.
const WHOLE: f64 = (1_u32 << 20) as f64;

/// The shares of each bin of each field of a file, as they are stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Histograms {
    bins: usize,
    /// Field by field.
    shares: Vec<u32>,
}

impl Histograms {
    /// Those of the volumes of each field in [`VOLUME_BINS`] bins.
    pub fn of(volumes: &[f64]) -> Self {
        let of_field = |volumes: &[f64]| {
            let whole: f64 = volumes.iter().sum();
            let stored = |volume: &f64| match volume / whole * WHOLE {
                share if share > 0.0 => share.round().max(1.0) as u32,
                _ => 0,
            };
            volumes.iter().map(stored).collect::<Vec<u32>>()
        };
        Self { bins: VOLUME_BINS, shares: volumes.chunks(VOLUME_BINS).flat_map(of_field).collect() }
    }

    pub fn write(&self, out: &mut Vec<u8>) {
        write::varint(out, self.bins as u64);
        self.shares.iter().for_each(|&share| write::varint(out, u64::from(share)));
    }

    /// Reads those of so many fields.
    pub fn read(mut reader: Reader<'_>, fields: usize) -> Result<Self, FormatError> {
        let bins = reader.varint()?;
        if !(1..=MAX_BINS).contains(&bins) {
            return Err(reader.corrupt("a histogram must have 1 to 1024 bins"));
        }
        let mut shares = Vec::new();
        for _ in 0..fields * bins as usize {
            shares.push(reader.varint()?);
        }
        reader.end()?;
        Ok(Self { bins: bins as usize, shares })
    }

    /// The shares of a field, whose sum is 1, or which are all 0.
    pub fn shares(&self, field: usize) -> Option<Vec<f64>> {
        let stored = self.shares.chunks(self.bins).nth(field)?;
        let sum: u64 = stored.iter().copied().map(u64::from).sum();
        Some(stored.iter().map(|&share| f64::from(share) / (sum as f64).max(1.0)).collect())
    }
}
