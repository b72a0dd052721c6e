//! Raw samples with a JSON sidecar.
//!
//! `x.raw` holds the samples alone, x fastest, then y, then z. `x.json` holds `dims` and `type` (as `"uint8"`), and
//! may hold `file` (the samples' file name, else `x.raw`), `endian` (`"little"`, the default, or `"big"`),
//! `spacing` (default 1 1 1), `origin` (default 0 0 0), `field` (the field's name, default `value`) and `unit` (of its
//! values). [`REMARKS`] may stand there, too; any other key could change the meaning, and is refused.

use serde_json::Value;

use crate::error::{ReadReason, expect_count};
use crate::grid::{self, GridValues, Placement};
use crate::number::NumberType;
use crate::{MemoryLimit, Survey};
use tetralod::mesh::{Field, Grid, TetMesh};

/// Keys that say how the samples are to be read.
const KEYS: [&str; 8] = ["dims", "type", "file", "endian", "spacing", "origin", "field", "unit"];

/// Keys for people. An order is read where it names the only one that there is.
const REMARKS: [&str; 6] = ["name", "description", "source", "license", "range", "order"];

/// What a sidecar says.
#[derive(Debug)]
pub(super) struct Sidecar {
    /// Name of the file with the samples, without a folder; `None` if it is named like the sidecar.
    pub file: Option<String>,
    grid: Grid,
    number: NumberType,
    big: bool,
    field: String,
    unit: String,
}

impl Sidecar {
    /// Reads a sidecar.
    pub fn parse(json: &[u8]) -> Result<Self, ReadReason> {
        let value: Value =
            serde_json::from_slice(json).map_err(|e| ReadReason::Syntax(format!("not valid JSON: {e}")))?;
        check_keys(&value)?;
        let text = |key: &str| text(&value, key);
        let order = text("order")?.unwrap_or("x fastest");
        if !order.starts_with("x fastest") {
            let what = format!("the order \"{order}\"");
            let remedy = "write the samples x fastest, then y, then z";
            return Err(ReadReason::unsupported(what, remedy));
        }
        let dims =
            three(&value, "dims", Value::as_u64)?.ok_or_else(|| ReadReason::Missing("\"dims\"".into()))?;
        let spacing = three(&value, "spacing", Value::as_f64)?.unwrap_or([1.0; 3]);
        let origin = three(&value, "origin", Value::as_f64)?.unwrap_or([0.0; 3]);
        let kind = text("type")?.ok_or_else(|| ReadReason::Missing("\"type\"".into()))?;
        let number = NumberType::named(kind).ok_or_else(|| {
            ReadReason::Syntax(format!("type \"{kind}\" is not known (use uint8, float32, ...)"))
        })?;
        let big = match text("endian")? {
            None | Some("little") => false,
            Some("big") => true,
            Some(other) => {
                return Err(ReadReason::Syntax(format!("endian \"{other}\" is not \"little\" or \"big\"")));
            }
        };
        let file = text("file")?.map(str::to_owned);
        if file.as_ref().is_some_and(|f| f.contains(['/', '\\', ':']) || f == "..") {
            let what = "a \"file\" in another folder";
            return Err(ReadReason::unsupported(what, "put both files side by side"));
        }
        let field = text("field")?.unwrap_or("value").to_owned();
        let unit = text("unit")?.unwrap_or_default().to_owned();
        Ok(Self { file, grid: grid::checked_grid(dims, origin, spacing)?, number, big, field, unit })
    }

    /// What it describes.
    pub fn survey(&self) -> Survey {
        let (unit, integer) = (self.unit.clone(), self.number.is_integer());
        let field = Field { unit, integer, ..Field::new(self.field.clone(), Vec::new()) };
        Survey::of_grid("raw", self.grid, [vec![field], Vec::new()])
    }

    /// The mesh of these samples.
    pub fn mesh(&self, samples: &[u8], memory: &MemoryLimit) -> Result<TetMesh, ReadReason> {
        let points: u64 = self.grid.dims.iter().map(|d| u64::from(*d)).product();
        expect_count("bytes of samples", points * self.number.size() as u64, samples.len())?;
        memory.take(8 * points)?;
        grid::grid_mesh(self.grid, self.values(samples), memory)
    }

    /// Bytes of a sample.
    pub fn size(&self) -> usize {
        self.number.size()
    }

    /// Where they are.
    pub fn placement(&self) -> Placement {
        let Grid { dims, origin, spacing: [x, y, z] } = self.grid;
        let steps = [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]];
        Placement { dims: dims.map(u64::from), origin, steps }
    }

    /// What these samples are.
    pub fn values(&self, samples: &[u8]) -> GridValues {
        let values = self.number.floats(samples, self.big);
        let field = Field {
            unit: self.unit.clone(),
            integer: self.number.is_integer(),
            ..Field::new(self.field.clone(), values)
        };
        GridValues { fields: vec![field], ..GridValues::default() }
    }
}

fn check_keys(sidecar: &Value) -> Result<(), ReadReason> {
    let members = sidecar.as_object().ok_or_else(|| ReadReason::Syntax("not a JSON object".into()))?;
    let is_known = |key: &str| KEYS.contains(&key) || REMARKS.contains(&key);
    let Some(key) = members.keys().find(|key| !is_known(key)) else { return Ok(()) };
    let key: String = key.chars().take(48).collect();
    Err(ReadReason::unsupported(
        format!("the key \"{key}\""),
        format!("leave it out; known are {} and the remarks {}", KEYS.join(", "), REMARKS.join(", ")),
    ))
}

/// A text of the sidecar, if the key is there.
fn text<'a>(sidecar: &'a Value, key: &str) -> Result<Option<&'a str>, ReadReason> {
    let Some(found) = sidecar.get(key) else { return Ok(None) };
    found.as_str().map(Some).ok_or_else(|| ReadReason::Syntax(format!("\"{key}\" is not a text")))
}

/// Three numbers of the sidecar, if the key is there.
fn three<T: Copy>(
    value: &Value,
    key: &str,
    get: impl Fn(&Value) -> Option<T>,
) -> Result<Option<[T; 3]>, ReadReason> {
    let Some(found) = value.get(key) else { return Ok(None) };
    let numbers: Option<Vec<T>> = found.as_array().and_then(|list| list.iter().map(get).collect());
    let numbers = numbers.and_then(|n| <[T; 3]>::try_from(n).ok());
    numbers.map(Some).ok_or_else(|| ReadReason::Syntax(format!("\"{key}\" is not a list of three numbers")))
}
