//! Filling a hole by the Delaunay criterion, tetrahedron by tetrahedron from its faces.

use crate::change::hole::{Filling, Hole, sorted};
use crate::change::work_mesh::{LARGEST_STAR, StarTet, TetSet, WorkMesh};
use crate::error::points::as_vec;
use crate::geometry::delaunay::shifted;
use glam::DVec3;
use std::sync::Arc;
use tetralod::geom::{in_conflict, orient3d};
use tetralod::mesh::{EDGES, FACES, NONE};

/// The most tetrahedra that fill a hole.
const MAX_FILLING: usize = 128;

/// Fills holes; holds scratch space.
#[derive(Clone)]
pub(crate) struct GiftWrap {
    /// Near each other where the lattice allows it: small numbers make in-sphere tests cheap.
    points: Arc<[[i32; 3]]>,
    /// Faces that still need a tetrahedron on the side to which they are positive.
    open: Vec<OpenFace>,
}

/// A face with its vertices in increasing order, too, and the tetrahedron behind it: [`NONE`] outside of the hole.
#[derive(Clone, Copy)]
struct OpenFace {
    face: [u32; 3],
    key: [u32; 3],
    behind: u32,
}

impl GiftWrap {
    pub fn new(positions: &[[i32; 3]]) -> Self {
        Self { points: shifted(positions).into(), open: Vec::new() }
    }

    /// Fills a hole: false if the Delaunay tetrahedra of its vertices do not fit it, or its boundary is curved.
    pub fn fill(&mut self, hole: &Hole, positions: &[[i32; 3]], filling: &mut Filling) -> bool {
        filling.clear();
        if !hole.is_flat() {
            return false;
        }
        let Self { points, open } = self;
        let at = |v: u32| points[v as usize];
        open.clear();
        let faces = hole.faces.iter();
        open.extend(faces.map(|&(face, _)| OpenFace { face, key: sorted(face), behind: NONE }));
        while let Some(OpenFace { face, behind, .. }) = open.pop() {
            let in_plane = || hole.in_plane(face.map(|v| positions[v as usize]));
            if hole.on_boundary() && behind != NONE && in_plane() {
                filling.border.push((behind, face));
                continue;
            }
            let corners = face.map(at);
            let pencil = Pencil::new(corners);
            let mut apex: Option<(u32, Height)> = None;
            for &v in hole.link.iter().filter(|v| !face.contains(v)) {
                let height = pencil.height(at(v));
                let in_front = height.side.sign().unwrap_or_else(|| {
                    let [x, y, z] = corners;
                    orient3d(x, y, z, at(v)) > 0
                });
                let is_nearer = |(best, lowest): &(u32, Height)| {
                    height.is_below(lowest).unwrap_or_else(|| {
                        let [x, y, z] = corners;
                        in_conflict(x, y, z, at(*best), at(v))
                    })
                };
                if in_front && apex.as_ref().is_none_or(is_nearer) {
                    apex = Some((v, height));
                }
            }
            let Some((apex, _)) = apex else { return false };
            let t = filling.tets.len();
            if t == MAX_FILLING {
                return false;
            }
            let tet = [face[0], face[1], face[2], apex];
            filling.tets.push(tet);
            for face in &FACES[..3] {
                let outward = face.map(|k| tet[k]);
                let key = sorted(outward);
                match open.iter().position(|other| other.key == key) {
                    Some(i) if faces_back(open[i].face, outward) => _ = open.swap_remove(i),
                    Some(_) => return false,
                    None => open.push(OpenFace { face: outward, key, behind: t as u32 }),
                }
            }
        }
        filling.moved = filling.border.len();
        fits(hole, positions, &filling.tets) && fits_border(hole, filling) && lay_border(hole, filling)
    }
}

