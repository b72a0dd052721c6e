//! From half-edge collapses, fine to coarse, to a half-edge MT.
//!
//! What an update of a half-edge MT stores is known when the collapse is made that is its inverse: a tetrahedron of the star that the
//! collapse takes away is removed by the update whose inverse has made it. So no tetrahedron is recorded, only the collapse that made
//! each of a star, and which of its faces were inside of that collapse's filling.

use crate::change::hole::{Across, Hole};
use crate::change::work_mesh::keep;
use crate::decimate::append::{Appender, Ordered};
use crate::decimate::{Record, Removed};
use crate::lattice::quantize;
use crate::lattice::quantize::Quantized;
use crate::order::base::{Numbered, number_base};
use crate::order::block_order;
use crate::{BuildError, BuildProgress, BuildSummary, OnProgress};
use std::cmp::Reverse;
use std::mem;
use tetralod::geom::Groups;
use tetralod::mesh::NONE;
use tetralod::mt::{ErrorCode, HalfEdgeMt, MtInfo, Regions, VertexId};

/// Half-edge collapses in the order in which they are made. Vertices are numbers of reference points.
#[derive(Default)]
pub(crate) struct Collapses {
    fields: usize,
    /// Collapses that have been made elsewhere before: numbers of makers begin with these, which have errors and nothing else here.
    earlier: u32,
    /// For each field the least error that is stored.
    floors: Vec<f64>,
    /// The vertex that each removes.
    vertices: Vec<u32>,
    /// A vertex that all tetrahedra have which fill the hole: it may count as moved to it.
    near: Vec<u32>,
    /// Further such vertices with as many tetrahedra around them: the collapse and the vertex.
    also_near: Vec<(u32, u32)>,
    /// Collapse by collapse and field by field. They are at least those of all collapses before on which it depends, by so much more
    /// that selection by isovalue and by box is monotone: see [`Quantized::overshoot`], and `step_of_boundary` in the builders' costs.
    errors: Vec<ErrorCode>,
    /// The box around the star of each vertex: its lowest and its highest corner. After collapses elsewhere that around all that the
    /// collapse depends on.
    boxes: Vec<[[i32; 3]; 2]>,
    /// Where the tetrahedra of each star begin in `makers`; one more than there are collapses.
    starts: Vec<usize>,
    /// The collapse that made each tetrahedron of a star, [`NONE`] for those of the reference mesh. Those of a star come in the
    /// order of their faces opposite the vertex, sorted.
    makers: Vec<u32>,
    /// Which of its faces were inside of what that collapse made: bit `i` is that of the face opposite the `i`-th vertex in ascending
    /// order.
    inner: Vec<u8>,
    /// The inner faces of the tetrahedra of the mesh.
    inner_now: Vec<u8>,
    /// What is left.
    base: Vec<[u32; 4]>,
    base_marks: Vec<(u32, u8)>,
}

/// A star has about so many tetrahedra, or a few less.
const USUAL_STAR: usize = 25;

impl Record for Collapses {
    fn start(&mut self, info: &MtInfo, tets: usize) {
        *self = Self::resume(info, Vec::new(), vec![0; tets]);
    }

    fn len(&self) -> usize {
        self.vertices.len()
    }

    fn add(&mut self, removed: &Removed<'_>, quantized: &Quantized) {
        let Removed { hole, regions, makers, errors, step, .. } = *removed;
        let first = self.makers.len();
        for &i in &hole.sorted {
            let t = hole.star[usize::from(i)].tet as usize;
            self.makers.push(makers[t]);
            self.inner.push(self.inner_now[t]);
        }
        self.starts.push(self.makers.len());
        self.add_errors((hole, regions), first, (errors, step), quantized);
        self.boxes.push(match self.earlier {
            0 => bounds(hole, &quantized.positions),
            // What it depends on may have been made elsewhere.
            _ => removed.reach.ends(),
        });
        self.vertices.push(hole.a);
        self.add_near(removed);
        self.mark_filling(removed);
    }

    fn renumber(&mut self, live: &[u32]) {
        keep(&mut self.inner_now, live);
    }

