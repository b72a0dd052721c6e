//! Updates that are about to be appended to a half-edge MT. First they are applied, one after the other, and their stars are taken down;
//! then the stars are coded, each by itself.

use super::forest::Forest;
use super::new_star::{NEW, NewTet};
use super::places::Places;
use super::refusal::{damaged, refused};
use super::removers::{Remover, set_removers};
use super::scratch::Scratch;
use super::star_code::StarCode;
use super::store::{ForestChild, HalfEdgeMt, HalfEdgeUpdate};
use crate::mt::facts::MtFacts;
use crate::mt::pages::Rows;
use crate::mt::reaches::Reaches;
use crate::mt::{
    Applied, ConvertError, CurrentMesh, ErrorCode, Excess, Margins, MultiTessellation, PagedArray,
    UpdateError, UpdateId, VertexId,
};
use crate::threads;
use std::ops::Range;

/// So many stars are coded at a time: a thread takes no fewer.
const SHARE: usize = 32;

/// The next update.
#[doc(hidden)]
pub struct NextUpdate<'a> {
    /// Its near vertex, and how far from it the new vertex is, in lattice steps.
    pub near: u32,
    pub offset: [i32; 3],
    /// The levels of the new vertex.
    pub levels: &'a [i32],
    /// Where fields jump, its levels in single regions; in others it has those above.
    pub sides: &'a [(u16, &'a [i32])],
    pub errors: &'a [ErrorCode],
    /// The faces opposite the new vertex of the tetrahedra that it is to insert, each one and all of them in ascending order of names;
    /// empty if they are those that it does insert.
    pub faces: &'a [[u32; 3]],
}

/// Consecutive updates.
#[derive(Default)]
pub(super) struct Batch {
    /// The first of them.
    first: u32,
    /// The near vertex of each, and how far from it the new vertex is.
    near: Vec<(u32, [i32; 3])>,
    /// Update by update and field by field.
    levels: Vec<i32>,
    errors: Vec<ErrorCode>,
    /// The levels of each new vertex in single regions, as they are given.
    sides: Rows<Side>,
    /// What removes the tetrahedra that each inserts, in the order of their faces opposite the new vertex, and where those of each end.
    removers: Vec<Remover>,
    remover_ends: Vec<usize>,
    /// These faces, as far as the caller has given them.
    faces: Vec<[u32; 3]>,
    /// The tetrahedra of the stars of those that have been applied.
    star: Vec<NewTet>,
    /// The labels of the vertices of their links, where these are, and their levels.
    link: Vec<(u32, [i32; 3])>,
    /// Of the vertices of the link or, where fields jump, of the corners of what each removes, each once.
    link_levels: Vec<i32>,
    /// Where fields jump.
    jumping: Jumping,
    applied: Vec<AppliedUpdate>,
}

/// The levels of a vertex in a region.
#[derive(Clone, Copy, Debug)]
struct Side {
    region: u16,
    /// Where they begin in [`Jumping::given`].
    first: u32,
}

/// What is taken down of updates where fields jump.
#[derive(Default)]
struct Jumping {
    /// The levels of [`Side`]s.
    given: Vec<i32>,
    /// For each removed tetrahedron which of the levels that are taken down are those of its corners.
    corners: Rows<[u16; 4]>,
    /// The levels of each new vertex in its regions but the first, and what is stored of all of its levels.
    levels: Rows<i32>,
    residuals: Rows<i32>,
}

/// An update that has been applied.
struct AppliedUpdate {
    position: [i32; 3],
    /// How many tetrahedra it has removed; the star begins with those that took their slots.
    removed: usize,
    /// The regions of these.
    regions: Vec<u16>,
    /// Where its star and its link end in the lists of the batch.
    star_end: usize,
    link_end: usize,
    levels_end: usize,
}

