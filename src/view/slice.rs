//! The mesh in a plane: triangles with the field's values, from scratch or kept up at the cost of what changed.
//!
//! What holds:
//! - The triangles cover what the plane and the domain have in common, once: a face that lies in the plane comes from
//!   the tetrahedron below it or, at the bottom of the domain, from the one above. Where plane and domain have less
//!   than an area in common there is nothing.
//! - Corners are counter-clockwise when seen from the side that the normal points to.
//! - Vertices are shared, and a point that lies exactly in the plane is used itself; inside the section every directed
//!   side of a triangle has its opposite.
//! - After [`Slice::update`] the triangles are those that [`Slice::extract`] would give, in another order.

use crate::view::MeshView;
use crate::view::patches::Patches;
use crate::view::patches::Polygon;
use crate::view::patches::Watch;
use crate::view::patches::within;
use std::ops::Range;

/// The plane of all points `p` with `normal · p = offset`, in model units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Any length but zero.
    pub normal: [f64; 3],
    /// `normal · p` of the points of the plane.
    pub offset: f64,
}

impl Plane {
    /// The plane through a point.
    pub fn through(point: [f64; 3], normal: [f64; 3]) -> Self {
        Self { normal, offset: (0..3).map(|i| normal[i] * point[i]).sum() }
    }

    /// How far a point is above the plane, times the length of the normal.
    pub fn height(&self, p: [f32; 3]) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|i| self.normal[i] * f64::from(p[i]));
        x + y + z - self.offset
    }
}

/// Which parts of a surface's arrays have changed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SurfaceChanges {
    /// Changed ranges of vertices.
    pub vertices: Vec<Range<u32>>,
    /// Changed ranges of triangles.
    pub triangles: Vec<Range<u32>>,
}

/// The section of a mesh with a plane.
#[derive(Clone, Debug, Default)]
pub struct Slice {
    plane: Option<Plane>,
    positions: Vec<[f32; 3]>,
    values: Vec<f32>,
    /// Of each point of the mesh.
    heights: Vec<f64>,
    patches: Patches,
    watch: Watch,
}

impl Slice {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Vertices in model units. After updates there may be some that no triangle names.
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// The field's value at each vertex.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Triangles, counter-clockwise when seen from where the normal points to.
    pub fn indices(&self) -> &[[u32; 3]] {
        &self.patches.triangles
    }

    /// Which sides of each triangle lie in faces of the mesh: bit `k` is for the side from corner `k` to the next.
    pub fn cell_sides(&self) -> &[u8] {
        &self.patches.sides
    }

    /// Replaces `lines` by the sections of the mesh's faces, each once, in ascending order.
    pub fn cell_edges(&self, lines: &mut Vec<[u32; 2]>) {
        lines.clear();
        for (triangle, sides) in self.indices().iter().zip(self.cell_sides()) {
            for k in (0..3).filter(|k| sides >> k & 1 == 1) {
                let [a, b] = [triangle[k], triangle[(k + 1) % 3]];
                lines.push([a.min(b), a.max(b)]);
            }
        }
        lines.sort_unstable();
        lines.dedup();
    }

    /// Replaces the section by that of `mesh` with `plane`. Costs one pass over the mesh.
    ///
    /// # Panics
    /// If the mesh names a point that it does not have.
    pub fn extract(&mut self, mesh: &MeshView<'_>, plane: &Plane) {
        self.plane = Some(*plane);
        self.watch.reset(mesh);
        self.patches.clear(mesh.positions.len(), mesh.tets.len());
        self.positions.clear();
        self.values.clear();
        self.heights.clear();
        self.heights.extend(mesh.positions.iter().map(|p| plane.height(*p)));
        for t in 0..mesh.tets.len() as u32 {
            add(&mut self.patches, &self.heights, mesh, t);
        }
        self.place(mesh);
    }

    /// Brings the section with the same plane up to date, given in which ranges points (or their values) and
    /// tetrahedra (or their neighbours) have changed since; does nothing before the first [`Slice::extract`].
    ///
    /// Costs what changed. Wider ranges than needed cost a little more and change nothing else.
    ///
    /// # Panics
    /// If the mesh names a point or a neighbour that it does not have.
    pub fn update(&mut self, mesh: &MeshView<'_>, points: &[Range<u32>], tets: &[Range<u32>]) {
        let Some(plane) = self.plane else { return };
        self.watch.look(mesh, points, tets);
        self.heights.resize(mesh.positions.len(), 0.0);
        for p in within(points, mesh.positions.len()) {
            self.heights[p as usize] = plane.height(mesh.positions[p as usize]);
        }
        // All pieces go before the first comes, so that no old vertex is taken for a new one.
        self.patches.remove(&self.watch.dirty, mesh.tets.len());
        self.patches.resize(mesh.positions.len(), mesh.tets.len());
        for t in &self.watch.dirty {
            add(&mut self.patches, &self.heights, mesh, *t);
        }
        self.patches.repack();
        self.place(mesh);
    }

    /// Which parts of the arrays have changed since this was last asked.
    pub fn take_changes(&mut self) -> SurfaceChanges {
        let [vertices, triangles] = self.patches.take_changes();
        SurfaceChanges { vertices, triangles }
    }

    /// Sets the positions and values of new vertices.
    fn place(&mut self, mesh: &MeshView<'_>) {
        self.positions.resize(self.patches.vertex_count(), [0.0; 3]);
        self.values.resize(self.patches.vertex_count(), 0.0);
        let Self { positions, values, heights, patches, .. } = self;
        patches.place_fresh(|v, crossing| {
            let [a, b] = crossing.map(|p| p as usize);
            let t = if a == b { 0.0 } else { heights[a] / (heights[a] - heights[b]) };
            let between = |x: f32, y: f32| (f64::from(x) + t * (f64::from(y) - f64::from(x))) as f32;
            let (p, q) = (mesh.positions[a], mesh.positions[b]);
            positions[v] = [0, 1, 2].map(|i| between(p[i], q[i]));
            values[v] = between(mesh.field[a], mesh.field[b]);
        });
    }
}

fn add(patches: &mut Patches, heights: &[f64], mesh: &MeshView<'_>, t: u32) {
    let tet = mesh.tets[t as usize];
    // A free slot has no corners and so no heights.
    let height = |p: u32| heights.get(p as usize).copied().unwrap_or(f64::INFINITY);
    let heights = tet.map(height);
    let (mut low, mut high) = (heights[0], heights[0]);
    for h in heights {
        low = low.min(h);
        high = high.max(h);
    }
    if low <= 0.0 && high >= 0.0 {
        patches.add(t, &Polygon::of(tet, heights, mesh.neighbors[t as usize]).reversed());
    }
}
