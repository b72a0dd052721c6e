//! Promises of the command for several fields, time steps, fields at cells, units and precision.

use crate::support::{Folder, bad, command, good, json, number, run, table, text};
use std::fs;
use std::fs::File;
use tetralod::mesh::{Field, Grid, TetMesh, VectorPart};
use tetralod_io as io;

/// Cubes with a scalar and a vector that depend on the time.
fn step(time: Option<f64>, factor: f64) -> TetMesh {
    let grid = Grid { dims: [5, 4, 4], origin: [0.0; 3], spacing: [0.25, 0.5, 0.5] };
    let mut mesh = TetMesh { grid: None, ..TetMesh::from_grid(grid, Vec::new()) };
    let at = |value: fn([f64; 3]) -> f64| -> Vec<f64> {
        mesh.positions.iter().map(|p| factor * value(*p)).collect()
    };
    let vector = |component| Some(VectorPart { name: "U".into(), component: Some(component) });
    let fields = vec![
        Field { unit: "Pa".into(), ..Field::new("p", at(|[x, y, z]| x * x + y * z)) },
        Field { vector: vector(0), ..Field::new("U_x", at(|[x, _, z]| x * z)) },
        Field { vector: vector(1), ..Field::new("U_y", at(|[_, y, _]| y)) },
        Field { vector: vector(2), ..Field::new("U_z", at(|[x, y, z]| x + y * z)) },
    ];
    mesh.fields = fields.into_iter().map(|field| Field { time, ..field }).collect();
    mesh
}

fn write(path: &str, mesh: &TetMesh) {
    io::write_vtu(mesh, &mut File::create(path).expect("a new file")).expect("a mesh that can be written");
}

fn names(info: &serde_json::Value) -> Vec<&str> {
    let fields = info["fields"].as_array().expect("a list");
    fields.iter().map(|field| field["name"].as_str().expect("a name")).collect()
}

#[test]
fn several_fields_with_units_times_and_metadata() {
    let folder = Folder::new("several-fields");
    let [input, mt, out] = ["a.vtu", "a.mt", "b.vtu"].map(|name| folder.path(name));
    write(&input, &step(Some(0.75), 1.0));
    let built = ["build", &input, "-o", &mt, "--quiet"];
    good(&[&built[..], &["--field", "p", "--field", "U", "--unit", "U=m/s", "--meta", "case=a=b"]].concat());
    let info = json(&["info", &mt, "--json"]);
    assert_eq!(names(&info), ["p", "U_x", "U_y", "U_z"]);
    let field = |i: usize| &info["fields"][i];
    assert_eq!((&field(0)["unit"], &field(2)["unit"]), (&"Pa".into(), &"m/s".into()));
    assert_eq!((&field(3)["vector"]["name"], &field(3)["vector"]["component"]), (&"U".into(), &2.into()));
    assert!((0..4).all(|i| field(i)["time"] == 0.75 && number(field(i), "floor") > 0.0));
    assert_eq!(info["metadata"]["case"], "a=b");
    let shown = good(&["info", &mt]);
    assert!(shown.contains("U_z (component 2 of U)") && shown.contains("m/s") && shown.contains("time 0.75"));
    // All of it is in what is written, and read back from there.
    json(&["extract", &mt, "-o", &out, "--json"]);
    let read = io::read(out.as_ref()).expect("a mesh");
    assert_eq!(read.fields.iter().map(|f| f.name.as_str()).collect::<Vec<_>>()[..4], names(&info)[..]);
    assert_eq!((read.fields[0].unit.as_str(), read.fields[3].unit.as_str()), ("Pa", "m/s"));
    assert!(read.fields.iter().all(|field| field.time == Some(0.75)));
    assert_eq!(json(&["verify", &mt, "--against", &input, "--json"])["valid"], true);
    // A vector's length only by its own name.
    good(&[&built[..], &["--all-fields"]].concat());
    assert_eq!(names(&json(&["info", &mt, "--json"])), ["p", "U_x", "U_y", "U_z"]);
    good(&[&built[..], &["--field", "U_magnitude", "--field", "p"]].concat());
    assert_eq!(names(&json(&["info", &mt, "--json"])), ["U_magnitude", "p"]);
    bad(1, &[&built[..], &["--field", "q"]].concat(), &["'q'", "U_x"]);
    bad(1, &[&built[..], &["--unit", "q=m"]].concat(), &["'q'"]);
    bad(2, &[&built[..], &["--meta", "method=x"]].concat(), &["method"]);
    // A conversion keeps it all.
    let [again, vertex] = ["c.mt", "d.mt"].map(|name| folder.path(name));
    good(&["build", &input, "-o", &again, "--quiet", "--field", "U", "--meta", "case=1"]);
    good(&["convert", &again, "-o", &vertex, "--kind", "vertex", "--quiet"]);
    let [a, b] = [&again, &vertex].map(|path| {
        let mut info = json(&["info", path, "--json"]);
        let fields = info["fields"].as_array_mut().expect("a list");
        // How many bytes a mesh takes depends on the kind.
        fields.iter_mut().for_each(|field| _ = field.as_object_mut().expect("a field").remove("curve"));
        info
    });
    assert_eq!(a["fields"].as_array().map(Vec::len), Some(3));
    assert_eq!((&a["fields"], &a["metadata"]), (&b["fields"], &b["metadata"]));
}

