//! The state machine against an autopilot that is made of bytes.

use super::*;
use proptest::prelude::*;

fn at(s: f64) -> Instant {
    Instant::from_secs_f64(10.0 + s)
}

fn pilot(arms: bool) -> Mavlink {
    Mavlink::new(MavlinkConfig { system: 1, component: None, arms, silence: Duration::from_secs(5) }, at(0.0))
}

fn frame_of(system: u8, component: u8, id: u32, payload: Vec<u8>) -> Vec<u8> {
    encode(&Frame { system, component, id, payload, is_signed: false }, 0, heard_extra(id).unwrap())
}

fn frame(system: u8, id: u32, payload: Vec<u8>) -> Vec<u8> {
    frame_of(system, 1, id, payload)
}

fn heartbeat(mode: u32, armed: bool) -> Vec<u8> {
    let base_mode = if armed { 0x81 } else { 1 };
    frame(1, 0, [&mode.to_le_bytes()[..], &[12, 3, base_mode, 4, 3]].concat())
}

fn local(ms: u32, place: [f32; 3], velocity: [f32; 3]) -> Vec<u8> {
    let floats = place.into_iter().chain(velocity).flat_map(f32::to_le_bytes);
    frame(1, 32, ms.to_le_bytes().into_iter().chain(floats).collect())
}

/// A position on the Earth without velocity and heading.
fn global(ms: i32, depth_mm: i32) -> Vec<u8> {
    let fields: Vec<u8> = [ms, 295_000_000, 349_200_000, 0, -depth_mm].iter().flat_map(|v| v.to_le_bytes()).collect();
    frame(1, 33, [&fields[..], &[0, 0, 0, 0, 0, 0, 0xFF, 0xFF]].concat())
}

/// An attitude with its bow at this angle.
fn attitude(ms: u32, yaw: f32) -> Vec<u8> {
    let angles = [0.0, 0.0, yaw].into_iter().flat_map(f32::to_le_bytes);
    frame(1, 30, ms.to_le_bytes().into_iter().chain(angles).collect())
}

/// Everything that was sent, as message number and payload.
fn sent(pilot: &mut Mavlink) -> Vec<(u32, Vec<u8>)> {
    let mut deframer = Deframer::default();
    let mut found = Vec::new();
    let extra = |id| [(0, 50), (76, 152), (84, 143), (86, 5), (232, 151)].into_iter().find(|e| e.0 == id).map(|e| e.1);
    while let Some(bytes) = pilot.poll_output() {
        deframer.push(&bytes, extra, |f| found.push((f.id, f.payload)));
    }
    assert_eq!(deframer.refused(), frame::Refused::default());
    found
}

/// The targets that were sent: north, east, down.
fn targets_of(pilot: &mut Mavlink) -> Vec<[f32; 3]> {
    let targets = sent(pilot).into_iter().filter(|(id, _)| *id == 84);
    targets.map(|(_, p)| [4, 8, 12].map(|i| f32::from_le_bytes(p[i..i + 4].try_into().unwrap()))).collect()
}

fn count(sent: &[(u32, Vec<u8>)], id: u32) -> usize {
    sent.iter().filter(|(i, _)| *i == id).count()
}

const GOAL: Option<Goal> = Some(Goal { east_m: 10.0, north_m: 0.0, depth_m: Some(5.0), place: None });

#[test]
fn it_sends_heartbeats_requests_streams_and_arms_if_allowed() {
    for arms in [false, true] {
        let mut pilot = pilot(arms);
        pilot.handle_timeout(at(0.0));
        assert_eq!(sent(&mut pilot).len(), 1, "a heartbeat, and nothing to a stranger");
        pilot.set_goal(GOAL, at(0.5));
        pilot.handle_bytes(&heartbeat(19, false), at(0.5));
        pilot.handle_bytes(&local(500, [0.0; 3], [0.0; 3]), at(0.5));
        pilot.handle_timeout(at(1.0));
        let said = sent(&mut pilot);
        let commands: Vec<u16> =
            said.iter().filter(|(id, _)| *id == 76).map(|(_, p)| u16::from_le_bytes([p[28], p[29]])).collect();
        let (streams, rest) = commands.split_at(STREAMS.len());
        assert!(streams.iter().all(|command| *command == INTERVAL), "{streams:?}");
        assert_eq!(rest, if arms { &[SET_MODE, ARM][..] } else { &[] });
        assert_eq!((pilot.health(at(1.0)), count(&said, 84)), (Health::NotInCommand, 0));
    }
}

