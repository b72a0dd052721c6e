//! What the builders of vertex-based MTs hand over: vertex insertions, coarse to fine.

use crate::decimate::{Record, Removed};
use crate::lattice::quantize;
use crate::lattice::quantize::Quantized;
use crate::order::base::{Numbered, number_base};
use crate::{BuildError, BuildProgress, OnProgress};
use std::cmp::Reverse;
use std::ops::Range;
use tetralod::mesh::NONE;
use tetralod::mt::{
    ErrorCode, ExplicitMt, ExplicitUpdate, MAX_QUARTERINGS, MtInfo, MultiTessellation, UpdateError, UpdateId,
    VertexId, canonical,
};

/// Vertex insertions from a base mesh to a reference mesh, in an order in which they can be carried out.
/// Vertices are numbers of reference points; tetrahedra are positive on the lattice.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Sequence {
    /// The base mesh.
    pub base: Vec<[u32; 4]>,
    /// What the insertions remove and insert, one after the other.
    pub tets: Vec<[u32; 4]>,
    /// The insertions.
    pub steps: Vec<Insertion>,
    /// For each entry of `tets` that is removed the errors of its own, field by field, in the order in which they are removed;
    /// nothing where tetrahedra are to have none.
    pub own_errors: Vec<f64>,
}

/// One vertex insertion.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Insertion {
    /// The reference point that is inserted.
    pub vertex: u32,
    /// Which entries of [`Sequence::tets`] it removes (the paper's T_u).
    pub removed: Range<usize>,
    /// Which it inserts: all tetrahedra at the vertex.
    pub inserted: Range<usize>,
    /// For each field the largest error of a tetrahedron that it removes, as a fraction of the field's range; they need not
    /// be monotone.
    pub errors: Vec<f64>,
    /// What has to be added to the errors of the insertions that depend on this one before they bound its own from
    /// below: how far the boundary moves, as an error. 0 where the boundary stays.
    pub step: f64,
}

/// Of removals in the order in which they are made it becomes one of insertions.
impl Record for Sequence {
    fn start(&mut self, _: &MtInfo, _: usize) {}

    fn len(&self) -> usize {
        self.steps.len()
    }

    fn add(&mut self, removed: &Removed<'_>, _: &Quantized) {
        let Removed { hole, filling, errors, step, .. } = *removed;
        let start = self.tets.len();
        self.tets.extend(hole.faces.iter().map(|&([x, y, z], _)| [x, y, z, hole.a]));
        let middle = self.tets.len();
        self.tets.extend_from_slice(&filling.tets);
        let end = self.tets.len();
        let (removed, inserted) = (middle..end, start..middle);
        let errors = errors.iter().map(|code| code.error()).collect();
        self.steps.push(Insertion { vertex: hole.a, removed, inserted, errors, step });
    }

    fn renumber(&mut self, _: &[u32]) {}

    fn finish(&mut self, tets: &[[u32; 4]], _: &[u32]) {
        self.base = tets.iter().copied().filter(|tet| tet[0] != NONE).collect();
        let all = self.tets.len();
        self.tets.reverse();
        self.steps.reverse();
        for step in &mut self.steps {
            for range in [&mut step.removed, &mut step.inserted] {
                *range = all - range.end..all - range.start;
            }
        }
    }
}

