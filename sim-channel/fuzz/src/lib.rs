//! Fuzz targets of sim-channel: emulators accept any bytes from hosts and from the channel.

use sim_channel::modem::micromodem::{Micromodem, MicromodemConfig};
use sim_channel::modem::s2c::{Interpreter, S2c, S2cConfig};
use sim_channel::modem::{Emulator, HostId};
use sim_channel::{Arrival, Duration, NodeId, NodePosition, ReceptionOutcome};

/// A target accepts any bytes.
pub type Target = fn(&[u8]);

/// Every target by the name of its corpus.
pub const ALL: [(&str, Target); 3] = [("s2c", s2c), ("micromodem", micromodem), ("channel", channel)];

/// The host of an S2C, with either interpreter.
pub fn s2c(data: &[u8]) {
    for interpreter in [Interpreter::At, Interpreter::Net] {
        let config = S2cConfig { interpreter, baud: None, boot_ms: 1, remote: 2, ..S2cConfig::new(1) };
        host(S2c::new(config), data);
    }
}

/// The host of a Micromodem.
pub fn micromodem(data: &[u8]) {
    host(Micromodem::new(MicromodemConfig { baud: None, ..MicromodemConfig::new(1) }), data);
}

/// A frame from the channel at each modem.
pub fn channel(data: &[u8]) {
    arrive(S2c::new(S2cConfig::new(2)), data);
    arrive(Micromodem::new(MicromodemConfig::new(2)), data);
}

/// Feeds bytes of a host in pieces; the data also decide the lengths of the pieces and the pauses between them.
fn host(mut modem: impl Emulator, data: &[u8]) {
    let mut now = Duration::ZERO;
    let mut rest = data;
    while let Some((control, tail)) = rest.split_first() {
        let (piece, tail) = tail.split_at(tail.len().min(usize::from(control & 63) + 1));
        now += Duration::from_millis(u64::from(control >> 6) * 400);
        modem.handle_host_bytes(HostId::FIRST, piece, now);
        drain(&mut modem, now);
        rest = tail;
    }
    drain(&mut modem, now + Duration::from_secs(60));
}

fn arrive(mut modem: impl Emulator, data: &[u8]) {
    let now = Duration::from_secs(5);
    let position = NodePosition::default();
    let outcome = ReceptionOutcome::Delivered { bytes: data.to_vec(), copy: 0, corrupted: true };
    let arrival = Arrival {
        transmission: 1,
        from: NodeId(1),
        to: NodeId(2),
        at: now,
        sent_at: now - Duration::from_secs(2),
        range_m: 100.0,
        sender: position,
        receiver: position,
        airtime: Duration::from_secs(1),
        outcome,
    };
    modem.handle_arrival(&arrival, now);
    drain(&mut modem, now + Duration::from_secs(60));
}

fn drain(modem: &mut impl Emulator, now: Duration) {
    modem.handle_timeout(now);
    while modem.poll_transmit(now).is_some() {}
    while modem.poll_event().is_some() {}
    let _ = modem.poll_host_bytes(HostId::FIRST, now);
}
