//! The hole that a vertex leaves when it is removed, what fills it, and how a filling is put into the mesh.

use crate::change::collapse_check::Refusal;
use crate::change::sides::{FaceSet, Sides, bits, rank};
use crate::change::work_mesh::{ELSEWHERE, StarTet, WorkMesh};
use crate::geometry::flat::{Feature, Planes};
use crate::lattice::quantize::Quantized;
use tetralod::geom::orient3d;
use tetralod::mesh::{FACES, NONE};
use tetralod::mt::MAX_LINK;

/// The most tetrahedra around a vertex that is removed: what a sphere of [`MAX_LINK`] vertices has.
const MAX_HOLE: usize = 2 * MAX_LINK - 4;

/// The star of a vertex that may be removed. Reused from candidate to candidate.
#[derive(Default)]
pub(crate) struct Hole {
    /// The vertex.
    pub a: u32,
    /// The tetrahedra around it.
    pub star: Vec<StarTet>,
    /// Their faces opposite `a`, ordered so that `(face, a)` is a positive tetrahedron, and the neighbours there.
    pub faces: Vec<([u32; 3], u32)>,
    /// The vertices of these faces, each once.
    pub link: Vec<u32>,
    /// Where the vertices of `link` are.
    pub points: Vec<[i32; 3]>,
    /// The corners of each of `faces`, by their places in `link`.
    corners: Vec<[u8; 3]>,
    /// What is across faces of the tetrahedra of `star`, in their order.
    beside: Vec<Beside>,
    /// For each of `link` which of the faces have it.
    faces_at: FacesAt,
    places: LinkPlaces,
    /// Edges `xy` of the boundary triangles `axy`, which are ordered as seen from outside.
    pub border: Vec<[u32; 2]>,
    /// The planes of those triangles, if there are no more than two.
    planes: Vec<[[i32; 3]; 3]>,
    many_planes: bool,
    /// Where the boundary must stay, if it must.
    stays: Option<Planes>,
    /// What the boundary's features are.
    pub feature: Feature,
    /// The planes of the faces, once [`Hole::find_sides`] has found them.
    sides: Sides,
    /// The numbers of the faces in the order of their vertices, once [`Hole::sort_faces`] has sorted them.
    pub sorted: Vec<u8>,
}

const _: () = assert!(MAX_HOLE <= FaceSet::BITS as usize);

/// More than the vertices of a link may be until it is found to be too large.
const MOST_PLACES: usize = 64;

const _: () = assert!(MAX_LINK + 1 < MOST_PLACES);

/// A tetrahedron across a face of one of the star, and the places in the link of the two vertices that they share with `a`.
#[derive(Clone, Copy)]
struct Beside {
    tet: u32,
    corners: [u32; 4],
    around: [u32; 4],
    places: [u8; 2],
}

/// Sets of faces by places in a link.
struct FacesAt([FaceSet; MOST_PLACES]);

impl Default for FacesAt {
    fn default() -> Self {
        Self([0; MOST_PLACES])
    }
}

/// Finds the places of vertices in a link: a hash table with open addressing, at most a quarter full.
struct LinkPlaces([u8; LINK_TABLE]);

const LINK_TABLE: usize = 256;
const NO_PLACE: u8 = u8::MAX;

impl Default for LinkPlaces {
    fn default() -> Self {
        Self([NO_PLACE; LINK_TABLE])
    }
}

impl FacesAt {
    #[inline]
    fn of(&self, place: usize) -> FaceSet {
        self.0[place % MOST_PLACES]
    }
}

impl LinkPlaces {
    /// Where the search for `v` begins: Fibonacci hashing, as in `TetSet`.
    #[inline]
    fn first(v: u32) -> u32 {
        v.wrapping_mul(0x9E37_79B9) >> 24
    }

    /// The place of `v` in the link, if it is there.
    #[inline]
    fn find(&self, link: &[u32], v: u32) -> Option<usize> {
        let mut at = Self::first(v);
        loop {
            match self.0[at as usize % LINK_TABLE] {
                NO_PLACE => return None,
                place if link[usize::from(place)] == v => return Some(usize::from(place)),
                _ => at += 1,
            }
        }
    }

    /// The place of `v` in the link, at the end of which it is put if it is new.
    #[inline]
    fn place(&mut self, link: &mut Vec<u32>, v: u32) -> u8 {
        let mut at = Self::first(v);
        loop {
            let slot = &mut self.0[at as usize % LINK_TABLE];
            if *slot == NO_PLACE {
                *slot = link.len() as u8;
                link.push(v);
                return *slot;
            }
            if link[usize::from(*slot)] == v {
                return *slot;
            }
            at += 1;
        }
    }
}

