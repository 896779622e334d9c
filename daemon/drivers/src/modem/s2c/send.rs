//! The next transmission for an S2C modem and its reply, and the queues in front of the modem.

use super::dialogue::{Job, Message, Pending};
use super::setup::{INSTANT_BYTES, S2cMode, instant_airtime};
use super::{EVERYBODY, S2c};
use crate::modem::driver::{Class, Event, Token};
use crate::modem::framing::encode;
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// Interval between two tries of a message that the modem refuses for now.
const RETRY: Duration = Duration::from_millis(500);
/// Between two tries of a record that the pool has no room for.
const FULL: Duration = Duration::from_secs(1);
/// A transmission refused for longer is given up.
const MAX_REFUSAL: Duration = Duration::from_secs(60);
/// Times that a command goes out.
const TRIES: u32 = 3;
/// A message may wait for so long for its turn in a connection.
const TURN: Duration = Duration::from_secs(45);
/// Without connections it goes out at once, but for another one that is just heard.
const AT_ONCE: Duration = Duration::from_secs(5);
/// A record without a report for this long counts as unknown.
const RECORD_LIFE: Duration = Duration::from_secs(180);

impl S2c {
    /// Gives the modem its most urgent transmission; returns whether there was one.
    pub(super) fn send_next(&mut self, now: Instant) -> bool {
        let slot = self.jobs.message.is_none() && now >= self.jobs.message_pause;
        if slot && let Some(job) = self.jobs.commands.pop_front() {
            let fits = job.bytes.len() <= INSTANT_BYTES;
            return match fits {
                // Both go out in the same turn of the connection: one of them gets through where the other does not.
                true if self.rides(&job, now) => self.send_piggyback(job, Pending::Copy, now),
                true => self.send_message(job, self.config.mode == S2cMode::Burst, now),
                false => self.send_record(job, now),
            };
        }
        if let Some(job) = self.jobs.services.pop_front() {
            if self.rides(&job, now) && job.bytes.len() <= INSTANT_BYTES {
                return self.send_piggyback(job, Pending::Piggyback, now);
            }
            if slot {
                let fits = job.bytes.len() <= INSTANT_BYTES;
                return if fits { self.send_message(job, false, now) } else { self.send_record(job, now) };
            }
            self.jobs.services.push_front(job);
        }
        let Some(front) = self.jobs.bulk.front() else { return false };
        // What overtakes bulk in the modem would make that look lost.
        let alone = self.jobs.is_pool_empty() && self.jobs.bulk.len() == 1;
        let as_message = self.config.mode == S2cMode::Instant
            || front.dst == EVERYBODY
            || (alone && front.bytes.len() <= INSTANT_BYTES);
        let own_message = self.jobs.message.as_ref().is_some_and(|m| m.job.class == Class::Bulk);
        let may = if as_message { slot } else { now >= self.jobs.record_pause && !own_message };
        if !may {
            return false;
        }
        let Some(job) = self.jobs.bulk.pop_front() else { return false };
        if as_message { self.send_message(job, false, now) } else { self.send_record(job, now) }
    }

    fn send_message(&mut self, job: Job, acked: bool, now: Instant) -> bool {
        let acked = acked && job.dst != EVERYBODY;
        let flag = if acked { "ack" } else { "noack" };
        let head = format!("*SENDIM,{},{},{flag},", job.bytes.len(), job.dst);
        let command = [head.as_bytes(), &job.bytes].concat();
        self.request(&command, Pending::Message(job, acked), now);
        true
    }

    /// Whether the modem will send something to this one soon.
    fn rides(&self, job: &Job, now: Instant) -> bool {
        self.streams.carries_piggyback_to(job.dst, now)
    }

    fn send_piggyback(&mut self, job: Job, pending: impl FnOnce(Job) -> Pending, now: Instant) -> bool {
        let head = format!("*SENDPBM,{},{},", job.bytes.len(), job.dst);
        let command = [head.as_bytes(), &job.bytes].concat();
        self.request(&command, pending(job), now);
        true
    }

    fn send_record(&mut self, job: Job, now: Instant) -> bool {
        let record = encode(&job.bytes);
        let head = format!("*SEND,{},{},", record.len(), job.dst);
        let command = [head.as_bytes(), &record].concat();
        self.request(&command, Pending::Record(job), now);
        true
    }

