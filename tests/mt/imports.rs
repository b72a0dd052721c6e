//! Who imports whom, file by file, as far as the text of sources says: for the test that no files import each other in a circle.
//!
//! A file imports the file in which an item is defined that it names, by `use` or by a path in its code; re-exports are followed to the
//! definition. What it only re-exports it does not import, and what stands in tests does not count.

use std::collections::{BTreeMap, BTreeSet};

/// A file by its module's path from the root of its crate, which is empty for `lib.rs` and `main.rs`.
pub type Module = Vec<String>;

/// The modules that each module imports, and by which paths.
pub type Imports = BTreeMap<Module, BTreeMap<Module, BTreeSet<String>>>;

/// An item that a file has by `use`: its path as it is written, and its name in the file.
struct Use {
    path: Vec<String>,
    name: String,
    is_exported: bool,
}

#[derive(Default)]
struct File {
    /// Modules in files of their own.
    children: BTreeSet<String>,
    definitions: BTreeSet<String>,
    uses: Vec<Use>,
    /// Paths of several words in the code beside `use`.
    paths: BTreeSet<Vec<String>>,
    /// Words that may be names of items.
    words: BTreeSet<String>,
}

/// The files of a crate.
pub struct Files(BTreeMap<Module, File>);

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Words, `::`, and single marks; without comments, strings, characters and white space.
fn tokens(text: &str) -> Vec<String> {
    let (mut rest, mut found) = (text, Vec::new());
    while let Some(first) = rest.chars().next() {
        let (len, counts) = if let Some(len) = left_out(rest) {
            (len, false)
        } else if is_word(first) {
            (rest.find(|c| !is_word(c)).unwrap_or(rest.len()), true)
        } else if rest.starts_with("::") {
            (2, true)
        } else {
            (first.len_utf8(), !first.is_whitespace())
        };
        found.extend(counts.then(|| rest[..len].to_owned()));
        rest = &rest[len..];
    }
    found
}

/// The length of a comment, string or character that a text begins with.
fn left_out(text: &str) -> Option<usize> {
    let until =
        |from: usize, end: &str| text[from..].find(end).map_or(text.len(), |at| from + at + end.len());
    if text.starts_with("//") {
        return Some(until(2, "\n"));
    }
    if text.starts_with("/*") {
        return Some(until(2, "*/"));
    }
    if let Some(raw) = text.strip_prefix("br").or(text.strip_prefix('r')) {
        let string = raw.trim_start_matches('#');
        let end = format!("\"{}", "#".repeat(raw.len() - string.len()));
        return string.starts_with('"').then(|| until(text.len() - string.len() + 1, &end));
    }
    match text.as_bytes() {
        [b'"', ..] => {
            let mut escaped = false;
            let ends = |c: char| {
                let is_end = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                is_end
            };
            Some(text[1..].find(ends).map_or(text.len(), |at| at + 2))
        }
        [b'\'', b'\\', ..] => Some(until(3, "'")),
        // Else it is a lifetime.
        [b'\'', ..] => {
            let len = 1 + text[1..].chars().next().map_or(0, char::len_utf8);
            text[len..].starts_with('\'').then_some(len + 1)
        }
        _ => None,
    }
}

/// Where the item ends that begins at `at`.
fn item_end(tokens: &[String], at: usize) -> usize {
    let mut depth = 0_usize;
    for (i, token) in tokens.iter().enumerate().skip(at) {
        match token.as_str() {
            "{" | "(" | "[" => depth += 1,
            "}" | ")" | "]" if depth == 0 => return i,
            "}" | ")" | "]" => {
                depth -= 1;
                if depth == 0 && token == "}" {
                    return i + 1;
                }
            }
            ";" | "," if depth == 0 => return i + 1,
            _ => {}
        }
    }
    tokens.len()
}

