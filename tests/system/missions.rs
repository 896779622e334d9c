//! Rehearsed missions.

use proptest::prelude::*;
use scenecast_config::Config;
use scenecast_protocol::map::LayerId;
use scenecast_protocol::time::Instant;
use scenecast_rehearsal::{Mission, MissionOptions, World, report};
use scenecast_tests::{is_full, scratch, shared_data};
use serde_json::Value;
use std::path::Path;
use std::time::Duration;

fn config(sets: &[&str]) -> Config {
    let small =
        ["survey.duration_s=120", "camera.width_px=320", "camera.height_px=240", "scene.refine_words_per_s=20000"];
    let sets: Vec<String> = small.iter().chain(sets).map(|s| (*s).to_owned()).collect();
    scenecast_config::load(None, &sets).unwrap()
}

/// A small reef, drawn once.
fn reef() -> World {
    static REEF: std::sync::OnceLock<World> = std::sync::OnceLock::new();
    REEF.get_or_init(|| World::patches(5, 0.01)).clone()
}

fn fly(sets: &[&str], seed: u64) -> Value {
    let mut mission = Mission::new(config(sets), MissionOptions { world: reef(), seed, record: None }).unwrap();
    mission.run(Duration::from_secs(7200), &mut |_| Ok(())).unwrap();
    report(&mission, "test").json
}

fn assert_sound(figures: &Value) {
    assert_eq!(figures["map"]["agreement_final"], 1.0, "{figures}");
    assert_eq!(figures["directives"]["applied_twice"], 0);
    let link = &figures["link"];
    for end in ["up", "down"] {
        let limit = link["budget_bps"].as_f64().unwrap() * link["budget_window_s"].as_f64().unwrap();
        let largest = link[end]["largest_transmission_bits"].as_f64().unwrap();
        let worst = link[end]["max_window_bps"].as_f64().unwrap() * link["budget_window_s"].as_f64().unwrap();
        assert!(worst <= limit + largest, "{end}: {worst} bits in a window");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: if is_full() { 18 } else { 3 }, ..ProptestConfig::default() })]

    #[test]
    fn maps_are_equal_once_the_channel_has_drained(
        seed in 0u64..1000,
        loss in prop_oneof![Just("0"), Just("0.1"), Just("0.3")],
        frame in prop_oneof![Just("64"), Just("256"), Just("1000")],
        codec in prop_oneof![Just("png"), Just("context")],
        budget in prop_oneof![Just("300"), Just("2000"), Just("10000")],
    ) {
        let sets = [
            format!("channel.loss={loss}"), format!("link.frame_bytes={frame}"), format!("map.codec={codec}"),
            format!("link.budget_bps={budget}"), "channel.duplication=0.1".into(), "channel.reordering=0.1".into(),
            "channel.corruption=0.05".into(),
        ];
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        assert_sound(&fly(&sets, seed));
    }
}

#[test]
fn whole_missions_pass_with_either_codec() {
    let sets = ["channel.loss=0.2", "link.frame_bytes=256"];
    let [png, context] = ["png", "context"].map(|codec| {
        let figures = fly(&[&sets[..], &[&format!("map.codec={codec}")]].concat(), 6);
        assert_sound(&figures);
        figures["map"]["payload_bytes"].as_u64().unwrap()
    });
    assert!(context < png, "{context} bytes with context, {png} with png");
}

#[test]
fn layers_arrive_and_labels_do_not_wait_for_them() {
    let without = fly(&["map.layers=[]"], 8);
    assert_eq!(without["map"]["layers"], serde_json::json!({}));
    for sets in [&["map.layer_shares={}"], &["map.layer_shares={ confidence = 10, depth = 5 }"]] {
        let with = fly(sets, 8);
        assert_sound(&with);
        for layer in ["confidence", "depth"] {
            let layer = &with["map"]["layers"][layer];
            assert_eq!(layer["agreement_final"], 1.0, "{layer}");
            assert!(layer["agreement_mean"].as_f64().unwrap() > 0.8, "{layer}");
            assert_eq!(layer["cells"], with["survey"]["explored_cells"]);
        }
        let mean = |figures: &Value| figures["map"]["agreement_mean"].as_f64().unwrap();
        assert!(mean(&with) > mean(&without) - 0.02, "{} with layers, {} without", mean(&with), mean(&without));
    }
}

