//! Symbols and plain bits to bytes and back: what coded sections are made of.
//!
//! A symbol comes out of an alphabet in a *context*; each context has a table of how often each of its symbols occurs in
//! the whole file, in units of 2^-12. The tables are in the file (section `MODL`), so that every coded section can be read
//! by itself. Symbols are coded by an asymmetric numeral system (Duda 2013: `Stack` and `Unstack`),
//! the bits that no table can foretell stand beside them as they are.
//!
//! What is written is described once, to a [`Put`]: at first to [`Counts`], which makes the tables, then to a [`Writer`].

use super::read::Reader;
use super::{FormatError, write};

/// Bits of a probability.
const PRECISION: u32 = 12;
/// What the counts of a context add up to.
const WHOLE: u32 = 1 << PRECISION;

/// A row of contexts with one alphabet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Family {
    /// Number of the first context in the file.
    pub first: u32,
    pub contexts: u32,
    /// Letters of the alphabet.
    pub symbols: u32,
    /// For numbers: bits below the leading one that belong to the symbol.
    pub kept: u32,
}

impl Family {
    /// The family behind another one.
    pub const fn after(self, contexts: u32, symbols: u32) -> Self {
        Self { first: self.first + self.contexts, contexts, symbols, kept: 0 }
    }

    /// The family behind another one, for numbers of at most 32 bits.
    pub const fn numbers_after(self, contexts: u32, kept: u32) -> Self {
        let symbols = (33 - kept) << kept;
        Self { first: self.first + self.contexts, contexts, symbols, kept }
    }

    /// In front of the first one.
    pub const NONE: Self = Self { first: 0, contexts: 0, symbols: 0, kept: 0 };

    /// The number of one of its contexts; those beyond the last are the last.
    fn context(self, which: u32) -> usize {
        (self.first + which.min(self.contexts - 1)) as usize
    }
}

/// Where symbols and bits go.
pub trait Put {
    /// Puts a symbol of a context.
    fn symbol(&mut self, family: Family, which: u32, symbol: u32);

    /// Puts the low `width` bits of a number, at most 32.
    fn bits(&mut self, value: u32, width: u32);

    /// Puts a number: how long it is and its first bits as a symbol, the others as they are.
    fn number(&mut self, family: Family, which: u32, value: u32) {
        let (symbol, low) = split(family.kept, value);
        self.symbol(family, which, symbol);
        self.bits(value, low);
    }

    /// Puts a signed number: its size, and its sign if it has one.
    fn signed(&mut self, family: Family, which: u32, value: i32) {
        self.number(family, which, value.unsigned_abs());
        if value != 0 {
            self.bits(u32::from(value < 0), 1);
        }
    }
}

/// The symbol of a number, and how many of its low bits stand beside it.
fn split(kept: u32, value: u32) -> (u32, u32) {
    if value >> kept == 0 {
        return (value, 0);
    }
    let low = value.ilog2() - kept;
    (((low + 1) << kept) + (value >> low & ((1 << kept) - 1)), low)
}

/// How often each symbol of each context occurs.
#[derive(Debug, Default)]
pub struct Counts(Vec<Vec<u32>>);

impl Put for Counts {
    fn symbol(&mut self, family: Family, which: u32, symbol: u32) {
        let context = family.context(which);
        if context >= self.0.len() {
            self.0.resize_with(context + 1, Vec::new);
        }
        let counts = &mut self.0[context];
        if symbol as usize >= counts.len() {
            counts.resize(symbol as usize + 1, 0);
        }
        counts[symbol as usize] = counts[symbol as usize].saturating_add(1);
    }

    fn bits(&mut self, _: u32, _: u32) {}
}

impl Counts {
    /// Adds those of what was counted elsewhere.
    pub fn add(&mut self, other: &Self) {
        if other.0.len() > self.0.len() {
            self.0.resize_with(other.0.len(), Vec::new);
        }
        for (counts, others) in self.0.iter_mut().zip(&other.0) {
            if others.len() > counts.len() {
                counts.resize(others.len(), 0);
            }
            counts.iter_mut().zip(others).for_each(|(count, other)| *count = count.saturating_add(*other));
        }
    }
}

