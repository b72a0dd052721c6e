//! The target of drawing: a canvas, or an image that can be read back.

use crate::gpu::{Context, GpuError, SAMPLES};
use std::future::poll_fn;
use std::sync::{Arc, Mutex};
use std::task::{Poll, Waker};

pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The place where finished pictures appear, and the multisampled images that they are made in.
#[derive(Debug)]
pub(super) struct Target {
    place: Place,
    pub(super) size: [u32; 2],
    /// Of the images that pictures are made in; they are stretched to `size`.
    pub(super) drawn_size: [u32; 2],
    pub(super) format: wgpu::TextureFormat,
    pub(super) images: Images,
}

/// What a picture is made in.
#[derive(Debug)]
pub(super) struct Images {
    /// Colours of all samples, where a pixel has more than one; and depths.
    pub(super) samples: Option<wgpu::TextureView>,
    pub(super) depth: wgpu::TextureView,
    /// The colours of pixels; then the mean of several such pictures.
    pub(super) resolved: wgpu::TextureView,
    pub(super) mean: wgpu::TextureView,
}

/// Of the mean of several pictures: fine enough that one picture comes out as it went in.
pub(super) const MEAN: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

#[derive(Debug)]
enum Place {
    Canvas {
        surface: wgpu::Surface<'static>,
        configured: bool,
    },
    Image(wgpu::Texture),
    /// The caller gives a view for each picture.
    Given,
}

/// A picture being drawn.
pub(super) enum Picture {
    Canvas(wgpu::SurfaceTexture),
    Image(wgpu::Texture),
}

impl Picture {
    pub(super) fn view(&self) -> wgpu::TextureView {
        let texture = match self {
            Self::Canvas(texture) => &texture.texture,
            Self::Image(texture) => texture,
        };
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }
}

impl Target {
    pub(super) fn canvas(
        context: &Context,
        surface: wgpu::Surface<'static>,
        size: [u32; 2],
    ) -> Result<Self, GpuError> {
        let formats = surface.get_capabilities(&context.adapter).formats;
        // Shaders encode sRGB themselves, so that canvases and images get the same bytes.
        let format = formats
            .iter()
            .find(|f| matches!(f, wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Rgba8Unorm))
            .copied()
            .ok_or_else(|| GpuError::NoSurface("it offers no format of 8 bits a channel".to_owned()))?;
        let size = held(context, size);
        let place = Place::Canvas { surface, configured: false };
        Ok(Self::new(context, place, size, format))
    }

    pub(super) fn image(context: &Context, size: [u32; 2]) -> Self {
        let (size, format) = (held(context, size), wgpu::TextureFormat::Rgba8Unorm);
        Self::new(context, Place::Image(picture(context, size, format)), size, format)
    }

    /// For pictures in views that the caller gives.
    pub(super) fn given(context: &Context, size: [u32; 2], format: wgpu::TextureFormat) -> Self {
        Self::new(context, Place::Given, held(context, size), format)
    }

    fn new(context: &Context, place: Place, size: [u32; 2], format: wgpu::TextureFormat) -> Self {
        Self { place, size, drawn_size: size, format, images: Images::new(context, size, format, SAMPLES) }
    }

    /// Gives the target another size.
    pub(super) fn resize(&mut self, context: &Context, size: [u32; 2]) {
        let size = held(context, size);
        if size == self.size {
            return;
        }
        match &mut self.place {
            Place::Canvas { configured, .. } => *configured = false,
            Place::Given => {}
            Place::Image(image) => *image = picture(context, size, self.format),
        }
        self.size = size;
        self.scale(context, 1.0);
    }

    /// Draws pictures of this part of the size in each direction.
    pub(super) fn scale(&mut self, context: &Context, scale: f64) {
        let size = held(context, self.size.map(|s| (f64::from(s) * scale).round() as u32));
        if size != self.drawn_size {
            self.drawn_size = size;
            self.images = Images::new(context, size, self.format, self.images.count());
        }
    }

    /// Draws pictures with so many samples a pixel.
    pub(super) fn set_samples(&mut self, context: &Context, count: u32) {
        if count != self.images.count() {
            self.images = Images::new(context, self.drawn_size, self.format, count);
        }
    }

    /// Whether pictures are made with as many pixels as the target has.
    pub(super) fn is_whole(&self) -> bool {
        self.drawn_size == self.size
    }

    /// The next picture; `None` if the target is not available now.
    pub(super) fn next(&mut self, context: &Context) -> Result<Option<Picture>, GpuError> {
        let (format, size) = (self.format, self.size);
        let (surface, configured) = match &mut self.place {
            Place::Image(image) => return Ok(Some(Picture::Image(image.clone()))),
            Place::Given => return Ok(None),
            Place::Canvas { surface, configured } => (surface, configured),
        };
        // A surface that has changed is configured again, once; a second failure is an error.
        for _ in 0..2 {
            if !*configured {
                configure(context, surface, format, size)?;
                *configured = true;
            }
            match surface.get_current_texture() {
                wgpu::CurrentSurfaceTexture::Success(texture) => return Ok(Some(Picture::Canvas(texture))),
                wgpu::CurrentSurfaceTexture::Suboptimal(texture) => {
                    *configured = false;
                    return Ok(Some(Picture::Canvas(texture)));
                }
                wgpu::CurrentSurfaceTexture::Timeout | wgpu::CurrentSurfaceTexture::Occluded => {
                    return Ok(None);
                }
                wgpu::CurrentSurfaceTexture::Outdated | wgpu::CurrentSurfaceTexture::Lost => {
                    *configured = false
                }
                wgpu::CurrentSurfaceTexture::Validation => break,
            }
        }
        context.check()?;
        Err(GpuError::NoSurface("it gives no texture to draw on".to_owned()))
    }

