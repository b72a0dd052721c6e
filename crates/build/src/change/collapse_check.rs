//! Checks of an edge collapse that need no field: topology and orientation.

use crate::change::work_mesh::{StarTet, TetSet, WorkMesh};
use crate::geometry::dihedral::LeastAngle;
use crate::geometry::flat::{Feature, Planes};
use tetralod::geom::orient3d;
use tetralod::mesh::{FACES, NONE};
use tetralod::mt::{MAX_LINK, MAX_STAR};

/// Why an edge cannot be collapsed now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// The edge is not in the mesh any more.
    Gone,
    /// The edge can never be collapsed.
    Never,
    /// The collapse may become possible when the neighbourhood of the edge changes.
    Blocked,
}

/// A collapse that topology and orientation allow. Reused from candidate to candidate.
#[derive(Default)]
pub(crate) struct CheckedCollapse {
    pub a: u32,
    pub b: u32,
    /// Where the edge goes.
    pub position: [i32; 3],
    /// `a − b`.
    pub offset: [i32; 3],
    /// The tetrahedra that stay; `side` 0 were at `a`, 1 at `b`.
    pub stay: Vec<(StarTet, u8)>,
    /// The tetrahedra at both ends, with the corners of `a` and `b`.
    pub fan: Vec<(u32, u8, u8)>,
    /// The vertices around, each once.
    pub link: Vec<u32>,
    pub on_boundary: bool,
    /// What the boundary's features are.
    pub feature: Feature,
    /// How sharp the new cells may be.
    pub angle: Option<LeastAngle>,
    star_a: Vec<StarTet>,
    star_b: Vec<StarTet>,
    edges: Vec<(u32, u32)>,
    seen: TetSet,
}

/// Marks on vertices around an edge.
pub(crate) struct VertexMarks {
    marks: Vec<u32>,
    epoch: u32,
}

const AT_A: u32 = 1;
const AT_B: u32 = 2;
const ON_FAN: u32 = 4;
const BORDER_A: u32 = 8;
const BORDER_B: u32 = 16;
const FAN_END: u32 = 32;
const FLAG_BITS: u32 = 6;

impl VertexMarks {
    pub fn new(vertices: usize) -> Self {
        Self { marks: vec![0; vertices], epoch: 0 }
    }

    pub fn push(&mut self) {
        self.marks.push(0);
    }

    pub fn start(&mut self) {
        self.epoch += 1;
        if self.epoch == 1 << (32 - FLAG_BITS) {
            self.marks.fill(0);
            self.epoch = 1;
        }
    }

    pub fn get(&self, v: u32) -> u32 {
        let mark = self.marks[v as usize];
        if mark >> FLAG_BITS == self.epoch { mark & ((1 << FLAG_BITS) - 1) } else { 0 }
    }

    pub fn add(&mut self, v: u32, flag: u32) -> u32 {
        let old = self.get(v);
        self.marks[v as usize] = self.epoch << FLAG_BITS | old | flag;
        old
    }
}

/// Sides of a collapse have at most [`MAX_STAR`] tetrahedra, and those between them at most [`MAX_LINK`].
const LARGEST_STAR: usize = MAX_STAR + MAX_LINK;

impl CheckedCollapse {
    /// Checks the collapse of edge `ab`.
    pub fn make(
        &mut self,
        mesh: &WorkMesh,
        marks: &mut VertexMarks,
        positions: &[[i32; 3]],
        frozen: &[bool],
        a: u32,
        b: u32,
    ) -> Result<(), Refusal> {
        if !mesh.has(a) || !mesh.has(b) {
            return Err(Refusal::Gone);
        }
        let is_frozen = |v: u32| frozen.get(v as usize).is_some_and(|&f| f);
        if is_frozen(a) || is_frozen(b) {
            return Err(Refusal::Never);
        }
        (self.a, self.b) = (a, b);
        let Self { star_a, star_b, seen, .. } = self;
        if !mesh.star(a, LARGEST_STAR, seen, star_a) || !mesh.star(b, LARGEST_STAR, seen, star_b) {
            return Err(Refusal::Blocked);
        }
        self.part(mesh)?;
        self.mark_links(mesh, marks)?;
        self.check_link_condition(mesh, marks)?;
        self.place(positions);
        self.check_orientation(mesh, positions)?;
        self.check_angles(mesh, positions)?;
        if self.on_boundary { self.check_flat(mesh, positions) } else { Ok(()) }
    }

