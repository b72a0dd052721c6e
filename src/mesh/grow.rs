//! A tetrahedral mesh that grows over the faces of what is there, and a numbering of a mesh in the order in which it
//! does: how the connectivity of a base mesh is coded. (Szymczak and Rossignac 1999; Gumhold, Guthe and Strasser 1999.)

use super::FACES;
use super::NONE;
use super::neighbors;
use crate::geom::orient3d;
use glam::DVec3;

/// Most faces around a vertex that are looked at.
const MOST_AROUND: usize = 256;

/// What a face of the mesh is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// What lies behind it is not coded yet.
    Open,
    /// Nothing lies behind it.
    Border,
    /// A tetrahedron lies behind it.
    Closed,
}

/// A mesh that grows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Growth {
    pub positions: Vec<[i32; 3]>,
    pub tets: Vec<[u32; 4]>,
    /// Of face `i` of tetrahedron `t` at `4 t + i`.
    states: Vec<State>,
    /// Around each vertex the faces that are not closed, and some that are.
    around: Vec<Vec<u32>>,
    /// Before this face none is open.
    next: usize,
}

/// A vertex that may lie behind a gate, since an open face with it meets the gate at an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Candidate {
    pub vertex: u32,
    /// How many such faces there are.
    pub faces: u32,
    /// The least angle between one of them and the gate, measured outside: 0 to 4, 2 is straight.
    pub angle: f64,
}

/// The face whose other side is coded next, and what is around it.
#[derive(Clone, Debug)]
pub(crate) struct Gate {
    /// The vertices of the face: the mesh is in front where they go round to the left.
    pub face: [u32; 3],
    candidates: [Candidate; 3],
    count: usize,
    /// How many edges have the border as their closest face, and how many of those go straight on into it.
    pub borders: u32,
    pub straight: u32,
}

impl Gate {
    /// The likeliest first.
    pub fn candidates(&self) -> &[Candidate] {
        &self.candidates[..self.count]
    }
}

impl Growth {
    /// Adds a vertex.
    pub fn add_vertex(&mut self, position: [i32; 3]) -> u32 {
        self.positions.push(position);
        self.around.push(Vec::new());
        self.positions.len() as u32 - 1
    }

    /// Adds a tetrahedron of known vertices where nothing leads to it.
    pub fn add(&mut self, tet: [u32; 4]) {
        let t = self.tets.len() as u32;
        self.tets.push(tet);
        for (i, corners) in (0..).zip(FACES) {
            let face = corners.map(|k| tet[k]);
            let code = 4 * t + i;
            let state = match self.opposite(face) {
                Some(other) => {
                    self.states[other as usize] = State::Closed;
                    State::Closed
                }
                None => {
                    face.iter().for_each(|&v| self.around[v as usize].push(code));
                    State::Open
                }
            };
            self.states.push(state);
        }
    }

    fn face(&self, code: u32) -> [u32; 3] {
        let tet = self.tets[code as usize / 4];
        FACES[code as usize % 4].map(|k| tet[k])
    }

    /// The open face that goes round these vertices the other way.
    fn opposite(&mut self, [a, b, c]: [u32; 3]) -> Option<u32> {
        self.look_around(a, |other, state| {
            state == State::Open && [[a, c, b], [c, b, a], [b, a, c]].contains(&other)
        })
    }

    /// The first face around a vertex that `take` takes. Forgets faces that are closed.
    fn look_around(&mut self, v: u32, mut take: impl FnMut([u32; 3], State) -> bool) -> Option<u32> {
        let mut list = std::mem::take(&mut self.around[v as usize]);
        let (mut at, mut found) = (0, None);
        while at < list.len().min(MOST_AROUND) {
            let state = self.states[list[at] as usize];
            if state == State::Closed {
                list.swap_remove(at);
                continue;
            }
            if take(self.face(list[at]), state) {
                found = Some(list[at]);
                break;
            }
            at += 1;
        }
        self.around[v as usize] = list;
        found
    }

    /// The next face whose other side is to be coded.
    pub fn gate(&mut self) -> Option<Gate> {
        while *self.states.get(self.next)? != State::Open {
            self.next += 1;
        }
        let code = self.next as u32;
        let face = self.face(code);
        let mut gate = Gate { face, candidates: Default::default(), count: 0, borders: 0, straight: 0 };
        let [a, b, c] = face;
        for [u, v, w] in [[a, b, c], [b, c, a], [c, a, b]] {
            self.look_across(&mut gate, [u, v, w]);
        }
        gate.candidates[..gate.count].sort_by(|a, b| b.faces.cmp(&a.faces).then(a.angle.total_cmp(&b.angle)));
        Some(gate)
    }

