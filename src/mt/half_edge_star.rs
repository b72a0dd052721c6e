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

use super::CurrentMesh;
use super::Sparse;
use super::UpdateId;
use super::half_edge::ForestChild;
use super::half_edge::HalfEdgeMt;
use super::half_edge_apply::MOST;
use super::half_edge_apply::NO_ENTRY;
use super::half_edge_apply::NewTet;
use super::half_edge_apply::Scratch;
use crate::geom::orient3d;
use crate::mesh::NONE;

/// Most candidates that have a rank.
const RANKED: usize = 8;

/// Candidates are ranked until what is left has less weight than this.
const LEFT: f64 = 1.0 / 64.0;

/// Stands for a remover that has no rank.
const FURTHER: u32 = NONE - 1;

/// An update that may remove tetrahedra of a star.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    child: ForestChild,
    /// Its near vertex.
    near: u8,
}

/// A candidate for the removal of a tetrahedron, or none of them, or one of those without a rank.
#[derive(Clone, Copy, Debug, Default)]
struct Choice {
    weight: f64,
    /// The weight before neighbours were looked at.
    first_weight: f64,
    remover: u32,
    /// Which of the candidates it is.
    candidate: u16,
    /// The corner of the tetrahedron that is its near vertex.
    corner: u8,
}

/// The choices for a tetrahedron, in the order of the candidates; what is left comes last.
#[derive(Clone, Debug, Default)]
struct Choices {
    all: [Choice; RANKED + 1],
    len: usize,
    /// The weight that none of them has.
    left: f64,
    /// Whether there are candidates that are none of them.
    more: bool,
}

/// Scratch space: what may remove each tetrahedron of a star.
#[derive(Clone, Debug, Default)]
pub(super) struct StarCode {
    /// Those that can have a rank, ascending by update.
    candidates: Vec<Candidate>,
    /// Tetrahedra and which of their corners it is, vertex by vertex.
    corners: Vec<(u8, u8)>,
    /// Where those of each vertex begin.
    starts: Vec<u32>,
    choices: Vec<Choices>,
    /// The sum of the corners of each tetrahedron.
    sums: Vec<[i64; 3]>,
    /// The corners of each tetrahedron.
    tets: Vec<[[i32; 3]; 4]>,
    /// The vertices of the link, and then the new one.
    positions: Vec<[i32; 3]>,
    /// What is to be told, by rising certainty: a key, tetrahedron and face.
    order: Vec<(u64, u8, u8)>,
    /// The corner of each tetrahedron that is the near vertex of its remover.
    near: Vec<u8>,
    /// Where the vertex lies that its remover inserts.
    aims: Vec<[i32; 3]>,
    hashes: Vec<u64>,
    /// Of which tetrahedra the remover is known by now.
    told: Vec<bool>,
}

/// Tells, or is told, what cannot be predicted.
trait Teller {
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

impl Teller for Reader<'_> {
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

impl Teller for Writer<'_> {
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
    pub(super) fn find_removers(
        &self,
        mesh: &CurrentMesh,
        u: UpdateId,
        position: [i32; 3],
        scratch: &mut Scratch,
    ) -> Option<()> {
        let star = self.update(u)?.star;
        let (symbols, bits) = match star.split_first() {
            Some((&count, rest)) => rest.split_at_checked(usize::from(count))?,
            None => (star, star),
        };
        self.tell(mesh, u, position, scratch, &mut Reader { symbols, bits, at: 0 })
    }

    /// The code of a star, given the remover and the inner faces of each of its tetrahedra. None if it has none.
    pub(super) fn code_star(
        &self,
        mesh: &CurrentMesh,
        u: UpdateId,
        position: [i32; 3],
        scratch: &mut Scratch,
        truth: &[(u32, u8)],
    ) -> Option<Vec<u8>> {
        let mut writer = Writer { truth, symbols: Vec::new(), bits: Vec::new() };
        self.tell(mesh, u, position, scratch, &mut writer)?;
        let Writer { mut symbols, bits, .. } = writer;
        symbols.truncate(symbols.iter().rposition(|&s| s != 0).map_or(0, |last| last + 1));
        let used = bits.iter().rposition(|&bit| bit).map_or(0, |last| last + 1);
        if symbols.is_empty() && used == 0 {
            return Some(Vec::new());
        }
        let mut code = vec![u8::try_from(symbols.len()).ok()?];
        code.extend(symbols);
        for eight in bits[..used].chunks(8) {
            code.push((0..).zip(eight).fold(0, |byte, (i, &bit)| byte | u8::from(bit) << i));
        }
        Some(code)
    }

