//! Figure 8: the size of extracted meshes against the error.

use anyhow::Result;
use tetralod::mt::MultiTessellation;
use tetralod::refine::Need;

use crate::chart::{Chart, Marker, Series, Style};
use crate::markdown::{Table, count, fewer, percent};
use crate::model::{DataSet, Model, Recipe};
use crate::published;
use crate::published::FIGURE_8_ERRORS;

/// The curves of one of the two parts of the figure.
pub struct Curves {
    /// Whether meshes are fine only where the field passes the isovalue.
    pub variable: bool,
    /// Tetrahedra of the reference mesh.
    pub reference: u64,
    /// Tetrahedra by error.
    pub curves: Vec<(Recipe, Vec<u64>)>,
}

/// Extracts them all: uniform ones, or with an isovalue those that are fine around it.
pub fn curves(data: &DataSet, isovalue: Option<f64>) -> Result<Curves> {
    let isovalues: Vec<f64> = isovalue.into_iter().collect();
    let curve = |model: &Model| -> Result<(Recipe, Vec<u64>)> {
        let request = |error| Need::within(error).limited(None, 0, &isovalues).into();
        let sizes = FIGURE_8_ERRORS.iter().map(|&e| crate::query::tetrahedra(&model.mt, &request(e)));
        Ok((model.recipe, sizes.collect::<Result<_>>()?))
    };
    Ok(Curves {
        variable: isovalue.is_some(),
        reference: data.models.first().map_or(0, |model| model.mt.info().tetrahedra),
        curves: data.models.iter().map(curve).collect::<Result<_>>()?,
    })
}

impl Curves {
    /// How many fewer tetrahedra one recipe needs than another: the mean over all errors but 0. None where one of the
    /// two was not made.
    pub fn saved(&self, recipe: Recipe, than: Recipe) -> Option<f64> {
        let sizes = |r: Recipe| self.curves.iter().find(|(other, _)| *other == r).map(|(_, sizes)| sizes);
        // The first error is 0, where every MT gives the whole reference mesh: nothing to compare.
        let shares = sizes(recipe)?.iter().zip(sizes(than)?).skip(1);
        let shares: Vec<f64> = shares.map(|(&a, &b)| 1.0 - a as f64 / b.max(1) as f64).collect();
        Some(shares.iter().sum::<f64>() / shares.len().max(1) as f64)
    }

    /// All curves as numbers.
    pub fn table(&self) -> String {
        let errors = FIGURE_8_ERRORS.map(percent);
        let mut heads = vec!["MT"];
        heads.extend(errors.iter().map(String::as_str));
        heads.push("than edge");
        let mut table = Table::new(&heads, 1);
        let ours = self.curves.iter().map(|(recipe, sizes)| {
            let cell = |&tets: &u64| format!("{} ({})", count(tets), self.ratio(tets));
            let saved = self.saved(*recipe, Recipe::Edge).filter(|_| *recipe != Recipe::Edge);
            let mut cells = vec![recipe.name().to_owned()];
            cells.extend(sizes.iter().map(cell));
            cells.push(saved.map_or(String::new(), fewer));
            cells
        });
        self.published_rows().into_iter().chain(ours).for_each(|cells| table.row(&cells));
        table.finish()
    }

    fn ratio(&self, tets: u64) -> String {
        format!("{:.3}", tets as f64 / self.reference.max(1) as f64)
    }

    /// What the paper prints of these curves, in the captions of its other figures.
    fn published(&self) -> [(&'static str, usize, u64); 2] {
        let (six, seven) = (&published::FIGURE_6, &published::FIGURE_7);
        let vertex = if self.variable { six.variable_tets } else { six.uniform_tets };
        [("vertex", 1, vertex), ("edge", 0, seven.uniform_tets)]
    }

    fn published_rows(&self) -> Vec<Vec<String>> {
        let row = |(kind, at, tets): (&str, usize, u64)| {
            let mut cells = vec![String::new(); FIGURE_8_ERRORS.len() + 2];
            cells[0] = format!("*paper: {kind}*");
            cells[at + 1] = format!("{} ({:.3})", count(tets), tets as f64 / published::TETRAHEDRA as f64);
            if kind == "vertex" {
                *cells.last_mut().expect("a row has cells") =
                    fewer(published::FIGURE_8_SAVED[usize::from(self.variable)]);
            }
            cells
        };
        self.printed().map(row).collect()
    }

    /// Figure 7 is of a uniform mesh, so it has nothing to say of variable ones.
    fn printed(&self) -> impl Iterator<Item = (&'static str, usize, u64)> {
        let variable = self.variable;
        self.published().into_iter().filter(move |(kind, ..)| !variable || *kind == "vertex")
    }

    /// The figure.
    pub fn chart(&self) -> String {
        let ours = self.curves.iter().map(|(recipe, sizes)| Series {
            name: recipe.name().to_owned(),
            style: style(*recipe),
            points: sizes
                .iter()
                .map(|&tets| tets as f64 / self.reference.max(1) as f64)
                .enumerate()
                .collect(),
        });
        let theirs = self.printed().map(|(kind, at, tets)| Series {
            name: format!("paper: {kind} (as printed)"),
            style: Style {
                colour: style(if kind == "edge" { Recipe::Edge } else { Recipe::Insert }).colour,
                marker: Marker::Diamond,
                line: None,
            },
            points: vec![(at, tets as f64 / published::TETRAHEDRA as f64)],
        });
        let title = if self.variable { "(b) Variable LOD, by field value" } else { "(a) Uniform LOD" };
        Chart {
            title,
            x_label: "error, of the field's range",
            y_label: "tetrahedra, extracted ÷ reference",
            ticks: &FIGURE_8_ERRORS.map(percent),
            series: ours.chain(theirs).collect(),
        }
        .svg()
    }
}

/// Colours that differ for the colour-blind, too (Okabe and Ito, 2008); edges dashed, as in the paper.
fn style(recipe: Recipe) -> Style {
    let (colour, marker, line) = match recipe {
        Recipe::Edge => ("#d55e00", Marker::Square, "7 5"),
        Recipe::Insert => ("#0072b2", Marker::Disc, ""),
        Recipe::InsertOwn => ("#56b4e9", Marker::Disc, "2 3"),
        Recipe::Delaunay => ("#009e73", Marker::Disc, ""),
        Recipe::HalfEdge => ("#a0507d", Marker::Disc, ""),
    };
    Style { colour, marker, line: Some(line) }
}
