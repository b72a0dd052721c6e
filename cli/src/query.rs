//! What mesh a command works on: the options that say so, and the mesh itself.
//!
//! The plain options make needs of one error; each `--need` makes others, with an error of its own. The mesh suits all.

use super::files::{Bytes, Opened, PATIENCE};
use super::needs::{Group, NamedNeed};
use super::parse::{Tolerance, parse_bytes, parse_count, parse_size};
use super::{files, needs, output, steps};
use anyhow::{Context, Result};
use serde::Serialize;
use std::cell::Cell;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tetralod::format::FormatError;
use tetralod::mt::{FieldInfo, Mt, MtInfo, MultiTessellation};
use tetralod::refine::{Budget, Need, Outcome, RefineStats, Region, Request};
use tetralod::session::{Client, ClientError};
use tetralod::stream::Traffic;
use tetralod::view::FieldView;
use tetralod_io::{PointValues, PolyData};

/// What the options look like in use.
pub const EXAMPLES: &str = "\
Examples (everything in model units and units of the field, errors also in % of the field's range):
  --error 1%                                        within 1 % of the range everywhere
  --box 0,0,0,1,1,1 --error 0.1% --outside 5%       fine in a box, coarse around it
  --sphere 5,5,5,2 --iso 0.5 --error 1%             an isosurface inside a ball
  --need 'box=0,0,0,1,1,1; error=0' --need 'iso=0.5; iso=0.8; error=1%'
                                                    a box at full detail and, everywhere, two isosurfaces
  --view camera.json --pixels 2 --outside 10%       what a camera sees, and roughly the rest
  --transfer colours.json --max-bytes 50M           the best picture that 50 MiB can give
Shapes, regions and values limit each other; everything else is a union. Without any option the mesh is the reference mesh.

