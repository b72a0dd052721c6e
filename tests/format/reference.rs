//! Promise: `docs/format.md` is enough to write a reader. A slow, plain one that was written from it, and shares no code with
//! the crate, finds the same in files as the crate's decoder does, block by block.

use crate::reader::growth::Growth;
use crate::reader::wire::Extreme;
use crate::reader::{self, File, plain};
use crate::support::builder::{Plan, build, mt_of_splits};
use crate::support::domains::{Domain, PlainMesh};
use crate::support::files::{encoded, field, in_blocks, small_info};
use crate::support::random::Random;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use tetralod::format::{Decoder, EncodeOptions};
use tetralod::geom::Lattice;
use tetralod::mesh::{self, Averaged, Difference, Extremes, Field, TetMesh, VectorPart};
use tetralod::mt::{
    Applied, ApplyUpdates, BaseMesh, CurrentMesh, EdgeMt, EdgeUpdate, ErrorCode, FieldInfo, Mt, MtInfo,
    MtKind, MultiTessellation, UpdateId, UpdatePages, VertexId, VertexSplit,
};
use tetralod_build::{BuildConfig, FieldPrecision, edge_mt};
use tetralod_io::generate;

fn options() -> EncodeOptions {
    let metadata = [("tool".to_owned(), "hand".to_owned()), ("a".to_owned(), String::new())];
    EncodeOptions { metadata: metadata.into(), ..EncodeOptions::default() }
}

/// The file of an MT with blocks of `2^block_bits` updates.
fn file_of(mt: &(impl Clone + Into<Mt>), block_bits: u32) -> Vec<u8> {
    encoded(&in_blocks(mt, block_bits), &options()).expect("an MT")
}

/// Reads a file both ways, block by block.
fn compare(bytes: &[u8]) {
    let file = reader::read(bytes);
    let mut decoder = Decoder::default();
    let front = file.blocks.first().map_or(bytes.len(), |range| range.start);
    decoder.feed(&bytes[..front]).expect("a good file");
    compare_info(&file, decoder.info().expect("a description"), decoder.metadata());
    assert_eq!(decoder.index(), None);
    let mut current = compare_base(&file, edge_of(&decoder));
    let mut mesh = plain::Mesh::new(&file);
    for (block, range) in (0..).zip(&file.blocks) {
        decoder.feed(&bytes[range.clone()]).expect("a good file");
        let mt = edge_of(&decoder);
        let updates = file.updates(block);
        assert_eq!(mt.updates(), updates.end);
        mt.updates_arrived(&mut current, updates.start);
        for k in updates {
            compare_split(&file, mt, k);
            assert_eq!(mt.refine(&mut current, UpdateId(k)), Ok(Applied::Done));
            mesh.split(&file, k);
            mesh.forget(file.splits[&k].vertex);
        }
        check_behind(&file, mt, block);
        compare_meshes(&mesh, &current);
    }
    let behind = file.blocks.last().map_or(front, |range| range.end);
    assert!(decoder.feed(&bytes[behind..]).expect("a good file").complete || behind == bytes.len());
    assert_eq!(mesh.tets.len(), file.info.tetrahedra as usize);
    assert_eq!(decoder.finish(), Ok(()));
}

fn edge_of(decoder: &Decoder) -> &EdgeMt {
    match decoder.mt() {
        Some(Mt::Edge(mt)) => mt,
        _ => panic!("the base mesh of an edge-based MT"),
    }
}

fn sorted(mut tet: [u32; 4]) -> [u32; 4] {
    tet.sort_unstable();
    tet
}

fn extremes_of(ours: &[Extreme; 2]) -> Extremes {
    let [min, max] = ours.each_ref().map(|Extreme { value, place, cell }| {
        let part = cell.as_ref().map(|(_, part)| part.clone()).filter(|part| !part.is_empty());
        mesh::Extreme { value: *value, place: *place, cell: cell.as_ref().map(|(cell, _)| *cell), part }
    });
    Extremes { min, max }
}

