//! The fixed parts of a file: its header and the heads of its sections.

use super::{FormatError, checksum};

/// First bytes of every MT file. The high bit, CR LF and Ctrl-Z show transfers that meddle with text.
pub const MAGIC: [u8; 8] = *b"\x89TLOD\r\n\x1a";
/// The version of the format: the only one that is written and read.
const VERSION: u16 = 2;
/// Bytes of the file header.
pub const HEADER_BYTES: usize = 32;
/// Bytes of a section's head.
pub const HEAD_BYTES: usize = 12;
/// Bytes of the `ENDF` section, head included.
pub const END_BYTES: usize = HEAD_BYTES + 12;
/// Flags that a reader must know.
const CRITICAL_FLAGS: u32 = 0xFFFF;
/// Of these: updates contain errors of the tetrahedra that they remove.
const TET_ERRORS: u32 = 1;
/// And: vertices have values for each region.
const SIDES: u32 = 1 << 1;
/// And: the index is in pages.
const INDEX_PAGES: u32 = 1 << 2;
/// And: there are so many tetrahedra that their number has 64 bits.
const MANY_TETS: u32 = 1 << 3;
/// A hint in files without an index: exact values stand behind the updates.
const EXACT: u32 = 1 << 16;

/// What is in a header.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Start {
    /// Bytes of the whole file, if the writer knew.
    pub total: Option<u64>,
    /// Whether updates contain errors of the tetrahedra that they remove.
    pub tet_errors: bool,
    /// Whether vertices have values for each region, as `regn` then says of which fields.
    pub sides: bool,
    /// Whether the index is in pages, each a section of its own.
    pub index_pages: bool,
    /// Whether the number of tetrahedra has 64 bits: more than a file without could state.
    pub many_tets: bool,
    /// Whether exact values stand behind the updates, as far as the header says so: it does where there is no index.
    pub exact: bool,
}

