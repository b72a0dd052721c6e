//! Promise: the command does what its help says, from data to a checked mesh, and fails with a word about which file
//! and why, leaving nothing half done.

#[cfg(unix)]
use crate::support::interrupt;
use crate::support::{Folder, bad, bucky, good, json, number, run, text};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};
use tetralod::mesh::{Field, TetMesh};

#[test]
fn what_needs_too_much_memory_is_refused_before_it_is_built() {
    let folder = Folder::new("memory");
    let [input, mt] = ["b.vti", "a.mt"].map(|name| folder.path(name));
    good(&["generate", "bucky", "--size", "9", "-o", &input]);
    // Not in parts either; and other kinds are not built in parts.
    for more in [&["--memory", "200K"][..], &["--memory", "300K", "--kind", "edge"]] {
        let limited = [&["build", &input, "-o", &mt][..], more].concat();
        bad(1, &limited, &["b.vti", "3 072 tetrahedra", "--memory allows"]);
    }
    assert!(!Path::new(&mt).exists());
    good(&["build", &input, "-o", &mt, "--memory", "8M"]);
}

/// Arrays that share their place in the file, 100 of 128³ values each, take 1.7 GB when they are read.
#[cfg(target_os = "linux")]
#[test]
fn a_small_file_takes_no_more_memory_than_there_is() {
    let folder = Folder::new("shared");
    let [input, mt] = ["shared.vti", "a.mt"].map(|name| folder.path(name));
    let (samples, extent) = (vec![0_u8; 1 << 21], "0 127 0 127 0 127");
    let array =
        |i: u32| format!("<DataArray type=\"UInt8\" Name=\"f{i}\" format=\"appended\" offset=\"0\"/>");
    let arrays: String = (0..100).map(array).collect();
    let head = format!(
        "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"> \
         <ImageData WholeExtent=\"{extent}\"><Piece Extent=\"{extent}\"><PointData>{arrays}\
         </PointData></Piece></ImageData><AppendedData encoding=\"raw\">_"
    );
    let length = (samples.len() as u64).to_le_bytes();
    fs::write(&input, [head.as_bytes(), &length, &samples, b"</AppendedData></VTKFile>"].concat())
        .expect("a file");
    // In kibibytes: programs take much address space that is no memory.
    let limited = |space: u32, more: &[&str]| {
        let script = format!("ulimit -v {space}; exec \"$@\"");
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", &script, "sh", env!("CARGO_BIN_EXE_tetralod"), "build", &input, "-o", &mt]);
        let output = shell.args(more).output().expect("the command starts");
        (output.status.code(), text(&output.stderr).to_owned())
    };
    let (code, error) = limited(1 << 20, &["--memory", "200M", "--all-fields"]);
    assert_eq!(code, Some(1), "{error}");
    assert!(error.contains("shared.vti") && error.contains("more than --memory allows (200"), "{error}");
    // Without a limit: the address space, of which half is for reading.
    let (code, error) = limited(1 << 20, &["--all-fields"]);
    assert_eq!(code, Some(1), "{error}");
    assert!(error.contains("more memory than the 512 MiB that are allowed"), "{error}");
    let (code, error) = limited(1 << 20, &["--field", "f3"]);
    assert_eq!(code, Some(1), "{error}");
    assert!(error.contains("more than there is (1.0 GiB"), "{error}");
}

#[test]
fn from_data_to_a_checked_mesh() {
    let folder = Folder::new("chain");
    for (name, size, input) in [("bucky", "9", "b.vti"), ("sphere-flow", "4", "s.vtu")] {
        let [input, mt, out] = [input, "a.mt", "out.vtu"].map(|name| folder.path(name));
        good(&["generate", name, "--size", size, "-o", &input]);
        let built = json(&["build", &input, "-o", &mt, "--json"]);

        let info = json(&["info", &mt, "--json"]);
        assert_eq!(info["kind"], "half-edge");
        let same =
            ["vertices", "tetrahedra", "base_vertices", "base_tetrahedra", "updates", "file_bytes", "depth"];
        for key in same {
            assert_eq!(info[key], built[key], "{key}");
        }
        assert_eq!(number(&info, "file_bytes"), fs::metadata(&mt).expect("it is there").len() as f64);
        assert_eq!(number(&info, "base_vertices") + number(&info, "updates"), number(&info, "vertices"));
        assert!(number(&info, "base_vertices") < number(&info, "vertices") / 4.0, "{info}");
        let memory = &info["memory"];
        let [compact, explicit] = ["compact_bytes", "explicit_bytes"].map(|key| number(memory, key));
        assert!(compact < number(memory, "indexed_bytes") && number(memory, "adjacency_bytes") < explicit);
        assert_eq!(info["bounds"].as_array().map(Vec::len), Some(6));
        for key in ["position_bits", "arcs_per_node", "tets_per_update", "bytes_per_vertex"] {
            assert!(number(&info, key) > 0.0, "{key}");
        }
        for key in ["min", "max", "bits"] {
            assert!(info["fields"][0][key].is_number());
        }
        let bench = json(&["bench", &mt, "--json"]);
        for part in ["decode", "refine", "coarsen"] {
            assert!(number(&bench[part], "updates_per_second") > 0.0, "{part}");
        }
        for part in ["refine", "isosurface"] {
            assert!(number(&bench[part], "tets_per_second") > 0.0, "{part}");
        }
        assert!(good(&["info", &mt]).contains(info["fields"][0]["name"].as_str().expect("a name")));

        let whole = json(&["extract", &mt, "-o", &out, "--json", "--measure", &input]);
        assert_eq!(whole["tetrahedra"], info["tetrahedra"]);
        assert_eq!(whole["vertices"], info["vertices"]);
        assert_eq!(whole["updates_applied"], info["updates"]);
        let range = number(&info["fields"][0], "max") - number(&info["fields"][0], "min");
        // The lattice of the field rounds, and where points of the input are not on that of the positions, that does, too.
        let most = if name == "bucky" { range / 32_768.0 } else { range / 4096.0 };
        assert!(number(&whole, "measured_error") <= most, "the lattices: {whole}");
        assert!(
            number(&whole, "measured_error") <= number(&whole, "error_bound"),
            "what it rounds off: {whole}"
        );

        let mut last = number(&whole, "tetrahedra");
        for percent in ["1%", "5%", "20%"] {
            let part = json(&["extract", &mt, "--error", percent, "-o", &out, "--json", "--measure", &input]);
            let bound: f64 = percent.trim_end_matches('%').parse::<f64>().expect("a number") / 100.0 * range;
            assert!(number(&part, "error_bound") <= bound);
            assert!(
                number(&part, "measured_error") <= number(&part, "error_bound") + range / 32_768.0,
                "{part}"
            );
            assert!(number(&part, "tetrahedra") <= last);
            last = number(&part, "tetrahedra");
            let absolute = json(&["extract", &mt, "--error", &bound.to_string(), "-o", &out, "--json"]);
            assert_eq!(absolute["hash"], part["hash"], "the same in units of the field");
        }
        assert!(last < number(&whole, "tetrahedra") / 2.0);
        let base = json(&["extract", &mt, "--error", "1e9", "-o", &out, "--json"]);
        assert_eq!((&base["tetrahedra"], &base["updates_applied"]), (&info["base_tetrahedra"], &0.into()));
        let checked = json(&["verify", &mt, "--against", &input, "--json"]);
        assert_eq!((&checked["valid"], &checked["failures"]), (&true.into(), &Value::Array(vec![])));
        assert!(number(&checked, "queries") > 5.0);
        let ratio = number(&checked, "worst_error_ratio");
        assert!(ratio > 0.5 && ratio <= 1.0, "{checked}");
        // What was written is a mesh that reads and builds again.
        let again = json(&["build", &out, "-o", &folder.path("again.mt"), "--json"]);
        assert_eq!(again["tetrahedra"], base["tetrahedra"]);
        assert_eq!(again["repaired"], "");
    }
}

