//! The paper's second task: to build T_u, given the polyhedron Π_u and the stream.
//!
//! The stream names no vertices. It is followed from f_u on, tetrahedron by tetrahedron, and each is known by the facet that it
//! is entered through and its fourth vertex, the apex:
//!
//! ```text
//!        x          A facet with label 0 is a face of Π_u. Behind each directed edge of Π_u there is one face:
//!       ╱│╲         if the facet with the edge (a, b) is one of them, x is the third vertex of that face.
//!      ╱ │ ╲
//!     a──┼──b       Where all three facets are inside, every vertex is tried that makes the tetrahedron positive, in the order
//!      ╲ │ ╱        in which spheres through the entry reach them.
//!       ╲│╱
//!        c
//! ```
//!
//! What does not fit is given up, and the next vertex is tried: a facet with label 0 must be a face of Π_u, one with label 10 or
//! 11 none; no facet is taken twice; a label 11 must meet another 11, of a tetrahedron that this one was reached from, whose facet
//! comes later there. Positive tetrahedra with the boundary Π_u fill it. Others than those of T_u may do that, too: so the writer
//! does what readers do, and notes the vertices where that does not lead to T_u, or takes too long.
//!
//! On the boundary of the domain, faces of T_u are given up where the new vertex does not lie in front of them. They have the label 0
//! and are not among the faces of Π_u that the star of the vertex shows; their number follows from that of the labels.

use super::tree_code::{Label, Tree, facets};
use crate::geom::orient3d;
use crate::mesh::FACES;
use crate::mt::vertex::cavity_fill::{Across, CavityFill, Face, turned};
use crate::mt::vertex::limits::{MAX_AROUND, MAX_INSERTED, MAX_REMOVED};
use crate::mt::vertex::sphere_order::Spheres;

/// Tetrahedra that [`VertexTreeMt`](crate::mt::VertexTreeMt) tries to build T_u of before it takes that for a failure.
pub const MOST_TRIES: u32 = 20_000;

/// Π_u as the star of its vertex shows it, in canonical numbers.
#[derive(Clone, Copy, Debug)]
pub(in crate::mt) struct Polyhedron<'a> {
    pub positions: &'a [[i32; 3]],
    /// The faces of Π_u, turned and in canonical order.
    pub faces: &'a [Face],
    /// The place of f_u among them.
    pub first: usize,
    /// The new vertex.
    pub centre: [i32; 3],
    /// Whether faces on the boundary of the domain are given up just where the new vertex is not in front of them.
    pub by_sides: bool,
}

/// Builds T_u: its tetrahedra in the order of the tree, each with its apex in front. `apexes` has these where the stream alone does not
/// lead there. None if nothing fits.
pub(in crate::mt) fn rebuild(
    tree: &Tree,
    hole: Polyhedron<'_>,
    apexes: Option<&[u8]>,
    fill: &mut CavityFill,
) -> Option<()> {
    let mut search = Search::new(tree, hole, apexes, fill)?;
    search.solve(0).then_some(())
}

/// A facet that has been labelled.
#[derive(Clone, Copy, Debug)]
struct Facet {
    /// As its tetrahedron sees it.
    face: Face,
    tet: u8,
    /// Which of the three it is, and which corner lies opposite.
    place: u8,
    side: u8,
    is: Is,
}

/// What a facet is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Is {
    /// A face of Π_u.
    Wall(u8),
    /// A face on the boundary of the domain that is given up.
    GivenUp,
    /// The next tetrahedron is behind it.
    Entry,
    /// The facet waits for that of a tetrahedron that is still to come, or has met it.
    Open,
    Taken,
    /// The facet has met another one, by its place in the list.
    Met(u16),
}

struct Search<'a> {
    tree: &'a Tree,
    hole: Polyhedron<'a>,
    apexes: Option<&'a [u8]>,
    fill: &'a mut CavityFill,
    /// For a directed edge the place of the face of Π_u that has it.
    edges: Box<[u8; MAX_AROUND * MAX_AROUND]>,
    covered: [bool; MAX_INSERTED],
    /// Faces that are still to be given up.
    to_give_up: usize,
    facets: Vec<Facet>,
    /// By tetrahedron and facet: where it is in the list.
    list: [[u16; 3]; MAX_REMOVED],
    /// Open facets of each tetrahedron.
    open: [u8; MAX_REMOVED],
    spheres: Spheres,
    tries: u32,
}

const NO_FACE: u8 = u8::MAX;

