//! Promises of building in situ: the C header writes what the readers read, in C and in C++; workers wait for pieces, and make of them the file that one
//! process makes; what is missing or damaged is named.

use crate::readme::root;
use crate::support::{Folder, bad, command, good, json, run, text};
use std::fs;
use std::process::{Child, Command, Stdio};

const EXAMPLE: &str = "examples/in-situ/simulation.c";

/// How many ranks the simulation has.
const RANKS: usize = 3;

/// The simulation of `examples/in-situ`, the folder of its pieces, and that of the parts.
struct Simulation {
    folder: Folder,
    program: String,
    pieces: String,
    list: String,
    dir: String,
}

impl Simulation {
    fn new(name: &str) -> Self {
        let folder = Folder::new(name);
        let [program, pieces, list, dir] =
            ["simulation", "step", "step/pieces.pvtu", "dir"].map(|name| folder.path(name));
        compile("cc", &["-std=c99"], EXAMPLE, &program);
        fs::create_dir(&pieces).expect("a folder");
        Self { folder, program, pieces, list, dir }
    }

    /// Asks workers to part the pieces later.
    fn ask(&self) {
        good(&["part", &self.list, "--parts", "4", "--all-fields", "-o", &self.dir, "--later"]);
    }

    /// Has a rank write its piece; that of number 0 writes the list, too.
    fn run_rank(&self, rank: usize) {
        simulate(&self.program, &[&self.pieces, &RANKS.to_string(), &rank.to_string()]);
    }

    fn piece(&self, rank: usize) -> String {
        format!("{}/piece-{rank}.vtu", self.pieces)
    }

    fn start(&self) -> Child {
        let mut worker = command(&["work", &self.dir, "--wait", "--quiet"]);
        worker.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("a worker")
    }

    fn assert_built(&self) {
        let once = self.folder.path("once.mt");
        good(&["build", &self.list, "--parts", "4", "--all-fields", "-o", &once, "--quiet"]);
        let [built, once] =
            [&format!("{}/built.mt", self.dir), &once].map(|path| fs::read(path).expect("a file"));
        assert!(built == once, "the file is that of one process");
    }
}

fn compile(compiler: &str, options: &[&str], source: &str, program: &str) {
    let mut command = Command::new(compiler);
    command.args(options).args(["-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I", "workflows"]);
    let output = command.args([source, "-o", program]).current_dir(root()).output();
    let output = output.unwrap_or_else(|error| panic!("{compiler}: {error}"));
    assert!(output.status.success(), "{compiler}: {}", text(&output.stderr));
}

fn simulate(program: &str, arguments: &[&str]) {
    let output = Command::new(program).args(arguments).output().expect("the simulation starts");
    assert!(output.status.success(), "{}", text(&output.stderr));
}

