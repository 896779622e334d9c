//! The top-level modules of a crate depend on each other without a circle.
//!
//! A module is a folder of `src/` or a file beside `lib.rs`. It depends on another one if its code outside of tests has a
//! path into it: `crate::other`, or as many `super::` as lead to the root of the crate.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The folders of all crates.
fn crates() -> Vec<String> {
    let daemon = scenecast_tests::workspace().join("daemon");
    let mut names: Vec<String> = std::fs::read_dir(daemon)
        .unwrap()
        .map(|entry| format!("daemon/{}", entry.unwrap().file_name().to_string_lossy()))
        .collect();
    names.extend(["protocol", "scene-model", "sim-channel"].map(str::to_owned));
    names.sort();
    names
}

/// The modules that each module uses, each with a file that does so.
type Arrows = BTreeMap<String, BTreeMap<String, String>>;

#[test]
fn no_crate_has_a_circle_of_modules() {
    let crates = crates();
    assert!(crates.len() >= 20, "{crates:?}");
    let found: Vec<String> = crates.iter().filter_map(|name| circle_in(name)).collect();
    assert!(found.is_empty(), "circles of modules:\n{}", found.join("\n"));
}

#[test]
fn a_circle_over_three_folders_is_found() {
    let sources = [
        ("a/mod.rs", "use crate::b::Thing;"),
        ("b/mod.rs", "use crate::{\n    a_thing, c::{self, d::E},\n};"),
        ("c/d.rs", "fn f() { super::super::a::g() }"),
        ("d.rs", "use crate::a;"),
    ];
    let arrows = arrows(&sources.map(|(path, text)| (path.to_owned(), text.to_owned())));
    assert_eq!(circle(&arrows), Some(vec!["a".to_owned(), "b".to_owned(), "c".to_owned()]));
}

#[test]
fn tests_comments_and_strings_draw_no_arrow() {
    let sources = [
        ("a/mod.rs", "// crate::b\nconst S: &str = \"crate::b {\"; const C: char = '\"';\n/// [`crate::b`]\nstruct A;"),
        (
            "b/mod.rs",
            "use crate::a::A;\n#[cfg(test)]\nmod proofs;\n#[cfg(test)]\nmod tests { use crate::c; fn f() {} }",
        ),
        ("b/proofs.rs", "use crate::c;"),
        ("c/mod.rs", "use crate::b; #[cfg(test)]\nuse crate::a;"),
    ];
    let arrows = arrows(&sources.map(|(path, text)| (path.to_owned(), text.to_owned())));
    assert_eq!(circle(&arrows), None);
    assert_eq!(arrows["b"].keys().collect::<Vec<_>>(), ["a"]);
    assert_eq!(arrows["c"].keys().collect::<Vec<_>>(), ["b"]);
}

/// The circle in a crate, for people.
fn circle_in(name: &str) -> Option<String> {
    let root = scenecast_tests::workspace().join(name).join("src");
    let mut sources = Vec::new();
    read(&root, &root, &mut sources);
    assert!(sources.len() > 1, "{} has no sources", root.display());
    let arrows = arrows(&sources);
    let circle = circle(&arrows)?;
    let next = circle.iter().cycle().skip(1);
    let steps = circle.iter().zip(next).map(|(from, to)| format!("  {from} -> {to} in {}", arrows[from][to]));
    Some(format!("{name}:\n{}", steps.collect::<Vec<_>>().join("\n")))
}

fn read(root: &Path, folder: &Path, sources: &mut Vec<(String, String)>) {
    let mut entries: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            read(root, &path, sources);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let name = path.strip_prefix(root).unwrap().to_string_lossy().replace('\\', "/");
            sources.push((name, std::fs::read_to_string(&path).unwrap()));
        }
    }
}

/// The arrows between the top-level modules of a crate; each source is a path below `src/` and its text.
fn arrows(sources: &[(String, String)]) -> Arrows {
    let code: BTreeMap<&str, String> = sources.iter().map(|(path, text)| (path.as_str(), code_of(text))).collect();
    let of_tests: BTreeSet<String> = code.iter().flat_map(|(path, text)| test_modules(path, text)).collect();
    let is_root = |path: &str| ["lib.rs", "main.rs"].contains(&path);
    let modules: BTreeSet<&str> = code.keys().filter(|p| !is_root(p)).map(|p| module_path(p)[0]).collect();
    let mut arrows: Arrows = modules.iter().map(|&m| (m.to_owned(), BTreeMap::new())).collect();
    for (path, text) in &code {
        let place = module_path(path);
        let is_test = (1..=place.len()).any(|n| of_tests.contains(&place[..n].join("/")));
        if is_root(path) || is_test {
            continue;
        }
        let own = place[0];
        let outward = format!("{}::", vec!["super"; place.len()].join("::"));
        for name in heads(&without_tests(text), &["crate::", &outward]) {
            if name != own && modules.contains(name.as_str()) {
                let used = arrows.entry(own.to_owned()).or_default();
                used.entry(name).or_insert_with(|| (*path).to_owned());
            }
        }
    }
    arrows
}

/// The path of the module that a file holds.
fn module_path(path: &str) -> Vec<&str> {
    path.trim_end_matches(".rs").trim_end_matches("/mod").split('/').collect()
}

