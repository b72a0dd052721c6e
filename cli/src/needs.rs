//! Needs as they are written on the command line and in files, and what they mean for an MT.

use super::parse::{
    Tolerance, parse_bounds, parse_list, parse_number, parse_numbers, parse_range, parse_share, parse_size,
};
use super::{output, steps};
use anyhow::{Context, Result, anyhow};
use clap::error::{ContextKind, ErrorKind};
use clap::{Args, Command, FromArgMatches};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use tetralod::geom::Bounds;
use tetralod::mt::{Mt, MtInfo, MultiTessellation, numbers_of};
use tetralod::refine::{Need, Part, RefineStats, Region, Transfer, View};
use tetralod::session::Session;

/// Heading in the help of the options that describe the mesh.
pub const WHAT: &str = "What mesh";

/// Needs of one error: inside each of the regions where the field has one of the values, what each camera sees, and what
/// each transfer function shows. Without any of these, everywhere.
///
/// Each field is the option `--NAME VALUE` of a command, and `NAME=VALUE` in `--need`.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = WHAT)]
pub struct Group {
    /// Largest error, in units of the field, or with % of its range; 0 is the reference mesh [default: 0]
    #[arg(long, value_name = "E|E%", allow_hyphen_values = true)]
    error: Option<Tolerance>,
    /// Only inside this box, in model units; the mesh is as coarse as possible elsewhere. Regions are repeatable: their
    /// union is taken
    #[arg(long = "box", value_name = "x0,y0,z0,x1,y1,z1", value_parser = |text: &str| parse_bounds(text).map(Region::Box), allow_hyphen_values = true)]
    boxes: Vec<Region>,
    /// Only inside this oriented box: its centre, and three orthogonal vectors from the centre to the middles of faces
    #[arg(
        long = "obox",
        value_name = "cx,cy,cz,ax,…,bx,…,cx,…",
        value_parser = parse_oriented_box,
        allow_hyphen_values = true
    )]
    oriented_boxes: Vec<Region>,
    /// Only inside this sphere: centre and radius
    #[arg(long = "sphere", value_name = "x,y,z,r", value_parser = parse_sphere, allow_hyphen_values = true)]
    spheres: Vec<Region>,
    /// Only where n · p <= d
    #[arg(long = "half-space", value_name = "nx,ny,nz,d", value_parser = parse_half_space, allow_hyphen_values = true)]
    half_spaces: Vec<Region>,
    /// Only within a distance of t / 2 from the plane n · p = d
    #[arg(long = "slab", value_name = "nx,ny,nz,d,t", value_parser = parse_slab, allow_hyphen_values = true)]
    slabs: Vec<Region>,
    /// Only where n · p <= d for all of these planes, at most 16
    #[arg(long, value_name = "nx,ny,nz,d,nx,…", value_parser = parse_convex, allow_hyphen_values = true)]
    convex: Vec<Region>,
    /// Only in this region of the file, by its name or else its label, as `tetralod info` lists them (repeatable)
    #[arg(long = "region", value_name = "NAME|LABEL", allow_hyphen_values = true)]
    regions: Vec<String>,
    /// Only around the isosurface at this value, in units of the field (repeatable)
    #[arg(long = "iso", value_name = "V", value_parser = parse_number, allow_hyphen_values = true)]
    isovalues: Vec<f64>,
    /// Only where the field has a value from a to b, in units of the field (repeatable)
    #[arg(long = "range", value_name = "a,b", value_parser = parse_range, allow_hyphen_values = true)]
    ranges: Vec<[f64; 2]>,
    /// The field of all these values and errors [default: the first that does not number something or say where it is, such as material]
    #[arg(long, value_name = "NAME")]
    field: Option<String>,
    /// Of several time steps of the field that at this time of the file [default: the first]. What is written has no other steps,
    /// and what displaces and colours is of that time
    #[arg(long, value_name = "T", value_parser = parse_number, allow_hyphen_values = true)]
    time: Option<f64>,
    /// What a camera sees, within --pixels: a file with its matrix and viewport (repeatable)
    #[arg(long = "view", value_name = "FILE.json")]
    views: Vec<PathBuf>,
    /// A camera without a file: the matrix from model space to clip space, column by column
    #[arg(
        long,
        value_name = "m0,…,m15",
        value_parser = |text: &str| parse_numbers::<16>(text, "a matrix"),
        requires = "viewport",
        allow_hyphen_values = true
    )]
    matrix: Option<[f64; 16]>,
    /// Width and height of the picture in pixels, for --matrix
    #[arg(long, value_name = "w,h", value_parser = parse_viewport, requires = "matrix", allow_hyphen_values = true)]
    viewport: Option<[f64; 2]>,
    /// Largest error on the screen in pixels, for --view and --matrix [default: that in the file, or 1]
    #[arg(long, value_name = "P", value_parser = parse_size, allow_hyphen_values = true)]
    pixels: Option<f64>,
    /// What a transfer function makes visible, within --colour-error: a file with its points (repeatable)
    #[arg(long = "transfer", value_name = "FILE.json")]
    transfers: Vec<PathBuf>,
    /// Largest change of colour or opacity, 0 to 1 or with %, for --transfer [default: that in the file, or 1%]
    #[arg(long, value_name = "C|C%", value_parser = parse_share, allow_hyphen_values = true)]
    colour_error: Option<f64>,
}