/// The tokens without items that only tests have.
fn without_tests(tokens: &[String]) -> Vec<String> {
    let (mut at, mut kept) = (0, Vec::new());
    let begins = |at: usize, mark: &str| {
        mark.split(' ').eq(tokens[at..].iter().map(String::as_str).take(mark.split(' ').count()))
    };
    while at < tokens.len() {
        if begins(at, "# [ cfg ( test") || begins(at, "# [ cfg ( all ( test") {
            let end = at + tokens[at..].iter().position(|token| token == "]").unwrap_or(0) + 1;
            at = item_end(tokens, end);
        } else {
            kept.push(tokens[at].clone());
            at += 1;
        }
    }
    kept
}

/// Appends the items of a tree of `use`, which begins at `at`; returns where it ends.
fn read_tree(
    tokens: &[String],
    mut at: usize,
    before: &[String],
    found: &mut Vec<(Vec<String>, String)>,
) -> usize {
    if tokens[at] == "{" {
        at += 1;
        while tokens[at] != "}" {
            at = if tokens[at] == "," { at + 1 } else { read_tree(tokens, at, before, found) };
        }
        return at + 1;
    }
    let word = tokens[at].clone();
    at += 1;
    if tokens[at] == "::" {
        return read_tree(tokens, at + 1, &[before, &[word]].concat(), found);
    }
    let path = if word == "self" { before.to_vec() } else { [before, &[word]].concat() };
    let mut name = path.last().cloned().unwrap_or_default();
    if tokens[at] == "as" {
        name.clone_from(&tokens[at + 1]);
        at += 2;
    }
    found.push((path, name));
    at
}

impl File {
    fn read(text: &str) -> Self {
        let tokens = without_tests(&tokens(text));
        let (mut file, mut at, mut code) = (Self::default(), 0, Vec::new());
        while at < tokens.len() {
            let next = tokens.get(at + 1).map_or("", String::as_str);
            if tokens[at] == "use" && next != "<" {
                let mut found = Vec::new();
                // A leading `::` is of another crate.
                let start = at + 1 + usize::from(next == "::");
                let is_exported = matches!(code.last().map(String::as_str), Some("pub" | ")"));
                at = read_tree(&tokens, start, &[], &mut found);
                file.uses.extend(found.into_iter().map(|(path, name)| Use { path, name, is_exported }));
            } else if tokens[at] == "mod" && tokens.get(at + 2).is_some_and(|token| token == ";") {
                file.children.insert(next.to_owned());
                at += 3;
            } else {
                code.push(tokens[at].clone());
                at += 1;
            }
        }
        file.read_code(&code);
        file
    }

    fn read_code(&mut self, code: &[String]) {
        const DEFINE: [&str; 8] = ["fn", "struct", "enum", "trait", "type", "const", "static", "union"];
        let is_name = |at: usize| {
            code.get(at).is_some_and(|token| token.starts_with(|c| is_word(c) && !c.is_numeric()))
        };
        let is =
            |at: Option<usize>, what: &str| at.and_then(|at| code.get(at)).is_some_and(|token| token == what);
        for at in (0..code.len()).filter(|&at| is_name(at)) {
            let before = at.checked_sub(1);
            let is_macro = is(before, "!") && is(at.checked_sub(2), "macro_rules");
            if is_macro || before.is_some_and(|before| DEFINE.contains(&code[before].as_str())) {
                self.definitions.insert(code[at].clone());
            }
            if is(before, "::") {
                continue;
            }
            if !is(before, ".") && !is(Some(at + 1), ":") {
                self.words.insert(code[at].clone());
            }
            let more = (at..)
                .step_by(2)
                .skip(1)
                .take_while(|&i| code.get(i - 1).is_some_and(|t| t == "::") && is_name(i));
            let path: Vec<String> = [at].into_iter().chain(more).map(|i| code[i].clone()).collect();
            if path.len() > 1 {
                self.paths.insert(path);
            }
        }
    }
}

impl Files {
    /// Of a crate, given its modules with their texts.
    pub fn read(sources: impl IntoIterator<Item = (Module, String)>) -> Self {
        Self(sources.into_iter().map(|(module, text)| (module, File::read(&text))).collect())
    }

