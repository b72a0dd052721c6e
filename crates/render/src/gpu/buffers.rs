//! Typed buffers that grow.

use crate::gpu::error::Result;
use crate::gpu::{Context, GpuError};
use bytemuck::Pod;
use std::borrow::Cow;
use std::marker::PhantomData;
use std::ops::Range;

/// A buffer of `T` on the GPU. It grows by doubling, so that a mesh that is refined step by step costs few
/// allocations, and is checked against the limits of the device.
#[derive(Debug)]
pub(super) struct GrowBuffer<T> {
    what: &'static str,
    usage: wgpu::BufferUsages,
    buffer: Option<wgpu::Buffer>,
    len: usize,
    of: PhantomData<T>,
}

impl<T: Pod> GrowBuffer<T> {
    /// An empty buffer; `what` names its content, in the plural.
    pub(super) fn new(what: &'static str, usage: wgpu::BufferUsages) -> Self {
        // Copies to buffers are in units of four bytes.
        const { assert!(size_of::<T>().is_multiple_of(4) && size_of::<T>() > 0) };
        Self { what, usage: usage | wgpu::BufferUsages::COPY_DST, buffer: None, len: 0, of: PhantomData }
    }

    /// Replaces the contents.
    pub(super) fn write(&mut self, context: &Context, items: &[T]) -> Result<()> {
        self.clear();
        self.update(context, items, &[])
    }

    /// Empties it; the memory is kept.
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    /// Makes the contents `items`, which differ from what is there in these ranges only, and in what lies beyond its end.
    /// When the buffer has to grow, all is written.
    pub(super) fn update(&mut self, context: &Context, items: &[T], changed: &[Range<u32>]) -> Result<()> {
        self.update_with(context, items.len(), changed, |range| Cow::Borrowed(&items[range]))
    }

    /// [`Self::update`] with `len` items that are made for a range when they are written.
    pub(super) fn update_with<'a>(
        &mut self,
        context: &Context,
        len: usize,
        changed: &[Range<u32>],
        items: impl Fn(Range<usize>) -> Cow<'a, [T]>,
    ) -> Result<()> {
        self.reserve(context, len)?;
        let Some(buffer) = &self.buffer else { return Ok(()) };
        for range in uploads(changed, self.len, len) {
            let items = items(range.clone());
            context.upload(buffer, range.start * size_of::<T>(), bytemuck::cast_slice(&items));
        }
        self.len = len;
        Ok(())
    }

    /// Makes room for so many items; what is there is lost if there is not.
    fn reserve(&mut self, context: &Context, len: usize) -> Result<()> {
        let bytes = (len * size_of::<T>()) as u64;
        if bytes <= self.buffer.as_ref().map_or(0, wgpu::Buffer::size) {
            return Ok(());
        }
        self.len = 0;
        let limit = context.largest_buffer(self.usage);
        let too_large = GpuError::TooLarge { what: self.what, bytes, limit };
        let size = grown(bytes, limit).ok_or(too_large)?;
        // Free the old memory before allocating more.
        if let Some(old) = self.buffer.take() {
            old.destroy();
        }
        self.buffer = Some(context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(self.what),
            size,
            usage: self.usage,
            mapped_at_creation: false,
        }));
        Ok(())
    }

    /// Bytes of memory on the GPU.
    pub(super) fn bytes(&self) -> u64 {
        self.buffer.as_ref().map_or(0, wgpu::Buffer::size)
    }

    /// The number of items.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// The contents for a group of bindings; `None` when empty.
    pub(super) fn binding(&self) -> Option<wgpu::BindingResource<'_>> {
        let buffer = self.buffer.as_ref().filter(|_| self.len > 0)?;
        let size = std::num::NonZeroU64::new((self.len * size_of::<T>()) as u64);
        Some(wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size }))
    }

    /// What there is to bind; `None` when empty.
    pub(super) fn slice(&self) -> Option<wgpu::BufferSlice<'_>> {
        let buffer = self.buffer.as_ref().filter(|_| self.len > 0)?;
        Some(buffer.slice(..(self.len * size_of::<T>()) as u64))
    }
}

/// Ranges as close as this are written at once: a call costs more than some items.
const GAP: usize = 512;

/// What has to be written of `len` items, of which `changed` and all from number `before` on are new.
fn uploads(changed: &[Range<u32>], before: usize, len: usize) -> Vec<Range<usize>> {
    let kept = before.min(len);
    let changed = changed.iter().map(|range| range.start as usize..(range.end as usize).min(kept));
    let mut uploads: Vec<Range<usize>> = Vec::new();
    for range in changed.chain(std::iter::once(before..len)).filter(|range| range.start < range.end) {
        match uploads.last_mut() {
            Some(last) if range.start <= last.end + GAP => last.end = last.end.max(range.end),
            _ => uploads.push(range),
        }
    }
    uploads
}

/// The size of a buffer for `bytes` with room to grow; `None` if the device has none that large.
fn grown(bytes: u64, limit: u64) -> Option<u64> {
    let limit = limit & !3;
    (bytes <= limit).then(|| bytes.checked_next_power_of_two().unwrap_or(limit).clamp(256, limit.max(256)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_close_together_is_written_at_once() {
        assert_eq!(uploads(&[], 10, 10), []);
        assert_eq!(uploads(&[], 20, 10), []);
        assert_eq!(uploads(&[0..64, 128..192, 5000..5064], 9000, 9000), [0..192, 5000..5064]);
        // Beyond the old end all is new; beyond the new one there is nothing.
        assert_eq!(uploads(std::slice::from_ref(&(64..128)), 3000, 4000), [64..128, 3000..4000]);
        assert_eq!(uploads(&[64..128, 3900..3964], 3000, 4000), [64..128, 3000..4000]);
        assert_eq!(uploads(&[64..128, 256..320], 300, 100).first(), Some(&(64..100)));
    }

    #[test]
    fn sizes_double_up_to_the_limit() {
        assert_eq!(grown(4, 1 << 20), Some(256));
        assert_eq!(grown(257, 1 << 20), Some(512));
        assert_eq!(grown(600_000, 1_000_002), Some(1_000_000));
        assert_eq!(grown(1_000_000, 1_000_002), Some(1_000_000));
        assert_eq!(grown(1_000_004, 1_000_002), None);
        assert_eq!(grown(u64::MAX, u64::MAX), None);
    }
}
