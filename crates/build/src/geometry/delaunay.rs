//! Incremental Delaunay triangulation of lattice points, exact and unique.
//!
//! Points are inserted one at a time: the tetrahedra in conflict with a point are removed and their union is filled
//! with the point's star (Bowyer 1981, Watson 1981). A vertex at infinity closes the hull, so every face has two sides:
//! behind each face of the hull is a *ghost*, a tetrahedron of that face and the vertex at infinity. Cospherical points
//! are separated by the symbolic perturbation of [`in_conflict`], so the result does not depend on the order of
//! insertion, and a regular grid gets Kuhn's six tetrahedra in each of its cells.
//!
//! An insertion may be held to [`Limits`]. Then a conflict zone that is too large is cut to a star-shaped part of it:
//! the mesh is no longer Delaunay there, and from then on every zone is checked to be star-shaped, and cut if not.

use crate::BuildError;
use tetralod::geom::{in_conflict, orient3d};
use tetralod::mesh::{FACES, NONE};

/// The most that one insertion may remove and insert.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Tetrahedra removed.
    pub removed: usize,
    /// Tetrahedra inserted.
    pub inserted: usize,
    /// Vertices around the new one.
    pub link: usize,
}

/// What a vertex-based MT can describe.
pub(crate) const MT_LIMITS: Limits = Limits { removed: 128, inserted: 124, link: 64 };

/// The Delaunay triangulation of `points`: positive tetrahedra that fill their convex hull.
///
/// Cospherical points are perturbed symbolically, so the result is unique whatever the order of the points; in a
/// regular grid every cell gets Kuhn's six tetrahedra. Coordinates must lie in `0 ..= 2^WIDE_BITS`
/// (see [`WIDE_BITS`](tetralod::geom::WIDE_BITS)).
///
/// # Errors
/// If there are fewer than four points, all lie in one plane, or two are equal.
pub fn delaunay(points: &[[i32; 3]]) -> Result<Vec<[u32; 4]>, BuildError> {
    let numbers: Vec<u32> = (0..points.len() as u32).collect();
    Ok(Triangulation::of(points, &numbers)?.finite_tets())
}

/// Side of the table in which the faces of a new star find each other; enough for any star within [`MT_LIMITS`].
const SMALL_LINK: usize = 65;
/// Stars of more vertices are sorted instead.
const LARGEST_TABLE: usize = 1024;

/// Slots are numbered in 30 bits, and an insertion may need very many at once.
const MOST_SLOTS: usize = 1 << 29;

/// A face of a zone's boundary.
#[derive(Clone, Copy)]
pub(crate) struct LinkFace {
    /// The vertices of the face, counterclockwise from outside the zone.
    pub triangle: [u32; 3],
    /// The link's faces across the edges opposite them.
    pub around: [u32; 3],
    /// The vertices of the triangle in local numbers.
    numbers: [u32; 3],
    /// The tetrahedron outside, and which of its faces this is.
    outer: u32,
    back: u32,
}

/// A Delaunay triangulation, with adjacency, of some of its points.
pub(crate) struct Triangulation {
    /// Relative to a corner of the bounding box, in units of the largest power of two that divides all: predicates are
    /// faster for small numbers.
    points: Vec<[i32; 3]>,
    /// Tetrahedra; those of a free slot are not to be read. The vertex at infinity is always last.
    tets: Vec<[u32; 4]>,
    neighbors: Vec<[u32; 4]>,
    /// Free slots.
    free: Vec<u32>,
    /// `epoch` for tetrahedra in conflict, `epoch + 1` for those known not to be.
    marks: Vec<u32>,
    epoch: u32,
    /// Numbers of the link's vertices, valid where the first is the epoch.
    local: Vec<[u32; 2]>,
    table: Vec<u32>,
    sorted: Vec<(u64, u32)>,
    /// Slots of the zone of the last insertion, the containing tetrahedron first; ghosts included.
    zone: Vec<u32>,
    /// The tetrahedra that the last insertion removed, without ghosts, and their slots.
    removed: Vec<([u32; 4], u32)>,
    /// The faces of the zone's boundary as `4 · slot + face` on the inner side.
    boundary: Vec<u32>,
    /// The boundary faces of the zone, to be joined to the new vertex.
    link: Vec<LinkFace>,
    /// Slots of the new star, ghosts included.
    star: Vec<u32>,
    /// Whether every insertion so far took its whole conflict zone.
    exact: bool,
    /// Whether the plan is cut.
    is_cut: bool,
    random: u32,
}

