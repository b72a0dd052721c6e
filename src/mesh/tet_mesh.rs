//! A tetrahedral mesh as files give it and builders take it.

use crate::mesh::Field;
use crate::mesh::MeshInput;
use std::borrow::Cow;
use std::collections::HashSet;

/// The regular grid that a mesh was split from; its points run x fastest, then y, then z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Points along x, y and z.
    pub dims: [u32; 3],
    /// Position of the first point.
    pub origin: [f64; 3],
    /// Distance between neighbouring points along x, y and z; positive.
    pub spacing: [f64; 3],
}

/// A point in one of the regions that meet there, besides the first of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side {
    /// The point.
    pub point: u32,
    /// A tetrahedron of the region that has the point as a corner.
    pub tet: u32,
}

/// A tetrahedral mesh with scalar fields at its points: plain arrays that need not be valid. What it was read from does not
/// count when two are compared.
#[derive(Clone, Debug, Default)]
pub struct TetMesh {
    /// Coordinates of the points, in model units.
    pub positions: Vec<[f64; 3]>,
    /// Scalar fields, each as long as `positions`.
    pub fields: Vec<Field>,
    /// Tetrahedra as indices into `positions`.
    pub tets: Vec<[u32; 4]>,
    /// Set when the points are exactly those of a regular grid: the lattice then falls on the grid.
    pub grid: Option<Grid>,
    /// Scalar fields at the cells, each as long as `tets`; without values where only their names were asked for.
    pub cell_fields: Vec<Field>,
    /// Points at which several regions meet, for fields that have a value there for each of them: see [`Field::sides`].
    pub sides: Vec<Side>,
    /// What its reader left out of the file, or took in a way that the file does not state: in words, for users.
    pub notes: Vec<String>,
    /// What is known of the input that it was read from.
    pub input: MeshInput,
}

impl PartialEq for TetMesh {
    fn eq(&self, other: &Self) -> bool {
        let Self { positions, fields, tets, grid, cell_fields, sides, input: _, notes: _ } = self;
        *positions == other.positions
            && *fields == other.fields
            && *tets == other.tets
            && *grid == other.grid
            && *cell_fields == other.cell_fields
            && *sides == other.sides
    }
}

impl TetMesh {
    /// Sets the units of fields, or of all components of vectors, by their names. What was left out when the mesh was read has none.
    ///
    /// # Errors
    /// The first name, with its unit, that the input does not have.
    #[doc(hidden)]
    pub fn set_units<'a>(&mut self, units: &'a [(String, String)]) -> Result<(), &'a (String, String)> {
        for named in units {
            let (name, unit) = named;
            let is_meant = |field: &Field| {
                field.name == *name || field.vector.as_ref().is_some_and(|vector| vector.name == *name)
            };
            let mut found = self.input.other_fields.iter().any(is_meant);
            for field in self.fields.iter_mut().filter(|field| is_meant(field)) {
                field.unit.clone_from(unit);
                found = true;
            }
            if !found {
                return Err(named);
            }
        }
        Ok(())
    }

    /// Says which fields, at points and at cells, are [labels](Field::is_label): of those that `given` names, or whose vector it names, the
    /// first entry says it; of others the [rule](Field::is_label_by_rule), at all time steps, or none are if `by_rule` is not set.
    ///
    /// # Errors
    /// The first name that the input does not have.
    #[doc(hidden)]
    pub fn mark_labels<'a>(&mut self, given: &'a [(String, bool)], by_rule: bool) -> Result<(), &'a str> {
        let MeshInput { other_fields, other_cell_fields, .. } = &self.input;
        let known =
            || self.fields.iter().chain(&self.cell_fields).chain(other_fields).chain(other_cell_fields);
        if let Some((name, _)) = given.iter().find(|(name, _)| !known().any(|field| field.answers_to(name))) {
            return Err(name);
        }
        for fields in [&mut self.fields, &mut self.cell_fields] {
            for field in fields.iter_mut() {
                let said = given.iter().find(|(name, _)| field.answers_to(name));
                field.is_label =
                    said.map_or_else(|| by_rule && field.is_label_by_rule(), |(_, is_label)| *is_label);
            }
            let none: HashSet<String> =
                fields.iter().filter(|field| !field.is_label).map(|field| field.name.clone()).collect();
            fields.iter_mut().for_each(|field| field.is_label &= !none.contains(&field.name));
        }
        Ok(())
    }
}

impl From<TetMesh> for Cow<'_, TetMesh> {
    fn from(mesh: TetMesh) -> Self {
        Cow::Owned(mesh)
    }
}

impl<'a> From<&'a TetMesh> for Cow<'a, TetMesh> {
    fn from(mesh: &'a TetMesh) -> Self {
        Cow::Borrowed(mesh)
    }
}
