//! Promise: what is built in parts is one MT like any other, over the same reference mesh, with errors that hold; one part is the
//! whole; and no damaged part makes a step panic.

use crate::support::meshes::{bent, blocks, hilly, linear};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::ops::ControlFlow;
use tetralod::format::{BlockEncoder, BlockShelf, EncodeOptions, encode};
use tetralod::mesh::{Field, Grid, TetMesh};
use tetralod::mt::{Exact, ExactValues, Mt, MtKind, MultiTessellation, UpdatePages};
use tetralod_build::parts::{self, Assembled, InMemory, Node, Part, PartUpdates, PartsError, Plan};
use tetralod_build::verify::{self, Reference};
use tetralod_build::{BuildConfig, BuildError, BuildProgress, BuildResult, OnProgress};

fn go_on(_: BuildProgress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// What each step writes, by node.
#[derive(Default)]
struct Files {
    parted: Vec<Vec<u8>>,
    built: BTreeMap<Node, Vec<u8>>,
}

impl Files {
    fn parted(mesh: &TetMesh, config: &BuildConfig, parts: u32) -> (Plan, Self) {
        let mut files = Self::default();
        let plan = parts::part(mesh, config, parts, BTreeMap::new(), &mut |part| {
            let mut bytes = Vec::new();
            part.write(&mut bytes)?;
            files.parted.push(bytes);
            Ok(())
        });
        (plan.expect("a mesh that can be parted"), files)
    }

    fn build(&mut self, index: u32) {
        let scratch = InMemory::at_once();
        let part = read(&self.parted[index as usize], &scratch).expect("a part");
        let (part, updates) = parts::build_part(part, &scratch, &mut go_on).expect("a part to build");
        self.keep(part, &updates);
        assert_eq!(scratch.names(), [""; 0], "nothing is left in the scratch");
    }

    fn keep(&mut self, part: Part<'_>, updates: &PartUpdates) {
        let mut bytes = Vec::new();
        part.write_built(updates, &mut bytes).expect("bytes");
        assert_eq!(&PartUpdates::read(&mut Cursor::new(&bytes)).expect("updates"), updates);
        let scratch = InMemory::default();
        let again = read(&bytes, &scratch).expect("a part");
        // The points in a bucket come in the other order.
        let (mut turned, mut twice) = (Vec::new(), Vec::new());
        again.write_built(updates, &mut turned).expect("bytes");
        let again = read(&turned, &scratch).expect("a part");
        again.write_built(updates, &mut twice).expect("bytes");
        assert!(bytes == twice, "another part");
        self.built.insert(part.node(), bytes);
    }

    /// Joins twice, with points that are in memory and with points that are not.
    fn join(&mut self, plan: &Plan, node: Node) {
        let children = plan.children(node).expect("children");
        let mut files = Vec::new();
        for scratch in [InMemory::default(), InMemory::at_once()] {
            let left =
                children.iter().map(|child| read(&self.built[child], &scratch).expect("a part")).collect();
            let (part, updates) = parts::join(node, left, &scratch, &mut go_on).expect("parts to join");
            let mut bytes = Vec::new();
            part.write_built(&updates, &mut bytes).expect("bytes");
            files.push(bytes);
            self.keep(part, &updates);
            assert_eq!(scratch.names(), [""; 0], "nothing is left in the scratch");
        }
        assert!(files[0] == files[1], "another part");
    }

    /// Joins the nodes below a level, those of each level in any order.
    fn join_below(&mut self, plan: &Plan, end: u32) {
        for (level, nodes) in (0..end).zip(plan.levels()).skip(1) {
            (0..nodes).rev().for_each(|index| self.join(plan, Node { level, index }));
        }
    }

    fn updates(&self, node: Node) -> Result<PartUpdates, PartsError> {
        PartUpdates::read(&mut Cursor::new(&self.built[&node]))
    }

    fn left(&self, node: Node) -> Result<Part<'static>, PartsError> {
        Part::read_mesh(&mut Cursor::new(&self.built[&node]))
    }

    /// The MT as a whole. Its file is the same where it is written while the MT is made.
    fn assemble(&self, plan: &Plan) -> BuildResult {
        let (left, updates) = (|node| self.left(node), |node| self.updates(node));
        let built = parts::assemble(plan, &left, &updates, &mut go_on).expect("an MT");
        let (mut aside, scratch) = (Aside::default(), InMemory::default());
        let mut encoder = BlockEncoder::new(&mut aside);
        let take = &mut |builder: &mut _| encoder.take_blocks(builder).map_err(PartsError::other);
        let made = parts::assemble_blocks(plan, (&left, &updates), &scratch, take, &mut go_on);
        let Assembled { builder, summary, exact } = made.expect("an MT");
        let mut bytes = Vec::new();
        let (mt, len) = encoder
            .finish(builder, || exact.tables(Exact::IN_A_SECTION), &options(&built), &mut bytes)
            .expect("a file");
        assert!(bytes == self::bytes(&built), "another file");
        assert_eq!((mt.info(), summary, len), (built.mt.info(), built.summary, bytes.len() as u64));
        // Never are all blocks in the MT.
        let last = built.mt.updates().saturating_sub(1) >> built.mt.page_bits();
        assert!((0..last).all(|page| !mt.has_page(page)), "blocks that were to be taken");
        let names = if built.exact.is_empty() { &[][..] } else { &["exact"] };
        assert_eq!(scratch.names(), names, "more is left in the scratch");
        built
    }
}

