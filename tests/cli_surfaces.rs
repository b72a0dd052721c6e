//! Promise: the commands that look into a mesh write what they say, in every format, with the error that is guaranteed.
#![cfg(feature = "cli")]

mod cli_support;

use cli_support::Folder;
use cli_support::bad;
use cli_support::good;
use cli_support::json;
use cli_support::number;
use cli_support::table;
use std::fs;
use tetralod::mesh::Field;
use tetralod::mesh::Grid;
use tetralod::mesh::TetMesh;

/// Makes an MT of a box from (0, 0, 0) to (2, 1, 1) with a linear field `ramp`, a field `hill`, and the velocity of a
/// rotation around the axis through (1, 0.5, 0) along z.
fn box_mt(folder: &Folder) -> String {
    let grid = Grid { dims: [17, 9, 9], origin: [0.0; 3], spacing: [0.125; 3] };
    let mut mesh = TetMesh::from_grid(grid, Vec::new());
    let mut field = |name: &str, f: fn([f64; 3]) -> f64| {
        let values = mesh.positions.iter().map(|p| f(*p)).collect();
        mesh.fields.push(Field { name: name.to_owned(), values });
    };
    field("ramp", |[x, y, z]| x + 2.0 * y - z);
    field("hill", |[x, y, z]| 1.0 / (0.1 + (x - 1.0).powi(2) + (y - 0.5).powi(2) + (z - 0.5).powi(2)));
    field("v_x", |[_, y, _]| 0.5 - y);
    field("v_y", |[x, _, _]| x - 1.0);
    field("v_z", |_| 0.0);
    let [input, mt] = ["box.vti", "box.mt"].map(|name| folder.path(name));
    tetralod::io::write_vti(&mesh, &mut fs::File::create(&input).expect("a file")).expect("it is written");
    let fields = ["ramp", "hill", "v_x", "v_y", "v_z"].map(|name| ["--field", name]).concat();
    good(&[&["build", &input, "-o", &mt, "--quiet"], &fields[..]].concat());
    mt
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-3 * b.abs().max(1.0)
}

#[test]
fn surfaces_come_in_every_format() {
    let folder = Folder::new("formats");
    let mt = box_mt(&folder);
    let commands = [
        &["isosurface", &mt, "--iso", "4", "--field", "hill", "--error", "1%"][..],
        &["slice", &mt, "--plane", "z=0.4"],
        &["surface", &mt, "--error", "5%"],
    ];
    for command in commands {
        let mut reports = Vec::new();
        for ending in ["vtp", "stl", "ply", "obj", "csv"] {
            let out = folder.path(&format!("out.{ending}"));
            let mut report = json(&[command, &["-o", &out, "--json"]].concat());
            report["seconds"] = 0.into();
            reports.push(report);
            let bytes = fs::read(&out).expect("it is there");
            let report = &reports[0];
            let (points, triangles) =
                (number(report, "points") as usize, number(report, "triangles") as usize);
            assert!(points > 10 && triangles > 10, "{report}");
            let lines = |start: &str| {
                String::from_utf8_lossy(&bytes).lines().filter(|line| line.starts_with(start)).count()
            };
            match ending {
                "vtp" => assert!(bytes.starts_with(b"<?xml")),
                "stl" => assert_eq!(bytes.len(), 84 + 50 * triangles),
                "ply" => assert!(bytes.starts_with(b"ply\nformat binary_little_endian 1.0\n")),
                "obj" => assert_eq!((lines("v "), lines("f ")), (points, triangles)),
                _ => assert_eq!(table(&out).1.len(), points),
            }
            assert!(number(report, "error_bound") >= 0.0 && report["satisfied"] == true);
        }
        assert!(reports.iter().all(|report| *report == reports[0]));
        let text = good(&[command, &["-o", &folder.path("out.vtp")]].concat());
        assert!(text.contains("error bound") && text.contains("triangles"));
    }
}

