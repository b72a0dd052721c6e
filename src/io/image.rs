//! Regular grids: VTK XML image data (`.vti`), and what all grid formats share: checks, and grids in pieces.

use crate::io::error::{At, ReadError, ReadReason};
use crate::io::vtu::PieceReader;
use crate::io::xml::Document;
use crate::io::{Beside, CellData, ReadOptions, Survey, for_each_file, vtu};
use crate::mesh::{Field, Grid, TetMesh};

/// Most points of a grid: 512³. Its tetrahedra take some 13 GB.
pub const MAX_GRID_POINTS: u64 = 1 << 27;

/// First and last index along x, y and z.
pub(super) type Extent = [i64; 6];

/// A grid that was checked: at least two points along each axis, finite, not too large.
pub(super) fn checked_grid(dims: [u64; 3], origin: [f64; 3], spacing: [f64; 3]) -> Result<Grid, ReadReason> {
    if dims.iter().any(|d| *d < 2) {
        let what = format!("a grid of {} x {} x {} points", dims[0], dims[1], dims[2]);
        return Err(ReadReason::Unsupported {
            what,
            remedy: "give at least two points along each axis".into(),
        });
    }
    let points = dims.iter().try_fold(1_u64, |n, d| n.checked_mul(*d));
    if points.is_none_or(|n| n > MAX_GRID_POINTS) {
        return Err(ReadReason::TooLarge { what: "grid points".into(), limit: MAX_GRID_POINTS });
    }
    let far = [0, 1, 2].map(|i| origin[i] + spacing[i] * dims[i] as f64);
    if far.iter().chain(&origin).any(|x| !x.is_finite()) || spacing.iter().any(|s| s.is_nan() || *s <= 0.0) {
        let what = format!("a grid with spacing {spacing:?} and origin {origin:?}");
        return Err(ReadReason::Unsupported { what, remedy: "spacing must be positive, both finite".into() });
    }
    // Each dimension is at most the number of points.
    Ok(Grid { dims: dims.map(|d| d as u32), origin, spacing })
}

/// The mesh of a grid, without points and tetrahedra unless there are values at cubes, whose fields at points and at cubes were read; a grid without any would be a few bytes that claim
/// any size.
pub(super) fn grid_mesh(grid: Grid, fields: Vec<Field>, cubes: Vec<Field>) -> Result<TetMesh, ReadReason> {
    if fields.is_empty() && cubes.iter().all(|field| field.values.is_empty()) {
        return Err(ReadReason::Missing("an array with a value for every point".into()));
    }
    let mut mesh = TetMesh::of_grid_alone(grid, fields);
    mesh.cell_fields = cubes;
    if mesh.cell_fields.iter().any(|field| !field.values.is_empty()) {
        mesh.expand_grid();
        sixfold(&mut mesh.cell_fields);
    }
    Ok(mesh)
}

/// Fields at cubes as fields at the tetrahedra of these, which follow one another.
pub(super) fn sixfold(fields: &mut [Field]) {
    for field in fields {
        field.values = field.values.iter().flat_map(|&value| [value; 6]).collect();
    }
}

/// Reads a document of type `ImageData`, or `PImageData` with the files that it lists, and its time.
pub(super) fn read(
    document: &Document<'_>,
    options: &ReadOptions,
    beside: Beside<'_>,
) -> Result<(TetMesh, Option<f64>), ReadError> {
    let whole_place = || format!("<{}>", document.kind);
    let (grid, whole) = read_grid(document).at(whole_place)?;
    let mut parts = Vec::new();
    let mut cubes = Cubes::default();
    let time = for_each_file(document, beside, &mut |file| {
        for (number, piece) in file.pieces.iter().enumerate() {
            let reader = PieceReader { document: file, piece, number, options };
            parts.push(read_part(&reader, whole)?);
            cubes.add(&reader, whole)?;
        }
        Ok(())
    })?;
    let fields = assemble(parts, whole).at(whole_place)?;
    let cubes = cubes.finish(whole).at(whole_place)?;
    Ok((grid_mesh(grid, fields, cubes).at(whole_place)?, time))
}

