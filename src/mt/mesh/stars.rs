//! Stars of vertices, and sets of tetrahedra with one tag: they are gathered by marks that one count makes invalid.

use super::current::{CurrentMesh, Labels};
use super::tet::corner_of;
use crate::mesh::NONE;
use crate::mt::{UpdateError, UpdateId, VertexId};

/// The tetrahedra around a vertex; scratch space that is filled by [`CurrentMesh::gather_star`].
#[derive(Clone, Debug)]
pub(crate) struct Star {
    pub len: usize,
    pub tets: [u32; GATHERED],
    /// Which corner of each tetrahedron is the centre of the star.
    pub corner: [u8; GATHERED],
}

impl Default for Star {
    fn default() -> Self {
        Self { len: 0, tets: [0; GATHERED], corner: [0; GATHERED] }
    }
}

/// Why a star was not gathered.
#[derive(Debug)]
pub(crate) enum Gather<T> {
    /// The star has more than [`GATHERED`] tetrahedra, none of which the caller wanted to stop at.
    TooLarge,
    /// The caller's look at a tetrahedron stopped it.
    Stopped(T),
}

/// Largest star that is gathered: the two sides of a collapse have at most [`MAX_STAR`](super::limits::MAX_STAR) tetrahedra together, and at
/// most [`MAX_LINK`](super::limits::MAX_LINK) more lie between them.
pub(crate) const GATHERED: usize = 128;
/// Most vertices that are numbered.
pub(in crate::mt) const LINK_CAPACITY: usize = GATHERED;
/// Faces of [`GATHERED`] tetrahedra.
pub(crate) const BARE: usize = 4 * GATHERED;
pub(in crate::mt) const MARK_BITS: u32 = GATHERED.trailing_zeros();
pub(in crate::mt) const MARK_MASK: u32 = (1 << MARK_BITS) - 1;
pub(in crate::mt) const EPOCHS: u32 = 1 << (32 - MARK_BITS);

impl CurrentMesh {
    /// Collects the tetrahedra around the vertex in `slot` and marks them; `look` sees each and may stop it.
    #[inline]
    pub(crate) fn gather_star<T>(
        &mut self,
        slot: u32,
        star: &mut Star,
        mut look: impl FnMut(&[Labels], &[u32; 4]) -> Option<T>,
    ) -> Result<(), Gather<T>> {
        self.next_epoch();
        let first = self.incident[slot as usize];
        star.len = 1;
        star.tets[0] = first;
        self.marks[first as usize] = self.epoch << MARK_BITS;
        let mut next = 0;
        while next < star.len {
            let t = star.tets[next] as usize;
            let tet = self.tets[t];
            if let Some(found) = look(&self.labels, &tet) {
                return Err(Gather::Stopped(found));
            }
            let corner = (usize::from(tet[1] == slot))
                | (usize::from(tet[2] == slot) << 1)
                | (usize::from(tet[3] == slot) * 3);
            star.corner[next] = corner as u8;
            next += 1;
            let around = self.neighbors[t];
            for (i, &n) in around.iter().enumerate() {
                if i == corner || n == NONE || self.marks[n as usize] >> MARK_BITS == self.epoch {
                    continue;
                }
                if star.len == GATHERED {
                    // What stops the caller may be among those not looked at yet.
                    let rest = star.tets[next..].iter().chain([&n]);
                    let found = rest.map(|&t| self.tets[t as usize]).find_map(|tet| look(&self.labels, &tet));
                    return Err(found.map_or(Gather::TooLarge, Gather::Stopped));
                }
                self.marks[n as usize] = self.epoch << MARK_BITS | star.len as u32;
                star.tets[star.len] = n;
                star.len += 1;
            }
        }
        Ok(())
    }

    /// The tetrahedra around a vertex of the MT, for update `u`.
    pub(in crate::mt) fn find_star(
        &mut self,
        u: UpdateId,
        vertex: VertexId,
    ) -> Result<Vec<u32>, UpdateError> {
        let update = u.0;
        let slot = self.slot(vertex).ok_or(UpdateError::Vertex { update, vertex: vertex.0 })?;
        let mut star = Star::default();
        self.gather_star(slot, &mut star, |_, _| None::<()>).map_err(|_| UpdateError::Star { update })?;
        Ok(star.tets[..star.len].to_vec())
    }

    /// Touches the tetrahedra around the vertex in `slot`, however many, as far as they hang together through faces.
    pub(in crate::mt) fn touch_star(&mut self, slot: u32) {
        let mut touched = std::mem::take(&mut self.touched);
        self.list_star(slot, &mut touched);
        self.touched = touched;
    }