camera.json:  {\"matrix\": [16 numbers: clip from model space, column by column], \"viewport\": [1920, 1080], \"pixels\": 1}
colours.json: {\"points\": [[value, red, green, blue, opacity], ...], \"unit_length\": 0.1, \"field\": \"name\"}; colours and
              opacities 0 to 1, the opacity that of a way of unit_length times the model's diagonal";

/// Heading in the help of the options that limit the mesh and the work.
const LIMITS: &str = "How large, how long";

/// What every command that works on a mesh takes: the MT, the needs that the mesh meets, its limits, and how results are
/// printed. The mesh is the coarsest one that meets all needs.
#[derive(clap::Args)]
pub struct Query {
    /// The MT file, or its http(s) address.
    pub file: PathBuf,
    #[command(flatten)]
    group: Group,
    /// In addition, everywhere within this error, in units of the field, or with % of its range.
    #[arg(long, value_name = "E|E%", allow_hyphen_values = true, help_heading = needs::WHAT)]
    outside: Option<Tolerance>,
    /// Another need with its own error: 'key=value; key=value; …'. The keys are the names of the options above
    /// (repeatable: the mesh meets all needs).
    #[arg(long = "need", value_name = "K=V;…", allow_hyphen_values = true, help_heading = needs::WHAT)]
    needs: Vec<Group>,
    /// At most this many tetrahedra: the best mesh that fits, but never less than the base mesh.
    #[arg(long, value_name = "N", value_parser = parse_count::<u32>, allow_hyphen_values = true, help_heading = LIMITS)]
    budget: Option<u32>,
    /// At most this many vertices.
    #[arg(long, value_name = "N", value_parser = parse_count::<u32>, allow_hyphen_values = true, help_heading = LIMITS)]
    max_vertices: Option<u32>,
    /// At most this many bytes, 32 a tetrahedron and 16 a vertex; K, M and G are KiB, MiB and GiB.
    #[arg(long, value_name = "N[K|M|G]", value_parser = parse_bytes, allow_hyphen_values = true, help_heading = LIMITS)]
    max_bytes: Option<u64>,
    /// Stop refining after this many milliseconds: the mesh is valid but unfinished, and not the same each time.
    #[arg(long, value_name = "MS", value_parser = parse_size, allow_hyphen_values = true, help_heading = LIMITS)]
    max_ms: Option<f64>,
    /// Stop refining after this many updates: the mesh is valid but unfinished.
    #[arg(long, value_name = "N", value_parser = parse_count::<u64>, allow_hyphen_values = true, help_heading = LIMITS)]
    max_updates: Option<u64>,
    /// Print the result as a JSON object.
    #[arg(long)]
    json: bool,
}

impl Query {
    /// The files that it reads.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        let named = self.group.files().chain(self.needs.iter().flat_map(Group::files));
        named.chain([&self.file])
    }

    /// The largest size of the mesh.
    pub fn limits(&self) -> Budget {
        Budget { tets: self.budget, vertices: self.max_vertices, bytes: self.max_bytes }
    }

    /// Whether refinement may end before the mesh is what was asked for.
    pub fn is_stopped_early(&self) -> bool {
        self.max_ms.is_some() || self.max_updates.is_some()
    }

    /// The values of the isosurfaces that the mesh is refined around by `--iso`.
    pub fn isovalues(&self) -> &[f64] {
        self.group.isovalues()
    }

    /// The transfer function that the mesh is refined for, as [`Group::shown`] gives it.
    pub fn transfer(&self, field: &str) -> Result<Option<(Vec<[f64; 5]>, f64)>> {
        self.group.shown(field)
    }

    /// The number of the field that is asked for.
    pub fn field_index(&self, info: &MtInfo) -> Result<usize> {
        steps::field_index(info, self.group.field(), self.group.time())
    }

    /// The number of the field of one of the needs, given that of the field that is shown.
    fn field_of(&self, group: &Group, info: &MtInfo, shown: usize) -> Result<usize> {
        if group.time().is_some() {
            return steps::field_index(info, group.field().or(self.group.field()), group.time());
        }
        let Some(name) = group.field() else { return Ok(shown) };
        let field = steps::beside(info, name, shown)?;
        self.check_step(info, shown, field).map(|()| field)
    }

    /// Refuses what is to displace or colour if it has steps, but none at the time that is asked for. `shown` is the field at that time.
    pub fn check_step(&self, info: &MtInfo, shown: usize, other: usize) -> Result<()> {
        match (self.group.time(), info.fields[other].time) {
            (Some(time), Some(found)) if info.fields[shown].time != Some(found) => {
                Err(steps::no_step(info, other, time))
            }
            _ => Ok(()),
        }
    }

    /// What is needed at the places of a scope alone, if the options do not say where.
    fn narrowed(&self, scope: &Scope) -> Option<Group> {
        let is_open = !scope.places.is_empty() && self.needs.is_empty() && self.outside.is_none();
        self.group.limited_to(&scope.places).filter(|_| is_open)
    }

    /// The needs, given the time steps of the field that are shown: those of all.
    fn named_needs(&self, mt: &Mt, steps: &[usize], scope: &Scope) -> Result<Vec<NamedNeed>> {
        let (info, mut needs) = (mt.info(), Vec::new());
        if let Some(group) = self.narrowed(scope) {
            for &shown in steps {
                group.add_to(mt, shown, &mut needs)?;
            }
            return Ok(needs);
        }
        for (i, &shown) in steps.iter().enumerate() {
            // Without any other need, the mesh is the reference mesh everywhere.
            if !self.group.is_empty() || self.needs.is_empty() && self.outside.is_none() {
                self.group.add_to(mt, shown, &mut needs)?;
            }
            for group in self.needs.iter().filter(|group| i == 0 || group.time().is_none()) {
                group.add_to(mt, self.field_of(group, info, shown)?, &mut needs)?;
            }
            if let Some(error) = self.outside {
                let need = Need::within(error.relative(info.fields[shown].range()));
                needs.push(NamedNeed { name: "everywhere".to_owned(), need });
            }
        }
        Ok(needs)
    }

    /// The regions that the result shows, as they are named; all if there are none, or something is asked for elsewhere.
    pub fn shown_regions(&self) -> Option<Vec<String>> {
        let of_group = (!self.group.is_empty() || self.needs.is_empty()).then_some(&self.group);
        let groups = || of_group.into_iter().chain(&self.needs);
        let is_limited = self.outside.is_none() && groups().all(|group| !group.regions().is_empty());
        is_limited.then(|| groups().flat_map(|group| group.regions().to_vec()).collect())
    }

    /// Opens the MT and refines its mesh to what is asked for; the session shows the field that is asked for.
    pub fn answer(&self) -> Result<Answer> {
        self.answer_for(&Scope::default())
    }

    /// [`Query::answer`] with a mesh for more, or for less.
    pub fn answer_for(&self, scope: &Scope) -> Result<Answer> {
        self.answer_with(scope, |_| Ok(()))
    }

    /// [`Query::answer`] with the exact values that the file keeps, and a warning if they are cut off.
    pub fn answer_exactly(&self) -> Result<Answer> {
        self.answer_with(&Scope::default(), |client| match client.fetch_exact() {
            Err(ClientError::Format(FormatError::Truncated { .. })) => {
                let file = self.file.display();
                output::note(&format!(
                    "warning: {file}: the exact values that the file keeps are cut off; the values are those of the lattices, as \
                     `tetralod info` bounds them"
                ));
                Ok(())
            }
            fetched => Ok(fetched?),
        })
    }

    fn answer_with(
        &self,
        scope: &Scope,
        fetch_more: impl FnOnce(&mut Client<Bytes>) -> Result<()>,
    ) -> Result<Answer> {
        if let Err(wrong) = self.group.check() {
            crate::usage::refuse_usage(&wrong);
        }
        files::open_parts(&self.file)
            .and_then(|client| self.refined(client, scope, fetch_more))
            .with_context(|| self.file.display().to_string())
    }

    /// [`Query::answer`] of a file that is open.
    pub fn answer_from(&self, client: Client<Bytes>) -> Result<Answer> {
        self.refined(client, &Scope::default(), |_| Ok(())).with_context(|| self.file.display().to_string())
    }

    fn refined(
        &self,
        mut client: Client<Bytes>,
        scope: &Scope,
        fetch_more: impl FnOnce(&mut Client<Bytes>) -> Result<()>,
    ) -> Result<Answer> {
        let mt = client.session().mt().context("the MT has no description")?;
        let info = mt.info();
        let field = self.field_index(info)?;
        let steps = if scope.at_all_times { steps::in_order(info, field)? } else { vec![field] };
        let (field, needs) = (steps[0], self.named_needs(mt, &steps, scope)?);
        let needed = needs.iter().map(|named| named.need.clone()).collect();
        client.request(&Request { needs: needed, budget: self.limits() })?;
        while !client.fetch(PATIENCE)? {}
        fetch_more(&mut client)?;
        let start = Instant::now();
        let (mut opened, stats) = self.refine(client)?;
        let seconds = start.elapsed().as_secs_f64();
        opened.session.set_field(field)?;
        let shown =
            self.shown_regions().map(|names| needs::find_regions(opened.mt()?, &names)).transpose()?;
        opened.session.show_regions(shown.as_deref());
        // A point may well be outside.
        let told = needs.iter().filter(|_| self.narrowed(scope).is_none());
        let warnings = told.filter_map(|named| needs::warning(&opened.session, &stats, named));
        warnings.for_each(|warning| output::note(&format!("warning: {warning}")));
        let summary = summary(&opened, field, &stats, &needs)?;
        let of_one_time = self.group.time().is_some();
        Ok(Answer { opened, field, of_one_time, needs, stats, seconds, summary })
    }

    /// Refines until the request is met or a limit of time or updates is reached.
    fn refine(&self, mut client: Client<Bytes>) -> Result<(Opened, RefineStats)> {
        let start = Instant::now();
        let deadline = self.max_ms.map(|ms| Duration::from_secs_f64(ms / 1000.0));
        let stopped = Cell::new(false);
        let mut go_on = |done: &Outcome| {
            let goes_on = self.max_updates.is_none_or(|most| done.refined + done.coarsened < most)
                && deadline.is_none_or(|deadline| start.elapsed() < deadline);
            stopped.set(!goes_on);
            goes_on
        };
        // Which blocks of a half-edge MT are needed shows only while the mesh is refined.
        let mut before = RefineStats::default();
        while client.session().mt().is_some_and(Mt::is_paged) {
            let stats = client.step(PATIENCE, &mut go_on)?;
            before.add_work(&stats);
            if client.is_complete(&stats) || stopped.get() {
                break;
            }
        }
        let mut opened = Opened::of(client);
        let mut stats = opened.session.step(&mut go_on)?;
        stats.add_work(&before);
        Ok((opened, stats))
    }

    /// Prints a result: `found` and the summary of the mesh as one JSON object, or `rows` and those of the summary.
    pub fn print<N: Into<String>>(
        &self,
        found: &impl Serialize,
        rows: Vec<(N, String)>,
        mesh: (&Summary, f64),
    ) -> Result<()> {
        self.print_around(found, [rows, Vec::new()], mesh)
    }

    /// [`Query::print`] with rows before and after those of the summary.
    pub fn print_around<N: Into<String>>(
        &self,
        found: &impl Serialize,
        [before, after]: [Vec<(N, String)>; 2],
        (mesh, seconds): (&Summary, f64),
    ) -> Result<()> {
        let named = |rows: Vec<(N, String)>| rows.into_iter().map(|(name, value)| (name.into(), value));
        let time = ("time", format!("{seconds:.3} s"));
        let of_mesh = mesh.rows().into_iter().chain([time]).map(|(name, value)| (name.to_owned(), value));
        let rows: Vec<(String, String)> = named(before).chain(of_mesh).chain(named(after)).collect();
        output::result(self.json, &Report { found, mesh, seconds }, &rows)
    }
}

/// A result as programs get it.
#[derive(Serialize)]
struct Report<'a, T> {
    #[serde(flatten)]
    found: &'a T,
    #[serde(flatten)]
    mesh: &'a Summary,
    seconds: f64,
}

