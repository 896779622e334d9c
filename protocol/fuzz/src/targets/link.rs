//! An end in contact with its peer, and a script of inputs.

use super::peer::{FuzzPeer, MISSION, authenticity, vehicle};
use super::raw::Script;
use scenecast_protocol::link::{SlotInboxState, SurfaceConfig, SurfaceLink, Transmit, VehicleConfig, VehicleLink};
use scenecast_protocol::mac::{Access, ModemProfile};
use scenecast_protocol::map::{
    Cell, LayerDescriptor, LayerId, LayerSet, LayerSource, MapSource, Replica, StateReplica, StateSource,
};
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::schedule::Audit;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use std::fmt;
use std::time::Duration;

const BUDGET_BPS: u32 = 4000;
const WINDOW: Duration = Duration::from_secs(10);
/// The longest `Debug` output of an end without its map, while all that it keeps has the largest size.
const MAX_KEPT: usize = 6 << 20;

/// A value that the link carries and that has no `Debug` output, because its size is not the link's.
#[derive(Default)]
pub struct Opaque<T>(pub T);

impl<T> fmt::Debug for Opaque<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Opaque")
    }
}

impl StateReplica for Opaque<Replica> {
    fn decodes(&self, horizon: u64, chunk: &[u8]) -> bool {
        self.0.decodes(horizon, chunk)
    }
    fn apply(&mut self, number: u64, chunk: &[u8], now: Instant) -> bool {
        self.0.apply(number, chunk, now)
    }
    fn advance_base(&mut self, horizon: u64) {
        self.0.advance_base(horizon);
    }
    fn base_digest(&self) -> u16 {
        self.0.base_digest()
    }
    fn version(&self) -> u64 {
        self.0.version()
    }
    fn size(&self) -> usize {
        self.0.size()
    }
    fn take(&mut self) -> Self {
        Self(self.0.take())
    }
}

/// A state that is only a number of bytes, so that no time goes to coding; any bytes are a part of it.
#[derive(Debug, Default)]
pub struct Pile {
    waiting: usize,
    in_flight: usize,
}

impl StateSource for Pile {
    type Carried = usize;
    fn next_chunk(&mut self, room: usize, _: Instant) -> Option<(Vec<u8>, usize)> {
        let bytes = self.waiting.min(room);
        self.waiting -= bytes;
        self.in_flight += bytes;
        (bytes > 0).then(|| (vec![0; bytes], bytes))
    }
    fn handle_fate(&mut self, bytes: usize, delivered: bool, _: Instant) {
        self.in_flight = self.in_flight.checked_sub(bytes).expect("a fate of what is in flight");
        self.waiting += if delivered { 0 } else { bytes };
    }
    fn handle_peer_restart(&mut self, _: Instant) {
        self.waiting += std::mem::take(&mut self.in_flight);
    }
    fn backlog_bytes(&self) -> usize {
        self.waiting
    }
    fn is_converged(&self) -> bool {
        self.waiting + self.in_flight == 0
    }
    fn digest(&self) -> u16 {
        0
    }
}

impl StateReplica for Pile {
    fn apply(&mut self, _: u64, _: &[u8], _: Instant) -> bool {
        true
    }
    fn advance_base(&mut self, _: u64) {}
    fn base_digest(&self) -> u16 {
        0
    }
    fn version(&self) -> u64 {
        0
    }
    fn take(&mut self) -> Self {
        std::mem::take(self)
    }
}

/// A state whose host can add to it.
pub trait Grow: StateSource {
    /// Adds about `amount` bytes of new content.
    fn grow(&mut self, amount: u8, now: Instant);
}

impl Grow for Pile {
    fn grow(&mut self, amount: u8, _: Instant) {
        self.waiting = (self.waiting + usize::from(amount) * 4).min(1 << 16);
    }
}

impl Grow for MapSource {
    fn grow(&mut self, amount: u8, now: Instant) {
        let label = |i: i32| (i % 3) as u8 + amount % 8;
        let cell = |i: i32| Cell::new(i % 9, i / 9 + i32::from(amount % 4));
        self.set((0..i32::from(amount)).map(|i| (cell(i), label(i))), now);
    }
}

