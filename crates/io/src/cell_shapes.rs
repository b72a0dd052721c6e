//! How cells of each type become tetrahedra that fit those of their neighbours.
//!
//! A cell is cut into convex parts, and each part into tetrahedra that join its vertex of the lowest number to the faces
//! that it is not on; these are cut into triangles in the same way. So the diagonal of a quadrilateral starts at its vertex
//! of the lowest number, seen from both sides, and no point is added. This is the rule of J. Dompierre, P. Labbé, M.-G. Vallet
//! and R. Camarero, "How to subdivide pyramids, prisms and hexahedra into tetrahedra" (8th International Meshing Roundtable,
//! 1999), which always gives a hexahedron six tetrahedra here.
//!
//! Quadratic cells keep their points at the middle of edges: a part at each corner, and the rest between these points.
//! Of a face that two cells share, both see the same points and cut it alike.

/// A part of a cell: its faces as numbers of the cell's points, in positive order seen from outside.
type Part = Vec<Vec<u8>>;

/// The parts of a cell.
#[derive(Clone, Debug)]
pub(super) struct Recipe {
    /// How many points the cell has.
    pub points: usize,
    parts: Vec<Part>,
}

const TETRAHEDRON: &[&[u8]] = &[&[1, 2, 3], &[0, 3, 2], &[0, 1, 3], &[0, 2, 1]];
const PYRAMID: &[&[u8]] = &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];
/// The normal of the first triangle points inward, as in VTK's parametric coordinates and in Gmsh (VTK's manual says the
/// opposite).
const WEDGE: &[&[u8]] = &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]];
const HEXAHEDRON: &[&[u8]] =
    &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]];

/// Edges in the order of the points at their middle.
pub(super) const TETRAHEDRON_EDGES: &[[u8; 2]] = &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
pub(super) const PYRAMID_EDGES: &[[u8; 2]] =
    &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]];
pub(super) const WEDGE_EDGES: &[[u8; 2]] =
    &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]];
pub(super) const HEXAHEDRON_EDGES: &[[u8; 2]] =
    &[[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];

/// The points of a triquadratic hexahedron, x fastest, then y, then z.
const GRID_27: [u8; 27] =
    [0, 8, 1, 11, 24, 9, 3, 10, 2, 16, 22, 17, 20, 26, 21, 19, 23, 18, 4, 12, 5, 15, 25, 13, 7, 14, 6];
/// The three triangles of a wedge with points at the middle of edges and quadrilaterals: corners, then middles.
const LAYERS_18: [[u8; 6]; 3] = [[0, 1, 2, 6, 7, 8], [12, 13, 14, 15, 16, 17], [3, 4, 5, 9, 10, 11]];
/// The two triangles of a wedge without points at the middle of quadrilaterals and upright edges.
const LAYERS_12: [[u8; 6]; 2] = [[0, 1, 2, 6, 7, 8], [3, 4, 5, 9, 10, 11]];
/// The three quadrilaterals of a hexahedron with points at the middle of edges and upright faces: corners, then middles.
const LAYERS_24: [[u8; 8]; 3] =
    [[0, 1, 2, 3, 8, 9, 10, 11], [16, 17, 18, 19, 22, 21, 23, 20], [4, 5, 6, 7, 12, 13, 14, 15]];
/// The middles of the faces of a pyramid of 19 points, in the order of the faces, and of the whole.
const MIDDLES_19: [u8; 5] = [13, 14, 15, 16, 17];
const MIDDLE_OF_19: u8 = 18;
/// The corners around the middles of the faces of a hexahedron of 27 points, and of the whole.
const MIDDLES_27: &[&[u8]] = &[
    &[0, 3, 4, 7],
    &[1, 2, 5, 6],
    &[0, 1, 4, 5],
    &[2, 3, 6, 7],
    &[0, 1, 2, 3],
    &[4, 5, 6, 7],
    &[0, 1, 2, 3, 4, 5, 6, 7],
];
/// The corners around the middles of the faces of a pyramid of 19 points, and of the whole.
const MIDDLES_OF_19: &[&[u8]] =
    &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4], &[0, 1, 2, 3, 4]];
/// The triangles that such a triangle is cut into.
const FOURTHS: [[usize; 3]; 4] = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]];

