//! Which updates remove the tetrahedra of a new star, and which faces go with them, as residuals against predictions.
//!
//! A tetrahedron that update `u` creates is removed by a later update whose near vertex is one of its corners, or by none.
//! The candidates are the forest children of its corners after `u`. Candidate `c` with near vertex `x` tends to remove the
//! tetrahedra at `x` that lie in its direction: the cosine between the direction to the inserted vertex and that to the
//! centre of the tetrahedron gives a weight. The symbol of a tetrahedron is the rank of its remover among the candidates,
//! and of "none", by falling weight. Symbols come in the order of rising certainty, and zeros at the end are left out.
//!
//! A face at the near vertex goes with the tetrahedron (it is *inner*) if the same update removes what lies behind, or if
//! it is of the boundary and the new vertex takes its place. Most cases follow: what is behind within the star is known,
//! and a face that hides the new vertex from the tetrahedron cannot stay. For the rest a bit says whether the guess, by
//! the angle at which the new vertex lies over the face, is wrong; bits come in the same order, zeros at the end left out.
//!
//! All of this is the same in every consistent set, for the star is: positions are integers, sums of floating-point
//! numbers have a fixed order, and ties are broken by labels.

use super::scratch::{MOST, NO_ENTRY, NewTet, Scratch, hash_labels};
use super::store::{ForestChild, HalfEdgeMt};
use crate::geom::orient3d;
use crate::mesh::NONE;
use crate::mt::mesh::paged_array::PagedArray;
use crate::mt::mesh::tet::TURN;
use crate::mt::{CurrentMesh, UpdateId};
use std::mem::take;

/// Most candidates that have a rank.
const RANKED: usize = 8;

/// Candidates are ranked until what is left has less weight than this.
const LEFT: f64 = 1.0 / 64.0;

/// Stands for a remover that has no rank.
const FURTHER: u32 = NONE - 1;

/// A candidate for the removal of a tetrahedron, or none of them, or one of those without a rank.
#[derive(Clone, Copy, Debug, Default)]
struct Choice {
    weight: f64,
    /// The weight before neighbours were looked at.
    first_weight: f64,
    remover: u32,
    /// The place of the remover among the forest children of its near vertex that come later.
    place: u32,
    /// The corner of the tetrahedron that is its near vertex.
    corner: u8,
}

/// The choices for a tetrahedron, in the order of the candidates; what is left comes last.
#[derive(Clone, Debug, Default)]
struct Choices {
    all: [Choice; RANKED + 1],
    len: usize,
}

/// Scratch space: what may remove each tetrahedron of a star.
#[derive(Clone, Debug, Default)]
pub(in crate::mt) struct StarCode {
    choices: Vec<Choices>,
    /// The vertices of the link, and then the new one.
    positions: Vec<[i32; 3]>,
    /// What has to be stored, by rising certainty: see [`entry`].
    order: Vec<u128>,
    /// The corner of each tetrahedron that is the near vertex of its remover.
    near: Vec<u8>,
    /// From that corner to the vertex that its remover inserts.
    offsets: Vec<[i32; 3]>,
    /// Of which tetrahedra the remover is known by now.
    decided: Vec<bool>,
    /// When a code is written: the hashes of the vertices and of the tetrahedra, what removes these, and the code so far.
    hashes: Vec<u64>,
    tet_hashes: Vec<u64>,
    truth: Vec<(u32, u8)>,
    symbols: Vec<u8>,
    bits: Vec<bool>,
}

/// A vertex of a link, or the new one: its label, where it is, and its forest children.
pub(super) type StarVertex<'a> = (u32, [i32; 3], &'a [ForestChild]);

/// Writes or reads what cannot be predicted.
trait CodeIo {
    /// Which of the choices it is.
    fn choose(&mut self, tet: usize, choices: &mut [Choice]) -> Option<Choice>;
    /// Of the candidates without a rank, 0 for none.
    fn further(&mut self, tet: usize, index_of: &mut dyn FnMut(u32) -> Option<u32>) -> Option<u32>;
    /// How many faces more may not be as guessed.
    fn bits_left(&self) -> usize;
    /// Whether a face goes with the tetrahedron.
    fn is_inner(&mut self, tet: usize, face: usize, guess: bool) -> bool;
}