#[test]
fn a_target_is_repeated_each_second_in_the_autopilots_frame() {
    let mut pilot = pilot(true);
    pilot.set_goal(GOAL, at(0.0));
    pilot.handle_bytes(&heartbeat(4, true), at(0.0));
    let mut targets = Vec::new();
    for s in 0..4 {
        // Under way to the east at 1 m/s; at 2 s the autopilot takes a fix in and its frame jumps by 100 m.
        let jump = if s >= 2 { 100.0 } else { 0.0 };
        pilot.handle_bytes(&heartbeat(4, true), at(f64::from(s)));
        pilot.handle_bytes(&local(1000 * s as u32, [jump, s as f32 + jump, 4.0], [0.0, 1.0, 0.0]), at(f64::from(s)));
        pilot.handle_timeout(at(f64::from(s)));
        targets.extend(targets_of(&mut pilot));
    }
    // At 2 s it is open whether the position is false, and the last target stays.
    assert_eq!(targets, [[0.0, 10.0, 5.0], [0.0, 10.0, 5.0], [100.0, 110.0, 5.0]]);
    let steps: Vec<Step> = std::iter::from_fn(|| pilot.poll_step()).collect();
    assert_eq!(steps.len(), 3);
    assert!(steps.iter().all(|s| s.dx_m == 1.0 && s.dy_m == 0.0 && s.depth_m == Some(4.0)), "{steps:?}");
}

#[test]
fn time_without_measurements_is_reported_as_unseen() {
    let mut pilot = pilot(false);
    let east = |ms: u32, s: f64, pilot: &mut Mavlink| {
        pilot.handle_bytes(&local(ms, [0.0; 3], [0.0, 1.0, 0.0]), at(s));
        let step = pilot.poll_step().map(|s| (s.dx_m, s.unseen.as_secs()));
        assert_eq!(pilot.poll_step(), None);
        step
    };
    pilot.handle_bytes(&heartbeat(4, true), at(0.0));
    assert_eq!(east(1000, 0.0, &mut pilot), None);
    assert_eq!(east(2000, 1.0, &mut pilot), Some((1.0, 0)));
    assert_eq!(east(62_000, 61.0, &mut pilot), Some((0.0, 60)), "a minute of silence");
    assert_eq!(east(500, 91.0, &mut pilot), Some((0.0, 30)), "its clock began anew: it was off");
    assert_eq!(east(1500, 92.0, &mut pilot), Some((1.0, 0)));
}

#[test]
fn a_pilot_who_takes_over_is_obeyed() {
    let mut pilot = pilot(true);
    pilot.set_goal(GOAL, at(0.0));
    pilot.handle_bytes(&heartbeat(4, true), at(0.0));
    pilot.handle_bytes(&heartbeat(19, true), at(1.0));
    pilot.handle_bytes(&local(0, [0.0; 3], [0.0; 3]), at(1.0));
    sent(&mut pilot);
    pilot.handle_timeout(at(1.0));
    let said = sent(&mut pilot);
    assert_eq!((count(&said, 84), count(&said, 76)), (0, 0), "{said:?}");
    assert!(std::iter::from_fn(|| pilot.poll_note()).any(|n| n.contains("taken out of guided mode")));
}

#[test]
fn silence_is_reported_once_and_ends_when_the_autopilot_returns() {
    let mut pilot = pilot(false);
    assert_eq!(pilot.health(at(0.0)), Health::Awaited);
    pilot.handle_bytes(&heartbeat(4, true), at(0.0));
    assert_eq!(pilot.health(at(4.0)), Health::InCommand);
    for s in 5..9 {
        pilot.handle_timeout(at(f64::from(s)));
    }
    assert_eq!((pilot.health(at(9.0)), pilot.counters()["silences"]), (Health::Silent, 1));
    pilot.handle_bytes(&heartbeat(4, true), at(9.0));
    assert_eq!(pilot.health(at(9.0)), Health::InCommand);
    let notes: Vec<String> = std::iter::from_fn(|| pilot.poll_note()).collect();
    assert_eq!(notes, ["the autopilot answers", "the autopilot does not answer any more", "the autopilot answers"]);
}

