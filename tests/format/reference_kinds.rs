//! Promise: `docs/format.md` is enough to write a reader of files of kind 1 and 3 as well. A slow, plain one that was written
//! from it finds the same updates in files as the crate's decoder does.

mod half_edge;

use crate::reader::change::{Change, Tet, sorted};
use crate::reader::{self, File};
use crate::support::domains::Domain;
use crate::support::files::{bytes_in_blocks, decode, in_blocks, inserted, options};
use crate::support::random::Random;
use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use tetralod::format::{EncodeOptions, encode};
use tetralod::mesh::{Field, TetMesh};
use tetralod::mt::{Exact, ExplicitMt, Mt, MtKind, MultiTessellation, UpdateId, VertexId};
use tetralod_build::{BuildConfig, BuildCriterion, Construction, FieldPrecision, Method};
use tetralod_io::generate;

/// Reads a file both ways; gives what was read.
fn compare(bytes: &[u8]) -> (File, Vec<Change>) {
    let (file, parts) = reader::open(bytes);
    let changes: Vec<Change> = reader::changes(&file, &parts).into_iter().map(without_orders).collect();
    let mt = decode(bytes).expect("a good file");
    let mt = spelled_out(&mt);
    compare_base(&file, &mt);
    assert_eq!((changes.len(), file.info.updates), (mt.updates() as usize, mt.updates()));
    for (k, change) in (0..).map(UpdateId).zip(&changes) {
        assert_eq!(change, &change_of(&mt, k), "{k:?}");
    }
    check_history(&file, &changes);
    (file, changes)
}

fn spelled_out(mt: &Mt) -> ExplicitMt {
    match ExplicitMt::of(mt) {
        Ok(mt) => mt,
        other => panic!("not spelled out: {:?}", other.err()),
    }
}

fn compare_base(file: &File, mt: &ExplicitMt) {
    let base = mt.base();
    assert_eq!((&file.base.positions, &file.base.tets), (&base.positions, &base.tets));
    for (f, levels) in file.base_levels.iter().enumerate() {
        assert!(levels.iter().eq(base.values.iter().skip(f).step_by(file.info.fields.len())));
    }
}

/// Corners ascending: in which order they come is part of no MT. Whoever reads a tetrahedron checks that it is positive.
fn in_order(tets: impl Iterator<Item = Tet>) -> Vec<Tet> {
    tets.map(sorted).collect::<BTreeSet<Tet>>().into_iter().collect()
}

fn without_orders(change: Change) -> Change {
    let Change { removed, inserted, own, .. } = change;
    let own = own.map(|(fall, quarters)| {
        let pairs = removed.iter().map(|tet| sorted(*tet)).zip(quarters);
        (fall, pairs.collect::<BTreeMap<Tet, u32>>().into_values().collect())
    });
    let [removed, inserted] = [removed, inserted].map(|tets| in_order(tets.into_iter()));
    Change { removed, inserted, own, ..change }
}

fn change_of(mt: &ExplicitMt, k: UpdateId) -> Change {
    let created = || mt.created(k).map(VertexId);
    let tet = |t: u32| mt.tets()[t as usize];
    Change {
        errors: mt.errors(k).iter().map(|error| error.0).collect(),
        positions: created().map(|v| mt.position(v)).collect(),
        levels: created().map(|v| mt.levels(v).to_vec()).collect(),
        removed: in_order(mt.removed(k).iter().map(|&t| tet(t))),
        inserted: in_order(mt.inserted(k).map(tet)),
        own: mt.has_tet_errors().then(|| {
            let pairs = mt.removed(k).iter().map(|&t| (sorted(tet(t)), u32::from(mt.quarterings_of(t))));
            let quarters = pairs.collect::<BTreeMap<Tet, u32>>().into_values().collect();
            (u32::from(mt.own_fall(k)), quarters)
        }),
    }
}

