//! How long an image takes from the order to the last bit, while the map takes all that it can get.

use super::Spread;
use crate::VirtualTime;
use image::RgbImage;
use scene_model::exemplars::ExemplarPatch as Picture;
use scenecast_config::Config;
use scenecast_core::Area;
use scenecast_core::UserError;
use scenecast_protocol::coordinates::WorldPoint;
use scenecast_protocol::directive::Fix;
use scenecast_protocol::exemplar::edge_px;
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::map::Cell;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_surface::{Page, Surface, Wish};
use scenecast_vehicle::{Durable, MapUpdate, Vehicle, VehicleOutput};
use serde::Serialize;
use sim_channel::{Channel, ChannelConfig, LossModel, NodeId, NodePosition, RandomStream, ReceptionOutcome};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

const SURFACE: NodeId = NodeId(0);
const VEHICLE: NodeId = NodeId(1);
/// Time until both ends know each other and their estimates have settled.
const WARM_UP_S: f64 = 120.0;
/// Time after which an image is given up.
const GIVE_UP: Duration = Duration::from_secs(600);
/// Labels on the map.
pub(super) const LABELS: u8 = 12;
/// Edge of the part of the map that is always changing, cells.
const EDGE: i32 = 112;
/// Seconds between two changes of it and between two fixes.
const CHANGE_S: f64 = 2.0;
const FIX_S: f64 = 10.0;

/// What is asked for and under which load.
#[derive(Debug, Clone, Copy)]
pub struct Setting {
    /// Images to ask for.
    pub requests: usize,
    /// Share of frames that is lost.
    pub loss: f64,
    /// Whether the map takes all that it can get.
    pub loaded: bool,
    /// Ask for twice the edge.
    pub larger: bool,
}

/// How long images took.
#[derive(Debug, Clone, Serialize)]
pub struct Arrivals {
    /// Images asked for.
    pub requested: usize,
    /// Images that came.
    pub arrived: usize,
    /// Seconds from the order to the image.
    pub seconds: Option<Spread>,
    /// Share of them within 30 s.
    pub within_30_s: f64,
    /// Bytes of an image on the link.
    pub bytes: Option<Spread>,
    /// Bits a second that the vehicle put on air.
    pub sent_bps: f64,
    /// Share of the vehicle's frames that were lost.
    pub loss: f64,
}

