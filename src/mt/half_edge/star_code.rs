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

use super::new_star::{ByCorner, MOST, NEW, NewTet};
use super::places::{Places, Way, larger, minus};
use super::scratch::{Hashes, Scratch, spread};
use super::store::{ForestChild, HalfEdgeMt};
use crate::mesh::NONE;
use crate::mt::mesh::paged_array::PagedArray;
use crate::mt::ranks::rank;
use crate::mt::{CurrentMesh, UpdateId};
use arrayvec::ArrayVec;
use std::mem::take;

/// Most candidates that have a rank.
const RANKED: usize = 8;

/// Candidates are ranked until what is left has less weight than this.
const LEFT: f64 = 1.0 / 64.0;

/// Stands for the place of a candidate where nothing removes a tetrahedron.
const NO_CANDIDATE: u16 = u16::MAX;

/// Stands for a remover that has no rank.
const FURTHER: u32 = NONE - 1;

/// A forest child of a vertex of the star that comes later: it may remove the tetrahedra at its near vertex.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    /// Its near vertex, as a corner of tetrahedra of the star.
    near: u8,
    update: u32,
    way: Way,
}

impl Candidate {
    fn new(near: u8, child: &ForestChild) -> Self {
        Self { near, update: child.update, way: Way::new(child.offset) }
    }
}

/// A candidate for the removal of a tetrahedron, or none of them, or one of those without a rank.
#[derive(Clone, Copy, Debug, Default)]
struct Choice {
    remover: u32,
    /// Its place among the candidates of the star.
    candidate: u16,
}

/// The choices for a tetrahedron, in the order of the candidates; what is left comes last.
#[derive(Clone, Debug, Default)]
struct Choices {
    all: [Choice; RANKED + 1],
    weights: [f64; RANKED + 1],
    len: usize,
    /// What the candidates so far leave, and their largest weight.
    left: f64,
    largest: f64,
    /// The sum of the corners.
    sum: [f64; 3],
}

/// Forest children of a vertex of the star that come later.
#[derive(Clone, Copy)]
struct Later<'a> {
    /// The update of the first; [`NONE`] if there are no children.
    first: u32,
    /// The vertex, as a corner of tetrahedra of the star.
    near: u8,
    children: &'a [ForestChild],
}

impl<'a> Later<'a> {
    #[inline]
    fn new(near: u8, children: &'a [ForestChild]) -> Self {
        Self { first: children.first().map_or(NONE, |child| child.update), near, children }
    }
}

/// Where the next update of ascending lists is, merged.
#[inline]
fn least(lists: &[Later<'_>]) -> Option<usize> {
    let (mut at, mut least) = (None, NONE);
    for (i, list) in lists.iter().enumerate() {
        if list.first < least {
            (at, least) = (Some(i), list.first);
        }
    }
    at
}

/// The next update of ascending lists, merged, and its near vertex.
fn pop_least<'a>(lists: &mut [Later<'a>]) -> Option<(u8, &'a ForestChild)> {
    let list = &mut lists[least(lists)?];
    let (child, rest) = list.children.split_first()?;
    *list = Later::new(list.near, rest);
    Some((list.near, child))
}

/// Lists of the vertices of a star.
type Lists<'a> = ArrayVec<Later<'a>, MOST>;

/// The tetrahedra of a star that are in a set, a bit for each.
type TetSet = [u64; MOST / 64];

/// Scratch space: what may remove each tetrahedron of a star.
#[derive(Clone, Debug)]
pub(in crate::mt) struct StarCode {
    choices: Vec<Choices>,
    /// Those that have a rank in a tetrahedron, ascending; then those that remove one without a rank.
    candidates: Vec<Candidate>,
    /// How many candidates there are at each vertex, and the tetrahedra around it.
    counts: ByCorner<u32>,
    around: ByCorner<TetSet>,
    /// What has to be stored, by rising certainty: see [`entry`].
    order: Vec<u64>,
    /// What removes each tetrahedron, [`NONE`] if nothing does, 0 as long as that is not known: no update that comes later has this number.
    /// Also that of [`NO_ENTRY`] is not known.
    known: ByCorner<u32>,
    /// The candidate that removes each tetrahedron, by its place; beyond all if none does.
    chosen: [u16; MOST],
    /// When a code is written: the hashes, what removes the tetrahedra, and the code so far.
    hashes: Hashes,
    truth: Vec<(u32, u8)>,
    symbols: Vec<u8>,
    bits: Vec<bool>,
}

