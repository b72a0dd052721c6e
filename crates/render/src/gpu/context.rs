//! The device, and its errors.

use crate::gpu::GpuError;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// An open device. Copies are of the same one.
#[derive(Clone, Debug)]
pub struct Context {
    pub(super) adapter: wgpu::Adapter,
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    trouble: Trouble,
    /// Bytes written to buffers since the last question.
    uploaded: Arc<AtomicU64>,
}

/// The first thing that the device complained about; it calls back at times of its own choice.
#[derive(Clone, Debug, Default)]
struct Trouble(Arc<Mutex<Option<GpuError>>>);

impl Trouble {
    fn note(&self, error: GpuError) {
        if let Ok(mut place) = self.0.lock() {
            // A lost device matters more than the errors that follow from it.
            let lost = matches!(error, GpuError::DeviceLost(_));
            if place.is_none() || (lost && !matches!(*place, Some(GpuError::DeviceLost(_)))) {
                *place = Some(error);
            }
        }
    }

    fn take(&self) -> Option<GpuError> {
        let mut place = self.0.lock().ok()?;
        match &*place {
            // Lost stays lost.
            Some(GpuError::DeviceLost(_)) => place.clone(),
            _ => place.take(),
        }
    }
}

impl Context {
    /// Opens a device without a surface, for drawing into images.
    ///
    /// # Errors
    /// If there is no adapter or it cannot be opened.
    pub async fn headless() -> Result<Self, GpuError> {
        Self::open(&instance()?, None).await
    }

    /// Opens a device that can draw to `target`, such as a canvas, and the surface to draw on.
    ///
    /// # Errors
    /// If there is no adapter, it cannot be opened, or the canvas is already used by something else.
    pub async fn with_surface(
        target: impl Into<wgpu::SurfaceTarget<'static>>,
    ) -> Result<(Self, wgpu::Surface<'static>), GpuError> {
        let instance = instance()?;
        let surface = surface(&instance, target)?;
        let context = Self::open(&instance, Some(&surface)).await?;
        Ok((context, surface))
    }

    /// Another surface to draw on.
    pub(super) fn surface(
        target: impl Into<wgpu::SurfaceTarget<'static>>,
    ) -> Result<wgpu::Surface<'static>, GpuError> {
        surface(&instance()?, target)
    }

    async fn open(instance: &wgpu::Instance, surface: Option<&wgpu::Surface<'_>>) -> Result<Self, GpuError> {
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: surface,
            ..Default::default()
        };
        let adapter = instance
            .request_adapter(&options)
            .await
            .map_err(|error| GpuError::NoAdapter(error.to_string()))?;
        // The default limits of WebGPU, but with the largest buffers of this device: meshes are large.
        let offered = adapter.limits();
        let limits = wgpu::Limits {
            max_buffer_size: offered.max_buffer_size,
            max_storage_buffer_binding_size: offered.max_storage_buffer_binding_size,
            max_texture_dimension_2d: offered.max_texture_dimension_2d,
            ..wgpu::Limits::default()
        };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("tetralod"),
            required_limits: limits.clone().or_worse_values_from(&offered),
            ..Default::default()
        };
        let (device, queue) = adapter
            .request_device(&descriptor)
            .await
            .map_err(|error| GpuError::NoDevice(error.to_string()))?;
        Ok(Self::of(adapter, device, queue))
    }

    /// A device that somebody else has opened.
    pub fn of(adapter: wgpu::Adapter, device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let trouble = Trouble::default();
        let (lost, refused) = (trouble.clone(), trouble.clone());
        device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                lost.note(GpuError::DeviceLost(message));
            }
        });
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            refused.note(GpuError::Refused(error.to_string()));
        }));
        Self { adapter, device, queue, trouble, uploaded: Arc::default() }
    }

    /// Writes to a buffer, and counts what is written.
    pub(super) fn upload(&self, buffer: &wgpu::Buffer, offset: usize, bytes: &[u8]) {
        self.queue.write_buffer(buffer, offset as u64, bytes);
        self.uploaded.fetch_add(bytes.len() as u64, Ordering::Relaxed);
    }

    /// Bytes written to buffers of meshes and surfaces since the last call.
    pub(super) fn take_uploaded(&self) -> u64 {
        self.uploaded.swap(0, Ordering::Relaxed)
    }

    /// The size of the largest buffer that can be used like this.
    pub(super) fn largest_buffer(&self, usage: wgpu::BufferUsages) -> u64 {
        let limits = self.device.limits();
        let is_storage = usage.contains(wgpu::BufferUsages::STORAGE);
        let largest = limits.max_buffer_size;
        if is_storage { largest.min(limits.max_storage_buffer_binding_size) } else { largest }
    }

    /// Whether the processor draws, and no GPU.
    pub(super) fn is_software(&self) -> bool {
        self.adapter.get_info().device_type == wgpu::DeviceType::Cpu
    }

    /// The GPU and its driver in words.
    pub fn description(&self) -> String {
        let info = self.adapter.get_info();
        [info.name, info.driver, info.driver_info]
            .into_iter()
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// What the device has complained about since the last call.
    ///
    /// # Errors
    /// The complaint; a lost device complains every time.
    pub fn check(&self) -> Result<(), GpuError> {
        self.trouble.take().map_or(Ok(()), Err)
    }
}

fn surface(
    instance: &wgpu::Instance,
    target: impl Into<wgpu::SurfaceTarget<'static>>,
) -> Result<wgpu::Surface<'static>, GpuError> {
    instance.create_surface(target).map_err(|error| GpuError::NoSurface(error.to_string()))
}

fn instance() -> Result<wgpu::Instance, GpuError> {
    if wgpu::Instance::enabled_backend_features().is_empty() {
        let why = "this build has no backend of wgpu for this platform";
        return Err(GpuError::NoAdapter(why.to_owned()));
    }
    Ok(wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn complaints_are_told_once_and_losses_always() {
        let trouble = Trouble::default();
        assert_eq!(trouble.take(), None);
        let refused = |s: &str| GpuError::Refused(s.to_owned());
        trouble.note(refused("first"));
        trouble.note(refused("second"));
        assert_eq!(trouble.take(), Some(refused("first")));
        assert_eq!(trouble.take(), None);
        trouble.note(refused("third"));
        trouble.note(GpuError::DeviceLost("gone".to_owned()));
        trouble.note(refused("fourth"));
        for _ in 0..2 {
            assert_eq!(trouble.take(), Some(GpuError::DeviceLost("gone".to_owned())));
        }
    }
}
