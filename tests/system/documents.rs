//! The documents hold: command lines parse or run, keys and paths exist, links resolve, generated parts are up to date.
//!
//! `SCENECAST_UPDATE_DOCS=1` makes the test write the generated parts instead of comparing them.

use clap::CommandFactory;
use scenecast::commands::Arguments;
use scenecast_tests::pages::{Page, all_files, all_pages, arguments, command_faults, pages, words};
use scenecast_tests::{Process, free_port, http, run, scenecast, scratch, state, wait_until, workspace};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Longest README and ARCHITECTURE, in lines.
const MAX_LINES: usize = 150;

/// Command lines of the documents that are run: the line, and the parts of it that are replaced to make it short.
const RUN: &[(&str, &[(&str, &str)])] = &[
    ("scenecast config --role auv > auv.toml", &[]),
    ("scenecast config --role asv > asv.toml", &[]),
    ("scenecast key new --out mission.key", &[]),
    ("scenecast key derive mission.key --vehicle 1 --out auv-1.key", &[]),
    ("scenecast key token --out console.token", &[]),
    ("scenecast sim --duration 300 --record recording --out run2", &[("300", "6")]),
    ("scenecast scene run --source frames:recording --metres-per-pixel 0.004 --out run1", &[]),
    ("scenecast scene sample --alpha 0.001 --gamma 0.3 --size 64x64 --grid 3x3 --seed 1 --out worlds.png", &[]),
    ("scenecast vocabulary train --images dive7 --out reef.vocabulary", &[("dive7", "recording")]),
    (
        "scenecast map encode --base yesterday.png --target today.png --frame-bytes 256 --out change.scmc",
        &[("--base yesterday.png ", ""), ("today.png", "run2/vehicle-map.png")],
    ),
    (
        "scenecast map decode --base yesterday.png --in change.scmc --out today-again.png",
        &[("--base yesterday.png ", "")],
    ),
];

/// Command lines that are run against a demo.
const RUN_WITH_DEMO: &[(&str, &[(&str, &str)])] = &[
    ("scenecast ctl status", &[]),
    ("scenecast ctl budget", &[]),
    ("scenecast ctl budget set 2000 --shares map=60,exemplar=10", &[]),
    ("scenecast ctl budget set --background exemplars,depth", &[]),
    ("scenecast ctl settings", &[]),
    ("scenecast ctl settings --layers none --cells coarse --wait 120", &[(" --wait 120", "")]),
    ("scenecast ctl settings --fit 800 --dry-run", &[]),
    ("scenecast ctl limits set --depth 5..30 --silence 300 --on-silence return --wait 120", &[(" --wait 120", "")]),
    ("scenecast ctl map --out reef.png", &[]),
    ("scenecast ctl map --out reef.geojson", &[]),
];

fn assert_none(faults: &[String]) {
    assert!(faults.is_empty(), "\n{}\n", faults.join("\n"));
}

#[test]
fn every_command_line_parses() {
    let targets = cargo_targets();
    let mut faults = command_faults::<Arguments>("scenecast");
    for page in pages() {
        for line in page.command_lines().iter().filter(|line| line.starts_with("cargo ")) {
            let words = words(line);
            let named = words.windows(2).filter(|w| ["-p", "--bench", "--test"].contains(&w[0].as_str()));
            let unknown = named.filter(|w| !targets.contains(&w[1]));
            faults.extend(unknown.map(|w| format!("{}: {line}\nno {}", page.path.display(), w[1])));
        }
    }
    assert_none(&faults);
}

fn cargo_metadata() -> Value {
    let mut cargo = std::process::Command::new(env!("CARGO"));
    let output = cargo.args(["metadata", "--format-version", "1", "--no-deps"]).current_dir(workspace()).output();
    serde_json::from_slice(&output.expect("cargo runs").stdout).expect("cargo prints JSON")
}

