//! The MAVLink messages that the driver uses, in the units of MAVLink.
//!
//! These are seventeen of about three hundred messages. A generated dialect would contain all of them: 1.6 MB of source
//! and a quarter more time for a clean build. It would also reject messages whose enumerations are newer than the
//! dialect. The layouts are from `common.xml` of MAVLink; the tests compare them with bytes that pymavlink wrote.

/// The message number of HEARTBEAT, by which the driver recognises its autopilot.
pub const HEARTBEAT: u32 = 0;

/// A message that is read.
#[derive(Debug, Clone, PartialEq)]
pub enum Heard {
    Heartbeat {
        /// Mode, in the numbers of the autopilot.
        custom_mode: u32,
        /// MAV_TYPE: 10 rover, 11 boat, 12 submarine.
        kind: u8,
        /// MAV_AUTOPILOT: 3 is ArduPilot, 8 none, as of a ground station.
        autopilot: u8,
        base_mode: u8,
    },
    /// ATTITUDE, radians: starboard down, bow up, clockwise from north.
    Attitude { roll: f32, pitch: f32, yaw: f32 },
    /// LOCAL_POSITION_NED: metres and metres a second; north, east, down.
    Local {
        /// Milliseconds since the autopilot started.
        time_boot_ms: u32,
        /// From the autopilot's own origin.
        place: [f32; 3],
        velocity: [f32; 3],
    },
    Global {
        /// Milliseconds since the autopilot started.
        time_boot_ms: u32,
        lat: i32,
        lon: i32,
        relative_alt: i32,
        /// North, east, down in centimetres a second.
        velocity: [i16; 3],
        /// Hundredths of a degree; 65535 = not known.
        heading: u16,
    },
    /// NAV_CONTROLLER_OUTPUT: metres to the autopilot's own waypoint.
    WaypointDistance(u16),
    /// POSITION_TARGET_LOCAL_NED: north and east in its own frame, metres; `None` if its target is no position.
    LocalTarget(Option<[f32; 2]>),
    /// POSITION_TARGET_GLOBAL_INT: degrees times ten million; `None` if its target is no position.
    GlobalTarget(Option<(i32, i32)>),
    /// DISTANCE_SENSOR of this number that looks down: metres along its beam; `None` if that is out of its range.
    DistanceDown(u8, Option<f32>),
    /// DISTANCE_SENSOR of a sensor that does not look down.
    DistanceElsewhere,
    /// RANGEFINDER: metres along the beam of a sensor that looks down.
    Rangefinder(f32),
    /// ALTITUDE: metres above the sea floor; `None` if they are not known.
    Altitude(Option<f32>),
    Ack {
        command: u16,
        /// MAV_RESULT: 0 accepted, 5 in progress; the rest is a refusal.
        result: u8,
    },
    Text {
        /// MAV_SEVERITY: 0 emergency to 7 debug.
        severity: u8,
        text: String,
        /// The number of a text in several messages and the place of this one; 0: it is alone.
        part: (u16, u8),
        /// Whether it ends in this message.
        is_end: bool,
    },
}

/// A message that is written.
#[derive(Debug, Clone, PartialEq)]
pub enum Said {
    /// HEARTBEAT of an onboard controller.
    Heartbeat,
    Command {
        command: u16,
        /// Its parameters; the last four are 0.
        params: [f32; 3],
    },
    /// SET_POSITION_TARGET_LOCAL_NED in the autopilot's own frame: north, east, down, metres.
    Local([f32; 3]),
    /// SET_POSITION_TARGET_GLOBAL_INT: degrees times ten million, metres above home.
    Global(i32, i32, f32),
    Gps {
        lat: i32,
        lon: i32,
        sigma_m: f32,
    },
}

/// The byte that stands for the layout of a message that is read.
pub fn heard_extra(id: u32) -> Option<u8> {
    Some(match id {
        HEARTBEAT => 50,
        30 => 39,
        32 => 185,
        33 => 104,
        62 => 183,
        77 => 143,
        85 => 140,
        87 => 150,
        132 => 85,
        141 => 47,
        173 => 83,
        253 => 83,
        _ => return None,
    })
}

/// The time since the autopilot's start in a message that has one, milliseconds. 0 is what programs write that do not know it.
pub fn boot_time_ms(id: u32, payload: &[u8]) -> Option<u32> {
    matches!(id, 30 | 32 | 33 | 85 | 87 | 132).then(|| Fields(payload).u32()).filter(|ms| *ms > 0)
}

