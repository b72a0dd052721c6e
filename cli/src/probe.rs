//! `tetralod probe`: what the fields are at points and along a line.

use super::output;
use super::parse::parse_numbers;
use super::poly::{Target, coordinates};
use super::query::{Answer, Query, Scope};
use anyhow::{Context, Result};
use glam::DVec3;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;
use tetralod::geom::Bounds;
use tetralod::mt::MtInfo;
use tetralod::refine::Region;
use tetralod::view::{MeshView, Place, Probe, Span};
use tetralod_io::PolyData;

/// Interpolates all fields at points or along a line.
///
/// Along a line there is a row for each place where it enters or leaves a tetrahedron: the fields are linear in between.
#[derive(clap::Args)]
#[command(after_help = "Examples: tetralod probe engine.mt --point 0.5,0.5,0.5 --error 1%\n          \
                        tetralod probe engine.mt --line 0,0,0,1,1,1 -o profile.csv\n          \
                        tetralod probe engine.mt --points sensors.csv -o values.csv")]
pub struct Arguments {
    #[command(flatten)]
    what: What,
    /// Instead of the exact profile of --line, so many points at equal distances.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
    samples: Option<u32>,
    #[command(flatten)]
    query: Query,
    /// The values to write: .csv, or .vtp, .ply, .obj, .npz for the points and lines with their values.
    #[arg(short, long, value_name = "FILE")]
    output: Option<Target>,
    /// Write a .csv with a row for each point and time step, and a column for each field.
    #[arg(long, requires = "output", conflicts_with = "time")]
    over_time: bool,
}

/// Where to look.
#[derive(clap::Args)]
#[group(required = true, multiple = false)]
struct What {
    /// A point in model units (repeatable).
    #[arg(long = "point", value_name = "x,y,z", value_parser = parse_point, allow_hyphen_values = true)]
    points: Vec<[f64; 3]>,
    /// Points from a file: the first three columns of a .csv, or the points of a mesh.
    #[arg(long = "points", value_name = "FILE")]
    list: Option<PathBuf>,
    /// A line between two points, in model units.
    #[arg(long, value_name = "x0,y0,z0,x1,y1,z1", value_parser = |text: &str| parse_numbers::<6>(text, "a line"), allow_hyphen_values = true)]
    line: Option<[f64; 6]>,
}

pub fn parse_point(text: &str) -> Result<[f64; 3], String> {
    parse_numbers(text, "a point")
}

/// The result as programs get it.
#[derive(Serialize)]
struct Report {
    /// Points that were looked at, or ends of the parts of a line.
    points: usize,
    /// Points outside of the mesh.
    outside: usize,
    /// The length of the line, and how much of it is inside, in model units.
    #[serde(skip_serializing_if = "Option::is_none")]
    length: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    length_inside: Option<f64>,
    /// The fields at each --point; null outside.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    values: Vec<Option<BTreeMap<String, f64>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    over_time: Option<OverTime>,
}

/// The values of fields with several time steps at each --point.
#[derive(Serialize)]
struct OverTime {
    times: Vec<f64>,
    /// By the name of a field, for each time that it has, else null; null outside.
    values: Vec<Option<BTreeMap<String, Vec<Option<f64>>>>>,
}

/// A field that is written: its number, its name, and its values at all samples.
struct Column<'a> {
    field: usize,
    name: String,
    values: &'a [Option<f64>],
}

/// A point that was looked at.
struct Sample {
    position: [f64; 3],
    /// How far along the line, in model units.
    distance: Option<f64>,
    place: Option<Place>,
}

