//! Who meets whom: tetrahedra across faces, and the shape of the stars of vertices.

use crate::geom::Groups;
use crate::mesh::{FACES, MAX_TETS, MeshError, NONE};
use crate::threads;
use std::ops::Range;

/// One side of a face: the face of one tetrahedron. A number, for sorting: the face's vertices in increasing order, and
/// `4 · tet + i` for face `i`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[doc(hidden)]
pub struct HalfFace(u128);

impl HalfFace {
    fn new([a, b, c]: [u32; 3], code: u32) -> Self {
        let number = [b, c, code].iter().fold(u128::from(a), |number, &part| number << 32 | u128::from(part));
        Self(number)
    }

    /// The face of a code: see [`HalfFace::code`].
    fn of(tets: &[[u32; 4]], code: u32) -> Self {
        let mut key = face_of(tets[(code >> 2) as usize], (code & 3) as usize);
        key.sort_unstable();
        Self::new(key, code)
    }

    /// The face's vertices in increasing order.
    fn vertices(self) -> [u32; 3] {
        [96, 64, 32].map(|shift| (self.0 >> shift) as u32)
    }

    /// Four times its tetrahedron, and which of that one's faces it is.
    fn code(self) -> u32 {
        self.0 as u32
    }

    /// The tetrahedron that this face belongs to.
    pub fn tet(self) -> u32 {
        self.code() >> 2
    }

    /// Which of its tetrahedron's faces it is.
    pub fn face(self) -> usize {
        (self.code() & 3) as usize
    }

    /// Whether sorting its vertices turns it around.
    pub fn is_odd(self, tets: &[[u32; 4]]) -> bool {
        is_odd(face_of(tets[self.tet() as usize], self.face()))
    }
}

/// The vertices of face `i` of `tet`, in the outward order of [`FACES`].
pub(crate) fn face_of(tet: [u32; 4], i: usize) -> [u32; 3] {
    FACES[i].map(|k| tet[k])
}

/// Whether sorting three different numbers takes an odd number of swaps.
pub(crate) fn is_odd([a, b, c]: [u32; 3]) -> bool {
    (a > b) ^ (a > c) ^ (b > c)
}

/// All faces of tetrahedra, by their smallest vertices. The rest is sorted when they are read: that takes a quarter of the memory of a
/// sorted list.
#[doc(hidden)]
pub struct FaceTable<'a> {
    tets: &'a [[u32; 4]],
    /// Where the faces of each bucket begin; one more than there are buckets.
    starts: Vec<u32>,
    /// Of each face what [`HalfFace::code`] tells.
    codes: Vec<u32>,
}

