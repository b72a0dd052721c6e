//! The same pictures where there is no WebGPU: lists of [edits](crate::draw::Edit) as arrays of numbers for shaders of WebGL 2, which
//! are twins of those of this module. The context and the shaders are somebody else's, behind [`GlContext`].
//!
//! Direct volume rendering needs storage buffers, which WebGL 2 does not have: a volume is not drawn, and that is an error.

use crate::draw::{BoxLines, CellShape, CellStyle, Edit, Lighting, Look, Style};
use crate::gpu::GpuError;
use crate::gpu::cell_parts::{edges, outer_faces, points};
use crate::gpu::error::Result;
use crate::gpu::pipeline::Variant;
use crate::gpu::renderer::shift;
use crate::gpu::style::StyleUniform;
use crate::gpu::surface::{packed, stored_moves};
use crate::gpu::types::{Frame, Line};
use crate::gpu::wire;
use std::collections::BTreeMap;
use std::fmt::Debug;
use tetralod::geom::{Camera, SinglePoints, SingleValues};
use tetralod::view::{MeshView, Triangles};

/// Numbers for shaders.
#[derive(Clone, Copy, Debug)]
pub enum Numbers<'a> {
    /// Fractions.
    Floats(&'a [f32]),
    /// Whole numbers.
    Whole(&'a [u32]),
}

/// Of one of the two pictures beside one another, the right one first, a thing that is drawn: a surface by its number, or another one.
pub type Place = (u32, u32);

const CELLS: u32 = u32::MAX;
const LINES: u32 = u32::MAX - 1;
const HANDLES: u32 = u32::MAX - 2;

/// How a thing is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Drawn<'a> {
    /// What it is of: the name of a program of shaders.
    pub program: &'static str,
    /// What it is drawn with where clip planes cut it open.
    pub cut: &'static str,
    /// Vertices with the one, and with the other.
    pub vertices: [u32; 2],
    /// The variant of its shaders: light in the lowest two bits, then whether it has values, edges and moves, and is not opaque.
    pub variant: u32,
    /// The bytes of its uniform; none for boxes.
    pub style: &'a [u8],
}

/// A WebGL 2 context with its shaders and its target.
pub trait GlContext: Debug {
    /// Makes array `name` of a thing these numbers, so many an item. Gives how many items there may be, if that is not enough.
    fn set_array(&mut self, place: Place, name: &'static str, each: u32, numbers: Numbers<'_>)
    -> Option<u32>;
    /// Draws a thing like this from now on.
    fn set_drawn(&mut self, place: Place, drawn: &Drawn<'_>);
    /// Frees a thing.
    fn remove(&mut self, place: Place);
    /// Gives the target a size, and the pictures that are stretched to it.
    fn set_size(&mut self, size: [u32; 2], drawn: [u32; 2]);
    /// Draws one of both pictures by the bytes of its uniform, into this many columns of pixels; as number `count` of those whose mean is
    /// shown, or quickly. `false` if the target is not available.
    fn draw(&mut self, side: u32, frame: &[u8], columns: u32, count: Option<u32>) -> bool;
}

/// Draws pictures of a mesh with WebGL 2, but no volumes; see [`Renderer`](crate::gpu::Renderer).
#[derive(Debug)]
pub struct WebGl<C> {
    /// What draws.
    pub context: C,
    sides: [Side; 2],
    split: f64,
    size: [u32; 2],
    drawn_size: [u32; 2],
    is_quick: bool,
    last: Option<(Camera, Look, u32)>,
    /// Whether it was said that a volume is not drawn.
    has_refused: bool,
    uploaded: u64,
}

/// What is drawn in one of the pictures.
#[derive(Debug, Default)]
struct Side {
    number: u32,
    points: SinglePoints,
    values: SingleValues,
    /// Triangles of each surface.
    surfaces: BTreeMap<u32, usize>,
    cells: Cells,
}

#[derive(Debug, Default)]
struct Cells {
    style: Option<CellStyle>,
    /// How their own values are stored, and how many there are.
    own: (SingleValues, usize),
    /// Tetrahedra, and numbers of their parts, if these are those of mesh and style.
    parts: Option<[usize; 2]>,
    points: usize,
    has_moves: bool,
}

impl<C: GlContext> WebGl<C> {
    /// Draws with `context`, on a target of this many pixels.
    pub fn new(context: C, size: [u32; 2]) -> Self {
        let right = Side { number: 0, ..Side::default() };
        let left = Side { number: 1, ..Side::default() };
        let mut own = Self {
            context,
            sides: [right, left],
            split: 0.0,
            size,
            drawn_size: size,
            is_quick: false,
            last: None,
            has_refused: false,
            uploaded: 0,
        };
        own.context.set_size(size, size);
        own
    }

