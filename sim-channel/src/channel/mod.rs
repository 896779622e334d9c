//! The acoustic channel: when each node receives each transmission, and which receptions are lost.

mod config;
mod link;
pub mod presets;
mod reception;

pub use config::{ChannelConfig, Outage, OutageScope};
pub use link::Interferer;
pub use reception::{Arrival, LossReason, Onset, ReceptionOutcome};

use crate::loss::{FrameContext, FrameFate, LossModel};
use crate::nodes::{NodeId, NodePosition, Track};
use link::DirectedLink;
use reception::{Reception, Span};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// An acoustic channel between placed nodes, in virtual time.
///
/// ```
/// use sim_channel::{Channel, ChannelConfig, Duration, NodeId, NodePosition};
///
/// let mut channel = Channel::new(ChannelConfig::default(), 7);
/// channel.place(NodeId(1), NodePosition::new(0.0, 0.0, 0.0));
/// channel.place(NodeId(2), NodePosition::new(1500.0, 0.0, 0.0));
/// channel.transmit(NodeId(1), vec![1, 2, 3], Duration::from_millis(500), Duration::from_secs(10));
///
/// // 1500 m at 1500 m/s take one second, the frame itself half a second.
/// assert_eq!(channel.poll_timeout(), Some(Duration::from_millis(11_500)));
/// let arrival = channel.poll_arrival(Duration::from_millis(11_500)).unwrap();
/// assert_eq!((arrival.to, arrival.range_m), (NodeId(2), 1500.0));
/// assert!(channel.poll_timeout().is_none());
/// ```
///
/// Every call takes a `now` that never goes back. A transmission that begins before a time must be put on air before
/// arrivals are polled at that time, because it may collide with them.
#[derive(Debug)]
pub struct Channel {
    config: ChannelConfig,
    seed: u64,
    positions: BTreeMap<NodeId, NodePosition>,
    tracks: BTreeMap<NodeId, Track>,
    links: BTreeMap<(NodeId, NodeId), DirectedLink>,
    own_loss: BTreeMap<(NodeId, NodeId), LossModel>,
    on_air: BTreeMap<NodeId, Vec<Span>>,
    underway: BTreeMap<(Duration, u64), Reception>,
    ready: BTreeMap<(Duration, u64, u8), Arrival>,
    /// Start and number of receptions whose onset is not yet reported, and their end; empty unless `reports_onsets`.
    onsets: BTreeMap<(Duration, u64), Duration>,
    reports_onsets: bool,
    transmissions: u64,
    receptions: u64,
}

impl Channel {
    /// A channel without nodes; all random draws in it come from `seed`.
    #[must_use]
    pub fn new(config: ChannelConfig, seed: u64) -> Self {
        Self {
            config,
            seed,
            positions: BTreeMap::new(),
            tracks: BTreeMap::new(),
            links: BTreeMap::new(),
            own_loss: BTreeMap::new(),
            on_air: BTreeMap::new(),
            underway: BTreeMap::new(),
            ready: BTreeMap::new(),
            onsets: BTreeMap::new(),
            reports_onsets: false,
            transmissions: 0,
            receptions: 0,
        }
    }

    /// The conditions for transmissions from now on.
    #[must_use]
    pub fn config(&self) -> &ChannelConfig {
        &self.config
    }

    /// Changes the conditions for transmissions from now on.
    ///
    /// A changed loss model starts again on every link that has none of its own; other changes leave it running.
    pub fn set_config(&mut self, config: ChannelConfig) {
        if config.loss != self.config.loss {
            for (_, link) in self.links.iter_mut().filter(|(ends, _)| !self.own_loss.contains_key(*ends)) {
                link.set_model(&config.loss);
            }
        }
        self.config = config;
    }

    /// Gives one direction of a link a loss model of its own, which later changes of the conditions leave alone.
    pub fn set_link_loss(&mut self, from: NodeId, to: NodeId, model: LossModel) {
        if let Some(link) = self.links.get_mut(&(from, to)) {
            link.set_model(&model);
        }
        self.own_loss.insert((from, to), model);
    }

