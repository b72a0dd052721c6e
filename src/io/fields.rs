//! Point arrays as scalar fields.
//!
//! An array with one component becomes a field of its name. One with several becomes a field for each component,
//! named `name_x` and so on, and `name_magnitude`, the length of the vector.

use crate::io::error::ReadReason;
use crate::mesh::Field;

/// Most fields of a mesh.
const MAX_FIELDS: usize = 1024;

/// Appends the fields of an array of `components` values a point, checking that all are finite.
///
/// An array without a name is called `field`; a name that is taken gets a number.
pub(super) fn append(
    fields: &mut Vec<Field>,
    name: &str,
    components: usize,
    values: Vec<f64>,
) -> Result<(), ReadReason> {
    if components == 0 {
        return Err(ReadReason::Syntax("an array without components".into()));
    }
    // Without points a few bytes can claim any number of components.
    if fields.len().saturating_add(components) >= MAX_FIELDS {
        return Err(ReadReason::TooLarge { what: "fields and components".into(), limit: MAX_FIELDS as u64 });
    }
    if let Some(at) = values.iter().position(|v| !v.is_finite()) {
        return Err(ReadReason::NotFinite { point: (at / components) as u64 });
    }
    let name = free_name(fields, if name.is_empty() { "field" } else { name });
    if components == 1 {
        fields.push(Field { name, values });
        return Ok(());
    }
    for c in 0..components {
        // Tuples lie one behind the other; this component starts at its own place in the first.
        let values = values.iter().skip(c).step_by(components).copied().collect();
        let name = format!("{name}_{}", component_name(components, c));
        fields.push(Field { name: free_name(fields, &name), values });
    }
    let values: Vec<f64> = values.chunks_exact(components).map(length).collect();
    if let Some(at) = values.iter().position(|v| !v.is_finite()) {
        return Err(ReadReason::NotFinite { point: at as u64 });
    }
    fields.push(Field { name: free_name(fields, &format!("{name}_magnitude")), values });
    Ok(())
}

/// Length of a vector, without overflow on the way.
fn length(vector: &[f64]) -> f64 {
    let largest = vector.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    largest * vector.iter().map(|x| (x / largest) * (x / largest)).sum::<f64>().sqrt()
}

fn component_name(components: usize, c: usize) -> String {
    const AXES: [&str; 3] = ["x", "y", "z"];
    const SYMMETRIC: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];
    match components {
        2 | 3 => AXES[c].into(),
        6 => SYMMETRIC[c].into(),
        9 => format!("{}{}", AXES[c / 3], AXES[c % 3]),
        _ => c.to_string(),
    }
}

fn free_name(fields: &[Field], name: &str) -> String {
    let taken = |name: &str| fields.iter().any(|f| f.name == name);
    if !taken(name) {
        return name.to_owned();
    }
    // One of the first `len + 1` numbers is free.
    (2..fields.len() + 3)
        .map(|i| format!("{name}_{i}"))
        .find(|n| !taken(n))
        .unwrap_or_else(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_become_components_and_magnitude() {
        let mut fields = Vec::new();
        append(&mut fields, "v", 3, vec![3.0, 4.0, 12.0, 0.0, 0.0, 0.0]).unwrap();
        let names: Vec<&str> = fields.iter().map(|f| f.name.as_str()).collect();
        assert_eq!(names, ["v_x", "v_y", "v_z", "v_magnitude"]);
        assert_eq!(fields[1].values, [4.0, 0.0]);
        assert_eq!(fields[3].values, [13.0, 0.0]);
    }

    #[test]
    fn names_stay_different() {
        let mut fields = Vec::new();
        for _ in 0..3 {
            append(&mut fields, "", 1, vec![0.0]).unwrap();
        }
        let names: Vec<&str> = fields.iter().map(|f| f.name.as_str()).collect();
        assert_eq!(names, ["field", "field_2", "field_3"]);
    }

    #[test]
    fn values_that_are_not_finite_name_their_point() {
        let error = append(&mut Vec::new(), "v", 2, vec![0.0, 0.0, 1.0, f64::NAN]).unwrap_err();
        assert_eq!(error, ReadReason::NotFinite { point: 1 });
    }
}
