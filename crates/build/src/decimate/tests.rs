//! Promises: what is removed can be inserted again, step by step, in sound meshes; errors bound the deviation.

use super::{BuildCriterion, Decimated, Decimator, Key, Levels, Reference, State, WorkMesh};
use crate::change::gift_wrap::GiftWrap;
use crate::change::sides::rank;
use crate::decimate::removal::RemovalSearch;
use crate::error::centre::{Centre, Seat};
use crate::error::cost::largest;
use crate::insert::sequence::{Insertion, Sequence};
use crate::lattice::location::Location;
use crate::lattice::places::Places;
use crate::lattice::quantize;
use crate::order::reach::Reach;
use crate::vertex::mt_by;
use crate::{BuildConfig, BuildError, Construction, OnProgress, Purpose, VertexMethod};
use glam::{DMat3, DVec3};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;
use tetralod::geom::{in_conflict, nearest_on_triangle, orient3d};
use tetralod::mesh::{EDGES, FACES, Field, Grid, NONE, TetMesh, repair, topology};
use tetralod::mt::{
    ErrorCode, ExplicitMt, HalfEdgeMt, MAX_LINK, MtKind, MultiTessellation, UpdateId, VertexId, VertexMt,
};

const CRITERIA: [BuildCriterion; 2] = [BuildCriterion::HalfEdge, BuildCriterion::Delaunay];

/// Every criterion, and every purpose.
const WAYS: [(BuildCriterion, Purpose); 3] = [
    (BuildCriterion::HalfEdge, Purpose::Uniform),
    (BuildCriterion::HalfEdge, Purpose::Regions),
    (BuildCriterion::Delaunay, Purpose::Uniform),
];

fn hilly([x, y, z]: [f64; 3]) -> f64 {
    let hill = |a: f64, b: f64, c: f64| (-((x - a).powi(2) + (y - b).powi(2) + (z - c).powi(2)) * 9.0).exp();
    (hill(0.3, 0.4, 0.6) + 0.7 * hill(0.8, 0.2, 0.1) + if x + y > 1.1 { 0.4 } else { 0.0 }).max(0.15)
}

fn wavy([x, y, z]: [f64; 3]) -> f64 {
    (5.0 * x).sin() * (4.0 * y + z).cos()
}

/// The wanted cells of a grid over the unit cube, six tetrahedra each.
fn blocks(cells: [u32; 3], inside: impl Fn([u32; 3]) -> bool) -> TetMesh {
    let grid =
        Grid { dims: cells.map(|n| n + 1), origin: [0.0; 3], spacing: cells.map(|n| 1.0 / f64::from(n)) };
    let mut mesh = TetMesh::from_grid(grid, Vec::new());
    let mut index = 0;
    mesh.tets.retain(|_| {
        let i = index / 6;
        index += 1;
        inside([i % cells[0], i / cells[0] % cells[1], i / cells[0] / cells[1]])
    });
    mesh.grid = None;
    for (name, field) in [("hilly", hilly as fn([f64; 3]) -> f64), ("wavy", wavy)] {
        let values = mesh.positions.iter().map(|p| field(*p)).collect();
        mesh.fields.push(Field::new(name, values));
    }
    repair(mesh).expect("cells of a grid").0
}

/// A part of a shell between two spheres: curved boundaries and sharp edges.
fn bent(mut mesh: TetMesh) -> TetMesh {
    for p in &mut mesh.positions {
        let [u, v, w] = *p;
        let (radius, turn, height) = (1.0 + w, 1.5 * u, 0.7 * v);
        *p = [radius * turn.cos() * height.cos(), radius * turn.sin() * height.cos(), radius * height.sin()];
    }
    repair(mesh).expect("bent cells").0
}

fn domains() -> Vec<(&'static str, TetMesh)> {
    let ring = |c: [u32; 3]| !((1..3).contains(&c[0]) && (1..3).contains(&c[1]));
    let hollow = |c: [u32; 3]| !c.iter().all(|&x| (1..3).contains(&x));
    let edge = |c: [u32; 3]| (c[0] < 2) == (c[1] < 2);
    vec![
        ("cube", blocks([5; 3], |_| true)),
        ("L", blocks([4, 4, 2], |c| c[0] < 2 || c[1] < 2)),
        ("ring", blocks([4, 4, 2], ring)),
        ("hollow", blocks([4; 3], hollow)),
        ("two components", blocks([5, 3, 3], |c| c[0] != 2)),
        ("two parts at an edge", blocks([4, 4, 3], edge)),
        ("bent", bent(blocks([5; 3], |_| true))),
        ("bent ring", bent(blocks([4, 4, 3], ring))),
        ("one cell", blocks([1; 3], |_| true)),
    ]
}

fn decimate(
    mesh: &TetMesh,
    config: &BuildConfig,
    how: (BuildCriterion, Purpose),
    progress: OnProgress<'_>,
) -> Result<Decimated<Sequence>, BuildError> {
    super::decimate(&mut Cow::Borrowed(mesh), config, how, progress)
}

