//! In a real browser: the renderer draws on WebGPU.
//!
//! `cargo xtask test wasm` makes the fixture and runs this; TETRALOD_FIXTURE is its folder.
#![cfg(target_arch = "wasm32")]

use wasm_bindgen_test::{wasm_bindgen_test, wasm_bindgen_test_configure};

wasm_bindgen_test_configure!(run_in_browser);

const MT: &[u8] = include_bytes!(concat!(env!("TETRALOD_FIXTURE"), "/small.mt"));

#[wasm_bindgen_test]
async fn the_renderer_draws_the_isosurface() {
    use tetralod::geom::{Bounds, Camera};
    use tetralod::refine::Request;
    use tetralod::session::Session;
    use tetralod::view::Triangles;
    use tetralod_render::draw::Look;
    use tetralod_render::gpu::Renderer;

    const SIZE: [u32; 2] = [128, 96];
    let mut session = Session::new();
    session.feed(MT).expect("the fixture is a good file");
    session.refine(&Request::within(0.01)).expect("a good request");
    let mut renderer = Renderer::headless(SIZE).await.expect("WebGPU");
    let camera = Camera::home(&Bounds { min: [0.0; 3], max: [1.0; 3] }, renderer.aspect());
    // The ball is warm, the background cool. Empty space between the atoms at 0.5; nothing at all above the maximum.
    for (value, warm) in [(0.5, 500..4000), (99.0, 0..1)] {
        let surface = Triangles::from(session.isosurface(value).expect("a surface"));
        renderer.set_surface(0, &surface, None).expect("it fits");
        assert!(renderer.draw(&camera, &Look::default()).expect("a picture"));
        let pixels = renderer.read().await.expect("pixels");
        assert_eq!(pixels.len(), (SIZE[0] * SIZE[1] * 4) as usize);
        let seen = pixels.chunks_exact(4).filter(|p| p[0] > p[2].saturating_add(20)).count();
        assert!(warm.contains(&seen), "{seen} warm pixels at {value}");
    }
}

/// Told only what has changed, the renderer draws what it draws of the whole surface.
#[wasm_bindgen_test]
async fn a_surface_is_kept_up_by_what_has_changed() {
    use tetralod::geom::{Bounds, Camera};
    use tetralod::refine::{Need, Request};
    use tetralod::session::Session;
    use tetralod::view::Triangles;
    use tetralod_render::draw::Look;
    use tetralod_render::gpu::Renderer;

    const SIZE: [u32; 2] = [96, 96];
    let mut session = Session::new();
    session.feed(MT).expect("the fixture is a good file");
    let mut whole = Renderer::headless(SIZE).await.expect("WebGPU");
    let mut parts = Renderer::headless(SIZE).await.expect("WebGPU");
    let camera = Camera::home(&Bounds { min: [0.0; 3], max: [1.0; 3] }, whole.aspect());
    for i in 0..10_u32 {
        let low = 0.08 * f64::from(i);
        let near = Bounds { min: [low, 0.2, 0.2], max: [low + 0.25, 0.8, 0.8] };
        let request = Request::within(0.1).and(Need::within(0.004).inside(near));
        let request = if i == 6 { Request::default() } else { request };
        session.refine(&request).expect("a good request");
        let value = if i < 8 { 0.5 } else { 0.55 };
        session.isosurface(value).expect("a surface");
        let changes = session.take_surface_changes();
        let surface = Triangles::from(session.isosurface(value).expect("a surface"));
        whole.set_surface(0, &surface, None).expect("it fits");
        parts.set_surface(0, &surface, Some(&changes)).expect("it fits");
        let mut pictures = Vec::new();
        for renderer in [&mut whole, &mut parts] {
            assert!(renderer.draw(&camera, &Look::default()).expect("a picture"));
            pictures.push(renderer.read().await.expect("pixels"));
        }
        assert_eq!(pictures[0], pictures[1], "step {i}");
    }
}
