//! What all pipelines have in common: the uniform `frame`, groups of bindings, depth, samples.

use crate::gpu::target::DEPTH;
use crate::gpu::types::Frame;
use crate::gpu::{Context, SAMPLES, SHADERS};
use wgpu::{BindingType, BufferBindingType, ShaderStages};

/// The uniform of a frame, and the formats of a picture.
#[derive(Debug)]
pub(super) struct Common {
    buffer: wgpu::Buffer,
    pub(super) group: wgpu::BindGroup,
    layout: wgpu::BindGroupLayout,
    /// Of the picture that is drawn.
    pub(super) format: wgpu::TextureFormat,
}

/// The kinds of bindings that shaders have.
#[derive(Clone, Copy, Debug)]
pub(super) enum Binding {
    /// Read in vertex shaders.
    Vertices,
    /// Read in fragment shaders.
    Read,
    /// Read in both.
    Both,
    /// Written in fragment shaders.
    Write,
    /// A uniform.
    Uniform,
    /// The depths of all samples.
    Depths,
    /// A picture that is looked up smoothly.
    Picture,
    /// An image of numbers that are read as they are.
    Numbers,
    /// How it is looked up.
    Sampler,
}

impl Binding {
    fn entry(self, binding: u32) -> wgpu::BindGroupLayoutEntry {
        let buffer = |ty| BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        let texture = |sample_type, multisampled| BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled,
        };
        let read = buffer(BufferBindingType::Storage { read_only: true });
        let (visibility, ty) = match self {
            Self::Vertices => (ShaderStages::VERTEX, read),
            Self::Read => (ShaderStages::FRAGMENT, read),
            Self::Both => (ShaderStages::VERTEX_FRAGMENT, read),
            Self::Write => (ShaderStages::FRAGMENT, buffer(BufferBindingType::Storage { read_only: false })),
            Self::Uniform => (ShaderStages::VERTEX_FRAGMENT, buffer(BufferBindingType::Uniform)),
            Self::Depths => (ShaderStages::FRAGMENT, texture(wgpu::TextureSampleType::Depth, true)),
            Self::Picture | Self::Numbers => {
                let filterable = matches!(self, Self::Picture);
                (ShaderStages::FRAGMENT, texture(wgpu::TextureSampleType::Float { filterable }, false))
            }
            Self::Sampler => {
                (ShaderStages::FRAGMENT, BindingType::Sampler(wgpu::SamplerBindingType::Filtering))
            }
        };
        wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
    }
}

/// The layout of a group of these bindings, numbered from 0.
pub(super) fn group_layout(
    context: &Context,
    label: &'static str,
    bindings: &[Binding],
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0..).zip(bindings).map(|(i, binding)| binding.entry(i)).collect();
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries };
    context.device.create_bind_group_layout(&descriptor)
}

/// A group of these resources, numbered from 0.
pub(super) fn group(
    context: &Context,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries: Vec<_> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    let descriptor = wgpu::BindGroupDescriptor { label: None, layout, entries: &entries };
    context.device.create_bind_group(&descriptor)
}

/// A buffer for a uniform of type `T`.
pub(super) fn uniform<T>(context: &Context, label: &'static str) -> wgpu::Buffer {
    context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size_of::<T>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

impl Common {
    pub(super) fn new(context: &Context, format: wgpu::TextureFormat) -> Self {
        let buffer = uniform::<Frame>(context, "frame");
        let layout = group_layout(context, "frame", &[Binding::Uniform]);
        let group = group(context, &layout, &[buffer.as_entire_binding()]);
        Self { buffer, group, layout, format }
    }

    pub(super) fn write(&self, context: &Context, frame: &Frame) {
        context.queue.write_buffer(&self.buffer, 0, bytemuck::bytes_of(frame));
    }
}

/// What a pipeline does with its fragments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Output {
    /// Opaque colours in the picture, the nearest in front; of faces that are seen from the front, if so.
    Opaque { only_front: bool },
    /// Premultiplied colours over those of the picture, where the depth compares like this.
    Over(wgpu::CompareFunction),
    /// Entries in the lists of pixels: one fragment a pixel, no colour, no depth.
    List { only_front: bool },
    /// Premultiplied colours over a picture without samples and depth, with this weight: for the mean of pictures.
    Mean(wgpu::TextureFormat),
    /// The colours of a picture without samples and depth.
    Whole(wgpu::TextureFormat),
}

