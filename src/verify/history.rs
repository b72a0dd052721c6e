//! Checks that the mesh of a request does not depend on earlier requests, with many requests.

use super::{Query, VerifyReport, note, satisfy};
use crate::geom::Bounds;
use crate::mesh::TetMesh;
use crate::mt::{ApplyUpdates, MtInfo};
use crate::refine::{Front, Need, Request};

/// Requests for values, of all fields together, and for boxes.
const VALUES: usize = 60;
const BOXES: usize = 12;

/// One in so many requests starts from the reference mesh.
const FULL: u32 = 3;

const ERRORS: [f64; 5] = [0.01, 0.0, 0.003, 0.03, 0.001];

/// Pseudo-random numbers; the same on every run (Xorshift, Marsaglia 2003).
pub struct Numbers(pub u64);

impl Numbers {
    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// From 0 to 1.
    pub fn part(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Isovalues all over the range of each field, values of reference vertices, bands, and boxes, in random order.
pub fn requests(info: &MtInfo, input: &TetMesh) -> Vec<Query> {
    let mut numbers = Numbers(0x9E37_79B9_7F4A_7C15);
    let mut all = Vec::new();
    let each = (VALUES / info.fields.len()).max(2);
    for (f, field) in info.fields.iter().enumerate() {
        let known = input.fields.iter().find(|known| field.is_of(known));
        for i in 0..each {
            let error = ERRORS[all.len() % ERRORS.len()];
            let spread = field.min + (i as f64 + numbers.part()) / each as f64 * field.range();
            let vertex = numbers.next() as usize % input.positions.len().max(1);
            let own = known.and_then(|known| known.values.get(vertex).copied());
            let value = if i % 3 == 2 { own.unwrap_or(spread) } else { spread };
            let need = Need::within(error);
            let (name, need) = if i % 10 == 9 {
                let to = value + 0.1 * numbers.part() * field.range();
                (format!("{} from {value} to {to}", field.name), need.between(f, vec![[value, to]]))
            } else {
                (format!("{} = {value}", field.name), need.around(f, &[value]))
            };
            all.push(Query::new(&format!("{name}, error {error}"), need));
        }
    }
    let whole = Bounds::of(&input.positions);
    for _ in 0..BOXES {
        let error = ERRORS[all.len() % ERRORS.len()];
        let (mut low, mut high) = (whole.min, whole.max);
        for i in 0..3 {
            let ends =
                [numbers.part(), numbers.part()].map(|x| whole.min[i] + x * (whole.max[i] - whole.min[i]));
            (low[i], high[i]) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        }
        let need = Need::within(error).inside(Bounds { min: low, max: high });
        all.push(Query::new(&format!("box {low:?} to {high:?}, error {error}"), need));
    }
    for i in (1..all.len()).rev() {
        all.swap(i, numbers.next() as usize % (i + 1));
    }
    all
}

/// Answers each request from the base mesh, and again from the mesh that the one before left, or from the reference mesh.
pub fn check(
    mt: &impl ApplyUpdates,
    base: &Front,
    queries: &[Query],
    on_progress: &mut dyn FnMut(u32),
    report: &mut VerifyReport,
) -> Result<(), String> {
    let full = Query::new("full refinement", Request::within(0.0));
    let mut walk = base.clone();
    for (i, query) in (0..).zip(queries) {
        on_progress(i);
        let mut front = base.clone();
        satisfy(mt, &mut front, query)?;
        if i % FULL == 0 {
            satisfy(mt, &mut walk, &full)?;
        }
        satisfy(mt, &mut walk, query)?;
        report.queries += 1;
        if walk.mesh().hash() != front.mesh().hash() {
            let [here, there] = [&front, &walk].map(|front| front.mesh().tet_count());
            let from = if i % FULL == 0 { "the reference mesh" } else { "another one" };
            let failure = format!(
                "the mesh depends on what was asked for before: {here} tetrahedra from the base mesh, {there} from {from}"
            );
            note(report, query, &failure);
        }
    }
    Ok(())
}
