//! A slow, plain reader of MT files, written from `docs/format.md` alone. It uses nothing of the crate, and stops at whatever is
//! wrong.

pub mod change;
mod coded;
pub mod exact;
pub mod growth;
pub mod half_edge;
mod half_edge_guess;
pub mod half_edge_mesh;
mod histogram;
pub mod insertions;
pub mod plain;
pub mod spelled;
pub mod splits;
pub mod wire;

use change::Change;
use coded::{BASE_LEVEL, Coded, ERROR, LEVEL, Table};
use exact::Exact;
use growth::Growth;
use half_edge::Forest;
use insertions::Start;
use spelled::Spelled;
use splits::Split;
use std::collections::{BTreeSet, HashMap};
use std::ops::Range;
use wire::{Bytes, Index, Info, Section};

/// A file, decoded as far as that needs no mesh.
pub struct File {
    pub info: Info,
    /// Flag 0: updates tell errors of the tetrahedra that they remove.
    pub tet_errors: bool,
    pub index: Index,
    /// By field; empty if there are none.
    pub histograms: Vec<Vec<u32>>,
    /// The box around the reference mesh, if it is stated.
    pub bounds: Option<[[i32; 3]; 2]>,
    tables: Vec<Table>,
    pub base: Growth,
    /// In files of kind 1.
    pub start: Option<Start>,
    /// In files of kind 3.
    pub forest: Option<Forest>,
    /// By field, then by vertex.
    pub base_levels: Vec<Vec<i32>>,
    pub splits: HashMap<u32, Split>,
    pub exact: Vec<Exact>,
    /// Where each block is in the file.
    pub blocks: Vec<Range<usize>>,
}

/// The sections of each block.
pub type Parts<'a> = Vec<Vec<Bytes<'a>>>;

/// Reads a whole file but for what is in its blocks.
pub fn open(file: &[u8]) -> (File, Parts<'_>) {
    let sections = wire::sections(file);
    let (end, front) = sections.split_last().expect("sections");
    let mut known = front.iter().filter(|section| section.kind[0] & 0x20 == 0);
    let mut next = |kind: &[u8; 4]| {
        let section = known.next().expect("a section");
        assert_eq!(&section.kind, kind);
        section
    };
    let info = wire::info(next(b"INFO").payload);
    assert!(info.kind != 3 || file[8] == 3, "a kind of version 3");
    let section = next(b"INDX");
    let (index, index_end) = (wire::index(section.payload, &info), section.range[1]);
    let histograms = histogram::find(front, &info);
    assert!(histograms.is_empty() || file[10] > 0, "what minor version 1 adds");
    let place = |kind: &[u8; 4]| front.iter().position(|section| &section.kind == kind);
    let bounds = place(b"bbox").map(|at| {
        assert!(file[10] > 1, "what minor version 2 adds");
        assert!(place(b"hist").max(place(b"INDX")) < Some(at) && Some(at) < place(b"MODL"));
        wire::bounds(front[at].payload, &info)
    });
    let tables = coded::tables(next(b"MODL").payload, info.kind);
    let mut payload = next(b"BASE").payload;
    let [vertices, tets] = [payload.varint(), payload.varint()];
    assert!(info.kind == 2 || vertices + info.updates == info.vertices);
    let mut coded = Coded::new(payload, &tables);
    let base = growth::read(&mut coded, vertices as usize, tets as usize);
    let start = (info.kind == 1).then(|| insertions::start(&mut coded));
    let forest = (info.kind == 3).then(|| half_edge::forest(&mut coded, &info, index.block_bits, &base));
    coded.end();
    let mut base_levels = Vec::new();
    for field in 0..info.fields.len() {
        let mut payload = next(b"FLDB").payload;
        assert_eq!(payload.varint() as usize, field);
        let mut coded = Coded::new(payload, &tables);
        let mut level = 0;
        let levels = (0..vertices).map(|_| {
            level += coded.signed(BASE_LEVEL, 0);
            level
        });
        base_levels.push(levels.collect());
        coded.end();
    }
    let mut parts_of = Parts::new();
    let (mut at, mut blocks) = (index_end + index.between, Vec::new());
    let kind = [b"UPDT", b"INSV", b"EXPL", b"HALF"][usize::from(info.kind)];
    for (block, entry) in (0..).zip(&index.blocks) {
        let (start, mut parts) = (at as usize, Vec::new());
        for (part, length) in (0..).zip(&entry.lengths) {
            let section = next(if part == 0 { kind } else { b"FLDU" });
            assert_eq!(section.range, [at, at + u64::from(*length)]);
            at = section.range[1];
            let mut payload = section.payload;
            assert_eq!(payload.varint(), block);
            assert!(part == 0 || payload.varint() == part - 1);
            parts.push(payload);
        }
        parts_of.push(parts);
        blocks.push(start..at as usize);
    }
    assert!(known.next().is_none());
    let values = front.iter().filter(|section| &section.kind == b"fldx");
    let exact: Vec<Exact> = values.map(|section| exact::read(section.payload, &tables)).collect();
    assert!(exact.windows(2).all(|pair| pair[0].field < pair[1].field));
    check_end(end, front, &info);
    let splits = HashMap::new();
    let tet_errors = file[12] & 1 == 1;
    assert!(!tet_errors || [1, 2].contains(&info.kind));
    (
        File {
            info,
            tet_errors,
            index,
            histograms,
            bounds,
            tables,
            base,
            start,
            forest,
            base_levels,
            splits,
            exact,
            blocks,
        },
        parts_of,
    )
}