#[test]
fn boxes_isovalues_and_budgets_select() {
    let folder = Folder::new("select");
    let [input, mt, out] = ["b.vti", "b.mt", "out.vtu"].map(|name| folder.path(name));
    bucky(13, &input, &mt);
    let tets = |more: &[&str]| {
        let result = json(&[&["extract", &mt, "-o", &out, "--json", "--measure", &input], more].concat());
        assert!(number(&result, "measured_error") <= number(&result, "error_bound") + 1e-4, "{result}");
        assert!(number(&result, "field_bound") >= number(&result, "error_bound"), "{result}");
        assert!(number(&result, "boundary_bound") >= 0.0, "{result}");
        number(&result, "tetrahedra")
    };
    let whole = tets(&[]);
    let corner = tets(&["--box", "0,0,0,0.3,0.3,0.3"]);
    let nothing = tets(&["--box", "-9,-9,-9,-8,-8,-8"]);
    assert!(nothing < corner && corner < whole, "{nothing} {corner} {whole}");
    let surface = tets(&["--iso", "0.5", "--error", "1%"]);
    let surfaces = tets(&["--iso", "0.5", "--iso", "0.1", "--error", "1%"]);
    let all = tets(&["--error", "1%"]);
    assert!(surface < surfaces && surfaces <= all, "{surface} {surfaces} {all}");
    // Far beyond the field even when it is widened by the largest error.
    assert_eq!(tets(&["--iso", "-1e6"]), nothing);
    let budget = tets(&["--budget", "3000"]);
    assert!(budget <= 3000.0 && budget > 1500.0, "{budget}");
    assert!(good(&["extract", &mt, "-o", &out, "--budget", "3000"]).contains("budget"));
}

/// A camera at `eye` that looks along z from below, as a file has it.
fn camera(eye: [f64; 3], viewport: [u32; 2], pixels: f64) -> Value {
    let [x, y, z] = eye;
    let matrix = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, -x, -y, -z, -z];
    serde_json::json!({ "matrix": matrix, "viewport": viewport, "pixels": pixels })
}

/// Nothing is lost without a word: kinds without regions say that there are none.
#[test]
fn files_without_the_regions_that_were_asked_for_say_so() {
    let folder = Folder::new("regions");
    let [input, mt, other] = ["t.vtu", "t.mt", "other.mt"].map(|name| folder.path(name));
    good(&["generate", "turbine", "--size", "5", "-o", &input]);
    let build = |more: &[&str]| json(&[&["build", &input, "-o", &mt, "--json"], more].concat());
    assert_eq!(build(&["--kind", "vertex", "--preserve", "part"])["regions"], 0);
    assert!(build(&[])["regions"].is_null(), "nobody asked");
    assert_eq!(build(&["--preserve", "part"])["regions"], 12);
    let convert = |kind: &str| json(&["convert", &mt, "--kind", kind, "-o", &other, "--json"]);
    assert_eq!(convert("vertex")["regions_left_out"], 12);
    assert!(convert("half-edge")["regions_left_out"].is_null());
}

/// Options for the same mesh give the same mesh; others give another one.
#[test]
fn every_part_can_be_asked_for_in_two_ways() {
    let folder = Folder::new("parts");
    let [input, mt, out, view, colours] =
        ["b.vti", "b.mt", "out.vtu", "view.json", "colours.json"].map(|name| folder.path(name));
    bucky(11, &input, &mt);
    fs::write(&view, camera([0.5, 0.5, -0.2], [800, 600], 20.0).to_string()).expect("a file");
    let points = serde_json::json!([[0.2, 0, 0, 0, 0], [0.6, 1, 0.5, 0, 0.8]]);
    let transfer =
        serde_json::json!({ "points": points, "unit_length": 0.5, "field": "density", "error": 0.02 });
    fs::write(&colours, transfer.to_string()).expect("a file");
    let extract = |more: &[&str]| json(&[&["extract", &mt, "-o", &out, "--json"], more].concat());
    let whole = extract(&[]);
    let of_view = ["--need", &format!("view={view}; pixels=20")];
    let of_colours = ["--need", &format!("transfer={colours};colour-error=2%")];
    for (plain, grouped) in [
        (&["--box", "0,0,0,0.3,0.3,0.3"][..], &["--need", "box=0,0,0,0.3,0.3,0.3"][..]),
        (
            &["--obox", "0.2,0.2,0.2,0.1,0.1,0,-0.1,0.1,0,0,0,0.1"],
            &["--need", "obox = 0.2,0.2,0.2,0.1,0.1,0,-0.1,0.1,0,0,0,0.1;"],
        ),
        (&["--sphere", "0.5,0.5,0.5,0.1"], &["--need", "sphere=0.5,0.5,0.5,0.1; error=0%"]),
        (&["--half-space", "-1,0,0,-0.9"], &["--convex", "-1,0,0,-0.9"]),
        (&["--slab", "0,0,2,1,0.05"], &["--convex", "0,0,1,0.525,0,0,-1,-0.475"]),
        (&["--iso", "0.5", "--error", "1%"], &["--need", "error=1%; range=0.5,0.5"]),
        (&["--range", "0.7,0.8", "--range", "-1,-0.5"], &["--need", "range=0.7,0.8;range=-1,-0.5"]),
        (
            &["--sphere", "0.5,0.5,0.5,0.2", "--iso", "0.5", "--error", "0.5%"],
            &["--need", "sphere=0.5,0.5,0.5,0.2;iso=0.5;error=0.5%;field=density"],
        ),
        (&["--view", &view], &of_view),
        (&["--transfer", &colours], &of_colours),
        (&["--error", "3%"], &["--outside", "3%"]),
    ] {
        let [plain_mesh, grouped_mesh] = [plain, grouped].map(extract);
        assert_eq!(plain_mesh["hash"], grouped_mesh["hash"], "{plain:?}");
        assert!(number(&plain_mesh, "tetrahedra") < number(&whole, "tetrahedra"), "{plain:?}: {plain_mesh}");
        assert!(number(&plain_mesh, "updates_applied") > 0.0, "{plain:?}: {plain_mesh}");
        assert_eq!((&plain_mesh["satisfied"], &plain_mesh["done"]), (&true.into(), &true.into()));
        let need = &plain_mesh["needs"][0];
        // What the lattices round off stays.
        assert!(number(need, "bound") <= number(need, "asked").max(1e-4), "{need}");
    }
    let asked = |mesh: &Value| mesh["needs"][0]["asked"].as_f64();
    let unit = |mesh: &Value| mesh["needs"][0]["unit"].clone();
    let seen = extract(&["--view", &view, "--pixels", "30"]);
    assert_eq!((asked(&seen), unit(&seen)), (Some(30.0), "pixels".into()));
    let shown = extract(&["--transfer", &colours]);
    assert_eq!((asked(&shown), unit(&shown)), (Some(0.02), "colour".into()));
    let matrix = camera([0.5, 0.5, -0.2], [800, 600], 20.0)["matrix"].to_string();
    let matrix = matrix.trim_matches(['[', ']']);
    let given = extract(&["--matrix", matrix, "--viewport", "800,600", "--pixels", "30"]);
    assert_eq!(given["hash"], seen["hash"]);
}

