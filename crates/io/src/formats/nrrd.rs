//! NRRD (`.nrrd`, and `.nhdr` with its samples in other files): three-dimensional; raw, hexadecimal, gzip or text; samples of
//! several values, on any of the axes. By <https://teem.sourceforge.net/nrrd/format.html>, with the defaults of that library.
//!
//! Positions are in the space of the file, whatever its name: nothing is turned to another.

use std::borrow::Cow;

use crate::error::{At, ReadError, ReadReason, expect_count};
use crate::formats::volume::{
    Axis, MAX_COMPONENTS, SampleArray, Start, Volume, first, from_files, from_text, last_unpacked,
    numbered_files, numbers, unpacked, wrong_dimensions,
};
use crate::number::NumberType;
use crate::options::{Beside, ReadOptions};
use crate::scanner::Scanner;
use crate::{MemoryLimit, error};
use flate2::read::MultiGzDecoder;
use tetralod::mesh::TetMesh;

/// How every file begins.
pub(super) const MAGIC: &[u8] = b"NRRD00";

/// What a header says.
#[derive(Default)]
struct Header {
    kind: String,
    dimension: Option<usize>,
    sizes: Vec<u64>,
    kinds: Vec<String>,
    encoding: String,
    endian: Option<String>,
    spacings: Vec<f64>,
    mins: Vec<f64>,
    maxs: Vec<f64>,
    centers: Vec<String>,
    directions: Option<String>,
    origin: String,
    space_dimension: Option<usize>,
    /// The files with the samples; none if they follow.
    files: Vec<String>,
    content: String,
    unit: String,
    byte_skip: i64,
    line_skip: usize,
    /// What the samples were quantized from.
    old: [Option<String>; 2],
    has_frame: bool,
}

/// Reads a file, and those that it refers to.
pub(super) fn read(bytes: &[u8], options: &ReadOptions, beside: Beside<'_>) -> Result<TetMesh, ReadError> {
    let (header, data) = read_header(bytes).at(|| "header".into())?;
    let volume = header.volume().at(|| "header".into())?;
    let expected = volume.bytes().at(|| "header".into())?;
    let memory = &options.memory;
    let _held = memory.hold(expected as u64).at(|| "samples".into())?;
    let samples = |data: &[u8], count: usize| header.samples(data, &volume, count, memory);
    let samples = if header.files.is_empty() {
        samples(data, expected).at(|| "samples".into())?
    } else {
        from_files(("data file", &header.files), expected, beside, samples)?
    };
    volume.mesh(&samples, options).at(|| "samples".into())
}

/// The names of the files with the samples.
pub(super) fn named_by(bytes: &[u8]) -> Vec<String> {
    read_header(bytes).map_or_else(|_| Vec::new(), |(header, _)| header.files)
}

/// The samples that stand in a file as they are, which begins with these bytes: the name of another file that has them, and where there; none if
/// they do not.
pub(super) fn in_file(head: &[u8]) -> Option<(Volume, Option<String>, Start)> {
    let (header, rest) = read_header(head).ok()?;
    let volume = header.volume().ok()?;
    if header.encoding != "raw" || header.line_skip > 0 || header.files.len() > 1 {
        return None;
    }
    let before = if header.files.is_empty() { head.len() - rest.len() } else { 0 } as u64;
    let start = match u64::try_from(header.byte_skip) {
        Ok(skip) => Start::At(before + skip),
        Err(_) => Start::BeforeEnd(header.byte_skip.saturating_add(1).unsigned_abs()),
    };
    Some((volume, header.files.into_iter().next(), start))
}

/// The header, which an empty line ends, and what follows.
fn read_header(bytes: &[u8]) -> Result<(Header, &[u8]), ReadReason> {
    let (mut header, mut lines) = (Header::default(), Scanner::new(bytes));
    let mut is_list = false;
    for number in 0_usize.. {
        let line = String::from_utf8_lossy(lines.line());
        match line.as_ref() {
            "" => break,
            _ if number == 0 => check_version(&line)?,
            file if is_list => header.files.push(file.to_owned()),
            comment if comment.starts_with('#') => {}
            line => is_list = header.line(line)?,
        }
    }
    if is_list && header.files.is_empty() {
        return Err(ReadReason::Missing("the list of data files".into()));
    }
    Ok((header, lines.rest()))
}

fn check_version(line: &str) -> Result<(), ReadReason> {
    let version = line.get(MAGIC.len()..).and_then(|version| version.parse::<u32>().ok());
    if version.is_some_and(|version| (1..=5).contains(&version)) {
        return Ok(());
    }
    let what = format!("version \"{}\"", error::shown(line));
    Err(ReadReason::unsupported(what, "write it as NRRD0005 or before"))
}