impl Default for StarCode {
    fn default() -> Self {
        Self {
            choices: Vec::new(),
            candidates: Vec::new(),
            counts: [0; _],
            around: [[0; _]; _],
            order: Vec::new(),
            known: [0; _],
            chosen: [0; _],
            hashes: Hashes::default(),
            truth: Vec::new(),
            symbols: Vec::new(),
            bits: Vec::new(),
        }
    }
}

/// Writes or reads what cannot be predicted.
trait CodeIo {
    /// Which of the choices it is, given their weights and the first of those that come first.
    fn choose(&mut self, tet: usize, choices: &[Choice], weights: &[f64], first: usize) -> Option<usize>;
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
    fn choose(&mut self, _: usize, _: &[Choice], weights: &[f64], first: usize) -> Option<usize> {
        match usize::from(self.symbol()) {
            0 => Some(first),
            rank => (0..weights.len()).find(|&choice| rank_of(choice, weights) == rank),
        }
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
    fn choose(&mut self, tet: usize, choices: &[Choice], weights: &[f64], _: usize) -> Option<usize> {
        let remover = self.truth[tet].0;
        let find = |remover: u32| choices.iter().position(|choice| choice.remover == remover);
        let choice = find(remover).or_else(|| find(FURTHER))?;
        self.symbols.push(rank_of(choice, weights) as u8);
        Some(choice)
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
        scratch: &mut Scratch,
        code: &mut StarCode,
    ) -> Option<()> {
        let star = self.update(u)?.star;
        let (symbols, bits) = match star.split_first() {
            Some((&count, rest)) => rest.split_at_checked(usize::from(count))?,
            None => (star, star),
        };
        let Scratch { star, star_len, link, link_len, places, hashes, .. } = scratch;
        let vertex = self.vertex(u);
        let children = |corner: u8| {
            let label = if corner == NEW { vertex } else { mesh.vertex(link[usize::from(corner)]) };
            later(self.children_of(label), u)
        };
        let around = Around { link_len: *link_len, places, hashes, children: &children };
        code.run(&around, &mut star[..*star_len], &mut Reader { symbols, bits, at: 0 })
    }
}

impl StarCode {
    /// Appends the code of the star of `u`, whose tetrahedra have what removes them; its vertices are at `places`. `link` has the labels of
    /// its link, `children` the forest children of a vertex. None if it has no code.
    pub(super) fn write<'a>(
        &mut self,
        (u, vertex): (UpdateId, u32),
        star: &mut [NewTet],
        link: impl ExactSizeIterator<Item = u32> + Clone,
        places: &Places,
        children: impl Fn(u32) -> &'a [ForestChild],
        out: &mut Vec<u8>,
    ) -> Option<()> {
        let (mut hashes, mut truth) = (take(&mut self.hashes), take(&mut self.truth));
        hashes.set(link.clone(), vertex, star);
        truth.clear();
        truth.extend(star.iter().map(|new| (new.remover, new.inner)));
        let (mut symbols, mut bits) = (take(&mut self.symbols), take(&mut self.bits));
        symbols.clear();
        bits.clear();
        let children = |corner: u8| {
            let label = if corner == NEW { Some(vertex) } else { link.clone().nth(usize::from(corner)) };
            label.map_or(&[][..], |label| later(children(label), u))
        };
        let around = Around { link_len: link.len(), places, hashes: &hashes, children: &children };
        let mut writer = Writer { truth: &truth, symbols, bits };
        let done = self.run(&around, star, &mut writer).and_then(|()| writer.finish(out));
        (symbols, bits) = (writer.symbols, writer.bits);
        (self.hashes, self.truth) = (hashes, truth);
        (self.symbols, self.bits) = (symbols, bits);
        done
    }