/// The stars of consecutive updates, coded.
struct Coded {
    /// The updates beside the vertex of each.
    children: Rows<ForestChild>,
    /// Their codes, and where each ends.
    stars: Vec<u8>,
    ends: Vec<usize>,
    residuals: Vec<i32>,
    /// The box around each star, and its ranges of levels, field by field.
    bounds: Vec<[[i32; 3]; 2]>,
    ranges: Vec<[i32; 2]>,
    /// What each depends on, and where those of each end.
    parents: Vec<UpdateId>,
    parent_ends: Vec<usize>,
    faults: Vec<Excess>,
    /// Why the next one has no code.
    failed: Option<ConvertError>,
}

/// Scratch space for coding stars.
#[derive(Default)]
struct CodeScratch {
    code: StarCode,
    places: Places,
    star: Vec<NewTet>,
    parents: Vec<UpdateId>,
    beyond: Vec<i32>,
}

impl Coded {
    /// Without codes yet, with room for those of so many updates.
    fn with_room(updates: usize, fields: usize) -> Self {
        Self {
            children: Rows::new(),
            stars: Vec::new(),
            ends: Vec::with_capacity(updates),
            residuals: vec![0; updates * fields],
            bounds: Vec::with_capacity(updates),
            ranges: Vec::with_capacity(updates * fields),
            parents: Vec::new(),
            parent_ends: Vec::with_capacity(updates),
            faults: Vec::new(),
            failed: None,
        }
    }

    /// Adds the code of a star, which is the `at`-th, and what its page is to know of it; its parents are in the scratch space.
    fn push(
        &mut self,
        at: usize,
        star: &TakenStar<'_>,
        forest: &Forest,
        CodeScratch { code, places, star: tets, parents, .. }: &mut CodeScratch,
    ) -> Result<(), ConvertError> {
        let update = star.update.0;
        places.set(star.link.iter().map(|v| v.1), star.position);
        if !places.is_positive(star.tets) {
            return Err(damaged(UpdateError::Inverted { update }));
        }
        let fields = star.levels.len();
        if star.corners.is_empty() {
            star.put_residuals(places, &mut self.residuals[at * fields..][..fields]);
        }
        tets.clear();
        tets.extend_from_slice(star.tets);
        let (labels, children) = (star.link.iter().map(|v| v.0), |label| forest.children(label));
        code.write((star.update, star.vertex), tets, labels, places, children, &mut self.stars)
            .ok_or_else(|| refused(update))?;
        self.children.push(forest.children(star.vertex));
        self.ends.push(self.stars.len());
        self.bounds.push(star.bounds());
        self.ranges.extend(star.ranges());
        self.parents.extend_from_slice(parents);
        self.parent_ends.push(self.parents.len());
        Ok(())
    }
}

/// The star of an update that has been applied, with its link.
struct TakenStar<'a> {
    update: UpdateId,
    /// The vertex that it inserts, with its position and its levels.
    vertex: u32,
    position: [i32; 3],
    levels: &'a [i32],
    tets: &'a [NewTet],
    /// How many tetrahedra it has removed; the first of `tets` took their slots.
    removed: usize,
    /// The labels of the vertices of the link and where these are; the near vertex is the first.
    link: &'a [(u32, [i32; 3])],
    /// Their levels, vertex by vertex and field by field.
    link_levels: &'a [i32],
    /// Where fields jump, which of these are those of each removed tetrahedron, and the levels of the vertex in its further regions.
    corners: &'a [[u16; 4]],
    sides: &'a [i32],
}

