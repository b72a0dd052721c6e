//! NRRD (`.nrrd`, and `.nhdr` with its samples beside it): three-dimensional, raw, gzip or text; samples of several values.

use crate::io::error::{At, ReadError, ReadReason};
use crate::io::formats::volume::{Volume, numbers, unpacked};
use crate::io::number::NumberType;
use crate::io::{Beside, ReadOptions};
use crate::mesh::TetMesh;
use flate2::read::MultiGzDecoder;

/// How every file begins.
pub(super) const MAGIC: &[u8] = b"NRRD00";

/// What a header says.
#[derive(Default)]
struct Header {
    kind: String,
    sizes: Vec<u64>,
    encoding: String,
    big: bool,
    spacings: Vec<f64>,
    directions: String,
    origin: String,
    file: Option<String>,
    content: String,
    byte_skip: i64,
    line_skip: usize,
}

/// Reads a file, and the one that it refers to.
pub(super) fn read(bytes: &[u8], options: &ReadOptions, beside: Beside<'_>) -> Result<TetMesh, ReadError> {
    let (header, data) = read_header(bytes).at(|| "header".into())?;
    let volume = header.volume().at(|| "header".into())?;
    let other;
    let data = match &header.file {
        Some(name) => {
            other = beside(name).at(|| "data file".into())?;
            other.as_slice()
        }
        None => data,
    };
    let samples = header.samples(data, &volume);
    samples.and_then(|samples| volume.mesh(&samples, options)).at(|| "samples".into())
}

/// The header, which an empty line ends, and what follows.
fn read_header(bytes: &[u8]) -> Result<(Header, &[u8]), ReadReason> {
    let (mut header, mut rest) = (Header::default(), bytes);
    loop {
        let length = rest.iter().position(|c| *c == b'\n').map_or(rest.len(), |i| i + 1);
        let (line, after) = rest.split_at(length);
        rest = after;
        let line = String::from_utf8_lossy(line.trim_ascii_end());
        if line.is_empty() {
            return Ok((header, rest));
        }
        if let Some((key, value)) = line.split_once(": ").filter(|_| !line.starts_with('#')) {
            header.set(&key.to_ascii_lowercase(), value.trim())?;
        }
    }
}

impl Header {
    fn set(&mut self, key: &str, value: &str) -> Result<(), ReadReason> {
        let lower = value.to_ascii_lowercase();
        match key {
            "type" => self.kind = lower,
            "sizes" => self.sizes = numbers(value, key)?,
            "encoding" => self.encoding = lower,
            "endian" => self.big = lower == "big",
            "spacings" => self.spacings = numbers(value, key)?,
            "space directions" => value.clone_into(&mut self.directions),
            "space origin" => value.clone_into(&mut self.origin),
            "data file" | "datafile" => self.file = Some(value.to_owned()),
            "content" => value.clone_into(&mut self.content),
            "byte skip" | "byteskip" => self.byte_skip = numbers(value, key)?.first().copied().unwrap_or(0),
            "line skip" | "lineskip" => self.line_skip = numbers(value, key)?.first().copied().unwrap_or(0),
            _ => {}
        }
        Ok(())
    }

    fn volume(&self) -> Result<Volume, ReadReason> {
        let number = number_type(&self.kind)
            .ok_or_else(|| ReadReason::Syntax(format!("type \"{}\" is not known", self.kind)))?;
        let (components, dims) = match *self.sizes {
            [x, y, z] => (1, [x, y, z]),
            // Samples of several values come first.
            [c, x, y, z] if c <= 1 << 10 => (c as usize, [x, y, z]),
            _ => {
                let what = format!("samples of sizes {:?}", self.sizes);
                return Err(ReadReason::Unsupported {
                    what,
                    remedy: "give three-dimensional samples".into(),
                });
            }
        };
        let spacings = self.spacings.iter().rev().take(3).rev().enumerate();
        let mut steps = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        spacings.filter(|(_, spacing)| spacing.is_finite()).for_each(|(i, spacing)| steps[i][i] = *spacing);
        let directions = vectors(&self.directions)?;
        if !directions.is_empty() {
            let count = || ReadReason::Syntax(format!("space directions \"{}\"", self.directions));
            steps = directions.try_into().map_err(|_| count())?;
        }
        let origin = vectors(&self.origin)?.first().copied().unwrap_or([0.0; 3]);
        let field = if self.content.is_empty() { "value".to_owned() } else { self.content.clone() };
        Ok(Volume { dims, components, number, big: self.big, origin, steps, field })
    }

