//! The exact values of lossless fields, outside of memory: each update, numbered in the order of the file, brings those of its vertex.

use crate::scratch::Scratch;
use std::io;
use std::ops::Range;
use tetralod::mt::{Exact, ExactValues, VertexId};

/// Values by fields, and of each field by the vertices of the MT.
pub struct ExactInScratch<'a> {
    scratch: &'a dyn Scratch,
    /// The numbers of the fields, and whether all values so far have single precision.
    fields: Vec<(usize, bool)>,
    vertices: u32,
}

/// The name under which they are kept.
const EXACT: &str = "exact";

/// Bytes of a value.
const VALUE: u64 = size_of::<f64>() as u64;

impl<'a> ExactInScratch<'a> {
    /// Of these fields, at so many vertices.
    pub(super) fn new(scratch: &'a dyn Scratch, fields: Vec<usize>, vertices: u32) -> Self {
        Self { scratch, fields: fields.into_iter().map(|field| (field, true)).collect(), vertices }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.fields.is_empty()
    }

    /// Keeps the values of vertices from `first` on: `rows` are the values of all fields at each.
    pub(super) fn put<'r>(
        &mut self,
        first: u32,
        rows: impl Iterator<Item = &'r [f64]> + Clone,
    ) -> io::Result<()> {
        for (place, (field, is_single)) in (0..).zip(&mut self.fields) {
            let mut bytes = Vec::new();
            for row in rows.clone() {
                let value = row[*field];
                *is_single &= f64::from(value as f32).to_bits() == value.to_bits();
                bytes.extend_from_slice(&value.to_le_bytes());
            }
            let at = place * u64::from(self.vertices) + u64::from(first);
            self.scratch.write_at(EXACT, VALUE * at, &bytes)?;
        }
        Ok(())
    }

    /// Tables of at most so many vertices each, fields and vertices ascending; each has the precision that holds all values of its field.
    pub fn tables(&self, most: u32) -> impl Iterator<Item = io::Result<Exact>> + '_ {
        let firsts = move || (0..self.vertices).step_by(most.max(1) as usize);
        (0..self.fields.len()).flat_map(move |place| firsts().map(move |first| (place, first))).map(
            move |(place, first)| self.table(place, first..self.vertices.min(first.saturating_add(most))),
        )
    }

    fn table(&self, place: usize, vertices: Range<u32>) -> io::Result<Exact> {
        let (field, is_single) = self.fields[place];
        let mut bytes = vec![0; VALUE as usize * vertices.len()];
        let at = place as u64 * u64::from(self.vertices) + u64::from(vertices.start);
        self.scratch.read_at(EXACT, VALUE * at, &mut bytes)?;
        let values = bytes.as_chunks().0.iter().map(|value| f64::from_le_bytes(*value));
        let values = if is_single {
            ExactValues::F32(values.map(|value| (value as f32).to_bits()).collect())
        } else {
            ExactValues::F64(values.map(f64::to_bits).collect())
        };
        Ok(Exact { field, vertices: vertices.map(VertexId).collect(), values })
    }
}
