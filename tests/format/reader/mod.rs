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
mod regions;
pub mod splits;
pub mod wire;

use change::Change;
use coded::{BASE_LEVEL, Coded, ERROR, LEVEL, Table};
use exact::Exact;
use growth::Growth;
use half_edge::Forest;
use insertions::Start;
use splits::Split;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;
use wire::{Bytes, Index, Info, Section};

/// A file, decoded as far as that needs no mesh.
pub struct File {
    pub info: Info,
    /// Flag 0: updates tell errors of the tetrahedra that they remove.
    pub tet_errors: bool,
    /// In files of kind 3.
    pub index: Option<Index>,
    /// log2 of the updates of a block.
    pub block_bits: u32,
    /// By field; empty if there are none.
    pub histograms: Vec<Vec<u32>>,
    /// The box around the reference mesh, if it is stated.
    pub bounds: Option<[[i32; 3]; 2]>,
    pub regions: Option<regions::Regions>,
    tables: Vec<Table>,
    pub base: Growth,
    /// In files of kind 1.
    pub start: Option<Start>,
    /// In files of kind 3.
    pub forest: Option<Forest>,
    /// By field, then by vertex.
    pub base_levels: Vec<Vec<i32>>,
    /// By field those of base vertices in further regions, if it jumps.
    pub base_sides: Vec<BTreeMap<(u32, u16), i32>>,
    pub splits: HashMap<u32, Split>,
    /// In files of kind 0, for each block, by field, what no error of an update behind it is larger than.
    pub behind: Vec<Vec<u16>>,
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
    let mut info = wire::info(next(b"INFO").payload, file[12] & 8 == 8);
    let section = (info.kind == 3).then(|| next(b"INDX"));
    let in_pages = file[12] & 4 == 4;
    assert!(!in_pages || info.kind == 3);
    let mut index = section.map(|section| wire::index(section.payload, &info, in_pages));
    let histograms = histogram::find(front, &info);
    let place = |kind: &[u8; 4]| front.iter().position(|section| &section.kind == kind);
    let bounds = place(b"bbox").map(|at| {
        let before = [b"INFO", b"INDX", b"hist"].map(place).into_iter().max().expect("three places");
        assert!(before < Some(at) && Some(at) < place(b"MODL"));
        wire::bounds(front[at].payload, &info)
    });
    if let Some(at) = place(b"extr") {
        let before = [b"INFO", b"INDX", b"hist", b"bbox"].map(place).into_iter().max().expect("four places");
        assert!(before < Some(at) && Some(at) < place(b"MODL"));
        wire::extremes(front[at].payload, &mut info);
    }
    let has_sides = file[12] & 2 == 2;
    let pages = index.as_ref().and_then(|index| index.pages.as_ref()).map_or(0, |pages| pages.all.len());
    let lists = index.as_ref().map_or(0, |index| if in_pages { pages } else { index.blocks.len() });
    let mut regions = regions::find(front, &info, lists, has_sides);
    assert!(!has_sides || info.kind == 3 && regions.is_some());
    let tables = coded::tables(next(b"MODL").payload, info.kind);
    let mut payload = next(b"BASE").payload;
    let [vertices, tets] = [payload.varint(), payload.varint()];
    assert_eq!(vertices + info.updates, info.vertices);
    let block_bits = index.as_ref().map_or_else(|| u32::from(payload.u8()), |index| index.block_bits);
    assert!((4..=16).contains(&block_bits));
    let mut coded = Coded::new(payload, &tables);
    let base = growth::read(&mut coded, vertices as usize, tets as usize);
    let start = (info.kind == 1).then(|| insertions::start(&mut coded));
    let forest = (info.kind == 3).then(|| half_edge::forest(&mut coded, &info, block_bits, &base));
    coded.end();
    let jumps = |field: usize| regions.as_ref().is_some_and(|all| all.jumps.get(field) == Some(&true));
    let of_base = regions.as_ref().map_or(&[][..], |regions| &regions.of_base);
    let sides = half_edge::further_regions(&base.tets, of_base);
    let (mut base_levels, mut base_sides) = (Vec::new(), Vec::new());
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
        let own = if jumps(field) { half_edge::base_sides(&mut coded, &sides) } else { BTreeMap::new() };
        base_sides.push(own);
        coded.end();
    }
    let mut end_of_head = None;
    let mut end_of_pages = 0;
    if let Some(index) = index.as_mut().filter(|_| in_pages) {
        let of_pages = regions.as_mut().map(|regions| std::mem::take(&mut regions.of_blocks));
        for page in 0..pages {
            let section = next(b"IPAG");
            assert!(
                *end_of_head.get_or_insert(section.range[0]) == section.range[0]
                    || section.range[0] == end_of_pages
            );
            end_of_pages = section.range[1];
            let lists = wire::index_page(section, page as u32, index, &info, regions.is_some());
            if let (Some(regions), Some(of_pages)) = (&mut regions, &of_pages) {
                let all: BTreeSet<u16> = lists.iter().flatten().copied().collect();
                assert_eq!(of_pages[page], Vec::from_iter(all));
                regions.of_blocks.extend(lists);
            }
        }
    }
    let mut parts_of = Parts::new();
    let mut blocks: Vec<Range<usize>> = Vec::new();
    let kind = match info.kind {
        0 => b"UPDT",
        1 => b"INSV",
        _ => b"HALF",
    };
    let count = if info.kind == 3 { 1 + info.fields.len() as u32 } else { 1 };
    for block in 0..info.updates.div_ceil(1 << block_bits) {
        let (mut parts, mut lengths) = (Vec::new(), Vec::new());
        for part in 0..count {
            let section = next(if part == 0 { kind } else { b"FLDU" });
            let [start, end] = section.range;
            match blocks.get_mut(block as usize) {
                None => blocks.push(start as usize..end as usize),
                Some(range) => {
                    assert_eq!(range.end, start as usize);
                    range.end = end as usize;
                }
            }
            lengths.push((end - start) as u32);
            let mut payload = section.payload;
            assert_eq!(payload.varint(), block);
            assert!(part == 0 || payload.varint() == part - 1);
            parts.push(payload);
        }
        assert!(index.as_ref().is_none_or(|index| index.blocks[block as usize].lengths == lengths));
        parts_of.push(parts);
    }
    if let (Some(index), Some(section), Some(first)) = (&index, section, blocks.first()) {
        assert_eq!(section.range[1] + index.between, end_of_head.unwrap_or(first.start as u64));
        assert!(!in_pages || end_of_pages == first.start as u64);
    }
    assert!(known.next().is_none());
    let values = front.iter().filter(|section| &section.kind == b"fldx");
    let exact = exact::joined(values.map(|section| exact::read(section.payload, &tables)));
    assert!(exact.windows(2).all(|pair| pair[0].field < pair[1].field));
    check_end(end, front, &info);
    let splits = HashMap::new();
    let tet_errors = file[12] & 1 == 1;
    assert!(!tet_errors || info.kind == 1);
    (
        File {
            info,
            tet_errors,
            index,
            block_bits,
            histograms,
            bounds,
            regions,
            tables,
            base,
            start,
            forest,
            base_levels,
            base_sides,
            splits,
            behind: Vec::new(),
            exact,
            blocks,
        },
        parts_of,
    )
}