    fn finish(&mut self, tets: &[[u32; 4]], makers: &[u32]) {
        let live = || (0..tets.len()).filter(|&t| tets[t][0] != NONE);
        self.base = live().map(|t| tets[t]).collect();
        self.base_marks = live().map(|t| (makers[t], self.inner_now[t])).collect();
        self.inner_now = Vec::new();
    }
}

/// The box around the star of a vertex.
fn bounds(hole: &Hole, positions: &[[i32; 3]]) -> [[i32; 3]; 2] {
    let all = hole.link.iter().chain([&hole.a]).map(|&v| positions[v as usize]);
    all.fold([[i32::MAX; 3], [i32::MIN; 3]], |[low, high], p| {
        [[0, 1, 2].map(|k| low[k].min(p[k])), [0, 1, 2].map(|k| high[k].max(p[k]))]
    })
}

/// A collapse as an update needs it.
pub(crate) struct Collapse<'a> {
    pub vertex: u32,
    pub errors: &'a [ErrorCode],
    /// See [`Collapses::makers`] and [`Collapses::inner`].
    pub star: (&'a [u32], &'a [u8]),
}

impl Collapses {
    /// Begins after collapses that were made elsewhere and have these errors, for a mesh whose tetrahedra have these inner faces.
    pub fn resume(info: &MtInfo, earlier: Vec<ErrorCode>, inner: Vec<u8>) -> Self {
        // Lists that grow by doubling would take twice as much. What is never written takes no memory.
        let (most, fields) = (info.vertices as usize, info.fields.len());
        let stars = most * USUAL_STAR;
        let mut starts = Vec::with_capacity(most + 1);
        starts.push(0);
        let mut errors = earlier;
        let earlier = (errors.len() / fields.max(1)) as u32;
        errors.reserve_exact(most * fields);
        Self {
            fields,
            earlier,
            floors: quantize::floors(info),
            vertices: Vec::with_capacity(most),
            near: Vec::with_capacity(most),
            errors,
            boxes: Vec::with_capacity(most),
            starts,
            makers: Vec::with_capacity(stars),
            inner: Vec::with_capacity(stars),
            inner_now: inner,
            ..Self::default()
        }
    }

