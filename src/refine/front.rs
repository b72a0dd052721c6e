//! The front: which updates are applied, and how it moves when the request changes.

use super::Criterion;
use crate::mt::Applied;
use crate::mt::BaseMeshError;
use crate::mt::CurrentMesh;
use crate::mt::ErrorCode;
use crate::mt::MultiTessellation;
use crate::mt::UpdateError;
use crate::mt::UpdateId;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A consistent set of updates and its current mesh.
///
/// [`Front::satisfy`] moves it to the set that a criterion asks for; what comes out is the same as from the base
/// mesh, whatever was asked for before.
#[derive(Clone, Debug)]
pub struct Front {
    mesh: CurrentMesh,
    applied: Vec<u64>,
    applied_count: u32,
    /// How many updates of the MT the mesh knows of.
    known: u32,
}

/// What [`Front::satisfy`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Updates applied on the way.
    pub refined: u64,
    /// Updates undone on the way.
    pub coarsened: u64,
    /// The largest error left in the selected part.
    pub error: ErrorCode,
    /// Whether that is within what was asked for; false when the budget did not allow it, or data is missing.
    pub satisfied: bool,
}

/// The importance of an update: larger errors first, ties coarse to fine. Parents rank before their children.
type Rank = (ErrorCode, Reverse<UpdateId>);

fn rank(mt: &impl MultiTessellation, u: UpdateId) -> Rank {
    (mt.error(u), Reverse(u))
}

impl Front {
    /// The base mesh of `mt`: no update applied.
    ///
    /// # Errors
    /// If the base mesh is not a valid mesh, or does not fit its description.
    pub fn new(mt: &impl MultiTessellation) -> Result<Self, BaseMeshError> {
        let mesh = mt.start()?;
        Ok(Self { mesh, applied: Vec::new(), applied_count: 0, known: 0 })
    }

    /// The current mesh; packed after [`Front::satisfy`].
    pub fn mesh(&self) -> &CurrentMesh {
        &self.mesh
    }

    /// The current mesh, for what changes nothing but its records, like taking the list of changes.
    pub(crate) fn mesh_mut(&mut self) -> &mut CurrentMesh {
        &mut self.mesh
    }

    /// Number of updates applied.
    pub fn applied_count(&self) -> u32 {
        self.applied_count
    }

    /// Whether update `u` is applied.
    #[inline]
    pub fn contains(&self, u: UpdateId) -> bool {
        self.applied.get(u.0 as usize / 64).is_some_and(|w| w >> (u.0 % 64) & 1 == 1)
    }

    /// Moves to the smallest consistent set that satisfies `criterion`; with a `budget` of tetrahedra, to the one
    /// of the smallest error threshold that fits, but never below the base mesh.
    ///
    /// # Errors
    /// If the MT turns out to be damaged. The mesh is then valid still, but no answer to the request.
    pub fn satisfy(
        &mut self,
        mt: &impl MultiTessellation,
        criterion: &impl Criterion,
        budget: Option<u32>,
    ) -> Result<Outcome, UpdateError> {
        mt.announce(&mut self.mesh, self.known);
        self.known = mt.updates();
        self.applied.resize(self.known.div_ceil(64) as usize, 0);
        let mut outcome = Outcome::default();
        let moved = self.move_to(mt, criterion, budget, &mut outcome);
        self.mesh.compact();
        moved?;
        outcome.error = self.largest_error(mt, criterion);
        outcome.satisfied = outcome.error <= criterion.tolerance();
        Ok(outcome)
    }

    fn move_to(
        &mut self,
        mt: &impl MultiTessellation,
        criterion: &impl Criterion,
        budget: Option<u32>,
        outcome: &mut Outcome,
    ) -> Result<(), UpdateError> {
        // Where updates may make the mesh smaller, several thresholds fit a budget with larger ones between them: only
        // from the base mesh is the first one found for sure.
        if !criterion.is_monotone() || budget.is_some() && !mt.always_grows() {
            self.coarsen_all(mt, outcome)?;
        }
        match budget {
            Some(budget) => Budgeted::new(self, mt, criterion, outcome).run(budget as usize),
            None if criterion.is_uniform() => self.satisfy_uniform(mt, criterion.tolerance(), outcome),
            None => self.satisfy_selective(mt, criterion, outcome),
        }
    }

