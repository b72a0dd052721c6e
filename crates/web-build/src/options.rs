//! The options of a build, checked: every refusal names the option. They mean what those of the command `tetralod build` mean.

use js_sys::{Array, Object, Reflect};
use tetralod::mesh::RepairLevel;
use tetralod::mt::MtKind;
use tetralod_build::{BuildConfig, BuildCriterion, ConstructionChoice, FieldPrecision, Method, Purpose};
use tetralod_web::error::WebError;
use wasm_bindgen::{JsCast, JsValue};

/// The names of all options.
const NAMES: [&str; 22] = [
    "kind",
    "method",
    "criterion",
    "purpose",
    "tetErrors",
    "fields",
    "allFields",
    "cellToPoint",
    "repair",
    "weldDistance",
    "units",
    "metadata",
    "positionBits",
    "positionTolerance",
    "fieldBits",
    "fieldTolerance",
    "lossless",
    "displacement",
    "displacementEdges",
    "minDihedral",
    "featureAngle",
    "blockUpdates",
];

/// What was asked for.
pub struct BuildOptions {
    pub config: BuildConfig,
    /// Whether fields at cells become fields at points.
    pub cells: bool,
    /// What is mended in the mesh.
    pub repair: RepairLevel,
    /// Units of fields or vectors.
    pub units: Vec<(String, String)>,
    /// Entries of the file's metadata.
    pub metadata: Vec<(String, String)>,
}

/// What `options` ask for.
pub fn build_options(options: &JsValue) -> Result<BuildOptions, WebError> {
    let options =
        &if options.is_undefined() || options.is_null() { Object::new().into() } else { options.clone() };
    check_names(options)?;
    let from = Options(options);
    let choice = ConstructionChoice {
        kind: from.name("kind", &MtKind::OF_FILES.map(|kind| (kind.name(), kind)))?,
        method: from.name("method", &Method::ALL.map(|method| (method.name(), method)))?,
        criterion: from.name("criterion", &BuildCriterion::ALL.map(|by| (by.name(), by)))?,
        purpose: from.name("purpose", &Purpose::ALL.map(|purpose| (purpose.name(), purpose)))?,
        tet_errors: from.answer("tetErrors")?,
    };
    let default = BuildConfig::of(choice.kind());
    let [for_all, for_one] = from.precision()?;
    let (lossless, all_lossless) = from.lossless()?;
    let number = |name, low, high, expected| from.number(name, low, high, expected);
    let position_bits = number("positionBits", 1.0, 30.0, "an integer from 1 to 30")?;
    let position_tolerance = number("positionTolerance", 0.0, f64::MAX, "a number that is not negative")?;
    if position_bits.is_some() && position_tolerance.is_some() {
        return Err(WebError::bad_option("positionTolerance", "give this or `positionBits`"));
    }
    let displacement_edges =
        number("displacementEdges", 0.0, f64::INFINITY, "a number that is not negative")?;
    let config = BuildConfig {
        construction: choice.construction()?,
        fields: from.texts("fields")?,
        all_fields: from.answer("allFields")?,
        position_bits: whole("positionBits", position_bits)?,
        position_tolerance,
        field_precision: for_all.first().map_or(default.field_precision, |(_, precision)| *precision),
        precision_of: for_one,
        lossless,
        all_lossless,
        displacement: from.fraction("displacement")?.unwrap_or(default.displacement),
        displacement_edges: displacement_edges.unwrap_or(default.displacement_edges),
        min_dihedral: number("minDihedral", 0.0, 70.0, "0 to 70 degrees")?,
        feature_angle: number("featureAngle", 1.0, 90.0, "1 to 90 degrees")?,
        preserve: Vec::new(),
        preserve_within: default.preserve_within,
        keep_points: Vec::new(),
        block_bits: from.block_bits()?.unwrap_or(default.block_bits),
    };
    let metadata = from.pairs("metadata")?;
    if let Some((key, _)) = metadata.iter().find(|(key, _)| is_reserved(key)) {
        return Err(WebError::bad_option("metadata", &format!("the key \"{key}\" is empty or reserved")));
    }
    Ok(BuildOptions {
        config,
        cells: from.answer("cellToPoint")?,
        repair: from.repair()?,
        units: from.pairs("units")?,
        metadata,
    })
}

