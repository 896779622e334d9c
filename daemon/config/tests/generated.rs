//! The stored files are equal to those that the description of the keys gives.

use std::path::{Path, PathBuf};

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Compares a stored file with `text`, or writes it.
fn check(path: &str, text: &str) {
    let file = workspace().join(path);
    if std::env::var_os("SCENECAST_UPDATE_DOCS").is_some() {
        std::fs::write(&file, text).unwrap();
    }
    let stored = std::fs::read_to_string(&file).unwrap_or_default();
    let command = "SCENECAST_UPDATE_DOCS=1 cargo test -p scenecast-config --test generated";
    assert!(stored == text, "{path} is out of date; write it again with: {command}");
}

#[test]
fn files_in_config_are_up_to_date() {
    for (path, text) in scenecast_config::shipped_files().unwrap() {
        check(path, &text);
        scenecast_config::load(Some(&workspace().join(path)), &[]).unwrap();
    }
}

#[test]
fn the_json_schema_is_up_to_date() {
    check("docs/reference/config.schema.json", &scenecast_config::schema());
}