/// Reads a code.
struct Reader<'a> {
    symbols: &'a [u8],
    bits: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn symbol(&mut self) -> u8 {
        let Some((&first, rest)) = self.symbols.split_first() else { return 0 };
        self.symbols = rest;
        first
    }
}

impl CodeIo for Reader<'_> {
    fn choose(&mut self, _: usize, choices: &mut [Choice]) -> Option<Choice> {
        let rank = usize::from(self.symbol());
        if rank == 0 {
            // The first of those that come first.
            return choices
                .iter()
                .copied()
                .reduce(|best, choice| if comes_before(&choice, &best).is_lt() { choice } else { best });
        }
        choices.sort_by(comes_before);
        choices.get(rank).copied()
    }

    fn further(&mut self, _: usize, _: &mut dyn FnMut(u32) -> Option<u32>) -> Option<u32> {
        let mut index = 0;
        for shift in (0..30).step_by(3) {
            let symbol = self.symbol();
            index |= u32::from(symbol & 7) << shift;
            if symbol < 8 {
                return Some(index);
            }
        }
        None
    }

    fn bits_left(&self) -> usize {
        (8 * self.bits.len()).saturating_sub(self.at)
    }

    fn is_inner(&mut self, _: usize, _: usize, guess: bool) -> bool {
        let byte = self.bits.get(self.at / 8).copied().unwrap_or(0);
        let wrong = byte >> (self.at % 8) & 1 == 1;
        self.at += 1;
        guess ^ wrong
    }
}

/// Writes a code.
struct Writer<'a> {
    /// The remover of each tetrahedron, and its inner faces.
    truth: &'a [(u32, u8)],
    symbols: Vec<u8>,
    bits: Vec<bool>,
}

impl CodeIo for Writer<'_> {
    fn choose(&mut self, tet: usize, choices: &mut [Choice]) -> Option<Choice> {
        choices.sort_by(comes_before);
        let remover = self.truth[tet].0;
        let rank = choices.iter().position(|choice| choice.remover == remover);
        let rank = rank.or_else(|| choices.iter().position(|choice| choice.remover == FURTHER))?;
        self.symbols.push(rank as u8);
        choices.get(rank).copied()
    }

    fn further(&mut self, tet: usize, index_of: &mut dyn FnMut(u32) -> Option<u32>) -> Option<u32> {
        let index = index_of(self.truth[tet].0)?;
        let mut rest = index;
        loop {
            let (low, more) = ((rest & 7) as u8, rest > 7);
            self.symbols.push(low | u8::from(more) << 3);
            rest >>= 3;
            if !more {
                return Some(index);
            }
        }
    }

    fn bits_left(&self) -> usize {
        usize::MAX
    }

    fn is_inner(&mut self, tet: usize, face: usize, guess: bool) -> bool {
        let inner = self.truth[tet].1 >> face & 1 == 1;
        self.bits.push(inner != guess);
        inner
    }
}

impl HalfEdgeMt {
    /// Finds what removes the tetrahedra of the star that update `u` makes. None if the code does not fit the star.
    pub(in crate::mt) fn find_removers(
        &self,
        mesh: &CurrentMesh,
        u: UpdateId,
        position: [i32; 3],
        scratch: &mut Scratch,
        code: &mut StarCode,
    ) -> Option<()> {
        let star = self.update(u)?.star;
        let (symbols, bits) = match star.split_first() {
            Some((&count, rest)) => rest.split_at_checked(usize::from(count))?,
            None => (star, star),
        };
        self.code_with(mesh, u, position, (scratch, code), &mut Reader { symbols, bits, at: 0 })
    }

