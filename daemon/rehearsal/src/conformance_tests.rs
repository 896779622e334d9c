//! What every driver must do, each at its emulator, in virtual time.

use crate::VirtualTime;
use crate::modem_bench::{Dock, DockSetting};
use scenecast_config::Config;
use scenecast_drivers::modem;
use scenecast_drivers::modem::{Class, Destination, Driver, Event, Refusal, Token};
use scenecast_protocol::directive::SlotId;
use scenecast_protocol::link::Cycle;
use scenecast_protocol::mac::Access;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use sim_channel::modem::s2c::{S2c as S2cEmulator, S2cConfig as EmulatorConfig};
use sim_channel::modem::{Emulator, Fault};
use std::time::Duration;

const SECOND: Duration = Duration::from_secs(1);

/// After a fault, traffic goes on within so long.
const RESUMES: Duration = Duration::from_secs(10);

/// What modems need by themselves: a Micromodem for a cycle of each end, for nothing is heard before the end of a packet;
/// an S2C that speaks to one that has forgotten their connection, for a train and for its patience.
fn cycle(name: &str) -> Duration {
    match name {
        "s2c burst" => 6 * SECOND,
        "s2c im" | "transparent" => Duration::ZERO,
        _ => 8 * SECOND,
    }
}

/// Every kind with an emulator.
const KINDS: [(&str, &[&str]); 6] = [
    ("s2c burst", &["modem.kind=s2c"]),
    ("s2c im", &["modem.kind=s2c", "modem.s2c_mode=im"]),
    ("micromodem 0", &["modem.kind=micromodem", "modem.rate=0"]),
    ("micromodem 1", &["modem.kind=micromodem", "modem.rate=1"]),
    ("micromodem 5", &["modem.kind=micromodem", "modem.rate=5", "modem.baud=115200"]),
    ("transparent", &["modem.kind=transparent", "modem.baud=9600", "modem.bit_rate=9600"]),
];

fn config(sets: &[&str]) -> Config {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    scenecast_config::load(None, &sets).unwrap()
}

fn setting(sets: &[&str], loss: f64) -> DockSetting {
    DockSetting { config: config(sets), range_m: 500.0, loss }
}

fn driver(config: &Config, end: Address) -> Box<dyn Driver> {
    let mut config = config.clone();
    config.modem.device = Some("emulated".into());
    let profile = scenecast_drivers::modem::modem_of_process(&config, end).unwrap();
    modem::driver(&config, end, profile).unwrap()
}

/// Two ends that speak with each other.
fn speaking(sets: &[&str], loss: f64) -> Dock {
    let mut dock = Dock::new(&setting(sets, loss), 5).unwrap();
    dock.load = Some(2000);
    let met = dock.run_until(Instant::from_secs_f64(900.0), |d| useful(d) > 10.0);
    assert!(met, "{sets:?}: nothing got through");
    dock
}

fn useful(dock: &Dock) -> f64 {
    dock.view().map_or(0.0, |v| v.replica().useful_bytes())
}

/// Whether the surface hears something new of the vehicle within `most`.
fn resumes_within(dock: &mut Dock, most: Duration) -> bool {
    let heard = dock.heard[1];
    let until = dock.now + most;
    dock.run_until(until, |d| d.heard[1] > heard)
}

fn nothing_applied_twice(dock: &Dock) {
    for (slot, times) in &dock.applied {
        assert_eq!(times.len(), 1, "{slot:?} was applied at {times:?}");
    }
}

#[test]
fn ends_meet_and_what_is_said_and_commanded_arrives() {
    for (name, sets) in KINDS {
        let mut dock = speaking(sets, 0.1);
        let version = dock.issue().unwrap();
        let until = dock.now + 200 * SECOND;
        let applied = dock.run_until(until, |d| d.applied.keys().any(|(_, v)| *v == version));
        assert!(applied, "{name}: the directive was not applied");
        nothing_applied_twice(&dock);
        assert!(dock.refusals.is_empty(), "{name}: {:?}", dock.refusals);
    }
}

#[test]
fn what_does_not_fit_is_refused_to_the_caller() {
    for (name, sets) in KINDS {
        let mut driver = driver(&config(sets), Address::SURFACE);
        let most = driver.profile().frame_bytes;
        for (bytes, expected) in [(most + 1, Refusal::TooLong { bytes: most + 1, most }), (0, Refusal::Empty)] {
            let refused = driver.send(Destination::Modem(1), vec![7; bytes], Class::Bulk, Instant::ZERO);
            assert_eq!(refused, Err(expected), "{name}");
        }
        let closed = driver.send(Destination::Modem(1), vec![7; most], Class::Bulk, Instant::ZERO);
        assert_eq!(closed, Err(Refusal::NotReady), "{name}: before its port is open");
    }
}