/// Reads a whole file of kind 0. Blocks are read in an order that `choose` makes of those that can be read next, given only
/// the blocks on which they depend.
pub fn read(file: &[u8], mut choose: impl FnMut(&[u32]) -> u32) -> File {
    let (mut file, parts_of) = open(file);
    assert_eq!(file.info.kind, 0, "a file of another kind");
    let mut left: BTreeSet<u32> = (0..parts_of.len() as u32).collect();
    let mut closures: HashMap<u32, BTreeSet<u32>> = HashMap::new();
    while !left.is_empty() {
        let is_ready =
            |block: &u32| file.index.blocks[*block as usize].parents.iter().all(|p| !left.contains(p));
        let ready: Vec<u32> = left.iter().copied().filter(is_ready).collect();
        let block = choose(&ready);
        assert!(left.remove(&block));
        let mut closure = BTreeSet::new();
        for parent in &file.index.blocks[block as usize].parents {
            closure.insert(*parent);
            closure.extend(&closures[parent]);
        }
        file.read_block(block, &parts_of[block as usize], &closure);
        closures.insert(block, closure);
    }
    file
}

/// Reads the blocks of a file of kind 1, 2 or 3: the updates in order.
pub fn changes(file: &File, parts: &Parts<'_>) -> Vec<Change> {
    let mut changes = Vec::new();
    if file.info.kind == 3 {
        let mut mesh = half_edge_mesh::Mesh::new(file);
        for block in 0..parts.len() as u32 {
            mesh.add_block(half_edge::block(file, block, &parts[block as usize]));
            changes.extend(file.index.updates(block, &file.info).map(|k| mesh.apply(k)));
        }
        return changes;
    }
    let mut each = |read: &mut dyn FnMut(&mut Coded<'_>, usize) -> Vec<Change>| {
        for (block, parts) in (0..).zip(parts) {
            let mut coded = Coded::new(parts[0], &file.tables);
            changes.extend(read(&mut coded, file.index.updates(block, &file.info).len()));
            coded.end();
        }
    };
    match file.info.kind {
        1 => {
            let mut mesh = insertions::Mesh::new(file);
            each(&mut |coded, updates| (0..updates).map(|_| mesh.update(coded)).collect());
        }
        2 => {
            let mut spelled = Spelled::new(file);
            each(&mut |coded, updates| spelled.block(coded, updates));
        }
        kind => panic!("a file of kind {kind}"),
    }
    changes
}

fn check_end(end: &Section<'_>, front: &[Section<'_>], info: &Info) {
    assert_eq!(&end.kind, b"ENDF");
    let mut payload = end.payload;
    assert_eq!(payload.u32(), info.updates);
    assert_eq!(payload.u32() as usize, front.len());
    let chain: Vec<u8> = front.iter().flat_map(|section| section.crc.to_le_bytes()).collect();
    assert_eq!(payload.u32(), wire::crc32(&chain));
    payload.end();
}

impl File {
    /// The block of an update.
    pub fn block_of(&self, k: u32) -> u32 {
        k >> self.index.block_bits
    }

    /// Contexts and symbols that occur in them.
    pub fn symbols(&self) -> BTreeSet<(u32, u32)> {
        let of_context = |(context, table): (u32, &Table)| {
            table.iter().map(move |&(symbol, _)| (context, symbol)).collect::<Vec<_>>()
        };
        (0..).zip(&self.tables).flat_map(of_context).collect()
    }

    /// Decodes a block knowing no more than what the index says it depends on.
    fn read_block(&mut self, block: u32, parts: &[Bytes<'_>], closure: &BTreeSet<u32>) {
        let updates = self.index.updates(block, &self.info);
        let is_known = |k: &u32| closure.contains(&(k >> self.index.block_bits));
        let known = self.splits.iter().filter(|(k, _)| is_known(k)).map(|(&k, split)| (k, split.clone()));
        let known = known.collect();
        let mut coded = Coded::new(parts[0], &self.tables);
        let mut splits =
            splits::shared(&mut coded, self.base.positions.len() as u32, updates.clone(), &known);
        coded.end();
        let rows = [ERROR, LEVEL];
        for part in &parts[1..] {
            let mut coded = Coded::new(*part, &self.tables);
            for (split, (error, residual)) in
                splits.iter_mut().zip(splits::field(&mut coded, updates.len(), rows))
            {
                split.errors.push(error);
                split.residuals.push(residual);
            }
            coded.end();
        }
        self.splits.extend(updates.zip(splits));
    }
}
