//! Promise: `tetralod view` serves a page with volumes: MT files as they are, of other files what `tetralod build` makes of them, which is
//! kept, and made anew when a file changes.

use crate::support::{Folder, command, good, run};
use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// So long may anything take on a busy machine.
const PATIENCE: Duration = Duration::from_secs(600);

/// A page that runs until the test ends.
struct View {
    child: Child,
    host: String,
}

impl View {
    /// Of these files of a folder, with a page that is there.
    fn start(folder: &Folder, arguments: &[impl AsRef<OsStr>]) -> Self {
        let (page, cache) = (folder.path("page"), folder.path("cache"));
        fs::create_dir_all(folder.path("page/pkg")).expect("a folder");
        fs::write(folder.path("page/index.html"), "the page").expect("a file");
        fs::write(folder.path("page/pkg/viewer.js"), "the package").expect("a file");
        let own = ["view", "--port", "0", "--no-browser", "--page", &page, "--cache", &cache];
        Self::of(command(&own).args(arguments))
    }

    fn of(command: &mut Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it starts");
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("a pipe")).read_line(&mut line).expect("a line");
        let host = line.trim().trim_start_matches("http://").trim_end_matches('/').to_owned();
        Self { child, host }
    }

    /// Head and body of an answer.
    fn get(&self, path: &str) -> (String, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.host).expect("it listens");
        let head = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
        stream.write_all(head.as_bytes()).expect("it listens");
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).expect("an answer");
        let end = bytes.windows(4).position(|four| four == b"\r\n\r\n").expect("a head");
        (String::from_utf8(bytes[..end].to_vec()).expect("a head"), bytes[end + 4..].to_vec())
    }

    fn list(&self) -> Value {
        serde_json::from_slice(&self.get("/data/volumes.json").1).expect("JSON")
    }

    /// The list as soon as it is as it is meant to be.
    fn list_when(&self, is_meant: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        loop {
            let list = self.list();
            if is_meant(&list) {
                return list;
            }
            assert!(start.elapsed() < PATIENCE, "{list}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// The list when nothing is left to do.
    fn done(&self) -> Value {
        self.list_when(|list| list["pending"] == Value::Array(Vec::new()))
    }
}

impl Drop for View {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A file of a small ball, of this size.
fn ball(folder: &Folder, name: &str, size: &str) -> String {
    let path = folder.path(name);
    good(&["generate", "bucky", "--size", size, "-o", &path]);
    path
}

#[test]
fn volumes_are_listed_and_their_files_are_those_that_build_makes() {
    let folder = Folder::new("view");
    let (grid, mt, own) = (ball(&folder, "a ball.vti", "9"), folder.path("own.mt"), folder.path("built.mt"));
    good(&["build", &grid, "--kind", "edge", "-o", &mt]);
    good(&["build", &grid, "--all-fields", "--cell-to-point", "-o", &own]);
    let view = View::start(&folder, &[&grid, &mt]);
    let (head, page) = view.get("/");
    assert!(head.starts_with("HTTP/1.1 200") && page == b"the page", "{head}");
    assert_eq!(view.get("/pkg/viewer.js").1, b"the package");
    let list = view.done();
    assert_eq!(list["failed"], Value::Array(Vec::new()));
    let volumes = list["volumes"].as_array().expect("a list");
    assert_eq!(volumes.iter().map(|volume| &volume["title"]).collect::<Vec<_>>(), ["a ball.vti", "own.mt"]);
    for (volume, path) in volumes.iter().zip([&own, &mt]) {
        assert_eq!((&volume["vertices"], &volume["tetrahedra"]), (&729.into(), &3072.into()));
        let (head, bytes) = view.get(&format!("/{}", volume["url"].as_str().expect("an address")));
        assert!(head.to_ascii_lowercase().contains("accept-ranges: bytes"), "{head}");
        assert!(bytes == fs::read(path).expect("a file"), "{volume}");
    }
    // Nothing else of the folder.
    for path in ["/own.mt", "/files/2/x.mt", "/files/0", "/../own.mt", "/data/"] {
        assert!(view.get(path).0.starts_with("HTTP/1.1 404"), "{path}");
    }
}

#[test]
fn what_was_built_is_used_again_until_its_input_changes() {
    let folder = Folder::new("view-cache");
    let grid = ball(&folder, "ball.vti", "5");
    drop(View::start(&folder, &[&grid]).done());
    let [built] = &cached(&folder)[..] else { panic!("one file is kept") };
    let first = fs::read(built).expect("a file");
    // Another file in its place would not be noticed if it were not used.
    fs::write(built, fs::read(mt_of(&folder, "9")).expect("a file")).expect("a file");
    let view = View::start(&folder, &[&grid]);
    let list = view.done();
    assert_eq!(list["volumes"][0]["vertices"], 729, "{list}");
    ball(&folder, "ball.vti", "7");
    let list = view.list_when(|list| list["volumes"][0]["vertices"] == 343);
    assert_ne!(list["volumes"][0]["version"], "");
    ball(&folder, "ball.vti", "5");
    view.list_when(|list| list["volumes"][0]["vertices"] == 125);
    assert!(fs::read(built).expect("a file") == first);
    // With other options it is another file.
    let view = View::start(&folder, &[&grid, "--", "--kind", "edge"]);
    view.done();
    assert_eq!(cached(&folder).len(), 2);
}

/// Other systems have no such names.
#[test]
#[cfg(target_os = "linux")]
fn a_file_whose_name_is_no_text_is_built_and_shown_like_others() {
    use std::os::unix::ffi::OsStringExt as _;
    let folder = Folder::new("view-name");
    let path = folder.path("ball").into_bytes().into_iter().chain(*b"\xff.vti").collect();
    let path = std::ffi::OsString::from_vec(path);
    fs::rename(ball(&folder, "ball.vti", "5"), &path).expect("it may have this name");
    let built = command(&["build", "--json", "-o", &folder.path("a.mt")]).arg(&path).output();
    let report: Value = serde_json::from_slice(&built.expect("it starts").stdout).expect("JSON");
    assert!(report["inputs"][0].as_str().expect("a path").ends_with("ball\u{fffd}.vti"), "{report}");
    for _ in 0..2 {
        let view = View::start(&folder, &[&path]);
        assert_eq!(view.done()["volumes"][0]["vertices"], 125);
    }
}

/// An MT file of a ball of this size.
fn mt_of(folder: &Folder, size: &str) -> String {
    let (grid, mt) = (ball(folder, "other.vti", size), folder.path("other.mt"));
    good(&["build", &grid, "-o", &mt]);
    mt
}

/// The MT files in the cache.
fn cached(folder: &Folder) -> Vec<std::path::PathBuf> {
    let entries = fs::read_dir(folder.path("cache")).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths.filter(|path| path.extension().is_some_and(|ending| ending == "mt")).collect()
}

#[test]
fn an_mt_file_that_is_replaced_is_another_version() {
    let folder = Folder::new("view-replaced");
    let mt = mt_of(&folder, "5");
    let view = View::start(&folder, &[&mt]);
    let before = view.done();
    mt_of(&folder, "9");
    let after = view.list_when(|list| list["volumes"][0]["vertices"] == 729);
    assert_ne!(before["volumes"][0]["version"], after["volumes"][0]["version"]);
    assert_eq!(before["volumes"][0]["url"], after["volumes"][0]["url"]);
}

#[test]
fn what_cannot_be_built_is_said_and_tried_again_when_it_is_another_file() {
    let folder = Folder::new("view-bad");
    let bad = folder.path("bad.vtk");
    fs::write(&bad, "# vtk DataFile Version 3.0\nbroken\n").expect("a file");
    let view = View::start(&folder, &[&bad]);
    let list = view.done();
    let said = run(&["build", &bad, "--all-fields", "--cell-to-point", "-o", &folder.path("x.mt")]);
    let said = String::from_utf8(said.stderr).expect("text");
    let failed = list["failed"][0]["message"].as_str().expect("a message");
    assert_eq!(format!("error: {failed}"), said.trim_end());
    fs::copy(ball(&folder, "ball.vti", "5"), folder.path("bad.vtk")).expect("a copy");
    let list = view.list_when(|list| list["volumes"] != Value::Array(Vec::new()));
    assert_eq!((&list["failed"], &list["volumes"][0]["vertices"]), (&Value::Array(Vec::new()), &125.into()));
}

#[test]
fn a_file_that_is_not_there_is_refused_at_once() {
    let folder = Folder::new("view-missing");
    let page = folder.path("page");
    for (arguments, said) in [
        (&["view", "--page", &page][..], "--page"),
        (&["view", "missing.vtu"], "page"),
        (&["view", "--cors", "*"], "--cors"),
    ] {
        let output = run(arguments);
        let text = String::from_utf8(output.stderr).expect("text");
        assert!(!output.status.success() && text.contains(said), "{arguments:?}: {text}");
    }
    View::start(&folder, &[""; 0]);
    let output = run(&["view", "--page", &page, "--no-browser", &folder.path("missing.vtu")]);
    let text = String::from_utf8(output.stderr).expect("text");
    assert!(!output.status.success() && text.contains("missing.vtu"), "{text}");
}

#[cfg(unix)]
#[test]
fn the_end_of_the_page_ends_a_build_and_leaves_nothing_of_it() {
    let folder = Folder::new("view-end");
    let grid = ball(&folder, "ball.vti", "65");
    let view = View::start(&folder, &[&grid]);
    view.list_when(|list| list["pending"][0]["stage"] == "remove");
    succeed_in(Command::new("kill").arg(view.child.id().to_string()));
    let mut view = view;
    let start = Instant::now();
    while view.child.try_wait().expect("a child").is_none() {
        assert!(start.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(20));
    }
    let left: Vec<_> = fs::read_dir(folder.path("cache")).expect("a folder").collect();
    assert!(left.is_empty(), "{left:?}");
}

#[cfg(unix)]
fn succeed_in(command: &mut Command) {
    assert!(command.status().expect("it starts").success());
}

#[test]
fn progress_is_told_to_programs_in_lines() {
    let folder = Folder::new("view-progress");
    let grid = ball(&folder, "ball.vti", "33");
    let output = run(&["build", &grid, "--progress", "json", "--quiet", "-o", &folder.path("ball.mt")]);
    let text = String::from_utf8(output.stderr).expect("text");
    assert!(output.status.success() && !text.is_empty(), "{text}");
    for line in text.lines() {
        let step: Value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{line}: {error}"));
        assert!(step["stage"].is_string() && step["done"].as_u64() <= step["total"].as_u64(), "{line}");
    }
}