    fn code_with(
        &self,
        mesh: &CurrentMesh,
        u: UpdateId,
        position: [i32; 3],
        (scratch, code): (&mut Scratch, &mut StarCode),
        io: &mut impl CodeIo,
    ) -> Option<()> {
        let Scratch { star, star_len, link, link_len, hashes, tet_hashes, .. } = scratch;
        let (star, link) = (&mut star[..*star_len], &link[..*link_len]);
        let vertex = self.vertex(u);
        let lists: Vec<&[ForestChild]> = link
            .iter()
            .map(|&slot| mesh.vertex(slot))
            .chain([vertex])
            .map(|v| later(self.children_of(v), u))
            .collect();
        code.positions.clear();
        code.positions.extend(link.iter().map(|&slot| mesh.positions[slot as usize]));
        code.positions.push(position);
        code.run(&Around { hashes, tet_hashes, lists }, star, io)
    }
}

impl StarCode {
    /// Appends the code of the star of `u`, whose tetrahedra have what removes them. `vertices` are those of the link and then the new one.
    /// None if it has no code.
    pub(super) fn write<'a>(
        &mut self,
        u: UpdateId,
        star: &mut [NewTet],
        vertices: impl Iterator<Item = StarVertex<'a>> + Clone,
        out: &mut Vec<u8>,
    ) -> Option<()> {
        let (mut hashes, mut tet_hashes) = (take(&mut self.hashes), take(&mut self.tet_hashes));
        hash_labels(vertices.clone().map(|vertex| vertex.0), star, &mut hashes, &mut tet_hashes);
        let mut truth = take(&mut self.truth);
        truth.clear();
        truth.extend(star.iter().map(|new| (new.remover, new.inner)));
        let (mut symbols, mut bits) = (take(&mut self.symbols), take(&mut self.bits));
        symbols.clear();
        bits.clear();
        self.positions.clear();
        self.positions.extend(vertices.clone().map(|vertex| vertex.1));
        let lists = vertices.map(|vertex| later(vertex.2, u)).collect();
        let around = Around { hashes: &hashes, tet_hashes: &tet_hashes, lists };
        let mut writer = Writer { truth: &truth, symbols, bits };
        let done = self.run(&around, star, &mut writer).and_then(|()| writer.finish(out));
        (symbols, bits) = (writer.symbols, writer.bits);
        (self.hashes, self.tet_hashes, self.truth) = (hashes, tet_hashes, truth);
        (self.symbols, self.bits) = (symbols, bits);
        done
    }

    /// Finds what removes the tetrahedra of a star, given where its vertices are.
    fn run(&mut self, around: &Around<'_>, star: &mut [NewTet], io: &mut impl CodeIo) -> Option<()> {
        star.iter_mut().for_each(|new| (new.remover, new.inner) = (NONE, 0));
        if around.lists.iter().all(|list| list.is_empty()) {
            return Some(());
        }
        self.find_removers(around, star, io)?;
        self.find_inner(around, star, io);
        Some(())
    }
}

impl Writer<'_> {
    /// Appends the code.
    fn finish(&self, out: &mut Vec<u8>) -> Option<()> {
        let symbols = self.symbols.iter().rposition(|&s| s != 0).map_or(0, |last| last + 1);
        let used = self.bits.iter().rposition(|&bit| bit).map_or(0, |last| last + 1);
        if symbols == 0 && used == 0 {
            return Some(());
        }
        out.push(u8::try_from(symbols).ok()?);
        out.extend_from_slice(&self.symbols[..symbols]);
        for eight in self.bits[..used].chunks(8) {
            out.push((0..).zip(eight).fold(0, |byte, (i, &bit)| byte | u8::from(bit) << i));
        }
        Some(())
    }
}

/// The children that come after `u`.
#[inline]
fn later(children: &[ForestChild], u: UpdateId) -> &[ForestChild] {
    match (children.first(), children.last()) {
        (Some(first), _) if first.update > u.0 => children,
        (_, Some(last)) if last.update > u.0 => {
            &children[children.partition_point(|child| child.update <= u.0)..]
        }
        _ => &[],
    }
}

/// What surrounds a new vertex, by index into its link; the vertex itself is the last.
struct Around<'a> {
    hashes: &'a [u64],
    /// The hashes of the tetrahedra.
    tet_hashes: &'a [u64],
    /// The forest children that come later.
    lists: Vec<&'a [ForestChild]>,
}