    fn samples(&self, data: &[u8], volume: &Volume) -> Result<Vec<u8>, ReadReason> {
        let expected = volume.bytes()?;
        let mut data = data;
        for _ in 0..self.line_skip {
            let line = data.iter().position(|c| *c == b'\n').map_or(data.len(), |i| i + 1);
            data = &data[line..];
            if data.is_empty() {
                break;
            }
        }
        let skipped = usize::try_from(self.byte_skip);
        match self.encoding.as_str() {
            "raw" => {
                // Minus one: the samples are the end of the file.
                let start = skipped.unwrap_or_else(|_| data.len().saturating_sub(expected));
                let found = data.len().saturating_sub(start) as u64;
                let samples = data.get(start..).and_then(|rest| rest.get(..expected));
                samples.map(<[u8]>::to_vec).ok_or(ReadReason::Truncated { needed: expected as u64, found })
            }
            "gzip" | "gz" => {
                // Bytes are skipped behind the compression.
                let skip = skipped.unwrap_or(0);
                let all = unpacked(MultiGzDecoder::new(data), expected.saturating_add(skip))?;
                Ok(all.get(skip..).unwrap_or_default().to_vec())
            }
            "text" | "txt" | "ascii" => {
                let text = std::str::from_utf8(data);
                let text = text.map_err(|_| ReadReason::Syntax("the samples are not text".into()))?;
                let mut bytes = Vec::new();
                for word in text.split_ascii_whitespace() {
                    volume.number.put(volume.number.parse_float(word)?, volume.big, &mut bytes);
                }
                Ok(bytes)
            }
            other => Err(ReadReason::Unsupported {
                what: format!("samples in encoding \"{other}\""),
                remedy: "write them as raw or gzip".into(),
            }),
        }
    }
}

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

/// Vectors as `(1,0,0) (0,1,0)`; `none` stands for an axis that is not one of space.
fn vectors(text: &str) -> Result<Vec<[f64; 3]>, ReadReason> {
    // What stands in front of the first bracket belongs to no vector.
    let parts = text.split('(').skip(1);
    let vector = |part: &str| -> Option<[f64; 3]> {
        let (inside, _) = part.split_once(')')?;
        let numbers: Vec<f64> = inside.split(',').map(|x| x.trim().parse().ok()).collect::<Option<_>>()?;
        numbers.try_into().ok()
    };
    let vectors: Option<Vec<_>> = parts.map(vector).collect();
    vectors.ok_or_else(|| ReadReason::Syntax(format!("\"{text}\" is not vectors of three numbers")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    fn read_bytes(bytes: &[u8]) -> Result<TetMesh, ReadError> {
        let beside = |name: &str| match name {
            "a.raw" => Ok((0..8).collect()),
            other => Err(ReadReason::Io(other.into())),
        };
        read(bytes, &ReadOptions::default(), &beside)
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

    #[test]
    fn errors_say_what() {
        let refused = |from: &str, to: &str| {
            let file = format!("{HEADER}encoding: raw\n\n01234567").replacen(from, to, 1);
            read_bytes(file.as_bytes()).unwrap_err().to_string()
        };
        assert!(refused("2 2 2", "2 2 3").contains("12 needed, 8 left"));
        assert!(refused("2 2 2", "9000000 9000000 9").contains("more than"));
        assert!(refused("2 2 2", "2 2").contains("samples of sizes [2, 2]"));
        assert!(refused("uchar", "block").contains("type \"block\""));
        assert!(refused("raw", "bzip2").contains("encoding \"bzip2\""));
        assert!(refused("raw", "raw\ndata file: b.raw").contains("b.raw"));
    }
}