/// Tetrahedra that fill a hole.
#[derive(Default)]
pub(crate) struct Filling {
    pub tets: Vec<[u32; 4]>,
    /// Boundary triangles and the tetrahedra in `tets` that they belong to: first the `moved` ones in the place of those
    /// at the removed vertex, then those that were there before.
    pub border: Vec<(u32, [u32; 3])>,
    pub moved: usize,
    /// What lies across each face of `tets`, once [`Hole::link_filling`] has found it.
    pub across: Vec<[Across; 4]>,
    /// Scratch space: faces without a tetrahedron on their other side yet. The places of their vertices in the link, ascending, as a
    /// number; and what has them.
    open: Vec<u32>,
    open_at: Vec<(Across, u8)>,
}

/// What lies across a face of a tetrahedron that fills a hole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Across {
    /// Nothing: it is on the boundary.
    Nothing,
    /// Another tetrahedron of the filling.
    Inside(u8),
    /// What is outside of a face of the hole.
    Face(u8),
}

impl Hole {
    /// Collects the hole that the removal of `a` would leave: the tetrahedra around it that are connected through faces.
    pub fn open(&mut self, mesh: &WorkMesh, positions: &[[i32; 3]], a: u32) -> Result<(), Refusal> {
        self.clear(a);
        let first = mesh.incident[a as usize];
        let tet = mesh.tets[first as usize];
        let corner = corner_of(tet, a);
        let [x, y, z] = FACES[corner];
        let places = [x, z, y].map(|k| self.place_of(tet[k]));
        let star_tet = StarTet { tet: first, corner: corner as u8 };
        self.add(mesh, star_tet, (tet, mesh.neighbors[first as usize]), ([x, z, y], places));
        let mut next = 0;
        while let Some(&Beside { tet: t, corners: tet, around, places: [m, n] }) = self.beside.get(next) {
            next += 1;
            if self.is_closed(m, n) {
                continue;
            }
            let [own, i, j] =
                [a, self.link[usize::from(m)], self.link[usize::from(n)]].map(|v| corner_of(tet, v));
            let other = (6 - own - i - j) % 4;
            let places = [m, n, self.place_of(tet[other])];
            if self.star.len() >= MAX_HOLE || self.link.len() > MAX_LINK {
                return Err(Refusal::Blocked);
            }
            let star_tet = StarTet { tet: t, corner: own as u8 };
            self.add(mesh, star_tet, (tet, around), ([i, j, other], places));
        }
        self.points.extend(self.link.iter().map(|&v| positions[v as usize]));
        self.find_planes(positions);
        Ok(())
    }

    fn clear(&mut self, a: u32) {
        self.a = a;
        self.star.clear();
        self.faces.clear();
        self.beside.clear();
        self.link.clear();
        self.points.clear();
        self.corners.clear();
        self.places.0.fill(NO_PLACE);
        self.border.clear();
    }

    /// The place of a vertex in the link, at the end of which it is put if it is new.
    #[inline]
    fn place_of(&mut self, v: u32) -> u8 {
        let new = self.link.len();
        let place = self.places.place(&mut self.link, v);
        if usize::from(place) == new {
            self.faces_at.0[new % MOST_PLACES] = 0;
        }
        place
    }

    /// Whether both tetrahedra of the star at an edge of the link have been found.
    #[inline]
    fn is_closed(&self, m: u8, n: u8) -> bool {
        let faces = self.faces_at.of(m.into()) & self.faces_at.of(n.into());
        faces & (faces - 1) != 0
    }

    /// Adds a tetrahedron of the star, given its corners and what is around it: its face opposite the vertex is that of these corners,
    /// which are at these places of the link.
    #[inline]
    fn add(
        &mut self,
        mesh: &WorkMesh,
        s: StarTet,
        (tet, around): ([u32; 4], [u32; 4]),
        (face, places): ([usize; 3], [u8; 3]),
    ) {
        let own = 1 << self.star.len();
        places.iter().for_each(|&place| self.faces_at.0[usize::from(place) % MOST_PLACES] |= own);
        let [x, y, z] = face.map(|k| tet[k % 4]);
        self.star.push(s);
        self.faces.push(([x, y, z], around[usize::from(s.corner) % 4]));
        self.corners.push(places);
        for (k, edge, m, n) in [(0, [y, z], 2, 1), (1, [z, x], 0, 2), (2, [x, y], 1, 0)] {
            let t = around[face[k] % 4];
            if t == NONE {
                self.border.push(edge);
            }
            if t < ELSEWHERE && !self.is_closed(places[m], places[n]) {
                // Read as soon as it is known, long before it is used: the memory delivers several at a time.
                let (corners, around) = (mesh.tets[t as usize], mesh.neighbors[t as usize]);
                self.beside.push(Beside { tet: t, corners, around, places: [places[m], places[n]] });
            }
        }
    }