#[test]
fn unreachable_addresses_are_refused() {
    for (name, sets) in KINDS.into_iter().filter(|(name, _)| *name != "transparent") {
        let mut driver = driver(&config(sets), Address::SURFACE);
        for bad in [0, 10, 200] {
            let refused = driver.send(Destination::Modem(bad), vec![7; 8], Class::Bulk, Instant::ZERO);
            assert!(matches!(refused, Err(Refusal::NoSuchAddress(..))), "{name}: {bad} gave {refused:?}");
        }
    }
}

#[test]
fn a_modem_with_another_address_is_refused_and_stays_silent() {
    for (name, sets) in KINDS.into_iter().filter(|(name, _)| *name != "transparent") {
        let mut dock = Dock::new(&setting(sets, 0.0), 5).unwrap();
        dock.inject(0, Fault::WrongAddress(7));
        dock.run(60 * SECOND);
        let said = dock.refusals.join(" ");
        assert!(said.contains("is 7 and ours is 1"), "{name}: {said:?}");
        assert_eq!(dock.vehicle.audit().transmissions(), 0, "{name}");
    }
}

/// Traffic goes on by itself within ten seconds, and what a modem needs to begin a cycle or a connection, after a fault.
fn survives(fault: impl Fn(&mut Dock), lasts: Duration) {
    for (name, sets) in KINDS {
        for end in [0, 1] {
            let mut dock = speaking(sets, 0.0);
            dock.issue().unwrap();
            dock.run(Duration::from_millis(3700));
            dock.issue().unwrap();
            DockFault(&mut dock, end).apply(&fault);
            dock.run(lasts);
            assert!(resumes_within(&mut dock, RESUMES + cycle(name)), "{name}: end {end} does not come back");
            let version = dock.issue().unwrap();
            let until = dock.now + 120 * SECOND;
            let applied = dock.run_until(until, |d| d.applied.keys().any(|(_, v)| *v == version));
            assert!(applied, "{name}: end {end}: no directive gets through");
            nothing_applied_twice(&dock);
        }
    }
}

/// Tells a fault which end it is at.
struct DockFault<'a>(&'a mut Dock, usize);

impl DockFault<'_> {
    fn apply(self, fault: &impl Fn(&mut Dock)) {
        self.0.struck = self.1;
        fault(self.0);
    }
}

#[test]
fn a_modem_that_restarts_in_its_turn_is_set_up_again() {
    // Three seconds are its own.
    survives(|d| d.inject(d.struck, Fault::Reboot), 3 * SECOND);
}

#[test]
fn a_supply_that_fails_while_transmitting_is_survived() {
    survives(|d| d.inject(d.struck, Fault::BrownOut), 3 * SECOND);
}

#[test]
fn a_cable_that_was_out_for_half_a_minute_is_used_again() {
    survives(
        |d| {
            let end = d.struck;
            d.plug(end, false);
            d.run(30 * SECOND);
            d.plug(end, true);
        },
        Duration::ZERO,
    );
}

#[test]
fn a_port_that_was_frozen_for_a_minute_is_used_again() {
    survives(|d| d.inject(d.struck, Fault::Freeze(60 * SECOND)), 60 * SECOND);
}

#[test]
fn ten_seconds_of_garbage_are_survived() {
    survives(
        |d| {
            for _ in 0..20 {
                d.inject(d.struck, Fault::Garbage(500));
                d.inject(d.struck, Fault::HalfLine);
                d.run(Duration::from_millis(500));
            }
        },
        Duration::ZERO,
    );
}

#[test]
fn a_busy_modem_is_asked_again() {
    survives(|d| d.inject(d.struck, Fault::Busy(10 * SECOND)), 10 * SECOND);
}

