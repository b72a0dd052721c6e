//! What a ray meets first: a surface, or the inside of a volume.
//!
//! Triangles are cut as Woop, Benthin and Wald describe (*Watertight Ray/Triangle Intersection*, 2013): in
//! coordinates in which the ray is an axis, the three sides are compared with it. Neighbours compute the same
//! numbers for the side that they share, but for the sign, so no ray slips through between them. A ray that
//! meets several triangles at once takes the first of them.

use crate::geom::Ray;
use crate::view::{ClipPlane, Medium, MeshView, Place, Probe, Span, Triangles};
use glam::DVec3;

/// Halvings of the interval in which half of the light is lost: to the last bits of a number.
const HALVINGS: u32 = 52;

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceHit {
    /// From the start of the ray, in model units.
    pub distance: f64,
    /// In model units.
    pub position: [f64; 3],
    /// The triangle.
    pub triangle: u32,
    /// The weights of its corners.
    pub weights: [f64; 3],
    /// What is linear between the values of its corners; NaN if one has none.
    pub value: f64,
}

/// Where a ray has lost half of its light in a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MediumHit {
    /// From the start of the ray, in model units.
    pub distance: f64,
    /// In model units.
    pub position: [f64; 3],
    /// The place in the mesh.
    pub place: Place,
    /// The field there, in its own units.
    pub value: f64,
}

/// The first point of a surface along a ray, whichever side it shows; points with `normal · p > offset` for
/// one of the planes are cut away. None if there is none, or the ray is not finite or has no direction. The
/// direction may have any length.
///
/// Looks at each triangle once: some twenty milliseconds for a million.
///
/// ```
/// use glam::DVec3;
/// use tetralod::geom::Ray;
/// use tetralod::view::{Triangles, first_hit};
///
/// let surface = Triangles {
///     positions: &[[0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0]],
///     values: &[0.0, 1.0, 0.0],
///     indices: &[[0, 1, 2]],
///     ..Triangles::default()
/// };
/// let ray = Ray { origin: DVec3::new(0.25, 0.25, 0.0), direction: DVec3::Z };
/// let hit = first_hit(&surface, &ray, &[]).expect("it is in the way");
/// assert_eq!((hit.distance, hit.value), (2.0, 0.25));
/// ```
pub fn first_hit(surface: &Triangles<'_>, ray: &Ray, planes: &[ClipPlane]) -> Option<SurfaceHit> {
    let way = Way::new(ray)?;
    way.first_hit(surface, way.kept(planes)?, |_, _| true)
}

/// [`first_hit`] of the parts of a surface that are kept, by the weights of the corners of a triangle.
pub fn first_kept_hit(
    surface: &Triangles<'_>,
    ray: &Ray,
    keeps: impl Fn(&[u32; 3], [f64; 3]) -> bool,
) -> Option<SurfaceHit> {
    Way::new(ray)?.first_hit(surface, [0.0, f64::INFINITY], keeps)
}

/// The point along a ray where half of the light is lost: the opacity so far is one half. What the planes cut
/// away takes no light. None if it never comes to that, or the ray is not finite or has no direction.
///
/// [`Probe::make_grid`] makes this quick; without, all tetrahedra are looked at.
///
/// # Panics
/// As [`Probe::line`].
pub fn first_hit_in(
    medium: &Medium,
    probe: &Probe<'_>,
    ray: &Ray,
    planes: &[ClipPlane],
) -> Option<MediumHit> {
    let way = Way::new(ray)?;
    half_lost(medium, probe, &way, way.kept(planes)?, Some)
}

/// [`first_hit_in`] for a mesh that is displaced: the planes cut what is not, which has the same tetrahedra.
///
/// # Panics
/// As [`first_hit_in`].
pub fn first_hit_in_displaced(
    medium: &Medium,
    probe: &Probe<'_>,
    rest: &MeshView<'_>,
    ray: &Ray,
    planes: &[ClipPlane],
) -> Option<MediumHit> {
    let way = Way::new(ray)?;
    half_lost(medium, probe, &way, [0.0, f64::INFINITY], |span| {
        let ends = [span.entry, span.exit].map(|place| DVec3::from(place.position(rest)));
        let [mut first, mut last] = [0.0_f64, 1.0_f64];
        for plane in planes {
            let [from, to] = ends.map(|end| DVec3::from(plane.normal).dot(end) - plane.offset);
            if from > 0.0 && to > 0.0 {
                return None;
            }
            if from > 0.0 {
                first = first.max(from / (from - to));
            } else if to > 0.0 {
                last = last.min(from / (from - to));
            }
        }
        let at = |part: f64| span.from + part * (span.to - span.from);
        let (from, to) = (at(first), at(last));
        (first < last).then(|| Span { from, to, entry: between(&span, first), exit: between(&span, last) })
    })
}

