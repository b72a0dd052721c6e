//! Typed buffers that grow.

use crate::gpu::{Context, GpuError};
use bytemuck::Pod;
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
    pub(super) fn write(&mut self, context: &Context, items: &[T]) -> Result<(), GpuError> {
        self.len = 0;
        let bytes = size_of_val(items) as u64;
        let held = self.buffer.as_ref().map_or(0, wgpu::Buffer::size);
        if bytes > held {
            let size = grown(bytes, context.device.limits().max_buffer_size).ok_or_else(|| {
                GpuError::TooLarge { what: self.what, bytes, limit: context.device.limits().max_buffer_size }
            })?;
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
        }
        if let (Some(buffer), true) = (&self.buffer, bytes > 0) {
            context.queue.write_buffer(buffer, 0, bytemuck::cast_slice(items));
            self.len = items.len();
        }
        Ok(())
    }

    /// Makes the contents `items`, which differ from what is there in these ranges only, and in what lies beyond its end.
    /// When the buffer has to grow, all is written.
    pub(super) fn update(
        &mut self,
        context: &Context,
        items: &[T],
        changed: &[Range<u32>],
    ) -> Result<(), GpuError> {
        let held = self.buffer.as_ref().map_or(0, wgpu::Buffer::size);
        let Some(buffer) = self.buffer.as_ref().filter(|_| size_of_val(items) as u64 <= held) else {
            return self.write(context, items);
        };
        for range in uploads(changed, self.len, items.len()) {
            let bytes = bytemuck::cast_slice(&items[range.clone()]);
            context.queue.write_buffer(buffer, (range.start * size_of::<T>()) as u64, bytes);
        }
        self.len = items.len();
        Ok(())
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
