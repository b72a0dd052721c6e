//! Scalar fields at points or cells of a mesh.

use crate::mesh::Averaged;
use serde::Serialize;
use std::collections::BTreeSet;

/// Most different values of a field that is a label though nobody says so.
pub const MOST_LABELS: usize = 256;

/// A scalar field with one value per point (or per tetrahedron), and what is known of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Field {
    /// The field's name in the file it came from. Only the time steps of one field share a name.
    pub name: String,
    /// One value per point, in the order of [`TetMesh::positions`](crate::mesh::TetMesh::positions); of fields at cells, one per tetrahedron.
    pub values: Vec<f64>,
    /// Where it jumps between regions, its values at the points in further regions, in the order of
    /// [`TetMesh::sides`](crate::mesh::TetMesh::sides); empty if it does not.
    pub sides: Vec<f64>,
    /// The unit of the values; empty if it is not known.
    pub unit: String,
    /// Set when the field is a part of a vector or tensor.
    pub vector: Option<VectorPart>,
    /// The time that the values are of.
    pub time: Option<f64>,
    /// Whether the values are integers by the type that the file gave them.
    pub integer: bool,
    /// Whether it is a label: whole numbers that say what something is, as materials or clusters are numbered, so that there is nothing between
    /// two of them. What is at a place is the label of the nearest corner, not what is linear between the corners. Readers leave it to
    /// [`TetMesh::mark_labels`](crate::mesh::TetMesh::mark_labels).
    pub is_label: bool,
    /// What averaging has done to it, if the input has its values at cells.
    pub averaged: Option<Averaged>,
}

impl Field {
    /// A field of which no more is known.
    pub fn new(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self { name: name.into(), values, ..Self::default() }
    }

    /// What is known of it, but for its values.
    #[doc(hidden)]
    pub fn without_values(&self) -> Self {
        let Self { name, unit, vector, time, integer, is_label, averaged, .. } = self;
        let (name, unit, vector) = (name.clone(), unit.clone(), vector.clone());
        Self {
            name,
            values: Vec::new(),
            sides: Vec::new(),
            unit,
            vector,
            time: *time,
            integer: *integer,
            is_label: *is_label,
            averaged: averaged.clone(),
        }
    }

    /// The values at all points and, where it jumps, in all of their regions.
    #[doc(hidden)]
    pub fn all_values(&self) -> impl Iterator<Item = &f64> {
        self.values.iter().chain(&self.sides)
    }

    /// Whether it is a label where nobody says so: it is no part of a vector, its values are integers by their type, no more than
    /// [`MOST_LABELS`] different ones and all closer to 0 than 2^23, and its name says that they number something, as `material` does.
    pub fn is_label_by_rule(&self) -> bool {
        const END: f64 = (1 << 23) as f64;
        self.integer && self.vector.is_none() && has_word(&self.name, &NUMBERS) && {
            let mut known = BTreeSet::new();
            let mut last = None;
            self.values.iter().all(|&value| {
                let is_new = last.replace(value) != Some(value) && known.insert(value as i64);
                value.fract() == 0.0 && value.abs() < END && (!is_new || known.len() <= MOST_LABELS)
            })
        }
    }

    /// Whether a user who asks for `name` means this field: it has this name, or it is a component (not the length) of
    /// the vector of this name.
    pub fn answers_to(&self, name: &str) -> bool {
        self.name == name || self.vector.as_ref().is_some_and(|v| v.name == name && v.component.is_some())
    }
}

/// Which part of a vector or tensor a scalar field is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct VectorPart {
    /// The vector's name.
    pub name: String,
    /// The component, from 0; none for what follows from the components: the vector's length; von Mises' equivalent and the principal values of a
    /// symmetric tensor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub component: Option<u8>,
}

/// Where among fields that one is which is kept where none is asked for: the first that is no label, does not number something or say where
/// it is, and is no component; else the first.
pub fn default_field(fields: &[Field], labels: &[String]) -> Option<usize> {
    let tells =
        |field: &Field| !field.is_label && !is_number_or_place(&field.name) && !labels.contains(&field.name);
    let is_whole = |field: &Field| field.vector.as_ref().is_none_or(|part| part.component.is_none());
    let first = |wanted: &dyn Fn(&Field) -> bool| fields.iter().position(wanted);
    first(&|field| tells(field) && is_whole(field)).or_else(|| first(&tells)).or_else(|| first(&|_| true))
}