/// The fields at the cubes of a grid in pieces.
#[derive(Default)]
pub(super) struct Cubes {
    parts: Vec<Part>,
    /// Without values, where only names are asked for.
    names: Vec<Field>,
}

impl Cubes {
    /// Reads what is wanted of a piece.
    pub fn add(&mut self, reader: &PieceReader<'_, '_>, whole: Extent) -> Result<(), ReadError> {
        match reader.options.cells {
            CellData::Values => self.parts.extend(read_cubes(reader, whole)?),
            CellData::Names if self.names.is_empty() => self.names = reader.field_names("CellData")?,
            CellData::Names | CellData::LeaveOut => {}
        }
        Ok(())
    }

    /// The fields of the whole grid.
    pub fn finish(self, whole: Extent) -> Result<Vec<Field>, ReadReason> {
        if self.parts.iter().all(|part| part.fields.is_empty()) {
            return Ok(self.names);
        }
        assemble(self.parts, cubes_of(whole))
    }
}

/// Says what a document of type `ImageData` contains.
pub(super) fn survey(document: &Document<'_>) -> Result<Survey, ReadError> {
    let (grid, _) = read_grid(document).at(|| "<ImageData>".to_owned())?;
    Ok(Survey::of_grid("vti", grid, vtu::names(document)?))
}

/// The first and last cube along each axis of a box of points.
pub(super) fn cubes_of(mut extent: Extent) -> Extent {
    [1, 3, 5].into_iter().for_each(|i| extent[i] = extent[i].saturating_sub(1));
    extent
}

/// The fields at the cubes of a piece; none if it is flat.
fn read_cubes(reader: &PieceReader<'_, '_>, whole: Extent) -> Result<Option<Part>, ReadError> {
    let extent = reader.piece.attributes.numbers("Extent").at(|| reader.place())?;
    let extent = cubes_of(extent.unwrap_or(whole));
    let Ok(dims) = dims_in(extent, cubes_of(whole)) else { return Ok(None) };
    let cubes = dims.iter().product::<u64>() as usize;
    Ok(Some(Part { extent, fields: reader.cell_fields(cubes)? }))
}

/// A piece of a grid: where it is and its fields.
pub(super) struct Part {
    pub extent: Extent,
    pub fields: Vec<Field>,
}

fn read_part(reader: &PieceReader<'_, '_>, whole: Extent) -> Result<Part, ReadError> {
    let place = || reader.place();
    let extent = reader.piece.attributes.numbers("Extent").at(place)?.unwrap_or(whole);
    // No overflow: the piece is inside the grid, whose points were counted.
    let points = dims_in(extent, whole).at(place)?.iter().product::<u64>() as usize;
    let fields = reader.fields("PointData", points)?;
    if fields.is_empty() && reader.options.cells != CellData::Values {
        return Err(ReadReason::Missing("an array in <PointData>".into())).at(place);
    }
    Ok(Part { extent, fields })
}

fn read_grid(document: &Document<'_>) -> Result<(Grid, Extent), ReadReason> {
    let attributes = &document.dataset;
    let whole: Extent = attributes
        .numbers("WholeExtent")?
        .ok_or_else(|| ReadReason::Missing("attribute WholeExtent".into()))?;
    let origin = attributes.numbers("Origin")?.unwrap_or([0.0; 3]);
    let spacing: [f64; 3] = attributes.numbers("Spacing")?.unwrap_or([1.0; 3]);
    let direction: Option<[f64; 9]> = attributes.numbers("Direction")?;
    placed_grid(whole, origin, spacing, direction.as_ref().map(|direction| &direction[..]))
}

