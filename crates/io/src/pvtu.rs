//! VTK XML data sets in several files (`.pvtu`, `.pvti`, `.pvtr`, `.pvts`): a list of files beside it with a piece each, as
//! parallel programs write them. What follows is of unstructured grids; the pieces of others say where they belong.
//!
//! Points of different pieces that lie in exactly the same place are one point of the mesh, so that pieces meet; points of
//! one piece stay different. Cells are split with the numbers of the whole mesh, on which both sides of an interface agree.
//! Cells that a piece repeats of another (VTK's ghosts) are left out.

use std::collections::{HashMap, HashSet};

use crate::cells::Numbering;
use crate::error::{At, ReadError, ReadReason, in_file};
use crate::file_kind::without_mark;
use crate::vtu::{NumberPoints, PieceReader, first_number, join};
use crate::xml::{Document, IN_FILES, ReadFile};
use crate::{Beside, MemoryLimit, ReadOptions, packed};
use tetralod::geom::bits_of;
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

/// Has `read` read the files that are listed, one after the other; returns the time of the first one that has one.
pub(super) fn for_each_file(
    document: &Document<'_>,
    beside: Beside<'_>,
    memory: &MemoryLimit,
    read: ReadFile<'_>,
) -> Result<Option<f64>, ReadError> {
    let mut time = None;
    for (number, piece) in document.pieces.iter().enumerate() {
        let missing = || ReadReason::Missing("attribute Source".into());
        let source = piece.attributes.get("Source").ok_or_else(missing).at(|| format!("piece {number}"))?;
        let bytes = beside(source).at(|| format!("piece {number}"))?;
        let bytes = packed::unpacked(&bytes, memory).at(|| format!("piece {number}"))?;
        let mut read_file = || {
            let mut file = Document::parse(without_mark(&bytes))?;
            source.clone_into(&mut file.name);
            if document.kind.strip_prefix(IN_FILES) != Some(&file.kind) {
                let what = format!("a piece of type {}", file.kind);
                let remedy = format!("list files of type {}", document.kind.trim_start_matches(IN_FILES));
                return Err(ReadReason::Unsupported { what, remedy }).at(String::new);
            }
            read(&file)?;
            Ok(file.time())
        };
        let of_file = read_file().map_err(|error| in_file(error, source))?;
        time = time.or(of_file);
    }
    Ok(time)
}

/// What was read of the pieces so far.
#[derive(Default)]
pub(super) struct Whole {
    pub mesh: TetMesh,
    /// The first point at each place.
    known: HashMap<[u64; 3], u32>,
    has_pieces: bool,
}

impl Whole {
    /// Appends the pieces in a file.
    fn append(&mut self, document: &Document<'_>, options: &ReadOptions) -> Result<(), ReadError> {
        for (number, piece) in document.full_pieces() {
            let reader = PieceReader { document, piece, number, options };
            let place = || format!("piece {number}, <PointData>");
            self.add(&mut |numbers| reader.read(numbers), &place)?;
        }
        Ok(())
    }

    /// Appends the piece that `read` reads, given how to number its points; `place` is where its fields are.
    pub fn add(
        &mut self,
        read: &mut dyn FnMut(NumberPoints<'_>) -> Result<TetMesh, ReadError>,
        place: &dyn Fn() -> String,
    ) -> Result<(), ReadError> {
        let first = self.mesh.positions.len();
        // The points that no earlier piece has.
        let mut new = Vec::new();
        let mut part = read(&mut |points| {
            let numbers;
            (numbers, new) = self.numbered(points, first)?;
            Ok(Numbering::Each(numbers))
        })?;
        keep(&mut part.positions, &new);
        part.fields.iter_mut().for_each(|field| keep(&mut field.values, &new));
        for (number, (at, point)) in (first as u32..).zip(part.positions.iter().enumerate()) {
            // Points that no cell uses may have no values; another piece has them.
            if part.fields.iter().all(|field| field.values[at].is_finite()) {
                self.known.entry(bits(*point)).or_insert(number);
            }
        }
        let is_first = !std::mem::replace(&mut self.has_pieces, true);
        join(&mut self.mesh, part, is_first).at(place)
    }

    /// The numbers of a piece's points, and which of them are new, from number `first` on.
    fn numbered(&self, points: &[[f64; 3]], first: usize) -> Result<(Vec<u32>, Vec<usize>), ReadReason> {
        first_number(first, points.len())?;
        let (mut numbers, mut new, mut taken) = (Vec::new(), Vec::new(), HashSet::new());
        for (index, point) in points.iter().enumerate() {
            let known = self.known.get(&bits(*point)).copied().filter(|&number| taken.insert(number));
            numbers.push(known.unwrap_or((first + new.len()) as u32));
            if known.is_none() {
                new.push(index);
            }
        }
        Ok((numbers, new))
    }
}

/// The bits of a position.
pub(super) fn bits(point: [f64; 3]) -> [u64; 3] {
    point.map(bits_of)
}

/// Keeps the values with these indices, which ascend.
fn keep<T: Copy>(values: &mut Vec<T>, indices: &[usize]) {
    *values = indices.iter().map(|&i| values[i]).collect();
}