impl<'a> FaceTable<'a> {
    /// # Errors
    /// If there are more than [`MAX_TETS`].
    pub fn new(tets: &'a [[u32; 4]]) -> Result<Self, MeshError> {
        if tets.len() > MAX_TETS {
            return Err(MeshError::TooMany { tets: tets.len() });
        }
        let largest = tets.iter().flatten().max().copied().unwrap_or(0);
        let mut shift = 0;
        while (largest >> shift) as usize > 4 * tets.len() + 64 {
            // Few tetrahedra with huge indices must not size the table.
            shift += 1;
        }
        let bucket = |face: HalfFace| (face.vertices()[0] >> shift) as usize;
        let mut starts = vec![0_u32; (largest >> shift) as usize + 2];
        for face in half_faces(tets) {
            starts[bucket(face) + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut codes = vec![0_u32; 4 * tets.len()];
        for face in half_faces(tets) {
            let slot = &mut next[bucket(face)];
            codes[*slot as usize] = face.code();
            *slot += 1;
        }
        Ok(Self { tets, starts, codes })
    }

    /// Shows all groups of equal faces, in increasing order of their vertices, each with all tetrahedra around it in increasing order.
    ///
    /// # Errors
    /// The first one of `see`.
    pub fn each_group<E>(&self, mut see: impl FnMut(&[HalfFace]) -> Result<(), E>) -> Result<(), E> {
        let mut bucket: Vec<HalfFace> = Vec::new();
        for ends in self.starts.windows(2) {
            let codes = &self.codes[ends[0] as usize..ends[1] as usize];
            bucket.clear();
            bucket.extend(codes.iter().map(|&code| HalfFace::of(self.tets, code)));
            bucket.sort_unstable();
            bucket.chunk_by(|a, b| a.0 >> 32 == b.0 >> 32).try_for_each(&mut see)?;
        }
        Ok(())
    }
}

fn half_faces(tets: &[[u32; 4]]) -> impl Iterator<Item = HalfFace> + '_ {
    (0..4 * tets.len() as u32).map(|code| HalfFace::of(tets, code))
}

/// The neighbours of each tetrahedron: entry `i` lies across face `i`, or is [`NONE`] at the boundary.
///
/// # Errors
/// If three or more tetrahedra share a face, or there are more than [`MAX_TETS`].
pub fn neighbors(tets: &[[u32; 4]]) -> Result<Vec<[u32; 4]>, MeshError> {
    let fits = |group: &[HalfFace], _| if group.len() > 2 { Err(crowded(group)) } else { Ok(()) };
    match_faces(&FaceTable::new(tets)?, fits)
}

/// The neighbours of the tetrahedra of a table of faces. `fits` may refuse a face of several tetrahedra; it gets whether the
/// first two of them lie on the same side.
#[doc(hidden)]
pub fn match_faces<E>(
    faces: &FaceTable<'_>,
    fits: impl Fn(&[HalfFace], bool) -> Result<(), E>,
) -> Result<Vec<[u32; 4]>, E> {
    let tets = faces.tets;
    let mut neighbors = vec![[NONE; 4]; tets.len()];
    faces.each_group(|group| {
        if let [a, b, ..] = group {
            fits(group, a.is_odd(tets) == b.is_odd(tets))?;
            neighbors[a.tet() as usize][a.face()] = b.tet();
            neighbors[b.tet() as usize][b.face()] = a.tet();
        }
        Ok(())
    })?;
    Ok(neighbors)
}

/// The faces without neighbour, each with its tetrahedron, counter-clockwise when seen from outside. Free slots have none.
#[doc(hidden)]
pub fn boundary_faces<'a>(
    tets: &'a [[u32; 4]],
    neighbors: &'a [[u32; 4]],
) -> impl Iterator<Item = (u32, [u32; 3])> + 'a {
    faces(tets, neighbors).filter(|(_, beside, _)| *beside == NONE).map(|(t, _, face)| (t, face))
}

/// All faces of tetrahedra, each with its tetrahedron and the neighbour there, or [`NONE`], counter-clockwise when seen from outside. Free
/// slots have none.
pub(crate) fn faces<'a>(
    tets: &'a [[u32; 4]],
    neighbors: &'a [[u32; 4]],
) -> impl Iterator<Item = (u32, u32, [u32; 3])> + 'a {
    let live = (0..).zip(tets.iter().zip(neighbors)).filter(|(_, (tet, _))| tet[0] != NONE);
    live.flat_map(|(t, (tet, around))| (0..4).map(move |i| (t, around[i], face_of(*tet, i))))
}

/// The error for a face with three or more tetrahedra.
pub(crate) fn crowded(group: &[HalfFace]) -> MeshError {
    MeshError::CrowdedFace { face: group[0].vertices(), tets: group.iter().map(|f| f.tet().into()).collect() }
}

/// Checks that every tetrahedron refers to existing points.
pub(crate) fn check_indices(points: usize, tets: &[[u32; 4]]) -> Result<(), MeshError> {
    if tets.len() > MAX_TETS {
        return Err(MeshError::TooMany { tets: tets.len() });
    }
    for (tet, vertices) in (0_u32..).zip(tets) {
        if let Some(&point) = vertices.iter().find(|&&v| v as usize >= points) {
            return Err(MeshError::MissingPoint { tet: tet.into(), point, points });
        }
    }
    Ok(())
}

/// The shape of a mesh, from its connectivity alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topology {
    /// The neighbours of each tetrahedron; see [`neighbors`].
    pub neighbors: Vec<[u32; 4]>,
    /// Parts that hang together by faces.
    pub components: usize,
    /// Faces with one tetrahedron.
    pub boundary_faces: usize,
    /// For each point, whether the mesh is *not* a 3-manifold there: the link of the vertex is neither one
    /// sphere nor one disc. Both ends of a non-manifold edge are marked; unused points are not.
    pub non_manifold: Vec<bool>,
}

impl Topology {
    /// How many vertices are marked as non-manifold.
    pub fn non_manifold_count(&self) -> usize {
        self.non_manifold.iter().filter(|&&marked| marked).count()
    }
}

/// Works out the [`Topology`] of `tets` over `points` points.
///
/// # Errors
/// As [`neighbors`], and if a tetrahedron names a point that is not there.
pub fn topology(points: usize, tets: &[[u32; 4]]) -> Result<Topology, MeshError> {
    check_indices(points, tets)?;
    Ok(topology_of(points, tets, neighbors(tets)?))
}

