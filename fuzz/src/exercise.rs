//! What each fuzz target does with its input. The tests of regressions do the same: see `tests/format/regressions.rs`.
//!
//! Nothing here may panic but for a bug: errors are answers, too. Where an input begins with a script, its bytes say what to
//! do when; the file follows.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
use tetralod::format::{DecodeOptions, Decoder, Index, Limits};
use tetralod::geom::Bounds;
use tetralod::mt::{MtInfo, MultiTessellation, UpdatePages};
use tetralod::refine::{Front, LodCriterion, Need, Request};
use tetralod::session::Session;
use tetralod_io as io;

/// Bytes of a script.
pub const SCRIPT: usize = 16;
/// Bytes in front of the first section, and of the head of each.
const HEADER: usize = 32;
const HEAD: usize = 12;

/// Small enough for many runs a second.
fn limits() -> Limits {
    Limits { section_bytes: 1 << 20, memory_bytes: 16 << 20 }
}

/// Does with an input what the target of this name does; false if there is none.
pub fn run(target: &str, input: &[u8]) -> bool {
    match target {
        "decode" => decode(input),
        "decode_fixed" => decode_fixed(input),
        "index" => index(input),
        "refine" => refine(input),
        "import" => import(input),
        "folder" => folder(input),
        "hdf5" => hdf5(input),
        _ => return false,
    }
    true
}

fn with_script(input: &[u8]) -> Option<(&[u8; SCRIPT], &[u8])> {
    input.split_first_chunk::<SCRIPT>()
}

/// Bytes in pieces as the script says, to a decoder.
pub fn decode(input: &[u8]) {
    if let Some((script, file)) = with_script(input) {
        feed(script, file);
    }
}

/// The same behind good checksums.
pub fn decode_fixed(input: &[u8]) {
    if let Some((script, file)) = with_script(input) {
        feed(script, &repaired(file));
    }
}

fn feed(script: &[u8; SCRIPT], file: &[u8]) {
    let mut decoder = Decoder::new(DecodeOptions { limits: limits(), ..DecodeOptions::default() });
    let mut fed = Ok(());
    for piece in pieces(script, file) {
        let before = decoder.progress();
        fed = decoder.feed(piece).map(drop);
        let after = decoder.progress();
        assert!(after.updates >= before.updates && after.bytes >= before.bytes);
        if fed.is_err() {
            assert_eq!(decoder.feed(piece).map(drop), fed);
            break;
        }
    }
    let mut whole = Decoder::new(DecodeOptions { limits: limits(), ..DecodeOptions::default() });
    assert_eq!(whole.feed(file).map(drop), fed, "pieces make a difference");
    assert_eq!(whole.finish(), decoder.finish());
    let present = |decoder: &Decoder| decoder.mt().map(|mt| mt.present());
    assert_eq!(present(&whole), present(&decoder));
}

/// Pieces of the lengths in the script, again and again.
fn pieces<'a>(script: &'a [u8; SCRIPT], mut file: &'a [u8]) -> impl Iterator<Item = &'a [u8]> {
    let mut lengths = script.iter().cycle();
    std::iter::from_fn(move || {
        let length = lengths.next().map_or(1, |&byte| 1 + usize::from(byte) * usize::from(byte) / 4);
        let (piece, rest) = file.split_at(length.min(file.len()));
        file = rest;
        (!piece.is_empty()).then_some(piece)
    })
}

/// Opens a file, takes its blocks in the order of the script, and refines while they come and go; then lets a session plan what it
/// needs of it.
pub fn index(input: &[u8]) {
    let Some((script, file)) = with_script(input) else { return };
    let file = repaired(file);
    come_and_go(script, &file);
    plan(script, &file);
}

