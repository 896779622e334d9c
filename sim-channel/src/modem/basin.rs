//! A test basin: several emulated modems on one channel.

use super::{Emulator, Fault, HostId, ModemEvent};
use crate::channel::{Channel, Interferer};
use crate::nodes::NodeId;
use std::collections::BTreeMap;
use std::time::Duration;

/// A test basin: a channel and the emulated modems in it. It moves bytes between them in order of time.
///
/// ```
/// use sim_channel::modem::Basin;
/// use sim_channel::modem::transparent::{Transparent, TransparentConfig};
/// use sim_channel::{Channel, ChannelConfig, Duration, NodeId, NodePosition};
///
/// let mut basin = Basin::new(Channel::new(ChannelConfig::default(), 1));
/// for node in [1, 2] {
///     basin.channel().place(NodeId(node), NodePosition::new(750.0 * f64::from(node), 0.0, 0.0));
///     basin.add(NodeId(node), Box::new(Transparent::new(TransparentConfig::default())));
/// }
/// basin.handle_host_bytes(NodeId(1), b"hello", Duration::ZERO);
///
/// let mut received = Vec::new();
/// while let Some(at) = basin.poll_timeout() {
///     basin.advance(at);
///     received.extend(basin.poll_host_bytes(NodeId(2)));
/// }
/// assert_eq!(received, b"hello");
/// ```
///
/// The host loop is: write with [`handle_host_bytes`](Self::handle_host_bytes), pass time with
/// [`advance`](Self::advance) at each [`poll_timeout`](Self::poll_timeout), and read with
/// [`poll_host_bytes`](Self::poll_host_bytes).
pub struct Basin {
    channel: Channel,
    modems: BTreeMap<NodeId, Box<dyn Emulator>>,
    interferers: Vec<Interferer>,
    on_air: BTreeMap<NodeId, u64>,
    hung_up: Vec<NodeId>,
    now: Duration,
}

impl Basin {
    /// A basin without modems. Place the nodes in the channel before their modems transmit.
    #[must_use]
    pub fn new(mut channel: Channel) -> Self {
        channel.report_onsets();
        Self {
            channel,
            modems: BTreeMap::new(),
            interferers: Vec::new(),
            on_air: BTreeMap::new(),
            hung_up: Vec::new(),
            now: Duration::ZERO,
        }
    }

    /// Adds the modem of a node and replaces the one that it had.
    pub fn add(&mut self, node: NodeId, modem: Box<dyn Emulator>) {
        self.modems.insert(node, modem);
    }

    /// Adds an interferer; its node must be placed in the channel.
    pub fn add_interferer(&mut self, interferer: Interferer) {
        self.interferers.push(interferer);
    }

    /// The channel, to place nodes or to change its conditions.
    pub fn channel(&mut self) -> &mut Channel {
        &mut self.channel
    }

    /// The latest time that a call has passed in.
    #[must_use]
    pub fn now(&self) -> Duration {
        self.now
    }

    /// Attaches another host to the modem of `node`; returns the first host if the node has no modem.
    pub fn attach(&mut self, node: NodeId) -> HostId {
        self.modems.get_mut(&node).map_or(HostId::FIRST, |modem| modem.attach())
    }

    /// Detaches a host from the modem of `node`; the first host always stays.
    pub fn detach(&mut self, node: NodeId, host: HostId) {
        if let Some(modem) = self.modems.get_mut(&node) {
            modem.detach(host);
        }
    }

    /// Takes the bytes that the first host of `node` wrote at `now`. They are dropped if the node has no modem.
    pub fn handle_host_bytes(&mut self, node: NodeId, bytes: &[u8], now: Duration) {
        self.handle_bytes_from(node, HostId::FIRST, bytes, now);
    }

    /// Takes the bytes that `host` of `node` wrote at `now`. They are dropped if the node has no modem.
    pub fn handle_bytes_from(&mut self, node: NodeId, host: HostId, bytes: &[u8], now: Duration) {
        self.advance(now);
        if let Some(modem) = self.modems.get_mut(&node) {
            modem.handle_host_bytes(host, bytes, now);
        }
        self.run_due(now);
    }

    /// Number of bytes that the first host of `node` may write now; more would be lost.
    #[must_use]
    pub fn host_room(&self, node: NodeId) -> usize {
        self.modems.get(&node).map_or(0, |modem| modem.host_room(HostId::FIRST))
    }

    /// Takes the bytes that have reached the first host of `node` by [`now`](Self::now).
    #[must_use]
    pub fn poll_host_bytes(&mut self, node: NodeId) -> Vec<u8> {
        self.poll_bytes_for(node, HostId::FIRST)
    }

    /// Takes the bytes that have reached `host` of `node` by [`now`](Self::now).
    #[must_use]
    pub fn poll_bytes_for(&mut self, node: NodeId, host: HostId) -> Vec<u8> {
        let now = self.now;
        self.modems.get_mut(&node).map(|modem| modem.poll_host_bytes(host, now)).unwrap_or_default()
    }

    /// The next node whose modem closes the TCP connections of its hosts, as an S2C does when it restarts.
    #[must_use]
    pub fn poll_hang_up(&mut self) -> Option<NodeId> {
        self.hung_up.pop()
    }

    /// Injects a fault into the modem of `node` at `now`.
    pub fn inject(&mut self, node: NodeId, fault: Fault, now: Duration) {
        self.advance(now);
        if let Some(modem) = self.modems.get_mut(&node) {
            modem.inject(fault, now);
        }
        self.run_due(now);
    }

    /// Time of the next event; a host may have bytes to read then.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Duration> {
        let hosts = self.modems.values().filter_map(|modem| modem.poll_host_timeout());
        self.next_due().into_iter().chain(hosts).min()
    }

    /// Passes time up to `now`; each event happens at its own time.
    ///
    /// Bytes that reach a host meanwhile wait until they are polled.
    pub fn advance(&mut self, now: Duration) {
        while let Some(at) = self.next_due().filter(|at| *at <= now) {
            self.run_due(at);
        }
        self.run_due(now);
    }

    /// Time of the next event of a modem, an interferer or the channel.
    fn next_due(&self) -> Option<Duration> {
        let interferers = self.interferers.iter().filter_map(Interferer::poll_timeout);
        let modems = self.modems.values().filter_map(|modem| modem.poll_timeout());
        modems.chain(self.channel.poll_timeout()).chain(interferers).min()
    }

    /// Runs all events that are due at `now`, and those that they cause.
    fn run_due(&mut self, now: Duration) {
        self.now = self.now.max(now);
        for interferer in &mut self.interferers {
            if let Some((bytes, airtime)) = interferer.poll_transmit(now) {
                self.channel.transmit(interferer.node(), bytes, airtime, now);
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
    fn basin_can_move_to_another_thread() {
        fn sendable<T: Send>() {}
        sendable::<Basin>();
    }
}
