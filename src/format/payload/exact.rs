//! `fldx`: the exact values of a field at the vertices of the reference mesh, as what is wrong with their levels.

use super::families::{EXACT_GAP, EXACT_LENGTH};
use crate::format::FormatError;
use crate::format::coder::{Put, Source};
use crate::mt::{Exact, ExactValues, VertexId};

/// The exact values of one field, to be had from the levels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Corrections {
    /// Whether values have single precision.
    is_single: bool,
    /// Ascending.
    vertices: Vec<u32>,
    /// How many numbers of that precision further up the value lies.
    steps: Vec<i64>,
}

impl Corrections {
    /// The exact value at a vertex, given that of its level; none if it is not one of the reference mesh.
    pub fn value(&self, vertex: VertexId, of_level: f64) -> Option<f64> {
        let place = self.vertices.binary_search(&vertex.0).ok()?;
        Some(moved(of_level, self.steps[place], self.is_single))
    }

    /// The corrections that make exact values of those of levels. None if a vertex has no level.
    pub(crate) fn new(exact: &Exact, of_level: impl Fn(VertexId) -> Option<f64>) -> Option<Self> {
        let is_single = matches!(exact.values, ExactValues::F32(_));
        let mut steps = Vec::new();
        for (place, &vertex) in exact.vertices.iter().enumerate() {
            let about = of_level(vertex)?;
            steps.push(match &exact.values {
                ExactValues::F32(bits) => {
                    i64::from(place_of_single(*bits.get(place)?))
                        - i64::from(place_of_single((about as f32).to_bits()))
                }
                ExactValues::F64(bits) => {
                    place_of_double(*bits.get(place)?).wrapping_sub(place_of_double(about.to_bits())) as i64
                }
            });
        }
        Some(Self { is_single, vertices: exact.vertices.iter().map(|v| v.0).collect(), steps })
    }

    /// Whether values have single precision.
    pub fn is_single(&self) -> bool {
        self.is_single
    }

    /// How many vertices have values.
    pub fn count(&self) -> u32 {
        self.vertices.len() as u32
    }

    /// Those of each section.
    pub(crate) fn in_sections(&self) -> impl Iterator<Item = Self> {
        let most = Exact::IN_A_SECTION as usize;
        self.vertices.chunks(most).zip(self.steps.chunks(most)).map(|(vertices, steps)| Self {
            is_single: self.is_single,
            vertices: vertices.to_vec(),
            steps: steps.to_vec(),
        })
    }

    /// Takes in those of the next section, of vertices behind these. Whether it is one of the same values.
    pub(crate) fn extend(&mut self, next: Self) -> bool {
        let is_behind = next.vertices.first().is_none_or(|first| self.vertices.last() < Some(first));
        let goes_on = is_behind && next.is_single == self.is_single;
        if goes_on {
            self.vertices.extend(next.vertices);
            self.steps.extend(next.steps);
        }
        goes_on
    }

    pub(crate) fn put(&self, out: &mut impl Put) {
        let mut next = 0;
        for (&vertex, &step) in self.vertices.iter().zip(&self.steps) {
            out.number(EXACT_GAP, 0, vertex - next);
            next = vertex + 1;
            // The sign last.
            let zigzag = (step << 1 ^ step >> 63) as u64;
            let length = u64::BITS - zigzag.leading_zeros();
            out.symbol(EXACT_LENGTH, u32::from(!self.is_single), length);
            let low = length.saturating_sub(1);
            out.bits(zigzag as u32, low.min(32));
            out.bits((zigzag >> 32) as u32, low.saturating_sub(32));
        }
    }

    pub(crate) fn read(source: &mut Source<'_>, is_single: bool, count: u32) -> Result<Self, FormatError> {
        let mut corrections = Self { is_single, vertices: Vec::new(), steps: Vec::new() };
        let mut next = 0_u32;
        for _ in 0..count {
            let vertex = next.checked_add(source.number(EXACT_GAP, 0)?).filter(|&v| v < u32::MAX);
            let vertex = vertex.ok_or_else(|| source.corrupt("a vertex has too large a number"))?;
            next = vertex + 1;
            let length = source.symbol(EXACT_LENGTH, u32::from(!is_single))?;
            let low = length.saturating_sub(1);
            let bits =
                u64::from(source.bits(low.min(32))?) | u64::from(source.bits(low.saturating_sub(32))?) << 32;
            let zigzag = if length == 0 { 0 } else { 1 << low | bits };
            corrections.vertices.push(vertex);
            corrections.steps.push((zigzag >> 1) as i64 ^ -((zigzag & 1) as i64));
        }
        Ok(corrections)
    }
}

/// The value so many numbers further up.
fn moved(value: f64, steps: i64, is_single: bool) -> f64 {
    if is_single {
        let place = i64::from(place_of_single((value as f32).to_bits())).wrapping_add(steps) as u32;
        f64::from(f32::from_bits(if place >> 31 == 1 { place & !(1 << 31) } else { !place }))
    } else {
        let place = place_of_double(value.to_bits()).wrapping_add(steps as u64);
        f64::from_bits(if place >> 63 == 1 { place & !(1 << 63) } else { !place })
    }
}

/// The place of a number among all of single precision, from the least to the largest.
fn place_of_single(bits: u32) -> u32 {
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// The place of a number among all of double precision, from the least to the largest.
fn place_of_double(bits: u64) -> u64 {
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_values_come_back_from_any_level() {
        let values = [0.0, -0.0, 1.5, -1e-30, 5e-324, f64::MAX, f64::MIN, 0.1, -7.25];
        for about in [0.0, -3.0, 1e300, -1e-300, 0.25] {
            for single in [true, false] {
                let kept = |x: f64| if single { f64::from(x as f32) } else { x };
                let all: Vec<(VertexId, f64)> = (0..)
                    .zip(values)
                    .filter(|(_, x)| !single || kept(*x).is_finite())
                    .map(|(v, x)| (VertexId(3 * v), kept(x)))
                    .collect();
                let exact = Exact::new(0, all.clone());
                let corrections = Corrections::new(&exact, |_| Some(about)).expect("all have levels");
                for (vertex, x) in all {
                    assert_eq!(corrections.value(vertex, about).map(f64::to_bits), Some(x.to_bits()));
                    assert_eq!(corrections.value(VertexId(vertex.0 + 1), about), None);
                }
            }
        }
    }
}