    fn tell(
        &self,
        mesh: &CurrentMesh,
        u: UpdateId,
        position: [i32; 3],
        scratch: &mut Scratch,
        teller: &mut impl Teller,
    ) -> Option<()> {
        let Scratch { star, star_len, link, link_len, code, sorted, hashes, .. } = scratch;
        let (star, link) = (&mut star[..*star_len], &link[..*link_len]);
        let vertex = self.vertex(u);
        let later = |v| {
            let children = self.children_of(v);
            &children[children.partition_point(|child| child.update <= u.0)..]
        };
        let lists: Vec<&[ForestChild]> =
            link.iter().map(|&slot| later(mesh.vertex(slot))).chain([later(vertex)]).collect();
        star.iter_mut().for_each(|new| (new.remover, new.inner) = (NONE, 0));
        if lists.iter().all(|list| list.is_empty()) {
            return Some(());
        }
        let around = Around { hashes, lists };
        code.positions.clear();
        code.positions.extend(link.iter().map(|&slot| mesh.positions[slot as usize]));
        code.positions.push(position);
        code.hashes.clear();
        code.hashes.resize(star.len(), 0);
        sorted.iter().for_each(|&(hash, i)| code.hashes[i as usize % MOST] = hash);
        code.find_removers(&around, star, teller)?;
        code.find_inner(&around, star, teller);
        Some(())
    }
}

/// What surrounds a new vertex, by index into its link; the vertex itself is the last.
struct Around<'a> {
    hashes: &'a [u64],
    /// The forest children that come later.
    lists: Vec<&'a [ForestChild]>,
}

impl<'a> Around<'a> {
    fn list(&self, corner: u8) -> &'a [ForestChild] {
        self.lists[usize::from(corner).min(self.lists.len() - 1)]
    }

    fn lists_of(&self, new: &NewTet) -> [&'a [ForestChild]; 4] {
        new.corners.map(|corner| self.list(corner))
    }
}

/// Spreads a label over the bits of a word (the constants are those of SplitMix64).
#[inline]
pub(super) fn spread(label: u32) -> u64 {
    let x = u64::from(label).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ x >> 31
}

/// Certainties are told apart to this many levels.
const CERTAINTIES: f64 = 4095.0;