/// A need and how messages call it.
pub struct NamedNeed {
    pub name: String,
    pub need: Need,
}

/// Units of errors.
pub const RELATIVE: &str = "relative";
pub const PIXELS: &str = "pixels";
const COLOUR: &str = "colour";

/// The unit of a need's error.
pub fn unit(need: &Need) -> &'static str {
    match need.part {
        Part::View(_) => PIXELS,
        Part::Transfer(_) => COLOUR,
        _ => RELATIVE,
    }
}

impl FromStr for Group {
    type Err = String;

    /// Reads `key=value; key=value; ...` as the options `--key=value`.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut options = Vec::new();
        for part in text.split(';').map(str::trim).filter(|part| !part.is_empty()) {
            let (key, value) =
                part.split_once('=').ok_or_else(|| format!("'{part}' is not of the form key=value"))?;
            options.push(format!("--{}={}", key.trim(), value.trim()));
        }
        if options.is_empty() {
            return Err("it says nothing; give key=value, as in 'error=1%'".to_owned());
        }
        let command = Self::augment_args(Command::new("need").no_binary_name(true).disable_help_flag(true));
        let matches = command.try_get_matches_from(options).map_err(|error| refusal(&error))?;
        let group = Self::from_arg_matches(&matches).map_err(|error| refusal(&error))?;
        group.check()?;
        Ok(group)
    }
}

/// What is wrong with a key or its value.
fn refusal(error: &clap::Error) -> String {
    let option = error.get(ContextKind::InvalidArg).map(ToString::to_string).unwrap_or_default();
    let key = option.trim_start_matches('-').split(['=', ' ']).next().unwrap_or_default();
    match (error.kind(), error.source()) {
        (ErrorKind::UnknownArgument, _) => {
            let command = Group::augment_args(Command::new("need"));
            let keys: Vec<&str> = command.get_arguments().filter_map(clap::Arg::get_long).collect();
            format!("{key}: is no key; the keys are {}", keys.join(", "))
        }
        (ErrorKind::ArgumentConflict, _) => format!("{key}: is given twice"),
        (ErrorKind::MissingRequiredArgument, _) => "a camera has both a matrix and a viewport".to_owned(),
        (_, Some(problem)) => format!("{key}: {problem}"),
        _ => format!("{key}: the value cannot be used"),
    }
}