/// Reads a whole file of kind 0.
pub fn read(file: &[u8]) -> File {
    let (mut file, parts_of) = open(file);
    assert_eq!(file.info.kind, 0, "a file of another kind");
    (0..).zip(parts_of).for_each(|(block, parts)| file.read_block(block, parts[0]));
    file
}

/// Reads the blocks of a file of kind 1 or 3: the updates in order.
pub fn changes(file: &File, parts: &Parts<'_>) -> Vec<Change> {
    let mut changes = Vec::new();
    if file.info.kind == 3 {
        let mut mesh = half_edge_mesh::Mesh::new(file);
        for block in 0..parts.len() as u32 {
            mesh.add_block(half_edge::block(file, block, &parts[block as usize]));
            changes.extend(file.updates(block).map(|k| mesh.apply(k)));
        }
        return changes;
    }
    assert_eq!(file.info.kind, 1);
    let (mut mesh, mut behind) = (insertions::Mesh::new(file), Vec::new());
    for (block, parts) in (0..).zip(parts) {
        let mut coded = Coded::new(parts[0], &file.tables);
        behind.push(bounds(&mut coded, file.info.fields.len()));
        changes.extend(file.updates(block).map(|_| mesh.update(&mut coded)));
        coded.end();
    }
    for (block, bounds) in (0..).zip(behind) {
        for change in &changes[file.updates(block).end as usize..] {
            assert!(change.errors.iter().zip(&bounds).all(|(error, bound)| error <= bound));
        }
    }
    changes
}

/// By field, what no error of an update behind a block is larger than.
fn bounds(coded: &mut Coded<'_>, fields: usize) -> Vec<u16> {
    let bound = |upper| if upper == 255 { u16::MAX } else { 256 * upper as u16 };
    (0..fields).map(|_| bound(coded.bits(8))).collect()
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
    /// Whether a field jumps between regions.
    pub fn jumps(&self, field: usize) -> bool {
        self.regions.as_ref().is_some_and(|regions| regions.jumps.get(field) == Some(&true))
    }

    /// The block of an update.
    pub fn block_of(&self, k: u32) -> u32 {
        k >> self.block_bits
    }

    /// Contexts and symbols that occur in them.
    pub fn symbols(&self) -> BTreeSet<(u32, u32)> {
        let of_context = |(context, table): (u32, &Table)| {
            table.iter().map(move |&(symbol, _)| (context, symbol)).collect::<Vec<_>>()
        };
        (0..).zip(&self.tables).flat_map(of_context).collect()
    }

    /// The updates of a block.
    pub fn updates(&self, block: u32) -> Range<u32> {
        let size = 1_u32 << self.block_bits;
        block * size..self.info.updates.min((block + 1) * size)
    }

    /// Decodes the next block of a file of kind 0.
    fn read_block(&mut self, block: u32, payload: Bytes<'_>) {
        let updates = self.updates(block);
        let mut coded = Coded::new(payload, &self.tables);
        let fields = self.info.fields.len();
        self.behind.push(bounds(&mut coded, fields));
        let mut splits =
            splits::shared(&mut coded, self.base.positions.len() as u32, updates.clone(), &self.splits);
        for _ in 0..fields {
            let changes = splits::field(&mut coded, updates.len(), [ERROR, LEVEL]);
            for (split, (error, residual)) in splits.iter_mut().zip(changes) {
                split.errors.push(error);
                split.residuals.push(residual);
            }
        }
        coded.end();
        self.splits.extend(updates.zip(splits));
    }
}
