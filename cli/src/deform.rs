//! Options that displace a mesh by one of its vectors.

use super::output;
use super::parse::parse_number;
use super::query::{Answer, Query};
use anyhow::Result;
use serde::Serialize;
use tetralod::mt::MtInfo;
use tetralod::session::{Deformation, Session};

/// The options that say what displaces a mesh.
#[derive(clap::Args)]
#[command(next_help_heading = "Deformed shape")]
pub struct Deform {
    /// Displace everything by this vector of the file, such as the displacement of a part under load: by its name, or by three
    /// fields with commas between them.
    #[arg(long = "deform", id = "deform", value_name = "VECTOR")]
    field: Option<String>,
    /// How many times the vector [default: so that nothing goes farther than 10 % of the model's diagonal].
    #[arg(long, value_name = "F", requires = "deform", value_parser = parse_number, allow_hyphen_values = true)]
    factor: Option<f64>,
    /// How much of a period has passed of what swings: the displacement is that times the sine [default: 0.25, all of it].
    #[arg(long, value_name = "P", requires = "deform", value_parser = parse_number, allow_hyphen_values = true)]
    phase: Option<f64>,
}

/// How something was displaced, as programs get it.
#[derive(Serialize)]
pub struct Displaced {
    pub deform: String,
    /// The time of the vector: of several steps it is that of the field that is shown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deform_time: Option<f64>,
    pub factor: f64,
    /// What the phase leaves of that, -1 to 1.
    pub part: f64,
    /// How far anything goes, in model units, at most.
    pub largest_displacement: f64,
    /// How far displaced places are from those of the displaced input, in model units.
    pub displaced_bound: Option<f64>,
}

impl Deform {
    /// What is given: the vector, the factor and the phase.
    pub fn given(&self) -> Option<(&String, Option<f64>, Option<f64>)> {
        self.field.as_ref().map(|field| (field, self.factor, self.phase))
    }

    /// How it displaces the mesh of an answer; none if it does not.
    pub fn of(&self, query: &Query, answer: &Answer) -> Result<Option<(Deformation, Displaced)>> {
        let (Some((name, factor, phase)), Some(bounds)) = (self.given(), answer.opened.session.bounds())
        else {
            return Ok(None);
        };
        let info = answer.opened.info()?;
        let deformation = Deformation::new((info, answer.field, &bounds), name, factor, phase)?;
        query.check_step(info, answer.field, deformation.fields[0])?;
        Ok(Some((deformation, Displaced::new(name, &deformation, info, &answer.opened.session))))
    }
}

impl Displaced {
    pub fn new(name: &str, deformation: &Deformation, info: &MtInfo, session: &Session) -> Self {
        let &Deformation { factor, part, fields, .. } = deformation;
        let errors = fields.map(|field| session.error_in(field).unwrap_or(f64::INFINITY));
        let bound = deformation.bound(info, errors);
        Self {
            deform: name.to_owned(),
            deform_time: info.fields[fields[0]].time,
            factor,
            part,
            largest_displacement: deformation.reach().abs(),
            displaced_bound: bound.is_finite().then_some(bound),
        }
    }

    /// What is told of it.
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let Self { deform, deform_time: time, factor, part, largest_displacement, displaced_bound } = self;
        let time = time.map(|time| format!(" at time {}", output::number(time))).unwrap_or_default();
        let (times, far) = (output::number(factor * part), output::number(*largest_displacement));
        let mut rows = vec![("displaced", format!("{times} times {deform}{time}, at most {far}"))];
        rows.extend(displaced_bound.map(|bound| ("places within", output::number(bound))));
        rows
    }
}