fn compare_info(file: &File, info: &MtInfo, metadata: &[(String, String)]) {
    let fields = file.info.fields.iter().map(|field| FieldInfo {
        name: field.name.clone(),
        min: field.min,
        max: field.max,
        origin: field.origin,
        step: field.step,
        bits: field.bits,
        unit: field.unit.clone(),
        vector: field.vector.clone().map(|(name, component)| VectorPart { name, component }),
        is_label: field.is_label,
        time: field.time,
        quantization: field.rounding,
        extremes: field.extremes.as_ref().map(extremes_of),
        averaged: field.averaged.as_ref().map(|(input, [rms, largest])| Averaged {
            input: extremes_of(input),
            difference: Difference { rms: *rms, largest: *largest },
        }),
    });
    let found = MtInfo {
        kind: MtKind::Edge,
        lattice: Lattice { origin: file.info.origin, step: file.info.step, bits: file.info.bits },
        fields: fields.collect(),
        vertices: file.info.vertices,
        tetrahedra: file.info.tetrahedra,
        updates: file.info.updates,
        displacement_per_error: file.info.displacement_per_error,
        quantization: file.info.rounding,
        bounds: file.bounds,
    };
    assert_eq!(&found, info);
    assert_eq!(file.info.metadata, metadata);
}

fn compare_base(file: &File, mt: &EdgeMt) -> CurrentMesh {
    assert_eq!(file.base.positions, mt.base().positions);
    assert_eq!(file.base.tets, mt.base().tets);
    for (f, levels) in file.base_levels.iter().enumerate() {
        let found = mt.base().values.iter().skip(f).step_by(file.info.fields.len());
        assert!(levels.iter().eq(found));
    }
    mt.start().expect("a valid base mesh")
}

/// Compares what the file tells of an update.
fn compare_split(file: &File, mt: &EdgeMt, k: u32) {
    let (ours, theirs) = (&file.splits[&k], mt.update(UpdateId(k)));
    assert_eq!(
        (ours.vertex, ours.offset, ours.mask),
        (theirs.vertex.0, theirs.offset_residual, theirs.wrong_sides)
    );
    assert_eq!(ours.residuals[..], theirs.level_residuals[..]);
    assert!(ours.errors.iter().eq(theirs.errors.iter().map(|error| &error.0)));
}

/// Checks what a block says of the errors of the updates behind it.
fn check_behind(file: &File, mt: &EdgeMt, block: u32) {
    let behind = file.updates(block).end..file.info.updates;
    for (field, &bound) in file.behind[block as usize].iter().enumerate() {
        let errors = behind.clone().map(|k| file.splits[&k].errors[field]);
        assert!(errors.clone().all(|error| error <= bound));
        // It is the least one that fits its byte.
        let largest = errors.max().unwrap_or(0);
        assert!(bound == u16::MAX || u32::from(bound) < u32::from(largest) + 256);
        let known = if behind.is_empty() { ErrorCode::ZERO } else { ErrorCode(bound) };
        assert_eq!(mt.to_come_in(field), known);
    }
}

fn compare_meshes(mesh: &plain::Mesh, current: &CurrentMesh) {
    let found = (0..current.tet_slots() as u32).filter_map(|t| current.tet(t));
    let found: BTreeSet<[u32; 4]> = found.map(|tet| sorted(tet.map(|v| current.vertex(v).0))).collect();
    let ours: BTreeSet<[u32; 4]> = mesh.tets.iter().map(|tet| sorted(*tet)).collect();
    assert_eq!(ours.len(), mesh.tets.len());
    assert_eq!(ours, found);
    for v in BTreeSet::from_iter(ours.iter().flatten().copied()) {
        let slot = current.slot(VertexId(v)).expect("the vertex is in the mesh");
        assert_eq!(mesh.positions[&v], current.positions()[slot as usize]);
        assert_eq!(mesh.levels[&v], current.levels(slot));
    }
}

#[test]
fn random_mts_are_read_alike() {
    for (seed, domain) in (0..).zip(Domain::SMALL) {
        for fields in 1..4 {
            let built = build(Plan { domain, seed: 31 * seed + fields as u64, fields, updates: 1000 });
            compare(&file_of(&built.edge_mt(), 4));
        }
    }
}

/// Any order that keeps what the page says of dependence leads to the same mesh.
#[test]
fn updates_in_another_order_make_the_same_mesh() {
    let mut random = Random::new(5);
    let built = build(Plan { domain: Domain::Cube(3), seed: 9, fields: 2, updates: 1000 });
    let bytes = file_of(&built.edge_mt(), 4);
    let file = reader::read(&bytes);
    let in_order = refined(&file, |ready| ready[0]);
    for _ in 0..3 {
        let other = refined(&file, |ready| ready[random.below(ready.len())]);
        assert_eq!((&in_order.positions, &in_order.levels), (&other.positions, &other.levels));
        let tets = |mesh: &plain::Mesh| mesh.tets.iter().map(|tet| sorted(*tet)).collect::<BTreeSet<_>>();
        assert_eq!(tets(&in_order), tets(&other));
    }
}

