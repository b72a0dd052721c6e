//! Header, sections, and what is in them as plain numbers.

/// A cursor over bytes. Whatever is damaged panics: this is a test.
#[derive(Clone, Copy)]
pub struct Bytes<'a>(pub &'a [u8]);

impl<'a> Bytes<'a> {
    pub fn take(&mut self, count: usize) -> &'a [u8] {
        let (head, tail) = self.0.split_at(count);
        self.0 = tail;
        head
    }

    fn number(&mut self, bytes: usize) -> u64 {
        self.take(bytes).iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte))
    }

    pub fn u8(&mut self) -> u8 {
        self.number(1) as u8
    }

    pub fn u16(&mut self) -> u16 {
        self.number(2) as u16
    }

    pub fn u32(&mut self) -> u32 {
        self.number(4) as u32
    }

    pub fn u64(&mut self) -> u64 {
        self.number(8)
    }

    pub fn f64(&mut self) -> f64 {
        let x = f64::from_bits(self.u64());
        assert!(x.is_finite());
        x
    }

    pub fn varint64(&mut self) -> u64 {
        let mut groups = Vec::new();
        loop {
            let byte = self.u8();
            groups.push(byte & 0x7F);
            if byte < 0x80 {
                break;
            }
        }
        assert!(groups.len() == 1 || groups.last() != Some(&0), "longer than needed");
        let value = groups.iter().rev().fold(0_u128, |value, &group| value << 7 | u128::from(group));
        u64::try_from(value).expect("64 bits")
    }

    pub fn varint(&mut self) -> u32 {
        u32::try_from(self.varint64()).expect("32 bits")
    }

    pub fn string(&mut self) -> String {
        let length = self.varint();
        assert!(length <= 65_535);
        String::from_utf8(self.take(length as usize).to_vec()).expect("UTF-8")
    }

    /// How many numbers, then these: the first, then each less the one before less 1.
    pub fn ascending(&mut self) -> Vec<u16> {
        let mut numbers: Vec<u16> = Vec::new();
        for _ in 0..self.varint() {
            let next = numbers.last().map_or(0, |last| u32::from(*last) + 1);
            numbers.push(u16::try_from(next + self.varint()).expect("16 bits"));
        }
        numbers
    }

    pub fn end(self) {
        assert!(self.0.is_empty(), "something is left over");
    }
}

pub fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for &byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    !crc
}

/// A section that has been verified.
pub struct Section<'a> {
    pub kind: [u8; 4],
    pub payload: Bytes<'a>,
    pub crc: u32,
    /// Where it begins and ends in the file, its head included.
    pub range: [u64; 2],
}

/// The sections of a whole file.
pub fn sections(file: &[u8]) -> Vec<Section<'_>> {
    let mut header = Bytes(&file[..32]);
    assert_eq!(header.take(8), [0x89, 0x54, 0x4C, 0x4F, 0x44, 0x0D, 0x0A, 0x1A]);
    assert_eq!(header.u16(), 2, "the version");
    let _reserved = header.u16();
    assert!(header.u32() & 0xFFFF <= 15, "critical flags");
    let total = header.u64();
    assert!(total == 0 || total == file.len() as u64);
    let _reserved = header.u32();
    assert_eq!(header.u32(), crc32(&file[..28]));
    let mut rest = Bytes(&file[32..]);
    let mut sections = Vec::new();
    while !rest.0.is_empty() {
        let start = file.len() - rest.0.len();
        let kind = rest.take(4).try_into().expect("four bytes");
        let length = rest.u32();
        let crc = rest.u32();
        let payload = Bytes(rest.take(length as usize));
        let covered = [&file[start..start + 8], payload.0].concat();
        assert_eq!(crc, crc32(&covered));
        let end = file.len() - rest.0.len();
        sections.push(Section { kind, payload, crc, range: [start as u64, end as u64] });
    }
    sections
}

