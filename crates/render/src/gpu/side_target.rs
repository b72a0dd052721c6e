//! Pictures of another size beside those on the renderer's own target.

use crate::draw::Look;
use crate::gpu::fragments::FragmentLists;
use crate::gpu::target::Target;
use crate::gpu::{Context, GpuError, Renderer};
use std::mem::{replace, swap};
use tetralod::geom::Camera;

/// Another target of a renderer, with lists of its own: a large picture must not make those of the canvas large.
#[derive(Debug)]
pub struct SideTarget {
    target: Target,
    lists: FragmentLists,
}

impl Renderer {
    /// The largest width and height of a picture that the device can draw.
    pub fn largest_picture(&self) -> u32 {
        self.context.device.limits().max_texture_dimension_2d
    }

    /// Another target of this many pixels, held as in [`Renderer::resize`], such as a canvas that is not shown.
    ///
    /// # Errors
    /// If it cannot be drawn to.
    pub fn side_target(
        &self,
        target: impl Into<wgpu::SurfaceTarget<'static>>,
        size: [u32; 2],
    ) -> Result<SideTarget, GpuError> {
        let surface = Context::surface(target)?;
        let target = Target::canvas(&self.context, surface, size)?;
        Ok(SideTarget { target, lists: self.lists.another() })
    }

    /// Draws a picture on another target, as the mean of `samples`.
    ///
    /// # Errors
    /// As [`Renderer::draw`].
    pub fn draw_on_side(
        &mut self,
        side: &mut SideTarget,
        camera: &Camera,
        look: &Look,
        samples: u32,
    ) -> Result<(), GpuError> {
        let scale = side.target.size[1] as f32 / self.target.size[1] as f32;
        let look = Look { pixel_ratio: look.pixel_ratio * scale, ..look.clone() };
        swap(&mut self.target, &mut side.target);
        swap(&mut self.lists, &mut side.lists);
        let is_quick = replace(&mut self.is_quick, false);
        let first = self.draw(camera, &look);
        let others = (1..samples).map(|_| self.draw_again());
        let drawn = std::iter::once(first).chain(others).find(Result::is_err);
        swap(&mut self.target, &mut side.target);
        swap(&mut self.lists, &mut side.lists);
        self.is_quick = is_quick;
        // It was not of the own target.
        self.last = None;
        drawn.map_or(Ok(()), |error| error.map(|_| ()))
    }

    /// [`Renderer::is_short`] of another target.
    pub fn is_side_short(&self, side: &mut SideTarget) -> bool {
        side.lists.is_short(&self.context)
    }
}
