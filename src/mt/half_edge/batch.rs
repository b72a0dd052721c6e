//! Updates that are about to be appended to a half-edge MT. First they are applied, one after the other, and their stars are taken down;
//! then the stars are coded, each by itself.

use super::builder::{Forest, Remover, by_corner, damaged, refused};
use super::scratch::{MOST, NEW, NewTet, Scratch, is_positive, predict_levels};
use super::star_code::StarCode;
use super::store::{HalfEdgeMt, HalfEdgeUpdate};
use crate::mt::facts::MtFacts;
use crate::mt::{
    Applied, ConvertError, CurrentMesh, ErrorCode, Excess, Margins, MultiTessellation, UpdateError, UpdateId,
    VertexId,
};
use crate::threads;
use std::ops::Range;

/// So many stars are coded at a time: a thread takes no fewer.
const SHARE: usize = 32;

/// Consecutive updates.
#[derive(Default)]
pub(super) struct Batch {
    /// The first of them.
    first: u32,
    /// Update by update and field by field.
    levels: Vec<i32>,
    errors: Vec<ErrorCode>,
    /// What removes the tetrahedra that each inserts, in the order of their faces opposite the new vertex, and where those of each end.
    removers: Vec<Remover>,
    remover_ends: Vec<usize>,
    /// These faces, as far as the caller has given them.
    faces: Vec<[u32; 3]>,
    /// The tetrahedra of the stars of those that have been applied.
    star: Vec<NewTet>,
    /// The labels of the vertices of their links, where these are, and their levels.
    link: Vec<(u32, [i32; 3])>,
    link_levels: Vec<i32>,
    applied: Vec<AppliedUpdate>,
}

/// An update that has been applied.
struct AppliedUpdate {
    position: [i32; 3],
    /// How many tetrahedra it has removed; the star begins with those that took their slots.
    removed: usize,
    /// Where its star and its link end in the lists of the batch.
    star_end: usize,
    link_end: usize,
}

/// The stars of consecutive updates, coded.
struct Coded {
    /// Their codes, and where each ends.
    stars: Vec<u8>,
    ends: Vec<usize>,
    residuals: Vec<i32>,
    /// The box around each star, and its ranges of levels, field by field.
    bounds: Vec<[[i32; 3]; 2]>,
    ranges: Vec<[i32; 2]>,
    faults: Vec<Excess>,
    /// Why the next one has no code.
    failed: Option<ConvertError>,
}

impl Batch {
    pub fn len(&self) -> usize {
        self.remover_ends.len()
    }

    /// Empties it for updates from `first` on.
    pub fn clear(&mut self, first: u32) {
        self.first = first;
        self.levels.clear();
        self.errors.clear();
        self.removers.clear();
        self.remover_ends.clear();
        self.faces.clear();
        self.star.clear();
        self.link.clear();
        self.link_levels.clear();
        self.applied.clear();
    }

    /// Adds the next update.
    pub fn push(&mut self, levels: &[i32], errors: &[ErrorCode], star: impl Iterator<Item = Remover>) {
        self.levels.extend_from_slice(levels);
        self.errors.extend_from_slice(errors);
        self.removers.extend(star);
        self.remover_ends.push(self.removers.len());
    }

