//! The stream of T_u [§5, Fig. 5]: a depth-first traversal of its tetrahedra, with a label for each facet.
//!
//! The traversal enters t_u through the boundary face f_u, and each other tetrahedron from one that it has been in. Every
//! tetrahedron has three facets besides the one that it was entered through. They are labelled in turn:
//!
//! - `0`: a face of Π_u;
//! - `10`: behind it is a tetrahedron of T_u that has not been traversed yet. It comes next, with all that is reached from it;
//! - `11`: behind it is one that has been traversed.
//!
//! The paper leaves the order of the three facets open. Here it is that of the labels of the vertices opposite them, so that it
//! is the same in every mesh. Three tetrahedra around an edge, with six faces of Π_u, two at each; first as seen along the edge, whose ends
//! lie in front and behind at +, then as a tree:
//!
//! ```text
//!           3                  A   the edge, 2 and 3; f_u is one of its two faces of Π_u
//!         ╱ │ ╲                B   the edge, 3 and 4
//!        ╱  │  ╲               C   the edge, 4 and 2
//!       ╱ A │ B ╲
//!      ╱  ╱ + ╲  ╲             A and B meet in the face between + and 3, B and C in that between
//!      2 ╱  C  ╲ 4             + and 4, and C and A in that between + and 2
//!        ───────
//!
//!   f_u
//!    │
//!    A ─ 0
//!    ├ 10 ─▶ B ─ 0                      A   0 10               11
//!    │       ├ 0                        B        0 0 10
//!    │       └ 10 ─▶ C ─ 0              C               0 0 11
//!    │               ├ 0
//!    │               └ 11, to A         0 10 0 0 10 0 0 11 11
//!    └ 11, to C
//! ```
//!
//! With p tetrahedra and q faces of Π_u there are p − 1 labels `10`, q − 1 labels `0`, and 2 p − q + 2 labels `11`, two for
//! each facet inside that the tree does not pass: 6 p − q + 1 bits. So the stream says where it ends.

use crate::mesh::FACES;
use crate::mt::vertex::bit_string::Bits;
use crate::mt::vertex::limits::MAX_REMOVED;

/// What is behind a facet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::mt) enum Label {
    /// `0`: a face of Π_u.
    #[default]
    Boundary,
    /// `10`: the tetrahedron that comes next.
    Next,
    /// `11`: one that has been traversed.
    Traversed,
}

impl Label {
    fn read(bits: &Bits, at: &mut u64) -> Self {
        let two = bits.get(*at, 2);
        *at += 1 + (two & 1);
        match two {
            0b01 => Self::Next,
            0b11 => Self::Traversed,
            _ => Self::Boundary,
        }
    }

    fn write(self, bits: &mut Bits) {
        // The first bit is the lowest one.
        match self {
            Self::Boundary => bits.push(0, 1),
            Self::Next => bits.push(0b01, 2),
            Self::Traversed => bits.push(0b11, 2),
        }
    }
}

/// The corners of a tetrahedron but `entry`, in the order in which the facets opposite them are labelled.
#[inline]
pub(in crate::mt) fn facets<T: Copy + Ord>(labels: [T; 4], entry: usize) -> [usize; 3] {
    let mut corners = FACES[entry & 3];
    corners.sort_unstable_by_key(|&corner| labels[corner & 3]);
    corners
}

/// A tetrahedron of T_u in the tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::mt) struct TreeNode {
    pub labels: [Label; 3],
    /// The tetrahedron that it was entered from, and through which of its labelled facets. Of t_u both are 0.
    pub parent: u8,
    pub facet: u8,
    /// The end of the tetrahedra that are reached from it, which are the next ones.
    pub end: u8,
}

/// The spanning tree of T_u: its tetrahedra as they are entered.
///
/// Each comes after the one that it was entered from, and a subtree is a range: that of node `i` is `i .. nodes[i].end`.
///
/// ```text
///   A ─▶ B ─▶ C           node     A   B   C   D
///   └──▶ D                parent   -   A   B   A
///                         end      4   3   3   4
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::mt) struct Tree {
    nodes: [TreeNode; MAX_REMOVED],
    len: usize,
}

impl Tree {
    fn new() -> Self {
        Self { nodes: [TreeNode::default(); MAX_REMOVED], len: 0 }
    }

    pub fn nodes(&self) -> &[TreeNode] {
        &self.nodes[..self.len]
    }

    /// Faces of Π_u, f_u among them.
    pub fn boundary_faces(&self) -> usize {
        let labels = self.nodes().iter().flat_map(|node| node.labels);
        1 + labels.filter(|&label| label == Label::Boundary).count()
    }

    /// Reads a stream; with it where it ends. None if it has too many tetrahedra.
    pub fn read(bits: &Bits, start: u64) -> Option<(Self, u64)> {
        let (mut tree, mut at) = (Self::new(), start);
        tree.read_from(bits, &mut at, [0, 0])?;
        Some((tree, at))
    }

    fn read_from(&mut self, bits: &Bits, at: &mut u64, from: [usize; 2]) -> Option<()> {
        let own = self.enter(from)?;
        for facet in 0..3 {
            let label = Label::read(bits, at);
            self.nodes[own].labels[facet] = label;
            if label == Label::Next {
                self.read_from(bits, at, [own, facet])?;
            }
        }
        self.nodes[own].end = self.len as u8;
        Some(())
    }

    fn enter(&mut self, [parent, facet]: [usize; 2]) -> Option<usize> {
        let own = self.len;
        *self.nodes.get_mut(own)? =
            TreeNode { parent: parent as u8, facet: facet as u8, ..TreeNode::default() };
        self.len += 1;
        Some(own)
    }

