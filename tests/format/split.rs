//! Promise: it does not matter how a file is cut into pieces on its way.

use crate::support::files::{bytes_of, decode, samples};
use crate::support::strategies::config;
use proptest::prelude::*;
use tetralod::format::{Decoder, FormatError};
use tetralod::mt::Mt;

/// Feeds pieces that end at `cuts`.
fn feed(bytes: &[u8], cuts: &[usize]) -> Result<Mt, FormatError> {
    let mut decoder = Decoder::default();
    let mut start = 0;
    for &cut in cuts.iter().chain([&bytes.len()]) {
        let progress = decoder.feed(&bytes[start..cut])?;
        assert_eq!(progress.bytes, cut as u64);
        start = cut;
    }
    decoder.finish()?;
    Ok(decoder.into_mt().expect("a complete file has a base mesh"))
}

#[test]
fn byte_by_byte_and_in_equal_pieces() {
    samples(2, 300).iter().for_each(in_equal_pieces);
}

fn in_equal_pieces(mt: &Mt) {
    let bytes = bytes_of(mt);
    let whole = decode(&bytes);
    assert!(whole.is_ok());
    for size in [1, 2, 3, 7, 31, 32, 33, 44, 1000] {
        let cuts: Vec<usize> = (0..bytes.len()).step_by(size).collect();
        assert!(feed(&bytes, &cuts) == whole, "pieces of {size} bytes");
    }
}

proptest! {
    #![proptest_config(config(48, 29))]

    #[test]
    fn any_split(cuts in prop::collection::vec(any::<prop::sample::Index>(), 0..40)) {
        for mt in samples(1, 300) {
            let bytes = bytes_of(&mt);
            let mut cuts: Vec<usize> = cuts.iter().map(|cut| cut.index(bytes.len() + 1)).collect();
            cuts.sort_unstable();
            prop_assert!(feed(&bytes, &cuts) == decode(&bytes));
        }
    }
}