fn is_reserved(key: &str) -> bool {
    key.is_empty()
        || key == RepairLevel::METADATA_KEY
        || tetralod_build::Construction::METADATA_KEYS.contains(&key)
}

fn check_names(options: &JsValue) -> Result<(), WebError> {
    if !options.is_object() || Array::is_array(options) {
        return Err(WebError::bad_option("options", "must be an object"));
    }
    let names = Object::keys(options.unchecked_ref::<Object>());
    match names.iter().filter_map(|name| name.as_string()).find(|name| !NAMES.contains(&name.as_str())) {
        Some(name) => {
            let problem = format!("there is none of this name, only {}", NAMES.join(", "));
            Err(WebError::bad_option(&name, &problem))
        }
        None => Ok(()),
    }
}

/// For all fields, without a name, and for one each.
type Precisions = [Vec<(String, FieldPrecision)>; 2];

/// An object of options.
struct Options<'a>(&'a JsValue);

impl Options<'_> {
    /// The value of an option; none if it is `undefined`.
    fn get(&self, name: &str) -> Option<JsValue> {
        Reflect::get(self.0, &name.into()).ok().filter(|value| !value.is_undefined())
    }

    fn text(&self, name: &str) -> Result<Option<String>, WebError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        value.as_string().map(Some).ok_or_else(|| WebError::bad_option(name, "must be a text"))
    }

    fn name<T: Copy>(&self, option: &str, all: &[(&str, T)]) -> Result<Option<T>, WebError> {
        let Some(text) = self.text(option)? else { return Ok(None) };
        let found = all.iter().find(|(name, _)| *name == text).map(|(_, value)| *value);
        let names: Vec<String> = all.iter().map(|(name, _)| format!("\"{name}\"")).collect();
        let refused = || WebError::bad_option(option, &format!("must be one of {}", names.join(", ")));
        found.map(Some).ok_or_else(refused)
    }

    fn answer(&self, name: &str) -> Result<bool, WebError> {
        let Some(value) = self.get(name) else { return Ok(false) };
        value.as_bool().ok_or_else(|| WebError::bad_option(name, "must be true or false"))
    }

    fn number(&self, name: &str, low: f64, high: f64, expected: &str) -> Result<Option<f64>, WebError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let number = value.as_f64().filter(|number| (low..=high).contains(number));
        number.map(Some).ok_or_else(|| WebError::bad_option(name, &format!("must be {expected}")))
    }

    fn texts(&self, name: &str) -> Result<Vec<String>, WebError> {
        let Some(value) = self.get(name) else { return Ok(Vec::new()) };
        let refused = || WebError::bad_option(name, "must be a list of names");
        if !Array::is_array(&value) {
            return Err(refused());
        }
        let texts = value.unchecked_ref::<Array>().iter().map(|text| text.as_string());
        texts.collect::<Option<_>>().ok_or_else(refused)
    }

    /// The members of an object, if the option is one.
    fn members(&self, name: &str) -> Option<Vec<(String, JsValue)>> {
        let value = self.get(name).filter(|value| value.is_object() && !Array::is_array(value))?;
        let names = Object::keys(value.unchecked_ref::<Object>());
        let member = |name: JsValue| Some((name.as_string()?, Reflect::get(&value, &name).ok()?));
        Some(names.iter().filter_map(member).collect())
    }

    fn pairs(&self, name: &str) -> Result<Vec<(String, String)>, WebError> {
        if self.get(name).is_none() {
            return Ok(Vec::new());
        }
        let refused = || WebError::bad_option(name, "must be an object whose members are texts");
        let pairs = self.members(name).ok_or_else(refused)?.into_iter();
        pairs.map(|(name, text)| Some((name, text.as_string()?))).collect::<Option<_>>().ok_or_else(refused)
    }

    /// How finely fields are kept: the options `fieldBits` and `fieldTolerance` are for all fields, or objects by name.
    fn precision(&self) -> Result<Precisions, WebError> {
        let mut precisions: Precisions = Default::default();
        for (option, of) in [("fieldBits", bits as fn(&JsValue) -> _), ("fieldTolerance", tolerance)] {
            let Some(value) = self.get(option) else { continue };
            let (list, values) = match self.members(option) {
                Some(members) => (1, members),
                None => (0, vec![(String::new(), value)]),
            };
            for (name, value) in values {
                let found = of(&value).map_err(|expected| {
                    let place = if name.is_empty() { option.to_owned() } else { format!("{option}.{name}") };
                    WebError::bad_option(&place, &format!("must be {expected}"))
                })?;
                precisions[list].push((name, found));
            }
        }
        if precisions[0].len() > 1 {
            let problem = "without names it is for all fields: give this or `fieldBits`";
            return Err(WebError::bad_option("fieldTolerance", problem));
        }
        Ok(precisions)
    }

    /// Names of lossless fields, and whether all are.
    fn lossless(&self) -> Result<(Vec<String>, bool), WebError> {
        match self.get("lossless").and_then(|value| value.as_bool()) {
            Some(all) => Ok((Vec::new(), all)),
            None => Ok((self.texts("lossless")?, false)),
        }
    }

    /// A fraction as a number, or a percentage as a text.
    fn fraction(&self, name: &str) -> Result<Option<f64>, WebError> {
        let Some(value) = self.get(name) else { return Ok(None) };
        let found = value.as_f64().or_else(|| percentage(&value.as_string()?)).filter(|x| *x >= 0.0);
        let refused = || {
            WebError::bad_option(name, "must be a percentage as \"20%\", or a number that is not negative")
        };
        found.filter(|x| x.is_finite()).map(Some).ok_or_else(refused)
    }

    fn repair(&self) -> Result<RepairLevel, WebError> {
        let level = self.name("repair", &RepairLevel::ALL.map(|level| (level.name(), level)))?;
        let distance = self.number("weldDistance", 0.0, f64::MAX, "a number that is not negative")?;
        match (level.unwrap_or_default(), distance) {
            (level, None) => Ok(level),
            (RepairLevel::Weld { .. }, Some(distance)) => Ok(RepairLevel::Weld { distance }),
            _ => Err(WebError::bad_option("weldDistance", "goes with `repair: \"weld\"`")),
        }
    }

    fn block_bits(&self) -> Result<Option<u32>, WebError> {
        let Some(value) = self.get("blockUpdates") else { return Ok(None) };
        let found = (4..=16_u32).find(|bits| value.as_f64() == Some(f64::from(1_u32 << bits)));
        let refused = || WebError::bad_option("blockUpdates", "must be a power of two from 16 to 65536");
        found.map(Some).ok_or_else(refused)
    }
}

