//! The link in a report: over time, over range, and in bytes.

use super::Escaped;
use super::chart::{self, Series};
use super::dive::{Dive, DiveVehicle};
use super::round_trip::by_round_trip;
use super::words::{self, counted};
use super::{frames, gaps};
use scenecast_core::utc_text;
use scenecast_messages::scenecast_msgs::Link;
use scenecast_surface::state::{LinkDirection, LinkSummary, VehicleState};
use std::fmt::Write;

impl Dive {
    /// What became of the frames, in sentences.
    pub(super) fn link_sentences(&self, vehicle: &DiveVehicle) -> Vec<String> {
        let mut sentences: Vec<String> = frames::told(&self.state.link).into_iter().collect();
        let LinkSummary { up, down, .. } = &self.state.link;
        if !vehicle.has_modem(self) {
            sentences.push("The frames did not go through a modem, so no energy is told.".to_owned());
        } else if let (Some(up_j), Some(down_j)) = (up.energy_j, down.energy_j) {
            sentences.push(format!(
                "Calculated from modem.tx_watts of the surface and the frames that it knows of, the modems of the vehicles spent about {up_j:.0} J on \
                 transmitting, that of the surface {down_j:.0} J."
            ));
        }
        sentences
    }

    /// The link and the position over time, the link over range, and what its bytes were.
    pub(super) fn link(&self, page: &mut String, state: &VehicleState, vehicle: &DiveVehicle) {
        let (begin, end) = self.span_s;
        // While nothing arrives, what the surface had last says nothing of the link.
        let silences = gaps::silences(self, vehicle);
        let is_silent = |at_s: f64| silences.iter().any(|gap| (gap.0..gap.1).contains(&at_s));
        let of_link = |name, unit: &str, value: &dyn Fn(f64, &Link) -> f64| Series {
            name,
            unit: unit.to_owned(),
            points: vehicle.link.iter().map(|(at_s, link)| (at_s - begin, value(*at_s, link))).collect(),
        };
        let known = |at_s: f64, value: f32| if is_silent(at_s) { f64::NAN } else { f64::from(value) };
        let (a_second, s) = match self.is_scaled() {
            true => ("bit per second of the mission", "s of the clock"),
            false => ("bit/s", "s"),
        };
        let charts = [
            of_link("received from the vehicle", a_second, &|_, link| f64::from(link.received_bps)),
            of_link("sent to the vehicle", a_second, &|_, link| f64::from(link.sent_bps)),
            of_link("share of the last 64 frames lost", "%", &|at_s, link| known(at_s, link.loss * 100.0)),
            of_link("data that waited at the vehicle, as it reported last", "bit", &|at_s, link| {
                known(at_s, link.backlog_bits as f32)
            }),
            of_link("age of the last frame from the vehicle", s, &|_, link| {
                f64::from(link.age_s) / self.state.mission.speed
            }),
            Series {
                name: "share of the cells that the vehicle had to send that the operator's map had with the same label",
                unit: "%".to_owned(),
                points: vehicle.maps.iter().map(|maps| (maps.at_s - begin, maps.agreement * 100.0)).collect(),
            },
            Series {
                name: "uncertainty of the place on the earth (68 %, east and north each)",
                unit: "m".to_owned(),
                points: vehicle.path().iter().map(|point| (point.at_s - begin, point.sigma_m)).collect(),
            },
        ];
        let charts: Vec<String> = charts.iter().filter_map(|series| chart::line(series, begin, end - begin)).collect();
        if !charts.is_empty() {
            let _ = writeln!(
                page,
                "<h3>Link and position over time</h3>\n<figure>{}<figcaption>A line has a gap where a value was not known, or came far later than \
                 usual.</figcaption></figure>",
                charts.join("\n")
            );
        }
        *page += &by_round_trip(self, vehicle);
        self.frames_and_bytes(page, state, vehicle);
    }

    /// Frames, losses and rates of each direction beside the budget of the end that sends.
    fn directions(
        &self,
        page: &mut String,
        state: &VehicleState,
        vehicle: &DiveVehicle,
        [up, down]: [(&str, &LinkDirection); 2],
    ) {
        *page += "<table><thead><tr><th>direction</th><th>bytes</th><th>mean rate</th><th>fullest \
                  minute</th><th>budget of the sender</th></tr></thead>";
        let of_surface = told_budgets(&budgets(vehicle.link.iter().map(|(at_s, link)| (*at_s, link))));
        let reported = state.status.as_ref().map(|status| format!("{} bit/s by its last report", status.budget_bps));
        // The other figures are those of all vehicles.
        let of_vehicle = told_budgets(&vehicle.own.budgets_bps).or(reported).filter(|_| self.vehicles.len() == 1);
        let fullest = |rate: fn(&Link) -> f32| {
            let first_s = vehicle.link.first().map_or(0.0, |(at_s, _)| *at_s);
            // In the first minute, the mean is that of less.
            let later = vehicle.link.iter().filter(|(at_s, _)| self.mission_s(at_s - first_s) >= 60.0);
            let rates = later.map(|(_, link)| f64::from(rate(link)));
            let most = rates.filter(|bps| bps.is_finite()).reduce(f64::max);
            most.map_or("not known".to_owned(), |bps| format!("{bps:.0} bit/s"))
        };
        let rows =
            [(up, fullest(|link| link.received_bps), of_vehicle), (down, fullest(|link| link.sent_bps), of_surface)];
        for ((name, direction), fullest, budget) in rows {
            let bytes: u64 = direction.bytes_by_class.values().sum();
            let _ = write!(
                page,
                "<tr><td>{name}</td><td class=\"n\">{bytes}</td><td class=\"n\">{:.0} bit/s</td>\
                 <td class=\"n\">{fullest}</td><td>{}</td></tr>",
                bytes as f64 * 8.0 / self.surface_ran_s().max(1.0),
                budget.as_deref().unwrap_or("not known")
            );
        }
        let _ = writeln!(
            page,
            "</table>\n<p>Bytes and rates from the vehicles are those that were heard, the others those that were sent, by the surface. The mean \
             is that of the bytes of frames over the time in which the surface ran; the fullest minute and the budget count bits on air, with \
             what the modem adds to each frame and with copies.</p>"
        );
    }