fn built(mesh: &TetMesh, criterion: BuildCriterion) -> Decimated<Sequence> {
    built_for(mesh, criterion, Purpose::default())
}

fn built_for(mesh: &TetMesh, criterion: BuildCriterion, purpose: Purpose) -> Decimated<Sequence> {
    let fields = mesh.fields.iter().map(|field| field.name.clone()).collect();
    let config = BuildConfig { fields, ..BuildConfig::of(MtKind::Edge) };
    decimate(mesh, &config, (criterion, purpose), &mut |_| ControlFlow::Continue(())).expect("a valid mesh")
}

fn sorted(mut tet: [u32; 4]) -> [u32; 4] {
    tet.sort_unstable();
    tet
}

fn six_volumes(result: &Decimated<Sequence>, tets: &[[u32; 4]]) -> i128 {
    let six = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| result.quantized.positions[v as usize]);
        orient3d(a, b, c, d)
    };
    assert!(tets.iter().all(|tet| six(tet) > 0), "every tetrahedron is positive");
    tets.iter().map(six).sum()
}

/// A mesh that insertions are carried out in.
struct Replay(BTreeMap<[u32; 4], [u32; 4]>);

impl Replay {
    fn new(base: &[[u32; 4]]) -> Self {
        Self(base.iter().map(|&tet| (sorted(tet), tet)).collect())
    }

    fn insert(&mut self, result: &Decimated<Sequence>, step: &Insertion) {
        for &tet in &result.record.tets[step.removed.clone()] {
            assert!(self.0.remove(&sorted(tet)).is_some(), "what is removed is there");
        }
        for &tet in &result.record.tets[step.inserted.clone()] {
            assert!(tet.contains(&step.vertex));
            assert!(self.0.insert(sorted(tet), tet).is_none(), "what is inserted is new");
        }
    }

    fn tets(&self) -> Vec<[u32; 4]> {
        self.0.values().copied().collect()
    }
}

/// Components, Euler numbers of the mesh and of its boundary, and vertices at which the mesh is no manifold.
fn shape(points: usize, tets: &[[u32; 4]]) -> (usize, i64, i64, Vec<bool>) {
    let topology = topology(points, tets).expect("a conforming mesh");
    let mut faces = BTreeSet::new();
    let mut border = Vec::new();
    let edges = |corners: &[u32]| {
        let pairs = corners.iter().flat_map(|&x| corners.iter().map(move |&y| [x, y]));
        pairs.filter(|[x, y]| x < y).collect::<Vec<_>>()
    };
    for (tet, around) in tets.iter().zip(&topology.neighbors) {
        for (face, n) in FACES.iter().zip(around) {
            let mut corners = face.map(|k| tet[k]);
            corners.sort_unstable();
            faces.insert(corners);
            if *n == NONE {
                border.push(corners);
            }
        }
    }
    let vertices: BTreeSet<u32> = tets.iter().flatten().copied().collect();
    let inner: BTreeSet<[u32; 2]> = tets.iter().flat_map(|tet| edges(tet)).collect();
    let outer: BTreeSet<[u32; 2]> = border.iter().flat_map(|face| edges(face)).collect();
    let outer_vertices: BTreeSet<u32> = border.iter().flatten().copied().collect();
    let euler = vertices.len() as i64 - inner.len() as i64 + faces.len() as i64 - tets.len() as i64;
    let outer_euler = outer_vertices.len() as i64 - outer.len() as i64 + border.len() as i64;
    (topology.components, euler, outer_euler, topology.non_manifold)
}

#[test]
fn every_step_of_a_replay_is_a_sound_mesh() {
    for (name, mesh) in domains() {
        for (criterion, purpose) in WAYS {
            let result = built_for(&mesh, criterion, purpose);
            let points = mesh.positions.len();
            let expected = shape(points, &mesh.tets);
            let mut replay = Replay::new(&result.record.base);
            let mut present: BTreeSet<u32> = result.record.base.iter().flatten().copied().collect();
            assert_eq!(
                shape(points, &replay.tets()),
                expected,
                "{name} {criterion:?} {purpose:?}: the base mesh"
            );
            for step in &result.record.steps {
                assert!(present.insert(step.vertex), "a vertex comes once");
                replay.insert(&result, step);
                let [removed, inserted] =
                    [&step.removed, &step.inserted].map(|r| &result.record.tets[r.clone()]);
                let link: BTreeSet<u32> = inserted.iter().flatten().copied().collect();
                assert!(link.len() <= MAX_LINK + 1 && inserted.len() <= 60 && removed.len() <= 128);
                let volumes = [removed, inserted].map(|tets| six_volumes(&result, tets));
                assert!(step.step > 0.0 || volumes[0] == volumes[1], "the boundary stays");
                assert_eq!(shape(points, &replay.tets()), expected, "{name} {criterion:?} {purpose:?}");
            }
            let all: BTreeSet<[u32; 4]> = mesh.tets.iter().copied().map(sorted).collect();
            assert_eq!(
                replay.0.keys().copied().collect::<BTreeSet<_>>(),
                all,
                "{name} {criterion:?} {purpose:?}"
            );
            assert!(replay.0.values().all(|tet| six_volumes(&result, &[*tet]) > 0));
        }
    }
}

