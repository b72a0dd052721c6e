//! From half-edge collapses, fine to coarse, to a half-edge MT.
//!
//! What an update of a half-edge MT stores is known when the collapse is made that is its inverse: a tetrahedron of the star that the
//! collapse takes away is removed by the update whose inverse has made it. So no tetrahedron is recorded, only the collapse that made
//! each of a star, and which of its faces were inside of that collapse's filling.

use super::base::{Numbered, number_base};
use super::block_order;
use super::decimate::{Record, Removed};
use super::hole::{Hole, sorted};
use super::quantize::Quantized;
use super::{BuildError, BuildProgress, BuildSummary, OnProgress, quantize};
use crate::mesh::NONE;
use crate::mt::{
    BaseMark, ConvertError, ErrorCode, ForestChild, HalfEdgeBuilder, HalfEdgeMt, MtInfo, NextUpdate, Remover,
    ReplayError, UpdateError, VertexId,
};
use std::cmp::Reverse;

/// Half-edge collapses in the order in which they are made. Vertices are numbers of reference points.
#[derive(Default)]
pub(super) struct Collapses {
    fields: usize,
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
    /// The box around the star of each vertex: its lowest and its highest corner.
    boxes: Vec<[[i32; 3]; 2]>,
    /// Where the tetrahedra of each star begin in `makers`; one more than there are collapses.
    starts: Vec<usize>,
    /// The collapse that made each tetrahedron of a star, [`NONE`] for those of the reference mesh. Those of a star come in the
    /// order of their faces opposite the vertex, sorted.
    makers: Vec<u32>,
    /// Which of its faces were inside of what that collapse made: bit `i` is that of the face opposite the `i`-th vertex in ascending
    /// order.
    inner: Vec<u8>,
    /// The same for the tetrahedra of the mesh.
    inner_now: Vec<u8>,
    /// What is left.
    base: Vec<[u32; 4]>,
    base_marks: Vec<(u32, u8)>,
    /// Scratch space: the faces of a hole, each with its place there.
    faces: Vec<([u32; 3], u32)>,
}

/// A star has about so many tetrahedra, or a few less.
const USUAL_STAR: usize = 25;

impl Record for Collapses {
    fn start(&mut self, info: &MtInfo, tets: usize) {
        // Lists that grow by doubling would take twice as much. What is never written takes no memory.
        let (most, fields) = (info.vertices as usize, info.fields.len());
        let stars = most * USUAL_STAR;
        let mut starts = Vec::with_capacity(most + 1);
        starts.push(0);
        *self = Self {
            fields,
            floors: quantize::floors(info),
            vertices: Vec::with_capacity(most),
            near: Vec::with_capacity(most),
            errors: Vec::with_capacity(most * fields),
            boxes: Vec::with_capacity(most),
            starts,
            makers: Vec::with_capacity(stars),
            inner: Vec::with_capacity(stars),
            inner_now: vec![0; tets],
            ..Self::default()
        };
    }

    fn len(&self) -> usize {
        self.vertices.len()
    }

