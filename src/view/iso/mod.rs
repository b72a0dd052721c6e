//! Isosurfaces by marching tetrahedra, into buffers that are used again.
//!
//! A point is *inside* when its value is smaller than the isovalue; a point that has exactly the isovalue is
//! outside, and a surface through it uses the point itself. The surface is indexed: one vertex for each crossed
//! edge or touched point, shared by all triangles around it.
//!
//! What holds for the triangles:
//! - Normals and counter-clockwise sides point towards **lower** values, so the surface around a blob of high
//!   values shows its front to the outside.
//! - No triangle names a vertex twice. Triangles of no area remain possible where rounding makes
//!   neighbouring crossings coincide.
//! - Inside the domain every directed edge has exactly as many opposite ones: the surface is closed. An edge has
//!   two triangles, or an even number where the surface touches itself along points of exactly the isovalue. Between regions that have
//!   points of their own the surface has vertices of its own in each, at the same places unless its field jumps there.
//! - The result of an extraction depends on the order of points and tetrahedra only: same mesh, same bytes.
//!
//! [`IsoSurface::update`] follows a mesh that changes a little from call to call. What it makes is the surface that
//! [`IsoSurface::extract_all`] makes of the same mesh: the same triangles with the same positions and normals, to the
//! last bit. Only their order, and that of the vertices, depends on the updates before.

mod block_ranges;
mod gradients;
mod update;

use super::marching::{Crossing, Pieces, Polygon, select};
use super::mesh_snapshot::MeshSnapshot;
use super::moves::{Slope, slope};
use super::{FieldView, MeshView, SurfaceChanges};
use crate::mesh::{BLOCK, NONE};
use block_ranges::BlockRanges;
use glam::DVec3;
use gradients::{Gradients, NO_NORMAL, unit};

/// What the normals of a surface are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NormalKind {
    /// The gradient of the field, as the mean over the tetrahedra around a point, interpolated along the edges.
    #[default]
    Gradient,
    /// The mean over the triangles at a vertex, each with its area as weight: what is seen is the surface that is
    /// there. Regions that have vertices of their own at one place have normals of their own, too.
    Smooth,
}

/// Surfaces of one or several isovalues, and the memory to extract the next ones without allocating.
///
/// All surfaces are in the same arrays; [`IsoSurface::values`] tells which is which, and no triangle has vertices of
/// two.
///
/// Takes at most 56 bytes a vertex and 16 a triangle, 5 a point of the mesh, 36 for every point next to the surface and 4
/// for every tetrahedron that is cut. Once [`IsoSurface::update`] follows a mesh, 20.4 bytes a tetrahedron, 24 a point, 4
/// a vertex and 16 a triangle more.
#[derive(Clone, Debug, Default)]
pub struct IsoSurface {
    /// Vertices, in model units.
    pub positions: Vec<[f64; 3]>,
    /// One unit normal per vertex, towards lower values.
    pub normals: Vec<[f32; 3]>,
    /// The isovalue of each vertex, in units of the field.
    pub values: Vec<f64>,
    /// Triangles, counter-clockwise when seen from lower values.
    pub indices: Vec<[u32; 3]>,
    kind: NormalKind,
    isovalues: Vec<f64>,
    pieces: Pieces,
    gradients: Gradients,
    /// Scratch: a byte per point.
    sides: Vec<u8>,
    /// Scratch: tetrahedra that are cut.
    cut: Vec<u32>,
    state: State,
    /// Once the surface follows a mesh: what that was.
    followed: Option<Box<Followed>>,
}

/// A mesh that a surface follows.
#[derive(Clone, Debug)]
struct Followed {
    snapshot: MeshSnapshot,
    ranges: BlockRanges,
}

/// What the arrays show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    /// Nothing: there was no mesh yet.
    #[default]
    New,
    /// The last mesh had so many points and tetrahedra.
    Of(usize, usize),
    /// A surface of the last mesh, but the normals are of another kind.
    Stale,
}

impl IsoSurface {
    /// An empty surface.
    pub fn new() -> Self {
        Self::default()
    }

    /// Chooses what the normals are made of, from the next extraction or update on.
    pub fn set_normal_kind(&mut self, kind: NormalKind) {
        if self.kind != kind && self.state != State::New {
            self.state = State::Stale;
        }
        self.kind = kind;
    }

