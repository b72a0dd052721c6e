//! What JavaScript asks for, checked: every refusal names the option.

use crate::callback::Callback;
use js_sys::{Array, Function};
use std::sync::Arc;
use tetralod::geom::Bounds;
use tetralod::mt::{Mt, MtInfo, MultiTessellation, Regions, numbers_of};
use tetralod::refine::{Budget, Criterion, Inside, Need, Region, Request, RequestError, Transfer, View};
use tetralod_web_options::error::WebError;
use tetralod_web_options::given::Given;
use tetralod_web_options::read_error::ReadError;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r#"import type { RefineOptions } from "./options.js";"#;

#[wasm_bindgen]
extern "C" {
    /// `RefineOptions` as JavaScript gives it: anything at all.
    #[wasm_bindgen(typescript_type = "RefineOptions")]
    pub type RefineOptions;
}

/// The options of a need and behind them those of a whole request, as refusals list them.
const NAMES: [&str; 19] = [
    "error",
    "field",
    "box",
    "sphere",
    "orientedBox",
    "halfSpace",
    "slab",
    "planes",
    "isovalues",
    "ranges",
    "regions",
    "view",
    "transfer",
    "needs",
    "where",
    "whereBox",
    "maxTets",
    "maxVertices",
    "maxBytes",
];

/// Those of them that a need has.
const NEED: usize = 13;

/// Those of a need that limit it, in the order in which refusals name them.
const LIMITS: [&str; 11] = [
    "box",
    "sphere",
    "orientedBox",
    "halfSpace",
    "slab",
    "planes",
    "isovalues",
    "ranges",
    "error",
    "transfer",
    "view",
];

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

/// What `options` ask for, of an MT. `own` is the viewer's camera, for views that name none.
pub fn asked(options: &JsValue, mt: &Mt, own: Option<&View>) -> Result<Asked, WebError> {
    parse(options, mt, own).map_err(|error| error.with_value(options).into())
}

fn parse(options: &JsValue, mt: &Mt, own: Option<&View>) -> Result<Asked, ReadError> {
    let info = mt.info();
    let first = info.first_field();
    let asked = Asked { field: first, ..Asked::default() };
    let mut parser = Parser { info, regions: mt.regions(), own, asked };
    if options.is_undefined() || options.is_null() {
        parser.asked.request = parser.of_field(Need::within(0.0), first).into();
        parser.asked.units.push(info.fields[first].range());
        return Ok(parser.asked);
    }
    let all = Given::new(options, String::new(), &NAMES)?;
    let needs = all.each("needs", &NAMES[..NEED])?;
    parser.asked.field = parser.field(&all)?.unwrap_or(first);
    // A field alone is no need: it says which one is shown.
    if !all.has("needs") && !all.has("where") || LIMITS.iter().any(|name| all.has(name)) || all.has("regions")
    {
        parser.need(&all)?;
    }
    for need in &needs {
        parser.need(need)?;
    }
    match all.member("where") {
        Some(function) => parser.function(function, &all)?,
        None if all.has("whereBox") => return Err(all.refuse("whereBox", "has no place without `where`")),
        None => {}
    }
    // Casts saturate: more than an integer can count, infinity included, is no limit.
    parser.asked.request.budget = Budget {
        tets: all.at_least_one("maxTets")?.map(|most| most as u32),
        vertices: all.at_least_one("maxVertices")?.map(|most| most as u32),
        bytes: all.at_least_one("maxBytes")?.map(|most| most as u64),
    };
    Ok(parser.asked)
}

/// The index of a field that is named, or given by that index.
pub fn field_index(info: &MtInfo, field: &JsValue) -> Result<usize, WebError> {
    let index = known_field(info, field).map_err(|problem| ReadError::new(&problem));
    index.map_err(|error| error.with_value(field).inside("field").into())
}

