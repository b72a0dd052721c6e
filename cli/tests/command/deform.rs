//! Promise: what the command writes and draws of a deformed shape is where the vector displaces it.

use crate::render::Picture;
use crate::support::{Folder, bad, good, json, number};
use std::fs;
use std::fs::File;
use tetralod::mesh::{Field, Grid, TetMesh, VectorPart};
use tetralod_io as io;

/// An affine vector: every surface is mapped by an affine map.
fn vector([x, y, z]: [f64; 3]) -> [f64; 3] {
    [0.25 * y, 0.5 * z - 0.125 * x, 0.25 * x]
}

/// An MT of cubes with a field and that vector, without losses; its folder.
fn prepared(name: &str) -> (Folder, String) {
    let folder = Folder::new(name);
    let grid = Grid { dims: [5, 5, 5], origin: [0.0; 3], spacing: [0.25; 3] };
    let mut mesh = TetMesh { grid: None, ..TetMesh::from_grid(grid, Vec::new()) };
    let values = |f: &dyn Fn([f64; 3]) -> f64| mesh.positions.iter().map(|p| f(*p)).collect::<Vec<f64>>();
    let mut fields = vec![Field::new("heat", values(&|[x, y, z]| x + 0.5 * y * z))];
    for component in 0..3 {
        let part = Some(VectorPart { name: "u".into(), component: Some(component) });
        let name = ["u_x", "u_y", "u_z"][usize::from(component)];
        let own = values(&|p| vector(p)[usize::from(component)]);
        fields.push(Field { vector: part, ..Field::new(name, own) });
    }
    mesh.fields = fields;
    let [input, mt] = ["a.vtu", "a.mt"].map(|name| folder.path(name));
    io::write_vtu(&mesh, &mut File::create(&input).expect("a new file")).expect("a mesh that can be written");
    good(&["build", &input, "-o", &mt, "--all-fields", "--lossless", "--quiet"]);
    (folder, mt)
}

/// The points of a table.
fn points(path: &str) -> Vec<[f64; 3]> {
    let text = fs::read_to_string(path).expect("a table");
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().expect("a head").split(',').collect();
    let columns = ["x", "y", "z"].map(|name| head.iter().position(|own| *own == name).expect("a column"));
    let row = |line: &str| {
        let numbers: Vec<&str> = line.split(',').collect();
        columns.map(|i| numbers[i].parse().expect("a number"))
    };
    lines.map(row).collect()
}

#[test]
fn what_is_written_is_displaced() {
    let (folder, mt) = prepared("deform-written");
    let [rest, moved] = ["rest.csv", "moved.csv"].map(|name| folder.path(name));
    let deform = ["--deform", "u", "--factor", "-2", "--error", "5%"];
    let commands: [&[&str]; 3] =
        [&["surface"], &["slice", "--plane", "z=0.4"], &["isosurface", "--iso", "0.7"]];
    for command in commands {
        let (name, own) = command.split_first().expect("a name");
        let all = |out: &str, options: &[&str]| {
            json(&[&[*name, &mt, "-o", out, "--json"][..], own, options].concat())
        };
        all(&rest, &deform[4..]);
        let report = all(&moved, &deform);
        assert_eq!((report["deform"].as_str(), number(&report, "factor")), (Some("u"), -2.0));
        assert!(number(&report, "displaced_bound") > 0.0);
        let (rest, moved) = (points(&rest), points(&moved));
        assert!(rest.len() == moved.len() && rest.len() > 8);
        for (p, q) in rest.iter().zip(&moved) {
            let known = [0, 1, 2].map(|i| p[i] - 2.0 * vector(*p)[i]);
            // Within a few levels of the fields.
            assert!((0..3).all(|i| (q[i] - known[i]).abs() < 2e-5), "{name}: {p:?} is at {q:?}");
        }
    }
    let [rest, moved] = ["rest.vtu", "moved.vtu"].map(|name| folder.path(name));
    good(&["extract", &mt, "-o", &rest]);
    let report = json(&["extract", &mt, "--deform", "u", "--phase", "0.75", "-o", &moved, "--json"]);
    // A tenth of the diagonal over the largest that the ranges allow, and back.
    let largest = [0.25_f64, 0.5, 0.25].into_iter().fold(0.0, f64::hypot);
    assert!((number(&report, "factor") - 0.1 * 3.0_f64.sqrt() / largest).abs() < 1e-9);
    assert_eq!(number(&report, "part"), -1.0);
    assert!((number(&report, "largest_displacement") - 0.1 * 3.0_f64.sqrt()).abs() < 1e-9);
    let [rest, moved] = [rest, moved].map(|path| io::read(path.as_ref()).expect("a mesh"));
    assert_eq!(rest.tets, moved.tets);
    for (p, q) in rest.positions.iter().zip(&moved.positions) {
        let known = [0, 1, 2].map(|i| p[i] - number(&report, "factor") * vector(*p)[i]);
        assert!((0..3).all(|i| (q[i] - known[i]).abs() < 1e-6), "{p:?} is at {q:?}");
    }
}

#[test]
fn pictures_show_the_deformed_shape() {
    let (folder, mt) = prepared("deform-drawn");
    let out = folder.path("a.png");
    let draw = |options: &[&str]| {
        let small = ["render", &mt, "-o", &out, "--size", "120x90", "--samples", "2", "--mode", "boundary"];
        let said = good(&[&small[..], options].concat());
        (Picture::read(&out), said)
    };
    let (rest, _) = draw(&[]);
    let (none, said) = draw(&["--deform", "u", "--factor", "0"]);
    assert!(none.bytes == rest.bytes && said.contains("0 times u"), "{said}");
    let (all, said) = draw(&["--deform", "u_x,u_y,u_z"]);
    assert!(all.bytes != rest.bytes && said.contains("times u_x,u_y,u_z, at most 0.173205"), "{said}");
    let (ghost, _) = draw(&["--deform", "u", "--undeformed"]);
    assert!(ghost.bytes != all.bytes);
    // The scene has it all.
    let scene = folder.path("scene.json");
    let printed = good(&["render", &mt, "--deform", "u", "--factor", "3", "--undeformed", "--print-scene"]);
    fs::write(&scene, &printed).expect("a file");
    let printed: serde_json::Value = serde_json::from_str(&printed).expect("JSON");
    assert_eq!(printed["deform"]["factor"], 3.0);
    let (read, _) = draw(&["--scene", &scene]);
    let (given, _) = draw(&["--deform", "u", "--factor", "3", "--undeformed"]);
    assert!(read.bytes == given.bytes);
    bad(1, &["render", &mt, "-o", &out, "--deform", "v"], &["\"v\"", "this volume has: u"]);
    bad(1, &["surface", &mt, "-o", &folder.path("a.stl"), "--deform", "v"], &["\"v\"", "this volume has: u"]);
    bad(2, &["render", &mt, "-o", &out, "--factor", "2"], &["--deform"]);
    bad(2, &["render", &mt, "-o", &out, "--undeformed"], &["--deform"]);
}
