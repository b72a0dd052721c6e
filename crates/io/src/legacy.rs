//! Legacy VTK files (`.vtk`), versions 1.0 to 5.1, ASCII and binary: unstructured grids, structured points, and poly data
//! that is points alone.
//!
//! Binary numbers are big-endian and start right after the line that announces them. Version 5 lists cells as
//! offsets and connectivity, older ones as counts followed by indices.

use crate::cells::{CellList, Indices};
use crate::error::{At, ReadError, ReadReason, expect_count, shown};
use crate::fields::{Collector, check_finite, check_finite_cells, set_time, tell};
use crate::ghosts::{GHOST_LEVELS, GHOST_TYPE, HIDDEN_POINT};
use crate::grid::{self, Ghosts, GridValues, Placement};
use crate::number::{NumberType, points_from};
use crate::numbering::Numbering;
use crate::scanner::Scanner;
use crate::{CellData, MemoryLimit, ReadOptions, Survey, cell_types, cells};
use percent_encoding::percent_decode_str;
use std::borrow::Cow;
use tetralod::mesh::{Field, MeshInput, TetMesh};

/// How every legacy file starts.
pub(super) const MAGIC: &[u8] = b"# vtk DataFile Version ";

/// The types of data sets that are read.
const KINDS: [&str; 5] =
    ["unstructured_grid", "structured_points", "structured_grid", "rectilinear_grid", "polydata"];

/// Reads a legacy VTK file.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let (mut file, kind, time) = Reader::open(bytes).at(|| "header".into())?;
    let mut body = Body::new(options, time);
    body.read(&mut file)?;
    let time = body.time;
    let mut mesh = match kind.as_str() {
        "unstructured_grid" => body.unstructured(&file)?,
        "polydata" => body.points_alone()?,
        "structured_grid" => body.curvilinear(Vec::new())?,
        "rectilinear_grid" => body.rectilinear()?,
        _ => body.structured()?,
    };
    set_time(&mut mesh, time);
    Ok(mesh)
}

/// Says what a legacy VTK file contains; steps over its numbers.
pub(super) fn survey(bytes: &[u8]) -> Result<Survey, ReadError> {
    let (mut file, kind, _) = Reader::open(bytes).at(|| "header".into())?;
    file.skims = true;
    let options = ReadOptions { cells: CellData::Names, ..ReadOptions::default() };
    let [fields, cell_fields] = [(); 2].map(|()| Collector::of_names());
    let mut body = Body { skims: true, fields, cell_fields, ..Body::new(&options, None) };
    body.read(&mut file)?;
    // What some cells become is known with their points: these are read now.
    let of_cells = if cells::depend_on_points(&body.types) {
        let mut cells = Body { skims: true, lists_cells: true, ..Body::new(&options, None) };
        let (mut file, ..) = Reader::open(bytes).at(|| "header".into())?;
        file.skims = true;
        cells.read(&mut file)?;
        let listed = cells.listed(&file)?.unwrap_or_default();
        Some(listed.most_tets().at(|| "CELL_TYPES".into())?)
    } else {
        None
    };
    if kind == "structured_points" {
        let placement = body.placement()?;
        let fields = [body.fields.fields, body.cell_fields.fields];
        return Survey::of_placement("vtk", &placement, fields).at(|| "DIMENSIONS".into());
    }
    let (points, cells) = match (body.dims, of_cells) {
        (Some(dims), _) => (dims.iter().fold(1_u64, |n, d| n.saturating_mul(*d)), grid::most_tets(dims)),
        (None, Some(tets)) => (body.points as u64, tets),
        (None, None) if cells::are_points(&body.types) => (body.points as u64, 0),
        (None, None) => (body.points as u64, cells::most_tets(&body.types).at(|| "CELL_TYPES".into())?),
    };
    let (fields, cell_fields) = (body.fields.fields, body.cell_fields.fields);
    Ok(Survey { format: "vtk", points, cells, grid: None, fields, cell_fields })
}

/// The array of the whole data set in which VTK writes its time.
const TIME: &str = "TimeValue";

/// What an array's numbers are.
#[derive(Clone, Copy)]
enum Kind {
    Number(NumberType),
    /// Eight to a byte in binary files.
    Bit,
    /// Not numbers: stepped over.
    Text,
}

