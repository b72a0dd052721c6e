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

use super::marching::{Crossing, Pieces, Polygon, select};
use super::mesh_snapshot::{MeshSnapshot, entries};
use super::{FieldView, MeshView, SurfaceChanges};
use crate::mesh::{FACES, NONE};
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
    pub fn height(&self, p: [f64; 3]) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|i| self.normal[i] * p[i]);
        x + y + z - self.offset
    }

    fn height_at(&self, mesh: &MeshView<'_>, point: u32) -> f64 {
        self.height(mesh.positions[point as usize])
    }

    /// The position of a vertex and the field's value there.
    fn vertex(&self, mesh: &MeshView<'_>, crossing: &Crossing) -> ([f64; 3], f64) {
        let t = crossing.fraction(0.0, |p| self.height_at(mesh, p));
        (crossing.place(mesh.positions, t), crossing.value(mesh.own_field(), t))
    }
}

/// The section of a mesh with a plane.
#[derive(Clone, Debug, Default)]
pub struct Slice {
    plane: Option<Plane>,
    positions: Vec<[f64; 3]>,
    values: Vec<f64>,
    indices: Vec<[u32; 3]>,
    pieces: Pieces,
    /// Of each point of the mesh, the side of the plane that it is on.
    sides: Vec<u8>,
    /// Scratch: tetrahedra that may be cut.
    cut: Vec<u32>,
    /// Once the mesh has changed: what it was.
    snapshot: Option<MeshSnapshot>,
}

impl Slice {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Vertices in model units.
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.positions
    }

    /// The field's value at each vertex.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The value at each vertex of another field of the mesh that was sliced, given by one number a point.
    ///
    /// # Panics
    /// If there are fewer points or numbers than in the mesh that was sliced.
    pub fn interpolate<'f>(&self, mesh: &MeshView<'_>, field: impl Into<FieldView<'f>>) -> Vec<f64> {
        let field = field.into();
        self.crossings(mesh).map(|(crossing, t)| crossing.value(field, t)).collect()
    }

    /// On which edge of the mesh each vertex is, and how far along.
    fn crossings(&self, mesh: &MeshView<'_>) -> impl Iterator<Item = (&Crossing, f64)> {
        let list = self.plane.as_ref().map(|plane| (plane, self.pieces.crossings.list.iter()));
        list.into_iter().flat_map(move |(plane, list)| {
            list.map(move |crossing| (crossing, crossing.fraction(0.0, |p| plane.height_at(mesh, p))))
        })
    }

    /// Where each vertex is, as [`LabelParts`](super::LabelParts) takes it.
    #[doc(hidden)]
    pub fn edge_places(&self, mesh: &MeshView<'_>) -> Vec<([u32; 2], f64)> {
        self.crossings(mesh).map(|(crossing, t)| (crossing.ends, t)).collect()
    }

    /// Triangles, counter-clockwise when seen from where the normal points to.
    pub fn indices(&self) -> &[[u32; 3]] {
        &self.indices
    }

    /// Which sides of each triangle lie in faces of the mesh: bit `k` is for the side from corner `k` to the next.
    pub fn cell_sides(&self) -> Vec<u8> {
        self.pieces.polygon_sides()
    }

    /// Replaces `lines` by the sections of the mesh's faces, each once, in ascending order.
    pub fn cell_edges(&self, lines: &mut Vec<[u32; 2]>) {
        let mut keys = Vec::new();
        for (triangle, sides) in self.indices().iter().zip(self.cell_sides()) {
            for k in (0..3).filter(|k| sides >> k & 1 == 1) {
                let [a, b] = [triangle[k], triangle[(k + 1) % 3]];
                keys.push(u64::from(a.min(b)) << 32 | u64::from(a.max(b)));
            }
        }
        keys.sort_unstable();
        keys.dedup();
        lines.clear();
        lines.extend(keys.into_iter().map(|key| [(key >> 32) as u32, key as u32]));
    }

    /// Replaces the section by that of `mesh` with `plane`. Costs one pass over the mesh.
    ///
    /// # Panics
    /// If the mesh names a point that it does not have.
    pub fn extract(&mut self, mesh: &MeshView<'_>, plane: &Plane) {
        self.plane = Some(*plane);
        self.snapshot = None;
        self.rebuild(mesh, plane);
    }

    /// Brings the section with the same plane up to date, given in which ranges points (or their values) and
    /// tetrahedra (or their neighbours) have changed since; does nothing before the first [`Slice::extract`].
    ///
    /// The first time after [`Slice::extract`] this costs a pass over the mesh; else what changed. Wider ranges than needed cost
    /// a little more and change nothing else.
    ///
    /// # Panics
    /// If the mesh names a point or a neighbour that it does not have.
    pub fn update(&mut self, mesh: &MeshView<'_>, points: &[Range<u32>], tets: &[Range<u32>]) {
        let Some(plane) = self.plane else { return };
        let Some(snapshot) = &mut self.snapshot else {
            self.snapshot = Some(MeshSnapshot::new(mesh));
            return self.rebuild(mesh, &plane);
        };
        let before = self.sides.len();
        self.sides.resize(mesh.positions.len(), side::NOWHERE);
        for p in entries(points, before, mesh.positions.len()) {
            self.sides[p as usize] = side::of(plane.height_at(mesh, p));
        }
        let Self { pieces, indices, sides, .. } = self;
        pieces.follow(indices);
        let mut dirty = snapshot.catch_up(mesh, points, tets).tets;
        let is_there = |tet: &[u32; 4]| tet[0] != NONE && may_pass(sides, tet);
        dirty.retain(|t| pieces.has_piece(*t) || is_there(&mesh.tets[*t as usize]));
        // A face in the plane comes from another tetrahedron when what was across it has changed.
        dirty.extend(entries(tets, mesh.tets.len(), mesh.tets.len()).filter(|&t| {
            let may_have_floor = pieces.has_piece(t) || mesh.neighbors[t as usize].contains(&NONE);
            may_have_floor && sides_of(sides, mesh, t).is_some_and(is_above)
        }));
        dirty.sort_unstable();
        dirty.dedup();
        self.splice(mesh, &plane, &dirty);
    }

    /// Cuts the dirty tetrahedra again.
    fn splice(&mut self, mesh: &MeshView<'_>, plane: &Plane, dirty: &[u32]) {
        let Self { pieces, indices, positions, values, sides, .. } = self;
        let piece = |t, _| sides_of(sides, mesh, t).map_or(Polygon::default(), |of| polygon(mesh, t, of));
        let edited = pieces.recut(indices, mesh.tets.len(), dirty, 1, piece).list;
        let old = positions.len();
        positions.resize(pieces.crossings.list.len(), [0.0; 3]);
        values.resize(pieces.crossings.list.len(), 0.0);
        pieces.place_again(&edited, old, |v, crossing| {
            let before = bits(positions[v], values[v]);
            (positions[v], values[v]) = plane.vertex(mesh, crossing);
            before != bits(positions[v], values[v])
        });
        pieces.drop_unused(indices, edited, |v| {
            positions.swap_remove(v);
            values.swap_remove(v);
        });
    }

    fn rebuild(&mut self, mesh: &MeshView<'_>, plane: &Plane) {
        let Self { pieces, indices, positions, values, sides, cut, .. } = self;
        pieces.clear(mesh.tets.len());
        indices.clear();
        sides.clear();
        sides.extend(mesh.positions.iter().map(|p| side::of(plane.height(*p))));
        cut.clear();
        select(mesh.tets, 0, cut, |tet| may_pass(sides, tet));
        for &t in &*cut {
            let sides = mesh.tets[t as usize].map(|p| sides[p as usize]);
            pieces.push(indices, t, 0, &polygon(mesh, t, sides));
        }
        (*positions, *values) =
            pieces.crossings.list.iter().map(|crossing| plane.vertex(mesh, crossing)).unzip();
        pieces.mark_all();
    }

    /// The parts of the arrays that have changed since the last call.
    pub fn take_changes(&mut self) -> SurfaceChanges {
        self.pieces.take_changes()
    }
}

