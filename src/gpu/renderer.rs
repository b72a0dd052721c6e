//! The whole picture: background, mesh, boxes.

use crate::geom::Camera;
use crate::gpu::cutaway::CutawayPass;
use crate::gpu::pipeline::{FrameBinding, PipelineSpec};
use crate::gpu::surface::SurfacePass;
use crate::gpu::target::{Picture, Target};
use crate::gpu::types::Frame;
use crate::gpu::volume::VolumePass;
use crate::gpu::wire::WirePass;
use crate::gpu::{BoxLines, Context, GpuError, Look};
use crate::view::{Cutaway, IsoSurface, Medium, MeshView, Place};
use std::ops::Range;

/// Which view of the mesh is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Show {
    /// The lit isosurface.
    #[default]
    Surface,
    /// The cut-away tetrahedra.
    Cutaway,
    /// Emission and absorption of the whole volume.
    Volume,
}

/// Draws pictures of a mesh on a canvas or into an image.
#[derive(Debug)]
pub struct Renderer {
    context: Context,
    target: Target,
    frame: FrameBinding,
    background: wgpu::RenderPipeline,
    surface: SurfacePass,
    cutaway: CutawayPass,
    /// Made when there is a volume to draw: its pipelines take longer to compile than all others.
    volume: Option<VolumePass>,
    wire: WirePass,
}

impl Renderer {
    /// Draws into an image of this many pixels; see [`Renderer::read`].
    ///
    /// # Errors
    /// If there is no adapter or it cannot be opened.
    pub async fn headless(size: [u32; 2]) -> Result<Self, GpuError> {
        let context = Context::headless().await?;
        let target = Target::image(&context, size);
        Self::new(context, target)
    }

    /// Draws on `target`, such as a canvas, with this many pixels.
    ///
    /// # Errors
    /// If there is no adapter, it cannot be opened, or the canvas cannot be drawn to.
    pub async fn on_surface(
        target: impl Into<wgpu::SurfaceTarget<'static>>,
        size: [u32; 2],
    ) -> Result<Self, GpuError> {
        let (context, surface) = Context::with_surface(target).await?;
        let target = Target::canvas(&context, surface, size)?;
        Self::new(context, target)
    }

    fn new(context: Context, target: Target) -> Result<Self, GpuError> {
        let frame = FrameBinding::new(&context);
        let format = target.format;
        let background = PipelineSpec {
            shader: "background",
            vertex: "vs",
            fragment: "fs",
            buffers: &[],
            depth: wgpu::CompareFunction::Always,
            writes_depth: false,
            blends: false,
            group: None,
            is_list: false,
        };
        let renderer = Self {
            background: background.create(&context, &frame, format),
            surface: SurfacePass::new(&context, &frame, format),
            cutaway: CutawayPass::new(&context, &frame, format),
            volume: None,
            wire: WirePass::new(&context, &frame, format),
            context,
            target,
            frame,
        };
        renderer.context.check()?;
        Ok(renderer)
    }

    /// The GPU and its driver in words.
    pub fn description(&self) -> String {
        self.context.description()
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
    }

    /// Replaces the isosurface.
    ///
    /// # Errors
    /// If it is too large for the device; then none is shown.
    pub fn set_surface(&mut self, surface: &IsoSurface) -> Result<(), GpuError> {
        self.surface.update(&self.context, surface)
    }

    /// Makes the isosurface `surface`, which differs from the one that is there only in these ranges of vertices and of
    /// triangles, and in what lies beyond its ends. What is uploaded is that, so the cost goes with what has changed.
    ///
    /// # Errors
    /// If it is too large for the device; then no surface is shown, and [`Renderer::set_surface`] must be called next.
    pub fn update_surface(
        &mut self,
        surface: &IsoSurface,
        vertices: &[Range<u32>],
        triangles: &[Range<u32>],
    ) -> Result<(), GpuError> {
        self.surface.update_ranges(&self.context, surface, vertices, triangles)
    }

    /// Replaces the cut-away faces.
    ///
    /// # Errors
    /// If they are too large for the device; then none are shown.
    pub fn set_cutaway(&mut self, cutaway: &Cutaway) -> Result<(), GpuError> {
        self.cutaway.update(&self.context, cutaway)
    }

    /// Replaces the volume: the mesh, and what its values look like. If the eye may be in it, call
    /// [`Renderer::set_eye`] for each picture.
    ///
    /// # Errors
    /// If it is too large for the device; then none is shown.
    pub fn set_volume(&mut self, mesh: &MeshView<'_>, medium: &Medium) -> Result<(), GpuError> {
        let (context, frame, format) = (&self.context, &self.frame, self.target.format);
        self.volume
            .get_or_insert_with(|| VolumePass::new(context, frame, format))
            .update(context, mesh, medium)
    }

    /// Where the eye of the next pictures is in the mesh of [`Renderer::set_volume`], as [`Probe::locate`](crate::view::Probe::locate)
    /// gives it; none outside.
    pub fn set_eye(&mut self, mesh: &MeshView<'_>, place: Option<&Place>) {
        self.volume.iter_mut().for_each(|volume| volume.set_eye(mesh, place));
    }

    /// Replaces the boxes.
    ///
    /// # Errors
    /// If they are too many for the device.
    pub fn set_boxes(&mut self, boxes: &[BoxLines]) -> Result<(), GpuError> {
        self.wire.update(&self.context, boxes)
    }

    /// Draws a picture. `false` when the target is not available, such as a hidden canvas.
    ///
    /// # Errors
    /// If the device is lost or refused something, now or since the last picture.
    pub fn draw(&mut self, show: Show, camera: &Camera, look: &Look) -> Result<bool, GpuError> {
        self.context.check()?;
        let Some(picture) = self.target.next(&self.context)? else { return Ok(false) };
        self.frame.write(&self.context, &Frame::new(camera, look, self.target.size));
        let descriptor = wgpu::CommandEncoderDescriptor { label: Some("picture") };
        let mut encoder = self.context.device.create_command_encoder(&descriptor);
        if let (Show::Volume, Some(volume)) = (show, &mut self.volume) {
            volume.prepare(&self.context, &mut encoder, &self.frame, camera, self.target.size);
        }
        self.encode(&mut encoder, &picture.view(), show);
        self.context.queue.submit([encoder.finish()]);
        if let Picture::Canvas(texture) = picture {
            self.context.queue.present(texture);
        }
        self.context.check()?;
        Ok(true)
    }

    fn encode(&self, encoder: &mut wgpu::CommandEncoder, picture: &wgpu::TextureView, show: Show) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.target.samples,
                depth_slice: None,
                resolve_target: Some(picture),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Discard,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.target.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_bind_group(0, &self.frame.group, &[]);
        pass.set_pipeline(&self.background);
        pass.draw(0..3, 0..1);
        match show {
            Show::Surface => self.surface.draw(&mut pass),
            Show::Cutaway => self.cutaway.draw(&mut pass),
            Show::Volume => self.volume.iter().for_each(|volume| volume.draw(&mut pass)),
        }
        self.wire.draw(&mut pass);
    }

    /// Reads a headless picture back: `RGBA` bytes, rows from top to bottom.
    ///
    /// # Errors
    /// If the target is a canvas, or the device is lost.
    pub async fn read(&self) -> Result<Vec<u8>, GpuError> {
        self.target.read(&self.context).await
    }
}