/// The layers of a vehicle that has any.
pub fn layers() -> Vec<LayerSource> {
    let (settle, share) = (Duration::from_secs(2), 100 / LayerId::COUNT as u8);
    let source =
        |layer: LayerDescriptor, id| LayerSource::new(id, LayerDescriptor { share, ..layer }, Codec::Png, settle);
    LayerSet::default().iter().map(|(id, layer)| source(layer.clone(), id)).collect()
}

pub type Vehicle<S = Pile> = VehicleLink<S>;
pub type Surface<R = Opaque<Replica>> = SurfaceLink<R>;

/// An end as its host runs it.
pub trait FuzzEnd: fmt::Debug {
    fn handle_frame(&mut self, bytes: &[u8], now: Instant);
    fn poll_transmit(&mut self, now: Instant) -> Option<Transmit>;
    fn handle_transmit_outcome(&mut self, now: Instant);
    /// The modem requests `frames` frames of a cycle.
    fn poll(&mut self, frames: u32, now: Instant);
    fn wakeup(&self, now: Instant) -> Option<Instant>;
    /// Takes every event and decides about every slot; returns the number of events.
    fn drain(&mut self, now: Instant) -> usize;
    /// An action of the host.
    fn act(&mut self, what: u8, with: u8, now: Instant);
}

/// The setup that the first byte of an input selects.
#[derive(Clone, Copy)]
pub struct Setup {
    choice: u8,
}

impl Setup {
    pub fn new(choice: u8) -> Self {
        Self { choice }
    }

    fn modem(self) -> ModemProfile {
        let access = match self.choice >> 2 & 3 {
            0 => Access::Shared,
            1 => Access::FullDuplex,
            2 => Access::ModemOwned { pool_frames: 4 },
            _ => Access::Polled,
        };
        ModemProfile {
            frame_bytes: if self.choice & 0x10 == 0 { 64 } else { 200 },
            bit_rate_bps: 4000.0,
            overhead_bits: 16,
            turn_around: Duration::from_millis(200),
            access,
        }
    }

    pub fn peer(self, us: Address, end: Address) -> FuzzPeer {
        FuzzPeer::new(us, end, authenticity(self.choice))
    }

    pub fn vehicle<S: Grow>(self, source: S, now: Instant) -> Vehicle<S> {
        let config = VehicleConfig {
            authenticity: authenticity(self.choice),
            ..VehicleConfig::new(vehicle(), MISSION, self.modem(), BUDGET_BPS)
        };
        VehicleLink::with_source(config, source, 11, SlotInboxState::default(), now)
    }

    pub fn surface<R: StateReplica>(self, now: Instant) -> Surface<R> {
        let config = SurfaceConfig {
            vehicles: vec![vehicle()],
            discovery_period: (self.choice & 0x20 != 0).then_some(Duration::from_secs(60)),
            authenticity: authenticity(self.choice),
            ..SurfaceConfig::new(MISSION, self.modem(), BUDGET_BPS)
        };
        let mut link = SurfaceLink::new(config, 12, now);
        (0..3).for_each(|what| link.act(what, 3, now));
        link
    }
}

/// One end on its modem.
struct FuzzHost<'a, E> {
    link: &'a mut E,
    modem: ModemProfile,
    in_modem: u32,
    audit: Audit,
    /// Events caused by received frames.
    events: usize,
}

impl<E: FuzzEnd> FuzzHost<'_, E> {
    /// The next frame of the end, which then is in its modem.
    fn poll_transmit(&mut self, now: Instant) -> Option<Vec<u8>> {
        let transmit = self.link.poll_transmit(now)?;
        self.in_modem += 1;
        let most = match self.modem.access {
            Access::Shared | Access::FullDuplex => 1,
            Access::ModemOwned { pool_frames } => pool_frames,
            Access::Polled => 300,
        };
        assert!(self.in_modem <= most, "{} frames in the modem", self.in_modem);
        assert!((1..=self.modem.frame_bytes).contains(&transmit.bytes.len()));
        self.audit.record(self.modem.bits_on_air(transmit.bytes.len()), now);
        let limit = u64::from(BUDGET_BPS) * WINDOW.as_secs() + self.audit.largest_bits();
        assert!(self.audit.worst_window_bits() <= limit, "{} bits in a window", self.audit.worst_window_bits());
        Some(transmit.bytes)
    }

    fn handle_outcome(&mut self, now: Instant) {
        if self.in_modem > 0 {
            self.in_modem -= 1;
            self.link.handle_transmit_outcome(now);
        }
    }
}

