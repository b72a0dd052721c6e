//! Files of kind 3.

use super::*;
use crate::reader::half_edge;
use crate::reader::half_edge::Record;
use crate::reader::half_edge_mesh::Mesh;
use crate::support::files;
use crate::support::meshes::{blocks, cube, hilly, linear};
use tetralod::mt::{Applied, ApplyUpdates};
use tetralod_build::{Construction, Purpose};

fn built(mesh: &TetMesh, config: BuildConfig) -> Mt {
    let config = BuildConfig { all_fields: true, ..config };
    let built = tetralod_build::build(mesh, &config);
    built.expect("a valid mesh").mt
}

/// With lattices of so many bits.
fn with_bits(purpose: Purpose, position_bits: u32, field_bits: u32) -> BuildConfig {
    BuildConfig {
        construction: Construction::HalfEdge { purpose },
        position_bits: Some(position_bits),
        field_precision: FieldPrecision::Bits(field_bits),
        ..BuildConfig::of(MtKind::HalfEdge)
    }
}

/// Moves inner vertices of the unit cube.
fn shaken(mut mesh: TetMesh, random: &mut Random, most: f64) -> TetMesh {
    let on_rim = |x: f64| x == 0.0 || x == 1.0;
    for p in mesh.positions.iter_mut().filter(|p| !p.iter().any(|x| on_rim(*x))) {
        *p = p.map(|x| x + most * f64::from(random.between(-1000, 1000)) / 1000.0);
    }
    TetMesh { grid: None, ..mesh }
}

/// A grid of cells of a size in steps of a lattice of 30 bits, beyond what products in doubles hold: many choices are as good as
/// each other but for what is rounded. A tetrahedron apart from it reaches to the far corner of the lattice.
fn wide_grid(cells: u32, size: [u32; 3], field: fn([f64; 3]) -> f64) -> TetMesh {
    let mut mesh = cube(cells, &[field]);
    let far = mesh.positions.len() as u32;
    let scale = size.map(|size| f64::from(cells * size));
    mesh.positions.iter_mut().for_each(|p| *p = [0, 1, 2].map(|k| (p[k] * scale[k]).round()));
    let ends = [[0, 0, 0], [-3, 0, 0], [0, -3, 0], [0, 0, -3]];
    mesh.positions.extend(ends.map(|p| p.map(|x| f64::from(x + (1 << 30)))));
    mesh.fields[0].values.extend([0.5; 4]);
    mesh.tets.push([far, far + 2, far + 1, far + 3]);
    tetralod::mesh::repair(TetMesh { grid: None, ..mesh }).expect("a grid and a tetrahedron").0
}

#[test]
fn random_insertions_are_read_alike() {
    for (tets, fields, updates, block_bits) in [(1, 1, 0, 4), (1, 1, 60, 4), (2, 3, 300, 5), (7, 2, 300, 16)]
    {
        compare(&bytes_in_blocks(&files::half_edge(tets, fields, updates), block_bits));
    }
}

/// Of grids, where choices are often as good as each other, and of meshes without any symmetry.
#[test]
fn built_mts_are_read_alike() {
    let grid = cube(6, &[hilly, linear]);
    let meshes = [shaken(grid.clone(), &mut Random::new(5), 0.03), grid];
    let mut symbols = BTreeSet::new();
    for purpose in [Purpose::Uniform, Purpose::Regions] {
        for (position_bits, field_bits, block_bits) in [(6, 5, 4), (16, 12, 5), (30, 24, 4)] {
            for mesh in &meshes {
                let mt = built(mesh, with_bits(purpose, position_bits, field_bits));
                symbols.extend(compare(&bytes_in_blocks(&mt, block_bits)).0.symbols());
            }
        }
    }
    // All that the page knows occurs: every context of one kind only, stars with so many symbols and bits that they have any
    // context, removers that are none of the weighed ones, named in one symbol and in more, and blocks before the last.
    let occurs = |context| symbols.iter().any(|symbol| symbol.0 == context);
    assert!((29..35).all(occurs) && (35..101).filter(|context| occurs(*context)).count() > 40);
    for first in [102, 167] {
        let reached = [(0, 1), (1, 2), (2, 4), (3, 4), (4, 5), (5, 6), (6, 7), (7, 8)];
        let all = reached.map(|(row, columns)| (0..columns).map(move |column| first + 8 * row + column));
        // The last bit of a star is 1.
        let is_told = |context: &u32| first == 102 || ![167, 176, 186, 195].contains(context);
        let missing: Vec<u32> = all.into_iter().flatten().filter(is_told).filter(|c| !occurs(*c)).collect();
        assert!(missing.is_empty(), "{missing:?}");
    }
    assert!(symbols.range((102, 0)..(166, 0)).any(|symbol| symbol.1 > 8));
    assert!(symbols.range((33, 0)..(34, 0)).any(|symbol| symbol.1 % 2 == 1));
}

