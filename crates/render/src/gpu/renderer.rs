//! The whole picture: background, mesh, surfaces, boxes.

use crate::draw::{BoxLines, CellStyle, Look, Style};
use crate::gpu::cells::CellPass;
use crate::gpu::composite::Composite;
use crate::gpu::error::Result;
use crate::gpu::fragments::FragmentLists;
use crate::gpu::mesh::MeshBuffers;
use crate::gpu::pipeline::{Common, Output, Pipeline};
use crate::gpu::present::{PictureView, Presenter};
use crate::gpu::shade::ShadePass;
use crate::gpu::surface::{Surface, SurfacePipelines};
use crate::gpu::target::{Picture, Target};
use crate::gpu::types::Frame;
use crate::gpu::wire::WirePass;
use crate::gpu::{Context, GpuError, SAMPLES};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use tetralod::geom::{Camera, SinglePoints, SingleValues};
use tetralod::view::{Medium, MeshView, Place, SurfaceChanges, Triangles};

/// Draws pictures of a mesh on a canvas, into an image, or into the views of another program.
///
/// What is drawn is what has been set: [surfaces](Renderer::set_surface), the [volume](Renderer::set_volume), the
/// [tetrahedra](Renderer::set_cells), [boxes](Renderer::set_boxes). Volume and tetrahedra are those of
/// [`Renderer::update_mesh`].
///
/// What it gets is absolute, in double precision. On the GPU numbers have single precision: [`Renderer::set_points`] and [`Renderer::set_values`] say what they are relative
/// to, so that models far from their origin, and fields of a narrow range, are drawn as exactly as others.
#[derive(Debug)]
pub struct Renderer {
    pub(super) context: Context,
    pub(super) target: Target,
    common: Common,
    background: Pipeline,
    surface_pipelines: SurfacePipelines,
    surfaces: BTreeMap<u32, Surface>,
    mesh: MeshBuffers,
    /// How points and values are stored on the GPU.
    points: SinglePoints,
    values: SingleValues,
    /// Made when tetrahedra are drawn first.
    cells: Option<CellPass>,
    shows_cells: bool,
    pub(super) lists: FragmentLists,
    composite: Composite,
    /// Made when shade is drawn first.
    shade: Option<ShadePass>,
    wire: WirePass,
    presenter: Presenter,
    pub(super) is_quick: bool,
    /// Pictures that the device has not finished.
    in_flight: Arc<AtomicU32>,
    /// What the last picture showed, and of how many it is the mean.
    pub(super) last: Option<(Camera, Look, u32)>,
    /// What draws the left part of pictures, and how wide that is, as a fraction.
    beside: Option<Box<Renderer>>,
    split: f64,
}

impl Renderer {
    /// Draws into an image of this many pixels; see [`Renderer::picture`].
    ///
    /// # Errors
    /// If there is no adapter or it cannot be opened.
    pub async fn headless(size: [u32; 2]) -> Result<Self> {
        let context = Context::headless().await?;
        let target = Target::image(&context, size);
        Self::new(context, target)
    }

    /// Draws on `target`, such as a canvas, with this many pixels.
    ///
    /// # Errors
    /// If there is no adapter, it cannot be opened, or the canvas cannot be drawn to.
    pub async fn on_surface(target: impl Into<wgpu::SurfaceTarget<'static>>, size: [u32; 2]) -> Result<Self> {
        let (context, surface) = Context::with_surface(target).await?;
        let target = Target::canvas(&context, surface, size)?;
        Self::new(context, target)
    }

    /// Draws with a device of another program into the views that [`Renderer::render`] gets, of this many pixels and this format
    /// (8 bits a channel, without sRGB encoding by the device).
    ///
    /// # Errors
    /// If the device refuses what the renderer takes.
    pub fn with_device(context: Context, size: [u32; 2], format: wgpu::TextureFormat) -> Result<Self> {
        let target = Target::given(&context, size, format);
        Self::new(context, target)
    }

