//! The regions of tetrahedra by the labels that a configuration keeps apart, and what is known of each.

use crate::{BuildConfig, BuildError};
use std::collections::{BTreeMap, HashSet};
use tetralod::mesh::{Field, MeshInput, TetMesh};
use tetralod::mt::{self, MAX_REGIONS, MtKind, RegionInfo};

/// Whether a file says what its regions are: those of other kinds have none.
pub(crate) fn has_table(config: &BuildConfig) -> bool {
    config.construction.kind() == MtKind::HalfEdge
}

/// The region of each tetrahedron by the labels of a configuration, and the labels of each region if files say what they are.
pub(crate) fn numbers(config: &BuildConfig, mesh: &TetMesh) -> Result<(Vec<u32>, Vec<Vec<i64>>), BuildError> {
    let mut of = vec![0_u32; mesh.tets.len()];
    let mut all = vec![Vec::new()];
    for name in &config.preserve {
        let mut numbers: BTreeMap<(u32, i64), u32> = BTreeMap::new();
        let label = labels(mesh, name)?;
        of.iter().zip(&label).for_each(|(&region, &label)| _ = numbers.insert((region, label), 0));
        // In ascending order.
        (0..).zip(numbers.values_mut()).for_each(|(next, number)| *number = next);
        of.iter_mut().zip(label).for_each(|(region, label)| *region = numbers[&(*region, label)]);
        if has_table(config) {
            if numbers.len() > MAX_REGIONS {
                return Err(BuildError::Regions { count: numbers.len(), most: MAX_REGIONS });
            }
            let keys = numbers.keys();
            all = keys.map(|(region, label)| [&all[*region as usize][..], &[*label]].concat()).collect();
        }
    }
    Ok((of, all))
}

/// The regions of these labels in these arrays, with the names that the input has for them, and how many tetrahedra each has.
pub(crate) fn table(arrays: &[String], labels: Vec<Vec<i64>>, of: &[u32], input: &MeshInput) -> mt::Regions {
    let mut counts = vec![0; labels.len()];
    of.iter().for_each(|&region| counts[region as usize] += 1);
    let known = |array: &String, label: &i64| input.label_names.get(array)?.get(label).cloned();
    let named = |labels: &[i64]| {
        let each = arrays.iter().zip(labels).map(|(array, label)| {
            let number = || if labels.len() == 1 { label.to_string() } else { format!("{array} {label}") };
            known(array, label).unwrap_or_else(number)
        });
        each.collect::<Vec<String>>().join(", ")
    };
    // Of several with one name, each has its labels behind it.
    let mut uses: BTreeMap<String, u32> = BTreeMap::new();
    labels.iter().for_each(|labels| *uses.entry(named(labels)).or_default() += 1);
    let mut taken = HashSet::new();
    let mut distinct = |labels: &[i64]| {
        let mut name = named(labels);
        let numbers = labels.iter().map(i64::to_string).collect::<Vec<_>>().join(", ");
        let mut is_taken = uses[&name] > 1;
        // The input may have such a name, too.
        while is_taken || !taken.insert(name.clone()) {
            name = format!("{name} ({numbers})");
            is_taken = false;
        }
        name
    };
    let region = |(labels, tetrahedra): (Vec<i64>, u64)| RegionInfo {
        name: distinct(&labels),
        labels,
        tetrahedra,
        ..RegionInfo::default()
    };
    mt::Regions {
        arrays: arrays.to_vec(),
        all: labels.into_iter().zip(counts).map(region).collect(),
        ..mt::Regions::default()
    }
}

/// The label of each cell by a field at cells; or, by a field at points, the least of its corners'.
pub(crate) fn labels(mesh: &TetMesh, name: &str) -> Result<Vec<i64>, BuildError> {
    let whole = |(at, value): (u32, &f64)| {
        let is_whole = value.trunc() == *value && value.abs() <= LARGEST_LABEL;
        // Exact: it is an integer that a double holds.
        if is_whole {
            Ok(*value as i64)
        } else {
            Err(BuildError::Label { name: name.to_owned(), at, value: *value })
        }
    };
    let all = |field: &Field| (0..).zip(&field.values).map(whole).collect::<Result<Vec<i64>, _>>();
    let is_it = |field: &&Field| field.name == name;
    // Time steps share a name.
    let all_steps = |steps: &[&Field]| {
        let first = all(steps[0])?;
        let is_other = steps.iter().any(|field| field.values != steps[0].values);
        if is_other { Err(BuildError::LabelChanges { name: name.to_owned() }) } else { Ok(first) }
    };
    let at_cells: Vec<&Field> =
        mesh.cell_fields.iter().filter(is_it).filter(|field| field.values.len() == mesh.tets.len()).collect();
    if !at_cells.is_empty() {
        return all_steps(&at_cells).map_err(|error| at_cell(error, mesh));
    }
    let at_points: Vec<&Field> = mesh.fields.iter().filter(is_it).collect();
    if at_points.is_empty() {
        let MeshInput { other_fields, other_cell_fields, .. } = &mesh.input;
        let known = mesh.cell_fields.iter().chain(other_cell_fields).chain(&mesh.fields).chain(other_fields);
        let known = known.map(|field| field.name.clone()).collect();
        return Err(BuildError::UnknownLabel { name: name.to_owned(), known });
    }
    let labels = all_steps(&at_points)?;
    let least = |tet: &[u32; 4]| tet.map(|v| labels[v as usize]).into_iter().fold(i64::MAX, i64::min);
    Ok(mesh.tets.iter().map(least).collect())
}

/// The error with the number of the cell in the input.
fn at_cell(error: BuildError, mesh: &TetMesh) -> BuildError {
    match error {
        BuildError::Label { name, at, value } => {
            BuildError::Label { name, at: mesh.input.cells.cell_of(at).number, value }
        }
        error => error,
    }
}

/// Doubles hold all integers up to this one and the next, which the one behind that is rounded to.
const LARGEST_LABEL: f64 = 9_007_199_254_740_991.0;
