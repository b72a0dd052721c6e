//! The mesh that writer and reader of insertions follow, and what is around the next vertex in it.

use crate::geom::{NARROW_BITS, orient3d, views_of_origin};
use crate::mesh::{FACES, NONE};
use crate::mt::{
    ApplyUpdates, BaseMeshError, CurrentMesh, ErrorCode, MtInfo, MultiTessellation, UpdateId, VertexMt,
    corner_of,
};

/// Most tetrahedra around a near vertex.
const MOST_AROUND: usize = 4096;

/// What writer and reader know when they come to an update: kept from block to block.
#[derive(Debug)]
pub struct State {
    pub(super) mesh: CurrentMesh,
    /// All coordinates are multiples of these.
    pub(super) grain: [i32; 3],
    /// Errors of the update before.
    pub(super) errors: Vec<ErrorCode>,
    /// Whether orientations fit 64 bits.
    pub(super) narrow: bool,
    /// The tetrahedra around the near vertex.
    pub(super) star: Vec<u32>,
    /// The other vertices of each, by index into the link, in the order of the face that they make, outward.
    pub(super) corners: Vec<[u32; 3]>,
    /// These vertices as seen from the near one.
    pub(super) link: Vec<[i64; 3]>,
    /// Their cross products with the new vertex, seen from there as well.
    pub(super) turned: Vec<[i64; 3]>,
    /// What is removed.
    pub(super) removed: Vec<u32>,
    pub(super) views: Vec<View>,
    /// Whether some of it is on the boundary.
    pub(super) on_boundary: bool,
    pub(super) given_up: Vec<[u32; 2]>,
    /// Tetrahedra of the star, in the direction of the new vertex.
    pub(super) cone: Vec<u32>,
    /// Of what is removed, where the file contains them.
    pub(super) quarterings: Vec<u8>,
    /// By tetrahedron: `epoch` if it is in the star, one more if it is removed, two more if it is
    /// not, three more if it cannot be.
    pub(super) tet_marks: Vec<u32>,
    /// By vertex: `epoch << 32 | index` if it is in the link.
    pub(super) vertex_marks: Vec<u64>,
    pub(super) epoch: u32,
}

/// How a point and a tetrahedron lie to each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// Bit `k` is set if the point is on the inner side of face `k`.
    pub(super) seen: u8,
    /// Where the point is with respect to the sphere: 1 inside, -1 outside, 0 on it.
    pub(super) sphere: i32,
}

/// The tetrahedron whose levels the new vertex is compared with.
pub(super) struct Home {
    pub(super) tet: [u32; 4],
    /// What each corner counts.
    pub(super) weights: [f64; 4],
    /// Whether the vertex lies outside.
    pub(super) outside: bool,
}

/// The largest numbers that all coordinates are multiples of.
pub(super) fn grain(mt: &VertexMt) -> [i32; 3] {
    let mut grain = [0_u32; 3];
    let inserted = (0..mt.updates()).map(|u| mt.position(UpdateId(u)));
    for position in mt.base().positions.iter().copied().chain(inserted) {
        for (grain, x) in grain.iter_mut().zip(position) {
            let mut rest = x.unsigned_abs();
            while rest > 0 {
                (*grain, rest) = (rest, *grain % rest);
            }
        }
    }
    grain.map(|x| i32::try_from(x).unwrap_or(1).max(1))
}

impl State {
    /// At the start of an MT, to put all of its updates.
    ///
    /// # Errors
    /// If the base mesh is not usable.
    pub fn of(mt: &VertexMt) -> Result<Self, BaseMeshError> {
        Self::new(mt, grain(mt))
    }

    pub(super) fn new(mt: &VertexMt, grain: [i32; 3]) -> Result<Self, BaseMeshError> {
        Ok(Self {
            mesh: mt.start()?,
            grain,
            errors: vec![ErrorCode::MAX; mt.info().fields.len()],
            narrow: mt.info().lattice.bits <= NARROW_BITS,
            star: Vec::new(),
            corners: Vec::new(),
            link: Vec::new(),
            turned: Vec::new(),
            removed: Vec::new(),
            views: Vec::new(),
            on_boundary: false,
            cone: Vec::new(),
            given_up: Vec::new(),
            quarterings: Vec::new(),
            tet_marks: Vec::new(),
            vertex_marks: Vec::new(),
            epoch: 0,
        })
    }

