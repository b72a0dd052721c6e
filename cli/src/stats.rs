//! `tetralod stats`: integral, mean and histogram of a field over the mesh, and of each region.

use super::info::LISTED;
use super::parse::parse_numbers;
use super::poly::write_table;
use super::query::{Answer, Query};
use super::usage::refuse_usage;
use super::{files, input, output};
use anyhow::{Result, bail};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;
use tetralod::session::RegionStats;
use tetralod::view::{FieldStats, Histogram};
use tetralod_build::verify::split;

/// Computes the integral, the mean and the histogram of a field, exact for the field that is linear in every tetrahedron.
#[derive(clap::Args)]
#[command(after_help = "Examples: tetralod stats engine.mt --error 1% --bins 20\n          \
                        tetralod stats engine.mt --error 1% --reference engine.vtu -o histogram.csv")]
pub struct Arguments {
    /// Number of bins of the histogram.
    #[arg(long, value_name = "N", default_value = "10", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    bins: u32,
    /// Where the first bin starts and the last one ends, in units of the field; the field's range if not given.
    #[arg(long = "bin-range", value_name = "low,high", value_parser = parse_range, allow_hyphen_values = true)]
    bin_range: Option<[f64; 2]>,
    /// Compare with this mesh: the one that the MT was built from.
    #[arg(long, value_name = "INPUT")]
    reference: Option<PathBuf>,
    #[command(flatten)]
    query: Query,
    /// The histogram to write: .csv.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

fn parse_range(text: &str) -> Result<[f64; 2], String> {
    let [low, high] = parse_numbers(text, "a range")?;
    if low < high { Ok([low, high]) } else { Err("the smaller end of a range must come first".to_owned()) }
}

/// The result as programs get it: volumes in cubic model units, values in units of the field.
#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    found: Numbers,
    #[serde(skip_serializing_if = "Option::is_none")]
    reference: Option<Compared>,
    histogram: Bins,
    /// Of a file that keeps regions apart, those that are shown.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    regions: Vec<Region>,
}

#[derive(Serialize)]
struct Region {
    name: String,
    tetrahedra: u32,
    #[serde(flatten)]
    found: Numbers,
    /// Of the field in this region, in its units.
    error_bound: f64,
}

#[derive(Serialize)]
struct Numbers {
    volume: f64,
    integral: f64,
    mean: f64,
    standard_deviation: f64,
    min: f64,
    max: f64,
}

/// The reference, and how far the mesh is from it.
#[derive(Serialize)]
struct Compared {
    #[serde(flatten)]
    found: Numbers,
    volume_error: f64,
    integral_error: f64,
    mean_error: f64,
    /// The fraction of the volume that would have to change its bin.
    histogram_error: f64,
}

#[derive(Serialize)]
struct Bins {
    edges: Vec<f64>,
    volumes: Vec<f64>,
    below: f64,
    above: f64,
}

/// What is summed up in one pass.
struct Sums {
    stats: FieldStats,
    histogram: Histogram,
}

impl From<&FieldStats> for Numbers {
    fn from(stats: &FieldStats) -> Self {
        let [min, max] = stats.range();
        Self {
            volume: stats.volume(),
            integral: stats.integral(),
            mean: stats.mean(),
            standard_deviation: stats.deviation(),
            min,
            max,
        }
    }
}

impl Sums {
    fn new(bins: u32, [low, high]: [f64; 2]) -> Self {
        Self { stats: FieldStats::default(), histogram: Histogram::new(low, high, bins as usize) }
    }

    fn add(&mut self, corners: [[f64; 3]; 4], values: [f64; 4]) {
        self.stats.add(corners, values);
        self.histogram.add(corners, values);
    }
}

pub fn run(arguments: &Arguments) -> Result<()> {
    if let Some(path) = &arguments.output {
        files::check_ending(path, "csv")?;
        let inputs = arguments.reference.iter().chain(arguments.query.files());
        files::check_output(path, inputs)?;
    }
    if arguments.reference.is_some() && arguments.query.shown_regions().is_some() {
        refuse_usage("--reference compares the whole volume: leave out --region");
    }
    let mut answer = arguments.query.answer()?;
    let field = &answer.opened.info()?.fields[answer.field];
    // A constant field is a range, too.
    let half = (1e-9 * field.min.abs()).max(0.5);
    let whole =
        if field.min < field.max { [field.min, field.max] } else { [field.min - half, field.min + half] };
    let range = arguments.bin_range.unwrap_or(whole);
    let start = Instant::now();
    let mut sums = Sums::new(arguments.bins, range);
    let mesh = answer.opened.session.view();
    sums.stats = FieldStats::of(&mesh);
    sums.histogram.add_mesh(&mesh);
    let regions = of_regions(&mut answer);
    let seconds = start.elapsed().as_secs_f64();
    let compare = |path: &Path| compare(path, &answer, &sums, Sums::new(arguments.bins, range));
    let reference = arguments.reference.as_deref().map(compare).transpose()?;
    let [below, above] = sums.histogram.outside();
    let bins = Bins {
        edges: (0..=arguments.bins as usize).map(|b| sums.histogram.edge(b)).collect(),
        volumes: sums.histogram.volumes(),
        below,
        above,
    };
    if let Some(path) = &arguments.output {
        let upto = bins.edges.len() - 1;
        let table = [
            ("low".to_owned(), bins.edges[..upto].to_vec()),
            ("high".to_owned(), bins.edges[1..].to_vec()),
            ("volume".to_owned(), bins.volumes.clone()),
        ];
        write_table(path, &table)?;
    }
    let report = Report { found: (&sums.stats).into(), reference, histogram: bins, regions };
    arguments.query.print(&report, rows(arguments, &report), (&answer.summary, seconds))
}

