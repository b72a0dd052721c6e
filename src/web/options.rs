//! What JavaScript asks for, checked: every refusal names the option.

use super::callback::Callback;
use super::error::WebError;
use crate::geom::Bounds;
use crate::mt::MtInfo;
use crate::refine::Budget;
use crate::refine::Criterion;
use crate::refine::Need;
use crate::refine::Part;
use crate::refine::Region;
use crate::refine::Request;
use crate::refine::RequestError;
use crate::refine::Transfer;
use crate::refine::View;
use js_sys::Array;
use js_sys::Function;
use js_sys::Object;
use js_sys::Reflect;
use std::sync::Arc;
use wasm_bindgen::JsCast;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = r#"
/** A point or a direction: three numbers, or an object such as the `Vector3` of three.js. */
export type Vector = ArrayLike<number> | { readonly x: number; readonly y: number; readonly z: number };

/** A number in the field's own units, or a string such as `"1%"` relative to the field's range. */
export type FieldError = number | string;

/** What a camera sees. */
export interface ViewOptions {
  /**
   * From the space of the model to clip space, 16 numbers column by column. In three.js
   * `new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse)`, or its `elements`.
   */
  matrix: ArrayLike<number> | { readonly elements: ArrayLike<number> };
  /** Width and height of the picture in pixels. */
  viewport: ArrayLike<number>;
  /** The largest error that may be seen, in pixels: the displacement that the field's error counts as. */
  pixels: number;
  /** The error that is good enough everywhere, seen or not. Default: what is not seen is left as coarse as it can be. */
  outside?: FieldError;
}

/** The colour and opacity of each value of a field, linear between its points and constant beyond. */
export interface TransferOptions {
  /** `[value, red, green, blue, opacity]` of each point: values in field units, ascending, the others from 0 to 1. */
  points: ArrayLike<ArrayLike<number>> | ArrayLike<number>;
  /** The way through the model, in parts of its diagonal, along which the opacities are what they say. Default 1. */
  unitLength?: number;
}

/**
 * A part of the volume and the error that the mesh may have there. A need is one of three: the field within `error`, in
 * one region or around values or both; what a camera sees, within `view.pixels`; or what a transfer function shows,
 * within `error`.
 */
export interface Need {
  /**
   * The largest error that the mesh may have where it counts. Default 0: the reference mesh. With `transfer`: of colour
   * and opacity, 0 to 1 or a percentage, along a ray through the whole model.
   */
  error?: FieldError;
  /** The field that the need speaks of: its name, or its number in `info.fields`. Default: the field of the request. */
  field?: string | number;
  /** Only tetrahedra that meet this box count: `[x0, y0, z0, x1, y1, z1]`, or the `Box3` of three.js. */
  box?: ArrayLike<number> | { readonly min: Vector; readonly max: Vector };
  /** Only what meets this ball counts. */
  sphere?: { readonly center: Vector; readonly radius: number };
  /** Only what meets this box counts: its center, and from there the ways to the middles of three faces. */
  orientedBox?: { readonly center: Vector; readonly halfAxes: ArrayLike<number> | readonly [Vector, Vector, Vector] };
  /** Only what meets the half-space of all p with `normal · p <= offset` counts. */
  halfSpace?: { readonly normal: Vector; readonly offset: number };
  /** Only what is close to a plane counts: all p with `|normal · p - offset| <= thickness / 2 · |normal|`. */
  slab?: { readonly normal: Vector; readonly offset: number; readonly thickness?: number };
  /** Only what lies behind all of these planes, `[nx, ny, nz, d]`, counts: all p with `n · p <= d`. At most 16. */
  planes?: ArrayLike<ArrayLike<number>> | ArrayLike<number>;
  /** Only tetrahedra whose values may span one of these values, in field units, count. */
  isovalues?: ArrayLike<number>;
  /** Only tetrahedra whose values may meet one of these ranges, `[low, high]` in field units, count. */
  ranges?: ArrayLike<ArrayLike<number>> | ArrayLike<number>;
  /** What a camera sees. */
  view?: ViewOptions;
  /** What a transfer function shows. */
  transfer?: TransferOptions;
}

/** Many tetrahedra at once, for a function that says where the mesh is too coarse. */
export interface TetBatch {
  /** Number of tetrahedra. */
  count: number;
  /** Twelve coordinates a tetrahedron. */
  positions: Float32Array;
  /** Four values a tetrahedron, in field units. */
  values: Float32Array;
  /** The error of each tetrahedron, in field units: what is removed with it differs from the reference by so much. */
  errors: Float32Array;
}

