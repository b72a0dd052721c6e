//! Regular grids in VTK's XML: image data (`.vti`).

use crate::contents::Survey;
use crate::error::{At, ReadError, ReadReason};
use crate::grid::{ALONG_THE_AXES, Extent, Placement, placed};
use crate::grid_parts::{InParts, whole_extent};
use crate::listed::for_each_file;
use crate::options::{Beside, ReadOptions};
use crate::vtu;
use crate::xml::Document;
use tetralod::mesh::{Field, TetMesh};

/// Reads a document of type `ImageData`, or `PImageData` with the files that it lists, and its time.
pub(super) fn read(
    document: &Document<'_>,
    options: &ReadOptions,
    beside: Beside<'_>,
) -> Result<(TetMesh, Option<f64>), ReadError> {
    let whole_place = || format!("<{}>", document.kind);
    let (placement, whole) = read_placement(document).at(whole_place)?;
    let mut grid = InParts::default();
    let time = for_each_file(document, beside, &options.memory, &mut |file| {
        vtu::readers(file, options).try_for_each(|reader| grid.add(&reader, whole, Vec::new()))
    })?;
    let values = grid.finish(whole).at(whole_place)?;
    Ok((placement.mesh(values, &options.memory).at(whole_place)?, time))
}

/// Says what a document of type `ImageData` contains, or one that lists files with the pieces of one, whose fields are `names`.
pub(super) fn survey(
    format: &'static str,
    document: &Document<'_>,
    names: [Vec<Field>; 2],
) -> Result<Survey, ReadError> {
    let place = || format!("<{}>", document.kind);
    let (placement, _) = read_placement(document).at(place)?;
    Survey::of_placement(format, &placement, names).at(place)
}

/// Where the points of a document of type `ImageData` are.
pub(super) fn read_placement(document: &Document<'_>) -> Result<(Placement, Extent), ReadReason> {
    let attributes = &document.dataset;
    let whole = whole_extent(document)?;
    let origin = attributes.numbers("Origin")?.unwrap_or([0.0; 3]);
    let spacing: [f64; 3] = attributes.numbers("Spacing")?.unwrap_or([1.0; 3]);
    let direction: Option<[f64; 9]> = attributes.numbers("Direction")?;
    placed(whole, origin, spacing, direction.unwrap_or(ALONG_THE_AXES))
}
