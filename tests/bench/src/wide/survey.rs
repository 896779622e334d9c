//! A survey that arrives through the link: a vehicle's end and a surface without delay or loss between them.

use super::WideSetting;
use scenecast_config::{Config, cell_m, vehicle_address};
use scenecast_core::UserError;
use scenecast_core::tuning_table::TuningTable;
use scenecast_protocol::directive::{Slot, SlotState};
use scenecast_protocol::link::{SlotInboxState, VehicleConfig, VehicleEvent, VehicleLink};
use scenecast_protocol::mac::{Access, ModemProfile};
use scenecast_protocol::map::{Cell, LayerDescriptor, LayerId, LayerSource};
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::schedule::BackgroundOrder;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, MissionId, VehicleStatus};
use scenecast_surface::Surface;
use sim_channel::RandomStream;
use std::collections::VecDeque;
use std::time::Duration;

/// A modem that does not limit the survey.
const BIT_RATE_BPS: u32 = 2_000_000;
/// Width of the seen lane, cells.
const LANE: i32 = 12;
/// Length of a part of the lane without gaps, cells.
const SEGMENT: i32 = 512;
/// Cells that wait at the vehicle at a time.
const PORTION: usize = 4000;
/// Frames without an arriving cell after which the survey has failed.
const MAX_IDLE_FRAMES: usize = 20_000;
const LABELS: u8 = 6;

/// The ends of the link, and the rest of the track.
pub(super) struct WideSurvey {
    pub(super) surface: Surface,
    pub(super) vehicle: Address,
    pub(super) modem: ModemProfile,
    pub(super) now: Instant,
    link: VehicleLink,
    track: Track,
    has_depth: bool,
}

impl WideSurvey {
    pub(super) fn new(config: &Config, setting: WideSetting, seed: u64) -> Result<Self, UserError> {
        let now = Instant::ZERO;
        let vehicle = vehicle_address(config)?;
        let modem = ModemProfile {
            frame_bytes: 1000,
            bit_rate_bps: f64::from(BIT_RATE_BPS),
            overhead_bits: 0,
            turn_around: Duration::from_millis(1),
            access: Access::Shared,
        };
        let end = VehicleConfig {
            budget_window: Duration::from_secs_f64(config.link.budget_window_s),
            status_period: Duration::from_secs(30),
            ..VehicleConfig::new(vehicle, MissionId(config.mission.id), modem, BIT_RATE_BPS)
        };
        let mut link = VehicleLink::new(end, Codec::Auto, seed, SlotInboxState::default(), now);
        let mut surface = scenecast_surface::assemble(config, None, TuningTable::shipped(), modem, seed + 1, now)?;
        surface.set_budget(BIT_RATE_BPS, None, None, now).map_err(UserError::failed)?;
        if setting.depth {
            link.set_background(
                BackgroundOrder::from_names(&["depth".to_owned()], &surface.layers()).map_err(UserError::failed)?,
            );
            link.add_layer(LayerSource::new(
                LayerId::DEPTH,
                LayerDescriptor::depth_around(40.0, 0.5),
                Codec::Auto,
                Duration::ZERO,
            ));
        }
        let track = Track::new(setting, cell_m(config), seed);
        Ok(Self { surface, vehicle, modem, now, link, track, has_depth: setting.depth })
    }

    /// The number of cells at the surface.
    pub(super) fn explored(&self) -> usize {
        self.surface.labels(self.vehicle).map_or(0, |labels| labels.values().map(|n| *n as usize).sum())
    }

    /// Flies on until `count` more cells have arrived, with their depths.
    pub(super) fn receive(&mut self, count: usize, progress: &mut dyn FnMut(f64)) -> Result<(), UserError> {
        let (from, mut left) = (self.explored(), count);
        while left > 0 {
            let portion: Vec<(Cell, u8, f64)> = self.track.by_ref().take(left.min(PORTION)).collect();
            left -= portion.len();
            self.link.set_map(portion.iter().map(|&(cell, label, _)| (cell, label)), self.now);
            if self.has_depth {
                let depths: Vec<(Cell, f64)> = portion.iter().map(|&(cell, _, depth)| (cell, depth)).collect();
                self.link.set_layer(LayerId::DEPTH, depths, self.now);
            }
            self.exchange()?;
            progress((self.explored() - from) as f64 / count as f64);
        }
        Ok(())
    }

