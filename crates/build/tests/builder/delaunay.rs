//! Promise: the triangulation of any points is exact, fills their hull, and is the same in whatever order they come.

use crate::support::random::Random;
use std::collections::BTreeSet;
use tetralod::geom::{WIDE_BITS, in_conflict, orient3d};
use tetralod::mesh::{FACES, NONE, kuhn_tets, neighbors};
use tetralod_build::{BuildError, delaunay};

type Point = [i32; 3];

fn scattered(count: usize, size: u32, seed: u64) -> Vec<Point> {
    let mut random = Random::new(seed);
    let mut points = BTreeSet::new();
    while points.len() < count {
        points.insert([(); 3].map(|()| random.below(size as usize) as i32));
    }
    let mut points: Vec<Point> = points.into_iter().collect();
    random.shuffle(&mut points);
    points
}

fn grid([nx, ny, nz]: [i32; 3], step: i32) -> Vec<Point> {
    let rows = (0..nz).flat_map(|z| (0..ny).map(move |y| (y, z)));
    rows.flat_map(|(y, z)| (0..nx).map(move |x| [x * step, y * step, z * step])).collect()
}

/// All lattice points of a sphere.
fn sphere(radius: i32) -> Vec<Point> {
    let side = 2 * radius + 1;
    let squares = |p: &Point| p.map(|x| (x - radius) * (x - radius)).iter().sum::<i32>();
    grid([side; 3], 1).into_iter().filter(|p| squares(p) == radius * radius).collect()
}

/// Two sheets of points, a line through them, and a few points around.
fn sheets() -> Vec<Point> {
    let mut points: BTreeSet<Point> = grid([7, 7, 2], 5).into_iter().collect();
    points.extend((0..20).map(|i| [i, i, i]));
    points.extend((0..30).map(|i| [0, 0, i]));
    points.extend(scattered(40, 40, 9));
    points.into_iter().collect()
}

fn as_set(points: &[Point], tets: &[[u32; 4]]) -> BTreeSet<[Point; 4]> {
    let set = tets.iter().map(|tet| {
        let mut corners = tet.map(|v| points[v as usize]);
        corners.sort_unstable();
        corners
    });
    set.collect()
}

/// Every tetrahedron is positive and empty (so no two overlap), they meet face to face and use every point, and their
/// boundary lies in planes that have all points on one side: so they fill the hull.
fn check(points: &[Point]) {
    let tets = delaunay(points).unwrap();
    for tet in &tets {
        let [a, b, c, d] = tet.map(|v| points[v as usize]);
        assert!(orient3d(a, b, c, d) > 0);
        for (v, &p) in (0..).zip(points) {
            assert!(tet.contains(&v) || !in_conflict(a, b, c, d, p), "{p:?} is in conflict with {tet:?}");
        }
    }
    let used: BTreeSet<u32> = tets.iter().flatten().copied().collect();
    assert_eq!(used.len(), points.len());
    for (tet, around) in tets.iter().zip(neighbors(&tets).unwrap()) {
        for face in (0..4).filter(|&i| around[i] == NONE).map(|i| FACES[i]) {
            let [a, b, c] = face.map(|k| points[tet[k] as usize]);
            assert!(points.iter().all(|&p| orient3d(a, b, c, p) <= 0), "{a:?} {b:?} {c:?} is inside");
        }
    }
}

#[test]
fn scattered_points_are_triangulated() {
    for (size, seed) in [(4, 1), (6, 2), (30, 3), (1 << 12, 4), (1 << 20, 5)] {
        check(&scattered(60, size, seed));
    }
    for seed in 10..60 {
        check(&scattered(5 + seed as usize % 9, 3, seed));
    }
}

#[test]
fn points_all_over_the_finest_lattice_are_triangulated() {
    let points = scattered(100, (1 << WIDE_BITS) + 1, 6);
    let tets = delaunay(&points).unwrap();
    for tet in &tets {
        let [a, b, c, d] = tet.map(|v| points[v as usize]);
        let empty = (0..).zip(&points).all(|(v, &p)| tet.contains(&v) || !in_conflict(a, b, c, d, p));
        assert!(orient3d(a, b, c, d) > 0 && empty);
    }
}

#[test]
fn cospherical_points_sheets_and_lines_are_triangulated() {
    check(&sphere(9));
    check(&sphere(5));
    check(&grid([3, 4, 5], 7));
    check(&sheets());
}

#[test]
fn every_cell_of_a_grid_gets_kuhns_six_tetrahedra() {
    for dims in [[2, 2, 2], [3, 4, 5], [9, 9, 9], [17, 2, 6]] {
        let points = grid(dims, 64);
        let wanted = kuhn_tets(dims.map(|n| n as u32));
        assert_eq!(as_set(&points, &delaunay(&points).unwrap()), as_set(&points, &wanted));
    }
}

#[test]
fn the_order_of_the_points_does_not_matter() {
    for mut points in [grid([5, 6, 4], 1), sphere(9), sheets(), scattered(300, 9, 3), scattered(300, 1000, 4)]
    {
        let wanted = as_set(&points, &delaunay(&points).unwrap());
        let mut random = Random::new(points.len() as u64);
        for _ in 0..10 {
            random.shuffle(&mut points);
            assert_eq!(as_set(&points, &delaunay(&points).unwrap()), wanted);
        }
    }
}

#[test]
fn a_star_of_very_many_tetrahedra_is_filled() {
    // Every point of the ring is next to every point of the axis.
    let ring = |i: i32| {
        let angle = std::f64::consts::TAU * f64::from(i) / 3000.0;
        [(5e8 + 4e8 * angle.cos()) as i32, (5e8 + 4e8 * angle.sin()) as i32, 500_000_000]
    };
    let mut points: Vec<Point> = (0..3000).map(ring).collect();
    points.extend([[500_000_000, 500_000_000, 1], [500_000_000, 500_000_000, 999_999_999]]);
    let tets = delaunay(&points).unwrap();
    neighbors(&tets).unwrap();
    assert!(tets.len() >= 3000);
}

#[test]
fn what_spans_no_volume_is_refused() {
    assert_eq!(delaunay(&[]), Err(BuildError::Flat));
    assert_eq!(delaunay(&grid([1, 1, 3], 1)), Err(BuildError::Flat));
    assert_eq!(delaunay(&grid([1, 1, 9], 1)), Err(BuildError::Flat));
    assert_eq!(delaunay(&grid([5, 1, 9], 1)), Err(BuildError::Flat));
    assert_eq!(delaunay(&[[3, 3, 3]; 10]), Err(BuildError::Flat));
    let mut points = grid([3, 3, 3], 1);
    points.push([1, 2, 1]);
    assert_eq!(delaunay(&points), Err(BuildError::SamePlace { points: [16, 27] }));
}
