//! The requests that an MT is tried with: derived from the input alone, so that they are the same on every run.

use crate::geom::Bounds;
use crate::mesh::TetMesh;
use crate::mt::MtInfo;
use crate::mt::MultiTessellation;
use crate::refine::Budget;
use crate::refine::LodCriterion;
use crate::refine::Need;
use crate::refine::Region;
use crate::refine::Request;
use std::fmt;

/// A request with a name.
pub struct Query {
    pub name: String,
    pub wish: Wish,
}

/// A request in the terms that the errors are measured in.
#[derive(Clone, Debug, Default)]
pub struct Wish {
    /// A fraction of the field's range.
    pub error: f64,
    pub roi: Option<Bounds>,
    pub isovalues: Vec<f64>,
    pub field: usize,
    pub max_tets: Option<u32>,
}

impl Wish {
    pub fn budget(&self) -> Budget {
        Budget { tets: self.max_tets, ..Budget::default() }
    }

    pub fn request(&self) -> Request {
        let need = Need::within(self.error);
        let need = need.limited(self.roi.map(Region::Box), self.field, &self.isovalues);
        Request { needs: vec![need], budget: self.budget() }
    }
}

impl fmt::Display for Query {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

impl Query {
    pub fn new(name: &str, wish: Wish) -> Self {
        Self { name: name.to_owned(), wish }
    }

    pub fn criterion(&self, info: &MtInfo) -> LodCriterion {
        LodCriterion::new(info, &self.wish.request())
    }
}

const ERRORS: [f64; 5] = [0.0, 0.001, 0.01, 0.05, 0.2];

/// All requests for an MT of `input`.
pub fn of(mt: &impl MultiTessellation, input: &TetMesh) -> Vec<Query> {
    let all = Wish::default();
    let mut queries = Vec::new();
    let mut add = |what: &str, wish: Wish| {
        let percent = 100.0 * wish.error;
        let budget = wish.max_tets.map_or(String::new(), |b| format!(", at most {b} tetrahedra"));
        queries.push(Query::new(&format!("{what}, error {percent} %{budget}"), wish));
    };
    for error in ERRORS.into_iter().chain([f64::INFINITY]) {
        add("uniform", Wish { error, ..all.clone() });
    }
    let boxes = boxes(input);
    for (i, (name, roi)) in boxes.iter().enumerate() {
        for error in [0.0, ERRORS[i % 4 + 1], ERRORS[(i + 2) % 4 + 1]] {
            add(name, Wish { error, roi: Some(*roi), ..all.clone() });
        }
    }
    let sizes = [mt.base().tets.len(), mt.info().tetrahedra as usize];
    let part = |k: usize| Some((sizes[0] + (sizes[1] - sizes[0].min(sizes[1])) / k) as u32);
    for (f, info) in mt.info().fields.iter().enumerate() {
        let Some(values) = input.fields.iter().find(|field| field.name == info.name) else { continue };
        let quantiles = quantiles(&values.values);
        for (i, &value) in quantiles.iter().enumerate() {
            let name = format!("{} = {value}", info.name);
            for error in [ERRORS[i % 4], ERRORS[i % 4 + 1]] {
                add(&name, Wish { error, isovalues: vec![value], field: f, ..all.clone() });
            }
            let (roi_name, roi) = &boxes[i % boxes.len()];
            let both = Wish { roi: Some(*roi), isovalues: vec![value], field: f, ..all.clone() };
            add(&format!("{roi_name} and {name}"), Wish { error: 0.001, ..both.clone() });
            add(&format!("{roi_name} and {name}"), Wish { max_tets: part(20), ..both });
        }
        let several = Wish { isovalues: quantiles, field: f, ..all.clone() };
        add(&format!("{} at all quantiles", info.name), Wish { error: 0.01, ..several.clone() });
        add(&format!("{} at all quantiles", info.name), Wish { max_tets: part(5), ..several });
    }
    for max_tets in [Some(0), part(100), part(10), part(2), Some(u32::MAX)] {
        add("uniform", Wish { max_tets, ..all.clone() });
    }
    add("uniform", Wish { error: 0.01, max_tets: part(50), ..all.clone() });
    for (name, roi) in &boxes {
        add(name, Wish { roi: Some(*roi), max_tets: part(30), ..all.clone() });
    }
    queries
}

/// A corner, the middle, a plane through the middle and a single vertex.
fn boxes(input: &TetMesh) -> [(&'static str, Bounds); 4] {
    let whole = Bounds::of(&input.positions);
    let at = |part: [f64; 3]| [0, 1, 2].map(|i| whole.min[i] + part[i] * (whole.max[i] - whole.min[i]));
    let between = |low: [f64; 3], high: [f64; 3]| Bounds { min: at(low), max: at(high) };
    let vertex = input.positions[input.positions.len() / 3];
    [
        ("box in a corner", between([-0.1; 3], [0.4, 0.3, 0.5])),
        ("box in the middle", between([0.35; 3], [0.65; 3])),
        ("plane", between([0.0, 0.0, 0.55], [1.0, 1.0, 0.55])),
        ("one vertex", Bounds { min: vertex, max: vertex }),
    ]
}

/// Values that split the field's values into parts of equal size, and two at the ends of the range.
fn quantiles(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |part: f64| sorted[((sorted.len() - 1) as f64 * part) as usize];
    let mut chosen = vec![at(0.1), at(0.5), at(0.9), 0.5 * (at(0.0) + at(1.0)), at(0.999)];
    chosen.sort_by(f64::total_cmp);
    chosen.dedup();
    chosen
}
