//! Regions in files and in requests: what a file says of them, and what is refined for some of them alone.

use crate::support::meshes::blocks;
use std::collections::BTreeSet;
use tetralod::format::{DecodeOptions, Decoder, EncodeOptions, encode};
use tetralod::mesh::{CellsToPoints, Field, NONE, TetMesh};
use tetralod::mt::{
    Applied, ApplyUpdates, CurrentMesh, HalfEdgeMt, Mt, MtKind, MultiTessellation, RegionInfo, Regions,
    UpdateId, UpdatePages,
};
use tetralod::refine::{Front, LodCriterion, Need, Region, Request};
use tetralod::session::Session;
use tetralod::view::BoundarySurface;
use tetralod_build::verify::{self, Reference, Sample};
use tetralod_build::{BuildConfig, BuildError, Construction, build};

const N: u32 = 12;

/// Two layers below, the upper one of two halves; above them a block that is not of the whole width, and in it a core.
///
/// ```text
///    ┌────────────┐
///    │  7 ┌──┐    │ 7      the field varies in all of them
///    │    │-3│    │
///    ├────┴──┴┬───┴──┐
///    │   12   │  4   │
///    ├────────┴──────┤
///    │      100      │
///    └───────────────┘
/// ```
fn label([x, y, z]: [u32; 3]) -> i64 {
    match z {
        0..3 => 100,
        3..6 => {
            if x < 6 {
                12
            } else {
                4
            }
        }
        6..9 if (4..7).contains(&x) && (3..8).contains(&y) => -3,
        _ => 7,
    }
}

fn assembly() -> TetMesh {
    let field = |p: [f64; 3]| (7.0 * p[0]).sin() + p[1] * p[2] + 0.3 * (11.0 * p[2]).cos();
    let mut mesh = blocks([N; 3], &[field], |[x, _, z]| z < 6 || x < 10);
    let middle = |tet: &[u32; 4]| {
        let corners = tet.map(|v| mesh.positions[v as usize]);
        [0, 1, 2].map(|k| (corners.iter().map(|p| p[k]).sum::<f64>() / 4.0 * f64::from(N)) as u32)
    };
    let labels = mesh.tets.iter().map(|tet| label(middle(tet)) as f64).collect();
    mesh.cell_fields = vec![Field::new("part", labels)];
    mesh
}

fn config() -> BuildConfig {
    BuildConfig { preserve: vec!["part".into()], block_bits: 4, ..BuildConfig::default() }
}

fn built() -> Mt {
    build(&assembly(), &config()).expect("a mesh to build on").mt
}

fn regions(mt: &Mt) -> &Regions {
    mt.regions().expect("labels were preserved")
}

fn decoded(bytes: &[u8]) -> Decoder {
    let mut decoder = Decoder::default();
    decoder.feed(bytes).expect("a sound file");
    decoder.finish().expect("a whole file");
    decoder
}

fn front_for(mt: &Mt, request: &Request) -> Front {
    let mut front = Front::new(mt).expect("a valid base mesh");
    satisfy(mt, &mut front, request);
    front
}

fn satisfy(mt: &Mt, front: &mut Front, request: &Request) {
    let outcome = front.satisfy(mt, &LodCriterion::new(mt.info(), request), request.budget);
    assert!(outcome.expect("a valid MT").satisfied);
}