/// Fields of a payload, in order; fields missing at its end are zero.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (mine, rest) = self.0.split_at(self.0.len().min(N));
        self.0 = rest;
        let mut out = [0; N];
        out.iter_mut().zip(mine).for_each(|(o, b)| *o = *b);
        out
    }

    fn u8(&mut self) -> u8 {
        u8::from_le_bytes(self.take())
    }

    fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.take())
    }

    fn i16(&mut self) -> i16 {
        i16::from_le_bytes(self.take())
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn i32(&mut self) -> i32 {
        i32::from_le_bytes(self.take())
    }

    fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.take())
    }
}

impl Heard {
    /// Parses a message; `None` if it is not used here, or has numbers that are not finite.
    pub fn read(id: u32, payload: &[u8]) -> Option<Self> {
        let mut f = Fields(payload);
        let read = match id {
            HEARTBEAT => Self::Heartbeat { custom_mode: f.u32(), kind: f.u8(), autopilot: f.u8(), base_mode: f.u8() },
            30 => {
                f.u32();
                Self::Attitude { roll: f.f32(), pitch: f.f32(), yaw: f.f32() }
            }
            32 => Self::Local {
                time_boot_ms: f.u32(),
                place: [f.f32(), f.f32(), f.f32()],
                velocity: [f.f32(), f.f32(), f.f32()],
            },
            33 => {
                let (time_boot_ms, lat, lon) = (f.u32(), f.i32(), f.i32());
                f.i32();
                let relative_alt = f.i32();
                Self::Global {
                    time_boot_ms,
                    lat,
                    lon,
                    relative_alt,
                    velocity: [f.i16(), f.i16(), f.i16()],
                    heading: f.u16(),
                }
            }
            62 => {
                f.take::<24>();
                Self::WaypointDistance(f.u16())
            }
            85 => {
                f.u32();
                let place = [f.f32(), f.f32()];
                f.take::<36>();
                Self::LocalTarget(is_position(f.u16()).then_some(place))
            }
            87 => {
                f.u32();
                let place = (f.i32(), f.i32());
                f.take::<36>();
                Self::GlobalTarget(is_position(f.u16()).then_some(place))
            }
            132 => {
                f.u32();
                let (least, most, now) = (f.u16(), f.u16(), f.u16());
                let [_, number] = f.u16().to_le_bytes();
                match f.u8() {
                    LOOKS_DOWN => {
                        // Covariance, angles of view and attitude.
                        f.take::<25>();
                        let is_valid = f.u8() != INVALID_QUALITY;
                        let is_in_range = is_valid && now > 0 && (least..=most).contains(&now);
                        Self::DistanceDown(number, is_in_range.then_some(f32::from(now) / 100.0))
                    }
                    _ => Self::DistanceElsewhere,
                }
            }
            141 => {
                f.take::<24>();
                let (terrain, clearance) = (f.f32(), f.f32());
                // Unknown clearances are negative, unknown heights above the terrain are -1000 and less.
                Self::Altitude([clearance, terrain].into_iter().find(|m| m.is_finite() && *m > 0.0))
            }
            173 => Self::Rangefinder(f.f32()),
            77 => Self::Ack { command: f.u16(), result: f.u8() },
            253 => {
                let severity = f.u8();
                let text = f.take::<50>();
                let text = text.split(|b| *b == 0).next().unwrap_or_default();
                let is_end = text.len() < 50;
                let text = String::from_utf8_lossy(text).chars().filter(|c| !c.is_control()).collect();
                Self::Text { severity, text, part: (f.u16(), f.u8()), is_end }
            }
            _ => return None,
        };
        let is_sound = match &read {
            Self::Attitude { roll, pitch, yaw, .. } => [roll, pitch, yaw].into_iter().all(|v| v.is_finite()),
            Self::LocalTarget(Some(place)) => place.iter().all(|v| v.is_finite()),
            Self::Rangefinder(distance) => distance.is_finite(),
            Self::Local { place, velocity, .. } => place.iter().chain(velocity).all(|v| v.is_finite()),
            _ => true,
        };
        is_sound.then_some(read)
    }
}

/// `signal_quality` of a measurement that is not valid; 0 is not known.
const INVALID_QUALITY: u8 = 1;