impl Header {
    /// Takes a line; returns whether the names of files follow.
    fn line(&mut self, line: &str) -> Result<bool, ReadReason> {
        let field = line.find(": ").or_else(|| line.ends_with(':').then(|| line.len() - 1));
        let pair = line.find(":=");
        match (field, pair) {
            // Pairs of keys and values are for users.
            (field, Some(pair)) if field.is_none_or(|field| pair < field) => Ok(false),
            (Some(at), _) => self.set(&line[..at].trim().to_ascii_lowercase(), line[at + 1..].trim()),
            _ => Err(ReadReason::Syntax(format!("\"{}\" is no field", shown(line)))),
        }
    }

    fn set(&mut self, key: &str, value: &str) -> Result<bool, ReadReason> {
        let lower = value.to_ascii_lowercase();
        let words = || lower.split_ascii_whitespace().map(str::to_owned).collect::<Vec<_>>();
        match key {
            "type" => self.kind = lower,
            "dimension" => self.dimension = Some(first(value, key)?.unwrap_or(0)),
            "sizes" => self.sizes = numbers(value, key)?,
            "kinds" => self.kinds = words(),
            "encoding" => self.encoding = lower,
            "endian" => self.endian = Some(lower),
            "spacings" => self.spacings = numbers(value, key)?,
            "axis mins" | "axismins" => self.mins = numbers(value, key)?,
            "axis maxs" | "axismaxs" => self.maxs = numbers(value, key)?,
            "centers" | "centerings" => self.centers = words(),
            "space directions" => self.directions = Some(value.to_owned()),
            "space origin" => value.clone_into(&mut self.origin),
            "space dimension" => self.space_dimension = first(value, key)?,
            "space" if lower.ends_with("-time") || lower.ends_with('t') && lower.len() == 4 => {
                self.space_dimension = Some(4);
            }
            "data file" | "datafile" => return self.set_files(value),
            "content" => value.clone_into(&mut self.content),
            "sample units" | "sampleunits" => value.trim_matches('"').clone_into(&mut self.unit),
            "byte skip" | "byteskip" => self.byte_skip = first(value, key)?.unwrap_or(0),
            "line skip" | "lineskip" => self.line_skip = first(value, key)?.unwrap_or(0),
            "old min" | "oldmin" => self.old[0] = Some(value.to_owned()),
            "old max" | "oldmax" => self.old[1] = Some(value.to_owned()),
            "measurement frame" => self.has_frame = true,
            // These change neither places nor values.
            "space" | "space units" | "units" | "labels" | "thicknesses" | "number" | "min" | "max"
            | "block size" | "blocksize" => {}
            other => {
                let what = format!("the field \"{}\"", shown(other));
                let remedy = "leave it out, or write it as a pair with := if it is a remark";
                return Err(ReadReason::unsupported(what, remedy));
            }
        }
        Ok(false)
    }

    /// Takes the name of a file, or a pattern of names; returns whether a list follows.
    fn set_files(&mut self, value: &str) -> Result<bool, ReadReason> {
        let words: Vec<&str> = value.split_ascii_whitespace().collect();
        if words.first() == Some(&"LIST") {
            return Ok(true);
        }
        self.files = match *words.as_slice() {
            [pattern, first, last, step] | [pattern, first, last, step, _] if pattern.contains('%') => {
                numbered_files(pattern, parsed([first, last, step], "data file")?)?
            }
            _ => vec![value.to_owned()],
        };
        Ok(false)
    }

    fn volume(&self) -> Result<Volume, ReadReason> {
        if self.kind == "block" {
            return Err(ReadReason::unsupported("samples of type block", "write them as numbers"));
        }
        let number = number_type(&self.kind)
            .ok_or_else(|| ReadReason::Syntax(format!("type \"{}\" is not known", shown(&self.kind))))?;
        if let Some(dimension) = self.space_dimension.filter(|dimension| *dimension != 3) {
            return Err(wrong_dimensions(dimension));
        }
        let axes = self.axes()?;
        let space: Vec<usize> = (0..axes.len()).filter(|&axis| axes[axis].is_space).collect();
        let Ok(space) = <[usize; 3]>::try_from(space.as_slice()) else {
            return Err(wrong_dimensions(space.len()));
        };
        let mut volume = Volume {
            dims: space.map(|axis| self.sizes[axis]),
            axes,
            number,
            big: self.is_big(number)?,
            origin: [0.0; 3],
            steps: [[0.0; 3]; 3],
            field: if self.content.is_empty() { "value".to_owned() } else { self.content.clone() },
            unit: self.unit.clone(),
            arrays: Vec::new(),
            notes: self.notes(),
        };
        if volume.components() > MAX_COMPONENTS {
            return Err(ReadReason::TooLarge { what: "values of a sample".into(), limit: MAX_COMPONENTS });
        }
        volume.arrays = self.arrays(&volume)?;
        self.place(&mut volume, space)?;
        Ok(volume)
    }

