//! Convex regions as functions: how far a tetrahedron is outside, or how deep inside.

use super::tet_minimax::{Rows, smallest};
use super::{MAX_PLANES, Region};
use crate::geom::nearest_on_triangle;
use crate::mesh::FACES;
use glam::DVec3;

/// A region as the set where a convex function is at most zero; the function changes no faster than the place.
/// In model units, from the middle of the domain.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    /// The greatest of some distances from planes.
    Planes(Vec<Plane>),
    /// The distance from a ball.
    Ball { centre: DVec3, radius: f64 },
}

/// The distance from a plane, positive on the side that its unit normal points to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    pub normal: DVec3,
    pub offset: f64,
}

impl Plane {
    /// `normal · p <= offset` in model units, seen from `origin`; a normal of no length makes the plane that all lies
    /// behind or nothing does.
    pub fn new(normal: DVec3, offset: f64, origin: DVec3) -> Self {
        let length = normal.length();
        let from_origin = offset - normal.dot(origin);
        if length > 0.0 && length.is_finite() {
            Self { normal: normal / length, offset: from_origin / length }
        } else {
            Self { normal: DVec3::ZERO, offset: from_origin }
        }
    }

    #[inline]
    pub fn distances(&self, corners: &[DVec3; 4]) -> [f64; 4] {
        corners.map(|p| self.normal.dot(p) - self.offset)
    }

    /// How much the distance of a point in the box from `-reach` to `reach` can differ from that of `other`.
    pub fn difference(&self, other: &Self, reach: DVec3) -> f64 {
        (self.normal - other.normal).abs().dot(reach) + (self.offset - other.offset).abs()
    }

    /// By what part of its distance from the origin, or of `least` if it is nearer, the distance of a point can differ from that
    /// of `other`.
    pub fn turn(&self, other: &Self, least: f64) -> f64 {
        (self.normal - other.normal).length() + (self.offset - other.offset).abs() / least
    }

    /// By how much the distance of such a point can have become less than it was from `before`.
    pub fn approach(&self, before: &Self, reach: DVec3) -> f64 {
        (self.normal - before.normal).abs().dot(reach) + (self.offset - before.offset).max(0.0)
    }
}

impl Shape {
    /// `region` seen from `origin`.
    pub fn new(region: &Region, origin: DVec3) -> Self {
        let plane = |normal: [f64; 3], offset: f64| Plane::new(normal.into(), offset, origin);
        match region {
            Region::Box(bounds) => {
                let sides = DVec3::AXES.into_iter().enumerate().flat_map(|(i, axis)| {
                    [plane((-axis).into(), -bounds.min[i]), plane(axis.into(), bounds.max[i])]
                });
                Self::Planes(sides.collect())
            }
            Region::OrientedBox { centre, halves } => {
                let centre = DVec3::from(*centre);
                let sides = halves.iter().map(|&half| DVec3::from(half)).flat_map(|half| {
                    let to_face = half.length_squared();
                    [half, -half].map(|n| plane(n.into(), n.dot(centre) + to_face))
                });
                Self::Planes(sides.collect())
            }
            Region::Sphere { centre, radius } => {
                Self::Ball { centre: DVec3::from(*centre) - origin, radius: *radius }
            }
            Region::HalfSpace { normal, offset } => Self::Planes(vec![plane(*normal, *offset)]),
            Region::Slab { normal, offset, thickness } => {
                let half = 0.5 * thickness * DVec3::from(*normal).length();
                let other = normal.map(|x| -x);
                Self::Planes(vec![plane(*normal, offset + half), plane(other, half - offset)])
            }
            Region::Convex(planes) => Self::Planes(
                planes.iter().take(MAX_PLANES).map(|&[x, y, z, d]| plane([x, y, z], d)).collect(),
            ),
        }
    }

    /// The least value of the function over a tetrahedron, so far as that decides whether it exceeds `threshold`: a value on
    /// the same side and no further from it. If one plane alone decides that it does, which.
    #[inline]
    pub fn least(&self, corners: &[DVec3; 4], threshold: f64) -> (f64, Option<usize>) {
        match self {
            Self::Planes(planes) => {
                let mut furthest = (f64::NEG_INFINITY, 0);
                for (k, plane) in planes.iter().enumerate() {
                    // One plane with all corners beyond it is enough; the one that is furthest lasts longest.
                    let nearest = smallest(&plane.distances(corners));
                    if nearest > furthest.0 {
                        furthest = (nearest, k);
                    }
                }
                if furthest.0 > threshold {
                    return (furthest.0, Some(furthest.1));
                }
                let mut rows = Rows::new();
                // A side at infinity bounds nothing.
                let bounding = planes.iter().map(|plane| plane.distances(corners));
                bounding
                    .filter(|values| smallest(values) > f64::NEG_INFINITY)
                    .for_each(|values| rows.push(values));
                (rows.least(threshold), None)
            }
            Self::Ball { centre, radius } => {
                let nearest = corners.iter().fold(f64::INFINITY, |m, p| m.min(p.distance(*centre)));
                let outside =
                    if nearest - radius <= threshold { nearest } else { distance(corners, *centre) };
                (outside - radius, None)
            }
        }
    }

