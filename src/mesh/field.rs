//! Scalar fields at points or cells of a mesh.

use crate::mesh::Averaged;
use serde::Serialize;

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
        let Self { name, unit, vector, time, integer, averaged, .. } = self;
        let (name, unit, vector) = (name.clone(), unit.clone(), vector.clone());
        Self {
            name,
            values: Vec::new(),
            sides: Vec::new(),
            unit,
            vector,
            time: *time,
            integer: *integer,
            averaged: averaged.clone(),
        }
    }

    /// The values at all points and, where it jumps, in all of their regions.
    #[doc(hidden)]
    pub fn all_values(&self) -> impl Iterator<Item = &f64> {
        self.values.iter().chain(&self.sides)
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
    let tells = |field: &Field| !is_number_or_place(&field.name) && !labels.contains(&field.name);
    let is_whole = |field: &Field| field.vector.as_ref().is_none_or(|part| part.component.is_none());
    let first = |wanted: &dyn Fn(&Field) -> bool| fields.iter().position(wanted);
    first(&|field| tells(field) && is_whole(field)).or_else(|| first(&tells)).or_else(|| first(&|_| true))
}

/// Words in the names of arrays that number something or say where it is, as the usual programs write them.
const NUMBERS_AND_PLACES: [&str; 23] = [
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
    "coordinates",
    "coords",
    "coord",
];

/// Words in the names of quantities that have one of these words, too, such as a Mach number, or the real part of a pressure.
const OF_QUANTITIES: [&str; 9] =
    ["mach", "reynolds", "courant", "peclet", "prandtl", "nusselt", "real", "imaginary", "imag"];

/// Whether the name of an array says that it numbers something, or where it is: that is seldom what is to be looked at. Words of names end at
/// signs, and where a large letter follows a small one.
pub fn is_number_or_place(name: &str) -> bool {
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
    is_one_of(&NUMBERS_AND_PLACES) && !is_one_of(&OF_QUANTITIES)
}

#[cfg(test)]
mod tests {
    use super::is_number_or_place;

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
}
