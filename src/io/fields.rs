//! Arrays as scalar fields.
//!
//! An array with one component becomes a field of its name. One with several becomes a field for each component,
//! named `name_x` and so on, and `name_magnitude`, the length of the vector.

use crate::io::error::ReadReason;
use crate::mesh::{Field, VectorPart};

/// Most fields of a mesh.
const MAX_FIELDS: usize = 1024;

/// Collects the fields of a mesh (or a piece of one) at its points, or at its cells.
#[derive(Default)]
pub(super) struct Collector<'a> {
    /// Names of the fields to keep, as users give them; all if none.
    wanted: Option<&'a [String]>,
    /// Every name that an array has taken, wanted or not: what a field is called does not depend on what is wanted.
    names: Vec<String>,
    /// Those of vectors and tensors, which no field has, but the array that is written of them.
    vectors: Vec<String>,
    /// How many fields came with the last array.
    last: usize,
    pub fields: Vec<Field>,
}

/// The fields that an array becomes, without values yet, and how many components it has.
pub(super) struct Claim {
    fields: Vec<Field>,
    components: usize,
    /// Which of the fields are wanted.
    wanted: Vec<bool>,
}

impl<'a> Collector<'a> {
    pub fn new(wanted: Option<&'a [String]>) -> Self {
        Self { wanted, ..Self::default() }
    }

    /// Takes the names for the fields of an array of `components` values a point; none if no such field is wanted, so that
    /// the array need not be decoded.
    ///
    /// An array without a name is called `field`; a name that is taken gets a number.
    pub fn claim(&mut self, name: &str, components: usize) -> Result<Option<Claim>, ReadReason> {
        self.check_room(components)?;
        let names: Vec<String> = (0..components).map(|c| component_name(components, c)).collect();
        self.claim_named(name, &names, true)
    }

    /// Without points a few bytes can claim any number of components.
    fn check_room(&self, components: usize) -> Result<(), ReadReason> {
        if components == 0 {
            return Err(ReadReason::Syntax("an array without components".into()));
        }
        if self.names.len().saturating_add(components) >= MAX_FIELDS {
            let what = "fields and components".into();
            return Err(ReadReason::TooLarge { what, limit: MAX_FIELDS as u64 });
        }
        Ok(())
    }

    /// The same for an array whose components have these names; `has_length` if it is a vector or tensor.
    pub fn claim_named(
        &mut self,
        name: &str,
        of_components: &[String],
        has_length: bool,
    ) -> Result<Option<Claim>, ReadReason> {
        let components = of_components.len();
        self.check_room(components)?;
        self.last = 0;
        let name = self.free_name(if name.is_empty() { "field" } else { name });
        let part = |component| Some(VectorPart { name: name.clone(), component });
        let fields: Vec<Field> = if components == 1 {
            vec![Field::new(self.take_name(&name), Vec::new())]
        } else {
            let mut fields = Vec::new();
            self.vectors.push(name.clone());
            for (c, of_component) in of_components.iter().enumerate() {
                let own = self.take_name(&format!("{name}_{of_component}"));
                // The number of a component is a byte.
                let vector = u8::try_from(c).ok().and_then(|c| part(Some(c)));
                fields.push(Field { vector, ..Field::new(own, Vec::new()) });
            }
            if has_length {
                let own = self.take_name(&format!("{name}_magnitude"));
                fields.push(Field { vector: part(None), ..Field::new(own, Vec::new()) });
            }
            fields
        };
        let is_wanted =
            |field: &Field| self.wanted.is_none_or(|names| names.iter().any(|name| field.answers_to(name)));
        let wanted: Vec<bool> = fields.iter().map(is_wanted).collect();
        Ok(wanted.contains(&true).then_some(Claim { fields, components, wanted }))
    }

    /// Appends the fields of an array, checking that all values are finite.
    pub fn fill(
        &mut self,
        claim: Claim,
        values: Vec<f64>,
        integer: bool,
        unit: &str,
    ) -> Result<(), ReadReason> {
        let Claim { fields, components, wanted } = claim;
        let at = |at: usize| Err(ReadReason::NotFinite { point: at as u64 });
        if let Some(found) = values.iter().position(|v| !v.is_finite()) {
            return at(found / components);
        }
        for (c, (mut field, _)) in
            fields.into_iter().zip(wanted).enumerate().filter(|(_, (_, wanted))| *wanted)
        {
            field.unit = unit.to_owned();
            field.integer = integer && c < components;
            field.values = if c == components {
                values.chunks_exact(components).map(length).collect()
            } else {
                // Tuples lie one behind the other; this component starts at its own place in the first.
                values.iter().skip(c).step_by(components).copied().collect()
            };
            if let Some(found) = field.values.iter().position(|v| !v.is_finite()) {
                return at(found);
            }
            self.fields.push(field);
            self.last += 1;
        }
        Ok(())
    }

    /// Appends the fields of an array without their values.
    pub fn keep_names(&mut self, claim: Claim, unit: &str) {
        self.last = claim.fields.len();
        self.fields.extend(claim.fields.into_iter().map(|field| Field { unit: unit.to_owned(), ..field }));
    }

