//! The extremes of fields, and what averaging from cells has done, for people.

use super::output;
use tetralod::mesh::{Difference, Extreme, Extremes};
use tetralod::mt::{AveragedField, MtInfo};

/// A value with its place; `range` and `size` are the ranges of values and places, whose numbers get digits that tell them apart.
pub fn value(Extreme { value, place, cell, part }: &Extreme, range: f64, size: f64) -> String {
    let [x, y, z] = place.map(|x| output::within(x, 1e-4 * size));
    let value = output::within(*value, 1e-4 * range);
    let cell = cell.map(|cell| format!(" in cell {cell}")).unwrap_or_default();
    let part = part.as_ref().map(|part| format!(" of {part}")).unwrap_or_default();
    format!("{value}{cell}{part} at ({x}, {y}, {z})")
}

/// Both extremes of a field.
fn ends(extremes: &Extremes, size: f64) -> String {
    let range = extremes.max.value - extremes.min.value;
    let [min, max] = extremes.both().map(|extreme| value(extreme, range, size));
    format!("{min} to {max}")
}

/// What averaging has done to a field: what its values at cells are, and how far those at points are from them, or how much of cells has
/// another label.
pub fn averaged_rows(
    is_label: bool,
    input: &Extremes,
    difference: &Difference,
    size: f64,
) -> [(&'static str, String); 2] {
    let number = if is_label { output::percent } else { output::number };
    let [rms, largest] = [difference.rms, difference.largest].map(number);
    let of = if is_label { " of a cell" } else { "" };
    [
        ("  input at cells", ends(input, size)),
        (
            if is_label { "  another label" } else { "  difference" },
            format!("root mean square {rms}, {largest} at most{of}"),
        ),
    ]
}

/// What averaging has done to the fields of a build.
pub fn rows(fields: &[AveragedField], size: f64) -> Vec<(&'static str, String)> {
    let of = |field: &AveragedField| {
        let AveragedField { name, unit, time, is_label, input, points, difference } = field;
        let unit = if unit.is_empty() { String::new() } else { format!(" in {unit}") };
        let time = time.map(|time| format!(", time {}", output::exact(time))).unwrap_or_default();
        let head =
            [("averaged from cells", format!("{name}{unit}{time}")), ("  at points", ends(points, size))];
        head.into_iter().chain(averaged_rows(*is_label, input, difference, size))
    };
    fields.iter().flat_map(of).collect()
}

/// The size of a model, as [`value`] takes it.
pub fn size(info: &MtInfo) -> f64 {
    info.model_bounds().map_or(0.0, |bounds| bounds.diagonal())
}
