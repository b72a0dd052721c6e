//! The wasm module `viewer` of the npm package: the class that the viewer's worker holds, with a session, a renderer on
//! a canvas, and what the user has set.
//!
//! Nothing is computed before it is drawn: setters only note what is out of date, [`Viewer::frame`] brings it up to
//! date and draws if anything has changed. The mesh follows what is asked for in short steps between the frames
//! ([`Viewer::step`]), so that the camera never waits for it. Screen points are given in normalised coordinates, as in
//! [`Camera`](tetralod::geom::Camera).
#![cfg(target_arch = "wasm32")]

mod device;
mod overlay;
mod screenshot;

use device::{Device, GlCanvas, Side};
use glam::DVec2;
use js_sys::Uint8Array;
use serde::Serialize;
use tetralod::geom::{Bounds, Camera, CameraState, ViewPreset};
use tetralod::refine::{Part, View};
use tetralod::session::MappedBlock;
use tetralod::view::BoxEdge;
use tetralod::view::gizmo::{self, BoxFace};
use tetralod_render::SceneRenderer;
use tetralod_render::gpu::Renderer;
use tetralod_render::gpu::webgl::WebGl;
use tetralod_render::scene::{Legend, OtherMesh, SceneState};
use tetralod_web::arrays::{doubles, list, object, objects, set};
use tetralod_web::file::File;
use tetralod_web::loader::RangeLoader;
use tetralod_web::mesh_tools;
use tetralod_web::options::RefineOptions;
use tetralod_web::results::{self, JsBlocks, JsInfo, JsMesh, JsProgress, JsStats};
use tetralod_web_options::error::WebError;
use tetralod_web_options::reader::read;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};

/// How close to a handle the pointer must be, in units of the page's layout.
const REACH: f64 = 18.0;

/// Pictures of which the one at rest is the mean.
const SAMPLES: u32 = 8;

/// Ticks of the legend, at most, and its colours.
const TICKS: usize = 7;
const COLOURS: usize = 32;
/// Colours of a legend of labels, about: each label has as many, so that there is no gradient between two of them.
const STEPS: usize = 240;
/// Labels that have a tick, at most.
const LABELS: usize = 24;

/// An MT and its picture on a canvas.
#[wasm_bindgen]
pub struct Viewer {
    pub(crate) file: File,
    /// What takes the place of `file` when its first bytes are here.
    next: Option<File>,
    pub(crate) scene: SceneRenderer<dyn Device>,
    pub(crate) camera: Camera,
    pub(crate) ratio: f64,
    /// The view that the needs which follow the camera have now.
    seen: View,
    /// Whether the mesh is not yet the one that was asked for.
    moving: bool,
    /// Whether the mesh stays as it is.
    is_frozen: bool,
    /// Whether the picture is out of date.
    pub(crate) is_stale: bool,
    /// The edges of the box whose ticks the overlay shows.
    pub(crate) tick_edges: [Option<BoxEdge>; 3],
    /// The picture beside the canvas that is being made.
    pub(crate) screenshot: Option<Side>,
}

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r#"import type { BlockMap } from "./results.js";
import type { CameraState, Legend, Overlay, Reading, SceneState } from "./scene.js";
import type { GlCanvas } from "./webgl.js";"#;

#[wasm_bindgen]
extern "C" {
    /// What is drawn, as JavaScript gives it: anything at all.
    #[wasm_bindgen(typescript_type = "SceneState")]
    pub type JsScene;
    /// Where the camera is.
    #[wasm_bindgen(typescript_type = "CameraState")]
    pub type JsCamera;
    /// What the colours mean.
    #[wasm_bindgen(typescript_type = "Legend")]
    pub type JsLegend;
    /// What is at a point.
    #[wasm_bindgen(typescript_type = "Reading")]
    pub type JsReading;
    /// Where the blocks of a file are.
    #[wasm_bindgen(typescript_type = "BlockMap")]
    pub type JsBlockMap;
}