/// A quadratic pyramid with a point at the middle of its base, which VTK has no number for and Gmsh has.
pub(super) const PYRAMID_14: i64 = 1014;
/// The parts of that: pyramids of five points and tetrahedra.
const PARTS_14: [&[u8]; 10] = [
    &[0, 5, 13, 8, 9],
    &[5, 1, 6, 13, 10],
    &[13, 6, 2, 7, 11],
    &[8, 13, 7, 3, 12],
    &[9, 10, 11, 12, 4],
    &[9, 12, 11, 10, 13],
    &[5, 13, 9, 10],
    &[6, 13, 10, 11],
    &[7, 13, 11, 12],
    &[8, 13, 12, 9],
];

/// The recipe for a type of cells, by VTK's number; none if it has no volume or cannot be split.
pub(super) fn recipe(kind: i64) -> Option<Recipe> {
    let linear = |points, faces| Recipe { points, parts: vec![part(faces, None)] };
    Some(match kind {
        10 => linear(4, TETRAHEDRON),
        // A voxel has the order of a grid.
        11 => Recipe { points: 8, parts: vec![part(HEXAHEDRON, Some(&[0, 1, 3, 2, 4, 5, 7, 6]))] },
        12 => linear(8, HEXAHEDRON),
        13 => linear(6, WEDGE),
        14 => linear(5, PYRAMID),
        15 => Recipe { points: 10, parts: vec![prism(5)] },
        16 => Recipe { points: 12, parts: vec![prism(6)] },
        24 => quadratic(TETRAHEDRON, TETRAHEDRON_EDGES),
        25 => quadratic(HEXAHEDRON, HEXAHEDRON_EDGES),
        26 => quadratic(WEDGE, WEDGE_EDGES),
        27 => quadratic(PYRAMID, PYRAMID_EDGES),
        29 => Recipe { points: 27, parts: eighths() },
        31 => Recipe { points: 12, parts: wedges(&LAYERS_12) },
        32 => Recipe { points: 18, parts: wedges(&LAYERS_18) },
        33 => Recipe { points: 24, parts: slabs() },
        37 => Recipe { points: 19, parts: pyramids_around() },
        PYRAMID_14 => {
            let part_of =
                |points: &&[u8]| part(if points.len() == 4 { TETRAHEDRON } else { PYRAMID }, Some(points));
            Recipe { points: 14, parts: PARTS_14.iter().map(part_of).collect() }
        }
        _ => return None,
    })
}

/// The points of a cell of the second order that are in the middle of corners, each with these corners.
pub(super) fn middles(kind: i64) -> Vec<(u8, &'static [u8])> {
    let (edges, rest): (&[[u8; 2]], &[&[u8]]) = match kind {
        24 => (TETRAHEDRON_EDGES, &[]),
        25 => (HEXAHEDRON_EDGES, &[]),
        26 => (WEDGE_EDGES, &[]),
        27 => (PYRAMID_EDGES, &[]),
        29 => (HEXAHEDRON_EDGES, MIDDLES_27),
        31 => (&WEDGE_EDGES[..6], &[]),
        32 => (WEDGE_EDGES, &WEDGE[2..]),
        33 => (HEXAHEDRON_EDGES, &MIDDLES_27[..4]),
        37 => (PYRAMID_EDGES, MIDDLES_OF_19),
        PYRAMID_14 => (PYRAMID_EDGES, &PYRAMID[..1]),
        _ => return Vec::new(),
    };
    let first = edges.as_flattened().iter().max().map_or(0, |last| last + 1);
    let corners = edges.iter().map(<[u8; 2]>::as_slice).chain(rest.iter().copied());
    (first..).zip(corners).collect()
}

/// A part with these faces, whose points are some of the cell's.
fn part(faces: &[&[u8]], points: Option<&[u8]>) -> Part {
    let number = |&p: &u8| points.map_or(p, |points| points[usize::from(p)]);
    faces.iter().map(|face| face.iter().map(number).collect()).collect()
}

/// A prism over a polygon of `n` corners, whose normal points inward as that of a wedge.
fn prism(n: u8) -> Part {
    let next = |i: u8| (i + 1) % n;
    let sides = (0..n).map(|i| vec![i, next(i), n + next(i), n + i]);
    [(0..n).rev().collect(), (n..2 * n).collect()].into_iter().chain(sides).collect()
}