/// Blocks that are put aside.
#[derive(Default)]
struct Aside(BTreeMap<u32, Vec<u8>>);

impl BlockShelf for Aside {
    fn put(&mut self, block: u32, bytes: &[u8]) -> std::io::Result<()> {
        self.0.insert(block, bytes.to_vec());
        Ok(())
    }

    fn get(&self, block: u32) -> std::io::Result<Vec<u8>> {
        self.0.get(&block).cloned().ok_or_else(|| std::io::ErrorKind::NotFound.into())
    }
}

fn options(built: &BuildResult) -> EncodeOptions {
    EncodeOptions {
        check_margins: true,
        exact: built.exact.clone(),
        histograms: true,
        ..EncodeOptions::default()
    }
}

fn read<'s>(bytes: &[u8], scratch: &'s InMemory) -> Result<Part<'s>, PartsError> {
    Part::read(&mut Cursor::new(bytes), scratch)
}

pub fn in_parts(mesh: &TetMesh, config: &BuildConfig, parts: u32) -> BuildResult {
    let (plan, mut files) = Files::parted(mesh, config, parts);
    // In any order.
    (0..parts).rev().for_each(|index| files.build(index));
    files.join_below(&plan, u32::MAX);
    files.assemble(&plan)
}

pub fn bytes(built: &BuildResult) -> Vec<u8> {
    let options = options(built);
    let bytes = encode(&built.mt, &options).expect("an MT that can be written");
    // In pages anew nothing is known of the blocks.
    let scanned = built.mt.in_pages(built.mt.page_bits()).expect("a complete MT");
    assert!(encode(&scanned, &options).expect("an MT that can be written") == bytes, "other blocks");
    bytes
}

