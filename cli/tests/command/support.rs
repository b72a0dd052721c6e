//! Runs the command `tetralod` in a folder of its own.

use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
#[cfg(unix)]
use std::time::{Duration, Instant};

/// A folder of one test, gone when the test is done.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("tetralod-cli-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).expect("a temporary folder");
        Self(path)
    }

    pub fn path(&self, name: &str) -> String {
        self.0.join(name).to_str().expect("a name in UTF-8").to_owned()
    }

    /// Names of the files in it, sorted.
    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).expect("the folder is there");
        let name = |e: std::io::Result<fs::DirEntry>| e.expect("an entry").file_name();
        let mut names: Vec<_> = entries.map(|e| name(e).to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The command with these arguments and nothing on stdin.
pub fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tetralod"));
    command.args(arguments).stdin(Stdio::null());
    command
}

/// `tetralod serve` on a free port; ends with the test.
pub struct Server {
    pub child: Child,
    /// What it printed: the address of the folder or of the one file.
    pub url: String,
}

impl Server {
    pub fn start(arguments: &[&str]) -> Self {
        let mut all = vec!["serve", "--port", "0"];
        all.extend(arguments);
        let mut child =
            command(&all).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it starts");
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("a pipe")).read_line(&mut line).expect("a line");
        Self { child, url: line.trim().to_owned() }
    }

    /// Host and port, and the path that follows.
    pub fn address(&self) -> (&str, &str) {
        let rest = self.url.strip_prefix("http://").expect("it prints its address");
        rest.split_at(rest.find('/').expect("with a path"))
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub fn run(arguments: &[&str]) -> Output {
    command(arguments).output().expect("the command starts")
}

pub fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}

/// Runs what must succeed; gives stdout.
pub fn good(arguments: &[&str]) -> String {
    let output = run(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout).to_owned()
}

/// Writes the data set `bucky` with `size` points along an edge, and its MT.
pub fn bucky(size: u32, input: &str, mt: &str) {
    good(&["generate", "bucky", "--size", &size.to_string(), "-o", input]);
    good(&["build", input, "-o", mt, "--quiet"]);
}

/// Runs what must succeed with one JSON object on stdout.
pub fn json(arguments: &[&str]) -> Value {
    let value: Value = serde_json::from_str(&good(arguments)).expect("one JSON value on stdout");
    assert!(value.is_object());
    value
}

/// Runs what must fail with an error that holds all of `words`.
pub fn bad(code: i32, arguments: &[&str], words: &[&str]) {
    let output = run(arguments);
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {error}");
    assert!(output.stdout.is_empty(), "{arguments:?}: errors go to stderr");
    assert!(error.starts_with("error: ") && !error.contains("panicked"), "{arguments:?}: {error}");
    for word in words {
        assert!(error.contains(word), "{arguments:?}: '{word}' is not in: {error}");
    }
}

pub fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is a number: {value}"))
}

/// The names and the rows of a table; an empty place is NaN.
pub fn table(path: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = fs::read_to_string(path).expect("a table");
    let mut lines = text.lines();
    let names = lines.next().expect("a line of names").split(',').map(str::to_owned).collect();
    let number = |word: &str| if word.is_empty() { f64::NAN } else { word.parse().expect("a number") };
    (names, lines.map(|line| line.split(',').map(number).collect()).collect())
}

/// Starts a command, waits until `ready`, sends SIGINT, and gives the exit code.
#[cfg(unix)]
pub fn interrupt(arguments: &[&str], ready: impl Fn() -> bool) -> Option<i32> {
    let quiet = Stdio::null;
    let mut child = command(arguments).stdout(quiet()).stderr(quiet()).spawn().expect("the command starts");
    let start = Instant::now();
    while !ready() {
        assert!(start.elapsed() < Duration::from_secs(60), "it never got so far");
        assert!(child.try_wait().expect("a child").is_none(), "it was done too soon");
        std::thread::sleep(Duration::from_millis(1));
    }
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill is there");
    assert!(kill.success());
    child.wait().expect("a child").code()
}