    /// Where the boundary at an end must stay, the new vertex has to be in its planes: see [`Planes`].
    fn check_flat(&self, mesh: &WorkMesh, positions: &[[i32; 3]]) -> Result<(), Refusal> {
        let at = |v: u32| positions[v as usize];
        let is_end = |v: u32| v == self.a || v == self.b;
        for star in [&self.star_a, &self.star_b] {
            let triangles = star.iter().flat_map(|s| {
                let (corners, around) = (mesh.tets[s.tet as usize], mesh.neighbors[s.tet as usize]);
                let faces = (0..4).filter(move |&k| k != s.corner as usize && around[k] == NONE);
                faces.map(move |k| FACES[k].map(|l| corners[l]))
            });
            let Some(planes) = Planes::of(triangles.clone().map(|t| t.map(at)), self.feature) else {
                continue;
            };
            let mut moved = triangles
                .filter(|t| t.iter().filter(|&&v| is_end(v)).count() == 1)
                .map(|t| t.map(|v| if is_end(v) { self.position } else { at(v) }));
            if !planes.meet_at(self.position) || !moved.all(|t| planes.hold(t)) {
                return Err(Refusal::Blocked);
            }
        }
        Ok(())
    }

    /// Parts the two stars into what stays and the fan between them.
    fn part(&mut self, mesh: &WorkMesh) -> Result<(), Refusal> {
        let Self { a, b, stay, fan, star_a, star_b, .. } = self;
        stay.clear();
        fan.clear();
        for &s in star_a.iter() {
            match mesh.tets[s.tet as usize].iter().position(|v| v == b) {
                Some(at_b) => fan.push((s.tet, s.corner, at_b as u8)),
                None => stay.push((s, 0)),
            }
        }
        stay.extend(star_b.iter().filter(|s| !mesh.tets[s.tet as usize].contains(a)).map(|&s| (s, 1)));
        if fan.is_empty() {
            return Err(Refusal::Gone);
        }
        if stay.len() > MAX_STAR || fan.len() > MAX_LINK {
            return Err(Refusal::Blocked);
        }
        Ok(())
    }

    fn mark_links(&mut self, mesh: &WorkMesh, marks: &mut VertexMarks) -> Result<(), Refusal> {
        marks.start();
        self.link.clear();
        for &(tet, at_a, at_b) in &self.fan {
            let corners = mesh.tets[tet as usize];
            for k in (0..4).filter(|&k| k != at_a as usize && k != at_b as usize) {
                if marks.add(corners[k], ON_FAN | AT_A | AT_B) == 0 {
                    self.link.push(corners[k]);
                }
            }
        }
        for &(StarTet { tet, corner }, side) in &self.stay {
            let corners = mesh.tets[tet as usize];
            for k in (0..4).filter(|&k| k != corner as usize) {
                let old = marks.add(corners[k], [AT_A, AT_B][side as usize]);
                if old == 0 {
                    self.link.push(corners[k]);
                }
            }
        }
        // A vertex next to both ends must belong to a tetrahedron at both: lk(a) ∩ lk(b) = lk(ab), vertices.
        let shared = |v: &u32| {
            let m = marks.get(*v);
            m & AT_A != 0 && m & AT_B != 0 && m & ON_FAN == 0
        };
        if self.link.len() > MAX_LINK || self.link.iter().any(shared) {
            return Err(Refusal::Blocked);
        }
        Ok(())
    }

    /// The link condition for edges and triangles, with the boundary closed by a cone from a vertex ω outside.
    /// (Dey, Edelsbrunner, Guha, Nekhayev: *Topology preserving edge contraction*, 1999.)
    fn check_link_condition(&mut self, mesh: &WorkMesh, marks: &mut VertexMarks) -> Result<(), Refusal> {
        let (border_a, border_b) = (self.has_border(mesh, 0), self.has_border(mesh, 1));
        self.on_boundary = border_a && border_b;
        if border_a != border_b {
            // The midpoint would dent the boundary.
            return Err(Refusal::Never);
        }
        if self.on_boundary {
            self.check_border(mesh, marks)?;
        }
        self.check_link_edges(mesh, marks)
    }

    fn has_border(&self, mesh: &WorkMesh, side: usize) -> bool {
        let star = [&self.star_a, &self.star_b][side];
        star.iter().any(|s| {
            let around = mesh.neighbors[s.tet as usize];
            (0..4).any(|k| k != s.corner as usize && around[k] == NONE)
        })
    }

    fn check_border(&self, mesh: &WorkMesh, marks: &mut VertexMarks) -> Result<(), Refusal> {
        let mut ends = 0;
        for &(tet, at_a, at_b) in &self.fan {
            let (corners, around) = (mesh.tets[tet as usize], mesh.neighbors[tet as usize]);
            if around[at_a as usize] == NONE || around[at_b as usize] == NONE {
                // An ear: a side of the split would have no tetrahedron here.
                return Err(Refusal::Blocked);
            }
            for k in (0..4).filter(|&k| k != at_a as usize && k != at_b as usize) {
                if around[k] == NONE {
                    // The boundary triangle is that of the other link vertex.
                    let other = (0..4).find(|&l| l != k && l != at_a as usize && l != at_b as usize);
                    marks.add(corners[other.unwrap_or(k)], FAN_END);
                    ends += 1;
                }
            }
        }
        if ends != 2 {
            // An edge through the inside between two boundary vertices, or a pinched one.
            return Err(Refusal::Blocked);
        }
        for (star, flag) in [(&self.star_a, BORDER_A), (&self.star_b, BORDER_B)] {
            for s in star.iter() {
                let (corners, around) = (mesh.tets[s.tet as usize], mesh.neighbors[s.tet as usize]);
                for k in (0..4).filter(|&k| k != s.corner as usize && around[k] == NONE) {
                    for l in (0..4).filter(|&l| l != k && l != s.corner as usize) {
                        marks.add(corners[l], flag);
                    }
                }
            }
        }
        // Edges (x, ω): x is next to both ends along the boundary, but a b x is no boundary triangle.
        // Triangles (x, y, ω): x and y can pass that test only as the two ends of the fan. The four boundary triangles
        // then bound a hollow in the shape of a tetrahedron, which the collapse would close.
        let pinches = |v: &u32| {
            let m = marks.get(*v);
            m & BORDER_A != 0 && m & BORDER_B != 0 && m & FAN_END == 0
        };
        if self.link.iter().any(pinches) || self.shares_border_triangle(mesh) {
            return Err(Refusal::Blocked);
        }
        Ok(())
    }