impl Group {
    /// The files that it names.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.views.iter().chain(&self.transfers)
    }

    /// The values given as isovalues.
    pub fn isovalues(&self) -> &[f64] {
        &self.isovalues
    }

    /// The field's name, if there is one.
    pub fn field(&self) -> Option<&str> {
        self.field.as_deref()
    }

    /// The time that is asked for.
    pub fn time(&self) -> Option<f64> {
        self.time
    }

    /// The points of the first transfer function and its unit length, as a part of the model's diagonal, if
    /// there is one and it is of the field that is shown.
    pub fn shown(&self, field: &str) -> Result<Option<(Vec<[f64; 5]>, f64)>> {
        let Some(path) = self.transfers.first() else { return Ok(None) };
        let file: TransferFile = read_json(path)?;
        let is_of_it = file.field.as_deref().is_none_or(|name| name == field);
        Ok(is_of_it.then_some((file.points, file.unit_length)))
    }

    /// Whether it says neither where the mesh is needed nor how accurate it is to be.
    pub fn is_empty(&self) -> bool {
        self.is_bare() && self.error.is_none() && self.regions.is_empty()
    }

    /// The same in some regions only; none if it says where the mesh is needed.
    pub fn limited_to(&self, regions: &[Region]) -> Option<Self> {
        self.is_bare().then(|| Self { boxes: regions.to_vec(), ..self.clone() })
    }

    /// Whether it says nothing about where the mesh is needed.
    fn is_bare(&self) -> bool {
        !self.is_limited() && !self.has_camera() && self.transfers.is_empty()
    }

    /// Whether there are shapes or values.
    fn is_limited(&self) -> bool {
        self.shapes().next().is_some() || !self.isovalues.is_empty() || !self.ranges.is_empty()
    }

    fn shapes(&self) -> impl Iterator<Item = &Region> {
        let kinds =
            [&self.boxes, &self.oriented_boxes, &self.spheres, &self.half_spaces, &self.slabs, &self.convex];
        kinds.into_iter().flatten()
    }

    fn has_camera(&self) -> bool {
        !self.views.is_empty() || self.matrix.is_some()
    }

    /// Refuses errors of which nothing is there that has them.
    pub fn check(&self) -> Result<(), String> {
        let wrong = if self.matrix.is_some() != self.viewport.is_some() {
            "a camera has both a matrix and a viewport"
        } else if self.pixels.is_some() && !self.has_camera() {
            "pixels are the error of a view; there is none"
        } else if self.colour_error.is_some() && self.transfers.is_empty() {
            "colour-error is the error of a transfer function; there is none"
        } else if self.error.is_some() && !self.is_limited() && !self.is_bare() {
            "the error is that of regions and values; views have pixels, transfer functions a colour-error, and \
             --outside says how accurate the mesh is elsewhere"
        } else {
            return Ok(());
        };
        Err(wrong.to_owned())
    }

    /// The regions that it names.
    pub fn regions(&self) -> &[String] {
        &self.regions
    }

    /// Adds the needs, of a field by its number.
    pub fn add_to(&self, mt: &Mt, field: usize, needs: &mut Vec<NamedNeed>) -> Result<()> {
        let first = needs.len();
        self.add_everywhere(mt.info(), field, needs)?;
        if !self.regions.is_empty() {
            let regions = find_regions(mt, &self.regions)?;
            for NamedNeed { name, need } in &mut needs[first..] {
                *name = format!("{name} in region {}", self.regions.join(", "));
                need.regions = Some(regions.clone());
            }
        }
        Ok(())
    }

    /// Adds the needs without their regions.
    fn add_everywhere(&self, info: &MtInfo, field: usize, needs: &mut Vec<NamedNeed>) -> Result<()> {
        if self.is_bare() || self.is_limited() {
            self.add_limited(info, field, needs);
        }
        for path in &self.views {
            let ViewFile { matrix, viewport, pixels } = read_json(path)?;
            let need = Need::seen(View { matrix, viewport }, self.pixels.or(pixels).unwrap_or(1.0));
            needs.push(NamedNeed { name: format!("view {}", path.display()), need });
        }
        if let (Some(matrix), Some(viewport)) = (self.matrix, self.viewport) {
            let need = Need::seen(View { matrix, viewport }, self.pixels.unwrap_or(1.0));
            needs.push(NamedNeed { name: "view".to_owned(), need });
        }
        for path in &self.transfers {
            needs.push(self.transfer(path, info, field)?);
        }
        Ok(())
    }

    fn transfer(&self, path: &Path, info: &MtInfo, field: usize) -> Result<NamedNeed> {
        let file: TransferFile = read_json(path)?;
        // A field of its own is at the time of the one that is asked for.
        let own = file.field.as_deref().map(|name| steps::beside(info, name, field)).transpose()?;
        let field = own.unwrap_or(field);
        let error = self.colour_error.or(file.error).unwrap_or(0.01);
        let colour = |[value, r, g, b, opacity]: [f64; 5]| (value, [r, g, b, opacity]);
        let points = file.points.into_iter().map(colour).collect();
        let transfer = Transfer { field, points, unit_length: file.unit_length };
        Ok(NamedNeed { name: format!("transfer {}", path.display()), need: Need::shown(transfer, error) })
    }

    fn add_limited(&self, info: &MtInfo, field: usize, needs: &mut Vec<NamedNeed>) {
        let error = self.error.map_or(0.0, |error| error.relative(info.fields[field].range()));
        let isovalues = self.isovalues.iter().map(|&value| [value, value]);
        let ranges: Vec<[f64; 2]> = isovalues.chain(self.ranges.iter().copied()).collect();
        let mut shapes: Vec<Option<&Region>> = self.shapes().map(Some).collect();
        if shapes.is_empty() {
            shapes.push(None);
        }
        for region in shapes {
            let (mut need, mut words) = (Need::within(error), Vec::new());
            if let Some(region) = region {
                need = need.inside(region.clone());
                words.push(describe_region(region));
            }
            if !ranges.is_empty() {
                need = need.between(field, ranges.clone());
                words.push(describe_values(&info.fields[field].name, &ranges));
            }
            let name = if words.is_empty() { "everywhere".to_owned() } else { words.join(", ") };
            needs.push(NamedNeed { name, need });
        }
    }
}