fn known_field(info: &MtInfo, field: &JsValue) -> Result<usize, String> {
    if let Some(name) = field.as_string() {
        return info.fields.iter().position(|field| field.name == name).ok_or_else(|| {
            let known: Vec<&str> = info.fields.iter().map(|field| field.name.as_str()).collect();
            ["there is no such field, only ", &known.join(", ")].concat()
        });
    }
    let number = field.as_f64().ok_or("must be a text or a number")?;
    let index = number as usize;
    // Casts saturate, and what is no number becomes 0.
    let is_known = index as f64 == number && index < info.fields.len();
    is_known.then_some(index).ok_or_else(|| format!("there are fields 0 to {}", info.fields.len() - 1))
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

/// The box that the option `name` is.
fn bounds(given: &Given, name: &str) -> Result<Option<Bounds>, ReadError> {
    let corners = |numbers: Vec<f64>| corners(&numbers).map_err(|problem| given.refuse(name, problem));
    given.numbers(name)?.map(corners).transpose()
}

/// The option `kind` makes the need one of its own kind: of the others it has but these.
fn stands_alone(need: &Given, kind: &str, besides: &[&str]) -> Result<(), ReadError> {
    match LIMITS.iter().find(|name| **name != kind && !besides.contains(name) && need.has(name)) {
        Some(other) => {
            let problem = format!(
                "has no place beside `{kind}`; put it in another one of `needs`, all of which are met"
            );
            Err(need.refuse(other, &problem))
        }
        None => Ok(()),
    }
}

/// The regions that are given, by their names.
fn regions(need: &Given) -> Result<Vec<(&'static str, Region)>, ReadError> {
    let mut regions = Vec::new();
    if let Some(bounds) = bounds(need, "box")? {
        regions.push(("box", Region::Box(bounds)));
    }
    if let Some(at) = need.inside("sphere", &["center", "radius"])? {
        let (centre, radius) = (at.fixed("center")?, at.needed_number("radius")?);
        regions.push(("sphere", Region::Sphere { centre, radius }));
    }
    if let Some(at) = need.inside("orientedBox", &["center", "halfAxes"])? {
        let [a, b, c, d, e, f, g, h, i] = at.fixed("halfAxes")?;
        let (centre, halves) = (at.fixed("center")?, [[a, b, c], [d, e, f], [g, h, i]]);
        regions.push(("orientedBox", Region::OrientedBox { centre, halves }));
    }
    if let Some(at) = need.inside("halfSpace", &["normal", "offset"])? {
        let (normal, offset) = (at.fixed("normal")?, at.needed_number("offset")?);
        regions.push(("halfSpace", Region::HalfSpace { normal, offset }));
    }
    if let Some(at) = need.inside("slab", &["normal", "offset", "thickness"])? {
        let (normal, offset) = (at.fixed("normal")?, at.needed_number("offset")?);
        let thickness = at.number("thickness")?.unwrap_or(0.0);
        regions.push(("slab", Region::Slab { normal, offset, thickness }));
    }
    if need.has("planes") {
        regions.push(("planes", Region::Convex(need.rows("planes")?)));
    }
    Ok(regions)
}

/// The region that a need is limited to.
fn region(need: &Given) -> Result<Option<(&'static str, Region)>, ReadError> {
    let mut regions = regions(need)?;
    if let [(name, _), (other, _), ..] = &regions[..] {
        let problem = format!("cannot stand beside `{name}`; one need has one region, `needs` takes several");
        return Err(need.refuse(other, &problem));
    }
    Ok(regions.pop())
}

/// Isovalues and ranges of values.
fn ranges(need: &Given) -> Result<Vec<[f64; 2]>, ReadError> {
    let mut ranges: Vec<[f64; 2]> = need.rows("ranges")?;
    if !ranges.iter().all(|[low, high]| low <= high) {
        return Err(need.refuse("ranges", "each must be two numbers, the smaller one first"));
    }
    let isovalues = need.numbers("isovalues")?.unwrap_or_default();
    if !isovalues.iter().all(|value| value.is_finite()) {
        return Err(need.refuse("isovalues", "must be finite numbers"));
    }
    ranges.extend(isovalues.iter().map(|&value| [value, value]));
    Ok(ranges)
}

/// Needs as they are found.
struct Parser<'a> {
    info: &'a MtInfo,
    regions: Option<&'a Regions>,
    own: Option<&'a View>,
    asked: Asked,
}

/// The regions that are named, by their names or labels.
fn region_numbers(need: &Given, regions: Option<&Regions>) -> Result<Option<Vec<u16>>, ReadError> {
    let Some(names) = need.member("regions") else { return Ok(None) };
    let refuse = |problem: &str| need.refuse("regions", problem);
    if !Array::is_array(&names) {
        return Err(refuse("must be a list of names or labels"));
    }
    let word = |name: JsValue| {
        let label = || name.as_f64().filter(|label| label.fract() == 0.0).map(|x| (x as i64).to_string());
        name.as_string().or_else(label).ok_or_else(|| refuse("must be a list of names or labels"))
    };
    let names = Array::from(&names).iter().map(word).collect::<Result<Vec<_>, _>>()?;
    numbers_of(regions, &names).map(Some).map_err(|(_, problem)| refuse(&problem))
}