    /// Which axes are of space: those with a direction, else those that `kinds` says are, else all three that there are.
    fn axes(&self) -> Result<Vec<Axis>, ReadReason> {
        let count = self.sizes.len();
        let lists =
            [("kinds", self.kinds.len()), ("spacings", self.spacings.len()), ("axis mins", self.mins.len())];
        let more = [("axis maxs", self.maxs.len()), ("centerings", self.centers.len())];
        let given = self.dimension.map_or(count, |dimension| dimension);
        let wrong = lists.into_iter().chain(more).find(|(_, found)| *found > 0 && *found != count);
        let wrong = wrong.or((given != count).then_some(("dimension", given)));
        if let Some((what, found)) = wrong {
            expect_count(format!("axes in \"{what}\""), count, found)?;
        }
        let mut is_space = self.of_directions(count)?;
        for (axis, kind) in self.kinds.iter().enumerate() {
            check_kind(kind, self.sizes[axis])?;
            let known = match kind.as_str() {
                "???" | "none" => None,
                kind => Some(matches!(kind, "domain" | "space")),
            };
            is_space[axis] = is_space[axis].or(known);
        }
        let of_space = is_space.iter().filter(|known| **known == Some(true)).count();
        let unknown = is_space.iter().filter(|known| known.is_none()).count();
        if of_space < 3 && of_space + unknown > 3 {
            let what = format!("{count} axes without \"kinds\", of which it is not said which are of space,");
            let remedy = "add the field, such as \"kinds: vector domain domain domain\"";
            return Err(ReadReason::unsupported(what, remedy));
        }
        // Axes of which nothing is said are of space while these are less than three.
        let axis = |(size, known): (&u64, &Option<bool>)| Axis {
            size: *size,
            is_space: known.unwrap_or(of_space < 3),
        };
        Ok(self.sizes.iter().zip(&is_space).map(axis).collect())
    }

    /// Which axes have a direction in space; of none it is known without such a field.
    fn of_directions(&self, count: usize) -> Result<Vec<Option<bool>>, ReadReason> {
        let Some(text) = &self.directions else { return Ok(vec![None; count]) };
        let found: Vec<Option<bool>> = vectors(text)?.iter().map(|vector| Some(vector.is_some())).collect();
        expect_count("axes in \"space directions\"", count, found.len())?;
        Ok(found)
    }

    fn is_big(&self, number: NumberType) -> Result<bool, ReadReason> {
        match self.endian.as_deref() {
            Some("big") => Ok(true),
            Some("little") => Ok(false),
            Some(other) => Err(ReadReason::Syntax(format!("endian \"{}\" is not known", shown(other)))),
            None if number.size() == 1 || is_text(&self.encoding) => Ok(false),
            None => Err(ReadReason::Missing("the field \"endian\"".into())),
        }
    }

    /// What the values of a sample are, by the kind of their axis.
    fn arrays(&self, volume: &Volume) -> Result<Vec<SampleArray>, ReadReason> {
        let of_values = (0..volume.axes.len()).filter(|&axis| !volume.axes[axis].is_space);
        let of_values: Vec<usize> = of_values.collect();
        let count = volume.components() as usize;
        if count == 0 {
            return Err(ReadReason::Syntax("samples without values".into()));
        }
        let kind = match *of_values {
            [axis] => self.kinds.get(axis).map_or("???", String::as_str),
            _ => "list",
        };
        Ok(arrays_of(kind, count))
    }

    /// Sets where the samples are.
    fn place(&self, volume: &mut Volume, space: [usize; 3]) -> Result<(), ReadReason> {
        let directions = self.directions.as_deref().map(vectors).transpose()?.unwrap_or_default();
        for (i, &axis) in space.iter().enumerate() {
            if let Some(Some(direction)) = directions.get(axis) {
                volume.steps[i] = *direction;
            } else {
                let (first, step) = self.along(axis)?;
                volume.steps[i][i] = step;
                volume.origin[i] = first;
            }
        }
        if let Some(origin) = vectors(&self.origin)?.first().copied().flatten() {
            volume.origin = origin;
        }
        Ok(())
    }