#[test]
fn what_is_known_of_each_region_is_true_of_the_input() {
    let (mesh, mt) = (assembly(), built());
    let all = &regions(&mt).all;
    let names: Vec<&str> = all.iter().map(|region| region.name.as_str()).collect();
    assert_eq!(names, ["-3", "4", "7", "12", "100"]);
    assert_eq!((regions(&mt).arrays.join(","), regions(&mt).deviation), ("part".to_owned(), 0.0));
    let block = f64::from(N).powi(-3);
    for region in all {
        let labels = &mesh.cell_fields[0].values;
        let count = labels.iter().filter(|&&label| label == region.labels[0] as f64).count();
        assert_eq!(region.tetrahedra as usize, count, "{}", region.name);
        let volume = count as f64 / 6.0 * block;
        // Its sides are rounded to the lattice.
        let stated = region.volume;
        assert!((stated - volume).abs() < 3e-3 * volume, "{}: {stated} of {volume}", region.name);
        let [low, high] = region.bounds.map(|corner| mt.info().lattice.point(corner));
        let own = || {
            let of = mesh.tets.iter().zip(labels).filter(|(_, l)| **l == region.labels[0] as f64);
            of.flat_map(|(tet, _)| tet.map(|v| mesh.positions[v as usize]))
        };
        for k in 0..3 {
            let least = own().map(|p| p[k]).fold(f64::INFINITY, f64::min);
            let most = own().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
            let off = (low[k] - least).abs().max((high[k] - most).abs());
            assert!(off <= mt.info().quantization + 1e-12, "{}: {off}", region.name);
        }
    }
    let colors: BTreeSet<u8> = all.iter().map(|region| region.color).collect();
    assert_eq!(colors.len(), all.len(), "as long as there are enough, no two have the same");
}

#[test]
fn files_keep_regions_and_say_which_a_block_reaches() {
    let mt = built();
    let bytes = encode(&mt, &EncodeOptions::default()).expect("an MT that can be written");
    let decoder = decoded(&bytes);
    let read = decoder.mt().expect("all has arrived");
    assert_eq!(regions(read), regions(&mt));
    assert_eq!(*read, mt);
    // Nothing is known of an MT from a file but what a run through it finds.
    assert!(encode(read, &EncodeOptions::default()).expect("an MT that can be written") == bytes);
    // By brute force: what depends on an update reaches what that reaches.
    let mut mesh = mt.start().expect("a valid base mesh");
    let mut reached: Vec<BTreeSet<u16>> = Vec::new();
    let mut parents: Vec<BTreeSet<u32>> = Vec::new();
    for u in (0..mt.updates()).map(UpdateId) {
        let removed = mt.find_removed(&mut mesh, u).expect("a valid MT");
        parents.push(removed.iter().filter_map(|&t| mt.creator(&mesh, t)).map(|u| u.0).collect());
        let before: BTreeSet<u16> = removed.iter().map(|&t| mesh.regions()[t as usize]).collect();
        assert_eq!(mt.refine(&mut mesh, u), Ok(Applied::Done));
        let inserted = mt.find_inserted(&mut mesh, u).expect("a valid MT");
        let after: BTreeSet<u16> = inserted.iter().map(|&t| mesh.regions()[t as usize]).collect();
        assert_eq!(before, after, "an update inserts what it removes");
        reached.push(before);
    }
    for u in (0..reached.len()).rev() {
        let own = reached[u].clone();
        parents[u].iter().for_each(|&parent| reached[parent as usize].extend(&own));
    }
    let index = decoder.index().expect("a file with blocks");
    for (page, block) in index.known() {
        let all: BTreeSet<u16> =
            mt.page_updates(page).flat_map(|u| reached[u as usize].iter().copied()).collect();
        assert_eq!(block.regions, Vec::from_iter(all), "block {page}");
    }
    assert!(index.known().any(|(_, block)| block.regions.len() == 1), "blocks tell regions apart");
}

/// Whether some tetrahedron that an applied update removed was in a region and had a larger error; none if a child is in the way.
fn is_needed(mt: &Mt, mesh: &mut CurrentMesh, u: UpdateId, region: u16, error: f64) -> Option<bool> {
    let mut needed = false;
    let looked = mt.look_at_removed(mesh, u, &mut |_, _, _, of| {
        needed |= of == region && mt.error(u).error() > error;
        false
    });
    (looked.expect("a valid MT") == Applied::Done).then_some(needed)
}