impl Triangulation {
    /// The triangulation of the points with these numbers.
    pub fn of(points: &[[i32; 3]], numbers: &[u32]) -> Result<Self, BuildError> {
        let points = shifted(points);
        let order = insertion_order(&points, numbers);
        let first = independent(&points, &order)?;
        let mut mesh = Self::new(points, first);
        let mut at = 0;
        for v in order.into_iter().filter(|v| !first.contains(v)) {
            at = mesh.locate(v, at);
            mesh.refuse_duplicate(v, at)?;
            mesh.insert(v, at);
            at = mesh.star[0];
            if mesh.slots() > MOST_SLOTS {
                return Err(BuildError::TooLarge);
            }
        }
        Ok(mesh)
    }

    /// The positive tetrahedron `first` with ghosts behind its faces.
    fn new(points: Vec<[i32; 3]>, first: [u32; 4]) -> Self {
        let infinite = points.len() as u32;
        let mut mesh = Self {
            local: vec![[0; 2]; points.len() + 1],
            points,
            tets: vec![first],
            neighbors: vec![[1, 2, 3, 4]],
            free: Vec::new(),
            marks: vec![0; 5],
            epoch: 2,
            table: vec![0; SMALL_LINK * SMALL_LINK],
            sorted: Vec::new(),
            zone: Vec::new(),
            removed: Vec::new(),
            boundary: Vec::new(),
            link: Vec::new(),
            star: Vec::new(),
            exact: true,
            is_cut: false,
            random: 1,
        };
        for face in FACES {
            // The vertex at infinity is on the outer side.
            let [a, b, c] = face.map(|k| first[k]);
            mesh.tets.push([a, b, c, infinite]);
            // Across the face opposite corner j of the ghost lies the ghost behind the face opposite that corner.
            let [i, j, k] = face.map(|k| k as u32 + 1);
            mesh.neighbors.push([i, j, k, 0]);
        }
        mesh
    }

    /// The tetrahedra inside the hull, in the order of their slots.
    pub fn finite_tets(&self) -> Vec<[u32; 4]> {
        self.finite_slots().map(|t| self.tets[t as usize]).collect()
    }

