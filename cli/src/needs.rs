//! Needs as they are written on the command line and in files, and what they mean for an MT.

use super::query::{parse_bounds, parse_list, parse_number, parse_numbers};
use super::{files, output};
use anyhow::{Context, Result};
use clap::error::ErrorKind;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use tetralod::geom::Bounds;
use tetralod::mt::MtInfo;
use tetralod::refine::{MAX_PLANES, Need, Part, RefineStats, Region, Transfer, Values, View};
use tetralod::session::Session;

/// An error in units of a field, or as a fraction of its range.
#[derive(Clone, Copy, Debug)]
pub enum Tolerance {
    Absolute(f64),
    Relative(f64),
}

impl FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, relative) = percentage(text)?;
        if number < 0.0 {
            return Err("an error is not negative".to_owned());
        }
        Ok(if relative { Self::Relative(number / 100.0) } else { Self::Absolute(number) })
    }
}

impl Tolerance {
    /// As a fraction of the field's range.
    pub fn relative(self, range: f64) -> f64 {
        match self {
            Self::Absolute(error) => error / range,
            Self::Relative(error) => error,
        }
    }
}

/// A number, and whether % stands behind it.
fn percentage(text: &str) -> Result<(f64, bool), String> {
    match text.trim().strip_suffix('%') {
        Some(number) => Ok((parse_number(number)?, true)),
        None => Ok((parse_number(text)?, false)),
    }
}

/// One entry of a need: the option `--NAME VALUE` of a command, and `NAME=VALUE` in `--need`.
struct Key {
    name: &'static str,
    /// What the value looks like.
    value: &'static str,
    help: &'static str,
    times: Times,
}

/// How often an entry may be given.
#[derive(PartialEq)]
enum Times {
    Once,
    Many,
    /// Once, and only together with the entry of this name.
    With(&'static str),
}

/// Regions limit values and the other way round; [`Group::set`] reads the values.
const KEYS: [Key; 16] = [
    Key {
        name: "error",
        value: "E|E%",
        help: "Largest error, in units of the field, or with % of its range; 0 is the reference mesh [default: 0]",
        times: Times::Once,
    },
    Key {
        name: "box",
        value: "x0,y0,z0,x1,y1,z1",
        help: "Only inside this box, in model units; the mesh is as coarse as possible elsewhere. Regions are repeatable: \
               their union is taken",
        times: Times::Many,
    },
    Key {
        name: "obox",
        value: "cx,cy,cz,ax,…,bx,…,cx,…",
        help: "Only inside this oriented box: its centre, and three orthogonal vectors from the centre to the middles of \
               faces",
        times: Times::Many,
    },
    Key {
        name: "sphere",
        value: "x,y,z,r",
        help: "Only inside this sphere: centre and radius",
        times: Times::Many,
    },
    Key { name: "half-space", value: "nx,ny,nz,d", help: "Only where n · p <= d", times: Times::Many },
    Key {
        name: "slab",
        value: "nx,ny,nz,d,t",
        help: "Only within a distance of t / 2 from the plane n · p = d",
        times: Times::Many,
    },
    Key {
        name: "convex",
        value: "nx,ny,nz,d,nx,…",
        help: "Only where n · p <= d for all of these planes, at most 16",
        times: Times::Many,
    },
    Key {
        name: "iso",
        value: "V",
        help: "Only around the isosurface at this value, in units of the field (repeatable)",
        times: Times::Many,
    },
    Key {
        name: "range",
        value: "a,b",
        help: "Only where the field has a value from a to b, in units of the field (repeatable)",
        times: Times::Many,
    },
    Key {
        name: "field",
        value: "NAME",
        help: "The field of all these values and errors [default: the first field]",
        times: Times::Once,
    },
    Key {
        name: "view",
        value: "FILE.json",
        help: "What a camera sees, within --pixels: a file with its matrix and viewport (repeatable)",
        times: Times::Many,
    },
    Key {
        name: "matrix",
        value: "m0,…,m15",
        help: "A camera without a file: the matrix from model space to clip space, column by column",
        times: Times::With("viewport"),
    },
    Key {
        name: "viewport",
        value: "w,h",
        help: "Width and height of the picture in pixels, for --matrix",
        times: Times::With("matrix"),
    },
    Key {
        name: "pixels",
        value: "P",
        help: "Largest error on the screen in pixels, for --view and --matrix [default: that in the file, or 1]",
        times: Times::Once,
    },
    Key {
        name: "transfer",
        value: "FILE.json",
        help: "What a transfer function makes visible, within --colour-error: a file with its points (repeatable)",
        times: Times::Many,
    },
    Key {
        name: "colour-error",
        value: "C|C%",
        help: "Largest change of colour or opacity, 0 to 1 or with %, for --transfer [default: that in the file, or 1%]",
        times: Times::Once,
    },
];

/// Heading in the help of the options that say what is needed.
pub const WHAT: &str = "What mesh";

impl Key {
    /// The option of this name. Its value is checked here and read by [`Group::set`].
    fn option(&'static self) -> Arg {
        let check = |text: &str| Group::default().set(self.name, text).map(|()| text.to_owned());
        let option = Arg::new(self.name).long(self.name).value_name(self.value).help(self.help);
        // Numbers may be negative, names of files and fields do not begin with a hyphen.
        let is_name = ["FILE.json", "NAME"].contains(&self.value);
        let option = option.value_parser(check).allow_hyphen_values(!is_name).help_heading(WHAT);
        match self.times {
            Times::Once => option,
            Times::Many => option.action(ArgAction::Append),
            Times::With(other) => option.requires(other),
        }
    }
}

/// Needs of one error: inside each of the regions where the field has one of the values, what each camera sees, and what
/// each transfer function shows. Without any of these, everywhere.
#[derive(Clone, Debug, Default)]
pub struct Group {
    error: Option<Tolerance>,
    regions: Vec<Region>,
    isovalues: Vec<f64>,
    /// Of values; isovalues are among them.
    ranges: Vec<[f64; 2]>,
    field: Option<String>,
    views: Vec<PathBuf>,
    matrix: Option<[f64; 16]>,
    viewport: Option<[f64; 2]>,
    pixels: Option<f64>,
    transfers: Vec<PathBuf>,
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

impl Args for Group {
    fn augment_args(command: Command) -> Command {
        command.args(KEYS.iter().map(Key::option))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for Group {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut group = Self::default();
        group.update_from_arg_matches(matches)?;
        Ok(group)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        for Key { name, .. } in &KEYS {
            for value in matches.get_many::<String>(name).into_iter().flatten() {
                self.set(name, value).map_err(|wrong| clap::Error::raw(ErrorKind::InvalidValue, wrong))?;
            }
        }
        Ok(())
    }
}

impl FromStr for Group {
    type Err = String;