/// The grid of VTK's image data, which may not be turned.
pub(super) fn placed_grid(
    whole: Extent,
    origin: [f64; 3],
    spacing: [f64; 3],
    direction: Option<&[f64]>,
) -> Result<(Grid, Extent), ReadReason> {
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    if let Some(direction) = direction.filter(|direction| **direction != identity) {
        let what = format!("a grid turned by Direction=\"{direction:?}\"");
        return Err(ReadReason::Unsupported { what, remedy: "resample it along the axes".into() });
    }
    let dims = dims_in(whole, whole)?;
    // VTK's origin is the position of index (0, 0, 0), which need not be in the grid.
    let first: [f64; 3] = [0, 1, 2].map(|i| origin[i] + spacing[i] * whole[2 * i] as f64);
    Ok((checked_grid(dims, first, spacing)?, whole))
}

/// How many points `extent` has along each axis; it must lie in `whole`.
pub(super) fn dims_in(extent: Extent, whole: Extent) -> Result<[u64; 3], ReadReason> {
    let outside = || ReadReason::Syntax(format!("extent {extent:?} is empty or not in {whole:?}"));
    let mut dims = [0; 3];
    for (i, dim) in dims.iter_mut().enumerate() {
        let (low, high) = (extent[2 * i], extent[2 * i + 1]);
        if low < whole[2 * i] || high > whole[2 * i + 1] || low > high {
            return Err(outside());
        }
        *dim = high.abs_diff(low).checked_add(1).ok_or_else(outside)?;
    }
    Ok(dims)
}

/// The fields of the whole grid.
pub(super) fn assemble(mut parts: Vec<Part>, whole: Extent) -> Result<Vec<Field>, ReadReason> {
    if let [part] = parts.as_mut_slice()
        && part.extent == whole
    {
        return Ok(std::mem::take(&mut part.fields));
    }
    let whole_dims = dims_in(whole, whole)?.map(|d| d as usize);
    let points: usize = whole_dims.iter().product();
    if parts.iter().all(|part| part.fields.is_empty()) {
        return Ok(Vec::new());
    }
    // Only values that were read may size what follows.
    let read: usize = parts.iter().filter_map(|p| p.fields.first()).map(|f| f.values.len()).sum();
    let missing = || ReadReason::Missing("a piece of the grid".into());
    let first = parts.first().filter(|_| read >= points).ok_or_else(missing)?;
    let mut covered = vec![false; points];
    let empty = |f: &Field| Field {
        values: vec![0.0; points],
        unit: f.unit.clone(),
        vector: f.vector.clone(),
        integer: parts.iter().flat_map(|p| &p.fields).all(|g| g.name != f.name || g.integer),
        ..Field::new(f.name.clone(), Vec::new())
    };
    let mut fields: Vec<Field> = first.fields.iter().map(empty).collect();
    for part in &parts {
        place_part(&mut fields, &mut covered, part, whole)?;
    }
    if covered.contains(&false) { Err(missing()) } else { Ok(fields) }
}

/// Copies the values of a piece into the fields of the whole grid.
fn place_part(
    fields: &mut [Field],
    covered: &mut [bool],
    part: &Part,
    whole: Extent,
) -> Result<(), ReadReason> {
    if part.fields.len() != fields.len()
        || part.fields.iter().zip(fields.iter()).any(|(a, b)| a.name != b.name)
    {
        return Err(ReadReason::Syntax("the pieces do not have the same arrays".into()));
    }
    let whole_dims = dims_in(whole, whole)?.map(|d| d as usize);
    let dims = dims_in(part.extent, whole)?.map(|d| d as usize);
    let low = [0, 1, 2].map(|i| part.extent[2 * i].abs_diff(whole[2 * i]) as usize);
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            let from = dims[0] * (y + dims[1] * z);
            let to = low[0] + whole_dims[0] * (low[1] + y + whole_dims[1] * (low[2] + z));
            covered[to..to + dims[0]].fill(true);
            for (field, source) in fields.iter_mut().zip(&part.fields) {
                field.values[to..to + dims[0]].copy_from_slice(&source.values[from..from + dims[0]]);
            }
        }
    }
    Ok(())
}