#[test]
fn errors_follow_the_dependencies() {
    for (name, mesh) in domains() {
        for (criterion, purpose) in WAYS {
            let result = built_for(&mesh, criterion, purpose);
            let sequence = &result.record;
            // Which insertion made each tetrahedron.
            let mut makers: BTreeMap<[u32; 4], usize> = BTreeMap::new();
            for (i, step) in sequence.steps.iter().enumerate() {
                for &tet in &sequence.tets[step.removed.clone()] {
                    if let Some(&parent) = makers.get(&sorted(tet)) {
                        let least = largest(&step.errors) + sequence.steps[parent].step;
                        assert!(
                            largest(&sequence.steps[parent].errors) >= least,
                            "{name} {criterion:?} {purpose:?}"
                        );
                    }
                }
                let error = ErrorCode::at_least(largest(&step.errors));
                assert!(error > ErrorCode::ZERO && error.error() == largest(&step.errors), "as it is stored");
                for &tet in &sequence.tets[step.inserted.clone()] {
                    makers.insert(sorted(tet), i);
                }
            }
        }
    }
}

/// The field of a mesh at a point of one of its tetrahedra, in levels.
fn values(result: &Decimated<Sequence>, tet: [u32; 4], at: DVec3) -> Option<Vec<f64>> {
    let corner = |v: u32| DVec3::from_array(result.quantized.positions[v as usize].map(f64::from));
    let [w, x, y, z] = tet.map(corner);
    let l = DMat3::from_cols(x - w, y - w, z - w).inverse() * (at - w);
    let weights = [1.0 - l.element_sum(), l.x, l.y, l.z];
    let fields = result.quantized.fields.len();
    let value = |f: usize| -> f64 {
        let level = |v: u32| f64::from(result.quantized.levels[v as usize * fields + f]);
        tet.iter().zip(weights).map(|(&v, weight)| weight * level(v)).sum()
    };
    weights.iter().all(|w| *w >= -1e-7).then(|| (0..fields).map(value).collect())
}

/// The largest difference from the reference, as a fraction of the ranges.
fn field_error(result: &Decimated<Sequence>, point: usize, values: &[f64]) -> f64 {
    let fields = &result.quantized.fields;
    let exact = &result.quantized.exact[point * fields.len()..];
    let error = |((x, y), field): ((&f64, &f64), &tetralod::mt::FieldInfo)| {
        (x - y).abs() * field.step / field.range()
    };
    values.iter().zip(exact).zip(fields).map(error).fold(0.0, f64::max)
}

/// Whether a reference vertex is within `bound`: in a tetrahedron, or beside a boundary triangle.
fn is_within(
    result: &Decimated<Sequence>,
    tets: &[[u32; 4]],
    border: &[(usize, [u32; 3])],
    point: usize,
    bound: f64,
) -> bool {
    let at = DVec3::from_array(result.quantized.positions[point].map(f64::from));
    let fits = |tet: [u32; 4], at: DVec3| {
        values(result, tet, at).is_some_and(|values| field_error(result, point, &values) <= bound)
    };
    let step = DVec3::from_array(result.quantized.lattice.step);
    let location = |&(t, face): &(usize, [u32; 3])| {
        let corner = |v: u32| DVec3::from_array(result.quantized.positions[v as usize].map(f64::from)) * step;
        let nearest = nearest_on_triangle(at * step, face.map(corner));
        let distance = nearest.distance(at * step);
        distance <= bound * result.info.displacement_per_error + 1e-9 && fits(tets[t], nearest / step)
    };
    tets.iter().any(|tet| fits(*tet, at)) || border.iter().any(location)
}

/// How far a reference vertex is from the boundary.
fn distance(result: &Decimated<Sequence>, border: &[(usize, [u32; 3])], point: u32) -> f64 {
    let step = DVec3::from_array(result.quantized.lattice.step);
    let at = |v: u32| DVec3::from_array(result.quantized.positions[v as usize].map(f64::from)) * step;
    let to = |(_, face): &(usize, [u32; 3])| at(point).distance(nearest_on_triangle(at(point), face.map(at)));
    border.iter().map(to).fold(f64::INFINITY, f64::min)
}

