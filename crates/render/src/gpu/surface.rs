//! Draws surfaces of triangles, each with a style of its own.

use crate::draw::Style;
use crate::gpu::buffers::GrowBuffer;
use crate::gpu::pipeline::{Binding, Common, Output, Pipeline, Variant, group, group_layout, uniform};
use crate::gpu::style::StyleUniform;
use crate::gpu::{Context, GpuError};
use tetralod::geom::{SinglePoints, SingleValues};
use tetralod::view::{SurfaceChanges, Triangles};

/// The pipelines of all surfaces.
#[derive(Debug)]
pub(super) struct SurfacePipelines {
    opaque: Pipeline,
    listed: Pipeline,
    layout: wgpu::BindGroupLayout,
}

/// One surface.
#[derive(Debug)]
pub(super) struct Surface {
    positions: GrowBuffer<[f32; 3]>,
    normals: GrowBuffer<[f32; 3]>,
    values: GrowBuffer<f32>,
    indices: GrowBuffer<[u32; 3]>,
    /// Where vertices go, and with slopes how that changes around them: so many numbers a vertex, none if they stay.
    moves: GrowBuffer<f32>,
    moves_each: u32,
    style: Style,
    /// How the values are stored.
    stored: SingleValues,
    uniform: wgpu::Buffer,
    group: Option<wgpu::BindGroup>,
}

impl SurfacePipelines {
    pub(super) fn new(context: &Context, lists: &wgpu::BindGroupLayout) -> Self {
        use Binding::{Uniform, Vertices};
        let layout =
            group_layout(context, "surface", &[Uniform, Vertices, Vertices, Vertices, Vertices, Vertices]);
        let (opaque, listed) = (Output::Opaque { only_front: false }, Output::List { only_front: false });
        let opaque = Pipeline::new("surface", ["vs", "fs"], &[&layout], opaque);
        let listed = Pipeline::new("surface", ["vs", "fs_list"], &[&layout, lists], listed);
        Self { opaque, listed, layout }
    }

    /// `has_clips`: whether clip planes cut anything.
    pub(super) fn draw<'a>(
        &self,
        (context, common): (&Context, &Common),
        pass: &mut wgpu::RenderPass<'_>,
        surfaces: impl Iterator<Item = &'a Surface>,
        are_listed: bool,
        has_clips: bool,
    ) {
        let pipeline = if are_listed { &self.listed } else { &self.opaque };
        for surface in surfaces.filter(|surface| surface.is_listed() == are_listed) {
            if let Some(group) = &surface.group {
                let variant = Variant::new(&surface.style, has_clips, surface.moves_each > 0);
                pass.set_pipeline(pipeline.get(context, common, Some(variant)));
                pass.set_bind_group(1, group, &[]);
                pass.draw(0..surface.indices.len() as u32 * 3, 0..1);
            }
        }
    }
}

impl Surface {
    pub(super) fn new(context: &Context) -> Self {
        let storage = wgpu::BufferUsages::STORAGE;
        Self {
            positions: GrowBuffer::new("vertices of a surface", storage),
            normals: GrowBuffer::new("normals of a surface", storage),
            values: GrowBuffer::new("values of a surface", storage),
            indices: GrowBuffer::new("triangles of a surface", storage),
            moves: GrowBuffer::new("moves of a surface", storage),
            moves_each: 0,
            style: Style::default(),
            stored: SingleValues::PLAIN,
            uniform: uniform::<StyleUniform>(context, "style"),
            group: None,
        }
    }

    /// Whether it is not opaque.
    pub(super) fn is_listed(&self) -> bool {
        self.style.opacity < 1.0
    }

    pub(super) fn triangles(&self) -> usize {
        self.indices.len()
    }

    /// Bytes of memory on the GPU.
    pub(super) fn bytes(&self) -> u64 {
        let vertices = self.positions.bytes() + self.normals.bytes() + self.values.bytes();
        vertices + self.indices.bytes() + self.moves.bytes()
    }