    fn new(context: Context, target: Target) -> Result<Self> {
        let common = Common::new(&context, target.format);
        let over = Output::Over(wgpu::CompareFunction::Always);
        let lists = FragmentLists::new(&context);
        let renderer = Self {
            background: Pipeline::new("background", ["vs", "fs"], &[], over),
            surface_pipelines: SurfacePipelines::new(&context, &lists.layout),
            surfaces: BTreeMap::new(),
            mesh: MeshBuffers::new(),
            points: SinglePoints::PLAIN,
            values: SingleValues::PLAIN,
            cells: None,
            shows_cells: false,
            composite: Composite::new(&context, &lists.layout),
            wire: WirePass::new(&context, &lists.layout),
            lists,
            shade: None,
            presenter: Presenter::new(&context, &common),
            is_quick: false,
            in_flight: Arc::default(),
            last: None,
            beside: None,
            split: 0.0,
            context,
            target,
            common,
        };
        renderer.context.check()?;
        Ok(renderer)
    }

    /// Another renderer on the same device, with things of its own: the left part of pictures is its, as wide as
    /// [`Renderer::set_split`] says. Size, scale, camera and look are those of this one.
    ///
    /// # Errors
    /// If the device refuses what it takes.
    pub fn beside(&mut self) -> Result<&mut Self> {
        if self.beside.is_none() {
            let other = Self::with_device(self.context.clone(), self.target.size, self.target.format)?;
            self.beside = Some(Box::new(other));
        }
        self.beside.as_deref_mut().ok_or_else(|| GpuError::Refused("it was just made".to_owned()))
    }

    /// How wide the left part is that [`Renderer::beside`] draws, as a fraction of the width, 0 to 1; at 0 that renderer and
    /// all of its things are freed.
    pub fn set_split(&mut self, split: f64) {
        self.split = if split.is_finite() { split.clamp(0.0, 1.0) } else { 0.0 };
        if self.split == 0.0 {
            self.beside = None;
        }
    }

    /// The GPU and its driver in words.
    pub fn description(&self) -> String {
        self.context.description()
    }

    /// Whether the processor draws, and no GPU.
    pub fn is_software(&self) -> bool {
        self.context.is_software()
    }

