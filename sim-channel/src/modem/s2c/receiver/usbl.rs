//! Positions from the USBL head: `USBLLONG` and its companions, after each exchange in both directions.

use crate::modem::s2c::base::{PendingFix, ReceivedSignal, S2cBase, S2cTask};
use crate::usbl::UsblHead;
use std::f64::consts::PI;
use std::time::Duration;

/// A delay between hydrophones that could not be measured.
const INVALID_DELAY: u32 = 16_777_215;

#[derive(Debug)]
pub(crate) struct UsblReporter {
    head: Option<UsblHead>,
    last_fix: Option<PendingFix>,
}

impl UsblReporter {
    pub(crate) fn new(head: Option<UsblHead>) -> Self {
        Self { head, last_fix: None }
    }

    /// The reporter after a restart: the head keeps its noise stream, the last fix is forgotten.
    pub(crate) fn restarted(&mut self) -> Self {
        Self::new(self.head.take())
    }

    /// Measures the modem that replied, if there is a head and the host wants positions.
    pub(crate) fn measure(&mut self, base: &mut S2cBase, remote: u8, signal: &ReceivedSignal, now: Duration) {
        let Some(head) = self.head.as_mut().filter(|_| base.options.usbl()) else { return };
        let fix = head.measure(&signal.receiver, &signal.sender, signal.received_at);
        let pending =
            PendingFix { remote, fix, travel: signal.one_way, rssi: signal.rssi, integrity: signal.integrity };
        base.board.schedule(fix.ready_at.max(now), S2cTask::UsblFix(Box::new(pending)));
    }

    /// The head has computed a fix.
    pub(crate) fn on_fix(&mut self, base: &mut S2cBase, fix: &PendingFix, now: Duration) {
        let at = fix_times(fix, now);
        self.last_fix = Some(*fix);
        if base.config.angles_only {
            base.notify(format!("USBLANGLES,{at},{}", angles(fix)), now);
        } else {
            base.notify(format!("USBLLONG,{at},{}", long(fix)), now);
        }
        base.notify(format!("USBLPHYD,{at},{}", delays()), now);
        base.notify(format!("USBLPHYP,{at},{}", positions(fix)), now);
    }

    /// The value behind `?UP`, and behind `?UPX` with more digits of time.
    pub(crate) fn value(&self, key: &str) -> Option<String> {
        match key {
            "UP" => Some(self.last_fix_line(false)),
            "UPX" => Some(self.last_fix_line(true)),
            _ => None,
        }
    }

    /// Seconds, remote, east, north, up.
    fn last_fix_line(&self, exact: bool) -> String {
        let Some(PendingFix { remote, fix, .. }) = &self.last_fix else {
            return "0,0,0.0000,0.0000,0.0000".to_string();
        };
        let [east, north, up] = fix.east_north_up_m();
        let at = fix.measured_at.as_secs_f64();
        let at = if exact { format!("{at:.6}") } else { format!("{at:.0}") };
        format!("{at},{remote},{east:.4},{north:.4},{up:.4}")
    }
}

/// Time of the report, time of the measurement, remote address.
fn fix_times(measured: &PendingFix, now: Duration) -> String {
    let at = measured.fix.measured_at.as_secs_f64();
    format!("{:.6},{at:.6},{}", now.as_secs_f64(), measured.remote)
}

/// The head stands level and looks north, so that its own frame is east, north, up.
fn long(measured: &PendingFix) -> String {
    let [east, north, up] = measured.fix.east_north_up_m();
    let position = format!("{east:.4},{north:.4},{up:.4}");
    let (us, accuracy) = (measured.travel.as_micros(), measured.fix.accuracy_m);
    format!("{position},{position},0.0000,0.0000,0.0000,{us},{},{},{accuracy:.4}", measured.rssi, measured.integrity)
}

/// Bearing counts from -pi to pi.
fn angles(measured: &PendingFix) -> String {
    let fix = &measured.fix;
    let bearing = if fix.bearing_rad > PI { fix.bearing_rad - 2.0 * PI } else { fix.bearing_rad };
    let pair = format!("{bearing:.4},{:.4}", fix.elevation_rad);
    let accuracy = fix.accuracy_m / fix.range_m.max(1.0);
    format!("{pair},{pair},0.0000,0.0000,0.0000,{},{},{accuracy:.4}", measured.rssi, measured.integrity)
}

/// Measurement type and eight delays between hydrophones, which are not modelled.
fn delays() -> String {
    format!("1{}", format!(",{INVALID_DELAY}").repeat(8))
}

/// Measurement type, and the position from each of six triples of hydrophones, which all agree.
fn positions(measured: &PendingFix) -> String {
    let [east, north, up] = measured.fix.east_north_up_m();
    format!("1{}", format!(",{east:.4},{north:.4},{up:.4}").repeat(6))
}