#[test]
fn positions_are_sent_as_gps_input_and_follow_the_vehicle() {
    let mut pilot = pilot(false);
    pilot.handle_bytes(&heartbeat(4, true), at(0.0));
    pilot.handle_bytes(&local(0, [0.0; 3], [10.0, 0.0, 0.0]), at(0.0));
    pilot.handle_place(LatLon { lat_deg: 29.5, lon_deg: 34.92 }, 2.5, at(0.0));
    pilot.handle_timeout(at(0.0));
    pilot.handle_bytes(&local(1000, [10.0, 0.0, 0.0], [10.0, 0.0, 0.0]), at(1.0));
    pilot.handle_timeout(at(1.0));
    let gps: Vec<Vec<u8>> = sent(&mut pilot).into_iter().filter(|(id, _)| *id == 232).map(|(_, p)| p).collect();
    let lat = |p: &[u8]| i32::from_le_bytes(p[12..16].try_into().unwrap());
    assert_eq!(lat(&gps[0]), 295_000_000);
    // 10 m to the north are 10 / 110 856 degrees there.
    assert!((lat(&gps[1]) - 295_000_902).abs() < 5, "{}", lat(&gps[1]));
    pilot.handle_timeout(at(20.0));
    assert_eq!(count(&sent(&mut pilot), 232), 0, "a place is not passed on for ever");
}

#[test]
fn an_autopilot_with_global_positions_only_is_steered() {
    let mut pilot = pilot(false);
    pilot.set_goal(Some(Goal { east_m: 0.0, north_m: 100.0, depth_m: None, place: None }), at(0.0));
    pilot.handle_bytes(&heartbeat(4, true), at(0.0));
    pilot.handle_bytes(&global(1000, 3000), at(0.0));
    pilot.handle_timeout(at(0.0));
    let said = sent(&mut pilot);
    let (_, target) = said.iter().find(|(id, _)| *id == 86).unwrap();
    let lat = i32::from_le_bytes(target[4..8].try_into().unwrap());
    let alt = f32::from_le_bytes(target[12..16].try_into().unwrap());
    assert!((lat - 295_009_021).abs() < 20 && alt == -3.0, "{lat} {alt}");
}

#[test]
fn frames_of_others_and_absurd_numbers_are_counted() {
    let mut pilot = pilot(false);
    pilot.handle_bytes(&frame(7, 0, vec![4, 0, 0, 0, 12, 3, 0x81, 4, 3]), at(0.0));
    assert_eq!(pilot.health(at(0.0)), Health::Awaited);
    pilot.handle_bytes(&heartbeat(4, true), at(0.0));
    pilot.handle_bytes(&local(0, [f32::NAN; 3], [0.0; 3]), at(0.0));
    pilot.handle_bytes(&local(0, [0.0; 3], [1e9, 0.0, 0.0]), at(0.0));
    pilot.handle_bytes(&local(1000, [0.0; 3], [1e9, 0.0, 0.0]), at(1.0));
    let step = pilot.poll_step().unwrap();
    assert_eq!(
        (step.dx_m, step.dy_m, step.unseen),
        (0.0, 0.0, Duration::from_secs(1)),
        "no way, but no certainty either"
    );
    assert_eq!(pilot.poll_step(), None);
    let counters = pilot.counters();
    assert_eq!((counters["other_systems"], counters["unreadable"], counters["absurd_velocities"]), (1, 1, 1));
}

/// A target in the autopilot's own frame, as it reports it.
fn local_target(north: f32, east: f32) -> Vec<u8> {
    let place = [north, east].into_iter().flat_map(f32::to_le_bytes);
    let zeros = [0; 36];
    frame(1, 85, [0; 4].into_iter().chain(place).chain(zeros).chain(0x0DF8u16.to_le_bytes()).chain([1]).collect())
}