#[test]
fn products_beyond_doubles_are_rounded_alike() {
    // Where another order of sums or products, or of neighbours, would show.
    let small = 47_166_671;
    let grids = [(5, [140_000_005; 3]), (7, [107_142_861; 3]), (6, [small, 2 * small, 3 * small])];
    for (cells, size) in grids {
        for field in [hilly, linear] {
            let mt = built(&wide_grid(cells, size, field), with_bits(Purpose::Uniform, 30, 12));
            assert_eq!(mt.info().lattice.step, [1.0; 3]);
            compare(&bytes_in_blocks(&mt, 5));
        }
    }
}

/// No corner changes its place: that is seen in a current mesh only.
#[test]
fn corners_come_in_the_same_order() {
    let mesh = shaken(cube(5, &[hilly, linear]), &mut Random::new(2), 0.03);
    let bytes = bytes_in_blocks(&built(&mesh, with_bits(Purpose::Uniform, 14, 10)), 4);
    let mt = decode(&bytes).expect("a good file");
    let mut current = mt.start().expect("a base mesh");
    let (file, parts) = reader::open(&bytes);
    let mut mesh = Mesh::new(&file);
    for block in 0..parts.len() as u32 {
        mesh.add_block(half_edge::block(&file, block, &parts[block as usize]));
        for k in file.updates(block) {
            mesh.apply(k);
            assert_eq!(mt.refine(&mut current, UpdateId(k)), Ok(Applied::Done));
            let found = (0..current.tet_slots() as u32).filter_map(|t| current.tet(t));
            let found: BTreeSet<Tet> = found.map(|tet| tet.map(|v| current.vertex(v).0)).collect();
            let ours: BTreeSet<Tet> = mesh.tets.iter().map(|marked| marked.tet).collect();
            assert_eq!(ours, found, "update {k}");
        }
    }
    for (&v, vertex) in &mesh.vertices {
        let slot = current.slot(VertexId(v)).expect("a vertex of the mesh");
        assert_eq!(
            (vertex.position, &vertex.levels[..]),
            (current.positions()[slot as usize], current.levels(slot))
        );
    }
}

#[test]
fn meshes_that_are_not_convex_are_read_alike() {
    for (size, position_bits) in [(4, 14), (6, 9)] {
        let flow = generate::sphere_flow(size).expect("a small size");
        for purpose in [Purpose::Uniform, Purpose::Regions] {
            let mt = built(&flow, with_bits(purpose, position_bits, 12));
            compare(&bytes_in_blocks(&mt, 6));
        }
    }
}

/// Cubes of which parts are missing: what is left meets in faces, edges and vertices.
#[test]
fn parts_that_meet_in_edges_and_vertices_are_read_alike() {
    let mut random = Random::new(3);
    let mut updates = 0;
    for share in [3, 6, 20] {
        let cells = [5, 4, 4];
        let gone: BTreeSet<[u32; 3]> =
            (0..80).filter(|_| random.once_in(share)).map(|i| [i % 5, i / 5 % 4, i / 20]).collect();
        let mesh = blocks(cells, &[hilly], |cell| !gone.contains(&cell));
        let mt = built(&mesh, with_bits(Purpose::Uniform, 16, 12));
        updates += compare(&bytes_in_blocks(&mt, 4)).1.len();
    }
    assert!(updates > 100, "{updates} updates only");
}

/// What some updates depend on, these included; parents have lower numbers.
fn closure(mt: &ExplicitMt, of: &[u32]) -> BTreeSet<u32> {
    let mut closure: BTreeSet<u32> = of.iter().copied().collect();
    for k in (0..mt.updates()).rev() {
        if closure.contains(&k) {
            closure.extend(mt.parents(UpdateId(k)));
        }
    }
    closure
}

