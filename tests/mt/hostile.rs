//! Damaged and hostile MTs: every call ends, with a typed error or with a valid mesh, and an error changes nothing.

use crate::support::builder::{Built, Plan, Stored, build};
use crate::support::compare::snapshot;
use crate::support::conformance::PAGED;
use crate::support::domains::Domain;
use crate::support::meshes::{blocks, hilly};
use crate::support::random::Random;
use crate::support::strategies::config;
use proptest::prelude::*;
use tetralod::mt::{
    Applied, ApplyUpdates, BaseMesh, BaseMeshError, CurrentMesh, EdgeMt, ErrorCode, ExplicitMt, ForestChild,
    HalfEdgeMt, HalfEdgeUpdate, Mt, MtFault, MtKind, MultiTessellation, UpdateError, UpdateId, UpdatePages,
    VertexId, stats,
};
use tetralod::refine::{Front, LodCriterion, Request};

/// Forces updates in and out as a refinement engine does, and checks what must hold after every call.
struct Driver<'a, M> {
    mt: &'a M,
    mesh: CurrentMesh,
    set: Vec<bool>,
    done: usize,
    errors: Vec<UpdateError>,
}

impl<'a, M: ApplyUpdates> Driver<'a, M> {
    fn new(mt: &'a M) -> Result<Self, BaseMeshError> {
        let mut mesh = mt.start()?;
        mt.updates_arrived(&mut mesh, 0);
        assert_eq!(mesh.check(), Ok(()));
        Ok(Self { mt, mesh, set: vec![false; mt.updates() as usize], done: 0, errors: Vec::new() })
    }

    /// Puts `u` into the set, or takes it out, with all that has to go first.
    fn force(&mut self, u: u32) {
        let wanted = !self.set[u as usize];
        let mut stack = vec![u];
        while let Some(&next) = stack.last() {
            if self.set[next as usize] == wanted {
                stack.pop();
                continue;
            }
            match self.call(next, wanted) {
                Ok(Applied::Done) => {
                    stack.pop();
                }
                // Parents have smaller numbers, children larger ones: the stack ends.
                Ok(Applied::Blocked(UpdateId(other))) => {
                    assert!(if wanted { other < next } else { other > next });
                    assert!((other as usize) < self.set.len());
                    if self.set[other as usize] == wanted {
                        // The marks of a half-edge MT may name any update: refinement makes an error of it, as here.
                        assert_eq!(
                            self.mt.info().kind,
                            MtKind::HalfEdge,
                            "{other} is not in the way of {next}"
                        );
                        self.errors.push(UpdateError::Error { update: next });
                        return;
                    }
                    stack.push(other);
                }
                Err(error) => {
                    assert!(wanted, "what was applied can be undone: {error}");
                    self.errors.push(error);
                    return;
                }
            }
        }
    }

    fn call(&mut self, u: u32, refine: bool) -> Result<Applied, UpdateError> {
        let before = snapshot(&self.mesh);
        let result = if refine {
            self.mt.refine(&mut self.mesh, UpdateId(u))
        } else {
            self.mt.coarsen(&mut self.mesh, UpdateId(u))
        };
        assert_eq!(self.mesh.check(), Ok(()));
        assert!(self.is_on_lattices());
        if result == Ok(Applied::Done) {
            self.set[u as usize] = refine;
            self.done += 1;
        } else {
            assert_eq!(snapshot(&self.mesh), before, "nothing was done, yet the mesh has changed");
        }
        result
    }

    fn is_on_lattices(&self) -> bool {
        let info = self.mt.info();
        (0..).zip(self.mesh.positions()).all(|(slot, p)| {
            let is_there = self.mesh.vertex(slot).0 != u32::MAX;
            !is_there || info.holds(*p, self.mesh.levels(slot))
        })
    }

