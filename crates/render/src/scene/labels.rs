//! What is shown of labels: surfaces in parts of one colour each, tetrahedra in one colour, and what cannot be shown of them.

use super::SceneError;
use super::error::Result;
use super::input::Input;
use std::collections::BTreeSet;
use tetralod::mesh::NONE;
use tetralod::view::{LabelParts, Triangles, label_value, region_scale};

/// The parts of a surface that a label colours, with the values that its colours have; `places` says where the vertices are.
pub(super) fn parts(
    surface: &Triangles<'_>,
    places: &[([u32; 2], f64)],
    input: &Input<'_>,
    field: usize,
) -> LabelParts {
    let mut parts = LabelParts::of(surface, places, &(input.fields)(field));
    let least = least(input, field);
    parts.labels.iter_mut().for_each(|label| *label = label_value(*label, least));
    parts
}

/// The values that the colours of tetrahedra have: of each that of its most frequent corner, of several the smallest.
pub(super) fn of_tets(input: &Input<'_>, field: usize) -> Vec<f64> {
    let (labels, least) = ((input.fields)(field), least(input, field));
    let of = |tet: &[u32; 4]| {
        if tet[0] == NONE {
            return 0.0;
        }
        label_value(most_frequent(tet.map(|v| labels[v as usize])), least)
    };
    input.mesh.tets.iter().map(of).collect()
}

/// The number that is there most often, the smallest of several.
fn most_frequent(mut all: [f64; 4]) -> f64 {
    all.sort_by(f64::total_cmp);
    let count = |x: f64| all.iter().filter(|other| **other == x).count();
    all.into_iter()
        .reduce(|best, next| if count(next) > count(best) { next } else { best })
        .unwrap_or_default()
}

/// The labels that the mesh has, ascending, with their colours in sRGB.
pub(super) fn present(input: &Input<'_>, field: usize) -> Vec<(f64, [u8; 3])> {
    let (labels, least) = ((input.fields)(field), least(input, field));
    let points = input.mesh.tets.iter().filter(|tet| tet[0] != NONE).flatten();
    // Labels are whole numbers of less than 2^53.
    let found: BTreeSet<i64> = points.map(|&v| labels[v as usize] as i64).collect();
    let scale = region_scale();
    let colour = |label: f64| scale.colour(label_value(label, least)).map(|c| (255.0 * c).round() as u8);
    found.into_iter().map(|label| (label as f64, colour(label as f64))).collect()
}

/// The least label of all time steps.
fn least(input: &Input<'_>, field: usize) -> f64 {
    input.info.range_at_all_times(field)[0]
}

/// Refuses what labels do not have: values between two of them, and differences.
pub(super) fn check(input: &Input<'_>) -> Result<()> {
    let state = input.state;
    let label = |field: usize| Some(&input.info.fields[field]).filter(|field| field.is_label);
    let refuse = |what: &str, name: &str, problem: &str| {
        Err(SceneError::state(what, format!("'{name}' is a label: {problem}")))
    };
    if let Some(field) = label(input.shown) {
        let others = "show the boundary, slices, cells, or a threshold of it";
        let between = format!("between two labels there is no value, so {others}");
        if !state.isosurfaces.is_empty() {
            return refuse("isosurfaces", &field.name, &between);
        }
        if state.volume.is_some() {
            return refuse("volume", &field.name, &between);
        }
        if state.compare.is_some_and(|compare| compare.difference) {
            return refuse(
                "compare.difference",
                &field.name,
                "labels have no difference; compare side by side",
            );
        }
    }
    let along = [
        ("streamlines.field", state.streamlines.as_ref().and_then(|lines| lines.field.as_ref())),
        ("arrows.field", state.arrows.as_ref().and_then(|arrows| arrows.field.as_ref())),
    ];
    for (what, name) in along {
        let Some(field) = name.map(|name| input.field(what, Some(name))).transpose()?.and_then(label) else {
            continue;
        };
        return refuse(what, &field.name, "colour by a field that has values between");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::most_frequent;

    #[test]
    fn a_tetrahedron_has_the_label_of_most_of_its_corners() {
        assert_eq!(most_frequent([7.0, 3.0, 7.0, 1.0]), 7.0);
        assert_eq!(most_frequent([7.0, 3.0, 7.0, 3.0]), 3.0);
        assert_eq!(most_frequent([4.0, 3.0, 2.0, 1.0]), 1.0);
        assert_eq!(most_frequent([5.0; 4]), 5.0);
    }
}