    /// Finds what removes the tetrahedra of a star.
    fn run<'a>(&mut self, around: &Around<'_, 'a>, star: &mut [NewTet], io: &mut dyn CodeIo) -> Option<()> {
        star.iter_mut().for_each(|new| (new.remover, new.inner) = (NONE, 0));
        let mut lists = Lists::new();
        self.find_children(around, &mut lists);
        if lists.is_empty() {
            return Some(());
        }
        self.rank(&mut lists, around.places, star);
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

/// What surrounds a new vertex.
struct Around<'s, 'a> {
    link_len: usize,
    places: &'s Places,
    hashes: &'s Hashes,
    /// The forest children of a vertex that come later, by its corner.
    children: &'s dyn Fn(u8) -> &'a [ForestChild],
}

/// Levels of certainty.
const CERTAINTIES: f64 = 4095.0;

/// The place of something in the order of rising certainty, with its tetrahedron and face in the lowest bits. Ties are broken by a hash,
/// of which this has the first bits.
fn entry(certainty: f64, hash: u64, tet: usize, face: u8) -> u64 {
    let level = (certainty.clamp(0.0, 1.0) * CERTAINTIES) as u64;
    level << 52 | hash >> 28 << 16 | (tet as u64) << 8 | u64::from(face)
}

/// Tetrahedron and face of such a number.
fn parts(entry: u64) -> (usize, u8) {
    (usize::from((entry >> 8) as u8), entry as u8)
}

/// Sorts entries, given the hashes of tetrahedra and faces.
fn sort_entries(entries: &mut [u64], hash: impl Fn(usize, u8) -> u64) {
    if sort_by_first_bits(entries).is_some() {
        return;
    }
    entries.sort_unstable();
    // Those that are equal but for tetrahedra and faces are neighbours now: whole hashes decide, and few entries move.
    let whole = |entry: u64| (entry >> 52, hash(parts(entry).0, parts(entry).1 & 3) >> 12, entry);
    for i in 1..entries.len() {
        let mut at = i;
        while at > 0 && whole(entries[at]) < whole(entries[at - 1]) {
            entries.swap(at, at - 1);
            at -= 1;
        }
    }
}

/// Sorts entries by their first bits, without branches. None if there are too many, or two are equal in these bits.
fn sort_by_first_bits(entries: &mut [u64]) -> Option<()> {
    let (mut keys, mut ranks) = ([i32::MAX; FEW_ENTRIES], [0; FEW_ENTRIES]);
    keys.get_mut(..entries.len())?
        .iter_mut()
        .zip(&*entries)
        .for_each(|(key, entry)| *key = (entry >> 33) as i32);
    rank(&keys, entries.len(), &mut ranks);
    let mut sorted = [u64::MAX; FEW_ENTRIES];
    entries.iter().zip(ranks).for_each(|(&entry, rank)| sorted[rank as usize % FEW_ENTRIES] = entry);
    let sorted = &sorted[..entries.len()];
    // Equal ones have the same rank: then a place is empty.
    sorted.iter().all(|&entry| entry != u64::MAX).then(|| entries.copy_from_slice(sorted))
}

/// More entries than this are sorted as a list.
const FEW_ENTRIES: usize = 32;

/// The place of a choice by falling weight; equal ones are in their order.
fn rank_of(choice: usize, weights: &[f64]) -> usize {
    let own = weights[choice];
    let (before, after) = weights.split_at(choice);
    before.iter().filter(|&&weight| weight >= own).count()
        + after.iter().filter(|&&weight| weight > own).count()
}

impl StarCode {
    /// Finds the forest children that come later at the vertices of the star; where there are none, there is no list.
    fn find_children<'a>(&mut self, around: &Around<'_, 'a>, lists: &mut Lists<'a>) {
        for near in (0..around.link_len as u8).chain([NEW]) {
            let children = (around.children)(near);
            self.counts[usize::from(near)] = children.len() as u32;
            self.around[usize::from(near)] = TetSet::default();
            if !children.is_empty() {
                lists.push(Later::new(near, children));
            }
        }
    }

