//! Shade in hollows: takes light away from what is opaque, by what is near it on the screen. See `shade.wgsl`.

use crate::gpu::Context;
use crate::gpu::pipeline::{Binding, Common, Output, Pipeline, begin_pass, group, group_layout, uniform};
use crate::gpu::target::{image, image_bytes};

/// Of the shade of each pixel, and the depth that it is for.
const FOUND: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Float;

/// The uniform `settings`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct Settings {
    shade: [f32; 4],
}

/// Made when shade is drawn first.
#[derive(Debug)]
pub(super) struct ShadePass {
    find: Pipeline,
    /// For the nearest surface in a pixel, and for what is behind it.
    apply: [Pipeline; 2],
    /// Of both steps: the second one also reads what the first one has found.
    layouts: [wgpu::BindGroupLayout; 2],
    uniform: wgpu::Buffer,
    found: Option<wgpu::TextureView>,
}

impl ShadePass {
    pub(super) fn new(context: &Context) -> Self {
        use Binding::{Depths, Numbers, Uniform};
        let layouts = [
            group_layout(context, "shade", &[Uniform, Depths]),
            group_layout(context, "shade that was found", &[Uniform, Depths, Numbers]),
        ];
        let pipeline = |layout: &wgpu::BindGroupLayout, fragment, output| {
            Pipeline::new("shade", ["vs", fragment], &[layout], output)
        };
        let over = Output::Over(wgpu::CompareFunction::Always);
        Self {
            find: pipeline(&layouts[0], "fs", Output::Whole(FOUND)),
            apply: ["fs_nearest", "fs_behind"].map(|fragment| pipeline(&layouts[1], fragment, over)),
            layouts,
            uniform: uniform::<Settings>(context, "settings of the shade"),
            found: None,
        }
    }

    /// Bytes of memory on the GPU.
    pub(super) fn bytes(&self) -> u64 {
        self.found.as_ref().map_or(0, image_bytes)
    }

    /// Finds the shade of a picture of this size, with these depths.
    pub(super) fn find(
        &mut self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        common: &Common,
        (size, depth): ([u32; 2], &wgpu::TextureView),
        [strength, radius]: [f32; 2],
    ) {
        let settings = Settings { shade: [strength, radius, 0.0, 0.0] };
        context.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&settings));
        let fits = |view: &wgpu::TextureView| [view.texture().width(), view.texture().height()] == size;
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
        let found = match self.found.take().filter(fits) {
            Some(found) => found,
            None => image(context, "shade", size, FOUND, 1, usage),
        };
        let found = self.found.insert(found);
        let clear = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
        let mut pass = begin_pass(encoder, "shade", found, clear, wgpu::StoreOp::Store);
        let resources = [self.uniform.as_entire_binding(), wgpu::BindingResource::TextureView(depth)];
        pass.set_pipeline(self.find.get(context, common, None));
        pass.set_bind_group(0, &common.group, &[]);
        pass.set_bind_group(1, &group(context, &self.layouts[0], &resources), &[]);
        pass.draw(0..3, 0..1);
    }

    /// Lays the shade that was found over what is opaque.
    pub(super) fn draw(
        &self,
        (context, common): (&Context, &Common),
        depth: &wgpu::TextureView,
        pass: &mut wgpu::RenderPass<'_>,
    ) {
        let Some(found) = &self.found else { return };
        let view = wgpu::BindingResource::TextureView;
        let resources = [self.uniform.as_entire_binding(), view(depth), view(found)];
        pass.set_bind_group(1, &group(context, &self.layouts[1], &resources), &[]);
        for pipeline in &self.apply {
            pass.set_pipeline(pipeline.get(context, common, None));
            pass.draw(0..3, 0..1);
        }
    }
}