/// The boundary triangles of some tetrahedra of a mesh, and whose they are.
fn border_of(mesh: &TetMesh, tets: &[[u32; 4]]) -> Vec<(usize, [u32; 3])> {
    let around = topology(mesh.positions.len(), tets).expect("a conforming mesh").neighbors;
    let mut border = Vec::new();
    for (t, tet) in tets.iter().enumerate() {
        let faces = (0..4).filter(|&k| around[t][k] == NONE);
        border.extend(faces.map(|k| (t, FACES[k].map(|l| tet[l]))));
    }
    border
}

fn boundary_vertices(mesh: &TetMesh) -> BTreeSet<u32> {
    let around = topology(mesh.positions.len(), &mesh.tets).expect("a conforming mesh").neighbors;
    let faces = |(tet, around): (&[u32; 4], &[u32; 4])| {
        let (tet, around) = (*tet, *around);
        (0..4).filter(move |&k| around[k] == NONE).flat_map(move |k| FACES[k].map(|l| tet[l]))
    };
    mesh.tets.iter().zip(&around).flat_map(faces).collect()
}

#[test]
fn every_reference_vertex_is_within_the_error() {
    for (name, mesh) in domains() {
        for (criterion, purpose) in WAYS {
            let result = built_for(&mesh, criterion, purpose);
            let rim = boundary_vertices(&mesh);
            for bound in [0.003, 0.02, 0.06, 0.15, 0.4] {
                // Errors are monotone, so that these insertions do not need the others.
                let mut replay = Replay::new(&result.record.base);
                let wanted = result.record.steps.iter().filter(|step| largest(&step.errors) > bound);
                wanted.for_each(|step| replay.insert(&result, step));
                let tets = replay.tets();
                let border = border_of(&mesh, &tets);
                let allowed = bound * (1.0 + 1e-6) + 1e-5;
                for &point in &rim {
                    let distance = distance(&result, &border, point);
                    let most = bound * result.info.displacement_per_error + 1e-9;
                    assert!(
                        distance <= most,
                        "{name} {criterion:?} {purpose:?}: boundary point {point} at {bound}"
                    );
                }
                for point in 0..mesh.positions.len() {
                    let good = is_within(&result, &tets, &border, point, allowed);
                    assert!(good, "{name} {criterion:?} {purpose:?}: point {point} at {bound}");
                }
            }
        }
    }
}

/// Where edges are short the boundary moves by less.
#[test]
fn the_boundary_moves_by_a_part_of_the_edges_there() {
    let mut mesh = bent(blocks([8, 4, 4], |_| true));
    for p in &mut mesh.positions {
        // One end is much finer than the other.
        *p = p.map(|x| x * 1.5_f64.powf(2.0 * p[0]));
    }
    let most = 1.0;
    for how in WAYS {
        let fields = vec![mesh.fields[0].name.clone()];
        let config = BuildConfig { fields, displacement_edges: most, ..BuildConfig::default() };
        let result = decimate(&mesh, &config, how, &mut |_| ControlFlow::Continue(())).expect("a valid mesh");
        let step = DVec3::from_array(result.quantized.lattice.step);
        let at = |v: u32| result.quantized.rounded(v) * step;
        let mut shortest = vec![f64::INFINITY; mesh.positions.len()];
        for tet in &mesh.tets {
            for [a, b] in EDGES.map(|edge| edge.map(|i| tet[i])) {
                let length = at(a).distance(at(b));
                [a, b].iter().for_each(|&v| shortest[v as usize] = shortest[v as usize].min(length));
            }
        }
        let rim = boundary_vertices(&mesh);
        for bound in [0.05, 0.2, 0.5] {
            let mut replay = Replay::new(&result.record.base);
            let wanted = result.record.steps.iter().filter(|step| largest(&step.errors) > bound);
            wanted.for_each(|step| replay.insert(&result, step));
            let tets = replay.tets();
            let border = border_of(&mesh, &tets);
            for &point in &rim {
                let allowed =
                    bound * (most * shortest[point as usize]).min(result.info.displacement_per_error);
                let found = distance(&result, &border, point);
                assert!(found <= allowed + 1e-9, "{how:?} {bound}: {point} by {found}");
            }
        }
    }
}

/// Inside a convex grid the mesh is Delaunay from the start, and stays so.
#[test]
fn a_box_stays_delaunay() {
    let mut mesh = blocks([4; 3], |_| true);
    mesh.grid = Some(Grid { dims: [5; 3], origin: [0.0; 3], spacing: [0.25; 3] });
    let result = built(&mesh, BuildCriterion::Delaunay);
    let at = |v: u32| result.quantized.positions[v as usize];
    let mut replay = Replay::new(&result.record.base);
    assert_eq!(replay.0.len(), 6, "a cube of six");
    let mut present: BTreeSet<u32> = result.record.base.iter().flatten().copied().collect();
    for step in &result.record.steps {
        replay.insert(&result, step);
        present.insert(step.vertex);
        for tet in replay.0.values() {
            let [a, b, c, d] = tet.map(at);
            let mut others = present.iter().filter(|v| !tet.contains(v));
            assert!(!others.any(|&v| in_conflict(a, b, c, d, at(v))));
        }
    }
}