/// A cell with a point at the middle of each edge: a part at each corner, and the one that is left between the middles.
fn quadratic(faces: &[&[u8]], edges: &[[u8; 2]]) -> Recipe {
    let corners = faces.iter().flat_map(|face| face.iter()).max().map_or(0, |last| last + 1);
    let middle = |a: u8, b: u8| {
        let edge = edges.iter().zip(corners..).find(|(edge, _)| **edge == [a, b] || **edge == [b, a]);
        edge.map_or(0, |(_, point)| point)
    };
    // For each corner of each face: the middle of the edge to the next corner, and that of the edge from the last one.
    let around = |face: &&[u8]| -> Vec<[u8; 3]> {
        let n = face.len();
        let of = |i: usize| {
            let (last, corner, next) = (face[(i + n - 1) % n], face[i], face[(i + 1) % n]);
            [corner, middle(corner, next), middle(last, corner)]
        };
        (0..n).map(of).collect()
    };
    let cuts: Vec<[u8; 3]> = faces.iter().flat_map(around).collect();
    let mut core: Part =
        faces.iter().map(|face| around(face).iter().map(|[_, next, _]| *next).collect()).collect();
    let mut parts = Vec::new();
    for corner in 0..corners {
        let of_corner: Vec<[u8; 3]> = cuts.iter().filter(|cut| cut[0] == corner).copied().collect();
        let polygon = chained(&of_corner);
        let mut tip: Part = of_corner.iter().map(|cut| cut.to_vec()).collect();
        tip.push(polygon.iter().rev().copied().collect());
        parts.push(tip);
        core.push(polygon);
    }
    parts.push(core);
    Recipe { points: usize::from(corners) + edges.len(), parts }
}

/// The polygon of the steps from the second to the third number of each cut.
fn chained(cuts: &[[u8; 3]]) -> Vec<u8> {
    let mut at = cuts[0][1];
    let mut polygon = Vec::new();
    for _ in cuts {
        polygon.push(at);
        at = cuts.iter().find(|cut| cut[1] == at).map_or(at, |cut| cut[2]);
    }
    polygon
}

/// The eight hexahedra of one with points at the middle of everything.
fn eighths() -> Vec<Part> {
    let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    let hexahedron = |[x, y, z]: [usize; 3]| {
        let points = corners.map(|[i, j, k]| GRID_27[x + i + 3 * (y + j) + 9 * (z + k)]);
        part(HEXAHEDRON, Some(&points))
    };
    corners.map(hexahedron).to_vec()
}

/// The wedges between the triangles of one, four between two.
fn wedges(layers: &[[u8; 6]]) -> Vec<Part> {
    let between = |layers: &[[u8; 6]]| {
        let (low, high) = (layers[0], layers[1]);
        FOURTHS.map(|[a, b, c]| part(WEDGE, Some(&[low[a], low[b], low[c], high[a], high[b], high[c]])))
    };
    layers.windows(2).flat_map(between).collect()
}

/// The parts between the layers of a hexahedron of 24 points: at each upright edge a wedge, and what is left between them.
fn slabs() -> Vec<Part> {
    let between = |layers: &[[u8; 8]]| -> Vec<Part> {
        let points = |of: &[usize]| -> Vec<u8> {
            layers.iter().flat_map(|layer| of.iter().map(move |&i| layer[i])).collect()
        };
        let at_corner = |i: usize| part(WEDGE, Some(&points(&[i, 4 + i, 4 + (i + 3) % 4])));
        (0..4).map(at_corner).chain([part(HEXAHEDRON, Some(&points(&[4, 5, 6, 7])))]).collect()
    };
    LAYERS_24.windows(2).flat_map(between).collect()
}

/// The pyramids of one with points at the middle of everything: from its middle to the quadrilaterals at each corner of each face.
fn pyramids_around() -> Vec<Part> {
    let middle = |a: u8, b: u8| {
        let edge = PYRAMID_EDGES.iter().zip(5..).find(|(edge, _)| **edge == [a, b] || **edge == [b, a]);
        edge.map_or(0, |(_, point)| point)
    };
    let of_face = |(face, center): (&&[u8], u8)| -> Vec<Part> {
        let n = face.len();
        let at_corner = |i: usize| {
            let (last, corner, next) = (face[(i + n - 1) % n], face[i], face[(i + 1) % n]);
            let points = [corner, middle(last, corner), center, middle(corner, next), MIDDLE_OF_19];
            part(PYRAMID, Some(&points))
        };
        (0..n).map(at_corner).collect()
    };
    PYRAMID.iter().zip(MIDDLES_19).flat_map(of_face).collect()
}

