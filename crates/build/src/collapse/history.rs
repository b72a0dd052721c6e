//! From recorded collapses to the updates of an MT.

use crate::change::collapse_check::CheckedCollapse;
use crate::change::work_mesh::WorkMesh;
use crate::error::cost::VertexData;
use crate::order::base::{Numbered, number_base};
use crate::order::update_order::Updates;
use crate::{BuildError, BuildProgress, OnProgress};
use std::cmp::Reverse;
use tetralod::mesh::NONE;
use tetralod::mt::{
    ApplyUpdates, CurrentMesh, EdgeMt, EdgeMtBuilder, ErrorCode, Margins, MtInfo, MultiTessellation,
    UpdateError, UpdateId, VertexId, VertexSplit,
};

/// One collapse in the builder's own numbers: the `i`-th one makes vertex `points + i`.
pub(crate) struct Collapse {
    ends: [u32; 2],
    /// Sides of the star in ascending order of the builder's sorted numbers of the opposite faces.
    sides: u64,
    /// The largest one of all fields.
    error: ErrorCode,
    /// How far the boundary at each end is outside of the new one, as an error.
    steps: [f64; 2],
}

impl Collapse {
    /// Records a plan that is about to be carried out in `mesh`.
    pub fn new(collapse: &CheckedCollapse, mesh: &WorkMesh, error: ErrorCode, steps: [f64; 2]) -> Self {
        let mut star: Vec<([u32; 3], u8)> = Vec::with_capacity(collapse.stay.len());
        for &(s, side) in &collapse.stay {
            let tet = mesh.tets[s.tet as usize];
            let [i, j, k] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]][s.corner as usize];
            let mut face = [tet[i], tet[j], tet[k]];
            face.sort_unstable();
            star.push((face, side));
        }
        star.sort_unstable();
        let sides = star.iter().enumerate().fold(0, |bits, (i, &(_, side))| bits | u64::from(side) << i);
        Self { ends: [collapse.a, collapse.b], sides, error, steps }
    }
}

/// The MT of a history, with its updates in the order that [`Updates::order`] gives them, and its vertex for each reference
/// point. Blocks of its file have `2^block_bits` updates, 4 to 16 bits.
pub(crate) fn edge_mt(
    mut info: MtInfo,
    base: &WorkMesh,
    data: &VertexData,
    history: &[Collapse],
    block_bits: u32,
    progress: OnProgress<'_>,
) -> Result<(EdgeMt, Vec<VertexId>), BuildError> {
    let block_bits = block_bits.clamp(4, 16);
    info.updates = history.len() as u32;
    // Errors are monotone, so this extends the partial order, as far as equal errors leave it open by the collapses
    // reversed.
    let mut falling: Vec<u32> = (0..history.len() as u32).rev().collect();
    falling.sort_by_key(|&i| Reverse(history[i as usize].error));
    let mut replay = Replay { base, data, history, errors: stored(&info, data, history.len()) };
    let bits = info.lattice.bits;
    let mut found = Found::new(&info);
    let (first, _) = replay.make(info.clone(), &falling, Some(&mut found), progress)?;
    let updates = Updates {
        base: first.base().positions.len() as u32,
        vertices: &found.vertices,
        starts: &found.starts,
        parents: &found.parents,
        sites: &found.sites,
        bits,
    };
    let order: Vec<u32> = updates.order(block_bits).into_iter().map(|u| falling[u as usize]).collect();
    drop(first);
    replay.restore_margins(&falling, &found);
    let (mut mt, vertices) = replay.make(info, &order, None, progress)?;
    mt.set_page_bits(block_bits);
    Ok((mt, vertices))
}

/// The errors that files hold, by collapse and field: rounded up to few digits.
fn stored(info: &MtInfo, data: &VertexData, collapses: usize) -> Vec<ErrorCode> {
    let made = info.vertices as usize * info.fields.len()..;
    let errors = &data.errors[made][..collapses * info.fields.len()];
    errors.iter().map(|&error| ErrorCode::at_least(error).coarse()).collect()
}

