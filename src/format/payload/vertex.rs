//! Vertex insertions, coded by what the mesh to which they are applied lets expect of them.
//!
//! Writer and reader apply every update to a mesh of their own. An insertion is told by a vertex near it, where it lies as
//! seen from there, and which tetrahedra around it give way: these are reached face by face, starting from the one that
//! the new vertex lies in. Who is parent of whom, what the node of the update says of its star, and how what it
//! removes is built again follow from that.

use super::{OWN_FALL, QUARTERINGS, base, check_bytes, largest};
use crate::format::coder::{Family, Put, Source};
use crate::format::{FormatError, Limits};
use crate::geom::{NARROW_BITS, insphere, orient3d, views_of_origin};
use crate::mesh::{FACES, NONE};
use crate::mt::{
    Applied, ApplyUpdates, BaseMesh, BaseMeshError, CurrentMesh, ErrorCode, Insertion, MAX_FIELD_BITS,
    MAX_REMOVED, MtInfo, MultiTessellation, UpdateError, UpdateId, UpdatePages, VertexMt, corner_of,
};

/// By how many codes an error is below the one before.
const ERROR: Family = base::LAST.numbers_after(1, 2);
/// Whether all that is removed has the near vertex.
const FAN: Family = ERROR.after(1, 2);
/// How a coordinate differs from that of the near vertex: bits of the difference next to those of what is usual.
const OFFSET: Family = FAN.after(4, 112);
/// Which of the tetrahedra that the new vertex lies in, as seen from the near one, is the first that is removed.
const SEED: Family = OFFSET.after(1, 9);
/// Whether a tetrahedron is removed.
const GROW: Family = SEED.after(108, 2);
/// Whether a face of the boundary is given up that the new vertex sees.
const GIVEN_UP: Family = GROW.after(1, 2);
/// Whether the level is about as far off as the error allows.
const FAR: Family = GIVEN_UP.after(20, 2);
/// How much less than the error it is off, then.
const SHORT: Family = FAR.numbers_after(1, 0);
/// How far the level is from what is expected.
const LEVEL: Family = SHORT.numbers_after(40, 1);
/// The last family of vertex insertions.
pub const LAST: Family = LEVEL;

/// All families, with names for what they tell.
pub const PARTS: [(&str, Family); 9] = [
    ("errors", ERROR),
    ("partial order", FAN),
    ("positions", OFFSET),
    ("partial order", SEED),
    ("partial order", GROW),
    ("partial order", GIVEN_UP),
    ("levels", FAR),
    ("levels", SHORT),
    ("levels", LEVEL),
];

/// The last [`SEED`]: none of them, its place is told.
const ELSEWHERE: u32 = 8;

/// After so many updates their memory is looked at.
const MEASURED: u32 = 16;

/// Most tetrahedra around a near vertex.
const MOST_AROUND: usize = 4096;

/// [`OFFSET`] of a difference with as many bits as usual.
const OFFSET_BIAS: u32 = 40;

/// Bytes that every update takes in memory: a vertex, its own loop, the size of what it removes.
pub fn least_update_bytes(info: &MtInfo) -> u64 {
    let levels: u64 = info.fields.iter().map(|field| u64::from(field.bits)).sum();
    (3 * u64::from(info.lattice.bits) + levels + 9) / 8 + 4
}

/// An insertion adds one vertex.
pub fn check_counts(info: &MtInfo, base_vertices: u64) -> Result<(), BaseMeshError> {
    let vertices = base_vertices + u64::from(info.updates);
    if vertices != u64::from(info.vertices) {
        return Err(BaseMeshError::Info("base vertices and updates do not add up to the reference vertices"));
    }
    if vertices >= u64::from(u32::MAX) {
        return Err(BaseMeshError::Info("more vertices than 32 bits can number"));
    }
    Ok(())
}

/// What writer and reader know when they come to an update: kept from block to block.
#[derive(Debug)]
pub struct State {
    mesh: CurrentMesh,
    /// All coordinates are multiples of these.
    grain: [i32; 3],
    /// Errors of the update before.
    errors: Vec<ErrorCode>,
    /// Whether orientations fit 64 bits.
    narrow: bool,
    /// The tetrahedra around the near vertex.
    star: Vec<u32>,
    /// The other vertices of each, by index into the link, in the order of the face that they make, outward.
    corners: Vec<[u32; 3]>,
    /// These vertices as seen from the near one.
    link: Vec<[i64; 3]>,
    /// Their cross products with the new vertex, seen from there as well.
    turned: Vec<[i64; 3]>,
    /// What is removed.
    removed: Vec<u32>,
    views: Vec<View>,
    /// Whether some of it is on the boundary.
    on_boundary: bool,
    given_up: Vec<[u32; 2]>,
    /// Tetrahedra of the star, in the direction of the new vertex.
    cone: Vec<u32>,
    /// Of what is removed, where it is told.
    quarterings: Vec<u8>,
    /// By tetrahedron: `epoch` if it is in the star, one more if it is removed, two more if it is
    /// not, three more if it cannot be.
    tet_marks: Vec<u32>,
    /// By vertex: `epoch << 32 | index` if it is in the link.
    vertex_marks: Vec<u64>,
    epoch: u32,
}