/// The spheres through the corners of a face, in floating point.
///
/// Seen from corner x, a sphere through the face and v has its centre at a height over the face that grows with
/// `(|n|² |v|² − w · v) / (n · v)`: n is the face's normal, and w the vector in its plane for which this is 0 at the corners.
struct Pencil {
    origin: DVec3,
    normal: DVec3,
    normal_squared: f64,
    w: DVec3,
    /// No smaller than the terms that the normal is the sum of, and those of w.
    normal_terms: f64,
    w_terms: f64,
}

/// A number and how far it may be from the exact one.
#[derive(Clone, Copy)]
struct Near {
    value: f64,
    slack: f64,
}

/// Where a vertex stands among the spheres of a pencil: `over / side`.
#[derive(Clone, Copy)]
struct Height {
    over: Near,
    side: Near,
}

/// Far more than the rounding errors of a few dozen operations, relative to the largest terms.
const ROUNDING: f64 = 1e-13;

impl Pencil {
    fn new(corners: [[i32; 3]; 3]) -> Self {
        let [origin, y, z] = corners.map(as_vec);
        let (y, z) = (y - origin, z - origin);
        let normal = y.cross(z);
        let (yy, zz) = (y.length_squared(), z.length_squared());
        let w = z.cross(normal) * yy + normal.cross(y) * zz;
        let normal_terms = (yy * zz).sqrt();
        let w_terms = normal_terms * (yy * zz.sqrt() + zz * yy.sqrt());
        Self { origin, normal, normal_squared: normal.length_squared(), w, normal_terms, w_terms }
    }

    fn height(&self, v: [i32; 3]) -> Height {
        let v = as_vec(v) - self.origin;
        let squared = v.length_squared();
        let length = squared.sqrt();
        let over = self.normal_squared * squared - self.w.dot(v);
        let over_terms = self.normal_terms * self.normal_terms * squared + self.w_terms * length;
        Height {
            over: Near { value: over, slack: ROUNDING * over_terms },
            side: Near { value: self.normal.dot(v), slack: ROUNDING * self.normal_terms * length },
        }
    }
}

impl Near {
    /// Whether it is positive; none if rounding does not decide it.
    fn sign(self) -> Option<bool> {
        (self.value.abs() > self.slack).then_some(self.value > 0.0)
    }
}

impl Height {
    /// Whether it is below the other, where both are in front of the face; none if rounding does not decide it.
    fn is_below(&self, other: &Self) -> Option<bool> {
        let (a, b) = (self, other);
        let slack = a.over.slack * b.side.value.abs()
            + a.over.value.abs() * b.side.slack
            + b.over.slack * a.side.value.abs()
            + b.over.value.abs() * a.side.slack
            + ROUNDING * (a.over.value * b.side.value).abs()
            + ROUNDING * (b.over.value * a.side.value).abs()
            + a.over.slack * b.side.slack
            + b.over.slack * a.side.slack;
        Near { value: b.over.value * a.side.value - a.over.value * b.side.value, slack }.sign()
    }
}

/// Scratch space of [`is_new`].
#[derive(Default)]
pub(crate) struct Around {
    edges: Vec<Vec<u32>>,
    seen: TetSet,
    star: Vec<StarTet>,
}

