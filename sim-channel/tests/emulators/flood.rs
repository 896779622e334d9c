//! Emulators under floods of random and mutated lines. The long test (ten million lines) is for the night or a release:
//! `cargo test -p sim-channel --test flood -- --ignored`.

use sim_channel::modem::micromodem::{Micromodem, MicromodemConfig};
use sim_channel::modem::s2c::{Interpreter, S2c, S2cConfig};
use sim_channel::modem::{Emulator, HostId};
use sim_channel::{Duration, RandomStream};

const LINES: u32 = 10_000_000;

const S2C_LINES: [&[u8]; 12] = [
    b"AT*SENDIM,5,2,ack,hello\r",
    b"AT*SENDIM,p1,5,255,noack,hello\n",
    b"AT*SENDIMS,5,2,123456,hello\r",
    b"AT*SEND,12,2,hello\r\nworld\r\n",
    b"AT*SENDPBM,5,2,hello\r",
    b"+++AT?MODE\r",
    b"AT!AL5\r",
    b"AT@ZX1\r",
    b"AT&V\r",
    b"AT?S\r",
    b"AT?P\r",
    b"ATZ4\r",
];

const MICROMODEM_LINES: [&[u8]; 10] = [
    b"$CCCYC,0,1,2,5,1,2\r\n",
    b"$CCTXD,1,2,1,00112233\r\n",
    b"$CCTDP,2,1,0,0,0011\r\n",
    b"$CCMPC,1,2\r\n",
    b"$CCMUC,1,2,1FFF\r\n",
    b"$CCCFG,SRC,1*33\r\n",
    b"$CCCFQ,SRC\r\n",
    b"$CCCLK,2025,06,06,23,01,03\r\n",
    b"$CCTMS,2025-06-06T23:01:03Z,0\r\n",
    b"$CCALQ,0\r\n",
];

/// One of `lines` with up to three bytes changed, dropped or doubled, or up to 40 random bytes.
fn mutated(lines: &[&[u8]], rng: &mut RandomStream) -> Vec<u8> {
    if rng.bernoulli(0.2) {
        return (0..rng.below(40)).map(|_| rng.below(256) as u8).collect();
    }
    let mut line = lines[rng.below(lines.len())].to_vec();
    for _ in 0..rng.below(4) {
        let at = rng.below(line.len());
        match rng.below(3) {
            0 => line[at] = rng.below(256) as u8,
            1 => line.truncate(line.len().max(2) - 1),
            _ => line.insert(at, line[at]),
        }
    }
    line
}

/// Sends `count` lines to a modem; returns the number of bytes that it wrote.
fn flood(mut modem: impl Emulator, lines: &[&[u8]], seed: u64, count: u32) -> usize {
    let mut rng = RandomStream::new(seed, &[]);
    let mut now = Duration::ZERO;
    let mut received = 0;
    for _ in 0..count {
        now += Duration::from_micros(rng.below(20_000) as u64);
        modem.handle_host_bytes(HostId::FIRST, &mutated(lines, &mut rng), now);
        while modem.poll_transmit(now).is_some() {}
        while modem.poll_event().is_some() {}
        received += modem.poll_host_bytes(HostId::FIRST, now).len();
    }
    received
}

fn s2c(interpreter: Interpreter) -> S2c {
    S2c::new(S2cConfig { interpreter, baud: None, boot_ms: 1, ..S2cConfig::new(1) })
}

fn micromodem() -> Micromodem {
    Micromodem::new(MicromodemConfig { baud: None, ..MicromodemConfig::new(1) })
}

fn flood_all(lines: u32) {
    let received = [
        flood(s2c(Interpreter::Net), &S2C_LINES, 1, lines / 5 * 2),
        flood(s2c(Interpreter::At), &S2C_LINES, 2, lines / 5),
        flood(micromodem(), &MICROMODEM_LINES, 3, lines / 5 * 2),
    ];
    assert!(received.iter().all(|bytes| *bytes > lines as usize), "they stay awake and reply: {received:?}");
}

#[test]
fn a_hundred_thousand_mutated_lines_are_survived() {
    flood_all(LINES / 100);
}

#[test]
#[ignore = "a longer run of the one above"]
fn ten_million_mutated_lines_are_survived() {
    flood_all(LINES);
}
