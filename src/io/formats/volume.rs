//! Samples on a grid, as files of images have them.

use std::io::Read;

use crate::io::error::ReadReason;
use crate::io::fields::Collector;
use crate::io::image::{GridValues, Placement};
use crate::io::number::NumberType;
use crate::io::{ReadOptions, structured};
use crate::mesh::TetMesh;

/// What a header says of the samples that follow.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Volume {
    pub dims: [u64; 3],
    /// Values of a sample.
    pub components: usize,
    pub number: NumberType,
    /// Whether numbers have their most significant byte first.
    pub big: bool,
    pub origin: [f64; 3],
    /// The step from one sample to the next along each axis of the grid.
    pub steps: [[f64; 3]; 3],
    pub field: String,
}

impl Volume {
    /// How many bytes the samples have.
    pub fn bytes(&self) -> Result<usize, ReadReason> {
        structured::checked_dims(self.dims)?;
        let sizes = [self.components, self.number.size()].into_iter();
        let points = self.dims.iter().map(|d| *d as usize);
        let bytes = points.chain(sizes).try_fold(1_usize, usize::checked_mul);
        bytes.ok_or_else(|| ReadReason::TooLarge { what: "bytes of samples".into(), limit: u64::MAX })
    }

    /// The mesh of these samples; a grid along the axes comes without points and tetrahedra.
    pub fn mesh(&self, samples: &[u8], options: &ReadOptions) -> Result<TetMesh, ReadReason> {
        let expected = self.bytes()?;
        if samples.len() != expected {
            let (expected, found) = (expected as u64, samples.len() as u64);
            return Err(ReadReason::Count { what: "bytes of samples".into(), expected, found });
        }
        let mut fields = Collector::new(options);
        if let Some(claim) = fields.claim(&self.field, self.components)? {
            let values = self.number.floats(samples, self.big);
            fields.fill(claim, values, self.number.is_integer(), "");
        }
        let values = GridValues {
            fields: fields.fields,
            others: [fields.others, Vec::new()],
            ..GridValues::default()
        };
        Placement { dims: self.dims, origin: self.origin, steps: self.steps }.mesh(values)
    }
}

/// What `reader` unpacks, which has to be `expected` bytes.
pub(super) fn unpacked(reader: impl Read, expected: usize) -> Result<Vec<u8>, ReadReason> {
    let mut bytes = Vec::new();
    let mut limited = reader.take(expected as u64 + 1);
    limited.read_to_end(&mut bytes).map_err(|error| ReadReason::Damaged(error.to_string()))?;
    Ok(bytes)
}

/// Numbers that stand in one line of a header.
pub(super) fn numbers<T: std::str::FromStr>(text: &str, key: &str) -> Result<Vec<T>, ReadReason> {
    let parsed: Result<Vec<T>, _> = text.split_ascii_whitespace().map(str::parse).collect();
    parsed.map_err(|_| ReadReason::Syntax(format!("{key} \"{text}\" is not a list of numbers")))
}

/// The same where there must be three.
pub(super) fn three<T: std::str::FromStr>(text: &str, key: &str) -> Result<[T; 3], ReadReason> {
    let list = numbers(text, key)?;
    list.try_into().map_err(|_| ReadReason::Syntax(format!("{key} \"{text}\" is not three numbers")))
}