    pub(super) fn next_epoch(&mut self) {
        if self.epoch > u32::MAX - 8 {
            self.tet_marks.fill(0);
            self.vertex_marks.fill(0);
            self.epoch = 0;
        }
        // Four marks are in use.
        self.epoch += 4;
        self.tet_marks.resize(self.mesh.tet_slots(), 0);
        self.vertex_marks.resize(self.mesh.positions().len(), 0);
    }

    /// Finds the tetrahedra around a vertex, as far as they hang together through faces, and their other vertices. False if
    /// there are too many.
    pub(super) fn gather(&mut self, near: u32) -> bool {
        self.next_epoch();
        self.star.clear();
        self.corners.clear();
        self.link.clear();
        let Some(&first) = self.mesh.incident.get(near as usize).filter(|&&t| t != NONE) else {
            return false;
        };
        let [x, y, z] = self.mesh.positions()[near as usize];
        let mark = u64::from(self.epoch) << 32;
        self.tet_marks[first as usize] = self.epoch;
        self.star.push(first);
        let mut next = 0;
        while let Some(&t) = self.star.get(next) {
            next += 1;
            let (tet, around) = (self.mesh.tets()[t as usize], self.mesh.neighbors()[t as usize]);
            let face = FACES[corner_of(&tet, near)];
            self.corners.push(face.map(|k| {
                let own = &mut self.vertex_marks[tet[k] as usize];
                if *own < mark {
                    *own = mark | self.link.len() as u64;
                    let position = self.mesh.positions()[tet[k] as usize];
                    self.link.push([position[0] - x, position[1] - y, position[2] - z].map(i64::from));
                }
                *own as u32
            }));
            for n in face.map(|k| around[k]) {
                if n != NONE && std::mem::replace(&mut self.tet_marks[n as usize], self.epoch) != self.epoch {
                    self.star.push(n);
                }
            }
            if self.star.len() > MOST_AROUND {
                return false;
            }
        }
        true
    }

    /// Chooses the near vertex of an insertion, and gathers what is around it; also returns whether all that is removed has
    /// it.
    pub(super) fn near(&mut self, removed: &[u32], position: [i32; 3]) -> Option<(u32, bool)> {
        let tets: Vec<[u32; 4]> = removed.iter().map(|&t| self.mesh.tets()[t as usize]).collect();
        let mut vertices = tets.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let distance = |v: u32| {
            let other = self.mesh.positions()[v as usize];
            (0..3).map(|k| (i64::from(other[k]) - i64::from(position[k])).pow(2)).sum::<i64>()
        };
        // Those that all have come first.
        let rank = |v: u32| (!tets.iter().all(|tet| tet.contains(&v)), distance(v), v);
        let mut ranked: Vec<(bool, i64, u32)> = vertices.into_iter().map(rank).collect();
        ranked.sort_unstable();
        ranked.into_iter().find_map(|(apart, _, v)| {
            let fits = self.gather(v) && self.star.iter().any(|t| removed.contains(t));
            fits.then_some((v, !apart))
        })
    }

    /// Six times the volume between a point and each face of a tetrahedron, rounded; the signs, positive on the inner sides, are
    /// exact.
    pub(super) fn inward(&self, tet: [u32; 4], position: [i32; 3]) -> [f64; 4] {
        if self.narrow {
            return views_of_origin(self.seen_from(tet, position)).0.map(|volume| volume as f64);
        }
        FACES.map(|face| {
            let [a, b, c] = face.map(|i| self.mesh.positions()[tet[i] as usize]);
            -orient3d(a, b, c, position) as f64
        })
    }

    /// The corners of a tetrahedron as seen from a point.
    #[inline]
    pub(super) fn seen_from(&self, tet: [u32; 4], position: [i32; 3]) -> [[i64; 3]; 4] {
        tet.map(|v| {
            let [x, y, z] = self.mesh.positions()[v as usize];
            [x - position[0], y - position[1], z - position[2]].map(i64::from)
        })
    }

    /// Whether the point lies in a tetrahedron, its boundary included.
    pub(super) fn holds(&self, t: u32, position: [i32; 3]) -> bool {
        self.inward(self.mesh.tets()[t as usize], position).iter().all(|&volume| volume >= 0.0)
    }

