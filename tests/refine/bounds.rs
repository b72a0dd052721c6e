//! Promise: boundaries are as near to each other as is stated, by plain search, and no nearer than a fraction of it.

use crate::at_vertices::refined;
use crate::support::conformance::{EDGE, HALF_EDGE, PAGED};
use crate::support::meshes::{bent, sheet};
use glam::DVec3;
use std::collections::BTreeMap;
use tetralod::geom::nearest_on_triangle;
use tetralod::mt::MultiTessellation;

/// The triangles that one tetrahedron alone has.
fn boundary(positions: &[DVec3], tets: &[[u32; 4]]) -> Vec<[DVec3; 3]> {
    let mut faces: BTreeMap<[u32; 3], u32> = BTreeMap::new();
    for &[a, b, c, d] in tets {
        for mut face in [[a, b, c], [a, b, d], [a, c, d], [b, c, d]] {
            face.sort_unstable();
            *faces.entry(face).or_default() += 1;
        }
    }
    let alone = faces.into_iter().filter(|(_, tets)| *tets == 1);
    alone.map(|(face, _)| face.map(|v| positions[v as usize])).collect()
}

/// Vertices of triangles, and middles of them and of their edges.
fn places(triangles: &[[DVec3; 3]]) -> impl Iterator<Item = DVec3> {
    triangles
        .iter()
        .flat_map(|&[a, b, c]| [a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0])
}

fn distance(p: DVec3, triangles: &[[DVec3; 3]]) -> f64 {
    triangles
        .iter()
        .map(|&t| p.distance_squared(nearest_on_triangle(p, t)))
        .fold(f64::INFINITY, f64::min)
        .sqrt()
}

#[test]
fn the_bound_of_the_boundary_holds_and_is_needed() {
    for (mesh, what) in [(sheet(0.3), "sheet"), (bent(9), "bent")] {
        let input: Vec<DVec3> = mesh.positions.iter().map(|&p| p.into()).collect();
        let reference = boundary(&input, &mesh.tets);
        for (kind, how) in [("edge", EDGE), ("vertex", HALF_EDGE), ("half-edge", PAGED)] {
            let mt = how.build(&mesh, None);
            let info = mt.info();
            let mut largest: f64 = 0.0;
            for error in [0.1, 0.03, 0.01] {
                let (front, bound) = refined(&mt, error);
                let found = front.mesh();
                let positions: Vec<DVec3> =
                    found.positions().iter().map(|&q| info.lattice.point(q).into()).collect();
                let own = boundary(&positions, found.tets());
                let bound = info.boundary_bound(bound);
                let away = places(&own).map(|p| distance(p, &reference)).fold(0.0, f64::max);
                assert!(away <= bound, "{what}, {kind}, {error}: {away} of {bound}");
                let missed = input.iter().copied().filter(|p| distance(*p, &reference) < 1e-9);
                let missed = missed.map(|p| distance(p, &own)).fold(0.0, f64::max);
                assert!(missed <= bound, "{what}, {kind}, {error}: of the input {missed} of {bound}");
                largest = largest.max(away.max(missed) / bound);
            }
            assert!(largest > 0.55, "{what}, {kind}: {largest}");
        }
    }
}
