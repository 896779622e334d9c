//! The operator's page in headless Chromium: the stories of `tests/browser`, against the mock and against real processes.

use scenecast_tests::{
    Process, UNRECORDED, free_port, http, is_full, lacks_browser, run, scratch, state, wait_until, workspace,
};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

/// One browser at a time where the stories assert limits of time.
static BROWSER: Mutex<()> = Mutex::new(());

/// Runs the stories for the given target. Prints their number and measurements, or fails with their output.
fn assert_stories_pass(arguments: &[&str]) {
    let _one = is_full().then(|| BROWSER.lock().unwrap_or_else(|e| e.into_inner()));
    let script = workspace().join("tests/browser/run.mjs");
    let which = if is_full() { "--limits" } else { "--brief" };
    let mut node = Command::new("node");
    let output = node.arg(script).args(["--require", which]).args(arguments).output().expect("node runs");
    let log = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{log}");
    let counts = log.lines().last().unwrap_or_default();
    assert!(!counts.starts_with("0 passed"), "no story ran: {log}");
    let measured = log.lines().filter(|l| l.contains("figures: ")).map(|l| format!("{l}\n"));
    let _ = std::io::stderr().write_all(format!("{}{counts}\n", measured.collect::<String>()).as_bytes());
}

#[test]
fn every_story_passes_against_the_mock() {
    if !lacks_browser() {
        assert_stories_pass(if is_full() { &[] } else { &["--workers", "3"] });
    }
}

#[test]
fn every_story_without_mock_passes_against_a_demo() {
    if lacks_browser() {
        return;
    }
    let port = free_port();
    let _demo = Process::start(
        &[&["demo", "--port", &port.to_string(), "--speed", "5", "--duration", "100000"][..], &UNRECORDED].concat(),
    );
    wait_until("labels on the map", || {
        state(port).is_some_and(|s| s["vehicles"][0]["labels"].as_array().is_some_and(|l| l.len() > 3))
    });
    assert_stories_pass(&["--url", &format!("http://127.0.0.1:{port}")]);
}

#[test]
fn a_surface_with_a_token_shows_the_login() {
    if lacks_browser() {
        return;
    }
    let dir = scratch("browser-token");
    let token = dir.join("console.token").display().to_string();
    assert!(run(&["key", "token", "--out", &token]).status.success());
    let (port, modem) = (free_port(), free_port());
    let config = workspace().join("config/asv.toml").display().to_string();
    let sets = [
        format!("console.listen=0.0.0.0:{port}"),
        format!("console.token_file={token}"),
        format!("modem.listen=127.0.0.1:{modem}"),
        format!("runtime.state_dir=\"{}\"", dir.join("asv").display()),
    ];
    let mut arguments = vec!["asv", "--config", &config];
    arguments.extend(sets.iter().flat_map(|s| ["--set", s]));
    let _surface = Process::start(&arguments);
    wait_until("the form is served", || http(port, "GET", "/login", "", "").is_some_and(|(s, _)| s == 200));
    assert_stories_pass(&["--url", &format!("http://127.0.0.1:{port}"), "--token-file", &token]);
}

/// The modules of the page with the modules that each imports.
fn page_modules() -> BTreeMap<PathBuf, Vec<PathBuf>> {
    let root = workspace().join("daemon/console/page/js");
    let mut modules = BTreeMap::new();
    let mut folders = vec![root.clone()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("the page's folder").flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = std::fs::read_to_string(&path).expect("a module is text");
            let imported = text.lines().filter(|line| line.starts_with("import "));
            let names = imported.filter_map(|line| line.rsplit('"').nth(1));
            let names = names.map(|name| folder.join(name).canonicalize().expect("an imported module exists"));
            modules.insert(path.canonicalize().expect("it was listed"), names.collect());
        }
    }
    modules
}

/// Removes all nodes that lead to no circle; the others are left.
fn circles<T: Ord + Clone>(mut graph: BTreeMap<T, Vec<T>>) -> Vec<T> {
    loop {
        let before = graph.len();
        let nodes: std::collections::BTreeSet<T> = graph.keys().cloned().collect();
        graph.retain(|_, imported| imported.iter().any(|name| nodes.contains(name)));
        if graph.len() == before {
            return graph.into_keys().collect();
        }
    }
}

#[test]
fn modules_and_folders_of_the_page_form_no_circle() {
    let modules = page_modules();
    assert!(modules.len() > 40, "only {} modules", modules.len());
    assert_eq!(circles(modules.clone()), Vec::<PathBuf>::new());
    let root = workspace().join("daemon/console/page/js").canonicalize().expect("the page's folder");
    // A module directly below js/ stands for itself.
    let room = |path: &Path| match path.parent() {
        Some(folder) if folder != root => folder.to_owned(),
        _ => path.to_owned(),
    };
    let mut folders: BTreeMap<PathBuf, Vec<PathBuf>> = BTreeMap::new();
    for (module, imported) in &modules {
        let others = imported.iter().map(|path| room(path)).filter(|other| *other != room(module));
        folders.entry(room(module)).or_default().extend(others);
    }
    assert_eq!(circles(folders), Vec::<PathBuf>::new());
}
