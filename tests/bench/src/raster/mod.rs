//! A grid of which a part changes every second, over a lossy radio: how much of the operator's copy is equal, and how old
//! the rest is; beside it the same grid sent as a whole.

mod annotated;
mod command;
mod grid;

pub use annotated::{AnnotatedFigures, annotated};
pub(crate) use command::RasterBench;
use grid::ChangingGrid;
pub use grid::Pattern;
use scenecast_config::{Config, ModemKind};
use scenecast_core::UserError;
use scenecast_protocol::directive::{OrderStatus, Slot, Utility};
use scenecast_protocol::mac::Access;
use scenecast_protocol::map::{Cell, LabelGrid, MapSource, Replica, StateReplica, StateSource};
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::time::Instant;
use scenecast_rehearsal::{LinkRig, VirtualTime, WholeReplica, WholeSource};
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Duration;

/// The grid, the radio, and how long they are watched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RasterSetting {
    /// Number of cells along each side of the grid.
    pub side: u32,
    /// Share of the cells that change every second.
    pub change: f64,
    pub pattern: Pattern,
    pub bit_rate_bps: f64,
    /// Share of the frames of each end that are lost.
    pub loss: f64,
    pub frame_bytes: usize,
    pub access: Access,
    /// Virtual time that is measured, after the first grid has arrived.
    pub duration: Duration,
}

/// The measurements of one way to send the grid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RasterFigures {
    /// Seconds until the operator has the first grid.
    pub first_s: f64,
    /// Share of equal cells: mean over time, and the least.
    pub equal: f64,
    pub least_equal: f64,
    /// Seconds from a change until the operator has it or a newer value of the cell: median and 95th percentile.
    pub age_median_s: f64,
    pub age_p95_s: f64,
    /// Oldest status that the operator had at any time, seconds.
    pub status_s: f64,
    /// Longest time from an order until the vehicle had applied it, seconds.
    pub order_s: f64,
    /// Bits on air a second, of vehicle and surface.
    pub up_bps: f64,
    pub down_bps: f64,
    /// Time of computing of the vehicle's and of the surface's end for each second; on a busy machine more than the CPU time.
    pub vehicle_cpu: f64,
    pub surface_cpu: f64,
}

/// A replicated grid: the vehicle's side takes values, the surface's side shows them.
trait Sends: StateSource {
    type Copy: StateReplica + Shows;
    fn set(&mut self, cells: &[(Cell, u8)], now: Instant);
}

trait Shows {
    fn value(&self, cell: Cell) -> u8;
}

impl Sends for MapSource {
    type Copy = Replica;

    fn set(&mut self, cells: &[(Cell, u8)], now: Instant) {
        Self::set(self, cells.iter().copied(), now);
    }
}

impl Shows for Replica {
    fn value(&self, cell: Cell) -> u8 {
        self.shown().get(cell)
    }
}

/// Sends the changes of the grid.
pub fn changes(setting: &RasterSetting, seed: u64, progress: &mut dyn FnMut(f64)) -> Result<RasterFigures, UserError> {
    measure(setting, MapSource::new(Codec::Auto), seed, progress)
}

/// Sends the whole grid as a PNG, again and again.
pub fn whole(setting: &RasterSetting, seed: u64, progress: &mut dyn FnMut(f64)) -> Result<RasterFigures, UserError> {
    measure::<WholeSource>(setting, WholeSource::default(), seed, progress)
}

impl Shows for WholeReplica {
    fn value(&self, cell: Cell) -> u8 {
        self.shown().get(cell)
    }
}

impl Sends for WholeSource {
    type Copy = WholeReplica;

    fn set(&mut self, cells: &[(Cell, u8)], _now: Instant) {
        Self::set(self, cells);
    }
}

