//! Scratch space for insertions and removals: T_u and the star that an insertion makes.
//!
//! Every tetrahedron of T_u has the near vertex n. In the star that the insertion of v makes, each of them has v in its place, and takes its
//! slot; and behind each face of T_u that has n and does not go with the tetrahedron (that is no *inner* face), a tetrahedron with n and
//! v fills the gap. With triangles instead of tetrahedra, where the edge n b is an inner face and n a and n c are not:
//!
//! ```text
//!    T_u, around n            the star of v
//!
//!      a ───── b                a ───── b
//!      │  0  ╱ │                │ ╲ 0 ╱ │          0, 1   take the slots of T_u: they have v instead of n
//!      │   ╱   │      u+        │   v   │          2, 3   fill the gaps: they have n and v
//!      │ ╱  1  │    ─────▶      │2 ╱ ╲ 1│          link   n, a, b, c: the vertices of Π_u; n is the first
//!      n ───── c                │ ╱ 3 ╲ │
//!                               n ───── c
//! ```
//!
//! What must hold: no face that stays has tetrahedra of T_u on both sides; the gaps lie around the edge n v in one piece
//! ([`Scratch::find_star`]); and all tetrahedra of the star are positive ([`Places::is_positive`]). The removal of v undoes this: what
//! has v and n goes, what has v alone gets n in its place.

use super::new_star::{ByCorner, MOST, NEW, NO_ENTRY, NewTet};
use super::places::Places;
use crate::mesh::NONE;
use crate::mt::CurrentMesh;
use crate::mt::mesh::stars::Star;
use crate::mt::mesh::tet::{TURN, corner_of};
use arrayvec::ArrayVec;

/// Scratch space for insertions and removals.
#[derive(Clone, Debug)]
pub(in crate::mt) struct Scratch {
    /// The slots of the tetrahedra of the star: first those of T_u, then, once they are needed, those of what fills the gaps. That of
    /// [`NO_ENTRY`] is [`NONE`].
    pub slots: ByCorner<u32>,
    /// How many tetrahedra T_u has.
    pub removed_len: usize,
    /// The star: first what takes the slots of T_u in its order, then what fills the gaps.
    pub star: [NewTet; MOST],
    pub star_len: usize,
    /// Slots of the vertices of Π_u; the near vertex is the first. That of the new vertex is set when it is inserted.
    pub link: ByCorner<u32>,
    pub link_len: usize,
    /// The faces of T_u that have the near vertex and stay: a tetrahedron of the star, and the face.
    gaps: ArrayVec<[u8; 2], { 3 * MOST }>,
    /// For each vertex of the link: which gap has a face with it and the edge from the near to the new vertex, and the corner of
    /// the gap opposite this face; once two have, [`JOINED`].
    ends: ByCorner<[u8; 2]>,
    /// The levels of the new vertex: in its first region, and then, where fields jump, in each further one.
    pub levels: Vec<i32>,
    /// Where fields jump, the regions of the new vertex, ascending.
    pub regions: Vec<u16>,
    pub gathered: Star,
    pub places: Places,
    pub hashes: Hashes,
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            slots: [NONE; _],
            removed_len: 0,
            star: [NewTet::default(); MOST],
            star_len: 0,
            link: [0; _],
            link_len: 0,
            gaps: ArrayVec::new(),
            ends: [NO_END; _],
            levels: Vec::new(),
            regions: Vec::new(),
            gathered: Star::default(),
            places: Places::default(),
            hashes: Hashes::default(),
        }
    }
}

/// No gap has a face at the vertex yet.
const NO_END: [u8; 2] = [NO_ENTRY, 0];
/// Two gaps meet in the face at the vertex.
const JOINED: [u8; 2] = [NO_ENTRY, 1];

impl Scratch {
    /// Finds the star that the insertion makes, whose T_u has been collected. None if T_u is not what an insertion removes.
    pub fn find_star(&mut self, mesh: &mut CurrentMesh) -> Option<()> {
        let near = self.link[0];
        mesh.number_slot(near, 0);
        self.link_len = 1;
        self.gaps.clear();
        for i in 0..self.removed_len {
            let t = self.slots[i];
            let (tet, around, inner) = (mesh.tets[t as usize], mesh.neighbors[t as usize], mesh.tet_byte(t));
            let mut corners = self.number(mesh, tet)?;
            let at = corner_of(&tet, near);
            corners[at] = NEW;
            // What lies behind a face and has a number is of T_u.
            let mut across = around.map(|n| mesh.tet_number(n).map_or(NO_ENTRY, |number| number as u8));
            let (mut known, mut there) = (0, 0);
            for face in 0..4 {
                known |= u8::from(across[face] != NO_ENTRY) << face;
                there |= u8::from(around[face] != NONE) << face;
            }
            let at_near = !(1 << at) & 15;
            // A face that stays must not have tetrahedra of T_u on both sides; one that goes must, or be of the boundary.
            if (known ^ inner) & there & at_near != 0 {
                return None;
            }
            across[at] = NO_ENTRY;
            self.star[i] = NewTet {
                corners,
                across,
                own: at as u8,
                beyond: around[at],
                source: t,
                remover: NONE,
                inner: 0,
            };
            let mut stay = !inner & at_near;
            while stay != 0 {
                self.gaps.push([i as u8, stay.trailing_zeros() as u8]);
                stay &= stay - 1;
            }
        }
        self.fill_gaps(mesh)
    }

