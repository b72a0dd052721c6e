//! Damaged and hostile vertex-based MTs: every call ends, with a typed error or with a valid mesh, and an error changes
//! nothing.
#![cfg(feature = "build")]

mod build_support;
mod conformance_support;
mod format_support;
mod support;
mod vertex_support;

use conformance_support::DELAUNAY;
use conformance_support::HALF_EDGE;
use conformance_support::How;
use conformance_support::empty;
use conformance_support::grow;
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::sync::LazyLock;
use support::compare::snapshot;
use support::domains::volume6;
use support::random::Random;
use support::strategies::config;
use tetralod::geom::Bounds;
use tetralod::geom::Lattice;
use tetralod::mesh::TetMesh;
use tetralod::mt::Applied;
use tetralod::mt::BaseMesh;
use tetralod::mt::CurrentMesh;
use tetralod::mt::ErrorCode;
use tetralod::mt::ExplicitMt;
use tetralod::mt::ExplicitUpdate;
use tetralod::mt::Mt;
use tetralod::mt::MtInfo;
use tetralod::mt::MtKind;
use tetralod::mt::MultiTessellation;
use tetralod::mt::UpdateError;
use tetralod::mt::UpdateId;
use tetralod::mt::stats;
use tetralod::refine::Budget;
use tetralod::refine::Front;
use tetralod::refine::LodCriterion;
use tetralod::refine::Need;
use tetralod::refine::Region;
use tetralod::refine::Request;
use vertex_support::BitString;
use vertex_support::Node;
use vertex_support::Parts;

fn small(how: How, mesh: &TetMesh) -> Parts {
    Parts::of(&how.build(mesh, None))
}

/// Good MTs to damage: flat and curved boundaries, one and more components.
static GOOD: LazyLock<Vec<Parts>> = LazyLock::new(|| {
    let waves: fn([f64; 3]) -> f64 = |p| (7.0 * p[1]).sin() + p[2];
    let apart = build_support::blocks([5, 2, 2], &[waves], |c| c[0] != 2);
    let ring = build_support::blocks([3, 3, 1], &[waves, build_support::hilly], |c| c[0] != 1 || c[1] != 1);
    let mut good = Vec::new();
    for how in [HALF_EDGE, DELAUNAY] {
        for mesh in [&build_support::cube(3, &[waves]), &build_support::bent(4), &apart, &ring] {
            good.push(small(how, mesh));
        }
    }
    assert!(good.iter().any(|parts| parts.nodes.iter().any(|node| node.given_up.is_some())));
    good
});

/// Forces updates in and out as a refinement engine does, and checks what must hold after every call.
struct Driver<'a> {
    mt: &'a Mt,
    mesh: CurrentMesh,
    set: Vec<bool>,
    done: [usize; 2],
    errors: Vec<(UpdateError, bool)>,
}

impl<'a> Driver<'a> {
    fn new(mt: &'a Mt) -> Self {
        let mut mesh = mt.start().expect("a valid base mesh");
        mt.announce(&mut mesh, 0);
        assert_eq!(mesh.check(), Ok(()));
        Self { mt, mesh, set: vec![false; mt.updates() as usize], done: [0; 2], errors: Vec::new() }
    }

    fn force(&mut self, u: u32) {
        let wanted = !self.set[u as usize];
        let mut stack = vec![u];
        while let Some(&next) = stack.last() {
            match self.call(next, wanted) {
                Ok(Applied::Done) => drop(stack.pop()),
                Ok(Applied::Blocked(UpdateId(other))) => {
                    assert!((other as usize) < self.set.len());
                    assert_ne!(self.set[other as usize], wanted, "{other} is not in the way of {next}");
                    // Parents have smaller numbers, children larger ones, or the MT is damaged.
                    if if wanted { other > next } else { other < next } {
                        return;
                    }
                    stack.push(other);
                }
                Err(error) => {
                    self.errors.push((error, wanted));
                    return;
                }
            }
        }
    }

    fn call(&mut self, u: u32, refine: bool) -> Result<Applied, UpdateError> {
        let before = snapshot(&self.mesh);
        let id = UpdateId(u);
        if !refine {
            let looked = self.mt.look_at_removed(&mut self.mesh, id, &mut |_, _| false);
            assert_eq!(snapshot(&self.mesh), before);
            assert!(looked.is_ok() || self.mt.coarsen(&mut self.mesh.clone(), id).is_err());
        }
        let result =
            if refine { self.mt.refine(&mut self.mesh, id) } else { self.mt.coarsen(&mut self.mesh, id) };
        assert_eq!(self.mesh.check(), Ok(()), "update {u}, refine: {refine}");
        if result == Ok(Applied::Done) {
            self.set[u as usize] = refine;
            self.done[usize::from(refine)] += 1;
        } else {
            assert_eq!(snapshot(&self.mesh), before, "nothing was done, yet the mesh has changed");
        }
        result
    }

