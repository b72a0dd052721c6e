//! Who may import whom: the table of ARCHITECTURE.md, held against the sources.
//!
//! Modules import each other as `use crate::module::...`, one module a line, so that a glance at a file's head, and
//! this test, can tell what it knows.

use crate::imports::{Files, Module, circles};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Each module with what it may import besides itself.
const LAYERS: [(&str, &[&str]); 20] = [
    ("threads", &[]),
    ("geom", &[]),
    ("mesh", &["geom", "threads"]),
    ("mt", &["geom", "mesh", "threads"]),
    ("generate", &["geom", "mesh"]),
    ("io", &["geom", "mesh"]),
    ("builder", &["geom", "mesh", "mt", "threads"]),
    ("format", &["geom", "mesh", "mt", "threads"]),
    ("refine", &["geom", "mesh", "mt"]),
    ("measure", &["geom", "mesh", "mt"]),
    ("verify", &["geom", "mesh", "mt", "refine", "session", "view"]),
    ("view", &["geom", "mesh"]),
    ("stream", &[]),
    ("session", &["geom", "mesh", "mt", "format", "refine", "view"]),
    ("remote", &["format", "refine", "session", "stream"]),
    ("client", &["format", "refine", "remote", "session", "stream"]),
    ("bench", &["geom", "format", "mt", "refine", "session"]),
    ("gpu", &["geom", "mesh", "view"]),
    ("scene", &["geom", "mt", "session", "view", "gpu"]),
    (
        "web",
        &[
            "geom", "mesh", "mt", "format", "refine", "view", "session", "stream", "remote", "bench", "gpu",
            "scene", "io", "builder",
        ],
    ),
];

/// Libraries of the edges, and the modules that they may appear in.
const EDGES: [(&str, &[&str]); 8] = [
    ("wgpu", &["gpu", "web"]),
    ("bytemuck", &["gpu"]),
    ("wasm_bindgen", &["web"]),
    ("js_sys", &["web"]),
    ("web_sys", &["web"]),
    ("serde_wasm_bindgen", &["web"]),
    ("std::fs", &["io", "stream"]),
    ("ureq", &["stream"]),
];

/// A source file: the module it belongs to, its path, its text without comments.
struct Source {
    module: String,
    path: PathBuf,
    code: String,
}

/// The sources in a folder and those in it, in order.
fn source_paths(root: &Path) -> Vec<PathBuf> {
    let mut folders = vec![root.to_owned()];
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

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let source = |path: PathBuf| {
        let inside = path.strip_prefix(&root).unwrap();
        let first = inside.components().next().unwrap().as_os_str().to_string_lossy();
        let module = first.trim_end_matches(".rs").to_owned();
        let code = without_comments(&fs::read_to_string(&path).unwrap());
        Source { module, path, code }
    };
    source_paths(&root).into_iter().map(source).collect()
}

/// The folders with the sources of each package of the workspace.
fn packages() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let inner = fs::read_dir(root.join("crates")).into_iter().flatten().map(|entry| entry.unwrap().path());
    let packages = ["", "cli", "paper", "xtask"].map(|name| root.join(name)).into_iter().chain(inner);
    packages.map(|package| package.join("src")).filter(|sources| sources.is_dir()).collect()
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

fn violations(module: &str, code: &str) -> Vec<String> {
    let allowed = LAYERS.iter().find(|(name, _)| *name == module).map(|(_, allowed)| *allowed);
    let Some(allowed) = allowed else { return vec![format!("module `{module}` is not in the table")] };
    let forbidden =
        imports(code).into_iter().filter(|name| name != module && !allowed.contains(&name.as_str()));
    forbidden.map(|name| format!("`{module}` may not import `{name}`")).collect()
}

#[test]
fn modules_import_only_what_is_below_them() {
    let sources = sources();
    let mut wrong = Vec::new();
    for Source { module, path, code } in sources.iter().filter(|s| s.module != "lib") {
        wrong.extend(violations(module, code).into_iter().map(|what| format!("{}: {what}", path.display())));
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
    for module in ["geom", "mesh", "mt", "format", "refine", "view", "session", "gpu"] {
        assert!(
            sources.iter().any(|s| s.module == module),
            "`{module}` has no sources: has it been renamed?"
        );
    }
}

#[test]
fn libraries_of_the_edges_stay_at_the_edges() {
    for Source { module, path, code } in &sources() {
        for (library, places) in EDGES {
            let used = code.contains(&format!("{library}::")) || code.contains(&format!("use {library}"));
            assert!(
                !used || places.contains(&module.as_str()),
                "{}: {library} in `{module}`",
                path.display()
            );
        }
    }
}

#[test]
fn wrong_imports_would_be_found() {
    assert_eq!(violations("geom", "use crate::mesh::FACES;"), ["`geom` may not import `mesh`"]);
    assert_eq!(violations("view", "let x = crate::mt::MtKind::Edge;"), ["`view` may not import `mt`"]);
    assert_eq!(violations("view", "use crate::{geom, mesh};"), ["`view` may not import `{`"]);
    assert_eq!(violations("news", ""), ["module `news` is not in the table"]);
    assert!(violations("mt", "use crate::mt::X;\nuse crate::geom::Y;\nuse my_crate::gpu;").is_empty());
    assert!(without_comments("//! [`crate::gpu`]\nlet a = 1; // crate::web").trim() == "let a = 1;");
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let packages = packages();
    assert!(packages.len() >= 4, "where are the packages? {packages:?}");
    let mut found = Vec::new();
    for package in packages {
        let read = |path: PathBuf| {
            (module_of(path.strip_prefix(&package).unwrap()), fs::read_to_string(&path).unwrap())
        };
        let imports = Files::read(source_paths(&package).into_iter().map(read)).imports();
        found.extend(circles(&imports).into_iter().map(|circle| format!("{}: {circle}", package.display())));
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