fn notes(pilot: &mut Mavlink) -> Vec<String> {
    std::iter::from_fn(|| pilot.poll_note()).collect()
}

/// A message of another component of the autopilot's system.
fn of_component(component: u8, id: u32, payload: Vec<u8>) -> Vec<u8> {
    frame_of(1, component, id, payload)
}

#[test]
fn companions_gimbals_and_cameras_do_not_affect_the_autopilot() {
    let survey = |is_alone: bool| {
        let mut pilot = pilot(true);
        pilot.set_goal(GOAL, at(0.0));
        let (mut messages, mut steps) = (Vec::new(), Vec::new());
        for tenth in 0..150u32 {
            let now = at(f64::from(tenth) / 10.0);
            if tenth % 10 == 0 {
                pilot.handle_bytes(&heartbeat(4, true), now);
            }
            pilot.handle_bytes(&local(100 * tenth, [0.0, 0.0, 5.0], [0.0, 1.0, 0.0]), now);
            if !is_alone {
                // A companion computer, a gimbal with a clock and an attitude of its own, and a camera that measures distances.
                pilot.handle_bytes(&of_component(191, 0, vec![0, 0, 0, 0, 18, 0, 0, 4, 3]), now);
                let tilt = [1.0f32, 1.5, 3.0].into_iter().flat_map(f32::to_le_bytes);
                let attitude = (9_000_000 + tenth).to_le_bytes().into_iter().chain(tilt).collect();
                pilot.handle_bytes(&of_component(154, 30, attitude), now);
                pilot.handle_bytes(&of_component(154, 32, local(7, [0.0; 3], [9.0; 3])[10..38].to_vec()), now);
                pilot.handle_bytes(&of_component(100, 173, 1.5f32.to_le_bytes().to_vec()), now);
            }
            pilot.handle_timeout(now);
            messages.extend(sent(&mut pilot));
            steps.extend(std::iter::from_fn(|| pilot.poll_step()));
        }
        let counters = pilot.counters();
        (messages, steps, notes(&mut pilot), counters.get("restarts").copied(), counters["targets"])
    };
    let alone = survey(true);
    assert_eq!(alone, survey(false));
    assert_eq!((alone.3, alone.4), (None, 15));
}

#[test]
fn an_hour_of_a_real_robot_is_followed_with_few_log_lines() {
    let mut pilot = pilot(true);
    pilot.set_goal(GOAL, at(0.0));
    let (mut frames, mut notes, mut unseen, mut in_command) = (0u32, 0, Duration::ZERO, 0);
    let mut hear = |pilot: &mut Mavlink, mut bytes: Vec<u8>, now| {
        frames += 1;
        if frames % 100 == 7 {
            let damaged = frames as usize % bytes.len();
            bytes[damaged] ^= 0x55;
        }
        pilot.handle_bytes(&bytes, now);
    };
    let text = |words: &str| frame(1, 253, std::iter::once(4).chain(words.bytes()).collect());
    for tenth in 0..36_000u32 {
        let now = at(f64::from(tenth) / 10.0);
        if tenth % 10 == 0 {
            hear(&mut pilot, heartbeat(4, true), now);
            hear(&mut pilot, of_component(191, 0, vec![0, 0, 0, 0, 18, 0, 0, 4, 3]), now);
            hear(&mut pilot, frame(255, 0, vec![0, 0, 0, 0, 6, 8, 0, 4, 3]), now);
            hear(&mut pilot, text(["EKF variance", "Leak detected"][(tenth / 10 % 2) as usize]), now);
        }
        // The depth jumps for one message in each five minutes.
        let depth_m = if tenth % 3000 == 1501 { 42.0 } else { 5.0 };
        hear(&mut pilot, local(100 * tenth, [0.0, 0.0, depth_m], [0.0, 0.1, 0.0]), now);
        let attitude = tenth.to_le_bytes().into_iter().chain([0; 12]).collect();
        hear(&mut pilot, of_component(154, 30, attitude), now);
        pilot.handle_timeout(now);
        while let Some(step) = pilot.poll_step() {
            assert_eq!(step.depth_m, Some(5.0));
            unseen += step.unseen;
        }
        notes += std::iter::from_fn(|| pilot.poll_note()).count();
        in_command += u32::from(pilot.health(now) == Health::InCommand);
        while pilot.poll_output().is_some() {}
    }
    assert!(in_command >= 35_900 && unseen < Duration::from_secs(36), "{in_command} {unseen:?} {:?}", pilot.counters());
    assert!(notes < 60 && !pilot.counters().contains_key("restarts"), "{notes} lines: {:?}", pilot.counters());
}

