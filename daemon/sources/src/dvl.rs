//! A Doppler velocity log of Water Linked over TCP.

use crate::ArrivalClock;
use crate::live::{Reading, SensorKind, SensorSource, SourceError};
use scenecast_core::Lines;
use scenecast_sensors::{CameraFault, DvlReport, DvlTrack, MAX_DVL_LINE, SensorPose, Stamp};
use std::collections::VecDeque;
use std::io::{ErrorKind, Read};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// Port of the log's reports.
const PORT: u16 = 16171;

/// Longest time in which a connection must be made.
const CONNECT: Duration = Duration::from_secs(3);

/// The dead reckoning of a log at an address `HOST` or `HOST:PORT`.
pub struct DvlSource {
    address: String,
    clock: ArrivalClock,
    stream: Option<TcpStream>,
    lines: Lines,
    overlong: u64,
    track: DvlTrack,
    /// Poses of one read that were not returned yet.
    poses: VecDeque<(Stamp, SensorPose)>,
}

impl DvlSource {
    /// `heading_rad` is the heading at the reset of the log, clockwise from north.
    pub fn new(address: &str, heading_rad: f64, clock: ArrivalClock) -> Self {
        Self {
            address: address.to_owned(),
            clock,
            stream: None,
            lines: Lines::new(MAX_DVL_LINE),
            overlong: 0,
            track: DvlTrack::new(heading_rad),
            poses: VecDeque::new(),
        }
    }

    fn connect(&self) -> std::io::Result<TcpStream> {
        let has_port = self.address.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok());
        let addresses = match has_port {
            true => self.address.to_socket_addrs()?,
            false => (self.address.as_str(), PORT).to_socket_addrs()?,
        };
        let mut last = std::io::Error::new(ErrorKind::NotFound, "it has no address");
        for address in addresses {
            match TcpStream::connect_timeout(&address, CONNECT) {
                Ok(stream) => return Ok(stream),
                Err(error) => last = error,
            }
        }
        Err(last)
    }

    fn handle_bytes(&mut self, bytes: &[u8], fault: &mut dyn FnMut(CameraFault, String)) {
        let (track, poses, arrival) = (&mut self.track, &mut self.poses, self.clock.now());
        self.lines.push(bytes, |line| {
            for report in DvlReport::all_of(line) {
                match report {
                    Ok(report) => poses.extend(track.handle(report, arrival, fault)),
                    Err(error) => fault(CameraFault::PosesUnreadable, error.to_string()),
                }
            }
        });
        let overlong = self.lines.overlong();
        if std::mem::replace(&mut self.overlong, overlong) != overlong {
            fault(CameraFault::PosesUnreadable, format!("a line is longer than {MAX_DVL_LINE} bytes"));
        }
    }
}

impl SensorSource for DvlSource {
    fn kind(&self) -> SensorKind {
        SensorKind::Navigation
    }

    fn open(&mut self) -> Result<(), SourceError> {
        self.close();
        let stream = self.connect().map_err(|error| SourceError(format!("the DVL at {}: {error}", self.address)))?;
        self.stream = Some(stream);
        Ok(())
    }

    fn next(
        &mut self,
        timeout: Duration,
        fault: &mut dyn FnMut(CameraFault, String),
    ) -> Result<Option<Reading>, SourceError> {
        if self.poses.is_empty() {
            let Some(stream) = &mut self.stream else { return Err(SourceError("the DVL is not open".to_owned())) };
            let mut buffer = [0; 4096];
            let read = stream.set_read_timeout(Some(timeout)).and_then(|()| stream.read(&mut buffer));
            match read {
                Ok(0) => return Err(SourceError(format!("the DVL at {} closed the connection", self.address))),
                Ok(n) => self.handle_bytes(buffer.get(..n).unwrap_or_default(), fault),
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
                Err(error) => return Err(SourceError(format!("the DVL at {}: {error}", self.address))),
            }
        }
        Ok(self.poses.pop_front().map(|(stamp, pose)| Reading::Pose(stamp, pose)))
    }