/// What a mesh is for, beside what the options say.
#[derive(Default)]
pub struct Scope {
    /// Whether it meets the needs at all time steps of the field. The first is shown.
    pub at_all_times: bool,
    /// Where alone it is needed, if the options do not say where it is.
    pub places: Vec<Region>,
}

/// A mesh that answers a query.
pub struct Answer {
    pub opened: Opened,
    /// Which field was asked for.
    pub field: usize,
    /// Whether its time was asked for.
    of_one_time: bool,
    pub needs: Vec<NamedNeed>,
    pub stats: RefineStats,
    /// What refinement took.
    pub seconds: f64,
    pub summary: Summary,
}

/// The mesh that a result is from, and the error that is guaranteed, as programs get them.
#[derive(Clone, Serialize)]
pub struct Summary {
    pub field: String,
    /// Of the step of the field, if it is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    pub vertices: u32,
    pub tetrahedra: u32,
    pub updates_applied: u32,
    /// In units of the field; none as long as it is not known.
    pub error_bound: Option<f64>,
    /// As a fraction of the field's range.
    pub relative_error_bound: Option<f64>,
    /// Of the field at the vertices of the input inside the mesh, in its units: the error bound, or what rounding leaves.
    pub field_bound: Option<f64>,
    /// How far the boundary is from that of the input, in model units.
    pub boundary_bound: Option<f64>,
    /// How often the error exceeds what was asked for, at most.
    pub excess: Option<f64>,
    pub satisfied: bool,
    /// False if a limit of time or updates came first.
    pub done: bool,
    pub needs: Vec<NeedReport>,
    pub refined: u64,
    pub coarsened: u64,
    pub forced: u64,
    pub judged: u64,
    /// Bytes of the file that were read, those of a server as they came: where blocks of it are not needed, not all.
    pub bytes_read: u64,
    pub file_bytes: u64,
    /// Of a file on a server.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub network: Option<NetworkReport>,
}