#[test]
fn several_needs_are_all_met() {
    let folder = Folder::new("union");
    let [input, mt, out, view] = ["b.vti", "b.mt", "out.vtu", "view.json"].map(|name| folder.path(name));
    bucky(13, &input, &mt);
    let extract = |more: &[&str]| {
        let result = json(&[&["extract", &mt, "-o", &out, "--json", "--measure", &input], more].concat());
        assert!(number(&result, "measured_error") <= number(&result, "error_bound") + 1e-4, "{result}");
        result
    };
    let tets = |more: &[&str]| number(&extract(more), "tetrahedra");
    let [left, right] = ["0,0,0,0.1,0.1,0.1", "0.9,0.9,0.9,1,1,1"];
    let both = extract(&["--box", left, "--box", right]);
    assert_eq!(both["needs"].as_array().map(Vec::len), Some(2));
    let [one, other] = [left, right].map(|roi| tets(&["--box", roi]));
    let all = number(&both, "tetrahedra");
    assert!(all > one && all > other && all < one + other, "{one} {other} {all}");
    let around = extract(&["--box", left, "--outside", "2%"]);
    assert!(number(&around, "tetrahedra") > one.max(tets(&["--error", "2%"])), "{around}");
    fs::write(&view, camera([0.5, 0.5, -0.2], [800, 600], 50.0).to_string()).expect("a file");
    let seen = extract(&["--view", &view, "--box", left, "--error", "1%"]);
    assert!(number(&seen, "relative_error_bound") <= 0.01, "that of the need that measures it: {seen}");
    let grouped = extract(&["--error", "2%", "--need", &format!("box={left}")]);
    assert_eq!(grouped["hash"], around["hash"], "an error without a part is one everywhere");
    let text = good(&["extract", &mt, "-o", &out, "--box", left, "--outside", "2%"]);
    assert!(text.contains("box 0,0,0") && text.contains("everywhere") && text.contains("wanted"), "{text}");
}

#[test]
fn budgets_and_steps_stop_with_a_valid_mesh() {
    let folder = Folder::new("budgets");
    let [input, mt, out, again, view] =
        ["b.vti", "b.mt", "out.vtu", "again.mt", "view.json"].map(|name| folder.path(name));
    bucky(13, &input, &mt);
    let extract = |more: &[&str]| json(&[&["extract", &mt, "-o", &out, "--json"], more].concat());
    let mut bound = f64::INFINITY;
    for most in ["800", "1200", "1600"] {
        let result = extract(&["--max-vertices", most, "--iso", "0.5"]);
        assert!(number(&result, "vertices") <= most.parse().expect("a number"), "{result}");
        assert!(number(&result, "error_bound") <= bound, "a larger budget, a larger error: {result}");
        bound = number(&result, "error_bound");
    }
    let result = extract(&["--max-bytes", "96K"]);
    let bytes = 32.0 * number(&result, "tetrahedra") + 16.0 * number(&result, "vertices");
    assert!(bytes <= 96.0 * 1024.0 && bytes > 80.0 * 1024.0, "{result}");
    assert_eq!((&result["satisfied"], &result["done"]), (&false.into(), &true.into()));
    let need = &result["needs"][0];
    assert!(number(need, "bound") > 0.0 && number(&result, "excess") > 1.0, "{result}");
    let eye = camera([0.5, 0.5, -0.2], [800, 600], 0.0);
    fs::write(&view, eye.to_string()).expect("a file");
    let seen = extract(&["--view", &view, "--budget", "3000"]);
    let need = &seen["needs"][0];
    assert!(number(need, "asked") == 0.0 && number(need, "bound") > 1.0, "pixels that are left: {seen}");
    for (stop, refined) in [(["--max-updates", "10"], 1.0), (["--max-ms", "0"], 1.0)] {
        let result = extract(&stop);
        assert_eq!((&result["satisfied"], &result["done"]), (&false.into(), &false.into()));
        assert!(number(&result, "refined") >= refined && result["error_bound"].is_null(), "{result}");
        // A mesh like any other.
        json(&["build", &out, "-o", &again, "--json"]);
    }
    let whole = extract(&["--max-ms", "1e6", "--max-updates", "1000000000"]);
    assert_eq!(whole["hash"], extract(&[])["hash"]);
    let text = good(&["extract", &mt, "-o", &out, "--max-updates", "10"]);
    assert!(text.contains("stopped before") && text.contains("not known yet"), "{text}");
}

