//! Regions of a mesh, which stay what they are, and points that stay where they are.
//!
//! The cells of a mesh have labels; where cells of different labels meet is an interface, and where they end is the boundary. A vertex on
//! an interface is moved to a neighbour only if that leaves all interfaces, and the boundary there, the same sets of points:
//!
//! - where there is nothing but one flat interface around it, to any neighbour on that;
//! - where it is in the middle of a straight line, along which flat interfaces or parts of the boundary meet, to one of the two
//!   neighbours on that line.
//!
//! The link of the vertex in a flat part, a polygon, is then filled from the neighbour. The triangles of this filling are turned as those
//! before, since the tetrahedra on them are positive, and so they fill the same polygon. What is on one side stays there: each new
//! tetrahedron has a face of an old one, and its label. Any other vertex of an interface stays, unless a tolerance lets curved
//! interfaces move: see [`crate::restrict::interface`].

use crate::change::hole::Hole;
use crate::change::work_mesh::{WorkMesh, keep};
use crate::lattice::quantize::Quantized;
use crate::restrict::interface::Interface;
use crate::restrict::region_labels::{has_table, numbers, table};
use crate::{BuildConfig, BuildError};
use tetralod::geom::orient3d;
use tetralod::mesh::{NONE, TetMesh};
use tetralod::mt;

/// The regions of the cells.
pub(crate) struct Regions {
    /// The region of each tetrahedron of the mesh.
    of: Vec<u32>,
    /// What is known of them; nothing where that is kept elsewhere.
    table: mt::Regions,
    /// What lets curved interfaces move, if they may.
    interface: Option<Interface>,
}

/// The other side of a triangle of the boundary.
const OUTSIDE: u32 = u32::MAX;

/// The triangle of a vertex and two others, between two regions.
struct Triangle {
    edge: [u32; 2],
    regions: [u32; 2],
}

impl Regions {
    /// Of tetrahedra whose regions are known, with interfaces that stay; none if no regions are kept apart.
    pub fn known(of: Vec<u32>) -> Option<Self> {
        (!of.is_empty()).then_some(Self { of, table: mt::Regions::default(), interface: None })
    }

    /// What is known of the regions, with that of each tetrahedron that is left, in their order.
    pub fn finish(self, tets: &[[u32; 4]]) -> mt::Regions {
        let left = self.of.iter().zip(tets).filter(|(_, tet)| tet[0] != NONE);
        let (of_base, deviation) = (left.map(|(&region, _)| region as u16).collect(), self.deviation());
        mt::Regions { of_base, deviation, ..self.table }
    }

    /// What is known of them.
    pub fn table(&self) -> &mt::Regions {
        &self.table
    }

    /// Tetrahedra have new numbers: their places in this list of the old ones, which ascend.
    pub fn renumber(&mut self, live: &[u32]) {
        keep(&mut self.of, live);
    }

    /// The region of each tetrahedron.
    pub fn all(&self) -> &[u32] {
        &self.of
    }

    /// The regions by the labels of a configuration; none if it has none.
    pub fn of(
        config: &BuildConfig,
        mesh: &TetMesh,
        quantized: &Quantized,
    ) -> Result<Option<Self>, BuildError> {
        let tolerance = tolerance(config)?;
        let (of, all) = numbers(config, mesh)?;
        let has_table = has_table(config);
        let interface = tolerance.map(|tolerance| Interface::new(tolerance, &mesh.tets, &of, quantized));
        let table =
            if has_table { table(&config.preserve, all, &of, &mesh.input) } else { mt::Regions::default() };
        Ok((!config.preserve.is_empty()).then_some(Self { of, table, interface }))
    }

    /// Whether all interfaces stay the same sets of points when the vertex of a hole is moved to `b`, or within the tolerance.
    pub fn stay(&self, hole: &Hole, b: u32, mesh: &WorkMesh, positions: &[[i32; 3]]) -> bool {
        let of = |i: usize| self.of[hole.star[i].tet as usize];
        if (1..hole.star.len()).all(|i| of(i) == of(0)) {
            return true;
        }
        let triangles = triangles(hole, of);
        stay_exactly(&triangles, hole, b, positions) || self.may_move((hole, b), &triangles, mesh, positions)
    }