    fn is_reopened_after_stall(&self) -> bool {
        // A connection that a switched-off log leaves behind never ends by itself.
        true
    }

    fn close(&mut self) {
        self.stream = None;
        self.lines.clear();
        self.poses.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::net::TcpListener;

    fn position(ts_s: f64, x: f64) -> String {
        format!(
            "{{\"ts\":{ts_s},\"x\":{x},\"y\":0,\"z\":1.5,\"std\":0.01,\"roll\":0,\"pitch\":0,\"yaw\":0,\
             \"type\":\"position_local\",\"status\":0,\"format\":\"json_v3.1\"}}\r\n"
        )
    }

    fn velocity(altitude_m: f64, is_valid: bool) -> String {
        format!(
            "{{\"time\":100,\"vx\":0,\"vy\":0,\"vz\":0,\"fom\":0.1,\"altitude\":{altitude_m},\
             \"velocity_valid\":{is_valid},\"status\":0,\"format\":\"json_v3.1\",\"type\":\"velocity\",\
             \"time_of_validity\":1638191471563017}}\r\n"
        )
    }

    /// A log that serves one connection after the other, each of which it closes after these bytes.
    fn emulate(connections: Vec<Vec<u8>>) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        std::thread::spawn(move || {
            for bytes in connections {
                let (mut stream, _) = listener.accept().unwrap();
                // In pieces that end within lines.
                bytes.chunks(50).for_each(|piece| stream.write_all(piece).unwrap());
            }
        });
        address
    }

    /// The poses of one connection, and how it ended.
    fn read(source: &mut DvlSource, faults: &mut Vec<CameraFault>) -> (Vec<SensorPose>, SourceError) {
        source.open().unwrap();
        let mut poses = Vec::new();
        loop {
            match source.next(Duration::from_secs(5), &mut |fault, _| faults.push(fault)) {
                Ok(Some(Reading::Pose(_, pose))) => poses.push(pose),
                Ok(other) => assert_eq!(other, None),
                Err(error) => return (poses, error),
            }
        }
    }

    #[test]
    fn lines_between_garbage_become_poses_across_connections() {
        let first = [velocity(3.5, true), position(1.0, 0.0), "wrx,1,2\n".to_owned(), position(1.2, 0.5)].concat();
        let endless = vec![b'x'; 3 * MAX_DVL_LINE];
        let second = [position(1.4, 0.75), velocity(9.0, false), position(1.6, 1.0)].concat();
        let rubbish = [vec![0xFF, 0, b'\n'], endless, b"\n{\"type\":7}\n".to_vec(), second.into_bytes()].concat();
        let address = emulate(vec![first.into_bytes(), rubbish]);
        let mut source = DvlSource::new(&address, 90f64.to_radians(), ArrivalClock::start());
        let mut faults = Vec::new();
        let (poses, end) = read(&mut source, &mut faults);
        assert_eq!(end.0, format!("the DVL at {address} closed the connection"));
        assert_eq!(
            poses.iter().map(|p| (p.x_m, p.depth_m, p.altitude_m)).collect::<Vec<_>>(),
            [(0.0, 1.5, Some(3.5)), (0.5, 1.5, Some(3.5))]
        );
        assert_eq!(std::mem::take(&mut faults), [CameraFault::PosesUnreadable]);
        let (poses, _) = read(&mut source, &mut faults);
        assert_eq!(poses.iter().map(|p| p.x_m).collect::<Vec<_>>(), [0.75, 1.0], "no jump between connections");
        assert_eq!(poses[1].altitude_m, None);
        let unreadable = faults.iter().filter(|fault| **fault == CameraFault::PosesUnreadable).count();
        assert_eq!((unreadable, faults.len()), (3, 4), "{faults:?}");
    }

    #[test]
    fn a_log_that_is_away_is_named_with_its_address() {
        // A port below 1024 that no other test of this machine listens at.
        let error = DvlSource::new("127.0.0.1:1", 0.0, ArrivalClock::start()).open().unwrap_err();
        assert!(error.0.starts_with("the DVL at 127.0.0.1:1: "), "{error}");
    }
}