#[inline]
fn edge(from: u8, to: u8) -> usize {
    (usize::from(from) << 6 | usize::from(to)) % (MAX_AROUND * MAX_AROUND)
}

/// The face as the tetrahedron behind it sees it.
#[inline]
fn from_behind([a, b, c]: Face) -> Face {
    [a, c, b]
}

impl<'a> Search<'a> {
    fn new(
        tree: &'a Tree,
        hole: Polyhedron<'a>,
        apexes: Option<&'a [u8]>,
        fill: &'a mut CavityFill,
    ) -> Option<Self> {
        let to_give_up = tree.boundary_faces().checked_sub(hole.faces.len())?;
        let mut edges = Box::new([NO_FACE; MAX_AROUND * MAX_AROUND]);
        for (place, &[a, b, c]) in (0_u8..).zip(hole.faces) {
            [edge(a, b), edge(b, c), edge(c, a)].into_iter().for_each(|at| edges[at] = place);
        }
        let mut covered = [false; MAX_INSERTED];
        *covered.get_mut(hole.first)? = true;
        fill.len = tree.nodes().len();
        Some(Self {
            tree,
            apexes,
            fill,
            edges,
            covered,
            to_give_up,
            facets: Vec::new(),
            list: [[0; 3]; MAX_REMOVED],
            open: [0; MAX_REMOVED],
            spheres: Spheres::of(hole.positions.iter().copied()),
            tries: 0,
            hole,
        })
    }

    /// Finds all tetrahedra from number `t` on.
    fn solve(&mut self, t: usize) -> bool {
        if t == self.tree.nodes().len() {
            return self.to_give_up == 0;
        }
        let Some(entry) = self.entry(t) else { return false };
        if let Some(apexes) = self.apexes {
            return apexes.get(t).is_some_and(|&x| self.attempt(t, entry, x));
        }
        if let Some(x) = self.apex_at_boundary(t, entry) {
            return self.attempt(t, entry, x);
        }
        for place in 0.. {
            let Some(x) = self.spheres.vertex(entry, place) else { return false };
            if self.attempt(t, entry, x) {
                return true;
            }
        }
        false
    }

    /// The facet that a tetrahedron is entered through, as it lies in front of the apex.
    fn entry(&self, t: usize) -> Option<Face> {
        let node = self.tree.nodes()[t];
        if t == 0 {
            return self.hole.faces.get(self.hole.first).copied();
        }
        let at = self.list[usize::from(node.parent)][usize::from(node.facet)];
        Some(from_behind(self.facets[usize::from(at)].face))
    }

    /// The apex, if a facet with label 0 tells it.
    fn apex_at_boundary(&self, t: usize, [a, b, c]: Face) -> Option<u8> {
        // The corners of the tetrahedron are the apex and these.
        let own = facets([0, a, b, c], 0);
        let labels = self.tree.nodes()[t].labels;
        let outer = own.into_iter().zip(labels).filter(|(_, label)| *label == Label::Boundary);
        let mut faces = outer.filter_map(|(corner, _)| {
            let at = match corner {
                1 => edge(c, b),
                2 => edge(a, c),
                _ => edge(b, a),
            };
            self.hole.faces.get(usize::from(self.edges[at]))
        });
        let apex = |face: &Face| face.iter().copied().find(|x| ![a, b, c].contains(x));
        faces.find_map(apex)
    }

    /// Puts tetrahedron `t` there with this apex, and all that follow; or nothing.
    fn attempt(&mut self, t: usize, entry: Face, x: u8) -> bool {
        self.tries += 1;
        if self.tries > MOST_TRIES {
            return false;
        }
        let before = self.facets.len();
        if self.put(t, entry, x).is_some() && self.solve(t + 1) {
            return true;
        }
        self.take_back(before);
        false
    }

    fn put(&mut self, t: usize, [a, b, c]: Face, x: u8) -> Option<()> {
        let tet = [x, a, b, c];
        let [p, q, r, s] = tet.map(|x| self.hole.positions.get(usize::from(x)).copied());
        if [a, b, c].contains(&x) || orient3d(p?, q?, r?, s?) <= 0 {
            return None;
        }
        self.fill.tets[t] = tet;
        self.open[t] = 0;
        let node = self.tree.nodes()[t];
        self.fill.across[t][0] = if t == 0 {
            Across::Outside(self.hole.first as u8)
        } else {
            let at = self.list[usize::from(node.parent)][usize::from(node.facet)];
            let side = self.facets[usize::from(at)].side;
            self.fill.across[usize::from(node.parent)][usize::from(side)] = Across::Inside(t as u8);
            Across::Inside(node.parent)
        };
        for (place, side) in facets([0, a, b, c], 0).into_iter().enumerate() {
            let face = turned(FACES[side].map(|k| tet[k]));
            self.label(t, place, side, face)?;
        }
        self.are_closed(t).then_some(())
    }

