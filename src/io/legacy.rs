//! Legacy VTK files (`.vtk`), versions 1.0 to 5.1, ASCII and binary: unstructured grids, structured points, and poly data
//! that is points alone.
//!
//! Binary numbers are big-endian and start right after the line that announces them. Version 5 lists cells as
//! offsets and connectivity, older ones as counts followed by indices.

use crate::io::cells::{CellList, Numbering};
use crate::io::error::{At, ReadError, ReadReason};
use crate::io::fields::Collector;
use crate::io::number::NumberType;
use crate::io::{CellData, ReadOptions, Survey, cells, image, points_from, structured};
use crate::mesh::{Field, Grid, TetMesh};

/// How every legacy file starts.
pub(super) const MAGIC: &[u8] = b"# vtk DataFile Version ";

/// The types of data sets that are read.
const KINDS: [&str; 5] =
    ["unstructured_grid", "structured_points", "structured_grid", "rectilinear_grid", "polydata"];

/// Reads a legacy VTK file.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<TetMesh, ReadError> {
    let (mut file, kind, time) = Reader::open(bytes).at(|| "header".into())?;
    let mut body = Body::new(options, time);
    while let Some(keyword) = file.next_word().at(|| "body".into())? {
        let keyword = keyword.to_ascii_lowercase();
        body.section(&mut file, &keyword).at(|| shortened(&keyword).to_ascii_uppercase())?;
    }
    let time = body.time;
    let mut mesh = match kind.as_str() {
        "unstructured_grid" => body.unstructured(file.version >= 5)?,
        "polydata" => body.points_alone()?,
        "structured_grid" => body.curvilinear(Vec::new())?,
        "rectilinear_grid" => body.rectilinear()?,
        _ => body.structured()?,
    };
    mesh.fields.iter_mut().chain(&mut mesh.cell_fields).for_each(|field| field.time = time);
    Ok(mesh)
}

/// Says what a legacy VTK file contains; steps over its numbers.
pub(super) fn survey(bytes: &[u8]) -> Result<Survey, ReadError> {
    let (mut file, kind, _) = Reader::open(bytes).at(|| "header".into())?;
    file.skims = true;
    let options = ReadOptions { fields: None, cells: CellData::Names, step: 0 };
    let mut body = Body { skims: true, ..Body::new(&options, None) };
    while let Some(keyword) = file.next_word().at(|| "body".into())? {
        let keyword = keyword.to_ascii_lowercase();
        body.section(&mut file, &keyword).at(|| shortened(&keyword).to_ascii_uppercase())?;
    }
    if kind == "structured_points" {
        return Ok(Survey::of_grid("vtk", body.grid()?, [body.fields.fields, body.cell_fields.fields]));
    }
    let (points, cells) = match body.dims {
        Some(dims) => (dims.iter().fold(1_u64, |n, d| n.saturating_mul(*d)), structured::most_tets(dims)),
        None if cells::are_points(&body.types) => (body.points as u64, 0),
        None => (body.points as u64, cells::most_tets(&body.types).at(|| "CELL_TYPES".into())?),
    };
    let (fields, cell_fields) = (body.fields.fields, body.cell_fields.fields);
    Ok(Survey { format: "vtk", points, cells, grid: None, fields, cell_fields })
}

/// The time in the arrays of the whole data set, as VTK writes it.
fn time_in(arrays: &[ArrayData]) -> Option<f64> {
    let array = arrays.iter().find(|array| array.name == "TimeValue")?;
    array.values.first().copied().filter(|time| time.is_finite())
}

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
            lower => NumberType::legacy(lower).map(Self::Number).ok_or_else(|| {
                ReadReason::Syntax(format!("number type \"{}\" is not known", shortened(name)))
            }),
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

fn shortened(text: &str) -> String {
    text.chars().take(24).collect()
}

fn instead(found: &str, expected: &str) -> ReadReason {
    ReadReason::Syntax(format!("\"{}\" instead of {expected}", shortened(found)))
}

/// A position in the file.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    binary: bool,
    version: u32,
    /// Steps over numbers instead of reading them.
    skims: bool,
}

