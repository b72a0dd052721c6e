//! Exact values of a field.

use super::coded::{Coded, VALUE_BITS, VALUE_GAP};
use super::wire::Bytes;

/// What is wrong with the values of a field's levels, by vertex.
pub struct Exact {
    pub field: u32,
    /// 0 or 1.
    precision: u32,
    pub corrections: Vec<(u32, i64)>,
}

pub fn read(mut payload: Bytes<'_>, tables: &[Vec<(u32, u32)>]) -> Exact {
    let [field, precision, count] = [payload.varint(), payload.varint(), payload.varint()];
    assert!(precision <= 1);
    let mut coded = Coded::new(payload, tables);
    let mut next = 0;
    let corrections = (0..count).map(|_| {
        let vertex = next + coded.number(VALUE_GAP, 0);
        next = vertex + 1;
        let length = coded.symbol(VALUE_BITS, precision);
        let z = (0..length).fold(0_u64, |z, bit| {
            let is_set = bit + 1 == length || coded.bits(1) == 1;
            z | u64::from(is_set) << bit
        });
        let half = (z / 2) as i64;
        (vertex, if z % 2 == 0 { half } else { -half - 1 })
    });
    let corrections = corrections.collect();
    coded.end();
    Exact { field, precision, corrections }
}

/// Those of each field, which may be in several sections.
pub fn joined(sections: impl Iterator<Item = Exact>) -> Vec<Exact> {
    let mut all: Vec<Exact> = Vec::new();
    for section in sections {
        match all.last_mut() {
            Some(before) if before.field == section.field => {
                assert_eq!(before.precision, section.precision);
                assert!(
                    before.corrections.last().map(|last| last.0)
                        < section.corrections.first().map(|first| first.0)
                );
                before.corrections.extend(section.corrections);
            }
            _ => all.push(section),
        }
    }
    all
}

impl Exact {
    /// The exact value, given that of the level.
    pub fn value(&self, of_level: f64, correction: i64) -> f64 {
        if self.precision == 0 {
            let place = |n: u32| if n >> 31 == 1 { !n } else { n | 1 << 31 };
            let moved = place((of_level as f32).to_bits()).wrapping_add(correction as u32);
            f64::from(f32::from_bits(if moved >> 31 == 1 { moved ^ 1 << 31 } else { !moved }))
        } else {
            let place = |n: u64| if n >> 63 == 1 { !n } else { n | 1 << 63 };
            let moved = place(of_level.to_bits()).wrapping_add(correction as u64);
            f64::from_bits(if moved >> 63 == 1 { moved ^ 1 << 63 } else { !moved })
        }
    }
}