#[test]
fn a_depth_that_jumps_does_not_reach_the_vehicle() {
    let mut pilot = pilot(false);
    for tenth in 0..40 {
        let now = at(f64::from(tenth) / 10.0);
        pilot.handle_bytes(&heartbeat(4, true), now);
        pilot.handle_bytes(&global(100 * tenth, if tenth == 20 { 42_000 } else { 5000 }), now);
    }
    assert!(std::iter::from_fn(|| pilot.poll_step()).all(|step| step.depth_m == Some(5.0)));
    assert_eq!(pilot.counters()["depth_jumps"], 1);
    let expected = "the depth jumps from 5.0 to 42.0 m, which is not used unless it stays";
    assert_eq!(notes(&mut pilot).last().map(String::as_str), Some(expected));
}

#[test]
fn targets_follow_a_zero_of_depths_that_has_moved() {
    let mut pilot = pilot(false);
    pilot.set_goal(GOAL, at(0.0));
    let mut depths = Vec::new();
    for tenth in 0..300 {
        let now = at(f64::from(tenth) / 10.0);
        pilot.handle_bytes(&heartbeat(4, true), now);
        pilot.handle_bytes(&global(100 * tenth, if tenth < 150 { 5000 } else { 42_000 }), now);
        pilot.handle_timeout(now);
        let targets = sent(&mut pilot).into_iter().filter(|(id, _)| *id == 86);
        depths.extend(targets.map(|(_, p)| -f32::from_le_bytes(p[12..16].try_into().unwrap())));
    }
    // For three seconds nobody knows from where depths count.
    assert_eq!(depths, [[5.0; 15].as_slice(), &[42.0; 12]].concat());
}

#[test]
fn a_target_that_is_not_taken_takes_it_out_of_command() {
    let mut pilot = pilot(false);
    pilot.set_goal(GOAL, at(0.0));
    let mut healths = Vec::new();
    for s in 0..20 {
        let now = at(f64::from(s));
        pilot.handle_bytes(&heartbeat(4, true), now);
        pilot.handle_bytes(&attitude(1000 * s as u32, 0.0), now);
        pilot.handle_bytes(&local(1000 * s as u32, [0.0, 0.0, 4.0], [0.0; 3]), now);
        // From 5 s to 14 s it flies to somewhere else.
        let east = if (5..15).contains(&s) { -30.0 } else { 10.0 };
        pilot.handle_bytes(&local_target(0.0, east), now);
        pilot.handle_timeout(now);
        healths.push(pilot.health(now));
    }
    assert_eq!(
        [healths[8], healths[9], healths[14], healths[15]].map(|h| h == Health::InCommand),
        [true, false, false, true]
    );
    assert_eq!(pilot.counters()["targets"], 20, "targets go out all the same");
    assert_eq!(pilot.counters()["targets_refused"], 6);
    let expected = [
        "the autopilot answers",
        "the autopilot does not follow the waypoint: it reports a target 40 m away from it",
        "the autopilot follows the waypoint again",
    ];
    assert_eq!(notes(&mut pilot), expected);
}