/// What the page says of dependence, of the index and of what `BASE` and `INFO` tell, given all updates.
fn check_history(file: &File, changes: &[Change]) {
    let mut positions = file.base.positions.clone();
    let mut levels: Vec<Vec<i32>> =
        (0..positions.len()).map(|v| file.base_levels.iter().map(|levels| levels[v]).collect()).collect();
    let mut live: BTreeMap<Tet, Option<u32>> =
        file.base.tets.iter().map(|tet| (sorted(*tet), None)).collect();
    for (k, change) in (0..).zip(changes) {
        positions.extend(&change.positions);
        levels.extend(change.levels.iter().cloned());
        for tet in &change.removed {
            match live.remove(tet).expect("a tetrahedron of the mesh") {
                None => {}
                Some(parent) => {
                    let errors = changes[parent as usize].errors.iter().zip(&change.errors);
                    assert!(errors.clone().all(|(above, below)| above >= below));
                }
            }
        }
        for tet in &change.inserted {
            assert_eq!(live.insert(*tet, Some(k)), None);
        }
        if let Some(index) = &file.index {
            let entry = &index.blocks[file.block_of(k) as usize];
            for &v in change.removed.iter().chain(&change.inserted).flatten() {
                for (x, [low, high]) in positions[v as usize].iter().zip(entry.bounds) {
                    assert!((low..=high).contains(&(*x as u64)));
                }
                for (level, (_, [low, high])) in levels[v as usize].iter().zip(&entry.fields) {
                    assert!((*low..=*high).contains(&(*level as u64)));
                }
            }
            assert!(change.errors.iter().zip(&entry.fields).all(|(error, (largest, _))| error <= largest));
        }
    }
    assert_eq!(live.len(), file.info.tetrahedra as usize);
    let used: BTreeSet<u32> = live.keys().flatten().copied().collect();
    assert_eq!(used.len(), file.info.vertices as usize);
    if let Some(start) = &file.start {
        assert_eq!(start.grows, changes.iter().all(|change| change.inserted.len() > change.removed.len()));
    }
}

#[test]
fn insertions_into_tetrahedra_are_read_alike() {
    for (tets, fields, updates, block_bits) in [(1, 1, 0, 4), (1, 1, 60, 4), (2, 3, 300, 5), (7, 2, 300, 16)]
    {
        let mt = inserted(tets, fields, updates);
        compare(&bytes_in_blocks(&mt, block_bits));
    }
}

const METHODS: [(Method, BuildCriterion); 3] = [
    (Method::Decimate, BuildCriterion::HalfEdge),
    (Method::Decimate, BuildCriterion::Delaunay),
    (Method::Insert, BuildCriterion::Delaunay),
];

fn built(mesh: &TetMesh, (method, criterion): (Method, BuildCriterion), config: BuildConfig) -> Mt {
    let construction = Construction::new(MtKind::Vertex, method, criterion).expect("they go together");
    let config = BuildConfig { construction, ..config };
    tetralod_build::build(mesh, &config).expect("a valid mesh").mt
}

fn precise(position_bits: u32, field_bits: u32) -> BuildConfig {
    BuildConfig {
        all_fields: true,
        position_bits: Some(position_bits),
        field_precision: FieldPrecision::Bits(field_bits),
        ..BuildConfig::of(MtKind::Edge)
    }
}

#[test]
fn built_mts_are_read_alike() {
    let bucky = generate::bucky(6).expect("a small size");
    let mut symbols = BTreeSet::new();
    for how in METHODS {
        for (bits, config) in [(5, BuildConfig::of(MtKind::Edge)), (4, precise(6, 5)), (16, precise(30, 24))]
        {
            let (file, _) = compare(&bytes_in_blocks(&built(&bucky, how, config), bits));
            symbols.extend(file.symbols());
        }
    }
    // Not convex: there is no inserting into it.
    for (size, bits) in [(4, 14), (9, 9)] {
        let flow = generate::sphere_flow(size).expect("a small size");
        for how in &METHODS[..2] {
            let mt = built(&flow, *how, precise(bits, 12));
            symbols.extend(compare(&bytes_in_blocks(&mt, 6)).0.symbols());
        }
    }
    // All that the page knows occurs: with and without fans, seeds out of the cone, refused tetrahedra and faces of the boundary,
    // levels that are far off, and homes that the vertex is outside of.
    let occurs = |context| symbols.iter().any(|symbol| symbol.0 == context);
    assert!((29..36).all(occurs) && (36..144).filter(|context| occurs(*context)).count() > 50);
    let wanted = [(30, 0), (30, 1), (35, 8), (144, 0), (144, 1)];
    let missing: Vec<_> = wanted.iter().filter(|symbol| !symbols.contains(symbol)).collect();
    assert!(missing.is_empty(), "{missing:?}");
    assert!(symbols.range((145, 1)..(165, 2)).any(|symbol| symbol.1 == 1) && occurs(165));
    assert!((166..186).any(occurs) && (186..206).any(occurs));
}