/// Puts what is to be known of all insertions: whether each makes the mesh larger, and the grain of the coordinates.
pub fn put_head(out: &mut impl Put, mt: &VertexMt) {
    out.bits(u32::from(mt.always_grows()), 1);
    grain(mt).iter().for_each(|&x| out.bits(x as u32, 31));
}

/// What is to be known of all insertions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Head {
    always_grows: bool,
    grain: [i32; 3],
}

/// Reads that.
pub fn read_head(source: &mut Source<'_>) -> Result<Head, FormatError> {
    let always_grows = source.bits(1)? == 1;
    let mut grain = [0; 3];
    for x in &mut grain {
        *x = source.bits(31)? as i32;
    }
    if grain.iter().any(|&x| x < 1) {
        return Err(source.corrupt("coordinates are multiples of nothing"));
    }
    Ok(Head { always_grows, grain })
}

/// An MT without updates, and what to read its updates with.
pub fn start(
    info: MtInfo,
    base: BaseMesh,
    head: Head,
    tet_errors: bool,
) -> Result<(VertexMt, State), FormatError> {
    let mt = VertexMt::growing(info, base, head.always_grows, tet_errors)?;
    let state = State::new(&mt, head.grain)?;
    Ok((mt, state))
}

/// The largest numbers that all coordinates are multiples of.
fn grain(mt: &VertexMt) -> [i32; 3] {
    let mut grain = [0_u32; 3];
    let inserted = (0..mt.updates()).map(|u| mt.position(UpdateId(u)));
    for position in mt.base().positions.iter().copied().chain(inserted) {
        for (grain, x) in grain.iter_mut().zip(position) {
            let mut rest = x.unsigned_abs();
            while rest > 0 {
                (*grain, rest) = (rest, *grain % rest);
            }
        }
    }
    grain.map(|x| i32::try_from(x).unwrap_or(1).max(1))
}

/// Puts the updates `first .. end`, which follow those that were put with this state before.
///
/// # Errors
/// If the MT is damaged, or an update removes what does not hang together.
pub fn put(
    out: &mut impl Put,
    mt: &VertexMt,
    first: u32,
    end: u32,
    state: &mut State,
) -> Result<(), UpdateError> {
    (first..end).try_for_each(|u| put_update(out, mt, UpdateId(u), state))
}

fn put_update(out: &mut impl Put, mt: &VertexMt, u: UpdateId, state: &mut State) -> Result<(), UpdateError> {
    let torn = UpdateError::Cavity { update: u.0 };
    for (before, &error) in state.errors.iter_mut().zip(mt.errors(u)) {
        out.number(ERROR, 0, u32::from(before.0.wrapping_sub(error.0)));
        *before = error;
    }
    let mut removed = Vec::new();
    mt.find_removed(&mut state.mesh, u, &mut removed)?;
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
        out.symbol(OWN_FALL, 0, u32::from(mt.own_fall(u)));
        let mut context = 0;
        for &t in &state.removed {
            let own = mt.quarterings(&state.mesh, t);
            out.symbol(QUARTERINGS, state.holds(t, position) + context, u32::from(own));
            context = 2 * u32::from(own);
        }
    }
    match mt.refine(&mut state.mesh, u)? {
        Applied::Done => state.settle(u.0),
        Applied::Blocked(_) => return Err(torn),
    }
    Ok(())
}

/// Puts a number below `count`, all of which are equally likely, with as few bits as that takes.
fn put_one_of(out: &mut impl Put, value: u32, count: u32) {
    let (width, short) = one_of(count);
    if value < short {
        out.bits(value, width);
    } else {
        out.bits((value + short) >> 1, width);
        out.bits(value + short, 1);
    }
}

/// How many bits all numbers below `count` take, and how many of them take no more than that.
fn one_of(count: u32) -> (u32, u32) {
    let width = count.max(1).ilog2();
    (width, (2 << width) - count.max(1))
}

/// Along an axis, what is expected of a new vertex near `near`: the usual difference, the context, and what the difference
/// is told from.
fn usual(state: &State, axis: usize) -> (u32, u32, i32) {
    let grain = i64::from(state.grain[axis]);
    let (mut sum, mut size, mut level) = (0, 0, 1);
    for seen in &state.link {
        let difference = seen[axis];
        sum += difference;
        size += difference.abs();
        level += u32::from(difference == 0);
    }
    let count = grain * state.link.len().max(1) as i64;
    let context = [0, 0, 1, 2, 2, 3][level.min(5) as usize];
    // Towards the middle of the star, unless some of it lies level with the near vertex.
    let from = if context == 0 { sum / (2 * count) } else { 0 };
    (bits_of((size / count) as u32), context, from as i32)
}

fn bits_of(x: u32) -> u32 {
    u32::BITS - x.leading_zeros()
}

fn put_position(out: &mut impl Put, state: &State, near: u32, position: [i32; 3]) {
    for (axis, x) in position.into_iter().enumerate() {
        let (size, context, from) = usual(state, axis);
        let offset = x.wrapping_sub(state.mesh.positions()[near as usize][axis]);
        let residual = (offset / state.grain[axis]).wrapping_sub(from);
        let length = residual.unsigned_abs();
        let bits = bits_of(length);
        if bits == 0 {
            out.symbol(OFFSET, context, 0);
            continue;
        }
        let low = bits.saturating_sub(2);
        let second = if bits > 1 { length >> low & 1 } else { 0 };
        out.symbol(OFFSET, context, OFFSET_BIAS + 2 * bits + second - 2 * size);
        out.bits(length, low);
        out.bits(u32::from(residual < 0), 1);
    }
}

