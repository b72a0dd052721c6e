//! What sessions are asked for in tests.

use tetralod::geom::Bounds;
use tetralod::refine::{Need, Request};

/// Requests that go up and down, with and without a part and a budget.
pub fn requests() -> [Request; 7] {
    let uniform = |error| Request::within(error);
    let roi = Bounds { min: [0.1; 3], max: [0.5; 3] };
    [
        uniform(0.05),
        Need::within(0.0).inside(roi).into(),
        Need::within(0.01).around(0, &[0.4]).into(),
        uniform(0.0),
        uniform(0.0).at_most(500),
        uniform(0.002),
        uniform(f64::INFINITY),
    ]
}
