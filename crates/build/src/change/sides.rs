//! On which side of the faces of a hole points lie, exactly.

/// Where points are at most 2^SHORT_BITS apart along each axis, floating-point numbers are exact: normals are then below 2^35, and
/// sums of their products with positions below 2^53.
const SHORT_BITS: u32 = 16;

/// A set of faces of a hole: bit `i` is that of the `i`-th.
pub(crate) type FaceSet = u64;

/// The faces of a set, ascending.
pub(crate) fn bits(mut faces: FaceSet) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let first = (faces != 0).then(|| faces.trailing_zeros() as usize)?;
        faces &= faces - 1;
        Some(first)
    })
}

/// How many of a set come before a face.
#[inline]
pub(crate) fn rank(faces: FaceSet, face: usize) -> usize {
    (faces & ((1 << face) - 1)).count_ones() as usize
}

/// The planes of faces.
#[derive(Default)]
pub(crate) struct Sides {
    /// The points relative to the first one, where floating-point numbers are exact.
    relative: Vec<[f64; 3]>,
    /// For each face the normal and its product with a corner, where these are exact.
    short: Vec<[f64; 4]>,
    /// Else for each face a corner and the normal.
    long: Vec<([i32; 3], [i64; 3])>,
}

impl Sides {
    /// Finds the planes of faces, given their corners by number among these points.
    pub fn find(&mut self, points: &[[i32; 3]], faces: &[[u8; 3]]) {
        let Self { relative, short, long } = self;
        short.clear();
        long.clear();
        if !is_short(points) {
            let corners = |face: &[u8; 3]| face.map(|i| points[usize::from(i)]);
            long.extend(faces.iter().map(|face| long_plane(corners(face))));
            return;
        }
        relative.clear();
        relative.extend(points.iter().map(|p| from(points[0], *p)));
        short.extend(faces.iter().map(|face| short_plane(face.map(|i| relative[usize::from(i)]))));
    }

    /// Whether the `n`-th of the points, which is `p`, lies on the inner sides of all of these faces.
    #[inline]
    pub fn are_seen_from(&self, (n, p): (usize, [i32; 3]), faces: FaceSet) -> bool {
        let mut left = faces;
        let [x, y, z] = self.relative.get(n).copied().unwrap_or_default();
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            let seen = match self.short.get(i) {
                Some(&[a, b, c, d]) => a * x + b * y + c * z > d,
                None => self.is_long_seen(i, p),
            };
            if !seen {
                return false;
            }
        }
        true
    }

    #[cold]
    fn is_long_seen(&self, i: usize, p: [i32; 3]) -> bool {
        let (from, normal) = self.long[i];
        let product = |k: usize| i128::from(normal[k]) * i128::from(p[k] - from[k]);
        product(0) + product(1) + product(2) > 0
    }
}

/// Whether points are so near to each other that floating-point numbers are exact.
fn is_short(points: &[[i32; 3]]) -> bool {
    let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
    for p in points {
        for k in 0..3 {
            low[k] = low[k].min(p[k]);
            high[k] = high[k].max(p[k]);
        }
    }
    (0..3).all(|k| high[k] - low[k] <= 1 << SHORT_BITS)
}

#[inline]
fn from(origin: [i32; 3], p: [i32; 3]) -> [f64; 3] {
    [f64::from(p[0] - origin[0]), f64::from(p[1] - origin[1]), f64::from(p[2] - origin[2])]
}

#[inline]
fn short_plane([p, q, r]: [[f64; 3]; 3]) -> [f64; 4] {
    let u = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
    let v = [r[0] - p[0], r[1] - p[1], r[2] - p[2]];
    let [a, b, c] = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    [a, b, c, a * p[0] + b * p[1] + c * p[2]]
}

fn long_plane([p, q, r]: [[i32; 3]; 3]) -> ([i32; 3], [i64; 3]) {
    let [u, v] = [q, r].map(|corner| [0, 1, 2].map(|k| i64::from(corner[k] - p[k])));
    let minor = |i: usize, j: usize| u[i] * v[j] - u[j] * v[i];
    (p, [minor(1, 2), minor(2, 0), minor(0, 1)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetralod::geom::orient3d;

    #[test]
    fn sides_are_those_of_exact_orientations() {
        for bits in [3, 8, 16, 17, 20, 29] {
            let mut state = 1_u64;
            let mut next = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> (64 - bits)) as i32
            };
            let points: Vec<[i32; 3]> = (0..30).map(|_| [next(), next(), next()]).collect();
            let faces: Vec<[u8; 3]> = (0..28).map(|i| [i, i + 1, i + 2]).collect();
            let mut sides = Sides::default();
            sides.find(&points, &faces);
            for (n, &p) in points.iter().enumerate() {
                for (i, face) in faces.iter().enumerate() {
                    let [a, b, c] = face.map(|v| points[usize::from(v)]);
                    assert_eq!(sides.are_seen_from((n, p), 1 << i), orient3d(a, b, c, p) > 0, "{bits} bits");
                }
            }
        }
    }
}
