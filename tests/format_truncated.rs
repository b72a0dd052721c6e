//! Promise: every prefix of a file is usable as far as it goes, and is told apart from the whole and from damage.

mod format_support;

use format_support::{bytes_of, is_prefix, samples};
use tetralod::format::{Decoder, FormatError};
use tetralod::mt::Mt;

#[test]
fn every_prefix_is_a_coarser_mt_and_is_called_truncated() {
    samples(3, 2, 700).iter().for_each(every_prefix_is_usable);
}

fn every_prefix_is_usable(mt: &Mt) {
    let bytes = bytes_of(mt);
    let mut ready_at = None;
    let mut last = 0;
    for length in 0..bytes.len() {
        let mut decoder = Decoder::default();
        let progress = decoder.feed(&bytes[..length]).expect("a prefix is not damaged");
        assert!(!progress.complete);
        assert!(progress.updates >= last, "an MT only grows");
        last = progress.updates;
        assert_eq!(decoder.finish(), Err(FormatError::Truncated { offset: length as u64 }));
        assert_eq!(progress.ready, decoder.mt().is_some());
        if let Some(part) = decoder.mt() {
            ready_at.get_or_insert(length);
            assert!(is_prefix(part, mt));
        }
    }
    // Two blocks: the first must have been usable long before the end, the base mesh even sooner.
    assert_eq!(last, 700);
    assert!(ready_at.expect("usable at some point") < bytes.len() / 4);
}