/// The topology of tetrahedra with these neighbours.
pub(crate) fn topology_of(points: usize, tets: &[[u32; 4]], neighbors: Vec<[u32; 4]>) -> Topology {
    let boundary_faces = neighbors.iter().flatten().filter(|&&n| n == NONE).count();
    let non_manifold = non_manifold(points, tets, &neighbors, |_| true);
    Topology { components: components(&neighbors).count(), boundary_faces, non_manifold, neighbors }
}

/// So many vertices are looked at by one thread at a time.
const SHARE: usize = 1 << 12;

/// For each vertex whether the mesh is not a 3-manifold there, as [`Topology`] has it, of those that are `wanted`.
pub(crate) fn non_manifold(
    points: usize,
    tets: &[[u32; 4]],
    neighbors: &[[u32; 4]],
    wanted: impl Fn(usize) -> bool + Sync,
) -> Vec<bool> {
    let stars = stars(points, tets);
    let is_marked = |scratch: &mut LinkScratch, v: usize| {
        let star = stars.of(v);
        wanted(v) && !star.is_empty() && !scratch.link_is_sphere_or_disc(v as u32, star, tets, neighbors)
    };
    let of_range = |range: Range<usize>| {
        let mut scratch = LinkScratch::default();
        range.map(|v| is_marked(&mut scratch, v)).collect::<Vec<bool>>()
    };
    threads::map(points, SHARE, of_range).concat()
}

/// The tetrahedra around each of so many vertices, in increasing order.
fn stars(points: usize, tets: &[[u32; 4]]) -> Groups {
    Groups::new(points, |add| {
        (0..).zip(tets).for_each(|(t, tet)| tet.iter().for_each(|v| add(*v as usize, t)));
    })
}

/// Reused buffers for the links of vertices.
#[derive(Default)]
struct LinkScratch {
    /// Which tetrahedra of the star have been reached.
    reached: Vec<bool>,
    /// Those whose neighbours are still to be looked at.
    next: Vec<usize>,
    /// The link's vertices, some of them several times.
    vertices: Vec<u32>,
}

impl LinkScratch {
    /// Whether the link of `v` is one surface without pinches, and a sphere or a disc by its Euler number.
    ///
    /// A connected surface has an Euler number of at most 2, at most 1 with a rim, and only the sphere and the disc reach it. A pinch
    /// makes one vertex of several, and the number smaller: so it is reached without pinches only.
    fn link_is_sphere_or_disc(
        &mut self,
        v: u32,
        star: &[u32],
        tets: &[[u32; 4]],
        neighbors: &[[u32; 4]],
    ) -> bool {
        let Self { reached, next, vertices } = self;
        reached.clear();
        reached.resize(star.len(), false);
        next.clear();
        vertices.clear();
        // Link edges are the faces at `v`; every inner one is seen from both of its sides.
        let (mut inner_sides, mut boundary, mut left) = (0, 0, star.len() - 1);
        reached[0] = true;
        next.push(0);
        vertices.extend(tets[star[0] as usize].into_iter().filter(|&w| w != v));
        while let Some(local) = next.pop() {
            let t = star[local];
            let (tet, around) = (tets[t as usize], neighbors[t as usize]);
            for face in (0..4).filter(|&i| tet[i] != v) {
                let Ok(other) = star.binary_search(&around[face]) else {
                    boundary += 1;
                    continue;
                };
                inner_sides += 1;
                if !std::mem::replace(&mut reached[other], true) {
                    left -= 1;
                    next.push(other);
                    // The others of its vertices are those of the face.
                    vertices.extend(tets[star[other] as usize].into_iter().filter(|w| !tet.contains(w)));
                }
            }
        }
        if left > 0 {
            return false;
        }
        vertices.sort_unstable();
        vertices.dedup();
        let euler = (vertices.len() + star.len()) as i64 - (inner_sides / 2 + boundary) as i64;
        euler == if boundary == 0 { 2 } else { 1 }
    }
}

/// Disjoint groups of small numbers.
#[derive(Default)]
#[doc(hidden)]
pub struct DisjointSets {
    parents: Vec<u32>,
    count: usize,
}

impl DisjointSets {
    /// So many groups of one number each.
    pub fn of(len: usize) -> Self {
        let mut sets = Self::default();
        sets.reset(len);
        sets
    }

    /// How many groups there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// So many groups of one number each.
    pub fn reset(&mut self, len: usize) {
        self.parents.clear();
        self.parents.extend(0..len as u32);
        self.count = len;
    }