impl<'a> TakenStar<'a> {
    /// The levels of the `v`-th vertex of the link.
    #[inline]
    fn levels_at(&self, v: usize) -> &'a [i32] {
        let fields = self.levels.len();
        &self.link_levels[v * fields..][..fields]
    }

    /// What created each tetrahedron that the update has removed, and the levels at its corners: those of the one that took its slot, with
    /// the near vertex in place of the new one.
    fn removed(&self, mt: &HalfEdgeMt) -> impl Iterator<Item = (Option<UpdateId>, [&'a [i32]; 4])> + Clone {
        (0..).zip(&self.tets[..self.removed]).map(|(i, new): (usize, _)| {
            let corners = new.corners.map(|c| if c == NEW { 0 } else { usize::from(c) });
            let newest = corners.iter().map(|&c| self.link[c].0).max();
            let levels = self.corners.get(i).map_or(corners, |corners| corners.map(usize::from));
            (newest.and_then(|v| mt.inserted_by(VertexId(v))), levels.map(|c| self.levels_at(c)))
        })
    }

    /// Writes, field by field, what is to be added to the predicted level of the new vertex.
    fn put_residuals(&self, places: &Places, residuals: &mut [i32]) {
        places.predict_levels(|v| self.levels_at(v), residuals);
        residuals.iter_mut().zip(self.levels).for_each(|(residual, level)| *residual = level - *residual);
    }

    /// The box around the star.
    fn bounds(&self) -> [[i32; 3]; 2] {
        self.link.iter().fold([self.position; 2], |[low, high], (_, p)| {
            [[0, 1, 2].map(|k| low[k].min(p[k])), [0, 1, 2].map(|k| high[k].max(p[k]))]
        })
    }

    /// The range of the levels of its vertices, field by field.
    fn ranges(&self) -> impl Iterator<Item = [i32; 2]> {
        let fields = self.levels.len();
        (0..fields).map(move |f| {
            let around = self.link_levels.iter().chain(self.sides).skip(f).step_by(fields).copied();
            around.fold([self.levels[f]; 2], |[low, high], level| [low.min(level), high.max(level)])
        })
    }
}

impl Batch {
    pub fn len(&self) -> usize {
        self.remover_ends.len()
    }

    /// Empties it for updates from `first` on.
    pub fn clear(&mut self, first: u32) {
        self.first = first;
        self.near.clear();
        self.levels.clear();
        self.errors.clear();
        self.removers.clear();
        self.remover_ends.clear();
        self.faces.clear();
        self.star.clear();
        self.link.clear();
        self.link_levels.clear();
        self.sides = Rows::new();
        self.jumping = Jumping::default();
        self.applied.clear();
    }

    /// Adds the next update.
    pub fn push(&mut self, next: &NextUpdate<'_>, star: impl Iterator<Item = Remover>) {
        self.near.push((next.near, next.offset));
        self.levels.extend_from_slice(next.levels);
        self.errors.extend_from_slice(next.errors);
        self.faces.extend_from_slice(next.faces);
        let sides = next.sides.iter().map(|(region, levels)| {
            let first = self.jumping.given.len() as u32;
            self.jumping.given.extend_from_slice(levels);
            Side { region: *region, first }
        });
        let sides: Vec<Side> = sides.collect();
        self.sides.push(&sides);
        self.removers.extend(star);
        self.remover_ends.push(self.removers.len());
    }

    /// Notes what its updates, which have been coded, reach, and how long the chains are that lead to them.
    pub fn note_reaches(
        &self,
        coded: &CodedBatch,
        mt: &HalfEdgeMt,
        reaches: &mut Reaches,
        chains: &mut Chains,
    ) {
        let fields = mt.info().fields.len();
        let mut next = self.first;
        for coded in &coded.0 {
            for (at, &end) in coded.parent_ends.iter().enumerate() {
                let (update, own) = (UpdateId(next), &self.applied[(next - self.first) as usize]);
                let parents = &coded.parents[before(at, |at| coded.parent_ends[at])..end];
                reaches.push(update, coded.bounds[at], &coded.ranges[at * fields..][..fields], parents);
                if mt.regions().is_some() {
                    reaches.push_regions(update, own.regions.clone());
                }
                chains.push(update, parents);
                next += 1;
            }
        }
    }

    /// Notes the errors of its updates.
    pub fn note_errors(&self, errors: &mut [PagedArray<ErrorCode>]) {
        let fields = errors.len();
        for (field, errors) in errors.iter_mut().enumerate() {
            let own = self.errors.iter().skip(field).step_by(fields);
            (self.first..).zip(own).for_each(|(u, &error)| errors.set(u, error));
        }
    }

