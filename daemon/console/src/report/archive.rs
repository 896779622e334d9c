//! The report with the files of the map, its images and its tables, as one ZIP archive.

use super::dive::{Dive, DiveVehicle};
use super::order_step::OrderStep;
use super::track_point::TrackPoint;
use super::words;
use crate::export::{FloorPicture, MapFormat, floor_tiff, harmless};
use scenecast_core::{UserError, utc_text};
use scenecast_messages::contents::valid_part;
use scenecast_messages::scenecast_msgs::{Event, Exemplar};
use scenecast_surface::state::VehicleState;
use std::fmt::Display;
use std::io::{Cursor, Write};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// A text of a person as a field of a table.
fn said(text: &str) -> String {
    harmless(text).into_owned()
}

/// An archive that is being written in memory.
struct Archive(ZipWriter<Cursor<Vec<u8>>>);

impl Archive {
    fn add(&mut self, name: &str, bytes: &[u8]) -> Result<(), UserError> {
        let failed = |what: &dyn Display| UserError::Failed(format!("{name}: {what}"));
        self.0.start_file(name, SimpleFileOptions::default()).map_err(|e| failed(&e))?;
        self.0.write_all(bytes).map_err(|e| failed(&e))
    }

    fn add_table(&mut self, name: &str, header: &[&str], rows: Vec<Vec<String>>) -> Result<(), UserError> {
        let failed = |e: csv::Error| UserError::Failed(format!("{name}: {e}"));
        let mut table = csv::Writer::from_writer(Vec::new());
        table.write_record(header).map_err(failed)?;
        for row in rows {
            table.write_record(row).map_err(failed)?;
        }
        let bytes = table.into_inner().map_err(|e| UserError::Failed(format!("{name}: {}", e.error())))?;
        self.add(name, &bytes)
    }
}

impl Dive {
    /// The report as HTML and JSON, and for each vehicle a folder with its map in all formats, its labels, images, orders and track.
    ///
    /// # Errors
    /// A file is larger than an archive can hold.
    pub fn zip(&self) -> Result<Vec<u8>, UserError> {
        let mut archive = Archive(ZipWriter::new(Cursor::new(Vec::new())));
        archive.add("report.html", self.html().as_bytes())?;
        let json = serde_json::to_string_pretty(&self.json()).map_err(UserError::failed)?;
        archive.add("report.json", json.as_bytes())?;
        let event = |(at_s, event): &(f64, _)| {
            let Event { vehicle, source, text, .. } = event;
            vec![utc_text(*at_s), said(vehicle), source.clone(), said(text)]
        };
        let events = self.events.iter().map(event).collect();
        archive.add_table("events.csv", &["utc", "vehicle", "kind", "event"], events)?;
        for (state, vehicle) in self.vehicles() {
            self.add_vehicle(&mut archive, state, vehicle)?;
        }
        let bytes = archive.0.finish().map_err(UserError::failed)?;
        Ok(bytes.into_inner())
    }

    fn add_vehicle(&self, archive: &mut Archive, state: &VehicleState, vehicle: &DiveVehicle) -> Result<(), UserError> {
        let folder = valid_part(&state.name);
        let cells = self.map_cells(state, vehicle);
        let has_origin = self.state.mission.origin.is_some();
        let is_on_earth =
            |format: &MapFormat| matches!(format, MapFormat::UtmTiffClasses | MapFormat::Wgs84TiffClasses);
        for format in MapFormat::ALL.into_iter().filter(|format| has_origin || !is_on_earth(format)) {
            // A mission without an origin has no place for some formats.
            if let Ok(bytes) = format.export(&cells, self.state.mission.origin) {
                archive.add(&format!("{folder}/map.{}", format.extension()), &bytes)?;
            }
        }
        let point = |point: &TrackPoint| {
            let on_earth = self.state.mission.origin.map(|origin| words::lat_lon(origin, point.east_m, point.north_m));
            let [lat, lon] =
                on_earth.map_or([String::new(), String::new()], |(lat, lon)| [lat, lon].map(|v| format!("{v:.8}")));
            let metres = [point.east_m, point.north_m, point.depth_m, point.sigma_m].map(|m| format!("{m:.2}"));
            [vec![utc_text(point.at_s), lat, lon], metres.to_vec()].concat()
        };
        let track = ["utc", "latitude", "longitude", "east_m", "north_m", "depth_m", "sigma_m"];
        archive.add_table(&format!("{folder}/track.csv"), &track, vehicle.path().iter().map(point).collect())?;
        let order = |(order, way): (&(String, u32), &Vec<OrderStep>)| {
            let (by, ordered) = self.ordered(state, vehicle, order);
            let given = way.first().map_or(String::new(), |first| utc_text(first.given_s));
            let last = way.last().map(|last| (words::status(last.status), utc_text(last.at_s), last.reason.clone()));
            let (status, at, reason) = last.unwrap_or_default();
            let words = [by, ordered].map(|text| said(&text));
            let end = [given, status.to_owned(), at, said(&reason)];
            [vec![order.0.clone(), order.1.to_string()], words.to_vec(), end.to_vec()].concat()
        };
        let orders = ["slot", "version", "by", "ordered", "given_utc", "status", "status_utc", "reason"];
        let rows = vehicle.orders_of_people().map(order).collect();
        archive.add_table(&format!("{folder}/orders.csv"), &orders, rows)?;
        let mut images = Vec::new();
        for (at_s, image) in &vehicle.exemplars {
            let name = format!("images/label-{}-{}.{}", image.label, image.image, image.format);
            archive.add(&format!("{folder}/{name}"), &image.data)?;
            let taken = words::taken(image).unwrap_or_default();
            let known =
                |value: f64, digits: usize| if value.is_finite() { format!("{value:.digits$}") } else { String::new() };
            let title = state.label_book.title(state.label_book.shown_as(image.label));
            let place = [known(image.middle.x, 1), known(image.middle.y, 1), known(image.width_m, 3)];
            images.push(
                [vec![name, image.label.to_string(), said(&title), taken, utc_text(*at_s)], place.to_vec()].concat(),
            );
        }
        let header = ["file", "label", "class", "taken_utc", "received_utc", "east_m", "north_m", "width_m"];
        archive.add_table(&format!("{folder}/images.csv"), &header, images)?;
        let mut views = Vec::new();
        for view in &vehicle.floor {
            let (east, north) = (format!("{:.1}", view.middle.x), format!("{:.1}", view.middle.y));
            let name = format!("floor/{east}_{north}.{}", view.format);
            archive.add(&format!("{folder}/{name}"), &view.data)?;
            let taken = words::taken(view).unwrap_or_default();
            views.push(vec![name, taken, east, north, format!("{:.3}", view.width_m)]);
        }
        let header = ["file", "taken_utc", "east_on_map_m", "north_on_map_m", "width_m"];
        archive.add_table(&format!("{folder}/floor.csv"), &header, views)?;
        let (east_m, north_m) = state.map.shift_m();
        let picture = |view: &Exemplar| FloorPicture {
            corner_m: (view.middle.x - view.width_m / 2.0 + east_m, view.middle.y + view.width_m / 2.0 + north_m),
            edge_m: view.width_m,
            webp: view.data.clone(),
        };
        let pictures: Vec<FloorPicture> = vehicle.floor.iter().map(picture).collect();
        let floor = floor_tiff(&pictures, &cells, self.state.mission.origin).map_err(UserError::failed)?;
        floor.map_or(Ok(()), |bytes| archive.add(&format!("{folder}/floor.tif"), &bytes))
    }
}
