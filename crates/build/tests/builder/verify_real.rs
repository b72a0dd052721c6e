//! Promise: MTs of real meshes keep every promise, and what cannot be used is refused with a reason.
//!
//! Needs the environment variable TETRALOD_DATA: a folder with the data sets.

use crate::support::data::real_data;
use crate::support::meshes::built;
use tetralod::mesh::{Grid, MeshFindings, RepairLevel, TetMesh, findings, repair, repair_at};
use tetralod::mt::{ApplyUpdates, MtKind};
use tetralod_build::verify;
use tetralod_build::verify::{Reference, Sample};
use tetralod_build::{BuildConfig, BuildCriterion, Construction, Method, build};
use tetralod_io as io;

fn load(name: &str) -> TetMesh {
    let mesh = io::read(&real_data().join(name)).expect("a file that can be read");
    repair(mesh).expect("a mesh that can be repaired").0
}

/// Constructions that are not the default, and need an MT of their own.
const OTHERS: [(MtKind, Method, BuildCriterion); 2] = [
    (MtKind::Vertex, Method::Decimate, BuildCriterion::Delaunay),
    (MtKind::Vertex, Method::Insert, BuildCriterion::Delaunay),
];

/// The mesh that is verified with all constructions, of which all go with a grid. All on all meshes take half an hour of a processor:
/// `TETRALOD_EVERY_KIND` asks for them.
const WITH_ALL: &str = "cthead";

/// Builds and verifies MTs: of the default kind, and of the others where they are asked for; the base mesh of the edge-based one must
/// have at most so many vertices.
fn check(name: &str, mesh: &TetMesh, most: u32) {
    let build_and_check = |(kind, method, criterion)| {
        let construction = Construction::new(kind, method, criterion).expect("they go together");
        let config = BuildConfig { construction, ..BuildConfig::of(kind) };
        let mt = build(mesh, &config).expect("a mesh to build on").mt;
        let reference = if method.keeps_the_mesh() { Reference::Mesh } else { Reference::Points };
        let what = format!("{name}, {} {} {}", kind.name(), method.name(), criterion.name());
        keeps_promises(&what, &mt, mesh, reference);
    };
    build_and_check((MtKind::HalfEdge, Method::Decimate, BuildCriterion::HalfEdge));
    if name == WITH_ALL || std::env::var_os("TETRALOD_EVERY_KIND").is_some() {
        let edge = built(mesh);
        let base = edge.summary.base_vertices;
        assert!(base <= most, "{name}: {base} vertices in the base mesh");
        keeps_promises(&format!("{name}, edge"), &edge.mt, mesh, Reference::Mesh);
        // Insertion fills the convex hull; of these meshes, only the grids do.
        let fits = |method| method != Method::Insert || mesh.grid.is_some();
        OTHERS.into_iter().filter(|&(_, method, _)| fits(method)).for_each(build_and_check);
    }
}

/// The tetrahedra of a mesh of which a sample is verified: all of `bluntfin` takes minutes.
const MANY_TETS: usize = 50_000;

fn keeps_promises(name: &str, mt: &impl ApplyUpdates, mesh: &TetMesh, reference: Reference) {
    let every = Sample { requests: usize::MAX, vertices: usize::MAX };
    let (sample, least) = if mesh.tets.len() > MANY_TETS { (Sample::default(), 12) } else { (every, 41) };
    let report = verify::run_sample(mt, mesh, reference, sample, &mut |_, _| {});
    assert!(report.valid && report.queries >= least, "{name}: {:#?}", report.failures);
    assert!(report.worst_error_ratio <= 1.0, "{name}: {}", report.worst_error_ratio);
}