/// The fields of an MT with the times that they are of.
fn times(path: &str) -> Vec<(String, f64)> {
    let info = json(&["info", path, "--json"]);
    let fields = info["fields"].as_array().expect("a list").iter();
    fields.map(|f| (f["name"].as_str().expect("a name").to_owned(), number(f, "time"))).collect()
}

#[test]
fn a_file_with_several_time_steps_gives_all_or_one() {
    let folder = Folder::new("steps-in-a-file");
    let mt = folder.path("a.mt");
    let input = format!("{}/../crates/io/tests/data/steps.vtkhdf", env!("CARGO_MANIFEST_DIR"));
    for (more, expected) in [(&[][..], &[0.0, 0.5, 2.0][..]), (&["--step", "1"], &[0.5])] {
        good(&[&["build", &input, "-o", &mt, "--quiet"], more].concat());
        let expected: Vec<_> = expected.iter().map(|time| ("p".to_owned(), *time)).collect();
        assert_eq!(times(&mt), expected);
        assert_eq!(json(&["verify", &mt, "--against", &input, "--json"])["valid"], true);
    }
    bad(1, &["build", &input, "-o", &mt, "--step", "3"], &["--step 3", "there are 3 time steps"]);
}

#[test]
fn time_steps_share_one_mesh() {
    let folder = Folder::new("time-steps");
    let [first, second, mt, list] = ["a.vtu", "b.vtu", "s.mt", "s.pvd"].map(|name| folder.path(name));
    write(&first, &step(None, 1.0));
    write(&second, &step(None, -2.0));
    let fields = ["--field", "U_y", "--field", "p", "--quiet"];
    good(&[&["build", &first, &second, "-o", &mt], &fields[..]].concat());
    let pairs = |a: f64, b: f64| [("U_y", a), ("U_y", b), ("p", a), ("p", b)].map(|(n, t)| (n.to_owned(), t));
    assert_eq!(times(&mt), pairs(0.0, 1.0));
    let both = ["--against", &first, "--against", &second];
    assert_eq!(json(&[&["verify", &mt, "--json"], &both[..]].concat())["valid"], true);
    let without = run(&["verify", &mt, "--against", &second]);
    assert!(!without.status.success() && text(&without.stdout).contains("U_y"));
    fs::write(
        &list,
        "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"3.5\" file=\"b.vtu\"/>\
         <DataSet timestep=\"-1\" file=\"a.vtu\"/></Collection></VTKFile>",
    )
    .expect("a new file");
    good(&[&["build", &list, "-o", &mt], &fields[..]].concat());
    assert_eq!(times(&mt), pairs(-1.0, 3.5));
    assert_eq!(json(&["verify", &mt, "--against", &list, "--json"])["valid"], true);
    assert!(good(&["info", &mt]).contains("2 times from -1 to 3.5"));
    // Only one mesh, only different times, only fields that all steps have.
    let [other, fewer] = ["c.vtu", "d.vtu"].map(|name| folder.path(name));
    let mut moved = step(None, 1.0);
    moved.positions[7][0] += 0.01;
    write(&other, &moved);
    bad(1, &["build", &first, &other, "-o", &mt], &["c.vtu", "point 7"]);
    let mut without = step(None, 1.0);
    without.fields.remove(0);
    write(&fewer, &without);
    bad(1, &["build", &first, &fewer, "-o", &mt], &["d.vtu", "\"p\""]);
    good(&["build", &first, &fewer, "-o", &mt, "--quiet", "--field", "U"]);
    write(&first, &step(Some(1.0), 1.0));
    bad(1, &["build", &first, &second, "-o", &mt], &["b.vtu", "time"]);
    write(&second, &step(Some(1.0), 2.0));
    bad(1, &["build", &first, &second, "-o", &mt], &["b.vtu", "time step at 1"]);
}

