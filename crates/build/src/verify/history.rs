//! Checks that the mesh of a request does not depend on earlier requests, with many requests.

use super::expected::{self, Expected, NOT_EXPECTED};
use super::fronts::satisfy;
use super::queries::{Query, parallel, perspective, place};
use super::report::{VerifyReport, note};
use glam::DVec3;
use tetralod::geom::Bounds;
use tetralod::mesh::TetMesh;
use tetralod::mt::{ApplyUpdates, MtInfo};
use tetralod::refine::{Front, Need, Request};

/// Requests for values, of all fields together, and for boxes.
const VALUES: usize = 60;
const BOXES: usize = 12;
/// Cameras, and the places that each moves to.
const WALKS: usize = 8;
const PLACES: u64 = 4;

/// Of large meshes most requests for values are for those in a part of about so many tetrahedra: what was asked for before is as likely to
/// matter there as everywhere. One in so many is for the whole domain.
const PART_TETS: f64 = 50_000.0;
const WHOLE: usize = 10;

/// One in so many requests starts from the base mesh, and one in so many comes by the reference mesh.
const FRESH: u32 = 3;
const THROUGH: u32 = 24;

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

/// Isovalues all over the range of each field, values of reference vertices, bands, boxes, and cameras that move, in random order.
pub fn requests(mt: &impl ApplyUpdates, input: &TetMesh) -> Vec<Query> {
    let mut numbers = Numbers(0x9E37_79B9_7F4A_7C15);
    let whole = Bounds::of(&input.positions);
    let mut all: Vec<Vec<Query>> =
        values(mt.info(), input, &whole, &mut numbers).into_iter().map(|one| vec![one]).collect();
    for _ in 0..BOXES {
        let error = ERRORS[all.len() % ERRORS.len()];
        let (mut low, mut high) = (whole.min, whole.max);
        for i in 0..3 {
            let ends =
                [numbers.part(), numbers.part()].map(|x| whole.min[i] + x * (whole.max[i] - whole.min[i]));
            (low[i], high[i]) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        }
        let need = Need::within(error).inside(Bounds { min: low, max: high });
        all.push(vec![Query::new(&format!("box {low:?} to {high:?}, error {error}"), need)]);
    }
    let sizes = [mt.base().tets.len() as u64, mt.info().tetrahedra];
    all.extend((0..WALKS).map(|i| walk(i, &whole, sizes, &mut numbers)));
    for i in (1..all.len()).rev() {
        all.swap(i, numbers.next() as usize % (i + 1));
    }
    all.into_iter().flatten().collect()
}

fn values(info: &MtInfo, input: &TetMesh, whole: &Bounds, numbers: &mut Numbers) -> Vec<Query> {
    let mut all = Vec::new();
    let side = (PART_TETS / info.tetrahedra.max(1) as f64).cbrt();
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
            let (name, need) = if side < 1.0 && all.len() % WHOLE > 0 {
                let low = [0; 3].map(|_| (1.0 - side) * numbers.part());
                let part = Bounds { min: place(whole, low), max: place(whole, low.map(|x| x + side)) };
                (format!("{name} in {:?} to {:?}", part.min, part.max), need.inside(part))
            } else {
                (name, need)
            };
            all.push(Query::new(&format!("{name}, error {error}"), need));
        }
    }
    all
}

/// A camera somewhere, and where it is after some small moves, together with a coarse mesh of the whole; some with a budget that grows
/// and shrinks. `sizes` are the tetrahedra of the base and of the reference mesh.
fn walk(i: usize, whole: &Bounds, [base, all]: [u64; 2], numbers: &mut Numbers) -> Vec<Query> {
    let mut random = |most: f64| DVec3::from([0; 3].map(|_| most * (2.0 * numbers.part() - 1.0)));
    let (size, viewport) = (whole.diagonal(), [900.0, 600.0]);
    let mut target = DVec3::from(place(whole, (0.5 + random(0.4)).to_array()));
    let mut eye = target + random(1.0) * size * [0.3, 1.5][i % 2];
    let pixels = [0.5, 2.0, 8.0][i % 3];
    let step = |k: u64| {
        let seen = match i % 4 {
            3 => parallel(target, (2.0 + k as f64) / size, viewport),
            _ => perspective(eye, target - eye, 1.8, viewport),
        };
        target += 0.02 * size * random(1.0);
        eye += 0.05 * size * random(1.0);
        let request = Request::within(0.3).and(Need::seen(seen, pixels));
        let most = base + all.saturating_sub(base) / (8 + 4 * (k % 2));
        let request = if i % 2 == 1 { request.at_most(most as u32) } else { request };
        Query::new(&format!("place {k} of camera {i}, {pixels} pixels"), request)
    };
    (0..PLACES).map(step).collect()
}

/// Compares the mesh of each request with the one that it must be: most are answered by one mesh in turn, now and then by way of the
/// reference mesh, others from the base mesh. `untouched` is that before any request, `base` what is left of others.
pub fn check(
    mt: &impl ApplyUpdates,
    expected: &Expected,
    [untouched, base]: [&Front; 2],
    queries: &[Query],
    on_progress: &mut dyn FnMut(u32),
    report: &mut VerifyReport,
) -> Result<(), String> {
    let all = Query::new("full refinement", Request::within(0.0));
    let mut walk = untouched.clone();
    for (i, query) in (0..).zip(queries) {
        on_progress(i);
        let mut fresh = (i % FRESH == 0).then(|| base.clone());
        let front = fresh.as_mut().unwrap_or(&mut walk);
        if i % THROUGH == 1 {
            satisfy(mt, front, &all)?;
        }
        satisfy(mt, front, query)?;
        report.queries += 1;
        if expected::hash(front.mesh()) != expected.hash(mt, base, query)? {
            note(report, query, NOT_EXPECTED);
        }
    }
    Ok(())
}
