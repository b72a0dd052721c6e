//! Regions of the volume.

use super::wire::{Bytes, Info, Section, bounds_of};

/// What a file says of a region.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    pub name: String,
    pub labels: Vec<i64>,
    pub color: u8,
    pub tetrahedra: u64,
    pub volume: f64,
    pub bounds: [[i32; 3]; 2],
}

#[derive(Clone, Debug, PartialEq)]
pub struct Regions {
    pub arrays: Vec<String>,
    pub all: Vec<Region>,
    pub deviation: f64,
    pub of_base: Vec<u16>,
    /// Of each block, ascending; of a file whose index is in pages at first those of the pages.
    pub of_blocks: Vec<Vec<u16>>,
    /// By field whether it jumps; with flag 1 of the header.
    pub jumps: Vec<bool>,
}

/// The regions of a file with so many blocks, or pages of the index; none if it has none.
pub fn find(front: &[Section<'_>], info: &Info, blocks: usize, has_sides: bool) -> Option<Regions> {
    let place = |kind: &[u8; 4]| front.iter().position(|section| &section.kind == kind);
    let at = place(b"regn")?;
    assert!(info.kind == 3 && place(b"INDX") < Some(at) && Some(at) < place(b"MODL"));
    assert_eq!(front.iter().filter(|section| &section.kind == b"regn").count(), 1);
    let mut bytes = front[at].payload;
    let arrays: Vec<String> = (0..bytes.varint()).map(|_| bytes.string()).collect();
    let count = bytes.varint();
    assert!((1..=65_536).contains(&count));
    let all: Vec<Region> = (0..count).map(|_| region(&mut bytes, arrays.len(), info)).collect();
    let deviation = bytes.f64();
    let mut of_base = Vec::new();
    for _ in 0..bytes.varint() {
        let [region, length] = [bytes.varint(), bytes.varint()];
        assert!(region < count);
        of_base.extend((0..length).map(|_| region as u16));
    }
    let of_blocks: Vec<Vec<u16>> = (0..blocks).map(|_| bytes.ascending()).collect();
    assert!(of_blocks.iter().flatten().all(|&region| u32::from(region) < count));
    let jump = |bytes: &mut Bytes<'_>| match bytes.u8() {
        0 => false,
        1 => true,
        other => panic!("a field that jumps by {other}"),
    };
    let jumps = info.fields.iter().filter(|_| has_sides).map(|_| jump(&mut bytes)).collect();
    bytes.end();
    assert!(all.is_sorted_by(|a, b| a.labels < b.labels));
    Some(Regions { arrays, all, deviation, of_base, of_blocks, jumps })
}

fn region(bytes: &mut Bytes<'_>, arrays: usize, info: &Info) -> Region {
    let name = bytes.string();
    let label = |bytes: &mut Bytes<'_>| {
        let code = bytes.varint64();
        // 0, -1, 1, -2, …
        if code.is_multiple_of(2) { (code / 2) as i64 } else { -((code / 2) as i64) - 1 }
    };
    let labels = (0..arrays).map(|_| label(bytes)).collect();
    let color = bytes.u8();
    assert!(color < 12);
    let tetrahedra = bytes.varint64();
    Region { name, labels, color, tetrahedra, volume: bytes.f64(), bounds: bounds_of(bytes, info) }
}
