//! Bodies that stand for lines and vectors, as triangles: tubes (`tubes.rs`) and arrows (`glyphs.rs`).
//!
//! Cosines and sines are summed up here, so that the triangles are the same on every platform.

use crate::view::{FieldView, MeshView, Place};
use glam::DVec3;
use std::f64::consts::TAU;

/// Triangles of tubes or arrows; the memory is used again. The arrays are those of an
/// [`IsoSurface`](super::IsoSurface).
///
/// What holds: the surface of each body is closed and faces outwards. Along sharp edges, as those of a flat
/// end, it has two vertices at each place, one for the normal of either side.
#[derive(Clone, Debug, PartialEq)]
pub struct Solids {
    /// Vertices, in model units.
    pub positions: Vec<[f64; 3]>,
    /// One unit normal per vertex, outwards.
    pub normals: Vec<[f32; 3]>,
    /// What each vertex is coloured by, in the unit of that field.
    pub values: Vec<f64>,
    /// Triangles, counter-clockwise when seen from outside.
    pub indices: Vec<[u32; 3]>,
    /// Where in the mesh each vertex belongs to: the place of the line or the arrow that it is of.
    places: Vec<Place>,
    /// Points of the unit circle: a side of each body begins at each.
    circle: Vec<[f64; 2]>,
}

/// Fewest sides of what should be round.
pub(super) const FEWEST_SIDES: u32 = 3;

/// Most sides of what should be round.
pub(super) const MOST_SIDES: u32 = 16;

/// Most vertices: bodies that would make more are left out.
const MOST_VERTICES: usize = 1 << 30;

/// Terms of the series of cosine and sine: enough for half a turn.
const TERMS: u32 = 14;

/// Two directions that are perpendicular to a third one and to each other, so that the three are
/// right-handed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub along: DVec3,
    pub across: [DVec3; 2],
}

impl Frame {
    /// A frame around a unit vector.
    pub fn around(along: DVec3) -> Self {
        let [x, y, z] = along.abs().to_array();
        // The axis that is furthest from it.
        let axis = if x <= y && x <= z {
            DVec3::X
        } else if y <= z {
            DVec3::Y
        } else {
            DVec3::Z
        };
        Self::with(along, axis)
    }

    /// The frame around a unit vector whose first direction is nearest to `near`, which is not parallel.
    fn with(along: DVec3, near: DVec3) -> Self {
        let across = near - along * near.dot(along);
        let across = across / across.length();
        Self { along, across: [across, along.cross(across)] }
    }

    /// The frame turned the shortest way to another unit vector, which is not the opposite one: parallel
    /// transport.
    pub fn turned_to(&self, along: DVec3) -> Self {
        let sum = self.along + along;
        let [first, _] = self.across;
        Self::with(along, first - sum * (along.dot(first) / (1.0 + self.along.dot(along))))
    }

    /// The direction to a point of the unit circle.
    pub fn towards(&self, [x, y]: [f64; 2]) -> DVec3 {
        self.across[0] * x + self.across[1] * y
    }
}

impl Default for Solids {
    fn default() -> Self {
        Self::new()
    }
}

impl Solids {
    /// Nothing yet; bodies will have eight sides.
    pub fn new() -> Self {
        Self::with_sides(8)
    }

    /// Nothing yet; bodies will have so many sides, 3 to 16. Other numbers are taken for the nearest of these.
    pub fn with_sides(sides: u32) -> Self {
        let sides = sides.clamp(FEWEST_SIDES, MOST_SIDES);
        Self {
            positions: Vec::new(),
            normals: Vec::new(),
            values: Vec::new(),
            indices: Vec::new(),
            places: Vec::new(),
            circle: (0..sides).map(|k| circle_point(k, sides)).collect(),
        }
    }

    /// Removes all bodies.
    pub(super) fn clear(&mut self) {
        self.positions.clear();
        self.normals.clear();
        self.values.clear();
        self.indices.clear();
        self.places.clear();
    }

    /// How many sides the bodies have.
    pub(super) fn sides(&self) -> u32 {
        self.circle.len() as u32
    }

    /// Whether there is room for so many vertices more.
    pub(super) fn has_room_for(&self, vertices: usize) -> bool {
        vertices <= MOST_VERTICES.saturating_sub(self.positions.len())
    }

