//! Real files: every encoding of one mesh, damaged originals, dirty meshes.

use std::path::Path;

use crate::data::real_data;
use tetralod::mesh;
use tetralod::mesh::{MeshError, TetMesh};
use tetralod_io as io;
use tetralod_io::ReadError;

fn read(folder: &Path, name: &str) -> TetMesh {
    io::read(&folder.join(name)).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(folder: &Path, name: &str) -> ReadError {
    match io::read(&folder.join(name)) {
        Ok(_) => panic!("{name} was read"),
        Err(error) => error,
    }
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn every_encoding_of_one_mesh() {
    let folder = real_data();
    let exact = read(&folder, "encodings/appended_raw.vtu");
    assert_eq!((exact.positions.len(), exact.tets.len(), exact.fields.len()), (465, 1522, 1));
    let mut files = 0;
    for entry in std::fs::read_dir(folder.join("encodings")).unwrap() {
        let path = entry.unwrap().path();
        let mesh = io::read(&path).unwrap_or_else(|e| panic!("{e}"));
        files += 1;
        if path.file_name().unwrap() != "legacy42_ascii.vtk" {
            // The ASCII VTU has all digits.
            assert_eq!(mesh, exact, "{}", path.display());
            continue;
        }
        assert_eq!(mesh.tets, exact.tets);
        let (a, b) = (mesh.positions.as_flattened(), exact.positions.as_flattened());
        let values = a.iter().chain(&mesh.fields[0].values).zip(b.iter().chain(&exact.fields[0].values));
        for (printed, exact) in values {
            assert!((printed - exact).abs() <= 5.1e-11 * exact.abs(), "{printed} {exact}");
        }
    }
    assert_eq!(files, 14);
    let native = read(&folder, "native/CylinderLinear.vtk");
    assert_eq!((&native.positions, &native.tets, native.fields.len()), (&exact.positions, &exact.tets, 5));
    assert_eq!(native.fields[4], exact.fields[0]);
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn grids_in_all_their_formats() {
    let folder = real_data();
    for name in ["bucky", "nucleon", "hydrogen", "neghip", "ironprot", "cthead"] {
        let image = read(&folder, &format!("{name}.vti"));
        assert_eq!(image, read(&folder, &format!("{name}.json")), "{name}");
        let dims = image.grid.unwrap().dims;
        let cells: u32 = dims.iter().map(|d| d - 1).product();
        assert_eq!(image.tets.len() as u32, 6 * cells);
    }
    assert_eq!(read(&folder, "native/hydrogen.vti"), read(&folder, "hydrogen.vti"));
    let legacy = read(&folder, "native/ironProt.vtk");
    let image = read(&folder, "ironprot.vti");
    assert_eq!((&legacy.fields[0].values, &legacy.tets), (&image.fields[0].values, &image.tets));
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn files_that_must_be_refused() {
    let folder = real_data();
    for (name, reason) in [
        ("native/Armadillo_Tetra_4406_for_test_broken.vtu", "expected 4407, found 4406"),
        ("native/liver_for_test_broken.vtk", "is not known"),
    ] {
        let error = refused(&folder, name).to_string();
        assert!(error.contains(reason), "{error}");
    }
    assert!(refused(&folder, "native/liver.msh").to_string().contains("save it as version 2.2 or 4.1"));
}

/// What repair makes of a file: points, tetrahedra, components, boundary faces, and its report.
type Expected = (&'static str, usize, usize, usize, usize, &'static str);

const GOOD: &[Expected] = &[
    ("armadillo.vtu", 13230, 54985, 1, 17296, ""),
    ("bluntfin_clean.vtu", 40921, 187318, 1, 13438, ""),
    (
        "bluntfin.vtu",
        40921,
        187318,
        1,
        13438,
        "repaired: merged 39 coincident points, dropped 77 collapsed tetrahedra",
    ),
    ("combustor.vtu", 47025, 215040, 1, 15616, ""),
    ("fea_bracket.vtu", 39423, 206208, 1, 19538, ""),
    ("disk_out_ref.vtu", 8499, 44832, 1, 3976, ""),
    ("cylinder_flow.vtu", 2814, 12176, 1, 2904, ""),
    ("piezo_micro.vtu", 8918, 42744, 1, 7584, ""),
    ("hand.vtu", 7234, 29998, 1, 9556, ""),
    ("piece.vtu", 3915, 13179, 1, 6668, ""),
    ("robust/angular_sector.vtu", 10141, 46080, 7, 8880, ""),
    ("robust/post_slit.vtu", 2288, 8750, 1, 1980, ""),
    ("robust/ossicles.vtu", 1733, 5058, 1, 3412, ""),
    ("robust/raptor_8418.vtu", 2993, 8418, 1, 5750, "repaired: dropped 3 unused points"),
    ("robust/manifold_check0.vtu", 29, 24, 4, 48, ""),
    ("robust/manifold_check1.vtu", 24, 24, 3, 44, ""),
    ("native/tetraMesh.vtk", 55, 160, 1, 80, "repaired: turned 80 inverted tetrahedra"),
    ("native/post.vtk", 2288, 8750, 1, 1980, ""),
    ("native/a_grid.vtk", 1317, 4802, 1, 2000, ""),
    ("native/cylinder.vtk", 354, 1348, 1, 440, ""),
    ("native/cut-cylinder.vtk", 1147, 3279, 2, 2286, ""),
    ("native/Tetrahedron.vtu", 35, 96, 1, 48, ""),
    ("native/QuadraticTetra.vtu", 189, 768, 1, 192, ""),
    ("native/manifoldCheck1.vtu", 24, 24, 3, 44, "repaired: turned 24 inverted tetrahedra"),
    ("native/uGridEx.vtk", 14, 14, 3, 28, "repaired: dropped 13 unused points"),
    ("native/Armadillo_Tetra_4406.vtu", 1446, 4406, 1, 2532, ""),
    (
        "native/bracket_appended_compressed.vtu",
        39423,
        206208,
        1,
        19538,
        "repaired: turned 206208 inverted tetrahedra, dropped 10577 unused points",
    ),
];

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn good_and_mendable_meshes() {
    let folder = real_data();
    for &(name, points, tets, components, boundary, summary) in GOOD {
        let (mesh, report) = mesh::repair(read(&folder, name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(report.to_string(), summary, "{name}");
        assert_eq!((mesh.positions.len(), mesh.tets.len()), (points, tets), "{name}");
        mesh::check(&mesh).unwrap_or_else(|e| panic!("{name}: {e}"));
        let topology = mesh::topology(points, &mesh.tets).unwrap();
        assert_eq!((topology.components, topology.boundary_faces), (components, boundary), "{name}");
    }
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn non_manifold_vertices_are_found() {
    let folder = real_data();
    for (name, count) in [
        ("robust/manifold_check0.vtu", 3),
        ("robust/manifold_check1.vtu", 4),
        ("native/Armadillo_Tetra_4406.vtu", 1),
        ("robust/angular_sector.vtu", 0),
        ("robust/post_slit.vtu", 0),
    ] {
        let mesh = read(&folder, name);
        let topology = mesh::topology(mesh.positions.len(), &mesh.tets).unwrap();
        assert_eq!(topology.non_manifold_count(), count, "{name}");
    }
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn bluntfin_is_mended_into_its_clean_twin() {
    let folder = real_data();
    let (mended, _) = mesh::repair(read(&folder, "bluntfin.vtu")).unwrap();
    assert_eq!(mended, read(&folder, "bluntfin_clean.vtu"));
}

#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn meshes_that_cannot_be_mended_name_their_cells() {
    let folder = real_data();
    let error = |name: &str| mesh::repair(read(&folder, name)).unwrap_err();
    assert_eq!(
        error("robust/manifold_check2.vtu"),
        MeshError::CrowdedFace { face: [2, 3, 11], tets: [2, 10, 16].map(Into::into).to_vec() }
    );
    let MeshError::Folded { tets } = error("robust/can_crushed.vtu") else { panic!("not seen as folded") };
    // One of the two is inverted in the file, the other is not.
    let mesh = read(&folder, "robust/can_crushed.vtu");
    let positive = tets.clone().map(|t| {
        let one = TetMesh { tets: vec![mesh.tets[t.number as usize]], ..mesh.clone() };
        mesh::check(&one).is_ok()
    });
    assert_ne!(positive[0], positive[1], "cells {tets:?}");
}

#[cfg(not(target_arch = "wasm32"))]
#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn files_of_meshers() {
    let folder = real_data();
    for (name, points, tets) in [
        ("native/6_tetra_bad.msh", 17, 6),
        ("native/homology.asc.v22.msh", 1961, 7392),
        ("native/piece.bin.v22.msh", 3939, 13179),
        ("native/piece.asc.v40.msh", 4096, 13676),
        ("native/piece.asc.v41.msh", 4094, 13370),
        ("native/unit_ball.mesh", 363, 1110),
        ("native/octopus-low.mesh", 452, 1140),
    ] {
        let mesh = read(&folder, name);
        assert_eq!((mesh.positions.len(), mesh.tets.len()), (points, tets), "{name}");
        let (mended, _) = mesh::repair(mesh).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(mended.tets.len(), tets, "{name}");
    }
    let unused = mesh::repair(read(&folder, "native/piece.bin.v22.msh")).unwrap().1.unused_points;
    assert_eq!(unused, 24);
    let [text, binary] = ["asc", "bin"].map(|kind| read(&folder, &format!("native/piece.{kind}.v41.msh")));
    assert_eq!(text.tets, binary.tets);
    let pairs = text.positions.as_flattened().iter().zip(binary.positions.as_flattened());
    pairs
        .for_each(|(text, binary)| assert!((text - binary).abs() <= 1e-14 * binary.abs(), "{text} {binary}"));
}

/// A field that is expected: its name, and its least and greatest value.
type Range<'a> = (&'a str, f64, f64);

#[cfg(not(target_arch = "wasm32"))]
#[test]
#[ignore = "needs the data sets of TETRALOD_DATA"]
fn odd_files_of_meshers_and_images() {
    let folder = real_data();
    let volume = |mesh: &TetMesh| -> f64 {
        let of = |tet: &[u32; 4]| {
            let [a, b, c, d] = tet.map(|v| glam::DVec3::from_array(mesh.positions[v as usize]));
            (b - a).cross(c - a).dot(d - a).abs() / 6.0
        };
        mesh.tets.iter().map(of).sum()
    };
    let files: [(&str, f64, &[Range<'_>]); 8] = [
        ("field/ascii.mha", 60.0, &[("value", 0.0, 12.0)]),
        ("field/list.mhd", 60.0, &[("value", 0.0, 12.0)]),
        ("field/axismins.nrrd", 180.0, &[]),
        ("field/small_time.nrrd", 64.0, &[("value_0", 1.8343326288278838, 97.25087786234636)]),
        (
            "field/met.mesh",
            8.0,
            &[
                ("sol_xx", 1.0, 3.0),
                ("sol_yy", 2.0, 2.0),
                ("sol_zz", 3.0, 3.0),
                ("sol_xy", 10.0, 10.0),
                ("sol_xz", 20.0, 20.0),
                ("sol_yz", 30.0, 30.0),
                ("sol_2_x", 5.0, 5.0),
            ],
        ),
        ("field/p2_mixed.mesh", 8.0, &[("sol", 0.0, 2.0)]),
        ("field/gm_elnode.msh", 8.0, &[("stress", 0.0, 2.0)]),
        ("field/tg.ele", 8.0, &[]),
    ];
    for (name, whole, fields) in files {
        let mesh = read(&folder, name);
        assert!((volume(&mesh) - whole).abs() < 1e-9 && mesh.notes.is_empty(), "{name} {}", volume(&mesh));
        for (field, least, greatest) in fields {
            let field = mesh.fields.iter().find(|known| known.name == *field).expect(field);
            let ends = field.values.iter().fold([f64::MAX, f64::MIN], |[a, b], v| [a.min(*v), b.max(*v)]);
            assert_eq!(ends, [*least, *greatest], "{name} {}", field.name);
        }
    }
    let grid = read(&folder, "field/axismins.nrrd").grid.unwrap();
    assert_eq!((grid.origin, grid.spacing), ([10.0, 20.0, 30.0], [0.5, 2.0, 3.0]));
    assert!(refused(&folder, "field/rgb2d.nrrd").to_string().contains("two-dimensional"));
    let orphan = mesh::repair(read(&folder, "field/gm_orphan.msh")).unwrap().0;
    assert_eq!((orphan.positions.len(), orphan.fields[0].name.as_str()), (27, "T"));
    let steps = io::steps(&folder.join("field/gm_time.msh")).unwrap();
    let times: Vec<_> = steps.iter().map(|step| (step.number, step.time)).collect();
    assert_eq!(times, [(0, Some(0.0)), (1, Some(0.5)), (2, Some(1.0))]);
    for step in steps {
        let options = io::ReadOptions { step: step.number, ..io::ReadOptions::default() };
        let mesh = io::read_with(&step.path, &options).unwrap();
        let expected = (1, "T", step.time, 100.0 * step.number as f64);
        let field = &mesh.fields[0];
        assert_eq!((mesh.fields.len(), field.name.as_str(), field.time, field.values[0]), expected);
    }
}
