//! The images of the sea floor that the operator had at a moment of a record.

use super::Replay;
use scenecast_messages::scenecast_msgs::Exemplar;
use scenecast_surface::FloorPlace;
use scenecast_surface::state::{FloorImage, FloorList, FloorSummary};
use std::collections::BTreeMap;

impl Replay {
    /// The images that had arrived on the map of that moment, the latest of each place, with the numbers of their arrival.
    fn floor_held(&self, part: &str) -> BTreeMap<FloorPlace, (u64, &Exemplar)> {
        let begin = self.recording.timeline.span.0;
        // Microseconds are whole numbers for every reader.
        let numbered = |(place, (at, view)): (_, (u64, _))| (place, (1 + at.saturating_sub(begin) / 1000, view));
        let known = self.recording.operator.get(part).into_iter();
        known.flat_map(|known| known.floor_until(self.at)).map(numbered).collect()
    }

    /// The latest image with this middle.
    pub(super) fn floor_image(&self, part: &str, place: FloorPlace) -> Option<&Exemplar> {
        self.floor_held(part).get(&place).map(|(_, view)| *view)
    }

    /// How many there are.
    pub(super) fn floor_summary(&self, part: &str) -> FloorSummary {
        let held = self.floor_held(part);
        FloorSummary {
            images: held.len(),
            bytes: held.values().map(|(_, view)| view.data.len()).sum(),
            version: held.values().map(|(number, _)| *number).max().unwrap_or_default(),
            epoch: held.values().next().map_or(0, |(_, view)| view.epoch as u8),
        }
    }

    /// The images of a vehicle with a number above `since`.
    pub(super) fn floor(&self, id: u8, part: &str, since: u64) -> FloorList {
        let mission_s = |nanos: i64| self.recording.timeline.mission_s(nanos.max(0) as u64);
        let image = |(place, number, view): (FloorPlace, u64, &Exemplar)| FloorImage {
            url: FloorImage::url(id, place, number),
            x_m: view.middle.x,
            y_m: view.middle.y,
            width_m: view.width_m,
            at_s: mission_s(view.header.stamp.nanos()),
            taken_s: (view.taken.nanos() != 0).then(|| mission_s(view.taken.nanos())),
        };
        let held = self.floor_held(part).into_iter().map(|(place, (number, view))| (place, number, view));
        let mut news: Vec<_> = held.filter(|(_, number, _)| *number > since).collect();
        news.sort_by_key(|(_, number, _)| *number);
        let version = news.last().map_or(since, |(_, number, _)| *number);
        FloorList { version, images: news.into_iter().map(image).collect() }
    }
}