#[test]
fn nonsense_in_a_query_is_refused() {
    let folder = Folder::new("nonsense");
    let [input, mt, out, view, text] =
        ["b.vti", "b.mt", "out.vtu", "view.json", "text"].map(|name| folder.path(name));
    bucky(7, &input, &mt);
    fs::write(&view, "{\"matrix\": [1, 2], \"viewport\": [1, 1]}").expect("a file");
    fs::write(&text, "{\"points\": [[0, 0, 0, 0, 2]]}").expect("a file");
    for (options, words) in [
        (&["--sphere", "1,2,3"][..], &["--sphere", "4 numbers"][..]),
        (&["--sphere", "1,2,3,-1"], &["radius"]),
        (&["--obox", "0,0,0,1,0,0,1,1,0,0,0,1"], &["right angles"]),
        (&["--slab", "0,0,0,1,1"], &["normal"]),
        (&["--half-space", "0,0,0,1"], &["normal"]),
        (&["--convex", "1,0,0"], &["4 numbers"]),
        (&["--range", "2,1"], &["smaller"]),
        (&["--iso", "nan"], &["nan"]),
        (&["--need", "ball=1"], &["ball", "sphere"]),
        (&["--need", "box"], &["key=value"]),
        (&["--need", "error=1;error=2"], &["twice"]),
        (&["--pixels", "2"], &["view"]),
        (&["--colour-error", "2%"], &["transfer"]),
        (&["--matrix", "1,2"], &["16 numbers"]),
        (&["--matrix", "1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1"], &["--viewport"]),
        (&["--viewport", "1,1"], &["--matrix"]),
        (&["--view", &view, "--error", "1%"], &["--outside"]),
        (&["--max-bytes", "12X"], &["'X'", "K, M and G"]),
        (&["--max-ms=-1"], &["negative"]),
        (&["--budget=-1"], &["--budget"]),
    ] {
        bad(2, &[&["extract", &mt, "-o", &out], options].concat(), words);
    }
    for (options, words) in [
        (&["--view", &view][..], &[&view[..], "16"][..]),
        (&["--view", "none.json"], &["none.json", "No such file"]),
        (&["--transfer", &text], &[&mt, "need number 0", "0 and 1"]),
        (&["--need", "iso=1;field=nothing"], &[&mt, "'nothing'", "density"]),
    ] {
        bad(1, &[&["extract", &mt, "-o", &out], options].concat(), words);
    }
    assert!(!fs::exists(&out).expect("a folder"));
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let folder = Folder::new("same");
    let [input, first, second, out] = ["b.vti", "1.mt", "2.mt", "o.vtu"].map(|name| folder.path(name));
    good(&["generate", "bucky", "--size", "9", "-o", &input]);
    let data = fs::read(&input).expect("it is there");
    good(&["generate", "bucky", "--size", "9", "-o", &input]);
    assert!(data == fs::read(&input).expect("it is there"));
    good(&["build", &input, "-o", &first]);
    // Over an older file, too.
    fs::write(&second, "old").expect("a file");
    good(&["build", &input, "-o", &second]);
    assert!(fs::read(&first).expect("it is there") == fs::read(&second).expect("it is there"));
    let hash = |mt: &str| json(&["extract", mt, "--error", "2%", "-o", &out, "--json"])["hash"].clone();
    assert_eq!(hash(&first), hash(&second));
    assert_eq!(folder.names(), ["1.mt", "2.mt", "b.vti", "o.vtu"], "no partial file stays");
}

#[test]
fn kinds_are_built_and_converted() {
    let folder = Folder::new("kinds");
    let [input, edge, half_edge, vertex, other, out] =
        ["b.vti", "e.mt", "h.mt", "v.mt", "o.mt", "o.vtu"].map(|name| folder.path(name));
    good(&["generate", "bucky", "--size", "9", "-o", &input]);
    // What is not named goes with what is.
    for (options, kind, method, criterion) in [
        (&[][..], "half-edge", "decimate", Some("half-edge")),
        (&["--method", "decimate"], "half-edge", "decimate", Some("half-edge")),
        (&["--tet-errors"], "vertex", "insert", Some("delaunay")),
        (&["--for", "regions"], "half-edge", "decimate", Some("half-edge")),
        (&["--method", "insert"], "vertex", "insert", Some("delaunay")),
        (&["--criterion", "delaunay"], "vertex", "decimate", Some("delaunay")),
        (&["--method", "collapse"], "edge", "collapse", None),
    ] {
        let built = json(&[&["build", &input, "-o", &edge, "--json"], options].concat());
        let told = ["kind", "method", "criterion"].map(|key| built.get(key).and_then(Value::as_str));
        assert_eq!(told, [Some(kind), Some(method), criterion], "{options:?}");
    }
    let named = ["build", &input, "--kind", "edge", "--method", "collapse", "-o", &other, "--quiet"];
    assert!(good(&named).is_empty());
    let bytes = |path: &str| fs::read(path).expect("it is there");
    assert!(bytes(&edge) == bytes(&other));

    // Both are made of insertions.
    good(&["build", &input, "-o", &half_edge, "--quiet"]);
    let report = json(&["convert", &half_edge, "--kind", "vertex", "-o", &vertex, "--json"]);
    assert_eq!((&report["kind"], &report["from"]), (&"vertex".into(), &"half-edge".into()));
    let info = json(&["info", &vertex, "--json"]);
    assert_eq!((&info["kind"], &info["metadata"]["method"]), (&"vertex".into(), &"decimate".into()));
    assert_eq!(info["memory"]["compact_bytes"], report["memory_bytes"]);
    for key in ["vertices", "tetrahedra", "updates", "file_bytes", "bytes_per_vertex"] {
        assert_eq!(info[key], report[key], "{key}");
    }
    let before = json(&["info", &half_edge, "--json"]);
    for key in ["bounds", "depth", "arcs_per_node", "tets_per_update", "base_tetrahedra", "metadata"] {
        assert_eq!(info[key], before[key], "{key}");
    }
    for key in ["name", "min", "max", "bits", "quantization", "floor", "histogram"] {
        assert_eq!(info["fields"][0][key], before["fields"][0][key], "{key}");
    }
    assert!(good(&["info", &edge]).contains("edge collapse"));
    assert!(good(&["info", &vertex]).contains("vertex insertion"));
    let hash = |mt: &str| json(&["extract", mt, "--error", "2%", "-o", &out, "--json"])["hash"].clone();
    assert_eq!(hash(&half_edge), hash(&vertex));
    assert!(good(&["verify", &vertex, "--against", &input]).contains("every promise is kept"));
    json(&["bench", &vertex, "--json"]);

    let back = good(&["convert", &vertex, "--kind", "half-edge", "-o", &other]);
    assert!(back.contains("half-edge, was vertex"), "{back}");
    assert!(bytes(&half_edge) == bytes(&other), "there and back");
    good(&["convert", &edge, "--kind", "edge", "-o", &other, "--quiet"]);
    assert!(bytes(&edge) == bytes(&other), "nothing to do");
    let before = folder.names();
    bad(
        1,
        &["convert", &edge, "--kind", "vertex", "-o", &folder.path("none.mt")],
        &[&edge, "kind edge", "--kind vertex", "build"],
    );
    bad(
        1,
        &["convert", &input, "--kind", "edge", "-o", &folder.path("none.mt")],
        &[&input, "not an MT file"],
    );
    assert_eq!(folder.names(), before);
}