/** How often the error of each tetrahedron exceeds what is wanted there: above 1 it is refined. */
export type Where = (batch: TetBatch) => ArrayLike<number>;

/**
 * Which mesh is wanted: the coarsest one that meets every need. The options of a {@link Need} describe the first one.
 * Every option may be left out, and names that are not listed here are refused.
 */
export interface RefineOptions extends Need {
  /**
   * The field that errors and values speak of and that the mesh carries: its name (the first time step of that name), or
   * its number in `info.fields`. Default: the first.
   */
  field?: string | number;
  /** More needs. If they are given and nothing else is, they are the only ones. */
  needs?: readonly Need[];
  /**
   * A need of your own, answered from the base mesh with every request. A function where the MT runs in the caller's
   * thread (`worker: false`); otherwise the URL of a module whose default export is the function.
   */
  where?: Where | string | URL;
  /** The mesh may have at most so many tetrahedra; the error is then as small as that allows. Default: no limit. */
  maxTets?: number;
  /** At most so many vertices. Default: no limit. */
  maxVertices?: number;
  /** At most so many bytes of arrays: 32 a tetrahedron and 16 a vertex. Default: no limit. */
  maxBytes?: number;
}
"#;

#[wasm_bindgen]
extern "C" {
    /// [`RefineOptions`](TYPES) as JavaScript gives it: anything at all.
    #[wasm_bindgen(typescript_type = "RefineOptions")]
    pub type RefineOptions;
}

const REGIONS: [&str; 6] = ["box", "sphere", "orientedBox", "halfSpace", "slab", "planes"];
const NEED: [&str; 12] = [
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
    "view",
    "transfer",
];
/// What only a whole request has.
const REQUEST: [&str; 5] = ["needs", "where", "maxTets", "maxVertices", "maxBytes"];

/// What was asked for.
#[derive(Clone, Debug, Default)]
pub struct Asked {
    pub request: Request,
    /// The field that is shown, and that stats speak of.
    pub field: usize,
    /// Needs that functions tell.
    pub custom: Vec<Arc<dyn Criterion>>,
    /// For each need of the request, what its bound is multiplied by to be in the unit in which it was asked.
    pub units: Vec<f64>,
    /// The needs that follow the viewer's own camera.
    pub follows: Vec<usize>,
}

/// What `options` ask for, of the MT of `info`. `own` is the viewer's camera, for views that name none.
pub fn asked(options: &JsValue, info: &MtInfo, own: Option<&View>) -> Result<Asked, WebError> {
    let mut parser = Parser { info, own, asked: Asked::default() };
    if options.is_undefined() || options.is_null() {
        parser.asked.request = parser.of_field(Need::within(0.0), 0).into();
        parser.asked.units.push(info.fields[0].range());
        return Ok(parser.asked);
    }
    let options = Options::new(options, "options", String::new())?;
    options.knows(&[&NEED[..], &REQUEST[..]].concat())?;
    parser.asked.field = options.field(info)?.unwrap_or(0);
    let needs = options.get("needs").map(|needs| options.list("needs", &needs)).transpose()?;
    let others = needs.is_some() || options.has("where");
    // A field alone is no need: it says which one is shown.
    if !others || NEED.iter().any(|name| *name != "field" && options.has(name)) {
        parser.need(&options)?;
    }
    for (i, need) in needs.iter().flat_map(Array::iter).enumerate() {
        let need = Options::new(&need, &format!("needs[{i}]"), format!("needs[{i}]."))?;
        need.knows(&NEED)?;
        parser.need(&need)?;
    }
    parser.function(&options)?;
    parser.asked.request.budget = budget(&options)?;
    Ok(parser.asked)
}

/// The index of a field that is named, or given by that index.
pub fn field_index(info: &MtInfo, field: &JsValue) -> Result<usize, WebError> {
    known_field(info, field).map_err(|problem| WebError::bad_option("field", &problem))
}

fn known_field(info: &MtInfo, field: &JsValue) -> Result<usize, String> {
    if let Some(name) = field.as_string() {
        return named_field(info, &name);
    }
    let number = field.as_f64().ok_or("must be a text or a number")?;
    let index = number as usize;
    // Casts saturate, and what is no number becomes 0.
    if index as f64 == number && index < info.fields.len() {
        Ok(index)
    } else {
        Err(format!("there are fields 0 to {}", info.fields.len() - 1))
    }
}