/// Plain data for JavaScript.
fn plain<T: JsCast>(data: &impl Serialize) -> T {
    serde_wasm_bindgen::to_value(data).unwrap_or_default().unchecked_into()
}

/// A GPU that draws on a canvas.
#[wasm_bindgen]
pub struct Gpu(Box<dyn Device>);

#[wasm_bindgen]
impl Gpu {
    /// Opens the GPU for `canvas`, which must not have a context of another kind.
    pub async fn open(canvas: web_sys::OffscreenCanvas, width: u32, height: u32) -> Result<Gpu, WebError> {
        let target = wgpu::SurfaceTarget::OffscreenCanvas(canvas);
        Ok(Self(Box::new(Renderer::on_surface(target, [width, height]).await?)))
    }

    /// Draws with WebGL 2 on a canvas of this size.
    pub fn webgl(canvas: GlCanvas, width: u32, height: u32) -> Gpu {
        Self(Box::new(WebGl::new(canvas, [width, height])))
    }
}

#[wasm_bindgen]
impl Viewer {
    /// Draws with `gpu`.
    #[wasm_bindgen(constructor)]
    pub fn new(gpu: Gpu, ratio: f32) -> Viewer {
        let Gpu(renderer) = gpu;
        let camera = Camera::home(&Bounds::EMPTY, renderer.aspect());
        let mut scene = SceneRenderer::of(renderer);
        scene.set_pixel_ratio(ratio);
        Self {
            file: File::default(),
            next: None,
            scene,
            camera,
            ratio: f64::from(ratio),
            seen: View { matrix: [0.0; 16], viewport: [1.0; 2] },
            moving: false,
            is_frozen: false,
            is_stale: true,
            tick_edges: [None; 3],
            screenshot: None,
        }
    }

    /// Draws with another GPU, after the one before was lost.
    #[wasm_bindgen(js_name = setGpu)]
    pub fn set_gpu(&mut self, gpu: Gpu) {
        self.scene.set_renderer(gpu.0);
        self.is_stale = true;
    }

    /// Fails if the GPU is lost.
    pub fn check(&self) -> Result<(), WebError> {
        Ok(self.scene.renderer().check()?)
    }

    /// The GPU in words.
    pub fn adapter(&self) -> String {
        self.scene.renderer().description()
    }

    /// What draws: `"webgpu"` or `"webgl"`.
    #[wasm_bindgen(getter)]
    pub fn renderer(&self) -> String {
        self.scene.renderer().kind().to_owned()
    }

    /// Whether the processor draws, and no GPU.
    #[wasm_bindgen(getter, js_name = isSoftware)]
    pub fn is_software(&self) -> bool {
        self.scene.renderer().is_software()
    }

    /// Forgets the volume, for another one, that is fed from front to back; what the user has set about the view goes with it.
    pub fn clear(&mut self, fields: Vec<String>) -> Result<(), WebError> {
        self.show_file(File::whole(fields))
    }

    /// Another volume, that `loader` brings in parts: it takes the place of the one that is shown when its first bytes are here.
    #[wasm_bindgen(js_name = openParts)]
    pub fn open_parts(&mut self, fields: Vec<String>, memory: f64, loader: &RangeLoader) {
        self.next = Some(File::in_parts(fields, memory, loader));
    }

    /// Whether such a volume has not taken its place yet.
    #[wasm_bindgen(getter, js_name = isOpening)]
    pub fn is_opening(&self) -> bool {
        self.next.is_some()
    }

    /// The file that is being opened, or the one that is shown.
    fn coming(&self) -> &File {
        self.next.as_ref().unwrap_or(&self.file)
    }

    fn show_file(&mut self, file: File) -> Result<(), WebError> {
        (self.file, self.next) = (file, None);
        self.moving = false;
        self.is_stale = true;
        Ok(self.scene.forget()?)
    }

    /// Takes the next bytes of the file, however they were cut.
    pub fn feed(&mut self, bytes: &[u8]) -> Result<JsProgress, WebError> {
        self.file.session.feed(bytes)?;
        self.arrive();
        Ok(self.progress())
    }

