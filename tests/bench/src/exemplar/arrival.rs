//! The time from the order of an exemplar to its last bit, while the map uses all spare capacity.

use super::Spread;
use image::RgbImage;
use scene_model::exemplars::ExemplarPatch as Picture;
use scenecast_config::{Config, Debounce};
use scenecast_core::Area;
use scenecast_core::UserError;
use scenecast_host::{SurfaceHost, VehicleHost, VehicleHostEvent, channel_station};
use scenecast_protocol::coordinates::WorldPoint;
use scenecast_protocol::directive::Fix;
use scenecast_protocol::exemplar::edge_px;
use scenecast_protocol::map::Cell;
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_rehearsal::VirtualTime;
use scenecast_surface::{LabelExemplars, RequestKind};
use scenecast_vehicle::{Durable, MapChanges};
use serde::Serialize;
use sim_channel::{Channel, ChannelConfig, LossModel, NodeId, NodePosition, RandomStream, ReceptionOutcome};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

const SURFACE: NodeId = NodeId(0);
const VEHICLE: NodeId = NodeId(1);
/// Time for the handshake and for the estimates of both ends to converge, seconds.
const WARM_UP_S: f64 = 120.0;
/// Time after which a request counts as lost.
const GIVE_UP_TIMEOUT: Duration = Duration::from_secs(600);
pub(super) const LABELS: u8 = 12;
/// Edge of the part of the map that keeps changing, cells.
const EDGE: i32 = 112;
/// Time between two changes of that part, and between two fixes, seconds.
const CHANGE_S: f64 = 2.0;
const FIX_S: f64 = 10.0;

/// The requests and the load.
#[derive(Debug, Clone, Copy)]
pub struct ArrivalSetting {
    pub requests: usize,
    /// Share of frames that are lost.
    pub loss: f64,
    /// Whether the map uses all spare capacity.
    pub loaded: bool,
    /// Whether each image is requested again with twice the edge.
    pub larger: bool,
}

#[derive(Debug, Clone, Serialize)]
pub struct Arrivals {
    pub requested: usize,
    pub arrived: usize,
    /// Time from the order to the whole image, seconds.
    pub seconds: Option<Spread>,
    /// Share of the images that arrived within 30 s.
    pub within_30_s: f64,
    /// Bytes of an image as it was sent.
    pub bytes: Option<Spread>,
    /// Rate of all bits that the vehicle put on air, bit/s.
    pub sent_bps: f64,
    /// Share of the vehicle's frames that were lost.
    pub loss: f64,
}

