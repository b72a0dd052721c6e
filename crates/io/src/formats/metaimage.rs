//! `MetaImage` (`.mha`, and `.mhd` with its samples in other files): three-dimensional; raw in either byte order, zlib or text.
//! By <https://itk.org/Wiki/ITK/MetaIO/Documentation>, and where that says nothing, as ITK reads it.

use std::borrow::Cow;

use crate::error::{At, ReadError, ReadReason, shown};
use crate::formats::volume::{
    Axis, MAX_COMPONENTS, SampleArray, Start, Volume, first, from_files, from_text, numbered_files, numbers,
    three, unpacked, wrong_dimensions,
};
use crate::number::NumberType;
use crate::options::{Beside, ReadOptions};
use crate::scanner::Scanner;
use flate2::read::ZlibDecoder;
use tetralod::mesh::TetMesh;

/// Keys that files begin with.
const FIRST: [&str; 4] = ["ObjectType", "NDims", "Comment", "CompressedData"];

/// Whether these bytes begin like a header.
pub(super) fn is_header(bytes: &[u8]) -> bool {
    let line = bytes.split(|c| *c == b'\n').next().unwrap_or_default();
    let key = line.split(|c| *c == b'=').next().unwrap_or_default().trim_ascii();
    line.contains(&b'=') && FIRST.iter().any(|first| first.as_bytes() == key)
}

/// Reads a file, and those that it refers to.
pub(super) fn read(bytes: &[u8], options: &ReadOptions, beside: Beside<'_>) -> Result<TetMesh, ReadError> {
    let (header, rest) = read_header(bytes).at(|| "header".into())?;
    let volume = header.volume().at(|| "header".into())?;
    let expected = volume.bytes().at(|| "header".into())?;
    let _held = options.memory.hold(expected as u64).at(|| "samples".into())?;
    let samples = |data: &[u8], count: usize| header.samples(data, &volume, count);
    let names = header.files(rest, volume.dims).at(|| "ElementDataFile".into())?;
    let samples = if names.is_empty() {
        // What is skipped of the file itself is counted from its beginning.
        samples(if header.skipped > 0 { bytes } else { rest }, expected).at(|| "samples".into())?
    } else {
        from_files(("ElementDataFile", &names), expected, beside, samples)?
    };
    volume.mesh(&samples, options).at(|| "samples".into())
}

/// As [`nrrd::in_file`](super::nrrd::in_file).
pub(super) fn in_file(head: &[u8]) -> Option<(Volume, Option<String>, Start)> {
    let (header, rest) = read_header(head).ok()?;
    let volume = header.volume().ok()?;
    let names = header.files(rest, volume.dims).ok()?;
    if header.compressed || header.is_text || names.len() > 1 {
        return None;
    }
    let before = if names.is_empty() { head.len() - rest.len() } else { 0 } as u64;
    let start = match u64::try_from(header.skipped) {
        Ok(0) => Start::At(before),
        // Counted from the beginning of the file.
        Ok(skipped) => Start::At(skipped),
        Err(_) => Start::BeforeEnd(0),
    };
    Some((volume, names.into_iter().next(), start))
}

/// The names of the files with the samples.
pub(super) fn named_by(bytes: &[u8]) -> Vec<String> {
    let names =
        read_header(bytes).and_then(|(header, rest)| header.files(rest, three(&header.size, "DimSize")?));
    names.unwrap_or_default()
}

/// What a header says.
#[derive(Default)]
struct Header {
    dimensions: String,
    size: String,
    kind: String,
    spacing: String,
    /// What takes the place of the spacing where that is not given.
    element_size: String,
    origin: String,
    matrix: String,
    components: String,
    big: bool,
    compressed: bool,
    is_text: bool,
    skipped: i64,
    file: String,
    notes: Vec<String>,
}