/// Points that look random, in a ball, with a smooth field.
fn ball(count: usize) -> TetMesh {
    let mut state = 11_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / f64::from(1 << 23) - 1.0
    };
    let mut positions: Vec<[f64; 3]> = Vec::new();
    while positions.len() < count {
        let p = [next(), next(), next()];
        if p.iter().map(|x| x * x).sum::<f64>() < 1.0 {
            positions.push(p);
        }
    }
    let values = positions.iter().map(|[x, y, z]| x * y + 1.0 / (0.2 + z * z)).collect();
    TetMesh { positions, fields: vec![Field::new("hill", values)], ..TetMesh::default() }
}

/// A legacy file of the points alone, with the cells that `cells` writes.
fn legacy_points(mesh: &TetMesh, data_set: &str, cells: &str) -> String {
    let count = mesh.positions.len();
    let lines = |numbers: &[f64]| numbers.iter().map(|x| format!("{x:?}\n")).collect::<String>();
    format!(
        "# vtk DataFile Version 3.0\npoints\nASCII\nDATASET {data_set}\nPOINTS {count} double\n{}{cells}\
         POINT_DATA {count}\nSCALARS hill double\nLOOKUP_TABLE default\n{}",
        lines(mesh.positions.as_flattened()),
        lines(&mesh.fields[0].values)
    )
}

#[test]
fn points_alone_are_inserted() {
    let folder = Folder::new("points");
    let [xml, vertices, poly, mt, other, out] =
        ["p.vtu", "v.vtk", "p.vtk", "p.mt", "o.mt", "o.vtu"].map(|name| folder.path(name));
    let ball = ball(700);
    tetralod_io::write_vtu(&ball, &mut fs::File::create(&xml).expect("a file")).expect("it is written");
    let all: String = (0..700).map(|i| format!(" {i}")).collect();
    let one: String = (0..700).map(|i| format!("1 {i}\n")).collect();
    let cells = format!("CELLS 700 1400\n{one}CELL_TYPES 700\n{}", "1\n".repeat(700));
    fs::write(&vertices, legacy_points(&ball, "UNSTRUCTURED_GRID", &cells)).expect("a file");
    let cells = format!("VERTICES 1 701\n700{all}\n");
    fs::write(&poly, legacy_points(&ball, "POLYDATA", &cells)).expect("a file");

    let insert = ["--kind", "vertex", "--method", "insert", "--quiet", "-o"];
    good(&[&["build", &xml], &insert[..], &[&mt]].concat());
    for input in [&vertices, &poly] {
        good(&[&["build", input], &insert[..], &[&other]].concat());
        assert!(fs::read(&mt).expect("an MT") == fs::read(&other).expect("an MT"), "{input}");
    }
    assert_eq!(number(&json(&["info", &mt, "--json"]), "vertices"), 700.0);
    assert!(good(&["verify", &mt, "--against", &xml]).contains("every promise is kept"));
    let part = json(&["extract", &mt, "--error", "5%", "-o", &out, "--json", "--measure", &xml]);
    assert!(number(&part, "measured_error") <= number(&part, "error_bound"), "{part}");

    let before = folder.names();
    for method in [&["--kind", "edge"][..], &["--kind", "vertex"]] {
        let arguments = [&["build", &xml, "-o", &other], method].concat();
        bad(1, &arguments, &[&xml, "points", "--method insert"]);
    }
    assert_eq!(folder.names(), before);
}

#[test]
fn insertion_refuses_what_it_would_fill_up() {
    let folder = Folder::new("hollow");
    let [input, mt] = ["s.vtu", "s.mt"].map(|name| folder.path(name));
    good(&["generate", "sphere-flow", "--size", "4", "-o", &input]);
    let arguments = ["build", &input, "--kind", "vertex", "--method", "insert", "-o", &mt];
    bad(1, &arguments, &[&input, "convex hull", "--method decimate"]);
    assert_eq!(folder.names(), ["s.vtu"]);
}

#[test]
fn an_mt_is_built_for_a_purpose() {
    let folder = Folder::new("purpose");
    let [input, mt] = ["b.vti", "b.mt"].map(|name| folder.path(name));
    good(&["generate", "bucky", "--size", "7", "-o", &input]);
    for criterion in ["half-edge", "delaunay"] {
        for purpose in ["uniform", "regions"] {
            let options = ["--kind", "vertex", "--criterion", criterion, "--for", purpose, "--quiet"];
            good(&[&["build", &input, "-o", &mt], &options[..]].concat());
            assert!(good(&["verify", &mt, "--against", &input]).contains("every promise is kept"));
        }
    }
}

#[test]
fn kinds_methods_and_criteria_that_do_not_go_together_are_refused() {
    for (options, words) in [
        (
            &["--kind", "edge", "--method", "insert"][..],
            &["kind edge", "method insert", "collapse", "kind vertex"][..],
        ),
        (&["--kind", "edge", "--method", "decimate"], &["kind edge", "method decimate", "collapse"]),
        (&["--kind", "vertex", "--method", "collapse"], &["kind vertex", "insert and decimate"]),
        (&["--kind", "vertex", "--method", "insert", "--criterion", "half-edge"], &["delaunay", "decimate"]),
        (&["--method", "collapse", "--criterion", "delaunay"], &["--method insert or decimate"]),
        (&["--kind", "edge", "--criterion", "half-edge"], &["--method insert or decimate"]),
        (&["--kind", "explicit"], &["explicit", "half-edge, edge, vertex"]),
        (&["--kind", "face"], &["face", "half-edge, edge, vertex"]),
        (&["--method", "guess"], &["guess", "collapse, insert, decimate"]),
        (&["--criterion", "none"], &["none", "delaunay, half-edge"]),
        (&["--kind", "vertex", "--for", "all"], &["all", "uniform, regions"]),
        (&["--kind", "edge", "--for", "regions"], &["--for", "--method decimate"]),
        (&["--kind", "vertex", "--method", "insert", "--for", "regions"], &["--for", "--method decimate"]),
    ] {
        let arguments = [&["build", "a.vtu", "-o", "b.mt"], options].concat();
        bad(2, &arguments, words);
        bad(2, &arguments, &["--help"]);
    }
    bad(2, &["convert", "a.mt", "-o", "b.mt"], &["--kind"]);
}

