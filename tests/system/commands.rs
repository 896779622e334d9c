//! The command line as its user meets it.

use scenecast_tests::{assert_refused, run, scratch};
use std::path::Path;

#[test]
fn wrong_input_gets_one_line_with_the_rule() {
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
    assert_refused(
        &["sim", "--set", "survey.area_m=[500,500,600,600]", "--out", out],
        &["survey.area_m", "120 m east"],
    );
    assert_refused(&["sim", "--duration", "-5", "--out", out], &["survey.duration_s", "from 0"]);
    assert_refused(&["sim", "--duration", "5cm", "--out", out], &["--duration", "a number without a unit"]);
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
fn the_same_arguments_give_the_same_report() {
    let dir = scratch("repeat");
    let report = |name: &str| {
        let out = dir.join(name);
        let output = run(&[
            "sim",
            "--duration",
            "15",
            "--seed",
            "5",
            "--set",
            "channel.loss=0.2",
            "--set",
            "world.kind=patches",
            "--out",
            out.to_str().unwrap(),
        ]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = std::fs::read_to_string(out.join("report.json")).unwrap();
        for file in ["vehicle-map.png", "operator-map.png", "truth.png", "quality.csv", "quality.svg", "frames.log"] {
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
        &["doctor", "modem"],
        &["key", "new"],
        &["key", "show"],
        &["record", "recover"],
        &["replay"],
        &["report"],
        &["key", "token"],
        &["ctl"],
        &["ctl", "status"],
        &["ctl", "map"],
        &["ctl", "labels"],
        &["ctl", "label"],
        &["ctl", "mark", "set"],
        &["ctl", "utility", "set"],
        &["ctl", "utility", "try"],
        &["ctl", "budget", "set"],
        &["ctl", "exemplar"],
        &["ctl", "log"],
        &["ctl", "watch"],
        &["map", "encode"],
        &["map", "decode"],
        &["map", "bench"],
        &["scene", "run"],
        &["scene", "sample"],
        &["vocabulary", "train"],
        &["scene", "score"],
        &["tune"],
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
    assert!(made.starts_with(&format!("{file}: mission, fingerprint ")) && made.contains("link.key_file"), "{made}");
    assert_refused(&["key", "new", "--out", file], &[file, "not overwritten"]);
    assert_eq!(said(run(&["key", "show", file])).trim(), made.lines().next().unwrap());
    assert_refused(&["key", "show", "nowhere.key"], &["nowhere.key"]);

    let own = scratch("key-derived").join("auv-3.key");
    let own = own.to_str().unwrap();
    let derived = said(run(&["key", "derive", file, "--vehicle", "3", "--out", own]));
    let fingerprint = made.lines().next().unwrap().rsplit(' ').next().unwrap();
    assert!(derived.starts_with(&format!("{own}: vehicle 3, fingerprint {fingerprint}\n")), "{derived}");
    assert_eq!(said(run(&["key", "show", own])).trim(), derived.lines().next().unwrap());
    assert_refused(&["key", "derive", own, "--vehicle", "3", "--out", "x"], &[own, "key of a vehicle"]);
    assert_refused(&["key", "derive", file, "--vehicle", "15"], &["15", "1..=14"]);
    let set = format!("link.key_file={own}");
    for (end, why) in [("asv", "the mission key"), ("auv", "this is vehicle 1")] {
        let config = scenecast_tests::workspace().join("config").join(end).with_extension("toml");
        // The page's port may be in use on this computer.
        let port: &[&str] = if end == "asv" { &["--set", "console.listen=127.0.0.1:0"] } else { &[] };
        assert_refused(&[&[end, "--config", config.to_str().unwrap(), "--set", &set], port].concat(), &[own, why]);
    }
}

#[test]
fn a_misspelt_option_is_answered_with_the_nearest_one() {
    assert_refused(&["sim", "--sede", "3", "--out", "x"], &["--sede", "--seed"]);
    assert_refused(&["simm"], &["simm", "sim"]);
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
        scenecast_config::load(Some(&root.join(file)), &[]).unwrap_or_else(|e| panic!("{e}"));
    }
}

/// A mosaic of 160 x 120 with two kinds of ground, and their classes.
fn two_grounds(dir: &Path, name: &str) -> (String, String) {
    let (mosaic, labels) = (dir.join(format!("{name}.png")), dir.join(format!("{name}_label.png")));
    let speckle = |x: u32, y: u32| ((x * 31 + y * 17) % 40) as u8;
    let ground = |x: u32, y: u32| (x / 40 + y / 60).is_multiple_of(2);
    let colour = |x, y| if ground(x, y) { [60, 90 + speckle(x, y), 140] } else { [150 + speckle(y, x), 110, 60] };
    image::RgbImage::from_fn(160, 120, |x, y| image::Rgb(colour(x, y))).save(&mosaic).unwrap();
    image::GrayImage::from_fn(160, 120, |x, y| image::Luma([u8::from(ground(x, y))])).save(&labels).unwrap();
    (mosaic.to_str().unwrap().to_owned(), labels.to_str().unwrap().to_owned())
}

#[test]
fn annotated_images_are_scored_and_wrong_ones_named() {
    let dir = scratch("score");
    let folder = dir.to_str().unwrap();
    assert_refused(&["scene", "score", "--dir", folder], &["no NAME_label.png"]);
    two_grounds(&dir, "reef");
    let output = run(&["scene", "score", "--dir", folder, "--seeds", "1", "--cells-across", "20", "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["scenes"][0]["cells"], 20 * 15);
    for method in ["habitats", "scene_model", "kmeans_lab", "kmeans_pooled_words"] {
        let excess = report["median"][method]["excess_nats"].as_f64().unwrap();
        // The classes themselves have 0.45 on so small a ground: 0.69 less what a shifted copy tells.
        assert!(excess > 0.3, "{method}: {excess} of 0.45");
    }
    image::GrayImage::new(9, 9).save(dir.join("reef_label.png")).unwrap();
    assert_refused(&["scene", "score", "--dir", folder], &["reef_label.png", "9 x 9", "160 x 120"]);
    image::GrayImage::new(1, 1).save(dir.join("reef_label.png")).unwrap();
    image::RgbImage::new(1, 1).save(dir.join("reef.png")).unwrap();
    assert_refused(&["scene", "score", "--dir", folder], &["reef.png", "1 x 1", "16 x 16"]);
}

#[test]
fn tuning_continues_where_it_was_and_gives_a_configuration() {
    let dir = scratch("tune");
    let (mosaic, labels) = two_grounds(&dir, "reef");
    let (grid, out) = (dir.join("grid.toml"), dir.join("out"));
    std::fs::write(&grid, "max_labels = [4, 8]\ncell_m = [0.08]\n").unwrap();
    let tune = |more: &[&str]| {
        let common = ["tune", "--mosaic", &mosaic, "--annotations", &labels, "--metres-per-pixel", "0.01"];
        let rest = ["--grid", grid.to_str().unwrap(), "--sweeps", "5", "--out", out.to_str().unwrap()];
        [&common[..], &rest, more].concat().into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    let run_with = |more: &[&str]| run(&tune(more).iter().map(String::as_str).collect::<Vec<_>>());
    let first = run_with(&[]);
    assert!(first.status.success(), "{}", String::from_utf8_lossy(&first.stderr));
    let csv = std::fs::read_to_string(out.join("tuning.csv")).unwrap();
    assert_eq!(csv.lines().count(), 4);
    let shorter: Vec<&str> = csv.lines().take(3).collect();
    std::fs::write(out.join("tuning.csv"), shorter.join("\n") + "\n").unwrap();
    let again = run_with(&[]);
    assert!(String::from_utf8_lossy(&again.stderr).contains("1 of 2 settings are in tuning.csv already"));
    assert_eq!(std::fs::read_to_string(out.join("tuning.csv")).unwrap(), csv, "the same figures again");
    let best = out.join("best.toml");
    let other = tune(&["--seed", "2"]);
    assert_refused(&other.iter().map(String::as_str).collect::<Vec<_>>(), &["tuning.csv:3", "another"]);
    let sim = run(&[
        "sim",
        "--scenario",
        best.to_str().unwrap(),
        "--duration",
        "5",
        "--out",
        dir.join("s").to_str().unwrap(),
    ]);
    assert!(sim.status.success(), "{}", String::from_utf8_lossy(&sim.stderr));
    let map = |labels: u32| format!("maps/cell_m-0.08_at-most-{labels}-labels_0.5-frames-s_fine-cells.png");
    for picture in ["tuning.svg", "tuning.png", &map(4), &map(8)] {
        assert!(out.join(picture).is_file(), "{picture}");
    }
    assert_eq!(run_with(&["--budget", "0.001"]).status.code(), Some(1));
    assert!(!best.exists(), "what does not fit the budget is not left to pass for the answer");

    std::fs::remove_file(out.join("tuning.csv")).unwrap();
    std::fs::write(&grid, "alpha = [0.1]\nbeta = [0.1]\ngamma = [1e-4]\ncell_m = [0.08]\n").unwrap();
    let refused = tune(&[]);
    assert_refused(&refused.iter().map(String::as_str).collect::<Vec<_>>(), &["grid.toml", "set it to topics"]);
    let topics = run_with(&["--set", "scene.labels=topics"]);
    assert!(topics.status.success(), "{}", String::from_utf8_lossy(&topics.stderr));
    assert!(std::fs::read_to_string(&best).unwrap().contains("alpha = 0.1"));
}

#[test]
fn without_a_command_the_list_of_commands_is_printed() {
    let output = run(&[]);
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(text.contains("Usage: scenecast") && text.contains("Run a simulated mission in real time"), "{text}");
    assert_refused(&["demoo"], &["demoo", "demo"]);
    assert_refused(&["sim", "--durration", "5"], &["--durration", "--duration"]);
}

#[test]
fn the_version_has_the_commit_and_the_version_of_the_wire() {
    let text = |argument| String::from_utf8(run(&[argument]).stdout).unwrap();
    let version = env!("CARGO_PKG_VERSION");
    assert_eq!(text("-V"), format!("scenecast {version}\n"));
    let long = text("--version");
    let wire = scenecast_protocol::wire::WIRE_VERSION;
    let commit = long.strip_prefix(&format!("scenecast {version} (commit ")).unwrap_or_else(|| panic!("{long}"));
    let commit = commit.strip_suffix(&format!(", wire version {wire})\n")).unwrap_or_else(|| panic!("{long}"));
    assert!(commit == "unknown" || (commit.len() >= 12 && commit.chars().all(|c| c.is_ascii_hexdigit())), "{long}");
}

#[test]
fn bash_completes_commands_and_options() {
    let dir = scratch("completions");
    let script = dir.join("scenecast.bash");
    std::fs::write(&script, run(&["completions", "bash"]).stdout).unwrap();
    let complete = |words: &[&str]| {
        let (count, last) = (words.len() - 1, words[words.len() - 1]);
        let before = words[count - 1];
        let line = format!(
            "source {}; COMP_WORDS=({}); COMP_CWORD={count}; _scenecast scenecast '{last}' '{before}'; echo \"${{COMPREPLY[@]}}\"",
            script.display(),
            words.join(" "),
        );
        let output = std::process::Command::new("bash").args(["-c", &line]).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    };
    assert_eq!(complete(&["scenecast", "de"]), "demo");
    assert_eq!(complete(&["scenecast", "bench", "fide"]), "fidelity");
    assert_eq!(complete(&["scenecast", "sim", "--mos"]), "--mosaic");
}

#[test]
fn every_command_has_a_manual_page() {
    let dir = scratch("man");
    let output = run(&["man", "--out", dir.to_str().unwrap()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for page in ["scenecast.1", "scenecast-demo.1", "scenecast-ctl-utility-set.1"] {
        let text = std::fs::read_to_string(dir.join(page)).unwrap_or_else(|e| panic!("{page}: {e}"));
        assert!(text.contains(".TH") && text.contains(".SH OPTIONS"), "{page}: {text}");
    }
}

#[test]
fn progress_comes_as_lines_of_json_with_a_growing_share() {
    let dir = scratch("progress");
    let out = dir.join("out");
    let settings = ["--duration", "20", "--set", "world.kind=patches", "--progress", "json"];
    let output = run(&[&["sim", "--out", out.to_str().unwrap()], &settings[..]].concat());
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{text}");
    let lines: Vec<serde_json::Value> =
        text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{line}: {e}"))).collect();
    let shares: Vec<f64> = lines.iter().map(|line| line["share"].as_f64().unwrap()).collect();
    assert!(lines.iter().all(|line| line["task"] == "survey"), "{text}");
    assert!(shares.is_sorted() && shares.last() == Some(&1.0), "{text}");
}