/// The header, which the name of the file with the samples ends, and what follows.
fn read_header(bytes: &[u8]) -> Result<(Header, &[u8]), ReadReason> {
    let (mut header, mut lines) = (Header::default(), Scanner::new(bytes));
    while !lines.rest().is_empty() {
        let line = String::from_utf8_lossy(lines.line());
        // Some programs write colons.
        let Some((key, value)) = line.split_once(['=', ':']) else { continue };
        header.set(key.trim(), value.trim())?;
        if !header.file.is_empty() {
            return Ok((header, lines.rest()));
        }
    }
    Err(ReadReason::Missing("ElementDataFile".into()))
}

fn is_true(value: &str) -> bool {
    value.starts_with(['t', 'T', '1'])
}

impl Header {
    fn set(&mut self, key: &str, value: &str) -> Result<(), ReadReason> {
        let text = || value.to_owned();
        match key {
            "NDims" => self.dimensions = text(),
            "DimSize" => self.size = text(),
            "ElementType" => self.kind = text(),
            "ElementSpacing" => self.spacing = text(),
            "ElementSize" => self.element_size = text(),
            "Offset" | "Position" | "Origin" => self.origin = text(),
            "TransformMatrix" | "Orientation" | "Rotation" => self.matrix = text(),
            "ElementNumberOfChannels" => self.components = text(),
            "ElementByteOrderMSB" | "BinaryDataByteOrderMSB" => self.big = is_true(value),
            "CompressedData" => self.compressed = is_true(value),
            "BinaryData" => self.is_text = !is_true(value),
            "HeaderSize" => self.skipped = first(value, key)?.unwrap_or(0),
            "ElementDataFile" => self.file = text(),
            "ObjectType" if !value.eq_ignore_ascii_case("Image") => {
                let what = format!("an object of type \"{}\"", shown(value));
                return Err(ReadReason::unsupported(what, "give an Image"));
            }
            // ITK and VTK do not apply these, either.
            "ElementToIntensityFunctionSlope" if is_not(value, 1.0) => self.not_applied(key, value),
            "ElementToIntensityFunctionOffset" if is_not(value, 0.0) => self.not_applied(key, value),
            "CenterOfRotation" if value.split_ascii_whitespace().any(|x| is_not(x, 0.0)) => {
                self.not_applied(key, value);
            }
            // All others are remarks, or belong to users.
            _ => {}
        }
        Ok(())
    }

    fn not_applied(&mut self, key: &str, value: &str) {
        let value: String = value.chars().take(48).collect();
        self.notes.push(format!("{key} = {value} is not applied"));
    }

    fn volume(&self) -> Result<Volume, ReadReason> {
        let dimensions: usize = self.dimensions.parse().unwrap_or(0);
        if dimensions == 0 {
            return Err(ReadReason::Syntax(format!("NDims \"{}\" is not a count", self.dimensions)));
        }
        if dimensions != 3 {
            return Err(wrong_dimensions(dimensions));
        }
        let or =
            |text: &str, default: &str| if text.is_empty() { default.to_owned() } else { text.to_owned() };
        let spacing: [f64; 3] =
            three(&or(&or(&self.spacing, &self.element_size), "1 1 1"), "ElementSpacing")?;
        let origin = three(&or(&self.origin, "0 0 0"), "Offset")?;
        let matrix: Vec<f64> = numbers(&or(&self.matrix, "1 0 0 0 1 0 0 0 1"), "TransformMatrix")?;
        let matrix: [f64; 9] = matrix
            .try_into()
            .map_err(|_| ReadReason::Syntax("TransformMatrix is not nine numbers".into()))?;
        // A row is the direction of an axis.
        let steps = [0, 1, 2].map(|axis| [0, 1, 2].map(|i| matrix[3 * axis + i] * spacing[axis]));
        let components = or(&self.components, "1").parse().ok();
        let components: u64 = components
            .filter(|n| (1..=MAX_COMPONENTS).contains(n))
            .ok_or_else(|| ReadReason::Syntax(format!("ElementNumberOfChannels = {}", self.components)))?;
        let number = number_type(&self.kind)
            .ok_or_else(|| ReadReason::Syntax(format!("ElementType \"{}\" is not known", self.kind)))?;
        let dims: [u64; 3] = three(&self.size, "DimSize")?;
        let mut axes = vec![Axis { size: components, is_space: false }];
        axes.extend(dims.map(|size| Axis { size, is_space: true }));
        // Of more values than a vector has, the format does not say what they are.
        let arrays = match components {
            2 | 3 => SampleArray::vector(components as usize),
            count => SampleArray::numbered(count as usize),
        };
        let (field, unit, notes) = ("value".to_owned(), String::new(), self.notes.clone());
        Ok(Volume { dims, axes, number, big: self.big, origin, steps, field, unit, arrays, notes })
    }

