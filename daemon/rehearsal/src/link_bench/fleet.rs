//! Fourteen vehicles on one medium, none of them known at the start.

use super::table::{budget_use, round};
use super::water::{Setting, Water};
use crate::VirtualTime;
use scenecast_protocol::time::Instant;
use serde::Serialize;
use sim_channel::LossModel;
use std::time::Duration;

const VEHICLES: u8 = 14;
const LOAD: usize = 20_000;

/// How many vehicles share the medium.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FleetRow {
    /// Vehicles.
    pub vehicles: u8,
    /// Slant range of each.
    pub range_km: f64,
    /// Bytes of a full frame.
    pub frame_bytes: usize,
    /// Share of frames lost each way, collisions not counted.
    pub loss: f64,
    /// Seconds until all were known.
    pub discovered_s: f64,
    /// Time that a turn of each takes with changing hands.
    pub fair_share_s: f64,
    /// Greatest age of any vehicle's map, once each was heard.
    pub max_age_s: f64,
    /// `max_age_s` over `fair_share_s`.
    pub max_age_shares: f64,
    /// Useful payload of all over what the channel could carry of it.
    pub efficiency: f64,
    /// Worst window of any transmitter over what the budget allows with one transmission more.
    pub budget_use: f64,
}

/// Ages of the maps, sampled each second.
struct Ages {
    oldest: Duration,
}

impl Ages {
    /// Time since a frame of its state was taken or the state was known to be equal.
    fn sample(&mut self, water: &Water) {
        for vehicle in &water.vehicles {
            let taken = water.surface.end().vehicle(vehicle.address).and_then(|v| v.replica().taken());
            let settled = water.surface.end().vehicle(vehicle.address).is_some() && vehicle.host.end().is_converged();
            let age = water.now.since(taken.unwrap_or(Instant::ZERO));
            self.oldest = self.oldest.max(if settled { Duration::ZERO } else { age });
        }
    }
}

/// Measures the row over `time`; all chance is drawn from `seed`.
pub fn measure_fleet(time: Duration, seed: u64) -> FleetRow {
    let loss = 0.1;
    let mut setting = Setting::new(1000.0, 256, LossModel::Independent { probability: loss });
    setting.vehicles = VEHICLES;
    setting.discovery_period = Some(Duration::from_secs(60));
    let mut water = Water::new(&setting, seed);
    water.vehicles.iter_mut().for_each(|v| v.load = Some(LOAD));
    let began = water.now;
    let is_known = |w: &Water| {
        w.vehicles.iter().all(|v| w.surface.end().vehicle(v.address).is_some_and(|p| p.replica().taken().is_some()))
    };
    water.run_until(began + Duration::from_secs(3600), is_known);
    let found = water.now.since(began);
    water.run(Duration::from_secs(120));
    let useful = |w: &Water| -> f64 {
        w.vehicles.iter().filter_map(|v| w.surface.end().vehicle(v.address)).map(|v| v.replica().useful_bytes()).sum()
    };
    let (from, before) = (water.now, useful(&water));
    water.grants = Default::default();
    let mut ages = Ages { oldest: Duration::ZERO };
    while water.now < from + time {
        water.run(Duration::from_secs(1));
        ages.sample(&water);
    }
    let useful_bps = (useful(&water) - before) * 8.0 / water.now.since(from).as_secs_f64();
    let fair_share_s = fair_share(&water).as_secs_f64();
    FleetRow {
        vehicles: VEHICLES,
        range_km: 1.0,
        frame_bytes: 256,
        loss,
        discovered_s: round(found.as_secs_f64()),
        fair_share_s: round(fair_share_s),
        max_age_s: round(ages.oldest.as_secs_f64()),
        max_age_shares: round(ages.oldest.as_secs_f64() / fair_share_s),
        efficiency: round(useful_bps / (10_000.0 * (1.0 - loss))),
        budget_use: round(budget_use(&water)),
    }
}

/// The mean turn that was granted and what changing hands costs, for each vehicle.
fn fair_share(water: &Water) -> Duration {
    let (grants, granted) = water.grants;
    let setting = water.setting();
    let modem = setting.modem();
    let hands = setting.round_trip() + modem.turn_around * 2 + modem.airtime(GRANT_BYTES);
    (granted / grants.max(1) as u32 + hands) * u32::from(setting.vehicles)
}

/// Bytes of a grant with its acknowledgement.
const GRANT_BYTES: usize = 22;
