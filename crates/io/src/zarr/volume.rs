//! The volume that an array, a group of arrays, or an image of OME-Zarr stands for.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Map, Value};

use crate::ReadOptions;
use crate::error::{At, ReadError, ReadReason, expect_count};
use crate::fields::Collector;
use crate::grid::{self, GridValues, Placement, rectilinear};
use crate::grid_boxes::{Boxes, GridInParts, Points};
use crate::memory::MemoryLimit;
use crate::number::points_from;
use crate::zarr::array::{Samples, shown};
use crate::zarr::axes::{Axes, Axis, listed, to_one_unit};
use crate::zarr::lz4;
use crate::zarr::node::{Kind, Node};
use crate::zarr::ome::{Image, Level};
use crate::zarr::store::{Store, is_address, is_root};
use tetralod::mesh::{MeshInput, TetMesh};

/// What fields of arrays without a name are called, as those of images are.
const FIELD: &str = "value";
/// How far coordinates that count as evenly spaced are from that, beside the distance between two: single precision has not more.
const EVEN: f64 = 1e-3;

/// Most values of a field that are read at once where all of them pass by, for the sake of whole chunks.
const MOST_IN_CHUNKS: u64 = 1 << 24;

/// Arrays on one grid.
#[derive(Debug)]
pub(super) struct Volume {
    arrays: Vec<OnGrid>,
    dims: [u64; 3],
    places: Places,
    times: Vec<f64>,
    notes: Vec<String>,
}

/// Where the samples lie.
#[derive(Clone, Debug)]
enum Places {
    Even(Placement),
    /// At these coordinates along x, y and z.
    Along([Vec<f64>; 3]),
}

/// An array, and its fields: one a channel.
#[derive(Debug)]
struct OnGrid {
    samples: Samples,
    axes: Axes,
    names: Vec<String>,
    unit: String,
    /// What a sample is multiplied by, and what is added, if that is said.
    linear: Option<[f64; 2]>,
}

/// An array that may be read.
struct Found {
    path: String,
    shape: Vec<u64>,
    all: Vec<Axis>,
    attributes: Map<String, Value>,
}

/// Reads what an array has at a step, in a channel.
type ReadValues<'a> = &'a dyn Fn(&OnGrid, u64, &str) -> Result<Vec<f64>, ReadError>;

impl Volume {
    /// Opens what is at a path or an address.
    pub fn open(given: &Path, memory: &MemoryLimit) -> Result<Self, ReadError> {
        lz4::register();
        let store = Store::of(given, memory).map(Arc::new).at(String::new)?;
        let missing = || ReadReason::Missing("zarr.json (version 3), .zarray or .zgroup (version 2)".into());
        let node = Node::of(&store, "")?.ok_or_else(missing).at(String::new)?;
        let opening = Opening { store, memory, given };
        if matches!(node.kind, Kind::Group { .. }) {
            return opening.group(&node, None);
        }
        // An image, or coordinates, say more of an array that is in a group.
        if let Some((folder, name)) = in_group(given)
            && let store = Store::of(&folder, memory).map(Arc::new).at(String::new)?
            && let Some(group) = Node::of(&store, "")?.filter(|node| matches!(node.kind, Kind::Group { .. }))
        {
            return Opening { store, ..opening }.group(&group, Some((&name, node)));
        }
        let found = Found::of("", &node).at(|| shown(""))?;
        opening.volume(vec![(found, FIELD.to_owned())], &BTreeMap::new())
    }

    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The mesh of a step; a grid along the axes comes without points and tetrahedra.
    pub fn mesh(&self, options: &ReadOptions) -> Result<TetMesh, ReadError> {
        let all = || self.dims.map(|count| 0..count);
        let (values, _) = self.collect(options, &|array, channel, name| {
            let points: u64 = self.dims.iter().product();
            let bytes = points.saturating_mul(array.samples.size());
            let _held = options.memory.hold(bytes).at(|| shown(name))?;
            array.values([options.step as u64, channel], all())
        })?;
        let mesh = match &self.places {
            Places::Even(placement) => placement.mesh(values, &options.memory),
            Places::Along(axes) => {
                let dims = self.dims.map(|count| count as u32);
                grid::bytes(dims)
                    .and_then(|bytes| options.memory.expect(bytes))
                    .and_then(|()| grid::mesh(dims, points_from(&rectilinear(axes)), values, &options.memory))
            }
        };
        Ok(TetMesh { notes: self.notes.clone(), ..mesh.at(String::new)? })
    }

