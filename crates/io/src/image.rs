//! Regular grids: VTK XML image data (`.vti`), and what all grid formats share: checks, and grids in pieces.

use crate::error::{At, ReadError, ReadReason};
use crate::structured::{self, Ghosts};
use crate::vtu::PieceReader;
use crate::xml::Document;
use crate::{Beside, CellData, MemoryLimit, ReadOptions, Survey, for_each_file, vtu};
use tetralod::mesh::{Field, Grid, TetMesh};

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

/// Where the points of a grid lie: the first one, and the steps from one to the next along each axis of the grid.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Placement {
    pub dims: [u64; 3],
    pub origin: [f64; 3],
    pub steps: [[f64; 3]; 3],
}

impl Placement {
    /// The grid, if it lies along the axes of space and in their direction; it was checked then.
    pub fn grid(&self) -> Result<Option<Grid>, ReadReason> {
        let along = [0, 1, 2].map(|i| self.steps[i][i]);
        let is_aligned = (0..9).all(|k| k / 3 == k % 3 || self.steps[k / 3][k % 3] == 0.0);
        if !is_aligned || along.iter().any(|step| *step < 0.0) {
            return Ok(None);
        }
        checked_grid(self.dims, self.origin, along).map(Some)
    }

    /// The places of all points of a grid that is turned.
    pub fn positions(&self) -> Result<Vec<[f64; 3]>, ReadReason> {
        let dims = structured::checked_dims(self.dims)?;
        let place = |x: u32, y: u32, z: u32| {
            let by = [x, y, z].map(f64::from);
            [0, 1, 2].map(|i| self.origin[i] + (0..3).map(|axis| by[axis] * self.steps[axis][i]).sum::<f64>())
        };
        let mut positions = Vec::with_capacity(dims.iter().map(|d| *d as usize).product());
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                positions.extend((0..dims[0]).map(|x| place(x, y, z)));
            }
        }
        if positions.as_flattened().iter().any(|x| !x.is_finite()) {
            return Err(ReadReason::Syntax("the origin or a direction of the grid is not finite".into()));
        }
        Ok(positions)
    }

    /// The mesh of a grid, without points and tetrahedra if it lies along the axes and nothing else needs them.
    pub fn mesh(&self, values: GridValues, memory: &MemoryLimit) -> Result<TetMesh, ReadReason> {
        if let Some(grid) = self.grid()? {
            return grid_mesh(grid, values, memory);
        }
        let dims = structured::checked_dims(self.dims)?;
        memory.expect(structured::bytes(dims))?;
        structured::mesh(dims, self.positions()?, values, memory)
    }
}

/// What a grid has at its points and at its cubes.
#[derive(Debug, Default)]
pub(super) struct GridValues {
    pub fields: Vec<Field>,
    /// Those at cubes, one value a cube; without values where only names are asked for.
    pub cubes: Vec<Field>,
    /// What hides points and cubes.
    pub ghosts: Ghosts,
    /// Fields that nobody asked for, at points and cubes.
    pub others: [Vec<Field>; 2],
}

/// The mesh of a grid along the axes.
pub(super) fn grid_mesh(grid: Grid, values: GridValues, memory: &MemoryLimit) -> Result<TetMesh, ReadReason> {
    structured::with_values(TetMesh { grid: Some(grid), ..TetMesh::default() }, grid.dims, values, memory)
}

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
        for (number, piece) in file.full_pieces() {
            let reader = PieceReader { document: file, piece, number, options };
            grid.add(&reader, whole, Vec::new())?;
        }
        Ok(())
    })?;
    let values = grid.finish(whole).at(whole_place)?;
    Ok((placement.mesh(values, &options.memory).at(whole_place)?, time))
}

/// A grid whose values come in parts.
#[derive(Default)]
pub(super) struct InParts {
    points: Vec<Part>,
    cubes: Vec<Part>,
    others: [Vec<Field>; 2],
    /// Without values, where only names are asked for.
    names: Vec<Field>,
}

impl InParts {
    /// Reads what is wanted of a piece; `fields` are some that it has beside those.
    pub fn add(
        &mut self,
        reader: &PieceReader<'_, '_>,
        whole: Extent,
        mut fields: Vec<Field>,
    ) -> Result<(), ReadError> {
        let place = || reader.place();
        let extent = extent_of(reader, whole)?;
        let dims = dims_in(extent, whole).at(place)?;
        // No overflow: the piece is inside the grid, whose points were counted.
        let points = dims.iter().product::<u64>() as usize;
        let ghosts = reader.ghosts("PointData", points)?;
        let [at_points, others] = reader.fields("PointData", points)?;
        let (has_values, other_cubes) = self.add_cubes(reader, whole, &at_points)?;
        if at_points.is_empty() && !has_values {
            expect_values(reader, points, dims)?;
        }
        self.others = [others, other_cubes];
        fields.extend(at_points);
        self.points.push(Part { extent, fields, ghosts });
        Ok(())
    }

