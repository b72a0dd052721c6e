//! The part of a mesh in which a field is within a range, as a mesh: tetrahedra are cut where the field crosses an end of the range.
//!
//! What holds:
//! - It is the part of the domain where the field, linear in each tetrahedron, is between the ends or equal to one; parts without a volume
//!   are left out, and so are all tetrahedra that touch it only. Its boundary follows the isosurfaces at both ends.
//! - It conforms: pieces of neighbours share their faces, whose triangles depend on the corners of the face alone. Regions that have points of
//!   their own at one place are neighbours where their faces are at the same places; where the field jumps, they are cut in different places.
//! - Points keep their numbers; those on edges that are cut come behind them, as the isosurfaces have them. Tetrahedra that are whole
//!   keep their numbers, and the first piece of each other one has its number; all other pieces come behind. What is left out is a free slot.
//! - Same mesh, same bytes; and how pieces are cut depends on the places of points, not on their numbers, which another way to the same mesh
//!   gives otherwise.

use super::marching::{Crossing, Crossings, Polygon};
use super::{FieldView, MeshView};
use crate::mesh::{FACES, NONE};
use std::cmp::Ordering;

/// A mesh within a range of a field.
#[derive(Clone, Debug)]
pub struct MeshWithin {
    positions: Vec<[f64; 3]>,
    values: Vec<f64>,
    tets: Vec<[u32; 4]>,
    neighbors: Vec<[u32; 4]>,
    /// Of each point that is new, where it is: how far along its edge, 0 to 1.
    cuts: Vec<(Crossing, f64)>,
    /// Of each tetrahedron behind those of the mesh, which one it is a piece of.
    wholes: Vec<u32>,
}

/// What is cut.
struct Cutter<'a> {
    by: &'a [f64],
    ends: [f64; 2],
    positions: &'a [[f64; 3]],
    /// Points of the mesh.
    points: u32,
    crossings: Crossings,
}

/// A face of what is left of a tetrahedron: a triangle of which each end cuts off at most one corner, or what an end cuts open.
#[derive(Clone, Copy, Debug, Default)]
struct Face {
    corners: [u32; 6],
    len: usize,
}

impl Face {
    fn push(&mut self, corner: u32) {
        self.corners[self.len] = corner;
        self.len += 1;
    }

    fn corners(&self) -> &[u32] {
        &self.corners[..self.len]
    }

    /// The triangles of the face, all with its first corner in the order of places.
    fn triangles(&self, cutter: &Cutter<'_>) -> impl Iterator<Item = [u32; 3]> {
        let smallest =
            (0..self.len).min_by(|&i, &j| cutter.compare(self.corners[i], self.corners[j])).unwrap_or(0);
        let corner = move |i: usize| self.corners[(smallest + i) % self.len];
        (2..self.len).map(move |i| [corner(0), corner(i - 1), corner(i)])
    }
}

/// Where the corners of a face are, ascending, and the tetrahedron and the corner that it is opposite.
type PlacedFace = ([[u64; 3]; 3], (u32, usize));