    pub(super) fn set_style(&mut self, context: &Context, style: &Style) {
        self.style = *style;
        let uniform = StyleUniform::of_surface(style, &self.stored, self.moves_each);
        context.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
    }

    /// Makes it these triangles, with points stored like this. If `changes` are given, only those differ from the ones that are there.
    pub(super) fn update(
        &mut self,
        context: &Context,
        pipelines: &SurfacePipelines,
        triangles: &Triangles<'_>,
        changes: Option<&SurfaceChanges>,
        points: &SinglePoints,
    ) -> Result<(), GpuError> {
        self.group = None;
        let moves_each = match (triangles.moves.is_empty(), triangles.slopes.is_empty()) {
            (true, _) => 0,
            (false, true) => 3,
            (false, false) => 12,
        };
        let is_stored_alike = (self.stored, self.moves_each) == (triangles.single, moves_each);
        (self.stored, self.moves_each) = (triangles.single, moves_each);
        if !is_stored_alike {
            self.set_style(context, &self.style.clone());
        }
        let all = SurfaceChanges::default();
        let SurfaceChanges { vertices, triangles: changed } = match changes.filter(|_| is_stored_alike) {
            Some(changes) => changes,
            None => {
                self.clear();
                &all
            }
        };
        self.positions.update_with(context, triangles.positions.len(), vertices, |range| {
            triangles.positions[range].iter().map(|point| points.store(*point)).collect()
        })?;
        self.normals.update(context, or_one(triangles.normals, &[[0.0; 3]]), vertices)?;
        let values = or_one(triangles.values, &[0.0]);
        self.values.update_with(context, values.len(), vertices, |range| {
            self.stored.store_all(&values[range]).into()
        })?;
        if triangles.inner_sides.is_empty() {
            self.indices.update(context, triangles.indices, changed)?;
        } else {
            let packed: Vec<_> = triangles.indices.iter().zip(triangles.inner_sides).map(packed).collect();
            self.indices.update(context, &packed, changed)?;
        }
        // Changes of a surface say nothing of its moves: they come whole.
        self.moves.write(context, &stored_moves(triangles, points))?;
        let resources =
            [self.positions.binding(), self.normals.binding(), self.values.binding(), self.indices.binding()];
        let [Some(positions), Some(normals), Some(values), Some(indices)] = resources else { return Ok(()) };
        let moves = self.moves.binding().unwrap_or_else(|| positions.clone());
        let resources = [self.uniform.as_entire_binding(), positions, normals, values, indices, moves];
        self.group = Some(group(context, &pipelines.layout, &resources));
        Ok(())
    }

    fn clear(&mut self) {
        self.positions.clear();
        self.normals.clear();
        self.values.clear();
        self.indices.clear();
        self.moves.clear();
    }
}

/// The moves of all vertices, with their slopes if they have some: these are of points as they are stored.
pub(super) fn stored_moves(triangles: &Triangles<'_>, points: &SinglePoints) -> Vec<f32> {
    let Triangles { moves, slopes, .. } = triangles;
    if slopes.is_empty() {
        return moves.iter().flatten().map(|x| *x as f32).collect();
    }
    let mut stored = Vec::with_capacity(12 * moves.len());
    for (way, slope) in moves.iter().zip(*slopes) {
        stored.extend(way.map(|x| x as f32));
        stored.extend(slope.iter().flatten().map(|x| (x * points.unit) as f32));
    }
    stored
}

/// A binding is never empty.
fn or_one<'a, T>(items: &'a [T], one: &'a [T]) -> &'a [T] {
    if items.is_empty() { one } else { items }
}

/// The corners of a triangle with a bit at those whose side to the next one is no edge.
pub(super) fn packed((triangle, inner): (&[u32; 3], &u8)) -> [u32; 3] {
    [0, 1, 2].map(|k| triangle[k] | u32::from(inner >> k & 1) << 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_that_are_no_edges_have_a_bit() {
        assert_eq!(packed((&[5, 6, 7], &0b010)), [5, 6 | 1 << 31, 7]);
    }
}