fn put_levels(out: &mut impl Put, mt: &VertexMt, u: UpdateId, state: &State, position: [i32; 3]) {
    let home = state.home(position);
    for (f, level) in mt.levels(u).enumerate() {
        let expected = state.expected(mt.info(), &home, f);
        let (bound, context) = bound(mt.info(), f, state.errors[f], &home);
        let residual = level - expected;
        let length = residual.unsigned_abs();
        if bound > LEAST_FAR {
            let far = length >= bound - bound / 64 && length <= bound + 1;
            out.symbol(FAR, bits_of(bound), u32::from(far));
            if far {
                out.number(SHORT, 0, bound + 1 - length);
                out.bits(u32::from(residual < 0), 1);
                continue;
            }
        }
        out.signed(LEVEL, context, residual);
    }
}

/// Above this many levels it is worth a symbol whether the level is as far off as the error allows.
const LEAST_FAR: u32 = 3;

/// How many levels the error of an update is, and the context of the level.
fn bound(info: &MtInfo, field: usize, error: ErrorCode, home: &Home) -> (u32, u32) {
    let field = &info.fields[field];
    let levels = (error.error() * field.range() / field.step).floor() as u32;
    // There are not more levels than that.
    let levels = levels.min(1 << MAX_FIELD_BITS);
    (levels, bits_of(levels).min(19) + if home.outside { 20 } else { 0 })
}

/// Reads `count` updates into the MT.
pub fn read(
    source: &mut Source<'_>,
    mt: &mut VertexMt,
    count: u32,
    state: &mut State,
    limits: &Limits,
) -> Result<(), FormatError> {
    for k in 1..=count {
        read_update(source, mt, state)?;
        if k.is_multiple_of(MEASURED) || k == count {
            check_bytes(mt.bytes() + state.mesh.bytes(), limits)?;
        }
    }
    mt.set_to_come(largest(&state.errors));
    Ok(())
}

fn read_update(source: &mut Source<'_>, mt: &mut VertexMt, state: &mut State) -> Result<(), FormatError> {
    for error in &mut state.errors {
        let fall = u16::try_from(source.number(ERROR, 0)?);
        let fall = fall.map_err(|_| source.corrupt("an error is out of its range"))?;
        error.0 = error.0.wrapping_sub(fall);
    }
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
        own_fall = source.symbol(OWN_FALL, 0)? as u8;
        state.quarterings.clear();
        let mut context = 0;
        for i in 0..state.removed.len() {
            let own = source.symbol(QUARTERINGS, state.holds(state.removed[i], position) + context)?;
            state.quarterings.push(own as u8);
            context = 2 * own;
        }
    }
    let State { mesh, removed, given_up, errors, quarterings, .. } = state;
    let levels = &levels;
    let insertion = Insertion { position, levels, removed, given_up, errors, quarterings, own_fall };
    let update = mt.insert_into(mesh, &insertion)?;
    state.settle(update.0);
    Ok(())
}

fn read_one_of(source: &mut Source<'_>, count: u32) -> Result<u32, FormatError> {
    let (width, short) = one_of(count);
    let value = source.bits(width)?;
    Ok(if value < short { value } else { 2 * value + source.bits(1)? - short })
}

fn read_position(
    source: &mut Source<'_>,
    info: &MtInfo,
    state: &State,
    near: u32,
) -> Result<[i32; 3], FormatError> {
    let mut position = state.mesh.positions()[near as usize];
    for (axis, x) in position.iter_mut().enumerate() {
        let (size, context, from) = usual(state, axis);
        let symbol = source.symbol(OFFSET, context)?;
        let mut residual = 0;
        if symbol > 0 {
            let twice = (symbol + 2 * size).wrapping_sub(OFFSET_BIAS);
            let (bits, second) = (twice / 2, twice & 1);
            if !(1..=31).contains(&bits) || second > 0 && bits == 1 {
                return Err(source.corrupt("a vertex is off the lattice"));
            }
            let low = bits.saturating_sub(2);
            let top = if bits == 1 { 1 } else { 2 | second };
            residual = (top << low | source.bits(low)?) as i32;
            residual = if source.bits(1)? == 1 { -residual } else { residual };
        }
        *x = residual.wrapping_add(from).wrapping_mul(state.grain[axis]).wrapping_add(*x);
    }
    if !position.iter().all(|&x| 0 <= x && x <= 1 << info.lattice.bits) {
        return Err(source.corrupt("a vertex is off the lattice"));
    }
    Ok(position)
}

fn read_levels(
    source: &mut Source<'_>,
    info: &MtInfo,
    state: &State,
    position: [i32; 3],
) -> Result<Vec<i32>, FormatError> {
    let home = state.home(position);
    let mut levels = Vec::with_capacity(info.fields.len());
    for f in 0..info.fields.len() {
        let expected = state.expected(info, &home, f);
        let (bound, context) = bound(info, f, state.errors[f], &home);
        let far = bound > LEAST_FAR && source.symbol(FAR, bits_of(bound))? == 1;
        let residual = if far {
            // Levels have few bits: what is not below 2^31 is off the lattice in any case.
            let length = (bound + 1).wrapping_sub(source.number(SHORT, 0)?) as i32;
            if source.bits(1)? == 1 { length.wrapping_neg() } else { length }
        } else {
            source.signed(LEVEL, context)?
        };
        levels.push(expected.wrapping_add(residual));
    }
    Ok(levels)
}