    /// As [`Renderer::size`](crate::gpu::Renderer::size).
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// As [`Renderer::resize`](crate::gpu::Renderer::resize).
    pub fn resize(&mut self, size: [u32; 2]) {
        self.size = size.map(|length| length.max(1));
        self.set_drawn_size(self.size);
    }

    /// As [`Renderer::set_scale`](crate::gpu::Renderer::set_scale).
    pub fn set_scale(&mut self, scale: f64) {
        let scale = if scale.is_finite() { scale.clamp(0.1, 1.0) } else { 1.0 };
        self.set_drawn_size(self.size.map(|length| ((f64::from(length) * scale).round() as u32).max(1)));
    }

    fn set_drawn_size(&mut self, drawn: [u32; 2]) {
        self.drawn_size = drawn;
        self.context.set_size(self.size, drawn);
        self.last = None;
    }

    /// As [`Renderer::set_quick`](crate::gpu::Renderer::set_quick).
    pub fn set_quick(&mut self, is_quick: bool) {
        if std::mem::replace(&mut self.is_quick, is_quick) != is_quick {
            self.last = None;
        }
    }

    /// As [`Renderer::drawn`](crate::gpu::Renderer::drawn).
    pub fn drawn(&self) -> u32 {
        self.last.as_ref().map_or(0, |last| last.2)
    }

    /// As [`Renderer::triangles`](crate::gpu::Renderer::triangles).
    pub fn triangles(&self) -> usize {
        self.sides[0].surfaces.values().sum()
    }

    /// Bytes written since the last call.
    pub fn take_uploaded(&mut self) -> u64 {
        std::mem::take(&mut self.uploaded)
    }

