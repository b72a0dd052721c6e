//! Arrays as scalar fields.
//!
//! An array with one component becomes a field of its name. One with several becomes a field for each component,
//! named `name_x` and so on, and `name_magnitude`, the length of the vector. Of a symmetric tensor [more follows](OF_TENSORS).

use std::collections::HashMap;

use crate::error::ReadReason;
use crate::tensors::{OF_TENSORS, Symmetric};
use crate::{MemoryLimit, ReadOptions};
use tetralod::mesh::{Field, TetMesh, VectorPart, is_number_or_place};

/// Most fields of a mesh that are read.
const MAX_FIELDS: usize = 1024;
/// Most names of fields, read or not.
const MAX_NAMES: usize = 1 << 16;

/// Collects the fields of a mesh (or a piece of one) at its points, or at its cells.
#[derive(Default)]
pub(super) struct Collector<'a> {
    /// Names of the fields to keep, as users give them; all if none.
    wanted: Option<&'a [String]>,
    /// Whether one more field is wanted, that which is shown where none is asked for.
    first: bool,
    /// The name of that field, as far as the arrays that came say: the first that does not number something or say where it is.
    default: Option<String>,
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
        Self { first: options.first && !tell(fields), ..Self::new(options) }
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
        self.make_room(name);
        let name = self.free_name(if name.is_empty() { "field" } else { name });
        let fields = self.parts(&name, of_components, has_length);
        Ok(self.chosen(fields, of_components.len()))
    }

    /// Which of the fields are wanted, if any; the names of others are kept.
    fn chosen(&mut self, fields: Vec<Field>, components: usize) -> Option<Claim> {
        // What is shown of a vector is its length, of a symmetric tensor its equivalent value: what comes behind the components.
        let shown = if fields.len() > components { components } else { 0 };
        let is_better = self.is_better(&fields[shown].name);
        if is_better && let Some(before) = self.default.replace(fields[shown].name.clone()) {
            self.leave(&before);
        }
        let is_wanted =
            |(c, field): (usize, &Field)| self.is_named(field).unwrap_or(true) || is_better && c == shown;
        let wanted: Vec<bool> = fields.iter().enumerate().map(is_wanted).collect();
        let others = fields.iter().zip(&wanted).filter(|(_, wanted)| !**wanted);
        self.others.extend(others.map(|(field, _)| field.clone()));
        wanted.contains(&true).then_some(Claim { fields, components, wanted })
    }

    /// Whether it is named; none if nothing is, since all are wanted.
    fn is_named(&self, field: &Field) -> Option<bool> {
        self.wanted.map(|names| names.iter().any(|name| field.answers_to(name)))
    }

    /// Whether a field of this name is to be shown rather than what came before it, where none is asked for: those that are named all the same
    /// are labels.
    fn is_better(&self, name: &str) -> bool {
        let tells = |name: &str| {
            !is_number_or_place(name) && !self.wanted.unwrap_or_default().iter().any(|label| label == name)
        };
        self.first && self.default.as_ref().is_none_or(|before| !tells(before) && tells(name))
    }

    /// An array has a name that was given to what follows from another one: that goes.
    fn make_room(&mut self, name: &str) {
        let follows = |field: &Field| field.name == name && of_tensor(field).is_some();
        let before = self.fields.len() + self.others.len();
        self.fields.retain(|field| !follows(field));
        self.others.retain(|field| !follows(field));
        if self.fields.len() + self.others.len() < before {
            self.names.remove(name);
            self.default.take_if(|default| default == name);
        }
    }

    /// Forgets the values of a field that is not named.
    fn leave(&mut self, name: &str) {
        let Some(at) = self.fields.iter().position(|field| field.name == name) else { return };
        if self.is_named(&self.fields[at]) == Some(false) {
            let field = self.fields.remove(at);
            self.others.push(field.without_values());
        }
    }

    /// Whether a field of an array of this name may be wanted.
    fn may_want(&self, name: &str) -> bool {
        let is_part = |wanted: &String| {
            wanted.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
        };
        self.wanted.is_none_or(|names| names.iter().any(is_part)) || self.is_better(name)
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
            let count = of_components.len();
            let is_tensor = [6, 9].contains(&count)
                && (0..count).map(|c| component_name(count, c)).eq(of_components.iter().cloned());
            for ending in OF_TENSORS.iter().filter(|_| is_tensor) {
                let own = format!("{name}_{ending}");
                // An array that has this name is what is meant by it.
                if !self.names.contains_key(&own) {
                    let field = Field { vector: part(None), ..Field::new(self.take_name(&own), Vec::new()) };
                    fields.push(field);
                }
            }
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
            let tuples = values.chunks_exact(components);
            field.values = match of_tensor(&field) {
                Some(number) => {
                    tuples.map(|tuple| Symmetric::of(tuple).map_or(f64::NAN, |t| t.value(number))).collect()
                }
                None if c >= components => tuples.map(length).collect(),
                None => component_of(&values, c, components),
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

/// Whether one of the fields does not just number something, or say where it is.
pub(super) fn tell(fields: &[Field]) -> bool {
    fields.iter().any(|field| !is_number_or_place(&field.name))
}

/// The number in [`OF_TENSORS`] of what follows from a tensor; none for other fields.
fn of_tensor(field: &Field) -> Option<usize> {
    let of = field.vector.as_ref().filter(|part| part.component.is_none())?;
    let ending = field.name.strip_prefix(&of.name)?.strip_prefix('_')?;
    OF_TENSORS.iter().position(|known| *known == ending)
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

/// All fields are of this time.
pub(super) fn set_time(mesh: &mut TetMesh, time: Option<f64>) {
    mesh.fields.iter_mut().chain(&mut mesh.cell_fields).for_each(|field| field.time = time);
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
pub(crate) fn component_name(components: usize, c: usize) -> String {
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
    fn where_none_is_asked_for_it_is_at_points_where_these_have_one() {
        let first = options(None, true);
        let mut points = Collector::new(&first);
        append(&mut points, "v", 2, vec![3.0, 4.0]).unwrap();
        append(&mut points, "s", 1, vec![3.0]).unwrap();
        assert_eq!(names(&points), ["v_magnitude"]);
        let at_cells =
            |fields: &[Field]| Collector::at_cells(&first, fields).claim("m", 1).unwrap().is_some();
        assert!(at_cells(&[]) && !at_cells(&points.fields));
        let with_label = options(Some(&["s"]), true);
        let mut both = Collector::new(&with_label);
        append(&mut both, "v", 2, vec![3.0, 4.0]).unwrap();
        append(&mut both, "s", 1, vec![3.0]).unwrap();
        assert_eq!(names(&both), ["v_magnitude", "s"]);
        both.drop_first();
        assert_eq!(names(&both), ["s"]);
    }

    #[test]
    fn where_none_is_asked_for_it_is_the_first_that_numbers_nothing() {
        let shown = |named: &[&str]| {
            let options = options(Some(named), true);
            let mut points = Collector::new(&options);
            for name in ["point_id", "material", "p", "T"] {
                append(&mut points, name, 1, vec![3.0]).unwrap();
            }
            names(&points).join(" ")
        };
        assert_eq!(shown(&[]), "p");
        assert_eq!(shown(&["material"]), "material p");
        // What is named beside it are labels, whatever they are called.
        assert_eq!(shown(&["p"]), "p T");
        let first = options(None, true);
        let mut numbers = Collector::new(&first);
        append(&mut numbers, "node_id", 1, vec![1.0]).unwrap();
        append(&mut numbers, "material", 1, vec![2.0]).unwrap();
        assert_eq!((names(&numbers), numbers.others[0].name.as_str()), (vec!["node_id"], "material"));
    }

    #[test]
    fn what_follows_from_a_tensor_is_made_where_it_is_named() {
        let uniaxial = vec![-5.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let kept = |options: &ReadOptions| {
            let mut fields = Collector::new(options);
            append(&mut fields, "S", 6, uniaxial.clone()).unwrap();
            (names(&fields).join(" "), fields.fields.iter().map(|field| field.values[0]).collect::<Vec<_>>())
        };
        let all =
            "S_xx S_yy S_zz S_xy S_yz S_xz S_von_mises S_principal_1 S_principal_2 S_principal_3 S_magnitude";
        assert_eq!(kept(&ReadOptions::default()).0, all);
        assert_eq!(kept(&options(None, true)), ("S_von_mises".into(), vec![5.0]));
        assert_eq!(kept(&options(Some(&["S_principal_3", "S_yy"]), false)).1, [0.0, -5.0]);
        // An array that has such a name is what is meant by it, wherever it stands.
        for before in [true, false] {
            for options in [options(Some(&["S_von_mises", "S_principal_1"]), false), options(None, true)] {
                let mut fields = Collector::new(&options);
                let arrays = [("S", 6, uniaxial.clone()), ("S_von_mises", 1, vec![7.0])];
                let order = if before { [1, 0] } else { [0, 1] };
                for (name, components, values) in order.map(|i| arrays[i].clone()) {
                    append(&mut fields, name, components, values).unwrap();
                }
                let found = fields.fields.iter().find(|field| field.name == "S_von_mises").unwrap();
                assert_eq!(found.values, [7.0]);
                assert_eq!(fields.fields.len(), if options.first { 1 } else { 2 });
            }
        }
        let mut known = Collector::of_names();
        let claim = known.claim("S", 9).unwrap().unwrap();
        known.keep_names(claim, "Pa");
        assert_eq!(known.fields.len(), 9 + 1 + 4);
        assert_eq!(known.fields[10].name, "S_principal_1");
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
