//! Who may import whom: the table of ARCHITECTURE.md, held against the sources.
//!
//! Modules import each other as `use crate::module::...`, one module a line, so that a glance at a file's head, and
//! this test, can tell what it knows.

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

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut folders = vec![root.clone()];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let inside = path.strip_prefix(&root).unwrap();
                let first = inside.components().next().unwrap().as_os_str().to_string_lossy();
                let module = first.trim_end_matches(".rs").to_owned();
                let code = without_comments(&fs::read_to_string(&path).unwrap());
                found.push(Source { module, path, code });
            }
        }
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
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