fn named_field(info: &MtInfo, name: &str) -> Result<usize, String> {
    info.fields.iter().position(|field| field.name == name).ok_or_else(|| {
        let known: Vec<&str> = info.fields.iter().map(|field| field.name.as_str()).collect();
        format!("there is no field `{name}`, only {}", known.join(", "))
    })
}

/// An array, typed array or anything like one, as an array.
pub fn list(value: &JsValue) -> Option<Array> {
    let has_length = || Reflect::get(value, &"length".into()).is_ok_and(|length| length.as_f64().is_some());
    (value.is_object() && has_length()).then(|| Array::from(value))
}

/// The box of `[x0, y0, z0, x1, y1, z1]`.
#[cfg(all(feature = "gpu", target_arch = "wasm32"))]
pub fn bounds(numbers: &[f64]) -> Result<Bounds, WebError> {
    corners(numbers).map_err(|problem| WebError::bad_option("box", problem))
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

/// Needs as they are found.
struct Parser<'a> {
    info: &'a MtInfo,
    own: Option<&'a View>,
    asked: Asked,
}

impl Parser<'_> {
    /// Adds a need, which the option `name` of `options` makes what it is.
    fn push(&mut self, options: &Options, name: &str, need: Need, unit: f64) -> Result<(), WebError> {
        let alone = Request::from(need);
        alone.check(self.info).map_err(|error| match error {
            RequestError::Need { problem, .. } => options.refuse(name, problem),
            _ => options.refuse(name, &error.to_string()),
        })?;
        self.asked.request.needs.extend(alone.needs);
        self.asked.units.push(unit);
        Ok(())
    }

    /// `need` of one field, where there are others.
    fn of_field(&self, need: Need, field: usize) -> Need {
        if self.info.fields.len() > 1 { need.of_field(field) } else { need }
    }

    /// The need that `options` describe.
    fn need(&mut self, options: &Options) -> Result<(), WebError> {
        let field = options.field(self.info)?.unwrap_or(self.asked.field);
        if let Some(view) = options.object("view")? {
            options.stands_alone("view", &["error", "transfer"])?;
            return self.view(&view, field);
        }
        if let Some(transfer) = options.object("transfer")? {
            options.stands_alone("transfer", &[])?;
            let error = options.error("error", 1.0)?.unwrap_or(0.0);
            let part = Part::Transfer(transfer.transfer(field)?);
            return self.push(options, "transfer", Need { error, field: None, part }, 1.0);
        }
        let info = &self.info.fields[field];
        let mut need =
            self.of_field(Need::within(options.error("error", info.range())?.unwrap_or(0.0)), field);
        let mut name = "error";
        if let Some((kind, region)) = options.region()? {
            name = kind;
            need = need.inside(region);
        }
        let ranges = options.ranges()?;
        if !ranges.is_empty() {
            need = need.between(field, ranges);
        }
        let unit = info.range();
        self.push(options, name, need, unit)
    }

    fn view(&mut self, view: &Options, field: usize) -> Result<(), WebError> {
        view.knows(&["matrix", "viewport", "pixels", "outside"])?;
        let camera = match self.own {
            Some(own) if !view.has("matrix") && !view.has("viewport") => {
                self.asked.follows.push(self.asked.request.needs.len());
                *own
            }
            _ => View { matrix: view.fixed("matrix")?, viewport: view.fixed("viewport")? },
        };
        let pixels = view.required("pixels")?;
        if !(pixels.is_finite() && pixels >= 0.0) {
            return Err(view.refuse("pixels", "must be a finite number that is not negative"));
        }
        self.push(view, "matrix", self.of_field(Need::seen(camera, pixels), field), 1.0)?;
        let range = self.info.fields[field].range();
        match view.error("outside", range)? {
            Some(error) => self.push(view, "outside", self.of_field(Need::within(error), field), range),
            None => Ok(()),
        }
    }

    fn function(&mut self, options: &Options) -> Result<(), WebError> {
        let Some(function) = options.get("where") else { return Ok(()) };
        let function: Function = function.dyn_into().map_err(|_| {
            options.refuse("where", "must be a function, or the URL of a module that has one")
        })?;
        self.asked.custom.push(Arc::new(Callback::new(function, self.info, self.asked.field)));
        Ok(())
    }
}