    /// Finds the choices for each tetrahedron.
    ///
    /// The lists are merged. Each candidate is weighed in the tetrahedra around its near vertex that are still open: that rank more of them.
    fn rank(&mut self, lists: &mut Lists<'_>, places: &Places, star: &[NewTet]) {
        let Self { choices, candidates, counts, around, .. } = self;
        if choices.len() < star.len() {
            choices.resize_with(star.len(), Choices::default);
        }
        let mut open = TetSet::default();
        for (i, (new, choices)) in star.iter().zip(&mut *choices).enumerate() {
            let (half, bit) = (i / 64, 1 << (i % 64));
            open[half] |= bit;
            new.corners.iter().for_each(|&corner| around[usize::from(corner)][half] |= bit);
            let [a, b, c, d] = new.corners.map(|corner| places.from[usize::from(corner)]);
            choices.sum = [0, 1, 2].map(|k| a[k] + b[k] + c[k] + d[k]);
            (choices.len, choices.left, choices.largest) = (0, 1.0, 0.0);
        }
        candidates.clear();
        while let Some(at) = least(lists) {
            let Later { near, children, .. } = lists[at];
            let Some((child, rest)) = children.split_first() else { break };
            let candidate = Candidate::new(near, child);
            let place = candidates.len() as u16;
            candidates.push(candidate);
            let from = places.from[usize::from(near)].map(|x| 4.0 * x);
            let mut is_open = false;
            for (half, open) in open.iter_mut().enumerate().take(star.len().div_ceil(64)) {
                let (around, mut still) = (around[usize::from(near)][half], *open);
                let mut bits = around & still;
                while bits != 0 {
                    let choices = &mut choices[64 * half + bits.trailing_zeros() as usize];
                    let share = candidate.way.share(minus(choices.sum, from));
                    let weight = choices.left * share;
                    choices.all[choices.len % RANKED] =
                        Choice { remover: candidate.update, candidate: place };
                    choices.weights[choices.len % RANKED] = weight;
                    choices.largest = larger(choices.largest, weight);
                    choices.len += 1;
                    choices.left *= 1.0 - share;
                    if choices.len == RANKED || choices.left < LEFT {
                        still ^= bits & bits.wrapping_neg();
                    }
                    bits &= bits - 1;
                }
                *open = still;
                is_open |= around & still != 0;
            }
            if is_open && !rest.is_empty() {
                lists[at] = Later::new(near, rest);
            } else {
                lists.swap_remove(at);
            }
        }
        for (new, Choices { all, weights, len, left, largest, .. }) in star.iter().zip(choices) {
            let [a, b, c, d] = new.corners.map(|corner| u64::from(counts[usize::from(corner)]));
            let remover = if a + b + c + d > *len as u64 { FURTHER } else { NONE };
            all[*len] = Choice { remover, ..Choice::default() };
            weights[*len] = *left;
            *largest = larger(*largest, *left);
            *len += 1;
        }
    }

