//! The way of a vehicle, and how it looked at the sea floor.

use super::dive::{Dive, DiveVehicle};
use super::track_point::TrackPoint;
use super::uncertainty;
use super::words::{self, on_earth};
use scenecast_core::utc_text;
use scenecast_protocol::directive::PlannerKind;
use scenecast_protocol::wire::VehicleMode;
use scenecast_surface::state::VehicleState;
use serde_json::Value;

/// A shorter jump is not told, metres.
const LEAST_JUMP_M: f64 = 2.0;
/// A vehicle that rises to the surface gets at least so much above its survey, metres.
const RISEN_M: f64 = 0.5;
/// Jumps that are told one by one.
const MAX_JUMPS: usize = 4;

/// How the vehicle looked at the sea floor.
pub(super) fn equipment(dive: &Dive, vehicle: &DiveVehicle) -> String {
    if !dive.knows_settings(vehicle) {
        return "What the vehicle was set to, such as its altitude, speed and camera, and whether its motion and its images were real, is not \
                known without its own record."
            .to_owned();
    }
    let all = dive.ran_with(vehicle);
    let set = |key: &str, default: f64| all.settings.get(key).and_then(Value::as_f64).unwrap_or(default);
    let defaults = scenecast_config::Config::default();
    if vehicle.is_played_back() {
        let source = all.told().get("camera.source").and_then(|source| Some(source.as_str()?.to_owned()));
        return format!(
            "What was played back, {}, decides its speed, its altitude and its path, which no order changes. By \
             its settings its images are taken to be from {} m above the sea floor, where nothing measured that, and their pixels to be {} m wide \
             there.",
            source.unwrap_or_default(),
            set("survey.altitude_m", defaults.survey.altitude_m),
            set("camera.metres_per_pixel", defaults.camera.metres_per_pixel)
        );
    }
    let images = match all.text("camera.source") {
        Some(source) if source.starts_with("command:") => {
            "Its images came from a command (camera.source); what that read is not known. "
        }
        _ => "",
    };
    let planner = all.settings.get("survey.planner").and_then(Value::as_str).unwrap_or(defaults.survey.planner.name());
    let way = match planner == PlannerKind::Lawnmower.name() {
        true => "in straight legs".to_owned(),
        false => format!(
            "in straight legs and, once weights were ordered, by the planner {planner} unless another was ordered"
        ),
    };
    format!(
        "{images}By its settings it was to survey {} m above the sea floor at {} m/s {way}, with camera images whose pixels are {} m \
         wide there.",
        set("survey.altitude_m", defaults.survey.altitude_m),
        set("survey.speed_m_s", defaults.survey.speed_m_s),
        set("camera.metres_per_pixel", defaults.camera.metres_per_pixel)
    )
}