/// Names of packages, tests and benches.
fn cargo_targets() -> BTreeSet<String> {
    let metadata = cargo_metadata();
    let packages = metadata["packages"].as_array().expect("there are packages").iter();
    let targets = |p: &Value| p["targets"].as_array().cloned().unwrap_or_default();
    let all = packages.flat_map(|p| std::iter::once(p.clone()).chain(targets(p)));
    all.filter_map(|p| p["name"].as_str().map(str::to_owned)).collect()
}

fn run_line(line: &str, parts: &[(&str, &str)], more: &[&str], dir: &Path) {
    let line = parts.iter().fold(line.to_owned(), |line, (old, new)| {
        assert!(line.contains(old), "{line}: {old} is not in it");
        line.replace(old, new)
    });
    let arguments = arguments("scenecast", &line).expect("a command line of scenecast");
    let output = scenecast().args(&arguments).args(more).current_dir(dir).output().expect("scenecast runs");
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    if let Some((_, file)) = line.split_once(" > ") {
        std::fs::write(dir.join(file), output.stdout).expect("the folder can be written");
    }
}

#[test]
fn commands_of_the_documents_run() {
    let known: BTreeSet<String> = pages().iter().flat_map(Page::command_lines).collect();
    for (line, _) in RUN.iter().chain(RUN_WITH_DEMO) {
        assert!(known.contains(*line), "no document has: {line}");
    }
    let dir = scratch("documents");
    RUN.iter().for_each(|(line, parts)| run_line(line, parts, &[], &dir));
    let (_demo, port) = demo("/api/v2/vehicles/1/map.png");
    // A part of the limits can be changed once the vehicle has reported those in force.
    let limits = |state: Value| state["vehicles"][0]["in_force"]["limits"].as_str().map(str::to_owned);
    let is_reported = || state(port).and_then(limits).is_some_and(|known| known != "not_reported");
    wait_until("the vehicle reports its limits", is_reported);
    let url = format!("http://127.0.0.1:{port}");
    RUN_WITH_DEMO.iter().for_each(|(line, parts)| run_line(line, parts, &["--url", &url], &dir));
    let report = std::fs::read_to_string(dir.join("run2/report.json")).expect("a report was written");
    members_exist(&serde_json::from_str(&report).expect("a report is JSON"));
    std::fs::remove_dir_all(dir).expect("the folder can be removed");
}

/// A demo that serves `path`.
fn demo(path: &str) -> (Process, u16) {
    let port = free_port();
    let demo = scenecast_tests::demo(port, 4, &["--duration", "600"]);
    wait_until(path, || http(port, "GET", path, "", "").is_some_and(|(status, _)| status == 200));
    (demo, port)
}

/// The members in the first section of the reports' page are those of a report.
fn members_exist(report: &Value) {
    let page = std::fs::read_to_string(workspace().join("docs/reference/reports.md")).expect("the page is there");
    let section = page.split("\n## ").nth(1).expect("the first section is that of sim");
    let cells = section.lines().filter_map(|l| l.strip_prefix("| `")).filter_map(|l| l.split(" |").next());
    let names: Vec<&str> = cells.flat_map(|c| c.split('`').step_by(2)).filter(|n| n.contains('.')).collect();
    let is_there = |name: &&str| !report.pointer(&format!("/{}", name.replace('.', "/"))).is_none_or(Value::is_null);
    // Without annotations a mission has no mutual information.
    let missing: Vec<_> = names.iter().filter(|n| !is_there(n) && !n.contains("mutual_information")).collect();
    assert!(names.len() > 15 && missing.is_empty(), "{missing:?} of {names:?}");
}

/// The keys of all roles.
fn keys() -> BTreeSet<String> {
    let roles = ["auv", "asv", "scenario"].iter();
    roles.flat_map(|role| keys_of(&String::from_utf8_lossy(&run(&["config", "--role", role]).stdout))).collect()
}

/// The keys of a file in TOML; those before the first section are none of ours.
fn keys_of(text: &str) -> Vec<String> {
    let mut section = "";
    let mut keys = Vec::new();
    for line in text.lines() {
        if let Some(name) = line.strip_prefix('[').and_then(|l| l.split(']').next()) {
            section = name;
        } else if let Some((name, _)) = line.split_once('=').filter(|_| !line.starts_with('#') && !section.is_empty()) {
            keys.push(format!("{section}.{}", name.trim()));
        }
    }
    keys
}

