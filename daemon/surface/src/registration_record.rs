//! How a vehicle's camera frames were placed on the map, as its reports say.

use crate::track::Track;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{FrameTie, RegistrationReport, VehicleStatus};

/// The last report, and the places at which frames closed a loop.
#[derive(Debug, Clone, Default)]
pub struct RegistrationRecord {
    latest: Option<(RegistrationReport, Instant)>,
    closures: Track,
}

impl RegistrationRecord {
    /// A record that was interrupted.
    pub(crate) fn restored(latest: Option<(RegistrationReport, Instant)>, closures: Track) -> Self {
        Self { latest, closures }
    }

    /// The last report and its time; `None` if the vehicle never sent one.
    pub fn latest(&self) -> Option<(RegistrationReport, Instant)> {
        self.latest
    }

    /// Reported positions of frames that overlapped with an earlier track.
    pub fn closures(&self) -> &Track {
        &self.closures
    }

    /// Takes the report of a status whose pose came in at `now`; a pose that is not newer changes nothing.
    pub(crate) fn handle_status(&mut self, status: &VehicleStatus, now: Instant) {
        let Some(report) = status.registration else { return };
        if self.latest.is_some_and(|(_, at)| now <= at) {
            return;
        }
        self.latest = Some((report, now));
        if report.tie == FrameTie::EarlierTrack {
            self.closures.push(now, status.position.x_m, status.position.y_m);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::coordinates::MapPoint;

    #[test]
    fn a_loop_is_marked_once_where_it_was_closed() {
        let mut record = RegistrationRecord::default();
        let status = |tie, x_m| VehicleStatus {
            position: MapPoint::new(x_m, 2.0),
            registration: Some(RegistrationReport { tie, ..RegistrationReport::default() }),
            ..VehicleStatus::default()
        };
        let at = Instant::from_secs_f64;
        record.handle_status(&status(FrameTie::FrameBefore, 1.0), at(1.0));
        record.handle_status(&status(FrameTie::EarlierTrack, 2.0), at(2.0));
        record.handle_status(&status(FrameTie::EarlierTrack, 2.0), at(2.0));
        record.handle_status(&VehicleStatus::default(), at(3.0));
        assert_eq!(record.closures().iter().collect::<Vec<_>>(), [(at(2.0), 2.0, 2.0)]);
        assert_eq!(record.latest().map(|(report, at)| (report.tie, at)), Some((FrameTie::EarlierTrack, at(2.0))));
        (0..600).for_each(|i| record.handle_status(&status(FrameTie::EarlierTrack, 0.0), at(10.0 + f64::from(i))));
        assert_eq!((record.closures().iter().len(), record.closures().total()), (Track::MAX_POINTS, 601));
    }
}
