//! Where the boundary is flat, or flat parts meet at a sharp crease or corner: there it stays, whatever error is allowed.

use crate::error::points::as_vec;
use crate::geometry::dihedral::sharpness_of;
use crate::{BuildConfig, BuildError};
use glam::DVec3;
use tetralod::geom::orient3d;

/// The most planes that meet at a corner.
const MOST_PLANES: usize = 3;

/// From which angle on two planes of the boundary meet at a feature: a crease or corner that stays.
#[derive(Clone, Copy)]
pub(crate) struct Feature {
    /// The square of the angle's cosine.
    square: f64,
}

impl Default for Feature {
    /// 60 degrees.
    fn default() -> Self {
        Self { square: 0.25 }
    }
}

impl Feature {
    /// Of the angle of a configuration.
    pub fn of(config: &BuildConfig) -> Result<Self, BuildError> {
        match config.feature_angle {
            None => Ok(Self::default()),
            Some(degrees) if (1.0..=90.0).contains(&degrees) => Ok(Self { square: sharpness_of(degrees) }),
            Some(_) => Err(BuildError::Option { name: "feature-angle", expected: "1 to 90 degrees" }),
        }
    }
}

/// The planes that the boundary at a vertex must stay in: one, or two or three that meet at angles that no curved boundary has, at
/// features. Each is given by three points.
pub(crate) struct Planes {
    planes: Vec<[[i32; 3]; 3]>,
    /// What features are, if rounding to the lattice has moved points out of the planes.
    rounded: Option<Feature>,
}

impl Planes {
    /// The planes of the boundary triangles around a vertex, if it must stay. Triangles are ordered as seen from outside.
    pub fn of(triangles: impl Iterator<Item = [[i32; 3]; 3]> + Clone, feature: Feature) -> Option<Self> {
        let exact = Self::exact(triangles.clone(), feature).map(|planes| Self { planes, rounded: None });
        exact.or_else(|| {
            let planes = Self::rounded(triangles.collect(), feature)?;
            Some(Self { planes, rounded: Some(feature) })
        })
    }

    /// Whether a point is in all of them.
    pub fn meet_at(&self, p: [i32; 3]) -> bool {
        self.planes
            .iter()
            .all(|plane| if self.rounded.is_some() { is_near(plane, p) } else { is_in(plane, p) })
    }

    /// Whether a triangle is in one of them.
    pub fn hold(&self, triangle: [[i32; 3]; 3]) -> bool {
        self.planes.iter().any(|plane| match self.rounded {
            Some(feature) => feature.goes_on(plane, &triangle),
            None => triangle.iter().all(|&p| is_in(plane, p)),
        })
    }

    fn exact(triangles: impl Iterator<Item = [[i32; 3]; 3]>, feature: Feature) -> Option<Vec<[[i32; 3]; 3]>> {
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
        feature.divides(&planes).then_some(planes)
    }

    /// Large triangles come first: their planes are known best.
    fn rounded(mut left: Vec<[[i32; 3]; 3]>, feature: Feature) -> Option<Vec<[[i32; 3]; 3]>> {
        let area = |triangle: &[[i32; 3]; 3]| normal(triangle).length_squared();
        let mut planes: Vec<[[i32; 3]; 3]> = Vec::new();
        // There are few, and most are in the first plane: looking for the largest is shorter than a sort, in code, too.
        while let Some(plane) = left.iter().copied().reduce(|a, b| if area(&b) > area(&a) { b } else { a }) {
            if planes.len() == MOST_PLANES {
                return None;
            }
            planes.push(plane);
            left.retain(|triangle| !feature.goes_on(&plane, triangle));
        }
        feature.divides(&planes).then_some(planes)
    }
}

impl Feature {
    /// Whether planes with these normals meet at a feature.
    fn is_between(self, a: DVec3, b: DVec3) -> bool {
        let across = a.dot(b);
        across <= 0.0 || across * across <= self.square * (a.length_squared() * b.length_squared())
    }

    /// Whether a triangle may have been in a plane before points were rounded, and is not folded over there.
    fn goes_on(self, plane: &[[i32; 3]; 3], triangle: &[[i32; 3]; 3]) -> bool {
        triangle.iter().all(|&p| is_near(plane, p))
            && (is_narrow(triangle) || !self.is_between(normal(plane), normal(triangle)))
    }

