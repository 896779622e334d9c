//! `USBLLONG` and its companions, told by a head after an exchange that was answered.

use super::reception::Signal;
use super::{Event, S2c};
use crate::Duration;
use crate::usbl::UsblFix;
use std::f64::consts::PI;

/// A delay between hydrophones that could not be measured.
const INVALID_DELAY: u32 = 16_777_215;

/// A fix that is not yet told.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    pub remote: u8,
    pub fix: UsblFix,
    pub travel: Duration,
    pub rssi: i32,
    pub integrity: i32,
}

impl S2c {
    /// Measures whoever answered, if there is a head and the host wants to know.
    pub(super) fn measure(&mut self, remote: u8, signal: &Signal, now: Duration) {
        let Some(head) = self.head.as_mut().filter(|_| self.options.usbl) else { return };
        let fix = head.measure(&signal.receiver, &signal.sender, signal.heard_at);
        let measured = Measured { remote, fix, travel: signal.travel, rssi: signal.rssi, integrity: signal.integrity };
        self.board.plan(fix.ready_at.max(now), Event::Usbl(Box::new(measured)));
    }

    pub(super) fn on_measured(&mut self, measured: &Measured, now: Duration) {
        let at = fix_times(measured, now);
        self.last_fix = Some(*measured);
        if self.config.angles_only {
            self.notify(format!("USBLANGLES,{at},{}", angles(measured)), now);
        } else {
            self.notify(format!("USBLLONG,{at},{}", long(measured)), now);
        }
        self.notify(format!("USBLPHYD,{at},{}", delays()), now);
        self.notify(format!("USBLPHYP,{at},{}", positions(measured)), now);
    }

    /// `?UP`, and with more digits of time `?UPX`: seconds, remote, east, north, up.
    pub(super) fn last_fix_line(&self, exact: bool) -> String {
        let Some(Measured { remote, fix, .. }) = &self.last_fix else { return "0,0,0.0000,0.0000,0.0000".to_string() };
        let [east, north, up] = fix.east_north_up_m();
        let at = fix.measured_at.as_secs_f64();
        let at = if exact { format!("{at:.6}") } else { format!("{at:.0}") };
        format!("{at},{remote},{east:.4},{north:.4},{up:.4}")
    }
}

/// Time of telling, time of measuring, remote address.
fn fix_times(measured: &Measured, now: Duration) -> String {
    let at = measured.fix.measured_at.as_secs_f64();
    format!("{:.6},{at:.6},{}", now.as_secs_f64(), measured.remote)
}

/// The head stands level and looks north, so that its own frame is east, north, up.
fn long(measured: &Measured) -> String {
    let [east, north, up] = measured.fix.east_north_up_m();
    let place = format!("{east:.4},{north:.4},{up:.4}");
    let (us, accuracy) = (measured.travel.as_micros(), measured.fix.accuracy_m);
    format!("{place},{place},0.0000,0.0000,0.0000,{us},{},{},{accuracy:.4}", measured.rssi, measured.integrity)
}

/// Bearing counts from -pi to pi.
fn angles(measured: &Measured) -> String {
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

/// Measurement type and the place by each of six triples of hydrophones, which agree.
fn positions(measured: &Measured) -> String {
    let [east, north, up] = measured.fix.east_north_up_m();
    format!("1{}", format!(",{east:.4},{north:.4},{up:.4}").repeat(6))
}