#[test]
fn a_request_for_a_region_refines_that_and_what_it_depends_on() {
    let mt = built();
    let everywhere = |error| front_for(&mt, &Request::within(error));
    for region in 0..regions(&mt).all.len() as u16 {
        for error in [0.0, 0.01, 0.1] {
            let request = Need::within(error).in_regions(vec![region]).into();
            let front = front_for(&mt, &request);
            let mesh = front.mesh();
            for t in (0..mesh.tets().len() as u32).filter(|&t| mesh.regions()[t as usize] == region) {
                let left = mt.remover(mesh, t).map_or(0.0, |u| mt.error(u).error());
                assert!(left <= error, "region {region} within {error}: {left}");
            }
            let mut copy = mesh.clone();
            let applied = (0..mt.updates()).map(UpdateId).filter(|u| front.contains(*u));
            for u in applied {
                let needed = is_needed(&mt, &mut copy, u, region, error);
                assert_ne!(needed, Some(false), "update {} serves nothing: {region}, {error}", u.0);
            }
            let whole = everywhere(error);
            assert!(front.mesh().tet_count() < whole.mesh().tet_count() || whole.applied_count() == 0);
            // From other meshes it is the same.
            for mut other in [everywhere(0.0), everywhere(f64::INFINITY), everywhere(0.05)] {
                satisfy(&mt, &mut other, &request);
                assert_eq!(other.mesh().hash(), mesh.hash(), "region {region} within {error}");
            }
        }
    }
    let all: Request = Need::within(0.01).in_regions((0..5).collect()).into();
    assert_eq!(front_for(&mt, &all).mesh().hash(), everywhere(0.01).mesh().hash());
}

#[test]
fn a_session_fetches_only_the_blocks_of_the_regions_that_it_is_asked_for() {
    let mt = built();
    let bytes = encode(&mt, &EncodeOptions::default()).expect("an MT that can be written");
    let shape = Region::Sphere { centre: [0.5, 0.5, 0.4], radius: 0.2 };
    let needs = |region: u16| {
        let alone = Need::within(0.0).in_regions(vec![region]);
        [alone.clone(), alone.clone().inside(shape.clone()), alone.around(0, &[0.5])]
    };
    for (region, need) in (0..5).flat_map(|region| needs(region).map(|need| (region, need))) {
        let request = Request::from(need);
        let mut session = Session::in_parts(DecodeOptions::default(), u64::MAX);
        let mut is_asked = false;
        loop {
            let wanted = session.wanted();
            if wanted.is_empty() {
                break;
            }
            for range in wanted.into_iter().map(|wanted| wanted.range) {
                let end = range.end.min(bytes.len() as u64);
                session.take(&range, &bytes[range.start as usize..end as usize]).expect("sound bytes");
            }
            if session.mt().is_some() && !std::mem::replace(&mut is_asked, true) {
                session.request(&request).expect("a region of the MT");
            }
            if is_asked {
                session.step(&mut |_| true).expect("a valid MT");
            }
        }
        let progress = session.block_progress();
        assert_eq!(progress.missed, 0, "region {region}: the index tells what is needed");
        assert!(progress.needed < progress.blocks, "region {region}: {progress:?}");
        assert_eq!(session.hash(), front_for(&mt, &request).mesh().hash(), "region {region}");
    }
    let mut session = Session::new();
    session.feed(&bytes).expect("a sound file");
    let unknown = session.request(&Need::within(0.0).in_regions(vec![5]).into());
    let text = unknown.expect_err("there are five").to_string();
    assert_eq!(text, "there is no region number 5; the MT has 5, counted from 0");
}

/// The corners of the boundary's triangles, in any order.
fn triangles(session: &mut Session) -> BTreeSet<[[u64; 3]; 3]> {
    let mut surface = BoundarySurface::new();
    surface.extract(&session.view());
    let corners = |triangle: &[u32; 3]| {
        let mut corners = triangle.map(|v| surface.positions[v as usize].map(f64::to_bits));
        corners.sort_unstable();
        corners
    };
    assert!(surface.is_closed());
    surface.indices.iter().map(corners).collect()
}

