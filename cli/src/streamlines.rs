//! `tetralod streamlines`: the lines along which a vector field flows.

use super::output;
use super::parse::{parse_numbers, parse_positive};
use super::poly::{Target, coordinates};
use super::probe::parse_point;
use super::query::Query;
use anyhow::{Context, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Instant;
use tetralod::mt::MtInfo;
use tetralod::view::{StreamPoint, Streamline, TraceOptions, Tracer};
use tetralod_io::{PointValues, PolyData};

/// Writes the streamlines of a vector field that start at seeds.
///
/// The field's components are three scalar fields of the MT: those of an array v in a file are named v_x, v_y, v_z.
#[derive(clap::Args)]
#[command(
    after_help = "Example: tetralod streamlines flow.mt --vector velocity --seeds 0,0,0,0,0,1,20 -o lines.vtp"
)]
pub struct Arguments {
    /// The vector field: the name that its components begin with, or the three names of the components.
    #[arg(long, value_name = "NAME|X,Y,Z")]
    vector: String,
    #[command(flatten)]
    seeds: Seeds,
    /// With the field, against it, or both.
    #[arg(long, value_enum, default_value = "both")]
    direction: Direction,
    /// Largest length of a line from its seed, in model units; ten times the model's diagonal if not given.
    #[arg(long, value_name = "L", value_parser = parse_positive)]
    length: Option<f64>,
    /// Length of a step as a fraction of the shortest edge of the tetrahedron it starts in.
    #[arg(long, value_name = "F", default_value = "0.5", value_parser = parse_positive)]
    step: f64,
    /// Most steps from a seed.
    #[arg(long, value_name = "N", default_value = "10000")]
    max_steps: u32,
    #[command(flatten)]
    query: Query,
    /// The lines to write: .vtp, .ply, .obj, .npz, or .csv for their points.
    #[arg(short, long, value_name = "FILE")]
    output: Target,
}

#[derive(clap::Args)]
#[group(required = true)]
struct Seeds {
    /// A point to start from, in model units (repeatable).
    #[arg(long = "seed", value_name = "x,y,z", value_parser = parse_point, allow_hyphen_values = true)]
    points: Vec<[f64; 3]>,
    /// N points at equal distances on a line to start from (repeatable).
    #[arg(
        long = "seeds",
        value_name = "x0,y0,z0,x1,y1,z1,N",
        value_parser = parse_seeds,
        allow_hyphen_values = true
    )]
    lines: Vec<SeedLine>,
}

#[derive(Clone, Debug)]
struct SeedLine {
    ends: [[f64; 3]; 2],
    count: u32,
}

fn parse_seeds(text: &str) -> Result<SeedLine, String> {
    let [x0, y0, z0, x1, y1, z1, count] = parse_numbers(text, "a line of seeds")?;
    if !(1.0..=1e6).contains(&count) || count.fract() != 0.0 {
        return Err("the number of seeds must be a whole number from 1 to 1000000".to_owned());
    }
    Ok(SeedLine { ends: [[x0, y0, z0], [x1, y1, z1]], count: count as u32 })
}