    /// Back to the base mesh: children have larger numbers than their parents.
    fn coarsen_all(&mut self, mt: &impl MultiTessellation, outcome: &mut Outcome) -> Result<(), UpdateError> {
        for u in (0..self.known).rev().map(UpdateId) {
            if self.contains(u) {
                self.coarsen(mt, u, outcome)?;
                self.mesh.clear_touched();
            }
        }
        Ok(())
    }

    /// Errors are monotone, so the wanted set is known outright and its order is that of the numbers.
    fn satisfy_uniform(
        &mut self,
        mt: &impl MultiTessellation,
        tolerance: ErrorCode,
        outcome: &mut Outcome,
    ) -> Result<(), UpdateError> {
        for u in (0..self.known).rev().map(UpdateId) {
            if mt.error(u) <= tolerance && self.contains(u) {
                self.coarsen(mt, u, outcome)?;
                self.mesh.clear_touched();
            }
        }
        for u in (0..self.known).map(UpdateId) {
            if mt.error(u) > tolerance && !self.contains(u) {
                self.refine(mt, u, outcome)?;
                self.mesh.clear_touched();
            }
        }
        Ok(())
    }

    fn satisfy_selective(
        &mut self,
        mt: &impl MultiTessellation,
        criterion: &impl Criterion,
        outcome: &mut Outcome,
    ) -> Result<(), UpdateError> {
        self.coarsen_unneeded(mt, criterion, outcome, |_| {})?;
        let mut open: Vec<u32> = (0..self.mesh.tet_slots() as u32).rev().collect();
        while let Some(t) = open.pop() {
            if let Some(u) = self.violation(mt, criterion, t) {
                self.force(mt, u, outcome, |_| {})?;
                open.extend(self.mesh.touched());
                self.mesh.clear_touched();
            }
        }
        Ok(())
    }

    /// Undoes all applied updates that nothing asks for. `kept` is told of those that are asked for themselves and
    /// have no child applied. Children have larger numbers, so one pass downwards is enough.
    fn coarsen_unneeded(
        &mut self,
        mt: &impl MultiTessellation,
        criterion: &impl Criterion,
        outcome: &mut Outcome,
        mut kept: impl FnMut(UpdateId),
    ) -> Result<(), UpdateError> {
        for u in (0..self.known).rev().map(UpdateId) {
            if !self.contains(u) || !mt.may_coarsen(&self.mesh, u) {
                continue;
            }
            match self.need(mt, criterion, u)? {
                Need::Asked => kept(u),
                Need::Blocked => {}
                Need::Nothing => self.coarsen(mt, u, outcome)?,
            }
            self.mesh.clear_touched();
        }
        Ok(())
    }

    /// The update that has to remove tetrahedron `t`, if it violates the criterion.
    #[inline]
    fn violation(&self, mt: &impl MultiTessellation, criterion: &impl Criterion, t: u32) -> Option<UpdateId> {
        let tet = self.mesh.tet(t)?;
        let u = mt.remover(&self.mesh, t)?;
        let error = mt.error(u);
        (error > criterion.tolerance() && self.selects(criterion, &tet, error)).then_some(u)
    }

    #[inline]
    fn selects(&self, criterion: &impl Criterion, tet: &[u32; 4], error: ErrorCode) -> bool {
        if criterion.is_uniform() {
            return true;
        }
        let corners = tet.map(|v| self.mesh.positions()[v as usize]);
        let levels = tet.map(|v| self.mesh.levels(v)[criterion.field()]);
        criterion.selects(&corners, &levels, error)
    }