    /// As [`Renderer::apply`](crate::gpu::Renderer::apply).
    ///
    /// # Errors
    /// The first one, if something does not fit, or is a volume.
    pub fn apply(&mut self, edits: &[Edit<'_>]) -> Result<()> {
        self.apply_to(0, edits)
    }

    fn apply_to(&mut self, side: usize, edits: &[Edit<'_>]) -> Result<()> {
        edits.iter().map(|edit| self.apply_one(side, edit)).fold(Ok(()), Result::and)
    }

    fn apply_one(&mut self, side: usize, edit: &Edit<'_>) -> Result<()> {
        match edit {
            Edit::Volume(None) => self.has_refused = false,
            Edit::Volume(Some(_)) => {
                if !std::mem::replace(&mut self.has_refused, true) {
                    return Err(GpuError::NeedsWebGpu);
                }
            }
            Edit::Beside { split, edits } => {
                self.split = *split;
                if *split == 0.0 {
                    self.clear(1);
                    return Ok(());
                }
                return self.apply_to(1, edits);
            }
            Edit::Clear => {
                self.split = 0.0;
                self.clear(1);
                self.clear(0);
            }
            _ => {
                let Self { context, sides, uploaded, .. } = self;
                return sides[side].apply(&mut Writer { context, uploaded }, edit);
            }
        }
        Ok(())
    }

    fn clear(&mut self, side: usize) {
        let Self { context, sides, uploaded, .. } = self;
        let side = &mut sides[side];
        side.forget_surfaces(&mut Writer { context, uploaded });
        side.cells.style = None;
        side.forget_cells(&mut Writer { context, uploaded });
    }

    /// As [`Renderer::draw`](crate::gpu::Renderer::draw).
    pub fn draw(&mut self, camera: &Camera, look: &Look) -> bool {
        self.draw_number(camera, look, 0)
    }

    /// As [`Renderer::draw_again`](crate::gpu::Renderer::draw_again).
    pub fn draw_again(&mut self) -> bool {
        match self.last.take() {
            Some((camera, look, count)) => self.draw_number(&camera, &look, count),
            None => false,
        }
    }

    fn draw_number(&mut self, camera: &Camera, look: &Look, count: u32) -> bool {
        let scale = self.drawn_size[1] as f32 / self.size[1] as f32;
        let scaled = Look { pixel_ratio: look.pixel_ratio * scale, ..look.clone() };
        let columns = (self.split * f64::from(self.size[0])).round() as u32;
        let number = (!self.is_quick).then_some(count);
        for (side, columns) in self.sides.iter().zip([self.size[0], columns]).filter(|(_, part)| *part > 0) {
            let (camera, look) = (camera.relative_to(&side.points), scaled.relative_to(&side.points));
            let frame = Frame::new(&camera, &look, self.drawn_size, shift(count));
            if !self.context.draw(side.number, bytemuck::bytes_of(&frame), columns, number) {
                return false;
            }
        }
        self.last = (!self.is_quick).then(|| (*camera, look.clone(), count + 1));
        true
    }

    /// Draws a picture of another size on another target of the context, as the mean of `samples`. `enter` makes that the target, and
    /// `leave` the own one.
    pub fn draw_aside(
        &mut self,
        (size, samples): ([u32; 2], u32),
        (camera, look): (&Camera, &Look),
        enter: impl FnOnce(&mut C),
        leave: impl FnOnce(&mut C),
    ) -> bool {
        let before = (self.size, self.drawn_size, self.is_quick);
        let look =
            Look { pixel_ratio: look.pixel_ratio * size[1] as f32 / before.0[1] as f32, ..look.clone() };
        enter(&mut self.context);
        self.is_quick = false;
        self.resize(size);
        let drawn = self.draw(camera, &look) && (1..samples).all(|_| self.draw_again());
        leave(&mut self.context);
        (self.size, self.is_quick) = (before.0, before.2);
        self.set_drawn_size(before.1);
        drawn
    }
}

/// Writes to a context, and counts.
struct Writer<'a, C> {
    context: &'a mut C,
    uploaded: &'a mut u64,
}

impl<C: GlContext> Writer<'_, C> {
    fn floats(&mut self, place: Place, name: &'static str, each: u32, numbers: &[f32]) -> Result<()> {
        self.array(place, name, each, Numbers::Floats(numbers), numbers.len())
    }

    fn whole(&mut self, place: Place, name: &'static str, each: u32, numbers: &[u32]) -> Result<()> {
        self.array(place, name, each, Numbers::Whole(numbers), numbers.len())
    }

    fn array(
        &mut self,
        place: Place,
        name: &'static str,
        each: u32,
        numbers: Numbers<'_>,
        len: usize,
    ) -> Result<()> {
        *self.uploaded += 4 * len as u64;
        match self.context.set_array(place, name, each, numbers) {
            None => Ok(()),
            Some(most) => {
                self.context.remove(place);
                let limit = 4 * u64::from(each) * u64::from(most);
                Err(GpuError::TooLarge { what: name, bytes: 4 * len as u64, limit })
            }
        }
    }
}

impl Side {
    fn apply<C: GlContext>(&mut self, to: &mut Writer<'_, C>, edit: &Edit<'_>) -> Result<()> {
        match edit {
            Edit::Points(points) if *points != self.points => {
                self.points = *points;
                self.forget_surfaces(to);
                self.forget_cells(to);
            }
            Edit::Values(values) if *values != self.values => {
                self.values = *values;
                self.forget_cells(to);
            }
            Edit::Boxes(boxes) => return self.set_boxes(to, boxes),
            Edit::Cells(style) => self.set_cells(to, style.as_ref()),
            Edit::CellValues(values) => return self.set_cell_values(to, values),
            Edit::Mesh(mesh, [points, tets]) => {
                let is_same = points.is_empty() && tets.is_empty() && self.cells.parts.is_some();
                if let Some(style) = self.cells.style.filter(|_| !is_same) {
                    return self.set_mesh(to, mesh, &style);
                }
            }
            Edit::Moves(moves) => return self.set_moves(to, moves),
            Edit::Surface { key, triangles, style, .. } => {
                return self.set_surface(to, *key, triangles, style);
            }
            Edit::Remove(key) => {
                self.surfaces.remove(key);
                to.context.remove((self.number, *key));
            }
            // The others are not of one side, or change nothing.
            _ => {}
        }
        Ok(())
    }

