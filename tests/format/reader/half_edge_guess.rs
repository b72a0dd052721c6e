//! What is told of the tetrahedra of a star: which update removes each, and which of its faces are inner. The choices that there
//! are follow from positions; the code of the star tells them apart.

use super::change::{Point, Tet};
use super::growth::volume;
use super::half_edge::{Child, Mark, Record};
use super::half_edge_mesh::{Vertex, behind};
use std::collections::HashMap;

type Vertices = HashMap<u32, Vertex>;
type Vector = [f64; 3];

/// A child of a corner, after the update whose star it is.
#[derive(Clone, Copy)]
struct Candidate {
    corner: usize,
    child: Child,
}

#[derive(Clone, Copy, PartialEq)]
enum Choice {
    /// By its place among the candidates.
    Update(usize),
    Further,
    None,
}

/// The removers that a tetrahedron can have.
struct Choices {
    candidates: Vec<Candidate>,
    /// With their weights.
    choices: Vec<(Choice, f64)>,
}

/// The marks of a star, given the vertices, that in the middle among them.
pub fn marks(vertices: &Vertices, star: &[Tet], record: &Record) -> Vec<Mark> {
    let removers = removers(vertices, star, record);
    let mut marks: Vec<Mark> = removers.iter().map(|&remover| Mark { remover, ..Mark::default() }).collect();
    // Faces that only a bit tells of, by their keys.
    let mut open: Vec<(u64, usize, usize, bool)> = Vec::new();
    for (t, tet) in star.iter().enumerate() {
        let Some((near, child)) = tet.iter().enumerate().find_map(|(corner, v)| {
            let child = vertices[v].children.iter().find(|child| Some(child.update) == removers[t]);
            child.map(|child| (corner, *child))
        }) else {
            continue;
        };
        for corner in (0..4).filter(|&corner| corner != near) {
            match behind(star, t, corner).map(|other| removers[other]) {
                Some(other) if other == removers[t] => marks[t].inner[corner] = true,
                Some(other) if is_later(other, child.update) => {}
                _ => {
                    let mut corners = tet.map(|v| vertices[&v].position);
                    let x = corners[near];
                    let p = [0, 1, 2].map(|axis| x[axis] + child.offset[axis]);
                    let sin = sin(corners, near, corner, child.offset);
                    corners[corner] = p;
                    if volume(corners) <= 0 {
                        marks[t].inner[corner] = true;
                    } else {
                        let hash = hash_of(*tet).wrapping_add(hash(tet[corner]).rotate_left(17));
                        open.push((key((sin - 0.35).abs(), hash), t, corner, sin < 0.35));
                    }
                }
            }
        }
    }
    open.sort_by_key(|&(key, ..)| key);
    assert!(record.bits.len() <= open.len(), "bits are left over");
    for (i, (_, t, corner, guess)) in open.into_iter().enumerate() {
        marks[t].inner[corner] = guess != record.bits.get(i).is_some_and(|&bit| bit);
    }
    marks
}

fn is_later(remover: Option<u32>, than: u32) -> bool {
    remover.is_none_or(|remover| remover > than)
}

fn removers(vertices: &Vertices, star: &[Tet], record: &Record) -> Vec<Option<u32>> {
    let mut choices: Vec<Choices> =
        star.iter().map(|tet| Choices::new(vertices, *tet, record.update)).collect();
    // Known ones.
    let mut removers: Vec<Option<Option<u32>>> =
        choices.iter().map(|choices| (choices.choices.len() == 1).then_some(None)).collect();
    let mut order: Vec<usize> = (0..star.len()).filter(|&t| removers[t].is_none()).collect();
    order.sort_by_key(|&t| key(choices[t].largest(), hash_of(star[t])));
    let mut symbols = record.symbols.iter().copied();
    let mut next = || symbols.next().unwrap_or(0);
    for t in order {
        let Choices { candidates, choices: weighed } = &mut choices[t];
        for (choice, weight) in weighed {
            let Choice::Update(place) = *choice else { continue };
            let candidate = candidates[place];
            for corner in 0..4 {
                match behind(star, t, corner).and_then(|other| removers[other]) {
                    Some(Some(other)) if other == candidate.child.update => *weight *= 8.0,
                    Some(other) if is_later(other, candidate.child.update) => *weight /= 8.0,
                    _ => {}
                }
            }
        }
        choices[t].sort();
        removers[t] = Some(choices[t].chosen(&mut next));
    }
    assert!(symbols.next().is_none(), "symbols are left over");
    removers.into_iter().map(|remover| remover.flatten()).collect()
}