#[test]
fn targets_and_distances_in_degrees_are_compared_too() {
    for is_refused in [false, true] {
        let mut pilot = pilot(false);
        pilot.set_goal(GOAL, at(0.0));
        for s in 0..10 {
            let now = at(f64::from(s));
            pilot.handle_bytes(&heartbeat(4, true), now);
            pilot.handle_bytes(&local(1000 * s as u32, [500.0, 0.0, 4.0], [0.0; 3]), now);
            let lon = 349_200_000i32;
            pilot.handle_bytes(&global(1000 * s, 4000), now);
            // 10 m to the east are 10 / 96 995 degrees there.
            let told_lon = if is_refused { lon } else { lon + 1031 };
            let told: Vec<u8> = [0, 295_000_000, told_lon].iter().flat_map(|v: &i32| v.to_le_bytes()).collect();
            pilot.handle_bytes(&frame(1, 87, [&told[..], &[0; 36], &[0xF8, 0x0D, 6]].concat()), now);
            pilot.handle_timeout(now);
        }
        assert_eq!(pilot.health(at(9.0)) == Health::NotInCommand, is_refused, "{:?}", pilot.echo);
    }
}

#[test]
fn a_restart_under_water_arms_unless_a_pilot_disarmed() {
    for (by_pilot, depth_m, expected) in [(false, 5.0, 2), (true, 5.0, 0), (false, 0.2, 0)] {
        let mut pilot = pilot(true);
        pilot.set_goal(GOAL, at(0.0));
        let beat = |pilot: &mut Mavlink, s: f64, boot_s: f64, armed| {
            pilot.handle_bytes(&heartbeat(if armed { 4 } else { 19 }, armed), at(s));
            pilot.handle_bytes(&attitude(((s - boot_s) * 1000.0) as u32, 0.0), at(s));
            pilot.handle_bytes(&local(((s - boot_s) * 1000.0) as u32, [0.0, 0.0, depth_m], [0.0; 3]), at(s));
            sent(pilot);
            pilot.handle_timeout(at(s));
            count(&sent(pilot), 76)
        };
        for s in 0..10 {
            let is_armed = s < 8 || !by_pilot;
            assert_eq!(beat(&mut pilot, f64::from(s), -60.0, is_armed), 0);
        }
        let commands = beat(&mut pilot, 13.0, 11.0, false);
        assert_eq!(commands, expected, "{by_pilot} {depth_m}");
        assert_eq!((pilot.counters()["restarts"], pilot.poll_step().map(|s| s.dx_m)), (1, Some(0.0)));
        assert!(notes(&mut pilot).contains(&"the autopilot has restarted".to_owned()));
        beat(&mut pilot, 14.0, 11.0, true);
        beat(&mut pilot, 15.0, 11.0, false);
        assert_eq!(beat(&mut pilot, 16.0, 11.0, false), 0, "a pilot takes over after the restart");
    }
}

#[test]
fn tilt_and_height_come_with_each_step() {
    let mut pilot = pilot(false);
    let attitude: Vec<u8> = [0.5f32, -0.25, 1.0].into_iter().flat_map(f32::to_le_bytes).collect();
    pilot.handle_bytes(&heartbeat(4, true), at(0.0));
    pilot.handle_bytes(&local(0, [0.0; 3], [0.0; 3]), at(0.0));
    pilot.handle_bytes(&frame(1, 30, [&[1, 0, 0, 0], &attitude[..]].concat()), at(0.5));
    let rangefinder = [4.0f32, 0.0].into_iter().flat_map(f32::to_le_bytes).collect();
    pilot.handle_bytes(&frame(1, 173, rangefinder), at(0.5));
    pilot.handle_bytes(&local(1000, [0.0; 3], [0.0; 3]), at(1.0));
    let step = pilot.poll_step().unwrap();
    assert_eq!((step.roll_rad, step.pitch_rad, step.heading_rad), (0.5, -0.25, Some(1.0)));
    // 4 m along a beam that leans by roll and pitch.
    assert!((step.altitude_m.unwrap() - 4.0 * 0.5f64.cos() * 0.25f64.cos()).abs() < 1e-6, "{step:?}");
    pilot.handle_bytes(&local(3000, [0.0; 3], [0.0; 3]), at(3.0));
    assert_eq!(pilot.poll_step().unwrap().altitude_m, None, "an old height");
}

