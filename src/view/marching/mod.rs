//! Surfaces cut out of a mesh by a function that is linear in every tetrahedron: marching tetrahedra, from scratch or kept
//! up at the cost of what has changed.
//!
//! The owner of a surface gives the [`Polygon`] of each tetrahedron and sets the data of the vertices; [`Pieces`]
//! shares vertices among the polygons and records the tetrahedron of each triangle. Invariants:
//! - Pieces of neighbouring tetrahedra share their vertices: one for each crossed edge or touched point. Every vertex
//!   belongs to a triangle.
//! - From scratch, triangles come in the order of their tetrahedra and vertices in the order in which they are first named.
//! - After a change the triangles are those from scratch; only their order and that of the vertices differ.

mod crossings;
mod links;
mod polygon;

use super::SurfaceChanges;
use crate::mesh::{BLOCK, BitSet, ChangedBlocks, NONE};
pub(super) use crossings::{Crossing, Crossings};
use links::Links;
pub(super) use polygon::Polygon;

/// The triangles of surfaces with the tetrahedron that each is from, and their vertices as crossings.
#[derive(Clone, Debug, Default)]
pub(super) struct Pieces {
    pub crossings: Crossings,
    /// Per triangle twice the number of its tetrahedron, and 1 more if it is the second one of its polygon.
    owners: Vec<u32>,
    /// How many tetrahedra the mesh has.
    tets: usize,
    /// Present from the first edit after an extraction on.
    links: Option<Box<Links>>,
    changed_vertices: ChangedBlocks,
    changed_triangles: ChangedBlocks,
}

/// Vertices, each once.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    pub list: Vec<u32>,
    has: BitSet,
}

impl Vertices {
    pub fn add(&mut self, vertices: impl IntoIterator<Item = u32>) {
        self.list.extend(vertices.into_iter().filter(|v| self.has.insert(*v)));
    }
}

/// What happens to the triangles in one change.
#[derive(Debug, Default)]
struct Edit {
    /// Triangles that are gone.
    holes: Vec<u32>,
    /// Triangles that are new, and their owners.
    new: Vec<([u32; 3], u32)>,
    /// Vertices that were found in a dirty tetrahedron or have lost a triangle.
    vertices: Vertices,
}

/// In place of triangles that are not there.
const NO_TRIANGLE: [u32; 3] = [NONE; 3];

impl Pieces {
    /// Removes all pieces, for a mesh of so many tetrahedra.
    pub fn clear(&mut self, tets: usize) {
        assert!(tets < 1 << 31, "too many tetrahedra");
        self.tets = tets;
        self.links = None;
        self.owners.clear();
        self.crossings.clear();
    }

    /// Number of tetrahedra of the last mesh.
    pub fn tets(&self) -> usize {
        self.tets
    }

    /// Appends the piece of a tetrahedron in surface number `which`, behind those of tetrahedra with smaller numbers.
    #[inline]
    pub fn push(&mut self, triangles: &mut Vec<[u32; 3]>, t: u32, which: u32, polygon: &Polygon) {
        for (triangle, owner) in self.triangles_of(t, which, polygon) {
            triangles.push(triangle);
            self.owners.push(owner);
        }
    }

    /// The triangles of a polygon, and their owners.
    #[inline]
    fn triangles_of(
        &mut self,
        t: u32,
        which: u32,
        polygon: &Polygon,
    ) -> impl Iterator<Item = ([u32; 3], u32)> + use<> {
        let mut v = [NONE; 4];
        for (v, ends) in v.iter_mut().zip(polygon.corners()) {
            *v = self.crossings.vertex(*ends, which);
        }
        let [a, b, c, d] = v;
        let second = if d == NONE { NO_TRIANGLE } else { [a, c, d] };
        [[a, b, c], second]
            .into_iter()
            .zip([t << 1, t << 1 | 1])
            .take_while(|(triangle, _)| triangle[0] != NONE)
    }