/// All samples, and how the points of a line hang together.
#[derive(Default)]
struct Samples {
    samples: Vec<Sample>,
    lines: Vec<Vec<u32>>,
    length: Option<f64>,
    length_inside: Option<f64>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    if arguments.samples.is_some() && arguments.what.line.is_none() {
        crate::usage::refuse_usage("--samples are points of a line: give --line, too");
    }
    if let Some(target) = &arguments.output {
        if arguments.over_time && !target.is_table() {
            crate::usage::refuse_usage("--over-time is a table: let the name of the output end in .csv");
        }
        let inputs = arguments.what.list.iter().chain(arguments.query.files());
        target.check(inputs)?;
    }
    let points = arguments.what.points()?;
    let places = around(arguments.what.line, &points);
    let mut answer = arguments.query.answer_for(&Scope { at_all_times: arguments.over_time, places })?;
    let start = Instant::now();
    let fields = answer.all_values()?;
    let written = answer.written_fields()?;
    let views = answer.views(&fields)?;
    let mesh = answer.opened.session.view();
    let found = look(arguments, mesh, points);
    let seconds = start.elapsed().as_secs_f64();
    let value = |sample: &Sample, f: usize| sample.place.map(|place| place.interpolate(&mesh, views[f]));
    let all: Vec<Vec<Option<f64>>> =
        (0..fields.len()).map(|f| found.samples.iter().map(|sample| value(sample, f)).collect()).collect();
    let column = |(field, name)| Column { field, name, values: &all[field] };
    let columns: Vec<Column<'_>> = written.into_iter().map(column).collect();
    let info = answer.opened.info()?;
    if let Some(target) = &arguments.output {
        let table =
            if arguments.over_time { over_time(&found, info, &columns) } else { table(&found, &columns) };
        target.write_either(&poly_data(&found, &all, &answer)?, &table)?;
    }
    let report = report(arguments, &found, info, &columns);
    // Digits that the bound of the mesh leaves without a meaning are not shown.
    let step = |column: &Column<'_>| {
        let (bound, field) =
            (info.field_bound(column.field, answer.stats.error_bound), &info.fields[column.field]);
        if bound > 0.0 { bound.min(1e-4 * field.range()) } else { field.step }
    };
    let steps: Vec<f64> = columns.iter().map(step).collect();
    let rows = rows(arguments, &report, (&columns, &steps));
    arguments.query.print(&report, rows, (&answer.summary, seconds))
}

impl What {
    /// The points that are given.
    fn points(&self) -> Result<Vec<[f64; 3]>> {
        self.list.as_ref().map_or_else(|| Ok(self.points.clone()), |path| read_points(path))
    }
}

/// So many points have regions of their own; more have one around all of them.
const MOST_REGIONS: usize = 32;

/// How thick the region around a line is, as a part of its length: no more than rounding.
const THICKNESS: f64 = 1e-9;

/// Where the mesh is needed for a line or points.
fn around(line: Option<[f64; 6]>, points: &[[f64; 3]]) -> Vec<Region> {
    if let Some([x0, y0, z0, x1, y1, z1]) = line {
        let [from, to] = [DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1)];
        let (half, centre) = (0.5 * (to - from), from.midpoint(to).to_array());
        let Some(along) = half.try_normalize() else { return vec![point(centre)] };
        let (u, v) = along.any_orthonormal_pair();
        let width = THICKNESS * half.length();
        let halves = [half, width * u, width * v].map(|half| half.to_array());
        return vec![Region::OrientedBox { centre, halves }];
    }
    if points.len() > MOST_REGIONS {
        return vec![Region::Box(Bounds::of(points))];
    }
    points.iter().copied().map(point).collect()
}

/// The region that is a point.
fn point(place: [f64; 3]) -> Region {
    Region::Box(Bounds { min: place, max: place })
}

fn look(arguments: &Arguments, mesh: MeshView<'_>, points: Vec<[f64; 3]>) -> Samples {
    let mut probe = Probe::new(mesh);
    if let Some([x0, y0, z0, x1, y1, z1]) = arguments.what.line {
        let ends = [[x0, y0, z0], [x1, y1, z1]];
        return match arguments.samples {
            Some(count) => evenly(&mut probe, ends, count),
            None => profile(&probe, ends),
        };
    }
    let places = probe.locate_all(&points);
    let sample = |(position, place)| Sample { position, distance: None, place };
    Samples { samples: points.into_iter().zip(places).map(sample).collect(), ..Samples::default() }
}

fn at([from, to]: [[f64; 3]; 2], s: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| from[i] + s * (to[i] - from[i]))
}

fn length([from, to]: [[f64; 3]; 2]) -> f64 {
    DVec3::from(from).distance(DVec3::from(to))
}

fn inside(spans: &[Span]) -> f64 {
    spans.iter().map(|span| span.to - span.from).sum()
}

