//! Meshes in several files, piece by piece: the same mesh as that of the [whole](super::pvtu), of which no more than a piece is in memory,
//! and the points at which pieces meet.
//!
//! Files are read twice: at first for their points alone, to know which places several pieces have.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::beside::{FilesOf, place};
use crate::error::{At, ReadError, ReadReason, in_file};
use crate::fields::settle_unused;
use crate::file_kind::without_mark;
use crate::listed::{for_each_file, names};
use crate::numbering::Numbering;
use crate::pvtu::{bits, numbered};
use crate::vtu::{PieceReader, in_order};
use crate::xml::Document;
use crate::{ReadOptions, packed};
use tetralod::mesh::{Field, MeshPiece, Middles, TetMesh};

/// A mesh in several files, of which one is read at a time.
#[derive(Clone, Debug)]
pub struct Pieces {
    path: PathBuf,
    list: Vec<u8>,
    options: ReadOptions,
}

/// How much there is in pieces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PieceCounts {
    /// Points of all pieces; those that several have count in each.
    pub points: u64,
    /// Tetrahedra of all pieces, at most.
    pub tetrahedra: u64,
    /// How many pieces there are.
    pub pieces: u64,
    /// Tetrahedra of the largest piece, at most.
    pub largest: u64,
    /// Fields at points.
    pub fields: u64,
}

impl Pieces {
    /// Opens a list of the pieces of an unstructured grid (`.pvtu`); none if the file at `path` is another one.
    ///
    /// # Errors
    /// If the list cannot be read or is damaged.
    pub fn open(path: &Path, options: &ReadOptions) -> Result<Option<Self>, ReadError> {
        let bytes = FilesOf::on_disk(path, &options.memory).load_given()?;
        let bytes = packed::unpacked(&bytes, &options.memory).in_file(&path.display().to_string())?.to_vec();
        if super::format_of(&bytes) != Some("pvtu") {
            return Ok(None);
        }
        Ok(Some(Self { path: path.to_owned(), list: bytes, options: options.clone() }))
    }

    /// The files with the pieces, which may not be there.
    ///
    /// # Errors
    /// If the list is damaged, or names a file elsewhere than beside it or below.
    pub fn files(&self) -> Result<Vec<PathBuf>, ReadError> {
        let document = Document::parse(without_mark(&self.list)).map_err(|error| self.named(error))?;
        let files = names(&document).iter().map(|name| place(&self.path, name)).collect::<Result<_, _>>();
        files.at(String::new).map_err(|error| self.named(error))
    }

    /// How much there is, without the values: the points of each piece, and the tetrahedra at most that its cells become.
    ///
    /// # Errors
    /// As [`read_with`](super::read_with), as far as that follows from the structure of the files.
    pub fn counts(&self) -> Result<PieceCounts, ReadError> {
        let document = Document::parse(without_mark(&self.list)).map_err(|error| self.named(error))?;
        let mut counts = PieceCounts::default();
        let files = FilesOf::on_disk(&self.path, &self.options.memory);
        let beside = |file: &str| files.load(file);
        let counted = for_each_file(&document, &beside, &self.options.memory, &mut |file| {
            self.each_reader(file, &mut |reader| {
                let points = reader.piece.attributes.count("NumberOfPoints").at(|| reader.place())?;
                let tets = reader.most_tets()?;
                counts.points = counts.points.saturating_add(points as u64);
                counts.tetrahedra = counts.tetrahedra.saturating_add(tets);
                counts.pieces += 1;
                counts.largest = counts.largest.max(tets);
                counts.fields = counts.fields.max(reader.field_names("PointData")?.len() as u64);
                Ok(())
            })
        });
        counted.map_err(|error| self.named(error))?;
        Ok(counts)
    }

    /// Reads one piece after the other, and passes it on. Together they are the mesh that [`read_with`](super::read_with) reads.
    ///
    /// # Errors
    /// As [`read_with`](super::read_with); the first error of `each`.
    pub fn for_each<E: From<ReadError>>(
        &self,
        each: &mut dyn FnMut(MeshPiece) -> Result<(), E>,
    ) -> Result<(), E> {
        let document = Document::parse(without_mark(&self.list)).map_err(|error| self.named(error))?;
        let mut failed = None;
        let read = self.read_all(&document, &mut |piece| {
            each(piece).map_err(|error| {
                failed = Some(error);
                // Never seen: the error of the caller is.
                ReadError { file: String::new(), place: String::new(), reason: ReadReason::UnknownFormat }
            })
        });
        match (failed, read) {
            (Some(error), _) => Err(error),
            (None, read) => Ok(read.map_err(|error| self.named(error))?),
        }
    }

    fn named(&self, error: ReadError) -> ReadError {
        in_file(error, &self.path.display().to_string())
    }

