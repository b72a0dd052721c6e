//! The base mesh, which grows over its faces.

use super::coded::{BEHIND, Coded, LENGTH, RANK, SEED, STEP, len};

type Point = [i32; 3];
type Vector = [f64; 3];

#[derive(Clone, Copy, PartialEq)]
enum State {
    Open,
    Closed,
    Border,
}

#[derive(Default)]
pub struct Growth {
    pub positions: Vec<Point>,
    pub tets: Vec<[u32; 4]>,
    states: Vec<State>,
    lists: Vec<Vec<usize>>,
}

/// A candidate: the vertex, its edges, its angle.
type Candidate = (u32, u32, f64);

pub struct Gate {
    number: usize,
    pub face: [u32; 3],
    candidates: Vec<Candidate>,
    borders: u32,
    straight: u32,
}

impl Gate {
    /// The tetrahedron that has the gate's face, and the one of its corners that is opposite.
    pub fn place(&self) -> (usize, usize) {
        (self.number / 4, self.number % 4)
    }

    fn which(&self) -> u32 {
        let angles = [0.5, 0.8, 1.1, 1.4, 1.8, 2.05];
        let z = match self.candidates.first() {
            None => 6,
            Some((_, edges, _)) if *edges > 1 => 7,
            Some((_, _, angle)) => angles.iter().filter(|&&x| x < *angle).count() as u32,
        };
        let r = if self.straight > 0 {
            2
        } else if self.borders > 0 {
            1
        } else {
            0
        };
        3 * z + r
    }
}

impl Growth {
    pub fn add_vertex(&mut self, position: Point) -> u32 {
        assert!(position.iter().all(|x| (0..=1 << 30).contains(x)));
        self.positions.push(position);
        self.lists.push(Vec::new());
        self.positions.len() as u32 - 1
    }

    fn face(&self, number: usize) -> [u32; 3] {
        let corners = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]][number % 4];
        corners.map(|corner: usize| self.tets[number / 4][corner])
    }

    /// Goes through the list of a vertex until `until` says so; gives the face it said so of.
    fn go_through(&mut self, v: u32, mut until: impl FnMut(&Self, usize) -> bool) -> Option<usize> {
        let mut place = 0;
        while place < 256 && place < self.lists[v as usize].len() {
            let face = self.lists[v as usize][place];
            if self.states[face] == State::Closed {
                let last = self.lists[v as usize].pop().expect("an entry");
                if place < self.lists[v as usize].len() {
                    self.lists[v as usize][place] = last;
                }
            } else if until(self, face) {
                return Some(face);
            } else {
                place += 1;
            }
        }
        None
    }

    pub fn add(&mut self, tet: [u32; 4]) {
        let t = self.tets.len();
        self.tets.push(tet);
        for number in 4 * t..4 * t + 4 {
            let [a, b, c] = self.face(number);
            let turned = [[a, c, b], [c, b, a], [b, a, c]];
            let other = self.go_through(a, |growth, face| {
                growth.states[face] == State::Open && turned.contains(&growth.face(face))
            });
            if let Some(other) = other {
                self.states[other] = State::Closed;
                self.states.push(State::Closed);
            } else {
                self.states.push(State::Open);
                [a, b, c].iter().for_each(|&v| self.lists[v as usize].push(number));
            }
        }
    }

    pub fn gate(&mut self) -> Option<Gate> {
        let number = self.states.iter().position(|state| *state == State::Open)?;
        let face = self.face(number);
        let [a, b, c] = face;
        let mut gate = Gate { number, face, candidates: Vec::new(), borders: 0, straight: 0 };
        for [u, v, w] in [[a, b, c], [b, c, a], [c, a, b]] {
            let mut found: Vec<(f64, u32, State)> = Vec::new();
            self.go_through(u, |growth, other| {
                let [a, b, c] = growth.face(other);
                for [first, second, x] in [[a, b, c], [b, c, a], [c, a, b]] {
                    if first == v && second == u {
                        let corners = [u, v, w, x].map(|y| growth.positions[y as usize]);
                        found.push((angle(corners), x, growth.states[other]));
                    }
                }
                false
            });
            // Of equal ones, the first.
            let least = found.into_iter().reduce(|best, next| if next.0 < best.0 { next } else { best });
            match least {
                None => {}
                Some((angle, _, State::Border)) => {
                    gate.borders += 1;
                    gate.straight += u32::from((angle - 2.0).abs() < 0.05);
                }
                Some((angle, x, _)) => match gate.candidates.iter_mut().find(|known| known.0 == x) {
                    Some(known) => *known = (x, known.1 + 1, if angle < known.2 { angle } else { known.2 }),
                    None => gate.candidates.push((x, 1, angle)),
                },
            }
        }
        gate.candidates.sort_by(|x, y| y.1.cmp(&x.1).then(x.2.total_cmp(&y.2)));
        Some(gate)
    }

    pub fn attach(&mut self, gate: &Gate, x: u32) {
        let [a, b, c] = gate.face;
        self.add([a, b, c, x]);
        self.states[gate.number] = State::Closed;
    }

    pub fn close(&mut self, gate: &Gate) {
        self.states[gate.number] = State::Border;
    }

    fn others(&mut self, gate: &Gate) -> Vec<u32> {
        let mut found = Vec::new();
        for v in gate.face {
            self.go_through(v, |growth, face| {
                if growth.states[face] == State::Open {
                    found.extend(growth.face(face));
                }
                false
            });
        }
        found.sort_unstable();
        found.dedup();
        let [a, b, c] = gate.face.map(|v| self.positions[v as usize]);
        let mut others: Vec<(f64, u32)> = Vec::new();
        for v in found {
            let x = self.positions[v as usize];
            let is_candidate = gate.candidates.iter().any(|known| known.0 == v);
            if !is_candidate && volume([a, b, c, x]) > 0 {
                others.push((reach([a, b, c, x]), v));
            }
        }
        others.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        others.into_iter().map(|(_, v)| v).collect()
    }
}