/// The ends of all parts of a line.
fn profile(probe: &Probe<'_>, ends: [[f64; 3]; 2]) -> Samples {
    let spans = probe.line(ends[0], ends[1]);
    let length = length(ends);
    let mut found = Samples::default();
    for (i, span) in spans.iter().enumerate() {
        if i == 0 || spans[i - 1].to < span.from {
            found.lines.push(Vec::new());
        }
        for (s, place) in [(span.from, span.entry), (span.to, span.exit)] {
            found.lines.last_mut().into_iter().for_each(|line| line.push(found.samples.len() as u32));
            let position = at(ends, s);
            found.samples.push(Sample { position, distance: Some(s * length), place: Some(place) });
        }
    }
    Samples { length: Some(length), length_inside: Some(inside(&spans) * length), ..found }
}

/// Points at equal distances.
fn evenly(probe: &mut Probe<'_>, ends: [[f64; 3]; 2], count: u32) -> Samples {
    let length = length(ends);
    let mut found = Samples::default();
    let mut line: Vec<u32> = Vec::new();
    for i in 0..count {
        let s = f64::from(i) / f64::from(count - 1);
        let position = at(ends, s);
        let place = probe.locate(position);
        found.samples.push(Sample { position, distance: Some(s * length), place });
        if place.is_some() {
            line.push(i);
        } else {
            found.lines.push(std::mem::take(&mut line));
        }
    }
    found.lines.push(line);
    found.lines.retain(|line| line.len() > 1);
    let spans = probe.line(ends[0], ends[1]);
    Samples { length: Some(length), length_inside: Some(inside(&spans) * length), ..found }
}

/// The points of a file: a table whose first line may be names, or a mesh.
fn read_points(path: &Path) -> Result<Vec<[f64; 3]>> {
    let is_table = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
    if !is_table {
        return Ok(tetralod_io::read(path)?.positions);
    }
    let name = || path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(name)?;
    let mut points = Vec::new();
    for (number, line) in (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
        let first: Vec<&str> = line.split(',').take(3).collect();
        match parse_numbers(&first.join(","), "a point") {
            Ok(point) => points.push(point),
            // Names of columns.
            Err(_) if number == 1 => {}
            Err(problem) => anyhow::bail!("{}: line {number}: {problem}", name()),
        }
    }
    Ok(points)
}

