//! Promise: the benchmark measures what was done, with the clock that it is given, and takes whole files only.

use crate::support::meshes::{built, cube, hilly};
use tetralod::format::{EncodeOptions, encode};
use tetralod::mt::MultiTessellation;
use tetralod::session::SessionError;
use tetralod_bench as bench;

/// A clock that says a millisecond has passed whenever it is asked.
fn ticking() -> impl FnMut() -> f64 {
    let mut asked = 0;
    move || {
        asked += 1;
        f64::from(asked) * 1e-3
    }
}

#[test]
fn rates_are_counts_over_seconds() {
    let mt = built(&cube(5, &[hilly])).mt;
    let bytes = encode(&mt.clone().into(), &EncodeOptions::default()).expect("a whole MT");
    let report = bench::run(&bytes, &mut ticking(), 0.1).expect("a good file");
    assert_eq!((report.updates, report.applied), (mt.updates(), mt.updates()));
    assert_eq!(u64::from(report.tetrahedra), mt.info().tetrahedra);
    assert!(report.runs > 3 && report.runs < 100, "{report:?}");
    let near = |rate: f64, count: u32| (rate * 1e-3 - f64::from(count)).abs() < 1e-6 * f64::from(count);
    assert!(near(report.decode_updates, report.updates), "{report:?}");
    assert!(near(report.refine_updates, report.updates), "{report:?}");
    assert!(near(report.refine_tets, report.tetrahedra), "{report:?}");
    assert!(near(report.coarsen_updates, report.updates), "{report:?}");
    assert!(near(report.isosurface_tets, report.tetrahedra), "{report:?}");
    for walk in [report.coherent.roi, report.coherent.iso, report.coherent.view] {
        let times = [walk.median_ms, walk.p95_ms, walk.cold_ms];
        assert!(times.iter().all(|ms| (ms - 1.0).abs() < 1e-6), "{walk:?}");
        assert!(walk.tetrahedra >= mt.base().tets.len() as u32 && walk.bytes_per_tet > 36.0, "{walk:?}");
    }
    assert!(report.coherent.roi.cold_updates > 0);
}

#[test]
fn parts_of_files_are_refused() {
    let bytes = encode(&built(&cube(3, &[hilly])).mt.into(), &EncodeOptions::default()).expect("a whole MT");
    for length in [0, 7, bytes.len() / 2, bytes.len() - 1] {
        let error = bench::run(&bytes[..length], &mut ticking(), 0.0).expect_err("a part of a file");
        assert!(matches!(error, SessionError::Format(_)), "{length}: {error}");
    }
    let other = b"no MT at all, but long enough for a header";
    assert!(matches!(bench::run(other, &mut ticking(), 0.0), Err(SessionError::Format(_))));
}