#[test]
fn bases_are_small_and_boxes_keep_their_volume() {
    let mesh = blocks([8; 3], |_| true);
    for criterion in CRITERIA {
        let result = built(&mesh, criterion);
        assert!(result.record.base.len() < 20, "{criterion:?}: {}", result.record.base.len());
        let whole = six_volumes(&result, &mesh.tets);
        let mut replay = Replay::new(&result.record.base);
        result
            .record
            .steps
            .iter()
            .filter(|step| largest(&step.errors) > 0.05)
            .for_each(|s| replay.insert(&result, s));
        assert!(replay.0.len() < mesh.tets.len() * 3 / 4);
        assert_eq!(six_volumes(&result, &replay.tets()), whole);
    }
}

#[test]
fn vertices_at_which_parts_touch_stay() {
    let mesh = blocks([4, 4, 3], |c| (c[0] < 2) == (c[1] < 2));
    let frozen = topology(mesh.positions.len(), &mesh.tets).expect("a conforming mesh").non_manifold;
    assert!(frozen.iter().any(|&f| f));
    for criterion in CRITERIA {
        let result = built(&mesh, criterion);
        assert!(result.record.steps.iter().all(|step| !frozen[step.vertex as usize]));
    }
}

#[test]
fn the_same_input_gives_the_same_sequence() {
    let mesh = bent(blocks([5; 3], |_| true));
    for (criterion, purpose) in WAYS {
        assert_eq!(built_for(&mesh, criterion, purpose).record, built_for(&mesh, criterion, purpose).record);
    }
}

#[test]
fn the_work_can_be_stopped() {
    let mesh = blocks([12; 3], |_| true);
    for criterion in CRITERIA {
        let stopped =
            decimate(&mesh, &BuildConfig::of(MtKind::Edge), (criterion, Purpose::Uniform), &mut |_| {
                ControlFlow::Break(())
            });
        assert_eq!(stopped.err(), Some(BuildError::Stopped));
    }
}

/// Without any allowance each movement of the boundary is an infinite error.
#[test]
fn a_boundary_that_may_not_move_costs_all() {
    let mesh = bent(blocks([4; 3], |_| true));
    let config = BuildConfig { displacement: 0.0, ..BuildConfig::of(MtKind::Edge) };
    let result = decimate(&mesh, &config, (BuildCriterion::HalfEdge, Purpose::Uniform), &mut |_| {
        ControlFlow::Continue(())
    })
    .expect("a valid mesh");
    let mut replay = Replay::new(&result.record.base);
    let moves = |step: &&Insertion| step.step > 0.0;
    assert!(
        result.record.steps.iter().filter(moves).all(|step| largest(&step.errors) == ErrorCode::MAX.error())
    );
    assert!(result.record.steps.iter().any(|step| step.step > 0.0));
    result.record.steps.iter().for_each(|step| replay.insert(&result, step));
    assert_eq!(replay.0.len(), mesh.tets.len());
}

#[test]
fn the_finest_lattice_will_do() {
    let mesh = bent(blocks([3; 3], |_| true));
    let config = BuildConfig { position_bits: Some(30), ..BuildConfig::of(MtKind::Edge) };
    for criterion in CRITERIA {
        let result =
            decimate(&mesh, &config, (criterion, Purpose::Uniform), &mut |_| ControlFlow::Continue(()));
        let result = result.expect("a valid mesh");
        assert!(!result.record.steps.is_empty(), "{criterion:?}");
        let mut replay = Replay::new(&result.record.base);
        result.record.steps.iter().for_each(|step| replay.insert(&result, step));
        assert_eq!(replay.0.len(), mesh.tets.len());
    }
}