    pub(super) fn sorted(&self, t: u32) -> [u32; 4] {
        let mut tet = self.mesh.tets()[t as usize];
        tet.sort_unstable();
        tet
    }

    /// Finds the tetrahedra around the near vertex that `position` is in the direction of, by their sorted vertices.
    pub(super) fn find_cone(&mut self, near: u32, position: [i32; 3]) {
        let mut cone = std::mem::take(&mut self.cone);
        cone.clear();
        if self.narrow {
            self.turn_link(near, position);
            // Which are is a coin toss for the processor: all are written, and counted if they are.
            cone.resize(self.star.len(), NONE);
            let mut len = 0;
            for (&t, &corners) in self.star.iter().zip(&self.corners) {
                cone[len] = t;
                len += usize::from(self.is_ahead(corners));
            }
            cone.truncate(len);
        } else {
            cone.extend(self.star.iter().copied().filter(|&t| {
                let tet = self.mesh.tets()[t as usize];
                let inward = self.inward(tet, position);
                (0..4).all(|k| inward[k] >= 0.0 || tet[k] == near)
            }));
        }
        self.sort(&mut cone);
        self.cone = cone;
    }

    /// Finds the cross product of each vertex of the link with the new one.
    pub(super) fn turn_link(&mut self, near: u32, position: [i32; 3]) {
        let origin = self.mesh.positions()[near as usize];
        let v = [0, 1, 2].map(|k| i64::from(position[k] - origin[k]));
        self.turned.clear();
        self.turned.extend(
            self.link
                .iter()
                .map(|u| [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]),
        );
    }

    /// Whether the new vertex is in the direction of a tetrahedron of the star.
    #[inline]
    pub(super) fn is_ahead(&self, [a, b, c]: [u32; 3]) -> bool {
        // Components up to 2^20 make cross products up to 2^41, and a sum of three products up to 3 · 2^61 < 2^63.
        let is_inside = |i: u32, j: u32| {
            let (u, v) = (self.link[i as usize], self.turned[j as usize]);
            u[0] * v[0] + u[1] * v[1] + u[2] * v[2] >= 0
        };
        is_inside(a, b) & is_inside(b, c) & is_inside(c, a)
    }

    pub(super) fn sort_star(&mut self) {
        let mut star = std::mem::take(&mut self.star);
        self.sort(&mut star);
        self.star = star;
    }

    /// Sorts tetrahedra by their sorted vertices.
    fn sort(&self, tets: &mut [u32]) {
        if tets.len() < 2 {
            return;
        }
        let mut sorted: Vec<([u32; 4], u32)> = tets.iter().map(|&t| (self.sorted(t), t)).collect();
        sorted.sort_unstable();
        tets.iter_mut().zip(sorted).for_each(|(t, (_, sorted))| *t = sorted);
    }

    /// The removed tetrahedron that the new vertex lies in; or is least far out of, for its size.
    pub(super) fn home(&self, position: [i32; 3]) -> Home {
        let mut best = Home { tet: [0; 4], weights: [0.0; 4], outside: true };
        let mut most = f64::NEG_INFINITY;
        for &t in &self.removed {
            let tet = self.mesh.tets()[t as usize];
            let weights = self.inward(tet, position);
            let whole: f64 = weights.iter().sum();
            let weights = weights.map(|weight| weight / whole);
            let least = weights.iter().fold(f64::INFINITY, |least, &weight| least.min(weight));
            if least > most {
                most = least;
                best = Home { tet, weights, outside: least < 0.0 };
                if !best.outside {
                    break;
                }
            }
        }
        best
    }

    /// The level that is expected of the new vertex.
    pub(super) fn expected(&self, info: &MtInfo, home: &Home, field: usize) -> i32 {
        let mut level = 0.5;
        for (v, weight) in home.tet.into_iter().zip(home.weights) {
            level += weight * f64::from(self.mesh.levels(v)[field]);
        }
        (level.floor() as i32).clamp(0, (1 << info.fields[field].bits) - 1)
    }

    /// After update `u` has been applied.
    pub(super) fn settle(&mut self, u: u32) {
        self.mesh.clear_touched();
        if u.is_multiple_of(4096) {
            self.mesh.take_changes();
        }
    }
}
