//! The options of a build, checked: every refusal names the option. They mean what those of the command `tetralod build` mean.

use js_sys::Object;
use std::ops::RangeInclusive;
use tetralod::mesh::{CellsToPoints, RepairLevel};
use tetralod::mt::MtKind;
use tetralod_build::{
    BuildConfig, BuildCriterion, Construction, ConstructionChoice, FieldPrecision, Method, Purpose,
};
use tetralod_web_options::error::WebError;
use tetralod_web_options::given::{Given, percentage};
use tetralod_web_options::read_error::ReadError;
use wasm_bindgen::JsValue;

/// The names of all options.
const NAMES: [&str; 26] = [
    "kind",
    "method",
    "criterion",
    "purpose",
    "tetErrors",
    "fields",
    "allFields",
    "cellToPoint",
    "meanAcrossRegions",
    "labels",
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
    "preserve",
    "preserveWithin",
    "blockUpdates",
];

/// What was asked for.
pub struct BuildOptions {
    pub config: BuildConfig,
    /// Whether fields at cells become fields at points.
    pub cells: bool,
    /// What they become.
    pub to_points: CellsToPoints,
    /// Which fields are labels, and which are not, as far as that is said.
    pub labels: Vec<(String, bool)>,
    /// What is mended in the mesh.
    pub repair: RepairLevel,
    /// Units of fields or vectors.
    pub units: Vec<(String, String)>,
    /// Entries of the file's metadata.
    pub metadata: Vec<(String, String)>,
}

/// What `options` ask for.
pub fn build_options(options: &JsValue) -> Result<BuildOptions, WebError> {
    let none = Object::new().into();
    let options = if options.is_undefined() || options.is_null() { &none } else { options };
    let given = Given::new(options, String::new(), &NAMES).and_then(|given| {
        let choice = choice(&given)?;
        Ok((given, choice))
    });
    let (given, choice) = given.map_err(|error| error.with_value(options))?;
    let construction = choice.construction()?;
    let default = BuildConfig::of(choice.kind());
    Ok(read(&given, construction, default).map_err(|error| error.with_value(options))?)
}

fn choice(given: &Given) -> Result<ConstructionChoice, ReadError> {
    Ok(ConstructionChoice {
        kind: given.name("kind", &MtKind::ALL.map(|kind| (kind.name(), kind)))?,
        method: given.name("method", &Method::ALL.map(|method| (method.name(), method)))?,
        criterion: given.name("criterion", &BuildCriterion::ALL.map(|by| (by.name(), by)))?,
        purpose: given.name("purpose", &Purpose::ALL.map(|purpose| (purpose.name(), purpose)))?,
        tet_errors: given.answer("tetErrors")?,
    })
}

fn read(given: &Given, construction: Construction, default: BuildConfig) -> Result<BuildOptions, ReadError> {
    let (field_precision, precision_of) = precision(given)?;
    let (lossless, all_lossless) = lossless(given)?;
    let position_bits = whole(given, "positionBits", 1..=30)?;
    let position_tolerance = given.amount("positionTolerance")?;
    if position_bits.is_some() && position_tolerance.is_some() {
        return Err(given.refuse("positionTolerance", "give this or `positionBits`"));
    }
    let config = BuildConfig {
        construction,
        fields: given.texts("fields")?,
        all_fields: given.answer("allFields")?,
        position_bits,
        position_tolerance,
        field_precision: field_precision.unwrap_or(default.field_precision),
        precision_of,
        lossless,
        all_lossless,
        displacement: given.error("displacement", 1.0)?.unwrap_or(default.displacement),
        displacement_edges: given
            .number_in("displacementEdges", 0.0..=f64::INFINITY, "a number that is not negative")?
            .unwrap_or(default.displacement_edges),
        min_dihedral: given.number_in("minDihedral", 0.0..=70.0, "0 to 70 degrees")?,
        feature_angle: given.number_in("featureAngle", 1.0..=90.0, "1 to 90 degrees")?,
        preserve: given.texts("preserve")?,
        preserve_within: given
            .number_in("preserveWithin", 0.0..=f64::MAX, "a length that is not negative")?
            .unwrap_or(default.preserve_within),
        keep_points: Vec::new(),
        block_bits: block_bits(given)?.unwrap_or(default.block_bits),
    };
    let metadata = pairs(given, "metadata")?;
    if let Some((key, _)) = metadata.iter().find(|(key, _)| is_reserved(key)) {
        return Err(given.refuse("metadata", &format!("the key \"{key}\" is empty or reserved")));
    }
    let (cells, repair) = (given.answer("cellToPoint")?, repair(given)?);
    let to_points = config.cells_to_points(cells, given.answer("meanAcrossRegions")?);
    let labels = labels(given)?;
    let units = pairs(given, "units")?;
    Ok(BuildOptions { config, cells, to_points, labels, repair, units, metadata })
}

