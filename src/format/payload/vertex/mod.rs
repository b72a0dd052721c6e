//! Vertex insertions, coded as residuals against predictions from the mesh to which they are applied.
//!
//! Writer and reader apply every update to a mesh of their own. An insertion is coded by a vertex near it, its offset from
//! there, and which tetrahedra it removes: these are reached face by face, starting from the one that the new vertex lies
//! in. Parents, the star of the new vertex, and how `u−` builds again what was removed follow from that.

mod cavity;
mod families;
mod numbers;
mod state;
#[cfg(test)]
pub(super) mod tests;

use super::codec::{Codec, Head, InOrder, Parts, Started};
use super::families::{OWN_FALL, QUARTERINGS};
use crate::format::coder::{Family, Put, Source};
use crate::format::error::Result;
use crate::format::header::Kind;
use crate::format::limits::check_bytes;
use crate::format::{FormatError, Limits};
use crate::mt::{
    Applied, ApplyUpdates, BaseMesh, BaseMeshError, ErrorCode, Insertion, Mt, MtInfo, MtKind,
    MultiTessellation, UpdateError, UpdateId, VertexMt,
};
use std::ops::Range;

use families::{ERROR, FAN, GIVEN_UP, GROW, PARTS, SEED};
use numbers::{put_levels, put_one_of, put_position, read_levels, read_one_of, read_position};
use state::{State, grain};

/// The last [`SEED`]: none of them, its place follows.
const ELSEWHERE: u32 = 8;

/// After so many updates their memory is looked at.
const MEASURED: u32 = 16;

impl Codec for VertexMt {
    const KIND: MtKind = MtKind::Vertex;
    const NUMBER: u8 = 1;
    const SECTION: Kind = Kind::INSV;
    const PARTS: Parts = PARTS;
    const HAS_TET_ERRORS: bool = true;

    /// An insertion adds one vertex.
    fn check_counts(info: &MtInfo, base_vertices: u64) -> Result<(), BaseMeshError> {
        let vertices = base_vertices + u64::from(info.updates);
        if vertices != u64::from(info.vertices) {
            return Err(BaseMeshError::Info(
                "base vertices and updates do not add up to the reference vertices",
            ));
        }
        if vertices >= u64::from(u32::MAX) {
            return Err(BaseMeshError::Info("more vertices than 32 bits can number"));
        }
        Ok(())
    }

    /// A vertex, its own loop, the size of what it removes.
    fn least_update_bytes(info: &MtInfo) -> u64 {
        let levels: u64 = info.fields.iter().map(|field| u64::from(field.bits)).sum();
        (3 * u64::from(info.lattice.bits) + levels + 9) / 8 + 4
    }

    /// Puts what all insertions have in common: whether each makes the mesh larger, and the granularity of the coordinates.
    fn put_head(&self, out: &mut impl Put) {
        out.bits(u32::from(self.always_grows()), 1);
        grain(self).iter().for_each(|&x| out.bits(x as u32, 31));
    }

    fn read_head(
        source: &mut Source<'_>,
        _: &MtInfo,
        _: [u32; 2],
        _: u32,
        _: &Limits,
    ) -> Result<Box<dyn Head>> {
        Ok(Box::new(InsertionRules::read(source)?))
    }

    type Writing = State;

    fn writing(&self) -> Result<State, BaseMeshError> {
        State::of(self)
    }

    fn put_block(
        &self,
        out: &mut impl Put,
        mut updates: Range<u32>,
        state: &mut State,
    ) -> Result<(), UpdateError> {
        updates.try_for_each(|u| put_update(out, self, UpdateId(u), state))
    }
}

/// What all insertions of an MT have in common.
#[derive(Clone, Copy, Debug, Default)]
struct InsertionRules {
    always_grows: bool,
    grain: [i32; 3],
}

impl InsertionRules {
    fn read(source: &mut Source<'_>) -> Result<Self> {
        let always_grows = source.bits(1)? == 1;
        let mut grain = [0; 3];
        for x in &mut grain {
            *x = source.bits(31)? as i32;
        }
        if grain.iter().any(|&x| x < 1) {
            return Err(source.corrupt("the granularity of coordinates must be at least 1"));
        }
        Ok(Self { always_grows, grain })
    }
}

impl Head for InsertionRules {
    fn start(
        self: Box<Self>,
        info: MtInfo,
        base: BaseMesh,
        block_bits: u32,
        tet_errors: bool,
    ) -> Result<Started> {
        let mut mt = VertexMt::growing(info, base, self.always_grows, tet_errors)?;
        let state = State::new(&mt, self.grain)?;
        mt.set_page_bits(block_bits);
        Ok((mt.into(), Some(Box::new(state))))
    }
}

impl InOrder for State {
    fn read(&mut self, source: &mut Source<'_>, mt: &mut Mt, count: u32, limits: &Limits) -> Result<()> {
        match mt {
            Mt::Vertex(mt) => (1..=count).try_for_each(|k| {
                read_update(source, mt, self)?;
                let is_measured = k.is_multiple_of(MEASURED) || k == count;
                if is_measured { check_bytes(mt.bytes() + self.mesh.bytes(), limits) } else { Ok(()) }
            }),
            _ => Err(source.corrupt("a section is out of place")),
        }
    }
}