fn bits([x, y, z]: [f64; 3], value: f64) -> [u64; 4] {
    [x, y, z, value].map(f64::to_bits)
}

/// On which side of a plane a point is: bits, so that those of a tetrahedron can be put together.
mod side {
    /// Below: inside.
    pub const INSIDE: u8 = 1;
    /// In the plane itself.
    pub const TOUCHED: u8 = 2;
    /// Above: outside.
    pub const OUTSIDE: u8 = 4;
    /// Neither: a point that is no number is in no piece.
    pub const NOWHERE: u8 = 8;

    /// The side of a point at this height above the plane.
    #[inline]
    pub fn of(height: f64) -> u8 {
        if height < 0.0 {
            INSIDE
        } else if height > 0.0 {
            OUTSIDE
        } else if height == 0.0 {
            TOUCHED
        } else {
            NOWHERE
        }
    }
}

/// Whether a tetrahedron may have a piece. A free slot has no corners.
#[inline]
fn may_pass(sides: &[u8], tet: &[u32; 4]) -> bool {
    use side::{INSIDE, OUTSIDE, TOUCHED};
    if tet[0] == NONE {
        return false;
    }
    let all = tet.iter().fold(0, |all, p| all | sides[*p as usize]);
    // Nothing inside leaves faces at the bottom of the domain.
    all & TOUCHED != 0 && all & OUTSIDE != 0 || all & INSIDE != 0 && all & (TOUCHED | OUTSIDE) != 0
}

/// The sides of the corners of a tetrahedron; none of a free slot.
fn sides_of(sides: &[u8], mesh: &MeshView<'_>, t: u32) -> Option<[u8; 4]> {
    let tet = mesh.tets[t as usize];
    (tet[0] != NONE).then(|| tet.map(|p| sides[p as usize]))
}

/// Whether a tetrahedron has a face in the plane and lies above it.
fn is_above(sides: [u8; 4]) -> bool {
    sides.contains(&side::OUTSIDE) && sides.iter().filter(|side| **side == side::TOUCHED).count() == 3
}

/// The piece in a tetrahedron whose corners have these sides. A face that lies in the plane belongs to the tetrahedron below
/// it or, at the bottom of the domain, to the one above.
#[inline]
fn polygon(mesh: &MeshView<'_>, t: u32, sides: [u8; 4]) -> Polygon {
    let tet = mesh.tets[t as usize];
    let on = |side: u8| (0..4).fold(0, |bits, i| bits | usize::from(sides[i] == side) << i);
    if sides.contains(&side::NOWHERE) {
        return Polygon::default();
    }
    let top = sides.iter().position(|side| *side == side::OUTSIDE);
    let bottom = top.filter(|top| is_above(sides) && mesh.neighbors[t as usize][*top] == NONE);
    let polygon = match bottom {
        Some(top) => Polygon::of_face(FACES[top].map(|i| tet[i])),
        None => Polygon::of(tet, on(side::INSIDE), on(side::TOUCHED)),
    };
    // Seen from above.
    polygon.reversed()
}
