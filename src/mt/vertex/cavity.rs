//! Scratch space for insertions and removals: T_u, the faces of Π_u and what lies beyond them.

use super::bit_string::Bits;
use super::cavity_fill::{CavityFill, Face, turned};
use super::limits::{MAX_AROUND, MAX_INSERTED};
use super::shape_code::{Hole, write_removed};
use super::sphere_order::Spheres;
use super::tet_errors::Packed;
use crate::geom::{det_i64, orient3d};
use crate::mesh::{FACES, NONE};
use crate::mt::mesh::KindState;
use crate::mt::mesh::stars::{BARE, GATHERED, LINK_CAPACITY, Star};
use crate::mt::ranks::rank;
use crate::mt::{CurrentMesh, PagedArray};

/// "This edge is on the rim: the face behind it is given up."
const GIVEN_UP: u32 = 0xFF;

/// Room for the new slots, and for [`GIVEN_UP`].
pub(in crate::mt) const SLOTS: usize = 256;

/// A face of Π_u with what lies beyond.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::mt) struct Wall {
    /// The vertices by index into the link, in an order that makes a tetrahedron `(v, corners)` positive.
    pub corners: [u8; 3],
    pub beyond: u32,
    /// Which neighbour of the one beyond lies on this side.
    pub side: u8,
}

/// Scratch space for insertions and removals.
#[derive(Clone, Debug)]
pub(in crate::mt) struct Cavity {
    pub fill: CavityFill,
    pub star: Star,
    /// The slots of T_u.
    pub tets: [u32; GATHERED],
    pub tets_len: usize,
    /// Their corners by index into the link.
    pub corners: [[u8; 4]; GATHERED],
    /// Faces of T_u that none of its tetrahedra lies behind: tetrahedron, face, what lies behind.
    pub bare: Box<[[u32; 3]; BARE]>,
    pub bare_len: usize,
    pub walls: [Wall; MAX_INSERTED],
    pub walls_len: usize,
    /// Slots of the vertices of Π_u.
    pub link: [u32; LINK_CAPACITY],
    pub link_len: usize,
    /// The place of each vertex of the link in the order of their labels.
    pub order: [i32; MAX_AROUND],
    /// For a directed edge between two of them the new tetrahedron that has it: `epoch << 16 | tetrahedron`.
    pub edges: Box<[u32; MAX_AROUND * MAX_AROUND]>,
    pub epoch: u32,
    /// The place of each wall in canonical order.
    pub places: [i32; GATHERED],
    /// Across the faces of each new tetrahedron.
    pub across: [[u32; 4]; MAX_INSERTED],
    /// The tags of the new tetrahedra.
    pub tags: [u32; MAX_INSERTED],
    /// Their quarterings, where these are kept.
    pub quarterings: [u8; MAX_INSERTED],
    /// Of T_u.
    pub fingerprint: Fingerprint,
    /// The node of an update that is added.
    pub bits: Bits,
    /// The tags that the tetrahedra which it removes had.
    pub removed_tags: [u32; GATHERED],
    /// The quarterings of the tetrahedra that vertices have replaced, by label, where quarterings are kept.
    pub replaced: Option<PagedArray<Packed>>,
}

impl KindState for Cavity {
    fn bytes(&self) -> u64 {
        (size_of_val(self) + self.replaced.as_ref().map_or(0, PagedArray::bytes)) as u64
    }
}

/// A hash of the tetrahedra that an insertion removed, which the mesh keeps with the vertex (its [`KindWord`](crate::mt::mesh::current::KindWord)). What the removal of the vertex puts
/// back must have the same one. So a mesh is always one that insertions alone lead to; a code that names other
/// tetrahedra than those which were there could make ones that the rest of the mesh, if it overlaps, has already.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::mt) struct Fingerprint(pub u32);