/// Applies all updates, always one of those that can be.
fn refined(file: &File, mut choose: impl FnMut(&[u32]) -> u32) -> plain::Mesh {
    let mut mesh = plain::Mesh::new(file);
    let mut left: BTreeSet<u32> = file.splits.keys().copied().collect();
    while !left.is_empty() {
        let ready = left.iter().copied().filter(|k| mesh.is_feasible(*k, &file.splits[k]));
        let k = choose(&ready.collect::<Vec<u32>>());
        mesh.split(file, k);
        mesh.forget(file.splits[&k].vertex);
        left.remove(&k);
    }
    mesh
}

fn built(mesh: &TetMesh, config: BuildConfig) -> EdgeMt {
    edge_mt(mesh, &config, &mut |_| ControlFlow::Continue(())).expect("a valid mesh").mt
}

#[test]
fn built_mts_are_read_alike() {
    let bucky = generate::bucky(9).expect("a small size");
    let coarse = BuildConfig {
        position_bits: Some(6),
        field_precision: FieldPrecision::Bits(5),
        ..BuildConfig::of(MtKind::Edge)
    };
    let fine = BuildConfig {
        position_bits: Some(27),
        field_precision: FieldPrecision::Bits(24),
        ..BuildConfig::of(MtKind::Edge)
    };
    for (bits, config) in [(5, BuildConfig::of(MtKind::Edge)), (4, coarse), (16, fine)] {
        compare(&file_of(&built(&bucky, config), bits));
    }
    let flow = generate::sphere_flow(4).expect("a small size");
    let config = BuildConfig { all_fields: true, ..BuildConfig::of(MtKind::Edge) };
    let mut mt = built(&flow, config);
    compare(&file_of(&mt, 4));
    mt = told_more(&mt);
    compare(&file_of(&mt, 6));
}

/// Where a field is linear, guesses come out at whole numbers but for rounding: the order of operations decides.
#[test]
fn guesses_at_whole_numbers_are_rounded_alike() {
    let mut mesh = generate::bucky(7).expect("a small size");
    let linear = |weights: [f64; 3]| {
        let value = move |p: &[f64; 3]| 6.0 * (p[0] * weights[0] + p[1] * weights[1] + p[2] * weights[2]);
        mesh.positions.iter().map(value).collect::<Vec<f64>>()
    };
    let values = [[1.0, 0.0, 0.0], [1.0, 2.0, 3.0], [7.0, -5.0, 3.0]].map(linear);
    let names = ["x", "sum", "difference"];
    mesh.fields = names.iter().zip(values).map(|(name, values)| Field::new(*name, values)).collect();
    for (position_bits, field_bits) in [(8, 8), (12, 12), (20, 24)] {
        let config = BuildConfig {
            all_fields: true,
            position_bits: Some(position_bits),
            field_precision: FieldPrecision::Bits(field_bits),
            ..BuildConfig::of(MtKind::Edge)
        };
        compare(&file_of(&built(&mesh, config), 5));
    }
}

#[test]
fn exact_values_are_read_alike() {
    let mut flow = generate::sphere_flow(4).expect("a small size");
    // One field of single precision, one of double.
    flow.fields[0].values.iter_mut().for_each(|x| *x = f64::from(*x as f32));
    let config = BuildConfig { all_fields: true, all_lossless: true, ..BuildConfig::of(MtKind::Edge) };
    let built = edge_mt(&flow, &config, &mut |_| ControlFlow::Continue(())).expect("a valid mesh");
    assert_eq!(built.exact.len(), 2);
    let options = EncodeOptions { exact: built.exact.clone(), ..options() };
    let bytes = encoded(&in_blocks(&built.mt, 5), &options).expect("an MT");
    compare(&bytes);
    let file = reader::read(&bytes);
    let mesh = refined(&file, |ready| ready[0]);
    for (ours, theirs) in file.exact.iter().zip(&built.exact) {
        let field = &file.info.fields[ours.field as usize];
        assert_eq!(ours.corrections.len(), file.info.vertices as usize);
        for &(vertex, correction) in &ours.corrections {
            let level = f64::from(mesh.levels[&vertex][ours.field as usize]);
            let value = ours.value(field.origin + field.step * level, correction);
            assert_eq!(Some(value.to_bits()), theirs.get(VertexId(vertex)).map(f64::to_bits));
        }
    }
}

