//! The nearest of many triangles that share a vertex.
//!
//! Boxes around such triangles all overlap there. So groups of them are bounded by cones: seen from the vertex, what is in a group lies
//! within an angle around an axis, and within a distance.

use glam::DVec3;
use std::ops::Range;

/// Triangles in groups of groups.
pub(crate) struct TriangleFan {
    apex: DVec3,
    /// Group by group.
    triangles: Vec<u32>,
    /// Each before the groups in it: first the one of the first half, then the other.
    groups: Vec<Group>,
}

/// A triangle, and the directions of its other corners.
type Directed = (u32, [DVec3; 2]);

/// What bounds a group. The point nearest to a place is no nearer than that of the cone, nor than that of the ball.
struct Group {
    axis: DVec3,
    /// Of the angle around the axis; 0 and 1 with no axis if that is a right one or more.
    cosine: f64,
    sine: f64,
    radius: f64,
    /// Where the group of the second half is; 0 if this one is not divided.
    second: u32,
}

/// Groups of so many triangles are not divided.
const SMALL: usize = 8;

/// Far more than the rounding errors of a distance, relative to that of the place from the apex.
const ROUNDING: f64 = 1e-12;

impl TriangleFan {
    /// Of these triangles at a vertex, given their other two corners.
    pub fn new(apex: DVec3, triangles: &[u32], others: impl Fn(u32) -> [DVec3; 2]) -> Self {
        let directed = |&t: &u32| (t, others(t).map(|corner| (corner - apex).normalize_or_zero()));
        let mut all: Vec<Directed> = triangles.iter().map(directed).collect();
        let radius = |t: u32| others(t).into_iter().map(|corner| corner.distance(apex)).fold(0.0, f64::max);
        let mut groups = Vec::new();
        divide(&mut all, &radius, &mut groups);
        Self { apex, triangles: all.into_iter().map(|(t, _)| t).collect(), groups }
    }

    /// The triangle nearest to a place, the first one of several, and the square of its distance, if that is less than the one of
    /// `known`; else `known`.
    pub fn nearer(&self, p: DVec3, known: (u32, f64), squared: impl FnMut(u32) -> f64) -> (u32, f64) {
        let mut search = Search { fan: self, p: p - self.apex, found: None, least: known.1, squared };
        search.visit(0, 0..self.triangles.len());
        search.found.map_or(known, |found| (found, search.least))
    }
}

/// Divides triangles into groups, each before those in it.
fn divide(all: &mut [Directed], radius: &impl Fn(u32) -> f64, groups: &mut Vec<Group>) {
    let own = groups.len();
    groups.push(Group::around(all, radius));
    if all.len() > SMALL {
        let (first, rest) = halves(all);
        divide(first, radius, groups);
        groups[own].second = groups.len() as u32;
        divide(rest, radius, groups);
    }
}

/// The halves of what is sorted along the axis in which the directions are farthest apart.
fn halves(all: &mut [Directed]) -> (&mut [Directed], &mut [Directed]) {
    let middle = |(_, [a, b]): &Directed| *a + *b;
    let low = all.iter().map(middle).fold(DVec3::INFINITY, DVec3::min);
    let high = all.iter().map(middle).fold(DVec3::NEG_INFINITY, DVec3::max);
    let axis = (high - low).max_position();
    let half = all.len() / 2;
    all.select_nth_unstable_by(half, |x, y| middle(x)[axis].total_cmp(&middle(y)[axis]).then(x.0.cmp(&y.0)));
    all.split_at_mut(half)
}

impl Group {
    fn around(all: &[Directed], radius: &impl Fn(u32) -> f64) -> Self {
        let directions = || all.iter().flat_map(|(_, directions)| directions);
        let axis = directions().sum::<DVec3>().normalize_or_zero();
        let cosine = directions().map(|&d| d.dot(axis)).fold(1.0, f64::min);
        let sine = directions().map(|&d| (d - axis * d.dot(axis)).length()).fold(0.0, f64::max);
        let (axis, cosine, sine) = if cosine > 0.0 { (axis, cosine, sine) } else { (DVec3::ZERO, 0.0, 1.0) };
        let radius = all.iter().map(|&(t, _)| radius(t)).fold(0.0, f64::max);
        Self { axis, cosine, sine, radius, second: 0 }
    }

    /// No more than the distance of a place, relative to the apex, from any point of the group's triangles.
    fn distance(&self, p: DVec3) -> f64 {
        let Self { axis, cosine, sine, radius, .. } = *self;
        let (length, along) = (p.length(), p.dot(axis));
        let across = (p - axis * along).length();
        let is_behind = along * cosine + across * sine <= 0.0;
        let from_cone = if is_behind { length } else { across * cosine - along * sine };
        (from_cone.max(length - radius) - ROUNDING * length).max(0.0)
    }
}

