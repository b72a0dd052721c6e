//! Blocks of vertex insertions: what an update is told by is the mesh that all before it have made. Everything in it is found
//! by looking at all tetrahedra.

use super::change::{Change, Point, Tet, face, sorted};
use super::coded::{
    Coded, DISTANCE, FALL, FAN, FAR, GIVEN_UP, GROW, INSERTION_LEVEL, OWN_FALL, QUARTERS, SEED_PLACE, SHORT,
    len,
};
use super::growth::volume;
use super::wire::Info;
use super::{File, change};
use num_bigint::{BigInt, Sign};
use std::collections::BTreeSet;

/// What `BASE` tells besides the base mesh.
#[derive(Clone, Debug)]
pub struct Start {
    /// Whether every update inserts more tetrahedra than it removes.
    pub grows: bool,
    pub grain: [i64; 3],
}

/// Reads what follows behind the base mesh.
pub fn start(coded: &mut Coded<'_>) -> Start {
    let grows = coded.bits(1) == 1;
    let grain = [0; 3].map(|_| i64::from(coded.bits(31)));
    assert!(grain.iter().all(|&grain| grain > 0));
    Start { grows, grain }
}

/// The mesh that all updates so far have made.
pub struct Mesh<'a> {
    info: &'a Info,
    grain: [i64; 3],
    pub positions: Vec<Point>,
    pub levels: Vec<Vec<i32>>,
    pub tets: Vec<Tet>,
    errors: Vec<u16>,
    tet_errors: bool,
}

/// Which tetrahedra are removed, while that is found out.
struct Grown {
    v: Point,
    taken: Vec<usize>,
    refused: Vec<usize>,
}

impl<'a> Mesh<'a> {
    pub fn new(file: &'a File) -> Self {
        let vertices = 0..file.base.positions.len();
        Self {
            info: &file.info,
            grain: file.start.as_ref().expect("a file of kind 1").grain,
            positions: file.base.positions.clone(),
            levels: vertices.map(|v| file.base_levels.iter().map(|levels| levels[v]).collect()).collect(),
            tets: file.base.tets.clone(),
            errors: vec![65_535; file.info.fields.len()],
            tet_errors: file.tet_errors,
        }
    }

    pub fn update(&mut self, coded: &mut Coded<'_>) -> Change {
        let errors = change::errors(coded, FALL, &mut self.errors);
        let fan = coded.symbol(FAN, 0) == 1;
        let near = coded.one_of(self.positions.len() as u32);
        let star = self.star(near);
        let v = self.place(coded, near, &star);
        let seed = self.seed(coded, near, v, &star);
        let mut grown = Grown { v, taken: vec![seed], refused: Vec::new() };
        self.grow(coded, near, fan, &mut grown);
        let given_up = self.given_up(coded, &grown);
        let levels = self.levels(coded, &grown);
        let own = self.tet_errors.then(|| self.own_errors(coded, &grown));
        let removed: Vec<Tet> = grown.taken.iter().map(|&t| self.tets[t]).collect();
        let inserted = self.inserted(&grown, &given_up);
        self.positions.push(v);
        self.levels.push(levels.clone());
        self.tets.retain(|tet| !removed.contains(tet));
        self.tets.extend(&inserted);
        for tet in &inserted {
            assert!(volume(tet.map(|v| self.positions[v as usize])) > 0, "{tet:?} is inside out");
        }
        let around: BTreeSet<u32> = inserted.iter().flatten().copied().collect();
        assert!(removed.iter().flatten().all(|v| around.contains(v)), "a vertex is swallowed");
        assert!(removed.len() <= 127 && inserted.len() <= 124 && around.len() <= 1 + 64);
        Change { errors, positions: vec![v], levels: vec![levels], removed, inserted, own }
    }

    fn own_errors(&self, coded: &mut Coded<'_>, grown: &Grown) -> (u32, Vec<u32>) {
        let fall = coded.symbol(OWN_FALL, 0);
        let mut before = 0;
        let quarters = grown.taken.iter().map(|&t| {
            let is_within = self.volumes(t, grown.v).iter().all(|volume| *volume >= 0);
            before = coded.symbol(QUARTERS, 2 * before + u32::from(is_within));
            before
        });
        (fall, quarters.collect())
    }

    fn corners(&self, tet: Tet) -> [Point; 4] {
        tet.map(|v| self.positions[v as usize])
    }

    /// The tetrahedron behind a face of another.
    fn behind(&self, t: usize, corner: usize) -> Option<usize> {
        let face = face(self.tets[t], corner);
        (0..self.tets.len()).find(|&other| other != t && face.iter().all(|v| self.tets[other].contains(v)))
    }

    fn are_beside(&self, t: usize, other: usize) -> bool {
        self.tets[t].iter().filter(|v| self.tets[other].contains(v)).count() == 3
    }

