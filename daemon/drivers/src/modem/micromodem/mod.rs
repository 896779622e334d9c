//! WHOI Micromodem 1 and 2: frames in packets of a rate, in cycles that the surface's modem begins.
//!
//! The modem requests each frame at the moment of transmission. No data waits inside the modem, so orders need no
//! separate path. Flexible data packets are not used: they need another packet header on all modems, which excludes
//! cycles.

mod cycle;
mod sentence;

pub use sentence::{Sentence, SentenceParser, format_sentence, from_hex, to_hex};

use super::driver::{Class, Destination, Driver, Event, Refusal, Token, check_length};
use cycle::{Cycles, Given};
use scenecast_core::MicromodemRate;
use scenecast_core::ModemAddress;
use scenecast_protocol::link::Cycle;
use scenecast_protocol::mac::{Access, ModemProfile};
use scenecast_protocol::time::Instant;
use std::collections::VecDeque;
use std::time::Duration;

/// Quiet before the modem is spoken to, and after its banner.
const SETTLE: Duration = Duration::from_millis(300);
/// Longest wait for the echo of a sentence.
const REPLY_TIMEOUT: Duration = Duration::from_secs(1);
/// The same at work, where all frames in the modem are forgotten after it.
const REPLY_TIMEOUT_AT_WORK: Duration = Duration::from_secs(2);
/// A line that has been idle for this long brings no reply any more.
const QUIET: Duration = Duration::from_millis(500);
/// Longest wait for a reply while other sentences arrive: the modem may have missed the command.
const MAX_WAIT: Duration = Duration::from_secs(9);
/// Between two questions to a modem at work.
const BEAT: Duration = Duration::from_secs(5);
const AFTER_REFUSAL: Duration = Duration::from_secs(10);
/// Silence after which the port is opened again.
const DEAF: Duration = Duration::from_secs(20);
const HIGHEST: ModemAddress = 127;
const EVERYBODY: ModemAddress = 0;

/// The configuration of a Micromodem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MicromodemConfig {
    /// The address that the modem must have.
    pub address: ModemAddress,
    pub rate: MicromodemRate,
    /// Speed of the serial line, bit/s.
    pub baud: Option<u32>,
}

/// Settings that it needs: statistics of all that is sent and heard, banners, no test data where the host is late, and
/// time for the host to answer.
const SETTINGS: [(&str, &str); 6] =
    [("CST", "1"), ("XST", "1"), ("RXP", "1"), ("REV", "1"), ("ASD", "0"), ("DTO", "5")];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Closed,
    Settling(Instant),
    /// Asks for the address, then writes setting after setting.
    SettingUp(usize),
    Ready,
}

/// A driver for a Micromodem.
#[derive(Debug)]
pub struct Micromodem {
    config: MicromodemConfig,
    phase: Phase,
    parser: SentenceParser,
    /// Until when an answer to a question of ours is waited for.
    asked: Option<Instant>,
    asked_at: Instant,
    beat_at: Instant,
    heard: Instant,
    output: VecDeque<Vec<u8>>,
    events: VecDeque<Event>,
    tokens: Token,
    cycles: Cycles,
    refusal: Option<String>,
}

impl Micromodem {
    /// A driver whose port is not open yet.
    pub fn new(config: MicromodemConfig) -> Self {
        Self {
            config,
            phase: Phase::Closed,
            parser: SentenceParser::default(),
            asked: None,
            asked_at: Instant::ZERO,
            beat_at: Instant::ZERO,
            heard: Instant::ZERO,
            output: VecDeque::new(),
            events: VecDeque::new(),
            tokens: 0,
            cycles: Cycles::default(),
            refusal: None,
        }
    }

    fn say(&mut self, body: &str) {
        self.output.push_back(format_sentence(body));
    }

    fn start_over(&mut self, pause: Duration, now: Instant) {
        self.forget_frames();
        if self.phase == Phase::Ready {
            self.events.push_back(Event::Reset);
        }
        (self.asked, self.phase) = (None, Phase::Settling(now + pause));
        self.output.clear();
    }

