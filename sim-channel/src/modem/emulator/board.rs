//! The state that every emulated modem has, and the one implementation of [`Emulator`] on top of it; its tasks in order of time,
//! and faults on demand.

use super::serial_line::SerialLine;
use super::{Emulator, Fault, HostId, ModemEvent, Transmission};
use crate::channel::{Arrival, Onset};
use crate::random::RandomStream;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Further hosts share the line of the first one.
const MAX_HOSTS: usize = 64;

/// The lines to the hosts, the scheduled tasks, the random stream, and the events for the surroundings.
#[derive(Debug)]
pub(crate) struct ModemBoard<Task> {
    baud: Option<u32>,
    lines: BTreeMap<HostId, SerialLine>,
    tasks: TaskQueue<Task>,
    pub(crate) rng: RandomStream,
    events: VecDeque<ModemEvent>,
}

impl<Task> ModemBoard<Task> {
    pub(crate) fn new(baud: Option<u32>, rng: RandomStream) -> Self {
        let lines = BTreeMap::from([(HostId::FIRST, SerialLine::new(baud))]);
        Self { baud, lines, tasks: TaskQueue::new(), rng, events: VecDeque::new() }
    }

    pub(crate) fn schedule(&mut self, at: Duration, task: Task) {
        self.tasks.add(at, task);
    }

    pub(crate) fn write_to(&mut self, host: HostId, bytes: &[u8], now: Duration) {
        if let Some(line) = self.lines.get_mut(&host) {
            line.write(bytes, now);
        }
    }

    pub(crate) fn write_to_all(&mut self, bytes: &[u8], now: Duration) {
        self.lines.values_mut().for_each(|line| line.write(bytes, now));
    }

    /// Drops the scheduled tasks; the hosts stay, and bytes already written still reach them.
    pub(crate) fn restart(&mut self) {
        self.tasks = TaskQueue::new();
    }

    pub(crate) fn emit(&mut self, event: ModemEvent) {
        self.events.push_back(event);
    }

    fn next_input(&self) -> Option<Duration> {
        self.lines.values().filter_map(SerialLine::next_input).min()
    }

    fn take_input(&mut self, now: Duration) -> Option<(HostId, Duration, Vec<u8>)> {
        let due = self.next_input().filter(|at| *at <= now)?;
        self.lines.iter_mut().find_map(|(host, line)| {
            let (at, bytes) = line.take_input(due)?;
            Some((*host, at, bytes))
        })
    }

    /// Injects a fault of the lines; false if it is none.
    fn inject(&mut self, fault: Fault, now: Duration) -> bool {
        let Self { lines, rng, .. } = self;
        let mut done = false;
        for line in lines.values_mut() {
            done |= line.inject(fault, rng, now);
        }
        done
    }
}

/// The behaviour of one make of modem.
pub(crate) trait ModemLogic: Send {
    type Task: Send;

    fn board(&self) -> &ModemBoard<Self::Task>;

    fn board_mut(&mut self) -> &mut ModemBoard<Self::Task>;

    /// Bytes of a host have come over its line.
    fn read_host(&mut self, host: HostId, bytes: &[u8], at: Duration);

    fn forget_host(&mut self, _host: HostId) {}

    /// The time of a scheduled task has come.
    fn on_task(&mut self, task: Self::Task, at: Duration);

    fn on_onset(&mut self, _onset: &Onset, _now: Duration) {}

    fn on_arrival(&mut self, arrival: &Arrival, now: Duration);

    fn next_transmission(&mut self, now: Duration) -> Option<Transmission>;

    /// Injects a fault that is not one of the lines.
    fn break_down(&mut self, fault: Fault, now: Duration);
}

impl<M: ModemLogic> Emulator for M {
    fn attach(&mut self) -> HostId {
        let board = self.board_mut();
        let number = (1..).find(|number| !board.lines.contains_key(&HostId(*number))).unwrap_or_default();
        if board.lines.len() >= MAX_HOSTS || number == 0 {
            return HostId::FIRST;
        }
        board.lines.insert(HostId(number), SerialLine::new(board.baud));
        HostId(number)
    }

    fn detach(&mut self, host: HostId) {
        if host != HostId::FIRST && self.board_mut().lines.remove(&host).is_some() {
            self.forget_host(host);
        }
    }

    fn handle_host_bytes(&mut self, host: HostId, bytes: &[u8], now: Duration) {
        if let Some(line) = self.board_mut().lines.get_mut(&host) {
            line.accept(bytes, now);
        }
        self.handle_timeout(now);
    }

    fn host_room(&self, host: HostId) -> usize {
        self.board().lines.get(&host).map_or(0, SerialLine::room)
    }

    fn poll_host_bytes(&mut self, host: HostId, now: Duration) -> Vec<u8> {
        self.board_mut().lines.get_mut(&host).map(|line| line.poll_output(now)).unwrap_or_default()
    }

    fn poll_host_timeout(&self) -> Option<Duration> {
        self.board().lines.values().filter_map(SerialLine::next_output).min()
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
        [board.tasks.next(), board.next_input()].into_iter().flatten().min()
    }

    fn handle_timeout(&mut self, now: Duration) {
        while let Some(due) = self.poll_timeout().filter(|due| *due <= now) {
            if let Some((at, task)) = self.board_mut().tasks.pop(due) {
                self.on_task(task, at);
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

/// CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF.
pub(crate) fn crc16(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (0..8)
            .fold(crc ^ (u16::from(*byte) << 8), |crc, _| if crc & 0x8000 == 0 { crc << 1 } else { crc << 1 ^ 0x1021 })
    })
}

#[derive(Debug)]
pub(super) struct TaskQueue<Task> {
    entries: BTreeMap<(Duration, u64), Task>,
    added: u64,
}

impl<Task> TaskQueue<Task> {
    pub(super) fn new() -> Self {
        Self { entries: BTreeMap::new(), added: 0 }
    }

    pub(super) fn add(&mut self, at: Duration, task: Task) {
        self.added += 1;
        self.entries.insert((at, self.added), task);
    }

    pub(super) fn next(&self) -> Option<Duration> {
        self.entries.keys().next().map(|(at, _)| *at)
    }

    /// The first task due by `now`, with its time.
    pub(super) fn pop(&mut self, now: Duration) -> Option<(Duration, Task)> {
        let entry = self.entries.first_entry().filter(|entry| entry.key().0 <= now)?;
        let ((at, _), task) = entry.remove_entry();
        Some((at, task))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crc_matches_its_check_value() {
        assert_eq!(crc16(b"123456789"), 0x29B1);
    }
}
