//! Promise: the commands that look into a mesh write what they say, in every format, with the error that is guaranteed.

use crate::support::{Folder, bad, good, json, number, table};
use std::fs;
use tetralod::mesh::{Field, Grid, TetMesh};

/// Makes an MT of a box from (0, 0, 0) to (2, 1, 1) with a linear field `ramp`, a field `hill`, and the velocity of a
/// rotation around the axis through (1, 0.5, 0) along z.
fn box_mt(folder: &Folder) -> String {
    let grid = Grid { dims: [17, 9, 9], origin: [0.0; 3], spacing: [0.125; 3] };
    let mut mesh = TetMesh::from_grid(grid, Vec::new());
    let mut field = |name: &str, f: fn([f64; 3]) -> f64| {
        let values = mesh.positions.iter().map(|p| f(*p)).collect();
        mesh.fields.push(Field::new(name, values));
    };
    field("ramp", |[x, y, z]| x + 2.0 * y - z);
    field("hill", |[x, y, z]| 1.0 / (0.1 + (x - 1.0).powi(2) + (y - 0.5).powi(2) + (z - 0.5).powi(2)));
    field("v_x", |[_, y, _]| 0.5 - y);
    field("v_y", |[x, _, _]| x - 1.0);
    field("v_z", |_| 0.0);
    let [input, mt] = ["box.vti", "box.mt"].map(|name| folder.path(name));
    tetralod_io::write_vti(&mesh, &mut fs::File::create(&input).expect("a file")).expect("it is written");
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
        assert_eq!(names, ["x", "y", "z", "ramp", "hill", "v_x", "v_y", "v_z"]);
        for row in rows {
            assert!((row[0] + 2.0 * row[1] - row[2] - row[3]).abs() < 1e-3, "{row:?}");
            assert!((0.5 - row[1] - row[5]).abs() < 1e-3 && (row[0] - 1.0 - row[6]).abs() < 1e-3, "{row:?}");
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
    assert_eq!(names, ["x", "y", "z", "nx", "ny", "nz", "ramp", "hill", "v_x", "v_y", "v_z"]);
    let ring = |row: &Vec<f64>| [row[0] - 1.0, row[1] - 0.5, row[2] - 0.5].iter().map(|x| x * x).sum::<f64>();
    for row in &rows {
        assert!((ring(row) - (1.0 / row[7] - 0.1)).abs() < 0.02, "{row:?}");
        assert!((row[6] - (row[0] + 2.0 * row[1] - row[2])).abs() < 1e-3, "the ramp is linear: {row:?}");
    }
    let ramp = json(&["isosurface", &mt, "--iso", "1.5", "--field", "ramp", "-o", &out, "--json"]);
    assert_eq!(ramp["closed"], false);
    let surface = json(&["surface", &mt, "--error", "3%", "-o", &out, "--json"]);
    assert!(near(number(&surface, "area"), 10.0) && surface["closed"] == true, "{surface}");
    assert_eq!(table(&out).0, ["x", "y", "z", "ramp", "hill", "v_x", "v_y", "v_z"]);
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

#[test]
fn points_have_their_values() {
    let folder = Folder::new("points");
    let mt = box_mt(&folder);
    let points = ["--point", "0.3,0.4,0.5", "--point", "3,0,0", "--point", "2,1,1"];
    let report = json(&[&["probe", &mt, "--json"], &points[..]].concat());
    assert_eq!((number(&report, "points"), number(&report, "outside")), (3.0, 1.0));
    let values = report["values"].as_array().expect("one each");
    assert!(near(number(&values[0], "ramp"), 0.6) && near(number(&values[2], "ramp"), 3.0), "{report}");
    assert!(values[1].is_null() && number(&values[0], "hill") > 0.0);
    assert!(good(&[&["probe", &mt], &points[..]].concat()).contains("ramp at 0.3,0.4,0.5"));

    let [input, out, lines] = ["in.csv", "out.csv", "out.vtp"].map(|name| folder.path(name));
    fs::write(&input, "x,y,z,name\n0.25,0.5,0.75,a\n-1,0,0,b\n 1 , 1 , 1 ,c\n").expect("a file");
    let report = json(&["probe", &mt, "--points", &input, "-o", &out, "--json"]);
    assert_eq!((number(&report, "points"), number(&report, "outside")), (3.0, 1.0));
    let (names, rows) = table(&out);
    assert_eq!(names, ["x", "y", "z", "tetrahedron", "ramp", "hill", "v_x", "v_y", "v_z"]);
    assert!(near(rows[0][4], 0.5) && rows[1][4].is_nan() && near(rows[2][4], 2.0), "{rows:?}");
    // The points of a mesh are all inside it.
    let report = json(&["probe", &mt, "--points", &folder.path("box.vti"), "-o", &lines, "--json"]);
    assert_eq!((number(&report, "points"), number(&report, "outside")), (17.0 * 81.0, 0.0));
    fs::write(&input, "x,y,z\n1,2\n").expect("a file");
    bad(1, &["probe", &mt, "--points", &input], &["in.csv", "line 2", "3 numbers"]);
    // Only what the points need is refined, and they have the values of the whole reference mesh.
    let one =
        ["probe", &mt, "--point", "0.3,0.4,0.5", "--point", "1.9,0.9,0.1", "--point", "-1,0,0", "--json"];
    let (some, all) = (json(&one), json(&[&one[..], &["--need", "error=0"]].concat()));
    assert_eq!((&some["values"], &some["error_bound"]), (&all["values"], &all["error_bound"]));
    assert!(number(&some, "tetrahedra") < 0.5 * number(&all, "tetrahedra"), "{some}");
    assert!(number(&some, "bytes_read") <= number(&all, "bytes_read"));
    let one = ["probe", &mt, "--line", "0,0.1,0.2,2,0.9,0.8", "-o", &out, "--json"];
    let some = (json(&one), table(&out).1);
    let all = (json(&[&one[..], &["--need", "error=0"]].concat()), table(&out).1);
    // The same tetrahedra have other numbers.
    let values =
        |rows: &[Vec<f64>]| rows.iter().map(|row| [&row[..4], &row[5..]].concat()).collect::<Vec<_>>();
    assert_eq!(values(&some.1), values(&all.1));
    assert!(number(&some.0, "tetrahedra") < 0.7 * number(&all.0, "tetrahedra"), "{}", some.0);
    bad(2, &["probe", &mt], &["--point"]);
    bad(2, &["probe", &mt, "--point", "1,2,3", "--line", "0,0,0,1,1,1"], &["--point", "--line"]);
    bad(2, &["probe", &mt, "--point", "1,2,3", "--samples", "3"], &["--line"]);
}

#[test]
fn lines_have_their_profile() {
    let folder = Folder::new("lines");
    let mt = box_mt(&folder);
    let [out, lines] = ["out.csv", "out.obj"].map(|name| folder.path(name));
    let line = ["probe", &mt, "--error", "2%", "--line", "-1,0.3,0.2,3,0.5,0.7", "--json", "-o"];
    let report = json(&[&line[..], &[&out]].concat());
    let whole = number(&report, "length");
    assert!(
        near(whole, (16.0_f64 + 0.04 + 0.25).sqrt()) && near(number(&report, "length_inside"), 0.5 * whole)
    );
    let (names, rows) = table(&out);
    assert_eq!(names[..5], ["distance", "x", "y", "z", "tetrahedron"]);
    assert!(rows.len() % 2 == 0 && rows.is_sorted_by(|a, b| a[0] <= b[0]));
    let error = number(&report, "relative_error_bound") * 4.0 + 1e-3;
    assert!(rows.iter().all(|row| (row[1] + 2.0 * row[2] - row[3] - row[5]).abs() <= error), "{rows:?}");
    json(&[&line[..], &[&lines]].concat());
    assert!(fs::read_to_string(&lines).expect("text").lines().any(|line| line.starts_with("l ")));

    let report = json(&[&line[..], &[&out, "--samples", "41"]].concat());
    let (_, rows) = table(&out);
    assert_eq!((rows.len(), number(&report, "points")), (41, 41.0));
    let inside = rows.iter().filter(|row| !row[5].is_nan()).count() as f64;
    assert!((19.0..=21.0).contains(&inside) && inside + number(&report, "outside") == 41.0);
}

#[test]
fn streamlines_follow_the_field() {
    let folder = Folder::new("stream");
    let mt = box_mt(&folder);
    let [out, lines] = ["out.csv", "out.vtp"].map(|name| folder.path(name));
    let seeds = ["streamlines", &mt, "--seeds", "1.1,0.5,0.3,1.4,0.5,0.3,4", "--seed", "5,5,5", "--vector"];
    let report = json(&[&seeds[..], &["v", "--length", "2", "-o", &out, "--json"]].concat());
    assert_eq!(["seeds", "outside", "lines"].map(|key| number(&report, key)), [5.0, 1.0, 4.0]);
    assert_eq!(report["ends"]["length"], 8, "both ways: {report}");
    let (names, rows) = table(&out);
    assert_eq!(names[..6], ["line", "time", "x", "y", "z", "speed"]);
    assert_eq!(rows.len() as f64, number(&report, "points"));
    for row in &rows {
        let radius = ((row[2] - 1.0).powi(2) + (row[3] - 0.5).powi(2)).sqrt();
        assert!(
            (radius - (1.1 + 0.1 * row[0] - 1.0)).abs() < 1e-3 && (row[5] - radius).abs() < 1e-3,
            "{row:?}"
        );
    }
    let forward = ["v_x,v_y,v_z", "--direction", "forward", "--length", "2", "-o", &lines, "--json"];
    let report = json(&[&seeds[..], &forward[..]].concat());
    assert_eq!(report["ends"]["length"], 4);
    assert!(good(&[&seeds[..], &["v", "-o", &lines]].concat()).contains("seeds"));
    let before = folder.names();
    bad(1, &[&seeds[..], &["w", "-o", &lines]].concat(), &["'w'", "v_x"]);
    bad(1, &[&seeds[..], &["v", "-o", &folder.path("x.stl")]].concat(), &["x.stl", "triangles"]);
    bad(2, &["streamlines", &mt, "--vector", "v", "-o", &lines], &["--seed"]);
    assert_eq!(folder.names(), before);
}

#[test]
fn statistics_are_those_of_the_box() {
    let folder = Folder::new("stats");
    let mt = box_mt(&folder);
    let [input, out] = ["box.vti", "out.csv"].map(|name| folder.path(name));
    let report = json(&["stats", &mt, "--reference", &input, "-o", &out, "--json"]);
    // x + 2 y - z over the box: mean 1 + 1 - 1/2, variance (4 + 4 + 1) / 12.
    for (key, expected) in
        [("volume", 2.0), ("integral", 3.0), ("mean", 1.5), ("standard_deviation", 0.75_f64.sqrt())]
    {
        assert!(near(number(&report, key), expected), "{key}: {report}");
        assert!(near(number(&report["reference"], key), expected), "{key}: {report}");
    }
    for key in ["volume_error", "integral_error", "mean_error", "histogram_error"] {
        assert!(number(&report["reference"], key).abs() < 1e-3, "{key}: {report}");
    }
    let (names, rows) = table(&out);
    assert_eq!((names.len(), rows.len()), (3, 10));
    assert!((rows.iter().map(|row| row[2]).sum::<f64>() - 2.0).abs() < 1e-9);

    let narrow = ["stats", &mt, "--field", "hill", "--bins", "4", "--bin-range", "2,5", "--json"];
    let report = json(&narrow);
    let bins = &report["histogram"];
    let volumes: f64 =
        bins["volumes"].as_array().expect("four").iter().filter_map(serde_json::Value::as_f64).sum();
    assert!(number(bins, "below") > 0.0 && number(bins, "above") > 0.0);
    assert!((volumes + number(bins, "below") + number(bins, "above") - 2.0).abs() < 1e-9);
    assert!(good(&["stats", &mt, "--reference", &input]).contains("histogram"));
    // The coarse mesh is off by something, and says by how much.
    let coarse = json(&["stats", &mt, "--field", "hill", "--error", "30%", "--reference", &input, "--json"]);
    assert!(number(&coarse["reference"], "integral_error") != 0.0);
    bad(2, &["stats", &mt, "--bin-range", "5,2"], &["--bin-range"]);
    bad(2, &["stats", &mt, "--bins", "0"], &["--bins"]);
    assert_eq!(report.get("regions"), None, "there are none");
}

#[test]
fn statistics_are_compared_with_fields_at_cells() {
    let folder = Folder::new("cell-stats");
    let [input, apart, across] = ["two.vtk", "apart.mt", "across.mt"].map(|name| folder.path(name));
    let points = "POINTS 5 double\n0 0 0 1 0 0 0 1 0 0 0 1 0 0 -3\nCELLS 2 10\n4 0 1 2 3\n4 0 2 1 4\nCELL_TYPES 2\n10\n10\n";
    let data = "CELL_DATA 2\nSCALARS part int 1\nLOOKUP_TABLE default\n7 9\nSCALARS m double 1\nLOOKUP_TABLE default\n8 4\n";
    let head = "# vtk DataFile Version 3.0\ntwo\nASCII\nDATASET UNSTRUCTURED_GRID\n";
    fs::write(&input, [head, points, data].concat()).expect("a file");
    let build = ["build", &input, "--cell-to-point", "--preserve", "part", "--field", "m", "-o"];
    good(&[&build[..], &[&apart]].concat());
    good(&[&build[..], &[&across, "--mean-across-regions"]].concat());
    // The volumes are 1/6 and 3/6; the mean across regions is 5 where they meet.
    for (mt, integral) in
        [(&apart, (8.0 + 3.0 * 4.0) / 6.0), (&across, (23.0 / 4.0 + 3.0 * 19.0 / 4.0) / 6.0)]
    {
        let report = json(&["stats", mt, "--reference", &input, "--json"]);
        assert!(near(number(&report, "integral"), integral), "{report}");
        assert!(near(number(&report["reference"], "integral"), integral), "{report}");
        assert!(number(&report["reference"], "histogram_error") < 1e-2, "{report}");
    }
}

#[test]
fn statistics_of_regions_add_up_and_those_of_one_are_its_own() {
    let folder = Folder::new("region-stats");
    let [input, mt] = ["t.vtu", "t.mt"].map(|name| folder.path(name));
    good(&["generate", "turbine", "--size", "5", "-o", &input]);
    good(&["build", &input, "--all-fields", "--preserve", "part", "-o", &mt]);
    let ask = |more: &[&str]| json(&[&["stats", &mt, "--field", "stress", "--json"], more].concat());
    let whole = ask(&[]);
    let regions = whole["regions"].as_array().expect("a list").clone();
    assert_eq!(regions.len(), 12);
    for key in ["volume", "integral", "tetrahedra"] {
        let sum: f64 = regions.iter().map(|region| number(region, key)).sum();
        assert!((sum - number(&whole, key)).abs() <= 1e-12 * sum.abs(), "{key}: {sum} {}", whole[key]);
    }
    let info = json(&["info", &mt, "--json"]);
    for (region, stated) in regions.iter().zip(info["regions"]["all"].as_array().expect("a list")) {
        assert_eq!((&region["name"], &region["tetrahedra"]), (&stated["name"], &stated["tetrahedra"]));
        assert!((number(region, "volume") / number(stated, "volume") - 1.0).abs() < 1e-9, "{region}");
    }
    // What is asked for in one region is of that alone, the whole, too.
    let hub = ask(&["--region", "2", "--error", "1%"]);
    let [own] = &hub["regions"].as_array().expect("a list")[..] else { panic!("one region") };
    for key in ["volume", "integral", "mean", "standard_deviation", "min", "max"] {
        assert_eq!(own[key], hub[key], "{key}");
    }
    assert!(number(own, "error_bound") <= number(&hub, "error_bound"), "{hub}");
    // Curved boundaries are within the error.
    assert!((number(&hub, "volume") / number(&regions[1], "volume") - 1.0).abs() < 1e-2);
    assert!(good(&["stats", &mt, "--region", "2"]).contains("2: "));
    bad(2, &["stats", &mt, "--region", "2", "--reference", &input], &["--reference", "--region"]);
}
