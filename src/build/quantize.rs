//! The input on integer lattices: positions and field levels.

use super::BuildConfig;
use super::BuildError;
use super::choice;
use super::place;
use super::place::Placed;
use super::precision;
use crate::geom::Lattice;
use crate::geom::WIDE_BITS;
use crate::mesh::Field;
use crate::mesh::TetMesh;
use crate::mt::FieldInfo;
use crate::mt::MtInfo;
use glam::DVec3;

/// The reference mesh on its lattices.
pub(super) struct Quantized {
    pub lattice: Lattice,
    pub fields: Vec<FieldInfo>,
    pub positions: Vec<[i32; 3]>,
    /// `levels[point * fields + f]`.
    pub levels: Vec<i32>,
    /// The input's values in units of levels, not rounded; errors are measured against these.
    pub exact: Vec<f64>,
    /// How far the lattice moves a point at most: see [`MtInfo::quantization`](crate::mt::MtInfo::quantization).
    pub quantization: f64,
}

impl Quantized {
    /// The level of field `f` at point `v`.
    pub fn level(&self, v: u32, f: usize) -> i32 {
        self.levels[v as usize * self.fields.len() + f]
    }

    /// How far the value of field `f` at `v` exceeds the range of those at the points around it, as a fraction of the
    /// field's range. Added to inherited errors it makes the selection by isovalue monotone.
    pub fn overshoot<'a>(&self, v: u32, around: impl IntoIterator<Item = &'a u32>, f: usize) -> f64 {
        let field = &self.fields[f];
        let levels = around.into_iter().map(|&w| self.level(w, f));
        let (low, high) = levels.fold((i32::MAX, i32::MIN), |(low, high), x| (low.min(x), high.max(x)));
        let own = self.level(v, f);
        let beyond = (own - high).max(low - own).max(0);
        f64::from(beyond) * field.step / field.range() * (1.0 + 1e-9)
    }

    /// Raises the error of each field to the deviation, as a fraction of its range, of the value that is interpolated at a
    /// point from the true one; returns the largest of these deviations. `lambda` has the point's barycentric coordinates
    /// but for the first one, `corners` gives the levels of a field.
    pub fn deviation(
        &self,
        point: u32,
        lambda: DVec3,
        corners: impl Fn(usize) -> [i32; 4],
        errors: &mut [f64],
    ) -> f64 {
        let own = 1.0 - lambda.element_sum();
        let mut largest = 0.0_f64;
        for (f, field) in self.fields.iter().enumerate() {
            let [w, x, y, z] = corners(f).map(f64::from);
            let value = own * w + lambda.x * x + lambda.y * y + lambda.z * z;
            let exact = self.exact[point as usize * self.fields.len() + f];
            let error = (value - exact).abs() * field.step / field.range();
            errors[f] = errors[f].max(error);
            largest = largest.max(error);
        }
        largest
    }

    /// The average gradient of each field at each point, in levels per lattice step: averages of the tetrahedra's
    /// gradients, weighted by volume.
    pub fn gradients(&self, tets: &[[u32; 4]]) -> Vec<DVec3> {
        let (vertices, fields) = (self.positions.len(), self.fields.len());
        let mut sums = vec![DVec3::ZERO; vertices * fields];
        let mut volumes = vec![0.0; vertices];
        for tet in tets {
            let [a, b, c, d] = tet.map(|v| DVec3::from_array(self.positions[v as usize].map(f64::from)));
            let (u, v, w) = (b - a, c - a, d - a);
            let volume = u.cross(v).dot(w);
            for f in 0..fields {
                let [l0, l1, l2, l3] = tet.map(|v| f64::from(self.levels[v as usize * fields + f]));
                // Six times the volume times the gradient; the volume cancels in the weighted average.
                let weighted = v.cross(w) * (l1 - l0) + w.cross(u) * (l2 - l0) + u.cross(v) * (l3 - l0);
                tet.iter().for_each(|&v| sums[v as usize * fields + f] += weighted);
            }
            tet.iter().for_each(|&v| volumes[v as usize] += volume);
        }
        sums.iter()
            .enumerate()
            .map(|(i, sum)| *sum / f64::max(volumes[i / fields], f64::MIN_POSITIVE))
            .collect()
    }
}

/// Puts the points on a lattice that keeps the cells positive or, where there are none, the points apart.
pub(super) fn quantize(mesh: &TetMesh, config: &BuildConfig) -> Result<Quantized, BuildError> {
    if config.position_bits.is_some_and(|bits| !(1..=WIDE_BITS).contains(&bits)) {
        return Err(BuildError::Option { name: "position-bits", expected: "1 to 30" });
    }
    let chosen = choice::fields(mesh, config)?;
    check_finite(mesh, &chosen)?;
    let Placed { lattice, positions } = place::place(mesh, config)?;
    let fields = precision::field_lattices(&chosen, config)?;
    let per_point = |i: usize| chosen.iter().zip(&fields).map(move |(field, info)| (field.values[i], info));
    let points = 0..mesh.positions.len();
    let levels = points.clone().flat_map(|i| per_point(i).map(|(value, info)| info.nearest(value))).collect();
    let exact = points.flat_map(|i| per_point(i).map(|(x, info)| (x - info.origin) / info.step)).collect();
    let quantization = place::largest_move(mesh, &lattice, &positions);
    Ok(Quantized { lattice, fields, positions, levels, exact, quantization })
}

/// The error that is left at full resolution, of whichever field has the largest.
pub(super) fn floors(info: &MtInfo) -> Vec<f64> {
    (0..info.fields.len()).map(|f| info.floor(f)).collect()
}

fn check_finite(mesh: &TetMesh, fields: &[&Field]) -> Result<(), BuildError> {
    let sound = |i: usize| {
        mesh.positions[i].iter().all(|x| x.is_finite())
            && fields.iter().all(|field| field.values.get(i).is_some_and(|x| x.is_finite()))
    };
    match (0..mesh.positions.len()).find(|&i| !sound(i)) {
        Some(point) => Err(BuildError::NotFinite { point: point as u32 }),
        None => Ok(()),
    }
}
