//! Long lists that all threads decode together.

use std::ops::Range;

use tetralod::threads;

use crate::error::ReadReason;

/// Shares that are decoded before they are appended: enough for all threads, and little beside the list.
const AT_A_TIME: usize = 32;

/// Appends to `list` what `decode` makes of `count` items, of so many at a time, in their order; the error of the first ones that have any.
pub(super) fn append<T: Copy + Send>(
    list: &mut Vec<T>,
    count: usize,
    share: usize,
    decode: impl Fn(Range<usize>) -> Result<Vec<T>, ReadReason> + Sync + Send,
) -> Result<(), ReadReason> {
    for first in (0..count).step_by(AT_A_TIME * share) {
        let items = (count - first).min(AT_A_TIME * share);
        for part in threads::map(items, share, |part| decode(first + part.start..first + part.end)) {
            list.extend_from_slice(&part?);
        }
    }
    Ok(())
}
