//! What OME-Zarr says of an image: its axes, its levels, and where their samples lie. Versions 0.4 and 0.5, and earlier ones as far as they say
//! the same. By <https://ngff.openmicroscopy.org/specifications/>.

use serde_json::{Map, Value};

use crate::error::{ReadReason, shown};
use crate::listed::expect_below;
use crate::zarr::axes::{Axis, Role};
use crate::zarr::node::object;

/// An image at several resolutions.
#[derive(Debug)]
pub(super) struct Image {
    pub name: String,
    /// None if there were none yet.
    pub axes: Option<Vec<Axis>>,
    /// The finest one first.
    pub levels: Vec<Level>,
    /// What channels are called, of those that have a name.
    pub channels: Vec<String>,
    /// How many images there are.
    pub images: usize,
}

/// An array with an image at one resolution.
#[derive(Debug)]
pub(super) struct Level {
    pub path: String,
    transformations: Vec<Value>,
}

impl Image {
    /// The first image in a group; none if it has none.
    pub fn of(attributes: &Map<String, Value>) -> Result<Option<Self>, ReadReason> {
        let of = object(attributes, "ome").unwrap_or(attributes);
        let Some(images) = of.get("multiscales") else { return Ok(None) };
        let missing = |what: &str| ReadReason::Missing(format!("{what} of \"multiscales\""));
        let images =
            images.as_array().filter(|images| !images.is_empty()).ok_or_else(|| missing("an entry"))?;
        let image = images[0].as_object().ok_or_else(|| missing("an entry"))?;
        let list = |of: &Map<String, Value>, name: &str| of.get(name).and_then(Value::as_array).cloned();
        let last = list(image, "coordinateTransformations").unwrap_or_default();
        let levels = list(image, "datasets").filter(|levels| !levels.is_empty());
        let levels = levels.ok_or_else(|| missing("the list \"datasets\""))?;
        let levels: Result<Vec<Level>, ReadReason> = levels
            .iter()
            .map(|level| {
                let path = level.get("path").and_then(Value::as_str);
                let path = path.ok_or_else(|| missing("\"path\" in a dataset"))?.trim_matches('/').to_owned();
                expect_below(&path)?;
                let own = level.get("coordinateTransformations").and_then(Value::as_array);
                let transformations = own.into_iter().flatten().chain(&last).cloned().collect();
                Ok(Level { path, transformations })
            })
            .collect();
        let axes = list(image, "axes").map(|axes| axes.iter().map(axis).collect());
        let channels = object(of, "omero").and_then(|omero| list(omero, "channels")).unwrap_or_default();
        let label =
            |channel: &Value| channel.get("label").and_then(Value::as_str).unwrap_or_default().to_owned();
        Ok(Some(Self {
            name: image.get("name").and_then(Value::as_str).unwrap_or_default().to_owned(),
            axes,
            levels: levels?,
            channels: channels.iter().map(label).collect(),
            images: images.len(),
        }))
    }
}

impl Level {
    /// What an index along each axis is multiplied by, and then what is added.
    pub fn steps(&self, axes: usize) -> Result<Vec<[f64; 2]>, ReadReason> {
        let mut steps = vec![[1.0, 0.0]; axes];
        for transformation in &self.transformations {
            let kind = transformation.get("type").and_then(Value::as_str).unwrap_or_default();
            if kind == "identity" {
                continue;
            }
            let numbers = transformation.get(kind).and_then(Value::as_array);
            let numbers: Option<Vec<f64>> = numbers.and_then(|list| list.iter().map(Value::as_f64).collect());
            let numbers = numbers.filter(|numbers| numbers.len() == axes);
            match (kind, numbers) {
                ("scale", Some(scale)) => {
                    steps.iter_mut().zip(scale).for_each(|(step, by)| *step = step.map(|x| x * by));
                }
                ("translation", Some(by)) => {
                    steps.iter_mut().zip(by).for_each(|(step, by)| step[1] += by);
                }
                ("scale" | "translation", None) => {
                    let what = format!("the {kind} of \"{}\" is not {axes} numbers, one an axis", self.path);
                    return Err(ReadReason::Syntax(what));
                }
                (other, _) => {
                    let what = format!("a coordinate transformation of type \"{}\"", shown(other));
                    return Err(ReadReason::unsupported(
                        what,
                        "give a scale and a translation, as version 0.4 and 0.5",
                    ));
                }
            }
        }
        Ok(steps)
    }
}

/// An axis: by its name alone in early versions.
fn axis(value: &Value) -> Axis {
    let text = |name: &str| value.get(name).and_then(Value::as_str).unwrap_or_default();
    let Some(kind) = value.get("type").and_then(Value::as_str) else {
        let name = value.as_str().unwrap_or_else(|| text("name"));
        return Axis { unit: text("unit").to_owned(), ..Axis::named(name) };
    };
    let role = match kind {
        "space" => Role::Space,
        "time" => Role::Time,
        "channel" => Role::Channel,
        _ => Role::Unknown,
    };
    Axis { name: text("name").to_owned(), role, unit: text("unit").to_owned() }
}
