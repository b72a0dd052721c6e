//! Scalar fields at points or cells of a mesh.

use serde::Serialize;

/// A scalar field with one value per point (or per tetrahedron), and what is known of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Field {
    /// The field's name in the file it came from. Only the time steps of one field share a name.
    pub name: String,
    /// One value per point, in the order of [`TetMesh::positions`](crate::mesh::TetMesh::positions); of fields at cells, one per tetrahedron.
    pub values: Vec<f64>,
    /// The unit of the values; empty if it is not known.
    pub unit: String,
    /// Set when the field is a part of a vector or tensor.
    pub vector: Option<VectorPart>,
    /// The time that the values are of.
    pub time: Option<f64>,
    /// Whether the values are integers by the type that the file gave them.
    pub integer: bool,
}

impl Field {
    /// A field of which no more is known.
    pub fn new(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self { name: name.into(), values, ..Self::default() }
    }

    /// What is known of it, but for its values.
    #[doc(hidden)]
    pub fn without_values(&self) -> Self {
        let Self { name, unit, vector, time, integer, .. } = self;
        let (name, unit, vector) = (name.clone(), unit.clone(), vector.clone());
        Self { name, values: Vec::new(), unit, vector, time: *time, integer: *integer }
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
    /// The component, from 0; none for the vector's length, which follows from the components.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub component: Option<u8>,
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
    words.iter().any(|word| NUMBERS_AND_PLACES.contains(&word.as_str()))
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