    /// Lists the tetrahedra around the vertex in `slot`, however many, as far as they hang together through faces.
    pub(in crate::mt) fn list_star(&mut self, slot: u32, star: &mut Vec<u32>) {
        self.next_epoch();
        let first = self.incident[slot as usize];
        self.marks[first as usize] = self.epoch << MARK_BITS;
        let mut next = star.len();
        star.push(first);
        while let Some(&t) = star.get(next) {
            next += 1;
            let (corner, around) = (corner_of(&self.tets[t as usize], slot), self.neighbors[t as usize]);
            for (i, n) in around.into_iter().enumerate() {
                if i != corner && n != NONE && self.marks[n as usize] >> MARK_BITS != self.epoch {
                    self.marks[n as usize] = self.epoch << MARK_BITS;
                    star.push(n);
                }
            }
        }
    }

    /// The number that tetrahedron `t` has got since [`Self::next_epoch`]; if it has none it gets `number`, below
    /// [`GATHERED`].
    #[inline]
    pub(in crate::mt) fn number_tet(&mut self, t: u32, number: u32) -> Option<u32> {
        number_once(&mut self.marks[t as usize], self.epoch, number)
    }

    /// The number that tetrahedron `t` has got since [`Self::next_epoch`], if it has one; [`NONE`] has none.
    #[inline]
    pub(in crate::mt) fn tet_number(&self, t: u32) -> Option<u32> {
        let mark = *self.marks.get(t as usize)?;
        (mark >> MARK_BITS == self.epoch).then_some(mark & MARK_MASK)
    }

    /// The number that the vertex in `slot` has got since [`Self::next_epoch`]; if it has none it gets `number`, below
    /// [`GATHERED`].
    #[inline]
    pub(in crate::mt) fn number_slot(&mut self, slot: u32, number: u32) -> Option<u32> {
        number_once(&mut self.vertex_marks[slot as usize], self.epoch, number)
    }

    /// Forgets all marks and numbers of tetrahedra and vertices.
    pub(in crate::mt) fn next_epoch(&mut self) {
        self.epoch += 1;
        if self.epoch == EPOCHS {
            self.marks.fill(0);
            self.vertex_marks.fill(0);
            self.epoch = 1;
        }
    }

    /// Collects the tetrahedra with this tag that hang together with `first`, which has it, and their faces that none of
    /// them lies behind (tetrahedron, face, what does); starts a numbering of vertices. Returns how many there are of
    /// both; none if there are more than [`GATHERED`] tetrahedra.
    #[inline]
    pub(in crate::mt) fn gather_tagged(
        &mut self,
        first: u32,
        tag: u32,
        tets: &mut [u32; GATHERED],
        bare: &mut [[u32; 3]; BARE],
    ) -> Option<(usize, usize)> {
        self.next_epoch();
        let mark = self.epoch << MARK_BITS;
        self.marks[first as usize] = mark;
        tets[0] = first;
        let (mut next, mut len, mut bare_len) = (0, 1, 0);
        // Which neighbours have the tag is a coin toss for the processor: the entries after the last one are written
        // anyway, and counted if they belong there. Lengths stay below the capacities, so the remainders change nothing.
        while next < len {
            let t = tets[next % GATHERED];
            next += 1;
            for (face, n) in (0..).zip(self.neighbors[t as usize]) {
                bare[bare_len % BARE] = [t, face, n];
                // Also NONE is beyond the array.
                let (Some(&own), Some(old)) = (self.tags.get(n as usize), self.marks.get_mut(n as usize))
                else {
                    bare_len += 1;
                    continue;
                };
                bare_len += usize::from(own != tag);
                let is_new = (own == tag) & (*old != mark);
                if len == GATHERED {
                    if is_new {
                        return None;
                    }
                    continue;
                }
                *old = if is_new { mark } else { *old };
                tets[len % GATHERED] = n;
                len += usize::from(is_new);
            }
        }
        Some((len, bare_len))
    }

    /// The number of a vertex, by index into `list`, where it is put if it has none yet. The list may be full for at most
    /// three vertices before that is noticed.
    #[inline]
    pub(in crate::mt) fn number_vertex(
        &mut self,
        slot: u32,
        list: &mut [u32; LINK_CAPACITY],
        len: &mut usize,
    ) -> u8 {
        let mark = self.epoch << MARK_BITS;
        let old = &mut self.vertex_marks[slot as usize];
        let is_new = *old & !MARK_MASK != mark;
        let own = if is_new { mark | *len as u32 } else { *old };
        *old = own;
        list[*len % LINK_CAPACITY] = slot;
        *len += usize::from(is_new);
        (own & MARK_MASK) as u8
    }

