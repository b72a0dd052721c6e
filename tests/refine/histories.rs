//! Promise: what a request gives does not depend on what was asked for before, on noisy data, in any order, and with updates that are
//! not here; and MTs whose errors would not allow that are not written.

use crate::support::files::encoded;
use crate::support::meshes::{blocks, tampered};
use crate::support::random::Random;
use tetralod::format::{EncodeError, EncodeOptions};
use tetralod::mesh::TetMesh;
use tetralod::mt::{
    ApplyUpdates, EdgeMt, ErrorCode, ExplicitMt, Mt, MtKind, MultiTessellation, UpdateId, VertexId,
    check_errors,
};
use tetralod::refine::{Front, LodCriterion, Need, Request};
use tetralod_build::{BuildConfig, BuildCriterion, Construction, Method, build};

/// As many values as a scan has, with noise that no neighbour shares.
fn noisy(cells: [u32; 3], noise: f64, seed: u64) -> TetMesh {
    let mut mesh = blocks(cells, &[|p| p[0] * (1.0 - p[0]) + p[1] * p[2]], |_| true);
    let mut random = Random::new(seed);
    mesh.fields[0].values.iter_mut().for_each(|x| *x += noise * random.below(1000) as f64 / 1000.0);
    mesh
}

fn made(mesh: &TetMesh, kind: MtKind) -> Mt {
    let (method, criterion) = match kind {
        MtKind::Edge => (Method::Collapse, BuildCriterion::HalfEdge),
        _ => (Method::Decimate, BuildCriterion::HalfEdge),
    };
    let construction = Construction::new(kind, method, criterion).expect("they go together");
    let config = BuildConfig { construction, ..BuildConfig::of(MtKind::Edge) };
    build(mesh, &config).expect("a mesh to build on").mt
}

fn edge(mesh: &TetMesh) -> EdgeMt {
    let Mt::Edge(mt) = made(mesh, MtKind::Edge) else { panic!("edge-based") };
    mt
}

/// Checks, on the MT spelled out, what makes requests for values monotone: where an update removes a tetrahedron that another one
/// created, no value is nearer to it, for its error, than to all that the other one removed, for that one's.
fn values_are_monotone(mt: &ExplicitMt) -> Result<(), String> {
    for (field, info) in mt.info().fields.iter().enumerate() {
        let reach = |u: UpdateId| mt.error_of_field(u, field).error() * info.range() / info.step;
        let levels = |t: u32| mt.tets()[t as usize].map(|v| f64::from(mt.levels(VertexId(v))[field]));
        let low = |t: u32| levels(t).into_iter().fold(f64::INFINITY, f64::min);
        let high = |t: u32| levels(t).into_iter().fold(f64::NEG_INFINITY, f64::max);
        for t in 0..mt.tets().len() as u32 {
            let (Some(above), Some(own)) = (mt.inserted_by(t), mt.removed_by(t)) else {
                continue;
            };
            if mt.error_of_field(above, field) == ErrorCode::MAX {
                continue;
            }
            let removed = || mt.removed(above).iter().copied();
            let least = removed().map(low).fold(f64::INFINITY, f64::min) - reach(above);
            let most = removed().map(high).fold(f64::NEG_INFINITY, f64::max) + reach(above);
            if low(t) - reach(own) < least - 1e-6 || high(t) + reach(own) > most + 1e-6 {
                return Err(format!("update {} below {}", own.0, above.0));
            }
        }
    }
    Ok(())
}

/// Answers requests for values all over the range, in random order, each from the base mesh and from what the one before left.
fn remembers_nothing(name: &str, mt: &impl ApplyUpdates, seed: u64) {
    let mut random = Random::new(seed);
    let info = mt.info().fields[0].clone();
    let base = Front::new(mt).expect("a valid base mesh");
    let mut walk = base.clone();
    for i in 0..120 {
        let value = info.min + info.range() * random.below(1001) as f64 / 1000.0;
        let error = [0.0, 0.001, 0.01, 0.03, 0.1][random.below(5)];
        let need = if i % 4 == 3 { Need::within(0.0) } else { Need::within(error).around(0, &[value]) };
        let request = Request::from(need);
        let criterion = LodCriterion::new(mt.info(), &request);
        let mut fresh = base.clone();
        for front in [&mut fresh, &mut walk] {
            front.satisfy(mt, &criterion, request.budget).expect("a valid MT");
        }
        let sizes = [&fresh, &walk].map(|front| front.mesh().tet_count());
        assert_eq!(fresh.mesh().hash(), walk.mesh().hash(), "{name}: {value} within {error}: {sizes:?}");
    }
}

