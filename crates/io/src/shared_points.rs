//! Pieces that have points of their own: those at one place, or of one number, are one point, which all of these pieces have.

use std::collections::HashMap;

use crate::error::{At, ReadError};
use crate::fields::settle_unused;
use crate::numbering::Numbering;
use crate::pvtu::{Identity, Key, numbered};
use crate::vtu::{FirstFields, NumberPoints};
use tetralod::mesh::{MeshPiece, Middles, TetMesh};

/// A hash of what a point is known by.
pub(super) fn hash(key: Key) -> u64 {
    key.into_iter().fold(0, |hash, word| {
        let mixed = (hash ^ word).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        mixed ^ (mixed >> 32)
    })
}

/// The hashes that come several times, sorted.
fn repeated(mut hashes: Vec<u64>) -> Vec<u64> {
    hashes.sort_unstable();
    hashes.chunk_by(|a, b| a == b).filter(|group| group.len() > 1).map(|group| group[0]).collect()
}

/// The points that several pieces have, as far as these were read.
#[derive(Default)]
pub(super) struct SharedPoints {
    /// Hashes of the keys of all points that may be in several pieces, sorted.
    several: Vec<u64>,
    /// The first point of each of these keys: its number, and its place in `first`.
    known: HashMap<Key, (u32, usize)>,
    /// The positions of these points, and their values field by field.
    first: Vec<[f64; 3]>,
    values: Vec<f64>,
    points: usize,
    fields: FirstFields,
}

impl SharedPoints {
    /// Of pieces with points whose keys have these hashes.
    pub fn of(hashes: Vec<u64>) -> Self {
        Self { several: repeated(hashes), ..Self::default() }
    }

    /// The piece that `read` reads, given how to number its points; `place` is where its fields are.
    pub fn read(
        &mut self,
        identity: Identity<'_>,
        read: &mut dyn FnMut(NumberPoints<'_>) -> Result<TetMesh, ReadError>,
        place: &dyn Fn() -> String,
    ) -> Result<MeshPiece, ReadError> {
        let (mut numbers, mut new) = (Vec::new(), Vec::new());
        let mut mesh = read(&mut |points| {
            // Of most points it is known without a look into the table that it does not have them.
            let is_known = |key| self.several.binary_search(&hash(key)).is_ok();
            let known = |key| {
                let found = Some(key).filter(|key| is_known(*key)).and_then(|key| self.known.get(&key));
                found.map(|(number, at)| (*number, self.first[*at]))
            };
            (numbers, new) = numbered(points, identity, self.points, known)?;
            Ok(Numbering::Each { numbers: numbers.clone(), next: (self.points + new.len()) as u32 })
        })?;
        // Those that cells got in reading.
        for index in numbers.len()..mesh.positions.len() {
            numbers.push((self.points + new.len()) as u32);
            new.push(index);
        }
        self.fields.order(&mut mesh).at(place)?;
        let first = self.points as u32;
        // The points that an earlier piece has.
        let old: Vec<usize> = (0..numbers.len()).filter(|&i| numbers[i] < first).collect();
        let place: HashMap<u32, u32> = old.iter().map(|&i| (numbers[i], i as u32)).collect();
        let own = |number: u32| match number.checked_sub(first) {
            Some(rank) => new[rank as usize] as u32,
            None => place[&number],
        };
        mesh.tets.iter_mut().for_each(|tet| *tet = tet.map(own));
        let count = mesh.fields.len();
        for i in old {
            let (_, at) = self.known[&identity.key(i, mesh.positions[i])];
            mesh.positions[i] = self.first[at];
            for (f, field) in mesh.fields.iter_mut().enumerate() {
                field.values[i] = self.values[at * count + f];
            }
        }
        for &i in &new {
            let position = mesh.positions[i];
            let has_values = mesh.fields.iter().all(|field| field.values[i].is_finite());
            let key = identity.key(i, position);
            if has_values && self.several.binary_search(&hash(key)).is_ok() {
                let (number, at) = (numbers[i], self.first.len());
                if let std::collections::hash_map::Entry::Vacant(entry) = self.known.entry(key) {
                    entry.insert((number, at));
                    self.first.push(position);
                    self.values.extend(mesh.fields.iter().map(|field| field.values[i]));
                }
            }
        }
        self.points += new.len();
        settle_unused(&mut mesh);
        // A piece alone cannot know which of its points others move.
        mesh.input.middles = Middles::default();
        Ok(MeshPiece { points: numbers, mesh })
    }
}