/// Cubes of which parts are missing: what is left meets in faces, edges and vertices.
#[test]
fn parts_that_meet_in_edges_and_vertices_are_read_alike() {
    let mut random = Random::new(3);
    let mut updates = 0;
    for domain in [Domain::Cube(4), Domain::Cube(5), Domain::Ell(3), Domain::TwoComponents(3)] {
        for share in [3, 6, 20] {
            let mut plain = domain.mesh(&mut random);
            plain.tets.retain(|_| !random.once_in(share));
            let used: BTreeSet<u32> = plain.tets.iter().flatten().copied().collect();
            let number: BTreeMap<u32, u32> = used.iter().copied().zip(0..).collect();
            plain.positions = used.iter().map(|&v| plain.positions[v as usize]).collect();
            plain.tets.iter_mut().flatten().for_each(|v| *v = number[v]);
            let values: Vec<f64> = plain.positions.iter().map(|p| f64::from(p[0] * p[1] - p[2])).collect();
            let mut mesh = TetMesh {
                positions: plain.positions.iter().map(|p| p.map(f64::from)).collect(),
                fields: vec![Field::new("f", values)],
                tets: plain.tets,
                ..TetMesh::default()
            };
            mesh.positions.iter_mut().for_each(|p| p[2] += p[0] / 7.0);
            let mt = built(&mesh, METHODS[0], precise(16, 12));
            updates += compare(&bytes_in_blocks(&mt, 4)).1.len();
        }
    }
    assert!(updates > 300, "{updates} updates only");
}

/// Where a field is linear, levels come out at whole numbers and halves but for rounding: the order of operations decides.
#[test]
fn levels_halfway_are_rounded_alike() {
    for size in [5, 6, 7] {
        let mut mesh = generate::bucky(size).expect("a small size");
        linear_fields(&mut mesh);
        for how in METHODS {
            for (position_bits, field_bits) in [(8, 4), (12, 9), (23, 24)] {
                compare(&bytes_in_blocks(&built(&mesh, how, precise(position_bits, field_bits)), 5));
            }
        }
    }
}

fn linear_fields(mesh: &mut TetMesh) {
    let fields = [("x", [1.0, 0.0, 0.0]), ("sum", [1.0, 2.0, 3.0]), ("difference", [7.0, -5.0, 3.0])];
    let linear = |weights: [f64; 3]| {
        let value = |p: &[f64; 3]| 6.0 * (p[0] * weights[0] + p[1] * weights[1] + p[2] * weights[2]);
        mesh.positions.iter().map(value).collect::<Vec<f64>>()
    };
    mesh.fields = fields.map(|(name, weights)| Field::new(name, linear(weights))).into();
}

/// Planes on which the field is the same, in which vertices are anywhere: volumes are beyond what doubles hold.
#[test]
fn volumes_of_many_bits_are_rounded_alike() {
    let mut random = Random::new(17);
    for size in [5, 6, 7, 9] {
        let mut mesh = generate::bucky(size).expect("a small size");
        linear_fields(&mut mesh);
        mesh.fields.truncate(1);
        let on_rim = |x: f64| x == 0.0 || x == 1.0;
        for axis in [1, 2] {
            for p in mesh.positions.iter_mut().filter(|p| !on_rim(p[axis])) {
                p[axis] += 0.02 * f64::from(random.between(-1000, 1000)) / 1000.0;
            }
        }
        for field_bits in [1, 2, 3] {
            compare(&bytes_in_blocks(&built(&mesh, METHODS[0], precise(30, field_bits)), 9));
        }
    }
}

/// Bytes from pairs of hexadecimal digits.
fn bytes_of(text: &str) -> Vec<u8> {
    let digits = text.lines().flat_map(|line| line.split("//").next().unwrap_or("").split_whitespace());
    digits.map(|d| u8::from_str_radix(d, 16).expect("two hexadecimal digits")).collect()
}

#[test]
fn golden_files_are_read_as_ever() {
    for text in [include_str!("../golden/vertex.hex"), include_str!("../golden/half-edge.hex")] {
        let (_, changes) = compare(&bytes_of(text));
        let expected = Change {
            errors: vec![300],
            positions: vec![[8, 6, 11]],
            levels: vec![vec![15]],
            removed: vec![[0, 1, 2, 3]],
            inserted: vec![[0, 1, 2, 5], [0, 1, 3, 5], [0, 2, 3, 5], [1, 2, 3, 5]],
            own: None,
        };
        assert_eq!(changes, [expected]);
    }
}