/// Its path: how far, how fast and how deep, from where to where.
pub(super) fn place(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> String {
    let Some(last) = vehicle.path().last() else { return "It never reported a place.".to_owned() };
    let origin = dive.state.mission.origin.map_or_else(
        || "the mission has no latitude and longitude".to_owned(),
        |origin| format!("the origin is at {}", words::origin(origin)),
    );
    let has_own = vehicle.has_own_path();
    let begin = vehicle.path().first().map_or_else(String::new, |first| {
        format!(
            " {} {} and {} of the origin{}",
            if has_own { "It began" } else { "The first place that it reported is" },
            words::east(first.east_m),
            words::north(first.north_m),
            on_earth(dive, (first.east_m, first.north_m))
        )
    });
    let (rising, deep): (Vec<f64>, Vec<f64>) = depths(dive, state, vehicle);
    let least = |depths: &[f64]| depths.iter().copied().fold(f64::INFINITY, f64::min);
    let depth = match least(&rising) < least(&deep) - RISEN_M {
        true => format!(
            "at {} below the surface until it rose to it, and at {} then",
            range(&deep).unwrap_or_default(),
            range(&rising).unwrap_or_default()
        ),
        false => format!("at {} below the surface", range(&[deep, rising].concat()).unwrap_or_default()),
    };
    let (least, ended) = if has_own { ("at", "and ended") } else { ("at least", "the last one is") };
    let speed =
        vehicle.speed_m_s().map_or_else(String::new, |m_s| format!(", {least} {m_s:.2} m/s on average while it moved"));
    let jumps = jumps(vehicle);
    format!(
        "By its {} about {:.0} m{jumps}{speed}, {depth}.{begin}, {ended} {} and {} of the origin{}; {origin}.{}{}",
        if has_own { "own record it went" } else { "reports it went at least" },
        vehicle.distance_m(),
        words::east(last.east_m),
        words::north(last.north_m),
        on_earth(dive, (last.east_m, last.north_m)),
        moved(state, vehicle),
        uncertainty::told(vehicle)
    )
}

/// What its path does not have, in brackets: where it would have had to be faster than it ever was, and what it went while its program
/// did not run.
fn jumps(vehicle: &DiveVehicle) -> String {
    let jumps = vehicle.jumps().filter(|(from, to)| from.distance_m(to) >= LEAST_JUMP_M);
    let told = jumps.map(|(from, to)| {
        let (m, from_s, to_s) = (from.distance_m(to), utc_text(from.at_s), utc_text(to.at_s));
        match vehicle.began_between(from, to) {
            true => format!(
                "{m:.0} m between its last place before a restart, {from_s}, and the first one after it, {to_s}"
            ),
            false => format!("a jump of {m:.0} m at {to_s}"),
        }
    });
    let told: Vec<String> = told.collect();
    match told.len() {
        0 => String::new(),
        n if n > MAX_JUMPS => format!(" ({n} jumps to another place not counted)"),
        _ => format!(" (not counted: {})", told.join(", and ")),
    }
}

/// How far its own record is moved so that it lies on the map.
fn moved(state: &VehicleState, vehicle: &DiveVehicle) -> String {
    let (east_m, north_m) = state.map.shift_m();
    match vehicle.own.track.is_empty() || east_m.hypot(north_m) < 0.05 {
        true => String::new(),
        false => format!(
            " Places of its own record are moved {} and {}, as its map was by position fixes.",
            words::east(east_m).replace("east", "to the east").replace("west", "to the west"),
            words::north(north_m).replace("north", "to the north").replace("south", "to the south")
        ),
    }
}

/// The depths of its path while it rose to the surface, and those of the rest, metres.
fn depths(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> (Vec<f64>, Vec<f64>) {
    let rises = [VehicleMode::Surface, VehicleMode::Abort].map(VehicleMode::name);
    let modes = dive.mode_changes(state, vehicle);
    let is_rising = |at_s: f64| modes.at(at_s).is_some_and(|mode| rises.contains(&mode));
    let (rising, deep): (Vec<&TrackPoint>, Vec<&TrackPoint>) =
        vehicle.path().iter().partition(|point| is_rising(point.at_s));
    let depths = |points: Vec<&TrackPoint>| points.into_iter().map(|point| point.depth_m).collect();
    (depths(rising), depths(deep))
}

/// The least and the greatest of some depths in words; `None` without any.
fn range(depths_m: &[f64]) -> Option<String> {
    let (least, most) = (depths_m.iter().copied().reduce(f64::min)?, depths_m.iter().copied().reduce(f64::max)?);
    let told = words::metres(least, most);
    Some(if told.contains(" to ") { format!("depths of {told}") } else { format!("a depth of {told}") })
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_messages::scenecast_msgs::Event;

    #[test]
    fn the_depth_of_the_survey_is_told_apart_from_the_ascent() {
        let (mut dive, state, mut vehicle) = (Dive::default(), VehicleState::default(), DiveVehicle::default());
        let place = |(n, depth_m): (u32, f64)| TrackPoint {
            at_s: f64::from(n),
            east_m: 0.0,
            north_m: 0.0,
            depth_m,
            sigma_m: 1.0,
        };
        vehicle.track = [(0, 14.0), (1, 17.3), (2, 13.0), (3, 0.0)].map(place).to_vec();
        assert!(super::place(&dive, &state, &vehicle).contains("at depths of 0.0 to 17.3 m below the surface."));
        let text = format!("{}: order", VehicleMode::Surface.name());
        dive.events = vec![(1.5, Event { source: "mode".to_owned(), text, ..Event::default() })];
        let told = super::place(&dive, &state, &vehicle);
        assert!(told.contains("at depths of 14.0 to 17.3 m below the surface until it rose to it, and at depths of 0.0 to 13.0 m then."), "{told}");
        vehicle.track.pop();
        vehicle.track[2].depth_m = 16.8;
        let told = super::place(&dive, &state, &vehicle);
        assert!(told.contains("at depths of 14.0 to 17.3 m below the surface."), "it stayed down: {told}");
    }
}