    /// The fields that are wanted, with values as `read` gives them, and where each of them is: in which array, in which channel.
    fn collect(
        &self,
        options: &ReadOptions,
        read: ReadValues<'_>,
    ) -> Result<(GridValues, Vec<(usize, u64)>), ReadError> {
        let time = self.step(options).at(String::new)?;
        let mut fields = Collector::new(options);
        let mut places = BTreeMap::new();
        for (number, array) in self.arrays.iter().enumerate() {
            for (channel, name) in (0..).zip(&array.names) {
                let place = || shown(name);
                let Some(claim) = fields.claim(name, 1).at(place)? else { continue };
                let values = read(array, channel, name)?;
                fields.fill(claim, values, array.is_integer(), &array.unit).at(place)?;
                places.extend(fields.fields.last().map(|field| (field.name.clone(), (number, channel))));
            }
        }
        fields.fields.iter_mut().chain(&mut fields.others).for_each(|field| field.time = time);
        let places = fields.fields.iter().filter_map(|field| places.get(&field.name).copied()).collect();
        let others = [fields.others, Vec::new()];
        Ok((GridValues { fields: fields.fields, others, ..GridValues::default() }, places))
    }

    /// The same to be read in parts; the reason if it has to be read as a whole.
    pub fn in_parts(
        self,
        path: &Path,
        options: &ReadOptions,
    ) -> Result<Result<GridInParts, &'static str>, ReadError> {
        let Places::Even(placement) = &self.places else {
            return Ok(Err("its points are not evenly spaced"));
        };
        let Some(grid) = placement.grid().at(String::new)? else { return Ok(Err("its axes are turned")) };
        let (GridValues { fields, others: [other_fields, _], .. }, of_fields) =
            self.collect(options, &|_, _, _| Ok(Vec::new()))?;
        let mut input = MeshInput { other_fields, ..MeshInput::default() };
        input.files.0.push(path.to_owned());
        let mesh = TetMesh { fields, input, notes: self.notes.clone(), ..TetMesh::default() };
        let boxes = OfFields { volume: self, of_fields, step: options.step as u64 };
        Ok(Ok(GridInParts::new(mesh, grid, Box::new(boxes))))
    }

    /// The time of the step that is wanted; none if there is one step.
    fn step(&self, options: &ReadOptions) -> Result<Option<f64>, ReadReason> {
        options.expect_step(self.times.len())?;
        Ok(self.times.get(options.step).copied().filter(|_| self.times.len() > 1))
    }
}

/// The fields of a volume of which boxes are read.
#[derive(Debug)]
struct OfFields {
    volume: Volume,
    /// In which array each is, and in which channel.
    of_fields: Vec<(usize, u64)>,
    step: u64,
}

impl Boxes for OfFields {
    /// Those of chunks, if they are not too thick.
    fn layers(&self) -> u32 {
        let [nx, ny, _] = self.volume.dims;
        let of_chunks = |(array, _): &(usize, u64)| {
            let OnGrid { samples, axes, .. } = &self.volume.arrays[*array];
            samples.chunk().map_or(1, |chunk| chunk[axes.space[2]])
        };
        let layers = self.of_fields.iter().map(of_chunks).max().unwrap_or(1);
        // No more points than a grid may have.
        layers.min(MOST_IN_CHUNKS / (nx * ny)).max(1) as u32
    }

