//! What JavaScript asks for, checked: every refusal names the option.

use super::callback::Callback;
use super::error::WebError;
use super::reader::{ReadError, Reader, read};
use crate::geom::Bounds;
use crate::mt::MtInfo;
use crate::refine::{Budget, Criterion, Need, Part, Region, Request, RequestError, Transfer, View};
use js_sys::{Function, Reflect};
use serde::de::{IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::sync::Arc;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = include_str!("options.d.ts");

#[wasm_bindgen]
extern "C" {
    /// [`RefineOptions`](TYPES) as JavaScript gives it: anything at all.
    #[wasm_bindgen(typescript_type = "RefineOptions")]
    pub type RefineOptions;
}

/// Options of a whole request, not of a need: the names of [`RequestOptions`].
const REQUEST: [&str; 5] = ["needs", "where", "maxTets", "maxVertices", "maxBytes"];

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
struct RequestOptions {
    needs: Option<Vec<NeedOptions>>,
    /// A function, which serde has no type for.
    r#where: Option<IgnoredAny>,
    max_tets: Option<f64>,
    max_vertices: Option<f64>,
    max_bytes: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
struct NeedOptions {
    error: Option<Value>,
    field: Option<Value>,
    r#box: Option<Numbers>,
    sphere: Option<SphereOptions>,
    oriented_box: Option<OrientedBoxOptions>,
    half_space: Option<PlaneOptions>,
    slab: Option<SlabOptions>,
    planes: Option<Numbers>,
    isovalues: Option<Numbers>,
    ranges: Option<Numbers>,
    view: Option<ViewOptions>,
    transfer: Option<TransferOptions>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SphereOptions {
    center: Numbers,
    radius: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
struct OrientedBoxOptions {
    center: Numbers,
    half_axes: Numbers,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaneOptions {
    normal: Numbers,
    offset: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SlabOptions {
    normal: Numbers,
    offset: f64,
    thickness: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ViewOptions {
    matrix: Option<Numbers>,
    viewport: Option<Numbers>,
    pixels: f64,
    outside: Option<Value>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
struct TransferOptions {
    points: Numbers,
    unit_length: Option<f64>,
}

/// What is not an object of options: an error, a field, or one of many numbers.
enum Value {
    Number(f64),
    Text(String),
    List(Vec<f64>),
}

/// Numbers, in lists of lists or not.
#[derive(Deserialize)]
#[serde(try_from = "Vec<Value>")]
struct Numbers(Vec<f64>);

impl TryFrom<Vec<Value>> for Numbers {
    type Error = &'static str;

    fn try_from(values: Vec<Value>) -> Result<Self, &'static str> {
        let mut numbers = Vec::new();
        for value in values {
            match value {
                Value::Number(number) => numbers.push(number),
                Value::List(mut list) => numbers.append(&mut list),
                Value::Text(_) => return Err("must be numbers"),
            }
        }
        Ok(Self(numbers))
    }
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OfValue)
    }
}

struct OfValue;

impl<'de> Visitor<'de> for OfValue {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, a text or a list of numbers")
    }

    fn visit_f64<E>(self, number: f64) -> Result<Value, E> {
        Ok(Value::Number(number))
    }

    fn visit_str<E>(self, text: &str) -> Result<Value, E> {
        Ok(Value::Text(text.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut numbers = Vec::new();
        while let Some(number) = items.next_element()? {
            numbers.push(number);
        }
        Ok(Value::List(numbers))
    }
}

/// What was asked for.
#[derive(Clone, Debug, Default)]
pub struct Asked {
    pub request: Request,
    /// The field that is shown, and that stats speak of.
    pub field: usize,
    /// Needs that functions decide.
    pub custom: Vec<Arc<dyn Criterion>>,
    /// For each need of the request, what its bound is multiplied by to be in the unit in which it was asked.
    pub units: Vec<f64>,
    /// The needs that follow the viewer's own camera.
    pub follows: Vec<usize>,
}

/// What `options` ask for, of the MT of `info`. `own` is the viewer's camera, for views that name none.
pub fn asked(options: &JsValue, info: &MtInfo, own: Option<&View>) -> Result<Asked, WebError> {
    parse(options, info, own).map_err(|error| error.with_value(options).into())
}

fn parse(options: &JsValue, info: &MtInfo, own: Option<&View>) -> Result<Asked, ReadError> {
    let mut parser = Parser { info, own, asked: Asked::default() };
    if options.is_undefined() || options.is_null() {
        parser.asked.request = parser.of_field(Need::within(0.0), 0).into();
        parser.asked.units.push(info.fields[0].range());
        return Ok(parser.asked);
    }
    let (need, all): (NeedOptions, RequestOptions) = Reader::read_both(options, &REQUEST)?;
    let at = Place(String::new());
    parser.asked.field = parser.field(&need, &at)?.unwrap_or(0);
    // A field alone is no need: it says which one is shown.
    if all.needs.is_none() && all.r#where.is_none() || need.names().next().is_some() {
        parser.need(&need, &at)?;
    }
    for (i, need) in all.needs.into_iter().flatten().enumerate() {
        parser.need(&need, &Place(format!("needs[{i}].")))?;
    }
    if all.r#where.is_some() {
        parser.function(options)?;
    }
    // Casts saturate: more than an integer can count, infinity included, is no limit.
    parser.asked.request.budget = Budget {
        tets: at_least_one("maxTets", all.max_tets)?.map(|most| most as u32),
        vertices: at_least_one("maxVertices", all.max_vertices)?.map(|most| most as u32),
        bytes: at_least_one("maxBytes", all.max_bytes)?.map(|most| most as u64),
    };
    Ok(parser.asked)
}

/// The index of a field that is named, or given by that index.
pub fn field_index(info: &MtInfo, field: &JsValue) -> Result<usize, WebError> {
    let index =
        read(field).and_then(|value| known_field(info, &value).map_err(|problem| ReadError::new(&problem)));
    index.map_err(|error| error.with_value(field).inside("field").into())
}

fn known_field(info: &MtInfo, field: &Value) -> Result<usize, String> {
    match field {
        Value::Text(name) => info.fields.iter().position(|field| field.name == *name).ok_or_else(|| {
            let known: Vec<&str> = info.fields.iter().map(|field| field.name.as_str()).collect();
            format!("there is no such field, only {}", known.join(", "))
        }),
        Value::Number(number) => {
            let index = *number as usize;
            // Casts saturate, and what is no number becomes 0.
            let is_known = index as f64 == *number && index < info.fields.len();
            is_known
                .then_some(index)
                .ok_or_else(|| format!("there are fields 0 to {}", info.fields.len() - 1))
        }
        Value::List(_) => Err("must be a text or a number".to_owned()),
    }
}

fn corners(numbers: &[f64]) -> Result<Bounds, &'static str> {
    let &[x0, y0, z0, x1, y1, z1] = numbers else {
        return Err("must be six numbers: x0, y0, z0, x1, y1, z1");
    };
    if !(x0 <= x1 && y0 <= y1 && z0 <= z1) {
        return Err("each of x0, y0, z0 must be at most x1, y1, z1");
    }
    Ok(Bounds { min: [x0, y0, z0], max: [x1, y1, z1] })
}

fn at_least_one(name: &str, number: Option<f64>) -> Result<Option<f64>, ReadError> {
    match number {
        Some(number) if number.is_nan() || number < 1.0 => {
            Err(ReadError::new("must be a number of at least 1").inside(name))
        }
        _ => Ok(number),
    }
}

/// What stands in front of the names of a need's options.
struct Place(String);

impl Place {
    fn refuse(&self, name: &str, problem: &str) -> ReadError {
        ReadError::new(problem).inside(&format!("{}{name}", self.0))
    }

    /// The same for the options of the option `name`.
    fn inside(&self, name: &str) -> Self {
        Self(format!("{}{name}.", self.0))
    }

    /// Numbers of which there must be a certain count.
    fn fixed<const N: usize>(&self, name: &str, numbers: &Numbers) -> Result<[f64; N], ReadError> {
        let fixed = <[f64; N]>::try_from(&numbers.0[..]);
        fixed.map_err(|_| self.refuse(name, &format!("must be {N} numbers")))
    }

    /// Rows of `N` numbers; none if the option is not there.
    fn rows<const N: usize>(
        &self,
        name: &str,
        numbers: Option<&Numbers>,
    ) -> Result<Vec<[f64; N]>, ReadError> {
        let (rows, rest) = numbers.map_or(&[][..], |Numbers(numbers)| numbers).as_chunks::<N>();
        if rest.is_empty() {
            return Ok(rows.to_vec());
        }
        Err(self.refuse(name, &format!("must be rows of {N} numbers")))
    }

    /// An error as a part of `range`.
    fn error(&self, name: &str, error: Option<&Value>, range: f64) -> Result<Option<f64>, ReadError> {
        let relative = match error {
            None => return Ok(None),
            Some(Value::Text(text)) => percentage(text).map_err(|problem| self.refuse(name, problem))?,
            Some(Value::Number(number)) => number / range,
            Some(Value::List(_)) => return Err(self.refuse(name, "must be a number or a percentage")),
        };
        if relative.is_finite() && relative >= 0.0 {
            return Ok(Some(relative));
        }
        Err(self.refuse(name, "must be a finite number that is not negative"))
    }
}

impl NeedOptions {
    /// The names of the options that are given and limit the need, `field` aside.
    fn names(&self) -> impl Iterator<Item = &'static str> {
        let Self {
            error,
            field: _,
            r#box,
            sphere,
            oriented_box,
            half_space,
            slab,
            planes,
            isovalues,
            ranges,
            view,
            transfer,
        } = self;
        let given = [
            ("box", r#box.is_some()),
            ("sphere", sphere.is_some()),
            ("orientedBox", oriented_box.is_some()),
            ("halfSpace", half_space.is_some()),
            ("slab", slab.is_some()),
            ("planes", planes.is_some()),
            ("isovalues", isovalues.is_some()),
            ("ranges", ranges.is_some()),
            ("error", error.is_some()),
            ("transfer", transfer.is_some()),
            ("view", view.is_some()),
        ];
        given.into_iter().filter_map(|(name, is_given)| is_given.then_some(name))
    }

    /// The option `kind` makes the need one of its own kind: of the others it has but these.
    fn stands_alone(&self, kind: &str, besides: &[&str], at: &Place) -> Result<(), ReadError> {
        match self.names().find(|name| *name != kind && !besides.contains(name)) {
            Some(other) => {
                let problem = format!(
                    "has no place beside `{kind}`; put it in another one of `needs`, all of which are met"
                );
                Err(at.refuse(other, &problem))
            }
            None => Ok(()),
        }
    }

    /// The regions that are given, by their names.
    fn regions(&self, at: &Place) -> Result<Vec<(&'static str, Region)>, ReadError> {
        let mut regions = Vec::new();
        if let Some(Numbers(numbers)) = &self.r#box {
            regions
                .push(("box", Region::Box(corners(numbers).map_err(|problem| at.refuse("box", problem))?)));
        }
        if let Some(SphereOptions { center, radius }) = &self.sphere {
            let centre = at.inside("sphere").fixed("center", center)?;
            regions.push(("sphere", Region::Sphere { centre, radius: *radius }));
        }
        if let Some(OrientedBoxOptions { center, half_axes }) = &self.oriented_box {
            let at = at.inside("orientedBox");
            let [a, b, c, d, e, f, g, h, i] = at.fixed("halfAxes", half_axes)?;
            let (centre, halves) = (at.fixed("center", center)?, [[a, b, c], [d, e, f], [g, h, i]]);
            regions.push(("orientedBox", Region::OrientedBox { centre, halves }));
        }
        if let Some(PlaneOptions { normal, offset }) = &self.half_space {
            let normal = at.inside("halfSpace").fixed("normal", normal)?;
            regions.push(("halfSpace", Region::HalfSpace { normal, offset: *offset }));
        }
        if let Some(SlabOptions { normal, offset, thickness }) = &self.slab {
            let normal = at.inside("slab").fixed("normal", normal)?;
            let thickness = thickness.unwrap_or(0.0);
            regions.push(("slab", Region::Slab { normal, offset: *offset, thickness }));
        }
        if self.planes.is_some() {
            regions.push(("planes", Region::Convex(at.rows("planes", self.planes.as_ref())?)));
        }
        Ok(regions)
    }

    /// The region that the need is limited to.
    fn region(&self, at: &Place) -> Result<Option<(&'static str, Region)>, ReadError> {
        let mut regions = self.regions(at)?;
        if let [(name, _), (other, _), ..] = &regions[..] {
            let problem =
                format!("cannot stand beside `{name}`; one need has one region, `needs` takes several");
            return Err(at.refuse(other, &problem));
        }
        Ok(regions.pop())
    }

    /// Isovalues and ranges of values.
    fn ranges(&self, at: &Place) -> Result<Vec<[f64; 2]>, ReadError> {
        let mut ranges: Vec<[f64; 2]> = at.rows("ranges", self.ranges.as_ref())?;
        if !ranges.iter().all(|[low, high]| low <= high) {
            return Err(at.refuse("ranges", "each must be two numbers, the smaller one first"));
        }
        let isovalues = self.isovalues.as_ref().map_or(&[][..], |Numbers(values)| values);
        if !isovalues.iter().all(|value| value.is_finite()) {
            return Err(at.refuse("isovalues", "must be finite numbers"));
        }
        ranges.extend(isovalues.iter().map(|&value| [value, value]));
        Ok(ranges)
    }
}

/// Needs as they are found.
struct Parser<'a> {
    info: &'a MtInfo,
    own: Option<&'a View>,
    asked: Asked,
}

impl Parser<'_> {
    /// Adds a need, which the option `name` makes what it is.
    fn push(&mut self, at: &Place, name: &str, need: Need, unit: f64) -> Result<(), ReadError> {
        let alone = Request::from(need);
        alone.check(self.info).map_err(|error| match error {
            RequestError::Need { problem, .. } => at.refuse(name, problem),
            _ => at.refuse(name, &error.to_string()),
        })?;
        self.asked.request.needs.extend(alone.needs);
        self.asked.units.push(unit);
        Ok(())
    }

    fn field(&self, need: &NeedOptions, at: &Place) -> Result<Option<usize>, ReadError> {
        let index = need.field.as_ref().map(|field| known_field(self.info, field)).transpose();
        index.map_err(|problem| at.refuse("field", &problem))
    }

    /// `need` of one field, where there are others.
    fn of_field(&self, need: Need, field: usize) -> Need {
        if self.info.fields.len() > 1 { need.of_field(field) } else { need }
    }

    /// The need that `options` describe.
    fn need(&mut self, options: &NeedOptions, at: &Place) -> Result<(), ReadError> {
        let field = self.field(options, at)?.unwrap_or(self.asked.field);
        if options.view.is_some() {
            options.stands_alone("view", &[], at)?;
        } else if options.transfer.is_some() {
            options.stands_alone("transfer", &["error"], at)?;
        }
        if let Some(view) = &options.view {
            return self.view(view, field, &at.inside("view"));
        }
        if let Some(TransferOptions { points, unit_length }) = &options.transfer {
            let points = at.inside("transfer").rows("points", Some(points))?;
            let error = at.error("error", options.error.as_ref(), 1.0)?.unwrap_or(0.0);
            let points = points.into_iter().map(|[value, r, g, b, a]| (value, [r, g, b, a])).collect();
            let part = Part::Transfer(Transfer { field, points, unit_length: unit_length.unwrap_or(1.0) });
            return self.push(at, "transfer", Need { error, field: None, part }, 1.0);
        }
        let unit = self.info.fields[field].range();
        let error = at.error("error", options.error.as_ref(), unit)?.unwrap_or(0.0);
        let mut need = self.of_field(Need::within(error), field);
        let mut name = "error";
        if let Some((kind, region)) = options.region(at)? {
            name = kind;
            need = need.inside(region);
        }
        let ranges = options.ranges(at)?;
        if !ranges.is_empty() {
            need = need.between(field, ranges);
        }
        self.push(at, name, need, unit)
    }

    fn view(&mut self, view: &ViewOptions, field: usize, at: &Place) -> Result<(), ReadError> {
        let camera = match (&view.matrix, &view.viewport, self.own) {
            (Some(matrix), Some(viewport), _) => {
                View { matrix: at.fixed("matrix", matrix)?, viewport: at.fixed("viewport", viewport)? }
            }
            (None, None, Some(own)) => {
                self.asked.follows.push(self.asked.request.needs.len());
                *own
            }
            (None, _, _) => return Err(at.refuse("matrix", "is missing")),
            (_, None, _) => return Err(at.refuse("viewport", "is missing")),
        };
        let pixels = view.pixels;
        if !(pixels.is_finite() && pixels >= 0.0) {
            return Err(at.refuse("pixels", "must be a finite number that is not negative"));
        }
        self.push(at, "matrix", self.of_field(Need::seen(camera, pixels), field), 1.0)?;
        let range = self.info.fields[field].range();
        match at.error("outside", view.outside.as_ref(), range)? {
            Some(error) => self.push(at, "outside", self.of_field(Need::within(error), field), range),
            None => Ok(()),
        }
    }

    fn function(&mut self, options: &JsValue) -> Result<(), ReadError> {
        let function =
            Reflect::get(options, &"where".into()).ok().and_then(|where_| where_.dyn_into::<Function>().ok());
        let problem = "must be a function, or the URL of a module that has one";
        let function = function.ok_or_else(|| ReadError::new(problem).inside("where"))?;
        self.asked.custom.push(Arc::new(Callback::new(function, self.info, self.asked.field)));
        Ok(())
    }
}

/// JavaScript reads the number: Rust's own way would bring tables of its own.
fn percentage(text: &str) -> Result<f64, &'static str> {
    let number = text.trim().strip_suffix('%').map(str::trim_end).filter(|number| !number.is_empty());
    let number = number.and_then(|number| f64::try_from(JsValue::from(number)).ok()).unwrap_or(f64::NAN);
    if number.is_nan() {
        return Err("must be a number or a percentage such as \"1%\"");
    }
    Ok(number / 100.0)
}
