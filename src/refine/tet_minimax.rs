//! The least value, over a tetrahedron, of the greatest of some linear functions: whether it intersects a convex
//! polyhedron.

/// The most linear functions.
pub(super) const MAX_ROWS: usize = super::MAX_PLANES + 1;

/// Linear functions by their values at the four corners of a tetrahedron.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    values: [[f64; 4]; MAX_ROWS],
    len: usize,
}

/// Pivots before the search is given up; Bland's rule ends long before.
const MAX_PIVOTS: u32 = 200;

impl Rows {
    pub fn new() -> Self {
        Self { values: [[0.0; 4]; MAX_ROWS], len: 0 }
    }

    /// Adds a function; there must be room.
    #[inline]
    pub fn push(&mut self, values: [f64; 4]) {
        self.values[self.len] = values;
        self.len += 1;
    }

    /// `min` over the tetrahedron of `max` over the functions, so far as that decides whether it exceeds `threshold`: a
    /// value on the same side of `threshold` and no further from it. Without functions, minus infinity.
    #[inline]
    pub fn least(&self, threshold: f64) -> f64 {
        self.least_by(threshold).0
    }

    /// What [`Self::least`] gives, and if one function alone decides that it exceeds `threshold`, which.
    #[inline]
    pub fn least_by(&self, threshold: f64) -> (f64, Option<usize>) {
        let rows = &self.values[..self.len];
        // Some function is at least so much at all corners.
        let (mut low, mut by) = (f64::NEG_INFINITY, 0);
        for (k, row) in rows.iter().enumerate() {
            let least = smallest(row);
            if least > low {
                (low, by) = (least, k);
            }
        }
        if low > threshold || rows.is_empty() {
            return (low, Some(by));
        }
        // At some corner all functions are at most so much.
        let worst = |i: usize| rows.iter().fold(f64::NEG_INFINITY, |m, row| m.max(row[i]));
        let high = (0..4).fold(f64::INFINITY, |m, i| m.min(worst(i)));
        (if high <= threshold { high } else { self.solve(low, high) }, None)
    }

    /// The value of the zero-sum game in which one player names a function and the other a point of the tetrahedron, by the
    /// simplex method (Dantzig 1951). The result is what the greatest function is at a point that was found, so never
    /// too small.
    #[inline(never)]
    fn solve(&self, low: f64, high: f64) -> f64 {
        let rows = &self.values[..self.len];
        // Scaled to 1 ..= 2, so that the value is positive and pivots are of the order of 1.
        let largest = rows.iter().flatten().fold(f64::NEG_INFINITY, |m, &v| m.max(v));
        let least = rows.iter().flatten().fold(f64::INFINITY, |m, &v| m.min(v));
        let scale = 1.0 / (largest - least);
        if !scale.is_finite() {
            return high;
        }
        // Maximise x1 + … + x4 with A x <= 1: the best point is x / sum x.
        let mut table = [[0.0; 5]; MAX_ROWS];
        for (line, row) in table.iter_mut().zip(rows) {
            (0..4).for_each(|i| line[i] = 1.0 + (row[i] - least) * scale);
            line[4] = 1.0;
        }
        let mut goal = [1.0, 1.0, 1.0, 1.0, 0.0];
        // Which variable each line and each column stands for: 0..4 are corners, others slack.
        let mut in_line: [usize; MAX_ROWS] = std::array::from_fn(|k| 4 + k);
        let mut in_column = [0, 1, 2, 3];
        for _ in 0..MAX_PIVOTS {
            // Bland's rule: of those that improve, the variable of the smallest number.
            let entering = (0..4).filter(|&i| goal[i] > 1e-13).min_by_key(|&i| in_column[i]);
            let Some(column) = entering else { break };
            let mut leaving: Option<(f64, usize)> = None;
            for k in 0..self.len {
                if table[k][column] > 1e-13 {
                    let ratio = table[k][4] / table[k][column];
                    let better = leaving.is_none_or(|(least, line)| {
                        ratio < least || ratio == least && in_line[k] < in_line[line]
                    });
                    if better {
                        leaving = Some((ratio, k));
                    }
                }
            }
            let Some((_, line)) = leaving else { break };
            pivot(&mut table[..self.len], &mut goal, line, column);
            std::mem::swap(&mut in_line[line], &mut in_column[column]);
        }
        let mut point = [0.0; 4];
        for (k, &variable) in in_line[..self.len].iter().enumerate() {
            if let Some(x) = point.get_mut(variable) {
                *x = table[k][4].max(0.0);
            }
        }
        let sum: f64 = point.iter().sum();
        if sum.is_nan() || sum <= 0.0 {
            return high;
        }
        let at = |row: &[f64; 4]| (0..4).map(|i| row[i] * point[i]).sum::<f64>() / sum;
        rows.iter().fold(low, |m, row| m.max(at(row))).min(high)
    }
}

