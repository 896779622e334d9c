//! Reports of a Doppler velocity log of Water Linked, A50 or A125.
//!
//! The log sends objects of JSON, one a line, over TCP port 16171 (format `json_v3.1`). Used are
//!
//! | `type` | fields |
//! |---|---|
//! | `position_local` | `ts` seconds, `x` `y` `z` metres, `roll` `pitch` `yaw` degrees, `status` 0 if there is no fault |
//! | `velocity` | `altitude` metres, `velocity_valid` |
//!
//! Positions are dead reckoning since the last reset: x ahead, y to starboard, z down at that moment, yaw clockwise from that
//! heading. Answers and unknown types are passed over. Source: <https://waterlinked.github.io/dvl/dvl-protocol/>.

use crate::{CameraFault, SensorPose, Stamp};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::time::Duration;

/// Length of the longest line, bytes.
pub const MAX_DVL_LINE: usize = 8192;

/// A report that is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DvlReport {
    /// Height above the sea floor, metres; `None` without bottom lock.
    Altitude(Option<f64>),
    Position(DvlPosition),
    /// The log reports a fault of its dead reckoning.
    PositionFault,
}

/// Dead reckoning since the last reset of the log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DvlPosition {
    /// Seconds by the clock of the log.
    pub ts_s: f64,
    /// Ahead, to starboard and down at the reset, metres.
    pub place: [f64; 3],
    /// Rotation about the axis ahead, in radians.
    pub roll_rad: f64,
    /// Rotation about the axis to starboard, in radians.
    pub pitch_rad: f64,
    /// Clockwise from the heading at the reset, radians.
    pub yaw_rad: f64,
}

/// A field of an object; `None` if it is missing or null.
fn field<T: DeserializeOwned>(object: &Value, name: &'static str) -> Result<Option<T>, DvlError> {
    let value = object.get(name).unwrap_or(&Value::Null);
    Option::<T>::deserialize(value).map_err(|_| DvlError::Type(name))
}