    /// The first place along an axis, and the step to the next. Where it is not said whether samples are in the middle of cells
    /// or at nodes, they are in cells: as the library of the format has it.
    fn along(&self, axis: usize) -> Result<(f64, f64), ReadReason> {
        let of = |list: &[f64]| list.get(axis).copied().filter(|x| x.is_finite());
        let (spacing, min, max) = (of(&self.spacings), of(&self.mins), of(&self.maxs));
        let centering = self.centers.get(axis).map_or("cell", String::as_str);
        let is_node = match centering {
            "node" => true,
            "cell" | "???" | "none" => false,
            other => return Err(ReadReason::Syntax(format!("centering \"{}\" is not known", shown(other)))),
        };
        let size = self.sizes[axis] as f64;
        let steps = if is_node { size - 1.0 } else { size };
        let between = min.zip(max).map(|(min, max)| (max - min) / steps);
        let step = spacing.or(between).unwrap_or(1.0);
        let low = min.or(max.map(|max| max - steps * step));
        let first = low.map_or(0.0, |low| if is_node { low } else { low + step / 2.0 });
        if step == 0.0 || !step.is_finite() {
            return Err(ReadReason::Syntax(format!("axis {axis} has a spacing of {step}")));
        }
        Ok((first, step))
    }

    /// What is not applied to the values.
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.old.iter().any(Option::is_some) {
            let [min, max] = self.old.each_ref().map(|old| old.as_deref().unwrap_or("?"));
            notes.push(format!("the values are those of the file, which were quantized from {min} to {max}"));
        }
        if self.has_frame {
            notes.push("components of vectors and tensors stay in the measurement frame of the file".into());
        }
        notes
    }

    /// The `expected` bytes of samples in the data of a file.
    fn samples(
        &self,
        data: &[u8],
        volume: &Volume,
        expected: usize,
        memory: &MemoryLimit,
    ) -> Result<Vec<u8>, ReadReason> {
        let mut lines = Scanner::new(data);
        for _ in 0..self.line_skip {
            lines.skip_line();
            if lines.rest().is_empty() {
                break;
            }
        }
        let data = lines.rest();
        // Minus one: the samples are the end of the data; minus two: a byte stands behind them.
        let skipped = usize::try_from(self.byte_skip);
        let behind = self.byte_skip.saturating_add(1).unsigned_abs() as usize;
        match self.encoding.as_str() {
            "raw" => {
                let start =
                    skipped.unwrap_or_else(|_| data.len().saturating_sub(expected.saturating_add(behind)));
                exactly(data, start, expected)
            }
            "gzip" | "gz" => {
                // Bytes are skipped behind the compression.
                let packed = MultiGzDecoder::new(data);
                if let Ok(skip) = skipped {
                    memory.expect(skip as u64)?;
                    let all = unpacked(packed, expected.saturating_add(skip))?;
                    return exactly(&all, skip, expected);
                }
                let mut last = last_unpacked(packed, expected.saturating_add(behind))?;
                last.truncate(last.len().saturating_sub(behind));
                Ok(last)
            }
            encoding if is_text(encoding) || encoding == "hex" => {
                let start = skipped.map_err(|_| {
                    ReadReason::Syntax(format!("byte skip {} in encoding {encoding}", self.byte_skip))
                })?;
                let data = data.get(start..).unwrap_or_default();
                if encoding == "hex" { from_hex(data) } else { from_text(data, volume.number, volume.big) }
            }
            "" => Err(ReadReason::Missing("the field \"encoding\"".into())),
            other => Err(ReadReason::unsupported(
                format!("samples in encoding \"{}\"", shown(other)),
                "write them as raw or gzip",
            )),
        }
    }
}

/// What of a text is put into messages.
fn shown(text: &str) -> Cow<'_, str> {
    if text.len() <= 48 { text.into() } else { text.chars().take(48).collect::<String>().into() }
}

fn parsed<const N: usize>(words: [&str; N], key: &str) -> Result<[i64; N], ReadReason> {
    let list: Vec<i64> = numbers(&words.join(" "), key)?;
    list.try_into().map_err(|_| ReadReason::Syntax(format!("{key} is not {N} numbers")))
}

fn is_text(encoding: &str) -> bool {
    matches!(encoding, "text" | "txt" | "ascii")
}

fn exactly(data: &[u8], start: usize, expected: usize) -> Result<Vec<u8>, ReadReason> {
    let rest = data.get(start..).unwrap_or_default();
    let (needed, found) = (expected as u64, rest.len() as u64);
    rest.get(..expected).map(<[u8]>::to_vec).ok_or(ReadReason::Truncated { needed, found })
}