impl Recipe {
    /// The faces of a cell with these points as a polyhedron lists them; none if it has parts, or a point twice, or triangles alone.
    pub fn faces(&self, listed: &[i64]) -> Option<Vec<i64>> {
        let [part] = self.parts.as_slice() else { return None };
        let mut sorted = listed.to_vec();
        sorted.sort_unstable();
        if sorted.windows(2).any(|pair| pair[0] == pair[1]) || part.iter().all(|face| face.len() == 3) {
            return None;
        }
        let of_face = |face: &Vec<u8>| -> Vec<i64> {
            let points = face.iter().map(|&p| listed[usize::from(p)]);
            std::iter::once(face.len() as i64).chain(points).collect()
        };
        Some(std::iter::once(part.len() as i64).chain(part.iter().flat_map(of_face)).collect())
    }

    /// The tetrahedra at most that a cell becomes; it depends on the order of its vertices for few types.
    pub fn most_tets(&self) -> usize {
        self.parts.iter().map(most_tets).sum()
    }

    /// Appends the tetrahedra of the cell with these vertices. Where some are the same, as in hexahedra that are used as
    /// wedges, there are fewer.
    pub fn split(&self, vertices: &[u32], tets: &mut Vec<[u32; 4]>) {
        let vertex = |p: u8| vertices[usize::from(p)];
        for part in &self.parts {
            let lowest = part.iter().flatten().map(|&p| vertex(p)).min().unwrap_or(0);
            let opposite = part.iter().filter(|face| face.iter().all(|&p| vertex(p) != lowest));
            for face in opposite {
                let first = (0..face.len()).min_by_key(|&i| vertex(face[i])).unwrap_or(0);
                let corner = |i: usize| vertex(face[(first + i) % face.len()]);
                for i in 1..face.len() - 1 {
                    let [a, b, c] = [corner(0), corner(i), corner(i + 1)];
                    if a != b && b != c && c != a {
                        tets.push([lowest, a, b, c]);
                    }
                }
            }
        }
    }
}

