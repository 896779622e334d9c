//! What became of the frames of a dive, in one table.

use super::dive::{Dive, DiveVehicle};
use super::words;
use crate::recording::FrameCounts;
use scenecast_surface::state::{LinkDirection, LinkSummary};
use std::fmt::Write;

/// The share of the frames that did not arrive, by their numbers; `None` if nothing came from the vehicles.
pub(super) fn told(LinkSummary { up, down, .. }: &LinkSummary) -> Option<String> {
    (up.frames > 0).then(|| {
        format!(
            "Of the numbered frames, the surface missed {:.1} % of those from the vehicles, and the vehicles did not acknowledge {:.1} % of \
             those to them; what these held of the map and of orders was sent again.",
            up.loss * 100.0,
            down.loss * 100.0
        )
    })
}

/// The frames of both directions, each count once.
pub(super) fn table(dive: &Dive, vehicle: &DiveVehicle) -> String {
    // Of several vehicles, one record does not have all frames.
    let own = Some(&vehicle.own.frames).filter(|own| own.sent + own.heard() > 0 && dive.state.vehicles.len() == 1);
    let surface = Some(&dive.frames);
    let is_whole = vehicle.covers(dive);
    let rows = [
        row("from the vehicles", (own, surface), &dive.state.link.up, is_whole),
        row("to the vehicles", (surface, own), &dive.state.link.down, is_whole),
    ];
    format!(
        "<h3>Frames and bytes</h3>\n<table><thead><tr><th>direction</th><th>transmitted</th><th>arrived</th><th>arrived and not used</th><th>lost on the \
         way</th><th>with numbers</th><th>missed of these</th></tr></thead>\n{}</table>\n<p>Transmitted and arrived: counted by the record of the end \
         that did it, each copy by itself. Lost on the way: the difference, which two records that cover the same time tell. With numbers: \
         counted by the surface, copies once; one from the vehicles is missed if the surface never accepted its number, one to them if \
         they did not acknowledge it.</p>\n",
        rows.concat()
    )
}

/// One direction: what the sender and the hearer counted, and what the surface counted by numbers.
fn row(
    name: &str,
    (from, to): (Option<&FrameCounts>, Option<&FrameCounts>),
    numbered: &LinkDirection,
    is_whole: bool,
) -> String {
    let unknown = || "not known".to_owned();
    let lost = from.zip(to).filter(|_| is_whole).map(|(from, to)| {
        let lost = from.sent.saturating_sub(to.heard());
        format!("{lost} ({:.1} %)", lost as f64 / from.sent.max(1) as f64 * 100.0)
    });
    let mut row = format!("<tr><td>{name}</td>");
    for (class, cell) in [
        ("n", from.map_or_else(unknown, |from| from.sent.to_string())),
        ("n", to.map_or_else(unknown, |to| to.heard().to_string())),
        ("", to.map_or_else(unknown, words::unused)),
        ("n", lost.unwrap_or_else(unknown)),
        ("n", numbered.frames.to_string()),
        ("n", format!("{} ({:.1} %)", numbered.lost, numbered.loss * 100.0)),
    ] {
        // Writing to a string cannot fail.
        let _ = write!(row, "<td class=\"{class}\">{cell}</td>");
    }
    row + "</tr>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_counted_once_each() {
        let counts = |sent, received| FrameCounts { sent, received, ..FrameCounts::default() };
        let numbered = LinkDirection { frames: 90, lost: 18, loss: 0.2, ..LinkDirection::default() };
        let told = |is_whole| row("to", (Some(&counts(100, 0)), Some(&counts(0, 75))), &numbered, is_whole);
        let cells = |lost: &str| {
            format!(
                "<tr><td>to</td><td class=\"n\">100</td><td class=\"n\">75</td><td class=\"\">none</td><td class=\"n\">{lost}</td><td class=\"n\">90</td>\
                 <td class=\"n\">18 (20.0 %)</td></tr>\n"
            )
        };
        assert_eq!(told(true), cells("25 (25.0 %)"));
        assert_eq!(told(false), cells("not known"), "the records do not cover the same time");
        assert_eq!(super::told(&LinkSummary::default()), None);
    }
}
