//! Brings finished pictures to where they are seen: adds each to the mean of those before, and shows the mean.

use crate::gpu::Context;
use crate::gpu::pipeline::{Binding, Common, Output, Pipeline, begin_pass, group, group_layout};
use crate::gpu::target::{Images, MEAN};

/// Where a finished picture is shown.
pub(super) struct PictureView<'a> {
    pub(super) view: &'a wgpu::TextureView,
    /// The only part that is changed: x, y, width and height in pixels.
    pub(super) part: Option<[u32; 4]>,
}

#[derive(Debug)]
pub(super) struct Presenter {
    mean: Pipeline,
    shown: Pipeline,
    layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
}

impl Presenter {
    pub(super) fn new(context: &Context, common: &Common) -> Self {
        let layout = group_layout(context, "present", &[Binding::Picture, Binding::Sampler]);
        let pipeline = |output| Pipeline::new("present", ["vs", "fs"], &[&layout], output);
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

    /// Adds the picture to the mean of `count` pictures before it, and shows the mean on `target`; without a count, the picture.
    pub(super) fn present(
        &self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        common: &Common,
        images: &Images,
        count: Option<u32>,
        target: &PictureView<'_>,
    ) {
        let kept_if = |is_kept| {
            if is_kept { wgpu::LoadOp::Load } else { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) }
        };
        let added = count.map(|count| (&self.mean, &images.resolved, &images.mean, kept_if(count > 0), None));
        let finished = if count.is_some() { &images.mean } else { &images.resolved };
        let shown = (&self.shown, finished, target.view, kept_if(target.part.is_some()), target.part);
        let weight = 1.0 / f64::from(count.unwrap_or(0) + 1);
        for (pipeline, from, to, load, part) in added.into_iter().chain([shown]) {
            let resources =
                [wgpu::BindingResource::TextureView(from), wgpu::BindingResource::Sampler(&self.sampler)];
            let mut pass = begin_pass(encoder, "present", to, load, wgpu::StoreOp::Store);
            if let Some([x, y, width, height]) = part {
                pass.set_scissor_rect(x, y, width, height);
            }
            pass.set_pipeline(pipeline.get(context, common, None));
            pass.set_blend_constant(wgpu::Color { r: weight, g: weight, b: weight, a: weight });
            pass.set_bind_group(0, &common.group, &[]);
            pass.set_bind_group(1, &group(context, &self.layout, &resources), &[]);
            pass.draw(0..3, 0..1);
        }
    }
}