    fn read_all(
        &self,
        document: &Document<'_>,
        each: &mut dyn FnMut(MeshPiece) -> Result<(), ReadError>,
    ) -> Result<(), ReadError> {
        let files = FilesOf::on_disk(&self.path, &self.options.memory);
        let beside = |file: &str| files.load(file);
        let mut hashes = Vec::new();
        let time = for_each_file(document, &beside, &self.options.memory, &mut |file| {
            self.each_reader(file, &mut |reader| {
                let points = reader.piece.attributes.count("NumberOfPoints").at(|| reader.place())?;
                hashes.extend(reader.points(points)?.into_iter().map(hash));
                Ok(())
            })
        })?;
        let time = document.time().or(time);
        let mut seen = Seen { several: repeated(hashes), ..Seen::default() };
        for_each_file(document, &beside, &self.options.memory, &mut |file| {
            self.each_reader(file, &mut |reader| {
                let mut piece = seen.read(reader)?;
                let MeshPiece { mesh: TetMesh { fields, cell_fields, input, .. }, .. } = &mut piece;
                input.files.0.extend(files.last());
                fields.iter_mut().chain(cell_fields).for_each(|field| field.time = time);
                each(piece)
            })
        })?;
        Ok(())
    }

    fn each_reader(
        &self,
        document: &Document<'_>,
        read: &mut dyn FnMut(&PieceReader<'_, '_>) -> Result<(), ReadError>,
    ) -> Result<(), ReadError> {
        document.full_pieces().try_for_each(|(number, piece)| {
            // What is passed on is no longer here.
            let options = &ReadOptions { memory: self.options.memory.afresh(), ..self.options.clone() };
            read(&PieceReader { document, piece, number, options })
        })
    }
}

/// A hash of a place.
fn hash(point: [f64; 3]) -> u64 {
    bits(point).into_iter().fold(0, |hash, word| {
        let mixed = (hash ^ word).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        mixed ^ (mixed >> 32)
    })
}

/// The hashes that come several times, sorted.
fn repeated(mut hashes: Vec<u64>) -> Vec<u64> {
    hashes.sort_unstable();
    hashes.chunk_by(|a, b| a == b).filter(|group| group.len() > 1).map(|group| group[0]).collect()
}

/// What is known of the pieces that were read.
#[derive(Default)]
struct Seen {
    /// Hashes of all places that may be in several pieces, sorted.
    several: Vec<u64>,
    /// The first point at each of these places: its number, and its place in `first`.
    known: HashMap<[u64; 3], (u32, usize)>,
    /// The positions of these points, and their values field by field.
    first: Vec<[f64; 3]>,
    values: Vec<f64>,
    points: usize,
    /// The fields of the first piece, without values, at points and at cells.
    fields: Option<[Vec<Field>; 2]>,
}

impl Seen {
    fn read(&mut self, reader: &PieceReader<'_, '_>) -> Result<MeshPiece, ReadError> {
        let (mut numbers, mut new) = (Vec::new(), Vec::new());
        let mut mesh = reader.read(&mut |points| {
            // Of most points it is known without a look into the table that it does not have them.
            let is_known = |point| self.several.binary_search(&hash(point)).is_ok();
            let known = |point| self.known.get(&bits(point)).filter(|_| is_known(point));
            (numbers, new) = numbered(points, self.points, |point| known(point).map(|(number, _)| *number))?;
            Ok(Numbering::Each { numbers: numbers.clone(), next: (self.points + new.len()) as u32 })
        })?;
        // Those that cells got in reading.
        for index in numbers.len()..mesh.positions.len() {
            numbers.push((self.points + new.len()) as u32);
            new.push(index);
        }
        let place = || format!("piece {}, <PointData>", reader.number);
        match &self.fields {
            None => {
                let names =
                    |fields: &[Field]| fields.iter().map(Field::without_values).collect::<Vec<Field>>();
                self.fields = Some([names(&mesh.fields), names(&mesh.cell_fields)]);
            }
            Some([fields, cell_fields]) => {
                mesh.fields = in_order(fields, mesh.fields).at(place)?;
                mesh.cell_fields = in_order(cell_fields, mesh.cell_fields).at(place)?;
            }
        }
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
            let (_, at) = self.known[&bits(mesh.positions[i])];
            mesh.positions[i] = self.first[at];
            for (f, field) in mesh.fields.iter_mut().enumerate() {
                field.values[i] = self.values[at * count + f];
            }
        }
        for &i in &new {
            let position = mesh.positions[i];
            let has_values = mesh.fields.iter().all(|field| field.values[i].is_finite());
            if has_values && self.several.binary_search(&hash(position)).is_ok() {
                let (number, at) = (numbers[i], self.first.len());
                if let std::collections::hash_map::Entry::Vacant(entry) = self.known.entry(bits(position)) {
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
