//! What is worth to be shown of a volume when nothing is asked for.

use super::Session;
use crate::geom::{Bounds, orient3d};
use crate::mesh::parting;
use crate::mt::{BaseMesh, Mt, MultiTessellation};

/// A domain that leaves no more than this part of its box empty counts as one: that of a flow past a small body shows as little from outside
/// as a grid. Base meshes of one domain differ by less.
const EMPTY: f64 = 0.02;
/// How far from a linear function values may be that count as its own, of their range: the isosurfaces are planes to the eye.
const STRAIGHT: f64 = 0.01;

impl Session {
    /// The value of a field whose isosurface is worth to be shown first, at all of its times: that which parts the volume at the first time
    /// into two groups of values that differ most (Otsu 1979). The middle of the range if the file has no histogram, and that of the values at the first
    /// time where these have no surface otherwise: then they are all of one group.
    ///
    /// None if there is no such field, or it has not arrived.
    pub fn first_isovalue(&self, field: usize) -> Option<f64> {
        let info = self.info()?;
        let name = &info.fields.get(field)?.name;
        let first = info.fields.iter().position(|other| other.name == *name)?;
        let [low, high] = match self.decoder.histogram(first) {
            Some(_) => [info.fields[first].min, info.fields[first].max],
            None => info.range_at_all_times(field),
        };
        let part = self.decoder.histogram(first).map_or(0.5, |shares| parting(&shares));
        let value = low * (1.0 - part) + high * part;
        let extremes = info.fields[first].extremes.as_ref();
        let extremes = extremes.map(|extremes| [extremes.min.value, extremes.max.value]);
        let beside = extremes.filter(|[least, most]| value <= *least || value >= *most);
        Some(beside.map_or(value, |[least, most]| 0.5 * least + 0.5 * most))
    }

    /// Whether an isosurface of a field shows more than the boundary, and is shown first: where the domain fills the box around it but for a
    /// fiftieth, as that of a grid, and the field is no label and not linear, so that its isosurfaces are no planes. None if there is no such field, or before
    /// the base mesh is there.
    pub fn surface_first(&self, field: usize) -> Option<bool> {
        let (mt, bounds) = (self.mt()?, self.bounds()?);
        let info = mt.info().fields.get(field)?;
        Some(!info.is_label && fills(mt, bounds) && !is_linear(mt, field))
    }
}

/// Whether the domain fills its box.
fn fills(mt: &Mt, bounds: Bounds) -> bool {
    let base = mt.base();
    let steps: i128 = base.tets.iter().map(|&tet| sixths(base, tet)).sum();
    let step: f64 = mt.info().lattice.step.iter().product();
    let volume: f64 = (0..3).map(|k| bounds.max[k] - bounds.min[k]).product();
    steps as f64 * step / 6.0 >= (1.0 - EMPTY) * volume
}

/// Whether a field is linear, as far as the base mesh shows it: its values there are those of one linear function, and nowhere in the volume
/// are there others.
fn is_linear(mt: &Mt, index: usize) -> bool {
    let (base, info) = (mt.base(), mt.info());
    let field = &info.fields[index];
    let value = |v: u32| field.value(base.values[v as usize * info.fields.len() + index]);
    let Some(largest) = base.tets.iter().max_by_key(|tet| sixths(base, **tet)) else { return false };
    let whole = sixths(base, *largest) as f64;
    let extended = |v: u32| -> f64 {
        // The shares of the corners at `v`: volumes with `v` in the place of each, which are negative beyond the opposite face.
        let replaced = |k: usize| std::array::from_fn(|i| if i == k { v } else { largest[i] });
        let share = |k: usize| sixths(base, replaced(k)) as f64 / whole;
        (0..4).map(|k| share(k) * value(largest[k])).sum()
    };
    let most = STRAIGHT * field.range();
    let vertices = 0..base.positions.len() as u32;
    let values = vertices.clone().map(value);
    let ends =
        field.extremes.as_ref().map_or([field.min, field.max], |ends| [ends.min.value, ends.max.value]);
    let here = [values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max)];
    (0..2).all(|k| (here[k] - ends[k]).abs() <= most)
        && vertices.into_iter().all(|v| (extended(v) - value(v)).abs() <= most)
}

/// The volume with its sign, in sixths of a cell of the lattice.
fn sixths(base: &BaseMesh, tet: [u32; 4]) -> i128 {
    let [a, b, c, d] = tet.map(|v| base.positions[v as usize]);
    orient3d(a, b, c, d)
}