impl Parser<'_> {
    /// Adds a need, which the option `name` makes what it is.
    fn push(&mut self, from: &Given, name: &str, need: Need, unit: f64) -> Result<(), ReadError> {
        let alone = Request::from(need);
        alone.check(self.info).map_err(|error| match error {
            RequestError::Need { problem, .. } => from.refuse(name, problem),
            _ => from.refuse(name, &error.to_string()),
        })?;
        self.asked.request.needs.extend(alone.needs);
        self.asked.units.push(unit);
        Ok(())
    }

    fn field(&self, need: &Given) -> Result<Option<usize>, ReadError> {
        let index = need.member("field").map(|field| known_field(self.info, &field)).transpose();
        index.map_err(|problem| need.refuse("field", &problem))
    }

    /// `need` of one field, where there are others.
    fn of_field(&self, need: Need, field: usize) -> Need {
        if self.info.fields.len() > 1 { need.of_field(field) } else { need }
    }

    /// The need that `options` describe.
    fn need(&mut self, options: &Given) -> Result<(), ReadError> {
        let first = self.asked.request.needs.len();
        self.need_anywhere(options)?;
        if let Some(regions) = region_numbers(options, self.regions)? {
            self.asked.request.needs[first..]
                .iter_mut()
                .for_each(|need| need.regions = Some(regions.clone()));
        }
        Ok(())
    }

    fn need_anywhere(&mut self, options: &Given) -> Result<(), ReadError> {
        let field = self.field(options)?.unwrap_or(self.asked.field);
        if let Some(view) = options.inside("view", &["matrix", "viewport", "pixels", "outside"])? {
            stands_alone(options, "view", &[])?;
            return self.view(&view, field);
        }
        if let Some(transfer) = options.inside("transfer", &["points", "unitLength"])? {
            stands_alone(options, "transfer", &["error"])?;
            return self.transfer(options, &transfer, field);
        }
        let unit = self.info.fields[field].range();
        let error = options.error("error", unit)?.unwrap_or(0.0);
        let mut need = self.of_field(Need::within(error), field);
        let mut name = "error";
        if let Some((kind, region)) = region(options)? {
            name = kind;
            need = need.inside(region);
        }
        let ranges = ranges(options)?;
        if !ranges.is_empty() {
            need = need.between(field, ranges);
        }
        self.push(options, name, need, unit)
    }

    fn transfer(&mut self, options: &Given, transfer: &Given, field: usize) -> Result<(), ReadError> {
        if !transfer.has("points") {
            return Err(transfer.refuse("points", "is missing"));
        }
        let points = transfer.rows("points")?;
        let unit_length = transfer.number("unitLength")?.unwrap_or(1.0);
        let error = options.error("error", 1.0)?.unwrap_or(0.0);
        let points = points.into_iter().map(|[value, r, g, b, a]| (value, [r, g, b, a])).collect();
        let transfer = Transfer { field, points, unit_length };
        self.push(options, "transfer", Need::shown(transfer, error), 1.0)
    }

    fn view(&mut self, view: &Given, field: usize) -> Result<(), ReadError> {
        let camera = match self.own {
            Some(own) if !view.has("matrix") && !view.has("viewport") => {
                self.asked.follows.push(self.asked.request.needs.len());
                *own
            }
            _ => View { matrix: view.fixed("matrix")?, viewport: view.fixed("viewport")? },
        };
        let pixels = view.needed_amount("pixels")?;
        self.push(view, "matrix", self.of_field(Need::seen(camera, pixels), field), 1.0)?;
        let range = self.info.fields[field].range();
        match view.error("outside", range)? {
            Some(error) => self.push(view, "outside", self.of_field(Need::within(error), field), range),
            None => Ok(()),
        }
    }

    fn function(&mut self, function: JsValue, all: &Given) -> Result<(), ReadError> {
        let problem = "must be a function, or the URL of a module that has one";
        let function = function.dyn_into::<Function>().map_err(|_| all.refuse("where", problem))?;
        let callback = Callback::new(function, self.info, self.asked.field);
        self.asked.custom.push(match bounds(all, "whereBox")? {
            Some(bounds) => Arc::new(Inside::new(callback, bounds, self.info.lattice)),
            None => Arc::new(callback),
        });
        Ok(())
    }
}
