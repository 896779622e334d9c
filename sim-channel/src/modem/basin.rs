//! Modems in one water: moves bytes between emulators and channel in order of time.

use super::{Emulator, Fault, Host, ModemEvent};
use crate::channel::{Channel, Talker};
use crate::nodes::NodeId;
use std::collections::BTreeMap;
use std::time::Duration;

/// A channel and the emulated modems in it.
pub struct Basin {
    channel: Channel,
    modems: BTreeMap<NodeId, Box<dyn Emulator>>,
    talkers: Vec<Talker>,
    on_air: BTreeMap<NodeId, u64>,
    hung_up: Vec<NodeId>,
    now: Duration,
}

impl Basin {
    /// The water alone; place nodes in the channel before their modems speak.
    pub fn new(mut channel: Channel) -> Self {
        channel.tell_onsets();
        Self {
            channel,
            modems: BTreeMap::new(),
            talkers: Vec::new(),
            on_air: BTreeMap::new(),
            hung_up: Vec::new(),
            now: Duration::ZERO,
        }
    }

    /// Adds the modem of a node, replacing the one it had.
    pub fn add(&mut self, node: NodeId, modem: Box<dyn Emulator>) {
        self.modems.insert(node, modem);
    }

    /// Adds a stranger who talks at random and understands nobody; place its node in the channel.
    pub fn add_talker(&mut self, talker: Talker) {
        self.talkers.push(talker);
    }

    /// The water, to move nodes or to change its conditions.
    pub fn channel(&mut self) -> &mut Channel {
        &mut self.channel
    }

    /// The latest time that was passed in.
    pub fn now(&self) -> Duration {
        self.now
    }

    /// Another host at the modem of `node`; the first if it has no modem.
    pub fn attach(&mut self, node: NodeId) -> Host {
        self.modems.get_mut(&node).map_or(Host::FIRST, |modem| modem.attach())
    }

    /// A host is gone.
    pub fn detach(&mut self, node: NodeId, host: Host) {
        if let Some(modem) = self.modems.get_mut(&node) {
            modem.detach(host);
        }
    }

    /// What the first host of `node` wrote at `now`; nothing happens if it has no modem.
    pub fn handle_host_bytes(&mut self, node: NodeId, bytes: &[u8], now: Duration) {
        self.handle_bytes_of(node, Host::FIRST, bytes, now);
    }

    /// What a host of `node` wrote at `now`; nothing happens if it has no modem.
    pub fn handle_bytes_of(&mut self, node: NodeId, host: Host, bytes: &[u8], now: Duration) {
        self.advance(now);
        if let Some(modem) = self.modems.get_mut(&node) {
            modem.handle_host_bytes(host, bytes, now);
        }
        self.settle(now);
    }

    /// How many bytes the first host of `node` may write.
    pub fn host_room(&self, node: NodeId) -> usize {
        self.modems.get(&node).map_or(0, |modem| modem.host_room(Host::FIRST))
    }

    /// What has reached the first host of `node` by the present.
    pub fn poll_host_bytes(&mut self, node: NodeId) -> Vec<u8> {
        self.poll_bytes_for(node, Host::FIRST)
    }

    /// What has reached a host of `node` by the present.
    pub fn poll_bytes_for(&mut self, node: NodeId, host: Host) -> Vec<u8> {
        let now = self.now;
        self.modems.get_mut(&node).map(|modem| modem.poll_host_bytes(host, now)).unwrap_or_default()
    }

    /// A node whose modem closes the TCP connections of its hosts.
    pub fn poll_hang_up(&mut self) -> Option<NodeId> {
        self.hung_up.pop()
    }

    /// Breaks something of the modem of `node`.
    pub fn inject(&mut self, node: NodeId, fault: Fault, now: Duration) {
        self.advance(now);
        if let Some(modem) = self.modems.get_mut(&node) {
            modem.inject(fault, now);
        }
        self.settle(now);
    }

    /// When something will happen next; a host may have bytes to read then.
    pub fn poll_timeout(&self) -> Option<Duration> {
        let hosts = self.modems.values().filter_map(|modem| modem.poll_host_timeout());
        self.next_due().into_iter().chain(hosts).min()
    }

    /// Lets time pass up to `now`, every event at its own time.
    ///
    /// Host bytes that fall due on the way wait to be polled.
    pub fn advance(&mut self, now: Duration) {
        while let Some(at) = self.next_due().filter(|at| *at <= now) {
            self.settle(at);
        }
        self.settle(now);
    }

    /// When a modem or the water has something to do.
    fn next_due(&self) -> Option<Duration> {
        let talkers = self.talkers.iter().filter_map(Talker::poll_timeout);
        let modems = self.modems.values().filter_map(|modem| modem.poll_timeout());
        modems.chain(self.channel.poll_timeout()).chain(talkers).min()
    }

    /// Does everything that is due at `now`, until nothing is.
    fn settle(&mut self, now: Duration) {
        self.now = self.now.max(now);
        for talker in &mut self.talkers {
            if let Some((bytes, airtime)) = talker.poll_transmit(now) {
                self.channel.transmit(talker.node(), bytes, airtime, now);
            }
        }
        loop {
            let mut quiet = true;
            while let Some(onset) = self.channel.poll_onset(now) {
                if let Some(modem) = self.modems.get_mut(&onset.to) {
                    modem.handle_onset(&onset, now);
                }
            }
            while let Some(arrival) = self.channel.poll_arrival(now) {
                quiet = false;
                if let Some(modem) = self.modems.get_mut(&arrival.to) {
                    modem.handle_arrival(&arrival, now);
                }
            }
            for (node, modem) in &mut self.modems {
                modem.handle_timeout(now);
                while let Some(event) = modem.poll_event() {
                    match event {
                        ModemEvent::HangUp => self.hung_up.push(*node),
                        ModemEvent::CutShort => {
                            if let Some(transmission) = self.on_air.get(node) {
                                self.channel.cut_short(*transmission, now);
                            }
                        }
                    }
                }
                while let Some(out) = modem.poll_transmit(now) {
                    quiet = false;
                    self.on_air.insert(*node, self.channel.transmit(*node, out.bytes, out.airtime, now));
                }
            }
            if quiet {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_basin_may_live_on_another_thread() {
        fn sendable<T: Send>() {}
        sendable::<Basin>();
    }
}