/// The symbols of one context with where the share of each begins; those that do not occur are left out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Table {
    symbols: Vec<u16>,
    /// One more than there are symbols; the last one is [`WHOLE`].
    starts: Vec<u16>,
    /// For each of [`GUIDES`] equal parts of the whole, the symbol at its beginning.
    guides: Vec<u16>,
}

/// Parts of the whole that a search starts from.
const GUIDES: usize = 64;

impl Table {
    /// Shares in proportion to counts, none of them zero that has a count.
    fn new(counts: &[u32]) -> Self {
        let total: u64 = counts.iter().map(|&count| u64::from(count)).sum();
        let used = (0..).zip(counts).filter(|(_, count)| **count > 0);
        let mut shares: Vec<(u16, u32)> = used
            .map(|(symbol, &count)| {
                let share = u64::from(count) * u64::from(WHOLE) / total;
                (symbol, (share as u32).max(1))
            })
            .collect();
        // The largest share takes what rounding leaves over, and gives what is missing.
        loop {
            let sum: u32 = shares.iter().map(|(_, share)| share).sum();
            let Some(largest) = shares.iter_mut().max_by_key(|(symbol, share)| (*share, !symbol)) else {
                break;
            };
            if sum <= WHOLE {
                largest.1 += WHOLE - sum;
                break;
            }
            largest.1 -= (sum - WHOLE).min(largest.1.div_ceil(2));
        }
        Self::of(&shares)
    }

    /// From shares that add up to the whole.
    fn of(shares: &[(u16, u32)]) -> Self {
        let mut table = Self { starts: vec![0], ..Self::default() };
        let mut end = 0;
        for &(symbol, share) in shares {
            table.symbols.push(symbol);
            end += share;
            table.starts.push(end as u16);
        }
        let mut at = 0;
        table.guides = (0..GUIDES)
            .map(|part| {
                let quantile = (part * (WHOLE as usize / GUIDES)) as u16;
                while at + 1 < table.symbols.len() && table.starts[at + 1] <= quantile {
                    at += 1;
                }
                at as u16
            })
            .collect();
        table
    }

    /// The only symbol, if there is just one: it needs no coding.
    fn sole_symbol(&self) -> Option<u32> {
        if self.symbols.len() == 1 { Some(u32::from(self.symbols[0])) } else { None }
    }

    /// The share of a symbol by its place.
    #[inline]
    fn share(&self, at: usize) -> Share {
        let [start, end] = [self.starts[at], self.starts[at + 1]].map(u32::from);
        Share { start, size: end - start }
    }

    /// The share of a symbol; none of one that does not occur.
    fn share_of(&self, symbol: u16) -> Option<Share> {
        self.symbols.binary_search(&symbol).ok().map(|at| self.share(at))
    }

    /// The place of the symbol whose share this part of the whole belongs to.
    #[inline]
    fn at(&self, part: u32) -> usize {
        let mut at = usize::from(self.guides[(part as usize * GUIDES) >> PRECISION]);
        while u32::from(self.starts[at + 1]) <= part {
            at += 1;
        }
        at
    }
}

/// The part of the whole that a symbol has: never nothing, and never all, since a sole symbol is not coded.
#[derive(Clone, Copy)]
struct Share {
    start: u32,
    size: u32,
}

/// Bits of a word of coded symbols.
const WORD: u32 = 16;

/// Symbols to words. It is a stack: what is to come out first goes in last.
#[derive(Default)]
struct Stack {
    state: u32,
    words: Vec<u16>,
}

impl Stack {
    fn push(&mut self, share: Share) {
        // Else the state would not fit into 32 bits.
        if self.state >> (u32::BITS - PRECISION) >= share.size {
            self.words.push(self.state as u16);
            self.state >>= WORD;
        }
        self.state = (self.state / share.size) << PRECISION | (share.start + self.state % share.size);
    }

