//! The images of the sea floor that the operator had at a moment of a record.

use super::Replay;
use scenecast_messages::scenecast_msgs::Exemplar;
use scenecast_surface::FloorPlace;
use scenecast_surface::state::{FloorImage, FloorList};

impl Replay {
    /// Those that had arrived, in the order of arrival.
    fn floor_so_far(&self, part: &str) -> &[(u64, Exemplar)] {
        let all = self.recording.operator.get(part).map_or(&[][..], |known| &known.floor);
        &all[..all.partition_point(|(at, _)| *at <= self.at)]
    }

    /// The latest image with this middle.
    pub(super) fn floor_image(&self, part: &str, place: FloorPlace) -> Option<&Exemplar> {
        let mut latest = self.floor_so_far(part).iter().rev().map(|(_, view)| view);
        latest.find(|view| place_of(view) == place)
    }

    /// The images after the first `since` of a vehicle.
    pub(super) fn floor(&self, id: u8, part: &str, since: u64) -> FloorList {
        let held = self.floor_so_far(part);
        let mission_s = |nanos: i64| self.recording.timeline.mission_s(nanos.max(0) as u64);
        let image = |view: &Exemplar| {
            let ((east_dm, north_dm), received) = (place_of(view), view.header.stamp.nanos());
            FloorImage {
                url: format!("/api/v2/vehicles/{id}/floor/{east_dm}_{north_dm}.webp?received={received}"),
                x_m: view.middle.x,
                y_m: view.middle.y,
                width_m: view.width_m,
                at_s: mission_s(received),
                taken_s: (view.taken.nanos() != 0).then(|| mission_s(view.taken.nanos())),
            }
        };
        let images = held.iter().skip(since as usize).map(|(_, view)| image(view)).collect();
        FloorList { version: held.len() as u64, images }
    }
}

fn place_of(view: &Exemplar) -> FloorPlace {
    let dm = |m: f64| (m * 10.0).round() as i32;
    (dm(view.middle.x), dm(view.middle.y))
}