    fn rummage(&mut self, steps: usize, random: &mut Random) {
        for _ in 0..if self.set.is_empty() { 0 } else { steps } {
            let u = random.below(self.set.len()) as u32;
            self.force(u);
            if random.once_in(9) {
                self.mesh.compact();
                assert_eq!(self.mesh.check(), Ok(()));
            }
        }
        let hash = self.mesh.hash();
        let refined = self.set.clone();
        (0..self.set.len() as u32).rev().for_each(|u| {
            if self.set[u as usize] {
                assert_eq!(self.call(u, false), Ok(Applied::Done));
            }
        });
        assert_eq!(self.mesh.tet_count(), self.mt.base().tets.len());
        (0..refined.len() as u32).for_each(|u| {
            if refined[u as usize] {
                assert_eq!(self.call(u, true), Ok(Applied::Done));
            }
        });
        assert_eq!(self.mesh.hash(), hash);
    }
}

/// Replaying everything is an error at the first update that does not fit, or a valid MT.
fn assert_replay_is_sound(mt: &EdgeMt) {
    let explicit = ExplicitMt::of(mt);
    assert_eq!(explicit.is_ok(), stats(mt).is_ok());
    if let Ok(explicit) = explicit {
        // Errors are the caller's to keep in order.
        assert!(matches!(explicit.check(), Ok(()) | Err(MtFault::Error { .. })));
    }
}

/// Changes a split in one of many ways.
fn damage(split: &mut Stored, vertices: usize, random: &mut Random) {
    match random.below(9) {
        0 => split.vertex = random.below(vertices + 3) as u32,
        1 => split.wrong_sides = random.bits(),
        2 => split.wrong_sides ^= 1 << random.below(64),
        3 => split.wrong_sides ^= 1 << random.below(10),
        4 => split.offset_residual = [0; 3].map(|_| random.between(-1024, 1024)),
        5 => split.offset_residual[random.below(3)] ^= 1 << random.below(31),
        6 => split.offset_residual = [0; 3],
        7 => {
            let f = random.below(split.level_residuals.len());
            split.level_residuals[f] = if random.once_in(2) { i32::MIN } else { random.between(-256, 256) };
        }
        _ => split.errors.fill(ErrorCode(random.bits() as u16)),
    }
}

fn push_all(built: &Built, splits: &[Stored]) -> (EdgeMt, usize) {
    let mut mt = EdgeMt::new(built.info.clone(), built.base.clone());
    let mut refused = 0;
    for split in splits {
        let before = mt.updates();
        match mt.push(&split.as_update()) {
            Ok(u) => assert_eq!(u, UpdateId(before)),
            Err(_) => {
                assert_eq!(mt.updates(), before);
                refused += 1;
            }
        }
    }
    (mt, refused)
}

fn domain() -> impl Strategy<Value = Domain> {
    prop_oneof![(1_usize..=2).prop_map(Domain::Cube), Just(Domain::Ell(1)), Just(Domain::Ring)]
}