    /// Adds a node, or moves it; signals under way keep the delay they started with.
    ///
    /// A node on a track leaves the track.
    pub fn place(&mut self, node: NodeId, position: NodePosition) {
        self.tracks.remove(&node);
        self.positions.insert(node, position);
    }

    /// Adds a node that moves along a track.
    ///
    /// [`advance`](Self::advance) and every [`transmit`](Self::transmit) bring its position up to date.
    pub fn follow_track(&mut self, node: NodeId, track: Track, now: Duration) {
        self.tracks.insert(node, track);
        self.advance(now);
    }

    /// Moves the nodes on tracks to their positions at `now`.
    pub fn advance(&mut self, now: Duration) {
        for (node, track) in &self.tracks {
            if let Some(position) = track.at(now) {
                self.positions.insert(*node, position);
            }
        }
    }

    /// Removes a node; signals under way to it still arrive.
    pub fn remove(&mut self, node: NodeId) {
        self.tracks.remove(&node);
        self.positions.remove(&node);
    }

    /// Position of a node as of the last update; `None` if it is not placed.
    #[must_use]
    pub fn position(&self, node: NodeId) -> Option<NodePosition> {
        self.positions.get(&node).copied()
    }

    /// Slant range in metres; `None` if either node is not placed.
    #[must_use]
    pub fn range_m(&self, a: NodeId, b: NodeId) -> Option<f64> {
        Some(self.positions.get(&a)?.range_m(self.positions.get(&b)?))
    }

    /// Travel time of sound over `range_m` metres, at most a day.
    #[must_use]
    pub fn propagation(&self, range_m: f64) -> Duration {
        const DAY: Duration = Duration::from_secs(86_400);
        Duration::try_from_secs_f64(range_m / self.config.sound_speed_m_s).unwrap_or(DAY).min(DAY)
    }

    /// Whether a node is transmitting at `now`.
    #[must_use]
    pub fn is_busy(&self, node: NodeId, now: Duration) -> bool {
        self.on_air.get(&node).is_some_and(|spans| spans.iter().any(|span| span.start <= now && now < span.end))
    }

    /// Puts bytes on air at `now` for `airtime`, and returns the number of the transmission, counted from 1.
    ///
    /// Each other placed node gets an [`Arrival`] with its own copy of the bytes, or with the reason of the loss.
    pub fn transmit(&mut self, from: NodeId, bytes: Vec<u8>, airtime: Duration, now: Duration) -> u64 {
        self.transmissions += 1;
        self.advance(now);
        self.deafen(from, Span::new(now, airtime), now);
        let bytes = Arc::new(bytes);
        let Some(origin) = self.position(from) else { return self.transmissions };
        let others: Vec<_> = self.positions.iter().map(|(n, p)| (*n, *p)).filter(|(n, _)| *n != from).collect();
        for (to, position) in others {
            let reception = self.receive(from, to, origin.range_m(&position), &bytes, airtime, now);
            self.enter(reception);
        }
        self.transmissions
    }

    /// Ends a transmission in the middle: its sender falls silent at `now`, and each receiver that has not yet received
    /// all of it loses it to noise.
    pub fn cut_short(&mut self, transmission: u64, now: Duration) {
        for reception in self.underway.values_mut().filter(|reception| reception.transmission == transmission) {
            reception.cut_short(now);
            if let Some(spans) = self.on_air.get_mut(&reception.from) {
                spans.iter_mut().filter(|span| span.start == reception.sent_at).for_each(|span| span.end = now);
            }
        }
    }

