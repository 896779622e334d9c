//! Cycles: who fills the next packet, and its outcome.

use super::{EVERYBODY, Micromodem, Sentence, from_hex, to_hex};
use crate::modem::driver::{Event, Reception, Token};
use bytes::Bytes;
use scenecast_core::ModemAddress;
use scenecast_protocol::time::Instant;
use std::collections::VecDeque;
use std::time::Duration;

/// Farthest that an answer is waited for, one way.
const TRAVEL: Duration = Duration::from_secs(2);
/// Time for modems to decode and turn around, and for hosts to answer.
const SLACK: Duration = Duration::from_secs(2);
/// Time for the modem to decode the end of a packet that it hears.
const DECODING: Duration = Duration::from_millis(500);
/// A vehicle is never so fast that the way to it and back grows by more than a hundredth of the time (7.5 m/s).
const RECEDES: u32 = 100;
/// After a refusal of the modem.
const PAUSE: Duration = Duration::from_secs(1);

/// A frame that the link gave.
#[derive(Debug, Clone)]
pub(super) struct Given {
    pub token: Token,
    pub dst: ModemAddress,
    pub bytes: Vec<u8>,
}

/// A cycle that our modem was ordered to begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Begun {
    from: ModemAddress,
    to: ModemAddress,
    frames: u8,
    ours: bool,
    /// When it was begun, and when it is over at the latest.
    at: Instant,
    until: Instant,
    /// How often it may be begun again, if the modem refuses or forgets it.
    tries: u8,
}

/// A frame that the modem asks for.
#[derive(Debug, Clone, Copy)]
struct Request {
    src: ModemAddress,
    dst: ModemAddress,
}

#[derive(Debug, Default)]
pub(super) struct Cycles {
    begun: Option<Begun>,
    /// The cycle to begin again, after the modem refused it.
    again: Option<Begun>,
    paused: Option<Instant>,
    request: Option<Request>,
    /// Frames that the modem requests of the link; reported once for each cycle.
    polled: bool,
    /// Given by the link, not yet asked for.
    pub offered: VecDeque<Given>,
    taken: Vec<Token>,
    /// When the packet with `taken` has left at the latest.
    leaves: Option<Instant>,
    /// From the beginning of a cycle to that of its packet, as the last one that was answered showed, and when that was.
    answered: Option<(Duration, Instant)>,
}

impl Cycles {
    /// Forgets everything; returns the tokens.
    pub(super) fn clear(&mut self) -> Vec<Token> {
        let offered = std::mem::take(&mut self.offered).into_iter().map(|given| given.token);
        let tokens: Vec<Token> = std::mem::take(&mut self.taken).into_iter().chain(offered).collect();
        let again = self.begun.filter(|b| b.tries > 0 && !self.polled).or(self.again);
        *self = Self { again, answered: self.answered, ..Self::default() };
        tokens
    }

    /// How long the packet of a cycle of somebody else is waited for, if it ever was heard.
    fn patience(&self, now: Instant) -> Option<Duration> {
        self.answered.map(|(took, at)| took + SLACK + now.since(at) / RECEDES)
    }

    pub(super) fn is_free(&self, now: Instant) -> bool {
        self.begun.is_none()
            && self.again.is_none()
            && self.taken.is_empty()
            && self.paused.is_none_or(|until| now >= until)
    }

    pub(super) fn ends_at(&self) -> Option<Instant> {
        self.begun.map(|b| b.until).into_iter().chain(self.leaves).chain(self.paused).min()
    }
}

impl Micromodem {
    pub(super) fn start_cycle(&mut self, from: ModemAddress, to: ModemAddress, frames: u32, now: Instant) {
        const TRIES: u8 = 30;
        self.start(from, to, frames.clamp(1, u32::from(self.config.rate.frames)) as u8, TRIES, now);
    }

    /// Begins a cycle again that the modem refused, or lost in a restart.
    pub(super) fn start_again(&mut self, now: Instant) {
        if let Some(b) = self.cycles.again.take() {
            self.start(b.from, b.to, b.frames, b.tries - 1, now);
        }
    }