impl Kind {
    fn named(name: &str) -> Result<Self, ReadReason> {
        match name.to_ascii_lowercase().as_str() {
            "bit" => Ok(Self::Bit),
            "string" | "utf8_string" => Ok(Self::Text),
            lower => NumberType::legacy(lower)
                .map(Self::Number)
                .ok_or_else(|| ReadReason::Syntax(format!("number type \"{}\" is not known", shown(name)))),
        }
    }

    fn is_integer(self) -> bool {
        match self {
            Self::Number(number) => number.is_integer(),
            Self::Bit => true,
            Self::Text => false,
        }
    }
}

fn instead(found: &str, expected: &str) -> ReadReason {
    ReadReason::Syntax(format!("\"{}\" instead of {expected}", shown(found)))
}

/// A position in the file, and how its numbers are written.
struct Reader<'a> {
    words: Scanner<'a>,
    binary: bool,
    version: u32,
    is_before_5_1: bool,
    /// Steps over numbers instead of reading them.
    skims: bool,
}

impl<'a> Reader<'a> {
    /// Reads the header up to the data set's type, in lower case, and the time that the data set is of.
    fn open(bytes: &'a [u8]) -> Result<(Self, String, Option<f64>), ReadReason> {
        let mut time = None;
        let words = Scanner::new(bytes.get(MAGIC.len()..).unwrap_or_default());
        let mut file = Self { words, binary: false, version: 0, is_before_5_1: true, skims: false };
        let version = text(file.words.line())?.trim();
        let mut numbers = version.split('.').map(|number| number.parse().ok());
        let major = numbers.next().flatten().filter(|major| (1..=5).contains(major));
        let minor: u32 = numbers.next().flatten().unwrap_or(0);
        file.version = major.ok_or_else(|| {
            ReadReason::unsupported(
                format!("version \"{}\"", shown(version)),
                "write it as version 1.0 to 5.1",
            )
        })?;
        file.is_before_5_1 = file.version < 5 || file.version == 5 && minor < 1;
        // The title may hold any bytes.
        file.words.skip_line();
        file.binary = match file.words.word()?.to_ascii_lowercase().as_str() {
            "ascii" => false,
            "binary" => true,
            other => return Err(instead(other, "ASCII or BINARY")),
        };
        loop {
            match file.words.word()?.to_ascii_lowercase().as_str() {
                "dataset" => break,
                // Field data may come before the data set.
                "field" => time = file.time_in_field()?.or(time),
                "metadata" => _ = file.metadata(),
                other => return Err(instead(other, "DATASET")),
            }
        }
        let kind = file.words.word()?.to_ascii_lowercase();
        if !KINDS.contains(&kind.as_str()) {
            let what = format!("a data set of type {}", shown(&kind).to_ascii_uppercase());
            let remedy = "give an unstructured, structured or rectilinear grid, or structured points";
            return Err(ReadReason::unsupported(what, remedy));
        }
        Ok((file, kind, time))
    }

    fn count(&mut self) -> Result<usize, ReadReason> {
        let word = self.words.word()?;
        word.parse().map_err(|_| ReadReason::Syntax(format!("\"{}\" is not a count", shown(word))))
    }

    fn three<T: std::str::FromStr>(&mut self) -> Result<[T; 3], ReadReason> {
        let words = [self.words.word()?, self.words.word()?, self.words.word()?];
        let numbers: Result<Vec<T>, _> = words.iter().map(|w| w.parse()).collect();
        let numbers = numbers.ok().and_then(|n| n.try_into().ok());
        numbers.ok_or_else(|| ReadReason::Syntax("three numbers expected".into()))
    }

    /// `count` numbers of text.
    fn numbers<T>(
        &mut self,
        count: usize,
        parse: impl Fn(&str) -> Result<T, ReadReason>,
    ) -> Result<Vec<T>, ReadReason> {
        let mut values = Vec::with_capacity(self.words.capacity(count));
        for found in 0..count {
            let Some(word) = self.words.next_word()? else {
                return Err(ReadReason::Truncated { needed: count as u64, found: found as u64 });
            };
            values.push(parse(word)?);
        }
        Ok(values)
    }

