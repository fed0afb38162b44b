//! The import law: a room looks down only, rooms of one floor do not see each other, and files do not import each other
//! in a circle.
//!
//! Every path of the code counts: `use` with nested braces over any number of lines, `pub use`, `crate::`, `super::` and
//! `self::` in the middle of an expression, in tests too. A `mod.rs` that re-exports its own children (`pub use`) is
//! their face and no circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Every room of `src/` and its floor.
const FLOORS: &[(&str, u32)] = &[
    ("error", 0),
    ("job", 0),
    ("math", 0),
    ("astro", 1),
    ("color", 1),
    ("image", 1),
    ("air", 2),
    ("tone", 2),
    ("clouds", 3),
    ("paint", 3),
    ("plants", 3),
    ("sky", 3),
    ("weather", 3),
    ("scene", 4),
    ("fit", 5),
    ("bindings", 6),
];

/// Files that belong to no room: the map and the pages of the papers.
const OUTSIDE: &[&str] = &["lib", "papers"];

/// Rooms of floor 0 that others of floor 0 may use.
const FOUNDATION: &[&str] = &["error", "job"];

/// A module's path below the crate, `["sky", "model"]`.
type Module = Vec<String>;

fn floor(room: &str) -> Option<u32> {
    FLOORS.iter().find(|(name, _)| *name == room).map(|(_, floor)| *floor)
}

