//! Figures 6 and 7: the same isosurface out of a uniform mesh and out of one of variable resolution.

use anyhow::{Context, Result};
use tetralod::geom::Bounds;
use tetralod::mt::{ErrorCode, Mt, MultiTessellation};
use tetralod::refine::{Need, Region, Request};
use tetralod::view::IsoSurface;

use crate::markdown::{Table, count, percent};
use crate::model::{DataSet, Model, Recipe};
use crate::published;
use crate::published::Caption;
use crate::query::{Shown, tetrahedra};

/// Two meshes of one MT that show one isosurface.
pub struct Pair {
    pub isovalue: f64,
    /// The part that the variable mesh is fine in, if it is a box.
    pub roi: Option<Bounds>,
    pub uniform: Shown,
    pub variable: Shown,
}

/// Figure 6: fine everywhere, and fine where the field passes the isovalue.
pub fn around_isovalue(mt: &Mt, error: f64, facets: u64) -> Result<Pair> {
    let uniform = Shown::of(mt, &Request::within(error))?;
    let isovalue = isovalue_with(mt, &uniform, facets)?;
    let request = Need::within(error).around(0, &[isovalue]).into();
    Ok(Pair { isovalue, roi: None, variable: Shown::of(mt, &request)?, uniform })
}

/// Figure 7: the reference mesh, and one that is as fine in that octant of the domain that is nearest to whoever looks
/// at it: right, in front, above.
pub fn in_an_octant(mt: &Mt, isovalue: f64) -> Result<Pair> {
    let uniform = Shown::of(mt, &Request::within(0.0))?;
    let roi = octant(&domain(&uniform));
    let variable = Shown::of(mt, &Need::within(0.0).inside(roi).into())?;
    Ok(Pair { isovalue, roi: Some(roi), uniform, variable })
}

fn domain(shown: &Shown) -> Bounds {
    Bounds::of(&shown.view().positions.iter().map(|p| p.map(f64::from)).collect::<Vec<_>>())
}

fn octant(domain: &Bounds) -> Bounds {
    let middle = [0, 1, 2].map(|i| (domain.min[i] + domain.max[i]) / 2.0);
    Bounds { min: [middle[0], domain.min[1], middle[2]], max: [domain.max[0], middle[1], domain.max[2]] }
}

/// The box in the middle of a domain whose sides are `side` times as long.
fn in_the_middle(domain: &Bounds, side: f64) -> Bounds {
    let (extent, shift) = (domain.extent(), (1.0 - side) / 2.0);
    let min = [0, 1, 2].map(|i| domain.min[i] + shift * extent[i]);
    Bounds { min, max: [0, 1, 2].map(|i| min[i] + side * extent[i]) }
}

/// What boxes cost with one MT.
pub struct Boxed {
    pub recipe: Recipe,
    /// Tetrahedra of the mesh that is fine everywhere, in the octant, in the boxes in the middle; by [`BOX_ERRORS`].
    pub tets: Vec<[u64; 2 + MIDDLE.len()]>,
}

/// At which errors boxes are asked for.
const BOX_ERRORS: [f64; 2] = [0.0, 0.01];
/// The domain's sides as multiples of those of the boxes in the middle.
const MIDDLE: [u32; 4] = [2, 4, 8, 16];

/// Asks all MTs of a data set for boxes.
pub fn boxes(data: &DataSet) -> Result<Vec<Boxed>> {
    let domain = Bounds::of(&data.reference.positions);
    let middle = MIDDLE.map(|times| Some(in_the_middle(&domain, 1.0 / f64::from(times))));
    let regions = [None, Some(octant(&domain))].into_iter().chain(middle);
    let mut all = Vec::new();
    for model in &data.models {
        let mut tets = Vec::new();
        for error in BOX_ERRORS {
            let mut sizes = [0; 2 + MIDDLE.len()];
            for (size, roi) in sizes.iter_mut().zip(regions.clone()) {
                *size =
                    tetrahedra(&model.mt, &Need::within(error).limited(roi.map(Region::Box), 0, &[]).into())?;
            }
            tets.push(sizes);
        }
        all.push(Boxed { recipe: model.recipe, tets });
    }
    Ok(all)
}