/// The point where half of the light is lost that goes through what is kept of each span.
fn half_lost(
    medium: &Medium,
    probe: &Probe<'_>,
    way: &Way,
    limits: [f64; 2],
    kept: impl Fn(Span) -> Option<Span>,
) -> Option<MediumHit> {
    let mesh = probe.mesh();
    let [near, far] = way.through(mesh, limits)?;
    let (from, to) = (way.at(near), way.at(far));
    let length = far - near;
    let mut left = 1.0;
    for span in probe.line(from, to).into_iter().filter_map(kept) {
        let ends = [span.entry, span.exit].map(|place| place.value(mesh));
        let through = medium.piece(ends, (span.to - span.from) * length).transmittance;
        if left * through > 0.5 {
            left *= through;
            continue;
        }
        let part = half_way(medium, ends, (span.to - span.from) * length, left);
        let place = between(&span, part);
        let distance = near + (span.from + part * (span.to - span.from)) * length;
        return Some(MediumHit { distance, position: way.at(distance), place, value: place.value(mesh) });
    }
    None
}

/// The part of a piece of a ray after which half of the light is left, if `left` of it comes in and less than
/// half goes out.
fn half_way(medium: &Medium, [from, to]: [f64; 2], length: f64, left: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let part = 0.5 * (low + high);
        let through = medium.piece([from, from + part * (to - from)], part * length).transmittance;
        if left * through > 0.5 {
            low = part;
        } else {
            high = part;
        }
    }
    high
}

/// The place after a part of a span.
fn between(span: &Span, part: f64) -> Place {
    let weight = |i: usize| span.entry.weights[i] + part * (span.exit.weights[i] - span.entry.weights[i]);
    Place { tet: span.entry.tet, weights: [0, 1, 2, 3].map(weight) }
}

#[inline]
fn corners(surface: &Triangles<'_>, triangle: &[u32; 3]) -> Option<[[f64; 3]; 3]> {
    let [a, b, c] = triangle.map(|v| surface.positions.get(v as usize));
    Some([*a?, *b?, *c?])
}

/// A ray with what is computed once for all triangles.
struct Way {
    origin: [f64; 3],
    /// Length 1.
    direction: [f64; 3],
    /// The axis along which the ray goes most.
    axis: usize,
    /// By how much the ray moves along the next two axes, and how far it goes, for each unit along this one.
    shear: [f64; 3],
}

impl Way {
    /// None if the ray is not finite or has no direction.
    fn new(ray: &Ray) -> Option<Self> {
        let length = ray.direction.length();
        if !(ray.origin.is_finite() && length > 0.0 && length.is_finite()) {
            return None;
        }
        let direction: [f64; 3] = (ray.direction / length).into();
        let longer = |a: usize, b: usize| if direction[b].abs() > direction[a].abs() { b } else { a };
        let axis = (0..3).fold(0, longer);
        let along = direction[axis];
        let shear = [direction[(axis + 1) % 3] / along, direction[(axis + 2) % 3] / along, 1.0 / along];
        Some(Self { origin: ray.origin.into(), direction, axis, shear })
    }

    fn at(&self, distance: f64) -> [f64; 3] {
        [0, 1, 2].map(|i| self.origin[i] + distance * self.direction[i])
    }

    /// The distances between which no plane cuts the ray away.
    fn kept(&self, planes: &[ClipPlane]) -> Option<[f64; 2]> {
        let [mut near, mut far] = [0.0_f64, f64::INFINITY];
        for plane in planes {
            let along = |v: [f64; 3]| (0..3).map(|i| plane.normal[i] * v[i]).sum::<f64>();
            let (room, speed) = (plane.offset - along(self.origin), along(self.direction));
            if speed > 0.0 {
                far = far.min(room / speed);
            } else if speed < 0.0 {
                near = near.max(room / speed);
            } else if room < 0.0 {
                return None;
            }
        }
        (near <= far).then_some([near, far])
    }

