//! Draws the volume: lists the faces through which the ray of each pixel enters, then goes through the tetrahedra from face to face, and
//! integrates emission and absorption of the piecewise linear field. The order is exact for any mesh, convex or not.

use crate::geom::Camera;
use crate::gpu::buffers::GrowBuffer;
use crate::gpu::pipeline::{FrameBinding, PipelineSpec};
use crate::gpu::{Context, GpuError};
use crate::mesh::{FACES, NONE};
use crate::view::{Medium, MeshView, Place};

/// Entries of the table of the medium.
const TABLE: usize = 1024;

/// Room for so many entries of rays for each pixel, on the average.
const ENTRIES: u64 = 6;

/// The uniform `volume`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct Uniform {
    right: [f32; 4],
    up: [f32; 4],
    forward: [f32; 4],
    table: [f32; 4],
    corners: [u32; 4],
    start: [u32; 4],
}

/// No tetrahedron.
const OUTSIDE: [u32; 4] = [NONE, 0, 0, 0];

#[derive(Debug)]
pub(super) struct VolumePass {
    list: wgpu::RenderPipeline,
    list_layout: wgpu::BindGroupLayout,
    march: wgpu::RenderPipeline,
    march_layout: wgpu::BindGroupLayout,
    points: GrowBuffer<[f32; 4]>,
    tets: GrowBuffer<[u32; 5]>,
    faces: GrowBuffer<[u32; 4]>,
    medium: GrowBuffer<[f32; 4]>,
    /// First value of the table, values between two entries, number of entries.
    table: [f32; 4],
    /// The points of the tetrahedron that the eye is in; its number and the bits of the value at the eye.
    start: [[u32; 4]; 2],
    uniform: wgpu::Buffer,
    lists: Option<Lists>,
    group: Option<wgpu::BindGroup>,
}

/// The lists of entries, for pictures of one size.
#[derive(Debug)]
struct Lists {
    size: [u32; 2],
    heads: wgpu::Buffer,
    nodes: wgpu::Buffer,
    /// A pass has to have an attachment; nothing is written to this one.
    unused: wgpu::TextureView,
}

/// One storage or uniform buffer of a group.
fn entry(
    binding: u32,
    ty: wgpu::BufferBindingType,
    visibility: wgpu::ShaderStages,
) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}

