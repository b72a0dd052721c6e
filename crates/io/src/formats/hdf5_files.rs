//! Files in HDF5 and netCDF, one by one or together, as inputs.

use crate::ReadOptions;
use crate::beside::FilesOf;
use crate::error::{ReadError, in_file};
use crate::formats::exodus_pieces::Decomposition;
use crate::formats::hdf5;
use tetralod::mesh::TetMesh;

/// Reads the given file if it is one of these; others are for other readers, and so is one that cannot be opened.
pub(crate) fn read_given(files: &FilesOf<'_>, options: &ReadOptions) -> Option<Result<TetMesh, ReadError>> {
    let result = match Decomposition::of(files) {
        Ok(None) => hdf5::read_from(hdf5::open(files)?, options),
        Ok(Some(pieces)) => {
            pieces.names().for_each(|file| files.note(file));
            pieces.read(options)
        }
        Err(error) => Err(error),
    };
    Some(result.map_err(|error| in_file(error, &files.name())))
}

/// The times of the steps in the given file; none if it is not one of these, or has no steps.
pub(crate) fn times(files: &FilesOf<'_>) -> Result<Vec<f64>, ReadError> {
    if let Some(pieces) = Decomposition::of(files)? {
        return pieces.times();
    }
    let Some(storage) = hdf5::open(files) else { return Ok(Vec::new()) };
    hdf5::times_in(storage).map_err(|error| in_file(error, &files.name()))
}