    /// The distances between which the ray may meet a mesh; none without a mesh.
    fn through(&self, mesh: &MeshView<'_>, [near, far]: [f64; 2]) -> Option<[f64; 2]> {
        let along = |p: &[f64; 3]| (0..3).map(|i| (p[i] - self.origin[i]) * self.direction[i]).sum::<f64>();
        let [first, last] = mesh
            .positions
            .iter()
            .map(along)
            .filter(|x| x.is_finite())
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        // A little more, for rounding.
        let more = 1e-9 * (last - first + last.abs());
        let (near, far) = (near.max(first - more), far.min(last + more));
        (near < far).then_some([near, far])
    }

    /// The nearest hit between two distances of what is kept.
    fn first_hit(
        &self,
        surface: &Triangles<'_>,
        limits: [f64; 2],
        keeps: impl Fn(&[u32; 3], [f64; 3]) -> bool,
    ) -> Option<SurfaceHit> {
        // With the axis as a constant, a triangle takes half the time.
        let nearest = match self.axis {
            0 => self.nearest::<0>(surface, limits, keeps),
            1 => self.nearest::<1>(surface, limits, keeps),
            _ => self.nearest::<2>(surface, limits, keeps),
        };
        let (distance, triangle, weights) = nearest?;
        let value_at = |v: u32| surface.values.get(v as usize).copied().unwrap_or(f64::NAN);
        let values = surface.indices.get(triangle as usize)?.map(value_at);
        let value = (0..3).map(|i| weights[i] * values[i]).sum();
        Some(SurfaceHit { distance, position: self.at(distance), triangle, weights, value })
    }

    /// The nearest cut between two distances, the first of several: its distance, the triangle, and the
    /// weights of the corners.
    fn nearest<const AXIS: usize>(
        &self,
        surface: &Triangles<'_>,
        [near, far]: [f64; 2],
        keeps: impl Fn(&[u32; 3], [f64; 3]) -> bool,
    ) -> Option<(f64, u32, [f64; 3])> {
        let mut best: Option<(f64, u32, [f64; 3])> = None;
        for (i, triangle) in (0..).zip(surface.indices) {
            let Some(corners) = corners(surface, triangle) else { continue };
            let Some((distance, weights)) = self.cut::<AXIS>(corners) else { continue };
            let limit = best.map_or(f64::INFINITY, |(nearest, ..)| nearest);
            if near <= distance && distance <= far && distance < limit && keeps(triangle, weights) {
                best = Some((distance, i, weights));
            }
        }
        best
    }

    /// The distance at which the line of the ray goes through a triangle, and the weights of the corners
    /// there.
    #[inline]
    fn cut<const AXIS: usize>(&self, corners: [[f64; 3]; 3]) -> Option<(f64, [f64; 3])> {
        let along = |p: [f64; 3]| p[AXIS] - self.origin[AXIS];
        // The corners beside the ray, along each of the other two axes.
        let beside = |i: usize| {
            let axis = (AXIS + 1 + i) % 3;
            corners.map(|p| p[axis] - self.origin[axis] - self.shear[i] * along(p))
        };
        // Most triangles are on one side, which is soon seen.
        let is_beside = |[a, b, c]: [f64; 3]| a > 0.0 && b > 0.0 && c > 0.0 || a < 0.0 && b < 0.0 && c < 0.0;
        let x = beside(0);
        if is_beside(x) {
            return None;
        }
        let y = beside(1);
        if is_beside(y) {
            return None;
        }
        let sides = [[1, 2], [2, 0], [0, 1]].map(|[a, b]: [usize; 2]| x[a] * y[b] - x[b] * y[a]);
        let sum = sides[0] + sides[1] + sides[2];
        let is_outside = sides.iter().any(|s| *s < 0.0) && sides.iter().any(|s| *s > 0.0);
        if is_outside || sum == 0.0 {
            return None;
        }
        let weights = sides.map(|s| s / sum);
        let distance = (0..3).map(|i| weights[i] * self.shear[2] * along(corners[i])).sum();
        Some((distance, weights))
    }
}
