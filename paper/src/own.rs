//! Why a promise costs what it costs: the error that each tetrahedron of an MT has by itself, beside the error below
//! which its update is needed because of those that depend on it.

use anyhow::Result;
use tetralod::mesh::TetMesh;
use tetralod::mt::{ErrorCode, ExplicitMt, MultiTessellation, UpdateId, VertexId};

use crate::markdown::{Table, count, percent};
use crate::model::{DataSet, Recipe};

/// The errors at which the updates that a request applies are looked at.
pub const AT: [f64; 2] = [0.01, 0.05];

/// What the updates of an MT are like by themselves.
pub struct Own {
    pub recipe: Recipe,
    pub updates: u64,
    /// Updates that insert a tetrahedron whose error is larger than that of each they remove.
    pub worse: u64,
    /// By error: the updates that a uniform request applies, and those of them that remove no tetrahedron of a larger
    /// error than asked for. They are there because others depend on them.
    pub needed: Vec<[u64; 2]>,
}

/// Looks at all MTs of a data set.
pub fn own(data: &DataSet) -> Result<Vec<Own>> {
    let of = |model: &crate::model::Model| -> Result<Own> {
        let mt = ExplicitMt::of(&model.mt)?;
        Ok(of(model.recipe, &mt, &data.reference))
    };
    data.models.iter().filter(|model| model.recipe != Recipe::InsertOwn).map(of).collect()
}

fn of(recipe: Recipe, mt: &ExplicitMt, reference: &TetMesh) -> Own {
    let points = Points::new(mt, reference);
    let errors: Vec<f64> = mt.tets().iter().map(|tet| points.error(mt, tet)).collect();
    let largest = |tets: &mut dyn Iterator<Item = u32>| tets.map(|t| errors[t as usize]).fold(0.0, f64::max);
    let mut own = Own { recipe, updates: u64::from(mt.updates()), worse: 0, needed: vec![[0; 2]; AT.len()] };
    for u in (0..mt.updates()).map(UpdateId) {
        let removed = largest(&mut mt.removed(u).iter().copied());
        own.worse += u64::from(largest(&mut mt.inserted(u)) > removed);
        for (needed, error) in own.needed.iter_mut().zip(AT) {
            if mt.error(u) > ErrorCode::at_most(error) {
                needed[0] += 1;
                needed[1] += u64::from(removed <= error);
            }
        }
    }
    own
}

/// Boxes along each axis that points are sorted into, as a power of two.
const BOXES: u32 = 5;

/// The reference vertices on the lattice, sorted into boxes.
struct Points {
    /// Position, and value in levels, not rounded.
    boxes: Vec<Vec<([i64; 3], f64)>>,
    shift: u32,
    /// The part of the field's range that a level is.
    weight: f64,
}

impl Points {
    fn new(mt: &ExplicitMt, reference: &TetMesh) -> Self {
        let (info, field) = (mt.info(), &mt.info().fields[0]);
        // Grids use all of the lattice and its upper end besides.
        let shift = (info.lattice.bits + 1).saturating_sub(BOXES);
        let mut points =
            Self { boxes: vec![Vec::new(); 1 << (3 * BOXES)], shift, weight: field.step / field.range() };
        let values = reference.fields.iter().find(|f| f.name == field.name).map_or(&[][..], |f| &f.values);
        for (p, value) in reference.positions.iter().zip(values) {
            let at = info.lattice.nearest(*p).map(i64::from);
            let index = index(at.map(|x| points.along(x)));
            points.boxes[index].push((at, (value - field.origin) / field.step));
        }
        points
    }

    fn along(&self, x: i64) -> i64 {
        (x >> self.shift).clamp(0, (1 << BOXES) - 1)
    }

    /// The largest error of a tetrahedron at the reference vertices in it, as a fraction of the field's range.
    fn error(&self, mt: &ExplicitMt, tet: &[u32; 4]) -> f64 {
        let [a, b, c, d] = tet.map(|v| mt.position(VertexId(v)).map(i64::from));
        let levels = tet.map(|v| f64::from(mt.levels(VertexId(v))[0]));
        let low = [0, 1, 2].map(|i| self.along(a[i].min(b[i]).min(c[i]).min(d[i])));
        let high = [0, 1, 2].map(|i| self.along(a[i].max(b[i]).max(c[i]).max(d[i])));
        let mut largest = 0.0_f64;
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    for &(p, value) in &self.boxes[index([x, y, z])] {
                        let parts = [six(p, b, c, d), six(a, p, c, d), six(a, b, p, d), six(a, b, c, p)];
                        if parts.iter().any(|&part| part < 0) {
                            continue;
                        }
                        let whole = parts.iter().sum::<i64>() as f64;
                        let there: f64 = parts.iter().zip(levels).map(|(&w, l)| w as f64 / whole * l).sum();
                        largest = largest.max((there - value).abs());
                    }
                }
            }
        }
        // The values at vertices are rounded to levels, which is no error of the tetrahedron.
        (largest - 1.0).max(0.0) * self.weight
    }
}

fn index([x, y, z]: [i64; 3]) -> usize {
    (((z << BOXES | y) << BOXES) | x) as usize
}

/// Six times the signed volume; exact for lattices of up to 19 bits.
fn six(a: [i64; 3], b: [i64; 3], c: [i64; 3], d: [i64; 3]) -> i64 {
    let [u, v, w] = [b, c, d].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    (u[1] * v[2] - u[2] * v[1]) * w[0]
        + (u[2] * v[0] - u[0] * v[2]) * w[1]
        + (u[0] * v[1] - u[1] * v[0]) * w[2]
}

/// All of it as a table.
pub fn table(all: &[Own]) -> String {
    let mut heads = vec!["MT".to_owned(), "updates".to_owned(), "make something worse".to_owned()];
    for error in AT {
        heads.push(format!("needed at {}", percent(error)));
        heads.push(format!("for their own error at {}", percent(error)));
        heads.push(format!("only for others at {}", percent(error)));
    }
    let mut table = Table::new(&heads.iter().map(String::as_str).collect::<Vec<_>>(), 1);
    for Own { recipe, updates, worse, needed } in all {
        let mut cells = vec![recipe.name().to_owned(), count(*updates), count(*worse)];
        for &[needed, for_others] in needed {
            cells.extend([needed, needed - for_others, for_others].map(count));
        }
        table.row(&cells);
    }
    table.finish()
}
