//! Positions and levels of inserted vertices, as residuals against predictions from the mesh.

use super::families::{FAR, LEVEL, OFFSET, SHORT};
use super::state::{Home, State};
use crate::format::FormatError;
use crate::format::coder::{Put, Source};
use crate::mt::{ErrorCode, MAX_FIELD_BITS, MtInfo, MultiTessellation, UpdateId, VertexMt};

/// [`OFFSET`] of a difference with as many bits as predicted.
const OFFSET_BIAS: u32 = 40;

/// Puts a number below `count`, all of which are equally likely, with as few bits as that takes.
pub(super) fn put_one_of(out: &mut impl Put, value: u32, count: u32) {
    let (width, short) = one_of(count);
    if value < short {
        out.bits(value, width);
    } else {
        out.bits((value + short) >> 1, width);
        out.bits(value + short, 1);
    }
}

/// How many bits all numbers below `count` take, and how many of them take no more than that.
pub(super) fn one_of(count: u32) -> (u32, u32) {
    let width = count.max(1).ilog2();
    (width, (2 << width) - count.max(1))
}

pub(super) fn read_one_of(source: &mut Source<'_>, count: u32) -> Result<u32, FormatError> {
    let (width, short) = one_of(count);
    let value = source.bits(width)?;
    Ok(if value < short { value } else { 2 * value + source.bits(1)? - short })
}

/// Along an axis, the prediction for a new vertex near `near`: the bits of the difference, the context, and what the difference is
/// relative to.
pub(super) fn prediction(state: &State, axis: usize) -> (u32, u32, i32) {
    let grain = i64::from(state.grain[axis]);
    let (mut sum, mut size, mut level) = (0, 0, 1);
    for seen in &state.link {
        let difference = seen[axis];
        sum += difference;
        size += difference.abs();
        level += u32::from(difference == 0);
    }
    let count = grain * state.link.len().max(1) as i64;
    let context = [0, 0, 1, 2, 2, 3][level.min(5) as usize];
    // Towards the middle of the star, unless some of it lies level with the near vertex.
    let from = if context == 0 { sum / (2 * count) } else { 0 };
    (bits_of((size / count) as u32), context, from as i32)
}

pub(super) fn bits_of(x: u32) -> u32 {
    u32::BITS - x.leading_zeros()
}

pub(super) fn put_position(out: &mut impl Put, state: &State, near: u32, position: [i32; 3]) {
    for (axis, x) in position.into_iter().enumerate() {
        let (size, context, from) = prediction(state, axis);
        let offset = x.wrapping_sub(state.mesh.positions()[near as usize][axis]);
        let residual = (offset / state.grain[axis]).wrapping_sub(from);
        let length = residual.unsigned_abs();
        let bits = bits_of(length);
        if bits == 0 {
            out.symbol(OFFSET, context, 0);
            continue;
        }
        let low = bits.saturating_sub(2);
        let second = if bits > 1 { length >> low & 1 } else { 0 };
        out.symbol(OFFSET, context, OFFSET_BIAS + 2 * bits + second - 2 * size);
        out.bits(length, low);
        out.bits(u32::from(residual < 0), 1);
    }
}

pub(super) fn read_position(
    source: &mut Source<'_>,
    info: &MtInfo,
    state: &State,
    near: u32,
) -> Result<[i32; 3], FormatError> {
    let mut position = state.mesh.positions()[near as usize];
    for (axis, x) in position.iter_mut().enumerate() {
        let (size, context, from) = prediction(state, axis);
        let symbol = source.symbol(OFFSET, context)?;
        let mut residual = 0;
        if symbol > 0 {
            let twice = (symbol + 2 * size).wrapping_sub(OFFSET_BIAS);
            let (bits, second) = (twice / 2, twice & 1);
            if !(1..=31).contains(&bits) || second > 0 && bits == 1 {
                return Err(source.corrupt("a vertex is off the lattice"));
            }
            let low = bits.saturating_sub(2);
            let top = if bits == 1 { 1 } else { 2 | second };
            residual = (top << low | source.bits(low)?) as i32;
            residual = if source.bits(1)? == 1 { -residual } else { residual };
        }
        *x = residual.wrapping_add(from).wrapping_mul(state.grain[axis]).wrapping_add(*x);
    }
    if !position.iter().all(|&x| 0 <= x && x <= 1 << info.lattice.bits) {
        return Err(source.corrupt("a vertex is off the lattice"));
    }
    Ok(position)
}

/// Above this many levels it is worth a symbol whether the level is as far off as the error allows.
const LEAST_FAR: u32 = 3;

/// How many levels the error of an update is, and the context of the level.
pub(super) fn bound(info: &MtInfo, field: usize, error: ErrorCode, home: &Home) -> (u32, u32) {
    let field = &info.fields[field];
    let levels = (error.error() * field.range() / field.step).floor() as u32;
    // There are not more levels than that.
    let levels = levels.min(1 << MAX_FIELD_BITS);
    (levels, bits_of(levels).min(19) + if home.outside { 20 } else { 0 })
}

pub(super) fn put_levels(out: &mut impl Put, mt: &VertexMt, u: UpdateId, state: &State, position: [i32; 3]) {
    let home = state.home(position);
    for (f, level) in mt.levels(u).enumerate() {
        let expected = state.expected(mt.info(), &home, f);
        let (bound, context) = bound(mt.info(), f, state.errors[f], &home);
        let residual = level - expected;
        let length = residual.unsigned_abs();
        if bound > LEAST_FAR {
            let far = length >= bound - bound / 64 && length <= bound + 1;
            out.symbol(FAR, bits_of(bound), u32::from(far));
            if far {
                out.number(SHORT, 0, bound + 1 - length);
                out.bits(u32::from(residual < 0), 1);
                continue;
            }
        }
        out.signed(LEVEL, context, residual);
    }
}

pub(super) fn read_levels(
    source: &mut Source<'_>,
    info: &MtInfo,
    state: &State,
    position: [i32; 3],
) -> Result<Vec<i32>, FormatError> {
    let home = state.home(position);
    let mut levels = Vec::with_capacity(info.fields.len());
    for f in 0..info.fields.len() {
        let expected = state.expected(info, &home, f);
        let (bound, context) = bound(info, f, state.errors[f], &home);
        let far = bound > LEAST_FAR && source.symbol(FAR, bits_of(bound))? == 1;
        let residual = if far {
            // Levels have few bits: what is not below 2^31 is off the lattice in any case.
            let length = (bound + 1).wrapping_sub(source.number(SHORT, 0)?) as i32;
            if source.bits(1)? == 1 { length.wrapping_neg() } else { length }
        } else {
            source.signed(LEVEL, context)?
        };
        levels.push(expected.wrapping_add(residual));
    }
    Ok(levels)
}
