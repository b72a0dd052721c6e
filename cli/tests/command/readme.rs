//! Promise: the commands in README.md and in the pages of `docs/` work as they stand there, in that order, and answer
//! with the lines shown there; the manual names every option; links lead somewhere.
//!
//! What README.md shows is compared but for times. Of the other pages values are not: they change with the builder, and are of larger
//! data than a test should take. What is shown is brought up to date by `TETRALOD_UPDATE_README=1 cargo test --release --package tetralod-cli readme`.

use crate::support::{self, Folder, text};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const START: &str = "```console";
pub const PROMPT: &str = "$ tetralod ";

/// The pages with commands. Each is run in a folder of its own.
const PAGES: [&str; 22] = [
    "README.md",
    "docs/README.md",
    "docs/command.md",
    "docs/csp-and-cors.md",
    "docs/howto/big-models.md",
    "docs/howto/build-in-page.md",
    "docs/howto/compare.md",
    "docs/howto/deformed.md",
    "docs/howto/element.md",
    "docs/howto/fields-and-time.md",
    "docs/howto/know-a-file.md",
    "docs/howto/movies.md",
    "docs/howto/my-data.md",
    "docs/howto/one-file.md",
    "docs/howto/parts.md",
    "docs/howto/inspect.md",
    "docs/howto/notebooks.md",
    "docs/howto/python.md",
    "docs/howto/several-meshes.md",
    "docs/howto/three.md",
    "docs/howto/views.md",
    "docs/input.md",
];
/// The pages that are the manual of the command.
const MANUAL: [&str; 4] = ["docs/command.md", "docs/hosting.md", "docs/input.md", "docs/promises.md"];

/// The root of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

pub fn content(page: &str) -> String {
    fs::read_to_string(root().join(page)).unwrap_or_else(|error| panic!("{page}: {error}"))
}

/// `page` with what `run` answers to the commands in its blocks of kind `console` in place of what is shown.
fn answered(page: &str, mut run: impl FnMut(&str) -> Option<String>) -> String {
    // A command without an answer keeps what is shown.
    let (mut fresh, mut inside, mut keeps) = (String::new(), false, false);
    for line in page.lines() {
        if line.starts_with("```") {
            (inside, keeps) = (line == START, false);
        }
        let command = line.strip_prefix(PROMPT).filter(|_| inside);
        if !inside || line == START || command.is_some() || keeps {
            fresh.extend([line, "\n"]);
        }
        if let Some(command) = command {
            let answer = run(command);
            keeps = answer.is_none();
            fresh.extend(answer);
        }
    }
    fresh
}

/// `page` without the times in the answers shown in it, which change with the machine.
fn without_times(page: &str) -> String {
    page.lines().filter(|line| !line.starts_with("time  ")).flat_map(|line| [line, "\n"]).collect()
}

