//! Promises of `part`, `build --part`, `join`, `build --parts` and `build --memory`: one file, whoever builds the parts and in whatever
//! order; what is missing is named with the command that makes it.

#[cfg(unix)]
use crate::support::interrupt;
use crate::support::{Folder, bad, good, json, run, text};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use tetralod::mesh::{Field, TetMesh};
use tetralod_io as io;

/// `generate`d samples, one value each.
fn generate(folder: &Folder, size: &str) -> String {
    let input = folder.path(&format!("b{size}.vti"));
    good(&["generate", "bucky", "--size", size, "-o", &input]);
    input
}

#[test]
fn parts_make_the_file_that_one_process_makes() {
    let folder = Folder::new("parts");
    let input = generate(&folder, "25");
    let [dir, mt, once] = ["dir", "joined.mt", "once.mt"].map(|name| folder.path(name));
    let plan = json(&["part", &input, "--parts", "16", "-o", &dir, "--meta", "who=me", "--json"]);
    assert_eq!((&plan["parts"], &plan["levels"]), (&16.into(), &serde_json::json!([16, 8, 2, 1])));
    let written: serde_json::Value =
        serde_json::from_slice(&fs::read(format!("{dir}/plan.json")).expect("a plan")).expect("JSON");
    assert_eq!((&written["levels"], &written["tetrahedra"]), (&plan["levels"], &(6 * 24 * 24 * 24).into()));
    // The last one first, and one twice, as after a crash.
    for index in [15, 3, 0, 3, 1, 2, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14] {
        let step = json(&["build", &dir, "--part", &format!("{index}/16"), "--json"]);
        assert!(step["left"].as_u64() < step["tetrahedra"].as_u64(), "{step}");
    }
    // What is missing is named, with the command that makes it.
    bad(1, &["join", &dir, "-o", &mt], &["built-3-0.part", "`tetralod join --node 3/0`"]);
    bad(1, &["join", &dir, "--node", "1/8"], &["no part 8 at level 1"]);
    bad(1, &["join", &dir, "--node", "4/0"], &["no part 0 at level 4"]);
    bad(1, &["join", &dir, "--node", "0/0"], &["`tetralod build --part`"]);
    for (level, nodes) in [(1, 8), (2, 2), (3, 1)] {
        (0..nodes).rev().for_each(|node| drop(good(&["join", &dir, "--node", &format!("{level}/{node}")])));
    }
    // All that is in the folder is read, and stays.
    bad(1, &["join", &dir, "-o", &format!("{dir}/built-3-0.part")], &["is an input, too", "another file"]);
    let joined = json(&["join", &dir, "-o", &mt, "--json", "--quiet"]);
    let built = json(&["build", &input, "--parts", "16", "--meta", "who=me", "-o", &once, "--json"]);
    for count in ["vertices", "tetrahedra", "base_vertices", "updates", "depth", "file_bytes"] {
        assert_eq!(joined[count], built[count], "{count}");
    }
    let bytes = |path: &str| fs::read(path).expect("a file");
    assert!(bytes(&mt) == bytes(&once), "one process writes the same file");
    good(&["build", &input, "--parts", "16", "--threads", "1", "--meta", "who=me", "-o", &once]);
    assert!(bytes(&mt) == bytes(&once), "on one thread, too");
    assert_eq!(folder.names(), ["b25.vti", "dir", "joined.mt", "once.mt"], "nothing else is left");
    assert_eq!(json(&["info", &mt, "--json"])["metadata"]["who"], "me");
    assert_eq!(json(&["verify", &mt, "--against", &input, "--json"])["valid"], true);

    // One part is the whole.
    let whole = folder.path("whole.mt");
    good(&["build", &input, "-o", &whole]);
    good(&["build", &input, "--parts", "1", "-o", &once]);
    assert!(bytes(&whole) == bytes(&once));
}

