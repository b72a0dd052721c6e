//! Promise: what a request needs of a file elsewhere is asked for at once. One look at the index gives every block that it can need, and
//! no byte comes twice.

use crate::support::meshes::{bent, blocks, hilly, linear};
use crate::support::network::{Network, Protocol, Visitor};
use crate::support::random::Random;
use std::sync::{Arc, LazyLock};
use tetralod::format::{EncodeOptions, encode};
use tetralod::geom::{Bounds, Camera};
use tetralod::mesh::{Field, TetMesh};
use tetralod::mt::Mt;
use tetralod::refine::{Criterion, Custom, Inside, Need, Region, Request, TetData, Transfer, View};
use tetralod::session::Session;
use tetralod::stream::LoaderOptions;
use tetralod_build::{BuildConfig, build};
use tetralod_io::generate;

const NETWORK: Network = Network { latency_ms: 40.0, bytes_per_ms: 2500.0, protocol: Protocol::Http1 };
const NETWORKS: [Network; 2] = [NETWORK, Network { protocol: Protocol::Http2, ..NETWORK }];

/// A half-edge MT in many blocks.
fn many_blocks(mesh: &TetMesh) -> Mt {
    let config = BuildConfig { block_bits: 4, all_fields: true, ..BuildConfig::default() };
    build(mesh, &config).expect("a valid mesh").mt
}

/// Files that are several times as large as what a session asks for at first, with names.
static FILES: LazyLock<Vec<(&str, Vec<u8>)>> = LazyLock::new(|| {
    let mut ell = blocks([32, 26, 18], &[hilly, linear], |c| c[0] < 18 || c[1] < 11);
    let mut random = Random::new(3);
    for field in &mut ell.fields {
        field.values.iter_mut().for_each(|x| *x += 0.1 * random.fraction());
    }
    let bucky = generate::bucky(27).expect("a size that is allowed");
    let files = [("bucky", bucky), ("bent", bent(25)), ("ell", ell)].map(|(name, mesh)| {
        (name, encode(&many_blocks(&mesh), &EncodeOptions::default()).expect("a sound MT"))
    });
    for (name, file) in &files {
        assert!(file.len() > 130_000, "{name}: {}", file.len());
    }
    files.into()
});

/// From beside the model into a corner of it.
fn view(bounds: &Bounds) -> View {
    let mut camera = Camera::home(bounds, 1.5);
    camera.zoom(0.2);
    camera.pan(0.3, 0.2);
    View { matrix: camera.view_projection(1.5).to_cols_array(), viewport: [1200.0, 800.0] }
}

/// Requests of every kind, with names.
fn requests(session: &Session) -> Vec<(&'static str, Request)> {
    let bounds = session.bounds().expect("a file that is open");
    let fields = &session.info().expect("a file that is open").fields;
    let at = |part: f64| [0, 1, 2].map(|i| bounds.min[i] + part * (bounds.max[i] - bounds.min[i]));
    let inside = Bounds { min: at(0.3), max: at(0.55) };
    let corner = Bounds { min: at(0.0), max: at(0.1) };
    let last = fields.len() - 1;
    let value = |part: f64| fields[last].min + part * fields[last].range();
    let points = vec![(value(0.6), [0.0; 4]), (value(0.8), [1.0, 0.5, 0.0, 0.7])];
    let colours = Transfer { field: last, points, unit_length: 1.0 };
    let ball = Region::Sphere { centre: at(0.7), radius: 0.1 * bounds.diagonal() };
    let slab = Region::Slab { normal: [1.0, 1.0, 0.0], offset: at(0.5)[0] + at(0.5)[1], thickness: 0.0 };
    vec![
        ("all", Request::within(0.0)),
        ("5 %", Request::within(0.05)),
        ("a box", Need::within(0.0).inside(inside).into()),
        ("a box at 1 %", Need::within(0.01).inside(inside).into()),
        ("a corner", Need::within(0.0).inside(corner).into()),
        ("a ball", Need::within(0.002).inside(ball.clone()).into()),
        ("a section", Need::within(0.005).inside(slab).into()),
        ("an isosurface", Need::within(0.0).around(last, &[value(0.5)]).into()),
        ("an isosurface in a box", Need::within(0.0).around(last, &[value(0.3)]).inside(inside).into()),
        ("a view", Need::seen(view(&bounds), 1.0).into()),
        ("colours", Need::shown(colours, 0.01).into()),
        (
            "several",
            Request::within(0.1).and(Need::within(0.0).inside(ball)).and(Need::seen(view(&bounds), 4.0)),
        ),
    ]
}

