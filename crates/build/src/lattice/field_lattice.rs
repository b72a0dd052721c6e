//! The lattices of the fields: as coarse as the configuration allows.

use crate::lattice::position_lattice::is_ordinary;
use crate::{BuildConfig, BuildError, FieldPrecision};
use tetralod::mesh::{Extremes, Field, TetMesh};
use tetralod::mt::{FieldInfo, MAX_FIELD_BITS, MtKind};

/// Largest integer up to which `f64` holds all.
const MAX_EXACT_INTEGER: f64 = 9_007_199_254_740_992.0;

/// The lattice of each field; the time steps of a field, which follow one another, share one.
pub(crate) fn field_lattices(fields: &[&Field], config: &BuildConfig) -> Result<Vec<FieldInfo>, BuildError> {
    let mut infos = Vec::with_capacity(fields.len());
    let is_edge = config.construction.kind() == MtKind::Edge;
    if let Some(label) = fields.iter().find(|field| field.is_label && is_edge) {
        return Err(BuildError::LabelOfEdges { name: label.name.clone() });
    }
    for steps in fields.chunk_by(|a, b| a.name == b.name) {
        let shared = shared_lattice(steps, config)?;
        if !is_ordinary(shared.origin, shared.step, shared.bits) {
            let field = Some(shared.name);
            return Err(BuildError::Scale { field, step: shared.step, origin: shared.origin });
        }
        for &field in steps {
            infos.push(FieldInfo {
                unit: field.unit.clone(),
                vector: field.vector.clone(),
                is_label: steps[0].is_label,
                time: field.time,
                quantization: largest_loss(&shared, field),
                averaged: field.averaged.clone(),
                ..shared.clone()
            });
        }
    }
    Ok(infos)
}

/// Notes the extremes of each field, whose points are at these places, those in further regions last.
pub(crate) fn set_extremes<I: Iterator<Item = [f64; 3]>>(
    infos: &mut [FieldInfo],
    fields: &[&Field],
    places: impl Fn() -> I,
) {
    for (info, field) in infos.iter_mut().zip(fields) {
        info.extremes = Extremes::of(field.all_values().copied().zip(places()));
    }
}

fn shared_lattice(steps: &[&Field], config: &BuildConfig) -> Result<FieldInfo, BuildError> {
    let values = steps.iter().flat_map(|field| field.all_values());
    let (min, max) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)));
    let field = steps[0];
    let named = config.precision_of.iter().find(|(name, _)| field.answers_to(name));
    if !(max - min).is_finite() {
        return Err(BuildError::WideRange { field: field.name.clone() });
    }
    let exact = integer_lattice(steps, min, max).filter(|_| named.is_none());
    if steps.iter().any(|field| field.is_label) {
        return exact.ok_or_else(|| no_labels(steps, named.is_some()));
    }
    if let Some(exact) = exact {
        return Ok(exact);
    }
    let range = if max > min { max - min } else { 1.0 };
    let lattice = |bits: u32| FieldInfo {
        name: field.name.clone(),
        min,
        max,
        origin: min,
        // A range of subnormal size has no smaller step; it is refused.
        step: (range / f64::from((1_u32 << bits) - 1)).max(f64::from_bits(1)),
        bits,
        ..FieldInfo::default()
    };
    let tolerance = match named.map_or(config.field_precision, |(_, precision)| *precision) {
        FieldPrecision::Bits(bits) if (1..=MAX_FIELD_BITS).contains(&bits) => return Ok(lattice(bits)),
        FieldPrecision::Bits(_) => {
            return Err(BuildError::Option { name: "field-bits", expected: "1 to 24" });
        }
        FieldPrecision::Units(units) => units,
        FieldPrecision::Fraction(fraction) => fraction * range,
    };
    if tolerance.is_nan() || tolerance < 0.0 {
        return Err(BuildError::Option { name: "field-tolerance", expected: "a number of at least 0" });
    }
    let keeps = |info: &FieldInfo| {
        steps.iter().flat_map(|field| field.all_values()).all(|&value| loss(info, value) <= tolerance)
    };
    (1..=MAX_FIELD_BITS).map(lattice).find(keeps).ok_or_else(|| {
        let finest = lattice(MAX_FIELD_BITS);
        let reached = steps.iter().map(|field| largest_loss(&finest, field)).fold(0.0, f64::max);
        BuildError::Tolerance { field: Some(field.name.clone()), reached }
    })
}

