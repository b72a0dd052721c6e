//! The tetrahedra of the mesh that are shown, for readers that know nothing of others.

use super::behind::join;
use crate::mesh::{BitSet, NONE};
use crate::mt::{CurrentMesh, FieldInfo};
use std::ops::Range;

/// A range of the values of a field, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Within {
    /// The number of the field.
    pub field: usize,
    /// The least and the largest value, in units of the field.
    pub range: [f64; 2],
    /// Whether tetrahedra are cut where the field crosses an end of the range. Else those are shown as a whole whose four values are within
    /// it, and no others.
    pub is_cut: bool,
}

/// A copy of the mesh in which tetrahedra that are not shown are free slots, and no neighbours; kept up at the cost of what changed.
#[derive(Debug, Default)]
pub(super) struct ShownTets {
    /// The regions that are shown; all if there is no set.
    regions: Option<BitSet>,
    /// What their values are to be within.
    within: Option<Within>,
    /// Others have been chosen since the copy was made.
    stale: bool,
    tets: Vec<[u32; 4]>,
    neighbors: Vec<[u32; 4]>,
}

impl ShownTets {
    /// Chooses the regions; all if there is no list.
    pub fn choose_regions(&mut self, regions: Option<&[u16]>) {
        let set: Option<BitSet> =
            regions.map(|regions| regions.iter().map(|&region| region.into()).collect());
        self.stale |= set != self.regions;
        self.regions = set;
    }

    /// Chooses what values are to be within.
    pub fn choose_within(&mut self, within: Option<Within>) {
        self.stale |= within != self.within;
        self.within = within;
    }

    /// What the tetrahedra are to be cut by, if they are: those that have a value within it are here as a whole.
    pub fn cut(&self) -> Option<Within> {
        self.within.filter(|within| within.is_cut)
    }

    /// Brings the copy up to date, given the tetrahedra that have changed in the mesh since the last call. Those that have changed in the copy
    /// for another reason are added.
    pub fn update(&mut self, mesh: &CurrentMesh, fields: &[FieldInfo], changed: &mut Vec<Range<u32>>) {
        let other = std::mem::take(&mut self.stale);
        if other {
            *changed = std::iter::once(0..u32::MAX).collect();
        }
        let regions = self.regions.as_ref().filter(|_| !mesh.regions().is_empty());
        let within = self.within.and_then(|within| Some((fields.get(within.field)?, within)));
        // Nothing is copied where everything is shown.
        if regions.is_none() && within.is_none() {
            (self.tets, self.neighbors) = (Vec::new(), Vec::new());
            return;
        }
        let is_within = |t: u32| {
            within.is_none_or(|(info, Within { field, range: [low, high], is_cut })| {
                let corners = mesh.tets()[t as usize];
                let values = || corners.iter().map(|&corner| info.value(mesh.levels(corner)[field]));
                let all = |is: &dyn Fn(f64) -> bool| values().all(is);
                corners[0] != NONE
                    && if is_cut {
                        !all(&|value| value < low) && !all(&|value| value > high)
                    } else {
                        all(&|value| (low..=high).contains(&value))
                    }
            })
        };
        let is_shown =
            |t: u32| regions.is_none_or(|set| set.has(u32::from(mesh.regions()[t as usize]))) && is_within(t);
        let old = if other { 0 } else { self.tets.len().min(mesh.tets().len()) as u32 };
        let len = mesh.tets().len() as u32;
        self.tets.resize(len as usize, [NONE; 4]);
        self.neighbors.resize(len as usize, [NONE; 4]);
        let mut beside = Vec::new();
        let before = || changed.iter().flat_map(|range| range.start.min(old)..range.end.min(old));
        for t in before().chain(old..len) {
            self.tets[t as usize] = if is_shown(t) { mesh.tets()[t as usize] } else { [NONE; 4] };
        }
        // What comes into the slot of another tetrahedron may be hidden where that was shown: its neighbours have not changed for it.
        for t in before().chain(old..len) {
            let is_free = mesh.tets()[t as usize][0] == NONE;
            let around = if is_free { [NONE; 4] } else { mesh.neighbors()[t as usize] };
            for s in around.into_iter().filter(|&s| s != NONE).chain([t]) {
                let is_there = |n: u32| n != NONE && self.tets[n as usize][0] != NONE;
                let next = |n: u32| if is_there(n) { n } else { NONE };
                let own = if is_there(s) { mesh.neighbors()[s as usize].map(next) } else { [NONE; 4] };
                if std::mem::replace(&mut self.neighbors[s as usize], own) != own && s != t {
                    beside.push(s);
                }
            }
        }
        beside.sort_unstable();
        beside.dedup();
        let beside: Vec<_> = beside.into_iter().map(|s| s..s + 1).collect();
        join(changed, &beside);
    }

    /// Tetrahedra and neighbours, where not all are shown.
    pub fn tets(&self) -> Option<[&[[u32; 4]]; 2]> {
        (!self.tets.is_empty()).then_some([&self.tets[..], &self.neighbors[..]])
    }

    /// Bytes of the copy.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.tets[..]) + size_of_val(&self.neighbors[..])
    }
}
