//! Promise: what a camera sees gives the same mesh however it came there: keys, wheels, flights and jumps, with budgets that change,
//! in steps that are interrupted, for MTs of every kind.
//!
//! Also on real data, if the environment variable TETRALOD_DATA names a folder with the data sets.

use crate::support::conformance::{DELAUNAY, EDGE, HALF_EDGE, How, INSERTED, PAGED};
use crate::support::data::real_data;
use crate::support::meshes::{bent, blocks, hilly};
use crate::support::random::Random;
use glam::DVec2;
use std::sync::Arc;
use tetralod::geom::{Bounds, Camera, Projection, ViewPreset};
use tetralod::mesh::{TetMesh, repair};
use tetralod::mt::{ApplyUpdates, ExplicitMt};
use tetralod::refine::{Front, LodCriterion, Need, Request, View};
use tetralod_io as io;
use tetralod_io::generate;

const VIEWPORT: [f64; 2] = [900.0, 600.0];
const ASPECT: f64 = VIEWPORT[0] / VIEWPORT[1];

/// As a viewer has it.
fn view(camera: &Camera) -> View {
    View { matrix: camera.view_projection(ASPECT).to_cols_array(), viewport: VIEWPORT }
}

/// Moves as keys, wheels and pointers do, now and then to somewhere else.
fn turn(camera: &mut Camera, bounds: &Bounds, random: &mut Random) {
    let signed = |random: &mut Random, most: f64| most * (2.0 * random.fraction() - 1.0);
    match random.below(12) {
        0..3 => camera.orbit([0.12, -0.12][random.below(2)], 0.0),
        3 => camera.orbit(0.0, [0.12, -0.12][random.below(2)]),
        4 => camera.orbit(signed(random, 0.004), signed(random, 0.004)),
        5..7 => camera.zoom_at([1.15, 1.0 / 1.15, 0.7][random.below(3)], DVec2::ZERO, ASPECT),
        7 => camera.zoom_at(1.0 + signed(random, 0.01), DVec2::new(signed(random, 1.0), 0.3), ASPECT),
        8 => camera.pan(signed(random, 0.3), signed(random, 0.3)),
        9 => camera.fly(signed(random, 0.1), signed(random, 0.1), signed(random, 0.3)),
        10 => camera.look(signed(random, 0.3), signed(random, 0.2)),
        _ => {
            *camera = Camera::home(bounds, ASPECT);
            if random.once_in(3) {
                camera.set_projection(Projection::Orthographic);
            }
            camera.turn_to([ViewPreset::Home, ViewPreset::AlongX, ViewPreset::AgainstZ][random.below(3)]);
            camera.zoom([1.0, 0.3, 0.05][random.below(3)]);
        }
    }
}

/// Follows a camera through so many places, with several errors and budgets, and makes each request from scratch, too.
fn follows(name: &str, mt: &impl ApplyUpdates, mesh: &TetMesh, places: usize, seed: u64) {
    let mut random = Random::new(seed);
    let bounds = Bounds::of(&mesh.positions);
    let mut camera = Camera::home(&bounds, ASPECT);
    let base = Front::new(mt).expect("a valid base mesh");
    let mut walk = base.clone();
    let [mut pixels, mut coarse, mut budget] = [2.0, 0.3, f64::INFINITY];
    for place in 0..places {
        turn(&mut camera, &bounds, &mut random);
        if random.once_in(8) {
            pixels = [0.1, 0.75, 2.0, 8.0][random.below(4)];
            coarse = [0.05, 0.3, f64::INFINITY][random.below(3)];
            budget = [0.05, 0.3, f64::INFINITY][random.below(3)];
        }
        let mut request = Request::within(coarse).and(Need::seen(view(&camera), pixels));
        if budget.is_finite() {
            request = request.at_most((budget * mesh.tets.len() as f64) as u32);
        }
        let criterion = Arc::new(LodCriterion::new(mt.info(), &request));
        walk.request(mt, criterion.clone(), request.budget);
        // The camera moves on before the mesh is there.
        let most = if random.once_in(3) { 1 << random.below(12) } else { u64::MAX };
        let outcome = walk.step(mt, &mut |done| done.refined + done.coarsened < most);
        if !outcome.expect("a valid MT").done {
            if random.once_in(2) {
                continue;
            }
            walk.step(mt, &mut |_| true).expect("a valid MT");
        }
        let mut fresh = base.clone();
        fresh.satisfy(mt, &*criterion, request.budget).expect("a valid MT");
        let sizes = [&fresh, &walk].map(|front| front.mesh().tet_count());
        let same = fresh.mesh().hash() == walk.mesh().hash();
        assert!(same, "{name}, place {place}: {sizes:?} tetrahedra for {request:?}");
    }
}

const KINDS: [(&str, How); 5] = [
    ("edge", EDGE),
    ("half-edge", PAGED),
    ("vertex", HALF_EDGE),
    ("Delaunay", DELAUNAY),
    ("insertion", INSERTED),
];

#[test]
fn cameras_around_and_inside_of_small_meshes() {
    let noisy = {
        let mut mesh = blocks([9, 8, 7], &[hilly], |_| true);
        let mut random = Random::new(11);
        mesh.fields[0].values.iter_mut().for_each(|x| *x += 0.2 * random.fraction());
        mesh
    };
    let ell = blocks([6, 6, 5], &[hilly], |c| c[0] < 3 || c[1] < 2);
    for (what, mesh, is_convex) in [("bent", bent(7), false), ("noisy", noisy, true), ("ell", ell, false)] {
        for (i, (kind, how)) in KINDS.into_iter().enumerate() {
            if how == INSERTED && !is_convex {
                continue;
            }
            let mt = how.build(&mesh, None);
            follows(&format!("{what}, {kind}"), &mt, &mesh, 150, i as u64);
            if how == EDGE {
                let explicit = ExplicitMt::of(&mt).expect("a valid MT");
                follows(&format!("{what}, spelled out"), &explicit, &mesh, 150, i as u64);
            }
        }
    }
}

/// The volume of the page's own test.
#[test]
fn cameras_around_a_ball() {
    let mesh = generate::by_name("bucky", 13).expect("a known volume");
    for (kind, how) in [("half-edge", PAGED), ("edge", EDGE)] {
        follows(&format!("bucky, {kind}"), &how.build(&mesh, None), &mesh, 100, 5);
    }
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn cameras_around_real_meshes() {
    let data = real_data();
    for name in ["disk_out_ref.vtu", "hand.vtu", "piece.vtu", "cylinder_flow.vtu", "piezo_micro.vtu"] {
        let mesh = io::read(&data.join(name)).expect("a file that can be read");
        let mut mesh = repair(mesh).expect("a mesh that can be repaired").0;
        mesh.fields.truncate(2);
        for (kind, how) in [("half-edge", PAGED), ("edge", EDGE)] {
            follows(&format!("{name}, {kind}"), &how.build(&mesh, None), &mesh, 60, 7);
        }
    }
}
