//! In which order the updates of a half-edge MT are numbered, so that a request finds what it needs in few blocks.
//!
//! A request that looks at a region needs an update if the *reach* of the update meets the region: what the update and all that
//! depend on it touch. A block is read if one of its updates is needed. So the updates are parted again and again, each part
//! where the blocks on both sides are read least often: by requests for boxes of some size anywhere, down to any error.
//!
//! Parts are cut along keys that never fall from parent to child: an update reaches at least as far as what depends on it,
//! and its error is at least as large. What has the smaller key comes first, so the order extends the partial order.
//!
//! ```text
//!   all updates
//!   ├── reach begins left of x = 40        the parents of an update are in its part or in one above, never
//!   │   ├── error above 1 %     block 0    below: they reach as far, and their errors are as large
//!   │   └── the others          block 1
//!   └── the others
//!       ├── reach ends right of x = 90     block 2
//!       └── the others                     block 3
//! ```
//!
//! What must hold: a parent has a smaller number than its children, in whichever blocks the two are. Within a block the updates are then
//! sorted by their near vertices, as far as this allows.

use std::collections::BTreeSet;
use tetralod::geom::Groups;
use tetralod::mt::ErrorCode;
use tetralod::threads;

/// What the order depends on. Updates are numbered by an order that extends the partial order.
pub(crate) struct Updates<'a> {
    /// Vertices of the base mesh.
    pub base: u32,
    /// The near vertex of each update, in the numbers of that order.
    pub near: &'a [u32],
    /// The parents of each update.
    pub parents: &'a Groups,
    /// The box around what each update touches: its lowest and its highest corner.
    pub boxes: &'a [[[i32; 3]; 2]],
    /// The largest error of each. It does not grow along the partial order.
    pub errors: &'a [ErrorCode],
    /// The sides of the whole domain, if the updates are of a part of it.
    pub domain: Option<[i32; 3]>,
}

/// Requests are for boxes of this part of the whole, along each axis.
const BOX: f64 = 0.1;

/// Requested errors are assumed to lie between these, log-uniformly.
const ASKED_ERRORS: [f64; 2] = [1.0 / 8192.0, 0.25];

/// Error zero is assumed to be requested this many times as often as all of these.
const DOWN_TO_ZERO: f64 = 0.1;

/// Of many blocks, no fewer than one in so many are parted from the rest.
const LEAST_PART: usize = 32;

/// Three lowest corners, three highest ones, size, and error.
const KEYS: usize = 8;

impl Updates<'_> {
    fn count(&self) -> usize {
        self.near.len()
    }

    fn parents(&self, u: u32) -> &[u32] {
        self.parents.of(u as usize)
    }

    /// The updates in the new order, in blocks of `2^block_bits`.
    pub fn order(&self, block_bits: u32) -> Vec<u32> {
        let reach = self.reach();
        let mut order = Parts::new(&reach, self, 1 << block_bits).order();
        self.sort_blocks(&mut order, block_bits);
        order
    }

    /// The box around what each update and all that depend on it touch.
    fn reach(&self) -> Vec<[[i32; 3]; 2]> {
        let mut reach = self.boxes.to_vec();
        for u in (0..self.count()).rev() {
            let [low, high] = reach[u];
            for &p in self.parents(u as u32) {
                let [lowest, highest] = &mut reach[p as usize];
                (0..3).for_each(|k| lowest[k] = lowest[k].min(low[k]));
                (0..3).for_each(|k| highest[k] = highest[k].max(high[k]));
            }
        }
        reach
    }

    /// Sorts the updates of each block by their near vertices, as far as the partial order allows: which update is
    /// whose child takes few bits then.
    fn sort_blocks(&self, order: &mut [u32], block_bits: u32) {
        let children = Groups::new(self.count(), |add| {
            (0..self.count() as u32).for_each(|u| self.parents(u).iter().for_each(|&p| add(p as usize, u)));
        });
        let mut new_numbers = vec![u32::MAX; self.count()];
        let mut block_of = vec![0_u32; self.count()];
        (0..).zip(order.iter()).for_each(|(at, &u): (u32, _)| block_of[u as usize] = at >> block_bits);
        // How many parents of an update are to come in its block.
        let mut left = vec![0_u32; self.count()];
        let mut number = 0;
        for block in order.chunks_mut(1 << block_bits) {
            let own = number >> block_bits;
            let mut ready = BTreeSet::new();
            let near = |u: u32, new_numbers: &[u32]| match self.near[u as usize].checked_sub(self.base) {
                Some(creator) => self.base + new_numbers[creator as usize],
                None => self.near[u as usize],
            };
            for &u in block.iter() {
                left[u as usize] =
                    self.parents(u).iter().filter(|&&p| block_of[p as usize] == own).count() as u32;
                if left[u as usize] == 0 {
                    ready.insert((near(u, &new_numbers), u));
                }
            }
            for place in block.iter_mut() {
                let Some((_, u)) = ready.pop_first() else { break };
                *place = u;
                new_numbers[u as usize] = number;
                number += 1;
                for &child in children.of(u as usize).iter().filter(|&&child| block_of[child as usize] == own)
                {
                    left[child as usize] -= 1;
                    if left[child as usize] == 0 {
                        ready.insert((near(child, &new_numbers), child));
                    }
                }
            }
        }
    }
}

