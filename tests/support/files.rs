//! MTs for the tests of the file format, made by code, and files taken apart and put together as the specification says.

use crate::support::builder::{Plan, build, mt_of_splits};
use crate::support::domains::Domain;
use std::collections::BTreeMap;
use std::sync::Mutex;
use tetralod::format::{DecodeOptions, Decoder, EncodeError, EncodeOptions, FormatError, Limits, encode};
use tetralod::geom::Lattice;
use tetralod::mesh::{Averaged, Difference, Extreme, Extremes, VectorPart};
use tetralod::mt::{
    Applied, ApplyUpdates, BaseMesh, CurrentMesh, EdgeMt, ErrorCode, ExplicitMt, ExplicitUpdate, FieldInfo,
    Mt, MtInfo, MtKind, MultiTessellation, UpdateId, VertexId, VertexSplit,
};

pub fn field(name: &str, bits: u32) -> FieldInfo {
    let largest = f64::from((1_u32 << bits) - 1);
    FieldInfo {
        name: name.to_owned(),
        min: -1.0,
        max: largest / 2.0 - 1.0,
        origin: -1.0,
        step: 0.5,
        bits,
        ..FieldInfo::default()
    }
}

/// Extremes at points, or at this cell and one beside it in a part of its own.
fn extremes(cell: Option<u32>) -> Extremes {
    let min = Extreme { value: -1.0, place: [0.5, -2.0, 1e-9], cell, part: None };
    let part = cell.map(|_| "Stück 2".to_owned());
    let max = Extreme { value: 3.25, place: [0.0, 1e7, -0.125], cell: cell.map(|cell| cell + 300), part };
    Extremes { min, max }
}

/// A field that tells all there is, or a part of it, or no more than it must.
fn told_more(number: usize, bits: u32) -> FieldInfo {
    let field = field(["pressure", "Dichte ρ", "", "w"][number % 4], bits);
    let vector = |component| Some(VectorPart { name: "U".into(), component });
    match number {
        0 => field,
        1 => FieldInfo {
            unit: "m/s".into(),
            vector: vector(Some(1)),
            extremes: Some(extremes(None)),
            averaged: Some(Averaged {
                input: extremes(Some(7)),
                difference: Difference { rms: 0.125, largest: 3.5 },
            }),
            ..field
        },
        2 => {
            let extremes = Some(extremes(None));
            FieldInfo { time: Some(-2.5), vector: vector(None), quantization: 0.25, extremes, ..field }
        }
        _ => FieldInfo { time: Some(0.0), ..field },
    }
}

/// A random edge-based MT as [`build`] makes it, whose fields tell more and have errors of their own.
pub fn planned(plan: Plan) -> EdgeMt {
    let built = build(plan);
    let mut info = built.info;
    info.lattice = Lattice { origin: [-1.5, 0.0, 2.0], step: [0.25, 0.5, 1.0], ..info.lattice };
    info.fields = (0..plan.fields).map(|f| told_more(f, info.fields[f].bits)).collect();
    info.displacement_per_error = 0.125;
    info.quantization = if plan.fields == 2 { 0.0 } else { 0.0625 };
    let errors = built.splits.iter().map(|split| {
        let below = |f: usize| ErrorCode(split.error.saturating_sub(300 * f as u16));
        (0..plan.fields).map(below).collect::<Vec<_>>()
    });
    let errors: Vec<_> = errors.collect();
    let splits = built.splits.iter().zip(&errors);
    mt_of_splits(&info, &built.base, splits.map(|(split, errors)| VertexSplit { errors, ..split.as_split() }))
}

/// An edge-based MT of exactly so many random updates. Made once a process.
pub fn sample(fields: usize, updates: usize) -> Mt {
    static MADE: Mutex<BTreeMap<[usize; 2], EdgeMt>> = Mutex::new(BTreeMap::new());
    let mut made = MADE.lock().unwrap_or_else(|broken| broken.into_inner());
    let mt = made.entry([fields, updates]).or_insert_with(|| {
        let cells = (2..).find(|n| n * n * n > updates).unwrap_or(2);
        planned(Plan { domain: Domain::Cube(cells), seed: updates as u64, fields, updates })
    });
    assert_eq!(mt.updates() as usize, updates, "the cube is large enough");
    mt.clone().into()
}

