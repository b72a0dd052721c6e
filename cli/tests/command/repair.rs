//! Promises of `build --repair`: each level on a mesh with an open seam, what is said of it, and what `verify` makes of the file.

use crate::support::{Folder, bad, good, json, run, text};
use std::fs::File;
use tetralod::mesh::{Field, Grid, TetMesh};
use tetralod_io as io;

/// Two cubes of six tetrahedra that touch at x = 1, each with points of its own, `gap` apart.
fn write_blocks(path: &str, gap: f64, change: impl Fn(&mut TetMesh)) {
    let grid = Grid { dims: [2; 3], origin: [0.0; 3], spacing: [1.0; 3] };
    let mut mesh = TetMesh { grid: None, ..TetMesh::from_grid(grid, Vec::new()) };
    let beside: Vec<_> = mesh.positions.iter().map(|[x, y, z]| [x + 1.0 + gap, *y, *z]).collect();
    mesh.positions.extend(beside);
    let again: Vec<_> = mesh.tets.iter().map(|tet| tet.map(|v| v + 8)).collect();
    mesh.tets.extend(again);
    mesh.fields = vec![Field::new("p", mesh.positions.iter().map(|[x, y, z]| x * x + y * z).collect())];
    change(&mut mesh);
    io::write_vtu(&mesh, &mut File::create(path).expect("a new file")).expect("a mesh that can be written");
}

#[test]
fn each_level_says_what_it_did_and_what_is_left() {
    let folder = Folder::new("repair");
    let [input, mt] = ["a.vtu", "a.mt"].map(|name| folder.path(name));
    write_blocks(&input, 0.0, |_| {});
    let build = |more: &[&str]| json(&[&["build", &input, "-o", &mt, "--json"], more].concat());
    let bytes = || std::fs::read(&mt).expect("a file");

    let safe = build(&[]);
    let as_before = bytes();
    assert_eq!((&safe["repaired"], &safe["repair"]["level"]), (&"".into(), &"safe".into()));
    let found = |report: &serde_json::Value| {
        ["components", "open_seam_faces", "weldable_faces", "welded_points"]
            .map(|name| report["repair"][name].clone())
    };
    assert_eq!(found(&safe), [2, 4, 4, 0]);
    for level in ["safe", "none"] {
        assert_eq!(build(&["--repair", level])["repair"]["level"], level);
        assert_eq!(bytes(), as_before, "a valid mesh is kept as it is");
    }
    let shown = run(&["build", &input, "-o", &mt]);
    let kept = "kept: 2 parts that share no face; 4 faces on open seams (repair level \"weld\" closes them)";
    assert!(text(&shown.stderr).contains(kept), "{}", text(&shown.stderr));

    let welded = build(&["--repair", "weld"]);
    assert_eq!(welded["repaired"], "repaired: welded 4 points of open seams");
    assert_eq!((found(&welded), &welded["repair"]["kept"]), ([1, 0, 0, 4].map(Into::into), &"".into()));
    // The file says how its input was mended, so that it can be compared with it.
    assert_eq!(json(&["info", &mt, "--json"])["metadata"]["repair"], "weld");
    assert_eq!(json(&["verify", &mt, "--against", &input, "--json"])["valid"], true);
}

#[test]
fn points_are_welded_within_a_distance() {
    let folder = Folder::new("weld-distance");
    let [input, mt] = ["a.vtu", "a.mt"].map(|name| folder.path(name));
    write_blocks(&input, 0.25, |_| {});
    let build = ["build", &input, "-o", &mt, "--json", "--repair", "weld"];
    assert_eq!(json(&build)["repair"]["welded_points"], 0);
    let welded = json(&[&build[..], &["--weld-distance", "0.25"]].concat());
    let repair = &welded["repair"];
    assert_eq!((&repair["welded_points"], &repair["weld_distance"]), (&4.into(), &0.25.into()));
    assert_eq!((&repair["differing_values"], &repair["components"]), (&4.into(), &1.into()));
    assert_eq!(json(&["info", &mt, "--json"])["metadata"]["repair"], "weld 0.25");
    assert_eq!(json(&["verify", &mt, "--against", &input, "--json"])["valid"], true);
    bad(1, &[&build[..], &["--weld-distance", "1"]].concat(), &["a.vtu", "cell 0", "smaller distance"]);
}

#[test]
fn meshes_and_options_are_refused_with_the_reason() {
    let folder = Folder::new("repair-refused");
    let [input, mt] = ["a.vtu", "a.mt"].map(|name| folder.path(name));
    write_blocks(&input, 0.0, |mesh| mesh.tets[3].swap(0, 1));
    let build = ["build", &input, "-o", &mt];
    let safe = good(&[&build[..], &["--json"]].concat());
    assert!(safe.contains("turned 1 inverted tetrahedron"));
    let none = [&build[..], &["--repair", "none"]].concat();
    bad(1, &none, &["a.vtu", "level \"safe\" repairs it: turned 1 inverted tetrahedron"]);
    bad(2, &[&build[..], &["--weld-distance", "0.1"]].concat(), &["--weld-distance goes with --repair weld"]);
    bad(2, &[&build[..], &["--repair", "weld", "--weld-distance=-1"]].concat(), &["--weld-distance"]);
    bad(2, &[&build[..], &["--repair", "all"]].concat(), &["none, safe, weld"]);
    bad(2, &[&build[..], &["--meta", "repair=by hand"]].concat(), &["'repair'"]);
}