    fn values(&self, field: usize, points: &Points) -> Result<Vec<f64>, ReadError> {
        let (array, channel) = self.of_fields[field];
        let range = points.clone().map(|range| range.start.into()..range.end.into());
        self.volume.arrays[array].values([self.step, channel], range)
    }
}

impl OnGrid {
    fn values(&self, at: [u64; 2], range: [Range<u64>; 3]) -> Result<Vec<f64>, ReadError> {
        let mut values = self.samples.values(&self.axes, at, range)?;
        if let Some([scale, offset]) = self.linear {
            values.iter_mut().for_each(|value| *value = *value * scale + offset);
        }
        Ok(values)
    }

    fn is_integer(&self) -> bool {
        self.linear.is_none() && self.samples.is_integer()
    }
}

/// The folder, or address, in which an array is, and its name there; none of a root.
fn in_group(given: &Path) -> Option<(PathBuf, String)> {
    let text = given.to_str()?.trim_end_matches('/');
    if is_root(Path::new(text)) || text.contains(['?', '#']) {
        return None;
    }
    let is_address = is_address(given);
    // What is above a root on a server need not answer.
    if is_address && !text.contains(".zarr/") {
        return None;
    }
    let separators: &[char] = if cfg!(windows) && !is_address { &['/', '\\'] } else { &['/'] };
    let (folder, name) = text.rsplit_once(separators).unwrap_or((".", text));
    let is_name = !name.is_empty() && name != "." && name != "..";
    is_name.then(|| (PathBuf::from(if folder.is_empty() { "/" } else { folder }), name.to_owned()))
}

impl Found {
    fn of(path: &str, node: &Node) -> Result<Self, ReadReason> {
        let Kind::Array { shape, names } = &node.kind else {
            return Err(ReadReason::Missing("an array, not a group,".into()));
        };
        let all: Vec<Axis> = match names {
            Some(names) => names.iter().map(|name| Axis::named(name)).collect(),
            None => vec![Axis::default(); shape.len()],
        };
        expect_count("names of axes", shape.len(), all.len())?;
        Ok(Self { path: path.to_owned(), shape: shape.clone(), all, attributes: node.attributes.clone() })
    }

    fn text(&self, name: &str) -> String {
        self.attributes.get(name).and_then(Value::as_str).unwrap_or_default().to_owned()
    }

    /// The convention of CF for values that are stored as smaller numbers.
    fn linear(&self) -> Option<[f64; 2]> {
        let number = |name: &str| self.attributes.get(name).and_then(Value::as_f64);
        let both = [number("scale_factor"), number("add_offset")];
        both.iter().any(Option::is_some).then(|| [both[0].unwrap_or(1.0), both[1].unwrap_or(0.0)])
    }
}

/// What each axis of an image, by its number, begins at and steps by, or the coordinates of axes by their names.
type Coordinates = BTreeMap<String, Vec<f64>>;

struct Opening<'a> {
    store: Arc<Store>,
    memory: &'a MemoryLimit,
    given: &'a Path,
}