    /// Exchanges frames until the surface has everything.
    fn exchange(&mut self) -> Result<(), UserError> {
        for _ in 0..MAX_IDLE_FRAMES {
            while let Some(event) = self.link.poll_event() {
                if let VehicleEvent::Slot { id, content, .. } = event {
                    if let Some(Slot::Budget(budget)) = content {
                        self.link.set_budget(budget.bits_per_s, self.now);
                        self.link.set_shares(budget.shares);
                        self.link.set_background(budget.background);
                    }
                    self.link.decide(id, SlotState::Applied, self.now);
                    self.link.handle_persisted();
                }
            }
            while self.surface.poll_output().is_some() {}
            if self.link.is_converged() {
                return Ok(());
            }
            self.link.set_status(VehicleStatus::default());
            if let Some(frame) = self.surface.poll_transmit(self.now) {
                self.now = self.now + self.modem.airtime(frame.bytes.len());
                self.surface.handle_transmit_outcome(self.now);
                self.link.handle_frame(&frame.bytes, self.now);
            } else if let Some(frame) = self.link.poll_transmit(self.now) {
                self.now = self.now + self.modem.airtime(frame.bytes.len());
                self.link.handle_transmit_outcome(self.now);
                self.surface.handle_frame(&frame.bytes, self.now);
            } else {
                let timers = [self.link.poll_timeout(), self.surface.poll_timeout(self.now)];
                let next = timers.into_iter().flatten().map(|(at, _)| at).filter(|at| *at > self.now).min();
                self.now = next.unwrap_or(self.now + Duration::from_millis(100));
            }
        }
        Err(UserError::Failed("the map did not arrive at the surface".to_owned()))
    }
}

/// The cells of lanes back and forth over the square, with label and depth in metres.
struct Track {
    /// Half the side of the square, cells.
    half: i32,
    spacing: i32,
    /// Cells that are left out after each segment.
    gap: i32,
    along: i32,
    lane: i32,
    waiting: VecDeque<(Cell, u8, f64)>,
    phases: (f64, f64),
    rng: RandomStream,
    label: u8,
}

impl Track {
    fn new(setting: WideSetting, cell_m: f64, seed: u64) -> Self {
        let side = (setting.box_m / cell_m) as i32;
        let columns = (setting.cells + setting.update * setting.updates) as f64 / f64::from(LANE);
        let lanes = (columns / f64::from(side)).ceil().max(2.0);
        // Gaps stretch the track over the whole square.
        let gap = (f64::from(SEGMENT) * (lanes * f64::from(side) / columns - 1.0)).floor() as i32;
        let mut rng = RandomStream::new(seed, &[]);
        let phases = (rng.uniform() * 6.0, rng.uniform() * 6.0);
        let half = side / 2;
        let spacing = (side - LANE) / (lanes as i32 - 1);
        Self { half, spacing, gap, along: -half, lane: 0, waiting: VecDeque::new(), phases, rng, label: 1 }
    }

    fn step(&mut self) {
        if self.rng.uniform() < 0.05 {
            self.label = 1 + (self.rng.uniform() * f64::from(LABELS)) as u8;
        }
        let (along, lane) = (self.along, self.lane);
        for across in 0..LANE {
            let y = -self.half + lane * self.spacing + across;
            let speckle = self.rng.uniform() < 0.02;
            let label = if speckle { 1 + self.label % LABELS } else { self.label };
            let depth = 40.0
                + 8.0 * (f64::from(along) / 900.0 + self.phases.0).sin()
                + 2.0 * (f64::from(y) / 70.0 + self.phases.1).sin();
            self.waiting.push_back((Cell::new(if lane % 2 == 0 { along } else { -along }, y), label, depth));
        }
        self.along += if (along + self.half) % (SEGMENT + self.gap) == SEGMENT - 1 { 1 + self.gap } else { 1 };
        if self.along >= self.half {
            (self.along, self.lane) = (-self.half, lane + 1);
        }
    }
}

impl Iterator for Track {
    type Item = (Cell, u8, f64);

    fn next(&mut self) -> Option<Self::Item> {
        if self.waiting.is_empty() {
            self.step();
        }
        self.waiting.pop_front()
    }
}