proptest! {
    #![proptest_config(config(300, 4))]

    /// A valid MT with some of its updates damaged, dropped or doubled.
    #[test]
    fn damaged_updates(domain in domain(), seed in any::<u64>(), updates in 0_usize..40, steps in 0_usize..60) {
        let mut random = Random(seed);
        let built = build(Plan { domain, seed, fields: 2, updates });
        let mut splits = Stored::all(&built.edge_mt());
        for _ in 0..random.below(4) + 1 {
            if splits.is_empty() {
                break;
            }
            let k = random.below(splits.len());
            match random.below(5) {
                0 => drop(splits.remove(k)),
                1 => splits.insert(k, splits[random.below(splits.len())].clone()),
                _ => damage(&mut splits[k], built.oracle.positions.len(), &mut random),
            }
        }
        let (mt, _) = push_all(&built, &splits);
        assert_replay_is_sound(&mt);
        let mut driver = Driver::new(&mt).expect("the base mesh is valid");
        driver.rummage(steps, &mut random);
    }

    /// Updates made up from nothing, with masks that are likely to be right often enough to go deep.
    #[test]
    fn invented_updates(domain in domain(), seed in any::<u64>(), updates in 0_usize..60, steps in 0_usize..60) {
        let mut random = Random(seed);
        let mut built = build(Plan { domain, seed, fields: 1, updates: 30 });
        built.info.lattice.bits = 12;
        let mut splits = Vec::new();
        let mut vertices = built.base.positions.len();
        for _ in 0..updates {
            let bits = random.below(8);
            splits.push(Stored {
                vertex: random.below(vertices) as u32,
                edge: if random.once_in(4) { random.below(60) as u8 } else { 0 },
                offset_residual: [0; 3].map(|_| random.between(-40, 40)),
                level_residuals: vec![random.between(-20, 20)],
                wrong_sides: random.bits() & ((1 << bits) - 1),
                errors: vec![ErrorCode(if random.once_in(20) { random.bits() as u16 } else { 0 })],
            });
            vertices += 2;
        }
        let (mt, _) = push_all(&built, &splits);
        assert_replay_is_sound(&mt);
        let mut driver = Driver::new(&mt).expect("the base mesh is valid");
        driver.rummage(steps, &mut random);
    }

    /// Base meshes with tetrahedra left out or corners merged: pinched vertices and edges, borders everywhere.
    #[test]
    fn ragged_base_meshes(seed in any::<u64>(), updates in 0_usize..60, steps in 0_usize..60) {
        let mut random = Random(seed);
        let mut built = build(Plan { domain: Domain::Cube(2), seed, fields: 1, updates: random.below(9) });
        let keep = 1 + random.below(4);
        built.base.tets.retain(|_| !random.once_in(keep + 1));
        drop_unused(&mut built.base);
        let mut splits = Vec::new();
        let mut vertices = built.base.positions.len().max(1);
        for _ in 0..updates {
            splits.push(Stored {
                vertex: random.below(vertices) as u32,
                edge: if random.once_in(4) { random.below(60) as u8 } else { 0 },
                offset_residual: [0; 3].map(|_| random.between(-30, 30)),
                level_residuals: vec![0],
                wrong_sides: random.bits() & ((1 << random.below(14)) - 1),
                errors: vec![ErrorCode::ZERO],
            });
            vertices += 2;
        }
        let (mt, _) = push_all(&built, &splits);
        assert_replay_is_sound(&mt);
        let mut driver = Driver::new(&mt).expect("the base mesh is valid");
        driver.rummage(steps, &mut random);
    }

    /// Base meshes that are no meshes are refused, and nothing worse.
    #[test]
    fn broken_base_meshes(seed in any::<u64>()) {
        let mut random = Random(seed);
        let built = build(Plan { domain: Domain::Cube(1), seed, fields: 1, updates: 4 });
        let (mut info, mut base) = (built.info, built.base);
        let t = random.below(base.tets.len());
        match random.below(9) {
            0 => base.tets[t].swap(1, 2),
            1 => base.tets[t][0] = random.bits() as u32,
            2 => base.tets[t][0] = base.tets[t][1],
            3 => base.tets.push(base.tets[t]),
            4 => base.positions.push([0; 3]),
            5 => base.positions[0] = [0; 3].map(|_| random.bits() as i32),
            6 => base.values[0] = 256,
            7 => base.values.truncate(1),
            _ => info.lattice.bits = 31,
        }
        prop_assert!(CurrentMesh::new(&info, &base).is_err());
        let mt = EdgeMt::new(info, base);
        prop_assert!(ExplicitMt::of(&mt).is_err() && stats(&mt).is_err());
    }
}

/// Takes vertices away that no tetrahedron uses.
fn drop_unused(base: &mut BaseMesh) {
    let mut used: Vec<u32> = base.tets.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    base.positions = used.iter().map(|&v| base.positions[v as usize]).collect();
    base.values = used.iter().map(|&v| base.values[v as usize]).collect();
    let number = |v: u32| used.binary_search(&v).expect("it is used") as u32;
    base.tets.iter_mut().for_each(|tet| *tet = tet.map(number));
}

