//! MTs for the tests of the file format, made by code.
#![allow(dead_code, reason = "each test file uses its own part")]

use tetralod::format::{Decoder, EncodeOptions, FormatError, encode};
use tetralod::geom::Lattice;
use tetralod::mesh::VectorPart;
use tetralod::mt::{
    BaseMesh, EdgeMt, ErrorCode, ExplicitMt, ExplicitUpdate, FieldInfo, Mt, MtInfo, MtKind, MtRef,
    MultiTessellation, UpdateId, VertexId, VertexSplit,
};

/// Offset, choice of vertex, mask and error of an update; made to fit by [`build`].
pub type Draft = ([i32; 3], u32, u64, u16, Vec<i32>);

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

/// A field that tells all there is, or a part of it, or no more than it must.
fn told_more(number: usize, field: FieldInfo) -> FieldInfo {
    let vector = |component| Some(VectorPart { name: "U".into(), component });
    match number {
        0 => field,
        1 => FieldInfo { unit: "m/s".into(), vector: vector(Some(1)), ..field },
        2 => FieldInfo { time: Some(-2.5), vector: vector(None), quantization: 0.25, ..field },
        _ => FieldInfo { time: Some(0.0), ..field },
    }
}

/// An MT with `tets` separate base tetrahedra, `fields` fields and one update per draft.
pub fn build(tets: u32, fields: usize, drafts: &[Draft]) -> Mt {
    let lattice = Lattice { origin: [-1.5, 0.0, 2.0], step: [0.25, 0.5, 1.0], bits: 20 };
    let corners = [[0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]];
    let vertices = 4 * tets;
    let base = BaseMesh {
        positions: (0..tets as i32)
            .flat_map(|t| corners.map(|c: [i32; 3]| [c[0] + 20 * t, c[1], c[2] + t % 7]))
            .collect(),
        values: (0..vertices as i32 * fields as i32).map(|i| i * 37 % 4096).collect(),
        tets: (0..tets).map(|t| [0, 1, 2, 3].map(|i| 4 * t + i)).collect(),
    };
    let names = ["pressure", "Dichte ρ", "", "w"];
    let info = MtInfo {
        kind: MtKind::Edge,
        lattice,
        fields: (0..fields).map(|f| told_more(f, field(names[f % 4], 12))).collect(),
        vertices: vertices + drafts.len() as u32,
        tetrahedra: tets + 3 * drafts.len() as u32,
        updates: drafts.len() as u32,
        displacement_per_error: 0.125,
        quantization: if fields == 2 { 0.0 } else { 0.0625 },
    };
    let mut mt = EdgeMt::new(info, base);
    let mut whole: Vec<u32> = (0..vertices).collect();
    let mut most = u16::MAX;
    for (offset, choice, mask, error, field_offsets) in drafts {
        let vertex = VertexId(whole.swap_remove(*choice as usize % whole.len()));
        let created = mt.created(UpdateId(mt.updates()));
        let field_offsets: Vec<i32> = field_offsets.iter().copied().cycle().take(fields).collect();
        most = most.min(*error);
        let errors = &vec![ErrorCode(most); fields];
        let split =
            VertexSplit { vertex, offset: *offset, field_offsets: &field_offsets, mask: *mask, errors };
        mt.push(&split).expect("drafts are made to fit");
        whole.extend(created.map(|v| v.0));
    }
    mt.into()
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

/// An edge-based MT of `updates` pseudo-random updates.
pub fn sample(tets: u32, fields: usize, updates: usize) -> Mt {
    let mut next = numbers();
    let drafts: Vec<Draft> = (0..updates)
        .map(|k| {
            let offset = [0; 3].map(|_: i32| (next() % 201) as i32 - 100);
            let mask = next() >> (next() % 64);
            let error = 60_000 - (k as u64 * 50_000 / updates as u64) as u16;
            (offset, next() as u32, mask, error, vec![(next() % 99) as i32 - 49, (next() % 9) as i32])
        })
        .collect();
    build(tets, fields, &drafts)
}

/// An explicit MT of `updates` pseudo-random updates: most put a vertex into a tetrahedron, some put tetrahedra in the
/// place of others that lie elsewhere, which only the mesh would refuse.
pub fn spelled(tets: u32, fields: usize, updates: usize) -> Mt {
    let mut next = numbers();
    let lattice = Lattice { origin: [-1.5, 0.0, 2.0], step: [0.25, 0.5, 1.0], bits: 28 };
    let info = MtInfo {
        kind: MtKind::Explicit,
        lattice,
        fields: (0..fields).map(|f| field(["p", "q", "r"][f % 3], 12)).collect(),
        vertices: 4 * tets,
        tetrahedra: tets,
        updates: updates as u32,
        displacement_per_error: 0.125,
        quantization: 0.0,
    };
    let corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]].map(|c: [i32; 3]| c.map(|x| x << 24));
    let base = BaseMesh {
        positions: (0..tets)
            .flat_map(|t| corners.map(|[x, y, z]| [x + (1 << 25) * t as i32, y, z]))
            .collect(),
        values: vec![7; 4 * tets as usize * fields],
        tets: (0..tets).map(|t| [0, 1, 2, 3].map(|i| 4 * t + i)).collect(),
    };
    // Twice: the first time to count what the description has to tell.
    let mut made = ExplicitMt::new(info.clone(), base.clone());
    let mut live: Vec<u32> = (0..tets).collect();
    let mut spelled = Vec::new();
    for k in 0..updates {
        // Old ones first: they are the large ones.
        let removed: Vec<u32> = (0..if k % 5 == 4 { 3 } else { 1 }).map(|_| live.remove(0)).collect();
        let tet = made.tets()[removed[0] as usize];
        let corners = tet.map(|v| made.position(VertexId(v)));
        let middle = [0, 1, 2].map(|i| corners.iter().map(|c| c[i] / 4).sum::<i32>());
        let [a, b, c, d] = tet;
        let v = made.vertices();
        let (positions, inserted) = match k % 5 {
            4 => (vec![], removed.iter().rev().map(|&t| made.tets()[t as usize]).collect()),
            _ => (vec![middle], vec![[v, b, c, d], [a, v, c, d], [a, b, v, d], [a, b, c, v]]),
        };
        let levels: Vec<i32> = (0..positions.len() * fields).map(|_| (next() % 4096) as i32).collect();
        let error = ErrorCode(60_000 - (k * 50_000 / updates) as u16);
        let errors = &vec![error; fields];
        let first = made.tets().len() as u32;
        let (positions, levels, removed, inserted) = (&positions, &levels, &removed, &inserted);
        made.push(&ExplicitUpdate { positions, levels, removed, inserted, errors }).expect("made to fit");
        live.extend(first..made.tets().len() as u32);
        spelled.push((positions.clone(), levels.clone(), removed.clone(), inserted.clone(), error));
    }
    let [vertices, tetrahedra] = made.reference_counts();
    let mut mt = ExplicitMt::new(MtInfo { vertices, tetrahedra, ..info }, base);
    for (positions, levels, removed, inserted, error) in &spelled {
        let errors = &vec![*error; fields];
        mt.push(&ExplicitUpdate { positions, levels, removed, inserted, errors }).expect("made to fit");
    }
    mt.into()
}