/// The same MT with more of a description, and errors that fill all their bits.
fn told_more(mt: &EdgeMt) -> EdgeMt {
    let mut info = mt.info().clone();
    info.quantization = 0.25;
    let parts = [Some(1), None].map(|component| Some(VectorPart { name: "U".to_owned(), component }));
    for (field, vector) in info.fields.iter_mut().zip(parts) {
        *field = FieldInfo {
            unit: "m/s".to_owned(),
            time: Some(-0.5),
            vector,
            quantization: 0.5,
            ..field.clone()
        };
    }
    let mut told = EdgeMt::new(info, mt.base().clone());
    for k in (0..mt.updates()).map(UpdateId) {
        let errors: Vec<ErrorCode> =
            mt.errors(k).iter().map(|error| ErrorCode(error.0.saturating_add(77))).collect();
        told.push(&EdgeUpdate { errors: &errors, ..mt.update(k) }).expect("an update of the MT");
    }
    told
}

#[test]
fn base_meshes_are_read_alike() {
    let mut random = Random::new(3);
    let mut meshes: Vec<PlainMesh> =
        [Domain::Cube(1), Domain::Cube(5), Domain::Ell(2), Domain::TwoComponents(2), Domain::Ring]
            .map(|domain| domain.mesh(&mut random))
            .into();
    // Parts that meet in faces, edges and vertices, or not at all.
    for share in [2, 3, 8, 40] {
        let mut mesh = Domain::Cube(4).mesh(&mut random);
        mesh.tets.retain(|_| !random.once_in(share));
        meshes.push(without_loose_vertices(&mesh));
    }
    meshes.push(wheel(300));
    for mesh in meshes {
        compare(&file_of(&base_only(&mesh), 4));
        compare(&file_of(&base_only(&grown(&mesh)), 4));
    }
}

/// Tetrahedra around an edge, so many that a vertex has more open faces than are looked at.
fn wheel(count: u32) -> PlainMesh {
    let mut positions = vec![[500, 500, 0], [500, 500, 1000]];
    // Points of a square's border, in order.
    let side = (count / 4) as i32;
    let corner = |x: i32| 13 * x;
    for i in 0..4 * side {
        let (edge, at) = (i / side, i % side);
        let [x, y] = [[at, 0], [side, at], [side - at, side], [0, side - at]][edge as usize];
        positions.push([corner(x), corner(y), 500]);
    }
    positions[0][0] = corner(side) / 2;
    positions[1][0] = corner(side) / 2;
    positions[0][1] = corner(side) / 2;
    positions[1][1] = corner(side) / 2;
    let rim = 4 * side as u32;
    let tets = (0..rim).map(|i| [0, 1, 2 + i, 2 + (i + 1) % rim]).collect();
    PlainMesh { positions, tets }
}

fn without_loose_vertices(mesh: &PlainMesh) -> PlainMesh {
    let used: BTreeSet<u32> = mesh.tets.iter().flatten().copied().collect();
    let number: BTreeMap<u32, u32> = used.iter().copied().zip(0..).collect();
    PlainMesh {
        positions: used.iter().map(|&v| mesh.positions[v as usize]).collect(),
        tets: mesh.tets.iter().map(|tet| tet.map(|v| number[&v])).collect(),
    }
}

/// The same mesh in an order in which it grows over its faces.
fn grown(mesh: &PlainMesh) -> PlainMesh {
    let mut growth = Growth::default();
    let mut numbers: BTreeMap<u32, u32> = BTreeMap::new();
    let mut number = |growth: &mut Growth, v: u32| {
        *numbers.entry(v).or_insert_with(|| growth.add_vertex(mesh.positions[v as usize]))
    };
    let mut places: Vec<usize> = Vec::new();
    let mut left: BTreeSet<usize> = (0..mesh.tets.len()).collect();
    while let Some(&seed) = left.first() {
        let Some(gate) = growth.gate() else {
            let tet = mesh.tets[seed].map(|v| number(&mut growth, v));
            growth.add(tet);
            places.push(seed);
            left.remove(&seed);
            continue;
        };
        let (before, corner) = gate.place();
        let opposite = growth.tets[before][corner];
        let before = places[before];
        let face: Vec<u32> =
            mesh.tets[before].into_iter().filter(|&v| number(&mut growth, v) != opposite).collect();
        let behind = left.iter().copied().find(|&t| face.iter().all(|v| mesh.tets[t].contains(v)));
        let Some(t) = behind else {
            growth.close(&gate);
            continue;
        };
        let apex = mesh.tets[t].into_iter().find(|v| !face.contains(v)).expect("a fourth vertex");
        let apex = number(&mut growth, apex);
        growth.attach(&gate, apex);
        places.push(t);
        left.remove(&t);
    }
    for v in 0..mesh.positions.len() as u32 {
        number(&mut growth, v);
    }
    PlainMesh { positions: growth.positions, tets: growth.tets }
}