/// What a request took of a network.
#[derive(Clone, Serialize)]
pub struct NetworkReport {
    pub requests: u64,
    /// How often something was asked for while nothing was on its way.
    pub rounds: u64,
    pub seconds_waited: f64,
}

impl NetworkReport {
    fn of(traffic: &Traffic) -> Self {
        let Traffic { requests, rounds, waited_ms, .. } = *traffic;
        Self { requests, rounds, seconds_waited: waited_ms as f64 / 1000.0 }
    }
}

/// What was asked for in one need, and what is guaranteed.
#[derive(Clone, Serialize)]
pub struct NeedReport {
    /// In words.
    pub need: String,
    /// Of both errors: `relative` to the range of the field, `pixels` or `colour`.
    pub unit: &'static str,
    pub asked: f64,
    pub bound: Option<f64>,
}

fn summary(opened: &Opened, number: usize, stats: &RefineStats, needs: &[NamedNeed]) -> Result<Summary> {
    let known = |value: f64| (stats.done && value.is_finite()).then_some(value);
    let report = |(i, named): (usize, &NamedNeed)| NeedReport {
        need: named.name.clone(),
        unit: needs::unit(&named.need),
        asked: named.need.error,
        bound: stats.bounds.get(i).copied().and_then(known),
    };
    let info = opened.info()?;
    let field = &info.fields[number];
    Ok(Summary {
        field: field.name.clone(),
        time: field.time,
        vertices: stats.vertices,
        tetrahedra: stats.tetrahedra,
        updates_applied: stats.applied,
        error_bound: known(stats.error_bound * field.range()),
        relative_error_bound: known(stats.error_bound),
        field_bound: known(info.field_bound(number, stats.error_bound)),
        boundary_bound: known(info.boundary_bound(stats.error_bound)),
        excess: known(stats.excess),
        satisfied: stats.satisfied,
        done: stats.done,
        needs: needs.iter().enumerate().map(report).collect(),
        refined: stats.refined,
        coarsened: stats.coarsened,
        forced: stats.forced,
        judged: stats.judged,
        bytes_read: opened.read,
        file_bytes: opened.bytes,
        network: opened.traffic.as_ref().map(NetworkReport::of),
    })
}