/// Six times the volume, exactly.
pub fn volume([a, b, c, d]: [Point; 4]) -> i128 {
    let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|k| i128::from(p[k]) - i128::from(a[k])));
    (u[1] * v[2] - u[2] * v[1]) * w[0]
        + (u[2] * v[0] - u[0] * v[2]) * w[1]
        + (u[0] * v[1] - u[1] * v[0]) * w[2]
}

fn less(p: Point, q: Point) -> Vector {
    [0, 1, 2].map(|k| f64::from(p[k]) - f64::from(q[k]))
}

fn cross(p: Vector, q: Vector) -> Vector {
    [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
}

fn dot(p: Vector, q: Vector) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

fn angle([u, v, w, x]: [Point; 4]) -> f64 {
    let [v, w, x] = [v, w, x].map(|p| less(p, u));
    let n = cross(v, w);
    let m = cross(n, v);
    let s = dot(m, x);
    let h = dot(n, x) * dot(v, v).sqrt();
    let k = s.abs() + h.abs();
    let c = if k > 0.0 { s / k } else { 1.0 };
    if h >= 0.0 { 1.0 - c } else { 3.0 + c }
}

fn reach([a, b, c, x]: [Point; 4]) -> f64 {
    let [b, c, x] = [b, c, x].map(|p| less(p, a));
    let n = cross(b, c);
    let (u, v) = (cross(c, n), cross(n, b));
    let o = [0, 1, 2].map(|k| (dot(b, b) * u[k] + dot(c, c) * v[k]) / (2.0 * dot(n, n)));
    (dot(x, x) - 2.0 * dot(x, o)) / dot(n, x)
}

/// Positions and tetrahedra of the base mesh.
pub fn read(coded: &mut Coded<'_>, vertices: usize, tets: usize) -> Growth {
    let mut growth = Growth::default();
    if coded.bits(1) == 0 {
        steps(coded, &mut growth, vertices);
    }
    while growth.tets.len() < tets {
        match growth.gate() {
            Some(gate) => behind(coded, &mut growth, &gate),
            None => seed(coded, &mut growth),
        }
    }
    steps(coded, &mut growth, vertices);
    assert_eq!(growth.positions.len(), vertices);
    growth
}

fn steps(coded: &mut Coded<'_>, growth: &mut Growth, vertices: usize) {
    while growth.positions.len() < vertices {
        step(coded, growth);
    }
}

fn step(coded: &mut Coded<'_>, growth: &mut Growth) -> u32 {
    let last = growth.positions.last().copied().unwrap_or([0; 3]);
    growth.add_vertex(last.map(|x| x.wrapping_add(coded.signed(STEP, 0))))
}

fn known(coded: &mut Coded<'_>, growth: &Growth) -> u32 {
    let count = growth.positions.len() as u32;
    let v = coded.bits(len(count.saturating_sub(1)));
    assert!(v < count);
    v
}

fn seed(coded: &mut Coded<'_>, growth: &mut Growth) {
    let tet = [0; 4].map(|_| match coded.symbol(SEED, 0) {
        1 => step(coded, growth),
        _ => known(coded, growth),
    });
    growth.add(tet);
}

fn behind(coded: &mut Coded<'_>, growth: &mut Growth, gate: &Gate) {
    let symbol = coded.symbol(BEHIND, gate.which());
    let x = match symbol {
        0 => return growth.close(gate),
        1 => {
            let position = position(coded, growth, gate);
            growth.add_vertex(position)
        }
        5 => {
            let place = coded.number(RANK, 0) as usize;
            let others = growth.others(gate);
            if place < others.len() { others[place] } else { known(coded, growth) }
        }
        _ => gate.candidates[symbol as usize - 2].0,
    };
    growth.attach(gate, x);
}

fn position(coded: &mut Coded<'_>, growth: &Growth, gate: &Gate) -> Point {
    let [a, b, c] = gate.face.map(|v| growth.positions[v as usize]);
    let n = cross(less(b, a), less(c, a));
    let h = 0.5 / dot(n, n).sqrt().sqrt().max(1.0);
    let extent = |k: usize| a[k].max(b[k]).max(c[k]) - a[k].min(b[k]).min(c[k]);
    let z = len((0..3).map(|k| extent(k) as u32).sum());
    [0, 1, 2].map(|k| {
        let (a, b, c) = (a[k], b[k], c[k]);
        let all = a == b && b == c;
        let (expected, which) = if !all && (a == b || a == c) {
            (a, 1)
        } else if !all && b == c {
            (b, 1)
        } else {
            let [a, b, c] = [a, b, c].map(f64::from);
            ((((a + b) + c) / 3.0 + n[k] * h + 0.5).floor() as i32, 0)
        };
        let symbol = coded.symbol(LENGTH, which);
        if symbol == 0 {
            return expected;
        }
        let length = (symbol + z).checked_sub(33).expect("a length");
        assert!((1..=31).contains(&length));
        let is_negative = coded.bits(1) == 1;
        let size = (1 << (length - 1) | coded.bits(length - 1)) as i32;
        expected + if is_negative { -size } else { size }
    })
}
