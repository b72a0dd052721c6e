//! Brings finished pictures to where they are seen: adds each to the mean of those before, and shows the mean.

use crate::gpu::Context;
use crate::gpu::pipeline::{Binding, Common, Output, PipelineSpec, begin_pass, group, group_layout};
use crate::gpu::target::{Images, MEAN};

/// Where a finished picture is shown.
pub(super) struct PictureView<'a> {
    pub(super) view: &'a wgpu::TextureView,
    /// The only part that is changed: x, y, width and height in pixels.
    pub(super) part: Option<[u32; 4]>,
}

#[derive(Debug)]
pub(super) struct Presenter {
    mean: wgpu::RenderPipeline,
    shown: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
}

impl Presenter {
    pub(super) fn new(context: &Context, common: &Common) -> Self {
        let layout = group_layout(context, "present", &[Binding::Picture, Binding::Sampler]);
        let pipeline = |output| {
            PipelineSpec::new("present", ["vs", "fs"], &[Some(&layout)], output).create(context, common)
        };
        let sampler = context.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("smooth"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self {
            mean: pipeline(Output::Mean(MEAN)),
            shown: pipeline(Output::Whole(common.format)),
            layout,
            sampler,
        }
    }

    /// Adds the picture to the mean of `count` pictures before it, and shows the mean on `target`.
    pub(super) fn present(
        &self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        common: &Common,
        images: &Images,
        count: u32,
        target: &PictureView<'_>,
    ) {
        let load =
            if count == 0 { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
        let clear = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
        let shown = if target.part.is_some() { wgpu::LoadOp::Load } else { clear };
        let steps = [
            (&self.mean, &images.resolved, &images.mean, load, None),
            (&self.shown, &images.mean, target.view, shown, target.part),
        ];
        let weight = 1.0 / f64::from(count + 1);
        for (pipeline, from, to, load, part) in steps {
            let resources =
                [wgpu::BindingResource::TextureView(from), wgpu::BindingResource::Sampler(&self.sampler)];
            let mut pass = begin_pass(encoder, "present", to, load, wgpu::StoreOp::Store);
            if let Some([x, y, width, height]) = part {
                pass.set_scissor_rect(x, y, width, height);
            }
            pass.set_pipeline(pipeline);
            pass.set_blend_constant(wgpu::Color { r: weight, g: weight, b: weight, a: weight });
            pass.set_bind_group(0, &common.group, &[]);
            pass.set_bind_group(1, &group(context, &self.layout, &resources), &[]);
            pass.draw(0..3, 0..1);
        }
    }
}
