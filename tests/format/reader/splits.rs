//! Blocks of vertex splits, decoded without a mesh.

use super::coded::{CHILDREN, Coded, EDGE, GAP, LAST_WRONG, OFFSET, RISE, RUN, Row, WRONG, len};
use std::collections::HashMap;
use std::ops::Range;

/// What an update is told by.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Split {
    pub vertex: u32,
    pub offset: [i32; 3],
    /// Of the link, counted from 1; 0 is none.
    pub edge: u32,
    pub mask: u64,
    /// By field.
    pub errors: Vec<u16>,
    pub residuals: Vec<i32>,
}

/// Reads the shared part of a block; `known` must have the splits of the blocks on which it depends.
pub fn shared(
    coded: &mut Coded<'_>,
    base_vertices: u32,
    updates: Range<u32>,
    known: &HashMap<u32, Split>,
) -> Vec<Split> {
    let old = base_vertices + 2 * updates.start;
    let vertices = vertices(coded, old, updates.len());
    let leads = coded.bits(1) == 1;
    let mut splits: Vec<Split> = Vec::new();
    for vertex in vertices {
        let above = if vertex >= old {
            Some(&splits[(vertex - old) as usize / 2])
        } else if vertex >= base_vertices {
            Some(&known[&((vertex - base_vertices) / 2)])
        } else {
            None
        };
        let edge = coded.number(EDGE, above.map_or(2, |above| above.edge.min(1)));
        assert!(edge <= 127);
        let offset = offset(coded, above, edge, leads);
        let mask = mask(coded);
        splits.push(Split { vertex, offset, edge, mask, ..Split::default() });
    }
    splits
}

fn vertices(coded: &mut Coded<'_>, old: u32, count: usize) -> Vec<u32> {
    // Vertices and their runs.
    let mut waiting: Vec<(u32, u32)> = Vec::new();
    let mut next = 0;
    for _ in 0..coded.bits(32) {
        let vertex = next + coded.number(GAP, 0);
        assert!(vertex < old);
        waiting.push((coded.number(RUN, 0), vertex));
        next = vertex + 1;
    }
    let mut vertices = Vec::new();
    while !waiting.is_empty() {
        waiting.sort_unstable();
        let (run, vertex) = waiting.remove(0);
        let first = old + 2 * vertices.len() as u32;
        vertices.push(vertex);
        let children = coded.symbol(CHILDREN, 0);
        for half in 0..2 {
            if children >> half & 1 == 1 {
                let rise = coded.number(RISE, 0);
                waiting.push((run + 1 + rise, first + half));
            }
        }
    }
    assert_eq!(vertices.len(), count);
    vertices
}

fn offset(coded: &mut Coded<'_>, above: Option<&Split>, edge: u32, leads: bool) -> [i32; 3] {
    let mut offset = [0; 3];
    for axis in 0..3 {
        let which = above.map_or(33, |above| len(above.offset[axis].unsigned_abs()));
        let which = if edge > 0 { 34 + which } else { which };
        let size = coded.number(OFFSET, which) as i32;
        let is_first = offset[..axis] == [0, 0, 0][..axis];
        let has_sign = size != 0 && !(leads && is_first && edge == 0);
        offset[axis] = if has_sign && coded.bits(1) == 1 { -size } else { size };
    }
    offset
}

fn mask(coded: &mut Coded<'_>) -> u64 {
    let last = coded.symbol(LAST_WRONG, 0);
    if last == 0 {
        return 0;
    }
    let r = match last {
        ..=8 => last - 1,
        9..=12 => 8,
        13..=16 => 9,
        17..=24 => 10,
        _ => 11,
    };
    let mut mask = 1 << (last - 1);
    for bit in 0..last - 1 {
        let c = match bit {
            ..=7 => bit,
            8..=11 => 8,
            12..=15 => 9,
            _ => 10,
        };
        mask |= u64::from(coded.symbol(WRONG, 11 * r + c)) << bit;
    }
    mask
}

/// Reads the errors and the residuals of one field, given the contexts of both.
pub fn field(coded: &mut Coded<'_>, count: usize, [error, level]: [Row; 2]) -> Vec<(u16, i32)> {
    let largest = coded.bits(8);
    let fine = coded.bits(1) == 1;
    let mut before = 0;
    let mut part = Vec::new();
    for _ in 0..count {
        before = coded.symbol(error, before);
        let upper = largest.checked_sub(before).expect("an error");
        let lower = if fine { coded.bits(8) } else { 0 };
        let residual = coded.signed(level, upper >> 1);
        part.push(((256 * upper + lower) as u16, residual));
    }
    part
}
