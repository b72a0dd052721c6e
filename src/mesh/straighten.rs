//! Points in the middle of edges, faces and cells of the second order, and where they go when such a cell folds as straight tetrahedra.
//!
//! A cell can be curved so much that straight tetrahedra between its points fold, though the curved cell does not: in a thin wall, a chord of the
//! outer side passes under the middle of the inner one. All middles of such a cell are then put where they are in a straight cell, the same for
//! every cell that has them, so that neighbours still meet. A neighbour that folds because of it follows.

use std::cmp::Ordering;
use std::collections::{HashMap, VecDeque};

use glam::DVec3;

use crate::geom::bits_of;
use crate::mesh::check::{scale_of, side_of};
use crate::mesh::{InputCell, Middles, TetMesh};
use crate::threads;

/// Puts middles of cells that fold onto straight edges and faces, and notes how many, and how far they moved.
///
/// Values stay: in the middle of a straight edge, too, a point has the same parameters.
#[doc(hidden)]
pub fn straighten(mesh: &mut TetMesh) {
    let middles = std::mem::take(&mut mesh.input.middles);
    if middles.is_empty() || mesh.tets.is_empty() {
        return;
    }
    let scale = scale_of(&mesh.positions);
    let cells = cells_of(mesh);
    let at = |point: u32| mesh.positions[point as usize];
    let folded = threads::map(cells.len(), SHARE, |mut range| {
        range.find(|&cell| faults(mesh, cells[cell], scale, &at) > 0)
    });
    let Some(first) = folded.into_iter().flatten().next() else { return };
    let Moved { cells, points, largest } = Straightening::new(mesh, &middles, cells, scale).run(first);
    if let Some((distance, cell)) = largest {
        let (cells, fold) =
            if cells == 1 { ("1 cell".into(), "folds") } else { (format!("{cells} cells"), "fold") };
        let (points, were) =
            if points == 1 { ("1 point".into(), "was") } else { (format!("{points} points"), "were") };
        mesh.input.say(format!(
            "{cells} of the second order {fold} as straight tetrahedra: {points} in the middle of edges and faces {were} moved onto \
             straight ones, by at most {:?} (cell {cell})",
            rounded_up(distance)
        ));
    }
}

/// Cells that are looked at together.
const SHARE: usize = 1 << 11;

/// The tetrahedra of each cell: first and end.
type Tets = (u32, u32);

fn cells_of(mesh: &TetMesh) -> Vec<Tets> {
    let tets = 0..mesh.tets.len() as u32;
    let mut cells: Vec<Tets> = Vec::new();
    let mut last = None;
    for tet in tets {
        match cells.last_mut() {
            Some((_, end)) if last == Some(mesh.input.cells.number(tet)) => *end = tet + 1,
            _ => cells.push((tet, tet + 1)),
        }
        last = Some(mesh.input.cells.number(tet));
    }
    cells
}

/// How many tetrahedra of a cell are not on the side of most of them, or flat, with its points where `at` says.
fn faults(mesh: &TetMesh, (first, end): Tets, scale: f64, at: &impl Fn(u32) -> [f64; 3]) -> usize {
    let mut counts = [0; 3];
    for tet in &mesh.tets[first as usize..end as usize] {
        counts[(side_of(tet.map(at), scale) + 1) as usize] += 1;
    }
    counts[1] + counts[0].min(counts[2])
}

/// Whether no two points of a cell lie the other way round than in a straight one, as they do in cells whose points are listed in another
/// order than that of the format: these have no place to move to.
fn is_in_order(
    mesh: &TetMesh,
    (first, end): Tets,
    now: &impl Fn(u32) -> [f64; 3],
    then: &impl Fn(u32) -> [f64; 3],
) -> bool {
    let mut points = mesh.tets[first as usize..end as usize].as_flattened().to_vec();
    points.sort_unstable();
    points.dedup();
    let places: Vec<[DVec3; 2]> =
        points.iter().map(|&point| [now(point), then(point)].map(DVec3::from_array)).collect();
    let agree = |[a, b]: &[DVec3; 2], [c, d]: &[DVec3; 2]| (a - c).dot(b - d) >= 0.0;
    places.iter().enumerate().all(|(i, a)| places[i + 1..].iter().all(|b| agree(a, b)))
}

/// A length with three digits, at most a hundredth longer.
fn rounded_up(length: f64) -> f64 {
    format!("{:.2e}", length * 1.005).parse().unwrap_or(length)
}

/// What was moved.
#[derive(Default)]
struct Moved {
    cells: usize,
    points: usize,
    /// The longest way of a point, and the cell.
    largest: Option<(f64, InputCell)>,
}