/// A search for the nearest triangle.
struct Search<'a, F> {
    fan: &'a TriangleFan,
    /// Relative to the apex.
    p: DVec3,
    found: Option<u32>,
    /// The square of the least distance so far.
    least: f64,
    squared: F,
}

impl<F: FnMut(u32) -> f64> Search<'_, F> {
    fn visit(&mut self, group: usize, range: Range<usize>) {
        let second = self.fan.groups[group].second as usize;
        if second == 0 {
            return self.compare(range);
        }
        let middle = range.start + range.len() / 2;
        let mut parts = [(group + 1, range.start..middle), (second, middle..range.end)]
            .map(|(group, range)| (self.fan.groups[group].distance(self.p), group, range));
        if parts[1].0 < parts[0].0 {
            parts.reverse();
        }
        for (distance, group, range) in parts {
            if distance * distance <= self.least {
                self.visit(group, range);
            }
        }
    }

    fn compare(&mut self, range: Range<usize>) {
        for &t in &self.fan.triangles[range] {
            let squared = (self.squared)(t);
            let is_first = squared == self.least && self.found.is_some_and(|found| t < found);
            if squared < self.least || is_first {
                (self.found, self.least) = (Some(t), squared);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use tetralod::geom::nearest_on_triangle;

    /// Triangles around the origin, and their rim: waves on a cone.
    fn fan(count: u32, wave: f64) -> Vec<[DVec3; 3]> {
        let corner = |i: u32| {
            let angle = f64::from(i % count) / f64::from(count) * std::f64::consts::TAU;
            let height = 1.0 + wave * (7.0 * angle).sin();
            DVec3::new(angle.cos(), angle.sin(), height)
        };
        (0..count).map(|i| [DVec3::ZERO, corner(i), corner(i + 1)]).collect()
    }

    /// How many triangles are looked at on average, for places near to the triangles; what is found is compared with a search of all.
    fn looked_at(triangles: &[[DVec3; 3]], far: f64) -> f64 {
        let looked = Cell::new(0_u32);
        let numbers: Vec<u32> = (0..triangles.len() as u32).collect();
        let tree = TriangleFan::new(DVec3::ZERO, &numbers, |t| [1, 2].map(|k| triangles[t as usize][k]));
        let squared = |p: DVec3, t: u32| p.distance_squared(nearest_on_triangle(p, triangles[t as usize]));
        let places = 500;
        for i in 0..places {
            let [_, b, c] = triangles[i * 7919 % triangles.len()];
            let p = (b + c) * (0.5 * (i % 10) as f64 / 10.0) + DVec3::new(far, -far, 2.0 * far);
            let known = (u32::MAX, f64::INFINITY);
            let all = numbers.iter().fold(known, |known: (u32, f64), &t| {
                let distance = squared(p, t);
                if distance < known.1 { (t, distance) } else { known }
            });
            let count = |t: u32| {
                looked.set(looked.get() + 1);
                squared(p, t)
            };
            assert_eq!(tree.nearer(p, known, count), all, "place {i}");
            let nearer = (7, all.1);
            assert_eq!(tree.nearer(p, nearer, |t| squared(p, t)), nearer, "only what is nearer is found");
        }
        f64::from(looked.get()) / places as f64
    }

    #[test]
    fn the_nearest_is_found_among_few() {
        for count in [3, 8, 9, 100, 1000, 8000] {
            for wave in [0.0, 0.3] {
                let triangles = fan(count, wave);
                let (near, far) = (looked_at(&triangles, 1e-3), looked_at(&triangles, 0.3));
                assert!(near <= 40.0 + f64::from(count) * 0.05, "{near} of {count}");
                assert!(far <= 40.0 + f64::from(count) * 0.7, "{far} of {count}");
            }
        }
    }

    #[test]
    fn triangles_without_a_direction_are_found() {
        let far = DVec3::new(5.0, 0.0, 0.0);
        let mut triangles = vec![[DVec3::ZERO; 3]; 40];
        triangles[33] = [DVec3::ZERO, far, far];
        triangles[34] = [DVec3::ZERO, far, -far];
        let numbers: Vec<u32> = (0..40).collect();
        let tree = TriangleFan::new(DVec3::ZERO, &numbers, |t| [1, 2].map(|k| triangles[t as usize][k]));
        for (p, nearest) in [(far, 33), (-far, 34), (DVec3::Y, 0)] {
            let squared = |t: u32| p.distance_squared(nearest_on_triangle(p, triangles[t as usize]));
            assert_eq!(tree.nearer(p, (0, f64::INFINITY), squared).0, nearest);
        }
    }
}
