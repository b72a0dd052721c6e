//! Promise: the commands in README.md work as they stand there, in that order, and answer with the lines shown there.
//! Values are not compared: they are those of the release, and times those of a machine.
#![cfg(feature = "cli")]

use std::fs;
use std::path::Path;
use std::process::Command;

/// A command with the names of the lines that it is said to answer with.
#[derive(Debug, PartialEq)]
struct Example {
    arguments: Vec<String>,
    answer: Vec<String>,
}

/// The commands after `$` in blocks of kind `console`. Smaller data will do.
fn examples(readme: &str) -> Vec<Example> {
    let mut examples: Vec<Example> = Vec::new();
    let mut inside = false;
    for line in readme.lines() {
        match line.strip_prefix("$ tetralod ") {
            _ if line.starts_with("```") => inside = line == "```console",
            Some(command) if inside => {
                let command = command.replace("--size 33", "--size 9");
                let arguments = command.split(' ').map(str::to_owned).collect();
                examples.push(Example { arguments, answer: Vec::new() });
            }
            None if inside => examples.last_mut().expect("a command first").answer.extend(name(line)),
            _ => {}
        }
    }
    examples
}

/// The first column of a line of the answer, if it has one.
fn name(line: &str) -> Option<String> {
    let name = line.split("  ").next().unwrap_or_default().trim();
    (!name.is_empty() && !line.starts_with(' ')).then(|| name.to_owned())
}

#[test]
fn every_command_works_and_answers_as_shown() {
    let readme =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).expect("README.md");
    let examples = examples(&readme);
    let shown: Vec<&str> = examples.iter().map(|example| example.arguments[0].as_str()).collect();
    for command in ["generate", "build", "info", "extract", "verify", "bench"] {
        assert!(shown.contains(&command), "README.md shows no `tetralod {command}`");
    }
    let folder = std::env::temp_dir().join(format!("tetralod-readme-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a temporary folder");
    for Example { arguments, answer } in &examples {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tetralod"));
        let output = command.args(arguments).current_dir(&folder).output().expect("the command starts");
        let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{arguments:?}: {err}");
        let names: Vec<String> = out.lines().filter_map(name).collect();
        assert_eq!(&names, answer, "{arguments:?}");
    }
    fs::remove_dir_all(&folder).expect("the folder goes");
}

#[test]
fn examples_are_found_in_console_blocks_alone() {
    let readme = "$ tetralod no\n```console\n$ tetralod info a.mt\nkind    edge\n        more\n  sub   x\nfile size  1\n```\nno\n";
    let arguments = vec!["info".to_owned(), "a.mt".to_owned()];
    assert_eq!(examples(readme), [Example { arguments, answer: vec!["kind".into(), "file size".into()] }]);
}
