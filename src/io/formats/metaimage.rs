//! `MetaImage` (`.mha`, and `.mhd` with its samples beside it): three-dimensional, raw or zlib, in either byte order.

use crate::io::error::{At, ReadError, ReadReason};
use crate::io::formats::volume::{Volume, numbers, three, unpacked};
use crate::io::number::NumberType;
use crate::io::{Beside, ReadOptions};
use crate::mesh::TetMesh;
use flate2::read::ZlibDecoder;

/// Keys that files begin with.
const FIRST: [&str; 4] = ["ObjectType", "NDims", "Comment", "CompressedData"];

/// Whether these bytes begin like a header.
pub(super) fn is_header(bytes: &[u8]) -> bool {
    let line = bytes.split(|c| *c == b'\n').next().unwrap_or_default();
    let key = line.split(|c| *c == b'=').next().unwrap_or_default().trim_ascii();
    line.contains(&b'=') && FIRST.iter().any(|first| first.as_bytes() == key)
}

/// Reads a file, and the one that it refers to.
pub(super) fn read(bytes: &[u8], options: &ReadOptions, beside: Beside<'_>) -> Result<TetMesh, ReadError> {
    let (header, data) = read_header(bytes).at(|| "header".into())?;
    let volume = header.volume().at(|| "header".into())?;
    let other;
    let data = match header.file.as_str() {
        "LOCAL" => data,
        name => {
            other = beside(name).at(|| "ElementDataFile".into())?;
            other.as_slice()
        }
    };
    let samples = header.samples(data, &volume);
    samples.and_then(|samples| volume.mesh(&samples, options)).at(|| "samples".into())
}

/// What a header says.
#[derive(Default)]
struct Header {
    dimensions: String,
    size: String,
    kind: String,
    spacing: String,
    origin: String,
    matrix: String,
    components: String,
    big: bool,
    compressed: bool,
    skipped: i64,
    file: String,
}

/// The header, which the name of the file with the samples ends, and what follows.
fn read_header(bytes: &[u8]) -> Result<(Header, &[u8]), ReadReason> {
    let (mut header, mut rest) = (Header::default(), bytes);
    while !rest.is_empty() {
        let length = rest.iter().position(|c| *c == b'\n').map_or(rest.len(), |i| i + 1);
        let (line, after) = rest.split_at(length);
        rest = after;
        let line = String::from_utf8_lossy(line);
        let Some((key, value)) = line.split_once('=') else { continue };
        let value = value.trim().to_owned();
        match key.trim() {
            "NDims" => header.dimensions = value,
            "DimSize" => header.size = value,
            "ElementType" => header.kind = value,
            "ElementSpacing" => header.spacing = value,
            "ElementSize" if header.spacing.is_empty() => header.spacing = value,
            "Offset" | "Position" | "Origin" => header.origin = value,
            "TransformMatrix" | "Orientation" | "Rotation" => header.matrix = value,
            "ElementNumberOfChannels" => header.components = value,
            "ElementByteOrderMSB" | "BinaryDataByteOrderMSB" => header.big = is_true(&value),
            "CompressedData" => header.compressed = is_true(&value),
            "HeaderSize" => header.skipped = numbers(&value, "HeaderSize")?.first().copied().unwrap_or(0),
            "ElementDataFile" => {
                header.file = value;
                return Ok((header, rest));
            }
            _ => {}
        }
    }
    Err(ReadReason::Missing("ElementDataFile".into()))
}

fn is_true(value: &str) -> bool {
    value.eq_ignore_ascii_case("true") || value == "1"
}

impl Header {
    fn volume(&self) -> Result<Volume, ReadReason> {
        if self.dimensions != "3" {
            let what = format!("an image in {} dimensions", self.dimensions);
            return Err(ReadReason::Unsupported { what, remedy: "give one in three".into() });
        }
        let or =
            |text: &str, default: &str| if text.is_empty() { default.to_owned() } else { text.to_owned() };
        let spacing: [f64; 3] = three(&or(&self.spacing, "1 1 1"), "ElementSpacing")?;
        let origin = three(&or(&self.origin, "0 0 0"), "Offset")?;
        let matrix: Vec<f64> = numbers(&or(&self.matrix, "1 0 0 0 1 0 0 0 1"), "TransformMatrix")?;
        let matrix: [f64; 9] = matrix
            .try_into()
            .map_err(|_| ReadReason::Syntax("TransformMatrix is not nine numbers".into()))?;
        // A row is the direction of an axis.
        let steps = [0, 1, 2].map(|axis| [0, 1, 2].map(|i| matrix[3 * axis + i] * spacing[axis]));
        let components = or(&self.components, "1").parse().ok().filter(|n| (1..=1 << 10).contains(n));
        let components = components
            .ok_or_else(|| ReadReason::Syntax(format!("ElementNumberOfChannels = {}", self.components)))?;
        let number = number_type(&self.kind)
            .ok_or_else(|| ReadReason::Syntax(format!("ElementType \"{}\" is not known", self.kind)))?;
        let dims = three(&self.size, "DimSize")?;
        let field = "value".to_owned();
        Ok(Volume { dims, components, number, big: self.big, origin, steps, field })
    }

    fn samples(&self, data: &[u8], volume: &Volume) -> Result<Vec<u8>, ReadReason> {
        let expected = volume.bytes()?;
        // Minus one: the samples are the end of the file.
        let start = usize::try_from(self.skipped);
        let start =
            start.unwrap_or_else(|_| if self.compressed { 0 } else { data.len().saturating_sub(expected) });
        let found = data.len().saturating_sub(start) as u64;
        let rest = data.get(start..).ok_or(ReadReason::Truncated { needed: expected as u64, found: 0 })?;
        if self.compressed {
            return unpacked(ZlibDecoder::new(rest), expected);
        }
        let samples = rest.get(..expected);
        samples.map(<[u8]>::to_vec).ok_or(ReadReason::Truncated { needed: expected as u64, found })
    }
}

fn number_type(name: &str) -> Option<NumberType> {
    Some(match name {
        "MET_CHAR" => NumberType::I8,
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
        read(bytes, &ReadOptions::default(), &beside)
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
    fn turned_grids_and_errors() {
        let file = |more: &str| {
            read_bytes(&[format!("{HEADER}{more}ElementDataFile = LOCAL\n").as_bytes(), &samples()].concat())
        };
        let mesh = file("TransformMatrix = 0 1 0 1 0 0 0 0 1\n").unwrap();
        assert_eq!((mesh.grid, mesh.positions[1], mesh.positions[2]), (None, [3., 1., 0.], [5., 0., 0.]));
        assert!(file("ElementType = MET_WHAT\n").unwrap_err().to_string().contains("MET_WHAT"));
        assert!(file("DimSize = 2 2 9\n").unwrap_err().to_string().contains("72 needed, 16 left"));
        assert!(file("NDims = 2\n").unwrap_err().to_string().contains("2 dimensions"));
        assert!(file("DimSize = 2 2\n").unwrap_err().to_string().contains("three numbers"));
        assert!(
            read_bytes(HEADER.as_bytes()).unwrap_err().to_string().contains("ElementDataFile is missing")
        );
    }
}