/// What a part has in common: the box around what its updates reach, and the largest of their errors.
#[derive(Clone, Copy)]
struct Hull {
    low: [i32; 3],
    high: [i32; 3],
    error: ErrorCode,
}

impl Hull {
    const EMPTY: Self = Self { low: [i32::MAX; 3], high: [i32::MIN; 3], error: ErrorCode::ZERO };

    fn add(&mut self, [low, high]: &[[i32; 3]; 2], error: ErrorCode) {
        for k in 0..3 {
            self.low[k] = self.low[k].min(low[k]);
            self.high[k] = self.high[k].max(high[k]);
        }
        self.error = self.error.max(error);
    }
}

/// Updates that are parted: the same ones in a list for each key.
struct Parts<'a> {
    reach: &'a [[[i32; 3]; 2]],
    errors: &'a [ErrorCode],
    size: usize,
    sorted: [Vec<u32>; KEYS],
    /// The sides of a requested box.
    asked: [f64; 3],
    /// The least and the largest requested error. Codes are on a logarithmic scale.
    asked_errors: [ErrorCode; 2],
}

impl<'a> Parts<'a> {
    fn new(reach: &'a [[[i32; 3]; 2]], updates: &Updates<'a>, size: usize) -> Self {
        let errors = updates.errors;
        let key = |key: usize, u: u32| -> i64 {
            let [low, high] = &reach[u as usize];
            match key {
                0..3 => i64::from(low[key]),
                3..6 => -i64::from(high[key - 3]),
                6 => low.iter().zip(high).map(|(low, high)| i64::from(*low) - i64::from(*high)).sum(),
                _ => -i64::from(errors[u as usize].0),
            }
        };
        let mut sorted: [(usize, Vec<u32>); KEYS] = std::array::from_fn(|k| (k, Vec::new()));
        threads::change_each(&mut sorted, |(k, list)| {
            list.extend(0..reach.len() as u32);
            list.sort_by_cached_key(|&u| (key(*k, u), u));
        });
        let sorted = sorted.map(|(_, list)| list);
        let mut whole = Hull::EMPTY;
        reach.iter().zip(errors).for_each(|(reach, &error)| whole.add(reach, error));
        let own = [0, 1, 2].map(|k| f64::from(whole.high[k]) - f64::from(whole.low[k]));
        let sides = updates.domain.map_or(own, |domain| domain.map(f64::from));
        let asked = sides.map(|side| BOX * side + 1.0);
        Self { reach, errors, size, sorted, asked, asked_errors: ASKED_ERRORS.map(ErrorCode::at_least) }
    }

    /// How often a block of the updates in `hull` is read.
    fn weight(&self, hull: &Hull) -> f64 {
        let sides = [0, 1, 2].map(|k| f64::from(hull.high[k]) - f64::from(hull.low[k]) + self.asked[k]);
        let [least, largest] = self.asked_errors;
        let of_errors = f64::from(hull.error.clamp(least, largest).0 - least.0);
        sides[0] * sides[1] * sides[2] * (of_errors + DOWN_TO_ZERO * f64::from(largest.0 - least.0))
    }

    /// All updates in blocks of `size`.
    fn order(mut self) -> Vec<u32> {
        let mut order = Vec::with_capacity(self.reach.len());
        let mut is_first = vec![false; self.reach.len()];
        let mut parts = vec![(0, self.reach.len())];
        while let Some((start, end)) = parts.pop() {
            let part = start..end;
            if part.len() <= self.size {
                order.extend_from_slice(&self.sorted[0][part]);
                continue;
            }
            let (key, cut) = self.best_cut(part.clone());
            let middle = start + cut * self.size;
            self.sorted[key][start..middle].iter().for_each(|&u| is_first[u as usize] = true);
            threads::change_each(&mut self.sorted, |list| {
                part_list(&mut list[part.clone()], |u| is_first[u as usize]);
            });
            self.sorted[key][start..middle].iter().for_each(|&u| is_first[u as usize] = false);
            parts.push((middle, end));
            parts.push((start, middle));
        }
        order
    }

    /// The key along which a part is cut, and how many blocks go to the first side.
    fn best_cut(&self, part: std::ops::Range<usize>) -> (usize, usize) {
        let blocks = part.len().div_ceil(self.size);
        let least = (blocks / LEAST_PART).max(1);
        let of_keys =
            threads::map(KEYS, 1, |keys| self.best_cut_of(&self.sorted[keys.start][part.clone()], least));
        let mut best = (f64::INFINITY, (0, least));
        for (key, (sum, cut)) in of_keys.into_iter().enumerate() {
            if sum < best.0 {
                best = (sum, (key, cut));
            }
        }
        best.1
    }