    /// The slots of the tetrahedra inside the hull.
    pub fn finite_slots(&self) -> impl Iterator<Item = u32> + '_ {
        self.slots_in_use().filter(|&t| !self.is_ghost(t))
    }

    fn slots_in_use(&self) -> impl Iterator<Item = u32> + '_ {
        let mut free = vec![false; self.tets.len()];
        self.free.iter().for_each(|&t| free[t as usize] = true);
        (0..self.tets.len() as u32).filter(move |&t| !free[t as usize])
    }

    /// The tetrahedron in a slot.
    pub fn tet(&self, t: u32) -> [u32; 4] {
        self.tets[t as usize]
    }

    /// The tetrahedra in whose closure a point lies, given one of them.
    pub fn all_around(&self, v: u32, at: u32) -> Vec<u32> {
        let p = self.points[v as usize];
        let mut found = vec![at];
        let mut next = 0;
        while let Some(&t) = found.get(next) {
            next += 1;
            for (i, &n) in self.neighbors[t as usize].iter().enumerate() {
                if !self.is_ghost(n) && !found.contains(&n) && self.side(t, i, p) == 0 {
                    found.push(n);
                }
            }
        }
        found
    }

    /// A bound of the slots in use.
    pub fn slots(&self) -> usize {
        self.tets.len()
    }

    /// The position of a point in the triangulation's own units.
    pub fn position(&self, v: u32) -> [i32; 3] {
        self.points[v as usize]
    }

    /// Whether the slot holds a ghost.
    pub fn is_ghost(&self, t: u32) -> bool {
        self.tets[t as usize][3] as usize == self.points.len()
    }

    /// What the last insertion removed, ghosts left out: tetrahedra and the slots they were in.
    pub fn removed(&self) -> &[([u32; 4], u32)] {
        &self.removed
    }

    /// The slots of the star that the last insertion made; some may be ghosts.
    pub fn star(&self) -> &[u32] {
        &self.star
    }

    /// A tetrahedron that contains the point, walking from `from`; a ghost if the point is outside. The mesh must be
    /// Delaunay: a walk through any other may not end.
    pub fn locate(&mut self, v: u32, from: u32) -> u32 {
        let p = self.points[v as usize];
        let mut at = if self.is_ghost(from) { self.neighbors[from as usize][3] } else { from };
        let mut previous = NONE;
        'walk: loop {
            let corners = self.tets[at as usize].map(|v| self.points.get(v as usize).copied());
            let [Some(a), Some(b), Some(c), Some(d)] = corners else { return at };
            let corners = [a, b, c, d];
            self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let start = self.random >> 30;
            for turn in 0..4 {
                let i = ((start + turn) & 3) as usize;
                let next = self.neighbors[at as usize][i];
                if next == previous {
                    continue;
                }
                let [x, y, z] = FACES[i].map(|k| corners[k]);
                if orient3d(x, y, z, p) > 0 {
                    previous = std::mem::replace(&mut at, next);
                    continue 'walk;
                }
            }
            return at;
        }
    }

    fn refuse_duplicate(&self, v: u32, at: u32) -> Result<(), BuildError> {
        let same = |w: &u32| self.points.get(*w as usize) == self.points.get(v as usize);
        match self.tets[at as usize].iter().find(|w| same(w)) {
            Some(&other) => Err(BuildError::SamePlace { points: [other.min(v), other.max(v)] }),
            None => Ok(()),
        }
    }

    /// Inserts a point that tetrahedron `at` contains, or that is in front of the ghost `at`.
    fn insert(&mut self, v: u32, at: u32) {
        self.next_epoch();
        self.flood(v, at);
        self.collect_link();
        self.fill(v);
    }

    /// Plans the insertion of a point that tetrahedron `at` contains: says what would be removed and inserted.
    /// Only the last plan can be carried out, and only before anything else is done.
    pub fn collapse(&mut self, v: u32, at: u32, limits: &Limits) -> Result<(), BuildError> {
        self.next_epoch();
        self.flood(v, at);
        self.is_cut = !(self.is_within(limits) && (self.exact || self.is_star_shaped(v)));
        if self.is_cut {
            self.cut(v, limits)?;
        }
        self.collect_link();
        self.meet();
        Ok(())
    }

    /// Carries the plan for `v` out.
    pub fn carry_out(&mut self, v: u32) {
        self.exact &= !self.is_cut;
        self.fill(v);
    }

    /// The zone of the plan: slots of tetrahedra to be removed, and of ghosts.
    pub fn zone(&self) -> &[u32] {
        &self.zone
    }

    /// The star of the plan; after it is carried out, face `i` has made the tetrahedron in slot `star()[i]`.
    pub fn link(&self) -> &[LinkFace] {
        &self.link
    }

    /// Whether a face of the link has the vertex at infinity: what it makes is a ghost.
    pub fn is_beyond(&self, face: &LinkFace) -> bool {
        face.triangle.contains(&(self.points.len() as u32))
    }

    /// Finds which faces of the link meet at its edges.
    fn meet(&mut self) {
        let side = self.link.len() / 2 + 2;
        if self.table.len() < side * side {
            self.table.resize(side * side, 0);
        }
        for (i, face) in (0..).zip(&self.link) {
            let [x, y, z] = face.numbers.map(|n| n as usize);
            self.table[y * side + z] = i;
            self.table[z * side + x] = i;
            self.table[x * side + y] = i;
        }
        for face in &mut self.link {
            let [x, y, z] = face.numbers.map(|n| n as usize);
            face.around = [(z, y), (x, z), (y, x)].map(|(a, b)| self.table[a * side + b]);
        }
    }

    fn next_epoch(&mut self) {
        self.epoch = self.epoch.wrapping_add(2);
        if self.epoch == 0 {
            self.marks.fill(0);
            self.local.fill([0; 2]);
            self.epoch = 2;
        }
    }

    /// Collects the conflict zone around `at`, and its boundary.
    fn flood(&mut self, v: u32, at: u32) {
        self.zone.clear();
        self.boundary.clear();
        self.zone.push(at);
        self.marks[at as usize] = self.epoch;
        let p = self.points[v as usize];
        let mut done = 0;
        while let Some(&t) = self.zone.get(done) {
            done += 1;
            let around = self.neighbors[t as usize];
            for (i, n) in (0..).zip(around) {
                let mark = self.marks[n as usize];
                if mark == self.epoch {
                    continue;
                }
                if mark != self.epoch + 1 && self.conflicts(n, p) {
                    self.marks[n as usize] = self.epoch;
                    self.zone.push(n);
                } else {
                    self.marks[n as usize] = self.epoch + 1;
                    self.boundary.push(4 * t + i);
                }
            }
        }
    }

    #[inline]
    fn conflicts(&self, t: u32, p: [i32; 3]) -> bool {
        let [a, b, c, d] = self.tets[t as usize];
        let [a, b, c] = [a, b, c].map(|v| self.points[v as usize]);
        match self.points.get(d as usize) {
            Some(&d) => in_conflict(a, b, c, d, p),
            // A point in the plane of a hull face is in conflict with the ghost as with the tetrahedron before it.
            None => match orient3d(a, b, c, p) {
                0 => self.conflicts(self.neighbors[t as usize][3], p),
                side => side > 0,
            },
        }
    }

    /// Fills the zone with the star of `v`.
    fn fill(&mut self, v: u32) {
        self.removed.clear();
        for &t in &self.zone {
            if !self.is_ghost(t) {
                self.removed.push((self.tets[t as usize], t));
            }
        }
        let reused = self.boundary.len().min(self.zone.len());
        self.star.clear();
        self.star.extend_from_slice(&self.zone[..reused]);
        for _ in reused..self.boundary.len() {
            let slot = self.free.pop().unwrap_or(self.tets.len() as u32);
            if slot as usize == self.tets.len() {
                self.tets.push([0; 4]);
                self.neighbors.push([0; 4]);
                self.marks.push(0);
            }
            self.star.push(slot);
        }
        self.free.extend_from_slice(&self.zone[reused..]);
        let vertices = self.boundary.len() / 2 + 2;
        if vertices <= LARGEST_TABLE {
            self.connect_by_table(v, vertices.max(SMALL_LINK));
        } else {
            self.connect_by_sorting(v);
        }
    }

    /// Reads the boundary before slots of the zone are overwritten.
    fn collect_link(&mut self) {
        self.link.clear();
        let mut count = 0;
        for &code in &self.boundary {
            let (inner, face) = (code >> 2, (code & 3) as usize);
            let tet = self.tets[inner as usize];
            let triangle = FACES[face].map(|k| tet[k]);
            let outer = self.neighbors[inner as usize][face];
            let around = self.neighbors[outer as usize];
            let back = (0..3).find(|&k| around[k as usize] == inner).unwrap_or(3);
            let numbers = triangle.map(|w| {
                let entry = &mut self.local[w as usize];
                if entry[0] != self.epoch {
                    *entry = [self.epoch, count];
                    count += 1;
                }
                entry[1]
            });
            self.link.push(LinkFace { triangle, around: [NONE; 3], numbers, outer, back });
        }
    }

    /// Makes the star's tetrahedra; they find each other in a table of the link's directed edges.
    fn connect_by_table(&mut self, v: u32, side: usize) {
        if self.table.len() < side * side {
            self.table.resize(side * side, 0);
        }
        for i in 0..self.link.len() {
            let [x, y, z] = self.link[i].numbers.map(|n| n as usize);
            let [opposite_x, opposite_y, opposite_z] = self.join(v, i);
            self.table[y * side + z] = opposite_x;
            self.table[z * side + x] = opposite_y;
            self.table[x * side + y] = opposite_z;
        }
        for face in &self.link {
            let [x, y, z] = face.numbers.map(|n| n as usize);
            for (a, b) in [(y, z), (z, x), (x, y)] {
                let (own, twin) = (self.table[a * side + b], self.table[b * side + a]);
                self.neighbors[(own >> 2) as usize][(own & 3) as usize] = twin >> 2;
            }
        }
    }

    /// [`Self::connect_by_table`] for large links, with a sorted list in place of the table.
    fn connect_by_sorting(&mut self, v: u32) {
        let key = |a: u32, b: u32| u64::from(a) << 32 | u64::from(b);
        self.sorted.clear();
        for i in 0..self.link.len() {
            let [x, y, z] = self.link[i].numbers;
            let codes = self.join(v, i);
            let edges = [key(y, z), key(z, x), key(x, y)];
            self.sorted.extend(edges.into_iter().zip(codes));
        }
        self.sorted.sort_unstable();
        for &(edge, own) in &self.sorted {
            let twin = key(edge as u32, (edge >> 32) as u32);
            let found = self.sorted.partition_point(|&(other, _)| other < twin);
            self.neighbors[(own >> 2) as usize][(own & 3) as usize] = self.sorted[found].1 >> 2;
        }
    }

    /// Joins face `i` of the link to `v` and to its neighbour outside. Returns `4 · slot + face` for the new faces
    /// opposite the corners of the link's face.
    fn join(&mut self, v: u32, i: usize) -> [u32; 3] {
        let infinite = self.points.len() as u32;
        let LinkFace { triangle: [x, y, z], outer, back, .. } = self.link[i];
        let slot = self.star[i];
        // Even permutations of (x, z, y, v) that have the vertex at infinity last.
        let (tet, at, own) = if x == infinite {
            ([v, y, z, x], [3, 1, 2], 0)
        } else if y == infinite {
            ([z, x, v, y], [1, 3, 0], 2)
        } else if z == infinite {
            ([y, v, x, z], [2, 0, 3], 1)
        } else {
            ([x, z, y, v], [0, 2, 1], 3)
        };
        self.tets[slot as usize] = tet;
        self.neighbors[slot as usize][own] = outer;
        self.neighbors[outer as usize][back as usize] = slot;
        at.map(|k| 4 * slot + k)
    }
}