/// A convex grid, one that is not convex, with two fields, and curved boundaries on a lattice that moves points.
fn meshes() -> [(&'static str, TetMesh); 3] {
    let notched = blocks([10, 8, 7], &[hilly, linear], |[x, y, z]| x < 6 || y < 3 || z > 4);
    [("cube", blocks([9; 3], &[hilly], |_| true)), ("notched", notched), ("bent", bent(8))]
}

#[test]
fn one_part_is_the_whole() {
    for (name, mesh) in meshes() {
        let config = BuildConfig { all_lossless: true, ..BuildConfig::default() };
        let whole = tetralod_build::build_with(&mesh, &config, &mut go_on).expect("a valid mesh");
        let one = in_parts(&mesh, &config, 1);
        assert_eq!(one.summary, whole.summary, "{name}");
        assert!(bytes(&one) == bytes(&whole), "{name}: other bytes");
    }
}

#[test]
fn parts_keep_exact_values() {
    let mut mesh = blocks([26; 3], &[hilly, linear], |_| true);
    // One of the fields needs double precision, by a value of one part.
    mesh.fields[0].values.iter_mut().for_each(|x| *x = f64::from(*x as f32));
    mesh.fields[1].values.iter_mut().for_each(|x| *x = f64::from(*x as f32));
    mesh.fields[1].values[4000] += 1e-12;
    let config = BuildConfig { all_fields: true, all_lossless: true, ..BuildConfig::default() };
    let built = in_parts(&mesh, &config, 8);
    let [single, double] = &built.exact[..] else { panic!("{} fields", built.exact.len()) };
    assert!(matches!((&single.values, &double.values), (ExactValues::F32(_), ExactValues::F64(_))));
    for (exact, field) in built.exact.iter().zip(&mesh.fields) {
        assert!(exact.vertices.len() > Exact::IN_A_SECTION as usize);
        for (&vertex, value) in built.vertices.iter().zip(&field.values) {
            assert_eq!(exact.get(vertex).map(f64::to_bits), Some(value.to_bits()));
        }
    }
}

#[test]
fn parts_state_the_extremes_of_the_whole() {
    let (_, mut mesh) = meshes().into_iter().nth(1).expect("a mesh");
    mesh.cell_fields = vec![Field::new("m", (0..mesh.tets.len()).map(|t| (t % 11) as f64).collect())];
    mesh.cells_to_points();
    let config = BuildConfig { all_fields: true, ..BuildConfig::default() };
    let whole = tetralod_build::build(&mesh, &config).expect("a valid mesh").mt;
    assert!(whole.info().fields.iter().all(|field| field.extremes.is_some()));
    assert_eq!(whole.info().averaged_fields().len(), 1);
    let built = in_parts(&mesh, &config, 8);
    for (found, expected) in built.mt.info().fields.iter().zip(&whole.info().fields) {
        assert_eq!((&found.extremes, &found.averaged), (&expected.extremes, &expected.averaged));
    }
    // And the promise is checked.
    let report = verify::run(&built.mt, &mesh, Reference::Mesh, &mut |_, _| {});
    assert!(report.valid, "{:#?}", report.failures);
    let failures = |change: &dyn Fn(&mut TetMesh)| {
        let mut other = mesh.clone();
        change(&mut other);
        verify::run_requests(&built.mt, &other, Reference::Mesh, &[], &mut |_, _| {}).failures
    };
    assert_eq!(failures(&|_| {}), [""; 0]);
    let named = |failures: &[String]| failures.iter().filter(|text| text.starts_with("extremes of")).count();
    assert_eq!(named(&failures(&|mesh| mesh.fields[0].values.iter_mut().for_each(|x| *x += 1e-9))), 1);
    assert_eq!(named(&failures(&|mesh| mesh.positions.iter_mut().for_each(|p| p[0] += 1e-9))), 3);
    let least =
        |mesh: &mut TetMesh| mesh.fields[2].averaged.iter_mut().for_each(|of| of.input.min.value -= 1.0);
    assert_eq!(named(&failures(&least)), 1);
}

#[test]
fn parts_make_one_mt_that_keeps_every_promise() {
    for (name, mesh) in meshes() {
        let config = BuildConfig { all_fields: true, ..BuildConfig::default() };
        let whole = tetralod_build::build_with(&mesh, &config, &mut go_on).expect("a valid mesh").summary;
        for parts in [2, 8, 16] {
            let built = in_parts(&mesh, &config, parts);
            let summary = built.summary;
            assert_eq!(
                (summary.vertices, summary.tetrahedra, summary.updates + summary.base_vertices),
                (whole.vertices, whole.tetrahedra, whole.vertices),
                "{name}, {parts}"
            );
            // What was between parts is simplified, too.
            assert!(summary.base_vertices <= 2 * whole.base_vertices + 8, "{name}, {parts}: {summary:?}");
            let report = verify::run(&built.mt, &mesh, Reference::Mesh, &mut |_, _| {});
            assert!(report.valid && report.queries > 40, "{name}, {parts}: {:#?}", report.failures);
            let again = in_parts(&mesh, &config, parts);
            assert!(bytes(&again) == bytes(&built), "{name}, {parts}: other bytes the next time");
        }
    }
}

/// A part that has not been built, as a file.
pub fn written(part: &Part<'_>) -> Vec<u8> {
    let mut bytes = Vec::new();
    part.write(&mut bytes).expect("bytes");
    bytes
}

/// What [`parts::part`] passes on.
pub fn parted(mesh: &TetMesh, config: &BuildConfig, parts: u32) -> (Plan, Vec<Part<'static>>) {
    let mut all = Vec::new();
    let plan = parts::part(mesh, config, parts, BTreeMap::new(), &mut |part| {
        all.push(part);
        Ok(())
    });
    (plan.expect("a mesh that can be parted"), all)
}

#[test]
fn a_grid_alone_has_the_parts_of_its_mesh() {
    let grids = [
        ([9, 9, 9], [0.0; 3], [0.125; 3]),
        ([17, 6, 12], [-3.0, 0.7, 1e3], [1.0, 2.5, 0.3]),
        ([2, 40, 3], [0.1; 3], [0.1, 0.2, 0.3]),
        ([5, 5, 5], [1e9; 3], [1e-3; 3]),
    ];
    for (dims, origin, spacing) in grids {
        let grid = Grid { dims, origin, spacing };
        let whole = TetMesh::from_grid(grid, Vec::new());
        let fields: Vec<Field> = [hilly as fn([f64; 3]) -> f64, linear]
            .iter()
            .zip(["a", "b"])
            .map(|(of, name)| Field::new(name, whole.positions.iter().map(|p| of(*p)).collect()))
            .collect();
        let whole = TetMesh { fields: fields.clone(), ..whole };
        let alone = TetMesh::of_grid_alone(grid, fields);
        assert_eq!(alone.counts(), [whole.positions.len() as u64, whole.tets.len() as u64]);
        let keep_points = vec![grid.point([1, 2, 0]), grid.point(dims.map(|n| n - 1))];
        for (position_bits, keep_points) in [(None, keep_points), (Some(12), Vec::new())] {
            for count in [1, 2, 8, 16] {
                let keep_points = keep_points.clone();
                let config =
                    BuildConfig { all_fields: true, position_bits, keep_points, ..BuildConfig::default() };
                let [expected, found] = [&whole, &alone].map(|mesh| parted(mesh, &config, count));
                assert_eq!(found.0, expected.0, "{dims:?}, {count}");
                for (found, expected) in found.1.iter().zip(&expected.1) {
                    assert!(
                        written(found) == written(expected),
                        "{dims:?}, {count} parts: {:?} differs",
                        found.node()
                    );
                }
                assert_eq!(found.1.len(), count as usize);
            }
        }
    }
    // What only a mesh can tell is refused as of a mesh.
    let grid = Grid { dims: [3; 3], origin: [0.0; 3], spacing: [1.0; 3] };
    let refused = |values: Vec<f64>, parts: u32| {
        let alone = TetMesh::of_grid_alone(grid, vec![Field::new("a", values)]);
        parts::part(&alone, &BuildConfig::default(), parts, BTreeMap::new(), &mut |_| Ok(()))
            .expect_err("refused")
    };
    assert!(matches!(refused(vec![0.0; 26], 2), PartsError::Build(BuildError::Mesh(_))));
    let mut values = vec![0.0; 27];
    assert!(matches!(refused(values.clone(), 64), PartsError::TooMany { parts: 64, tetrahedra: 48 }));
    let alone = TetMesh::of_grid_alone(grid, vec![Field::new("a", values.clone())]);
    let keep = |place: [f64; 3]| BuildConfig { keep_points: vec![place], ..BuildConfig::default() };
    let between = parts::part(&alone, &keep([0.5; 3]), 2, BTreeMap::new(), &mut |_| Ok(()));
    assert!(matches!(between, Err(PartsError::Build(BuildError::NoPoint { .. }))));
    values[7] = f64::NAN;
    assert!(matches!(refused(values, 2), PartsError::Build(BuildError::NotFinite { point: 7 })));
}

#[test]
fn the_progress_of_a_step_is_that_of_the_step() {
    let mesh = blocks([24; 3], &[hilly], |_| true);
    let (plan, mut files) = Files::parted(&mesh, &BuildConfig::default(), 8);
    (0..8).for_each(|index| files.build(index));
    let whole = plan.nodes()[0];
    files.join_below(&plan, whole.level);
    let shares = |work: &dyn Fn(OnProgress<'_>)| {
        let mut shares = Vec::new();
        work(&mut |now: BuildProgress| {
            if now.stage == "remove" {
                shares.push(now.done as f64 / now.total as f64);
            }
            go_on(now)
        });
        assert!(shares.is_sorted() && shares.iter().all(|share| (0.0..=1.0).contains(share)), "{shares:?}");
        (shares[0], shares.pop().expect("progress"))
    };
    let children = plan.children(whole).expect("children");
    let scratch = &InMemory::default();
    let left = || children.iter().map(|child| read(&files.built[child], scratch).expect("a part")).collect();
    // Neither the vertices that were removed before count, nor those that stay.
    let (first, last) =
        shares(&|progress| drop(parts::join(whole, left(), scratch, progress).expect("a join")));
    assert!(first < 0.1 && last > 0.5, "{first} to {last}");
    let part = || read(&files.parted[0], scratch).expect("a part");
    let build =
        |progress: OnProgress<'_>| drop(parts::build_part(part(), scratch, progress).expect("a part"));
    let (first, last) = shares(&build);
    assert!(first < 0.1 && last > 0.5, "{first} to {last}");
}

#[test]
fn eight_are_joined_at_a_time_and_the_last_eight_in_two_steps() {
    let mesh = blocks([6; 3], &[hilly], |_| true);
    let (plan, files) = Files::parted(&mesh, &BuildConfig::default(), 32);
    assert_eq!((plan.parts(), plan.levels()), (32, vec![32, 8, 2, 1]));
    assert_eq!(plan.nodes().len(), 43);
    // Each is of one node of the next level, in their order.
    for (level, nodes) in (0..).zip(plan.levels()).skip(1) {
        let children = (0..nodes).flat_map(|index| plan.children(Node { level, index }).expect("children"));
        assert!(
            children.eq((0..plan.levels()[level as usize - 1]).map(|index| Node { level: level - 1, index }))
        );
        assert!(plan.children(Node { level, index: nodes }).is_err());
    }
    assert!(
        plan.children(Node { level: 0, index: 0 }).is_err()
            && plan.children(Node { level: 4, index: 0 }).is_err()
    );
    let larger = blocks([12; 3], &[hilly], |_| true);
    let levels = |parts| Files::parted(&larger, &BuildConfig::default(), parts).0.levels();
    assert_eq!((levels(1), levels(2), levels(16)), (vec![1], vec![2, 1], vec![16, 8, 2, 1]));
    assert_eq!((levels(64), levels(128)), (vec![64, 8, 2, 1], vec![128, 16, 8, 2, 1]));
    let scratch = InMemory::default();
    let sizes: Vec<usize> =
        files.parted.iter().map(|bytes| read(bytes, &scratch).expect("a part").tetrahedra()).collect();
    assert_eq!(sizes.iter().sum::<usize>(), mesh.tets.len());
    assert!(sizes.iter().all(|&n| n > 0));
}

#[test]
fn what_cannot_be_parted_or_joined_is_refused() {
    let mesh = blocks([4; 3], &[hilly], |_| true);
    let config = BuildConfig::default();
    let part = |mesh: &TetMesh, config: &BuildConfig, parts: u32| {
        parts::part(mesh, config, parts, BTreeMap::new(), &mut |_| Ok(())).expect_err("a refusal")
    };
    assert!(matches!(part(&mesh, &config, 3), PartsError::Count { parts: 3 }));
    assert!(matches!(part(&mesh, &config, 0), PartsError::Count { parts: 0 }));
    assert!(matches!(part(&mesh, &config, 4096), PartsError::TooMany { parts: 4096, .. }));
    assert!(matches!(part(&mesh, &BuildConfig::of(MtKind::Edge), 2), PartsError::Kind));
    let mut unused = mesh.clone();
    unused.positions.push([9.0; 3]);
    unused.fields[0].values.push(0.0);
    unused.grid = None;
    assert!(matches!(part(&unused, &config, 2), PartsError::UnusedPoint { point: 125 }));
    let unknown = BuildConfig { fields: vec!["g".to_owned()], ..config.clone() };
    assert!(matches!(part(&mesh, &unknown, 2), PartsError::Build(BuildError::UnknownField { .. })));

    let within = BuildConfig { preserve: vec!["f".to_owned()], preserve_within: 0.1, ..config.clone() };
    assert!(matches!(part(&mesh, &within, 2), PartsError::Build(BuildError::Combination { .. })));

    let (plan, mut files) = Files::parted(&mesh, &config, 8);
    (0..8).for_each(|index| files.build(index));
    let scratch = &InMemory::default();
    let left = || -> Vec<Part<'_>> {
        plan.children(Node { level: 1, index: 0 })
            .expect("four")
            .iter()
            .map(|child| read(&files.built[child], scratch).expect("a part"))
            .collect()
    };
    let top = Node { level: 1, index: 0 };
    let mut turned = left();
    turned.swap(0, 1);
    assert!(matches!(parts::join(top, turned, scratch, &mut go_on), Err(PartsError::Children { .. })));
    let mut few = left();
    few.pop();
    assert!(matches!(parts::join(top, few, scratch, &mut go_on), Err(PartsError::Children { .. })));
    let unbuilt = files.parted.iter().map(|bytes| read(bytes, scratch).expect("a part")).collect();
    assert!(matches!(parts::join(top, unbuilt, scratch, &mut go_on), Err(PartsError::Children { .. })));
    let (_, mut other) = Files::parted(&blocks([4; 3], &[linear], |_| true), &config, 8);
    other.build(0);
    let mut mixed = left();
    mixed[0] = read(&other.built[&Node { level: 0, index: 0 }], scratch).expect("a part");
    assert!(matches!(parts::join(top, mixed, scratch, &mut go_on), Err(PartsError::OtherPlan)));
    let part = read(&files.parted[0], scratch).expect("a part");
    let stopped = parts::build_part(part, scratch, &mut |_| ControlFlow::Break(()));
    assert!(matches!(stopped, Err(PartsError::Build(BuildError::Stopped))));
    let twice = parts::build_part(left().remove(0), scratch, &mut go_on);
    assert!(twice.is_err());
}

