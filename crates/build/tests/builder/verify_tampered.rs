//! Promise: verification finds what is wrong with an MT, or with the mesh it is compared with.

use crate::support::meshes::{bent, built, cube, hilly, linear, tampered};
use tetralod::mesh::TetMesh;
use tetralod::mt::{BaseMesh, EdgeMt, MtInfo, MultiTessellation, UpdateId};
use tetralod::refine::{Need, Region, Request, Transfer, View};
use tetralod_build::verify;
use tetralod_build::verify::{MAX_FAILURES, Reference, VerifyReport};

fn verified(mt: &EdgeMt, input: &TetMesh) -> VerifyReport {
    let mut last = None;
    let report = verify::run(mt, input, Reference::Mesh, &mut |done, all| {
        assert!(done < all && last.is_none_or(|last| last <= done));
        last = Some(done);
    });
    assert_eq!(report.valid, report.failures.is_empty());
    assert!(report.failures.len() <= MAX_FAILURES + 1);
    report
}

/// Asserts that verification fails with a message that has `words` in it.
fn fails(mt: &EdgeMt, input: &TetMesh, words: &str) {
    let report = verified(mt, input);
    assert!(!report.valid);
    assert!(report.failures.iter().any(|f| f.contains(words)), "'{words}' in {:#?}", report.failures);
}

/// The MT with another description and base mesh.
fn with_base(mt: &EdgeMt, change: impl FnOnce(&mut MtInfo, &mut BaseMesh)) -> EdgeMt {
    let (mut info, mut base) = (mt.info().clone(), mt.base().clone());
    change(&mut info, &mut base);
    let mut other = EdgeMt::new(info, base);
    for u in 0..mt.updates() {
        other.push(&mt.update(UpdateId(u))).expect("the same updates");
    }
    other
}

#[test]
fn errors_that_are_too_small_are_found() {
    let mesh = cube(7, &[hilly]);
    let mt = built(&mesh).mt;
    let report = verified(&mt, &mesh);
    assert!(report.valid, "{:#?}", report.failures);
    // Codes are logarithms: 2048 less is half the error.
    let halved =
        tampered(&mt, |_, update| update.errors[0].0 = update.errors[0].0.saturating_sub(2048).max(1));
    let report = verified(&halved, &mesh);
    assert!(report.worst_error_ratio > 1.5, "{}", report.worst_error_ratio);
    fails(&halved, &mesh, "reference vertex");
    let equal = tampered(&mt, |_, update| update.errors[0].0 = 1);
    fails(&equal, &mesh, "more than");
}