    fn forget_surfaces<C: GlContext>(&mut self, to: &mut Writer<'_, C>) {
        for key in std::mem::take(&mut self.surfaces).into_keys() {
            to.context.remove((self.number, key));
        }
    }

    /// The cells need their mesh and values again.
    fn forget_cells<C: GlContext>(&mut self, to: &mut Writer<'_, C>) {
        to.context.remove((self.number, CELLS));
        self.cells = Cells { style: self.cells.style, ..Cells::default() };
    }

    fn set_boxes<C: GlContext>(&mut self, to: &mut Writer<'_, C>, boxes: &[BoxLines]) -> Result<()> {
        let lines: Vec<Line> = boxes.iter().flat_map(|b| wire::edges(b, &self.points)).collect();
        let with_handles = boxes.iter().filter(|b| b.handles);
        let handles: Vec<Line> = with_handles.flat_map(|b| wire::handles(b, &self.points)).collect();
        for (key, program, lines) in [(LINES, "line", lines), (HANDLES, "handle", handles)] {
            let place = (self.number, key);
            if lines.is_empty() {
                to.context.remove(place);
                continue;
            }
            to.floats(place, "lines", 1, bytemuck::cast_slice(&lines))?;
            let vertices = [6 * lines.len() as u32; 2];
            to.context.set_drawn(place, &Drawn { program, cut: program, vertices, variant: 0, style: &[] });
        }
        Ok(())
    }

    fn set_surface<C: GlContext>(
        &mut self,
        to: &mut Writer<'_, C>,
        key: u32,
        triangles: &Triangles<'_>,
        style: &Style,
    ) -> Result<()> {
        let place = (self.number, key);
        self.surfaces.remove(&key);
        if triangles.indices.is_empty() {
            to.context.remove(place);
            return Ok(());
        }
        let positions: Vec<_> = triangles.positions.iter().map(|point| self.points.store(*point)).collect();
        let inner = triangles.inner_sides.iter().chain(std::iter::repeat(&0));
        let indices: Vec<_> = triangles.indices.iter().zip(inner).map(packed).collect();
        let moves_each = match (triangles.moves.is_empty(), triangles.slopes.is_empty()) {
            (true, _) => 0,
            (false, true) => 3,
            (false, false) => 12,
        };
        to.floats(place, "positions", 3, positions.as_flattened())?;
        to.floats(place, "normals", 3, triangles.normals.as_flattened())?;
        to.floats(place, "values", 1, &triangles.single.store_all(triangles.values))?;
        to.whole(place, "indices", 3, indices.as_flattened())?;
        to.floats(place, "moves", 3, &stored_moves(triangles, &self.points))?;
        self.surfaces.insert(key, triangles.indices.len());
        let uniform = StyleUniform::of_surface(style, &triangles.single, moves_each);
        let listed = if style.opacity < 1.0 { LISTED } else { 0 };
        let drawn = Drawn {
            program: "surface",
            cut: "surface",
            vertices: [3 * triangles.indices.len() as u32; 2],
            variant: variant(style, style.lighting, moves_each > 0) | listed,
            style: bytemuck::bytes_of(&uniform),
        };
        to.context.set_drawn(place, &drawn);
        Ok(())
    }

    fn set_cells<C: GlContext>(&mut self, to: &mut Writer<'_, C>, style: Option<&CellStyle>) {
        let kind = |style: &CellStyle| (style.cut, std::mem::discriminant(&style.shape));
        if style.map(kind) != self.cells.style.as_ref().map(kind) {
            self.cells.parts = None;
        }
        self.cells.style = style.copied();
        match style {
            None => self.forget_cells(to),
            Some(_) => self.draw_cells(to),
        }
    }