impl Opening<'_> {
    /// The volume in a group, or that of an array in it.
    fn group(&self, group: &Node, only: Option<(&str, Node)>) -> Result<Volume, ReadError> {
        if let Some(image) = Image::of(&group.attributes).at(String::new)? {
            let is_level = |(name, _): &(&str, Node)| image.levels.iter().any(|level| level.path == *name);
            if only.as_ref().is_none_or(is_level) {
                return self.image(&image, only.map(|(name, _)| name));
            }
        }
        let Some(children) = group.children(&self.store)? else {
            let Some((name, node)) = only else { return Err(self.unlisted()).at(String::new) };
            let found = Found::of(name, &node).at(|| shown(name))?;
            return self.volume(vec![(found, name.to_owned())], &BTreeMap::new());
        };
        let mut arrays = Vec::new();
        let mut groups = Vec::new();
        for (name, node) in &children {
            match node.kind {
                Kind::Array { .. } => arrays.push(Found::of(name, node).at(|| shown(name))?),
                Kind::Group { .. } => groups.push(name.as_str()),
            }
        }
        let several = arrays.iter().filter(|found| found.shape.len() > 1);
        let named: Vec<String> = several.flat_map(|found| &found.all).map(|axis| axis.name.clone()).collect();
        let is_coordinate = |found: &Found| found.shape.len() == 1 && named.contains(&found.path);
        let (along, mut arrays): (Vec<Found>, Vec<Found>) = arrays.into_iter().partition(is_coordinate);
        let mut notes = Vec::new();
        match only {
            Some((name, _)) => arrays.retain(|found| found.path == name),
            None => arrays.retain(|found| {
                let is_volume = Axes::of(&found.all, &found.shape);
                if is_volume.is_err() {
                    let axes = listed(&found.all, &found.shape);
                    notes.push(format!("array \"{}\" is left out: its axes are {axes}", found.path));
                }
                is_volume.is_ok()
            }),
        }
        if arrays.is_empty() {
            return Err(self.nothing(&groups, &notes)).at(String::new);
        }
        let used =
            |found: &&Found| arrays.iter().flat_map(|array| &array.all).any(|axis| axis.name == found.path);
        let mut coordinates = Coordinates::new();
        for found in along.iter().filter(used) {
            // Dates, as text, are no numbers.
            if let Ok(samples) = Samples::open(&self.store, &found.path, self.memory) {
                coordinates.insert(found.path.clone(), samples.list()?);
            }
        }
        let arrays =
            arrays.into_iter().map(|found| (found.path.clone(), found)).map(|(name, found)| (found, name));
        let volume = self.volume(arrays.collect(), &coordinates)?;
        Ok(Volume { notes: [notes, volume.notes].concat(), ..volume })
    }

    /// The finest level of an image, or another one.
    fn image(&self, image: &Image, level: Option<&str>) -> Result<Volume, ReadError> {
        let given = level;
        let level = image.levels.iter().find(|known| level.is_none_or(|path| known.path == path));
        let missing = || ReadReason::Missing("a level of \"multiscales\"".into());
        let level = level.ok_or_else(missing).at(String::new)?;
        let place = || shown(&level.path);
        let (found, axes) = self.level(image, level)?;
        let is_large = |found: &Found, axes: &Axes| {
            let points = axes.dims(&found.shape).into_iter().fold(1, u64::saturating_mul);
            points > grid::MAX_GRID_POINTS
        };
        if given.is_none() && is_large(&found, &axes) {
            for coarser in &image.levels {
                let (of_coarser, axes) = self.level(image, coarser)?;
                if !is_large(&of_coarser, &axes) {
                    let what = format!("an image with the axes {}", listed(&found.all, &found.shape));
                    let remedy = format!("give a coarser level: {}", self.below(&coarser.path));
                    return Err(ReadReason::unsupported(what, remedy)).at(place);
                }
            }
        }
        let steps = level.steps(found.all.len()).at(place)?;
        let units = axes.space.map(|axis| found.all[axis].unit.as_str());
        let factors = to_one_unit(units).at(place)?;
        let mut notes = Vec::new();
        if !units[0].is_empty() {
            notes.push(format!("lengths are in {}s", units[0]));
        }
        if image.images > 1 {
            notes.push(format!("the first of {} images is read", image.images));
        }
        let times = axes.time.map(|axis| (found.shape[axis], steps[axis]));
        let along = |k: usize| steps[axes.space[k]].map(|x| x * factors[k]);
        let name = if image.name.is_empty() || image.name.contains('/') { FIELD } else { &image.name };
        let volume = self.volume(vec![(found, name.to_owned())], &Coordinates::new())?;
        let [[dx, x], [dy, y], [dz, z]] = [along(0), along(1), along(2)];
        let steps = [[dx, 0.0, 0.0], [0.0, dy, 0.0], [0.0, 0.0, dz]];
        let places = Places::Even(Placement { dims: volume.dims, origin: [x, y, z], steps });
        let times = times.map(|(count, [step, start])| (0..count).map(|i| i as f64 * step + start).collect());
        let mut volume = Volume { places, times: times.unwrap_or_default(), notes, ..volume };
        let several = volume.arrays.iter_mut().filter(|array| array.names.len() > 1);
        for (own, label) in several.flat_map(|array| &mut array.names).zip(&image.channels) {
            if !label.is_empty() {
                *own = format!("{name}_{label}");
            }
        }
        check_times(&volume.times).at(place)?;
        Ok(volume)
    }

    /// The array of a level, and its axes.
    fn level(&self, image: &Image, level: &Level) -> Result<(Found, Axes), ReadError> {
        let place = || shown(&level.path);
        let missing = || ReadReason::Missing("the array that \"multiscales\" names".into());
        let node = Node::of(&self.store, &level.path)?.ok_or_else(missing).at(place)?;
        let mut found = Found::of(&level.path, &node).at(place)?;
        match &image.axes {
            Some(axes) => found.all.clone_from(axes),
            // Five, in this order, before version 0.3.
            None if found.shape.len() == 5 => found.all = ["t", "c", "z", "y", "x"].map(Axis::named).to_vec(),
            None => {}
        }
        expect_count("axes of \"multiscales\"", found.shape.len(), found.all.len()).at(place)?;
        let axes = Axes::of(&found.all, &found.shape).at(place)?;
        Ok((found, axes))
    }

    /// Arrays, with the names of their fields, as one volume.
    fn volume(&self, arrays: Vec<(Found, String)>, coordinates: &Coordinates) -> Result<Volume, ReadError> {
        let mut on_grid = Vec::new();
        let mut known: Option<(Found, Axes)> = None;
        for (found, name) in arrays {
            let place = || shown(&found.path);
            let axes = Axes::of(&found.all, &found.shape).at(place)?;
            grid::checked_dims(axes.dims(&found.shape)).at(place)?;
            let [times, channels] = [axes.time, axes.channel].map(|axis| Axes::count(axis, &found.shape));
            let (_, channels) = (times.at(place)?, channels.at(place)?);
            let names = if channels == 1 {
                vec![name]
            } else {
                (0..channels).map(|channel| format!("{name}_{channel}")).collect()
            };
            let samples = Samples::open(&self.store, &found.path, self.memory)?;
            expect_count("axes", found.shape.len(), samples.shape().len()).at(place)?;
            on_grid.push(OnGrid { samples, axes, names, unit: found.text("units"), linear: found.linear() });
            match &known {
                Some((first, of_first)) if !same_grid((first, of_first), (&found, &axes)) => {
                    return Err(self.several([first, &found])).at(String::new);
                }
                Some(_) => {}
                None => known = Some((found, axes)),
            }
        }
        let Some((found, axes)) = known else { return Err(self.nothing(&[], &[])).at(String::new) };
        let dims = axes.dims(&found.shape);
        let of_axis = |axis: usize| {
            let list = coordinates.get(&found.all[axis].name);
            list.filter(|list| list.len() as u64 == found.shape[axis])
        };
        let places = places(dims, axes.space.map(of_axis)).at(|| shown(&found.path))?;
        let count = axes.time.map_or(0, |axis| found.shape[axis]);
        let times = match axes.time.and_then(of_axis) {
            Some(times) => times.clone(),
            None => (0..count).map(|i| i as f64).collect(),
        };
        check_times(&times).at(|| shown(&found.path))?;
        Ok(Volume { arrays: on_grid, dims, places, times, notes: Vec::new() })
    }

    /// What is below the address or path that was given.
    fn below(&self, name: &str) -> String {
        format!("{}/{name}", self.given.display().to_string().trim_end_matches('/'))
    }

    fn several(&self, of: [&Found; 2]) -> ReadReason {
        let list = of.map(|found| format!("\"{}\" with {}", found.path, listed(&found.all, &found.shape)));
        ReadReason::unsupported(
            format!("a group of arrays on different grids ({})", list.join(", ")),
            format!("give one of its arrays: {}", self.below(&of[0].path)),
        )
    }

    fn unlisted(&self) -> ReadReason {
        ReadReason::unsupported(
            "a group on a server that does not say what is in it",
            format!("give one of its arrays ({}), or consolidate its metadata", self.below("NAME")),
        )
    }

    fn nothing(&self, groups: &[&str], notes: &[String]) -> ReadReason {
        match groups.first() {
            Some(first) => ReadReason::unsupported(
                format!("a group of groups ({})", groups.join(", ")),
                format!("give one of them: {}", self.below(first)),
            ),
            None if notes.is_empty() => ReadReason::Missing("an array in this group".into()),
            None => ReadReason::unsupported(
                format!("a group without a volume ({})", notes.join("; ")),
                "give arrays of three axes, with t for time and c for channels",
            ),
        }
    }
}

