//! Predicts the split of a vertex from its star: files store residuals against the prediction.
//!
//! The star is the same in every consistent set, so the reader makes the same prediction as the writer. The prediction uses
//! the basic arithmetic of doubles, in an order that vertex numbers fix, and so is the same on every platform.
//! `docs/format.md` gives it as formulas.
//!
//! **Offsets.** Edges of the link often have the length and the direction of the new edge, so an offset may be stored as the
//! number of one and the difference to the step along it. **Sides.** A tetrahedron of the star goes rather to the
//! end of the offset that it lies towards. Those of which that is most certain are decided first, and each of the others
//! follows the majority of its neighbours that are decided. **Levels.** The field is taken to be linear: its gradient is
//! that of least squares over the link, near vertices counting more.

use super::star::{Ring, three};
use crate::mt::ranks::rank;
use crate::mt::{CurrentMesh, FieldInfo, MAX_EDGE, MAX_LINK, MAX_STAR};

/// The link of a vertex that is to be split, as far as guesses need it.
pub(in crate::mt) struct Link {
    /// For each vertex of the link its place in ascending order of vertex numbers.
    order: [i32; MAX_LINK],
    /// The vectors from the centre to the vertices of the link; whole numbers.
    spokes: [[f64; 3]; MAX_LINK],
    /// Their squared lengths.
    squares: [f64; MAX_LINK],
    /// How far along the offset they point: its length times the cosine of the angle to it.
    along: [f64; MAX_LINK],
}

impl Link {
    /// Looks at the link of the vertex at `centre`.
    pub fn new(ring: &Ring, mesh: &CurrentMesh, centre: [i32; 3]) -> Self {
        let mut link = Self {
            order: [0; MAX_LINK],
            spokes: [[0.0; 3]; MAX_LINK],
            squares: [1.0; MAX_LINK],
            along: [0.0; MAX_LINK],
        };
        let count = ring.link_len.min(MAX_LINK);
        let mut numbers = [i32::MAX; MAX_LINK];
        numbers[..count].copy_from_slice(&ring.numbers[..count]);
        rank(&numbers, count, &mut link.order);
        for (i, &slot) in ring.link[..count].iter().enumerate() {
            let position = mesh.positions[slot as usize];
            let spoke = [0, 1, 2].map(|k| i64::from(position[k]) - i64::from(centre[k]));
            // Below 2^63: coordinates have at most 30 bits.
            let square: i64 = spoke.iter().map(|x| x * x).sum();
            link.spokes[i] = spoke.map(|x| x as f64);
            link.squares[i] = square.max(1) as f64;
        }
        link
    }

    /// Sets the offset between the halves of the vertex, from which sides and levels are predicted.
    pub fn set_offset(&mut self, ring: &Ring, offset: [i32; 3]) {
        let offset = offset.map(i64::from);
        let count = ring.link_len.min(MAX_LINK);
        for (i, along) in self.along[..count].iter_mut().enumerate() {
            // Below 2^63: coordinates have at most 30 bits, offsets 31.
            let product: i64 = self.spokes[i].iter().zip(offset).map(|(x, d)| *x as i64 * d).sum();
            *along = product as f64 / self.squares[i].sqrt();
        }
    }

    /// The edges of the link as files count them: the places of their two ends, the larger one first, in descending order.
    fn edges(&self, ring: &Ring) -> impl Iterator<Item = [usize; 2]> + use<> {
        // For each place a bit for each smaller one that an edge leads to.
        let mut ends = [0_u32; MAX_LINK];
        for &corners in &ring.link_of[..ring.len.min(MAX_STAR)] {
            let [low, middle, most] =
                sorted(three(corners).map(|x| self.order[x % MAX_LINK] as usize % MAX_LINK));
            ends[middle] |= 1 << low;
            ends[most] |= 1 << low | 1 << middle;
        }
        (0..MAX_LINK).rev().flat_map(move |most| {
            let mut others = ends[most];
            std::iter::from_fn(move || {
                let other = others.checked_ilog2()?;
                others ^= 1 << other;
                Some([most, other as usize])
            })
        })
    }