    /// The smallest number of the group of `i`.
    pub fn root(&mut self, mut i: usize) -> usize {
        while self.parents[i] as usize != i {
            self.parents[i] = self.parents[self.parents[i] as usize];
            i = self.parents[i] as usize;
        }
        i
    }

    /// Makes one group of those of `a` and `b`.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b {
            self.parents[a.max(b)] = a.min(b) as u32;
            self.count -= 1;
        }
    }
}

/// The parts that hang together by faces: groups of tetrahedra.
pub(crate) fn components(neighbors: &[[u32; 4]]) -> DisjointSets {
    let mut groups = DisjointSets::of(neighbors.len());
    for (t, sides) in neighbors.iter().enumerate() {
        for &n in sides.iter().filter(|&&n| n != NONE) {
            groups.join(t, n as usize);
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::kuhn_tets;

    fn marked(points: usize, tets: &[[u32; 4]]) -> Vec<usize> {
        let topology = topology(points, tets).unwrap();
        (0..points).filter(|&v| topology.non_manifold[v]).collect()
    }

    #[test]
    fn neighbors_are_mutual_and_share_the_face() {
        let tets = kuhn_tets([4, 3, 3]);
        let neighbors = neighbors(&tets).unwrap();
        let mut boundary = 0;
        for (t, sides) in (0_u32..).zip(&neighbors) {
            for (i, &n) in sides.iter().enumerate() {
                if n == NONE {
                    boundary += 1;
                    continue;
                }
                let back = neighbors[n as usize].iter().position(|&x| x == t).unwrap();
                let (mut a, mut b) = (face_of(tets[t as usize], i), face_of(tets[n as usize], back));
                assert_ne!(is_odd(a), is_odd(b));
                a.sort_unstable();
                b.sort_unstable();
                assert_eq!(a, b);
            }
        }
        assert_eq!(boundary, 2 * 2 * (3 * 2 + 3 * 2 + 2 * 2));
    }

    #[test]
    fn huge_indices_do_not_size_tables() {
        let m = u32::MAX;
        let found = neighbors(&[[0, 1, 2, m], [m, 1, 2, m - 7], [7, m - 1, m - 2, m - 3]]).unwrap();
        assert_eq!(found, [[1, NONE, NONE, NONE], [NONE, NONE, NONE, 0], [NONE; 4]]);
    }

    #[test]
    fn crowded_faces_are_refused_with_their_cells() {
        let error = neighbors(&[[0, 1, 2, 3], [9, 8, 7, 6], [0, 1, 2, 4], [2, 1, 5, 0]]).unwrap_err();
        assert_eq!(
            error,
            MeshError::CrowdedFace { face: [0, 1, 2], tets: [0, 2, 3].map(Into::into).to_vec() }
        );
    }

    #[test]
    fn a_grid_is_a_manifold_everywhere() {
        let tets = kuhn_tets([4, 4, 4]);
        let t = topology(64, &tets).unwrap();
        assert_eq!((t.components, t.boundary_faces, t.non_manifold_count()), (1, 6 * 9 * 2, 0));
    }

    #[test]
    fn tetrahedra_meeting_in_a_vertex_or_an_edge_are_marked_there() {
        assert_eq!(marked(7, &[[0, 1, 2, 3], [0, 4, 5, 6]]), [0]);
        assert_eq!(marked(6, &[[0, 1, 2, 3], [0, 1, 4, 5]]), [0, 1]);
        assert_eq!(marked(5, &[[0, 1, 2, 3], [0, 1, 2, 4]]), [] as [usize; 0]);
    }

    #[test]
    fn a_vertex_with_an_annular_link_is_marked() {
        // Cone over a closed band of triangles: the link of the apex 0 is an annulus.
        let ring = |i: u32| 1 + i % 4;
        let top = |i: u32| 5 + i % 4;
        let tets: Vec<[u32; 4]> = (0..4)
            .flat_map(|i| [[0, ring(i), ring(i + 1), top(i)], [0, ring(i + 1), top(i + 1), top(i)]])
            .collect();
        assert_eq!(marked(9, &tets), [0]);
    }

    #[test]
    fn a_pinched_link_is_marked_though_its_star_hangs_together() {
        // Five tetrahedra around edge 0-1 in two fans that meet again away from the edge.
        let tets = [[0, 1, 2, 3], [0, 2, 3, 4], [0, 3, 4, 5], [0, 4, 5, 6], [0, 1, 5, 6]];
        assert_eq!(marked(7, &tets), [0, 1]);
    }
}