    fn find_removers<'a>(
        &mut self,
        around: &Around<'_, 'a>,
        star: &mut [NewTet],
        io: &mut dyn CodeIo,
    ) -> Option<()> {
        self.order.clear();
        for (i, choices) in self.choices[..star.len()].iter().enumerate() {
            // What can only be one thing is not stored.
            self.known[i] = if choices.len == 1 { NONE } else { 0 };
            if choices.len > 1 {
                self.order.push(entry(choices.largest, around.hashes.tets[i], i, 0));
            }
        }
        self.chosen[..star.len()].fill(NO_CANDIDATE);
        sort_entries(&mut self.order, |i, _| around.hashes.tets[i]);
        for at in 0..self.order.len() {
            let (i, _) = parts(self.order[at]);
            let Choices { all, weights, len, .. } = &mut self.choices[i];
            let (choices, weights) = (&all[..*len], &mut weights[..*len]);
            let known = star[i].across.map(|n| self.known[usize::from(n)]);
            let first = weigh_by_neighbors(choices, weights, known);
            let choice = *choices.get(io.choose(i, choices, weights, first)?)?;
            let place = match choice.remover {
                NONE => NO_CANDIDATE,
                FURTHER => self.further(around, &star[i], i, io)?,
                _ => choice.candidate,
            };
            let remover = self.candidates.get(usize::from(place)).map_or(NONE, |candidate| candidate.update);
            (self.chosen[i], self.known[i], star[i].remover) = (place, remover, remover);
        }
        Some(())
    }

    /// The place of the candidate without a rank that is stored by its number, or of none.
    #[cold]
    fn further<'a>(
        &mut self,
        around: &Around<'_, 'a>,
        new: &NewTet,
        i: usize,
        io: &mut dyn CodeIo,
    ) -> Option<u16> {
        let mut rest = new.corners.map(|corner| Later::new(corner, (around.children)(corner)));
        // All choices but the last have a rank.
        for _ in 1..self.choices[i].len {
            pop_least(&mut rest)?;
        }
        let mut index_of = |remover: u32| {
            if remover == NONE {
                return Some(0);
            }
            let mut next = rest;
            let mut popped = (1..).map_while(|index| Some((index, pop_least(&mut next)?.1.update)));
            popped.find(|found| found.1 == remover).map(|found| found.0)
        };
        let index = io.further(i, &mut index_of)?;
        let mut found = None;
        for _ in 0..index {
            found = Some(pop_least(&mut rest)?);
        }
        let Some((near, child)) = found else { return Some(NO_CANDIDATE) };
        self.candidates.push(Candidate::new(near, child));
        Some(self.candidates.len() as u16 - 1)
    }

    fn find_inner<'a>(&mut self, around: &Around<'_, 'a>, star: &mut [NewTet], io: &mut dyn CodeIo) {
        self.order.clear();
        // Those that are not stored are as predicted.
        let bits = io.bits_left();
        for (i, new) in star.iter_mut().enumerate() {
            let Some(candidate) = self.candidates.get(usize::from(self.chosen[i])) else { continue };
            let near = new.corners.iter().position(|&corner| corner == candidate.near).unwrap_or(0);
            // Across the face opposite the new vertex, and across those of the boundary, nothing is known.
            let (mut same, mut later) = (0_u8, 0_u8);
            for (face, n) in new.across.into_iter().enumerate() {
                let other = self.known[usize::from(n)];
                same |= u8::from(other == new.remover) << face;
                later |= u8::from(other > new.remover) << face;
            }
            let at_near = !(1 << near) & 15;
            new.inner = same & at_near;
            let mut open = !(same | later) & at_near;
            while open != 0 {
                let face = open.trailing_zeros() as usize & 3;
                open &= open - 1;
                let Some(sine) = around.places.elevation(new, [near, face], &candidate.way) else {
                    new.inner |= 1 << face;
                    continue;
                };
                let guess = u8::from(sine < STEEP);
                if bits == 0 {
                    new.inner |= guess << face;
                    continue;
                }
                let hash = around.hashes.of_face(i, new.corners[face]);
                self.order.push(entry((sine - STEEP).abs(), hash, i, face as u8 | guess << 7));
            }
        }
        let stored = bits.min(self.order.len());
        if stored > 0 {
            let hash = |i: usize, face: u8| around.hashes.of_face(i, star[i].corners[usize::from(face)]);
            sort_entries(&mut self.order, hash);
        }
        for (at, &entry) in self.order.iter().enumerate() {
            let (i, face) = parts(entry);
            let (face, guess) = (usize::from(face & 3), face >> 7 == 1);
            let is_inner = if at < stored { io.is_inner(i, face, guess) } else { guess };
            star[i].inner |= u8::from(is_inner) << face;
        }
    }
}

/// How much more likely a candidate is that removes a neighbour, and how much less one that leaves it: a power of 2, so that weights are
/// exact whatever the order of the neighbours.
const AGREEMENT: f64 = 8.0;

/// By how many neighbours that it removes, less those that it leaves, from −4 on.
const FACTORS: [f64; 9] = {
    let mut factors = [1.0; 9];
    let mut i = 0;
    while i < 4 {
        factors[5 + i] = factors[4 + i] * AGREEMENT;
        factors[3 - i] = factors[4 - i] / AGREEMENT;
        i += 1;
    }
    factors
};