    /// Forgets what coding the stars takes, once that is done.
    pub fn forget_stars(&mut self) {
        let Self { first, levels, errors, remover_ends, jumping, applied, .. } = std::mem::take(self);
        let residuals = jumping.residuals;
        let jumping = Jumping { residuals, ..Jumping::default() };
        *self = Self { first, levels, errors, remover_ends, jumping, applied, ..Self::default() };
    }

    /// What is given of the star of the `i`-th update: what removes it, and the faces if there are any.
    fn given(&self, i: usize) -> (&[Remover], &[[u32; 3]]) {
        let range = before(i, |i| self.remover_ends[i])..self.remover_ends[i];
        (&self.removers[range.clone()], self.faces.get(range).unwrap_or(&[]))
    }

    fn levels_of(&self, i: usize, fields: usize) -> &[i32] {
        &self.levels[i * fields..][..fields]
    }

    fn errors_of(&self, i: usize, fields: usize) -> &[ErrorCode] {
        &self.errors[i * fields..][..fields]
    }

    /// The error of an update in one of so many fields; none if it is not one of these.
    fn error(&self, u: UpdateId, field: usize, fields: usize) -> Option<ErrorCode> {
        let i = u.0.checked_sub(self.first).filter(|i| (*i as usize) < self.len())?;
        Some(self.errors_of(i as usize, fields)[field])
    }

    /// Applies the updates to the mesh of those before, and takes down their stars. The names of the forest decide on the order of faces.
    pub fn apply(
        &mut self,
        mt: &HalfEdgeMt,
        forest: &Forest,
        mesh: &mut CurrentMesh,
        scratch: &mut Scratch,
    ) -> Result<(), ConvertError> {
        (0..self.len()).try_for_each(|i| self.apply_one(mt, forest, mesh, scratch, i))
    }

    fn apply_one(
        &mut self,
        mt: &HalfEdgeMt,
        forest: &Forest,
        mesh: &mut CurrentMesh,
        scratch: &mut Scratch,
        i: usize,
    ) -> Result<(), ConvertError> {
        let update = self.first + i as u32;
        let (u, refused) = (UpdateId(update), || refused(update));
        let (near, offset) = self.near[i];
        let slot = mesh.slot(VertexId(near)).ok_or_else(refused)?;
        let vertex = mt.vertex(u);
        let first = match mesh.tagged(update) {
            Some(t) => t,
            None => {
                let mut around = Vec::new();
                mesh.list_star(slot, &mut around);
                around.into_iter().find(|&t| mesh.tag(t) == update).ok_or_else(refused)?
            }
        };
        match mesh.collect_tagged(update, slot, first, scratch).map_err(damaged)? {
            Applied::Done => {}
            Applied::Blocked(_) => return Err(refused()),
        }
        scratch.find_star(mesh).ok_or_else(refused)?;
        let position = [0, 1, 2].map(|k| mesh.positions[slot as usize][k].saturating_add(offset[k]));
        if mt.has_sides() {
            self.take_sides(i, mesh, position, scratch);
        } else {
            scratch.levels.clear();
            scratch.levels.extend_from_slice(self.levels_of(i, mesh.fields));
        }
        if !scratch.levels.chunks(mesh.fields).all(|levels| mt.info().holds(position, levels)) {
            return Err(damaged(UpdateError::OffLattice { update }));
        }
        set_removers(scratch, mesh, forest, vertex, self.given(i)).ok_or_else(refused)?;
        self.star.extend_from_slice(&scratch.star[..scratch.star_len]);
        for &slot in &scratch.link[..scratch.link_len] {
            self.link.push((mesh.vertex(slot).0, mesh.positions[slot as usize]));
            if !mt.has_sides() {
                self.link_levels.extend_from_slice(mesh.levels(slot));
            }
        }
        self.applied.push(AppliedUpdate {
            position,
            removed: scratch.removed_len,
            regions: mesh.regions_of(&scratch.slots[..scratch.removed_len]),
            star_end: self.star.len(),
            link_end: self.link.len(),
            levels_end: self.link_levels.len(),
        });
        mt.perform_insertion(mesh, u, position, scratch);
        mesh.clear_touched();
        Ok(())
    }