    /// All words, the last one not zero.
    fn finish(mut self) -> Vec<u16> {
        while self.state > 0 {
            self.words.push(self.state as u16);
            self.state >>= WORD;
        }
        self.words
    }
}

/// Words to symbols, the inverse of [`Stack`]. The state is below 2^16 only where no words are left.
struct Unstack<'a> {
    state: u32,
    /// Those that are left, of two bytes each.
    words: &'a [u8],
}

impl<'a> Unstack<'a> {
    /// None if the last word is zero, which [`Stack::finish`] does not leave.
    fn new(words: &'a [u8]) -> Option<Self> {
        let mut coder = Self { state: 0, words };
        coder.fill();
        if coder.state == 0 && !words.is_empty() {
            return None;
        }
        coder.fill();
        Some(coder)
    }

    /// Takes a word into the state, if there is one.
    #[inline]
    fn fill(&mut self) {
        if let Some((words, word)) = self.words.split_last_chunk() {
            self.state = self.state << WORD | u32::from(u16::from_le_bytes(*word));
            self.words = words;
        }
    }

    /// The place of the next symbol in its table.
    #[inline]
    fn pop(&mut self, table: &Table) -> usize {
        let part = self.state & (WHOLE - 1);
        let at = table.at(part);
        let share = table.share(at);
        self.state = (self.state >> PRECISION) * share.size + part - share.start;
        if self.state >> WORD == 0 {
            self.fill();
        }
        at
    }

    fn is_at_end(&self) -> bool {
        self.state == 0 && self.words.is_empty()
    }
}

/// The tables of all contexts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Models(Vec<Table>);

impl Models {
    pub fn new(counts: &Counts) -> Self {
        Self(
            counts
                .0
                .iter()
                .map(|counts| if counts.is_empty() { Table::default() } else { Table::new(counts) })
                .collect(),
        )
    }

    /// Tables in which all symbols of each context are as frequent.
    pub fn even(families: impl Iterator<Item = Family>) -> Self {
        let mut tables = Vec::new();
        for family in families {
            let [first, contexts] = [family.first, family.contexts].map(|n| n as usize);
            tables.resize(tables.len().max(first + contexts), Table::default());
            tables[first..first + contexts].fill(Table::new(&vec![1; family.symbols as usize]));
        }
        Self(tables)
    }

    /// Appends the tables: for each context how many symbols it has, then each symbol as the distance from the one before, and
    /// its share but for the last one.
    pub fn write(&self, out: &mut Vec<u8>) {
        write::varint(out, self.0.len() as u64);
        let mut bits = BitWriter::default();
        for table in &self.0 {
            bits.gamma(table.symbols.len() as u32);
            let mut next = 0;
            for (at, &symbol) in table.symbols.iter().enumerate() {
                bits.gamma(u32::from(symbol) - next);
                next = u32::from(symbol) + 1;
                if at + 1 < table.symbols.len() {
                    bits.gamma(table.share(at).size - 1);
                }
            }
        }
        out.extend_from_slice(&bits.finish());
    }

    /// Reads the tables of `families`.
    pub fn read(mut reader: Reader<'_>, families: &[Family]) -> Result<Self, FormatError> {
        let count = reader.varint()?;
        let most = families.last().map_or(0, |last| last.first + last.contexts);
        if count > most {
            return Err(reader.corrupt("there are more contexts than are known"));
        }
        let mut bits = BitReader::new(reader.rest());
        let mut tables = Vec::new();
        for context in 0..count {
            let family = families.iter().find(|family| context < family.first + family.contexts);
            let table = Self::read_table(&mut bits, family.map_or(0, |family| family.symbols));
            tables.push(table.ok_or_else(|| reader.corrupt("a table of frequencies is damaged"))?);
        }
        if !bits.is_at_end() {
            return Err(reader.corrupt("bytes are left over behind the tables"));
        }
        Ok(Self(tables))
    }

