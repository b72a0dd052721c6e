//! `cargo xtask planted`: mistakes that somebody could make are planted in the library, and for each of them a test has to fail.
//!
//! `xtask/planted-faults.json` lists them: what is wrong, an expression of the sources as it is and as it must not be, and the test that
//! finds the difference, or why none can. The sources themselves know nothing of it. A copy of the working tree gets all faults at once,
//! each behind a switch, and is compiled once; then each test runs with its fault switched on. A fault may let a program run for ever or
//! take all memory, so both are limited, and whoever gets there counts as found.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

use crate::shell;

const LIST: &str = "xtask/planted-faults.json";

/// The copy of the working tree, and what is compiled from it.
const TREE: &str = "target/planted/tree";
const COMPILED: &str = "target/planted/target";

/// Says in the copy which fault is switched on, by its number.
const SWITCH: &str = "TETRALOD_PLANTED_FAULT";

/// The crates that may have faults, whose tests find them.
const PACKAGES: [&str; 4] = ["tetralod", "tetralod-build", "tetralod-io", "tetralod-render"];

/// Everything that their tests need.
const FEATURES: &str = "tetralod/http,tetralod-io/hdf5";

/// What the copy of each crate's `src/lib.rs` gets besides.
const SWITCHES: &str = r#"
pub(crate) fn planted_fault(number: u32) -> bool {
    static CHOSEN: std::sync::OnceLock<Option<u32>> = std::sync::OnceLock::new();
    let chosen = || std::env::var("TETRALOD_PLANTED_FAULT").ok().and_then(|number| number.parse().ok());
    *CHOSEN.get_or_init(chosen) == Some(number)
}
"#;

/// One fault in so many may survive.
const MAY_SURVIVE: usize = 20;

/// Kilobytes of address space that a test may take.
const MEMORY: u32 = 6 << 20;

/// A test with a fault may take so long, and so many times as long as without it.
const PATIENCE: Duration = Duration::from_secs(10);
const TIMES_AS_LONG: u32 = 20;

struct Fault {
    name: String,
    /// Its path in the working tree.
    file: String,
    was: String,
    is: String,
    fate: Fate,
}

enum Fate {
    FoundBy(Test),
    /// And why.
    Survives(String),
}

/// A test binary, by the name of a crate for that of its unit tests, and the tests in it whose names contain this.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Test {
    binary: String,
    name: String,
}

/// Plants the faults whose names or files contain one of `args`, or all.
pub fn run(args: &[String]) -> Result<()> {
    let faults = read(&fs::read_to_string(LIST).context(LIST)?)?;
    copy_with(&faults)?;
    let programs = compile(&faults)?;
    let is_chosen = |fault: &Fault| {
        args.is_empty() || args.iter().any(|word| fault.name.contains(word) || fault.file.contains(word))
    };
    let chosen: Vec<(usize, &Fault)> =
        faults.iter().enumerate().filter(|(_, fault)| is_chosen(fault)).collect();
    ensure!(!chosen.is_empty(), "no fault has such a name or file");
    let times = times_without_faults(&programs, chosen.iter().map(|(_, fault)| *fault))?;
    let mut missed = Vec::new();
    for &(number, fault) in &chosen {
        match &fault.fate {
            Fate::Survives(why) => println!("survives       {}: {}: {why}", fault.file, fault.name),
            Fate::FoundBy(test) => {
                let limit = PATIENCE + TIMES_AS_LONG * times[test];
                let (ending, time) = run_with_fault(&programs, test, number, limit)?;
                let seconds = time.as_secs_f64();
                println!(
                    "{ending:<8}{seconds:>5.1} s {}: {} ({} {})",
                    fault.file, fault.name, test.binary, test.name
                );
                if ending == "passes" {
                    missed.push(fault);
                }
            }
        }
    }
    judge(&chosen, &missed)
}