#[test]
fn a_lost_position_is_named_once_and_no_target_goes_out() {
    let mut pilot = pilot(false);
    pilot.set_goal(GOAL, at(0.0));
    let mut targets = Vec::new();
    for s in 0..20 {
        let now = at(f64::from(s));
        pilot.handle_bytes(&heartbeat(4, true), now);
        if !(3..15).contains(&s) {
            // It comes back 40 m away, by its own account.
            let north = if s < 3 { 0.0 } else { 40.0 };
            pilot.handle_bytes(&attitude(1000 * s as u32, 0.0), now);
            pilot.handle_bytes(&local(1000 * s as u32, [north, 0.0, 4.0], [0.0; 3]), now);
        }
        pilot.handle_timeout(now);
        targets.push(count(&sent(&mut pilot), 84));
    }
    assert_eq!(targets, [[1; 5].as_slice(), &[0; 10], &[1; 5]].concat());
    let steps: Vec<Step> = std::iter::from_fn(|| pilot.poll_step()).collect();
    assert!(steps.iter().all(|s| s.dx_m == 0.0 && s.dy_m == 0.0), "no jump: {steps:?}");
    assert_eq!(steps.iter().map(|s| s.unseen.as_secs()).sum::<u64>(), 13);
    let expected = [
        "the autopilot answers",
        "the autopilot reports no position any more",
        "the autopilot reports its position again",
    ];
    assert_eq!(
        (notes(&mut pilot).as_slice(), pilot.counters()["position_losses"]),
        (expected.map(String::from).as_slice(), 1)
    );
}

proptest! {
    #[test]
    fn any_messages_are_accepted(
        messages in proptest::collection::vec((prop_oneof![Just(0u32), Just(30), Just(32), Just(33), Just(77), Just(253),
            Just(62), Just(85), Just(87), Just(132), Just(141), Just(173)],
            proptest::collection::vec(any::<u8>(), 1..60)), 0..40),
    ) {
        let mut pilot = pilot(true);
        pilot.set_goal(GOAL, at(0.0));
        for (i, (id, payload)) in messages.into_iter().enumerate() {
            pilot.handle_bytes(&frame(1, id, payload), at(i as f64));
            pilot.handle_timeout(at(i as f64));
            while let Some(step) = pilot.poll_step() {
                prop_assert!(step.dx_m.is_finite() && step.dy_m.is_finite() && step.altitude_m.is_none_or(f64::is_finite));
            }
        }
    }
}

#[test]
fn a_target_does_not_count_from_one_false_position() {
    let mut pilot = pilot(true);
    pilot.set_goal(GOAL, at(0.0));
    let mut norths = Vec::new();
    for tenth in 0..100_u32 {
        // One false position just before a target goes out, and at last another frame, which stays.
        let north = if tenth == 40 {
            300.0
        } else if tenth >= 60 {
            500.0
        } else {
            0.0
        };
        let now = at(f64::from(tenth) / 10.0);
        pilot.handle_bytes(&heartbeat(4, true), now);
        pilot.handle_bytes(&local(100 * tenth, [north, 0.0, 4.0], [0.0; 3]), now);
        pilot.handle_timeout(now);
        norths.extend(targets_of(&mut pilot).iter().map(|[north, ..]| *north));
    }
    assert!(norths.iter().all(|north| [0.0, 500.0].contains(north)), "{norths:?}");
    assert!(norths.contains(&0.0) && norths.last() == Some(&500.0), "{norths:?}");
}

#[test]
fn of_two_vehicles_with_the_same_numbers_one_is_followed() {
    let mut pilot = pilot(false);
    pilot.set_goal(GOAL, at(0.0));
    let (mut targets, mut commands) = (Vec::new(), 0);
    for tenth in 0..300_u32 {
        let now = at(f64::from(tenth) / 10.0);
        if tenth % 10 == 0 {
            pilot.handle_bytes(&heartbeat(4, true), now);
        }
        pilot.handle_bytes(&local(60_000 + 100 * tenth, [0.0, 0.0, 5.0], [0.0; 3]), now);
        pilot.handle_bytes(&local(960_000 + 100 * tenth, [500.0, 200.0, 30.0], [0.0; 3]), now);
        pilot.handle_timeout(now);
        let said = sent(&mut pilot);
        commands += count(&said, 76);
        targets.extend(said.into_iter().filter(|(id, _)| *id == 84).map(|(_, p)| p[4..12].to_vec()));
    }
    let expected = [0f32.to_le_bytes(), 10f32.to_le_bytes()].concat();
    assert!(targets.len() > 25 && targets.iter().all(|target| *target == expected), "{targets:?}");
    assert_eq!((pilot.counters()["other_vehicle"], pilot.counters().get("restarts")), (300, None));
    assert!(commands <= 3 * STREAMS.len(), "{commands}");
    let notes = notes(&mut pilot);
    assert_eq!(notes.iter().filter(|note| note.contains("two vehicles answer as system 1 component 1")).count(), 1);
    assert!(notes.len() < 6, "{notes:?}");
}