    /// Takes the complete ranges of the loader, and gives it those that are wanted then; whether there was any.
    pub fn supply(&mut self) -> Result<bool, WebError> {
        let Some(mut next) = self.next.take() else {
            let any = self.file.supply()?;
            self.arrive();
            return Ok(any);
        };
        let supplied = next.supply();
        // A file that is broken from its beginning does not take the place of one that is sound.
        let is_known = next.session.info().is_some();
        if matches!(supplied, Ok(false)) || supplied.is_err() && !is_known {
            self.next = Some(next);
            return supplied;
        }
        self.show_file(next)?;
        self.arrive();
        supplied
    }

    /// Whether more is to come of a file in parts, if all goes well.
    #[wasm_bindgen(getter, js_name = isWaiting)]
    pub fn is_waiting(&self) -> bool {
        self.coming().is_waiting()
    }

    /// How much of the file has come.
    pub fn progress(&self) -> JsProgress {
        self.coming().progress()
    }

    /// How the blocks stand.
    pub fn blocks(&self) -> JsBlocks {
        self.coming().blocks()
    }

    /// Where the blocks are, and which of them are here; nothing where the file has no index.
    #[wasm_bindgen(js_name = blockMap)]
    pub fn block_map(&self) -> Option<JsBlockMap> {
        let blocks = self.file.session.block_map();
        let bounds: Vec<f64> = blocks.iter().flat_map(|block| flat(&block.bounds)).collect();
        let states: Vec<u8> = blocks.iter().map(|block: &MappedBlock| block.state as u8).collect();
        let map =
            || object(&[("bounds", doubles(&bounds)), ("states", Uint8Array::from(&states[..]).into())]);
        (!blocks.is_empty()).then(map)
    }

    /// The file has ended: refuses one that was cut short.
    pub fn finish(&mut self) -> Result<JsProgress, WebError> {
        self.file.session.finish()?;
        Ok(self.progress())
    }

    /// What is known of the MT; `undefined` until the base mesh is there.
    pub fn info(&self) -> Option<JsInfo> {
        results::info(&self.file.session)
    }

    /// The box around the mesh: `[x0, y0, z0, x1, y1, z1]`; empty until the base mesh is there.
    pub fn bounds(&self) -> Box<[f64]> {
        self.scene.bounds().map_or_else(Box::default, flat)
    }

    /// Sets the request, for `step` to make its mesh. Views without a matrix follow the camera.
    pub fn request(&mut self, options: &RefineOptions) -> Result<(), WebError> {
        let (seen, before) = (self.view(), self.file.asked.field);
        self.file.regions = self.scene.shown_regions(&self.file.session)?;
        self.file.request(options, Some(&seen))?;
        (self.seen, self.moving) = (seen, true);
        if self.file.asked.field != before {
            // The colours are those of another field.
            self.scene.set_state(self.scene.state().clone())?;
            self.is_stale = true;
        }
        Ok(())
    }

    /// More of the file has come, and with it perhaps what was asked for.
    #[wasm_bindgen(js_name = requestAgain)]
    pub fn request_again(&mut self) {
        self.moving = self.file.session.info().is_some();
    }

    /// Whether `step` has something to do.
    #[wasm_bindgen(getter)]
    pub fn moving(&self) -> bool {
        !self.is_frozen && self.is_behind()
    }

    fn is_behind(&self) -> bool {
        self.moving || !self.file.asked.follows.is_empty() && self.view() != self.seen
    }

    /// Keeps a copy of the mesh, to be compared with later ones.
    pub fn keep(&mut self) -> Result<(), WebError> {
        self.is_stale = true;
        Ok(self.scene.keep(&mut self.file.session)?)
    }

