//! Meshes piece by piece: the same mesh as that of the whole, of which no more than a piece is in memory, and the points at which pieces meet.
//!
//! Those in [several files](super::pvtu) are read twice: at first for their points alone, to know which places several pieces have. Those in one
//! file come by [ranges](super::ranges).

use std::path::{Path, PathBuf};

#[cfg(feature = "hdf5")]
use crate::MemoryLimit;
use crate::beside::{FilesOf, place};
use crate::error::{At, ReadError, ReadReason, Stop, in_file};
use crate::fields::set_time;
use crate::file_kind::without_mark;
#[cfg(feature = "hdf5")]
use crate::formats::exodus_pieces::{Decomposition, ExodusPieces};
#[cfg(feature = "hdf5")]
use crate::formats::vtkhdf_ranges::HdfFile;
use crate::grid_boxes::GridInParts;
use crate::image_boxes::ImageFile;
use crate::listed::{for_each_file, names};
use crate::pvtu::{Identity, bits};
use crate::ranges::{Each, InPieces};
use crate::sample_file::SampleFile;
use crate::shared_points::{SharedPoints, hash};
use crate::vtu::PieceReader;
use crate::vtu_ranges::VtuFile;
use crate::xml::Document;
#[cfg(feature = "zarr")]
use crate::zarr;
use crate::{CellData, PieceCounts, ReadOptions, packed};
use tetralod::mesh::MeshPiece;

/// A mesh of which a piece is read at a time.
#[derive(Debug)]
pub struct Pieces {
    path: PathBuf,
    content: Content,
    options: ReadOptions,
}