struct Straightening<'a> {
    mesh: &'a mut TetMesh,
    cells: Vec<Tets>,
    scale: f64,
    /// Where each middle is in a straight cell.
    straight: HashMap<u32, [f64; 3]>,
    /// Each middle with the cells that have it, sorted.
    users: Vec<(u32, u32)>,
    /// Middles by their place, and place in a straight cell: pieces may have points of their own where they meet.
    twins: HashMap<[u64; 6], Vec<u32>>,
    moved: Moved,
}

impl<'a> Straightening<'a> {
    fn new(mesh: &'a mut TetMesh, middles: &Middles, cells: Vec<Tets>, scale: f64) -> Self {
        let mut straight = HashMap::new();
        for (point, corners) in middles.iter() {
            let to = mean(&mesh.positions, corners);
            let [to_corner, to_middle] =
                [corners[0], point].map(|other| distance(mesh.positions[other as usize], to));
            // What is off by rounding stays.
            if to_middle > 1e-9 * to_corner {
                straight.entry(point).or_insert(to);
            }
        }
        let mut users = Vec::new();
        for (cell, &(first, end)) in (0..).zip(&cells) {
            let points = mesh.tets[first as usize..end as usize].as_flattened();
            users.extend(
                points.iter().filter(|point| straight.contains_key(point)).map(|&point| (point, cell)),
            );
        }
        users.sort_unstable();
        users.dedup();
        let mut twins: HashMap<[u64; 6], Vec<u32>> = HashMap::new();
        for (&point, &to) in &straight {
            twins.entry(key(mesh.positions[point as usize], to)).or_default().push(point);
        }
        Self { mesh, cells, scale, straight, users, twins, moved: Moved::default() }
    }

    /// Looks at all cells from this one on, and again at those of which a point moved.
    fn run(mut self, first: usize) -> Moved {
        let mut waiting: VecDeque<u32> = (first as u32..self.cells.len() as u32).collect();
        while let Some(cell) = waiting.pop_front() {
            if self.is_better_straight(cell) {
                self.flatten(cell, &mut waiting);
            }
        }
        self.moved
    }

    fn is_better_straight(&self, cell: u32) -> bool {
        let (mesh, tets) = (&*self.mesh, self.cells[cell as usize]);
        let now = |point: u32| mesh.positions[point as usize];
        let then = |point: u32| self.straight.get(&point).copied().unwrap_or_else(|| now(point));
        let faults_now = faults(mesh, tets, self.scale, &now);
        faults_now > 0
            && faults(mesh, tets, self.scale, &then) < faults_now
            && is_in_order(mesh, tets, &now, &then)
    }

    fn flatten(&mut self, cell: u32, waiting: &mut VecDeque<u32>) {
        self.moved.cells += 1;
        let (first, end) = self.cells[cell as usize];
        for tet in first..end {
            for point in self.mesh.tets[tet as usize] {
                let Some(&to) = self.straight.get(&point) else { continue };
                let from = self.mesh.positions[point as usize];
                if from == to {
                    continue;
                }
                let distance = distance(from, to);
                if self.moved.largest.as_ref().is_none_or(|(largest, _)| *largest < distance) {
                    self.moved.largest = Some((distance, self.mesh.input.cells.cell_of(first)));
                }
                for twin in self.twins.remove(&key(from, to)).unwrap_or_default() {
                    self.mesh.positions[twin as usize] = to;
                    self.moved.points += 1;
                    let at = self.users.partition_point(|(user, _)| *user < twin);
                    let users = self.users[at..].iter().take_while(|(user, _)| *user == twin);
                    waiting.extend(users.map(|(_, cell)| *cell).filter(|other| *other != cell));
                }
            }
        }
    }
}

/// The mean of some points, the same whatever their order.
fn mean(positions: &[[f64; 3]], corners: &[u32]) -> [f64; 3] {
    let mut places: Vec<[f64; 3]> = corners.iter().map(|&corner| positions[corner as usize]).collect();
    places.sort_by(|a, b| {
        a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne()).unwrap_or(Ordering::Equal)
    });
    let share = 1.0 / places.len() as f64;
    [0, 1, 2].map(|axis| places.iter().map(|place| place[axis] * share).sum())
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    DVec3::from_array(a).distance(DVec3::from_array(b))
}

fn key([a, b, c]: [f64; 3], [d, e, f]: [f64; 3]) -> [u64; 6] {
    [a, b, c, d, e, f].map(bits_of)
}