/// How a point and a tetrahedron lie to each other.
#[derive(Clone, Copy, Debug)]
struct View {
    /// Bit `k` tells that the point is on the inner side of face `k`.
    seen: u8,
    /// Where the point is with respect to the sphere: 1 inside, -1 outside, 0 on it.
    sphere: i32,
}

/// The tetrahedron whose levels the new vertex is compared with.
struct Home {
    tet: [u32; 4],
    /// What each corner counts.
    weights: [f64; 4],
    /// Whether the vertex lies outside.
    outside: bool,
}

/// One bit for each.
#[inline]
fn signs(all: [bool; 4]) -> u8 {
    (0..).zip(all).fold(0, |bits, (k, is_set)| bits | u8::from(is_set) << k)
}

/// The corners of a tetrahedron in the order of their vertices.
#[inline]
fn by_vertex(tet: [u32; 4]) -> [usize; 4] {
    let mut keys = [0, 1, 2, 3].map(|k| u64::from(tet[k]) << 2 | k as u64);
    for [i, j] in [[0, 1], [2, 3], [0, 2], [1, 3], [1, 2]] {
        (keys[i], keys[j]) = (keys[i].min(keys[j]), keys[i].max(keys[j]));
    }
    keys.map(|key| (key & 3) as usize)
}

impl State {
    /// At the start of an MT, to put all of its updates.
    ///
    /// # Errors
    /// If the base mesh is not usable.
    pub fn of(mt: &VertexMt) -> Result<Self, BaseMeshError> {
        Self::new(mt, grain(mt))
    }

    fn new(mt: &VertexMt, grain: [i32; 3]) -> Result<Self, BaseMeshError> {
        Ok(Self {
            mesh: mt.start()?,
            grain,
            errors: vec![ErrorCode::MAX; mt.info().fields.len()],
            narrow: mt.info().lattice.bits <= NARROW_BITS,
            star: Vec::new(),
            corners: Vec::new(),
            link: Vec::new(),
            turned: Vec::new(),
            removed: Vec::new(),
            views: Vec::new(),
            on_boundary: false,
            cone: Vec::new(),
            given_up: Vec::new(),
            quarterings: Vec::new(),
            tet_marks: Vec::new(),
            vertex_marks: Vec::new(),
            epoch: 0,
        })
    }

    fn next_epoch(&mut self) {
        if self.epoch > u32::MAX - 8 {
            self.tet_marks.fill(0);
            self.vertex_marks.fill(0);
            self.epoch = 0;
        }
        // Four marks are in use.
        self.epoch += 4;
        self.tet_marks.resize(self.mesh.tet_slots(), 0);
        self.vertex_marks.resize(self.mesh.positions().len(), 0);
    }

    /// Finds the tetrahedra around a vertex, as far as they hang together through faces, and their other vertices. False if
    /// there are too many.
    fn gather(&mut self, near: u32) -> bool {
        self.next_epoch();
        self.star.clear();
        self.corners.clear();
        self.link.clear();
        let Some(&first) = self.mesh.incident.get(near as usize).filter(|&&t| t != NONE) else {
            return false;
        };
        let [x, y, z] = self.mesh.positions()[near as usize];
        let mark = u64::from(self.epoch) << 32;
        self.tet_marks[first as usize] = self.epoch;
        self.star.push(first);
        let mut next = 0;
        while let Some(&t) = self.star.get(next) {
            next += 1;
            let (tet, around) = (self.mesh.tets()[t as usize], self.mesh.neighbors()[t as usize]);
            let face = FACES[corner_of(&tet, near)];
            self.corners.push(face.map(|k| {
                let own = &mut self.vertex_marks[tet[k] as usize];
                if *own < mark {
                    *own = mark | self.link.len() as u64;
                    let position = self.mesh.positions()[tet[k] as usize];
                    self.link.push([position[0] - x, position[1] - y, position[2] - z].map(i64::from));
                }
                *own as u32
            }));
            for n in face.map(|k| around[k]) {
                if n != NONE && std::mem::replace(&mut self.tet_marks[n as usize], self.epoch) != self.epoch {
                    self.star.push(n);
                }
            }
            if self.star.len() > MOST_AROUND {
                return false;
            }
        }
        true
    }

    /// Chooses the vertex to tell an insertion from, and gathers what is around it; and tells whether all that is removed
    /// is at it.
    fn near(&mut self, removed: &[u32], position: [i32; 3]) -> Option<(u32, bool)> {
        let tets: Vec<[u32; 4]> = removed.iter().map(|&t| self.mesh.tets()[t as usize]).collect();
        let mut vertices = tets.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let distance = |v: u32| {
            let other = self.mesh.positions()[v as usize];
            (0..3).map(|k| (i64::from(other[k]) - i64::from(position[k])).pow(2)).sum::<i64>()
        };
        // Those that all have come first.
        let rank = |v: u32| (!tets.iter().all(|tet| tet.contains(&v)), distance(v), v);
        let mut ranked: Vec<(bool, i64, u32)> = vertices.into_iter().map(rank).collect();
        ranked.sort_unstable();
        ranked.into_iter().find_map(|(apart, _, v)| {
            let fits = self.gather(v) && self.star.iter().any(|t| removed.contains(t));
            fits.then_some((v, !apart))
        })
    }

