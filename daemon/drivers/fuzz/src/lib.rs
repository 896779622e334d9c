//! Fuzz targets of the modem drivers, for any bytes of a port.

use scenecast_core::MicromodemRate;
use scenecast_drivers::modem::micromodem::{Micromodem, MicromodemConfig, SentenceParser};
use scenecast_drivers::modem::s2c::{LineParser, S2c, S2cConfig, S2cMode};
use scenecast_drivers::modem::{Class, Destination, Driver};
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// A target accepts any bytes.
pub type Target = fn(&[u8]);

/// Every target by the name of its corpus.
pub const ALL: [(&str, Target); 4] = [
    ("s2c_lines", s2c_lines),
    ("micromodem_sentences", micromodem_sentences),
    ("s2c_driver", s2c_driver),
    ("micromodem_driver", micromodem_driver),
];

/// The parser of an S2C, with and without wrapped lines.
pub fn s2c_lines(data: &[u8]) {
    for ties in [false, true] {
        let mut parser = LineParser::default();
        parser.set_ties(ties);
        for piece in data.chunks(7) {
            parser.push(piece);
            while parser.next_line().is_some() {}
            assert!(parser.kept() < 8192);
        }
    }
}

/// The parser of a Micromodem.
pub fn micromodem_sentences(data: &[u8]) {
    let mut parser = SentenceParser::default();
    parser.push(data, |_| {});
    assert!(parser.kept() <= 6 * 1024);
}

/// A driver for an S2C; the first byte chooses its mode.
pub fn s2c_driver(data: &[u8]) {
    let Some((first, data)) = data.split_first() else { return };
    let config = S2cConfig {
        address: 10,
        mode: if first & 1 == 0 { S2cMode::Burst } else { S2cMode::Instant },
        source_level: 3,
        highest_address: 14,
        cluster: 10,
        packet_ms: 750,
        ethernet: first & 2 != 0,
        baud: Some(19_200),
        burst_bps: 10_000.0,
        pool_frames: 16,
    };
    feed(&mut S2c::new(config), data);
}

/// A driver for a Micromodem; the first byte chooses its rate.
pub fn micromodem_driver(data: &[u8]) {
    let Some((first, data)) = data.split_first() else { return };
    let config = MicromodemConfig { address: 10, rate: MicromodemRate::of(first % 6), baud: Some(19_200) };
    feed(&mut Micromodem::new(config), data);
}

/// Lines at intervals; between them the host sends something.
fn feed(driver: &mut dyn Driver, data: &[u8]) {
    let mut now = Instant::from_micros(1_000_000);
    driver.handle_open(now);
    for line in data.split_inclusive(|b| *b == b'\n') {
        driver.handle_bytes(line, now);
        let _ = driver.send(Destination::Modem(1), vec![1; 30], Class::Command, now);
        let _ = driver.send(Destination::Modem(1), vec![1; 30], Class::Bulk, now);
        while driver.poll_event().is_some() {}
        while driver.poll_output(now).is_some() {}
        driver.handle_timeout(now);
        assert!(driver.poll_timeout().is_none_or(|at| at > now));
        now = now + Duration::from_millis(u64::from(line.first().copied().unwrap_or(0)));
    }
    driver.handle_closed(now);
}