/// Cutting zones down.
impl Triangulation {
    fn is_within(&self, limits: &Limits) -> bool {
        let infinite = self.points.len() as u32;
        let ghosts = self.zone.iter().filter(|&&t| self.is_ghost(t)).count();
        let beyond = |code: u32| code & 3 != 3 && self.tets[(code >> 2) as usize][3] == infinite;
        let inserted = self.boundary.iter().filter(|&&code| !beyond(code)).count();
        let link = self.boundary.len() / 2 + 2 - usize::from(ghosts > 0);
        self.zone.len() - ghosts <= limits.removed && inserted <= limits.inserted && link <= limits.link
    }

    /// On which side of face `i` of tetrahedron `t` the point is: positive outside.
    fn side(&self, t: u32, i: usize, p: [i32; 3]) -> i128 {
        let tet = self.tets[t as usize];
        let [x, y, z] = FACES[i].map(|k| self.points[tet[k] as usize]);
        orient3d(x, y, z, p)
    }

    /// Whether the star of `v` would fill the zone, without a vertex left inside.
    fn is_star_shaped(&mut self, v: u32) -> bool {
        let p = self.points[v as usize];
        let sees = |code: u32| {
            let (t, i) = (code >> 2, (code & 3) as usize);
            // Faces of ghosts follow from those of the tetrahedra before them, unless one was taken and one not.
            if self.is_ghost(t) { i != 3 } else { self.side(t, i, p) < 0 }
        };
        if !self.boundary.iter().all(|&code| sees(code)) {
            return false;
        }
        let seen = self.epoch + 1;
        let mut vertices = 0;
        for &t in &self.zone {
            for w in self.tets[t as usize] {
                let entry = &mut self.local[w as usize];
                vertices += usize::from(entry[0] != seen);
                entry[0] = seen;
            }
        }
        vertices == self.boundary.len() / 2 + 2
    }