    /// Whether boundary triangles (a, x, y) and (b, x, y) both exist.
    fn shares_border_triangle(&self, mesh: &WorkMesh) -> bool {
        let edges = |side: u8| {
            self.stay.iter().filter(move |(_, s)| *s == side).flat_map(
                move |&(StarTet { tet, corner }, _)| {
                    let (corners, around) = (mesh.tets[tet as usize], mesh.neighbors[tet as usize]);
                    (0..4).filter(move |&k| k != corner as usize && around[k] == NONE).map(move |k| {
                        let mut rest =
                            (0..4).filter(move |&l| l != k && l != corner as usize).map(|l| corners[l]);
                        let (x, y) = (rest.next().unwrap_or(NONE), rest.next().unwrap_or(NONE));
                        (x.min(y), x.max(y))
                    })
                },
            )
        };
        edges(0).any(|e| edges(1).any(|f| e == f))
    }

    /// No edge xy may lie in both links unless (a, b, x, y) is a tetrahedron; that also keeps two tetrahedra
    /// (a, x, y, z) and (b, x, y, z) from falling onto each other.
    fn check_link_edges(&mut self, mesh: &WorkMesh, marks: &VertexMarks) -> Result<(), Refusal> {
        let Self { stay, fan, edges, .. } = self;
        edges.clear();
        for &(tet, at_a, at_b) in fan.iter() {
            let corners = mesh.tets[tet as usize];
            let mut rest = (0..4).filter(|&k| k != at_a as usize && k != at_b as usize).map(|k| corners[k]);
            let (x, y) = (rest.next().unwrap_or(NONE), rest.next().unwrap_or(NONE));
            edges.push((x.min(y), x.max(y)));
        }
        let of_fan = edges.len();
        for &(StarTet { tet, corner }, side) in stay.iter() {
            let corners = mesh.tets[tet as usize];
            for [k, l] in tetralod::mesh::EDGES {
                let (x, y) = (corners[k], corners[l]);
                if k == corner as usize || l == corner as usize {
                    continue;
                }
                if marks.get(x) & marks.get(y) & ON_FAN == 0 {
                    continue;
                }
                let edge = (x.min(y), x.max(y));
                if edges[..of_fan].contains(&edge) {
                    continue;
                }
                if side == 0 {
                    edges.push(edge);
                } else if edges[of_fan..].contains(&edge) {
                    return Err(Refusal::Blocked);
                }
            }
        }
        Ok(())
    }

    fn place(&mut self, positions: &[[i32; 3]]) {
        let (a, b) = (positions[self.a as usize], positions[self.b as usize]);
        self.offset = [0, 1, 2].map(|i| a[i] - b[i]);
        self.position = [0, 1, 2].map(|i| b[i] + (self.offset[i] >> 1));
    }

    fn check_orientation(&self, mesh: &WorkMesh, positions: &[[i32; 3]]) -> Result<(), Refusal> {
        for &(StarTet { tet, corner }, _) in &self.stay {
            let mut corners = mesh.tets[tet as usize].map(|v| positions[v as usize]);
            corners[corner as usize] = self.position;
            let [a, b, c, d] = corners;
            if orient3d(a, b, c, d) <= 0 {
                return Err(Refusal::Blocked);
            }
        }
        Ok(())
    }

    /// Whether the cells are good enough for those that they take the place of.
    fn check_angles(&self, mesh: &WorkMesh, positions: &[[i32; 3]]) -> Result<(), Refusal> {
        let Some(angle) = &self.angle else { return Ok(()) };
        let at = |tet: u32| mesh.tets[tet as usize].map(|v| positions[v as usize]);
        let old = self.stay.iter().map(|(s, _)| s.tet).chain(self.fan.iter().map(|&(tet, ..)| tet)).map(at);
        let new = self.stay.iter().map(|&(StarTet { tet, corner }, _)| {
            let mut corners = at(tet);
            corners[corner as usize] = self.position;
            corners
        });
        if angle.allows(old, new) { Ok(()) } else { Err(Refusal::Blocked) }
    }
}
