//! Promise: the numbers of tetrahedra are what they say: sizes those of the geometry, errors within the
//! request, depths grow as the mesh gets finer, and data is missing exactly while it is.

use crate::support::meshes::{cube, hilly, linear};
use crate::support::random::Random;
use tetralod::format::{DecodeOptions, EncodeOptions, encode};
use tetralod::geom::Bounds;
use tetralod::mt::{Mt, MtKind, MultiTessellation};
use tetralod::refine::{Need, Request};
use tetralod::session::{Session, SessionError, TetQuantity};
use tetralod_build::{BuildConfig, build};

const BLOCK_BITS: u32 = 5;

fn file(kind: MtKind) -> Vec<u8> {
    let mesh = cube(8, &[hilly, linear]);
    let fields = mesh.fields.iter().map(|field| field.name.clone()).collect();
    let config = BuildConfig { block_bits: BLOCK_BITS, fields, ..BuildConfig::of(kind) };
    let built = build(&mesh, &config);
    let mt: Mt = built.expect("a valid mesh").mt;
    let mt = mt.in_pages(BLOCK_BITS).expect("a complete MT");
    encode(&mt, &EncodeOptions::default()).expect("a sound MT")
}

fn opened(kind: MtKind) -> Session {
    let mut session = Session::new();
    session.feed(&file(kind)).expect("a good file");
    session.finish().expect("a whole file");
    session
}

fn of(session: &mut Session, quantity: TetQuantity) -> Vec<f64> {
    let values = session.tet_quantity(quantity).expect("the base mesh is there");
    assert_eq!(values.len(), session.view().tets.len(), "{quantity}");
    values
}

#[test]
fn names_are_read_back() {
    for quantity in TetQuantity::ALL {
        assert_eq!(TetQuantity::named(&quantity.to_string()), Some(quantity));
    }
    assert_eq!(TetQuantity::named("colour"), None);
}

#[test]
fn nothing_is_said_before_there_is_a_mesh() {
    let mut session = Session::new();
    for quantity in TetQuantity::ALL {
        let mut values = vec![1.0];
        assert_eq!(session.tet_quantity_into(quantity, &mut values), Err(SessionError::NotReady));
        assert!(values.is_empty());
    }
    assert_eq!(session.reading([0.5; 3]), Err(SessionError::NotReady));
}

#[test]
fn without_regions_all_tetrahedra_are_of_the_first() {
    for kind in MtKind::ALL {
        let mut session = opened(kind);
        let regions = of(&mut session, TetQuantity::Region);
        assert!(regions.len() == session.view().tets.len() && regions.iter().all(|r| *r == 0.0));
    }
}

#[test]
fn sizes_are_longest_edges_and_errors_are_within_the_request() {
    for kind in MtKind::ALL {
        let mut session = opened(kind);
        let mut largest = f64::INFINITY;
        for error in [0.3, 0.1, 0.02, 0.0] {
            session.refine(&Request::within(error)).expect("a good request");
            let sizes = of(&mut session, TetQuantity::Size);
            let view = session.view();
            for (size, tet) in sizes.iter().zip(view.tets) {
                let p = tet.map(|v| view.positions[v as usize]);
                let length = |a: usize, b: usize| (0..3).map(|i| (p[a][i] - p[b][i]).powi(2)).sum::<f64>();
                let pairs = (0..4).flat_map(|a| (0..a).map(move |b| (a, b)));
                let longest = pairs.map(|(a, b)| length(a, b)).fold(0.0, f64::max).sqrt();
                assert!((size - longest).abs() < 1e-5, "{kind:?}: {size} {longest}");
            }
            let errors = of(&mut session, TetQuantity::Error);
            assert!(errors.iter().all(|e| *e <= error), "{kind:?} within {error}");
            let most = errors.iter().copied().fold(0.0, f64::max);
            assert!(most <= largest, "{kind:?}");
            largest = most;
            assert!(of(&mut session, TetQuantity::Missing).iter().all(|m| *m == 0.0), "{kind:?}");
        }
        assert_eq!(largest, 0.0);
    }
}

#[test]
fn the_error_of_one_field_is_shown_where_only_that_is_asked_for() {
    let mut session = opened(MtKind::HalfEdge);
    let need = Need { field: Some(1), ..Need::within(0.05) };
    session.refine(&Request::from(need)).expect("a good request");
    assert!(of(&mut session, TetQuantity::Error).iter().all(|e| *e <= 0.05));
    session.refine(&Request::within(0.5)).expect("a good request");
    assert!(of(&mut session, TetQuantity::Error).iter().any(|e| *e > 0.05), "the largest of both");
}