/// The place of something in the order of rising certainty, ties broken by a hash.
fn key(certainty: f64, hash: u64) -> u64 {
    let level = (certainty.clamp(0.0, 1.0) * CERTAINTIES) as u64;
    level << 52 | hash >> 12
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
        teller: &mut impl Teller,
    ) -> Option<()> {
        self.list_corners(star);
        self.list_candidates(around);
        self.rank(around, star);
        self.told.clear();
        self.order.clear();
        for (i, choices) in self.choices[..star.len()].iter().enumerate() {
            // What can only be one thing is not told.
            self.told.push(choices.len == 1);
            if choices.len > 1 {
                let largest =
                    choices.all[..choices.len].iter().fold(0.0, |w: f64, choice| w.max(choice.weight));
                self.order.push((key(largest, self.hashes[i]), i as u8, 0));
            }
        }
        self.near.clear();
        self.near.resize(star.len(), 0);
        self.aims.clear();
        self.aims.resize(star.len(), [0; 3]);
        self.order.sort_unstable();
        for at in 0..self.order.len() {
            let i = usize::from(self.order[at].1);
            let choices = &mut self.choices[i];
            let choices = &mut choices.all[..choices.len];
            weigh_by_neighbors(choices, star, i, &self.told);
            let choice = teller.choose(i, choices)?;
            self.told[i] = true;
            let (corner, child) = match choice.remover {
                NONE => continue,
                FURTHER => match self.further(around, &star[i], i, teller)? {
                    Some(found) => found,
                    None => continue,
                },
                _ => (choice.corner, self.candidates.get(usize::from(choice.candidate))?.child),
            };
            star[i].remover = child.update;
            self.near[i] = corner;
            let from = self.tets[i][usize::from(corner) & 3];
            self.aims[i] = [0, 1, 2].map(|k| from[k].saturating_add(child.offset[k]));
        }
        Some(())
    }

    /// Lists the candidates. A tetrahedron ranks no more of any vertex.
    fn list_candidates(&mut self, around: &Around<'_>) {
        self.candidates.clear();
        for (near, list) in (0..).zip(&around.lists) {
            self.candidates.extend(list.iter().take(RANKED).map(|&child| Candidate { child, near }));
        }
        self.candidates.sort_unstable_by_key(|candidate| candidate.child.update);
    }

    /// Lists the corners of the star, by tetrahedron and by vertex.
    fn list_corners(&mut self, star: &[NewTet]) {
        let newest = self.positions.len() - 1;
        let vertices = |new: &NewTet| new.corners.map(|corner| usize::from(corner).min(newest));
        self.tets.clear();
        self.sums.clear();
        self.starts.clear();
        self.starts.resize(newest + 2, 0);
        for new in star {
            let vertices = vertices(new);
            vertices.iter().for_each(|&x| self.starts[x] += 1);
            let [p, q, r, s] = vertices.map(|x| self.positions[x]);
            self.tets.push([p, q, r, s]);
            let sum = |k: usize| i64::from(p[k]) + i64::from(q[k]) + i64::from(r[k]) + i64::from(s[k]);
            self.sums.push([0, 1, 2].map(sum));
        }
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        self.corners.clear();
        self.corners.resize(4 * star.len(), (0, 0));
        for (i, new) in star.iter().enumerate().rev() {
            for (corner, x) in vertices(new).into_iter().enumerate() {
                self.starts[x] -= 1;
                self.corners[self.starts[x] as usize] = (i as u8, corner as u8);
            }
        }
    }

    /// The tetrahedra that a candidate may remove, each with the corner that is its near vertex.
    #[inline]
    fn reached(&self, candidate: &Candidate) -> std::ops::Range<usize> {
        let x = usize::from(candidate.near);
        self.starts[x] as usize..self.starts[x + 1] as usize
    }

    /// Finds the choices for each tetrahedron.
    fn rank(&mut self, around: &Around<'_>, star: &[NewTet]) {
        if self.choices.len() < star.len() {
            self.choices.resize_with(star.len(), Choices::default);
        }
        for choices in &mut self.choices[..star.len()] {
            (choices.len, choices.left, choices.more) = (0, 1.0, false);
        }
        for (number, candidate) in (0..).zip(&self.candidates) {
            let at = self.positions[usize::from(candidate.near)];
            let direction = Direction::new(candidate.child.offset);
            for &(i, corner) in &self.corners[self.reached(candidate)] {
                let choices = &mut self.choices[usize::from(i)];
                if choices.len >= RANKED || choices.left < LEFT {
                    choices.more = true;
                    continue;
                }
                let share = direction.share(self.sums[usize::from(i)], at);
                let weight = choices.left * share;
                let remover = candidate.child.update;
                choices.all[choices.len] =
                    Choice { weight, first_weight: weight, remover, candidate: number, corner };
                choices.len += 1;
                choices.left *= 1.0 - share;
            }
        }
        for (new, choices) in star.iter().zip(&mut self.choices) {
            let more = choices.more || new.corners.iter().any(|&x| around.list(x).len() > RANKED);
            let remover = if more { FURTHER } else { NONE };
            let weight = choices.left;
            choices.all[choices.len % (RANKED + 1)] =
                Choice { weight, first_weight: weight, remover, ..Choice::default() };
            choices.len += 1;
        }
    }

    /// The candidate without a rank that is told by its number, and the corner that is its near vertex; or that there is none.
    #[cold]
    fn further(
        &self,
        around: &Around<'_>,
        new: &NewTet,
        i: usize,
        teller: &mut impl Teller,
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
        let index = teller.further(i, &mut index_of)?;
        let mut found = None;
        for _ in 0..index {
            found = Some(pop_least(&lists, &mut rest)?);
        }
        Some(found)
    }

    fn find_inner(&mut self, around: &Around<'_>, star: &mut [NewTet], teller: &mut impl Teller) {
        self.order.clear();
        for i in 0..star.len() {
            let new = star[i];
            if new.remover == NONE {
                continue;
            }
            let corners = self.tets[i];
            let near = usize::from(self.near[i]) & 3;
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
                let mut with = corners;
                with[face] = self.aims[i];
                if !on_lattice(with[face]) || orient3d(with[0], with[1], with[2], with[3]) <= 0 {
                    star[i].inner |= 1 << face;
                    continue;
                }
                let sine = elevation(&corners, near, face, self.aims[i]);
                let face_hash = around.hashes[usize::from(new.corners[face]).min(around.hashes.len() - 1)]
                    .rotate_left(17);
                let key = key((sine - STEEP).abs(), self.hashes[i].wrapping_add(face_hash));
                let guess = u8::from(sine < STEEP);
                self.order.push((key, i as u8, face as u8 | guess << 7));
            }
        }
        // Those that are not told are as guessed.
        let told = teller.bits_left().min(self.order.len());
        if told > 0 {
            self.order.sort_unstable();
        }
        for (at, &(_, i, face)) in self.order.iter().enumerate() {
            let (i, face, guess) = (usize::from(i), usize::from(face & 3), face >> 7 == 1);
            let is_inner = if at < told { teller.is_inner(i, face, guess) } else { guess };
            if is_inner {
                star[i].inner |= 1 << face;
            }
        }
    }
}

