//! The link in a report: over time, over range, and in bytes.

use super::Escaped;
use super::chart::{self, Series};
use super::dive::{Dive, DiveVehicle};
use crate::state::{LinkDirection, VehicleState};
use scenecast_messages::scenecast_msgs::Link;
use std::collections::BTreeMap;
use std::fmt::Write;

impl Dive {
    /// The link and the position over time, the link over range, and what its bytes were.
    pub(super) fn link(&self, page: &mut String, state: &VehicleState, vehicle: &DiveVehicle) {
        let (begin, end) = self.span_s;
        let series = |name, unit, value: fn(&Link) -> f32| Series {
            name,
            unit,
            points: vehicle.link.iter().map(|(at_s, link)| (at_s - begin, f64::from(value(link)))).collect(),
        };
        let uncertainty = Series {
            name: "standard deviation of the position",
            unit: "m",
            points: vehicle.track.iter().map(|point| (point.at_s - begin, point.sigma_m)).collect(),
        };
        let charts = [
            series("received from the vehicle", "bit/s", |link| link.received_bps),
            series("sent to the vehicle", "bit/s", |link| link.sent_bps),
            series("share of the last 64 frames lost", "%", |link| link.loss * 100.0),
            series("data that waited at the vehicle", "bit", |link| link.backlog_bits as f32),
            series("age of the last frame from the vehicle", "s", |link| link.age_s),
            Series {
                name: "share of the cells that the vehicle had to send that the operator's map had with the same label",
                unit: "%",
                points: vehicle.maps.iter().map(|maps| (maps.at_s - begin, maps.agreement * 100.0)).collect(),
            },
            uncertainty,
        ];
        let charts: Vec<String> = charts.iter().filter_map(|series| chart::line(series, begin, end - begin)).collect();
        if !charts.is_empty() {
            let _ = writeln!(page, "<h3>Link and position over time</h3>\n<figure>{}</figure>", charts.join("\n"));
        }
        if vehicle.has_modem(self) {
            *page += &over_range(vehicle);
        }
        let direction = |name: &str, direction: &LinkDirection| {
            let mut classes: Vec<_> = direction.bytes_by_class.iter().filter(|(_, bytes)| **bytes > 0).collect();
            classes.sort_by_key(|(_, bytes)| std::cmp::Reverse(**bytes));
            let all: u64 = classes.iter().map(|(_, bytes)| **bytes).sum();
            let share = |bytes: u64| bytes as f64 / all.max(1) as f64 * 100.0;
            let classes: Vec<String> =
                classes.iter().map(|(class, bytes)| format!("{class} {bytes} ({:.0} %)", share(**bytes))).collect();
            format!(
                "<tr><td>{name}</td><td class=\"n\">{}</td><td class=\"n\">{:.1} %</td><td>{}</td></tr>",
                direction.frames,
                direction.loss * 100.0,
                Escaped(&classes.join(", "))
            )
        };
        let _ = writeln!(
            page,
            "<table><tr><th>direction</th><th>frames</th><th>lost</th><th>bytes by class: heard from the vehicles, sent to them</th></tr>{}{}</table>\n<p>Frames are numbered: \
             those are lost whose number the other end never received, over the whole mission.{} Classes: map and layers, status of the vehicle, directive \
             (orders), fix (positions for the vehicle), exemplar (images), and overhead (headers and checks of frames).</p>",
            direction("from the vehicles", &self.state.link.up),
            direction("to the vehicles", &self.state.link.down),
            match self.frames[2] {
                0 => String::new(),
                unused => format!(
                    " The surface could not use {unused} of the frames that it heard: they were damaged, copies of others, or of earlier \
                     runs."
                ),
            }
        );
        let map = self.state.link.up.bytes_by_class.get("map").copied().unwrap_or_default();
        let cells: usize = self.vehicles().map(|(_, vehicle)| vehicle.labels.explored()).sum();
        let budget = state
            .status
            .as_ref()
            .map_or_else(String::new, |status| format!("the vehicle's {} bit/s, ", status.budget_bps));
        let _ = writeln!(page, "<p>Budgets at the end: {budget}the surface's {} bit/s.", self.state.link.budget_bps);
        if map > 0 && cells > 0 {
            let _ = writeln!(
                page,
                " The {map} bytes of the map that arrived brought {cells} cells, {:.2} bits a cell, each change of a label included.",
                map as f64 * 8.0 / cells as f64
            );
        }
        let sent = vehicle.own.sent_bits.iter().filter(|(_, bits)| **bits > 0);
        let sent: Vec<String> = sent.map(|(content, bits)| format!("{content} {}", bits.div_ceil(8))).collect();
        if !sent.is_empty() {
            let sent = sent.join(", ");
            let _ = writeln!(
                page,
                " By its own record the vehicle sent these bytes, copies not counted: {}.",
                Escaped(&sent)
            );
        }
        *page += "</p>\n";
    }
}

/// The quality of the link by the distance of the vehicle, which the round trips tell; empty where they are not known.
fn over_range(vehicle: &DiveVehicle) -> String {
    const SOUND_M_S: f64 = 1500.0;
    let known = vehicle.link.iter().filter(|(_, link)| link.round_trip_s > 0.0);
    let known: Vec<(f64, &Link)> =
        known.map(|(_, link)| (f64::from(link.round_trip_s) / 2.0 * SOUND_M_S, link)).collect();
    let Some(farthest_m) = known.iter().map(|(range_m, _)| *range_m).reduce(f64::max) else { return String::new() };
    let step_m = chart::round_length(farthest_m / 4.0).max(10.0);
    let mut bins: BTreeMap<u64, Vec<&Link>> = BTreeMap::new();
    known.into_iter().for_each(|(range_m, link)| bins.entry((range_m / step_m) as u64).or_default().push(link));
    let mut table = "<h3>Link over range</h3>\n<table><tr><th>distance</th><th>moments</th><th>frames lost</th><th>received from it</th></tr>".to_owned();
    for (bin, links) in bins {
        let mean = |value: fn(&Link) -> f32| {
            let values: Vec<f64> =
                links.iter().map(|link| f64::from(value(link))).filter(|value| value.is_finite()).collect();
            values.iter().sum::<f64>() / values.len().max(1) as f64
        };
        let _ = write!(
            table,
            "<tr><td>{:.0} to {:.0} m</td><td class=\"n\">{}</td><td class=\"n\">{:.1} %</td><td class=\"n\">{:.0} bit/s</td></tr>",
            bin as f64 * step_m,
            (bin + 1) as f64 * step_m,
            links.len(),
            mean(|link| link.loss) * 100.0,
            mean(|link| link.received_bps)
        );
    }
    table
        + "</table>\n<p>Each moment is one of every ten seconds; the distance is half of the round trip at 1500 m/s, and so at most that: the time that modems and \
             serial lines take is in it. The share lost is that of \
             the last 64 frames, or of all so far while there are fewer.</p>\n"
}