/// An MT of two time steps, of which the second is the first times -2; its folder.
pub fn two_steps(name: &str) -> (Folder, String) {
    let folder = Folder::new(name);
    let [first, second, mt, list] = ["a.vtu", "b.vtu", "s.mt", "s.pvd"].map(|name| folder.path(name));
    write(&first, &step(None, 1.0));
    write(&second, &step(None, -2.0));
    fs::write(
        &list,
        "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"-1\" file=\"a.vtu\"/>\
         <DataSet timestep=\"3.5\" file=\"b.vtu\"/></Collection></VTKFile>",
    )
    .expect("a new file");
    good(&["build", &list, "-o", &mt, "--all-fields", "--lossless", "--quiet"]);
    (folder, mt)
}

#[test]
fn a_time_says_which_step_is_meant() {
    let (folder, mt) = two_steps("a-time");
    let mean = |time: &[&str]| {
        let report = json(&[&["stats", &mt, "--field", "p", "--json"], time].concat());
        (report["time"].clone(), number(&report, "mean"))
    };
    let (first, second) = (mean(&[]), mean(&["--time", "3.5"]));
    assert_eq!((&first.0, &second.0), (&(-1.0).into(), &3.5.into()));
    assert!((second.1 + 2.0 * first.1).abs() < 1e-4 && first.1 > 0.1, "{first:?} {second:?}");
    assert_eq!(mean(&["--time", "-1"]), first);
    // As many digits as are told of it.
    assert_eq!(mean(&["--time", "3.5000001"]), second);
    // Needs have times of their own, or that of all.
    for need in ["field=p; time=3.5; error=1%", "field=p; error=1%"] {
        let report = json(&["stats", &mt, "--field", "p", "--time", "3.5", "--need", need, "--json"]);
        assert_eq!((&report["time"], &report["satisfied"]), (&3.5.into(), &true.into()));
    }
    // What is written has the fields of that time, by their names alone.
    let [vtu, csv] = ["m.vtu", "m.csv"].map(|name| folder.path(name));
    json(&["extract", &mt, "--time", "3.5", "-o", &vtu, "--json"]);
    let read = io::read(vtu.as_ref()).expect("a mesh");
    assert_eq!(
        read.fields.iter().map(|f| f.name.as_str()).collect::<Vec<_>>()[..4],
        ["p", "U_x", "U_y", "U_z"]
    );
    assert!(read.fields.iter().all(|field| field.time == Some(3.5)));
    let known = |[x, y, z]: &[f64; 3]| -2.0 * (x * x + y * z);
    let pairs = || read.positions.iter().zip(&read.fields[0].values);
    assert_eq!(pairs().count(), 80);
    assert!(pairs().all(|(p, value)| (value - known(p)).abs() < 1e-4), "{:?}", pairs().collect::<Vec<_>>());
    let surface = ["surface", &mt, "--deform", "U", "--factor", "1", "-o", &csv, "--json"];
    let report = json(&[&surface[..], &["--time", "3.5"]].concat());
    assert_eq!((&report["time"], &report["deform_time"]), (&3.5.into(), &3.5.into()));
    let (names, second) = table(&csv);
    assert_eq!(names, ["x", "y", "z", "p", "U_x", "U_y", "U_z"]);
    json(&surface);
    let (names, first) = table(&csv);
    assert_eq!(names[3..6], ["p@-1.0", "p@3.5", "U_x@-1.0"]);
    // The displacement, too, is the other one times -2.
    let place = |row: &[f64], u: usize, factor: f64| (row[2] - factor * row[u]) as f32;
    let z = |rows: &[Vec<f64>], u: usize| rows.iter().map(|row| place(row, u, 1.0)).collect::<Vec<_>>();
    let (before, after) = (z(&first, 9), z(&second, 6));
    assert!(before.iter().zip(&after).all(|(a, b)| (a - b).abs() < 1e-5), "{before:?} {after:?}");
    let lines =
        ["streamlines", &mt, "--vector", "U", "--seed", "0.5,0.7,0.7", "--direction", "forward", "-o", &csv];
    let speed = |time: &str| {
        good(&[&lines[..], &["--time", time]].concat());
        let (names, rows) = table(&csv);
        rows[0][names.iter().position(|name| name == "speed").expect("a speed")]
    };
    let speeds = [speed("-1"), speed("3.5")];
    assert!((speeds[1] / speeds[0] - 2.0).abs() < 1e-4, "{speeds:?}");
    bad(1, &["stats", &mt, "--field", "p", "--time", "2"], &["'p' has no time step at 2", "-1, 3.5"]);
    bad(1, &["extract", &mt, "-o", &vtu, "--time", "0"], &["has no time step at 0"]);
    bad(2, &["stats", &mt, "--time", "soon"], &["not a number"]);
    // A file without times has no step at any.
    let [input, plain] = ["plain.vtu", "plain.mt"].map(|name| folder.path(name));
    write(&input, &step(None, 1.0));
    good(&["build", &input, "-o", &plain, "--field", "p", "--quiet"]);
    bad(1, &["stats", &plain, "--time", "2"], &["'p' has no time steps"]);
    assert_eq!(json(&["stats", &plain, "--json"]).get("time"), None);
}