#[test]
fn what_does_not_fit_the_memory_is_built_in_parts() {
    let folder = Folder::new("parts-memory");
    let input = generate(&folder, "33");
    let mt = folder.path("b.mt");
    let [all, most] = [200, 110].map(|bytes: u64| (bytes * 6 * 32 * 32 * 32).to_string());
    let said = |memory: &str| {
        let output = run(&["build", &input, "-o", &mt, "--memory", memory]);
        assert!(output.status.success());
        text(&output.stderr).to_owned()
    };
    assert_eq!(said(&all), "");
    assert!(said(&most).contains("so it is built in"));
    assert_eq!(folder.names(), ["b.mt", "b33.vti"]);
    assert_eq!(json(&["verify", &mt, "--against", &input, "--quick", "--json"])["valid"], true);
    // Other kinds are not built in parts, and some memory is needed in any case.
    bad(
        1,
        &["build", &input, "-o", &mt, "--memory", &most, "--kind", "edge"],
        &["only kind half-edge is built in parts, more than --memory allows"],
    );
    bad(1, &["build", &input, "-o", &mt, "--memory", "1M"], &["in parts about", "more than --memory allows"]);
}

#[test]
fn steps_on_other_files_are_refused() {
    let folder = Folder::new("parts-wrong");
    let input = generate(&folder, "9");
    let [dir, mt] = ["dir", "b.mt"].map(|name| folder.path(name));
    let told = |code: i32, arguments: &[&str], more: &[&str], word: &str| {
        bad(code, &[arguments, more].concat(), &[word]);
    };
    told(1, &["part", &input, "-o", &dir], &["--parts", "3"], "power of two");
    told(1, &["part", &input, "-o", &dir], &["--parts", "4096"], "fewer");
    told(1, &["part", &input, "-o", &dir, "--parts", "2"], &["--kind", "edge"], "half-edge");
    good(&["part", &input, "--parts", "2", "-o", &dir]);
    told(2, &["build", &dir], &["--part", "2/2"], "I/N");
    told(1, &["build", &dir], &["--part", "0/4"], "2 parts");
    told(2, &["build", &dir, "--part", "0/2"], &["-o", &mt], "cannot be used with");
    told(1, &["build", &input], &["--part", "0/2"], "input-0.part");
    told(1, &["join", &dir], &["--node", "1/0"], "built-0-0.part (written by `tetralod build --part`)");
    good(&["build", &dir, "--part", "0/2"]);
    told(1, &["join", &dir], &["--node", "1/0"], "build --part 1/2");
    told(1, &["join", &dir], &["--node", "1/1"], "no part 1 at level 1");
    told(1, &["join", &dir], &["--node", "0/0"], "`tetralod build --part`");
    fs::write(format!("{dir}/built-0-1.part"), b"something else").expect("a file");
    told(1, &["join", &dir], &["--node", "1/0"], "no part that this version");
    let whole = fs::read(format!("{dir}/built-0-0.part")).expect("a part");
    fs::write(format!("{dir}/built-0-1.part"), &whole[..whole.len() - 9]).expect("a file");
    told(1, &["join", &dir], &["--node", "1/0"], "cut off");
    fs::write(format!("{dir}/built-0-1.part"), &whole).expect("a file");
    told(1, &["join", &dir], &["--node", "1/0"], "takes parts 0 to 1");
}

/// Writes a mesh in three files and a list of them.
fn in_pieces(folder: &Folder, mesh: &TetMesh) -> String {
    let mut list = String::new();
    for (i, tets) in mesh.tets.chunks(mesh.tets.len().div_ceil(3)).enumerate() {
        let mut places: BTreeMap<u32, u32> = tets.iter().flatten().map(|&v| (v, 0)).collect();
        places.values_mut().zip(0..).for_each(|(place, i)| *place = i);
        let taken = || places.keys().map(|&v| v as usize);
        let values = |field: &Field| taken().map(|v| field.values[v]).collect();
        let piece = TetMesh {
            positions: taken().map(|v| mesh.positions[v]).collect(),
            fields: mesh
                .fields
                .iter()
                .map(|field| Field { values: values(field), ..field.clone() })
                .collect(),
            tets: tets.iter().map(|tet| tet.map(|v| places[&v])).collect(),
            ..TetMesh::default()
        };
        let mut bytes = Vec::new();
        io::write_vtu(&piece, &mut bytes).expect("bytes");
        fs::write(folder.path(&format!("{i}.vtu")), bytes).expect("a file");
        list += &format!("<Piece Source=\"{i}.vtu\"/>");
    }
    let path = folder.path("mesh.pvtu");
    let list = format!(
        "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid>{list}</PUnstructuredGrid></VTKFile>"
    );
    fs::write(&path, list).expect("a file");
    path
}

