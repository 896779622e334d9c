//! The link of a mission as it was: which frames arrived, and when.

use super::{FrameTimes, MissionClock, SentFrame, StateTime, mission_records, read_record};
use scenecast_core::UserError;
use scenecast_messages::scenecast_msgs::Frame;
use scenecast_messages::std_msgs::Text;
use std::path::Path;

/// The frames of both directions of a link, in the order of their times.
#[derive(Debug, Default, Clone, PartialEq)]
pub struct RecordedLink {
    /// From the vehicle to the surface.
    pub up: Vec<FrameFate>,
    /// From the surface to the vehicle.
    pub down: Vec<FrameFate>,
}

/// What became of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameFate {
    /// The mission time at which it had been received, or would have been, seconds.
    pub arrives_s: f64,
    pub delivered: bool,
}

impl RecordedLink {
    /// Reads it from the records of both ends, which lie in this folder.
    ///
    /// # Errors
    /// One of the records is missing, or they have no frame in common.
    pub fn read(folder: &Path) -> Result<Self, UserError> {
        let (mut surfaces, mut vehicles, mut clock) = (Vec::new(), Vec::new(), MissionClock::default());
        for record in mission_records(folder)? {
            let (mut frames, mut is_surface) = (FrameTimes::default(), false);
            let _damaged = read_record(&record, |message| {
                let nanos = message.nanos();
                match message.topic() {
                    "/scenecast/frames" => message.decode::<Frame>().iter().for_each(|frame| frames.take(nanos, frame)),
                    "/scenecast/state" => {
                        let time = message.decode::<Text>().and_then(|text| StateTime::of_json(&text.data));
                        is_surface |= time.is_some();
                        time.into_iter().for_each(|time| clock.take(nanos, time));
                    }
                    _ => {}
                }
            })?;
            if is_surface { &mut surfaces } else { &mut vehicles }.push(frames);
        }
        let [surface, vehicle] = [&surfaces, &vehicles].map(|frames| FrameTimes::joined(frames.iter()));
        let shift = vehicle.shift_to(&surface);
        // By the clock of the surface, which tells the mission time.
        let to_surface = |frame: SentFrame| SentFrame { arrives: frame.arrives.saturating_add_signed(shift), ..frame };
        let up = vehicle.fates(&surface, shift).into_iter().map(to_surface).collect::<Vec<_>>();
        let down = surface.fates(&vehicle, -shift);
        let link = Self { up: fates(&up, &clock), down: fates(&down, &clock) };
        let is_known = |fates: &[FrameFate]| fates.iter().any(|fate| fate.delivered);
        if !is_known(&link.up) && !is_known(&link.down) {
            let what = "it has no records of both ends with a frame in common: both folders of a mission are needed, with the \
                        bytes of their frames";
            return Err(UserError::file(folder, what));
        }
        Ok(link)
    }
}

/// The frames in the order of their arrival.
fn fates(frames: &[SentFrame], clock: &MissionClock) -> Vec<FrameFate> {
    let fate = |frame: &SentFrame| {
        Some(FrameFate { arrives_s: clock.mission_s(frame.arrives)?, delivered: frame.received.is_some() })
    };
    let mut fates: Vec<FrameFate> = frames.iter().filter_map(fate).collect();
    fates.sort_by(|a, b| a.arrives_s.total_cmp(&b.arrives_s));
    fates
}