    /// For how long the surface recorded, mission seconds.
    fn surface_ran_s(&self) -> f64 {
        let stood_s: f64 = self.restarts_s.iter().map(|(from_s, to_s)| to_s - from_s).sum();
        self.mission_s(self.surface_s.1 - self.surface_s.0 - stood_s)
    }

    /// What became of the frames, and what the bytes of each class brought.
    fn frames_and_bytes(&self, page: &mut String, state: &VehicleState, vehicle: &DiveVehicle) {
        let directions = [("from the vehicles", &self.state.link.up), ("to the vehicles", &self.state.link.down)];
        *page += &frames::table(self, vehicle);
        self.directions(page, state, vehicle, directions);
        let has_own = !vehicle.own.sent_bits.is_empty() && self.vehicles.len() == 1;
        let own_title = if has_own { "<th>sent on board, copies not counted</th>" } else { "" };
        let _ = writeln!(
            page,
            "<table><thead><tr><th>direction</th><th>kind</th><th>bytes</th>{own_title}<th>share</th><th>what they brought</th></tr></thead>"
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
                    Escaped(words::traffic(class)),
                    if has_own { format!("<td class=\"n\">{sent}</td>") } else { String::new() },
                    *bytes as f64 / all.max(1) as f64 * 100.0,
                    self.brought(class, *bytes)
                );
            }
        }
        *page += "</table>\n";
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
            "map" => cells(sum(|vehicle| vehicle.map.labels.explored())),
            "exemplar" => {
                let of_labels = counted(sum(|vehicle| vehicle.exemplars.len()), "image of a label", "images of labels");
                let floor = sum(|vehicle| vehicle.floor.len());
                let of_floor = counted(floor, "image of the sea floor", "images of the sea floor");
                format!("{of_labels}, {of_floor}, without those that later ones replaced")
            }
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

/// The budgets of the end that recorded these, and since when each was in force.
pub(super) fn budgets<'a>(links: impl Iterator<Item = (f64, &'a Link)>) -> Vec<(f64, u32)> {
    let mut steps: Vec<(f64, u32)> = links.map(|(at_s, link)| (at_s, link.budget_bps)).collect();
    steps.dedup_by_key(|(_, bps)| *bps);
    steps
}

fn told_budgets(budgets: &[(f64, u32)]) -> Option<String> {
    let told = budgets.iter().enumerate().map(|(n, (at_s, bps))| match n {
        0 => format!("{bps} bit/s"),
        _ => format!("{bps} bit/s from {}", utc_text(*at_s)),
    });
    let told: Vec<String> = told.collect();
    (!told.is_empty()).then(|| told.join(", "))
}

/// The cells of a layer of the maps at the end.
fn sum_of_layer(dive: &Dive, layer: &str) -> usize {
    dive.vehicles().map(|(_, vehicle)| vehicle.map.layer_cells.get(layer).copied().unwrap_or_default()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_of_the_link_stand_beside_the_budget() {
        let mut dive = Dive::default();
        (dive.surface_s, dive.state.mission.speed) = ((0.0, 110.0), 1.0);
        dive.restarts_s = vec![(50.0, 60.0)];
        dive.state.link.up.bytes_by_class = [("map".to_owned(), 1000), ("status".to_owned(), 250)].into();
        let link = |(at_s, bps, budget_bps): (f64, f32, u32)| {
            (at_s, Link { received_bps: bps, budget_bps, ..Link::default() })
        };
        let link = [(0.0, 900.0, 4000), (70.0, 180.0, 4000), (90.0, 60.0, 2500)].map(link).to_vec();
        let vehicle = DiveVehicle { link, ..DiveVehicle::default() };
        let mut page = String::new();
        dive.frames_and_bytes(&mut page, &VehicleState::default(), &vehicle);
        let row = "1250</td><td class=\"n\">100 bit/s</td><td class=\"n\">180 bit/s</td><td>not known</td>";
        assert!(page.contains(row), "{page}");
        assert!(page.contains("<td>4000 bit/s, 2500 bit/s from 1970-01-01T00:01:30Z</td>"), "{page}");
    }
}