/// What a first replay of a history finds out: for [`Updates`], and for [`Replay::restore_margins`].
struct Found {
    vertices: Vec<u32>,
    starts: Vec<u32>,
    parents: Vec<u32>,
    sites: Vec<[i32; 3]>,
    margins: Margins,
    /// By entry of `parents` and field: the levels by which what the update removes of what that parent created is beyond the range
    /// of what the parent removes.
    beyond: Vec<i32>,
    /// By entry of `parents`: whether the update removes something at the first and at the second vertex that the parent created.
    at_ends: Vec<[bool; 2]>,
}

impl Found {
    fn new(info: &MtInfo) -> Self {
        Self {
            vertices: Vec::new(),
            starts: vec![0],
            parents: Vec::new(),
            sites: Vec::new(),
            margins: Margins::new(info),
            beyond: Vec::new(),
            at_ends: Vec::new(),
        }
    }

    /// Records an update before it is applied.
    fn note(&mut self, mt: &EdgeMt, mesh: &mut CurrentMesh, u: UpdateId) -> Result<(), UpdateError> {
        let vertex = mt.update(u).vertex;
        let star = mt.find_removed(mesh, u)?;
        let (mut parents, mut beyond) = (Vec::new(), Vec::new());
        self.margins.next(mt, mesh, &star, &mut parents, &mut beyond);
        let corners: Vec<u32> =
            star.iter().filter_map(|&t| mesh.tet(t)).flatten().map(|slot| mesh.vertex(slot).0).collect();
        let at_ends = |p: &UpdateId| mt.created(*p).map(|v| corners.contains(&v.0));
        self.at_ends.extend(parents.iter().map(at_ends));
        self.parents.extend(parents.iter().map(|p| p.0));
        self.beyond.append(&mut beyond);
        self.starts.push(self.parents.len() as u32);
        self.vertices.push(vertex.0);
        self.sites.push(mesh.slot(vertex).map_or([0; 3], |slot| mesh.positions()[slot as usize]));
        Ok(())
    }
}

/// One in so many errors, the largest ones, is not rounded when it is raised.
const LARGE: usize = 8;

/// Collapses that are to become updates.
struct Replay<'a> {
    base: &'a WorkMesh,
    data: &'a VertexData,
    history: &'a [Collapse],
    /// The errors to store, by collapse and field.
    errors: Vec<ErrorCode>,
}