    /// Sets the unit of the array that came last.
    pub fn set_unit_of_last(&mut self, unit: &str) {
        self.fields.iter_mut().rev().take(self.last).for_each(|field| field.unit = unit.to_owned());
        self.last = 0;
    }

    /// What comes next does not belong to the last array.
    pub fn forget_last(&mut self) {
        self.last = 0;
    }

    fn take_name(&mut self, name: &str) -> String {
        let name = self.free_name(name);
        self.names.push(name.clone());
        name
    }

    fn free_name(&self, name: &str) -> String {
        let taken = |name: &str| self.names.iter().chain(&self.vectors).any(|n| n == name);
        if !taken(name) {
            return name.to_owned();
        }
        // One more number than there are names: one is free.
        (2..self.names.len() + self.vectors.len() + 3)
            .map(|i| format!("{name}_{i}"))
            .find(|n| !taken(n))
            .unwrap_or_else(|| name.to_owned())
    }
}

/// Length of a vector, without overflow on the way.
fn length(vector: &[f64]) -> f64 {
    let largest = vector.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    largest * vector.iter().map(|x| (x / largest) * (x / largest)).sum::<f64>().sqrt()
}

/// Some components of values that have so many each, in this order.
#[cfg(feature = "formats")]
pub(super) fn in_order(values: &[f64], components: usize, order: &[usize]) -> Vec<f64> {
    values.chunks_exact(components).flat_map(|tuple| order.iter().map(|&c| tuple[c])).collect()
}

/// One component of values that have so many each, one value after the other.
pub(super) fn component_of(values: &[f64], component: usize, components: usize) -> Vec<f64> {
    values.iter().skip(component).step_by(components).copied().collect()
}

/// What a component of so many is called.
pub(super) fn component_name(components: usize, c: usize) -> String {
    const AXES: [&str; 3] = ["x", "y", "z"];
    const SYMMETRIC: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];
    match components {
        2 | 3 => AXES[c].into(),
        6 => SYMMETRIC[c].into(),
        9 => format!("{}{}", AXES[c / 3], AXES[c % 3]),
        _ => c.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn append(
        to: &mut Collector<'_>,
        name: &str,
        components: usize,
        values: Vec<f64>,
    ) -> Result<(), ReadReason> {
        match to.claim(name, components)? {
            Some(claim) => to.fill(claim, values, true, "m"),
            None => Ok(()),
        }
    }

    fn names<'a>(of: &'a Collector<'_>) -> Vec<&'a str> {
        of.fields.iter().map(|f| f.name.as_str()).collect()
    }

    #[test]
    fn vectors_become_components_and_magnitude() {
        let mut all = Collector::default();
        append(&mut all, "v", 3, vec![3.0, 4.0, 12.0, 0.0, 0.0, 0.0]).unwrap();
        assert_eq!(names(&all), ["v_x", "v_y", "v_z", "v_magnitude"]);
        assert_eq!(all.fields[1].values, [4.0, 0.0]);
        assert_eq!(all.fields[3].values, [13.0, 0.0]);
        assert_eq!(all.fields[2].vector, Some(VectorPart { name: "v".into(), component: Some(2) }));
        assert_eq!((all.fields[2].integer, all.fields[3].integer), (true, false));
        assert!(all.fields.iter().all(|field| field.unit == "m"));
    }

    #[test]
    fn names_stay_different() {
        let mut all = Collector::default();
        for _ in 0..3 {
            append(&mut all, "", 1, vec![0.0]).unwrap();
        }
        assert_eq!(names(&all), ["field", "field_2", "field_3"]);
    }

    #[test]
    fn no_two_arrays_have_one_name() {
        let mut all = Collector::default();
        append(&mut all, "v", 2, vec![3.0, 4.0]).unwrap();
        append(&mut all, "v", 2, vec![3.0, 4.0]).unwrap();
        append(&mut all, "v", 1, vec![1.0]).unwrap();
        assert_eq!(names(&all), ["v_x", "v_y", "v_magnitude", "v_2_x", "v_2_y", "v_2_magnitude", "v_3"]);
        assert_eq!(all.fields[3].vector, Some(VectorPart { name: "v_2".into(), component: Some(0) }));
    }

    #[test]
    fn what_is_not_wanted_is_left_out_and_changes_no_name() {
        let wanted = ["v".to_owned(), "w_magnitude".to_owned(), "s_2".to_owned()];
        let mut some = Collector::new(Some(&wanted));
        append(&mut some, "s", 1, vec![f64::NAN]).unwrap();
        append(&mut some, "v", 2, vec![3.0, 4.0]).unwrap();
        append(&mut some, "w", 2, vec![3.0, 4.0]).unwrap();
        append(&mut some, "s", 1, vec![7.0]).unwrap();
        assert_eq!(names(&some), ["v_x", "v_y", "w_magnitude", "s_2"]);
    }

    #[test]
    fn values_that_are_not_finite_name_their_point() {
        let error = append(&mut Collector::default(), "v", 2, vec![0.0, 0.0, 1.0, f64::NAN]).unwrap_err();
        assert_eq!(error, ReadReason::NotFinite { point: 1 });
    }
}
