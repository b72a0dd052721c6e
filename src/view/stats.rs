//! Numbers about a field over a mesh, exact for the field that is linear in every tetrahedron.

use crate::mesh::{Histogram, NONE, Sum, volume_of};
use crate::view::MeshView;

/// Volume and moments of a field, summed up over tetrahedra.
#[derive(Clone, Copy, Debug)]
pub struct FieldStats {
    tetrahedra: u32,
    volume: Sum,
    /// The first value. Sums are of differences from it: squares of values in a narrow range far from 0 have no digits for that.
    base: f64,
    /// Squares are of differences in this unit, so that those of very large or small ones keep their place.
    unit: f64,
    integral: Sum,
    squares: Sum,
    min: f64,
    max: f64,
}

impl Default for FieldStats {
    fn default() -> Self {
        Self {
            tetrahedra: 0,
            volume: Sum::default(),
            base: f64::NAN,
            unit: 0.0,
            integral: Sum::default(),
            squares: Sum::default(),
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
        }
    }
}

impl FieldStats {
    /// The statistics of a mesh.
    ///
    /// # Panics
    /// If the mesh names a point that it does not have.
    pub fn of(mesh: &MeshView<'_>) -> Self {
        let mut stats = Self::default();
        each_tet(mesh, |_, corners, values| stats.add(corners, values));
        stats
    }

    /// The statistics of each of so many regions, given the region of each tetrahedron.
    ///
    /// # Panics
    /// If the mesh names a point that it does not have, or a tetrahedron has no region, or one beyond `count`.
    pub fn of_regions(mesh: &MeshView<'_>, regions: &[u16], count: usize) -> Vec<Self> {
        let mut all = vec![Self::default(); count];
        each_tet(mesh, |t, corners, values| all[usize::from(regions[t])].add(corners, values));
        all
    }

    /// Adds a tetrahedron.
    pub fn add(&mut self, corners: [[f64; 3]; 4], values: [f64; 4]) {
        let volume = volume_of(corners);
        self.tetrahedra += 1;
        if self.base.is_nan() {
            self.base = values[0];
        }
        let differences = values.map(|value| value - self.base);
        let sum: f64 = differences.iter().sum();
        if self.unit == 0.0 {
            self.unit = unit_of(differences);
        }
        let unit = if self.unit == 0.0 { 1.0 } else { self.unit };
        let parts = differences.map(|v| v / unit);
        let (part_sum, squares): (f64, f64) = (parts.iter().sum(), parts.iter().map(|v| v * v).sum());
        self.volume.add(volume);
        self.integral.add(volume * 0.25 * sum);
        self.squares.add(volume * (part_sum * part_sum + squares) / 20.0);
        self.min = values.into_iter().fold(self.min, f64::min);
        self.max = values.into_iter().fold(self.max, f64::max);
    }

    /// How many tetrahedra there are.
    pub fn tetrahedra(&self) -> u32 {
        self.tetrahedra
    }

    /// The volume, in cubic model units.
    pub fn volume(&self) -> f64 {
        self.volume.total()
    }

    /// The integral of the field over the volume.
    pub fn integral(&self) -> f64 {
        if self.volume() > 0.0 { self.base * self.volume() + self.integral.total() } else { 0.0 }
    }

    /// The mean of the field; 0 where there is no volume.
    pub fn mean(&self) -> f64 {
        if self.volume() > 0.0 { self.base + self.mean_difference() } else { 0.0 }
    }

    /// The standard deviation of the field from its mean over the volume.
    pub fn deviation(&self) -> f64 {
        if self.volume() > 0.0 {
            let mean = if self.unit == 0.0 { 0.0 } else { self.mean_difference() / self.unit };
            (self.squares.total() / self.volume() - mean * mean).max(0.0).sqrt() * self.unit
        } else {
            0.0
        }
    }

    /// The mean of the differences from the first value.
    fn mean_difference(&self) -> f64 {
        self.integral.total() / self.volume()
    }

    /// The smallest and the largest value; infinite where there is nothing.
    pub fn range(&self) -> [f64; 2] {
        [self.min, self.max]
    }
}

/// 1 for differences of usual size; the largest of others, 0 while there is none.
fn unit_of(differences: [f64; 4]) -> f64 {
    let largest = differences.into_iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    if largest == 0.0 || (1e-100..1e100).contains(&largest) || !largest.is_finite() {
        largest.min(1.0).ceil()
    } else {
        largest
    }
}

impl Histogram {
    /// Adds a mesh.
    ///
    /// # Panics
    /// If the mesh names a point that it does not have.
    pub fn add_mesh(&mut self, mesh: &MeshView<'_>) {
        each_tet(mesh, |_, corners, values| self.add(corners, values));
    }
}

/// Calls `see` with the place of each tetrahedron in the mesh, its corners and its values.
fn each_tet(mesh: &MeshView<'_>, mut see: impl FnMut(usize, [[f64; 3]; 4], [f64; 4])) {
    for (t, tet) in mesh.tets.iter().enumerate().filter(|(_, tet)| tet[0] != NONE) {
        let corners = tet.map(|v| mesh.positions[v as usize]);
        see(t, corners, tet.map(|v| mesh.field[v as usize]));
    }
}
