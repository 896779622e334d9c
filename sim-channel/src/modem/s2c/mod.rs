//! EvoLogics S2C: the AT and NET interpreters over an emulated acoustic layer.
//!
//! Syntax, replies and notifications follow what fielded drivers send and parse. The acoustic layer is a model: instant
//! messages with the measured airtimes, and connections with trains of packets, selective acknowledgement and turns.
//!
//! ```text
//!   host -> base::CommandPort -> commands -> messages, burst -> base::Transmitter -> channel
//!   host <- base::CommandPort <- receiver <- dispatch        <- ReceptionLog         <- channel
//! ```

mod base;
mod burst;
mod commands;
mod dispatch;
mod input;
mod messages;
mod receiver;

pub use base::{Interpreter, S2cConfig};

use crate::channel::{Arrival, Onset};
use crate::modem::emulator::board::{ModemBoard, ModemLogic};
use crate::modem::emulator::{Fault, HostId, ModemEvent, Transmission};
use crate::usbl::UsblHead;
use base::{AfterSending, Condition, S2cBase, S2cTask};
use burst::BurstService;
use messages::Messages;
use receiver::{ReceptionLog, UsblReporter};
use std::time::Duration;

/// Airtime of an instant message of `bytes` (1..=64), for schedules and budgets.
///
/// ```
/// assert_eq!(sim_channel::modem::s2c::instant_airtime(64).as_millis(), 858);
/// ```
///
/// Source: a fit to the table of measured durations shipped with a fielded driver, 161 ms + 10.9 ms a byte.
#[must_use]
pub fn instant_airtime(bytes: usize) -> Duration {
    base::timing::instant(bytes)
}

/// An emulated S2C modem with one port, at which there may be several hosts.
///
/// ```
/// use sim_channel::modem::s2c::{Interpreter, S2c, S2cConfig};
/// use sim_channel::modem::{Emulator, HostId};
/// use sim_channel::Duration;
///
/// let config = S2cConfig { interpreter: Interpreter::At, baud: None, ..S2cConfig::new(7) };
/// let mut modem = S2c::new(config);
/// // In data mode, commands and replies are wrapped.
/// modem.handle_host_bytes(HostId::FIRST, b"+++AT?MODE\r", Duration::ZERO);
/// assert_eq!(modem.poll_host_bytes(HostId::FIRST, Duration::ZERO), b"+++AT?MODE:2:AT\r\n");
/// ```
#[derive(Debug)]
pub struct S2c {
    base: S2cBase,
    reception: ReceptionLog,
    usbl: UsblReporter,
    messages: Messages,
    bursts: BurstService,
}

impl S2c {
    /// A modem that has just been switched on and is ready.
    #[must_use]
    pub fn new(config: S2cConfig) -> Self {
        Self {
            reception: ReceptionLog::default(),
            usbl: UsblReporter::new(config.usbl.map(|usbl| UsblHead::new(usbl, config.seed))),
            messages: Messages::default(),
            bursts: BurstService::default(),
            base: S2cBase::new(config),
        }
    }

    /// The present local address, `?AL`.
    #[must_use]
    pub fn address(&self) -> u8 {
        self.base.address()
    }

    fn run(&mut self, task: S2cTask, at: Duration) {
        let Self { base, usbl, messages, bursts, .. } = self;
        match task {
            S2cTask::Sent { dst, label, airtime, then } => {
                let clock = base.clock_us(at);
                base.notify_extended(format!("SENDEND,{dst},{label},{clock},{}", airtime.as_micros()), at);
                self.on_sent(then, at);
            }
            S2cTask::Received(received) => self.on_frame(&received.0, &received.1, at),
            S2cTask::Notify(line) => base.notify(line, at),
            S2cTask::Instant => bursts.offer_air(base, messages, at),
            S2cTask::InstantTimeout { attempt } => {
                if messages.instant.on_timeout(base, attempt, at) {
                    bursts.offer_air(base, messages, at);
                }
            }
            S2cTask::Synchronous { number, late } => messages.synchronous.on_time(base, number, late, at),
            S2cTask::CancelMessages => messages.cancel(base, at),
            S2cTask::ServePool => bursts.serve_pool(base, messages, at),
            S2cTask::RequestTimeout { epoch } => bursts.on_request_timeout(base, messages, epoch, at),
            S2cTask::Turn { number, owes_ack } => bursts.on_turn(base, messages, number, owes_ack, at),
            S2cTask::AckTimeout { number } => bursts.on_ack_timeout(base, messages, number, at),
            S2cTask::Rest { number } => bursts.on_rest(base, number, at),
            S2cTask::Idle { number } => bursts.on_idle(base, number),
            S2cTask::UsblFix(fix) => usbl.on_fix(base, &fix, at),
            S2cTask::Silence(host) => self.on_silence(host, at),
            S2cTask::Reboot => self.reboot(at),
            S2cTask::Booted => base.condition.on_booted(),
        }
    }