#[test]
fn parts_that_hang_together_by_faces_are_regions_and_cost_nothing() {
    let field = |p: [f64; 3]| (7.0 * p[0]).sin() + p[1] * p[2];
    let mesh = blocks([N; 3], &[field], |[x, y, _]| x < 5 || x > 6 && y != 4);
    let [plain, parted] = [vec![], vec!["components".to_owned()]].map(|preserve| {
        let mut mesh = mesh.clone();
        mesh.settle_cells(CellsToPoints::No, &preserve);
        let config = BuildConfig { preserve, ..BuildConfig::default() };
        build(&mesh, &config).expect("a mesh to build on").mt
    });
    let known = regions(&parted);
    let names: Vec<&str> = known.all.iter().map(|region| region.name.as_str()).collect();
    assert_eq!((known.arrays.join(","), names), ("components".to_owned(), vec!["1", "2", "3"]));
    // In the order of their first cells: x runs fastest.
    let counts = [5 * N, 5 * 4, 5 * 7].map(|columns| u64::from(columns * N * 6));
    assert_eq!(known.all.iter().map(|region| region.tetrahedra).collect::<Vec<_>>(), counts);
    let steps = [f64::INFINITY, 0.1, 0.01, 0.0].map(|error| {
        let [a, b] = [&plain, &parted].map(|mt| front_for(mt, &Request::within(error)));
        let arrays = |mesh: &CurrentMesh| (mesh.positions().to_vec(), mesh.tets().to_vec());
        assert!(arrays(a.mesh()) == arrays(b.mesh()), "other meshes with regions than without, at {error}");
        b.mesh().tets().len()
    });
    assert!(steps.is_sorted());
    // An array of this name is what it says.
    let mut labelled = mesh;
    labelled.cell_fields = vec![Field::new("components", vec![7.0; labelled.tets.len()])];
    let config = BuildConfig { preserve: vec!["components".into()], ..BuildConfig::default() };
    labelled.settle_cells(CellsToPoints::No, &config.preserve);
    let mt = build(&labelled, &config).expect("a mesh to build on").mt;
    assert!(matches!(&regions(&mt).all[..], [RegionInfo { labels, .. }] if labels[..] == [7]));
}

#[test]
fn a_session_shows_the_regions_that_are_chosen() {
    let mt = built();
    let bytes = encode(&mt, &EncodeOptions::default()).expect("an MT that can be written");
    let [mut session, mut kept] = [(); 2].map(|()| {
        let mut session = Session::new();
        session.feed(&bytes).expect("a sound file");
        session
    });
    for (error, shown) in
        [(0.1, vec![2]), (0.01, vec![2]), (0.05, vec![0, 2]), (0.0, vec![1, 3, 4]), (0.3, vec![1, 3, 4])]
    {
        for session in [&mut session, &mut kept] {
            session.refine(&Request::within(error)).expect("a valid MT");
        }
        // One has shown others before.
        session.show_regions(Some(&shown));
        let is_shown = |of: &u16| shown.contains(of);
        let all = kept.mesh().expect("it is here").regions().to_vec();
        let view = session.view();
        for (t, tet) in view.tets.iter().enumerate() {
            assert_eq!(tet[0] != NONE, is_shown(&all[t]));
            let across = view.neighbors[t].into_iter().filter(|&n| n != NONE);
            assert!(across.map(|n| all[n as usize]).all(|of| is_shown(&of) && is_shown(&all[t])));
        }
        // A face between two regions is of the boundary of both, seen alone, and of none, seen together.
        let boundary = triangles(&mut session);
        let mut one_by_one = BTreeSet::new();
        for region in &shown {
            kept.show_regions(Some(&[*region]));
            for triangle in triangles(&mut kept) {
                if !one_by_one.remove(&triangle) {
                    one_by_one.insert(triangle);
                }
            }
        }
        assert_eq!(boundary, one_by_one, "{shown:?} at {error}");
    }
    session.show_regions(None);
    assert!(session.view().tets.iter().all(|tet| tet[0] != NONE));
}