    /// Time of the next arrival, or of the next onset if onsets are reported; `None` if no signal is under way.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Duration> {
        let underway = self.underway.keys().next().map(|(at, _)| *at);
        let ready = self.ready.keys().next().map(|(at, ..)| *at);
        let onset = self.onsets.keys().next().map(|(at, _)| *at);
        [underway, ready, onset].into_iter().flatten().min()
    }

    /// Switches reports of onsets on, for transmissions from now on; [`poll_onset`](Self::poll_onset) must then be called.
    pub fn report_onsets(&mut self) {
        self.reports_onsets = true;
    }

    /// The next signal that has begun by `now` at a receiver that is not transmitting, in order of time.
    #[must_use]
    pub fn poll_onset(&mut self, now: Duration) -> Option<Onset> {
        while let Some(entry) = self.onsets.first_entry().filter(|entry| entry.key().0 <= now) {
            let ((at, number), end) = entry.remove_entry();
            if let Some(reception) = self.underway.get(&(end, number)).filter(|reception| !reception.self_deaf) {
                return Some(Onset {
                    transmission: reception.transmission,
                    from: reception.from,
                    to: reception.to,
                    at,
                    airtime: end.saturating_sub(at),
                    bytes: Arc::clone(&reception.bytes),
                });
            }
        }
        None
    }

    /// The next arrival complete by `now`, in order of time; ties in order of transmission, receiver and copy.
    #[must_use]
    pub fn poll_arrival(&mut self, now: Duration) -> Option<Arrival> {
        while let Some(entry) = self.underway.first_entry().filter(|entry| entry.key().0 <= now) {
            let ((_, number), reception) = entry.remove_entry();
            for (copy, arrival) in (0u8..).zip(reception.arrivals(self.config.reorder_delay)) {
                self.ready.insert((arrival.at, number, copy), arrival);
            }
        }
        let entry = self.ready.first_entry().filter(|entry| entry.key().0 <= now)?;
        Some(entry.remove())
    }

    /// Notes a node's own transmission; the node loses the signals that overlap it.
    fn deafen(&mut self, node: NodeId, span: Span, now: Duration) {
        let spans = self.on_air.entry(node).or_default();
        spans.retain(|span| span.end > now);
        spans.push(span);
        if self.config.half_duplex {
            let missed = self.underway.values_mut().filter(|other| other.to == node && other.span.overlaps(&span));
            missed.for_each(|other| other.self_deaf = true);
        }
    }

    /// The signal at one receiver, with its fate drawn but its collisions not yet known.
    fn receive(
        &mut self,
        from: NodeId,
        to: NodeId,
        range_m: f64,
        bytes: &Arc<Vec<u8>>,
        airtime: Duration,
        now: Duration,
    ) -> Reception {
        let span = Span::new(now.saturating_add(self.propagation(range_m)), airtime);
        let model = self.own_loss.get(&(from, to)).unwrap_or(&self.config.loss);
        let link = self.links.entry((from, to)).or_insert_with(|| DirectedLink::new(self.seed, from, to, model));
        let frame = FrameContext { at: span.start, airtime, bytes: bytes.len(), range_m };
        let mut draws = link.draw(&frame, &self.config);
        if range_m > self.config.max_range_m {
            draws.fate = FrameFate::OutOfRange;
        }
        Reception {
            transmission: self.transmissions,
            from,
            to,
            positions: [self.position(from), self.position(to)].map(Option::unwrap_or_default),
            span,
            sent_at: now,
            range_m,
            bytes: Arc::clone(bytes),
            draws,
            in_outage: self.config.outages.iter().any(|outage| outage.covers(from, to, span.start, span.end)),
            collided: false,
            self_deaf: false,
        }
    }

    /// Adds a reception to those under way and marks collisions in both directions.
    ///
    /// Signals of one sender stay in order on their way and do not collide, although motion may make their
    /// rounded spans touch each other.
    fn enter(&mut self, mut new: Reception) {
        let own = self.on_air.get(&new.to).map(Vec::as_slice).unwrap_or_default();
        new.self_deaf = self.config.half_duplex && own.iter().any(|span| span.overlaps(&new.span));
        let meets = |old: &&mut Reception| old.to == new.to && old.from != new.from && old.span.overlaps(&new.span);
        let overlapping = self.underway.values_mut().filter(meets);
        for old in overlapping {
            new.collided |= old.audible();
            old.collided |= new.audible();
        }
        self.receptions += 1;
        if self.reports_onsets && new.audible() {
            self.onsets.insert((new.span.start, self.receptions), new.span.end);
        }
        self.underway.insert((new.span.end, self.receptions), new);
    }
}

#[cfg(test)]
mod tests;