    /// How often blocks are read if a list is cut where that is least, and how many of them, at least `least`, go to the first side.
    fn best_cut_of(&self, list: &[u32], least: usize) -> (f64, usize) {
        let blocks = list.len().div_ceil(self.size);
        let mut best = (f64::INFINITY, least);
        let mut behind = vec![0.0; blocks];
        let mut hull = Hull::EMPTY;
        let add = |hull: &mut Hull, block: usize| {
            let updates = &list[block * self.size..list.len().min((block + 1) * self.size)];
            updates.iter().for_each(|&u| hull.add(&self.reach[u as usize], self.errors[u as usize]));
        };
        for block in (1..blocks).rev() {
            add(&mut hull, block);
            behind[block] = self.weight(&hull) * (list.len() - block * self.size) as f64;
        }
        hull = Hull::EMPTY;
        // In front of the first block there is nothing to cut off.
        for (cut, behind) in behind.iter().enumerate().skip(1) {
            add(&mut hull, cut - 1);
            let sum = self.weight(&hull) * (cut * self.size) as f64 + behind;
            if (least..=blocks - least).contains(&cut) && sum < best.0 {
                best = (sum, cut);
            }
        }
        best
    }
}

/// Moves those that are first to the front of a list; on both sides the order stays.
fn part_list(list: &mut [u32], is_first: impl Fn(u32) -> bool) {
    let (mut kept, mut rest) = (0, Vec::with_capacity(list.len()));
    for i in 0..list.len() {
        let u = list[i];
        if is_first(u) {
            list[kept] = u;
            kept += 1;
        } else {
            rest.push(u);
        }
    }
    list[kept..].copy_from_slice(&rest);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tree of updates over a line of cells, finest last: the children of `u` are `2 u + 1` and `2 u + 2`.
    #[test]
    fn the_order_extends_the_partial_order_and_keeps_together_what_is_near() {
        let levels = 12;
        let count = (1_u32 << levels) - 1;
        let parents =
            Groups::new(count as usize, |add| (1..count).for_each(|u| add(u as usize, (u - 1) / 2)));
        let depth = |u: u32| (u + 1).ilog2();
        let boxes: Vec<[[i32; 3]; 2]> = (0..count)
            .map(|u| {
                let side = 1 << (levels - 1 - depth(u));
                let low = (u + 1 - (1 << depth(u))) as i32 * side;
                [[low, 0, 0], [low + side, 1, 1]]
            })
            .collect();
        let errors: Vec<ErrorCode> =
            (0..count).map(|u| ErrorCode::at_least(0.5_f64.powi(depth(u) as i32))).collect();
        let near: Vec<u32> = (0..count).map(|u| if u == 0 { 0 } else { 1 + (u - 1) / 2 }).collect();
        let updates =
            Updates { base: 1, near: &near, parents: &parents, boxes: &boxes, errors: &errors, domain: None };
        let order = updates.order(4);
        let mut numbers = vec![u32::MAX; count as usize];
        for (number, &u) in (0..).zip(&order) {
            let known = updates.parents(u).iter().all(|&p| numbers[p as usize] < number);
            assert!(known && numbers[u as usize] == u32::MAX, "{u}");
            numbers[u as usize] = number;
        }
        // Blocks that a request for a sixteenth of the line reads.
        let read = |number: &dyn Fn(u32) -> u32, first: i32| {
            let meets = |u: &u32| boxes[*u as usize][0][0] < first + 128 && boxes[*u as usize][1][0] > first;
            (0..count).filter(meets).map(|u| number(u) >> 4).collect::<BTreeSet<u32>>().len()
        };
        for first in [0, 700, 1920] {
            let [before, now] = [read(&|u| u, first), read(&|u| numbers[u as usize], first)];
            assert!(now <= 17 + 6, "{now} blocks for the updates of 17, {before} in the order by depth");
        }
    }

    /// Layers of updates on a line, each of which depends on two of the layer before and touches more than these. All errors are equal.
    #[test]
    fn updates_come_behind_all_of_their_parents() {
        let (layers, width) = (16, 64);
        let count = layers * width;
        let parents_of = |u: u32| match u.checked_sub(width) {
            Some(above) if above % width + 1 < width => vec![above, above + 1],
            Some(above) => vec![above],
            None => Vec::new(),
        };
        let parents = Groups::new(count as usize, |add| {
            (0..count).for_each(|u| parents_of(u).into_iter().for_each(|p| add(u as usize, p)));
        });
        let touched = |u: u32| [u % width, u / width].map(|x| x as i32);
        let boxes: Vec<[[i32; 3]; 2]> =
            (0..count).map(touched).map(|[at, by]| [[at - by, 0, 0], [at + by + 1, 1, 1]]).collect();
        let updates = Updates {
            base: 1,
            near: &vec![0; count as usize],
            parents: &parents,
            boxes: &boxes,
            errors: &vec![ErrorCode::at_least(0.1); count as usize],
            domain: None,
        };
        let mut numbers = vec![u32::MAX; count as usize];
        for (number, u) in (0..).zip(updates.order(4)) {
            assert!(parents_of(u).iter().all(|&p| numbers[p as usize] < number), "{u}");
            assert_eq!(std::mem::replace(&mut numbers[u as usize], number), u32::MAX);
        }
        assert!(!numbers.contains(&u32::MAX));
    }
}
