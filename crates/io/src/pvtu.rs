//! VTK XML data sets in several files (`.pvtu`, `.pvti`, `.pvtr`, `.pvts`): a list of files beside it with a piece each, as
//! parallel programs write them. What follows is of unstructured grids; the pieces of others say where they belong.
//!
//! Points of different pieces that lie in exactly the same place are one point of the mesh, so that pieces meet; points of
//! one piece stay different. Cells are split with the numbers of the whole mesh, on which both sides of an interface agree.
//! Cells that a piece repeats of another (VTK's ghosts) are left out.

use std::collections::{HashMap, HashSet};

use crate::error::{At, ReadError, ReadReason};
use crate::listed::for_each_file;
use crate::numbering::Numbering;
use crate::options::{Beside, ReadOptions};
use crate::vtu::{NumberPoints, first_number, join, readers};
use crate::xml::Document;
use tetralod::geom::{Bounds, bits_of};
use tetralod::mesh::TetMesh;

/// Reads a document of type `PUnstructuredGrid`, and the time of its pieces.
pub(super) fn read(
    document: &Document<'_>,
    options: &ReadOptions,
    beside: Beside<'_>,
) -> Result<(TetMesh, Option<f64>), ReadError> {
    let mut whole = Whole::default();
    let time = for_each_file(document, beside, &options.memory, &mut |file| whole.append(file, options))?;
    Ok((whole.mesh, time))
}

/// What was read of the pieces so far.
#[derive(Default)]
pub(super) struct Whole {
    pub mesh: TetMesh,
    /// The first point at each place.
    known: HashMap<Key, u32>,
    has_pieces: bool,
}

impl Whole {
    /// Appends the pieces in a file.
    fn append(&mut self, document: &Document<'_>, options: &ReadOptions) -> Result<(), ReadError> {
        for reader in readers(document, options) {
            let place = || format!("{}, <PointData>", reader.place());
            self.add(Identity::Places, &mut |numbers| reader.read(numbers), &place)?;
        }
        Ok(())
    }

    /// Appends the piece that `read` reads, given how to number its points; `place` is where its fields are.
    pub fn add(
        &mut self,
        identity: Identity<'_>,
        read: &mut dyn FnMut(NumberPoints<'_>) -> Result<TetMesh, ReadError>,
        place: &dyn Fn() -> String,
    ) -> Result<(), ReadError> {
        let first = self.mesh.positions.len();
        // The points that no earlier piece has.
        let (mut new, mut count) = (Vec::new(), 0);
        let mut part = read(&mut |points| {
            let numbers;
            let known =
                |key| self.known.get(&key).map(|&number| (number, self.mesh.positions[number as usize]));
            (numbers, new) = numbered(points, identity, first, known)?;
            count = points.len();
            Ok(Numbering::Each { numbers, next: (first + new.len()) as u32 })
        })?;
        // Those that cells got in reading.
        new.extend(count..part.positions.len());
        keep(&mut part.positions, &new);
        part.fields.iter_mut().for_each(|field| keep(&mut field.values, &new));
        for (number, (at, point)) in (first as u32..).zip(part.positions.iter().enumerate()) {
            // Points that no cell uses may have no values; another piece has them.
            if part.fields.iter().all(|field| field.values[at].is_finite()) {
                self.known.entry(identity.key(new[at], *point)).or_insert(number);
            }
        }
        let is_first = !std::mem::replace(&mut self.has_pieces, true);
        join(&mut self.mesh, part, is_first).at(place)
    }
}

/// What a point is known by in all pieces that have it.
pub(super) type Key = [u64; 3];

/// What makes points of different pieces one.
#[derive(Clone, Copy)]
pub(super) enum Identity<'a> {
    /// Their places.
    Places,
    /// Their numbers in the whole; of points that have none, their places.
    #[cfg_attr(not(feature = "hdf5"), expect(dead_code, reason = "only a format of this feature has them"))]
    Numbers(&'a [i64]),
}

impl Identity<'_> {
    /// The key of a piece's point.
    pub fn key(self, index: usize, place: [f64; 3]) -> Key {
        match self {
            Self::Numbers(numbers) if index < numbers.len() => key_of(numbers[index]),
            _ => bits(place),
        }
    }
}

/// The key of a point with a number: that of no place, whose coordinates are finite.
pub(super) fn key_of(number: i64) -> Key {
    [number as u64, u64::MAX, u64::MAX]
}

/// Points of one number may lie this far apart, as a part of a piece's diagonal: programs round differently.
const SAME_PLACE: f64 = 1e-6;

/// The numbers of a piece's points, and which of them are new, from number `first` on; `known` gives the number and the place of a point with
/// a key. Points of one piece stay different.
pub(super) fn numbered(
    points: &[[f64; 3]],
    identity: Identity<'_>,
    first: usize,
    known: impl Fn(Key) -> Option<(u32, [f64; 3])>,
) -> Result<(Vec<u32>, Vec<usize>), ReadReason> {
    first_number(first, points.len())?;
    let (mut numbers, mut new, mut taken) = (Vec::new(), Vec::new(), HashSet::new());
    let far = match identity {
        Identity::Places => f64::INFINITY,
        Identity::Numbers(_) => SAME_PLACE * Bounds::of(points).diagonal(),
    };
    for (index, &point) in points.iter().enumerate() {
        let known = known(identity.key(index, point)).filter(|(number, _)| taken.insert(*number));
        if let (Some((_, place)), Identity::Numbers(names)) = (known, identity)
            && (0..3).any(|i| (place[i] - point[i]).abs() > far)
        {
            let name = names.get(index).copied().unwrap_or_default();
            let what = format!("point {name} lies at {point:?}, but in an earlier piece at {place:?}");
            return Err(ReadReason::Syntax(what));
        }
        numbers.push(known.map_or((first + new.len()) as u32, |(number, _)| number));
        if known.is_none() {
            new.push(index);
        }
    }
    Ok((numbers, new))
}

/// The bits of a position.
pub(super) fn bits(point: [f64; 3]) -> Key {
    point.map(bits_of)
}

/// Keeps the values with these indices, which ascend.
fn keep<T: Copy>(values: &mut Vec<T>, indices: &[usize]) {
    *values = indices.iter().map(|&i| values[i]).collect();
}
