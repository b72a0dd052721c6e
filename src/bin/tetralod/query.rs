//! What mesh a command works on: the options that say so, and the mesh itself.

use super::files;
use super::files::Opened;
use super::output;
use anyhow::Context;
use anyhow::Result;
use serde::Serialize;
use std::path::Path;
use std::str::FromStr;
use tetralod::geom::Bounds;
use tetralod::mt::MtInfo;
use tetralod::refine::Request;

/// The mesh to work on: as coarse as these options allow.
#[derive(clap::Args)]
pub struct Query {
    /// Largest error, in units of the field, or with % of its range; 0 is the reference mesh.
    #[arg(long, value_name = "E|E%", default_value = "0", allow_hyphen_values = true)]
    error: Tolerance,
    /// Only inside this box, in model units; everywhere else as coarse as possible.
    #[arg(long = "box", value_name = "x0,y0,z0,x1,y1,z1", value_parser = parse_box, allow_hyphen_values = true)]
    roi: Option<Bounds>,
    /// Only where the field passes this value, in units of the field (repeatable).
    #[arg(long = "iso", value_name = "V", value_parser = parse_number, allow_hyphen_values = true)]
    isovalues: Vec<f64>,
    /// The field that all values are of; the first one if not given.
    #[arg(long, value_name = "NAME")]
    field: Option<String>,
    /// At most so many tetrahedra.
    #[arg(long, value_name = "N")]
    budget: Option<u32>,
}

/// An error in units of a field, or as a fraction of its range.
#[derive(Clone, Copy, Debug)]
enum Tolerance {
    Absolute(f64),
    Relative(f64),
}

impl FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, relative) = match text.strip_suffix('%') {
            Some(number) => (number.trim_end(), true),
            None => (text, false),
        };
        let number = parse_number(number)?;
        if number < 0.0 {
            return Err("an error is not negative".to_owned());
        }
        Ok(if relative { Self::Relative(number / 100.0) } else { Self::Absolute(number) })
    }
}

impl Tolerance {
    /// As a fraction of the field's range.
    fn relative(self, range: f64) -> f64 {
        match self {
            Self::Absolute(error) => error / range,
            Self::Relative(error) => error,
        }
    }
}

impl Query {
    /// The values that the mesh is refined around.
    pub fn isovalues(&self) -> &[f64] {
        &self.isovalues
    }

    fn request(&self, info: &MtInfo) -> Result<Request> {
        let field = files::field_index(info, self.field.as_deref())?;
        Ok(Request {
            error: self.error.relative(info.fields[field].range()),
            roi: self.roi,
            isovalues: self.isovalues.clone(),
            field,
            max_tets: self.budget,
        })
    }

    /// Opens an MT file and refines its mesh to what is asked for; the session shows the field that is asked for.
    pub fn answer(&self, file: &Path) -> Result<Answer> {
        let name = || file.display().to_string();
        let mut opened = files::open_mt(file)?;
        let request = self.request(opened.info()?).with_context(name)?;
        let stats = opened.session.refine(&request).with_context(name)?;
        opened.session.set_field(request.field).with_context(name)?;
        let range = opened.info()?.fields[request.field].range();
        let summary = Summary {
            field: opened.info()?.fields[request.field].name.clone(),
            vertices: stats.vertices,
            tetrahedra: stats.tetrahedra,
            error_bound: stats.error_bound * range,
            relative_error_bound: stats.error_bound,
            satisfied: stats.satisfied,
        };
        Ok(Answer { opened, field: request.field, summary })
    }
}

/// A mesh that answers a query.
pub struct Answer {
    pub opened: Opened,
    /// Which field was asked for.
    pub field: usize,
    pub summary: Summary,
}

impl Answer {
    /// One of the fields at the vertices of the mesh.
    fn values(&self, field: usize) -> Result<Vec<f32>> {
        let info = &self.opened.info()?.fields[field];
        let mesh = self.opened.session.mesh().context("there is no mesh")?;
        let slots = 0..mesh.positions().len() as u32;
        Ok(slots.map(|slot| info.value(mesh.levels(slot)[field]) as f32).collect())
    }

    /// The names of all fields, in the order of the MT.
    pub fn field_names(&self) -> Result<Vec<String>> {
        Ok(self.opened.info()?.fields.iter().map(|field| field.name.clone()).collect())
    }

    /// All fields at the vertices of the mesh, in the order of the MT.
    pub fn all_values(&self) -> Result<Vec<Vec<f32>>> {
        (0..self.opened.info()?.fields.len()).map(|field| self.values(field)).collect()
    }
}

/// The mesh that a result is from, and the error that is guaranteed, as programs get them.
#[derive(Serialize)]
pub struct Summary {
    pub field: String,
    pub vertices: u32,
    pub tetrahedra: u32,
    /// In units of the field.
    pub error_bound: f64,
    /// As a fraction of the field's range.
    pub relative_error_bound: f64,
    pub satisfied: bool,
}

impl Summary {
    /// The same for people.
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let bound = format!(
            "{} ({} of the range)",
            output::number(self.error_bound),
            output::percent(self.relative_error_bound)
        );
        let mut rows = vec![
            ("field", self.field.clone()),
            ("tetrahedra", output::count(self.tetrahedra)),
            ("error bound", bound),
        ];
        if !self.satisfied {
            rows.push(("", "the budget did not allow the error that was asked for".to_owned()));
        }
        rows
    }
}

/// A finite number.
pub fn parse_number(text: &str) -> Result<f64, String> {
    let number: f64 = text.trim().parse().map_err(|_| format!("'{text}' is not a number"))?;
    if number.is_finite() { Ok(number) } else { Err(format!("'{text}' is not finite")) }
}

/// `N` finite numbers between commas; `what` has so many.
pub fn parse_numbers<const N: usize>(text: &str, what: &str) -> Result<[f64; N], String> {
    let numbers = text.split(',').map(parse_number).collect::<Result<Vec<_>, _>>()?;
    let found = numbers.len();
    numbers.try_into().map_err(|_| format!("{what} has {N} numbers, not {found}"))
}

fn parse_box(text: &str) -> Result<Bounds, String> {
    let [x0, y0, z0, x1, y1, z1] = parse_numbers(text, "a box")?;
    if x0 > x1 || y0 > y1 || z0 > z1 {
        return Err("a box has its smaller corner first".to_owned());
    }
    Ok(Bounds { min: [x0, y0, z0], max: [x1, y1, z1] })
}