    /// A path in a module from the root of the crate; none if it leads out of the crate.
    fn absolute(&self, module: &Module, path: &[String]) -> Option<Module> {
        let (first, rest) = path.split_first()?;
        let file = &self.0[module];
        match first.as_str() {
            "crate" => Some(rest.to_vec()),
            "self" => Some([module, rest].concat()),
            "super" => {
                let above = rest.iter().take_while(|word| *word == "super").count();
                let kept = module.len().checked_sub(1 + above)?;
                Some([&module[..kept], &rest[above..]].concat())
            }
            _ if file.children.contains(first) => Some([module, path].concat()),
            _ => {
                let from =
                    file.uses.iter().find(|item| item.name == *first && item.path.first() != Some(first))?;
                Some([self.absolute(module, &from.path)?, rest.to_vec()].concat())
            }
        }
    }

    /// The module in which the item of a path is defined; none for a module itself, and for what is of another crate.
    fn definer(&self, path: &[String], steps: u32) -> Option<Module> {
        let mut module = Module::new();
        for (i, word) in path.iter().enumerate() {
            let (file, rest) = (&self.0[&module], &path[i + 1..]);
            let inner = [module.as_slice(), std::slice::from_ref(word)].concat();
            let is_module = file.children.contains(word) && self.0.contains_key(&inner);
            if is_module && !rest.is_empty() {
                module = inner;
                continue;
            }
            if word == "*" || file.definitions.contains(word) || steps == 0 {
                return Some(module);
            }
            if let Some(item) = file.uses.iter().find(|item| item.name == *word) {
                let from = self.absolute(&module, &item.path)?;
                return self.definer(&[from.as_slice(), rest].concat(), steps - 1);
            }
            return (!is_module).then_some(module);
        }
        None
    }

    /// Who imports whom.
    pub fn imports(&self) -> Imports {
        let of = |(module, file): (&Module, &File)| {
            let used = file.uses.iter().filter(|item| !item.is_exported || file.words.contains(&item.name));
            let mut imports = BTreeMap::<Module, BTreeSet<String>>::new();
            for path in used.map(|item| &item.path).chain(&file.paths) {
                let absolute = self.absolute(module, path);
                let from = absolute.and_then(|path| self.definer(&path, 16)).filter(|from| from != module);
                if let Some(from) = from {
                    imports.entry(from).or_default().insert(path.join("::"));
                }
            }
            (module.clone(), imports)
        };
        self.0.iter().map(of).collect()
    }
}

/// All that a module imports, and what that imports, and so on.
fn reached<'a>(imports: &'a Imports, from: &'a Module) -> BTreeSet<&'a Module> {
    let (mut found, mut next) = (BTreeSet::new(), vec![from]);
    while let Some(module) = next.pop() {
        next.extend(imports.get(module).into_iter().flat_map(BTreeMap::keys).filter(|m| found.insert(*m)));
    }
    found
}

/// Each circle: the modules that import each other, with what they import in it.
pub fn circles(imports: &Imports) -> Vec<String> {
    let reached: BTreeMap<&Module, BTreeSet<&Module>> =
        imports.keys().map(|m| (m, reached(imports, m))).collect();
    let mut circles = BTreeSet::new();
    for (&module, far) in reached.iter().filter(|(module, far)| far.contains(*module)) {
        circles
            .insert(far.iter().copied().filter(|other| reached[other].contains(module)).collect::<Vec<_>>());
    }
    let name = |module: &Module| if module.is_empty() { "the root".to_owned() } else { module.join("::") };
    let line = |circle: &[&Module], from: &Module, (to, by): (&Module, &BTreeSet<String>)| {
        let by = by.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
        circle.contains(&to).then(|| format!("\n  {} imports {} by {by}", name(from), name(to)))
    };
    let told = |circle: Vec<&Module>| {
        let lines =
            circle.iter().flat_map(|from| imports[*from].iter().filter_map(|arc| line(&circle, from, arc)));
        let names = circle.iter().map(|module| name(module)).collect::<Vec<_>>().join(", ");
        format!("{names}:{}", lines.collect::<String>())
    };
    circles.into_iter().map(told).collect()
}