fn judge(chosen: &[(usize, &Fault)], missed: &[&Fault]) -> Result<()> {
    let survivors = chosen.iter().filter(|(_, fault)| matches!(fault.fate, Fate::Survives(_))).count();
    let (all, found) = (chosen.len(), chosen.len() - survivors - missed.len());
    println!("\nfound {found} of {all} faults: {:.1} %", 100.0 * found as f64 / all as f64);
    if !missed.is_empty() {
        let names: Vec<&str> = missed.iter().map(|fault| fault.name.as_str()).collect();
        bail!("faults that the tests named for them do not find:\n  {}", names.join("\n  "));
    }
    ensure!(survivors * MAY_SURVIVE <= all.max(MAY_SURVIVE), "{survivors} of {all} faults survive");
    Ok(())
}

fn read(list: &str) -> Result<Vec<Fault>> {
    let list: Value = serde_json::from_str(list).context(LIST)?;
    let faults = list.as_array().context("the list of faults is no array")?;
    faults.iter().map(|fault| fault_of(fault).with_context(|| fault.to_string())).collect()
}

fn fault_of(fault: &Value) -> Result<Fault> {
    let text = |key: &str| fault[key].as_str().map(str::to_owned);
    let needed = |key: &'static str| text(key).with_context(|| format!("a fault has no `{key}`"));
    let fate = match (text("found_by"), text("survives")) {
        (Some(test), None) => {
            let (binary, name) = test.split_once(' ').context("`found_by` is a test binary and a test")?;
            Fate::FoundBy(Test { binary: binary.to_owned(), name: name.to_owned() })
        }
        (None, Some(why)) => Fate::Survives(why),
        _ => bail!("a fault has either `found_by` or `survives`"),
    };
    Ok(Fault { name: needed("name")?, file: needed("file")?, was: needed("was")?, is: needed("is")?, fate })
}

/// Makes the copy, or brings it up to date: files that stay the same are not written, so that nothing is compiled again for them.
fn copy_with(faults: &[Fault]) -> Result<()> {
    let listed = shell::output(&mut shell::command(
        "git",
        ["ls-files", "--cached", "--others", "--exclude-standard"],
    ))?;
    let files: BTreeSet<PathBuf> = listed.lines().map(PathBuf::from).filter(|path| path.is_file()).collect();
    for path in &files {
        let mut content = fs::read(path).with_context(|| path.display().to_string())?;
        let name = path.to_string_lossy().replace('\\', "/");
        if name.starts_with("src/") || name.starts_with("crates/") && name.ends_with(".rs") {
            let source = String::from_utf8(content).with_context(|| name.clone())?;
            content = planted(&source, &name, faults)?.into_bytes();
        }
        let copy = Path::new(TREE).join(path);
        if fs::read(&copy).ok().as_ref() != Some(&content) {
            fs::create_dir_all(copy.with_file_name(""))?;
            fs::write(&copy, content).with_context(|| copy.display().to_string())?;
        }
    }
    let known: BTreeSet<&str> = faults.iter().map(|fault| fault.file.as_str()).collect();
    let missing = known.into_iter().find(|file| !files.contains(Path::new(file)));
    ensure!(missing.is_none(), "there is no {}", missing.unwrap_or_default());
    remove_others(Path::new(TREE), Path::new(""), &files)
}