/// Requests images of random labels one after the other, each a random time after the last one arrived.
pub fn arrivals(
    setting: ArrivalSetting,
    patches: &[RgbImage],
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<Arrivals, UserError> {
    let mut bench = ExemplarBench::new(setting, patches, seed)?;
    bench.run_until(Instant::from_secs_f64(WARM_UP_S), |_| false);
    let (began, before) = (bench.now, bench.sent_bits());
    let mut took = Vec::new();
    for i in 0..setting.requests {
        let next = bench.now + Duration::from_secs_f64(1.0 + 40.0 * bench.rng.uniform());
        bench.run_until(next, |_| false);
        let label = bench.any_label();
        let first = bench.get(label, RequestKind::Another)?;
        took.extend(if setting.larger { bench.get(label, RequestKind::Larger(None))? } else { first });
        progress((i + 1) as f64 / setting.requests as f64);
    }
    let within = took.iter().filter(|(s, _)| *s <= 30.0).count();
    Ok(Arrivals {
        requested: setting.requests,
        arrived: took.len(),
        seconds: Spread::of(took.iter().map(|(s, _)| *s)),
        within_30_s: within as f64 / setting.requests.max(1) as f64,
        bytes: Spread::of(took.iter().map(|(_, n)| *n as f64)),
        sent_bps: (bench.sent_bits() - before) as f64 / bench.now.since(began).as_secs_f64().max(1.0),
        loss: bench.lost as f64 / bench.frames.max(1) as f64,
    })
}

/// Both roles and the channel between them.
pub(super) struct ExemplarBench {
    setting: ArrivalSetting,
    pub(super) now: Instant,
    pub(super) vehicle: VehicleHost,
    pub(super) surface: SurfaceHost,
    pub(super) address: Address,
    channel: Channel,
    next_change: Instant,
    next_fix: Instant,
    rng: RandomStream,
    frames: u64,
    lost: u64,
}

impl ExemplarBench {
    pub(super) fn new(setting: ArrivalSetting, patches: &[RgbImage], seed: u64) -> Result<Self, UserError> {
        let mut config = Config::default();
        // The other coder gains no byte on noise, so it is not tried.
        config.map.codec = Codec::Context;
        // The load does not depend on which labels are held back.
        config.map.debounce_s = Debounce::Seconds(0.0);
        let now = Instant::ZERO;
        let modem = scenecast_config::modem_profile(&config, config.channel.bit_rate);
        let area = Area { west: 0.0, south: 0.0, east: 16.0, north: 16.0 };
        let mut channel = Channel::new(
            ChannelConfig {
                half_duplex: true,
                loss: LossModel::Independent { probability: setting.loss },
                ..ChannelConfig::default()
            },
            seed,
        );
        channel.place(SURFACE, NodePosition::default());
        channel.place(VEHICLE, NodePosition::new(config.channel.range_m, 0.0, -16.0));
        let vehicle = scenecast_vehicle::assemble(
            &config,
            scenecast_config::authenticity(&config, Address::SURFACE)?,
            modem,
            area,
            Durable::default(),
            seed ^ 0x0A0B,
            now,
        )?;
        let surface = scenecast_surface::assemble(
            &config,
            scenecast_config::authenticity(&config, Address::SURFACE)?,
            scenecast_config::tuning_table(&config)?,
            modem,
            seed ^ 0x5EA,
            now,
        )?;
        let window = Duration::from_secs_f64(config.link.budget_window_s);
        let mut vehicle = VehicleHost::new(vehicle, channel_station(modem, window, now), None);
        vehicle.handle_exemplars(Arc::new(gallery(patches)), now);
        Ok(Self {
            setting,
            now,
            vehicle,
            surface: SurfaceHost::new(surface, channel_station(modem, window, now), None),
            address: scenecast_config::vehicle_address(&config)?,
            channel,
            next_change: now,
            next_fix: now,
            rng: RandomStream::new(seed, &[5]),
            frames: 0,
            lost: 0,
        })
    }

    fn sent_bits(&self) -> u64 {
        self.vehicle.link().audit().total_bits()
    }

    /// A random label of the map.
    fn any_label(&mut self) -> u8 {
        1 + (self.rng.uniform() * f64::from(LABELS)) as u8
    }

    /// Requests an image; its seconds and bytes, or `None` if it did not arrive.
    pub(super) fn get(&mut self, label: u8, kind: RequestKind) -> Result<Option<(f64, usize)>, UserError> {
        let asked = self.now;
        self.surface.surface_mut().request_exemplar(self.address, label, kind, asked).map_err(UserError::failed)?;
        if !self.run_until(asked + GIVE_UP_TIMEOUT, |w| w.is_met(label)) {
            self.surface.surface_mut().cancel_exemplar(self.address, label, self.now).map_err(UserError::failed)?;
            return Ok(None);
        }
        let bytes = self.page(label).and_then(|page| page.exemplar(None)).map(|p| p.sent_bytes);
        Ok(bytes.map(|bytes| (self.now.since(asked).as_secs_f64(), bytes)))
    }

    pub(super) fn page(&self, label: u8) -> Option<&LabelExemplars> {
        self.surface.surface().record(self.address)?.exemplars.label(label)
    }

    fn is_met(&self, label: u8) -> bool {
        self.page(label).is_some_and(|page| page.request.is_none())
    }

    /// A map of random labels that change faster than the link can follow; without load the map stays constant.
    fn change_map(&mut self) {
        let cells = (0..EDGE * EDGE).map(|i| {
            let label = match self.setting.loaded {
                true => 1 + (self.rng.uniform() * f64::from(LABELS)) as u8,
                false => 1 + (i % i32::from(LABELS)) as u8,
            };
            (Cell::new(i % EDGE, i / EDGE), label)
        });
        let changes = MapChanges::of_labels(0, LABELS, cells.collect());
        self.vehicle.handle_changes(&changes, self.now);
    }
}

impl VirtualTime for ExemplarBench {
    fn now(&self) -> Instant {
        self.now
    }

    fn set_now(&mut self, now: Instant) {
        self.now = now;
    }

    fn next_event(&self) -> Instant {
        let hosts = [self.vehicle.poll_timeout(self.now), self.surface.poll_timeout(self.now)];
        let channel = self.channel.poll_timeout().map(Instant::from);
        let all = hosts.into_iter().chain([channel]).flatten().chain([self.next_change, self.next_fix]);
        all.min().unwrap_or(self.next_change)
    }

    fn handle_events(&mut self) {
        let now = self.now;
        self.vehicle.handle_timeout(now);
        self.surface.handle_timeout(now);
        while let Some(arrival) = self.channel.poll_arrival(now.into()) {
            let delivered = matches!(arrival.outcome, ReceptionOutcome::Delivered { .. });
            if arrival.to == SURFACE {
                self.frames += 1;
                self.lost += u64::from(!delivered);
            }
            let ReceptionOutcome::Delivered { bytes, .. } = arrival.outcome else { continue };
            match arrival.to {
                SURFACE => self.surface.link_mut().handle_bytes(&bytes, now),
                _ => self.vehicle.link_mut().handle_bytes(&bytes, now),
            }
        }
        if now >= self.next_fix {
            self.next_fix = now + Duration::from_secs_f64(FIX_S);
            let fix = Fix { position: WorldPoint::new(8.0, 8.0), sigma_m: 1.0, age_s: 0.5 };
            // An unknown vehicle has no slot yet.
            let _ = self.surface.surface_mut().send_fix(self.address, fix, now);
        }
        if now >= self.next_change {
            self.next_change = now + Duration::from_secs_f64(CHANGE_S);
            self.change_map();
        }
    }

    fn pump(&mut self) {
        while let Some(event) = self.vehicle.poll_event() {
            if event == VehicleHostEvent::Persist {
                self.vehicle.handle_persisted();
            }
        }
        while self.surface.poll_event().is_some() {}
        let profiles = [*self.vehicle.link().profile(), *self.surface.link().profile()];
        while let Some(bytes) = self.vehicle.poll_output(self.now) {
            let airtime = profiles[0].airtime(bytes.len());
            self.channel.transmit(VEHICLE, bytes, airtime, self.now.into());
        }
        while let Some(bytes) = self.surface.poll_output(self.now) {
            let airtime = profiles[1].airtime(bytes.len());
            self.channel.transmit(SURFACE, bytes, airtime, self.now.into());
        }
    }
}

/// Assigns the patches to the labels in turn, so that each label always has another image.
fn gallery(patches: &[RgbImage]) -> BTreeMap<u8, Vec<Picture>> {
    const EACH: usize = 40;
    let large = edge_px(1);
    let usable: Vec<Arc<RgbImage>> = patches
        .iter()
        .map(|p| Arc::new(image::imageops::resize(p, large, large, image::imageops::FilterType::Triangle)))
        .collect();
    let picture = |label: u8, i: usize| {
        let at = usize::from(label) + i * usize::from(LABELS);
        let patch = usable.get(at % usable.len().max(1))?.clone();
        Some(Picture { patch, score: 1.0, t_s: at as f64, place: (at as f64, 0.0), pixel_m: 0.004 })
    };
    (1..=LABELS).map(|label| (label, (0..EACH).filter_map(|i| picture(label, i)).collect())).collect()
}