/// The smallest of four numbers: in few instructions, as it does not matter what it is if one is NaN.
#[inline]
pub(super) fn smallest(row: &[f64; 4]) -> f64 {
    let smaller = |a: f64, b: f64| if a < b { a } else { b };
    smaller(smaller(row[0], row[1]), smaller(row[2], row[3]))
}

/// Exchanges the variables of a line and a column.
fn pivot(table: &mut [[f64; 5]], goal: &mut [f64; 5], line: usize, column: usize) {
    let inverse = 1.0 / table[line][column];
    let mut row = table[line].map(|x| x * inverse);
    row[column] = inverse;
    let reduce = |other: &mut [f64; 5]| {
        let factor = other[column];
        other[column] = 0.0;
        (0..5).for_each(|i| other[i] -= factor * row[i]);
    };
    table.iter_mut().enumerate().filter(|(k, _)| *k != line).for_each(|(_, other)| reduce(other));
    reduce(goal);
    table[line] = row;
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A random number from -1 to 1.
    pub(in crate::refine) fn next(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 40) as f64 / (1_u64 << 24) as f64 * 2.0 - 1.0
    }

    /// The twin: the least value lies where at most four functions and faces meet; a fine grid of points bounds it from
    /// above, weights of the functions from below.
    fn grid(rows: &[[f64; 4]], n: u32) -> f64 {
        let mut least = f64::INFINITY;
        for a in 0..=n {
            for b in 0..=n - a {
                for c in 0..=n - a - b {
                    let d = n - a - b - c;
                    let w = [a, b, c, d].map(|x| f64::from(x) / f64::from(n));
                    let at = |row: &[f64; 4]| (0..4).map(|i| row[i] * w[i]).sum::<f64>();
                    least = least.min(rows.iter().map(at).fold(f64::NEG_INFINITY, f64::max));
                }
            }
        }
        least
    }

    #[test]
    fn agrees_with_a_search_over_the_tetrahedron() {
        let mut state = 5;
        for round in 0..600 {
            let len = 1 + round % 8;
            let values: Vec<[f64; 4]> = (0..len).map(|_| [0; 4].map(|_| next(&mut state))).collect();
            let mut rows = Rows::new();
            values.iter().for_each(|&row| rows.push(row));
            let low = values.iter().map(smallest).fold(f64::NEG_INFINITY, f64::max);
            let found = rows.solve(low, f64::INFINITY);
            let twin = grid(&values, 24);
            // The functions change by at most 2 over an edge, which the grid cuts into 24.
            assert!(found <= twin + 1e-12 && twin - found <= 2.0 * 3.0 / 24.0, "{found} {twin} {values:?}");
            for threshold in [found - 0.1, found - 1e-9, found + 1e-9, found + 0.1] {
                let told = rows.least(threshold);
                assert_eq!(told > threshold, found > threshold);
                assert!((told - threshold).abs() <= (found - threshold).abs() + 1e-12);
            }
        }
    }

    #[test]
    fn weights_of_the_functions_prove_the_value() {
        // By duality the value is also the largest that a mixture of functions is at all corners at least: the transposed
        // game with the signs changed. Four functions make that a game of the same shape.
        let mut state = 99;
        for _ in 0..400 {
            let values: [[f64; 4]; 4] = [0; 4].map(|_| [0; 4].map(|_| next(&mut state)));
            let (mut rows, mut dual) = (Rows::new(), Rows::new());
            for (i, row) in values.iter().enumerate() {
                rows.push(*row);
                dual.push([0, 1, 2, 3].map(|k| -values[k][i]));
            }
            let [value, other] = [&rows, &dual].map(|r| r.solve(-10.0, 10.0));
            assert!((value + other).abs() < 1e-12, "{value} {other}");
        }
    }
}