    /// Whether there are planes, and all meet at features.
    fn divides(self, planes: &[[[i32; 3]; 3]]) -> bool {
        let normals: Vec<DVec3> = planes.iter().map(normal).collect();
        let mut pairs = (0..normals.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        !planes.is_empty() && pairs.all(|(i, j)| self.is_between(normals[i], normals[j]))
    }
}

/// Whether a point is in the plane of three others.
fn is_in(&[a, b, c]: &[[i32; 3]; 3], p: [i32; 3]) -> bool {
    orient3d(a, b, c, p) == 0
}

/// How far rounding has moved points along each axis, in steps of the lattice: half a step where the input's are placed, and as much again
/// where new ones are, between them.
const ROUNDED: f64 = 1.0;

/// Whether a point and three others may have been in one plane before they were rounded.
///
/// The point is a combination of the three with weights whose sum is 1, and a multiple of the normal. If all four were in a plane before, that
/// multiple is due to rounding: no more than the tolerance times 1 and the sizes of the weights.
fn is_near(plane: &[[i32; 3]; 3], p: [i32; 3]) -> bool {
    let [a, b, c] = plane.map(as_vec);
    let (n, d) = (normal(plane), as_vec(p) - a);
    let square = n.length_squared();
    // The weights of b and c, times the square.
    let (s, t) = (d.cross(c - a).dot(n), (b - a).cross(d).dot(n));
    let weights = square + s.abs() + t.abs() + (square - s - t).abs();
    let [x, y, z] = n.abs().to_array();
    n.dot(d).abs() * square <= ROUNDED * (x + y + z) * weights
}

/// Whether rounding may have turned a triangle by any angle: it is hardly higher than rounding moves its corners.
fn is_narrow(triangle: &[[i32; 3]; 3]) -> bool {
    let [a, b, c] = triangle.map(as_vec);
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    normal(triangle).length_squared() <= (2.0 * ROUNDED).powi(2) * longest
}

/// At a right angle to a triangle, and as long as twice its area.
fn normal(triangle: &[[i32; 3]; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(as_vec);
    (b - a).cross(c - a)
}

#[cfg(test)]
mod tests {
    use super::{Feature, Planes};
    use crate::BuildConfig;

    #[test]
    fn the_angle_of_features_can_be_chosen() {
        // Two triangles that meet at 45 degrees, far larger than what rounding moves points by.
        let roof = [[[0, 0, 0], [400, 0, 0], [0, 400, 0]], [[0, 0, 0], [0, 400, 0], [-400, 0, -400]]];
        let kept = |feature_angle| {
            let config = BuildConfig { feature_angle, ..BuildConfig::default() };
            let feature = Feature::of(&config).expect("an angle in range");
            Planes::of(roof.into_iter(), feature).is_some()
        };
        assert_eq!(
            [None, Some(60.0), Some(46.0), Some(44.0), Some(1.0)].map(kept),
            [false, false, false, true, true]
        );
        // The default is 60 degrees to the last bit where it matters: 90 is beyond, 45 is not.
        assert!(Planes::of(roof[..1].iter().copied(), Feature::default()).is_some());
    }

    #[test]
    fn rounded_points_of_a_plane_are_in_it_and_no_others() {
        // Around the origin, in the plane at a right angle to (3, 5, 7), rounded.
        let around = [[500.0, -300.0], [420.0, 310.0], [-130.0, 480.0], [-510.0, 20.0], [-90.0, -450.0]];
        let place =
            |[x, y]: [f64; 2], lift: f64| [x, y, lift - (3.0 * x + 5.0 * y) / 7.0].map(|c| c.round() as i32);
        let fan = |lift: f64| {
            let rim = around.map(|p| place(p, if p[0] < 0.0 { lift } else { 0.0 }));
            let [a, b, c, d, e] = rim;
            [[a, b], [b, c], [c, d], [d, e], [e, a]].map(|[x, y]| [[0; 3], x, y])
        };
        let planes = Planes::of(fan(0.0).into_iter(), Feature::default()).expect("it is flat");
        assert!(planes.rounded.is_some() && planes.planes.len() == 1);
        assert!(planes.meet_at(place([900.0, 100.0], 0.0)) && !planes.meet_at(place([900.0, 100.0], 40.0)));
        // The other way round, a triangle is folded over.
        let [o, x, y] = fan(0.0)[0];
        assert!(planes.hold([o, x, y]) && !planes.hold([o, y, x]));
        assert!(Planes::of(fan(40.0).into_iter(), Feature::default()).is_none(), "it is bent");
    }
}
