//! The vertices of a surface: which edge of the mesh each one lies on, and which vertex an edge has.

use super::polygon::Ends;
use crate::mesh::NONE;
use crate::view::FieldView;

/// Where the surface crosses an edge: its ends, or twice the same point if the surface goes through that point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::view) struct Crossing {
    /// The end that is inside, and the other one.
    pub ends: Ends,
    /// Which of several surfaces this is on.
    pub which: u32,
}

/// All crossings, and a hash table of them.
///
/// The table uses open addressing with linear probing and is at most half full. Nothing depends on its order.
#[derive(Clone, Debug, Default)]
pub(in crate::view) struct Crossings {
    /// One per vertex of the surface.
    pub list: Vec<Crossing>,
    /// Vertices, `NONE` in a free place; as many places as a power of two, or none.
    table: Vec<u32>,
    /// 64 less the binary logarithm of the size of the table.
    shift: u32,
}

/// The smallest table.
const SMALLEST: usize = 64;

impl Crossing {
    /// How far the crossing is from the inside end to the outside end, 0 to 1, where the function that is cut is `at` its ends
    /// and `value` in the surface.
    #[inline]
    pub fn fraction(&self, value: f64, at: impl Fn(u32) -> f64) -> f64 {
        if self.ends[0] == self.ends[1] {
            return 0.0;
        }
        let [low, high] = self.ends.map(at);
        let span = high - low;
        // Halves of numbers are exact where their difference is too large for one.
        let t = if span.is_finite() {
            (value - low) / span
        } else {
            (0.5 * value - 0.5 * low) / (0.5 * high - 0.5 * low)
        };
        // Only infinite values make it NaN.
        if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) }
    }

    /// The place of the crossing, the fraction `t` along its edge.
    #[inline]
    pub fn place(&self, positions: &[[f64; 3]], t: f64) -> [f64; 3] {
        let [p, q] = self.ends.map(|end| positions[end as usize]);
        [0, 1, 2].map(|i| between(p[i], q[i], t))
    }

    /// The value there of a field; of a label that of the nearer end, the smaller one in the middle.
    pub fn value(&self, field: FieldView<'_>, t: f64) -> f64 {
        let [a, b] = self.ends.map(|end| field.values[end as usize]);
        match field.is_label {
            true if t < 0.5 => a,
            true if t > 0.5 => b,
            true => a.min(b),
            false => between(a, b, t),
        }
    }
}

fn between(a: f64, b: f64, t: f64) -> f64 {
    let span = b - a;
    if span.is_finite() { a + t * span } else { a * (1.0 - t) + b * t }
}

impl Crossings {
    /// Removes all crossings.
    pub fn clear(&mut self) {
        // Shrinks a table that is much too large for the last surface.
        let size = self.table.len().min((4 * self.list.len()).next_power_of_two().max(SMALLEST));
        self.list.clear();
        self.reset(size);
    }

    fn reset(&mut self, size: usize) {
        self.table.clear();
        self.table.resize(size, NONE);
        self.shift = 64 - size.max(2).trailing_zeros();
    }

    /// The first place to look for a crossing.
    #[inline]
    fn start(&self, crossing: Crossing) -> usize {
        let [inside, outside] = crossing.ends.map(u64::from);
        let key = (inside << 32 | outside).wrapping_add(u64::from(crossing.which) << 20);
        // Multiplied with 2^64 divided by the golden ratio (Knuth, The Art of Computer Programming 3, 1973, 6.4).
        (key.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> self.shift) as usize
    }

    /// The vertex of this crossing: an earlier one, or a new one at the end.
    #[inline]
    pub fn vertex(&mut self, ends: Ends, which: u32) -> u32 {
        let crossing = Crossing { ends, which };
        let mask = self.table.len().wrapping_sub(1);
        let mut at = self.start(crossing);
        // A free place contains `NONE`, which is no vertex.
        while let Some(vertex) = self.table.get(at & mask) {
            match self.list.get(*vertex as usize) {
                Some(found) if *found == crossing => return *vertex,
                Some(_) => at += 1,
                None => break,
            }
        }
        self.add(crossing, at & mask)
    }

    /// Adds a crossing, for which there is a free place.
    fn add(&mut self, crossing: Crossing, at: usize) -> u32 {
        let vertex = self.list.len() as u32;
        self.list.push(crossing);
        if 2 * self.list.len() > self.table.len() {
            self.reset((2 * self.table.len()).max(SMALLEST));
            for (vertex, crossing) in (0..).zip(&self.list) {
                let at = self.find(*crossing, NONE);
                self.table[at] = vertex;
            }
        } else {
            self.table[at] = vertex;
        }
        vertex
    }

    /// Removes vertex `v`; the last one takes its number.
    pub fn swap_remove(&mut self, v: u32) {
        let hole = self.find(self.list[v as usize], v);
        self.free(hole);
        let last = self.list.len() as u32 - 1;
        if last != v {
            let at = self.find(self.list[last as usize], last);
            self.table[at] = v;
        }
        self.list.swap_remove(v as usize);
    }

    /// The place of a vertex, or with `NONE` the first free one for this crossing.
    fn find(&self, crossing: Crossing, vertex: u32) -> usize {
        let mask = self.table.len() - 1;
        let mut at = self.start(crossing) & mask;
        while self.table[at] != vertex {
            at = (at + 1) & mask;
        }
        at
    }

    /// Frees a place, and moves entries that could not be found any more (Knuth, algorithm R of 6.4).
    fn free(&mut self, mut hole: usize) {
        let mask = self.table.len() - 1;
        let mut at = hole;
        loop {
            at = (at + 1) & mask;
            let vertex = self.table[at];
            let Some(crossing) = self.list.get(vertex as usize) else { break };
            // How far behind its first place it would be in the hole, and how far it is.
            let first = self.start(*crossing);
            if (hole.wrapping_sub(first) & mask) < (at.wrapping_sub(first) & mask) {
                self.table[hole] = vertex;
                hole = at;
            }
        }
        self.table[hole] = NONE;
    }
}