    /// Cuts the zone down to a star-shaped part around `v` within the limits.
    fn cut(&mut self, v: u32, limits: &Limits) -> Result<(), BuildError> {
        let p = self.points[v as usize];
        let mut kept = self.containing(self.zone[0], p);
        let needed = kept.len();
        let rest = self.zone.iter().filter(|&&t| !self.is_ghost(t) && !kept.contains(&t));
        let rest: Vec<u32> = rest.copied().collect();
        kept.extend(rest);
        loop {
            self.shrink(&mut kept, needed, p);
            self.take(&kept, p);
            if self.is_within(limits) {
                return Ok(());
            }
            if kept.len() == needed {
                return Err(BuildError::Crowded { point: v });
            }
            // The farthest from `v` in the order of the flood go first.
            kept.truncate((kept.len() * 7 / 8).max(needed));
        }
    }

    /// The tetrahedra that contain `p`, inside or on their boundary; `at` is one of them, and the first.
    fn containing(&self, at: u32, p: [i32; 3]) -> Vec<u32> {
        let mut found = vec![at];
        let mut done = 0;
        while let Some(&t) = found.get(done) {
            done += 1;
            for i in (0..4).filter(|&i| self.side(t, i, p) == 0) {
                let next = self.neighbors[t as usize][i];
                if !self.is_ghost(next) && !found.contains(&next) {
                    found.push(next);
                }
            }
        }
        found
    }