fn budget(options: &Options) -> Result<Budget, WebError> {
    let most = |name: &str| {
        let Some(number) = options.number(name)? else { return Ok(None) };
        if number >= 1.0 {
            Ok(Some(number))
        } else {
            Err(options.refuse(name, "must be a number of at least 1"))
        }
    };
    // Casts saturate: more than an integer can count, infinity included, is no limit.
    Ok(Budget {
        tets: most("maxTets")?.map(|most| most as u32),
        vertices: most("maxVertices")?.map(|most| most as u32),
        bytes: most("maxBytes")?.map(|most| most as u64),
    })
}

/// An object with options.
struct Options {
    object: Object,
    /// What stands before the name of an option of it.
    path: String,
}

impl Options {
    /// `value`, which is the option `name`, as an object.
    fn new(value: &JsValue, name: &str, path: String) -> Result<Self, WebError> {
        // Objects of other pages are instances of other classes.
        if !value.is_object() || Array::is_array(value) {
            return Err(WebError::bad_option(name, "must be an object"));
        }
        Ok(Self { object: value.clone().unchecked_into(), path })
    }

    fn refuse(&self, name: &str, problem: &str) -> WebError {
        WebError::bad_option(&format!("{}{name}", self.path), problem)
    }

    /// Refuses names that are not among these.
    fn knows(&self, names: &[&str]) -> Result<(), WebError> {
        for name in Object::keys(&self.object).iter().filter_map(|name| name.as_string()) {
            if !names.contains(&name.as_str()) && self.has(&name) {
                let problem = format!("there is none of this name, only {}", names.join(", "));
                return Err(self.refuse(&name, &problem));
            }
        }
        Ok(())
    }

    /// What is undefined is not there.
    fn get(&self, name: &str) -> Option<JsValue> {
        let value = Reflect::get(&self.object, &name.into()).unwrap_or(JsValue::UNDEFINED);
        (!value.is_undefined()).then_some(value)
    }

    fn has(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    /// The option `name` makes the need one of its own kind.
    fn stands_alone(&self, name: &str, besides: &[&str]) -> Result<(), WebError> {
        let others = REGIONS.iter().chain(&["isovalues", "ranges"]).chain(besides);
        match others.into_iter().find(|other| self.has(other)) {
            Some(other) => Err(self.refuse(
                other,
                &format!(
                    "has no place beside `{name}`; put it in another one of `needs`, all of which are met"
                ),
            )),
            None => Ok(()),
        }
    }

    fn object(&self, name: &str) -> Result<Option<Self>, WebError> {
        let (path, inner) = (format!("{}{name}", self.path), format!("{}{name}.", self.path));
        self.get(name).map(|value| Self::new(&value, &path, inner)).transpose()
    }

    fn list(&self, name: &str, value: &JsValue) -> Result<Array, WebError> {
        list(value).ok_or_else(|| self.refuse(name, "must be an array"))
    }

    fn number(&self, name: &str) -> Result<Option<f64>, WebError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        value.as_f64().map(Some).ok_or_else(|| self.refuse(name, "must be a number"))
    }

    fn required(&self, name: &str) -> Result<f64, WebError> {
        self.number(name)?.ok_or_else(|| self.refuse(name, "is missing"))
    }