fn is_reserved(key: &str) -> bool {
    key.is_empty() || key == RepairLevel::METADATA_KEY || Construction::METADATA_KEYS.contains(&key)
}

/// An object whose members are texts.
fn pairs(given: &Given, name: &str) -> Result<Vec<(String, String)>, ReadError> {
    if !given.has(name) {
        return Ok(Vec::new());
    }
    let refused = || given.refuse(name, "must be an object whose members are texts");
    let pairs = given.members(name).ok_or_else(refused)?.into_iter();
    pairs.map(|(name, text)| Some((name, text.as_string()?))).collect::<Option<_>>().ok_or_else(refused)
}

/// Which fields are labels, and which are not.
fn labels(given: &Given) -> Result<Vec<(String, bool)>, ReadError> {
    if !given.has("labels") {
        return Ok(Vec::new());
    }
    let refused = || given.refuse("labels", "must be an object whose members are true or false");
    let labels = given.members("labels").ok_or_else(refused)?.into_iter();
    labels.map(|(name, is)| Some((name, is.as_bool()?))).collect::<Option<_>>().ok_or_else(refused)
}

/// For all fields, and for one each by its name.
type Precisions = (Option<FieldPrecision>, Vec<(String, FieldPrecision)>);

/// How finely fields are kept: the options `fieldBits` and `fieldTolerance` are for all fields, or objects by name.
fn precision(given: &Given) -> Result<Precisions, ReadError> {
    let (mut of_all, mut of_one) = (None, Vec::new());
    for (option, read) in [("fieldBits", bits as fn(&JsValue) -> _), ("fieldTolerance", tolerance)] {
        let refused = |place: &str, expected: &str| given.refuse(place, &["must be ", expected].concat());
        if let Some(members) = given.members(option) {
            for (name, value) in members {
                let place = || [option, ".", &name].concat();
                let found = read(&value).map_err(|expected| refused(&place(), expected))?;
                of_one.push((name, found));
            }
        } else if let Some(value) = given.member(option) {
            if of_all.is_some() {
                return Err(
                    given.refuse(option, "without names it is for all fields: give this or `fieldBits`")
                );
            }
            of_all = Some(read(&value).map_err(|expected| refused(option, expected))?);
        }
    }
    Ok((of_all, of_one))
}

/// Names of lossless fields, and whether all are.
fn lossless(given: &Given) -> Result<(Vec<String>, bool), ReadError> {
    match given.member("lossless").and_then(|value| value.as_bool()) {
        Some(all) => Ok((Vec::new(), all)),
        None => Ok((given.texts("lossless")?, false)),
    }
}

fn repair(given: &Given) -> Result<RepairLevel, ReadError> {
    let level = given.name("repair", &RepairLevel::ALL.map(|level| (level.name(), level)))?;
    match (level.unwrap_or_default(), given.amount("weldDistance")?) {
        (level, None) => Ok(level),
        (RepairLevel::Weld { .. }, Some(distance)) => Ok(RepairLevel::Weld { distance }),
        _ => Err(given.refuse("weldDistance", "goes with `repair: \"weld\"`")),
    }
}

fn block_bits(given: &Given) -> Result<Option<u32>, ReadError> {
    let Some(value) = given.member("blockUpdates") else { return Ok(None) };
    let found = (4..=16_u32).find(|bits| value.as_f64() == Some(f64::from(1_u32 << bits)));
    let refused = || given.refuse("blockUpdates", "must be a power of two from 16 to 65536");
    found.map(Some).ok_or_else(refused)
}

/// A small number without a fraction.
fn whole(given: &Given, name: &str, range: RangeInclusive<u32>) -> Result<Option<u32>, ReadError> {
    let Some(value) = given.member(name) else { return Ok(None) };
    let refused =
        || given.refuse(name, &format!("must be an integer from {} to {}", range.start(), range.end()));
    range.clone().find(|number| value.as_f64() == Some(f64::from(*number))).map(Some).ok_or_else(refused)
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