/// Pseudo-random numbers.
fn numbers() -> impl FnMut() -> u64 {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    }
}

/// The description of a small MT on a lattice with so many bits, with this many vertices, tetrahedra and updates.
pub fn small_info(kind: MtKind, bits: u32, fields: Vec<FieldInfo>, counts: [u32; 3]) -> MtInfo {
    let [vertices, tetrahedra, updates] = counts;
    MtInfo {
        kind,
        lattice: Lattice { origin: [0.0; 3], step: [0.5; 3], bits },
        fields,
        vertices,
        tetrahedra: tetrahedra.into(),
        updates,
        displacement_per_error: 2.0,
        quantization: 0.0,
        bounds: None,
    }
}

/// Overwrites bytes anywhere in a payload.
pub fn overwrite(payload: &mut [u8], changes: &[(proptest::sample::Index, u8)]) {
    for (place, value) in changes {
        payload[place.index(payload.len())] = *value;
    }
}

/// An explicit MT of `tets` separate tetrahedra, each of whose updates puts a vertex into one.
pub fn insertions(tets: u32, fields: usize, updates: usize) -> ExplicitMt {
    let mut next = numbers();
    let n = updates as u32;
    let info = MtInfo {
        kind: MtKind::Vertex,
        lattice: Lattice { origin: [-1.5, 0.0, 2.0], step: [0.25, 0.5, 1.0], bits: 28 },
        fields: (0..fields).map(|f| field(["p", "q", "r"][f % 3], 12)).collect(),
        vertices: 4 * tets + n,
        tetrahedra: u64::from(tets + 3 * n),
        updates: n,
        displacement_per_error: 0.125,
        quantization: 0.0,
        bounds: None,
    };
    let corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]].map(|c: [i32; 3]| c.map(|x| x << 24));
    let base = BaseMesh {
        positions: (0..tets)
            .flat_map(|t| corners.map(|[x, y, z]| [x + (1 << 25) * t as i32, y, z]))
            .collect(),
        values: vec![7; 4 * tets as usize * fields],
        tets: (0..tets).map(|t| [0, 1, 2, 3].map(|i| 4 * t + i)).collect(),
    };
    let mut made = ExplicitMt::new(info, base);
    let mut live: Vec<u32> = (0..tets).collect();
    for k in 0..updates {
        // Old ones first: they are the large ones.
        let removed = [live.remove(0)];
        let tet = made.tets()[removed[0] as usize];
        let corners = tet.map(|v| made.position(VertexId(v)));
        let middle = [0, 1, 2].map(|i| corners.iter().map(|c| c[i] / 4).sum::<i32>());
        let [a, b, c, d] = tet;
        let v = made.vertices();
        let levels: Vec<i32> = (0..fields).map(|_| (next() % 4096) as i32).collect();
        let first = made.tets().len() as u32;
        let update = ExplicitUpdate {
            positions: &[middle],
            levels: &levels,
            removed: &removed,
            inserted: &[[v, b, c, d], [a, v, c, d], [a, b, v, d], [a, b, c, v]],
            errors: &vec![ErrorCode(60_000 - (k * 50_000 / updates) as u16); fields],
        };
        made.push(&update).expect("made to fit");
        live.extend(first..made.tets().len() as u32);
    }
    made
}

/// The same as a vertex-based MT.
pub fn inserted(tets: u32, fields: usize, updates: usize) -> Mt {
    let mt = insertions(tets, fields, updates).compact(MtKind::Vertex);
    mt.expect("insertions")
}

/// The same as a half-edge MT: a vertex in a single tetrahedron collapses onto any of its corners.
pub fn half_edge(tets: u32, fields: usize, updates: usize) -> Mt {
    let mt = insertions(tets, fields, updates).compact(MtKind::HalfEdge);
    mt.expect("insertions that collapse onto a corner")
}

/// An MT of each kind that files have.
pub fn samples(fields: usize, updates: usize) -> [Mt; 3] {
    [sample(fields, updates), inserted(2, fields, updates), half_edge(2, fields, updates)]
}