    fn read_table(bits: &mut BitReader<'_>, alphabet: u32) -> Option<Table> {
        let count = bits.gamma()?;
        if count == 0 {
            return Some(Table::default());
        }
        let (mut shares, mut next, mut left) = (Vec::new(), 0_u32, WHOLE);
        for at in 0..count {
            let symbol = next.checked_add(bits.gamma()?)?;
            next = symbol + 1;
            let share = if at + 1 < count { bits.gamma()?.checked_add(1)? } else { left };
            left = left.checked_sub(share).filter(|_| share > 0)?;
            shares.push((u16::try_from(symbol).ok().filter(|_| symbol < alphabet)?, share));
        }
        (left == 0).then(|| Table::of(&shares))
    }
}

/// Adds up what coded symbols and bits take, by the context of the symbol that they belong to.
#[derive(Debug)]
pub struct Measure<'a> {
    models: &'a Models,
    /// In bits.
    costs: Vec<f64>,
    last: usize,
}

impl<'a> Measure<'a> {
    pub fn new(models: &'a Models) -> Self {
        Self { models, costs: vec![0.0; models.0.len()], last: 0 }
    }

    /// Bits that a family takes.
    pub fn bits_of(&self, family: Family) -> f64 {
        let range = family.first as usize..(family.first + family.contexts) as usize;
        self.costs
            .iter()
            .enumerate()
            .filter(|(context, _)| range.contains(context))
            .map(|(_, cost)| cost)
            .sum()
    }
}

impl Put for Measure<'_> {
    fn symbol(&mut self, family: Family, which: u32, symbol: u32) {
        self.last = family.context(which);
        let share = self.models.0[self.last].share_of(symbol as u16).map_or(WHOLE, |share| share.size);
        self.costs[self.last] += (f64::from(WHOLE) / f64::from(share)).log2();
    }

    fn bits(&mut self, _: u32, width: u32) {
        if let Some(cost) = self.costs.get_mut(self.last) {
            *cost += f64::from(width);
        }
    }
}

/// Writes a coded section: see [`Source`].
pub struct Writer<'a> {
    models: &'a Models,
    symbols: Vec<(u32, u16)>,
    bits: BitWriter,
}

impl Put for Writer<'_> {
    fn symbol(&mut self, family: Family, which: u32, symbol: u32) {
        self.symbols.push((family.context(which) as u32, symbol as u16));
    }

    fn bits(&mut self, value: u32, width: u32) {
        self.bits.push(value, width);
    }
}

impl<'a> Writer<'a> {
    /// A writer by tables that were made from the counts of all that is to be written.
    pub fn new(models: &'a Models) -> Self {
        Self { models, symbols: Vec::new(), bits: BitWriter::default() }
    }

    /// Appends all that was put.
    pub fn finish(self, out: &mut Vec<u8>) {
        let mut coder = Stack::default();
        for &(context, symbol) in self.symbols.iter().rev() {
            let table = &self.models.0[context as usize];
            if table.sole_symbol().is_none() {
                let share = table.share_of(symbol);
                debug_assert!(share.is_some(), "the tables were made from these symbols");
                share.into_iter().for_each(|share| coder.push(share));
            }
        }
        let words = coder.finish();
        write::varint(out, words.len() as u64);
        words.iter().for_each(|word| out.extend_from_slice(&word.to_le_bytes()));
        out.extend_from_slice(&self.bits.finish());
    }
}

/// Reads a coded section: the varint of how many 16-bit words there are, these words, then the plain bits.
pub struct Source<'a> {
    models: &'a Models,
    coder: Unstack<'a>,
    bits: BitReader<'a>,
    reader: Reader<'a>,
}

impl<'a> Source<'a> {
    pub fn new(mut reader: Reader<'a>, models: &'a Models) -> Result<Self, FormatError> {
        let count = reader.varint()?;
        let words = reader.bytes(count as usize, 2)?;
        let coder = Unstack::new(words).ok_or_else(|| reader.corrupt("coded symbols end with a zero"))?;
        let bits = BitReader::new(reader.rest());
        Ok(Self { models, coder, bits, reader })
    }

    /// An error in this section.
    pub fn corrupt(&self, what: &'static str) -> FormatError {
        self.reader.corrupt(what)
    }