    /// All frames in the modem are lost.
    fn forget_frames(&mut self) {
        let given = self.cycles.clear();
        self.events.extend(given.into_iter().map(Event::Unknown));
    }

    fn refuse(&mut self, what: String) {
        if self.refusal.as_ref() != Some(&what) {
            self.refusal = Some(what.clone());
            self.events.push_back(Event::Refused(what));
        }
    }

    fn proceed(&mut self, now: Instant) {
        if self.asked.is_some() {
            return;
        }
        match self.phase {
            Phase::Closed => {}
            Phase::Settling(until) if now < until => {}
            Phase::Settling(_) => {
                self.phase = Phase::SettingUp(0);
                // A line end first: what stands half written in the modem ends here.
                self.output.push_back(b"\r\n".to_vec());
                self.ask("CCCFQ,SRC", now);
            }
            Phase::SettingUp(_) => {}
            Phase::Ready if now >= self.beat_at => {
                self.beat_at = now + BEAT;
                self.ask("CCCFQ,SRC", now);
            }
            Phase::Ready => {}
        }
    }

    fn ask(&mut self, body: &str, now: Instant) {
        self.say(body);
        let wait = if self.phase == Phase::Ready { REPLY_TIMEOUT_AT_WORK } else { REPLY_TIMEOUT };
        (self.asked, self.asked_at) = (Some(now + wait), now);
    }

    fn handle_setting(&mut self, name: &str, value: &str, now: Instant) {
        let ours = self.config.address;
        if name == "SRC" {
            match value.trim().parse::<u8>() {
                Ok(0) => {
                    // Never set: it would not acknowledge.
                    self.ask(&format!("CCCFG,SRC,{ours}"), now);
                    return;
                }
                Ok(found) if found == ours => {}
                _ => {
                    self.refuse(format!(
                        "the modem's address (SRC) is {value} and ours is {ours}: set one of them \
                         (vehicle.address, modem.surface_address, or $CCCFG,SRC,{ours} at the modem)"
                    ));
                    return self.start_over(AFTER_REFUSAL, now);
                }
            }
        }
        match self.phase {
            Phase::SettingUp(done) => {
                let is_next = match done.checked_sub(1) {
                    None => name == "SRC",
                    Some(index) => SETTINGS.get(index) == Some(&(name, value)),
                };
                if is_next {
                    self.next_setting(done, now);
                }
            }
            Phase::Ready => self.asked = None,
            Phase::Closed | Phase::Settling(_) => {}
        }
    }

    fn next_setting(&mut self, done: usize, now: Instant) {
        self.asked = None;
        match SETTINGS.get(done) {
            Some((name, value)) => {
                self.phase = Phase::SettingUp(done + 1);
                self.ask(&format!("CCCFG,{name},{value}"), now);
            }
            None => {
                (self.phase, self.refusal, self.beat_at) = (Phase::Ready, None, now + BEAT);
                self.events.push_back(Event::Ready);
                self.start_again(now);
            }
        }
    }

    /// `CAERR`: a setting that an old modem does not know is left; another complaint ends the cycle that it is about.
    fn handle_complaint(&mut self, now: Instant) {
        match self.phase {
            Phase::SettingUp(done) if done > 0 => self.next_setting(done, now),
            Phase::Ready => self.handle_cycle_refused(now),
            _ => {}
        }
    }

    fn handle_sentence(&mut self, sentence: &Sentence, now: Instant) {
        self.heard = now;
        match sentence.name.as_str() {
            "CACFG" => self.handle_setting(sentence.text(0), sentence.text(1), now),
            "CAREV" if sentence.text(1) == "INIT" => self.start_over(SETTLE, now),
            // What was asked before the last line of its banner, it did not hear.
            "CAREV" if matches!(self.phase, Phase::SettingUp(0)) => self.start_over(SETTLE, now),
            "CAERR" => self.handle_complaint(now),
            _ if self.phase == Phase::Ready => self.handle_traffic(sentence, now),
            // A modem that is left waiting hears nothing.
            "CADRQ" => self.say(&format!("CCTXD,{},{},0,", sentence.text(1), sentence.text(2))),
            _ => {}
        }
    }
}

