//! What all pipelines have in common: the uniform `frame`, depth, samples.

use crate::gpu::target::DEPTH;
use crate::gpu::types::Frame;
use crate::gpu::{Context, SAMPLES, SHADERS};

/// The uniform of a frame and how shaders reach it.
#[derive(Debug)]
pub(super) struct FrameBinding {
    buffer: wgpu::Buffer,
    pub(super) group: wgpu::BindGroup,
    group_layout: wgpu::BindGroupLayout,
    layout: wgpu::PipelineLayout,
}

impl FrameBinding {
    pub(super) fn new(context: &Context) -> Self {
        let device = &context.device;
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame"),
            size: size_of::<Frame>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("frame"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("frame"),
            layout: &group_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("frame"),
            bind_group_layouts: &[Some(&group_layout)],
            immediate_size: 0,
        });
        Self { buffer, group, group_layout, layout }
    }

    pub(super) fn write(&self, context: &Context, frame: &Frame) {
        context.queue.write_buffer(&self.buffer, 0, bytemuck::bytes_of(frame));
    }
}

/// How one pipeline differs from the others.
pub(super) struct PipelineSpec<'a> {
    pub shader: &'static str,
    pub vertex: &'static str,
    pub fragment: &'static str,
    pub buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    pub depth: wgpu::CompareFunction,
    pub writes_depth: bool,
    /// Whether colours are premultiplied and laid over what is there.
    pub blends: bool,
    /// What shaders reach beside the frame.
    pub group: Option<&'a wgpu::BindGroupLayout>,
    /// Whether it writes to buffers alone, of the faces that are seen from the front: once a pixel, without depth, and no colour.
    pub is_list: bool,
}

impl PipelineSpec<'_> {
    pub(super) fn create(
        &self,
        context: &Context,
        frame: &FrameBinding,
        format: wgpu::TextureFormat,
    ) -> wgpu::RenderPipeline {
        let source = SHADERS.iter().find(|(name, _)| *name == self.shader).map_or("", |(_, source)| source);
        let module = context.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.shader),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let own;
        let layout = match self.group {
            None => &frame.layout,
            Some(group) => {
                own = context.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                    label: Some(self.shader),
                    bind_group_layouts: &[Some(&frame.group_layout), Some(group)],
                    immediate_size: 0,
                });
                &own
            }
        };
        let depth = wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(self.writes_depth),
            depth_compare: Some(self.depth),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        };
        context.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.fragment),
            layout: Some(layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(self.vertex),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: self.buffers,
            },
            primitive: wgpu::PrimitiveState {
                cull_mode: self.is_list.then_some(wgpu::Face::Back),
                ..Default::default()
            },
            depth_stencil: (!self.is_list).then_some(depth),
            multisample: wgpu::MultisampleState {
                count: if self.is_list { 1 } else { SAMPLES },
                ..Default::default()
            },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(self.fragment),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format,
                    blend: self.blends.then_some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                    write_mask: if self.is_list {
                        wgpu::ColorWrites::empty()
                    } else {
                        wgpu::ColorWrites::ALL
                    },
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// The layout of a buffer that holds one attribute per vertex, tightly packed.
pub(super) fn packed(attribute: &[wgpu::VertexAttribute; 1]) -> Option<wgpu::VertexBufferLayout<'_>> {
    Some(wgpu::VertexBufferLayout {
        array_stride: attribute[0].format.size(),
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: attribute,
    })
}
