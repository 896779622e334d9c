//! The link in a report: over time, over range, and in bytes.

use super::Escaped;
use super::chart::{self, Series};
use super::dive::{Dive, DiveVehicle};
use super::words::{self, counted};
use crate::state::VehicleState;
use scenecast_messages::scenecast_msgs::Link;
use std::collections::BTreeMap;
use std::fmt::Write;

impl Dive {
    /// The link and the position over time, the link over range, and what its bytes were.
    pub(super) fn link(&self, page: &mut String, vehicle: &DiveVehicle) {
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
        } else {
            *page += "<p>The frames did not go through a modem, so their round trips tell no distance.</p>\n";
        }
        self.frames_and_bytes(page, vehicle);
    }

    /// What became of the frames, and what the bytes of each class brought.
    fn frames_and_bytes(&self, page: &mut String, vehicle: &DiveVehicle) {
        let directions = [("from the vehicles", &self.state.link.up), ("to the vehicles", &self.state.link.down)];
        *page += "<table><thead><tr><th>direction</th><th>frames</th><th>lost</th></tr></thead>";
        for (name, direction) in directions {
            let (frames, lost) = (direction.frames, direction.loss * 100.0);
            let _ =
                write!(page, "<tr><td>{name}</td><td class=\"n\">{frames}</td><td class=\"n\">{lost:.1} %</td></tr>");
        }
        let _ = writeln!(
            page,
            "</table>\n<p>Frames are numbered: those are lost whose number the other end never received, over the whole mission.{}</p>",
            match self.frames.unused() {
                0 => String::new(),
                _ => format!(" At the surface, {}.", words::unused(&self.frames)),
            }
        );
        let has_own = !vehicle.own.sent_bits.is_empty() && self.vehicles.len() == 1;
        let own_title = if has_own { "<th>sent on board, copies not counted</th>" } else { "" };
        let _ = writeln!(
            page,
            "<table><thead><tr><th>direction</th><th>class</th><th>bytes</th>{own_title}<th>share</th><th>what they brought</th></tr></thead>"
        );
        for (name, direction) in directions {
            let mut classes: Vec<_> = direction.bytes_by_class.iter().filter(|(_, bytes)| **bytes > 0).collect();
            classes.sort_by_key(|(_, bytes)| std::cmp::Reverse(**bytes));
            let all: u64 = classes.iter().map(|(_, bytes)| **bytes).sum();
            for (class, bytes) in classes {
                let sent = vehicle.own.sent_bits.get(class).filter(|_| std::ptr::eq(direction, &self.state.link.up));
                let sent = sent.map_or_else(String::new, |bits| bits.div_ceil(8).to_string());
                let _ = writeln!(
                    page,
                    "<tr><td>{name}</td><td>{}</td><td class=\"n\">{bytes}</td>{}<td class=\"n\">{:.0} %</td><td>{}</td></tr>",
                    Escaped(class),
                    if has_own { format!("<td class=\"n\">{sent}</td>") } else { String::new() },
                    *bytes as f64 / all.max(1) as f64 * 100.0,
                    self.brought(class, *bytes)
                );
            }
        }
        *page +=
            "</table>\n<p>Bytes from the vehicles are those that were heard, bytes to them those that were sent.</p>\n";
    }

    /// What the bytes of a class brought.
    fn brought(&self, class: &str, bytes: u64) -> String {
        let each = |count: usize, one: &str, several: &str, what: &str| match count {
            0 => String::new(),
            n => format!("{}, {:.0} bytes {what}", counted(n, one, several), bytes as f64 / n as f64),
        };
        let sum = |count: fn(&DiveVehicle) -> usize| self.vehicles().map(|(_, vehicle)| count(vehicle)).sum::<usize>();
        // Bytes of a map that the record does not begin with, or of one that was dropped, would be counted for other cells.
        let is_whole = |(_, vehicle): (&VehicleState, &DiveVehicle)| vehicle.has_one_map();
        let is_whole = self.vehicles().all(is_whole);
        let cells = |count: usize| match count {
            0 => String::new(),
            n if !is_whole => counted(n, "cell", "cells"),
            n => format!(
                "{}, {:.2} bits each, their changes included",
                counted(n, "cell", "cells"),
                bytes as f64 * 8.0 / n as f64
            ),
        };
        match class {
            "map" => cells(sum(|vehicle| vehicle.labels.explored())),
            "exemplar" => each(sum(|vehicle| vehicle.exemplars.len()), "image", "images", "each"),
            "status" => each(
                sum(|vehicle| vehicle.track.len()),
                "reported place",
                "reported places",
                "each, with all else of the status",
            ),
            "directive" => {
                each(sum(|vehicle| vehicle.orders_of_people().count()), "order", "orders", "each, repeats included")
            }
            "fix" => each(
                sum(|vehicle| vehicle.orders.len() - vehicle.orders_of_people().count()),
                "position fix",
                "position fixes",
                "each, repeats included",
            ),
            "overhead" => "headers and checks of frames".to_owned(),
            layer => cells(sum_of_layer(self, layer)),
        }
    }
}

/// The cells of a layer of the maps at the end.
fn sum_of_layer(dive: &Dive, layer: &str) -> usize {
    dive.vehicles().map(|(_, vehicle)| vehicle.layer_cells.get(layer).copied().unwrap_or_default()).sum()
}

/// The quality of the link by the distance of the vehicle, which the round trips tell; empty where they are not known.
fn over_range(vehicle: &DiveVehicle) -> String {
    const SOUND_M_S: f64 = 1500.0;
    let known = vehicle.link.iter().filter(|(_, link)| link.round_trip_s > 0.0);
    let known: Vec<(f64, &Link)> =
        known.map(|(_, link)| (f64::from(link.round_trip_s) / 2.0 * SOUND_M_S, link)).collect();
    let Some(farthest_m) = known.iter().map(|(range_m, _)| *range_m).reduce(f64::max) else {
        return "<p>No round trip was measured, so the distance of the vehicle is not known.</p>\n".to_owned();
    };
    let step_m = chart::round_length(farthest_m / 4.0).max(10.0);
    let mut bins: BTreeMap<u64, Vec<&Link>> = BTreeMap::new();
    known.into_iter().for_each(|(range_m, link)| bins.entry((range_m / step_m) as u64).or_default().push(link));
    let mut table = "<h3>Link over range</h3>\n<table><tr><th>half of the round trip</th><th>moments</th><th>frames lost</th><th>received from it</th></tr>".to_owned();
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
        + "</table>\n<p>Each moment is one of every ten seconds. Half of the round trip is told as a distance at 1500 m/s; the vehicle was nearer than that, \
             as the time that modems and serial lines take is in it. The share lost is that of the last 64 frames, or of all so far while there \
             are fewer.</p>\n"
}
