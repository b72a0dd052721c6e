//! Where a removed vertex is in what fills its hole, when that is done by moving it to a neighbour.
//!
//! All tetrahedra of the filling have the neighbour `b` as a corner. So the vertex is in the one whose face the ray from `b` through
//! the vertex meets. Seen from the vertex, that is the face opposite `b`.
//!
//! ```text
//!         x ──── y          the cone of the face xy, seen from the vertex a, has
//!          \ a  /           the direction away from b: a lies in the tetrahedron of
//!           \│ /            the face xy and b, and its barycentric coordinates there
//!            b              are the volumes of those with a in the place of a corner
//! ```

use crate::change::hole::Hole;
use crate::change::sides::FaceSet;
use crate::error::points::{SLACK, as_vec, clamped};
use crate::error::reference::Reference;
use glam::DVec3;

/// The faces of a hole as its vertex sees them.
#[derive(Default)]
pub(crate) struct Centre {
    place: DVec3,
    /// Those that are made: that is done when they are first needed.
    made: FaceSet,
    cones: Vec<Cone>,
    /// Scratch space: the error of each field.
    errors: Vec<f64>,
}

/// A face and its vertex.
#[derive(Clone, Copy, Default)]
struct Cone {
    /// The products of two corners each, relative to the vertex: with `b` they give the volumes of tetrahedra that have the vertex in the
    /// place of the third.
    rows: [DVec3; 3],
    /// The volume of the tetrahedron that has the vertex in the place of `b`.
    own: f64,
}

/// A face of the hole, and where the vertex is in the tetrahedron of it and the neighbour: its barycentric coordinates but for the first
/// one, in the order of the filling.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seat {
    pub face: usize,
    pub lambda: DVec3,
}

impl Centre {
    /// Begins with a hole.
    pub fn start(&mut self, hole: &Hole, reference: &Reference<'_>) {
        let faces = hole.faces.len();
        if self.cones.len() < faces {
            self.cones.resize(faces, Cone::default());
        }
        (self.place, self.made) = (reference.quantized.places.at(hole.a), 0);
        self.errors.resize(reference.quantized.fields.len(), 0.0);
    }

    fn make(&mut self, face: usize, hole: &Hole) {
        let [x, y, z] = hole.corners_of(face).map(|i| as_vec(hole.points[i]) - self.place);
        let rows = [y.cross(z), z.cross(x), x.cross(y)];
        self.cones[face] = Cone { rows, own: -x.dot(rows[0]) };
        self.made |= 1 << face;
    }

    /// Where the vertex is if it moves to link vertex `i`, which sees the faces that it is no corner of; none if it is outside of the
    /// filling.
    pub fn seat(&mut self, hole: &Hole, i: usize) -> Option<Seat> {
        let b = as_vec(hole.points[i]) - self.place;
        let mut left = hole.others(i);
        let (mut best, mut deepest) = (None, -SLACK);
        while left != 0 {
            let face = left.trailing_zeros() as usize;
            left &= left - 1;
            if self.made & 1 << face == 0 {
                self.make(face, hole);
            }
            let Cone { rows: [x, y, z], own } = self.cones[face];
            let volumes = [x.dot(b), y.dot(b), z.dot(b)];
            // Positive: the tetrahedron is.
            let all = own + (volumes[0] + volumes[1] + volumes[2]);
            let least = volumes[0].min(volumes[1]).min(volumes[2]).min(own);
            if least < deepest * all {
                continue;
            }
            let lambda = DVec3::new(volumes[1], volumes[2], own) / all;
            best = Some(Seat { face, lambda });
            deepest = least / all;
            if least >= 0.0 {
                break;
            }
        }
        best
    }

    /// The largest error of all fields there; the tetrahedra of the hole are in these regions if fields jump.
    pub fn error_at(
        &mut self,
        seat: Seat,
        (hole, regions): (&Hole, &[u32]),
        i: usize,
        reference: &Reference<'_>,
    ) -> f64 {
        let ([x, y, z], b) = (hole.faces[seat.face].0, hole.link[i]);
        let (quantized, region) = (reference.quantized, regions.get(seat.face).copied());
        let levels = |f: usize| quantized.levels_of([x, y, z, b], region, f);
        let point = region.map_or(hole.a, |region| quantized.sides.point(hole.a, region));
        quantized.deviation(point, clamped(seat.lambda), levels, &mut self.errors)
    }
}
