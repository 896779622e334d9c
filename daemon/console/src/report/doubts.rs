//! What a reader of a report must not trust.

use super::dive::{Dive, DiveVehicle};
use super::gaps;
use scenecast_core::utc_text;

/// A place with a greater standard deviation is worth a sentence, metres.
const DOUBTFUL_M: f64 = 5.0;

/// The doubts about what a report says of a vehicle, a sentence each.
pub(super) fn doubts(dive: &Dive, vehicle: &DiveVehicle) -> Vec<String> {
    let mut sentences = Vec::new();
    sentences.extend(vehicle.made_up(dive).map(|what| format!("This was no dive, but {what}.")));
    sentences.extend(dive.damage.iter().map(|damage| format!("Not all of the record could be read: {damage}.")));
    sentences.extend(gaps::of_records(dive, vehicle));
    sentences.extend(dive.restarts_s.iter().map(|(stopped_s, _)| {
        format!(
            "The surface's program stopped some seconds after {}; what it had heard and sent by then and not stored is missing, also in the \
             counts of frames and bytes.",
            utc_text(*stopped_s)
        )
    }));
    sentences.extend(place(vehicle));
    if vehicle.own.runs_s.is_empty() {
        sentences.push(
            "Times of modes, faults and restarts are those at which the surface learned of them, and how far its map was behind is its own \
             forecast."
                .to_owned(),
        );
    }
    sentences.push(
        "The depth of the water is the depth of the vehicle and its height above the sea floor; where nothing measured that height, it is the \
         configured one (survey.altitude_m)."
            .to_owned(),
    );
    sentences
}

/// From when on its place was not known well.
fn place(vehicle: &DiveVehicle) -> Option<String> {
    let known = || vehicle.path().iter().filter(|point| point.sigma_m.is_finite());
    let doubtful = known().find(|point| point.sigma_m >= DOUBTFUL_M)?;
    let most_m = known().map(|point| point.sigma_m).fold(0.0, f64::max);
    Some(format!(
        "From {} on, the place of the vehicle was known to {DOUBTFUL_M} m only or worse, at worst to {most_m:.0} m (standard deviation): what was \
         mapped then may lie so far off the rest.",
        utc_text(doubtful.at_s)
    ))
}