    /// The value at each vertex of a field of the mesh that the bodies stand in, given by one number a point: that of the line or in the
    /// middle of the arrow.
    ///
    /// # Panics
    /// If there are fewer numbers than points in that mesh.
    pub fn interpolate<'f>(&self, mesh: &MeshView<'_>, field: impl Into<FieldView<'f>>) -> Vec<f64> {
        let field = field.into();
        self.places.iter().map(|place| place.interpolate(mesh, field)).collect()
    }

    /// Adds a vertex.
    pub(super) fn vertex(&mut self, position: DVec3, normal: DVec3, (value, place): (f64, Place)) -> u32 {
        let vertex = self.positions.len() as u32;
        self.positions.push(position.to_array());
        self.normals.push(normal.to_array().map(|x| x as f32));
        self.values.push(value);
        self.places.push(place);
        vertex
    }

    /// Adds a ring of vertices: `place` makes position and normal of a point of the unit circle. Gives the
    /// first vertex.
    pub(super) fn ring(&mut self, of: (f64, Place), place: impl Fn([f64; 2]) -> (DVec3, DVec3)) -> u32 {
        let first = self.positions.len() as u32;
        for k in 0..self.circle.len() {
            let (position, normal) = place(self.circle[k]);
            self.vertex(position, normal, of);
        }
        first
    }

    /// Joins two rings, the second one further along the frame.
    pub(super) fn band(&mut self, from: u32, to: u32) {
        self.each_side(|[a, b]| [[from + a, from + b, to + b], [from + a, to + b, to + a]]);
    }

    /// Closes a ring with a vertex further along the frame, or behind it.
    pub(super) fn tip(&mut self, ring: u32, tip: u32, is_ahead: bool) {
        let sides = self.sides();
        for a in 0..sides {
            let b = (a + 1) % sides;
            self.indices.push(if is_ahead { [ring + a, ring + b, tip] } else { [ring + b, ring + a, tip] });
        }
    }

    /// Joins a ring with one whose vertices are all at one place further along the frame.
    pub(super) fn tips(&mut self, ring: u32, tips: u32) {
        let sides = self.sides();
        self.indices.extend((0..sides).map(|a| [ring + a, ring + (a + 1) % sides, tips + a]));
    }

    /// Closes a ring with a flat disk that faces along the frame, or against it.
    pub(super) fn disk(&mut self, ring: u32, is_ahead: bool) {
        for a in 1..self.sides() - 1 {
            let [b, c] = if is_ahead { [a, a + 1] } else { [a + 1, a] };
            self.indices.push([ring, ring + b, ring + c]);
        }
    }

    fn each_side(&mut self, triangles: impl Fn([u32; 2]) -> [[u32; 3]; 2]) {
        let sides = self.sides();
        self.indices.extend((0..sides).flat_map(|a| triangles([a, (a + 1) % sides])));
    }
}

/// Corner `k` of a regular polygon of `n` corners on the unit circle.
fn circle_point(k: u32, n: u32) -> [f64; 2] {
    // The upper half; the lower one mirrors it.
    let upper = k.min(n - k);
    let [x, y] = cos_sin(TAU * f64::from(upper) / f64::from(n));
    [x, if upper == k { y } else { -y }]
}

/// Cosine and sine of an angle of 0 to π, within 10⁻¹³, by basic operations alone.
pub(super) fn cos_sin(angle: f64) -> [f64; 2] {
    let (mut cos, mut sin, mut term) = (0.0, 0.0, 1.0);
    for k in 0..TERMS {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        cos += sign * term;
        term *= angle / f64::from(2 * k + 1);
        sin += sign * term;
        term *= angle / f64::from(2 * k + 2);
    }
    [cos, sin]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_are_cosine_and_sine() {
        for i in 0..=1000 {
            let angle = TAU / 2.0 * f64::from(i) / 1000.0;
            let [cos, sin] = cos_sin(angle);
            assert!((cos - angle.cos()).abs() < 1e-13 && (sin - angle.sin()).abs() < 1e-13, "{angle}");
        }
    }

    #[test]
    fn frames_stay_right_handed_and_do_not_twist() {
        let mut frame = Frame::around(DVec3::X);
        for step in 1..=100 {
            // A quarter turn in a plane: the direction across that plane stays.
            let angle = TAU / 4.0 * f64::from(step) / 100.0;
            frame = frame.turned_to(DVec3::new(angle.cos(), angle.sin(), 0.0));
            let [a, b] = frame.across;
            assert!((frame.along.cross(a) - b).length() < 1e-12 && (a.length() - 1.0).abs() < 1e-12);
        }
        let first = Frame::around(DVec3::X);
        assert!((first.across[0].z - frame.across[0].z).abs() < 1e-12);
    }
}
