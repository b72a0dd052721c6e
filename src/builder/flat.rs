//! Where the boundary is flat, or flat parts meet at a sharp crease or corner: there it stays, whatever error is allowed.

use crate::geom::orient3d;

/// The most planes that meet at a corner.
const MOST_PLANES: usize = 3;

/// The planes of the boundary triangles around a vertex, each by three points, if the vertex must stay in all of them: there is one,
/// or two or three meet at angles that no curved boundary has. Triangles are ordered as seen from outside.
pub(super) fn planes(triangles: impl Iterator<Item = [[i32; 3]; 3]>) -> Option<Vec<[[i32; 3]; 3]>> {
    let mut planes: Vec<[[i32; 3]; 3]> = Vec::new();
    for triangle in triangles {
        if planes.iter().any(|plane| triangle.iter().all(|&p| is_in(plane, p))) {
            continue;
        }
        if planes.len() == MOST_PLANES {
            return None;
        }
        planes.push(triangle);
    }
    let normals: Vec<[f64; 3]> = planes.iter().map(normal).collect();
    let pairs = (0..normals.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let is_sharp = |(i, j): (usize, usize)| {
        let [across, a, b] =
            [(i, j), (i, i), (j, j)].map(|(i, j)| (0..3).map(|k| normals[i][k] * normals[j][k]).sum::<f64>());
        // 60 degrees or more.
        across <= 0.0 || 4.0 * across * across <= a * b
    };
    (!planes.is_empty() && pairs.into_iter().all(is_sharp)).then_some(planes)
}

/// Whether a point is in the plane of three others.
pub(super) fn is_in(&[a, b, c]: &[[i32; 3]; 3], p: [i32; 3]) -> bool {
    orient3d(a, b, c, p) == 0
}

fn normal([a, b, c]: &[[i32; 3]; 3]) -> [f64; 3] {
    let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| f64::from(p[k]) - f64::from(a[k])));
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}
