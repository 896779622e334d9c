//! The page of a report.

use super::areas::ClassArea;
use super::dive::{Dive, DiveVehicle};
use super::effects::Effect;
use super::orders::said;
use super::{Escaped, doubts, extent, images, map_figure, summary, words};
use scenecast_core::utc_text;
use scenecast_files::RecordFile;
use scenecast_messages::scenecast_msgs::Event;
use scenecast_surface::state::VehicleState;
use scenecast_surface::{LabelBook, LogKind};
use serde_json::json;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::sync::LazyLock;

const STYLE: &str = "body{font:16px/1.45 system-ui,sans-serif;max-width:960px;margin:2em auto;padding:0 1em;color:#111;background:#fff}\
table{border-collapse:collapse;width:100%;font-size:.9em}th,td{text-align:left;vertical-align:top;padding:.25em .6em;\
border-bottom:1px solid #ccc}p,li{max-width:50em}td.n{text-align:right;white-space:nowrap}td.t,.t{white-space:nowrap}td.o{min-width:15em}.wide{font-size:.8em}figure{margin:1em 0}figcaption{font-size:.85em}svg{width:100%;height:auto}\
svg text{font:11px system-ui,sans-serif;paint-order:stroke;stroke:#fff;stroke-width:2.5px;stroke-linejoin:round}.border{stroke:#000;stroke-opacity:.55;stroke-width:.7;fill:none}.grid{stroke:#000;stroke-opacity:.25;stroke-width:.6;fill:none}\
.track{fill:none;stroke:#000;stroke-width:1.5;stroke-linejoin:round}.line{fill:none;stroke:#000;stroke-width:1.2}\
thead{display:table-header-group}.swatch,svg{-webkit-print-color-adjust:exact;print-color-adjust:exact}thead tr{break-after:avoid}.fence{fill:none;stroke:#000;stroke-width:1.5;stroke-dasharray:6 3}.area{fill:none;stroke:#000;stroke-dasharray:1 4}.out{fill:#000;fill-opacity:.12;stroke:#000;stroke-dasharray:2 2}.scale{fill:none;stroke:#000;stroke-width:1.5}.swatch{display:inline-block;width:1em;height:1em;border:1px solid #000;\
vertical-align:-.15em;margin-right:.4em}.images{display:flex;flex-wrap:wrap;gap:.6em}.images figure{margin:0;width:188px}.images svg{width:112px}.images img{width:112px;display:block;\
image-rendering:pixelated}.number{font-weight:600;paint-order:stroke;stroke:#fff;stroke-width:3px}\
.point{fill:#fff;stroke:#000;stroke-width:1.5}.legend>span{display:inline-block;margin-right:1em}@media(max-width:700px){table{display:block;overflow-x:auto}}\
h2,h3{break-after:avoid}tr,svg{break-inside:avoid}@media print{body{margin:0;max-width:none}figure.map{break-inside:avoid}figure.map svg{max-height:13cm}thead+tbody>tr:first-child{break-before:avoid}h2+p,h3+p,p:last-child{break-before:avoid}}";