/// The regions of an MT that are named, by their names or labels.
pub fn find_regions(mt: &Mt, names: &[String]) -> Result<Vec<u16>> {
    let regions = mt.regions().context(
        "the file has no regions: build it with --preserve and the name of an array of whole numbers",
    )?;
    numbers_of(Some(regions), names).map_err(|(_, problem)| anyhow!(problem))
}

/// A word about a need that can meet nothing: values that the field does not have, or a region outside of the domain.
pub fn warning(session: &Session, stats: &RefineStats, named: &NamedNeed) -> Option<String> {
    let (info, mesh) = (session.info()?, session.mesh()?);
    let (region, values) = match &named.need.part {
        Part::Region(region) => (Some(region), None),
        Part::Values(values) => (None, Some(values)),
        Part::Both(region, values) => (Some(region), Some(values)),
        _ => (None, None),
    };
    if let Some(values) = values {
        let field = &info.fields[values.field];
        let misses = |[low, high]: &[f64; 2]| *high < field.min || *low > field.max;
        if values.ranges.iter().all(misses) {
            let [min, max] = output::ends([field.min, field.max]);
            return Some(format!("{}: the field has only values from {min} to {max}", named.name));
        }
    }
    let corners: Vec<[f64; 3]> = mesh.positions().iter().map(|&q| info.lattice.point(q)).collect();
    let domain = Bounds::of(&corners);
    // The boundary of the input may be as far from that of a coarse mesh.
    let near = info.boundary_bound(stats.error_bound);
    region.filter(|region| is_apart(region, &domain, near)).map(|_| {
        let list = |end: usize| {
            [0, 1, 2].map(|i| output::ends([domain.min[i], domain.max[i]])[end].clone()).join(",")
        };
        format!("{}: the mesh lies inside the box {},{}", named.name, list(0), list(1))
    })
}

/// Whether a plane parts a region from the domain by more than `near`.
fn is_apart(region: &Region, domain: &Bounds, near: f64) -> bool {
    let centre = [0, 1, 2].map(|k| 0.5 * (domain.min[k] + domain.max[k]));
    let half = [0, 1, 2].map(|k| 0.5 * (domain.max[k] - domain.min[k]) + near);
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    // From where to where the domain reaches along a direction.
    let reach = |n: [f64; 3]| {
        let (middle, wide) = (dot(n, centre), dot(n.map(f64::abs), half));
        [middle - wide, middle + wide]
    };
    let below = |n: [f64; 3], offset: f64| reach(n)[0] > offset;
    match region {
        Region::Box(b) => (0..3).any(|k| b.min[k] > centre[k] + half[k] || b.max[k] < centre[k] - half[k]),
        Region::OrientedBox { centre: c, halves } => halves.iter().any(|&n| {
            let [low, high] = reach(n);
            high < dot(n, *c) - dot(n, n) || low > dot(n, *c) + dot(n, n)
        }),
        Region::Sphere { centre: c, radius } => {
            let apart = [0, 1, 2].map(|k| ((c[k] - centre[k]).abs() - half[k]).max(0.0));
            dot(apart, apart) > radius * radius
        }
        Region::HalfSpace { normal, offset } => below(*normal, *offset),
        Region::Slab { normal, offset, thickness } => {
            let ([low, high], wide) = (reach(*normal), 0.5 * thickness * dot(*normal, *normal).sqrt());
            high < offset - wide || low > offset + wide
        }
        Region::Convex(planes) => planes.iter().any(|&[x, y, z, d]| below([x, y, z], d)),
    }
}

fn describe_values(field: &str, ranges: &[[f64; 2]]) -> String {
    let describe = |[a, b]: &[f64; 2]| {
        if a == b { output::exact(*a) } else { format!("{} to {}", output::exact(*a), output::exact(*b)) }
    };
    format!("{field} at {}", ranges.iter().map(describe).collect::<Vec<_>>().join(", "))
}