/// The regions of the mesh that are shown.
fn of_regions(answer: &mut Answer) -> Vec<Region> {
    let session = &mut answer.opened.session;
    let found = session.region_stats();
    let (Some(regions), Some(info)) = (session.regions(), session.info()) else { return Vec::new() };
    let range = info.fields[answer.field].range();
    let one = |RegionStats { region, field, error }: &RegionStats| Region {
        name: regions.all[usize::from(*region)].name.clone(),
        tetrahedra: field.tetrahedra(),
        found: field.into(),
        error_bound: error * range,
    };
    found.iter().map(one).collect()
}

fn compare(path: &Path, answer: &Answer, sums: &Sums, mut reference: Sums) -> Result<Compared> {
    let opened = &answer.opened;
    let input = input::read_reference(&[path.to_owned()], opened)?;
    let mesh = split(&input, opened.session.regions()).map_err(anyhow::Error::msg)?.mesh;
    let info = &opened.info()?.fields[answer.field];
    let Some(field) = mesh.fields.iter().find(|field| info.is_of(field)) else {
        let name = &info.name;
        bail!("{}: there is no field '{name}'; give the mesh that the MT was built from", path.display());
    };
    for tet in &mesh.tets {
        reference.add(tet.map(|v| mesh.positions[v as usize]), tet.map(|v| field.values[v as usize]));
    }
    let [ours, theirs] = [sums, &reference].map(|sums| {
        let [below, above] = sums.histogram.outside();
        let volume = sums.stats.volume();
        let shares = sums.histogram.volumes().into_iter().chain([below, above]);
        shares.map(|share| share / volume).collect::<Vec<f64>>()
    });
    let found = Numbers::from(&reference.stats);
    Ok(Compared {
        volume_error: sums.stats.volume() - found.volume,
        integral_error: sums.stats.integral() - found.integral,
        mean_error: sums.stats.mean() - found.mean,
        histogram_error: 0.5 * ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs()).sum::<f64>(),
        found,
    })
}

fn rows(arguments: &Arguments, report: &Report) -> Vec<(&'static str, String)> {
    let numbers = &report.found;
    let mut rows = vec![
        ("volume", output::number(numbers.volume)),
        ("integral", output::number(numbers.integral)),
        ("mean", output::within(numbers.mean, 1e-4 * (numbers.max - numbers.min))),
        ("deviation", output::number(numbers.standard_deviation)),
        ("range", output::ends([numbers.min, numbers.max]).join(" to ")),
    ];
    if let Some(reference) = &report.reference {
        rows.push(("reference", format!("integral {}", output::number(reference.found.integral))));
        rows.push(("  volume", format!("off by {}", output::number(reference.volume_error))));
        rows.push(("  integral", format!("off by {}", output::number(reference.integral_error))));
        rows.push(("  mean", format!("off by {}", output::number(reference.mean_error))));
        rows.push((
            "  histogram",
            format!("off by {} of the volume", output::percent(reference.histogram_error)),
        ));
    }
    let Bins { edges, volumes, below, above } = &report.histogram;
    let share = |volume: f64| output::percent(volume / numbers.volume);
    // Not what rounding has put beside the ends.
    let counts = |volume: f64| volume > 1e-9 * numbers.volume;
    if counts(*below) {
        rows.push(("below", share(*below)));
    }
    for (ends, volume) in edges.windows(2).zip(volumes).take(100) {
        let ends = output::ends([ends[0], ends[1]]).join(" to ");
        rows.push(("bin", format!("{ends}: {}", share(*volume))));
    }
    if counts(*above) {
        rows.push(("above", share(*above)));
    }
    for Region { name, tetrahedra, found, error_bound } in report.regions.iter().take(LISTED) {
        let tets = output::count(*tetrahedra);
        let volume = output::number(found.volume);
        let mean = output::within(found.mean, 1e-4 * (found.max - found.min));
        let deviation = output::number(found.standard_deviation);
        let ends = output::ends([found.min, found.max]).join(" to ");
        let error = output::number(*error_bound);
        rows.push((
            "region",
            format!("{name}: {tets} tetrahedra, volume {volume}, mean {mean}, deviation {deviation}, {ends}, within {error}"),
        ));
    }
    if report.regions.len() > LISTED {
        rows.push((
            "",
            format!("{} more: --json lists all", output::count((report.regions.len() - LISTED) as u32)),
        ));
    }
    if let Some(path) = &arguments.output {
        rows.push(("file", path.display().to_string()));
    }
    rows
}