/// How much more likely a candidate is that removes a neighbour, and how much less one that leaves it.
const AGREEMENT: f64 = 6.0;

/// Weighs the choices for tetrahedron `i` anew by what is known of its neighbours in the star: T_u hangs together.
fn weigh_by_neighbors(choices: &mut [Choice], star: &[NewTet], i: usize, told: &[bool]) {
    for (face, &n) in star[i].across.iter().enumerate() {
        let n = usize::from(n);
        if !told.get(n).is_some_and(|&told| told) {
            continue;
        }
        let other = star[n].remover;
        for choice in choices.iter_mut() {
            if choice.remover >= FURTHER || face == usize::from(choice.corner) {
                continue;
            }
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
fn pop_least(lists: &[&[ForestChild]; 4], next: &mut [u32; 4]) -> Option<(u8, ForestChild)> {
    let mut least: Option<(u8, ForestChild)> = None;
    for (k, list) in (0..).zip(lists) {
        if let Some(&child) = list.get(next[usize::from(k)] as usize)
            && least.is_none_or(|(_, other)| child.update < other.update)
        {
            least = Some((k, child));
        }
    }
    next[usize::from(least?.0)] += 1;
    least
}

/// From the near vertex of a candidate to the vertex that it inserts.
struct Direction {
    to: [f64; 3],
    squared: f64,
}

impl Direction {
    fn new(offset: [i32; 3]) -> Self {
        let to = offset.map(f64::from);
        Self { to, squared: dot(to, to) }
    }

    /// How likely the candidate removes a tetrahedron that no earlier one has removed, given the sum of its corners and the near
    /// vertex.
    #[inline]
    fn share(&self, sum: [i64; 3], at: [i32; 3]) -> f64 {
        let centre = [0, 1, 2].map(|k| (sum[k] - 4 * i64::from(at[k])) as f64);
        let lengths = (dot(centre, centre) * self.squared).sqrt();
        let cosine = dot(centre, self.to) / lengths.max(1e-300);
        let ratio = ((1.0 - cosine) / (1.0 + cosine).max(1e-9)).min(1e9);
        1.0 / (1.0 + ratio * ratio)
    }
}

#[inline]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Faces over which the new vertex lies at a larger sine than this are guessed to stay.
const STEEP: f64 = 0.35;

/// The sine of the angle at which a point lies over a face, seen from corner `near` of it.
fn elevation(corners: &[[i32; 3]; 4], near: usize, face: usize, point: [i32; 3]) -> f64 {
    let from = corners[near];
    let apart = |p: [i32; 3]| [0, 1, 2].map(|k| f64::from(p[k]) - f64::from(from[k]));
    let mut others = (0..4).filter(|&k| k != near && k != face);
    let (Some(i), Some(j)) = (others.next(), others.next()) else { return 0.0 };
    let (a, b) = (apart(corners[i]), apart(corners[j]));
    let normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let to = apart(point);
    let lengths = (dot(normal, normal) * dot(to, to)).sqrt();
    dot(normal, to).abs() / lengths.max(1e-300)
}

/// What removes the stars of updates that have been applied, so that it need not be predicted again.
#[derive(Clone, Debug)]
pub(super) struct KnownStars {
    /// Where each begins, and one more.
    starts: Sparse<u32>,
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
        Self { starts: Sparse::new(0), bytes: Vec::new(), waste: 0 }
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
        let Some((marks, removers)) = rest.split_at_checked(scratch.sorted.len()) else { return false };
        let Some(removers) = removers.get(..4 * usize::from(count)) else { return false };
        let mut known = [NONE; FEW + 1];
        for (known, bytes) in known.iter_mut().zip(removers.chunks_exact(4)) {
            *known = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        }
        known[FEW] = NONE;
        for (&mark, &(_, i)) in marks.iter().zip(&scratch.sorted) {
            let new = &mut scratch.star[i as usize % MOST];
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
        for &(_, i) in &scratch.sorted {
            let NewTet { remover, inner, .. } = scratch.star[i as usize % MOST];
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
