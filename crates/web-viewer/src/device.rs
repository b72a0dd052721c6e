//! What draws the pictures of a viewer: WebGPU, or WebGL 2 where there is none.

use js_sys::{Float32Array, Uint8Array, Uint32Array};
use tetralod::geom::Camera;
use tetralod_render::Draw;
use tetralod_render::draw::Look;
use tetralod_render::gpu::webgl::{Drawn, GlContext, Numbers, Place, WebGl};
use tetralod_render::gpu::{GpuError, Renderer, SideTarget};
use wasm_bindgen::prelude::wasm_bindgen;

type Result<T> = std::result::Result<T, GpuError>;

/// What a viewer needs of a renderer, beside drawing.
pub(crate) trait Device: Draw {
    /// What it draws with.
    fn kind(&self) -> &'static str;
    /// Fails if the GPU is lost.
    fn check(&self) -> Result<()>;
    /// The GPU in words.
    fn description(&self) -> String;
    /// Whether the processor draws.
    fn is_software(&self) -> bool;
    /// Width and height in pixels.
    fn size(&self) -> [u32; 2];
    fn resize(&mut self, size: [u32; 2]);
    fn set_scale(&mut self, scale: f64);
    fn set_quick(&mut self, is_quick: bool);
    /// Pictures that the one which is shown is the mean of.
    fn drawn(&self) -> u32;
    /// Pictures that the GPU has not finished.
    fn in_flight(&self) -> Result<u32>;
    /// Whether the last picture lacked room for all that is not opaque.
    fn is_short(&mut self) -> bool;
    fn take_uploaded(&mut self) -> u64;
    /// Bytes of memory on the GPU.
    fn memory(&self) -> u64;
    /// The largest width and height of a picture.
    fn largest_picture(&self) -> u32;
    /// Another target, of the size of a canvas.
    fn side(&mut self, canvas: web_sys::OffscreenCanvas) -> Result<Side>;
    /// Draws a picture there, as the mean of `samples`.
    fn draw_side(&mut self, side: &mut Side, camera: &Camera, look: &Look, samples: u32) -> Result<()>;
    /// As `is_short`, of a picture there.
    fn is_side_short(&mut self, side: &mut Side) -> bool;

    fn aspect(&self) -> f64 {
        let [width, height] = self.size();
        f64::from(width) / f64::from(height)
    }
}

/// A target beside the own one.
pub(crate) enum Side {
    WebGpu(Box<SideTarget>),
    WebGl(web_sys::OffscreenCanvas),
}

impl Device for Renderer {
    fn kind(&self) -> &'static str {
        "webgpu"
    }

    fn check(&self) -> Result<()> {
        self.check()
    }

    fn description(&self) -> String {
        self.description()
    }

    fn is_software(&self) -> bool {
        self.is_software()
    }

    fn size(&self) -> [u32; 2] {
        self.size()
    }

    fn resize(&mut self, size: [u32; 2]) {
        self.resize(size);
    }

    fn set_scale(&mut self, scale: f64) {
        self.set_scale(scale);
    }

    fn set_quick(&mut self, is_quick: bool) {
        self.set_quick(is_quick);
    }

    fn drawn(&self) -> u32 {
        self.drawn()
    }

    fn in_flight(&self) -> Result<u32> {
        self.in_flight()
    }

    fn is_short(&mut self) -> bool {
        self.is_short()
    }

    fn take_uploaded(&mut self) -> u64 {
        Renderer::take_uploaded(self)
    }

    fn memory(&self) -> u64 {
        self.memory()
    }

    fn largest_picture(&self) -> u32 {
        self.largest_picture()
    }

    fn side(&mut self, canvas: web_sys::OffscreenCanvas) -> Result<Side> {
        let size = [canvas.width(), canvas.height()];
        Ok(Side::WebGpu(Box::new(self.side_target(wgpu::SurfaceTarget::OffscreenCanvas(canvas), size)?)))
    }

    fn draw_side(&mut self, side: &mut Side, camera: &Camera, look: &Look, samples: u32) -> Result<()> {
        let Side::WebGpu(target) = side else { return Ok(()) };
        self.draw_on_side(target, camera, look, samples)
    }

    fn is_side_short(&mut self, side: &mut Side) -> bool {
        let Side::WebGpu(target) = side else { return false };
        Renderer::is_side_short(self, target)
    }
}