/// A header.
pub fn header(start: Start) -> [u8; HEADER_BYTES] {
    let flag = |is_set: bool, flag: u32| if is_set { flag } else { 0 };
    let of_updates = flag(start.tet_errors, TET_ERRORS) | flag(start.sides, SIDES);
    let critical = of_updates | flag(start.index_pages, INDEX_PAGES) | flag(start.many_tets, MANY_TETS);
    let flags = critical | flag(start.exact, EXACT);
    let mut bytes = [0; HEADER_BYTES];
    bytes[..8].copy_from_slice(&MAGIC);
    bytes[8..10].copy_from_slice(&VERSION.to_le_bytes());
    bytes[12..16].copy_from_slice(&flags.to_le_bytes());
    bytes[16..24].copy_from_slice(&start.total.unwrap_or(0).to_le_bytes());
    let crc = checksum::hash(&bytes[..28]);
    bytes[28..].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// Whether `bytes`, the first of a stream (perhaps not all of them yet), can begin an MT file.
pub fn may_be_mt(bytes: &[u8]) -> bool {
    bytes.iter().zip(&MAGIC).all(|(a, b)| a == b)
}

/// Reads a header.
pub fn parse_header(bytes: &[u8; HEADER_BYTES]) -> Result<Start, FormatError> {
    if !may_be_mt(bytes) {
        return Err(FormatError::NotMt);
    }
    let u32_at = |i: usize| u32_of(&bytes[i..]);
    if u32_at(28) != checksum::hash(&bytes[..28]) {
        return Err(FormatError::Corrupt { offset: 0, what: "the checksum of the header does not match" });
    }
    let found = u16::from_le_bytes([bytes[8], bytes[9]]);
    if found != VERSION {
        return Err(FormatError::UnsupportedVersion { found, supported: VERSION });
    }
    let flags = u32_at(12);
    if flags & CRITICAL_FLAGS & !(TET_ERRORS | SIDES | INDEX_PAGES | MANY_TETS) != 0 {
        return Err(FormatError::UnsupportedFeature {
            offset: 12,
            what: "a flag that this reader does not know",
        });
    }
    let total = u64::from(u32_at(16)) | u64::from(u32_at(20)) << 32;
    Ok(Start {
        total: (total != 0).then_some(total),
        tet_errors: flags & TET_ERRORS != 0,
        sides: flags & SIDES != 0,
        index_pages: flags & INDEX_PAGES != 0,
        many_tets: flags & MANY_TETS != 0,
        exact: flags & EXACT != 0,
    })
}

/// How many bytes a file has, if its first ones are a header that says so.
pub fn stated_bytes(start: &[u8]) -> Option<u64> {
    parse_header(start.first_chunk()?).ok()?.total
}

/// The first four bytes as a number. The callers have them.
fn u32_of(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

/// What a section is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind(pub [u8; 4]);

impl Kind {
    pub const INFO: Self = Self(*b"INFO");
    pub const INDX: Self = Self(*b"INDX");
    /// Histograms of the fields: those who do not know it do without.
    pub const HIST: Self = Self(*b"hist");
    /// The box around the reference mesh: those who do not know it take a larger one.
    pub const BOUNDS: Self = Self(*b"bbox");
    /// The extremes of the fields: those who do not know it do without.
    pub const EXTREMES: Self = Self(*b"extr");
    /// Regions of the volume: those who do not know it do without.
    pub const REGIONS: Self = Self(*b"regn");
    pub const MODL: Self = Self(*b"MODL");
    pub const BASE: Self = Self(*b"BASE");
    pub const FLDB: Self = Self(*b"FLDB");
    /// A page of the index.
    pub const IPAG: Self = Self(*b"IPAG");
    pub const FLDU: Self = Self(*b"FLDU");
    pub const UPDT: Self = Self(*b"UPDT");
    pub const INSV: Self = Self(*b"INSV");
    pub const HALF: Self = Self(*b"HALF");
    /// Exact values: those who do not know it do without.
    pub const EXACT: Self = Self(*b"fldx");
    pub const ENDF: Self = Self(*b"ENDF");

    /// Whether this reader knows what is in the section.
    pub fn is_known(self) -> bool {
        let front = [Self::INFO, Self::INDX, Self::HIST, Self::BOUNDS, Self::EXTREMES, Self::REGIONS];
        let head = [Self::MODL, Self::BASE, Self::FLDB, Self::IPAG];
        let blocks = [Self::UPDT, Self::HALF, Self::FLDU, Self::INSV, Self::EXACT, Self::ENDF];
        front.contains(&self) || head.contains(&self) || blocks.contains(&self)
    }

    /// Whether a reader that does not know the kind may skip the section.
    pub fn is_skippable(self) -> bool {
        self.0[0] & 0x20 != 0
    }
}

/// The head of a section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SectionHead {
    pub kind: Kind,
    pub length: u32,
    pub crc: u32,
}

impl SectionHead {
    /// The head for a payload.
    pub fn new(kind: Kind, payload: &[u8]) -> Self {
        // Writers check lengths before they come here.
        let mut head = Self { kind, length: payload.len() as u32, crc: 0 };
        let mut hasher = head.hasher();
        hasher.update(payload);
        head.crc = hasher.finalize();
        head
    }

    pub fn parse(bytes: &[u8; HEAD_BYTES]) -> Self {
        Self {
            kind: Kind([bytes[0], bytes[1], bytes[2], bytes[3]]),
            length: u32_of(&bytes[4..]),
            crc: u32_of(&bytes[8..]),
        }
    }

    pub fn to_bytes(self) -> [u8; HEAD_BYTES] {
        let mut bytes = [0; HEAD_BYTES];
        bytes[..4].copy_from_slice(&self.kind.0);
        bytes[4..8].copy_from_slice(&self.length.to_le_bytes());
        bytes[8..].copy_from_slice(&self.crc.to_le_bytes());
        bytes
    }

    /// A checksum that has taken in kind and length and waits for the payload.
    pub fn hasher(&self) -> checksum::Hasher {
        let mut hasher = checksum::Hasher::new();
        hasher.update(&self.to_bytes()[..8]);
        hasher
    }
}
