//! Arrays as scalar fields.
//!
//! An array with one component becomes a field of its name. One with several becomes a field for each component,
//! named `name_x` and so on, and `name_magnitude`, the length of the vector.

use std::collections::HashMap;

use crate::error::ReadReason;
use crate::{MemoryLimit, ReadOptions};
use tetralod::mesh::{Field, TetMesh, VectorPart};

/// Most fields of a mesh that are read.
const MAX_FIELDS: usize = 1024;
/// Most names of fields, read or not.
const MAX_NAMES: usize = 1 << 16;

/// Collects the fields of a mesh (or a piece of one) at its points, or at its cells.
#[derive(Default)]
pub(super) struct Collector<'a> {
    /// Names of the fields to keep, as users give them; all if none.
    wanted: Option<&'a [String]>,
    /// Whether the first field of all is wanted, too.
    first: bool,
    /// Whether only names are wanted.
    lists: bool,
    /// What values are counted in.
    memory: MemoryLimit,
    /// Every name that an array has taken, wanted or not, with the last number that was put behind it: what a field is called does
    /// not depend on what is wanted.
    names: HashMap<String, usize>,
    /// How many fields came with the last array.
    last: usize,
    pub fields: Vec<Field>,
    /// The fields that are not wanted, without values.
    pub others: Vec<Field>,
}

/// The fields that an array becomes, without values yet, and how many components it has.
pub(super) struct Claim {
    fields: Vec<Field>,
    components: usize,
    /// Which of the fields are wanted.
    wanted: Vec<bool>,
}

impl<'a> Collector<'a> {
    /// Collects what the options ask for.
    pub fn new(options: &'a ReadOptions) -> Self {
        let none: &[String] = &[];
        let wanted = options.fields.as_deref().or(options.first.then_some(none));
        Self { wanted, first: options.first, memory: options.memory.clone(), ..Self::default() }
    }

    /// Collects fields at cells beside these at points.
    pub fn at_cells(options: &'a ReadOptions, fields: &[Field]) -> Self {
        Self { first: options.first && fields.is_empty(), ..Self::new(options) }
    }

    /// Collects the names of all fields.
    pub fn of_names() -> Self {
        Self { lists: true, ..Self::default() }
    }

    /// Takes the names for the fields of an array of `components` values a point; none if no such field is wanted, so that
    /// the array need not be decoded, nor be right.
    ///
    /// An array without a name is called `field`; a name that is taken gets a number.
    pub fn claim(&mut self, name: &str, components: usize) -> Result<Option<Claim>, ReadReason> {
        if components > 0 && components < MAX_FIELDS {
            let names: Vec<String> = (0..components).map(|c| component_name(components, c)).collect();
            return self.claim_named(name, &names, true);
        }
        self.last = 0;
        if !self.admits(name, components)? {
            return Ok(None);
        }
        let name = self.free_name(if name.is_empty() { "field" } else { name });
        let fields = vec![self.scalar(&name)];
        Ok(self.chosen(fields, components))
    }

    /// Whether there is a field in an array, and not too many where they may be wanted.
    fn admits(&self, name: &str, components: usize) -> Result<bool, ReadReason> {
        let name = if name.is_empty() { "field" } else { name };
        let is_asked_for = self.may_want(name);
        if components == 0 {
            let what = format!("array \"{name}\" has no components");
            return if is_asked_for && !self.lists { Err(ReadReason::Syntax(what)) } else { Ok(false) };
        }
        // Without points a few bytes can claim any number of components.
        let is_wide =
            components >= MAX_FIELDS || self.wanted.is_none() && self.fields.len() + components >= MAX_FIELDS;
        if is_wide && is_asked_for && !self.lists {
            let what = format!(
                "fields and components, with \"{name}\" ({components} components): name those to read"
            );
            return Err(ReadReason::TooLarge { what, limit: MAX_FIELDS as u64 });
        }
        if self.names.len() > MAX_NAMES {
            let what = "fields and components".into();
            return Err(ReadReason::TooLarge { what, limit: MAX_NAMES as u64 });
        }
        Ok(true)
    }

    /// [`Self::claim`] for an array whose components have these names; `has_length` if it is a vector or tensor.
    pub fn claim_named(
        &mut self,
        name: &str,
        of_components: &[String],
        has_length: bool,
    ) -> Result<Option<Claim>, ReadReason> {
        self.last = 0;
        if !self.admits(name, of_components.len())? {
            return Ok(None);
        }
        let name = self.free_name(if name.is_empty() { "field" } else { name });
        let fields = self.parts(&name, of_components, has_length);
        Ok(self.chosen(fields, of_components.len()))
    }

    /// Which of the fields are wanted, if any; the names of others are kept.
    fn chosen(&mut self, fields: Vec<Field>, components: usize) -> Option<Claim> {
        let mut is_first = self.first && self.fields.is_empty();
        let is_wanted = |field: &Field| {
            let is_named = self.wanted.is_none_or(|names| names.iter().any(|name| field.answers_to(name)));
            std::mem::take(&mut is_first) || is_named
        };
        let wanted: Vec<bool> = fields.iter().map(is_wanted).collect();
        let others = fields.iter().zip(&wanted).filter(|(_, wanted)| !**wanted);
        self.others.extend(others.map(|(field, _)| field.clone()));
        wanted.contains(&true).then_some(Claim { fields, components, wanted })
    }