impl Dive {
    /// The report as one HTML file.
    pub fn html(&self) -> String {
        let mission = Escaped(&self.state.mission.name);
        let mut page = format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
             <title>Dive report: {mission}</title><style>{STYLE}</style></head><body>\n<h1>Dive report: {mission}</h1>\n"
        );
        if let Some(credit) = self.credit() {
            let _ = writeln!(page, "<p>{}</p>", Escaped(credit));
        }
        if self.state.vehicles.is_empty() {
            page += "<p>The surface knew no vehicle.</p>\n";
        }
        for (state, vehicle) in self.vehicles() {
            self.vehicle(&mut page, state, vehicle);
        }
        self.changes_of_labels(&mut page);
        self.changes_of_command(&mut page);
        self.events_table(&mut page);
        self.origin_of_figures(&mut page);
        page
    }

    /// Who made the dive, as they want to be cited; `None` if nobody said it.
    fn credit(&self) -> Option<&str> {
        self.settings.text("surface.credit").filter(|credit| !credit.is_empty())
    }

    /// Settings, versions, and how to cite.
    fn origin_of_figures(&self, page: &mut String) {
        self.settings.table(page, "the surface");
        // Both ends of a rehearsal run with the same.
        let others = self.vehicles().filter(|(_, vehicle)| vehicle.own.settings != self.settings);
        others.for_each(|(state, vehicle)| vehicle.own.settings.table(page, &state.name));
        let (begin, end) = (utc_text(self.span_s.0), utc_text(self.span_s.1));
        let (mission, run) = (Escaped(&self.state.mission.name), Escaped(&self.state.mission.id));
        let recorded = if self.settings.program.is_empty() { "an earlier scenecast" } else { &self.settings.program };
        let names: Vec<&str> = self.state.vehicles.iter().map(|vehicle| vehicle.name.as_str()).collect();
        let program = Escaped(scenecast_core::program());
        let reported =
            if recorded == scenecast_core::program() { String::new() } else { format!(", report by {program}") };
        let made_up: BTreeSet<String> = self.vehicles().filter_map(|(_, vehicle)| vehicle.made_up(self)).collect();
        let is_known = self.vehicles().all(|(_, vehicle)| !vehicle.own.settings.program.is_empty());
        let made_up: String = match made_up.is_empty() && !is_known {
            true => " (whether motion and images were real, these records do not say)".to_owned(),
            false => made_up.iter().map(|what| format!(", {what}")).collect(),
        };
        let credit = self.credit().map_or_else(String::new, |credit| format!("{}: ", Escaped(credit)));
        let own = self.vehicles().filter(|(_, vehicle)| !vehicle.own.track.is_empty()).count();
        let own = if own > 0 { " and those of the vehicles themselves" } else { "" };
        let origin =
            self.state.mission.origin.map_or_else(String::new, |origin| format!(", at {}", words::origin(origin)));
        let _ = writeln!(
            page,
            "<h2>How this was made</h2>\n<p>By {program} from the records of the surface{own}, run {run}, recorded from {begin} to {end}. \
             The map is the operator's: what had arrived over the link. Areas are counts of cells. Names of classes are those at the end.</p>\n{}<h2>How to cite</h2>\n<p>{credit}Mission \u{201c}{mission}\u{201d}, vehicle {}, {begin} to {end}: map of the \
             sea floor by an unsupervised scene model{made_up}{origin}, run {run}, recorded by {}{reported}.</p>\n</body></html>",
            self.files_table(),
            Escaped(&names.join(", ")),
            Escaped(recorded),
        );
    }

    /// The files of the records, so that others can tell whether they have the same.
    fn files_table(&self) -> String {
        if self.files.is_empty() {
            return String::new();
        }
        let row = |file: &RecordFile| {
            format!(
                "<tr><td>{}</td><td class=\"n\">{}</td><td style=\"word-break:break-all\">{}</td></tr>\n",
                Escaped(&file.name),
                file.bytes,
                file.sha256
            )
        };
        let rows: String = self.files.iter().map(row).collect();
        format!("<table><thead><tr><th>file</th><th>bytes</th><th>SHA-256</th></tr></thead>\n{rows}</table>\n")
    }

    fn vehicle(&self, page: &mut String, state: &VehicleState, vehicle: &DiveVehicle) {
        let _ = writeln!(page, "<h2>{}</h2>", Escaped(&state.name));
        let doubts = ("How far to trust it", doubts::doubts(self, state, vehicle));
        for (title, sentences) in summary::summary(self, state, vehicle).into_iter().chain([doubts]) {
            let items: String = sentences.iter().map(|sentence| format!("<li>{}</li>\n", Escaped(sentence))).collect();
            let _ = writeln!(page, "<h3>{title}</h3>\n<ul>\n{items}</ul>");
        }
        let area = extent::of_survey(self, vehicle);
        if let Some(map) = map_figure::map(state, vehicle, area) {
            let _ = writeln!(
                page,
                "<figure class=\"map\">{map}<figcaption><div class=\"legend\">{}</div>The operator's map at the end, each class with its number, and the \
                 track of the vehicle: {}. Squares: places of images. {}{}Metres east and \
                 north of the mission's origin (WGS 84 where it has one); north is up.</figcaption></figure>",
                legend(state, vehicle),
                match vehicle.own.track.len() {
                    0 | 1 => "straight lines between the places that the vehicle reported",
                    _ => "by its own record",
                },
                if area.is_some() { "Dots: the area of the survey. " } else { "" },
                match state.orders.fence_in_force {
                    Some(_) => "Long dashes: the fence that was in force at the end; grey: areas to stay out of. ",
                    None => "",
                }
            );
        }
        self.floor_figure(page, state, vehicle);
        classes(page, self, state, vehicle);
        notes(page, self, state);
        self.orders_table(page, state, vehicle);
        self.in_force(page, state, vehicle);
        self.steering(page, state, vehicle);
        self.effects_table(page, state, vehicle);
        self.link(page, state, vehicle);
    }

    /// Who named and merged labels, and when.
    fn changes_of_labels(&self, page: &mut String) {
        self.table_of(page, "Names and merges of labels", true, |event| {
            event.source == LogKind::Record.name() && said(&event.text, |words| words.starts_with("label ")).is_some()
        });
    }

    /// Who had command, and how it passed.
    fn changes_of_command(&self, page: &mut String) {
        self.table_of(page, "Who had command", false, |event| event.source == LogKind::Command.name());
    }

    /// These events under a title; `has_vehicles`: with the vehicle that each is about.
    fn table_of(&self, page: &mut String, title: &str, has_vehicles: bool, is_it: impl Fn(&Event) -> bool) {
        let vehicle = |cell: String| if has_vehicles { cell } else { String::new() };
        let rows = self.events.iter().filter(|(_, event)| is_it(event)).map(|(at_s, event)| {
            let (at, told) = (utc_text(*at_s), words::event(self.book(&event.vehicle), event));
            let vehicle = vehicle(format!("<td class=\"t\">{}</td>", Escaped(&event.vehicle)));
            format!("<tr><td class=\"t\">{at}</td>{vehicle}<td>{}</td></tr>\n", Escaped(&told))
        });
        let rows: String = rows.collect();
        if !rows.is_empty() {
            let vehicle = vehicle("<th>vehicle</th>".to_owned());
            let _ = writeln!(
                page,
                "<h2>{title}</h2>\n<table><thead><tr><th>time (UTC)</th>{vehicle}<th>by whom, and what</th></tr></thead>\n{rows}</table>"
            );
        }
    }

    /// What the labels of a vehicle are called.
    fn book(&self, vehicle: &str) -> &LabelBook {
        static UNNAMED: LazyLock<LabelBook> = LazyLock::new(LabelBook::default);
        let state = self.state.vehicles.iter().find(|state| state.name == vehicle);
        state.map_or(&UNNAMED, |state| &state.label_book)
    }

    fn events_table(&self, page: &mut String) {
        if self.events.is_empty() {
            return;
        }
        *page += "<h2>Events</h2>\n<table><thead><tr><th>time (UTC)</th><th>vehicle</th><th>kind</th><th>event</th></tr></thead>\n";
        for (at_s, event) in &self.events {
            let _ = writeln!(
                page,
                "<tr><td class=\"t\">{}</td><td class=\"t\">{}</td><td class=\"t\">{}</td><td>{}</td></tr>",
                utc_text(*at_s),
                Escaped(&event.vehicle),
                Escaped(words::kind(&event.source)),
                Escaped(&words::event(self.book(&event.vehicle), event))
            );
        }
        *page += "</table>\n";
    }

    /// The figures of the report.
    pub fn json(&self) -> serde_json::Value {
        let vehicles = self.vehicles().map(|(state, vehicle)| {
            let classes = vehicle.map.classes.iter().map(|class| {
                let book = &state.label_book;
                json!({ "label": class.label, "name": book.title(class.label), "colour": book.colour_text(class.label),
                        "cells": class.cells, "area_m2": class.area_m2, "interval_m2": class.interval_m2 })
            });
            let orders = vehicle.orders_of_people().map(|(order @ (slot, version), way)| {
                let (by, ordered) = self.ordered(state, vehicle, order);
                let steps = way.iter().map(|step| {
                    json!({ "utc": utc_text(step.at_s), "status": words::status(step.status), "reason": step.reason })
                });
                json!({ "slot": slot, "version": version, "by": by, "ordered": ordered, "steps": steps.collect::<Vec<_>>() })
            });
            let effects = self.effects(state, vehicle).into_iter().map(|Effect { order: (slot, version), from_s, to_s, told }| {
                json!({ "slot": slot, "version": version, "from": utc_text(from_s), "to": utc_text(to_s), "told": told })
            });
            json!({
                "name": state.name,
                "summary": summary::summary(self, state, vehicle).into_iter().flat_map(|(_, told)| told).collect::<Vec<_>>(),
                "doubts": doubts::doubts(self, state, vehicle),
                "distance_m": vehicle.distance_m(),
                "cell_m": vehicle.map.cell_m,
                "classes": classes.collect::<Vec<_>>(),
                "orders": orders.collect::<Vec<_>>(),
                "effects": effects.collect::<Vec<_>>(),
                "exemplars": vehicle.exemplars.len(),
                "track": vehicle.path().iter().map(|point| json!({
                    "utc": utc_text(point.at_s), "east_m": point.east_m, "north_m": point.north_m,
                    "depth_m": point.depth_m, "sigma_m": point.sigma_m,
                })).collect::<Vec<_>>(),
                "agreement": vehicle.maps.iter().map(|maps| json!({
                    "utc": utc_text(maps.at_s), "cells": maps.cells, "share": maps.agreement, "lag_s": maps.lag_s,
                })).collect::<Vec<_>>(),
                "notes": state.notes,
                "markers": state.markers,
            })
        });
        let events = self.events.iter().map(|(at_s, event)| {
            json!({ "utc": utc_text(*at_s), "vehicle": event.vehicle, "kind": event.source, "text": event.text })
        });
        json!({
            "mission": self.state.mission.name,
            "run": self.state.mission.id,
            "origin": self.state.mission.origin,
            "link": { "up": self.state.link.up, "down": self.state.link.down },
            "events": events.collect::<Vec<_>>(),
            "damage": self.damage,
            "files": self.files.iter().map(|file| json!({ "name": file.name, "bytes": file.bytes, "sha256": file.sha256 }))
                .collect::<Vec<_>>(),
            "program": self.settings.program,
            "rehearsal_seed": self.settings.rehearsal_seed,
            "settings": self.settings.told(),
            "mission_speed": self.state.mission.speed,
            "begin": utc_text(self.span_s.0),
            "end": utc_text(self.span_s.1),
            "frames": { "sent": self.frames.sent, "received": self.frames.received, "dropped": self.frames.unused() },
            "vehicles": vehicles.collect::<Vec<_>>(),
        })
    }
}