    /// The volumes that a point has with each face of a tetrahedron.
    fn volumes(&self, t: usize, v: Point) -> [i128; 4] {
        [0, 1, 2, 3].map(|corner| {
            let mut corners = self.corners(self.tets[t]);
            corners[corner] = v;
            volume(corners)
        })
    }

    /// 1, 0 or −1 for a point inside, on or outside of the circumsphere.
    fn sphere(&self, t: usize, v: Point) -> i32 {
        let square = |p: Point| {
            let sides = [0, 1, 2].map(|k| i128::from(p[k]) - i128::from(v[k]));
            sides.iter().map(|x| x * x).sum::<i128>()
        };
        let corners = self.corners(self.tets[t]);
        let terms = corners.into_iter().zip(self.volumes(t, v));
        let sum: BigInt = terms.map(|(p, volume)| BigInt::from(square(p)) * BigInt::from(volume)).sum();
        match sum.sign() {
            Sign::Plus => 1,
            Sign::NoSign => 0,
            Sign::Minus => -1,
        }
    }

    /// The tetrahedra around a vertex, in the order of their sorted vertex numbers.
    fn star(&self, near: u32) -> Vec<usize> {
        let at: Vec<usize> = (0..self.tets.len()).filter(|&t| self.tets[t].contains(&near)).collect();
        // What was inserted last stands last.
        let mut star: Vec<usize> = at.iter().copied().rev().take(1).collect();
        let mut next = 0;
        while next < star.len() {
            for &t in &at {
                if !star.contains(&t) && self.are_beside(t, star[next]) {
                    star.push(t);
                }
            }
            next += 1;
        }
        assert!((1..=4096).contains(&star.len()));
        star.sort_by_key(|&t| sorted(self.tets[t]));
        star
    }

    /// The new vertex, as seen from the near one.
    fn place(&self, coded: &mut Coded<'_>, near: u32, star: &[usize]) -> Point {
        let mut link: BTreeSet<u32> = star.iter().flat_map(|&t| self.tets[t]).collect();
        link.remove(&near);
        [0, 1, 2].map(|axis| {
            let from = i64::from(self.positions[near as usize][axis]);
            let d: Vec<i64> =
                link.iter().map(|&w| i64::from(self.positions[w as usize][axis]) - from).collect();
            let sum: i64 = d.iter().sum();
            let sizes: i64 = d.iter().map(|d| d.abs()).sum();
            let n = self.grain[axis] * d.len() as i64;
            let which = match d.iter().filter(|d| **d == 0).count() {
                0 => 0,
                1 => 1,
                2 | 3 => 2,
                _ => 3,
            };
            let expected = if which == 0 { sum / (2 * n) } else { 0 };
            let size = len((sizes / n) as u32);
            let symbol = coded.symbol(DISTANCE, which);
            let rest = if symbol == 0 { 0 } else { rest(coded, symbol + 2 * size - 40) };
            let x = from + self.grain[axis] * (rest + expected);
            assert!((0..=1 << self.info.bits).contains(&x));
            x as i32
        })
    }

    fn seed(&self, coded: &mut Coded<'_>, near: u32, v: Point, star: &[usize]) -> usize {
        let is_within = |&t: &usize| {
            let volumes = self.tets[t].into_iter().zip(self.volumes(t, v));
            volumes.into_iter().all(|(corner, volume)| corner == near || volume >= 0)
        };
        let place = coded.symbol(SEED_PLACE, 0) as usize;
        if place == 8 {
            return star[coded.one_of(star.len() as u32) as usize];
        }
        let cone: Vec<usize> = star.iter().copied().filter(is_within).collect();
        cone[place]
    }

    fn grow(&self, coded: &mut Coded<'_>, near: u32, fan: bool, grown: &mut Grown) {
        let mut next = 0;
        while next < grown.taken.len() {
            let t = grown.taken[next];
            next += 1;
            assert!(next <= 127);
            let volumes = self.volumes(t, grown.v);
            let mut corners = [0, 1, 2, 3];
            corners.sort_by_key(|&corner| self.tets[t][corner]);
            for corner in corners {
                let Some(other) = self.behind(t, corner) else { continue };
                if grown.taken.contains(&other) || grown.refused.contains(&other) {
                    continue;
                }
                if fan && !self.is_of_fan(near, grown.v, other) {
                    continue;
                }
                let takes = volumes[corner] <= 0 || coded.symbol(GROW, self.which(t, other, grown)) == 1;
                if takes { grown.taken.push(other) } else { grown.refused.push(other) }
            }
        }
    }

    /// Whether a tetrahedron can be removed when all that is removed has the near vertex.
    fn is_of_fan(&self, near: u32, v: Point, t: usize) -> bool {
        let Some(corner) = self.tets[t].iter().position(|&w| w == near) else { return false };
        self.behind(t, corner).is_none() || self.volumes(t, v)[corner] > 0
    }