/// What files say besides the MT.
pub fn options() -> EncodeOptions {
    let pairs = [("tool", "a test"), ("ключ", "значение"), ("empty", "")];
    let metadata = pairs.map(|(k, v)| (k.to_owned(), v.to_owned())).into();
    EncodeOptions { histograms: true, metadata, ..EncodeOptions::default() }
}

/// [`encode`] for an MT of one kind, too.
pub fn encoded(mt: &(impl Clone + Into<Mt>), options: &EncodeOptions) -> Result<Vec<u8>, EncodeError> {
    encode(&mt.clone().into(), options)
}

/// With small blocks, so that small MTs have many.
pub fn bytes_of(mt: &(impl Clone + Into<Mt>)) -> Vec<u8> {
    bytes_in_blocks(mt, 8)
}

/// The same with blocks of `2^block_bits` updates.
pub fn bytes_in_blocks(mt: &(impl Clone + Into<Mt>), block_bits: u32) -> Vec<u8> {
    encode(&in_blocks(mt, block_bits), &options()).expect("the MT is complete")
}

/// The MT with blocks of `2^block_bits` updates.
pub fn in_blocks(mt: &(impl Clone + Into<Mt>), block_bits: u32) -> Mt {
    mt.clone().into().in_pages(block_bits).expect("the MT is complete")
}

/// A decoder with limits.
pub fn within(limits: Limits) -> Decoder {
    Decoder::new(DecodeOptions { limits, ..DecodeOptions::default() })
}

/// Decodes a whole file in one piece.
pub fn decode(bytes: &[u8]) -> Result<Mt, FormatError> {
    let mut decoder = Decoder::default();
    decoder.feed(bytes)?;
    decoder.finish()?;
    Ok(decoder.into_mt().expect("a complete file has a base mesh"))
}

/// An MT in the form that its file has.
pub fn coded(mt: &Mt) -> Mt {
    decode(&bytes_of(mt)).expect("a good file")
}

/// Positions and levels at the corners of a tetrahedron, with the numbers of its vertices.
type Seen = [(VertexId, [i32; 3], Vec<i32>); 4];

fn seen(mesh: &CurrentMesh, found: &[u32]) -> Vec<Seen> {
    let corner = |v: u32| (mesh.vertex(v), mesh.positions()[v as usize], mesh.levels(v).to_vec());
    let mut tets: Vec<Seen> = found
        .iter()
        .map(|&t| {
            let mut tet = mesh.tet(t).expect("it was found").map(corner);
            tet.sort();
            tet
        })
        .collect();
    tets.sort();
    tets
}

/// Applies all updates in order, and shows for each what it removed and inserted.
fn replayed(mt: &impl ApplyUpdates, mut each: impl FnMut(UpdateId, [Vec<Seen>; 2])) -> CurrentMesh {
    let mut mesh = mt.start().expect("a valid base mesh");
    mt.updates_arrived(&mut mesh, 0);
    for u in (0..mt.updates()).map(UpdateId) {
        let removed = mt.find_removed(&mut mesh, u).expect("a valid MT");
        let removed = seen(&mesh, &removed);
        assert_eq!(mt.refine(&mut mesh, u), Ok(Applied::Done), "{u:?}");
        let found = mt.find_inserted(&mut mesh, u).expect("a valid MT");
        each(u, [removed, seen(&mesh, &found)]);
    }
    mesh
}

/// Asserts that two MTs have the same description, base mesh and errors, and that every update does the same in both.
pub fn assert_same(a: &impl ApplyUpdates, b: &impl ApplyUpdates) {
    assert_eq!((a.info(), a.base(), a.updates()), (b.info(), b.base(), b.updates()));
    let mut steps = Vec::new();
    let mesh = replayed(a, |u, step| steps.push((a.errors(u).to_vec(), step)));
    let mut expected = steps.into_iter();
    let other = replayed(b, |u, step| {
        assert!(expected.next() == Some((b.errors(u).to_vec(), step)), "{u:?} does something else");
    });
    assert_eq!(mesh.check(), Ok(()));
    let live = |mesh: &CurrentMesh| {
        let slots: Vec<u32> = (0..mesh.tet_slots() as u32).filter(|&t| mesh.tet(t).is_some()).collect();
        seen(mesh, &slots)
    };
    assert!(live(&mesh) == live(&other), "the reference meshes differ");
}