    /// The indices of the corners of a tetrahedron in the link, where they are put if they are new; none if there are too many.
    #[inline]
    fn number(&mut self, mesh: &mut CurrentMesh, tet: [u32; 4]) -> Option<[u8; 4]> {
        let link = self.link.first_chunk_mut()?;
        if self.link_len + 4 < MOST {
            return Some(tet.map(|v| mesh.number_vertex(v, link, &mut self.link_len)));
        }
        let mut corners = [0; 4];
        for (corner, v) in corners.iter_mut().zip(tet) {
            *corner = mesh.vertex_number(v).map_or_else(
                || {
                    // One less than all numbers, so that a mark never overflows.
                    let is_room = self.link_len + 1 < MOST;
                    is_room.then(|| mesh.number_vertex(v, link, &mut self.link_len))
                },
                Some,
            )?;
        }
        Some(corners)
    }

    /// Adds the tetrahedra that fill the gaps, and joins them. All have the edge from the near to the new vertex: they must close up around
    /// it, or run from boundary to boundary, in one piece.
    ///
    /// ```text
    ///   seen along that edge, +        each gap has two faces with the edge, each with one vertex of the link:
    ///                                  there it has an end
    ///       b            b
    ///     1 │ 2        1 │ 2           closed   a0 a1 │ b1 b2 │ c2 c3 │ d0 d3     each vertex twice
    ///   a ──+── c    a ──+── c         open     a1 │ b1 b2 │ c2                   but for two of them
    ///     0 │ 3
    ///       d
    /// ```
    ///
    /// Two gaps with an end at the same vertex meet in the face there. With three at a vertex, more than two gaps would meet. With one,
    /// the face is of the boundary: there are none or two such ends. As every gap has two sides, the gaps then form circles, or one path
    /// and circles; that all are met on the way from one to the next shows that it is a single circle, or the path alone.
    fn fill_gaps(&mut self, mesh: &CurrentMesh) -> Option<()> {
        let (first, count) = (self.removed_len, self.gaps.len());
        if count == 0 || first + count > MOST {
            return None;
        }
        self.star_len = first + count;
        self.ends[..self.link_len].fill(NO_END);
        let mut joined = 0;
        for gap in first..self.star_len {
            let [of, face] = self.gaps[gap - first].map(usize::from);
            let NewTet { mut corners, own, source, .. } = self.star[of % MOST];
            let beyond = mesh.neighbors[source as usize][face & 3];
            self.star[of % MOST].across[face & 3] = gap as u8;
            corners[usize::from(own) & 3] = 0;
            corners[face & 3] = NEW;
            let mut across = [NO_ENTRY; 4];
            across[usize::from(own) & 3] = of as u8;
            self.star[gap % MOST] =
                NewTet { corners, across, own: face as u8, beyond, source, remover: NONE, inner: 0 };
            for [side, vertex] in sides(usize::from(own), face) {
                let end = &mut self.ends[usize::from(corners[vertex])];
                match *end {
                    JOINED => return None,
                    NO_END => *end = [gap as u8, side as u8],
                    [other, its] => {
                        *end = JOINED;
                        self.star[usize::from(other) % MOST].across[usize::from(its) & 3] = gap as u8;
                        self.star[gap % MOST].across[side] = other;
                        joined += 1;
                    }
                }
            }
        }
        // From one end, or from anywhere, all must be met.
        let start = match count - joined {
            0 => first as u8,
            1 => self.ends[..self.link_len].iter().find(|end| end[0] != NO_ENTRY)?[0],
            _ => return None,
        };
        (self.met_from(start, count) == count).then_some(())
    }

    /// How many gaps are met from `start` on, each behind a face of the one before: once around, or to the end. No more than one above
    /// `most` are counted.
    fn met_from(&self, start: u8, most: usize) -> usize {
        let (mut met, mut from, mut at) = (1, NO_ENTRY, start);
        while met <= most {
            let NewTet { across, own, .. } = self.star[usize::from(at) % MOST];
            let near = self.gap_near(usize::from(at));
            // Opposite the new vertex is no gap, and opposite the near vertex is what T_u left.
            let next = sides(near, usize::from(own)).map(|[side, _]| across[side]);
            let Some(next) = next.into_iter().find(|&n| n != NO_ENTRY && n != from) else { break };
            if next == start {
                break;
            }
            (from, at) = (at, next);
            met += 1;
        }
        met
    }