#[test]
fn workers_wait_for_pieces() {
    let simulation = Simulation::new("in-situ");
    let Simulation { dir, list, .. } = &simulation;
    simulation.ask();
    let missing = |words: &[&str]| bad(1, &["work", dir], words);
    missing(&["pieces.pvtu is not there yet", "--wait` waits until all are there"]);
    let mut workers = [simulation.start(), simulation.start()];
    simulation.run_rank(2);
    simulation.run_rank(0);
    missing(&["1 of 3 of", "are missing", &simulation.piece(1)]);
    let status = json(&["status", dir, "--json"]);
    assert_eq!(
        (&status["pieces"]["pieces"], &status["pieces"]["missing"], &status["goes_on"]),
        (&3.into(), &serde_json::json!([simulation.piece(1)]), &true.into())
    );
    assert!(good(&["status", dir]).contains(&format!("1 of 3 of {list} are missing")));
    for worker in &mut workers {
        assert!(worker.try_wait().expect("a worker").is_none(), "it waits");
    }
    simulation.run_rank(1);
    for worker in workers {
        let output = worker.wait_with_output().expect("a worker");
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
    simulation.assert_built();
    let status = json(&["status", dir, "--json"]);
    assert_eq!((&status["goes_on"], status["pieces"].is_null()), (&false.into(), true));
    // The pieces are needed no more, and the plan is as any other.
    fs::remove_dir_all(&simulation.pieces).expect("a folder");
    good(&["work", dir]);
    // Asked again, nothing of it is used.
    simulation.ask();
    missing(&["pieces.pvtu is not there yet"]);
    assert!(!fs::exists(format!("{dir}/built.mt")).expect("a folder"));
}

#[test]
fn a_damaged_piece_is_named() {
    let simulation = Simulation::new("in-situ-damaged");
    (0..RANKS).for_each(|rank| simulation.run_rank(rank));
    let piece = simulation.piece(1);
    let whole = fs::read(&piece).expect("a piece");
    simulation.ask();
    let work = ["work", &simulation.dir, "--retries", "0", "--quiet"];
    fs::write(&piece, &whole[..whole.len() / 2]).expect("a file");
    bad(1, &work, &["part the mesh has failed 1 times", "piece-1.vtu", "--retry-failed` goes on"]);
    fs::write(&piece, &whole).expect("a file");
    good(&["work", &simulation.dir, "--retry-failed"]);
    simulation.assert_built();
    // What is mended is told by the worker that parts the mesh.
    fs::remove_dir_all(&simulation.dir).expect("a folder");
    simulation.ask();
    fs::copy(simulation.piece(2), &piece).expect("a file");
    let output = run(&["work", &simulation.dir]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let said = text(&output.stderr);
    assert!(
        said.contains("dropped 1152 duplicate tetrahedra\n") && said.contains("\npart the mesh: "),
        "{said}"
    );
    // A list of something else.
    fs::write(&simulation.list, "<VTKFile").expect("a file");
    let ask = ["part", &simulation.list, "--parts", "4", "-o", &simulation.dir, "--later"];
    bad(1, &ask, &["pieces.pvtu"]);
}

#[test]
fn what_cannot_be_done_later_is_refused_at_once() {
    let folder = Folder::new("in-situ-refused");
    let [list, dir, other] = ["a.pvtu", "dir", "a.vtu"].map(|name| folder.path(name));
    let part = |code: i32, input: &str, more: &[&str], word: &str| {
        bad(code, &[&["part", input, "-o", &dir, "--later"][..], more].concat(), &[word]);
    };
    part(2, &other, &["--parts", "2"], "--later goes with one list of pieces");
    part(1, &list, &["--parts", "3"], "power of two");
    part(1, &list, &["--parts", "2", "--kind", "edge"], "half-edge");
    assert!(folder.names().is_empty());
    good(&["part", &list, "-o", &dir, "--later", "--parts", "2"]);
    let request = format!("{dir}/later.json");
    let text = fs::read_to_string(&request).expect("a request");
    fs::write(&request, text.replace(env!("CARGO_PKG_VERSION"), "99.1.2")).expect("a request");
    bad(1, &["work", &dir, "--wait"], &["written by tetralod 99.1.2"]);
}

#[test]
fn the_header_writes_the_same_in_c_and_in_cpp() {
    let simulation = Simulation::new("in-situ-header");
    let [program, pieces] = ["other", "other-step"].map(|name| simulation.folder.path(name));
    compile("c++", &["-x", "c++", "-std=c++11"], EXAMPLE, &program);
    fs::create_dir(&pieces).expect("a folder");
    let ranks = RANKS.to_string();
    simulate(&simulation.program, &[&simulation.pieces, &ranks]);
    simulate(&program, &[&pieces, &ranks]);
    let names = ["piece-0.vtu", "piece-1.vtu", "piece-2.vtu", "pieces.pvtu"];
    let found = fs::read_dir(&pieces).expect("a folder").count();
    assert_eq!(found, names.len(), "nothing else is left");
    for name in names {
        let [c, cpp] = [&simulation.pieces, &pieces].map(|folder| fs::read(format!("{folder}/{name}")));
        assert!(c.expect("a file") == cpp.expect("a file"), "{name}");
    }
}

/// Writes what is wrong, and says what comes of it.
const WRONG: &str = r#"
#include "tetralod_part.h"
int main(void) {
    const double points[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, values[4] = {0, 1, 2, 3};
    const int64_t right[4] = {0, 1, 2, 3}, high[4] = {0, 1, 2, 4}, low[4] = {0, -1, 2, 3};
    const int64_t *tets[] = {high, low, right, right, right, right, right};
    const char *names[] = {"a", "a", "", "b\n", "a", "a", "<\"a\">"};
    const int components[] = {1, 1, 1, 1, 0, 1, 1};
    int i;
    for (i = 0; i < 7; i++) {
        tetralod_field field = {"", 1, TETRALOD_FLOAT64, NULL};
        tetralod_part part = {4, points, 1, TETRALOD_INT64, NULL, 1, NULL};
        char message[200] = "";
        int result;
        field.name = names[i];
        field.components = components[i];
        field.values = i == 5 ? NULL : values;
        part.tets_points = tets[i];
        part.field = &field;
        result = tetralod_part_write(i < 6 ? "." : "nowhere", 7, &part, message, sizeof message);
        printf("%d %s\n", result, message);
    }
    return 0;
}
"#;

#[test]
fn the_header_says_what_is_wrong() {
    let folder = Folder::new("in-situ-wrong");
    let [source, program] = ["wrong.c", "wrong"].map(|name| folder.path(name));
    fs::write(&source, WRONG).expect("a file");
    compile("cc", &["-std=c99"], &source, &program);
    let output = Command::new(&program).current_dir(folder.path("")).output().expect("it starts");
    let said = [
        "1 tetrahedron 0 of rank 7 has point 4, and there are 4",
        "1 tetrahedron 0 of rank 7 has point -1, and there are 4",
        "1 field 0 must have a name, a type, and at least one component",
        "1 the name of field 0 has a control character",
        "1 field 0 must have a name, a type, and at least one component",
        "1 field 0 has no values",
        "2 nowhere/piece-7.vtu could not be written: No such file or directory",
    ];
    assert_eq!(text(&output.stdout).lines().collect::<Vec<_>>(), said);
    assert_eq!(folder.names(), ["wrong", "wrong.c"], "nothing is written");
}
