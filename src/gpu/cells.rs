//! Draws tetrahedra as they are, or the points of the mesh.

use crate::gpu::buffers::GrowBuffer;
use crate::gpu::mesh::MeshBuffers;
use crate::gpu::pipeline::{Binding, Common, Output, PipelineSpec, group, group_layout, uniform};
use crate::gpu::style::{CellShape, CellStyle, StyleUniform};
use crate::gpu::{Context, GpuError};

#[derive(Debug)]
pub(super) struct CellPass {
    solid: wgpu::RenderPipeline,
    wire: wgpu::RenderPipeline,
    point: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    uniform: wgpu::Buffer,
    style: CellStyle,
    values: GrowBuffer<f32>,
}

impl CellPass {
    pub(super) fn new(context: &Context, common: &Common) -> Self {
        use Binding::{Uniform, Vertices};
        let layout = group_layout(context, "cells", &[Uniform, Vertices, Vertices, Vertices]);
        let groups = [Some(&layout)];
        let pipeline = |vertex, fragment, only_front| {
            let output = Output::Opaque { only_front };
            let spec =
                PipelineSpec { shader: "cells", vertex, fragment, buffers: &[], groups: &groups, output };
            spec.create(context, common)
        };
        Self {
            solid: pipeline("vs", "fs", true),
            wire: pipeline("vs", "fs_wire", false),
            point: pipeline("vs_point", "fs_point", false),
            layout,
            uniform: uniform::<StyleUniform>(context, "style of cells"),
            style: CellStyle::default(),
            values: GrowBuffer::new("values of tetrahedra", wgpu::BufferUsages::STORAGE),
        }
    }

    pub(super) fn set_style(&mut self, context: &Context, style: &CellStyle) {
        self.style = *style;
        context.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&StyleUniform::from(style)));
    }

    pub(super) fn set_values(&mut self, context: &Context, values: &[f32]) -> Result<(), GpuError> {
        self.values.write(context, values)
    }

    pub(super) fn draw(&self, context: &Context, mesh: &MeshBuffers, pass: &mut wgpu::RenderPass<'_>) {
        let (Some(points), Some(tets)) = (mesh.points.binding(), mesh.corners.buffer.binding()) else {
            return;
        };
        // Values of another mesh would be wrong; points stand in for values that nobody reads.
        let has_values = self.values.len() == mesh.corners.buffer.len();
        if self.style.own_values && !has_values {
            return;
        }
        let values = self.values.binding().unwrap_or_else(|| points.clone());
        let uniform = self.uniform.as_entire_binding();
        pass.set_bind_group(1, &group(context, &self.layout, &[uniform, points, tets, values]), &[]);
        let corners = 12 * mesh.corners.buffer.len() as u32;
        match self.style.shape {
            CellShape::Solid(_) => {
                pass.set_pipeline(&self.solid);
                pass.draw(0..corners, 0..1);
            }
            CellShape::Wire => {
                pass.set_pipeline(&self.wire);
                pass.draw(0..corners, 0..1);
            }
            CellShape::Points(_) => {
                pass.set_pipeline(&self.point);
                pass.draw(0..6, 0..mesh.points.len() as u32);
            }
        }
    }
}