/// Whether `part` is `whole` cut off behind some update.
pub fn is_prefix(part: &Mt, whole: &Mt) -> bool {
    let same_updates = match (part, whole) {
        (Mt::Edge(part), Mt::Edge(whole)) => {
            (0..part.updates()).all(|k| part.update(UpdateId(k)) == whole.update(UpdateId(k)))
        }
        (Mt::HalfEdge(part), Mt::HalfEdge(whole)) => {
            part.base_marks() == whole.base_marks()
                && (0..part.updates()).map(UpdateId).all(|u| part.update(u) == whole.update(u))
        }
        (Mt::Vertex(part), Mt::Vertex(whole)) => {
            // Nodes are made when all updates are there; until then what they tell is kept beside them.
            let same = |u| {
                part.position(u) == whole.position(u)
                    && part.levels(u).eq(whole.levels(u))
                    && part.parents(u).eq(whole.parents(u))
                    && part.errors(u) == whole.errors(u)
            };
            (0..part.updates()).map(UpdateId).all(same)
        }
        _ => false,
    };
    part.info() == whole.info()
        && MultiTessellation::base(part) == MultiTessellation::base(whole)
        && part.updates() <= whole.updates()
        && same_updates
}

/// CRC-32 bit by bit, so that the checksums are checked against their definition.
pub fn crc32(parts: &[&[u8]]) -> u32 {
    let mut crc = u32::MAX;
    for byte in parts.iter().copied().flatten() {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    !crc
}

/// A section as the specification says.
pub fn section(kind: &[u8; 4], payload: &[u8]) -> Vec<u8> {
    let length = (payload.len() as u32).to_le_bytes();
    let crc = crc32(&[kind, &length, payload]).to_le_bytes();
    [kind.as_slice(), &length, &crc, payload].concat()
}

/// A header as the specification says.
pub fn header(version: u16, flags: u32, total: u64) -> Vec<u8> {
    let mut bytes = b"\x89TLOD\r\n\x1a".to_vec();
    bytes.extend(version.to_le_bytes());
    bytes.extend([0; 2]);
    bytes.extend(flags.to_le_bytes());
    bytes.extend(total.to_le_bytes());
    bytes.extend([0; 4]);
    let crc = crc32(&[&bytes]).to_le_bytes();
    bytes.extend(crc);
    bytes
}

/// Kinds and payloads of the sections of a file, without `ENDF`.
pub fn sections(bytes: &[u8]) -> Vec<([u8; 4], Vec<u8>)> {
    let mut rest = &bytes[32..];
    let mut sections = Vec::new();
    while let Some((head, tail)) = rest.split_first_chunk::<12>() {
        let length = u32::from_le_bytes([head[4], head[5], head[6], head[7]]) as usize;
        sections.push(([head[0], head[1], head[2], head[3]], tail[..length].to_vec()));
        rest = &tail[length..];
    }
    assert_eq!(sections.pop().expect("every file has an end").0, *b"ENDF");
    sections
}

/// A well-framed file of the given sections, with a header and totals that fit.
pub fn assemble(sections: &[([u8; 4], Vec<u8>)], updates: u32) -> Vec<u8> {
    assemble_flagged(0, sections, updates)
}

/// [`assemble`] with these flags in the header.
pub fn assemble_flagged(flags: u32, sections: &[([u8; 4], Vec<u8>)], updates: u32) -> Vec<u8> {
    let framed: Vec<Vec<u8>> = sections.iter().map(|(kind, payload)| section(kind, payload)).collect();
    let crcs: Vec<u8> = framed.iter().flat_map(|s| s[8..12].to_vec()).collect();
    let mut end = updates.to_le_bytes().to_vec();
    end.extend((framed.len() as u32).to_le_bytes());
    end.extend(crc32(&[&crcs]).to_le_bytes());
    let body = [framed.concat(), section(b"ENDF", &end)].concat();
    [header(2, flags, 32 + body.len() as u64), body].concat()
}
