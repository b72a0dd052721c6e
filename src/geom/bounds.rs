//! Axis-aligned boxes.

/// An axis-aligned box, closed on all sides, in the units of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: [f64; 3],
    /// Largest coordinates.
    pub max: [f64; 3],
}

/// The box around points of a lattice, its least and its largest corner; none if there are no points.
pub fn lattice_box(points: impl IntoIterator<Item = [i32; 3]>) -> Option<[[i32; 3]; 2]> {
    points.into_iter().map(|p| [p, p]).reduce(|[low, high], [p, _]| {
        [[0, 1, 2].map(|k| low[k].min(p[k])), [0, 1, 2].map(|k| high[k].max(p[k]))]
    })
}

impl Bounds {
    /// The box that contains nothing; the start of a union.
    pub const EMPTY: Self = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

    /// The smallest box around `points`; [`Bounds::EMPTY`] if there are none.
    pub fn of(points: &[[f64; 3]]) -> Self {
        points.iter().fold(Self::EMPTY, |b, p| b.with(*p))
    }

    /// This box grown to contain `p`.
    pub fn with(self, p: [f64; 3]) -> Self {
        Self { min: [0, 1, 2].map(|i| self.min[i].min(p[i])), max: [0, 1, 2].map(|i| self.max[i].max(p[i])) }
    }

    /// Edge lengths along x, y and z.
    pub fn extent(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| (self.max[i] - self.min[i]).max(0.0))
    }

    /// Length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        self.extent().iter().map(|e| e * e).sum::<f64>().sqrt()
    }

    /// Whether `p` lies in the box or on its border.
    pub fn contains(&self, p: [f64; 3]) -> bool {
        (0..3).all(|i| self.min[i] <= p[i] && p[i] <= self.max[i])
    }
}
