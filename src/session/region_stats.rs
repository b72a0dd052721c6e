//! What is known of the regions of the current mesh, one by one.

use super::Session;
use crate::mt::{ErrorCode, MultiTessellation};
use crate::view::FieldStats;

/// A region in the current mesh.
#[derive(Clone, Copy, Debug)]
pub struct RegionStats {
    /// Its number in [`Session::regions`].
    pub region: u16,
    /// Of the field that is shown, over its tetrahedra.
    pub field: FieldStats,
    /// The largest error of that field in it, as [`Session::error_in`] has it for the whole mesh, but not less than what rounding leaves.
    pub error: f64,
}

impl Session {
    /// The statistics of each region of which something is shown, in the order of [`Session::regions`]; none without regions. Takes
    /// time in proportion to the mesh.
    pub fn region_stats(&mut self) -> Vec<RegionStats> {
        self.view();
        let (Some(front), Some(mt)) = (&self.front, self.decoder.mt()) else { return Vec::new() };
        let Some(count) = mt.regions().map(|regions| regions.all.len()) else { return Vec::new() };
        let fields = FieldStats::of_regions(&self.last_view(), &self.shown_regions(), count);
        let errors = front.errors_by_region(mt, self.field, count);
        let least = mt.info().floor(self.field);
        let one = |(region, (field, error)): (u16, (FieldStats, ErrorCode))| RegionStats {
            region,
            field,
            error: error.error().max(least),
        };
        let all = (0..=u16::MAX).zip(fields.into_iter().zip(errors)).map(one);
        all.filter(|region| region.field.tetrahedra() > 0).collect()
    }
}