    /// Drops tetrahedra, but not the first `needed`, until all that is left is star-shaped around `p`.
    fn shrink(&mut self, kept: &mut Vec<u32>, needed: usize, p: [i32; 3]) {
        let protected = kept[..needed].to_vec();
        loop {
            let before = kept.len();
            self.mark(kept);
            kept.retain(|&t| {
                let stays = protected.contains(&t) || (0..4).all(|i| self.is_seen(t, i, p));
                if !stays {
                    self.marks[t as usize] = self.epoch + 1;
                }
                stays
            });
            self.keep_connected(kept, protected[0]);
            if kept.len() == before && !self.free_a_vertex(kept, &protected, p) {
                return;
            }
        }
    }

    fn mark(&mut self, kept: &[u32]) {
        self.next_epoch();
        kept.iter().for_each(|&t| self.marks[t as usize] = self.epoch);
    }

    /// Whether face `i` of the marked tetrahedron `t` is inside the zone or seen from `p`.
    fn is_seen(&self, t: u32, i: usize, p: [i32; 3]) -> bool {
        let next = self.neighbors[t as usize][i];
        self.marks[next as usize] == self.epoch || {
            let side = self.side(t, i, p);
            side < 0 || (side == 0 && self.is_ghost(next))
        }
    }

    fn keep_connected(&mut self, kept: &mut Vec<u32>, first: u32) {
        let reached = self.epoch + 1;
        let mut stack = vec![first];
        let inside = self.epoch;
        self.marks[first as usize] = reached;
        while let Some(t) = stack.pop() {
            for next in self.neighbors[t as usize] {
                if self.marks[next as usize] == inside {
                    self.marks[next as usize] = reached;
                    stack.push(next);
                }
            }
        }
        kept.retain(|&t| self.marks[t as usize] == reached);
        self.mark(kept);
    }

    /// Drops the tetrahedra around a vertex that would vanish inside the zone, if there is any.
    fn free_a_vertex(&mut self, kept: &mut Vec<u32>, protected: &[u32], p: [i32; 3]) -> bool {
        let outside = self.epoch + 1;
        for &t in kept.iter() {
            let tet = self.tets[t as usize];
            for (i, face) in FACES.iter().enumerate() {
                let next = self.neighbors[t as usize][i];
                let inside = self.marks[next as usize] == self.epoch
                    || (self.is_ghost(next) && self.side(t, i, p) == 0);
                if !inside {
                    face.iter().for_each(|&k| self.local[tet[k] as usize][0] = outside);
                }
            }
        }
        let vertices = kept.iter().flat_map(|&t| self.tets[t as usize]);
        let Some(hidden) = vertices.into_iter().find(|&w| self.local[w as usize][0] != outside) else {
            return false;
        };
        let before = kept.len();
        kept.retain(|t| protected.contains(t) || !self.tets[*t as usize].contains(&hidden));
        kept.len() < before
    }

