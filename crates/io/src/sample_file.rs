//! Samples of a grid that stand in a file as they are: raw ones, and those of NRRD and `MetaImage` without compression.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::ReadOptions;
use crate::beside::{FilesOf, place};
use crate::error::{At, ReadError, ReadReason, Stop};
use crate::file_kind::lower_extension;
use crate::formats::samples_in_file as in_file;
use crate::formats::volume::{Start, Volume};
use crate::grid::{GridValues, Placement, grid_mesh};
use crate::grid_boxes::{Boxes, GridInParts, Points, in_box};
use crate::memory::MemoryLimit;
use crate::raw::Sidecar;
use crate::reading::{samples_path, sidecar};
use tetralod::mesh::TetMesh;

/// Headers are not longer.
const MOST_OF_HEADER: u64 = 1 << 20;

/// The file with the samples of the one at `path`, where they are there, and what they are; none if this is another one. What is wrong with it is
/// for its reader to say.
fn samples_in_file(path: &Path, options: &ReadOptions) -> Option<(PathBuf, Start, Samples)> {
    if ["raw", "json"].contains(&lower_extension(path).as_str()) {
        let files = FilesOf::on_disk(path, &options.memory);
        let sidecar = sidecar(&files).ok()?;
        return Some((samples_path(&files, &sidecar), Start::At(0), Samples::Raw(sidecar)));
    }
    // Pipes and the like are read once.
    if !path.metadata().is_ok_and(|of_file| of_file.is_file()) {
        return None;
    }
    let mut head = Vec::new();
    File::open(path).ok()?.take(MOST_OF_HEADER).read_to_end(&mut head).ok()?;
    let (volume, file, start) = in_file(&head)?;
    // A header that is cut off says where nothing is.
    if !volume.is_by_points() || head.len() as u64 == MOST_OF_HEADER && start == Start::At(MOST_OF_HEADER) {
        return None;
    }
    let path = match file {
        Some(name) => place(path, &name).ok()?,
        None => path.to_owned(),
    };
    Some((path, start, Samples::Volume(Box::new(volume), options.clone())))
}

/// Samples that stand in a file as they are, layer behind layer.
#[derive(Debug)]
pub(super) struct SampleFile {
    file: File,
    /// Where the first one begins.
    start: u64,
    dims: [u32; 3],
    samples: Samples,
}

/// What samples are.
#[derive(Debug)]
enum Samples {
    Raw(Sidecar),
    /// As a header says, and the fields that are wanted.
    Volume(Box<Volume>, ReadOptions),
}

impl Samples {
    /// Bytes of the samples of a point.
    fn size(&self) -> u64 {
        match self {
            Self::Raw(sidecar) => sidecar.size() as u64,
            Self::Volume(volume, _) => volume.components() * volume.number.size() as u64,
        }
    }

    /// Where they are, and what is to be said of them.
    fn placement(&self) -> (Placement, Vec<String>) {
        match self {
            Self::Raw(sidecar) => (sidecar.placement(), Vec::new()),
            Self::Volume(volume, _) => (volume.placement(), volume.notes.clone()),
        }
    }

    /// All fields at so many points.
    fn values(&self, bytes: &[u8], points: u64) -> Result<GridValues, ReadReason> {
        match self {
            Self::Raw(sidecar) => Ok(sidecar.values(bytes)),
            Self::Volume(volume, options) => volume
                .row(points)
                .values(bytes, &ReadOptions { memory: MemoryLimit::default(), ..options.clone() }),
        }
    }
}

impl SampleFile {
    pub fn open(path: &Path, options: &ReadOptions) -> Result<Option<GridInParts>, Stop> {
        let Some((of_samples, start, samples)) = samples_in_file(path, options) else { return Ok(None) };
        let (placement, notes) = samples.placement();
        let Some(grid) = placement.grid().at(String::new)? else {
            return Err(Stop::Whole("its axes are turned"));
        };
        // What is missing, its reader says.
        let Ok(file) = File::open(&of_samples) else { return Ok(None) };
        let all = file.metadata().map_or(0, |of_file| of_file.len());
        let needed = grid.dims.iter().fold(samples.size(), |bytes, &d| bytes.saturating_mul(d.into()));
        let start = start.of(all, needed);
        let is_whole = match samples {
            Samples::Raw(_) => all == needed,
            Samples::Volume(..) => all >= start.saturating_add(needed),
        };
        if !is_whole {
            return Ok(None);
        }
        let zeros = vec![0; samples.size() as usize];
        let values = samples.values(&zeros, 1).at(String::new)?;
        let GridValues { fields, others, .. } = values;
        let mut alone = GridValues { fields, others, ..GridValues::default() };
        alone.fields.iter_mut().for_each(|field| field.values = Vec::new());
        let mut mesh = grid_mesh(grid, alone, &options.memory).at(String::new)?;
        mesh.input.files.0.push(path.to_owned());
        let boxes = Self { file, start, dims: grid.dims, samples };
        Ok(Some(GridInParts::new(TetMesh { notes, ..mesh }, grid, Box::new(boxes))))
    }

    fn bytes(&self, points: &Range<u64>) -> Result<Vec<u8>, ReadReason> {
        let size = self.samples.size();
        let mut bytes = vec![0; ((points.end - points.start) * size) as usize];
        let mut file = &self.file;
        let read = file.seek(SeekFrom::Start(self.start + points.start * size));
        let read = read.and_then(|_| file.read_exact(&mut bytes));
        read.map_err(|error| ReadReason::Io(error.to_string()))?;
        Ok(bytes)
    }
}

impl Boxes for SampleFile {
    fn values(&self, field: usize, points: &Points) -> Result<Vec<f64>, ReadError> {
        let read = |range: Range<u64>| {
            let bytes = self.bytes(&range)?;
            let mut values = self.samples.values(&bytes, range.end - range.start)?;
            Ok(std::mem::take(&mut values.fields[field].values))
        };
        in_box(self.dims, points, 1, read).at(|| "samples".into())
    }
}
