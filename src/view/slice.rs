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

use crate::mesh::NONE;
use crate::view::MeshView;
use crate::view::SurfaceChanges;
use crate::view::patches::Crossing;
use crate::view::patches::Patches;
use crate::view::patches::Polygon;
use crate::view::patches::Watch;
use crate::view::patches::side;
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

/// The section of a mesh with a plane.
#[derive(Clone, Debug, Default)]
pub struct Slice {
    plane: Option<Plane>,
    positions: Vec<[f32; 3]>,
    values: Vec<f32>,
    /// Of each point of the mesh, the side of the plane that it is on.
    sides: Vec<u8>,
    patches: Patches,
    /// Once the mesh has changed: what it was.
    watch: Option<Watch>,
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

    /// The value at each vertex of another field of the mesh that was sliced, given by one number a point.
    ///
    /// # Panics
    /// If there are fewer points or numbers than in the mesh that was sliced.
    pub fn interpolate(&self, mesh: &MeshView<'_>, field: &[f32]) -> Vec<f32> {
        let mut values = vec![0.0; self.positions.len()];
        if let Some(plane) = &self.plane {
            self.patches.each_vertex(|v, crossing| {
                values[v] = value(field, crossing, fraction(plane, mesh, crossing));
            });
        }
        values
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
        self.watch = None;
        self.cut(mesh, plane);
    }

    /// Brings the section with the same plane up to date, given in which ranges points (or their values) and
    /// tetrahedra (or their neighbours) have changed since; does nothing before the first [`Slice::extract`].
    ///
    /// The first time after [`Slice::extract`], and where most of the mesh has changed, this costs a pass over the
    /// mesh; else what changed. Wider ranges than needed cost a little more and change nothing else.
    ///
    /// # Panics
    /// If the mesh names a point or a neighbour that it does not have.
    pub fn update(&mut self, mesh: &MeshView<'_>, points: &[Range<u32>], tets: &[Range<u32>]) {
        let Some(plane) = self.plane else { return };
        let most = is_most(points, mesh.positions.len()) || is_most(tets, mesh.tets.len());
        match &mut self.watch {
            Some(watch) if !most => {
                self.sides.resize(mesh.positions.len(), side::NOWHERE);
                for p in within(points, mesh.positions.len()) {
                    self.sides[p as usize] = side::of(plane.height(mesh.positions[p as usize]));
                }
                let (sides, patches) = (&self.sides, &mut self.patches);
                watch.look(mesh, points, tets, |t| patches.has_piece(t) || may_pass(sides, mesh, t));
                // All pieces go before the first comes, so that no old vertex is taken for a new one.
                patches.remove(&watch.dirty, mesh.tets.len());
                patches.resize(mesh.positions.len(), mesh.tets.len());
                watch.dirty.iter().for_each(|t| add(patches, sides, mesh, *t));
                patches.repack();
                self.place(mesh, &plane);
            }
            watch => {
                watch.get_or_insert_default().reset(mesh);
                self.cut(mesh, &plane);
            }
        }
    }

    fn cut(&mut self, mesh: &MeshView<'_>, plane: &Plane) {
        self.patches.clear(mesh.positions.len(), mesh.tets.len());
        self.positions.clear();
        self.values.clear();
        self.sides.clear();
        self.sides.extend(mesh.positions.iter().map(|p| side::of(plane.height(*p))));
        for t in 0..mesh.tets.len() as u32 {
            add(&mut self.patches, &self.sides, mesh, t);
        }
        self.place(mesh, plane);
    }

    /// Which parts of the arrays have changed since this was last asked.
    pub fn take_changes(&mut self) -> SurfaceChanges {
        let [vertices, triangles] = self.patches.take_changes();
        SurfaceChanges { vertices, triangles }
    }

    /// Sets the positions and values of new vertices.
    fn place(&mut self, mesh: &MeshView<'_>, plane: &Plane) {
        self.positions.resize(self.patches.vertex_count(), [0.0; 3]);
        self.values.resize(self.patches.vertex_count(), 0.0);
        let Self { positions, values, patches, .. } = self;
        patches.place_fresh(|v, crossing| {
            let [p, q] = crossing.map(|point| mesh.positions[point as usize]);
            let t = fraction(plane, mesh, crossing);
            positions[v] = [0, 1, 2].map(|i| between(p[i], q[i], t));
            values[v] = value(mesh.field, crossing, t);
        });
    }
}

/// How far a crossing is from the end below to the end above, 0 to 1.
fn fraction(plane: &Plane, mesh: &MeshView<'_>, crossing: Crossing) -> f64 {
    let [low, high] = crossing.map(|point| plane.height(mesh.positions[point as usize]));
    if crossing[0] == crossing[1] { 0.0 } else { low / (low - high) }
}

fn value(field: &[f32], [a, b]: Crossing, t: f64) -> f32 {
    between(field[a as usize], field[b as usize], t)
}

fn between(x: f32, y: f32, t: f64) -> f32 {
    (f64::from(x) + t * (f64::from(y) - f64::from(x))) as f32
}

/// Whether ranges are more than half of so many entries.
fn is_most(ranges: &[Range<u32>], len: usize) -> bool {
    ranges.iter().fold(0_usize, |sum, range| sum.saturating_add(range.len())) > len / 2
}

/// Whether a tetrahedron may have a piece. A free slot has no corners.
fn may_pass(sides: &[u8], mesh: &MeshView<'_>, t: u32) -> bool {
    let tet = mesh.tets[t as usize];
    tet[0] != NONE && side::may_pass(tet.iter().fold(0, |all, p| all | sides[*p as usize]))
}

/// Adds the piece of a tetrahedron, if it has one.
fn add(patches: &mut Patches, sides: &[u8], mesh: &MeshView<'_>, t: u32) {
    if may_pass(sides, mesh, t) {
        let (tet, around) = (mesh.tets[t as usize], mesh.neighbors[t as usize]);
        let polygon = Polygon::of(tet, tet.map(|p| sides[p as usize]), around);
        patches.add(t, &polygon.reversed());
    }
}