    /// Keeps a mesh of another file, of which some fields of this one are given by their numbers: all values of one behind those of the other.
    #[wasm_bindgen(js_name = keepOther)]
    pub fn keep_other(
        &mut self,
        positions: &[f64],
        tets: &[u32],
        numbers: &[usize],
        values: &[f64],
        reach: f64,
    ) -> Result<(), WebError> {
        let positions = positions.as_chunks().0.to_vec();
        let each = values.chunks(positions.len().max(1)).map(<[f64]>::to_vec);
        let fields = numbers.iter().copied().zip(each).collect();
        let other = OtherMesh { positions, tets: tets.as_chunks().0.to_vec(), fields, reach };
        self.is_stale = true;
        Ok(self.scene.keep_other(&self.file.session, other)?)
    }

    /// Keeps the mesh as it is, whatever is asked for and wherever the camera goes; or lets it follow again.
    pub fn freeze(&mut self, is_frozen: bool) {
        self.is_frozen = is_frozen;
    }

    /// Holds the mesh to so many tetrahedra for a time, if the request allows more; `undefined` ends that.
    pub fn limit(&mut self, tets: Option<u32>) -> Result<(), WebError> {
        self.moving = self.file.session.info().is_some();
        self.file.limit(tets)
    }

    /// Goes on towards the mesh that is wanted for about so many milliseconds.
    pub fn step(&mut self, milliseconds: f64) -> Result<JsStats, WebError> {
        // What fails would fail again: it is not tried before something else is asked for.
        self.moving = false;
        self.follow_camera()?;
        let shown = self.scene.shown_regions(&self.file.session)?;
        if shown != self.file.regions {
            self.file.regions = shown;
            self.file.request_again()?;
        }
        let stats = self.file.step(milliseconds, f64::INFINITY)?;
        self.moving = !stats.done;
        self.is_stale |= stats.refined + stats.coarsened > 0;
        self.file.stats(&stats)
    }

    /// A copy of the mesh that is shown.
    pub fn mesh(&mut self) -> Result<JsMesh, WebError> {
        let stored = self.file.stored()?;
        Ok(results::mesh_arrays(&self.file.session.view(), &stored, 0b1111))
    }

    /// Sets what is drawn: a [`SceneState`](tetralod_render::scene::SceneState) as a plain object.
    #[wasm_bindgen(js_name = setScene)]
    pub fn set_scene(&mut self, state: &JsScene) -> Result<(), WebError> {
        let state: SceneState = read(state).map_err(|error| error.with_value(state))?;
        let is_behind = state.regions != self.scene.state().regions;
        self.scene.set_state(state)?;
        // What is displaced may leave the box of the model.
        if let Some(bounds) = self.shown_bounds() {
            self.camera.set_model(&bounds);
        }
        self.is_stale = true;
        // What is not shown is not asked for.
        self.moving |= is_behind && self.file.session.info().is_some();
        Ok(())
    }

    /// The box that all is shown in; none until the base mesh is there.
    fn shown_bounds(&self) -> Option<Bounds> {
        self.scene.shown_bounds(&self.file.session)
    }

    /// Where the camera is.
    pub fn camera(&self) -> JsCamera {
        plain(&self.camera.state())
    }

    /// Moves the camera to where `camera` returned that it is.
    #[wasm_bindgen(js_name = setCamera)]
    pub fn set_camera(&mut self, state: &JsCamera) -> Result<(), WebError> {
        let state: CameraState = read(state).map_err(|error| error.with_value(state))?;
        let problem = self.camera.set_state(&state);
        problem.map_err(|problem| WebError::bad_option("camera", &problem.to_string()))?;
        self.is_stale = true;
        Ok(())
    }