    /// Makes `kept` the zone, with the ghosts in whose planes `p` lies.
    fn take(&mut self, kept: &[u32], p: [i32; 3]) {
        self.mark(kept);
        self.zone.clear();
        self.zone.extend_from_slice(kept);
        for &t in kept {
            for i in 0..4 {
                let next = self.neighbors[t as usize][i];
                if self.is_ghost(next) && self.side(t, i, p) == 0 {
                    self.marks[next as usize] = self.epoch;
                    self.zone.push(next);
                }
            }
        }
        self.boundary.clear();
        for &t in &self.zone {
            let around = (0..4).zip(self.neighbors[t as usize]);
            let faces = around.filter(|&(_, next)| self.marks[next as usize] != self.epoch);
            self.boundary.extend(faces.map(|(i, _)| 4 * t + i));
        }
    }
}

/// Points whose convex hull is that of all: the corners of the bounding box if they are points, else the extreme
/// points. In increasing order of number.
pub(crate) fn extreme_points(points: &[[i32; 3]]) -> Result<Vec<u32>, BuildError> {
    if let Some(corners) = box_corners(points) {
        return Ok(corners);
    }
    let numbers: Vec<u32> = (0..points.len() as u32).collect();
    let mesh = Triangulation::of(points, &numbers)?;
    Ok(mesh.extreme_vertices())
}

fn box_corners(points: &[[i32; 3]]) -> Option<Vec<u32>> {
    let [low, high] = bounds(points)?;
    let is_corner = |p: &[i32; 3]| (0..3).all(|i| p[i] == low[i] || p[i] == high[i]);
    let corners: Vec<u32> = (0..).zip(points).filter(|(_, p)| is_corner(p)).map(|(v, _)| v).collect();
    let flat = (0..3).any(|i| low[i] == high[i]);
    let mut places: Vec<[i32; 3]> = corners.iter().map(|&v| points[v as usize]).collect();
    places.sort_unstable();
    places.dedup();
    (!flat && places.len() == 8 && corners.len() == 8).then_some(corners)
}

fn bounds(points: &[[i32; 3]]) -> Option<[[i32; 3]; 2]> {
    let first = *points.first()?;
    let extend = |[low, high]: [[i32; 3]; 2], p: &[i32; 3]| {
        [[0, 1, 2].map(|i| low[i].min(p[i])), [0, 1, 2].map(|i| high[i].max(p[i]))]
    };
    Some(points.iter().fold([first; 2], extend))
}

impl Triangulation {
    /// The vertices at which three or more planes of the hull meet.
    fn extreme_vertices(&self) -> Vec<u32> {
        let mut faces: Vec<(u32, u32)> = Vec::new();
        for t in self.slots_in_use().filter(|&t| self.is_ghost(t)) {
            faces.extend(self.tets[t as usize][..3].iter().map(|&v| (v, t)));
        }
        faces.sort_unstable();
        let around = faces.chunk_by(|a, b| a.0 == b.0);
        around.filter(|around| self.planes(around) >= 3).map(|around| around[0].0).collect()
    }

    /// The area of the hull with the points in these places.
    pub fn hull_area(&self, positions: &[[i32; 3]]) -> f64 {
        let area = |t: u32| {
            let [a, b, c, _] = self.tets[t as usize];
            let at = |v: u32| positions[v as usize].map(f64::from);
            let [u, v] = [b, c].map(|w| [0, 1, 2].map(|i| at(w)[i] - at(a)[i]));
            let normal = [0, 1, 2].map(|i| u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3]);
            0.5 * normal.iter().map(|x| x * x).sum::<f64>().sqrt()
        };
        self.slots_in_use().filter(|&t| self.is_ghost(t)).map(area).sum()
    }

    /// How many planes the hull has at a vertex: 3 means three or more.
    fn planes(&self, around: &[(u32, u32)]) -> usize {
        let mut planes: Vec<[[i32; 3]; 3]> = Vec::new();
        for &(_, t) in around {
            let [a, b, c, _] = self.tets[t as usize];
            let corners = [a, b, c].map(|v| self.points[v as usize]);
            let is_in = |[a, b, c]: &[[i32; 3]; 3]| corners.iter().all(|&p| orient3d(*a, *b, *c, p) == 0);
            if !planes.iter().any(is_in) {
                planes.push(corners);
                if planes.len() == 3 {
                    break;
                }
            }
        }
        planes.len()
    }
}