/// Whether no tetrahedron outside of the hole has an edge or a triangle that a filling adds. Where the boundary overlaps itself, one
/// may: then the mesh would come to touch itself where it has not. Only vertices for which `may_overlap` holds can belong to it; at
/// others the tetrahedra around fill the space once. None if there was nothing to look for. `degrees` are how many tetrahedra there are
/// around each vertex.
pub(crate) fn is_new(
    (hole, filling): (&Hole, &Filling),
    (mesh, degrees): (&WorkMesh, &[u32]),
    may_overlap: impl Fn(u32) -> bool,
    Around { edges: added, seen, star }: &mut Around,
) -> Option<bool> {
    added.clear();
    for tet in &filling.tets {
        let is_old = |[x, y]: [u32; 2]| match [x, y].map(|v| hole.place(v)) {
            [Some(x), Some(y)] => hole.has_edge(x, y),
            _ => true,
        };
        let corners = |places: &[usize]| places.iter().map(|&k| tet[k]).collect::<Vec<u32>>();
        let edges = EDGES.iter().filter(|edge| !is_old(edge.map(|k| tet[k]))).map(|edge| corners(edge));
        // A triangle with a new edge is new if that is.
        let of_old = |[x, y, z]: [u32; 3]| [[x, y], [y, z], [z, x]].into_iter().all(is_old);
        let in_hole = |face: [u32; 3]| hole.faces_with(face.iter()) != 0;
        let faces = FACES.iter().filter(|face| {
            let face = face.map(|k| tet[k]);
            of_old(face) && !in_hole(face)
        });
        added.extend(edges.chain(faces.map(|face| corners(face))));
    }
    added.retain(|vertices| vertices.iter().all(|&v| may_overlap(v)));
    added.iter_mut().for_each(|vertices| vertices.sort_unstable());
    added.sort_unstable();
    added.dedup();
    let mut is_nowhere = |vertices: &Vec<u32>| {
        let mut whole =
            |&&v: &&u32| mesh.star(v, LARGEST_STAR, seen, star) && star.len() == degrees[v as usize] as usize;
        // Where it touches itself already, not all tetrahedra around a vertex are found by going through faces.
        vertices.iter().find(&mut whole).is_some()
            && star.iter().all(|s| vertices.iter().any(|v| !mesh.tets[s.tet as usize].contains(v)))
    };
    (!added.is_empty()).then(|| added.iter().all(&mut is_nowhere))
}

/// Whether two orders of a triangle's corners are those seen from its two sides.
fn faces_back([x, y, z]: [u32; 3], other: [u32; 3]) -> bool {
    [[x, z, y], [z, y, x], [y, x, z]].contains(&other)
}

/// Whether the tetrahedra are as large as the hole.
fn fits(hole: &Hole, positions: &[[i32; 3]], tets: &[[u32; 4]]) -> bool {
    let six = |tet: [u32; 4]| {
        let [a, b, c, d] = tet.map(|v| positions[v as usize]);
        orient3d(a, b, c, d)
    };
    let whole: i128 = hole.faces.iter().map(|&([x, y, z], _)| six([x, y, z, hole.a])).sum();
    whole == tets.iter().copied().map(six).sum()
}

/// Whether the triangles that take the place of those at the removed vertex have the same rim. Where the boundary turns
/// inwards, its planes continue inside the hole, where triangles in them are not boundary.
fn fits_border(hole: &Hole, filling: &Filling) -> bool {
    let faces = || filling.border[..filling.moved].iter().map(|(_, face)| *face);
    let mut keys: Vec<[u32; 3]> = faces().map(sorted).collect();
    keys.sort_unstable();
    if keys.windows(2).any(|pair| pair[0] == pair[1]) {
        return false;
    }
    let mut edges: Vec<[u32; 2]> = faces().flat_map(|[x, y, z]| [[x, y], [y, z], [z, x]]).collect();
    edges.sort_unstable();
    if edges.windows(2).any(|pair| pair[0] == pair[1]) {
        return false;
    }
    let mut rim: Vec<[u32; 2]> =
        edges.iter().copied().filter(|&[x, y]| edges.binary_search(&[y, x]).is_err()).collect();
    rim.sort_unstable();
    let mut wanted = hole.border.clone();
    wanted.sort_unstable();
    rim == wanted
}

/// The triangles of the filling that were on the boundary before.
fn lay_border(hole: &Hole, filling: &mut Filling) -> bool {
    for &([x, y, z], _) in hole.faces.iter().filter(|(_, outer)| *outer == NONE) {
        let owner = filling.tets.iter().position(|tet| [x, y, z].iter().all(|v| tet.contains(v)));
        let Some(cell) = owner else { return false };
        filling.border.push((cell as u32, [x, z, y]));
    }
    true
}
