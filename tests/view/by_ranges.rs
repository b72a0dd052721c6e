//! Promise: a mesh or a surface that is kept up by ranges looks, byte for byte, as one that comes as a whole,
//! and what is uploaded goes with what has changed.

use crate::support::conformance::EDGE;
use crate::support::meshes::{cube, hilly};
use crate::twin::{self, UNIT};
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::Camera;
use tetralod::mesh::NONE;
use tetralod::refine::{Budget, Need, Request};
use tetralod::session::Session;
use tetralod::view::{IsoSurface, Medium, Triangles};
use tetralod_render::draw::{CellShape, CellStyle, Look, Style};
use tetralod_render::gpu::Renderer;

const SIZE: [u32; 2] = [120, 90];

fn session(cells: u32) -> Session {
    let bytes =
        encode(&EDGE.build(&cube(cells, &[hilly]), None), &EncodeOptions::default()).expect("complete");
    let mut session = Session::new();
    session.feed(&bytes).expect("a good file");
    session
}

/// Up and down in large and small steps.
fn requests() -> Vec<Request> {
    let everywhere = [f64::INFINITY, 0.1, 0.02, 0.0, 0.015, 0.05, 0.004, f64::INFINITY];
    let mut requests: Vec<_> = everywhere.map(Request::within).to_vec();
    for tets in [6000, 6040, 6010, 2000, 2030] {
        let budget = Budget { tets: Some(tets), ..Budget::default() };
        requests.push(Request { needs: vec![Need::within(0.0)], budget });
    }
    requests
}

fn camera() -> Camera {
    let mut camera = Camera::home(&UNIT, twin::aspect(SIZE));
    camera.orbit(0.4, 0.1);
    camera
}

/// Fog, and the tetrahedra as wires in it.
fn show_mesh(renderer: &mut Renderer) {
    let medium = Medium::new(&[(0.0, [0.2, 0.4, 0.9, 0.1]), (1.0, [1.0, 0.5, 0.1, 0.8])], 0.5);
    renderer.set_volume(Some((&medium, u32::MAX))).unwrap();
    renderer.set_cells(Some(&CellStyle { shape: CellShape::Wire, ..CellStyle::default() }));
}

#[test]
fn a_mesh_kept_up_by_ranges_is_the_whole_mesh() {
    let mut kept = twin::renderer(SIZE);
    show_mesh(&mut kept);
    let (mut session, camera, look) = (session(12), camera(), Look::default());
    let mut small = 0;
    for (step, request) in requests().iter().enumerate() {
        session.refine(request).expect("a good request");
        let changes = session.take_changes();
        let view = session.view();
        kept.take_uploaded();
        let changed = changes.tets.iter().map(|range| range.end - range.start).sum::<u32>() as usize;
        kept.update_mesh(&view, Some([&changes.vertices, &changes.tets])).unwrap();
        let by_ranges = kept.take_uploaded();
        let mut fresh = twin::renderer(SIZE);
        show_mesh(&mut fresh);
        fresh.take_uploaded();
        fresh.update_mesh(&view, None).unwrap();
        let as_a_whole = fresh.take_uploaded();
        let found = twin::bytes(&mut kept, &camera, &look);
        assert!(found == twin::bytes(&mut fresh, &camera, &look), "step {step}");
        twin::save(&format!("ranges-{step}"), SIZE, &twin::colours(&found));
        println!("step {step}: {changed} of {} changed, {by_ranges} of {as_a_whole} bytes", view.tets.len());
        if changed < view.tets.len() / 2 {
            small += 1;
            // Ranges that are close together come as one.
            assert!(by_ranges < as_a_whole, "step {step}: {by_ranges} of {as_a_whole} bytes");
        }
        // Nothing has changed, and nothing but the boundary comes.
        let live = view.tets.iter().zip(view.neighbors).filter(|(tet, _)| tet[0] != NONE);
        let faces = live.flat_map(|(_, around)| around).filter(|other| **other == NONE).count();
        kept.update_mesh(&view, Some([&[], &[]])).unwrap();
        assert_eq!(kept.take_uploaded(), 16 * faces as u64);
        assert!(twin::bytes(&mut kept, &camera, &look) == found);
    }
    assert!(small >= 1, "{small} small steps");
}

#[test]
fn a_part_of_the_mesh_that_is_needed_later_is_there() {
    let mut kept = twin::renderer(SIZE);
    let (mut session, camera, look) = (session(8), camera(), Look::default());
    let cells = CellStyle { shape: CellShape::Wire, ..CellStyle::default() };
    let medium = Medium::new(&[(0.0, [0.2, 0.4, 0.9, 0.1]), (1.0, [1.0, 0.5, 0.1, 0.8])], 0.5);
    for (step, request) in requests().iter().enumerate() {
        // Volume, cells, both or none.
        let shown = [step % 2 == 0, step % 3 != 1];
        session.refine(request).expect("a good request");
        let changes = session.take_changes();
        let mut fresh = twin::renderer(SIZE);
        for renderer in [&mut kept, &mut fresh] {
            renderer.set_volume(shown[0].then_some((&medium, u32::MAX))).unwrap();
            renderer.set_cells(shown[1].then_some(&cells));
        }
        let view = session.view();
        kept.update_mesh(&view, Some([&changes.vertices, &changes.tets])).unwrap();
        fresh.update_mesh(&view, None).unwrap();
        assert!(!kept.wants_mesh());
        let found = twin::bytes(&mut kept, &camera, &look);
        assert!(found == twin::bytes(&mut fresh, &camera, &look), "step {step}: {shown:?}");
    }
}

#[test]
fn surfaces_kept_up_by_ranges_are_whole_ones() {
    let mut kept = twin::renderer(SIZE);
    let (mut session, camera, look) = (session(12), camera(), Look::default());
    let mut small = 0;
    for (step, request) in requests().iter().enumerate() {
        session.refine(request).expect("a good request");
        let surface: IsoSurface = session.isosurface(0.35).expect("it is open").clone();
        let changes = session.take_surface_changes();
        let triangles = Triangles::from(&surface);
        kept.take_uploaded();
        kept.set_surface(3, &triangles, Some(&changes)).unwrap();
        let by_ranges = kept.take_uploaded();
        let mut fresh = twin::renderer(SIZE);
        fresh.set_surface(3, &triangles, None).unwrap();
        let as_a_whole = fresh.take_uploaded();
        let (changed, all) = (
            changes.triangles.iter().map(|range| range.end - range.start).sum::<u32>() as usize,
            surface.indices.len(),
        );
        println!("step {step}: {changed} of {all} changed, {by_ranges} of {as_a_whole} bytes");
        if changed < all / 2 {
            small += 1;
            // Ranges that are close together come as one.
            assert!(by_ranges < as_a_whole, "step {step}: {by_ranges} of {as_a_whole} bytes");
        }
        for opacity in [1.0, 0.5] {
            let style = Style { opacity, ..Style::default() };
            kept.set_style(3, &style);
            fresh.set_style(3, &style);
            let found = twin::bytes(&mut kept, &camera, &look);
            assert!(found == twin::bytes(&mut fresh, &camera, &look), "step {step}, opacity {opacity}");
        }
    }
    assert!(small >= 1, "{small} small steps");
}