    /// Numbers, in lists of lists or not.
    fn numbers(&self, name: &str) -> Result<Option<Vec<f64>>, WebError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let mut numbers = Vec::new();
        for item in self.list(name, &value)?.iter() {
            match list(&item) {
                Some(inner) => numbers.extend(inner.iter().map(|number| number.as_f64())),
                None => numbers.push(item.as_f64()),
            }
        }
        let numbers: Option<Vec<f64>> = numbers.into_iter().collect();
        numbers.map(Some).ok_or_else(|| self.refuse(name, "must be numbers"))
    }

    /// Numbers of which there must be a certain count.
    fn fixed<const N: usize>(&self, name: &str) -> Result<[f64; N], WebError> {
        let numbers = self.numbers(name)?.ok_or_else(|| self.refuse(name, "is missing"))?;
        <[f64; N]>::try_from(numbers).map_err(|_| self.refuse(name, &format!("must be {N} numbers")))
    }

    /// Rows of `N` numbers; none if the option is not there.
    fn rows<const N: usize>(&self, name: &str) -> Result<Vec<[f64; N]>, WebError> {
        let numbers = self.numbers(name)?.unwrap_or_default();
        let (rows, rest) = numbers.as_chunks::<N>();
        if rest.is_empty() {
            Ok(rows.to_vec())
        } else {
            Err(self.refuse(name, &format!("must be rows of {N} numbers")))
        }
    }

    fn field(&self, info: &MtInfo) -> Result<Option<usize>, WebError> {
        let Some(value) = self.get("field") else { return Ok(None) };
        known_field(info, &value).map(Some).map_err(|problem| self.refuse("field", &problem))
    }

    /// An error as a part of `range`.
    fn error(&self, name: &str, range: f64) -> Result<Option<f64>, WebError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let relative = match value.as_string() {
            Some(text) => percentage(&text).map_err(|problem| self.refuse(name, &problem))?,
            None => self.required(name)? / range,
        };
        if relative.is_finite() && relative >= 0.0 {
            return Ok(Some(relative));
        }
        Err(self.refuse(name, "must be a finite number that is not negative"))
    }

    /// The region that the need is limited to.
    fn region(&self) -> Result<Option<(&'static str, Region)>, WebError> {
        let mut given = REGIONS.iter().copied().filter(|name| self.has(name));
        let Some(name) = given.next() else { return Ok(None) };
        if let Some(other) = given.next() {
            let problem =
                format!("cannot stand beside `{name}`; one need has one region, `needs` takes several");
            return Err(self.refuse(other, &problem));
        }
        let region = match name {
            "box" => {
                let numbers = self.numbers(name)?.unwrap_or_default();
                Region::Box(corners(&numbers).map_err(|problem| self.refuse(name, problem))?)
            }
            "planes" => Region::Convex(self.rows(name)?),
            _ => {
                let Some(object) = self.object(name)? else { return Ok(None) };
                object.shape(name)?
            }
        };
        Ok(Some((name, region)))
    }

    /// The region of kind `name` that this object describes.
    fn shape(&self, name: &str) -> Result<Region, WebError> {
        let region = match name {
            "sphere" => {
                self.knows(&["center", "radius"])?;
                Region::Sphere { centre: self.fixed("center")?, radius: self.required("radius")? }
            }
            "orientedBox" => {
                self.knows(&["center", "halfAxes"])?;
                let [a, b, c, d, e, f, g, h, i] = self.fixed("halfAxes")?;
                let halves = [[a, b, c], [d, e, f], [g, h, i]];
                Region::OrientedBox { centre: self.fixed("center")?, halves }
            }
            "halfSpace" => {
                self.knows(&["normal", "offset"])?;
                Region::HalfSpace { normal: self.fixed("normal")?, offset: self.required("offset")? }
            }
            _ => {
                self.knows(&["normal", "offset", "thickness"])?;
                let thickness = self.number("thickness")?.unwrap_or(0.0);
                let (normal, offset) = (self.fixed("normal")?, self.required("offset")?);
                Region::Slab { normal, offset, thickness }
            }
        };
        Ok(region)
    }

    /// Isovalues and ranges of values.
    fn ranges(&self) -> Result<Vec<[f64; 2]>, WebError> {
        let mut ranges: Vec<[f64; 2]> = self.rows("ranges")?;
        if !ranges.iter().all(|[low, high]| low <= high) {
            return Err(self.refuse("ranges", "each must be two numbers, the smaller one first"));
        }
        let isovalues = self.numbers("isovalues")?.unwrap_or_default();
        if !isovalues.iter().all(|value| value.is_finite()) {
            return Err(self.refuse("isovalues", "must be finite numbers"));
        }
        ranges.extend(isovalues.into_iter().map(|value| [value, value]));
        Ok(ranges)
    }

    fn transfer(&self, field: usize) -> Result<Transfer, WebError> {
        self.knows(&["points", "unitLength"])?;
        let points = self.rows("points")?;
        let points = points.into_iter().map(|[value, r, g, b, a]| (value, [r, g, b, a])).collect();
        Ok(Transfer { field, points, unit_length: self.number("unitLength")?.unwrap_or(1.0) })
    }
}

/// JavaScript reads the number: Rust's own way would bring tables of its own.
fn percentage(text: &str) -> Result<f64, String> {
    let number = text.trim().strip_suffix('%').map(str::trim_end).filter(|number| !number.is_empty());
    let number = number.and_then(|number| f64::try_from(JsValue::from(number)).ok()).unwrap_or(f64::NAN);
    if number.is_nan() {
        return Err(format!("`{text}` is neither a number nor a percentage such as \"1%\""));
    }
    Ok(number / 100.0)
}
