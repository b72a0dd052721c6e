//! Draws boxes as lines, with handles on their faces.

use crate::draw::BoxLines;
use crate::gpu::buffers::GrowBuffer;
use crate::gpu::pipeline::{Common, Output, Pipeline, group, group_layout};
use crate::gpu::types::Line;
use crate::gpu::{Context, GpuError};
use tetralod::geom::{Bounds, SinglePoints};
use tetralod::view::gizmo::BoxFace;

/// Diameter of a handle in units of the page's layout.
const HANDLE: f32 = 17.0;

#[derive(Debug)]
pub(super) struct WirePass {
    hidden: Pipeline,
    seen: Pipeline,
    listed: Pipeline,
    dots: Pipeline,
    /// The group of bindings before that of the lists.
    nothing: wgpu::BindGroup,
    lines: GrowBuffer<Line>,
    handles: GrowBuffer<Line>,
}

/// One line or handle an instance.
const BUFFERS: [Option<wgpu::VertexBufferLayout<'_>>; 1] = [Some(wgpu::VertexBufferLayout {
    array_stride: size_of::<Line>() as u64,
    step_mode: wgpu::VertexStepMode::Instance,
    attributes: &Line::ATTRIBUTES,
})];

impl WirePass {
    pub(super) fn new(context: &Context, lists: &wgpu::BindGroupLayout) -> Self {
        let pipeline = |vertex, fragment, depth| {
            Pipeline::new("wire", [vertex, fragment], &[], Output::Over(depth)).with_buffers(&BUFFERS)
        };
        let nothing = group_layout(context, "nothing", &[]);
        let listed = Output::List { only_front: false };
        let listed = Pipeline::new("wire", ["vs_line", "fs_list"], &[&nothing, lists], listed);
        Self {
            hidden: pipeline("vs_line", "fs_hidden", wgpu::CompareFunction::Greater),
            seen: pipeline("vs_line", "fs_line", wgpu::CompareFunction::LessEqual),
            listed: listed.with_buffers(&BUFFERS),
            dots: pipeline("vs_handle", "fs_handle", wgpu::CompareFunction::Always),
            nothing: group(context, &nothing, &[]),
            lines: GrowBuffer::new("lines", wgpu::BufferUsages::VERTEX),
            handles: GrowBuffer::new("handles", wgpu::BufferUsages::VERTEX),
        }
    }

    pub(super) fn update(
        &mut self,
        context: &Context,
        boxes: &[BoxLines],
        stored: &SinglePoints,
    ) -> Result<(), GpuError> {
        let lines: Vec<Line> = boxes.iter().flat_map(|b| edges(b, stored)).collect();
        let handles: Vec<Line> =
            boxes.iter().filter(|b| b.handles).flat_map(|b| handles(b, stored)).collect();
        self.lines.write(context, &lines)?;
        self.handles.write(context, &handles)
    }

    /// Bytes of memory on the GPU.
    pub(super) fn bytes(&self) -> u64 {
        self.lines.bytes() + self.handles.bytes()
    }

    /// Lists the lines among what is not opaque.
    pub(super) fn list(&self, with: (&Context, &Common), pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(1, &self.nothing, &[]);
        draw(with, pass, &self.listed, &self.lines);
    }

    /// Draws over everything else: lines, unless they have been listed, what of them is hidden, and handles.
    pub(super) fn draw(&self, with: (&Context, &Common), pass: &mut wgpu::RenderPass<'_>, are_listed: bool) {
        draw(with, pass, &self.hidden, &self.lines);
        if !are_listed {
            draw(with, pass, &self.seen, &self.lines);
        }
        draw(with, pass, &self.dots, &self.handles);
    }
}

fn draw(
    (context, common): (&Context, &Common),
    pass: &mut wgpu::RenderPass<'_>,
    pipeline: &Pipeline,
    items: &GrowBuffer<Line>,
) {
    if let Some(slice) = items.slice() {
        pass.set_pipeline(pipeline.get(context, common, None));
        pass.set_vertex_buffer(0, slice);
        pass.draw(0..6, 0..items.len() as u32);
    }
}

/// The twelve edges of a box.
pub(super) fn edges<'a>(lines: &'a BoxLines, stored: &'a SinglePoints) -> impl Iterator<Item = Line> + 'a {
    let corner = |i: usize| stored.store(corner(&lines.bounds, i));
    let pairs = (0..8).flat_map(|i| [1, 2, 4].map(|bit| (i, i | bit))).filter(|(a, b)| a != b);
    pairs.map(move |(a, b)| Line {
        from: corner(a),
        to: corner(b),
        colour: premultiplied(lines.colour),
        width: lines.width,
    })
}

pub(super) fn handles<'a>(lines: &'a BoxLines, stored: &'a SinglePoints) -> impl Iterator<Item = Line> + 'a {
    BoxFace::ALL.into_iter().map(|face| {
        let at = stored.store(face.handle(&lines.bounds).into());
        Line { from: at, to: at, colour: premultiplied(lines.colour), width: HANDLE }
    })
}

fn corner(bounds: &Bounds, i: usize) -> [f64; 3] {
    [0, 1, 2].map(|axis| if i >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] })
}

fn premultiplied([r, g, b, a]: [f32; 4]) -> [f32; 4] {
    [r * a, g * a, b * a, a]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_has_twelve_edges_and_six_handles() {
        let bounds = Bounds { min: [0.0; 3], max: [1.0, 2.0, 3.0] };
        let lines = BoxLines { bounds, colour: [1.0, 0.5, 0.0, 0.5], width: 1.0, handles: true };
        let edges: Vec<_> = edges(&lines, &SinglePoints::PLAIN).collect();
        assert_eq!(edges.len(), 12);
        for edge in &edges {
            let moved: Vec<_> = (0..3).filter(|i| edge.from[*i] != edge.to[*i]).collect();
            assert_eq!(moved.len(), 1, "{edge:?}");
            assert_eq!(edge.colour, [0.5, 0.25, 0.0, 0.5]);
            assert_eq!(edges.iter().filter(|other| *other == edge).count(), 1);
        }
        assert_eq!(handles(&lines, &SinglePoints::PLAIN).count(), 6);
    }
}