#[test]
fn every_key_in_the_documents_exists() {
    let keys = keys();
    let exists = |key: &str| keys.iter().any(|k| k == key || k.strip_prefix(key).is_some_and(|r| r.starts_with('.')));
    let sections: BTreeSet<&str> = keys.iter().filter_map(|k| k.split('.').next()).collect();
    // Members of reports and of the API.
    let others = |page: &Page| ["reports.md", "http.md"].iter().any(|n| page.path.ends_with(n));
    let endings =
        [".rs", ".csv", ".png", ".store", ".journal", ".checkpoint", ".key", ".copy", ".damaged", ".tif", ".tokens"];
    let is_file = |span: &str| endings.iter().any(|end| span.ends_with(end));
    let is_key = |span: &str| {
        let words = span.split('.').all(|w| !w.is_empty() && w.bytes().all(|b| b.is_ascii_lowercase() || b == b'_'));
        words && !is_file(span) && span.split_once('.').is_some_and(|(section, _)| sections.contains(section))
    };
    let mut faults = Vec::new();
    for page in pages() {
        let spans = page.code().into_iter().filter(|_| !others(&page));
        let mut named: Vec<String> = spans.map(|s| s.split([' ', '=']).next().unwrap_or_default().to_owned()).collect();
        named.retain(|span| is_key(span));
        let sets = page.command_lines().into_iter().chain(page.code()).flat_map(|l| words(&l));
        let set = |w: String| w.split_once('=').map(|(key, _)| key.to_owned()).filter(|k| is_key(k));
        named.extend(sets.filter_map(set));
        let toml = page.blocks().into_iter().filter(|(tag, _)| tag == "toml");
        named.extend(toml.flat_map(|(_, body)| keys_of(&body)));
        faults.extend(named.iter().filter(|k| !exists(k)).map(|k| format!("{}: {k}", page.path.display())));
    }
    assert_none(&faults);
}

#[test]
fn links_anchors_and_pictures_resolve() {
    let pages = all_pages();
    let anchors: BTreeMap<&Path, BTreeSet<String>> = pages.iter().map(|p| (p.path.as_path(), p.anchors())).collect();
    let mut faults = Vec::new();
    let mut linked = BTreeSet::from([PathBuf::from("docs/README.md")]);
    for page in &pages {
        for target in page.prose().split("](").skip(1).filter_map(|rest| rest.split(')').next().map(str::to_owned)) {
            let (file, part) = target.split_once('#').unwrap_or((&target, ""));
            if target.contains("://") {
                continue;
            }
            let path = if file.is_empty() { page.path.clone() } else { normal(&page.path.with_file_name(file)) };
            let has_part = |a: &BTreeSet<String>| part.is_empty() || a.contains(part);
            let is_there = anchors.get(path.as_path()).map_or_else(|| workspace().join(&path).exists(), has_part);
            faults.extend((!is_there).then(|| format!("{}: {target}", page.path.display())));
            linked.insert(path);
        }
    }
    let lost = pages.iter().filter(|p| p.path.starts_with("docs") && !linked.contains(&p.path));
    faults.extend(lost.map(|p| format!("no page has a link to {}", p.path.display())));
    assert_none(&faults);
}

fn normal(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut whole, part| {
        match part.as_os_str() == ".." {
            true => drop(whole.pop()),
            false => whole.push(part),
        }
        whole
    })
}