impl VolumePass {
    pub(super) fn new(context: &Context, frame: &FrameBinding, format: wgpu::TextureFormat) -> Self {
        use wgpu::{BufferBindingType as Ty, ShaderStages as Stage};
        let (read, write) = (Ty::Storage { read_only: true }, Ty::Storage { read_only: false });
        let layout = |label, entries: &[wgpu::BindGroupLayoutEntry]| {
            let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries };
            context.device.create_bind_group_layout(&descriptor)
        };
        let list_layout = layout(
            "entries of the volume",
            &[
                entry(0, read, Stage::VERTEX),
                entry(1, read, Stage::VERTEX),
                entry(2, write, Stage::FRAGMENT),
                entry(3, write, Stage::FRAGMENT),
            ],
        );
        let mut entries: Vec<_> = (0..6).map(|binding| entry(binding, read, Stage::FRAGMENT)).collect();
        entries.push(entry(6, Ty::Uniform, Stage::FRAGMENT));
        let march_layout = layout("volume", &entries);
        let spec = |shader, group, is_list: bool| PipelineSpec {
            shader,
            vertex: "vs",
            fragment: "fs",
            buffers: &[],
            depth: wgpu::CompareFunction::Always,
            writes_depth: false,
            blends: !is_list,
            group: Some(group),
            is_list,
        };
        let uniform = context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("volume"),
            size: size_of::<Uniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let storage = wgpu::BufferUsages::STORAGE;
        Self {
            list: spec("volume_entries", &list_layout, true).create(context, frame, UNUSED),
            march: spec("volume", &march_layout, false).create(context, frame, format),
            list_layout,
            march_layout,
            points: GrowBuffer::new("points of the mesh", storage),
            tets: GrowBuffer::new("tetrahedra", storage),
            faces: GrowBuffer::new("faces of the boundary", storage),
            medium: GrowBuffer::new("entries of the transfer function", storage),
            table: [0.0; 4],
            start: [[0; 4], OUTSIDE],
            uniform,
            lists: None,
            group: None,
        }
    }

    /// Replaces the mesh and the medium.
    pub(super) fn update(
        &mut self,
        context: &Context,
        mesh: &MeshView<'_>,
        medium: &Medium,
    ) -> Result<(), GpuError> {
        // Emptied first: if something does not fit, nothing is drawn.
        self.faces.write(context, &[])?;
        let points = mesh.positions.iter().zip(mesh.field).map(|(&[x, y, z], &value)| [x, y, z, value]);
        self.points.write(context, &points.collect::<Vec<_>>())?;
        let tets = mesh.tets.iter().zip(mesh.neighbors).map(|(tet, around)| packed(*tet, *around));
        self.tets.write(context, &tets.collect::<Vec<_>>())?;
        let (range, entries) = medium.table(TABLE);
        self.table =
            [range[0] as f32, ((range[1] - range[0]) / (TABLE - 1) as f64) as f32, TABLE as f32, 0.0];
        self.medium.write(context, &entries)?;
        self.start = [[0; 4], OUTSIDE];
        self.faces.write(context, &boundary(mesh))
    }

    /// Where in the mesh the eye is; none outside.
    pub(super) fn set_eye(&mut self, mesh: &MeshView<'_>, place: Option<&Place>) {
        self.start = place.map_or([[0; 4], OUTSIDE], |place| {
            let value = (place.value(mesh) as f32).to_bits();
            [mesh.tets[place.tet as usize], [place.tet, value, 0, 0]]
        });
    }

    /// Lists where the rays enter; comes before the pass in which [`VolumePass::draw`] draws.
    pub(super) fn prepare(
        &mut self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        frame: &FrameBinding,
        camera: &Camera,
        size: [u32; 2],
    ) {
        self.group = None;
        let (Some(points), Some(faces)) = (self.points.binding(), self.faces.binding()) else { return };
        let (Some(tets), Some(medium)) = (self.tets.binding(), self.medium.binding()) else { return };
        if self.lists.as_ref().is_none_or(|lists| lists.size != size) {
            self.lists = Some(Lists::new(context, size));
        }
        let Some(lists) = &self.lists else { return };
        let [forward, right, up] = camera.rays(f64::from(size[0]) / f64::from(size[1])).direction;
        let wide = |v: glam::DVec3| v.as_vec3().extend(0.0).to_array();
        let [corners, start] = self.start;
        let uniform = Uniform {
            right: wide(right),
            up: wide(up),
            forward: wide(forward),
            table: self.table,
            corners,
            start,
        };
        context.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        encoder.clear_buffer(&lists.heads, 0, None);
        let group = |layout, resources: &[wgpu::BindingResource<'_>]| {
            let entries: Vec<_> = (0..)
                .zip(resources)
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
                .collect();
            let descriptor = wgpu::BindGroupDescriptor { label: Some("volume"), layout, entries: &entries };
            context.device.create_bind_group(&descriptor)
        };
        let (heads, nodes) = (lists.heads.as_entire_binding(), lists.nodes.as_entire_binding());
        let listing =
            group(&self.list_layout, &[points.clone(), faces.clone(), heads.clone(), nodes.clone()]);
        self.group = Some(group(
            &self.march_layout,
            &[points, faces, heads, nodes, tets, medium, self.uniform.as_entire_binding()],
        ));
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("entries of the volume"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &lists.unused,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Discard,
                },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.list);
        pass.set_bind_group(0, &frame.group, &[]);
        pass.set_bind_group(1, &listing, &[]);
        pass.draw(0..3 * self.faces.len() as u32, 0..1);
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(group) = &self.group {
            pass.set_pipeline(&self.march);
            pass.set_bind_group(1, group, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}

impl Lists {
    fn new(context: &Context, size: [u32; 2]) -> Self {
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let most = context.device.limits().max_storage_buffer_binding_size;
        let buffer = |label, bytes: u64| {
            context.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: bytes.min(most & !7),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let unused = context.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("nothing"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: UNUSED,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        Self {
            size,
            heads: buffer("lists of entries", 4 * (pixels + 1)),
            nodes: buffer("entries", 8 * ENTRIES * pixels),
            unused: unused.create_view(&wgpu::TextureViewDescriptor::default()),
        }
    }
}

const UNUSED: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// A tetrahedron in 20 bytes: its neighbours in ascending order of the points opposite the faces to them, and the exclusive or of its
/// points (Aman, Demirci, Güdükbay 2022: *Compact tetrahedralization-based acceleration structures for ray tracing*).
fn packed(tet: [u32; 4], around: [u32; 4]) -> [u32; 5] {
    let mut order = [0, 1, 2, 3];
    order.sort_unstable_by_key(|&i: &usize| tet[i]);
    let [a, b, c, d] = order.map(|i| around[i]);
    [a, b, c, d, tet[0] ^ tet[1] ^ tet[2] ^ tet[3]]
}

/// The faces that only one tetrahedron has, counter-clockwise from outside, each with its tetrahedron.
fn boundary(mesh: &MeshView<'_>) -> Vec<[u32; 4]> {
    let mut faces = Vec::new();
    for (t, (tet, around)) in (0..).zip(mesh.tets.iter().zip(mesh.neighbors)) {
        for (face, _) in FACES.iter().zip(around).filter(|(_, neighbor)| **neighbor == NONE) {
            let [a, b, c] = face.map(|corner| tet[corner]);
            faces.push([a, b, c, t]);
        }
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_opposite_points_in_ascending_order() {
        let tet = packed([7, 2, 9, 4], [70, 20, 90, 40]);
        assert_eq!(tet, [20, 40, 70, 90, 7 ^ 2 ^ 9 ^ 4]);
        assert_eq!(size_of_val(&tet), 20);
    }

    #[test]
    fn the_uniform_has_the_size_that_wgsl_gives_it() {
        assert_eq!(size_of::<Uniform>(), 6 * 16);
    }
}