fn percentage(text: &str) -> Option<f64> {
    text.trim().strip_suffix('%')?.trim().parse::<f64>().ok().map(|percent| percent / 100.0)
}

fn bits(value: &JsValue) -> Result<FieldPrecision, &'static str> {
    let found = (1..=24_u32).find(|bits| value.as_f64() == Some(f64::from(*bits)));
    found.map(FieldPrecision::Bits).ok_or("an integer from 1 to 24")
}

fn tolerance(value: &JsValue) -> Result<FieldPrecision, &'static str> {
    let in_units = value.as_f64().map(FieldPrecision::Units);
    let of_range = || value.as_string().as_deref().and_then(percentage).map(FieldPrecision::Fraction);
    let is_good = |precision: &FieldPrecision| match *precision {
        FieldPrecision::Units(x) | FieldPrecision::Fraction(x) => x >= 0.0 && x.is_finite(),
        FieldPrecision::Bits(_) => true,
    };
    in_units
        .or_else(of_range)
        .filter(is_good)
        .ok_or("a number that is not negative, or a percentage as \"1%\"")
}

/// A number that must have no fraction; it is small.
fn whole(name: &str, number: Option<f64>) -> Result<Option<u32>, WebError> {
    match number {
        Some(number) if number.fract() != 0.0 => Err(WebError::bad_option(name, "must be an integer")),
        number => Ok(number.map(|number| number as u32)),
    }
}