/// What boxes cost, as a table.
pub fn box_table(all: &[Boxed]) -> String {
    let mut heads = vec!["MT".to_owned()];
    for error in BOX_ERRORS.map(percent) {
        heads.extend(["everywhere", "octant"].map(|place| format!("{place}, {error}")));
        heads.extend(MIDDLE.map(|times| format!("1/{times} wide, {error}")));
    }
    let mut table = Table::new(&heads.iter().map(String::as_str).collect::<Vec<_>>(), 1);
    for Boxed { recipe, tets } in all {
        let cells = tets.iter().flat_map(|&[whole, ref parts @ ..]| {
            let part = |&tets: &u64| format!("{} ({:.2})", count(tets), tets as f64 / whole.max(1) as f64);
            std::iter::once(count(whole)).chain(parts.iter().map(part)).collect::<Vec<_>>()
        });
        table.row(&std::iter::once(recipe.name().to_owned()).chain(cells).collect::<Vec<_>>());
    }
    table.finish()
}

/// What error 0 takes with one MT: the reference mesh, or a mesh that is exact at its vertices.
pub struct AtZero {
    pub recipe: Recipe,
    pub reference: u64,
    pub exact: u64,
}

/// Asks all MTs of a data set for both.
pub fn at_zero(data: &DataSet) -> Result<Vec<AtZero>> {
    let of = |model: &Model| -> Result<AtZero> {
        // Updates of no error have the least one that is stored, or what rounding leaves; builders may round it up.
        let least = ErrorCode(1).error().max(model.mt.info().floor(0));
        let [reference, exact] = [0.0, ErrorCode::at_least(least).coarse().error()].map(Request::within);
        let [reference, exact] = [tetrahedra(&model.mt, &reference)?, tetrahedra(&model.mt, &exact)?];
        Ok(AtZero { recipe: model.recipe, reference, exact })
    };
    data.models.iter().map(of).collect()
}

/// That as a table.
pub fn zero_table(all: &[AtZero]) -> String {
    let mut table = Table::new(&["MT", "reference mesh", "exact at vertices", "÷"], 1);
    let theirs = [published::TETRAHEDRA, published::FIGURE_7.uniform_tets];
    let ours = all.iter().map(|zero| (zero.recipe.name(), [zero.reference, zero.exact]));
    for (name, [reference, exact]) in std::iter::once(("*paper: edge*", theirs)).chain(ours) {
        let ratio = format!("{:.2}", exact as f64 / reference.max(1) as f64);
        table.row(&[name.to_owned(), count(reference), count(exact), ratio]);
    }
    table.finish()
}

/// The multiple of a hundredth, or for a wide range the integer, at which the isosurface has most nearly so many facets.
fn isovalue_with(mt: &Mt, shown: &Shown, facets: u64) -> Result<f64> {
    let field = mt.info().fields.first().context("an MT has a field")?;
    let per_unit = if field.range() > 10.0 { 1.0 } else { 100.0 };
    let whole = |x: f64| (x * per_unit).floor() as i64;
    let values = (whole(field.min) + 1..=whole(field.max)).map(|i| i as f64 / per_unit);
    values.min_by_key(|&v| shown.facets(v).abs_diff(facets)).context("a field with values")
}

impl Pair {
    /// Whether both meshes have the same isosurface, triangle for triangle.
    pub fn same_surface(&self) -> bool {
        let triangles = |shown: &Shown| {
            let mut surface = IsoSurface::new();
            surface.extract(&shown.view(), self.isovalue);
            let place = |v: u32| surface.positions[v as usize].map(f64::to_bits);
            let sorted = |t: &[u32; 3]| {
                let mut corners = t.map(place);
                corners.sort_unstable();
                corners
            };
            let mut all: Vec<_> = surface.indices.iter().map(sorted).collect();
            all.sort_unstable();
            all
        };
        triangles(&self.uniform) == triangles(&self.variable)
    }

    /// Our numbers under the paper's.
    pub fn table(&self, theirs: &Caption) -> String {
        let mut table = Table::new(
            &[
                "",
                "uniform, tets",
                "variable, tets",
                "variable ÷ uniform",
                "uniform, facets",
                "variable, facets",
            ],
            1,
        );
        let row = |name: &str, tets: [u64; 2], facets: [Option<u64>; 2]| {
            let facets = facets.map(|f| f.map_or(String::new(), count));
            let ratio = format!("{:.2}", tets[1] as f64 / tets[0].max(1) as f64);
            [&[name.to_owned(), count(tets[0]), count(tets[1]), ratio][..], &facets[..]].concat()
        };
        table.row(&row(
            "*paper*",
            [theirs.uniform_tets, theirs.variable_tets],
            [Some(theirs.uniform_facets), theirs.variable_facets],
        ));
        let shown = [&self.uniform, &self.variable];
        table.row(&row(
            "here",
            shown.map(Shown::tetrahedra),
            shown.map(|shown| Some(shown.facets(self.isovalue))),
        ));
        table.finish()
    }
}