    /// Whether a curved interface may move.
    fn may_move(
        &self,
        (hole, b): (&Hole, u32),
        triangles: &[Triangle],
        mesh: &WorkMesh,
        positions: &[[i32; 3]],
    ) -> bool {
        let Some(interface) = &self.interface else { return false };
        let is_sheet = triangles.iter().all(|triangle| triangle.regions == triangles[0].regions);
        let edges: Vec<[u32; 2]> = triangles.iter().map(|triangle| triangle.edge).collect();
        !hole.on_boundary()
            && is_sheet
            && edges.iter().any(|edge| edge.contains(&b))
            && self.keeps_gaps(hole, b)
            && interface.may_move((hole, b), &edges, (mesh, &self.of), positions)
    }

    /// Whether each tetrahedron with the edge to `b` is of the same region as the one across its face that lasts, beside which the inverse
    /// of the move will put it: see [`mt::Regions`].
    fn keeps_gaps(&self, hole: &Hole, b: u32) -> bool {
        let all =
            || hole.faces.iter().zip(&hole.star).map(|((face, _), star)| (face, self.of[star.tet as usize]));
        let lasts = |face: &[u32; 3], region: u32| {
            let shares = |other: &[u32; 3]| face.iter().all(|v| *v == b || other.contains(v));
            all().any(|(other, of)| !other.contains(&b) && shares(other) && of == region)
        };
        all().all(|(face, region)| !face.contains(&b) || lasts(face, region))
    }

    /// Whether interfaces may move.
    pub fn may_change(&self) -> bool {
        self.interface.is_some()
    }

    /// How far interfaces have moved, in model units.
    pub fn deviation(&self) -> f64 {
        self.interface.as_ref().map_or(0.0, |interface| interface.deviation)
    }

    /// The vertex of a hole has been moved to `end`: see [`crate::change::half_edge::contract`] for the order of the new tetrahedra.
    pub fn contracted(&mut self, hole: &Hole, end: u32, slots: &[u32], positions: &[[i32; 3]]) {
        if let Some(interface) = &mut self.interface {
            let triangles = triangles(hole, |i| self.of[hole.star[i].tet as usize]);
            let between = triangles.iter().filter(|triangle| !triangle.regions.contains(&OUTSIDE));
            let edges: Vec<[u32; 2]> = between.map(|triangle| triangle.edge).collect();
            if !edges.is_empty() {
                interface.moved(hole.a, end, &edges, positions);
            }
        }
        let left = hole.faces.iter().zip(&hole.star).filter(|((face, _), _)| !face.contains(&end));
        // The slots are those of the star.
        let regions: Vec<u32> = left.map(|(_, star)| self.of[star.tet as usize]).collect();
        slots.iter().zip(regions).for_each(|(&slot, region)| self.of[slot as usize] = region);
    }
}

/// Whether all interfaces stay the same sets of points.
fn stay_exactly(triangles: &[Triangle], hole: &Hole, b: u32, positions: &[[i32; 3]]) -> bool {
    let is_flat = |[u, v]: [u32; 2]| {
        let of_v: Vec<&Triangle> = triangles.iter().filter(|triangle| triangle.edge.contains(&v)).collect();
        let [s, t] = of_v[..] else { return false };
        let [p, q] = [s, t].map(|triangle| positions[other(triangle.edge, v) as usize]);
        let [a, v] = [u, v].map(|v| positions[v as usize]);
        s.regions == t.regions && orient3d(a, v, p, q) == 0
    };
    let mut around: Vec<u32> = triangles.iter().flat_map(|triangle| triangle.edge).collect();
    around.sort_unstable();
    around.dedup();
    let creases: Vec<u32> = around.iter().copied().filter(|&v| !is_flat([hole.a, v])).collect();
    let at = |v: u32| positions[v as usize];
    match creases[..] {
        [] => {
            let [x, y] = triangles[0].edge.map(at);
            around.contains(&b) && around.iter().all(|&v| orient3d(at(hole.a), x, y, at(v)) == 0)
        }
        [p, q] => {
            (b == p || b == q) && is_between(at(hole.a), at(p), at(q)) && all_lead_across(triangles, [p, q])
        }
        _ => false,
    }
}