/// What takes place in one round does not depend on anything else that does, and the reaches of the candidates hold all
/// that their removals would depend on, and no more.
#[test]
fn the_removals_of_a_round_are_independent() {
    for (name, mesh) in domains() {
        for (criterion, purpose) in WAYS {
            let quantized = quantize::quantize(&mesh, &BuildConfig::of(MtKind::Edge)).expect("a valid mesh");
            let topology = topology(mesh.positions.len(), &mesh.tets).expect("a conforming mesh");
            let work = WorkMesh::new(mesh.tets.clone(), topology.neighbors, mesh.positions.len());
            let levels = Levels::of_purpose(purpose);
            let reference = Reference::new(&quantized, &work, 1.0, f64::INFINITY);
            let state = State::new(work, reference, topology.non_manifold, levels);
            let wrap = (criterion == BuildCriterion::Delaunay).then(|| GiftWrap::new(&quantized.positions));
            let mut record = Sequence::default();
            let mut decimator = Decimator::new(state, wrap, &mut record);
            // The removal that made each tetrahedron, and the boxes of the removals.
            let mut makers: BTreeMap<[u32; 4], usize> = BTreeMap::new();
            let mut boxes: Vec<Reach> = Vec::new();
            let mut largest_round = 0;
            loop {
                let start = boxes.len();
                decimator.round(&mut |_| ControlFlow::Continue(())).expect("not stopped");
                let sequence = &decimator.record;
                // Those before `start` are of earlier rounds, and have been looked at.
                for (i, step) in sequence.steps.iter().enumerate().skip(start) {
                    let mut reach = Reach::default();
                    for &tet in &sequence.tets[step.inserted.clone()] {
                        tet.iter().for_each(|&v| reach.add(quantized.positions[v as usize]));
                        if let Some(&maker) = makers.get(&sorted(tet)) {
                            assert!(
                                maker < start,
                                "{name} {criterion:?} {purpose:?}: {i} depends on {maker}"
                            );
                            reach.join(&boxes[maker]);
                        }
                    }
                    let told = decimator.state.reaches[step.vertex as usize];
                    assert_eq!(told, reach, "{name} {criterion:?} {purpose:?}: removal {i}");
                    boxes.push(reach);
                    let filling = &sequence.tets[step.removed.clone()];
                    filling.iter().for_each(|&tet| _ = makers.insert(sorted(tet), i));
                }
                largest_round = largest_round.max(boxes.len() - start);
                if !decimator.rounds.end(boxes.len() - start, mesh.positions.len() - boxes.len()) {
                    break;
                }
            }
            assert!(largest_round > 1 || boxes.len() < 10, "{name} {criterion:?}: rounds of one removal");
        }
    }
}

/// A vertex of the input that is not inside of the tetrahedron in whose bucket it is, is known to be outside, also where that has
/// no face on the boundary: another tetrahedron may come to contain it.
#[test]
fn vertices_outside_of_their_tetrahedra_are_known() {
    let mesh = blocks([8; 3], |_| true);
    let mut quantized = quantize::quantize(&mesh, &BuildConfig::of(MtKind::Edge)).expect("a valid mesh");
    // The corner of the cube is beside it, and in the bucket of a tetrahedron in its middle.
    let middle = (0..).zip(&mesh.tets).find(|(_, tet)| tet.contains(&(4 * 81 + 4 * 9 + 4)));
    let (tet, _) = middle.expect("the vertex in the middle has tetrahedra");
    let beside = |(point, place)| if point == 0 { place - DVec3::splat(0.4) } else { place };
    let places = (0..).zip(quantized.places.iter()).map(beside);
    quantized.places = Places::new(quantized.positions.clone(), places);
    quantized.locations = vec![Location { point: 0, tet, lambda: DVec3::ZERO, outside: true }];
    let topology = topology(mesh.positions.len(), &mesh.tets).expect("a conforming mesh");
    let work = WorkMesh::new(mesh.tets.clone(), topology.neighbors, mesh.positions.len());
    let reference = Reference::new(&quantized, &work, 1.0, f64::INFINITY);
    let state = State::new(work, reference, topology.non_manifold, Levels::of_purpose(Purpose::Uniform));
    let mut record = Sequence::default();
    let mut decimator = Decimator::new(state, None, &mut record);
    let mut buckets_of_it = BTreeSet::new();
    loop {
        let before = decimator.record.steps.len();
        decimator.round(&mut |_| ControlFlow::Continue(())).expect("not stopped");
        let State { mesh: now, buckets, .. } = &decimator.state;
        let own = (0..now.tets.len() as u32).find(|&t| buckets.inside.iter(t).any(|point| point == 0));
        buckets_of_it.insert(own.expect("it is in a bucket"));
        assert!(buckets.outside_points.is_outside(0), "after {before} removals");
        let after = decimator.record.steps.len();
        if !decimator.rounds.end(after - before, mesh.positions.len() - after) {
            break;
        }
    }
    assert!(buckets_of_it.len() > 2, "it has come from bucket to bucket");
}

/// What an MT does at the insertion of each reference point: the tetrahedra that it removes and inserts, in numbers of points.
type Insertions = BTreeMap<u32, [BTreeSet<[u32; 4]>; 2]>;

fn insertions(mt: &ExplicitMt, vertices: &[VertexId]) -> Insertions {
    let points: BTreeMap<VertexId, u32> = vertices.iter().copied().zip(0..).collect();
    let tet = |t: u32| sorted(mt.tets()[t as usize].map(|v| points[&VertexId(v)]));
    let all = (0..mt.updates()).map(UpdateId);
    all.map(|u| {
        let removed = mt.removed(u).iter().map(|&t| tet(t)).collect();
        (points[&VertexId(mt.created(u).start)], [removed, mt.inserted(u).map(tet).collect()])
    })
    .collect()
}