    fn set_cell_values<C: GlContext>(&mut self, to: &mut Writer<'_, C>, values: &[f64]) -> Result<()> {
        self.cells.own = (SingleValues::of_values(values), values.len());
        to.floats((self.number, CELLS), "tet_values", 1, &self.cells.own.0.store_all(values))?;
        self.draw_cells(to);
        Ok(())
    }

    fn set_mesh<C: GlContext>(
        &mut self,
        to: &mut Writer<'_, C>,
        mesh: &MeshView<'_>,
        style: &CellStyle,
    ) -> Result<()> {
        let parts = match style.shape {
            CellShape::Wire => edges(mesh, &style.cut),
            CellShape::Solid(_) => outer_faces(mesh, &style.cut),
            CellShape::Points(_) => points(mesh, &style.cut),
        };
        let all = mesh.positions.iter().zip(mesh.field);
        let stored: Vec<_> = all
            .map(|(point, value)| {
                let [x, y, z] = self.points.store(*point);
                [x, y, z, self.values.store(*value)]
            })
            .collect();
        let place = (self.number, CELLS);
        self.cells.parts = None;
        to.floats(place, "points", 4, stored.as_flattened())?;
        to.whole(place, "tets", 4, mesh.tets.as_flattened())?;
        to.whole(place, "parts", 1, &parts)?;
        self.cells.parts = Some([mesh.tets.len(), parts.len()]);
        self.cells.points = mesh.positions.len();
        Ok(())
    }

    /// They come after the mesh, each time.
    fn set_moves<C: GlContext>(&mut self, to: &mut Writer<'_, C>, moves: &[[f64; 3]]) -> Result<()> {
        self.cells.has_moves =
            self.cells.parts.is_some() && !moves.is_empty() && moves.len() == self.cells.points;
        if self.cells.has_moves {
            let stored: Vec<_> = moves.iter().map(|way| way.map(|x| x as f32)).collect();
            to.floats((self.number, CELLS), "moves", 3, stored.as_flattened())?;
        }
        self.draw_cells(to);
        Ok(())
    }

