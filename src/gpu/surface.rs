//! Draws the lit isosurface.

use crate::gpu::buffers::GrowBuffer;
use crate::gpu::pipeline::{FrameBinding, PipelineSpec, packed};
use crate::gpu::{Context, GpuError};
use crate::view::IsoSurface;
use std::ops::Range;

#[derive(Debug)]
pub(super) struct SurfacePass {
    pipeline: wgpu::RenderPipeline,
    positions: GrowBuffer<[f32; 3]>,
    normals: GrowBuffer<[f32; 3]>,
    indices: GrowBuffer<[u32; 3]>,
}

impl SurfacePass {
    pub(super) fn new(context: &Context, frame: &FrameBinding, format: wgpu::TextureFormat) -> Self {
        let attributes = [wgpu::vertex_attr_array![0 => Float32x3], wgpu::vertex_attr_array![1 => Float32x3]];
        let spec = PipelineSpec {
            shader: "surface",
            vertex: "vs",
            fragment: "fs",
            buffers: &[packed(&attributes[0]), packed(&attributes[1])],
            depth: wgpu::CompareFunction::Less,
            writes_depth: true,
            blends: false,
            group: None,
            is_list: false,
        };
        Self {
            pipeline: spec.create(context, frame, format),
            positions: GrowBuffer::new("vertices of the isosurface", wgpu::BufferUsages::VERTEX),
            normals: GrowBuffer::new("normals of the isosurface", wgpu::BufferUsages::VERTEX),
            indices: GrowBuffer::new("triangles of the isosurface", wgpu::BufferUsages::INDEX),
        }
    }

    pub(super) fn update(&mut self, context: &Context, surface: &IsoSurface) -> Result<(), GpuError> {
        // Emptied first: if the vertices do not fit, old triangles must not draw from them.
        self.indices.write(context, &[])?;
        self.positions.write(context, &surface.positions)?;
        self.normals.write(context, &surface.normals)?;
        self.indices.write(context, &surface.indices)
    }

    /// The same with what differs from the surface that is there: ranges of vertices and of triangles.
    pub(super) fn update_ranges(
        &mut self,
        context: &Context,
        surface: &IsoSurface,
        vertices: &[Range<u32>],
        triangles: &[Range<u32>],
    ) -> Result<(), GpuError> {
        let updated = self.positions.update(context, &surface.positions, vertices);
        let updated = updated.and_then(|()| self.normals.update(context, &surface.normals, vertices));
        let updated = updated.and_then(|()| self.indices.update(context, &surface.indices, triangles));
        // If something does not fit, old triangles must not draw from it.
        updated.or_else(|error| self.indices.write(context, &[]).and(Err(error)))
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        let slices = (self.positions.slice(), self.normals.slice(), self.indices.slice());
        if let (Some(positions), Some(normals), Some(indices)) = slices {
            pass.set_pipeline(&self.pipeline);
            pass.set_vertex_buffer(0, positions);
            pass.set_vertex_buffer(1, normals);
            pass.set_index_buffer(indices, wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..self.indices.len() as u32 * 3, 0, 0..1);
        }
    }
}