#[test]
fn noisy_scans_of_both_kinds() {
    for (noise, seed) in [(0.02, 1), (0.3, 2), (5.0, 3)] {
        let mesh = noisy([9, 8, 7], noise, seed);
        for kind in [MtKind::Edge, MtKind::Vertex] {
            let mt = made(&mesh, kind);
            let name = format!("{}, noise {noise}", kind.name());
            assert_eq!(check_errors(&mt), Ok(None), "{name}");
            let explicit = ExplicitMt::of(&mt).expect("a valid MT");
            assert_eq!(values_are_monotone(&explicit), Ok(()), "{name}");
            remembers_nothing(&name, &mt, seed);
            let strict = EncodeOptions { check_margins: true, ..EncodeOptions::default() };
            encoded(&mt, &strict).expect("an MT to write");
        }
    }
}

#[test]
fn errors_that_do_not_fall_are_not_written() {
    let mt = edge(&noisy([6, 6, 6], 0.3, 5));
    let explicit = ExplicitMt::of(&mt).expect("a valid MT");
    let plain = EncodeOptions::default();
    assert!(encoded(&mt, &plain).is_ok());
    let leaf = (0..mt.updates()).rev().find(|&u| !explicit.parents(UpdateId(u)).is_empty());
    let leaf = leaf.expect("an update that depends on another");
    // Larger than that of a parent.
    let swollen =
        tampered(&mt, |u, update| update.errors[0].0 = if u == leaf { 50_000 } else { update.errors[0].0 });
    let refused = encoded(&swollen, &plain);
    assert!(matches!(refused, Err(EncodeError::Order { update, .. }) if update == leaf), "{refused:?}");
    // Equal all over, although values go beyond those that they replace.
    let equal = tampered(&mt, |_, update| update.errors[0].0 = 30_000);
    let spelled = ExplicitMt::of(&equal).expect("a valid MT");
    assert!(values_are_monotone(&spelled).is_err());
    let strict = EncodeOptions { check_margins: true, ..plain.clone() };
    let refused = encoded(&equal, &strict);
    assert!(matches!(refused, Err(EncodeError::Order { .. })), "{refused:?}");
}

/// From a mesh that is much finer than what is wanted, the work is that from the base mesh, however fine it was.
#[test]
fn much_coarser_meshes_cost_what_they_cost_from_the_base_mesh() {
    let mesh = noisy([12, 11, 10], 0.05, 6);
    for kind in MtKind::ALL {
        let mt = match kind {
            MtKind::HalfEdge => {
                let config = BuildConfig::of(kind);
                build(&mesh, &config).expect("a mesh to build on").mt
            }
            kind => made(&mesh, kind),
        };
        let name = kind.name();
        let base = Front::new(&mt).expect("a valid base mesh");
        let all = Request::within(0.0);
        let mut checked = 0;
        for request in [all.clone().at_most(900), Request::within(0.2), Need::within(0.05).into()] {
            let coarse = LodCriterion::new(mt.info(), &request);
            let (mut fresh, mut walk) = (base.clone(), base.clone());
            walk.satisfy(&mt, &LodCriterion::new(mt.info(), &all), all.budget).expect("a valid MT");
            let (full, applied) = (walk.mesh().tet_count(), walk.applied_count());
            let expected = fresh.satisfy(&mt, &coarse, request.budget).expect("a valid MT");
            let outcome = walk.satisfy(&mt, &coarse, request.budget).expect("a valid MT");
            assert_eq!(walk.mesh().hash(), fresh.mesh().hash(), "{name}: {request:?}");
            walk.mesh().check().expect("a valid mesh");
            if fresh.applied_count() > applied / 4 || 4 * fresh.mesh().tet_count() > full {
                continue;
            }
            checked += 1;
            assert_eq!((outcome.refined, outcome.judged), (expected.refined, expected.judged), "{name}");
            assert_eq!(outcome.coarsened, u64::from(applied) + expected.coarsened, "{name}: {request:?}");
            // And back again: everything is applied once more.
            let again = walk.satisfy(&mt, &LodCriterion::new(mt.info(), &all), all.budget);
            assert_eq!(again.expect("a valid MT").refined, u64::from(applied - fresh.applied_count()));
            assert_eq!(walk.mesh().tet_count(), full, "{name}");
        }
        assert!(checked > 0, "{name}: no request is much coarser");
    }
}
