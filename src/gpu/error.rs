//! What can go wrong between this program and a GPU.

use std::fmt;

/// A failure of the GPU, or of getting one.
#[derive(Clone, Debug, PartialEq)]
pub enum GpuError {
    /// There is no usable GPU, or the browser does not give one.
    NoAdapter(String),
    /// The GPU refused to be opened.
    NoDevice(String),
    /// The canvas cannot be drawn to.
    NoSurface(String),
    /// The mesh needs a larger buffer than the device has.
    TooLarge {
        /// What the buffer was for.
        what: &'static str,
        /// How large it would have to be.
        bytes: u64,
        /// How large buffers can be.
        limit: u64,
    },
    /// The device is gone (driver reset, GPU unplugged, too little memory): a new renderer is needed.
    DeviceLost(String),
    /// The device refused an operation.
    Refused(String),
}

impl fmt::Display for GpuError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoAdapter(why) => write!(
                f,
                "no GPU adapter: {why}; use a browser with WebGPU switched on and hardware acceleration allowed"
            ),
            Self::NoDevice(why) => {
                write!(f, "the GPU cannot be opened: {why}; close other pages that use it")
            }
            Self::NoSurface(why) => write!(f, "the canvas cannot be drawn to with WebGPU: {why}"),
            Self::TooLarge { what, bytes, limit } => write!(
                f,
                "the {what} need {bytes} bytes in one buffer and this GPU allows {limit}; \
                 raise the error or set a smaller budget of tetrahedra"
            ),
            Self::DeviceLost(why) => write!(f, "the GPU was lost: {why}; create the viewer again"),
            Self::Refused(why) => write!(f, "the GPU refused an operation: {why}"),
        }
    }
}

impl std::error::Error for GpuError {}
