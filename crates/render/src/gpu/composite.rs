//! Draws what is not opaque over what is: the volume, and surfaces with opacity. See `composite.wgsl`.

use crate::gpu::buffers::GrowBuffer;
use crate::gpu::fragments::FragmentLists;
use crate::gpu::mesh::MeshBuffers;
use crate::gpu::pipeline::{Binding, Common, Output, Pipeline, Variant, group, group_layout, uniform};
use crate::gpu::{Context, GpuError};
use tetralod::geom::{SinglePoints, SingleValues};
use tetralod::mesh::NONE;
use tetralod::view::{Medium, MeshView, Place};

/// Entries of the table of the medium.
const TABLE: usize = 1024;

/// The uniform `settings`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct Settings {
    table: [f32; 4],
    corners: [u32; 4],
    start: [u32; 4],
    eye: [f32; 4],
}

/// No tetrahedron.
const OUTSIDE: [u32; 3] = [NONE, 0, 0];

#[derive(Debug)]
pub(super) struct Composite {
    entries: Pipeline,
    all: Pipeline,
    entries_layout: wgpu::BindGroupLayout,
    layout: wgpu::BindGroupLayout,
    medium: GrowBuffer<[f32; 4]>,
    /// First value of the table, values between two entries, number of entries.
    table: [f32; 4],
    /// The points of the tetrahedron that the eye is in; its number and the bits of the value at the eye.
    corners: [u32; 4],
    start: [u32; 3],
    /// Where the eye is in that tetrahedron if it is not displaced, as it is stored.
    eye: [f32; 3],
    /// The clip planes that apply to the volume.
    clips: u32,
    uniform: wgpu::Buffer,
    /// Stands in for what is not there.
    nothing: wgpu::Buffer,
}

impl Composite {
    pub(super) fn new(context: &Context, lists: &wgpu::BindGroupLayout) -> Self {
        use Binding::{Both, Depths, Read, Uniform};
        let entries_layout = group_layout(context, "entries of the volume", &[Both, Both, Both]);
        let bindings = [Read, Read, Read, Read, Read, Read, Uniform, Depths, Read];
        let layout = group_layout(context, "composite", &bindings);
        let listed = Output::List { only_front: true };
        let over = Output::Over(wgpu::CompareFunction::Always);
        let nothing = context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("nothing"),
            size: 64,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        Self {
            entries: Pipeline::new("volume_entries", ["vs", "fs"], &[&entries_layout, lists], listed),
            all: Pipeline::new("composite", ["vs", "fs"], &[&layout], over),
            entries_layout,
            layout,
            medium: GrowBuffer::new("entries of the transfer function", wgpu::BufferUsages::STORAGE),
            table: [0.0; 4],
            corners: [0; 4],
            start: OUTSIDE,
            eye: [0.0; 3],
            clips: u32::MAX,
            uniform: uniform::<Settings>(context, "settings of the composite"),
            nothing,
        }
    }

    /// What the values of the volume as they are stored look like, and which clip planes cut it, a bit each.
    pub(super) fn set_medium(
        &mut self,
        context: &Context,
        medium: Option<(&Medium, u32)>,
    ) -> Result<(), GpuError> {
        self.table = [0.0; 4];
        self.start = OUTSIDE;
        let Some((medium, clips)) = medium else { return Ok(()) };
        let (range, entries) = medium.table(TABLE);
        self.medium.write(context, &entries)?;
        let step = (range[1] - range[0]) / (TABLE - 1) as f64;
        self.table = [range[0] as f32, step as f32, TABLE as f32, 0.0];
        self.clips = clips;
        Ok(())
    }

    /// Bytes of memory on the GPU.
    pub(super) fn bytes(&self) -> u64 {
        self.medium.bytes()
    }

    pub(super) fn has_volume(&self) -> bool {
        self.table[2] > 0.0
    }

    /// Where in the mesh the eye is; none outside.
    pub(super) fn set_eye(
        &mut self,
        mesh: &MeshView<'_>,
        (points, values): (&SinglePoints, &SingleValues),
        place: Option<&Place>,
    ) {
        (self.corners, self.start, self.eye) = place.map_or(([0; 4], OUTSIDE, [0.0; 3]), |place| {
            let value = values.store(place.value(mesh)).to_bits();
            (mesh.tets[place.tet as usize], [place.tet, value, 0], points.store(place.position(mesh)))
        });
    }

    /// Lists where rays enter the volume.
    pub(super) fn list(
        &self,
        (context, common): (&Context, &Common),
        mesh: &MeshBuffers,
        pass: &mut wgpu::RenderPass<'_>,
    ) {
        let (Some(points), Some(faces)) = (mesh.points.binding(), mesh.faces.binding()) else { return };
        if self.has_volume() {
            let moves = mesh.moves();
            let variant = moves.as_ref().map(|_| Variant::MOVES);
            pass.set_pipeline(self.entries.get(context, common, variant));
            let resources = [points.clone(), faces, moves.unwrap_or(points)];
            pass.set_bind_group(1, &group(context, &self.entries_layout, &resources), &[]);
            pass.draw(0..3 * mesh.faces.len() as u32, 0..1);
        }
    }

    /// Draws all that is listed.
    pub(super) fn draw(
        &self,
        (context, common): (&Context, &Common),
        mesh: &MeshBuffers,
        lists: &FragmentLists,
        depth: &wgpu::TextureView,
        pass: &mut wgpu::RenderPass<'_>,
    ) {
        let parts = [mesh.points.binding(), mesh.faces.binding(), mesh.linked.buffer.binding()];
        let is_whole = self.has_volume() && parts.iter().all(Option::is_some);
        let ([id, value, _], [x, y, z]) = (self.start, self.eye);
        let settings = Settings {
            table: if is_whole { self.table } else { [0.0; 4] },
            corners: self.corners,
            start: [id, value, self.clips, 0],
            eye: [x, y, z, 0.0],
        };
        context.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&settings));
        let or_nothing = |part: Option<_>| part.unwrap_or_else(|| self.nothing.as_entire_binding());
        let [points, faces, tets] = parts.map(or_nothing);
        let [heads, nodes] = lists
            .buffers()
            .map_or([None, None], |both| both.map(|buffer| Some(buffer.as_entire_binding())))
            .map(or_nothing);
        let medium = or_nothing(self.medium.binding());
        let (uniform, depth) = (self.uniform.as_entire_binding(), wgpu::BindingResource::TextureView(depth));
        let moves = mesh.moves().filter(|_| is_whole);
        let variant = moves.as_ref().map(|_| Variant::MOVES);
        let resources = [points, faces, tets, medium, heads, nodes, uniform, depth, or_nothing(moves)];
        pass.set_pipeline(self.all.get(context, common, variant));
        pass.set_bind_group(1, &group(context, &self.layout, &resources), &[]);
        pass.draw(0..3, 0..1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_uniform_has_the_size_that_wgsl_gives_it() {
        assert_eq!(size_of::<Settings>(), 4 * 16);
    }
}