/// The triangles at the vertex of a hole between different regions, or at the boundary; `of` is the region of a tetrahedron of the star.
fn triangles(hole: &Hole, of: impl Fn(usize) -> u32) -> Vec<Triangle> {
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * hole.faces.len());
    for (i, &([x, y, z], _)) in hole.faces.iter().enumerate() {
        sides.extend([[x, y], [y, z], [z, x]].map(|[u, v]| ([u.min(v), u.max(v)], of(i))));
    }
    sides.sort_unstable();
    let mut triangles = Vec::new();
    let mut i = 0;
    while i < sides.len() {
        let (edge, region) = sides[i];
        let second = sides.get(i + 1).filter(|(other, _)| *other == edge).map(|(_, region)| *region);
        i += 1 + usize::from(second.is_some());
        if second != Some(region) {
            triangles.push(Triangle { edge, regions: [region, second.unwrap_or(OUTSIDE)] });
        }
    }
    triangles
}

/// Whether `a` is on the line between two others, exactly.
fn is_between(a: [i32; 3], p: [i32; 3], q: [i32; 3]) -> bool {
    let [u, v] = [p, q].map(|p| [0, 1, 2].map(|k| i64::from(p[k]) - i64::from(a[k])));
    let minor =
        |i: usize, j: usize| i128::from(u[i]) * i128::from(v[j]) - i128::from(u[j]) * i128::from(v[i]);
    let across: i128 = (0..3).map(|k| i128::from(u[k]) * i128::from(v[k])).sum();
    minor(0, 1) == 0 && minor(1, 2) == 0 && minor(2, 0) == 0 && across < 0
}

/// Whether each part of the surfaces around the vertex reaches from the one crease to the other.
fn all_lead_across(triangles: &[Triangle], [p, q]: [u32; 2]) -> bool {
    let mut walked = 0;
    for first in (0..triangles.len()).filter(|&i| triangles[i].edge.contains(&p)) {
        let (mut i, mut v) = (first, other(triangles[first].edge, p));
        walked += 1;
        while v != p && v != q {
            let next = (0..triangles.len()).find(|&j| j != i && triangles[j].edge.contains(&v));
            let Some(next) = next else { return false };
            (i, v) = (next, other(triangles[next].edge, v));
            walked += 1;
        }
        if v == p {
            return false;
        }
    }
    walked == triangles.len()
}

fn other([x, y]: [u32; 2], v: u32) -> u32 {
    if x == v { y } else { x }
}

/// How far curved interfaces may move, in model units; none if they may not.
fn tolerance(config: &BuildConfig) -> Result<Option<f64>, BuildError> {
    match config.preserve_within {
        within if !(0.0..f64::INFINITY).contains(&within) => {
            Err(BuildError::Option { name: "preserve-within", expected: "a length that is not negative" })
        }
        within => Ok(Some(within).filter(|within| *within > 0.0 && !config.preserve.is_empty())),
    }
}

/// A point is meant by a place that is nearer to it than this part of the diagonal of the model.
pub(crate) const NEAR: f64 = 1e-6;

/// Which points stay; empty if all may go.
pub(crate) fn kept_points(config: &BuildConfig, mesh: &TetMesh) -> Result<Vec<bool>, BuildError> {
    if config.keep_points.is_empty() {
        return Ok(Vec::new());
    }
    let mut kept = vec![false; mesh.positions.len()];
    let near = NEAR * tetralod::geom::Bounds::of(&mesh.positions).diagonal();
    // Sorted along an axis: few have to be compared.
    let mut order: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let x = |i: u32| mesh.positions[i as usize][0];
    order.sort_unstable_by(|&i, &j| x(i).total_cmp(&x(j)).then(i.cmp(&j)));
    for &place in &config.keep_points {
        let square = |i: u32| {
            let d = [0, 1, 2].map(|k| mesh.positions[i as usize][k] - place[k]);
            d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
        };
        let first = order.partition_point(|&i| x(i) < place[0] - near);
        let close = order[first..].iter().copied().take_while(|&i| x(i) <= place[0] + near);
        let nearest = close.min_by(|&i, &j| square(i).total_cmp(&square(j)).then(i.cmp(&j)));
        match nearest.filter(|&i| square(i) <= near * near) {
            Some(i) => kept[i as usize] = true,
            None => return Err(BuildError::NoPoint { place }),
        }
    }
    Ok(kept)
}