/// Removes from a folder of the copy what the working tree does not have any more.
fn remove_others(tree: &Path, folder: &Path, files: &BTreeSet<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(tree.join(folder))? {
        let entry = entry?;
        let path = folder.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            remove_others(tree, &path, files)?;
        } else if !files.contains(&path) {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

/// A source with its faults, each behind its switch.
fn planted(source: &str, file: &str, faults: &[Fault]) -> Result<String> {
    let mut places: Vec<(Range<usize>, usize)> = Vec::new();
    for (number, fault) in faults.iter().enumerate().filter(|(_, fault)| fault.file == file) {
        let [place] = &find(source, &fault.was)[..] else {
            bail!("{file} must have this exactly once, for `{}`:\n  {}", fault.name, fault.was);
        };
        places.push((place.clone(), number));
    }
    places.sort_by_key(|(place, _)| place.start);
    let mut text = String::new();
    let mut done = 0;
    for (place, number) in places {
        let Fault { name, is, .. } = &faults[number];
        ensure!(place.start >= done, "{file}: `{name}` is in the midst of another fault");
        let was = &source[place.clone()];
        text += &source[done..place.start];
        text += &format!("(if crate::planted_fault({number}) {{ {is} }} else {{ {was} }})");
        done = place.end;
    }
    text += &source[done..];
    if file == "src/lib.rs" || file.ends_with("/src/lib.rs") {
        text += SWITCHES;
    }
    Ok(text)
}

/// Where a piece of code is in a source, whatever white space is between its words.
fn find(source: &str, code: &str) -> Vec<Range<usize>> {
    let words: Vec<&str> = code.split_whitespace().collect();
    let Some(first) = words.first() else { return Vec::new() };
    let starts = source.match_indices(first).map(|(start, _)| start);
    starts.filter_map(|start| Some(start..end_of(source, start, &words)?)).collect()
}

/// The end of these words, if they stand at this place of a source.
fn end_of(source: &str, start: usize, words: &[&str]) -> Option<usize> {
    let mut at = start;
    for (i, word) in words.iter().enumerate() {
        let rest = &source[at..];
        let behind = if i == 0 { rest } else { rest.trim_start() };
        if i > 0 && behind.len() == rest.len() {
            return None;
        }
        at += rest.len() - behind.strip_prefix(word)?.len();
    }
    Some(at)
}

/// The test binaries that find faults, by name.
fn compile(faults: &[Fault]) -> Result<BTreeMap<String, PathBuf>> {
    let needed: BTreeSet<&str> = faults.iter().filter_map(test_of).map(|test| test.binary.as_str()).collect();
    let mut command = shell::cargo(["test", "--no-run", "--message-format=json", "--features", FEATURES]);
    command.args(PACKAGES.iter().flat_map(|name| ["--package", name])).arg("--lib");
    // Other names are those of crates.
    command
        .args(needed.iter().filter(|name| !name.starts_with("tetralod")).flat_map(|name| ["--test", name]));
    let compiled = shell::root().join(COMPILED);
    command.current_dir(TREE).env("CARGO_TARGET_DIR", compiled).env("CARGO_INCREMENTAL", "0");
    let messages = shell::output(command.stderr(Stdio::inherit()))?;
    let messages = messages.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    Ok(messages.filter_map(|message| program(&message)).collect())
}

fn test_of(fault: &Fault) -> Option<&Test> {
    if let Fate::FoundBy(test) = &fault.fate { Some(test) } else { None }
}

/// The test binary that a message of cargo tells of.
fn program(message: &Value) -> Option<(String, PathBuf)> {
    let path = message["executable"].as_str().filter(|_| message["profile"]["test"] == true)?;
    let target = &message["target"];
    Some((target["name"].as_str()?.to_owned(), path.into()))
}

/// A test that is not started yet, with limited memory.
fn command(programs: &BTreeMap<String, PathBuf>, test: &Test) -> Result<Command> {
    let program = programs.get(&test.binary).with_context(|| format!("no test binary `{}`", test.binary))?;
    let limited = format!("ulimit -v {MEMORY} && exec \"$0\" \"$@\"");
    let mut command = shell::command("sh", ["-c", &limited]);
    command.arg(program).arg(&test.name).current_dir(TREE);
    ["TETRALOD_DATA", "TETRALOD_SEED", SWITCH].iter().for_each(|name| _ = command.env_remove(name));
    Ok(command)
}

/// How long each test takes that finds a fault; all of them pass without any.
fn times_without_faults<'a>(
    programs: &BTreeMap<String, PathBuf>,
    faults: impl Iterator<Item = &'a Fault>,
) -> Result<BTreeMap<Test, Duration>> {
    let mut times = BTreeMap::new();
    let tests: BTreeSet<&Test> = faults.filter_map(test_of).collect();
    println!("{} tests without a fault", tests.len());
    for test in tests {
        let start = Instant::now();
        let said = shell::output(&mut command(programs, test)?)?;
        let time = start.elapsed();
        ensure!(!said.contains("running 0 tests"), "no test of `{}` is called `{}`", test.binary, test.name);
        println!("{:>11.1} s {} {}", time.as_secs_f64(), test.binary, test.name);
        times.insert(test.clone(), time);
    }
    Ok(times)
}

/// How a test ends with a fault, and after how long.
fn run_with_fault(
    programs: &BTreeMap<String, PathBuf>,
    test: &Test,
    number: usize,
    limit: Duration,
) -> Result<(&'static str, Duration)> {
    let mut command = command(programs, test)?;
    command.env(SWITCH, number.to_string()).stdout(Stdio::null()).stderr(Stdio::null());
    let start = Instant::now();
    let mut child = command.spawn().context("cannot start `sh`")?;
    let ending = ending(&mut child, start + limit)?;
    Ok((ending, start.elapsed()))
}

fn ending(child: &mut Child, end: Instant) -> Result<&'static str> {
    while Instant::now() < end {
        if let Some(status) = child.try_wait()? {
            return Ok(if status.success() { "passes" } else { "fails" });
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill()?;
    child.wait()?;
    Ok("lasts")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(was: &str, is: &str) -> Fault {
        let text = |text: &str| text.to_owned();
        let fate = Fate::Survives(text("it is one of a test"));
        Fault { name: text("a fault"), file: text("a.rs"), was: text(was), is: text(is), fate }
    }

    #[test]
    fn the_list_fits_the_sources() {
        let root = shell::root();
        let list = fs::read_to_string(root.join(LIST)).expect("a list");
        let faults = read(&list).expect("a list of faults");
        assert!(faults.len() >= 60, "{} faults", faults.len());
        let names: BTreeSet<&str> = faults.iter().map(|fault| fault.name.as_str()).collect();
        assert_eq!(names.len(), faults.len(), "each has a name of its own");
        for file in faults.iter().map(|fault| &fault.file).collect::<BTreeSet<_>>() {
            let source = fs::read_to_string(root.join(file)).expect(file);
            if let Err(error) = planted(&source, file, &faults) {
                panic!("{LIST}: {error}");
            }
        }
    }

    #[test]
    fn faults_are_planted_behind_switches_whatever_the_white_space() {
        let source = "let a = b\n    < c && d;\nlet e = f;";
        let faults = [fault("b < c", "b <= c"), fault("f", "g")];
        let text = planted(source, "a.rs", &faults).expect("each is there once");
        let [first, second] = ["crate::planted_fault(0)", "crate::planted_fault(1)"];
        assert_eq!(
            text,
            format!(
                "let a = (if {first} {{ b <= c }} else {{ b\n    < c }}) && d;\nlet e = (if {second} {{ g }} else {{ f }});"
            )
        );
        assert_eq!(planted(source, "b.rs", &faults).expect("nothing to plant"), source);
    }

    #[test]
    fn what_is_not_there_once_or_overlaps_is_refused() {
        let source = "a + b + a * c";
        assert!(planted(source, "a.rs", &[fault("d", "0")]).is_err());
        assert!(planted(source, "a.rs", &[fault("a", "0")]).is_err());
        assert!(planted(source, "a.rs", &[fault("a + b", "0"), fault("b + a", "0")]).is_err());
        assert!(planted(source, "a.rs", &[fault("a + b", "0"), fault("a * c", "0")]).is_ok());
    }
}