impl Sequence {
    /// The MT of these insertions, and its vertex for each reference point. They come in the order of falling error, as far as equal errors leave it open in
    /// the order of the sequence: errors are made monotone along the DAG first, so this extends the partial order.
    pub fn explicit_mt(
        &self,
        mut info: MtInfo,
        quantized: &Quantized,
        progress: OnProgress<'_>,
    ) -> Result<(ExplicitMt, Vec<VertexId>), BuildError> {
        let arcs = self.arcs(quantized.positions.len())?;
        let errors = self.monotone_errors(quantized, &arcs, &quantize::floors(&info));
        let mut order: Vec<u32> = (0..self.steps.len() as u32).collect();
        let fields = info.fields.len();
        let errors_of = |i: u32| &errors[i as usize * fields..][..fields];
        order.sort_by_key(|&i| Reverse(errors_of(i).iter().max()));
        info.updates = order.len() as u32;
        let levels = |v: u32| &quantized.levels[v as usize * fields..][..fields];
        let Numbered { mesh, mut number, places } =
            number_base(&quantized.positions, &quantized.levels, fields, &self.base);
        // The number that each base tetrahedron of the sequence has in the MT.
        let mut base_ids = vec![NONE; places.len()];
        (0..).zip(&places).for_each(|(t, &place)| base_ids[place as usize] = t);
        let mut mt = ExplicitMt::new(info, mesh);
        // The number that each tetrahedron of the sequence has in the MT.
        let mut ids = vec![NONE; self.tets.len()];
        for (done, &i) in order.iter().enumerate() {
            BuildProgress::tell_ordered(done, order.len(), progress)?;
            let Insertion { vertex, inserted, .. } = &self.steps[i as usize];
            number[*vertex as usize] = (mt.base().positions.len() + done) as u32;
            let sources = &arcs.source[self.steps[i as usize].removed.clone()];
            let removed: Vec<u32> = sources.iter().map(|source| source.number(&base_ids, &ids)).collect();
            let name = |tet: [u32; 4]| canonical(tet.map(|v| number[v as usize]));
            let new: Vec<[u32; 4]> = self.tets[inserted.clone()].iter().map(|&tet| name(tet)).collect();
            let first = mt.tets().len() as u32;
            let update = ExplicitUpdate {
                positions: &[quantized.positions[*vertex as usize]],
                levels: levels(*vertex),
                removed: &removed,
                inserted: &new,
                errors: errors_of(i),
            };
            mt.push(&update).map_err(BuildError::Internal)?;
            let stored = &mt.tets()[first as usize..];
            for (at, tet) in inserted.clone().zip(&new) {
                let place = stored.binary_search(tet).map_err(|_| torn(i))?;
                ids[at] = first + place as u32;
            }
        }
        if let Some((falls, quarterings)) = self.tet_errors(&mt, &order, &arcs, [&base_ids, &ids]) {
            mt.set_tet_errors(falls, quarterings).map_err(BuildError::Internal)?;
        }
        Ok((mt, number.into_iter().map(VertexId).collect()))
    }

    /// How far the errors of each insertion can be lowered for all that it removes, and then quartered for each tetrahedron
    /// of the MT that is removed, and still bound those of its own. None where tetrahedra are to have none.
    fn tet_errors(
        &self,
        mt: &ExplicitMt,
        order: &[u32],
        arcs: &Arcs,
        [base_ids, ids]: [&[u32]; 2],
    ) -> Option<(Vec<u8>, Vec<u8>)> {
        let fields = mt.fields();
        let least: Vec<ErrorCode> = (0..fields).map(|f| mt.info().least_own_error(f)).collect();
        let mut update_of = vec![0; order.len()];
        order.iter().zip(0..).for_each(|(&i, u)| update_of[i as usize] = u);
        let mut rest = &self.own_errors[..];
        let (mut falls, mut quarterings) = (vec![0; order.len()], vec![0; mt.tets().len()]);
        for (step, &u) in self.steps.iter().zip(&update_of) {
            let errors = mt.errors(UpdateId(u));
            let (own, after) =
                rest.split_at_checked(step.removed.len() * fields).filter(|_| !rest.is_empty())?;
            rest = after;
            let own: Vec<ErrorCode> = own.iter().map(|&error| ErrorCode::at_least(error)).collect();
            let told = own.iter().enumerate().filter(|&(at, own)| *own > least[at % fields]);
            let fall = told.map(|(at, &own)| errors[at % fields].fall_to(own)).min().unwrap_or(u8::MAX);
            falls[u as usize] = fall;
            for (source, own) in arcs.source[step.removed.clone()].iter().zip(own.chunks(fields)) {
                let bounds = |times: &u8| {
                    let fields = errors.iter().zip(own).zip(&least);
                    fields
                        .into_iter()
                        .all(|((error, own), least)| error.lowered(fall, *times).max(*least) >= *own)
                };
                let most = (0..=MAX_QUARTERINGS).rev().find(bounds).unwrap_or(0);
                quarterings[source.number(base_ids, ids) as usize] = most;
            }
        }
        Some((falls, quarterings))
    }

