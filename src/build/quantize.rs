//! The input on integer lattices: positions and field levels.

use super::BuildConfig;
use super::BuildError;
use crate::geom::Bounds;
use crate::geom::Lattice;
use crate::geom::WIDE_BITS;
use crate::geom::orient3d;
use crate::mesh::Field;
use crate::mesh::Grid;
use crate::mesh::TetMesh;
use crate::mt::FieldInfo;
use crate::mt::MAX_FIELD_BITS;
use glam::DVec3;

/// The fewest position bits that are tried unless the caller says otherwise.
const FEWEST_BITS: u32 = 16;
/// Bits added to the fewest that keep every cell positive, so that thin cells keep their shape, too.
const SPARE_BITS: u32 = 2;

/// The reference mesh on its lattices.
pub(super) struct Quantized {
    pub lattice: Lattice,
    pub fields: Vec<FieldInfo>,
    pub positions: Vec<[i32; 3]>,
    /// `levels[point * fields + f]`.
    pub levels: Vec<i32>,
    /// The input's values in units of levels, not rounded; errors are measured against these.
    pub exact: Vec<f64>,
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
    if !(1..=MAX_FIELD_BITS).contains(&config.field_bits) {
        return Err(BuildError::Option { name: "field-bits", expected: "1 to 24" });
    }
    if config.position_bits.is_some_and(|bits| !(1..=WIDE_BITS).contains(&bits)) {
        return Err(BuildError::Option { name: "position-bits", expected: "1 to 30" });
    }
    let chosen = choose_fields(mesh, config)?;
    check_finite(mesh, &chosen)?;
    let (lattice, positions) = place(mesh, config.position_bits)?;
    let fields: Vec<FieldInfo> = chosen.iter().map(|field| field_lattice(field, config.field_bits)).collect();
    let per_point = |i: usize| chosen.iter().zip(&fields).map(move |(field, info)| (field.values[i], info));
    let points = 0..mesh.positions.len();
    let levels = points.clone().flat_map(|i| per_point(i).map(|(value, info)| info.nearest(value))).collect();
    let exact = points.flat_map(|i| per_point(i).map(|(x, info)| (x - info.origin) / info.step)).collect();
    Ok(Quantized { lattice, fields, positions, levels, exact })
}

fn choose_fields<'a>(mesh: &'a TetMesh, config: &BuildConfig) -> Result<Vec<&'a Field>, BuildError> {
    if config.fields.is_empty() {
        return Ok(vec![mesh.fields.first().ok_or(BuildError::NoField)?]);
    }
    let find = |name: &String| {
        mesh.fields.iter().find(|field| field.name == *name).ok_or_else(|| BuildError::UnknownField {
            name: name.clone(),
            known: mesh.fields.iter().map(|field| field.name.clone()).collect(),
        })
    };
    config.fields.iter().map(find).collect()
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

fn field_lattice(field: &Field, bits: u32) -> FieldInfo {
    let (min, max) = field
        .values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)));
    let range = if max > min { max - min } else { 1.0 };
    let step = range / f64::from((1_u32 << bits) - 1);
    FieldInfo { name: field.name.clone(), min, max, origin: min, step, bits }
}

/// Puts points without cells on the coarsest lattice of at least [`FEWEST_BITS`] that keeps them apart. Where the finest
/// does not, two are in the same place in the input.
fn place_points(mesh: &TetMesh) -> (Lattice, Vec<[i32; 3]>) {
    let on = |bits: u32| {
        let lattice = lattice(mesh, bits);
        let positions: Vec<[i32; 3]> = mesh.positions.iter().map(|&p| lattice.nearest(p)).collect();
        (lattice, positions)
    };
    let is_apart = |positions: &[[i32; 3]]| {
        let mut sorted = positions.to_vec();
        sorted.sort_unstable();
        sorted.windows(2).all(|pair| pair[0] != pair[1])
    };
    let found = (FEWEST_BITS..WIDE_BITS).map(on).find(|(_, positions)| is_apart(positions));
    found.unwrap_or_else(|| on(WIDE_BITS))
}

/// Puts the points on a lattice that keeps every cell positive: that of `wanted` bits or, if nothing is wanted, the
/// coarsest one of at least [`FEWEST_BITS`], with [`SPARE_BITS`] more where it had to be finer.
fn place(mesh: &TetMesh, wanted: Option<u32>) -> Result<(Lattice, Vec<[i32; 3]>), BuildError> {
    if mesh.tets.is_empty() && wanted.is_none() {
        return Ok(place_points(mesh));
    }
    let on = |bits: u32| {
        let lattice = lattice(mesh, bits);
        let positions: Vec<[i32; 3]> = mesh.positions.iter().map(|&p| lattice.nearest(p)).collect();
        let flat = mesh.tets.iter().position(|tet| {
            let [a, b, c, d] = tet.map(|v| positions[v as usize]);
            orient3d(a, b, c, d) <= 0
        });
        (lattice, positions, flat)
    };
    let fewest = wanted.unwrap_or(FEWEST_BITS);
    let mut bits = fewest;
    loop {
        let (lattice, positions, flat) = on(bits);
        match flat {
            None if bits > fewest && bits + SPARE_BITS <= WIDE_BITS => {
                let (finer, moved, still_flat) = on(bits + SPARE_BITS);
                return Ok(if still_flat.is_none() { (finer, moved) } else { (lattice, positions) });
            }
            None => return Ok((lattice, positions)),
            Some(cell) if wanted.is_some() || bits == WIDE_BITS => {
                return Err(BuildError::TooThin { cell: cell as u32, bits });
            }
            Some(_) => bits += 1,
        }
    }
}

/// The lattice of `bits` over the mesh: on the points of a regular grid, else with equal steps along all axes.
fn lattice(mesh: &TetMesh, bits: u32) -> Lattice {
    if let Some(lattice) = mesh.grid.and_then(|grid| grid_lattice(&grid, bits)) {
        return lattice;
    }
    let bounds = Bounds::of(&mesh.positions);
    let largest = bounds.extent().into_iter().fold(0.0, f64::max);
    let step = if largest > 0.0 { largest / f64::from(1_u32 << bits) } else { 1.0 };
    Lattice { origin: bounds.min, step: [step; 3], bits }
}

/// A lattice that holds every point of the grid exactly, with as many steps to a cell as a power of two can be.
fn grid_lattice(grid: &Grid, bits: u32) -> Option<Lattice> {
    let cells = grid.dims.iter().map(|n| n.saturating_sub(1)).max().filter(|&n| n > 0)?;
    let needed = u32::BITS - (cells - 1).leading_zeros();
    let spare = bits.checked_sub(needed)?;
    let step = grid.spacing.map(|s| s / f64::from(1_u32 << spare));
    Some(Lattice { origin: grid.origin, step, bits })
}