impl<'a> Around<'a> {
    fn list(&self, corner: u8) -> &'a [ForestChild] {
        self.lists[usize::from(corner).min(self.lists.len() - 1)]
    }

    fn lists_of(&self, new: &NewTet) -> [&'a [ForestChild]; 4] {
        let [a, b, c, d] = new.corners;
        [self.list(a), self.list(b), self.list(c), self.list(d)]
    }
}

/// Levels of certainty.
const CERTAINTIES: f64 = 4095.0;

/// The place of something in the order of rising certainty, ties broken by a hash.
fn key(certainty: f64, hash: u64) -> u64 {
    let level = (certainty.clamp(0.0, 1.0) * CERTAINTIES) as u64;
    level << 52 | hash >> 12
}

/// A key with a tetrahedron and a face, in one number: these decide where keys are equal.
fn entry(key: u64, tet: u8, face: u8) -> u128 {
    u128::from(key) << 16 | u128::from(tet) << 8 | u128::from(face)
}

/// Tetrahedron and face of such a number.
fn parts(entry: u128) -> (usize, u8) {
    (usize::from((entry >> 8) as u8), entry as u8)
}

/// Choices by falling weight, equal ones by the weights that they had first, and then as they came.
fn comes_before(a: &Choice, b: &Choice) -> std::cmp::Ordering {
    b.weight.total_cmp(&a.weight).then(b.first_weight.total_cmp(&a.first_weight))
}

impl StarCode {
    fn find_removers(
        &mut self,
        around: &Around<'_>,
        star: &mut [NewTet],
        io: &mut impl CodeIo,
    ) -> Option<()> {
        self.rank(around, star);
        self.decided.clear();
        self.order.clear();
        for (i, choices) in self.choices[..star.len()].iter().enumerate() {
            // What can only be one thing is not stored.
            self.decided.push(choices.len == 1);
            if choices.len > 1 {
                let largest =
                    choices.all[..choices.len].iter().fold(0.0, |w: f64, choice| w.max(choice.weight));
                self.order.push(entry(key(largest, around.tet_hashes[i]), i as u8, 0));
            }
        }
        self.near.clear();
        self.near.resize(star.len(), 0);
        self.offsets.clear();
        self.offsets.resize(star.len(), [0; 3]);
        self.order.sort_unstable();
        for at in 0..self.order.len() {
            let (i, _) = parts(self.order[at]);
            let choices = &mut self.choices[i];
            let choices = &mut choices.all[..choices.len];
            weigh_by_neighbors(choices, &star[i], star, &self.decided);
            let choice = io.choose(i, choices)?;
            self.decided[i] = true;
            let (corner, child) = match choice.remover {
                NONE => continue,
                FURTHER => match self.further(around, &star[i], i, io)? {
                    Some(found) => found,
                    None => continue,
                },
                _ => {
                    let list = around.list(star[i].corners[usize::from(choice.corner) & 3]);
                    (choice.corner, *list.get(choice.place as usize)?)
                }
            };
            star[i].remover = child.update;
            self.near[i] = corner;
            self.offsets[i] = child.offset;
        }
        Some(())
    }

    /// The corners of a tetrahedron.
    #[inline]
    fn corners(&self, new: &NewTet) -> [[i32; 3]; 4] {
        let newest = self.positions.len() - 1;
        let [a, b, c, d] = new.corners;
        let at = |corner: u8| self.positions[usize::from(corner).min(newest)];
        [at(a), at(b), at(c), at(d)]
    }

    /// Finds the choices for each tetrahedron.
    fn rank(&mut self, around: &Around<'_>, star: &[NewTet]) {
        if self.choices.len() < star.len() {
            self.choices.resize_with(star.len(), Choices::default);
        }
        for (i, new) in star.iter().enumerate() {
            let corners = self.corners(new);
            rank_tet(&mut self.choices[i], &around.lists_of(new), &corners);
        }
    }