impl Fingerprint {
    /// What a vertex contributes, by its label.
    #[inline]
    pub fn of_vertex(label: u32) -> u32 {
        let x = label.wrapping_mul(0x9E37_79B1);
        (x ^ x >> 15).wrapping_mul(0x85EB_CA77)
    }

    /// Takes in a tetrahedron, given the sum of what its vertices contribute.
    #[inline]
    pub fn add(&mut self, sum: u32) {
        let x = (sum ^ sum >> 16).wrapping_mul(0xC2B2_AE3D);
        self.0 = self.0.wrapping_add(x ^ x >> 13);
    }
}

impl Default for Cavity {
    fn default() -> Self {
        Self {
            fill: CavityFill::default(),
            star: Star::default(),
            tets: [0; GATHERED],
            tets_len: 0,
            corners: [[0; 4]; GATHERED],
            bare: Box::new([[0; 3]; BARE]),
            bare_len: 0,
            walls: [Wall::default(); MAX_INSERTED],
            walls_len: 0,
            link: [0; LINK_CAPACITY],
            link_len: 0,
            order: [0; MAX_AROUND],
            edges: Box::new([0; MAX_AROUND * MAX_AROUND]),
            epoch: 0,
            places: [0; GATHERED],
            across: [[NONE; 4]; MAX_INSERTED],
            tags: [NONE; MAX_INSERTED],
            quarterings: [0; MAX_INSERTED],
            fingerprint: Fingerprint::default(),
            bits: Bits::default(),
            removed_tags: [NONE; GATHERED],
            replaced: None,
        }
    }
}

impl Cavity {
    /// Takes `removed`, which all have the tag, and lists their faces that none of them lies behind.
    pub fn list_bare(&mut self, mesh: &mut CurrentMesh, removed: &[u32], tag: u32) {
        mesh.next_epoch();
        (self.tets_len, self.bare_len) = (removed.len(), 0);
        self.tets[..removed.len()].copy_from_slice(removed);
        for &t in removed {
            for (face, n) in (0..).zip(mesh.neighbors[t as usize]) {
                // Written anyway, and counted if it belongs there.
                self.bare[self.bare_len % BARE] = [t, face, n];
                self.bare_len += usize::from(n == NONE || mesh.tag(n) != tag);
            }
        }
    }

    /// Puts a face of tetrahedron `tet` on the list of walls. None if there are too many, or too many vertices.
    #[inline]
    pub fn add_wall(
        &mut self,
        mesh: &mut CurrentMesh,
        tet: &[u32; 4],
        face: usize,
        beyond: u32,
        side: u8,
    ) -> Option<()> {
        let corners =
            FACES[face & 3].map(|k| mesh.number_vertex(tet[k & 3], &mut self.link, &mut self.link_len));
        *self.walls.get_mut(self.walls_len)? = Wall { corners, beyond, side };
        self.walls_len += 1;
        (self.link_len <= MAX_AROUND).then_some(())
    }

    /// What each vertex of the link contributes to a fingerprint.
    #[inline]
    pub fn prints(&self, mesh: &CurrentMesh) -> [u32; MAX_AROUND] {
        let mut prints = [0; MAX_AROUND];
        for (print, &v) in prints.iter_mut().zip(&self.link[..self.link_len]) {
            *print = Fingerprint::of_vertex(mesh.labels[v as usize].vertex);
        }
        prints
    }

    /// Finds the fingerprint of the tetrahedra that were built.
    #[inline]
    pub fn fingerprint_built(&mut self, mesh: &CurrentMesh) {
        let prints = self.prints(mesh);
        self.fingerprint = Fingerprint::default();
        for tet in &self.fill.tets[..self.fill.len] {
            let of_corners = tet.iter().map(|&x| prints[x as usize % MAX_AROUND]);
            self.fingerprint.add(of_corners.fold(0, u32::wrapping_add));
        }
    }