    /// The step along the edge of the link with that number, counted from 1, in the direction in which the first coordinate
    /// that changes grows. None if there is no such edge.
    pub fn step(&self, ring: &Ring, edge: u8) -> Option<[i32; 3]> {
        let ends = self.edges(ring).nth(usize::from(edge).checked_sub(1)?)?;
        Some(self.step_between(&self.by_number(ring.link_len.min(MAX_LINK)), ends))
    }

    /// The step between the link vertices at two places, whose indices `places` has, in that direction.
    fn step_between(&self, places: &[u8; MAX_LINK], ends: [usize; 2]) -> [i32; 3] {
        let [a, b] = ends.map(|place| self.spokes[places[place] as usize % MAX_LINK]);
        // Coordinates have at most 30 bits.
        let step = [0, 1, 2].map(|k| (a[k] - b[k]) as i32);
        let is_back = step.into_iter().find(|&d| d != 0).is_some_and(|d| d < 0);
        if is_back { step.map(|d| -d) } else { step }
    }

    /// The residual of an offset: the difference to the step along an edge, and the number of that; or the offset and 0.
    pub fn residual_offset(&self, ring: &Ring, offset: [i32; 3], bits: u32) -> ([i32; 3], u8) {
        let places = self.by_number(ring.link_len.min(MAX_LINK));
        // What is not counted from an edge has no sign in its first component.
        let (mut residual, mut least) = ((offset, 0), length(offset).saturating_sub(8 + EDGE_COSTS));
        // A link that closes up has 96 edges at most; others may have a few that cannot be named.
        for (number, ends) in (1..=MAX_EDGE).zip(self.edges(ring)) {
            let step = self.step_between(&places, ends);
            let rest = [0, 1, 2].map(|k| offset[k].saturating_sub(step[k]));
            let fits = rest.iter().all(|d| d.unsigned_abs() <= 1 << bits);
            if fits && length(rest) < least {
                (residual, least) = ((rest, number), length(rest));
            }
        }
        residual
    }

    /// The order in which the sides of the star are stored, the least certain first, and a bit for each tetrahedron that
    /// lies rather towards `v''`.
    fn certainty(&self, ring: &Ring) -> ([u8; MAX_STAR], u64) {
        let mut keys = [i32::MAX; MAX_STAR];
        let mut away = 0;
        for (i, &corners) in ring.link_of[..ring.len.min(MAX_STAR)].iter().enumerate() {
            let corners = three(corners).map(|x| x % MAX_LINK);
            let [low, middle, most] = sorted(corners.map(|x| (self.order[x], x)));
            let sum = (self.along[low.1] + self.along[middle.1]) + self.along[most.1];
            away |= u64::from(sum < 0.0) << i;
            // Sixteen bits of how certain it is; where that is the same, in the order of the opposite faces.
            let certain = ((sum.abs() as f32).to_bits() >> 15) as i32;
            keys[i] = certain << 15 | low.0 << 10 | middle.0 << 5 | most.0;
        }
        let mut places = [0; MAX_STAR];
        rank(&keys, ring.len.min(MAX_STAR), &mut places);
        let mut order = [0; MAX_STAR];
        for (i, &place) in places[..ring.len.min(MAX_STAR)].iter().enumerate() {
            order[place as usize % MAX_STAR] = i as u8;
        }
        (order, away)
    }

    /// Goes through the star from the most certain tetrahedron to the least, guesses the side of each and lets `decide`
    /// turn the guess for that place of the order into the side. Bit `i` of the result is the side of tetrahedron `i`.
    fn walk(&self, ring: &Ring, mut decide: impl FnMut(usize, u64) -> u64) -> u64 {
        let (order, away) = self.certainty(ring);
        let (mut decided, mut sides) = (0_u64, 0_u64);
        for place in (0..ring.len.min(MAX_STAR)).rev() {
            let i = u32::from(order[place]) & 63;
            // A tetrahedron without a neighbour has itself for one, and is not decided yet.
            let votes: i32 = three(ring.beside[i as usize])
                .iter()
                .map(|&j| {
                    let counts = (decided >> (j & 63) & 1) as i32;
                    counts * (2 * (sides >> (j & 63) & 1) as i32 - 1)
                })
                .sum();
            let guess = if votes == 0 { away >> i & 1 } else { u64::from(votes > 0) };
            sides |= decide(place, guess) << i;
            decided |= 1 << i;
        }
        sides
    }