    /// Reads the fields at the cubes of a piece, of which a flat one has none; returns whether there are values, and the fields that
    /// nobody asked for.
    fn add_cubes(
        &mut self,
        reader: &PieceReader<'_, '_>,
        whole: Extent,
        at_points: &[Field],
    ) -> Result<(bool, Vec<Field>), ReadError> {
        let extent = cubes_of(extent_of(reader, whole)?);
        let Ok(dims) = dims_in(extent, cubes_of(whole)) else { return Ok(Default::default()) };
        let cubes = dims.iter().product::<u64>() as usize;
        let [fields, others] = reader.cell_fields(cubes, at_points)?;
        let ghosts = reader.ghosts("CellData", cubes)?;
        let (fields, names) =
            if reader.options.cells == CellData::Names { (Vec::new(), fields) } else { (fields, Vec::new()) };
        self.names = names;
        let has_values = !fields.is_empty();
        self.cubes.push(Part { extent, fields, ghosts });
        Ok((has_values, others))
    }

    /// The values of the whole grid.
    pub fn finish(self, whole: Extent) -> Result<GridValues, ReadReason> {
        let Self { points, cubes, others, names } = self;
        // Each piece has as many values as it says: nothing else may size what follows.
        let mut read = 0_usize;
        for part in &points {
            read = read.saturating_add(count(part.extent, whole)?);
        }
        if read < count(whole, whole)? {
            return Err(missing());
        }
        let inner = cubes_of(whole);
        let [at_points, at_cubes] = [assemble_ghosts(&points, whole)?, assemble_ghosts(&cubes, inner)?];
        let ghosts = Ghosts { points: at_points, cubes: at_cubes };
        let fields = assemble(points, whole)?;
        let cubes =
            if cubes.iter().all(|part| part.fields.is_empty()) { names } else { assemble(cubes, inner)? };
        Ok(GridValues { fields, cubes, ghosts, others })
    }
}

/// Where a piece lies in the grid.
pub(super) fn extent_of(reader: &PieceReader<'_, '_>, whole: Extent) -> Result<Extent, ReadError> {
    Ok(reader.piece.attributes.numbers("Extent").at(|| reader.place())?.unwrap_or(whole))
}

/// Checks that there is an array of as many values as there are points or cubes: without, a few words claim any size.
pub(super) fn expect_values(
    reader: &PieceReader<'_, '_>,
    points: usize,
    dims: [u64; 3],
) -> Result<(), ReadError> {
    let cubes = dims.iter().map(|d| (*d as usize).saturating_sub(1)).product();
    let has_values = |(section, tuples): (&str, usize)| {
        reader.piece.section(section).any(|array| {
            let components = array.number_type().and_then(|_| array.components().ok()).filter(|n| *n > 0);
            components.is_some_and(|n| tuples > 0 && reader.document.floats(array, tuples, n).is_ok())
        })
    };
    if [("PointData", points), ("CellData", cubes)].into_iter().any(has_values) {
        return Ok(());
    }
    Err(ReadReason::Missing("an array with a value for every point or cell".into())).at(|| reader.place())
}

/// Says what a document of type `ImageData` contains.
pub(super) fn survey(document: &Document<'_>) -> Result<Survey, ReadError> {
    let place = || "<ImageData>".to_owned();
    let (placement, _) = read_placement(document).at(place)?;
    Survey::of_placement("vti", &placement, vtu::names(document)?).at(place)
}

/// The first and last cube along each axis of a box of points.
pub(super) fn cubes_of(mut extent: Extent) -> Extent {
    [1, 3, 5].into_iter().for_each(|i| extent[i] = extent[i].saturating_sub(1));
    extent
}

/// A piece of a grid: where it is, its fields, and VTK's flags.
struct Part {
    extent: Extent,
    fields: Vec<Field>,
    ghosts: Option<Vec<i64>>,
}