    /// Where fields jump: sets the levels of the vertex of the `i`-th update in the scratch space, where its star is, and takes down what is
    /// stored of them, and the levels at the corners of what it removes.
    fn take_sides(&mut self, i: usize, mesh: &CurrentMesh, position: [i32; 3], scratch: &mut Scratch) {
        let fields = mesh.fields;
        scratch.place(mesh, position);
        let predicted = std::mem::take(&mut scratch.levels);
        let given = self.sides.row(i);
        let own = self.levels_of(i, fields);
        let mut levels = Vec::with_capacity(predicted.len());
        for &region in &scratch.regions {
            let side = given.iter().find(|side| side.region == region);
            levels.extend_from_slice(
                side.map_or(own, |side| &self.jumping.given[side.first as usize..][..fields]),
            );
        }
        let jumps = mesh.jumps().unwrap_or(&[]);
        let residual = |(at, (own, predicted)): (usize, (&i32, &i32))| {
            // What does not jump has the level of the first region in all others.
            if at < fields || jumps[at % fields] { own - predicted } else { 0 }
        };
        let residuals: Vec<i32> = levels.iter().zip(&predicted).enumerate().map(residual).collect();
        self.jumping.levels.push(&levels[fields..]);
        self.jumping.residuals.push(&residuals);
        self.levels[i * fields..][..fields].copy_from_slice(&levels[..fields]);
        scratch.levels = levels;
        let mut slots: Vec<u32> = Vec::new();
        let removed = scratch.slots[..scratch.removed_len].iter().filter_map(|&t| mesh.tet(t));
        let corners: Vec<[u16; 4]> = removed
            .map(|tet| {
                tet.map(|slot| {
                    let place = slots.iter().position(|&known| known == slot);
                    place.unwrap_or_else(|| {
                        slots.push(slot);
                        self.link_levels.extend_from_slice(mesh.levels(slot));
                        slots.len() - 1
                    }) as u16
                })
            })
            .collect();
        self.jumping.corners.push(&corners);
    }

    /// Where the star, the link and the levels there of the `i`-th update are.
    fn ranges(&self, i: usize) -> [Range<usize>; 3] {
        [
            before(i, |i| self.applied[i].star_end)..self.applied[i].star_end,
            before(i, |i| self.applied[i].link_end)..self.applied[i].link_end,
            before(i, |i| self.applied[i].levels_end)..self.applied[i].levels_end,
        ]
    }

    /// Codes the stars of the updates that have been applied.
    pub fn code(&self, before: Before<'_>, forest: &Forest, margins: &mut Margins) -> CodedBatch {
        let fields = before.mt.info().fields.len();
        for i in 0..self.applied.len() {
            let [.., levels] = self.ranges(i);
            margins.note(UpdateId(self.first + i as u32), self.link_levels[levels].chunks(fields));
        }
        let margins = &*margins;
        let code = |range: Range<usize>| self.code_share(range, before, forest, margins);
        CodedBatch(threads::map(self.applied.len(), SHARE, code))
    }

    /// Codes the stars of some of the updates that have been applied, up to the first that has no code.
    fn code_share(
        &self,
        updates: Range<usize>,
        before: Before<'_>,
        forest: &Forest,
        margins: &Margins,
    ) -> Coded {
        let mt = before.mt;
        let mut coded = Coded::with_room(updates.len(), mt.info().fields.len());
        let mut scratch = CodeScratch::default();
        for (at, i) in updates.enumerate() {
            let star = self.star_of(i, mt);
            coded.faults.extend(self.fault(&star, before, margins, &mut scratch));
            if let Err(why) = coded.push(at, &star, forest, &mut scratch) {
                coded.failed = Some(why);
                break;
            }
        }
        coded
    }