fn come_and_go(script: &[u8; SCRIPT], file: &[u8]) {
    let mut decoder =
        Decoder::new(DecodeOptions { limits: limits(), in_parts: true, ..DecodeOptions::default() });
    for piece in file.chunks(64) {
        if decoder.feed(piece).is_err() {
            return;
        }
        if decoder.mt().is_some() {
            break;
        }
    }
    let Some(mut front) = decoder.mt().and_then(|mt| Front::new(mt).ok()) else { return };
    let blocks = decoder.index().map_or(0, Index::count);
    for (step, &byte) in script.iter().cycle().take(4 * SCRIPT).enumerate() {
        let block = (u32::from(byte) + step as u32 / SCRIPT as u32 * 5) % (blocks + 1);
        if byte & 0xC0 == 0xC0 {
            leave(&mut decoder, &mut front, block);
        } else {
            arrive(&mut decoder, &mut front, block, file);
        }
        let Some(mt) = decoder.mt() else { return };
        let criterion = LodCriterion::new(mt.info(), &request(byte, mt.info()));
        let _ = front.satisfy(mt, &criterion, Default::default());
        assert_eq!(front.mesh().check(), Ok(()));
    }
}

/// A session in parts that has little memory, is asked for something, and gets some of what it wants for that. Whatever the index says, what
/// it wants comes to an end, and nothing comes in vain.
fn plan(script: &[u8; SCRIPT], file: &[u8]) {
    let options = DecodeOptions { limits: limits(), ..DecodeOptions::default() };
    let mut session = Session::in_parts(options, u64::from(script[0]) << 10);
    for (at, &byte) in script.iter().cycle().take(2 * SCRIPT).enumerate() {
        for _ in 0..if at < SCRIPT { 1 + byte % 8 } else { u8::MAX } {
            let wanted = session.wanted();
            let Some(next) = wanted.get(usize::from(byte) % wanted.len().max(1)) else { break };
            let range = &next.range;
            assert!(range.start < range.end);
            if session.take(range, part(file, range)).is_err() {
                break;
            }
            assert!(
                session.wanted().iter().all(|wanted| wanted.range != *range),
                "what has come is not wanted again"
            );
        }
        ask(&mut session, byte);
        let progress = session.block_progress();
        assert!(progress.here <= progress.blocks && progress.needed <= progress.blocks);
    }
}

/// The bytes of a range, as far as the file has them.
fn part<'a>(file: &'a [u8], range: &std::ops::Range<u64>) -> &'a [u8] {
    let place = |x: u64| usize::try_from(x).unwrap_or(usize::MAX).min(file.len());
    &file[place(range.start)..place(range.end)]
}

fn arrive(decoder: &mut Decoder, front: &mut Front, block: u32, file: &[u8]) {
    let page = decoder.index().map_or(0, |index| index.page_of(block));
    if let Some(range) = decoder.index_page_range(page) {
        // It may be here, or damaged.
        let _ = decoder.take_index_page(page, part(file, &range));
    }
    let ranges = decoder.block_ranges(block);
    let bytes: Vec<u8> = ranges.iter().flat_map(|range| part(file, range)).copied().collect();
    let before = decoder.mt().map(|mt| mt.present());
    match decoder.take_block(block, &bytes) {
        Ok(()) => {
            if let Some(mt) = decoder.mt() {
                front.page_inserted(mt, block);
            }
        }
        Err(_) => assert_eq!(before, decoder.mt().map(|mt| mt.present()), "nothing changes"),
    }
}

fn leave(decoder: &mut Decoder, front: &mut Front, block: u32) {
    let Some(mt) = decoder.mt() else { return };
    if mt.has_page(block) && front.prepare_eviction(mt, block) {
        assert_eq!(decoder.drop_block(block), Ok(()), "it is here, and nothing needs it");
        if let Some(page) = decoder.index().map(|index| index.page_of(block)) {
            decoder.drop_index_page(page);
        }
    }
}

/// A request out of one byte.
fn request(byte: u8, info: &MtInfo) -> Request {
    let part = f64::from(byte & 0x1F) / 32.0;
    let side = |x: f64| [0, 1, 2].map(|i| info.lattice.origin[i] + x * info.lattice.step[i] * 1024.0);
    let value = info.fields[0].min + part * info.fields[0].range();
    match byte >> 5 & 3 {
        0 => Request::within(part * part * part),
        1 => Need::within(0.0).inside(Bounds { min: side(part / 2.0), max: side(part / 2.0 + 0.3) }).into(),
        2 => Need::within(0.01).around(0, &[value]).into(),
        _ => Request::within(0.0).at_most(100 * u32::from(byte & 0x1F)),
    }
}

