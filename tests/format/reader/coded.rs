//! Symbols and plain bits.

use super::wire::Bytes;

/// Plain bits.
pub struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Bits<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    pub fn take(&mut self, count: u32) -> u32 {
        let mut number = 0;
        for i in 0..count {
            number |= u32::from(self.bytes[self.at / 8] >> (self.at % 8) & 1) << i;
            self.at += 1;
        }
        number
    }

    fn gamma(&mut self) -> u32 {
        let mut k = 0;
        while self.take(1) == 0 {
            k += 1;
            assert!(k <= 16);
        }
        (1 << k) + self.take(k) - 1
    }

    pub fn end(mut self) {
        assert_eq!(self.at.div_ceil(8), self.bytes.len(), "bytes are left over");
        while self.at < 8 * self.bytes.len() {
            assert_eq!(self.take(1), 0);
        }
    }
}

/// A row of the table of contexts.
#[derive(Clone, Copy)]
pub struct Row {
    first: u32,
    contexts: u32,
    letters: u32,
    /// `K` of numbers.
    kept: u32,
}

const fn symbols(first: u32, contexts: u32, letters: u32) -> Row {
    Row { first, contexts, letters, kept: 0 }
}

const fn numbers(first: u32, contexts: u32, kept: u32) -> Row {
    Row { first, contexts, letters: (33 - kept) << kept, kept }
}

pub const BEHIND: Row = symbols(0, 24, 6);
pub const SEED: Row = symbols(24, 1, 2);
pub const LENGTH: Row = symbols(25, 2, 66);
pub const STEP: Row = numbers(27, 1, 0);
pub const RANK: Row = numbers(28, 1, 2);
pub const GAP: Row = numbers(29, 1, 1);
pub const RUN: Row = numbers(30, 1, 3);
pub const CHILDREN: Row = symbols(31, 1, 4);
pub const RISE: Row = numbers(32, 1, 3);
pub const EDGE: Row = numbers(33, 3, 3);
pub const OFFSET: Row = numbers(36, 68, 2);
pub const LAST_WRONG: Row = symbols(104, 1, 65);
pub const WRONG: Row = symbols(105, 132, 2);
pub const ERROR: Row = symbols(237, 16, 256);
pub const LEVEL: Row = numbers(253, 128, 1);
pub const BASE_LEVEL: Row = numbers(381, 1, 2);
pub const VALUE_GAP: Row = numbers(382, 1, 1);
pub const VALUE_BITS: Row = symbols(383, 2, 65);
/// In files with flag 0.
pub const QUARTERS: Row = symbols(385, 8, 4);
pub const OWN_FALL: Row = symbols(393, 1, 256);

/// In the place of those from `GAP` to `LEVEL`, in files of kind 1.
pub const FALL: Row = numbers(29, 1, 2);
pub const FAN: Row = symbols(30, 1, 2);
pub const DISTANCE: Row = symbols(31, 4, 112);
pub const SEED_PLACE: Row = symbols(35, 1, 9);
pub const GROW: Row = symbols(36, 108, 2);
pub const GIVEN_UP: Row = symbols(144, 1, 2);
pub const FAR: Row = symbols(145, 20, 2);
pub const SHORT: Row = numbers(165, 1, 0);
pub const INSERTION_LEVEL: Row = numbers(166, 40, 1);

/// In their place in files of kind 3.
pub const REMOVER: Row = numbers(29, 1, 1);
pub const BASE_INNER: Row = symbols(30, 1, 16);
pub const FOREST_CHILDREN: Row = numbers(31, 1, 2);
pub const NAMED: Row = numbers(32, 1, 2);
pub const NEW_BLOCK: Row = numbers(33, 1, 1);
pub const CHILD_GAP: Row = numbers(34, 1, 2);
pub const CHILD_OFFSET: Row = numbers(35, 66, 2);
pub const STAR_SYMBOLS: Row = symbols(101, 1, 256);
pub const STAR_SYMBOL: Row = symbols(102, 64, 16);
pub const STAR_BITS: Row = numbers(166, 1, 4);
pub const STAR_BIT: Row = symbols(167, 64, 2);
pub const HALF_EDGE_ERROR: Row = symbols(231, 16, 256);
pub const HALF_EDGE_LEVEL: Row = numbers(247, 128, 1);
/// In files with flag 1.
pub const HALF_EDGE_SIDES: Row = numbers(375, 2, 2);
pub const HALF_EDGE_SIDE: Row = numbers(377, 2, 1);

const OF_ALL: [Row; 10] =
    [BEHIND, SEED, LENGTH, STEP, RANK, BASE_LEVEL, VALUE_GAP, VALUE_BITS, QUARTERS, OWN_FALL];