    /// The tetrahedron of each triangle.
    pub fn tets_of_triangles(&self) -> impl Iterator<Item = u32> {
        self.owners.iter().map(|owner| owner >> 1)
    }

    /// Marks everything as changed.
    pub fn mark_all(&mut self) {
        self.changed_vertices = ChangedBlocks::all(self.crossings.list.len());
        self.changed_triangles = ChangedBlocks::all(self.owners.len());
    }

    /// The ranges of vertices and of triangles that were written since the last call.
    pub fn take_changes(&mut self) -> SurfaceChanges {
        SurfaceChanges {
            vertices: self.changed_vertices.take(self.crossings.list.len()),
            triangles: self.changed_triangles.take(self.owners.len()),
        }
    }

    /// What was set at a vertex has changed.
    pub fn mark_vertex(&mut self, v: u32) {
        self.changed_vertices.mark(v);
    }

    /// Which sides of each triangle are sides of its polygon, where there is one surface: bit `k` is for the side from corner
    /// `k` to the next.
    pub fn polygon_sides(&self) -> Vec<u8> {
        let mut cut_in_two = BitSet::default();
        for owner in self.owners.iter().filter(|owner| *owner & 1 == 1) {
            cut_in_two.insert(owner >> 1);
        }
        let sides = |owner: &u32| match (owner & 1, cut_in_two.has(owner >> 1)) {
            (1, _) => 0b110,
            (_, true) => 0b011,
            _ => 0b111,
        };
        self.owners.iter().map(sides).collect()
    }

    /// Builds the lists of triangles of each tetrahedron and each vertex.
    pub fn follow(&mut self, triangles: &[[u32; 3]]) {
        let Self { tets, crossings, owners, .. } = self;
        self.links
            .get_or_insert_with(|| Box::new(Links::new(*tets, crossings.list.len(), triangles, owners)));
    }

    /// Cuts the `dirty` tetrahedra again, in `surfaces` surfaces, and removes those from number `tets` on. Returns the
    /// vertices whose position may have changed; some may be new or unused.
    pub fn recut(
        &mut self,
        triangles: &mut Vec<[u32; 3]>,
        tets: usize,
        dirty: &[u32],
        surfaces: u32,
        polygon: impl Fn(u32, u32) -> Polygon,
    ) -> Vertices {
        self.follow(triangles);
        let Some(mut links) = self.links.take() else { return Vertices::default() };
        let (mut edit, mut old) = (Edit::default(), Vec::new());
        for t in tets as u32..links.tet_count() as u32 {
            links.take(t, &mut old);
            edit.take_out(&old, triangles, &mut links);
        }
        self.tets = tets;
        links.resize(tets);
        for &t in dirty {
            links.take(t, &mut old);
            for which in 0..surfaces {
                let polygon = polygon(t, which);
                for (triangle, owner) in self.triangles_of(t, which, &polygon) {
                    edit.vertices.add(triangle);
                    let same = |old: &u32| {
                        (triangles[*old as usize], self.owners[*old as usize]) == (triangle, owner)
                    };
                    match old.iter().position(same) {
                        Some(at) => links.put_back(old.swap_remove(at) as usize, owner),
                        None => edit.new.push((triangle, owner)),
                    }
                }
            }
            edit.take_out(&old, triangles, &mut links);
        }
        self.set_triangles(triangles, &mut links, &mut edit);
        self.links = Some(links);
        edit.vertices
    }

    /// Writes the new triangles into the holes first, and fills what holes are left with the last triangles.
    fn set_triangles(&mut self, triangles: &mut Vec<[u32; 3]>, links: &mut Links, edit: &mut Edit) {
        links.make_room(self.crossings.list.len());
        edit.holes.sort_unstable();
        let filled = edit.holes.len().min(edit.new.len());
        for (i, (triangle, owner)) in edit.new.drain(..).enumerate() {
            let slot = edit.holes.get(i).map_or(triangles.len(), |hole| *hole as usize);
            if slot == triangles.len() {
                triangles.push(triangle);
                self.owners.push(owner);
            } else {
                (triangles[slot], self.owners[slot]) = (triangle, owner);
            }
            links.put(slot, triangles, owner);
            self.changed_triangles.mark(slot as u32);
        }
        for hole in edit.holes.drain(filled..).rev() {
            let last = triangles.len() - 1;
            links.swap_remove(hole, triangles[last], self.owners[last]);
            triangles.swap_remove(hole as usize);
            self.owners.swap_remove(hole as usize);
            self.changed_triangles.mark(hole);
        }
    }