    /// The star of the `i`-th update, as it was taken down.
    fn star_of(&self, i: usize, mt: &HalfEdgeMt) -> TakenStar<'_> {
        let fields = mt.info().fields.len();
        let update = UpdateId(self.first + i as u32);
        let [star, link, levels] = self.ranges(i);
        let jumps = mt.has_sides();
        TakenStar {
            update,
            vertex: mt.vertex(update).0,
            position: self.applied[i].position,
            levels: self.levels_of(i, fields),
            tets: &self.star[star],
            removed: self.applied[i].removed,
            link: &self.link[link],
            link_levels: &self.link_levels[levels],
            corners: if jumps { self.jumping.corners.row(i) } else { &[] },
            sides: if jumps { self.jumping.levels.row(i) } else { &[] },
        }
    }

    /// The fault of the errors of an update against those of its parents, of this batch or before.
    fn fault(
        &self,
        star: &TakenStar<'_>,
        before: Before<'_>,
        margins: &Margins,
        scratch: &mut CodeScratch,
    ) -> Option<Excess> {
        let CodeScratch { parents, beyond, .. } = scratch;
        parents.clear();
        beyond.clear();
        margins.find_beyond(star.removed(before.mt), parents, beyond);
        let fields = star.levels.len();
        let error = |u: UpdateId, field: usize| {
            self.error(u, field, fields).unwrap_or_else(|| before.error(u, field, fields))
        };
        margins.fault(star.update, parents, beyond, error)
    }

    /// Appends what has been coded to the MT.
    pub fn append(
        &self,
        coded: CodedBatch,
        mt: &mut HalfEdgeMt,
        facts: &mut MtFacts,
    ) -> Result<(), ConvertError> {
        let fields = mt.info().fields.len();
        for (share, coded) in coded.0.into_iter().enumerate() {
            for (at, &end) in coded.ends.iter().enumerate() {
                let i = share * SHARE + at;
                let (own, sides) = match mt.has_sides() {
                    true => self.jumping.residuals.row(i).split_at(fields),
                    false => (&coded.residuals[at * fields..][..fields], &[][..]),
                };
                let record = HalfEdgeUpdate {
                    children: coded.children.row(at),
                    level_residuals: own,
                    side_residuals: sides,
                    star: &coded.stars[before(at, |at| coded.ends[at])..end],
                    errors: self.errors_of(i, fields),
                };
                mt.push(&record).map_err(damaged)?;
            }
            coded.faults.into_iter().for_each(|fault| facts.note(fault));
            coded.failed.map_or(Ok(()), Err)?;
        }
        Ok(())
    }
}

/// The lengths of the longest chains of updates that lead to each, and that of the longest of all.
pub(super) struct Chains {
    lengths: PagedArray<u32>,
    pub longest: u32,
}

impl Chains {
    pub fn new() -> Self {
        Self { lengths: PagedArray::new(0), longest: 0 }
    }

    fn push(&mut self, update: UpdateId, parents: &[UpdateId]) {
        let length = 1 + parents.iter().map(|parent| self.lengths.get(parent.0)).max().unwrap_or(0);
        self.lengths.set(update.0, length);
        self.longest = self.longest.max(length);
    }

    /// Forgets updates on which no later one depends.
    pub fn forget(&mut self, updates: Range<u32>) {
        self.lengths.forget(updates);
    }
}

/// The updates before those of a batch.
#[derive(Clone, Copy)]
pub(super) struct Before<'a> {
    pub mt: &'a HalfEdgeMt,
    /// For each field their errors, as far as they are known, where not all of their pages are in the MT.
    pub errors: &'a [PagedArray<ErrorCode>],
    /// Those that are to be appended later.
    pub waiting: &'a [(Batch, CodedBatch)],
}

impl Before<'_> {
    /// The error of an update in one of so many fields.
    fn error(&self, u: UpdateId, field: usize, fields: usize) -> ErrorCode {
        let waiting = self.waiting.iter().rev().find_map(|(batch, _)| batch.error(u, field, fields));
        let known = || self.errors.get(field).map(|errors| errors.get(u.0));
        waiting.or_else(known).unwrap_or_else(|| self.mt.error_of_field(u, field))
    }
}

/// The stars of a batch, coded.
pub(super) struct CodedBatch(Vec<Coded>);

/// Where the one before ends.
fn before(i: usize, end: impl Fn(usize) -> usize) -> usize {
    i.checked_sub(1).map_or(0, end)
}
