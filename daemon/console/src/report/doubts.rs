//! What a reader of a report must not trust.

use super::dive::{Dive, DiveVehicle};
use super::orders::said;
use super::{extent, gaps, words};
use scenecast_core::utc_text;
use scenecast_files::HOW_TO_RECOVER;
use scenecast_surface::LogKind;
use scenecast_surface::state::VehicleState;

/// A place with a greater standard deviation is worth a sentence, metres.
const DOUBTFUL_M: f64 = 5.0;

/// The doubts about what a report says of a vehicle, a sentence each.
pub(super) fn doubts(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Vec<String> {
    let mut sentences = Vec::new();
    // How a record is made whole is no part of a report.
    let damage = dive.damage.iter().map(|damage| damage.replace(HOW_TO_RECOVER, ""));
    sentences.extend(damage.map(|damage| format!("Not all of the record could be read: {damage}.")));
    sentences.extend(gaps::of_records(dive, vehicle));
    sentences.extend(dive.restarts_s.iter().map(|(stopped_s, _)| {
        format!(
            "The surface's program stopped some seconds after {}; what it had heard and sent by then and not stored is missing, also in the \
             counts of frames and bytes.",
            utc_text(*stopped_s)
        )
    }));
    sentences.extend(not_real(dive, vehicle));
    sentences.extend(place(dive, state, vehicle));
    sentences.extend(relabelled(dive, state));
    sentences.extend(images(state, vehicle));
    if vehicle.own.runs_s.is_empty() {
        if !vehicle.restarts_s.is_empty() {
            let unknown = "How far a restart set the vehicle's map back is not known without its own record.";
            sentences.push(unknown.to_owned());
        }
        sentences.push(
            "Times of modes, faults and restarts are those at which the surface learned of them, and how far its map was behind is its own \
             forecast."
                .to_owned(),
        );
    }
    if dive.is_scaled() {
        sentences.push("Limits, and times inside what the programs said, are those of the mission.".to_owned());
    }
    if extent::sea_floor(dive, state, vehicle).is_some() {
        sentences.push(
            "The depth of the water is the depth of the vehicle and its height above the sea floor; where nothing measured that height, it is \
             the configured one (survey.altitude_m)."
                .to_owned(),
        );
    }
    sentences
}

/// What of the dive was made up.
fn not_real(dive: &Dive, vehicle: &DiveVehicle) -> Option<String> {
    vehicle.made_up(dive)?;
    let what = if dive.settings.is_rehearsal() {
        "The sea floor, the images, the motion, the losses and the range of the link, and the energy are made up by the rehearsal."
    } else if vehicle.is_played_back() {
        "The images and the poses are those of a recording, which nobody steered; what the link lost is real only if the modems were."
    } else {
        "The motion of the vehicle was simulated; what the link lost is real only if the modems were."
    };
    Some(what.to_owned())
}

/// The last time at which much of the map got other labels.
fn relabelled(dive: &Dive, state: &VehicleState) -> Option<String> {
    const MUCH: f64 = 0.05;
    let of_it = || dive.events.iter().filter(|(_, event)| event.vehicle == state.name);
    let corrected = of_it().filter(|(_, event)| event.source == LogKind::Label.name());
    let shares = corrected.filter_map(|(at_s, event)| {
        let (changed, rest) = event.text.strip_prefix("the map is corrected: ")?.split_once(" of ")?;
        let [changed, all] = [changed, rest.split(' ').next()?].map(|count| count.parse::<f64>().ok());
        Some((*at_s, changed? / all?))
    });
    let shares: Vec<(f64, f64)> = shares.filter(|(_, share)| *share >= MUCH).collect();
    let (at_s, share) = *shares.last()?;
    let named = of_it().filter(|(named_s, event)| {
        let is_name = |words: &str| words.starts_with("label ") && words.contains(": name ");
        event.source == LogKind::Record.name() && *named_s < at_s && said(&event.text, is_name).is_some()
    });
    let before = match shares.len() {
        1 => String::new(),
        2 => " The map had been corrected in this way once before.".to_owned(),
        n => format!(" The map had been corrected in this way {} times before.", n - 1),
    };
    let doubtful = if named.count() > 0 { "names given and images sent" } else { "images sent and weights ordered" };
    Some(format!(
        "The scene model changed the class of {:.0} % of the cells at {}, {} before the end; {doubtful} before it may mean another class.{before}",
        share * 100.0,
        utc_text(at_s),
        dive.lasted(dive.span_s.1 - at_s)
    ))
}

/// How many images lie where the map has another class.
fn images(state: &VehicleState, vehicle: &DiveVehicle) -> Option<String> {
    let all = || vehicle.exemplars.iter().map(|(_, image)| image);
    let other = all().filter(|image| !vehicle.shows_class(state, image)).count();
    (other > 0).then(|| {
        format!(
            "{other} of the {} {} where the map at the end has another class than that of which they were sent as examples.",
            words::counted(all().count(), "image that arrived", "images that arrived"),
            if other == 1 { "lies" } else { "lie" }
        )
    })
}

/// When its place was not known well.
fn place(dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) -> Option<String> {
    let known: Vec<_> = vehicle.path().iter().filter(|point| point.sigma_m.is_finite()).collect();
    let is_doubtful = |at: &usize| known[*at].sigma_m >= DOUBTFUL_M;
    let all = || (0..known.len()).filter(is_doubtful);
    let (first, last) = (known[all().next()?], known[all().next_back()?]);
    let most_m = known.iter().map(|point| point.sigma_m).fold(0.0, f64::max);
    let time_s: f64 = all().filter_map(|at| Some(known.get(at + 1)?.at_s - known[at].at_s)).sum();
    // Images that overlap with earlier ones hold the map together, however well its place on the earth is known.
    let off = match state.registration.as_ref().is_some_and(|registration| registration.closed > 0) {
        true => "from its place on the earth; images that were matched to earlier ones lie closer to these",
        false => "off the rest",
    };
    Some(format!(
        "Between {} and {}, for {} in all, the uncertainty of its place on the earth (68 %, east and north each) was {DOUBTFUL_M} m or more, \
         {most_m:.0} m at most: what was mapped then may lie that far {off}.",
        utc_text(first.at_s),
        utc_text(last.at_s),
        dive.lasted(time_s)
    ))
}

#[cfg(test)]
mod tests {
    use super::super::track_point::TrackPoint;
    use super::*;
    use scenecast_messages::scenecast_msgs::Event;

    #[test]
    fn a_restart_that_only_the_surface_knows_is_a_doubt() {
        let (dive, state, mut vehicle) = (Dive::default(), VehicleState::default(), DiveVehicle::default());
        let is_told = |vehicle: &DiveVehicle| {
            doubts(&dive, &state, vehicle).iter().any(|sentence| sentence.starts_with("How far a restart set"))
        };
        assert!(!is_told(&vehicle));
        vehicle.restarts_s = vec![7.0];
        assert!(is_told(&vehicle));
    }

    #[test]
    fn a_place_is_doubted_for_the_time_in_which_it_was_not_known() {
        let mut dive = Dive::default();
        dive.state.mission.speed = 1.0;
        let at = |(n, sigma_m): (usize, &f64)| TrackPoint {
            at_s: n as f64,
            east_m: 0.0,
            north_m: 0.0,
            depth_m: 0.0,
            sigma_m: *sigma_m,
        };
        let told = |sigmas: &[f64]| {
            let track = sigmas.iter().enumerate().map(at).collect();
            let vehicle = DiveVehicle { track, ..DiveVehicle::default() };
            place(&dive, &VehicleState::default(), &vehicle)
        };
        assert_eq!(told(&[1.0, 4.9, f64::NAN]), None);
        let told = told(&[1.0, 50.0, 40.0, 0.5, 0.5, 6.0, 1.0]).unwrap();
        assert!(told.starts_with("Between 1970-01-01T00:00:01Z and 1970-01-01T00:00:05Z, for 3 s in all"), "{told}");
        assert!(told.contains("50 m at most"), "{told}");
    }

    #[test]
    fn labels_that_changed_late_are_a_doubt() {
        let (mut dive, state) = (Dive::default(), VehicleState::default());
        (dive.span_s, dive.state.mission.speed) = ((0.0, 100.0), 1.0);
        let event = |(at_s, source, text): (f64, LogKind, &str)| {
            (at_s, Event { source: source.name().to_owned(), text: text.to_owned(), ..Event::default() })
        };
        let corrected = |cells: &str| format!("the map is corrected: {cells} cells have another label, in 8.5 kbit");
        let (little, much) = (corrected("10 of 6204"), corrected("2755 of 6204"));
        dive.events = [(20.0, LogKind::Label, little.as_str())].map(event).to_vec();
        assert_eq!(relabelled(&dive, &state), None);
        let name = (30.0, LogKind::Record, "ingrid: label 1: name gravel");
        dive.events.extend([name, (73.0, LogKind::Label, much.as_str())].map(event));
        let told = "The scene model changed the class of 44 % of the cells at 1970-01-01T00:01:13Z, 27 s before the end; names given and images \
                    sent before it may mean another class.";
        assert_eq!(relabelled(&dive, &state).as_deref(), Some(told));
    }
}
