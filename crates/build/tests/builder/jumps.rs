//! Fields that jump where regions meet: a vertex there has a value for each of them.

use crate::parts::{bytes, in_parts};
use crate::support::meshes::{bent, blocks};
use std::collections::BTreeMap;
use tetralod::format::{DecodeOptions, Decoder, EncodeOptions, encode};
use tetralod::geom::Lattice;
use tetralod::mesh::{CellsToPoints, Field, NONE, TetMesh};
use tetralod::mt::{
    CurrentMesh, HalfEdgeMt, HalfEdgeUpdate, Mt, MtKind, MultiTessellation, UpdateId, UpdatePages,
};
use tetralod::refine::{Front, LodCriterion, Request};
use tetralod::session::Session;
use tetralod::view::{Difference, IsoSurface, MeshView, MeshWithin};
use tetralod_build::verify::{self, Reference, Sample};
use tetralod_build::{BuildConfig, BuildError, Construction, build};

const N: u32 = 10;

/// Pseudo-random numbers in 0 to 1.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut x = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
        (x >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// The place of the middle of each tetrahedron in a cube of side 1.
fn middles(mesh: &TetMesh) -> Vec<[f64; 3]> {
    let middle =
        |tet: &[u32; 4]| [0, 1, 2].map(|k| tet.iter().map(|&v| 0.25 * mesh.positions[v as usize][k]).sum());
    mesh.tets.iter().map(middle).collect()
}

/// A block of regions, of which up to four meet in a vertex, with one field at points and two at cells: `stress` varies in each region and
/// jumps, `material` is constant in each.
fn parted(seed: u64, label: impl Fn([f64; 3]) -> f64) -> TetMesh {
    let field = |p: [f64; 3]| (7.0 * p[0]).sin() + p[1] * p[2];
    with_cells(blocks([N; 3], &[field], |[x, y, _]| x < N - 2 || y > 1), seed, label)
}

/// A mesh of one field with such regions and fields.
fn with_cells(mut mesh: TetMesh, seed: u64, label: impl Fn([f64; 3]) -> f64) -> TetMesh {
    mesh.fields[0].name = "heat".into();
    let middles = middles(&mesh);
    let labels: Vec<f64> = middles.iter().copied().map(label).collect();
    let mut noise = noise(seed);
    let stress = |(&label, p): (&f64, &[f64; 3])| 3.0 * label + (5.0 * p[1]).cos() * p[0] + 0.1 * noise();
    let stress = labels.iter().zip(&middles).map(stress).collect();
    let material = labels.iter().map(|label| 10.0 - 4.0 * label).collect();
    mesh.cell_fields =
        vec![Field::new("part", labels), Field::new("stress", stress), Field::new("material", material)];
    mesh
}

fn quarters([x, y, _]: [f64; 3]) -> f64 {
    f64::from(u8::from(x > 0.5)) + 2.0 * f64::from(u8::from(y > 0.4))
}

fn random(p: [f64; 3]) -> f64 {
    let [x, y, z] = p.map(|x| (x * 5.0) as u64);
    (noise(1 + x + 10 * y + 100 * z)() * 3.0).floor()
}

fn config() -> BuildConfig {
    BuildConfig { preserve: vec!["part".into()], all_fields: true, block_bits: 4, ..BuildConfig::default() }
}

fn by_region(mut mesh: TetMesh) -> TetMesh {
    mesh.settle_cells(CellsToPoints::ByRegion, &["part".to_owned()]);
    mesh
}

fn built(mesh: &TetMesh) -> HalfEdgeMt {
    match build(mesh, &config()).expect("a mesh to build on").mt {
        Mt::HalfEdge(mt) => mt,
        mt => panic!("an MT of kind {:?}", mt.info().kind),
    }
}

/// The mean of a field at cells around each point in each region, weighted by volume, from plain arrays; by place on the lattice and label.
fn means(mesh: &TetMesh, name: &str, lattice: &Lattice) -> BTreeMap<([i32; 3], i64), f64> {
    let field = |name: &str| &mesh.cell_fields.iter().find(|field| field.name == name).expect("it").values;
    let (values, labels) = (field(name), field("part"));
    let mut sums: BTreeMap<([i32; 3], i64), [f64; 2]> = BTreeMap::new();
    for (t, tet) in mesh.tets.iter().enumerate() {
        let [a, b, c, d] = tet.map(|v| mesh.positions[v as usize]);
        let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
        let minor = |i: usize, j: usize| v[i] * w[j] - v[j] * w[i];
        let volume = u[0] * minor(1, 2) + u[1] * minor(2, 0) + u[2] * minor(0, 1);
        for p in [a, b, c, d] {
            let sum = sums.entry((lattice.nearest(p), labels[t] as i64)).or_default();
            sum[0] += volume * values[t];
            sum[1] += volume;
        }
    }
    sums.into_iter().map(|(key, [sum, volume])| (key, sum / volume)).collect()
}

fn front_at(mt: &HalfEdgeMt, request: &Request) -> Front {
    let mut front = Front::new(mt).expect("a valid base mesh");
    satisfy(mt, &mut front, request);
    front
}

fn satisfy(mt: &HalfEdgeMt, front: &mut Front, request: &Request) {
    let outcome = front.satisfy(mt, &LodCriterion::new(mt.info(), request), request.budget);
    assert!(outcome.expect("a valid MT").satisfied);
}

/// The MT with other residuals in further regions at one update.
fn with_residuals(mt: &HalfEdgeMt, update: u32, residuals: &[i32]) -> HalfEdgeMt {
    let record = |u: u32| {
        let own = mt.update(UpdateId(u)).expect("it is here");
        if u == update { HalfEdgeUpdate { side_residuals: residuals, ..own } } else { own }
    };
    let page = update >> mt.page_bits();
    let records: Vec<HalfEdgeUpdate<'_>> = mt.page_updates(page).map(record).collect();
    let mut changed = mt.clone();
    changed.remove_page(page).expect("it is here");
    changed.insert_page(page, &records).expect("a sound page");
    changed
}

/// Checks every corner of a mesh against the means of the input, in a field at cells.
fn check_corners(mt: &HalfEdgeMt, mesh: &CurrentMesh, input: &TetMesh, field: usize) {
    mesh.check().expect("a sound mesh");
    let (info, regions) = (&mt.info().fields[field], mt.regions().expect("regions"));
    let means = means(input, &info.name, &mt.info().lattice);
    for (t, tet) in mesh.tets().iter().enumerate() {
        let label = regions.all[usize::from(mesh.regions()[t])].labels[0];
        for (&v, &joined) in tet.iter().zip(&mesh.joined_tets()[t]) {
            let place = mesh.positions()[v as usize];
            assert_eq!((place, mesh.vertex(v)), (mesh.positions()[joined as usize], mesh.vertex(joined)));
            let (shown, mean) = (info.value(mesh.levels(v)[field]), means[&(place, label)]);
            assert!((shown - mean).abs() <= 0.51 * info.step, "{} {shown}, not {mean}", info.name);
        }
    }
}

#[test]
fn corners_have_the_means_of_their_regions_at_every_error() {
    for (seed, label) in [quarters as fn([f64; 3]) -> f64, random].into_iter().enumerate() {
        let input = parted(seed as u64, label);
        let mt = built(&by_region(input.clone()));
        let regions = mt.regions().expect("regions");
        assert_eq!(regions.sides.jumps, [false, true, true, true]);
        let mut front = Front::new(&mt).expect("a valid base mesh");
        let mut points = Vec::new();
        for error in [f64::INFINITY, 0.2, 0.01, 0.0, 0.03, 0.1, 0.0] {
            satisfy(&mt, &mut front, &Request::within(error));
            assert_eq!(front.mesh().hash(), front_at(&mt, &Request::within(error)).mesh().hash());
            (1..4).for_each(|field| check_corners(&mt, front.mesh(), &input, field));
            let mut slots: Vec<u32> = front.mesh().tets().as_flattened().to_vec();
            slots.sort_unstable();
            slots.dedup();
            assert_eq!(slots.len(), front.mesh().vertex_count(), "each point is a corner");
            assert_eq!(slots.len(), front.mesh().positions().len());
            points.push(slots.len());
        }
        let places = mt.info().vertices as usize;
        assert!(points[3] > places + places / 20, "{points:?} of {places}: interfaces have several");
        assert_eq!(points[3], points[6]);
    }
}

#[test]
fn files_keep_the_values_of_each_region() {
    let input = parted(3, random);
    let mt = built(&by_region(input.clone()));
    let bytes = encode(&mt.clone().into(), &EncodeOptions::default()).expect("an MT that can be written");
    assert_eq!(bytes[12], 2, "a reader that knows nothing of it refuses it");
    let mut decoder = Decoder::default();
    decoder.feed(&bytes).expect("a sound file");
    decoder.finish().expect("a whole file");
    let read = decoder.into_mt().expect("all has arrived");
    assert!(Mt::from(mt.clone()) == read);
    // Nothing is known of an MT from a file but what a run through it finds.
    assert!(encode(&read, &EncodeOptions::default()).expect("an MT that can be written") == bytes);
    let other = read.in_pages(7).and_then(|mt| mt.in_pages(4)).expect("all is here");
    assert!(other == read);
    // Every prefix that has a mesh has the values of the regions.
    let mut decoder = Decoder::default();
    for piece in bytes.chunks(bytes.len() / 40 + 1) {
        decoder.feed(piece).expect("a sound file");
        let Some(Mt::HalfEdge(mt)) = decoder.mt() else { continue };
        let mut front = Front::new(mt).expect("a valid base mesh");
        let criterion = LodCriterion::new(mt.info(), &Request::within(0.0));
        front.satisfy(mt, &criterion, Request::within(0.0).budget).expect("a valid MT");
        check_corners(mt, front.mesh(), &input, 1);
    }
    // Fields that are read alone have them, or need none.
    for (name, jumps) in [("stress", true), ("heat", false)] {
        let options = DecodeOptions { fields: vec![name.to_owned()], ..DecodeOptions::default() };
        let mut decoder = Decoder::new(options);
        decoder.feed(&bytes).expect("a sound file");
        let Some(Mt::HalfEdge(mt)) = decoder.into_mt() else { panic!("a half-edge MT") };
        assert_eq!(mt.has_sides(), jumps);
        let front = front_at(&mt, &Request::within(0.0));
        match jumps {
            true => check_corners(&mt, front.mesh(), &input, 0),
            false => assert_eq!(front.mesh().positions().len(), mt.info().vertices as usize),
        }
    }
}

#[test]
fn verification_holds_on_each_side_and_finds_what_is_wrong() {
    let input = by_region(parted(5, quarters));
    let mt = built(&input);
    let valid = |mt: &HalfEdgeMt| {
        let sample = Sample { requests: 10, vertices: 2000 };
        verify::run_sample(mt, &input, Reference::Mesh, sample, &mut |_, _| {})
    };
    let report = valid(&mt);
    assert!(report.valid, "{:#?}", report.failures);
    // One level too high at a vertex in one further region.
    let has_sides = |u: &u32| !mt.update(UpdateId(*u)).expect("it is here").side_residuals.is_empty();
    let update = (0..mt.updates()).find(has_sides).expect("an interface");
    let record = mt.update(UpdateId(update)).expect("it is here");
    let mut residuals = record.side_residuals.to_vec();
    residuals[2] += 40;
    assert!(!valid(&with_residuals(&mt, update, &residuals)).valid);
    // Values for regions that the vertex is not in: what it needs shows when it is applied.
    residuals.extend_from_within(..4);
    let tampered = with_residuals(&mt, update, &residuals);
    let criterion = LodCriterion::new(mt.info(), &Request::within(0.0));
    let mut front = Front::new(&tampered).expect("a valid base mesh");
    assert!(front.satisfy(&tampered, &criterion, Request::within(0.0).budget).is_err());
}

#[test]
fn parts_keep_the_values_of_each_region() {
    // The lattice moves the points of the second one.
    let inputs = [parted(13, random), with_cells(bent(9), 17, |[x, y, _]| quarters([x - 0.4, y - 0.5, 0.0]))];
    for input in inputs {
        let mesh = by_region(input.clone());
        let whole = build(&mesh, &config()).expect("a mesh to build on");
        assert!(bytes(&in_parts(&mesh, &config(), 1)) == bytes(&whole), "one part is the whole");
        for parts in [2, 16] {
            let built = in_parts(&mesh, &config(), parts);
            // And what its blocks reach is compared with a run through the MT.
            assert!(!bytes(&built).is_empty());
            let Mt::HalfEdge(mt) = &built.mt else { panic!("a half-edge MT") };
            for error in [f64::INFINITY, 0.1, 0.0] {
                let front = front_at(mt, &Request::within(error));
                (1..4).for_each(|field| check_corners(mt, front.mesh(), &input, field));
            }
            let sample = Sample { requests: 6, vertices: usize::MAX };
            let report = verify::run_sample(mt, &mesh, Reference::Mesh, sample, &mut |_, _| {});
            assert!(report.valid, "{parts}: {:#?}", report.failures);
            for sample in verify::samples(mt.info(), &mesh, 12, 0.05) {
                let report = verify::run_request(mt, &mesh, None, &sample);
                assert!(report.valid, "{parts}, {}: {:#?}", sample.name, report.failures);
            }
        }
    }
}

#[test]
fn single_requests_are_verified_on_each_side() {
    let mesh = by_region(parted(19, quarters));
    let mt = built(&mesh);
    let failures = |input: &TetMesh| {
        let samples = verify::samples(mt.info(), input, 12, 0.05);
        let of = |sample| verify::run_request(&mt, input, None, sample).failures;
        samples.iter().flat_map(of).collect::<Vec<String>>()
    };
    assert_eq!(failures(&mesh), [""; 0]);
    let mut other = mesh.clone();
    let stress = other.fields.iter_mut().find(|field| field.name == "stress").expect("it");
    stress.sides.iter_mut().for_each(|value| *value += 0.5);
    let found = failures(&other);
    assert!(found.iter().any(|failure| failure.contains("reference vertex")), "{found:#?}");
    assert!(found.iter().any(|failure| failure.contains("are of the input")), "{found:#?}");
}

#[test]
fn curved_interfaces_that_move_keep_values_apart() {
    let curved = |[x, y, z]: [f64; 3]| {
        f64::from(u8::from((x - 0.5).powi(2) + (y - 0.5).powi(2) + (z - 0.5).powi(2) < 0.1))
    };
    let input = parted(7, curved);
    let mesh = by_region(input.clone());
    let config = BuildConfig { preserve_within: 0.05, ..config() };
    let Mt::HalfEdge(mt) = build(&mesh, &config).expect("a mesh to build on").mt else { panic!("half-edge") };
    assert!(mt.regions().expect("regions").deviation > 0.0);
    for error in [f64::INFINITY, 0.1, 0.02, 0.0] {
        let front = front_at(&mt, &Request::within(error));
        (1..4).for_each(|field| check_corners(&mt, front.mesh(), &input, field));
    }
    let sample = Sample { requests: 6, vertices: 1000 };
    let report = verify::run_sample(&mt, &mesh, Reference::Mesh, sample, &mut |_, _| {});
    assert!(report.valid, "{:#?}", report.failures);
}

#[test]
fn what_does_not_jump_is_as_if_nothing_did() {
    let input = by_region(parted(23, quarters));
    let bytes = encode(&built(&input).into(), &EncodeOptions::default()).expect("an MT that can be written");
    let mut session = Session::new();
    session.feed(&bytes).expect("a sound file");
    for error in [0.3, 0.1, 0.08, 0.02, 0.03, 0.0] {
        session.refine(&Request::within(error)).expect("a valid MT");
        session.set_field(0).expect("it is there");
        // The surface that follows the mesh, one that is made anew, and that of the mesh with one point for all regions.
        let followed = normals(session.isosurface(0.6).expect("a valid MT"));
        let view = session.last_view();
        let mesh = session.mesh().expect("it is here");
        let joined = MeshView { tets: mesh.joined_tets(), ..view };
        assert_ne!(joined.tets, view.tets);
        let made = [view, joined].map(|mesh| {
            let mut surface = IsoSurface::new();
            surface.set_regions(true);
            surface.extract(&mesh, 0.6);
            normals(&surface)
        });
        let of_joined: BTreeMap<[u64; 3], [u32; 3]> = made[1].iter().copied().collect();
        assert_eq!(made[1].len(), of_joined.len(), "one vertex at each place");
        assert!(made[0].len() > of_joined.len(), "regions have vertices of their own");
        assert_eq!(followed, made[0], "at {error}");
        assert_eq!(made[0].iter().copied().collect::<BTreeMap<_, _>>(), of_joined, "at {error}");
        assert!(made[0].iter().all(|(place, normal)| of_joined[place] == *normal), "at {error}");
        // What is cut at the ends of a range hangs together.
        let open = [view, joined].map(|mesh| {
            let within = MeshWithin::of(&mesh, mesh.field, [0.2, 1.1]);
            let cut = within.view(within.values());
            let shown = cut.tets.iter().zip(cut.neighbors).filter(|(tet, _)| tet[0] != NONE);
            shown.flat_map(|(_, around)| around).filter(|n| **n == NONE).count()
        });
        assert_eq!(open[0], open[1], "at {error}");
    }
}

/// The vertices of a surface with their normals, in an order of places.
fn normals(surface: &IsoSurface) -> Vec<([u64; 3], [u32; 3])> {
    let each = surface.positions.iter().zip(&surface.normals);
    let mut all: Vec<_> = each.map(|(p, n)| (p.map(f64::to_bits), n.map(f32::to_bits))).collect();
    all.sort_unstable();
    all
}

#[test]
fn constants_of_materials_lose_nothing_and_have_no_surface_between_them() {
    let input = by_region(parted(11, quarters));
    let averaged = input.fields.iter().find(|field| field.name == "material").expect("it");
    assert!(averaged.averaged.as_ref().expect("it was").difference.largest < 1e-14);
    let mut across = parted(11, quarters);
    across.settle_cells(CellsToPoints::AcrossRegions, &["part".to_owned()]);
    let difference = |mesh: &TetMesh, name: &str| {
        let field = mesh.fields.iter().find(|field| field.name == name).expect("it");
        field.averaged.as_ref().expect("it was").difference.rms
    };
    assert!(difference(&across, "material") > 0.3);
    assert!(difference(&input, "stress") < 0.2 * difference(&across, "stress"));
    let bytes = encode(&built(&input).into(), &EncodeOptions::default()).expect("an MT that can be written");
    let mut session = Session::new();
    session.feed(&bytes).expect("a sound file");
    for error in [0.5, 0.02, 0.0] {
        session.refine(&Request::within(error)).expect("a valid MT");
        session.set_field(3).expect("it is there");
        let materials = [10.0, 6.0, 2.0, -2.0];
        let labels = session.mesh().expect("it is here").regions().to_vec();
        let view = session.view();
        for (t, tet) in view.tets.iter().enumerate() {
            let wanted = materials[usize::from(labels[t])];
            assert!(tet.iter().all(|&v| (view.field[v as usize] - wanted).abs() < 1e-3), "{t} at {error}");
        }
        for value in [8.0, 4.1, 0.0] {
            let surface = session.isosurface(value).expect("a valid MT");
            assert!(surface.indices.is_empty(), "{value} at {error}");
        }
    }
    // Compared with each other, too, meshes have the values of the same region at each point.
    let mut kept = |error: f64| {
        session.refine(&Request::within(error)).expect("a valid MT");
        let MeshView { positions, field, tets, neighbors, .. } = session.view();
        (positions.to_vec(), field.to_vec(), tets.to_vec(), neighbors.to_vec())
    };
    let meshes = [kept(0.5), kept(0.0)];
    let [coarse, fine] = meshes.each_ref().map(|(positions, field, tets, neighbors)| MeshView {
        positions,
        field,
        tets,
        neighbors,
        is_label: false,
    });
    for (a, b) in [(coarse, fine), (fine, coarse)] {
        let difference = Difference::of(&a, b).expect("there are tetrahedra");
        assert!(difference.largest < 1e-3, "{}", difference.largest);
    }
}

#[test]
fn what_cannot_keep_values_of_regions_refuses_them() {
    let mesh = by_region(parted(1, quarters));
    let refused = |config: BuildConfig, what: &str| {
        let error = build(&mesh, &config).expect_err(what);
        assert!(matches!(error, BuildError::Combination { .. }), "{error}");
        assert!(
            error.to_string().contains(what) && error.to_string().contains("mean_across_regions"),
            "{error}"
        );
    };
    refused(
        BuildConfig { construction: Construction::default_for(MtKind::Vertex), ..config() },
        "kind vertex",
    );
    refused(BuildConfig { preserve: Vec::new(), ..config() }, "regions that are not kept");
    refused(BuildConfig { all_lossless: true, ..config() }, "exact values");
    let mt = Mt::from(built(&mesh));
    assert!(mt.convert(MtKind::Vertex).is_err(), "its regions would be lost");
}