    /// Gets ready for [`Hole::is_seen_from`].
    pub fn find_sides(&mut self) {
        self.sides.find(&self.points, &self.corners);
    }

    /// Sorts the faces by their vertices.
    pub fn sort_faces(&mut self) {
        let Self { sorted: order, faces, .. } = self;
        order.clear();
        order.extend(0..faces.len() as u8);
        order.sort_unstable_by_key(|&i| sorted(faces[usize::from(i)].0));
    }

    /// Whether all faces but those at link vertex `i` make positive tetrahedra with it.
    #[inline]
    pub fn is_seen_from(&self, i: usize) -> bool {
        self.sides.are_seen_from((i, self.points[i]), self.others(i))
    }

    /// The faces that link vertex `i` is no corner of.
    #[inline]
    pub fn others(&self, i: usize) -> FaceSet {
        let all = FaceSet::MAX >> (FaceSet::BITS as usize - self.faces.len());
        all & !self.faces_at.of(i)
    }

    /// The corners of a face, by their places in the link.
    #[inline]
    pub fn corners_of(&self, face: usize) -> [usize; 3] {
        self.corners[face].map(usize::from)
    }

    /// The faces that have all of these vertices.
    pub fn faces_with<'a>(&self, vertices: impl Iterator<Item = &'a u32>) -> FaceSet {
        let at = |v: &u32| self.place(*v).map_or(0, |i| self.faces_at.of(i));
        vertices.map(at).fold(FaceSet::MAX, |all, faces| all & faces)
    }

    /// The faces that share an edge with a face, and itself.
    pub fn faces_beside(&self, face: usize) -> FaceSet {
        let [x, y, z] = self.corners[face].map(|i| self.faces_at.of(usize::from(i)));
        x & y | y & z | z & x
    }

    /// The place of a vertex in the link.
    #[inline]
    pub fn place(&self, v: u32) -> Option<usize> {
        self.places.find(&self.link, v)
    }

    /// Whether an edge of the link joins these of its vertices, or they are the same.
    #[inline]
    pub fn has_edge(&self, x: usize, y: usize) -> bool {
        self.faces_at.of(x) & self.faces_at.of(y) != 0
    }

    /// Whether a face of the hole has these three of the link's vertices.
    #[inline]
    pub fn has_face(&self, x: usize, y: usize, z: usize) -> bool {
        self.faces_at.of(x) & self.faces_at.of(y) & self.faces_at.of(z) != 0
    }

    /// How many tetrahedra there are if the vertex moves to link vertex `i`.
    #[inline]
    pub fn left_at(&self, i: usize) -> u32 {
        self.others(i).count_ones()
    }

    /// [`Quantized::overshoot`] for the vertex, given the region of each tetrahedron around it if fields jump.
    pub fn overshoot(&self, quantized: &Quantized, regions: &[u32], f: usize) -> f64 {
        let sides = &quantized.sides;
        if sides.is_empty() {
            return quantized.overshoot(&[self.a], &self.link, f);
        }
        let own: Vec<u32> = regions.iter().map(|&region| sides.point(self.a, region)).collect();
        let around = self.faces.iter().zip(regions);
        let around = around.flat_map(|((face, _), &region)| face.map(|v| sides.point(v, region)));
        quantized.overshoot(&own, &around.collect::<Vec<u32>>(), f)
    }

    /// Whether the vertex is on the boundary.
    pub fn on_boundary(&self) -> bool {
        !self.border.is_empty()
    }

    fn find_planes(&mut self, positions: &[[i32; 3]]) {
        self.planes.clear();
        (self.many_planes, self.stays) = (false, None);
        if !self.on_boundary() {
            return;
        }
        let at = |v: u32| positions[v as usize];
        self.stays = Planes::of(self.border.iter().map(|&[x, y]| [self.a, x, y].map(at)), self.feature);
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
        self.stays.as_ref().is_some_and(|planes| !moved(filling, positions).all(|t| planes.hold(t)))
    }

    /// Whether the boundary stays where it is. In two planes it can only be filled in one way.
    pub fn keeps_boundary(&self, filling: &Filling, positions: &[[i32; 3]]) -> bool {
        self.is_flat() && moved(filling, positions).all(|t| self.in_plane(t))
    }

    /// Finds what lies across the faces of a filling: for [`Hole::replace`].
    pub fn link_filling(&self, filling: &mut Filling) {
        let Filling { tets, across, open, open_at, .. } = filling;
        open.clear();
        open_at.clear();
        open.extend(self.corners.iter().map(|&corners| face_key(corners)));
        open_at.extend((0..self.faces.len() as u8).map(|face| (Across::Face(face), 0)));
        across.clear();
        across.resize(tets.len(), [Across::Nothing; 4]);
        for (t, tet) in tets.iter().enumerate() {
            let places = tet.map(|v| self.place(v).map_or(NO_PLACE, |place| place as u8));
            for (side, face) in FACES.iter().enumerate() {
                let key = face_key(face.map(|k| places[k]));
                let Some(i) = open.iter().position(|&other| other == key) else {
                    open.push(key);
                    open_at.push((Across::Inside(t as u8), side as u8));
                    continue;
                };
                open.swap_remove(i);
                let (other, back) = open_at.swap_remove(i);
                across[t][side] = other;
                if let Across::Inside(other) = other {
                    across[usize::from(other)][usize::from(back)] = Across::Inside(t as u8);
                }
            }
        }
    }

    /// As [`Hole::link_filling`], where the vertex is moved to link vertex `i`: each edge of the link is one of two faces, or of one at the
    /// boundary.
    pub fn link_contraction(&self, i: usize, across: &mut Vec<[Across; 4]>) {
        let cells = self.others(i);
        across.clear();
        across.extend(bits(cells).map(|face| {
            let beyond = |m: usize, n: usize| {
                let other = self.faces_at.of(m) & self.faces_at.of(n) & !(1 << face);
                match other.trailing_zeros() {
                    FaceSet::BITS => Across::Nothing,
                    other if cells >> other & 1 == 1 => Across::Inside(rank(cells, other as usize) as u8),
                    other => Across::Face(other as u8),
                }
            };
            let [x, y, z] = self.corners_of(face);
            [beyond(y, z), beyond(z, x), beyond(x, y), Across::Face(face as u8)]
        }));
    }

    /// Fills the hole, with fewer tetrahedra than were in it, after [`Hole::link_filling`]. Writes their numbers to `slots`, in the
    /// order of the filling. What is outside of the hole may have changed since it was opened.
    pub fn replace(&self, mesh: &mut WorkMesh, filling: &Filling, slots: &mut Vec<u32>) {
        assert!(filling.tets.len() < self.star.len(), "a removal makes the mesh smaller");
        // Read before anything is written: the filling takes the first slots of the star; the rest are freed.
        let mut outside = [(NONE, 0); MAX_HOLE];
        for (outside, s) in outside.iter_mut().zip(&self.star) {
            let outer = mesh.neighbors[s.tet as usize][usize::from(s.corner)];
            let back = match outer {
                NONE | ELSEWHERE => 0,
                _ => mesh.neighbors[outer as usize].iter().position(|&t| t == s.tet).unwrap_or(0),
            };
            *outside = (outer, back);
        }
        slots.clear();
        slots.extend(self.star[..filling.tets.len()].iter().map(|s| s.tet));
        self.star.iter().skip(filling.tets.len()).for_each(|s| mesh.free(s.tet));
        mesh.incident[self.a as usize] = NONE;
        for ((&t, &corners), across) in slots.iter().zip(&filling.tets).zip(&filling.across) {
            mesh.tets[t as usize] = corners;
            corners.iter().for_each(|&v| mesh.incident[v as usize] = t);
            mesh.neighbors[t as usize] = across.map(|across| match across {
                Across::Nothing => NONE,
                Across::Inside(other) => slots[usize::from(other)],
                Across::Face(face) => outside[usize::from(face)].0,
            });
            for face in across.iter().filter_map(|across| match across {
                Across::Face(face) => Some(usize::from(*face)),
                _ => None,
            }) {
                let (outer, back) = outside[face];
                if outer < ELSEWHERE {
                    mesh.neighbors[outer as usize][back] = t;
                }
            }
        }
    }
}

/// The boundary triangles in the place of those at the removed vertex.
fn moved(filling: &Filling, positions: &[[i32; 3]]) -> impl Iterator<Item = [[i32; 3]; 3]> {
    filling.border[..filling.moved].iter().map(|&(_, t)| t.map(|v| positions[v as usize]))
}

/// Which corner of a tetrahedron a vertex is.
#[inline]
fn corner_of(tet: [u32; 4], v: u32) -> usize {
    usize::from(tet[1] == v) | (usize::from(tet[2] == v) << 1) | (usize::from(tet[3] == v) * 3)
}

/// The places of three vertices in ascending order, as one number.
#[inline]
fn face_key(places: [u8; 3]) -> u32 {
    let [a, b, c] = sorted(places.map(u32::from));
    a << 16 | b << 8 | c
}

impl Filling {
    pub fn clear(&mut self) {
        self.tets.clear();
        self.border.clear();
        self.moved = 0;
    }
}

/// Three numbers in increasing order.
pub(crate) fn sorted([a, b, c]: [u32; 3]) -> [u32; 3] {
    let (low, high) = (a.min(b), a.max(b));
    [low.min(c), high.min(c).max(low), high.max(c)]
}
