//! The class that the viewer's worker holds: a session, a renderer on a canvas, and what the user has set.
//!
//! Nothing is computed before it is drawn: setters only note what is out of date, [`Viewer::frame`] brings it up to
//! date and draws if anything has changed. The mesh follows what is asked for in short steps between the frames
//! ([`Viewer::step`]), so that the camera never waits for it. Screen points are given in normalised coordinates, as in
//! [`Camera`](crate::geom::Camera).

use super::error::WebError;
use super::file::File;
use super::loader::RangeLoader;
use super::options::{self, RefineOptions};
use super::results::{self, JsBlocks, JsInfo, JsProgress, JsStats};
use crate::geom::{Bounds, Camera};
use crate::gpu::{BoxLines, Look, Renderer, Show};
use crate::refine::{Part, View};
use crate::view::gizmo::{self, BoxFace};
use crate::view::{ClipPlane, Cutaway};
use glam::DVec2;
use wasm_bindgen::prelude::wasm_bindgen;

/// How close to a handle the pointer must be, in units of the page's layout.
const REACH: f64 = 18.0;

const DOMAIN_COLOUR: [f32; 4] = [0.85, 0.9, 1.0, 0.35];
const ROI_COLOUR: [f32; 4] = [0.36, 0.86, 1.0, 1.0];

/// An MT and its picture on a canvas.
#[wasm_bindgen]
pub struct Viewer {
    file: File,
    /// What takes the place of `file` when its first bytes are here.
    next: Option<File>,
    renderer: Renderer,
    look: Look,
    camera: Camera,
    show: Show,
    /// The view that the needs which follow the camera have now.
    seen: View,
    /// Whether the mesh is not yet the one that was asked for.
    moving: bool,
    isovalue: Option<f64>,
    clip: ClipPlane,
    cutaway: Cutaway,
    /// The box around the base mesh, once it is there.
    bounds: Option<Bounds>,
    roi: Option<Bounds>,
    stale: Stale,
    /// Triangles of the isosurface that the renderer has.
    surface_triangles: usize,
    /// Whether the renderer has all of that surface, so that changes of it are enough.
    surface_fits: bool,
}

/// What the next frame must bring up to date.
#[derive(Clone, Copy, Default)]
struct Stale {
    surface: bool,
    cutaway: bool,
    boxes: bool,
    picture: bool,
}

impl Stale {
    const MESH: Self = Self { surface: true, cutaway: true, boxes: false, picture: true };
}

#[wasm_bindgen]
impl Viewer {
    /// Opens the GPU for `canvas`, which must not have a context yet.
    pub async fn create(
        canvas: web_sys::OffscreenCanvas,
        width: u32,
        height: u32,
        ratio: f32,
    ) -> Result<Viewer, WebError> {
        let target = wgpu::SurfaceTarget::OffscreenCanvas(canvas);
        let renderer = Renderer::on_surface(target, [width, height]).await?;
        let camera = Camera::home(&Bounds::EMPTY, renderer.aspect());
        Ok(Self {
            file: File::default(),
            next: None,
            look: Look { pixel_ratio: ratio, ..Look::default() },
            camera,
            show: Show::default(),
            seen: View { matrix: [0.0; 16], viewport: [1.0; 2] },
            moving: false,
            isovalue: None,
            clip: ClipPlane::NOTHING,
            cutaway: Cutaway::new(),
            bounds: None,
            roi: None,
            stale: Stale { picture: true, ..Stale::default() },
            surface_triangles: 0,
            surface_fits: false,
            renderer,
        })
    }

    /// The GPU in words.
    pub fn adapter(&self) -> String {
        self.renderer.description()
    }