    fn rummage(&mut self, steps: usize, random: &mut Random) {
        for _ in 0..if self.set.is_empty() { 0 } else { steps } {
            let u = random.below(self.set.len()) as u32;
            match random.below(4) {
                0 => drop(self.call(u, !self.set[u as usize])),
                _ => self.force(u),
            }
            for t in (0..self.mesh.tet_slots() as u32).filter(|&t| self.mesh.tet(t).is_some()) {
                let _ = (self.mt.remover(&self.mesh, t), self.mt.creator(&self.mesh, t));
            }
            if random.once_in(9) {
                self.mesh.compact();
                assert_eq!(self.mesh.check(), Ok(()));
            }
        }
        for u in (0..self.set.len() as u32).rev() {
            if self.set[u as usize]
                && let Err(error) = self.call(u, false)
            {
                self.errors.push((error, false));
            }
        }
    }
}

/// What else is done with MTs: replay, conversion, requests. All of it ends.
fn use_it(mt: &Mt, random: &mut Random) {
    let explicit = ExplicitMt::of(mt);
    assert_eq!(explicit.is_ok(), stats(mt).is_ok());
    if let Ok(explicit) = explicit {
        assert_eq!(explicit.check(), Ok(()));
        if let Ok(back) = Mt::from(explicit.clone()).convert(MtKind::Vertex) {
            assert_eq!(ExplicitMt::of(&back).as_ref(), Ok(&explicit));
        }
    }
    let mut front = Front::new(mt).expect("a valid base mesh");
    let half = Bounds { min: [0.0; 3], max: [0.6; 3] };
    for _ in 0..4 {
        let roi = random.once_in(2).then_some(Region::Box(half));
        let isovalues = if random.once_in(2) { vec![0.3] } else { Vec::new() };
        let need = Need::within([0.0, 0.05, 0.3][random.below(3)]).limited(roi, 0, &isovalues);
        let tets = random.once_in(3).then_some(60);
        let request = Request { needs: vec![need], budget: Budget { tets, ..Budget::default() } };
        let criterion = LodCriterion::new(mt.info(), &request);
        let _ = front.satisfy(mt, &criterion, request.budget);
        assert_eq!(front.mesh().check(), Ok(()));
    }
}

/// The MT arrives in pieces while it is used.
fn receive(mt: &Mt, random: &mut Random) {
    let mut part = empty(mt);
    let mut mesh = part.start().expect("a valid base mesh");
    while part.updates() < mt.updates() {
        let known = part.updates();
        let most = (mt.updates() - known) as usize;
        (0..1 + random.below(most)).for_each(|_| grow(&mut part, mt));
        part.announce(&mut mesh, known);
        for _ in 0..8 {
            let u = UpdateId(random.below(part.updates() as usize) as u32);
            let _ = if random.once_in(3) { part.coarsen(&mut mesh, u) } else { part.refine(&mut mesh, u) };
            assert_eq!(mesh.check(), Ok(()));
        }
    }
}

/// Changes a node in one of many ways.
fn damage(nodes: &mut [Node], k: usize, random: &mut Random) {
    let updates = nodes.len();
    let other = nodes[random.below(updates)].clone();
    let node = &mut nodes[k];
    let links = node.links.len();
    match random.below(14) {
        0 => node.links[random.below(links)] = [random.below(updates) as u64, random.below(links) as u64],
        1 => node.links[random.below(links)][0] = random.below(updates) as u64,
        2 => node.links[random.below(links)] = [random.bits(), random.bits()],
        // A loop of its own.
        3 => {
            let i = random.below(links);
            node.links[i] = [k as u64, i as u64];
        }
        4 => node.links.truncate(1 + random.below(links)),
        5 => node.links.push([random.below(updates) as u64, random.below(3) as u64]),
        6 => node.removed = (node.removed as i64 + i64::from(random.between(-2, 2))).max(1) as u64,
        7 => node.removed = 1 + random.below(127) as u64,
        8 => {
            node.given_up = match node.given_up.take() {
                Some(_) => None,
                None => Some((0..random.below(9)).map(|_| random.once_in(2)).collect()),
            }
        }
        9 => match &mut node.given_up {
            Some(given_up) if !given_up.is_empty() => {
                let i = random.below(given_up.len());
                given_up[i] = !given_up[i];
            }
            _ => node.rest = other.rest,
        },
        10 => node.rest.0.iter_mut().for_each(|bit| *bit ^= random.once_in(12)),
        11 => node.rest.0.truncate(random.below(node.rest.0.len() + 1)),
        12 => node.position = other.position,
        _ => node.position[random.below(3)] ^= 1 << random.below(16),
    }
}

