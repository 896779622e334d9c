//! The command line as its user meets it.

use scenecast_tests::{assert_refused, run, scratch};
use std::path::Path;

#[test]
fn wrong_input_is_answered_with_one_line_that_says_what_is_allowed() {
    let dir = scratch("wrong-input");
    let out = dir.join("out");
    let out = out.to_str().unwrap();
    let text = dir.join("no-image.png");
    std::fs::write(&text, "hello").unwrap();
    let scenario = dir.join("scenario.toml");
    std::fs::write(&scenario, "[link]\n\nframe_bytes = 9\n").unwrap();
    let misspelt = dir.join("misspelt.toml");
    std::fs::write(&misspelt, "[link]\nbugdet_bps = 1000\n").unwrap();
    let path = |p: &Path| p.to_str().unwrap().to_owned();
    assert_refused(&["sim", "--mosaic", "nowhere.png", "--out", out], &["nowhere.png"]);
    assert_refused(&["sim", "--mosaic", &path(&text), "--out", out], &["no-image.png", "not an image"]);
    assert_refused(&["sim", "--scenario", "nowhere.toml", "--out", out], &["nowhere.toml"]);
    assert_refused(
        &["sim", "--scenario", &path(&scenario), "--out", out],
        &["scenario.toml:3", "link.frame_bytes", "32 to 1024"],
    );
    assert_refused(
        &["sim", "--scenario", &path(&misspelt), "--out", out],
        &["misspelt.toml:2", "link.bugdet_bps", "link.budget_bps"],
    );
    assert_refused(&["sim", "--set", "channel.loss=2", "--out", out], &["channel.loss", "0 to 0.99"]);
    assert_refused(&["sim", "--set", "map.codec=jpeg", "--out", out], &["map.codec", "auto, png, context"]);
    assert_refused(&["sim", "--duration", "nan", "--out", out], &["survey.duration_s"]);
    assert_refused(&["sim", "--set", "survey.area_m=[5,5,1,1]", "--out", out], &["survey.area_m", "at least 1 m"]);
    assert_refused(&["sim", "--set", "survey.area_m=[500,500,600,600]", "--out", out], &["survey.area_m", "26 m east"]);
    assert_refused(&["sim", "--duration", "-5", "--out", out], &["survey.duration_s", "from 0"]);
    assert_refused(&["sim"], &["--out"]);
    assert_refused(&["auv", "--config", "nowhere.toml"], &["nowhere.toml"]);
    assert!(!dir.join("out").exists(), "nothing was written");
}

#[test]
fn annotations_of_another_size_are_refused() {
    let dir = scratch("annotations");
    let (mosaic, labels) = (dir.join("mosaic.png"), dir.join("labels.png"));
    image::RgbImage::new(200, 100).save(&mosaic).unwrap();
    image::GrayImage::new(100, 100).save(&labels).unwrap();
    let out = dir.join("out");
    let arguments = [
        "sim",
        "--mosaic",
        mosaic.to_str().unwrap(),
        "--annotations",
        labels.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ];
    assert_refused(&arguments, &["labels.png", "100 x 100", "200 x 100"]);
    assert!(!out.exists());
}

#[test]
fn a_port_in_use_is_named() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    assert_refused(&["demo", "--port", &port, "--duration", "60"], &[&port, "--port"]);
}

#[test]
fn the_same_arguments_give_the_same_report_byte_for_byte_but_for_the_wall_clock() {
    let dir = scratch("repeat");
    let report = |name: &str| {
        let out = dir.join(name);
        let output = run(&[
            "sim",
            "--duration",
            "40",
            "--seed",
            "5",
            "--set",
            "channel.loss=0.2",
            "--out",
            out.to_str().unwrap(),
        ]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = std::fs::read_to_string(out.join("report.json")).unwrap();
        for file in ["vehicle-map.png", "operator-map.png", "truth.png", "frames.log"] {
            assert!(out.join(file).is_file(), "{file}");
        }
        let size = |f: &str| image::image_dimensions(out.join(f)).unwrap();
        assert_eq!(size("vehicle-map.png"), size("operator-map.png"));
        text.split("\"wall\"").next().unwrap().to_owned()
    };
    assert_eq!(report("first"), report("second"));
}

#[test]
fn every_command_has_help_with_an_example() {
    for command in [
        &["demo"][..],
        &["sim"],
        &["auv"],
        &["asv"],
        &["bench", "fidelity"],
        &["bench", "link"],
        &["config"],
        &["key", "new"],
        &["key", "show"],
        &["key", "token"],
        &["ctl"],
        &["ctl", "status"],
        &["ctl", "map"],
        &["ctl", "labels"],
        &["ctl", "utility", "set"],
        &["ctl", "budget", "set"],
        &["ctl", "exemplar"],
        &["ctl", "watch"],
        &["map", "encode"],
        &["map", "decode"],
        &["map", "bench"],
        &["map", "train-prior"],
    ] {
        let output = run(&[command, &["--help"]].concat());
        assert!(output.status.success());
        assert!(String::from_utf8_lossy(&output.stdout).contains("Example: scenecast"), "{command:?}");
    }
}

#[test]
fn a_key_is_made_once_and_shown() {
    let file = scratch("key").join("mission.key");
    let file = file.to_str().unwrap();
    let said = |output: std::process::Output| String::from_utf8_lossy(&output.stdout).into_owned();
    let made = said(run(&["key", "new", "--out", file]));
    assert!(made.starts_with(&format!("{file}: fingerprint ")) && made.contains("link.key_file"), "{made}");
    assert_refused(&["key", "new", "--out", file], &[file, "not overwritten"]);
    assert_eq!(said(run(&["key", "show", file])).trim(), made.lines().next().unwrap());
    assert_refused(&["key", "show", "nowhere.key"], &["nowhere.key"]);
}

#[test]
fn the_configuration_files_that_ship_are_accepted() {
    let root = scenecast_tests::workspace().join("config");
    let files = [
        "auv.toml",
        "asv.toml",
        "scenarios/default.toml",
        "scenarios/shallow-harbour.toml",
        "scenarios/deep-wreck.toml",
    ];
    for file in files {
        scenecast::config::load(Some(&root.join(file)), &[]).unwrap_or_else(|e| panic!("{e}"));
    }
}