#[test]
fn failures_name_the_file_and_leave_nothing() {
    let folder = Folder::new("failures");
    let [input, mt, none, text, cut, damaged, out] =
        ["b.vti", "b.mt", "none", "text", "cut.mt", "damaged.mt", "out"].map(|name| folder.path(name));
    bucky(7, &input, &mt);
    fs::write(&text, "<!DOCTYPE html>\n<title>404</title>").expect("a file");
    let mut bytes = fs::read(&mt).expect("it is there");
    fs::write(&cut, &bytes[..bytes.len() * 2 / 3]).expect("a file");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&damaged, &bytes).expect("a file");
    let before = folder.names();

    let away = folder.path("no folder/out.vtu");
    for (file, words) in [
        (&none, "No such file"),
        (&text, "not an MT file"),
        (&cut, "cut off"),
        (&damaged, "damaged at byte"),
        (&input, "not an MT file"),
    ] {
        bad(1, &["info", file], &[file, words]);
        bad(1, &["info", file, "--json"], &[file, words]);
        bad(1, &["extract", file, "-o", &out], &[file, words]);
        bad(1, &["bench", file], &[file, words]);
        bad(1, &["verify", file, "--against", &input], &[file, words]);
    }
    for file in [&none, &text, &mt] {
        bad(1, &["build", file, "-o", &out], &[file]);
        bad(1, &["extract", &mt, "-o", &out, "--measure", file], &[file]);
        bad(1, &["verify", &mt, "--against", file], &[file]);
    }
    bad(1, &["build", &input, "-o", &out, "--field", "nothing"], &[&input, "'nothing'", "density"]);
    bad(1, &["build", &input, "-o", &away], &[&away]);
    bad(1, &["extract", &mt, "-o", &away], &[&away]);
    bad(1, &["extract", &mt, "-o", &out, "--field", "nothing"], &[&mt, "'nothing'", "density"]);
    bad(1, &["generate", "bucky", "--size", "7", "-o", &away], &[&away, "vtu"]);
    bad(1, &["generate", "bucky", "--size", "1", "-o", &folder.path("x.vti")], &["bucky", "2"]);
    bad(1, &["generate", "sphere-flow", "--size", "4", "-o", &folder.path("x.vti")], &["x.vti", "vtu"]);
    assert_eq!(folder.names(), before);
}

#[test]
fn a_broken_promise_is_told_by_the_exit_code() {
    let folder = Folder::new("broken");
    let [input, other, mt] = ["b.vti", "other.vti", "b.mt"].map(|name| folder.path(name));
    good(&["generate", "bucky", "--size", "7", "-o", &input]);
    good(&["generate", "bucky", "--size", "8", "-o", &other]);
    good(&["build", &input, "-o", &mt, "--quiet"]);
    assert!(good(&["verify", &mt, "--against", &input]).contains("every promise is kept"));
    for arguments in
        [&["verify", &mt, "--against", &other, "--json"][..], &["verify", &mt, "--against", &other]]
    {
        let output = run(arguments);
        assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
        assert!(output.stderr.is_empty(), "the check was done: {}", text(&output.stderr));
        let stdout = text(&output.stdout);
        if arguments.contains(&"--json") {
            let report: Value = serde_json::from_str(stdout).expect("one JSON value");
            assert_eq!(report["valid"], false);
            assert!(report["failures"].as_array().is_some_and(|failures| !failures.is_empty()), "{report}");
        } else {
            assert!(stdout.contains("broken"), "{stdout}");
        }
    }
}

#[test]
fn bytes_are_counted_once_and_reports_are_quiet() {
    let folder = Folder::new("counted");
    let [input, mt, mesh] = ["b.vti", "b.mt", "b.vtu"].map(|name| folder.path(name));
    good(&["generate", "bucky", "--size", "9", "-o", &input]);
    for options in [&["--lossless"][..], &["--kind", "edge", "--lossless"], &[]] {
        let build = [&["build", &input, "-o", &mt, "--json", "--quiet"], options].concat();
        let file_bytes = json(&build)["file_bytes"].as_u64().expect("a size");
        for error in ["0", "1%", "20%"] {
            let report = json(&["extract", &mt, "--error", error, "-o", &mesh, "--json"]);
            let read = report["bytes_read"].as_u64().expect("a count");
            assert!(0 < read && read <= file_bytes, "{options:?} {error}: {read} of {file_bytes}");
        }
    }
}

#[test]
fn what_a_reader_leaves_out_is_said() {
    let folder = Folder::new("notes");
    let [input, mt] = ["a.nrrd", "a.mt"].map(|name| folder.path(name));
    let header =
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nold min: -1\nold max: 3\n\n";
    fs::write(&input, [header.as_bytes(), b"ABCDEFGH"].concat()).expect("a file");
    let output = run(&["build", &input, "-o", &mt, "--quiet"]);
    let said = text(&output.stderr);
    assert!(
        output.status.success() && said.contains("note: ") && said.contains("quantized from -1 to 3"),
        "{said}"
    );
    let report = json(&["build", &input, "-o", &mt, "--json"]);
    let notes = report["notes"].as_array().expect("a list");
    assert!(notes.len() == 1 && said.contains(notes[0].as_str().expect("words")), "{report}");
}

#[test]
fn inputs_are_never_replaced() {
    let folder = Folder::new("replaced");
    let [input, mt, table] = ["in.vti", "m.mt", "points.csv"].map(|name| folder.path(name));
    bucky(7, &input, &mt);
    fs::write(&table, "0.5,0.5,0.5\n").expect("a file");
    fs::create_dir(folder.path("sub")).expect("a folder");
    let roundabout = folder.path("sub/../m.mt");
    let [mesh, linked] = ["mesh.vtu", "linked.mt"].map(|name| folder.path(name));
    good(&["extract", &mt, "-o", &mesh]);
    #[cfg(unix)]
    std::os::unix::fs::symlink(&mt, &linked).expect("a link");
    // A file of samples that is called as one in a folder of parts.
    let [places, plan, samples] = ["places.txt", "plan.json", "plan.raw"].map(|name| folder.path(name));
    fs::write(&places, "0 0 0\n").expect("a file");
    fs::write(&plan, "{\"dims\": [4, 4, 4], \"type\": \"uint8\"}").expect("a file");
    fs::write(&samples, "ABCDEFGH".repeat(8)).expect("a file");
    let read =
        || [&input, &mt, &table, &mesh, &places, &plan].map(|path| fs::read(path).expect("it is there"));
    let before = read();
    let renamed = folder.path("m.vtu");
    fs::copy(&mt, &renamed).expect("a copy");
    // What is read with an input is one, too.
    let [list, medit, solution] = ["list.pvd", "a.mesh", "a.sol"].map(|name| folder.path(name));
    fs::write(&list, "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"0\" file=\"mesh.vtu\"/></Collection></VTKFile>")
        .expect("a file");
    let head = "MeshVersionFormatted 2\nDimension 3\n";
    let vertices = "Vertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n";
    fs::write(&medit, format!("{head}{vertices}Tetrahedra 1\n1 2 3 4 0\nEnd\n")).expect("a file");
    fs::write(&solution, format!("{head}SolAtVertices 4\n1 1\n0 1 2 3\nEnd\n")).expect("a file");
    for arguments in [
        &["convert", &mt, "-o", &mt, "--kind", "vertex"][..],
        &["convert", &mt, "-o", &roundabout, "--kind", "vertex"],
        &["convert", &roundabout, "-o", &mt, "--kind", "vertex"],
        #[cfg(unix)]
        &["convert", &mt, "-o", &linked, "--kind", "vertex"],
        &["extract", &mt, "-o", &mesh, "--measure", &mesh],
        &["extract", &renamed, "-o", &renamed],
        &["extract", &mt, "-o", &mesh, "--measure", &list],
        &["build", &medit, "-o", &solution],
        &["build", &input, "--keep-points", &places, "-o", &places],
        &["part", &plan, "--parts", "2", "-o", &folder.path(".")],
        &["probe", &mt, "--points", &table, "-o", &table],
        &["stats", &mt, "--reference", &table, "-o", &table],
    ] {
        bad(1, arguments, &["is an input, too", "another file"]);
    }
    assert_eq!(read(), before);
}

