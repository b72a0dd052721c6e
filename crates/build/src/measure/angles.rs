//! How good the cells of a mesh are: their smallest dihedral angles.

use glam::DVec3;
use serde::Serialize;
use tetralod::geom::sharpness;

/// How the smallest dihedral angles of the cells of a mesh are distributed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CellAngles {
    /// The smallest angle of all, in degrees; none without cells.
    pub least: Option<f64>,
    /// How many cells there are.
    #[serde(skip)]
    pub cells: u64,
    /// How many of them have a small angle.
    pub below: [CellsBelow; DEGREES.len()],
}

/// How many cells have an angle below a limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CellsBelow {
    /// The limit.
    pub degrees: f64,
    /// How many they are.
    pub cells: u64,
}

/// The angles at which cells are counted.
const DEGREES: [f64; 6] = [1.0, 5.0, 10.0, 20.0, 30.0, 40.0];

impl CellAngles {
    /// Of cells with these corners.
    pub fn of(cells: impl Iterator<Item = [[f64; 3]; 4]>) -> Self {
        let limits = DEGREES.map(|degrees| {
            let cosine = libm::cos(degrees.to_radians());
            cosine * cosine
        });
        let below = DEGREES.map(|degrees| CellsBelow { degrees, cells: 0 });
        let mut found = Self { least: None, cells: 0, below };
        let mut sharpest = -1.0_f64;
        for corners in cells {
            let own = sharpness(corners.map(DVec3::from));
            sharpest = sharpest.max(own);
            found.cells += 1;
            let below = found.below.iter_mut().zip(limits);
            below.for_each(|(below, limit)| below.cells += u64::from(own > limit));
        }
        let cosine = libm::sqrt(sharpest.abs()).copysign(sharpest);
        found.least = (found.cells > 0).then(|| libm::acos(cosine).to_degrees());
        found
    }
}

#[cfg(test)]
mod tests {
    use super::CellAngles;

    #[test]
    fn cells_are_counted_below_each_limit() {
        let of_height = |h: f64| [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, h]];
        let angles = CellAngles::of([1.0, 0.1, 0.01].map(of_height).into_iter());
        // The slope of the face above the right angle: √2 times the height.
        let least = (0.01 * 2.0_f64.sqrt()).atan().to_degrees();
        assert!((angles.least.unwrap() - least).abs() < 1e-6, "{angles:?}");
        assert_eq!((angles.cells, angles.below.map(|below| below.cells)), (3, [1, 1, 2, 2, 2, 2]));
        assert_eq!(CellAngles::of(std::iter::empty()).least, None);
    }
}