fn try_all(mt: &Mt, random: &mut Random, steps: usize) -> (Vec<(UpdateError, bool)>, [usize; 2]) {
    use_it(mt, random);
    receive(mt, random);
    let mut driver = Driver::new(mt);
    driver.rummage(steps, random);
    (driver.errors, driver.done)
}

#[test]
fn nodes_can_be_taken_apart_and_put_together() {
    for parts in GOOD.iter() {
        let mt = parts.decode(&parts.bits()).expect("as it was");
        assert_eq!(parts.file(&parts.bits()), parts.file(&Parts::of(&mt).bits()));
        let (errors, _) = try_all(&mt, &mut Random(1), 20);
        assert_eq!(errors, []);
    }
}

proptest! {
    #![proptest_config(config(250, 5))]

    /// Some nodes are damaged.
    #[test]
    fn damaged_nodes(which in 0_usize..8, seed in any::<u64>()) {
        let mut random = Random(seed);
        let mut parts = GOOD[which].clone();
        for _ in 0..=random.below(3) {
            let k = random.below(parts.nodes.len());
            damage(&mut parts.nodes, k, &mut random);
        }
        if let Ok(mt) = parts.decode(&parts.bits()) {
            try_all(&mt, &mut random, 40);
        }
    }

    /// Whatever bits.
    #[test]
    fn flipped_bits(which in 0_usize..8, seed in any::<u64>(), share in 10_usize..2000) {
        let mut random = Random(seed);
        let parts = &GOOD[which];
        let mut nodes = parts.bits();
        nodes.iter_mut().for_each(|node| node.0.iter_mut().for_each(|bit| *bit ^= random.once_in(share)));
        if let Ok(mt) = parts.decode(&nodes) {
            try_all(&mt, &mut random, 40);
        }
    }

    /// Base tetrahedra are removed by others than they should be.
    #[test]
    fn other_removers(which in 0_usize..8, seed in any::<u64>()) {
        let mut random = Random(seed);
        let mut parts = GOOD[which].clone();
        for _ in 0..=random.below(4) {
            let t = random.below(parts.removers.len());
            parts.removers[t] = random.below(parts.nodes.len() + 1) as u64;
        }
        if let Ok(mt) = parts.decode(&parts.bits()) {
            try_all(&mt, &mut random, 40);
        }
    }
}

/// The hostile tests reach every kind of error that a damaged vertex-based MT can give, in both directions, and apply
/// updates all the same.
#[test]
fn hostile_tests_reach_all_errors() {
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    let mut applied = [0; 2];
    for seed in 0..300 {
        let mut random = Random(seed);
        let mut parts = GOOD[random.below(GOOD.len())].clone();
        let k = random.below(parts.nodes.len());
        damage(&mut parts.nodes, k, &mut random);
        let mut note = |error: &UpdateError, when: &str| {
            let kind = format!("{error:?}").split(' ').next().unwrap_or_default().to_owned();
            *seen.entry(format!("{kind} {when}")).or_default() += 1;
        };
        match parts.decode(&parts.bits()) {
            Ok(mt) => {
                let mut driver = Driver::new(&mt);
                driver.rummage(20, &mut random);
                driver.errors.iter().for_each(|(e, refine)| note(e, if *refine { "in" } else { "out" }));
                applied = [0, 1].map(|i| applied[i] + driver.done[i]);
            }
            Err(tetralod::format::FormatError::Update(error)) => note(&error, "pushed"),
            Err(error) => panic!("{error:?}"),
        }
    }
    let all = ["Cavity in", "Inverted in", "Cavity out", "Cavity pushed", "OffLattice pushed"];
    assert!(all.iter().all(|kind| seen.contains_key(*kind)), "{seen:?}");
    assert!(applied.iter().all(|&n| n > 2000), "{applied:?}");
}