/// A file in pieces to a session that is asked for something after each. Its mesh is valid at all times.
pub fn refine(input: &[u8]) {
    let Some((script, file)) = with_script(input) else { return };
    let file = repaired(file);
    let mut session = Session::with_options(DecodeOptions { limits: limits(), ..DecodeOptions::default() });
    let mut requests = script.iter().rev().cycle();
    for (at, piece) in pieces(script, &file).enumerate() {
        let went_on = session.feed(piece).is_ok();
        if at < 64 || !went_on {
            ask(&mut session, requests.next().copied().unwrap_or_default());
        }
        if !went_on {
            break;
        }
    }
    let _ = session.finish();
    script.iter().for_each(|&byte| ask(&mut session, byte));
}

fn ask(session: &mut Session, byte: u8) {
    let Some(request) = session.mesh().and(session.info()).map(|info| request(byte, info)) else { return };
    let _ = session.refine(&request);
    if let Some(mesh) = session.mesh() {
        assert_eq!(mesh.check(), Ok(()));
    }
}

/// A mesh in an exchange format, told by its content; of raw samples the sidecar up to a zero, then the samples.
pub fn import(input: &[u8]) {
    let options = io::ReadOptions { cells: io::CellData::Values, ..io::ReadOptions::default() };
    let _ = io::read_bytes_with("input", input, &options);
    let _ = io::survey("input", input);
    if let Some(at) = input.iter().position(|&byte| byte == 0) {
        let _ = io::read_raw("input.json", &input[..at], &input[at + 1..]);
    }
}

/// The most memory that reading by a path may take.
const MEMORY: u64 = 16 << 20;

/// Tetrahedra of a range of cells.
const TETS_OF_RANGE: u64 = 16;

/// What files are called that come together; the first one of an input is read.
pub const NAMES: [&str; 42] = [
    "a.nhdr",
    "a.nrrd",
    "a.mhd",
    "a.mha",
    "a.raw",
    "b.raw",
    "s0.raw",
    "s1.raw",
    "a.json",
    "a.pvd",
    "a.pvtu",
    "a.pvti",
    "a.pvtr",
    "a.pvts",
    "a.vtu",
    "b.vtu",
    "a.vti",
    "b.vti",
    "a.vtr",
    "a.vts",
    "a.vtk",
    "a.node",
    "a.ele",
    "a.face",
    "a.mesh",
    "a.sol",
    "a.meshb",
    "a.solb",
    "a.msh",
    "a.vtu.gz",
    "a.raw.gz",
    "sub/a.vtu",
    "a.e.2.0",
    "a.e.2.1",
    "a.zarr/zarr.json",
    "a.zarr/c/0/0/0",
    "a.zarr/c/0/0/1",
    "a.zarr/.zarray",
    "a.zarr/.zattrs",
    "a.zarr/0.0.0",
    "a.zarr/p/zarr.json",
    "a.zarr/p/c/0/0/0",
];

/// Files in a folder, and in memory: for each its number in [`NAMES`], its length in two bytes, and its content.
pub fn folder(input: &[u8]) {
    let folder = Folder::new();
    let (mut rest, mut first, mut in_memory) = (input, None, io::FilesInMemory::default());
    while let [number, low, high, content @ ..] = rest {
        let name = NAMES[usize::from(*number) % NAMES.len()];
        let length = usize::from(u16::from_le_bytes([*low, *high])).min(content.len());
        let path = folder.put(name, &content[..length]);
        in_memory.add(name, &content[..length]);
        first = first.or(Some(path));
        rest = &content[length..];
    }
    if let Some(path) = first {
        read_by_path(&path);
    }
    for step in in_memory.steps().unwrap_or_default().iter().take(3) {
        let _ = in_memory.survey(step, &io::MemoryLimit::of(MEMORY));
        let _ = in_memory.read(step, &options(0));
    }
}