    /// The numbers of an array whose announcing line was read but for its end; `None` for text.
    fn floats(&mut self, count: Option<usize>, kind: Kind) -> Result<Option<Vec<f64>>, ReadReason> {
        let count =
            count.ok_or(ReadReason::Truncated { needed: u64::MAX, found: self.words.rest().len() as u64 })?;
        self.words.skip_line();
        match kind {
            Kind::Number(number) if self.binary => {
                let bytes = self.words.take(count.checked_mul(number.size()))?;
                Ok(Some(if self.skims { Vec::new() } else { number.floats(bytes, true) }))
            }
            Kind::Bit if self.binary => {
                let bytes = self.words.take(Some(count.div_ceil(8)))?;
                let count = if self.skims { 0 } else { count };
                Ok(Some((0..count).map(|i| f64::from(bytes[i / 8] >> (7 - i % 8) & 1)).collect()))
            }
            Kind::Number(_) | Kind::Bit if self.skims => {
                self.numbers(count, |_| Ok(()))?;
                Ok(Some(Vec::new()))
            }
            Kind::Number(number) => self.numbers(count, |w| number.parse_float(w)).map(Some),
            Kind::Bit => self.numbers(count, |w| NumberType::U8.parse_float(w)).map(Some),
            Kind::Text => self.skip_texts(count).map(|()| None),
        }
    }

    fn integers(&mut self, count: usize, number: NumberType) -> Result<Vec<i64>, ReadReason> {
        self.words.skip_line();
        if self.binary {
            let bytes = self.words.take(count.checked_mul(number.size()))?;
            if self.skims { Ok(Vec::new()) } else { number.integers(bytes, true) }
        } else if self.skims {
            self.numbers(count, |_| Ok(()))?;
            Ok(Vec::new())
        } else {
            self.numbers(count, |w| number.parse_integer(w))
        }
    }

    /// Steps over texts: a line each, or in binary files each with its length, whose first two bits say how long
    /// the length itself is.
    fn skip_texts(&mut self, count: usize) -> Result<(), ReadReason> {
        for found in 0..count {
            let Some(first) = self.words.rest().first() else {
                return Err(ReadReason::Truncated { needed: count as u64, found: found as u64 });
            };
            if !self.binary {
                self.words.skip_line();
                continue;
            }
            let header = self.words.take(Some(8 >> (first >> 6)))?;
            let length = header[1..].iter().fold(u64::from(header[0] & 0x3f), |n, b| n << 8 | u64::from(*b));
            self.words.take(usize::try_from(length).ok())?;
        }
        Ok(())
    }

    /// Reads a METADATA block, which ends at an empty line; returns the unit of the array before it, if there is one.
    fn metadata(&mut self) -> Option<String> {
        let mut unit = None;
        let mut is_unit = false;
        self.words.skip_line();
        while !self.words.rest().is_empty() {
            let line = self.words.line().trim_ascii();
            if line.is_empty() {
                break;
            }
            let text = std::str::from_utf8(line).unwrap_or_default();
            match text.split_once(' ') {
                Some(("NAME", key)) => is_unit = key.starts_with("UNITS_LABEL "),
                Some(("DATA", value)) if is_unit => unit = Some(decoded_name(value.trim())),
                _ => {}
            }
        }
        unit
    }

    /// A FIELD block, its keyword read: `take` gets each array, of which the numbers come next, and the unit of the last one when it is
    /// known.
    fn field_block(&mut self, take: TakeArray<'_, 'a>) -> Result<(), ReadReason> {
        self.words.word()?;
        let arrays = self.count()?;
        for _ in 0..arrays {
            let mut name = self.words.word()?;
            if name.eq_ignore_ascii_case("metadata") {
                // What is known of the array before this one.
                let unit = self.metadata().unwrap_or_default();
                take(self, Taken::Unit(&unit))?;
                name = self.words.word()?;
            }
            if name == "NULL_ARRAY" {
                self.words.skip_line();
                continue;
            }
            let (components, tuples) = (self.count()?, self.count()?);
            let kind = Kind::named(self.words.word()?)?;
            take(self, Taken::Array(&ArrayHead { name: decoded_name(name), components, tuples, kind }))?;
        }
        Ok(())
    }

    /// The time in a FIELD block of the whole data set, whose other arrays are stepped over.
    fn time_in_field(&mut self) -> Result<Option<f64>, ReadReason> {
        let mut time = None;
        self.field_block(&mut |file, taken| {
            let Taken::Array(head) = taken else { return Ok(()) };
            let values = file.floats_if(head.name == TIME, head.count(), head.kind)?;
            let first = values.and_then(|values| values.first().copied());
            time = first.filter(|time| time.is_finite()).or(time);
            Ok(())
        })?;
        Ok(time)
    }

    /// As [`Reader::floats`], or steps over the numbers if they are not wanted.
    fn floats_if(
        &mut self,
        wanted: bool,
        count: Option<usize>,
        kind: Kind,
    ) -> Result<Option<Vec<f64>>, ReadReason> {
        let skims = self.skims;
        self.skims |= !wanted;
        let values = self.floats(count, kind);
        self.skims = skims;
        values
    }
}