/// `page` with only the first column of the answers shown in it.
fn without_values(page: &str) -> String {
    let mut answer = false;
    let mut names = String::new();
    for line in page.lines() {
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

/// The arguments of a command line, which may be in single quotes.
pub fn arguments(command: &str) -> Vec<&str> {
    let quoted = command.split('\'').enumerate();
    let parts =
        quoted.map(|(i, part)| if i % 2 == 0 { part.split_whitespace().collect() } else { vec![part] });
    parts.flatten().collect()
}

fn run(command: &str, folder: &Path) -> String {
    let mut program = support::command(&arguments(command));
    let output = program.current_dir(folder).output().expect("the command starts");
    assert!(output.status.success(), "{command}: {}", text(&output.stderr));
    text(&output.stdout).to_owned()
}

/// Writes the files that `page` shows, in blocks such as "```json camera.json".
pub fn write_files(page: &str, folder: &Path) {
    // The first piece is the text before the first block; from then on, blocks and texts take turns.
    for block in page.split("\n```").skip(1).step_by(2) {
        let (head, shown) = block.split_once('\n').expect("a block has lines");
        let Some((_language, name)) = head.split_once(' ') else { continue };
        let file = folder.join(name);
        fs::create_dir_all(file.parent().expect("a file is in a folder")).expect("a temporary folder");
        fs::write(file, shown).expect("a file in the temporary folder");
    }
}

fn check_page(page: &str) {
    let shown = content(page);
    let folder = Folder::new(&page.replace('/', "-"));
    let path = PathBuf::from(folder.path(""));
    write_files(&shown, &path);
    let update = std::env::var_os("TETRALOD_UPDATE_README").is_some();
    let whole = page == "README.md";
    // Smaller data will do for the names.
    let size = if update || whole { "--size 33" } else { "--size 9" };
    let fresh = answered(&shown, |command| Some(run(&command.replace("--size 33", size), &path)));
    if update {
        fs::write(root().join(page), fresh).expect("the page can be written");
    } else if whole {
        assert_eq!(without_times(&shown), without_times(&fresh), "{page}");
    } else {
        assert_eq!(without_values(&shown), without_values(&fresh), "{page}");
    }
}

#[test]
fn every_command_works_and_answers_as_shown() {
    let shown: String = PAGES.map(content).concat();
    // The others end with Ctrl-C, or need the page, which the tests' command is without.
    let ends = |command: &&String| !["html", "serve", "view"].contains(&command.as_str());
    for command in commands().iter().filter(ends) {
        let example = format!("\n{PROMPT}{command} ");
        assert!(shown.contains(&example), "no page shows `tetralod {command}`");
    }
    PAGES.iter().for_each(|page| check_page(page));
}

/// The names of the commands, as the program tells them.
fn commands() -> Vec<String> {
    let help = run("--help", &root());
    let (_, listed) = help.split_once("Commands:\n").expect("commands");
    let names = listed.lines().map_while(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

/// What looks like a long option in `text`.
fn options(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for (at, _) in text.match_indices("--") {
        let starts = text[..at].ends_with([' ', '`', '\n', '(', '\'']);
        let name: String =
            text[at + 2..].chars().take_while(|c| c.is_ascii_lowercase() || *c == '-').collect();
        if starts && !name.is_empty() && !name.starts_with('-') {
            found.insert(name);
        }
    }
    found
}

/// `page` without its blocks of kind `sh`, which run other programs.
fn without_other_programs(page: &str) -> String {
    let mut pieces = page.split("\n```sh\n");
    let first = pieces.next().unwrap_or_default();
    let rest = pieces.map(|piece| piece.split_once("\n```").map_or("", |(_, after)| after));
    std::iter::once(first).chain(rest).collect()
}

#[test]
fn the_manual_names_every_option_and_no_other() {
    let mut known = BTreeSet::new();
    for command in commands() {
        let help = run(&format!("{command} --help"), &root());
        let lines = help.lines().map(str::trim).filter(|line| line.starts_with('-'));
        let heads = lines.map(|line| line.split("  ").next().unwrap_or_default());
        known.extend(heads.flat_map(|head| options(&format!(" {head}"))));
    }
    let mut named: BTreeSet<String> =
        MANUAL.iter().flat_map(|page| options(&without_other_programs(&content(page)))).collect();
    // Every command writes its result to `-o`.
    named.insert("output".to_owned());
    assert_eq!(named, known);
}

/// The anchors of a page: its headings as GitHub names them.
fn anchors(page: &str) -> BTreeSet<String> {
    let headings =
        page.lines().filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim());
    let kept = |c: &char| c.is_alphanumeric() || [' ', '-', '_'].contains(c);
    headings
        .map(|heading| heading.to_lowercase().chars().filter(kept).collect::<String>().replace(' ', "-"))
        .collect()
}

/// The targets of the links and pictures of a page, but those on the web.
fn links(page: &str) -> Vec<&str> {
    // The first piece is the text before the first link.
    let targets = page.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    targets.map(|(target, _)| target).filter(|target| !target.contains("://")).collect()
}

/// Every page of the repository.
fn pages() -> Vec<String> {
    let all = files().into_iter().filter(|file| file.ends_with(".md"));
    all.map(|file| file.trim_start_matches('/').to_owned()).collect()
}

#[test]
fn links_lead_somewhere() {
    let pages = pages();
    assert!(pages.iter().any(|page| page == "docs/howto/three.md"));
    for page in &pages {
        let shown = content(page);
        for link in links(&shown) {
            let (file, anchor) =
                link.split_once('#').map_or((link, None), |(file, anchor)| (file, Some(anchor)));
            let folder = root().join(page).parent().expect("a page is in a folder").to_owned();
            let path: PathBuf = if file.is_empty() { root().join(page) } else { folder.join(file) };
            assert!(path.exists(), "{page} links to {link}");
            let there =
                anchor.is_none_or(|anchor| anchors(&fs::read_to_string(&path).unwrap()).contains(anchor));
            assert!(there, "{page} links to {link}: there is no such heading");
        }
    }
}

/// All files of the repository but those that are made, relative to its root.
fn files() -> Vec<String> {
    let (mut folders, mut found) = (vec![PathBuf::new()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(root().join(&folder)).expect("a folder") {
            let entry = entry.expect("an entry");
            let path = folder.join(entry.file_name());
            let made = ["target", "node_modules", "pkg", ".git"].iter().any(|name| path.ends_with(name));
            if entry.path().is_dir() && !made {
                folders.push(path);
            } else if !made {
                found.push(format!("/{}", path.to_string_lossy()));
            }
        }
    }
    found
}

#[test]
fn what_the_readme_links_to_is_in_the_package() {
    let listed = Command::new(env!("CARGO"))
        .args(["package", "--list", "--allow-dirty", "--offline", "--package", "tetralod"])
        .current_dir(root())
        .output()
        .expect("cargo starts");
    assert!(listed.status.success(), "{}", text(&listed.stderr));
    let listed = text(&listed.stdout);
    for link in links(&content("README.md")) {
        let file = link.split('#').next().filter(|file| !file.is_empty()).unwrap_or("README.md");
        assert!(listed.lines().any(|listed| listed == file), "{link} is excluded in Cargo.toml");
    }
}

/// The cells of the row of docs/benchmarks.md that begins with `start`.
fn benchmark(benchmarks: &str, start: &str) -> Vec<String> {
    let row = benchmarks.lines().find(|line| line.starts_with(&format!("| {start} |"))).expect(start);
    row.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()
}

#[test]
fn the_numbers_of_the_readme_are_measured() {
    let (readme, benchmarks) = (content("README.md"), content("docs/benchmarks.md"));
    let file = benchmark(&benchmarks, "bucky 97³, generated, half-edge");
    let kilobytes: f64 = file[1].parse().expect("kilobytes");
    let sent = |request: &str| {
        let row = format!("bucky 97³, generated, half-edge | {request}, 1 %");
        format!("{} %", benchmark(&benchmarks, &row)[4])
    };
    for number in [format!("{:.1} MB", kilobytes / 1000.0), sent("isosurface"), sent("box, middle")] {
        assert!(readme.contains(&format!("**{number}**")), "README.md does not say {number}");
    }
}

#[test]
fn only_answers_are_replaced() {
    let readme =
        "a  b\n$ tetralod no\n```console\n$ tetralod yes\nold  1\n    2\n$ tetralod too\n```\nc  d\n";
    let fresh = answered(readme, |command| Some(format!("{command}  new\n")));
    let expected =
        "a  b\n$ tetralod no\n```console\n$ tetralod yes\nyes  new\n$ tetralod too\ntoo  new\n```\nc  d\n";
    assert_eq!(fresh, expected);
    assert_eq!(answered(readme, |_| None), readme);
    let block = "a  b\n```console\n$ tetralod yes\nold  1\n    2\n```\nc  d\n";
    assert_eq!(without_values(block), "a  b\n```console\n$ tetralod yes\nold\n```\nc  d\n");
    assert_eq!(
        arguments("build a.vti --need 'box=1; error=0' -o b"),
        ["build", "a.vti", "--need", "box=1; error=0", "-o", "b"]
    );
}