    fn start(&mut self, from: ModemAddress, to: ModemAddress, frames: u8, tries: u8, now: Instant) {
        let rate = self.config.rate;
        let ours = from == self.config.address;
        let travel = if ours { Duration::ZERO } else { TRAVEL * 2 };
        let most = scenecast_core::CYCLE_INIT + travel + self.fill_time() + rate.packet() + SLACK;
        let wait = self.cycles.patience(now).filter(|_| !ours).map_or(most, |patience| patience.min(most));
        self.cycles.begun = Some(Begun { from, to, frames, ours, at: now, until: now + wait, tries });
        self.cycles.polled = false;
        self.say(&format!("CCCYC,0,{from},{to},{},0,{frames}", rate.number));
    }

    /// Time that a full packet takes over the serial line, in hex, both ways.
    fn fill_time(&self) -> Duration {
        let rate = self.config.rate;
        let characters = (rate.frame_bytes * 2 + 100) * usize::from(rate.frames) * 2;
        self.config
            .baud
            .map_or(Duration::ZERO, |baud| Duration::from_secs_f64(characters as f64 * 10.0 / f64::from(baud)))
    }

    /// The frame that the modem has asked for, if the link has given one; else there is no more.
    pub(super) fn answer_request(&mut self, now: Instant) {
        let Some(Request { src, dst }) = self.cycles.request.take() else { return };
        let next = self.cycles.offered.pop_front_for(dst);
        let hex = next.as_ref().map_or(String::new(), |given| to_hex(&given.bytes));
        self.say(&format!("CCTXD,{src},{dst},0,{hex}"));
        if let Some(given) = next {
            self.cycles.taken.push(given.token);
            self.cycles.leaves = Some(now + self.fill_time() + self.config.rate.packet() + SLACK * 2);
        } else if self.cycles.taken.is_empty() && self.cycles.begun.is_some_and(|b| b.ours) {
            self.cycles.begun = None;
        }
    }

    /// A sentence of a modem at work.
    pub(super) fn handle_traffic(&mut self, s: &Sentence, now: Instant) {
        match s.name.as_str() {
            "CADRQ" => self.handle_request(s),
            "CACYC" => self.handle_cycle(s),
            "CARXD" => self.handle_frame(s),
            "CARXP" => self.handle_packet(now),
            // Without bytes it was a cycle init that left.
            "CATXF" if !self.cycles.taken.is_empty() && s.number::<u32>(0) != Some(0) => self.handle_left(),
            "CACST" => self.handle_statistics(s),
            "CAMPR" => self.handle_ping(s),
            _ => {}
        }
    }

    fn handle_request(&mut self, s: &Sentence) {
        let (Some(src), Some(dst)) = (s.number(1), s.number(2)) else { return };
        self.cycles.request = Some(Request { src, dst });
        if !std::mem::replace(&mut self.cycles.polled, true) {
            let own = self.cycles.begun.filter(|b| b.ours).map(|b| b.frames);
            let frames = own.unwrap_or(self.config.rate.frames);
            self.events.push_back(Event::Poll(frames.into()));
        }
    }

    /// Somebody wants us to send, unless it is the echo of our own cycle: the requests that follow are of a new cycle.
    fn handle_cycle(&mut self, s: &Sentence) {
        let own = s.number(1) == Some(self.config.address);
        if own && self.cycles.begun.is_none() && self.cycles.request.is_none() && self.cycles.taken.is_empty() {
            self.cycles.polled = false;
        }
    }

    /// A packet begins to be heard: if it is the one that we have asked for, it is waited out.
    fn handle_packet(&mut self, now: Instant) {
        let packet = self.config.rate.packet() + self.fill_time() + DECODING;
        if let Some(begun) = self.cycles.begun.as_mut().filter(|b| !b.ours) {
            self.cycles.answered = Some((now.since(begun.at), now));
            begun.until = begun.until.max(now + packet);
        }
    }