    /// The next symbol.
    #[inline]
    pub fn symbol(&mut self, family: Family, which: u32) -> Result<u32, FormatError> {
        let Some(table) = self.models.0.get(family.context(which)).filter(|table| !table.symbols.is_empty())
        else {
            return Err(self.corrupt("a symbol has no table of frequencies"));
        };
        if let Some(only) = table.sole_symbol() {
            return Ok(only);
        }
        Ok(u32::from(table.symbols[self.coder.pop(table)]))
    }

    /// The next `width` bits, at most 32.
    #[inline]
    pub fn bits(&mut self, width: u32) -> Result<u32, FormatError> {
        match self.bits.take(width) {
            Some(value) => Ok(value),
            None => Err(self.corrupt("the section is shorter than its content")),
        }
    }

    /// A number, as [`Put::number`] puts it.
    #[inline]
    pub fn number(&mut self, family: Family, which: u32) -> Result<u32, FormatError> {
        let symbol = self.symbol(family, which)?;
        let kept = family.kept;
        if symbol >> kept == 0 {
            return Ok(symbol);
        }
        // Symbols are within their alphabet, so this has at most 32 bits.
        let low = (symbol >> kept) - 1;
        let top = (1 << kept) | (symbol & ((1 << kept) - 1));
        Ok(top << low | self.bits(low)?)
    }

    /// A signed number, as [`Put::signed`] puts it.
    #[inline]
    pub fn signed(&mut self, family: Family, which: u32) -> Result<i32, FormatError> {
        let size = self.number(family, which)?;
        if size == 0 {
            return Ok(0);
        }
        let size = i32::try_from(size).map_err(|_| self.corrupt("a number has more than 32 bits"))?;
        Ok(if self.bits(1)? == 0 { size } else { -size })
    }

    /// Everything must have been read.
    pub fn end(self) -> Result<(), FormatError> {
        if self.coder.is_at_end() && self.bits.is_at_end() {
            Ok(())
        } else {
            Err(self.corrupt("something is left over in a coded section"))
        }
    }
}

/// Bits to bytes, the least significant bit of a byte first.
#[derive(Debug, Default)]
struct BitWriter {
    bytes: Vec<u8>,
    /// Bits that do not fill a byte yet.
    open: u64,
    count: u32,
}

impl BitWriter {
    fn push(&mut self, value: u32, width: u32) {
        let value = u64::from(value) & ((1 << width) - 1);
        self.open |= value << self.count;
        self.count += width;
        while self.count >= 8 {
            self.bytes.push(self.open as u8);
            self.open >>= 8;
            self.count -= 8;
        }
    }

    /// A number in Elias' gamma code of one more (1975): as many zeros as `value + 1` has bits beyond the first, a one,
    /// these bits.
    fn gamma(&mut self, value: u32) {
        let low = (u64::from(value) + 1).ilog2();
        self.push(0, low);
        self.push(1, 1);
        self.push((value + 1) & ((1 << low) - 1), low);
    }

    fn finish(mut self) -> Vec<u8> {
        if self.count > 0 {
            self.bytes.push(self.open as u8);
        }
        self.bytes
    }
}

/// Bytes to bits.
#[derive(Debug)]
struct BitReader<'a> {
    bytes: &'a [u8],
    open: u64,
    count: u32,
}

