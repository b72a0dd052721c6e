//! Promise: every prefix of a file is usable as far as it goes, and is told apart from the whole and from damage.

use crate::support::files::{bytes_in_blocks, decode, is_prefix, samples};
use tetralod::format::{Decoder, FormatError, Progress};
use tetralod::mt::{Mt, UpdatePages};

/// What must hold when the first bytes of a file have arrived.
fn check_prefix(decoder: &Decoder, progress: Progress, length: usize) {
    assert!(!progress.complete);
    assert_eq!(progress.bytes, length as u64);
    assert_eq!(decoder.finish(), Err(FormatError::Truncated { offset: length as u64 }));
    assert_eq!(progress.ready, decoder.mt().is_some());
    assert_eq!(progress.updates, decoder.mt().map_or(0, |mt| mt.present()));
}

#[test]
fn every_prefix_is_called_truncated() {
    for mt in samples(2, 40) {
        let bytes = bytes_in_blocks(&mt, 4);
        for length in 0..bytes.len() {
            let mut decoder = Decoder::default();
            let progress = decoder.feed(&bytes[..length]).expect("a prefix is not damaged");
            check_prefix(&decoder, progress, length);
        }
    }
}

#[test]
fn every_prefix_is_a_coarser_mt() {
    samples(2, 300).iter().for_each(every_prefix_is_usable);
}

fn every_prefix_is_usable(mt: &Mt) {
    let bytes = bytes_in_blocks(mt, 4);
    let whole = decode(&bytes).expect("a good file");
    let mut decoder = Decoder::default();
    let (mut ready_at, mut last, mut steps) = (None, 0, 0);
    for (at, byte) in bytes[..bytes.len() - 1].iter().enumerate() {
        let progress = decoder.feed(&[*byte]).expect("a prefix is not damaged");
        check_prefix(&decoder, progress, at + 1);
        assert!(progress.updates >= last, "an MT only grows");
        if let Some(part) = decoder.mt() {
            ready_at.get_or_insert(at);
            if progress.updates != last {
                steps += 1;
                assert!(is_prefix(part, &whole));
            }
        }
        last = progress.updates;
    }
    assert_eq!((last, steps), (300, 19), "block by block");
    assert!(ready_at.is_some_and(|at| at < bytes.len() * 3 / 4), "usable long before the end");
}
