//! The log of a dive: what the surface logged, and what vehicles recorded of themselves.

use super::seconds;
use super::words::{self, NO_ORDER};
use crate::recording::Recording;
use scenecast_core::utc_text;
use scenecast_messages::scenecast_msgs::Event;
use scenecast_protocol::directive::SlotId;
use scenecast_surface::{LabelBook, LogKind};

/// The source of the accounts of a vehicle's images.
const IMAGES: &str = "images";

/// The number of nanoseconds in a second.
const SECOND: u64 = 1_000_000_000;

/// The entries of the surface's log at the times at which they happened, each once, and what vehicles have recorded themselves.
pub(super) fn events(recording: &Recording, is_scaled: bool) -> Vec<(f64, Event)> {
    let happened = |at: u64, event: &Event| match event.header.stamp.nanos() {
        0 => seconds(at),
        nanos => nanos as f64 / 1e9,
    };
    let mut events: Vec<(f64, Event)> =
        recording.log.iter().map(|(at, event)| (happened(*at, event), event.clone())).collect();
    events.iter_mut().for_each(|(_, event)| name_mission_time(event, is_scaled));
    let unnamed = LabelBook::default();
    for (part, known) in &recording.vehicles {
        let given = recording.operator.get(part).into_iter().flat_map(|known| &known.given);
        let stops = given
            .filter(|order| order.slot == SlotId::Constraints.name() && words::content(&unnamed, order) != "resume");
        // Otherwise the order may have been given before the record.
        let begins = recording.timeline.states.first().map(|state| state.nanos);
        let is_whole =
            begins.zip(known.runs.first()).is_some_and(|(begins, run)| begins <= run.0.saturating_add(SECOND));
        let first_stop = stops.map(|order| order.header.stamp.nanos()).min().unwrap_or(i64::MAX);
        let told = known.events.iter().filter(|(_, event)| !["fix", IMAGES].contains(&event.source.as_str()));
        events.extend(told.map(|(at, event)| {
            let mut event = Event { source: format!("{}, on board", event.source), ..event.clone() };
            let waits = is_whole && (*at as i64) < first_stop;
            if let Some(mode) = event.text.strip_suffix(": order").filter(|_| waits) {
                event.text = format!("{mode}{NO_ORDER}");
            }
            (seconds(*at), event)
        }));
    }
    events.sort_by(|a, b| a.0.total_cmp(&b.0));
    // A surface that was restarted may have recorded again what it knew.
    events
        .dedup_by(|a, b| a.0 == b.0 && a.1.text == b.1.text && a.1.source == b.1.source && a.1.vehicle == b.1.vehicle);
    events
}

/// Says of the time in an event about silence that it is the mission's, and leaves the length of one that is over to the report, which
/// has it by the frames.
fn name_mission_time(event: &mut Event, is_scaled: bool) {
    if event.source != LogKind::Contact.name() {
        return;
    }
    if event.text.starts_with("received again after ") {
        event.text = "received again".to_owned();
    } else if is_scaled && event.text.starts_with("silent for ") {
        event.text += " of the mission";
    }
}

/// The last account of the images in each of a vehicle's runs.
pub(super) fn images(events: &[(u64, Event)], runs: &[(u64, u64)]) -> Vec<String> {
    let last = |(from, to): &(u64, u64)| {
        let mut of_run = events.iter().filter(|(at, event)| event.source == IMAGES && (from..=to).contains(&at));
        let (at, event) = of_run.next_back()?;
        // A program that is ended in order counts them once more.
        let is_final = to.saturating_sub(*at) <= 5 * SECOND;
        let least = if is_final { String::new() } else { format!(", as last counted at {}", utc_text(seconds(*at))) };
        Some(format!("{}{least}", event.text))
    };
    runs.iter().filter_map(last).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_silence_are_named_as_the_missions() {
        let named = |source: &str, text: &str| {
            let mut event = Event { source: source.to_owned(), text: text.to_owned(), ..Event::default() };
            name_mission_time(&mut event, true);
            event.text
        };
        assert_eq!(named("contact", "silent for 1 min 0 s"), "silent for 1 min 0 s of the mission");
        assert_eq!(named("contact", "received"), "received");
        assert_eq!(named("contact", "received again after 1 min 28 s"), "received again");
        assert_eq!(named("record", "silent for 1 min 0 s"), "silent for 1 min 0 s");
    }
}
