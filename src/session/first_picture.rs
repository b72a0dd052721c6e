//! What is worth to be shown of a volume when nothing is asked for.

use super::Session;
use crate::geom::orient3d;
use crate::mesh::parting;
use crate::mt::MultiTessellation;

/// A domain that leaves no more than this part of its box empty counts as one: that of a flow past a small body shows as little from outside
/// as a grid. Base meshes of one domain differ by less.
const EMPTY: f64 = 0.02;

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

    /// Whether the domain fills the box around it but for a fiftieth, as that of a grid: then its boundary shows little. None before the base mesh is there.
    pub fn is_box(&self) -> Option<bool> {
        let (mt, bounds) = (self.mt()?, self.bounds()?);
        let base = mt.base();
        let corners = base.tets.iter().map(|tet| tet.map(|v| base.positions[v as usize]));
        let steps: f64 = corners.map(|[a, b, c, d]| orient3d(a, b, c, d) as f64).sum();
        let step: f64 = mt.info().lattice.step.iter().product();
        let volume: f64 = (0..3).map(|k| bounds.max[k] - bounds.min[k]).product();
        Some(steps * step / 6.0 >= (1.0 - EMPTY) * volume)
    }
}
