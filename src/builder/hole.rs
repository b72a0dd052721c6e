//! The hole that a vertex leaves when it is removed, what fills it, and how a filling is put into the mesh.

use super::collapse_check::Refusal;
use super::flat;
use super::work_mesh::{StarTet, TetSet, WorkMesh};
use crate::geom::{NARROW_BITS, orient3d};
use crate::mesh::{FACES, NONE};
use crate::mt::MAX_LINK;

/// The most tetrahedra around a vertex that is removed: what a sphere of [`MAX_LINK`] vertices has.
const MAX_HOLE: usize = 2 * MAX_LINK - 4;

/// The star of a vertex that may be removed. Reused from candidate to candidate.
#[derive(Default)]
pub(super) struct Hole {
    /// The vertex.
    pub a: u32,
    /// The tetrahedra around it.
    pub star: Vec<StarTet>,
    /// Their faces opposite `a`, ordered so that `(face, a)` is a positive tetrahedron, and the neighbours there.
    pub faces: Vec<([u32; 3], u32)>,
    /// The vertices of these faces, each once.
    pub link: Vec<u32>,
    /// For each of `link` how many of the faces have it.
    faces_at: Vec<u8>,
    /// Edges `xy` of the boundary triangles `axy`, which are ordered as seen from outside.
    pub border: Vec<[u32; 2]>,
    /// The planes of those triangles, if there are no more than two.
    planes: Vec<[[i32; 3]; 3]>,
    many_planes: bool,
    /// Whether the boundary must stay where it is: see [`flat::planes`].
    stays: bool,
    /// For each of `faces` a corner and the normal.
    sides: Vec<([i32; 3], [i64; 3])>,
    /// Whether orientations fit `i64`.
    narrow: bool,
    seen: TetSet,
}

/// Tetrahedra that fill a hole.
#[derive(Default)]
pub(super) struct Filling {
    pub tets: Vec<[u32; 4]>,
    /// Boundary triangles and the tetrahedra in `tets` that they belong to: first the `moved` ones in the place of those
    /// at the removed vertex, then those that were there before.
    pub border: Vec<(u32, [u32; 3])>,
    pub moved: usize,
}

impl Hole {
    /// Collects the hole that the removal of `a` would leave.
    pub fn open(&mut self, mesh: &WorkMesh, positions: &[[i32; 3]], a: u32) -> Result<(), Refusal> {
        self.a = a;
        if !mesh.star(a, MAX_HOLE, &mut self.seen, &mut self.star) {
            return Err(Refusal::Blocked);
        }
        self.faces.clear();
        self.link.clear();
        self.faces_at.clear();
        self.border.clear();
        for &StarTet { tet, corner } in &self.star {
            let (corners, around) = (mesh.tets[tet as usize], mesh.neighbors[tet as usize]);
            let corner = corner as usize;
            let [x, y, z] = FACES[corner].map(|k| corners[k]);
            self.faces.push(([x, z, y], around[corner]));
            for k in (0..4).filter(|&k| k != corner && around[k] == NONE) {
                let face = FACES[k];
                let at = face.iter().position(|&l| l == corner).unwrap_or(0);
                self.border.push([1, 2].map(|i| corners[face[(at + i) % 3]]));
            }
            for v in [x, y, z] {
                match self.link.iter().position(|&other| other == v) {
                    Some(i) => self.faces_at[i] += 1,
                    None => {
                        self.link.push(v);
                        self.faces_at.push(1);
                    }
                }
            }
            if self.link.len() > MAX_LINK {
                return Err(Refusal::Blocked);
            }
        }
        self.find_planes(positions);
        self.find_sides(positions);
        Ok(())
    }

    fn find_sides(&mut self, positions: &[[i32; 3]]) {
        let at = |v: u32| positions[v as usize];
        let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
        for p in self.link.iter().map(|&v| at(v)) {
            low = [0, 1, 2].map(|i| low[i].min(p[i]));
            high = [0, 1, 2].map(|i| high[i].max(p[i]));
        }
        // As in `orient3d`: differences up to 2^20 make sums of products below 2^63.
        self.narrow = (0..3).all(|i| high[i] - low[i] <= 1 << NARROW_BITS);
        self.sides.clear();
        self.sides.extend(self.faces.iter().map(|(face, _)| {
            let [x, y, z] = face.map(at);
            let [u, v] = [y, z].map(|p| [0, 1, 2].map(|i| i64::from(p[i] - x[i])));
            let minor = |i: usize, j: usize| u[i] * v[j] - u[j] * v[i];
            (x, [minor(1, 2), minor(2, 0), minor(0, 1)])
        }));
    }

