//! Promise: a mesh that is refined for a transfer function shows the picture of the full mesh within the error of the
//! request, and is nearer to it than one with as many tetrahedra that is refined everywhere alike.
//!
//! The error is bounded at the vertices of the full mesh. Between them nothing is promised, and smaller errors than those
//! tested here are not kept there: 0.5 % becomes 0.7 % in this picture.

use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::{Bounds, Camera};
use tetralod::mt::MtKind;
use tetralod::refine::{Need, Request, Transfer};
use tetralod::session::Session;
use tetralod::view::{Light, Medium};
use tetralod_build::{BuildConfig, build};
use tetralod_io::generate;

const SIZE: [u32; 2] = [64, 48];
const UNIT_LENGTH: f64 = 0.1;
const BACKGROUND: [f64; 3] = [0.2, 0.3, 0.4];

/// The bucky ball, of which each vertex is an update.
fn session() -> Session {
    let mesh = generate::bucky(33).expect("a small size");
    let config = BuildConfig::of(MtKind::HalfEdge);
    let mt = build(&mesh, &config).expect("a good mesh").mt;
    let mut session = Session::new();
    session.feed(&encode(&mt, &EncodeOptions::default()).expect("a complete MT")).expect("a good file");
    session
}

fn points() -> Vec<(f64, [f64; 4])> {
    vec![
        (0.0, [0.1, 0.2, 0.6, 0.0]),
        (0.3, [0.2, 0.6, 0.9, 0.05]),
        (0.6, [0.95, 0.8, 0.3, 0.2]),
        (1.1, [0.9, 0.2, 0.1, 0.8]),
    ]
}

/// How many tetrahedra the mesh of a request has, and its picture.
fn picture(session: &mut Session, request: &Request) -> (usize, Vec<Light>) {
    session.refine(request).expect("a good request");
    let view = session.view();
    let bounds = Bounds { min: [0.0; 3], max: [1.0; 3] };
    let mut camera = Camera::home(&bounds, f64::from(SIZE[0]) / f64::from(SIZE[1]));
    camera.zoom(0.6);
    let picture = Medium::new(&points(), UNIT_LENGTH * bounds.diagonal()).picture(view, &camera, SIZE);
    (session.mesh().expect("a mesh").tet_count(), picture)
}

/// The largest difference of a channel in all pixels, in 99 of 100 and in the mean, over a background.
fn off(a: &[Light], b: &[Light]) -> [f64; 3] {
    let of = |(a, b): (&Light, &Light)| {
        let (a, b) = (a.on(BACKGROUND), b.on(BACKGROUND));
        (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
    };
    let mut all: Vec<f64> = a.iter().zip(b).map(of).collect();
    all.sort_by(f64::total_cmp);
    [all[all.len() - 1], all[all.len() * 99 / 100], all.iter().sum::<f64>() / all.len() as f64]
}

#[test]
fn pictures_are_within_the_colour_error_of_the_request() {
    let mut session = session();
    let (all, full) = picture(&mut session, &Request::within(0.0));
    for error in [0.01, 0.02, 0.05] {
        let transfer = Transfer { field: 0, points: points(), unit_length: UNIT_LENGTH };
        let shown = Request { needs: vec![Need::shown(transfer, error)], ..Request::within(0.0) };
        let (tets, selective) = picture(&mut session, &shown);
        let found = off(&selective, &full);
        // With as many tetrahedra, of the same error everywhere.
        let (_, uniform) = picture(&mut session, &Request::within(0.0).at_most(tets as u32));
        let other = off(&uniform, &full);
        println!(
            "colour error {error}: {tets} of {all} tetrahedra, {found:.5?} off; as many everywhere: {other:.5?}"
        );
        assert!(tets < all / 2 && found[0] <= error, "{error}: {found:?}");
        assert!(found[1] < other[1] && found[2] < other[2], "{error}: {found:?}, uniform {other:?}");
    }
}
