//! Typed buffers that grow.

use crate::gpu::{Context, GpuError};
use bytemuck::Pod;
use std::marker::PhantomData;

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
    /// An empty buffer; `what` says in the plural what it holds.
    pub(super) fn new(what: &'static str, usage: wgpu::BufferUsages) -> Self {
        // Copies to buffers come in units of four bytes.
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
            // Give the old memory back before asking for more.
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

    /// The number of items.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// What there is to bind; `None` when empty.
    pub(super) fn slice(&self) -> Option<wgpu::BufferSlice<'_>> {
        let buffer = self.buffer.as_ref().filter(|_| self.len > 0)?;
        Some(buffer.slice(..(self.len * size_of::<T>()) as u64))
    }
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
    fn sizes_double_up_to_the_limit() {
        assert_eq!(grown(4, 1 << 20), Some(256));
        assert_eq!(grown(257, 1 << 20), Some(512));
        assert_eq!(grown(600_000, 1_000_002), Some(1_000_000));
        assert_eq!(grown(1_000_000, 1_000_002), Some(1_000_000));
        assert_eq!(grown(1_000_004, 1_000_002), None);
        assert_eq!(grown(u64::MAX, u64::MAX), None);
    }
}
