//! Histograms of the fields.

use super::wire::{Info, Section};

/// The shares of the volume, by field and bin; none if the file has none.
pub fn find(front: &[Section<'_>], info: &Info) -> Vec<Vec<u32>> {
    let mut found = (0..).zip(front).filter(|(_, section)| &section.kind == b"hist");
    let Some((place, section)) = found.next() else { return Vec::new() };
    // Half-edge files alone have an index.
    let indices = front.iter().filter(|section| &section.kind == b"INDX").count();
    assert!(place == 1 + indices && found.next().is_none(), "once, behind INFO and INDX");
    let mut payload = section.payload;
    let bins = payload.varint();
    assert!((1..=1024).contains(&bins));
    let histograms = info.fields.iter().map(|_| (0..bins).map(|_| payload.varint()).collect());
    let histograms = histograms.collect();
    payload.end();
    histograms
}