    /// Reads `key=value; key=value; ...`.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut group = Self::default();
        if text.split(';').all(|part| part.trim().is_empty()) {
            return Err("it says nothing; give key=value, as in 'error=1%'".to_owned());
        }
        for part in text.split(';').map(str::trim).filter(|part| !part.is_empty()) {
            let (key, value) =
                part.split_once('=').ok_or_else(|| format!("'{part}' is not of the form key=value"))?;
            let key = key.trim();
            group.set(key, value.trim()).map_err(|wrong| format!("{key}: {wrong}"))?;
        }
        group.check()?;
        Ok(group)
    }
}

/// Sets what may be said once.
fn once<T>(place: &mut Option<T>, value: T) -> Result<(), String> {
    match place.replace(value) {
        None => Ok(()),
        Some(_) => Err("is there twice".to_owned()),
    }
}

impl Group {
    fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        match key {
            "error" => once(&mut self.error, value.parse()?)?,
            "box" => self.regions.push(parse_bounds(value).map(Region::Box)?),
            "obox" => self.regions.push(parse_oriented_box(value)?),
            "sphere" => self.regions.push(parse_sphere(value)?),
            "half-space" => self.regions.push(parse_half_space(value)?),
            "slab" => self.regions.push(parse_slab(value)?),
            "convex" => self.regions.push(parse_convex(value)?),
            "iso" => {
                let value = parse_number(value)?;
                self.isovalues.push(value);
                self.ranges.push([value, value]);
            }
            "range" => self.ranges.push(parse_range(value)?),
            "field" => once(&mut self.field, value.to_owned())?,
            "view" => self.views.push(value.into()),
            "matrix" => once(&mut self.matrix, parse_numbers(value, "a matrix")?)?,
            "viewport" => once(&mut self.viewport, parse_viewport(value)?)?,
            "pixels" => once(&mut self.pixels, parse_size(value)?)?,
            "transfer" => self.transfers.push(value.into()),
            "colour-error" => once(&mut self.colour_error, parse_share(value)?)?,
            _ => return Err(format!("is no key; there are {}", KEYS.map(|key| key.name).join(", "))),
        }
        Ok(())
    }

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

    /// Whether it says neither where the mesh is needed nor how accurate it is to be.
    pub fn is_empty(&self) -> bool {
        self.is_bare() && self.error.is_none()
    }

    /// Whether it says nothing about where the mesh is needed.
    fn is_bare(&self) -> bool {
        !self.is_limited() && !self.has_camera() && self.transfers.is_empty()
    }