    /// The reply to a transmission.
    pub(super) fn handle_send_reply(&mut self, pending: Pending, reply: &str, now: Instant) {
        let taken = matches!(reply, "OK" | "[*]OK");
        match pending {
            Pending::Message(job, acked) if taken => {
                self.events.push_back(Event::Accepted(job.token));
                let wait = if self.config.mode == S2cMode::Instant { AT_ONCE } else { TURN };
                let until = now + instant_airtime(job.bytes.len()) + wait;
                self.jobs.message = Some(Message { job, acked, until });
            }
            Pending::Copy(job) => {
                if taken {
                    self.events.push_back(Event::Repeated(instant_bits(&job)));
                }
                // An acknowledgement that is lost would hold up the next command for as long as a train and more.
                self.send_message(job, !taken, now);
            }
            Pending::Piggyback(job) if taken => {
                self.events.push_back(Event::Accepted(job.token));
                // It goes with the next frame to this modem, or a newer one does.
                self.events.push_back(Event::Sent(job.token));
            }
            Pending::Record(job) if taken => {
                self.events.push_back(Event::Accepted(job.token));
                self.airtime.give(job.bytes.len());
                self.request(b"?PC", Pending::Count(job.token), now);
            }
            Pending::Message(job, _) | Pending::Piggyback(job) | Pending::Record(job) => {
                self.handle_refusal(job, reply, now)
            }
            Pending::Count(token) => match reply.parse() {
                Ok(count) => self.pool_record(token, count, now),
                Err(_) => {
                    self.events.push_back(Event::Unknown(token));
                    self.start_over(super::SETTLE, now);
                }
            },
            Pending::Interpreter | Pending::Mode | Pending::Setup(_) | Pending::Beat(_) => {}
        }
    }

    /// A record is in the pool under this number.
    fn pool_record(&mut self, token: Token, count: u32, now: Instant) {
        let restarted = self.supervision.counter().is_some_and(|last| count <= last && last - count < 30_000);
        self.supervision.set_counter(Some(count));
        if restarted {
            self.events.push_back(Event::Unknown(token));
            return self.start_over(super::SETTLE, now);
        }
        self.jobs.pool.insert(count, (token, now));
    }

    fn handle_refusal(&mut self, mut job: Job, reply: &str, now: Instant) {
        let for_now = reply.starts_with("BUSY") || reply == "ERROR BUFFER FULL" || reply == "ERROR BUFFER IS NOT EMPTY";
        let since = *job.refused.get_or_insert(now);
        if !for_now || now.since(since) >= MAX_REFUSAL {
            if !for_now {
                self.refuse(format!("the modem refuses a message to {}: {reply}", job.dst));
            }
            self.events.push_back(Event::Failed(job.token));
            return;
        }
        if since == now {
            self.events.push_back(Event::Busy(job.token));
        }
        let pause = if reply.starts_with("BUSY") { RETRY } else { FULL };
        self.jobs.message_pause = now + RETRY;
        self.jobs.record_pause = now + pause;
        self.jobs.put_back(job);
    }

    /// A message has left: one that needs no acknowledgement is done.
    pub(super) fn handle_message_sent(&mut self) {
        if let Some(message) = self.jobs.message.take_if(|m| !m.acked) {
            self.events.push_back(Event::Sent(message.job.token));
        }
    }

    /// The other modem has acknowledged the message, or was not heard to.
    pub(super) fn handle_message_done(&mut self, delivered: bool) {
        let Some(Message { mut job, .. }) = self.jobs.message.take_if(|m| m.acked) else { return };
        if delivered {
            self.events.push_back(Event::Delivered(job.token));
            return;
        }
        job.tries += 1;
        if job.tries < TRIES {
            self.events.push_back(Event::Repeated(instant_bits(&job)));
            self.jobs.commands.push_front(job);
        } else {
            self.events.push_back(Event::Failed(job.token));
        }
    }

    /// Gives up transmissions without a report for too long.
    pub(super) fn give_up_late(&mut self, now: Instant) {
        if let Some(message) = self.jobs.message.take_if(|m| m.until <= now) {
            self.events.push_back(Event::Unknown(message.job.token));
        }
        while let Some((count, token)) = self.oldest_record(now) {
            self.jobs.pool.remove(&count);
            self.events.push_back(Event::Unknown(token));
        }
    }

    fn oldest_record(&self, now: Instant) -> Option<(u32, Token)> {
        let late = |(_, (_, at)): &(&u32, &(Token, Instant))| now.since(*at) >= RECORD_LIFE;
        self.jobs.pool.iter().find(late).map(|(&count, &(token, _))| (count, token))
    }

    /// When queued transmissions may be tried again, if only a pause holds them back.
    pub(super) fn next_try(&self) -> Option<Instant> {
        let waits = !(self.jobs.commands.is_empty() && self.jobs.services.is_empty() && self.jobs.bulk.is_empty());
        let free = self.dialogue.is_idle() && self.jobs.message.is_none();
        let pause = self.jobs.message_pause.max(self.jobs.record_pause);
        (waits && free && self.is_at_work()).then_some(pause)
    }
}

fn instant_bits(job: &Job) -> u64 {
    job.bytes.len() as u64 * 8 + super::setup::INSTANT_OVERHEAD_BITS
}