/// A half-edge MT is made without a list of tetrahedra. It has the updates of the explicit MT that is made of one.
#[test]
fn collapses_make_the_updates_of_the_explicit_structure() {
    for (name, mesh) in domains() {
        for purpose in Purpose::ALL {
            let Decimated { record, quantized, info, .. } =
                built_for(&mesh, BuildCriterion::HalfEdge, purpose);
            let go_on = &mut |_| ControlFlow::Continue(());
            let (expected, vertices) = record.explicit_mt(info, &quantized, go_on).expect("sound insertions");
            let expected = insertions(&expected, &vertices);
            let fields = mesh.fields.iter().map(|field| field.name.clone()).collect();
            let construction = Construction::HalfEdge { purpose };
            let config = BuildConfig { fields, construction, ..BuildConfig::default() };
            let built = crate::build_with(&mesh, &config, go_on).expect("a valid mesh");
            assert_eq!(built.summary.updates as usize, expected.len(), "{name}");
            let own = ExplicitMt::of(&built.mt).expect("a sound MT");
            assert_eq!(own.check(), Ok(()), "{name} {purpose:?}");
            assert!(insertions(&own, &built.vertices) == expected, "{name} {purpose:?}");
            // Conversion finds the near vertices and the inner faces by itself.
            let converted = HalfEdgeMt::from_explicit(&own, 8).expect("inverse half-edge collapses");
            let again = ExplicitMt::of(&converted).expect("a sound MT");
            assert!(again == own, "{name} {purpose:?}");
            let depth = |u: u32, depths: &[u32]| {
                own.parents(UpdateId(u)).iter().map(|&p| depths[p as usize]).max().unwrap_or(0) + 1
            };
            let mut depths = Vec::new();
            (0..own.updates()).for_each(|u| depths.push(depth(u, &depths)));
            assert_eq!(Some(built.summary.depth), depths.into_iter().max().or(Some(0)), "{name}");
        }
    }
}

/// What a vertex-based MT says by its nodes is what the builder spelled out.
#[test]
fn vertex_based_mts_have_the_updates_of_the_explicit_one() {
    let mut ways: Vec<VertexMethod> =
        WAYS.iter().map(|&(criterion, purpose)| VertexMethod::Decimate { criterion, purpose }).collect();
    ways.extend([false, true].map(|tet_errors| VertexMethod::Insert { tet_errors }));
    for (name, mesh) in domains() {
        let fields = mesh.fields.iter().map(|field| field.name.clone()).collect();
        let config = BuildConfig { fields, ..BuildConfig::of(MtKind::Vertex) };
        for &way in &ways {
            // Insertion fills the convex hull.
            let points = TetMesh { tets: Vec::new(), ..mesh.clone() };
            let input = if matches!(way, VertexMethod::Insert { .. }) { &points } else { &mesh };
            let (explicit, ..) = mt_by(way, input, &config, &mut |_| ControlFlow::Continue(()))
                .unwrap_or_else(|error| panic!("{name}, {way:?}: {error}"));
            let compact = VertexMt::from_explicit(&explicit).expect("insertions");
            assert!(ExplicitMt::of(&compact) == Ok(explicit), "{name}, {way:?}");
        }
    }
}

/// Removes vertices of a mesh in some rounds. Before each, `look` gets every vertex that may go.
fn look_in_rounds(mesh: &TetMesh, mut look: impl FnMut(&State<'_, '_>, &mut RemovalSearch, u32)) {
    let quantized = quantize::quantize(mesh, &BuildConfig::of(MtKind::Edge)).expect("a valid mesh");
    let topology = topology(mesh.positions.len(), &mesh.tets).expect("a conforming mesh");
    let work = WorkMesh::new(mesh.tets.clone(), topology.neighbors, mesh.positions.len());
    let levels = Levels::of_purpose(Purpose::Uniform);
    let reference = Reference::new(&quantized, &work, 1.0, f64::INFINITY);
    let mut record = Sequence::default();
    let state = State::new(work, reference, topology.non_manifold, levels);
    let mut decimator = Decimator::new(state, None, &mut record);
    for _ in 0..6 {
        let Decimator { state, searches, .. } = &mut decimator;
        for v in (0..mesh.positions.len() as u32).filter(|&v| state.mesh.has(v) && !state.frozen[v as usize])
        {
            look(state, &mut searches.ahead[0], v);
        }
        decimator.round(&mut |_| ControlFlow::Continue(())).expect("not stopped");
        let (removed, left) = (decimator.record.steps.len(), mesh.positions.len());
        decimator.rounds.end(removed, left - removed);
    }
}

/// Most neighbours are not evaluated: they cannot be better than the best one so far. That finds the same as evaluating each.
#[test]
fn the_best_neighbour_is_found() {
    let levels = Levels::of_purpose(Purpose::Uniform);
    for (name, mesh) in domains() {
        let (mut compared, mut several) = (0, 0);
        look_in_rounds(&mesh, |state, search, v| {
            for level in [levels.of(0.01), levels.of(0.1), levels.last()] {
                let found = search.at(state, v, NONE, level).filter(|key| key.level() <= level);
                let link = search.hole.link.clone();
                let each = link.iter().filter_map(|&end| search.at(state, v, end, level));
                let all: Vec<Key> = each.filter(|key| key.level() <= level).collect();
                assert!(found == all.iter().min().copied(), "{name}: vertex {v}");
                compared += usize::from(found.is_some());
                several += usize::from(all.len() > 1);
            }
        });
        assert!(name == "one cell" || compared > 0 && several > 0, "{name}: {compared}, {several}");
    }
}