/// The hostile tests reach every kind of error, and apply updates that nobody built.
#[test]
fn hostile_tests_reach_all_errors() {
    let mut seen = std::collections::BTreeSet::new();
    let mut applied = 0;
    for seed in 0..400 {
        let mut random = Random(seed);
        let built = build(Plan { domain: Domain::Cube(2), seed: seed % 7, fields: 2, updates: 12 });
        let mut splits = Stored::all(&built.edge_mt());
        let k = random.below(splits.len());
        damage(&mut splits[k], built.oracle.positions.len(), &mut random);
        let mut mt = EdgeMt::new(built.info.clone(), built.base.clone());
        let kind =
            |error: &UpdateError| format!("{error:?}").split(' ').next().unwrap_or_default().to_owned();
        for split in &splits {
            if let Err(error) = mt.push(&split.as_update()) {
                seen.insert(kind(&error));
                break;
            }
        }
        let mut driver = Driver::new(&mt).expect("the base mesh is valid");
        driver.rummage(30, &mut random);
        seen.extend(driver.errors.iter().map(kind));
        applied += driver.done;
    }
    let all = ["Inverted", "Mask", "OffLattice", "Vertex"];
    assert!(all.iter().all(|kind| seen.contains(*kind)), "{seen:?}");
    assert!(applied > 2000, "{applied}");
}

/// The same MT with one vertex elsewhere, and other levels there.
fn displaced(whole: &HalfEdgeMt, moved: u32, by: [i32; 3], residual: i32) -> Result<HalfEdgeMt, UpdateError> {
    let shift = |children: &[ForestChild]| -> Vec<ForestChild> {
        let is_it = |child: &ForestChild| child.update == moved;
        let shifted = |child: &ForestChild| [0, 1, 2].map(|k| child.offset[k] + by[k]);
        children
            .iter()
            .map(|child| if is_it(child) { ForestChild { offset: shifted(child), ..*child } } else { *child })
            .collect()
    };
    let base = whole.base().clone();
    let roots: Vec<Vec<ForestChild>> =
        (0..base.positions.len() as u32).map(|v| shift(whole.children_of(VertexId(v)))).collect();
    let mut mt =
        HalfEdgeMt::new(whole.info().clone(), base, whole.base_marks().to_vec(), &roots, whole.page_bits())?;
    for u in (0..whole.updates()).map(UpdateId) {
        let record = whole.update(u).expect("a whole MT");
        let children = shift(record.children);
        let levels: Vec<i32> =
            record.level_residuals.iter().map(|r| r + if u.0 == moved { residual } else { 0 }).collect();
        mt.push(&HalfEdgeUpdate { children: &children, level_residuals: &levels, ..record })?;
    }
    Ok(mt)
}

/// A vertex in a wrong place turns tetrahedra inside out, or leaves the lattice, or by chance neither.
#[test]
fn half_edge_mts_with_a_vertex_elsewhere() {
    let mesh = blocks([4, 4, 3], &[hilly], |c| c != [1, 1, 1]);
    let mt = PAGED.build(&mesh, None);
    let Mt::HalfEdge(whole) = &mt else { panic!("another kind") };
    let size = 1 << whole.info().lattice.bits;
    let mut random = Random::new(29);
    let mut seen = std::collections::BTreeSet::new();
    for round in 0..300 {
        let moved = random.below(whole.updates() as usize) as u32;
        let far = if round % 3 == 0 { size } else { size / 4 };
        let by = [0; 3].map(|_| random.between(-far, far));
        let residual = if round % 5 == 0 { random.between(-512, 512) } else { 0 };
        let Ok(mt) = displaced(whole, moved, by, residual) else { continue };
        let mut driver = Driver::new(&mt).expect("the base mesh is valid");
        (0..mt.updates()).for_each(|u| driver.force(u));
        let mut front = Front::new(&mt).expect("the base mesh is valid");
        let all = Request::within(0.0);
        let refined = front.satisfy(&mt, &LodCriterion::new(mt.info(), &all), all.budget);
        assert_eq!(refined.is_ok(), driver.errors.is_empty(), "update {moved} moved by {by:?}");
        assert_eq!(front.mesh().check(), Ok(()));
        seen.extend(
            driver
                .errors
                .iter()
                .map(|error| format!("{error:?}").split(' ').next().unwrap_or_default().to_owned()),
        );
    }
    assert!(["Inverted", "OffLattice"].iter().all(|kind| seen.contains(*kind)), "{seen:?}");
}