    fn draw_cells<C: GlContext>(&self, to: &mut Writer<'_, C>) {
        let place = (self.number, CELLS);
        let (Some(style), [tets, parts]) = (&self.cells.style, self.cells.parts.unwrap_or_default()) else {
            return;
        };
        let (own, count) = self.cells.own;
        // Values of another mesh would be wrong.
        let parts = if style.own_values && count != tets { 0 } else { parts as u32 };
        let all = if parts > 0 { 12 * tets as u32 } else { 0 };
        let uniform =
            StyleUniform::of_cells(style, &self.points, if style.own_values { &own } else { &self.values });
        // Shrunk ones and those that clip planes cut open show faces that others hide.
        let (program, cut, vertices) = match style.shape {
            CellShape::Solid(0.0) => ("face", "solid", [3 * parts, all]),
            CellShape::Solid(_) => ("solid", "solid", [all; 2]),
            CellShape::Wire => ("edge", "edge", [2 * parts; 2]),
            CellShape::Points(_) => ("point", "point", [3 * parts; 2]),
        };
        // Smooth light takes normals, which points do not have.
        let light = if style.style.lighting == Lighting::None { Lighting::None } else { Lighting::Flat };
        let variant = variant(&style.style, light, self.cells.has_moves);
        let style = bytemuck::bytes_of(&uniform);
        to.context.set_drawn(place, &Drawn { program, cut, vertices, variant, style });
    }
}

const LISTED: u32 = 32;

fn variant(style: &Style, light: Lighting, has_moves: bool) -> u32 {
    let variant = Variant::new(style, false, has_moves);
    let flags = [(variant.has_values, 4), (variant.has_edges, 8), (variant.has_moves, 16)];
    flags.into_iter().filter(|(is_set, _)| *is_set).fold(light as u32, |all, (_, flag)| all | flag)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::EdgeLook;
    use std::collections::BTreeSet;
    use tetralod::geom::Bounds;
    use tetralod::view::{ClipPlane, Medium};

    /// Notes what it is told.
    #[derive(Debug, Default)]
    struct Notes {
        arrays: BTreeSet<(Place, &'static str, usize)>,
        drawn: BTreeMap<Place, (&'static str, &'static str, [u32; 2], u32)>,
        pictures: Vec<(u32, usize, u32, Option<u32>)>,
        sizes: Vec<[[u32; 2]; 2]>,
        most: Option<u32>,
    }

    impl GlContext for Notes {
        fn set_array(
            &mut self,
            place: Place,
            name: &'static str,
            each: u32,
            numbers: Numbers<'_>,
        ) -> Option<u32> {
            let len = match numbers {
                Numbers::Floats(numbers) => numbers.len(),
                Numbers::Whole(numbers) => numbers.len(),
            };
            assert_eq!(len % each as usize, 0, "{name}");
            self.arrays.retain(|array| (array.0, array.1) != (place, name));
            self.arrays.insert((place, name, len / each as usize));
            self.most.filter(|most| len / each as usize > *most as usize)
        }

        fn set_drawn(&mut self, place: Place, drawn: &Drawn<'_>) {
            self.drawn.insert(place, (drawn.program, drawn.cut, drawn.vertices, drawn.variant));
        }

        fn remove(&mut self, place: Place) {
            self.drawn.remove(&place);
            self.arrays.retain(|array| array.0 != place);
        }

        fn set_size(&mut self, size: [u32; 2], drawn: [u32; 2]) {
            self.sizes.push([size, drawn]);
        }

        fn draw(&mut self, side: u32, frame: &[u8], columns: u32, count: Option<u32>) -> bool {
            self.pictures.push((side, frame.len(), columns, count));
            true
        }
    }

    const PLACES: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    const TETS: [[u32; 4]; 1] = [[0, 1, 2, 3]];
    const AROUND: [[u32; 4]; 1] = [[tetralod::mesh::NONE; 4]];

    fn mesh() -> Edit<'static> {
        let mesh = MeshView {
            positions: &PLACES,
            field: &[0.0; 4],
            is_label: false,
            tets: &TETS,
            neighbors: &AROUND,
        };
        Edit::Mesh(mesh, [&[], &[]])
    }

    fn surface(key: u32, style: Style) -> Edit<'static> {
        let triangles = Triangles {
            positions: &PLACES,
            normals: &[[0.0; 3]; 4],
            values: &[],
            single: SingleValues::PLAIN,
            indices: &[[0, 1, 2], [0, 2, 3]],
            inner_sides: &[],
            moves: &[],
            slopes: &[],
        };
        Edit::Surface { key, triangles, changes: None, style }
    }

    #[test]
    fn surfaces_and_cells_are_drawn_until_they_are_removed() {
        let mut gl = WebGl::new(Notes::default(), [20, 10]);
        let translucent = Style { opacity: 0.5, edges: Some(EdgeLook::default()), ..Style::default() };
        gl.apply(&[surface(3, Style::default()), surface(4, translucent)]).unwrap();
        assert_eq!(gl.triangles(), 4);
        assert_eq!(gl.context.drawn[&(0, 3)], ("surface", "surface", [6, 6], 0));
        assert_eq!(gl.context.drawn[&(0, 4)], ("surface", "surface", [6, 6], LISTED | 8));
        // Solid tetrahedra: outer faces, and where they are cut open all.
        gl.apply(&[Edit::Cells(Some(CellStyle::default())), mesh(), Edit::Moves(&PLACES)]).unwrap();
        assert_eq!(gl.context.drawn[&(0, CELLS)], ("face", "solid", [12, 12], 1 | 8 | 16));
        let wire = CellStyle { shape: CellShape::Wire, ..CellStyle::default() };
        gl.apply(&[Edit::Cells(Some(wire))]).unwrap();
        assert_eq!(gl.context.drawn[&(0, CELLS)].2, [0, 0], "the parts are those of another shape");
        gl.apply(&[mesh(), Edit::Moves(&[])]).unwrap();
        assert_eq!(gl.context.drawn[&(0, CELLS)], ("edge", "edge", [36, 36], 1 | 8));
        // Values of their own, of which there are too many for this mesh; then as many.
        let own = CellStyle { own_values: true, ..wire };
        gl.apply(&[Edit::CellValues(&[1.0, 2.0]), Edit::Cells(Some(own))]).unwrap();
        assert_eq!(gl.context.drawn[&(0, CELLS)].2, [0, 0]);
        gl.apply(&[Edit::CellValues(&[1.0])]).unwrap();
        assert_eq!(gl.context.drawn[&(0, CELLS)].2, [36, 36]);
        gl.apply(&[Edit::Remove(3), Edit::Cells(None)]).unwrap();
        assert_eq!(gl.context.drawn.keys().copied().collect::<Vec<_>>(), [(0, 4)]);
        gl.apply(&[Edit::Points(SinglePoints { unit: 2.0, ..SinglePoints::PLAIN })]).unwrap();
        assert!(gl.context.drawn.is_empty() && gl.context.arrays.is_empty() && gl.triangles() == 0);
    }