#[test]
fn one_look_at_the_index_gives_all_that_a_request_needs() {
    for (what, file) in FILES.iter() {
        let mut whole = Session::new();
        whole.feed(file).expect("a sound file");
        let opened = Visitor::new(file, NETWORK, LoaderOptions::default()).open();
        assert!(opened.rounds <= 2, "{what}: {opened:?}");
        let cases = [(NETWORK, Some(0)), (NETWORK, Some(1000)), (NETWORK, None), (NETWORKS[1], None)];
        for (name, request) in requests(&whole) {
            whole.refine(&request).expect("a sensible request");
            for (network, gap) in cases {
                let options = LoaderOptions { gap, ..LoaderOptions::default() };
                let mut visitor = Visitor::new(file, network, options);
                visitor.open();
                let cost = visitor.refine(&request).expect("a sensible request");
                let case = format!("{what}, {name}, gap {gap:?}, {:?}: {cost:?}", network.protocol);
                assert_eq!(visitor.session.hash(), whole.hash(), "{case}");
                assert_eq!(visitor.session.block_progress().missed, 0, "{case}");
                assert!(cost.rounds <= 1 && cost.repeated == 0, "{case}");
            }
        }
    }
}

/// Opening takes a round for what shows where the blocks begin and one for the rest up to there, as exactly as the curve states it.
#[test]
fn a_long_index_takes_no_more_rounds_than_a_short_one() {
    let mut mesh = generate::bucky(27).expect("a size that is allowed");
    let mut random = Random::new(5);
    for number in 0..24 {
        let values = mesh.positions.iter().map(|p| p[number % 3] + 0.1 * random.fraction()).collect();
        mesh.fields.push(Field::new(format!("field {number}"), values));
    }
    let mt = many_blocks(&mesh);
    // Not in pages.
    let long_index = EncodeOptions { index_page_bits: Some(u32::MAX), ..EncodeOptions::default() };
    let notes = |count| (0..count).map(|note: u32| (note.to_string(), "a".repeat(60_000))).collect();
    let long_both = EncodeOptions { metadata: notes(3), ..long_index.clone() };
    // The index begins at the end of what is asked for at first.
    let late_index = EncodeOptions { metadata: notes(1), ..long_index.clone() };
    for (options, most_rounds) in [(long_index, 2), (late_index, 2), (long_both, 3)] {
        let file = encode(&mt, &options).expect("a sound MT");
        let mut whole = Session::new();
        whole.feed(&file).expect("a sound file");
        let head_end = whole.decoder().head_end().expect("an index");
        assert!(head_end > 2 << 16, "{head_end}");
        let curve = whole.bytes_by_error(0);
        for (network, point) in
            NETWORKS.into_iter().flat_map(|network| [(network, 0), (network, curve.len() / 2)])
        {
            let mut visitor =
                Visitor::new(&file, network, LoaderOptions { gap: Some(0), ..LoaderOptions::default() });
            let opened = visitor.open();
            assert!(opened.rounds <= most_rounds && opened.repeated == 0, "{opened:?}");
            assert_eq!(opened.bytes, head_end);
            assert_eq!(visitor.session.bytes_by_error(0), curve);
            let request = Need::within(curve[point].error).of_field(0).into();
            let cost = visitor.refine(&request).expect("a sensible request");
            assert!(cost.rounds <= 1 && cost.repeated == 0, "{cost:?}");
            assert_eq!(opened.bytes + cost.bytes, curve[point].bytes);
        }
        let (_, a_box) = requests(&whole).swap_remove(2);
        let mut visitor = Visitor::new(&file, NETWORK, LoaderOptions::default());
        let rounds = visitor.open().rounds + visitor.refine(&a_box).expect("a sensible request").rounds;
        assert!(rounds <= most_rounds + 1, "{rounds}");
    }
}

/// Waiting for what a request needs is no slower than reading all the rest of the file, however many parts that is and whatever the
/// network is like.
#[test]
fn no_request_takes_longer_than_the_rest_of_the_file() {
    let paces = [(5.0, 500.0), (40.0, 2500.0), (300.0, 1000.0), (300.0, 20_000.0)];
    let networks = paces.into_iter().flat_map(|(latency_ms, bytes_per_ms)| {
        NETWORKS.map(|network| Network { latency_ms, bytes_per_ms, ..network })
    });
    for (what, file) in FILES.iter() {
        let mut whole = Session::new();
        whole.feed(file).expect("a sound file");
        for network in networks.clone() {
            for (name, request) in requests(&whole) {
                let mut visitor = Visitor::new(file, network, LoaderOptions::default());
                let rest = file.len() as u64 - visitor.open().bytes;
                let cost = visitor.refine(&request).expect("a sensible request");
                let streamed = (network.latency_ms + rest as f64 / network.bytes_per_ms) / 1000.0;
                assert!(
                    cost.seconds <= 1.05 * streamed,
                    "{what}, {name}, {network:?}: {cost:?} for {streamed}"
                );
            }
        }
    }
}

