//! Distances to triangles.

use glam::DVec3;

/// The point of triangle `abc` nearest to `p`. Degenerate triangles are treated as the segments they are.
///
/// By the regions of the triangle's plane in which the projection of `p` can fall; see Ericson, *Real-Time Collision
/// Detection* (2005), section 5.1.5.
pub fn nearest_on_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    // Inside, the projection is the nearest point.
    if let Some([v, w]) = weights_of_projection(p, [a, b, c])
        && v >= 0.0
        && w >= 0.0
        && v + w <= 1.0
    {
        return a + (b - a) * v + (c - a) * w;
    }
    let sides = [[a, b], [b, c], [c, a]].map(|side| nearest_on_segment(p, side));
    let mut nearest = sides[0];
    for q in &sides[1..] {
        if p.distance_squared(*q) < p.distance_squared(nearest) {
            nearest = *q;
        }
    }
    nearest
}

/// The barycentric coordinates of a point on a triangle; those of the first corner if the triangle has no area.
#[doc(hidden)]
pub fn weights_on_triangle(q: DVec3, corners: [DVec3; 3]) -> [f64; 3] {
    weights_of_projection(q, corners).map_or([1.0, 0.0, 0.0], |[v, w]| [1.0 - v - w, v, w])
}

/// The weights of `b` and `c` at the projection of `p` into the plane of a triangle; none if that has no area.
fn weights_of_projection(p: DVec3, [a, b, c]: [DVec3; 3]) -> Option<[f64; 2]> {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let normal = ab.cross(ac);
    let area = normal.length_squared();
    (area > 0.0).then(|| [ap.cross(ac).dot(normal) / area, ab.cross(ap).dot(normal) / area])
}

fn nearest_on_segment(p: DVec3, [a, b]: [DVec3; 2]) -> DVec3 {
    let ab = b - a;
    let length = ab.length_squared();
    if length == 0.0 {
        return a;
    }
    a + ab * ((p - a).dot(ab) / length).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_point_of_a_fine_raster_is_nearer() {
        let triangles = [
            [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y],
            [DVec3::ZERO, DVec3::X, DVec3::X * 3.0],
            [DVec3::new(0.0, 1.0, 2.0), DVec3::new(1.0, -1.0, 0.5), DVec3::new(-2.0, 0.0, 0.0)],
        ];
        for triangle in triangles {
            let [a, b, c] = triangle;
            for i in 0..343 {
                let p = DVec3::new((i % 7) as f64 - 3.0, (i / 7 % 7) as f64 - 3.0, (i / 49) as f64 - 3.0);
                let nearest = p.distance(nearest_on_triangle(p, triangle));
                let raster =
                    (0..=100).flat_map(|v| (0..=100 - v).map(move |w| (v as f64 / 100.0, w as f64 / 100.0)));
                let best =
                    raster.map(|(v, w)| p.distance(a + (b - a) * v + (c - a) * w)).fold(f64::MAX, f64::min);
                assert!(nearest <= best + 1e-12 && nearest > best - 0.05, "{triangle:?} {p}");
            }
        }
    }
}