    fn handle_frame(&mut self, s: &Sentence) {
        let (Some(src), Some(dst)) = (s.number::<u8>(0), s.number::<u8>(1)) else { return };
        if src == self.config.address {
            let ours = self.config.address;
            return self.refuse(format!("another modem in the water has our address {ours}"));
        }
        let bytes = from_hex(s.text(4)).filter(|b| (1..=self.config.rate.frame_bytes).contains(&b.len()));
        let Some(bytes) = bytes.filter(|_| dst == self.config.address || dst == EVERYBODY) else { return };
        let reception = Reception { src: Some(src), bytes: Bytes::from(bytes), quality: None, range_m: None };
        self.events.push_back(Event::Received(reception));
    }

    fn handle_left(&mut self) {
        let taken = std::mem::take(&mut self.cycles.taken);
        self.events.extend(taken.into_iter().map(Event::Sent));
        self.cycles.leaves = None;
        self.drop_offered();
        self.cycles.polled = false;
        if self.cycles.begun.is_some_and(|b| b.ours) {
            self.cycles.begun = None;
        }
    }

    /// A frame that the modem never requested is not on air.
    fn drop_offered(&mut self) {
        let left = std::mem::take(&mut self.cycles.offered);
        self.events.extend(left.into_iter().map(|given| Event::Failed(given.token)));
    }

    /// Every reception ends with its statistics: that of data ends the cycle that we have asked for.
    fn handle_statistics(&mut self, s: &Sentence) {
        const DATA: [i32; 2] = [1, 3];
        // Newer layouts begin with their version, which is beyond every mode.
        let is_new = s.number::<i32>(0).is_some_and(|first| first >= 6);
        let kind = s.number::<i32>(if is_new { 17 } else { 16 });
        let is_data = kind.is_some_and(|kind| DATA.contains(&kind));
        if is_data && self.cycles.begun.is_some_and(|b| !b.ours) {
            self.cycles.begun = None;
        }
    }

    /// `$CAMPR,<src>,<dst>,<one-way travel, s>`: somebody has pinged by hand.
    fn handle_ping(&mut self, s: &Sentence) {
        let travel = s.number::<f64>(2).filter(|t| t.is_finite() && (0.0..60.0).contains(t));
        if let (Some(remote), Some(travel)) = (s.number(0), travel) {
            let range_m = Some(travel * 1500.0);
            let line = scenecast_core::UsblLine { remote, range_m, direction_rad: None, accuracy: 1.0, age_s: travel };
            self.events.push_back(Event::Usbl(line));
        }
    }

    /// The modem reports an error: the last command failed.
    pub(super) fn handle_cycle_refused(&mut self, now: Instant) {
        self.cycles.paused = Some(now + PAUSE);
        if self.cycles.taken.is_empty() {
            self.drop_offered();
            self.cycles.again = self.cycles.begun.filter(|b| b.tries > 0 && !self.cycles.polled);
            (self.cycles.begun, self.cycles.request, self.cycles.polled) = (None, None, false);
        }
    }

    pub(super) fn handle_cycle_timeout(&mut self, now: Instant) {
        if self.cycles.paused.is_some_and(|until| until <= now) {
            self.cycles.paused = None;
            self.start_again(now);
        }
        if self.cycles.leaves.is_some_and(|until| until <= now) {
            let taken = std::mem::take(&mut self.cycles.taken);
            self.events.extend(taken.into_iter().map(Event::Unknown));
            self.cycles.leaves = None;
            self.cycles.polled = false;
            self.drop_offered();
        }
        if self.cycles.begun.is_some_and(|b| b.until <= now) {
            self.cycles.begun = None;
            self.cycles.polled = false;
        }
    }
}

/// The next frame for a destination; others wait for a cycle of theirs.
trait TakeFor {
    fn pop_front_for(&mut self, dst: ModemAddress) -> Option<Given>;
}

impl TakeFor for VecDeque<Given> {
    fn pop_front_for(&mut self, dst: ModemAddress) -> Option<Given> {
        let index = self.iter().position(|given| given.dst == dst)?;
        self.remove(index)
    }
}