    /// Six times the volume between a point and each face of a tetrahedron, rounded; the signs, positive on the inner sides, are
    /// exact.
    fn inward(&self, tet: [u32; 4], position: [i32; 3]) -> [f64; 4] {
        if self.narrow {
            return views_of_origin(self.seen_from(tet, position)).0.map(|volume| volume as f64);
        }
        FACES.map(|face| {
            let [a, b, c] = face.map(|i| self.mesh.positions()[tet[i] as usize]);
            -orient3d(a, b, c, position) as f64
        })
    }

    /// The corners of a tetrahedron as seen from a point.
    #[inline]
    fn seen_from(&self, tet: [u32; 4], position: [i32; 3]) -> [[i64; 3]; 4] {
        tet.map(|v| {
            let [x, y, z] = self.mesh.positions()[v as usize];
            [x - position[0], y - position[1], z - position[2]].map(i64::from)
        })
    }

    /// 1 if the point lies in a tetrahedron, its boundary included; else 0.
    fn holds(&self, t: u32, position: [i32; 3]) -> u32 {
        u32::from(self.inward(self.mesh.tets()[t as usize], position).iter().all(|&volume| volume >= 0.0))
    }

    fn sorted(&self, t: u32) -> [u32; 4] {
        let mut tet = self.mesh.tets()[t as usize];
        tet.sort_unstable();
        tet
    }

    /// Finds the tetrahedra around the near vertex that `position` is in the direction of, by their sorted vertices.
    fn find_cone(&mut self, near: u32, position: [i32; 3]) {
        let mut cone = std::mem::take(&mut self.cone);
        cone.clear();
        if self.narrow {
            self.turn_link(near, position);
            let ahead = self.star.iter().zip(&self.corners).filter(|(_, corners)| self.is_ahead(**corners));
            cone.extend(ahead.map(|(&t, _)| t));
        } else {
            cone.extend(self.star.iter().copied().filter(|&t| {
                let tet = self.mesh.tets()[t as usize];
                let inward = self.inward(tet, position);
                (0..4).all(|k| inward[k] >= 0.0 || tet[k] == near)
            }));
        }
        cone.sort_unstable_by_key(|&t| self.sorted(t));
        self.cone = cone;
    }

    /// Finds the cross product of each vertex of the link with the new one.
    fn turn_link(&mut self, near: u32, position: [i32; 3]) {
        let origin = self.mesh.positions()[near as usize];
        let v = [0, 1, 2].map(|k| i64::from(position[k] - origin[k]));
        self.turned.clear();
        self.turned.extend(
            self.link
                .iter()
                .map(|u| [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]),
        );
    }

    /// Whether the new vertex is in the direction of a tetrahedron of the star.
    #[inline]
    fn is_ahead(&self, [a, b, c]: [u32; 3]) -> bool {
        // Components up to 2^20 make cross products up to 2^41, and a sum of three products up to 3 · 2^61 < 2^63.
        let is_inside = |i: u32, j: u32| {
            let (u, v) = (self.link[i as usize], self.turned[j as usize]);
            u[0] * v[0] + u[1] * v[1] + u[2] * v[2] >= 0
        };
        is_inside(a, b) && is_inside(b, c) && is_inside(c, a)
    }

    fn sort_star(&mut self) {
        let mut star = std::mem::take(&mut self.star);
        star.sort_unstable_by_key(|&t| self.sorted(t));
        self.star = star;
    }

    /// Finds what is removed, from its first tetrahedron on. What lies behind a face that the new vertex does not see has to
    /// be; `decide` is asked for the rest, with the context. With a vertex `fan`, all has it. Stops
    /// when there is too much.
    fn grow<E>(
        &mut self,
        seed: u32,
        fan: Option<u32>,
        position: [i32; 3],
        decide: &mut dyn FnMut(u32, u32) -> Result<bool, E>,
    ) -> Result<(), E> {
        let [yes, no, never] = [1, 2, 3].map(|more| self.epoch + more);
        self.removed.clear();
        self.removed.push(seed);
        self.tet_marks[seed as usize] = yes;
        self.on_boundary = false;
        self.views.clear();
        self.views.push(self.view(seed, position));
        let mut next = 0;
        while let Some(&t) = self.removed.get(next).filter(|_| self.removed.len() <= MAX_REMOVED) {
            let view = self.views[next];
            next += 1;
            let around = self.mesh.neighbors()[t as usize];
            for k in by_vertex(self.mesh.tets()[t as usize]) {
                let n = around[k];
                self.on_boundary |= n == NONE;
                let mark = self.tet_marks.get(n as usize).copied().unwrap_or(no);
                if (yes..=never).contains(&mark) {
                    continue;
                }
                let Some(beyond) = self.view_if(n, fan, position) else {
                    self.tet_marks[n as usize] = never;
                    continue;
                };
                let context = 2 * self.grow_context(n, beyond) + u32::from(view.sphere > 0);
                let is_removed = view.seen >> k & 1 == 0 || decide(n, context)?;
                self.tet_marks[n as usize] = if is_removed { yes } else { no };
                if is_removed {
                    self.removed.push(n);
                    self.views.push(beyond);
                }
            }
        }
        Ok(())
    }