#[test]
fn paths_and_types_in_the_documents_exist() {
    let tops = ["daemon", "protocol", "scene-model", "sim-channel", "tests", "config", "docs", ".ci"];
    let mut faults = Vec::new();
    for page in pages() {
        let spans = page.code().into_iter().filter(|s| tops.iter().any(|t| s.starts_with(&format!("{t}/"))));
        let plain = spans.filter(|s| !s.contains(['*', ' ', '{']) && !workspace().join(s).exists());
        faults.extend(plain.map(|s| format!("{}: {s}", page.path.display())));
    }
    let rust: String = all_files()
        .iter()
        .filter(|f| f.extension().is_some_and(|e| e == "rs"))
        .map(|f| std::fs::read_to_string(f).expect("a file can be read"))
        .collect();
    let glossary = std::fs::read_to_string(workspace().join("docs/glossary.md")).expect("the glossary is there");
    let cells =
        glossary.lines().filter(|l| l.starts_with("| ")).filter_map(|l| l.trim_end_matches(" |").rsplit('|').next());
    for name in cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)) {
        let is_type =
            name.starts_with(|c: char| c.is_ascii_uppercase()) && name.bytes().all(|b| b.is_ascii_alphanumeric());
        let exists = || ["struct", "enum", "trait", "type"].iter().any(|k| rust.contains(&format!("{k} {name}")));
        faults.extend((is_type && !exists()).then(|| format!("docs/glossary.md: {name}")));
    }
    assert_none(&faults);
}

#[test]
fn the_front_door_is_short() {
    for name in ["README.md", "ARCHITECTURE.md"] {
        let lines = std::fs::read_to_string(workspace().join(name)).expect("the page is there").lines().count();
        assert!(lines <= MAX_LINES, "{name} has {lines} lines");
    }
}

/// Compares the part of a page between the markers of `name` with `made`, or writes it.
fn generated(page: &str, name: &str, made: &str) {
    let file = workspace().join(page);
    let text = std::fs::read_to_string(&file).expect("the page is there");
    let (begin, end) = (format!("<!-- generated: {name} -->\n"), "<!-- end of generated -->");
    let (head, rest) = text.split_once(&begin).expect("the page has the marker");
    let (_, tail) = rest.split_once(end).expect("the page has the end marker");
    let clean: String = made.trim().lines().map(|l| format!("{}\n", l.trim_end())).collect();
    let wanted = format!("{head}{begin}\n{clean}\n{end}{tail}");
    if std::env::var_os("SCENECAST_UPDATE_DOCS").is_some() {
        std::fs::write(&file, wanted).expect("the page can be written");
    } else {
        assert!(wanted == text, "{page} is out of date: run this test with SCENECAST_UPDATE_DOCS=1");
    }
}

#[test]
fn the_reference_of_commands_is_up_to_date() {
    fn add(command: &mut clap::Command, path: &str, text: &mut String) {
        let help = command.render_long_help();
        let _ = write!(text, "## {path}\n\n```text\n{}\n```\n\n", help.to_string().trim());
        for sub in command.get_subcommands_mut().filter(|s| s.get_name() != "help") {
            let path = format!("{path} {}", sub.get_name());
            add(sub, &path, text);
        }
    }
    let mut command = Arguments::command();
    command.build();
    let mut text = String::new();
    add(&mut command, "scenecast", &mut text);
    generated("docs/reference/commands.md", "commands", &text);
}

#[test]
fn the_reference_of_the_configuration_is_up_to_date() {
    let output = run(&["config", "--reference"]);
    assert!(output.status.success());
    generated(
        "docs/reference/configuration.md",
        "scenecast config --reference",
        &String::from_utf8_lossy(&output.stdout),
    );
}

#[test]
fn the_reference_of_http_is_up_to_date() {
    let (_demo, port) = demo("/api/openapi.json");
    let (_, body) = http(port, "GET", "/api/openapi.json", "", "").expect("the demo serves the document");
    let document: Value = serde_json::from_slice(&body).expect("the document is JSON");
    generated("docs/reference/http.md", "http", &http_reference(&document));
}