    /// The context of whether a tetrahedron is removed.
    fn which(&self, from: usize, t: usize, grown: &Grown) -> u32 {
        let among = |list: &[usize]| list.iter().filter(|&&other| self.are_beside(t, other)).count();
        let hidden = self.volumes(t, grown.v).iter().filter(|volume| **volume <= 0).count();
        let sphere = (self.sphere(t, grown.v) + 1) as usize;
        let known = among(&grown.taken).clamp(1, 3) - 1;
        let hidden = hidden.clamp(1, 3) - 1;
        let refused = usize::from(among(&grown.refused) > 0);
        let near = usize::from(self.sphere(from, grown.v) > 0);
        (2 * (2 * (3 * (3 * sphere + known) + hidden) + refused) + near) as u32
    }

    /// The faces of the boundary that are given up, by tetrahedron and the corner opposite.
    fn given_up(&self, coded: &mut Coded<'_>, grown: &Grown) -> Vec<(usize, usize)> {
        let faces = grown.taken.iter().flat_map(|&t| [0, 1, 2, 3].map(|corner| (t, corner)));
        let mut faces: Vec<(usize, usize)> =
            faces.filter(|&(t, corner)| self.behind(t, corner).is_none()).collect();
        faces.sort_by_key(|&(t, corner)| {
            let mut face = face(self.tets[t], corner);
            face.sort_unstable();
            face
        });
        faces.retain(|&(t, corner)| self.volumes(t, grown.v)[corner] <= 0 || coded.symbol(GIVEN_UP, 0) == 1);
        faces
    }

    /// The vertices and weights from which levels are expected, and 1 if the new vertex is outside.
    fn home(&self, grown: &Grown) -> ([(u32, f64); 4], u32) {
        let mut best = (f64::NEG_INFINITY, [(0, 0.0); 4]);
        for &t in &grown.taken {
            let exact = self.volumes(t, grown.v);
            let volumes = exact.map(|volume| volume as f64);
            let sum = volumes[0] + volumes[1] + volumes[2] + volumes[3];
            let corners = [0, 1, 2, 3].map(|corner| (self.tets[t][corner], volumes[corner] / sum));
            if exact.iter().all(|volume| *volume >= 0) {
                return (corners, 0);
            }
            let least = corners.iter().map(|(_, weight)| *weight).fold(f64::INFINITY, f64::min);
            if sum != 0.0 && least > best.0 {
                best = (least, corners);
            }
        }
        (best.1, 1)
    }

    fn levels(&self, coded: &mut Coded<'_>, grown: &Grown) -> Vec<i32> {
        let (home, outside) = self.home(grown);
        let fields = self.info.fields.iter().enumerate();
        let levels = fields.map(|(f, field)| {
            let mut sum = 0.5;
            for (v, weight) in home {
                sum += weight * f64::from(self.levels[v as usize][f]);
            }
            let most = (1 << field.bits) - 1;
            let expected = sum.floor().clamp(0.0, f64::from(most)) as i32;
            let range = if field.max == field.min { 1.0 } else { field.max - field.min };
            let bound = (change::error_of(self.errors[f]) * range / field.step).floor();
            let bound = bound.min(f64::from(1 << 24)) as u32;
            let length = len(bound);
            let is_far = bound > 3 && coded.symbol(FAR, length) == 1;
            let rest = if is_far {
                let size = (bound + 1).checked_sub(coded.number(SHORT, 0)).expect("a size") as i32;
                if coded.bits(1) == 1 { -size } else { size }
            } else {
                coded.signed(INSERTION_LEVEL, length.min(19) + 20 * outside)
            };
            let level = expected + rest;
            assert!((0..=most).contains(&level));
            level
        });
        levels.collect()
    }

    /// The star of the new vertex.
    fn inserted(&self, grown: &Grown, given_up: &[(usize, usize)]) -> Vec<Tet> {
        let v = self.positions.len() as u32;
        let mut star = Vec::new();
        for &t in &grown.taken {
            for corner in 0..4 {
                let is_within = self.behind(t, corner).is_some_and(|other| grown.taken.contains(&other));
                if !is_within && !given_up.contains(&(t, corner)) {
                    let [a, b, c] = face(self.tets[t], corner);
                    star.push([v, a, b, c]);
                }
            }
        }
        star
    }
}

/// What a coordinate is off, of `q / 2` bits.
fn rest(coded: &mut Coded<'_>, q: u32) -> i64 {
    let length = q / 2;
    assert!((1..=31).contains(&length) && q != 3);
    let size = if length == 1 {
        1
    } else {
        i64::from(2 + q % 2) << (length - 2) | i64::from(coded.bits(length - 2))
    };
    if coded.bits(1) == 1 { -size } else { size }
}