    /// Whether the meshes have regions, which may have points of their own at one place: normals are those of a surface that passes from one
    /// to the next where its field does not jump.
    #[doc(hidden)]
    pub fn set_regions(&mut self, has_regions: bool) {
        self.gradients.has_regions = has_regions;
    }

    /// Replaces this surface by the one of `mesh` at `value`.
    ///
    /// Costs one pass over the tetrahedra, and a second one for the normals if there is a surface.
    ///
    /// # Panics
    /// If the mesh names a point that it does not have.
    pub fn extract(&mut self, mesh: &MeshView<'_>, value: f64) {
        self.extract_all(mesh, &[value]);
    }

    /// Replaces this surface by those of `mesh` at `values`, one after the other; duplicate values count once.
    ///
    /// Costs one pass over the tetrahedra for each value, and one for the normals if there is a surface.
    ///
    /// # Panics
    /// If the mesh names a point that it does not have.
    pub fn extract_all(&mut self, mesh: &MeshView<'_>, values: &[f64]) {
        self.followed = None;
        self.rebuild(mesh, distinct(values));
    }

    /// The value at each vertex of another field of the mesh that the surface was made of, given by one number a point.
    ///
    /// # Panics
    /// If there are fewer points or numbers than in that mesh.
    pub fn interpolate<'f>(&self, mesh: &MeshView<'_>, field: impl Into<FieldView<'f>>) -> Vec<f64> {
        let field = field.into();
        self.crossings(mesh).map(|(crossing, t)| crossing.value(field, t)).collect()
    }

    /// On which edge of the mesh each vertex is, and how far along.
    fn crossings(&self, mesh: &MeshView<'_>) -> impl Iterator<Item = (&Crossing, f64)> {
        let isovalue = |crossing: &Crossing| self.isovalues[crossing.which as usize];
        let list = self.pieces.crossings.list.iter();
        list.map(move |crossing| (crossing, fraction(crossing, mesh, isovalue(crossing))))
    }

    /// Where each vertex is, as [`LabelParts`](super::LabelParts) takes it.
    #[doc(hidden)]
    pub fn edge_places(&self, mesh: &MeshView<'_>) -> Vec<([u32; 2], f64)> {
        self.crossings(mesh).map(|(crossing, t)| (crossing.ends, t)).collect()
    }

    /// At each vertex the slope of vectors, given by their components along x, y and z, one number a point: the mean over the
    /// tetrahedra of its triangles.
    ///
    /// # Panics
    /// As [`IsoSurface::interpolate`].
    pub fn slopes(&self, mesh: &MeshView<'_>, vectors: [&[f64]; 3]) -> Vec<Slope> {
        let mut sums = vec![([[0.0; 3]; 3], 0.0); self.positions.len()];
        for (t, triangle) in self.pieces.tets_of_triangles().zip(&self.indices) {
            let tet = mesh.tets[t as usize].map(|p| p as usize);
            let own = slope(tet.map(|p| mesh.positions[p]), tet.map(|p| vectors.map(|along| along[p])));
            for v in triangle {
                let (sum, count): &mut (Slope, f64) = &mut sums[*v as usize];
                sum.iter_mut().flatten().zip(own.iter().flatten()).for_each(|(sum, own)| *sum += own);
                *count += 1.0;
            }
        }
        // Each vertex has a triangle.
        sums.into_iter().map(|(sum, count)| sum.map(|along| along.map(|x| x / count))).collect()
    }

    /// The ranges of vertices and of triangles that were written since the last call, in ascending order, for copies
    /// elsewhere. Anything beyond the ends of the arrays is gone.
    pub fn take_changes(&mut self) -> SurfaceChanges {
        self.pieces.take_changes()
    }

    /// Extracts the whole surface, using the block ranges if there are any.
    fn rebuild(&mut self, mesh: &MeshView<'_>, isovalues: Vec<f64>) {
        let points = mesh.positions.len();
        self.isovalues = isovalues;
        self.state = State::Of(points, mesh.tets.len());
        self.positions.clear();
        self.normals.clear();
        self.values.clear();
        self.indices.clear();
        self.pieces.clear(mesh.tets.len());
        if self.followed.is_none() || self.kind == NormalKind::Smooth {
            self.gradients.clear(points);
        }
        for which in 0..self.isovalues.len() {
            let value = self.isovalues[which];
            self.find_cut(mesh, value);
            for &t in &self.cut {
                self.pieces.push(&mut self.indices, t, which as u32, &polygon(mesh, t, value));
            }
        }
        self.place(mesh);
        self.mend_normals();
        self.pieces.mark_all();
    }

    /// Finds the tetrahedra that are cut at `value`.
    fn find_cut(&mut self, mesh: &MeshView<'_>, value: f64) {
        let Self { cut, sides, followed, .. } = self;
        cut.clear();
        let ranges = followed.as_ref().map(|followed| &followed.ranges);
        if let Some(ranges) = ranges.filter(|ranges| !ranges.is_passed_widely(value)) {
            for first in ranges.blocks_at(value).map(|block| block * BLOCK) {
                let tets = &mesh.tets[first..mesh.tets.len().min(first + BLOCK)];
                select(tets, first, cut, |tet| is_cut(tet.map(|p| u8::from(mesh.field[p as usize] < value))));
            }
        } else {
            sides.clear();
            sides.extend(mesh.field.iter().map(|v| u8::from(*v < value)));
            select(mesh.tets, 0, cut, |tet| is_cut(tet.map(|p| sides[p as usize])));
        }
    }

    /// Sets all that belongs to the vertices, but for the normals that [`Self::mend_normals`] gives.
    fn place(&mut self, mesh: &MeshView<'_>) {
        let Self { positions, normals, values, isovalues, pieces, gradients, .. } = self;
        let list = &pieces.crossings.list;
        let by_gradient = self.kind == NormalKind::Gradient;
        if by_gradient {
            let ends = list.iter().flat_map(|crossing| crossing.ends);
            let snapshot = self.followed.as_mut().map(|followed| &mut followed.snapshot);
            gradients.sum(mesh, ends, snapshot, &mut self.sides);
        }
        positions.reserve(list.len());
        normals.reserve(list.len());
        values.reserve(list.len());
        for crossing in list {
            let value = isovalues[crossing.which as usize];
            let t = fraction(crossing, mesh, value);
            values.push(value);
            positions.push(crossing.place(mesh.positions, t));
            normals.push(if by_gradient { gradients.normal(crossing, t) } else { NO_NORMAL });
        }
    }

    /// Gives vertices without a normal the mean direction of their triangles, or +z as last resort.
    fn mend_normals(&mut self) {
        if !self.normals.contains(&NO_NORMAL) {
            return;
        }
        let mut sums = vec![DVec3::ZERO; self.normals.len()];
        for triangle in &self.indices {
            let area = self.area(*triangle);
            triangle.iter().for_each(|v| sums[*v as usize] += area);
        }
        for (normal, sum) in self.normals.iter_mut().zip(sums).filter(|(normal, _)| **normal == NO_NORMAL) {
            *normal = unit(sum).unwrap_or(UP);
        }
    }

    /// Twice the area of a triangle, along its normal.
    fn area(&self, triangle: [u32; 3]) -> DVec3 {
        let [a, b, c] = triangle.map(|v| DVec3::from(self.positions[v as usize]));
        (b - a).cross(c - a)
    }
}