    /// Where each removed tetrahedron comes from. Insertions are never undone, and all that one inserts is around its
    /// vertex: so a tetrahedron comes from the insertion of its newest vertex.
    fn arcs(&self, points: usize) -> Result<Arcs, BuildError> {
        let mut base: Vec<([u32; 4], u32)> = self.base.iter().map(|&tet| sorted(tet)).zip(0..).collect();
        base.sort_unstable();
        let mut step_of = vec![NONE; points];
        let mut arcs =
            Arcs { source: vec![Source::Base(NONE); self.tets.len()], creator: vec![NONE; self.tets.len()] };
        let mut gone = vec![false; self.tets.len()];
        for (i, step) in (0..).zip(&self.steps) {
            for at in step.removed.clone() {
                let tet = sorted(self.tets[at]);
                let newest = tet.map(|v| step_of[v as usize]).into_iter().filter(|&s| s != NONE).max();
                let Some(creator) = newest else {
                    let found = base.binary_search_by_key(&tet, |entry| entry.0).map_err(|_| torn(i))?;
                    arcs.source[at] = Source::Base(base[found].1);
                    continue;
                };
                let mut candidates = self.steps[creator as usize].inserted.clone();
                let from = candidates.find(|&from| sorted(self.tets[from]) == tet).ok_or_else(|| torn(i))?;
                if std::mem::replace(&mut gone[from], true) {
                    return Err(torn(i));
                }
                arcs.source[at] = Source::Inserted(from);
                arcs.creator[at] = creator;
            }
            step_of[step.vertex as usize] = i;
        }
        Ok(arcs)
    }

    /// Errors by insertion and field that are at least those of all insertions that depend on each, by so much more that selection by isovalue
    /// and by box is monotone: see [`Quantized::overshoot`], and `step_of_boundary` in the builders' costs.
    fn monotone_errors(&self, quantized: &Quantized, arcs: &Arcs, floors: &[f64]) -> Vec<ErrorCode> {
        // Never zero: error 0 is to mean the reference mesh, with every update applied.
        let fields = quantized.fields.len();
        let own = |(at, error): (usize, &f64)| {
            ErrorCode::at_least(error.max(floors[at % fields])).max(ErrorCode(1))
        };
        let all = self.steps.iter().flat_map(|step| &step.errors).enumerate();
        let mut errors: Vec<ErrorCode> = all.map(own).collect();
        let mut parents: Vec<u32> = Vec::new();
        let step = |at: usize| {
            let Insertion { vertex, inserted, step, .. } = &self.steps[at / fields];
            let around = self.tets[inserted.clone()].iter().flatten().filter(|&v| v != vertex);
            quantized.overshoot(&[*vertex], around, at % fields).max(*step)
        };
        let more: Vec<f64> = (0..errors.len()).map(step).collect();
        for i in (0..self.steps.len()).rev() {
            let removed = self.steps[i].removed.clone();
            parents.clear();
            parents.extend(arcs.creator[removed].iter().filter(|&&p| p != NONE));
            parents.sort_unstable();
            parents.dedup();
            for p in parents.iter().map(|&p| p as usize) {
                for (own, above) in (i * fields..(i + 1) * fields).zip(p * fields..) {
                    let least = ErrorCode::at_least(errors[own].error() + more[above]);
                    errors[above] = errors[above].max(least);
                }
            }
        }
        errors
    }
}

/// Where a removed tetrahedron comes from.
#[derive(Clone, Copy, Debug)]
enum Source {
    /// The base mesh: its place in [`Sequence::base`].
    Base(u32),
    /// An insertion: its place in [`Sequence::tets`].
    Inserted(usize),
}

impl Source {
    /// The number of the tetrahedron in the MT.
    fn number(self, base_ids: &[u32], ids: &[u32]) -> u32 {
        match self {
            Self::Base(place) => base_ids[place as usize],
            Self::Inserted(at) => ids[at],
        }
    }
}

/// For each entry of [`Sequence::tets`] that is removed: its origin.
struct Arcs {
    /// Where a removed tetrahedron comes from.
    source: Vec<Source>,
    /// Which insertion made a removed tetrahedron; [`NONE`] for the base mesh.
    creator: Vec<u32>,
}

fn sorted(mut tet: [u32; 4]) -> [u32; 4] {
    tet.sort_unstable();
    tet
}

/// A builder's sequence contradicts itself: a bug.
fn torn(step: u32) -> BuildError {
    BuildError::Internal(UpdateError::Cavity { update: step })
}