    /// Whether a field of an array of this name may be wanted.
    fn may_want(&self, name: &str) -> bool {
        let is_part = |wanted: &String| {
            wanted.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
        };
        self.wanted.is_none_or(|names| names.iter().any(is_part)) || self.first && self.fields.is_empty()
    }

    fn scalar(&mut self, name: &str) -> Field {
        Field::new(self.take_name(name), Vec::new())
    }

    /// The fields of an array whose components have these names, without values.
    fn parts(&mut self, name: &str, of_components: &[String], has_length: bool) -> Vec<Field> {
        if of_components.len() == 1 {
            return vec![self.scalar(name)];
        }
        // No field has the name of a vector, but the array that is written of it.
        self.take_name(name);
        let part = |component| Some(VectorPart { name: name.to_owned(), component });
        let mut fields = Vec::new();
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
    }

    /// Appends the fields of an array. [`check_finite`] looks at the values when it is known which points are used.
    pub fn fill(
        &mut self,
        claim: Claim,
        values: Vec<f64>,
        integer: bool,
        unit: &str,
    ) -> Result<(), ReadReason> {
        let Claim { mut fields, components, wanted } = claim;
        if let ([field], 1) = (&mut fields[..], components) {
            self.memory.take(8 * values.len() as u64)?;
            self.fields.push(Field { unit: unit.to_owned(), integer, values, ..std::mem::take(field) });
            self.last += 1;
            return Ok(());
        }
        let _held = self.memory.hold(8 * values.len() as u64)?;
        for (c, (mut field, _)) in
            fields.into_iter().zip(wanted).enumerate().filter(|(_, (_, wanted))| *wanted)
        {
            self.memory.take(8 * (values.len() / components) as u64)?;
            field.unit = unit.to_owned();
            field.integer = integer && c < components;
            field.values = if c == components {
                values.chunks_exact(components).map(length).collect()
            } else {
                component_of(&values, c, components)
            };
            self.fields.push(field);
            self.last += 1;
        }
        Ok(())
    }

    /// Leaves the fields that are named alone: where points have a field, that is the first one.
    pub fn drop_first(&mut self) {
        if std::mem::take(&mut self.first) {
            let names = self.wanted.unwrap_or_default();
            self.fields.retain(|field| names.iter().any(|name| field.answers_to(name)));
        }
    }

    /// Appends the fields of an array without their values.
    pub fn keep_names(&mut self, claim: Claim, unit: &str) {
        let before = self.fields.len();
        let wanted = claim.fields.into_iter().zip(claim.wanted).filter(|(_, wanted)| *wanted);
        self.fields.extend(wanted.map(|(field, _)| Field { unit: unit.to_owned(), ..field }));
        self.last = self.fields.len() - before;
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
        self.names.entry(name.clone()).or_insert(1);
        name
    }

    /// The name, or with the first number behind it that makes it free.
    fn free_name(&mut self, name: &str) -> String {
        let Some(mut number) = self.names.get(name).copied() else { return name.to_owned() };
        loop {
            // At most as many numbers are taken as there are names.
            number += 1;
            let numbered = format!("{name}_{number}");
            if !self.names.contains_key(&numbered) {
                self.names.insert(name.to_owned(), number - 1);
                return numbered;
            }
        }
    }
}

/// Checks that fields, and positions, are finite at all points that are used, as `used` says, or at all if it says nothing. It is
/// asked only if there is something that is not finite.
pub(super) fn check_finite(
    positions: &[[f64; 3]],
    fields: &[Field],
    used: &dyn Fn() -> Option<Vec<bool>>,
) -> Result<(), ReadReason> {
    let all_finite = |field: &Field| field.values.iter().all(|value| value.is_finite());
    if positions.as_flattened().iter().all(|x| x.is_finite()) && fields.iter().all(all_finite) {
        return Ok(());
    }
    let used = used();
    let is_used = |point: usize| used.as_ref().is_none_or(|used| used.get(point).is_some_and(|used| *used));
    let is_bad = |(point, place): (usize, &[f64; 3])| !place.iter().all(|x| x.is_finite()) && is_used(point);
    if let Some(point) = positions.iter().enumerate().position(is_bad) {
        return Err(ReadReason::NotFinite { array: String::new(), point: point as u64 });
    }
    first_not_finite(fields, is_used)
        .map_or(Ok(()), |(array, point)| Err(ReadReason::NotFinite { array, point }))
}

/// Checks that fields at cells are finite where `is_used` says so.
pub(super) fn check_finite_cells(
    fields: &[Field],
    is_used: impl Fn(usize) -> bool,
) -> Result<(), ReadReason> {
    first_not_finite(fields, is_used)
        .map_or(Ok(()), |(array, cell)| Err(ReadReason::NotFiniteCell { array, cell }))
}