/// Every kind of need has its own measure, and none is blind.
#[test]
fn errors_that_are_too_small_are_found_by_needs_of_any_kind() {
    let mesh = cube(9, &[hilly]);
    let mt = built(&mesh).mt;
    let lowered =
        tampered(&mt, |_, update| update.errors[0].0 = update.errors[0].0.saturating_sub(4 * 2048).max(1));
    let centre = [0.3, 0.4, 0.6];
    let ball = Region::Sphere { centre, radius: 0.3 };
    let halves = [[0.3, 0.3, 0.0], [-0.2, 0.2, 0.0], [0.0, 0.0, 0.3]];
    let planes = vec![[1.0, 0.0, 0.0, 0.6], [-1.0, 1.0, 0.0, 0.5]];
    let camera = |pixels: f64| {
        // Along z, from below.
        let rows = [[1.0, 0.0, 0.0, -0.3], [0.0, 1.0, 0.0, -0.4], [0.0, 0.0, 1.0, 0.5], [0.0, 0.0, 1.0, 0.5]];
        let matrix = std::array::from_fn(|i| rows[i % 4][i / 4]);
        Need::seen(View { matrix, viewport: [400.0, 400.0] }, pixels)
    };
    let ramp = vec![(0.2, [0.0; 4]), (0.8, [1.0, 0.5, 0.2, 1.0])];
    let colours = Transfer { field: 0, points: ramp, unit_length: 1.0 };
    let inside = |region: Region| Need::within(0.02).inside(region);
    for (need, words) in [
        (inside(ball.clone()), "error"),
        (inside(Region::OrientedBox { centre, halves }), "error"),
        (inside(Region::HalfSpace { normal: [1.0, 1.0, 0.0], offset: 0.7 }), "error"),
        (inside(Region::Slab { normal: [0.0, 1.0, 0.0], offset: 0.4, thickness: 0.2 }), "error"),
        (inside(Region::Convex(planes)), "error"),
        (Need::within(0.02).between(0, vec![[0.3, 0.6]]), "error"),
        (inside(ball).around(0, &[0.5]), "error"),
        (camera(2.0), "error"),
        (Need::shown(colours, 0.03), "change of colour"),
    ] {
        let requests = [Request::from(need.clone()), Request::within(0.5).and(need)];
        for request in requests {
            let verified = |mt: &EdgeMt| {
                verify::run_requests(
                    mt,
                    &mesh,
                    Reference::Mesh,
                    std::slice::from_ref(&request),
                    &mut |_, _| {},
                )
            };
            let [good, bad] = [&mt, &lowered].map(verified);
            assert!(good.valid && good.queries == 1, "{request:?}: {:?}", good.failures);
            assert!(!bad.valid && bad.worst_error_ratio > 1.0, "{request:?}: {:?}", bad.failures);
            let told = |f: &String| f.contains("reference vertex") && f.contains(words);
            assert!(bad.failures.iter().any(told), "{request:?}: {:?}", bad.failures);
        }
    }
}

#[test]
fn a_single_error_that_is_too_small_is_found() {
    let mesh = cube(6, &[hilly]);
    let mt = built(&mesh).mt;
    let first = mt.update(UpdateId(0)).errors[0].0;
    // The last update of a third, lowered to the smallest error of all: it must go to the end to keep the order.
    let lowered = tampered(&mt, |u, update| {
        if u > mt.updates() / 3 {
            update.errors[0].0 = update.errors[0].0.min(first).saturating_sub(4096).max(1);
        }
    });
    assert!(!verified(&lowered, &mesh).valid);
}

#[test]
fn zero_errors_hide_the_reference_mesh() {
    let mesh = cube(4, &[linear]);
    let mt = built(&mesh).mt;
    let half = mt.updates() / 2;
    let hidden = tampered(&mt, |u, update| update.errors[0].0 *= u16::from(u < half));
    fails(&hidden, &mesh, "full refinement");
}

#[test]
fn a_boundary_that_moves_too_far_is_found() {
    let mesh = bent(7);
    let mt = built(&mesh).mt;
    let report = verified(&mt, &mesh);
    assert!(report.valid, "{:#?}", report.failures);
    let near = with_base(&mt, |info, _| info.displacement_per_error *= 0.05);
    fails(&near, &mesh, "boundary");
}

#[test]
fn wrong_positions_and_levels_are_found() {
    let mesh = cube(5, &[hilly]);
    let mt = built(&mesh).mt;
    // The lowest one, upwards: what comes of it stays on the lattice.
    let value = with_base(&mt, |_, base| *base.values.iter_mut().min().expect("a vertex") += 1);
    fails(&value, &mesh, "not those of the input");
    let last = mt.updates() - 1;
    let level = tampered(&mt, |u, update| update.level_residuals[0] ^= i32::from(u == last));
    fails(&level, &mesh, "not those of the input");
    // A vertex in the middle, moved by a lattice step.
    let place = tampered(&mt, |u, update| update.offset_residual[0] += 2 * i32::from(u == last));
    assert!(!verified(&place, &mesh).valid);
}

#[test]
fn wrong_masks_are_found() {
    let mesh = cube(4, &[hilly]);
    let mt = built(&mesh).mt;
    for u in (0..mt.updates()).step_by(7) {
        for bit in [0, 1, 5] {
            let flipped = tampered(&mt, |k, update| update.wrong_sides ^= u64::from(k == u) << bit);
            assert!(!verified(&flipped, &mesh).valid, "bit {bit} of update {u}");
        }
    }
}