fn sources(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("src can be read") {
        let path = entry.expect("entry can be read").path();
        if path.is_dir() {
            sources(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push(path);
        }
    }
}

/// The module of a file; none for the crate's root.
fn module(root: &Path, path: &Path) -> Module {
    let inside = path.strip_prefix(root).expect("below src").with_extension("");
    let mut names: Module = inside.components().map(|c| c.as_os_str().to_string_lossy().into_owned()).collect();
    if names.last().is_some_and(|n| n == "mod") {
        names.pop();
    }
    if names == ["lib"] { Vec::new() } else { names }
}

/// Words and marks of code, with the line each is on: no comments, no text in quotes.
fn tokens(text: &str) -> Vec<(String, usize)> {
    let chars: Vec<char> = text.chars().collect();
    let (mut out, mut line, mut i) = (Vec::new(), 1, 0);
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let word = |c: char| c.is_alphanumeric() || c == '_';
    while i < chars.len() {
        let c = at(i);
        if c == '/' && at(i + 1) == '/' {
            while i < chars.len() && at(i) != '\n' {
                i += 1;
            }
        } else if c == '/' && at(i + 1) == '*' {
            let mut depth = 0;
            loop {
                if at(i) == '/' && at(i + 1) == '*' {
                    (depth, i) = (depth + 1, i + 2);
                } else if at(i) == '*' && at(i + 1) == '/' {
                    (depth, i) = (depth - 1, i + 2);
                } else {
                    line += usize::from(at(i) == '\n');
                    i += 1;
                }
                if depth == 0 || i >= chars.len() {
                    break;
                }
            }
        } else if c == 'r' && (at(i + 1) == '"' || (at(i + 1) == '#' && (at(i + 2) == '"' || at(i + 2) == '#'))) {
            let hashes = (i + 1..chars.len()).take_while(|&k| at(k) == '#').count();
            i += 2 + hashes;
            while i < chars.len() && !(at(i) == '"' && (1..=hashes).all(|k| at(i + k) == '#')) {
                line += usize::from(at(i) == '\n');
                i += 1;
            }
            i += 1 + hashes;
        } else if c == '"' {
            i += 1;
            while i < chars.len() && at(i) != '"' {
                i += usize::from(at(i) == '\\');
                line += usize::from(at(i) == '\n');
                i += 1;
            }
            i += 1;
        } else if c == '\'' && (at(i + 1) == '\\' || at(i + 2) == '\'') {
            i += 2 + usize::from(at(i + 1) == '\\');
            while i < chars.len() && at(i) != '\'' {
                i += 1;
            }
            i += 1;
        } else if word(c) {
            let from = i;
            while word(at(i)) {
                i += 1;
            }
            out.push((chars[from..i].iter().collect(), line));
        } else {
            if c == ':' && at(i + 1) == ':' {
                out.push(("::".into(), line));
                i += 1;
            } else if !c.is_whitespace() {
                out.push((c.to_string(), line));
            }
            line += usize::from(c == '\n');
            i += 1;
        }
    }
    out
}

/// A path that a file names: where it leads from the crate's root, on which line, and whether it is re-exported.
#[derive(Debug)]
struct Named {
    to: Module,
    line: usize,
    face: bool,
}

/// Paths that begin at token `i` with the names so far, through nested braces; returns where they end.
fn paths(tokens: &[(String, usize)], mut i: usize, so_far: &[String], found: &mut Vec<Module>) -> usize {
    let text = |i: usize| tokens.get(i).map_or("", |t| t.0.as_str());
    let mut names = so_far.to_vec();
    loop {
        if text(i) == "{" {
            i += 1;
            while i < tokens.len() && text(i) != "}" {
                i = paths(tokens, i, &names, found);
                if text(i) == "as" {
                    i += 2;
                }
                if text(i) == "," {
                    i += 1;
                }
            }
            return i + 1;
        }
        if text(i) == "self" && !names.is_empty() {
            found.push(names);
            return i + 1;
        }
        names.push(text(i).to_owned());
        i += 1;
        if text(i) != "::" || text(i + 1) == "<" {
            found.push(names);
            return i;
        }
        i += 1;
    }
}

/// All paths of a file that lead to a module of the crate.
fn named(mine: &Module, text: &str, modules: &BTreeSet<Module>) -> Vec<Named> {
    let tokens = tokens(text);
    let text = |i: usize| tokens.get(i).map_or("", |t| t.0.as_str());
    // Inline modules around the place, each with the depth of braces it began at.
    let (mut around, mut depth): (Vec<(String, usize)>, usize) = (Vec::new(), 0);
    let mut out = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        let (begins, line) = (text(i.wrapping_sub(1)) != "::", tokens[i].1);
        let child = |name: &str| {
            let path: Module = mine.iter().cloned().chain([name.to_owned()]).collect();
            modules.contains(&path)
        };
        match text(i) {
            "mod" if text(i + 2) == "{" => {
                depth += 1;
                around.push((text(i + 1).to_owned(), depth));
                i += 3;
                continue;
            }
            "{" => depth += 1,
            "}" => {
                if around.last().is_some_and(|(_, d)| *d == depth) {
                    around.pop();
                }
                depth = depth.saturating_sub(1);
            }
            _ => {}
        }
        let starts = text(i + 1) == "::"
            && begins
            && (matches!(text(i), "crate" | "super" | "self") || (around.is_empty() && child(text(i))));
        if !starts {
            i += 1;
            continue;
        }
        let face =
            text(i.wrapping_sub(1)) == "use" && (text(i.wrapping_sub(2)) == "pub" || text(i.wrapping_sub(2)) == ")");
        let mut list = Vec::new();
        let end = paths(&tokens, i, &[], &mut list);
        for path in list {
            let mut base: Module = mine.iter().cloned().chain(around.iter().map(|a| a.0.clone())).collect();
            let mut rest = path.as_slice();
            if let [first, tail @ ..] = rest
                && (first == "crate" || first == "self")
            {
                if first == "crate" {
                    base.clear();
                }
                rest = tail;
            }
            while let [first, tail @ ..] = rest
                && first == "super"
            {
                base.pop();
                rest = tail;
            }
            base.extend(rest.iter().cloned());
            out.push(Named { to: base, line, face });
        }
        i = end.max(i + 1);
    }
    out
}