impl Cutter<'_> {
    fn is_within(&self, point: u32) -> bool {
        let value = self.by[point as usize];
        value >= self.ends[0] && value <= self.ends[1]
    }

    /// Where a point is, of the mesh or a new one.
    fn place(&self, point: u32) -> [f64; 3] {
        match point.checked_sub(self.points) {
            None => self.positions[point as usize],
            Some(new) => {
                let crossing = &self.crossings.list[new as usize];
                let end = self.ends[crossing.which as usize];
                crossing.place(self.positions, crossing.fraction(end, |point| self.by[point as usize]))
            }
        }
    }

    /// Of faces without a neighbour, each a tetrahedron and a corner opposite, those between regions that have points of their own there: they are at
    /// the same places, and of tetrahedra that were neighbours.
    fn pairs_of_regions(
        &self,
        mesh: &MeshView<'_>,
        alone: &[(u32, usize)],
        (tets, wholes): (&[[u32; 4]], &[u32]),
    ) -> Vec<[(u32, usize); 2]> {
        let whole = |t: u32| (t as usize).checked_sub(mesh.tets.len()).map_or(t, |piece| wholes[piece]);
        let is_at_other_points = |t: u32, n: u32| {
            let other = if n == NONE { return false } else { mesh.tets[n as usize] };
            mesh.tets[t as usize].iter().filter(|v| other.contains(v)).count() < 3
        };
        let mut faces: Vec<PlacedFace> = Vec::new();
        for &(t, i) in alone {
            let own = whole(t);
            if mesh.neighbors[own as usize].into_iter().any(|n| is_at_other_points(own, n)) {
                let mut places =
                    FACES[i].map(|k| self.place(tets[t as usize][k]).map(|x| (x + 0.0).to_bits()));
                places.sort_unstable();
                faces.push((places, (t, i)));
            }
        }
        faces.sort_unstable();
        let mut pairs = Vec::new();
        for group in faces.chunk_by(|a, b| a.0 == b.0) {
            for (k, (_, a)) in group.iter().enumerate() {
                let is_beside =
                    |(_, b): &&PlacedFace| mesh.neighbors[whole(a.0) as usize].contains(&whole(b.0));
                pairs.extend(group[k + 1..].iter().find(is_beside).map(|(_, b)| [*a, *b]));
            }
        }
        pairs
    }

    /// The order of points by their places; of those at one place by their numbers.
    fn compare(&self, a: u32, b: u32) -> Ordering {
        let ([x, y, z], [u, v, w]) = (self.place(a), self.place(b));
        x.total_cmp(&u).then(y.total_cmp(&v)).then(z.total_cmp(&w)).then(a.cmp(&b))
    }

    /// Adds the points between two corners, from the first to the second.
    fn cross(&mut self, [p, q]: [u32; 2], face: &mut Face) {
        let ascends = self.by[p as usize] < self.by[q as usize];
        let edge = if ascends { [p, q] } else { [q, p] };
        let [least, most] = edge.map(|point| self.by[point as usize]);
        for which in if ascends { [0, 1] } else { [1, 0] } {
            if least < self.ends[which] && self.ends[which] < most {
                face.push(self.points + self.crossings.vertex(edge, which as u32));
            }
        }
    }

    /// What an end cuts open, seen from outside.
    fn opened(&mut self, tet: [u32; 4], which: usize) -> Face {
        let end = self.ends[which];
        let bits = |is: &dyn Fn(f64) -> bool| {
            (0..4).filter(|&i| is(self.by[tet[i] as usize])).fold(0, |bits, i| bits | 1 << i)
        };
        let [below, touched, above] =
            [bits(&|value| value < end), bits(&|value| value == end), bits(&|value| value > end)];
        let mut face = Face::default();
        // A face of the tetrahedron in which all values are the end is one already.
        if [below, above][which] == 0 {
            return face;
        }
        let polygon = Polygon::of(tet, below, touched);
        let polygon = if which == 0 { polygon } else { polygon.reversed() };
        for &ends in polygon.corners() {
            let is_point = ends[0] == ends[1];
            face.push(if is_point {
                ends[0]
            } else {
                self.points + self.crossings.vertex(ends, which as u32)
            });
        }
        face
    }

    /// The pieces of a tetrahedron.
    fn cut(&mut self, tet: [u32; 4], pieces: &mut Vec<[u32; 4]>) {
        let mut faces = [Face::default(); 6];
        for (face, corners) in faces.iter_mut().zip(FACES) {
            let corners = corners.map(|corner| tet[corner]);
            for k in 0..3 {
                let [p, q] = [corners[k], corners[(k + 1) % 3]];
                if self.is_within(p) {
                    face.push(p);
                }
                self.cross([p, q], face);
            }
        }
        faces[4] = self.opened(tet, 0);
        faces[5] = self.opened(tet, 1);
        let faces = faces.iter().filter(|face| face.len > 2);
        let corners = faces.clone().flat_map(Face::corners).copied();
        let Some(apex) = corners.min_by(|&a, &b| self.compare(a, b)) else { return };
        let opposite = faces.filter(|face| !face.corners().contains(&apex));
        pieces.extend(opposite.flat_map(|face| face.triangles(self)).map(|[a, b, c]| [a, c, b, apex]));
    }
}