    /// What an applied update is there for.
    fn need(
        &mut self,
        mt: &impl MultiTessellation,
        criterion: &impl Criterion,
        u: UpdateId,
    ) -> Result<Need, UpdateError> {
        let error = mt.error(u);
        let mut asked = false;
        let mut look = |corners: &[[i32; 3]; 4], levels: &[i32; 4]| {
            asked = error > criterion.tolerance()
                && (criterion.is_uniform() || criterion.selects(corners, levels, error));
            asked
        };
        Ok(match mt.look_at_removed(&mut self.mesh, u, criterion.field(), &mut look)? {
            Applied::Blocked(_) => Need::Blocked,
            Applied::Done if asked => Need::Asked,
            Applied::Done => Need::Nothing,
        })
    }

    /// Applies `u` and all that it depends on, telling `done` of each in turn.
    fn force(
        &mut self,
        mt: &impl MultiTessellation,
        u: UpdateId,
        outcome: &mut Outcome,
        mut done: impl FnMut(UpdateId),
    ) -> Result<(), UpdateError> {
        let mut stack = vec![u];
        while let Some(&top) = stack.last() {
            match mt.refine(&mut self.mesh, top)? {
                Applied::Done => {
                    self.note(top, true);
                    outcome.refined += 1;
                    done(top);
                    stack.pop();
                }
                // Numbers fall from child to parent, so this ends.
                Applied::Blocked(parent) if parent < top => stack.push(parent),
                Applied::Blocked(_) => return Err(UpdateError::Error { update: top.0 }),
            }
        }
        Ok(())
    }

    /// Applies `u`, whose parents are applied.
    #[inline]
    fn refine(
        &mut self,
        mt: &impl MultiTessellation,
        u: UpdateId,
        outcome: &mut Outcome,
    ) -> Result<(), UpdateError> {
        match mt.refine(&mut self.mesh, u)? {
            Applied::Done => self.note(u, true),
            Applied::Blocked(_) => return Err(UpdateError::Error { update: u.0 }),
        }
        outcome.refined += 1;
        Ok(())
    }

    /// Undoes `u`, none of whose children is applied.
    #[inline]
    fn coarsen(
        &mut self,
        mt: &impl MultiTessellation,
        u: UpdateId,
        outcome: &mut Outcome,
    ) -> Result<(), UpdateError> {
        match mt.coarsen(&mut self.mesh, u)? {
            Applied::Done => self.note(u, false),
            Applied::Blocked(_) => return Err(UpdateError::Error { update: u.0 }),
        }
        outcome.coarsened += 1;
        Ok(())
    }

    #[inline]
    fn note(&mut self, u: UpdateId, applied: bool) {
        let (word, bit) = (u.0 as usize / 64, 1 << (u.0 % 64));
        if applied {
            self.applied[word] |= bit;
            self.applied_count += 1;
        } else {
            self.applied[word] &= !bit;
            self.applied_count -= 1;
        }
    }

    /// The largest error among the selected tetrahedra. Those whose update has not arrived yet have at most the
    /// error of the last one that has: errors never grow from one update to the next.
    fn largest_error(&self, mt: &impl MultiTessellation, criterion: &impl Criterion) -> ErrorCode {
        let to_come = match mt.updates() {
            n if n >= mt.info().updates => ErrorCode::ZERO,
            0 => ErrorCode::MAX,
            n => mt.error(UpdateId(n - 1)),
        };
        let mut largest = ErrorCode::ZERO;
        for (t, tet) in (0..).zip(self.mesh.tets()) {
            let error = match mt.remover(&self.mesh, t) {
                Some(u) => mt.error(u),
                None => to_come,
            };
            if error > largest && self.selects(criterion, tet, error) {
                largest = error;
            }
        }
        largest
    }
}

/// What an applied update is there for.
enum Need {
    /// The request asks for it.
    Asked,
    /// A child depends on it.
    Blocked,
    /// Nothing: it can be undone.
    Nothing,
}