/// Bytes of two hexadecimal digits each.
fn from_hex(data: &[u8]) -> Result<Vec<u8>, ReadReason> {
    let digit = |c: &u8| char::from(*c).to_digit(16).map(|digit| digit as u8);
    let digits: Option<Vec<u8>> = data.iter().filter(|c| !c.is_ascii_whitespace()).map(digit).collect();
    let digits = digits.ok_or_else(|| ReadReason::Syntax("the samples are not hexadecimal digits".into()))?;
    Ok(digits.as_chunks::<2>().0.iter().map(|[high, low]| high << 4 | low).collect())
}

/// Refuses a kind of axis that is not known, or does not go with its size.
fn check_kind(kind: &str, size: u64) -> Result<(), ReadReason> {
    let expected = match kind {
        "domain" | "space" | "time" | "list" | "point" | "vector" | "covariant-vector" | "normal" | "???"
        | "none" => return Ok(()),
        "stub" | "scalar" => 1,
        "complex" | "2-vector" => 2,
        "3-color"
        | "rgb-color"
        | "hsv-color"
        | "xyz-color"
        | "3-vector"
        | "3-gradient"
        | "3-normal"
        | "2d-symmetric-matrix" => 3,
        "4-color" | "rgba-color" | "4-vector" | "quaternion" | "2d-matrix" | "2d-masked-symmetric-matrix" => {
            4
        }
        "2d-masked-matrix" => 5,
        "3d-symmetric-matrix" => 6,
        "3d-masked-symmetric-matrix" => 7,
        "3d-matrix" => 9,
        "3d-masked-matrix" => 10,
        other => {
            let what = format!("an axis of kind \"{}\"", shown(other));
            return Err(ReadReason::unsupported(what, "write it as a list"));
        }
    };
    expect_count(format!("values of kind {kind}"), expected, size)
}

/// The arrays that the values on an axis of a kind become. Symmetric tensors get the order that VTK has.
fn arrays_of(kind: &str, count: usize) -> Vec<SampleArray> {
    let named = SampleArray::named;
    let tensor = |first: usize, order: &[usize]| SampleArray {
        components: order.iter().map(|c| c + first).collect(),
        ..SampleArray::vector(order.len()).remove(0)
    };
    let masked = |tensor: SampleArray| {
        vec![
            tensor,
            SampleArray {
                ending: "_mask",
                components: vec![0],
                names: vec!["mask".into()],
                has_length: false,
            },
        ]
    };
    let plane = |first: usize, names: &[&str]| SampleArray {
        components: (first..first + names.len()).collect(),
        has_length: true,
        ..named(names).remove(0)
    };
    match kind {
        "rgb-color" => named(&["r", "g", "b"]),
        "rgba-color" => named(&["r", "g", "b", "a"]),
        "hsv-color" => named(&["h", "s", "v"]),
        "xyz-color" => named(&["x", "y", "z"]),
        "complex" => named(&["re", "im"]),
        "quaternion" => named(&["w", "x", "y", "z"]),
        "vector" | "covariant-vector" | "normal" | "point" | "2-vector" | "3-vector" | "3-gradient"
        | "3-normal" | "???" | "none"
            if count == 2 || count == 3 =>
        {
            SampleArray::vector(count)
        }
        "2d-symmetric-matrix" => vec![plane(0, &["xx", "xy", "yy"])],
        "2d-masked-symmetric-matrix" => masked(plane(1, &["xx", "xy", "yy"])),
        "2d-matrix" => vec![plane(0, &["xx", "xy", "yx", "yy"])],
        "2d-masked-matrix" => masked(plane(1, &["xx", "xy", "yx", "yy"])),
        "3d-symmetric-matrix" => vec![tensor(0, &SYMMETRIC)],
        "3d-masked-symmetric-matrix" => masked(tensor(1, &SYMMETRIC)),
        "3d-matrix" => SampleArray::vector(9),
        "3d-masked-matrix" => masked(tensor(1, &[0, 1, 2, 3, 4, 5, 6, 7, 8])),
        _ => SampleArray::numbered(count),
    }
}

/// Where `xx`, `yy`, `zz`, `xy`, `yz`, `xz` are in the upper triangle of a matrix, row by row.
const SYMMETRIC: [usize; 6] = [0, 3, 5, 1, 4, 2];

fn number_type(name: &str) -> Option<NumberType> {
    Some(match name {
        "signed char" | "int8" | "int8_t" => NumberType::I8,
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => NumberType::U8,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => NumberType::I16,
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => NumberType::U16,
        "int" | "signed int" | "int32" | "int32_t" => NumberType::I32,
        "uint" | "unsigned int" | "uint32" | "uint32_t" => NumberType::U32,
        "longlong" | "long long" | "long long int" | "signed long long" | "int64" | "int64_t" => {
            NumberType::I64
        }
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => {
            NumberType::U64
        }
        "float" => NumberType::F32,
        "double" => NumberType::F64,
        _ => return None,
    })
}