    /// The number of a vertex, if it has one.
    #[inline]
    pub(in crate::mt) fn vertex_number(&self, slot: u32) -> Option<u8> {
        let mark = self.vertex_marks[slot as usize];
        (mark >> MARK_BITS == self.epoch).then_some((mark & MARK_MASK) as u8)
    }

    /// The numbers of a tetrahedron's corners, if all have one.
    #[inline]
    pub(in crate::mt) fn corner_numbers(&self, tet: &[u32; 4]) -> Option<[u8; 4]> {
        let marks = tet.map(|v| self.vertex_marks[v as usize]);
        let epoch = self.epoch << MARK_BITS;
        let differing = marks.iter().fold(0, |bits, mark| bits | (mark ^ epoch));
        (differing <= MARK_MASK).then_some(marks.map(|mark| (mark & MARK_MASK) as u8))
    }

    /// Which face of tetrahedron `t` its neighbour `towards` lies behind.
    #[inline]
    pub(in crate::mt) fn side_towards(&self, t: u32, towards: u32) -> Option<u8> {
        let [a, b, c, d] = self.neighbors[t as usize].map(|n| u8::from(n == towards));
        (a | b | c | d != 0).then_some((b + 2 * c + 3 * d) & 3)
    }
}

/// The number in a mark of this epoch; a mark of another one gets `number`.
#[inline]
fn number_once(own: &mut u32, epoch: u32, number: u32) -> Option<u32> {
    let mark = epoch << MARK_BITS;
    let known = *own & !MARK_MASK == mark;
    // Which it is is a coin toss for the processor: the mark is written anyway.
    *own = if known { *own } else { mark | number };
    known.then_some(*own & MARK_MASK)
}

#[cfg(test)]
pub(in crate::mt) mod tests {
    use super::*;
    use crate::geom::Lattice;
    use crate::mt::{BaseMesh, FieldInfo, MtInfo, MtKind};

    /// `n` tetrahedra around an edge from vertex 0 to vertex 1.
    pub fn wheel(n: u32) -> CurrentMesh {
        let field = FieldInfo {
            name: "f".into(),
            min: 0.0,
            max: 1.0,
            origin: 0.0,
            step: 1.0,
            bits: 1,
            ..FieldInfo::default()
        };
        let info = MtInfo {
            kind: MtKind::Edge,
            lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits: 16 },
            fields: vec![field],
            vertices: 0,
            tetrahedra: 0,
            updates: 0,
            displacement_per_error: 1.0,
            quantization: 0.0,
            bounds: None,
        };
        let middle = 1 << 15;
        let mut positions = vec![[middle, middle, 0], [middle, middle, 100]];
        positions.extend(
            (0..n)
                .map(|i| {
                    let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
                    [angle.cos(), angle.sin()].map(|x| middle + (x * 30_000.0) as i32)
                })
                .map(|[x, y]| [x, y, 0]),
        );
        let tets = (0..n).map(|i| [0, 2 + i, 2 + (i + 1) % n, 1]).collect();
        let base = BaseMesh { values: vec![0; positions.len()], positions, tets };
        CurrentMesh::new(&info, &base).expect("a valid mesh")
    }

    #[test]
    fn a_star_too_large_to_gather_still_tells_what_was_looked_for() {
        let n = 200;
        let mut mesh = wheel(n);
        let start = mesh.incident[0];
        let distance = |t: u32| ((t + n - start) % n).min((start + n - t) % n);
        for rim in 0..n {
            let wanted = |_: &[Labels], tet: &[u32; 4]| tet.contains(&(2 + rim)).then_some(());
            let found = mesh.gather_star(0, &mut Star::default(), wanted);
            // 128 tetrahedra and the one too many are those up to 64 steps from the first.
            if [rim, (rim + n - 1) % n].iter().any(|&t| distance(t) <= 64) {
                assert!(matches!(found, Err(Gather::Stopped(()))), "{rim}");
            } else {
                assert!(matches!(found, Err(Gather::TooLarge)), "{rim}");
            }
        }
        let mut star = Star::default();
        assert!(wheel(128).gather_star(0, &mut star, |_, _| None::<()>).is_ok());
        assert_eq!(star.len, 128);
    }

    #[test]
    fn marks_of_long_ago_are_forgotten_when_the_epochs_start_again() {
        let mut mesh = wheel(20);
        for _ in 0..3 {
            let mut star = Star::default();
            assert!(mesh.gather_star(0, &mut star, |_, _| None::<()>).is_ok());
            assert_eq!((star.len, mesh.epoch), (20, 1));
            mesh.epoch = EPOCHS - 1;
        }
    }
}
