//! What sessions are asked for in tests.

use tetralod::geom::Bounds;
use tetralod::refine::Request;

/// Requests that go up and down, with and without a part and a budget.
pub fn requests() -> [Request; 7] {
    let uniform = |error| Request { error, ..Request::default() };
    let roi = Some(Bounds { min: [0.1; 3], max: [0.5; 3] });
    [
        uniform(0.05),
        Request { roi, ..uniform(0.0) },
        Request { isovalues: vec![0.4], ..uniform(0.01) },
        uniform(0.0),
        Request { max_tets: Some(500), ..uniform(0.0) },
        uniform(0.002),
        uniform(f64::INFINITY),
    ]
}
