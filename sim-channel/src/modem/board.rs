//! What every emulated modem has, and the one way in which all of them are driven.

use super::agenda::Agenda;
use super::port::Port;
use super::{Emulator, Fault, Host, ModemEvent, Transmission};
use crate::{Arrival, Duration, Onset, Stream};
use std::collections::{BTreeMap, VecDeque};

/// More hosts than that at one modem share the first one's line.
const HOST_LIMIT: usize = 64;

/// Lines to the hosts, things to do at known times, chance, and what the surroundings must do.
#[derive(Debug)]
pub(super) struct Board<Event> {
    baud: Option<u32>,
    lines: BTreeMap<Host, Port>,
    agenda: Agenda<Event>,
    pub(super) chance: Stream,
    pub(super) events: VecDeque<ModemEvent>,
}

impl<Event> Board<Event> {
    pub(super) fn new(baud: Option<u32>, chance: Stream) -> Self {
        let lines = BTreeMap::from([(Host::FIRST, Port::new(baud))]);
        Self { baud, lines, agenda: Agenda::new(), chance, events: VecDeque::new() }
    }

    /// Has something to do at a time.
    pub(super) fn plan(&mut self, at: Duration, event: impl Into<Event>) {
        self.agenda.add(at, event.into());
    }

    /// Tells one host.
    pub(super) fn tell(&mut self, host: Host, bytes: &[u8], now: Duration) {
        if let Some(line) = self.lines.get_mut(&host) {
            line.write(bytes, now);
        }
    }

    /// Tells every host.
    pub(super) fn tell_all(&mut self, bytes: &[u8], now: Duration) {
        self.lines.values_mut().for_each(|line| line.write(bytes, now));
    }

    /// Forgets what was planned; the hosts stay, and hear what was already said.
    pub(super) fn restart(&mut self) {
        self.agenda = Agenda::new();
    }

    /// The transmission on air ends in the middle.
    pub(super) fn cut_short(&mut self) {
        self.events.push_back(ModemEvent::CutShort);
    }

    fn next_input(&self) -> Option<Duration> {
        self.lines.values().filter_map(Port::next_input).min()
    }

    fn take_input(&mut self, now: Duration) -> Option<(Host, Duration, Vec<u8>)> {
        let due = self.next_input().filter(|at| *at <= now)?;
        self.lines.iter_mut().find_map(|(host, line)| {
            let (at, bytes) = line.take_input(due)?;
            Some((*host, at, bytes))
        })
    }

    /// Does those faults that are the lines' own; true if this was one.
    fn inject(&mut self, fault: Fault, now: Duration) -> bool {
        let Self { lines, chance, .. } = self;
        let mut done = false;
        for line in lines.values_mut() {
            done |= line.inject(fault, chance, now);
        }
        done
    }
}

/// What one make of modem does; everything else is the same for all.
pub(super) trait Machine: Send {
    /// What it plans.
    type Event: Send;

    /// What it has in common with others.
    fn board(&self) -> &Board<Self::Event>;

    /// What it has in common with others.
    fn board_mut(&mut self) -> &mut Board<Self::Event>;

    /// Bytes of a host have come.
    fn read_host(&mut self, host: Host, bytes: &[u8], at: Duration);

    /// A host is gone.
    fn forget_host(&mut self, _host: Host) {}

    /// The time of a plan has come.
    fn on_event(&mut self, event: Self::Event, at: Duration);

    /// A signal begins.
    fn on_onset(&mut self, _onset: &Onset, _now: Duration) {}

    /// A signal has ended.
    fn on_arrival(&mut self, arrival: &Arrival, now: Duration);

    /// What goes on air now.
    fn next_transmission(&mut self, now: Duration) -> Option<Transmission>;

    /// Breaks what is not the lines'.
    fn break_down(&mut self, fault: Fault, now: Duration);
}

impl<M: Machine> Emulator for M {
    fn attach(&mut self) -> Host {
        let board = self.board_mut();
        let number = (1..).find(|number| !board.lines.contains_key(&Host(*number))).unwrap_or_default();
        if board.lines.len() >= HOST_LIMIT || number == 0 {
            return Host::FIRST;
        }
        board.lines.insert(Host(number), Port::new(board.baud));
        Host(number)
    }

    fn detach(&mut self, host: Host) {
        if host != Host::FIRST && self.board_mut().lines.remove(&host).is_some() {
            self.forget_host(host);
        }
    }

    fn handle_host_bytes(&mut self, host: Host, bytes: &[u8], now: Duration) {
        if let Some(line) = self.board_mut().lines.get_mut(&host) {
            line.accept(bytes, now);
        }
        self.handle_timeout(now);
    }

    fn host_room(&self, host: Host) -> usize {
        self.board().lines.get(&host).map_or(0, Port::room)
    }

    fn poll_host_bytes(&mut self, host: Host, now: Duration) -> Vec<u8> {
        self.board_mut().lines.get_mut(&host).map(|line| line.poll_output(now)).unwrap_or_default()
    }

    fn poll_host_timeout(&self) -> Option<Duration> {
        self.board().lines.values().filter_map(Port::next_output).min()
    }

    fn handle_onset(&mut self, onset: &Onset, now: Duration) {
        self.handle_timeout(now);
        self.on_onset(onset, now);
    }

    fn handle_arrival(&mut self, arrival: &Arrival, now: Duration) {
        self.handle_timeout(now);
        self.on_arrival(arrival, now);
    }

    fn poll_transmit(&mut self, now: Duration) -> Option<Transmission> {
        self.next_transmission(now)
    }

    fn poll_event(&mut self) -> Option<ModemEvent> {
        self.board_mut().events.pop_front()
    }

    fn poll_timeout(&self) -> Option<Duration> {
        let board = self.board();
        [board.agenda.next(), board.next_input()].into_iter().flatten().min()
    }

    fn handle_timeout(&mut self, now: Duration) {
        while let Some(due) = self.poll_timeout().filter(|due| *due <= now) {
            if let Some((at, event)) = self.board_mut().agenda.pop(due) {
                self.on_event(event, at);
            } else if let Some((host, at, bytes)) = self.board_mut().take_input(due) {
                self.read_host(host, &bytes, at);
            }
        }
    }

    fn inject(&mut self, fault: Fault, now: Duration) {
        if !self.board_mut().inject(fault, now) {
            self.break_down(fault, now);
        }
    }
}
