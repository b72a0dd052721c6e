//! Which fields of a mesh are kept, and which of them bit for bit.

use crate::lattice::sides;
use crate::{BuildConfig, BuildError};
use std::collections::{HashMap, HashSet};
use tetralod::mesh::{Field, TetMesh, default_field};
use tetralod::mt::{Exact, VertexId};

/// Most fields of an MT.
const MAX_FIELDS: usize = 255;

/// The fields to keep, the time steps of each one behind the other.
pub(crate) fn fields<'a>(mesh: &'a TetMesh, config: &BuildConfig) -> Result<Vec<&'a Field>, BuildError> {
    let mut chosen: Vec<&Field> = Vec::new();
    let mut known = HashSet::new();
    let mut add = |field: &'a Field| {
        // A field that is named twice, by its own name and by its vector's, is kept once.
        if known.insert(std::ptr::from_ref(field)) {
            chosen.push(field);
        }
    };
    for name in &config.fields {
        let found: Vec<&Field> = in_steps(mesh, |field| field.answers_to(name));
        if found.is_empty() {
            return Err(unknown(mesh, name));
        }
        found.into_iter().for_each(&mut add);
    }
    if config.all_fields {
        let follows = |field: &Field| field.vector.as_ref().is_some_and(|v| v.component.is_none());
        in_steps(mesh, |field| !follows(field)).into_iter().for_each(&mut add);
    } else if config.fields.is_empty()
        && let Some(first) = default_field(&mesh.fields, &config.preserve)
    {
        let name = &mesh.fields[first].name;
        in_steps(mesh, |field| field.name == *name).into_iter().for_each(&mut add);
    }
    if chosen.is_empty() {
        let at_cells = default_field(&mesh.cell_fields, &config.preserve);
        let at_cells = at_cells.map(|field| mesh.cell_fields[field].name.clone());
        return Err(at_cells.map_or(BuildError::NoField, |name| BuildError::CellField { name }));
    }
    sides::check(&chosen, config)?;
    if chosen.len() > MAX_FIELDS {
        return Err(BuildError::TooManyFields { fields: chosen.len() });
    }
    let names = config.lossless.iter().chain(config.precision_of.iter().map(|(name, _)| name));
    for name in names {
        if !chosen.iter().any(|field| field.answers_to(name)) {
            let known = chosen.iter().map(|field| field.name.clone()).collect();
            return Err(BuildError::UnknownField { name: name.clone(), known });
        }
    }
    Ok(chosen)
}

/// The fields for which `wanted` holds, in the order of the mesh, with the time steps of each field together.
fn in_steps(mesh: &TetMesh, wanted: impl Fn(&Field) -> bool) -> Vec<&Field> {
    let mut number_of: HashMap<&str, usize> = HashMap::new();
    for field in mesh.fields.iter().filter(|field| wanted(field)) {
        let number = number_of.len();
        number_of.entry(&field.name).or_insert(number);
    }
    let number = |field: &&Field| number_of.get(field.name.as_str()).copied();
    let mut found: Vec<&Field> = mesh.fields.iter().filter(|field| number(field).is_some()).collect();
    found.sort_by_key(number);
    found
}

fn unknown(mesh: &TetMesh, name: &str) -> BuildError {
    if mesh.cell_fields.iter().chain(&mesh.input.other_cell_fields).any(|field| field.answers_to(name)) {
        return BuildError::CellField { name: name.to_owned() };
    }
    let all = mesh.fields.iter().chain(&mesh.input.other_fields);
    let mut known: Vec<String> = all.map(|field| field.name.clone()).collect();
    known.dedup();
    BuildError::UnknownField { name: name.to_owned(), known }
}

/// Whether the exact values of any field may be wanted.
pub(crate) fn keeps_exact_values(config: &BuildConfig) -> bool {
    config.all_lossless || !config.lossless.is_empty()
}

/// The exact values of the lossless fields; `vertices` has the MT's vertex for each point.
pub(crate) fn exact_values(
    mesh: &TetMesh,
    config: &BuildConfig,
    vertices: &[VertexId],
) -> Result<Vec<Exact>, BuildError> {
    if !keeps_exact_values(config) {
        return Ok(Vec::new());
    }
    let is_wanted =
        |field: &Field| config.all_lossless || config.lossless.iter().any(|name| field.answers_to(name));
    let table = |(number, field): (usize, &Field)| {
        Exact::new(number, vertices.iter().copied().zip(field.values.iter().copied()).collect())
    };
    let chosen = fields(mesh, config)?;
    Ok(chosen.into_iter().enumerate().filter(|(_, field)| is_wanted(field)).map(table).collect())
}