#[wasm_bindgen]
extern "C" {
    /// The class of `webgl.ts`.
    #[derive(Debug)]
    #[wasm_bindgen(typescript_type = "GlCanvas")]
    pub type GlCanvas;

    #[wasm_bindgen(method, js_name = setArray)]
    fn set_floats(this: &GlCanvas, side: u32, key: u32, name: &str, each: u32, numbers: &Float32Array)
    -> f64;
    #[wasm_bindgen(method, js_name = setArray)]
    fn set_whole(this: &GlCanvas, side: u32, key: u32, name: &str, each: u32, numbers: &Uint32Array) -> f64;
    #[wasm_bindgen(method, js_name = setDrawn)]
    fn set_drawn(
        this: &GlCanvas,
        side: u32,
        key: u32,
        programs: &str,
        vertices: u32,
        cut: u32,
        variant: u32,
        style: &Uint8Array,
    );
    #[wasm_bindgen(method)]
    fn remove(this: &GlCanvas, side: u32, key: u32);
    #[wasm_bindgen(method, js_name = setSize)]
    fn set_size(this: &GlCanvas, width: u32, height: u32, drawn_width: u32, drawn_height: u32);
    #[wasm_bindgen(method)]
    fn draw(this: &GlCanvas, side: u32, frame: &Uint8Array, columns: u32, count: f64) -> bool;
    #[wasm_bindgen(method)]
    fn enter(this: &GlCanvas, canvas: &web_sys::OffscreenCanvas);
    #[wasm_bindgen(method)]
    fn leave(this: &GlCanvas);
    #[wasm_bindgen(method, getter)]
    fn lost(this: &GlCanvas) -> Option<String>;
    #[wasm_bindgen(method, getter)]
    fn description(this: &GlCanvas) -> String;
    #[wasm_bindgen(method, getter, js_name = isSoftware)]
    fn is_software(this: &GlCanvas) -> bool;
    #[wasm_bindgen(method, getter, js_name = hasMean)]
    fn has_mean(this: &GlCanvas) -> bool;
    #[wasm_bindgen(method, getter, js_name = inFlight)]
    fn in_flight(this: &GlCanvas) -> u32;
    #[wasm_bindgen(method, js_name = isShort)]
    fn is_short(this: &GlCanvas) -> bool;
    #[wasm_bindgen(method, getter)]
    fn memory(this: &GlCanvas) -> f64;
    #[wasm_bindgen(method, getter)]
    fn largest(this: &GlCanvas) -> u32;
}

impl GlContext for GlCanvas {
    fn set_array(
        &mut self,
        (side, key): Place,
        name: &'static str,
        each: u32,
        numbers: Numbers<'_>,
    ) -> Option<u32> {
        let most = match numbers {
            Numbers::Floats(numbers) => self.set_floats(side, key, name, each, &Float32Array::from(numbers)),
            Numbers::Whole(numbers) => self.set_whole(side, key, name, each, &Uint32Array::from(numbers)),
        };
        most.is_finite().then_some(most as u32)
    }

    fn set_drawn(&mut self, (side, key): Place, drawn: &Drawn<'_>) {
        let Drawn { program, cut, vertices, variant, style } = drawn;
        let programs = format!("{program} {cut}");
        GlCanvas::set_drawn(
            self,
            side,
            key,
            &programs,
            vertices[0],
            vertices[1],
            *variant,
            &Uint8Array::from(*style),
        );
    }

    fn remove(&mut self, (side, key): Place) {
        GlCanvas::remove(self, side, key);
    }

    fn set_size(&mut self, [width, height]: [u32; 2], drawn: [u32; 2]) {
        GlCanvas::set_size(self, width, height, drawn[0], drawn[1]);
    }

    fn draw(&mut self, side: u32, frame: &[u8], columns: u32, count: Option<u32>) -> bool {
        GlCanvas::draw(self, side, &Uint8Array::from(frame), columns, count.map_or(-1.0, f64::from))
    }
}

impl Device for WebGl<GlCanvas> {
    fn kind(&self) -> &'static str {
        "webgl"
    }

    fn check(&self) -> Result<()> {
        self.context.lost().map_or(Ok(()), |why| Err(GpuError::DeviceLost(why)))
    }

    fn description(&self) -> String {
        self.context.description()
    }

    fn is_software(&self) -> bool {
        self.context.is_software()
    }

    fn size(&self) -> [u32; 2] {
        self.size()
    }

    fn resize(&mut self, size: [u32; 2]) {
        let most = self.context.largest();
        self.resize(size.map(|length| length.min(most)));
    }

    fn set_scale(&mut self, scale: f64) {
        self.set_scale(scale);
    }

    fn set_quick(&mut self, is_quick: bool) {
        self.set_quick(is_quick);
    }

    fn drawn(&self) -> u32 {
        // Where there can be no mean, one picture is all.
        let drawn = self.drawn();
        if drawn > 0 && !self.context.has_mean() { u32::MAX } else { drawn }
    }

    fn in_flight(&self) -> Result<u32> {
        self.check()?;
        Ok(self.context.in_flight())
    }

    fn is_short(&mut self) -> bool {
        self.context.is_short()
    }

    fn take_uploaded(&mut self) -> u64 {
        self.take_uploaded()
    }

    fn memory(&self) -> u64 {
        self.context.memory() as u64
    }

    fn largest_picture(&self) -> u32 {
        self.context.largest()
    }

    fn side(&mut self, canvas: web_sys::OffscreenCanvas) -> Result<Side> {
        Ok(Side::WebGl(canvas))
    }

    fn draw_side(&mut self, side: &mut Side, camera: &Camera, look: &Look, samples: u32) -> Result<()> {
        let Side::WebGl(canvas) = side else { return Ok(()) };
        let size = [canvas.width(), canvas.height()];
        let enter = |context: &mut GlCanvas| context.enter(canvas);
        self.draw_aside((size, samples), (camera, look), enter, |context| context.leave());
        self.check()
    }

    fn is_side_short(&mut self, _: &mut Side) -> bool {
        self.context.is_short()
    }
}