/// Whether two arrays have the same samples at the same times.
fn same_grid((a, of_a): (&Found, &Axes), (b, of_b): (&Found, &Axes)) -> bool {
    let ends = |found: &Found, axes: &Axes| {
        let name = |axis: usize| found.all[axis].name.clone();
        let is_named = axes.space.iter().all(|&axis| !name(axis).is_empty());
        (
            axes.dims(&found.shape),
            axes.time.map(|axis| found.shape[axis]),
            is_named.then(|| axes.space.map(name)),
        )
    };
    let ([dims, other], [time, other_time], names) = {
        let ((dims, time, names), (other, other_time, other_names)) = (ends(a, of_a), ends(b, of_b));
        ([dims, other], [time, other_time], names.zip(other_names))
    };
    dims == other && time == other_time && names.is_none_or(|(names, others)| names == others)
}

/// Where samples lie that have these coordinates along x, y and z; without, they are one apart.
fn places(dims: [u64; 3], along: [Option<&Vec<f64>>; 3]) -> Result<Places, ReadReason> {
    let mut even = [[1.0, 0.0]; 3];
    let mut is_even = true;
    for (step, list) in even.iter_mut().zip(along) {
        let Some(&[first, .., last]) = list.map(Vec::as_slice) else { continue };
        let list = list.map(Vec::as_slice).unwrap_or_default();
        let by = (last - first) / (list.len() - 1) as f64;
        if list.iter().any(|x| !x.is_finite())
            || list.windows(2).any(|pair| (pair[1] > pair[0]) != (by > 0.0))
        {
            let what = "coordinates that do not all rise or all fall";
            return Err(ReadReason::unsupported(what, "sort the samples by their coordinates"));
        }
        let far = |(i, x): (usize, &f64)| (x - (first + i as f64 * by)).abs() > EVEN * by.abs();
        is_even &= !list.iter().enumerate().any(far);
        *step = [by, first];
    }
    if !is_even {
        let list = |k: usize| along[k].cloned().unwrap_or_else(|| (0..dims[k]).map(|i| i as f64).collect());
        return Ok(Places::Along([list(0), list(1), list(2)]));
    }
    let [[dx, x], [dy, y], [dz, z]] = even;
    let steps = [[dx, 0.0, 0.0], [0.0, dy, 0.0], [0.0, 0.0, dz]];
    Ok(Places::Even(Placement { dims, origin: [x, y, z], steps }))
}

/// Times must rise: steps are known by them.
fn check_times(times: &[f64]) -> Result<(), ReadReason> {
    let rises = times.iter().all(|time| time.is_finite()) && times.windows(2).all(|pair| pair[0] < pair[1]);
    if rises {
        return Ok(());
    }
    Err(ReadReason::unsupported(
        "times that do not rise",
        "sort the steps by their times, and give each its own",
    ))
}