    fn add(&mut self, removed: &Removed<'_>, quantized: &Quantized) {
        let Removed { hole, makers, errors, step, .. } = *removed;
        self.faces.clear();
        self.faces.extend((0..).zip(&hole.faces).map(|(i, &(face, _))| (sorted(face), i)));
        self.faces.sort_unstable();
        let first = self.makers.len();
        for &(_, i) in &self.faces {
            let t = hole.star[i as usize].tet as usize;
            self.makers.push(makers[t]);
            self.inner.push(self.inner_now[t]);
        }
        self.starts.push(self.makers.len());
        self.add_errors(hole, first, (errors, step), quantized);
        self.boxes.push(bounds(hole, &quantized.positions));
        self.vertices.push(hole.a);
        self.add_near(removed);
        self.mark_filling(removed);
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

/// Three of four vertices in increasing order: all but the `i`-th.
fn without(tet: [u32; 4], i: usize) -> [u32; 3] {
    [0, 1, 2].map(|k| tet[if k < i { k } else { k + 1 }])
}

impl Collapses {
    fn errors_of(&self, collapse: u32) -> &[ErrorCode] {
        &self.errors[collapse as usize * self.fields..][..self.fields]
    }

    /// The collapses that made the star of another one: the updates that depend on its inverse.
    fn makers_of(&self, collapse: u32) -> &[u32] {
        &self.makers[self.starts[collapse as usize]..self.starts[collapse as usize + 1]]
    }

    /// Adds the errors of a collapse whose star is recorded from `first` on.
    fn add_errors(
        &mut self,
        hole: &Hole,
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
                let more = quantized.overshoot(hole.a, &hole.link, f).max(step);
                ErrorCode::at_least(largest.error() + more).coarse()
            });
            self.errors.push(own.max(least));
        }
    }

    /// Finds the vertices that all tetrahedra have which fill the hole. With several, any will do: the one with the most tetrahedra
    /// around it keeps them.
    fn add_near(&mut self, removed: &Removed<'_>) {
        let Removed { hole, filling, end, .. } = *removed;
        let moves = |tet: &[u32; 4], v: u32| {
            let at = tet.iter().position(|&corner| corner == v);
            at.is_some_and(|i| self.is_face(&sorted(without(*tet, i))))
        };
        let shared = |v: &&u32| **v == end || filling.tets.iter().all(|tet| moves(tet, **v));
        let around = |v: &u32| hole.faces.iter().filter(|(face, _)| face.contains(v)).count();
        let first = filling.tets.first().copied().unwrap_or([end; 4]);
        let found: Vec<(usize, u32)> = first.iter().filter(shared).map(|v| (around(v), *v)).collect();
        let most = found.iter().map(|(around, _)| *around).max();
        let mut best = found.iter().filter(|(around, _)| Some(*around) == most).map(|(_, v)| *v);
        let collapse = self.near.len() as u32;
        self.near.push(best.next().unwrap_or(end));
        self.also_near.extend(best.map(|v| (collapse, v)));
    }

    /// Whether three vertices in increasing order are a face of the hole.
    fn is_face(&self, face: &[u32; 3]) -> bool {
        self.faces.binary_search_by(|(other, _)| other.cmp(face)).is_ok()
    }

    /// Notes which faces of the filling are inside: those that are no face of the hole. Those opposite a near vertex all are.
    fn mark_filling(&mut self, removed: &Removed<'_>) {
        for (&t, &tet) in removed.slots.iter().zip(&removed.filling.tets) {
            let mut tet = tet;
            tet.sort_unstable();
            let inside = |&i: &usize| !self.is_face(&without(tet, i));
            self.inner_now[t as usize] = (0..4).filter(inside).fold(0, |bits, i| bits | 1 << i);
        }
    }

    /// The half-edge MT whose updates undo these collapses, in blocks of `2^block_bits` by what they reach, and its vertex for each
    /// reference point.
    pub fn half_edge_mt(
        mut self,
        mut info: MtInfo,
        quantized: &Quantized,
        block_bits: u32,
        progress: OnProgress<'_>,
    ) -> Result<(HalfEdgeMt, Vec<VertexId>, BuildSummary), BuildError> {
        info.updates = self.vertices.len() as u32;
        let numbered = number_base(&quantized.positions, &quantized.levels, self.fields, &self.base);
        let (order, depth) = self.order(&numbered, block_bits);
        let summary = BuildSummary {
            vertices: info.vertices,
            tetrahedra: info.tetrahedra,
            base_vertices: numbered.mesh.positions.len() as u32,
            base_tetrahedra: numbered.mesh.tets.len() as u32,
            updates: info.updates,
            position_bits: info.lattice.bits,
            depth,
        };
        let (mt, vertices) = self.append_all(info, numbered, &order, (quantized, block_bits), progress)?;
        Ok((mt, vertices, summary))
    }

    /// The collapses in the order of their updates, and the length of the longest chain of updates that depend on each other.
    fn order(&mut self, numbered: &Numbered, block_bits: u32) -> (Vec<u32>, u32) {
        let count = self.vertices.len();
        // Errors are monotone, so this extends the partial order.
        let mut falling: Vec<u32> = (0..count as u32).rev().collect();
        falling.sort_by_key(|&c| Reverse(self.errors_of(c).iter().max()));
        let mut places = vec![0; count];
        (0..).zip(&falling).for_each(|(place, &c)| places[c as usize] = place);
        let (starts, parents) = self.parents(&falling, &places);
        let base = numbered.mesh.positions.len() as u32;
        let mut removed_by = vec![NONE; numbered.number.len()];
        (0..).zip(&self.vertices).for_each(|(c, &v): (u32, _)| removed_by[v as usize] = c);
        let label = |v: u32| match removed_by[v as usize] {
            NONE => numbered.number[v as usize],
            remover => base + places[remover as usize],
        };
        for &(c, v) in &self.also_near {
            let near = &mut self.near[c as usize];
            if label(v) > label(*near) {
                *near = v;
            }
        }
        let near: Vec<u32> = falling.iter().map(|&c| label(self.near[c as usize])).collect();
        let boxes: Vec<[[i32; 3]; 2]> = falling.iter().map(|&c| self.boxes[c as usize]).collect();
        let largest = |&c: &u32| self.errors_of(c).iter().copied().fold(ErrorCode::ZERO, ErrorCode::max);
        let errors: Vec<ErrorCode> = falling.iter().map(largest).collect();
        let mut depths: Vec<u32> = Vec::with_capacity(count);
        for rows in starts.windows(2) {
            let above = parents[rows[0] as usize..rows[1] as usize].iter().map(|&p| depths[p as usize]).max();
            depths.push(above.unwrap_or(0) + 1);
        }
        let depth = depths.into_iter().max().unwrap_or(0);
        let updates = block_order::Updates {
            base,
            near: &near,
            starts: &starts,
            parents: &parents,
            boxes: &boxes,
            errors: &errors,
        };
        let order = updates.order(block_bits).into_iter().map(|u| falling[u as usize]).collect();
        (order, depth)
    }

    /// The parents of each update, ascending, where the collapses are numbered anew: `falling` has them in the order of their `places`.
    fn parents(&self, falling: &[u32], places: &[u32]) -> (Vec<u32>, Vec<u32>) {
        let mut distinct: Vec<u32> = Vec::new();
        let mut each = |see: &mut dyn FnMut(u32, u32)| {
            for (parent, &c) in (0..).zip(falling) {
                distinct.clear();
                distinct.extend(self.makers_of(c).iter().filter(|&&maker| maker != NONE));
                distinct.sort_unstable();
                distinct.dedup();
                distinct.iter().for_each(|&child| see(parent, places[child as usize]));
            }
        };
        let mut starts = vec![0_u32; falling.len() + 1];
        each(&mut |_, child| starts[child as usize + 1] += 1);
        (0..falling.len()).for_each(|u| starts[u + 1] += starts[u]);
        let mut next = starts.clone();
        let mut parents = vec![0; starts.last().map_or(0, |&all| all as usize)];
        each(&mut |parent, child| {
            let place = &mut next[child as usize];
            parents[*place as usize] = parent;
            *place += 1;
        });
        (starts, parents)
    }

    /// The MT whose updates undo the collapses in this order.
    fn append_all(
        &self,
        info: MtInfo,
        numbered: Numbered,
        order: &[u32],
        (quantized, block_bits): (&Quantized, u32),
        progress: OnProgress<'_>,
    ) -> Result<(HalfEdgeMt, Vec<VertexId>), BuildError> {
        let Numbered { mesh, mut number, places } = numbered;
        let base = mesh.positions.len();
        let mut update_of = vec![0; order.len()];
        for (u, &c) in (0..).zip(order) {
            update_of[c as usize] = u;
            number[self.vertices[c as usize] as usize] = base as u32 + u;
        }
        let mut points = vec![NONE; base + order.len()];
        let known = (0..).zip(&number).filter(|(_, v)| **v != NONE);
        known.for_each(|(point, &v): (u32, _)| points[v as usize] = point);
        let remover = |(maker, inner): (u32, u8)| -> Remover {
            (if maker == NONE { NONE } else { update_of[maker as usize] }, inner)
        };
        let mut marks = Vec::with_capacity(mesh.tets.len());
        for (tet, &place) in mesh.tets.iter().zip(&places) {
            let (remover, inner) = remover(self.base_marks[place as usize]);
            marks.push(BaseMark { remover, inner: by_corner(inner, tet.map(|v| points[v as usize])) });
        }
        let (starts, children) = self.forest(order, &number, &quantized.positions);
        let children_of = |v: usize| &children[starts[v] as usize..starts[v + 1] as usize];
        let of_base: Vec<Vec<ForestChild>> = (0..base).map(|v| children_of(v).to_vec()).collect();
        let sound = |error: UpdateError| ConvertError::from(ReplayError::Update(error));
        let mt = HalfEdgeMt::new(info, mesh, marks, &of_base, block_bits).map_err(sound)?;
        let mut builder = HalfEdgeBuilder::new(mt)?;
        let mut faces: Vec<([u32; 3], usize)> = Vec::new();
        for (u, &c) in order.iter().enumerate() {
            if u % 4096 == 0 {
                let (done, total) = (u as u64, order.len() as u64);
                if progress(BuildProgress { stage: "order", done, total, tetrahedra: None }).is_break() {
                    return Err(BuildError::Stopped);
                }
            }
            let vertex = self.vertices[c as usize];
            let levels = &quantized.levels[vertex as usize * self.fields..][..self.fields];
            let next = NextUpdate { children: children_of(base + u), levels, errors: self.errors_of(c) };
            let star = self.starts[c as usize]..self.starts[c as usize + 1];
            builder.push(&next, |tets, removers| {
                faces.clear();
                for (i, tet) in tets.iter().enumerate() {
                    let corners = tet.map(|v| points[v as usize]);
                    let at = corners.iter().position(|&v| v == vertex)?;
                    faces.push((sorted(without(corners, at)), i));
                }
                faces.sort_unstable();
                removers.resize(tets.len(), (NONE, 0));
                for (&(_, i), at) in faces.iter().zip(star.clone()) {
                    let (remover, inner) = remover((self.makers[at], self.inner[at]));
                    removers[i] = (remover, by_corner(inner, tets[i].map(|v| points[v as usize])));
                }
                (tets.len() == star.len()).then_some(())
            })?;
        }
        Ok((builder.finish(), number.into_iter().map(VertexId).collect()))
    }

    /// The updates by near vertex, each with where it inserts its own: where those of each vertex begin, and all.
    fn forest(&self, order: &[u32], number: &[u32], positions: &[[i32; 3]]) -> (Vec<u32>, Vec<ForestChild>) {
        let near = |c: u32| self.near[c as usize];
        let mut starts = vec![0_u32; number.len() + 1];
        order.iter().for_each(|&c| starts[number[near(c) as usize] as usize + 1] += 1);
        (0..number.len()).for_each(|v| starts[v + 1] += starts[v]);
        let mut next = starts.clone();
        let mut children = vec![ForestChild::default(); order.len()];
        for (update, &c) in (0..).zip(order) {
            let [from, to] = [near(c), self.vertices[c as usize]].map(|v| positions[v as usize]);
            let place = &mut next[number[near(c) as usize] as usize];
            children[*place as usize] = ForestChild { update, offset: [0, 1, 2].map(|k| to[k] - from[k]) };
            *place += 1;
        }
        (starts, children)
    }
}

/// Bits of the vertices of a tetrahedron in ascending order, by its corners.
fn by_corner(bits: u8, tet: [u32; 4]) -> u8 {
    let rank = |v: u32| tet.iter().filter(|&&other| other < v).count();
    (0..4).fold(0, |all, corner| all | (bits >> rank(tet[corner]) & 1) << corner)
}
