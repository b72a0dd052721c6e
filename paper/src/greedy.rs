//! What a promise costs: meshes of an MT beside those of programs that make one mesh and no MT.

use anyhow::Result;
use tetralod::refine::Request;

use crate::markdown::{Table, count, percent};
use crate::model::{DataSet, Recipe};
use crate::{published, query};

/// What one MT needs.
pub struct Needs {
    pub recipe: Recipe,
    pub errors: Vec<Need>,
}

/// Tetrahedra at one error.
pub struct Need {
    pub error: f64,
    /// The mesh that a request gives: within the error whatever else is applied, by the MT's promise.
    pub promised: u64,
    /// The error of that mesh, measured.
    pub measured: f64,
}

/// The errors that others have numbers for, largest first.
fn errors() -> Vec<f64> {
    let mut errors: Vec<f64> = published::GREEDY.map(|(error, _)| error).to_vec();
    errors.push(published::VTK.0);
    errors.sort_by(|a, b| b.total_cmp(a));
    errors
}

/// Measures all MTs of a data set.
pub fn needs(data: &DataSet) -> Result<Vec<Needs>> {
    let mut all = Vec::new();
    for model in &data.models {
        eprintln!("  {}: measuring", model.recipe.name());
        let mut found = Vec::new();
        for error in errors() {
            let front = query::front(&model.mt, &Request::within(error))?;
            found.push(Need {
                error,
                promised: front.mesh().tet_count() as u64,
                measured: query::measured(&model.mt, &front, &data.reference)?,
            });
        }
        all.push(Needs { recipe: model.recipe, errors: found });
    }
    Ok(all)
}

/// Ours beside what others have measured.
pub fn table(needs: &[Needs]) -> String {
    let errors = errors();
    let names: Vec<String> = errors.iter().map(|&e| percent(e)).collect();
    let mut heads = vec!["", "out of"];
    heads.extend(names.iter().map(String::as_str));
    let mut table = Table::new(&heads, 2);
    let given = |what: &[(f64, u64)], about: &str| -> Vec<String> {
        let cell = |error: &f64| what.iter().find(|(e, _)| e == error).map(|(_, tets)| *tets);
        errors.iter().map(|e| cell(e).map_or(String::new(), |t| format!("{about}{}", count(t)))).collect()
    };
    let named = |a: &str, b: &str, cells: Vec<String>| [vec![a.to_owned(), b.to_owned()], cells].concat();
    let greedy = given(&published::GREEDY, "");
    table.row(&named("*elsewhere:* greedy Delaunay insertion", "a mesh alone", greedy));
    let vtk = given(&[published::VTK], "about ");
    table.row(&named("*elsewhere:* VTK, decimation", "a mesh alone", vtk));
    for Needs { recipe, errors } in needs {
        let each = |cell: &dyn Fn(&Need) -> String| errors.iter().map(cell).collect::<Vec<_>>();
        let promised = each(&|need| format!("{} ({})", count(need.promised), percent(digits(need.measured))));
        table.row(&named(recipe.name(), "an MT (error measured)", promised));
    }
    table.finish()
}

/// An error to two digits.
fn digits(error: f64) -> f64 {
    if error <= 0.0 { 0.0 } else { format!("{error:.1e}").parse().unwrap_or(error) }
}
