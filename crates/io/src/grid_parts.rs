//! Grids in VTK's XML whose values come in pieces.

use crate::CellData;
use crate::error::{At, ReadError, ReadReason};
use crate::grid::{Extent, Ghosts, GridValues, dims_in};
use crate::vtu::PieceReader;
use crate::xml::Document;
use tetralod::mesh::Field;

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

/// The first and the last point of a whole grid along each axis.
pub(super) fn whole_extent(document: &Document<'_>) -> Result<Extent, ReadReason> {
    let whole = document.dataset.numbers("WholeExtent")?;
    whole.ok_or_else(|| ReadReason::Missing("attribute WholeExtent".into()))
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