    /// The view of a tetrahedron that may be removed: it has the vertex that all have, if there is one; the face opposite it must be
    /// seen then, unless it is on the boundary.
    #[inline]
    fn view_if(&self, t: u32, fan: Option<u32>, position: [i32; 3]) -> Option<View> {
        let Some(fan) = fan else { return Some(self.view(t, position)) };
        let corner = self.mesh.tets()[t as usize].iter().position(|&v| v == fan)?;
        let view = self.view(t, position);
        let is_open = self.mesh.neighbors()[t as usize][corner] == NONE || view.seen >> corner & 1 == 1;
        is_open.then_some(view)
    }

    #[inline]
    fn view(&self, t: u32, position: [i32; 3]) -> View {
        let tet = self.mesh.tets()[t as usize];
        if self.narrow {
            let (inward, sphere) = views_of_origin(self.seen_from(tet, position));
            return View { seen: signs(inward.map(|volume| volume > 0)), sphere };
        }
        let [a, b, c, d] = tet.map(|v| self.mesh.positions()[v as usize]);
        let seen = signs(self.inward(tet, position).map(|volume| volume > 0.0));
        View { seen, sphere: insphere(a, b, c, d, position) }
    }

    /// Half the context of whether a tetrahedron is removed: 0 to 53.
    #[inline]
    fn grow_context(&self, t: u32, view: View) -> u32 {
        let (mut removed, mut kept) = (0, 0);
        for n in self.mesh.neighbors()[t as usize] {
            let mark = self.tet_marks.get(n as usize).copied().unwrap_or(0);
            removed += u32::from(mark == self.epoch + 1);
            kept |= u32::from(mark == self.epoch + 2);
        }
        let hidden = 4 - view.seen.count_ones();
        let known = removed.clamp(1, 3) - 1;
        let shape = (view.sphere + 1) as u32 * 3 + known;
        (shape * 3 + hidden.clamp(1, 3) - 1) * 2 + kept
    }

    /// Finds the faces on the boundary that are given up: those that the new vertex does not see, and such as `decide` says, given
    /// their places by sorted vertices.
    fn list_given_up<E>(
        &mut self,
        position: [i32; 3],
        decide: &mut dyn FnMut(usize) -> Result<bool, E>,
    ) -> Result<(), E> {
        self.given_up.clear();
        if !self.on_boundary {
            return Ok(());
        }
        let mut bare: Vec<([u32; 3], [u32; 2])> = Vec::new();
        for &t in &self.removed {
            let tet = self.mesh.tets()[t as usize];
            for (k, &n) in (0..).zip(&self.mesh.neighbors()[t as usize]) {
                if n == NONE {
                    let mut face = FACES[k as usize].map(|i| tet[i]);
                    face.sort_unstable();
                    bare.push((face, [t, k]));
                }
            }
        }
        bare.sort_unstable();
        for (place, (_, [t, k])) in bare.into_iter().enumerate() {
            if self.view(t, position).seen >> k & 1 == 0 || decide(place)? {
                self.given_up.push([t, k]);
            }
        }
        Ok(())
    }

    /// The removed tetrahedron that the new vertex lies in; or is least far out of, for its size.
    fn home(&self, position: [i32; 3]) -> Home {
        let mut best = Home { tet: [0; 4], weights: [0.0; 4], outside: true };
        let mut most = f64::NEG_INFINITY;
        for &t in &self.removed {
            let tet = self.mesh.tets()[t as usize];
            let weights = self.inward(tet, position);
            let whole: f64 = weights.iter().sum();
            let weights = weights.map(|weight| weight / whole);
            let least = weights.iter().fold(f64::INFINITY, |least, &weight| least.min(weight));
            if least > most {
                most = least;
                best = Home { tet, weights, outside: least < 0.0 };
                if !best.outside {
                    break;
                }
            }
        }
        best
    }

    /// The level that is expected of the new vertex.
    fn expected(&self, info: &MtInfo, home: &Home, field: usize) -> i32 {
        let mut level = 0.5;
        for (v, weight) in home.tet.into_iter().zip(home.weights) {
            level += weight * f64::from(self.mesh.levels(v)[field]);
        }
        (level.floor() as i32).clamp(0, (1 << info.fields[field].bits) - 1)
    }