fn classes(page: &mut String, dive: &Dive, state: &VehicleState, vehicle: &DiveVehicle) {
    let all: u64 = vehicle.map.classes.iter().map(|class| class.cells).sum();
    if all == 0 {
        return;
    }
    *page += "<h3>Classes</h3>\n<table><thead><tr><th>no.</th><th>class</th><th>cells</th><th>area</th><th>95 % interval</th><th>share</th></tr></thead>\n";
    for class in &vehicle.map.classes {
        let _ = writeln!(
            page,
            "<tr><td class=\"n\">{}</td><td><span class=\"swatch\" style=\"background:{}\"></span>{}{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>\
             <td class=\"n\">{}</td><td class=\"n\">{:.1} %</td></tr>",
            class.label,
            state.label_book.colour_text(class.label),
            Escaped(&state.label_book.title(class.label)),
            words::merged(state, vehicle, class.label),
            class.cells,
            words::area(class.area_m2),
            words::interval(class.interval_m2),
            class.cells as f64 / all as f64 * 100.0
        );
    }
    let _ = writeln!(page, "</table>\n<p>{}</p>", words::of_intervals(&vehicle.map.classes));
    images::of_classes(page, dive, state, vehicle);
    images::without_cells(page, dive, state, vehicle);
}

/// The classes by their colours and numbers.
fn legend(state: &VehicleState, vehicle: &DiveVehicle) -> String {
    let entry = |class: &ClassArea| {
        let (colour, title) = (state.label_book.colour_text(class.label), words::label(&state.label_book, class.label));
        let swatch = format!("<span class=\"swatch\" style=\"background:{colour}\"></span>");
        format!("<span>{swatch}{}</span> ", Escaped(&title))
    };
    vehicle.map.classes.iter().map(entry).collect()
}

