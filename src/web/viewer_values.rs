//! Values of the mesh: at a point, along a segment, and how much of the volume has which of them.

use super::error::WebError;
use super::viewer::Viewer;
use crate::view::{Histogram, Probe};
use glam::DVec3;
use wasm_bindgen::prelude::wasm_bindgen;

/// The most samples of a segment, and the most bins of a histogram.
const MOST: u32 = 1 << 16;

#[wasm_bindgen]
impl Viewer {
    /// What is known of the current mesh at a point, in model units: as [`Viewer::probe`]; nothing outside of the mesh.
    pub fn reading(&mut self, x: f64, y: f64, z: f64) -> Result<Option<Box<[f64]>>, WebError> {
        self.reading_at([x, y, z])
    }

    /// The field at evenly spaced points of the segment between two points, its ends among them; NaN outside of the mesh. `ends` are
    /// six coordinates in model units.
    pub fn profile(&mut self, ends: &[f64], samples: u32) -> Result<Box<[f64]>, WebError> {
        let &[x0, y0, z0, x1, y1, z1] = ends else {
            return Err(WebError::bad_option("from", "must be three numbers, and `to` as well"));
        };
        demand(ends.iter().all(|x| x.is_finite()), "from", "must be finite numbers, and `to` as well")?;
        demand((2..=MOST).contains(&samples), "samples", "must be 2 to 65536")?;
        self.file.info()?;
        let mut probe = Probe::new(self.file.session_mut().view());
        let (from, to) = (DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1));
        let value = |i: u32| {
            let place = probe.locate(from.lerp(to, f64::from(i) / f64::from(samples - 1)).into());
            place.map_or(f64::NAN, |place| place.value(probe.mesh()))
        };
        Ok((0..samples).map(value).collect())
    }

    /// The volume in each of so many bins between two values, which are those of the field's range where they are NaN; in front of
    /// them the two values, and the values below which the given fractions of the volume lie.
    pub fn histogram(
        &mut self,
        bins: u32,
        low: f64,
        high: f64,
        fractions: &[f64],
    ) -> Result<Box<[f64]>, WebError> {
        let field = self.file.session().field();
        let field = &self.file.info()?.fields[field];
        let low = if low.is_nan() { field.min } else { low };
        let high = if high.is_nan() { field.min + field.range() } else { high };
        let is_range = low.is_finite() && high.is_finite() && low < high;
        demand(is_range, "range", "must be two finite numbers, the smaller first")?;
        demand((1..=MOST).contains(&bins), "bins", "must be 1 to 65536")?;
        let mut histogram = Histogram::new(low, high, bins as usize);
        histogram.add_mesh(&self.file.session_mut().view());
        let mut numbers = vec![low, high];
        for fraction in fractions {
            numbers.push(histogram.percentile(*fraction));
        }
        numbers.extend_from_slice(&histogram.volumes());
        Ok(numbers.into())
    }
}

/// Refuses an option that is not as it must be.
#[inline(never)]
fn demand(holds: bool, name: &str, problem: &str) -> Result<(), WebError> {
    if holds { Ok(()) } else { Err(WebError::bad_option(name, problem)) }
}