type Alter = fn(&mut File);

/// A reader that does not find what is wrong proves nothing.
#[test]
fn a_changed_formula_would_be_noticed() {
    let mt = built(&generate::bucky(5).expect("a small size"), METHODS[0], precise(9, 10));
    let bytes = bytes_in_blocks(&mt, 6);
    let (file, parts) = reader::open(&bytes);
    let right = reader::changes(&file, &parts);
    // What a formula of the page is fed with, by its step.
    let alterations: [(&str, Alter); 5] = [
        ("2 and 3", |file| file.base.positions[0][0] ^= 1),
        ("3", |file| file.start.as_mut().expect("kind 1").grain[1] += 1),
        ("7, expected", |file| file.base_levels[0][0] ^= 4),
        ("7, bound", |file| file.info.fields[0].step *= 3.0),
        ("8", |file| file.base.tets[0].swap(0, 1)),
    ];
    for (what, alter) in alterations {
        let (mut file, parts) = reader::open(&bytes);
        alter(&mut file);
        let found = catch_unwind(AssertUnwindSafe(|| reader::changes(&file, &parts)));
        assert!(found.ok() != Some(right.clone()), "{what}");
    }
}

#[test]
fn exact_values_are_read_alike() {
    let flow = generate::sphere_flow(6).expect("a small size");
    for kind in [MtKind::Vertex, MtKind::HalfEdge] {
        let construction =
            Construction::new(kind, Method::Decimate, BuildCriterion::HalfEdge).expect("they go together");
        let config = BuildConfig { construction, all_lossless: true, ..precise(12, 9) };
        let built = tetralod_build::build(&flow, &config);
        let built = built.expect("a valid mesh");
        let options = EncodeOptions { exact: built.exact.clone(), ..options() };
        let (file, changes) = compare(&encode(&built.mt, &options).expect("an MT"));
        compare_exact(&file, &changes, &built.exact);
    }
}

/// Every vertex of the reference mesh has its value.
fn compare_exact(file: &File, changes: &[Change], expected: &[Exact]) {
    let base = (0..file.base.positions.len())
        .map(|v| file.base_levels.iter().map(|levels| levels[v]).collect::<Vec<i32>>());
    let levels: Vec<Vec<i32>> =
        base.chain(changes.iter().flat_map(|change| change.levels.iter().cloned())).collect();
    assert_eq!(file.exact.len(), expected.len());
    assert!(!expected.is_empty());
    for (ours, theirs) in file.exact.iter().zip(expected) {
        let field = &file.info.fields[ours.field as usize];
        assert_eq!(ours.corrections.len(), file.info.vertices as usize);
        for &(vertex, correction) in &ours.corrections {
            let level = f64::from(levels[vertex as usize][ours.field as usize]);
            let value = ours.value(field.origin + field.step * level, correction);
            assert_eq!(Some(value.to_bits()), theirs.get(VertexId(vertex)).map(f64::to_bits));
        }
    }
}

#[test]
fn errors_of_tetrahedra_are_read_alike() {
    let mesh = generate::bucky(7).expect("a size that is allowed");
    let construction = Construction::new(MtKind::Vertex, Method::Insert, BuildCriterion::Delaunay)
        .and_then(Construction::with_tet_errors)
        .expect("they go together");
    let config = BuildConfig { construction, ..BuildConfig::of(MtKind::Edge) };
    let built = tetralod_build::build(&mesh, &config);
    let mt = in_blocks(&built.expect("a good mesh").mt, 5);
    let bytes = encode(&mt, &EncodeOptions::default()).expect("a complete MT");
    let (file, changes) = compare(&bytes);
    assert!(file.tet_errors);
    let own: Vec<&(u32, Vec<u32>)> = changes.iter().filter_map(|change| change.own.as_ref()).collect();
    assert_eq!(own.len(), changes.len());
    let quarters: BTreeSet<u32> = own.iter().flat_map(|(_, quarters)| quarters).copied().collect();
    assert!(quarters.len() == 4 && own.iter().any(|(fall, _)| *fall > 0));
}