    /// Finds the faces of Π_u around the tetrahedra that were gathered, and joins the new tetrahedra behind them. `given_up` is the
    /// number of faces on the boundary where some of these are given up; which are, is given by `is_given_up`, by their places and by
    /// tetrahedron and face.
    pub fn find_walls(
        &mut self,
        mesh: &mut CurrentMesh,
        given_up: Option<usize>,
        is_given_up: &mut dyn FnMut(usize, [u32; 2]) -> bool,
    ) -> Option<()> {
        (self.walls_len, self.link_len) = (0, 0);
        let mut outer: Vec<([u32; 3], [u32; 2])> = Vec::new();
        let mut fits = true;
        for i in 0..self.bare_len {
            let [t, face, beyond] = self.bare[i];
            let tet = mesh.tets[t as usize];
            if beyond == NONE && given_up.is_some() {
                let mut sorted = FACES[face as usize & 3].map(|k| mesh.labels[tet[k] as usize].vertex);
                sorted.sort_unstable();
                // Kept in order as they come: they are few.
                let at = outer.partition_point(|other| *other < (sorted, [t, face]));
                outer.insert(at, (sorted, [t, face]));
                continue;
            }
            let side = if beyond == NONE { Some(0) } else { mesh.side_towards(beyond, t) };
            fits &= side.is_some();
            self.add_wall(mesh, &tet, face as usize, beyond, side.unwrap_or(0))?;
        }
        let mut bare = Vec::new();
        if given_up.is_some_and(|count| count != outer.len()) {
            return None;
        }
        for (place, (_, [t, face])) in outer.into_iter().enumerate() {
            let tet = mesh.tets[t as usize];
            if is_given_up(place, [t, face]) {
                bare.push(FACES[face as usize & 3].map(|k| tet[k]));
            } else {
                self.add_wall(mesh, &tet, face as usize, NONE, 0)?;
            }
        }
        let mut rim = Vec::new();
        for [a, b, c] in bare {
            let number = |v: u32| mesh.vertex_number(v);
            rim.push([number(a)?, number(b)?, number(c)?]);
        }
        if !fits {
            return None;
        }
        let prints = self.prints(mesh);
        self.fingerprint = Fingerprint::default();
        for (corners, &t) in self.corners.iter_mut().zip(&self.tets[..self.tets_len]) {
            // No vertex may be left without a tetrahedron.
            *corners = mesh.corner_numbers(&mesh.tets[t as usize])?;
            let prints = corners.map(|x| prints[usize::from(x) % MAX_AROUND]);
            self.fingerprint.add(prints.into_iter().fold(0, u32::wrapping_add));
        }
        self.join_walls(&rim)
    }

    /// Orders the link by the labels of its vertices.
    #[inline]
    pub fn order_link(&mut self, mesh: &CurrentMesh) {
        let mut labels = [i32::MAX; MAX_AROUND];
        for (label, &v) in labels.iter_mut().zip(&self.link[..self.link_len]) {
            // Signed numbers compare in one instruction; the shift keeps the order.
            *label = (mesh.labels[v as usize].vertex ^ 1 << 31) as i32;
        }
        rank(&labels, self.link_len, &mut self.order);
    }

    /// Finds the place of each wall in canonical order: ascending by the sorted labels of its vertices.
    #[inline]
    pub fn order_walls(&mut self) {
        let mut keys = [i32::MAX; GATHERED];
        for (key, wall) in keys.iter_mut().zip(&self.walls[..self.walls_len]) {
            let [a, b, c] = wall.corners.map(|x| self.order[x as usize % MAX_AROUND]);
            let (low, high) = (a.min(b), a.max(b));
            let (least, most) = (low.min(c), high.max(c));
            *key = least << 12 | low.max(c.min(high)) << 6 | most;
        }
        rank(&keys, self.walls_len, &mut self.places);
    }