/// Where pieces are.
#[derive(Debug)]
enum Content {
    /// In the files that this list names.
    List(Vec<u8>),
    /// In this one.
    File(Box<dyn InPieces>),
    /// In boxes of a grid.
    Grid(Box<GridInParts>),
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
        let content = Content::List(bytes);
        Ok(Some(Self { path: path.to_owned(), content, options: options.clone() }))
    }

    /// Opens a file with an unstructured grid (`.vtu`, `.vtkhdf`) that is read by its partitions, or by ranges of cells, each of which becomes `most` tetrahedra or a
    /// few more, or as many as take the least memory if nothing is said. The reason if the file has to be read as a whole; nothing is to be said
    /// of one that is another one, or of one range.
    ///
    /// # Errors
    /// If the file cannot be read or is damaged, as far as that follows from its structure.
    pub fn open_ranges(
        path: &Path,
        options: &ReadOptions,
        most: Option<u64>,
    ) -> Result<Result<Self, Option<&'static str>>, ReadError> {
        if options.cells == CellData::Values {
            return Ok(Err(Some("values at cells are read")));
        }
        match Content::of(path, options, most) {
            Ok(Some(content)) => Ok(Ok(Self { path: path.to_owned(), content, options: options.clone() })),
            Ok(None) => Ok(Err(None)),
            Err(Stop::Whole(why)) => Ok(Err(Some(why))),
            Err(Stop::Read(error)) => Err(in_file(error, &path.display().to_string())),
        }
    }

    /// Whether the file at a path stands for several with a piece each, whatever there is at this path itself: a decomposition of Exodus.
    ///
    /// # Errors
    /// If a piece is not there, or there are several decompositions.
    pub fn are_beside(path: &Path) -> Result<bool, ReadError> {
        #[cfg(feature = "hdf5")]
        let found = Decomposition::of(&FilesOf::on_disk(path, &MemoryLimit::default()))?.is_some();
        #[cfg(not(feature = "hdf5"))]
        let found = {
            let _ = path;
            false
        };
        Ok(found)
    }

    /// The regular grid that is read in boxes, of which no pieces come.
    pub fn grid(&self) -> Option<&GridInParts> {
        if let Content::Grid(grid) = &self.content { Some(grid) } else { None }
    }

    /// The files with the pieces, which may not be there.
    ///
    /// # Errors
    /// If the list of them is damaged, or names a file elsewhere than beside it or below.
    pub fn files(&self) -> Result<Vec<PathBuf>, ReadError> {
        let Content::List(list) = &self.content else { return Ok(vec![self.path.clone()]) };
        let document = Document::parse(without_mark(list)).map_err(|error| self.named(error))?;
        let files = names(&document).iter().map(|name| place(&self.path, name)).collect::<Result<_, _>>();
        files.at(String::new).map_err(|error| self.named(error))
    }

    /// How much there is, without the values: the points of each piece, and the tetrahedra at most that its cells become.
    ///
    /// # Errors
    /// As [`read_with`](super::read_with), as far as that follows from the structure of the files.
    pub fn counts(&self) -> Result<PieceCounts, ReadError> {
        let list = match &self.content {
            Content::List(list) => list,
            Content::File(file) => return Ok(file.counts()),
            Content::Grid(grid) => {
                let ([points, tetrahedra], fields) = (grid.mesh().counts(), grid.mesh().fields.len() as u64);
                return Ok(PieceCounts { points, tetrahedra, pieces: 1, fields, ..PieceCounts::default() });
            }
        };
        let document = Document::parse(without_mark(list)).map_err(|error| self.named(error))?;
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
        Ok(counts.in_boxes())
    }

    /// Reads one piece after the other, and passes it on. Together they are the mesh that [`read_with`](super::read_with) reads.
    ///
    /// # Errors
    /// As [`read_with`](super::read_with); the first error of `each`.
    pub fn for_each<E: From<ReadError>>(
        &self,
        each: &mut dyn FnMut(MeshPiece) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut failed = None;
        let read = self.read_all(&mut |piece| {
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

    /// An error of reading, with the file.
    pub fn named(&self, error: ReadError) -> ReadError {
        in_file(error, &self.path.display().to_string())
    }

    fn read_all(&self, each: Each<'_>) -> Result<(), ReadError> {
        let each = &mut |mut piece: MeshPiece| {
            if piece.mesh.input.files.0.is_empty() {
                piece.mesh.input.files.0.push(self.path.clone());
            }
            each(piece)
        };
        let read = match &self.content {
            Content::List(list) => return self.read_listed(&Document::parse(without_mark(list))?, each),
            Content::File(file) => file.for_each(&self.options, each),
            Content::Grid(_) => Err(Stop::Whole("it is a grid")),
        };
        read.map_err(Stop::into_changed)
    }

    fn read_listed(&self, document: &Document<'_>, each: Each<'_>) -> Result<(), ReadError> {
        let files = FilesOf::on_disk(&self.path, &self.options.memory);
        let beside = |file: &str| files.load(file);
        let mut hashes = Vec::new();
        let time = for_each_file(document, &beside, &self.options.memory, &mut |file| {
            self.each_reader(file, &mut |reader| {
                let points = reader.piece.attributes.count("NumberOfPoints").at(|| reader.place())?;
                hashes.extend(reader.points(points)?.into_iter().map(bits).map(hash));
                Ok(())
            })
        })?;
        let time = document.time().or(time);
        let mut shared = SharedPoints::of(hashes);
        for_each_file(document, &beside, &self.options.memory, &mut |file| {
            self.each_reader(file, &mut |reader| {
                let place = || format!("piece {}, <PointData>", reader.number);
                let mut piece = shared.read(Identity::Places, &mut |numbers| reader.read(numbers), &place)?;
                piece.mesh.input.files.0.extend(files.last());
                set_time(&mut piece.mesh, time);
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

impl Content {
    /// A file that has several ranges; none if it is another one, or has not.
    fn of(path: &Path, options: &ReadOptions, most: Option<u64>) -> Result<Option<Self>, Stop> {
        #[cfg(feature = "zarr")]
        if let Some(grid) = zarr::open_in_parts(path, options)? {
            return Ok(Some(Self::Grid(Box::new(grid))));
        }
        // What is wrong with it is for its reader to say.
        if path.is_dir() {
            return Ok(None);
        }
        #[cfg(feature = "hdf5")]
        if let Some(pieces) = ExodusPieces::open(path, options)? {
            return Ok(Some(Self::File(Box::new(pieces))));
        }
        #[cfg(feature = "hdf5")]
        if let Some(file) = HdfFile::open(path, options, most)? {
            return Ok(Some(Self::File(Box::new(file))));
        }
        let grid = match ImageFile::open(path, options)? {
            Some(grid) => Some(grid),
            None => SampleFile::open(path, options)?,
        };
        // Without values, its reader says what is missing.
        if let Some(grid) = grid.filter(|grid| !grid.mesh().fields.is_empty()) {
            return Ok(Some(Self::Grid(Box::new(grid))));
        }
        let file = VtuFile::open(path, options, most)?;
        Ok(file.filter(|file| file.ranges().count() > 1).map(|file| Self::File(Box::new(file))))
    }
}