impl Replay<'_> {
    /// Raises errors until those of parents are as much larger as the selection by values and by place relies on: rounding them up
    /// took some of that away. `found` is of the collapses in the order `falling`.
    ///
    /// Raised errors are rounded up again, except the largest ones: along a chain of updates, repeated rounding would
    /// multiply them. There are few of these, and each takes one more byte in a file.
    fn restore_margins(&mut self, falling: &[u32], found: &Found) {
        let fields = found.margins.fields();
        let fine: Vec<ErrorCode> = (0..fields).map(|f| self.largest_from(f)).collect();
        // Children first.
        for u in (0..falling.len()).rev() {
            let own = falling[u] as usize * fields;
            for arc in found.starts[u] as usize..found.starts[u + 1] as usize {
                let above = falling[found.parents[arc] as usize] as usize;
                let ends = self.steps(above).into_iter().zip(found.at_ends[arc]);
                let step = ends.filter(|(_, is_there)| *is_there).map(|(step, _)| step).fold(0.0, f64::max);
                for (f, &fine) in fine.iter().enumerate() {
                    let margin = found.margins.error_of(f, found.beyond[arc * fields + f]).max(step);
                    let least = ErrorCode::at_least(self.errors[own + f].error() + margin);
                    let least = if least > fine { least } else { least.coarse() };
                    let above = &mut self.errors[above * fields + f];
                    *above = (*above).max(least);
                }
            }
        }
    }

    /// The error from which on a field has its largest ones: one in [`LARGE`].
    fn largest_from(&self, field: usize) -> ErrorCode {
        let fields = self.errors.len() / self.history.len().max(1);
        // Errors stand collapse by collapse; those of this field begin at its own place in the first one.
        let mut errors: Vec<ErrorCode> =
            self.errors.iter().skip(field).step_by(fields.max(1)).copied().collect();
        errors.sort_unstable();
        errors.iter().rev().nth(errors.len() / LARGE).copied().unwrap_or(ErrorCode::MAX)
    }

    fn difference(&self, ends: [u32; 2]) -> [i32; 3] {
        let [p, q] = ends.map(|v| self.data.positions[v as usize]);
        [0, 1, 2].map(|k| p[k] - q[k])
    }

    /// Which end is which is free: the offset begins with a positive number, so files do not store its sign.
    fn is_turned(&self, collapse: usize) -> bool {
        self.difference(self.history[collapse].ends).into_iter().find(|&d| d != 0).is_some_and(|d| d < 0)
    }

    /// [`Collapse::steps`] in the order in which the split creates the ends.
    fn steps(&self, collapse: usize) -> [f64; 2] {
        let [a, b] = self.history[collapse].steps;
        if self.is_turned(collapse) { [b, a] } else { [a, b] }
    }

    /// The MT whose updates are the collapses in this order, which extends the partial order.
    fn make(
        &self,
        info: MtInfo,
        order: &[u32],
        mut found: Option<&mut Found>,
        progress: OnProgress<'_>,
    ) -> Result<(EdgeMt, Vec<VertexId>), BuildError> {
        let (points, fields) = (info.vertices as usize, info.fields.len());
        let live = (0..self.base.tets.len() as u32).filter(|&t| self.base.is_live(t));
        let tets: Vec<[u32; 4]> = live.map(|t| self.base.tets[t as usize]).collect();
        let Numbered { mesh: base_mesh, number, .. } =
            number_base(&self.data.positions, &self.data.levels, fields, &tets);
        let mut builder = EdgeMtBuilder::new(info, base_mesh)
            .map_err(|_| BuildError::Internal(UpdateError::Vertex { update: 0, vertex: 0 }))?;
        let mut numbers = Numbers::new(number);
        for (done, &i) in order.iter().enumerate() {
            BuildProgress::tell_ordered(done, self.history.len(), progress)?;
            let appended = self.append(&mut builder, &mut numbers, i as usize, found.as_deref_mut());
            appended.map_err(BuildError::Internal)?;
        }
        numbers.of_mt.truncate(points);
        Ok((builder.finish(), numbers.of_mt.into_iter().map(VertexId).collect()))
    }

    /// Appends a collapse as an update, and shows it to `found`.
    fn append(
        &self,
        builder: &mut EdgeMtBuilder,
        numbers: &mut Numbers,
        collapse: usize,
        found: Option<&mut Found>,
    ) -> Result<UpdateId, UpdateError> {
        let (levels, fields) = (&self.data.levels, builder.mt().info().fields.len());
        let Collapse { ends: [mut a, mut b], sides, .. } = self.history[collapse];
        let vertex = VertexId(numbers.of_mt[self.data.positions.len() - self.history.len() + collapse]);
        let is_turned = self.is_turned(collapse);
        if is_turned {
            (a, b) = (b, a);
        }
        numbers.add(a);
        numbers.add(b);
        let offset = |f: usize| levels[a as usize * fields + f] - levels[b as usize * fields + f];
        let field_offsets: Vec<i32> = (0..fields).map(offset).collect();
        let update = builder.mt().updates();
        let mask = builder
            .mesh()
            .reorder_mask(vertex, sides, is_turned, |v| numbers.built[v.0 as usize])
            .ok_or(UpdateError::Mask { update })?;
        let split = VertexSplit {
            vertex,
            offset: self.difference([a, b]),
            field_offsets: &field_offsets,
            mask,
            errors: &self.errors[collapse * fields..][..fields],
        };
        builder.push_seen(&split, |mt, mesh, u| match found {
            Some(found) => found.note(mt, mesh, u),
            None => Ok(()),
        })
    }
}

/// The numbers of vertices in the builder and in the MT.
struct Numbers {
    /// The MT's number of each vertex of the builder; [`NONE`] for those that are not in the MT yet.
    of_mt: Vec<u32>,
    /// The builder's number of each vertex of the MT.
    built: Vec<u32>,
}

impl Numbers {
    /// The numbers of the base mesh, given those of the MT.
    fn new(of_mt: Vec<u32>) -> Self {
        let mut base: Vec<(u32, u32)> = (0..).zip(&of_mt).map(|(own, &v)| (v, own)).collect();
        base.retain(|&(v, _)| v != NONE);
        base.sort_unstable();
        Self { of_mt, built: base.into_iter().map(|(_, own)| own).collect() }
    }

    /// Gives a vertex of the builder the next number of the MT.
    fn add(&mut self, own: u32) {
        self.of_mt[own as usize] = self.built.len() as u32;
        self.built.push(own);
    }
}