fn file(name: &str, most: u32) {
    check(name, &load(name), most);
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn bluntfin() {
    file("bluntfin_clean.vtu", 2000);
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn combustor() {
    file("combustor.vtu", 2000);
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn fea_bracket() {
    file("fea_bracket.vtu", 3000);
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn bucky() {
    file("bucky.vti", 1000);
}

/// Every fourth sample of the middle, so that all constructions take seconds.
#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn part_of_cthead() {
    let mesh = load("cthead.vti");
    let Some(Grid { dims: [nx, ny, _], origin, spacing }) = mesh.grid else {
        panic!("a regular grid");
    };
    let dims = [13, 13, 15];
    let first = [6, 6, 16];
    let mut fields = mesh.fields.clone();
    for (field, whole) in fields.iter_mut().zip(&mesh.fields) {
        field.values.clear();
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                let at = |x: u32| {
                    let [x, y, z] = [first[0] + 4 * x, first[1] + 4 * y, first[2] + 4 * z];
                    whole.values[(x + nx * (y + ny * z)) as usize]
                };
                field.values.extend((0..dims[0]).map(at));
            }
        }
    }
    let part = TetMesh::from_grid(Grid { dims, origin, spacing: spacing.map(|s| 4.0 * s) }, fields);
    check(WITH_ALL, &part, 1000);
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn meshes_with_something_wrong_or_unusual() {
    for name in
        ["post_slit", "angular_sector", "ossicles", "raptor_8418", "manifold_check0", "manifold_check1"]
    {
        file(&format!("robust/{name}.vtu"), 1500);
    }
    let data = real_data();
    for (name, reason) in [("can_crushed", "folded"), ("manifold_check2", "shared by")] {
        let mesh = io::read(&data.join(format!("robust/{name}.vtu"))).expect("a file that can be read");
        let refusal = repair(mesh).expect_err("not a mesh").to_string();
        assert!(refusal.contains(reason), "{name}: {refusal}");
    }
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn meshes_of_many_kinds() {
    for name in ["disk_out_ref", "cylinder_flow", "piezo_micro", "hand", "piece"] {
        file(&format!("{name}.vtu"), 1000);
    }
}

/// What becomes of a broken mesh at the levels none, safe and weld: valid, or refused with this in the reason.
type Fate = Result<(), &'static str>;

const BROKEN: [(&str, [Fate; 3]); 9] = [
    ("robust/angular_sector.vtu", [Ok(()); 3]),
    ("robust/can_crushed.vtu", [Err("the mesh is folded there"); 3]),
    ("robust/manifold_check0.vtu", [Ok(()); 3]),
    ("robust/manifold_check1.vtu", [Ok(()); 3]),
    ("robust/manifold_check2.vtu", [Err("is shared by 3 cells"); 3]),
    ("robust/ossicles.vtu", [Ok(()); 3]),
    ("robust/post_slit.vtu", [Ok(()); 3]),
    ("robust/raptor_8418.vtu", [Err("level \"safe\" repairs it: dropped 3 unused points"), Ok(()), Ok(())]),
    #[cfg(not(target_arch = "wasm32"))]
    (
        "native/6_tetra_bad.msh",
        [Err("level \"safe\" repairs it: turned 1 inverted tetrahedron"), Ok(()), Ok(())],
    ),
];

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn broken_meshes_end_in_a_valid_mt_or_a_reason_at_each_level() {
    let data = real_data();
    for (name, fates) in BROKEN {
        let mesh = io::read(&data.join(name)).expect("a file that can be read");
        let mut last = None;
        for (level, fate) in RepairLevel::ALL.into_iter().zip(fates) {
            match (repair_at(mesh.clone(), level), fate) {
                (Err(error), Err(reason)) => assert!(error.to_string().contains(reason), "{name}: {error}"),
                (Ok((mut mended, _)), Ok(())) => {
                    if mended.fields.is_empty() {
                        mended.add_geometry_fields(&["distance".to_owned()]);
                    }
                    // The same mesh gives the same MT.
                    if last.as_ref() != Some(&mended) {
                        let config = BuildConfig::of(MtKind::HalfEdge);
                        let mt = build(&mended, &config).expect("an MT").mt;
                        keeps_promises(&format!("{name}, {}", level.name()), &mt, &mended, Reference::Mesh);
                    }
                    last = Some(mended);
                }
                (result, _) => panic!("{name}, {}: {:?}", level.name(), result.map(|(_, report)| report)),
            }
        }
    }
    for name in ["native/Armadillo_Tetra_4406_for_test_broken.vtu", "native/liver_for_test_broken.vtk"] {
        io::read(&data.join(name)).expect_err("no mesh");
    }
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn what_is_found_in_broken_meshes_and_what_welding_closes() {
    let data = real_data();
    let one = MeshFindings { components: 1, ..MeshFindings::default() };
    let touching = |components, non_manifold_edges, non_manifold_vertices| MeshFindings {
        components,
        non_manifold_edges,
        non_manifold_vertices,
        ..one
    };
    let open = |components, open_seam_faces, weldable_faces| MeshFindings {
        components,
        open_seam_faces,
        weldable_faces,
        ..one
    };
    for (name, before, welded, after) in [
        ("angular_sector", open(7, 3456, 3456), 1014, one),
        ("post_slit", open(1, 280, 0), 0, open(1, 280, 0)),
        ("ossicles", touching(1, 18, 33), 0, touching(1, 18, 33)),
        ("raptor_8418", touching(1, 9, 22), 0, touching(1, 9, 22)),
        ("manifold_check0", touching(4, 0, 3), 0, touching(4, 0, 3)),
        ("manifold_check1", touching(3, 2, 4), 0, touching(3, 2, 4)),
    ] {
        let mesh = io::read(&data.join(format!("robust/{name}.vtu"))).expect("a file that can be read");
        let (mended, _) = repair(mesh.clone()).expect("a mesh that can be repaired");
        assert_eq!(findings(&mended, 0.0), Ok(before), "{name}");
        let level = RepairLevel::Weld { distance: 0.0 };
        let (mended, report) = repair_at(mesh, level).expect("a mesh that can be welded");
        assert_eq!(report.welded_points, welded, "{name}");
        assert_eq!(findings(&mended, 0.0), Ok(after), "{name}");
    }
}