/// What a contraction makes of a hole is known from the hole: where the vertex is in it, and what is across its faces.
#[test]
fn a_contraction_is_known_from_its_hole() {
    let last = Levels::of_purpose(Purpose::Uniform).last();
    for (name, mesh) in domains() {
        let (mut inside, mut linked) = (0, 0);
        let mut centre = Centre::default();
        look_in_rounds(&mesh, |state, search, v| {
            let Some(key) = search.at(state, v, NONE, last) else { return };
            assert!(search.prepare(state, key, last), "{name}: vertex {v}");
            let (hole, filling) = (&search.hole, &mut search.best.filling);
            let end = hole.place(key.b).expect("the end is in the link");
            let across = filling.across.clone();
            hole.link_filling(filling);
            assert_eq!(across, filling.across, "{name}: vertex {v}");
            linked += 1;
            centre.start(hole, &state.reference);
            let quantized = state.reference.quantized;
            let place = quantized.places.at(v);
            let Some(Seat { face, lambda }) = centre.seat(hole, end) else {
                assert!(hole.on_boundary() || quantized.is_moved(v), "{name}: vertex {v}");
                return;
            };
            let tet = filling.tets[rank(hole.others(end), face)];
            let [w, x, y, z] = tet.map(|corner| quantized.rounded(corner));
            let weights = [1.0 - lambda.element_sum(), lambda.x, lambda.y, lambda.z];
            let found = w * weights[0] + x * weights[1] + y * weights[2] + z * weights[3];
            assert!(weights.iter().all(|weight| *weight > -1e-8), "{name}: vertex {v} at {weights:?}");
            assert!(found.distance(place) < 1e-6 * (1.0 + w.distance(place)), "{name}: vertex {v}");
            inside += 1;
        });
        assert!(name == "one cell" || inside > 0 && linked > 0, "{name}: {inside}, {linked}");
    }
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let mesh = bent(blocks([7; 3], |_| true));
    for (criterion, purpose) in WAYS {
        let of = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| built_for(&mesh, criterion, purpose).record)
        };
        let one = of(1);
        [2, 3, 8]
            .into_iter()
            .for_each(|threads| assert!(of(threads) == one, "{criterion:?} {purpose:?} {threads}"));
    }
}

/// So many tetrahedra around one edge, of which each has a face of its own on both sides.
fn around_an_edge(count: u32) -> TetMesh {
    let rim = (0..count).map(|i| {
        let angle = f64::from(i) / f64::from(count) * std::f64::consts::TAU;
        [angle.cos(), angle.sin(), 0.2 * (5.0 * angle).cos()]
    });
    let positions: Vec<[f64; 3]> = [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]].into_iter().chain(rim).collect();
    let values = positions.iter().map(|p| hilly(*p)).collect();
    let tets = (0..count).map(|i| [0, 1, 2 + i, 2 + (i + 1) % count]).collect();
    let mesh = TetMesh { positions, tets, fields: vec![Field::new("hilly", values)], ..TetMesh::default() };
    repair(mesh).expect("a ring").0
}

/// Work is counted, not time: each triangle of the boundary that a point is compared with.
#[test]
fn tetrahedra_around_one_edge_take_as_much_work_each_as_fewer() {
    let compared = |count: u32| {
        let mesh = around_an_edge(count);
        let quantized = quantize::quantize(&mesh, &BuildConfig::of(MtKind::Edge)).expect("a valid mesh");
        let topology = topology(mesh.positions.len(), &mesh.tets).expect("a conforming mesh");
        let work = WorkMesh::new(mesh.tets.clone(), topology.neighbors, mesh.positions.len());
        let reference = Reference::new(&quantized, &work, 1.0, f64::INFINITY);
        let levels = Levels::of_purpose(Purpose::Uniform);
        let state = State::new(work, reference, topology.non_manifold, levels);
        let mut record = Sequence::default();
        let mut decimator = Decimator::new(state, None, &mut record);
        decimator.remove_all(&mut |_| ControlFlow::Continue(())).expect("not stopped");
        assert!(decimator.state.mesh.live() < count / 8, "most of them are removed");
        decimator.state.reference.boundary.compared.load(Ordering::Relaxed)
    };
    let [few, many] = [500, 2000].map(compared);
    // With each of a star it would be sixteen times as many.
    assert!(many < 8 * few, "{few} comparisons for 500 tetrahedra, {many} for 2000");
}