/// The module whose file holds what a path leads to.
fn home(path: &Module, modules: &BTreeSet<Module>) -> Option<Module> {
    (1..=path.len()).rev().map(|n| path[..n].to_vec()).find(|p| modules.contains(p))
}

/// One circle of a graph, if there is any.
fn circle(edges: &BTreeMap<Module, BTreeSet<Module>>) -> Option<Vec<Module>> {
    fn visit(
        at: &Module,
        edges: &BTreeMap<Module, BTreeSet<Module>>,
        way: &mut Vec<Module>,
        done: &mut BTreeSet<Module>,
    ) -> Option<Vec<Module>> {
        if let Some(from) = way.iter().position(|m| m == at) {
            return Some(way[from..].to_vec());
        }
        if done.contains(at) {
            return None;
        }
        way.push(at.clone());
        let found = edges.get(at).into_iter().flatten().find_map(|to| visit(to, edges, way, done));
        way.pop();
        done.insert(at.clone());
        found
    }
    let (mut way, mut done) = (Vec::new(), BTreeSet::new());
    edges.keys().find_map(|at| visit(at, edges, &mut way, &mut done))
}

/// How many imports of other files there are, and what is wrong.
fn violations(root: &Path) -> (usize, Vec<String>) {
    let mut files = Vec::new();
    sources(root, &mut files);
    files.sort();
    let modules: BTreeSet<Module> = files.iter().map(|p| module(root, p)).filter(|m| !m.is_empty()).collect();
    let mut wrong = Vec::new();
    let mut imports = 0;
    let mut edges: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
    for path in &files {
        let inside = path.strip_prefix(root).expect("below src");
        let mine = module(root, path);
        let room = mine.first().map_or("lib", String::as_str);
        if OUTSIDE.contains(&room) {
            continue;
        }
        let Some(height) = floor(room) else {
            wrong.push(format!("{}: room {room} is not in the table", inside.display()));
            continue;
        };
        let text = fs::read_to_string(path).expect("source can be read");
        for Named { to, line, face } in named(&mine, &text, &modules) {
            let Some(other) = to.first() else { continue };
            // Re-exports at the crate's root stand for floor 0.
            if ["Error", "Result"].contains(&other.as_str()) {
                continue;
            }
            if let Some(file) = home(&to, &modules)
                && file != mine
                && !(face && file.starts_with(&mine))
            {
                edges.entry(mine.clone()).or_default().insert(file);
                imports += 1;
            }
            if other == room {
                continue;
            }
            let allowed = match floor(other) {
                None => false,
                Some(theirs) => theirs < height || (theirs == 0 && FOUNDATION.contains(&other.as_str())),
            };
            if !allowed {
                wrong.push(format!("{}:{line}: {room} must not see {other}", inside.display()));
            }
        }
    }
    while let Some(found) = circle(&edges) {
        let names: Vec<String> = found.iter().map(|m| m.join("/")).collect();
        wrong.push(format!("files in a circle: {} -> {}", names.join(" -> "), names[0]));
        // Cut it here, and look for the next.
        let next = found.get(1).unwrap_or(&found[0]);
        edges.get_mut(&found[0]).expect("has edges").remove(next);
    }
    if imports == 0 {
        wrong.push(format!("{}: nothing was scanned", root.display()));
    }
    (imports, wrong)
}

/// What is wrong with a tree of these files.
fn planted(name: &str, files: &[(&str, &str)]) -> Vec<String> {
    let folder = std::env::temp_dir().join(format!("pleinair-floors-{}-{name}", std::process::id()));
    fs::create_dir_all(&folder).expect("folder");
    for (path, text) in files {
        let path = folder.join(path);
        fs::create_dir_all(path.parent().expect("has a folder")).expect("folder");
        fs::write(path, text).expect("file");
    }
    let (_, wrong) = violations(&folder);
    fs::remove_dir_all(&folder).expect("removed");
    wrong
}