impl Seeds {
    fn all(&self) -> Vec<[f64; 3]> {
        let mut seeds = self.points.clone();
        for SeedLine { ends: [from, to], count } in &self.lines {
            let steps = f64::from(count.saturating_sub(1).max(1));
            seeds.extend(
                (0..*count).map(|k| [0, 1, 2].map(|i| from[i] + f64::from(k) / steps * (to[i] - from[i]))),
            );
        }
        seeds
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Direction {
    Forward,
    Backward,
    Both,
}

/// The result as programs get it.
#[derive(Serialize)]
struct Report {
    seeds: usize,
    /// Seeds that are outside.
    outside: usize,
    lines: usize,
    points: usize,
    /// How many ends there are of each kind.
    ends: BTreeMap<&'static str, usize>,
    vector: Vec<String>,
}

/// All lines, one behind the other.
#[derive(Default)]
struct Lines {
    points: Vec<StreamPoint>,
    lines: Vec<Vec<u32>>,
    ends: BTreeMap<&'static str, usize>,
    outside: usize,
}

impl Lines {
    /// Adds what starts at one seed: the part against the field, turned around, then the part with it.
    fn add(&mut self, backward: Option<Streamline>, forward: Option<Streamline>) {
        if backward.is_none() && forward.is_none() {
            self.outside += 1;
            return;
        }
        let first = self.points.len() as u32;
        for line in [&backward, &forward].into_iter().flatten() {
            *self.ends.entry(line.end.name()).or_default() += 1;
        }
        let seed_twice = backward.is_some() && forward.is_some();
        self.points.extend(backward.into_iter().flat_map(|line| line.points.into_iter().rev()));
        // Both parts begin at the seed, which belongs into the line once: the forward part goes on behind it.
        self.points.extend(forward.into_iter().flat_map(|line| line.points).skip(usize::from(seed_twice)));
        self.lines.push((first..self.points.len() as u32).collect());
    }
}

pub fn run(arguments: &Arguments) -> Result<()> {
    arguments.output.check(arguments.query.files())?;
    let mut answer = arguments.query.answer()?;
    let info = answer.opened.info()?;
    let name = || arguments.query.file.display().to_string();
    let components = components(info, answer.field, &arguments.vector).with_context(name)?;
    arguments.query.check_step(info, answer.field, components[0]).with_context(name)?;
    let vector = components.map(|f| info.fields[f].name.clone()).to_vec();
    let start = Instant::now();
    let fields = answer.all_values()?;
    let views = answer.views(&fields)?;
    let mesh = answer.opened.session.view();
    let diagonal = mesh.bounds().diagonal();
    let options = TraceOptions {
        step: arguments.step,
        max_steps: arguments.max_steps,
        max_length: arguments.length.unwrap_or(10.0 * diagonal),
        ..TraceOptions::default()
    };
    let mut tracer = Tracer::new(mesh, components.map(|f| fields[f].as_slice()));
    let seeds = arguments.seeds.all();
    let mut lines = Lines::default();
    for seed in &seeds {
        let mut trace = |unwanted: Direction, backward: bool| {
            let wanted = arguments.direction != unwanted;
            wanted.then(|| tracer.trace(*seed, &TraceOptions { backward, ..options })).flatten()
        };
        lines.add(trace(Direction::Forward, true), trace(Direction::Backward, false));
    }
    let seconds = start.elapsed().as_secs_f64();
    let values = |f: usize| lines.points.iter().map(|p| p.place.interpolate(&mesh, views[f])).collect();
    let columns: Vec<Vec<f64>> = (0..fields.len()).map(values).collect();
    let columns = answer.point_values(columns)?;
    let positions = lines.points.iter().map(|point| point.position).collect();
    let data = poly_data(&lines, &columns, answer.poly_data(positions)?);
    arguments.output.write_either(&data, &table(&lines, &columns))?;
    let report = Report {
        seeds: seeds.len(),
        outside: lines.outside,
        lines: lines.lines.len(),
        points: lines.points.len(),
        ends: lines.ends,
        vector,
    };
    arguments.query.print(&report, rows(arguments, &report), (&answer.summary, seconds))
}

/// The fields that are the components of a vector, at the time of the field that is asked for.
fn components(info: &MtInfo, shown: usize, vector: &str) -> Result<[usize; 3]> {
    let numbers = |names: [String; 3]| {
        let found = names.map(|name| info.step_of(&name, shown));
        let [Some(x), Some(y), Some(z)] = found else { return None };
        Some([x, y, z])
    };
    let names: Vec<String> = vector.split(',').map(|name| name.trim().to_owned()).collect();
    let suffixes = [
        ["_x", "_y", "_z"],
        ["_0", "_1", "_2"],
        [":x", ":y", ":z"],
        [":0", ":1", ":2"],
        ["x", "y", "z"],
        ["X", "Y", "Z"],
    ];
    let found = match <[String; 3]>::try_from(names) {
        Ok(names) => numbers(names),
        Err(_) => suffixes.iter().find_map(|ends| numbers(ends.map(|end| format!("{vector}{end}")))),
    };
    found.with_context(|| {
        let known = info.fields.iter().map(|field| field.name.as_str()).collect::<Vec<_>>().join(", ");
        format!("there is no vector field '{vector}': give the names of three of the fields {known}")
    })
}

fn speed(point: &StreamPoint) -> f64 {
    point.vector.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn table(lines: &Lines, columns: &[PointValues]) -> Vec<(String, Vec<f64>)> {
    let number = (0..).zip(&lines.lines).flat_map(|(i, line)| line.iter().map(move |_| f64::from(i)));
    let mut table = vec![("line".to_owned(), number.collect())];
    let column = |name: &str, of: &dyn Fn(&StreamPoint) -> f64| {
        (name.to_owned(), lines.points.iter().map(of).collect::<Vec<f64>>())
    };
    table.push(column("time", &|point| point.time));
    table.extend(coordinates(lines.points.iter().map(|point| point.position)));
    table.push(column("speed", &speed));
    table.extend(columns.iter().map(|column| (column.name.clone(), column.values.clone())));
    table
}

/// Speed and time, which have no levels, keep all of their digits.
fn poly_data(lines: &Lines, columns: &[PointValues], positions: PolyData) -> PolyData {
    let own = |name: &str, of: &dyn Fn(&StreamPoint) -> f64| PointValues {
        name: name.to_owned(),
        values: lines.points.iter().map(of).collect(),
        step: 0.0,
    };
    let mut fields = vec![own("speed", &speed), own("time", &|point| point.time)];
    fields.extend_from_slice(columns);
    PolyData { fields, lines: lines.lines.clone(), ..positions }
}

fn rows(arguments: &Arguments, report: &Report) -> Vec<(&'static str, String)> {
    let ends: Vec<String> = report.ends.iter().map(|(name, count)| format!("{count} {name}")).collect();
    vec![
        ("file", arguments.output.path.display().to_string()),
        ("vector", report.vector.join(", ")),
        ("seeds", format!("{}, {} outside", report.seeds, report.outside)),
        ("lines", output::count(report.lines as u64)),
        ("points", output::count(report.points as u64)),
        ("ends", ends.join(", ")),
    ]
}