/// Puts the next update.
///
/// # Errors
/// If the MT is damaged, or the update removes what does not hang together.
fn put_update(out: &mut impl Put, mt: &VertexMt, u: UpdateId, state: &mut State) -> Result<(), UpdateError> {
    let torn = UpdateError::Cavity { update: u.0 };
    put_errors(out, ERROR, &mut state.errors, mt.errors(u));
    let removed = mt.find_removed(&mut state.mesh, u)?;
    let position = mt.position(u);
    let (near, fan) = state.near(&removed, position).ok_or(torn.clone())?;
    out.symbol(FAN, 0, u32::from(fan));
    put_one_of(out, near, state.mesh.positions().len() as u32);
    put_position(out, state, near, position);
    state.find_cone(near, position);
    let seed = match state.cone.iter().take(ELSEWHERE as usize).position(|t| removed.contains(t)) {
        Some(at) => {
            out.symbol(SEED, 0, at as u32);
            state.cone[at]
        }
        None => {
            out.symbol(SEED, 0, ELSEWHERE);
            state.sort_star();
            let at = state.star.iter().position(|t| removed.contains(t)).ok_or(torn.clone())?;
            put_one_of(out, at as u32, state.star.len() as u32);
            state.star[at]
        }
    };
    state.grow(seed, fan.then_some(near), position, &mut |t, context| {
        let is_removed = removed.contains(&t);
        out.symbol(GROW, context, u32::from(is_removed));
        Ok::<_, UpdateError>(is_removed)
    })?;
    if state.removed.len() != removed.len() || !removed.iter().all(|t| state.removed.contains(t)) {
        return Err(torn);
    }
    let given_up = mt.given_up(u);
    state.list_given_up(position, &mut |place| {
        let is_given_up = given_up.get(place).copied().unwrap_or(false);
        out.symbol(GIVEN_UP, 0, u32::from(is_given_up));
        Ok::<_, UpdateError>(is_given_up)
    })?;
    put_levels(out, mt, u, state, position);
    if mt.has_tet_errors() {
        let own = |&t: &u32| (mt.quarterings(&state.mesh, t), state.holds(t, position));
        put_quarterings(out, mt.own_fall(u), state.removed.iter().map(own));
    }
    match mt.refine(&mut state.mesh, u)? {
        Applied::Done => state.settle(u.0),
        Applied::Blocked(_) => return Err(torn),
    }
    Ok(())
}

fn read_update(source: &mut Source<'_>, mt: &mut VertexMt, state: &mut State) -> Result<()> {
    read_errors(source, ERROR, &mut state.errors)?;
    let fan = source.symbol(FAN, 0)? == 1;
    let near = read_one_of(source, state.mesh.positions().len() as u32)?;
    if !state.gather(near) {
        return Err(source.corrupt("a vertex is inserted next to one with too many tetrahedra"));
    }
    let position = read_position(source, mt.info(), state, near)?;
    state.find_cone(near, position);
    let seed = match source.symbol(SEED, 0)? {
        ELSEWHERE => {
            state.sort_star();
            let at = read_one_of(source, state.star.len() as u32)?;
            state.star.get(at as usize).copied()
        }
        at => state.cone.get(at as usize).copied(),
    };
    let nothing = "an update removes a tetrahedron that is not there";
    let seed = seed.ok_or_else(|| source.corrupt(nothing))?;
    state.grow(seed, fan.then_some(near), position, &mut |_, context| {
        Ok::<_, FormatError>(source.symbol(GROW, context)? == 1)
    })?;
    state.list_given_up(position, &mut |_| Ok::<_, FormatError>(source.symbol(GIVEN_UP, 0)? == 1))?;
    let levels = read_levels(source, mt.info(), state, position)?;
    let mut own_fall = 0;
    if mt.has_tet_errors() {
        let mut quarterings = std::mem::take(&mut state.quarterings);
        let are_home = state.removed.iter().map(|&t| state.holds(t, position));
        own_fall = read_quarterings(source, &mut quarterings, are_home)?;
        state.quarterings = quarterings;
    }
    let State { mesh, removed, given_up, errors, quarterings, .. } = state;
    let levels = &levels;
    let insertion = Insertion { position, levels, removed, given_up, errors, quarterings, own_fall };
    let update = mt.insert_into(mesh, &insertion)?;
    state.settle(update.0);
    Ok(())
}

/// Puts by how many codes each error of an update is below that of the update before.
fn put_errors(out: &mut impl Put, family: Family, before: &mut [ErrorCode], errors: &[ErrorCode]) {
    for (before, &error) in before.iter_mut().zip(errors) {
        out.number(family, 0, u32::from(before.0.wrapping_sub(error.0)));
        *before = error;
    }
}

/// Turns the errors of the update before into those of the next one.
fn read_errors(source: &mut Source<'_>, family: Family, errors: &mut [ErrorCode]) -> Result<()> {
    for error in errors {
        let fall = u16::try_from(source.number(family, 0)?);
        let fall = fall.map_err(|_| source.corrupt("an error is out of its range"))?;
        error.0 = error.0.wrapping_sub(fall);
    }
    Ok(())
}

/// Puts the own errors of what an update removes: of each tetrahedron its quarterings, and whether it has the new vertex.
fn put_quarterings(out: &mut impl Put, own_fall: u8, removed: impl Iterator<Item = (u8, bool)>) {
    out.symbol(OWN_FALL, 0, u32::from(own_fall));
    let mut before = 0;
    for (own, is_home) in removed {
        out.symbol(QUARTERINGS, 2 * before + u32::from(is_home), u32::from(own));
        before = u32::from(own);
    }
}

/// Reads them, of as many tetrahedra as there are in `are_home`; returns the fall of the own errors.
fn read_quarterings(
    source: &mut Source<'_>,
    quarterings: &mut Vec<u8>,
    are_home: impl Iterator<Item = bool>,
) -> Result<u8> {
    let own_fall = source.symbol(OWN_FALL, 0)? as u8;
    quarterings.clear();
    for is_home in are_home {
        let before = quarterings.last().map_or(0, |&before| u32::from(before));
        quarterings.push(source.symbol(QUARTERINGS, 2 * before + u32::from(is_home))? as u8);
    }
    Ok(own_fall)
}
