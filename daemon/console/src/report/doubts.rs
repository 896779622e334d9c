//! What a reader of a report must not trust.

use super::dive::{Dive, DiveVehicle};
use super::{extent, gaps, words};
use scenecast_core::utc_text;
use scenecast_files::HOW_TO_RECOVER;
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
    sentences.extend(
        vehicle.made_up(dive).map(|what| format!("Positions or images are not those of a real dive: this was {what}.")),
    );
    sentences.extend(place(dive, state, vehicle));
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
    if extent::sea_floor(dive, state, vehicle).is_some() {
        sentences.push(
            "The depth of the water is the depth of the vehicle and its height above the sea floor; where nothing measured that height, it is \
             the configured one (survey.altitude_m)."
                .to_owned(),
        );
    }
    sentences
}

/// How many images lie where the map has another class.
fn images(state: &VehicleState, vehicle: &DiveVehicle) -> Option<String> {
    let all = || vehicle.exemplars.iter().map(|(_, image)| image);
    let other = all().filter(|image| !vehicle.shows_class(state, image)).count();
    (other > 0).then(|| {
        format!(
            "{other} of the {} lie where the map at the end has another class than that of which they were sent as examples.",
            words::counted(all().count(), "image that arrived", "images that arrived")
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
         {most_m:.0} m at most: what was mapped then may lie so far {off}.",
        utc_text(first.at_s),
        utc_text(last.at_s),
        dive.lasted(time_s)
    ))
}

#[cfg(test)]
mod tests {
    use super::super::track_point::TrackPoint;
    use super::*;

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
}
