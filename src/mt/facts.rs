//! What is known of an MT once all of its updates have been applied, so that it need not be found out again.
//!
//! A builder of half-edge MTs notes what its pages reach, the faults of errors, and what the encoder asks of the reference mesh.

use super::{CurrentMesh, Excess, Extent, MtInfo};
use crate::mesh::Histogram;
use crate::threads;

/// Bins of the volumes by value.
pub(crate) const VOLUME_BINS: usize = 64;

/// What is known of an MT from having applied all of its updates.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct MtFacts {
    /// What each page reaches.
    pub reaches: Vec<Extent>,
    /// The first update whose error is larger than that of a parent.
    pub larger: Option<Excess>,
    /// The first whose error is too large by [`Margins`](super::Margins).
    pub excess: Option<Excess>,
    /// [`level_volumes`] of the reference mesh.
    pub volumes: Vec<f64>,
}

impl MtFacts {
    /// Takes the fault of an update, which comes after those before.
    pub fn note(&mut self, excess: Excess) {
        self.larger = self.larger.or(Some(excess).filter(|excess| excess.larger));
        self.excess = self.excess.or(Some(excess));
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        size_of::<Self>()
            + size_of_val(&self.reaches[..])
            + self.reaches.iter().map(|extent| size_of_val(&extent.ranges[..])).sum::<usize>()
            + size_of_val(&self.volumes[..])
    }
}

/// So many tetrahedra are added up together. Sums may depend on it by rounding, but not on the number of threads.
const SHARE: usize = 1 << 16;

/// [`LevelVolumes`] of a mesh.
pub(crate) fn level_volumes(info: &MtInfo, mesh: &CurrentMesh) -> Vec<f64> {
    let mut volumes = LevelVolumes::new(info);
    volumes.add(info, mesh);
    volumes.finish()
}

/// Field by field, the volume of meshes in each of [`VOLUME_BINS`] equal bins of the field's values; 1 in the first one where there is but one
/// value.
pub(crate) struct LevelVolumes(Vec<Option<Histogram>>);

impl LevelVolumes {
    /// Of no mesh yet.
    pub fn new(info: &MtInfo) -> Self {
        let empty = |field: &super::FieldInfo| {
            (field.max > field.min).then(|| Histogram::new(field.min, field.max, VOLUME_BINS))
        };
        Self(info.fields.iter().map(empty).collect())
    }

    /// Adds a mesh.
    pub fn add(&mut self, info: &MtInfo, mesh: &CurrentMesh) {
        let empty = Self::new(info).0;
        let of_ranges = threads::map(mesh.tet_slots(), SHARE, |tets| {
            let mut histograms = empty.clone();
            for tet in tets.filter_map(|t| mesh.tet(t as u32)) {
                // Shares are the same in units of the lattice.
                let corners = tet.map(|slot| mesh.positions()[slot as usize].map(f64::from));
                for (number, field) in info.fields.iter().enumerate() {
                    let Some(histogram) = &mut histograms[number] else { continue };
                    histogram.add(corners, tet.map(|slot| field.value(mesh.levels(slot)[number])));
                }
            }
            histograms
        });
        for histograms in of_ranges {
            for (sum, histogram) in self.0.iter_mut().zip(histograms) {
                let (Some(sum), Some(histogram)) = (sum, histogram) else { continue };
                sum.merge(&histogram);
            }
        }
    }

    /// Field by field and bin by bin.
    pub fn finish(self) -> Vec<f64> {
        let volumes = |histogram: Option<Histogram>| {
            let mut volumes = vec![0.0; VOLUME_BINS];
            volumes[0] = 1.0;
            if let Some(histogram) = histogram {
                volumes = histogram.volumes();
                // Rounding may have moved values beyond the ends.
                let [below, above] = histogram.outside();
                volumes[0] += below;
                volumes[VOLUME_BINS - 1] += above;
            }
            volumes
        };
        self.0.into_iter().flat_map(volumes).collect()
    }
}