    /// Whether there are regions or values.
    fn is_limited(&self) -> bool {
        !self.regions.is_empty() || !self.ranges.is_empty()
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

    /// Adds the needs; `field` is the field's name if the group has none.
    pub fn add_to(&self, info: &MtInfo, field: Option<&str>, needs: &mut Vec<NamedNeed>) -> Result<()> {
        let field = files::field_index(info, self.field().or(field))?;
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
        let name = file.field.as_deref();
        let field = if name.is_some() { files::field_index(info, name)? } else { field };
        let error = self.colour_error.or(file.error).unwrap_or(0.01);
        let colour = |[value, r, g, b, opacity]: [f64; 5]| (value, [r, g, b, opacity]);
        let points = file.points.into_iter().map(colour).collect();
        let transfer = Transfer { field, points, unit_length: file.unit_length };
        Ok(NamedNeed { name: format!("transfer {}", path.display()), need: Need::shown(transfer, error) })
    }

    fn add_limited(&self, info: &MtInfo, field: usize, needs: &mut Vec<NamedNeed>) {
        let error = self.error.map_or(0.0, |error| error.relative(info.fields[field].range()));
        let values = (!self.ranges.is_empty()).then(|| Values { field, ranges: self.ranges.clone() });
        let of_values = values.as_ref().map(|values| describe_values(info, values));
        let mut add = |region: Option<&Region>| {
            let (part, name) = match (region, &values, &of_values) {
                (None, Some(values), Some(name)) => (Part::Values(values.clone()), name.clone()),
                (Some(region), Some(values), Some(name)) => {
                    let part = Part::Both(region.clone(), values.clone());
                    (part, format!("{}, {name}", describe_region(region)))
                }
                (Some(region), ..) => (Part::Region(region.clone()), describe_region(region)),
                (None, ..) => (Part::Everywhere, "everywhere".to_owned()),
            };
            needs.push(NamedNeed { name, need: Need { error, field: None, part } });
        };
        if self.regions.is_empty() {
            add(None);
        } else {
            self.regions.iter().for_each(|region| add(Some(region)));
        }
    }
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
    let number = output::number;
    if let Some(values) = values {
        let field = &info.fields[values.field];
        let misses = |[low, high]: &[f64; 2]| *high < field.min || *low > field.max;
        if values.ranges.iter().all(misses) {
            let [min, max] = [number(field.min), number(field.max)];
            return Some(format!("{}: the field has values from {min} to {max} alone", named.name));
        }
    }
    let corners: Vec<[f64; 3]> = mesh.positions().iter().map(|&q| info.lattice.point(q)).collect();
    let domain = Bounds::of(&corners);
    // The boundary of the input may be as far from that of a coarse mesh.
    let near = info.boundary_bound(stats.error_bound);
    region.filter(|region| is_apart(region, &domain, near)).map(|_| {
        let list = |p: [f64; 3]| p.map(number).join(",");
        format!("{}: the mesh lies in the box {},{} alone", named.name, list(domain.min), list(domain.max))
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

fn describe_values(info: &MtInfo, values: &Values) -> String {
    let say = |[a, b]: &[f64; 2]| {
        if a == b { output::number(*a) } else { format!("{} to {}", output::number(*a), output::number(*b)) }
    };
    let ranges: Vec<String> = values.ranges.iter().map(say).collect();
    format!("{} at {}", info.fields[values.field].name, ranges.join(", "))
}

fn describe_region(region: &Region) -> String {
    let list = |numbers: &[f64]| numbers.iter().map(|x| output::number(*x)).collect::<Vec<_>>().join(",");
    match region {
        Region::Box(b) => format!("box {},{}", list(&b.min), list(&b.max)),
        Region::OrientedBox { centre, halves } => {
            format!("oriented box {},{}", list(centre), list(halves.as_flattened()))
        }
        Region::Sphere { centre, radius } => format!("sphere {},{}", list(centre), output::number(*radius)),
        Region::HalfSpace { normal, offset } => {
            format!("half-space {},{}", list(normal), output::number(*offset))
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

fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let name = || path.display().to_string();
    let text = fs::read_to_string(path).with_context(name)?;
    serde_json::from_str(&text).with_context(name)
}

/// Refuses a direction of no length.
fn direction(v: [f64; 3], what: &str) -> Result<[f64; 3], String> {
    if v == [0.0; 3] { Err(format!("{what} is not 0,0,0")) } else { Ok(v) }
}

fn parse_oriented_box(text: &str) -> Result<Region, String> {
    let numbers: [f64; 12] = parse_numbers(text, "an oriented box")?;
    let vector = |i: usize| [numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]];
    let halves = [vector(1), vector(2), vector(3)];
    for (i, a) in halves.into_iter().enumerate() {
        direction(a, "the way from the centre to a face")?;
        let b = halves[(i + 1) % 3];
        let [dot, aa, bb] = [[a, b], [a, a], [b, b]].map(|[u, v]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2]);
        if dot.abs() > 1e-6 * (aa * bb).sqrt() {
            return Err("the vectors of an oriented box are at right angles to each other".to_owned());
        }
    }
    Ok(Region::OrientedBox { centre: vector(0), halves })
}

fn parse_sphere(text: &str) -> Result<Region, String> {
    let [x, y, z, radius] = parse_numbers(text, "a sphere")?;
    if radius < 0.0 {
        return Err("a radius is not negative".to_owned());
    }
    Ok(Region::Sphere { centre: [x, y, z], radius })
}

fn parse_half_space(text: &str) -> Result<Region, String> {
    let [x, y, z, offset] = parse_numbers(text, "a half-space")?;
    Ok(Region::HalfSpace { normal: direction([x, y, z], "a normal")?, offset })
}

fn parse_slab(text: &str) -> Result<Region, String> {
    let [x, y, z, offset, thickness] = parse_numbers(text, "a slab")?;
    if thickness < 0.0 {
        return Err("a thickness is not negative".to_owned());
    }
    Ok(Region::Slab { normal: direction([x, y, z], "a normal")?, offset, thickness })
}

fn parse_convex(text: &str) -> Result<Region, String> {
    let numbers = parse_list(text)?;
    let (planes, rest) = numbers.as_chunks::<4>();
    if !rest.is_empty() || planes.len() > MAX_PLANES {
        return Err(format!("there are 4 numbers a plane and at most {MAX_PLANES} planes"));
    }
    planes.iter().try_for_each(|&[x, y, z, _]| direction([x, y, z], "a normal").map(drop))?;
    Ok(Region::Convex(planes.to_vec()))
}

fn parse_range(text: &str) -> Result<[f64; 2], String> {
    let [low, high] = parse_numbers(text, "a range")?;
    if low > high { Err("a range has its smaller value first".to_owned()) } else { Ok([low, high]) }
}

fn parse_viewport(text: &str) -> Result<[f64; 2], String> {
    let size: [f64; 2] = parse_numbers(text, "a viewport")?;
    if size.iter().all(|&x| x > 0.0) {
        Ok(size)
    } else {
        Err("a viewport has some width and height".to_owned())
    }
}

/// A number that is not negative.
pub fn parse_size(text: &str) -> Result<f64, String> {
    let number = parse_number(text)?;
    if number >= 0.0 { Ok(number) } else { Err(format!("'{text}' is negative")) }
}

/// A part of 1, or a percentage.
fn parse_share(text: &str) -> Result<f64, String> {
    let (number, percent) = percentage(text)?;
    let share = if percent { number / 100.0 } else { number };
    if share >= 0.0 { Ok(share) } else { Err(format!("'{text}' is negative")) }
}

/// A number of bytes; K, M and G stand for powers of 1024.
pub fn parse_bytes(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let digits = text.trim_end_matches(|c: char| !c.is_ascii_digit() && c != '.');
    let shift = match text[digits.len()..].trim() {
        "" | "B" => 0,
        "K" | "k" | "KiB" => 10,
        "M" | "MiB" => 20,
        "G" | "GiB" => 30,
        unit => return Err(format!("'{unit}' is no unit of bytes; there are K, M and G")),
    };
    let number = parse_size(digits)? * f64::from(1_u32 << shift);
    // The largest number of bytes that a float still counts one by one.
    if number <= (1_u64 << 53) as f64 { Ok(number as u64) } else { Err(format!("'{text}' is too much")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_have_units() {
        let read = |text: &str| parse_bytes(text).ok();
        assert_eq!(
            ["17", "2K", "1.5M", "3 G", "1MiB"].map(read),
            [Some(17), Some(2048), Some(3 << 19), Some(3 << 30), Some(1 << 20)]
        );
        assert_eq!(["", "K", "1T", "-1", "1e300G", "1 2"].map(read), [None; 6]);
    }

    #[test]
    fn a_need_is_read_from_keys_and_values() {
        let group: Group = "box=0,0,0,1,1,1; iso = -0.5;range=1,2; error=1%".parse().expect("a need");
        assert_eq!(group.regions.len(), 1);
        assert_eq!(group.ranges, [[-0.5, -0.5], [1.0, 2.0]]);
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
            ("slab=0,0,0,1,1", "0,0,0"),
            ("obox=0,0,0,1,0,0,1,1,0,0,0,1", "right angles"),
            ("range=2,1", "smaller"),
        ] {
            let wrong = text.parse::<Group>().expect_err(text);
            assert!(wrong.contains(words), "{text}: {wrong}");
        }
    }
}