fn notes(page: &mut String, dive: &Dive, state: &VehicleState) {
    if state.notes.is_empty() && state.markers.is_empty() {
        return;
    }
    *page += "<h3>Notes and markers</h3>\n<ul>\n";
    let notes = state.notes.iter().map(|note| (note.at_s, &note.author, note.text.clone()));
    let markers = state.markers.iter().map(|marker| {
        let on_earth = words::on_earth(dive, (marker.x_m, marker.y_m));
        let place = format!("{}, {}{on_earth}", words::east(marker.x_m), words::north(marker.y_m));
        (marker.at_s, &marker.author, format!("{} ({place})", marker.text))
    });
    let mut all: Vec<(f64, &String, String)> = notes.chain(markers).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (at_s, author, text) in all {
        let author = Escaped(words::author(author));
        let _ = writeln!(page, "<li>{}, {author}: {}</li>", utc_text(dive.unix_s(at_s)), Escaped(&text));
    }
    *page += "</ul>\n";
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_messages::contents::valid_part;

    #[test]
    fn the_summary_has_headings() {
        let mut dive = Dive::default();
        let state = VehicleState { name: "wrasse".to_owned(), ..VehicleState::default() };
        dive.vehicles.insert(valid_part(&state.name), DiveVehicle::default());
        dive.state.vehicles = vec![state];
        let page = dive.html();
        let places = ["Where and when", "What was found", "What went wrong", "How far to trust it"]
            .map(|title| page.find(&format!("<h3>{title}</h3>")).unwrap());
        assert!(places.is_sorted(), "{places:?}");
        assert!(dive.json()["vehicles"][0]["summary"][0].is_string(), "sentences without headings");
    }
}
