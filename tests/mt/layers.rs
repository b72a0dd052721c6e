//! Who may import whom: the tables of ARCHITECTURE.md, held against the sources.
//!
//! Modules import each other as `use crate::module::...`, one module a line, so that a glance at a file's head, and
//! this test, can tell what it knows. Which crate knows which, the compiler says; here only that the page says it, too.

use crate::imports::{Files, Module, circles};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Libraries of the edges, and where in the packages' sources they may appear.
const EDGES: [(&str, &[&str]); 11] = [
    ("wgpu", &["crates/render/src/gpu", "crates/web-viewer/src"]),
    ("bytemuck", &["crates/render/src/gpu"]),
    ("wasm_bindgen", &WEB),
    ("js_sys", &WEB),
    ("web_sys", &WEB),
    ("serde_wasm_bindgen", &WEB),
    ("std::fs", &["crates/io/src", "cli/src", "python/src", "src/stream/http"]),
    ("ureq", &["src/stream/http"]),
    ("rayon", &["src/threads.rs", "cli/src"]),
    // Clocks.
    ("Instant", &["cli/src", "python/src", "src/stream/http"]),
    ("SystemTime", &["cli/src", "src/stream/http"]),
];

const WEB: [&str; 6] = [
    "crates/web/src",
    "crates/web-options/src",
    "crates/web-core/src",
    "crates/web-viewer/src",
    "crates/web-build/src",
    "crates/web-bench/src",
];

/// Modules of the core that know no other, which all may import.
const FOR_ALL: [&str; 2] = ["coded", "Coded"];

/// What the project's own programs use is their own business.
const PROGRAMS: [&str; 3] = ["paper", "xtask", "xtask/wasm-test-runner"];