/// An MT without updates.
fn base_only(mesh: &PlainMesh) -> EdgeMt {
    let mut random = Random::new(11);
    let fields = vec![FieldInfo { name: "f".to_owned(), bits: 12, ..FieldInfo::default() }];
    let counts = [mesh.positions.len() as u32, mesh.tets.len() as u32, 0];
    let lattice = Lattice { origin: [0.0; 3], step: [1.0; 3], bits: 11 };
    let info =
        MtInfo { lattice, displacement_per_error: 1.0, ..small_info(MtKind::Edge, 11, fields, counts) };
    let values = mesh.positions.iter().map(|_| random.between(0, 4095)).collect();
    EdgeMt::new(info, BaseMesh { positions: mesh.positions.clone(), values, tets: mesh.tets.clone() })
}

/// The worked example: two tetrahedra, one field of 8 bits, one update.
#[test]
fn the_example_is_written_and_read_as_specified() {
    let info = small_info(MtKind::Edge, 4, vec![field("p", 8)], [6, 3, 1]);
    let base = BaseMesh {
        positions: vec![[0, 0, 4], [8, 0, 4], [0, 8, 4], [2, 2, 12], [2, 2, 0]],
        values: vec![10, 20, 30, 200, 40],
        tets: vec![[0, 1, 2, 3], [0, 2, 1, 4]],
    };
    let split = VertexSplit {
        vertex: VertexId(0),
        offset: [0, 0, 2],
        field_offsets: &[-3],
        mask: 0b10,
        errors: &[ErrorCode(300)],
    };
    let mt = mt_of_splits(&info, &base, [split]);
    let metadata = [("tool".to_owned(), "hand".to_owned())].into();
    let options = EncodeOptions { metadata, ..EncodeOptions::default() };
    let bytes = encoded(&in_blocks(&mt, 4), &options).expect("an MT");
    let hex = |bytes: &[u8]| bytes.iter().map(|b| format!("{b:02X} ")).collect::<String>();
    assert_eq!(hex(&bytes), hex(&example()));
    compare(&example());
}

/// The bytes of the first example of the page; what follows two slashes is a remark.
fn example() -> Vec<u8> {
    let page = include_str!("../../docs/format.md");
    let examples = page.split("## Examples").nth(1).expect("there are examples");
    let block = examples.split("```text\n").nth(1).and_then(|rest| rest.split("```").next());
    let lines = block.expect("an example").lines();
    let digits = lines.flat_map(|line| line.split("//").next().unwrap_or("").split_whitespace());
    digits.map(|d| u8::from_str_radix(d, 16).expect("two hexadecimal digits")).collect()
}

/// A reader that does not find what is wrong proves nothing.
#[test]
fn a_changed_formula_would_be_noticed() {
    let mt = built(&generate::bucky(7).expect("a small size"), BuildConfig::of(MtKind::Edge));
    let mut file = reader::read(&file_of(&mt, 6));
    let right = refined(&file, |ready| ready[0]);
    let wrong_levels = file.splits.values().filter(|split| split.residuals != [0]).count();
    let wrong_sides = file.splits.values().filter(|split| split.mask != 0).count();
    // The guesses are right often, though not always, and so matter.
    let most = file.splits.len();
    assert!(0 < wrong_sides && wrong_sides < most && 0 < wrong_levels && wrong_levels < most);
    let last = file.splits.len() as u32 - 1;
    file.splits.get_mut(&last).expect("an update").residuals[0] ^= 1;
    assert_ne!(refined(&file, |ready| ready[0]).levels, right.levels);
}