impl RasterSetting {
    /// Both ends at the radio, with a status each second. 7.5 m take sound as long as a radio takes to process a frame: 5 ms.
    fn rig<S: StateSource, R: StateReplica>(&self, source: S, seed: u64) -> Result<LinkRig<S, R>, UserError> {
        let mut config = Config::default();
        config.modem.kind = ModemKind::Udp;
        config.modem.full_duplex = self.access == Access::FullDuplex;
        config.link.frame_bytes = self.frame_bytes as u32;
        config.link.budget_bps = self.bit_rate_bps as u32;
        config.link.turn_around_s = 0.005;
        config.link.status_period_s = 1.0;
        config.link.discovery_period_s = 0.0;
        config.channel.bit_rate = self.bit_rate_bps;
        config.channel.loss = self.loss;
        config.channel.half_duplex = false;
        config.channel.range_m = 7.5;
        LinkRig::new(&config, source, seed)
    }
}

/// Time between two looks at the operator's copy.
const LOOK: Duration = Duration::from_millis(100);
const ORDER_INTERVAL: Duration = Duration::from_secs(7);
/// Longest wait for the first grid.
const GIVE_UP: Duration = Duration::from_secs(3600);

fn measure<S: Sends>(
    setting: &RasterSetting,
    source: S,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<RasterFigures, UserError> {
    let mut grid = ChangingGrid::new(setting.side, seed);
    let mut rig: LinkRig<S, S::Copy> = setting.rig(source, seed)?;
    let began = rig.now;
    rig.vehicle.end_mut().source_mut().set(&grid.all(), began);
    let mut watch = Watch::new(grid.values());
    loop {
        rig.run(LOOK);
        watch.look(copy(&rig), rig.now);
        if watch.waiting.is_empty() || rig.now.since(began) > GIVE_UP {
            break;
        }
    }
    let first_s = rig.now.since(began).as_secs_f64();
    watch.begin();
    let (bits, computed) = (rig.bits_on_air(), rig.computed());
    let (from, until) = (rig.now, rig.now + setting.duration);
    let (mut next_change, mut next_order) = (rig.now, rig.now + LOOK);
    let mut order: Option<(u16, Instant)> = None;
    let (mut status_s, mut order_s) = (0f64, 0f64);
    while rig.now < until {
        if rig.now >= next_change {
            next_change = next_change + Duration::from_secs(1);
            let changed = grid.step(setting.pattern, setting.change);
            rig.vehicle.end_mut().source_mut().set(&changed, rig.now);
            watch.change(&changed, rig.now);
            progress(rig.now.since(from).as_secs_f64() / setting.duration.as_secs_f64());
        }
        if rig.now >= next_order && order.is_none() {
            next_order = rig.now + ORDER_INTERVAL;
            let slot =
                Slot::Utility(Utility { exploration: (rig.now.as_secs_f64() as i64 % 90) as i8, ..Utility::default() });
            let issued = rig.surface.end_mut().issue(rig.address, slot, rig.now);
            order = Some((issued.map_err(UserError::failed)?, rig.now));
        }
        rig.run(LOOK);
        watch.look(copy(&rig), rig.now);
        status_s = status_s.max(rig.status_age_s());
        if let Some((version, issued)) = order {
            let at = rig.applied.get(&version).copied();
            order_s = order_s.max(at.unwrap_or(rig.now).since(issued).as_secs_f64());
            let is_known = rig.view().is_some_and(|view| view.slots().any(|s| s.status == OrderStatus::Applied));
            order = order.filter(|_| at.is_none() || !is_known);
        }
    }
    let seconds = setting.duration.as_secs_f64();
    let [up_bps, down_bps] = [0, 1].map(|end| (rig.bits_on_air()[end] - bits[end]) as f64 / seconds);
    let [vehicle_cpu, surface_cpu] = [0, 1].map(|end| (rig.computed()[end] - computed[end]).as_secs_f64() / seconds);
    let (equal, least_equal) = watch.equal();
    let [age_median_s, age_p95_s] = watch.ages(rig.now);
    Ok(RasterFigures {
        first_s,
        equal,
        least_equal,
        age_median_s,
        age_p95_s,
        status_s,
        order_s,
        up_bps,
        down_bps,
        vehicle_cpu,
        surface_cpu,
    })
}

/// The operator's copy; the surface knows the vehicle from the start.
fn copy<S: StateSource, R: StateReplica>(rig: &LinkRig<S, R>) -> &R {
    rig.view().map(|view| view.replica()).unwrap_or_else(|| unreachable!())
}

/// Compares the operator's copy with the grid.
struct Watch {
    /// The present values, and those of cells that the operator does not have, with the time since when.
    target: LabelGrid,
    waiting: BTreeMap<Cell, Instant>,
    cells: usize,
    ages: Vec<f64>,
    shares: Vec<f64>,
}

impl Watch {
    fn new(target: LabelGrid) -> Self {
        let waiting: BTreeMap<Cell, Instant> = target.iter().map(|(cell, _)| (cell, Instant::ZERO)).collect();
        Self { cells: waiting.len(), target, waiting, ages: Vec::new(), shares: Vec::new() }
    }

    fn begin(&mut self) {
        (self.ages, self.shares) = (Vec::new(), Vec::new());
    }

    fn change(&mut self, cells: &[(Cell, u8)], now: Instant) {
        for &(cell, value) in cells {
            self.target.set(cell, value);
            self.waiting.entry(cell).or_insert(now);
        }
    }

    fn look(&mut self, copy: &impl Shows, now: Instant) {
        let (target, ages) = (&self.target, &mut self.ages);
        self.waiting.retain(|&cell, since| {
            let has_arrived = copy.value(cell) == target.get(cell);
            ages.extend(has_arrived.then(|| now.since(*since).as_secs_f64()));
            !has_arrived
        });
        self.shares.push(1.0 - self.waiting.len() as f64 / self.cells as f64);
    }

    /// Mean and least share of equal cells.
    fn equal(&self) -> (f64, f64) {
        let mean = self.shares.iter().sum::<f64>() / self.shares.len().max(1) as f64;
        (mean, self.shares.iter().copied().fold(1.0, f64::min))
    }

    /// Median and 95th percentile of the ages; a change that has not arrived counts with its age so far.
    fn ages(&self, now: Instant) -> [f64; 2] {
        let waiting = self.waiting.values().map(|&since| now.since(since).as_secs_f64());
        let mut all: Vec<f64> = self.ages.iter().copied().chain(waiting).collect();
        all.sort_by(f64::total_cmp);
        [0.5, 0.95].map(|share| all.get((all.len() as f64 * share) as usize).copied().unwrap_or(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_is_at_most_two_seconds_old_on_a_lossy_radio() {
        let setting = RasterSetting {
            side: 80,
            change: 0.02,
            pattern: Pattern::Patches,
            bit_rate_bps: 200_000.0,
            loss: 0.2,
            frame_bytes: 1000,
            access: Access::FullDuplex,
            duration: Duration::from_secs(60),
        };
        let ages: Vec<f64> = (1..=10).map(|seed| changes(&setting, seed, &mut |_| {}).unwrap().status_s).collect();
        println!("oldest status of each seed: {ages:.2?} s");
        assert!(ages.iter().all(|&age| age <= 2.0), "{ages:.2?}");
    }

    #[test]
    fn changes_of_a_grid_arrive_sooner_than_whole_grids() {
        let setting = RasterSetting {
            side: 60,
            change: 0.02,
            pattern: Pattern::Scattered,
            bit_rate_bps: 20_000.0,
            loss: 0.2,
            frame_bytes: 500,
            access: Access::FullDuplex,
            duration: Duration::from_secs(20),
        };
        let ours = changes(&setting, 3, &mut |_| {}).unwrap();
        assert_eq!(
            RasterFigures { vehicle_cpu: 0.0, surface_cpu: 0.0, ..ours },
            RasterFigures { vehicle_cpu: 0.0, surface_cpu: 0.0, ..changes(&setting, 3, &mut |_| {}).unwrap() }
        );
        let theirs = whole(&setting, 3, &mut |_| {}).unwrap();
        assert!(
            ours.equal > 0.98 && ours.age_median_s < 1.0 && ours.status_s <= 3.0 && ours.order_s <= 2.0,
            "{ours:?}"
        );
        assert!(theirs.equal < ours.equal && theirs.age_median_s > ours.age_median_s, "{theirs:?}");
    }
}
