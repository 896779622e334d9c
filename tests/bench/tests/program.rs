//! The program as its user meets it, and its command lines in the documents.

use scenecast_tests::pages::command_faults;
use scenecast_tests::{is_full, python, run_script, scratch};
use std::process::{Command, Output};

fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_scenecast-bench")).args(arguments).output().expect("scenecast-bench runs")
}

#[test]
fn every_command_line_of_the_documents_parses() {
    let faults = command_faults::<scenecast_bench::Arguments>("scenecast-bench");
    assert!(faults.is_empty(), "\n{}\n", faults.join("\n"));
}

#[test]
fn a_missing_program_is_named_in_one_line() {
    let output = run(&["restart", "--program", "/nowhere/scenecast"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.lines().count() == 1 && said.contains("/nowhere/scenecast") && said.contains("cargo build"), "{said}");
}

#[test]
fn exports_of_a_wide_survey_have_each_cell_in_its_place() {
    let out = scratch("exports-wide").display().to_string();
    let made = run(&["wide", "--cells", "12000", "--out", &out, "--json"]);
    assert_eq!(made.status.code(), Some(0), "{}", String::from_utf8_lossy(&made.stderr));
    let Some(python) = python("plyfile, rasterio, shapely") else { return };
    run_script(&python, "tests/exports/wide.py", &[&out, "60.17", "-10.25"]);
}

/// Needs the program `scenecast` beside this one, which Cargo builds for the tests of its package.
#[test]
fn a_replay_equals_its_mission_and_a_cut_takes_two_seconds() {
    let judged = run(&["record", "--missions", "1", "--seed", "4", "--duration", "90", "--cuts", "6", "--json"]);
    assert!(judged.status.success(), "{}", String::from_utf8_lossy(&judged.stderr));
    let rows: serde_json::Value = serde_json::from_slice(&judged.stdout).unwrap();
    assert!(rows[0]["compared"].as_u64() > Some(180) && rows[0]["cuts"].as_u64() > Some(3), "{rows}");
}

#[test]
fn restarts_of_either_end_lose_nothing_and_repeat_no_order() {
    let (runs, page_limit_s) = if is_full() { ("20", "2") } else { ("3", "60") };
    let output = run(&["restart", "--runs", runs, "--page-limit", page_limit_s]);
    let figures = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{figures}{}", String::from_utf8_lossy(&output.stderr));
    println!("{figures}");
}