    /// Finds what lies across the faces of the new tetrahedra that meet at the new vertex. `rim` are the faces that are
    /// given up. None if walls and rim do not close.
    #[inline]
    pub fn join_walls(&mut self, rim: &[[u8; 3]]) -> Option<()> {
        self.epoch += 1;
        if self.epoch == 1 << 16 {
            self.edges.fill(0);
            self.epoch = 1;
        }
        // Epochs grow, so what is of this one is not less than its start.
        let epoch = self.epoch << 16;
        let edges = &mut *self.edges;
        let place = |a: u8, b: u8| (usize::from(a) << 6 | usize::from(b)) % (MAX_AROUND * MAX_AROUND);
        let mut twice = false;
        for &[a, b, c] in rim {
            for (from, to) in [(b, c), (c, a), (a, b)] {
                twice |= std::mem::replace(&mut edges[place(from, to)], epoch | GIVEN_UP) >= epoch;
            }
        }
        for (i, wall) in (0_u32..).zip(&self.walls[..self.walls_len]) {
            let [a, b, c] = wall.corners;
            for (from, to) in [(b, c), (c, a), (a, b)] {
                twice |= std::mem::replace(&mut edges[place(from, to)], epoch | i) >= epoch;
            }
        }
        let mut open = false;
        for (across, wall) in self.across.iter_mut().zip(&self.walls[..self.walls_len]) {
            let [a, b, c] = wall.corners;
            let [b, c, d] = [(c, b), (a, c), (b, a)].map(|(from, to)| edges[place(from, to)]);
            open |= b.min(c).min(d) < epoch;
            *across = [NONE, b & 0xFFFF, c & 0xFFFF, d & 0xFFFF];
        }
        (!twice && !open).then_some(())
    }

    /// Appends to the node of an update that is added how T_u fills Π_u, once link and walls are ordered.
    pub fn write_shape(&mut self, mesh: &CurrentMesh, on_boundary: bool) -> Option<()> {
        let order = &self.order;
        let canonical = |x: u8| order[usize::from(x) % MAX_AROUND] as u8;
        let mut faces: [Face; MAX_INSERTED] = [[0; 3]; MAX_INSERTED];
        for (wall, &place) in self.walls[..self.walls_len].iter().zip(&self.places) {
            faces[place as usize % MAX_INSERTED] = turned(wall.corners.map(canonical));
        }
        let removed = &mut self.corners[..self.tets_len];
        removed.iter_mut().for_each(|tet| *tet = tet.map(canonical));
        let spheres = || {
            let mut positions = [[0; 3]; MAX_AROUND];
            for (&v, &place) in self.link[..self.link_len].iter().zip(order) {
                positions[place as usize % MAX_AROUND] = mesh.positions[v as usize];
            }
            Spheres::of(positions[..self.link_len].iter().copied())
        };
        let (vertices, faces) = (self.link_len as u32, &faces[..self.walls_len]);
        write_removed(&mut self.fill, &mut self.bits, Hole { vertices, faces, removed, on_boundary }, spheres)
    }

    /// Whether all tetrahedra of the new star are positive, exactly.
    #[inline]
    pub fn is_star_positive(&self, mesh: &CurrentMesh, centre: [i32; 3], narrow: bool) -> bool {
        let link = &self.link[..self.link_len];
        if !narrow {
            let at = |x: u8| mesh.positions[link[x as usize] as usize];
            let positive = |wall: &Wall| {
                let [a, b, c] = wall.corners.map(at);
                orient3d(centre, a, b, c) > 0
            };
            return self.walls[..self.walls_len].iter().all(positive);
        }
        let mut relative = [[0_i64; 3]; MAX_AROUND];
        for (relative, &v) in relative.iter_mut().zip(link) {
            let position = mesh.positions[v as usize];
            *relative = [0, 1, 2].map(|k| i64::from(position[k] - centre[k]));
        }
        self.walls[..self.walls_len].iter().all(|wall| {
            let [u, v, w] = wall.corners.map(|x| relative[x as usize % MAX_AROUND]);
            det_i64(u, v, w) > 0
        })
    }
}
