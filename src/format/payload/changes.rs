//! What updates do to one field: their errors, and residuals of levels.

use crate::format::FormatError;
use crate::format::coder::{Family, Put, Source};
use crate::mt::ErrorCode;

/// The upper byte of the least code that is no smaller than an error and has nothing below that byte; 255 stands for any error.
pub fn upper_byte(error: ErrorCode) -> u8 {
    error.0.div_ceil(1 << 8).min(0xFF) as u8
}

/// What such a byte says that no error is larger than.
pub fn bound_of(upper: u8) -> ErrorCode {
    ErrorCode(if upper == 0xFF { u16::MAX } else { u16::from(upper) << 8 })
}

/// What updates of a block do to one field.
#[derive(Clone, Debug, Default)]
pub struct FieldPart {
    pub errors: Vec<ErrorCode>,
    pub residuals: Vec<i32>,
    /// Where the field jumps, for each update the residuals in further regions.
    pub sides: Option<Vec<Vec<i32>>>,
}

/// Which of the ranges that end with these numbers a number is in; what is larger is in one more.
pub fn range_of(number: u32, ends: &[u32]) -> u32 {
    ends.partition_point(|&end| end < number) as u32
}

/// Puts errors and residuals of levels, update by update, by the families of both.
pub fn put_changes<U>(
    out: &mut impl Put,
    [error, level]: [Family; 2],
    updates: impl Iterator<Item = U> + Clone,
    change: impl Fn(U) -> (ErrorCode, i32),
) {
    let codes = updates.clone().map(|u| change(u).0.0);
    let (largest, is_fine) =
        codes.fold((0, false), |(largest, fine), code| (largest.max(code >> 8), fine || code & 0xFF != 0));
    out.bits(u32::from(largest), 8);
    out.bits(u32::from(is_fine), 1);
    let mut before = 0;
    for (ErrorCode(code), residual) in updates.map(change) {
        let fall = u32::from(largest - (code >> 8));
        out.symbol(error, before, fall);
        if is_fine {
            out.bits(u32::from(code & 0xFF), 8);
        }
        before = fall;
        out.signed(level, u32::from(code >> 9), residual);
    }
}

/// Reads what [`put_changes`] puts of `count` updates.
pub fn read_changes(
    source: &mut Source<'_>,
    [error, level]: [Family; 2],
    count: u32,
) -> Result<FieldPart, FormatError> {
    let largest = source.bits(8)?;
    let is_fine = source.bits(1)? == 1;
    let (mut part, mut before) = (FieldPart::default(), 0);
    for _ in 0..count {
        let fall = source.symbol(error, before)?;
        let upper = largest.checked_sub(fall).ok_or_else(|| source.corrupt("an error is below zero"))?;
        let lower = if is_fine { source.bits(8)? } else { 0 };
        before = fall;
        part.errors.push(ErrorCode((upper << 8 | lower) as u16));
        part.residuals.push(source.signed(level, upper >> 1)?);
    }
    Ok(part)
}