    /// The names of the files with the samples, which a list has line by line; none if they follow.
    fn files(&self, rest: &[u8], dims: [u64; 3]) -> Result<Vec<String>, ReadReason> {
        let words: Vec<&str> = self.file.split_ascii_whitespace().collect();
        let number = |i: usize, words: &[&str]| {
            words.get(i).map_or(Ok(None), |word| first::<i64>(word, "ElementDataFile"))
        };
        match *words.as_slice() {
            [local] if local.eq_ignore_ascii_case("LOCAL") => Ok(Vec::new()),
            ["LIST", ref dimension @ ..] => {
                let count = in_list(dimension, dims)?;
                let lines =
                    rest.split(|c| *c == b'\n').map(|line| String::from_utf8_lossy(line.trim_ascii()));
                let names: Vec<String> =
                    lines.filter(|line| !line.is_empty()).map(Cow::into_owned).take(count).collect();
                let (needed, found) = (count as u64, names.len() as u64);
                if found == needed { Ok(names) } else { Err(ReadReason::Truncated { needed, found }) }
            }
            [pattern, ref range @ ..] if pattern.contains('%') => {
                // The last slice is found by their number, each has the next number.
                let first = number(0, range)?.unwrap_or(1);
                let default = first.saturating_add_unsigned(dims[2]).saturating_sub(1);
                let last = number(1, range)?.unwrap_or(default);
                let step = number(2, range)?.unwrap_or(1);
                numbered_files(pattern, [first, last, step])
            }
            _ => Ok(vec![self.file.clone()]),
        }
    }

    fn samples(&self, data: &[u8], volume: &Volume, expected: usize) -> Result<Vec<u8>, ReadReason> {
        // Minus one: the samples are the end of the file.
        let start = usize::try_from(self.skipped).unwrap_or_else(|_| {
            if self.compressed || self.is_text { 0 } else { data.len().saturating_sub(expected) }
        });
        let found = data.len().saturating_sub(start) as u64;
        let rest = data.get(start..).ok_or(ReadReason::Truncated { needed: expected as u64, found: 0 })?;
        if self.compressed {
            return unpacked(ZlibDecoder::new(rest), expected);
        }
        if self.is_text {
            return from_text(rest, volume.number, self.big);
        }
        let samples = rest.get(..expected);
        samples.map(<[u8]>::to_vec).ok_or(ReadReason::Truncated { needed: expected as u64, found })
    }
}

/// How many files a list names, each with samples of so many dimensions: slices if that is not given.
fn in_list(dimension: &[&str], dims: [u64; 3]) -> Result<usize, ReadReason> {
    let count = match dimension.first().map(|word| word.trim_end_matches(['D', 'd'])) {
        None | Some("2") => Some(dims[2]),
        Some("3") => Some(1),
        Some("1") => dims[1].checked_mul(dims[2]),
        Some(other) => return Err(ReadReason::Syntax(format!("LIST of {other} dimensions"))),
    };
    let count = count.and_then(|count| usize::try_from(count).ok());
    count.ok_or(ReadReason::TooLarge { what: "files".into(), limit: u64::MAX })
}

fn is_not(text: &str, value: f64) -> bool {
    text.parse::<f64>() != Ok(value)
}