/// A vertex-based MT of `updates` insertions, each into one tetrahedron.
pub fn inserted(tets: u32, fields: usize, updates: usize) -> Mt {
    let mut next = numbers();
    let spelled = spelled(tets, fields, 0);
    let vertices = 4 * tets + updates as u32;
    let info = MtInfo { vertices, updates: updates as u32, ..spelled.info().clone() };
    let mut made = ExplicitMt::new(info, spelled.base().clone());
    let mut live: Vec<u32> = (0..tets).collect();
    for k in 0..updates {
        // Old ones first: they are the large ones.
        let tet = made.tets()[live[0] as usize];
        let corners = tet.map(|v| made.position(VertexId(v)));
        let middle = [0, 1, 2].map(|i| corners.iter().map(|c| c[i] / 4).sum::<i32>());
        let [a, b, c, d] = tet;
        let v = made.vertices();
        let removed = [live.remove(0)];
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
    let mt = Mt::from(made).convert(MtKind::Vertex);
    mt.expect("insertions")
}

/// An MT of each kind.
pub fn samples(tets: u32, fields: usize, updates: usize) -> [Mt; 3] {
    [sample(tets, fields, updates), spelled(tets, fields, updates), inserted(tets, fields, updates)]
}

pub fn options() -> EncodeOptions {
    let pairs = [("tool", "a test"), ("ключ", "значение"), ("empty", "")];
    EncodeOptions { metadata: pairs.map(|(k, v)| (k.to_owned(), v.to_owned())).into() }
}

pub fn bytes_of<'a>(mt: impl Into<MtRef<'a>>) -> Vec<u8> {
    encode(mt, &options()).expect("the MT is complete")
}

/// Decodes a whole file in one piece.
pub fn decode(bytes: &[u8]) -> Result<Mt, FormatError> {
    let mut decoder = Decoder::default();
    decoder.feed(bytes)?;
    decoder.finish()?;
    Ok(decoder.into_mt().expect("a complete file has a base mesh"))
}

/// Whether `part` is `whole` cut off behind some update.
pub fn is_prefix(part: &Mt, whole: &Mt) -> bool {
    let same_updates = match (part, whole) {
        (Mt::Edge(part), Mt::Edge(whole)) => {
            (0..part.updates()).all(|k| part.split(UpdateId(k)) == whole.split(UpdateId(k)))
        }
        (Mt::Vertex(part), Mt::Vertex(whole)) => {
            let same = |u| part.node(u) == whole.node(u) && part.errors_of(u) == whole.errors_of(u);
            part.base_removers() == whole.base_removers() && (0..part.updates()).map(UpdateId).all(same)
        }
        (Mt::Explicit(part), Mt::Explicit(whole)) => {
            let same = |u| {
                part.created(u) == whole.created(u)
                    && part.inserted(u) == whole.inserted(u)
                    && part.removed(u) == whole.removed(u)
                    && part.error(u) == whole.error(u)
            };
            let vertex = |v| part.position(v) == whole.position(v) && part.levels(v) == whole.levels(v);
            whole.tets().starts_with(part.tets())
                && (0..part.vertices()).map(VertexId).all(vertex)
                && (0..part.updates()).map(UpdateId).all(same)
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
pub fn header(version: [u16; 2], flags: u32, total: u64) -> Vec<u8> {
    let mut bytes = b"\x89TLOD\r\n\x1a".to_vec();
    version.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
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
    let framed: Vec<Vec<u8>> = sections.iter().map(|(kind, payload)| section(kind, payload)).collect();
    let crcs: Vec<u8> = framed.iter().flat_map(|s| s[8..12].to_vec()).collect();
    let mut end = updates.to_le_bytes().to_vec();
    end.extend((framed.len() as u32).to_le_bytes());
    end.extend(crc32(&[&crcs]).to_le_bytes());
    let body = [framed.concat(), section(b"ENDF", &end)].concat();
    [header([1, 0], 0, 32 + body.len() as u64), body].concat()
}