/// Begins a pass over a picture without samples and depth.
pub(super) fn begin_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    label: &str,
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
    store: wgpu::StoreOp,
) -> wgpu::RenderPass<'a> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store },
        })],
        ..Default::default()
    })
}

/// How one pipeline differs from the others.
#[derive(Clone, Copy)]
pub(super) struct PipelineSpec<'a> {
    pub shader: &'static str,
    pub vertex: &'static str,
    pub fragment: &'static str,
    pub buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    /// What shaders reach beside the frame: groups 1 and 2.
    pub groups: &'a [Option<&'a wgpu::BindGroupLayout>],
    pub output: Output,
}

/// The format of the attachment of passes that write lists alone.
pub(super) const UNUSED: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

impl<'a> PipelineSpec<'a> {
    /// A pipeline without buffers of vertices.
    pub(super) fn new(
        shader: &'static str,
        [vertex, fragment]: [&'static str; 2],
        groups: &'a [Option<&'a wgpu::BindGroupLayout>],
        output: Output,
    ) -> Self {
        Self { shader, vertex, fragment, buffers: &[], groups, output }
    }

    pub(super) fn create(&self, context: &Context, common: &Common) -> wgpu::RenderPipeline {
        let source = SHADERS.iter().find(|(name, _)| *name == self.shader).map_or("", |(_, source)| source);
        let module = context.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.shader),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let mut groups = vec![Some(&common.layout)];
        groups.extend(self.groups);
        let layout = context.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(self.shader),
            bind_group_layouts: &groups,
            immediate_size: 0,
        });
        let samples = if self.has_depth() { SAMPLES } else { 1 };
        context.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.fragment),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(self.vertex),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: self.buffers,
            },
            primitive: wgpu::PrimitiveState { cull_mode: self.culled(), ..Default::default() },
            depth_stencil: self.has_depth().then(|| self.depth()),
            multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(self.fragment),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(self.target(common.format))],
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    fn has_depth(&self) -> bool {
        matches!(self.output, Output::Opaque { .. } | Output::Over(_))
    }

    fn culled(&self) -> Option<wgpu::Face> {
        let only_front =
            matches!(self.output, Output::Opaque { only_front: true } | Output::List { only_front: true });
        only_front.then_some(wgpu::Face::Back)
    }

    fn depth(&self) -> wgpu::DepthStencilState {
        let (writes, compare) = match self.output {
            Output::Over(compare) => (false, compare),
            _ => (true, wgpu::CompareFunction::Less),
        };
        wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(writes),
            depth_compare: Some(compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }
    }

    fn target(&self, format: wgpu::TextureFormat) -> wgpu::ColorTargetState {
        use wgpu::{BlendComponent, BlendFactor, BlendOperation, BlendState, ColorWrites};
        // The weight of the new picture is the constant of the pass.
        let weighted = BlendComponent {
            src_factor: BlendFactor::Constant,
            dst_factor: BlendFactor::OneMinusConstant,
            operation: BlendOperation::Add,
        };
        let (format, blend, write_mask) = match self.output {
            Output::Opaque { .. } => (format, None, ColorWrites::ALL),
            Output::Over(_) => (format, Some(BlendState::PREMULTIPLIED_ALPHA_BLENDING), ColorWrites::ALL),
            Output::List { .. } => (UNUSED, None, ColorWrites::empty()),
            Output::Mean(format) => {
                (format, Some(BlendState { color: weighted, alpha: weighted }), ColorWrites::ALL)
            }
            Output::Whole(format) => (format, None, ColorWrites::ALL),
        };
        wgpu::ColorTargetState { format, blend, write_mask }
    }
}