#[test]
fn curiosity_is_sent_only_with_a_share_or_as_background() {
    let without = fly(&[], 8);
    assert_eq!(without.to_string(), fly(&[r#"map.layers=["confidence", "depth"]"#], 8).to_string());
    assert_eq!(without["map"]["layers"]["curiosity"], Value::Null);
    for sets in [
        r#"link.background=["finer", "depth", "exemplars", "confidence", "curiosity"]"#,
        "map.layer_shares.curiosity=10",
    ] {
        let with = fly(&[sets], 8);
        assert_sound(&with);
        let layer = &with["map"]["layers"]["curiosity"];
        assert_eq!((&layer["agreement_final"], &layer["cells"]), (&1.0.into(), &with["survey"]["explored_cells"]));
        let mean = |figures: &Value| figures["map"]["agreement_mean"].as_f64().unwrap();
        assert!(mean(&with) > mean(&without) - 0.02, "{} with curiosity, {} without", mean(&with), mean(&without));
    }
}

#[test]
fn levels_of_curiosity_tell_the_cells_of_a_reef_apart() {
    let config = config(&[r#"link.background=["curiosity"]"#]);
    let mut mission = Mission::new(config, MissionOptions { world: reef(), seed: 8, record: None }).unwrap();
    mission.advance(Instant::from_secs_f64(119.0)).unwrap();
    let vehicle = mission.vehicle();
    let layer = vehicle.layers().find(|p| p.id() == LayerId::CURIOSITY).unwrap();
    let mut cells = [0; 17];
    layer.target().iter().for_each(|(_, level)| cells[usize::from(level)] += 1);
    let common = cells.iter().filter(|&&n| n * 20 > layer.target().explored()).count();
    assert!((3..=6).contains(&common), "{cells:?}");
}

#[test]
fn the_same_seed_gives_the_same_report() {
    let fly = |seed: u64| fly(&["channel.loss=0.2", "survey.duration_s=60"], seed).to_string();
    let first = fly(7);
    assert_eq!(first, fly(7));
    assert_ne!(first, fly(8));
}

#[test]
fn orders_and_fixes_reach_the_vehicle_and_replies_return() {
    let figures = fly(&["survey.duration_s=400"], 4);
    assert_sound(&figures);
    assert_eq!(figures["directives"]["issued"], figures["directives"]["applied"], "{figures}");
    assert!(figures["directives"]["issued"].as_u64() >= Some(4));
    assert_eq!(figures["exemplars"]["requested"], figures["exemplars"]["delivered"]);
    assert!(figures["exemplars"]["delivered"].as_u64() >= Some(2));
    assert!(figures["fixes"]["applied"].as_u64() >= Some(30));
    assert!(figures["scene"]["labels"].as_u64() >= Some(2));
    // The map takes far fewer bytes than whole PNGs.
    let payload = figures["map"]["payload_bytes"].as_f64().unwrap();
    assert!(payload < figures["map"]["png_full_bytes"].as_f64().unwrap() / 10.0, "{figures}");
}

/// How far the vehicle is from where it believes to be in the second half of 400 s, metres, on the mean of each 10 s.
fn position_error(sets: &[&str]) -> f64 {
    let mut config = config(sets);
    config.operator.script = scenecast_config::OperatorScript::None;
    let mut mission = Mission::new(config, MissionOptions { world: reef(), seed: 11, record: None }).unwrap();
    let errors = (20..40).map(|tens| {
        mission.advance(Instant::from_secs_f64(10.0 * f64::from(tens))).unwrap();
        mission.position_error_m()
    });
    errors.sum::<f64>() / 20.0
}

#[test]
fn without_fixes_dead_reckoning_drifts_and_fixes_correct_it() {
    let sets = ["survey.duration_s=400", "navigation.drift_percent=15", "registration.enabled=false"];
    let adrift = position_error(&[&sets[..], &["navigation.fix_period_s=0"]].concat());
    let fixed = position_error(&sets);
    assert!(adrift > 3.0 * fixed && adrift > 1.0, "{adrift} m without fixes, {fixed} m with");
    assert!(fixed < 1.0, "{fixed} m: a fix is good to half a metre");
}

#[test]
fn registration_keeps_the_position_without_fixes() {
    let sets = ["survey.duration_s=400", "navigation.drift_percent=15", "navigation.fix_period_s=0"];
    let registered = position_error(&sets);
    assert!(registered < 0.4, "{registered} m without fixes");
}

/// Surveys an annotated mosaic that is read from files; the labels hold so much information on the classes.
fn assert_annotated_files_are_surveyed(image: &Path, classes: &Path, at_least_nats: f64) {
    let world = World::from_files(image, Some(classes), 0.01).unwrap();
    let mut mission =
        Mission::new(config(&["survey.duration_s=200"]), MissionOptions { world, seed: 1, record: None }).unwrap();
    mission.run(Duration::from_secs(7200), &mut |_| Ok(())).unwrap();
    let figures = report(&mission, "test").json;
    assert_sound(&figures);
    assert!(figures["scene"]["labels"].as_u64() > Some(1));
    assert!(figures["scene"]["mutual_information_nats"].as_f64() > Some(at_least_nats), "{figures}");
}

#[test]
fn a_drawn_mosaic_in_files_is_surveyed_into_more_than_one_label() {
    let (dir, drawn) = (scratch("drawn-mosaic"), scenecast_worlds::patches(3, 1200, 900, 180, 5));
    let (image, classes) = (dir.join("reef.png"), dir.join("reef_label.png"));
    drawn.image.save(&image).unwrap();
    image::GrayImage::from_raw(1200, 900, drawn.truth).unwrap().save(&classes).unwrap();
    assert_annotated_files_are_surveyed(&image, &classes, 0.2);
}

#[test]
fn a_real_reef_is_surveyed_into_more_than_one_label() {
    let Some(data) = shared_data() else { return };
    let file = |name: &str| data.join("eilatmixx").join(name);
    assert_annotated_files_are_surveyed(&file("LFT_0109.jpg"), &file("LFT_0109_label.png"), 0.02);
}

#[test]
fn a_fenced_vehicle_stays_inside_keeps_its_limit_and_reports_it() {
    for planner in ["lawnmower", "greedy", "horizon"] {
        let planner = format!("survey.planner={planner}");
        let sets = ["operator.script=fenced", "survey.duration_s=200", "channel.loss=0.2", &planner];
        let mut mission = Mission::new(config(&sets), MissionOptions { world: reef(), seed: 5, record: None }).unwrap();
        mission.advance(scenecast_protocol::time::Instant::from_secs_f64(199.0)).unwrap();
        let figures = report(&mission, "test").json;
        assert_eq!(figures["survey"]["waypoints_outside_fence"], 0, "{figures}");
        assert!(figures["survey"]["waypoints"].as_u64() > Some(4), "{figures}");
        // Half of what it could go, of which the first orders took a little to arrive.
        assert!(mission.distance_m() < 0.5 * 200.0 * 0.5 + 15.0, "{} m", mission.distance_m());
        let (mode, reason) = mission.vehicle().mode();
        assert!(reason == scenecast_protocol::wire::ModeReason::Distance, "{mode:?}: {reason:?}");
    }
}
