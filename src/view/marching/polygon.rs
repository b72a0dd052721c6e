//! How a surface cuts one tetrahedron.

use crate::mesh::EDGES;

/// Where a surface crosses an edge of the mesh: the end inside and the end outside, or twice the same point if the surface
/// goes through that point.
pub(in crate::view) type Ends = [u32; 2];

/// The piece of a surface in one tetrahedron: no corner, or three or four different ones, counter-clockwise when seen from
/// the inside.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::view) struct Polygon {
    corners: [Ends; 4],
    len: usize,
}

/// The crossed edges of each of the 16 cases of marching tetrahedra, as indices into [`EDGES`], in an order that turns
/// counter-clockwise when seen from the inside; bit `i` of the case is set when vertex `i` is inside.
const CASES: [&[usize]; 16] = [
    &[],
    &[0, 2, 1],
    &[0, 3, 4],
    &[1, 3, 4, 2],
    &[1, 5, 3],
    &[2, 5, 3, 0],
    &[0, 1, 5, 4],
    &[2, 5, 4],
    &[2, 4, 5],
    &[0, 4, 5, 1],
    &[3, 5, 2, 0],
    &[1, 3, 5],
    &[1, 2, 4, 3],
    &[0, 4, 3],
    &[0, 1, 2],
    &[],
];

/// The corners that the crossed edges of each case run between, the one inside first; padded with the first edge.
const CORNERS: [[[u8; 2]; 4]; 16] = {
    let mut corners = [[[0; 2]; 4]; 16];
    let mut case = 0;
    while case < 16 {
        let mut i = 0;
        while i < 4 && !CASES[case].is_empty() {
            let [a, b] = EDGES[CASES[case][i % CASES[case].len()]];
            corners[case][i] = if case >> a & 1 == 1 { [a as u8, b as u8] } else { [b as u8, a as u8] };
            i += 1;
        }
        case += 1;
    }
    corners
};

impl Polygon {
    /// The piece in `tet`, of which the vertices in `inside` are inside and those in `touched` in the surface itself, a bit
    /// for each; no vertex is both. A touched vertex is used itself.
    #[inline]
    pub fn of(tet: [u32; 4], inside: usize, touched: usize) -> Self {
        let case = inside & 15;
        let corners = CORNERS[case].map(|corners| {
            let [inside, outside] = corners.map(|corner| usize::from(corner & 3));
            [tet[if touched >> outside & 1 == 1 { outside } else { inside }], tet[outside]]
        });
        let polygon = Self { corners, len: CASES[case].len() };
        if touched == 0 { polygon } else { polygon.without_repeats() }
    }

    /// The face of a tetrahedron that has these points, all of which are touched.
    pub fn of_face(face: [u32; 3]) -> Self {
        let [a, b, c] = face.map(|point| [point; 2]);
        Self { corners: [a, b, c, a], len: 3 }
    }

    /// Edges that end in the same touched point follow one another: one corner for all of them. What is left without an area
    /// is nothing.
    #[cold]
    fn without_repeats(self) -> Self {
        let mut kept = Self::default();
        for &corner in self.corners() {
            if kept.corners().last() != Some(&corner) {
                kept.corners[kept.len] = corner;
                kept.len += 1;
            }
        }
        if kept.len > 1 && kept.corners[kept.len - 1] == kept.corners[0] {
            kept.len -= 1;
        }
        if kept.len < 3 { Self::default() } else { kept }
    }

    /// The polygon seen from the other side.
    pub fn reversed(mut self) -> Self {
        self.corners[..self.len].reverse();
        self
    }

    #[inline]
    pub fn corners(&self) -> &[Ends] {
        &self.corners[..self.len]
    }
}
