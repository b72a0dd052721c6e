//! Promise: the commands in README.md work as they stand there, in that order, and answer with the lines shown there.
//!
//! Values are not compared: they change with the builder, and times with the machine. What is shown is brought up to
//! date by `TETRALOD_UPDATE_README=1 cargo test --release --package tetralod-cli readme`.

use crate::support::{self, text};
use std::fs;
use std::path::Path;

const START: &str = "```console";
const PROMPT: &str = "$ tetralod ";

/// `readme` with what `run` answers to the commands in its blocks of kind `console` in place of what is shown.
fn answered(readme: &str, mut run: impl FnMut(&str) -> String) -> String {
    let (mut fresh, mut inside) = (String::new(), false);
    for line in readme.lines() {
        if line.starts_with("```") {
            inside = line == START;
        }
        let command = line.strip_prefix(PROMPT).filter(|_| inside);
        if !inside || line == START || command.is_some() {
            fresh.extend([line, "\n"]);
        }
        fresh.extend(command.map(&mut run));
    }
    fresh
}

/// `readme` with only the first column of the answers shown in it.
fn without_values(readme: &str) -> String {
    let mut answer = false;
    let mut names = String::new();
    for line in readme.lines() {
        answer = line.starts_with(PROMPT) || answer && !line.starts_with("```");
        match line.split_once("  ") {
            // The rest of the row before.
            Some(("", _)) if answer => {}
            Some((name, _)) if answer => names.extend([name, "\n"]),
            _ => names.extend([line, "\n"]),
        }
    }
    names
}

fn run(command: &str, folder: &Path) -> String {
    let mut program = support::command(&command.split(' ').collect::<Vec<_>>());
    let output = program.current_dir(folder).output().expect("the command starts");
    assert!(output.status.success(), "{command}: {}", text(&output.stderr));
    text(&output.stdout).to_owned()
}

#[test]
fn every_command_works_and_answers_as_shown() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
    let readme = fs::read_to_string(&path).expect("README.md");
    for command in ["generate", "build", "convert", "info", "extract", "verify", "bench"] {
        let example = format!("\n{PROMPT}{command} ");
        assert!(readme.contains(&example), "README.md shows no `tetralod {command}`");
    }
    let folder = std::env::temp_dir().join(format!("tetralod-readme-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a temporary folder");
    let update = std::env::var_os("TETRALOD_UPDATE_README").is_some();
    // Smaller data will do for the names.
    let size = if update { "--size 33" } else { "--size 9" };
    let fresh = answered(&readme, |command| run(&command.replace("--size 33", size), &folder));
    fs::remove_dir_all(&folder).expect("the folder goes");
    if update {
        fs::write(&path, fresh).expect("README.md can be written");
    } else {
        assert_eq!(without_values(&readme), without_values(&fresh));
    }
}

#[test]
fn only_answers_are_replaced() {
    let readme =
        "a  b\n$ tetralod no\n```console\n$ tetralod yes\nold  1\n    2\n$ tetralod too\n```\nc  d\n";
    let fresh = answered(readme, |command| format!("{command}  new\n"));
    let expected =
        "a  b\n$ tetralod no\n```console\n$ tetralod yes\nyes  new\n$ tetralod too\ntoo  new\n```\nc  d\n";
    assert_eq!(fresh, expected);
    let block = "a  b\n```console\n$ tetralod yes\nold  1\n    2\n```\nc  d\n";
    assert_eq!(without_values(block), "a  b\n```console\n$ tetralod yes\nold\n```\nc  d\n");
}