/// A line that is not a report.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DvlError {
    #[error("a line is not an object of JSON")]
    NotJson,
    #[error("{0} is missing or too large")]
    Number(&'static str),
    #[error("{0} is not of the type that the maker documents")]
    Type(&'static str),
}

/// Largest position, metres, and largest time, seconds.
const MAX_M: f64 = 1e6;
const MAX_S: f64 = 1e10;

fn number(object: &Value, name: &'static str, most: f64) -> Result<f64, DvlError> {
    field::<f64>(object, name)?.filter(|value| value.abs() <= most).ok_or(DvlError::Number(name))
}

impl DvlReport {
    /// Parses a line, which may have several objects where an end of line was lost. Objects of other types are passed over.
    ///
    /// # Errors
    /// A part of the line is not JSON, or a number is missing or absurd.
    pub fn all_of(line: &[u8]) -> Vec<Result<Self, DvlError>> {
        let objects = serde_json::Deserializer::from_slice(line).into_iter::<Value>();
        objects.filter_map(|object| Self::of_object(object.map_err(|_| DvlError::NotJson)).transpose()).collect()
    }

    fn of_object(object: Result<Value, DvlError>) -> Result<Option<Self>, DvlError> {
        let object = object?;
        match (object.is_object(), &object["type"]) {
            (true, Value::String(kind)) if kind == "velocity" => Self::of_velocity(&object).map(Some),
            (true, Value::String(kind)) if kind == "position_local" => Self::of_position(&object).map(Some),
            (true, Value::String(_) | Value::Null) => Ok(None),
            _ => Err(DvlError::NotJson),
        }
    }

    fn of_velocity(object: &Value) -> Result<Self, DvlError> {
        let altitude = field::<f64>(object, "altitude")?.filter(|m| *m > 0.0 && *m <= MAX_M);
        let is_valid = field(object, "velocity_valid")? == Some(true);
        Ok(Self::Altitude(altitude.filter(|_| is_valid)))
    }

    fn of_position(object: &Value) -> Result<Self, DvlError> {
        if field::<u32>(object, "status")?.unwrap_or(0) != 0 {
            return Ok(Self::PositionFault);
        }
        let length = |name| number(object, name, MAX_M);
        let angle = |name| number(object, name, 720.0).map(f64::to_radians);
        Ok(Self::Position(DvlPosition {
            ts_s: number(object, "ts", MAX_S)?,
            place: [length("x")?, length("y")?, length("z")?],
            roll_rad: angle("roll")?,
            pitch_rad: angle("pitch")?,
            yaw_rad: angle("yaw")?,
        }))
    }
}

/// Speed that no vehicle with a log has, metres a second.
const ABSURD_M_S: f64 = 8.0;

/// A step that is never a reset, metres.
const STEP_M: f64 = 1.0;

/// Drift of the log's clock that is followed.
const CLOCK_DRIFT: f64 = 2e-4;

/// A delay by which the log's clock must have been set back instead.
const MAX_DELAY_S: f64 = 30.0;

/// A log that sends velocities and no position for so many seconds is named.
const POSITION_AWAITED_S: f64 = 2.0;

/// A height counts for this long.
const ALTITUDE_LASTS_S: f64 = 2.0;

/// Turns the reports of a log into poses of the vehicle on the map.
///
/// When the log begins anew, by a restart or by an order to reset, the track continues at the last pose. Its clock need not be
/// set: the smallest difference between arrivals and its times is the difference of the clocks.
#[derive(Debug)]
pub struct DvlTrack {
    /// Where the log began: metres east and north, depth, and its heading there.
    origin: SensorPose,
    /// The last position of the log and its pose.
    last: Option<(DvlPosition, SensorPose, Stamp)>,
    /// Seconds from the clock of the log to that of arrivals, and the arrival at which it was taken.
    offset: Option<(f64, Stamp)>,
    altitude: Option<(f64, Stamp)>,
    has_bottom_lock: bool,
    /// Since when a position is awaited.
    awaited: Option<Stamp>,
}

impl DvlTrack {
    /// `heading_rad` is the heading at the reset of the log, clockwise from north.
    pub fn new(heading_rad: f64) -> Self {
        let origin = SensorPose { heading_rad, ..SensorPose::default() };
        Self { origin, last: None, offset: None, altitude: None, has_bottom_lock: true, awaited: None }
    }

    /// Takes a report that came in at `arrival`. Passes what people should read to `fault`.
    pub fn handle(
        &mut self,
        report: DvlReport,
        arrival: Stamp,
        fault: &mut dyn FnMut(CameraFault, String),
    ) -> Option<(Stamp, SensorPose)> {
        match report {
            DvlReport::Altitude(altitude) => {
                let had_lock = std::mem::replace(&mut self.has_bottom_lock, altitude.is_some());
                if had_lock && altitude.is_none() {
                    fault(CameraFault::NoBottomLock, "its dead reckoning drifts until it is back".to_owned());
                }
                self.altitude = altitude.map(|m| (m, arrival));
                let since = *self.awaited.get_or_insert(arrival);
                if arrival.seconds_since(since) >= POSITION_AWAITED_S {
                    self.awaited = Some(arrival);
                    let text = "it sends velocities but no position_local: switch on its dead reckoning";
                    fault(CameraFault::PosesStalled, text.to_owned());
                }
                None
            }
            DvlReport::PositionFault => {
                self.awaited = Some(arrival);
                fault(CameraFault::PoseRefused, "the log reports a fault of its dead reckoning".to_owned());
                None
            }
            DvlReport::Position(position) => {
                self.awaited = Some(arrival);
                Some(self.handle_position(position, arrival, fault))
            }
        }
    }

    fn handle_position(
        &mut self,
        position: DvlPosition,
        arrival: Stamp,
        fault: &mut dyn FnMut(CameraFault, String),
    ) -> (Stamp, SensorPose) {
        if let Some((before, pose, at)) = self.last {
            let moved = position.place.iter().zip(before.place).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            let is_clock_back = position.ts_s < before.ts_s;
            let passed_s = arrival.seconds_since(at).max(position.ts_s - before.ts_s).max(0.0);
            if is_clock_back {
                self.offset = None;
            }
            if moved > ABSURD_M_S * passed_s + STEP_M {
                self.continue_at(pose, position);
                let text = format!("it jumped by {moved:.1} m; the track continues at the last pose");
                fault(CameraFault::DeadReckoningReset, text);
            }
        }
        let pose = self.pose_of(position, arrival);
        let stamp = self.stamp_of(position.ts_s, arrival);
        self.last = Some((position, pose, arrival));
        (stamp, pose)
    }

    /// Puts the origin where `position` is at `pose`.
    fn continue_at(&mut self, pose: SensorPose, position: DvlPosition) {
        let heading_rad = pose.heading_rad - position.yaw_rad;
        self.origin = SensorPose { heading_rad, ..SensorPose::default() };
        let off = self.pose_of(position, Stamp::default());
        self.origin.x_m = pose.x_m - off.x_m;
        self.origin.y_m = pose.y_m - off.y_m;
        self.origin.depth_m = pose.depth_m - off.depth_m;
    }

    fn pose_of(&self, position: DvlPosition, arrival: Stamp) -> SensorPose {
        let [ahead, starboard, down] = position.place;
        let (sin, cos) = self.origin.heading_rad.sin_cos();
        SensorPose {
            x_m: self.origin.x_m + ahead * sin + starboard * cos,
            y_m: self.origin.y_m + ahead * cos - starboard * sin,
            depth_m: self.origin.depth_m + down,
            heading_rad: self.origin.heading_rad + position.yaw_rad,
            roll_rad: position.roll_rad,
            pitch_rad: position.pitch_rad,
            altitude_m: self.altitude.filter(|(_, at)| arrival.seconds_since(*at) < ALTITUDE_LASTS_S).map(|(m, _)| m),
        }
    }

    /// The time of a position by the clock of arrivals, never later than its arrival.
    fn stamp_of(&mut self, ts_s: f64, arrival: Stamp) -> Stamp {
        let by_clock = Stamp::from_nanos((ts_s * 1e9) as i64);
        let now_s = arrival.seconds_since(by_clock);
        let expected = self.offset.map(|(offset_s, at)| offset_s + CLOCK_DRIFT * arrival.seconds_since(at).max(0.0));
        let offset_s = match expected {
            Some(expected) if now_s - expected < MAX_DELAY_S => now_s.min(expected),
            _ => now_s,
        };
        self.offset = Some((offset_s, arrival));
        arrival.before(Duration::from_secs_f64((now_s - offset_s).clamp(0.0, MAX_DELAY_S)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Lines in the form of the maker's documentation.
    const POSITION: &str = r#"{"ts": 49056.809, "x": 12.43, "y": 64.61, "z": 1.76, "std": 0.0018, "roll": 0.6, "pitch": -0.9, "yaw": 13.6, "type": "position_local", "status": 0, "format": "json_v3.1"}"#;
    const VELOCITY: &str = r#"{"time":106.39,"vx":-3.7e-05,"vy":-5.5e-05,"vz":2.2e-05,"fom":0.00016,"covariance":[[1e-8,0,0],[0,1e-8,0],[0,0,1e-8]],"altitude":0.495,"transducers":[{"id":0,"velocity":0.00029,"distance":0.5676,"rssi":-30.5,"nsd":-88.7,"beam_valid":true}],"velocity_valid":true,"status":0,"format":"json_v3.1","type":"velocity","time_of_validity":1638191471563017,"time_of_transmission":1638191471752336}"#;

    fn at(s: f64) -> Stamp {
        Stamp::from_nanos((s * 1e9) as i64)
    }

    fn position(ts_s: f64, x: f64, y: f64, yaw_deg: f64) -> DvlReport {
        let yaw_rad = yaw_deg.to_radians();
        DvlReport::Position(DvlPosition { ts_s, place: [x, y, 2.0], roll_rad: 0.0, pitch_rad: 0.0, yaw_rad })
    }

    /// Milliseconds, millimetres east and north, and degrees.
    type Milli = (i64, i64, i64, i64);

    /// Poses in whole numbers, and the faults.
    fn track(reports: &[(f64, DvlReport)], heading_deg: f64) -> (Vec<Milli>, Vec<CameraFault>) {
        let (mut track, mut faults) = (DvlTrack::new(heading_deg.to_radians()), Vec::new());
        let poses = reports.iter().filter_map(|(s, report)| {
            let (stamp, pose) = track.handle(*report, at(*s), &mut |fault, _| faults.push(fault))?;
            let milli = |v: f64| (v * 1000.0).round() as i64;
            let heading = pose.heading_rad.to_degrees().round() as i64;
            Some((milli(stamp.seconds_since(at(0.0))), milli(pose.x_m), milli(pose.y_m), heading))
        });
        (poses.collect(), faults)
    }

    /// The first report of a line.
    fn parse(line: &[u8]) -> Result<Option<DvlReport>, DvlError> {
        DvlReport::all_of(line).into_iter().next().transpose()
    }

    #[test]
    fn joined_objects_are_read_and_other_types_passed_over() {
        let other = r#"{"type":"temperature","x":"warm","altitude":[1]}"#;
        let line = [VELOCITY, other, POSITION, VELOCITY].concat();
        let found = DvlReport::all_of(line.as_bytes());
        assert!(found.len() == 3 && found.iter().all(Result::is_ok), "{found:?}");
        assert_eq!(DvlReport::all_of(other.as_bytes()), []);
        assert_eq!(
            DvlReport::all_of(&line.as_bytes()[..line.len() - 5]).last(),
            Some(&Err(DvlError::NotJson)),
            "half an object"
        );
        assert_eq!(DvlReport::all_of(b"12"), [Err(DvlError::NotJson)]);
    }

    #[test]
    fn the_lines_of_the_maker_are_read() {
        let Ok(Some(DvlReport::Position(read))) = parse(POSITION.as_bytes()) else { panic!() };
        assert_eq!((read.ts_s, read.place), (49056.809, [12.43, 64.61, 1.76]));
        assert_eq!([read.roll_rad, read.pitch_rad, read.yaw_rad], [0.6f64, -0.9, 13.6].map(f64::to_radians));
        assert_eq!(parse(VELOCITY.as_bytes()), Ok(Some(DvlReport::Altitude(Some(0.495)))));
        let invalid = VELOCITY.replace("true,\"status\"", "false,\"status\"");
        assert_eq!(parse(invalid.as_bytes()), Ok(Some(DvlReport::Altitude(None))));
        let faulty = POSITION.replace("\"status\": 0", "\"status\": 1");
        assert_eq!(parse(faulty.as_bytes()), Ok(Some(DvlReport::PositionFault)));
        assert_eq!(parse(br#"{"response_to":"reset","success":true,"type":"response"}"#), Ok(None));
        assert_eq!(parse(b"wrx,112.83,0.007"), Err(DvlError::NotJson));
        let absurd = POSITION.replace("64.61", "1e300");
        assert_eq!(parse(absurd.as_bytes()), Err(DvlError::Number("y")));
    }

    #[test]
    fn ahead_at_the_reset_is_the_configured_heading() {
        let (poses, faults) =
            track(&[(100.0, position(5.0, 0.0, 0.0, 0.0)), (101.0, position(6.0, 1.0, 0.5, 10.0))], 90.0);
        // One metre ahead is one to the east; half a metre to starboard is half a one to the south.
        assert_eq!((poses[1], faults.len()), ((101_000, 1000, -500, 100), 0));
    }

    #[test]
    fn a_log_that_restarts_continues_at_the_last_pose() {
        let reports = [
            (100.0, position(500.0, 20.0, 0.0, 90.0)),
            (100.2, position(500.2, 20.0, 0.2, 90.0)),
            // A reset: its bow is now the new x axis.
            (100.4, position(500.4, 0.0, 0.0, 0.0)),
            (100.6, position(500.6, 0.2, 0.0, 0.0)),
            // A restart of the log: its clock begins anew as well.
            (104.0, position(0.4, 0.2, 0.0, 0.0)),
        ];
        let (poses, faults) = track(&reports, 0.0);
        let places: Vec<_> = poses.iter().map(|(_, x, y, heading)| (*x, *y, *heading)).collect();
        assert_eq!(
            places,
            [(0, 20_000, 90), (200, 20_000, 90), (200, 20_000, 90), (400, 20_000, 90), (400, 20_000, 90)]
        );
        assert_eq!(faults, [CameraFault::DeadReckoningReset]);
        assert_eq!(poses[4].0, 104_000);
    }

    #[test]
    fn delayed_reports_keep_their_own_time() {
        let mut reports: Vec<(f64, DvlReport)> =
            (0..10).map(|i| (100.0 + f64::from(i) * 0.2, position(7.0 + f64::from(i) * 0.2, 0.0, 0.0, 0.0))).collect();
        // A network that holds the last five back for a second.
        reports.iter_mut().skip(5).for_each(|(s, _)| *s = 102.8);
        let (poses, _) = track(&reports, 0.0);
        let stamps: Vec<i64> = poses.iter().map(|pose| pose.0).collect();
        let expected: Vec<i64> = (0..10).map(|i| 100_000 + i * 200).collect();
        assert!(stamps.iter().zip(&expected).all(|(a, b)| (a - b).abs() <= 1), "{stamps:?}");
    }

    #[test]
    fn bottom_lock_gives_the_altitude_and_its_loss_is_counted_once() {
        let (mut track, mut faults) = (DvlTrack::new(0.0), Vec::new());
        let mut handle = |s: f64, report| track.handle(report, at(s), &mut |fault, _| faults.push(fault));
        handle(0.0, DvlReport::Altitude(Some(3.5)));
        assert_eq!(handle(0.1, position(0.1, 0.0, 0.0, 0.0)).unwrap().1.altitude_m, Some(3.5));
        assert_eq!(handle(3.0, position(3.0, 0.0, 0.0, 0.0)).unwrap().1.altitude_m, None);
        handle(3.1, DvlReport::Altitude(None));
        handle(3.2, DvlReport::Altitude(None));
        handle(3.3, DvlReport::PositionFault);
        assert_eq!(faults, [CameraFault::NoBottomLock, CameraFault::PoseRefused]);
    }

    #[test]
    fn velocities_without_a_position_are_named() {
        let (mut track, mut texts) = (DvlTrack::new(0.0), Vec::new());
        for tenths in 0..100 {
            let now = at(f64::from(tenths) / 10.0);
            if tenths < 30 {
                track.handle(position(f64::from(tenths), 0.0, 0.0, 0.0), now, &mut |_, text| texts.push(text));
            }
            track.handle(DvlReport::Altitude(Some(2.0)), now, &mut |_, text| texts.push(text));
        }
        assert!(texts.len() == 3 && texts[0].contains("no position_local"), "{texts:?}");
    }

    #[test]
    fn a_field_of_another_type_is_named() {
        let valid = VELOCITY.replace("true,\"status\"", "1,\"status\"");
        assert_eq!(parse(valid.as_bytes()), Err(DvlError::Type("velocity_valid")));
        let status = POSITION.replace("\"status\": 0", "\"status\": -1");
        assert_eq!(parse(status.as_bytes()), Err(DvlError::Type("status")));
    }

    proptest! {
        #[test]
        fn any_line_is_read_or_refused(line in proptest::collection::vec(any::<u8>(), 0..300)) {
            let _ = parse(&line);
        }

        #[test]
        fn any_numbers_give_finite_poses(
            reports in proptest::collection::vec((0.0..1e9f64, any::<f64>(), any::<f64>(), any::<f64>(), any::<f64>()), 0..30),
        ) {
            let mut track = DvlTrack::new(1.0);
            for (arrival_s, ts, x, y, yaw) in reports {
                let line = format!(
                    r#"{{"type":"position_local","ts":{ts:?},"x":{x:?},"y":{y:?},"z":1,"roll":0,"pitch":0,"yaw":{yaw:?}}}"#
                );
                let Ok(Some(report)) = parse(line.as_bytes()) else { continue };
                let (_, pose) = track.handle(report, at(arrival_s), &mut |_, _| {}).unwrap();
                prop_assert!(pose.is_finite());
            }
        }
    }
}