#[test]
fn another_input_is_found() {
    let mesh = cube(5, &[hilly]);
    let mt = built(&mesh).mt;
    fails(&mt, &cube(4, &[hilly]), "built from");
    let mut renamed = mesh.clone();
    renamed.fields[0].name = "other".into();
    fails(&mt, &renamed, "no field 'f0'");
    fails(&mt, &cube(5, &[linear]), "not those of the input");
    let mut moved = mesh.clone();
    moved.positions[40][1] += 0.01;
    fails(&mt, &moved, "full refinement: the volume");
    let mut differing = mesh.clone();
    differing.fields[0].values[40] += 0.01;
    fails(&mt, &differing, "not those of the input");
    // The same points, but one edge runs the other way.
    let flipped = flipped_diagonal(&mesh);
    fails(&mt, &flipped, "not those of the input");
    // The order of points and cells does not matter.
    let mut turned = mesh.clone();
    turned.tets.reverse();
    turned.tets.iter_mut().for_each(|tet| tet.rotate_left(1));
    turned.tets.iter_mut().for_each(|tet| tet.swap(0, 1));
    assert!(verified(&mt, &turned).valid, "{:?}", verified(&mt, &turned).failures);
}

/// The mesh with three tetrahedra around an edge as two, or two as three: whichever is found first.
fn flipped_diagonal(mesh: &TetMesh) -> TetMesh {
    let side = |tet: [u32; 4]| {
        let p = tet.map(|v| mesh.positions[v as usize]);
        let [u, v, w] = [1, 2, 3].map(|k| [0, 1, 2].map(|i| p[k][i] - p[0][i]));
        (u[1] * v[2] - u[2] * v[1]) * w[0]
            + (u[2] * v[0] - u[0] * v[2]) * w[1]
            + (u[0] * v[1] - u[1] * v[0]) * w[2]
    };
    // Two tetrahedra (a, b, c, d) and (a, c, b, e) that lie on two sides of abc, in a quad of the boundary: flip the
    // diagonal of the quad that two boundary faces make.
    for (i, &first) in mesh.tets.iter().enumerate() {
        // Each pair once: the ones before were the first of theirs.
        for (j, &second) in mesh.tets.iter().enumerate().skip(i + 1) {
            let shared: Vec<u32> = first.iter().copied().filter(|v| second.contains(v)).collect();
            let apexes: Vec<u32> = [first, second]
                .iter()
                .flat_map(|tet| tet.iter().copied().filter(|v| !shared.contains(v)))
                .collect();
            let (&[a, b, c], &[d, e]) = (&shared[..], &apexes[..]) else { continue };
            for (x, y, z) in [(a, b, c), (b, c, a), (c, a, b)] {
                // x and y stay at their own tetrahedra, the edge xy goes: d, e, x, y must lie in one plane.
                let flat = side([d, e, x, y]).abs() < 1e-12;
                let halves = [[d, e, z, x], [d, e, y, z]]
                    .map(|t| if side(t) < 0.0 { [t[1], t[0], t[2], t[3]] } else { t });
                let whole = side(first) + side(second);
                let fits = flat && (side(halves[0]) + side(halves[1]) - whole).abs() < 1e-12;
                if !fits || halves.iter().any(|t| side(*t) < 1e-9) {
                    continue;
                }
                let others = mesh.tets.iter().filter(|t| t.contains(&x) && t.contains(&y)).count();
                if others == 2 {
                    let mut flipped = mesh.clone();
                    (flipped.tets[i], flipped.tets[j]) = (halves[0], halves[1]);
                    tetralod::mesh::check(&flipped).expect("a flip keeps the mesh valid");
                    return flipped;
                }
            }
        }
    }
    panic!("every grid has a diagonal that can be flipped");
}