impl Choices {
    fn new(vertices: &Vertices, tet: Tet, update: u32) -> Self {
        let mut candidates: Vec<Candidate> = Vec::new();
        for (corner, v) in tet.iter().enumerate() {
            let later = vertices[v].children.iter().filter(|child| child.update > update);
            candidates.extend(later.map(|&child| Candidate { corner, child }));
        }
        candidates.sort_by_key(|candidate| candidate.child.update);
        let corners = tet.map(|v| vertices[&v].position);
        let mut left = 1.0;
        let mut choices = Vec::new();
        while choices.len() < candidates.len().min(8) && left >= 1.0 / 64.0 {
            let share = candidates[choices.len()].share(corners);
            choices.push((Choice::Update(choices.len()), left * share));
            left *= 1.0 - share;
        }
        let is_all = choices.len() == candidates.len();
        choices.push((if is_all { Choice::None } else { Choice::Further }, left));
        Self { candidates, choices }
    }

    fn largest(&self) -> f64 {
        self.choices.iter().map(|choice| choice.1).fold(0.0, f64::max)
    }

    fn sort(&mut self) {
        self.choices.sort_by(|a, b| b.1.total_cmp(&a.1));
    }

    fn chosen(&self, next: &mut impl FnMut() -> u32) -> Option<u32> {
        match self.choices[next() as usize].0 {
            Choice::Update(place) => Some(self.candidates[place].child.update),
            Choice::None => None,
            Choice::Further => {
                let (mut number, mut shift) = (0, 0);
                loop {
                    let symbol = next();
                    number |= (symbol as usize & 7) << shift;
                    shift += 3;
                    if symbol < 8 {
                        break;
                    }
                }
                let weighed = self.choices.len() - 1;
                number.checked_sub(1).map(|i| self.candidates[weighed + i].child.update)
            }
        }
    }
}

impl Candidate {
    fn share(&self, corners: [Point; 4]) -> f64 {
        let g = [0, 1, 2].map(|axis| {
            let all: i64 = corners.iter().map(|p| i64::from(p[axis])).sum();
            (all - 4 * i64::from(corners[self.corner][axis])) as f64
        });
        let offset = self.child.offset.map(f64::from);
        let (a, b) = (dot(g, g) * dot(offset, offset), dot(g, offset));
        0.5 + a.sqrt() * b / (a + b * b).max(1e-300)
    }
}

/// How steeply an offset from a corner leaves a face there.
fn sin(corners: [Point; 4], near: usize, opposite: usize, offset: Point) -> f64 {
    let x = corners[near];
    let mut edges = (0..4).filter(|corner| ![near, opposite].contains(corner));
    let mut edge = || {
        let p = corners[edges.next().expect("two edges")];
        [0, 1, 2].map(|axis| f64::from(p[axis] - x[axis]))
    };
    let [a, b] = [edge(), edge()];
    let n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let offset = offset.map(f64::from);
    dot(n, offset).abs() / (dot(n, n) * dot(offset, offset)).sqrt().max(1e-300)
}

fn dot(p: Vector, q: Vector) -> f64 {
    p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
}

fn key(x: f64, hash: u64) -> u64 {
    let upper = (4095.0 * x.clamp(0.0, 1.0)).floor() as u64;
    upper << 52 | hash >> 12
}

fn hash_of(tet: Tet) -> u64 {
    tet.iter().fold(0, |sum: u64, &v| sum.wrapping_add(hash(v)))
}

fn hash(v: u32) -> u64 {
    let z = (u64::from(v) + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ z >> 31
}