    /// Adds the faces of the star of the last update.
    pub fn push_faces(&mut self, faces: &[[u32; 3]]) {
        self.faces.extend_from_slice(faces);
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

    /// Applies the updates to the mesh of those before, and takes down their stars. `names` decide on the order of faces.
    pub fn apply(
        &mut self,
        mt: &HalfEdgeMt,
        forest: &Forest,
        names: &[u32],
        mesh: &mut CurrentMesh,
        scratch: &mut Scratch,
    ) -> Result<(), ConvertError> {
        (0..self.len()).try_for_each(|i| self.apply_one(mt, forest, names, mesh, scratch, i))
    }

    fn apply_one(
        &mut self,
        mt: &HalfEdgeMt,
        forest: &Forest,
        names: &[u32],
        mesh: &mut CurrentMesh,
        scratch: &mut Scratch,
        i: usize,
    ) -> Result<(), ConvertError> {
        let update = self.first + i as u32;
        let (u, refused) = (UpdateId(update), || refused(update));
        let near = forest.near(update).ok_or_else(refused)?;
        let slot = mesh.slot(VertexId(near)).ok_or_else(refused)?;
        let vertex = mt.vertex(u);
        let first = match mesh.tagged(update) {
            Some(t) => t,
            None => {
                let around = mesh.all_around(slot);
                around.into_iter().find(|&(t, _)| mesh.tag(t) == update).ok_or_else(refused)?.0
            }
        };
        match mesh.collect_tagged(update, slot, first, scratch).map_err(damaged)? {
            Applied::Done => {}
            Applied::Blocked(_) => return Err(refused()),
        }
        mt.find_star(mesh, scratch).ok_or_else(refused)?;
        let offset = forest.offset(update, near).ok_or_else(refused)?;
        let position = [0, 1, 2].map(|k| mesh.positions[slot as usize][k].saturating_add(offset[k]));
        let levels = self.levels_of(i, mesh.fields);
        if !mt.info().holds(position, levels) {
            return Err(damaged(UpdateError::OffLattice { update }));
        }
        scratch.levels.clear();
        scratch.levels.extend_from_slice(levels);
        set_removers(scratch, mesh, names, vertex, self.given(i)).ok_or_else(refused)?;
        self.star.extend_from_slice(&scratch.star[..scratch.star_len]);
        for &slot in &scratch.link[..scratch.link_len] {
            self.link.push((mesh.vertex(slot).0, mesh.positions[slot as usize]));
            self.link_levels.extend_from_slice(mesh.levels(slot));
        }
        self.applied.push(AppliedUpdate {
            position,
            removed: scratch.removed_len,
            star_end: self.star.len(),
            link_end: self.link.len(),
        });
        mt.perform_insertion(mesh, u, position, scratch);
        mesh.clear_touched();
        Ok(())
    }

    /// Where the star and the link of the `i`-th update are.
    fn ranges(&self, i: usize) -> [Range<usize>; 2] {
        [
            before(i, |i| self.applied[i].star_end)..self.applied[i].star_end,
            before(i, |i| self.applied[i].link_end)..self.applied[i].link_end,
        ]
    }

    /// Codes the stars of the updates that have been applied.
    pub fn code(&self, mt: &HalfEdgeMt, forest: &Forest, margins: &mut Margins) -> CodedBatch {
        let fields = mt.info().fields.len();
        for i in 0..self.applied.len() {
            let [_, link] = self.ranges(i);
            margins.note(link.map(|v| &self.link_levels[v * fields..][..fields]));
        }
        let margins = &*margins;
        let code = |range: Range<usize>| self.code_share(range, mt, forest, margins);
        CodedBatch(threads::map(self.applied.len(), SHARE, code))
    }

    fn code_share(
        &self,
        updates: Range<usize>,
        mt: &HalfEdgeMt,
        forest: &Forest,
        margins: &Margins,
    ) -> Coded {
        let fields = mt.info().fields.len();
        let mut coded = Coded {
            stars: Vec::new(),
            ends: Vec::with_capacity(updates.len()),
            residuals: vec![0; updates.len() * fields],
            bounds: Vec::with_capacity(updates.len()),
            ranges: Vec::with_capacity(updates.len() * fields),
            faults: Vec::new(),
            failed: None,
        };
        let (mut code, mut star) = (StarCode::default(), Vec::new());
        let (mut parents, mut beyond) = (Vec::new(), Vec::new());
        // Of this batch, and before.
        let error = |UpdateId(u): UpdateId, field: usize| match u.checked_sub(self.first) {
            Some(i) => self.errors_of(i as usize, fields)[field],
            None => mt.error_of_field(UpdateId(u), field),
        };
        for (at, i) in updates.enumerate() {
            let u = UpdateId(self.first + i as u32);
            let (vertex, position) = (mt.vertex(u).0, self.applied[i].position);
            let [star_range, link] = self.ranges(i);
            star.clear();
            star.extend_from_slice(&self.star[star_range]);
            let levels_at = |v: usize| &self.link_levels[(link.start + v) * fields..][..fields];
            let link = &self.link[link.clone()];
            // What it removes has the near vertex in place of the new one.
            let corners = |new: &NewTet| new.corners.map(|c| if c == NEW { 0 } else { usize::from(c) });
            let tets = star[..self.applied[i].removed].iter().map(|new| {
                let corners = corners(new);
                let newest = corners.iter().map(|&c| link[c].0).max();
                (newest.and_then(|v| mt.inserted_by(VertexId(v))), corners.map(levels_at))
            });
            parents.clear();
            beyond.clear();
            margins.find_beyond(tets, &mut parents, &mut beyond);
            coded.faults.extend(margins.fault(u, &parents, &beyond, error));
            if !is_positive(&star, link.iter().map(|v| v.1), position) {
                coded.failed = Some(damaged(UpdateError::Inverted { update: u.0 }));
                break;
            }
            let levels = self.levels_of(i, fields);
            let residuals = &mut coded.residuals[at * fields..][..fields];
            let positions = link.iter().map(|v| v.1);
            predict_levels(positions.enumerate().map(|(v, p)| (p, levels_at(v))), position, residuals);
            residuals.iter_mut().zip(levels).for_each(|(residual, level)| *residual = level - *residual);
            let vertices = link.iter().copied().chain([(vertex, position)]);
            let with_children = vertices.clone().map(|(label, p)| (label, p, forest.children(label)));
            if code.write(u, &mut star, with_children, &mut coded.stars).is_none() {
                coded.failed = Some(refused(u.0));
                break;
            }
            coded.ends.push(coded.stars.len());
            coded.bounds.push(vertices.fold([[i32::MAX; 3], [i32::MIN; 3]], |[low, high], (_, p)| {
                [[0, 1, 2].map(|k| low[k].min(p[k])), [0, 1, 2].map(|k| high[k].max(p[k]))]
            }));
            coded.ranges.extend((0..fields).map(|f| {
                let around = (0..link.len()).map(|v| levels_at(v)[f]);
                around.fold([levels[f]; 2], |[low, high], level| [low.min(level), high.max(level)])
            }));
        }
        coded
    }

    /// Appends what has been coded to the MT.
    pub fn append(
        &self,
        coded: CodedBatch,
        mt: &mut HalfEdgeMt,
        forest: &Forest,
        facts: &mut MtFacts,
    ) -> Result<(), ConvertError> {
        let fields = mt.info().fields.len();
        for (share, coded) in coded.0.into_iter().enumerate() {
            for (at, &end) in coded.ends.iter().enumerate() {
                let i = share * SHARE + at;
                let u = UpdateId(self.first + i as u32);
                let record = HalfEdgeUpdate {
                    children: forest.children(mt.vertex(u).0),
                    level_residuals: &coded.residuals[at * fields..][..fields],
                    star: &coded.stars[before(at, |at| coded.ends[at])..end],
                    errors: self.errors_of(i, fields),
                };
                mt.push(&record).map_err(damaged)?;
                let page = (u.0 >> mt.pages.bits()) as usize;
                facts.widen(page, coded.bounds[at], &coded.ranges[at * fields..][..fields]);
            }
            coded.faults.into_iter().for_each(|fault| facts.note(fault));
            coded.failed.map_or(Ok(()), Err)?;
        }
        Ok(())
    }
}

/// The stars of a batch, coded.
pub(super) struct CodedBatch(Vec<Coded>);

/// Where the one before ends.
fn before(i: usize, end: impl Fn(usize) -> usize) -> usize {
    i.checked_sub(1).map_or(0, end)
}

/// Enters what removes the tetrahedra of a star, given in the order of their faces opposite the new vertex. None if there are not as many of
/// them, or these are not the given faces.
fn set_removers(
    scratch: &mut Scratch,
    mesh: &CurrentMesh,
    names: &[u32],
    vertex: VertexId,
    (removers, given): (&[Remover], &[[u32; 3]]),
) -> Option<()> {
    let Scratch { star, star_len, link, link_len, .. } = scratch;
    let (star, link) = (&mut star[..*star_len], &link[..*link_len]);
    if removers.len() != star.len() {
        return None;
    }
    // Names are compared once for each vertex: the rest goes by ranks.
    let name = |v: VertexId| u64::from(names[v.0 as usize]);
    let mut sorted = [0; MOST + 1];
    let sorted = &mut sorted[..=link.len()];
    for (entry, (i, &slot)) in sorted.iter_mut().zip((0..).zip(link)) {
        *entry = name(mesh.vertex(slot)) << 8 | i;
    }
    sorted[link.len()] = name(vertex) << 8 | u64::from(NEW);
    sorted.sort_unstable();
    let mut ranks = [0_u8; NEW as usize + 1];
    (0..).zip(&*sorted).for_each(|(rank, &entry)| ranks[usize::from(entry as u8)] = rank);
    let mut faces = [0_u32; MOST];
    let faces = &mut faces[..star.len()];
    for (i, (face, new)) in faces.iter_mut().zip(&*star).enumerate() {
        let mut corners = new.corners.map(|corner| ranks[usize::from(corner)]);
        // The new vertex goes to the end.
        corners[usize::from(new.own) & 3] = u8::MAX;
        corners.sort_unstable();
        corners[3] = i as u8;
        *face = u32::from_be_bytes(corners);
    }
    faces.sort_unstable();
    for (at, (&face, &(remover, inner))) in faces.iter().zip(removers).enumerate() {
        let [a, b, c, i] = face.to_be_bytes();
        if let Some(given) = given.get(at) {
            let name = |rank: u8| (sorted[usize::from(rank)] >> 8) as u32;
            if *given != [a, b, c].map(name) {
                return None;
            }
        }
        let new = &mut star[usize::from(i)];
        new.remover = remover;
        new.inner = by_corner(inner, new.corners.map(|corner| u32::from(ranks[usize::from(corner)])));
    }
    Some(())
}