/// Brings an end in contact with its peer, then replaces the peer by one that follows the script.
/// Returns the number of events.
pub fn run<E: FuzzEnd>(
    setup: Setup,
    mut end: E,
    mut partner: impl FuzzEnd,
    mut peer: FuzzPeer,
    script: &[u8],
) -> usize {
    let mut now = Instant::from_secs_f64(1000.0);
    let host = |link| FuzzHost { link, modem: setup.modem(), in_modem: 0, audit: Audit::new(WINDOW), events: 0 };
    let mut end = host(&mut end);
    meet(&mut end, &mut partner, &mut peer, &mut now);
    let mut script = Script(script);
    let mut past: Vec<Vec<u8>> = Vec::new();
    while !script.is_over() {
        step(&mut end, &mut peer, &mut script, &mut past, &mut now);
    }
    assert!(format!("{:?}", end.link).len() < MAX_KEPT);
    end.events
}

/// Ten exchanges over a lossless channel. Afterwards both are in contact, and each has a
/// frame that is not acknowledged.
fn meet<E: FuzzEnd>(end: &mut FuzzHost<'_, E>, partner: &mut impl FuzzEnd, peer: &mut FuzzPeer, now: &mut Instant) {
    for _ in 0..10 {
        *now = *now + Duration::from_millis(1500);
        partner.poll(4, *now);
        let mut sent = Vec::new();
        while let Some(transmit) = partner.poll_transmit(*now) {
            peer.note_sent(&transmit.bytes);
            sent.push(transmit.bytes);
            partner.handle_transmit_outcome(*now);
        }
        sent.iter().for_each(|bytes| end.link.handle_frame(bytes, *now));
        *now = *now + Duration::from_millis(1500);
        end.link.poll(4, *now);
        while let Some(bytes) = end.poll_transmit(*now) {
            peer.note_heard(&bytes);
            partner.handle_frame(&bytes, *now);
            end.handle_outcome(*now);
        }
        partner.drain(*now);
        end.link.drain(*now);
    }
}

fn step<E: FuzzEnd>(
    end: &mut FuzzHost<'_, E>,
    peer: &mut FuzzPeer,
    script: &mut Script<'_>,
    past: &mut Vec<Vec<u8>>,
    now: &mut Instant,
) {
    let (what, how) = (script.u8(), script.u8());
    let frame = match what & 15 {
        0 => Some(script.bytes().to_vec()),
        1..=4 => Some(peer.numbered(how, script)),
        5 => Some(peer.hello(how, script)),
        6 => Some(peer.misaddressed(how, script)),
        7 => past.iter().rev().nth(how.into()).cloned(),
        _ => None,
    };
    if let Some(bytes) = frame {
        receive(end, peer, &bytes, *now);
        past.push(bytes);
    }
    match what & 15 {
        8 => *now = *now + Duration::from_millis(50) * u32::from(how),
        9 => *now = *now + Duration::from_secs(10) * u32::from(how),
        10 => *now = end.link.wakeup(*now).map_or(*now, |at| at.max(*now).min(*now + Duration::from_secs(3600))),
        11 => end.handle_outcome(*now),
        12 => end.link.poll(how.into(), *now),
        13 => end.link.act(how, script.u8(), *now),
        // The modem accepts and transmits everything.
        14 => (0..how).for_each(|_| {
            *now = *now + Duration::from_millis(10);
            speak(end, peer, *now);
            end.handle_outcome(*now);
        }),
        15 => speak(end, peer, *now),
        _ => {}
    }
    end.link.drain(*now);
}

fn receive<E: FuzzEnd>(end: &mut FuzzHost<'_, E>, peer: &mut FuzzPeer, bytes: &[u8], now: Instant) {
    end.link.drain(now);
    end.link.handle_frame(bytes, now);
    let events = end.link.drain(now);
    end.events += events;
    assert!(events <= bytes.len() + 16, "{events} events of {} bytes", bytes.len());
    assert!(events == 0 || peer.may_be_believed(bytes), "an event of a frame that was not sealed");
}

/// The end transmits until its modem is full, which must happen.
fn speak<E: FuzzEnd>(end: &mut FuzzHost<'_, E>, peer: &mut FuzzPeer, now: Instant) {
    while let Some(bytes) = end.poll_transmit(now) {
        peer.note_heard(&bytes);
    }
}
