//! Errors of the GPU.

use thiserror::Error;

/// A failure of the GPU, or of getting one.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GpuError {
    /// There is no usable GPU, or the browser does not give access to it.
    #[error("no GPU adapter: {0}; use a browser with WebGPU switched on and hardware acceleration allowed")]
    NoAdapter(String),
    /// The GPU could not be opened.
    #[error("the GPU cannot be opened: {0}; close other pages that use it")]
    NoDevice(String),
    /// WebGPU cannot draw to the canvas.
    #[error("the canvas cannot be drawn to with WebGPU: {0}")]
    NoSurface(String),
    /// There is no WebGPU, which volumes are drawn with.
    #[error(
        "the volume needs WebGPU, without which this viewer draws with WebGL 2; show slices or an isosurface instead"
    )]
    NeedsWebGpu,
    /// The mesh needs a larger buffer than the device allows.
    #[error(
        "the {what} need {bytes} bytes in one buffer and this GPU allows {limit}; raise the error or set a smaller \
         budget of tetrahedra"
    )]
    TooLarge {
        /// What the buffer contains.
        what: &'static str,
        /// The size of the buffer.
        bytes: u64,
        /// The largest size that the device allows.
        limit: u64,
    },
    /// The device is lost (driver reset, GPU unplugged, too little memory): make a new renderer, and give it to
    /// [`SceneRenderer::set_renderer`](crate::SceneRenderer::set_renderer).
    #[error("the GPU was lost: {0}; create the viewer again")]
    DeviceLost(String),
    /// The device refused an operation.
    #[error("the GPU refused an operation: {0}")]
    Refused(String),
}

impl tetralod::Coded for GpuError {
    fn code(&self) -> &'static str {
        match self {
            Self::NoAdapter(_) | Self::NoDevice(_) | Self::NoSurface(_) => "no-webgpu",
            Self::NeedsWebGpu => "needs-webgpu",
            Self::TooLarge { .. } => "too-large",
            Self::DeviceLost(_) => "device-lost",
            Self::Refused(_) => "gpu",
        }
    }
}

/// What the GPU gives.
pub(super) type Result<T, E = GpuError> = std::result::Result<T, E>;
