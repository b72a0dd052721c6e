//! Draws tetrahedra as they are, or the points of the mesh.

use crate::draw::{CellShape, CellStyle, Lighting};
use crate::gpu::buffers::GrowBuffer;
use crate::gpu::cell_parts::{edges, outer_faces, points};
use crate::gpu::mesh::MeshBuffers;
use crate::gpu::pipeline::{Binding, Common, Output, Pipeline, Variant, group, group_layout, uniform};
use crate::gpu::style::StyleUniform;
use crate::gpu::{Context, GpuError};
use tetralod::geom::{SinglePoints, SingleValues};
use tetralod::view::MeshView;

#[derive(Debug)]
pub(super) struct CellPass {
    solid: Pipeline,
    faces: Pipeline,
    wire: Pipeline,
    point: Pipeline,
    layout: wgpu::BindGroupLayout,
    uniform: wgpu::Buffer,
    style: CellStyle,
    /// How the points and values of the mesh are stored, and the values of tetrahedra.
    stored: (SinglePoints, SingleValues),
    own_stored: SingleValues,
    values: GrowBuffer<f32>,
    /// The outer faces of solid tetrahedra, or the edges, or the points.
    parts: GrowBuffer<u32>,
    /// Whether these are the ones of the mesh and the style.
    has_parts: bool,
}

impl CellPass {
    pub(super) fn new(context: &Context) -> Self {
        use Binding::{Uniform, Vertices};
        let layout =
            group_layout(context, "cells", &[Uniform, Vertices, Vertices, Vertices, Vertices, Vertices]);
        let pipeline = |vertex, fragment, only_front| {
            Pipeline::new("cells", [vertex, fragment], &[&layout], Output::Opaque { only_front })
        };
        Self {
            solid: pipeline("vs", "fs", true),
            faces: pipeline("vs_face", "fs", true),
            wire: pipeline("vs_edge", "fs_edge", false),
            point: pipeline("vs_point", "fs_point", false),
            layout,
            uniform: uniform::<StyleUniform>(context, "style of cells"),
            style: CellStyle::default(),
            stored: Default::default(),
            own_stored: SingleValues::PLAIN,
            values: GrowBuffer::new("values of tetrahedra", wgpu::BufferUsages::STORAGE),
            parts: GrowBuffer::new("faces, edges or points of tetrahedra", wgpu::BufferUsages::STORAGE),
            has_parts: false,
        }
    }

    pub(super) fn set_style(&mut self, context: &Context, style: &CellStyle) {
        let kind = |style: &CellStyle| std::mem::discriminant(&style.shape);
        self.has_parts &= style.cut == self.style.cut && kind(style) == kind(&self.style);
        self.style = *style;
        self.write_style(context);
    }

    /// How the points and values of the mesh are stored.
    pub(super) fn set_stored(&mut self, context: &Context, points: SinglePoints, values: SingleValues) {
        self.stored = (points, values);
        self.write_style(context);
    }

    pub(super) fn set_values(&mut self, context: &Context, values: &[f64]) -> Result<(), GpuError> {
        self.own_stored = SingleValues::of_values(values);
        self.write_style(context);
        self.values.write(context, &self.own_stored.store_all(values))
    }

    fn write_style(&self, context: &Context) {
        let (points, values) = &self.stored;
        let values = if self.style.own_values { &self.own_stored } else { values };
        let uniform = StyleUniform::of_cells(&self.style, points, values);
        context.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
    }

    /// Whether it lacks what the style shows of the mesh.
    pub(super) fn is_behind(&self) -> bool {
        !self.has_parts
    }

    /// Finds what the style shows of the mesh.
    pub(super) fn update(&mut self, context: &Context, mesh: &MeshView<'_>) -> Result<(), GpuError> {
        let parts = match self.style.shape {
            CellShape::Wire => edges(mesh, &self.style.cut),
            CellShape::Solid(_) => outer_faces(mesh, &self.style.cut),
            CellShape::Points(_) => points(mesh, &self.style.cut),
        };
        self.has_parts = false;
        self.parts.write(context, &parts)?;
        self.has_parts = true;
        Ok(())
    }

    /// Bytes of memory on the GPU.
    pub(super) fn bytes(&self) -> u64 {
        self.values.bytes() + self.parts.bytes()
    }

    /// `has_clips`: whether clip planes cut anything.
    pub(super) fn draw(
        &self,
        (context, common): (&Context, &Common),
        mesh: &MeshBuffers,
        has_clips: bool,
        pass: &mut wgpu::RenderPass<'_>,
    ) {
        let (Some(points), Some(tets)) = (mesh.points.binding(), mesh.corners.buffer.binding()) else {
            return;
        };
        // Values of another mesh would be wrong; points stand in for values that nobody reads.
        let has_values = self.values.len() == mesh.corners.buffer.len();
        if self.style.own_values && !has_values {
            return;
        }
        let values = self.values.binding().unwrap_or_else(|| points.clone());
        let parts = self.parts.binding().unwrap_or_else(|| points.clone());
        let has_moves = mesh.moves().is_some();
        let moves = mesh.moves().unwrap_or_else(|| points.clone());
        let resources = [self.uniform.as_entire_binding(), points, tets, values, parts, moves];
        pass.set_bind_group(1, &group(context, &self.layout, &resources), &[]);
        let parts = if self.has_parts { self.parts.len() as u32 } else { 0 };
        // Shrunk ones and those that clip planes cut open show faces that others hide.
        let mut variant = Variant::new(&self.style.style, has_clips, has_moves);
        let is_whole = self.style.shape == CellShape::Solid(0.0) && !variant.has_clips;
        // Smooth light takes normals, which points do not have.
        if variant.light == Lighting::Smooth {
            variant.light = Lighting::Flat;
        }
        let mut set = |pipeline: &Pipeline| pass.set_pipeline(pipeline.get(context, common, Some(variant)));
        let corners = 12 * mesh.corners.buffer.len() as u32;
        match self.style.shape {
            CellShape::Solid(_) if is_whole => {
                set(&self.faces);
                pass.draw(0..3 * parts, 0..1);
            }
            CellShape::Solid(_) => {
                set(&self.solid);
                pass.draw(0..corners, 0..1);
            }
            CellShape::Wire => {
                set(&self.wire);
                pass.draw(0..2 * parts, 0..1);
            }
            CellShape::Points(_) => {
                set(&self.point);
                pass.draw(0..6, 0..parts / 2);
            }
        }
    }
}