#[test]
fn damaged_parts_are_refused() {
    let mesh = blocks([4; 3], &[hilly], |_| true);
    let (plan, mut files) = Files::parted(&mesh, &BuildConfig::default(), 2);
    (0..2).for_each(|index| files.build(index));
    let top = Node { level: 1, index: 0 };
    files.join(&plan, top);
    let scratch = InMemory::default();
    for bytes in [&files.parted[0], &files.built[&top]] {
        for at in (0..bytes.len()).step_by(bytes.len() / 97 + 1) {
            assert!(read(&bytes[..at], &scratch).is_err(), "cut at {at}");
            let mut flipped = bytes.clone();
            flipped[at] ^= 0x10;
            let same =
                read(&flipped, &scratch).is_ok() && PartUpdates::read(&mut Cursor::new(&flipped)).is_ok();
            assert!(!same, "flipped at {at}");
        }
    }
    // What is missing is told, not made up.
    let (left, updates) = (|node| files.left(node), |node| files.updates(node));
    assert!(parts::assemble(&plan, &left, &|_| files.updates(top), &mut go_on).is_err());
    assert!(parts::assemble(&plan, &|_| files.left(top), &updates, &mut go_on).is_err());
    let mt: Mt = files.assemble(&plan).mt;
    assert_eq!(mt.info().vertices, 125);
}