#[test]
fn ports_of_both_interpreters_understand_each_other() {
    use sim_channel::modem::s2c::Interpreter::{At, Net};
    let modem = |address, interpreter| -> Box<dyn Emulator> {
        Box::new(S2cEmulator::new(EmulatorConfig { interpreter, ..EmulatorConfig::new(address) }))
    };
    for sets in [KINDS[0].1, KINDS[1].1] {
        for (vehicle, surface) in [(At, At), (At, Net), (Net, At)] {
            let modems = [modem(1, vehicle), modem(10, surface)];
            let mut dock = Dock::with_modems(&setting(sets, 0.0), modems, 5).unwrap();
            dock.load = Some(2000);
            dock.run(120 * SECOND);
            let version = dock.issue().unwrap();
            dock.run(60 * SECOND);
            let what = format!("{sets:?} {vehicle:?} {surface:?}");
            assert!(useful(&dock) > 2000.0, "{what}: {} bytes got through", useful(&dock));
            assert!(dock.applied.contains_key(&(SlotId::Utility, version)), "{what}: the directive was not applied");
        }
    }
}

/// Every token that is accepted is settled once.
#[test]
fn every_transmission_has_one_end() {
    for (name, sets) in KINDS {
        let mut driver = driver(&config(sets), Address::SURFACE);
        let (mut now, mut tokens) = (Instant::ZERO, Vec::<Token>::new());
        driver.handle_open(now);
        let mut settled = Vec::new();
        for step in 0..2000u32 {
            answer_as_a_willing_modem(driver.as_mut(), now, step);
            let access = driver.profile().access;
            if driver.is_ready() && step % 50 == 0 && access != Access::Polled {
                tokens.extend(driver.send(Destination::Modem(1), vec![9; 20], Class::Bulk, now));
            }
            if driver.may_begin_cycle(now) && step % 50 == 0 {
                let cycle = Cycle { from: Address::SURFACE, to: Address::EVERYBODY, frames: 1 };
                driver.begin_cycle(10, Destination::Modem(1), cycle, now);
                tokens.extend(driver.send(Destination::Modem(1), vec![9; 20], Class::Bulk, now));
            }
            if step == 1000 {
                driver.handle_closed(now);
                driver.handle_open(now);
            }
            while let Some(event) = driver.poll_event() {
                if let Event::Sent(t) | Event::Delivered(t) | Event::Failed(t) | Event::Unknown(t) = event {
                    settled.push(t);
                }
            }
            now = now + Duration::from_millis(200);
            driver.handle_timeout(now);
        }
        driver.handle_closed(now);
        while let Some(event) = driver.poll_event() {
            if let Event::Sent(t) | Event::Delivered(t) | Event::Failed(t) | Event::Unknown(t) = event {
                settled.push(t);
            }
        }
        settled.sort_unstable();
        assert!(tokens.len() > 5, "{name}: {} transmissions were taken", tokens.len());
        assert_eq!(settled, tokens, "{name}");
    }
}

/// Replies of a modem that takes everything and tells nothing of what became of it.
fn answer_as_a_willing_modem(driver: &mut dyn Driver, now: Instant, step: u32) {
    while let Some(bytes) = driver.poll_output(now) {
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let said = match text.trim() {
            "+++AT?MODE" => "ERROR WRONG FORMAT\r\n".to_owned(),
            "AT?MODE" => "NET\r\n".to_owned(),
            "AT?AL" => "10\r\n".to_owned(),
            "AT?PC" => format!("{}\r\n", step / 50),
            t if t.starts_with("AT?") => {
                let known =
                    [("L", 3), ("AM", 14), ("C", 2), ("ZC", 10), ("ZP", 750), ("RC", 2), ("RT", 4000), ("RI", 0)];
                let value = known.iter().find(|(k, _)| t == format!("AT?{k}")).map_or(0, |(_, v)| *v);
                format!("{}\r\n", if t == "AT?ZI" { 20 } else { value })
            }
            t if t.starts_with("AT") => "OK\r\n".to_owned(),
            t if t.starts_with("$CCCFQ,SRC") => line("CACFG,SRC,10"),
            t if t.starts_with("$CCCFG") => {
                line(t.trim_start_matches("$CC").split('*').next().map_or("", |b| b)).replace('$', "$CA")
            }
            _ => continue,
        };
        let said = if said.starts_with("$CA") && !said.starts_with("$CACFG,SRC") { relined(&said) } else { said };
        driver.handle_bytes(said.as_bytes(), now);
    }
}

fn line(body: &str) -> String {
    String::from_utf8(modem::micromodem::format_sentence(body)).unwrap()
}

/// The same sentence with a right checksum.
fn relined(said: &str) -> String {
    let body = said.trim_start_matches('$').split('*').next().unwrap_or_default().to_owned();
    line(&body)
}