fn describe_region(region: &Region) -> String {
    let list = |numbers: &[f64]| numbers.iter().map(|x| output::exact(*x)).collect::<Vec<_>>().join(",");
    match region {
        Region::Box(b) => format!("box {},{}", list(&b.min), list(&b.max)),
        Region::OrientedBox { centre, halves } => {
            format!("oriented box {},{}", list(centre), list(halves.as_flattened()))
        }
        Region::Sphere { centre, radius } => format!("sphere {},{}", list(centre), output::exact(*radius)),
        Region::HalfSpace { normal, offset } => {
            format!("half-space {},{}", list(normal), output::exact(*offset))
        }
        Region::Slab { normal, offset, thickness } => {
            format!("slab {},{}", list(normal), list(&[*offset, *thickness]))
        }
        Region::Convex(planes) => format!("convex {}", list(planes.as_flattened())),
    }
}

/// A camera's file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ViewFile {
    matrix: [f64; 16],
    viewport: [f64; 2],
    pixels: Option<f64>,
}

/// A transfer function's file: `[value, red, green, blue, opacity]` a point.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TransferFile {
    points: Vec<[f64; 5]>,
    #[serde(alias = "unitLength", default = "whole")]
    unit_length: f64,
    field: Option<String>,
    error: Option<f64>,
}

fn whole() -> f64 {
    1.0
}

pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let name = || path.display().to_string();
    let text = fs::read_to_string(path).with_context(name)?;
    serde_json::from_str(&text).with_context(name)
}

/// A region whose numbers make sense.
fn checked(region: Region) -> Result<Region, String> {
    region.check()?;
    Ok(region)
}

fn parse_oriented_box(text: &str) -> Result<Region, String> {
    let numbers: [f64; 12] = parse_numbers(text, "an oriented box")?;
    let vector = |i: usize| [numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]];
    let halves = [vector(1), vector(2), vector(3)];
    for (i, a) in halves.into_iter().enumerate() {
        let b = halves[(i + 1) % 3];
        let [dot, aa, bb] = [[a, b], [a, a], [b, b]].map(|[u, v]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2]);
        if dot.abs() > 1e-6 * (aa * bb).sqrt() {
            return Err("the vectors of an oriented box must be at right angles to each other".to_owned());
        }
    }
    checked(Region::OrientedBox { centre: vector(0), halves })
}

fn parse_sphere(text: &str) -> Result<Region, String> {
    let [x, y, z, radius] = parse_numbers(text, "a sphere")?;
    checked(Region::Sphere { centre: [x, y, z], radius })
}

fn parse_half_space(text: &str) -> Result<Region, String> {
    let [x, y, z, offset] = parse_numbers(text, "a half-space")?;
    checked(Region::HalfSpace { normal: [x, y, z], offset })
}

fn parse_slab(text: &str) -> Result<Region, String> {
    let [x, y, z, offset, thickness] = parse_numbers(text, "a slab")?;
    checked(Region::Slab { normal: [x, y, z], offset, thickness })
}

fn parse_convex(text: &str) -> Result<Region, String> {
    let numbers = parse_list(text)?;
    let (planes, rest) = numbers.as_chunks::<4>();
    if !rest.is_empty() {
        return Err("a plane has 4 numbers".to_owned());
    }
    checked(Region::Convex(planes.to_vec()))
}

fn parse_viewport(text: &str) -> Result<[f64; 2], String> {
    let size: [f64; 2] = parse_numbers(text, "a viewport")?;
    if size.iter().all(|&x| x > 0.0) {
        Ok(size)
    } else {
        Err("the width and height of a viewport must be larger than 0".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_need_is_read_from_keys_and_values() {
        let group: Group = "box=0,0,0,1,1,1; iso = -0.5;range=1,2; error=1%".parse().expect("a need");
        assert_eq!(group.shapes().count(), 1);
        assert_eq!((&group.isovalues[..], &group.ranges[..]), (&[-0.5][..], &[[1.0, 2.0]][..]));
        assert!(matches!(group.error, Some(Tolerance::Relative(x)) if x == 0.01));
        for (text, words) in [
            ("box", "key=value"),
            ("cube=1", "is no key"),
            ("box=1,2", "6 numbers"),
            ("error=1;error=2", "twice"),
            ("pixels=1", "there is none"),
            ("matrix=1,2", "16 numbers"),
            ("viewport=4,3", "both a matrix and a viewport"),
            ("colour-error=1%;iso=1", "there is none"),
            ("view=a.json;error=1", "outside"),
            ("slab=0,0,0,1,1", "normal of some length"),
            ("obox=0,0,0,1,0,0,1,1,0,0,0,1", "right angles"),
            ("range=2,1", "smaller"),
        ] {
            let wrong = text.parse::<Group>().expect_err(text);
            assert!(wrong.contains(words), "{text}: {wrong}");
        }
    }
}