#[test]
fn the_list_of_modules_is_up_to_date() {
    let metadata = cargo_metadata();
    let packages = metadata["packages"].as_array().expect("there are packages");
    let mut text = String::new();
    for package in packages.iter().filter(|p| p["name"] != "scenecast-tests") {
        let manifest = Path::new(package["manifest_path"].as_str().expect("a package has a manifest"));
        let folder = manifest.parent().expect("a manifest is in a folder");
        let shown = folder.strip_prefix(workspace()).expect("below the project's folder").display();
        let own = purpose(&folder.join("src/lib.rs"));
        let _ = write!(text, "## `{shown}/`\n\n{own}\n\n| module | purpose |\n|---|---|\n");
        let mut entries: Vec<_> = std::fs::read_dir(folder.join("src")).expect("it has sources").flatten().collect();
        entries.sort_by_key(std::fs::DirEntry::file_name);
        for path in entries.iter().map(std::fs::DirEntry::path) {
            let name = path.file_stem().expect("a file has a name").to_string_lossy().into_owned();
            let is_folder = path.join("mod.rs").exists();
            let is_file = path.extension().is_some_and(|e| e == "rs");
            if (is_folder || is_file) && name != "lib" && name != "main" && !name.ends_with("tests") {
                let file = if is_folder { path.join("mod.rs") } else { path };
                let _ = writeln!(text, "| `{name}` | {} |", purpose(&file));
            }
        }
        text.push('\n');
    }
    generated("docs/explanation/code.md", "modules", &text);
}

/// The first paragraph of a module's documentation, without its links.
fn purpose(file: &Path) -> String {
    let text = std::fs::read_to_string(file).expect("a module can be read");
    let lines = text.lines().skip_while(|l| !l.starts_with("//!")).map_while(|l| l.strip_prefix("//! "));
    let paragraph = lines.map(|l| l.trim_start_matches('#').trim()).collect::<Vec<_>>().join(" ").replace('|', "\\|");
    let parts = paragraph.split("](").enumerate();
    let plain: String = parts.map(|(i, p)| if i == 0 { p } else { p.split_once(')').map_or("", |(_, r)| r) }).collect();
    plain.replace(['[', ']'], "")
}

fn http_reference(document: &Value) -> String {
    let line =
        |v: &Value| v.as_str().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|");
    let mut text = String::from("| method | path | role | body | purpose |\n|---|---|---|---|---|\n");
    for (path, methods) in document["paths"].as_object().expect("there are paths") {
        for (method, operation) in methods.as_object().expect("there are methods") {
            let schema = &operation["requestBody"]["content"]["application/json"]["schema"];
            let (method, summary) = (method.to_uppercase(), line(&operation["summary"]));
            let (role, body) = (line(&operation["x-role"]), type_of(schema));
            let _ = writeln!(text, "| {method} | `{path}` | {role} | {body} | {summary} |");
        }
    }
    for (name, schema) in document["components"]["schemas"].as_object().expect("there are schemas") {
        let _ = write!(text, "\n### {name}\n\n{}\n", line(&schema["description"]));
        let Some(members) = schema["properties"].as_object() else { continue };
        text += "\n| member | type | meaning |\n|---|---|---|\n";
        for (member, is) in members {
            let range = match (is["minimum"].as_f64(), is["maximum"].as_f64()) {
                (Some(low), Some(high)) => format!(" {low} to {high}"),
                _ => String::new(),
            };
            let _ = writeln!(text, "| `{member}` | {}{range} | {} |", type_of(is), line(&is["description"]));
        }
    }
    text
}

/// The type of a schema, as text with links.
fn type_of(schema: &Value) -> String {
    let named =
        |v: &Value| v.as_str().and_then(|r| r.rsplit('/').next()).map(|n| format!("[{n}](#{})", n.to_lowercase()));
    let one_of = schema["anyOf"].as_array().map(|all| all.iter().map(type_of).collect::<Vec<_>>().join(" or "));
    let list = || (schema["type"] == "array").then(|| format!("list of {}", type_of(&schema["items"])));
    let several =
        || schema["type"].as_array().map(|all| all.iter().filter_map(Value::as_str).collect::<Vec<_>>().join(" or "));
    let plain = || schema["type"].as_str().map(str::to_owned);
    named(&schema["$ref"]).or(one_of).or_else(list).or_else(several).or_else(plain).unwrap_or_default()
}