/// A base mesh with one update, which removes the tetrahedra before `removed` and inserts a vertex at `position`.
fn one_insertion(
    positions: &[[i32; 3]],
    tets: &[[u32; 4]],
    removed: u32,
    position: [i32; 3],
    walls: &[[u32; 3]],
) -> Mt {
    let field = format_support::field("f", 8);
    let lattice = Lattice { origin: [0.0; 3], step: [1.0; 3], bits: 8 };
    let info = MtInfo {
        kind: MtKind::Explicit,
        lattice,
        fields: vec![field],
        vertices: positions.len() as u32 + 1,
        tetrahedra: tets.len() as u32 - removed + walls.len() as u32,
        updates: 1,
        displacement_per_error: 1.0,
        quantization: 0.0,
    };
    let values = vec![0; positions.len()];
    let mut all = positions.to_vec();
    all.push(position);
    let turned = |[a, b, c, d]: [u32; 4]| {
        let volume = volume6([a, b, c, d].map(|v| all[v as usize]));
        if volume > 0 { [a, b, c, d] } else { [b, a, c, d] }
    };
    let tets = tets.iter().copied().map(turned).collect();
    let mut mt = ExplicitMt::new(info, BaseMesh { positions: positions.to_vec(), values, tets });
    let new = positions.len() as u32;
    let inserted: Vec<[u32; 4]> = walls.iter().map(|&[a, b, c]| turned([a, b, c, new])).collect();
    let removed: Vec<u32> = (0..removed).collect();
    let update = ExplicitUpdate {
        positions: &[position],
        levels: &[0],
        removed: &removed,
        inserted: &inserted,
        errors: &[ErrorCode(9)],
    };
    mt.push(&update).expect("made to fit");
    mt.into()
}

/// Six corners around the middle, the last two above and below.
const OCTAHEDRON: [[i32; 3]; 6] =
    [[96, 64, 64], [64, 96, 64], [32, 64, 64], [64, 32, 64], [64, 64, 96], [64, 64, 32]];
const RING: [[u32; 2]; 4] = [[0, 1], [1, 2], [2, 3], [3, 0]];

/// All of its faces.
fn octahedron_walls() -> Vec<[u32; 3]> {
    RING.iter().flat_map(|&[a, b]| [[a, b, 4], [a, b, 5]]).collect()
}

/// What an update removed is what comes back, or nothing: an octahedron has three diagonals, and a code that names
/// another one than that which was there leads to faces that the rest of the mesh, where it overlaps, has already.
#[test]
fn what_comes_back_is_what_was_there() {
    let mut positions = OCTAHEDRON.to_vec();
    positions.push([64, 70, 120]);
    let mut tets: Vec<[u32; 4]> = RING.map(|[a, b]| [a, b, 4, 5]).to_vec();
    // It overlaps the octahedron, and has one face of its other halves.
    tets.push([0, 2, 1, 6]);
    let good = one_insertion(&positions, &tets, 4, [64; 3], &octahedron_walls());
    let good = Parts::of(&good.convert(MtKind::Vertex).expect("an insertion"));
    for apex in 0..8 {
        let mut parts = good.clone();
        assert_eq!(parts.nodes[0].rest.take(1), 1, "all of them have the upper and the lower corner");
        parts.nodes[0].rest = BitString::default();
        parts.nodes[0].rest.push(1 | apex << 1, 4);
        let mt = parts.decode(&parts.bits()).expect("well formed");
        let mut driver = Driver::new(&mt);
        let base = driver.mesh.hash();
        assert_eq!(driver.call(0, true), Ok(Applied::Done));
        let undone = driver.call(0, false);
        if apex == 4 || apex == 5 {
            assert_eq!((undone, driver.mesh.hash()), (Ok(Applied::Done), base));
        } else {
            assert_eq!(undone, Err(UpdateError::Cavity { update: 0 }), "apex {apex}");
        }
    }
}

/// `n` tetrahedra around an upright edge, and a vertex put into its middle.
fn wheel(n: u32) -> Mt {
    let mut positions = vec![[128, 128, 0], [128, 128, 200]];
    positions.extend((0..n).map(|i| {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        [128 + (120.0 * angle.cos()) as i32, 128 + (120.0 * angle.sin()) as i32, 100]
    }));
    let rim: Vec<[u32; 2]> = (0..n).map(|i| [2 + i, 2 + (i + 1) % n]).collect();
    let tets: Vec<[u32; 4]> = rim.iter().map(|&[a, b]| [0, 1, a, b]).collect();
    let walls: Vec<[u32; 3]> = rim.iter().flat_map(|&[a, b]| [[a, b, 0], [a, b, 1]]).collect();
    one_insertion(&positions, &tets, n, [128, 128, 100], &walls)
}

#[test]
fn the_largest_star_is_one_of_124_tetrahedra_and_64_vertices() {
    let largest = wheel(62).convert(MtKind::Vertex).expect("as large as can be");
    let (errors, done) = try_all(&largest, &mut Random(1), 20);
    assert_eq!(errors, []);
    assert!(done[0] > 3 && done[0] == done[1], "{done:?}");
    assert!(wheel(63).convert(MtKind::Vertex).is_err());
}
