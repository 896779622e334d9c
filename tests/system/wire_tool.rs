//! `scenecast wire` as its user meets it, with the captures of `protocol/vectors`.

use scenecast_tests::{assert_refused, run, scratch};
use serde_json::Value;
use std::path::PathBuf;

fn vectors(name: &str) -> String {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../protocol/vectors");
    folder.join(name).to_str().unwrap().to_owned()
}

/// What the command prints, line by line.
fn lines(arguments: &[&str]) -> Vec<String> {
    let output = run(&[&["wire", "decode"][..], arguments].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect()
}

#[test]
fn each_frame_of_a_capture_is_verified_and_shown() {
    let vectors_text = std::fs::read_to_string(vectors("frames.json")).unwrap();
    let expected: Value = serde_json::from_str(&vectors_text).unwrap();
    let key = scratch("wire-decode").join("mission.key");
    std::fs::write(&key, "scenecast-key 2 000102030405060708090a0b0c0d0e0f 95fb836d\n").unwrap();
    let options = ["--mission", "0x5CE70001", "--key", key.to_str().unwrap()];
    let capture = vectors("frames.pcap");
    let texts = lines(&[&[capture.as_str()], &options[..]].concat());
    let objects = lines(&[&[capture.as_str(), "--json"], &options[..]].concat());
    let expected = expected["frames"].as_array().unwrap();
    assert_eq!((texts.len(), objects.len()), (expected.len(), expected.len()));
    for ((text, object), vector) in texts.iter().zip(&objects).zip(expected) {
        let object: Value = serde_json::from_str(object).unwrap();
        assert_eq!(object["bytes"], vector["bytes"]);
        let is_right = object["check"].as_str().is_some_and(|check| text.contains(check) && check.ends_with(" right"));
        let is_sound = is_right && object["error"].is_null();
        assert_eq!(is_sound, !vector["says"].is_null(), "{}: {text}", vector["name"]);
        if !is_sound {
            continue;
        }
        let payloads = |frame: &Value| -> Vec<Value> {
            frame["chunks"].as_array().unwrap().iter().map(|chunk| chunk["payload"].clone()).collect()
        };
        assert_eq!(payloads(&object), payloads(&vector["says"]), "{}", vector["name"]);
    }
    let answer = &texts[4];
    for said in ["vehicle 1 > surface", "number 1", "ack 2", "constraints 1 applied", "mode hold", "x_m 1.5"] {
        assert!(answer.contains(said), "{said}: {answer}");
    }
}

#[test]
fn a_text_without_a_mission_is_shown_unchecked() {
    let text = scratch("wire-text").join("frames.txt");
    std::fs::write(&text, "# a call\n8c 0f c0 de 00 00 01 00 08 05 ae cd\n00\n").unwrap();
    let shown = lines(&[text.to_str().unwrap()]);
    assert!(shown[0].contains("surface > everybody, unchecked, hello c0de, turn_s 2.0"), "{}", shown[0]);
    assert!(shown[1].ends_with("the frame is too short"), "{}", shown[1]);
}

#[test]
fn a_wrong_capture_is_refused_with_its_line() {
    let text = scratch("wire-refused").join("frames.txt");
    std::fs::write(&text, "8c0f\n\n8c0\n").unwrap();
    let name = text.to_str().unwrap();
    assert_refused(&["wire", "decode", name], &["line 3", "hexadecimal"]);
    assert_refused(&["wire", "decode", name, "--mission", "reef"], &["0 to 4294967295"]);
}