/// The piece of the surface at `value` in a tetrahedron.
#[inline]
fn polygon(mesh: &MeshView<'_>, t: u32, value: f64) -> Polygon {
    let tet = mesh.tets[t as usize];
    if tet[0] == NONE {
        return Polygon::default();
    }
    let values = tet.map(|p| mesh.field[p as usize]);
    let bits = |holds: [bool; 4]| (0..4).fold(0, |bits, i| bits | usize::from(holds[i]) << i);
    Polygon::of(tet, bits(values.map(|v| v < value)), bits(values.map(|v| v == value)))
}

/// Whether a tetrahedron has points on both sides, given 1 for each that is inside.
#[inline(always)]
fn is_cut(inside: [u8; 4]) -> bool {
    inside.iter().sum::<u8>().wrapping_sub(1) < 3
}

/// How far a crossing is from its inside end to its outside end.
#[inline]
fn fraction(crossing: &Crossing, mesh: &MeshView<'_>, value: f64) -> f64 {
    crossing.fraction(value, |end| mesh.field[end as usize])
}

/// The normal of a vertex that has no other.
const UP: [f32; 3] = [0.0, 0.0, 1.0];

/// The isovalues without duplicates and NaN.
fn distinct(values: &[f64]) -> Vec<f64> {
    let mut distinct = Vec::with_capacity(values.len());
    for &value in values {
        if !value.is_nan() && !distinct.contains(&value) {
            distinct.push(value);
        }
    }
    distinct
}