#[test]
fn pieces_are_built_as_their_whole() {
    let folder = Folder::new("parts-pieces");
    let [flow, whole, dir, mt, other] =
        ["flow.vtu", "whole.vtu", "dir", "a.mt", "b.mt"].map(|name| folder.path(name));
    good(&["generate", "sphere-flow", "--size", "6", "-o", &flow]);
    let list = in_pieces(&folder, &io::read(Path::new(&flow)).expect("a mesh"));
    // The same with its points in the order of the pieces.
    let mut bytes = Vec::new();
    io::write_vtu(&io::read(Path::new(&list)).expect("a mesh"), &mut bytes).expect("bytes");
    fs::write(&whole, bytes).expect("a file");
    let names = folder.names().len();
    let plan = json(&["part", &list, "--parts", "4", "-o", &dir, "--json"]);
    assert_eq!((&plan["parts"], fs::read_dir(&dir).expect("a folder").count()), (&4.into(), 5));
    for index in 0..4 {
        good(&["build", &dir, "--part", &format!("{index}/4")]);
    }
    for node in ["1/0", "1/1", "2/0"] {
        good(&["join", &dir, "--node", node]);
    }
    good(&["join", &dir, "-o", &mt]);
    good(&["build", &whole, "--parts", "4", "-o", &other]);
    let same = || fs::read(&mt).expect("a file") == fs::read(&other).expect("a file");
    assert!(same(), "part by part");
    let parts = ["build", &list, "-o", &mt];
    good(&[&parts[..], &["--parts", "4"]].concat());
    assert!(same(), "by one process");
    let said = |more: &[&str]| {
        let output = run(&[&parts[..], more].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stderr).to_owned()
    };
    let tetrahedra = plan["tetrahedra"].as_u64().expect("a number");
    let said_parts = said(&["--memory", &(179 * tetrahedra).to_string()]);
    assert!(said_parts.contains("so it is built in"), "{said_parts}");
    bad(1, &[&parts[..], &["--memory", "200K"]].concat(), &["more than --memory allows"]);
    // What the pieces do not tell one by one is told by the whole.
    let told = said(&["--parts", "4", "--field-tolerance", "1%"]);
    assert!(told.contains("a tolerance is given"), "{told}");
    fs::remove_dir_all(&dir).expect("the folder");
    assert_eq!(folder.names().len(), names + 2, "nothing is left behind: {:?}", folder.names());
}