    /// Appends the stream.
    pub fn write(&self, bits: &mut Bits) {
        if self.len > 0 {
            self.write_from(bits, &mut 0);
        }
    }

    fn write_from(&self, bits: &mut Bits, next: &mut usize) {
        let TreeNode { labels, .. } = self.nodes[*next];
        *next += 1;
        for label in labels {
            label.write(bits);
            if label == Label::Next {
                self.write_from(bits, next);
            }
        }
    }
}

/// T_u in canonical numbers, to be traversed.
#[derive(Clone, Debug)]
pub(in crate::mt) struct Traversal<'a> {
    tets: &'a [[u8; 4]],
    /// The tetrahedron behind each facet, by the corner opposite it.
    across: Vec<[Option<u8>; 4]>,
    entered: Vec<bool>,
    tree: Tree,
    /// The corner of each tetrahedron that the facet it was entered through lies opposite, as they are entered.
    apexes: Vec<u8>,
}

impl<'a> Traversal<'a> {
    pub fn of(tets: &'a [[u8; 4]]) -> Self {
        let sorted = |mut face: [u8; 3]| {
            face.sort_unstable();
            face
        };
        let sides = |(t, tet): (usize, &[u8; 4])| {
            [0, 1, 2, 3].map(|corner| (sorted(FACES[corner].map(|k| tet[k])), t, corner))
        };
        let mut sides: Vec<_> = tets.iter().enumerate().flat_map(sides).collect();
        sides.sort_unstable();
        let mut across = vec![[None; 4]; tets.len()];
        for pair in sides.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            let [(_, t, corner), (_, other, back)] = [pair[0], pair[1]];
            across[t][corner] = Some(other as u8);
            across[other][back] = Some(t as u8);
        }
        Self { tets, across, entered: Vec::new(), tree: Tree::new(), apexes: Vec::new() }
    }

    /// The tree of the traversal that enters tetrahedron `first` through the facet opposite corner `entry`, and for each
    /// tetrahedron the vertex that it has besides the facet that it is entered through. None if there are too many.
    pub fn from(&mut self, first: usize, entry: usize) -> Option<(&Tree, &[u8])> {
        self.entered = vec![false; self.tets.len()];
        self.tree = Tree::new();
        self.apexes.clear();
        self.traverse(first, entry, [0, 0])?;
        Some((&self.tree, &self.apexes))
    }

    fn traverse(&mut self, t: usize, entry: usize, from: [usize; 2]) -> Option<()> {
        let own = self.tree.enter(from)?;
        self.entered[t] = true;
        self.apexes.push(self.tets[t][entry]);
        for (facet, corner) in facets(self.tets[t], entry).into_iter().enumerate() {
            let across = self.across[t][corner].map(usize::from);
            let label = match across {
                None => Label::Boundary,
                Some(other) if self.entered[other] => Label::Traversed,
                Some(_) => Label::Next,
            };
            self.tree.nodes[own].labels[facet] = label;
            if let (Some(other), Label::Next) = (across, label) {
                let back = self.across[other].iter().position(|&n| n == Some(t as u8))?;
                self.traverse(other, back, [own, facet])?;
            }
        }
        self.tree.nodes[own].end = self.tree.len as u8;
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(tets: &[[u8; 4]], first: usize, entry: usize) -> (String, Bits) {
        let mut bits = Bits::default();
        let mut traversal = Traversal::of(tets);
        let (tree, _) = traversal.from(first, entry).expect("few tetrahedra");
        tree.write(&mut bits);
        let text = (0..bits.len()).map(|at| if bits.get(at, 1) == 1 { '1' } else { '0' }).collect();
        assert_eq!(Tree::read(&bits, 0), Some((tree.clone(), bits.len())));
        (text, bits)
    }

    #[test]
    fn streams_are_as_worked_out_by_hand() {
        // One tetrahedron, two at a face, and the three of the drawing: 0 and 1 are the edge, A has 2 and 3, B 3 and 4, C 4 and 2.
        assert_eq!(stream(&[[0, 1, 2, 3]], 0, 3).0, "000");
        assert_eq!(stream(&[[0, 1, 2, 3], [1, 4, 2, 3]], 0, 3).0, "1000000");
        let around = [[0, 1, 2, 3], [0, 1, 3, 4], [0, 1, 4, 2]];
        // A is entered opposite 1, so through 0 2 3; opposite 0 is the boundary, opposite 2 is B, opposite 3 is C.
        // B is entered opposite 4: opposite 0 and 1 is the boundary, opposite 3 is C. That is entered opposite 2: opposite 4 is A.
        assert_eq!(stream(&around, 0, 1).0, ["0", "10", "0", "0", "10", "0", "0", "11", "11"].concat());
    }

    #[test]
    fn streams_take_as_many_bits_as_the_paper_says() {
        // Tetrahedra around an edge, and an open fan of them.
        for n in 3..30_u8 {
            let around: Vec<[u8; 4]> = (0..n).map(|i| [0, 1, 2 + i, 2 + (i + 1) % n]).collect();
            for (tets, q) in [(&around[..], 2 * n), (&around[1..], 2 * n)] {
                let (bits, p) = (stream(tets, 0, 0).1, tets.len() as u64);
                assert_eq!(bits.len(), 6 * p + 1 - u64::from(q));
            }
        }
    }

    #[test]
    fn streams_that_never_end_are_refused() {
        let mut bits = Bits::default();
        (0..MAX_REMOVED).for_each(|_| Label::Next.write(&mut bits));
        assert_eq!(Tree::read(&bits, 0), None);
    }
}