/// The first array with a value that is not finite though it is used, and where that is.
fn first_not_finite(fields: &[Field], is_used: impl Fn(usize) -> bool) -> Option<(String, u64)> {
    fields.iter().find_map(|field| {
        let at = field.values.iter().enumerate().position(|(at, value)| !value.is_finite() && is_used(at))?;
        let name = field.vector.as_ref().map_or(&field.name, |vector| &vector.name);
        Some((name.clone(), at as u64))
    })
}

/// Puts finite numbers where points that no tetrahedron uses have none: such points are dropped when a mesh is repaired.
pub(super) fn settle_unused(mesh: &mut TetMesh) {
    let place = mesh.positions.iter().copied().find(|place| place.iter().all(|x| x.is_finite()));
    let is_bad = |place: &[f64; 3]| !place.iter().all(|x| x.is_finite());
    mesh.positions.iter_mut().filter(|place| is_bad(place)).for_each(|at| *at = place.unwrap_or_default());
    let values = mesh.fields.iter_mut().flat_map(|field| &mut field.values);
    values.filter(|value| !value.is_finite()).for_each(|value| *value = 0.0);
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
pub(super) fn in_order(values: &[f64], components: usize, order: &[usize]) -> Vec<f64> {
    values.chunks_exact(components).flat_map(|tuple| order.iter().map(|&c| tuple[c])).collect()
}

/// One component of values that have so many each, one value after the other.
pub(super) fn component_of(values: &[f64], component: usize, components: usize) -> Vec<f64> {
    values.chunks_exact(components).map(|tuple| tuple[component]).collect()
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
        if let Some(claim) = to.claim(name, components)? {
            return to.fill(claim, values, true, "m");
        }
        Ok(())
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

    fn options(names: Option<&[&str]>, first: bool) -> ReadOptions {
        let fields = names.map(|names| names.iter().map(|&name| name.to_owned()).collect());
        ReadOptions { fields, first, ..ReadOptions::default() }
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
        let wanted = options(Some(&["v", "w_magnitude", "s_2"]), false);
        let mut some = Collector::new(&wanted);
        append(&mut some, "s", 1, vec![f64::NAN]).unwrap();
        append(&mut some, "v", 2, vec![3.0, 4.0]).unwrap();
        append(&mut some, "w", 2, vec![3.0, 4.0]).unwrap();
        append(&mut some, "s", 1, vec![7.0]).unwrap();
        assert_eq!(names(&some), ["v_x", "v_y", "w_magnitude", "s_2"]);
        let others: Vec<&str> = some.others.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(others, ["s", "v_magnitude", "w_x", "w_y"]);
    }

    #[test]
    fn the_first_field_of_all_is_at_points_where_these_have_one() {
        let first = options(None, true);
        let mut points = Collector::new(&first);
        append(&mut points, "v", 2, vec![3.0, 4.0]).unwrap();
        append(&mut points, "s", 1, vec![3.0]).unwrap();
        assert_eq!(names(&points), ["v_x"]);
        let at_cells =
            |fields: &[Field]| Collector::at_cells(&first, fields).claim("m", 1).unwrap().is_some();
        assert!(at_cells(&[]) && !at_cells(&points.fields));
        let with_label = options(Some(&["s"]), true);
        let mut both = Collector::new(&with_label);
        append(&mut both, "v", 2, vec![3.0, 4.0]).unwrap();
        append(&mut both, "s", 1, vec![3.0]).unwrap();
        assert_eq!(names(&both), ["v_x", "s"]);
        both.drop_first();
        assert_eq!(names(&both), ["s"]);
    }

    #[test]
    fn arrays_that_are_not_wanted_may_be_anything() {
        let wanted = options(Some(&["T"]), false);
        let mut some = Collector::new(&wanted);
        assert!(some.claim("many", 2_000_000_000).unwrap().is_none());
        assert!(some.claim("none", 0).unwrap().is_none());
        assert!(some.claim("T", 1).unwrap().is_some());
        let refused = Collector::default().claim("many", 1100).err().unwrap().to_string();
        assert!(refused.contains("\"many\" (1100 components)"), "{refused}");
        assert!(Collector::default().claim("none", 0).is_err());
        assert_eq!(Collector::of_names().claim("many", 1100).unwrap().unwrap().fields[0].name, "many");
    }

    #[test]
    fn values_that_are_not_finite_name_their_array_and_point() {
        let mut all = Collector::default();
        append(&mut all, "v", 2, vec![0.0, 0.0, 1.0, f64::NAN]).unwrap();
        let check = |used: Option<Vec<bool>>| check_finite(&[], &all.fields, &|| used.clone());
        assert_eq!(check(None), Err(ReadReason::NotFinite { array: "v".into(), point: 1 }));
        assert_eq!(check(Some(vec![true, false])), Ok(()));
        let cells = check_finite_cells(&all.fields, |_| true);
        assert_eq!(cells, Err(ReadReason::NotFiniteCell { array: "v".into(), cell: 1 }));
    }
}