#[test]
fn a_slice_is_the_section_of_the_box() {
    let folder = Folder::new("slice");
    let mt = box_mt(&folder);
    let out = folder.path("slice.csv");
    let planes = [
        ("z=0.4", 2.0),
        ("x=1", 1.0),
        ("0,0,3,0", 2.0),
        ("0,-1,0,-1", 2.0),
        ("1,1,0,1.5", 2.0_f64.sqrt()),
        ("z=-1", 0.0),
    ];
    for (plane, area) in planes {
        let report = json(&["slice", &mt, "--plane", plane, "--field", "ramp", "-o", &out, "--json"]);
        assert!(near(number(&report, "area"), area), "{plane}: {report}");
        let (names, rows) = table(&out);
        assert_eq!(names, ["x", "y", "z", "ramp"]);
        for row in rows {
            assert!((row[0] + 2.0 * row[1] - row[2] - row[3]).abs() < 1e-3, "{row:?}");
        }
    }
    let obj = folder.path("slice.obj");
    let report = json(&["slice", &mt, "--plane", "z=0.4", "--edges", "-o", &obj, "--json"]);
    let lines = fs::read_to_string(&obj).expect("text").lines().filter(|line| line.starts_with("l ")).count();
    assert!(lines as f64 == number(&report, "edges") && lines > 100);
}

#[test]
fn isosurfaces_have_their_values_and_the_boundary_its_area() {
    let folder = Folder::new("iso");
    let mt = box_mt(&folder);
    let out = folder.path("iso.csv");
    let iso =
        |more: &[&str]| json(&[&["isosurface", &mt, "--field", "hill", "-o", &out, "--json"], more].concat());
    let [one, other] = ["4", "6"].map(|value| iso(&["--iso", value]));
    let both = iso(&["--iso", "4", "--iso", "6"]);
    assert_eq!(one["closed"], true);
    for key in ["points", "triangles", "area"] {
        assert!(
            (number(&one, key) + number(&other, key) - number(&both, key)).abs() < 1e-6 * number(&both, key)
        );
    }
    let (names, rows) = table(&out);
    assert_eq!(names, ["x", "y", "z", "nx", "ny", "nz", "hill"]);
    let ring = |row: &Vec<f64>| [row[0] - 1.0, row[1] - 0.5, row[2] - 0.5].iter().map(|x| x * x).sum::<f64>();
    for row in &rows {
        assert!((ring(row) - (1.0 / row[6] - 0.1)).abs() < 0.02, "{row:?}");
    }
    let ramp = json(&["isosurface", &mt, "--iso", "1.5", "--field", "ramp", "-o", &out, "--json"]);
    assert_eq!(ramp["closed"], false);
    let surface = json(&["surface", &mt, "--error", "3%", "-o", &out, "--json"]);
    assert!(near(number(&surface, "area"), 10.0) && surface["closed"] == true, "{surface}");
}

#[test]
fn what_cannot_be_done_is_refused_with_a_reason() {
    let folder = Folder::new("refuse");
    let mt = box_mt(&folder);
    let out = folder.path("out.vtp");
    let before = folder.names();
    bad(2, &["isosurface", &mt, "-o", &out], &["--iso"]);
    bad(2, &["surface", &mt, "-o", &folder.path("out.xyz")], &[".vtp", ".csv"]);
    bad(2, &["slice", &mt, "-o", &out], &["--plane"]);
    for plane in ["w=1", "1,2,3", "0,0,0,1", "x=", "1,2,nan,4"] {
        bad(2, &["slice", &mt, "--plane", plane, "-o", &out], &["--plane"]);
    }
    bad(1, &["surface", &mt, "--field", "none", "-o", &out], &["none", "ramp", "hill"]);
    bad(1, &["surface", &folder.path("box.vti"), "-o", &out], &["box.vti", "not an MT file"]);
    bad(1, &["slice", &mt, "--plane", "z=0.5", "--edges", "-o", &folder.path("o.stl")], &["o.stl", ".vtp"]);
    assert_eq!(folder.names(), before);
}