impl Driver for Micromodem {
    fn profile(&self) -> ModemProfile {
        ModemProfile {
            frame_bytes: self.config.rate.frame_bytes,
            bit_rate_bps: self.config.rate.bits_per_s(),
            overhead_bits: scenecast_core::OVERHEAD_BITS,
            turn_around: Duration::from_millis(300),
            access: Access::Polled,
        }
    }

    fn is_ready(&self) -> bool {
        self.phase == Phase::Ready
    }

    fn send(&mut self, dst: Destination, bytes: Vec<u8>, _class: Class, _now: Instant) -> Result<Token, Refusal> {
        check_length(bytes.len(), self.config.rate.frame_bytes)?;
        let dst = match dst {
            Destination::Everybody => EVERYBODY,
            Destination::Modem(a) if a == self.config.address => {
                return Err(Refusal::NoSuchAddress(dst, "it is the modem's own"));
            }
            Destination::Modem(a) if a == 0 || a > HIGHEST => {
                return Err(Refusal::NoSuchAddress(dst, "addresses are 1 to 127"));
            }
            Destination::Modem(a) => a,
        };
        if self.phase != Phase::Ready {
            return Err(Refusal::NotReady);
        }
        self.tokens += 1;
        self.cycles.offered.push_back(Given { token: self.tokens, dst, bytes });
        self.events.push_back(Event::Accepted(self.tokens));
        Ok(self.tokens)
    }

    fn may_begin_cycle(&self, now: Instant) -> bool {
        self.phase == Phase::Ready && self.cycles.is_free(now)
    }

    fn begin_cycle(&mut self, from: ModemAddress, to: Destination, cycle: Cycle, now: Instant) {
        let to = if let Destination::Modem(to) = to { to } else { EVERYBODY };
        self.start_cycle(from, to, cycle.frames, now);
    }

    fn handle_open(&mut self, now: Instant) {
        self.heard = now;
        self.start_over(SETTLE, now);
    }

    fn handle_closed(&mut self, now: Instant) {
        self.start_over(SETTLE, now);
        self.phase = Phase::Closed;
    }

    fn handle_bytes(&mut self, bytes: &[u8], now: Instant) {
        if self.phase == Phase::Closed {
            return;
        }
        // An answer waits behind what else the modem has to say, which may take seconds on a slow line.
        let latest = self.asked_at + MAX_WAIT;
        self.asked = self.asked.map(|deadline| deadline.max((now + QUIET).min(latest)));
        let mut found = Vec::new();
        self.parser.push(bytes, |sentence| found.push(sentence));
        for sentence in found {
            self.handle_sentence(&sentence, now);
        }
        self.proceed(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.asked.is_some_and(|deadline| deadline <= now) {
            self.start_over(SETTLE, now);
        }
        self.handle_cycle_timeout(now);
        self.proceed(now);
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let next = match (self.asked, self.phase) {
            (_, Phase::Closed) => return None,
            (Some(deadline), _) => Some(deadline),
            (None, Phase::Settling(until)) => Some(until),
            (None, Phase::SettingUp(_)) => None,
            (None, Phase::Ready) => Some(self.beat_at),
        };
        next.into_iter().chain(self.cycles.ends_at()).min()
    }

    fn poll_output(&mut self, now: Instant) -> Option<Vec<u8>> {
        self.answer_request(now);
        self.output.pop_front()
    }

    fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn wants_reopening(&self, now: Instant) -> bool {
        self.phase != Phase::Closed && now.since(self.heard) >= DEAF
    }
}
