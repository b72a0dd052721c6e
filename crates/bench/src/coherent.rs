//! Requests that change a little from frame to frame, as they do while a user moves a region or a camera.

use super::timed;
use serde::Serialize;
use tetralod::geom::Bounds;
use tetralod::mt::MtInfo;
use tetralod::refine::{Need, Request, View};
use tetralod::session::{Session, SessionError};

/// What a walk of requests cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Coherent {
    /// Milliseconds a frame, half of the frames took at most that.
    pub median_ms: f64,
    /// Milliseconds a frame, nineteen of twenty frames took at most that.
    pub p95_ms: f64,
    /// Milliseconds from the base mesh to the mesh of the last frame: the fastest of several runs.
    pub cold_ms: f64,
    /// Updates applied or undone in the frame of the median number.
    pub updates: u64,
    /// Updates from the base mesh to the mesh of the last frame.
    pub cold_updates: u64,
    /// Tetrahedra of that mesh.
    pub tetrahedra: u32,
    /// Bytes of that mesh with adjacency, queues and all that goes with it, by tetrahedron.
    pub bytes_per_tet: f64,
}

/// The three walks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Walks {
    /// A cube of 30 % of the domain's width, within 1 % of the field's range, that moves by 5 % of its width a frame.
    #[serde(rename = "box")]
    pub roi: Coherent,
    /// An isovalue, within 1 %, that moves by 0.5 % of the range a frame.
    pub iso: Coherent,
    /// A camera that turns around the middle by one degree a frame: a picture of 1600 x 1000 pixels, within two of them.
    pub view: Coherent,
}

/// Frames of a walk.
const FRAMES: u32 = 40;
/// Runs from the base mesh.
const COLD_RUNS: u32 = 3;
const ERROR: f64 = 0.01;
const PIXELS: f64 = 2.0;
const VIEWPORT: [f64; 2] = [1600.0, 1000.0];

/// Walks through the MT of a session.
pub fn walks(session: &mut Session, clock: &mut dyn FnMut() -> f64) -> Result<Walks, SessionError> {
    let info = session.info().ok_or(SessionError::NotReady)?.clone();
    let mut walk = |request: &dyn Fn(&MtInfo, u32) -> Request| walk(session, &info, request, clock);
    Ok(Walks { roi: walk(&roi)?, iso: walk(&iso)?, view: walk(&view)? })
}

fn walk(
    session: &mut Session,
    info: &MtInfo,
    request: &dyn Fn(&MtInfo, u32) -> Request,
    clock: &mut dyn FnMut() -> f64,
) -> Result<Coherent, SessionError> {
    let base = Request::default();
    let last = request(info, FRAMES);
    let mut cold = f64::INFINITY;
    let mut cold_updates = 0;
    for _ in 0..COLD_RUNS {
        session.refine(&base)?;
        let mut time = 0.0;
        cold_updates = timed(clock, &mut time, || session.refine(&last))?.refined;
        cold = cold.min(time);
    }
    session.refine(&request(info, 0))?;
    let (mut times, mut updates) = (Vec::new(), Vec::new());
    for frame in 1..=FRAMES {
        let request = request(info, frame);
        let mut time = 0.0;
        let stats = timed(clock, &mut time, || session.refine(&request))?;
        times.push(time);
        updates.push((stats.refined + stats.coarsened) as f64);
    }
    sort(&mut times);
    sort(&mut updates);
    let ms = |seconds: f64| 1e3 * seconds;
    let part = |of_all: f64| (of_all * f64::from(FRAMES - 1)) as usize;
    let tetrahedra = session.mesh().map_or(0, |mesh| mesh.tet_count() as u32);
    Ok(Coherent {
        median_ms: ms(times[part(0.5)]),
        p95_ms: ms(times[part(0.95)]),
        cold_ms: ms(cold),
        updates: updates[part(0.5)] as u64,
        cold_updates,
        tetrahedra,
        bytes_per_tet: session.mesh_bytes() as f64 / f64::from(tetrahedra.max(1)),
    })
}

/// Sorts some dozens of numbers; the library's sorts would take kilobytes in the browser for that.
fn sort(numbers: &mut [f64]) {
    for end in 1..numbers.len() {
        let mut at = end;
        while at > 0 && numbers[at] < numbers[at - 1] {
            numbers.swap(at, at - 1);
            at -= 1;
        }
    }
}

/// The place at these fractions of the domain's extent.
fn at(info: &MtInfo, parts: [f64; 3]) -> [f64; 3] {
    let size = f64::from(1_u32 << info.lattice.bits);
    [0, 1, 2].map(|i| info.lattice.origin[i] + info.lattice.step[i] * size * parts[i])
}

fn roi(info: &MtInfo, frame: u32) -> Request {
    let width = 0.3;
    // There and back again, inside the domain.
    let step = f64::from(if frame <= 20 { frame } else { 40 - frame });
    let min = [0.2 + 0.05 * width * step, 0.35, 0.35];
    let bounds = Bounds { min: at(info, min), max: at(info, min.map(|x| x + width)) };
    Need::within(ERROR).inside(bounds).into()
}

fn iso(info: &MtInfo, frame: u32) -> Request {
    let field = &info.fields[0];
    Need::within(ERROR).around(0, &[field.min + (0.4 + 0.005 * f64::from(frame)) * field.range()]).into()
}

fn view(info: &MtInfo, frame: u32) -> Request {
    // One degree.
    let (cos, sin) = (0.999_847_695_156_391_3, 0.017_452_406_437_283_51);
    let (low, high) = (at(info, [0.0; 3]), at(info, [1.0; 3]));
    let reach = 0.5 * (0..3).map(|i| (high[i] - low[i]) * (high[i] - low[i])).sum::<f64>().sqrt();
    let mut to_eye = [0.8, -0.6];
    for _ in 0..frame {
        to_eye = [cos * to_eye[0] - sin * to_eye[1], sin * to_eye[0] + cos * to_eye[1]];
    }
    let [x, y] = to_eye;
    let (forward, right, up) = ([-x, -y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]);
    let distance = 2.0 * reach;
    let middle = at(info, [0.5; 3]);
    let eye = [middle[0] + distance * x, middle[1] + distance * y, middle[2]];
    // 60 degrees from left to right.
    let focal = 1.732_050_807_568_877_2;
    let row = |axis: [f64; 3], scale: f64| {
        let along = (0..3).map(|i| axis[i] * eye[i]).sum::<f64>();
        [axis[0] * scale, axis[1] * scale, axis[2] * scale, -along * scale]
    };
    let rows = [row(right, focal), row(up, focal * VIEWPORT[0] / VIEWPORT[1]), [0.0; 4], row(forward, 1.0)];
    let matrix = std::array::from_fn(|i| rows[i % 4][i / 4]);
    Need::seen(View { matrix, viewport: VIEWPORT }, PIXELS).into()
}
