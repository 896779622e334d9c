//! Drivers under random and mutated lines: none panics, memory is bounded, and all become ready again.

use scenecast_core::MicromodemRate;
use scenecast_drivers::modem::micromodem::{Micromodem, MicromodemConfig, SentenceParser, format_sentence};
use scenecast_drivers::modem::s2c::{LineParser, S2c, S2cConfig, S2cMode};
use scenecast_drivers::modem::{Class, Destination, Driver};
use scenecast_protocol::time::Instant;
use sim_channel::RandomStream;
use std::time::Duration;

/// Number of lines of an ordinary run; a long run has `SCENECAST_STORM_LINES=10000000`.
const LINES: usize = 400_000;

const SEEDS: [&[u8]; 22] = [
    b"RECVIM,4,3,2,ack,313200,-60,170,0.0300,abcd\r\n",
    b"RECV,p0,2,1,9,13000,-55,175,667000,0.0000,xy\r\n",
    b"RECVPBM,2,1,9,139000,-40,121,0.1000,xy\r\n",
    b"USBLLONG,10446.991981,10446.534643,3,-0.0604,-1.0888,-0.5851,-0.4233,-1.0020,-0.5901,0.0063,0.0269,-0.3295,825,-36,77,1.2375\r\n",
    b"USBLANGLES,1.0,0.5,3,0.1,0.2,0.3,0.4,0,0,0,-30,120,0.01\r\n",
    b"+++AT*SENDIM:2:OK\r\n",
    b"+++AT:13:DELIVEREDIM,3\r\n",
    b"+++AT?MODE:2:AT\r\n",
    b"ERROR WRONG FORMAT\r\n",
    b"NET\r\n",
    b"OK\r\n",
    b"[*]OK\r\n",
    b"BUSY BACKOFF STATE\r\n",
    b"DELIVERED,7,2\r\n",
    b"SENDEND,2,data,3349740869,750000\r\n",
    b"BITRATE,local,13000\r\n",
    b"10\r\n",
    b"$CARXD,1,10,0,1,00FFA0*00\r\n",
    b"$CADRQ,120000,10,1,0,64,1*00\r\n",
    b"$CACFG,SRC,10*00\r\n",
    b"$CACYC,0,10,1,1,0,3*00\r\n",
    b"$CACST,6,0,20250606230123.348554,06,32767,45,0102,0123,07,00,00,00,00,1,001,000,0,3,1,0,150*00\r\n",
];

struct LineRng(RandomStream);

impl LineRng {
    fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    /// A mutated line of the seeds. Most sentences have a valid checksum, or the drivers would read none.
    fn line(&mut self) -> Vec<u8> {
        let mut line = SEEDS[self.below(SEEDS.len())].to_vec();
        for _ in 0..self.below(4) {
            let at = self.below(line.len().max(1)).min(line.len().saturating_sub(1));
            if line.is_empty() {
                break;
            }
            match self.below(6) {
                0 => line[at] = self.below(256) as u8,
                1 => line.insert(at, [b',', b'\r', b'\n', b'+', b'$', b'9'][self.below(6)]),
                2 => drop(line.remove(at)),
                3 => line.truncate(at + 1),
                4 => line.extend_from_slice(SEEDS[self.below(SEEDS.len())]),
                _ => line.splice(at..at, (0..self.below(40)).map(|i| i as u8)).for_each(drop),
            }
        }
        if line.starts_with(b"$") && self.below(4) > 0 {
            let body =
                String::from_utf8_lossy(&line[1..]).split(['*', '$', '\r', '\n']).next().unwrap_or("").to_owned();
            line = format_sentence(&body);
        }
        line
    }
}

fn lines() -> usize {
    std::env::var("SCENECAST_STORM_LINES").ok().and_then(|n| n.parse().ok()).unwrap_or(LINES)
}

fn drivers() -> [Box<dyn Driver>; 3] {
    let s2c = |mode| S2cConfig {
        address: 10,
        mode,
        source_level: 3,
        highest_address: 14,
        cluster: 10,
        packet_ms: 750,
        ethernet: false,
        baud: Some(19_200),
        burst_bps: 10_000.0,
        pool_frames: 16,
    };
    let micromodem = MicromodemConfig { address: 10, rate: MicromodemRate::of(1), baud: None };
    [
        Box::new(S2c::new(s2c(S2cMode::Burst))),
        Box::new(S2c::new(s2c(S2cMode::Instant))),
        Box::new(Micromodem::new(micromodem)),
    ]
}

/// Feeds a driver as a correct host does; returns the number of times that it was ready.
fn feed(driver: &mut dyn Driver, line: &[u8], now: Instant) {
    driver.handle_bytes(line, now);
    let mut events = 0;
    while driver.poll_event().is_some() {
        events += 1;
        assert!(events < 10_000, "events without end");
    }
    let _ = driver.send(Destination::Modem(1), vec![1; 30], Class::Bulk, now);
    let _ = driver.send(Destination::Modem(1), vec![1; 30], Class::Service, now);
    let mut written = 0;
    while driver.poll_output(now).is_some() {
        written += 1;
        assert!(written < 10_000, "output without end");
    }
    driver.handle_timeout(now);
    assert!(driver.poll_timeout().is_none_or(|at| at > now), "a time that has passed is asked for again");
}

#[test]
fn drivers_survive_any_lines() {
    let mut rng = LineRng(RandomStream::new(1, &[1]));
    let mut drivers = drivers();
    let mut now = Instant::from_secs_f64(1.0);
    drivers.iter_mut().for_each(|d| d.handle_open(now));
    for _ in 0..lines() {
        let line = rng.line();
        for driver in &mut drivers {
            feed(driver.as_mut(), &line, now);
        }
        now = now + Duration::from_millis(rng.below(300) as u64);
    }
}

#[test]
fn parsers_survive_any_lines_in_bounded_memory() {
    let mut rng = LineRng(RandomStream::new(2, &[1]));
    let (mut plain, mut wrapped, mut sentences) =
        (LineParser::default(), LineParser::default(), SentenceParser::default());
    wrapped.set_ties(true);
    for i in 0..lines() {
        let line = rng.line();
        for parser in [&mut plain, &mut wrapped] {
            parser.push(&line);
            while parser.next_line().is_some() {}
            assert!(parser.kept() < 8192, "{} bytes are kept", parser.kept());
        }
        // A port that has no data mode turns wrapping off.
        if i % 16 == 0 {
            wrapped.set_ties(true);
        }
        sentences.push(&line, |_| {});
        assert!(sentences.kept() <= 6 * 1024);
    }
}