/// Any name of a decomposition stands for all of it, with the bytes of the same mesh in one file.
#[test]
fn decompositions_of_exodus_are_one_input() {
    let folder = Folder::new("parts-exodus");
    let (whole, pieces) = crate::exodus::decomposed(4, &|_, _| ());
    for (number, piece) in pieces.iter().enumerate() {
        fs::write(folder.path(&format!("a.e.4.{number}")), piece).expect("a file");
    }
    let [base, one, undivided] = ["a.e", "a.e.4.2", "whole.e"].map(|name| folder.path(name));
    fs::write(&undivided, whole).expect("a file");
    let [vtu, dir, mt, other] = ["a.vtu", "dir", "a.mt", "b.mt"].map(|name| folder.path(name));
    let mesh = io::read_with(Path::new(&base), &io::ReadOptions { step: 1, ..io::ReadOptions::default() });
    let mut bytes = Vec::new();
    io::write_vtu(&mesh.expect("a mesh"), &mut bytes).expect("bytes");
    fs::write(&vtu, bytes).expect("a file");
    let same = || fs::read(&mt).expect("a file") == fs::read(&other).expect("a file");
    for parts in [&[][..], &["--parts", "2"]] {
        good(&[&["build", &vtu, "-o", &other][..], parts].concat());
        for input in [&base, &one] {
            good(&[&["build", input, "--step", "1", "-o", &mt][..], parts].concat());
            assert!(same(), "{input} {parts:?}");
        }
    }
    let parted = json(&["part", &one, "--step", "1", "--parts", "2", "-o", &dir, "--json"]);
    assert_eq!(parted["tetrahedra"], 6 * 8 * 3 * 2);
    good(&["work", &dir, "--quiet"]);
    fs::copy(format!("{dir}/built.mt"), &mt).expect("a file");
    assert!(same(), "by a worker");
    // All steps, and blocks, as of the one file: whoever verifies knows no order of the points.
    good(&["build", &base, "--preserve", "block", "-o", &mt]);
    assert_eq!(json(&["info", &mt, "--json"])["fields"].as_array().map(Vec::len), Some(2));
    assert_eq!(json(&["verify", &mt, "--against", &base, "--json"])["valid"], true);
    good(&["build", &undivided, "--preserve", "block", "-o", &other]);
    let counts = |mt: &str| {
        let info = json(&["info", mt, "--json"]);
        (info["vertices"].clone(), info["tetrahedra"].clone(), info["regions"].clone())
    };
    assert_eq!(counts(&mt), counts(&other));
    // What is read is not written over, and what is missing is named.
    bad(1, &["build", &base, "-o", &one], &["is an input, too"]);
    fs::remove_file(folder.path("a.e.4.3")).expect("a file");
    for command in [&["build", &base, "-o", &mt][..], &["part", &one, "--parts", "2", "-o", &dir]] {
        bad(1, command, &["a.e.4.3\" is not there"]);
    }
}

#[test]
fn ranges_of_cells_are_built_as_their_whole() {
    let folder = Folder::new("parts-ranges");
    let [flow, ascii, dir, mt, other] =
        ["flow.vtu", "ascii.vtu", "dir", "a.mt", "b.mt"].map(|name| folder.path(name));
    good(&["generate", "sphere-flow", "--size", "6", "-o", &flow]);
    good(&["build", &flow, "--parts", "4", "-o", &other]);
    let names = folder.names().len();
    let by_ranges = ["--parts", "4", "--range", "300", "-o"];
    good(&[&["build", &flow][..], &by_ranges, &[&mt]].concat());
    let same = || fs::read(&mt).expect("a file") == fs::read(&other).expect("a file");
    assert!(same(), "by one process");
    good(&[&["part", &flow][..], &by_ranges, &[&dir]].concat());
    good(&["work", &dir, "--quiet"]);
    fs::copy(format!("{dir}/built.mt"), &mt).expect("a file");
    assert!(same(), "by a worker");
    // What is no range says why.
    let lines = "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"5\" NumberOfCells=\"2\"><PointData>\
                 <DataArray type=\"Float64\" Name=\"p\">0 1 2 3 4</DataArray></PointData><Points>\
                 <DataArray type=\"Float64\" NumberOfComponents=\"3\">0 0 0 1 0 0 0 1 0 0 0 1 1 1 1</DataArray></Points><Cells>\
                 <DataArray type=\"Int64\" Name=\"connectivity\">0 1 2 3 1 2 3 4</DataArray>\
                 <DataArray type=\"Int64\" Name=\"offsets\">4 8</DataArray><DataArray type=\"UInt8\" Name=\"types\">10 10</DataArray>\
                 </Cells></Piece></UnstructuredGrid></VTKFile>";
    fs::write(&ascii, lines).expect("a file");
    let output = run(&["part", &ascii, "--parts", "1", "--range", "1", "-o", &folder.path("dir2")]);
    let told = text(&output.stderr);
    assert!(output.status.success() && told.contains("its numbers are text"), "{told}");
    assert_eq!(folder.names().len(), names + 4, "nothing is left behind: {:?}", folder.names());
}