    #[test]
    fn volumes_are_refused_once_and_all_else_is_drawn() {
        let mut gl = WebGl::new(Notes::default(), [20, 10]);
        let volume = || Edit::Volume(Some((Medium::new(&[(0.0, [1.0; 4])], 1.0), 0)));
        let edits = || [volume(), surface(0, Style::default())];
        assert_eq!(gl.apply(&edits()), Err(GpuError::NeedsWebGpu));
        assert!(gl.context.drawn.contains_key(&(0, 0)));
        assert_eq!(gl.apply(&edits()), Ok(()), "it was said");
        assert_eq!(gl.apply(&[Edit::Volume(None)]), Ok(()));
        assert_eq!(gl.apply(&edits()), Err(GpuError::NeedsWebGpu));
    }

    #[test]
    fn what_does_not_fit_is_an_error_with_its_size() {
        let mut gl = WebGl::new(Notes { most: Some(3), ..Notes::default() }, [20, 10]);
        let error = gl.apply(&[surface(0, Style::default())]);
        assert_eq!(error, Err(GpuError::TooLarge { what: "positions", bytes: 48, limit: 36 }));
        assert!(gl.context.drawn.is_empty() && gl.context.arrays.is_empty() && gl.triangles() == 0);
    }

    #[test]
    fn pictures_are_counted_and_have_a_part_of_the_width_each() {
        let mut gl = WebGl::new(Notes::default(), [20, 10]);
        let camera = Camera::home(&Bounds { min: [0.0; 3], max: [1.0; 3] }, 2.0);
        let look = Look { clips: vec![ClipPlane::NOTHING], ..Look::default() };
        assert!(!gl.draw_again(), "there is nothing yet");
        let beside = Edit::Beside { split: 0.25, edits: vec![surface(0, Style::default())] };
        gl.apply(&[beside, surface(0, Style::default())]).unwrap();
        assert!(gl.draw(&camera, &look) && gl.draw_again());
        assert_eq!(gl.drawn(), 2);
        let size = size_of::<Frame>();
        let both = |count| [(0, size, 20, Some(count)), (1, size, 5, Some(count))];
        assert_eq!(gl.context.pictures, [both(0), both(1)].concat());
        gl.set_quick(true);
        gl.set_scale(0.5);
        assert_eq!(gl.context.sizes.last(), Some(&[[20, 10], [10, 5]]));
        gl.apply(&[Edit::Beside { split: 0.0, edits: Vec::new() }]).unwrap();
        gl.context.pictures.clear();
        assert!(gl.draw(&camera, &look) && gl.drawn() == 0);
        assert_eq!(gl.context.pictures, [(0, size, 20, None)]);
        // A picture of another size leaves all as it was.
        gl.context.pictures.clear();
        assert!(gl.draw_aside(([40, 30], 3), (&camera, &look), |_| (), |_| ()));
        assert_eq!(
            gl.context.pictures.iter().map(|picture| picture.3).collect::<Vec<_>>(),
            [Some(0), Some(1), Some(2)]
        );
        assert_eq!(gl.context.sizes.last(), Some(&[[20, 10], [10, 5]]));
        assert_eq!((gl.size(), gl.drawn()), ([20, 10], 0));
    }
}