#[test]
fn rooms_look_down_only_and_files_form_no_circle() {
    let (imports, wrong) = violations(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    assert!(imports > 400, "the scan must find imports, found {imports}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_law_can_be_broken() {
    let wrong = planted(
        "rooms",
        &[
            ("color/mod.rs", "use crate::fit::genetic;\nuse crate::image;\nuse crate::{error, clouds};\n"),
            ("color/spaces.rs", "use super::transfer::encode;\n"),
            ("color/transfer.rs", ""),
            ("attic/mod.rs", ""),
        ],
    );
    assert_eq!(wrong.len(), 4, "upward, sideways, upward in braces, unknown room: {wrong:?}");
}

#[test]
fn an_import_over_many_lines_is_found() {
    let text = "use crate::{\n    error::Error, // not crate::bindings\n    math::{geometry::{Pinhole}, lanes},\n    \
                fit::{\n        search::{Record, Stop},\n    },\n};\n";
    let wrong = planted("lines", &[("tone/eye.rs", text), ("fit/search.rs", ""), ("math/lanes.rs", "")]);
    assert_eq!(wrong.len(), 2, "{wrong:?}");
    assert!(wrong.iter().all(|w| w.ends_with("tone must not see fit")), "{wrong:?}");
    let other = [
        ("tone/mod.rs", "pub use super::sky::model as m;\n"),
        ("air/mod.rs", "fn f() { let x = super::tone::y::<u8>(1); }\n"),
        (
            "image/mod.rs",
            "/* crate::fit */ const A: &str = \"crate::fit\"; mod tests { use super::super::job::Job; }\n",
        ),
        ("job.rs", ""),
    ];
    let wrong = planted("super", &other);
    assert_eq!(wrong.len(), 2, "a re-export and an expression through super, nothing in comments: {wrong:?}");
}

#[test]
fn a_circle_is_found() {
    let three = [
        ("sky/mod.rs", "pub mod a;\npub use a::A;\npub mod b;\npub mod c;\n"),
        ("sky/a.rs", "use super::b::B;\n"),
        ("sky/b.rs", "use crate::sky::{\n    c::C,\n};\n"),
        ("sky/c.rs", "mod tests {\n    use super::*;\n    use super::super::a;\n}\n"),
    ];
    let wrong = planted("circle", &three);
    assert_eq!(wrong, ["files in a circle: sky/a -> sky/b -> sky/c -> sky/a"], "of three files, one in its tests");
    let face = [("sky/mod.rs", "mod a;\npub use a::{\n    A,\n};\npub fn f() {}\n"), ("sky/a.rs", "use super::f;\n")];
    assert!(planted("face", &face).is_empty(), "a re-export of a child is no circle");
    let parent = [("sky/mod.rs", "mod a;\nfn g() { a::g() }\npub fn f() {}\n"), ("sky/a.rs", "use super::f;\n")];
    assert_eq!(planted("parent", &parent).len(), 1, "a parent and a child that use each other are one");
}

#[test]
fn scanning_nothing_fails() {
    assert_eq!(planted("nothing", &[("lib.rs", "")]).len(), 1, "no imports, no pass");
}

#[test]
fn only_one_file_dispatches_on_the_cpu_and_none_is_unsafe() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    assert!(files.len() > 100, "the scan must find files, found {}", files.len());
    for path in files {
        let text = fs::read_to_string(&path).expect("source can be read");
        let code: String = text.lines().map(|l| l.split("//").next().unwrap_or("").to_owned() + "\n").collect();
        let dispatches = code.contains("fearless_simd") || code.contains("is_x86_feature_detected");
        assert!(!dispatches || path.ends_with("math/lanes.rs"), "{} dispatches on the CPU", path.display());
        let threads = code.contains("rayon");
        let may = path.ends_with("job.rs") || path.ends_with("bindings/run.rs");
        assert!(!threads || may, "{} uses rayon: threads are Job's", path.display());
        assert!(!code.contains("mul_add"), "{} contracts a product and a sum", path.display());
    }
}