/// MAV_SENSOR_ROTATION_PITCH_270: the sensor looks down.
const LOOKS_DOWN: u8 = 25;

/// Whether a target with this mask of ignored fields has a position.
fn is_position(ignored: u16) -> bool {
    ignored & 0b11 == 0
}

/// Every field of a position target but the position is to be ignored.
const POSITION_ONLY: u16 = 0x0DF8;
const LOCAL_NED: u8 = 1;
const GLOBAL_RELATIVE: u8 = 6;
/// GPS_INPUT fields that are not known: altitude, VDOP, velocities and their accuracy, vertical accuracy.
const GPS_IGNORED: u16 = 1 | 4 | 8 | 16 | 32 | 128;

impl Said {
    /// Number of the message and the byte that stands for its layout.
    pub fn id(&self) -> (u32, u8) {
        match self {
            Self::Heartbeat => (0, 50),
            Self::Command { .. } => (76, 152),
            Self::Local(_) => (84, 143),
            Self::Global(..) => (86, 5),
            Self::Gps { .. } => (232, 151),
        }
    }

    /// The payload, for a system and a component; `time_ms` since this end started.
    pub fn payload(&self, system: u8, component: u8, time_ms: u32) -> Vec<u8> {
        let mut out = Vec::new();
        let floats = |out: &mut Vec<u8>, values: &[f32]| values.iter().for_each(|v| out.extend(v.to_le_bytes()));
        match self {
            Self::Heartbeat => {
                // MAV_TYPE_ONBOARD_CONTROLLER, MAV_AUTOPILOT_INVALID, no mode, MAV_STATE_ACTIVE, version 3.
                out.extend([0, 0, 0, 0, 18, 8, 0, 4, 3]);
            }
            Self::Command { command, params } => {
                floats(&mut out, params);
                floats(&mut out, &[0.0; 4]);
                out.extend(command.to_le_bytes());
                out.extend([system, component, 0]);
            }
            Self::Local(place) => {
                out.extend(time_ms.to_le_bytes());
                floats(&mut out, place);
                floats(&mut out, &[0.0; 8]);
                out.extend(POSITION_ONLY.to_le_bytes());
                out.extend([system, component, LOCAL_NED]);
            }
            Self::Global(lat, lon, alt) => {
                out.extend(time_ms.to_le_bytes());
                out.extend(lat.to_le_bytes());
                out.extend(lon.to_le_bytes());
                floats(&mut out, &[*alt]);
                floats(&mut out, &[0.0; 8]);
                out.extend(POSITION_ONLY.to_le_bytes());
                out.extend([system, component, GLOBAL_RELATIVE]);
            }
            Self::Gps { lat, lon, sigma_m } => {
                // Neither time of the clock nor of GPS: the autopilot takes it as of now.
                out.extend([0; 12]);
                out.extend(lat.to_le_bytes());
                out.extend(lon.to_le_bytes());
                let hdop = (sigma_m / 3.0).clamp(0.5, 50.0);
                floats(&mut out, &[0.0, hdop, 0.0, 0.0, 0.0, 0.0, 0.0, *sigma_m, 0.0]);
                out.extend(GPS_IGNORED.to_le_bytes());
                out.extend([0, 0]);
                // Receiver 0, a fix in three dimensions, as many satellites as a good one has.
                out.extend([0, 3, 12]);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn hex(bytes: &[u8]) -> String {
        bytes.iter().map(|b| format!("{b:02x}")).collect()
    }

    #[test]
    fn payloads_are_those_of_pymavlink() {
        let local = Said::Local([10.0, -5.0, 18.0]).payload(1, 1, 1000);
        let zeros = "00".repeat(32);
        assert_eq!(hex(&local), format!("e8030000000020410000a0c000009041{zeros}f80d010101"));
        let arm = Said::Command { command: 400, params: [1.0, 0.0, 0.0] }.payload(1, 1, 0);
        assert_eq!(hex(&arm), format!("0000803f{}9001010100", "00".repeat(24)));
        assert_eq!(Said::Gps { lat: 1, lon: 2, sigma_m: 1.0 }.payload(1, 1, 0).len(), 63);
        assert_eq!(Said::Global(1, 2, 3.0).payload(1, 1, 0).len(), 53);
    }

    #[test]
    fn cut_payloads_end_in_zeros() {
        let read = Heard::read(0, &[4, 0, 0, 0, 12, 3, 0x81]).unwrap();
        assert_eq!(read, Heard::Heartbeat { custom_mode: 4, kind: 12, autopilot: 3, base_mode: 0x81 });
        let read = Heard::read(32, &[1]).unwrap();
        assert_eq!(read, Heard::Local { time_boot_ms: 1, place: [0.0; 3], velocity: [0.0; 3] });
        let mut nan = vec![0; 28];
        nan[4..8].copy_from_slice(&f32::NAN.to_le_bytes());
        assert_eq!(Heard::read(32, &nan), None);
    }

    /// Frames as pymavlink 2.4.50 packs them, and what they say.
    #[test]
    fn targets_tilts_and_heights_of_pymavlink_are_read() {
        let zeros = |n| "00".repeat(n);
        let frames = [
            (
                "fd1000000001011e0000e8030000cdcccc3dcdcc4cbe0000c03f61b4".to_owned(),
                Heard::Attitude { roll: 0.1, pitch: -0.2, yaw: 1.5 },
            ),
            (format!("fd1900000001013e0000{}5a002d00110a72", zeros(20)), Heard::WaypointDistance(17)),
            (
                format!("fd330000000101550000d0070000000020410000a0c000009041{}f80d01f90b", zeros(32)),
                Heard::LocalTarget(Some([10.0, -5.0])),
            ),
            (
                format!("fd330000000101570000d0070000c0579511805ed014000090c1{}f80d0656af", zeros(32)),
                Heard::GlobalTarget(Some((295_000_000, 349_200_000))),
            ),
            (
                format!("fd270000000101840000d0070000140088139c01000119ff{}5a5f27", zeros(24)),
                Heard::DistanceDown(1, Some(4.12)),
            ),
            ("fd080000000101ad0000000090400000a03fb335".to_owned(), Heard::Rangefinder(4.5)),
            (
                "fd2000000001018d000007000000000000000000803f0000004000004040000080400000b0400000d040625c".to_owned(),
                Heard::Altitude(Some(6.5)),
            ),
        ];
        for (text, expected) in frames {
            let bytes: Vec<u8> =
                (0..text.len()).step_by(2).map(|i| u8::from_str_radix(&text[i..i + 2], 16).unwrap()).collect();
            let mut found = Vec::new();
            crate::autopilot::mavlink::frame::Deframer::default().push(&bytes, heard_extra, |frame| found.push(frame));
            assert_eq!(found.iter().map(|f| Heard::read(f.id, &f.payload)).collect::<Vec<_>>(), [Some(expected)]);
        }
    }

    #[test]
    fn distances_out_of_range_and_other_targets_are_none() {
        let distance = |now: u16, orientation: u8| {
            let payload =
                [&[0; 4][..], &20u16.to_le_bytes(), &500u16.to_le_bytes(), &now.to_le_bytes(), &[0, 1, orientation]];
            Heard::read(132, &payload.concat())
        };
        assert_eq!(distance(501, 25), Some(Heard::DistanceDown(1, None)));
        assert_eq!(distance(300, 0), Some(Heard::DistanceElsewhere));
        let of_quality = |quality: u8| {
            let head = [&[0; 4][..], &[20, 0, 244, 1, 44, 1, 0, 1, 25]].concat();
            Heard::read(132, &[&head[..], &[0; 25], &[quality]].concat())
        };
        assert_eq!(of_quality(1), Some(Heard::DistanceDown(1, None)), "its quality is invalid");
        assert_eq!(
            [of_quality(0), of_quality(100)],
            [Some(Heard::DistanceDown(1, Some(3.0))), Some(Heard::DistanceDown(1, Some(3.0)))]
        );
        let mut velocity_only = vec![1; 51];
        velocity_only[48..50].copy_from_slice(&0x0DC7u16.to_le_bytes());
        assert_eq!(Heard::read(85, &velocity_only), Some(Heard::LocalTarget(None)));
        assert_eq!(Heard::read(87, &velocity_only), Some(Heard::GlobalTarget(None)));
        let unknown = [&[0; 24][..], &(-1000f32).to_le_bytes(), &(-1f32).to_le_bytes()].concat();
        assert_eq!(Heard::read(141, &unknown), Some(Heard::Altitude(None)));
    }

    proptest! {
        #[test]
        fn any_payload_is_read_or_refused(id in 0u32..300, payload in proptest::collection::vec(any::<u8>(), 0..255)) {
            let _ = Heard::read(id, &payload);
        }
    }
}