#[test]
fn depths_grow_where_the_mesh_gets_finer() {
    for kind in MtKind::ALL {
        let mut session = opened(kind);
        assert!(of(&mut session, TetQuantity::Depth).iter().all(|d| *d == 0.0), "the base mesh");
        let mut random = Random::new(4);
        let points: Vec<[f64; 3]> =
            (0..60).map(|_| [(); 3].map(|()| 0.02 + 0.96 * random.fraction())).collect();
        let mut before = vec![0.0; points.len()];
        for error in [0.5, 0.2, 0.05, 0.01, 0.0] {
            session.refine(&Request::within(error)).expect("a good request");
            let depths = of(&mut session, TetQuantity::Depth);
            for (p, before) in points.iter().zip(&mut before) {
                let reading = session.reading(*p).expect("it is open").expect("a point inside");
                let depth = depths[reading.tet as usize];
                assert!(depth >= *before, "{kind:?} at {p:?} within {error}: {depth} after {before}");
                *before = depth;
            }
        }
        assert!(before.iter().any(|d| *d > 3.0), "{kind:?}");
        let most = of(&mut session, TetQuantity::Depth).into_iter().fold(0.0, f64::max);
        let stats = tetralod::mt::stats(session.mt().expect("it is open")).expect("a sound MT");
        assert!(most <= stats.depth as f64, "{kind:?}: {most} of {}", stats.depth);
        // What was learnt with other meshes is what a fresh session finds.
        let region = Bounds { min: [0.0; 3], max: [0.4; 3] };
        let request = Request::from(Need::within(0.01).inside(region));
        let mut fresh = opened(kind);
        for session in [&mut session, &mut fresh] {
            session.refine(&request).expect("a good request");
        }
        let sorted = |session: &mut Session| {
            let mut depths = of(session, TetQuantity::Depth);
            depths.sort_by(f64::total_cmp);
            depths
        };
        assert_eq!(sorted(&mut session), sorted(&mut fresh), "{kind:?}");
    }
}

#[test]
fn blocks_are_those_of_the_file() {
    for kind in MtKind::ALL {
        let mut session = opened(kind);
        assert!(of(&mut session, TetQuantity::Block).iter().all(|b| *b == 0.0), "{kind:?}");
        session.refine(&Request::within(0.0)).expect("a good request");
        let count = session.mt().expect("a whole file").updates().div_ceil(1 << BLOCK_BITS);
        let blocks = of(&mut session, TetQuantity::Block);
        assert!(blocks.iter().all(|b| *b >= 0.0 && *b <= f64::from(count)), "{kind:?}");
        assert!(blocks.iter().any(|b| *b > 1.0), "{kind:?}");
    }
}

#[test]
fn data_is_missing_until_it_arrives() {
    {
        let kind = MtKind::HalfEdge;
        let file = file(kind);
        let mut session = Session::in_parts(DecodeOptions::default(), u64::MAX);
        let mut asked = false;
        let mut somewhere = 0;
        for _ in 0..100_000 {
            if session.mt().is_some() && !asked {
                session.request(&Request::within(0.01)).expect("a good request");
                asked = true;
            }
            if asked {
                let stats = session.step(&mut |_| true).expect("a sound file");
                let missing = of(&mut session, TetQuantity::Missing);
                let is_missing = missing.contains(&1.0);
                assert!(missing.iter().all(|m| *m == 0.0 || *m == 1.0));
                assert!(is_missing || stats.satisfied, "{kind:?}");
                assert!(!is_missing || !stats.satisfied, "{kind:?}");
                somewhere += u32::from(is_missing);
            }
            let Some(wanted) = session.wanted().pop() else { break };
            let end = wanted.range.end.min(file.len() as u64).min(wanted.range.start + 2000);
            let end = if asked { wanted.range.end.min(file.len() as u64) } else { end };
            let bytes = &file[wanted.range.start as usize..end as usize];
            session.take(&(wanted.range.start..end), bytes).expect("a sound file");
        }
        assert!(somewhere > 0, "{kind:?}");
        assert!(of(&mut session, TetQuantity::Missing).iter().all(|m| *m == 0.0), "{kind:?}");
    }
}

#[test]
fn data_of_files_from_front_to_back_is_missing_too() {
    for kind in [MtKind::Edge, MtKind::Vertex] {
        let file = file(kind);
        let mut session = Session::new();
        let mut somewhere = false;
        for piece in file.chunks(200) {
            session.feed(piece).expect("a good file");
            if session.mt().is_some() {
                session.refine(&Request::within(0.0)).expect("a good request");
                somewhere |= of(&mut session, TetQuantity::Missing).contains(&1.0);
            }
        }
        session.finish().expect("a whole file");
        session.refine(&Request::within(0.0)).expect("a good request");
        assert!(somewhere, "{kind:?}");
        assert!(of(&mut session, TetQuantity::Missing).iter().all(|m| *m == 0.0), "{kind:?}");
    }
}

#[test]
fn a_reading_tells_all_fields() {
    let mut session = opened(MtKind::HalfEdge);
    session.refine(&Request::within(0.0)).expect("a good request");
    let sizes = of(&mut session, TetQuantity::Size);
    let p = [0.31, 0.62, 0.47];
    let reading = session.reading(p).expect("it is open").expect("inside");
    assert_eq!((reading.position, reading.values.len(), reading.error), (p, 2, 0.0));
    assert!((reading.values[1] - linear(p)).abs() < 0.01, "{reading:?}");
    assert!((reading.values[0] - hilly(p)).abs() < 0.1, "{reading:?}");
    assert_eq!(reading.size, sizes[reading.tet as usize]);
    assert_eq!(session.reading([2.0; 3]), Ok(None));
    assert_eq!(session.reading([f64::NAN; 3]), Ok(None));
}