/// Asks for images of random labels one after the other, each a random while after the last one is there.
pub fn arrivals(
    setting: Setting,
    patches: &[RgbImage],
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<Arrivals, UserError> {
    let mut water = Water::new(setting, patches, seed)?;
    water.run_until(Instant::from_secs_f64(WARM_UP_S), |_| false);
    let (began, before) = (water.now, water.sent_bits);
    let mut took = Vec::new();
    for i in 0..setting.requests {
        let next = water.now + Duration::from_secs_f64(1.0 + 40.0 * water.dice.uniform());
        water.run_until(next, |_| false);
        let label = water.any_label();
        let first = water.get(label, Wish::Another)?;
        took.extend(if setting.larger { water.get(label, Wish::Larger(None))? } else { first });
        progress((i + 1) as f64 / setting.requests as f64);
    }
    let within = took.iter().filter(|(s, _)| *s <= 30.0).count();
    Ok(Arrivals {
        requested: setting.requests,
        arrived: took.len(),
        seconds: Spread::of(took.iter().map(|(s, _)| *s)),
        within_30_s: within as f64 / setting.requests.max(1) as f64,
        bytes: Spread::of(took.iter().map(|(_, n)| *n as f64)),
        sent_bps: (water.sent_bits - before) as f64 / water.now.since(began).as_secs_f64().max(1.0),
        loss: water.lost as f64 / water.frames.max(1) as f64,
    })
}

/// Both roles and the water between them.
pub(super) struct Water {
    setting: Setting,
    pub(super) now: Instant,
    pub(super) vehicle: Vehicle,
    pub(super) surface: Surface,
    pub(super) address: Address,
    modem: ModemProfile,
    channel: Channel,
    transmitting: [Option<Instant>; 2],
    next_change: Instant,
    next_fix: Instant,
    dice: RandomStream,
    sent_bits: u64,
    frames: u64,
    lost: u64,
}

impl Water {
    pub(super) fn new(setting: Setting, patches: &[RgbImage], seed: u64) -> Result<Self, UserError> {
        let mut config = Config::default();
        // Noise has nothing that the other coder could take: it need not be tried.
        config.map.codec = "context".to_owned();
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
        let mut vehicle = scenecast_vehicle::assemble(
            &config,
            scenecast_config::authenticity(&config)?,
            modem,
            area,
            Durable::default(),
            seed ^ 0x0A0B,
            now,
        )?;
        vehicle.handle_exemplars(gallery(patches));
        Ok(Self {
            setting,
            now,
            vehicle,
            surface: scenecast_surface::assemble(
                &config,
                scenecast_config::authenticity(&config)?,
                scenecast_config::tuning_table(&config)?,
                modem,
                seed ^ 0x5EA,
                now,
            )?,
            address: scenecast_config::vehicle_address(&config)?,
            modem,
            channel,
            transmitting: [None; 2],
            next_change: now,
            next_fix: now,
            dice: RandomStream::new(seed, &[5]),
            sent_bits: 0,
            frames: 0,
            lost: 0,
        })
    }

    /// A label of the map.
    fn any_label(&mut self) -> u8 {
        1 + (self.dice.uniform() * f64::from(LABELS)) as u8
    }

    /// Asks for an image; seconds and bytes that it took, if it came.
    pub(super) fn get(&mut self, label: u8, wish: Wish) -> Result<Option<(f64, usize)>, UserError> {
        let asked = self.now;
        self.surface.request_exemplar(self.address, label, wish, asked).map_err(UserError::Failed)?;
        if !self.run_until(asked + GIVE_UP, |w| w.is_met(label)) {
            self.surface.cancel_exemplar(self.address, label, self.now).map_err(UserError::Failed)?;
            return Ok(None);
        }
        let bytes = self.page(label).and_then(|page| page.picture(None)).map(|p| p.sent_bytes);
        Ok(bytes.map(|bytes| (self.now.since(asked).as_secs_f64(), bytes)))
    }

    pub(super) fn page(&self, label: u8) -> Option<&Page> {
        self.surface.desk(self.address)?.album.page(label)
    }

    fn is_met(&self, label: u8) -> bool {
        self.page(label).is_some_and(|page| page.asked.is_none())
    }

    /// Labels as they come, in places that change more than the link can tell; without load the map stays as it is.
    fn change_map(&mut self) {
        let cells = (0..EDGE * EDGE).map(|i| {
            let label = match self.setting.loaded {
                true => 1 + (self.dice.uniform() * f64::from(LABELS)) as u8,
                false => 1 + (i % i32::from(LABELS)) as u8,
            };
            (Cell::new(i % EDGE, i / EDGE), label)
        });
        let (cells, layers, perplexity) = (cells.collect(), BTreeMap::new(), Vec::new());
        let update = MapUpdate { t_s: self.now.as_secs_f64(), epoch: 0, cells, layers, perplexity, labels: LABELS };
        self.vehicle.handle_map(&update, self.now);
    }
}

impl VirtualTime for Water {
    fn now(&self) -> Instant {
        self.now
    }

    fn set_now(&mut self, now: Instant) {
        self.now = now;
    }

    fn next_event(&self) -> Instant {
        let links = [
            self.vehicle.poll_timeout().filter(|_| self.transmitting[0].is_none()),
            self.surface.poll_timeout(self.now).filter(|_| self.transmitting[1].is_none()),
        ];
        let links = links.into_iter().flatten().map(|(at, _)| at).filter(|&at| at > self.now);
        let channel = self.channel.poll_timeout().map(Instant::from);
        let regular = [self.next_change, self.next_fix];
        let all = links.chain(self.transmitting.into_iter().flatten()).chain(channel).chain(regular);
        all.min().unwrap_or(self.next_change)
    }

    fn handle_events(&mut self) {
        let now = self.now;
        for (node, ends_at) in self.transmitting.into_iter().enumerate() {
            if ends_at.is_some_and(|at| at <= now) {
                self.transmitting[node] = None;
                match node {
                    0 => self.vehicle.handle_transmit_outcome(now),
                    _ => self.surface.handle_transmit_outcome(now),
                }
            }
        }
        while let Some(arrival) = self.channel.poll_arrival(now.into()) {
            let delivered = matches!(arrival.outcome, ReceptionOutcome::Delivered { .. });
            if arrival.to == SURFACE {
                self.frames += 1;
                self.lost += u64::from(!delivered);
            }
            let ReceptionOutcome::Delivered { bytes, .. } = arrival.outcome else { continue };
            match arrival.to {
                SURFACE => self.surface.handle_frame(&bytes, now),
                _ => self.vehicle.handle_frame(&bytes, now),
            }
        }
        if now >= self.next_fix {
            self.next_fix = now + Duration::from_secs_f64(FIX_S);
            let fix = Fix { position: WorldPoint::new(8.0, 8.0), sigma_m: 1.0, age_s: 0.5 };
            // Before the vehicle is known there is no slot for it.
            let _ = self.surface.send_fix(self.address, fix, now);
        }
        if now >= self.next_change {
            self.next_change = now + Duration::from_secs_f64(CHANGE_S);
            self.change_map();
        }
    }

    fn pump(&mut self) {
        while let Some(output) = self.vehicle.poll_output() {
            if output == VehicleOutput::Persist {
                self.vehicle.handle_persisted();
            }
        }
        while self.surface.poll_output().is_some() {}
        for node in 0..2 {
            if self.transmitting[node].is_some() {
                continue;
            }
            let transmit = match node {
                0 => self.vehicle.poll_transmit(self.now),
                _ => self.surface.poll_transmit(self.now),
            };
            let Some(transmit) = transmit else { continue };
            let airtime = self.modem.airtime(transmit.bytes.len());
            if node == 0 {
                self.sent_bits += self.modem.bits_on_air(transmit.bytes.len());
            }
            let from = if node == 0 { VEHICLE } else { SURFACE };
            self.channel.transmit(from, transmit.bytes, airtime, self.now.into());
            self.transmitting[node] = Some(self.now + airtime);
        }
    }
}

/// The patches dealt out to the labels, again and again, so that there is always another one.
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
        Some(Picture { patch, score: 1.0, t_s: at as f64, place: (at as f64, 0.0) })
    };
    (1..=LABELS).map(|label| (label, (0..EACH).filter_map(|i| picture(label, i)).collect())).collect()
}