    /// The candidate without a rank that is stored by its number, and the corner that is its near vertex; or that there is none.
    #[cold]
    fn further(
        &self,
        around: &Around<'_>,
        new: &NewTet,
        i: usize,
        io: &mut impl CodeIo,
    ) -> Option<Option<(u8, ForestChild)>> {
        let lists = around.lists_of(new);
        let mut rest = [0; 4];
        // All choices but the last have a rank.
        for _ in 1..self.choices[i].len {
            pop_least(&lists, &mut rest)?;
        }
        let mut index_of = |remover: u32| {
            if remover == NONE {
                return Some(0);
            }
            let mut next = rest;
            (1..)
                .map_while(|index| pop_least(&lists, &mut next).map(|found| (index, found.1.update)))
                .find(|found| found.1 == remover)
                .map(|found| found.0)
        };
        let index = io.further(i, &mut index_of)?;
        let mut found = None;
        for _ in 0..index {
            found = Some(pop_least(&lists, &mut rest)?);
        }
        Some(found)
    }

    fn find_inner(&mut self, around: &Around<'_>, star: &mut [NewTet], io: &mut impl CodeIo) {
        self.order.clear();
        // Those that are not stored are as predicted.
        let bits = io.bits_left();
        for i in 0..star.len() {
            let new = star[i];
            if new.remover == NONE {
                continue;
            }
            let near = usize::from(self.near[i]) & 3;
            let view = View::new(&self.corners(&new), near, self.offsets[i]);
            for face in (0..4).filter(|&face| face != near) {
                let behind = new.across[face];
                if face != usize::from(new.own) && behind != NO_ENTRY {
                    let other = star[usize::from(behind) % MOST].remover;
                    if other == new.remover {
                        star[i].inner |= 1 << face;
                        continue;
                    }
                    if other > new.remover {
                        continue;
                    }
                }
                let Some(sine) = view.elevation(face) else {
                    star[i].inner |= 1 << face;
                    continue;
                };
                let guess = u8::from(sine < STEEP);
                if bits == 0 {
                    star[i].inner |= guess << face;
                    continue;
                }
                let face_hash = around.hashes[usize::from(new.corners[face]).min(around.hashes.len() - 1)]
                    .rotate_left(17);
                let key = key((sine - STEEP).abs(), around.tet_hashes[i].wrapping_add(face_hash));
                self.order.push(entry(key, i as u8, face as u8 | guess << 7));
            }
        }
        let stored = bits.min(self.order.len());
        if stored > 0 {
            self.order.sort_unstable();
        }
        for (at, &entry) in self.order.iter().enumerate() {
            let (i, face) = parts(entry);
            let (face, guess) = (usize::from(face & 3), face >> 7 == 1);
            let is_inner = if at < stored { io.is_inner(i, face, guess) } else { guess };
            star[i].inner |= u8::from(is_inner) << face;
        }
    }
}

/// Finds the choices for a tetrahedron, given the forest children of its corners.
#[inline]
fn rank_tet(choices: &mut Choices, lists: &[&[ForestChild]; 4], corners: &[[i32; 3]; 4]) {
    let count: usize = lists.iter().map(|list| list.len()).sum();
    let [p, q, r, s] = corners;
    let sum = |k: usize| i64::from(p[k]) + i64::from(q[k]) + i64::from(r[k]) + i64::from(s[k]);
    let sums = [sum(0), sum(1), sum(2)];
    let mut next = [0; 4];
    let (mut len, mut left) = (0, 1.0);
    while len < count.min(RANKED) && left >= LEFT {
        let Some((corner, child)) = pop_least(lists, &mut next) else { break };
        let share = share(child.offset, sums, corners[usize::from(corner) & 3]);
        let (weight, place) = (left * share, next[usize::from(corner) & 3] - 1);
        choices.all[len] = Choice { weight, first_weight: weight, remover: child.update, place, corner };
        len += 1;
        left *= 1.0 - share;
    }
    let remover = if count > len { FURTHER } else { NONE };
    choices.all[len] = Choice { weight: left, first_weight: left, remover, ..Choice::default() };
    choices.len = len + 1;
}

/// How much more likely a candidate is that removes a neighbour, and how much less one that leaves it.
const AGREEMENT: f64 = 6.0;