/// The tetrahedra at most that a part becomes: where the lowest vertex is on the fewest triangles.
fn most_tets(part: &Part) -> usize {
    let triangles = |vertex: Option<u8>| -> usize {
        let faces = part.iter().filter(|face| vertex.is_none_or(|v| face.contains(&v)));
        faces.map(|face| face.len() - 2).sum()
    };
    let fewest = part.iter().flatten().map(|&v| triangles(Some(v))).min();
    triangles(None) - fewest.unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetralod::mesh;
    use tetralod::mesh::TetMesh;

    /// Where the points of a cell of each type lie, and its volume.
    fn cell(kind: i64) -> (Vec<[f64; 3]>, f64) {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let triangle = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let layers = |polygon: &[[f64; 2]]| -> Vec<[f64; 3]> {
            [0.0, 1.0].iter().flat_map(|z| polygon.iter().map(move |p| [p[0], p[1], *z])).collect()
        };
        let with_middles = |mut points: Vec<[f64; 3]>, edges: &[[u8; 2]]| {
            for [a, b] in edges {
                points.push(mean(&[points[usize::from(*a)], points[usize::from(*b)]]));
            }
            points
        };
        let tetrahedron = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut pyramid: Vec<[f64; 3]> = layers(&square)[..4].to_vec();
        pyramid.push([0.25, 0.5, 1.0]);
        let round = |n: u32| -> Vec<[f64; 3]> {
            let corner = |i: u32| f64::from(i) / f64::from(n) * std::f64::consts::TAU;
            layers(&(0..n).map(|i| [corner(i).cos(), corner(i).sin()]).collect::<Vec<_>>())
        };
        let area = |n: f64| n / 2.0 * (std::f64::consts::TAU / n).sin();
        match kind {
            10 => (tetrahedron, 1.0 / 6.0),
            11 => ([0, 1, 3, 2, 4, 5, 7, 6].map(|i| layers(&square)[i]).to_vec(), 1.0),
            12 => (layers(&square), 1.0),
            13 => (layers(&triangle), 0.5),
            14 => (pyramid, 1.0 / 3.0),
            15 => (round(5), area(5.0)),
            16 => (round(6), area(6.0)),
            24 => (with_middles(tetrahedron, TETRAHEDRON_EDGES), 1.0 / 6.0),
            25 => (with_middles(layers(&square), HEXAHEDRON_EDGES), 1.0),
            26 => (with_middles(layers(&triangle), WEDGE_EDGES), 0.5),
            27 => (with_middles(pyramid, PYRAMID_EDGES), 1.0 / 3.0),
            29 => {
                let mut points = vec![[0.0; 3]; 27];
                for (i, &p) in GRID_27.iter().enumerate() {
                    points[usize::from(p)] = [i % 3, i / 3 % 3, i / 9].map(|x| x as f64 / 2.0);
                }
                (points, 1.0)
            }
            31 => (with_middles(layers(&triangle), &WEDGE_EDGES[..6]), 0.5),
            33 => {
                let mut points = with_middles(layers(&square), HEXAHEDRON_EDGES);
                points.extend([[0.0, 0.5, 0.5], [1.0, 0.5, 0.5], [0.5, 0.0, 0.5], [0.5, 1.0, 0.5]]);
                (points, 1.0)
            }
            37 => {
                let faces =
                    PYRAMID.iter().map(|face| face.iter().map(|&p| pyramid[usize::from(p)]).collect());
                let mut middles: Vec<[f64; 3]> = faces.map(|face: Vec<[f64; 3]>| mean(&face)).collect();
                middles.push(mean(&pyramid));
                let mut points = with_middles(pyramid, PYRAMID_EDGES);
                points.extend(middles);
                (points, 1.0 / 3.0)
            }
            32 => {
                let mut points = with_middles(layers(&triangle), WEDGE_EDGES);
                points.extend([[12, 13], [13, 14], [14, 12]].map(|[a, b]| mean(&[points[a], points[b]])));
                (points, 0.5)
            }
            PYRAMID_14 => {
                let mut points = with_middles(pyramid, PYRAMID_EDGES);
                points.push([0.5, 0.5, 0.0]);
                (points, 1.0 / 3.0)
            }
            other => panic!("no type {other}"),
        }
    }

    fn mean(points: &[[f64; 3]]) -> [f64; 3] {
        [0, 1, 2].map(|i| points.iter().map(|p| p[i]).sum::<f64>() / points.len() as f64)
    }

    fn volume(points: &[[f64; 3]], tet: [u32; 4]) -> f64 {
        let [a, b, c, d] = tet.map(|v| glam::DVec3::from_array(points[v as usize]));
        (b - a).cross(c - a).dot(d - a) / 6.0
    }

    const KINDS: [i64; 17] = [10, 11, 12, 13, 14, 15, 16, 24, 25, 26, 27, 29, 31, 32, 33, 37, PYRAMID_14];

    /// Every order of few points, and many of others.
    fn orders(n: usize) -> Vec<Vec<u32>> {
        let mut state = 1_u64;
        let mut random = |below: usize| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) as usize % below
        };
        let shuffled = |_| {
            let mut order: Vec<u32> = (0..n as u32).collect();
            (1..n).for_each(|i| order.swap(i, random(i + 1)));
            order
        };
        (0..3000).map(shuffled).collect()
    }

    #[test]
    fn cells_of_every_type_and_order_are_filled() {
        for kind in KINDS {
            let (points, whole) = cell(kind);
            let recipe = recipe(kind).unwrap();
            assert_eq!(recipe.points, points.len(), "{kind}");
            let mut most = 0;
            for order in orders(points.len()) {
                let mut placed = vec![[0.0; 3]; points.len()];
                order.iter().zip(&points).for_each(|(&v, &point)| placed[v as usize] = point);
                let mut tets = Vec::new();
                recipe.split(&order, &mut tets);
                let volumes: Vec<f64> = tets.iter().map(|&tet| volume(&placed, tet)).collect();
                assert!(volumes.iter().all(|v| *v > 1e-3), "{kind} {order:?}: {volumes:?}");
                assert!((volumes.iter().sum::<f64>() - whole).abs() < 1e-12, "{kind} {order:?}");
                let positions = placed;
                let mesh = TetMesh { positions, tets, ..TetMesh::default() };
                assert_eq!(mesh::check(&mesh), Ok(()), "{kind} {order:?}");
                most = most.max(mesh.tets.len());
            }
            assert_eq!(recipe.most_tets(), most, "{kind}");
        }
        let counts = KINDS.map(|kind| recipe(kind).unwrap().most_tets());
        assert_eq!(counts, [1, 6, 6, 3, 2, 9, 12, 8, 22, 15, 13, 48, 12, 24, 36, 32, 16]);
    }

    #[test]
    fn middles_are_in_the_middle_of_their_corners() {
        for kind in KINDS {
            let (points, _) = cell(kind);
            let middles = middles(kind);
            for (point, corners) in &middles {
                let corners: Vec<[f64; 3]> = corners.iter().map(|&p| points[usize::from(p)]).collect();
                let (found, to) = (mean(&corners), points[usize::from(*point)]);
                assert!((0..3).all(|i| (found[i] - to[i]).abs() < 1e-12), "{kind} {point}: {found:?} {to:?}");
            }
            let linear = [10, 11, 12, 13, 14, 15, 16].contains(&kind);
            assert_eq!(middles.is_empty(), linear, "{kind}");
            assert!(linear || usize::from(middles[middles.len() - 1].0) == points.len() - 1, "{kind}");
        }
    }

    /// The triangles of the boundary, each with its vertices in ascending order.
    fn boundary(kind: i64, order: &[u32]) -> Vec<[u32; 3]> {
        let mut tets = Vec::new();
        recipe(kind).unwrap().split(order, &mut tets);
        let mut faces: Vec<[u32; 3]> = Vec::new();
        for tet in tets {
            for skipped in 0..4 {
                let mut face: Vec<u32> = (0..4).filter(|i| *i != skipped).map(|i| tet[i]).collect();
                face.sort_unstable();
                faces.push([face[0], face[1], face[2]]);
            }
        }
        faces.sort_unstable();
        let once = |face: &[u32; 3]| faces.iter().filter(|other| *other == face).count() == 1;
        faces.iter().filter(|face| once(face)).copied().collect()
    }

    #[test]
    fn both_cells_at_a_quadrilateral_cut_it_alike() {
        // A square of the points 0 to 3 (and 4 to 7 in the middle of its edges, 8 in its own) as a face of each type; other
        // points have higher or lower numbers.
        let faces: [(i64, &[usize]); 14] = [
            (12, &[0, 3, 2, 1]),
            (12, &[1, 2, 6, 5]),
            (11, &[0, 2, 3, 1]),
            (13, &[0, 3, 4, 1]),
            (14, &[0, 3, 2, 1]),
            (25, &[0, 3, 2, 1, 11, 10, 9, 8]),
            (26, &[0, 3, 4, 1, 12, 9, 13, 6]),
            (27, &[0, 3, 2, 1, 8, 7, 6, 5]),
            (29, &[0, 3, 2, 1, 11, 10, 9, 8, 24]),
            (32, &[0, 3, 4, 1, 12, 9, 13, 6, 15]),
            (33, &[0, 3, 2, 1, 11, 10, 9, 8]),
            (33, &[0, 4, 5, 1, 16, 12, 17, 8, 22]),
            (37, &[0, 3, 2, 1, 8, 7, 6, 5, 13]),
            (PYRAMID_14, &[0, 3, 2, 1, 8, 7, 6, 5, 13]),
        ];
        for order in orders(9).iter().take(200) {
            let mut seen = [const { None }; 10];
            for (kind, face) in faces {
                for others in [0, 1000] {
                    let points = recipe(kind).unwrap().points;
                    let mut numbers: Vec<u32> = (0..points as u32).map(|p| others + 100 + p).collect();
                    face.iter().zip(order).for_each(|(&p, &number)| numbers[p] = 500 + number);
                    let of_face = |t: &[u32; 3]| t.iter().all(|v| (500..509).contains(v));
                    let triangles: Vec<[u32; 3]> =
                        boundary(kind, &numbers).into_iter().filter(of_face).collect();
                    let known = &mut seen[face.len()];
                    let known = known.get_or_insert_with(|| triangles.clone());
                    assert_eq!(*known, triangles, "{kind} {order:?}");
                    assert_eq!(triangles.len(), [2, 6, 8][if face.len() > 8 { 2 } else { face.len() / 8 }]);
                }
            }
        }
    }

    #[test]
    fn hexahedra_with_points_that_are_the_same_become_what_is_left() {
        // A wedge, a pyramid, a tetrahedron.
        for (vertices, tets) in
            [([0, 1, 2, 2, 4, 5, 6, 6], 3), ([0, 1, 2, 3, 4, 4, 4, 4], 2), ([0, 1, 2, 2, 4, 4, 4, 4], 1)]
        {
            let mut found = Vec::new();
            recipe(12).unwrap().split(&vertices, &mut found);
            assert_eq!(found.len(), tets, "{found:?}");
        }
    }
}