    /// Whether face `i` and a link vertex at `p` make a positive tetrahedron.
    pub fn is_seen(&self, i: usize, p: [i32; 3]) -> bool {
        let (x, n) = self.sides[i];
        let d = [0, 1, 2].map(|k| i64::from(p[k] - x[k]));
        if self.narrow {
            n[0] * d[0] + n[1] * d[1] + n[2] * d[2] > 0
        } else {
            let product = |k: usize| i128::from(n[k]) * i128::from(d[k]);
            product(0) + product(1) + product(2) > 0
        }
    }

    /// How many tetrahedra there are if the vertex moves to `b`, which is in the link.
    pub fn left_at(&self, b: u32) -> usize {
        let at = self.link.iter().position(|&v| v == b);
        self.star.len() - at.map_or(0, |i| usize::from(self.faces_at[i]))
    }

    /// Whether the vertex is on the boundary.
    pub fn on_boundary(&self) -> bool {
        !self.border.is_empty()
    }

    fn find_planes(&mut self, positions: &[[i32; 3]]) {
        self.planes.clear();
        self.many_planes = false;
        let at = |v: u32| positions[v as usize];
        self.stays = flat::planes(self.border.iter().map(|&[x, y]| [self.a, x, y].map(at))).is_some();
        for &[x, y] in &self.border {
            let [p, q, r] = [self.a, x, y].map(at);
            if !self.planes.iter().any(|&[a, b, c]| orient3d(a, b, c, q) == 0 && orient3d(a, b, c, r) == 0) {
                if self.planes.len() == 2 {
                    self.many_planes = true;
                    return;
                }
                self.planes.push([p, q, r]);
            }
        }
    }

    /// Whether the boundary at the vertex is flat, or has one straight crease.
    pub fn is_flat(&self) -> bool {
        !self.many_planes
    }

    /// Whether three points lie in a plane of the boundary at the vertex. Meaningful where [`Hole::is_flat`].
    pub fn in_plane(&self, triangle: [[i32; 3]; 3]) -> bool {
        self.planes.iter().any(|&[a, b, c]| triangle.iter().all(|&p| orient3d(a, b, c, p) == 0))
    }

    /// Whether a filling moves the boundary although it must stay.
    pub fn tilts_flat(&self, filling: &Filling, positions: &[[i32; 3]]) -> bool {
        self.stays && !self.keeps_boundary(filling, positions)
    }

    /// Whether the boundary stays where it is. In two planes it can only be filled in one way.
    pub fn keeps_boundary(&self, filling: &Filling, positions: &[[i32; 3]]) -> bool {
        let moved = filling.border[..filling.moved].iter();
        self.is_flat() && moved.map(|&(_, t)| t.map(|v| positions[v as usize])).all(|t| self.in_plane(t))
    }

    /// Fills the hole, with fewer tetrahedra than were in it. Returns their numbers, in the order of the filling.
    pub fn replace(&self, mesh: &mut WorkMesh, filling: &Filling, slots: &mut Vec<u32>) {
        assert!(filling.tets.len() < self.star.len(), "a removal makes the mesh smaller");
        // The filling takes the first slots of the star; the rest are freed.
        slots.clear();
        slots.extend(self.star[..filling.tets.len()].iter().map(|s| s.tet));
        self.star.iter().skip(filling.tets.len()).for_each(|s| mesh.free(s.tet));
        mesh.incident[self.a as usize] = NONE;
        // Faces that wait for the tetrahedron on their other side: which tetrahedron has them, and where.
        let mut open: Vec<([u32; 3], u32, usize)> = Vec::with_capacity(3 * self.faces.len());
        for &(face, outer) in self.faces.iter().filter(|(_, outer)| *outer != NONE) {
            let corners = mesh.tets[outer as usize];
            let side = corners.iter().position(|v| !face.contains(v)).unwrap_or(0);
            open.push((sorted(face), outer, side));
        }
        for (&t, &corners) in slots.iter().zip(&filling.tets) {
            mesh.tets[t as usize] = corners;
            mesh.neighbors[t as usize] = [NONE; 4];
            corners.iter().for_each(|&v| mesh.incident[v as usize] = t);
            for (side, face) in FACES.iter().enumerate() {
                let key = sorted(face.map(|k| corners[k]));
                match open.iter().position(|(other, ..)| *other == key) {
                    Some(i) => {
                        let (_, n, back) = open.swap_remove(i);
                        mesh.neighbors[t as usize][side] = n;
                        mesh.neighbors[n as usize][back] = t;
                    }
                    None => open.push((key, t, side)),
                }
            }
        }
    }
}

impl Filling {
    pub fn clear(&mut self) {
        self.tets.clear();
        self.border.clear();
        self.moved = 0;
    }
}

/// Three numbers in increasing order.
pub(super) fn sorted([a, b, c]: [u32; 3]) -> [u32; 3] {
    let (low, high) = (a.min(b), a.max(b));
    [low.min(c), high.min(c).max(low), high.max(c)]
}