#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    pub name: String,
    pub min: f64,
    pub max: f64,
    pub origin: f64,
    pub step: f64,
    pub bits: u32,
    pub rounding: f64,
    pub unit: String,
    /// Name and component; none is the length.
    pub vector: Option<(String, Option<u8>)>,
    pub is_label: bool,
    pub time: Option<f64>,
    /// The smallest and the largest value.
    pub extremes: Option<[Extreme; 2]>,
    /// Those at cells, and the differences of averaging.
    pub averaged: Option<([Extreme; 2], [f64; 2])>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Extreme {
    pub value: f64,
    pub place: [f64; 3],
    /// Number, and part if it is not empty.
    pub cell: Option<(u32, String)>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Info {
    pub kind: u8,
    pub vertices: u32,
    pub tetrahedra: u64,
    pub updates: u32,
    pub origin: [f64; 3],
    pub step: [f64; 3],
    pub bits: u32,
    pub displacement_per_error: f64,
    pub fields: Vec<Field>,
    pub metadata: Vec<(String, String)>,
    pub rounding: f64,
}

/// `many_tets`: flag 3 of the header.
pub fn info(mut bytes: Bytes<'_>, many_tets: bool) -> Info {
    let mut info = Info {
        kind: bytes.u8(),
        vertices: bytes.u32(),
        tetrahedra: if many_tets { bytes.u64() } else { u64::from(bytes.u32()) },
        updates: bytes.u32(),
        origin: [0; 3].map(|_| bytes.f64()),
        step: [0; 3].map(|_| bytes.f64()),
        bits: u32::from(bytes.u8()),
        displacement_per_error: bytes.f64(),
        fields: Vec::new(),
        metadata: Vec::new(),
        rounding: 0.0,
    };
    assert_eq!(info.tetrahedra >> 32 > 0, many_tets);
    assert!(
        [0, 1, 3].contains(&info.kind)
            && (info.kind == 3 || info.updates <= 1 << 30)
            && (1..=30).contains(&info.bits)
    );
    for _ in 0..bytes.u8() {
        let field = Field {
            name: bytes.string(),
            min: bytes.f64(),
            max: bytes.f64(),
            origin: bytes.f64(),
            step: bytes.f64(),
            bits: u32::from(bytes.u8()),
            rounding: 0.0,
            unit: String::new(),
            vector: None,
            is_label: false,
            time: None,
            extremes: None,
            averaged: None,
        };
        assert!((1..=24).contains(&field.bits) && field.step > 0.0);
        info.fields.push(field);
    }
    assert!(!info.fields.is_empty());
    for _ in 0..bytes.varint() {
        info.metadata.push((bytes.string(), bytes.string()));
    }
    assert!(info.metadata.windows(2).all(|pair| pair[0].0 < pair[1].0));
    if !bytes.0.is_empty() {
        more(&mut bytes, &mut info);
    }
    bytes.end();
    info
}

/// What follows the metadata, or does not.
fn more(bytes: &mut Bytes<'_>, info: &mut Info) {
    info.rounding = bytes.f64();
    for field in &mut info.fields {
        field.rounding = bytes.f64();
        field.unit = bytes.string();
        let flags = bytes.u8();
        assert!(flags <= 15 && flags & 3 != 2);
        field.is_label = flags & 8 != 0;
        assert!(!field.is_label || field.step == 1.0 && field.origin.fract() == 0.0);
        if flags & 1 != 0 {
            let name = bytes.string();
            let component = if flags & 2 == 0 { Some(bytes.u8()) } else { None };
            field.vector = Some((name, component));
        }
        if flags & 4 != 0 {
            field.time = Some(bytes.f64());
        }
    }
}

/// What is known of the extremes of fields.
pub fn extremes(mut bytes: Bytes<'_>, info: &mut Info) {
    let mut known = 0;
    for field in &mut info.fields {
        let flags = bytes.u8();
        assert!(flags <= 3);
        known |= flags;
        if flags & 1 != 0 {
            field.extremes = Some(two_extremes(&mut bytes, false));
        }
        if flags & 2 != 0 {
            let ends = two_extremes(&mut bytes, true);
            let difference = [bytes.f64(), bytes.f64()];
            assert!(difference.iter().all(|x| x.is_finite() && *x >= 0.0));
            field.averaged = Some((ends, difference));
        }
    }
    assert_ne!(known, 0);
    bytes.end();
}

fn two_extremes(bytes: &mut Bytes<'_>, at_cells: bool) -> [Extreme; 2] {
    let ends = [0; 2].map(|_| {
        let (value, place) = (bytes.f64(), [0; 3].map(|_| bytes.f64()));
        assert!(value.is_finite() && place.iter().all(|x| x.is_finite()));
        Extreme { value, place, cell: at_cells.then(|| (bytes.varint(), bytes.string())) }
    });
    assert!(ends[0].value <= ends[1].value);
    ends
}

/// The least and the largest corner of the box around the reference mesh.
pub fn bounds(mut bytes: Bytes<'_>, info: &Info) -> [[i32; 3]; 2] {
    let bounds = bounds_of(&mut bytes, info);
    bytes.end();
    bounds
}

/// The least and the largest corner of a box.
pub fn bounds_of(bytes: &mut Bytes<'_>, info: &Info) -> [[i32; 3]; 2] {
    let axes = [0; 3].map(|_| {
        let (low, more) = (u64::from(bytes.varint()), u64::from(bytes.varint()));
        assert!(low + more <= 1 << info.bits);
        [low as i32, (low + more) as i32]
    });
    [0, 1].map(|end| axes.map(|axis| axis[end]))
}

/// What the index tells of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockEntry {
    pub lengths: Vec<u32>,
    /// Along x, y, z: the least and the largest coordinate.
    pub bounds: [[u64; 2]; 3],
    /// By field the largest code, and the least and largest level.
    pub fields: Vec<(u16, [u64; 2])>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Index {
    pub block_bits: u32,
    pub between: u64,
    pub count: u32,
    /// With flag 2 of the header they come later.
    pub blocks: Vec<BlockEntry>,
    pub pages: Option<IndexPages>,
}

/// Pages of the index.
#[derive(Clone, Debug, PartialEq)]
pub struct IndexPages {
    pub bits: u32,
    /// The bytes of the section, those of the blocks, and what is told of them, without lengths.
    pub all: Vec<(u32, u64, BlockEntry)>,
}

pub fn index(mut bytes: Bytes<'_>, info: &Info, in_pages: bool) -> Index {
    let block_bits = u32::from(bytes.u8());
    assert!((4..=16).contains(&block_bits));
    let between = bytes.varint64();
    let count = bytes.varint();
    assert_eq!(count, info.updates.div_ceil(1 << block_bits));
    let mut index = Index { block_bits, between, count, blocks: Vec::new(), pages: None };
    if in_pages {
        let bits = u32::from(bytes.u8());
        assert!(bits <= 20);
        let page = |_| (bytes.varint(), bytes.varint64(), entry(&mut bytes, info, Vec::new()));
        index.pages = Some(IndexPages { bits, all: (0..count.div_ceil(1 << bits)).map(page).collect() });
    } else {
        index.blocks = (0..count).map(|_| block_entry(&mut bytes, info)).collect();
    }
    bytes.end();
    index
}

/// The entries of the next page, which is number `page`; with regions of each, if the file tells of such.
pub fn index_page(
    section: &Section<'_>,
    page: u32,
    index: &mut Index,
    info: &Info,
    has_regions: bool,
) -> Vec<Vec<u16>> {
    let pages = index.pages.as_ref().expect("pages");
    let (length, sum, all) = &pages.all[page as usize];
    assert_eq!(section.range[1] - section.range[0], u64::from(*length));
    let mut bytes = section.payload;
    assert_eq!(bytes.varint(), page);
    let count = (index.count - (page << pages.bits)).min(1 << pages.bits);
    let blocks: Vec<BlockEntry> = (0..count).map(|_| block_entry(&mut bytes, info)).collect();
    let regions = (0..if has_regions { count } else { 0 }).map(|_| bytes.ascending()).collect();
    bytes.end();
    assert_eq!(
        blocks.iter().flat_map(|block| &block.lengths).map(|&length| u64::from(length)).sum::<u64>(),
        *sum
    );
    let union = |spans: &mut dyn Iterator<Item = [u64; 2]>| {
        spans.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]).expect("a block")
    };
    for axis in 0..3 {
        assert_eq!(union(&mut blocks.iter().map(|block| block.bounds[axis])), all.bounds[axis]);
    }
    for field in 0..info.fields.len() {
        let error = blocks.iter().map(|block| block.fields[field].0).max().expect("a block");
        let range = union(&mut blocks.iter().map(|block| block.fields[field].1));
        assert_eq!((error, range), all.fields[field]);
    }
    index.blocks.extend(blocks);
    regions
}

fn block_entry(bytes: &mut Bytes<'_>, info: &Info) -> BlockEntry {
    let lengths = (0..=info.fields.len()).map(|_| bytes.varint()).collect();
    entry(bytes, info, lengths)
}

fn entry(bytes: &mut Bytes<'_>, info: &Info, lengths: Vec<u32>) -> BlockEntry {
    let span = |bytes: &mut Bytes<'_>, bits: u32| {
        let (low, more) = (u64::from(bytes.varint()), u64::from(bytes.varint()));
        assert!(low + more <= 1 << bits.min(8));
        [low, low + more].map(|x| x << bits.saturating_sub(8))
    };
    let bounds = [0; 3].map(|_| span(bytes, info.bits));
    let fields = info.fields.iter().map(|field| {
        let error = bytes.u8();
        let code = if error == 255 { 65_535 } else { 256 * u16::from(error) };
        (code, span(bytes, field.bits))
    });
    let fields = fields.collect();
    assert_eq!(bytes.varint(), 0, "reserved");
    BlockEntry { lengths, bounds, fields }
}