    /// Calls `set` for the used vertices; it returns whether their position has changed. Those from number `old` on are
    /// new.
    pub fn place_again(
        &mut self,
        vertices: &[u32],
        old: usize,
        mut set: impl FnMut(usize, &Crossing) -> bool,
    ) {
        for &v in vertices {
            if self.is_used(v) && (set(v as usize, &self.crossings.list[v as usize]) || v as usize >= old) {
                self.changed_vertices.mark(v);
            }
        }
    }

    /// Whether a tetrahedron has triangles in a surface that was [recut](Self::recut).
    pub fn has_piece(&self, t: u32) -> bool {
        self.triangles_in(t).next().is_some()
    }

    /// Whether a vertex has a triangle.
    pub fn is_used(&self, v: u32) -> bool {
        self.links.as_ref().is_none_or(|links| links.is_used(v))
    }

    /// The triangles at a vertex of a surface that was [recut](Self::recut).
    pub fn fan(&self, v: u32) -> impl Iterator<Item = u32> {
        self.links.iter().flat_map(move |links| links.fan(v))
    }

    /// The triangles at a vertex in the order of an extraction.
    pub fn ordered_fan(&self, v: u32) -> Vec<u32> {
        let key = |triangle: u32| u64::from(self.owners[triangle as usize]) << 32 | u64::from(triangle);
        let mut fan: Vec<u64> = self.fan(v).map(key).collect();
        fan.sort_unstable();
        fan.into_iter().map(|key| key as u32).collect()
    }

    /// The triangles of a tetrahedron, as [`Self::fan`].
    pub fn triangles_in(&self, t: u32) -> impl Iterator<Item = u32> {
        self.links.iter().flat_map(move |links| links.triangles(t))
    }

    /// Takes out those of the vertices that no triangle uses any more, and has `swap_remove` do so with all that belongs to
    /// them.
    pub fn drop_unused(
        &mut self,
        triangles: &mut [[u32; 3]],
        mut vertices: Vec<u32>,
        mut swap_remove: impl FnMut(usize),
    ) {
        let Some(links) = &mut self.links else { return };
        vertices.retain(|v| !links.is_used(*v));
        vertices.sort_unstable();
        for v in vertices.into_iter().rev() {
            self.crossings.swap_remove(v);
            swap_remove(v as usize);
            links.rename_last(v, triangles, |triangle| self.changed_triangles.mark(triangle));
            self.changed_vertices.mark(v);
        }
    }
}

impl Edit {
    /// Takes triangles from their vertices.
    fn take_out(&mut self, gone: &[u32], triangles: &[[u32; 3]], links: &mut Links) {
        for &triangle in gone {
            let vertices = triangles[triangle as usize];
            links.unlink(triangle, vertices);
            self.vertices.add(vertices);
            self.holes.push(triangle);
        }
    }
}

/// Appends the numbers of the tetrahedra for which `has` holds, without a branch that is hard to foresee; the first has number `first`.
/// Free slots have none.
#[inline(always)]
pub(super) fn select(tets: &[[u32; 4]], first: usize, found: &mut Vec<u32>, has: impl Fn(&[u32; 4]) -> bool) {
    for (first, block) in (first as u32..).step_by(BLOCK).zip(tets.chunks(BLOCK)) {
        let mut hits = [0; BLOCK];
        let mut count = 0;
        for (t, tet) in (first..).zip(block) {
            hits[count % BLOCK] = t;
            count += usize::from(tet[0] != NONE && has(tet));
        }
        found.extend_from_slice(&hits[..count]);
    }
}