/// A source with blanks for comments and for the content of strings and characters.
fn code_of(text: &str) -> String {
    let chars: Vec<char> = text.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let mut code = String::with_capacity(text.len());
    let mut i = 0;
    while i < chars.len() {
        let end = match at(i) {
            '/' if at(i + 1) == '/' => (i..chars.len()).find(|&j| at(j) == '\n').unwrap_or(chars.len()),
            '/' if at(i + 1) == '*' => {
                (i..chars.len()).find(|&j| at(j) == '*' && at(j + 1) == '/').map_or(chars.len(), |j| j + 2)
            }
            '"' => end_of_string(&chars, i),
            'r' if !is_name(at(i.wrapping_sub(1)))
                && (at(i + 1) == '"' || (at(i + 1) == '#' && matches!(at(i + 2), '"' | '#'))) =>
            {
                end_of_raw_string(&chars, i)
            }
            '\'' if at(i + 1) == '\\' => (i + 3..chars.len()).find(|&j| at(j) == '\'').map_or(chars.len(), |j| j + 1),
            '\'' if at(i + 2) == '\'' => i + 3,
            _ => i,
        };
        if end == i {
            code.push(at(i));
            i += 1;
        } else {
            code.push(' ');
            i = end;
        }
    }
    code
}

fn end_of_string(chars: &[char], from: usize) -> usize {
    let mut i = from + 1;
    while i < chars.len() && chars[i] != '"' {
        i += if chars[i] == '\\' { 2 } else { 1 };
    }
    i + 1
}

fn end_of_raw_string(chars: &[char], from: usize) -> usize {
    let hashes = chars[from + 1..].iter().take_while(|&&c| c == '#').count();
    let close =
        |i: usize| chars[i] == '"' && chars[i + 1..].iter().take(hashes).filter(|&&c| c == '#').count() == hashes;
    (from + hashes + 2..chars.len()).find(|&i| close(i)).map_or(chars.len(), |i| i + 1 + hashes)
}

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The code without the items under `#[cfg(test)]`.
fn without_tests(code: &str) -> String {
    let mut out = String::new();
    let mut rest = code;
    while let Some(at) = rest.find("#[cfg(test)]") {
        out.push_str(&rest[..at]);
        rest = &rest[at..];
        rest = &rest[end_of_item(rest)..];
    }
    out + rest
}

/// Where an item ends: at its semicolon or its closing brace, whichever is first outside of all brackets.
fn end_of_item(code: &str) -> usize {
    let mut depth = 0;
    for (i, c) in code.char_indices() {
        match c {
            '{' | '(' | '[' => depth += 1,
            '}' | ')' | ']' => depth -= 1,
            _ => {}
        }
        if depth == 0 && (c == ';' || c == '}') {
            return i + 1;
        }
    }
    code.len()
}

/// Paths of the modules in files of their own that a file declares for tests only.
fn test_modules(path: &str, code: &str) -> Vec<String> {
    let place = module_path(path);
    let folder: &[&str] = if ["lib.rs", "main.rs"].contains(&path) { &[] } else { &place };
    let declared = code.match_indices("#[cfg(test)]").filter_map(|(at, _)| {
        let item = &code[at..at + end_of_item(&code[at..])];
        let name = item.split_once("mod ")?.1.trim().strip_suffix(';')?.trim();
        Some(folder.iter().copied().chain([name]).collect::<Vec<_>>().join("/"))
    });
    declared.collect()
}

/// The first names of all paths that begin with one of `prefixes`, those in braces too.
fn heads(code: &str, prefixes: &[&str]) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for prefix in prefixes {
        for (at, _) in code.match_indices(prefix) {
            let before = code[..at].chars().next_back().unwrap_or(' ');
            if is_name(before) || before == ':' || before == '$' {
                continue;
            }
            let tail = &code[at + prefix.len()..];
            match tail.strip_prefix('{') {
                Some(group) => names.extend(heads_of_group(group)),
                None => names.extend(head(tail)),
            }
        }
    }
    names
}

/// The first names of the paths in a group whose opening brace is behind us.
fn heads_of_group(group: &str) -> Vec<String> {
    let mut names = Vec::new();
    let (mut depth, mut is_start) = (0, true);
    for (i, c) in group.char_indices() {
        match c {
            '}' if depth == 0 => break,
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => is_start = true,
            c if is_start && is_name(c) => {
                names.extend(head(&group[i..]));
                is_start = false;
            }
            _ => {}
        }
    }
    names
}

fn head(path: &str) -> Option<String> {
    let name: String = path.chars().take_while(|&c| is_name(c)).collect();
    (!name.is_empty()).then_some(name)
}

/// A shortest circle, from its first module in alphabetical order on.
fn circle(arrows: &Arrows) -> Option<Vec<String>> {
    let circles = arrows.keys().filter_map(|start| {
        let mut paths = vec![vec![start.clone()]];
        let mut seen = BTreeSet::new();
        while !paths.is_empty() {
            let mut longer = Vec::new();
            for path in paths {
                for next in arrows[path.last()?].keys() {
                    if next == start {
                        return Some(path);
                    }
                    if seen.insert(next.clone()) {
                        longer.push([&path[..], std::slice::from_ref(next)].concat());
                    }
                }
            }
            paths = longer;
        }
        None
    });
    circles.min_by_key(Vec::len)
}