    fn look_across(&mut self, gate: &mut Gate, [u, v, w]: [u32; 3]) {
        let corners = [u, v, w].map(|x| self.positions[x as usize]);
        let positions = std::mem::take(&mut self.positions);
        let mut best: Option<(f64, u32, State)> = None;
        self.look_around(u, |[a, b, c], state| {
            let across =
                [[a, b, c], [b, c, a], [c, a, b]].into_iter().find(|face| face[0] == v && face[1] == u);
            if let Some([.., x]) = across {
                let angle = angle(corners, positions[x as usize]);
                if best.is_none_or(|best| angle < best.0) {
                    best = Some((angle, x, state));
                }
            }
            false
        });
        self.positions = positions;
        match best {
            Some((angle, _, State::Border)) => {
                gate.borders += 1;
                gate.straight += u32::from((angle - 2.0).abs() < 0.05);
            }
            Some((angle, vertex, _)) => {
                let known = &mut gate.candidates[..gate.count];
                if let Some(known) = known.iter_mut().find(|known| known.vertex == vertex) {
                    known.faces += 1;
                    known.angle = known.angle.min(angle);
                } else {
                    gate.candidates[gate.count] = Candidate { vertex, faces: 1, angle };
                    gate.count += 1;
                }
            }
            None => {}
        }
    }

    /// The other vertices of open faces that meet the gate, as far as they lie in front of it: first the one whose sphere with the gate
    /// reaches out least.
    pub fn others(&mut self, gate: &Gate) -> Vec<u32> {
        let mut found: Vec<u32> = Vec::new();
        for v in gate.face {
            self.look_around(v, |face, state| {
                if state == State::Open {
                    found.extend(face);
                }
                false
            });
        }
        found.sort_unstable();
        found.dedup();
        let [a, b, c] = gate.face.map(|v| self.positions[v as usize]);
        let candidates = gate.candidates();
        let mut ranked: Vec<(f64, u32)> = Vec::new();
        for v in found {
            let p = self.positions[v as usize];
            if candidates.iter().all(|known| known.vertex != v) && orient3d(a, b, c, p) > 0 {
                ranked.push((reach([a, b, c], p), v));
            }
        }
        ranked.sort_unstable_by(|(near, v), (far, w)| near.total_cmp(far).then(v.cmp(w)));
        ranked.into_iter().map(|(_, v)| v).collect()
    }

    /// Marks the gate as a face of the boundary.
    pub fn close(&mut self) {
        self.states[self.next] = State::Border;
    }

    /// Puts a tetrahedron behind the gate.
    pub fn attach(&mut self, gate: &Gate, apex: u32) {
        let [a, b, c] = gate.face;
        self.add([a, b, c, apex]);
        // Even if it did not find the gate.
        self.states[self.next] = State::Closed;
    }
}

/// The angle from face `(u, v, w)` out to a face at the edge `uv` with third vertex `p`: 0 to 4, of which 1 is a right angle and 2 is
/// straight.
fn angle([u, v, w]: [[i32; 3]; 3], p: [i32; 3]) -> f64 {
    let [v, w, p] = [v, w, p].map(|x| at(x) - at(u));
    let n = v.cross(w);
    // In the face, away from the edge.
    let m = n.cross(v);
    let (s, h) = (m.dot(p), n.dot(p) * v.length());
    let size = s.abs() + h.abs();
    let turn = if size > 0.0 { s / size } else { 1.0 };
    if h >= 0.0 { 1.0 - turn } else { 3.0 + turn }
}

/// How far in front of a face the centre of the sphere through it and `p` lies.
fn reach([a, b, c]: [[i32; 3]; 3], p: [i32; 3]) -> f64 {
    let [b, c, p] = [b, c, p].map(|x| at(x) - at(a));
    let n = b.cross(c);
    let (bb, cc, nn) = (b.length_squared(), c.length_squared(), n.length_squared());
    // From `a` to the centre of the circle through the face.
    let o = (bb * c.cross(n) + cc * n.cross(b)) / (2.0 * nn);
    (p.length_squared() - 2.0 * p.dot(o)) / n.dot(p)
}