/// A vector for each axis, as `(1,0,0) none (0,1,0)`: none for one that is not of space.
fn vectors(text: &str) -> Result<Vec<Option<[f64; 3]>>, ReadReason> {
    let wrong = || ReadReason::Syntax(format!("\"{}\" is not vectors of three numbers", shown(text)));
    let mut vectors = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        if let Some(after) = rest.strip_prefix('(') {
            let (inside, after) = after.split_once(')').ok_or_else(wrong)?;
            let numbers: Option<Vec<f64>> = inside.split(',').map(|x| x.trim().parse().ok()).collect();
            let vector: [f64; 3] = numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(wrong)?;
            // Older files have vectors without numbers where there is none.
            vectors.push(Some(vector).filter(|vector| !vector.iter().all(|x| x.is_nan())));
            rest = after.trim_start();
        } else {
            rest = rest
                .strip_prefix("none")
                .or_else(|| rest.strip_prefix("???"))
                .ok_or_else(wrong)?
                .trim_start();
            vectors.push(None);
        }
    }
    Ok(vectors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::FileBytes;
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    fn read_bytes(bytes: &[u8]) -> Result<TetMesh, ReadError> {
        let beside = |name: &str| match name {
            "a.raw" => Ok((0..8).collect::<Vec<_>>()),
            other => Err(ReadReason::Io(other.into())),
        };
        read(bytes, &ReadOptions::default(), &|name| beside(name).map(FileBytes::from))
    }

    const HEADER: &str =
        "NRRD0004\n# a comment\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nspacings: 1 2 0.5\n";

    #[test]
    fn one_grid_in_every_encoding() {
        let samples: Vec<u8> = (0..8).collect();
        let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
        gzip.write_all(&samples).unwrap();
        let files = [
            [format!("{HEADER}encoding: raw\n\n").as_bytes(), &samples].concat(),
            [format!("{HEADER}encoding: gzip\n\n").as_bytes(), &gzip.finish().unwrap()].concat(),
            format!("{HEADER}encoding: ascii\n\n0 1 2 3\n4 5 6 7\n").into_bytes(),
            format!("{HEADER}encoding: ascii\n\n0, 1, 2, 3,\n4 5 6 7\n").into_bytes(),
            format!("{HEADER}encoding: hex\n\n0001 0203\n04050607\n").into_bytes(),
            format!("{HEADER}encoding: raw\ndata file: a.raw\n\n").into_bytes(),
            format!("{HEADER}encoding: raw\nbyte skip: -1\ndata file: a.raw\n\n").into_bytes(),
        ];
        for file in files {
            let mesh = read_bytes(&file).unwrap();
            let grid = mesh.grid.unwrap();
            assert_eq!((grid.dims, grid.spacing), ([2; 3], [1.0, 2.0, 0.5]));
            assert_eq!((mesh.fields[0].name.as_str(), mesh.fields[0].integer), ("value", true));
            assert_eq!(mesh.fields[0].values, [0., 1., 2., 3., 4., 5., 6., 7.]);
            (0..file.len()).for_each(|length| drop(read_bytes(&file[..length])));
        }
    }

    #[test]
    fn directions_and_samples_of_several_values() {
        let header = "NRRD0005\ntype: short\ndimension: 4\nspace: left-posterior-superior\nsizes: 2 2 2 2\ncontent: flow\n\
            space directions: none (-1,0,0) (0,0,2) (0,3,0)\nspace origin: (5,6,7)\nendian: big\nencoding: raw\n\n";
        let samples: Vec<u8> = (0..16).flat_map(i16::to_be_bytes).collect();
        let mesh = read_bytes(&[header.as_bytes(), &samples].concat()).unwrap();
        assert_eq!(mesh.grid, None);
        assert_eq!(
            (mesh.positions[1], mesh.positions[2], mesh.positions[4]),
            ([4., 6., 7.], [5., 6., 9.], [5., 9., 7.])
        );
        assert_eq!(mesh.fields[1].name, "flow_y");
        assert_eq!(mesh.fields[1].values[..3], [1.0, 3.0, 5.0]);
        assert_eq!(mesh.tets.len(), 6);
    }

    /// The file with these lines in its header, whose samples count from 0 as single bytes.
    fn of_lines(lines: &str, samples: u8) -> TetMesh {
        let header = format!("NRRD0005\ntype: uchar\nencoding: raw\n{lines}\n\n");
        read_bytes(&[header.into_bytes(), (0..samples).collect()].concat()).unwrap()
    }

    fn named(mesh: &TetMesh) -> Vec<(&str, f64)> {
        mesh.fields.iter().map(|field| (field.name.as_str(), field.values[1])).collect()
    }

    #[test]
    fn values_of_a_sample_on_any_axis() {
        let first = of_lines("dimension: 4\nsizes: 2 2 2 2\nkinds: list domain domain domain", 16);
        assert_eq!(named(&first), [("value_0", 2.0), ("value_1", 3.0)]);
        let last = of_lines("dimension: 4\nsizes: 2 2 2 2\nkinds: space space space time", 16);
        assert_eq!(named(&last), [("value_0", 1.0), ("value_1", 9.0)]);
        let middle =
            of_lines("dimension: 4\nsizes: 2 3 2 2\nkinds: domain vector domain domain\ncontent: v", 24);
        let expected = [("v_x", 1.0), ("v_y", 3.0), ("v_z", 5.0), ("v_magnitude", 35_f64.sqrt())];
        assert_eq!(named(&middle), expected);
        assert_eq!(middle.fields[0].values, [0.0, 1.0, 6.0, 7.0, 12.0, 13.0, 18.0, 19.0]);
        let by_directions = "dimension: 4\nsizes: 2 2 2 2\nspace directions: (1,0,0) (0,1,0) none (0,0,1)";
        assert_eq!(named(&of_lines(by_directions, 16))[..2], [("value_x", 1.0), ("value_y", 5.0)]);
        let colours = of_lines("dimension: 4\nsizes: 3 2 2 2\nkinds: RGB-color ??? ??? ???", 24);
        assert_eq!(named(&colours), [("value_r", 3.0), ("value_g", 4.0), ("value_b", 5.0)]);
        let two = of_lines("dimension: 5\nsizes: 2 2 2 2 2\nkinds: complex domain domain domain time", 32);
        assert_eq!(named(&two), [("value_0", 2.0), ("value_1", 3.0), ("value_2", 18.0), ("value_3", 19.0)]);
    }

    #[test]
    fn components_of_tensors_keep_their_names() {
        let tensor = |kind: &str, count: u8| {
            let lines = format!("dimension: 4\nsizes: {count} 2 2 2\nkinds: {kind} space space space");
            of_lines(&lines, 8 * count)
        };
        // Row by row: xx, xy, xz, yy, yz, zz.
        let symmetric = tensor("3D-symmetric-matrix", 6);
        let expected = [("xx", 6.0), ("yy", 9.0), ("zz", 11.0), ("xy", 7.0), ("yz", 10.0), ("xz", 8.0)];
        let expected = expected.map(|(name, value)| (format!("value_{name}"), value));
        let found: Vec<_> = symmetric.fields.iter().map(|f| (f.name.clone(), f.values[1])).take(6).collect();
        assert_eq!(found, expected);
        let masked = tensor("3D-masked-symmetric-matrix", 7);
        let follows =
            |name: &str| ["magnitude", "von_mises", "principal"].iter().any(|word| name.contains(word));
        let found: Vec<_> = named(&masked).into_iter().filter(|(name, _)| !follows(name)).collect();
        let expected =
            [("xx", 8.0), ("yy", 11.0), ("zz", 13.0), ("xy", 9.0), ("yz", 12.0), ("xz", 10.0), ("mask", 7.0)];
        let expected = expected.map(|(name, value)| (format!("value_{name}"), value));
        assert!(
            found.iter().copied().eq(expected.iter().map(|(name, value)| (name.as_str(), *value))),
            "{found:?}"
        );
        assert_eq!(named(&tensor("3D-matrix", 9))[5], ("value_yz", 14.0));
        assert_eq!(named(&tensor("2D-symmetric-matrix", 3))[2], ("value_yy", 5.0));
    }

    #[test]
    fn places_by_ends_of_axes() {
        let grid = |lines: &str| of_lines(&format!("dimension: 3\nsizes: 2 2 3\n{lines}"), 12).grid.unwrap();
        let at_nodes = grid("axis mins: 10 20 30\naxis maxs: 12 24 36\ncenterings: node node node");
        assert_eq!((at_nodes.origin, at_nodes.spacing), ([10.0, 20.0, 30.0], [2.0, 4.0, 3.0]));
        // Cells are what the library of the format takes where nothing is said.
        for centers in ["", "\ncenters: cell cell ???"] {
            let in_cells = grid(&format!("axismins: 10 20 30\naxismaxs: 12 24 36{centers}"));
            assert_eq!((in_cells.origin, in_cells.spacing), ([10.5, 21.0, 31.0], [1.0, 2.0, 2.0]));
        }
        let by_spacing = grid("axis mins: 10 20 nan\nspacings: 1 2 3\ncenterings: node cell node");
        assert_eq!((by_spacing.origin, by_spacing.spacing), ([10.0, 21.0, 0.0], [1.0, 2.0, 3.0]));
        let turned = of_lines("dimension: 3\nsizes: 2 2 2\nspacings: -1 2 3", 8);
        assert_eq!((turned.grid, turned.positions[7]), (None, [-1.0, 2.0, 3.0]));
    }

    #[test]
    fn what_is_not_applied_is_said() {
        let lines = "dimension: 3\nsizes: 2 2 2\nold min: -5\nold max: 7.5\nsample units: \"mm / s\"\nkey: x:=a: b\nk:=v";
        let mesh = of_lines(&lines.replace("key: x:=a: b\n", ""), 8);
        assert_eq!(mesh.notes, ["the values are those of the file, which were quantized from -5 to 7.5"]);
        assert_eq!(mesh.fields[0].unit, "mm / s");
        assert!(
            of_lines("dimension: 3\nsizes: 2 2 2\ncontent:\nlabels: \"x\" \"y\" \"z\"", 8).notes.is_empty()
        );
    }

    #[test]
    fn samples_in_several_files() {
        let beside = |name: &str| {
            let first: u8 =
                name.strip_prefix("s0").and_then(|rest| rest.strip_suffix(".gz")).unwrap().parse().unwrap();
            let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
            // Something stands in front of the samples and behind them.
            let slice: Vec<u8> = (4 * first..4 * first + 4).collect();
            gzip.write_all(&[&[99; 3], slice.as_slice(), &[98]].concat()).unwrap();
            Ok(gzip.finish().unwrap())
        };
        for files in ["LIST\ns00.gz\ns01.gz\ns02.gz", "s%02d.gz 0 2 1 2", "LIST 3\ns00.gz\ns01.gz\ns02.gz\n"]
        {
            for skip in ["3", "-2"] {
                let header = format!(
                    "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 3\nencoding: gzip\nbyte skip: {skip}\ndata file: {files}"
                );
                let mesh = read(header.as_bytes(), &ReadOptions::default(), &|name| {
                    beside(name).map(FileBytes::from)
                })
                .unwrap();
                assert!(mesh.fields[0].values.iter().copied().eq((0..12).map(f64::from)), "{header}");
            }
        }
    }

    #[test]
    fn errors_say_what() {
        let refused = |from: &str, to: &str| {
            let file = format!("{HEADER}encoding: raw\n\n01234567").replacen(from, to, 1);
            read_bytes(file.as_bytes()).unwrap_err().to_string()
        };
        assert!(refused("2 2 2", "2 2 3").contains("12 needed, 8 left"));
        assert!(refused("2 2 2", "9000000 9000000 9").contains("more than"));
        assert!(refused("2 2 2", "2 2").contains("expected 2, found 3"));
        assert!(refused("uchar", "block").contains("type block"));
        assert!(refused("uchar", "what").contains("type \"what\""));
        assert!(refused("uchar", "short").contains("\"endian\" is missing"));
        assert!(refused("uchar", "uchar\nfoo: 1").contains("the field \"foo\" cannot be read here"));
        assert!(refused("uchar", "uchar\nkinds: domain domain RGB-colour").contains("kind \"rgb-colour\""));
        assert!(refused("uchar", "uchar\nkinds: 3-vector domain domain").contains("expected 3, found 2"));
        assert!(refused("uchar", "uchar\nkinds: vector domain domain").contains("a two-dimensional image"));
        assert!(refused("uchar", "uchar\nspace: RAST").contains("a four-dimensional image"));
        assert!(
            refused("uchar", "uchar\nspace directions: (1,0,0) (0,1,0) none").contains("two-dimensional")
        );
        assert!(refused("1 2 0.5", "1 0 0.5").contains("axis 1 has a spacing of 0"));
        assert!(refused("NRRD0004", "NRRD0009").contains("version \"NRRD0009\""));
        assert!(refused("uchar", "uchar\nwhat").contains("\"what\" is no field"));
        assert!(
            refused("dimension: 3\nsizes: 2 2 2\nspacings: 1 2 0.5", "sizes: 2 2 2 1")
                .contains("kinds: vector")
        );
        assert!(refused("raw", "hex").contains("expected 8, found 4"));
        assert!(refused("raw", "ascii\nbyte skip: -1").contains("byte skip -1"));
        assert!(refused("raw", "raw\ndata file: a%d.raw 0 2 1").contains("8 bytes of samples in 3 files"));
        assert!(refused("raw", "raw\ndata file: LIST\nb.raw").contains("b.raw"));
        assert!(refused("raw", "bzip2").contains("encoding \"bzip2\""));
        assert!(refused("raw", "raw\ndata file: b.raw").contains("b.raw"));
    }
}