/// A lattice of step 1 that holds every value of a field of integers, if there is one.
fn integer_lattice(steps: &[&Field], min: f64, max: f64) -> Option<FieldInfo> {
    let bits = (1..=MAX_FIELD_BITS).find(|&bits| max - min < f64::from(1_u32 << bits))?;
    let is_integer = |field: &&Field| field.integer || field.is_label;
    let all = steps.iter().all(|field| is_integer(field) && field.all_values().all(is_exact_integer));
    let name = steps[0].name.clone();
    all.then(|| FieldInfo { name, min, max, origin: min, step: 1.0, bits, ..FieldInfo::default() })
}

/// Why fields cannot be labels.
fn no_labels(steps: &[&Field], has_precision: bool) -> BuildError {
    let name = steps[0].name.clone();
    let values = steps.iter().flat_map(|field| (0..).zip(&field.values));
    match values.into_iter().find(|(_, value)| !is_exact_integer(value)) {
        Some((at, &value)) => BuildError::Label { name, at, value },
        None if has_precision => BuildError::LabelPrecision { name },
        None => BuildError::LabelRange { name },
    }
}

/// Says which fields of a mesh, at points and at cells, are [labels](Field::is_label): those that `given` says are, or are not, by their names;
/// of others those that are integers of few values by a name that says so, unless [`BuildConfig::precision_of`] names them or the MT is an edge MT,
/// which has points between those of the mesh.
///
/// # Errors
/// If there is no field of a name.
pub fn mark_labels(
    mesh: &mut TetMesh,
    given: &[(String, bool)],
    config: &BuildConfig,
) -> Result<(), BuildError> {
    let by_rule = config.construction.kind() != MtKind::Edge;
    if let Err(name) = mesh.mark_labels(given, by_rule) {
        let fields = mesh.fields.iter().chain(&mesh.cell_fields);
        let known = fields.map(|field| field.name.clone()).collect();
        return Err(BuildError::UnknownLabel { name: name.to_owned(), known });
    }
    let is_given = |field: &Field| given.iter().any(|(name, _)| field.answers_to(name));
    let is_precise = |field: &Field| config.precision_of.iter().any(|(name, _)| field.answers_to(name));
    let fields = mesh.fields.iter_mut().chain(&mut mesh.cell_fields);
    fields.filter(|field| !is_given(field) && is_precise(field)).for_each(|field| field.is_label = false);
    Ok(())
}

/// Whether a configuration asks for lattices as coarse as a tolerance allows.
pub(crate) fn has_tolerance(config: &BuildConfig) -> bool {
    let given = config.precision_of.iter().map(|(_, precision)| precision).chain([&config.field_precision]);
    given.into_iter().any(|precision| !matches!(precision, FieldPrecision::Bits(_)))
}

/// Whether a value is an integer that doubles tell from its neighbours.
pub(crate) fn is_exact_integer(x: &f64) -> bool {
    x.fract() == 0.0 && x.abs() <= MAX_EXACT_INTEGER
}

/// How far the lattice moves a value, rounded up.
pub(crate) fn loss(info: &FieldInfo, value: f64) -> f64 {
    let away = (info.value(info.nearest(value)) - value).abs();
    if away == 0.0 { 0.0 } else { away.next_up() }
}

fn largest_loss(info: &FieldInfo, field: &Field) -> f64 {
    field.all_values().map(|&value| loss(info, value)).fold(0.0, f64::max)
}