#[test]
fn inputs_that_others_name_are_never_replaced() {
    let folder = Folder::new("replaced-named");
    let [input, mt, list, sub] = ["in.vti", "m.mt", "list.pvd", "sub"].map(|name| folder.path(name));
    bucky(7, &input, &mt);
    fs::create_dir(sub).expect("a folder");
    let [mesh, pieces] = ["sub/mesh.vtu", "sub/all.pvtu"].map(|name| folder.path(name));
    good(&["extract", &mt, "-o", &mesh]);
    let collection = |file: &str| {
        format!(
            "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"0\" file=\"{file}\"/></Collection></VTKFile>"
        )
    };
    let grid = |file: &str| {
        let data = "<PPoints><PDataArray type=\"Float64\" NumberOfComponents=\"3\"/></PPoints><PPointData>\
                    <PDataArray type=\"Float64\" Name=\"density\"/></PPointData>";
        let pieces = format!(
            "<PUnstructuredGrid GhostLevel=\"0\">{data}<Piece Source=\"{file}\"/></PUnstructuredGrid>"
        );
        format!("<VTKFile type=\"PUnstructuredGrid\">{pieces}</VTKFile>")
    };
    let before = fs::read(&mesh).expect("a file");
    // By a list in a list, and under a name that only XML makes the same.
    for (listed, piece) in
        [("sub/all.pvtu", "mesh.vtu"), ("sub/all.pvtu", "&#109;esh.vtu"), ("sub/&#109;esh.vtu", "mesh.vtu")]
    {
        fs::write(&list, collection(listed)).expect("a file");
        fs::write(&pieces, grid(piece)).expect("a file");
        let arguments = ["extract", &mt, "-o", &mesh, "--error", "5%", "--measure", &list];
        bad(1, &arguments, &["is an input, too", "another file"]);
        assert_eq!(fs::read(&mesh).expect("a file"), before);
    }
    // A piece of a list that is built piece by piece.
    let piece = folder.path("sub/piece.mt");
    fs::copy(&mesh, &piece).expect("a copy");
    fs::write(&pieces, grid("&#112;iece.mt")).expect("a file");
    bad(1, &["build", &pieces, "--parts", "2", "-o", &piece], &["is an input, too", "another file"]);
    assert_eq!(fs::read(&piece).expect("a file"), before);
    // Samples of a header that lies beside them.
    let [header, samples] = ["a.nhdr", "a.mt"].map(|name| folder.path(name));
    fs::write(&samples, [7; 64]).expect("a file");
    fs::write(
        &header,
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\nencoding: raw\ndata file: LIST\n./a.mt\n",
    )
    .expect("a file");
    bad(1, &["build", &header, "-o", &samples], &["is an input, too", "another file"]);
    assert_eq!(fs::read(&samples).expect("a file"), [7; 64]);
}

#[test]
fn outputs_have_names_and_places() {
    let folder = Folder::new("places");
    let [input, mt, none, other] = ["in.vti", "m.mt", "none/m.mt", "sub"].map(|name| folder.path(name));
    bucky(7, &input, &mt);
    fs::create_dir(&other).expect("a folder");
    let [vtu, stl] = ["m.vtu", "m.stl"].map(|name| folder.path(name));
    for (arguments, words) in [
        (&["build", &input, "-o", &none][..], &["no folder", "none"][..]),
        (&["build", &input, "-o", &other], &["is a folder"]),
        (&["build", &input, "-o", &input], &[".mt", "in.vti"]),
        (&["build", &input, "-o", &vtu], &["extract", ".mt"]),
        (&["convert", &mt, "-o", &stl, "--kind", "vertex"], &["surface", ".mt"]),
        (&["extract", &mt, "-o", &stl], &["surface", ".vtu"]),
        (&["extract", &mt, "-o", "-"], &["/dev/stdout"]),
        (&["surface", &mt, "-o", &folder.path("none/a.stl")], &["no folder"]),
    ] {
        bad(1, arguments, words);
    }
    assert_eq!(folder.names(), ["in.vti", "m.mt", "sub"]);
}

#[test]
fn mistakes_are_told_once_and_by_their_name() {
    let folder = Folder::new("mistakes");
    let [input, mt, empty, out] = ["in.vti", "m.mt", "empty.mt", "out.vtu"].map(|name| folder.path(name));
    bucky(7, &input, &mt);
    fs::write(&empty, "").expect("a file");
    for arguments in [&["extract", &empty, "-o", &out][..], &["info", &empty]] {
        bad(1, arguments, &[]);
        let error = text(&run(arguments).stderr).to_owned();
        assert_eq!(error.matches("is empty").count(), 1, "{error}");
        assert!(!error.contains("can be used"), "nothing has arrived: {error}");
    }
    bad(1, &["info", "ftp://host/a.mt"], &["ftp", "http"]);
    bad(1, &["build", "https://host/a.vtu", "-o", &mt], &["https", "fetch"]);
    for (arguments, words) in [
        (&["extract", &mt, "-o", &out, "--need", ""][..], &["says nothing"][..]),
        (&["extract", &mt, "-o", &out, "--need", " ; "], &["says nothing"]),
        (&["extract", &mt, "-o", &out, "--budget", "-5"], &["'-5'", "whole number"]),
        (&["extract", &mt, "-o", &out, "--max-bytes", "-5"], &["-5"]),
        (&["build", &input, "-o", &mt, "--method", "collapse", "--for", "regions"], &["--for", "build"]),
    ] {
        bad(2, arguments, words);
        assert!(!text(&run(arguments).stderr).contains("-- -5"), "that tip does not help");
    }
    // The server's error, with what is behind it, once.
    let output = run(&["extract", "http://127.0.0.1:1/a.mt", "-o", &out]);
    assert_eq!(text(&output.stderr).matches("cannot be reached").count(), 1, "{}", text(&output.stderr));
}