/// What is said of an array before its numbers.
struct ArrayHead {
    name: String,
    components: usize,
    tuples: usize,
    kind: Kind,
}

impl ArrayHead {
    fn count(&self) -> Option<usize> {
        self.components.checked_mul(self.tuples)
    }
}

/// What a FIELD block has: an array, whose numbers come next, or the unit of the last one.
enum Taken<'b> {
    Array(&'b ArrayHead),
    Unit(&'b str),
}

/// Reads an array of a FIELD block.
type TakeArray<'b, 'a> = &'b mut dyn FnMut(&mut Reader<'a>, Taken<'_>) -> Result<(), ReadReason>;

fn text(bytes: &[u8]) -> Result<&str, ReadReason> {
    std::str::from_utf8(bytes).map_err(|_| ReadReason::Syntax("binary data where text is expected".into()))
}

/// Names are written with `%20` for a space and so on.
fn decoded_name(name: &str) -> String {
    percent_decode_str(name).decode_utf8().map_or_else(|_| name.to_owned(), Cow::into_owned)
}

/// What the attributes that follow belong to.
#[derive(Clone, Copy, Default, PartialEq)]
enum Owner {
    #[default]
    Nothing,
    Points(usize),
    Cells(usize),
}

/// Everything after the data set's type.
#[derive(Default)]
struct Body<'a> {
    positions: Option<Vec<[f64; 3]>>,
    /// The coordinates of a rectilinear grid, along each axis.
    coordinates: [Vec<f64>; 3],
    /// Before version 5 counts and indices; since then indices alone.
    connectivity: Vec<i64>,
    /// Since version 5: where each cell starts, and the end.
    offsets: Vec<i64>,
    cells: Option<usize>,
    types: Vec<i64>,
    dims: Option<[u64; 3]>,
    origin: [f64; 3],
    spacing: Option<[f64; 3]>,
    owner: Owner,
    fields: Collector<'a>,
    cell_fields: Collector<'a>,
    cell_data: CellData,
    /// What the mesh is counted in.
    memory: MemoryLimit,
    /// VTK's flags of hidden points and cells.
    ghosts: [Option<Vec<i64>>; 2],
    /// What is left out is noted here.
    input: MeshInput,
    time: Option<f64>,
    /// How many points there are.
    points: usize,
    /// The most values of a component that an array had.
    tuples: usize,
    /// Whether the file gives no numbers.
    skims: bool,
    /// Whether it gives those of cells nevertheless.
    lists_cells: bool,
}

impl<'a> Body<'a> {
    fn new(options: &'a ReadOptions, time: Option<f64>) -> Self {
        let [fields, cell_fields] = [(); 2].map(|()| Collector::new(options));
        Self {
            fields,
            cell_fields,
            cell_data: options.cells,
            memory: options.memory.clone(),
            time,
            ..Self::default()
        }
    }

    /// Reads all sections.
    fn read(&mut self, file: &mut Reader<'_>) -> Result<(), ReadError> {
        while let Some(keyword) = file.words.next_word().at(|| "body".into())? {
            let keyword = keyword.to_ascii_lowercase();
            self.section(file, &keyword).at(|| shown(&keyword).to_ascii_uppercase())?;
        }
        Ok(())
    }