impl MeshWithin {
    /// The part of `mesh` in which the field with the numbers `by`, one a point, is within `range`. Where that is a single value, tetrahedra
    /// are left that have it everywhere.
    ///
    /// # Panics
    /// If the mesh names a point or a neighbour that it does not have, or there are fewer numbers than points.
    pub fn of(mesh: &MeshView<'_>, by: &[f64], range: [f64; 2]) -> Self {
        let points = mesh.positions.len() as u32;
        let mut cutter =
            Cutter { by, ends: range, positions: mesh.positions, points, crossings: Crossings::default() };
        let within: Vec<bool> = (0..points).map(|point| cutter.is_within(point)).collect();
        let is_whole = |tet: &[u32; 4]| tet[0] != NONE && tet.iter().all(|&point| within[point as usize]);
        let mut tets = vec![[NONE; 4]; mesh.tets.len()];
        let (mut wholes, mut pieces, mut open) = (Vec::new(), Vec::new(), Vec::new());
        for (t, tet) in (0..).zip(mesh.tets) {
            if is_whole(tet) {
                tets[t as usize] = *tet;
                continue;
            }
            if tet[0] == NONE || range[0] >= range[1] {
                continue;
            }
            pieces.clear();
            cutter.cut(*tet, &mut pieces);
            for (i, piece) in pieces.iter().enumerate() {
                if i == 0 {
                    tets[t as usize] = *piece;
                    open.push(t);
                } else {
                    open.push(tets.len() as u32);
                    tets.push(*piece);
                    wholes.push(t);
                }
            }
        }
        let mut neighbors = vec![[NONE; 4]; tets.len()];
        let mut halves: Vec<([u32; 3], u32, usize)> = Vec::new();
        let half = |t: u32, i: usize| {
            let mut face = FACES[i].map(|corner| tets[t as usize][corner]);
            face.sort_unstable();
            (face, t, i)
        };
        for (t, _) in (0..).zip(mesh.tets).filter(|(_, tet)| is_whole(tet)) {
            for (i, n) in mesh.neighbors[t as usize].into_iter().enumerate().filter(|(_, n)| *n != NONE) {
                if is_whole(&mesh.tets[n as usize]) {
                    neighbors[t as usize][i] = n;
                } else {
                    halves.push(half(t, i));
                }
            }
        }
        halves.extend(open.into_iter().flat_map(|t| (0..4).map(move |i| (t, i))).map(|(t, i)| half(t, i)));
        halves.sort_unstable();
        let mut alone = Vec::new();
        for group in halves.chunk_by(|a, b| a.0 == b.0) {
            match group {
                &[(_, t, i), (_, s, j)] => (neighbors[t as usize][i], neighbors[s as usize][j]) = (s, t),
                _ => alone.extend(group.iter().map(|&(_, t, i)| (t, i))),
            }
        }
        for [(t, i), (s, j)] in cutter.pairs_of_regions(mesh, &alone, (&tets, &wholes)) {
            (neighbors[t as usize][i], neighbors[s as usize][j]) = (s, t);
        }
        let (positions, values) = (mesh.positions.to_vec(), by[..points as usize].to_vec());
        let mut new = Self { positions, values, tets, neighbors, cuts: Vec::new(), wholes };
        for crossing in &cutter.crossings.list {
            let end = range[crossing.which as usize];
            let t = crossing.fraction(end, |point| by[point as usize]);
            new.positions.push(crossing.place(mesh.positions, t));
            new.values.push(end);
            new.cuts.push((*crossing, t));
        }
        new
    }

    /// The mesh, with a field of its points: [`MeshWithin::values`], or what [`MeshWithin::interpolate`] gives.
    pub fn view<'a>(&'a self, field: impl Into<FieldView<'a>>) -> MeshView<'a> {
        let Self { positions, tets, neighbors, .. } = self;
        let FieldView { values: field, is_label } = field.into();
        MeshView { positions, field, is_label, tets, neighbors }
    }

    /// The field that it is cut by, at all points: at those that are new just an end of the range.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Another field of the mesh that was cut, given by one number a point, at all points of this one.
    ///
    /// # Panics
    /// If there are fewer numbers than points in the mesh that was cut.
    pub fn interpolate<'f>(&self, field: impl Into<FieldView<'f>>) -> Vec<f64> {
        let field = field.into();
        let own = self.positions.len() - self.cuts.len();
        let new = self.cuts.iter().map(|(crossing, t)| crossing.value(field, *t));
        field.values[..own].iter().copied().chain(new).collect()
    }

    /// Bytes of the mesh.
    pub fn bytes(&self) -> usize {
        let points =
            size_of_val(&self.positions[..]) + size_of_val(&self.values[..]) + size_of_val(&self.cuts[..]);
        points + 2 * size_of_val(&self.tets[..]) + size_of_val(&self.wholes[..])
    }

    /// What each tetrahedron of the mesh that was cut has, for each of this one.
    ///
    /// # Panics
    /// If there are fewer than these tetrahedra.
    pub fn of_tets<T: Copy>(&self, all: &[T]) -> Vec<T> {
        let own = self.tets.len() - self.wholes.len();
        all[..own].iter().copied().chain(self.wholes.iter().map(|t| all[*t as usize])).collect()
    }
}