#[test]
fn a_probe_tells_values_over_time() {
    let (folder, mt) = two_steps("probe-over-time");
    let point = ["probe", &mt, "--point", "0.5,1,1"];
    let report = json(&[&point[..], &["--json", "--point", "9,9,9"]].concat());
    let p = [number(&report["values"][0], "p@-1.0"), number(&report["values"][0], "p@3.5")];
    assert!((p[0] - 1.25).abs() < 1e-4 && (p[1] + 2.5).abs() < 1e-4, "{p:?}");
    let over = &report["over_time"];
    assert_eq!(over["times"], serde_json::json!([-1.0, 3.5]));
    assert_eq!(over["values"][0]["p"], serde_json::json!(p));
    assert_eq!(
        (&over["values"][1], over["values"].as_array().map(Vec::len)),
        (&serde_json::Value::Null, Some(2))
    );
    let told = good(&point);
    assert!(told.contains("p@-1.0 at 0.5,1,1") && told.contains("p@3.5 at 0.5,1,1"), "{told}");
    // Of one time it is as without times.
    let report = json(&[&point[..], &["--time", "3.5", "--json"]].concat());
    assert_eq!((number(&report["values"][0], "p"), report.get("over_time")), (p[1], None));
    // A row for each point and time.
    let csv = folder.path("t.csv");
    good(&[&point[..], &["--over-time", "-o", &csv]].concat());
    let (names, rows) = table(&csv);
    assert_eq!(names, ["point", "x", "y", "z", "time", "p", "U_x", "U_y", "U_z"]);
    assert_eq!(rows.iter().map(|row| row[4]).collect::<Vec<_>>(), [-1.0, 3.5]);
    assert_eq!(rows.iter().map(|row| row[5]).collect::<Vec<_>>(), p);
    good(&["probe", &mt, "--line", "0,1,1,1,1,1", "--samples", "3", "--over-time", "-o", &csv]);
    let (names, rows) = table(&csv);
    assert_eq!((names[1].as_str(), names[5].as_str(), rows.len()), ("distance", "time", 6));
    bad(2, &[&point[..], &["--over-time", "-o", &folder.path("t.vtp")]].concat(), &[".csv"]);
    bad(2, &[&point[..], &["--over-time"]].concat(), &["--output"]);
    // An error is one at all times.
    let report = json(&[&point[..], &["--over-time", "--error", "5%", "-o", &csv, "--json"]].concat());
    assert_eq!(report["needs"].as_array().map(Vec::len), Some(2));
}