fn number_type(name: &str) -> Option<NumberType> {
    // Of several channels there are types of their own, each as its numbers are.
    Some(match name.strip_suffix("_ARRAY").unwrap_or(name) {
        "MET_CHAR" | "MET_ASCII_CHAR" => NumberType::I8,
        "MET_UCHAR" => NumberType::U8,
        "MET_SHORT" => NumberType::I16,
        "MET_USHORT" => NumberType::U16,
        "MET_INT" | "MET_LONG" => NumberType::I32,
        "MET_UINT" | "MET_ULONG" => NumberType::U32,
        "MET_LONG_LONG" => NumberType::I64,
        "MET_ULONG_LONG" => NumberType::U64,
        "MET_FLOAT" => NumberType::F32,
        "MET_DOUBLE" => NumberType::F64,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::FileBytes;
    use flate2::{Compression, write::ZlibEncoder};
    use std::io::Write;

    const HEADER: &str = "ObjectType = Image\nNDims = 3\nBinaryDataByteOrderMSB = True\nDimSize = 2 2 2\n\
        ElementSpacing = 1 2 0.5\nOffset = 3 0 0\nElementType = MET_SHORT\n";

    fn samples() -> Vec<u8> {
        (0..8).flat_map(i16::to_be_bytes).collect()
    }

    fn read_bytes(bytes: &[u8]) -> Result<TetMesh, ReadError> {
        let beside = |name: &str| match name {
            "a.raw" => Ok([vec![9; 5], samples()].concat()),
            other => Err(ReadReason::Io(other.into())),
        };
        read(bytes, &ReadOptions::default(), &|name| beside(name).map(FileBytes::from))
    }

    #[test]
    fn one_grid_in_every_encoding() {
        let mut zlib = ZlibEncoder::new(Vec::new(), Compression::fast());
        zlib.write_all(&samples()).unwrap();
        let local = "ElementDataFile = LOCAL\n";
        let files = [
            [format!("{HEADER}{local}").as_bytes(), &samples()].concat(),
            [format!("{HEADER}CompressedData = True\n{local}").as_bytes(), &zlib.finish().unwrap()].concat(),
            format!("{HEADER}HeaderSize = 5\nElementDataFile = a.raw\n").into_bytes(),
            format!("{HEADER}HeaderSize = -1\nElementDataFile = a.raw\n").into_bytes(),
        ];
        for file in files {
            assert!(is_header(&file));
            let mesh = read_bytes(&file).unwrap();
            let grid = mesh.grid.unwrap();
            assert_eq!((grid.dims, grid.spacing, grid.origin), ([2; 3], [1.0, 2.0, 0.5], [3.0, 0.0, 0.0]));
            assert_eq!(mesh.fields[0].values, [0., 1., 2., 3., 4., 5., 6., 7.]);
            (0..file.len()).for_each(|length| drop(read_bytes(&file[..length])));
        }
    }

    #[test]
    fn samples_as_text_and_in_several_files() {
        let header = HEADER.replace("MET_SHORT", "MET_SHORT_ARRAY");
        let beside = |name: &str| match name {
            "s5.raw" => Ok(samples()[..8].to_vec()),
            "s6.raw" => Ok(samples()[8..].to_vec()),
            "a.txt" => Ok(b"0 1 2 3 4\n5 6 7".to_vec()),
            other => Err(ReadReason::Io(other.into())),
        };
        for file in [
            "ElementDataFile = LIST\ns5.raw\ns6.raw\n",
            "ElementDataFile = LIST 2D\ns5.raw\r\ns6.raw",
            "ElementDataFile = s%d.raw 5",
            "ElementDataFile = s%d.raw 5 6 1\n",
            "BinaryData = False\nElementDataFile = LOCAL\n0 1 2 3\n 4 5 6 7\n",
            "BinaryData = False\nElementDataFile = a.txt\n",
        ] {
            let file = format!("{header}{file}");
            let mesh =
                read(file.as_bytes(), &ReadOptions::default(), &|name| beside(name).map(FileBytes::from))
                    .unwrap_or_else(|e| panic!("{file}: {e}"));
            assert_eq!(mesh.fields[0].values, [0., 1., 2., 3., 4., 5., 6., 7.], "{file}");
        }
        let refused = |file: &str| {
            read(format!("{HEADER}{file}").as_bytes(), &ReadOptions::default(), &|name| {
                beside(name).map(FileBytes::from)
            })
            .unwrap_err()
            .to_string()
        };
        assert!(refused("ElementDataFile = LIST\ns5.raw").contains("2 needed, 1 left"));
        assert!(refused("ElementDataFile = s%d.raw 5 7 1").contains("16 bytes of samples in 3 files"));
        assert!(refused("ElementDataFile = s%d.raw 6").contains("s7.raw"));
        assert!(
            refused("BinaryData = False\nElementDataFile = LOCAL\n1 2 3").contains("expected 16, found 6")
        );
    }

    #[test]
    fn keys_that_say_one_thing_in_several_ways() {
        let file = |lines: &str, data: &[u8]| {
            let head = "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\n";
            let head = format!("{head}{lines}ElementDataFile = LOCAL\n");
            read_bytes(&[head.as_bytes(), data].concat()).unwrap()
        };
        let bytes: Vec<u8> = (0..8).collect();
        for (lines, spacing) in [
            ("ElementSize = 1 2 3\n", [1.0, 2.0, 3.0]),
            ("ElementSize = 1 2 3\nElementSpacing = 4 5 6\n", [4.0, 5.0, 6.0]),
            ("ElementSpacing = 4 5 6\nElementSize = 1 2 3\n", [4.0, 5.0, 6.0]),
        ] {
            assert_eq!(file(lines, &bytes).grid.unwrap().spacing, spacing, "{lines}");
        }
        // A skip in the file itself begins at its first byte, as ITK has it.
        let skipped = file("HeaderSize = 9\n", &bytes);
        assert_eq!(skipped.fields[0].values[0], f64::from(b'\n'));
        let six = file("ElementNumberOfChannels = 6\n", &(0..48).collect::<Vec<u8>>());
        let names: Vec<&str> = six.fields.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(names, ["value_0", "value_1", "value_2", "value_3", "value_4", "value_5"]);
        let notes = "ElementToIntensityFunctionSlope = 2\nElementToIntensityFunctionOffset = 0\nCenterOfRotation = 0 0 1\n";
        let expected =
            ["ElementToIntensityFunctionSlope = 2 is not applied", "CenterOfRotation = 0 0 1 is not applied"];
        assert_eq!(file(notes, &bytes).notes, expected);
    }

    #[test]
    fn turned_grids_and_errors() {
        let file = |more: &str| {
            read_bytes(&[format!("{HEADER}{more}ElementDataFile = LOCAL\n").as_bytes(), &samples()].concat())
        };
        let mesh = file("TransformMatrix = 0 1 0 1 0 0 0 0 1\n").unwrap();
        assert_eq!((mesh.grid, mesh.positions[1], mesh.positions[2]), (None, [3., 1., 0.], [5., 0., 0.]));
        assert!(file("ElementType = MET_WHAT\n").unwrap_err().to_string().contains("MET_WHAT"));
        assert!(file("DimSize = 2 2 9\n").unwrap_err().to_string().contains("72 needed, 16 left"));
        assert!(file("NDims = 2\n").unwrap_err().to_string().contains("a two-dimensional image"));
        assert!(file("NDims = 4\n").unwrap_err().to_string().contains("a four-dimensional image"));
        assert!(file("ObjectType = Mesh\n").unwrap_err().to_string().contains("type \"Mesh\""));
        assert!(file("DimSize = 2 2\n").unwrap_err().to_string().contains("three numbers"));
        assert!(
            read_bytes(HEADER.as_bytes()).unwrap_err().to_string().contains("ElementDataFile is missing")
        );
    }
}