/// A file in HDF5 or netCDF, by its path.
pub fn hdf5(input: &[u8]) {
    let folder = Folder::new();
    read_by_path(&folder.put("a.vtkhdf", input));
    let _ = io::survey("a.vtkhdf", input);
}

fn options(step: usize) -> io::ReadOptions {
    io::ReadOptions {
        cells: io::CellData::Values,
        memory: io::MemoryLimit::of(MEMORY),
        step,
        ..io::ReadOptions::default()
    }
}

/// Reads some of the steps that a file stands for, and its pieces or ranges of its cells, which together are the whole.
fn read_by_path(path: &Path) {
    for step in io::steps(path).unwrap_or_default().iter().take(3) {
        let _ = io::read_with(&step.path, &options(step.number));
    }
    let without_cells = io::ReadOptions { cells: io::CellData::Names, ..options(0) };
    let listed = io::Pieces::open(path, &options(0)).ok().flatten();
    let ranges = io::Pieces::open_ranges(path, &without_cells, Some(TETS_OF_RANGE)).ok().and_then(Result::ok);
    for pieces in listed.into_iter().chain(ranges) {
        let _ = pieces.counts();
        let mut tets = 0;
        let read = pieces.for_each(&mut |piece| {
            tets += piece.mesh.tets.len();
            Ok::<(), io::ReadError>(())
        });
        if let (Ok(()), Ok(whole)) = (read, io::read_with(path, &without_cells)) {
            assert_eq!(whole.tets.len(), tets, "pieces make a difference");
        }
    }
}

/// A folder of its own, as long as this lives.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let (process, number) = (std::process::id(), NUMBER.fetch_add(1, Relaxed));
        let path = std::env::temp_dir().join(format!("tetralod-fuzz-{process}-{number}"));
        fs::create_dir_all(&path).expect("a folder for temporary files");
        Self(path)
    }

    /// Writes a file; returns by which path it is read.
    fn put(&self, name: &str, content: &[u8]) -> PathBuf {
        let path = self.0.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder for temporary files");
        fs::write(&path, content).expect("a temporary file");
        // Zarr is read by its folder.
        if name.starts_with("a.zarr/") { self.0.join("a.zarr") } else { path }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A file with lengths and checksums put right, as far as it looks like one.
pub fn repaired(file: &[u8]) -> Vec<u8> {
    let mut bytes = file.to_vec();
    if bytes.len() < HEADER {
        return bytes;
    }
    let (mut at, mut sections, mut chain) = (HEADER, 0_u32, crc32fast::Hasher::new());
    let updates: [u8; 4] =
        bytes.get(HEADER + HEAD + 9..HEADER + HEAD + 13).map_or([0; 4], |x| [x[0], x[1], x[2], x[3]]);
    while at + HEAD <= bytes.len() {
        let is_end = bytes[at..at + 4] == *b"ENDF";
        let length =
            u32::from_le_bytes([bytes[at + 4], bytes[at + 5], bytes[at + 6], bytes[at + 7]]) as usize;
        let length = length.min(bytes.len() - at - HEAD);
        bytes[at + 4..at + 8].copy_from_slice(&(length as u32).to_le_bytes());
        let payload = at + HEAD;
        if is_end && length >= 12 {
            bytes[payload..payload + 4].copy_from_slice(&updates);
            bytes[payload + 4..payload + 8].copy_from_slice(&sections.to_le_bytes());
            bytes[payload + 8..payload + 12].copy_from_slice(&chain.clone().finalize().to_le_bytes());
        }
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(&bytes[at..at + 8]);
        hasher.update(&bytes[payload..payload + length]);
        let crc = hasher.finalize().to_le_bytes();
        bytes[at + 8..at + 12].copy_from_slice(&crc);
        chain.update(&crc);
        sections += 1;
        at = payload + length;
    }
    bytes[..10].copy_from_slice(b"\x89TLOD\r\n\x1a\x02\x00");
    bytes[12..16].fill(0);
    let total = bytes.len() as u64;
    bytes[16..24].copy_from_slice(&total.to_le_bytes());
    let crc = crc32fast::hash(&bytes[..28]).to_le_bytes();
    bytes[28..32].copy_from_slice(&crc);
    bytes
}