    /// A collapse of this record.
    pub fn get(&self, collapse: u32) -> Collapse<'_> {
        let star = self.starts[collapse as usize]..self.starts[collapse as usize + 1];
        Collapse {
            vertex: self.vertices[collapse as usize],
            errors: self.errors_of(collapse),
            star: (&self.makers[star.clone()], &self.inner[star]),
        }
    }

    /// The tetrahedra that are left.
    pub fn tets_left(&self) -> &[[u32; 4]] {
        &self.base
    }

    /// The errors of what made a tetrahedron, here or elsewhere.
    pub fn errors_of_maker(&self, maker: u32) -> &[ErrorCode] {
        &self.errors[maker as usize * self.fields..][..self.fields]
    }

    /// The near vertex of a collapse.
    pub fn near(&self, collapse: u32) -> u32 {
        self.near[collapse as usize]
    }

    /// For each tetrahedron that is left, in their order, what made it and which of its faces were inside.
    pub fn marks_left(&self) -> &[(u32, u8)] {
        &self.base_marks
    }

    fn errors_of(&self, collapse: u32) -> &[ErrorCode] {
        self.errors_of_maker(self.earlier + collapse)
    }

    /// Adds the errors of a collapse whose star is recorded from `first` on.
    fn add_errors(
        &mut self,
        (hole, regions): (&Hole, &[u32]),
        first: usize,
        (errors, step): (&[ErrorCode], f64),
        quantized: &Quantized,
    ) {
        for (f, error) in errors.iter().enumerate() {
            // Never zero: error 0 is to mean the reference mesh, with every update applied. Rounded before others are derived from
            // it, an error keeps its distance to these.
            let own = error.max(&ErrorCode::at_least(self.floors[f])).max(&ErrorCode(1)).coarse();
            let of = |&maker: &u32| self.errors[maker as usize * self.fields + f];
            let made = self.makers[first..].iter().filter(|&&maker| maker != NONE);
            let least = made.map(of).max().map_or(own, |largest| {
                let more = hole.overshoot(quantized, regions, f).max(step);
                ErrorCode::at_least(largest.error() + more).coarse()
            });
            self.errors.push(own.max(least));
        }
    }

    /// Finds the vertices that all tetrahedra have which fill the hole. With several, any will do: the one with the most tetrahedra
    /// around it keeps them.
    fn add_near(&mut self, removed: &Removed<'_>) {
        let Removed { hole, filling, end, only_end, .. } = *removed;
        if only_end {
            self.near.push(end);
            return;
        }
        let moves = |(tet, across): (&[u32; 4], &[Across; 4]), v: u32| {
            let at = tet.iter().position(|&corner| corner == v);
            at.is_some_and(|i| matches!(across[i], Across::Face(_)))
        };
        let cells = || filling.tets.iter().zip(&filling.across);
        let shared = |v: &&u32| **v == end || cells().all(|cell| moves(cell, **v));
        let around = |v: &u32| hole.faces.iter().filter(|(face, _)| face.contains(v)).count();
        let first = filling.tets.first().copied().unwrap_or([end; 4]);
        let found: Vec<(usize, u32)> = first.iter().filter(shared).map(|v| (around(v), *v)).collect();
        let most = found.iter().map(|(around, _)| *around).max();
        let mut best = found.iter().filter(|(around, _)| Some(*around) == most).map(|(_, v)| *v);
        let collapse = self.near.len() as u32;
        self.near.push(best.next().unwrap_or(end));
        self.also_near.extend(best.map(|v| (collapse, v)));
    }

    /// Notes which faces of the filling are inside: those that are no face of the hole. Those opposite a near vertex all are.
    fn mark_filling(&mut self, removed: &Removed<'_>) {
        let Removed { slots, filling, .. } = *removed;
        for ((&t, tet), across) in slots.iter().zip(&filling.tets).zip(&filling.across) {
            let rank = |v: u32| tet.iter().filter(|&&other| other < v).count();
            let inside = (0..4).filter(|&i| !matches!(across[i], Across::Face(_)));
            self.inner_now[t as usize] = inside.fold(0, |bits, i| bits | 1 << rank(tet[i]));
        }
    }

    /// The half-edge MT whose updates undo these collapses, in blocks of `2^block_bits` by what they reach, and its vertex for each
    /// reference point.
    pub fn half_edge_mt(
        mut self,
        mut info: MtInfo,
        regions: Option<Regions>,
        quantized: &Quantized,
        block_bits: u32,
        progress: OnProgress<'_>,
    ) -> Result<(HalfEdgeMt, Vec<VertexId>, BuildSummary), BuildError> {
        info.updates = self.vertices.len() as u32;
        let numbered = number_base(&quantized.positions, &quantized.levels, self.fields, &self.base);
        let base = numbered.mesh.positions.len() as u32;
        let (order, depth) = self.order((base, |v| numbered.number[v as usize]), block_bits, None);
        let summary = BuildSummary::of(&info, &numbered.mesh, depth);
        let (mt, vertices) =
            self.append_all((info, regions), numbered, &order, (quantized, block_bits), progress)?;
        Ok((mt, vertices, summary))
    }

    /// The collapses in the order of their updates, and the length of the longest chain of updates that depend on each other. `number`
    /// gives the numbers, below `base`, of those vertices that are left; `domain` the sides of the whole if this is a part of it. What only
    /// the order needs is freed: it is asked for once.
    pub fn order(
        &mut self,
        (base, number): (u32, impl Fn(u32) -> u32),
        block_bits: u32,
        domain: Option<[i32; 3]>,
    ) -> (Vec<u32>, u32) {
        let count = self.vertices.len();
        // Errors are monotone, so this extends the partial order.
        let mut falling: Vec<u32> = (0..count as u32).rev().collect();
        falling.sort_by_key(|&c| Reverse(self.errors_of(c).iter().max()));
        let mut places = vec![0; count];
        (0..).zip(&falling).for_each(|(place, &c)| places[c as usize] = place);
        let parents = self.parents(&falling, &places);
        let mut removed_by = vec![NONE; self.vertices.iter().max().map_or(0, |&v| v as usize + 1)];
        (0..).zip(&self.vertices).for_each(|(c, &v): (u32, _)| removed_by[v as usize] = c);
        let label = |v: u32| match removed_by.get(v as usize) {
            None | Some(&NONE) => number(v),
            Some(&remover) => base + places[remover as usize],
        };
        for (c, v) in mem::take(&mut self.also_near) {
            let near = &mut self.near[c as usize];
            if label(v) > label(*near) {
                *near = v;
            }
        }
        let near: Vec<u32> = falling.iter().map(|&c| label(self.near[c as usize])).collect();
        let boxes: Vec<[[i32; 3]; 2]> = falling.iter().map(|&c| self.boxes[c as usize]).collect();
        self.boxes = Vec::new();
        let largest = |&c: &u32| self.errors_of(c).iter().copied().fold(ErrorCode::ZERO, ErrorCode::max);
        let errors: Vec<ErrorCode> = falling.iter().map(largest).collect();
        let mut depths: Vec<u32> = Vec::with_capacity(count);
        for u in 0..count {
            let above = parents.of(u).iter().map(|&p| depths[p as usize]).max();
            depths.push(above.unwrap_or(0) + 1);
        }
        let depth = depths.into_iter().max().unwrap_or(0);
        let updates = block_order::Updates {
            base,
            near: &near,
            parents: &parents,
            boxes: &boxes,
            errors: &errors,
            domain,
        };
        let order = updates.order(block_bits).into_iter().map(|u| falling[u as usize]).collect();
        (order, depth)
    }

    /// The parents of each update, ascending, where the collapses are numbered anew: `falling` has them in the order of their `places`.
    fn parents(&self, falling: &[u32], places: &[u32]) -> Groups {
        Groups::new(falling.len(), |add| {
            let mut distinct: Vec<u32> = Vec::new();
            for (parent, &c) in (0..).zip(falling) {
                distinct.clear();
                let makers = self.get(c).star.0.iter().filter(|&&maker| maker != NONE);
                distinct.extend(makers.filter_map(|maker| maker.checked_sub(self.earlier)));
                distinct.sort_unstable();
                distinct.dedup();
                distinct.iter().for_each(|&child| add(places[child as usize] as usize, parent));
            }
        })
    }

    /// The MT whose updates undo the collapses in this order.
    fn append_all(
        &self,
        (info, regions): (MtInfo, Option<Regions>),
        numbered: Numbered,
        order: &[u32],
        (quantized, block_bits): (&Quantized, u32),
        progress: OnProgress<'_>,
    ) -> Result<(HalfEdgeMt, Vec<VertexId>), BuildError> {
        let mut update_of = vec![0; order.len()];
        (0..).zip(order).for_each(|(u, &c): (u32, _)| update_of[c as usize] = u);
        let mark = |(maker, inner): (u32, u8)| match maker {
            NONE => (NONE, inner),
            maker => (update_of[maker as usize], inner),
        };
        let [vertices, near] = [&self.vertices, &self.near]
            .map(|all| order.iter().map(|&c| all[c as usize]).collect::<Vec<u32>>());
        let base_marks: Vec<(u32, u8)> = self.base_marks.iter().copied().map(mark).collect();
        let updates = Ordered { vertices: &vertices, near: &near, base_marks: &base_marks };
        let reference = (&quantized.positions[..], &quantized.levels[..], &quantized.sides);
        let mut appender = Appender::new((info, regions), numbered, &updates, reference, block_bits)?;
        for (u, &c) in order.iter().enumerate() {
            BuildProgress::tell_ordered(u, order.len(), progress)?;
            let Collapse { vertex, errors, star: (makers, inner), .. } = self.get(c);
            appender.push(
                vertex,
                errors,
                makers.iter().zip(inner).map(|(&maker, &inner)| mark((maker, inner))),
            )?;
        }
        appender.finish()
    }
}