    /// By how much planes whose number leaves the remainder `k` by `n` can have come nearer than they were in `before`.
    pub fn approach(&self, before: &Self, reach: DVec3, k: usize, n: usize) -> f64 {
        match (self, before) {
            (Self::Planes(a), Self::Planes(b)) if a.len() == b.len() => {
                // Each plane counts to one remainder alone: the others pass over it, and their own calls see it.
                let pairs = a.iter().zip(b).skip(k).step_by(n);
                pairs.fold(0.0, |m, (a, b)| m.max(a.approach(b, reach)))
            }
            _ => self.difference(before, reach),
        }
    }

    /// How much the function can differ from that of `other` at points in the box from `-reach` to `reach`.
    pub fn difference(&self, other: &Self, reach: DVec3) -> f64 {
        match (self, other) {
            (Self::Planes(a), Self::Planes(b)) if a.len() == b.len() => {
                a.iter().zip(b).fold(0.0, |m, (a, b)| m.max(a.difference(b, reach)))
            }
            (Self::Ball { centre: a, radius: r }, Self::Ball { centre: b, radius: s }) => {
                a.distance(*b) + (r - s).abs()
            }
            _ => f64::INFINITY,
        }
    }
}

/// The distance of a point from a tetrahedron; 0 inside.
fn distance(corners: &[DVec3; 4], p: DVec3) -> f64 {
    let mut outside = false;
    let mut nearest = f64::INFINITY;
    for face in FACES {
        let [a, b, c] = face.map(|i| corners[i]);
        // The normal points outwards.
        if (b - a).cross(c - a).dot(p - a) > 0.0 {
            outside = true;
            nearest = nearest.min(nearest_on_triangle(p, [a, b, c]).distance(p));
        }
    }
    if outside { nearest } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::tet_minimax::tests::next;
    use super::*;
    use crate::geom::Bounds;

    /// How far a point is outside of a region, by its definition.
    fn outside(region: &Region, p: DVec3) -> f64 {
        match region {
            Region::Sphere { centre, radius } => p.distance((*centre).into()) - radius,
            Region::Box(bounds) => {
                (0..3).map(|i| (bounds.min[i] - p[i]).max(p[i] - bounds.max[i])).fold(f64::MIN, f64::max)
            }
            Region::HalfSpace { normal, offset } => {
                (DVec3::from(*normal).dot(p) - offset) / DVec3::from(*normal).length()
            }
            Region::Slab { normal, offset, thickness } => {
                let normal = DVec3::from(*normal);
                (normal.dot(p) - offset).abs() / normal.length() - 0.5 * thickness
            }
            _ => unreachable!("not among those that are tried"),
        }
    }

    /// The least of the function over a fine grid of points of a tetrahedron is that of [`Shape::least`], but for a cell of the grid.
    #[test]
    fn the_least_distance_from_a_region_is_that_of_its_nearest_point() {
        let origin = DVec3::new(0.3, -0.2, 0.1);
        let regions = [
            Region::Sphere { centre: [0.1, 0.2, -0.1], radius: 0.4 },
            Region::Box(Bounds { min: [-0.3, -0.1, 0.0], max: [0.2, 0.3, 0.4] }),
            Region::HalfSpace { normal: [1.0, 2.0, -0.5], offset: -0.7 },
            Region::Slab { normal: [0.0, 2.0, 1.0], offset: 0.3, thickness: 0.1 },
        ];
        const STEPS: u32 = 16;
        let mut state = 7;
        for round in 0..400 {
            let corners = [0; 4].map(|_| DVec3::from([0; 3].map(|_| next(&mut state))));
            let [a, b, c, d] = corners;
            // As in meshes: positive.
            let corners = if (b - a).cross(c - a).dot(d - a) > 0.0 { corners } else { [a, c, b, d] };
            let longest = corners.iter().flat_map(|p| corners.map(|q| p.distance(q))).fold(0.0, f64::max);
            let mut points = Vec::new();
            for i in 0..=STEPS {
                for j in 0..=STEPS - i {
                    for k in 0..=STEPS - i - j {
                        let weights =
                            [i, j, k, STEPS - i - j - k].map(|part| f64::from(part) / f64::from(STEPS));
                        points.push((0..4).map(|n| weights[n] * corners[n]).sum::<DVec3>());
                    }
                }
            }
            let region = &regions[round % regions.len()];
            let twin = points.iter().map(|&p| outside(region, p)).fold(f64::INFINITY, f64::min);
            let seen = corners.map(|p| p - origin);
            for threshold in [-0.3, -0.05, 0.0, 0.05, 0.3] {
                let (least, _) = Shape::new(region, origin).least(&seen, threshold);
                // A grid sees a little more than the least.
                let cell = longest / f64::from(STEPS);
                assert!(least <= threshold || twin > threshold - 1e-12, "{region:?}: {least}, {twin}");
                assert!(least > threshold || twin - cell <= threshold, "{region:?}: {least}, {twin}");
            }
        }
    }
}
