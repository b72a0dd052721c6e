//! Draws the cut-away tetrahedra: flat faces coloured by the field, with outlines.

use crate::gpu::buffers::GrowBuffer;
use crate::gpu::pipeline::{FrameBinding, PipelineSpec, packed};
use crate::gpu::{Context, GpuError};
use crate::view::Cutaway;

#[derive(Debug)]
pub(super) struct CutawayPass {
    pipeline: wgpu::RenderPipeline,
    positions: GrowBuffer<[f32; 3]>,
    values: GrowBuffer<f32>,
}

impl CutawayPass {
    pub(super) fn new(context: &Context, frame: &FrameBinding, format: wgpu::TextureFormat) -> Self {
        let attributes = (wgpu::vertex_attr_array![0 => Float32x3], wgpu::vertex_attr_array![1 => Float32]);
        let spec = PipelineSpec {
            shader: "cutaway",
            vertex: "vs",
            fragment: "fs",
            buffers: &[packed(&attributes.0), packed(&attributes.1)],
            depth: wgpu::CompareFunction::Less,
            writes_depth: true,
            blends: false,
            group: None,
            is_list: false,
        };
        Self {
            pipeline: spec.create(context, frame, format),
            positions: GrowBuffer::new("corners of the cut-away faces", wgpu::BufferUsages::VERTEX),
            values: GrowBuffer::new("values of the cut-away faces", wgpu::BufferUsages::VERTEX),
        }
    }

    pub(super) fn update(&mut self, context: &Context, cutaway: &Cutaway) -> Result<(), GpuError> {
        self.values.write(context, &[])?;
        self.positions.write(context, &cutaway.positions)?;
        self.values.write(context, &cutaway.values)
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let (Some(positions), Some(values)) = (self.positions.slice(), self.values.slice()) {
            pass.set_pipeline(&self.pipeline);
            pass.set_vertex_buffer(0, positions);
            pass.set_vertex_buffer(1, values);
            pass.draw(0..self.positions.len() as u32, 0..1);
        }
    }
}
