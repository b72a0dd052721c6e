//! Isosurfaces by marching tetrahedra, into buffers that are used again.
//!
//! A point is *inside* when its value is smaller than the isovalue; a point that has exactly the isovalue is
//! outside, and a surface through it uses the point itself. The surface is indexed: one vertex for each crossed
//! edge or touched point, shared by all triangles around it.
//!
//! What holds for the triangles:
//! - Normals and counter-clockwise sides point towards **lower** values, so the surface around a blob of high
//!   values shows its front to the outside.
//! - No triangle names a vertex twice. Triangles of no area remain possible where rounding to `f32` makes
//!   neighbouring crossings coincide.
//! - Inside the domain every directed edge has exactly as many opposite ones: the surface is closed. An edge has
//!   two triangles, or an even number where the surface touches itself along points of exactly the isovalue.
//! - The result of an extraction depends on the order of points and tetrahedra only: same mesh, same bytes.
//!
//! [`IsoSurface::update`] follows a mesh that changes a little from call to call. What it makes is the surface that
//! [`IsoSurface::extract_all`] makes of the same mesh: the same triangles with the same positions and normals, to the
//! last bit. Only their order, and that of the vertices, depends on the updates before.

mod changes;
mod crossings;
mod cut;
mod gradients;
mod links;
mod mesh_snapshot;
mod update;

use crate::mesh::NONE;
use crate::view::MeshView;
use crate::view::SurfaceChanges;
use changes::Marks;
use crossings::Crossings;
use gradients::Gradients;
use gradients::cross;
use gradients::sub;
use gradients::unit;
use links::Links;
use mesh_snapshot::MeshSnapshot;

/// What the normals of a surface are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NormalKind {
    /// The gradient of the field, as the mean over the tetrahedra around a point, interpolated along the edges.
    #[default]
    Gradient,
    /// The mean over the triangles at a vertex, each with its area as weight: what is seen is the surface that is
    /// there.
    Smooth,
}

/// Surfaces of one or several isovalues, and the memory to extract the next ones without allocating.
///
/// All surfaces are in the same arrays; [`IsoSurface::values`] tells which is which, and no triangle has vertices of
/// two.
///
/// Takes at most 56 bytes a vertex and 16 a triangle, 5 a point of the mesh, 36 for every point next to the surface and 4
/// for every tetrahedron that is cut. Once [`IsoSurface::update`] follows a mesh, 20.3 bytes a tetrahedron, 24 a point, 4
/// a vertex and 16 a triangle more.
#[derive(Clone, Debug, Default)]
pub struct IsoSurface {
    /// Vertices, in model units.
    pub positions: Vec<[f32; 3]>,
    /// One unit normal per vertex, towards lower values.
    pub normals: Vec<[f32; 3]>,
    /// The isovalue of each vertex, in units of the field.
    pub values: Vec<f32>,
    /// Triangles, counter-clockwise when seen from lower values.
    pub indices: Vec<[u32; 3]>,
    /// Per triangle twice the number of its tetrahedron, and 1 more if it is the second one there at its isovalue.
    owners: Vec<u32>,
    kind: NormalKind,
    isovalues: Vec<f32>,
    crossings: Crossings,
    gradients: Gradients,
    /// Scratch: a byte per point.
    sides: Vec<u8>,
    /// Scratch: tetrahedra that are cut.
    cut: Vec<u32>,
    state: State,
    /// How many tetrahedra the mesh had that came last.
    tets: usize,
    snapshot: Option<Box<MeshSnapshot>>,
    /// There from the first edit after an extraction on.
    links: Option<Box<Links>>,
    changed_vertices: Marks,
    changed_triangles: Marks,
}