/// Words in the names of arrays that number something, as the usual programs write them.
const NUMBERS: [&str; 20] = [
    "id",
    "ids",
    "index",
    "indices",
    "number",
    "label",
    "labels",
    "material",
    "materials",
    "part",
    "parts",
    "region",
    "regions",
    "block",
    "blocks",
    "domain",
    "group",
    "tag",
    "rank",
    "proc",
];

/// Words in the names of arrays that say where something is.
const PLACES: [&str; 3] = ["coordinates", "coords", "coord"];

/// Words in the names of quantities that have one of these words, too, such as a Mach number, or the real part of a pressure.
const OF_QUANTITIES: [&str; 9] =
    ["mach", "reynolds", "courant", "peclet", "prandtl", "nusselt", "real", "imaginary", "imag"];

/// Whether the name of an array says that it numbers something, or where it is: that is seldom what is to be looked at.
pub fn is_number_or_place(name: &str) -> bool {
    has_word(name, &NUMBERS) || has_word(name, &PLACES)
}

/// Whether a name has one of these words, and is not that of a quantity. Words of names end at signs, and where a large letter follows a small
/// one.
fn has_word(name: &str, known: &[&str]) -> bool {
    // The words are English: of other letters it is enough that they are some.
    let is_letter = |c: char| c.is_ascii_alphabetic() || !c.is_ascii();
    let mut words = vec![String::new()];
    let mut before = ' ';
    for c in name.chars() {
        if !is_letter(c) || (before.is_ascii_lowercase() && c.is_ascii_uppercase()) {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut().filter(|_| is_letter(c)) {
            word.push(c.to_ascii_lowercase());
        }
        before = c;
    }
    let is_one_of = |known: &[&str]| words.iter().any(|word| known.contains(&word.as_str()));
    is_one_of(known) && !is_one_of(&OF_QUANTITIES)
}

#[cfg(test)]
mod tests {
    use super::{Field, VectorPart, is_number_or_place};

    #[test]
    fn numbers_and_places_are_told_by_the_words_of_a_name() {
        for name in [
            "GlobalNodeId",
            "material",
            "vtkOriginalPointIds",
            "PartId",
            "region_2",
            "Coordinates",
            "gmsh:physical-tag",
        ] {
            assert!(is_number_or_place(name), "{name}");
        }
        for name in ["pressure", "von_mises", "Temp", "fluid", "humidity", "blocked", "", "partial_pressure"]
        {
            assert!(!is_number_or_place(name), "{name}");
        }
    }

    #[test]
    fn labels_are_few_integers_that_number_something() {
        let of = |name: &str, values: Vec<f64>| Field { integer: true, ..Field::new(name, values) };
        let many = |count: u32| (0..count).map(f64::from).collect::<Vec<_>>();
        assert!(of("material", vec![1.0, 5.0, 5.0, -3.0]).is_label_by_rule());
        assert!(of("cell_id", [many(256), many(256)].concat()).is_label_by_rule());
        // Too many, no integers by type or value, a measured quantity, a place, a part of a vector.
        assert!(!of("cell_id", many(257)).is_label_by_rule());
        assert!(!Field::new("material", vec![1.0]).is_label_by_rule());
        assert!(!of("material", vec![1.5]).is_label_by_rule());
        assert!(!of("material", vec![f64::from(1 << 23)]).is_label_by_rule());
        assert!(!of("Hounsfield", vec![1.0, 5.0]).is_label_by_rule());
        assert!(!of("coords", vec![1.0, 5.0]).is_label_by_rule());
        assert!(!of("mach_number", vec![1.0]).is_label_by_rule());
        let part = VectorPart { name: "id".to_owned(), component: Some(0) };
        assert!(!Field { vector: Some(part), ..of("id_x", vec![1.0]) }.is_label_by_rule());
    }
}
