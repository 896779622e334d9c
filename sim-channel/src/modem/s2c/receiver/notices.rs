//! The notifications that carry received messages and data.

use crate::modem::s2c::base::{Interpreter, ReceivedSignal, S2cBase, S2cFrame, VELOCITY};
use crate::modem::s2c::input::InstantFlag;
use std::time::Duration;

/// `RECVIM`: an instant message, with its flag and its duration on air.
pub(crate) fn instant(base: &mut S2cBase, frame: &S2cFrame, signal: &ReceivedSignal, now: Duration) {
    let flag = InstantFlag::ALL.get(usize::from(frame.tag)).map_or("noack", |flag| flag.name());
    let between = format!("{flag},{}", signal.airtime.as_micros());
    message(base, "RECVIM", frame, &between, signal, now);
}

/// `RECVIMS`: a synchronous message, with the time of its arrival.
pub(crate) fn synchronous(base: &mut S2cBase, frame: &S2cFrame, signal: &ReceivedSignal, now: Duration) {
    let clock = base.clock_us(signal.received_at.saturating_sub(signal.airtime));
    let between = format!("{clock},{}", signal.airtime.as_micros());
    message(base, "RECVIMS", frame, &between, signal, now);
}

fn message(base: &mut S2cBase, keyword: &str, frame: &S2cFrame, between: &str, signal: &ReceivedSignal, now: Duration) {
    let len = length_field(base, frame.pid, frame.payload.len());
    let head = format!(
        "{keyword},{len},{},{},{between},{},{},{VELOCITY},",
        frame.src, frame.dst, signal.rssi, signal.integrity
    );
    base.notify([head.as_bytes(), &frame.payload].concat(), now);
}

/// `RECVPBM`: the piggyback message of a frame, if it has one.
pub(crate) fn piggyback(base: &mut S2cBase, frame: &S2cFrame, signal: &ReceivedSignal, now: Duration) {
    let Some((pid, data)) = &frame.piggyback else { return };
    let len = length_field(base, *pid, data.len());
    let (src, own, us) = (frame.src, base.address(), signal.airtime.as_micros());
    let head = format!("RECVPBM,{len},{src},{own},{us},{},{},{VELOCITY},", signal.rssi, signal.integrity);
    base.notify([head.as_bytes(), data].concat(), now);
}

/// `RECV`, or raw bytes on a port of the AT interpreter.
pub(crate) fn record(base: &mut S2cBase, src: u8, pid: u8, data: &[u8], signal: &ReceivedSignal, now: Duration) {
    if base.config.interpreter == Interpreter::At {
        base.board.write_to_all(data, now);
        return;
    }
    let len = length_field(base, pid, data.len());
    let (own, rate, travel) = (base.address(), base.config.bit_rate, signal.one_way.as_micros());
    let head = format!("RECV,{len},{src},{own},{rate},{},{},{travel},{VELOCITY},", signal.rssi, signal.integrity);
    base.notify([head.as_bytes(), data].concat(), now);
}

/// The length, after the protocol id in extended networking.
fn length_field(base: &S2cBase, pid: u8, len: usize) -> String {
    if base.options.networking() { format!("p{pid},{len}") } else { len.to_string() }
}
