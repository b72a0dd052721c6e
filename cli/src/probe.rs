//! `tetralod probe`: what the fields are at points and along a line.

use super::output;
use super::parse::parse_numbers;
use super::poly::{Target, coordinates};
use super::query::{Answer, Query};
use anyhow::{Context, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;
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
        let inputs = arguments.what.list.iter().chain(arguments.query.files());
        target.check(inputs)?;
    }
    let mut answer = arguments.query.answer()?;
    let start = Instant::now();
    let fields = answer.all_values()?;
    let names = answer.field_names()?;
    let mesh = answer.opened.session.view();
    let found = look(arguments, mesh)?;
    let seconds = start.elapsed().as_secs_f64();
    let value = |sample: &Sample, f: usize| sample.place.map(|place| place.interpolate(&mesh, &fields[f]));
    let columns: Vec<Vec<Option<f64>>> =
        (0..names.len()).map(|f| found.samples.iter().map(|sample| value(sample, f)).collect()).collect();
    if let Some(target) = &arguments.output {
        target.write_either(&poly_data(&found, &columns, &answer)?, &table(&found, &names, &columns))?;
    }
    let report = report(arguments, &found, &names, &columns);
    // Digits that the bound of the mesh leaves without a meaning are not shown.
    let info = answer.opened.info()?;
    let steps = info.fields.iter().enumerate().map(|(f, field)| {
        let bound = info.field_bound(f, answer.stats.error_bound);
        (field.name.clone(), if bound > 0.0 { bound.min(1e-4 * field.range()) } else { field.step })
    });
    let rows = rows(arguments, &report, &steps.collect());
    arguments.query.print(&report, rows, (&answer.summary, seconds))
}

fn look(arguments: &Arguments, mesh: MeshView<'_>) -> Result<Samples> {
    let mut probe = Probe::new(mesh);
    if let Some([x0, y0, z0, x1, y1, z1]) = arguments.what.line {
        let ends = [[x0, y0, z0], [x1, y1, z1]];
        return Ok(match arguments.samples {
            Some(count) => evenly(&mut probe, ends, count),
            None => profile(&probe, ends),
        });
    }
    let points = match &arguments.what.list {
        Some(path) => read_points(path)?,
        None => arguments.what.points.clone(),
    };
    let places = probe.locate_all(&points);
    let sample = |(position, place)| Sample { position, distance: None, place };
    Ok(Samples { samples: points.into_iter().zip(places).map(sample).collect(), ..Samples::default() })
}

fn at([from, to]: [[f64; 3]; 2], s: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| from[i] + s * (to[i] - from[i]))
}

fn length([from, to]: [[f64; 3]; 2]) -> f64 {
    (0..3).map(|i| (to[i] - from[i]) * (to[i] - from[i])).sum::<f64>().sqrt()
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

fn table(found: &Samples, names: &[String], columns: &[Vec<Option<f64>>]) -> Vec<(String, Vec<f64>)> {
    let column = |of: &dyn Fn(&Sample) -> Option<f64>| -> Vec<f64> {
        found.samples.iter().map(|sample| of(sample).unwrap_or(f64::NAN)).collect()
    };
    let mut table: Vec<(String, Vec<f64>)> = Vec::new();
    if found.length.is_some() {
        table.push(("distance".to_owned(), column(&|sample| sample.distance)));
    }
    table.extend(coordinates(found.samples.iter().map(|sample| sample.position)));
    table.push(("tetrahedron".to_owned(), column(&|sample| sample.place.map(|place| f64::from(place.tet)))));
    for (name, values) in names.iter().zip(columns) {
        table.push((name.clone(), values.iter().map(|value| value.unwrap_or(f64::NAN)).collect()));
    }
    table
}

/// The points that are inside, and the lines through them.
fn poly_data(found: &Samples, columns: &[Vec<Option<f64>>], answer: &Answer) -> Result<PolyData> {
    let kept: Vec<usize> = (0..found.samples.len()).filter(|&i| found.samples[i].place.is_some()).collect();
    let mut new = vec![0; found.samples.len()];
    (0..).zip(&kept).for_each(|(v, &i)| new[i] = v);
    let values = |column: &Vec<Option<f64>>| kept.iter().map(|&i| column[i].unwrap_or_default()).collect();
    Ok(PolyData {
        fields: answer.point_values(columns.iter().map(values))?,
        lines: found.lines.iter().map(|line| line.iter().map(|&i| new[i as usize]).collect()).collect(),
        ..answer.poly_data(kept.iter().map(|&i| found.samples[i].position).collect())?
    })
}

fn report(arguments: &Arguments, found: &Samples, names: &[String], columns: &[Vec<Option<f64>>]) -> Report {
    let all_at = |i: usize| {
        let values = names.iter().zip(columns).map(|(name, column)| Some((name.clone(), column[i]?)));
        values.collect::<Option<BTreeMap<_, _>>>()
    };
    Report {
        points: found.samples.len(),
        outside: found.samples.iter().filter(|sample| sample.place.is_none()).count(),
        length: found.length,
        length_inside: found.length_inside,
        values: (0..arguments.what.points.len()).map(all_at).collect(),
    }
}

/// `steps`: by field, how much counts of a value.
fn rows(arguments: &Arguments, report: &Report, steps: &BTreeMap<String, f64>) -> Vec<(String, String)> {
    let mut lines: Vec<(String, String)> = Vec::new();
    if let Some(target) = &arguments.output {
        lines.push(("file".to_owned(), target.path.display().to_string()));
    }
    lines.push(("points".to_owned(), output::count(report.points as u64)));
    lines.push(("outside".to_owned(), output::count(report.outside as u64)));
    for (name, length) in [("length", report.length), ("length inside", report.length_inside)] {
        lines.extend(length.map(|length| (name.to_owned(), output::number(length))));
    }
    for (point, values) in arguments.what.points.iter().zip(&report.values) {
        let at = point.map(output::exact).join(",");
        match values {
            Some(values) => {
                let shown =
                    |(name, v): (&String, &f64)| output::within(*v, steps.get(name).copied().unwrap_or(0.0));
                lines.extend(values.iter().map(|each| (format!("{} at {at}", each.0), shown(each))));
            }
            None => lines.push((at, "outside".to_owned())),
        }
    }
    lines
}