impl<'a> BitReader<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, open: 0, count: 0 }
    }

    #[inline]
    fn take(&mut self, width: u32) -> Option<u32> {
        while self.count < width {
            if let Some((word, rest)) = self.bytes.split_first_chunk::<4>().filter(|_| self.count <= 32) {
                self.open |= u64::from(u32::from_le_bytes(*word)) << self.count;
                (self.bytes, self.count) = (rest, self.count + 32);
            } else {
                let (&byte, rest) = self.bytes.split_first()?;
                self.open |= u64::from(byte) << self.count;
                (self.bytes, self.count) = (rest, self.count + 8);
            }
        }
        let value = self.open & ((1 << width) - 1);
        self.open >>= width;
        self.count -= width;
        Some(value as u32)
    }

    /// The inverse of [`BitWriter::gamma`], for numbers below 2^16.
    fn gamma(&mut self) -> Option<u32> {
        let mut low = 0;
        while self.take(1)? == 0 {
            low += 1;
            if low > 16 {
                return None;
            }
        }
        Some((1 << low | self.take(low)?) - 1)
    }

    /// Whether nothing is left but zeros that fill a byte.
    fn is_at_end(&self) -> bool {
        self.bytes.is_empty() && self.count < 8 && self.open == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: Family = Family::NONE.after(2, 5);
    const NUMBERS: Family = SMALL.numbers_after(3, 2);
    const FAMILIES: [Family; 2] = [SMALL, NUMBERS];

    fn put(out: &mut impl Put, numbers: &[u32]) {
        for (i, &x) in (0..).zip(numbers) {
            out.symbol(SMALL, i % 2, x % 5);
            out.number(NUMBERS, x % 3, x);
            out.signed(NUMBERS, 2, (x as i32).max(-i32::MAX));
            out.bits(x, i % 33);
        }
    }

    fn numbers() -> Vec<u32> {
        let mut x = 0x9E37_79B9_7F4A_7C15_u64;
        (0..3000)
            .map(|i| {
                x ^= x << 7;
                x ^= x >> 9;
                (x >> 32) as u32 >> (i * 7 % 33).min(31)
            })
            .chain([0, u32::MAX, i32::MAX as u32])
            .collect()
    }

    #[test]
    fn all_comes_back_and_nothing_is_left_over() -> Result<(), FormatError> {
        let all = numbers();
        let mut counts = Counts::default();
        put(&mut counts, &all);
        let models = Models::new(&counts);
        let (mut tables, mut bytes) = (Vec::new(), Vec::new());
        models.write(&mut tables);
        let read = Models::read(Reader::new(&tables, 0), &FAMILIES)?;
        assert_eq!(read, models);
        let mut writer = Writer::new(&models);
        put(&mut writer, &all);
        writer.finish(&mut bytes);
        let mut source = Source::new(Reader::new(&bytes, 0), &read)?;
        for (i, &x) in (0..).zip(&all) {
            assert_eq!(source.symbol(SMALL, i % 2)?, x % 5);
            assert_eq!(source.number(NUMBERS, x % 3)?, x);
            assert_eq!(source.signed(NUMBERS, 2)?, (x as i32).max(-i32::MAX));
            assert_eq!(source.bits(i % 33)?, x & ((1_u64 << (i % 33)) - 1) as u32);
        }
        source.end()
    }

    #[test]
    fn what_is_cut_off_or_left_over_is_noticed() -> Result<(), FormatError> {
        let all = numbers();
        let mut counts = Counts::default();
        put(&mut counts, &all);
        let models = Models::new(&counts);
        let mut bytes = Vec::new();
        let mut writer = Writer::new(&models);
        put(&mut writer, &all[..10]);
        writer.finish(&mut bytes);
        // Not all symbols are read.
        let mut source = Source::new(Reader::new(&bytes, 0), &models)?;
        source.symbol(SMALL, 0)?;
        assert!(source.end().is_err());
        // There is a byte more than what was put takes.
        bytes.push(0);
        let mut source = Source::new(Reader::new(&bytes, 0), &models)?;
        for (i, &x) in (0..).zip(&all[..10]) {
            source.symbol(SMALL, i % 2)?;
            source.number(NUMBERS, x % 3)?;
            source.signed(NUMBERS, 2)?;
            source.bits(i % 33)?;
        }
        assert!(source.end().is_err());
        // Tables of other contexts, and such that do not add up.
        let mut tables = Vec::new();
        models.write(&mut tables);
        assert!(Models::read(Reader::new(&tables, 0), &FAMILIES[..1]).is_err());
        for cut in 0..tables.len() {
            assert!(Models::read(Reader::new(&tables[..cut], 0), &FAMILIES).is_err());
        }
        Ok(())
    }

    /// The bytes that the first files of this format were written with.
    #[test]
    fn bytes_stay_what_they_are() {
        let symbols = [0, 1, 1, 2, 1, 0, 1, 1, 1, 4, 1, 0];
        let words: [&[u8]; 13] = [
            &[0],
            &[0],
            &[1, 0x00, 0x10],
            &[1, 0x00, 0x20],
            &[1, 0x54, 0xA1],
            &[2, 0xA1, 0xD2, 0x02, 0x00],
            &[2, 0xA1, 0xD2, 0x02, 0x00],
            &[2, 0x1C, 0x51, 0x0F, 0x00],
            &[2, 0xDE, 0x70, 0x1F, 0x00],
            &[2, 0x4A, 0xA3, 0x2F, 0x00],
            &[2, 0x91, 0x52, 0x10, 0x01],
            &[2, 0xDB, 0xA0, 0x9C, 0x04],
            &[2, 0xDB, 0xA0, 0x9C, 0x04],
        ];
        let put_all = |out: &mut dyn FnMut(u32), count: usize| symbols[..count].iter().for_each(|&s| out(s));
        let mut counts = Counts::default();
        put_all(&mut |symbol| counts.symbol(SMALL, 0, symbol), symbols.len());
        let models = Models::new(&counts);
        let mut tables = Vec::new();
        models.write(&mut tables);
        assert_eq!(tables, [0x01, 0x2C, 0x00, 0x01, 0x08, 0x80, 0x56, 0x09, 0xB0, 0x4A]);
        for (count, expected) in words.iter().enumerate() {
            let mut writer = Writer::new(&models);
            put_all(&mut |symbol| writer.symbol(SMALL, 0, symbol), count);
            let mut bytes = Vec::new();
            writer.finish(&mut bytes);
            assert_eq!(bytes, *expected, "{count} symbols");
        }
        // Numbers, signs and bits of all sizes, by length and checksum.
        let all = numbers();
        let mut counts = Counts::default();
        put(&mut counts, &all);
        let models = Models::new(&counts);
        let mut tables = Vec::new();
        models.write(&mut tables);
        assert_eq!((tables.len(), crc32fast::hash(&tables)), (507, 0xB036_05C7));
        for (count, expected) in [
            (1, (13, 0x1E3B_4CD5)),
            (2, (20, 0x5A20_88C8)),
            (7, (51, 0x3842_33BE)),
            (100, (725, 0xA2CC_F13A)),
            (all.len(), (21_515, 0xE331_0601)),
        ] {
            let mut writer = Writer::new(&models);
            put(&mut writer, &all[..count]);
            let mut bytes = Vec::new();
            writer.finish(&mut bytes);
            assert_eq!((bytes.len(), crc32fast::hash(&bytes)), expected, "{count} numbers");
        }
    }

    /// Words that no writer makes are refused or read as symbols of the table, without a panic.
    #[test]
    fn any_words_give_symbols_or_errors() {
        let mut counts = Counts::default();
        [0, 1, 1, 4].iter().for_each(|&symbol| counts.symbol(SMALL, 0, symbol));
        let models = Models::new(&counts);
        for first in 0..=u16::MAX {
            let [low, high] = first.to_le_bytes();
            let bytes = [2, high, low, low, high];
            let Ok(mut source) = Source::new(Reader::new(&bytes, 0), &models) else {
                assert_eq!(first, 0, "only a last word of zero is refused");
                continue;
            };
            for _ in 0..20 {
                assert!(matches!(source.symbol(SMALL, 0), Ok(0 | 1 | 4)));
            }
        }
    }

    #[test]
    fn shares_follow_counts_and_add_up() {
        for counts in
            [vec![1], vec![1, 0, 1], vec![1_000_000, 1, 1], vec![1; 300], vec![u32::MAX, u32::MAX, 5]]
        {
            let table = Table::new(&counts);
            assert_eq!(u32::from(table.starts[table.symbols.len()]), WHOLE);
            assert_eq!(table.symbols.len(), counts.iter().filter(|count| **count > 0).count());
            assert!((0..table.symbols.len()).all(|at| table.starts[at] < table.starts[at + 1]));
        }
    }
}