fn table(found: &Samples, columns: &[Column<'_>]) -> Vec<(String, Vec<f64>)> {
    let column = |of: &dyn Fn(&Sample) -> Option<f64>| -> Vec<f64> {
        found.samples.iter().map(|sample| of(sample).unwrap_or(f64::NAN)).collect()
    };
    let mut table: Vec<(String, Vec<f64>)> = Vec::new();
    if found.length.is_some() {
        table.push(("distance".to_owned(), column(&|sample| sample.distance)));
    }
    table.extend(coordinates(found.samples.iter().map(|sample| sample.position)));
    table.push(("tetrahedron".to_owned(), column(&|sample| sample.place.map(|place| f64::from(place.tet)))));
    for Column { name, values, .. } in columns {
        table.push((name.clone(), values.iter().map(|value| value.unwrap_or(f64::NAN)).collect()));
    }
    table
}

/// The times of fields, ascending.
fn times(info: &MtInfo, columns: &[Column<'_>]) -> Vec<f64> {
    let mut times: Vec<f64> = columns.iter().filter_map(|column| info.fields[column.field].time).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    times
}

/// The names of fields without their times, in the order of the MT.
fn names<'a>(info: &'a MtInfo, columns: &[Column<'_>]) -> Vec<&'a str> {
    let mut names: Vec<&str> = Vec::new();
    for Column { field, .. } in columns {
        let name = info.fields[*field].name.as_str();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// The value of a field at a sample and a time, at which it is that of a field without time, too.
fn value_at(info: &MtInfo, columns: &[Column<'_>], name: &str, time: f64, sample: usize) -> Option<f64> {
    let is_of = |column: &&Column<'_>| {
        let field = &info.fields[column.field];
        field.name == name && field.time.is_none_or(|own| own == time)
    };
    columns.iter().find(is_of)?.values[sample]
}

/// A row for each sample and time, and a column for each field.
fn over_time(found: &Samples, info: &MtInfo, columns: &[Column<'_>]) -> Vec<(String, Vec<f64>)> {
    let times = times(info, columns);
    let rows = || (0..found.samples.len()).flat_map(|i| times.iter().map(move |&time| (i, time)));
    let mut table = vec![("point".to_owned(), rows().map(|(i, _)| (i + 1) as f64).collect())];
    if found.length.is_some() {
        let distance = rows().map(|(i, _)| found.samples[i].distance.unwrap_or(f64::NAN));
        table.push(("distance".to_owned(), distance.collect()));
    }
    table.extend(coordinates(rows().map(|(i, _)| found.samples[i].position)));
    table.push(("time".to_owned(), rows().map(|(_, time)| time).collect()));
    for name in names(info, columns) {
        let value = |(i, time)| value_at(info, columns, name, time, i).unwrap_or(f64::NAN);
        table.push((name.to_owned(), rows().map(value).collect()));
    }
    table
}

/// The points that are inside, and the lines through them.
fn poly_data(found: &Samples, all: &[Vec<Option<f64>>], answer: &Answer) -> Result<PolyData> {
    let kept: Vec<usize> = (0..found.samples.len()).filter(|&i| found.samples[i].place.is_some()).collect();
    let mut new = vec![0; found.samples.len()];
    (0..).zip(&kept).for_each(|(v, &i)| new[i] = v);
    let values = |column: &Vec<Option<f64>>| kept.iter().map(|&i| column[i].unwrap_or_default()).collect();
    Ok(PolyData {
        fields: answer.point_values(all.iter().map(values).collect())?,
        lines: found.lines.iter().map(|line| line.iter().map(|&i| new[i as usize]).collect()).collect(),
        ..answer.poly_data(kept.iter().map(|&i| found.samples[i].position).collect())?
    })
}

fn report(arguments: &Arguments, found: &Samples, info: &MtInfo, columns: &[Column<'_>]) -> Report {
    let points = arguments.what.points.len();
    let all_at = |i: usize| {
        let values = columns.iter().map(|column| Some((column.name.clone(), column.values[i]?)));
        values.collect::<Option<BTreeMap<_, _>>>()
    };
    let times = times(info, columns);
    let at_all_times = |i: usize| {
        found.samples[i].place?;
        let has_steps =
            |name: &&str| columns.iter().filter(|c| info.fields[c.field].name == *name).count() > 1;
        let values = |name: &str| times.iter().map(|&time| value_at(info, columns, name, time, i)).collect();
        let steps = names(info, columns).into_iter().filter(has_steps);
        Some(steps.map(|name| (name.to_owned(), values(name))).collect())
    };
    let over_time = (times.len() > 1 && points > 0)
        .then(|| OverTime { values: (0..points).map(at_all_times).collect(), times: times.clone() });
    Report {
        points: found.samples.len(),
        outside: found.samples.iter().filter(|sample| sample.place.is_none()).count(),
        length: found.length,
        length_inside: found.length_inside,
        values: (0..points).map(all_at).collect(),
        over_time,
    }
}

/// `steps`: how much counts of a value of each column.
fn rows(
    arguments: &Arguments,
    report: &Report,
    (columns, steps): (&[Column<'_>], &[f64]),
) -> Vec<(String, String)> {
    let mut lines: Vec<(String, String)> = Vec::new();
    if let Some(target) = &arguments.output {
        lines.push(("file".to_owned(), target.path.display().to_string()));
    }
    lines.push(("points".to_owned(), output::count(report.points as u64)));
    lines.push(("outside".to_owned(), output::count(report.outside as u64)));
    for (name, length) in [("length", report.length), ("length inside", report.length_inside)] {
        lines.extend(length.map(|length| (name.to_owned(), output::number(length))));
    }
    for (i, point) in arguments.what.points.iter().enumerate() {
        let at = point.map(output::exact).join(",");
        let row = |(Column { name, values, .. }, step): (&Column<'_>, &f64)| {
            Some((format!("{name} at {at}"), output::within(values[i]?, *step)))
        };
        let rows: Option<Vec<_>> = columns.iter().zip(steps).map(row).collect();
        lines.extend(rows.unwrap_or_else(|| vec![(at.clone(), "outside".to_owned())]));
    }
    lines
}