    /// Parts the star; the guesses at the places in `wrong` are. False if that names places beyond the star.
    pub fn part(&self, ring: &mut Ring, wrong: u64) -> bool {
        ring.sides = self.walk(ring, |place, guess| guess ^ (wrong >> place & 1));
        ring.len >= 64 || wrong >> ring.len == 0
    }

    /// The places at which the guesses are wrong: the inverse of [`Link::part`].
    pub fn wrong(&self, ring: &Ring, sides: u64) -> u64 {
        let (order, _) = self.certainty(ring);
        let mut wrong = 0;
        self.walk(ring, |place, guess| {
            let side = sides >> (order[place] & 63) & 1;
            wrong |= (side ^ guess) << place;
            side
        });
        wrong
    }

    /// What each vertex of the link counts in the guess of a level's offset: a guess is the sum of these times
    /// the differences to the level at the centre. All zero where the link leaves the gradient open.
    fn weights(&self, count: usize, offset: [i32; 3]) -> [f64; MAX_LINK] {
        let places = self.by_number(count);
        // The normal equations, a symmetric matrix: xx, xy, xz, yy, yz, zz.
        let mut m = [0.0; 6];
        for &i in &places[..count] {
            let ([x, y, z], w) = (self.spokes[i as usize], 1.0 / self.squares[i as usize]);
            for (sum, term) in m.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
                *sum += w * term;
            }
        }
        let [xx, xy, xz, yy, yz, zz] = m;
        let adjugate = [
            [yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy],
            [xz * yz - xy * zz, xx * zz - xz * xz, xy * xz - xx * yz],
            [xy * yz - xz * yy, xy * xz - xx * yz, xx * yy - xy * xy],
        ];
        let determinant = (xx * adjugate[0][0] + xy * adjugate[0][1]) + xz * adjugate[0][2];
        let mut weights = [0.0; MAX_LINK];
        if determinant > 1e-6 {
            let [x, y, z] = offset.map(f64::from);
            let solved = adjugate.map(|row| ((row[0] * x + row[1] * y) + row[2] * z) / determinant);
            for (i, weight) in weights.iter_mut().enumerate().take(count) {
                let [x, y, z] = self.spokes[i];
                *weight = ((x * solved[0] + y * solved[1]) + z * solved[2]) / self.squares[i];
            }
        }
        weights
    }

    /// The indices of the link vertices in ascending order of vertex numbers.
    fn by_number(&self, count: usize) -> [u8; MAX_LINK] {
        let mut places = [0; MAX_LINK];
        for (i, &place) in self.order[..count].iter().enumerate() {
            places[place as usize % MAX_LINK] = i as u8;
        }
        places
    }

    /// Guesses the offset of each of `fields`, for a centre in slot `p`.
    pub fn guess_levels(
        &self,
        ring: &Ring,
        mesh: &CurrentMesh,
        p: u32,
        offset: [i32; 3],
        fields: &[FieldInfo],
        mut predicted: impl FnMut(usize, i32),
    ) {
        let count = ring.link_len.min(MAX_LINK);
        let (weights, places) = (self.weights(count, offset), self.by_number(count));
        for (field, info) in fields.iter().enumerate() {
            let own = mesh.levels(p)[field];
            let mut sum = 0.0;
            for &i in &places[..count] {
                let level = mesh.levels(ring.link[i as usize])[field];
                sum += weights[i as usize] * f64::from(level - own);
            }
            // Rounded towards zero, and held within what a difference of levels can be.
            let largest = 1 << info.bits;
            predicted(field, (sum as i32).clamp(-largest, largest));
        }
    }
}

/// What the number of an edge takes in a file, in eighths of a bit; found by trying on several sets.
const EDGE_COSTS: u32 = 76;

/// About how much a vector takes in a file, in eighths of a bit.
fn length(vector: [i32; 3]) -> u32 {
    let length = |d: i32| {
        let x = 2 * u64::from(d.unsigned_abs()) + 1;
        8 * x.ilog2() + ((x << 3) >> x.ilog2() & 7) as u32
    };
    vector.map(length).iter().sum()
}

/// In ascending order.
fn sorted<T: Copy + Ord>([a, b, c]: [T; 3]) -> [T; 3] {
    let (low, high) = (a.min(b), a.max(b));
    [low.min(c), low.max(high.min(c)), high.max(c)]
}