    /// After update `u` has been applied.
    fn settle(&mut self, u: u32) {
        self.mesh.clear_touched();
        if u.is_multiple_of(4096) {
            self.mesh.take_changes();
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::format::coder::{Counts, Models, Writer};
    use crate::format::read::Reader;
    use crate::geom::{Lattice, in_conflict};
    use crate::mesh::kuhn_tets;
    use crate::mt::{ExplicitMt, ExplicitUpdate, FieldInfo, MtKind, UpdatePages};

    /// A cube of 6 bits with two fields.
    fn info() -> MtInfo {
        let field = FieldInfo { max: 255.0, step: 1.0, bits: 8, ..FieldInfo::default() };
        MtInfo {
            kind: MtKind::Explicit,
            lattice: Lattice { origin: [0.0; 3], step: [1.0; 3], bits: 6 },
            fields: vec![field.clone(), field],
            vertices: 0,
            tetrahedra: 0,
            updates: 0,
            displacement_per_error: 0.0,
            quantization: 0.0,
        }
    }

    fn level(position: [i32; 3], field: i32) -> i32 {
        let [x, y, z] = position;
        (x * x / 16 + y * z / 32 + field * x).clamp(0, 255)
    }

    /// A grid with points inserted into it by the Delaunay criterion, some of them on its sides and edges.
    pub fn delaunay(points: u32) -> VertexMt {
        let side = |i: u32| [i % 3, i / 3 % 3, i / 9].map(|k| 32 * k as i32);
        let mut positions: Vec<[i32; 3]> = (0..27).map(side).collect();
        let levels = |positions: &[[i32; 3]]| -> Vec<i32> {
            positions.iter().flat_map(|&position| [0, 1].map(|field| level(position, field))).collect()
        };
        let base =
            BaseMesh { positions: positions.clone(), values: levels(&positions), tets: kuhn_tets([3; 3]) };
        let mut live: Vec<(u32, [u32; 4])> = (0..).zip(base.tets.iter().copied()).collect();
        let mut mt = ExplicitMt::new(MtInfo { updates: points, ..info() }, base);
        let mut x = 0x9E37_79B9_7F4A_7C15_u64;
        while mt.updates() < points {
            x ^= x << 7;
            x ^= x >> 9;
            let new =
                [0, 16, 32].map(|shift| ((x >> shift & 0xFFFF) % 81) as i32 - 8).map(|c| c.clamp(0, 64));
            if positions.contains(&new) {
                continue;
            }
            let corners = |tet: [u32; 4]| tet.map(|v| positions[v as usize]);
            let (removed, kept): (Vec<_>, Vec<_>) = live.iter().copied().partition(|&(_, tet)| {
                let [a, b, c, d] = corners(tet);
                in_conflict(a, b, c, d, new)
            });
            let faces: Vec<[u32; 3]> =
                removed.iter().flat_map(|(_, tet)| FACES.map(|face| face.map(|k| tet[k]))).collect();
            let is_inner = |[a, b, c]: [u32; 3]| {
                [[a, c, b], [c, b, a], [b, a, c]].iter().any(|other| faces.contains(other))
            };
            let v = positions.len() as u32;
            let seen = faces.iter().filter(|&&face| {
                let [a, b, c] = face.map(|v| positions[v as usize]);
                !is_inner(face) && orient3d(a, b, c, new) != 0
            });
            let inserted: Vec<[u32; 4]> = seen.map(|&[a, b, c]| [v, a, b, c]).collect();
            let update = ExplicitUpdate {
                positions: &[new],
                levels: &levels(&[new]),
                removed: &removed.iter().map(|(t, _)| *t).collect::<Vec<_>>(),
                inserted: &inserted,
                errors: &[0, 7].map(|more| ErrorCode((60_000 - 3 * v + more) as u16)),
            };
            let u = mt.push(&update).unwrap();
            positions.push(new);
            live = kept;
            live.extend(mt.inserted(u).map(|t| (t, mt.tets()[t as usize])));
        }
        VertexMt::from_explicit(&mt).unwrap()
    }

    struct Coded {
        models: Models,
        head: Vec<u8>,
        blocks: Vec<Vec<u8>>,
    }

    fn coded(mt: &VertexMt, size: u32) -> Result<Coded, FormatError> {
        let mut counts = Counts::default();
        put_head(&mut counts, mt);
        let mut state = State::of(mt)?;
        put(&mut counts, mt, 0, mt.updates(), &mut state)?;
        let models = Models::new(&counts);
        let mut writer = Writer::new(&models);
        put_head(&mut writer, mt);
        let mut head = Vec::new();
        writer.finish(&mut head);
        let mut state = State::of(mt)?;
        let mut blocks = Vec::new();
        for first in (0..mt.updates()).step_by(size as usize) {
            let mut writer = Writer::new(&models);
            put(&mut writer, mt, first, mt.updates().min(first + size), &mut state)?;
            let mut block = Vec::new();
            writer.finish(&mut block);
            blocks.push(block);
        }
        Ok(Coded { models, head, blocks })
    }

    impl Coded {
        /// An MT into which no block has come.
        fn start(&self, info: &MtInfo, base: &BaseMesh) -> Result<(VertexMt, State), FormatError> {
            let mut source = Source::new(Reader::new(&self.head, 0), &self.models)?;
            let known = read_head(&mut source)?;
            source.end()?;
            start(info.clone(), base.clone(), known, false)
        }
    }

    fn decoded(coded: &Coded, info: &MtInfo, base: &BaseMesh, size: u32) -> Result<VertexMt, FormatError> {
        let (mut mt, mut state) = coded.start(info, base)?;
        for block in &coded.blocks {
            let mut source = Source::new(Reader::new(block, 0), &coded.models)?;
            let count = size.min(info.updates - mt.updates());
            read(&mut source, &mut mt, count, &mut state, &Limits::default())?;
            source.end()?;
        }
        Ok(mt)
    }

    #[test]
    fn insertions_come_back_in_blocks_of_any_size() -> Result<(), FormatError> {
        let mt = delaunay(150);
        assert!((0..150).any(|u| mt.given_up(UpdateId(u)).contains(&true)));
        for size in [1, 7, 150] {
            let coded = coded(&mt, size)?;
            assert!(decoded(&coded, mt.info(), mt.base(), size)? == mt);
        }
        let none = delaunay(0);
        assert!(decoded(&coded(&none, 1)?, none.info(), none.base(), 1)? == none);
        Ok(())
    }

    #[test]
    fn what_has_come_is_an_mt() -> Result<(), FormatError> {
        let whole = delaunay(120);
        let coded = coded(&whole, 10)?;
        let (mut mt, mut state) = coded.start(whole.info(), whole.base())?;
        // One mesh follows; at every stage another one is taken back to the base, and there again.
        let mut mesh = mt.start()?;
        let mut reference = whole.start()?;
        for block in &coded.blocks {
            let mut source = Source::new(Reader::new(block, 0), &coded.models)?;
            let known = mt.updates();
            read(&mut source, &mut mt, 10, &mut state, &Limits::default())?;
            mt.updates_arrived(&mut mesh, known);
            let mut other = mt.start()?;
            for u in (0..mt.updates()).map(UpdateId) {
                let parents: Vec<UpdateId> = mt.parents(u).collect();
                assert_eq!(parents, whole.parents(u).collect::<Vec<_>>());
                mt.refine(&mut other, u)?;
            }
            for u in (known..mt.updates()).map(UpdateId) {
                assert_eq!(mt.refine(&mut mesh, u)?, Applied::Done);
                assert_eq!(whole.refine(&mut reference, u)?, Applied::Done);
            }
            assert_eq!(mesh.hash(), reference.hash());
            assert_eq!(other.hash(), reference.hash());
            for u in (0..mt.updates()).rev().map(UpdateId) {
                assert_eq!(mt.coarsen(&mut other, u)?, Applied::Done);
            }
            other.compact();
            assert_eq!(other.hash(), mt.start()?.hash());
        }
        assert!(mt == whole);
        Ok(())
    }

    /// What removes each tetrahedron of a mesh, as far as is known.
    fn removers(mt: &VertexMt, mesh: &CurrentMesh) -> Vec<([u32; 4], Option<u32>)> {
        let tets = (0..mesh.tet_slots() as u32).filter_map(|t| Some((t, mesh.tet(t)?)));
        let mut removers: Vec<_> = tets
            .map(|(t, tet)| {
                let mut labels = tet.map(|slot| mesh.vertex(slot).0);
                labels.sort_unstable();
                (labels, mt.remover(mesh, t).map(|u| u.0))
            })
            .collect();
        removers.sort_unstable();
        removers
    }

    #[test]
    fn updates_that_come_one_by_one_are_revealed_wherever_they_lie() -> Result<(), FormatError> {
        let whole = delaunay(240);
        let coded = coded(&whole, 1)?;
        let (mut mt, mut state) = coded.start(whole.info(), whole.base())?;
        let mut mesh = mt.start()?;
        let mut applied = Vec::new();
        for (u, block) in (0..).zip(&coded.blocks) {
            let mut source = Source::new(Reader::new(block, 0), &coded.models)?;
            read(&mut source, &mut mt, 1, &mut state, &Limits::default())?;
            mesh.clear_touched();
            mt.updates_arrived(&mut mesh, u);
            let is_news = |&t: &u32| mt.remover(&mesh, t) == Some(UpdateId(u));
            let news = (0..mesh.tet_slots() as u32).filter(|t| mesh.tet(*t).is_some()).filter(is_news);
            assert!(news.into_iter().all(|t| mesh.touched().contains(&t)));
            if u % 8 == 7 {
                // A mesh that knew of all from the start.
                let mut other = mt.start()?;
                for &u in &applied {
                    assert_eq!(mt.refine(&mut other, u)?, Applied::Done);
                }
                assert_eq!(removers(&mt, &mesh), removers(&mt, &other));
            }
            // Some are left out later on, and all that depends on them.
            if (u < 150 || u % 9 > 0) && mt.refine(&mut mesh, UpdateId(u))? == Applied::Done {
                applied.push(UpdateId(u));
            }
        }
        assert!((151..230).contains(&applied.len()));
        Ok(())
    }

    #[test]
    fn damage_makes_errors_or_other_mts() -> Result<(), FormatError> {
        let mt = delaunay(40);
        let whole = coded(&mt, 40)?;
        let read = |blocks: Vec<Vec<u8>>| {
            let coded = Coded { models: whole.models.clone(), head: whole.head.clone(), blocks };
            decoded(&coded, mt.info(), mt.base(), 40)
        };
        let block = &whole.blocks[0];
        for cut in 0..block.len() {
            assert!(read(vec![block[..cut].to_vec()]).is_err());
        }
        for bit in 0..8 * block.len() {
            let mut damaged = block.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            if let Ok(other) = read(vec![damaged]) {
                assert!(other != mt);
                // It can be spelled out, so all of its updates can be applied.
                assert!(ExplicitMt::of(&other).is_ok());
            }
        }
        Ok(())
    }
}