impl Summary {
    /// The field and its time, for people.
    pub fn field(&self) -> String {
        let time = self.time.map(|time| format!(" at time {}", output::exact(time)));
        self.field.clone() + &time.unwrap_or_default()
    }

    /// The summary for people: a line for each number.
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let bound = match (self.error_bound, self.relative_error_bound) {
            (Some(bound), Some(relative)) => {
                format!("{} ({} of the range)", output::number(bound), output::percent(relative))
            }
            _ => "not known yet".to_owned(),
        };
        let mut rows = vec![
            ("field", self.field()),
            ("vertices", output::count(self.vertices)),
            ("tetrahedra", output::count(self.tetrahedra)),
            ("updates applied", output::count(self.updates_applied)),
            ("error bound", bound),
        ];
        if let Some(bound) = self.boundary_bound {
            rows.push(("boundary within", output::number(bound)));
        }
        // One need of the field says no more than the bound.
        if self.needs.iter().any(|need| need.need != self.needs[0].need)
            || self.needs.iter().any(|need| need.unit != needs::RELATIVE)
        {
            rows.extend(self.needs.iter().map(|need| ("need", need.sentence())));
        }
        let [read, all] = [self.bytes_read, self.file_bytes].map(output::bytes);
        rows.push(("read", format!("{read} of {all}")));
        if let Some(NetworkReport { requests, rounds, seconds_waited }) = &self.network {
            rows.push((
                "waited",
                format!("{seconds_waited:.2} s for {requests} requests in {rounds} rounds"),
            ));
        }
        if !self.done {
            rows.push(("", "stopped before it was done".to_owned()));
        } else if !self.satisfied {
            rows.push(("", "the budget did not allow the error that was asked for".to_owned()));
        }
        rows
    }
}

impl NeedReport {
    fn sentence(&self) -> String {
        let say = |error: f64| match self.unit {
            needs::PIXELS => format!("{} pixels", output::number(error)),
            _ => output::percent(error),
        };
        let bound = self.bound.map_or("not known yet".to_owned(), say);
        format!("{}: {bound}, {} wanted", self.need, say(self.asked))
    }
}

impl Answer {
    /// The fields that results have, by their numbers, and their names: all, or if a time is asked for those of that time and of none. Of several
    /// steps of one field each has its time behind its name.
    pub fn written_fields(&self) -> Result<Vec<(usize, String)>> {
        let info = self.opened.info()?;
        let now = info.fields[self.field].time;
        let is_written = |&field: &usize| {
            let time = info.fields[field].time;
            !self.of_one_time || time.is_none() || time == now
        };
        let name = |field: usize| {
            let FieldInfo { name, time, .. } = &info.fields[field];
            match time.filter(|_| steps::all_of(info, field).filter(is_written).count() > 1) {
                Some(time) => format!("{name}@{time:?}"),
                None => name.clone(),
            }
        };
        Ok((0..info.fields.len()).filter(is_written).map(|field| (field, name(field))).collect())
    }

    /// A surface or lines of the mesh at these points, without anything else: what is written of it keeps the steps of the lattice.
    pub fn poly_data(&self, positions: Vec<[f64; 3]>) -> Result<PolyData> {
        let step = self.opened.info()?.lattice.step.into_iter().fold(f64::INFINITY, f64::min);
        Ok(PolyData { positions, step, ..PolyData::default() })
    }

    /// What is written of the values of all fields at points: it keeps the levels of the field.
    pub fn point_values(&self, mut values: Vec<Vec<f64>>) -> Result<Vec<PointValues>> {
        let fields = &self.opened.info()?.fields;
        let named = |(field, name): (usize, String)| PointValues {
            name,
            values: std::mem::take(&mut values[field]),
            step: fields[field].step,
        };
        Ok(self.written_fields()?.into_iter().map(named).collect())
    }

    /// All fields, whose values at the vertices of the mesh are these.
    pub fn views<'a>(&self, values: &'a [Vec<f64>]) -> Result<Vec<FieldView<'a>>> {
        let fields = self.opened.info()?.fields.iter().zip(values);
        Ok(fields.map(|(info, values)| FieldView { values, is_label: info.is_label }).collect())
    }

    /// All fields at the vertices of the mesh, in the order of the MT.
    pub fn all_values(&self) -> Result<Vec<Vec<f64>>> {
        Ok((0..self.opened.info()?.fields.len()).map(|field| self.opened.session.values(field)).collect())
    }
}