const OF_SPLITS: [Row; 10] = [GAP, RUN, CHILDREN, RISE, EDGE, OFFSET, LAST_WRONG, WRONG, ERROR, LEVEL];
const OF_INSERTIONS: [Row; 9] =
    [FALL, FAN, DISTANCE, SEED_PLACE, GROW, GIVEN_UP, FAR, SHORT, INSERTION_LEVEL];

const OF_HALF_EDGES: [Row; 15] = [
    REMOVER,
    BASE_INNER,
    FOREST_CHILDREN,
    NAMED,
    NEW_BLOCK,
    CHILD_GAP,
    CHILD_OFFSET,
    STAR_SYMBOLS,
    STAR_SYMBOL,
    STAR_BITS,
    STAR_BIT,
    HALF_EDGE_ERROR,
    HALF_EDGE_LEVEL,
    HALF_EDGE_SIDES,
    HALF_EDGE_SIDE,
];

/// Symbols with their shares.
pub type Table = Vec<(u32, u32)>;

/// Reads the tables of all contexts of a file of a kind.
pub fn tables(mut bytes: Bytes<'_>, kind: u8) -> Vec<Table> {
    let count = bytes.varint();
    assert!(count <= OWN_FALL.first + OWN_FALL.contexts);
    let mut bits = Bits::new(bytes.0);
    let of_kind = match kind {
        0 => OF_SPLITS.iter(),
        1 => OF_INSERTIONS.iter(),
        _ => OF_HALF_EDGES.iter(),
    };
    let rows = OF_ALL.iter().chain(of_kind);
    let tables = (0..count).map(|context| {
        let row = rows.clone().find(|row| (row.first..row.first + row.contexts).contains(&context));
        table(&mut bits, row.map_or(0, |row| row.letters))
    });
    let tables = tables.collect();
    bits.end();
    tables
}

fn table(bits: &mut Bits<'_>, letters: u32) -> Table {
    let mut table = Table::new();
    let (count, mut next, mut left) = (bits.gamma(), 0, 4096);
    for i in 0..count {
        let symbol = next + bits.gamma();
        let share = if i + 1 < count { 1 + bits.gamma() } else { left };
        assert!(symbol < letters && 1 <= share && share <= left);
        table.push((symbol, share));
        (next, left) = (symbol + 1, left - share);
    }
    table
}

/// Coded content.
pub struct Coded<'a> {
    tables: &'a [Table],
    words: Vec<u16>,
    state: u64,
    bits: Bits<'a>,
}

impl<'a> Coded<'a> {
    pub fn new(mut bytes: Bytes<'a>, tables: &'a [Table]) -> Self {
        let count = bytes.varint();
        let mut words: Vec<u16> = (0..count).map(|_| bytes.u16()).collect();
        assert_ne!(words.last(), Some(&0));
        let mut state = words.pop().map_or(0, u64::from);
        if let Some(word) = words.pop() {
            state = state << 16 | u64::from(word);
        }
        Self { tables, words, state, bits: Bits::new(bytes.0) }
    }

    pub fn bits(&mut self, count: u32) -> u32 {
        self.bits.take(count)
    }

    pub fn symbol(&mut self, row: Row, which: u32) -> u32 {
        let context = row.first + which.min(row.contexts - 1);
        let table = &self.tables[context as usize];
        assert!(!table.is_empty(), "no table for a symbol");
        if let [(symbol, _)] = table[..] {
            return symbol;
        }
        let q = self.state % 4096;
        let mut start = 0;
        for &(symbol, share) in table {
            let share = u64::from(share);
            if q < start + share {
                self.state = self.state / 4096 * share + q - start;
                if let Some(word) = self.words.pop_if(|_| self.state < 1 << 16) {
                    self.state = self.state << 16 | u64::from(word);
                }
                return symbol;
            }
            start += share;
        }
        panic!("the shares do not add up");
    }

    pub fn number(&mut self, row: Row, which: u32) -> u32 {
        let symbol = self.symbol(row, which);
        let whole = 1 << row.kept;
        if symbol < whole {
            return symbol;
        }
        let n = symbol / whole - 1;
        ((whole + symbol % whole) << n) + self.bits(n)
    }

    pub fn signed(&mut self, row: Row, which: u32) -> i32 {
        let size = i32::try_from(self.number(row, which)).expect("31 bits");
        if size != 0 && self.bits(1) == 1 { -size } else { size }
    }

    /// A number below `n`, in plain bits.
    pub fn one_of(&mut self, n: u32) -> u32 {
        let m = n.max(1);
        let w = len(m) - 1;
        let s = (2 << w) - m;
        let x = self.bits(w);
        let x = if x < s { x } else { 2 * x + self.bits(1) - s };
        assert!(x < n);
        x
    }

    pub fn end(self) {
        assert_eq!(self.state, 0);
        assert!(self.words.is_empty());
        self.bits.end();
    }
}

/// The number of bits that a number takes.
pub fn len(n: u32) -> u32 {
    (0..33).find(|&bits| u64::from(n) < 1 << bits).expect("32 bits")
}