#[test]
fn an_autopilot_without_a_position_is_named_and_asked_rarely() {
    let mut pilot = pilot(false);
    let mut commands = 0;
    for s in 0..40_u32 {
        let now = at(f64::from(s));
        pilot.handle_bytes(&heartbeat(4, true), now);
        // Latitude and longitude 0 are none.
        let fields: Vec<u8> = [1000 * s as i32, 0, 0, 0, -5000].iter().flat_map(|v| v.to_le_bytes()).collect();
        pilot.handle_bytes(&frame(1, 33, fields), now);
        pilot.handle_timeout(now);
        commands += count(&sent(&mut pilot), 76);
        if s == 10 {
            assert!(notes(&mut pilot).iter().any(|note| note.contains("reports no position")));
        }
    }
    assert!(commands <= 5 * STREAMS.len(), "{commands}");
    assert_eq!((pilot.health(at(39.0)), notes(&mut pilot).len()), (Health::NotInCommand, 0));
}

#[test]
fn a_vehicle_that_crosses_180_degrees_does_not_jump() {
    let mut pilot = pilot(false);
    pilot.handle_bytes(&heartbeat(4, true), at(0.0));
    for (tenth, lon) in (0_i32..).zip([1_799_999_900_i32, 1_799_999_990, -1_799_999_920, -1_799_999_830]) {
        let fields: Vec<u8> =
            [60_000 + 100 * tenth, -168_500_000, lon, 0, -5000].iter().flat_map(|v| v.to_le_bytes()).collect();
        pilot.handle_bytes(&frame(1, 33, fields), at(f64::from(tenth) / 10.0));
    }
    assert_eq!(pilot.counters().get("position_jumps"), None);
}

#[test]
fn an_autopilot_that_signs_its_messages_is_named() {
    let mut bytes = heartbeat(4, true);
    bytes[2] = 1;
    let end = bytes.len() - 2;
    let crc = frame::check(&bytes[1..end], 50).to_le_bytes();
    bytes[end..].copy_from_slice(&crc);
    bytes.extend([7; 13]);
    let mut pilot = pilot(true);
    pilot.handle_bytes(&bytes, at(0.0));
    let notes = notes(&mut pilot);
    assert!(notes[0].contains("signs its messages") && notes[0].contains("switch signing off"), "{notes:?}");
}

#[test]
fn an_attitude_that_stops_is_named_once_and_gives_no_heading() {
    let mut pilot = pilot(false);
    for s in 0..40_u32 {
        let now = at(f64::from(s));
        pilot.handle_bytes(&heartbeat(4, true), now);
        if !(5..20).contains(&s) {
            pilot.handle_bytes(&attitude(1000 * s, 1.0), now);
        }
        pilot.handle_bytes(&local(1000 * s, [0.0, 0.0, 4.0], [0.0; 3]), now);
        pilot.handle_timeout(now);
    }
    let headings: Vec<_> = std::iter::from_fn(|| pilot.poll_step()).map(|step| step.heading_rad).collect();
    assert_eq!(headings, [[Some(1.0); 5].as_slice(), &[None; 14], &[Some(1.0); 20]].concat());
    let notes = notes(&mut pilot);
    assert_eq!(notes[1], "the autopilot reports no attitude: images have no pose until it does");
    assert!(!notes[2..].iter().any(|note| note.contains("attitude")), "{notes:?}");
    assert_eq!(pilot.counters()["attitude_losses"], 1);
}
