//! Where the boundary is flat, or flat parts meet at a sharp crease or corner: there it stays, whatever error is allowed.

use super::dihedral::sharpness_of;
use super::{BuildConfig, BuildError};
use crate::geom::orient3d;

/// The most planes that meet at a corner.
const MOST_PLANES: usize = 3;

/// From which angle on two planes of the boundary meet at a feature: a crease or corner that stays.
#[derive(Clone, Copy)]
pub(super) struct Feature {
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

/// The planes of the boundary triangles around a vertex, each by three points, if the vertex must stay in all of them: there is one,
/// or two or three meet at angles that no curved boundary has: at features. Triangles are ordered as seen from outside.
pub(super) fn planes(
    triangles: impl Iterator<Item = [[i32; 3]; 3]>,
    feature: Feature,
) -> Option<Vec<[[i32; 3]; 3]>> {
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
        across <= 0.0 || across * across <= feature.square * (a * b)
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

#[cfg(test)]
mod tests {
    use super::{Feature, planes};
    use crate::builder::BuildConfig;

    #[test]
    fn the_angle_of_features_can_be_chosen() {
        // Two triangles that meet at 45 degrees.
        let roof = [[[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 0, 0], [0, 4, 0], [-4, 0, -4]]];
        let kept = |feature_angle| {
            let config = BuildConfig { feature_angle, ..BuildConfig::default() };
            let feature = Feature::of(&config).expect("an angle in range");
            planes(roof.into_iter(), feature).is_some()
        };
        assert_eq!(
            [None, Some(60.0), Some(46.0), Some(44.0), Some(1.0)].map(kept),
            [false, false, false, true, true]
        );
        // The default is 60 degrees to the last bit where it matters: 90 is beyond, 45 is not.
        assert!(planes(roof[..1].iter().copied(), Feature::default()).is_some());
    }
}