/// Weighs the choices for a tetrahedron again by the removers of its neighbours in the star: T_u is connected.
#[inline]
fn weigh_by_neighbors(choices: &mut [Choice], new: &NewTet, star: &[NewTet], decided: &[bool]) {
    let (mut known, mut count) = ([(0, NONE); 4], 0);
    for (face, &n) in (0..).zip(&new.across) {
        if decided.get(usize::from(n)).is_some_and(|&decided| decided) {
            known[count] = (face, star[usize::from(n)].remover);
            count += 1;
        }
    }
    if count == 0 {
        return;
    }
    for choice in choices.iter_mut().filter(|choice| choice.remover < FURTHER) {
        for &(_, other) in known[..count].iter().filter(|&&(face, _)| face != choice.corner) {
            // What is removed later than the candidate, or never, was left by it.
            if other == choice.remover {
                choice.weight *= AGREEMENT;
            } else if other > choice.remover {
                choice.weight /= AGREEMENT;
            }
        }
    }
}

/// Whether predicates can be asked about a point.
fn on_lattice(p: [i32; 3]) -> bool {
    p.iter().all(|&x| (0..=1 << crate::geom::WIDE_BITS).contains(&x))
}

/// The next update of four ascending lists, merged, and which list it is of.
#[inline]
fn pop_least(lists: &[&[ForestChild]; 4], next: &mut [u32; 4]) -> Option<(u8, ForestChild)> {
    let mut least: Option<(u8, &ForestChild)> = None;
    for (k, list) in (0..).zip(lists) {
        if let Some(child) = list.get(next[usize::from(k)] as usize)
            && least.is_none_or(|(_, other)| child.update < other.update)
        {
            least = Some((k, child));
        }
    }
    let (k, &child) = least?;
    next[usize::from(k)] += 1;
    Some((k, child))
}

/// How likely a candidate removes a tetrahedron that no earlier one has removed, given its offset, the sum of the corners, and
/// its near vertex.
#[inline]
fn share(offset: [i32; 3], sum: [i64; 3], at: [i32; 3]) -> f64 {
    let to = [f64::from(offset[0]), f64::from(offset[1]), f64::from(offset[2])];
    let apart = |k: usize| (sum[k] - 4 * i64::from(at[k])) as f64;
    let centre = [apart(0), apart(1), apart(2)];
    let lengths = (dot(centre, centre) * dot(to, to)).sqrt();
    let cosine = dot(centre, to) / lengths.max(1e-300);
    let ratio = ((1.0 - cosine) / (1.0 + cosine).max(1e-9)).min(1e9);
    1.0 / (1.0 + ratio * ratio)
}

#[inline]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Faces over which the new vertex lies at a larger sine than this are guessed to stay.
const STEEP: f64 = 0.35;

/// A new vertex, seen from the near vertex of a tetrahedron.
struct View {
    corners: [[i32; 3]; 4],
    near: usize,
    /// Where the new vertex lies; none if it lies off every lattice.
    point: Option<[i32; 3]>,
    /// From the near vertex to the new one.
    to: [f64; 3],
    /// From the near vertex to each corner.
    apart: [[f64; 3]; 4],
    /// Whether determinants of these are exact.
    exact: bool,
}

impl View {
    #[inline]
    fn new(corners: &[[i32; 3]; 4], near: usize, offset: [i32; 3]) -> Self {
        let from = corners[near];
        let add = |k: usize| from[k].saturating_add(offset[k]);
        let point = Some([add(0), add(1), add(2)]).filter(|&point| on_lattice(point));
        let mut apart = [[0.0; 3]; 4];
        let mut largest = offset.iter().fold(0, |m, x| m | x.unsigned_abs());
        for (apart, corner) in apart.iter_mut().zip(corners) {
            for k in 0..3 {
                let d = corner[k] - from[k];
                largest |= d.unsigned_abs();
                apart[k] = f64::from(d);
            }
        }
        let to = [f64::from(offset[0]), f64::from(offset[1]), f64::from(offset[2])];
        // Components below 2^16 make minors below 2^33 and sums of three products below 2^51.
        Self { corners: *corners, near, point, to, apart, exact: largest < 1 << 16 }
    }

