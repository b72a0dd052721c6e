//! How much the field of one mesh differs from that of another one of the same domain: coarse against fine.

use crate::geom::{TriangleGrid, weights_on_triangle};
use crate::mesh::{BitSet, NONE};
use crate::view::{BoundarySurface, FieldStats, MeshView, Place, Probe};
use glam::DVec3;

/// The field of one mesh minus that of another one.
///
/// ```
/// use tetralod::mesh::NONE;
/// use tetralod::view::{Difference, MeshView};
///
/// let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// let (tets, neighbors) = ([[0, 1, 2, 3]], [[NONE; 4]]);
/// let mesh = |field| MeshView { positions: &positions, field, tets: &tets, neighbors: &neighbors, is_label: false };
/// let difference = Difference::of(&mesh(&[3.0; 4]), mesh(&[1.0; 4])).expect("there is a tetrahedron");
/// assert_eq!((difference.values, difference.largest), (vec![2.0; 4], 2.0));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Difference {
    /// One number for each point of the first mesh, in units of the field.
    pub values: Vec<f64>,
    /// The root of the mean square over the volume of the first mesh, of what is linear between the values; 0
    /// without a volume.
    pub root_mean_square: f64,
    /// The largest absolute value; 0 if there is none.
    pub largest: f64,
    /// Points of the first mesh outside of the second one: these are compared with the nearest point of its
    /// boundary.
    pub outside: usize,
}

impl Difference {
    /// The field of `mesh` at each of its points minus the field of `other` there; none if `other` has no
    /// tetrahedra.
    ///
    /// At points whose coordinates are not finite the value is NaN, and counts for nothing in
    /// [`Difference::largest`]; if a tetrahedron names such a point, the mean square is NaN.
    ///
    /// # Panics
    /// If a mesh names a point or a neighbour that it does not have.
    pub fn of(mesh: &MeshView<'_>, other: MeshView<'_>) -> Option<Self> {
        Self::within(mesh, other, f64::INFINITY)
    }

    /// The same, but the value is NaN at points that are farther than `reach` outside of `other`. Then the mean square is NaN, too.
    ///
    /// # Panics
    /// As [`Difference::of`].
    pub fn within(mesh: &MeshView<'_>, other: MeshView<'_>, reach: f64) -> Option<Self> {
        if other.tets.is_empty() {
            return None;
        }
        let mut boundary = None;
        let mut probe = Probe::new(other);
        let sought = inner_places(mesh);
        let places = probe.locate_all(&sought);
        let mut outside = 0;
        let mut values = Vec::with_capacity(mesh.positions.len());
        for (((p, sought), place), own) in mesh.positions.iter().zip(sought).zip(places).zip(mesh.field) {
            let beside = |place: Place| {
                if *p == sought { place } else { probe.place_in(place.tet, *p).unwrap_or(place) }
            };
            let there = match place.map(beside) {
                Some(place) => place.value(&other),
                None => {
                    outside += 1;
                    let boundary = boundary.get_or_insert_with(|| Boundary::of(&other)).as_ref()?;
                    let (value, distance) = boundary.nearest(*p);
                    if distance > reach { f64::NAN } else { value }
                }
            };
            values.push(own - there);
        }
        let stats = FieldStats::of(&MeshView { field: &values, is_label: false, ..*mesh });
        // Both are over the same volume, so their squares add up.
        let square = stats.mean() * stats.mean() + stats.deviation() * stats.deviation();
        let largest = values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        Some(Self { values, root_mean_square: square.sqrt(), largest, outside })
    }
}

/// Where to look for the points of a mesh: those that others are at the same place as, as the points of regions are, a little inside of one of
/// their tetrahedra.
fn inner_places(mesh: &MeshView<'_>) -> Vec<[f64; 3]> {
    let mut places = mesh.positions.to_vec();
    let key = |v: &u32| mesh.positions[*v as usize].map(f64::to_bits);
    let mut order: Vec<u32> = (0..places.len() as u32).collect();
    order.sort_unstable_by_key(key);
    let mut is_shared = BitSet::default();
    for group in order.chunk_by(|a, b| key(a) == key(b)).filter(|group| group.len() > 1) {
        group.iter().for_each(|v| _ = is_shared.insert(*v));
    }
    for tet in mesh.tets.iter().filter(|tet| tet[0] != NONE) {
        let corners = tet.map(|v| DVec3::from(mesh.positions[v as usize]));
        let middle = corners.into_iter().sum::<DVec3>() / 4.0;
        for (&v, p) in tet.iter().zip(corners).filter(|(v, _)| is_shared.has(**v)) {
            places[v as usize] = p.lerp(middle, INSIDE).to_array();
        }
    }
    places
}

/// How far inside, as a part of the way to the middle of the tetrahedron.
const INSIDE: f64 = 1e-3;

/// The boundary of a mesh, and its triangles by place.
struct Boundary {
    surface: BoundarySurface,
    grid: TriangleGrid,
}

impl Boundary {
    /// None for a mesh without boundary.
    fn of(mesh: &MeshView<'_>) -> Option<Self> {
        let mut surface = BoundarySurface::new();
        surface.extract(mesh);
        let corner = |v: u32| DVec3::from(surface.positions[v as usize]);
        let corners: Vec<[DVec3; 3]> = surface.indices.iter().map(|triangle| triangle.map(corner)).collect();
        let is_usable = !corners.is_empty() && corners.iter().flatten().all(|p| p.is_finite());
        is_usable.then(|| Self { surface, grid: TriangleGrid::new(corners) })
    }

    /// The value of the field at the nearest point, and how far away that is; both NaN if it is not known.
    fn nearest(&self, p: [f64; 3]) -> (f64, f64) {
        let p = DVec3::from(p);
        let Some((triangle, at)) = p.is_finite().then(|| self.grid.nearest(p)).flatten() else {
            return (f64::NAN, f64::NAN);
        };
        let weights = weights_on_triangle(at, self.grid.corners[triangle as usize]);
        let vertices = self.surface.indices[triangle as usize];
        let value = (0..3).map(|i| weights[i] * self.surface.values[vertices[i] as usize]).sum();
        (value, p.distance(at))
    }
}