/// A source file of a package: its path from the root, its text without comments.
struct Source {
    path: String,
    code: String,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn page(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The folders of the packages of the workspace, from its root.
fn packages() -> Vec<String> {
    let crates = fs::read_dir(root().join("crates")).unwrap();
    let crates = crates.map(|entry| format!("crates/{}", entry.unwrap().file_name().to_string_lossy()));
    let mut packages: Vec<String> = crates.chain(PROGRAMS.map(str::to_owned)).collect();
    packages.extend([String::new(), "cli".to_owned(), "python".to_owned()]);
    packages.sort();
    packages
}

fn sources_of(package: &str) -> PathBuf {
    root().join(package).join("src")
}

/// The sources in a folder and those in it, in order.
fn source_paths(folder: &Path) -> Vec<PathBuf> {
    let mut folders = vec![folder.to_owned()];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

fn sources(package: &str) -> Vec<Source> {
    let source = |path: PathBuf| {
        let code = without_comments(&fs::read_to_string(&path).unwrap());
        let words = path.strip_prefix(root()).unwrap().iter().map(|word| word.to_string_lossy());
        Source { path: words.collect::<Vec<_>>().join("/"), code }
    };
    source_paths(&sources_of(package)).into_iter().map(source).collect()
}

/// The module of a file in the sources of a package: empty for the root of its crate.
fn module_of(file: &Path) -> Module {
    let words = file.with_extension("");
    let mut module: Module = words.iter().map(|word| word.to_string_lossy().into_owned()).collect();
    let is_root = module.len() == 1 && ["lib", "main"].contains(&module[0].as_str());
    if is_root || module.last().is_some_and(|last| last == "mod") {
        module.pop();
    }
    module
}

/// Doc links may name anything, code may not.
fn without_comments(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// The rows of the table below a heading of a page, as cells.
fn table(page: &str, heading: &str) -> Vec<Vec<String>> {
    let below = page.split_once(&format!("\n## {heading}\n")).map(|(_, below)| below);
    let below = below.unwrap_or_else(|| panic!("no heading `{heading}`"));
    let section = below.split("\n## ").next().unwrap_or_default();
    let cells = |row: &str| {
        row.trim().trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>()
    };
    let rows: Vec<_> = section.lines().filter(|line| line.starts_with('|')).skip(2).map(cells).collect();
    assert!(!rows.is_empty(), "no table below `{heading}`");
    rows
}

/// What stands between the first two backticks.
fn quoted(cell: &str) -> String {
    cell.split('`').nth(1).unwrap_or_else(|| panic!("no name in `{cell}`")).to_owned()
}

fn listed(cell: &str) -> BTreeSet<String> {
    cell.split(", ").filter(|word| !word.is_empty()).map(str::to_owned).collect()
}

/// Each module of the core with what it may import besides itself.
fn layers() -> BTreeMap<String, BTreeSet<String>> {
    let rows = table(&page("ARCHITECTURE.md"), "Modules of the core");
    rows.iter().map(|row| (quoted(&row[0]), listed(&row[2]))).collect()
}

/// Whether a word, or a path of words, stands in `code`.
fn mentions(code: &str, word: &str) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    code.match_indices(word)
        .any(|(at, _)| !code[..at].ends_with(is_part) && !code[at + word.len()..].starts_with(is_part))
}

/// The words that follow `crate::` in `code`; `{` where a brace does.
fn imports(code: &str) -> BTreeSet<String> {
    code.match_indices("crate::")
        // `$crate::` is a macro's way to say the same; `my_crate::` is something else.
        .filter(|(at, _)| !code[..*at].ends_with(|c: char| c.is_alphanumeric() || c == '_'))
        .map(|(at, found)| &code[at + found.len()..])
        .map(|rest| match rest.find(|c: char| !c.is_alphanumeric() && c != '_') {
            Some(0) => rest[..1].to_owned(),
            Some(end) => rest[..end].to_owned(),
            None => rest.to_owned(),
        })
        .collect()
}

fn violations(layers: &BTreeMap<String, BTreeSet<String>>, module: &str, code: &str) -> Vec<String> {
    let Some(allowed) = layers.get(module) else {
        return vec![format!("module `{module}` is not in the table")];
    };
    let forbidden = imports(code)
        .into_iter()
        .filter(|name| name != module && !allowed.contains(name) && !FOR_ALL.contains(&name.as_str()));
    forbidden.map(|name| format!("`{module}` may not import `{name}`")).collect()
}

#[test]
fn modules_of_the_core_import_only_what_is_below_them() {
    let (layers, mut seen, mut wrong) = (layers(), BTreeSet::new(), Vec::new());
    for Source { path, code } in sources("").iter().filter(|source| source.path != "src/lib.rs") {
        let module = path.split('/').nth(1).unwrap().trim_end_matches(".rs");
        wrong.extend(violations(&layers, module, code).into_iter().map(|what| format!("{path}: {what}")));
        seen.insert(module.to_owned());
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
    assert_eq!(seen, layers.keys().cloned().collect(), "the table has other modules than `src`");
}

/// The crates of the project that a package depends on, but for its tests.
fn dependencies(manifest: &str) -> BTreeSet<String> {
    let mut is_inside = false;
    let mut found = BTreeSet::new();
    for line in manifest.lines() {
        if line.starts_with('[') {
            is_inside = line.ends_with("dependencies]") && !line.ends_with("dev-dependencies]");
        } else if is_inside && line.starts_with("tetralod") {
            found.extend(line.split(['.', ' ', '=']).next().map(str::to_owned));
        }
    }
    found
}

#[test]
fn crates_use_those_of_the_table() {
    let mut in_table = BTreeSet::new();
    for row in table(&page("ARCHITECTURE.md"), "Crates") {
        let (name, folder) =
            (quoted(&row[0]), row[0].split('`').nth(3).unwrap().trim_end_matches('/').to_owned());
        let package = if folder == "src" { String::new() } else { folder };
        let path = Path::new(&package).join("Cargo.toml");
        let manifest = page(&path.to_string_lossy());
        assert!(manifest.contains(&format!("\nname = \"{name}\"\n")), "{} is not {name}", path.display());
        let uses = listed(row[2].split(':').next().unwrap_or_default());
        let full =
            |short: String| if short == "core" { "tetralod".to_owned() } else { format!("tetralod-{short}") };
        let uses: BTreeSet<String> = uses.into_iter().filter(|short| short != "no other").map(full).collect();
        // The dependencies of the workspace are no package's.
        let own = manifest.split("\n[package]\n").last().unwrap_or_default();
        assert_eq!(dependencies(own), uses, "{name} uses others than the table says");
        in_table.insert(package);
    }
    assert_eq!(in_table, packages().into_iter().collect(), "the table has other crates than the workspace");
}

#[test]
fn libraries_of_the_edges_stay_at_the_edges() {
    let packages = packages();
    let mut used = BTreeSet::new();
    for package in packages.iter().filter(|package| !PROGRAMS.contains(&package.as_str())) {
        // Files of tests alone use what they like.
        for Source { path, code } in
            sources(package).iter().filter(|source| !source.path.ends_with("/tests.rs"))
        {
            for (library, places) in EDGES.iter().filter(|(library, _)| mentions(code, library)) {
                assert!(places.iter().any(|place| path.starts_with(place)), "{path}: {library}");
                used.insert(*library);
            }
        }
    }
    assert_eq!(used, EDGES.iter().map(|(library, _)| *library).collect(), "which are gone?");
}

#[test]
fn wrong_imports_would_be_found() {
    let layers = layers();
    let violations = |module, code| violations(&layers, module, code);
    assert_eq!(violations("geom", "use crate::mesh::FACES;"), ["`geom` may not import `mesh`"]);
    assert_eq!(violations("view", "let x = crate::mt::MtKind::Edge;"), ["`view` may not import `mt`"]);
    assert_eq!(violations("view", "use crate::{geom, mesh};"), ["`view` may not import `{`"]);
    assert_eq!(violations("news", ""), ["module `news` is not in the table"]);
    assert!(violations("mt", "use crate::mt::X;\nuse crate::geom::Y;\nuse my_crate::view;").is_empty());
    assert!(without_comments("//! [`crate::view`]\nlet a = 1; // crate::session").trim() == "let a = 1;");
    assert!(mentions("use wgpu::Device;", "wgpu") && mentions("use std::fs;", "std::fs"));
    assert!(!mentions("let wgpu_error = 1;", "wgpu") && !mentions("Instants", "Instant"));
    let manifest =
        "[dependencies]\ntetralod.workspace = true\nglam = \"1\"\ntetralod-io = { path = \"io\" }\n";
    let dev = "[dev-dependencies]\ntetralod-build = { path = \"build\" }\n";
    assert_eq!(dependencies(&format!("{manifest}{dev}")), listed("tetralod, tetralod-io"));
}

/// Endings of files that pages name.
const ENDINGS: [&str; 8] = [".rs", ".js", ".mjs", ".ts", ".wgsl", ".md", ".json", ".toml"];

/// What stands between backticks in a page and looks like a file or a folder, but for what a reader has to name, and what is made.
fn named_files(page: &str) -> Vec<&str> {
    // The first piece is the text before the first backtick; from then on, pieces between two backticks and texts take turns.
    let quoted = page.split('`').skip(1).step_by(2).filter(|name| !name.contains(char::is_whitespace));
    quoted
        .filter(|name| name.ends_with('/') || ENDINGS.iter().any(|ending| name.ends_with(ending)))
        .filter(|name| !name.contains("NAME") && !["pkg/", "dist/"].contains(name) && !name.starts_with('.'))
        .collect()
}

#[test]
fn files_that_are_named_to_developers_exist() {
    for name in ["ARCHITECTURE.md", "CONTRIBUTING.md"] {
        let text = page(name);
        let named = named_files(&text);
        assert!(named.len() > 20, "{name} names {named:?}");
        let missing: Vec<_> = named.into_iter().filter(|file| !root().join(file).exists()).collect();
        assert!(missing.is_empty(), "{name} names files that are not there, from the root: {missing:?}");
    }
    assert_eq!(
        named_files("`a/b.rs` `cargo x` `c/` b `d.NAME.js` `pkg/`\n```text\nx.rs\n```\n`e.md`"),
        ["a/b.rs", "c/", "e.md"]
    );
}

#[test]
fn architecture_fits_on_a_page() {
    assert!(page("ARCHITECTURE.md").lines().count() <= 150);
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let mut found = Vec::new();
    for package in packages() {
        let folder = sources_of(&package);
        let read = |path: PathBuf| {
            (module_of(path.strip_prefix(&folder).unwrap()), fs::read_to_string(&path).unwrap())
        };
        let imports = Files::read(source_paths(&folder).into_iter().map(read)).imports();
        found.extend(circles(&imports).into_iter().map(|circle| format!("{}: {circle}", folder.display())));
    }
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

/// The circles of a crate with these files.
fn planted(files: &[(&str, &str)]) -> Vec<String> {
    let sources = files.iter().map(|(path, text)| (module_of(Path::new(path)), (*text).to_owned()));
    circles(&Files::read(sources).imports())
}

#[test]
fn circles_would_be_found() {
    let root = ("lib.rs", "mod a;\nmod b;\npub use a::A;\npub use b::B;");
    let (a, b) = (("a.rs", "pub struct A;"), ("b.rs", "use crate::a::A;\npub struct B(A);"));
    assert!(planted(&[root, a, b]).is_empty());
    let circle = "a, b:\n  a imports b by ";
    let back = "\n  b imports a by crate::a::A";
    // By its file, by a re-export, by a path in the code, by a module, in braces, under another name.
    for (by, text) in [
        ("crate::b::B", "use crate::b::B;\npub struct A(B);"),
        ("super::B", "use super::B;\npub struct A(B);"),
        ("super::b::B", "pub struct A(super::b::B);"),
        ("b::B", "use super::b;\npub struct A(b::B);"),
        ("crate::b::B", "use {crate::b::{self, B as Other}, std::fs};\npub struct A(Other);"),
    ] {
        assert_eq!(planted(&[root, ("a.rs", text), b]), [format!("{circle}{by}{back}")], "{text}");
    }
    // Files with tests, comments, strings, and other things of these names.
    for text in [
        "pub struct A;\n#[cfg(test)]\nmod tests {\n    use crate::b::B;\n}",
        "pub struct A;\n#[cfg(test)]\nuse crate::b::B;",
        "/// See [`B`](crate::b::B).\npub struct A; // crate::b::B /* crate::b::B */",
        "pub struct A;\nconst C: (&str, &str, char) = (\"crate::b::B \\\"\", r#\"crate::b::B\"#, '\\'');",
        "use std::b::B;\npub struct A<'b>(&'b b::B);",
    ] {
        assert!(planted(&[root, ("a.rs", text), b]).is_empty(), "{text}");
    }
    // A parent that uses its child, which uses what the parent defines, or re-exports and uses.
    let child = ("a/b.rs", "pub fn b(_: super::A) {}");
    let found = "a, a::b:\n  a imports a::b by b::b\n  a::b imports a by super::A";
    assert_eq!(
        planted(&[
            ("lib.rs", "mod a;"),
            ("a/mod.rs", "mod b;\npub struct A;\nfn f() {\n    b::b(A)\n}"),
            child
        ]),
        [found]
    );
    assert_eq!(
        planted(&[
            ("lib.rs", "mod a;"),
            ("a.rs", "mod b;\npub use b::b;\npub struct A;\nfn f() {\n    b(A)\n}"),
            child
        ]),
        [found]
    );
    assert!(
        planted(&[("lib.rs", "mod a;"), ("a.rs", "mod b;\npub(crate) use b::b;\npub struct A;"), child])
            .is_empty()
    );
    // Of three files each imports the next.
    let three = [
        ("main.rs", "mod a;\nmod b;\nmod c;"),
        ("a.rs", "use crate::b::B;\npub fn a(_: B) {}"),
        ("b.rs", "pub type B = crate::c::C;"),
        ("c.rs", "pub type C = fn();\nfn c() {\n    crate::a::a(c)\n}"),
    ];
    assert!(planted(&three)[0].starts_with("a, b, c:"));
}