    fn on_sent(&mut self, then: AfterSending, now: Duration) {
        let Self { base, messages, bursts, .. } = self;
        match then {
            AfterSending::Done => {}
            AfterSending::Instant(number) => {
                let allowance = bursts.turn_allowance(base);
                messages.instant.on_sent(base, number, allowance, now);
            }
            AfterSending::Train(turn) => bursts.on_train_sent(base, turn, now),
            AfterSending::Acknowledged(turn) => bursts.on_acknowledgement_sent(base, turn, now),
            AfterSending::Request(epoch) => bursts.on_request_sent(base, epoch, now),
            AfterSending::Closed => bursts.on_disconnect_sent(base, messages, now),
        }
    }

    /// A host has been silent: its unfinished input may have another meaning now.
    fn on_silence(&mut self, host: HostId, at: Duration) {
        if let Some(input) = self.base.port.handle_timeout(host, at) {
            self.on_input(input, at);
        }
    }

    /// Restarts with the stored settings; the host's connection ends, messages and data are gone.
    fn reboot(&mut self, now: Duration) {
        if self.base.transmitter.is_busy(now) {
            self.base.board.emit(ModemEvent::CutShort);
        }
        let mut base = S2cBase::new(self.base.config.clone());
        std::mem::swap(&mut base.board, &mut self.base.board);
        base.board.restart();
        base.settings = self.base.stored.clone();
        base.stored = self.base.stored.clone();
        base.condition = Condition::booting();
        base.board.emit(ModemEvent::HangUp);
        base.board.schedule(now + Duration::from_millis(u64::from(base.config.boot_ms)), S2cTask::Booted);
        *self = Self {
            base,
            reception: ReceptionLog::default(),
            usbl: self.usbl.restarted(),
            messages: Messages::default(),
            bursts: BurstService::default(),
        };
    }
}

impl ModemLogic for S2c {
    type Task = S2cTask;

    fn board(&self) -> &ModemBoard<S2cTask> {
        &self.base.board
    }

    fn board_mut(&mut self) -> &mut ModemBoard<S2cTask> {
        &mut self.base.board
    }

    fn read_host(&mut self, host: HostId, bytes: &[u8], at: Duration) {
        if self.base.condition.is_booting() {
            return;
        }
        self.base.port.push(host, bytes, at);
        while let Some(input) = self.base.port.next_input(host) {
            self.on_input(input, at);
        }
        if let Some(end) = self.base.port.timeout(host) {
            self.base.board.schedule(end, S2cTask::Silence(host));
        }
    }

    fn forget_host(&mut self, host: HostId) {
        self.base.port.forget(host);
    }

    fn on_task(&mut self, task: S2cTask, at: Duration) {
        self.run(task, at);
    }

    fn on_onset(&mut self, onset: &Onset, now: Duration) {
        self.reception.on_onset(&mut self.base, onset, now);
    }

    fn on_arrival(&mut self, arrival: &Arrival, now: Duration) {
        self.reception.on_arrival(&mut self.base, arrival, now);
    }

    fn next_transmission(&mut self, now: Duration) -> Option<Transmission> {
        self.base.begin_transmission(now)
    }

    fn break_down(&mut self, fault: Fault, now: Duration) {
        match fault {
            Fault::Busy(length) => self.base.condition.refuse_until(now + length),
            Fault::Reboot | Fault::BrownOut => self.reboot(now),
            Fault::WrongAddress(address) => {
                for settings in [&mut self.base.settings, &mut self.base.stored] {
                    // The modem keeps its address if the new one is out of range.
                    let _ = settings.set("AL", &address.to_string(), false);
                }
            }
            // These are faults of the line.
            Fault::Garbage(_) | Fault::HalfLine | Fault::Freeze(_) => {}
            Fault::BigBuffer => self.base.settings.pool = 1024 * 1024,
        }
    }
}

#[cfg(test)]
mod tests;
