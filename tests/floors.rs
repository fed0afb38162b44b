//! The import law: a room looks down only, and rooms of one floor do not see each other.

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
    ("fit", 5),
    ("bindings", 6),
];

/// Files that belong to no room: the map and the pages of the papers.
const OUTSIDE: &[&str] = &["lib", "papers"];

/// Rooms of floor 0 that others of floor 0 may use.
const FOUNDATION: &[&str] = &["error", "job"];

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

/// Rooms that a line of code names through `crate::`, also inside braces.
fn named(line: &str) -> Vec<String> {
    let code = line.split("//").next().unwrap_or("");
    let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut rooms = Vec::new();
    for part in code.split("crate::").skip(1) {
        match part.strip_prefix('{') {
            Some(list) => {
                rooms.extend(list.split(['}', ',']).map(|item| word(item.trim())).filter(|w| !w.is_empty()));
            }
            None => rooms.push(word(part)),
        }
    }
    rooms
}

fn violations(root: &Path) -> (usize, Vec<String>) {
    let mut files = Vec::new();
    sources(root, &mut files);
    let mut imports = 0;
    let mut wrong = Vec::new();
    for path in &files {
        let inside = path.strip_prefix(root).expect("below src");
        let room = inside.components().next().expect("has a name").as_os_str().to_string_lossy();
        let room = room.trim_end_matches(".rs");
        if OUTSIDE.contains(&room) {
            continue;
        }
        let Some(mine) = floor(room) else {
            wrong.push(format!("{}: room {room} is not in the table", inside.display()));
            continue;
        };
        let text = fs::read_to_string(path).expect("source can be read");
        for (number, line) in text.lines().enumerate() {
            for other in named(line) {
                // Re-exports at the crate's root stand for floor 0.
                if ["Error", "Result"].contains(&other.as_str()) || other == room {
                    continue;
                }
                imports += 1;
                let allowed = match floor(&other) {
                    None => false,
                    Some(theirs) => theirs < mine || (theirs == 0 && FOUNDATION.contains(&other.as_str())),
                };
                if !allowed {
                    wrong.push(format!("{}:{}: {room} must not see {other}", inside.display(), number + 1));
                }
            }
        }
    }
    (imports, wrong)
}

#[test]
fn rooms_look_down_only() {
    let (imports, wrong) = violations(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    assert!(imports > 20, "the scan must find imports, found {imports}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_law_can_be_broken() {
    let folder = std::env::temp_dir().join(format!("pleinair-floors-{}", std::process::id()));
    fs::create_dir_all(folder.join("color")).expect("folder");
    fs::create_dir_all(folder.join("attic")).expect("folder");
    fs::write(
        folder.join("color/mod.rs"),
        "use crate::fit::genetic;\nuse crate::image;\nuse crate::{error, clouds};\n",
    )
    .expect("file");
    fs::write(folder.join("attic/mod.rs"), "").expect("file");
    let (_, wrong) = violations(&folder);
    fs::remove_dir_all(&folder).expect("removed");
    assert_eq!(wrong.len(), 4, "upward, sideways, upward in braces, unknown room: {wrong:?}");
}

#[test]
fn only_one_file_dispatches_on_the_cpu_and_none_is_unsafe() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
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
