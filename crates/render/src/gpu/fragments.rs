//! Lists of what is not opaque, one for each pixel: where rays enter the volume, and colours of surfaces. See
//! `fragments.wgsl`.

use crate::gpu::Context;
use crate::gpu::pipeline::{Binding, UNUSED, begin_pass, group, group_layout};
use crate::gpu::target::{image, image_bytes};
use std::sync::{Arc, Mutex};

/// Room for so many fragments a pixel, on the average, to begin with.
const ROOM: u64 = 4;

/// Numbers a fragment.
const NODE: u64 = 3;

#[derive(Debug)]
pub(super) struct FragmentLists {
    pub(super) layout: wgpu::BindGroupLayout,
    lists: Option<Lists>,
    /// Fragments that there is to be room for.
    wanted: u64,
    /// Fragments of the last picture that was counted.
    counted: Arc<Mutex<Count>>,
}

#[derive(Clone, Copy, Debug, Default)]
enum Count {
    #[default]
    Idle,
    /// The count is being read.
    Reading,
    Of(u32),
}

/// The lists for pictures of one size.
#[derive(Debug)]
struct Lists {
    size: [u32; 2],
    room: u64,
    heads: wgpu::Buffer,
    nodes: wgpu::Buffer,
    count: wgpu::Buffer,
    /// A pass has to have an attachment; nothing is written to this one.
    unused: wgpu::TextureView,
    group: wgpu::BindGroup,
}

impl FragmentLists {
    pub(super) fn new(context: &Context) -> Self {
        let layout = group_layout(context, "lists of fragments", &[Binding::Write, Binding::Write]);
        Self { layout, lists: None, wanted: 0, counted: Arc::default() }
    }

    /// Empty lists for pictures of another target.
    pub(super) fn another(&self) -> Self {
        Self { layout: self.layout.clone(), lists: None, wanted: 0, counted: Arc::default() }
    }

    /// Begins the pass that fills the lists, for a picture of this size.
    pub(super) fn begin<'a>(
        &mut self,
        context: &Context,
        encoder: &'a mut wgpu::CommandEncoder,
        size: [u32; 2],
    ) -> wgpu::RenderPass<'a> {
        self.take_count();
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let largest = context.largest_buffer(wgpu::BufferUsages::STORAGE) / (4 * NODE);
        let room = (ROOM * pixels).max(self.wanted).min(largest);
        let layout = &self.layout;
        let fits = |lists: &Lists| lists.size == size && lists.room >= room;
        let lists = match self.lists.take().filter(fits) {
            Some(lists) => lists,
            None => Lists::new(context, layout, size, room),
        };
        encoder.clear_buffer(&lists.heads, 0, None);
        let lists = self.lists.insert(lists);
        let clear = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
        let label = "lists of fragments";
        let mut pass = begin_pass(encoder, label, &lists.unused, clear, wgpu::StoreOp::Discard);
        pass.set_bind_group(2, &lists.group, &[]);
        pass
    }

    /// `heads` and `nodes`, as the shaders call them.
    pub(super) fn buffers(&self) -> Option<[&wgpu::Buffer; 2]> {
        self.lists.as_ref().map(|lists| [&lists.heads, &lists.nodes])
    }

    /// Has the number of fragments counted that the picture needs; the commands of `encoder` come before
    /// [`FragmentLists::read_count`].
    pub(super) fn copy_count(&self, encoder: &mut wgpu::CommandEncoder) {
        if let (Some(lists), Ok(Count::Idle)) = (&self.lists, self.counted.lock().map(|count| *count)) {
            encoder.copy_buffer_to_buffer(&lists.heads, 0, &lists.count, 0, 4);
        }
    }

    /// Reads that number when it is there.
    pub(super) fn read_count(&self) {
        let Some(lists) = &self.lists else { return };
        let Ok(mut counted) = self.counted.lock() else { return };
        if !matches!(*counted, Count::Idle) {
            return;
        }
        *counted = Count::Reading;
        drop(counted);
        let (shared, buffer) = (self.counted.clone(), lists.count.clone());
        lists.count.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            let bytes = result.ok().and_then(|()| Some(buffer.slice(..).get_mapped_range().ok()?.to_vec()));
            buffer.unmap();
            let number = bytes.and_then(|bytes| Some(u32::from_le_bytes(bytes.try_into().ok()?)));
            if let Ok(mut counted) = shared.lock() {
                *counted = number.map_or(Count::Idle, Count::Of);
            }
        });
    }

    /// Frees the lists: a picture has been drawn that needs none.
    pub(super) fn clear(&mut self) {
        self.lists = None;
    }

    fn take_count(&mut self) {
        if let Ok(mut counted) = self.counted.lock()
            && let Count::Of(number) = *counted
        {
            // A little more than was needed: the next picture is a little different.
            self.wanted = self.wanted.max(u64::from(number) + u64::from(number) / 8);
            *counted = Count::Idle;
        }
    }

    /// Whether a picture that was counted had more fragments than room, and more room is to be had. Never for a picture without lists:
    /// drawing it again would change nothing.
    pub(super) fn is_short(&mut self, context: &Context) -> bool {
        self.take_count();
        let largest = context.largest_buffer(wgpu::BufferUsages::STORAGE) / (4 * NODE);
        self.lists.as_ref().is_some_and(|lists| lists.room < self.wanted.min(largest))
    }

    /// Bytes of memory on the GPU.
    pub(super) fn bytes(&self) -> u64 {
        self.lists.as_ref().map_or(0, |lists| lists.heads.size() + lists.nodes.size())
    }

    /// Bytes of the image that the pass has to have.
    pub(super) fn image_bytes(&self) -> u64 {
        self.lists.as_ref().map_or(0, |lists| image_bytes(&lists.unused))
    }
}

impl Lists {
    fn new(context: &Context, layout: &wgpu::BindGroupLayout, size: [u32; 2], room: u64) -> Self {
        use wgpu::BufferUsages as Usage;
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let buffer = |label, size, usage| {
            context.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let heads = Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC;
        let heads = buffer("lists of fragments", 4 * (pixels + 1), heads);
        let nodes = buffer("fragments", 4 * NODE * room.max(1), Usage::STORAGE);
        let group = group(context, layout, &[heads.as_entire_binding(), nodes.as_entire_binding()]);
        Self {
            size,
            room,
            heads,
            nodes,
            count: buffer("number of fragments", 4, Usage::COPY_DST | Usage::MAP_READ),
            unused: image(context, "nothing", size, UNUSED, 1, wgpu::TextureUsages::RENDER_ATTACHMENT),
            group,
        }
    }
}