    /// The sine of the angle at which the new vertex lies over a face at the near vertex; none if it does not lie over it, or
    /// off every lattice.
    #[inline]
    fn elevation(&self, face: usize) -> Option<f64> {
        let point = self.point?;
        // In this order the normal of the face points into the tetrahedron.
        let [_, _, i, j] = TURN[(4 * self.near + face) % 16].map(|corner| corner as usize & 3);
        let (a, b) = (self.apart[i], self.apart[j]);
        let normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        let height = dot(normal, self.to);
        let is_over = if self.exact {
            height > 0.0
        } else {
            let mut with = self.corners;
            with[face] = point;
            orient3d(with[0], with[1], with[2], with[3]) > 0
        };
        let lengths = (dot(normal, normal) * dot(self.to, self.to)).sqrt();
        is_over.then(|| height.abs() / lengths.max(1e-300))
    }
}

/// What removes the stars of updates that have been applied, so that it need not be predicted again.
#[derive(Clone, Debug)]
pub(in crate::mt) struct KnownStars {
    /// Where each begins, and one more.
    starts: PagedArray<u32>,
    /// For each: how many removers; for each tetrahedron in canonical order four bits for the remover, 15 for none, and four for
    /// the inner faces; and the removers.
    bytes: Vec<u8>,
    /// Bytes of those that were forgotten.
    waste: usize,
}

/// Removers that a known star can have.
const FEW: usize = 15;

impl Default for KnownStars {
    fn default() -> Self {
        Self { starts: PagedArray::new(0), bytes: Vec::new(), waste: 0 }
    }
}

impl KnownStars {
    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        (self.starts.bytes() + size_of_val(&self.bytes[..])) as u64
    }

    /// Enters what is known of the star of `u`, which is in canonical order; false if nothing is.
    #[inline]
    pub fn recall(&self, u: u32, scratch: &mut Scratch) -> bool {
        let Some(record) = self.starts.get(u).checked_sub(1).and_then(|at| self.bytes.get(at as usize..))
        else {
            return false;
        };
        let Some((&count, rest)) = record.split_first() else { return false };
        let Some((marks, removers)) = rest.split_at_checked(scratch.star_len) else { return false };
        let Some(removers) = removers.get(..4 * usize::from(count)) else { return false };
        let mut known = [NONE; FEW + 1];
        for (known, bytes) in known.iter_mut().zip(removers.chunks_exact(4)) {
            *known = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        }
        known[FEW] = NONE;
        let Scratch { star, sorted, .. } = scratch;
        for (&mark, &place) in marks.iter().zip(&*sorted) {
            let new = &mut star[place as usize % MOST];
            (new.remover, new.inner) = (known[usize::from(mark & 15)], mark >> 4);
        }
        true
    }

    /// Takes note of the star of `u`, which is in canonical order.
    pub fn keep(&mut self, u: u32, scratch: &Scratch) {
        let first = self.bytes.len();
        let Ok(start) = u32::try_from(first + 1) else { return };
        let (mut known, mut count) = ([NONE; FEW], 0);
        self.bytes.push(0);
        for &place in &scratch.sorted {
            let NewTet { remover, inner, .. } = scratch.star[place as usize % MOST];
            let at = match remover {
                NONE => FEW,
                _ => known[..count].iter().position(|&other| other == remover).unwrap_or(count),
            };
            if remover != NONE && at == count {
                let Some(next) = known.get_mut(count) else {
                    self.bytes.truncate(first);
                    return;
                };
                *next = remover;
                count += 1;
            }
            self.bytes.push(at as u8 | inner << 4);
        }
        self.bytes[first] = count as u8;
        known[..count].iter().for_each(|remover| self.bytes.extend(remover.to_le_bytes()));
        self.starts.set(u, start);
    }

    /// Forgets the stars of updates that go.
    pub fn forget(&mut self, updates: std::ops::Range<u32>) {
        self.waste += updates.clone().filter(|&u| self.starts.get(u) > 0).count() * USUAL;
        self.starts.forget(updates);
        if 2 * self.waste > self.bytes.len() {
            *self = Self::default();
        }
    }
}

/// Bytes of a known star, as a rule.
const USUAL: usize = 40;