/// The same for one request after the other, each of which leaves blocks behind.
#[test]
fn no_byte_comes_twice() {
    for ((what, file), network) in FILES.iter().flat_map(|file| NETWORKS.map(|network| (file, network))) {
        let mut whole = Session::new();
        whole.feed(file).expect("a sound file");
        let mut visitor =
            Visitor::new(file, network, LoaderOptions { gap: Some(700), ..LoaderOptions::default() });
        let mut bytes = visitor.open().bytes;
        for (name, request) in requests(&whole).into_iter().rev() {
            whole.refine(&request).expect("a sensible request");
            let cost = visitor.refine(&request).expect("a sensible request");
            bytes += cost.bytes;
            assert_eq!(visitor.session.hash(), whole.hash(), "{what}, {name}");
            assert!(cost.rounds <= 1 && cost.repeated == 0, "{what}, {name}: {cost:?}");
            assert_eq!(visitor.session.block_progress().missed, 0, "{what}, {name}");
        }
        assert!(bytes <= file.len() as u64, "{what}: {bytes} of {}", file.len());
    }
}

/// Streams of one connection share what it brings: many are no faster than one, where as many connections are.
#[test]
fn streams_share_their_connection() {
    for (what, file) in FILES.iter() {
        let [apart, together] = NETWORKS.map(|network| {
            let mut visitor = Visitor::new(file, network, LoaderOptions::default());
            visitor.open();
            visitor.refine(&Request::within(0.0)).expect("a sensible request")
        });
        let alone = (NETWORK.latency_ms + together.bytes as f64 / NETWORK.bytes_per_ms) / 1000.0;
        assert!(together.requests > 1 && together.seconds >= alone - 1e-9, "{what}: {together:?}, {alone}");
        assert!(apart.bytes == together.bytes && apart.seconds < alone, "{what}: {apart:?}, {alone}");
    }
}

/// A budget is for what has the largest errors: little is fetched beyond what it has room for.
#[test]
fn budgets_fetch_what_they_have_room_for() {
    let (_, file) = &FILES[0];
    let mut whole = Session::new();
    whole.feed(file).expect("a sound file");
    for budget in [5000, 15_000, 40_000] {
        for request in [Request::within(0.0), Need::within(0.0).around(0, &[0.5]).into()] {
            let request: Request = request.at_most(budget);
            whole.refine(&request).expect("a sensible request");
            let mut visitor = Visitor::new(file, NETWORK, LoaderOptions::default());
            visitor.open();
            visitor.refine(&request).expect("a sensible request");
            assert_eq!(visitor.session.hash(), whole.hash(), "{request:?}");
            let progress = visitor.session.block_progress();
            let most = progress.blocks * budget / 60_000 + 400;
            assert!(progress.here <= most, "{budget}: {progress:?}");
        }
    }
}

/// What only a caller's function can tell is found step by step, unless it says in which box it asks for something.
#[test]
fn requests_of_the_callers_own_have_their_mesh_too() {
    for (what, file) in FILES.iter() {
        let mut whole = Session::new();
        whole.feed(file).expect("a sound file");
        let info = whole.info().expect("a file that is open").clone();
        let bounds = whole.bounds().expect("a file that is open");
        let half = (0.5 * f64::from(1_u32 << info.lattice.bits)) as i32;
        let left = move || {
            Custom::new(move |tet: &TetData<'_>| {
                let is_left = tet.corners.iter().any(|corner| corner[0] < half);
                if is_left { tet.error.error() / 0.001 } else { 0.0 }
            })
        };
        let at = |part: f64| [0, 1, 2].map(|i| bounds.min[i] + part * (bounds.max[i] - bounds.min[i]));
        let low = Bounds { min: at(0.0), max: at(0.3) };
        let limited: Arc<dyn Criterion> = Arc::new(Inside::new(left(), low, info.lattice));
        let free: Arc<dyn Criterion> = Arc::new(left());
        let mut applied = Vec::new();
        for (criterion, most_rounds) in [(limited, 1), (free, u32::MAX)] {
            let request = Request::within(0.3);
            let custom = [criterion];
            whole.request_with(&request, &custom).expect("a sensible request");
            applied.push(whole.step(&mut |_| true).expect("a sound file").applied);
            let mut visitor = Visitor::new(file, NETWORK, LoaderOptions::default());
            visitor.open();
            let cost = visitor.refine_with(&request, &custom).expect("a sensible request");
            assert_eq!(visitor.session.hash(), whole.hash(), "{what}, {custom:?}");
            assert_eq!(visitor.session.block_progress().missed, 0, "{what}, {custom:?}");
            assert!(cost.rounds <= most_rounds && cost.repeated == 0, "{what}, {custom:?}: {cost:?}");
        }
        assert!(applied[0] < applied[1], "{what}: {applied:?}");
    }
}