fn read_placement(document: &Document<'_>) -> Result<(Placement, Extent), ReadReason> {
    let attributes = &document.dataset;
    let whole: Extent = attributes
        .numbers("WholeExtent")?
        .ok_or_else(|| ReadReason::Missing("attribute WholeExtent".into()))?;
    let origin = attributes.numbers("Origin")?.unwrap_or([0.0; 3]);
    let spacing: [f64; 3] = attributes.numbers("Spacing")?.unwrap_or([1.0; 3]);
    let direction: Option<[f64; 9]> = attributes.numbers("Direction")?;
    placed(whole, origin, spacing, direction.unwrap_or(ALONG_THE_AXES))
}

/// The directions of a grid that is not turned: its axes are the columns of this matrix.
pub(super) const ALONG_THE_AXES: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// The places of the points of VTK's image data.
pub(super) fn placed(
    whole: Extent,
    origin: [f64; 3],
    spacing: [f64; 3],
    direction: [f64; 9],
) -> Result<(Placement, Extent), ReadReason> {
    let dims = dims_in(whole, whole)?;
    structured::checked_dims(dims)?;
    // Products with 0 must not have a sign, or be not finite.
    let times = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
    let steps = [0, 1, 2].map(|axis| [0, 1, 2].map(|i| times(direction[3 * i + axis], spacing[axis])));
    let is_flat = |step: &[f64; 3]| step.iter().all(|x| *x == 0.0);
    let is_finite = [&origin[..], steps.as_flattened()].into_iter().flatten().all(|x| x.is_finite());
    if !is_finite || steps.iter().any(is_flat) {
        let what = format!("a grid with spacing {spacing:?}, origin {origin:?} and directions {direction:?}");
        return Err(ReadReason::Unsupported {
            what,
            remedy: "spacing and directions must be finite and not 0".into(),
        });
    }
    // VTK's origin is the position of index (0, 0, 0), which need not be in the grid.
    let first = [0, 1, 2].map(|i| {
        let moves = (0..3).map(|axis| times(steps[axis][i], whole[2 * axis] as f64));
        origin[i] + moves.sum::<f64>()
    });
    Ok((Placement { dims, origin: first, steps }, whole))
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

/// How many points, or cubes, a part of a grid has.
fn count(extent: Extent, whole: Extent) -> Result<usize, ReadReason> {
    Ok(dims_in(extent, whole)?.map(|d| d as usize).iter().product())
}

fn missing() -> ReadReason {
    ReadReason::Missing("a piece of the grid".into())
}

/// The flags of the whole grid: what is hidden in all pieces that have it. None if no piece has flags.
fn assemble_ghosts(parts: &[Part], whole: Extent) -> Result<Option<Vec<i64>>, ReadReason> {
    if parts.iter().all(|part| part.ghosts.is_none()) {
        return Ok(None);
    }
    let mut flags = vec![i64::MAX; count(whole, whole)?];
    for part in parts {
        each_row(part.extent, whole, &mut |from, to, length| {
            for (i, flag) in flags[to..to + length].iter_mut().enumerate() {
                *flag &= part.ghosts.as_ref().map_or(0, |own| own[from + i]);
            }
        })?;
    }
    Ok(Some(flags))
}

/// The fields of the whole grid.
fn assemble(mut parts: Vec<Part>, whole: Extent) -> Result<Vec<Field>, ReadReason> {
    if let [part] = parts.as_mut_slice()
        && part.extent == whole
    {
        return Ok(std::mem::take(&mut part.fields));
    }
    if parts.iter().all(|part| part.fields.is_empty()) {
        return Ok(Vec::new());
    }
    let points = count(whole, whole)?;
    let first = parts.first().ok_or_else(missing)?;
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
    each_row(part.extent, whole, &mut |from, to, length| {
        covered[to..to + length].fill(true);
        for (field, source) in fields.iter_mut().zip(&part.fields) {
            field.values[to..to + length].copy_from_slice(&source.values[from..from + length]);
        }
    })
}

/// Tells `copy` of each row of a piece where it begins in the piece and in the grid, and how long it is.
fn each_row(
    extent: Extent,
    whole: Extent,
    copy: &mut dyn FnMut(usize, usize, usize),
) -> Result<(), ReadReason> {
    let whole_dims = dims_in(whole, whole)?.map(|d| d as usize);
    let dims = dims_in(extent, whole)?.map(|d| d as usize);
    let low = [0, 1, 2].map(|i| extent[2 * i].abs_diff(whole[2 * i]) as usize);
    for z in 0..dims[2] {
        for y in 0..dims[1] {
            let to = low[0] + whole_dims[0] * (low[1] + y + whole_dims[1] * (low[2] + z));
            copy(dims[0] * (y + dims[1] * z), to, dims[0]);
        }
    }
    Ok(())
}
