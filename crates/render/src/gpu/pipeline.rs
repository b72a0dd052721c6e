//! What all pipelines have in common: the uniform `frame`, groups of bindings, depth, samples.

use crate::draw::{Colouring, Lighting, Style};
use crate::gpu::target::DEPTH;
use crate::gpu::types::Frame;
use crate::gpu::{Context, SAMPLES, SHADERS};
use std::sync::OnceLock;
use wgpu::{BindingType, BufferBindingType, ShaderStages};

/// The uniform of a frame, and the formats of a picture.
#[derive(Debug)]
pub(super) struct Common {
    buffer: wgpu::Buffer,
    pub(super) group: wgpu::BindGroup,
    layout: wgpu::BindGroupLayout,
    /// Of the picture that is drawn, with its samples a pixel.
    pub(super) format: wgpu::TextureFormat,
    pub(super) samples: u32,
    /// Of the shaders, made when they are needed first.
    modules: [OnceLock<wgpu::ShaderModule>; SHADERS.len()],
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
        Self { buffer, group, layout, format, samples: SAMPLES, modules: Default::default() }
    }

    fn module(&self, context: &Context, shader: &'static str) -> &wgpu::ShaderModule {
        let number = SHADERS.iter().position(|(name, _)| *name == shader).unwrap_or_default();
        self.modules[number].get_or_init(|| {
            context.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(shader),
                source: wgpu::ShaderSource::Wgsl(SHADERS[number].1.into()),
            })
        })
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

/// The format of the attachment of passes that write lists alone.
pub(super) const UNUSED: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// What a style takes of the shaders of surfaces and tetrahedra. They are compiled for it: software goes through both sides of each branch.
/// Twin: the constants at the top of `shading.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Variant {
    pub light: Lighting,
    /// Whether values give colours.
    pub has_values: bool,
    pub has_edges: bool,
    pub has_clips: bool,
    /// Whether it may be displaced.
    pub has_moves: bool,
}

impl Variant {
    const COUNT: usize = 48;

    /// Of shaders that take no more of it: what may be displaced.
    pub(super) const MOVES: Self = Self {
        light: Lighting::None,
        has_values: false,
        has_edges: false,
        has_clips: false,
        has_moves: true,
    };

    /// That of a style, in pictures with clip planes or without.
    pub(super) fn new(style: &Style, has_clips: bool, has_moves: bool) -> Self {
        Self {
            light: style.lighting,
            has_values: matches!(style.colouring, Colouring::Scale(_)),
            has_edges: style.edges.is_some_and(|edges| edges.width > 0.0),
            has_clips: has_clips && style.clips != 0,
            has_moves,
        }
    }

    fn number(self) -> usize {
        let flags = [self.has_values, self.has_edges, self.has_clips, self.has_moves];
        flags.iter().fold(self.light as usize, |number, flag| 2 * number + usize::from(*flag))
    }

    /// The constants that are not what shaders have without them: those that have no such constant take none.
    fn constants(self) -> Vec<(&'static str, f64)> {
        let flags = [
            ("HAS_VALUES", self.has_values),
            ("HAS_EDGES", self.has_edges),
            ("HAS_CLIPS", self.has_clips),
            ("HAS_MOVES", self.has_moves),
        ];
        let flags = flags.into_iter().filter(|(_, is_set)| *is_set).map(|(name, _)| (name, 1.0));
        let light = (self.light != Lighting::None).then_some(("LIGHT", f64::from(self.light as u8)));
        light.into_iter().chain(flags).collect()
    }
}

/// A pipeline, and how it differs from the others. It is made when something is drawn with it first, for each number of samples and each
/// variant: to compile one takes a while.
#[derive(Debug)]
pub(super) struct Pipeline {
    shader: &'static str,
    vertex: &'static str,
    fragment: &'static str,
    buffers: &'static [Option<wgpu::VertexBufferLayout<'static>>],
    /// What shaders reach beside the frame: groups 1 and 2.
    groups: Vec<wgpu::BindGroupLayout>,
    output: Output,
    /// With one sample, then with all of them: without a variant, then each of them.
    made: Vec<OnceLock<wgpu::RenderPipeline>>,
}

impl Pipeline {
    /// A pipeline without buffers of vertices.
    pub(super) fn new(
        shader: &'static str,
        [vertex, fragment]: [&'static str; 2],
        groups: &[&wgpu::BindGroupLayout],
        output: Output,
    ) -> Self {
        let groups = groups.iter().map(|&layout| layout.clone()).collect();
        let made = vec![OnceLock::new(); 2 * (Variant::COUNT + 1)];
        Self { shader, vertex, fragment, buffers: &[], groups, output, made }
    }

    /// The same with these buffers.
    pub(super) fn with_buffers(self, buffers: &'static [Option<wgpu::VertexBufferLayout<'static>>]) -> Self {
        Self { buffers, ..self }
    }

    /// It, for pictures with the samples that `common` says; of the variant, if its shader has some.
    pub(super) fn get(
        &self,
        context: &Context,
        common: &Common,
        variant: Option<Variant>,
    ) -> &wgpu::RenderPipeline {
        let samples = if self.has_depth() { common.samples } else { 1 };
        let number = variant.map_or(0, |variant| variant.number() + 1);
        let place = number + if samples == 1 { 0 } else { Variant::COUNT + 1 };
        self.made[place].get_or_init(|| self.create(context, common, samples, variant))
    }

    fn create(
        &self,
        context: &Context,
        common: &Common,
        samples: u32,
        variant: Option<Variant>,
    ) -> wgpu::RenderPipeline {
        let module = common.module(context, self.shader);
        let groups: Vec<_> = [&common.layout].into_iter().chain(&self.groups).map(Some).collect();
        let layout = context.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(self.shader),
            bind_group_layouts: &groups,
            immediate_size: 0,
        });
        let constants = variant.map(Variant::constants);
        let compilation_options = wgpu::PipelineCompilationOptions {
            constants: constants.as_deref().unwrap_or_default(),
            ..Default::default()
        };
        context.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.fragment),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(self.vertex),
                compilation_options: compilation_options.clone(),
                buffers: self.buffers,
            },
            primitive: wgpu::PrimitiveState { cull_mode: self.culled(), ..Default::default() },
            depth_stencil: self.has_depth().then(|| self.depth()),
            multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(self.fragment),
                compilation_options,
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
