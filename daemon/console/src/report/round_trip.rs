//! The quality of the link by the time that a frame and its answer take.

use super::chart::round_length;
use super::dive::{Dive, DiveVehicle};
use super::gaps;
use super::words::counted;
use scenecast_messages::scenecast_msgs::Link;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Half a round trip at this speed is the greatest distance that sound can have gone, m/s.
const SOUND_M_S: f64 = 1500.0;
/// For so long after a silence frames that waited may be in a round trip, mission seconds.
const AFTERMATH_S: f64 = 60.0;

/// The losses and rates at each moment by the round trip then, in a table; a sentence where none is known.
pub(super) fn by_round_trip(dive: &Dive, vehicle: &DiveVehicle) -> String {
    let known = vehicle.link.iter().filter(|(_, link)| link.round_trip_s > 0.0);
    let known: Vec<&(f64, Link)> = known.collect();
    let silences = gaps::silences(dive, vehicle);
    let is_disturbed =
        |at_s: f64| silences.iter().any(|gap| (gap.0..=gap.1 + AFTERMATH_S / dive.state.mission.speed).contains(&at_s));
    let usual = known.iter().filter(|(at_s, _)| !is_disturbed(*at_s));
    let usual: Vec<&Link> = usual.map(|(_, link)| link).collect();
    let trips = || usual.iter().map(|link| f64::from(link.round_trip_s));
    let Some((least_s, most_s)) = trips().reduce(f64::min).zip(trips().reduce(f64::max)) else {
        return "<p>No round trip of an undisturbed turn was measured, so the distance of the vehicle is not known.</p>\n".to_owned();
    };
    let step_s = round_length(most_s / 4.0).max(0.01);
    let mut bins: BTreeMap<u64, Vec<&Link>> = BTreeMap::new();
    usual.iter().for_each(|link| bins.entry((f64::from(link.round_trip_s) / step_s) as u64).or_default().push(link));
    let of_mission = if dive.is_scaled() { ", s of the mission" } else { ", s" };
    let mut table = format!(
        "<h3>Link by round trip</h3>\n<table><tr><th>round trip{of_mission}</th><th>moments</th><th>frames lost</th><th>received from it</th></tr>"
    );
    let decimals = if step_s < 0.1 { 2 } else { 1 };
    for (bin, links) in bins {
        let mean = |value: fn(&Link) -> f32| {
            let values: Vec<f64> =
                links.iter().map(|link| f64::from(value(link))).filter(|value| value.is_finite()).collect();
            values.iter().sum::<f64>() / values.len().max(1) as f64
        };
        let _ = write!(
            table,
            "<tr><td>{:.decimals$} to {:.decimals$}</td><td class=\"n\">{}</td><td class=\"n\">{:.1} %</td><td class=\"n\">{:.0} bit/s</td></tr>",
            bin as f64 * step_s,
            (bin + 1) as f64 * step_s,
            links.len(),
            mean(|link| link.loss) * 100.0,
            mean(|link| link.received_bps)
        );
    }
    let left_out = match known.len() - usual.len() {
        0 => String::new(),
        n => format!(
            " {} in silences, or in the minute after one, {} left out, as frames had waited.",
            counted(n, "moment", "moments"),
            if n == 1 { "is" } else { "are" }
        ),
    };
    let range = match vehicle.has_modem(dive) {
        true => format!(
            "A round trip includes the way of the sound there and back, and the time that frames, modems and serial lines take; by the shortest one, \
             {least_s:.2} s, the vehicle was at some time no farther than {:.0} m away (at {SOUND_M_S} m/s), and how far it was at others is not \
             known.",
            least_s / 2.0 * SOUND_M_S
        ),
        false => "The frames did not go through a modem, so their round trips tell no distance.".to_owned(),
    };
    let _ = writeln!(
        table,
        "</table>\n<p>{range} There is a moment every ten seconds of the mission.{left_out} The share lost is that of the last 64 frames, or of all so far \
         while there are fewer.</p>"
    );
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trips_of_an_outage_tell_no_distance() {
        let mut dive = Dive::default();
        (dive.surface_s, dive.state.mission.speed) = ((0.0, 400.0), 1.0);
        dive.settings.rehearsal_seed = Some(1);
        let link = |n: u32| {
            let at_s = f64::from(n) * 10.0;
            let round_trip_s = if (200.0..300.0).contains(&at_s) { 4.4 } else { 1.2 };
            (at_s, Link { round_trip_s, ..Link::default() })
        };
        let heard_s = (0..=400).filter(|s| !(190..250).contains(s)).map(f64::from).collect();
        let vehicle = DiveVehicle { link: (0..40).map(link).collect(), heard_s, ..DiveVehicle::default() };
        let table = by_round_trip(&dive, &vehicle);
        assert!(table.contains("<td>1.2 to 1.4</td>") && !table.contains("<td>4."), "{table}");
        assert!(table.contains("no farther than 900 m away") && table.contains("13 moments in silences"), "{table}");
    }
}