#[test]
fn the_head_of_a_file_tells_what_needs_no_updates() {
    let folder = Folder::new("info-head");
    let mt = folder.path("a.mt");
    good(&["build", &generate(&folder, "17"), "-o", &mt]);
    let [whole, full, head] =
        [&[][..], &["--full"], &["--head"]].map(|more| json(&[&["info", &mt, "--json"][..], more].concat()));
    assert_eq!(whole, full);
    let (whole, head) = (whole.as_object().expect("an object"), head.as_object().expect("an object"));
    let missing = ["depth", "arcs_per_node", "tets_per_update", "memory", "breakdown"];
    for (key, value) in whole {
        match missing.contains(&key.as_str()) {
            true => assert!(!head.contains_key(key), "{key}"),
            false if key == "full" => assert_eq!((value, &head[key]), (&true.into(), &false.into())),
            false => assert_eq!(value, &head[key], "{key}"),
        }
    }
    assert_eq!(whole.len(), head.len() + missing.len());
    let shown = good(&["info", &mt, "--head"]);
    assert!(
        shown.contains("--full") && !shown.contains("deep") && shown.contains("bytes at error"),
        "{shown}"
    );
}

#[test]
fn samples_of_a_file_are_verified() {
    let folder = Folder::new("verify-samples");
    let [mt, other] = ["a.mt", "other.vti"].map(|name| folder.path(name));
    let input = generate(&folder, "33");
    good(&["build", &input, "-o", &mt]);
    let report = json(&["verify", &mt, "--against", &input, "--samples", "7", "--json"]);
    assert_eq!((&report["valid"], &report["queries"]), (&true.into(), &7.into()));
    assert_eq!((&report["quick"], report["memory_bytes"].as_u64()), (&true.into(), None));
    assert!(report["bytes_read"].as_u64() > Some(0));
    good(&["generate", "marschner-lobb", "--size", "33", "-o", &other]);
    let smaller = generate(&folder, "9");
    for (wrong, words) in [(&other, "reference vertex"), (&smaller, "give the mesh that it was built from")] {
        let output = run(&["verify", &mt, "--against", wrong, "--samples", "3"]);
        assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
        let said = text(&output.stdout);
        assert!(said.contains("promises are broken") && said.contains(words), "{said}");
    }
    bad(2, &["verify", &mt, "--against", &input, "--samples", "0"], &["--samples"]);
    bad(2, &["verify", &mt, "--against", &input, "--samples", "3", "--quick"], &["--quick"]);
}

#[cfg(unix)]
#[test]
fn an_interrupt_while_a_mesh_is_parted_leaves_what_was_there() {
    let folder = Folder::new("parts-interrupt");
    let input = generate(&folder, "41");
    let [dir, other] = ["dir", "other"].map(|name| folder.path(name));
    let count = |path: &str| fs::read_dir(path).map_or(0, Iterator::count);
    let part = ["part", &input, "--parts", "64", "-o"];
    let code = interrupt(&[&part[..], &[&dir]].concat(), || count(&dir) > 0);
    assert_eq!(code, Some(130));
    assert_eq!(folder.names(), ["b41.vti"]);

    good(&["part", &input, "--parts", "2", "-o", &other]);
    let files = || -> BTreeMap<_, _> {
        let entries = fs::read_dir(&other).expect("a folder").map(|entry| entry.expect("an entry").path());
        entries.map(|path| (path.clone(), fs::read(path).expect("a file"))).collect()
    };
    let before = files();
    let code = interrupt(&[&part[..], &[&other]].concat(), || count(&other) > before.len());
    assert_eq!(code, Some(130));
    assert!(files() == before, "parts of one plan, and all of them");
}