/// A mesh of two tetrahedra with a field at its cells.
const TWO_CELLS: &str = "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET UNSTRUCTURED_GRID\n\
    FIELD FieldData 1\nTimeValue 1 1 double\n12.5\nPOINTS 5 double\n0 0 0 1 0 0 0 1 0 0 0 1 0 0 -3\n\
    CELLS 2 10\n4 0 1 2 3\n4 0 2 1 4\nCELL_TYPES 2\n10 10\n\
    CELL_DATA 2\nSCALARS rho double 1\nLOOKUP_TABLE default\n8 4\n";

#[test]
fn fields_at_cells_become_fields_at_points() {
    let folder = Folder::new("cell-fields");
    let [input, mt, out] = ["a.vtk", "a.mt", "b.vtu"].map(|name| folder.path(name));
    fs::write(&input, TWO_CELLS).expect("a new file");
    bad(1, &["build", &input, "-o", &mt], &["rho", "--cell-to-point"]);
    bad(1, &["build", &input, "-o", &mt, "--field", "rho"], &["rho", "--cell-to-point"]);
    let options = ["--cell-to-point", "--all-fields", "--field-bits", "24", "--unit", "rho=kg"];
    let report = json(&[&["build", &input, "-o", &mt, "--quiet", "--json"], &options[..]].concat());
    let info = json(&["info", &mt, "--json"]);
    // What averaging does is said by the build and by the file, in the input's own numbers and places.
    let extreme = |value: f64, place: [f64; 3]| serde_json::json!({ "value": value, "place": place });
    let of_cell = |value: f64, z: f64, cell: u32| serde_json::json!({ "value": value, "place": [0.25, 0.25, z], "cell": cell });
    let input_at_cells = serde_json::json!({ "min": of_cell(4.0, -0.75, 1), "max": of_cell(8.0, 0.25, 0) });
    let points =
        serde_json::json!({ "min": extreme(4.0, [0.0, 0.0, -3.0]), "max": extreme(8.0, [0.0, 0.0, 1.0]) });
    let averaged = &report["averaged"][0];
    assert_eq!((&averaged["name"], &averaged["unit"]), (&"rho".into(), &"kg".into()));
    assert_eq!((&averaged["input"], &averaged["points"]), (&input_at_cells, &points));
    assert!((number(&averaged["difference"], "rms") - 1.6875_f64.sqrt()).abs() < 1e-12);
    assert_eq!(number(&averaged["difference"], "largest"), 2.25);
    let field = &info["fields"][0];
    assert_eq!((&field["extremes"], &field["averaged"]["input"]), (&points, &input_at_cells));
    assert_eq!(field["averaged"]["difference"], averaged["difference"]);
    // It stands in front of the updates.
    let head = json(&["info", &mt, "--head", "--json"]);
    assert_eq!((&head["full"], &head["fields"][0]["averaged"]), (&false.into(), &field["averaged"]));
    let told = good(&["info", &mt]);
    for (name, value) in [
        ("smallest", "4 at (0, 0, -3)"),
        ("largest", "8 at (0, 0, 1)"),
        ("input at cells", "4 in cell 1 at (0.25, 0.25, -0.75) to 8 in cell 0 at (0.25, 0.25, 0.25)"),
        ("difference", "root mean square 1.29904, 2.25 at most"),
    ] {
        let is_row = |line: &str| line.trim().strip_prefix(name).map(str::trim) == Some(value);
        assert!(told.lines().any(is_row), "{name}: {told}");
    }
    // Whoever rewrites the file keeps it, and parts have it, too.
    let other = folder.path("c.mt");
    good(&["convert", &mt, "--kind", "vertex", "-o", &other, "--quiet"]);
    assert_eq!(json(&["info", &other, "--json"])["fields"][0]["averaged"], field["averaged"]);
    good(&[&["build", &input, "-o", &other, "--quiet", "--parts", "1"], &options[..]].concat());
    assert_eq!(json(&["info", &other, "--json"])["fields"][0]["averaged"], field["averaged"]);
    // A field at points is not averaged.
    assert_eq!(
        json(&["build", &input, "-o", &other, "--quiet", "--json", "--field", "x"]).get("averaged"),
        None
    );
    assert_eq!((names(&info), &info["fields"][0]["time"]), (vec!["rho"], &12.5.into()));
    json(&["extract", &mt, "-o", &out, "--json"]);
    let mut values = io::read(out.as_ref()).expect("a mesh").fields[0].values.clone();
    values.sort_by(f64::total_cmp);
    for (value, expected) in values.iter().zip([4.0, 5.0, 5.0, 5.0, 8.0]) {
        assert!((value - expected).abs() < 1e-6, "{values:?}");
    }
    assert_eq!(json(&["verify", &mt, "--against", &input, "--json"])["valid"], true);
}

