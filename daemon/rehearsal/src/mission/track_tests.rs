//! The track that the operator is shown is the one that was travelled.

use super::tuned_tests::mission;
use std::time::Duration;

/// The distance of a place from the nearest leg of a track, metres.
fn off_track(place: (f64, f64), track: &[(f64, f64)]) -> f64 {
    let to_leg = |leg: &[(f64, f64)]| {
        let (dx, dy) = (leg[1].0 - leg[0].0, leg[1].1 - leg[0].1);
        let (px, py) = (place.0 - leg[0].0, place.1 - leg[0].1);
        let squared = dx * dx + dy * dy;
        let along = if squared > 0.0 { ((px * dx + py * dy) / squared).clamp(0.0, 1.0) } else { 0.0 };
        (px - along * dx).hypot(py - along * dy)
    };
    track.windows(2).map(to_leg).fold(f64::INFINITY, f64::min)
}

#[test]
fn the_shown_track_is_the_one_that_was_travelled() {
    let mut mission = mission(&["channel.loss=0.1", "link.status_period_s=15"]);
    let address = mission.address;
    let mut travelled = Vec::new();
    for second in 0..420 {
        mission.advance(mission.now() + Duration::from_secs(1)).unwrap();
        if second == 150 {
            let now = mission.now();
            mission.surface_mut().set_utility(address, &[(1, 0.8)].into(), (0.2, 0.0), now).unwrap();
        }
        let reckoned = mission.vehicle().navigator().position();
        travelled.push(((reckoned.x_m, reckoned.y_m), (mission.motion.x_m, mission.motion.y_m)));
    }
    let map = &mission.surface().record(address).unwrap().track;
    let track: Vec<(f64, f64)> = map.iter().map(|(_, x, y)| (x, y)).collect();
    let placement = mission.surface().view(address).unwrap().status().unwrap().0.placement;
    let (east, north) = placement.map_or((0.0, 0.0), |placement| placement.origin.xy());
    let known = &travelled[20..400];
    let worst = known.iter().map(|(reckoned, _)| off_track(*reckoned, &track)).fold(0.0, f64::max);
    assert!(worst < 0.5, "{worst} m off the track: {track:?}");
    let world: Vec<(f64, f64)> = track.iter().map(|&(x, y)| (x + east, y + north)).collect();
    let mean = known.iter().map(|(_, real)| off_track(*real, &world)).sum::<f64>() / known.len() as f64;
    assert!(mean < 0.3, "{mean} m off the true track on the mean");
}