impl<'a> Reader<'a> {
    /// Reads the header up to the data set's type, in lower case, and the time that the data set is of.
    fn open(bytes: &'a [u8]) -> Result<(Self, String, Option<f64>), ReadReason> {
        let mut time = None;
        let mut file = Self { bytes, at: MAGIC.len(), binary: false, version: 0, skims: false };
        let version = file.line()?.trim();
        let major = version.split('.').next().and_then(|v| v.parse().ok()).filter(|v| (1..=5).contains(v));
        file.version = major.ok_or_else(|| ReadReason::Unsupported {
            what: format!("version \"{}\"", shortened(version)),
            remedy: "write it as version 1.0 to 5.1".into(),
        })?;
        // The title may hold any bytes.
        file.skip_line();
        file.binary = match file.word()?.to_ascii_lowercase().as_str() {
            "ascii" => false,
            "binary" => true,
            other => return Err(instead(other, "ASCII or BINARY")),
        };
        loop {
            match file.word()?.to_ascii_lowercase().as_str() {
                "dataset" => break,
                // Field data may come before the data set.
                "field" => time = time_in(&file.field_block()?).or(time),
                "metadata" => _ = file.metadata(),
                other => return Err(instead(other, "DATASET")),
            }
        }
        let kind = file.word()?.to_ascii_lowercase();
        if !KINDS.contains(&kind.as_str()) {
            let what = format!("a data set of type {}", shortened(&kind).to_ascii_uppercase());
            let remedy = "give an unstructured, structured or rectilinear grid, or structured points".into();
            return Err(ReadReason::Unsupported { what, remedy });
        }
        Ok((file, kind, time))
    }

    fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// The next word, if there is one.
    fn next_word(&mut self) -> Result<Option<&'a str>, ReadReason> {
        let blank = self.rest().iter().take_while(|c| c.is_ascii_whitespace()).count();
        self.at += blank;
        if self.rest().is_empty() { Ok(None) } else { self.word().map(Some) }
    }

    fn word(&mut self) -> Result<&'a str, ReadReason> {
        let rest = self.rest();
        let start = rest.iter().position(|c| !c.is_ascii_whitespace()).unwrap_or(rest.len());
        let length = rest[start..].iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len() - start);
        self.at += start + length;
        if length == 0 {
            return Err(ReadReason::Truncated { needed: 1, found: 0 });
        }
        text(&rest[start..start + length])
    }

    /// The rest of the line, without its end.
    fn line(&mut self) -> Result<&'a str, ReadReason> {
        let rest = self.rest();
        let length = rest.iter().position(|c| *c == b'\n').unwrap_or(rest.len());
        self.at += (length + 1).min(rest.len());
        text(&rest[..length])
    }

    fn skip_line(&mut self) {
        let rest = self.rest();
        let length = rest.iter().position(|c| *c == b'\n').map_or(rest.len(), |i| i + 1);
        self.at += length;
    }

    fn count(&mut self) -> Result<usize, ReadReason> {
        let word = self.word()?;
        word.parse().map_err(|_| ReadReason::Syntax(format!("\"{}\" is not a count", shortened(word))))
    }

    fn three<T: std::str::FromStr>(&mut self) -> Result<[T; 3], ReadReason> {
        let words = [self.word()?, self.word()?, self.word()?];
        let numbers: Result<Vec<T>, _> = words.iter().map(|w| w.parse()).collect();
        let numbers = numbers.ok().and_then(|n| n.try_into().ok());
        numbers.ok_or_else(|| ReadReason::Syntax("three numbers expected".into()))
    }

    /// The next `count` bytes.
    fn take(&mut self, count: Option<usize>) -> Result<&'a [u8], ReadReason> {
        let rest = self.rest();
        let needed = count.unwrap_or(usize::MAX);
        let found = rest.len() as u64;
        let taken = rest.get(..needed).ok_or(ReadReason::Truncated { needed: needed as u64, found })?;
        self.at += needed;
        Ok(taken)
    }

    /// `count` numbers of text.
    fn words<T>(
        &mut self,
        count: usize,
        parse: impl Fn(&str) -> Result<T, ReadReason>,
    ) -> Result<Vec<T>, ReadReason> {
        // A number and the space after it are two bytes, so the capacity is bounded by what is there.
        let mut values = Vec::with_capacity(count.min(self.rest().len() / 2 + 1));
        for found in 0..count {
            let Some(word) = self.next_word()? else {
                return Err(ReadReason::Truncated { needed: count as u64, found: found as u64 });
            };
            values.push(parse(word)?);
        }
        Ok(values)
    }

    /// Steps over `count` numbers of text.
    fn skip_words(&mut self, count: usize) -> Result<(), ReadReason> {
        for found in 0..count {
            if self.next_word()?.is_none() {
                return Err(ReadReason::Truncated { needed: count as u64, found: found as u64 });
            }
        }
        Ok(())
    }

    /// The numbers of an array whose announcing line was read but for its end; `None` for text.
    fn floats(&mut self, count: Option<usize>, kind: Kind) -> Result<Option<Vec<f64>>, ReadReason> {
        let count =
            count.ok_or(ReadReason::Truncated { needed: u64::MAX, found: self.rest().len() as u64 })?;
        self.skip_line();
        match kind {
            Kind::Number(number) if self.binary => {
                let bytes = self.take(count.checked_mul(number.size()))?;
                Ok(Some(if self.skims { Vec::new() } else { number.floats(bytes, true) }))
            }
            Kind::Bit if self.binary && self.skims => {
                self.take(Some(count.div_ceil(8)))?;
                Ok(Some(Vec::new()))
            }
            Kind::Number(_) | Kind::Bit if self.skims => {
                self.skip_words(count)?;
                Ok(Some(Vec::new()))
            }
            Kind::Number(number) => self.words(count, |w| number.parse_float(w)).map(Some),
            Kind::Bit if self.binary => {
                let bytes = self.take(Some(count.div_ceil(8)))?;
                Ok(Some((0..count).map(|i| f64::from(bytes[i / 8] >> (7 - i % 8) & 1)).collect()))
            }
            Kind::Bit => self.words(count, |w| NumberType::U8.parse_float(w)).map(Some),
            Kind::Text => self.skip_texts(count).map(|()| None),
        }
    }

    fn integers(&mut self, count: usize, number: NumberType) -> Result<Vec<i64>, ReadReason> {
        self.skip_line();
        if self.binary {
            let bytes = self.take(count.checked_mul(number.size()))?;
            if self.skims { Ok(Vec::new()) } else { number.integers(bytes, true) }
        } else if self.skims {
            self.skip_words(count)?;
            Ok(Vec::new())
        } else {
            self.words(count, |w| number.parse_integer(w))
        }
    }

    /// Steps over texts: a line each, or in binary files each with its length, whose first two bits say how long
    /// the length itself is.
    fn skip_texts(&mut self, count: usize) -> Result<(), ReadReason> {
        for found in 0..count {
            let Some(first) = self.rest().first() else {
                return Err(ReadReason::Truncated { needed: count as u64, found: found as u64 });
            };
            if !self.binary {
                self.skip_line();
                continue;
            }
            let header = self.take(Some(8 >> (first >> 6)))?;
            let length = header[1..].iter().fold(u64::from(header[0] & 0x3f), |n, b| n << 8 | u64::from(*b));
            self.take(usize::try_from(length).ok())?;
        }
        Ok(())
    }

    /// Reads a METADATA block, which ends at an empty line; returns the unit of the array before it, if there is one.
    fn metadata(&mut self) -> Option<String> {
        let mut unit = None;
        let mut is_unit = false;
        self.skip_line();
        while !self.rest().is_empty() {
            let start = self.at;
            self.skip_line();
            let line = self.bytes[start..self.at].trim_ascii();
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

    /// A FIELD block, its keyword read.
    fn field_block(&mut self) -> Result<Vec<ArrayData>, ReadReason> {
        self.word()?;
        let arrays = self.count()?;
        let mut list = Vec::new();
        for _ in 0..arrays {
            let mut name = self.word()?;
            if name.eq_ignore_ascii_case("metadata") {
                // What is known of the array before this one.
                let unit = self.metadata().unwrap_or_default();
                list.last_mut().into_iter().for_each(|array: &mut ArrayData| array.unit.clone_from(&unit));
                name = self.word()?;
            }
            if name == "NULL_ARRAY" {
                self.skip_line();
                continue;
            }
            let (components, tuples) = (self.count()?, self.count()?);
            let kind = Kind::named(self.word()?)?;
            if let Some(values) = self.floats(components.checked_mul(tuples), kind)? {
                let name = decoded_name(name);
                let integer = kind.is_integer();
                list.push(ArrayData { name, components, values, integer, unit: String::new() });
            }
        }
        Ok(list)
    }
}

fn text(bytes: &[u8]) -> Result<&str, ReadReason> {
    std::str::from_utf8(bytes).map_err(|_| ReadReason::Syntax("binary data where text is expected".into()))
}

/// Names are written with `%20` for a space and so on.
fn decoded_name(name: &str) -> String {
    let mut bytes = Vec::new();
    let mut rest = name.as_bytes();
    while let Some((&c, after)) = rest.split_first() {
        let code = after.get(..2).and_then(|h| std::str::from_utf8(h).ok());
        match code.filter(|_| c == b'%').and_then(|h| u8::from_str_radix(h, 16).ok()) {
            Some(code) => {
                bytes.push(code);
                rest = &after[2..];
            }
            None => {
                bytes.push(c);
                rest = after;
            }
        }
    }
    String::from_utf8(bytes).unwrap_or_else(|_| name.to_owned())
}

struct ArrayData {
    name: String,
    components: usize,
    values: Vec<f64>,
    integer: bool,
    unit: String,
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
    positions: Option<Vec<f64>>,
    /// Those of a rectilinear grid, along each axis.
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
    time: Option<f64>,
    /// How many points there are.
    points: usize,
    /// The most values of a component that an array had.
    tuples: usize,
    /// Whether the file gives no numbers.
    skims: bool,
}

impl<'a> Body<'a> {
    fn new(options: &'a ReadOptions, time: Option<f64>) -> Self {
        let [fields, cell_fields] = [(); 2].map(|()| Collector::new(options.fields.as_deref()));
        Self { fields, cell_fields, cell_data: options.cells, time, ..Self::default() }
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
                let kind = Kind::named(file.word()?)?;
                let values = file.floats(count.checked_mul(3), kind)?;
                self.positions =
                    Some(values.ok_or_else(|| ReadReason::Syntax("points made of text".into()))?);
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
                let kind = Kind::named(file.word()?)?;
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
                let what = format!("a data set of type POLYDATA with {}", keyword.to_ascii_uppercase());
                let remedy = "give an unstructured grid of tetrahedra, or points alone".into();
                return Err(ReadReason::Unsupported { what, remedy });
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
                let arrays = file.field_block()?;
                if self.owner == Owner::Nothing {
                    self.time = time_in(&arrays).or(self.time);
                }
                for array in arrays {
                    self.keep(array)?;
                }
            }
            _ => self.attribute(file, keyword)?,
        }
        Ok(())
    }

    fn cells(&mut self, file: &mut Reader<'_>) -> Result<(), ReadReason> {
        let (count, size) = (file.count()?, file.count()?);
        if file.version < 5 {
            self.cells = Some(count);
            self.connectivity = file.integers(size, NumberType::I32)?;
            return Ok(());
        }
        self.cells = Some(count.saturating_sub(1));
        for (expected, length) in [("offsets", count), ("connectivity", size)] {
            let word = file.word()?;
            if !word.eq_ignore_ascii_case(expected) {
                return Err(instead(word, &expected.to_ascii_uppercase()));
            }
            let Kind::Number(number) = Kind::named(file.word()?)? else {
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
                return Err(ReadReason::Syntax(format!("keyword \"{}\" is not known", shortened(other))));
            }
        };
        let name = decoded_name(file.word()?);
        let bytes_or_floats = Kind::Number(if file.binary { NumberType::U8 } else { NumberType::F32 });
        let (components, tuples, kind) = match (keyword, fixed) {
            (_, Some(components)) => (components, owned, Kind::named(file.word()?)?),
            ("color_scalars", _) => (file.count()?, owned, bytes_or_floats),
            ("lookup_table", _) => (4, file.count()?, bytes_or_floats),
            ("texture_coordinates", _) => (file.count()?, owned, Kind::named(file.word()?)?),
            _ => {
                let kind = Kind::named(file.word()?)?;
                (scalar_components(file)?, owned, kind)
            }
        };
        let values = file.floats(components.checked_mul(tuples), kind)?;
        let integer = kind.is_integer();
        match values {
            Some(values) if keyword != "lookup_table" => {
                self.keep(ArrayData { name, components, values, integer, unit: String::new() })
            }
            _ => Ok(()),
        }
    }

    /// The fields of the owner of what was read last.
    fn last_fields(&mut self) -> &mut Collector<'a> {
        if matches!(self.owner, Owner::Cells(_)) { &mut self.cell_fields } else { &mut self.fields }
    }

    /// Makes fields of an array at points and, if they are asked for, at cells; others are read and left out.
    fn keep(&mut self, array: ArrayData) -> Result<(), ReadReason> {
        self.tuples = self.tuples.max(array.values.len() / array.components.max(1));
        let (fields, tuples, values) = match self.owner {
            Owner::Points(points) => (&mut self.fields, points, true),
            Owner::Cells(cells) if self.cell_data != CellData::LeaveOut => {
                (&mut self.cell_fields, cells, self.cell_data == CellData::Values)
            }
            _ => return Ok(()),
        };
        let ArrayData { name, components, values: numbers, integer, unit } = array;
        if self.skims {
            let claim = fields.claim(&name, components)?;
            claim.into_iter().for_each(|claim| fields.keep_names(claim, &unit));
            return Ok(());
        }
        if tuples.checked_mul(components) != Some(numbers.len()) {
            let what = format!("values of \"{name}\"");
            let expected = (tuples as u64).saturating_mul(components as u64);
            return Err(ReadReason::Count { what, expected, found: numbers.len() as u64 });
        }
        let Some(claim) = fields.claim(&name, components)? else { return Ok(()) };
        if !values {
            fields.keep_names(claim, &unit);
            return Ok(());
        }
        fields.fill(claim, numbers, integer, &unit).map_err(|reason| match (self.owner, reason) {
            (Owner::Cells(_), ReadReason::NotFinite { point }) => ReadReason::NotFiniteCell { cell: point },
            (_, reason) => reason,
        })
    }

    /// The fields at cells, of which there are `cells`.
    fn take_cell_fields(&mut self, cells: usize) -> Result<Vec<Field>, ReadReason> {
        if self.cell_data == CellData::Values {
            check_values(&self.cell_fields, cells as u64)?;
        }
        Ok(std::mem::take(&mut self.cell_fields.fields))
    }

    fn checked_positions(&self) -> Result<Vec<[f64; 3]>, ReadError> {
        let coordinates = self.positions.as_deref().ok_or_else(|| missing("POINTS")).at(String::new)?;
        check_values(&self.fields, coordinates.len() as u64 / 3).at(|| "POINT_DATA".into())?;
        points_from(coordinates).at(|| "POINTS".into())
    }

    fn points_alone(self) -> Result<TetMesh, ReadError> {
        Ok(TetMesh { positions: self.checked_positions()?, fields: self.fields.fields, ..TetMesh::default() })
    }

    fn unstructured(mut self, since_5: bool) -> Result<TetMesh, ReadError> {
        let cells = self.cells.ok_or_else(|| missing("CELLS")).at(String::new)?;
        let positions = self.checked_positions()?;
        expect("cell types", cells, self.types.len()).at(|| "CELL_TYPES".into())?;
        if cells > 0 && cells::are_points(&self.types) {
            return Ok(TetMesh { positions, fields: self.fields.fields, ..TetMesh::default() });
        }
        cells::most_tets(&self.types).at(|| "CELL_TYPES".into())?;
        let list = if since_5 { self.indices_by_offsets(cells) } else { self.indices_by_counts(cells) };
        let (ends, connectivity) = list.at(|| "CELLS".into())?;
        let numbering = Numbering::From { first: 0, points: positions.len() };
        let types = std::mem::take(&mut self.types);
        let split = CellList { types, ends, connectivity }.split(&numbering).at(|| "CELLS".into())?;
        let mut cell_fields = self.take_cell_fields(cells).at(|| "CELL_DATA".into())?;
        split.spread(&mut cell_fields);
        Ok(TetMesh {
            positions,
            fields: self.fields.fields,
            tets: split.tets,
            cell_fields,
            ..TetMesh::default()
        })
    }

    /// Where each cell ends in the list of indices, and that.
    fn indices_by_offsets(&mut self, cells: usize) -> Result<(Vec<i64>, Vec<i64>), ReadReason> {
        let mut ends = std::mem::take(&mut self.offsets);
        if ends.first().is_some_and(|s| *s != 0) {
            return Err(ReadReason::Syntax("the offsets do not start at 0".into()));
        }
        ends.drain(..ends.len().min(1));
        expect("offsets of cells", cells, ends.len())?;
        let length = cells::checked_ends(&self.types, &ends)?;
        expect("numbers in the cell list", length, self.connectivity.len())?;
        Ok((ends, std::mem::take(&mut self.connectivity)))
    }

    fn indices_by_counts(&mut self, cells: usize) -> Result<(Vec<i64>, Vec<i64>), ReadReason> {
        let counted = std::mem::take(&mut self.connectivity);
        let short = || ReadReason::Count {
            what: "cells in the cell list".into(),
            expected: cells as u64,
            found: counted.len() as u64,
        };
        let mut ends = Vec::with_capacity(cells);
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
        expect("numbers in the cell list", counted.len() - rest.len(), counted.len())?;
        cells::checked_ends(&self.types, &ends)?;
        Ok((ends, connectivity))
    }

    fn grid(&self) -> Result<Grid, ReadError> {
        let place = || "DIMENSIONS".to_owned();
        let dims = self.dims.ok_or_else(|| ReadReason::Missing("DIMENSIONS".into())).at(place)?;
        image::checked_grid(dims, self.origin, self.spacing.unwrap_or([1.0; 3])).at(place)
    }

    /// A grid whose coordinates are given along each axis.
    fn rectilinear(mut self) -> Result<TetMesh, ReadError> {
        let dims = structured::checked_dims(self.dims.unwrap_or_default()).at(|| "DIMENSIONS".to_owned())?;
        for (axis, name) in ["X_COORDINATES", "Y_COORDINATES", "Z_COORDINATES"].into_iter().enumerate() {
            let found = self.coordinates[axis].len();
            expect("coordinates", dims[axis] as usize, found).at(|| name.to_owned())?;
        }
        let coordinates = std::mem::take(&mut self.coordinates);
        // Without, a few coordinates claim any size.
        if self.tuples < structured::cubes(dims) {
            let what = "an array with a value for every point or cell".into();
            return Err(ReadReason::Missing(what)).at(String::new);
        }
        self.curvilinear(structured::rectilinear(&coordinates))
    }

    /// A grid of which each point has a place of its own: these, or those of the section POINTS.
    fn curvilinear(mut self, positions: Vec<f64>) -> Result<TetMesh, ReadError> {
        let place = || "DIMENSIONS".to_owned();
        let dims = self.dims.ok_or_else(|| missing("DIMENSIONS")).at(place)?;
        let dims = structured::checked_dims(dims).at(place)?;
        if !positions.is_empty() {
            self.positions = Some(positions);
        }
        let positions = self.checked_positions()?;
        let cubes = structured::cubes(dims);
        let cell_fields = self.take_cell_fields(cubes).at(|| "CELL_DATA".into())?;
        structured::mesh(dims, positions, self.fields.fields, cell_fields).at(|| "POINTS".into())
    }

    fn structured(mut self) -> Result<TetMesh, ReadError> {
        let grid = self.grid()?;
        let product = |less: u32| grid.dims.iter().map(|&d| u64::from(d - less)).product::<u64>();
        check_values(&self.fields, product(0)).at(|| "POINT_DATA".into())?;
        // Fewer cubes than points, which were counted.
        let cubes = product(1) as usize;
        let cell_fields = self.take_cell_fields(cubes).at(|| "CELL_DATA".into())?;
        image::grid_mesh(grid, self.fields.fields, cell_fields).at(|| "POINT_DATA".into())
    }
}

