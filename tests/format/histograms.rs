//! Promise: a file may contain a histogram of each field, which is read as the specification says, or refused. (That it is the
//! histogram of the reference mesh is tested in `tests/session/curve.rs`.)

use crate::reader;
use crate::support::files::{
    assemble, bytes_of, decode, encoded, in_blocks, options, sample, samples, sections,
};
use tetralod::format::{Decoder, EncodeOptions, FormatError};

fn decoder(bytes: &[u8]) -> Decoder {
    let mut decoder = Decoder::default();
    decoder.feed(bytes).expect("a sound file");
    decoder
}

#[test]
fn both_readers_find_the_same() {
    for mt in samples(2, 200) {
        let bytes = bytes_of(&mt);
        let (file, _) = reader::open(&bytes);
        let decoder = decoder(&bytes);
        assert_eq!(file.histograms.len(), 2);
        for (field, stored) in file.histograms.iter().enumerate() {
            let sum: u32 = stored.iter().sum();
            assert!(sum.abs_diff(1 << 20) <= 64, "{sum}");
            let shares: Vec<f64> = stored.iter().map(|&share| f64::from(share) / f64::from(sum)).collect();
            assert_eq!(decoder.histogram(field), Some(shares));
        }
    }
}

#[test]
fn without_them_the_file_is_the_same_otherwise() {
    for mt in samples(1, 40) {
        let bytes = encoded(&in_blocks(&mt, 8), &EncodeOptions { histograms: false, ..options() })
            .expect("a sound MT");
        assert_eq!(decoder(&bytes).histogram(0), None);
        let with = bytes_of(&mt);
        let mut sections = sections(&with);
        let at = sections.iter().position(|(kind, _)| kind == b"hist").expect("it is there");
        let (_, payload) = sections.remove(at);
        assert!(payload.len() < 64 * 3 + 2, "{} bytes", payload.len());
        assert!(decode(&assemble(&sections, 40)) == decode(&bytes), "the same MT");
    }
}

#[test]
fn what_is_no_histogram_is_refused() {
    let good = sections(&bytes_of(&sample(1, 20)));
    let refused = |payload: Vec<u8>| {
        let mut sections = good.clone();
        assert_eq!(&sections[1].0, b"hist");
        sections[1].1 = payload;
        matches!(
            decode(&assemble(&sections, 20)),
            Err(FormatError::Corrupt { .. } | FormatError::Truncated { .. })
        )
    };
    assert!(!refused(vec![1, 0]), "one bin, and no volume");
    assert!(refused(vec![0]), "no bins");
    assert!(refused([vec![0x81, 8], vec![1; 1025]].concat()), "1025 bins");
    assert!(!refused([vec![0x80, 8], vec![1; 1024]].concat()), "1024 bins");
    assert!(refused(vec![2, 7]), "too short");
    assert!(refused(vec![2, 7, 7, 7]), "too long");
    assert!(refused(vec![]), "empty");
    for place in [0, 1, 3, 4, good.len()] {
        let mut sections = good.clone();
        let histogram = sections[1].clone();
        sections.insert(place, histogram);
        assert!(decode(&assemble(&sections, 20)).is_err(), "twice, also at {place}");
    }
}

#[test]
fn a_field_without_volume_has_no_shares() {
    let mut sections = sections(&bytes_of(&sample(1, 20)));
    sections[1].1 = vec![3, 0, 0, 0];
    assert_eq!(decoder(&assemble(&sections, 20)).histogram(0), Some(vec![0.0; 3]));
}