    /// Reads the section that `keyword` announces.
    fn section(&mut self, file: &mut Reader<'_>, keyword: &str) -> Result<(), ReadReason> {
        if keyword != "metadata" {
            self.last_fields().forget_last();
        }
        match keyword {
            "points" => {
                let count = file.count()?;
                self.points = count;
                let kind = Kind::named(file.words.word()?)?;
                let values = file.floats(count.checked_mul(3), kind)?;
                let values = values.ok_or_else(|| ReadReason::Syntax("points made of text".into()))?;
                self.positions = Some(points_from(&values));
            }
            "cells" => self.cells(file)?,
            "cell_types" => {
                let count = file.count()?;
                // A survey counts them, too.
                let skims = std::mem::take(&mut file.skims);
                self.types = file.integers(count, NumberType::I32)?;
                file.skims = skims;
            }
            "x_coordinates" | "y_coordinates" | "z_coordinates" => {
                let count = file.count()?;
                let kind = Kind::named(file.words.word()?)?;
                let values = file.floats(Some(count), kind)?;
                let values = values.ok_or_else(|| ReadReason::Syntax("coordinates made of text".into()))?;
                let axis = usize::from(keyword.as_bytes()[0] - b'x');
                self.coordinates[axis] = values;
            }
            // Only poly data has these.
            "vertices" => {
                self.cells(file)?;
                self.cells = None;
            }
            "lines" | "polygons" | "triangle_strips" => {
                let what = format!("{} {}", file.count()?, keyword.replace('_', " "));
                return Err(ReadReason::NoVolume(what));
            }
            "dimensions" => self.dims = Some(file.three()?),
            "origin" => self.origin = file.three()?,
            "spacing" | "aspect_ratio" => self.spacing = Some(file.three()?),
            "point_data" => self.owner = Owner::Points(file.count()?),
            "cell_data" => self.owner = Owner::Cells(file.count()?),
            "metadata" => {
                let unit = file.metadata();
                unit.iter().for_each(|unit| self.last_fields().set_unit_of_last(unit));
            }
            "field" => {
                if self.owner == Owner::Nothing {
                    self.time = file.time_in_field()?.or(self.time);
                } else {
                    file.field_block(&mut |file, taken| match taken {
                        Taken::Array(head) => self.array(file, head),
                        Taken::Unit(unit) => {
                            self.last_fields().set_unit_of_last(unit);
                            Ok(())
                        }
                    })?;
                    self.last_fields().forget_last();
                }
            }
            _ => self.attribute(file, keyword)?,
        }
        Ok(())
    }

    fn cells(&mut self, file: &mut Reader<'_>) -> Result<(), ReadReason> {
        let skims = file.skims;
        file.skims &= !self.lists_cells;
        let read = self.numbers_of_cells(file);
        file.skims = skims;
        read
    }

    fn numbers_of_cells(&mut self, file: &mut Reader<'_>) -> Result<(), ReadReason> {
        let (count, size) = (file.count()?, file.count()?);
        if file.version < 5 {
            self.cells = Some(count);
            self.connectivity = file.integers(size, NumberType::I32)?;
            return Ok(());
        }
        self.cells = Some(count.saturating_sub(1));
        for (expected, length) in [("offsets", count), ("connectivity", size)] {
            let word = file.words.word()?;
            if !word.eq_ignore_ascii_case(expected) {
                return Err(instead(word, &expected.to_ascii_uppercase()));
            }
            let Kind::Number(number) = Kind::named(file.words.word()?)? else {
                return Err(ReadReason::Syntax("indices that are not numbers".into()));
            };
            let list = file.integers(length, number)?;
            *(if expected == "offsets" { &mut self.offsets } else { &mut self.connectivity }) = list;
        }
        Ok(())
    }

    /// Reads a data set attribute, as SCALARS.
    fn attribute(&mut self, file: &mut Reader<'_>, keyword: &str) -> Result<(), ReadReason> {
        let owned = match self.owner {
            Owner::Nothing => 0,
            Owner::Points(n) | Owner::Cells(n) => n,
        };
        let fixed = match keyword {
            "vectors" | "normals" => Some(3),
            "tensors" => Some(9),
            "tensors6" => Some(6),
            "global_ids" | "pedigree_ids" | "edge_flags" => Some(1),
            "scalars" | "color_scalars" | "texture_coordinates" | "lookup_table" => None,
            other => {
                return Err(ReadReason::Syntax(format!("keyword \"{}\" is not known", shown(other))));
            }
        };
        let name = decoded_name(file.words.word()?);
        let bytes_or_floats = Kind::Number(if file.binary { NumberType::U8 } else { NumberType::F32 });
        let (components, tuples, kind) = match (keyword, fixed) {
            (_, Some(components)) => (components, owned, Kind::named(file.words.word()?)?),
            ("color_scalars", _) => (file.count()?, owned, bytes_or_floats),
            ("lookup_table", _) => (4, file.count()?, bytes_or_floats),
            ("texture_coordinates", _) => (file.count()?, owned, Kind::named(file.words.word()?)?),
            _ => {
                let kind = Kind::named(file.words.word()?)?;
                (scalar_components(file)?, owned, kind)
            }
        };
        let head = ArrayHead { name, components, tuples, kind };
        if keyword == "lookup_table" {
            return file.floats_if(false, head.count(), kind).map(|_| ());
        }
        self.array(file, &head)
    }