fn check_values(fields: &Collector<'_>, expected: u64) -> Result<(), ReadReason> {
    match fields.fields.first() {
        Some(field) if field.values.len() as u64 != expected => {
            let found = field.values.len() as u64;
            Err(ReadReason::Count { what: "values a field".into(), expected, found })
        }
        _ => Ok(()),
    }
}

fn missing(section: &str) -> ReadReason {
    ReadReason::Missing(format!("section {section}"))
}

/// Checks a count. Counts of what was read are far from overflow.
fn expect(what: &str, expected: usize, found: usize) -> Result<(), ReadReason> {
    if expected == found {
        return Ok(());
    }
    Err(ReadReason::Count { what: what.into(), expected: expected as u64, found: found as u64 })
}

/// The number of components after the type of SCALARS, and the LOOKUP_TABLE line, but for its end.
fn scalar_components(file: &mut Reader<'_>) -> Result<usize, ReadReason> {
    let line = file.line()?.trim();
    let components = if line.is_empty() { Ok(1) } else { line.parse() };
    let components = components
        .map_err(|_| ReadReason::Syntax(format!("\"{}\" is not a number of components", shortened(line))))?;
    let word = file.word()?;
    if !word.eq_ignore_ascii_case("lookup_table") {
        return Err(instead(word, "LOOKUP_TABLE"));
    }
    file.word()?;
    Ok(components)
}