    /// What the colours mean; nothing where nothing is coloured by values.
    pub fn legend(&self) -> Option<JsLegend> {
        let Legend { label, scale, labels, apart } = self.scene.legend()?;
        let css = |[red, green, blue]: [u8; 3]| JsValue::from(format!("#{red:02x}{green:02x}{blue:02x}"));
        let tick = |value: f64, label: String, fraction: f64| {
            object(&[("value", value.into()), ("label", label.into()), ("fraction", fraction.into())])
        };
        let (colours, ticks): (Vec<JsValue>, Vec<JsValue>) = if labels.is_empty() {
            let colours = scale.table::<COLOURS>().map(|[red, green, blue, _]| css([red, green, blue]));
            let ticks = scale.ticks(TICKS).into_iter();
            let ticks = ticks.map(|of| tick(of.value, of.label, scale.fraction(of.value)));
            (colours.to_vec(), ticks.collect())
        } else {
            let each = (STEPS / labels.len()).max(1);
            let colours = labels.iter().flat_map(|(_, colour)| std::iter::repeat_n(css(*colour), each));
            let middle = |i: usize| (i as f64 + 0.5) / labels.len() as f64;
            let ticks = labels.iter().enumerate().step_by(labels.len().div_ceil(LABELS));
            let ticks = ticks.map(|(i, (value, _))| tick(*value, value.to_string(), middle(i)));
            (colours.collect(), ticks.collect())
        };
        let range = match (labels.first(), labels.last()) {
            (Some((least, _)), Some((most, _))) => [*least, *most],
            _ => scale.range,
        };
        let labels = labels
            .iter()
            .map(|(value, colour)| object(&[("value", (*value).into()), ("colour", css(*colour))]));
        Some(object(&[
            ("label", label.as_str().into()),
            ("range", list(&range)),
            ("log", scale.is_log.into()),
            ("colours", objects(colours.into_iter())),
            ("ticks", objects(ticks.into_iter())),
            ("labels", objects(labels)),
            ("apart", (*apart).into()),
        ]))
    }

    /// What is at a point of the model, in the current mesh; nothing outside of it.
    pub fn reading(&mut self, x: f64, y: f64, z: f64) -> Result<Option<JsReading>, WebError> {
        self.reading_at([x, y, z])
    }

    /// What is shown at a screen point; nothing if nothing is there.
    pub fn pick(&mut self, x: f64, y: f64) -> Result<Option<JsReading>, WebError> {
        let ray = self.camera.ray(DVec2::new(x, y), self.aspect());
        match self.scene.pick(&mut self.file.session, &ray) {
            Some(point) => self.reading_at(point),
            None => Ok(None),
        }
    }

    fn reading_at(&mut self, point: [f64; 3]) -> Result<Option<JsReading>, WebError> {
        let session = &mut self.file.session;
        let Some(reading) = session.reading(point)? else { return Ok(None) };
        let fields = &session.info().ok_or_else(WebError::not_ready)?.fields;
        let now = fields[session.field()].time;
        let by_name: JsValue = object(&[]);
        let own = reading.region.and_then(|number| session.regions()?.all.get(usize::from(number)));
        let name = own.map(|region| region.name.as_str());
        // Of the time steps of a field that which is shown counts, or the first.
        let all = || fields.iter().zip(&reading.values).rev();
        for (field, value) in all().chain(all().filter(|(field, _)| field.time == now)) {
            set(&by_name, &field.name, &(*value).into());
        }
        Ok(Some(object(&[
            ("position", list(&reading.position)),
            ("values", by_name),
            ("all", list(&reading.values)),
            ("tet", reading.tet.into()),
            ("region", name.map_or(JsValue::UNDEFINED, |name| name.into())),
            ("size", reading.size.into()),
            ("error", reading.error.into()),
        ])))
    }

    /// The box that has handles.
    fn region(&self) -> Option<Bounds> {
        let [x0, y0, z0, x1, y1, z1] = self.scene.state().region?;
        Some(Bounds { min: [x0, y0, z0], max: [x1, y1, z1] })
    }

    pub(crate) fn aspect(&self) -> f64 {
        self.scene.renderer().aspect()
    }

    /// The handle of the region at a screen point: 0 to 5 for lower and upper x, y, z; −1 if none is.
    #[wasm_bindgen(js_name = pickRegion)]
    pub fn pick_region(&self, x: f64, y: f64) -> i32 {
        let Some(region) = &self.region() else { return -1 };
        let reach = 2.0 * REACH * self.ratio / f64::from(self.scene.renderer().size()[1]);
        let face = gizmo::pick(region, &self.camera, DVec2::new(x, y), self.aspect(), reach);
        face.and_then(|face| BoxFace::ALL.iter().position(|other| *other == face)).map_or(-1, |i| i as i32)
    }