    /// The fields of the owner of what was read last.
    fn last_fields(&mut self) -> &mut Collector<'a> {
        if matches!(self.owner, Owner::Cells(_)) { &mut self.cell_fields } else { &mut self.fields }
    }

    /// Reads an array whose numbers come next: fields at points and, if they are asked for, at cells; others are stepped over.
    fn array(&mut self, file: &mut Reader<'_>, head: &ArrayHead) -> Result<(), ReadReason> {
        let ArrayHead { name, components, kind, .. } = head;
        let (at_cells, tuples) = match self.owner {
            Owner::Nothing => return file.floats_if(false, head.count(), *kind).map(|_| ()),
            Owner::Points(points) => (false, points),
            Owner::Cells(cells) => (true, cells),
        };
        if matches!(kind, Kind::Text) {
            return file.floats_if(false, head.count(), *kind).map(|_| ());
        }
        if [GHOST_TYPE, GHOST_LEVELS].contains(&name.as_str()) {
            let values = file.floats(head.count(), *kind)?.unwrap_or_default();
            let to_flags =
                |value: &f64| if name == GHOST_TYPE { *value as i64 } else { i64::from(*value != 0.0) };
            self.ghosts[usize::from(at_cells)] = Some(values.iter().map(to_flags).collect());
            return Ok(());
        }
        let is_left_out = at_cells && self.cell_data == CellData::LeaveOut;
        let only_names = self.skims || at_cells && self.cell_data != CellData::Values;
        let fields = if at_cells { &mut self.cell_fields } else { &mut self.fields };
        let claim = if is_left_out { None } else { fields.claim(name, *components)? };
        let claim = match claim {
            Some(claim) if only_names => {
                fields.keep_names(claim, "");
                None
            }
            claim => claim,
        };
        let Some(claim) = claim else {
            file.floats_if(false, head.count(), *kind)?;
            self.tuples = self.tuples.max(head.tuples);
            return Ok(());
        };
        let found = head.count();
        if tuples.checked_mul(*components) != found {
            let expected = (tuples as u64).saturating_mul(*components as u64);
            let found = found.unwrap_or(usize::MAX) as u64;
            return Err(ReadReason::Count { what: format!("values of \"{name}\""), expected, found });
        }
        let numbers = file.floats(found, *kind)?.unwrap_or_default();
        self.tuples = self.tuples.max(head.tuples);
        let fields = if at_cells { &mut self.cell_fields } else { &mut self.fields };
        fields.fill(claim, numbers, kind.is_integer(), "")
    }

    /// The fields at cells, of which there are `cells`, beside those at points.
    fn take_cell_fields(&mut self, cells: usize) -> Result<Vec<Field>, ReadReason> {
        if tell(&self.fields.fields) {
            self.cell_fields.drop_first();
        }
        if self.cell_data == CellData::Values {
            check_values(&self.cell_fields, cells as u64)?;
        }
        Ok(std::mem::take(&mut self.cell_fields.fields))
    }

    /// The positions, of which there are as many as values.
    fn take_positions(&mut self) -> Result<Vec<[f64; 3]>, ReadError> {
        let positions = self.positions.take().ok_or_else(|| missing("POINTS")).at(String::new)?;
        check_values(&self.fields, positions.len() as u64).at(|| "POINT_DATA".into())?;
        Ok(positions)
    }

    /// The mesh of these points and cells, of which one has values that were read.
    fn mesh(mut self, positions: Vec<[f64; 3]>, listed: Option<CellList<'_>>) -> Result<TetMesh, ReadError> {
        self.memory.take(24 * positions.len() as u64).at(|| "POINTS".into())?;
        let used = || listed.as_ref().map(|listed| listed.used(positions.len()));
        check_finite(&positions, &self.fields.fields, &used).at(|| "POINT_DATA".into())?;
        let mut mesh = TetMesh { positions, input: std::mem::take(&mut self.input), ..TetMesh::default() };
        if let Some(listed) = listed {
            mesh.cell_fields = self.take_cell_fields(listed.types.len()).at(|| "CELL_DATA".into())?;
            let is_there =
                |cell: usize| listed.types.get(cell).is_some_and(|kind| !cell_types::is_flat(*kind));
            check_finite_cells(&mesh.cell_fields, is_there).at(|| "CELL_DATA".into())?;
            let numbering = Numbering::From { first: 0, points: mesh.positions.len() };
            let split = listed
                .split(&numbering, &mut mesh.positions, &mut self.fields.fields, &self.memory)
                .at(|| "CELLS".into())?;
            split.spread(&mut mesh.cell_fields);
            mesh.tets = split.tets;
            mesh.input.append(split.input);
        }
        mesh.input.other_fields = self.fields.others;
        mesh.input.other_cell_fields = self.cell_fields.others;
        mesh.fields = self.fields.fields;
        Ok(mesh)
    }

    fn points_alone(mut self) -> Result<TetMesh, ReadError> {
        let positions = self.take_positions()?;
        self.mesh(positions, None)
    }

    fn unstructured(mut self, file: &Reader<'_>) -> Result<TetMesh, ReadError> {
        let positions = self.take_positions()?;
        let listed = self.listed(file)?;
        self.mesh(positions, listed)
    }

    /// The cells that were read; none if there are points alone.
    fn listed(&mut self, file: &Reader<'_>) -> Result<Option<CellList<'static>>, ReadError> {
        let cells = self.cells.ok_or_else(|| missing("CELLS")).at(String::new)?;
        expect_count("cell types", cells, self.types.len()).at(|| "CELL_TYPES".into())?;
        if cells > 0 && cells::are_points(&self.types) {
            return Ok(None);
        }
        cells::most_tets(&self.types).at(|| "CELL_TYPES".into())?;
        let ends = self.ends_of_cells(file.version).at(|| "CELLS".into())?;
        let is_old = |kind: &i64| *kind == cell_types::LAGRANGE_HEXAHEDRON && file.is_before_5_1;
        let swapped = self.types.iter().map(is_old).collect();
        cells::resolve_orders(&mut self.types, &ends);
        cells::most_tets(&self.types).at(|| "CELL_TYPES".into())?;
        let length = cells::checked_ends(&self.types, &ends).at(|| "CELLS".into())?;
        expect_count("numbers in the cell list", length, self.connectivity.len()).at(|| "CELLS".into())?;
        let (types, connectivity) = (std::mem::take(&mut self.types), std::mem::take(&mut self.connectivity));
        let mut listed = CellList { types, ends, connectivity: Indices::Listed(connectivity) };
        listed.order_as_before_9(swapped);
        let [of_points, of_cells] = std::mem::take(&mut self.ghosts);
        if let Some(flags) = of_cells {
            listed.leave_out(&flags);
        }
        if let Some(flags) = of_points {
            listed.hide(&flags.iter().map(|flags| flags & HIDDEN_POINT != 0).collect::<Vec<_>>());
        }
        Ok(Some(listed))
    }

    /// Where each cell ends in the list of indices, which has nothing else then.
    fn ends_of_cells(&mut self, version: u32) -> Result<Vec<i64>, ReadReason> {
        let cells = self.cells.ok_or_else(|| missing("CELLS"))?;
        if version >= 5 { self.ends_by_offsets(cells) } else { self.ends_by_counts(cells) }
    }

    fn ends_by_offsets(&mut self, cells: usize) -> Result<Vec<i64>, ReadReason> {
        let mut ends = std::mem::take(&mut self.offsets);
        if ends.first().is_some_and(|s| *s != 0) {
            return Err(ReadReason::Syntax("the offsets do not start at 0".into()));
        }
        ends.drain(..ends.len().min(1));
        expect_count("offsets of cells", cells, ends.len())?;
        Ok(ends)
    }

    fn ends_by_counts(&mut self, cells: usize) -> Result<Vec<i64>, ReadReason> {
        let counted = std::mem::take(&mut self.connectivity);
        let short = || ReadReason::Count {
            what: "cells in the cell list".into(),
            expected: cells as u64,
            found: counted.len() as u64,
        };
        let mut ends = Vec::with_capacity(cells.min(counted.len()));
        let mut connectivity = Vec::with_capacity(counted.len());
        let mut rest = counted.as_slice();
        for _ in 0..cells {
            let (&count, after) = rest.split_first().ok_or_else(short)?;
            let count =
                usize::try_from(count).ok().filter(|count| *count <= after.len()).ok_or_else(short)?;
            let (cell, after) = after.split_at(count);
            connectivity.extend_from_slice(cell);
            ends.push(connectivity.len() as i64);
            rest = after;
        }
        expect_count("numbers in the cell list", counted.len() - rest.len(), counted.len())?;
        self.connectivity = connectivity;
        Ok(ends)
    }

    fn placement(&self) -> Result<Placement, ReadError> {
        let place = || "DIMENSIONS".to_owned();
        let dims = self.dims.ok_or_else(|| ReadReason::Missing("DIMENSIONS".into())).at(place)?;
        grid::checked_dims(dims).at(place)?;
        let whole = [0, dims[0] as i64 - 1, 0, dims[1] as i64 - 1, 0, dims[2] as i64 - 1];
        let spacing = self.spacing.unwrap_or([1.0; 3]);
        let placed = grid::placed(whole, self.origin, spacing, grid::ALONG_THE_AXES);
        Ok(placed.at(|| "SPACING".to_owned())?.0)
    }

    /// Checks that an array has as many values: without, a few coordinates claim any size.
    fn expect_tuples(&self, cubes: usize) -> Result<(), ReadError> {
        if self.tuples < cubes {
            let what = "an array with a value for every point or cell".into();
            return Err(ReadReason::Missing(what)).at(String::new);
        }
        Ok(())
    }

    /// The values of a grid with so many cubes.
    fn values(&mut self, cubes: usize) -> Result<GridValues, ReadError> {
        self.expect_tuples(cubes)?;
        let cell_fields = self.take_cell_fields(cubes).at(|| "CELL_DATA".into())?;
        let [points, of_cubes] = std::mem::take(&mut self.ghosts);
        let others =
            [&mut self.fields, &mut self.cell_fields].map(|fields| std::mem::take(&mut fields.others));
        let fields = std::mem::take(&mut self.fields.fields);
        Ok(GridValues { fields, cubes: cell_fields, ghosts: Ghosts { points, cubes: of_cubes }, others })
    }

    /// A grid whose coordinates are given along each axis.
    fn rectilinear(mut self) -> Result<TetMesh, ReadError> {
        let dims = grid::checked_dims(self.dims.unwrap_or_default()).at(|| "DIMENSIONS".to_owned())?;
        for (axis, name) in ["X_COORDINATES", "Y_COORDINATES", "Z_COORDINATES"].into_iter().enumerate() {
            let found = self.coordinates[axis].len();
            expect_count("coordinates", dims[axis] as usize, found).at(|| name.to_owned())?;
        }
        let coordinates = std::mem::take(&mut self.coordinates);
        self.expect_tuples(grid::cubes(dims))?;
        grid::bytes(dims).and_then(|bytes| self.memory.expect(2 * bytes)).at(|| "DIMENSIONS".into())?;
        self.curvilinear(points_from(&grid::rectilinear(&coordinates)))
    }

    /// A grid of which each point has a place of its own: these, or those of the section POINTS.
    fn curvilinear(mut self, positions: Vec<[f64; 3]>) -> Result<TetMesh, ReadError> {
        let place = || "DIMENSIONS".to_owned();
        let dims = self.dims.ok_or_else(|| missing("DIMENSIONS")).at(place)?;
        let dims = grid::checked_dims(dims).at(place)?;
        if !positions.is_empty() {
            self.positions = Some(positions);
        }
        let positions = self.take_positions()?;
        // As many points as there are cannot be claimed.
        self.tuples = self.tuples.max(positions.len());
        let values = self.values(grid::cubes(dims))?;
        grid::mesh(dims, positions, values, &self.memory).at(|| "POINTS".into())
    }

    fn structured(mut self) -> Result<TetMesh, ReadError> {
        let placement = self.placement()?;
        check_values(&self.fields, placement.dims.iter().product()).at(|| "POINT_DATA".into())?;
        let dims = grid::checked_dims(placement.dims).at(|| "DIMENSIONS".into())?;
        let values = self.values(grid::cubes(dims))?;
        placement.mesh(values, &self.memory).at(|| "POINT_DATA".into())
    }
}

fn check_values(fields: &Collector<'_>, expected: u64) -> Result<(), ReadReason> {
    let first = fields.fields.first();
    first.map_or(Ok(()), |field| expect_count("values a field", expected, field.values.len()))
}

fn missing(section: &str) -> ReadReason {
    ReadReason::Missing(format!("section {section}"))
}

/// The number of components after the type of SCALARS, and the LOOKUP_TABLE line, but for its end.
fn scalar_components(file: &mut Reader<'_>) -> Result<usize, ReadReason> {
    let line = text(file.words.line())?.trim();
    let components = if line.is_empty() { Ok(1) } else { line.parse() };
    let components = components
        .map_err(|_| ReadReason::Syntax(format!("\"{}\" is not a number of components", shown(line))))?;
    let word = file.words.word()?;
    if !word.eq_ignore_ascii_case("lookup_table") {
        return Err(instead(word, "LOOKUP_TABLE"));
    }
    file.words.word()?;
    Ok(components)
}