/// The points relative to a corner of their bounding box, without the factors of two that they share.
pub(crate) fn shifted(points: &[[i32; 3]]) -> Vec<[i32; 3]> {
    let Some([low, _]) = bounds(points) else { return Vec::new() };
    let moved = points.iter().map(|p| [0, 1, 2].map(|i| p[i] - low[i]));
    let digits = moved.clone().flatten().fold(0, |all, x| all | x);
    let shift = if digits == 0 { 0 } else { digits.trailing_zeros() };
    moved.map(|p| p.map(|x| x >> shift)).collect()
}

/// Each round of insertions is about so many powers of two larger than the one before.
const ROUND_BITS: u32 = 3;

/// A biased randomised order (Amenta, Choi, Rote 2003): rounds of growing size, each along a Hilbert curve.
fn insertion_order(points: &[[i32; 3]], numbers: &[u32]) -> Vec<u32> {
    let largest = points.iter().flatten().copied().max().unwrap_or(0);
    let bits = (i32::BITS - largest.leading_zeros()).max(1);
    let shift = bits.saturating_sub(CURVE_BITS);
    let mut keyed: Vec<(u64, u32)> = numbers
        .iter()
        .map(|&v| {
            let place = points[v as usize].map(|x| (x >> shift) as u32);
            let round = mixed(v).trailing_zeros() / ROUND_BITS;
            (u64::from(10 - round.min(10)) << 60 | along_curve(place, bits - shift), v)
        })
        .collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, v)| v).collect()
}

/// A number's bits, well mixed (the finaliser of MurmurHash3).
fn mixed(v: u32) -> u32 {
    let v = (v ^ v >> 16).wrapping_mul(0x85eb_ca6b);
    let v = (v ^ v >> 13).wrapping_mul(0xc2b2_ae35);
    v ^ v >> 16
}

const CURVE_BITS: u32 = 19;

/// How far along a Hilbert curve a point is (Skilling 2004).
fn along_curve(mut x: [u32; 3], bits: u32) -> u64 {
    let mut q = 1 << (bits - 1);
    while q > 1 {
        for i in 0..3 {
            if x[i] & q != 0 {
                x[0] ^= q - 1;
            } else {
                let t = (x[0] ^ x[i]) & (q - 1);
                x[0] ^= t;
                x[i] ^= t;
            }
        }
        q >>= 1;
    }
    x[1] ^= x[0];
    x[2] ^= x[1];
    let mut t = 0;
    let mut q = 1 << (bits - 1);
    while q > 1 {
        if x[2] & q != 0 {
            t ^= q - 1;
        }
        q >>= 1;
    }
    let x = x.map(|c| c ^ t);
    (0..bits).rev().fold(0, |key, bit| x.iter().fold(key, |key, c| key << 1 | u64::from(c >> bit & 1)))
}

/// Four points that span a tetrahedron, the first such in the order, positive.
fn independent(points: &[[i32; 3]], order: &[u32]) -> Result<[u32; 4], BuildError> {
    let at = |v: u32| points[v as usize];
    let find = |wanted: &dyn Fn([i32; 3]) -> bool| {
        order.iter().copied().find(|&v| wanted(at(v))).ok_or(BuildError::Flat)
    };
    let a = *order.first().ok_or(BuildError::Flat)?;
    let b = find(&|p| p != at(a))?;
    let c = find(&|p| !are_collinear(at(a), at(b), p))?;
    let d = find(&|p| orient3d(at(a), at(b), at(c), p) != 0)?;
    Ok(if orient3d(at(a), at(b), at(c), at(d)) > 0 { [a, b, c, d] } else { [a, c, b, d] })
}

fn are_collinear(a: [i32; 3], b: [i32; 3], c: [i32; 3]) -> bool {
    let [u, v] = [b, c].map(|p| [0, 1, 2].map(|i| i64::from(p[i]) - i64::from(a[i])));
    (0..3).all(|i| u[i] * v[(i + 1) % 3] == u[(i + 1) % 3] * v[i])
}