#[test]
fn requests_that_meet_nothing_get_a_warning() {
    let folder = Folder::new("nothing");
    let [input, mt, out] = ["in.vti", "m.mt", "out.vtu"].map(|name| folder.path(name));
    bucky(9, &input, &mt);
    let warnings = |more: &[&str]| {
        let output = run(&[&["extract", &mt, "-o", &out], more].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stderr).matches("warning: ").count()
    };
    let far = "90,90,90,91,91,91";
    for (more, expected) in [
        (&["--iso", "99"][..], 1),
        (&["--iso", "99", "--iso", "0.1"], 0),
        (&["--range", "-9,-8"], 1),
        (&["--box", far], 1),
        (&["--box", far, "--sphere", "90,0,0,1"], 2),
        (&["--half-space", "1,0,0,-90"], 1),
        (&["--half-space", "-1,0,0,90"], 0),
        (&["--slab", "0,0,2,180,1"], 1),
        (&["--slab", "0,0,2,0,1"], 0),
        (&["--obox", "90,0,0,1,0,0,0,1,0,0,0,1"], 1),
        (&["--obox", "0,0,0,1,0,0,0,1,0,0,0,1"], 0),
        (&["--convex", "1,0,0,90,0,1,0,-90"], 1),
        (&["--convex", "1,0,0,90,0,1,0,90"], 0),
        (&["--need", "iso=99; error=1%", "--outside", "5%"], 1),
        (&["--error", "1%"], 0),
    ] {
        assert_eq!(warnings(more), expected, "{more:?}");
    }
}

#[test]
fn measuring_against_another_mesh_fails() {
    let folder = Folder::new("another");
    let [input, other, mt, out] = ["in.vti", "other.vtu", "m.mt", "out.vtu"].map(|name| folder.path(name));
    good(&["generate", "bucky", "--size", "9", "-o", &input]);
    let mut mesh = tetralod_io::read(Path::new(&input)).expect("a mesh");
    mesh.fields[0].values.iter_mut().for_each(|value| *value = 1.0 - *value);
    let mut file = fs::File::create(&other).expect("a file");
    tetralod_io::write_vtu(&mesh, &mut file).expect("it is written");
    drop(file);
    good(&["build", &input, "-o", &mt, "--quiet"]);
    for error in ["0", "1%", "20%"] {
        good(&["extract", &mt, "-o", &out, "--error", error, "--measure", &input]);
        let output = run(&["extract", &mt, "-o", &out, "--error", error, "--measure", &other]);
        assert_eq!(output.status.code(), Some(1));
        let told = text(&output.stderr);
        assert!(told.contains("is not what the MT was built from"), "{told}");
    }
}

#[test]
fn wrong_usage_is_told_apart() {
    for arguments in [
        &["extract", "a.mt"][..],
        &["extract", "a.mt", "-o", "b", "--error", "-1"],
        &["extract", "a.mt", "-o", "b", "--error", "much"],
        &["extract", "a.mt", "-o", "b", "--error", "NaN%"],
        &["extract", "a.mt", "-o", "b", "--box", "0,0,0,1,1"],
        &["extract", "a.mt", "-o", "b", "--box", "0,0,0,1,1,-1"],
        &["extract", "a.mt", "-o", "b", "--iso", "inf"],
        &["build", "a.vtu"],
        &["verify", "a.mt"],
        &["build", "a.vtu", "-o", "b", "--position-bits", "31"],
        &["generate", "nothing", "--size", "3", "-o", "b.vtu"],
        &["dance"],
    ] {
        bad(2, arguments, &["--help"]);
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_what_was_there() {
    let folder = Folder::new("interrupt");
    let out = folder.path("big.vtu");
    fs::write(&out, "old").expect("a file");
    let writing = || folder.names().iter().any(|name| name.ends_with(".partial"));
    let code = interrupt(&["generate", "bucky", "--size", "64", "-o", &out], writing);
    assert_eq!(code, Some(130));
    // The same while a grid is written layer by layer.
    let code = interrupt(&["generate", "bucky", "--size", "200", "-o", &folder.path("big.vti")], writing);
    assert_eq!(code, Some(130));
    // Nor are there some of the time steps.
    let begun = || folder.names().iter().any(|name| name.starts_with(".tetralod-") || name == "v-0.vti");
    let steps = folder.path("v.pvd");
    let code = interrupt(&["generate", "abc-flow", "--size", "99", "--steps", "9", "-o", &steps], begun);
    assert_eq!(code, Some(130));
    assert_eq!(folder.names(), ["big.vtu"]);
    assert_eq!(fs::read(&out).expect("it is there"), b"old");

    let input = folder.path("b.vti");
    good(&["generate", "bucky", "--size", "48", "-o", &input]);
    let start = Instant::now();
    let mt = folder.path("b.mt");
    fs::write(&mt, "old").expect("a file");
    let code = interrupt(&["build", &input, "-o", &mt], || start.elapsed() > Duration::from_millis(700));
    assert_eq!(code, Some(130));
    assert_eq!(folder.names(), ["b.mt", "b.vti", "big.vtu"]);
    assert_eq!(fs::read(Path::new(&mt)).expect("it is there"), b"old");
}

#[test]
fn shells_get_completions_and_manual_pages() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = good(&["completions", shell]);
        assert!(
            ["cell-to-point", "streamlines", "no-browser"].iter().all(|word| script.contains(word)),
            "{shell}"
        );
    }
    let folder = Folder::new("manual");
    good(&["completions", "--man", &folder.path("")]);
    let names = folder.names();
    for name in ["tetralod.1", "tetralod-build.1", "tetralod-view.1"] {
        assert!(names.iter().any(|found| found == name), "{names:?}");
    }
    let page = std::fs::read_to_string(folder.path("tetralod-view.1")).expect("a page");
    assert!(page.starts_with(".ie") && page.contains("Shows volumes in the browser"), "{page}");
    bad(2, &["completions"], &["SHELL"]);
    bad(1, &["completions", "--man", &folder.path("none")], &["none"]);
}