fn at(q: [i32; 3]) -> DVec3 {
    DVec3::from(q.map(f64::from))
}

/// The order in which a mesh grows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[doc(hidden)]
pub struct GrowthOrder {
    /// The new number of each vertex; [`NONE`] where no tetrahedron has it.
    pub number: Vec<u32>,
    /// The vertices in their new order.
    pub vertices: Vec<u32>,
    /// Where each tetrahedron was.
    pub places: Vec<u32>,
    /// The tetrahedra in their new order, with new numbers of vertices and the corners in the order in which they come.
    pub tets: Vec<[u32; 4]>,
}

impl GrowthOrder {
    /// The new number of a vertex, which it gets when it is asked for first.
    fn number(&mut self, growth: &mut Growth, positions: &[[i32; 3]], v: u32) -> u32 {
        let number = &mut self.number[v as usize];
        if *number == NONE {
            *number = growth.add_vertex(positions[v as usize]);
            self.vertices.push(v);
        }
        *number
    }

    /// The fourth vertex of a tetrahedron that has the other three.
    fn apex(&self, tet: [u32; 4], face: [u32; 3]) -> Option<u32> {
        tet.into_iter().find(|&v| !face.contains(&self.number[v as usize]))
    }
}

/// Numbers vertices and orders tetrahedra as they come when the mesh grows over its faces from its first tetrahedron. What is in that order
/// already stays as it is. `tets` must be those of a mesh, positive, and name no vertex beyond `positions`.
#[doc(hidden)]
pub fn growth_order(positions: &[[i32; 3]], tets: &[[u32; 4]]) -> GrowthOrder {
    // A mesh has no face of three tetrahedra; without neighbours, each one stays where it is.
    let neighbors = neighbors(tets).unwrap_or_else(|_| vec![[NONE; 4]; tets.len()]);
    let mut order = GrowthOrder { number: vec![NONE; positions.len()], ..GrowthOrder::default() };
    let mut growth = Growth::default();
    let mut done = vec![false; tets.len()];
    let mut seed = 0;
    while order.places.len() < tets.len() {
        let Some(gate) = growth.gate() else {
            while done[seed] {
                seed += 1;
            }
            let tet = tets[seed].map(|v| order.number(&mut growth, positions, v));
            growth.add(tet);
            order.places.push(seed as u32);
            done[seed] = true;
            continue;
        };
        let (at, corner) = (growth.next / 4, growth.next % 4);
        let old = order.places[at] as usize;
        let opposite = growth.tets[at][corner];
        // Corners come in another order than they had.
        let side = tets[old].iter().position(|&v| order.number[v as usize] == opposite);
        let n = neighbors[old][side.unwrap_or(0)] as usize;
        let behind = tets.get(n).filter(|_| !done[n]);
        match behind.and_then(|&tet| order.apex(tet, gate.face)) {
            None => growth.close(),
            Some(v) => {
                let v = order.number(&mut growth, positions, v);
                growth.attach(&gate, v);
                order.places.push(n as u32);
                done[n] = true;
            }
        }
    }
    order.tets = growth.tets;
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::kuhn_tets;

    #[test]
    fn the_order_is_one_of_the_same_mesh_and_stays() {
        let n = 4;
        let positions: Vec<[i32; 3]> = (0..n * n * n).map(|i| [i % n, i / n % n, i / n / n]).collect();
        // Turned round, so that all has to change.
        let tets: Vec<[u32; 4]> = kuhn_tets([n as u32; 3]).into_iter().rev().step_by(2).collect();
        let order = growth_order(&positions, &tets);
        let sorted = |mut tet: [u32; 4]| {
            tet.sort_unstable();
            tet
        };
        for (new, &place) in order.tets.iter().zip(&order.places) {
            let old = tets[place as usize];
            assert_eq!(sorted(old), sorted(new.map(|v| order.vertices[v as usize])));
            let [a, b, c, d] = new.map(|v| positions[order.vertices[v as usize] as usize]);
            assert!(orient3d(a, b, c, d) > 0);
        }
        let moved: Vec<[i32; 3]> = order.vertices.iter().map(|&v| positions[v as usize]).collect();
        let again = growth_order(&moved, &order.tets);
        assert_eq!(again.tets, order.tets);
        assert!((0..).zip(&again.places).all(|(i, &place)| i == place));
    }
}