    /// Width and height of the target in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.target.size
    }

    /// Width divided by height.
    pub fn aspect(&self) -> f64 {
        f64::from(self.target.size[0]) / f64::from(self.target.size[1])
    }

    /// Gives the target another size, held to at least one pixel and at most what the device can draw.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.target.resize(&self.context, size);
        self.last = None;
    }

    /// Draws the next pictures with fewer pixels, and stretches them: `scale` of each direction, 0.1 to 1. Makes a slow device
    /// answer sooner. A new size of the target sets it back to 1.
    pub fn set_scale(&mut self, scale: f64) {
        let before = self.target.drawn_size;
        self.target.scale(&self.context, if scale.is_finite() { scale.clamp(0.1, 1.0) } else { 1.0 });
        if self.target.drawn_size != before {
            self.last = None;
        }
    }

    /// Draws the next pictures quickly, or as well as it can: quick ones have no shade in hollows, and where all is opaque one sample
    /// a pixel. They are no part of a mean.
    pub fn set_quick(&mut self, is_quick: bool) {
        if is_quick != self.is_quick {
            self.is_quick = is_quick;
            self.last = None;
        }
    }

    /// How all points are stored on the GPU; as they are, if it is not said. Whether that is another way than before: then everything that was
    /// set is gone, and must be set again.
    pub fn set_points(&mut self, points: SinglePoints) -> bool {
        let is_other = points != self.points;
        if is_other {
            self.points = points;
            self.surfaces.clear();
            self.store_mesh_anew();
        }
        is_other
    }

    /// How the values of the mesh are stored on the GPU, as [`Renderer::set_points`] for mesh and volume. Surfaces say themselves how theirs
    /// are.
    pub fn set_values(&mut self, values: SingleValues) -> bool {
        let is_other = values != self.values;
        if is_other {
            self.values = values;
            self.store_mesh_anew();
        }
        is_other
    }

    fn store_mesh_anew(&mut self) {
        self.mesh.set_stored(self.points, self.values);
        if let Some(cells) = &mut self.cells {
            cells.set_stored(&self.context, self.points, self.values);
        }
    }

    /// Makes surface number `key` these triangles. If `changes` are given, only those differ from the ones that it has, and what
    /// lies beyond the ends of their arrays; what is uploaded is that, so the cost goes with what has changed.
    ///
    /// A surface has no look before [`Renderer::set_style`] but the default one.
    ///
    /// # Errors
    /// If it is too large for the device; then it is not drawn, and all of it must come next.
    pub fn set_surface(
        &mut self,
        key: u32,
        triangles: &Triangles<'_>,
        changes: Option<&SurfaceChanges>,
    ) -> Result<()> {
        let context = &self.context;
        let surface = self.surfaces.entry(key).or_insert_with(|| {
            let mut surface = Surface::new(context);
            surface.set_style(context, &Style::default());
            surface
        });
        surface.update(context, &self.surface_pipelines, triangles, changes, &self.points)
    }

    /// How surface number `key` looks; does nothing if there is none.
    pub fn set_style(&mut self, key: u32, style: &Style) {
        if let Some(surface) = self.surfaces.get_mut(&key) {
            surface.set_style(&self.context, style);
        }
    }

    /// Removes surface number `key`, and frees its memory.
    pub fn remove_surface(&mut self, key: u32) {
        self.surfaces.remove(&key);
    }

    /// Draws nothing any more but the boxes.
    ///
    /// # Errors
    /// If the device refuses it.
    pub fn clear(&mut self) -> Result<()> {
        self.set_split(0.0);
        self.surfaces.clear();
        self.set_cells(None);
        self.set_volume(None)
    }

    /// Triangles of all surfaces.
    pub fn triangles(&self) -> usize {
        self.surfaces.values().map(Surface::triangles).sum()
    }

    /// Draws the mesh as a volume of this medium, cut by the clip planes whose bit is set; none hides it. The mesh comes by
    /// [`Renderer::update_mesh`].
    ///
    /// # Errors
    /// If the device refuses it.
    pub fn set_volume(&mut self, medium: Option<(&Medium, u32)>) -> Result<()> {
        let stored = medium.map(|(medium, clips)| (medium.relative_to(&self.points, &self.values), clips));
        self.composite.set_medium(&self.context, stored.as_ref().map(|(medium, clips)| (medium, *clips)))?;
        self.mesh.linked.set_needed(medium.is_some());
        Ok(())
    }

    /// Draws the tetrahedra of the mesh in this style; none hides them. The mesh comes by [`Renderer::update_mesh`].
    pub fn set_cells(&mut self, style: Option<&CellStyle>) {
        self.shows_cells = style.is_some();
        self.mesh.corners.set_needed(style.is_some());
        if let Some(style) = style {
            let (cells, context) = self.cells_mut();
            cells.set_style(context, style);
        }
    }

    /// Gives each tetrahedron a value, for styles that colour by it. They are not drawn while the mesh has another number of
    /// tetrahedra.
    ///
    /// # Errors
    /// If they are too many for the device.
    pub fn set_cell_values(&mut self, values: &[f64]) -> Result<()> {
        let (cells, context) = self.cells_mut();
        cells.set_values(context, values)
    }

    fn cells_mut(&mut self) -> (&mut CellPass, &Context) {
        let context = &self.context;
        let cells = self.cells.get_or_insert_with(|| {
            let mut cells = CellPass::new(context);
            cells.set_stored(context, self.points, self.values);
            cells
        });
        (cells, context)
    }

    /// Whether volume or tetrahedra are to be drawn and have no mesh: [`Renderer::update_mesh`] must be called.
    pub fn wants_mesh(&self) -> bool {
        let are_cells_behind = self.shows_cells && self.cells.as_ref().is_some_and(CellPass::is_behind);
        self.mesh.is_behind() || are_cells_behind
    }

    /// Brings the mesh of volume and tetrahedra up to date. `changes` are ranges of points and of tetrahedra that have changed since
    /// the last call; without them all is replaced. Nothing is uploaded if nothing needs it. If the eye may be in the mesh, call
    /// [`Renderer::set_eye`] for each picture.
    ///
    /// # Errors
    /// If it is too large for the device; then none is drawn.
    pub fn update_mesh(&mut self, mesh: &MeshView<'_>, changes: Option<[&[Range<u32>]; 2]>) -> Result<()> {
        self.composite.set_eye(mesh, (&self.points, &self.values), None);
        let is_same = changes.is_some_and(|[points, tets]| points.is_empty() && tets.is_empty());
        if let Some(cells) =
            self.cells.as_mut().filter(|cells| self.shows_cells && (cells.is_behind() || !is_same))
        {
            cells.update(&self.context, mesh)?;
        }
        self.mesh.update(&self.context, mesh, changes)
    }

    /// Where the points of that mesh go, times [`Look::moved`], so many as it has; they stay if there are none. It comes after
    /// [`Renderer::update_mesh`], each time.
    ///
    /// # Errors
    /// If they are too many for the device.
    pub fn set_moves(&mut self, moves: &[[f64; 3]]) -> Result<()> {
        self.mesh.set_moves(&self.context, moves)
    }

    /// Where the eye of the next pictures is in the mesh, as [`Probe::locate`](tetralod::view::Probe::locate) gives it; none outside.
    pub fn set_eye(&mut self, mesh: &MeshView<'_>, place: Option<&Place>) {
        self.composite.set_eye(mesh, (&self.points, &self.values), place);
    }

    /// Replaces the boxes.
    ///
    /// # Errors
    /// If they are too many for the device.
    pub fn set_boxes(&mut self, boxes: &[BoxLines]) -> Result<()> {
        self.wire.update(&self.context, boxes, &self.points)
    }

    /// Whether the device is well: it calls back at times of its own choice, so this is known between pictures, too.
    ///
    /// # Errors
    /// If it is lost, or has refused something since the last call.
    pub fn check(&self) -> Result<()> {
        self.context.check()
    }

    /// Bytes of meshes and surfaces that were uploaded since the last call.
    pub fn take_uploaded(&self) -> u64 {
        self.context.take_uploaded()
    }

    /// Bytes of memory on the GPU that the mesh takes.
    pub fn mesh_bytes(&self) -> u64 {
        self.mesh.bytes()
    }

    /// Bytes of memory on the GPU that the mesh and the lists of pixels take.
    pub fn gpu_bytes(&self) -> u64 {
        let beside = self.beside.as_ref().map_or(0, |other| other.gpu_bytes());
        let cells = self.cells.as_ref().map_or(0, CellPass::bytes);
        self.mesh.bytes() + cells + self.lists.bytes() + beside
    }

    /// Bytes of memory on the GPU of all that pictures are made of and in: meshes, surfaces, lines, lists of pixels, samples and
    /// depths. The pictures of a canvas itself belong to the browser and do not count, nor do settings of a few bytes.
    pub fn memory(&self) -> u64 {
        let cells = self.cells.as_ref().map_or(0, CellPass::bytes);
        let surfaces: u64 = self.surfaces.values().map(Surface::bytes).sum();
        let drawn = self.mesh.bytes() + cells + surfaces + self.wire.bytes() + self.composite.bytes();
        let shade = self.shade.as_ref().map_or(0, ShadePass::bytes);
        let images = self.target.images.bytes() + self.lists.image_bytes() + shade;
        drawn + self.lists.bytes() + images + self.beside.as_ref().map_or(0, |other| other.memory())
    }

    /// Draws a picture. `false` when the target is not available, such as a hidden canvas.
    ///
    /// # Errors
    /// If the device is lost or refused something, now or since the last picture.
    pub fn draw(&mut self, camera: &Camera, look: &Look) -> Result<bool> {
        self.draw_on(camera, look, 0, None)
    }

    /// Draws the last picture again from places inside of its pixels a little beside their middles, and shows the mean of all
    /// such pictures: edges get smooth. Does what [`Renderer::draw`] does; nothing if there is no picture. Anything that was set
    /// since must be drawn by [`Renderer::draw`] first.
    ///
    /// # Errors
    /// As [`Renderer::draw`].
    pub fn draw_again(&mut self) -> Result<bool> {
        match self.last.take() {
            Some((camera, look, count)) => self.draw_on(&camera, &look, count, None),
            None => Ok(false),
        }
    }

    /// How many pictures the one that is shown is the mean of.
    pub fn drawn(&self) -> u32 {
        self.last.as_ref().map_or(0, |last| last.2)
    }

    /// Draws a picture into a view of a texture, for renderers made by [`Renderer::with_device`]. The texture has the size of
    /// [`Renderer::size`]; call [`Renderer::resize`] when it changes.
    ///
    /// # Errors
    /// As [`Renderer::draw`].
    pub fn render(&mut self, view: &wgpu::TextureView, camera: &Camera, look: &Look) -> Result<()> {
        self.draw_on(camera, look, 0, Some(view)).map(|_| ())
    }

    /// How many pictures the device has not finished. Who draws on a canvas waits until there is at most one, so that the camera is
    /// not behind.
    ///
    /// # Errors
    /// If the device is lost.
    pub fn in_flight(&self) -> Result<u32> {
        // Native devices call back from here, browsers on their own.
        let polled = self.context.device.poll(wgpu::PollType::Poll);
        polled.map_err(|error| GpuError::Refused(error.to_string()))?;
        Ok(self.in_flight.load(Ordering::Relaxed))
    }

    /// Whether the last picture lacked room for all that is not opaque: then it must be drawn again. It is known some time after
    /// the picture.
    pub fn is_short(&mut self) -> bool {
        // Both must be asked: to ask is what makes room.
        let beside = self.beside.as_mut().is_some_and(|other| other.is_short());
        self.lists.is_short(&self.context) | beside
    }

    fn draw_on(
        &mut self,
        camera: &Camera,
        look: &Look,
        count: u32,
        given: Option<&wgpu::TextureView>,
    ) -> Result<bool> {
        self.context.check()?;
        let picture = match given {
            Some(_) => None,
            None => match self.target.next(&self.context)? {
                Some(picture) => Some(picture),
                None => return Ok(false),
            },
        };
        let own = picture.as_ref().map(Picture::view);
        let Some(view) = given.or(own.as_ref()) else { return Ok(false) };
        self.encode(&PictureView { view, part: None }, camera, look, count);
        self.draw_beside(view, camera, look, count);
        if let Some(Picture::Canvas(texture)) = picture {
            self.context.queue.present(texture);
        }
        self.last = (!self.is_quick).then(|| (*camera, look.clone(), count + 1));
        self.context.check()?;
        Ok(true)
    }

    /// Draws the left part.
    fn draw_beside(&mut self, view: &wgpu::TextureView, camera: &Camera, look: &Look, count: u32) {
        let ([width, height], [drawn, _]) = (self.target.size, self.target.drawn_size);
        let part = (self.split * f64::from(width)).round() as u32;
        let Some(other) = &mut self.beside else { return };
        if part == 0 {
            return other.lists.clear();
        }
        other.resize([width, height]);
        other.set_scale(f64::from(drawn) / f64::from(width));
        other.set_quick(self.is_quick);
        other.encode(&PictureView { view, part: Some([0, 0, part, height]) }, camera, look, count);
    }

    /// What makes lines as wide on the target as `look` wants them.
    fn scaled(&self, look: &Look) -> Look {
        let scale = self.target.drawn_size[1] as f32 / self.target.size[1] as f32;
        Look { pixel_ratio: look.pixel_ratio * scale, ..look.clone() }
    }

    /// Draws into `view`, as number `count` of pictures whose mean is shown.
    fn encode(&mut self, view: &PictureView<'_>, camera: &Camera, look: &Look, count: u32) {
        let look = &self.scaled(look).relative_to(&self.points);
        let camera = camera.relative_to(&self.points);
        let has_lists = self.composite.has_volume() || self.surfaces.values().any(Surface::is_listed);
        self.common.samples = if self.is_quick && !has_lists { 1 } else { SAMPLES };
        self.target.set_samples(&self.context, self.common.samples);
        let frame = Frame::new(&camera, look, self.target.drawn_size, shift(count));
        self.common.write(&self.context, &frame);
        let descriptor = wgpu::CommandEncoderDescriptor { label: Some("picture") };
        let mut encoder = self.context.device.create_command_encoder(&descriptor);
        let has_shade = look.shade[0] > 0.0 && !self.is_quick && self.has_opaque();
        let has_more = has_lists || has_shade;
        let has_clips = !look.clips.is_empty();
        if has_lists {
            self.list(&mut encoder, has_clips);
        } else {
            self.lists.clear();
        }
        // What is not changed on the way to where it is seen is drawn there.
        let is_direct = self.common.samples == 1 && self.target.is_whole() && view.part.is_none();
        self.opaque(&mut encoder, is_direct.then_some(view.view), has_clips, has_more);
        if has_shade {
            self.find_shade(&mut encoder, look.shade);
        }
        if has_more {
            self.over(&mut encoder, has_shade, has_lists);
        }
        if !is_direct {
            let images = &self.target.images;
            let count = (!self.is_quick).then_some(count);
            self.presenter.present(&self.context, &mut encoder, &self.common, images, count, view);
        }
        if has_lists {
            self.lists.copy_count(&mut encoder);
        }
        self.context.queue.submit([encoder.finish()]);
        self.in_flight.fetch_add(1, Ordering::Relaxed);
        let in_flight = self.in_flight.clone();
        self.context.queue.on_submitted_work_done(move || {
            in_flight.fetch_sub(1, Ordering::Relaxed);
        });
        if has_lists {
            self.lists.read_count();
        }
    }

    /// Fills the lists of what is not opaque.
    fn list(&mut self, encoder: &mut wgpu::CommandEncoder, has_clips: bool) {
        let with = (&self.context, &self.common);
        let mut pass = self.lists.begin(with.0, encoder, self.target.drawn_size);
        pass.set_bind_group(0, &self.common.group, &[]);
        self.composite.list(with, &self.mesh, &mut pass);
        self.surface_pipelines.draw(with, &mut pass, self.surfaces.values(), true, has_clips);
        self.wire.list(with, &mut pass);
    }

    /// Whether anything is drawn that shade can fall on.
    fn has_opaque(&self) -> bool {
        self.shows_cells || self.surfaces.values().any(|surface| !surface.is_listed())
    }

    /// Finds where there is shade on what has been drawn.
    fn find_shade(&mut self, encoder: &mut wgpu::CommandEncoder, shade: [f32; 2]) {
        let (context, common) = (&self.context, &self.common);
        let drawn = (self.target.drawn_size, &self.target.images.depth);
        let pass = self.shade.get_or_insert_with(|| ShadePass::new(context));
        pass.find(context, encoder, common, drawn, shade);
    }

    /// Draws what is opaque, with one sample also to `direct`; if nothing comes after it also the lines over it.
    fn opaque(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        direct: Option<&wgpu::TextureView>,
        has_clips: bool,
        has_more: bool,
    ) {
        let (with, images) = ((&self.context, &self.common), &self.target.images);
        let whole = direct.unwrap_or(&images.resolved);
        let stored = if has_more { wgpu::StoreOp::Store } else { wgpu::StoreOp::Discard };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("opaque"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: images.samples.as_ref().unwrap_or(whole),
                depth_slice: None,
                resolve_target: images.samples.as_ref().filter(|_| !has_more).map(|_| whole),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: if images.samples.is_some() { stored } else { wgpu::StoreOp::Store },
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &images.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: stored }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_bind_group(0, &self.common.group, &[]);
        pass.set_pipeline(self.background.get(with.0, with.1, None));
        pass.draw(0..3, 0..1);
        self.surface_pipelines.draw(with, &mut pass, self.surfaces.values(), false, has_clips);
        if let (true, Some(cells)) = (self.shows_cells, &self.cells) {
            cells.draw(with, &self.mesh, has_clips, &mut pass);
        }
        if !has_more {
            self.wire.draw(with, &mut pass, false);
        }
    }

    /// Lays shade over it, then what is not opaque.
    fn over(&self, encoder: &mut wgpu::CommandEncoder, has_shade: bool, has_lists: bool) {
        let (with, images) = ((&self.context, &self.common), &self.target.images);
        let Some(samples) = &images.samples else { return };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("composite"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: samples,
                depth_slice: None,
                resolve_target: Some(&images.resolved),
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Discard },
            })],
            // Only read, so that shaders may read it, too.
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &images.depth,
                depth_ops: None,
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_bind_group(0, &self.common.group, &[]);
        if let Some(shade) = self.shade.as_ref().filter(|_| has_shade) {
            shade.draw(with, &images.depth, &mut pass);
        }
        if has_lists {
            self.composite.draw(with, &self.mesh, &self.lists, &images.depth, &mut pass);
        }
        self.wire.draw(with, &mut pass, has_lists);
    }

    /// Draws a picture that is the mean of `samples` pictures, and reads it back: `RGBA` bytes, premultiplied, rows from top to
    /// bottom. For renderers made by [`Renderer::headless`].
    ///
    /// # Errors
    /// If the target is no image, or the device is lost or refused something.
    pub async fn picture(&mut self, camera: &Camera, look: &Look, samples: u32) -> Result<Vec<u8>> {
        self.picture_with(camera, look, samples, |_| {}).await
    }

    /// [`Renderer::picture`] that tells how many of the pictures are drawn, after each.
    ///
    /// # Errors
    /// As [`Renderer::picture`].
    pub async fn picture_with(
        &mut self,
        camera: &Camera,
        look: &Look,
        samples: u32,
        mut drawn: impl FnMut(u32),
    ) -> Result<Vec<u8>> {
        // Reading waits until everything before is done: fragments are counted then, and devices never have
        // more than a picture to do.
        let mut pixels = loop {
            self.draw(camera, look)?;
            let pixels = self.read().await?;
            if !self.is_short() {
                break pixels;
            }
        };
        drawn(1);
        for count in 2..=samples {
            self.draw_again()?;
            pixels = self.read().await?;
            drawn(count);
        }
        Ok(pixels)
    }

    /// Reads a headless picture back: `RGBA` bytes, premultiplied, rows from top to bottom.
    ///
    /// # Errors
    /// If the target is no image, or the device is lost.
    pub async fn read(&self) -> Result<Vec<u8>> {
        self.target.read(&self.context).await
    }
}

/// Where in its pixels picture number `count` looks from: the middle, then evenly spread around it (Halton's sequence of the bases
/// 2 and 3).
pub(super) fn shift(count: u32) -> [f64; 2] {
    if count == 0 {
        return [0.0; 2];
    }
    [2, 3].map(|base| {
        let (mut rest, mut digit, mut sum) = (count, 1.0, 0.0);
        while rest > 0 {
            digit /= f64::from(base);
            sum += digit * f64::from(rest % base);
            rest /= base;
        }
        sum - 0.5
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shifts_stay_in_the_pixel_and_are_even() {
        let all: Vec<_> = (0..64).map(shift).collect();
        assert_eq!(all[0], [0.0; 2]);
        assert!(all.iter().flatten().all(|s| (-0.5..0.5).contains(s)));
        for k in 0..2 {
            let mean = all.iter().map(|s| s[k]).sum::<f64>() / 64.0;
            assert!(mean.abs() < 0.02, "{mean}");
        }
    }
}