#[test]
fn verification_finds_a_tetrahedron_of_the_wrong_region() {
    let (mesh, mt) = (assembly(), built());
    let Mt::HalfEdge(sound) = &mt else { panic!("a half-edge MT") };
    let valid = |mt: &HalfEdgeMt| {
        let sample = Sample { requests: 4, vertices: 500 };
        verify::run_sample(mt, &mesh, Reference::Mesh, sample, &mut |_, _| {})
    };
    let report = valid(sound);
    assert!(report.valid, "{:#?}", report.failures);
    let mut tampered = sound.clone();
    let mut regions = regions(&mt).clone();
    let other = regions.of_base.iter().position(|region| *region != regions.of_base[0]).expect("several");
    regions.of_base[0] = regions.of_base[other];
    tampered.set_regions(regions).expect("all base tetrahedra have one");
    let is_found = |tampered: &HalfEdgeMt| {
        let report = valid(tampered);
        !report.valid && report.failures.iter().any(|failure| failure.contains("region"))
    };
    assert!(is_found(&tampered));
    // Two regions of as many tetrahedra, each with the label of the other.
    let mut regions = self::regions(&mt).clone();
    let at = |label: i64| regions.all.iter().position(|region| region.labels == [label]).expect("a label");
    let [a, b] = [at(4), at(12)];
    assert_eq!(regions.all[a].tetrahedra, regions.all[b].tetrahedra);
    (regions.all[a].labels, regions.all[b].labels) = (vec![12], vec![4]);
    tampered.set_regions(regions).expect("all base tetrahedra have one");
    assert!(is_found(&tampered));
}

#[test]
fn labels_that_change_with_time_are_refused() {
    let mut mesh = assembly();
    let mut later = mesh.cell_fields[0].clone();
    later.time = Some(1.0);
    mesh.cell_fields.push(later);
    assert!(build(&mesh, &config()).is_ok(), "the same at both times");
    mesh.cell_fields[1].values[0] += 1.0;
    let error = build(&mesh, &config()).expect_err("no label");
    assert!(matches!(&error, BuildError::LabelChanges { name } if name == "part"), "{error}");
}

#[test]
fn no_two_regions_have_one_name() {
    let mut mesh = assembly();
    for (label, name) in
        [(-3, "steel"), (4, "steel (12)"), (7, ""), (12, "steel"), (100, &"long".repeat(100))]
    {
        mesh.input.name_label("part", label, name);
    }
    let mt = build(&mesh, &config()).expect("a mesh to build on").mt;
    let names: Vec<&str> = regions(&mt).all.iter().map(|region| region.name.as_str()).collect();
    assert_eq!(names, ["steel (-3)", "steel (12)", "7", "steel (12) (12)", &"long".repeat(64)]);
}

#[test]
fn kinds_without_regions_keep_any_number_of_them_apart() {
    let mut mesh = blocks([24; 3], &[|p: [f64; 3]| p[0]], |_| true);
    mesh.cell_fields = vec![Field::new("part", (0..mesh.tets.len()).map(|t| t as f64).collect())];
    let result = |kind: MtKind| {
        build(&mesh, &BuildConfig { construction: Construction::default_for(kind), ..config() })
    };
    let error = result(MtKind::HalfEdge).expect_err("too many");
    assert!(matches!(error, BuildError::Regions { count: 82_944, most: 65_536 }), "{error}");
    assert!(result(MtKind::Vertex).expect("a mesh").mt.regions().is_none());
}
