//! The points in buckets, as they are written in a part: for each tetrahedron how many there are, then all records, bucket by bucket, each from
//! the last one that was put there to the first.

use super::PartsError;
use super::plan::Plan;
use super::wire::{Frame, read_by, write_by};
use crate::error::stored_points::{RecordLayout, StoredPoint, StoredPoints};
use crate::scratch::Scratch;
use std::io::{self, Read, Write};
use tetralod::geom::ON_LATTICE;

/// So many records are read and written at a time.
const AT_A_TIME: u64 = 1 << 12;

/// Points in buckets, and the records of those that are outside of their tetrahedra.
pub(super) type PointsInBuckets<'s> = (StoredPoints<'s>, Vec<u8>);

/// Writes the frame of a part's points.
pub(super) fn write(out: &mut dyn Write, points: &StoredPoints<'_>) -> Result<(), PartsError> {
    write_by(out, |out| {
        let tets = 0..points.tets() as u32;
        tets.clone().try_for_each(|t| out.write_all(&(points.count(t) as u32).to_le_bytes()))?;
        let mut records = Vec::new();
        for t in tets {
            let mut end = points.count(t);
            while end > 0 {
                let start = end.saturating_sub(AT_A_TIME);
                records.clear();
                points.copy(t, start..end, &mut records);
                records.rchunks_exact(points.layout.len()).try_for_each(|record| out.write_all(record))?;
                end = start;
            }
        }
        Ok(points.failure.take()?)
    })
}

/// Reads the frame of the points of a part of so many tetrahedra; what is not in memory has this name in the scratch.
pub(super) fn read<'s>(
    input: &mut dyn Read,
    plan: &Plan,
    tets: usize,
    (scratch, name): (&'s dyn Scratch, String),
) -> Result<PointsInBuckets<'s>, PartsError> {
    let layout = plan.record_layout();
    // So many are joined.
    let mut points = StoredPoints::new(layout, tets, scratch, name).one_of(8);
    let mut outside = Vec::new();
    let is_point = plan.has_points();
    let read = |frame: &mut Frame<'_>| {
        let counts: Vec<u32> = (0..tets).map(|_| read_count(frame)).collect::<io::Result<_>>()?;
        let mut records = Vec::new();
        let mut is_sound = true;
        for (t, &count) in (0..).zip(&counts) {
            let (mut left, mut extents) = (u64::from(count), Vec::new());
            while left > 0 {
                let some = left.min(AT_A_TIME);
                records.clear();
                frame.by_ref().take(some * layout.len() as u64).read_to_end(&mut records)?;
                if records.len() as u64 != some * layout.len() as u64 {
                    return Ok(None);
                }
                for record in records.chunks_exact(layout.len()) {
                    let point = StoredPoint::new(record, layout);
                    is_sound = is_sound && is_point(point);
                    if point.is_outside() {
                        outside.extend_from_slice(record);
                    }
                }
                points.store(&records, &mut extents);
                left -= some;
            }
            points.put(t, extents);
        }
        let is_sound = is_sound && io::copy(frame, &mut io::sink())? == 0;
        Ok(is_sound.then_some(()))
    };
    read_by(input, read)?;
    points.failure.take()?;
    Ok((points, outside))
}

fn read_count(frame: &mut Frame<'_>) -> io::Result<u32> {
    let mut count = [0; 4];
    frame.read_exact(&mut count)?;
    Ok(u32::from_le_bytes(count))
}

impl Plan {
    /// How points in buckets are recorded.
    pub(super) fn record_layout(&self) -> RecordLayout {
        let info = self.info();
        let least = info.lattice.step.iter().copied().fold(f64::INFINITY, f64::min);
        RecordLayout {
            fields: self.fields.len(),
            jumps: !self.jumps().is_empty(),
            // What it has moved by less stays where the lattice has put it.
            moved: info.quantization >= ON_LATTICE / 2.0 * least,
        }
    }

    /// Tells whether a record may be one of a point of the whole.
    fn has_points(&self) -> impl Fn(StoredPoint<'_>) -> bool {
        let (points, side) = (self.counts.0, self.lattice_side());
        let regions = if self.jumps().is_empty() { 1 } else { self.region_count() };
        move |point| {
            point.name() < points
                && point.position().iter().all(|x| (0..=side).contains(x))
                && point.shortest_edge() >= 0.0
                && point.own_region() < regions
                && point.own_place().is_finite()
                && point.own_values().all(f64::is_finite)
        }
    }

    /// The largest coordinate on the lattice of the whole.
    pub(super) fn lattice_side(&self) -> i32 {
        1_i32.checked_shl(self.lattice.2).filter(|_| self.lattice.2 <= 30).unwrap_or(0)
    }
}