/// One run under a budget: two queues over the front, as in the paper. The most important violation is forced; when
/// that exceeds the budget, the least important of what the request asks for is undone.
struct Budgeted<'a, M, C> {
    front: &'a mut Front,
    mt: &'a M,
    criterion: &'a C,
    outcome: &'a mut Outcome,
    /// Violating tetrahedra by the rank of the update that removes them.
    refinable: BinaryHeap<(Rank, u32)>,
    /// Applied updates that may be without applied children, least important first.
    coarsenable: BinaryHeap<Reverse<Rank>>,
}

impl<'a, M: MultiTessellation, C: Criterion> Budgeted<'a, M, C> {
    fn new(front: &'a mut Front, mt: &'a M, criterion: &'a C, outcome: &'a mut Outcome) -> Self {
        Self { front, mt, criterion, outcome, refinable: BinaryHeap::new(), coarsenable: BinaryHeap::new() }
    }

    fn run(mut self, budget: usize) -> Result<(), UpdateError> {
        let Self { front, mt, criterion, outcome, coarsenable, .. } = &mut self;
        front.coarsen_unneeded(*mt, *criterion, outcome, |u| coarsenable.push(Reverse(rank(*mt, u))))?;
        for t in 0..self.front.mesh.tet_slots() as u32 {
            self.push_violation(t);
        }
        self.trim(budget, None)?;
        while let Some((u, t)) = self.refinable.pop().map(|((_, Reverse(u)), t)| (u, t)) {
            if self.front.violation(self.mt, self.criterion, t) != Some(u) {
                continue;
            }
            let Self { front, mt, outcome, coarsenable, .. } = &mut self;
            front.force(*mt, u, outcome, |done| coarsenable.push(Reverse(rank(*mt, done))))?;
            self.push_touched();
            if self.trim(budget, Some(u))? {
                break;
            }
        }
        Ok(())
    }

    fn push_violation(&mut self, t: u32) {
        if let Some(u) = self.front.violation(self.mt, self.criterion, t) {
            self.refinable.push((rank(self.mt, u), t));
        }
    }

    fn push_touched(&mut self) {
        for i in 0..self.front.mesh.touched().len() {
            self.push_violation(self.front.mesh.touched()[i]);
        }
        self.front.mesh.clear_touched();
    }

    /// Undoes the least important updates until the budget is kept. Tells whether `last` was among them.
    fn trim(&mut self, budget: usize, last: Option<UpdateId>) -> Result<bool, UpdateError> {
        let mut reached = false;
        while self.front.mesh.tet_count() > budget {
            let Some(Reverse((_, Reverse(u)))) = self.coarsenable.pop() else { break };
            if !self.front.contains(u) {
                continue;
            }
            match self.front.need(self.mt, self.criterion, u)? {
                // It comes back when the child that is in the way goes.
                Need::Blocked => {}
                Need::Asked | Need::Nothing => {
                    self.undo(u)?;
                    reached |= last == Some(u);
                }
            }
        }
        Ok(reached)
    }

    /// Undoes `u` and whatever was there only for its sake.
    fn undo(&mut self, u: UpdateId) -> Result<(), UpdateError> {
        let mut idle = vec![u];
        while let Some(u) = idle.pop() {
            if !self.front.contains(u) {
                continue;
            }
            self.front.coarsen(self.mt, u, self.outcome)?;
            let parents = self.parents_of_touched();
            self.push_touched();
            for parent in parents {
                match self.front.need(self.mt, self.criterion, parent)? {
                    Need::Blocked => {}
                    Need::Asked => self.coarsenable.push(Reverse(rank(self.mt, parent))),
                    Need::Nothing => idle.push(parent),
                }
            }
        }
        Ok(())
    }

    /// The updates that created the tetrahedra just changed.
    fn parents_of_touched(&self) -> Vec<UpdateId> {
        let mesh = &self.front.mesh;
        let live = mesh.touched().iter().filter(|&&t| mesh.tet(t).is_some());
        let mut parents: Vec<u32> = live.filter_map(|&t| self.mt.creator(mesh, t)).map(|u| u.0).collect();
        parents.sort_unstable();
        parents.dedup();
        parents.into_iter().map(UpdateId).collect()
    }
}