    /// The corner of a gap that is the near vertex: where the tetrahedron has the new vertex behind whose face it lies.
    #[inline]
    fn gap_near(&self, gap: usize) -> usize {
        let of = self.gaps[(gap - self.removed_len) % self.gaps.len()][0];
        usize::from(self.star[usize::from(of) % MOST].own)
    }

    /// Hashes the labels of the star.
    pub fn hash_star(&mut self, mesh: &CurrentMesh, vertex: u32) {
        let Self { star, star_len, link, link_len, hashes, .. } = self;
        let labels = link[..*link_len].iter().map(|&slot| mesh.vertex(slot).0);
        hashes.set(labels, vertex, &star[..*star_len]);
    }

    /// Puts the new vertex at `position`, and predicts its levels from those around it.
    pub fn place(&mut self, mesh: &CurrentMesh, position: [i32; 3]) {
        let link = &self.link[..self.link_len];
        self.places.set(link.iter().map(|&v| mesh.positions[v as usize]), position);
        if let Some(jumps) = mesh.jumps() {
            self.regions = mesh.regions_of(&self.slots[..self.removed_len]);
            return self.predict_sides(mesh, jumps);
        }
        self.levels.resize(mesh.fields, 0);
        self.places.predict_levels(|v| mesh.levels(link[v]), &mut self.levels);
    }

    /// Predicts the levels of the new vertex in each of its regions: of a field that jumps, from those vertices around it that are in the
    /// region, too.
    fn predict_sides(&mut self, mesh: &CurrentMesh, jumps: &[bool]) {
        self.levels.clear();
        for &region in &self.regions {
            let mut sides = [NONE; MOST];
            for (new, &t) in self.star[..self.removed_len].iter().zip(&self.slots) {
                if mesh.region(t) == region {
                    for corner in new.corners.map(|corner| if corner == NEW { 0 } else { corner }) {
                        let slot = self.link[usize::from(corner)];
                        sides[usize::from(corner) % MOST] = mesh.side(slot, region);
                    }
                }
            }
            for (field, &jumps) in jumps.iter().enumerate() {
                let level = self.places.predict_level(|v| match jumps {
                    true => Some(sides[v]).filter(|&side| side != NONE).map(|side| mesh.levels(side)[field]),
                    false => Some(mesh.levels(self.link[v])[field]),
                });
                self.levels.push(level);
            }
        }
    }

    /// Adds what is stored of an update to the levels that are predicted. None if that is not what the vertex needs.
    pub fn add_residuals(&mut self, mesh: &CurrentMesh, own: &[i32], sides: &[i32]) -> Option<()> {
        let fields = mesh.fields;
        if sides.is_empty() {
            self.levels.truncate(fields);
        }
        let residuals = own.iter().chain(sides);
        (self.levels.len() == own.len() + sides.len()).then_some(())?;
        self.levels.iter_mut().zip(residuals).for_each(|(level, residual)| {
            *level = level.saturating_add(*residual);
        });
        for i in fields..self.levels.len() {
            if !mesh.jumps()?[i % fields] {
                self.levels[i] = self.levels[i % fields];
            }
        }
        Some(())
    }
}

/// Hashes of the vertices and the tetrahedra of a star.
#[derive(Clone, Debug)]
pub(in crate::mt) struct Hashes {
    /// Of the labels of the vertices.
    pub vertices: ByCorner<u64>,
    /// For each tetrahedron, the sum of those of its corners.
    pub tets: Vec<u64>,
}

impl Default for Hashes {
    fn default() -> Self {
        Self { vertices: [0; _], tets: Vec::new() }
    }
}

impl Hashes {
    /// Hashes a star, given the labels of its link and of the new vertex.
    pub fn set(&mut self, link: impl Iterator<Item = u32>, vertex: u32, star: &[NewTet]) {
        self.vertices.iter_mut().zip(link).for_each(|(hash, label)| *hash = spread(label));
        self.vertices[usize::from(NEW)] = spread(vertex);
        let hash = |corner: u8| self.vertices[usize::from(corner)];
        self.tets.clear();
        self.tets.extend(star.iter().map(|new| {
            let [a, b, c, d] = new.corners.map(hash);
            a.wrapping_add(b).wrapping_add(c).wrapping_add(d)
        }));
    }

    /// The hash of a face of tetrahedron `tet`, given the corner opposite it.
    pub fn of_face(&self, tet: usize, opposite: u8) -> u64 {
        self.tets[tet].wrapping_add(self.vertices[usize::from(opposite)].rotate_left(17))
    }
}

/// The corners of a gap that are neither the near vertex nor the new one, twice: one whose opposite face has the edge between these, and the
/// vertex of that face.
#[inline]
fn sides(near: usize, new: usize) -> [[usize; 2]; 2] {
    let [_, _, a, b] = TURN[(4 * near + new) % 16].map(|corner| usize::from(corner) & 3);
    [[a, b], [b, a]]
}

/// Spreads a label over the bits of a word (the constants are those of SplitMix64).
#[inline]
pub(in crate::mt) fn spread(label: u32) -> u64 {
    let x = u64::from(label).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ x >> 31
}