/// A reader that has no more than the blocks of the updates that it applies, in any order, finds what each removes and
/// inserts, and which can be applied.
#[test]
fn blocks_are_read_and_used_by_themselves() {
    let mesh = shaken(cube(7, &[hilly, linear]), &mut Random::new(9), 0.02);
    let bytes = bytes_in_blocks(&built(&mesh, with_bits(Purpose::Regions, 14, 10)), 4);
    let mt = spelled_out(&decode(&bytes).expect("a good file"));
    let (file, parts) = reader::open(&bytes);
    let mut random = Random::new(21);
    let mut fewest = usize::MAX;
    for _ in 0..12 {
        let wanted = closure(&mt, &[random.below(mt.updates() as usize) as u32]);
        let mut blocks: Vec<u32> = wanted.iter().map(|&k| file.block_of(k)).collect();
        blocks.dedup();
        random.shuffle(&mut blocks);
        fewest = fewest.min(blocks.len());
        let mut mesh = Mesh::new(&file);
        for block in blocks {
            mesh.add_block(half_edge::block(&file, block, &parts[block as usize]));
        }
        let mut left: Vec<u32> = wanted.iter().copied().collect();
        while !left.is_empty() {
            random.shuffle(&mut left);
            let is_ready = |k: u32| mt.parents(UpdateId(k)).iter().all(|parent| !left.contains(parent));
            for &k in left.iter().take(5) {
                assert_eq!(mesh.is_feasible(k), is_ready(k), "update {k}");
            }
            let k = left.iter().copied().find(|&k| is_ready(k)).expect("one without parents");
            assert_eq!(without_orders(mesh.apply(k)), change_of(&mt, UpdateId(k)));
            left.retain(|&other| other != k);
        }
    }
    assert!(fewest < parts.len() / 2, "{fewest} of {} blocks", parts.len());
}

#[test]
fn exact_values_are_read_alike() {
    let flow = generate::sphere_flow(6).expect("a small size");
    let config = BuildConfig { all_fields: true, all_lossless: true, ..with_bits(Purpose::Uniform, 12, 9) };
    let built = tetralod_build::build(&flow, &config);
    let built = built.expect("a valid mesh");
    let options = EncodeOptions { exact: built.exact.clone(), ..files::options() };
    let (file, changes) = compare(&encode(&built.mt, &options).expect("an MT"));
    compare_exact(&file, &changes, &built.exact);
}

type Alter = fn(&mut File, &mut [Record]);

fn first_with(records: &mut [Record], is_such: fn(&Record) -> bool) -> &mut Record {
    records.iter_mut().find(|record| is_such(record)).expect("such an update")
}

/// A reader that does not find what is wrong proves nothing.
#[test]
fn a_changed_formula_would_be_noticed() {
    let mesh = shaken(cube(6, &[hilly]), &mut Random::new(1), 0.03);
    let bytes = bytes_in_blocks(&built(&mesh, with_bits(Purpose::Uniform, 12, 10)), 4);
    let read = |alter: Alter| {
        let (mut file, parts) = reader::open(&bytes);
        let blocks = (0..).zip(&parts).flat_map(|(block, parts)| half_edge::block(&file, block, parts));
        let mut records: Vec<Record> = blocks.collect();
        alter(&mut file, &mut records);
        let mut mesh = Mesh::new(&file);
        mesh.add_block(records);
        (0..file.info.updates).map(|k| mesh.apply(k)).collect::<Vec<Change>>()
    };
    let right = read(|_, _| {});
    let alterations: [(&str, Alter); 7] = [
        ("positions", |file, _| file.base.positions[0][0] ^= 1),
        ("levels", |file, _| file.base_levels[0][0] ^= 4),
        ("base removers", |file, _| {
            let marks = &mut file.forest.as_mut().expect("kind 3").marks;
            marks.iter_mut().for_each(|mark| mark.inner = [false; 4]);
        }),
        ("offsets", |file, _| {
            let children = &mut file.forest.as_mut().expect("kind 3").children;
            children.iter_mut().flatten().for_each(|child| child.offset[1] += 1);
        }),
        ("symbols", |_, records| first_with(records, |record| !record.symbols.is_empty()).symbols[0] ^= 1),
        ("bits", |_, records| first_with(records, |record| !record.bits.is_empty()).bits[0] ^= true),
        ("residuals", |_, records| records[7].residuals[0] += 1),
    ];
    for (what, alter) in alterations {
        let found = catch_unwind(AssertUnwindSafe(|| read(alter)));
        assert!(found.ok() != Some(right.clone()), "{what}");
    }
}