/// What the arrays show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    /// Nothing: there was no mesh yet.
    #[default]
    New,
    /// The mesh of so many points and tetrahedra that came last.
    Of(usize, usize),
    /// That too, but with normals of another kind.
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

    /// Replaces this surface by the one of `mesh` at `value` (rounded to `f32`, as the field is).
    ///
    /// Costs one pass over the tetrahedra, and a second one for the normals if there is a surface.
    ///
    /// # Panics
    /// If the mesh names a point that it does not have.
    pub fn extract(&mut self, mesh: &MeshView<'_>, value: f64) {
        self.extract_all(mesh, &[value]);
    }

    /// Replaces this surface by those of `mesh` at `values`, one after the other; a value that comes again counts
    /// once.
    ///
    /// Costs one pass over the tetrahedra for each value, and one for the normals if there is a surface.
    ///
    /// # Panics
    /// If the mesh names a point that it does not have.
    pub fn extract_all(&mut self, mesh: &MeshView<'_>, values: &[f64]) {
        self.snapshot = None;
        self.rebuild(mesh, distinct(values));
    }

    /// The ranges of vertices and of triangles that were written since the last call, in ascending order, for copies
    /// elsewhere. Anything beyond the ends of the arrays is gone.
    pub fn take_changes(&mut self) -> SurfaceChanges {
        SurfaceChanges {
            vertices: self.changed_vertices.take(self.positions.len()),
            triangles: self.changed_triangles.take(self.indices.len()),
        }
    }

    /// Extracts everything anew, with the help of what is known of the mesh.
    fn rebuild(&mut self, mesh: &MeshView<'_>, isovalues: Vec<f32>) {
        assert!(mesh.tets.len() < 1 << 31, "too many tetrahedra");
        let points = mesh.positions.len();
        self.isovalues = isovalues;
        self.state = State::Of(points, mesh.tets.len());
        self.tets = mesh.tets.len();
        self.links = None;
        self.positions.clear();
        self.normals.clear();
        self.values.clear();
        self.indices.clear();
        self.owners.clear();
        self.crossings.clear();
        if self.snapshot.is_none() || self.kind == NormalKind::Smooth {
            self.gradients.clear(points);
        }
        for which in 0..self.isovalues.len() {
            self.find_cut(mesh, self.isovalues[which]);
            self.march(mesh, which);
        }
        self.place(mesh);
        self.mend_normals();
        self.changed_vertices.mark_all(self.positions.len());
        self.changed_triangles.mark_all(self.indices.len());
    }

    /// Finds the tetrahedra that are cut at `value`.
    fn find_cut(&mut self, mesh: &MeshView<'_>, value: f32) {
        self.cut.clear();
        if let Some(snapshot) = self.snapshot.as_ref().filter(|snapshot| !snapshot.is_passed_widely(value)) {
            for block in snapshot.blocks_at(value) {
                let first = block * cut::BLOCK;
                let tets = &mesh.tets[first..mesh.tets.len().min(first + cut::BLOCK)];
                cut::find_cut_in_block(tets, first as u32, (mesh.field, value), &mut self.cut);
            }
        } else {
            cut::set_sides(&mut self.sides, mesh.field, value);
            cut::find_cut(mesh.tets, &self.sides, &mut self.cut);
        }
    }

    /// Finds the triangles, and the crossings that are their vertices.
    fn march(&mut self, mesh: &MeshView<'_>, which: usize) {
        let at = (which as u32, self.isovalues[which]);
        for t in &self.cut {
            let tet = mesh.tets[*t as usize];
            let triangles = cut::triangles(&mut self.crossings, tet, mesh.field, at);
            for (rank, triangle) in (0..).zip(triangles) {
                if triangle[0] != NONE {
                    self.indices.push(triangle);
                    self.owners.push(t << 1 | rank);
                }
            }
        }
    }

    /// Sets all that belongs to the vertices, but for the normals that [`Self::mend_normals`] gives.
    fn place(&mut self, mesh: &MeshView<'_>) {
        let Self { positions, normals, values, isovalues, crossings, gradients, .. } = self;
        let by_gradient = self.kind == NormalKind::Gradient;
        if by_gradient {
            let ends = crossings.list.iter().flat_map(|crossing| crossing.ends);
            gradients.sum(mesh, ends, self.snapshot.as_deref_mut(), &mut self.sides);
        }
        let count = crossings.list.len();
        positions.reserve(count);
        normals.reserve(count);
        values.reserve(count);
        for crossing in &crossings.list {
            let value = isovalues[crossing.which as usize];
            let t = crossing.fraction(mesh.field, value);
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
        let mut sums = vec![[0.0; 3]; self.normals.len()];
        for triangle in &self.indices {
            let area = self.area(*triangle);
            for v in triangle {
                (0..3).for_each(|i| sums[*v as usize][i] += area[i]);
            }
        }
        for (normal, sum) in self.normals.iter_mut().zip(sums).filter(|(normal, _)| **normal == NO_NORMAL) {
            *normal = unit(sum).unwrap_or(UP);
        }
    }

    /// Twice the area of a triangle, along its normal.
    fn area(&self, triangle: [u32; 3]) -> [f64; 3] {
        let [a, b, c] = triangle.map(|v| self.positions[v as usize].map(f64::from));
        cross(sub(b, a), sub(c, a))
    }
}

/// In place of a normal that cannot be told.
const NO_NORMAL: [f32; 3] = [0.0; 3];

/// The normal of a vertex that has no other.
const UP: [f32; 3] = [0.0, 0.0, 1.0];

/// The isovalues as the field is rounded, without those that come again and those that are no number.
fn distinct(values: &[f64]) -> Vec<f32> {
    let mut distinct = Vec::with_capacity(values.len());
    for value in values.iter().map(|value| *value as f32) {
        if !value.is_nan() && !distinct.contains(&value) {
            distinct.push(value);
        }
    }
    distinct
}