    /// Reads the image back: `RGBA` bytes, rows from top to bottom.
    pub(super) async fn read(&self, context: &Context) -> Result<Vec<u8>, GpuError> {
        let Place::Image(image) = &self.place else {
            return Err(GpuError::Refused("a canvas is read by the page, not here".to_owned()));
        };
        let [width, height] = self.size;
        // Rows in buffers start at multiples of 256 bytes.
        let row = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: Some(height) };
        encoder.copy_texture_to_buffer(
            image.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            image.size(),
        );
        context.queue.submit([encoder.finish()]);
        map(context, &buffer).await?;
        let refused = |error: wgpu::MapRangeError| GpuError::Refused(error.to_string());
        let bytes = buffer.slice(..).get_mapped_range().map_err(refused)?;
        Ok(bytes.chunks_exact(row as usize).flat_map(|r| &r[..width as usize * 4]).copied().collect())
    }
}

/// Waits until a buffer can be read.
async fn map(context: &Context, buffer: &wgpu::Buffer) -> Result<(), GpuError> {
    type Answer = (Option<Result<(), wgpu::BufferAsyncError>>, Option<Waker>);
    let shared = Arc::new(Mutex::new(Answer::default()));
    let answer = shared.clone();
    buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
        if let Ok(mut place) = answer.lock() {
            place.0 = Some(result);
            if let Some(waker) = place.1.take() {
                waker.wake();
            }
        }
    });
    // Native devices call back from here, browsers on their own.
    let failed = |why: String| GpuError::Refused(format!("the picture cannot be read back: {why}"));
    context.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| failed(e.to_string()))?;
    let result = poll_fn(|task| match shared.lock() {
        Ok(mut place) => match place.0.take() {
            Some(result) => Poll::Ready(result.map_err(|e| failed(e.to_string()))),
            None => {
                place.1 = Some(task.waker().clone());
                Poll::Pending
            }
        },
        Err(poisoned) => Poll::Ready(Err(failed(poisoned.to_string()))),
    });
    result.await
}

fn configure(
    context: &Context,
    surface: &wgpu::Surface<'_>,
    format: wgpu::TextureFormat,
    [width, height]: [u32; 2],
) -> Result<(), GpuError> {
    let mut config = surface
        .get_default_config(&context.adapter, width, height)
        .ok_or_else(|| GpuError::NoSurface("this GPU cannot draw on it".to_owned()))?;
    config.format = format;
    // Pictures with a transparent background are premultiplied; where the canvas cannot show them, it is opaque. Canvases of pages
    // can, though wgpu does not list it.
    let modes = surface.get_capabilities(&context.adapter).alpha_modes;
    let premultiplied = wgpu::CompositeAlphaMode::PreMultiplied;
    let is_offered = cfg!(target_arch = "wasm32") || modes.contains(&premultiplied);
    config.alpha_mode = if is_offered { premultiplied } else { wgpu::CompositeAlphaMode::Opaque };
    surface.configure(&context.device, &config);
    Ok(())
}

/// `size`, but at least one pixel and at most what the device can draw.
fn held(context: &Context, size: [u32; 2]) -> [u32; 2] {
    size.map(|s| s.clamp(1, context.device.limits().max_texture_dimension_2d))
}

/// The image that a headless renderer draws into.
fn picture(context: &Context, size: [u32; 2], format: wgpu::TextureFormat) -> wgpu::Texture {
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    texture(context, "picture", size, format, 1, usage)
}

impl Images {
    fn new(context: &Context, size: [u32; 2], format: wgpu::TextureFormat, count: u32) -> Self {
        use wgpu::TextureUsages as Usage;
        let bound = Usage::RENDER_ATTACHMENT | Usage::TEXTURE_BINDING;
        let view = |label, format, samples, usage| image(context, label, size, format, samples, usage);
        Self {
            samples: (count > 1).then(|| view("samples", format, count, Usage::RENDER_ATTACHMENT)),
            depth: view("depth", DEPTH, count, bound),
            resolved: view("resolved", format, 1, bound),
            mean: view("mean", MEAN, 1, bound),
        }
    }

    /// Samples a pixel.
    fn count(&self) -> u32 {
        self.depth.texture().sample_count()
    }

    /// Bytes of memory on the GPU.
    pub(super) fn bytes(&self) -> u64 {
        [&self.depth, &self.resolved, &self.mean].into_iter().chain(&self.samples).map(image_bytes).sum()
    }
}

/// Bytes of memory on the GPU of an image that is seen as a whole.
pub(super) fn image_bytes(view: &wgpu::TextureView) -> u64 {
    let image = view.texture();
    let pixels = u64::from(image.width()) * u64::from(image.height()) * u64::from(image.sample_count());
    pixels * u64::from(image.format().block_copy_size(None).unwrap_or(0))
}

/// A new image, seen as a whole.
pub(super) fn image(
    context: &Context,
    label: &str,
    size: [u32; 2],
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureView {
    let texture = texture(context, label, size, format, sample_count, usage);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn texture(
    context: &Context,
    label: &str,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