    /// Sixteen evenly spaced colours of the colour map, `RGBA` bytes, for a legend.
    pub fn palette(&self) -> Vec<u8> {
        self.look.colormap.table::<16>().concat()
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
        (self.bounds, self.roi, self.isovalue) = (None, None, None);
        self.moving = false;
        self.clip = ClipPlane::NOTHING;
        self.cutaway = Cutaway::new();
        (self.surface_triangles, self.surface_fits) = (0, false);
        self.renderer.set_surface(&crate::view::IsoSurface::new())?;
        self.renderer.set_cutaway(&self.cutaway)?;
        self.stale = Stale { boxes: true, picture: true, ..Stale::default() };
        Ok(())
    }

    /// Takes the next bytes of the file, however they were cut.
    pub fn feed(&mut self, bytes: &[u8]) -> Result<JsProgress, WebError> {
        self.file.session_mut().feed(bytes)?;
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
        if matches!(supplied, Ok(false)) {
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

    /// The file has ended: refuses one that was cut short.
    pub fn finish(&mut self) -> Result<JsProgress, WebError> {
        self.file.session_mut().finish()?;
        Ok(self.progress())
    }

    /// What is known of the MT; `undefined` until the base mesh is there.
    pub fn info(&self) -> Option<JsInfo> {
        self.file.session().info().map(results::info)
    }

    /// The box around the mesh: `[x0, y0, z0, x1, y1, z1]`; empty until the base mesh is there.
    pub fn bounds(&self) -> Box<[f64]> {
        self.bounds.map_or_else(Box::default, |bounds| flat(&bounds))
    }

    /// Sets the request, for `step` to make its mesh. Views without a matrix follow the camera.
    pub fn request(&mut self, options: &RefineOptions) -> Result<(), WebError> {
        let (seen, before) = (self.view(), self.file.asked.field);
        self.file.request(options, Some(&seen))?;
        if self.file.asked.field != before {
            self.stale = Stale { boxes: self.stale.boxes, ..Stale::MESH };
        }
        (self.seen, self.moving) = (seen, true);
        self.set_range();
        Ok(())
    }

    /// More of the file has come, and with it perhaps what was asked for.
    #[wasm_bindgen(js_name = requestAgain)]
    pub fn request_again(&mut self) {
        self.moving = self.file.session().info().is_some();
    }

    /// Whether `step` has something to do.
    #[wasm_bindgen(getter)]
    pub fn moving(&self) -> bool {
        self.moving || !self.file.asked.follows.is_empty() && self.view() != self.seen
    }

    /// Goes on towards the mesh that is wanted for about so many milliseconds.
    pub fn step(&mut self, milliseconds: f64) -> Result<JsStats, WebError> {
        // What fails would fail again: it is not tried before something else is asked for.
        self.moving = false;
        self.follow_camera()?;
        let stats = self.file.step(milliseconds, f64::INFINITY)?;
        self.moving = !stats.done;
        if stats.refined + stats.coarsened > 0 {
            self.stale = Stale { boxes: self.stale.boxes, ..Stale::MESH };
        }
        self.file.stats(&stats)
    }

    /// A hash of the current mesh, the same wherever the same request was made.
    pub fn hash(&self) -> String {
        self.file.hash()
    }

    /// Chooses what is drawn: `"iso"` or `"cutaway"`.
    #[wasm_bindgen(js_name = setMode)]
    pub fn set_mode(&mut self, mode: &str) -> Result<(), WebError> {
        self.show = match mode {
            "iso" => Show::Surface,
            "cutaway" => Show::Cutaway,
            _ => return Err(WebError::bad_option("mode", "must be \"iso\" or \"cutaway\"")),
        };
        self.stale.picture = true;
        Ok(())
    }

    /// The value of the isosurface, in field units; until it is set, the middle of the field's range.
    #[wasm_bindgen(js_name = setIsovalue)]
    pub fn set_isovalue(&mut self, value: f64) -> Result<(), WebError> {
        if !value.is_finite() {
            return Err(WebError::bad_option("isovalue", "must be a finite number"));
        }
        self.isovalue = Some(value);
        self.stale.surface = true;
        self.stale.picture = true;
        Ok(())
    }

    /// Cuts away the tetrahedra with `normal · p > offset`; a normal of zeros cuts nothing away.
    #[wasm_bindgen(js_name = setClip)]
    pub fn set_clip(&mut self, x: f64, y: f64, z: f64, offset: f64) -> Result<(), WebError> {
        if ![x, y, z, offset].iter().all(|number| number.is_finite()) {
            return Err(WebError::bad_option("clip", "must be four finite numbers"));
        }
        let normal = [x, y, z].map(|number| number as f32);
        self.clip =
            if normal == [0.0; 3] { ClipPlane::NOTHING } else { ClipPlane { normal, offset: offset as f32 } };
        self.stale.cutaway = true;
        self.stale.picture = true;
        Ok(())
    }

    /// Shows the box of a region of interest, `[x0, y0, z0, x1, y1, z1]`, with handles; none hides it.
    #[wasm_bindgen(js_name = setRoi)]
    pub fn set_roi(&mut self, numbers: Option<Box<[f64]>>) -> Result<(), WebError> {
        self.roi = numbers.map(|numbers| options::bounds(&numbers)).transpose()?;
        self.stale.boxes = true;
        self.stale.picture = true;
        Ok(())
    }

    /// The handle of the region of interest at a screen point: 0 to 5 for lower and upper x, y, z; −1 if none is.
    #[wasm_bindgen(js_name = pickRoi)]
    pub fn pick_roi(&self, x: f64, y: f64) -> i32 {
        let Some(roi) = &self.roi else { return -1 };
        let reach = 2.0 * REACH * f64::from(self.look.pixel_ratio) / f64::from(self.renderer.size()[1]);
        let face = gizmo::pick(roi, &self.camera, DVec2::new(x, y), self.renderer.aspect(), reach);
        face.and_then(|face| BoxFace::ALL.iter().position(|other| *other == face)).map_or(-1, |i| i as i32)
    }

    /// Moves the face of `handle` under a screen point; gives the box as it is then.
    #[wasm_bindgen(js_name = dragRoi)]
    pub fn drag_roi(&mut self, handle: usize, x: f64, y: f64) -> Result<Box<[f64]>, WebError> {
        let (Some(roi), Some(limits)) = (self.roi, self.bounds) else { return Err(WebError::not_ready()) };
        let face = BoxFace::ALL.get(handle);
        let face = face.ok_or_else(|| WebError::bad_option("handle", "must be 0 to 5"))?;
        let ray = self.camera.ray(DVec2::new(x, y), self.renderer.aspect());
        let moved = gizmo::drag(&roi, *face, &ray, &limits);
        self.roi = Some(moved);
        self.stale.boxes = true;
        self.stale.picture = true;
        Ok(flat(&moved))
    }

    /// Turns around the model, in radians: the model follows to the right and upwards.
    pub fn orbit(&mut self, right: f64, up: f64) {
        self.camera.orbit(-right, -up);
        self.stale.picture = true;
    }

    /// Multiplies the distance to the model.
    pub fn zoom(&mut self, factor: f64) {
        self.camera.zoom(factor);
        self.stale.picture = true;
    }

    /// Moves what is seen by fractions of the canvas's height to the right and upwards.
    pub fn pan(&mut self, right: f64, up: f64) {
        self.camera.pan(right, up);
        self.stale.picture = true;
    }

    /// Shows the whole model from the front.
    pub fn home(&mut self) {
        self.camera = Camera::home(self.bounds.as_ref().unwrap_or(&Bounds::EMPTY), self.renderer.aspect());
        self.stale.picture = true;
    }

    /// Gives the canvas another size in pixels; `ratio` is pixels per unit of the page's layout.
    pub fn resize(&mut self, width: u32, height: u32, ratio: f32) {
        self.renderer.resize([width, height]);
        self.look.pixel_ratio = if ratio.is_finite() { ratio.clamp(0.25, 8.0) } else { 1.0 };
        self.stale.picture = true;
    }

    /// Triangles of the isosurface or the cut-away view in the last frame.
    #[wasm_bindgen(getter)]
    pub fn triangles(&self) -> usize {
        match self.show {
            Show::Surface => self.surface_triangles,
            Show::Cutaway => self.cutaway.triangles(),
            Show::Volume => 0,
        }
    }

    /// Whether the picture is out of date.
    #[wasm_bindgen(getter)]
    pub fn pending(&self) -> bool {
        self.stale.picture
    }

    /// Draws if anything has changed since the last frame; says whether it has drawn.
    pub fn frame(&mut self) -> Result<bool, WebError> {
        if !self.stale.picture {
            return Ok(false);
        }
        self.update()?;
        let drawn = self.renderer.draw(self.show, &self.camera, &self.look)?;
        self.stale.picture = !drawn;
        Ok(drawn)
    }

    /// Computes and uploads what is out of date and will be seen.
    fn update(&mut self) -> Result<(), WebError> {
        if self.stale.boxes {
            self.renderer.set_boxes(&self.boxes())?;
            self.stale.boxes = false;
        }
        if self.bounds.is_none() {
            return Ok(());
        }
        match self.show {
            Show::Surface if self.stale.surface => {
                let [low, high] = self.look.range;
                let middle = f64::midpoint(f64::from(low), f64::from(high));
                let value = self.isovalue.unwrap_or(middle);
                self.file.session_mut().isosurface(value)?;
                let changes = self.file.session_mut().take_surface_changes();
                // Asked for again, it is as it was.
                let surface = self.file.session_mut().isosurface(value)?;
                self.surface_triangles = surface.indices.len();
                // What did not fit was written in part, and is written as a whole when it fits again.
                if std::mem::replace(&mut self.surface_fits, false) {
                    self.renderer.update_surface(surface, &changes.vertices, &changes.triangles)?;
                } else {
                    self.renderer.set_surface(surface)?;
                }
                self.surface_fits = true;
                self.stale.surface = false;
            }
            Show::Cutaway if self.stale.cutaway => {
                self.cutaway.cut(&self.file.session_mut().view(), &self.clip);
                self.renderer.set_cutaway(&self.cutaway)?;
                self.stale.cutaway = false;
            }
            _ => {}
        }
        Ok(())
    }

    /// What the camera sees.
    fn view(&self) -> View {
        let matrix = self.camera.view_projection(self.renderer.aspect()).to_cols_array().map(f64::from);
        View { matrix, viewport: self.renderer.size().map(f64::from) }
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

    /// Bytes have come: when the base mesh is there, look at it.
    fn arrive(&mut self) {
        if self.bounds.is_some() || self.file.session().info().is_none() {
            return;
        }
        let positions = self.file.session_mut().view().positions;
        let bounds = positions.iter().fold(Bounds::EMPTY, |b, p| b.with(p.map(f64::from)));
        self.bounds = Some(bounds);
        self.set_range();
        self.home();
        self.stale = Stale { boxes: true, ..Stale::MESH };
    }

    fn set_range(&mut self) {
        if let Some(field) =
            self.file.session().info().and_then(|info| info.fields.get(self.file.asked.field))
        {
            self.look.range = [field.min as f32, field.max as f32];
        }
    }

    fn boxes(&self) -> Vec<BoxLines> {
        let domain =
            self.bounds.map(|bounds| BoxLines { bounds, colour: DOMAIN_COLOUR, width: 1.0, handles: false });
        let roi = self.roi.map(|bounds| BoxLines { bounds, colour: ROI_COLOUR, width: 2.0, handles: true });
        domain.into_iter().chain(roi).collect()
    }
}

fn flat(bounds: &Bounds) -> Box<[f64]> {
    bounds.min.into_iter().chain(bounds.max).collect()
}
