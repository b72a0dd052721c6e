//! From one kind of MT to another that can hold the same updates.

use super::{
    ConvertError, EdgeMt, EdgeMtBuilder, ExplicitMt, HalfEdgeMt, MAX_STAR, Mt, MtKind, MultiTessellation,
    Regions, ReplayError, UpdateError, UpdateId, VertexId, VertexMt, VertexSplit,
};
use crate::mt::replay::canonical;

impl Mt {
    /// The updates as an MT of another kind, in as many blocks as that kind usually has: see [`Mt::in_pages`].
    ///
    /// # Errors
    /// If that kind cannot hold them.
    pub fn convert(&self, to: MtKind) -> Result<Self, ConvertError> {
        let from = self.info().kind;
        match (from, to) {
            _ if from == to => Ok(self.clone()),
            _ if self.regions().is_some_and(Regions::has_sides) => Err(ConvertError::Sides { to }),
            // Both are made of vertex insertions.
            (MtKind::Vertex, MtKind::HalfEdge) | (MtKind::HalfEdge, MtKind::Vertex) => {
                ExplicitMt::of(self)?.compact(to)
            }
            _ => Err(ConvertError::Kinds { from, to }),
        }
    }
}

impl ExplicitMt {
    /// The updates as a compact MT, in as many blocks as its kind usually has.
    ///
    /// # Errors
    /// If that kind cannot hold them.
    pub fn compact(&self, to: MtKind) -> Result<Mt, ConvertError> {
        Ok(match to {
            MtKind::Edge => EdgeMt::from_explicit(self)?.into(),
            MtKind::Vertex => VertexMt::from_explicit(self)?.into(),
            MtKind::HalfEdge => HalfEdgeMt::from_explicit(self, to.usual_block_bits())?.into(),
        })
    }
}

impl EdgeMt {
    /// The compact MT of the same updates, all of which must be vertex splits by the midpoint rule that create the
    /// vertices that come next.
    ///
    /// # Errors
    /// The first update that is not.
    pub fn from_explicit(explicit: &ExplicitMt) -> Result<Self, ConvertError> {
        let (info, base) = (explicit.info().clone(), explicit.base().clone());
        let mut builder = EdgeMtBuilder::new(info, base).map_err(ReplayError::from)?;
        let mut field_offsets = Vec::new();
        for u in (0..explicit.updates()).map(UpdateId) {
            let refused = |why| ConvertError::Update { update: u.0, why };
            let split = as_split(explicit, builder.mt(), u, &mut field_offsets).map_err(refused)?;
            builder.push(&split).map_err(|error| refused(why_refused(&error)))?;
        }
        // What a mask makes depends on the mesh, too.
        let mt = builder.finish();
        let made = ExplicitMt::of(&mt)?;
        let differs = |u: &UpdateId| !same(&made, explicit, *u);
        match (0..explicit.updates()).map(UpdateId).find(differs) {
            Some(u) => Err(ConvertError::Update { update: u.0, why: NOT_A_SPLIT }),
            None => Ok(mt),
        }
    }
}

const NOT_A_SPLIT: &str = "it is not the split of a vertex in two";

/// Splits that cannot be applied are not those of the explicit MT.
fn why_refused(error: &UpdateError) -> &'static str {
    match error {
        UpdateError::Vertex { .. } | UpdateError::OffLattice { .. } => "its vertex or offset is not allowed",
        _ => NOT_A_SPLIT,
    }
}

/// Whether update `u` is the same in both, by the tetrahedra that it removes and inserts.
fn same(a: &ExplicitMt, b: &ExplicitMt, u: UpdateId) -> bool {
    let inserted = |mt: &ExplicitMt| {
        let range = mt.inserted(u);
        mt.tets()[range.start as usize..range.end as usize].to_vec()
    };
    a.removed(u) == b.removed(u) && inserted(a) == inserted(b)
}

/// Update `u` as a split, from its own tetrahedra; `mt` holds the ones before it. `field_offsets` gets those of the levels.
fn as_split<'a>(
    explicit: &'a ExplicitMt,
    mt: &EdgeMt,
    u: UpdateId,
    field_offsets: &'a mut Vec<i32>,
) -> Result<VertexSplit<'a>, &'static str> {
    let removed: Vec<[u32; 4]> = explicit.removed(u).iter().map(|&t| explicit.tets()[t as usize]).collect();
    let range = explicit.inserted(u);
    let inserted = &explicit.tets()[range.start as usize..range.end as usize];
    let created = mt.created(u);
    let has = |v: VertexId| v.0 < explicit.vertices() && inserted.iter().any(|tet| tet.contains(&v.0));
    if !created.into_iter().all(has) {
        return Err("it does not create the two vertices that come next");
    }
    if removed.len() > MAX_STAR {
        return Err("it removes more than 64 tetrahedra");
    }
    let vertex = vanished(&removed, inserted).ok_or(NOT_A_SPLIT)?;
    let [near, far] = created;
    let offset = midpoint(&explicit.position(vertex), &explicit.position(near), &explicit.position(far));
    let levels = midpoint(explicit.levels(vertex), explicit.levels(near), explicit.levels(far));
    let (Some(offset), Some(levels)) = (offset, levels) else {
        return Err("the vertex that it splits is not half way between those that it creates");
    };
    let offset = [offset[0], offset[1], offset[2]];
    let mask = mask(&removed, inserted, vertex.0, far.0);
    *field_offsets = levels;
    Ok(VertexSplit { vertex, offset, field_offsets, mask, errors: explicit.errors(u) })
}

/// The one vertex that all removed tetrahedra have and no inserted one.
fn vanished(removed: &[[u32; 4]], inserted: &[[u32; 4]]) -> Option<VertexId> {
    let in_all = |v: &&u32| removed.iter().all(|tet| tet.contains(v));
    let vertex = *removed.first()?.iter().filter(in_all).find(|v| !inserted.as_flattened().contains(v))?;
    Some(VertexId(vertex))
}

/// `near − far` of each coordinate or level if `whole` is their midpoint, rounded as splits do.
fn midpoint(whole: &[i32], near: &[i32], far: &[i32]) -> Option<Vec<i32>> {
    let halves = near.iter().zip(far).map(|(a, b)| a - b);
    let offsets: Vec<i32> = halves.collect();
    let fits = |((v, b), d): ((&i32, &i32), &i32)| *v == b + (d >> 1);
    whole.iter().zip(far).zip(&offsets).all(fits).then_some(offsets)
}

/// Bit `i` is 1 where tetrahedron `i` of the star, in the order of the faces opposite `vertex`, goes to `far`.
fn mask(removed: &[[u32; 4]], inserted: &[[u32; 4]], vertex: u32, far: u32) -> u64 {
    let mut star: Vec<([u32; 3], bool)> = removed
        .iter()
        .map(|tet| {
            let at_far = canonical(tet.map(|v| if v == vertex { far } else { v }));
            let mut sorted = *tet;
            sorted.sort_unstable();
            let mut rest = sorted.into_iter().filter(|&v| v != vertex);
            let face = [(); 3].map(|()| rest.next().unwrap_or(vertex));
            (face, inserted.binary_search(&at_far).is_ok())
        })
        .collect();
    star.sort_unstable();
    (0..).zip(star).fold(0, |mask, (i, (_, is_far))| mask | u64::from(is_far) << i)
}