    /// Moves the face of `handle` under a screen point; gives the box as it is then.
    #[wasm_bindgen(js_name = dragRegion)]
    pub fn drag_region(&mut self, handle: usize, x: f64, y: f64) -> Result<Box<[f64]>, WebError> {
        let (Some(region), Some(limits)) = (self.region(), self.scene.bounds().copied()) else {
            return Err(WebError::not_ready());
        };
        let face = BoxFace::ALL.get(handle);
        let face = face.ok_or_else(|| WebError::bad_option("handle", "must be 0 to 5"))?;
        let ray = self.camera.ray(DVec2::new(x, y), self.aspect());
        let moved = gizmo::drag(&region, *face, &ray, &limits);
        let numbers = flat(&moved);
        let region = numbers.as_ref().try_into().ok();
        self.scene.set_state(SceneState { region, ..self.scene.state().clone() })?;
        self.is_stale = true;
        Ok(numbers)
    }

    /// Turns around the model, in radians: the model follows to the right and upwards.
    pub fn orbit(&mut self, right: f64, up: f64) {
        self.camera.orbit(-right, -up);
        self.is_stale = true;
    }

    /// Multiplies the distance to the model; what is at a screen point stays there.
    pub fn zoom(&mut self, factor: f64, x: f64, y: f64) {
        self.camera.zoom_at(factor, DVec2::new(x, y), self.aspect());
        self.is_stale = true;
    }

    /// Moves what is seen by fractions of the canvas's height to the right and upwards.
    pub fn pan(&mut self, right: f64, up: f64) {
        self.camera.pan(right, up);
        self.is_stale = true;
    }

    /// Shows the whole model from the front.
    pub fn home(&mut self) {
        let bounds = self.shown_bounds().unwrap_or(Bounds::EMPTY);
        let projection = self.camera.projection();
        self.camera = Camera::home(&bounds, self.aspect());
        self.camera.set_projection(projection);
        self.is_stale = true;
    }

    /// Looks at the whole model from a side: `"home"`, or along an axis, such as `"alongX"` or `"againstZ"`.
    #[wasm_bindgen(js_name = lookFrom)]
    pub fn look_from(&mut self, side: &str) -> Result<(), WebError> {
        let found = SIDES.iter().find(|(name, _)| *name == side);
        let Some((_, preset)) = found else {
            let names = SIDES.map(|(name, _)| name).join(", ");
            return Err(WebError::bad_option("side", &format!("must be one of {names}; given: {side}")));
        };
        self.home();
        let bounds = self.shown_bounds().unwrap_or(Bounds::EMPTY);
        self.camera.turn_to(*preset);
        self.camera.fit(&bounds, self.aspect());
        Ok(())
    }

    /// Moves the eye to the right, up and ahead, by multiples of its distance to the model.
    pub fn fly(&mut self, right: f64, up: f64, ahead: f64) {
        self.camera.fly(right, up, ahead);
        self.is_stale = true;
    }

    /// Turns the eye where it is, in radians.
    pub fn look(&mut self, right: f64, up: f64) {
        self.camera.look(right, up);
        self.is_stale = true;
    }

    /// Gives the canvas another size in pixels; `ratio` is pixels per unit of the page's layout.
    pub fn resize(&mut self, width: u32, height: u32, ratio: f32) {
        self.scene.renderer_mut().resize([width, height]);
        self.scene.set_pixel_ratio(ratio);
        self.ratio = f64::from(ratio);
        self.is_stale = true;
    }

    /// Draws the next pictures with this part of their pixels in each direction, and stretches them.
    #[wasm_bindgen(js_name = setScale)]
    pub fn set_scale(&mut self, scale: f64) {
        self.scene.renderer_mut().set_scale(scale);
        self.is_stale |= self.scene.renderer().drawn() == 0;
    }

    /// Draws the next pictures quickly, or as well as it can.
    #[wasm_bindgen(js_name = setQuick)]
    pub fn set_quick(&mut self, is_quick: bool) {
        self.scene.renderer_mut().set_quick(is_quick);
        self.is_stale |= self.scene.renderer().drawn() == 0;
    }

