//! Arrows of a vector field at the points of a regular grid.

use crate::geom::Bounds;
use crate::mesh::NONE;
use crate::view::solids::{Frame, MOST_SIDES};
use crate::view::{FieldView, MeshView, Place, Probe, Solids};
use glam::DVec3;

/// Most points of the grid, inside of the mesh or not.
const MOST_POINTS: f64 = (1 << 18) as f64;

/// Where the head of an arrow begins, as a fraction of its length.
const NECK: f64 = 0.65;

/// Radius of the shaft, as a fraction of the length.
const SHAFT: f64 = 0.04;

/// Radius of the head, as a fraction of the length.
const HEAD: f64 = 0.12;

/// How long arrows are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ArrowLength {
    /// As the magnitude of the vector; the longest is as long as the spacing of the grid.
    #[default]
    Magnitude,
    /// All as long as that.
    Constant,
}

/// Where arrows are, and what they look like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArrowOptions {
    /// From one point of the grid to the next along each axis, in model units; positive.
    pub spacing: f64,
    /// How long arrows are.
    pub length: ArrowLength,
}

impl Default for ArrowOptions {
    fn default() -> Self {
        Self { spacing: 0.1, length: ArrowLength::Magnitude }
    }
}

/// An arrow to be drawn.
#[derive(Clone, Copy, Debug)]
struct Arrow {
    middle: DVec3,
    vector: DVec3,
    magnitude: f64,
    /// Its value, and where in the mesh its middle is.
    of: (f64, Place),
}

impl Solids {
    /// Replaces the triangles by arrows of a vector field, given by its components along x, y and z, one
    /// number a point each. Gives the number of arrows. They are coloured by `field`, or by the magnitude of the
    /// vector.
    ///
    /// The grid lies in the middle of the box around the mesh; its points inside of the mesh have an arrow,
    /// which has the point in its middle. Where the vector is zero or not finite there is none. A spacing
    /// with more than 2^18 points is doubled until there are less. No arrows if the spacing is not positive
    /// and finite, or a field has fewer numbers than the mesh has points.
    ///
    /// # Panics
    /// If the mesh names a point or a neighbour that it does not have.
    pub fn set_arrows(
        &mut self,
        mesh: MeshView<'_>,
        vectors: [&[f64]; 3],
        field: Option<FieldView<'_>>,
        options: &ArrowOptions,
    ) -> usize {
        self.clear();
        let points = mesh.positions.len();
        let is_complete =
            vectors.into_iter().chain(field.map(|field| field.values)).all(|numbers| numbers.len() >= points);
        let is_usable = options.spacing > 0.0 && options.spacing.is_finite();
        if !(is_complete && is_usable) {
            return 0;
        }
        let Some((spacing, grid)) = grid(&mesh, options.spacing) else { return 0 };
        let mut probe = Probe::new(mesh);
        let places = probe.locate_all(&grid);
        let inside = grid.iter().zip(places).filter_map(|(p, place)| Some((*p, place?)));
        let arrows: Vec<Arrow> = inside.filter_map(|at| arrow(&mesh, vectors, field, at)).collect();
        let largest = arrows.iter().fold(0.0, |most, arrow| arrow.magnitude.max(most));
        let is_drawn = |arrow: &&Arrow| {
            let is_constant = options.length == ArrowLength::Constant;
            self.arrow(arrow, if is_constant { spacing } else { arrow.magnitude / largest * spacing })
        };
        arrows.iter().filter(is_drawn).count()
    }

    /// Adds an arrow; false if there is no room for it, or nothing to see.
    fn arrow(&mut self, arrow: &Arrow, length: f64) -> bool {
        if length <= 0.0 || !self.has_room_for(6 * MOST_SIDES as usize) {
            return false;
        }
        let Arrow { middle, vector, magnitude, of } = *arrow;
        let frame = Frame::around(vector / magnitude);
        let (tail, back) = (middle - frame.along * (0.5 * length), -frame.along);
        let at = |p: [f64; 2], along: f64, radius: f64| {
            tail + (frame.along * along + frame.towards(p) * radius) * length
        };
        let end = self.ring(of, |p| (at(p, 0.0, SHAFT), back));
        self.disk(end, false);
        let [low, high] = [0.0, NECK].map(|x| self.ring(of, |p| (at(p, x, SHAFT), frame.towards(p))));
        self.band(low, high);
        let [inner, outer] = [SHAFT, HEAD].map(|r| self.ring(of, |p| (at(p, NECK, r), back)));
        self.band(inner, outer);
        // Perpendicular to the side of the cone.
        let slope = DVec3::new(1.0 - NECK, HEAD, 0.0).normalize_or_zero();
        let normal = |p: [f64; 2]| frame.towards(p) * slope.x + frame.along * slope.y;
        let [rim, tips] =
            [(NECK, HEAD), (1.0, 0.0)].map(|(x, r)| self.ring(of, |p| (at(p, x, r), normal(p))));
        self.tips(rim, tips);
        true
    }
}

/// The spacing, and the points of the grid in the box around the points that tetrahedra name; none without a
/// box.
fn grid(mesh: &MeshView<'_>, mut spacing: f64) -> Option<(f64, Vec<[f64; 3]>)> {
    let named = mesh.tets.iter().filter(|tet| tet[0] != NONE).flatten();
    let corners = named.map(|v| mesh.positions[*v as usize]);
    let bounds = corners.fold(Bounds::EMPTY, Bounds::with);
    let extent = bounds.extent();
    if !(bounds.min[0] <= bounds.max[0] && extent.iter().all(|e| e.is_finite())) {
        return None;
    }
    let counts = |spacing: f64| extent.map(|e| (e / spacing).floor().max(1.0));
    while counts(spacing).iter().product::<f64>() > MOST_POINTS {
        spacing *= 2.0;
    }
    let counts = counts(spacing);
    let place = |i: u32, axis: usize| {
        0.5 * (bounds.min[axis] + bounds.max[axis]) + (f64::from(i) - 0.5 * (counts[axis] - 1.0)) * spacing
    };
    let [x, y, z] = counts.map(|count| count as u32);
    let rows = (0..z).flat_map(|k| (0..y).map(move |j| [j, k]));
    let points = rows.flat_map(|[j, k]| (0..x).map(move |i| [i, j, k]));
    Some((spacing, points.map(|[i, j, k]| [place(i, 0), place(j, 1), place(k, 2)]).collect()))
}

fn arrow(
    mesh: &MeshView<'_>,
    vectors: [&[f64]; 3],
    field: Option<FieldView<'_>>,
    (p, place): ([f64; 3], Place),
) -> Option<Arrow> {
    let vector = DVec3::from(vectors.map(|component| place.interpolate(mesh, component)));
    let magnitude = vector.length();
    let value = field.map_or(magnitude, |field| place.interpolate(mesh, field));
    (magnitude > 0.0 && magnitude.is_finite()).then(|| Arrow {
        middle: p.into(),
        vector,
        magnitude,
        of: (value, place),
    })
}