/// Weighs the choices for a tetrahedron again by the removers of its neighbours in the star, as far as these are known: T_u is connected.
/// Returns the first of those with the largest weight.
#[inline]
fn weigh_by_neighbors(choices: &[Choice], weights: &mut [f64], known: [u32; 4]) -> usize {
    let last = choices.len().saturating_sub(1);
    let (mut first, mut largest) = (0, f64::NEG_INFINITY);
    for (i, (choice, weight)) in choices.iter().zip(weights).enumerate() {
        let same = known.map(|other| u32::from(other == choice.remover));
        // What is removed later than the candidate, or never, was left by it.
        let left = known.map(|other| u32::from(other > choice.remover));
        let factor = 4 + same.iter().sum::<u32>() - left.iter().sum::<u32>();
        // What is left is no candidate.
        *weight *= if i == last { 1.0 } else { FACTORS[factor as usize % FACTORS.len()] };
        // Which is larger is a coin toss for the processor.
        let is_larger = usize::from(*weight > largest).wrapping_neg();
        (first, largest) = (i & is_larger | first & !is_larger, larger(*weight, largest));
    }
    first
}

/// Faces over which the new vertex lies at a larger sine than this are guessed to stay.
const STEEP: f64 = 0.35;

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

    /// Enters what is known of the star of `u`, which has been hashed; false if nothing is.
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
        let Scratch { star, hashes, .. } = scratch;
        for (&mark, place) in marks.iter().zip(in_order(hashes.tets.iter().copied())) {
            let new = &mut star[place % MOST];
            (new.remover, new.inner) = (known[usize::from(mark & 15)], mark >> 4);
        }
        true
    }

    /// Takes note of the star of `u`, unless that is known: these are its tetrahedra.
    pub fn keep(&mut self, u: u32, star: &[u32], mesh: &CurrentMesh) {
        if self.starts.get(u) > 0 {
            return;
        }
        let first = self.bytes.len();
        let Ok(start) = u32::try_from(first + 1) else { return };
        let (mut known, mut count) = ([NONE; FEW], 0);
        self.bytes.push(0);
        let hash = |v: u32| spread(mesh.vertex(v).0);
        let hashes =
            star.iter().map(|&t| mesh.tets[t as usize].map(hash).into_iter().fold(0, u64::wrapping_add));
        for place in in_order(hashes) {
            let t = star[place];
            let (remover, inner) = (mesh.tag(t), mesh.tet_byte(t));
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

/// The places of the tetrahedra of a star in canonical order: that of their hashes.
fn in_order(hashes: impl Iterator<Item = u64>) -> impl Iterator<Item = usize> {
    const PLACE: u64 = MOST as u64 - 1;
    let mut sorted: ArrayVec<u64, MOST> = (0..).zip(hashes).map(|(i, hash)| hash & !PLACE | i).collect();
    sorted.sort_unstable();
    sorted.into_iter().map(|entry| (entry & PLACE) as usize)
}

/// Bytes of a known star, as a rule.
const USUAL: usize = 40;

#[cfg(test)]
mod tests {
    use super::*;

    /// Few or many, and with hashes that differ in their last bits alone.
    #[test]
    fn entries_are_in_the_order_of_their_certainty_and_whole_hashes() {
        for (count, shift) in [(1, 0), (9, 50), (9, 20), (20, 36), (20, 12), (33, 50), (100, 36), (100, 12)] {
            let hashes: Vec<u64> = (0..count).map(|i| spread(i) >> shift).collect();
            let certainty = |i: usize| [0.25, 0.5, 0.75][i % 3];
            let hash = |i: usize, face: u8| hashes[i].wrapping_add(u64::from(face) << 12);
            let all = || (0..hashes.len()).flat_map(|i| [(i, 0), (i, 3)]);
            let mut entries: Vec<u64> =
                all().map(|(i, face)| entry(certainty(i), hash(i, face), i, face)).collect();
            sort_entries(&mut entries, hash);
            let mut expected: Vec<(usize, u8)> = all().collect();
            expected.sort_by_key(|&(i, face)| (i % 3, hash(i, face) >> 12, i, face));
            assert_eq!(entries.into_iter().map(parts).collect::<Vec<_>>(), expected, "{count}, {shift}");
        }
    }
}