#[test]
fn precision_is_asked_for_and_told() {
    let folder = Folder::new("precision");
    let [input, mt] = ["a.vtu", "a.mt"].map(|name| folder.path(name));
    let mut mesh = step(None, 1.0);
    mesh.positions.iter_mut().for_each(|p| p[0] += 0.01 * (p[1] * 7.0).sin());
    write(&input, &mesh);
    let info = |more: &[&str]| {
        good(&[&["build", &input, "-o", &mt, "--quiet", "--all-fields"], more].concat());
        json(&["info", &mt, "--json"])
    };
    let told = info(&["--field-bits", "8", "--field-bits", "U=10", "--field-tolerance", "p=1%"]);
    let bits: Vec<f64> = (0..4).map(|i| number(&told["fields"][i], "bits")).collect();
    assert!(bits[0] < 8.0 && bits[1..] == [10.0; 3], "{bits:?}");
    let p = &told["fields"][0];
    assert!(number(p, "quantization") <= 0.01 * (number(p, "max") - number(p, "min")));
    let told = info(&["--position-tolerance", "0.001", "--field-tolerance", "0.002"]);
    assert!(number(&told, "position_quantization") <= 0.001 && number(&told, "position_bits") < 12.0);
    // What the lattice of the positions makes of the fields is told with what their own one does.
    let loss = |told: &serde_json::Value, i: usize| number(&told["fields"][i], "quantization");
    let fine = info(&["--position-bits", "28", "--field-tolerance", "0.002"]);
    assert!((0..4).all(|i| loss(&fine, i) <= 0.002), "{fine}");
    assert!((0..4).all(|i| loss(&told, i) >= loss(&fine, i)), "{told}");
    info(&["--lossless"]);
    info(&["--lossless=U"]);
    let with = |more: &[&str]| -> Vec<String> {
        let start = ["build", &input, "-o", &mt];
        start.iter().chain(more).map(|&word| word.to_owned()).collect()
    };
    for (code, more, word) in [
        (2, &["--position-bits", "9", "--position-tolerance", "1"][..], "cannot be used with"),
        (2, &["--field-bits", "8", "--field-tolerance", "1%"], "give one of them"),
        (2, &["--field-bits", "25"], "1 to 24"),
        (2, &["--field-tolerance", "-1"], "-1"),
        (2, &["--field-tolerance", "x%"], "percentage"),
        (1, &["--position-bits", "1"], "position bits"),
        (1, &["--field-tolerance", "1e-15"], "--lossless"),
        (1, &["--lossless=q"], "'q'"),
        (1, &["--field-bits", "q=8"], "'q'"),
    ] {
        let arguments = with(more);
        let output = run(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{more:?}: {error}");
        assert!(error.contains(word), "{more:?}: {error}");
    }
}

/// The same mesh without its field.
fn bare() -> String {
    TWO_CELLS.split("CELL_DATA").next().expect("what comes before").to_owned()
}

#[test]
fn a_mesh_without_a_field_is_built_for_its_shape() {
    let folder = Folder::new("shape");
    let [input, mt, out] = ["a.vtk", "a.mt", "b.vtu"].map(|name| folder.path(name));
    fs::write(&input, bare()).expect("a new file");
    bad(1, &["build", &input, "-o", &mt], &["no point field", "distance", "--field"]);
    bad(1, &["build", &input, "-o", &mt, "--field", "w"], &["'w'"]);
    for (name, range) in [("x", [0.0, 1.0]), ("z", [-3.0, 1.0]), ("none", [0.0, 0.0])] {
        good(&["build", &input, "-o", &mt, "--field", name, "--quiet"]);
        json(&["extract", &mt, "-o", &out, "--json"]);
        let field = &io::read(out.as_ref()).expect("a mesh").fields[0];
        assert_eq!(field.name, name);
        let mut values = field.values.clone();
        values.sort_by(f64::total_cmp);
        for (value, expected) in [(values[0], range[0]), (values[4], range[1])] {
            assert!((value - expected).abs() < 1e-3, "{name}: {value} instead of {expected}");
        }
        good(&["verify", &mt, "--against", &input, "--quick"]);
    }
}

#[test]
fn the_standard_input_is_read() {
    let folder = Folder::new("stdin");
    let [input, mt, same] = ["a.vtk", "a.mt", "b.mt"].map(|name| folder.path(name));
    fs::write(&input, bare()).expect("a new file");
    good(&["build", &input, "-o", &mt, "--field", "x", "--quiet"]);
    let piped = |arguments: &[&str]| {
        let file = fs::File::open(&input).expect("a file");
        command(arguments).stdin(file).output().expect("the command starts")
    };
    let built = piped(&["build", "-", "-o", &same, "--field", "x", "--quiet", "--format", "vtk"]);
    assert!(built.status.success(), "{}", text(&built.stderr));
    assert_eq!(fs::read(&mt).expect("a file"), fs::read(&same).expect("a file"));
    let refused = piped(&["build", "-", "-o", &same, "--field", "x", "--format", "gmsh"]);
    let error = text(&refused.stderr);
    assert!(!refused.status.success() && error.contains("vtk, not gmsh"), "{error}");
    let refused = piped(&["build", "-", "-o", &same, "--field", "nothing"]);
    let error = text(&refused.stderr);
    assert!(error.starts_with("error: standard input: there is no point field"), "{error}");
    let refused = piped(&["build", "-", "-o", &same, "--memory", "16"]);
    let error = text(&refused.stderr);
    assert!(error.contains("standard input: reading it takes more memory than the 16 bytes"), "{error}");
    bad(2, &["build", &input, "-o", &mt, "--format", "vtk"], &["--format", "'-'"]);
}

#[test]
fn labels_stay_labels_in_all_that_is_made_of_them() {
    let folder = Folder::new("labels");
    let [input, mt, out, points] = ["a.vtu", "a.mt", "out", "points.csv"].map(|name| folder.path(name));
    let mut mesh = step(None, 1.0);
    // Walls of 2 and of 7, and what is between them.
    let label = |tet: &[u32; 4]| match tet.iter().map(|&v| mesh.positions[v as usize][0]).sum::<f64>() {
        x if x < 1.0 => 2.0,
        x if x < 3.0 => -3.0,
        _ => 7.0,
    };
    let labels = mesh.tets.iter().map(label).collect();
    mesh.cell_fields = vec![Field { integer: true, ..Field::new("material", labels) }];
    write(&input, &mesh);
    let built = ["build", &input, "-o", &mt, "--all-fields", "--cell-to-point"];
    let told = good(&built);
    assert!(told.contains("averaged from cells  material\n") && told.contains("  another label "), "{told}");
    let info = json(&["info", &mt, "--json"]);
    let labels: Vec<_> = info["fields"].as_array().expect("fields").iter().map(|f| &f["is_label"]).collect();
    assert_eq!(labels.iter().filter(|is_label| **is_label == &serde_json::Value::Bool(true)).count(), 1);
    let shown = good(&["info", &mt]);
    assert!(shown.contains("material (label): -3 to 7") && shown.contains("  another label "), "{shown}");
    assert!(good(&["verify", &mt, "--against", &input]).contains("every promise is kept"));
    // In tables and files there is nothing between them.
    let known = |values: &[f64]| values.iter().all(|value| [2.0, -3.0, 7.0].contains(value));
    let between: Vec<String> = (1..40).map(|i| format!("{},0.31,0.77", f64::from(i) / 40.0)).collect();
    fs::write(&points, between.join("\n")).expect("a file");
    for command in [
        &["probe", &mt, "--points", &points][..],
        &["probe", &mt, "--line", "0,0,0,1,1.5,1.5"],
        &["slice", &mt, "--plane", "1,0.3,0.2,0.6"],
        &["isosurface", &mt, "--field", "p", "--iso", "0.8"],
        &["surface", &mt],
    ] {
        let out = format!("{out}.csv");
        good(&[command, &["-o", &out]].concat());
        let (names, rows) = table(&out);
        let column = names.iter().position(|name| name == "material").expect("a column");
        let values: Vec<f64> = rows.iter().map(|row| row[column]).collect();
        assert!(values.len() > 10 && known(&values), "{command:?}: {values:?}");
        assert!(values.iter().any(|value| *value != values[0]), "{command:?}");
    }
    let vtu = format!("{out}.vtu");
    good(&["extract", &mt, "-o", &vtu]);
    let extracted = io::read(vtu.as_ref()).expect("a mesh");
    let material = extracted.fields.iter().find(|field| field.name == "material").expect("a field");
    assert!(material.integer && known(&material.values));
    bad(
        1,
        &["isosurface", &mt, "--field", "material", "--iso", "1", "-o", &format!("{out}.vtp")],
        &["'material' is a label"],
    );
    // What is said goes before the rule.
    good(&[&built[..], &["--no-label", "material", "--quiet"]].concat());
    assert!(!good(&["info", &mt]).contains("(label)"));
    for (code, options, words) in [
        (2, &["--label", "material", "--no-label", "material"][..], &["'material'", "--no-label"][..]),
        (1, &["--label", "density"], &["'density'", "material"]),
        (1, &["--label", "material", "--kind", "edge"], &["'material'", "kind edge"]),
        (1, &["--label", "material", "--field-bits", "material=4"], &["'material'", "no precision"]),
        (1, &["--label", "p"], &["'p' is no label"]),
    ] {
        bad(code, &[&built[..], options].concat(), words);
    }
}