    /// Pictures that the GPU has not finished.
    #[wasm_bindgen(getter, js_name = inFlight)]
    pub fn in_flight(&self) -> Result<u32, WebError> {
        Ok(self.scene.renderer().in_flight()?)
    }

    /// Triangles of all surfaces in the last frame.
    #[wasm_bindgen(getter)]
    pub fn triangles(&self) -> usize {
        self.scene.triangles()
    }

    /// Bytes that were uploaded to the GPU since the last question.
    #[wasm_bindgen(js_name = takeUploaded)]
    pub fn take_uploaded(&mut self) -> f64 {
        self.scene.renderer_mut().take_uploaded() as f64
    }

    /// Bytes of memory on the GPU that pictures are made of and in.
    #[wasm_bindgen(getter, js_name = gpuBytes)]
    pub fn gpu_bytes(&self) -> f64 {
        self.scene.renderer().memory() as f64
    }

    /// Whether the picture is out of date.
    #[wasm_bindgen(getter)]
    pub fn pending(&self) -> bool {
        self.is_stale
    }

    /// Whether the picture gets better by [`Viewer::improve`].
    #[wasm_bindgen(getter, js_name = canImprove)]
    pub fn can_improve(&self) -> bool {
        let drawn = self.scene.renderer().drawn();
        !self.is_stale && 0 < drawn && drawn < SAMPLES
    }

    /// Draws if anything has changed since the last frame; says whether it has drawn.
    pub fn frame(&mut self) -> Result<bool, WebError> {
        // What the last picture had no room for is known some time after it.
        self.is_stale |= self.scene.renderer_mut().is_short();
        // A device that is behind gets no more to do: the camera would be late.
        if !self.is_stale || self.scene.renderer().in_flight()? > 1 {
            return Ok(false);
        }
        // What cannot be shown is told once, and all else is drawn.
        let updated = self.scene.update(&mut self.file.session);
        let drawn = self.scene.draw(&mut self.file.session, &self.camera)?;
        self.is_stale = !drawn;
        updated?;
        Ok(drawn)
    }

    /// Adds one more picture to the mean of those that show what the last one does: edges get smooth.
    pub fn improve(&mut self) -> Result<bool, WebError> {
        Ok(self.scene.renderer().in_flight()? == 0 && self.scene.draw_again()?)
    }

    /// What the camera sees.
    pub(crate) fn view(&self) -> View {
        let matrix = self.camera.view_projection(self.aspect()).to_cols_array();
        View { matrix, viewport: self.scene.renderer().size().map(f64::from) }
    }

    /// Gives the needs that follow the camera its view.
    fn follow_camera(&mut self) -> Result<(), WebError> {
        let seen = self.view();
        if self.file.asked.follows.is_empty() || seen == self.seen {
            return Ok(());
        }
        self.seen = seen;
        for need in self.file.asked.follows.clone() {
            self.file.asked.request.needs[need].part = Part::View(seen);
        }
        self.file.request_again()
    }

    /// Bytes have come: when the base mesh is there, look at it. Nothing is drawn yet: the worker takes from the scene what does not
    /// fit the volume.
    fn arrive(&mut self) {
        if self.scene.meet(&mut self.file.session) {
            self.is_stale = true;
            self.home();
        }
    }
}

mesh_tools!(Viewer);

/// The sides that the model is looked at from.
const SIDES: [(&str, ViewPreset); 7] = [
    ("home", ViewPreset::Home),
    ("alongX", ViewPreset::AlongX),
    ("againstX", ViewPreset::AgainstX),
    ("alongY", ViewPreset::AlongY),
    ("againstY", ViewPreset::AgainstY),
    ("alongZ", ViewPreset::AlongZ),
    ("againstZ", ViewPreset::AgainstZ),
];

fn flat(bounds: &Bounds) -> Box<[f64]> {
    bounds.min.into_iter().chain(bounds.max).collect()
}