    /// Whether all that is complete with tetrahedron `t` has no open facets.
    fn are_closed(&self, t: usize) -> bool {
        let mut at = t;
        while usize::from(self.tree.nodes()[at].end) == t + 1 {
            if self.open[at] > 0 {
                return false;
            }
            if at == 0 {
                break;
            }
            at = usize::from(self.tree.nodes()[at].parent);
        }
        true
    }

    /// Adds a facet to the list, if it fits its label.
    fn label(&mut self, t: usize, place: usize, side: usize, face: Face) -> Option<()> {
        let [wall, behind] = [face, from_behind(face)].map(|face| self.wall(face));
        let labels = self.tree.nodes()[t].labels;
        let met = self.facets.iter().position(|other| other.face == from_behind(face));
        let twice = self.facets.iter().any(|other| other.face == face);
        let is = match (labels[place], wall, met) {
            (Label::Boundary, Some(wall), None) if !self.covered[usize::from(wall)] => Is::Wall(wall),
            (Label::Boundary, None, None) if self.may_give_up(face) => Is::GivenUp,
            (Label::Next, None, None) => Is::Entry,
            (Label::Traversed, None, Some(met)) if self.may_meet(t, met) => Is::Met(met as u16),
            // What it meets may come before the next facet.
            (Label::Traversed, None, None) if labels[..place].contains(&Label::Next) => Is::Open,
            _ => return None,
        };
        if behind.is_some() || twice {
            return None;
        }
        self.list[t][place] = self.facets.len() as u16;
        self.facets.push(Facet { face, tet: t as u8, place: place as u8, side: side as u8, is });
        self.enlist(t, side, is);
        Some(())
    }

    /// The place of a face among those of Π_u, if it is one.
    fn wall(&self, face: Face) -> Option<u8> {
        let place = self.edges[edge(face[0], face[1])];
        (self.hole.faces.get(usize::from(place)) == Some(&face)).then_some(place)
    }

    fn may_give_up(&self, face: Face) -> bool {
        let [a, b, c] = face.map(|x| self.hole.positions[usize::from(x)]);
        self.to_give_up > 0 && (!self.hole.by_sides || orient3d(self.hole.centre, a, b, c) <= 0)
    }

    /// Whether a facet of tetrahedron `t` may meet that one: it must be open, of a tetrahedron that `t` was reached from, and come
    /// after the facet that leads to `t`.
    fn may_meet(&self, t: usize, met: usize) -> bool {
        let (nodes, other) = (self.tree.nodes(), self.facets[met]);
        let from = usize::from(other.tet);
        if other.is != Is::Open || t <= from || t >= usize::from(nodes[from].end) {
            return false;
        }
        let mut at = t;
        while usize::from(nodes[at].parent) != from {
            at = usize::from(nodes[at].parent);
        }
        nodes[at].facet < other.place
    }

    fn enlist(&mut self, t: usize, side: usize, is: Is) {
        match is {
            Is::Wall(place) => {
                self.covered[usize::from(place)] = true;
                self.fill.across[t][side] = Across::Outside(place);
            }
            Is::GivenUp => {
                self.to_give_up -= 1;
                self.fill.across[t][side] = Across::Nothing;
            }
            Is::Entry | Is::Taken => {}
            Is::Open => self.open[t] += 1,
            Is::Met(met) => {
                let other = &mut self.facets[usize::from(met)];
                other.is = Is::Taken;
                let (from, back) = (usize::from(other.tet), usize::from(other.side));
                self.open[from] -= 1;
                self.fill.across[t][side] = Across::Inside(from as u8);
                self.fill.across[from][back] = Across::Inside(t as u8);
            }
        }
    }

    /// Takes all facets from number `len` on off the list.
    fn take_back(&mut self, len: usize) {
        while self.facets.len() > len {
            let Some(facet) = self.facets.pop() else { return };
            match facet.is {
                Is::Wall(place) => self.covered[usize::from(place)] = false,
                Is::GivenUp => self.to_give_up += 1,
                Is::Met(met) => {
                    let other = &mut self.facets[usize::from(met)];
                    other.is = Is::Open;
                    self.open[usize::from(other.tet)] += 1;
                }
                Is::Entry | Is::Open | Is::Taken => {}
            }
        }
    }
}
